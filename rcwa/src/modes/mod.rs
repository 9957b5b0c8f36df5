// SPDX-License-Identifier: MIT OR Apache-2.0
//! Eigenmodes of one layer (1.1), and the coordinates (2.1) in which layers are joined.
//!
//! ε depends on x alone, so the modes of a layer split exactly, at any truncation, into those
//! without Ex (LSE) and those without Hx (LSM). With E the Toeplitz matrix of ε, A that of 1/ε and
//! K = diag(kx_m):
//!
//! - LSE: (E - K²) f = b f
//! - LSM: (1 - K E⁻¹ K) g = b A g
//!
//! and kz² = b - ky². Neither the vectors nor b depend on ky, so one pair of problems serves all
//! azimuths and both polarisations. The tangential fields are written in *coordinates* (ex, ey |
//! hy, hx),
//!
//! - Ex = A g ex,             Ey = f (ey - ky O ex)
//! - Hy = g (hy + ky Q hx),   Hx = -f hx
//!
//! with O = f⁻¹ E⁻¹ K g / b_g = f⁻¹ K A g (rows / b_f) and Q = g⁻¹ K f / b_f (columns) = (Ag)⁻¹ K
//! E⁻¹ f (rows / b_g) (2.2). An LSE mode then is (ey, hx) = (1, b/kz), an LSM mode (ex, hy) = (1,
//! kz/b), and the coordinates pair into the energy flux Re(ex* hy + ey* hx) of a lossless layer.
//!
//! The two forms of O and Q are equal, so each element is computed with the larger of the two
//! denominators. Both fail only where an LSE and an LSM mode have b near 0 together: there the
//! modes degenerate, kz² = -ky². Such elements are left out of O and Q, and the modes concerned
//! propagate together ([`DegenerateModes`]).

mod absorbing;
mod correction_step;
mod definite;
mod degenerate_modes;
mod lossless;
mod normal_vector;
mod real;
mod strips;
mod uniform;

pub(crate) use correction_step::CorrectionStep;
pub(crate) use degenerate_modes::{DegenerateModes, DegenerateTransfer};
pub(crate) use normal_vector::VerticalLayer;

use crate::error::Error;
use crate::expansion::real::RealFunctions;
use crate::expansion::{Expansion, FourierOrders};
use crate::linalg::{CMat, Scalar, adjoint, delta, mul};
use crate::relief::{Layer, is_dielectric};
use faer::Mat;
use num_complex::Complex64;

/// An LSE and an LSM mode with |b| below this count as degenerate. The joint treatment is exact, so
/// the value only decides how much is lost to cancellation (two digits at most) before it begins.
const DEGENERACY: f64 = 2e-2;

/// Coordinates of the tangential fields in a layer; see the module's top.
#[derive(Clone, Debug)]
pub(crate) struct Basis<T = Complex64> {
    /// f.
    pub(crate) f: Mat<T>,
    /// f⁻¹.
    pub(crate) f_inverse: Mat<T>,
    /// A g.
    pub(crate) ag: Mat<T>,
    /// (A g)⁻¹.
    pub(crate) ag_inverse: Mat<T>,
    /// g.
    pub(crate) g: Mat<T>,
    /// g⁻¹.
    pub(crate) g_inverse: Mat<T>,
    /// O.
    pub(crate) o: Mat<T>,
    /// Q.
    pub(crate) q: Mat<T>,
}

impl<T: Scalar> Basis<T> {
    /// The Fourier coefficients (Ex, Ey | Hy, -Hx) themselves, in which half-spaces are written;
    /// the numbers are those of Ex and Hy, and of Ey and Hx.
    pub(crate) fn fourier([lsm, lse]: [usize; 2]) -> Self {
        let one = |n| Mat::identity(n, n);
        Self {
            f: one(lse),
            f_inverse: one(lse),
            ag: one(lsm),
            ag_inverse: one(lsm),
            g: one(lsm),
            g_inverse: one(lsm),
            o: Mat::zeros(lse, lsm),
            q: Mat::zeros(lsm, lse),
        }
    }
}

/// Modes of one layer for one kx0, good for every ky.
#[derive(Clone, Debug)]
pub(crate) struct Modes<T = Complex64> {
    /// Coordinates.
    pub(crate) basis: Basis<T>,
    /// b of the LSE modes.
    pub(crate) b_lse: Vec<T>,
    /// b of the LSM modes.
    pub(crate) b_lsm: Vec<T>,
    /// Degenerate modes, if any.
    pub(crate) degenerate: Option<DegenerateModes<T>>,
}

impl<T: Scalar> Modes<T> {
    /// kz² = b - ky² of the LSM modes, then of the LSE modes (1.1).
    pub(crate) fn kz_squared(&self, ky_squared: f64) -> Vec<T> {
        let of = |&b: &T| b - T::ONE.scaled(ky_squared);
        self.b_lsm.iter().chain(&self.b_lse).map(of).collect()
    }
}

/// Modes of `layer` for the in-plane wavevectors `kx` (units of k0).
pub(crate) fn modes(layer: &Layer, kx: &[f64]) -> Result<Modes, Error> {
    if let Some(index) = layer.uniform_index() {
        return Ok(uniform::modes(index, kx));
    }
    let definite = layer.segments.iter().all(|s| is_dielectric(s.index));
    let solved = if definite { lossless::modes(layer, kx)? } else { None };
    match solved {
        Some(modes) => Ok(modes),
        None => absorbing::modes(layer, kx),
    }
}

