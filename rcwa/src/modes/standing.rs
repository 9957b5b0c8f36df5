// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modes of a lossless layer in cosines and sines: real symmetric problems whatever the layer's shape.
//!
//! In: a layer and the [`Harmonics`] of a line. Out: [`Modes`] of real numbers, with O → O and Q → Oᵀ real, where the complex
//! ones are -i O and i Q. K = -i ∂, and ∂ turns cosines into sines: ∂ √2cos κx = -κ √2sin κx, ∂ √2sin κx = κ √2cos κx. With
//!
//! - LSE: (E - κ²) f = b f,   LSM: (1 + ∂ E⁻¹ ∂) g = b A g,   O = fᵀ E⁻¹ ∂ g / b_g = fᵀ ∂ A g / b_f
//!
//! A layer with a centre of symmetry has even and odd modes about it: two problems of half the size, turned back to the
//! origin by one rotation for every pair of a cosine and a sine.

use super::coalescing::Coalescing;
use super::lossless::{critical, magnetic, overlaps_from_adjoint};
use super::slanted::Expansion;
use super::{Modes, couplings, orthonormal_basis};
use crate::error::Error;
use crate::fourier::{coefficients_about, symmetry_centre};
use crate::linalg::{RMat, cholesky_real, eigen_symmetric, inverse_definite_real, mul, transpose};
use crate::relief::{Layer, Segment};
use crate::standing::Mirrored;
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2, TAU};

/// √2 cos κx for every wavenumber, then √2 sin κx for every κ > 0; the cosine of κ = 0 is 1.
#[derive(Clone, Debug)]
pub(crate) struct Harmonics {
    /// κ in units of k0, ascending.
    wavenumbers: Vec<f64>,
    /// κ in units of 2π over the period.
    numbers: Vec<f64>,
    /// Cosines without a sine: 1 if the first κ is 0.
    unpaired: usize,
}

impl Harmonics {
    pub(crate) fn new(at: Mirrored, highest: usize, period_per_wavelength: f64) -> Self {
        let (offset, unpaired) = match at {
            Mirrored::Centre => (0.0, 1),
            Mirrored::Edge => (0.5, 0),
        };
        let numbers: Vec<f64> = (0..=highest).map(|m| m as f64 + offset).collect();
        Self {
            wavenumbers: numbers.iter().map(|n| n / period_per_wavelength).collect(),
            numbers,
            unpaired,
        }
    }

    /// κ of every cosine, ascending, in units of k0.
    pub(crate) fn wavenumbers(&self) -> &[f64] {
        &self.wavenumbers
    }

    /// Cosines and sines together.
    pub(crate) fn count(&self) -> usize {
        2 * self.numbers.len() - self.unpaired
    }

    /// The orders ±κ, ascending.
    pub(crate) fn orders(&self) -> std::ops::RangeInclusive<i32> {
        let last = self.numbers.len() as i32 - 1;
        (self.unpaired as i32 - 1 - last)..=last
    }

    /// The place of the sine that belongs to the cosine at place `i`.
    pub(crate) fn sine(&self, i: usize) -> Option<usize> {
        (i >= self.unpaired).then(|| self.numbers.len() + i - self.unpaired)
    }

    /// (cosine's number, whether it is the sine) of a place.
    fn place(&self, i: usize) -> (usize, bool) {
        match i.checked_sub(self.numbers.len()) {
            None => (i, false),
            Some(sine) => (sine + self.unpaired, true),
        }
    }

    /// κ at every place.
    fn kappa(&self) -> Vec<f64> {
        (0..self.count())
            .map(|i| self.wavenumbers[self.place(i).0])
            .collect()
    }

    /// ∂ times a matrix whose rows are the harmonics.
    pub(crate) fn derivative(&self, m: &RMat) -> RMat {
        let mut out = Mat::zeros(m.nrows(), m.ncols());
        for j in 0..m.ncols() {
            for i in self.unpaired..self.numbers.len() {
                let sine = self.numbers.len() + i - self.unpaired;
                out[(i, j)] = self.wavenumbers[i] * m[(sine, j)];
                out[(sine, j)] = -self.wavenumbers[i] * m[(i, j)];
            }
        }
        out
    }

    /// Expansions about `centre` (a fraction of the period) as expansions about the origin.
    fn moved(&self, m: &RMat, centre: f64) -> RMat {
        let mut out = m.clone();
        for i in self.unpaired..self.numbers.len() {
            let sine = self.numbers.len() + i - self.unpaired;
            let (sin, cos) = (TAU * self.numbers[i] * centre).sin_cos();
            for j in 0..m.ncols() {
                let (c, s) = (m[(i, j)], m[(sine, j)]);
                out[(i, j)] = cos * c - sin * s;
                out[(sine, j)] = sin * c + cos * s;
            }
        }
        out
    }
}

