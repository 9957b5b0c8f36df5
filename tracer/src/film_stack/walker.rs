// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths at a film stack: which rays take an outcome of the table, and where that leads them.

use glam::{DVec2, DVec3};

use super::backward::{Excitations, Sight, Sights};
use super::cells::{Cells, Turn};
use super::layers::{Ends, LayerWalk, Layers, SAME};
use super::near::Near;
use super::part::{Cone, Course, Entry, Exit, FilmOutcome, MOST, Part, Way};
use super::traveller::Traveller;
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
use crate::source::Emission;

/// Distance of the ends of films from which light is traced film by film, mm.
const TO_END_MM: f64 = 1e-3;
/// Weight below which chance ends light between films: what strong absorbers leave counts.
const ROULETTE_BELOW: f64 = 0.01;
/// Weight from which a path goes on in all ways in which outcomes leave.
const SPLIT_FROM: f64 = 0.2;
/// Added to the seed of a run, for outcomes and for rays traced backwards.
const SALT: u64 = 0x66_696c_6d73;
const BACKWARD_SALT: u64 = 0x7369_6768_7473;

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
    cone: Cone,
    excitations: Excitations,
    near: Near,
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
        let excitations = Layers::excitations(&layers, wavelengths);
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
            cone: Cone { sin2: table.seen_sin2, looks_back: table.looks_back() },
            excitations,
            near: Near::new(table),
            seed: settings.seed,
            offset: scenes[0].offset(),
        })
    }

    /// Has a tracer pass over the receivers that no ray of its scene reaches: they have their light from
    /// outcomes alone.
    pub fn relieve(&self, tracer: &mut Tracer<'_>) {
        let table = self.films.table;
        let mut sources = tracer.scene.sources.iter();
        // Rays of files may begin between films.
        let are_outside = !table.borders.contains(&StackBorder::Edge)
            && !sources.any(|placed| matches!(placed.source.emission, Emission::Rays(_)));
        if self.cone.looks_back {
            tracer.receivers.look_back(table.viewers.iter().map(|viewer| viewer.receiver));
        }
        if are_outside {
            tracer.receivers.leave_out(table.passages.iter().map(|passage| passage.receiver));
        }
    }

    /// Number of cells of all wavelengths, sides and states of polarisation.
    fn slots(&self) -> usize {
        self.tracers.len() * SIDES_AND_STATES * self.cells.count()
    }

    /// Number of cells of all wavelengths of rays that rise.
    fn seen_slots(&self) -> usize {
        self.tracers.len() * self.cells.count()
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
    sights: Sights,
    backward_streams: Streams,
}

