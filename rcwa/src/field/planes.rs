// SPDX-License-Identifier: MIT OR Apache-2.0
//! The tangential fields of one incident wave on every plane: up with the states, down with the field.
//!
//! In: stack, waves, incident wave. Out: the coefficients on the first and the last plane; whoever watches sees those of every slab on the
//! way down. A state is N with E = N t, H = (1 - N) t.

use super::Incident;
use super::evaluate::Points;
use super::slab::{Medium, Tangential};
use crate::error::Error;
use crate::linalg::{CMat, Lu, inverse, mul};
use crate::orders::half_space_kz;
use crate::orders::{Bloch, Channel, Truncation, tangent};
use crate::progress::Progress;
use crate::relief::Layer;
use crate::stack::Stack;
use crate::wave::Side;
use faer::Mat;
use num_complex::Complex64;
use std::sync::Arc;

/// States kept on the way up before every second one is dropped.
const LARGEST_CACHE: usize = 48;

/// Wavevectors of all orders, and the frames of s and p.
pub(super) struct Waves {
    pub(super) kx: Vec<f64>,
    pub(super) ky: f64,
    /// Indices of the half-spaces, top first.
    pub(super) index: [Complex64; 2],
    /// kz of every order in the half-spaces.
    pub(super) kz: [Vec<Complex64>; 2],
    /// Unit vector (cos, sin) along the tangential wavevector.
    frame: Vec<(f64, f64)>,
    lowest: i32,
}

impl Waves {
    pub(super) fn new(stack: &Stack, bloch: Bloch, truncation: Truncation) -> Self {
        let ratio = stack.period_per_wavelength();
        let kx: Vec<f64> = truncation
            .orders()
            .map(|m| bloch.kx0 + f64::from(m) / ratio)
            .collect();
        let index = [Side::Top, Side::Bottom].map(|side| stack.index(side));
        Self {
            ky: bloch.ky,
            kz: index.map(|n| half_space_kz(n, &kx, bloch.ky)),
            frame: kx.iter().map(|&k| tangent(k, bloch)).collect(),
            index,
            kx,
            lowest: -(truncation.highest() as i32),
        }
    }

    fn position(&self, order: i32) -> usize {
        (order - self.lowest) as usize
    }

    /// Coefficients of the incident wave on the first plane: s has E = s and H = kz k∥/|k∥|, p has E = (kz/n) k∥/|k∥| and H = n s.
    pub(super) fn incoming(&self, incident: &Incident) -> Coefficients {
        let m = self.position(incident.order);
        let ((cos, sin), n, kz) = (self.frame[m], self.index[0], self.kz[0][m]);
        let [s, p] = incident.amplitudes;
        let at = |value: Complex64| -> Vec<Complex64> {
            let mut all = vec![Complex64::ZERO; self.kx.len()];
            all[m] = value;
            all
        };
        // In (Ex, Ey) and (Hy, -Hx) the magnetic vectors look like the electric ones.
        let (along, across) = (p * kz / n, p * n);
        Coefficients {
            e: [at(along * cos - s * sin), at(along * sin + s * cos)],
            h: [
                at(across * cos - s * kz * sin),
                at(across * sin + s * kz * cos),
            ],
        }
    }

    /// Amplitudes (s, p) of the upward waves of the open channels at the first plane, as power.
    pub(super) fn upward_power(
        &self,
        open: &[Channel],
        incident: &Incident,
        top: &Coefficients,
    ) -> f64 {
        let power = |channel: &Channel| {
            let m = self.position(channel.order);
            let (cos, sin) = self.frame[m];
            let [mut s, mut p] = [
                top.e[1][m] * cos - top.e[0][m] * sin,
                (top.h[0][m] * cos + top.h[1][m] * sin) / self.index[0],
            ];
            if channel.order == incident.order {
                // What comes in has E·s = a_s and H·s = n a_p.
                s -= incident.amplitudes[0];
                p -= incident.amplitudes[1];
            }
            channel.kz.re * (s.norm_sqr() + p.norm_sqr())
        };
        open.iter().map(power).sum()
    }
}

/// Tangential coefficients of one field: e is (Ex, Ey), h is (Hy, -Hx).
#[derive(Clone, Debug)]
pub(super) struct Coefficients {
    pub(super) e: [Vec<Complex64>; 2],
    pub(super) h: [Vec<Complex64>; 2],
}

impl Coefficients {
    /// Downward power through the plane, in units in which a wave of unit amplitude carries kz.
    pub(super) fn power(&self) -> f64 {
        let of = |e: &[Complex64], h: &[Complex64]| -> f64 {
            e.iter().zip(h).map(|(e, h)| (e.conj() * h).re).sum()
        };
        of(&self.e[0], &self.h[0]) + of(&self.e[1], &self.h[1])
    }

    pub(super) fn of(fields: &Tangential) -> Self {
        let column = |m: &CMat| (0..m.nrows()).map(|i| m[(i, 0)]).collect();
        Self {
            e: [column(&fields.ex), column(&fields.ey)],
            h: [column(&fields.hy), column(&fields.hx)],
        }
    }

    fn tangential(&self) -> Tangential {
        let column = |v: &[Complex64]| Mat::from_fn(v.len(), 1, |i, _| v[i]);
        Tangential {
            ex: column(&self.e[0]),
            ey: column(&self.e[1]),
            hy: column(&self.h[0]),
            hx: column(&self.h[1]),
        }
    }

