// SPDX-License-Identifier: MIT OR Apache-2.0
//! The walker: follows one path from its source to its end.
//!
//! [`Walk::interact`] is the algorithm: wander, transmit, show to the receivers, arrive, scatter, go
//! on. The batches take the same steps.

use bsdf::Side;
use glam::DVec3;
use rand::Rng;

use crate::ledger::{Booking, Loss};
use crate::observer::{Fate, Interaction, Observer};
use crate::optics::luminescence::{Collision, Collisions, Luminophore};
use crate::optics::phase::PhaseFunction;
use crate::optics::polarisation::{Light, Polarisation};
use crate::random;
use crate::ray::Ray;
use crate::receiver::{PathHistory, Receiver, Receivers, Tally};
use crate::scatter::{ScatterEvent, scatter};
use crate::scene::{
    Candidates, CompiledMedium, CompiledPatch, FilmFaces, Hit, Location, PlacedSource, Scene,
};
use crate::settings::{Sampling, Settings};
use crate::surface::{Region, SurfaceModel};

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

/// Reason why a path is followed no farther.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stop {
    /// It has ended, or goes on at another wavelength.
    Over,
    /// It has met as many surfaces as asked for.
    Long,
    /// It takes an outcome of the table of a film stack, where its ray begins now.
    AtFilms,
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

