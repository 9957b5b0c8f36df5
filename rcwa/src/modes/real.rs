// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modes of a lossless layer in functions whose matrices are real: real symmetric problems whatever the layer's shape.
//!
//! In: a layer and the [`RealFunctions`] of a line. Out: [`Modes`] of real numbers, with O and Q = Oᵀ real. For cosines and sines K = -i ∂, and the complex O and Q are
//! -i O and i Q. With D for ∂ or K, E among the functions of Z and A among those of X,
//!
//! - LSE: (E - κ²) f = b f,   LSM: (1 - Dᵀ E⁻¹ D) g = b A g,   O = fᵀ E⁻¹ D g / b_g = fᵀ D A g / b_f
//!
//! A layer with a centre of symmetry has even and odd modes about it. All standing waves then come from two problems of half the size, turned back to the
//! origin by one rotation for every pair of a cosine and a sine.

use super::degenerate_modes::DegenerateModes;
use super::lossless::{magnetic, near_degenerate, overlaps_from_adjoint};
use super::{Modes, couplings, orthonormal_basis};
use crate::error::Error;
use crate::expansion::real::{FunctionSet, RealFunctions};
use crate::expansion::{Expansion, FieldGroup};
use crate::fourier::{permittivities_about, symmetry_centre};
use crate::linalg::{RMat, cholesky_real, eigen_symmetric, inverse_definite_real, mul, transpose};
use crate::relief::{Layer, Segment};
use faer::Mat;
use std::ops::Range;

/// Real modes of `layer`, or `None` where truncation leaves a matrix that is not definite.
pub(crate) fn modes(layer: &Layer, functions: &RealFunctions) -> Result<Option<Modes<f64>>, Error> {
    if let Some(index) = layer.uniform_index() {
        return Ok(Some(uniform(index.re * index.re, functions)));
    }
    // One order alone has no sine.
    let has_parities =
        functions.kind == FunctionSet::Standing && functions.count(FieldGroup::X) > 1;
    let centre = symmetry_centre(&layer.segments).filter(|_| has_parities);
    let solved = match centre {
        Some(centre) => about(centre, &layer.segments, functions)?,
        None => Eigenpairs::new(&layer.segments, functions)?,
    };
    let placed = |m: RMat| match centre {
        Some(centre) => functions.moved(&m, centre),
        None => m,
    };
    Ok(solved.map(|solved| solved.finished(placed)))
}

/// Eigenpairs of both families and what couples them.
struct Eigenpairs {
    b_lse: Vec<f64>,
    b_lsm: Vec<f64>,
    f: RMat,
    g: RMat,
    ag: RMat,
    /// E⁻¹ f.
    ef: RMat,
    /// O b_g and b_f O.
    overlaps: [RMat; 2],
}

impl Eigenpairs {
    fn new(segments: &[Segment], functions: &RealFunctions) -> Result<Option<Self>, Error> {
        let [epsilon, inverse] =
            permittivities_about(segments, functions.reach(), functions.origin());
        let e = functions.multiplication(FieldGroup::Z, FieldGroup::Z, &epsilon);
        let a = functions.multiplication(FieldGroup::X, FieldGroup::X, &inverse);
        let (Some(e_inverse), Some(l)) = (inverse_definite_real(&e), cholesky_real(&a)) else {
            return Ok(None);
        };
        let z = functions.of(FieldGroup::Z);
        let mut lse = e;
        for (i, wave) in z.iter().enumerate() {
            lse[(i, i)] -= wave.kappa * wave.kappa;
        }
        let (b_lse, f) = eigen_symmetric(&lse)?;

        // Dᵀ E⁻¹, and Dᵀ (Dᵀ E⁻¹)ᵀ.
        let once = functions.derivative_transposed(&e_inverse);
        let twice = functions.derivative_transposed(&transpose(&once));
        let c: RMat = Mat::from_fn(twice.nrows(), twice.ncols(), |i, j| {
            let one = if i == j { 1.0 } else { 0.0 };
            one - twice[(i, j)]
        });
        let (b_lsm, g, ag) = magnetic(c, &l)?;
        let ef = mul(&e_inverse, &f);
        let overlaps = [
            mul(&transpose(&ef), &functions.derivative(&g)),
            mul(&transpose(&f), &functions.derivative(&ag)),
        ];
        Ok(Some(Self {
            b_lse,
            b_lsm,
            f,
            g,
            ag,
            ef,
            overlaps,
        }))
    }

