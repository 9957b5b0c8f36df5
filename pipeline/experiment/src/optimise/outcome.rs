// SPDX-License-Identifier: MIT OR Apache-2.0
//! What came of a candidate, and what the search makes of it.

use anyhow::Result;

use super::objective::Judged;

/// What came of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Outcome {
    /// Its objective and figures.
    Judged(Judged),
    /// Why it was not traced, or gives no objective.
    Refused(String),
}

/// An objective that no design reaches: candidates that miss constraints come after all that meet
/// them, by their miss.
pub(super) const INFEASIBLE: f64 = 1e6;

impl Outcome {
    /// What was judged.
    ///
    /// # Errors
    /// Why there is nothing.
    pub fn judged(self) -> Result<Judged> {
        match self {
            Self::Judged(judged) => Ok(judged),
            Self::Refused(why) => Err(anyhow::Error::msg(why)),
        }
    }

    /// What the search minimises.
    pub fn value(&self) -> f64 {
        match self {
            Self::Judged(judged) if judged.miss > 0.0 => INFEASIBLE * (1.0 + judged.miss),
            Self::Judged(judged) => judged.value,
            Self::Refused(_) => f64::INFINITY,
        }
    }

    /// The objective where all constraints are met.
    pub fn feasible(&self) -> Option<&Judged> {
        match self {
            Self::Judged(judged) if judged.miss <= 0.0 => Some(judged),
            _ => None,
        }
    }
}