impl Expansion<f64> for Harmonics {
    fn count(&self) -> usize {
        Harmonics::count(self)
    }

    fn reach(&self) -> usize {
        (2.0 * self.numbers.last().copied().unwrap_or(0.0)).round() as usize
    }

    fn multiplication(&self, c: &[Complex64]) -> RMat {
        multiplication(self, c)
    }

    fn along(&self, m: &RMat) -> RMat {
        self.derivative(m)
    }

    fn at(&self, x: f64) -> Vec<f64> {
        let mut values = vec![1.0; self.count()];
        for (i, number) in self.numbers.iter().enumerate().skip(self.unpaired) {
            let (sin, cos) = (TAU * number * x).sin_cos();
            values[i] = SQRT_2 * cos;
            values[self.numbers.len() + i - self.unpaired] = SQRT_2 * sin;
        }
        values
    }

    fn function(&self, number: &mut dyn FnMut() -> f64) -> Vec<f64> {
        // The same function as in orders: c exp(-iκx) + c* exp(iκx) = √2 Re c √2cos κx + √2 Im c √2sin κx.
        let mut coefficients = vec![0.0; self.count()];
        for i in (self.unpaired..self.numbers.len()).rev() {
            coefficients[i] = SQRT_2 * number();
            coefficients[self.numbers.len() + i - self.unpaired] = SQRT_2 * number();
        }
        if self.unpaired == 1 {
            coefficients[0] = number();
        }
        coefficients
    }

    fn steps(&self) -> (f64, f64) {
        (1.0, -1.0)
    }
}

/// Matrix of the product with a function of real Fourier series `c`, c(n) at place n + reach.
fn multiplication(harmonics: &Harmonics, c: &[Complex64]) -> RMat {
    let reach = (c.len() - 1) as i64 / 2;
    // Numbers are whole or half-odd; sums and differences are whole.
    let at = |twice: i64| c[(reach + twice / 2) as usize];
    let places: Vec<(i64, bool, f64)> = (0..harmonics.count())
        .map(|i| {
            let (number, is_sine) = harmonics.place(i);
            let scale = if number < harmonics.unpaired {
                FRAC_1_SQRT_2
            } else {
                1.0
            };
            let twice = (2.0 * harmonics.numbers[number]).round() as i64;
            (twice, is_sine, scale)
        })
        .collect();
    let size = harmonics.count();
    Mat::from_fn(size, size, |i, j| {
        let ((a, a_sine, a_scale), (b, b_sine, b_scale)) = (places[i], places[j]);
        let (difference, sum) = (at(a - b), at(a + b));
        let value = match (a_sine, b_sine) {
            (false, false) => difference.re + sum.re,
            (true, true) => difference.re - sum.re,
            (false, true) => difference.im - sum.im,
            (true, false) => -difference.im - sum.im,
        };
        value * a_scale * b_scale
    })
}

/// Real modes of `layer`, or `None` where truncation leaves a matrix that is not definite.
pub(crate) fn modes(layer: &Layer, harmonics: &Harmonics) -> Result<Option<Modes<f64>>, Error> {
    if let Some(index) = layer.uniform_index() {
        return Ok(Some(uniform(index.re * index.re, harmonics)));
    }
    let centre = symmetry_centre(&layer.segments);
    let cosines = harmonics.numbers.len();
    let ends: &[usize] = match centre {
        Some(_) => &[0, cosines, harmonics.count()],
        None => &[0, harmonics.count()],
    };
    let about = centre.unwrap_or(0.0);
    let (e, a) = matrices(&layer.segments, harmonics, about);
    let Some(found) = solved(&e, &a, harmonics, ends)? else {
        return Ok(None);
    };
    let n = harmonics.count();
    let Solved {
        b_lse,
        b_lsm,
        f,
        g,
        ag,
        ef,
    } = found;
    let overlaps = overlaps_from_adjoint(
        mul(&transpose(&ef), &harmonics.derivative(&g)),
        mul(&transpose(&f), &harmonics.derivative(&ag)),
    );
    let (o, q) = couplings(&overlaps, &b_lse, &b_lsm);
    let coalescing = Coalescing::find(
        critical(&b_lse),
        critical(&b_lsm),
        &overlaps,
        (&o, &q),
        |i, j| (0..n).map(|m| f[(m, i)] * ef[(m, j)]).sum(),
        |i, j| (0..n).map(|m| ag[(m, i)] * ag[(m, j)]).sum(),
    );
    let placed = |m: RMat| match centre {
        Some(centre) => harmonics.moved(&m, centre),
        None => m,
    };
    Ok(Some(Modes {
        basis: orthonormal_basis(placed(f), placed(g), placed(ag), o, q),
        b_lse,
        b_lsm,
        coalescing,
    }))
}

