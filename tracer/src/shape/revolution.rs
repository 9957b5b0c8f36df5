// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bodies of revolution with a fine relief: many segments, few of them tested for each ray.
//!
//! The relief lies in a spherical shell and between two heights, so a ray is first clipped to that
//! shell. Along the rest its distance from the axis falls to a minimum and rises again. Each half
//! therefore passes the radial buckets, which list the segments, in order, and stops in the bucket
//! that holds the nearest hit. A bounding volume hierarchy would test the boxes of the frusta,
//! which overlap all around the axis.

use bsdf::Side;
use glam::DVec3;

use super::frustum::Axial;
use super::shell::Shell;
use super::stairs::Stairs;
use super::{Bounds, Frustum, Intersection, Meridian, Reach, Sides};
use crate::error::Error;
use crate::ray::Ray;

/// Padding of bounding volumes relative to their size: far above rounding, far below any relief.
const SLACK: f64 = 1e-9;

/// A turned meridian with its search structure.
#[derive(Debug, Clone)]
pub struct Revolution {
    frusta: Vec<Frustum>,
    patch_of_frustum: Vec<u32>,
    patches: usize,
    /// The shell in which it lies, with a slack far above rounding.
    shell: Shell,
    low: f64,
    high: f64,
    rim: f64,
    /// Range of the segments that touch each radial bucket.
    buckets: Vec<(u32, u32)>,
    per_bucket: f64,
    /// True if every normal points away from the axis or along it, and up or level: then a ray that
    /// comes nearer to the axis or rises only meets some sides, and stretches of it need no search.
    opening: bool,
    stairs: Option<Stairs>,
}

impl Revolution {
    /// True if its meridian leads from the axis back to the axis.
    pub(super) fn closed(&self) -> bool {
        let ends = [self.frusta[0].ends()[0], self.frusta[self.frusta.len() - 1].ends()[1]];
        ends.iter().all(|[r, _]| *r <= 0.0)
    }

