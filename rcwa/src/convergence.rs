// SPDX-License-Identifier: MIT OR Apache-2.0
//! The search for orders and slices that meet a tolerance.
//!
//! In: a function of the highest order M and the number of slices s that gives a vector of
//! efficiencies, and a tolerance. Out: M, s, the values there and an estimate of their error.
//! Slices and orders are raised step by step, each until the change by the next step, continued as
//! a geometric series, is below half the tolerance. The coarser of the last two is kept, so the
//! estimate is measured and not extrapolated. The series is never taken to fall faster than by
//! halves, since efficiencies swing about their limit.
//!
//! Whole hemispheres have a search of their own, [`converge_hemisphere`].

mod hemisphere;

pub use hemisphere::{converge_hemisphere, fine_enough, hemisphere_change, is_of_high_contrast};

use crate::error::{Error, Limit};
use crate::orders::Truncation;

/// Smallest tolerance accepted: below it round-off of many layers is in the way.
pub const SMALLEST_TOLERANCE: f64 = 1e-8;
/// Largest tolerance accepted.
pub const LARGEST_TOLERANCE: f64 = 0.1;

fn check_tolerance(got: f64) -> Result<(), Error> {
    let (smallest, largest) = (SMALLEST_TOLERANCE, LARGEST_TOLERANCE);
    if (smallest..=largest).contains(&got) {
        Ok(())
    } else {
        Err(Error::Tolerance { smallest, largest, got })
    }
}

/// Growth of the number of slices from one attempt to the next.
const SLICE_STEP: f64 = 4.0 / 3.0;
/// Growth of the highest order.
const ORDER_STEP: f64 = 1.15;

/// Shares swing about their limit, so that two steps can look closer to it than they are.
const SAFETY: f64 = 1.7;

/// Bounds of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Range {
    /// First highest order tried, at least the highest that propagates.
    pub first_order: usize,
    /// Largest highest order tried.
    pub last_order: usize,
    /// First number of slices tried, or `None` where the structure is exact as it is.
    pub first_slices: Option<usize>,
    /// Largest number of slices tried.
    pub last_slices: usize,
}

/// The resolution found.
#[derive(Clone, Debug, PartialEq)]
pub struct Converged {
    /// Highest order M.
    pub truncation: Truncation,
    /// Slices (of the coarser run where two are extrapolated).
    pub slices: usize,
    /// The values asked for.
    pub values: Vec<f64>,
    /// Estimated largest error of any value: orders and slices together.
    pub estimated_error: f64,
}

