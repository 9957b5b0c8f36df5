// SPDX-License-Identifier: MIT OR Apache-2.0
//! The walker: follows one path from its source to its end.
//!
//! [`Tracer::walk_to`] is the algorithm: intersect, transmit, show to the receivers, scatter, go on.
//! The batches take the same steps.

use bsdf::Side;
use glam::DVec3;
use rand::Rng;

use crate::ledger::{Booking, Loss};
use crate::observer::{Fate, Interaction, Observer};
use crate::optics::luminescence::{Collision, Collisions, Luminophore};
use crate::optics::phase::PhaseFunction;
use crate::optics::polarisation::{Light, Polarisation, Unpolarised};
use crate::random;
use crate::ray::Ray;
use crate::receiver::{PathHistory, Receiver, Receivers, Tally};
use crate::scatter::{ScatterEvent, scatter};
use crate::scene::{Candidates, CompiledMedium, CompiledPatch, Hit, Location, PlacedSource, Scene};
use crate::settings::{Sampling, Settings};
use crate::surface::Region;

/// Times that media may scatter a path for each surface that it may meet.
const SCATTERINGS_PER_BOUNCE: u32 = 100;

/// Constants of all paths of a run.
pub(crate) struct Tracer<'a> {
    pub scene: &'a Scene,
    pub receivers: Receivers<'a>,
    pub max_bounces: u32,
    /// Times that media may scatter a path before it is given up.
    pub max_scatterings: u32,
    roulette_below: f64,
    pub polarisation: Polarisation,
    pub sampling: Sampling,
    /// Wavelengths of the run in nm, where light may go from one to another.
    pub wavelengths: &'a [f64],
    /// The number of its own among them.
    pub wavelength: u16,
}

/// A ray in the middle of its path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PathState {
    pub ray: Ray,
    pub location: Location,
    /// An instance that it cannot meet before something else.
    pub left: Option<u32>,
    /// The only instance that it can meet, where packages do not see each other.
    pub own: Option<u32>,
    pub weight: f64,
    /// Times that media have scattered or converted it.
    pub scatterings: u32,
    /// Number of its wavelength; another than that of the tracer where it ends by conversion.
    pub wavelength: u16,
    pub history: PathHistory,
}

/// End of a flight in a medium that scatters or converts light.
pub(crate) enum Flight {
    /// It reaches the surface ahead.
    Free,
    /// The medium scatters the light.
    Scattered(Ray),
    /// The medium emits it anew at the wavelength of this number.
    Converted(Ray, u16),
    /// The medium has absorbed it, on a flight of this length, mm.
    Absorbed(f64),
    /// It is given up.
    Lost,
}

/// End of the flights in a medium that scatters or converts light.
enum Wandered<'a> {
    /// The path comes to what is ahead.
    On(PathState, Option<Hit<'a>>),
    /// It goes on at another wavelength.
    Elsewhere(PathState),
    Ended,
}

/// Point where a ray has met a surface.
#[derive(Clone, Copy)]
struct Impact<'a> {
    hit: Hit<'a>,
    patch: &'a CompiledPatch,
    /// On the surface, in the frame of its body.
    point: DVec3,
    /// The unit normal n there.
    normal: DVec3,
}

