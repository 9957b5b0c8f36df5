// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths at a film stack: which rays take an outcome of the table, and where that leads them.

use glam::{DVec2, DVec3};

use super::cells::{Cells, Turn};
use super::layers::{Ends, LayerWalk, Layers, SAME, Traveller};
use super::part::{Course, Entry, Exit, FilmOutcome, MOST, Part, Way};
use super::{Passage, StackBorder, TabulatedFilms};
use crate::error::{Error, check};
use crate::ledger::Ledger;
use crate::optics::polarisation::{Light, Stokes};
use crate::path::{PathState, Tracer};
use crate::random::{self, PathStream, Streams};
use crate::ray::Ray;
use crate::receiver::{PathHistory, Sense, Tally};
use crate::scene::{FilmFaces, Location, Scene};
use crate::settings::Settings;

/// Distance of the ends of films from which light is traced film by film, mm.
const TO_END_MM: f64 = 1e-3;
/// Weight below which chance ends light between films: what strong absorbers leave counts.
const ROULETTE_BELOW: f64 = 0.01;
/// Weight from which a path goes on in all ways in which outcomes leave.
const SPLIT_FROM: f64 = 0.2;
/// Added to the seed of a run.
const SALT: u64 = 0x66_696c_6d73;

/// A table bound to the scenes of a run.
pub(crate) struct BoundStack<'a> {
    films: TabulatedFilms<'a>,
    cells: Cells,
    /// Through the films alone, at each wavelength.
    tracers: Vec<Tracer<'a>>,
    layers: Vec<Layers<'a>>,
    faces: Vec<FilmFaces>,
    /// Half the lengths of the rectangle in which light goes through the films as if they had no ends,
    /// mm; infinite where they have none.
    half_mm: DVec2,
    /// Accounts of the films: powers of their ledger, then passages of the gaps in both ways.
    accounts: usize,
    /// The line of a surface of the films in the ledger of the run.
    lines: Vec<u32>,
    seed: u64,
    /// Distance from the outer faces at which light goes on, mm.
    offset: f64,
}