/// Largest difference of any component: the distance in which single numbers are asked for.
pub fn largest_change(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Part of the tolerance that orders and slices may take each.
const PART: f64 = 0.5;

/// Raises orders and slices until `evaluate(M, s)` is known to `tolerance` in the given distance.
///
/// # Errors
/// Those of `evaluate`; a tolerance out of range; no convergence within the range.
pub fn converge(
    tolerance: f64,
    range: Range,
    distance: fn(&[f64], &[f64]) -> f64,
    mut evaluate: impl FnMut(Truncation, usize) -> Result<Vec<f64>, Error>,
) -> Result<Converged, Error> {
    check_tolerance(tolerance)?;
    let start = Truncation::new(range.first_order)?;
    let search =
        |first, last, step| Search { first, last, step, tolerance: PART * tolerance, distance };
    let by_slices = range
        .first_slices
        .map(|first| {
            search(first, range.last_slices, SLICE_STEP)
                .run(None, |s| evaluate(start, s))
                .map_err(|f| f.into_error(tolerance, Limit::Slices, |s| (range.first_order, s)))
        })
        .transpose()?;
    let (slices, slice_error, known) = match by_slices {
        None => (1, 0.0, None),
        Some(found) => (found.at, found.estimate, Some(found.values)),
    };
    let by_orders = search(range.first_order, range.last_order, ORDER_STEP)
        .run(known, |m| evaluate(Truncation::new(m)?, slices))
        .map_err(|f| f.into_error(tolerance, Limit::Orders, |m| (m, slices)))?;
    Ok(Converged {
        truncation: Truncation::new(by_orders.at)?,
        slices,
        values: by_orders.values,
        estimated_error: slice_error + by_orders.estimate,
    })
}

enum Failure {
    Solver(Error),
    Exhausted { at: usize, estimate: f64 },
}

impl Failure {
    fn into_error(
        self,
        tolerance: f64,
        limit: Limit,
        place: impl Fn(usize) -> (usize, usize),
    ) -> Error {
        match self {
            Self::Solver(error) => error,
            Self::Exhausted { at, estimate } => {
                let (truncation, slices) = place(at);
                Error::NotConverged {
                    limit,
                    tolerance,
                    allowed: PART * tolerance,
                    estimate,
                    truncation,
                    slices,
                }
            }
        }
    }
}

/// One resolution raised alone.
struct Search {
    first: usize,
    last: usize,
    step: f64,
    tolerance: f64,
    distance: fn(&[f64], &[f64]) -> f64,
}

/// The end of a search.
struct SearchResult {
    at: usize,
    values: Vec<f64>,
    estimate: f64,
}

impl Search {
    /// The first resolution whose values are within the tolerance of the limit, with the estimated
    /// distance.
    fn run(
        &self,
        known: Option<Vec<f64>>,
        mut evaluate: impl FnMut(usize) -> Result<Vec<f64>, Error>,
    ) -> Result<SearchResult, Failure> {
        let mut here = self.first;
        let mut values = match known {
            Some(values) => values,
            None => evaluate(here).map_err(Failure::Solver)?,
        };
        let mut before: Option<f64> = None;
        let mut estimate = f64::INFINITY;
        loop {
            let next = ((here as f64 * self.step).ceil() as usize).max(here + 1);
            if next > self.last {
                return Err(Failure::Exhausted { at: here, estimate });
            }
            let finer = evaluate(next).map_err(Failure::Solver)?;
            let change = (self.distance)(&values, &finer);
            // All later steps together, if each changes as much less than the one before as this
            // one did.
            let ratio =
                before.map_or(0.6, |b: f64| (change / b.max(f64::MIN_POSITIVE)).clamp(0.5, 0.8));
            estimate = SAFETY * change / (1.0 - ratio);
            if estimate <= self.tolerance {
                return Ok(SearchResult { at: here, values, estimate });
            }
            before = Some(change);
            (here, values) = (next, finer);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A model whose error is known: 1 - 0.5^(M/4) - 1/s².
    fn model(truncation: Truncation, slices: usize) -> Vec<f64> {
        let s = slices as f64;
        vec![1.0 - 0.5_f64.powf(truncation.highest() as f64 / 4.0) - 1.0 / (s * s)]
    }

    fn found(tolerance: f64, range: Range) -> Result<Converged, Error> {
        converge(tolerance, range, largest_change, |m, s| Ok(model(m, s)))
    }

    const RANGE: Range =
        Range { first_order: 4, last_order: 400, first_slices: Some(4), last_slices: 100_000 };

    #[test]
    fn estimate_bounds_the_true_error() {
        for tolerance in [1e-2, 1e-3, 1e-5, 1e-7] {
            let Converged { values, estimated_error, .. } = found(tolerance, RANGE).unwrap();
            let error = (values[0] - 1.0).abs();
            assert!(error <= estimated_error, "{error} against {estimated_error}");
            assert!(estimated_error <= tolerance);
        }
    }

    #[test]
    fn giving_up_says_where() {
        let short = Range { last_slices: 50, ..RANGE };
        let error = found(1e-6, short).unwrap_err().to_string();
        assert!(error.contains("slices") && error.contains("1.0e-6"), "{error}");
    }

    #[test]
    fn tolerance_out_of_range_is_refused() {
        for tolerance in [0.0, -1.0, 1.0, f64::NAN] {
            assert!(matches!(found(tolerance, RANGE), Err(Error::Tolerance { .. })));
        }
    }
}
