// SPDX-License-Identifier: MIT OR Apache-2.0
//! Targets of figures, and verdicts on their values.

use serde::{Deserialize, Serialize};

use metrics::estimate::DISTINCT;
use metrics::{Bounds, Estimate};

/// Sought value of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sought {
    /// A value, within a scale.
    Near(f64),
    /// Bounds.
    Within(Bounds),
}

/// A target with its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Sought value.
    pub sought: Sought,
    /// A miss that counts as 1.
    pub scale: f64,
}

/// Verdict on a figure with a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Within the target beyond errors.
    Met,
    /// Outside of the target beyond errors.
    NotMet,
    /// Errors decide.
    NotResolved,
}

impl Verdict {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::NotMet => "not met",
            Self::NotResolved => "not resolved",
        }
    }
}

impl Target {
    /// Signed distance of `value` from the target in scales; 0 within bounds.
    pub fn miss(self, value: f64) -> f64 {
        let miss = match self.sought {
            Sought::Near(target) => value - target,
            Sought::Within(Bounds { at_least, at_most }) => {
                let below = at_least.map_or(0.0, |least| (value - least).min(0.0));
                below + at_most.map_or(0.0, |most| (value - most).max(0.0))
            }
        };
        miss / self.scale
    }

    /// Verdict on a figure: it meets the target where it lies within the scale of a value, or
    /// within bounds.
    pub fn verdict(self, figure: Estimate) -> Verdict {
        let value = figure.value;
        let room = match self.sought {
            Sought::Near(target) => self.scale - (value - target).abs(),
            Sought::Within(Bounds { at_least, at_most }) => {
                let above = at_least.map_or(f64::INFINITY, |least| value - least);
                above.min(at_most.map_or(f64::INFINITY, |most| most - value))
            }
        };
        let error = DISTINCT * figure.standard_error;
        match room {
            room if room >= error => Verdict::Met,
            room if room < -error => Verdict::NotMet,
            _ => Verdict::NotResolved,
        }
    }

    /// For people.
    pub fn words(self) -> String {
        match self.sought {
            Sought::Near(target) => format!("near {target} by {}", self.scale),
            Sought::Within(bounds) => bounds.words(),
        }
    }
}
