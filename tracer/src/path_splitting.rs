// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths that divide at the first surface that lets light through.
//!
//! In: a ray that begins. Up to its first interface, film or scattering table that does not reflect totally it goes as any other. There it divides: an
//! interface or a film sends on both what it reflects and what it refracts, each with its share of the weight; a table is drawn from several times, each
//! draw with the same part of the weight. Each part goes on by itself to its end, and divides no more. Weights of the parts add up to that of the whole, so
//! that the tallies of every path balance as before; they are the expectations of what is drawn otherwise, so that no mean changes. Where the reflected or the
//! refracted part would fall below the threshold of the roulette, one of both is drawn and takes all. Parts of one path depend on each other;
//! they end in the same group, from whose scatter errors follow.
//!
//! The steps of a path are those of [`Tracer::walk_until`], in a loop that stops between them: the loop of whole paths, built of the same steps, was 8 % slower.
//! Whole paths among instances in solids go by these steps too, so that those without pay nothing for them.

use bsdf::Side;
use glam::DVec3;
use rand::Rng;

use crate::ledger::Loss;
use crate::observer::{Fate, Interaction, Observer};
use crate::optics::polarization::Light;
use crate::path::{PathState, Tally, Tracer, lose};
use crate::ray::Ray;
use crate::scatter::{ScatterEvent, both_ways, scatter};
use crate::scene::{Candidates, CompiledPatch, Hit, Location, PlacedSource};
use crate::surface::{Region, SurfaceModel};

/// Where a ray has met a surface.
#[derive(Clone, Copy)]
pub(crate) struct Impact<'a> {
    pub patch: &'a CompiledPatch,
    /// On the surface, in the frame of its body.
    pub point: DVec3,
    /// The unit normal n there.
    pub normal: DVec3,
}

impl Impact<'_> {
    /// Lets the surface choose where light that comes along `direction` goes on.
    #[inline]
    fn send_on<L: Light>(
        &self,
        hit: &Hit<'_>,
        direction: DVec3,
        light: &mut L,
        rng: &mut impl Rng,
    ) -> ScatterEvent {
        let optics = &self.patch.optics;
        scatter(hit, optics, direction, self.point, self.normal, light, rng)
    }
}

