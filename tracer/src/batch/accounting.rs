// SPDX-License-Identifier: MIT OR Apache-2.0
//! What happens to the rays of a batch one by one: absorption, passage to the other side, surfaces that draw for themselves, the end.

use bsdf::Side;
use glam::DVec3;

use super::kernels::{LANES, mode};
use super::{BatchTracer, Fates, PathBatch, orders};
use crate::ledger::{Loss, SurfaceLine};
use crate::optics::polarization::Unpolarised;
use crate::path::{PathState, Tally, Tracer};
use crate::ray::{Ray, lanes};
use crate::scatter::scatter;
use crate::scene::{Hit, Location};
use crate::surface::Region;

impl BatchTracer<'_> {
    /// Counts what became of the rays; those whose paths have ended.
    #[inline]
    pub(super) fn book(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        fates: Fates,
        tally: &mut Tally,
        hits: &mut u64,
    ) -> u64 {
        let leaving = fates.left | fates.gone;
        let mut ended = leaving;
        for lane in lanes(fates.mirrored) {
            self.mirror(tracer, batch, lane, tally);
            ended |= u64::from(batch.weight[lane] == 0.0) << lane;
        }
        for lane in lanes(fates.other) {
            let on = self.go_on(tracer, batch, lane, tally, hits);
            ended |= u64::from(!on) << lane;
        }
        for lane in lanes(fates.left) {
            let primitive = &self.primitives[batch.lanes.primitive[lane] as usize];
            tally.totals.ledger.surfaces[primitive.patch.line].outward += batch.weight[lane];
        }
        let rays = (&batch.lanes.origin, &batch.lanes.direction);
        let position = |lane: usize| self.scene.position(Some(batch.instance[lane]));
        tracer.leave_many(rays, &batch.weight, (leaving, position), tally);
        ended
    }

    /// Takes from a ray what the mirror that it met absorbs.
    #[inline]
    fn mirror(&self, tracer: &Tracer<'_>, batch: &mut PathBatch, lane: usize, tally: &mut Tally) {
        let primitive = &self.primitives[batch.lanes.primitive[lane] as usize];
        let mut stream = batch.lanes.stream(lane);
        let absorbed = tracer.share(&mut batch.weight[lane], primitive.reflectance, &mut stream);
        batch.lanes.keep(lane, stream);
        tally.totals.ledger.surfaces[primitive.patch.line].absorbed += absorbed;
    }

    /// Counts what happened to a ray; whether its path goes on in its lane.
    #[inline(never)]
    fn go_on(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        lane: usize,
        tally: &mut Tally,
        hits: &mut u64,
    ) -> bool {
        let inside = batch.lanes.inside[lane] > 0.0;
        let mode = batch.lanes.mode[lane];
        if batch.weight[lane] == 0.0 {
            // The medium took it.
            return false;
        }
        if mode >= mode::NOTHING {
            tally.totals.ledger.lost[Loss::Leak as usize] += batch.weight[lane];
            return false;
        }
        let number = batch.lanes.primitive[lane] as usize;
        let primitive = &self.primitives[number];
        let mut back = batch.lanes.back[lane] > 0.0;
        if mode == mode::MIRROR {
            self.mirror(tracer, batch, lane, tally);
            if batch.weight[lane] == 0.0 {
                return false;
            }
        } else if mode == mode::ORDERS {
            if batch.lanes.back[lane] == orders::ABSORBED {
                let line = &mut tally.totals.ledger.surfaces[primitive.patch.line];
                line.absorbed += batch.weight[lane];
                return false;
            }
        } else if mode == mode::OTHER {
            let Some(stays) = self.scatter(tracer, batch, (lane, number), tally) else {
                return false;
            };
            back = stays;
        }
        if !back {
            let line: &mut SurfaceLine = &mut tally.totals.ledger.surfaces[primitive.patch.line];
            if inside {
                line.outward += batch.weight[lane];
            } else {
                line.inward += batch.weight[lane];
            }
            batch.lanes.inside[lane] = if inside { 0.0 } else { 1.0 };
        }
        if batch.lanes.bounces[lane] >= f64::from(tracer.max_bounces) {
            tally.totals.ledger.lost[Loss::Bounces as usize] += batch.weight[lane];
            return false;
        }
        if batch.lanes.inside[lane] == 0.0 {
            let o = [0, 1, 2].map(|axis| batch.lanes.origin[axis][lane]);
            let d = [0, 1, 2].map(|axis| batch.lanes.direction[axis][lane]);
            if !self.exit.is_free(o, d) {
                return self.hand_over(tracer, batch, lane, (tally, hits));
            }
            if self.exit.is_away(o, d) {
                self.depart(tracer, batch, lane, tally);
                return false;
            }
        }
        true
    }

    /// A ray that meets nothing more leaves the scene.
    #[inline]
    fn depart(&self, tracer: &Tracer<'_>, batch: &PathBatch, lane: usize, tally: &mut Tally) {
        let mut ray = batch.lanes.ray(lane);
        ray.origin += self.scene.position(Some(batch.instance[lane]));
        tracer.leave(&ray, batch.weight[lane], tally);
    }

    /// Lets a surface that is neither mirror nor interface draw; whether the ray stays on its side, `None` if it ended.
    fn scatter(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        (lane, number): (usize, usize),
        tally: &mut Tally,
    ) -> Option<bool> {
        let lanes = &mut batch.lanes;
        let primitive = &self.primitives[number];
        let at = |list: &[[f64; LANES]; 3]| DVec3::new(list[0][lane], list[1][lane], list[2][lane]);
        let (point, normal) = (at(&lanes.origin), at(&lanes.normal));
        let side = if lanes.facing[lane] < 0.0 {
            Side::Inner
        } else {
            Side::Outer
        };
        let hit = Hit {
            distance: lanes.distance[lane],
            surface: primitive.surface,
            primitive: primitive.number,
            side,
            instance: Some(batch.instance[lane]),
        };
        let mut stream = lanes.stream(lane);
        let direction = at(&lanes.direction);
        let event = scatter(
            &hit,
            &primitive.patch.optics,
            direction,
            point,
            normal,
            &mut Unpolarised,
            &mut stream,
        );
        let ledger = &mut tally.totals.ledger;
        let absorbed = tracer.share(&mut batch.weight[lane], event.share, &mut stream);
        ledger.surfaces[primitive.patch.line].absorbed += absorbed;
        lanes.keep(lane, stream);
        if batch.weight[lane] == 0.0 {
            return None;
        }
        let beyond = primitive.surface.region(event.side);
        if !event.sound(normal) || beyond == Region::Opaque {
            ledger.lost[Loss::Invalid as usize] += batch.weight[lane];
            return None;
        }
        let start = point + normal * (event.side.sign() * self.frame.offset);
        let ray = Ray {
            origin: start,
            direction: event.direction,
        };
        lanes.put(lane, &ray);
        Some(event.side == side)
    }

    /// Follows a ray that has left its package until it ends, when this returns false, or enters a package, whose it is from then on.
    fn hand_over(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        lane: usize,
        (tally, hits): (&mut Tally, &mut u64),
    ) -> bool {
        let instance = Some(batch.instance[lane]);
        let mut ray = batch.lanes.ray(lane);
        ray.origin += self.scene.position(instance);
        let before = batch.lanes.bounces[lane] as u32;
        let path = PathState {
            ray,
            location: Location::World,
            left: self.scene.leaves_for_good(instance),
            own: self.scene.keeps_to(instance),
            weight: batch.weight[lane],
            bounces: before,
        };
        let mut stream = batch.lanes.stream(lane);
        let light = Unpolarised;
        let (met, entered) = tracer.walk_until::<_, true>(path, light, &mut stream, tally, &mut ());
        *hits += met - u64::from(before);
        let Some((path, Location::Inside { instance, .. })) = entered.map(|f| (f, f.location))
        else {
            return false;
        };
        batch.lanes.put(lane, &path.ray);
        batch.lanes.inside[lane] = 1.0;
        batch.lanes.keep(lane, stream);
        batch.lanes.bounces[lane] = f64::from(path.bounces);
        batch.weight[lane] = path.weight;
        batch.instance[lane] = instance;
        true
    }
}
