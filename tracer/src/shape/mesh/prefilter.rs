// SPDX-License-Identifier: MIT OR Apache-2.0
//! Conservative f32 test of which rays of a packet may cross the triangles of a node;
//! [`Triangle::cross`](super::Triangle) then decides in f64.
//!
//! Coordinates are in the units of the hierarchy, in which none exceeds 1. The result holds, for
//! each ray, a bit for each triangle: set for all triangles that the ray crosses and for few
//! others.
//!
//! A ray o + t d passes an edge e that begins at c on the side given by the sign of
//!
//! d · ((c - o) × e) = d · (c × e) + e · (o × d),
//!
//! which is the distance between both times |d × e|. Rounding changes it by less than 40 · 2⁻²⁴ of
//! the length of the edge: the inputs by one part in 2²⁴, o × d by three, the sum of six products
//! by six, and the terms add up to less than 4. A ray is dropped only if it passes on the wrong
//! side by more than three times that.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    clippy::needless_range_loop,
    reason = "a branch or a call within a loop would keep it from being compiled to wide \
        instructions"
)]

use glam::DVec3;

use crate::shape::Sides;

/// Rays that are compared together.
pub(super) const WIDE: usize = 16;
/// Most triangles of the leaves of a node.
pub(super) const PRIMITIVES: usize = 24;

/// Distance by which a ray may pass on the wrong side of an edge, as a fraction of its length.
const SLACK: f64 = 64.0 * f32::EPSILON as f64;

/// More than numbers that are too small for f32 lose.
const TINY: f64 = 1e-30;

/// Triangles whose numbers are found together.
const LANES: usize = 8;

/// A number of each triangle.
type Row<T> = [[T; LANES]; PRIMITIVES / LANES];

/// The triangles of a node as the prefilter sees them.
pub(super) struct Prefilter {
    /// Corners, mm, by corner and axis.
    corners: [[Row<f64>; 3]; 3],
    /// Edges, and their moments c × e, by edge and axis.
    edges: [[Row<f32>; 3]; 3],
    moments: [[Row<f32>; 3]; 3],
    /// A ray may cross if the least of its three numbers is not below this one.
    min: Row<f32>,
    /// Or if the largest is not above this one.
    max: Row<f32>,
}

impl Prefilter {
    pub fn new() -> Self {
        Self {
            corners: [[[[0.0; LANES]; PRIMITIVES / LANES]; 3]; 3],
            edges: [[[[0.0; LANES]; PRIMITIVES / LANES]; 3]; 3],
            moments: [[[[0.0; LANES]; PRIMITIVES / LANES]; 3]; 3],
            min: [[0.0; LANES]; PRIMITIVES / LANES],
            max: [[0.0; LANES]; PRIMITIVES / LANES],
        }
    }

    /// Puts a triangle in its place.
    #[inline(always)]
    pub fn put(&mut self, place: usize, corners: [DVec3; 3]) {
        let (row, k) = (place / LANES, place % LANES);
        for corner in 0..3 {
            let DVec3 { x, y, z } = corners[corner];
            self.corners[corner][0][row][k] = x;
            self.corners[corner][1][row][k] = y;
            self.corners[corner][2][row][k] = z;
        }
    }

    /// Makes the first `count` triangles ready, times `scale`, met from one of `sides`.
    #[inline(always)]
    pub fn ready(&mut self, count: usize, scale: f64, sides: Sides) {
        let (inner, outer) = (sides != Sides::Outer, sides != Sides::Inner);
        for row in 0..count.div_ceil(LANES).min(PRIMITIVES / LANES) {
            for k in 0..LANES {
                let mut longest = 0.0;
                for edge in 0..3 {
                    let (from, to) = (&self.corners[edge], &self.corners[(edge + 1) % 3]);
                    let c =
                        [from[0][row][k] * scale, from[1][row][k] * scale, from[2][row][k] * scale];
                    let e = [
                        to[0][row][k] * scale - c[0],
                        to[1][row][k] * scale - c[1],
                        to[2][row][k] * scale - c[2],
                    ];
                    let length = e[0].abs() + e[1].abs() + e[2].abs();
                    longest = if length > longest { length } else { longest };
                    let moment = [
                        c[1] * e[2] - c[2] * e[1],
                        c[2] * e[0] - c[0] * e[2],
                        c[0] * e[1] - c[1] * e[0],
                    ];
                    for axis in 0..3 {
                        self.edges[edge][axis][row][k] = e[axis] as f32;
                        self.moments[edge][axis][row][k] = moment[axis] as f32;
                    }
                }
                let slack = (SLACK * longest + TINY) as f32;
                self.min[row][k] = if inner { -slack } else { f32::INFINITY };
                self.max[row][k] = if outer { slack } else { f32::NEG_INFINITY };
            }
        }
    }