impl<'a> Tracer<'a> {
    /// Follows one ray of weight 1 and all parts of its path to their ends; returns how many surfaces they met, the one where the path divided once.
    pub fn follow_dividing<L: Light>(
        &self,
        ray: Ray,
        placed: &PlacedSource,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> u64 {
        let mut path = self.begin(ray, placed, tally, observer);
        let mut light = L::default();
        for bounce in 0..self.max_bounces {
            let Some((hit, impact)) = self.meet(&mut path, rng, tally, observer) else {
                return u64::from(bounce);
            };
            let met = (&hit, impact);
            if let Some(more) = self.divide(&path, met, light, rng, tally, observer) {
                return u64::from(bounce) + 1 + more;
            }
            let event = impact.send_on(&hit, path.ray.direction, &mut light, rng);
            if !self.go_on(&mut path, met, &event, rng, tally, observer) {
                return u64::from(bounce) + 1;
            }
            observer.carries(&light.stokes());
        }
        self.give_up(path, tally, observer)
    }

    /// Divides a path, if the surface lets light through, and follows its parts; returns how many surfaces they met beyond this one.
    fn divide<L: Light>(
        &self,
        path: &PathState,
        met: (&Hit<'a>, Impact<'a>),
        light: L,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> Option<u64> {
        let (hit, impact) = met;
        let mut more = 0;
        let direction = path.ray.direction;
        if let SurfaceModel::Scatter(_) = &impact.patch.optics {
            let weight = path.weight / f64::from(self.path_splitting);
            for number in 0..self.path_splitting {
                let (mut part, mut light) = (PathState { weight, ..*path }, light);
                let event = impact.send_on(hit, direction, &mut light, rng);
                observer.divides(number == 0, weight);
                if self.go_on(&mut part, met, &event, rng, tally, observer) {
                    observer.carries(&light.stokes());
                    more += self.beyond(part, light, rng, tally, observer);
                }
            }
            return Some(more);
        }
        let ways = both_ways(hit, &impact.patch.optics, direction, impact.normal, light)?;
        if ways
            .iter()
            .any(|way| path.weight * way.part < self.roulette_below)
        {
            return None;
        }
        // What rounding leaves goes with the second.
        let first = path.weight * ways[0].part;
        let weights = [first, path.weight - first];
        for (number, (way, weight)) in ways.iter().zip(weights).enumerate() {
            let mut part = PathState { weight, ..*path };
            observer.divides(number == 0, weight);
            if self.go_on(&mut part, met, &way.event, rng, tally, observer) {
                observer.carries(&way.light.stokes());
                more += self.beyond(part, way.light, rng, tally, observer);
            }
        }
        Some(more)
    }

    /// Follows a part to its end; returns how many more surfaces it met.
    fn beyond<L: Light>(
        &self,
        part: PathState,
        light: L,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> u64 {
        let end = if self.scene.has_nested() {
            self.walk_stepwise(part, light, rng, tally, observer)
        } else {
            self.walk_as(part, light, rng, tally, observer)
        };
        end - u64::from(part.bounces)
    }

    /// Follows a ray from the middle of its path to its end in any scene, as [`Tracer::walk_as`] does in those where no instance stands in a solid among them;
    /// returns how many surfaces it met, those before included.
    #[inline(never)]
    pub fn walk_stepwise<L: Light>(
        &self,
        mut path: PathState,
        mut light: L,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> u64 {
        while path.bounces < self.max_bounces {
            let Some((hit, impact)) = self.meet(&mut path, rng, tally, observer) else {
                return u64::from(path.bounces);
            };
            let event = impact.send_on(&hit, path.ray.direction, &mut light, rng);
            if !self.go_on(&mut path, (&hit, impact), &event, rng, tally, observer) {
                return u64::from(path.bounces);
            }
            if L::CARRIED {
                observer.carries(&light.stokes());
            }
        }
        self.give_up(path, tally, observer)
    }

    /// Takes a ray to the nearest surface that borders the region where it flies; `None` where the path ends before.
    fn meet(
        &self,
        path: &mut PathState,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> Option<(Hit<'a>, Impact<'a>)> {
        let hit = self.scene.nearest_anywhere(
            &path.ray,
            path.location,
            Candidates {
                except: path.left,
                only: path.own,
            },
        );
        self.arrive(path, hit, rng, tally, observer)
    }

    /// Takes a ray to what it meets next; `None` where the path ends before.
    pub fn arrive(
        &self,
        path: &mut PathState,
        hit: Option<Hit<'a>>,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> Option<(Hit<'a>, Impact<'a>)> {
        let (ray, location, mut weight) = (path.ray, path.location, path.weight);
        let length = hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);

        // Leave to the medium what it absorbs on the way.
        let totals = &mut tally.totals;
        let medium = self.scene.medium(location);
        if medium.absorption > 0.0 {
            let before = weight;
            let passed = self.share(&mut weight, (-medium.absorption * length).exp(), rng);
            totals.ledger.media[medium.line] += passed;
            path.weight = weight;
            if weight == 0.0 {
                let fate = Fate::Medium(medium.line, length);
                observer.ends(&self.in_world(&ray, location), fate, before);
                return None;
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
            return None;
        };

        // Settle the point of impact exactly on the surface, in the frame of its body.
        let patch = &hit.surface.patches[hit.surface.shape.patch(hit.primitive) as usize];
        let at = ray.at(hit.distance);
        let at = self.scene.in_frame(at, location, hit.instance);
        let (point, normal) = hit.surface.shape.settle(at, hit.primitive);
        let impact = Impact {
            patch,
            point,
            normal,
        };
        Some((hit, impact))
    }

    /// Sends a ray on from where it has met a surface; whether its path goes on.
    pub fn go_on(
        &self,
        path: &mut PathState,
        (hit, impact): (&Hit<'a>, Impact<'a>),
        event: &ScatterEvent,
        rng: &mut impl Rng,
        tally: &mut Tally,
        observer: &mut impl Observer,
    ) -> bool {
        let Impact {
            patch,
            point,
            normal,
        } = impact;
        let (ray, location, mut weight) = (path.ray, path.location, path.weight);
        let totals = &mut tally.totals;
        let line = &mut totals.ledger.surfaces[patch.line];
        let before = weight;
        line.absorbed += self.share(&mut weight, event.share, rng);
        path.weight = weight;
        path.bounces += 1;
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
        if weight == 0.0 {
            let fate = Fate::Surface(patch.line);
            observer.ends(&self.in_world(&ray, location), fate, before);
            return false;
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
        (path.location, path.ray.origin) = match (hit.surface.region(event.side), hit.instance) {
            (Region::World, instance) if sound => {
                path.left = self.scene.leaves_for_good(instance);
                let around = self.scene.around(instance);
                (around, start + self.scene.position(instance))
            }
            (Region::Body(medium), Some(instance)) if sound => {
                path.left = None;
                (Location::Inside { instance, medium }, start)
            }
            _ => {
                lose(&mut totals.ledger, Loss::Invalid, weight);
                let ended = self.in_world(&ray, location);
                observer.ends(&ended, Fate::Lost(Loss::Invalid), weight);
                return false;
            }
        };
        path.ray.direction = event.direction;
        true
    }

    /// Ends a path that has met as many surfaces as it may; returns their number.
    fn give_up(&self, path: PathState, tally: &mut Tally, observer: &mut impl Observer) -> u64 {
        let weight = path.weight;
        lose(&mut tally.totals.ledger, Loss::Bounces, weight);
        let ended = self.in_world(&path.ray, path.location);
        observer.ends(&ended, Fate::Lost(Loss::Bounces), weight);
        u64::from(self.max_bounces)
    }
}
