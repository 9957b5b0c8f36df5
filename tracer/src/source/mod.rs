// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light sources: where rays start and in which directions.

mod distribution;
pub(crate) mod emission;
mod ray_set;
pub(crate) mod sobol;

pub use distribution::Distribution;
pub use ray_set::{RayRecord, RaySet};

use glam::{DMat3, DVec3};
use rand::Rng;

use std::sync::Arc;

use crate::error::{Error, check, finite, positive};
use crate::random;
use crate::ray::Ray;
use crate::surface::Region;
use sobol::{SobolPoint, concentric};

/// The emitting area about the position of the source. Its normal is that of the source, or points
/// inward for an enclosure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Emitter {
    /// One point.
    Point,
    /// A disc of the given radius, mm.
    Disc {
        /// Radius, mm.
        radius: f64,
    },
    /// A rectangle |u| ≤ `half_x`, |v| ≤ `half_y`, mm; (u, v) are (x, y) where the source faces +z,
    /// else [`Source::axes`].
    Rectangle {
        /// Half its length along x, mm.
        half_x: f64,
        /// Half its length along y, mm.
        half_y: f64,
    },
    /// The inside of a sphere: with Lambertian emission it fills its interior with light of one
    /// radiance from everywhere.
    Enclosure {
        /// Radius, mm.
        radius: f64,
    },
}

/// Angular distribution of the emitted light about the normal of the emitter.
#[derive(Debug, Clone, PartialEq)]
pub enum Emission {
    /// Constant radiance into θ < `half_angle_deg` about the normal; 90 for a full Lambertian
    /// source.
    Lambertian {
        /// Half angle of the cone, above 0 up to 90 degrees.
        half_angle_deg: f64,
    },
    /// The same intensity in all directions.
    Isotropic,
    /// Intensity in proportion to cos^`exponent` of the angle to the normal, within its hemisphere.
    CosinePower {
        /// The exponent, 0 or more; 1 is Lambert's law.
        exponent: f64,
    },
    /// One direction (any length above 0).
    Beam {
        /// Direction of the beam.
        direction: DVec3,
    },
    /// A tabulated intensity, its polar angle from the normal of the emitter, its azimuth from u to
    /// v.
    Table(Arc<Distribution>),
    /// Measured or traced rays, each with its own start about the position of the source; the
    /// emitter is [`Emitter::Point`].
    Rays(Arc<RaySet>),
}

impl Emission {
    /// A full Lambertian source.
    pub const LAMBERTIAN: Self = Self::Lambertian { half_angle_deg: 90.0 };
}

/// A source of light.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Name in error messages.
    pub name: String,
    /// The middle of the emitter, mm, in the frame of its prototype or of the world.
    pub position: DVec3,
    /// The region into which it emits.
    pub region: Region,
    /// The emitting area.
    pub emitter: Emitter,
    /// The angular distribution.
    pub emission: Emission,
    /// Unit normal of the emitter; enclosures, beams and ray sets ignore it.
    pub normal: DVec3,
    /// Unit vector u of its plane, at right angles to the normal, where it is not the one that
    /// follows from the normal ([`Source::axes`]); enclosures, beams and ray sets ignore it.
    pub along: Option<DVec3>,
    /// Power relative to the other sources. A source of weight 0 is dark: no path begins at it, and
    /// the others keep their numbers.
    pub weight: f64,
}

impl Source {
    /// A source of weight 1.
    pub fn new(
        name: &str,
        position: DVec3,
        region: Region,
        emitter: Emitter,
        emission: Emission,
    ) -> Self {
        Self {
            name: name.to_owned(),
            position,
            region,
            emitter,
            emission,
            normal: DVec3::Z,
            along: None,
            weight: 1.0,
        }
    }

    /// The same, facing along `normal`, of any length above 0.
    #[must_use]
    pub fn facing(mut self, normal: DVec3) -> Self {
        self.normal = normal.normalize();
        self
    }

    /// The same, turned about its normal so that its u is `along`, at right angles to the normal
    /// and of any length above 0.
    #[must_use]
    pub fn lying_along(mut self, along: DVec3) -> Self {
        self.along = Some(along.normalize());
        self
    }

