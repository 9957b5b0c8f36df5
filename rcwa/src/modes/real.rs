// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modes of a lossless layer in functions whose matrices are real: real symmetric problems whatever
//! the layer's shape.
//!
//! In: a layer and the [`RealFunctions`] of a line. Out: [`Modes`] of real numbers, with O and Q =
//! Oᵀ real. For cosines and sines K = -i ∂, and the complex O and Q are -i O and i Q. E is among
//! the functions of Z and A among those of X.
//!
//! A layer with a centre of symmetry has even and odd modes about it. All standing waves then come
//! from two problems of half the size, turned back to the origin by one rotation for every pair of
//! a cosine and a sine.

use super::Modes;
use super::definite::{Derivative, Eigenpairs};
use crate::error::Error;
use crate::expansion::real::{FunctionSet, RealFunctions};
use crate::expansion::{Expansion, FieldGroup};
use crate::fourier::{permittivities_about, symmetry_centre};
use crate::linalg::{RMat, transpose};
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
        None => eigenpairs(&layer.segments, functions)?,
    };
    let placed = |m: RMat| match centre {
        Some(centre) => functions.moved(&m, centre),
        None => m,
    };
    Ok(solved.map(|solved| solved.finished(placed)))
}

impl Derivative<f64> for RealFunctions {
    fn kappa_squared(&self) -> Vec<f64> {
        let z = self.functions_of(FieldGroup::Z).iter();
        z.map(|wave| wave.kappa * wave.kappa).collect()
    }

    fn times(&self, m: &RMat) -> RMat {
        self.derivative(m)
    }

    /// Dᵀ (Dᵀ m)ᵀ for a symmetric m.
    fn sandwich(&self, m: &RMat) -> RMat {
        self.derivative_transposed(&transpose(&self.derivative_transposed(m)))
    }
}

fn eigenpairs(
    segments: &[Segment],
    functions: &RealFunctions,
) -> Result<Option<Eigenpairs<f64>>, Error> {
    let [epsilon, inverse] = permittivities_about(segments, functions.reach(), functions.origin());
    let e = functions.multiplication(FieldGroup::Z, FieldGroup::Z, &epsilon);
    let a = functions.multiplication(FieldGroup::X, FieldGroup::X, &inverse);
    Eigenpairs::new(e, &a, functions)
}

/// Eigenpairs of all standing waves about a centre of symmetry, parity by parity.
fn about(
    centre: f64,
    segments: &[Segment],
    functions: &RealFunctions,
) -> Result<Option<Eigenpairs<f64>>, Error> {
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
        let Some(solved) = eigenpairs(segments, part)? else {
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
    to.as_mut().submatrix_mut(rows.start, columns.start, rows.len(), columns.len()).copy_from(from);
}

/// The functions themselves, with b = ε - κ²; g = √ε is normalised as that of other layers.
fn uniform(epsilon: f64, functions: &RealFunctions) -> Modes<f64> {
    let b = |field| -> Vec<f64> {
        let waves = functions.functions_of(field).iter();
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
