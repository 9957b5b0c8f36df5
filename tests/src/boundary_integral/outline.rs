// SPDX-License-Identifier: MIT OR Apache-2.0
//! The surface between two media over one period: straight sides between corners, or a smooth
//! curve.
//!
//! In: corners, Fourier coefficients, or a [`Relief`] (`trace.rs`). Out: a curve that goes on to
//! the next period, with the top medium on that side of it on which z is smaller where the curve
//! runs along +x. It may overhang; it must not touch itself (`contact.rs`).

use super::error::{IntegralError, outline, positive};
use super::sides::{direction, following, length};
use super::{contact, trace};
use rcwa::relief::Relief;
use std::f64::consts::TAU;

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
    /// Corners in order along +x; from the last a straight side leads to the first, one period on.
    Corners(Vec<[f64; 2]>),
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
        positive("the period", period)?;
        if corners.is_empty() || corners.iter().flatten().any(|v| !v.is_finite()) {
            return Err(outline("expected at least one corner and finite coordinates"));
        }
        let next = |i: usize| following(corners, period, i);
        if (0..corners.len()).any(|i| length(corners[i], next(i)) == 0.0) {
            return Err(outline("expected neighbouring corners to differ"));
        }
        contact::crossing(corners, period)
            .map_or(Ok(()), |at| Err(IntegralError::Touching { at }))?;
        let turns = |i: usize| {
            let before = (i + corners.len() - 1) % corners.len();
            let into = direction(corners[before], next(before));
            let out_of = direction(corners[i], next(i));
            (into[0] * out_of[1] - into[1] * out_of[0]).abs() > STRAIGHT
                || into[0] * out_of[0] + into[1] * out_of[1] < 0.0
        };
        let kept: Vec<[f64; 2]> =
            (0..corners.len()).filter(|&i| turns(i)).map(|i| corners[i]).collect();
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
    /// Absorbing media, an index that is neither of the two, bodies or holes apart from the
    /// surface, a surface that touches itself.
    pub fn of_relief(relief: &Relief, n_top: f64, n_bottom: f64) -> Result<Self, IntegralError> {
        let corners = trace::surface(relief, n_top, n_bottom)?;
        Self::corners(relief.period(), &corners)
    }

    /// Length of one period.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// The corners of straight sides, in order; empty for a smooth surface.
    pub fn points(&self) -> &[[f64; 2]] {
        match &self.shape {
            Shape::Corners(corners) => corners,
            Shape::Fourier(_) => &[],
        }
    }

    pub(super) fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The same surface in a unit `factor` times smaller.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let scale = |points: &[[f64; 2]]| points.iter().map(|p| p.map(|v| v * factor)).collect();
        let shape = match &self.shape {
            Shape::Corners(corners) => Shape::Corners(scale(corners)),
            Shape::Fourier(coefficients) => Shape::Fourier(scale(coefficients)),
        };
        Self { period: self.period * factor, shape }
    }
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
