// SPDX-License-Identifier: MIT OR Apache-2.0
//! The tangential fields of one incident wave on every plane, by one pass up and one pass down.
//!
//! In: stack, waves, incident wave. Out: the coefficients on the first and the last plane; whoever
//! watches sees those of every slab on the way down. A state is N with E = N t, H = (1 - N) t.

use super::Incident;
use super::evaluate::Points;
use super::slab::{Medium, Slab, Tangential};
use super::waves::Waves;
use crate::error::Error;
use crate::linalg::{CMat, Lu, inverse, mul};
use crate::orders::Truncation;
use crate::progress::Progress;
use crate::relief::Layer;
use crate::stack::Stack;
use crate::stack::arithmetic::THIN;
use faer::Mat;
use num_complex::Complex64;
use std::sync::Arc;

/// States saved on the way up before every second one is dropped.
const MAX_SAVED: usize = 48;

/// Matrices (2N)² that [`solve`] keeps, about: of all slabs, those saved and those from one saved state
/// to the next.
pub(super) fn matrices(stack: &Stack, truncation: Truncation) -> f64 {
    let steepest = truncation.highest() as f64 / stack.period_per_wavelength();
    let slabs = |layer: &Layer| (steepest * stack.optical_thickness(layer) / THIN).max(1.0);
    let slabs: f64 = stack.layers().iter().map(slabs).sum();
    let saved = slabs.min(MAX_SAVED as f64);
    saved + 3.0 * (2.0 * slabs / MAX_SAVED as f64).max(1.0)
}

/// The field on the first and on the last plane of the structure.
pub(super) struct PlaneFields {
    pub(super) top: Tangential,
    pub(super) bottom: Tangential,
}

/// One slab, and how t below it follows from t above it.
struct SlabStep {
    slab: Slab,
    medium: Arc<Medium>,
    /// N below.
    below: CMat,
    /// t below = `down` t above.
    down: CMat,
}

/// Progress of the pass up: the state below one slab.
#[derive(Clone)]
struct SavedState {
    /// Slabs below.
    number: usize,
    layer: usize,
    part: usize,
    state: CMat,
}

/// Walks up from a saved state, slab by slab.
struct Ascent<'a> {
    stack: &'a Stack,
    waves: &'a Waves,
    at: SavedState,
    medium: Option<(Arc<Medium>, usize)>,
    progress: &'a Progress<'a>,
}

impl Ascent<'_> {
    /// Takes in the next slab, or `None` above the last.
    fn step(&mut self) -> Result<Option<SlabStep>, Error> {
        let layers: &[Layer] = self.stack.layers();
        // Layers are counted from the bottom on the way up.
        let Some(number) = (layers.len()).checked_sub(self.at.layer + 1) else {
            return Ok(None);
        };
        let layer = &layers[number];
        let d = self.stack.optical_thickness(layer);
        let (medium, parts) = if let Some((medium, parts)) = &self.medium {
            (Arc::clone(medium), *parts)
        } else {
            if (self.progress)(1).is_break() {
                return Err(Error::Stopped);
            }
            let medium = Arc::new(Medium::new(layer, &self.waves.kx, self.waves.ky)?);
            let parts = medium.slabs(d);
            self.medium = Some((Arc::clone(&medium), parts));
            (medium, parts)
        };
        let slab = Slab { layer: number, part: self.at.part, parts, thickness: d / parts as f64 };
        let below = self.at.state.clone();
        let raised = medium.raised(&medium.to_own(&by_parameters(&below)), slab.thickness);
        let above = medium.to_fourier(raised);
        let n = above.ex.nrows();
        let e: CMat =
            Mat::from_fn(
                2 * n,
                2 * n,
                |i, j| {
                    if i < n { above.ex[(i, j)] } else { above.ey[(i - n, j)] }
                },
            );
        let sum: CMat = Mat::from_fn(2 * n, 2 * n, |i, j| {
            e[(i, j)] + if i < n { above.hy[(i, j)] } else { above.hx[(i - n, j)] }
        });
        let down = inverse(&sum);
        self.at.state = mul(&e, &down);
        self.at.number += 1;
        self.at.part += 1;
        if self.at.part == parts {
            (self.at.part, self.at.layer) = (0, self.at.layer + 1);
            self.medium = None;
        }
        Ok(Some(SlabStep { slab, medium, below, down }))
    }
}

