// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modes of a lossless layer: Hermitian problems, real symmetric ones where the layer has a centre of symmetry.
//!
//! With ε real and positive E and A are Hermitian and positive definite, so f can be orthonormal and g A-orthonormal,
//! and b is exactly real: no branch of a square root is ever chosen by round-off. A layer with one ridge always has a
//! centre of symmetry; seen from there the matrices are real, and a diagonal phase takes the vectors back.

use super::degenerate_modes::DegenerateModes;
use super::{DEGENERACY, Modes, Overlaps, couplings, orthonormal_basis};
use crate::error::Error;
use crate::factorization::{toeplitz, toeplitz_about};
use crate::fourier::symmetry_centre;
use crate::linalg::{
    CMat, RMat, Scalar, adjoint, cholesky, cholesky_real, eigen_hermitian, eigen_symmetric,
    inverse, inverse_definite_real, mul, solve_lower, solve_lower_adjoint, solve_lower_real,
    solve_lower_transpose_real, transpose,
};
use crate::relief::Layer;
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Modes of a layer of real positive ε, or `None` where truncation leaves a Toeplitz matrix that is not definite.
pub(super) fn modes(layer: &Layer, kx: &[f64]) -> Result<Option<Modes>, Error> {
    match symmetry_centre(&layer.segments) {
        Some(centre) => symmetric(layer, kx, centre),
        None => general(layer, kx),
    }
}

fn symmetric(layer: &Layer, kx: &[f64], centre: f64) -> Result<Option<Modes>, Error> {
    let n = kx.len();
    let matrices = toeplitz_about(&layer.segments, n, centre);
    let (e, a) = (&matrices.permittivity, &matrices.inverse_permittivity);
    let (Some(e_inverse), Some(l)) = (inverse_definite_real(e), cholesky_real(a)) else {
        return Ok(None);
    };

    // LSE: (E - K²) f = b f.
    let lse: RMat = Mat::from_fn(n, n, |i, j| {
        e[(i, j)] - if i == j { kx[i] * kx[i] } else { 0.0 }
    });
    let (b_lse, f) = eigen_symmetric(&lse)?;

    // LSM: (1 - K E⁻¹ K) g = b A g.
    let c: RMat = Mat::from_fn(
        n,
        n,
        |i, j| if i == j { 1.0 } else { 0.0 } - kx[i] * e_inverse[(i, j)] * kx[j],
    );
    let (b_lsm, g, ag) = magnetic(c, &l)?;

    let times_k = |m: &RMat| -> RMat { Mat::from_fn(n, n, |i, j| kx[i] * m[(i, j)]) };
    let ft = f.transpose().to_owned();
    let ef = mul(&e_inverse, &f);
    let overlaps = overlaps_from_adjoint(
        complex(&mul(&ef.transpose().to_owned(), &times_k(&g))),
        complex(&mul(&ft, &times_k(&ag))),
    );
    let b_lse: Vec<Complex64> = b_lse.into_iter().map(Complex64::from).collect();
    let b_lsm: Vec<Complex64> = b_lsm.into_iter().map(Complex64::from).collect();
    let (o, q) = couplings(&overlaps, &b_lse, &b_lsm);
    let degenerate = DegenerateModes::find(
        near_degenerate(&b_lse),
        near_degenerate(&b_lsm),
        &overlaps,
        (&o, &q),
        |i, j| (0..n).map(|m| f[(m, i)] * ef[(m, j)]).sum::<f64>().into(),
        |i, j| (0..n).map(|m| ag[(m, i)] * ag[(m, j)]).sum::<f64>().into(),
    );

    // Back from the centre of symmetry to the origin of the cell: order m gains exp(-2πi m centre).
    let middle = (n - 1) as f64 / 2.0;
    let phase: Vec<Complex64> = (0..n)
        .map(|m| Complex64::cis(-TAU * (m as f64 - middle) * centre))
        .collect();
    let placed = |m: &RMat| -> CMat { Mat::from_fn(n, n, |i, j| phase[i] * m[(i, j)]) };
    let basis = orthonormal_basis(placed(&f), placed(&g), placed(&ag), o, q);
    Ok(Some(Modes {
        basis,
        b_lse,
        b_lsm,
        degenerate,
    }))
}