impl<'a> BoundStack<'a> {
    /// `films` for a run through `scenes`, of these wavelengths where it has several.
    ///
    /// # Errors
    /// Films that the scenes do not have.
    pub fn new(
        films: TabulatedFilms<'a>,
        scenes: &[&'a Scene],
        wavelengths: &'a [f64],
        settings: &Settings,
    ) -> Result<Self, Error> {
        let table = films.table;
        let count = table.scenes.len();
        let what = "number of wavelengths of tabulated films";
        check(what, count as f64, "one for each scene", count == scenes.len())?;
        let settings_within = Settings { roulette_below: ROULETTE_BELOW, ..*settings };
        let tracers: Vec<Tracer<'_>> = table
            .scenes
            .iter()
            .enumerate()
            .map(|(number, scene)| {
                Tracer::new(scene, &[], &settings_within).at(wavelengths, number)
            })
            .collect();
        let layers: Vec<Layers<'_>> = table.scenes.iter().map(Layers::new).collect();
        let own = &table.scenes[0].lines;
        let lines = own.surfaces.iter().map(|name| {
            let of_run = scenes[0].lines().surfaces.iter().position(|known| known == name);
            of_run.map_or(PathHistory::NO_LINE, |line| line as u32)
        });
        let accounts = Ledger::new(own).powers().count() + 2 * layers[0].gaps();
        let has_ends = table.borders.contains(&StackBorder::Edge);
        let what = "number of axes along which tabulated films end";
        let edges = table.borders.iter().filter(|border| **border == StackBorder::Edge).count();
        check(what, edges as f64, "both or none", edges != 1)?;
        let within = table.half_mm.map(|half| if has_ends { half - TO_END_MM } else { half });
        let half_mm = if has_ends { within.into() } else { DVec2::INFINITY };
        let counts = [layers[0].gaps() + 1, table.scenes[0].bodies[0].surfaces.len()];
        let faces =
            scenes.iter().map(|scene| FilmFaces::new(scene, table.ends_mm(), counts, within));
        Ok(Self {
            films,
            cells: Cells::new(table.symmetry),
            tracers,
            layers,
            faces: faces.collect::<Result<_, _>>()?,
            half_mm,
            accounts,
            lines: lines.collect(),
            seed: settings.seed ^ SALT,
            offset: scenes[0].offset(),
        })
    }

    /// Number of cells of all wavelengths, sides and states of polarisation.
    fn slots(&self) -> usize {
        self.tracers.len() * SIDES_AND_STATES * self.cells.count()
    }

    /// Distance of a ray that meets the stack from where the films end, mm.
    fn room(&self, ray: &Ray) -> f64 {
        (self.half_mm - ray.origin.truncate().abs()).min_element()
    }
}

/// Sides of a stack, times states of polarisation: along s, along p.
const SIDES_AND_STATES: usize = 4;

/// The stack for one group of paths.
pub(crate) struct StackWalker<'w, 'a> {
    stack: &'w BoundStack<'a>,
    group: u64,
    part: Part,
    booked: Vec<Entry>,
    /// What light has left on its way to ends of the films, in the accounts of all wavelengths.
    left: Vec<f64>,
    /// Of the films alone, at each wavelength.
    tallies: Vec<Tally<'w>>,
    /// Light that passed each gap upwards and downwards, at each wavelength.
    passed: Vec<Vec<[f64; 2]>>,
    streams: Streams,
}

impl<'w, 'a> StackWalker<'w, 'a> {
    /// With the outcomes that are kept for this group.
    pub fn new(stack: &'w BoundStack<'a>, group: u64) -> Self {
        let slots = stack.slots();
        let accounts = (stack.accounts * stack.tracers.len()) as u32;
        let shape = (slots, stack.half_mm.is_finite());
        let parts = stack.films.parts;
        let kept = parts.and_then(|parts| Part::from_bytes(&parts.find(group)?, shape, accounts));
        Self {
            stack,
            group,
            part: kept.unwrap_or_else(|| Part::new(shape.0, shape.1)),
            booked: Vec::new(),
            left: vec![0.0; accounts as usize],
            tallies: stack.tracers.iter().map(|tracer| Tally::new(&tracer.receivers)).collect(),
            passed: vec![vec![[0.0; 2]; stack.layers[0].gaps()]; stack.layers.len()],
            streams: Streams::new(&mut random::stream(stack.seed, group)),
        }
    }

    /// The outer faces in the scene of a wavelength.
    #[inline]
    pub fn faces(&self, wavelength: u16) -> &'w FilmFaces {
        &self.stack.faces[usize::from(wavelength)]
    }

    /// Takes a path, whose ray begins where it meets the stack, beyond it; false if it ends there.
    /// A path of some weight goes on in all ways that outcomes of its cell leave: back as the path
    /// itself, on the other side as others, which `exits` gets. A weak path takes one outcome.
    pub fn pass<L: Light>(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        rng: &mut PathStream,
        exits: &mut Vec<(PathState, L)>,
    ) -> bool {
        let stack = self.stack;
        if !L::CARRIED && self.mirrors(path, rng) {
            return true;
        }
        let (mut cell, turn) = stack.cells.find(path.ray.direction);
        if stack.films.widened {
            cell = stack.cells.widened(cell, rng);
        }
        let is_p = L::CARRIED && {
            let q = light.meet(path.ray.direction, DVec3::Z);
            2.0 * random::unit(rng) >= 1.0 + q
        };
        let falls = path.ray.direction.z < 0.0;
        let slot = self.slot(path.wavelength, falls, is_p, cell);
        if self.part.visit(slot) {
            if let Some(number) = self.part.lacks(slot) {
                let (outcome, light, _) = self.draw::<L>(slot, u64::from(number), None);
                self.part.put(slot, outcome, L::CARRIED.then_some(light), &self.booked);
            }
            self.part.take(slot, falls, stack.films.table.seen_sin2);
        }
        let room = stack.room(&path.ray);
        let one = if path.weight < SPLIT_FROM {
            Some(self.part.one(slot))
        } else {
            self.part.one_beyond(slot, room, rng)
        };
        if let Some((number, outcome)) = one {
            return self.send_one(path, light, (slot, number), (&outcome, room), &turn);
        }
        self.part.all_within(slot, room, path.weight);
        let (arrived, arrived_light) = (*path, *light);
        let mut goes_back = false;
        for way in Way::ALL {
            let Some((number, outcome, share)) = self.part.one_of(slot, way, room, rng) else {
                continue;
            };
            let weight = arrived.weight * share;
            if way == Way::Back {
                goes_back = self.send(path, light, (slot, number), &outcome, (weight, &turn));
                continue;
            }
            let (mut exit, mut exit_light) = (arrived, arrived_light);
            self.send(&mut exit, &mut exit_light, (slot, number), &outcome, (weight, &turn));
            exits.push((exit, exit_light));
        }
        goes_back
    }

