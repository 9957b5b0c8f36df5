// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light on its way through films that have no ends: the walker of [`crate::path`] where the next
//! surface is known, the face above or the face below.
//!
//! Regions are counted upwards, the space below as 0, the first film as 1, the gap over it as 2; face
//! k lies between region k and region k + 1.

use bsdf::Side;
use glam::DVec3;

use super::part::{Course, Exit, FilmOutcome};
use crate::ledger::Loss;
use crate::optics::fresnel::refract;
use crate::optics::polarisation::Light;
use crate::path::{Flight, Tracer};
use crate::random::PathStream;
use crate::ray::Ray;
use crate::receiver::{PathHistory, Tally};
use crate::scatter::scatter;
use crate::scene::{CompiledMedium, CompiledPatch, CompiledSurface, Hit, Scene};
use crate::surface::SurfaceModel;

/// Components of a direction that differ by less are equal.
pub(super) const SAME: f64 = 1e-9;
/// Faces of a box, by primitive and patch.
const BOTTOM: (u32, u32) = (4, 2);
const TOP: (u32, u32) = (5, 1);

/// A film at one wavelength.
struct Layer<'a> {
    surface: &'a CompiledSurface,
    medium: &'a CompiledMedium,
}

/// The films of a stack at one wavelength.
pub(super) struct Layers<'a> {
    films: Vec<Layer<'a>>,
    air: &'a CompiledMedium,
    /// Heights of all faces, mm.
    faces: Vec<f64>,
}

/// Light between two faces.
#[derive(Clone, Copy)]
struct Traveller {
    at: DVec3,
    direction: DVec3,
    region: usize,
    weight: f64,
    scatterings: u32,
    wavelength: u16,
    history: PathHistory,
    reach2: f64,
}

impl<'a> Layers<'a> {
    /// The films of a scene that has nothing else.
    pub fn new(scene: &'a Scene) -> Self {
        let body = &scene.bodies[0];
        let mut films: Vec<Layer<'_>> = body
            .surfaces
            .iter()
            .zip(&body.media)
            .map(|(surface, medium)| Layer { surface, medium })
            .collect();
        let ends = |film: &Layer<'_>| {
            let bounds = film.surface.shape.bounds();
            [bounds.low.z, bounds.high.z]
        };
        films.sort_by(|a, b| ends(a)[0].total_cmp(&ends(b)[0]));
        let faces = films.iter().flat_map(ends).collect();
        Self { films, air: &scene.world, faces }
    }

    /// Refractive indices before and behind the lowest face, or the highest one for light that falls,
    /// where that is smooth and level without layers.
    pub fn smooth_outer_face(&self, falls: bool) -> Option<[f64; 2]> {
        let (film, (_, patch)) =
            if falls { (self.films.last()?, TOP) } else { (self.films.first()?, BOTTOM) };
        let optics = &film.surface.patches[patch as usize].optics;
        let [inner, outer] = film.surface.indices;
        matches!(optics, SurfaceModel::Interface).then_some([outer, inner])
    }

    /// Number of gaps between films.
    pub fn gaps(&self) -> usize {
        self.films.len() - 1
    }

    fn medium(&self, region: usize) -> &'a CompiledMedium {
        if region % 2 == 1 { self.films[region / 2].medium } else { self.air }
    }
}

/// Films at all wavelengths, with what books light on its way through them.
pub(super) struct LayerWalk<'s, 't, 'a> {
    pub layers: &'s [Layers<'a>],
    pub tracers: &'s [Tracer<'a>],
    pub tallies: &'s mut [Tally<'t>],
    /// Light that passed each gap upwards and downwards, at each wavelength.
    pub passed: &'s mut [Vec<[f64; 2]>],
    /// Wavelengths that light has had, each once.
    pub had: Vec<u16>,
}