impl<'w, 'a> StackWalker<'w, 'a> {
    /// With the outcomes that are kept for this group.
    pub fn new(stack: &'w BoundStack<'a>, group: u64) -> Self {
        let slots = stack.slots();
        let accounts = (stack.accounts * stack.tracers.len()) as u32;
        let shape = (slots, stack.half_mm.is_finite());
        let parts = stack.films.parts;
        let seen = (stack.seen_slots(), stack.cone.sin2);
        let part = parts.and_then(|parts| Part::from_bytes(&parts.find(group)?, shape, accounts));
        let sights = parts.filter(|_| stack.cone.looks_back).and_then(|parts| {
            let bytes = parts.find(stack.cone.entry(group))?;
            Sights::from_bytes(&bytes, seen, stack.tracers.len() as u16)
        });
        let streams = |salt: u64| Streams::new(&mut random::stream(stack.seed ^ salt, group));
        Self {
            stack,
            group,
            part: part.unwrap_or_else(|| Part::new(shape.0, shape.1)),
            booked: Vec::new(),
            left: vec![0.0; accounts as usize],
            tallies: stack.tracers.iter().map(|tracer| Tally::new(&tracer.receivers)).collect(),
            passed: vec![vec![[0.0; 2]; stack.layers[0].gaps()]; stack.layers.len()],
            streams: streams(SALT),
            sights: sights.unwrap_or_else(|| Sights::new(seen.0, seen.1)),
            backward_streams: streams(BACKWARD_SALT),
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
        exits: &mut Exits<L>,
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
            self.part.take(slot, falls, &stack.cone);
        }
        let room = stack.room(&path.ray);
        if stack.cone.looks_back && !falls {
            self.look_back::<L>();
            let count = stack.near.rays(path.ray.origin.truncate(), rng);
            for _ in 0..count.ceil() as u32 {
                exits.seen.extend(self.see((path, light), (cell, &turn, room), 1.0 / count, rng));
            }
        }
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
            exits.paths.push((exit, exit_light));
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

    /// Follows as many rays backwards from the cone of receivers as the run has taken outcomes.
    fn look_back<L: Light>(&mut self) {
        let wavelengths = self.stack.tracers.len() as u32;
        while self.sights.lags(wavelengths, self.part.taken()) {
            for start in self.sights.lacking(wavelengths) {
                let sights = self.sights_of::<L>(start, (start % wavelengths) as u16);
                self.sights.put(sights);
            }
            self.sights.take(wavelengths);
        }
    }

    /// Follows a ray backwards from the cone of receivers.
    fn sights_of<L: Light>(&mut self, start: u32, wavelength: u16) -> Vec<Sight> {
        let Self { stack, tallies, passed, backward_streams, .. } = self;
        let mut rng = backward_streams.path(u64::from(start));
        let leaving = random::cosine(&mut rng, stack.cone.sin2.sqrt());
        let films = (&stack.layers[..], &stack.tracers[..]);
        let mut walk = LayerWalk::new(films, (tallies, passed));
        let mut sights = Vec::new();
        let has_ends = stack.half_mm.is_finite();
        let begins = (leaving, wavelength, &stack.excitations, has_ends);
        walk.follow_back::<L>(begins, &mut rng, |mut ray, trail, light| {
            ray.weight = stack.within(&ray, L::CARRIED);
            let (cell, turn) = stack.cells.find(-ray.direction);
            let slot = usize::from(ray.wavelength) * stack.cells.count() + cell as usize;
            let own = (start, slot as u32, &turn);
            sights.push(Sight::new(own, (leaving, wavelength), (&ray, trail, light.stokes())));
        });
        // Light traced backwards is booked nowhere.
        let had = walk.had;
        self.flush(&had, |_, _| {});
        sights
    }

    /// Light into the cone of receivers, with this weight, from a ray that rises from a cell.
    fn see<L: Light>(
        &self,
        (path, light): (&PathState, &L),
        (cell, turn, room): (u32, &Turn, f64),
        weight: f64,
        rng: &mut PathStream,
    ) -> Option<PathState> {
        let stack = self.stack;
        let slot = usize::from(path.wavelength) * stack.cells.count() + cell as usize;
        let (sight, mean) = self.sights.one(slot, rng)?;
        if f64::from(sight.reach) > room {
            return None;
        }
        let share = stack.cone.sin2 * stack.cells.count() as f64 * mean;
        let mut seen = *path;
        seen.weight *= weight * share * seen_of(&sight, path.ray.direction, light, turn);
        seen.wavelength = sight.wavelength;
        seen.scatterings = 0;
        let line = stack.layers[usize::from(sight.wavelength)].top_line();
        stack.meet(&mut seen, (sight.bounces, line));
        if seen.history.bounces >= stack.tracers[0].max_bounces {
            return None;
        }
        let direction = turn.apply(sight.direction()).normalize();
        let place = turn.apply(sight.place().extend(0.0)).truncate();
        stack.place(&mut seen, &mut { *light }, (Exit { direction, place, sin: 0.0 }, None));
        Some(seen)
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
        let goes_on =
            self.send(path, light, (slot, number), outcome, (weight * outcome.weight, turn));
        // Sights have been no farther.
        path.history.is_seen &= f64::from(outcome.reach) <= room;
        goes_on
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
        let rises = path.ray.direction.z > 0.0;
        let exit = Exit::of(outcome, &path.ray, turn);
        let across = exit.direction.truncate().length_squared();
        path.history.is_seen = rises
            && stack.cone.looks_back
            && outcome.course == Course::Turned
            && exit.direction.z > 0.0
            && across < stack.cone.sin2;
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
        let films = (&stack.layers[..], &stack.tracers[..]);
        let mut walk = LayerWalk::new(films, (tallies, passed));
        walk.had.push(wavelength);
        walk.ends = ends;
        let entering = (direction, !L::CARRIED);
        let outcome = walk.follow(entering, wavelength, &mut light, &mut rng);
        let LayerWalk { had, ended, .. } = walk;
        let mut booked = std::mem::take(&mut self.booked);
        booked.clear();
        self.flush(&had, |account, power| booked.push((account, power)));
        self.booked = booked;
        (outcome, light.stokes(), ended)
    }

    /// Takes what light of these wavelengths has booked in the films.
    fn flush(&mut self, wavelengths: &[u16], mut take: impl FnMut(u32, f64)) {
        for number in wavelengths.iter().copied().map(usize::from) {
            let passed = self.passed[number].iter_mut().flatten();
            let powers = self.tallies[number].totals.ledger.powers().chain(passed);
            for (account, power) in powers.enumerate() {
                if *power != 0.0 {
                    let number = number * self.stack.accounts + account;
                    take(number as u32, std::mem::take(power));
                }
            }
        }
    }

    /// Books what all outcomes stood for in the tallies of the run, and has new ones kept.
    pub fn close(self, tallies: &mut [&mut Tally<'_>]) {
        let Self { stack, group, part, left, sights, .. } = self;
        if let Some(parts) = stack.films.parts {
            if part.has_grown() {
                parts.keep(group, &part.bytes());
            }
            if sights.has_grown {
                parts.keep(stack.cone.entry(group), &sights.bytes());
            }
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

/// Paths that leave a film stack beside the one that has met it.
pub(crate) struct Exits<L> {
    /// Other ways of its light.
    pub paths: Vec<(PathState, L)>,
    /// Light that receivers into a narrow cone see, and nothing else.
    pub seen: Vec<PathState>,
}

impl<L> Default for Exits<L> {
    fn default() -> Self {
        Self { paths: Vec::new(), seen: Vec::new() }
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

/// Share of light, over that of unpolarised light, that a sight has of a ray along `direction`.
fn seen_of<L: Light>(sight: &Sight, direction: DVec3, light: &L, turn: &Turn) -> f64 {
    if !L::CARRIED {
        return 1.0;
    }
    let seen = turned(sight.light(), turn);
    let across = seen.s - direction * direction.dot(seen.s);
    let Some(s) = across.try_normalize() else { return 1.0 };
    let own = light.stokes().turned(direction, s);
    1.0 + own.q * seen.q - own.u * seen.u + own.v * seen.v
}

impl BoundStack<'_> {
    /// Weight of a ray traced backwards that leaves below, for light that has got into the films there.
    fn within(&self, ray: &Traveller, is_carried: bool) -> f64 {
        let layers = &self.layers[usize::from(ray.wavelength)];
        match layers.smooth_outer_face(-ray.direction) {
            Some((_, Some((reflectance, _)))) if !is_carried => ray.weight / (1.0 - reflectance),
            _ => ray.weight,
        }
    }

    /// Puts a path to where light has come to an end of the films, between or in them.
    fn put_into_films(&self, path: &mut PathState, ended: &Traveller, turn: &Turn) {
        let wavelength = usize::from(ended.wavelength);
        let ([low, high], film) = self.layers[wavelength].space(ended.space);
        let mut at = path.ray.origin + turn.apply(ended.at);
        // In a gap light goes on below its plane: what falls was counted, what rises will be.
        let planes = self.films.table.passages.iter().map(|passage| passage.z_mm);
        let high =
            planes.filter(|z| film.is_none() && (low..high).contains(z)).fold(high, f64::min);
        // Off the faces, which scenes draw in.
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
