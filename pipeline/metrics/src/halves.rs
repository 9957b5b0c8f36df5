// SPDX-License-Identifier: MIT OR Apache-2.0
//! Halves of the groups of a trace, for many ways to halve them.
//!
//! Way s sends group g to the half with the parity of the common bits of g and s (a Walsh code): each
//! way from 1 halves the groups, and no two ways halve them alike. The sums of both halves for all 2^k
//! ways take k steps, each of which adds two neighbours of the step before as they are, or with the
//! halves of the second exchanged. Nothing is subtracted, so that a half without light is exactly 0.

use rayon::prelude::*;

use super::jackknife::Grouped;

/// Numbers of one block, over all ways: they fit the cache of a core.
const BLOCK: usize = 1 << 15;
/// Most numbers of all ways together.
const MOST: usize = 1 << 23;

/// Estimates of the total from each half of the groups, for every way to halve them.
pub(super) struct Halves<'a> {
    observed: &'a Grouped,
    ways: usize,
    /// Sums by blocks of bins; in each by ways, halves, bins. Empty where they would be too many.
    blocks: Vec<Vec<f64>>,
}

impl<'a> Halves<'a> {
    /// The halves of `observed`, by all ways.
    pub fn new(observed: &'a Grouped) -> Self {
        let (bins, ways) = (observed.total().len(), observed.count().next_power_of_two());
        let width = (BLOCK / (2 * ways)).max(1);
        let is_small = 2 * ways * bins <= MOST;
        let starts = (0..if is_small { bins } else { 0 }).into_par_iter().step_by(width);
        let block = |start: usize| block_sums(observed, start..bins.min(start + width), ways);
        Self { observed, ways, blocks: starts.map(block).collect() }
    }

    /// Both halves by one way, from 1.
    pub fn of(&self, way: usize) -> [Vec<f64>; 2] {
        let count = self.observed.count();
        let half = |g: usize| ((g & way).count_ones() % 2) as usize;
        let second = (0..count).filter(|g| half(*g) == 1).count();
        let mut sums = if self.blocks.is_empty() { self.summed(half) } else { self.taken(way) };
        for (sum, count_of_half) in sums.iter_mut().zip([count - second, second]) {
            let scale = count as f64 / count_of_half.max(1) as f64;
            for value in sum {
                *value *= scale;
            }
        }
        sums
    }

    fn taken(&self, way: usize) -> [Vec<f64>; 2] {
        let bins = self.observed.total().len();
        [0, 1].map(|half| {
            let mut sums = Vec::with_capacity(bins);
            for block in &self.blocks {
                let width = block.len() / (2 * self.ways);
                sums.extend_from_slice(&block[(2 * way + half) * width..][..width]);
            }
            sums
        })
    }

    fn summed(&self, half: impl Fn(usize) -> usize) -> [Vec<f64>; 2] {
        let bins = self.observed.total().len();
        let mut sums = [vec![0.0; bins], vec![0.0; bins]];
        for g in 0..self.observed.count() {
            add(&mut sums[half(g)], self.observed.group(g));
        }
        sums
    }
}

/// Sums of these bins by ways, halves and bins.
fn block_sums(observed: &Grouped, bins: std::ops::Range<usize>, ways: usize) -> Vec<f64> {
    let width = bins.len();
    let mut sums = vec![0.0; 2 * ways * width];
    for (g, pair) in sums.chunks_exact_mut(2 * width).take(observed.count()).enumerate() {
        pair[..width].copy_from_slice(&observed.group(g)[bins.clone()]);
    }
    let mut apart = 1;
    while apart < ways {
        for both in sums.chunks_exact_mut(4 * apart * width) {
            let (first, second) = both.split_at_mut(2 * apart * width);
            let pairs = first.chunks_exact_mut(2 * width).zip(second.chunks_exact_mut(2 * width));
            for (kept, exchanged) in pairs {
                let (kept_even, kept_odd) = kept.split_at_mut(width);
                let (other_even, other_odd) = exchanged.split_at_mut(width);
                let evens = kept_even.iter_mut().zip(other_even);
                let odds = kept_odd.iter_mut().zip(other_odd);
                for ((x_even, y_even), (x_odd, y_odd)) in evens.zip(odds) {
                    let alike = [*x_even + *y_even, *x_odd + *y_odd];
                    let crossed = [*x_even + *y_odd, *x_odd + *y_even];
                    [*x_even, *x_odd] = alike;
                    [*y_even, *y_odd] = crossed;
                }
            }
        }
        apart *= 2;
    }
    sums
}

fn add(sums: &mut [f64], values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_equal_and_differ_from_way_to_way() {
        let grouped = Grouped::new((0..8).map(|g| vec![f64::from(g)]).collect());
        let halves = Halves::new(&grouped);
        for (way, expected) in [(1, [24.0, 32.0]), (2, [20.0, 36.0]), (7, [28.0, 28.0])] {
            assert_eq!(halves.of(way), expected.map(|sum| vec![sum]));
        }
    }

    #[test]
    fn fast_sums_are_plain_sums_and_halves_without_light_are_dark() {
        // A number of groups that is no power of two, and more bins than a block holds.
        let value = |g: usize, bin: usize| match bin % 3 {
            0 if g == bin % 7 => 0.1 + bin as f64,
            0 => 0.0,
            _ => 1.0 / (1.0 + (g * bin) as f64),
        };
        let groups = (0..12).map(|g| (0..5000).map(|bin| value(g, bin)).collect());
        let grouped = Grouped::new(groups.collect());
        let fast = Halves::new(&grouped);
        assert!(fast.blocks.len() > 1);
        let plain = Halves { blocks: Vec::new(), ..Halves::new(&grouped) };
        for way in 1..12 {
            for (fast, plain) in fast.of(way).iter().zip(&plain.of(way)) {
                assert_eq!(fast.len(), plain.len());
                for (fast, plain) in fast.iter().zip(plain) {
                    assert!((fast - plain).abs() <= 1e-13 * plain, "{fast} {plain}");
                }
            }
        }
    }
}
