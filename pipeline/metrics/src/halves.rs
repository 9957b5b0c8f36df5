// SPDX-License-Identifier: MIT OR Apache-2.0
//! Halves of the groups of a trace, for many ways to halve them, and figures that are picked by them.
//!
//! Way s sends group g to the half with the parity of the common bits of g and s (a Walsh code): each
//! way from 1 halves the groups, and no two ways halve them alike. Ways that differ in their lowest
//! bits alone are summed together: groups whose lowest bits agree are added once, then each step
//! adds two neighbours of the step before as they are, or with the halves of the second exchanged.
//! Nothing is subtracted, so that a half without light is exactly 0.

use rayon::prelude::*;

use super::Estimate;
use super::jackknife::{Grouped, jackknife};

/// Most ways that are summed together, a power of two, and most bins of all of them.
const TOGETHER: usize = 8;
const MOST_BINS: usize = 1 << 21;
/// Bins whose sums by all these ways fit the cache of a core.
const BLOCK: usize = 512;

/// What `read` makes of the estimates of the total from both halves of the groups, by each way from
/// 1 to `last`.
pub(super) fn by_halves<T: Send>(
    observed: &Grouped,
    last: usize,
    read: impl Fn([Vec<f64>; 2]) -> T + Sync,
) -> Vec<T> {
    let affordable = (MOST_BINS / observed.total().len().max(1)).clamp(1, TOGETHER);
    // The power of two that is no larger.
    let together = 1 << affordable.ilog2();
    let starts = (0..last + 1).into_par_iter().step_by(together);
    let of_run = |start: usize| {
        let halves = halves(observed, start, together).into_par_iter().enumerate();
        // Way 0 halves nothing.
        let wanted = halves.filter(|(k, _)| (1..=last).contains(&(start + k)));
        wanted.map(|(_, halves)| read(halves)).collect::<Vec<T>>()
    };
    starts.map(of_run).collect::<Vec<_>>().into_iter().flatten().collect()
}

/// The standard error of a figure from its values in both halves of the paths, over many halvings:
/// the root mean square of half their difference. It holds for extremes too.
pub(super) fn half_difference(halves: impl Iterator<Item = [f64; 2]>) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for [a, b] in halves {
        squares += 0.25 * (a - b).powi(2);
        count += 1.0;
    }
    (squares / f64::max(count, 1.0)).sqrt()
}

/// A figure that is read at a place which noise helps to choose, such as a largest bin. What all
/// paths read at their own place lies too far out; what one half reads at the place of the other
/// does not. The value is the middle. The scatter is that of halves that each choose their own, or
/// the jackknife error, if that is less: halves may choose far off where all paths do not.
pub(super) fn picked<P>(
    observed: &Grouped,
    pick: impl Fn(&[f64]) -> P + Sync,
    read: impl Fn(&P, &[f64]) -> f64 + Sync,
) -> Estimate {
    let plain = read(&pick(observed.total()), observed.total());
    let of_halves = |[a, b]: [Vec<f64>; 2]| {
        let [of_a, of_b] = [pick(&a), pick(&b)];
        let crossed = 0.5 * (read(&of_a, &b) + read(&of_b, &a));
        (crossed, [read(&of_a, &a), read(&of_b, &b)])
    };
    let halves = by_halves(observed, observed.count() - 1, of_halves);
    let (crossed, own): (Vec<f64>, Vec<[f64; 2]>) = halves.into_iter().unzip();
    let crossed = crossed.iter().sum::<f64>() / own.len() as f64;
    let held = jackknife(observed, |sums| read(&pick(sums), sums)).standard_error;
    Estimate::between(plain, crossed, half_difference(own.into_iter()).min(held))
}

/// Estimates of the total from both halves, by so many ways from `start`, which is a multiple of
/// their number.
fn halves(observed: &Grouped, start: usize, together: usize) -> Vec<[Vec<f64>; 2]> {
    let (bins, count) = (observed.total().len(), observed.count());
    let parity = |bits: usize| (bits.count_ones() % 2) as usize;
    let mut all = vec![[vec![0.0; bins], vec![0.0; bins]]; together];
    for first in (0..bins).step_by(BLOCK) {
        let block = first..bins.min(first + BLOCK);
        let mut sums = vec![[[0.0; BLOCK]; 2]; together];
        for g in 0..count {
            let half = &mut sums[g % together][parity(g & start)];
            for (sum, value) in half.iter_mut().zip(&observed.group(g)[block.clone()]) {
                *sum += value;
            }
        }
        let mut apart = 1;
        while apart < together {
            for both in sums.chunks_exact_mut(2 * apart) {
                let (kept, exchanged) = both.split_at_mut(apart);
                kept.iter_mut().zip(exchanged).for_each(|(kept, exchanged)| cross(kept, exchanged));
            }
            apart *= 2;
        }
        for (halves, sums) in all.iter_mut().zip(&sums) {
            for (half, sums) in halves.iter_mut().zip(sums) {
                half[block.clone()].copy_from_slice(&sums[..block.len()]);
            }
        }
    }
    for (way, halves) in all.iter_mut().enumerate() {
        let second = (0..count).filter(|g| parity(g & (start + way)) == 1).count();
        for (half, of_half) in halves.iter_mut().zip([count - second, second]) {
            let scale = count as f64 / of_half.max(1) as f64;
            for value in half {
                *value *= scale;
            }
        }
    }
    all
}

/// Adds the halves of both, to `kept` as they are, to `exchanged` crosswise.
fn cross([a, b]: &mut [[f64; BLOCK]; 2], [c, d]: &mut [[f64; BLOCK]; 2]) {
    let (left, right) = (a.iter_mut().zip(b), c.iter_mut().zip(d));
    for ((a, b), (c, d)) in left.zip(right) {
        [*a, *b, *c, *d] = [*a + *c, *b + *d, *a + *d, *b + *c];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_equal_and_differ_from_way_to_way() {
        let grouped = Grouped::new((0..8).map(|g| vec![f64::from(g)]).collect());
        let all = by_halves(&grouped, 7, |halves| halves.map(|half| half[0]));
        assert_eq!(all.len(), 7);
        assert_eq!([all[0], all[1], all[6]], [[24.0, 32.0], [20.0, 36.0], [28.0, 28.0]]);
    }

    #[test]
    fn sums_of_many_ways_are_plain_sums_and_halves_without_light_are_dark() {
        // A number of groups that is no power of two, and more bins than a block holds.
        const COUNT: usize = 20;
        let value = |g: usize, bin: usize| match bin % 3 {
            0 if g == bin % 7 => 0.1 + bin as f64,
            0 => 0.0,
            _ => 1.0 / (1.0 + (g * bin) as f64),
        };
        let group = |g| (0..BLOCK + 100).map(|bin| value(g, bin)).collect();
        let grouped = Grouped::new((0..COUNT).map(group).collect());
        for (way, halves) in (1..).zip(by_halves(&grouped, COUNT - 1, |halves| halves)) {
            for (parity, half) in halves.iter().enumerate() {
                let groups = (0..COUNT).filter(|g| (g & way).count_ones() as usize % 2 == parity);
                let groups: Vec<usize> = groups.collect();
                let scale = COUNT as f64 / groups.len() as f64;
                assert_eq!(half.len(), BLOCK + 100);
                for (bin, sum) in half.iter().enumerate() {
                    let plain = scale * groups.iter().map(|g| value(*g, bin)).sum::<f64>();
                    assert!((sum - plain).abs() <= 1e-13 * plain, "{way} {bin} {sum} {plain}");
                }
            }
        }
    }
}
