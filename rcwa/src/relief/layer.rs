// SPDX-License-Identifier: MIT OR Apache-2.0
//! One layer of piecewise constant index, and the horizontal cut through a relief that gives it.

use num_complex::Complex64;

use super::{Relief, ReliefError, SAME_PLACE, check_index, geometry};

/// A stretch of one material along the period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Begin, a fraction of the period.
    pub x0: f64,
    /// End, a fraction of the period.
    pub x1: f64,
    /// Refractive index n + ik.
    pub index: Complex64,
}

impl Segment {
    /// Width as a fraction of the period.
    pub fn width(&self) -> f64 {
        self.x1 - self.x0
    }

    /// Middle, a fraction of the period.
    pub fn middle(&self) -> f64 {
        0.5 * (self.x0 + self.x1)
    }
}

/// A slab whose index depends on x alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Extent along z, in the unit of the period; not negative.
    pub thickness: f64,
    /// The segments of one period, from 0 to 1 without gap or overlap.
    pub segments: Vec<Segment>,
}

impl Layer {
    /// A layer of the given segments; ends that miss each other by less than 1e-12 of the period
    /// are joined, neighbours of equal index merged. A thickness of zero is allowed.
    ///
    /// # Errors
    /// A negative thickness, an impossible index, a gap, an overlap or an empty segment.
    pub fn new(thickness: f64, segments: Vec<Segment>) -> Result<Self, ReliefError> {
        if !(thickness.is_finite() && thickness >= 0.0) {
            return Err(ReliefError::Thickness { got: thickness });
        }
        let mut end = 0.0;
        let mut joined: Vec<Segment> = Vec::with_capacity(segments.len());
        for (i, Segment { x0, x1, index }) in segments.into_iter().enumerate() {
            check_index(|| format!("segment {}", i + 1), index)?;
            if x0.is_nan() || (x0 - end).abs() > SAME_PLACE {
                return Err(ReliefError::Uncovered { segment: i, expected: end, got: x0 });
            }
            if x1.is_nan() || x1 - end <= SAME_PLACE {
                return Err(ReliefError::EmptySegment { segment: i, x0, x1 });
            }
            push_merged(&mut joined, Segment { x0: end, x1, index });
            end = x1;
        }
        match joined.last_mut() {
            Some(last) if (end - 1.0).abs() <= SAME_PLACE => last.x1 = 1.0,
            _ => return Err(ReliefError::OpenEnd { got: end }),
        }
        Ok(Self { thickness, segments: joined })
    }

    /// A layer of one material.
    ///
    /// # Errors
    /// A negative thickness or an impossible index.
    pub fn uniform(thickness: f64, index: Complex64) -> Result<Self, ReliefError> {
        Self::new(thickness, vec![Segment { x0: 0.0, x1: 1.0, index }])
    }

    /// The index if the layer is of one material.
    pub fn uniform_index(&self) -> Option<Complex64> {
        let first = self.segments.first()?.index;
        self.segments.iter().all(|s| s.index == first).then_some(first)
    }

    /// True where every permittivity is real (an index that is real or purely imaginary).
    pub fn is_lossless(&self) -> bool {
        self.segments.iter().all(|s| s.index.re == 0.0 || s.index.im == 0.0)
    }
}

/// The segments of `relief` at depth `z`, 0 ≤ z < depth.
pub(super) fn cut(relief: &Relief, z: f64) -> Vec<Segment> {
    // Pieces of polygons inside [0, 1], in the order in which they are painted.
    let mut painted: Vec<Segment> = Vec::new();
    for polygon in relief.polygons() {
        let crossings = geometry::crossings(&polygon.points, z);
        for pair in crossings.chunks_exact(2) {
            let (x0, x1) = (pair[0] / relief.period(), pair[1] / relief.period());
            let index = polygon.index;
            painted.extend(wrapped(x0, x1).map(|[x0, x1]| Segment { x0, x1, index }));
        }
    }
    let mut borders: Vec<f64> = painted.iter().flat_map(|s| [s.x0, s.x1]).collect();
    borders.push(1.0);

    let mut segments = Vec::new();
    for [x0, x1] in intervals_between(borders) {
        let middle = 0.5 * (x0 + x1);
        let top = painted.iter().rev().find(|s| s.x0 < middle && middle < s.x1);
        let index = top.map_or(relief.background(), |s| s.index);
        push_merged(&mut segments, Segment { x0, x1, index });
    }
    segments
}

/// The stretches from 0 to 1 between `borders`, in order; borders in one place count as one.
pub(super) fn intervals_between(mut borders: Vec<f64>) -> Vec<[f64; 2]> {
    borders.sort_by(f64::total_cmp);
    let mut stretches = Vec::with_capacity(borders.len());
    let mut x0 = 0.0;
    for border in borders {
        if border - x0 <= SAME_PLACE {
            continue;
        }
        let x1 = if 1.0 - border <= SAME_PLACE { 1.0 } else { border };
        stretches.push([x0, x1]);
        x0 = x1;
    }
    stretches
}

/// The parts of [0, 1] that the stretch x0..x1 (in periods, any place) covers when wrapped.
fn wrapped(x0: f64, x1: f64) -> impl Iterator<Item = [f64; 2]> {
    let width = x1 - x0;
    let parts = if width >= 1.0 - SAME_PLACE {
        [Some([0.0, 1.0]), None]
    } else {
        // Both ends by the same whole number, so that a shared corner stays one place.
        let periods = x0.floor();
        let (a, b) = (x0 - periods, x1 - periods);
        if b <= 1.0 { [Some([a, b]), None] } else { [Some([a, 1.0]), Some([0.0, b - 1.0])] }
    };
    parts.into_iter().flatten()
}

/// Appends a segment, or lengthens the last one if it is of the same index.
pub(crate) fn push_merged(segments: &mut Vec<Segment>, next: Segment) {
    match segments.last_mut() {
        Some(last) if last.index == next.index => last.x1 = next.x1,
        _ => segments.push(next),
    }
}
