// SPDX-License-Identifier: MIT OR Apache-2.0
//! Outcomes of light that has met a film stack, and the part of the table that one group of paths
//! draws from.

use glam::{DVec2, DVec3, Vec2, Vec3};
use rand::Rng;

use crate::optics::polarisation::Stokes;
use crate::random;

/// Shape of an outcome's direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    /// Nothing is left.
    Ended,
    /// It goes on as it came.
    Through,
    /// It goes back as from a level mirror.
    Mirrored,
    /// It goes on in another direction.
    Turned,
}

impl Course {
    const ALL: [Self; 4] = [Self::Ended, Self::Through, Self::Mirrored, Self::Turned];
}

/// What became of a ray of weight 1 that met the stack: what a path needs of it, in the digits that
/// the table keeps.
#[derive(Debug, Clone, Copy)]
pub(super) struct FilmOutcome {
    pub weight: f64,
    /// Its direction.
    direction: Vec3,
    /// Where it left the stack, from where it met it, mm.
    place: Vec2,
    /// Sine of the polar angle with which it came.
    sin: f32,
    /// How far from where it met the stack it has been, mm.
    pub reach: f32,
    /// Surfaces met.
    pub bounces: u32,
    /// Line of the last one in the ledger of the films.
    pub line: u32,
    pub wavelength: u16,
    pub course: Course,
    /// The first of its entries, and their number.
    entries: [u32; 2],
}

/// Where light leaves the stack, and how.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exit {
    pub direction: DVec3,
    pub place: DVec2,
    pub sin: f64,
}

impl FilmOutcome {
    pub fn new(exit: &Exit, weight: f64, wavelength: u16, course: Course) -> Self {
        Self {
            weight,
            direction: exit.direction.as_vec3(),
            place: exit.place.as_vec2(),
            sin: exit.sin as f32,
            reach: 0.0,
            bounces: 0,
            line: 0,
            wavelength,
            course,
            entries: [0; 2],
        }
    }

    pub fn exit(&self) -> Exit {
        Exit {
            direction: self.direction.as_dvec3(),
            place: self.place.as_dvec2(),
            sin: f64::from(self.sin),
        }
    }
}

/// A power booked in an account of a wavelength: its number times that of the accounts, plus the
/// number of the account.
pub(super) type Entry = (u32, f64);

/// Ways on which light leaves the stack, each a share of what a cell of incidence sends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// On the side from which it came.
    Back,
    /// On the other side.
    Beyond,
    /// There too, in the cone that receivers look into.
    Seen,
}

impl Way {
    pub const ALL: [Self; 3] = [Self::Back, Self::Beyond, Self::Seen];
}

/// The cone about z that receivers look into.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cone {
    /// Sine squared of its half angle, 0 for none.
    pub sin2: f64,
    /// True if what does not pass straight is traced backwards from it.
    pub looks_back: bool,
}

impl Cone {
    /// The number under which sights of a group for this cone are kept, beside the outcomes of the group.
    pub fn entry(&self, group: u64) -> u64 {
        self.sin2.to_bits().wrapping_add(group)
    }

    /// True of an outcome that leaves into it and is not traced backwards.
    fn holds(&self, sin2: f64, course: Course) -> bool {
        sin2 < self.sin2 && (course == Course::Through || !self.looks_back)
    }
}

/// Outcomes of a band that leave in one way.
#[derive(Debug, Clone, Default)]
struct Share {
    /// Their numbers.
    members: Vec<u32>,
    /// Sum of their weights.
    weight: f64,
    /// The largest one.
    most: f64,
}

/// Outcomes of a cell that have been about equally far.
#[derive(Debug, Clone, Default)]
struct Band {
    /// Their numbers.
    members: Vec<u32>,
    shares: [Share; 3],
}

/// The farthest that outcomes of the first band have been, mm; of each other one, twice that of the one
/// before.
const FIRST_BAND_MM: f64 = 0.25;
/// Bands, at most; outcomes of the last one have been anywhere.
const BANDS: usize = 14;

/// The band of outcomes that have been as far.
fn band(reach_mm: f64) -> usize {
    let limits = (0..BANDS - 1).map(|k| FIRST_BAND_MM * f64::from(1 << k));
    limits.take_while(|limit| *limit < reach_mm).count()
}