/// A path on its way, with all that its steps use and change. The path is a copy, which the compiler
/// keeps in registers.
pub(crate) struct Walk<'w, 'a, 't, L, R, O> {
    pub tracer: &'w Tracer<'a>,
    pub path: PathState,
    pub light: &'w mut L,
    pub rng: &'w mut R,
    pub tally: &'w mut Tally<'t>,
    pub observer: &'w mut O,
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

    /// A ray in the frame of the world.
    #[inline]
    fn in_world(&self, ray: &Ray, location: Location) -> Ray {
        let position = match location {
            Location::World => DVec3::ZERO,
            Location::Inside { instance, .. } => self.scene.position(Some(instance)),
        };
        Ray { origin: ray.origin + position, direction: ray.direction }
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
        let free = collisions.free_path(ray, length, rng);
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

#[expect(clippy::inline_always, reason = "steps of the loop over a path")]
impl<'a, 't, L: Light, R: Rng, O: Observer> Walk<'_, 'a, 't, L, R, O> {
    /// Follows the path until it has met `surfaces` surfaces; true if it has ended, and all of its
    /// power is booked.
    #[inline]
    pub fn follow_to(mut self, surfaces: u32) -> (PathState, bool) {
        let last = surfaces.min(self.tracer.max_bounces);
        while self.path.history.bounces < last {
            let hit = self.intersect();
            if self.interact(hit).is_none() {
                return (self.path, true);
            }
        }
        let is_given_up = self.path.history.bounces >= self.tracer.max_bounces;
        if is_given_up {
            self.give_up();
        }
        (self.path, is_given_up)
    }

    /// Follows the path until it has met `surfaces` surfaces, or to where it meets the film stack
    /// with these outer faces and takes an outcome of its table.
    #[inline]
    pub fn follow_to_films(mut self, surfaces: u32, films: &FilmFaces) -> (PathState, Stop) {
        let last = surfaces.min(self.tracer.max_bounces);
        while self.path.history.bounces < last {
            let ahead = match self.path.location {
                Location::World => films.ahead(&self.path.ray),
                Location::Inside { .. } => None,
            };
            let hit = match ahead {
                None => self.intersect(),
                Some(length) => match self.before(length, films.instance()) {
                    None => return self.reach_films(length),
                    hit => hit,
                },
            };
            if self.interact(hit).is_none() {
                return (self.path, Stop::Over);
            }
        }
        if self.path.history.bounces >= self.tracer.max_bounces {
            self.give_up();
            return (self.path, Stop::Over);
        }
        (self.path, Stop::Long)
    }

    /// The nearest surface before the film stack, which a ray of the world meets at this distance;
    /// `films` is the instance of the stack, if that has nothing else.
    #[inline(always)]
    fn before(&self, length: f64, films: Option<u32>) -> Option<Hit<'a>> {
        let (PathState { ray, own, .. }, scene) = (&self.path, self.tracer.scene);
        if scene.nested.is_some() || films.is_none() {
            let offset = scene.offset();
            return self.intersect().filter(|hit| hit.distance < length - 4.0 * offset);
        }
        scene.nearest_before(ray, length, Candidates { except: films, only: *own })
    }

    /// Takes the path to where it meets the film stack.
    fn reach_films(mut self, length: f64) -> (PathState, Stop) {
        if self.transmit(&self.tracer.scene.world, length).is_none() {
            return (self.path, Stop::Over);
        }
        self.show(length);
        self.path.ray.origin = self.path.ray.at(length);
        (self.path, Stop::AtFilms)
    }

    /// Shows light traced backwards to the receivers that read it, as far as it goes; books nothing.
    pub fn show_seen(mut self) {
        loop {
            let hit = self.intersect();
            let length = hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);
            let absorption = self.tracer.scene.world.absorption;
            if absorption > 0.0 {
                self.path.weight *= (-absorption * length).exp();
            }
            let PathState { ray, weight, history, .. } = &self.path;
            self.tally.view(ray, length, *weight, history);
            let goes_round = hit.is_some().then(|| self.arrive(hit)).flatten();
            let is_periodic =
                |impact: &Impact<'_>| matches!(impact.patch.optics, SurfaceModel::Periodic);
            let Some(impact) = goes_round.filter(is_periodic) else { return };
            if self.go_round(&impact).is_none() {
                return;
            }
        }
    }

    /// Follows the path through the world until it enters a body, and returns the instance there;
    /// `None` where the path has ended.
    #[inline]
    pub fn follow_to_body(mut self) -> (PathState, Option<u32>) {
        while self.path.history.bounces < self.tracer.max_bounces {
            let hit = self.intersect();
            if self.interact(hit).is_none() {
                return (self.path, None);
            }
            if let Location::Inside { instance, .. } = self.path.location
                && self.path.history.bounces < self.tracer.max_bounces
            {
                return (self.path, Some(instance));
            }
        }
        self.give_up();
        (self.path, None)
    }

    /// The nearest surface that borders the region of the ray.
    #[inline(always)]
    fn intersect(&self) -> Option<Hit<'a>> {
        let PathState { ray, location, left, own, .. } = &self.path;
        let candidates = Candidates { except: *left, only: *own };
        let scene = self.tracer.scene;
        match &scene.nested {
            Some(nested) => scene.nearest_of_nested(nested, ray, *location, candidates),
            None => scene.nearest(ray, *location, candidates),
        }
    }

    /// Takes the path to what it meets and beyond; `None` where it ends, or goes on at another
    /// wavelength.
    #[inline(always)]
    pub fn interact(&mut self, mut hit: Option<Hit<'a>>) -> Option<()> {
        let medium = self.tracer.scene.medium(self.path.location);
        if medium.collisions.is_some() {
            let goes_on;
            (self.path, hit, goes_on) = self.lend().wander(medium, hit);
            goes_on.then_some(())?;
        }
        let length = hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);
        self.transmit(medium, length)?;
        self.show(length);
        let impact = self.arrive(hit)?;
        if matches!(impact.patch.optics, SurfaceModel::Periodic) {
            return self.go_round(&impact).or_else(|| {
                self.give_up();
                None
            });
        }
        let event = self.scatter(&impact);
        self.settle(&impact, &event)?;
        self.go_on(&impact, &event)
    }

    /// The same walk for a step that is no part of the loop. Its path is a copy: where nothing
    /// scatters, the path stays in registers.
    #[inline(always)]
    fn lend(&mut self) -> Walk<'_, 'a, 't, L, R, O> {
        let Self { tracer, path, light, rng, tally, observer } = self;
        Walk { tracer, path: *path, light, rng, tally, observer }
    }

    /// Follows the path through a medium that scatters or converts light, up to its last flight
    /// before what is ahead then; false if it ends, or goes on at another wavelength.
    #[inline(never)]
    fn wander(
        mut self,
        medium: &CompiledMedium,
        mut hit: Option<Hit<'a>>,
    ) -> (PathState, Option<Hit<'a>>, bool) {
        while let (Some(collisions), Some(ahead)) = (&medium.collisions, &hit) {
            let Self { tracer, path, rng, tally, .. } = &mut self;
            let before = path.weight;
            let flight = (&path.ray, ahead.distance);
            let power = (&mut path.weight, &mut path.scatterings);
            match tracer.fly(medium, collisions, flight, power, *rng, tally) {
                Flight::Free => break,
                Flight::Absorbed(length) => {
                    self.end::<()>(Fate::Medium(medium.line, length), before);
                    return (self.path, hit, false);
                }
                Flight::Lost => {
                    self.end::<()>(Fate::Lost(Loss::Bounces), self.path.weight);
                    return (self.path, hit, false);
                }
                Flight::Scattered(ray) => self.turn(ray, medium),
                Flight::Converted(ray, wavelength) => {
                    self.turn(ray, medium);
                    self.path.wavelength = wavelength;
                    if wavelength != self.tracer.wavelength {
                        return (self.path, hit, false);
                    }
                }
            }
            hit = self.intersect();
        }
        (self.path, hit, true)
    }

    /// Sends the path along the ray on which a medium has scattered or emitted it.
    fn turn(&mut self, ray: Ray, medium: &CompiledMedium) {
        self.light.depolarise();
        // In the medium around instances it may meet again the one that it has left.
        (self.path.ray, self.path.left) = (ray, None);
        self.observer.scatters(&self.world_ray(), medium.line);
    }

    /// Takes from the path what the medium absorbs over `length` mm: all but its transmittance
    /// exp(-α t).
    #[inline(always)]
    fn transmit(&mut self, medium: &CompiledMedium, length: f64) -> Option<()> {
        if medium.absorption > 0.0 {
            let before = self.path.weight;
            let transmittance = (-medium.absorption * length).exp();
            let weight = &mut self.path.weight;
            self.tracer.transmit(medium.line, transmittance, weight, self.rng, self.tally);
            if self.path.weight == 0.0 {
                return self.end(Fate::Medium(medium.line, length), before);
            }
        }
        Some(())
    }

    /// Shows a flight to the receivers, which stand in the world.
    #[inline(always)]
    fn show(&mut self, length: f64) {
        let PathState { ray, location, weight, history, .. } = &self.path;
        if *location == Location::World {
            self.tally.segment(ray, length, *weight, history, self.light);
        }
    }

    /// Settles the point exactly on the surface; without a hit the path escapes, or has found a
    /// leak.
    #[inline(always)]
    fn arrive(&mut self, hit: Option<Hit<'a>>) -> Option<Impact<'a>> {
        let PathState { ray, location, weight, .. } = self.path;
        let Some(hit) = hit else {
            let fate = if location == Location::World {
                self.tally.escape(ray.direction, weight)
            } else {
                self.tally.lose(Loss::Leak, weight)
            };
            return self.end(fate, weight);
        };
        let patch = &hit.surface.patches[hit.surface.shape.patch(hit.primitive) as usize];
        let near = self.tracer.scene.in_frame(ray.at(hit.distance), location, hit.instance);
        let (point, normal) = hit.surface.shape.settle(near, hit.primitive);
        Some(Impact { hit, patch, point, normal })
    }

    /// Draws how the surface scatters the light.
    #[inline(always)]
    fn scatter(&mut self, Impact { hit, patch, point, normal }: &Impact<'_>) -> ScatterEvent {
        let direction = self.path.ray.direction;
        let in_world = || *point + self.tracer.scene.position(hit.instance);
        let optics = patch.optics.at(in_world, self.rng);
        if hit.surface.shape.is_smooth()
            && let Some(event) = self.scatter_smoothly(hit, optics, (*point, *normal))
        {
            return event;
        }
        scatter(hit, optics, direction, *point, *normal, self.light, self.rng)
    }

    /// The same by the smooth normal of a mesh; `None` where that would send the light through the face
    /// itself.
    #[cold]
    #[inline(never)]
    fn scatter_smoothly(
        &mut self,
        hit: &Hit<'_>,
        optics: &SurfaceModel,
        (point, normal): (DVec3, DVec3),
    ) -> Option<ScatterEvent> {
        let direction = self.path.ray.direction;
        let smooth = hit.surface.shape.shading(point, hit.primitive, normal);
        (smooth.dot(direction) * hit.side.sign() < 0.0).then_some(())?;
        let before = *self.light;
        let event = scatter(hit, optics, direction, point, smooth, self.light, self.rng);
        if event.sound(normal) {
            return Some(event);
        }
        *self.light = before;
        None
    }

    /// Takes from the path what the surface does not send on.
    #[inline(always)]
    fn settle(&mut self, impact: &Impact<'_>, event: &ScatterEvent) -> Option<()> {
        let Impact { hit, patch, point, .. } = *impact;
        let sides = [hit.side, event.side];
        let arrived = self.path.weight;
        let weight = &mut self.path.weight;
        self.tracer.settle(patch.line, sides, event.efficiency, weight, self.rng, self.tally);
        let weight = *weight;
        self.observer.meets(&Interaction {
            point: point + self.tracer.scene.position(hit.instance),
            line: patch.line,
            instance: hit.instance,
            direction: self.path.ray.direction,
            from: hit.side,
            to: event.side,
            arrived,
            weight,
        });
        self.tally.interaction(patch.line, sides, [arrived, weight], &self.path.history);
        self.path.history.meet(patch.line, [point.x, point.y]);
        if weight == 0.0 { self.end(Fate::Surface(patch.line), arrived) } else { Some(()) }
    }

    /// Starts anew just off the surface, on the side on which the light goes on.
    #[inline(always)]
    fn go_on(&mut self, impact: &Impact<'_>, event: &ScatterEvent) -> Option<()> {
        let Impact { hit, point, normal, .. } = *impact;
        let scene = self.tracer.scene;
        let start = point + normal * (event.side.sign() * scene.offset_from(hit.surface, point));
        let sound = event.sound(normal);
        let path = &mut self.path;
        (path.location, path.ray.origin) = match (hit.surface.region(event.side), hit.instance) {
            (Region::World, instance) if sound => {
                path.left = scene.convex_exit(instance);
                (scene.around(instance), start + scene.position(instance))
            }
            (Region::Body(medium), Some(instance)) if sound => {
                path.left = None;
                (Location::Inside { instance, medium }, start)
            }
            _ => {
                let weight = path.weight;
                let fate = self.tally.lose(Loss::Invalid, weight);
                return self.end(fate, weight);
            }
        };
        path.ray.direction = event.direction;
        Some(())
    }

    /// Goes on from the opposite face of a cell that repeats, just inside of it; `None` where it has done
    /// so as often as it may, as level light would for ever.
    #[cold]
    fn go_round(&mut self, impact: &Impact<'_>) -> Option<()> {
        let Impact { hit, point, normal, .. } = *impact;
        if self.path.scatterings >= self.tracer.max_scatterings {
            return None;
        }
        self.path.scatterings += 1;
        let scene = self.tracer.scene;
        let axis = usize::from(normal.x.abs() < normal.y.abs());
        let mut opposite = point;
        opposite[axis] = -point[axis];
        let inwards = -normal * hit.side.sign();
        self.path.ray.origin = opposite + inwards * scene.offset_from(hit.surface, point);
        self.path.left = None;
        let position = scene.position(hit.instance);
        self.observer.goes_round(point + position, self.path.ray.origin + position);
        Some(())
    }

    /// Ends a path that has met as many surfaces as it may.
    fn give_up(&mut self) {
        let weight = self.path.weight;
        let fate = self.tally.lose(Loss::Bounces, weight);
        self.end::<()>(fate, weight);
    }

    /// Shows to the observer how the path ends, with what was left of its weight before.
    #[inline(always)]
    fn end<T>(&mut self, fate: Fate, weight: f64) -> Option<T> {
        self.observer.ends(&self.world_ray(), fate, weight);
        None
    }

    /// The ray of the path in the frame of the world.
    #[inline(always)]
    fn world_ray(&self) -> Ray {
        self.tracer.in_world(&self.path.ray, self.path.location)
    }
}
