// SPDX-License-Identifier: MIT OR Apache-2.0
//! The surface between two media over one period: straight sides and arcs between corners, or a
//! smooth curve.
//!
//! In: corners with the turns of their arcs, Fourier coefficients, or a [`Relief`] (`trace.rs`). Out:
//! a curve that goes on to the next period, with the top medium on that side of it on which z is
//! smaller where the curve runs along +x. It may overhang; it must not touch itself (`contact.rs`).

use super::error::{IntegralError, outline, positive};
use super::sides::{direction, following, length};
use super::{contact, trace};
use full_wave::Curve;
use num_complex::Complex64;
use rcwa::relief::Relief;
use std::f64::consts::TAU;

/// Most corners, and their farthest x in periods.
const MOST_CORNERS: usize = 1000;
const WIDEST: f64 = 16.0;
/// Sides that turn by less than this (sine of the angle) are one.
const STRAIGHT: f64 = 1e-9;

/// One period of a surface; a value that exists is valid.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    period: f64,
    shape: Shape,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// Corners in order along +x, each with the turn of the side that begins there, in radians; the
    /// last side leads to the first corner, one period on.
    Corners(Vec<([f64; 2], f64)>),
    /// z = Σ a_m cos(2πmx/period) + b_m sin(2πmx/period), m = 1, 2, ...
    Fourier(Vec<[f64; 2]>),
}

impl Outline {
    /// Straight sides between `corners` [x, z], ordered from left to right along the surface; the
    /// last is joined to the first of the next period. Corners at which the surface does not turn
    /// are dropped.
    ///
    /// # Errors
    /// No corners, numbers that are not finite, equal neighbours, a surface that crosses or touches
    /// itself.
    pub fn corners(period: f64, corners: &[[f64; 2]]) -> Result<Self, IntegralError> {
        let straight: Vec<_> = corners.iter().map(|&at| (at, 0.0)).collect();
        Self::arcs(period, &straight)
    }

    /// Sides between `corners` as [`Outline::corners`], each an arc that turns by so many radians on its
    /// way from the corner to the next, towards +z if positive; 0 is a straight side.
    ///
    /// # Errors
    /// As [`Outline::corners`]; turns of a whole circle or more.
    pub fn arcs(period: f64, corners: &[([f64; 2], f64)]) -> Result<Self, IntegralError> {
        positive("the period", period)?;
        let numbers = corners.iter().flat_map(|(at, turn)| [at[0], at[1], *turn]);
        if corners.is_empty() || numbers.into_iter().any(|v| !v.is_finite()) {
            return Err(outline("expected at least one corner and finite numbers"));
        }
        if corners.len() > MOST_CORNERS {
            let got = corners.len();
            return Err(outline(format!("expected at most {MOST_CORNERS} corners, got {got}")));
        }
        if let Some((at, _)) = corners.iter().find(|(at, _)| at[0].abs() > WIDEST * period) {
            let got = at[0];
            return Err(outline(format!(
                "expected x within {WIDEST} periods ({}), got {got}",
                WIDEST * period
            )));
        }
        if let Some((_, turn)) = corners.iter().find(|(_, turn)| turn.abs() >= TAU) {
            let got = turn.to_degrees();
            return Err(outline(format!(
                "expected arcs of less than 360 degrees, got {got:.6} degrees"
            )));
        }
        let places: Vec<[f64; 2]> = corners.iter().map(|corner| corner.0).collect();
        let next = |i: usize| following(&places, period, i);
        if (0..places.len()).any(|i| length(places[i], next(i)) == 0.0) {
            return Err(outline("expected neighbouring corners to differ"));
        }
        contact::crossing(&chords(corners, period), period)
            .map_or(Ok(()), |at| Err(IntegralError::Touching { at }))?;
        let turns = |i: usize| {
            let before = (i + places.len() - 1) % places.len();
            let into = direction(places[before], next(before));
            let out_of = direction(places[i], next(i));
            corners[before].1 != 0.0
                || corners[i].1 != 0.0
                || (into[0] * out_of[1] - into[1] * out_of[0]).abs() > STRAIGHT
                || into[0] * out_of[0] + into[1] * out_of[1] < 0.0
        };
        let kept: Vec<_> = (0..corners.len()).filter(|&i| turns(i)).map(|i| corners[i]).collect();
        if kept.is_empty() {
            return Self::fourier(period, Vec::new());
        }
        Ok(Self { period, shape: Shape::Corners(kept) })
    }

