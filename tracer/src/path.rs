// SPDX-License-Identifier: MIT OR Apache-2.0
//! One ray's life. The comments before the paragraphs of [`Tracer::meet`], [`Tracer::walk_as`] and [`Tracer::go_on`], read alone, are the algorithm.

use bsdf::Side;
use glam::DVec3;
use rand::Rng;

use crate::ledger::{Ledger, Loss};
use crate::outcome::Totals;
use crate::polarization::{Light, Polarization};
use crate::random;
use crate::ray::Ray;
use crate::receiver::{Flock, Receiver};
use crate::run::{Sampling, Settings};
use crate::scatter::{Onward, scatter};
use crate::scene::{Hit, Place, ReadyPart, Scene};
use crate::surface::Region;
use crate::witness::{Fate, Meeting, Witness};

/// Receivers with their places among the readings.
type Numbered<'a> = Vec<(usize, &'a dyn Receiver)>;

/// What stays the same for all rays of a run.
pub(crate) struct Tracer<'a> {
    pub scene: &'a Scene,
    /// Bins of every receiver.
    pub bins: Vec<usize>,
    /// Receivers that ask for flights through the world.
    flights: Numbered<'a>,
    /// Receivers that ask for escapes.
    escapes: Numbered<'a>,
    pub max_bounces: u32,
    pub roulette_below: f64,
    /// Parts into which a path divides at the first surface that lets light through; 1 for none.
    pub split: u32,
    pub polarization: Polarization,
    pub sampling: Sampling,
}

/// The sums of a group of paths, and the rays that wait to be sorted into them.
pub(crate) struct Books {
    pub totals: Totals,
    pub leaving: Flock,
}