/// The number of the first bands, of which no outcome has been farther.
fn bands_within(room_mm: f64) -> usize {
    if room_mm == f64::INFINITY { BANDS } else { band(room_mm.next_up()) }
}

/// Outcomes of a cell of incidence.
#[derive(Debug, Clone, Default)]
struct Cell {
    /// Rays of the run that have met it.
    visits: u32,
    /// Outcomes that the run takes, the first ones.
    taken: u32,
    /// Those of them that have been offered one by one.
    turn: u32,
    /// Up to the farthest one.
    bands: Vec<Band>,
    /// Weight of rays that each outcome taken has stood for, alone and as the last of those of its band
    /// that stood for rays together.
    used: Vec<[f64; 2]>,
    outcomes: Vec<FilmOutcome>,
    /// Polarisation of each, where light carries it.
    light: Vec<Stokes>,
}

/// The outcomes from which one group of paths draws.
#[derive(Debug)]
pub(super) struct Part {
    /// Those that hold something.
    cells: Vec<Option<Box<Cell>>>,
    entries: Vec<Entry>,
    /// Outcomes that the run takes, of all cells.
    taken: u32,
    /// True where it counts how far outcomes have been.
    has_bands: bool,
    has_grown: bool,
}

/// Rays of a cell that each have the run take new outcomes, whatever the others have taken.
const ALWAYS_NEW: u32 = 4;
/// Outcomes that a group takes as each ray has it take a new one.
const ENOUGH: u32 = 1 << 14;

/// Of the rays after that, one in so many does.
const SELDOM: u32 = 8;
/// Outcomes that a group takes before all rays share known ones.
pub(super) const PLENTY: u32 = 1 << 16;
/// Outcomes of a cell, at most.
pub(super) const MOST: u64 = 1 << 20;
/// Bytes of an outcome without entries, with and without light.
const BYTES: [usize; 2] = [51 + 48, 51];

impl Cell {
    /// See [`Part::take`].
    fn take(&mut self, falls: bool, cone: &Cone, has_bands: bool) {
        let number = self.taken;
        let outcome = &self.outcomes[number as usize];
        self.taken += 1;
        self.used.push([0.0; 2]);
        let band = if has_bands { band(f64::from(outcome.reach)) } else { 0 };
        if self.bands.len() <= band {
            self.bands.resize_with(band + 1, Band::default);
        }
        let band = &mut self.bands[band];
        band.members.push(number);
        if outcome.course == Course::Ended {
            return;
        }
        let Vec3 { x, y, z } = outcome.direction;
        let way = if (z < 0.0) != falls {
            Way::Back
        } else if !falls && cone.holds(f64::from(x * x + y * y), outcome.course) {
            Way::Seen
        } else {
            Way::Beyond
        };
        let share = &mut band.shares[way as usize];
        share.members.push(number);
        share.weight += outcome.weight;
        share.most = share.most.max(outcome.weight);
    }
}

/// The first bands, of which no outcome has been farther than `room_mm`, and the others.
fn parted(bands: &[Band], room_mm: f64) -> (&[Band], &[Band]) {
    bands.split_at(bands_within(room_mm).min(bands.len()))
}

/// Number of outcomes of bands.
fn count(bands: &[Band]) -> usize {
    bands.iter().map(|band| band.members.len()).sum()
}

impl Part {
    /// Without outcomes, of so many cells; with bands where light may not go as far as outcomes do.
    pub fn new(cells: usize, has_bands: bool) -> Self {
        let cells = vec![None; cells];
        Self { cells, entries: Vec::new(), taken: 0, has_bands, has_grown: false }
    }

    fn cell(&mut self, cell: usize) -> &mut Cell {
        self.cells[cell].get_or_insert_default()
    }

    /// True if the run takes one more outcome of a cell as one more ray meets it: the first rays have it
    /// do so, later ones seldom. So what a run takes does not depend on what has been drawn before it.
    #[inline]
    pub fn visit(&mut self, cell: usize) -> bool {
        let taken = self.taken;
        let cell = self.cell(cell);
        let visit = cell.visits;
        // No group has as many paths.
        cell.visits = visit.saturating_add(1);
        visit < ALWAYS_NEW || taken < ENOUGH || (taken < PLENTY && visit.is_multiple_of(SELDOM))
    }

