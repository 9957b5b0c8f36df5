// SPDX-License-Identifier: MIT OR Apache-2.0
//! Axis-aligned bounding boxes.

use glam::DVec3;

use super::Reach;

/// A box between two corners, mm; infinite where what it bounds is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The lowest corner.
    pub low: DVec3,
    /// The highest corner.
    pub high: DVec3,
}

impl Bounds {
    /// The box of nothing: the neutral element of [`Bounds::union`].
    pub const EMPTY: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// The box around points.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Self {
        let add =
            |all: Self, point: DVec3| Self { low: all.low.min(point), high: all.high.max(point) };
        points.into_iter().fold(Self::EMPTY, add)
    }

    /// The box around two boxes.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// The box around all boxes.
    pub fn union_of(boxes: impl IntoIterator<Item = Self>) -> Self {
        boxes.into_iter().fold(Self::EMPTY, Self::union)
    }

    /// The same box at another place.
    #[must_use]
    pub fn moved(self, by: DVec3) -> Self {
        Self { low: self.low + by, high: self.high + by }
    }

    /// The box, larger by `slack` mm on every side.
    #[must_use]
    pub fn padded(self, slack: f64) -> Self {
        Self { low: self.low - slack, high: self.high + slack }
    }

    /// The middle of a finite box.
    pub fn middle(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// Lengths along the axes.
    pub fn size(&self) -> DVec3 {
        self.high - self.low
    }

    /// Largest coordinate by absolute value.
    pub fn farthest(&self) -> f64 {
        self.low.abs().max(self.high.abs()).max_element()
    }

    /// The eight corners; bit k of the number tells low or high along axis k.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|number| {
            let pick = |axis: usize| [self.low, self.high][number >> axis & 1][axis];
            DVec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// True if all coordinates are finite.
    pub fn is_finite(&self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    /// True if the boxes share a point; touching counts.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && self.high.cmpge(other.low).all()
    }

    /// Distance at which a ray enters the box, negative if it starts inside; `None` if the part of
    /// the box within `reach` is empty. `inverse` holds the reciprocals of its direction.
    #[inline]
    pub(crate) fn entry(&self, origin: DVec3, inverse: DVec3, reach: Reach) -> Option<f64> {
        self.span(origin, inverse, reach).map(|[entry, _]| entry)
    }

    /// Distances at which a ray enters and leaves the box, as [`Self::entry`].
    #[inline]
    pub(crate) fn span(&self, origin: DVec3, inverse: DVec3, reach: Reach) -> Option<[f64; 2]> {
        let (a, b) = ((self.low - origin) * inverse, (self.high - origin) * inverse);
        // f64::min and max drop the NaN of a ray that runs within a face.
        let entry = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z));
        let exit = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z));
        (entry <= exit && exit > reach.from && entry < reach.to).then_some([entry, exit])
    }
}
