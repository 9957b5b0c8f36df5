// SPDX-License-Identifier: MIT OR Apache-2.0
//! One period of a relief: polygons of the cross-section in, layers of piecewise constant index
//! out.
//!
//! A relief fills 0 ≤ z ≤ depth between the top half-space (z < 0) and the bottom one (z > depth);
//! x runs along the grating vector and is wrapped at the period. Polygons lie in a background, a
//! later one over an earlier one, and may overhang, cross the border of the period or overlap their
//! own neighbours. A horizontal cut through them gives the [`Segment`]s of a [`Layer`]; a solver
//! sees the relief as a stack of such layers, each cut at mid-height, which is second order in
//! their thickness as long as no slice contains a kink (see [`SlicePlan`]).
//!
//! Lengths are in one free unit, the solver's; indices are n + ik with k ≥ 0 (absorbing). Axes and
//! signs: `docs/explanation/conventions.md`. Staircases and their convergence: [Popov, Nevière,
//! Gralak, Tayeb 2002, J. Opt. Soc. Am. A 19, 33].
//!
//! ```
//! use num_complex::Complex64;
//! use rcwa::relief::{Polygon, Relief};
//!
//! let (air, silicone) = (Complex64::from(1.0), Complex64::from(1.41));
//! let tooth = Polygon { index: silicone, points: vec![[0.0, 0.0], [10.0, 0.0], [8.0, 4.0]] };
//! let relief = Relief::new(10.0, 4.0, air, vec![tooth]).unwrap();
//! let layers = relief.slices(16);
//! assert_eq!(layers.len(), 16);
//! assert_eq!(layers[0].segments.len(), 3);
//! ```

pub mod floating;
mod geometry;
mod layer;
pub mod shapes;
mod slanted_walls;
mod slicing;
#[cfg(test)]
mod tests;

use num_complex::Complex64;
use thiserror::Error;

pub(crate) use layer::push_merged;
pub use layer::{Layer, Segment};
pub(crate) use slanted_walls::{
    NODES_OF_A_SLICE, Strip, Wall, WallCorrection, layers as slanted_wall_layers,
};
pub use slicing::{Interval, SlicePlan, extrapolate};

/// Points may lie outside 0 ≤ z ≤ depth by this fraction of the depth; they are moved onto the
/// border.
const DEPTH_TOLERANCE: f64 = 1e-9;

/// Two boundaries closer than this fraction of the period (or of the depth) are one.
pub(crate) const SAME_PLACE: f64 = 1e-12;

/// Widest polygon in periods. Teeth that lean over their neighbours are wrapped; one wider than
/// this was not meant.
const WIDEST: f64 = 16.0;

