// SPDX-License-Identifier: MIT OR Apache-2.0
//! What happens to the rays of a convoy one by one: absorption, passage to the other side, surfaces that draw for themselves, the end.

use bsdf::Side;
use glam::DVec3;

use super::step::{LANES, mode};
use super::{Convoy, Crew, Fates, orders};
use crate::ledger::{Loss, SurfaceLine};
use crate::path::{Books, Flight, Tracer};
use crate::polarization::Unpolarised;
use crate::ray::{Ray, lanes};
use crate::scatter::scatter;
use crate::scene::{Hit, Place};
use crate::surface::Region;

impl Convoy<'_> {
    /// Books what became of the rays; those whose paths have ended.
    #[inline]
    pub(super) fn book(
        &self,
        tracer: &Tracer<'_>,
        crew: &mut Crew,
        fates: Fates,
        books: &mut Books,
        hits: &mut u64,
    ) -> u64 {
        let leaving = fates.left | fates.gone;
        let mut ended = leaving;
        for lane in lanes(fates.mirrored) {
            self.mirror(tracer, crew, lane, books);
            ended |= u64::from(crew.weight[lane] == 0.0) << lane;
        }
        for lane in lanes(fates.other) {
            let on = self.go_on(tracer, crew, lane, books, hits);
            ended |= u64::from(!on) << lane;
        }
        for lane in lanes(fates.left) {
            let piece = &self.pieces[crew.lanes.piece[lane] as usize];
            books.totals.ledger.surfaces[piece.part.line].outward += crew.weight[lane];
        }
        let rays = (&crew.lanes.origin, &crew.lanes.direction);
        let position = |lane: usize| self.scene.position(Some(crew.instance[lane]));
        tracer.leave_many(rays, &crew.weight, (leaving, position), books);
        ended
    }

    /// Takes from a ray what the mirror that it met absorbs.
    #[inline]
    fn mirror(&self, tracer: &Tracer<'_>, crew: &mut Crew, lane: usize, books: &mut Books) {
        let piece = &self.pieces[crew.lanes.piece[lane] as usize];
        let mut stream = crew.lanes.stream(lane);
        let absorbed = tracer.share(&mut crew.weight[lane], piece.reflectance, &mut stream);
        crew.lanes.keep(lane, stream);
        books.totals.ledger.surfaces[piece.part.line].absorbed += absorbed;
    }

    /// Books what happened to a ray; whether its path goes on in its lane.
    #[inline(never)]
    fn go_on(
        &self,
        tracer: &Tracer<'_>,
        crew: &mut Crew,
        lane: usize,
        books: &mut Books,
        hits: &mut u64,
    ) -> bool {
        let inside = crew.lanes.inside[lane] > 0.0;
        let mode = crew.lanes.mode[lane];
        if crew.weight[lane] == 0.0 {
            // The medium took it.
            return false;
        }
        if mode >= mode::NOTHING {
            books.totals.ledger.lost[Loss::Leak as usize] += crew.weight[lane];
            return false;
        }
        let number = crew.lanes.piece[lane] as usize;
        let piece = &self.pieces[number];
        let mut back = crew.lanes.back[lane] > 0.0;
        if mode == mode::MIRROR {
            self.mirror(tracer, crew, lane, books);
            if crew.weight[lane] == 0.0 {
                return false;
            }
        } else if mode == mode::ORDERS {
            if crew.lanes.back[lane] == orders::ABSORBED {
                let line = &mut books.totals.ledger.surfaces[piece.part.line];
                line.absorbed += crew.weight[lane];
                return false;
            }
        } else if mode == mode::OTHER {
            let Some(stays) = self.scatter(tracer, crew, (lane, number), books) else {
                return false;
            };
            back = stays;
        }
        if !back {
            let line: &mut SurfaceLine = &mut books.totals.ledger.surfaces[piece.part.line];
            if inside {
                line.outward += crew.weight[lane];
            } else {
                line.inward += crew.weight[lane];
            }
            crew.lanes.inside[lane] = if inside { 0.0 } else { 1.0 };
        }
        if crew.lanes.bounces[lane] >= f64::from(tracer.max_bounces) {
            books.totals.ledger.lost[Loss::Bounces as usize] += crew.weight[lane];
            return false;
        }
        if crew.lanes.inside[lane] == 0.0 {
            let o = [0, 1, 2].map(|axis| crew.lanes.origin[axis][lane]);
            let d = [0, 1, 2].map(|axis| crew.lanes.direction[axis][lane]);
            if !self.exit.is_free(o, d) {
                return self.hand_over(tracer, crew, lane, (books, hits));
            }
            if self.exit.is_away(o, d) {
                self.depart(tracer, crew, lane, books);
                return false;
            }
        }
        true
    }

    /// A ray that meets nothing more leaves the scene.
    #[inline]
    fn depart(&self, tracer: &Tracer<'_>, crew: &Crew, lane: usize, books: &mut Books) {
        let mut ray = crew.lanes.ray(lane);
        ray.origin += self.scene.position(Some(crew.instance[lane]));
        tracer.leave(&ray, crew.weight[lane], books);
    }

    /// Lets a surface that is neither mirror nor interface draw; whether the ray stays on its side, `None` if it ended.
    fn scatter(
        &self,
        tracer: &Tracer<'_>,
        crew: &mut Crew,
        (lane, number): (usize, usize),
        books: &mut Books,
    ) -> Option<bool> {
        let lanes = &mut crew.lanes;
        let piece = &self.pieces[number];
        let at = |list: &[[f64; LANES]; 3]| DVec3::new(list[0][lane], list[1][lane], list[2][lane]);
        let (point, normal) = (at(&lanes.origin), at(&lanes.normal));
        let side = if lanes.facing[lane] < 0.0 {
            Side::Inner
        } else {
            Side::Outer
        };
        let hit = Hit {
            distance: lanes.distance[lane],
            surface: piece.surface,
            piece: piece.number,
            side,
            instance: Some(crew.instance[lane]),
        };
        let mut stream = lanes.stream(lane);
        let direction = at(&lanes.direction);
        let onward = scatter(
            &hit,
            &piece.part.optics,
            direction,
            point,
            normal,
            &mut Unpolarised,
            &mut stream,
        );
        let ledger = &mut books.totals.ledger;
        let absorbed = tracer.share(&mut crew.weight[lane], onward.share, &mut stream);
        ledger.surfaces[piece.part.line].absorbed += absorbed;
        lanes.keep(lane, stream);
        if crew.weight[lane] == 0.0 {
            return None;
        }
        let beyond = piece.surface.region(onward.side);
        if !onward.sound(normal) || beyond == Region::Opaque {
            ledger.lost[Loss::Invalid as usize] += crew.weight[lane];
            return None;
        }
        let start = point + normal * (onward.side.sign() * self.frame.offset);
        let ray = Ray {
            origin: start,
            direction: onward.direction,
        };
        lanes.put(lane, &ray);
        Some(onward.side == side)
    }

    /// Follows a ray that has left its package until it ends, when this returns false, or enters a package, whose it is from then on.
    fn hand_over(
        &self,
        tracer: &Tracer<'_>,
        crew: &mut Crew,
        lane: usize,
        (books, hits): (&mut Books, &mut u64),
    ) -> bool {
        let instance = Some(crew.instance[lane]);
        let mut ray = crew.lanes.ray(lane);
        ray.origin += self.scene.position(instance);
        let before = crew.lanes.bounces[lane] as u32;
        let flight = Flight {
            ray,
            place: Place::World,
            left: self.scene.leaves_for_good(instance),
            own: self.scene.keeps_to(instance),
            weight: crew.weight[lane],
            bounces: before,
        };
        let mut stream = crew.lanes.stream(lane);
        let light = Unpolarised;
        let (met, entered) =
            tracer.walk_until::<_, true>(flight, light, &mut stream, books, &mut ());
        *hits += met - u64::from(before);
        let Some((flight, Place::Inside { instance, .. })) = entered.map(|f| (f, f.place)) else {
            return false;
        };
        crew.lanes.put(lane, &flight.ray);
        crew.lanes.inside[lane] = 1.0;
        crew.lanes.keep(lane, stream);
        crew.lanes.bounces[lane] = f64::from(flight.bounces);
        crew.weight[lane] = flight.weight;
        crew.instance[lane] = instance;
        true
    }
}
