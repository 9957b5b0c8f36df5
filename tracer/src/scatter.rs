// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a surface does to one ray: the direction, the side and the share of the power with which it goes on.

use bsdf::{Side, Transport};
use glam::DVec3;
use rand::Rng;

use crate::fresnel::{Refraction, reflect, refract};
use crate::random;
use crate::scene::Hit;
use crate::surface::Optics;

/// How a ray goes on.
pub(crate) struct Onward {
    /// Unit direction.
    pub direction: DVec3,
    /// The side on which it goes on; told by the surface, not by the direction, which grazes at times.
    pub side: Side,
    /// Share of its power that goes on; the rest is absorbed.
    pub share: f64,
}

impl Onward {
    /// Whether the direction is finite and points to the side it claims, rounding aside.
    #[inline]
    pub fn sound(&self, normal: DVec3) -> bool {
        self.direction.dot(normal) * self.side.sign() > -1e-9
    }
}

/// Draws how a ray along `direction` goes on from `hit`, at `point` with unit `normal` n.
#[inline]
pub(crate) fn scatter(
    hit: &Hit<'_>,
    optics: &Optics,
    direction: DVec3,
    point: DVec3,
    normal: DVec3,
    rng: &mut impl Rng,
) -> Onward {
    let facing = normal * hit.side.sign();
    let back = |direction: DVec3, share: f64| Onward {
        direction,
        side: hit.side,
        share,
    };
    match optics {
        Optics::Interface => {
            let (n1, n2) = (
                hit.surface.index(hit.side),
                hit.surface.index(hit.side.opposite()),
            );
            match refract(direction, facing, n1, n2) {
                Refraction::Partial {
                    reflectance,
                    refracted,
                } if random::unit(rng) >= reflectance => Onward {
                    direction: refracted,
                    side: hit.side.opposite(),
                    share: 1.0,
                },
                Refraction::Partial { .. } | Refraction::Total => {
                    back(reflect(direction, facing), 1.0)
                }
            }
        }
        Optics::Mirror { reflectance } => back(reflect(direction, facing), *reflectance),
        Optics::Lambertian { reflectance } => back(
            random::about(facing, random::cosine(rng, 1.0)),
            *reflectance,
        ),
        Optics::Absorber => back(direction, 0.0),
        Optics::Coating(table) => {
            let frame = hit.surface.shape.frame(point, normal);
            let mut wi = frame.to_local(-direction);
            wi.z = wi.z.abs();
            match table.sample(wi, rng) {
                Some(sample) if sample.lobe.transport == Transport::Reflection => {
                    let mut wo = sample.wo;
                    wo.z *= hit.side.sign();
                    back(frame.to_world(wo).normalize(), sample.weight)
                }
                _ => back(direction, 0.0),
            }
        }
        Optics::Scatter(table) => {
            let frame = hit.surface.shape.frame(point, normal);
            let Some(sample) = table.sample(frame.to_local(-direction), rng) else {
                return back(direction, 0.0);
            };
            let side = match sample.lobe.transport {
                Transport::Reflection => hit.side,
                Transport::Transmission => hit.side.opposite(),
            };
            Onward {
                direction: frame.to_world(sample.wo).normalize(),
                side,
                share: sample.weight,
            }
        }
    }
}