/// Why a relief or a layer was refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ReliefError {
    /// A length is zero, negative, infinite or not a number.
    #[error("{what} must be a finite length above 0, got {got}")]
    Length {
        /// Which length.
        what: &'static str,
        /// The value.
        got: f64,
    },
    /// A layer's thickness is negative, infinite or not a number (zero is allowed).
    #[error("the thickness of a layer must be finite and not negative, got {got}")]
    Thickness {
        /// The value.
        got: f64,
    },
    /// A refractive index no passive material has.
    #[error(
        "{what}: a refractive index n + ik needs finite n >= 0 and k >= 0 that are not both 0, got [{}, {}]",
        got.re, got.im
    )]
    Index {
        /// Whose index.
        what: String,
        /// The value.
        got: Complex64,
    },
    /// Fewer than three different points.
    #[error("polygon {}: needs at least 3 different points, got {got}", polygon + 1)]
    TooFewPoints {
        /// Position in the list of polygons, from 0.
        polygon: usize,
        /// Number of different points.
        got: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error(
        "polygon {}, point {}: coordinates must be finite, got [{}, {}]",
        polygon + 1, point + 1, got[0], got[1]
    )]
    Coordinate {
        /// Position in the list of polygons, from 0.
        polygon: usize,
        /// Position in the list of points, from 0.
        point: usize,
        /// The point.
        got: [f64; 2],
    },
    /// A point above the top or below the bottom of the relief.
    #[error(
        "polygon {}, point {}: z must lie in 0 to the depth {depth}, got {z}",
        polygon + 1, point + 1
    )]
    OutsideDepth {
        /// Position in the list of polygons, from 0.
        polygon: usize,
        /// Position in the list of points, from 0.
        point: usize,
        /// The relief's depth.
        depth: f64,
        /// The point's z.
        z: f64,
    },
    /// A polygon that no wrapping makes sense of.
    #[error(
        "polygon {}: may be at most {WIDEST} periods ({limit}) wide, got {got}",
        polygon + 1
    )]
    TooWide {
        /// Position in the list of polygons, from 0.
        polygon: usize,
        /// Sixteen periods.
        limit: f64,
        /// The polygon's width.
        got: f64,
    },
    /// Two sides of one polygon cross, touch or lie on one another.
    #[error(
        "polygon {}: must not cross or touch itself, but the side from point {} meets the side from point {}",
        polygon + 1, first + 1, second + 1
    )]
    SelfCrossing {
        /// Position in the list of polygons, from 0.
        polygon: usize,
        /// The first side's first point, from 0.
        first: usize,
        /// The second side's first point, from 0.
        second: usize,
    },
    /// The segments of a layer leave a gap, overlap, or do not cover the period.
    #[error(
        "segments must cover the period from 0 to 1 without gap or overlap: segment {} should begin at {expected}, begins at {got}",
        segment + 1
    )]
    Uncovered {
        /// Position in the list of segments, from 0.
        segment: usize,
        /// End of the segment before.
        expected: f64,
        /// Begin of the segment.
        got: f64,
    },
    /// The last segment does not end at the end of the period.
    #[error("segments must cover the period from 0 to 1: the last one ends at {got}")]
    OpenEnd {
        /// End of the last segment.
        got: f64,
    },
    /// A segment that ends where or before it begins.
    #[error("segment {}: x1 must lie beyond x0, got x0 = {x0}, x1 = {x1}", segment + 1)]
    EmptySegment {
        /// Position in the list of segments, from 0.
        segment: usize,
        /// Begin of the segment.
        x0: f64,
        /// End of the segment.
        x1: f64,
    },
    /// A shape's parameter is out of its range.
    #[error("{what} must lie {expected}, got {got}")]
    Shape {
        /// Which parameter.
        what: &'static str,
        /// The allowed range in words.
        expected: &'static str,
        /// The value.
        got: f64,
    },
}

/// A closed outline of one material.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    /// Refractive index n + ik inside.
    pub index: Complex64,
    /// Corners [x, z] in order, either sense; the last joins the first.
    pub points: Vec<[f64; 2]>,
}

/// One period of a relief; a value that exists is valid.
#[derive(Debug, Clone, PartialEq)]
pub struct Relief {
    period: f64,
    depth: f64,
    background: Complex64,
    polygons: Vec<Polygon>,
}

impl Relief {
    /// A relief of `polygons` in a `background`, all in one unit of length.
    ///
    /// Repeated neighbouring points (a closing point, for instance) are dropped; points that miss
    /// 0 ≤ z ≤ depth by less than 1e-9 of the depth are moved onto it.
    ///
    /// # Errors
    /// One variant of [`ReliefError`] for each rule a relief can break: lengths, indices, number of
    /// points, place, width (at most 16 periods), self-crossing.
    pub fn new(
        period: f64,
        depth: f64,
        background: Complex64,
        polygons: Vec<Polygon>,
    ) -> Result<Self, ReliefError> {
        check_length("the period", period)?;
        check_length("the depth", depth)?;
        check_index(|| "the background".into(), background)?;
        let polygons = polygons
            .into_iter()
            .enumerate()
            .map(|(i, polygon)| valid_polygon(i, polygon, period, depth))
            .collect::<Result<_, _>>()?;
        Ok(Self { period, depth, background, polygons })
    }

    /// Length of one period along x.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Extent along z.
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Index n + ik where no polygon lies.
    pub fn background(&self) -> Complex64 {
        self.background
    }

