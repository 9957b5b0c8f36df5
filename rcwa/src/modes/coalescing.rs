// SPDX-License-Identifier: MIT OR Apache-2.0
//! LSE and LSM modes that coalesce: the few of a layer whose b is near 0.
//!
//! Let I be those LSE modes and J those LSM modes. In the coordinates of [`super::Basis`], whose O and Q lack the
//! elements (I, J), these modes obey a small system with no division by b,
//!
//! - -i d/dz (ex_J, ey_I) = P (hy_J, hx_I),   P = [ b_J, -ky q ; -ky k, 1 - ky² r_I ]
//! - -i d/dz (hy_J, hx_I) = R (ex_J, ey_I),   R = [ 1 - ky² r_J, ky a ; ky l, b_I ]
//!
//! where k = (O b_g), l = (b_f O), a = (Q b_f), q = (b_g Q) are the elements (I, J) of the numerators, and the identities
//! K Q + f⁻¹E⁻¹f = 1/b_f (K = O b_g) and its LSM twin a O + (Ag)⁻¹ A A g = 1/b_g turn the differences of large numbers
//! into the regular sums r over the other modes.

use super::Overlaps;
use crate::linalg::{CMat, mul};
use faer::Mat;
use num_complex::Complex64;

/// The coalescing modes of a layer; see the module's top.
#[derive(Clone, Debug)]
pub(crate) struct Coalescing {
    /// Numbers of the LSE modes, I.
    pub(crate) lse: Vec<usize>,
    /// Numbers of the LSM modes, J.
    pub(crate) lsm: Vec<usize>,
    /// k, shape (I, J).
    pub(super) o_by_lsm: CMat,
    /// l, shape (I, J).
    pub(super) o_by_lse: CMat,
    /// a, shape (J, I).
    pub(super) q_by_lse: CMat,
    /// q, shape (J, I).
    pub(super) q_by_lsm: CMat,
    /// r_I, shape (I, I).
    pub(super) rest_lse: CMat,
    /// r_J, shape (J, J).
    pub(super) rest_lsm: CMat,
}

/// How the coordinates (ex_J, ey_I) and (hy_J, hx_I) at the top of a slab follow from those at its bottom:
/// e' = ce e - i se h, h' = ch h - i sh e.
pub(crate) struct Transfer {
    pub(crate) ce: CMat,
    pub(crate) se: CMat,
    pub(crate) ch: CMat,
    pub(crate) sh: CMat,
}

impl Coalescing {
    /// The coalescing modes among those with the given `b`, or `None`. `electric_norm` is f⁻¹ E⁻¹ f, `magnetic_norm`
    /// (Ag)⁻¹ A A g; both are read only at the coalescing modes.
    pub(super) fn find(
        critical_lse: Vec<usize>,
        critical_lsm: Vec<usize>,
        overlaps: &Overlaps,
        (o, q): (&CMat, &CMat),
        electric_norm: impl Fn(usize, usize) -> Complex64,
        magnetic_norm: impl Fn(usize, usize) -> Complex64,
    ) -> Option<Self> {
        if critical_lse.is_empty() || critical_lsm.is_empty() {
            return None;
        }
        let n = o.nrows();
        let part = |m: &CMat, rows: &[usize], columns: &[usize]| -> CMat {
            Mat::from_fn(rows.len(), columns.len(), |i, j| m[(rows[i], columns[j])])
        };
        let rest_lse = Mat::from_fn(critical_lse.len(), critical_lse.len(), |i, j| {
            let (i, j) = (critical_lse[i], critical_lse[j]);
            let others = (0..n).filter(|m| !critical_lsm.contains(m));
            electric_norm(i, j)
                + others
                    .map(|m| overlaps.o_by_lsm[(i, m)] * q[(m, j)])
                    .sum::<Complex64>()
        });
        let rest_lsm = Mat::from_fn(critical_lsm.len(), critical_lsm.len(), |i, j| {
            let (i, j) = (critical_lsm[i], critical_lsm[j]);
            let others = (0..n).filter(|m| !critical_lse.contains(m));
            magnetic_norm(i, j)
                + others
                    .map(|m| overlaps.q_by_lse[(i, m)] * o[(m, j)])
                    .sum::<Complex64>()
        });
        Some(Self {
            o_by_lsm: part(&overlaps.o_by_lsm, &critical_lse, &critical_lsm),
            o_by_lse: part(&overlaps.o_by_lse, &critical_lse, &critical_lsm),
            q_by_lse: part(&overlaps.q_by_lse, &critical_lsm, &critical_lse),
            q_by_lsm: part(&overlaps.q_by_lsm, &critical_lsm, &critical_lse),
            rest_lse,
            rest_lsm,
            lse: critical_lse,
            lsm: critical_lsm,
        })
    }

    /// Exact transfer through a slab of the given thickness (times k0), which must be at most a few 1/|kz|.
    pub(crate) fn transfer(
        &self,
        (b_lse, b_lsm): (&[Complex64], &[Complex64]),
        ky: f64,
        thickness: f64,
    ) -> Transfer {
        let (lse, lsm) = (self.lse.len(), self.lsm.len());
        let size = lsm + lse;
        let delta = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let p = Mat::from_fn(size, size, |i, j| match (i < lsm, j < lsm) {
            (true, true) => b_lsm[self.lsm[i]] * delta(i, j),
            (true, false) => -ky * self.q_by_lsm[(i, j - lsm)],
            (false, true) => -ky * self.o_by_lsm[(i - lsm, j)],
            (false, false) => delta(i, j) - ky * ky * self.rest_lse[(i - lsm, j - lsm)],
        });
        let r = Mat::from_fn(size, size, |i, j| match (i < lsm, j < lsm) {
            (true, true) => delta(i, j) - ky * ky * self.rest_lsm[(i, j)],
            (true, false) => ky * self.q_by_lse[(i, j - lsm)],
            (false, true) => ky * self.o_by_lse[(i - lsm, j)],
            (false, false) => b_lse[self.lse[i - lsm]] * delta(i, j),
        });
        let (ce, sinc_e) = cosine_and_sinc(&mul(&p, &r), thickness);
        let (ch, sinc_h) = cosine_and_sinc(&mul(&r, &p), thickness);
        Transfer {
            ce,
            se: mul(&sinc_e, &p),
            ch,
            sh: mul(&sinc_h, &r),
        }
    }
}

/// cos(d √m) and sin(d √m)/√m by their power series; m is a few by a few and d² |m| moderate.
fn cosine_and_sinc(m: &CMat, d: f64) -> (CMat, CMat) {
    let size = m.nrows();
    let mut term: CMat = Mat::identity(size, size);
    let mut cosine = term.clone();
    let mut sinc: CMat = Mat::from_fn(size, size, |i, j| term[(i, j)] * d);
    for k in 1..60 {
        let next = mul(&term, m);
        let k2 = f64::from(2 * k);
        let factor = -d * d / (k2 * (k2 - 1.0));
        term = Mat::from_fn(size, size, |i, j| next[(i, j)] * factor);
        let mut largest = 0.0_f64;
        for j in 0..size {
            for i in 0..size {
                cosine[(i, j)] += term[(i, j)];
                sinc[(i, j)] += term[(i, j)] * (d / (k2 + 1.0));
                largest = largest.max(term[(i, j)].norm());
            }
        }
        if largest < 1e-20 {
            break;
        }
    }
    (cosine, sinc)
}
