// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modes of an absorbing layer, or of one with ε < 0: general complex problems, inverses by LU.
//!
//! Such problems can be defective: at some absorption two modes become one, and next to it they are
//! nearly parallel and what they carry is the small difference of large terms. All that leaves the
//! layer is smooth there, so the layer is then given a permittivity that is off by 1e-9 of itself
//! in one of its materials, where the modes lie far enough apart.

use super::{Basis, Modes, Overlaps, coupled};
use crate::error::Error;
use crate::factorization::toeplitz;
use crate::linalg::{CMat, Lu, delta, eigen_general, inverse, mul};
use crate::relief::Layer;
use faer::Mat;
use num_complex::Complex64;

/// Condition number of an eigenvalue above which a problem is taken to be nearly defective: efficiencies
/// lose about its square in units of round-off.
const NEARLY_DEFECTIVE: f64 = 1e5;

/// Condition number at which not even the third digit of an efficiency is left.
const DEFECTIVE: f64 = 3e6;

/// Absorption added to a material of a layer whose problem is nearly defective, in parts of |ε|.
const NUDGE: f64 = 1e-9;

pub(super) fn modes(layer: &Layer, kx: &[f64]) -> Result<Modes, Error> {
    let found = general(layer, kx)?;
    if condition(&found.basis) <= NEARLY_DEFECTIVE {
        return Ok(found);
    }
    let mut nudged = layer.clone();
    // Of one material only: the same for all would move all eigenvalues alike.
    let first = layer.segments[0].index;
    for segment in nudged.segments.iter_mut().filter(|s| s.index == first) {
        let epsilon = segment.index * segment.index;
        // Absorbing more keeps it passive, whatever the sign of Re ε.
        segment.index = (epsilon + Complex64::I * (NUDGE * epsilon.norm())).sqrt();
    }
    let moved = general(&nudged, kx)?;
    let best = if condition(&moved.basis) < condition(&found.basis) { moved } else { found };
    if condition(&best.basis) < DEFECTIVE { Ok(best) } else { Err(Error::Eigen { size: kx.len() }) }
}

/// The largest condition number of an eigenvalue, length of its right vector times that of its left
/// one: 1 if modes are orthogonal, without bound where two become one.
fn condition(basis: &Basis) -> f64 {
    let of = |vectors: &CMat, inverse: &CMat| {
        let n = vectors.ncols();
        let squares = |mode: usize| {
            let right: f64 = (0..n).map(|i| vectors[(i, mode)].norm_sqr()).sum();
            let left: f64 = (0..n).map(|j| inverse[(mode, j)].norm_sqr()).sum();
            right * left
        };
        (0..n).map(squares).fold(0.0, f64::max).sqrt()
    };
    of(&basis.f, &basis.f_inverse).max(of(&basis.g, &basis.g_inverse))
}

fn general(layer: &Layer, kx: &[f64]) -> Result<Modes, Error> {
    let n = kx.len();
    let matrices = toeplitz(&layer.segments, n);
    let (e, a) = (&matrices.permittivity, &matrices.inverse_permittivity);
    let e_inverse = inverse(e);
    let one = delta::<Complex64>;

    // LSE: (E - K²) f = b f.
    let lse: CMat = Mat::from_fn(n, n, |i, j| e[(i, j)] - one(i, j) * (kx[i] * kx[i]));
    let (b_lse, f) = eigen_general(&lse)?;

    // LSM: A⁻¹ (1 - K E⁻¹ K) g = b g.
    let mut lsm: CMat = Mat::from_fn(n, n, |i, j| one(i, j) - e_inverse[(i, j)] * (kx[i] * kx[j]));
    Lu::new(a).solve(lsm.as_mut());
    let (b_lsm, g) = eigen_general(&lsm)?;
    let ag = mul(a, &g);

    let f_inverse = inverse(&f);
    let ag_inverse = inverse(&ag);
    let g_inverse = mul(&ag_inverse, a);
    let times_k = |m: &CMat| -> CMat { Mat::from_fn(n, n, |i, j| kx[i] * m[(i, j)]) };
    let ef = mul(&e_inverse, &f);
    let overlaps = Overlaps {
        o_by_lsm: mul(&f_inverse, &mul(&e_inverse, &times_k(&g))),
        o_by_lse: mul(&f_inverse, &times_k(&ag)),
        q_by_lse: mul(&g_inverse, &times_k(&f)),
        q_by_lsm: mul(&ag_inverse, &times_k(&ef)),
    };
    let aag = mul(a, &ag);
    let (o, q, degenerate) = coupled(
        &overlaps,
        (&b_lse, &b_lsm),
        |i, j| (0..n).map(|m| f_inverse[(i, m)] * ef[(m, j)]).sum(),
        |i, j| (0..n).map(|m| ag_inverse[(i, m)] * aag[(m, j)]).sum(),
    );
    let basis = Basis { f, f_inverse, ag, ag_inverse, g, g_inverse, o, q };
    Ok(Modes { basis, b_lse, b_lsm, degenerate })
}
