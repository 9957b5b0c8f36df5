// SPDX-License-Identifier: MIT OR Apache-2.0
//! Degenerate modes: the few LSE and LSM modes of a layer whose b is near 0 together (2.4).
//!
//! Let I be those LSE modes and J those LSM modes. In the coordinates of [`super::Basis`], whose O
//! and Q lack the elements (I, J), these modes obey a small system without division by b,
//!
//! - -i d/dz (ex_J, ey_I) = P (hy_J, hx_I),   P = [ b_J, -ky q ; -ky k, 1 - ky² r_I ]
//! - -i d/dz (hy_J, hx_I) = R (ex_J, ey_I),   R = [ 1 - ky² r_J, ky a ; ky l, b_I ]
//!
//! where k = (O b_g), l = (b_f O), a = (Q b_f), q = (b_g Q) are the elements (I, J) of the
//! numerators, and the identities K Q + f⁻¹E⁻¹f = 1/b_f (K = O b_g) and its LSM twin a O + (Ag)⁻¹ A
//! A g = 1/b_g turn the differences of large numbers into the regular sums r over the other modes.

use super::{DEGENERACY, Overlaps};
use crate::linalg::{Scalar, mul};
use faer::Mat;
use num_complex::Complex64;

/// The degenerate modes of a layer.
#[derive(Clone, Debug)]
pub(crate) struct DegenerateModes<T = Complex64> {
    /// Numbers of the LSE modes, I.
    pub(crate) lse: Vec<usize>,
    /// Numbers of the LSM modes, J.
    pub(crate) lsm: Vec<usize>,
    /// b of the LSE modes.
    pub(super) b_lse: Vec<T>,
    /// b of the LSM modes.
    pub(super) b_lsm: Vec<T>,
    /// k, shape (I, J).
    pub(super) o_by_lsm: Mat<T>,
    /// l, shape (I, J).
    pub(super) o_by_lse: Mat<T>,
    /// a, shape (J, I).
    pub(super) q_by_lse: Mat<T>,
    /// q, shape (J, I).
    pub(super) q_by_lsm: Mat<T>,
    /// r_I, shape (I, I).
    pub(super) rest_lse: Mat<T>,
    /// r_J, shape (J, J).
    pub(super) rest_lsm: Mat<T>,
}

/// Coordinates (ex_J, ey_I) and (hy_J, hx_I) at the top of a slab as functions of those at its
/// bottom: e' = ce e - i se h, h' = ch h - i sh e; in real numbers e' = ce e + se h, h' = ch h - sh
/// e.
pub(crate) struct DegenerateTransfer<T> {
    pub(crate) ce: Mat<T>,
    pub(crate) se: Mat<T>,
    pub(crate) ch: Mat<T>,
    pub(crate) sh: Mat<T>,
}

impl<T: Scalar> DegenerateModes<T> {
    /// The degenerate modes among those with the given b (LSE, LSM), or `None`. The norms are those
    /// of [`super::coupled`].
    pub(super) fn find(
        (b_lse, b_lsm): (&[T], &[T]),
        overlaps: &Overlaps<T>,
        (o, q): (&Mat<T>, &Mat<T>),
        (electric_norm, magnetic_norm): (impl Fn(usize, usize) -> T, impl Fn(usize, usize) -> T),
    ) -> Option<Self> {
        let near_zero = |b: &[T]| -> Vec<usize> {
            let is_small = |&m: &usize| b[m].squared() < DEGENERACY * DEGENERACY;
            (0..b.len()).filter(is_small).collect()
        };
        let (lse, lsm) = (near_zero(b_lse), near_zero(b_lsm));
        if lse.is_empty() || lsm.is_empty() {
            return None;
        }
        let part = |m: &Mat<T>, rows: &[usize], columns: &[usize]| -> Mat<T> {
            Mat::from_fn(rows.len(), columns.len(), |i, j| m[(rows[i], columns[j])])
        };
        let rest_lse = Mat::from_fn(lse.len(), lse.len(), |i, j| {
            let (i, j) = (lse[i], lse[j]);
            let others = (0..o.ncols()).filter(|m| !lsm.contains(m));
            others.fold(electric_norm(i, j), |sum, m| sum + overlaps.o_by_lsm[(i, m)] * q[(m, j)])
        });
        let rest_lsm = Mat::from_fn(lsm.len(), lsm.len(), |i, j| {
            let (i, j) = (lsm[i], lsm[j]);
            let others = (0..o.nrows()).filter(|m| !lse.contains(m));
            others.fold(magnetic_norm(i, j), |sum, m| sum + overlaps.q_by_lse[(i, m)] * o[(m, j)])
        });
        Some(Self {
            o_by_lsm: part(&overlaps.o_by_lsm, &lse, &lsm),
            o_by_lse: part(&overlaps.o_by_lse, &lse, &lsm),
            q_by_lse: part(&overlaps.q_by_lse, &lsm, &lse),
            q_by_lsm: part(&overlaps.q_by_lsm, &lsm, &lse),
            b_lse: lse.iter().map(|&i| b_lse[i]).collect(),
            b_lsm: lsm.iter().map(|&j| b_lsm[j]).collect(),
            rest_lse,
            rest_lsm,
            lse,
            lsm,
        })
    }

