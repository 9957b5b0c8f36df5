// SPDX-License-Identifier: MIT OR Apache-2.0
//! Packages of the usual kind, many paths at once: one clear or absorbing body between a dome (zones of a sphere, or a relief) with or without an
//! upright side, a level bottom, and with or without a box; alone, or many of one kind.
//!
//! In: a scene of that kind (all others are refused, and traced path by path) and the streams of a group's paths. Out: the same books as path by
//! path, from the same draws: a path meets the same surfaces whether it is followed here or by [`Tracer::follow`]. [`LANES`] paths are
//! kept in flight. A step finds what lies ahead of all of them, with the same operations and no branches; searches the dome for each; settles them
//! on what they met and reflects or refracts them, again without branches; and books what happened. Surfaces that are neither interface nor
//! mirror draw for their rays one by one. Light that leaves a package of several, or one with a ground, is followed path by path until it enters one or ends, unless it rises over everything.
//! All operations of the loops are those of IEEE 754 without contraction, so that the bits are the same on any processor.

mod book;
mod clearance;
mod climb;
mod fates;
mod orders;
mod plan;
mod step;
mod zones;

use bsdf::Side;
use bsdf::orders::{OrderDeck, OrderTable};
use pulp::Arch;

use crate::path::{Books, Tracer};
use crate::random::{PathStream, Streams};
use crate::ray::{Ray, lanes_down};
use crate::run::Turns;
use crate::scene::{Place, ReadyPart, ReadySurface, Scene};
use crate::shape::{Reach, Revolution};
use crate::starts::Starts;
use clearance::Clearance;
use climb::{Climbs, Ladder, Search};
use fates::{Departs, Exit, Fates, Tell};
use orders::Draws;
use step::{Aim, Choose, Frame, LANES, Lanes, Meet, Send, mode};
use zones::Zones;

/// A dome.
enum Dome<'a> {
    /// Zones of a sphere.
    Round(Zones),
    Stairs(Ladder<'a>),
    Relief(&'a Revolution),
}

/// A piece of a surface with what it does.
struct Piece<'a> {
    surface: &'a ReadySurface,
    part: &'a ReadyPart,
    number: u32,
    mode: f64,
    reflectance: f64,
    table: Option<&'a OrderTable>,
    /// n_r, n_z and k of n_r r + n_z z = k, on a relief.
    line: [f64; 3],
}

/// A scene that can be traced so.
pub(crate) struct Convoy<'a> {
    scene: &'a Scene,
    frame: Frame,
    dome: Dome<'a>,
    /// Those of the dome first, then bottom, side and the faces of the box, as far as there are such.
    pieces: Vec<Piece<'a>>,
    /// What a flat code lies below the number of its piece, for bottom and side and for the faces of the box.
    flats: [f64; 2],
    absorption: f64,
    medium_line: usize,
    /// Whether pieces of the dome differ in what they do.
    varied: bool,
    /// The tables of orders, by piece, if there are any.
    deck: Option<OrderDeck<'a>>,
    exit: Exit,
}

/// Paths of a convoy, lane by lane.
struct Crew {
    lanes: Lanes,
    climbs: Climbs,
    draws: Draws,
    /// If all sources are of one kind that can be drawn many at a time.
    starts: Option<Starts>,
    weight: [f64; LANES],
    instance: [u32; LANES],
}

