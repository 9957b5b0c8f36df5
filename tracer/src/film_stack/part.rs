// SPDX-License-Identifier: MIT OR Apache-2.0
//! Outcomes of light that has met a film stack, and the part of the table that one group of paths
//! draws from.

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::optics::polarisation::Stokes;

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
    /// Surfaces met.
    pub bounces: u32,
    /// Line of the last one in the ledger of the films.
    pub line: u32,
    pub wavelength: u16,
    pub course: Course,
    /// The first of its entries, and their number.
    entries: [u32; 2],
    /// Weight of all rays of the run that it stood for.
    used: f64,
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
            bounces: 0,
            line: 0,
            wavelength,
            course,
            entries: [0; 2],
            used: 0.0,
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

/// Outcomes of a cell of incidence.
#[derive(Debug, Clone, Default)]
struct Cell {
    /// Rays of the run that have met it.
    visits: u32,
    /// Outcomes that they have taken, the first ones.
    taken: u32,
    outcomes: Vec<FilmOutcome>,
    /// Polarisation of each, where light carries it.
    light: Vec<Stokes>,
}

/// The outcomes from which one group of paths draws.
#[derive(Debug)]
pub(super) struct Part {
    cells: Vec<Cell>,
    entries: Vec<Entry>,
    /// Outcomes that rays of the run have taken, of all cells.
    taken: u32,
    has_grown: bool,
}

/// Rays of a cell that each take a new outcome.
const ALWAYS_NEW: u32 = 4;
/// Of those after them, one in so many does.
const REUSED: u32 = 2;
/// Outcomes that a group takes before all rays take known ones.
const ENOUGH: u32 = 1 << 14;
/// Outcomes of a cell, at most.
pub(super) const MOST: u64 = 1 << 20;
/// Bytes of an outcome without entries, with and without light.
const BYTES: [usize; 2] = [47 + 48, 47];

impl Part {
    /// Without outcomes, of so many cells.
    pub fn new(cells: usize) -> Self {
        let cells = vec![Cell::default(); cells];
        Self { cells, entries: Vec::new(), taken: 0, has_grown: false }
    }

    /// The number of the outcome that the next ray of a cell takes, and whether it is yet to be drawn.
    /// The first rays take new ones, and so does one of each few after them, until there are enough;
    /// the others go round. So what a run takes does not depend on what has been drawn before it.
    #[inline]
    pub fn next(&mut self, cell: usize) -> (usize, bool) {
        let cell = &mut self.cells[cell];
        let visit = cell.visits;
        // No group has as many paths.
        cell.visits = visit.saturating_add(1);
        let is_new = match visit.checked_sub(ALWAYS_NEW) {
            None => true,
            Some(beyond) => beyond % REUSED == 0 && self.taken < ENOUGH,
        };
        let turn = if is_new {
            cell.taken += 1;
            self.taken += 1;
            cell.taken - 1
        } else {
            // The next one, so that a path that comes back does not meet its own again.
            (visit - cell.taken) % cell.taken
        } as usize;
        (turn, turn >= cell.outcomes.len())
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
        let cell = &mut self.cells[cell];
        cell.outcomes.push(FilmOutcome { entries, ..outcome });
        cell.light.extend(light);
        self.has_grown = true;
    }

    /// An outcome of a cell, which stands for a ray of this weight.
    #[inline]
    pub fn take(&mut self, cell: usize, turn: usize, weight: f64) -> FilmOutcome {
        let outcome = &mut self.cells[cell].outcomes[turn];
        outcome.used += weight;
        *outcome
    }

    /// The polarisation of an outcome.
    pub fn light(&self, cell: usize, turn: usize) -> Stokes {
        self.cells[cell].light[turn]
    }

    fn entries(&self, outcome: &FilmOutcome) -> &[Entry] {
        let [from, count] = outcome.entries.map(|number| number as usize);
        &self.entries[from..from + count]
    }

    /// Shows entries with the weight that they stood for.
    pub fn book(&self, mut see: impl FnMut(&Entry, f64)) {
        let outcomes = self.cells.iter().flat_map(|cell| &cell.outcomes);
        for outcome in outcomes.filter(|outcome| outcome.used > 0.0) {
            self.entries(outcome).iter().for_each(|entry| see(entry, outcome.used));
        }
    }

    /// All outcomes as bytes, if there are more than were read.
    pub fn grown_bytes(&self) -> Option<Vec<u8>> {
        if !self.has_grown {
            return None;
        }
        let is_carried = self.cells.iter().any(|cell| !cell.light.is_empty());
        let mut bytes = vec![u8::from(is_carried)];
        let filled = self.cells.iter().enumerate().filter(|(_, cell)| !cell.outcomes.is_empty());
        for (number, cell) in filled {
            bytes.extend((number as u32).to_le_bytes());
            bytes.extend((cell.outcomes.len() as u32).to_le_bytes());
            for (turn, outcome) in cell.outcomes.iter().enumerate() {
                bytes.push(outcome.course as u8);
                bytes.extend(outcome.wavelength.to_le_bytes());
                bytes.extend(outcome.bounces.to_le_bytes());
                bytes.extend(outcome.line.to_le_bytes());
                bytes.extend(outcome.weight.to_le_bytes());
                let shape = outcome.direction.to_array().into_iter();
                let shape = shape.chain(outcome.place.to_array()).chain([outcome.sin]);
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
        Some(bytes)
    }

    /// What [`Self::grown_bytes`] made, of as many cells and of accounts below `accounts`; `None` of
    /// other bytes.
    pub fn from_bytes(bytes: &[u8], cells: usize, accounts: u32) -> Option<Self> {
        let mut part = Self::new(cells);
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
        entries: [0; 2],
        used: 0.0,
    };
    let mut reals = bytes[43..].chunks_exact(8).map(double);
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

    /// New outcomes come in order, and known ones are taken about equally often.
    #[test]
    fn visits_take_new_outcomes_in_order() {
        let mut part = Part::new(1);
        let mut uses: Vec<u32> = Vec::new();
        for _ in 0..20 * ENOUGH {
            let (turn, _) = part.next(0);
            assert!(turn <= uses.len());
            if turn == uses.len() {
                uses.push(0);
            }
            uses[turn] += 1;
        }
        assert_eq!(uses.len(), ENOUGH as usize);
        let most = uses.iter().copied().max().expect("some");
        assert!(uses.iter().all(|count| *count > 0) && most <= 24, "{most}");
    }

    #[test]
    fn parts_are_read_as_they_were_written() {
        let mut part = Part::new(5);
        for k in 0..7u8 {
            let real = f64::from(k);
            let exit = Exit { direction: DVec3::Z, place: DVec2::splat(real), sin: 0.5 };
            let outcome = FilmOutcome::new(&exit, 0.1 * real, u16::from(k), Course::Turned);
            let light = Stokes { q: 0.5, u: real, v: -0.1, s: DVec3::X };
            part.put(usize::from(k % 3), outcome, Some(light), &[(3, real), (9, 0.25)]);
        }
        let bytes = part.grown_bytes().expect("new ones");
        let mut read = Part::from_bytes(&bytes, 5, 10).expect("as written");
        assert!(read.grown_bytes().is_none());
        read.has_grown = true;
        assert_eq!(read.grown_bytes().expect("all of it"), bytes);
        assert!(Part::from_bytes(&bytes, 2, 10).is_none());
        assert!(Part::from_bytes(&bytes, 5, 9).is_none());
        assert!(Part::from_bytes(&bytes[..bytes.len() - 1], 5, 10).is_none());
    }
}
