// SPDX-License-Identifier: MIT OR Apache-2.0
//! How many orders and slices a tolerance takes, within a bounded amount of work.
//!
//! In: what is to be known, as a function of the highest order M and the number of slices s, and how far two such answers are apart. Out: M, s
//! and the estimated errors. M and s are raised in turns: s until what it leaves is well below what M leaves, then M until the reverse
//! holds, until both are below half the tolerance. The error that a resolution leaves is what the next step changes, extended as a
//! geometric series to all further steps. Shares swing about their limit while orders are added, so that one step may change little by chance: before
//! orders are found to be enough, they are compared with all steps up to half as many more, and the largest of these changes is continued by the law
//! 1/M, the slowest that is met, by TM at metal. Work is counted, not timed, so that the outcome is the same on every machine.

use std::collections::BTreeSet;

use rcwa::Error;

/// Growth from one number of slices to the next.
const SLICE_STEP: f64 = 4.0 / 3.0;
/// Growth of the highest order.
const ORDER_STEP: f64 = 1.15;
/// Orders are compared with up to so many times as many, and at least so many more, before they are found to be enough.
const FAR_ENOUGH: f64 = 1.5;
const LEAST_BEYOND: f64 = 4.0;
/// Shares swing about their limit in the largest of the changes too.
const SWING: f64 = 1.3;
/// One error is well below the other.
const WELL_BELOW: f64 = 0.2;
/// Work that one search may take, in eigenproblems of real numbers of size 1 with what comes with them.
const MOST_WORK: f64 = 2e10;
/// Evaluations that a search makes in any case where it has to come back with an estimate.
const LEAST_EVALUATIONS: usize = 3;

/// Two numbers that make up a resolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Resolution {
    /// Highest order M.
    pub order: usize,
    /// Slices of the coarser of the two runs that are extrapolated.
    pub slices: usize,
}

impl Resolution {
    /// One step of the search ahead, along the orders.
    fn more_orders(self) -> Self {
        let order = raised(self.order, ORDER_STEP);
        Self { order, ..self }
    }

    /// One step of the search ahead, along the slices.
    pub(super) fn more_slices(self) -> Self {
        let slices = raised(self.slices, SLICE_STEP);
        Self { slices, ..self }
    }
}

/// What is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    /// Where to begin.
    pub first: Resolution,
    /// Where to give up.
    pub last: Resolution,
    /// Whether slices matter: not where the structure is exact as it is.
    pub sliced: bool,
    /// Work of an eigenproblem relative to one of real numbers of the same size.
    pub weight: f64,
}

impl Range {
    fn work(&self, at: Resolution) -> f64 {
        // s and 2s slices.
        self.weight * ((2 * at.order + 1) as f64).powi(3) * 3.0 * at.slices as f64
    }
}

/// Estimated errors by their origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ErrorParts {
    /// Left by the orders.
    pub orders: f64,
    /// Left by the slices.
    pub slices: f64,
}

impl ErrorParts {
    fn unknown(range: Range) -> Self {
        Self {
            orders: f64::INFINITY,
            slices: if range.sliced { f64::INFINITY } else { 0.0 },
        }
    }
}

/// Where a search ended.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SearchResult {
    pub at: Resolution,
    pub errors: ErrorParts,
    /// What stopped it before its aim was reached.
    pub limit: Option<Limit>,
}

impl SearchResult {
    /// Where nothing is to be searched.
    pub(super) fn at_first(range: Range) -> Self {
        Self {
            at: range.first,
            errors: ErrorParts::unknown(range),
            limit: None,
        }
    }
}

/// What a search does not pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Limit {
    #[error("more than {0} as the highest order")]
    Orders(usize),
    #[error("more than {0} slices")]
    Slices(usize),
    #[error("more work than one case is allowed")]
    Work,
}

/// An evaluation that failed, or was not to be made.
enum Halt {
    Failed(Error),
    Limit(Limit),
}

/// Which of the two numbers is raised.
#[derive(Clone, Copy)]
enum Raised {
    Orders,
    Slices,
}

/// A search on its way; `D` tells how far two answers are apart.
pub(super) struct Search<T, D, F> {
    range: Range,
    distance: D,
    evaluate: F,
    /// Evaluations made whatever they cost.
    free: usize,
    made: BTreeSet<Resolution>,
    spent: f64,
    at: Resolution,
    answer: Option<T>,
    errors: ErrorParts,
}

