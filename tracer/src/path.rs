// SPDX-License-Identifier: MIT OR Apache-2.0
//! One ray's life. The comments before the paragraphs of [`Tracer::walk_until`], read alone, are the algorithm.

use bsdf::Side;
use glam::DVec3;
use rand::Rng;

use crate::ledger::{Ledger, Loss};
use crate::observer::{Fate, Interaction, Observer};
use crate::optics::polarization::{Light, Polarization};
use crate::outcome::Totals;
use crate::random;
use crate::ray::{self, Ray};
use crate::receiver::{RayBuffer, Receiver};
use crate::run::{Sampling, Settings};
use crate::scatter::scatter;
use crate::scene::{Candidates, Location, PlacedSource, Scene};
use crate::surface::Region;

/// Receivers with their places among the readings.
type Numbered<'a> = Vec<(usize, &'a dyn Receiver)>;

/// What stays the same for all rays of a run.
pub(crate) struct Tracer<'a> {
    pub scene: &'a Scene,
    /// Bins of every receiver.
    pub bins: Vec<usize>,
    /// Receivers that ask for flights through the world.
    pub flights: Numbered<'a>,
    /// Receivers that ask for escapes.
    escapes: Numbered<'a>,
    pub max_bounces: u32,
    pub roulette_below: f64,
    /// Parts into which a path divides at the first surface that lets light through; 1 for none.
    pub path_splitting: u32,
    pub polarization: Polarization,
    pub sampling: Sampling,
}

/// The sums of a group of paths, and the rays that wait to be sorted into them.
pub(crate) struct Tally {
    pub totals: Totals,
    pub leaving: RayBuffer,
}

impl Tally {
    pub fn new(tracer: &Tracer<'_>) -> Self {
        Self {
            totals: Totals {
                ledger: Ledger::new(&tracer.scene.lines),
                readings: tracer.bins.iter().map(|&bins| vec![0.0; bins]).collect(),
            },
            leaving: RayBuffer::default(),
        }
    }

    /// Everything sorted.
    pub fn close(mut self, tracer: &Tracer<'_>) -> Totals {
        self.leaving
            .settle(&tracer.escapes, &mut self.totals.readings);
        self.totals
    }
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
    /// Surfaces met so far.
    pub bounces: u32,
}