    /// The same turned by a rotation about the origin of its frame.
    #[must_use]
    pub fn turned(self, rotation: &DMat3) -> Self {
        let (u, _) = self.axes();
        let emission = match self.emission {
            Emission::Rays(rays) => Emission::Rays(rays.turned(rotation).into()),
            Emission::Beam { direction } => Emission::Beam { direction: *rotation * direction },
            other => other,
        };
        let normal = *rotation * self.normal;
        Self { position: *rotation * self.position, emission, ..self }
            .facing(normal)
            .lying_along(*rotation * u)
    }

    /// The same with all lengths times `factor` about the origin of its frame.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        self.position *= factor;
        match &mut self.emitter {
            Emitter::Point => {}
            Emitter::Disc { radius } | Emitter::Enclosure { radius } => *radius *= factor,
            Emitter::Rectangle { half_x, half_y } => {
                *half_x *= factor;
                *half_y *= factor;
            }
        }
        if let Emission::Rays(rays) = &self.emission {
            self.emission = Emission::Rays(rays.scaled(factor).into());
        }
        self
    }

    /// The same with another weight.
    #[must_use]
    pub fn weighing(mut self, weight: f64) -> Self {
        self.weight = weight;
        self
    }

    /// Unit vectors (u, v) of its plane, (u, v, normal) right-handed. Where [`Source::along`] does
    /// not state u: (x, y) for a source that faces up, (x, -y) for one that faces down, else u
    /// level and v rising.
    pub fn axes(&self) -> (DVec3, DVec3) {
        axes(self.normal, self.along)
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        let name = &self.name;
        for value in self.position.to_array() {
            finite(&format!("position of source '{name}', mm"), value)?;
        }
        check(
            &format!("weight of source '{name}'"),
            self.weight,
            "a finite number, 0 or more",
            self.weight >= 0.0,
        )?;
        check(
            &format!("length of the normal of source '{name}'"),
            self.normal.length(),
            "1",
            (self.normal.length() - 1.0).abs() < 1e-9,
        )?;
        if let Some(along) = self.along {
            let off = (along.length() - 1.0).abs().max(along.dot(self.normal).abs());
            check(
                &format!("deviation of u of source '{name}' from a unit vector in its plane"),
                off,
                "0",
                off < 1e-9,
            )?;
        }
        match self.emitter {
            Emitter::Point => {}
            Emitter::Disc { radius } | Emitter::Enclosure { radius } => {
                positive(&format!("radius of source '{name}', mm"), radius)?;
            }
            Emitter::Rectangle { half_x, half_y } => {
                positive(&format!("half length of source '{name}', mm"), half_x)?;
                positive(&format!("half length of source '{name}', mm"), half_y)?;
            }
        }
        match &self.emission {
            &Emission::Lambertian { half_angle_deg } => {
                check(
                    &format!("half angle of source '{name}', degrees"),
                    half_angle_deg,
                    "a number above 0, at most 90",
                    half_angle_deg > 0.0 && half_angle_deg <= 90.0,
                )?;
            }
            Emission::Isotropic | Emission::Table(_) => {}
            &Emission::CosinePower { exponent } => {
                check(
                    &format!("exponent of source '{name}'"),
                    exponent,
                    "a finite number, 0 or more",
                    exponent >= 0.0,
                )?;
            }
            Emission::Rays(_) => {
                if self.emitter != Emitter::Point {
                    return Err(Error::Format(format!(
                        "source '{name}': expected a point as emitter of a set of rays, which \
                            start where they say"
                    )));
                }
            }
            Emission::Beam { direction } => {
                positive(
                    &format!("length of the direction of source '{name}'"),
                    direction.length(),
                )?;
            }
        }
        Ok(())
    }

    /// Draws a ray; its start is moved by `offset` along the ray's side of the surface that carries
    /// the source.
    #[inline]
    pub fn sample(&self, offset: f64, rng: &mut (impl Rng + ?Sized)) -> Ray {
        self.emit(offset, None, rng)
    }

    /// The ray of a Sobol' point. Ray sets and tabulated directions are sampled by `rng` instead.
    #[inline]
    pub(crate) fn begin(&self, offset: f64, point: &SobolPoint, rng: &mut impl Rng) -> Ray {
        self.emit(offset, Some(point), rng)
    }

    /// A ray of a set, moved to the source; its start is moved by `offset` along it.
    #[inline]
    pub(crate) fn placed(&self, ray: Ray, offset: f64) -> Ray {
        Ray {
            origin: self.position + ray.origin + ray.direction * offset,
            direction: ray.direction,
        }
    }

    /// Position and direction by `point`, or by `rng` where there is none; the position first.
    #[inline]
    fn emit(&self, offset: f64, point: Option<&SobolPoint>, rng: &mut (impl Rng + ?Sized)) -> Ray {
        let along = self.along;
        let (position, projected) = (point.map(|p| p.position), point.map(|p| p.direction));
        let (from_position, normal, along) = match self.emitter {
            Emitter::Point => (DVec3::ZERO, self.normal, along),
            Emitter::Disc { radius } => {
                let (x, y) = on_disc(position, radius, rng);
                let start = turned(self.normal, along, DVec3::new(x, y, 0.0));
                (start, self.normal, along)
            }
            Emitter::Rectangle { half_x, half_y } => {
                let [u, v] = position.unwrap_or_else(|| [random::unit(rng), random::unit(rng)]);
                let (x, y) = (half_x * (2.0 * u - 1.0), half_y * (2.0 * v - 1.0));
                let start = turned(self.normal, along, DVec3::new(x, y, 0.0));
                (start, self.normal, along)
            }
            Emitter::Enclosure { radius } => {
                let outward = random::wrapped(on_disc(position, 1.0, rng));
                (outward * radius, -outward, None)
            }
        };
        let direction = match &self.emission {
            &Emission::Lambertian { half_angle_deg } => {
                let full = half_angle_deg >= 90.0;
                let sin_max = if full { 1.0 } else { half_angle_deg.to_radians().sin() };
                random::about(normal, random::risen(on_disc(projected, sin_max, rng)))
            }
            &Emission::CosinePower { exponent } => {
                // 1 - r² is uniform, and so is cos θ to the power exponent + 1.
                let (x, y) = on_disc(projected, 1.0, rng);
                let r2 = x * x + y * y;
                let cos = (1.0 - r2).max(0.0).powf(1.0 / (exponent + 1.0));
                let stretch = if r2 > 0.0 { ((1.0 - cos * cos) / r2).sqrt() } else { 0.0 };
                random::about(normal, DVec3::new(stretch * x, stretch * y, cos))
            }
            Emission::Isotropic => random::wrapped(on_disc(projected, 1.0, rng)),
            Emission::Beam { direction } => direction.normalize(),
            Emission::Table(table) => turned(normal, along, table.sample(rng)),
            Emission::Rays(rays) => {
                return self.placed(rays.sample(rng), offset);
            }
        };
        let off = normal * (offset * direction.dot(normal).signum());
        Ray { origin: self.position + from_position + off, direction }
    }
}

/// Axes (u, v) of the plane at right angles to a unit vector, see [`Source::axes`].
fn axes(normal: DVec3, along: Option<DVec3>) -> (DVec3, DVec3) {
    let u = along.unwrap_or_else(|| {
        let level = DVec3::Z.cross(normal);
        if level.length_squared() > 1e-20 { level.normalize() } else { DVec3::X }
    });
    (u, normal.cross(u))
}

/// A vector in the frame of (u, v, normal).
#[inline]
fn turned(normal: DVec3, along: Option<DVec3>, local: DVec3) -> DVec3 {
    if normal == DVec3::Z && along.is_none() {
        return local;
    }
    let (u, v) = axes(normal, along);
    u * local.x + v * local.y + normal * local.z
}

/// A point of a disc: the one that a point of the unit square is mapped to, or a random one.
#[inline]
fn on_disc(square: Option<[f64; 2]>, radius: f64, rng: &mut (impl Rng + ?Sized)) -> (f64, f64) {
    let Some(at) = square else {
        return random::disc(rng, radius);
    };
    let (x, y) = concentric(at);
    (radius * x, radius * y)
}