    /// Has a smooth outer face reflect a path, as chance will: by its own angle, since between it and
    /// mirrors light keeps that.
    fn mirrors(&self, path: &mut PathState, rng: &mut PathStream) -> bool {
        let stack = self.stack;
        let direction = path.ray.direction;
        let layers = &stack.layers[usize::from(path.wavelength)];
        let Some((_, refracted)) = layers.smooth_outer_face(direction) else { return false };
        let reflectance = refracted.map_or(1.0, |(reflectance, _)| reflectance);
        if random::unit(rng) >= reflectance {
            return false;
        }
        let falls = direction.z < 0.0;
        let ends = stack.films.table.ends_mm();
        path.ray.origin.z = if falls { ends[1] + stack.offset } else { ends[0] - stack.offset };
        path.ray.direction.z = -direction.z;
        path.left = None;
        path.history.bounces = path.history.bounces.saturating_add(1);
        path.history.at = path.ray.origin.truncate().to_array();
        true
    }

    /// Sends a path on as an outcome says that stands for all of it; false if it ends. An outcome that has
    /// been where the films end here is drawn again up to there, and traced film by film from there.
    fn send_one<L: Light>(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        (slot, number): (usize, usize),
        (outcome, room): (&FilmOutcome, f64),
        turn: &Turn,
    ) -> bool {
        let weight = path.weight;
        if f64::from(outcome.reach) > room {
            let ends = Ends { from: path.ray.origin.truncate(), turn, half_mm: self.stack.half_mm };
            let (_, of_light, ended) = self.draw::<L>(slot, number as u64, Some(ends));
            if let Some(traveller) = ended {
                for (account, power) in &self.booked {
                    self.left[*account as usize] += power * weight;
                }
                self.stack.put_into_films(path, &traveller, turn);
                if L::CARRIED {
                    let Stokes { q, u, v, s } = turned(of_light, turn);
                    light.become_light([q, u, v], s);
                }
                return true;
            }
        }
        self.part.use_one(slot, number, weight);
        self.send(path, light, (slot, number), outcome, (weight * outcome.weight, turn))
    }

    /// Sends a path on as an outcome says, with this weight; false if it ends.
    fn send<L: Light>(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        (slot, number): (usize, usize),
        outcome: &FilmOutcome,
        (weight, turn): (f64, &Turn),
    ) -> bool {
        let stack = self.stack;
        path.weight = weight;
        path.wavelength = outcome.wavelength;
        stack.meet(path, (outcome.bounces, outcome.line));
        if outcome.course == Course::Ended {
            return false;
        }
        let exit = Exit::of(outcome, &path.ray, turn);
        let of_light = L::CARRIED.then(|| turned(self.part.light(slot, number), turn));
        stack.place(path, light, (exit, of_light));
        true
    }

