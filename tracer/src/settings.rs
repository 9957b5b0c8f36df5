// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of a run: how many paths, and how they are traced.

use crate::error::{Error, check, fraction};
use crate::optics::polarisation::Polarisation;

/// Number of paths, and options of tracing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Number of paths; rounded up to a multiple of `groups`.
    pub paths: u64,
    /// Seed of all random streams.
    pub seed: u64,
    /// Number of groups, at least 2; standard errors come from their scatter.
    pub groups: usize,
    /// Surfaces that a path may meet before it is given up.
    pub max_bounces: u32,
    /// Weight, from 0 to 1, below which absorption takes all or nothing.
    pub roulette_below: f64,
    /// True if rays carry their polarisation.
    pub polarisation: Polarisation,
    /// Sampling of the beginnings of paths.
    pub sampling: Sampling,
}

/// Sampling of the beginnings of paths: the source, the place on it and the direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sampling {
    /// Independent of each other.
    #[default]
    Random,
    /// The points of a Sobol' sequence, scrambled afresh for each group: evenly spread within a
    /// group and independent between groups, so standard errors from the scatter of the groups
    /// hold. A group of 2^m paths is spread most evenly. Rays of files and directions of tables are
    /// drawn at random.
    Sobol,
}

impl Settings {
    /// 64 groups, 10 000 bounces, all or nothing below a weight of 0.1, unpolarised light, random
    /// beginnings.
    pub fn new(paths: u64, seed: u64) -> Self {
        Self {
            paths,
            seed,
            groups: 64,
            max_bounces: 10_000,
            roulette_below: 0.1,
            polarisation: Polarisation::Unpolarised,
            sampling: Sampling::Random,
        }
    }

    /// Paths of each group.
    pub(crate) fn in_group(&self) -> u64 {
        self.paths.div_ceil(self.groups as u64)
    }

    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.groups < 2 {
            return Err(Error::TooFew { what: "groups of paths", expected: 2, got: self.groups });
        }
        for (what, value) in
            [("paths", self.paths as f64), ("bounces", f64::from(self.max_bounces))]
        {
            check(what, value, "at least 1", value >= 1.0)?;
        }
        fraction("threshold of the roulette", self.roulette_below).map(|_| ())
    }
}
