// SPDX-License-Identifier: MIT OR Apache-2.0
//! Result of a run: sums of power for each group of paths, and estimates with standard errors
//! from them.

use rayon::prelude::*;

use crate::ledger::Ledger;
use crate::statistics::{Estimate, Moments, jackknife};

/// Bins added up at a time.
const BLOCK: usize = 2048;

/// The ledger and the readings of some paths, scaled so that the sources emit the power of the
/// scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Totals {
    /// Account of the power.
    pub ledger: Ledger,
    /// Power in each bin (W), for each receiver in the order given to the run.
    pub readings: Vec<Vec<f64>>,
}

impl Totals {
    /// All powers, those of the ledger first.
    pub(crate) fn powers(&mut self) -> impl Iterator<Item = &mut f64> {
        self.ledger.powers().chain(self.readings.iter_mut().flatten())
    }

    /// All powers times `factor`.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.powers().for_each(|power| *power *= factor);
    }

    /// self · a + other · b.
    pub(crate) fn combine(&mut self, a: f64, other: &Self, b: f64) {
        self.ledger.combine(a, &other.ledger, b);
        for (mine, theirs) in self.readings.iter_mut().zip(&other.readings) {
            for (x, &y) in mine.iter_mut().zip(theirs) {
                *x = *x * a + y * b;
            }
        }
    }
}

/// The result of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Number of paths traced (a multiple of the number of groups).
    pub paths: u64,
    /// Number of surfaces met by all paths.
    pub hits: u64,
    /// Each group by itself.
    pub groups: Vec<Totals>,
    /// All groups together.
    pub total: Totals,
}

impl Outcome {
    /// `groups` must not be empty; all have the same number of paths.
    pub(crate) fn new(paths: u64, hits: u64, groups: Vec<Totals>) -> Self {
        let mut total = groups[0].clone();
        for group in &groups[1..] {
            total.ledger.combine(1.0, &group.ledger, 1.0);
        }
        total.ledger.scale(1.0 / groups.len() as f64);
        // Some bins of all groups at a time: short runs would wait for one thread that goes over
        // all of them again and again.
        for (receiver, sums) in total.readings.iter_mut().enumerate() {
            sums.par_chunks_mut(BLOCK).enumerate().for_each(|(part, sums)| {
                for group in &groups[1..] {
                    let bins = &group.readings[receiver][part * BLOCK..];
                    sums.iter_mut().zip(bins).for_each(|(sum, bin)| *sum += bin);
                }
                for sum in sums {
                    *sum *= 1.0 / groups.len() as f64;
                }
            });
        }
        Self { paths, hits, groups, total }
    }

    /// The same with groups next to each other merged, so that `count` are left.
    ///
    /// # Panics
    /// Unless `count` divides the number of groups.
    #[must_use]
    pub fn merged(self, count: usize) -> Self {
        assert!(
            count > 0 && self.groups.len().is_multiple_of(count),
            "{} groups cannot become {count}",
            self.groups.len()
        );
        let together = self.groups.len() / count;
        let share = 1.0 / together as f64;
        let mut groups: Vec<Totals> = Vec::with_capacity(count);
        for (number, mut group) in self.groups.into_iter().enumerate() {
            match groups.last_mut() {
                Some(last) if !number.is_multiple_of(together) => last.combine(1.0, &group, share),
                _ => {
                    group.scale(share);
                    groups.push(group);
                }
            }
        }
        Self { groups, ..self }
    }

    /// A number derived from the totals, such as extraction or uniformity, with its jackknife
    /// standard error.
    pub fn jackknife(&self, metric: impl Fn(&Totals) -> f64) -> Estimate {
        self.jackknife_many(|totals| vec![metric(totals)])[0]
    }

    /// Several numbers derived from the totals at once; `metric` must always return the same number
    /// of values.
    pub fn jackknife_many(&self, metric: impl Fn(&Totals) -> Vec<f64>) -> Vec<Estimate> {
        let count = self.groups.len() as f64;
        let whole = metric(&self.total);
        let mut left_out = vec![Vec::with_capacity(self.groups.len()); whole.len()];
        let mut rest = self.total.clone();
        for group in &self.groups {
            rest.clone_from(&self.total);
            rest.combine(count / (count - 1.0), group, -1.0 / (count - 1.0));
            for (values, value) in left_out.iter_mut().zip(metric(&rest)) {
                values.push(value);
            }
        }
        whole.iter().zip(&left_out).map(|(&value, left_out)| jackknife(value, left_out)).collect()
    }

    /// Power in every bin of a receiver (W), with its standard error from the scatter of the
    /// groups.
    pub fn bins(&self, receiver: usize) -> Vec<Estimate> {
        let bins = self.total.readings[receiver].len();
        (0..bins)
            .map(|bin| {
                self.groups
                    .iter()
                    .map(|group| group.readings[receiver][bin])
                    .collect::<Moments>()
                    .estimate()
            })
            .collect()
    }

    /// Mean over the groups of a number that is linear in the power (W), with its standard error.
    pub fn mean(&self, quantity: impl Fn(&Totals) -> f64) -> Estimate {
        self.groups.iter().map(quantity).collect::<Moments>().estimate()
    }
}
