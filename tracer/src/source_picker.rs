// SPDX-License-Identifier: MIT OR Apache-2.0
//! Choice of the source of each path, in proportion to the weights.
//!
//! Steps of the golden ratio from a random start, or the points of a Sobol' sequence, which then
//! choose direction and place of the ray too.

use rand::Rng;

use crate::random;
use crate::ray::Ray;
use crate::scene::PlacedSource;
use crate::source::sobol::SobolSequence;

/// Fractional part of the golden ratio: steps of it spread evenly over [0, 1) however many are
/// taken.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Picks the source of every path.
pub(crate) struct SourcePicker<'a> {
    sources: &'a [PlacedSource],
    /// 0, then [`PlacedSource::cumulated`] of all.
    cumulated: Vec<f64>,
    pick: f64,
    sobol: Option<SobolSequence>,
    /// Number of the next path.
    number: u64,
}

impl<'a> SourcePicker<'a> {
    /// Steps from a random start.
    pub fn new(sources: &'a [PlacedSource], rng: &mut impl Rng) -> Self {
        Self {
            sources,
            cumulated: std::iter::once(0.0)
                .chain(sources.iter().map(|placed| placed.cumulated))
                .collect(),
            pick: random::unit(rng),
            sobol: None,
            number: 0,
        }
    }

    /// Takes the first `paths` points of a Sobol' sequence, scrambled by `rng`.
    pub fn scramble(&mut self, paths: u64, rng: &mut impl Rng) {
        self.sobol = Some(SobolSequence::new(paths, rng));
    }

    /// True if paths begin at Sobol' points.
    pub fn by_sobol(&self) -> bool {
        self.sobol.is_some()
    }

    /// The ray with which path `number` begins at a source; `rng` is the stream of the path.
    #[inline]
    pub fn begin(
        &mut self,
        number: u64,
        placed: &PlacedSource,
        offset: f64,
        rng: &mut impl Rng,
    ) -> Ray {
        match &mut self.sobol {
            None => placed.source.sample(offset, rng),
            Some(sobol) => placed.source.begin(offset, &sobol.point(number), rng),
        }
    }

    /// The next source and its number.
    #[inline]
    pub fn next(&mut self) -> (usize, &'a PlacedSource) {
        let number = self.number();
        (number, &self.sources[number])
    }

    /// The points by which paths begin, if they do.
    pub fn sobol(&mut self) -> Option<&mut SobolSequence> {
        self.sobol.as_mut()
    }

    /// The number of the next source.
    #[inline]
    pub fn number(&mut self) -> usize {
        if self.sources.len() == 1 {
            return 0;
        }
        if let Some(sobol) = &mut self.sobol {
            let turn = sobol.point(self.number).turn;
            self.number += 1;
            return self.at(turn);
        }
        self.pick += GOLDEN;
        if self.pick >= 1.0 {
            self.pick -= 1.0;
        }
        self.at(self.pick)
    }

    /// The first source whose sum lies above `pick`.
    #[inline]
    pub fn at(&self, pick: f64) -> usize {
        let (sums, count) = (&self.cumulated, self.sources.len());
        // Where all weigh the same the guess is right.
        let guess = ((pick * count as f64) as usize).min(count - 1);
        if sums[guess] <= pick && pick < sums[guess + 1] {
            return guess;
        }
        (sums[1..].partition_point(|sum| *sum <= pick)).min(count - 1)
    }
}
