// SPDX-License-Identifier: MIT OR Apache-2.0
//! Spheres about a point of the z axis, cut by horizontal planes into zones.

use bsdf::Side;
use glam::DVec3;

use super::{Bounds, Intersection, RELATIVE_PAD, Reach, Sides};
use crate::error::{Error, check, finite, positive};
use crate::ray::Ray;
use crate::ray::unit;

/// The zones of a sphere between given heights.
#[derive(Debug, Clone, PartialEq)]
pub struct Sphere {
    centre: DVec3,
    radius: f64,
    per_radius: f64,
    low: f64,
    high: f64,
    /// Lower bounds of all zones but the last, descending.
    cuts: Vec<f64>,
}

/// The chord of a sphere along a ray that begins `from_centre` of it: distance to the middle, and
/// the square of half the length, negative where the ray passes by.
#[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
#[inline(always)]
pub(crate) fn chord([x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3], radius: f64) -> (f64, f64) {
    let nearest = -(x * dx + y * dy + z * dz);
    // From the distance of the centre to the ray: no cancellation far from the sphere.
    let (ax, ay, az) = (x + dx * nearest, y + dy * nearest, z + dz * nearest);
    (nearest, radius * radius - (ax * ax + ay * ay + az * az))
}

impl Sphere {
    /// Zones between the heights `bounds` (mm), from top to bottom: one zone fewer than heights.
    pub fn new(centre_z: f64, radius: f64, bounds: &[f64]) -> Result<Self, Error> {
        finite("height of the centre of a sphere, mm", centre_z)?;
        positive("radius of a sphere, mm", radius)?;
        if bounds.len() < 2 {
            return Err(Error::TooFew {
                what: "heights that bound the zones of a sphere",
                expected: 2,
                got: bounds.len(),
            });
        }
        for &z in bounds {
            check(
                "height of a zone of a sphere, mm",
                z,
                "a height between the poles",
                (z - centre_z).abs() <= radius * (1.0 + 1e-9),
            )?;
        }
        for pair in bounds.windows(2) {
            check(
                "height of a zone of a sphere, mm",
                pair[1],
                "heights that descend",
                pair[1] < pair[0],
            )?;
        }
        let pad = RELATIVE_PAD * (radius + centre_z.abs());
        Ok(Self {
            centre: DVec3::new(0.0, 0.0, centre_z),
            radius,
            per_radius: 1.0 / radius,
            low: bounds[bounds.len() - 1] - pad,
            high: bounds[0] + pad,
            cuts: bounds[1..bounds.len() - 1].to_vec(),
        })
    }

    /// The same with all coordinates times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            centre: factor * self.centre,
            radius: factor * self.radius,
            per_radius: 1.0 / (factor * self.radius),
            low: factor * self.low,
            high: factor * self.high,
            cuts: self.cuts.iter().map(|cut| factor * cut).collect(),
        }
    }

    pub(super) fn patches(&self) -> usize {
        self.cuts.len() + 1
    }

    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        // A ray comes in through the outer side first, then goes out through the inner one.
        let from_centre = (ray.origin - self.centre).to_array();
        let (nearest, half_chord2) = chord(from_centre, ray.direction.to_array(), self.radius);
        if nearest <= reach.from && sides == Sides::Outer {
            // It recedes: the place where it came in lies behind.
            return None;
        }
        if half_chord2 < 0.0 {
            return None;
        }
        let half_chord = half_chord2.sqrt();
        let at = |distance: f64, side: Side| {
            let z = ray.origin.z + distance * ray.direction.z;
            (reach.holds(distance) && z >= self.low && z <= self.high).then(|| Intersection {
                distance,
                primitive: self.cuts.partition_point(|&cut| z < cut) as u32,
                side,
            })
        };
        match sides {
            Sides::Outer => at(nearest - half_chord, Side::Outer),
            Sides::Inner => at(nearest + half_chord, Side::Inner),
            Sides::Both => at(nearest - half_chord, Side::Outer)
                .or_else(|| at(nearest + half_chord, Side::Inner)),
        }
    }

    #[inline]
    pub(super) fn settle(&self, at: DVec3) -> (DVec3, DVec3) {
        let normal = unit((at - self.centre) * self.per_radius);
        (self.centre + normal * self.radius, normal)
    }

    /// True if it reaches from pole to pole.
    pub(super) fn whole(&self) -> bool {
        self.low <= self.centre.z - self.radius && self.high >= self.centre.z + self.radius
    }

    /// Height of the centre, radius and the padded lowest and highest height.
    pub(crate) fn ball(&self) -> (f64, f64, [f64; 2]) {
        (self.centre.z, self.radius, [self.low, self.high])
    }

    /// Lower bounds of all zones but the last, descending.
    pub(crate) fn cuts(&self) -> &[f64] {
        &self.cuts
    }

    pub(super) fn bounds(&self) -> Bounds {
        let radius_at =
            |z: f64| (self.radius * self.radius - (z - self.centre.z).powi(2)).max(0.0).sqrt();
        let equator = self.low <= self.centre.z && self.high >= self.centre.z;
        let wide =
            if equator { self.radius } else { radius_at(self.low).max(radius_at(self.high)) };
        Bounds { low: DVec3::new(-wide, -wide, self.low), high: DVec3::new(wide, wide, self.high) }
    }
}
