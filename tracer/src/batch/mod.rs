// SPDX-License-Identifier: MIT OR Apache-2.0
//! Batched tracing of packages: one body under a dome, alone or in an array of copies.
//!
//! The dome is a sphere in zones, a body of revolution or several that join, over an upright side
//! or none, a level bottom, and a box or none. Carried polarisation, array solids, sources in the
//! world, an absorbing world and all other scenes go to the walker.
//!
//! - A *lane* is the place of one path: entry k of every array of [`Lanes`] belongs to path k of
//!   [`LANES`]. The first lanes are active; a path that ends leaves its lane to a new one, or to the
//!   last active one.
//! - The *state* of a lane is a ray, a random stream, the flag that tells body from world, and the
//!   count of surfaces met. The other arrays hold the interaction under way.
//! - *Codes* say which surface is ahead ([`lanes::FlatCode`]), how it treats light ([`Mode`]), and
//!   how light goes on ([`lanes::Course`]).
//!
//! All lanes take the walker's five steps together: intersect, absorb, show segments to the
//! receivers, scatter, book. The loops have no branches, so the compiler turns them into wide
//! instructions; they are IEEE 754 without contraction, so the bits are the same on any processor. A
//! path draws the same numbers and meets the same surfaces as in a [`Walk`](crate::path::Walk).
//! Surfaces that are neither interface, mirror nor table of orders sample one by one. A path that
//! leaves its package where it may meet the ground or another package takes the walker's own steps
//! until it enters a package.

mod accounting;
mod clearance;
mod compile;
mod events;
mod kernels;
mod lanes;
pub(crate) mod mesh_packets;
mod orders;
mod sphere_zones;
mod staircase;
mod strips;

use bsdf::Side;
use bsdf::order_table::{Flag, OrderTable, OrderTableBatch};
use pulp::Arch;

use crate::ledger::Booking;
use crate::optics::luminescence::Collisions;
use crate::optics::polarisation::Unpolarised;
use crate::path::{Flight, Tracer};
use crate::random::Streams;
use crate::ray::{Ray, first_lanes, lanes, lanes_down};
use crate::receiver::{PathHistory, Tally};
use crate::scene::{CompiledMedium, CompiledPatch, CompiledSurface, Location, Scene};
use crate::shape::{Reach, Revolution};
use crate::source::emission::EmittedRays;
use crate::source_picker::SourcePicker;
use clearance::Clearance;
use events::{Classify, Events, Exit, LeavesPackage};
use kernels::{Diffract, Distances, Interact, Nearest, PackageGeometry};
use lanes::{LANES, Lanes, Mode};
use orders::OrderSamples;
use sphere_zones::Zones;
use staircase::{StaircaseSearch, StaircaseSearches, StaircaseTable};
use strips::Strips;

/// A dome.
enum Dome<'a> {
    /// Zones of a sphere.
    Round(Zones),
    Stairs(StaircaseTable<'a>),
    Relief(&'a Revolution),
    /// A generating curve with arcs.
    Strips(Strips<'a>),
}

/// A primitive of a surface with its scattering mode.
struct Primitive<'a> {
    surface: &'a CompiledSurface,
    patch: &'a CompiledPatch,
    number: u32,
    mode: Mode,
    reflectance: f64,
    table: Option<&'a OrderTable>,
    /// n_r, n_z and k of n_r r + n_z z = k, on a relief.
    line: [f64; 3],
}

/// A scene ready for batched tracing.
pub(crate) struct BatchTracer<'a> {
    scene: &'a Scene,
    geometry: PackageGeometry,
    dome: Dome<'a>,
    /// Primitives of the dome first, then bottom, side and the faces of the box, as far as there
    /// are such.
    primitives: Vec<Primitive<'a>>,
    /// Number of a primitive less its flat code, for bottom and side and for the faces of the box.
    flats: [f64; 2],
    medium: &'a CompiledMedium,
    /// True if primitives of the dome differ in their modes.
    varied: bool,
    /// The tables of orders, by primitive, if there are any.
    tables: Option<OrderTableBatch<'a>>,
    exit: Exit,
}

/// Paths of a batch, lane by lane.
struct PathBatch {
    lanes: Lanes,
    searches: StaircaseSearches,
    samples: OrderSamples,
    /// Rays emitted ahead, where the sources allow it.
    emitted: Option<EmittedRays>,
    weight: [f64; LANES],
    instance: [u32; LANES],
    /// Surfaces that paths have met outside of their packages.
    crossed: u64,
    /// Times that the medium has scattered them.
    scatterings: [u32; LANES],
    /// Lanes that it scatters in this step, with the rays that go on.
    scattered: Vec<(usize, Ray)>,
    history: [PathHistory; LANES],
    /// Weight and side before the interaction, where receivers observe interactions.
    arrived: [f64; LANES],
    came_inside: [Flag; LANES],
}

