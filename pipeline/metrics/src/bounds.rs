// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bounds of a figure.

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

/// A least value, a largest one, or both.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Least value.
    pub at_least: Option<f64>,
    /// Largest value.
    pub at_most: Option<f64>,
}

impl Bounds {
    /// # Errors
    /// No bound, one that is not finite, bounds that cross.
    pub fn new(at_least: Option<f64>, at_most: Option<f64>) -> Result<Self> {
        ensure!(
            at_least.is_some() || at_most.is_some(),
            "expected `at_least`, `at_most` or both, got neither"
        );
        for (key, bound) in [("at_least", at_least), ("at_most", at_most)] {
            ensure!(
                bound.is_none_or(f64::is_finite),
                "{key}: expected a finite number, got {}",
                bound.unwrap_or_default()
            );
        }
        if let Some((low, high)) = at_least.zip(at_most) {
            ensure!(
                low <= high,
                "at_least, at_most: expected a number and a larger one, got {low} and {high}"
            );
        }
        Ok(Self { at_least, at_most })
    }

    /// For people, such as `at least 0.8 and at most 0.9`.
    pub fn words(&self) -> String {
        let bounds = [("at least", self.at_least), ("at most", self.at_most)];
        let words = bounds.into_iter();
        let words = words.filter_map(|(words, bound)| Some(format!("{words} {}", bound?)));
        words.collect::<Vec<_>>().join(" and ")
    }

    /// How far `value` lies beyond the bounds, each moved inwards by `margin`, as a share of the
    /// bound; 0 within them.
    pub fn miss(&self, value: f64, margin: f64) -> f64 {
        let share = |beyond: f64, bound: f64| beyond / bound.abs().max(1e-9);
        let low = self.at_least.map(|low| share(low + margin - value, low));
        let high = self.at_most.map(|high| share(value + margin - high, high));
        low.unwrap_or(0.0).max(high.unwrap_or(0.0)).max(0.0)
    }
}
