// SPDX-License-Identifier: MIT OR Apache-2.0
//! One ray's life. The comments before the paragraphs of [`Tracer::follow`], read alone, are the algorithm.

use bsdf::Side;
use glam::DVec3;
use rand::Rng;

use crate::ledger::{Ledger, Loss};
use crate::outcome::Totals;
use crate::random;
use crate::ray::Ray;
use crate::receiver::Receiver;
use crate::scatter::scatter;
use crate::scene::{Place, Scene};
use crate::surface::Region;

/// What stays the same for all rays of a run.
pub(crate) struct Tracer<'a> {
    pub scene: &'a Scene,
    pub receivers: &'a [&'a dyn Receiver],
    pub max_bounces: u32,
    pub roulette_below: f64,
}

impl Tracer<'_> {
    /// Follows one ray of weight 1 to its end and books all of its power; hands what leaves the scene to `escaped`; returns how many
    /// surfaces it met.
    pub fn follow(
        &self,
        mut ray: Ray,
        mut place: Place,
        rng: &mut impl Rng,
        totals: &mut Totals,
        escaped: &mut impl FnMut(&Ray, f64),
    ) -> u64 {
        let mut weight = 1.0;
        totals.ledger.emitted += weight;
        for bounce in 0..self.max_bounces {
            // Find the nearest surface that borders the region where the ray flies.
            let hit = self.scene.nearest(&ray, place);
            let length = hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);

            // Leave to the medium what it absorbs on the way.
            let medium = self.scene.medium(place);
            if medium.absorption > 0.0 {
                let passed = self.share(&mut weight, (-medium.absorption * length).exp(), rng);
                totals.ledger.media[medium.line] += passed;
                if weight == 0.0 {
                    return u64::from(bounce);
                }
            }

            // Show a flight through the world to the receivers.
            if place == Place::World {
                self.record(totals, weight, |receiver| receiver.crossed(&ray, length));
            }

            // End where there is nothing more to meet: far away, or by a leak.
            let Some(hit) = hit else {
                self.end(&ray, place, weight, totals, escaped);
                return u64::from(bounce);
            };

            // Settle the point of impact exactly on the surface, in the frame of its body.
            let part = &hit.surface.parts[hit.surface.shape.part(hit.piece) as usize];
            let frame_of_ray = if place == Place::World {
                self.scene.position(hit.instance)
            } else {
                DVec3::ZERO
            };
            let (point, normal) = hit
                .surface
                .shape
                .settle(ray.at(hit.distance) - frame_of_ray, hit.piece);

            // Let the surface choose where the light goes on and how much of it; what is missing is absorbed.
            let onward = scatter(&hit, &part.optics, ray.direction, point, normal, rng);
            let line = &mut totals.ledger.surfaces[part.line];
            line.absorbed += self.share(&mut weight, onward.share, rng);
            if weight == 0.0 {
                return u64::from(bounce) + 1;
            }

            // Note a passage to the other side.
            match (hit.side, onward.side) {
                (Side::Inner, Side::Outer) => line.outward += weight,
                (Side::Outer, Side::Inner) => line.inward += weight,
                (Side::Inner, Side::Inner) | (Side::Outer, Side::Outer) => {}
            }

            // Start anew, just off the surface, on the side on which the light goes on.
            let start = point + normal * (onward.side.sign() * self.scene.offset());
            let sound = onward.sound(normal);
            (place, ray.origin) = match (hit.surface.region(onward.side), hit.instance) {
                (Region::World, instance) if sound => {
                    (Place::World, start + self.scene.position(instance))
                }
                (Region::Body(medium), Some(instance)) if sound => {
                    (Place::Inside { instance, medium }, start)
                }
                _ => {
                    lose(&mut totals.ledger, Loss::Invalid, weight);
                    return u64::from(bounce) + 1;
                }
            };
            ray.direction = onward.direction;
        }
        lose(&mut totals.ledger, Loss::Bounces, weight);
        u64::from(self.max_bounces)
    }

    /// Keeps `share` of the weight and returns what is absorbed. A weight that would fall below the threshold is kept or
    /// absorbed whole, by chance: the mean is the same, and the books of every single path balance.
    #[inline]
    fn share(&self, weight: &mut f64, share: f64, rng: &mut impl Rng) -> f64 {
        let before = *weight;
        if before * share >= self.roulette_below || share >= 1.0 {
            *weight = before * share;
        } else if random::unit(rng) >= share {
            *weight = 0.0;
        }
        before - *weight
    }

    #[inline]
    fn record(
        &self,
        totals: &mut Totals,
        weight: f64,
        bin: impl Fn(&dyn Receiver) -> Option<usize>,
    ) {
        for (receiver, reading) in self.receivers.iter().zip(&mut totals.readings) {
            if let Some(bin) = bin(*receiver) {
                reading[bin] += weight;
            }
        }
    }

    fn end(
        &self,
        ray: &Ray,
        place: Place,
        weight: f64,
        totals: &mut Totals,
        escaped: &mut impl FnMut(&Ray, f64),
    ) {
        if place != Place::World {
            return lose(&mut totals.ledger, Loss::Leak, weight);
        }
        self.record(totals, weight, |receiver| receiver.escaped(ray));
        escaped(ray, weight);
        if ray.direction.z >= 0.0 {
            totals.ledger.escaped_up += weight;
        } else {
            totals.ledger.escaped_down += weight;
        }
    }
}

fn lose(ledger: &mut Ledger, cause: Loss, weight: f64) {
    ledger.lost[cause as usize] += weight;
}
