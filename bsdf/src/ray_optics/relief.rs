// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray optics in one cell of a relief that repeats in two directions: lenses, pyramids, cones.
//!
//! In: pitch, lattice, shape, base and height. Out: a [`Bsdf`] that traces rays through the cell, as
//! [`super::UnitCell`] does for grooves. The inner medium stands in convex bodies on the plane z = 0,
//! one in the middle of each cell; a relief that is pressed in is the mirror image in z = 0 with the
//! media exchanged. Light inside a body leaves through its surface or down through its base. Light
//! outside meets the body of its cell, the plane, the top, or the border of the cell, where it goes
//! on into the next one. All intersections are closed forms: with q from the axis, spherical caps and
//! cones are quadrics `x² + y² + e (z - z₀)² = s`, and pyramids intersections of half-spaces. A ray
//! that leaves a convex body outwards does not meet it again.

use super::beams::SplitMix64;
use super::crossing::{Carried, Crossing};
use super::{facets_lobe, ray};
use crate::bsdf::{Bsdf, BsdfSample, OutgoingLobe, Polarisation, PolarisedBsdf, s_axis};
use crate::direction::{Side, lattice_point};
use crate::error::Error;
use crate::stokes;
use glam::{DVec2, DVec3};
use rand::RngExt;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

/// Rays that [`Bsdf::lobes`] follows.
const LOBE_RAYS: usize = 4096;

/// Arrangement of the cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReliefLattice {
    /// Squares.
    Square,
    /// Regular hexagons.
    Hexagonal,
}

/// Body in each cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReliefShape {
    /// Spherical cap, at most a half ball.
    Lens,
    /// Pyramid with one face towards each neighbour.
    Pyramid,
    /// Circular cone.
    Cone,
}

/// A relief as plain data. Lengths in one free unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relief {
    /// Arrangement of the cells.
    pub lattice: ReliefLattice,
    /// Body in each cell.
    pub shape: ReliefShape,
    /// Distance of the middles of neighbouring cells.
    pub pitch: f64,
    /// Diameter of the circle or distance of opposite sides at the base.
    pub base: f64,
    /// Height over the plane between the bodies, or depth below it.
    pub height: f64,
    /// True for hollows in the inner medium.
    pub is_pressed_in: bool,
}

/// One cell of a relief, traced by ray optics.
#[derive(Debug)]
pub struct ReliefCell {
    relief: Relief,
    index: [f64; 2],
    /// Directions of the neighbours.
    neighbours: Vec<DVec2>,
    body: Body,
    /// Cosine and sine of the angle from t to x, about the normal.
    turn: DVec2,
    lost: AtomicU64,
}

/// A convex body on the plane z = 0.
#[derive(Debug)]
enum Body {
    /// x² + y² + e (z - z₀)² < s.
    Quadric { e: f64, z0: f64, s: f64 },
    /// n·q < c for each unit normal n.
    Planes(Vec<(DVec3, f64)>),
}

/// A ray in the cell, from the middle of its base.
#[derive(Clone, Copy, Debug)]
struct Ray {
    at: DVec3,
    direction: DVec3,
    /// True in the medium of the body.
    is_inside: bool,
    /// True after it left the body of this cell, which it does not meet again.
    has_left: bool,
}

/// Next event of a ray, at distance `t`.
enum Step {
    /// The surface of the body.
    Body {
        t: f64,
        normal: DVec3,
    },
    /// The plane.
    Plane {
        t: f64,
    },
    /// The border to a neighbour.
    Wrap {
        t: f64,
        to: DVec2,
    },
    Leave,
    Lost,
}

/// What a ray along `direction` meets at a surface of this normal.
struct Meeting {
    direction: DVec3,
    normal: DVec3,
    crossing: Crossing,
}

impl Body {
    /// Body of a relief, with faces towards the neighbours.
    fn new(relief: &Relief, neighbours: &[DVec2]) -> Self {
        let (half, height) = (0.5 * relief.base, relief.height);
        match relief.shape {
            ReliefShape::Lens => {
                let radius = 0.5 * (half * half + height * height) / height;
                Self::Quadric { e: 1.0, z0: height - radius, s: radius * radius }
            }
            ReliefShape::Cone => Self::Quadric { e: -(half / height).powi(2), z0: height, s: 0.0 },
            ReliefShape::Pyramid => {
                let scale = half.hypot(height);
                let plane = |n: &DVec2| ((n * height).extend(half) / scale, half * height / scale);
                Self::Planes(neighbours.iter().map(plane).collect())
            }
        }
    }