impl Convoy<'_> {
    /// Traces `paths` paths; `look` is called before each step with the number of paths begun so far and may stop the whole. Returns how many
    /// surfaces the paths met; `None` if stopped.
    pub fn trace(
        &self,
        tracer: &Tracer<'_>,
        paths: u64,
        (streams, mut turns): (Streams, Turns<'_>),
        books: &mut Books,
        mut look: impl FnMut(u64) -> bool,
    ) -> Option<u64> {
        let mut crew = Box::new(Crew {
            lanes: Lanes::new(),
            climbs: Climbs::new(),
            draws: Draws::new(),
            starts: if turns.by_net() { None } else { self.starts() },
            weight: [0.0; LANES],
            instance: [0; LANES],
        });
        let (mut begun, mut hits) = (0, 0);
        // The lanes 0 to `flying` hold a path each.
        let mut flying = 0;
        loop {
            if !look(begun) {
                return None;
            }
            while flying < LANES && begun < paths {
                self.begin(&mut crew, flying, begun, &streams, &mut turns, books);
                flying += 1;
                begun += 1;
            }
            if flying == 0 {
                return Some(hits);
            }
            let fates = match &self.dome {
                Dome::Round(_) => self.pass::<true>(tracer, &mut crew, flying, books),
                _ => self.pass::<false>(tracer, &mut crew, flying, books),
            };
            hits += u64::from(fates.met.count_ones());
            let ended = self.book(tracer, &mut crew, fates, books, &mut hits);
            // From the last lane to the first, so that the last one in flight can take the place of one that ended.
            for lane in lanes_down(ended) {
                if begun < paths {
                    self.begin(&mut crew, lane, begun, &streams, &mut turns, books);
                    begun += 1;
                } else {
                    flying -= 1;
                    crew.copy(flying, lane);
                }
            }
        }
    }

    /// Takes all rays to what they meet next and beyond; what became of those in flight.
    fn pass<const ROUND: bool>(
        &self,
        tracer: &Tracer<'_>,
        crew: &mut Crew,
        flying: usize,
        books: &mut Books,
    ) -> Fates {
        let arch = Arch::new();
        let frame = self.frame;
        arch.dispatch(Aim::<ROUND>(&frame, &mut crew.lanes));
        match &self.dome {
            Dome::Round(_) => {}
            Dome::Stairs(ladder) => arch.dispatch(Search {
                ladder,
                lanes: &mut crew.lanes,
                climbs: &mut crew.climbs,
                flying,
            }),
            Dome::Relief(relief) => {
                for lane in 0..flying {
                    self.search(relief, &mut crew.lanes, lane);
                }
            }
        }
        arch.dispatch(Choose::<ROUND>(&frame, &mut crew.lanes));
        if let Dome::Round(zones) = &self.dome {
            zones.find(&mut crew.lanes);
        }
        if self.varied {
            for lane in 0..flying {
                if crew.lanes.on_dome[lane] > 0.0 {
                    crew.lanes.mode[lane] = self.pieces[crew.lanes.dome_piece[lane] as usize].mode;
                }
            }
        }
        if self.absorption > 0.0 || tracer.flies() {
            for lane in 0..flying {
                self.fly(tracer, crew, lane, books);
            }
        }
        if let Some(deck) = &self.deck {
            arch.dispatch(Meet::<ROUND, true>(&frame, &mut crew.lanes));
            self.draw(deck, crew, flying);
            arch.dispatch(Send(&frame, &mut crew.lanes));
        } else {
            arch.dispatch(Meet::<ROUND, false>(&frame, &mut crew.lanes));
        }
        let fates = arch.dispatch(Tell {
            frame: &frame,
            exit: self.exit,
            pieces: self.flats,
            lanes: &mut crew.lanes,
        });
        fates.of(flying)
    }

    /// An empty stock of beginnings, if all sources are copies of one that can be drawn many at a time.
    fn starts(&self) -> Option<Starts> {
        let slots = &self.scene.slots;
        let copies = slots.len() == self.scene.instances();
        copies.then(|| Starts::new(&slots[0].source)).flatten()
    }

    /// Puts a new path into a lane.
    #[inline]
    fn begin(
        &self,
        crew: &mut Crew,
        lane: usize,
        number: u64,
        streams: &Streams,
        turns: &mut Turns<'_>,
        books: &mut Books,
    ) {
        let offset = self.frame.offset;
        let (ray, stream) = if let Some(starts) = &mut crew.starts {
            // One source to an instance, in the same order.
            crew.instance[lane] = turns.number() as u32;
            starts.next(number, streams, self.scene.slots[0].source.position, offset)
        } else {
            let mut stream = streams.path(number);
            let (_, slot) = turns.next();
            if let Place::Inside { instance, .. } = slot.place {
                crew.instance[lane] = instance;
            }
            let ray = turns.begin(number, slot, offset, &mut stream);
            (ray, stream)
        };
        crew.lanes.put(lane, &ray);
        crew.lanes.inside[lane] = 1.0;
        crew.lanes.keep(lane, stream);
        crew.weight[lane] = 1.0;
        crew.lanes.bounces[lane] = 0.0;
        books.totals.ledger.emitted += 1.0;
    }

    /// Finds where a ray meets a relief that is no staircase.
    fn search(&self, relief: &Revolution, lanes: &mut Lanes, lane: usize) {
        let side = if lanes.inside[lane] > 0.0 {
            Side::Inner
        } else {
            Side::Outer
        };
        let reach = Reach {
            from: -4.0 * self.frame.offset,
            to: lanes.flat[lane],
        };
        lanes.dome[lane] = f64::INFINITY;
        if let Some(hit) = relief.intersect_from(&lanes.ray(lane), reach, side) {
            lanes.dome[lane] = hit.distance;
            lanes.dome_piece[lane] = i64::from(hit.piece);
            let line = self.pieces[hit.piece as usize].line;
            for (all, number) in lanes.dome_line.iter_mut().zip(line) {
                all[lane] = number;
            }
        }
    }

    /// Leaves to the medium what it absorbs on the way to what is met, and shows flights through the world to receivers.
    fn fly(&self, tracer: &Tracer<'_>, crew: &mut Crew, lane: usize, books: &mut Books) {
        let lanes = &mut crew.lanes;
        let nothing = lanes.mode[lane] >= mode::NOTHING;
        if lanes.inside[lane] == 0.0 {
            if !nothing {
                let mut ray = lanes.ray(lane);
                ray.origin += self.scene.position(Some(crew.instance[lane]));
                tracer.fly(&ray, lanes.distance[lane], crew.weight[lane], books);
            }
        } else if self.absorption > 0.0 {
            let mut stream = lanes.stream(lane);
            let share = if nothing {
                0.0
            } else {
                (-self.absorption * lanes.distance[lane]).exp()
            };
            let passed = tracer.share(&mut crew.weight[lane], share, &mut stream);
            books.totals.ledger.media[self.medium_line] += passed;
            lanes.keep(lane, stream);
            if crew.weight[lane] == 0.0 {
                lanes.mode[lane] = mode::NOTHING;
            }
        }
    }
}

impl Lanes {
    #[inline]
    fn put(&mut self, lane: usize, ray: &Ray) {
        ray.into_lane(&mut self.origin, &mut self.direction, lane);
    }

    #[inline]
    fn ray(&self, lane: usize) -> Ray {
        Ray::of_lane(&self.origin, &self.direction, lane)
    }

    #[inline]
    fn stream(&self, lane: usize) -> PathStream {
        PathStream {
            state: [self.state[0][lane], self.state[1][lane]],
        }
    }

    #[inline]
    fn keep(&mut self, lane: usize, stream: PathStream) {
        [self.state[0][lane], self.state[1][lane]] = stream.state;
    }
}

impl Crew {
    /// The path of lane `from` in lane `to`.
    fn copy(&mut self, from: usize, to: usize) {
        let ray = self.lanes.ray(from);
        self.lanes.put(to, &ray);
        self.lanes.inside[to] = self.lanes.inside[from];
        let stream = self.lanes.stream(from);
        self.lanes.keep(to, stream);
        self.lanes.bounces[to] = self.lanes.bounces[from];
        self.weight[to] = self.weight[from];
        self.instance[to] = self.instance[from];
    }
}