/// Functions of x in which the modes of a layer can be expanded.
pub(crate) trait ModeExpansion<T: Scalar>: Expansion<T> {
    /// Modes of `layer`; `None` if it has none in these functions.
    fn modes(&self, layer: &Layer) -> Result<Option<Modes<T>>, Error>;
}

impl ModeExpansion<Complex64> for FourierOrders<'_> {
    fn modes(&self, layer: &Layer) -> Result<Option<Modes>, Error> {
        modes(layer, self.0).map(Some)
    }
}

impl ModeExpansion<f64> for RealFunctions {
    fn modes(&self, layer: &Layer) -> Result<Option<Modes<f64>>, Error> {
        real::modes(layer, self)
    }
}

/// Numerators of [`Basis::o`], [`Basis::q`] and [`DegenerateModes`], before division by b.
struct Overlaps<T = Complex64> {
    /// f⁻¹ E⁻¹ K g, equal to O b_g.
    o_by_lsm: Mat<T>,
    /// f⁻¹ K A g, equal to b_f O.
    o_by_lse: Mat<T>,
    /// g⁻¹ K f, equal to Q b_f.
    q_by_lse: Mat<T>,
    /// (Ag)⁻¹ K E⁻¹ f, equal to b_g Q.
    q_by_lsm: Mat<T>,
}

/// Divides by the larger of the two denominators; elements where both are below [`DEGENERACY`]
/// become 0.
fn quotient<T: Scalar>(
    b_lse: &[T],
    b_lsm: &[T],
    by_lse: impl Fn(usize, usize) -> T,
    by_lsm: impl Fn(usize, usize) -> T,
) -> impl Fn(usize, usize) -> T {
    let inverse =
        |b: &[T]| -> Vec<(f64, T)> { b.iter().map(|&b| (b.squared(), b.inverted())).collect() };
    let (lse_inverse, lsm_inverse) = (inverse(b_lse), inverse(b_lsm));
    move |lse, lsm| {
        let ((f2, by_f), (g2, by_g)) = (lse_inverse[lse], lsm_inverse[lsm]);
        if f2.max(g2) < DEGENERACY * DEGENERACY {
            T::ZERO
        } else if f2 > g2 {
            by_lse(lse, lsm) * by_f
        } else {
            by_lsm(lse, lsm) * by_g
        }
    }
}

/// O and Q from their numerators, and the degenerate modes. `electric_norm` is f⁻¹ E⁻¹ f,
/// `magnetic_norm` (Ag)⁻¹ A A g; both are read only at degenerate modes.
fn coupled<T: Scalar>(
    overlaps: &Overlaps<T>,
    (b_lse, b_lsm): (&[T], &[T]),
    electric_norm: impl Fn(usize, usize) -> T,
    magnetic_norm: impl Fn(usize, usize) -> T,
) -> (Mat<T>, Mat<T>, Option<DegenerateModes<T>>) {
    let (lse, lsm) = (b_lse.len(), b_lsm.len());
    let o_element =
        quotient(b_lse, b_lsm, |i, j| overlaps.o_by_lse[(i, j)], |i, j| overlaps.o_by_lsm[(i, j)]);
    let q_element =
        quotient(b_lse, b_lsm, |i, j| overlaps.q_by_lse[(j, i)], |i, j| overlaps.q_by_lsm[(j, i)]);
    let o = Mat::from_fn(lse, lsm, &o_element);
    let q = Mat::from_fn(lsm, lse, |j, i| q_element(i, j));
    let norms = (electric_norm, magnetic_norm);
    let degenerate = DegenerateModes::find((b_lse, b_lsm), overlaps, (&o, &q), norms);
    (o, q, degenerate)
}

/// Largest deviation of f⁻¹ f and (Ag)⁻¹ (A g) from the identity: the accuracy of the modes of a
/// layer.
pub(crate) fn residual(layer: &Layer, kx: &[f64]) -> Result<f64, Error> {
    let Modes { basis, .. } = modes(layer, kx)?;
    let deviation = |inverse: &CMat, matrix: &CMat| {
        let product = mul(inverse, matrix);
        let mut worst = 0.0_f64;
        for j in 0..product.ncols() {
            for i in 0..product.nrows() {
                worst = worst.max((product[(i, j)] - delta::<Complex64>(i, j)).norm());
            }
        }
        worst
    };
    let lse = deviation(&basis.f_inverse, &basis.f);
    let lsm = deviation(&basis.ag_inverse, &basis.ag).max(deviation(&basis.g_inverse, &basis.g));
    Ok(lse.max(lsm))
}

/// Basis of orthonormal modes, whose inverses are adjoints: f⁻¹ = fᴴ, (Ag)⁻¹ = gᴴ, g⁻¹ = (Ag)ᴴ.
fn orthonormal_basis<T: Scalar>(
    f: Mat<T>,
    g: Mat<T>,
    ag: Mat<T>,
    o: Mat<T>,
    q: Mat<T>,
) -> Basis<T> {
    Basis {
        f_inverse: adjoint(&f),
        ag_inverse: adjoint(&g),
        g_inverse: adjoint(&ag),
        f,
        ag,
        g,
        o,
        q,
    }
}

#[cfg(test)]
mod tests;
