// SPDX-License-Identifier: MIT OR Apache-2.0
//! Eigenproblems and LU by LAPACK, through ndarray-linalg: a check on [`super::by_faer`], which
//! they replace.

use super::{CMat, RMat, check_elements, finite};
use crate::error::Error;
use faer::{Mat, MatMut};
use ndarray::{Array1, Array2, OwnedRepr, ShapeBuilder};
use ndarray_linalg::{Eig, Eigh, Factorize, LUFactorized, Scalar, Solve, UPLO};
use num_complex::Complex64;

/// By columns: of rows ndarray-linalg's `eigh` gives the eigenvectors of the transpose.
fn to_array<T: Scalar>(a: &Mat<T>) -> Array2<T> {
    Array2::from_shape_fn((a.nrows(), a.ncols()).f(), |(i, j)| a[(i, j)])
}

fn from_array<T: Scalar>(a: &Array2<T>) -> Mat<T> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

/// Elements of the matrices of [`Lu`].
pub(crate) trait LuScalar:
    faer::traits::ComplexField + Scalar<Real = f64> + ndarray_linalg::Lapack
{
}

impl<T: faer::traits::ComplexField + Scalar<Real = f64> + ndarray_linalg::Lapack> LuScalar for T {}

/// LU factors with partial pivoting; none of a singular matrix.
pub(crate) struct Lu<T: LuScalar> {
    factors: Option<LUFactorized<OwnedRepr<T>>>,
    size: usize,
}

impl<T: LuScalar> Lu<T> {
    pub(crate) fn new(a: &Mat<T>) -> Self {
        Self { factors: to_array(a).factorize().ok(), size: a.nrows() }
    }

    /// Of a matrix that is not needed any more.
    pub(crate) fn in_place(a: Mat<T>) -> Self {
        Self::new(&a)
    }

    /// Memory of the size of the factors, for other use.
    pub(crate) fn into_matrix(self) -> Mat<T> {
        let size = self.size;
        Mat::zeros(size, size)
    }

    /// `out = a⁻¹ rhs`.
    pub(crate) fn solve_into(&self, rhs: &Mat<T>, out: &mut Mat<T>) {
        out.copy_from(rhs);
        self.solve(out.as_mut());
    }

    /// Overwrites `rhs` by `a⁻¹ rhs`, by NaN if there is none.
    pub(crate) fn solve(&self, mut rhs: MatMut<'_, T>) {
        for j in 0..rhs.ncols() {
            let mut column = Array1::from_shape_fn(rhs.nrows(), |i| rhs[(i, j)]);
            let solved = match &self.factors {
                Some(factors) => factors.solve_inplace(&mut column).is_ok(),
                None => false,
            };
            for i in 0..rhs.nrows() {
                rhs[(i, j)] = if solved { column[i] } else { <T as Scalar>::from_real(f64::NAN) };
            }
        }
    }
}

/// Eigenvalues (ascending) and orthonormal eigenvectors of a Hermitian matrix, of which the lower
/// half is read.
pub(crate) fn eigen_hermitian(a: &CMat) -> Result<(Vec<f64>, CMat), Error> {
    self_adjoint(a, |u| u.is_finite())
}

/// Eigenvalues (ascending) and orthonormal eigenvectors of a real symmetric matrix.
pub(crate) fn eigen_symmetric(a: &RMat) -> Result<(Vec<f64>, RMat), Error> {
    self_adjoint(a, |u| u.is_finite())
}

fn self_adjoint<T: Scalar<Real = f64> + ndarray_linalg::Lapack>(
    a: &Mat<T>,
    is_finite: impl Fn(&T) -> bool,
) -> Result<(Vec<f64>, Mat<T>), Error> {
    let size = a.nrows();
    // A NaN can keep LAPACK busy for ever.
    check_elements(a, &is_finite)?;
    let (values, vectors) = to_array(a).eigh(UPLO::Lower).map_err(|_| Error::Eigen { size })?;
    finite(values.to_vec(), from_array(&vectors), f64::is_finite, is_finite)
}

/// Eigenvalues and right eigenvectors of a general matrix.
pub(crate) fn eigen_general(a: &CMat) -> Result<(Vec<Complex64>, CMat), Error> {
    let size = a.nrows();
    check_elements(a, |u| u.is_finite())?;
    let (values, vectors) = to_array(a).eig().map_err(|_| Error::Eigen { size })?;
    finite(values.to_vec(), from_array(&vectors), num_complex::Complex::is_finite, |u| {
        u.is_finite()
    })
}
