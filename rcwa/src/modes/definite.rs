// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modes of a layer of real positive ε: Hermitian problems, whose b is exactly real.
//!
//! E and A are Hermitian and positive definite, so that f can be orthonormal and g A-orthonormal.
//! No branch of a square root is ever chosen by round-off. With D for K, or for ∂ where coordinates
//! are real,
//!
//! - LSE: (E - κ²) f = b f,   LSM: (1 - Dᴴ E⁻¹ D) g = b A g,   O = fᴴ E⁻¹ D g / b_g = fᴴ D A g /
//!   b_f

use super::{Modes, Overlaps, coupled, orthonormal_basis};
use crate::error::Error;
use crate::linalg::{
    CMat, RMat, Scalar, adjoint, cholesky, delta, mul, solve_lower, solve_lower_adjoint,
};
use faer::Mat;
use num_complex::Complex64;

/// The derivative along x, from functions of Ex and Hy to those of Ey, Ez and Hx.
pub(super) trait Derivative<T: Scalar> {
    /// κ² of each function of Ey.
    fn kappa_squared(&self) -> Vec<f64>;

    /// D m.
    fn times(&self, m: &Mat<T>) -> Mat<T>;

    /// Dᴴ m D.
    fn sandwich(&self, m: &Mat<T>) -> Mat<T>;
}

/// Eigenpairs of both families, and the numerators of their coupling.
pub(super) struct Eigenpairs<T> {
    pub(super) b_lse: Vec<f64>,
    pub(super) b_lsm: Vec<f64>,
    pub(super) f: Mat<T>,
    pub(super) g: Mat<T>,
    pub(super) ag: Mat<T>,
    /// E⁻¹ f.
    pub(super) ef: Mat<T>,
    /// O b_g and b_f O.
    pub(super) overlaps: [Mat<T>; 2],
}

impl<T: Scalar> Eigenpairs<T> {
    /// From E, A and D; `None` where truncation leaves a matrix that is not definite.
    pub(super) fn new(
        e: Mat<T>,
        a: &Mat<T>,
        d: &impl Derivative<T>,
    ) -> Result<Option<Self>, Error> {
        let (Some(e_inverse), Some(l)) = (T::inverse_of_definite(&e), cholesky(a)) else {
            return Ok(None);
        };
        let mut lse = e;
        for (i, square) in d.kappa_squared().into_iter().enumerate() {
            lse[(i, i)] += T::ONE.scaled(-square);
        }
        let (b_lse, f) = T::eigen(&lse)?;

        // With A = L Lᴴ and v = Lᴴ g an ordinary problem, and A g = L v.
        let sandwich = d.sandwich(&e_inverse);
        let mut lsm: Mat<T> =
            Mat::from_fn(a.nrows(), a.nrows(), |i, j| delta::<T>(i, j) - sandwich[(i, j)]);
        solve_lower(&l, lsm.as_mut());
        let mut lsm = adjoint(&lsm);
        solve_lower(&l, lsm.as_mut());
        let (b_lsm, v) = T::eigen(&lsm)?;
        let ag = mul(&l, &v);
        let mut g = v;
        solve_lower_adjoint(&l, g.as_mut());

        let ef = mul(&e_inverse, &f);
        let overlaps = [mul(&adjoint(&ef), &d.times(&g)), mul(&adjoint(&f), &d.times(&ag))];
        Ok(Some(Self { b_lse, b_lsm, f, g, ag, ef, overlaps }))
    }

    /// The modes, with vectors `placed` where the line has them.
    pub(super) fn finished(self, placed: impl Fn(Mat<T>) -> Mat<T>) -> Modes<T> {
        let Self { f, g, ag, ef, .. } = self;
        let [o_by_lsm, o_by_lse] = self.overlaps;
        // Q is the adjoint of O, numerators included.
        let overlaps = Overlaps {
            q_by_lse: adjoint(&o_by_lse),
            q_by_lsm: adjoint(&o_by_lsm),
            o_by_lsm,
            o_by_lse,
        };
        let [b_lse, b_lsm] = [self.b_lse, self.b_lsm]
            .map(|b| -> Vec<T> { b.into_iter().map(|b| T::ONE.scaled(b)).collect() });
        let dot = |a: &Mat<T>, i: usize, b: &Mat<T>, j: usize| {
            let (a, b) = (a.col_as_slice(i), b.col_as_slice(j));
            a.iter().zip(b).fold(T::ZERO, |sum, (a, b)| sum + a.conjugate() * *b)
        };
        let (o, q, degenerate) = coupled(
            &overlaps,
            (&b_lse, &b_lsm),
            |i, j| dot(&f, i, &ef, j),
            |i, j| dot(&ag, i, &ag, j),
        );
        Modes {
            basis: orthonormal_basis(placed(f), placed(g), placed(ag), o, q),
            b_lse,
            b_lsm,
            degenerate,
        }
    }
}

impl Eigenpairs<f64> {
    /// The same in complex numbers.
    pub(super) fn complex(self) -> Eigenpairs<Complex64> {
        let complex = |m: RMat| -> CMat {
            Mat::from_fn(m.nrows(), m.ncols(), |i, j| Complex64::from(m[(i, j)]))
        };
        Eigenpairs {
            b_lse: self.b_lse,
            b_lsm: self.b_lsm,
            f: complex(self.f),
            g: complex(self.g),
            ag: complex(self.ag),
            ef: complex(self.ef),
            overlaps: self.overlaps.map(complex),
        }
    }
}