impl<'a> Tracer<'a> {
    pub fn new(scene: &'a Scene, receivers: &[&'a dyn Receiver], settings: &Settings) -> Self {
        Self {
            scene,
            receivers: Receivers::new(scene, receivers),
            max_bounces: settings.max_bounces,
            max_scatterings: settings.max_bounces.saturating_mul(SCATTERINGS_PER_BOUNCE),
            roulette_below: settings.roulette_below,
            polarisation: settings.polarisation,
            sampling: settings.sampling,
            wavelengths: &[],
            wavelength: 0,
        }
    }

    /// The same at wavelength `number` of several, to which light may go.
    pub fn at(self, wavelengths: &'a [f64], number: usize) -> Self {
        Self { wavelengths, wavelength: number as u16, ..self }
    }

    /// A path of weight 1 that begins with `ray` at source `number`.
    #[inline]
    pub fn begin(
        &self,
        ray: Ray,
        (number, placed): (usize, &PlacedSource),
        tally: &mut Tally<'_>,
        observer: &mut impl Observer,
    ) -> PathState {
        let location = placed.location;
        tally.book(Booking::Emission);
        observer.begins(&self.in_world(&ray, location));
        PathState {
            ray,
            location,
            left: None,
            own: self.scene.only_candidate(placed.instance),
            weight: 1.0,
            scatterings: 0,
            wavelength: self.wavelength,
            history: PathHistory::new(number as u32),
        }
    }

    /// Follows a path until it has met `surfaces` surfaces; true if it has ended, and all of its
    /// power is booked.
    #[inline]
    pub fn walk_to<L: Light>(
        &self,
        state: &mut PathState,
        light: &mut L,
        rng: &mut impl Rng,
        (tally, observer): (&mut Tally<'_>, &mut impl Observer),
        surfaces: u32,
    ) -> bool {
        // A copy, which the compiler keeps in registers.
        let mut path = *state;
        let last = surfaces.min(self.max_bounces);
        while path.history.bounces < last {
            let hit = self.intersect(&path);
            if !self.interact(&mut path, hit, light, rng, tally, observer) {
                *state = path;
                return true;
            }
        }
        let is_given_up = path.history.bounces >= self.max_bounces;
        if is_given_up {
            self.give_up(&path, tally, observer);
        }
        *state = path;
        is_given_up
    }

    /// Follows an unpolarised path through the world until it enters a body, and returns the
    /// instance there; `None` where the path has ended.
    #[inline]
    pub fn walk_to_body(
        &self,
        state: &mut PathState,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
    ) -> Option<u32> {
        let mut path = *state;
        while path.history.bounces < self.max_bounces {
            let hit = self.intersect(&path);
            if !self.interact(&mut path, hit, &mut Unpolarised, rng, tally, &mut ()) {
                *state = path;
                return None;
            }
            if let Location::Inside { instance, .. } = path.location
                && path.history.bounces < self.max_bounces
            {
                *state = path;
                return Some(instance);
            }
        }
        self.give_up(&path, tally, &mut ());
        *state = path;
        None
    }

    /// The nearest surface that borders the region of the ray.
    #[expect(clippy::inline_always, reason = "part of the loop over a path")]
    #[inline(always)]
    pub fn intersect(&self, state: &PathState) -> Option<Hit<'a>> {
        let candidates = Candidates { except: state.left, only: state.own };
        let (scene, ray, location) = (self.scene, &state.ray, state.location);
        match &scene.nested {
            Some(nested) => scene.nearest_of_nested(nested, ray, location, candidates),
            None => scene.nearest(ray, location, candidates),
        }
    }

    /// Takes a path to what it meets and beyond; whether it goes on.
    #[expect(clippy::inline_always, reason = "part of the loop over a path")]
    #[inline(always)]
    pub fn interact<L: Light>(
        &self,
        state: &mut PathState,
        hit: Option<Hit<'a>>,
        light: &mut L,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
        observer: &mut impl Observer,
    ) -> bool {
        let Some(impact) = self.arrive(state, hit, light, rng, tally, observer) else {
            return false;
        };
        let Impact { hit, patch, point, normal } = &impact;
        let direction = state.ray.direction;
        let event = scatter(hit, &patch.optics, direction, *point, *normal, light, rng);
        self.go_on(state, &impact, &event, rng, tally, observer)
    }

    /// Takes a path to what it meets next; `None` where it ends before.
    #[expect(clippy::inline_always, reason = "part of the loop over a path")]
    #[inline(always)]
    fn arrive<L: Light>(
        &self,
        state: &mut PathState,
        mut hit: Option<Hit<'a>>,
        light: &mut L,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
        observer: &mut impl Observer,
    ) -> Option<Impact<'a>> {
        let location = state.location;
        let medium = self.scene.medium(location);
        if medium.collisions.is_some() {
            match self.wander(*state, hit, medium, light, rng, tally, observer) {
                Wandered::On(path, ahead) => (*state, hit) = (path, ahead),
                Wandered::Elsewhere(path) => {
                    *state = path;
                    return None;
                }
                Wandered::Ended => return None,
            }
        }
        let ray = state.ray;
        let length = hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);

        // Transmittance exp(-α t) of the medium; the medium absorbs the rest.
        if medium.absorption > 0.0 {
            let before = state.weight;
            let transmittance = (-medium.absorption * length).exp();
            self.transmit(medium.line, transmittance, &mut state.weight, rng, tally);
            if state.weight == 0.0 {
                let fate = Fate::Medium(medium.line, length);
                observer.ends(&self.in_world(&ray, location), fate, before);
                return None;
            }
        }

        // Receivers stand in the world.
        if location == Location::World {
            tally.segment(&ray, length, state.weight, &state.history, light);
        }

        // Without a hit the path escapes, or has found a leak.
        let Some(hit) = hit else {
            let fate = if location == Location::World {
                tally.escape(ray.direction, state.weight)
            } else {
                tally.lose(Loss::Leak, state.weight)
            };
            observer.ends(&self.in_world(&ray, location), fate, state.weight);
            return None;
        };

        // Settle the point exactly on the surface, in the frame of its body.
        let patch = &hit.surface.patches[hit.surface.shape.patch(hit.primitive) as usize];
        let at = self.scene.in_frame(ray.at(hit.distance), location, hit.instance);
        let (point, normal) = hit.surface.shape.settle(at, hit.primitive);
        Some(Impact { hit, patch, point, normal })
    }

    /// Follows a path through a medium that scatters or converts light, up to its last flight before
    /// a surface, or to another wavelength. By value: where nothing scatters, the path stays in
    /// registers.
    #[expect(clippy::too_many_arguments, reason = "those of `arrive`, with the medium")]
    #[inline(never)]
    fn wander<L: Light>(
        &self,
        mut state: PathState,
        mut hit: Option<Hit<'a>>,
        medium: &CompiledMedium,
        light: &mut L,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
        observer: &mut impl Observer,
    ) -> Wandered<'a> {
        let location = state.location;
        loop {
            let (Some(collisions), Some(ahead)) = (&medium.collisions, hit.as_ref()) else {
                return Wandered::On(state, hit);
            };
            let ray = state.ray;
            let (weight, scatterings) = (&mut state.weight, &mut state.scatterings);
            let before = *weight;
            let turned = self.fly(
                medium,
                collisions,
                (&ray, ahead.distance),
                (weight, scatterings),
                rng,
                tally,
            );
            match turned {
                Flight::Free => return Wandered::On(state, hit),
                Flight::Absorbed(length) => {
                    let fate = Fate::Medium(medium.line, length);
                    observer.ends(&self.in_world(&ray, location), fate, before);
                    return Wandered::Ended;
                }
                Flight::Lost => {
                    let fate = Fate::Lost(Loss::Bounces);
                    observer.ends(&self.in_world(&ray, location), fate, state.weight);
                    return Wandered::Ended;
                }
                Flight::Scattered(ray) | Flight::Converted(ray, _) => {
                    light.depolarise();
                    // In the medium around instances it may meet again the one that it has left.
                    (state.ray, state.left) = (ray, None);
                    observer.scatters(&self.in_world(&ray, location), medium.line);
                    if let Flight::Converted(_, number) = turned
                        && number != self.wavelength
                    {
                        state.wavelength = number;
                        return Wandered::Elsewhere(state);
                    }
                    hit = self.intersect(&state);
                }
            }
        }
    }

    /// Takes a path in a medium that scatters through one flight, at most `length` long, and books
    /// what ends there. The free path is exponential, so a flight that a surface ends needs no
    /// memory of it.
    #[inline]
    pub fn fly(
        &self,
        medium: &CompiledMedium,
        collisions: &Collisions,
        (ray, length): (&Ray, f64),
        (weight, scatterings): (&mut f64, &mut u32),
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
    ) -> Flight {
        let free = collisions.free_path(rng);
        if free >= length {
            return Flight::Free;
        }
        if medium.absorption > 0.0 {
            let transmittance = (-medium.absorption * free).exp();
            self.transmit(medium.line, transmittance, weight, rng, tally);
            if *weight == 0.0 {
                return Flight::Absorbed(free);
            }
        }
        if *scatterings >= self.max_scatterings {
            tally.lose(Loss::Bounces, *weight);
            return Flight::Lost;
        }
        *scatterings += 1;
        let origin = ray.at(free);
        match collisions.event(rng) {
            Collision::Scatters(scattering) => {
                let direction = scattering.phase.sample(ray.direction, rng);
                Flight::Scattered(Ray { origin, direction })
            }
            Collision::Excites(luminophore, line) => {
                match self.convert(luminophore, line, weight, rng, tally) {
                    Some(number) => {
                        let direction = PhaseFunction::ISOTROPIC.sample(ray.direction, rng);
                        Flight::Converted(Ray { origin, direction }, number)
                    }
                    None => Flight::Absorbed(free),
                }
            }
        }
    }

    /// Takes from a path what a luminophore does not emit again, and draws the number of the
    /// wavelength of the rest; `None` where nothing is left. A run at one wavelength sees nothing of
    /// what is emitted.
    fn convert(
        &self,
        luminophore: &Luminophore,
        line: usize,
        weight: &mut f64,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
    ) -> Option<u16> {
        let (absorbed, quantum_yield) = (*weight, luminophore.quantum_yield);
        let number = luminophore.emit(rng);
        let shift = match self.wavelengths.get(number) {
            Some(emitted) => self.wavelengths[usize::from(self.wavelength)] / emitted,
            None => 0.0,
        };
        let efficiency = quantum_yield * shift;
        let lost = self.keep(weight, efficiency, rng);
        // The roulette takes all of it or nothing: both losses have their share of that.
        let expected = absorbed * (1.0 - efficiency);
        let taken = if expected.abs() > 0.0 { lost / expected } else { 1.0 };
        let quantum_loss = taken * (1.0 - quantum_yield) * absorbed;
        let stokes_loss = lost - quantum_loss;
        tally.book(Booking::Conversion { line, absorbed, quantum_loss, stokes_loss });
        (*weight > 0.0).then_some(number as u16)
    }

    /// Sends a path on from where it has met a surface; whether it goes on.
    #[expect(clippy::inline_always, reason = "part of the loop over a path")]
    #[inline(always)]
    fn go_on(
        &self,
        state: &mut PathState,
        impact: &Impact<'_>,
        event: &ScatterEvent,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
        observer: &mut impl Observer,
    ) -> bool {
        let Impact { hit, patch, point, normal } = *impact;
        let (ray, location) = (state.ray, state.location);

        // The surface absorbs what it does not send on.
        let sides = [hit.side, event.side];
        let arrived = state.weight;
        self.settle(patch.line, sides, event.efficiency, &mut state.weight, rng, tally);
        let weight = state.weight;
        observer.meets(&Interaction {
            point: point + self.scene.position(hit.instance),
            line: patch.line,
            instance: hit.instance,
            direction: ray.direction,
            from: hit.side,
            to: event.side,
            arrived,
            weight,
        });
        tally.interaction(patch.line, sides, [arrived, weight], &state.history);
        state.history.meet(patch.line, [point.x, point.y]);
        if weight == 0.0 {
            let fate = Fate::Surface(patch.line);
            observer.ends(&self.in_world(&ray, location), fate, arrived);
            return false;
        }

        // Start anew, just off the surface, on the side on which the light goes on.
        let start =
            point + normal * (event.side.sign() * self.scene.offset_from(hit.surface, point));
        let sound = event.sound(normal);
        (state.location, state.ray.origin) = match (hit.surface.region(event.side), hit.instance) {
            (Region::World, instance) if sound => {
                state.left = self.scene.convex_exit(instance);
                let around = self.scene.around(instance);
                (around, start + self.scene.position(instance))
            }
            (Region::Body(medium), Some(instance)) if sound => {
                state.left = None;
                (Location::Inside { instance, medium }, start)
            }
            _ => {
                let fate = tally.lose(Loss::Invalid, weight);
                observer.ends(&self.in_world(&ray, location), fate, weight);
                return false;
            }
        };
        state.ray.direction = event.direction;
        true
    }

    /// Ends a path that has met as many surfaces as it may.
    fn give_up(&self, state: &PathState, tally: &mut Tally<'_>, observer: &mut impl Observer) {
        let fate = tally.lose(Loss::Bounces, state.weight);
        observer.ends(&self.in_world(&state.ray, state.location), fate, state.weight);
    }

    /// A ray in the frame of the world.
    #[inline]
    fn in_world(&self, ray: &Ray, location: Location) -> Ray {
        let position = match location {
            Location::World => DVec3::ZERO,
            Location::Inside { instance, .. } => self.scene.position(Some(instance)),
        };
        Ray { origin: ray.origin + position, direction: ray.direction }
    }

    /// Takes from a path what a medium absorbs on the way.
    #[inline]
    pub fn transmit(
        &self,
        line: usize,
        transmittance: f64,
        weight: &mut f64,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
    ) {
        let absorbed = self.keep(weight, transmittance, rng);
        tally.book(Booking::Transmission { line, absorbed });
    }

    /// Takes from a path what a surface absorbs, and books where the rest goes on.
    #[inline]
    pub fn settle(
        &self,
        line: usize,
        sides: [Side; 2],
        efficiency: f64,
        weight: &mut f64,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
    ) {
        let absorbed = self.keep(weight, efficiency, rng);
        tally.book(Booking::Interaction { line, sides, absorbed, weight: *weight });
    }

    /// Keeps `efficiency` of the weight and returns what is absorbed. Below the threshold of the
    /// roulette, chance keeps or absorbs all: the mean is the same, and the power of every path
    /// balances.
    #[inline]
    fn keep(&self, weight: &mut f64, efficiency: f64, rng: &mut impl Rng) -> f64 {
        let before = *weight;
        if before * efficiency >= self.roulette_below || efficiency >= 1.0 {
            *weight = before * efficiency;
        } else if random::unit(rng) >= efficiency {
            *weight = 0.0;
        }
        before - *weight
    }
}