impl Books {
    pub fn new(tracer: &Tracer<'_>) -> Self {
        Self {
            totals: Totals {
                ledger: Ledger::new(&tracer.scene.lines),
                readings: tracer.bins.iter().map(|&bins| vec![0.0; bins]).collect(),
            },
            leaving: Flock::default(),
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
pub(crate) struct Flight {
    pub ray: Ray,
    pub place: Place,
    /// An instance that it cannot meet before something else.
    pub left: Option<u32>,
    pub weight: f64,
    /// Surfaces met so far.
    pub bounces: u32,
}

/// Where a ray has met a surface.
pub(crate) struct Met<'a> {
    pub hit: Hit<'a>,
    pub part: &'a ReadyPart,
    /// On the surface, in the frame of its body.
    pub point: DVec3,
    /// The unit normal n there.
    pub normal: DVec3,
}

impl<'a> Tracer<'a> {
    pub fn new(scene: &'a Scene, receivers: &[&'a dyn Receiver], settings: &Settings) -> Self {
        let numbered = receivers.iter().copied().enumerate();
        Self {
            scene,
            bins: receivers.iter().map(|receiver| receiver.bins()).collect(),
            flights: numbered.clone().filter(|(_, r)| r.asks().flights).collect(),
            escapes: numbered.filter(|(_, r)| r.asks().escapes).collect(),
            max_bounces: settings.max_bounces,
            roulette_below: settings.roulette_below,
            split: settings.split,
            polarization: settings.polarization,
            sampling: settings.sampling,
        }
    }

    /// Follows one ray of weight 1 to its end and books all of its power; shows it to `witness`; returns how many
    /// surfaces it met.
    #[inline]
    pub fn follow<L: Light>(
        &self,
        ray: Ray,
        place: Place,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> u64 {
        let flight = self.begin(ray, place, books, witness);
        self.walk::<L>(flight, rng, books, witness)
    }

    /// A path of weight 1.
    #[inline]
    pub fn begin(
        &self,
        ray: Ray,
        place: Place,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> Flight {
        books.totals.ledger.emitted += 1.0;
        witness.begins(&self.in_world(&ray, place));
        Flight {
            ray,
            place,
            left: None,
            weight: 1.0,
            bounces: 0,
        }
    }

    /// Follows a ray from the middle of its path to its end, as unpolarised light at first; returns how many surfaces it met, those before included.
    #[inline]
    pub fn walk<L: Light>(
        &self,
        flight: Flight,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> u64 {
        self.walk_as(flight, L::default(), rng, books, witness)
    }

    /// The same of light of this polarisation.
    #[inline]
    pub fn walk_as<L: Light>(
        &self,
        mut flight: Flight,
        mut light: L,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> u64 {
        for bounce in flight.bounces..self.max_bounces {
            let Some(met) = self.meet(&mut flight, rng, books, witness) else {
                return u64::from(bounce);
            };
            // Let the surface choose where the light goes on and how much of it; what is missing is absorbed.
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

    /// Takes a ray to the nearest surface that borders the region where it flies; `None` where the path ends before.
    #[expect(
        clippy::inline_always,
        reason = "half of the loop over a path, which is compiled as one"
    )]
    #[inline(always)]
    pub fn meet(
        &self,
        flight: &mut Flight,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> Option<Met<'a>> {
        let (ray, place) = (flight.ray, flight.place);
        let hit = self.scene.nearest(&ray, place, flight.left);
        let length = hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);

        // Leave to the medium what it absorbs on the way.
        let totals = &mut books.totals;
        let medium = self.scene.medium(place);
        if medium.absorption > 0.0 {
            let before = flight.weight;
            let passed = self.share(&mut flight.weight, (-medium.absorption * length).exp(), rng);
            totals.ledger.media[medium.line] += passed;
            if flight.weight == 0.0 {
                let fate = Fate::Medium(medium.line, length);
                witness.ends(&self.in_world(&ray, place), fate, before);
                return None;
            }
        }

        // Show a flight through the world to the receivers.
        if place == Place::World {
            for (number, receiver) in &self.flights {
                if let Some(bin) = receiver.crossed(&ray, length) {
                    totals.readings[*number][bin] += flight.weight;
                }
            }
        }

        // End where there is nothing more to meet: far away, or by a leak.
        let Some(hit) = hit else {
            self.end(&ray, place, flight.weight, books, witness);
            return None;
        };

        // Settle the point of impact exactly on the surface, in the frame of its body.
        let part = &hit.surface.parts[hit.surface.shape.part(hit.piece) as usize];
        let at = ray.at(hit.distance);
        let at = match (place, hit.instance) {
            (Place::World, Some(_)) => at - self.scene.position(hit.instance),
            _ => at,
        };
        let (point, normal) = hit.surface.shape.settle(at, hit.piece);
        Some(Met {
            hit,
            part,
            point,
            normal,
        })
    }

    /// Sends a ray on from where it has met a surface; whether its path goes on.
    #[expect(
        clippy::inline_always,
        reason = "half of the loop over a path, which is compiled as one"
    )]
    #[inline(always)]
    pub fn go_on(
        &self,
        flight: &mut Flight,
        met: &Met<'_>,
        onward: &Onward,
        rng: &mut impl Rng,
        books: &mut Books,
        witness: &mut impl Witness,
    ) -> bool {
        let Met {
            hit,
            part,
            point,
            normal,
        } = met;
        let totals = &mut books.totals;
        let line = &mut totals.ledger.surfaces[part.line];
        let before = flight.weight;
        line.absorbed += self.share(&mut flight.weight, onward.share, rng);
        let weight = flight.weight;
        flight.bounces += 1;
        witness.meets(&Meeting {
            point: *point + self.scene.position(hit.instance),
            line: part.line,
            instance: hit.instance,
            direction: flight.ray.direction,
            from: hit.side,
            to: onward.side,
            arrived: before,
            weight,
        });
        if weight == 0.0 {
            let fate = Fate::Surface(part.line);
            witness.ends(&self.in_world(&flight.ray, flight.place), fate, before);
            return false;
        }

        // Note a passage to the other side.
        match (hit.side, onward.side) {
            (Side::Inner, Side::Outer) => line.outward += weight,
            (Side::Outer, Side::Inner) => line.inward += weight,
            (Side::Inner, Side::Inner) | (Side::Outer, Side::Outer) => {}
        }

        // Start anew, just off the surface, on the side on which the light goes on.
        let start = *point + *normal * (onward.side.sign() * self.scene.offset());
        let sound = onward.sound(*normal);
        (flight.place, flight.ray.origin) = match (hit.surface.region(onward.side), hit.instance) {
            (Region::World, instance) if sound => {
                flight.left = self.scene.leaves_for_good(instance);
                (Place::World, start + self.scene.position(instance))
            }
            (Region::Body(medium), Some(instance)) if sound => {
                (Place::Inside { instance, medium }, start)
            }
            _ => {
                lose(&mut totals.ledger, Loss::Invalid, weight);
                let ended = self.in_world(&flight.ray, flight.place);
                witness.ends(&ended, Fate::Lost(Loss::Invalid), weight);
                return false;
            }
        };
        flight.ray.direction = onward.direction;
        true
    }

    /// Ends a path that has met as many surfaces as it may; returns their number.
    #[inline]
    pub fn give_up(&self, flight: &Flight, books: &mut Books, witness: &mut impl Witness) -> u64 {
        let weight = flight.weight;
        lose(&mut books.totals.ledger, Loss::Bounces, weight);
        let ended = self.in_world(&flight.ray, flight.place);
        witness.ends(&ended, Fate::Lost(Loss::Bounces), weight);
        u64::from(self.max_bounces)
    }

    /// A ray that flies in `place` in the frame of the world.
    #[inline]
    fn in_world(&self, ray: &Ray, place: Place) -> Ray {
        let position = match place {
            Place::World => DVec3::ZERO,
            Place::Inside { instance, .. } => self.scene.position(Some(instance)),
        };
        Ray {
            origin: ray.origin + position,
            direction: ray.direction,
        }
    }

    /// Keeps `share` of the weight and returns what is absorbed. A weight that would fall below the threshold is kept or
    /// absorbed whole, by chance: the mean is the same, and the books of every single path balance.
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
    fn end(
        &self,
        ray: &Ray,
        place: Place,
        weight: f64,
        books: &mut Books,
        witness: &mut impl Witness,
    ) {
        if place != Place::World {
            lose(&mut books.totals.ledger, Loss::Leak, weight);
            let ended = self.in_world(ray, place);
            return witness.ends(&ended, Fate::Lost(Loss::Leak), weight);
        }
        let fate = self.book_escape(ray, weight, books);
        witness.ends(ray, fate, weight);
    }

    /// Books a ray of the world that leaves the scene for good.
    #[inline]
    fn book_escape(&self, ray: &Ray, weight: f64, books: &mut Books) -> Fate {
        let ledger = &mut books.totals.ledger;
        let fate = if ray.direction.z >= 0.0 {
            ledger.escaped_up += weight;
            Fate::EscapedUp
        } else {
            ledger.escaped_down += weight;
            Fate::EscapedDown
        };
        if !self.escapes.is_empty() && books.leaving.push(ray, weight) {
            books
                .leaving
                .settle(&self.escapes, &mut books.totals.readings);
        }
        fate
    }

    /// Shows a ray of the world that meets nothing more to the receivers and books it.
    #[inline]
    pub fn leave(&self, ray: &Ray, weight: f64, books: &mut Books) -> Fate {
        self.fly(ray, f64::INFINITY, weight, books);
        self.book_escape(ray, weight, books)
    }

    /// Whether any receiver asks for flights.
    pub fn flies(&self) -> bool {
        !self.flights.is_empty()
    }

    /// Shows a flight of `length` mm through the world to the receivers.
    #[inline]
    pub fn fly(&self, ray: &Ray, length: f64, weight: f64, books: &mut Books) {
        for (number, receiver) in &self.flights {
            if let Some(bin) = receiver.crossed(ray, length) {
                books.totals.readings[*number][bin] += weight;
            }
        }
    }
}

fn lose(ledger: &mut Ledger, cause: Loss, weight: f64) {
    ledger.lost[cause as usize] += weight;
}
