// SPDX-License-Identifier: MIT OR Apache-2.0
//! Filters: which light a receiver reads, by source, number of surfaces met and last surface.

use crate::scene::Lines;

/// Choice of the light that is read: all of it by default.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    /// Only light whose last surface has this name in the ledger, in words or with underscores
    /// between them.
    pub last_surface: Option<String>,
    /// Only light that met its last surface farther from the axis of that body than the first and
    /// not farther than the second, mm. On an upright wall at exactly one of them rounding decides.
    pub last_radii_mm: Option<[f64; 2]>,
    /// Smallest and largest number of surfaces met so far; reflection, refraction and scattering
    /// count one each.
    pub bounces: [u32; 2],
    /// Only light of these sources: those of the first instance, of the second, and so on, those of
    /// the world last, from 0.
    pub sources: Option<Vec<usize>>,
}

impl Default for Filter {
    fn default() -> Self {
        Self { last_surface: None, last_radii_mm: None, bounces: [0, u32::MAX], sources: None }
    }
}

/// Past of a path, for filters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PathHistory {
    /// Number of its source.
    pub source: u32,
    /// Surfaces met so far.
    pub bounces: u32,
    /// Line of the last surface in the ledger, [`PathHistory::NO_LINE`] before the first one.
    pub line: u32,
    /// x and y of the last interaction in the frame of its body, mm.
    pub at: [f64; 2],
    /// True of light that receivers into a narrow cone have read, traced backwards.
    pub is_seen: bool,
}

impl PathHistory {
    /// No surface.
    pub const NO_LINE: u32 = u32::MAX;

    /// Of a path that begins.
    #[inline]
    pub fn new(source: u32) -> Self {
        Self { source, bounces: 0, line: Self::NO_LINE, at: [0.0; 2], is_seen: false }
    }

    /// Notes an interaction with the surface of this line.
    #[inline]
    pub fn meet(&mut self, line: usize, at: [f64; 2]) {
        self.bounces += 1;
        self.line = line as u32;
        self.at = at;
        self.is_seen = false;
    }
}

/// A filter with its name replaced by lines of the ledger.
pub(super) struct CompiledFilter<'a> {
    filter: &'a Filter,
    lines: Option<Vec<usize>>,
}

impl<'a> CompiledFilter<'a> {
    pub fn new(filter: &'a Filter, lines: &Lines) -> Self {
        let name = filter.last_surface.as_ref();
        Self { lines: name.map(|name| lines_named(lines, name)), filter }
    }

    /// True if light of this past is read.
    pub fn passes(&self, history: &PathHistory) -> bool {
        let Filter { last_radii_mm, bounces: [min, max], sources, .. } = self.filter;
        let line = history.line as usize;
        let last = history.line != PathHistory::NO_LINE;
        let [x, y] = history.at;
        let within = |[low, high]: [f64; 2]| {
            let radius = x.hypot(y);
            last && radius > low && radius <= high
        };
        (*min..=*max).contains(&history.bounces)
            && (self.lines.as_ref()).is_none_or(|lines| last && lines.contains(&line))
            && last_radii_mm.is_none_or(within)
            && (sources.as_ref()).is_none_or(|all| all.contains(&(history.source as usize)))
    }
}

/// A name as keys of ledgers have it.
pub fn underscored(name: &str) -> String {
    name.replace([' ', ','], "_")
}

/// Lines of the ledger with this name, in words or with underscores between them; one for parts of
/// the skin of a body and one for others.
pub(super) fn lines_named(all: &Lines, name: &str) -> Vec<usize> {
    all.surfaces
        .iter()
        .enumerate()
        .filter(|(_, known)| underscored(known) == underscored(name))
        .map(|(number, _)| number)
        .collect()
}
