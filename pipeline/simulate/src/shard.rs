// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shards: the parts into which the pieces of a job are dealt, so that several processes compute it.
//!
//! A piece is a table of a ring or a part of a task, such as a group of paths. Tables go by cost, the
//! largest first, each to the shard with the least so far. Parts of tasks follow in their order, so
//! that a shard has neighbours of few tasks, and fill every shard up to one level. The deal depends
//! on costs and number of shards alone: every process finds the same.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fmt::{self, Display};
use std::ops::{Range, RangeInclusive};
use std::str::FromStr;

/// Numbers of shards that a job may have.
pub const SHARDS: RangeInclusive<usize> = 1..=100_000;

/// Some shards of a job: `5/8`, or several, `0,5/8`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShardChoice {
    /// Their numbers, from 0, each once.
    pub numbers: Vec<usize>,
    /// How many the job has.
    pub count: usize,
}

impl FromStr for ShardChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = || {
            let (numbers, count) = text.split_once('/')?;
            let mut numbers = numbers
                .split(',')
                .map(|number| number.trim().parse().ok())
                .collect::<Option<Vec<usize>>>()?;
            numbers.sort_unstable();
            numbers.dedup();
            let count = count.trim().parse().ok()?;
            SHARDS.contains(&count).then_some(Self { numbers, count })
        };
        parsed().ok_or_else(|| {
            let (low, high) = (SHARDS.start(), SHARDS.end());
            format!(
                "expected I/N such as 0/8, or several as 0,5/8, with N from {low} to {high} and I from 0"
            )
        })
    }
}

impl Display for ShardChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers: Vec<String> = self.numbers.iter().map(ToString::to_string).collect();
        write!(f, "{}/{}", numbers.join(","), self.count)
    }
}

/// The pieces of one task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskPieces {
    /// How many they are.
    pub count: u64,
    /// Cost of each.
    pub cost: f64,
}

/// The pieces of one shard.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Share {
    /// Numbers of tables.
    pub tables: Vec<usize>,
    /// Numbers of tasks, ascending, and of their pieces.
    pub tasks: Vec<(usize, Range<u64>)>,
    /// Cost of all of them.
    pub cost: f64,
}

/// Deals tables and pieces of tasks, by their costs, to `count` shards.
pub fn partition(tables: &[f64], tasks: &[TaskPieces], count: usize) -> Vec<Share> {
    let mut shares = vec![Share::default(); count.max(1)];
    partition_tables(tables, &mut shares);
    partition_tasks(tasks, &mut shares);
    shares
}

fn partition_tables(tables: &[f64], shares: &mut [Share]) {
    let mut order: Vec<usize> = (0..tables.len()).collect();
    order.sort_by(|&a, &b| tables[b].total_cmp(&tables[a]).then(a.cmp(&b)));
    // The bits of positive numbers are ordered as they are.
    let load = |share: &Share| share.cost.to_bits();
    let loads = shares.iter().enumerate();
    let mut least: BinaryHeap<_> = loads.map(|(i, s)| Reverse((load(s), i))).collect();
    for table in order {
        let Some(Reverse((_, shard))) = least.pop() else {
            return;
        };
        let share = &mut shares[shard];
        share.tables.push(table);
        share.cost += tables[table];
        least.push(Reverse((load(share), shard)));
    }
}

fn partition_tasks(tasks: &[TaskPieces], shares: &mut [Share]) {
    let all: f64 = tasks.iter().map(|task| task.count as f64 * task.cost).sum();
    let level = level(shares, all);
    let mut shard = 0;
    // Cost of the pieces up to the end of the shard's own.
    let room = |share: &Share| (level - share.cost).max(0.0);
    let mut end = room(&shares[0]);
    let mut before = 0.0;
    for (number, task) in tasks.iter().enumerate() {
        for piece in 0..task.count {
            while shard + 1 < shares.len() && before + 0.5 * task.cost > end {
                shard += 1;
                end += room(&shares[shard]);
            }
            before += task.cost;
            match shares[shard].tasks.last_mut() {
                Some((last, pieces)) if *last == number => pieces.end = piece + 1,
                _ => shares[shard].tasks.push((number, piece..piece + 1)),
            }
        }
    }
    for share in shares {
        let own = share.tasks.iter();
        share.cost += own
            .map(|(task, pieces)| (pieces.end - pieces.start) as f64 * tasks[*task].cost)
            .sum::<f64>();
    }
}

/// The cost up to which `more` fills the shares: Σ max(0, level - cost) = more.
fn level(shares: &[Share], more: f64) -> f64 {
    let mut costs: Vec<f64> = shares.iter().map(|share| share.cost).collect();
    costs.sort_by(f64::total_cmp);
    let mut below = 0.0;
    for (number, cost) in costs.iter().enumerate() {
        below += cost;
        let level = (more + below) / (number + 1) as f64;
        if costs.get(number + 1).is_none_or(|next| level <= *next) {
            return level;
        }
    }
    more
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_are_read_as_they_are_written() {
        let of = |text: &str| text.parse::<ShardChoice>();
        for (text, numbers, count) in [("0/1", vec![0], 1), ("5, 2,5/8", vec![2, 5], 8)] {
            assert_eq!(of(text), Ok(ShardChoice { numbers, count }));
        }
        assert_eq!(of("5,2/8").expect("valid").to_string(), "2,5/8");
        for bad in ["", "3", "1/0", "-1/8", "a/8", "1/", "/8", "1.5/8", "0/1000000"] {
            assert!(of(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn every_piece_goes_to_one_shard_and_shards_cost_the_same() {
        let tables: Vec<f64> = (1..=26).map(|k| f64::from(k * k)).collect();
        let tasks = [(64, 3.0), (1, 5.0), (64, 0.5), (0, 1.0), (64, 20.0)];
        let tasks = tasks.map(|(count, cost)| TaskPieces { count, cost });
        let whole: f64 =
            tables.iter().sum::<f64>() + tasks.iter().map(|t| t.count as f64 * t.cost).sum::<f64>();
        for count in [1, 2, 3, 8, 64, 1000] {
            let shares = partition(&tables, &tasks, count);
            assert_eq!(shares.len(), count);
            let mut dealt: Vec<usize> = shares.iter().flat_map(|s| s.tables.clone()).collect();
            dealt.sort_unstable();
            assert!(dealt.into_iter().eq(0..tables.len()));
            let mut next = [0; 5];
            for (task, pieces) in shares.iter().flat_map(|s| s.tasks.clone()) {
                assert_eq!(pieces.start, next[task]);
                next[task] = pieces.end;
            }
            assert_eq!(next, [64, 1, 64, 0, 64]);
            let sum: f64 = shares.iter().map(|s| s.cost).sum();
            assert!((sum - whole).abs() < 1e-9 * whole);
            // Beside the largest piece, no shard has more than its part.
            let most = shares.iter().map(|s| s.cost).fold(0.0, f64::max);
            let largest = 26.0 * 26.0;
            assert!(most <= (whole / count as f64 + 20.0).max(largest), "{count}: {most}");
        }
    }

    #[test]
    fn a_job_of_nothing_is_dealt() {
        assert_eq!(partition(&[], &[], 3), vec![Share::default(); 3]);
    }
}
