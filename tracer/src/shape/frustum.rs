// SPDX-License-Identifier: MIT OR Apache-2.0
//! Turned segments: one straight segment of a meridian turned about the z axis, a disc, annulus,
//! cylinder or cone frustum.
//!
//! On the segment n_r r + n_z z = k, with (n_r, n_z) its unit normal. Along the ray r² = A t² + 2 B
//! t + C and z = o_z + t d_z. Squaring n_r r = k - n_z z = G + H t gives
//!
//! (A n_r² - H²) t² + 2 (B n_r² - G H) t + (C n_r² - G²) = 0,
//!
//! together with n_r (G + H t) ≥ 0, which excludes the mirror nappe. Half the derivative of the
//! left side at the two roots is ±√discriminant and has the sign of n_r d·n. So the wanted crossing
//! direction picks the root, and no normal is needed to know the side.
//!
//! A ray steeper than the segment (A n_r² < H²) meets each nappe once, the wanted one always in the
//! sense of n_z d_z. At the tip, where both roots coincide, rounding therefore does not decide.

use bsdf::Side;
use glam::DVec3;

use super::{Bounds, Intersection, RELATIVE_PAD, Reach, Sides};
use crate::error::{Error, check, finite};
use crate::ray::Ray;

/// n_r² below which the two nappes are so near to each other that squaring costs digits.
const SHALLOW: f64 = 1e-2;
/// |n_z| below which the height where an upright ray meets a steep segment is uncertain by a part
/// of the padding, so that more is needed.
const GRAZED: f64 = 1e-3;
/// Share of the square from which the discriminant is subtracted, below which it is mostly
/// rounding.
const UNSURE: f64 = 1e-12;

/// Coefficients of a ray that all segments share: r² = a t² + 2 b t + c at height z + dz t.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axial {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub z: f64,
    pub dz: f64,
}

impl Axial {
    #[inline]
    pub(crate) fn new(ray: &Ray) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        Self {
            a: d.x * d.x + d.y * d.y,
            b: o.x * d.x + o.y * d.y,
            c: o.x * o.x + o.y * o.y,
            z: o.z,
            dz: d.z,
        }
    }

    /// Squared distance from the axis at `t`.
    #[inline]
    pub(crate) fn r2(&self, t: f64) -> f64 {
        (self.a * t + 2.0 * self.b) * t + self.c
    }

    #[inline]
    pub(crate) fn z(&self, t: f64) -> f64 {
        self.z + t * self.dz
    }
}

/// The root (-b + s)/a of a t² + 2 b t + c = 0, with s² = b² - a c, computed as c/(-b - s) where
/// the numerator cancels.
#[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
#[inline(always)]
pub(crate) fn quadratic_root([a, b, c]: [f64; 3], s: f64) -> f64 {
    let cancels = b * s > 0.0;
    (if cancels { c } else { s - b }) / (if cancels { -b - s } else { a })
}

/// A turned segment. Its zone along the meridian is measured by the coordinate in which it is
/// longer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frustum {
    nr: f64,
    nz: f64,
    k: f64,
    by_height: bool,
    /// Bounds of the zone, padded: heights, or signed squares of radii. There is none where it ends
    /// on the axis: beyond lies nothing, or the mirror nappe.
    low: f64,
    high: f64,
    start: [f64; 2],
    end: [f64; 2],
}