/// b, g and A g of c g = b A g with A = L Lᵀ: with v = Lᵀ g an ordinary problem, and A g = L v.
pub(super) fn magnetic(mut c: RMat, l: &RMat) -> Result<(Vec<f64>, RMat, RMat), Error> {
    solve_lower_real(l, c.as_mut());
    let mut c = transpose(&c);
    solve_lower_real(l, c.as_mut());
    let (b, v) = eigen_symmetric(&c)?;
    let ag = mul(l, &v);
    let mut g = v;
    solve_lower_transpose_real(l, g.as_mut());
    Ok((b, g, ag))
}

fn general(layer: &Layer, kx: &[f64]) -> Result<Option<Modes>, Error> {
    let n = kx.len();
    let matrices = toeplitz(&layer.segments, n);
    let (e, a) = (&matrices.permittivity, &matrices.inverse_permittivity);
    let Some(l) = cholesky(a) else {
        return Ok(None);
    };
    let e_inverse = inverse(e);

    let one = |i: usize, j: usize| {
        if i == j {
            Complex64::ONE
        } else {
            Complex64::ZERO
        }
    };
    let lse: CMat = Mat::from_fn(n, n, |i, j| e[(i, j)] - one(i, j) * (kx[i] * kx[i]));
    let (b_lse, f) = eigen_hermitian(&lse)?;

    let mut c: CMat = Mat::from_fn(n, n, |i, j| one(i, j) - e_inverse[(i, j)] * (kx[i] * kx[j]));
    solve_lower(&l, c.as_mut());
    let mut c = adjoint(&c);
    solve_lower(&l, c.as_mut());
    let (b_lsm, v) = eigen_hermitian(&c)?;
    let ag = mul(&l, &v);
    let mut g = v;
    solve_lower_adjoint(&l, g.as_mut());

    let times_k = |m: &CMat| -> CMat { Mat::from_fn(n, n, |i, j| kx[i] * m[(i, j)]) };
    let ef = mul(&e_inverse, &f);
    let overlaps = overlaps_from_adjoint(
        mul(&adjoint(&ef), &times_k(&g)),
        mul(&adjoint(&f), &times_k(&ag)),
    );
    let b_lse: Vec<Complex64> = b_lse.into_iter().map(Complex64::from).collect();
    let b_lsm: Vec<Complex64> = b_lsm.into_iter().map(Complex64::from).collect();
    let (o, q) = couplings(&overlaps, &b_lse, &b_lsm);
    let degenerate = DegenerateModes::find(
        near_degenerate(&b_lse),
        near_degenerate(&b_lsm),
        &overlaps,
        (&o, &q),
        |i, j| (0..n).map(|m| f[(m, i)].conj() * ef[(m, j)]).sum(),
        |i, j| (0..n).map(|m| ag[(m, i)].conj() * ag[(m, j)]).sum(),
    );
    let basis = orthonormal_basis(f, g, ag, o, q);
    Ok(Some(Modes {
        basis,
        b_lse,
        b_lsm,
        degenerate,
    }))
}

/// Without loss Q is the adjoint of O, numerators included.
pub(super) fn overlaps_from_adjoint<T: Scalar>(o_by_lsm: Mat<T>, o_by_lse: Mat<T>) -> Overlaps<T> {
    Overlaps {
        q_by_lse: adjoint(&o_by_lse),
        q_by_lsm: adjoint(&o_by_lsm),
        o_by_lsm,
        o_by_lse,
    }
}

pub(super) fn near_degenerate<T: Scalar>(b: &[T]) -> Vec<usize> {
    (0..b.len())
        .filter(|&m| b[m].squared() < DEGENERACY * DEGENERACY)
        .collect()
}

fn complex(m: &RMat) -> CMat {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| Complex64::from(m[(i, j)]))
}