impl<T, D, F> Search<T, D, F>
where
    D: Fn(&T, &T) -> f64,
    F: FnMut(Resolution) -> Result<T, Error>,
{
    pub(super) fn new(range: Range, distance: D, evaluate: F) -> Self {
        Self {
            range,
            distance,
            evaluate,
            free: 0,
            made: BTreeSet::new(),
            spent: 0.0,
            at: range.first,
            answer: None,
            errors: ErrorParts::unknown(range),
        }
    }

    /// Raises orders and slices until both together leave no more than `tolerance`, or a limit is met.
    ///
    /// # Errors
    /// Those of the evaluation.
    pub(super) fn both(mut self, tolerance: f64) -> Result<SearchResult, Error> {
        let halt = self.alternate(0.5 * tolerance).err();
        self.end(halt)
    }

    /// Raises slices alone until they leave no more than `aim`, or no more than `share` of what the orders leave, or a limit is met.
    /// An estimate is made in any case.
    ///
    /// # Errors
    /// Those of the evaluation.
    pub(super) fn slices(mut self, aim: f64, share: f64) -> Result<SearchResult, Error> {
        self.free = LEAST_EVALUATIONS;
        let halt = match self.look(Raised::Orders, None) {
            Ok(_) => {
                let aim = aim.max(share * self.errors.orders);
                self.raise(Raised::Slices, aim).err()
            }
            Err(halt) => Some(halt),
        };
        self.end(halt)
    }

    fn end(self, halt: Option<Halt>) -> Result<SearchResult, Error> {
        let limit = match halt {
            Some(Halt::Failed(error)) => return Err(error),
            Some(Halt::Limit(limit)) => Some(limit),
            None => None,
        };
        Ok(SearchResult {
            at: self.at,
            errors: self.errors,
            limit,
        })
    }

    fn alternate(&mut self, aim: f64) -> Result<(), Halt> {
        self.look(Raised::Orders, None)?;
        loop {
            self.raise(Raised::Slices, aim.max(WELL_BELOW * self.errors.orders))?;
            self.raise(Raised::Orders, aim.max(WELL_BELOW * self.errors.slices))?;
            if self.errors.orders.max(self.errors.slices) <= aim {
                return Ok(());
            }
        }
    }

    /// Raises one of the numbers until what it leaves is below `aim`; the coarser of the last two is kept, whose error has been seen.
    fn raise(&mut self, axis: Raised, aim: f64) -> Result<(), Halt> {
        if matches!(axis, Raised::Slices) && !self.range.sliced {
            return Ok(());
        }
        let mut before = None;
        loop {
            let (next, finer, change) = self.look(axis, before)?;
            let left = match axis {
                Raised::Orders => self.errors.orders,
                Raised::Slices => self.errors.slices,
            };
            if left <= aim && (matches!(axis, Raised::Slices) || self.look_far()? <= aim) {
                return Ok(());
            }
            before = Some(change);
            (self.at, self.answer) = (next, Some(finer));
        }
    }

    /// One step ahead along one of the numbers, and the error here that follows from it and from the change `before`.
    fn look(&mut self, axis: Raised, before: Option<f64>) -> Result<(Resolution, T, f64), Halt> {
        let here = match self.answer.take() {
            Some(answer) => answer,
            None => self.answer_at(self.at)?,
        };
        let next = match axis {
            Raised::Orders => self.at.more_orders(),
            Raised::Slices => self.at.more_slices(),
        };
        let finer = self.answer_at(next);
        let here = self.answer.insert(here);
        let finer = finer?;
        let change = (self.distance)(here, &finer);
        let left = left(change, before);
        match axis {
            Raised::Orders => self.errors.orders = left,
            Raised::Slices => self.errors.slices = left,
        }
        Ok((next, finer, change))
    }

    /// What the orders leave here by all steps up to [`FAR_ENOUGH`].
    fn look_far(&mut self) -> Result<f64, Halt> {
        let order = self.at.order as f64;
        let far = (FAR_ENOUGH * order).max(order + LEAST_BEYOND);
        let (mut next, mut largest) = (self.at, 0.0_f64);
        while (next.order as f64) < far {
            next = next.more_orders();
            let finer = self.answer_at(next)?;
            if let Some(here) = &self.answer {
                largest = largest.max((self.distance)(here, &finer));
            }
        }
        self.errors.orders = left_by_orders(largest, self.at.order, next.order);
        Ok(self.errors.orders)
    }

    fn answer_at(&mut self, resolution: Resolution) -> Result<T, Halt> {
        let (last, work) = (self.range.last, self.range.work(resolution));
        let limit = if resolution.order > last.order {
            Some(Limit::Orders(last.order))
        } else if self.range.sliced && resolution.slices > last.slices {
            Some(Limit::Slices(last.slices))
        } else if self.made.contains(&resolution) {
            None
        } else if self.made.len() >= self.free && self.spent + work > MOST_WORK {
            Some(Limit::Work)
        } else {
            None
        };
        if let Some(limit) = limit {
            return Err(Halt::Limit(limit));
        }
        // Answers are kept by whoever gives them.
        if self.made.insert(resolution) {
            self.spent += work;
        }
        (self.evaluate)(resolution).map_err(Halt::Failed)
    }
}