    /// The same with all coordinates times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Result<Self, Error> {
        let patches = self.patch_of_frustum.iter().copied();
        let segments = self.frusta.iter().copied().zip(patches);
        Ok(Self::new(&Meridian::scaled(segments, self.patches, factor)?))
    }

    /// Prepares the search structure.
    pub fn new(meridian: &Meridian) -> Self {
        let frusta: Vec<Frustum> = meridian.frusta().iter().map(|&(frustum, _)| frustum).collect();
        let points = || frusta.iter().flat_map(Frustum::ends);
        let (mut low, mut high, mut rim) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
        for [r, z] in points() {
            (low, high, rim) = (low.min(z), high.max(z), rim.max(r));
        }
        let size = rim.max(high - low);
        let centre_z = fit_centre(points(), high - size);
        let from_centre = |[r, z]: [f64; 2]| r.hypot(z - centre_z);
        let outer = points().map(from_centre).fold(0.0, f64::max);
        let inner = frusta
            .iter()
            .map(|frustum| nearest_to_axis_point(frustum, centre_z))
            .fold(f64::INFINITY, f64::min);

        let count = frusta.len().clamp(1, 1024);
        let width = rim / count as f64;
        let mut buckets = vec![(u32::MAX, 0u32); count];
        for (number, frustum) in frusta.iter().enumerate() {
            let [[r0, _], [r1, _]] = frustum.ends();
            let first = ((r0.min(r1) - SLACK * rim) / width).max(0.0) as usize;
            let last = (((r0.max(r1) + SLACK * rim) / width) as usize).min(count - 1);
            for bucket in &mut buckets[first.min(count - 1)..=last] {
                bucket.0 = bucket.0.min(number as u32);
                bucket.1 = bucket.1.max(number as u32 + 1);
            }
        }
        for bucket in buckets.iter_mut().filter(|bucket| bucket.0 > bucket.1) {
            // A curve that begins away from the axis leaves some empty.
            *bucket = (0, 0);
        }
        Self {
            patch_of_frustum: meridian.frusta().iter().map(|&(_, patch)| patch).collect(),
            patches: meridian.elements(),
            shell: Shell {
                centre_z,
                inner: (inner - SLACK * size).max(0.0),
                outer: outer + SLACK * size,
            },
            low: low - SLACK * size,
            high: high + SLACK * size,
            rim,
            opening: frusta.iter().all(Frustum::faces_out_and_up),
            stairs: Stairs::from_frusta(&frusta),
            frusta,
            buckets,
            per_bucket: 1.0 / width,
        }
    }

    pub(super) fn patches(&self) -> usize {
        self.patches
    }

    #[inline]
    pub(super) fn patch(&self, primitive: u32) -> u32 {
        self.patch_of_frustum[primitive as usize]
    }

    #[inline]
    pub(super) fn settle(&self, at: DVec3, primitive: u32) -> (DVec3, DVec3) {
        self.frusta[primitive as usize].settle(at)
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds {
            low: DVec3::new(-self.rim, -self.rim, self.low),
            high: DVec3::new(self.rim, self.rim, self.high),
        }
    }

    /// The staircase that it is, if it is one.
    pub(crate) fn stairs(&self) -> Option<&Stairs> {
        self.stairs.as_ref()
    }

    /// The shell in which it lies, with a slack far above rounding.
    pub(crate) fn shell(&self) -> Shell {
        self.shell
    }

    /// True if every normal points away from the axis or along it, and up or level.
    pub(crate) fn opening(&self) -> bool {
        self.opening
    }

    /// The segments.
    pub(crate) fn frusta(&self) -> &[Frustum] {
        &self.frusta
    }

    /// Segments with the numbers of their patches.
    pub(super) fn frusta_with_patches(&self) -> impl Iterator<Item = (&Frustum, u32)> {
        self.frusta.iter().zip(self.patch_of_frustum.iter().copied())
    }

    /// The nearest hit of a ray that is known to start on `side` of the whole surface. On a
    /// staircase that is decided by comparisons, without gaps, and a start that lies beyond the
    /// surface by rounding meets it at distance 0.
    #[inline]
    pub fn intersect_from(&self, ray: &Ray, reach: Reach, side: Side) -> Option<Intersection> {
        let Some(stairs) = &self.stairs else {
            let sides = match side {
                Side::Inner => Sides::Inner,
                Side::Outer => Sides::Outer,
            };
            return self.intersect(ray, reach, sides);
        };
        let passage = self.shell.passage(ray.origin.to_array(), ray.direction.to_array());
        let found = match side {
            Side::Inner => stairs.leave_through(&passage, Axial::new(ray)),
            Side::Outer => stairs.enter_through(&passage, Axial::new(ray)),
        };
        let (distance, primitive) = found?;
        reach.holds(distance).then_some(Intersection { distance, primitive, side })
    }

    /// The nearest hit, by clipping and marching.
    pub fn intersect(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        // Clip to the slab between the lowest and the highest point.
        let axial = Axial::new(ray);
        let (mut from, mut to) = (reach.from, reach.to);
        if axial.dz == 0.0 {
            if axial.z < self.low || axial.z > self.high {
                return None;
            }
        } else {
            let (t0, t1) = ((self.low - axial.z) / axial.dz, (self.high - axial.z) / axial.dz);
            from = from.max(t0.min(t1));
            to = to.min(t0.max(t1));
        }

        // Clip to the outer sphere of the shell.
        let line = self.shell.line(ray.origin.to_array(), ray.direction.to_array());
        let whole = line.within(self.shell.outer);
        from = from.max(whole[0]);
        to = to.min(whole[1]);
        if from > to {
            return None;
        }

        // Leave out the empty inner sphere and march through the rest in order.
        let mut march = March { shape: self, axial, reach, sides, found: None };
        let gap = line.within(self.shell.inner);
        march.pass(from, to.min(gap[0]));
        march.pass(from.max(gap[1]), to);
        march.found
    }

    /// The nearest hit by testing every segment: the reference for the march.
    pub fn intersect_all(&self, ray: &Ray, mut reach: Reach, sides: Sides) -> Option<Intersection> {
        let mut found = None;
        for (number, frustum) in self.frusta.iter().enumerate() {
            if let Some(hit) = frustum.intersect(ray, reach, sides) {
                reach.to = hit.distance;
                found = Some(Intersection { primitive: number as u32, ..hit });
            }
        }
        found
    }

    #[inline]
    fn bucket(&self, radius: f64) -> usize {
        ((radius * self.per_bucket) as usize).min(self.buckets.len() - 1)
    }
}

/// Change of the distance from the axis along a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Radially {
    Inward,
    Outward,
}

/// The state of one search.
struct March<'a> {
    shape: &'a Revolution,
    axial: Axial,
    reach: Reach,
    sides: Sides,
    found: Option<Intersection>,
}

