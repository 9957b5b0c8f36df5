// SPDX-License-Identifier: MIT OR Apache-2.0
//! Dense linear algebra by faer, behind functions that this crate alone instantiates, so that it is
//! compiled here and optimised whatever the profile of the caller.
//!
//! Eigenproblems and LU come from `by_faer` or, with the feature `lapack`, from `by_lapack`.
//!
//! faer is built without threads: parallelism is over independent problems, never inside one
//! product.

#[cfg(any(test, not(feature = "lapack")))]
mod by_faer;
#[cfg(feature = "lapack")]
mod by_lapack;
#[cfg(test)]
mod tests;

#[cfg(not(feature = "lapack"))]
pub(crate) use by_faer::{Lu, LuScalar, eigen_general, eigen_hermitian, eigen_symmetric};
#[cfg(feature = "lapack")]
pub(crate) use by_lapack::{Lu, LuScalar, eigen_general, eigen_hermitian, eigen_symmetric};

use crate::error::Error;
pub(crate) use faer::Accum;
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::{Mat, MatMut, MatRef, Par, Side};
use num_complex::Complex64;
use std::ops::{Add, Mul, Neg, Sub};

pub(crate) type CMat = Mat<Complex64>;
pub(crate) type RMat = Mat<f64>;

/// Elements of matrices, where real and complex arithmetic take the same steps.
pub(crate) trait Scalar:
    faer::traits::ComplexField
    + Copy
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + std::ops::AddAssign
    + Into<Complex64>
    + LuScalar
{
    const ZERO: Self;
    const ONE: Self;

    /// |x|².
    fn squared(self) -> f64;

    fn scaled(self, by: f64) -> Self;

    fn conjugate(self) -> Self;

    /// 1/x.
    fn inverted(self) -> Self;

    /// Inverse of a Hermitian positive definite matrix; of a real one `None` if it is not definite.
    fn inverse_of_definite(a: &Mat<Self>) -> Option<Mat<Self>>;

    /// Eigenvalues (ascending) and orthonormal eigenvectors of a Hermitian matrix.
    fn eigen(a: &Mat<Self>) -> Result<(Vec<f64>, Mat<Self>), Error>;
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    fn squared(self) -> f64 {
        self * self
    }

    fn scaled(self, by: f64) -> Self {
        self * by
    }

    fn conjugate(self) -> Self {
        self
    }

    fn inverted(self) -> Self {
        1.0 / self
    }

    fn inverse_of_definite(a: &RMat) -> Option<RMat> {
        let factor = a.llt(Side::Lower).ok()?;
        Some(factor.solve(RMat::identity(a.nrows(), a.nrows())))
    }

    fn eigen(a: &RMat) -> Result<(Vec<f64>, RMat), Error> {
        eigen_symmetric(a)
    }
}

impl Scalar for Complex64 {
    const ZERO: Self = Complex64::ZERO;
    const ONE: Self = Complex64::ONE;

    fn squared(self) -> f64 {
        self.norm_sqr()
    }

    fn scaled(self, by: f64) -> Self {
        self * by
    }

    fn conjugate(self) -> Self {
        self.conj()
    }

    fn inverted(self) -> Self {
        self.inv()
    }

    fn inverse_of_definite(a: &CMat) -> Option<CMat> {
        Some(inverse(a))
    }

    fn eigen(a: &CMat) -> Result<(Vec<f64>, CMat), Error> {
        eigen_hermitian(a)
    }
}

/// `dst (+)= alpha a b`.
pub(crate) fn product<T: Scalar>(
    dst: MatMut<'_, T>,
    accum: Accum,
    alpha: T,
    a: MatRef<'_, T>,
    b: MatRef<'_, T>,
) {
    matmul(dst, accum, a, b, alpha, Par::Seq);
}

/// `a b`.
pub(crate) fn mul<T: Scalar>(a: &Mat<T>, b: &Mat<T>) -> Mat<T> {
    let mut out = Mat::zeros(a.nrows(), b.ncols());
    product(out.as_mut(), Accum::Replace, T::ONE, a.as_ref(), b.as_ref());
    out
}

/// Conjugate transpose.
pub(crate) fn adjoint<T: Scalar>(a: &Mat<T>) -> Mat<T> {
    Mat::from_fn(a.ncols(), a.nrows(), |i, j| a[(j, i)].conjugate())
}

/// Transpose without conjugation.
pub(crate) fn transpose<T: Scalar>(a: &Mat<T>) -> Mat<T> {
    Mat::from_fn(a.ncols(), a.nrows(), |i, j| a[(j, i)])
}

/// a + `factor` b.
pub(crate) fn combined<T: Scalar>(a: &Mat<T>, b: &Mat<T>, factor: f64) -> Mat<T> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] + b[(i, j)].scaled(factor))
}

/// 1 on the diagonal, 0 elsewhere.
pub(crate) fn delta<T: Scalar>(i: usize, j: usize) -> T {
    if i == j { T::ONE } else { T::ZERO }
}

/// Inverse by LU.
pub(crate) fn inverse<T: Scalar>(a: &Mat<T>) -> Mat<T> {
    let mut out = Mat::identity(a.nrows(), a.nrows());
    Lu::new(a).solve(out.as_mut());
    out
}

/// Lower Cholesky factor of a Hermitian positive definite matrix, or `None` if it is not definite.
pub(crate) fn cholesky<T: Scalar>(a: &Mat<T>) -> Option<Mat<T>> {
    let factor = a.llt(Side::Lower).ok()?;
    Some(factor.L().to_owned())
}

/// Overwrites `rhs` by `l⁻¹ rhs` with `l` lower triangular.
pub(crate) fn solve_lower<T: Scalar>(l: &Mat<T>, rhs: MatMut<'_, T>) {
    l.solve_lower_triangular_in_place(rhs);
}

/// Overwrites `rhs` by `l⁻ᴴ rhs` with `l` lower triangular.
pub(crate) fn solve_lower_adjoint<T: Scalar>(l: &Mat<T>, rhs: MatMut<'_, T>) {
    l.adjoint().solve_upper_triangular_in_place(rhs);
}

/// True where every element is smaller; a NaN is not.
pub(crate) fn is_bounded<T: Scalar>(m: &Mat<T>, largest: f64) -> bool {
    let allowed = largest * largest;
    (0..m.ncols()).all(|j| {
        let column = m.col_as_slice(j).iter();
        column.fold(true, |all, z| all & (z.squared() < allowed))
    })
}

/// The eigenpairs, or an error if one is not finite: faer returns NaN vectors and no error for an
/// exactly defective matrix.
fn finite<V: Copy, T>(
    values: Vec<V>,
    vectors: Mat<T>,
    value_ok: impl Fn(V) -> bool,
    vector_ok: impl Fn(&T) -> bool,
) -> Result<(Vec<V>, Mat<T>), Error> {
    check_elements(&vectors, vector_ok)?;
    if values.iter().all(|&v| value_ok(v)) {
        Ok((values, vectors))
    } else {
        Err(Error::Eigen { size: vectors.nrows() })
    }
}

fn check_elements<T>(a: &Mat<T>, ok: impl Fn(&T) -> bool) -> Result<(), Error> {
    if (0..a.ncols()).all(|j| (0..a.nrows()).all(|i| ok(&a[(i, j)]))) {
        Ok(())
    } else {
        Err(Error::Eigen { size: a.nrows() })
    }
}