    /// The smooth surface z(x) = Σ a_m cos(2πmx/period) + b_m sin(2πmx/period) from [a_m, b_m], m =
    /// 1, 2, ...; none make a plane.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn fourier(period: f64, coefficients: Vec<[f64; 2]>) -> Result<Self, IntegralError> {
        positive("the period", period)?;
        if coefficients.iter().flatten().any(|v| !v.is_finite()) {
            return Err(outline("expected finite coefficients"));
        }
        Ok(Self { period, shape: Shape::Fourier(coefficients) })
    }

    /// The surface between the half-spaces of index `n_top` and `n_bottom` that a relief of these
    /// two media makes.
    ///
    /// # Errors
    /// An index that is neither of the two, bodies or holes apart from the surface, a surface that
    /// touches itself.
    pub fn of_relief(
        relief: &Relief,
        n_top: impl Into<Complex64>,
        n_bottom: impl Into<Complex64>,
    ) -> Result<Self, IntegralError> {
        let corners = trace::surface(relief, n_top.into(), n_bottom.into())?;
        Self::corners(relief.period(), &corners)
    }

    /// Length of one period.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// The corners, in order; empty for a smooth surface.
    pub fn points(&self) -> Vec<[f64; 2]> {
        match &self.shape {
            Shape::Corners(corners) => corners.iter().map(|corner| corner.0).collect(),
            Shape::Fourier(_) => Vec::new(),
        }
    }

    /// Smallest and largest z, to a thousandth of an arc's height.
    pub fn extent(&self) -> [f64; 2] {
        let heights: Vec<f64> = match &self.shape {
            Shape::Corners(corners) => chords(corners, self.period).iter().map(|p| p[1]).collect(),
            Shape::Fourier(all) => (0..1024)
                .map(|i| height(all, self.period, self.period * f64::from(i) / 1024.0)[0])
                .collect(),
        };
        let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
        heights.iter().fold([low, high], |[low, high], z| [low.min(*z), high.max(*z)])
    }

    pub(super) fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The same surface in a unit `factor` times smaller.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let scale = |point: &[f64; 2]| point.map(|v| v * factor);
        let shape = match &self.shape {
            Shape::Corners(all) => Shape::Corners(all.iter().map(|c| (scale(&c.0), c.1)).collect()),
            Shape::Fourier(all) => Shape::Fourier(all.iter().map(scale).collect()),
        };
        Self { period: self.period * factor, shape }
    }
}

/// Corners with points along arcs between them, no more than a tenth of a radian apart.
fn chords(corners: &[([f64; 2], f64)], period: f64) -> Vec<[f64; 2]> {
    let end = ([corners[0].0[0] + period, corners[0].0[1]], 0.0);
    let ends = corners.iter().skip(1).chain([&end]);
    let pieces = corners.iter().zip(ends).flat_map(|((from, turn), (to, _))| {
        let (arc, length) = Curve::between(*from, *to, *turn);
        let count = (10.0 * turn.abs()).ceil().max(1.0);
        (0..count as usize).map(move |i| arc.point(length * i as f64 / count))
    });
    pieces.collect()
}

/// z, dz/dx and d²z/dx² of a Fourier series.
pub(super) fn height(coefficients: &[[f64; 2]], period: f64, x: f64) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for (i, [a, b]) in coefficients.iter().enumerate() {
        let k = TAU * (i + 1) as f64 / period;
        let (sin, cos) = (k * x).sin_cos();
        sums[0] += a * cos + b * sin;
        sums[1] += k * (b * cos - a * sin);
        sums[2] -= k * k * (a * cos + b * sin);
    }
    sums
}