    fn slot(&self, wavelength: u16, falls: bool, is_p: bool, cell: u32) -> usize {
        let kind = 2 * usize::from(falls) + usize::from(is_p);
        (usize::from(wavelength) * SIDES_AND_STATES + kind) * self.stack.cells.count()
            + cell as usize
    }

    /// Draws outcome `number` of a cell, up to where the films end; returns its light and, if it has come
    /// there, how; leaves what is booked in `booked`.
    fn draw<L: Light>(
        &mut self,
        slot: usize,
        number: u64,
        ends: Option<Ends<'_>>,
    ) -> (FilmOutcome, Stokes, Option<Traveller>) {
        let Self { stack, tallies, passed, streams, .. } = self;
        let cells = stack.cells.count();
        let (kind, cell) = ((slot / cells) % SIDES_AND_STATES, (slot % cells) as u32);
        let [falls, is_p] = [kind / 2 == 1, kind % 2 == 1];
        let mut rng = streams.path(slot as u64 * MOST + number);
        let direction = stack.cells.draw(cell, !falls, &mut rng);
        let mut light = L::default();
        if L::CARRIED {
            light.meet(direction, DVec3::Z);
            let s = light.stokes().s;
            light.become_light([if is_p { -1.0 } else { 1.0 }, 0.0, 0.0], s);
        }
        let wavelength = (slot / cells / SIDES_AND_STATES) as u16;
        let mut walk = LayerWalk {
            layers: &stack.layers,
            tracers: &stack.tracers,
            tallies,
            passed,
            had: vec![wavelength],
            ends,
            ended: None,
        };
        let entering = (direction, !L::CARRIED);
        let outcome = walk.follow(entering, wavelength, &mut light, &mut rng);
        let LayerWalk { had, ended, .. } = walk;
        self.booked.clear();
        for number in had.into_iter().map(usize::from) {
            let passed = self.passed[number].iter_mut().flatten();
            let powers = self.tallies[number].totals.ledger.powers().chain(passed);
            for (account, power) in powers.enumerate() {
                if *power != 0.0 {
                    let number = number * stack.accounts + account;
                    self.booked.push((number as u32, std::mem::take(power)));
                }
            }
        }
        (outcome, light.stokes(), ended)
    }