impl March<'_> {
    /// Searches the stretch of the ray from `from` to `to`, split where it is nearest to the axis.
    fn pass(&mut self, from: f64, to: f64) {
        if from > to {
            return;
        }
        let turn = -self.axial.b / self.axial.a;
        if turn > from && turn < to {
            self.monotone(from, turn, Radially::Inward);
            self.monotone(turn, to, Radially::Outward);
        } else if turn >= to {
            self.monotone(from, to, Radially::Inward);
        } else {
            self.monotone(from, to, Radially::Outward);
        }
    }

    /// True if no segment can be met along such a stretch, from an allowed side: d·n has one sign
    /// for all of them.
    #[inline]
    fn idle(&self, radially: Radially) -> bool {
        self.shape.opening
            && match radially {
                Radially::Inward => self.axial.dz <= 0.0 && self.sides == Sides::Inner,
                Radially::Outward => self.axial.dz >= 0.0 && self.sides == Sides::Outer,
            }
    }

    /// Searches a stretch along which the distance from the axis only falls or only rises.
    fn monotone(&mut self, from: f64, to: f64, radially: Radially) {
        if from >= self.reach.to || self.idle(radially) {
            return;
        }
        let shape = self.shape;
        let slack = SLACK * shape.rim;
        let start = self.axial.r2(from).max(0.0).sqrt();
        let end = self.axial.r2(to.min(self.reach.to)).max(0.0).sqrt();
        let width = 1.0 / shape.per_bucket;
        let mut tested = (0, 0);
        if radially == Radially::Outward {
            if start > shape.rim + slack {
                return;
            }
            for bucket in shape.bucket((start - slack).max(0.0))..=shape.bucket(end + slack) {
                self.test(shape.buckets[bucket], &mut tested);
                let boundary = (bucket + 1) as f64 * width;
                if self.hit_radius2(to).is_some_and(|r2| r2 <= boundary * boundary) {
                    return;
                }
            }
        } else {
            if end > shape.rim + slack {
                return;
            }
            for bucket in (shape.bucket((end - slack).max(0.0))..=shape.bucket(start + slack)).rev()
            {
                self.test(shape.buckets[bucket], &mut tested);
                let boundary = bucket as f64 * width;
                if self.hit_radius2(to).is_some_and(|r2| r2 >= boundary * boundary) {
                    return;
                }
            }
        }
    }

    /// Squared distance from the axis of the nearest hit so far, if it lies before `to`. One beyond
    /// belongs to a later stretch (a segment is tested all around the axis) and does not end this
    /// one.
    #[inline]
    fn hit_radius2(&self, to: f64) -> Option<f64> {
        self.found.filter(|hit| hit.distance <= to).map(|hit| self.axial.r2(hit.distance))
    }

    /// Tests the segments of a bucket that were not `tested` in the bucket before.
    #[inline]
    fn test(&mut self, (first, last): (u32, u32), tested: &mut (u32, u32)) {
        // Neighbouring buckets share a range, or the ranges go on in the same order.
        let (mut from, mut to) = (first, last);
        if from >= tested.0 && from < tested.1 {
            from = tested.1.min(to);
        } else if to > tested.0 && to <= tested.1 {
            to = tested.0.max(from);
        }
        *tested = (first, last);
        let frusta = &self.shape.frusta[from as usize..to as usize];
        for (number, frustum) in (from..to).zip(frusta) {
            match self.sides {
                Sides::Inner => self.cross(number, frustum, Side::Inner),
                Sides::Outer => self.cross(number, frustum, Side::Outer),
                Sides::Both => {
                    self.cross(number, frustum, Side::Inner);
                    self.cross(number, frustum, Side::Outer);
                }
            }
        }
    }

    #[inline]
    fn cross(&mut self, primitive: u32, frustum: &Frustum, side: Side) {
        if let Some(distance) = frustum.crossing(&self.axial, self.reach, side) {
            self.reach.to = distance;
            self.found = Some(Intersection { distance, primitive, side });
        }
    }
}

/// Height of the centre of the circle about an axis point that fits best: r² + z² = 2 c z + k in
/// least squares.
fn fit_centre(points: impl Iterator<Item = [f64; 2]>, otherwise: f64) -> f64 {
    let (mut n, mut sz, mut sq, mut szz, mut szq) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for [r, z] in points {
        let q = r * r + z * z;
        n += 1.0;
        sz += z;
        sq += q;
        szz += z * z;
        szq += z * q;
    }
    let spread = szz - sz * sz / n;
    let centre = 0.5 * (szq - sz * sq / n) / spread;
    if spread > 0.0 && centre.is_finite() { centre } else { otherwise }
}

/// Smallest distance of a segment from the axis point at height `centre_z`.
fn nearest_to_axis_point(frustum: &Frustum, centre_z: f64) -> f64 {
    let [[r0, z0], [r1, z1]] = frustum.ends();
    let (dr, dz) = (r1 - r0, z1 - z0);
    let s = ((-r0 * dr + (centre_z - z0) * dz) / (dr * dr + dz * dz)).clamp(0.0, 1.0);
    (r0 + s * dr).hypot(z0 + s * dz - centre_z)
}
