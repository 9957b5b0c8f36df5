// SPDX-License-Identifier: MIT OR Apache-2.0
//! Accounting of a batch, path by path: absorption, single samples, the world between packages,
//! ends.

use bsdf::Side;
use bsdf::order_table::Flag;
use glam::DVec3;

use super::lanes::{Course, LANES, Mode};
use super::{BatchTracer, Events, PathBatch};
use crate::ledger::{Booking, Loss};
use crate::optics::polarisation::Unpolarised;
use crate::path::{PathState, Tracer, Walk};
use crate::ray::{Ray, lanes};
use crate::receiver::{PathHistory, Tally};
use crate::scatter::scatter;
use crate::scene::{Hit, Location};
use crate::surface::Region;

/// Continuation of a path after an interaction.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Next {
    /// It goes on in its lane.
    GoesOn,
    /// It is outside of its package and may meet something else.
    Crosses,
    /// It leaves the scene for good.
    Escapes,
    /// It has ended and is booked.
    Ends,
}

impl BatchTracer<'_> {
    /// Books the events of a step, and walks paths between packages; returns the lanes whose paths
    /// have ended.
    #[inline]
    pub(super) fn book(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        events: Events,
        tally: &mut Tally<'_>,
    ) -> u64 {
        let observed = tracer.receivers.observe_interactions();
        if observed {
            batch.arrived = batch.weight;
            batch.came_inside = batch.lanes.inside;
        }
        let leaving = events.left | events.gone;
        let (mut ended, mut escaping, mut crossing) = (leaving, 0, 0);
        for lane in lanes(events.mirrored) {
            self.mirror(tracer, batch, lane, tally);
            ended |= u64::from(batch.weight[lane] == 0.0) << lane;
        }
        for lane in lanes(events.other) {
            let next = self.go_on(tracer, batch, lane, tally);
            ended |= u64::from(matches!(next, Next::Ends | Next::Escapes)) << lane;
            escaping |= u64::from(next == Next::Escapes) << lane;
            crossing |= u64::from(next == Next::Crosses) << lane;
        }
        for lane in lanes(events.left) {
            let line = self.primitives[batch.lanes.primitive[lane] as usize].patch.line;
            let (sides, weight) = ([Side::Inner, Side::Outer], batch.weight[lane]);
            tally.book(Booking::Interaction { line, sides, absorbed: 0.0, weight });
        }
        if observed {
            for lane in lanes(events.met) {
                self.observe(batch, lane, events.left >> lane & 1 == 1, tally);
            }
        }
        for lane in lanes(escaping).chain(lanes(leaving)) {
            let (ray, weight) = (self.world_ray(batch, lane), batch.weight[lane]);
            tally.segment(&ray, f64::INFINITY, weight, &batch.past(lane), &Unpolarised);
            tally.escape(ray.direction, weight);
        }
        for lane in lanes(crossing) {
            ended |= u64::from(!self.cross(tracer, batch, lane, tally)) << lane;
        }
        ended
    }

    /// The ray of a lane outside of its package, in the frame of the world.
    #[inline]
    pub(super) fn world_ray(&self, batch: &PathBatch, lane: usize) -> Ray {
        let mut ray = batch.lanes.ray(lane);
        ray.origin += self.scene.position(Some(batch.instance[lane]));
        ray
    }

    /// Shows an interaction to the receivers and notes it in the past of the path.
    fn observe(&self, batch: &mut PathBatch, lane: usize, left: bool, tally: &mut Tally<'_>) {
        let line = self.primitives[batch.lanes.primitive[lane] as usize].patch.line;
        let from = batch.lanes.side(lane);
        let crossed = batch.lanes.inside[lane] != batch.came_inside[lane];
        let through = left || crossed;
        let sides = [from, if through { from.opposite() } else { from }];
        let weights = [batch.arrived[lane], batch.weight[lane]];
        let mut before = batch.past(lane);
        before.bounces -= 1;
        tally.interaction(line, sides, weights, &before);
        batch.history[lane].line = line as u32;
        batch.history[lane].at = [0, 1].map(|axis| batch.lanes.point[axis][lane]);
    }

    /// Takes from a path what the mirror that it met absorbs.
    #[inline]
    fn mirror(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        lane: usize,
        tally: &mut Tally<'_>,
    ) {
        let primitive = &self.primitives[batch.lanes.primitive[lane] as usize];
        let mut stream = batch.lanes.stream(lane);
        let (line, sides) = (primitive.patch.line, [batch.lanes.side(lane); 2]);
        let weight = &mut batch.weight[lane];
        tracer.settle(line, sides, primitive.reflectance, weight, &mut stream, tally);
        batch.lanes.keep(lane, stream);
    }

    /// Books any other event of a path.
    #[inline(never)]
    fn go_on(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        lane: usize,
        tally: &mut Tally<'_>,
    ) -> Next {
        let inside = batch.lanes.inside[lane].is_set();
        let mode = batch.lanes.mode[lane];
        if batch.weight[lane] == 0.0 {
            // The medium took it.
            return Next::Ends;
        }
        if !mode.is_met() {
            tally.lose(Loss::Leak, batch.weight[lane]);
            return Next::Ends;
        }
        let number = batch.lanes.primitive[lane] as usize;
        let mut back = batch.lanes.course[lane] == Course::BACK;
        if mode == Mode::MIRROR {
            self.mirror(tracer, batch, lane, tally);
        } else if mode == Mode::OTHER {
            let Some(stays) = self.scatter(tracer, batch, (lane, number), tally) else {
                return Next::Ends;
            };
            back = stays;
        } else {
            let side = batch.lanes.side(lane);
            let sides = [side, if back { side } else { side.opposite() }];
            let absorbs = batch.lanes.course[lane] == Course::ABSORBED;
            let arrived = batch.weight[lane];
            let weight = if absorbs { 0.0 } else { arrived };
            let line = self.primitives[number].patch.line;
            tally.book(Booking::Interaction { line, sides, absorbed: arrived - weight, weight });
            batch.weight[lane] = weight;
        }
        if batch.weight[lane] == 0.0 {
            return Next::Ends;
        }
        if !back {
            batch.lanes.inside[lane] = Flag::new(!inside);
        }
        if batch.lanes.bounces[lane] >= tracer.max_bounces.into() {
            tally.lose(Loss::Bounces, batch.weight[lane]);
            return Next::Ends;
        }
        if !batch.lanes.inside[lane].is_set() {
            let ray = batch.lanes.ray(lane);
            let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
            if !self.exit.is_free(o, d) {
                return Next::Crosses;
            }
            if self.exit.is_away(o, d) {
                return Next::Escapes;
            }
        }
        Next::GoesOn
    }

    /// Lets a surface that is neither mirror nor interface draw; whether the ray stays on its side,
    /// `None` if it ended.
    fn scatter(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        (lane, number): (usize, usize),
        tally: &mut Tally<'_>,
    ) -> Option<bool> {
        let lanes = &mut batch.lanes;
        let primitive = &self.primitives[number];
        let at = |list: &[[f64; LANES]; 3]| DVec3::new(list[0][lane], list[1][lane], list[2][lane]);
        let (point, normal) = (at(&lanes.origin), at(&lanes.normal));
        let side = lanes.side(lane);
        let hit = Hit {
            distance: lanes.distance[lane],
            surface: primitive.surface,
            primitive: primitive.number,
            side,
            instance: Some(batch.instance[lane]),
        };
        let mut stream = lanes.stream(lane);
        let direction = at(&lanes.direction);
        let in_world = || point + tracer.scene.position(hit.instance);
        let optics = primitive.patch.optics.at(in_world, &mut stream);
        let event = scatter(&hit, optics, direction, point, normal, &mut Unpolarised, &mut stream);
        let (line, sides) = (primitive.patch.line, [side, event.side]);
        let weight = &mut batch.weight[lane];
        tracer.settle(line, sides, event.efficiency, weight, &mut stream, tally);
        lanes.keep(lane, stream);
        if batch.weight[lane] == 0.0 {
            return None;
        }
        let region = primitive.surface.region(event.side);
        if !event.sound(normal) || region == Region::Opaque {
            tally.lose(Loss::Invalid, batch.weight[lane]);
            return None;
        }
        let start = point + normal * (event.side.sign() * self.geometry.offset);
        let ray = Ray { origin: start, direction: event.direction };
        lanes.put(lane, &ray);
        Some(event.side == side)
    }

    /// Follows a path outside of its package by the walker's steps until it enters a package or
    /// ends; whether it goes on in its lane.
    fn cross(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        lane: usize,
        tally: &mut Tally<'_>,
    ) -> bool {
        let instance = Some(batch.instance[lane]);
        let path = PathState {
            ray: self.world_ray(batch, lane),
            location: Location::World,
            left: self.scene.convex_exit(instance),
            own: self.scene.only_candidate(instance),
            weight: batch.weight[lane],
            scatterings: batch.scatterings[lane],
            wavelength: 0,
            history: batch.past(lane),
        };
        let before = path.history.bounces;
        let mut stream = batch.lanes.stream(lane);
        let (light, rng, observer) = (&mut Unpolarised, &mut stream, &mut ());
        let walk = Walk { tracer, path, light, rng, tally, observer };
        let (path, entered) = walk.follow_to_body();
        batch.crossed += u64::from(path.history.bounces - before);
        let Some(instance) = entered else {
            return false;
        };
        batch.lanes.keep(lane, stream);
        batch.weight[lane] = path.weight;
        batch.scatterings[lane] = path.scatterings;
        batch.history[lane] = path.history;
        batch.lanes.bounces[lane] = path.history.bounces.into();
        batch.lanes.put(lane, &path.ray);
        batch.instance[lane] = instance;
        batch.lanes.inside[lane] = Flag::YES;
        true
    }
}

impl PathBatch {
    /// Past of a path, for filters.
    #[inline]
    pub(super) fn past(&self, lane: usize) -> PathHistory {
        PathHistory { bounces: self.lanes.bounces[lane].get(), ..self.history[lane] }
    }
}