    /// The modes, with vectors `placed` where the line has them.
    fn finished(self, placed: impl Fn(RMat) -> RMat) -> Modes<f64> {
        let Self {
            b_lse,
            b_lsm,
            f,
            g,
            ag,
            ef,
            overlaps: [by_lsm, by_lse],
        } = self;
        let overlaps = overlaps_from_adjoint(by_lsm, by_lse);
        let (o, q) = couplings(&overlaps, &b_lse, &b_lsm);
        let dot = |a: &RMat, i: usize, b: &RMat, j: usize| {
            let pairs = a.col_as_slice(i).iter().zip(b.col_as_slice(j));
            pairs.map(|(a, b)| a * b).sum()
        };
        let degenerate = DegenerateModes::find(
            near_degenerate(&b_lse),
            near_degenerate(&b_lsm),
            &overlaps,
            (&o, &q),
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

/// Of all standing waves, about a centre of symmetry.
fn about(
    centre: f64,
    segments: &[Segment],
    functions: &RealFunctions,
) -> Result<Option<Eigenpairs>, Error> {
    let n = functions.count(FieldGroup::X);
    let zero = || -> RMat { Mat::zeros(n, n) };
    let mut all = Eigenpairs {
        b_lse: vec![0.0; n],
        b_lsm: vec![0.0; n],
        f: zero(),
        g: zero(),
        ag: zero(),
        ef: zero(),
        overlaps: [zero(), zero()],
    };
    for (part, [x, z]) in functions.parities(centre).iter().zip(functions.halves()) {
        let Some(solved) = Eigenpairs::new(segments, part)? else {
            return Ok(None);
        };
        all.b_lse[z.clone()].copy_from_slice(&solved.b_lse);
        all.b_lsm[x.clone()].copy_from_slice(&solved.b_lsm);
        put(&mut all.f, [&z, &z], &solved.f);
        put(&mut all.ef, [&z, &z], &solved.ef);
        put(&mut all.g, [&x, &x], &solved.g);
        put(&mut all.ag, [&x, &x], &solved.ag);
        for (all, own) in all.overlaps.iter_mut().zip(&solved.overlaps) {
            put(all, [&z, &x], own);
        }
    }
    Ok(Some(all))
}

fn put(to: &mut RMat, [rows, columns]: [&Range<usize>; 2], from: &RMat) {
    to.as_mut()
        .submatrix_mut(rows.start, columns.start, rows.len(), columns.len())
        .copy_from(from);
}

/// The functions themselves, with b = ε - κ²; g = √ε is normalised as that of other layers.
fn uniform(epsilon: f64, functions: &RealFunctions) -> Modes<f64> {
    let b = |field| -> Vec<f64> {
        let waves = functions.of(field).iter();
        waves.map(|w| epsilon - w.kappa * w.kappa).collect()
    };
    let (b_lse, b_lsm) = (b(FieldGroup::Z), b(FieldGroup::X));
    let diagonal = |n: usize, value: f64| -> RMat {
        Mat::from_fn(n, n, |i, j| if i == j { value } else { 0.0 })
    };
    let (x, z) = (b_lsm.len(), b_lse.len());
    let root = epsilon.sqrt();
    let by_root = functions.derivative(&diagonal(x, 1.0 / root));
    Eigenpairs {
        f: diagonal(z, 1.0),
        g: diagonal(x, root),
        ag: diagonal(x, 1.0 / root),
        ef: diagonal(z, 1.0 / epsilon),
        overlaps: [by_root.clone(), by_root],
        b_lse,
        b_lsm,
    }
    .finished(|m| m)
}
