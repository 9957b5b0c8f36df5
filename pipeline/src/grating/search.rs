// SPDX-License-Identifier: MIT OR Apache-2.0
//! Search for the orders and slices that a tolerance takes, within a bounded amount of work.
//!
//! The search raises the highest order M and the number of slices s in turns: s until its error is
//! well below that of M, then M until the reverse holds, until both are below half the tolerance.
//! The error of a resolution is the change by the next step, extended as a geometric series to all
//! further steps.
//!
//! Efficiencies swing about their limit while orders are added, so that one step may change little
//! by chance. Before M is found to be enough, it is compared with all steps up to half as many
//! orders more. The largest of these changes is continued by the law 1/M, the slowest that occurs
//! (TM at metal). Work is counted, not timed, so that the result is the same on every machine.

use std::collections::BTreeSet;

use rcwa::Error;

/// Growth from one number of slices to the next.
const SLICE_STEP: f64 = 4.0 / 3.0;
/// Growth of the highest order.
const ORDER_STEP: f64 = 1.15;
/// Orders are compared with up to this multiple, and with at least so many more, before they are
/// enough.
const FAR_ENOUGH: f64 = 1.5;
const LEAST_BEYOND: f64 = 4.0;
/// Factor for the swing of efficiencies about their limit.
const SWING: f64 = 1.3;
/// Ratio at which one error is well below the other.
const WELL_BELOW: f64 = 0.2;
/// Work of one search, in real eigenproblems of size 1.
const MOST_WORK: f64 = 2e10;
/// Evaluations that a search makes whatever they cost, where it must return an estimate.
const LEAST_EVALUATIONS: usize = 3;

/// A resolution of one case.
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

/// Range of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    /// First resolution.
    pub first: Resolution,
    /// Last resolution.
    pub last: Resolution,
    /// True if slices matter; not for a structure that is exact as it is.
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
        Self { orders: f64::INFINITY, slices: if range.sliced { f64::INFINITY } else { 0.0 } }
    }
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SearchResult {
    pub at: Resolution,
    pub errors: ErrorParts,
    /// Limit that stopped it before its aim.
    pub limit: Option<Limit>,
}

impl SearchResult {
    /// The first resolution, where nothing is searched.
    pub(super) fn at_first(range: Range) -> Self {
        Self { at: range.first, errors: ErrorParts::unknown(range), limit: None }
    }
}

/// Limits of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Limit {
    #[error("more than {0} as the highest order")]
    Orders(usize),
    #[error("more than {0} slices")]
    Slices(usize),
    #[error("more work than one case is allowed")]
    Work,
}

/// End of a search: a failed evaluation or a limit.
enum Halt {
    Failed(Error),
    Limit(Limit),
}

/// The number that a step raises.
#[derive(Clone, Copy)]
enum Raised {
    Orders,
    Slices,
}

/// A search in progress; `D` is the distance of two answers.
pub(super) struct Search<T, D, F> {
    range: Range,
    distance: D,
    evaluate: F,
    /// Evaluations allowed whatever they cost.
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

    /// Raises orders and slices until the error of both together is at most `tolerance`, or a limit
    /// is met.
    ///
    /// # Errors
    /// Errors of the evaluation.
    pub(super) fn both(mut self, tolerance: f64) -> Result<SearchResult, Error> {
        let halt = self.alternate(0.5 * tolerance).err();
        self.end(halt)
    }

    /// Raises slices until their error is at most `aim`, or at most `share` of the error of the
    /// orders, or a limit is met. Always returns an estimate.
    ///
    /// # Errors
    /// Errors of the evaluation.
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
        Ok(SearchResult { at: self.at, errors: self.errors, limit })
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

    /// Raises one number until its error is below `aim`; keeps the coarser of the last two
    /// resolutions, whose error is known.
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

    /// Evaluates one step ahead; estimates the error here from the change by it and from the change
    /// `before`.
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

    /// Error of the orders here, from all steps up to [`FAR_ENOUGH`].
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
        // The evaluation keeps its answers itself.
        if self.made.insert(resolution) {
            self.spent += work;
        }
        (self.evaluate)(resolution).map_err(Halt::Failed)
    }
}

/// Error of a resolution: the sum of all further changes, if each shrinks as this one did from the
/// change `before`.
pub(super) fn left(change: f64, before: Option<f64>) -> f64 {
    let ratio = before.map_or(0.5, |b| (change / b.max(f64::MIN_POSITIVE)).clamp(0.0, 0.8));
    change / (1.0 - ratio)
}

/// Error of `order` by the law 1/M, if all orders up to `far` change by at most `change`.
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
        first: Resolution { order: 4, slices: 4 },
        last: Resolution { order: 400, slices: 100_000 },
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
        let found = Search::new(dear, apart(), model(1.0)).slices(1e-6, 0.0).unwrap();
        assert!(found.errors.slices.is_finite() && found.limit == Some(Limit::Work));
        let found = Search::new(RANGE, apart(), model(1.0)).slices(1e-6, 0.0).unwrap();
        assert!(found.errors.slices <= 1e-6 && found.limit.is_none());
        assert_eq!(found.at.order, 4);
        // With a share of what four orders leave, far fewer will do.
        let coarse = Search::new(RANGE, apart(), model(1.0)).slices(1e-6, 0.01).unwrap();
        assert!(coarse.at.slices < found.at.slices / 10, "{coarse:?}");
    }
}
