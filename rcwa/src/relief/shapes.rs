// SPDX-License-Identifier: MIT OR Apache-2.0
//! Usual reliefs: lamellae, triangles on a chord, steps, sinusoids.
//!
//! Each puts `ridge` material (the side of the top half-space, usually) below z = 0 into a
//! `groove` material, so that the relief stands on the top half-space and points downwards (+z).

use num_complex::Complex64;

use super::{Polygon, Relief, ReliefError};

/// The materials of a relief of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Materials {
    /// Index n + ik of the relief itself.
    pub ridge: Complex64,
    /// Index n + ik of what fills the rest of its depth.
    pub groove: Complex64,
}

impl Materials {
    /// Two lossless materials.
    pub fn lossless(ridge: f64, groove: f64) -> Self {
        Self { ridge: ridge.into(), groove: groove.into() }
    }

    fn relief(self, period: f64, depth: f64, points: Vec<[f64; 2]>) -> Result<Relief, ReliefError> {
        Relief::new(period, depth, self.groove, vec![Polygon { index: self.ridge, points }])
    }
}

/// A lamellar grating: a ridge from x = 0 over the part `fill` of the period, 0 < fill < 1.
///
/// # Errors
/// A fill out of its range and whatever [`Relief::new`] refuses.
pub fn lamellar(
    period: f64,
    depth: f64,
    fill: f64,
    materials: Materials,
) -> Result<Relief, ReliefError> {
    if !(fill > 0.0 && fill < 1.0) {
        return Err(ReliefError::Shape {
            what: "the fill",
            expected: "between 0 and 1",
            got: fill,
        });
    }
    let x = fill * period;
    materials.relief(period, depth, vec![[0.0, 0.0], [x, 0.0], [x, depth], [0.0, depth]])
}

/// A triangle on the chord from (0, 0) to (period, 0) with the given apex; its height is the depth.
///
/// The apex may lie beyond either end of the chord: the triangle then overhangs its neighbour's
/// foot.
///
/// # Errors
/// Whatever [`Relief::new`] refuses.
pub fn triangle(period: f64, apex: [f64; 2], materials: Materials) -> Result<Relief, ReliefError> {
    materials.relief(period, apex[1], vec![[0.0, 0.0], [period, 0.0], apex])
}

/// Steps of the given tread and riser seen along their slope: a right triangle whose hypotenuse is
/// the period, the tread rising from x = 0 and the riser falling back to x = period.
///
/// # Errors
/// Lengths that are not positive.
pub fn step(tread: f64, riser: f64, materials: Materials) -> Result<Relief, ReliefError> {
    super::check_length("the tread", tread)?;
    super::check_length("the riser", riser)?;
    let chord = tread.hypot(riser);
    triangle(chord, [tread * (tread / chord), riser * (tread / chord)], materials)
}

/// A sinusoid z = depth (1 - cos 2πx/period) / 2 as a polygon of `sides` straight pieces (at least
/// 4). Every corner is a kink, so that a cut has at least about half as many slices.
///
/// # Errors
/// Too few sides and whatever [`Relief::new`] refuses.
pub fn sinusoid(
    period: f64,
    depth: f64,
    sides: usize,
    materials: Materials,
) -> Result<Relief, ReliefError> {
    if sides < 4 {
        let what = "the number of sides of a sinusoid";
        return Err(ReliefError::Shape { what, expected: "at 4 or above", got: sides as f64 });
    }
    let points = (0..=sides)
        .map(|i| {
            // Through the nearer end, so that both halves have the very same heights.
            let half_turn = std::f64::consts::PI * i.min(sides - i) as f64 / sides as f64;
            [period * i as f64 / sides as f64, depth * half_turn.sin().powi(2)]
        })
        .collect();
    materials.relief(period, depth, points)
}
