// SPDX-License-Identifier: MIT OR Apache-2.0
//! Flat facets of shapes in the plane of a rectangle: which of them share area with it.

use glam::DVec3;

use super::faces::shared_polygon;
use super::{Bounds, Cuboid, Frustum, Shape};

/// Corners of the polygon that stands for a circle.
const CORNERS: usize = 96;

/// A flat face.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Facet {
    /// A convex polygon.
    Polygon(Vec<DVec3>),
    /// A disc without its middle, or a whole one where `inner` is 0.
    Ring {
        /// Middle.
        centre: DVec3,
        /// Unit vector at right angles to it.
        normal: DVec3,
        /// Radius of the middle that is missing, mm.
        inner: f64,
        /// Radius, mm.
        outer: f64,
    },
}

impl Facet {
    /// Its outer edge, circles by chords.
    fn polygon(&self) -> Vec<DVec3> {
        match self {
            Self::Polygon(corners) => corners.clone(),
            Self::Ring { centre, normal, outer, .. } => {
                let (u, v) = normal.any_orthonormal_pair();
                let corner = |k: usize| {
                    let (sin, cos) = (std::f64::consts::TAU * k as f64 / CORNERS as f64).sin_cos();
                    *centre + (u * cos + v * sin) * *outer
                };
                (0..CORNERS).map(corner).collect()
            }
        }
    }

    /// The same, moved.
    pub fn moved(mut self, by: DVec3) -> Self {
        match &mut self {
            Self::Polygon(corners) => corners.iter_mut().for_each(|corner| *corner += by),
            Self::Ring { centre, .. } => *centre += by,
        }
        self
    }

    /// The hole in its middle holds all of a polygon in its plane.
    fn leaves_out(&self, polygon: &[DVec3]) -> bool {
        match self {
            Self::Polygon(_) => false,
            Self::Ring { centre, inner, .. } => {
                polygon.iter().all(|corner| corner.distance(*centre) <= *inner)
            }
        }
    }

    /// True if both lie in one plane, to `within` (mm), and share more than an edge.
    pub fn shares(&self, other: &Self, within: f64) -> bool {
        let [own, others] = [self.polygon(), other.polygon()];
        let normal = match self {
            Self::Polygon(_) => (own[1] - own[0]).cross(own[2] - own[0]).normalize_or_zero(),
            Self::Ring { normal, .. } => *normal,
        };
        if others.iter().any(|corner| (*corner - own[0]).dot(normal).abs() > within) {
            return false;
        }
        let shared = shared_polygon(&own, &others, normal);
        let size = Bounds::of_points(shared.iter().copied()).size().length();
        let doubled = (2..shared.len())
            .map(|k| (shared[k - 1] - shared[0]).cross(shared[k] - shared[0]).dot(normal));
        doubled.sum::<f64>().abs() > 2.0 * within * size
            && !self.leaves_out(&shared)
            && !other.leaves_out(&shared)
    }
}

/// A rectangle across an axis, compared with the facets in its plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window {
    pub bounds: Bounds,
    /// Number of the axis along its normal.
    pub axis: usize,
    /// Tolerance, mm: distance along that axis within which points are in the plane, and depth by
    /// which overlapping areas reach into each other.
    pub within: f64,
}

impl Window {
    /// The same, seen from a frame whose origin is at `position`.
    pub fn from(&self, position: DVec3) -> Self {
        Self { bounds: self.bounds.moved(-position), ..*self }
    }

    /// True if a point lies in its plane.
    pub fn level(&self, at: DVec3) -> bool {
        (at[self.axis] - self.bounds.low[self.axis]).abs() <= self.within
    }

    /// True if a point lies in it.
    pub fn holds(&self, at: DVec3) -> bool {
        let point = Bounds { low: at, high: at };
        self.level(at) && self.meets(&point)
    }

    /// True if a box touches it.
    pub fn meets(&self, other: &Bounds) -> bool {
        other.overlaps(&self.bounds.padded(self.within))
    }

    /// The axes along it.
    fn along(&self) -> [usize; 2] {
        [(self.axis + 1) % 3, (self.axis + 2) % 3]
    }