    /// Exact transfer through a slab of the given thickness (times k0), which must be at most a few
    /// 1/|kz|.
    pub(crate) fn transfer(&self, ky: f64, thickness: f64) -> DegenerateTransfer<T> {
        let (lse, lsm) = (self.lse.len(), self.lsm.len());
        let size = lsm + lse;
        let on_diagonal = |i: usize, j: usize, value: T| if i == j { value } else { T::ZERO };
        let p = Mat::from_fn(size, size, |i, j| match (i < lsm, j < lsm) {
            (true, true) => on_diagonal(i, j, self.b_lsm[i]),
            (true, false) => self.q_by_lsm[(i, j - lsm)].scaled(-ky),
            (false, true) => self.o_by_lsm[(i - lsm, j)].scaled(-ky),
            (false, false) => {
                on_diagonal(i, j, T::ONE) - self.rest_lse[(i - lsm, j - lsm)].scaled(ky * ky)
            }
        });
        let r = Mat::from_fn(size, size, |i, j| match (i < lsm, j < lsm) {
            (true, true) => on_diagonal(i, j, T::ONE) - self.rest_lsm[(i, j)].scaled(ky * ky),
            (true, false) => self.q_by_lse[(i, j - lsm)].scaled(ky),
            (false, true) => self.o_by_lse[(i - lsm, j)].scaled(ky),
            (false, false) => on_diagonal(i, j, self.b_lse[i - lsm]),
        });
        let (ce, sinc_e) = cosine_and_sinc(&mul(&p, &r), thickness);
        let (ch, sinc_h) = cosine_and_sinc(&mul(&r, &p), thickness);
        DegenerateTransfer { ce, se: mul(&sinc_e, &p), ch, sh: mul(&sinc_h, &r) }
    }
}

/// cos(d √m) and sin(d √m)/√m by their power series; m is a few by a few and d² |m| moderate.
fn cosine_and_sinc<T: Scalar>(m: &Mat<T>, d: f64) -> (Mat<T>, Mat<T>) {
    let size = m.nrows();
    let mut term: Mat<T> = Mat::identity(size, size);
    let mut cosine = term.clone();
    let mut sinc: Mat<T> = Mat::from_fn(size, size, |i, j| term[(i, j)].scaled(d));
    for k in 1..60 {
        let next = mul(&term, m);
        let k2 = f64::from(2 * k);
        let factor = -d * d / (k2 * (k2 - 1.0));
        term = Mat::from_fn(size, size, |i, j| next[(i, j)].scaled(factor));
        let mut largest = 0.0_f64;
        for j in 0..size {
            for i in 0..size {
                cosine[(i, j)] += term[(i, j)];
                sinc[(i, j)] += term[(i, j)].scaled(d / (k2 + 1.0));
                largest = largest.max(term[(i, j)].squared());
            }
        }
        if largest < 1e-40 {
            break;
        }
    }
    (cosine, sinc)
}