    /// From N and t.
    fn from_state(state: &CMat, t: &[Complex64]) -> Self {
        let n = t.len() / 2;
        let e: Vec<Complex64> = (0..2 * n)
            .map(|i| (0..2 * n).map(|j| state[(i, j)] * t[j]).sum())
            .collect();
        let h: Vec<Complex64> = t.iter().zip(&e).map(|(t, e)| t - e).collect();
        let halves = |v: &[Complex64]| [v[..n].to_vec(), v[n..].to_vec()];
        Self {
            e: halves(&e),
            h: halves(&h),
        }
    }

    fn sum(&self) -> Vec<Complex64> {
        let one = |i: usize| self.e[i].iter().zip(&self.h[i]).map(|(e, h)| e + h);
        one(0).chain(one(1)).collect()
    }
}

/// The field on the first and on the last plane of the structure.
pub(super) struct Ends {
    pub(super) top: Coefficients,
    pub(super) bottom: Coefficients,
}

/// One slab, and how t below it follows from t above it.
struct Step {
    slab: Slab,
    medium: Arc<Medium>,
    /// N below.
    below: CMat,
    /// t below = `down` t above.
    down: CMat,
}

/// A part of a layer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slab {
    /// Layer, counted from the top.
    layer: usize,
    /// Part of it, counted from below, and how many there are.
    part: usize,
    parts: usize,
    /// Thickness times k0.
    thickness: f64,
}

impl Slab {
    /// Depths of its top and bottom within its layer, as fractions of the layer's thickness.
    pub(super) fn extent(&self) -> [f64; 2] {
        [self.part + 1, self.part].map(|p| 1.0 - p as f64 / self.parts as f64)
    }

    pub(super) fn layer(&self) -> usize {
        self.layer
    }

    pub(super) fn is_lowest(&self) -> bool {
        self.part == 0
    }

    pub(super) fn thickness(&self) -> f64 {
        self.thickness
    }
}

/// Where the way up stands: below this slab.
#[derive(Clone)]
struct Kept {
    /// Slabs below.
    number: usize,
    layer: usize,
    part: usize,
    state: CMat,
}

/// Walks up from a kept state, slab by slab.
struct Ascent<'a> {
    stack: &'a Stack,
    waves: &'a Waves,
    at: Kept,
    medium: Option<(Arc<Medium>, usize)>,
    progress: &'a Progress<'a>,
}

impl Ascent<'_> {
    /// Takes in the next slab, or `None` above the last.
    fn step(&mut self) -> Result<Option<Step>, Error> {
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
        let slab = Slab {
            layer: number,
            part: self.at.part,
            parts,
            thickness: d / parts as f64,
        };
        let below = self.at.state.clone();
        let raised = medium.raised(&medium.to_own(&by_parameters(&below)), slab.thickness);
        let above = medium.to_fourier(raised);
        let n = above.ex.nrows();
        let e: CMat = Mat::from_fn(2 * n, 2 * n, |i, j| {
            if i < n {
                above.ex[(i, j)]
            } else {
                above.ey[(i - n, j)]
            }
        });
        let sum: CMat = Mat::from_fn(2 * n, 2 * n, |i, j| {
            e[(i, j)]
                + if i < n {
                    above.hy[(i, j)]
                } else {
                    above.hx[(i - n, j)]
                }
        });
        let down = inverse(&sum);
        self.at.state = mul(&e, &down);
        self.at.number += 1;
        self.at.part += 1;
        if self.at.part == parts {
            (self.at.part, self.at.layer) = (0, self.at.layer + 1);
            self.medium = None;
        }
        Ok(Some(Step {
            slab,
            medium,
            below,
            down,
        }))
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
    Tangential {
        ex: rows(0),
        ey: rows(n),
        hy: rest(0),
        hx: rest(n),
    }
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

/// t on the first plane: what goes up drops out of kz E·s + H·s and of n E·p + (kz/n) H·p, where · is with the tangential vectors.
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

/// Finds the field of `incident`, coming from the top, and shows `points` every slab and both half-spaces.
pub(super) fn solve(
    stack: &Stack,
    waves: &Waves,
    incident: &Incident,
    points: &mut Points,
    progress: &Progress<'_>,
) -> Result<Ends, Error> {
    let mut ascent = Ascent {
        stack,
        waves,
        at: Kept {
            number: 0,
            layer: 0,
            part: 0,
            state: bottom_state(waves),
        },
        medium: None,
        progress,
    };
    // Up: states at every `stride`th slab are kept.
    let (mut kept, mut stride) = (vec![ascent.at.clone()], 1);
    while ascent.step()?.is_some() {
        if ascent.at.number.is_multiple_of(stride) {
            kept.push(ascent.at.clone());
        }
        if kept.len() > LARGEST_CACHE {
            stride *= 2;
            kept.retain(|k| k.number.is_multiple_of(stride));
        }
    }
    let total = ascent.at.number;
    let t = top_parameters(waves, &ascent.at.state, incident);
    let top = Coefficients::from_state(&ascent.at.state, &t);
    points.above(&top, &waves.incoming(incident), waves);

    // Down: the slabs above a kept state once more, then the field through them.
    let mut bottom = top.clone();
    let mut end = total;
    while let Some(from) = kept.pop() {
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
            bottom = Coefficients::from_state(&step.below, &below);
            let own = step.medium.to_own(&bottom.tangential());
            points.within(&step.slab, &step.medium, &own);
        }
    }
    points.below(&bottom, waves);
    Ok(Ends { top, bottom })
}