    /// The number of the next outcome of a cell, if it is yet to be drawn.
    #[inline]
    pub fn lacks(&mut self, cell: usize) -> Option<u32> {
        let cell = self.cell(cell);
        (cell.taken as usize >= cell.outcomes.len()).then_some(cell.taken)
    }

    /// Has the run take the next outcome of a cell, of light that falls or rises; one that leaves upwards
    /// in the cone is a share of its own.
    #[inline]
    pub fn take(&mut self, cell: usize, falls: bool, cone: &Cone) {
        self.taken += 1;
        let has_bands = self.has_bands;
        self.cell(cell).take(falls, cone, has_bands);
    }

    /// Puts the next outcome into a cell.
    pub fn put(
        &mut self,
        cell: usize,
        outcome: FilmOutcome,
        light: Option<Stokes>,
        booked: &[Entry],
    ) {
        let entries = [self.entries.len() as u32, booked.len() as u32];
        self.entries.extend_from_slice(booked);
        let cell = self.cell(cell);
        cell.outcomes.push(FilmOutcome { entries, ..outcome });
        cell.light.extend(light);
        self.has_grown = true;
    }

    /// One outcome of a cell, with its number.
    #[inline]
    pub fn one(&mut self, cell: usize) -> (usize, FilmOutcome) {
        let cell = self.cell(cell);
        // The next one, so that a path that comes back does not meet its own again.
        let number = (cell.turn % cell.taken) as usize;
        cell.turn = cell.turn.wrapping_add(1);
        (number, cell.outcomes[number])
    }

    /// Has an outcome stand for a ray of this weight.
    #[inline]
    pub fn use_one(&mut self, cell: usize, number: usize, weight: f64) {
        self.cell(cell).used[number][0] += weight;
    }

    /// One of the outcomes of a cell that may have been farther than `room_mm`, as often as they are
    /// among all.
    #[inline]
    pub fn one_beyond(
        &mut self,
        cell: usize,
        room_mm: f64,
        rng: &mut impl Rng,
    ) -> Option<(usize, FilmOutcome)> {
        let cell = self.cell(cell);
        let (_, beyond) = parted(&cell.bands, room_mm);
        (!beyond.is_empty()).then_some(())?;
        let turn = (random::unit(rng) * f64::from(cell.taken)) as usize;
        let number = *beyond.iter().flat_map(|band| &band.members).nth(turn)? as usize;
        Some((number, cell.outcomes[number]))
    }

    /// Has all outcomes of a cell that have not been farther than `room_mm` stand for a ray of this weight
    /// together.
    #[inline]
    pub fn all_within(&mut self, cell: usize, room_mm: f64, weight: f64) {
        let Cell { bands, used, .. } = self.cell(cell);
        let within = parted(bands, room_mm).0;
        let each = weight / count(within) as f64;
        for last in within.iter().filter_map(|band| band.members.last()) {
            used[*last as usize][1] += each;
        }
    }

    /// An outcome of those that leave in one way and have not been farther than `room_mm`, with its
    /// number and the weight of all of them per weight that stands for all so near; `None` where there
    /// are none.
    #[inline]
    pub fn one_of(
        &mut self,
        cell: usize,
        way: Way,
        room_mm: f64,
        rng: &mut impl Rng,
    ) -> Option<(usize, FilmOutcome, f64)> {
        let cell = self.cell(cell);
        let (within, _) = parted(&cell.bands, room_mm);
        let shares = || within.iter().map(|band| &band.shares[way as usize]);
        let sum: f64 = shares().map(|share| share.weight).sum();
        (sum > 0.0).then_some(())?;
        let mut pick = if within.len() > 1 { random::unit(rng) * sum } else { 0.0 };
        let share = shares().filter(|share| share.weight > 0.0).reduce(|chosen, next| {
            if pick < chosen.weight {
                return chosen;
            }
            pick -= chosen.weight;
            next
        })?;
        loop {
            // By chance, not in turn: the first ones are no better than others.
            let members = share.members.len();
            let turn = (random::unit(rng) * members as f64) as usize;
            let number = share.members[turn.min(members - 1)] as usize;
            let outcome = cell.outcomes[number];
            // By its weight.
            if outcome.weight >= share.most || random::unit(rng) * share.most < outcome.weight {
                return Some((number, outcome, sum / count(within) as f64));
            }
        }
    }