impl<'a> Tracer<'a> {
    pub fn new(scene: &'a Scene, receivers: &[&'a dyn Receiver], settings: &Settings) -> Self {
        let numbered = receivers.iter().copied().enumerate();
        Self {
            scene,
            bins: receivers.iter().map(|receiver| receiver.bins()).collect(),
            flights: numbered
                .clone()
                .filter(|(_, r)| r.needs().flights)
                .collect(),
            escapes: numbered.filter(|(_, r)| r.needs().escapes).collect(),
            max_bounces: settings.max_bounces,
            roulette_below: settings.roulette_below,
            path_splitting: settings.path_splitting,
            polarization: settings.polarization,
            sampling: settings.sampling,
        }
    }

    /// Follows one ray of weight 1 to its end and counts all of its power; shows it to `observer`; returns how many
    /// surfaces it met.
    #[inline]
    pub fn follow<L: Light>(
        &self,
        ray: Ray,
        placed: &PlacedSource,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> u64 {
        let path = self.begin(ray, placed, tally, observer);
        if self.scene.has_nested() {
            return self.walk_stepwise(path, L::default(), rng, tally, observer);
        }
        self.walk::<L>(path, rng, tally, observer)
    }

    /// A path of weight 1 from a source.
    #[inline]
    pub fn begin(
        &self,
        ray: Ray,
        placed: &PlacedSource,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> PathState {
        let location = placed.location;
        tally.totals.ledger.emitted += 1.0;
        observer.begins(&self.in_world(&ray, location));
        PathState {
            ray,
            location,
            left: None,
            own: self.scene.keeps_to(placed.instance),
            weight: 1.0,
            bounces: 0,
        }
    }

    /// Follows a ray from the middle of its path to its end, as unpolarised light at first; returns how many surfaces it met, those before included. Not where
    /// instances stand in array solids: [`Tracer::walk_stepwise`] knows these.
    #[inline]
    pub fn walk<L: Light>(
        &self,
        path: PathState,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> u64 {
        self.walk_as(path, L::default(), rng, tally, observer)
    }

    /// The same of light of this polarisation.
    #[inline]
    pub fn walk_as<L: Light>(
        &self,
        path: PathState,
        light: L,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> u64 {
        self.walk_until::<L, false>(path, light, rng, tally, observer)
            .0
    }

    /// The same, but with `ENTERS` only until the ray enters a body, if it does: then where it is.
    #[expect(
        clippy::too_many_lines,
        reason = "what may happen to a ray is read in one piece"
    )]
    #[inline]
    pub fn walk_until<L: Light, const ENTERS: bool>(
        &self,
        path: PathState,
        mut light: L,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> (u64, Option<PathState>) {
        let PathState {
            mut ray,
            mut location,
            mut left,
            own,
            mut weight,
            bounces,
        } = path;
        let totals = &mut tally.totals;
        for bounce in bounces..self.max_bounces {
            // Find the nearest surface that borders the region where the ray flies.
            let hit = self.scene.nearest(
                &ray,
                location,
                Candidates {
                    except: left,
                    only: own,
                },
            );
            let length = hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);

            // Leave to the medium what it absorbs on the way.
            let medium = self.scene.medium(location);
            if medium.absorption > 0.0 {
                let before = weight;
                let passed = self.share(&mut weight, (-medium.absorption * length).exp(), rng);
                totals.ledger.media[medium.line] += passed;
                if weight == 0.0 {
                    let fate = Fate::Medium(medium.line, length);
                    observer.ends(&self.in_world(&ray, location), fate, before);
                    return (u64::from(bounce), None);
                }
            }

            // Show a segment through the world to the receivers.
            if location == Location::World {
                for (number, receiver) in &self.flights {
                    if let Some(bin) = receiver.crossed(&ray, length) {
                        totals.readings[*number][bin] += weight;
                    }
                }
            }

            // End where there is nothing more to meet: far away, or by a leak.
            let Some(hit) = hit else {
                self.end(&ray, location, weight, tally, observer);
                return (u64::from(bounce), None);
            };

            // Settle the point of impact exactly on the surface, in the frame of its body.
            let patch = &hit.surface.patches[hit.surface.shape.patch(hit.primitive) as usize];
            let at = ray.at(hit.distance);
            let at = match (location, hit.instance) {
                (Location::World, Some(_)) => at - self.scene.position(hit.instance),
                _ => at,
            };
            let (point, normal) = hit.surface.shape.settle(at, hit.primitive);

            // Let the surface choose where the light goes on and how much of it; what is missing is absorbed.
            let event = scatter(
                &hit,
                &patch.optics,
                ray.direction,
                point,
                normal,
                &mut light,
                rng,
            );
            let line = &mut totals.ledger.surfaces[patch.line];
            let before = weight;
            line.absorbed += self.share(&mut weight, event.share, rng);
            observer.meets(&Interaction {
                point: point + self.scene.position(hit.instance),
                line: patch.line,
                instance: hit.instance,
                direction: ray.direction,
                from: hit.side,
                to: event.side,
                arrived: before,
                weight,
            });
            if L::CARRIED {
                observer.carries(&light.stokes());
            }
            if weight == 0.0 {
                let fate = Fate::Surface(patch.line);
                observer.ends(&self.in_world(&ray, location), fate, before);
                return (u64::from(bounce) + 1, None);
            }

            // Note a passage to the other side.
            match (hit.side, event.side) {
                (Side::Inner, Side::Outer) => line.outward += weight,
                (Side::Outer, Side::Inner) => line.inward += weight,
                (Side::Inner, Side::Inner) | (Side::Outer, Side::Outer) => {}
            }

            // Start anew, just off the surface, on the side on which the light goes on.
            let start =
                point + normal * (event.side.sign() * self.scene.offset_from(hit.surface, point));
            let sound = event.sound(normal);
            (location, ray.origin) = match (hit.surface.region(event.side), hit.instance) {
                (Region::World, instance) if sound => {
                    left = self.scene.leaves_for_good(instance);
                    (Location::World, start + self.scene.position(instance))
                }
                (Region::Body(medium), Some(instance)) if sound => {
                    (Location::Inside { instance, medium }, start)
                }
                _ => {
                    lose(&mut totals.ledger, Loss::Invalid, weight);
                    let ended = self.in_world(&ray, location);
                    observer.ends(&ended, Fate::Lost(Loss::Invalid), weight);
                    return (u64::from(bounce) + 1, None);
                }
            };
            ray.direction = event.direction;
            let met = bounce + 1;
            if ENTERS && location != Location::World && met < self.max_bounces {
                let entered = PathState {
                    ray,
                    location,
                    left,
                    own,
                    weight,
                    bounces: met,
                };
                return (u64::from(met), Some(entered));
            }
        }
        lose(&mut totals.ledger, Loss::Bounces, weight);
        let ended = self.in_world(&ray, location);
        observer.ends(&ended, Fate::Lost(Loss::Bounces), weight);
        (u64::from(self.max_bounces), None)
    }

    /// A ray that flies in `location` in the frame of the world.
    #[inline]
    pub fn in_world(&self, ray: &Ray, location: Location) -> Ray {
        let position = match location {
            Location::World => DVec3::ZERO,
            Location::Inside { instance, .. } => self.scene.position(Some(instance)),
        };
        Ray {
            origin: ray.origin + position,
            direction: ray.direction,
        }
    }

    /// Keeps `share` of the weight and returns what is absorbed. A weight that would fall below the threshold is kept or
    /// absorbed whole, by chance: the mean is the same, and the tallies of every single path balance.
    #[inline]
    pub fn share(&self, weight: &mut f64, share: f64, rng: &mut impl Rng) -> f64 {
        let before = *weight;
        if before * share >= self.roulette_below || share >= 1.0 {
            *weight = before * share;
        } else if random::unit(rng) >= share {
            *weight = 0.0;
        }
        before - *weight
    }

    #[inline]
    pub fn end(
        &self,
        ray: &Ray,
        location: Location,
        weight: f64,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) {
        if location != Location::World {
            lose(&mut tally.totals.ledger, Loss::Leak, weight);
            let ended = self.in_world(ray, location);
            return observer.ends(&ended, Fate::Lost(Loss::Leak), weight);
        }
        let fate = self.book_escape(ray, weight, tally);
        observer.ends(ray, fate, weight);
    }

    /// Counts a ray of the world that leaves the scene for good.
    #[inline]
    fn book_escape(&self, ray: &Ray, weight: f64, tally: &mut Tally) -> Fate {
        let ledger = &mut tally.totals.ledger;
        let fate = if ray.direction.z >= 0.0 {
            ledger.escaped_up += weight;
            Fate::EscapedUp
        } else {
            ledger.escaped_down += weight;
            Fate::EscapedDown
        };
        if !self.escapes.is_empty() && tally.leaving.push(ray, weight) {
            tally
                .leaving
                .settle(&self.escapes, &mut tally.totals.readings);
        }
        fate
    }

    /// Shows a ray of the world that meets nothing more to the receivers and counts it.
    #[inline]
    pub fn leave(&self, ray: &Ray, weight: f64, tally: &mut Tally) -> Fate {
        self.fly(ray, f64::INFINITY, weight, tally);
        self.book_escape(ray, weight, tally)
    }

    /// Counts rays of the world that meet nothing more: those of `lanes`, each bit one, moved by its `position`.
    #[inline]
    pub fn leave_many<const N: usize>(
        &self,
        (origin, direction): (&[[f64; N]; 3], &[[f64; N]; 3]),
        weight: &[f64; N],
        (lanes, position): (u64, impl Fn(usize) -> DVec3),
        tally: &mut Tally,
    ) {
        if self.flies() {
            for lane in ray::lanes(lanes) {
                let mut ray = Ray::of_lane(origin, direction, lane);
                ray.origin += position(lane);
                self.leave(&ray, weight[lane], tally);
            }
            return;
        }
        let (mut up, mut down) = (0.0, 0.0);
        for lane in ray::lanes(lanes) {
            let rises = direction[2][lane] >= 0.0;
            up += if rises { weight[lane] } else { 0.0 };
            down += if rises { 0.0 } else { weight[lane] };
            if !self.escapes.is_empty() {
                let mut ray = Ray::of_lane(origin, direction, lane);
                ray.origin += position(lane);
                if tally.leaving.push(&ray, weight[lane]) {
                    tally
                        .leaving
                        .settle(&self.escapes, &mut tally.totals.readings);
                }
            }
        }
        tally.totals.ledger.escaped_up += up;
        tally.totals.ledger.escaped_down += down;
    }

    /// Whether any receiver asks for flights.
    pub fn flies(&self) -> bool {
        !self.flights.is_empty()
    }

    /// Shows a segment of `length` mm through the world to the receivers.
    #[inline]
    pub fn fly(&self, ray: &Ray, length: f64, weight: f64, tally: &mut Tally) {
        for (number, receiver) in &self.flights {
            if let Some(bin) = receiver.crossed(ray, length) {
                tally.totals.readings[*number][bin] += weight;
            }
        }
    }
}

pub(crate) fn lose(ledger: &mut Ledger, cause: Loss, weight: f64) {
    ledger.lost[cause as usize] += weight;
}