    /// Bits of the first triangles that the rays of a row may cross, by their directions d and
    /// moments o × d. A triangle stands in the child of the node that its bit in `homes` tells, and
    /// a ray meets the children of its bits in `met`.
    #[inline(always)]
    pub fn pass(
        &self,
        homes: &[u32],
        met: &[u32; WIDE],
        d: &[[f32; WIDE]; 3],
        m: &[[f32; WIDE]; 3],
    ) -> [u32; WIDE] {
        let less = |a: f32, b: f32| if a < b { a } else { b };
        let more = |a: f32, b: f32| if a > b { a } else { b };
        let mut passing = [0; WIDE];
        for (place, home) in homes.iter().enumerate().take(PRIMITIVES) {
            let (row, lane) = (place / LANES, place % LANES);
            let of = |rows: &[[Row<f32>; 3]; 3], edge: usize| {
                let rows = &rows[edge];
                [rows[0][row][lane], rows[1][row][lane], rows[2][row][lane]]
            };
            let edges = [of(&self.edges, 0), of(&self.edges, 1), of(&self.edges, 2)];
            let moments = [of(&self.moments, 0), of(&self.moments, 1), of(&self.moments, 2)];
            let (low, high) = (self.min[row][lane], self.max[row][lane]);
            for k in 0..WIDE {
                let turn = |edge: usize| {
                    let (e, c) = (&edges[edge], &moments[edge]);
                    (d[0][k] * c[0] + d[1][k] * c[1] + d[2][k] * c[2])
                        + (m[0][k] * e[0] + m[1][k] * e[1] + m[2][k] * e[2])
                };
                let (u, v, w) = (turn(0), turn(1), turn(2));
                let (min, max) = (less(u, less(v, w)), more(u, more(v, w)));
                let may = ((min >= low) | (max <= high)) & (met[k] & home != 0);
                passing[k] |= if may { 1 << place } else { 0 };
            }
        }
        passing
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ShearedRay, Triangle, divisor};
    use super::*;
    use crate::random;
    use crate::ray::Ray;
    use crate::shape::Reach;

    /// Slivers and needles among them, and rays through their edges, their corners and beside them.
    #[test]
    fn no_ray_is_dropped_that_crosses_and_few_others_are_kept() {
        let mut rng = random::stream(7, 0);
        let whole = Reach { from: f64::NEG_INFINITY, to: f64::INFINITY };
        let scale = 0.125;
        for sides in [Sides::Inner, Sides::Outer, Sides::Both] {
            let (mut crossing, mut kept, mut all) = (0, 0, 0);
            for number in 0..2_000 {
                let size = 10f64.powi(-(number % 5));
                let a = random::isotropic(&mut rng) * 4.0 * random::unit(&mut rng);
                let b = a + random::isotropic(&mut rng) * size;
                let width = size * 10f64.powi(-(number % 3));
                let c = a + (b - a) * random::unit(&mut rng) + random::isotropic(&mut rng) * width;
                let mut prefilter = Prefilter::new();
                let place = number as usize % PRIMITIVES;
                prefilter.put(place, [a, b, c]);
                prefilter.ready(PRIMITIVES, scale, sides);

                let (mut rays, mut d, mut m) = (Vec::new(), [[0.0; WIDE]; 3], [[0.0; WIDE]; 3]);
                for k in 0..WIDE {
                    let (p, q) = (random::unit(&mut rng), random::unit(&mut rng));
                    let target = match k % 4 {
                        0 => a + (b - a) * p,
                        1 => b,
                        2 => a + (b - a) * (p * q) + (c - a) * (p * (1.0 - q)),
                        _ => a + random::isotropic(&mut rng) * size,
                    };
                    let origin = random::isotropic(&mut rng) * 4.0;
                    let direction = (target - origin).normalize();
                    let o = (origin * scale).as_vec3();
                    let e = direction.to_array().map(divisor);
                    let o_d = o.cross(glam::Vec3::from_array(e)).to_array();
                    for axis in 0..3 {
                        d[axis][k] = e[axis];
                        m[axis][k] = o_d[axis];
                    }
                    rays.push(Ray { origin, direction });
                }
                let homes = [4; PRIMITIVES];
                let passing = prefilter.pass(&homes, &[4 | 1; WIDE], &d, &m);
                assert_eq!(prefilter.pass(&homes, &[8 | 1; WIDE], &d, &m), [0; WIDE]);
                let triangle = Triangle { corners: [a, b, c], normal: (b - a).cross(c - a) };
                for (k, (ray, passing)) in rays.iter().zip(passing).enumerate() {
                    let crosses = triangle.cross(&ShearedRay::new(ray), whole, sides).is_some();
                    let passes = passing >> place & 1 != 0;
                    assert!(passes || !crosses, "{triangle:?} {ray:?}");
                    // Smaller ones are as narrow as the slack.
                    if k % 4 == 3 && size >= 0.1 {
                        crossing += usize::from(crosses);
                        kept += usize::from(passes);
                        all += 1;
                    }
                }
            }
            assert!(
                crossing > 10 && kept < crossing + all / 30,
                "{sides:?}: {crossing} {kept} of {all}"
            );
        }
    }
}