/// What a resolution leaves: the change by the next step and all later ones together, if each changes as much less than the one before
/// as this one did less than the change `before`.
pub(super) fn left(change: f64, before: Option<f64>) -> f64 {
    let ratio = before.map_or(0.5, |b| (change / b.max(f64::MIN_POSITIVE)).clamp(0.0, 0.8));
    change / (1.0 - ratio)
}

/// What `order` as the highest order leaves, if all up to `far` change by at most `change`: by the law 1/M.
pub(super) fn left_by_orders(change: f64, order: usize, far: usize) -> f64 {
    SWING * change / (1.0 - order as f64 / far as f64)
}

fn raised(number: usize, step: f64) -> usize {
    ((number as f64 * step).ceil() as usize).max(number + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGE: Range = Range {
        first: Resolution {
            order: 4,
            slices: 4,
        },
        last: Resolution {
            order: 400,
            slices: 100_000,
        },
        sliced: true,
        weight: 1e-3,
    };

    fn apart() -> impl Fn(&f64, &f64) -> f64 {
        |a, b| (a - b).abs()
    }

    /// A model whose errors are known: 0.5^(M/4) by orders, `slope` / s² by slices.
    fn model(slope: f64) -> impl Fn(Resolution) -> Result<f64, Error> {
        move |at| {
            let (m, s) = (at.order as f64, at.slices as f64);
            Ok(1.0 - 0.5_f64.powf(m / 4.0) - slope / (s * s))
        }
    }

    #[test]
    fn estimates_bound_the_true_error_and_keep_below_the_tolerance() {
        for slope in [0.0, 1.0, 30.0] {
            for tolerance in [1e-2, 1e-3, 1e-5] {
                let truth = model(slope);
                let found = Search::new(RANGE, apart(), &truth).both(tolerance).unwrap();
                let error = (truth(found.at).unwrap() - 1.0).abs();
                let estimate = found.errors.orders + found.errors.slices;
                assert_eq!(found.limit, None);
                assert!(error <= estimate && estimate <= tolerance, "{found:?}");
            }
        }
    }

    #[test]
    fn slices_wait_while_the_orders_leave_more() {
        // Orders never settle: slices must not be raised far before that is found out.
        let restless = |at: Resolution| Ok((at.order as f64).sin() - 1.0 / at.slices as f64);
        let found = Search::new(RANGE, apart(), restless).both(1e-3).unwrap();
        assert!(found.limit.is_some() && found.at.slices < 100, "{found:?}");
        assert!(found.errors.orders > 1e-3);
    }

    #[test]
    fn each_limit_is_named() {
        let limit = |range: Range, tolerance| {
            let found = Search::new(range, apart(), model(1.0)).both(tolerance);
            found.unwrap().limit
        };
        let mut short = RANGE;
        short.last.slices = 50;
        assert_eq!(limit(short, 1e-5), Some(Limit::Slices(50)));
        short = RANGE;
        short.last.order = 20;
        assert_eq!(limit(short, 1e-3), Some(Limit::Orders(20)));
        short = RANGE;
        short.weight = 1e5;
        assert_eq!(limit(short, 1e-3), Some(Limit::Work));
        // Too much from the first: nothing is evaluated.
        short.weight = 1e12;
        let never = |_| -> Result<f64, Error> { panic!("was evaluated") };
        let found = Search::new(short, apart(), never).both(1e-3).unwrap();
        assert_eq!(found.limit, Some(Limit::Work));
    }

    #[test]
    fn slices_alone_always_come_back_with_an_estimate() {
        let mut dear = RANGE;
        dear.weight = 1e12;
        let found = Search::new(dear, apart(), model(1.0))
            .slices(1e-6, 0.0)
            .unwrap();
        assert!(found.errors.slices.is_finite() && found.limit == Some(Limit::Work));
        let found = Search::new(RANGE, apart(), model(1.0))
            .slices(1e-6, 0.0)
            .unwrap();
        assert!(found.errors.slices <= 1e-6 && found.limit.is_none());
        assert_eq!(found.at.order, 4);
        // With a share of what four orders leave, far fewer will do.
        let coarse = Search::new(RANGE, apart(), model(1.0))
            .slices(1e-6, 0.01)
            .unwrap();
        assert!(coarse.at.slices < found.at.slices / 10, "{coarse:?}");
    }
}
