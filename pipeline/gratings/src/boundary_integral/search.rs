// SPDX-License-Identifier: MIT OR Apache-2.0
//! The search for a fineness that leaves no more than a tolerance.
//!
//! Nodes are raised by steps of 1.4. The error of the finest solution is the largest change of any
//! efficiency by the last step, as long as changes fall to less than half of the one before; where
//! they fall more slowly their geometric series is summed. The energy balance, which nothing enforces,
//! bounds it from below.

use super::error::IntegralError;
use super::nodes::Fineness;
use super::solution::Solution;
use super::solve::Grating;
use rcwa::Progress;

/// Fineness that a search begins with.
const FIRST: Fineness = Fineness { per_wavelength: 4.5, at_corners: 12, grading: 4 };
/// Ratio of nodes from step to step.
const STEP: f64 = 1.4;
/// Ratio of a second change to the first, before it is known.
const FIRST_FALL: f64 = 0.75;
/// Changes below this are rounding, which does not fall.
const ROUNDING: f64 = 1e-10;
/// Steps after which the changes of the last two tell how they go on.
const SURE: usize = 3;
/// Most nodes: a matrix of 3200 rows.
const MOST_SEARCHED: usize = 1600;

/// The finest solution of a search.
#[derive(Clone, Debug)]
pub struct Converged {
    /// The solution.
    pub solution: Solution,
    /// Largest error of an efficiency, estimated; infinite where nothing tells it.
    pub error: f64,
}

impl Grating {
    /// Solves as [`Grating::solve`] with more and more nodes until the error is within the tolerance, or
    /// will not come there with 1600 of them.
    ///
    /// # Errors
    /// As [`Grating::solve`]; [`IntegralError::Stopped`] if `progress` says so.
    pub fn converge(
        &self,
        kx0: f64,
        tolerance: f64,
        progress: &Progress<'_>,
    ) -> Result<Converged, IntegralError> {
        let solution = self.solve_within(kx0, FIRST, MOST_SEARCHED)?;
        let mut best = Converged { solution, error: f64::INFINITY };
        let (mut change, mut factor) = (f64::INFINITY, 1.0);
        for step in 1.. {
            factor *= STEP;
            let left = (MOST_SEARCHED as f64 / best.solution.nodes() as f64).ln() / STEP.ln();
            if left < 1.0 {
                break;
            }
            if progress(0).is_break() {
                return Err(IntegralError::Stopped);
            }
            let solution = self.solve(kx0, FIRST.refined(factor))?;
            let before =
                std::mem::replace(&mut change, solution.largest_difference(&best.solution));
            let error = error_left(change, before).max(solution.worst_balance());
            best = Converged { error, solution };
            // Falling on like this, it would not come there.
            let is_hopeless = step > SURE && change * (change / before).powf(left) > tolerance;
            if error <= tolerance || is_hopeless {
                break;
            }
        }
        Ok(best)
    }
}

/// Error of the finer of two solutions by their change, and the change before.
fn error_left(change: f64, before: f64) -> f64 {
    // The first change is taken to fall slowly.
    let fall = if before.is_finite() { change / before } else { FIRST_FALL };
    if change.max(before) < ROUNDING {
        change.max(before)
    } else if fall < 1.0 {
        change * (fall / (1.0 - fall)).max(1.0)
    } else {
        f64::INFINITY
    }
}
