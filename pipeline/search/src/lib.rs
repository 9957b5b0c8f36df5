// SPDX-License-Identifier: MIT OR Apache-2.0
//! Black-box searches over the unit box, by ask and tell: minimisers of one objective, and the
//! Pareto front of two.
//!
//! In come a start, a budget and a seed, then the values of the candidates; out go candidates,
//! generation by generation, and the best of them. A search knows nothing of what the coordinates
//! mean. All chance comes from its seed: the same seed and the same values give the same candidates,
//! to the bit, so a replay of the values restores any state.
//!
//! ```
//! use search::{Minimiser, cma_es::{CmaEs, Settings}};
//!
//! let mut search = CmaEs::new(Settings::new(vec![0.2; 3], 1, 2000));
//! loop {
//!     let candidates = search.ask();
//!     if candidates.is_empty() {
//!         break;
//!     }
//!     let value = |x: &Vec<f64>| x.iter().map(|u| (u - 0.6).powi(2)).sum();
//!     search.tell(&candidates.iter().map(value).collect::<Vec<f64>>());
//! }
//! assert!(search.favourite().iter().all(|u| (u - 0.6).abs() < 1e-4));
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`cma_es`] | CMA-ES, with its weights and its criteria of an end |
//! | [`bipop`] | restarts of CMA-ES with large and small populations |
//! | [`coordinate`] | pattern search along the coordinates, without random numbers |
//! | [`random`] | uniform candidates |
//! | [`nsga2`] | NSGA-II, the Pareto front of two objectives |
//! | [`normal`] | one stream of uniform and normal random numbers |
//! | `box_transform` | map from free coordinates into the box |
//! | `record` | budget, candidates asked last, best candidate |

pub mod bipop;
mod box_transform;
pub mod cma_es;
pub mod coordinate;
pub mod normal;
pub mod nsga2;
pub mod random;
mod record;
#[cfg(test)]
mod tests;

/// A point of the unit box \[0, 1\]^n.
pub type Point = Vec<f64>;

/// A candidate with its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// The candidate.
    pub point: Point,
    /// Objective, smaller is better; infinity where the candidate is infeasible.
    pub value: f64,
}

/// A minimiser that is asked for candidates and told their values.
pub trait Minimiser {
    /// Candidates of the next generation, inside the box; none once the search has ended. Asked
    /// again before it is told, it gives the same ones.
    fn ask(&mut self) -> Vec<Point>;

    /// Takes the values of the candidates asked last, in their order. Infinity and NaN mark an
    /// infeasible candidate.
    ///
    /// # Panics
    ///
    /// Unless there is one value for each candidate asked.
    fn tell(&mut self, values: &[f64]);

    /// Estimate of the optimum, inside the box: the mean of a distribution where the search has
    /// one, the best candidate otherwise. No evaluation may have been spent on it.
    fn favourite(&self) -> Point;

    /// Feasible candidate of the smallest value told.
    fn best(&self) -> Option<&Evaluated>;

    /// Favourite and best candidate of every run, also of the one under way; there is one run unless
    /// the search restarts.
    fn found(&self) -> Vec<(Point, Option<Evaluated>)> {
        vec![(self.favourite(), self.best().cloned())]
    }

    /// Number of values told.
    fn evaluations(&self) -> usize;

    /// Reason of the end of the search, or none while it goes on.
    fn ended(&self) -> Option<&'static str>;

    /// True where the candidates asked next are ranked with some that have been told already, so
    /// that values with a common error must keep it.
    fn reuses_population(&self) -> bool {
        false
    }
}

/// Reason of an end when no further generation fits into the evaluations allowed.
pub const BUDGET_SPENT: &str = "the budget of evaluations is spent";
