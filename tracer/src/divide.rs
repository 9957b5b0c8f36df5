// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths that divide at the first surface that lets light through.
//!
//! In: a ray that begins. Up to its first interface, film or scattering table that does not reflect totally it goes as any other. There it divides: an
//! interface or a film sends on both what it reflects and what it refracts, each with its share of the weight; a table is drawn from several times, each
//! draw with the same part of the weight. Each part goes on by itself to its end, and divides no more. Weights of the parts add up to that of the whole, so
//! that the books of every path balance as before; they are the expectations of what is drawn otherwise, so that no mean changes. Where the reflected or the
//! refracted part would fall below the threshold of the roulette, one of both is drawn and takes all. Parts of one path depend on each other;
//! they end in the same group, from whose scatter errors follow.

use rand::Rng;

use crate::path::{Books, Flight, Met, Tracer};
use crate::polarization::Light;
use crate::ray::Ray;
use crate::scatter::{both_ways, scatter};
use crate::scene::Place;
use crate::surface::Optics;
use crate::witness::Witness;

impl Tracer<'_> {
    /// Follows one ray of weight 1 and all parts of its path to their ends; returns how many surfaces they met, the one where the path divided once.
    pub fn follow_dividing<L: Light>(
        &self,
        ray: Ray,
        place: Place,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> u64 {
        let mut flight = self.begin(ray, place, books, witness);
        let mut light = L::default();
        for bounce in 0..self.max_bounces {
            let Some(met) = self.meet(&mut flight, rng, books, witness) else {
                return u64::from(bounce);
            };
            if let Some(more) = self.divide(&flight, &met, light, rng, books, witness) {
                return u64::from(bounce) + 1 + more;
            }
            let onward = scatter(
                &met.hit,
                &met.part.optics,
                flight.ray.direction,
                met.point,
                met.normal,
                &mut light,
                rng,
            );
            if !self.go_on(&mut flight, &met, &onward, rng, books, witness) {
                return u64::from(bounce) + 1;
            }
        }
        self.give_up(&flight, books, witness)
    }

    /// Divides a path, if the surface lets light through, and follows its parts; returns how many surfaces they met beyond this one.
    fn divide<L: Light>(
        &self,
        flight: &Flight,
        met: &Met<'_>,
        light: L,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> Option<u64> {
        let mut more = 0;
        let direction = flight.ray.direction;
        if let Optics::Scatter(_) = &met.part.optics {
            let weight = flight.weight / f64::from(self.split);
            for number in 0..self.split {
                let (mut part, mut light) = (Flight { weight, ..*flight }, light);
                let onward = scatter(
                    &met.hit,
                    &met.part.optics,
                    direction,
                    met.point,
                    met.normal,
                    &mut light,
                    rng,
                );
                witness.divides(number == 0, weight);
                if self.go_on(&mut part, met, &onward, rng, books, witness) {
                    more += self.beyond(part, light, rng, books, witness);
                }
            }
            return Some(more);
        }
        let ways = both_ways(&met.hit, &met.part.optics, direction, met.normal, light)?;
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
        self.walk_as(part, light, rng, books, witness) - u64::from(part.bounces)
    }
}
