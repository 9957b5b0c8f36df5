// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths that divide at the first surface that lets light through.
//!
//! In: a ray that begins. Up to its first interface, film or scattering table that does not reflect totally it goes as any other. There it divides: an
//! interface or a film sends on both what it reflects and what it refracts, each with its share of the weight; a table is drawn from several times, each
//! draw with the same part of the weight. Each part goes on by itself to its end, and divides no more. Weights of the parts add up to that of the whole, so
//! that the books of every path balance as before; they are the expectations of what is drawn otherwise, so that no mean changes. Where the reflected or the
//! refracted part would fall below the threshold of the roulette, one of both is drawn and takes all. Parts of one path depend on each other;
//! they end in the same group, from whose scatter errors follow.
//!
//! The steps of a flight are those of [`Tracer::walk_until`], in a loop that stops between them: the loop of whole paths, built of the same steps, was 8 % slower.
//! Whole paths among instances in solids go by these steps too, so that those without pay nothing for them.

use bsdf::Side;
use glam::DVec3;
use rand::Rng;

use crate::ledger::Loss;
use crate::path::{Books, Flight, Tracer, lose};
use crate::polarization::Light;
use crate::ray::Ray;
use crate::scatter::{Onward, both_ways, scatter};
use crate::scene::{Hit, Place, ReadyPart, Slot};
use crate::surface::{Optics, Region};
use crate::witness::{Fate, Meeting, Witness};

/// Where a ray has met a surface.
#[derive(Clone, Copy)]
pub(crate) struct Impact<'a> {
    pub part: &'a ReadyPart,
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
    ) -> Onward {
        let optics = &self.part.optics;
        scatter(hit, optics, direction, self.point, self.normal, light, rng)
    }
}

