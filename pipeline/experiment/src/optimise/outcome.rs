// SPDX-License-Identifier: MIT OR Apache-2.0
//! What came of a candidate, and what the search makes of it.

use anyhow::Result;
use serde::{Deserialize, Serialize};

use super::objective::Evaluation;

/// Outcome of a candidate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Outcome {
    /// Objective and figures.
    Evaluated(Evaluation),
    /// Reason why it was not traced, or gives no objective.
    Refused(String),
}

/// An objective that no design reaches: candidates that miss constraints come after all that meet
/// them, by their miss.
pub(super) const INFEASIBLE: f64 = 1e6;

impl Outcome {
    /// What was judged.
    ///
    /// # Errors
    /// Reason of the refusal.
    pub fn evaluation(self) -> Result<Evaluation> {
        match self {
            Self::Evaluated(judged) => Ok(judged),
            Self::Refused(why) => Err(anyhow::Error::msg(why)),
        }
    }

    /// Value that the search minimises.
    pub fn value(&self) -> f64 {
        match self {
            Self::Evaluated(judged) if judged.miss > 0.0 => INFEASIBLE * (1.0 + judged.miss),
            Self::Evaluated(judged) => judged.objective.value,
            Self::Refused(_) => f64::INFINITY,
        }
    }
}
