// SPDX-License-Identifier: MIT OR Apache-2.0
//! Factorisation rules: Laurent's rule or the inverse rule for each field component.
//!
//! At the walls of a layer Ey, Ez and the normal displacement εEx are continuous. Following Li (J.
//! Opt. Soc. Am. A 13, 1870, 1996), the product εEy is factorised by Laurent's rule with the
//! Toeplitz matrix of ε, εEx by the inverse rule with the inverse of the Toeplitz matrix of 1/ε; Ez
//! = ε⁻¹Dz needs the inverse of the first.

use crate::fourier::permittivities_about;
use crate::linalg::{CMat, RMat};
use crate::relief::Segment;
use faer::Mat;

/// Toeplitz matrices of one layer, shape (orders, orders).
#[derive(Clone, Debug)]
pub(crate) struct Toeplitz<M> {
    /// Of ε.
    pub(crate) permittivity: M,
    /// Of 1/ε.
    pub(crate) inverse_permittivity: M,
}

/// Matrices of a layer in the frame of the cell.
pub(crate) fn toeplitz(segments: &[Segment], orders: usize) -> Toeplitz<CMat> {
    let reach = orders - 1;
    let [permittivity, inverse_permittivity] = permittivities_about(segments, reach, 0.0)
        .map(|c| Mat::from_fn(orders, orders, |i, j| c[reach + i - j]));
    Toeplitz { permittivity, inverse_permittivity }
}

/// Real symmetric matrices of a lossless layer that is mirror symmetric about `centre` (fraction of
/// the period), in the frame with its origin there.
pub(crate) fn toeplitz_about(segments: &[Segment], orders: usize, centre: f64) -> Toeplitz<RMat> {
    let reach = orders - 1;
    let [permittivity, inverse_permittivity] = permittivities_about(segments, reach, centre)
        .map(|c| Mat::from_fn(orders, orders, |i, j| c[reach + i.abs_diff(j)].re));
    Toeplitz { permittivity, inverse_permittivity }
}