impl<'a> Tracer<'a> {
    /// Follows one ray of weight 1 and all parts of its path to their ends; returns how many surfaces they met, the one where the path divided once.
    pub fn follow_dividing<L: Light>(
        &self,
        ray: Ray,
        slot: &Slot,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> u64 {
        let mut flight = self.begin(ray, slot, books, witness);
        let mut light = L::default();
        for bounce in 0..self.max_bounces {
            let Some((hit, impact)) = self.meet(&mut flight, rng, books, witness) else {
                return u64::from(bounce);
            };
            let met = (&hit, impact);
            if let Some(more) = self.divide(&flight, met, light, rng, books, witness) {
                return u64::from(bounce) + 1 + more;
            }
            let onward = impact.send_on(&hit, flight.ray.direction, &mut light, rng);
            if !self.go_on(&mut flight, met, &onward, rng, books, witness) {
                return u64::from(bounce) + 1;
            }
            witness.carries(&light.stokes());
        }
        self.give_up(flight, books, witness)
    }

    /// Divides a path, if the surface lets light through, and follows its parts; returns how many surfaces they met beyond this one.
    fn divide<L: Light>(
        &self,
        flight: &Flight,
        met: (&Hit<'a>, Impact<'a>),
        light: L,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> Option<u64> {
        let (hit, impact) = met;
        let mut more = 0;
        let direction = flight.ray.direction;
        if let Optics::Scatter(_) = &impact.part.optics {
            let weight = flight.weight / f64::from(self.split);
            for number in 0..self.split {
                let (mut part, mut light) = (Flight { weight, ..*flight }, light);
                let onward = impact.send_on(hit, direction, &mut light, rng);
                witness.divides(number == 0, weight);
                if self.go_on(&mut part, met, &onward, rng, books, witness) {
                    witness.carries(&light.stokes());
                    more += self.beyond(part, light, rng, books, witness);
                }
            }
            return Some(more);
        }
        let ways = both_ways(hit, &impact.part.optics, direction, impact.normal, light)?;
        if ways
            .iter()
            .any(|way| flight.weight * way.part < self.roulette_below)
        {
            return None;
        }
        // What rounding leaves goes with the second.
        let first = flight.weight * ways[0].part;
        let weights = [first, flight.weight - first];
        for (number, (way, weight)) in ways.iter().zip(weights).enumerate() {
            let mut part = Flight { weight, ..*flight };
            witness.divides(number == 0, weight);
            if self.go_on(&mut part, met, &way.onward, rng, books, witness) {
                witness.carries(&way.light.stokes());
                more += self.beyond(part, way.light, rng, books, witness);
            }
        }
        Some(more)
    }

    /// Follows a part to its end; returns how many more surfaces it met.
    fn beyond<L: Light>(
        &self,
        part: Flight,
        light: L,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> u64 {
        let end = if self.scene.is_potted() {
            self.walk_stepwise(part, light, rng, books, witness)
        } else {
            self.walk_as(part, light, rng, books, witness)
        };
        end - u64::from(part.bounces)
    }

    /// Follows a ray from the middle of its path to its end in any scene, as [`Tracer::walk_as`] does in those where no instance stands in a solid among them;
    /// returns how many surfaces it met, those before included.
    #[inline(never)]
    pub fn walk_stepwise<L: Light>(
        &self,
        mut flight: Flight,
        mut light: L,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> u64 {
        while flight.bounces < self.max_bounces {
            let Some((hit, impact)) = self.meet(&mut flight, rng, books, witness) else {
                return u64::from(flight.bounces);
            };
            let onward = impact.send_on(&hit, flight.ray.direction, &mut light, rng);
            if !self.go_on(&mut flight, (&hit, impact), &onward, rng, books, witness) {
                return u64::from(flight.bounces);
            }
            if L::CARRIED {
                witness.carries(&light.stokes());
            }
        }
        self.give_up(flight, books, witness)
    }

    /// Takes a ray to the nearest surface that borders the region where it flies; `None` where the path ends before.
    fn meet(
        &self,
        flight: &mut Flight,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> Option<(Hit<'a>, Impact<'a>)> {
        let hit = self
            .scene
            .nearest_anywhere(&flight.ray, flight.place, [flight.left, flight.own]);
        self.arrive(flight, hit, rng, books, witness)
    }

    /// Takes a ray to what it meets next; `None` where the path ends before.
    pub fn arrive(
        &self,
        flight: &mut Flight,
        hit: Option<Hit<'a>>,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> Option<(Hit<'a>, Impact<'a>)> {
        let (ray, place, mut weight) = (flight.ray, flight.place, flight.weight);
        let length = hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);

        // Leave to the medium what it absorbs on the way.
        let totals = &mut books.totals;
        let medium = self.scene.medium(place);
        if medium.absorption > 0.0 {
            let before = weight;
            let passed = self.share(&mut weight, (-medium.absorption * length).exp(), rng);
            totals.ledger.media[medium.line] += passed;
            flight.weight = weight;
            if weight == 0.0 {
                let fate = Fate::Medium(medium.line, length);
                witness.ends(&self.in_world(&ray, place), fate, before);
                return None;
            }
        }

        // Show a flight through the world to the receivers.
        if place == Place::World {
            for (number, receiver) in &self.flights {
                if let Some(bin) = receiver.crossed(&ray, length) {
                    totals.readings[*number][bin] += weight;
                }
            }
        }

        // End where there is nothing more to meet: far away, or by a leak.
        let Some(hit) = hit else {
            self.end(&ray, place, weight, books, witness);
            return None;
        };

        // Settle the point of impact exactly on the surface, in the frame of its body.
        let part = &hit.surface.parts[hit.surface.shape.part(hit.piece) as usize];
        let at = ray.at(hit.distance);
        let at = self.scene.in_frame(at, place, hit.instance);
        let (point, normal) = hit.surface.shape.settle(at, hit.piece);
        let impact = Impact {
            part,
            point,
            normal,
        };
        Some((hit, impact))
    }

    /// Sends a ray on from where it has met a surface; whether its path goes on.
    pub fn go_on(
        &self,
        flight: &mut Flight,
        (hit, impact): (&Hit<'a>, Impact<'a>),
        onward: &Onward,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> bool {
        let Impact {
            part,
            point,
            normal,
        } = impact;
        let (ray, place, mut weight) = (flight.ray, flight.place, flight.weight);
        let totals = &mut books.totals;
        let line = &mut totals.ledger.surfaces[part.line];
        let before = weight;
        line.absorbed += self.share(&mut weight, onward.share, rng);
        flight.weight = weight;
        flight.bounces += 1;
        witness.meets(&Meeting {
            point: point + self.scene.position(hit.instance),
            line: part.line,
            instance: hit.instance,
            direction: ray.direction,
            from: hit.side,
            to: onward.side,
            arrived: before,
            weight,
        });
        if weight == 0.0 {
            let fate = Fate::Surface(part.line);
            witness.ends(&self.in_world(&ray, place), fate, before);
            return false;
        }

        // Note a passage to the other side.
        match (hit.side, onward.side) {
            (Side::Inner, Side::Outer) => line.outward += weight,
            (Side::Outer, Side::Inner) => line.inward += weight,
            (Side::Inner, Side::Inner) | (Side::Outer, Side::Outer) => {}
        }

        // Start anew, just off the surface, on the side on which the light goes on.
        let start =
            point + normal * (onward.side.sign() * self.scene.offset_from(hit.surface, point));
        let sound = onward.sound(normal);
        (flight.place, flight.ray.origin) = match (hit.surface.region(onward.side), hit.instance) {
            (Region::World, instance) if sound => {
                flight.left = self.scene.leaves_for_good(instance);
                let around = self.scene.around(instance);
                (around, start + self.scene.position(instance))
            }
            (Region::Body(medium), Some(instance)) if sound => {
                flight.left = None;
                (Place::Inside { instance, medium }, start)
            }
            _ => {
                lose(&mut totals.ledger, Loss::Invalid, weight);
                let ended = self.in_world(&ray, place);
                witness.ends(&ended, Fate::Lost(Loss::Invalid), weight);
                return false;
            }
        };
        flight.ray.direction = onward.direction;
        true
    }

    /// Ends a path that has met as many surfaces as it may; returns their number.
    fn give_up(&self, flight: Flight, books: &mut Books, witness: &mut impl Witness) -> u64 {
        let weight = flight.weight;
        lose(&mut books.totals.ledger, Loss::Bounces, weight);
        let ended = self.in_world(&flight.ray, flight.place);
        witness.ends(&ended, Fate::Lost(Loss::Bounces), weight);
        u64::from(self.max_bounces)
    }
}