impl Frustum {
    /// The segment from `start` to `end`, both [r, z] in mm. n lies to the left of its way (r to
    /// the right, z up).
    pub fn new(start: [f64; 2], end: [f64; 2]) -> Result<Self, Error> {
        for [r, z] in [start, end] {
            check("radius of a meridian point, mm", r, "a finite number, 0 or more", r >= 0.0)?;
            finite("height of a meridian point, mm", z)?;
        }
        let (dr, dz) = (end[0] - start[0], end[1] - start[1]);
        let length = dr.hypot(dz);
        check("length of a meridian segment, mm", length, "a finite number above 0", length > 0.0)?;
        let size = start.iter().chain(&end).fold(0.0, |size: f64, v| size.max(v.abs()));
        let pad = RELATIVE_PAD * size;
        let (nr, nz) = (-dz / length, dr / length);
        let by_height = dz.abs() > dr.abs();
        let axis = usize::from(by_height);
        let pad =
            if by_height && nz != 0.0 { pad * (GRAZED / nz.abs()).clamp(1.0, 100.0) } else { pad };
        let (mut low, mut high) =
            (start[axis].min(end[axis]) - pad, start[axis].max(end[axis]) + pad);
        if !by_height {
            low = low.abs() * low;
            high *= high;
        }
        if nz != 0.0 && start[0].min(end[0]) == 0.0 {
            let tip = if start[0] < end[0] { start } else { end };
            if by_height && tip[1] > start[1].min(end[1]) {
                high = f64::INFINITY;
            } else {
                low = f64::NEG_INFINITY;
            }
        }
        let k = start[0] * nr + start[1] * nz;
        Ok(Self { nr, nz, k, by_height, low, high, start, end })
    }

    #[inline]
    fn in_zone(&self, axial: &Axial, t: f64) -> bool {
        let measure = if self.by_height { axial.z(t) } else { axial.r2(t) };
        measure >= self.low && measure <= self.high
    }

    /// One Newton step on n_r r + n_z z - k = 0.
    fn refined(&self, axial: &Axial, t: f64) -> f64 {
        let r = axial.r2(t).max(0.0).sqrt();
        let off = self.nr * r + self.nz * axial.z(t) - self.k;
        let rate = self.nr * (axial.a * t + axial.b) / r + self.nz * axial.dz;
        let refined = t - off / rate;
        if refined.is_finite() { refined } else { t }
    }

    /// Distance at which the ray crosses from `side`, if it does so within `reach`.
    #[inline]
    pub(super) fn crossing(&self, axial: &Axial, reach: Reach, side: Side) -> Option<f64> {
        // Sign of d·n for a ray that comes from `side`.
        let towards = -side.sign();
        if self.nz == 0.0 {
            // A cylinder: its far root where the ray moves in the sense of n, its near one
            // elsewhere. The near root is at most -b/a: nothing is met there by a ray that moves
            // outwards, unless it starts at its turn, to the slack behind a start.
            let near = towards * self.nr < 0.0;
            if near && axial.b > 0.0 && -axial.b < 2.0 * reach.from * axial.a {
                return None;
            }
            let c = axial.c - self.start[0] * self.start[0];
            let discriminant = axial.b * axial.b - axial.a * c;
            if discriminant <= 0.0 {
                return None;
            }
            let s = discriminant.sqrt() * towards * self.nr;
            let t = quadratic_root([axial.a, axial.b, c], s);
            let z = axial.z(t);
            return (reach.holds(t) && z >= self.low && z <= self.high).then_some(t);
        }
        let t = if self.nr == 0.0 {
            if axial.dz * self.nz * towards <= 0.0 {
                return None;
            }
            (self.k * self.nz - axial.z) / axial.dz
        } else {
            let (nr2, g, h) = (self.nr * self.nr, self.k - self.nz * axial.z, -self.nz * axial.dz);
            let a = axial.a * nr2 - h * h;
            let b = axial.b * nr2 - g * h;
            let c = axial.c * nr2 - g * g;
            let square = b * b;
            let discriminant = square - a * c;
            if discriminant <= UNSURE * square {
                if a < 0.0 {
                    let t = self.near_tip(axial, [a, b, c], towards)?;
                    return (reach.holds(t) && self.in_zone(axial, t)).then_some(t);
                }
                if discriminant <= 0.0 {
                    return None;
                }
            }
            let s = discriminant.sqrt() * towards * self.nr.signum();
            let t = quadratic_root([a, b, c], s);
            if (g + h * t) * self.nr < 0.0 {
                return None;
            }
            if nr2 < SHALLOW { self.refined(axial, t) } else { t }
        };
        (reach.holds(t) && self.in_zone(axial, t)).then_some(t)
    }

