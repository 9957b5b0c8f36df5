// SPDX-License-Identifier: MIT OR Apache-2.0
//! Eigenproblems and LU by faer.

use super::{CMat, RMat, finite};
use crate::error::Error;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::{Mat, MatMut, Par, Side, Spec};
use num_complex::Complex64;

/// Elements of the matrices of [`Lu`].
pub(crate) trait LuScalar: faer::traits::ComplexField {}

impl<T: faer::traits::ComplexField> LuScalar for T {}

/// LU factors with partial pivoting.
pub(crate) struct Lu<T: LuScalar> {
    /// L below the diagonal, without its ones, and U.
    factors: Mat<T>,
    /// Row i of the permuted matrix is row `rows[i]` of the given one.
    rows: Vec<usize>,
}

impl<T: LuScalar> Lu<T> {
    pub(crate) fn new(a: &Mat<T>) -> Self {
        Self::in_place(a.clone())
    }

    /// Factors a matrix in its own memory.
    pub(crate) fn in_place(mut a: Mat<T>) -> Self {
        let size = a.nrows();
        let (mut rows, mut inverse) = (vec![0; size], vec![0; size]);
        let scratch = lu_in_place_scratch::<usize, T>(size, size, Par::Seq, Spec::default());
        lu_in_place(
            a.as_mut(),
            &mut rows,
            &mut inverse,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Spec::default(),
        );
        Self { factors: a, rows }
    }

    /// The memory of the factors, for other use.
    #[cfg(not(feature = "lapack"))]
    pub(crate) fn into_matrix(self) -> Mat<T> {
        self.factors
    }

    /// `out = a⁻¹ rhs`.
    pub(crate) fn solve_into(&self, rhs: &Mat<T>, out: &mut Mat<T>) {
        for j in 0..rhs.ncols() {
            let (from, to) = (rhs.col_as_slice(j), out.col_as_slice_mut(j));
            for (to, &row) in to.iter_mut().zip(&self.rows) {
                *to = from[row].clone();
            }
        }
        self.factors.solve_unit_lower_triangular_in_place(out.as_mut());
        self.factors.solve_upper_triangular_in_place(out.as_mut());
    }

    /// Overwrites `rhs` by `a⁻¹ rhs`.
    pub(crate) fn solve(&self, mut rhs: MatMut<'_, T>) {
        let given = rhs.to_owned();
        let mut out = given.clone();
        self.solve_into(&given, &mut out);
        rhs.copy_from(&out);
    }
}

/// Eigenvalues (ascending) and orthonormal eigenvectors of a Hermitian matrix, of which the lower
/// half is read.
pub(crate) fn eigen_hermitian(a: &CMat) -> Result<(Vec<f64>, CMat), Error> {
    let eigen = a.self_adjoint_eigen(Side::Lower).map_err(|_| Error::Eigen { size: a.nrows() })?;
    let values = eigen.S().column_vector().iter().map(|v| v.re).collect();
    finite(values, eigen.U().to_owned(), f64::is_finite, |u| u.is_finite())
}

/// Eigenvalues (ascending) and orthonormal eigenvectors of a real symmetric matrix.
pub(crate) fn eigen_symmetric(a: &RMat) -> Result<(Vec<f64>, RMat), Error> {
    let eigen = a.self_adjoint_eigen(Side::Lower).map_err(|_| Error::Eigen { size: a.nrows() })?;
    let values = eigen.S().column_vector().iter().copied().collect();
    finite(values, eigen.U().to_owned(), f64::is_finite, |u| u.is_finite())
}

/// Eigenvalues and right eigenvectors of a general matrix.
pub(crate) fn eigen_general(a: &CMat) -> Result<(Vec<Complex64>, CMat), Error> {
    let eigen = a.eigen().map_err(|_| Error::Eigen { size: a.nrows() })?;
    let values = eigen.S().column_vector().iter().copied().collect();
    finite(values, eigen.U().to_owned(), num_complex::Complex::is_finite, |u| u.is_finite())
}