    /// True of points of the base.
    fn contains(&self, q: DVec3) -> bool {
        match self {
            Self::Quadric { e, z0, s } => {
                q.truncate().length_squared() + e * (q.z - z0).powi(2) < *s
            }
            Self::Planes(planes) => planes.iter().all(|(n, c)| n.dot(q) < *c),
        }
    }

    /// Where a ray inside meets the surface from within, and the outward normal there.
    fn exit(&self, Ray { at, direction, .. }: &Ray) -> Option<(f64, DVec3)> {
        match self {
            Self::Quadric { e, z0, s } => {
                let [a, b, c] = quadratic(*e, *z0, *s, *at, *direction);
                // The root at which the quadratic rises.
                let root = (b * b - a * c).max(0.0).sqrt();
                let t = if b > 0.0 { (-c / (b + root)).max(0.0) } else { (root - b) / a };
                let normal = gradient(*e, *z0, *at + t * *direction);
                (t.is_finite() && t >= 0.0).then_some((t, normal))
            }
            Self::Planes(planes) => {
                let ahead = planes.iter().filter(|(n, _)| n.dot(*direction) > 0.0);
                let met = ahead.map(|(n, c)| ((c - n.dot(*at)) / n.dot(*direction), *n));
                met.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(t, n)| (t.max(0.0), n))
            }
        }
    }

    /// Where a ray outside meets the surface above the plane, and the outward normal there.
    fn entry(&self, Ray { at, direction, .. }: &Ray, height: f64) -> Option<(f64, DVec3)> {
        let (t, normal) = match self {
            Self::Quadric { e, z0, s } => {
                let [a, b, c] = quadratic(*e, *z0, *s, *at, *direction);
                let square = b * b - a * c;
                if square < 0.0 {
                    return None;
                }
                // The root at which the quadratic falls.
                let t = if b < 0.0 { c / (square.sqrt() - b) } else { -(b + square.sqrt()) / a };
                (t, gradient(*e, *z0, *at + t * *direction))
            }
            Self::Planes(planes) => {
                let mut inwards = (f64::NEG_INFINITY, DVec3::Z);
                let mut outwards = f64::INFINITY;
                for (n, c) in planes {
                    let (along, away) = (n.dot(*direction), n.dot(*at) - c);
                    let t = -away / along;
                    if along < 0.0 && t > inwards.0 {
                        inwards = (t, *n);
                    } else if along > 0.0 {
                        outwards = outwards.min(t);
                    } else if along == 0.0 && away > 0.0 {
                        return None;
                    }
                }
                if inwards.0 > outwards {
                    return None;
                }
                inwards
            }
        };
        let z = at.z + t * direction.z;
        (t > 0.0 && t.is_finite() && z > 0.0 && z <= height * (1.0 + 1e-12)).then_some((t, normal))
    }
}

/// Coefficients of a t² + 2 b t + c, the quadric less s along a ray.
fn quadratic(e: f64, z0: f64, s: f64, at: DVec3, direction: DVec3) -> [f64; 3] {
    let seen = DVec3::new(at.x, at.y, at.z - z0);
    let weighted = DVec3::new(direction.x, direction.y, e * direction.z);
    let own = DVec3::new(seen.x, seen.y, e * seen.z);
    [weighted.dot(direction), weighted.dot(seen), own.dot(seen) - s]
}

/// Outward unit normal of a quadric.
fn gradient(e: f64, z0: f64, at: DVec3) -> DVec3 {
    DVec3::new(at.x, at.y, e * (at.z - z0)).try_normalize().unwrap_or(DVec3::Z)
}

impl Relief {
    fn validate(&self) -> Result<(), Error> {
        Error::check_length("pitch of a relief", self.pitch)?;
        Error::check_length("base of a relief", self.base)?;
        Error::check_length("height of a relief", self.height)?;
        if self.base > self.pitch {
            let (base, pitch) = (self.base, self.pitch);
            return Err(Error::Cell(format!("expected a base of at most {pitch}, got {base}")));
        }
        if self.shape == ReliefShape::Lens && self.height > 0.5 * self.base {
            let (half, height) = (0.5 * self.base, self.height);
            return Err(Error::Cell(format!("expected a cap of at most {half}, got {height}")));
        }
        Ok(())
    }
}

impl ReliefCell {
    /// Cell of a relief between media of these indices, inner and outer; one neighbour lies along t.
    ///
    /// # Errors
    /// If a length or an index is not positive and finite, the base does not fit into the cell, or a
    /// cap is higher than half a ball.
    pub fn new(relief: Relief, [inner, outer]: [f64; 2]) -> Result<Self, Error> {
        relief.validate()?;
        let count = match relief.lattice {
            ReliefLattice::Square => 4,
            ReliefLattice::Hexagonal => 6,
        };
        let angle = |k: i32| DVec2::from_angle(2.0 * PI * f64::from(k) / f64::from(count));
        let neighbours: Vec<DVec2> = (0..count).map(angle).collect();
        Ok(Self {
            body: Body::new(&relief, &neighbours),
            relief,
            index: [
                Error::check_index("inner side of a relief", inner)?,
                Error::check_index("outer side of a relief", outer)?,
            ],
            neighbours,
            turn: DVec2::X,
            lost: AtomicU64::new(0),
        })
    }