impl LayerWalk<'_, '_, '_> {
    /// Follows a ray of weight 1 that meets the stack at x = y = 0 until it leaves or ends, and is not
    /// reflected by an outer face that is smooth, if its light is unpolarised; returns how far from
    /// there it has been, mm, too.
    pub fn follow<L: Light>(
        &mut self,
        direction: DVec3,
        wavelength: u16,
        light: &mut L,
        rng: &mut PathStream,
    ) -> (FilmOutcome, f64) {
        let faces = self.layers[0].faces.len();
        let falls = direction.z < 0.0;
        let (mut face, region) = if falls { (faces - 1, faces) } else { (0, 0) };
        let mut ray = Traveller {
            at: DVec3::ZERO,
            direction,
            region,
            weight: 1.0,
            scatterings: 0,
            wavelength,
            history: PathHistory::new(0),
            reach2: 0.0,
        };
        let mut has_entered = !L::CARRIED && self.enter(&mut ray, face, rng);
        let is_out = loop {
            if !std::mem::take(&mut has_entered) && self.meet(&mut ray, face, light, rng).is_none()
            {
                break false;
            }
            if ray.region == 0 || ray.region == faces {
                break true;
            }
            match self.travel(&mut ray, light, rng) {
                Some(next) => face = next,
                None => break false,
            }
        };
        let off = |sign: f64| {
            let mirrored = direction * DVec3::new(1.0, 1.0, sign);
            (ray.direction - mirrored).abs().max_element()
        };
        let place = ray.at.truncate();
        // Facets may restore a direction and move light aside.
        let aside = place.perp_dot(direction.truncate()).abs();
        let is_straight = aside <= SAME * (1.0 + place.length());
        let course = match is_out {
            false => Course::Ended,
            true if is_straight && off(1.0) < SAME => Course::Through,
            true if is_straight && off(-1.0) < SAME => Course::Mirrored,
            true => Course::Turned,
        };
        let sin = direction.truncate().length();
        let exit = Exit { direction: ray.direction, place, sin };
        let weight = if is_out { ray.weight } else { 0.0 };
        let mut outcome = FilmOutcome::new(&exit, weight, ray.wavelength, course);
        (outcome.bounces, outcome.line) = (ray.history.bounces, ray.history.line);
        (outcome, ray.reach2.max(place.length_squared()).sqrt())
    }

    /// Takes light across an outer face, if that is smooth.
    fn enter(&mut self, ray: &mut Traveller, face: usize, rng: &mut PathStream) -> bool {
        let number = usize::from(ray.wavelength);
        let layers = &self.layers[number];
        let falls = ray.direction.z < 0.0;
        let indices = layers.smooth_outer_face(falls);
        let towards = if falls { DVec3::Z } else { DVec3::NEG_Z };
        let refracted = indices.and_then(|[n1, n2]| refract(ray.direction, towards, n1, n2));
        let Some((_, direction)) = refracted else { return false };
        let patch = if falls { TOP.1 } else { BOTTOM.1 } as usize;
        let line = layers.films[face / 2].surface.patches[patch].line;
        let (tracer, tally) = (&self.tracers[number], &mut self.tallies[number]);
        let sides = [Side::Outer, Side::Inner];
        tracer.settle(line, sides, 1.0, &mut ray.weight, rng, tally);
        ray.history.bounces += 1;
        ray.history.line = line as u32;
        ray.direction = direction;
        ray.region = if falls { face } else { face + 1 };
        true
    }

    /// Takes light across or back from a face; `None` where it ends.
    #[inline]
    fn meet<L: Light>(
        &mut self,
        ray: &mut Traveller,
        face: usize,
        light: &mut L,
        rng: &mut PathStream,
    ) -> Option<()> {
        let number = usize::from(ray.wavelength);
        let (layers, tracer) = (&self.layers[number], &self.tracers[number]);
        let tally = &mut self.tallies[number];
        if ray.history.bounces >= tracer.max_bounces {
            tally.lose(Loss::Bounces, ray.weight);
            return None;
        }
        let surface = layers.films[face / 2].surface;
        let ((primitive, patch), normal) =
            if face.is_multiple_of(2) { (BOTTOM, DVec3::NEG_Z) } else { (TOP, DVec3::Z) };
        let side = if ray.direction.z * normal.z < 0.0 { Side::Outer } else { Side::Inner };
        let CompiledPatch { optics, line } = &surface.patches[patch as usize];
        let hit = Hit { distance: 0.0, surface, primitive, side, instance: Some(0) };
        let event = scatter(&hit, optics, ray.direction, ray.at, normal, light, rng);
        let sides = [side, event.side];
        tracer.settle(*line, sides, event.efficiency, &mut ray.weight, rng, tally);
        ray.history.bounces += 1;
        ray.history.line = *line as u32;
        if ray.weight == 0.0 {
            return None;
        }
        if !event.sound(normal) {
            tally.lose(Loss::Invalid, ray.weight);
            return None;
        }
        ray.direction = event.direction;
        let is_above = (face % 2 == 1) == (event.side == Side::Outer);
        ray.region = face + usize::from(is_above);
        Some(())
    }

    /// Takes light to the next face; `None` where it ends on the way.
    #[inline]
    fn travel<L: Light>(
        &mut self,
        ray: &mut Traveller,
        light: &mut L,
        rng: &mut PathStream,
    ) -> Option<usize> {
        loop {
            let number = usize::from(ray.wavelength);
            let (layers, tracer) = (&self.layers[number], &self.tracers[number]);
            let tally = &mut self.tallies[number];
            let medium = layers.medium(ray.region);
            let rises = ray.direction.z > 0.0;
            let face = if rises { ray.region } else { ray.region - 1 };
            let length = (layers.faces[face] - ray.at.z) / ray.direction.z;
            if !length.is_finite() {
                tally.lose(Loss::Leak, ray.weight);
                return None;
            }
            if let Some(collisions) = &medium.collisions {
                let flight = Ray { origin: ray.at, direction: ray.direction };
                let power = (&mut ray.weight, &mut ray.scatterings);
                let turned =
                    match tracer.fly(medium, collisions, (&flight, length), power, rng, tally) {
                        Flight::Free => None,
                        Flight::Absorbed(_) | Flight::Lost => return None,
                        Flight::Scattered(turned) => Some(turned),
                        Flight::Converted(turned, wavelength) => {
                            ray.wavelength = wavelength;
                            if !self.had.contains(&wavelength) {
                                self.had.push(wavelength);
                            }
                            Some(turned)
                        }
                    };
                if let Some(Ray { origin, direction }) = turned {
                    light.depolarise();
                    (ray.at, ray.direction) = (origin, direction);
                    ray.reach2 = ray.reach2.max(origin.truncate().length_squared());
                    continue;
                }
            }
            if medium.absorption > 0.0 {
                let transmittance = (-medium.absorption * length).exp();
                tracer.transmit(medium.line, transmittance, &mut ray.weight, rng, tally);
                if ray.weight == 0.0 {
                    return None;
                }
            }
            if ray.region.is_multiple_of(2) {
                self.passed[number][ray.region / 2 - 1][usize::from(!rises)] += ray.weight;
            }
            ray.at += ray.direction * length;
            ray.at.z = layers.faces[face];
            ray.reach2 = ray.reach2.max(ray.at.truncate().length_squared());
            return Some(face);
        }
    }
}