/// The fields that every unit parameter stands for.
fn by_parameters(state: &CMat) -> Tangential {
    let n = state.nrows() / 2;
    let rows = |from: usize| Mat::from_fn(n, 2 * n, |i, j| state[(from + i, j)]);
    let rest = |from: usize| {
        Mat::from_fn(n, 2 * n, |i, j| {
            let one = if from + i == j { 1.0 } else { 0.0 };
            one - state[(from + i, j)]
        })
    };
    Tangential { ex: rows(0), ey: rows(n), hy: rest(0), hx: rest(n) }
}

/// N above the bottom half-space, where waves only go down: s has h = kz e, p has e = (kz/ε) h.
fn bottom_state(waves: &Waves) -> CMat {
    let n = waves.kx.len();
    let epsilon = waves.index[1] * waves.index[1];
    let mut state: CMat = Mat::zeros(2 * n, 2 * n);
    for (m, &(cos, sin)) in waves.frame.iter().enumerate() {
        let kz = waves.kz[1][m];
        let (s, p) = ((1.0 + kz).inv(), kz / (kz + epsilon));
        state[(m, m)] = s * sin * sin + p * cos * cos;
        state[(n + m, n + m)] = s * cos * cos + p * sin * sin;
        state[(m, n + m)] = (p - s) * sin * cos;
        state[(n + m, m)] = state[(m, n + m)];
    }
    state
}

/// t on the first plane. Upward waves drop out of kz E·s + H·s and of n E·p + (kz/n) H·p, where ·
/// is with the tangential vectors.
fn top_parameters(waves: &Waves, state: &CMat, incident: &Incident) -> Vec<Complex64> {
    let count = waves.kx.len();
    let (n, kz) = (waves.index[0], &waves.kz[0]);
    let h = |i: usize, j: usize| {
        let one = if i == j { 1.0 } else { 0.0 };
        one - state[(i, j)]
    };
    let matrix: CMat = Mat::from_fn(2 * count, 2 * count, |row, j| {
        let m = row % count;
        let (cos, sin) = waves.frame[m];
        let (ex, ey) = (state[(m, j)], state[(count + m, j)]);
        let (hy, hx) = (h(m, j), h(count + m, j));
        if row < count {
            kz[m] * (ey * cos - ex * sin) + (hx * cos - hy * sin)
        } else {
            n * (ex * cos + ey * sin) + kz[m] / n * (hy * cos + hx * sin)
        }
    });
    let m = waves.position(incident.order);
    let mut t: CMat = Mat::zeros(2 * count, 1);
    t[(m, 0)] = 2.0 * kz[m] * incident.amplitudes[0];
    t[(count + m, 0)] = 2.0 * kz[m] * incident.amplitudes[1];
    Lu::new(&matrix).solve(t.as_mut());
    (0..2 * count).map(|i| t[(i, 0)]).collect()
}

/// Finds the field of `incident`, coming from the top, and shows `points` every slab and both
/// half-spaces.
pub(super) fn solve(
    stack: &Stack,
    waves: &Waves,
    incident: &Incident,
    points: &mut Points,
    progress: &Progress<'_>,
) -> Result<PlaneFields, Error> {
    let mut ascent = Ascent {
        stack,
        waves,
        at: SavedState { number: 0, layer: 0, part: 0, state: bottom_state(waves) },
        medium: None,
        progress,
    };
    // Up: states at every `stride`th slab are saved.
    let (mut saved, mut stride) = (vec![ascent.at.clone()], 1);
    while ascent.step()?.is_some() {
        if ascent.at.number.is_multiple_of(stride) {
            saved.push(ascent.at.clone());
        }
        if saved.len() > MAX_SAVED {
            stride *= 2;
            saved.retain(|k| k.number.is_multiple_of(stride));
        }
    }
    let total = ascent.at.number;
    let t = top_parameters(waves, &ascent.at.state, incident);
    let top = Tangential::from_state(&ascent.at.state, &t);
    points.above(&top, &waves.incoming(incident), waves);

    // Down: the slabs above a saved state once more, then the field through them.
    let mut bottom = top.clone();
    let mut end = total;
    while let Some(from) = saved.pop() {
        let mut steps = Vec::with_capacity(end - from.number);
        let begin = from.number;
        ascent.at = from;
        ascent.medium = None;
        for _ in begin..end {
            steps.extend(ascent.step()?);
        }
        end = begin;
        for step in steps.iter().rev() {
            let t = bottom.sum();
            let below: Vec<Complex64> = (0..t.len())
                .map(|i| (0..t.len()).map(|j| step.down[(i, j)] * t[j]).sum())
                .collect();
            bottom = Tangential::from_state(&step.below, &below);
            let own = step.medium.to_own(&bottom);
            points.within(&step.slab, &step.medium, &own);
        }
    }
    points.below(&bottom, waves);
    Ok(PlaneFields { top, bottom })
}