    /// The polarisation of an outcome.
    pub fn light(&mut self, cell: usize, number: usize) -> Stokes {
        self.cell(cell).light[number]
    }

    fn entries(&self, outcome: &FilmOutcome) -> &[Entry] {
        let [from, count] = outcome.entries.map(|number| number as usize);
        &self.entries[from..from + count]
    }

    /// Shows entries with the weight that they stood for.
    pub fn book(&self, mut see: impl FnMut(&Entry, f64)) {
        for cell in self.cells.iter().flatten() {
            for band in &cell.bands {
                let mut together = 0.0;
                for number in band.members.iter().rev().map(|number| *number as usize) {
                    let [alone, last] = cell.used[number];
                    together += last;
                    let weight = alone + together;
                    if weight > 0.0 {
                        for entry in self.entries(&cell.outcomes[number]) {
                            see(entry, weight);
                        }
                    }
                }
            }
        }
    }

    /// Outcomes that the run takes.
    pub fn taken(&self) -> u32 {
        self.taken
    }

    /// True if there are more outcomes than were read.
    pub fn has_grown(&self) -> bool {
        self.has_grown
    }

    /// All outcomes as bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let filled = || {
            let cells = self.cells.iter().enumerate();
            cells.filter_map(|(number, cell)| Some((number, cell.as_deref()?)))
        };
        let is_carried = filled().any(|(_, cell)| !cell.light.is_empty());
        let mut bytes = vec![u8::from(is_carried)];
        for (number, cell) in filled() {
            bytes.extend((number as u32).to_le_bytes());
            bytes.extend((cell.outcomes.len() as u32).to_le_bytes());
            for (turn, outcome) in cell.outcomes.iter().enumerate() {
                bytes.push(outcome.course as u8);
                bytes.extend(outcome.wavelength.to_le_bytes());
                bytes.extend(outcome.bounces.to_le_bytes());
                bytes.extend(outcome.line.to_le_bytes());
                bytes.extend(outcome.weight.to_le_bytes());
                let shape = outcome.direction.to_array().into_iter();
                let shape =
                    shape.chain(outcome.place.to_array()).chain([outcome.sin, outcome.reach]);
                bytes.extend(shape.flat_map(f32::to_le_bytes));
                if let Some(Stokes { q, u, v, s }) = cell.light.get(turn) {
                    let reals = [*q, *u, *v].into_iter().chain(s.to_array());
                    bytes.extend(reals.flat_map(f64::to_le_bytes));
                }
                bytes.extend(outcome.entries[1].to_le_bytes());
                for (account, power) in self.entries(outcome) {
                    bytes.extend(account.to_le_bytes());
                    bytes.extend(power.to_le_bytes());
                }
            }
        }
        bytes
    }

    /// What [`Self::bytes`] made, of as many cells and of accounts below `accounts`; `None` of
    /// other bytes.
    pub fn from_bytes(
        bytes: &[u8],
        (cells, has_bands): (usize, bool),
        accounts: u32,
    ) -> Option<Self> {
        let mut part = Self::new(cells, has_bands);
        let mut rest = bytes;
        let mut take = |count: usize| {
            let (head, tail) = rest.split_at_checked(count)?;
            rest = tail;
            Some(head)
        };
        let is_carried = match take(1)? {
            [0] => false,
            [1] => true,
            _ => return None,
        };
        let mut entries = Vec::new();
        while let Some(head) = take(8) {
            let (number, count) = (word(&head[..4])? as usize, word(&head[4..])?);
            (number < cells).then_some(())?;
            for _ in 0..count {
                let fixed = take(BYTES[usize::from(!is_carried)])?;
                let (fixed, booked) = fixed.split_at(fixed.len() - 4);
                let booked = take((word(booked)? as usize).checked_mul(12)?)?;
                entries.clear();
                for entry in booked.chunks_exact(12) {
                    let account = word(&entry[..4]).filter(|account| *account < accounts)?;
                    entries.push((account, double(&entry[4..])?));
                }
                let (outcome, light) = outcome(fixed)?;
                part.put(number, outcome, light, &entries);
            }
        }
        part.has_grown = false;
        take(1).is_none().then_some(part)
    }
}

