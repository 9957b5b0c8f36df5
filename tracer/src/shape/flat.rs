// SPDX-License-Identifier: MIT OR Apache-2.0
//! Planes: whole, half, cut to a rectangle, or divided into a rectangle and the rest.

use bsdf::Side;
use bsdf::direction::Frame;
use glam::DVec3;

use super::{Bounds, Intersection, Reach, Sides};
use crate::error::{Error, finite, positive};
use crate::ray::Ray;

/// Part of a plane that belongs to a shape; u and v are the coordinates along its axes, from its
/// point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extent {
    /// All of it. One patch.
    Infinite,
    /// u ≥ 0. One patch.
    Half,
    /// |u| ≤ `half_u`, |v| ≤ `half_v`. One patch.
    Rectangle {
        /// Half the length along u, mm.
        half_u: f64,
        /// Half the length along v, mm.
        half_v: f64,
    },
    /// All of it in two patches: the rectangle, and what lies beyond.
    Split {
        /// Half the length of the rectangle along u, mm.
        half_u: f64,
        /// Half the length of the rectangle along v, mm.
        half_v: f64,
    },
}

/// A plane through a point. For n = +z, u is x and v is y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    point: DVec3,
    frame: Frame,
    extent: Extent,
}

impl Plane {
    /// The plane through `point` (mm) with normal `normal` (any length above 0).
    pub fn new(point: DVec3, normal: DVec3, extent: Extent) -> Result<Self, Error> {
        for value in point.to_array() {
            finite("coordinate of a plane, mm", value)?;
        }
        positive("length of the normal of a plane", normal.length())?;
        if let Extent::Rectangle { half_u, half_v } | Extent::Split { half_u, half_v } = extent {
            positive("half length of a rectangle, mm", half_u)?;
            positive("half length of a rectangle, mm", half_v)?;
        }
        let n = normal.normalize();
        let along = if n.x.abs() > 0.9 { DVec3::Y } else { DVec3::X };
        let frame = Frame::new(n, along).ok_or(Error::Number {
            what: "length of the normal of a plane".to_owned(),
            expected: "a direction",
            got: normal.length(),
        })?;
        Ok(Self { point, frame, extent })
    }

    /// The same with all coordinates times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let mut scaled = *self;
        scaled.point *= factor;
        if let Extent::Rectangle { half_u, half_v } | Extent::Split { half_u, half_v } =
            &mut scaled.extent
        {
            *half_u *= factor;
            *half_v *= factor;
        }
        scaled
    }

    pub(super) fn patches(&self) -> usize {
        if matches!(self.extent, Extent::Split { .. }) { 2 } else { 1 }
    }

    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        let n = self.frame.n;
        let rate = ray.direction.dot(n);
        let side = if rate > 0.0 { Side::Inner } else { Side::Outer };
        if !sides.admit(side) || rate == 0.0 {
            return None;
        }
        let distance = (self.point - ray.origin).dot(n) / rate;
        if !reach.holds(distance) {
            return None;
        }
        let (u, v) = self.coordinates(ray.at(distance));
        let within = |half_u: f64, half_v: f64| u.abs() <= half_u && v.abs() <= half_v;
        let primitive = match self.extent {
            Extent::Infinite => 0,
            Extent::Half if u >= 0.0 => 0,
            Extent::Rectangle { half_u, half_v } if within(half_u, half_v) => 0,
            Extent::Split { half_u, half_v } => u32::from(!within(half_u, half_v)),
            Extent::Half | Extent::Rectangle { .. } => return None,
        };
        Some(Intersection { distance, primitive, side })
    }

    #[inline]
    fn coordinates(&self, at: DVec3) -> (f64, f64) {
        let from = at - self.point;
        (from.dot(self.frame.t), from.dot(self.frame.b))
    }

    #[inline]
    pub(super) fn settle(&self, at: DVec3) -> (DVec3, DVec3) {
        let n = self.frame.n;
        (at - n * (at - self.point).dot(n), n)
    }

    pub(super) fn frame(&self) -> Frame {
        self.frame
    }

    /// The edges of a rectangle, from end to end.
    pub(super) fn edges(&self) -> Vec<[DVec3; 2]> {
        if !matches!(self.extent, Extent::Rectangle { .. }) {
            return Vec::new();
        }
        let around = |c: [DVec3; 4]| (0..4).map(move |k| [c[k], c[(k + 1) % 4]]);
        self.polygons(0.0).into_iter().flat_map(around).collect()
    }

    /// Corners of the polygon of each patch; `reach` (mm, from its point) is as far as planes
    /// without end are followed.
    pub(super) fn polygons(&self, reach: f64) -> Vec<[DVec3; 4]> {
        let polygon = |[low_u, high_u]: [f64; 2], half_v: f64| {
            [(low_u, -half_v), (high_u, -half_v), (high_u, half_v), (low_u, half_v)]
                .map(|(u, v)| self.point + self.frame.t * u + self.frame.b * v)
        };
        match self.extent {
            Extent::Infinite => vec![polygon([-reach, reach], reach)],
            Extent::Half => vec![polygon([0.0, reach], reach)],
            Extent::Rectangle { half_u, half_v } => vec![polygon([-half_u, half_u], half_v)],
            Extent::Split { half_u, half_v } => {
                vec![polygon([-half_u, half_u], half_v), polygon([-reach, reach], reach)]
            }
        }
    }

    pub(super) fn anchor(&self) -> DVec3 {
        self.point
    }

    pub(super) fn bounds(&self) -> Bounds {
        if let Extent::Rectangle { half_u, half_v } = self.extent {
            let reach = self.frame.t.abs() * half_u + self.frame.b.abs() * half_v;
            return Bounds { low: self.point - reach, high: self.point + reach };
        }
        // Only a plane across an axis is bounded at all, and only along that axis.
        let flat = self.frame.n.abs();
        let (mut low, mut high) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
        for axis in 0..3 {
            if flat[axis] >= 1.0 {
                low[axis] = self.point[axis];
                high[axis] = self.point[axis];
            }
        }
        Bounds { low, high }
    }
}
