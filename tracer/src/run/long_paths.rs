// SPDX-License-Identifier: MIT OR Apache-2.0
//! Roulette among long paths: of two from one source in one body, at one wavelength, that have met as
//! many surfaces, one goes on with the weight of both.
//!
//! Light that a body holds by total reflection keeps its weight and would be followed for thousands
//! of surfaces. Where a path has met [`LONG`] surfaces, and again at every doubling, it waits for the
//! next that comes so far. One of both, chosen by their weights, goes on with their sum: the mean
//! of every reading stays. No weight is made, lost, or moved through a surface, so that the power of a
//! group, the flux through every surface and the books of every source balance to rounding. Of n
//! paths that stay for ever, n/2 go beyond `LONG`, n/4 beyond twice as many.

use super::walk::Walker;
use crate::optics::polarisation::Light;
use crate::path::PathState;
use crate::random::{self, PathStream};

/// Surfaces after which a path is long.
pub(super) const LONG: u32 = 256;

/// A path with its light and its random numbers.
type Waiting<L> = (PathState, L, PathStream);

/// Long paths that wait for another of their kind, by the number of doublings.
pub(super) struct LongPaths<L> {
    waiting: Vec<Vec<Waiting<L>>>,
}

impl<L> Default for LongPaths<L> {
    fn default() -> Self {
        Self { waiting: Vec::new() }
    }
}

impl<L: Light> LongPaths<L> {
    /// Takes a path that has met [`LONG`] surfaces; returns how many surfaces were met since.
    pub fn take(&mut self, walker: &mut impl Walker<L>, path: Waiting<L>) -> u64 {
        let (mut path, mut hits) = (path, 0);
        for level in 0.. {
            if self.waiting.len() <= level {
                self.waiting.push(Vec::new());
            }
            let waiting = &mut self.waiting[level];
            let Some(other) = waiting.iter().position(|other| are_alike(&path.0, &other.0)) else {
                waiting.push(path);
                return hits;
            };
            path = one_of(path, waiting.swap_remove(other));
            let (is_over, met) = walk_on(walker, &mut path, level);
            hits += met;
            if is_over {
                return hits;
            }
        }
        hits
    }

    /// Follows those that wait to their ends; returns how many surfaces they met.
    pub fn finish(mut self, walker: &mut impl Walker<L>) -> u64 {
        let mut hits = 0;
        for level in 0.. {
            let Some(waiting) = self.waiting.get_mut(level).map(std::mem::take) else {
                break;
            };
            for mut path in waiting {
                let (is_over, met) = walk_on(walker, &mut path, level);
                hits += met;
                if !is_over {
                    // Among those that wait for the next level, which come last.
                    if self.waiting.len() <= level + 1 {
                        self.waiting.push(Vec::new());
                    }
                    let next = &mut self.waiting[level + 1];
                    match next.iter().position(|other| are_alike(&path.0, &other.0)) {
                        Some(other) => {
                            let joined = one_of(path, next.swap_remove(other));
                            next.push(joined);
                        }
                        None => next.push(path),
                    }
                }
            }
        }
        hits
    }
}

/// True of paths from one source in one body at one wavelength.
fn are_alike(one: &PathState, other: &PathState) -> bool {
    one.location == other.location
        && one.history.source == other.history.source
        && one.wavelength == other.wavelength
}

/// One of two paths, by their weights, with the weight of both.
fn one_of<L>(mut one: Waiting<L>, other: Waiting<L>) -> Waiting<L> {
    let sum = one.0.weight + other.0.weight;
    if random::unit(&mut one.2) * sum < other.0.weight {
        one = other;
    }
    one.0.weight = sum;
    one
}

/// Follows a path to the surface at which the next level begins; true if it has ended, and how many
/// it met.
fn walk_on<L: Light>(
    walker: &mut impl Walker<L>,
    (state, light, stream): &mut Waiting<L>,
    level: usize,
) -> (bool, u64) {
    let before = state.history.bounces;
    let next = LONG.checked_shl(level as u32 + 1).unwrap_or(u32::MAX);
    let is_over = walker.walk_to(state, light, stream, next.max(before + 1));
    (is_over, u64::from(state.history.bounces - before))
}