/// E and A about a place.
fn matrices(segments: &[Segment], harmonics: &Harmonics, about: f64) -> (RMat, RMat) {
    let reach = harmonics.reach();
    let of = |value: fn(Complex64) -> Complex64| {
        multiplication(
            harmonics,
            &coefficients_about(segments, value, reach, about),
        )
    };
    (of(|n| n * n), of(|n| (n * n).inv()))
}

/// Eigenpairs of both families, block by block.
struct Solved {
    b_lse: Vec<f64>,
    b_lsm: Vec<f64>,
    f: RMat,
    g: RMat,
    ag: RMat,
    /// E⁻¹ f.
    ef: RMat,
}

/// E and A do not join the places before and after one of `ends`; ∂ leads from each to the other, or within the only one.
fn solved(
    e: &RMat,
    a: &RMat,
    harmonics: &Harmonics,
    ends: &[usize],
) -> Result<Option<Solved>, Error> {
    // One order alone has no sine.
    let blocks: Vec<_> = ends
        .windows(2)
        .map(|w| w[0]..w[1])
        .filter(|block| !block.is_empty())
        .collect();
    let n = harmonics.count();
    let kappa = harmonics.kappa();
    let zero = || -> RMat { Mat::zeros(n, n) };
    let mut all = Solved {
        b_lse: Vec::with_capacity(n),
        b_lsm: Vec::with_capacity(n),
        f: zero(),
        g: zero(),
        ag: zero(),
        ef: zero(),
    };
    let part = |m: &RMat, block: &std::ops::Range<usize>| -> RMat {
        m.as_ref()
            .submatrix(block.start, block.start, block.len(), block.len())
            .to_owned()
    };
    let mut e_inverse = zero();
    for block in &blocks {
        let Some(inverse) = inverse_definite_real(&part(e, block)) else {
            return Ok(None);
        };
        put(&mut e_inverse, block, &inverse);
    }
    // (∂ E⁻¹)ᵀ = -E⁻¹ ∂, so that this is -∂ E⁻¹ ∂.
    let twice = harmonics.derivative(&transpose(&harmonics.derivative(&e_inverse)));
    for block in &blocks {
        let lse: RMat = Mat::from_fn(block.len(), block.len(), |i, j| {
            let (i, j) = (block.start + i, block.start + j);
            e[(i, j)] - if i == j { kappa[i] * kappa[i] } else { 0.0 }
        });
        let (b, f) = eigen_symmetric(&lse)?;
        all.b_lse.extend(b);
        put(&mut all.f, block, &f);
        put(&mut all.ef, block, &mul(&part(&e_inverse, block), &f));

        let Some(l) = cholesky_real(&part(a, block)) else {
            return Ok(None);
        };
        let c: RMat = Mat::from_fn(block.len(), block.len(), |i, j| {
            let one = if i == j { 1.0 } else { 0.0 };
            one - twice[(block.start + j, block.start + i)]
        });
        let (b, g, ag) = magnetic(c, &l)?;
        all.b_lsm.extend(b);
        put(&mut all.g, block, &g);
        put(&mut all.ag, block, &ag);
    }
    Ok(Some(all))
}

fn put(to: &mut RMat, block: &std::ops::Range<usize>, from: &RMat) {
    to.as_mut()
        .submatrix_mut(block.start, block.start, block.len(), block.len())
        .copy_from(from);
}

/// The harmonics themselves, with b = ε - κ²; g = √ε is normalised as that of other layers.
fn uniform(epsilon: f64, harmonics: &Harmonics) -> Modes<f64> {
    let n = harmonics.count();
    let b: Vec<f64> = harmonics.kappa().iter().map(|k| epsilon - k * k).collect();
    let root = epsilon.sqrt();
    let diagonal =
        |value: f64| -> RMat { Mat::from_fn(n, n, |i, j| if i == j { value } else { 0.0 }) };
    let by_root = harmonics.derivative(&diagonal(1.0 / root));
    let overlaps = overlaps_from_adjoint(by_root.clone(), by_root);
    let (o, q) = couplings(&overlaps, &b, &b);
    let norm = |i: usize, j: usize| if i == j { 1.0 / epsilon } else { 0.0 };
    let coalescing = Coalescing::find(critical(&b), critical(&b), &overlaps, (&o, &q), norm, norm);
    let basis = orthonormal_basis(diagonal(1.0), diagonal(root), diagonal(1.0 / root), o, q);
    Modes {
        basis,
        b_lse: b.clone(),
        b_lsm: b,
        coalescing,
    }
}