    /// Books what all outcomes stood for in the tallies of the run, and has new ones kept.
    pub fn close(self, tallies: &mut [&mut Tally<'_>]) {
        let Self { stack, group, part, left, .. } = self;
        if let Some((parts, bytes)) = stack.films.parts.zip(part.grown_bytes()) {
            parts.keep(group, &bytes);
        }
        let mut sums = left;
        part.book(|(account, power), used| sums[*account as usize] += used * power);
        let table = stack.films.table;
        for (tally, sums) in tallies.iter_mut().zip(sums.chunks_exact(stack.accounts)) {
            let (powers, passed) = sums.split_at(stack.accounts - 2 * stack.layers[0].gaps());
            let mut ledger = Ledger::new(&table.scenes[0].lines);
            ledger.powers().zip(powers).for_each(|(power, sum)| *power = *sum);
            let totals = &mut tally.totals;
            totals.ledger.add_by_name(&ledger);
            for Passage { receiver, gap, sense, .. } in &table.passages {
                let way = usize::from(*sense == Sense::Minus);
                totals.readings[*receiver][0] += passed[2 * gap + way];
            }
        }
    }
}

impl Exit {
    /// Where a ray leaves the stack, from where it met it, in the frame of the run.
    fn of(outcome: &FilmOutcome, ray: &Ray, turn: &Turn) -> Self {
        let Self { direction, place, sin } = outcome.exit();
        match outcome.course {
            Course::Through | Course::Mirrored => {
                // Flat faces move light in its plane of incidence, for small angles as the sine.
                let across = ray.direction.truncate();
                let ahead = if sin > SAME { across * (place.length() / sin) } else { DVec2::ZERO };
                let sign = if outcome.course == Course::Through { 1.0 } else { -1.0 };
                let direction = ray.direction * DVec3::new(1.0, 1.0, sign);
                Self { direction, place: ahead, sin }
            }
            Course::Turned | Course::Ended => Self {
                direction: turn.apply(direction).normalize(),
                place: turn.apply(place.extend(0.0)).truncate(),
                sin,
            },
        }
    }
}

/// Polarisation of the table in the frame of a ray.
fn turned(light: Stokes, turn: &Turn) -> Stokes {
    let sign = if turn.mirrors() { -1.0 } else { 1.0 };
    Stokes { q: light.q, u: sign * light.u, v: sign * light.v, s: turn.apply(light.s) }
}

impl BoundStack<'_> {
    /// Puts a path to where light has come to an end of the films, between or in them.
    fn put_into_films(&self, path: &mut PathState, ended: &Traveller, turn: &Turn) {
        let wavelength = usize::from(ended.wavelength);
        let ([low, high], film) = self.layers[wavelength].space(ended.space);
        let mut at = path.ray.origin + turn.apply(ended.at);
        // Off the faces, which scenes draw in.
        // In a gap light goes on below its plane: what falls was counted, what rises will be.
        let planes = self.films.table.passages.iter().map(|passage| passage.z_mm);
        let high =
            planes.filter(|z| film.is_none() && (low..high).contains(z)).fold(high, f64::min);
        let off = self.offset.max(TO_END_MM).min(0.25 * (high - low));
        at.z = self.films.table.low_mm + ended.at.z.clamp(low + off, high - off);
        path.ray = Ray { origin: at, direction: turn.apply(ended.direction).normalize() };
        path.location = film.map_or(Location::World, |film| self.faces[wavelength].inside(film));
        path.left = None;
        path.weight *= ended.weight;
        path.wavelength = ended.wavelength;
        self.meet(path, (ended.history.bounces, ended.history.line));
        path.history.at = [at.x, at.y];
    }

    /// Adds surfaces of the films to the history of a path; the last one is of this line.
    fn meet(&self, path: &mut PathState, (bounces, line): (u32, u32)) {
        path.history.bounces = path.history.bounces.saturating_add(bounces);
        path.history.line = self.lines.get(line as usize).copied().unwrap_or(line);
    }

    /// Puts a path to where light leaves the stack.
    fn place<L: Light>(
        &self,
        path: &mut PathState,
        light: &mut L,
        (exit, of_light): (Exit, Option<Stokes>),
    ) {
        let (mut at, mut direction) = (path.ray.origin + exit.place.extend(0.0), exit.direction);
        let mut mirrors = DVec3::ONE;
        let table = self.films.table;
        for axis in 0..2 {
            let half = table.half_mm[axis];
            if table.borders[axis] == StackBorder::Periodic {
                at[axis] = (at[axis] + half).rem_euclid(2.0 * half) - half;
                continue;
            }
            // Over two lengths mirror images repeat; at an edge it folds
            // straight light, which the ray's own sine has carried beyond.
            let far = (at[axis] + half).rem_euclid(4.0 * half);
            at[axis] = if far > 2.0 * half { 3.0 * half - far } else { far - half };
            if far > 2.0 * half {
                mirrors[axis] = -1.0;
            }
        }
        direction *= mirrors;
        let [low, high] = table.ends_mm();
        at.z = if direction.z > 0.0 { high + self.offset } else { low - self.offset };
        path.ray = Ray { origin: at, direction };
        path.left = None;
        path.history.at = [at.x, at.y];
        if let Some(Stokes { q, u, v, s }) = of_light {
            let sign = mirrors.x * mirrors.y;
            let s = s * mirrors;
            let across = s - direction * s.dot(direction);
            let s = across.try_normalize().unwrap_or_else(|| direction.any_orthonormal_vector());
            light.become_light([q, sign * u, sign * v], s);
        }
    }
}