    /// True if a facet lies in its plane and they share more than an edge.
    pub fn overlaps(&self, facet: &Facet) -> bool {
        match facet {
            Facet::Polygon(corners) => {
                corners.iter().all(|corner| self.level(*corner)) && self.shares(corners)
            }
            Facet::Ring { centre, normal, inner, outer } => {
                let tilt = (1.0 - normal[self.axis].powi(2)).max(0.0).sqrt();
                let [mut nearest, mut farthest] = [0.0f64; 2];
                for axis in self.along() {
                    let Bounds { low, high } = self.bounds.moved(-*centre);
                    let (low, high) = (low[axis], high[axis]);
                    nearest = nearest.hypot(0.0f64.clamp(low, high));
                    farthest = farthest.hypot(low.abs().max(high.abs()));
                }
                self.level(*centre)
                    && tilt * outer <= self.within
                    && nearest < outer - self.within
                    && farthest > inner + self.within
            }
        }
    }

    /// True if a convex polygon in its plane shares area with it, by clipping at all four edges.
    fn shares(&self, corners: &[DVec3]) -> bool {
        let mut left = corners.to_vec();
        for axis in self.along() {
            for (bound, sign) in [(self.bounds.low[axis], 1.0), (self.bounds.high[axis], -1.0)] {
                // Distance within the edge, drawn in.
                let depth = |at: DVec3| sign * (at[axis] - bound) - self.within;
                let mut kept = Vec::with_capacity(left.len() + 1);
                for (k, &to) in left.iter().enumerate() {
                    let from = left[(k + left.len() - 1) % left.len()];
                    let (before, here) = (depth(from), depth(to));
                    if (before > 0.0) != (here > 0.0) {
                        kept.push(from + (to - from) * (before / (before - here)));
                    }
                    if here > 0.0 {
                        kept.push(to);
                    }
                }
                left = kept;
            }
        }
        left.len() > 2
    }
}

impl Shape {
    /// Calls `see` with every facet that may reach into the window and its patch; of infinite
    /// planes with as much as covers the window.
    pub(crate) fn facets(&self, window: &Window, see: &mut dyn FnMut(u32, Facet)) {
        match self {
            Self::Plane(plane) => {
                let ends =
                    [window.bounds.low, window.bounds.high].map(|end| end.distance(plane.anchor()));
                let reach = 2.0 * (ends[0].max(ends[1]) + window.within);
                let polygons = plane.polygons(reach);
                for (patch, corners) in (0..).zip(polygons) {
                    see(patch, Facet::Polygon(corners.to_vec()));
                }
            }
            Self::Frustum(frustum) => see_ring(frustum, 0, see),
            Self::Cuboid(cuboid) => {
                for (primitive, corners) in cuboid.faces() {
                    see(Cuboid::patch(primitive), Facet::Polygon(corners.to_vec()));
                }
            }
            Self::Revolution(revolution) => {
                for (frustum, patch) in revolution.frusta_with_patches() {
                    see_ring(frustum, patch, see);
                }
            }
            Self::Mesh(mesh) => {
                for (corners, patch) in mesh.corners_with_patches() {
                    if window.meets(&Bounds::of_points(corners)) {
                        see(patch, Facet::Polygon(corners.to_vec()));
                    }
                }
            }
            Self::Placed(placed) => placed.facets(see),
            Self::Sphere(_) | Self::Torus(_) => {}
        }
    }
}