    /// Largest real part of any index in it.
    pub fn densest(&self) -> f64 {
        self.polygons.iter().map(|p| p.index.re).fold(self.background.re, f64::max)
    }

    /// Largest index over the smallest, of real parts.
    pub(crate) fn contrast(&self) -> f64 {
        let all = self.polygons.iter().map(|p| p.index.re);
        self.densest() / all.fold(self.background.re, f64::min)
    }

    /// The polygons, later ones over earlier ones, as validated.
    pub fn polygons(&self) -> &[Polygon] {
        &self.polygons
    }

    /// The cross-section at depth `z` (clamped to 0 ≤ z < depth): segments in fractions of the
    /// period that cover 0 to 1 exactly, in order, neighbours of equal index merged.
    pub fn layer_at(&self, z: f64) -> Vec<Segment> {
        let z = z.clamp(0.0, self.depth.next_down());
        layer::cut(self, z)
    }

    /// Plan that cuts the relief into about `count` slices.
    pub fn slice_plan(&self, count: usize) -> SlicePlan {
        SlicePlan::new(self, count)
    }

    /// The layers of a plan made by [`Relief::slice_plan`] of this relief, from top to bottom.
    pub fn layers(&self, plan: &SlicePlan) -> Vec<Layer> {
        plan.slices()
            .map(|(z, thickness)| Layer { thickness, segments: self.layer_at(z) })
            .collect()
    }

    /// About `count` layers from top to bottom: [`Relief::layers`] of [`Relief::slice_plan`].
    /// For the same cut twice as fine use [`SlicePlan::refined`].
    pub fn slices(&self, count: usize) -> Vec<Layer> {
        self.layers(&self.slice_plan(count))
    }
}

/// Checks that `got` is the index n + ik of a passive material: finite, n ≥ 0, k ≥ 0, not 0.
///
/// # Errors
/// [`ReliefError::Index`] naming `what` it belongs to.
pub fn check_index(what: impl FnOnce() -> String, got: Complex64) -> Result<(), ReliefError> {
    let passive = got.is_finite() && got.re >= 0.0 && got.im >= 0.0;
    if passive && got != Complex64::ZERO {
        Ok(())
    } else {
        Err(ReliefError::Index { what: what(), got })
    }
}

/// True of the index of a medium without loss that is no metal.
pub(crate) fn is_dielectric(index: Complex64) -> bool {
    index.im == 0.0 && index.re > 0.0
}

fn check_length(what: &'static str, got: f64) -> Result<(), ReliefError> {
    if got.is_finite() && got > 0.0 { Ok(()) } else { Err(ReliefError::Length { what, got }) }
}

fn valid_polygon(
    polygon: usize,
    Polygon { index, mut points }: Polygon,
    period: f64,
    depth: f64,
) -> Result<Polygon, ReliefError> {
    check_index(|| format!("polygon {}", polygon + 1), index)?;
    for (point, p) in points.iter_mut().enumerate() {
        if !(p[0].is_finite() && p[1].is_finite()) {
            return Err(ReliefError::Coordinate { polygon, point, got: *p });
        }
        let slack = DEPTH_TOLERANCE * depth;
        if p[1] < -slack || p[1] > depth + slack {
            return Err(ReliefError::OutsideDepth { polygon, point, depth, z: p[1] });
        }
        p[1] = p[1].clamp(0.0, depth);
    }
    points.dedup();
    while points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    if points.len() < 3 {
        return Err(ReliefError::TooFewPoints { polygon, got: points.len() });
    }
    let (left, right) = geometry::extent(points.iter().map(|p| p[0]));
    if right - left > WIDEST * period * (1.0 + SAME_PLACE) {
        return Err(ReliefError::TooWide { polygon, limit: WIDEST * period, got: right - left });
    }
    if let Some((first, second)) = geometry::self_crossing(&points) {
        return Err(ReliefError::SelfCrossing { polygon, first, second });
    }
    Ok(Polygon { index: index + Complex64::ZERO, points })
}