    /// The same cell with a neighbour at `angle` (radians) from t towards b.
    #[must_use]
    pub fn turned(mut self, angle: f64) -> Self {
        self.turn = DVec2::from_angle(angle);
        self
    }

    /// Number of rays lost so far, which never leave, expected to be 0. A lost sample is `None`.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// The frame of the surface turned to that of the cell and back, where bodies stand upwards.
    fn to_cell(&self, v: DVec3) -> DVec3 {
        DVec2::new(self.turn.x, -self.turn.y).rotate(v.truncate()).extend(self.upright(v.z))
    }

    fn to_surface(&self, v: DVec3) -> DVec3 {
        self.turn.rotate(v.truncate()).extend(self.upright(v.z))
    }

    fn upright(&self, z: f64) -> f64 {
        if self.relief.is_pressed_in { -z } else { z }
    }

    /// Point of the cell for a point of the unit square, evenly.
    fn place(&self, [u, v]: [f64; 2]) -> DVec2 {
        let [one, other] = [self.neighbours[0], self.neighbours[1]];
        let mut q = self.relief.pitch * ((u - 0.5) * one + (v - 0.5) * other);
        while let Some(n) = self.neighbours.iter().find(|n| q.dot(**n) > 0.5 * self.relief.pitch) {
            q -= self.relief.pitch * n;
        }
        q
    }

    /// Next event of a ray.
    fn step(&self, ray: &Ray) -> Step {
        let Ray { at, direction, .. } = *ray;
        if ray.is_inside {
            if at.z <= 0.0 {
                if direction.z < 0.0 {
                    return Step::Leave;
                }
                if !self.body.contains(at) {
                    return Step::Plane { t: 0.0 };
                }
            }
            let down = if direction.z < 0.0 { -at.z / direction.z } else { f64::INFINITY };
            return match self.body.exit(ray) {
                Some((t, normal)) if t < down => Step::Body { t, normal },
                _ if down.is_finite() => Step::Leave,
                _ => Step::Lost,
            };
        }
        let half = 0.5 * self.relief.pitch;
        let ahead = self.neighbours.iter().map(|n| (n, n.dot(direction.truncate())));
        let borders = ahead.filter(|(_, along)| *along > 0.0);
        let borders = borders.map(|(n, along)| ((half - n.dot(at.truncate())) / along, *n));
        let border = borders.min_by(|(a, _), (b, _)| a.total_cmp(b));
        let wall = border.map_or(f64::INFINITY, |(t, _)| t.max(0.0));
        let level = if direction.z < 0.0 { 0.0 } else { self.relief.height };
        let end = if direction.z == 0.0 { f64::INFINITY } else { (level - at.z) / direction.z };
        let met = if ray.has_left { None } else { self.body.entry(ray, self.relief.height) };
        match (met, border) {
            (Some((t, normal)), _) if t <= end.min(wall) => Step::Body { t, normal },
            (_, Some((_, to))) if wall < end => Step::Wrap { t: wall, to },
            _ if !end.is_finite() => Step::Lost,
            _ if direction.z < 0.0 => Step::Plane { t: end },
            _ => Step::Leave,
        }
    }

    /// The ray after it met a surface, reflected or refracted.
    fn met(
        &self,
        ray: &Ray,
        at: DVec3,
        normal: DVec3,
        mut reflects: impl FnMut(&Meeting) -> bool,
    ) -> Ray {
        let mut media = [self.index[0], self.index[1]];
        if ray.is_inside == self.relief.is_pressed_in {
            media.reverse();
        }
        let [n1, n2] = media;
        let direction = ray.direction;
        let along = direction.dot(normal);
        let tangential = n1 * (direction - along * normal);
        let q2_squared = n2 * n2 - tangential.length_squared();
        let crossing = Crossing { media, across: [n1 * along.abs(), q2_squared] };
        if reflects(&Meeting { direction, normal, crossing }) {
            let direction = (direction - 2.0 * along * normal).normalize();
            return Ray { at, direction, has_left: !ray.is_inside, ..*ray };
        }
        let across = q2_squared.max(0.0).sqrt().copysign(along);
        let direction = (tangential + across * normal).normalize();
        Ray { at, direction, is_inside: !ray.is_inside, has_left: ray.is_inside }
    }