impl BatchTracer<'_> {
    /// Traces `paths` paths; `keep_going` is called before each step with the number of paths begun
    /// so far and may stop the whole. Returns how many surfaces the paths met; `None` if stopped.
    pub fn trace(
        &self,
        tracer: &Tracer<'_>,
        paths: u64,
        (streams, mut picker): (Streams, SourcePicker<'_>),
        tally: &mut Tally<'_>,
        mut keep_going: impl FnMut(u64) -> bool,
    ) -> Option<u64> {
        let mut batch = Box::new(PathBatch {
            lanes: Lanes::new(),
            searches: StaircaseSearches::new(),
            samples: OrderSamples::new(),
            emitted: self.emitted(),
            weight: [0.0; LANES],
            instance: [0; LANES],
            crossed: 0,
            scatterings: [0; LANES],
            scattered: Vec::new(),
            history: [PathHistory::new(0); LANES],
            arrived: [0.0; LANES],
            came_inside: [Flag::NO; LANES],
        });
        let (mut begun, mut hits) = (0, 0);
        // The lanes below `active` hold a path each.
        let mut active = 0;
        loop {
            if !keep_going(begun) {
                return None;
            }
            while active < LANES && begun < paths {
                self.begin(&mut batch, active, begun, &streams, &mut picker, tally);
                active += 1;
                begun += 1;
            }
            if active == 0 {
                return Some(hits + batch.crossed);
            }
            let events = match &self.dome {
                Dome::Round(_) => self.pass::<true>(tracer, &mut batch, active, tally),
                _ => self.pass::<false>(tracer, &mut batch, active, tally),
            };
            hits += u64::from(events.met.count_ones());
            let ended = self.book(tracer, &mut batch, events, tally);
            // From the last lane to the first, so that the last one in flight can take the place of
            // one that ended.
            for lane in lanes_down(ended) {
                if begun < paths {
                    self.begin(&mut batch, lane, begun, &streams, &mut picker, tally);
                    begun += 1;
                } else {
                    active -= 1;
                    batch.copy(active, lane);
                }
            }
        }
    }

    /// Takes all paths through one interaction.
    fn pass<const ROUND: bool>(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        active: usize,
        tally: &mut Tally<'_>,
    ) -> Events {
        let arch = Arch::new();
        let geometry = self.geometry;
        arch.dispatch(Distances::<ROUND>(&geometry, &mut batch.lanes));
        match &self.dome {
            Dome::Round(_) => {}
            Dome::Stairs(table) => arch.dispatch(StaircaseSearch {
                table,
                lanes: &mut batch.lanes,
                searches: &mut batch.searches,
                active,
            }),
            Dome::Relief(relief) => {
                for lane in 0..active {
                    self.search(relief, &mut batch.lanes, lane);
                }
            }
            Dome::Strips(strips) => {
                for lane in 0..active {
                    let reach = self.reach(&batch.lanes, lane);
                    strips.search(&mut batch.lanes, lane, reach);
                }
            }
        }
        let outside = arch.dispatch(Nearest::<ROUND>(&geometry, &mut batch.lanes));
        if let Dome::Round(zones) = &self.dome {
            zones.find(&mut batch.lanes);
        }
        if self.varied {
            for lane in 0..active {
                if batch.lanes.on_dome[lane].is_set() {
                    batch.lanes.mode[lane] =
                        self.primitives[batch.lanes.dome_primitive[lane] as usize].mode;
                }
            }
        }
        if tracer.receivers.read_segments() {
            for lane in lanes(outside & first_lanes(active)) {
                let ray = self.world_ray(batch, lane);
                let (length, weight) = (batch.lanes.distance[lane], batch.weight[lane]);
                tally.segment(&ray, length, weight, &batch.past(lane), &Unpolarised);
            }
        }
        if let Some(collisions) = &self.medium.collisions {
            for lane in 0..active {
                if batch.lanes.inside[lane].is_set() {
                    self.scatter_on_the_way(tracer, collisions, batch, lane, tally);
                }
            }
        }
        if self.medium.absorption > 0.0 {
            for lane in 0..active {
                if batch.lanes.inside[lane].is_set() && batch.lanes.mode[lane].is_ahead() {
                    self.absorb(tracer, batch, lane, tally);
                }
            }
        }
        if let Some(tables) = &self.tables {
            arch.dispatch(Interact::<ROUND, true>(&geometry, &mut batch.lanes));
            self.sample(tables, batch, active);
            arch.dispatch(Diffract(&geometry, &mut batch.lanes));
        } else {
            arch.dispatch(Interact::<ROUND, false>(&geometry, &mut batch.lanes));
        }
        let events = arch.dispatch(Classify {
            geometry: &geometry,
            exit: self.exit,
            primitives: self.flats,
            lanes: &mut batch.lanes,
        });
        let mut events = events.of_first(active);
        for (lane, ray) in batch.scattered.drain(..) {
            batch.lanes.put(lane, &ray);
            events.other &= !(1 << lane);
        }
        events
    }

    /// Lets the medium scatter a path before it reaches what is ahead of it.
    fn scatter_on_the_way(
        &self,
        tracer: &Tracer<'_>,
        collisions: &Collisions,
        batch: &mut PathBatch,
        lane: usize,
        tally: &mut Tally<'_>,
    ) {
        let lanes = &mut batch.lanes;
        if !lanes.mode[lane].is_met() {
            // It has found a leak.
            return;
        }
        let mut stream = lanes.stream(lane);
        let flight = (&lanes.ray(lane), lanes.distance[lane]);
        let path = (&mut batch.weight[lane], &mut batch.scatterings[lane]);
        let end = tracer.fly(self.medium, collisions, flight, path, &mut stream, tally);
        lanes.keep(lane, stream);
        match end {
            Flight::Free => return,
            Flight::Scattered(ray) => batch.scattered.push((lane, ray)),
            Flight::Absorbed(_) | Flight::Lost | Flight::Converted(..) => batch.weight[lane] = 0.0,
        }
        lanes.mode[lane] = Mode::TAKEN;
    }

    /// Rays emitted ahead, if all sources are copies of one that can emit many at a time.
    fn emitted(&self) -> Option<EmittedRays> {
        let sources = &self.scene.sources;
        let copies = sources.len() == self.scene.instances();
        copies.then(|| EmittedRays::new(&sources[0].source)).flatten()
    }

    /// Puts a new path into a lane.
    #[inline]
    fn begin(
        &self,
        batch: &mut PathBatch,
        lane: usize,
        number: u64,
        streams: &Streams,
        picker: &mut SourcePicker<'_>,
        tally: &mut Tally<'_>,
    ) {
        let offset = self.geometry.offset;
        let (ray, stream) = if let Some(emitted) = &mut batch.emitted {
            let k = emitted.ready(number, streams, picker.sobol());
            // One source to an instance, in the same order.
            let source =
                if picker.by_sobol() { picker.at(emitted.turn(k)) } else { picker.number() };
            batch.instance[lane] = source as u32;
            batch.history[lane] = PathHistory::new(source as u32);
            emitted.ray(k, self.scene.sources[0].source.position, offset)
        } else {
            let mut stream = streams.path(number);
            let (source, placed) = picker.next();
            batch.history[lane] = PathHistory::new(source as u32);
            if let Location::Inside { instance, .. } = placed.location {
                batch.instance[lane] = instance;
            }
            let ray = picker.begin(number, placed, offset, &mut stream);
            (ray, stream)
        };
        batch.lanes.put(lane, &ray);
        batch.lanes.inside[lane] = Flag::YES;
        batch.lanes.keep(lane, stream);
        batch.weight[lane] = 1.0;
        batch.scatterings[lane] = 0;
        batch.lanes.bounces[lane] = 0.into();
        tally.book(Booking::Emission);
    }

    /// Reach within which a ray may meet the dome: before any flat surface.
    fn reach(&self, lanes: &Lanes, lane: usize) -> Reach {
        Reach { from: -4.0 * self.geometry.offset, to: lanes.flat[lane] }
    }

    /// Finds where a ray meets a relief that is no staircase.
    fn search(&self, relief: &Revolution, lanes: &mut Lanes, lane: usize) {
        let side = if lanes.inside[lane].is_set() { Side::Inner } else { Side::Outer };
        let reach = self.reach(lanes, lane);
        lanes.dome[lane] = f64::INFINITY;
        if let Some(hit) = relief.intersect_from(&lanes.ray(lane), reach, side) {
            lanes.dome[lane] = hit.distance;
            lanes.dome_primitive[lane] = i64::from(hit.primitive);
            let line = self.primitives[hit.primitive as usize].line;
            for (all, number) in lanes.dome_line.iter_mut().zip(line) {
                all[lane] = number;
            }
        }
    }

    /// Absorbs in the medium.
    fn absorb(
        &self,
        tracer: &Tracer<'_>,
        batch: &mut PathBatch,
        lane: usize,
        tally: &mut Tally<'_>,
    ) {
        let lanes = &mut batch.lanes;
        let mut stream = lanes.stream(lane);
        let transmittance = if lanes.mode[lane].is_met() {
            (-self.medium.absorption * lanes.distance[lane]).exp()
        } else {
            0.0
        };
        let weight = &mut batch.weight[lane];
        tracer.transmit(self.medium.line, transmittance, weight, &mut stream, tally);
        lanes.keep(lane, stream);
        if batch.weight[lane] == 0.0 {
            lanes.mode[lane] = Mode::NOTHING;
        }
    }
}

impl PathBatch {
    /// Copies the path of lane `from` to lane `to`.
    fn copy(&mut self, from: usize, to: usize) {
        let ray = self.lanes.ray(from);
        self.lanes.put(to, &ray);
        self.lanes.inside[to] = self.lanes.inside[from];
        let stream = self.lanes.stream(from);
        self.lanes.keep(to, stream);
        self.lanes.bounces[to] = self.lanes.bounces[from];
        self.weight[to] = self.weight[from];
        self.scatterings[to] = self.scatterings[from];
        self.instance[to] = self.instance[from];
        self.history[to] = self.history[from];
    }
}
