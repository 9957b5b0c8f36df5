// SPDX-License-Identifier: MIT OR Apache-2.0
//! Domes of several surfaces of revolution: the strips of a generating curve of lines and arcs.
//!
//! Along a ray r² = a t² + 2 b t + c. A strip lies between two heights and two radii, so the ray is
//! first clipped to the heights; where r stays outside of the radii on what is left, the strip is
//! not tested. At the hit the strip is replaced by the cone that touches it, whose line n_r r + n_z
//! z = k the kernels take as of any relief.

use super::lanes::Lanes;
use crate::ray::Ray;
use crate::scene::CompiledSurface;
use crate::shape::{Bounds, Frustum, Intersection, Reach, Shape, Sides};

/// Slack of the bounds of a strip, as a share of the size of the dome: far above rounding.
const SLACK: f64 = 1e-6;

/// A surface of the dome with its bounds.
struct Strip<'a> {
    surface: &'a CompiledSurface,
    /// Number of its first primitive among those of the batch.
    first: u32,
    heights: [f64; 2],
    /// Squared least and largest radius.
    squares: [f64; 2],
}

/// The surfaces of a dome.
pub(super) struct Strips<'a>(Vec<Strip<'a>>);

/// Number of primitives of a surface of revolution; `None` of other shapes.
pub(super) fn primitives(shape: &Shape) -> Option<u32> {
    match shape {
        Shape::Torus(_) | Shape::Frustum(_) => Some(1),
        Shape::Sphere(sphere) => Some(sphere.cuts().len() as u32 + 1),
        Shape::Revolution(relief) => Some(relief.frusta().len() as u32),
        _ => None,
    }
}

/// Least and largest distance of a surface from the axis.
fn radii(shape: &Shape) -> [f64; 2] {
    let max = shape.bounds().high.x;
    let min = match shape {
        Shape::Torus(arc) => arc.min_radius(),
        Shape::Frustum(frustum) => frustum.ends().map(|[r, _]| r).into_iter().fold(max, f64::min),
        Shape::Revolution(relief) => {
            relief.frusta().iter().flat_map(Frustum::ends).map(|[r, _]| r).fold(max, f64::min)
        }
        _ => 0.0,
    };
    [min, max]
}

impl<'a> Strips<'a> {
    /// Strips of `surfaces`, whose primitives are numbered one after the other.
    pub fn new(surfaces: &[&'a CompiledSurface]) -> Option<Self> {
        let bounds = surfaces.iter().map(|surface| surface.shape.bounds());
        let size = bounds.fold(0.0, |size: f64, Bounds { low, high }| {
            size.max(high.x).max(high.z.abs()).max(low.z.abs())
        });
        let slack = SLACK * size;
        let mut first = 0;
        let mut strips = Vec::new();
        for &surface in surfaces {
            let Bounds { low, high } = surface.shape.bounds();
            let [min, max] = radii(&surface.shape);
            strips.push(Strip {
                surface,
                first,
                heights: [low.z - slack, high.z + slack],
                squares: [(min - slack).max(0.0), max + slack].map(|r| r * r),
            });
            first += primitives(&surface.shape)?;
        }
        Some(Self(strips))
    }

    /// Finds where the ray of a lane meets the dome.
    pub fn search(&self, lanes: &mut Lanes, lane: usize, mut reach: Reach) {
        let ray = lanes.ray(lane);
        let sides = if lanes.inside[lane].is_set() { Sides::Inner } else { Sides::Outer };
        let clip = Clip::new(&ray);
        let mut found: Option<(&Strip, Intersection)> = None;
        for strip in &self.0 {
            if !clip.may_meet(strip, reach) {
                continue;
            }
            if let Some(hit) = strip.surface.shape.intersect(&ray, reach, sides) {
                reach.to = hit.distance;
                found = Some((strip, hit));
            }
        }
        lanes.dome[lane] = f64::INFINITY;
        if let Some((strip, hit)) = found {
            lanes.dome[lane] = hit.distance;
            lanes.dome_primitive[lane] = i64::from(strip.first + hit.primitive);
            let (point, normal) = strip.surface.shape.settle(ray.at(hit.distance), hit.primitive);
            let radius = point.x.hypot(point.y);
            let radial = if radius > 0.0 {
                (normal.x * point.x + normal.y * point.y) / radius
            } else {
                normal.x
            };
            let line = [radial, normal.z, radial * radius + normal.z * point.z];
            for (all, number) in lanes.dome_line.iter_mut().zip(line) {
                all[lane] = number;
            }
        }
    }
}

/// A ray as the bounds of strips see it.
struct Clip {
    height: f64,
    per_dz: f64,
    a: f64,
    b: f64,
    c: f64,
    /// Distance at which the ray is nearest to the axis.
    turn: f64,
}

impl Clip {
    fn new(ray: &Ray) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        let (a, b) = (d.x * d.x + d.y * d.y, o.x * d.x + o.y * d.y);
        Self { height: o.z, per_dz: d.z.recip(), a, b, c: o.x * o.x + o.y * o.y, turn: -b / a }
    }

    #[inline]
    fn square(&self, t: f64) -> f64 {
        (self.a * t + 2.0 * self.b) * t + self.c
    }

    /// True if the ray passes through the bounds of a strip.
    #[inline]
    fn may_meet(&self, strip: &Strip, reach: Reach) -> bool {
        let ends = strip.heights.map(|z| (z - self.height) * self.per_dz);
        // The numbers of a level ray at the very height of a bound are dropped.
        let from = reach.from.max(ends[0].min(ends[1]));
        let to = reach.to.min(ends[0].max(ends[1]));
        if from >= to {
            return false;
        }
        let (first, last) = (self.square(from), self.square(to));
        let min = if self.turn > from && self.turn < to {
            self.square(self.turn)
        } else {
            first.min(last)
        };
        first.max(last) >= strip.squares[0] && min <= strip.squares[1]
    }
}