    /// Distance at which a ray steeper than the segment meets it from the side that `towards`
    /// tells, where its two roots nearly coincide.
    #[cold]
    fn near_tip(&self, axial: &Axial, [a, b, c]: [f64; 3], towards: f64) -> Option<f64> {
        if towards * self.nz * axial.dz <= 0.0 {
            return None;
        }
        // n_r² ((A G² - 2 B G H + C H²) - n_r² (A C - B²)): the first term is the squared distance
        // from the axis, times H², at the height of the tip.
        let (g, h) = (self.k - self.nz * axial.z, -self.nz * axial.dz);
        let nr2 = self.nr * self.nr;
        let aside = axial.a * g * g - 2.0 * axial.b * g * h + axial.c * h * h;
        let discriminant = nr2 * (aside - nr2 * (axial.a * axial.c - axial.b * axial.b));
        let s = discriminant.max(0.0).sqrt() * towards * self.nr.signum();
        let t = quadratic_root([a, b, c], s);
        Some(if nr2 < SHALLOW { self.refined(axial, t) } else { t })
    }

    #[inline]
    pub(super) fn intersect(
        &self,
        ray: &Ray,
        mut reach: Reach,
        sides: Sides,
    ) -> Option<Intersection> {
        let axial = Axial::new(ray);
        if self.nr == 0.0 {
            // A plane is met from one side only.
            let side = if axial.dz * self.nz > 0.0 { Side::Inner } else { Side::Outer };
            let distance = (sides.admit(side)).then(|| self.crossing(&axial, reach, side))??;
            return Some(Intersection { distance, primitive: 0, side });
        }
        let mut found = None;
        for side in Side::BOTH {
            if sides.admit(side)
                && let Some(distance) = self.crossing(&axial, reach, side)
            {
                reach.to = distance;
                found = Some(Intersection { distance, primitive: 0, side });
            }
        }
        found
    }

    #[inline]
    pub(super) fn settle(&self, at: DVec3) -> (DVec3, DVec3) {
        let radius = (at.x * at.x + at.y * at.y).sqrt();
        let (cos_phi, sin_phi) =
            if radius > 0.0 { (at.x / radius, at.y / radius) } else { (1.0, 0.0) };
        let normal = DVec3::new(self.nr * cos_phi, self.nr * sin_phi, self.nz);
        let off = self.nr * radius + self.nz * at.z - self.k;
        (at - normal * off, normal)
    }

    /// True if its normal points neither towards the axis nor down.
    pub(super) fn faces_out_and_up(&self) -> bool {
        self.nr >= 0.0 && self.nz >= 0.0
    }

    /// Height and radius, if it is a disc about the axis with n = +z.
    pub(crate) fn disc_facing_up(&self) -> Option<(f64, f64)> {
        (self.nr == 0.0 && self.nz > 0.0 && self.start[0] == 0.0)
            .then_some((self.start[1], self.end[0]))
    }

    /// Radius and the padded heights between which it lies, if it is a cylinder with n away from
    /// the axis.
    pub(crate) fn cylinder_facing_out(&self) -> Option<(f64, [f64; 2])> {
        (self.nz == 0.0 && self.nr > 0.0).then_some((self.start[0], [self.low, self.high]))
    }

    /// n_r, n_z and k of n_r r + n_z z = k.
    pub(crate) fn line(&self) -> [f64; 3] {
        [self.nr, self.nz, self.k]
    }

    /// The same with all coordinates times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Result<Self, Error> {
        let [start, end] = self.ends().map(|end| end.map(|along| factor * along));
        Self::new(start, end)
    }

    /// Both ends, [r, z].
    pub fn ends(&self) -> [[f64; 2]; 2] {
        [self.start, self.end]
    }

    pub(super) fn bounds(&self) -> Bounds {
        let radius = self.start[0].max(self.end[0]);
        Bounds {
            low: DVec3::new(-radius, -radius, self.start[1].min(self.end[1])),
            high: DVec3::new(radius, radius, self.start[1].max(self.end[1])),
        }
    }
}
