// SPDX-License-Identifier: MIT OR Apache-2.0
//! Eigenproblems and LU by faer.

use super::{CMat, RMat, finite};
use crate::error::Error;
use faer::linalg::solvers::SolveCore;
use faer::{Conj, MatMut, Side};
use num_complex::Complex64;

/// LU factors with partial pivoting.
pub(crate) struct Lu(faer::linalg::solvers::PartialPivLu<Complex64>);

impl Lu {
    pub(crate) fn new(a: &CMat) -> Self {
        Self(a.partial_piv_lu())
    }

    /// Overwrites `rhs` by `a⁻¹ rhs`.
    pub(crate) fn solve(&self, rhs: MatMut<'_, Complex64>) {
        self.0.solve_in_place_with_conj(Conj::No, rhs);
    }
}

/// Eigenvalues (ascending) and orthonormal eigenvectors of a Hermitian matrix, of which the lower half is read.
pub(crate) fn eigen_hermitian(a: &CMat) -> Result<(Vec<f64>, CMat), Error> {
    let eigen = a
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| Error::Eigen { size: a.nrows() })?;
    let values = eigen.S().column_vector().iter().map(|v| v.re).collect();
    finite(values, eigen.U().to_owned(), f64::is_finite, |u| {
        u.is_finite()
    })
}

/// As [`eigen_hermitian`], real.
pub(crate) fn eigen_symmetric(a: &RMat) -> Result<(Vec<f64>, RMat), Error> {
    let eigen = a
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| Error::Eigen { size: a.nrows() })?;
    let values = eigen.S().column_vector().iter().copied().collect();
    finite(values, eigen.U().to_owned(), f64::is_finite, |u| {
        u.is_finite()
    })
}

/// Eigenvalues and right eigenvectors of a general matrix.
pub(crate) fn eigen_general(a: &CMat) -> Result<(Vec<Complex64>, CMat), Error> {
    let eigen = a.eigen().map_err(|_| Error::Eigen { size: a.nrows() })?;
    let values = eigen.S().column_vector().iter().copied().collect();
    finite(
        values,
        eigen.U().to_owned(),
        num_complex::Complex::is_finite,
        |u| u.is_finite(),
    )
}