fn word(bytes: &[u8]) -> Option<u32> {
    bytes.try_into().map(u32::from_le_bytes).ok()
}

fn double(bytes: &[u8]) -> Option<f64> {
    bytes.try_into().map(f64::from_le_bytes).ok()
}

/// An outcome without entries, and its light if it has some, from their bytes.
fn outcome(bytes: &[u8]) -> Option<(FilmOutcome, Option<Stokes>)> {
    let single = |k: usize| {
        let at = 19 + 4 * k;
        bytes[at..at + 4].try_into().map(f32::from_le_bytes).ok()
    };
    let outcome = FilmOutcome {
        course: *Course::ALL.get(usize::from(bytes[0]))?,
        wavelength: u16::from_le_bytes([bytes[1], bytes[2]]),
        bounces: word(&bytes[3..7])?,
        line: word(&bytes[7..11])?,
        weight: double(&bytes[11..19])?,
        direction: Vec3::new(single(0)?, single(1)?, single(2)?),
        place: Vec2::new(single(3)?, single(4)?),
        sin: single(5)?,
        reach: single(6)?,
        entries: [0; 2],
    };
    let mut reals = bytes[47..].chunks_exact(8).map(double);
    let mut real = || reals.next().flatten();
    let light = real().map(|q| {
        let [u, v, x, y, z] = std::array::from_fn(|_| real().unwrap_or_default());
        Stokes { q, u, v, s: DVec3::new(x, y, z) }
    });
    Some((outcome, light))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(z: f64, weight: f64) -> FilmOutcome {
        let direction = DVec3::new((1.0 - z * z).sqrt(), 0.0, z);
        let exit = Exit { direction, place: DVec2::ZERO, sin: 0.5 };
        let course = if weight > 0.0 { Course::Turned } else { Course::Ended };
        FilmOutcome::new(&exit, weight, 0, course)
    }

    /// New outcomes come in order, and known ones are taken about equally often.
    #[test]
    fn visits_take_new_outcomes_in_order() {
        let mut part = Part::new(1, false);
        let mut uses: Vec<u32> = Vec::new();
        for _ in 0..64 * ENOUGH {
            if part.visit(0) {
                assert_eq!(part.lacks(0), Some(uses.len() as u32));
                part.put(0, outcome(0.5, 1.0), None, &[]);
                part.take(0, false, &Cone::default());
                uses.push(0);
            }
            uses[part.one(0).0] += 1;
        }
        assert_eq!(uses.len(), PLENTY as usize);
        let most = uses.iter().copied().max().expect("some");
        assert!(uses.iter().all(|count| *count > 0) && most <= 90, "{most}");
    }

    /// Of light that stands for all outcomes of a cell, ways have their shares, members are offered by
    /// their weights, and what is booked has the weight of the light.
    #[test]
    fn shares_hold_all_light_of_a_cell() {
        let mut rng = random::stream(7, 0);
        let mut part = Part::new(3, false);
        // Back, seen, beyond twice, ended; each books what it does not send on.
        let drawn = [(-0.5, 0.9), (0.99, 0.25), (0.5, 0.1), (0.3, 0.3), (0.5, 0.0)];
        for (z, weight) in drawn {
            part.put(1, outcome(z, weight), None, &[(4, 1.0 - weight)]);
            part.take(1, false, &Cone { sin2: 0.5, looks_back: false });
            part.all_within(1, f64::INFINITY, 2.0);
        }
        part.use_one(1, 0, 3.0);
        let shares =
            Way::ALL.map(|way| part.one_of(1, way, f64::INFINITY, &mut rng).expect("some").2);
        for (share, expected) in shares.into_iter().zip([0.18, 0.08, 0.05]) {
            assert!((share - expected).abs() < 1e-12, "{share}");
        }
        let heavy = (0..4000).filter(|_| {
            let (number, ..) = part.one_of(1, Way::Beyond, f64::INFINITY, &mut rng).expect("two");
            number == 3
        });
        let heavy = heavy.count() as f64;
        assert!((heavy - 3000.0).abs() < 4.5 * (4000.0 * 0.75 * 0.25_f64).sqrt(), "{heavy}");
        let mut booked = 0.0;
        part.book(|(account, power), weight| {
            assert_eq!(*account, 4);
            booked += power * weight;
        });
        // The first k outcomes stand for the ray k together.
        let left: Vec<f64> = drawn.iter().map(|(_, weight)| 1.0 - weight).collect();
        let together = |k: usize| 2.0 * left[..k].iter().sum::<f64>() / k as f64;
        let expected = (1..=5).map(together).sum::<f64>() + 3.0 * left[0];
        assert!((booked - expected).abs() < 1e-12, "{booked}, {expected}");
    }

    /// Near an edge light is what stays so near together, or one outcome that goes farther, as often as
    /// there are such; what the light stood for is booked once.
    #[test]
    fn light_near_an_edge_parts_outcomes_by_how_far_they_have_been() {
        let mut rng = random::stream(3, 0);
        let mut part = Part::new(1, true);
        for (reach, weight) in [(0.1, 0.8), (0.4, 0.4), (3.0, 1.0), (0.1, 0.0), (40.0, 0.5)] {
            let mut drawn = outcome(0.5, weight);
            drawn.reach = reach;
            part.put(0, drawn, None, &[(0, 1.0)]);
            part.take(0, false, &Cone::default());
        }
        let mut is_share = |room: f64, expected: Option<f64>| {
            let share = part.one_of(0, Way::Beyond, room, &mut rng).map(|found| found.2);
            let off = share.unwrap_or_default() - expected.unwrap_or_default();
            share.is_some() == expected.is_some() && off.abs() < 1e-12
        };
        assert!(is_share(0.2, None) && is_share(0.3, Some(0.8 / 2.0)));
        // Bands end at 0.5, at 2 and at 4 mm.
        assert!(is_share(1.0, Some(1.2 / 3.0)) && is_share(3.5, Some(1.2 / 3.0)));
        assert!(is_share(4.0, Some(2.2 / 4.0)) && is_share(f64::INFINITY, Some(2.7 / 5.0)));
        let mut beyond = [0; 5];
        for _ in 0..5000 {
            if let Some((number, _)) = part.one_beyond(0, 0.3, &mut rng) {
                beyond[number] += 1;
            }
        }
        for (number, count) in beyond.into_iter().enumerate() {
            let expected = if [1, 2, 4].contains(&number) { 1000.0 } else { 0.0 };
            let off = (f64::from(count) - expected).abs();
            assert!(off < 4.5 * 29.0 && (count == 0) == (expected == 0.0), "{beyond:?}");
        }
        let mut near = [0; 5];
        for _ in 0..3000 {
            let found = part.one_of(0, Way::Beyond, 1.0, &mut rng);
            near[found.expect("two").0] += 1;
        }
        assert!(
            (f64::from(near[0]) - 2000.0).abs() < 4.5 * 26.0 && near[0] + near[1] == 3000,
            "{near:?}"
        );
        part.all_within(0, 1.0, 6.0);
        part.use_one(0, 4, 0.5);
        let mut booked = 0.0;
        part.book(|(_, power), weight| booked += power * weight);
        assert!((booked - 6.5).abs() < 1e-12, "{booked}");
    }

    #[test]
    fn parts_are_read_as_they_were_written() {
        let mut part = Part::new(5, false);
        for k in 0..7u8 {
            let real = f64::from(k);
            let exit = Exit { direction: DVec3::Z, place: DVec2::splat(real), sin: 0.5 };
            let outcome = FilmOutcome::new(&exit, 0.1 * real, u16::from(k), Course::Turned);
            let light = Stokes { q: 0.5, u: real, v: -0.1, s: DVec3::X };
            part.put(usize::from(k % 3), outcome, Some(light), &[(3, real), (9, 0.25)]);
        }
        assert!(part.has_grown());
        let bytes = part.bytes();
        let read = Part::from_bytes(&bytes, (5, false), 10).expect("as written");
        assert!(!read.has_grown());
        assert_eq!(read.bytes(), bytes);
        assert!(Part::from_bytes(&bytes, (2, false), 10).is_none());
        assert!(Part::from_bytes(&bytes, (5, false), 9).is_none());
        assert!(Part::from_bytes(&bytes[..bytes.len() - 1], (5, false), 10).is_none());
    }
}
