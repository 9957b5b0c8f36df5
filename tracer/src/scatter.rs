// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scattering of one ray by a surface: the direction, the side and the efficiency with which it
//! goes on.

use bsdf::direction::Frame;
use bsdf::{BsdfSample, PolarisedBsdf, Side, Transport, s_axis};
use glam::DVec3;
use num_complex::Complex64;
use rand::Rng;

use crate::optics::fresnel::{Fresnel, reflect, refract};
use crate::optics::polarisation::Light;
use crate::optics::thin_film::{End, Film};
use crate::random;
use crate::scene::Hit;
use crate::surface::{LayeredMirror, Mixed, SurfaceModel};

/// Continuation of a ray.
pub(crate) struct ScatterEvent {
    /// Unit direction.
    pub direction: DVec3,
    /// The side on which it goes on; told by the surface, not by the direction, which grazes at
    /// times.
    pub side: Side,
    /// Fraction of its power that goes on; the rest is absorbed.
    pub efficiency: f64,
}

impl ScatterEvent {
    /// True if the direction is finite and points to the side it claims, rounding aside.
    #[inline]
    pub fn sound(&self, normal: DVec3) -> bool {
        self.direction.dot(normal) * self.side.sign() > -1e-9
    }
}

/// Draws how a ray along `direction` goes on from `hit`, at `point` with unit `normal` n.
#[expect(
    clippy::inline_always,
    reason = "one copy of the loop over a path for each kind of light and observer: left alone, \
        the compiler calls it, a tenth slower"
)]
#[inline(always)]
pub(crate) fn scatter<L: Light>(
    hit: &Hit<'_>,
    optics: &SurfaceModel,
    direction: DVec3,
    point: DVec3,
    normal: DVec3,
    light: &mut L,
    rng: &mut impl Rng,
) -> ScatterEvent {
    let facing = normal * hit.side.sign();
    let back =
        |direction: DVec3, efficiency: f64| ScatterEvent { direction, side: hit.side, efficiency };
    match optics {
        SurfaceModel::Interface if L::CARRIED => {
            through(hit, &Film::bare(), direction, facing, light, rng)
        }
        SurfaceModel::Layered(film) => through(hit, film, direction, facing, light, rng),
        SurfaceModel::Interface => {
            let (n1, n2) = indices(hit);
            let fresnel = Fresnel::new(-direction.dot(facing), n1, n2);
            if fresnel.total || fresnel.reflects(random::unit(rng)) {
                return back(reflect(direction, facing), 1.0);
            }
            ScatterEvent {
                direction: fresnel.refracted(direction, facing),
                side: hit.side.opposite(),
                efficiency: 1.0,
            }
        }
        SurfaceModel::Mirror { reflectance } => {
            if L::CARRIED {
                light.meet(direction, facing);
                light.pass(PERFECT);
            }
            back(reflect(direction, facing), *reflectance)
        }
        SurfaceModel::LayeredMirror(mirror) => {
            let efficiency = mirrored(hit, mirror, direction, facing, light);
            back(reflect(direction, facing), efficiency)
        }
        SurfaceModel::Lambertian { reflectance } => {
            light.depolarise();
            back(random::about(facing, random::cosine(rng, 1.0)), *reflectance)
        }
        SurfaceModel::Mixed(mixed) => {
            back(mixed_direction(*mixed, direction, facing, light, rng), mixed.reflectance)
        }
        // A path goes round before it is scattered, and finds what is printed where it is.
        SurfaceModel::Absorber | SurfaceModel::Periodic | SurfaceModel::Printed(_) => {
            back(direction, 0.0)
        }
        SurfaceModel::Coating(table) => {
            light.depolarise();
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
        SurfaceModel::Scatter(table) => {
            if L::CARRIED
                && let Some(table) = table.as_polarised()
            {
                return polarised(hit, table, direction, (point, normal), light, rng)
                    .unwrap_or_else(|| back(direction, 0.0));
            }
            light.depolarise();
            let frame = hit.surface.shape.frame(point, normal);
            let Some(sample) = table.sample(frame.to_local(-direction), rng) else {
                return back(direction, 0.0);
            };
            sampled(hit, &frame, &sample)
        }
    }
}

/// Draws which part of a mixed reflector sends the light back, and where to.
#[inline(never)]
fn mixed_direction<L: Light>(
    mixed: Mixed,
    direction: DVec3,
    facing: DVec3,
    light: &mut L,
    rng: &mut impl Rng,
) -> DVec3 {
    if random::unit(rng) < mixed.specular {
        if L::CARRIED {
            light.meet(direction, facing);
            light.pass(PERFECT);
        }
        reflect(direction, facing)
    } else {
        light.depolarise();
        random::about(facing, random::cosine(rng, 1.0))
    }
}

/// Draws from a table that knows what becomes of polarisation; `None` where it absorbs.
#[inline(never)]
fn polarised<L: Light>(
    hit: &Hit<'_>,
    table: &dyn PolarisedBsdf,
    direction: DVec3,
    (point, normal): (DVec3, DVec3),
    light: &mut L,
    rng: &mut impl Rng,
) -> Option<ScatterEvent> {
    let frame = hit.surface.shape.frame(point, normal);
    let wi = frame.to_local(-direction);
    let before = light.stokes().turned(direction, frame.to_world(s_axis(wi)));
    let (sample, after) = table.sample_polarised(wi, [before.q, before.u, before.v], rng)?;
    light.become_light(after, frame.to_world(s_axis(sample.wo)));
    Some(sampled(hit, &frame, &sample))
}

/// Light that goes on as a table has it.
#[inline]
fn sampled(hit: &Hit<'_>, frame: &Frame, sample: &BsdfSample) -> ScatterEvent {
    ScatterEvent {
        direction: frame.to_world(sample.wo).normalize(),
        side: match sample.lobe.transport {
            Transport::Reflection => hit.side,
            Transport::Transmission => hit.side.opposite(),
        },
        efficiency: sample.weight,
    }
}

/// Refractive indices of the side from which light comes and of the other.
fn indices(hit: &Hit<'_>) -> (f64, f64) {
    (hit.surface.index(hit.side), hit.surface.index(hit.side.opposite()))
}

/// Amplitudes of a perfect mirror for E_s and E_p.
const PERFECT: [Complex64; 2] = [Complex64::new(-1.0, 0.0), Complex64::new(1.0, 0.0)];

/// Sums of both parts this near to 1 are of a film that absorbs nothing.
const WHOLE: f64 = 1e-12;

/// Share that a mirror of films keeps.
#[inline(never)]
fn mirrored<L: Light>(
    hit: &Hit<'_>,
    mirror: &LayeredMirror,
    direction: DVec3,
    facing: DVec3,
    light: &mut L,
) -> f64 {
    let cos_theta = -direction.dot(facing);
    let index = hit.surface.index(hit.side);
    let met = mirror.film.amplitudes(End::First, index, mirror.substrate, cos_theta);
    light.meet(direction, facing);
    (mirror.factor * light.pass(met.reflected)).min(1.0)
}

/// Draws between reflection and transmission at a film; the efficiency lacks what it absorbs.
#[inline(never)]
fn through<L: Light>(
    hit: &Hit<'_>,
    film: &Film,
    direction: DVec3,
    facing: DVec3,
    light: &mut L,
    rng: &mut impl Rng,
) -> ScatterEvent {
    let (n1, n2) = indices(hit);
    let end = match hit.side {
        Side::Inner => End::First,
        Side::Outer => End::Last,
    };
    let amplitudes = film.amplitudes(end, n1, n2.into(), -direction.dot(facing));
    let q = light.meet(direction, facing);
    let of = |[s, p]: [f64; 2]| 0.5 * (s * (1.0 + q) + p * (1.0 - q));
    let reflected = of(amplitudes.reflectances());
    let whole = reflected + of(amplitudes.transmittances());
    let efficiency = if (whole - 1.0).abs() < WHOLE { 1.0 } else { whole.min(1.0) };
    if random::unit(rng) * whole >= reflected
        && let Some((_, refracted)) = refract(direction, facing, n1, n2)
    {
        light.pass(amplitudes.transmitted);
        return ScatterEvent { direction: refracted, side: hit.side.opposite(), efficiency };
    }
    light.pass(amplitudes.reflected);
    ScatterEvent { direction: reflect(direction, facing), side: hit.side, efficiency }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::polarisation::Stokes;

    /// Light that goes on as from a mirror keeps its degree of polarisation, with the signs of U
    /// and V turned; the rest has none.
    #[test]
    fn a_mixed_reflector_depolarises_its_diffuse_part_alone() {
        let mut rng = random::stream(11, 0);
        let (direction, normal) = (DVec3::new(0.6, 0.0, -0.8), DVec3::Z);
        let mixed = Mixed { reflectance: 0.9, specular: 0.3 };
        let before = Stokes { q: 0.5, u: 0.5, v: 0.5f64.sqrt(), s: DVec3::Y };
        let (mut mirrored, draws) = (0u32, 40_000);
        for _ in 0..draws {
            let mut light = before;
            let event = mixed_direction(mixed, direction, normal, &mut light, &mut rng);
            if (event - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12 {
                mirrored += 1;
                let after = light.turned(event, DVec3::Y);
                assert!((after.q - before.q).abs() < 1e-14);
                assert!((after.u + before.u).abs() < 1e-14);
                assert!((after.v + before.v).abs() < 1e-14);
            } else {
                assert!(event.z > 0.0 && light.degree() == 0.0);
            }
        }
        let expected = mixed.specular * f64::from(draws);
        let deviation = (f64::from(mirrored) - expected) / (expected * 0.7).sqrt();
        assert!(deviation.abs() < 4.0, "{deviation}");
    }
}
