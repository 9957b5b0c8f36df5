// SPDX-License-Identifier: MIT OR Apache-2.0
//! Path splitting at the first surface that lets light through.
//!
//! An interface or a film sends on both what it reflects and what it refracts, each with its share
//! of the weight; a scattering table is sampled several times, each sample with the same part of
//! the weight. Every part goes on to its end and splits no more. The parts are the expectation of
//! what is drawn otherwise, and their weights add up to that of the whole, so no mean changes and
//! the ledger balances. Where one of two parts would fall below the threshold of the roulette,
//! chance gives all to one of them. The parts of a path depend on each other; they end in the same
//! group.

use rand::Rng;

use crate::observer::Observer;
use crate::optics::polarization::Light;
use crate::path::{Impact, PathState, Tracer};
use crate::receiver::Tally;
use crate::scatter::both_ways;
use crate::surface::SurfaceModel;

impl<'a> Tracer<'a> {
    /// Follows a path and its parts to their ends; returns how many surfaces they met, the one
    /// where the path split once.
    pub fn walk_splitting<L: Light>(
        &self,
        state: &mut PathState,
        mut light: L,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
        observer: &mut impl Observer,
    ) -> u64 {
        while state.history.bounces < self.max_bounces {
            let hit = self.intersect(state);
            let Some(impact) = self.arrive(state, hit, &light, rng, tally, observer) else {
                return u64::from(state.history.bounces);
            };
            if let Some(more) = self.split(state, &impact, light, rng, tally, observer) {
                return u64::from(state.history.bounces) + 1 + more;
            }
            let event = impact.scatter(state.ray.direction, &mut light, rng);
            if !self.go_on(state, &impact, &event, rng, tally, observer) {
                return u64::from(state.history.bounces);
            }
        }
        self.give_up(state, tally, observer);
        u64::from(state.history.bounces)
    }

    /// Splits a path, if the surface lets light through, and follows its parts; returns how many
    /// surfaces they met beyond this one.
    fn split<L: Light>(
        &self,
        state: &PathState,
        impact: &Impact<'a>,
        light: L,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
        observer: &mut impl Observer,
    ) -> Option<u64> {
        let mut more = 0;
        let direction = state.ray.direction;
        if let SurfaceModel::Scatter(_) = &impact.patch.optics {
            let weight = state.weight / f64::from(self.path_splitting);
            for _ in 0..self.path_splitting {
                let (mut part, mut light) = (PathState { weight, ..*state }, light);
                let event = impact.scatter(direction, &mut light, rng);
                if self.go_on(&mut part, impact, &event, rng, tally, observer) {
                    more += self.walk_part(part, light, rng, tally, observer);
                }
            }
            return Some(more);
        }
        let ways = both_ways(&impact.hit, &impact.patch.optics, direction, impact.normal, light)?;
        let small = |part: f64| self.plays_roulette(state.weight * part);
        if ways.iter().any(|way| small(way.part)) {
            return None;
        }
        // What rounding leaves goes with the second.
        let first = state.weight * ways[0].part;
        let weights = [first, state.weight - first];
        for (way, weight) in ways.iter().zip(weights) {
            let mut part = PathState { weight, ..*state };
            if self.go_on(&mut part, impact, &way.event, rng, tally, observer) {
                more += self.walk_part(part, way.light, rng, tally, observer);
            }
        }
        Some(more)
    }

    /// Follows a part to its end; returns how many more surfaces it met.
    fn walk_part<L: Light>(
        &self,
        mut part: PathState,
        light: L,
        rng: &mut impl Rng,
        tally: &mut Tally<'_>,
        observer: &mut impl Observer,
    ) -> u64 {
        let before = part.history.bounces;
        self.walk(&mut part, light, rng, tally, observer);
        u64::from(part.history.bounces - before)
    }
}