/// Calls `see` with the disc or ring of a level segment.
fn see_ring(frustum: &Frustum, patch: u32, see: &mut dyn FnMut(u32, Facet)) {
    let [[r0, z0], [r1, z1]] = frustum.ends();
    if z0.to_bits() == z1.to_bits() {
        let ring = Facet::Ring {
            centre: DVec3::Z * z0,
            normal: DVec3::Z,
            inner: r0.min(r1),
            outer: r0.max(r1),
        };
        see(patch, ring);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Window = Window {
        bounds: Bounds { low: DVec3::new(-1.0, -2.0, 5.0), high: DVec3::new(1.0, 2.0, 5.0) },
        axis: 2,
        within: 1e-9,
    };

    #[test]
    fn polygons_share_area_or_none() {
        let square = |x: f64, y: f64, z: f64, turned: f64, half: f64| {
            let corner = |k: i32| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_2 + turned).sin_cos();
                DVec3::new(x + half * cos, y + half * sin, z)
            };
            Facet::Polygon((0..4).map(corner).collect())
        };
        for (facet, shared) in [
            (square(0.0, 0.0, 5.0, 0.1, 0.5), true),
            (square(0.0, 0.0, 5.0, 0.1, 50.0), true),
            (square(0.0, 0.0, 5.0 + 1e-12, 0.1, 0.5), true),
            (square(0.0, 0.0, 5.0 + 1e-6, 0.1, 0.5), false),
            (square(1.9, 0.0, 5.0, 0.0, 1.0), true),
            // Edge to edge, corner to edge.
            (square(2.0, 0.0, 5.0, 0.0, 1.0), false),
            (square(1.0 + 0.5f64.sqrt(), 0.0, 5.0, std::f64::consts::FRAC_PI_4, 1.0), false),
            // The boxes overlap, the polygons do not.
            (square(1.8, 2.8, 5.0, 0.0, 1.0), false),
        ] {
            assert_eq!(WINDOW.overlaps(&facet), shared, "{facet:?}");
        }
    }

    #[test]
    fn rings_share_area_or_none() {
        let ring = |x: f64, inner: f64, outer: f64| Facet::Ring {
            centre: DVec3::new(x, 0.0, 5.0),
            normal: DVec3::Z,
            inner,
            outer,
        };
        for (facet, shared) in [
            (ring(0.0, 0.0, 0.1), true),
            (ring(3.0, 0.0, 2.1), true),
            (ring(3.0, 0.0, 2.0), false),
            // All of the rectangle in the hole, and a corner beyond it.
            (ring(0.0, 2.3, 9.0), false),
            (ring(0.0, 2.2, 9.0), true),
        ] {
            assert_eq!(WINDOW.overlaps(&facet), shared, "{facet:?}");
        }
        let tilted = Facet::Ring {
            centre: DVec3::Z * 5.0,
            normal: DVec3::new(1e-3, 0.0, 1.0).normalize(),
            inner: 0.0,
            outer: 1.0,
        };
        assert!(!WINDOW.overlaps(&tilted));
    }

    #[test]
    fn facets_in_one_plane_share_area_or_none() {
        let square = |x: f64, z: f64, half: f64| {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            Facet::Polygon(corners.map(|(u, v)| DVec3::new(x + u * half, v * half, z)).to_vec())
        };
        let ring = |x: f64, inner: f64, outer: f64| Facet::Ring {
            centre: DVec3::X * x,
            normal: DVec3::Z,
            inner,
            outer,
        };
        for (a, b, shared) in [
            (square(0.0, 0.0, 1.0), square(1.5, 0.0, 1.0), true),
            (square(0.0, 0.0, 1.0), square(2.0, 0.0, 1.0), false),
            (square(0.0, 0.0, 1.0), square(0.0, 1e-6, 1.0), false),
            (square(0.0, 0.0, 1.0), square(0.0, 1e-12, 0.1), true),
            (ring(0.0, 0.0, 1.0), square(1.9, 0.0, 1.0), true),
            (ring(0.0, 0.0, 1.0), ring(1.9, 0.0, 1.0), true),
            (ring(0.0, 0.0, 1.0), ring(1.5, 0.0, 0.4), false),
            (ring(0.0, 0.9, 1.0), square(0.0, 0.0, 0.5), false),
            (ring(0.0, 0.5, 1.0), square(0.0, 0.0, 0.5), true),
        ] {
            assert_eq!([a.shares(&b, 1e-9), b.shares(&a, 1e-9)], [shared; 2], "{a:?} {b:?}");
        }
    }

    #[test]
    fn shapes_show_their_flat_faces() {
        let count = |shape: &Shape| {
            let mut area = Vec::new();
            shape.facets(&WINDOW, &mut |patch, facet| {
                if WINDOW.overlaps(&facet) {
                    area.push(patch);
                }
            });
            area
        };
        let brick = Shape::cuboid(DVec3::new(-0.5, -0.5, 4.0), DVec3::new(0.5, 0.5, 5.0)).unwrap();
        assert_eq!(count(&brick), [1]);
        assert_eq!(count(&Shape::ground(5.0, 0.5, 0.5).unwrap()), [0, 1]);
        assert_eq!(count(&Shape::horizontal(5.0).unwrap()), [0]);
        assert!(count(&Shape::horizontal(4.9).unwrap()).is_empty());
        assert_eq!(count(&Shape::annulus(5.0, 0.0, 1.0).unwrap()), [0]);
        assert!(count(&Shape::sphere(4.0, 1.0).unwrap()).is_empty());
        let upright = Shape::cylinder(1.0, 4.0, 6.0).unwrap();
        assert!(count(&upright).is_empty());
    }
}
