// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modes of a lossless layer in the orders: Hermitian problems, real symmetric ones about a centre
//! of symmetry.
//!
//! A layer with one ridge always has a centre of symmetry. Seen from there the matrices are real,
//! and a diagonal phase takes the vectors back.

use super::Modes;
use super::definite::{Derivative, Eigenpairs};
use crate::error::Error;
use crate::factorization::{toeplitz, toeplitz_about};
use crate::fourier::symmetry_centre;
use crate::linalg::{CMat, RMat};
use crate::relief::Layer;
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// K = diag(kx).
struct Wavevectors<'a>(&'a [f64]);

impl Derivative<f64> for Wavevectors<'_> {
    fn kappa_squared(&self) -> Vec<f64> {
        self.0.iter().map(|k| k * k).collect()
    }

    fn times(&self, m: &RMat) -> RMat {
        Mat::from_fn(m.nrows(), m.ncols(), |i, j| self.0[i] * m[(i, j)])
    }

    fn sandwich(&self, m: &RMat) -> RMat {
        let kx = self.0;
        Mat::from_fn(kx.len(), kx.len(), |i, j| kx[i] * m[(i, j)] * kx[j])
    }
}

impl Derivative<Complex64> for Wavevectors<'_> {
    fn kappa_squared(&self) -> Vec<f64> {
        self.0.iter().map(|k| k * k).collect()
    }

    fn times(&self, m: &CMat) -> CMat {
        Mat::from_fn(m.nrows(), m.ncols(), |i, j| self.0[i] * m[(i, j)])
    }

    fn sandwich(&self, m: &CMat) -> CMat {
        let kx = self.0;
        Mat::from_fn(kx.len(), kx.len(), |i, j| m[(i, j)] * (kx[i] * kx[j]))
    }
}

/// Modes of a layer of real positive ε, or `None` where truncation leaves a Toeplitz matrix that is
/// not definite.
pub(super) fn modes(layer: &Layer, kx: &[f64]) -> Result<Option<Modes>, Error> {
    let (orders, k) = (kx.len(), Wavevectors(kx));
    let Some(centre) = symmetry_centre(&layer.segments) else {
        let matrices = toeplitz(&layer.segments, orders);
        let pairs = Eigenpairs::new(matrices.permittivity, &matrices.inverse_permittivity, &k)?;
        return Ok(pairs.map(|pairs| pairs.finished(|m| m)));
    };
    let matrices = toeplitz_about(&layer.segments, orders, centre);
    let pairs = Eigenpairs::<f64>::new(matrices.permittivity, &matrices.inverse_permittivity, &k)?;
    // Back from the centre of symmetry to the origin of the cell: order m gains exp(-2πi m centre).
    let middle = (orders - 1) as f64 / 2.0;
    let phase: Vec<Complex64> =
        (0..orders).map(|m| Complex64::cis(-TAU * (m as f64 - middle) * centre)).collect();
    let placed =
        |m: CMat| -> CMat { Mat::from_fn(m.nrows(), m.ncols(), |i, j| phase[i] * m[(i, j)].re) };
    Ok(pairs.map(|pairs| pairs.complex().finished(placed)))
}