    /// Direction into which a ray leaves that comes from `wi`, in the frame of the cell, at a point
    /// for a point of the unit square. `None` of a ray that is lost.
    fn traced(
        &self,
        wi: DVec3,
        place: [f64; 2],
        mut reflects: impl FnMut(&Meeting) -> bool,
    ) -> Option<DVec3> {
        if wi.z == 0.0 {
            return None;
        }
        let is_inside = wi.z < 0.0;
        let level = if is_inside { 0.0 } else { self.relief.height };
        let at = self.place(place).extend(level);
        let mut ray = Ray { at, direction: -wi, is_inside, has_left: false };
        for _ in 0..ray::MAX_STEPS {
            match self.step(&ray) {
                Step::Body { t, normal } => {
                    let at = ray.at + t * ray.direction;
                    ray = self.met(&ray, at, normal, &mut reflects);
                }
                Step::Plane { t } => {
                    let at = (ray.at + t * ray.direction).with_z(0.0);
                    let ahead = self.met(&ray, at, DVec3::Z, &mut reflects);
                    ray = Ray { has_left: false, ..ahead };
                }
                Step::Wrap { t, to } => {
                    ray.at += t * ray.direction - (self.relief.pitch * to).extend(0.0);
                    ray.has_left = false;
                }
                Step::Leave => return Some(ray.direction),
                Step::Lost => break,
            }
        }
        self.lost.fetch_add(1, Ordering::Relaxed);
        None
    }

    /// One ray that enters from `wi` anywhere.
    fn followed(
        &self,
        wi: DVec3,
        rng: &mut dyn rand::Rng,
        mut reflects: impl FnMut(&Meeting, &mut dyn rand::Rng) -> bool,
    ) -> Option<BsdfSample> {
        let place = [rng.random(), rng.random()];
        let wo = self.traced(self.to_cell(wi), place, |met| reflects(met, rng))?;
        let wo = self.to_surface(wo);
        Some(BsdfSample { wo, weight: 1.0, lobe: facets_lobe(Side::from_direction(wi), wo) })
    }

    /// U and V change their sign in the mirror image.
    fn seen([q, u, v]: [f64; 3], is_image: bool) -> [f64; 3] {
        if is_image { [q, -u, -v] } else { [q, u, v] }
    }
}

impl Bsdf for ReliefCell {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        self.followed(wi, rng, |met, rng| {
            let reflectance = met.crossing.reflectance();
            reflectance >= 1.0 || rng.random::<f64>() < reflectance
        })
    }

    /// Unknown without tracing all rays.
    fn pdf(&self, _wi: DVec3, _sample: &BsdfSample) -> Option<f64> {
        None
    }

    /// A fixed sample of the directions reached, each with the same power: rays at the points of a
    /// lattice, with a fixed sequence of numbers. For any polarisation the powers are those of
    /// unpolarised light.
    fn lobes(&self, wi: DVec3, _polarisation: Polarisation) -> Vec<OutgoingLobe> {
        let from = Side::from_direction(wi);
        let wi = self.to_cell(wi);
        let mut sequence = SplitMix64(0);
        let rays = (0..LOBE_RAYS).filter_map(|k| {
            let place = lattice_point(k, LOBE_RAYS);
            let wo = self.traced(wi, place, |met| sequence.next() < met.crossing.reflectance())?;
            let wo = self.to_surface(wo);
            Some(OutgoingLobe { wo, power: 1.0 / LOBE_RAYS as f64, lobe: facets_lobe(from, wo) })
        });
        rays.collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.index[side.index()]
    }

    /// Rays enter evenly, and go back as they came.
    fn is_reciprocal(&self) -> bool {
        true
    }

    fn as_polarised(&self) -> Option<&dyn PolarisedBsdf> {
        Some(self)
    }
}

impl PolarisedBsdf for ReliefCell {
    fn sample_polarised(
        &self,
        wi: DVec3,
        light: [f64; 3],
        rng: &mut dyn rand::Rng,
    ) -> Option<(BsdfSample, [f64; 3])> {
        let is_image = self.relief.is_pressed_in;
        let s = self.to_cell(s_axis(wi));
        let mut carried = Carried { light: Self::seen(light, is_image), s };
        let sample = self.followed(wi, rng, |met, rng| {
            carried.reflects(met.direction, met.normal, &met.crossing, rng)
        })?;
        let axis = self.to_cell(s_axis(sample.wo));
        let light = stokes::turned(carried.light, self.to_cell(sample.wo), carried.s, axis);
        Some((sample, Self::seen(light, is_image)))
    }
}

#[cfg(test)]
mod tests;
