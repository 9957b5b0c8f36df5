// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fourier coefficients of a layer in closed form, and the layer's centre of mirror symmetry.
//!
//! In: the [`Segment`]s of a layer and a function of their index (ε, 1/ε, ...). Out: c(n) for n =
//! -max..=max of f(x) = Σ c(n) exp(2πi n x), x a fraction of the period. The coefficients are exact
//! but for round-off (never sampled), which Li's rules of factorisation presuppose [Li 1996, J.
//! Opt. Soc. Am. A 13, 1870]. About the centre of a mirror-symmetric layer they are even in n,
//! which turns the eigenproblems of a lossless layer into real ones.

#[cfg(test)]
mod tests;

use num_complex::Complex64;

use crate::relief::{SAME_PLACE, Segment, push_merged};

/// Coefficients of ε and of 1/ε.
pub(crate) fn permittivities_about(
    segments: &[Segment],
    max_order: usize,
    centre: f64,
) -> [Vec<Complex64>; 2] {
    let values = |index: Complex64| {
        let epsilon = index * index;
        [epsilon, epsilon.inv()]
    };
    coefficients(segments, values, max_order, centre)
}

/// Coefficients c(-max), ..., c(0), ..., c(max) of several functions of the index over segments
/// that cover one period, with the origin of x at `centre` (a fraction of the period): c(n) at
/// place n + max.
///
/// Real values give c(-n) = conj c(n) to the last bit. About a [`symmetry_centre`] c(-n) = c(n) but
/// for round-off.
pub(crate) fn coefficients<const K: usize>(
    segments: &[Segment],
    values: impl Fn(Complex64) -> [Complex64; K],
    max_order: usize,
    centre: f64,
) -> [Vec<Complex64>; K] {
    let mut all = std::array::from_fn(|_| vec![Complex64::ZERO; 2 * max_order + 1]);
    let Some(widest) = segments.iter().max_by(|a, b| a.width().total_cmp(&b.width())) else {
        return all;
    };
    // Only contrasts against one material count for n ≠ 0: less cancellation, and a uniform layer
    // gives exact zeros.
    let base = values(widest.index);
    for (c, base) in all.iter_mut().zip(base) {
        c[max_order] = base;
    }
    for segment in segments {
        let here = values(segment.index);
        let contrasts: [Complex64; K] = std::array::from_fn(|k| here[k] - base[k]);
        if contrasts.iter().all(|&c| c == Complex64::ZERO) {
            continue;
        }
        let (width, place) = (segment.width(), segment.middle() - centre);
        for (c, contrast) in all.iter_mut().zip(contrasts) {
            c[max_order] += contrast * width;
        }
        for n in 1..=max_order {
            // ∫ exp(-2πi n x) dx over the segment = sin(π n w)/(π n) exp(-2πi n place).
            let order = n as f64;
            let amplitude = sin_pi(order, width) / (std::f64::consts::PI * order);
            let phase = Complex64::cis(-std::f64::consts::TAU * fraction(order, place));
            let basis = amplitude * phase;
            for (c, contrast) in all.iter_mut().zip(contrasts) {
                c[max_order + n] += contrast * basis;
                c[max_order - n] += contrast * basis.conj();
            }
        }
    }
    all
}

/// The place in 0 ≤ x < 1 (fraction of the period) about which the layer is its own mirror
/// image, boundaries compared to 1e-12 of the period; none if there is no such place.
///
/// Layers of one or two stretches (counted around the period) always have one.
pub(crate) fn symmetry_centre(segments: &[Segment]) -> Option<f64> {
    let ring = merged_ring(segments);
    if ring.len() <= 1 {
        return ring.first().map(|_| 0.0);
    }
    middles_of_symmetry(&ring).next()
}

/// All such places of a layer that is not of one material.
pub(crate) fn symmetry_centres(segments: &[Segment]) -> Vec<f64> {
    middles_of_symmetry(&merged_ring(segments)).collect()
}

/// Materials differ on the two sides of a boundary, so an axis goes through middles only.
fn middles_of_symmetry(ring: &[Segment]) -> impl Iterator<Item = f64> + '_ {
    (0..ring.len()).filter(|&i| mirrors_about(ring, i)).map(|i| ring[i].middle().rem_euclid(1.0))
}

/// True where the layer is its own mirror image about `centre`, boundaries compared as by
/// [`symmetry_centre`].
pub(crate) fn is_symmetric_about(segments: &[Segment], centre: f64) -> bool {
    let ring = merged_ring(segments);
    if ring.len() <= 1 {
        return true;
    }
    // On an axis of symmetry lies the middle of some stretch.
    (0..ring.len()).any(|i| {
        let beside = ring[i].middle() - centre;
        (beside - beside.round()).abs() <= SAME_PLACE && mirrors_about(&ring, i)
    })
}

/// True where the ring of segments is its own mirror image about the middle of segment `i`.
fn mirrors_about(ring: &[Segment], i: usize) -> bool {
    let n = ring.len();
    let (mut right, mut left) = (0.0, 0.0);
    (1..=n / 2).all(|j| {
        let (a, b) = (&ring[(i + j) % n], &ring[(i + n - j) % n]);
        right += a.width();
        left += b.width();
        a.index == b.index && (right - left).abs() <= 2.0 * SAME_PLACE
    })
}

/// Segments around the period with neighbours of equal index merged, also across its end; the
/// first may then begin below 0.
fn merged_ring(segments: &[Segment]) -> Vec<Segment> {
    let mut ring: Vec<Segment> = Vec::with_capacity(segments.len());
    for &segment in segments {
        push_merged(&mut ring, segment);
    }
    if ring.len() > 1 && ring[0].index == ring[ring.len() - 1].index {
        // The first stretch begins before the period does: with the last one.
        ring[0].x0 = ring[ring.len() - 1].x0 - 1.0;
        ring.pop();
    }
    ring
}

/// n x less the nearest whole number, without the rounding of the product.
fn fraction(n: f64, x: f64) -> f64 {
    let product = n * x;
    let rounding = n.mul_add(x, -product);
    (product - product.round()) + rounding
}

/// sin(π n w), exact zeros where n w is whole.
fn sin_pi(n: f64, w: f64) -> f64 {
    let product = n * w;
    let sign = if product.round().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
    sign * (std::f64::consts::PI * fraction(n, w)).sin()
}
