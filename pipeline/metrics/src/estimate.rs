// SPDX-License-Identifier: MIT OR Apache-2.0
//! A value with its standard error.

use schemars::JsonSchema;
use serde::de::{Error, Unexpected};
use serde::{Deserialize, Deserializer, Serialize};

/// Standard errors of a difference by which two values must differ to be told apart.
pub const DISTINCT: f64 = 3.0;

/// A figure with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// One standard deviation of the value.
    #[serde(deserialize_with = "standard_error")]
    pub standard_error: f64,
    /// For figures that pick a largest or smallest bin: bound b of the bias that picking leaves.
    /// The standard error holds b/√3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bias_bound: Option<f64>,
}

impl Estimate {
    /// A value with its standard error and no selection in it.
    pub fn new(value: f64, standard_error: f64) -> Self {
        Self { value, standard_error, bias_bound: None }
    }

    /// A value with scatter `scatter` that lies anywhere between two others: their middle.
    pub fn between(low: f64, high: f64, scatter: f64) -> Self {
        let bound = 0.5 * (high - low).abs();
        Self {
            value: 0.5 * (low + high),
            standard_error: scatter.hypot(bound / 3f64.sqrt()),
            bias_bound: Some(bound),
        }
    }

    /// The same with so much more of bias.
    #[must_use]
    pub fn with_bias(self, more: f64) -> Self {
        let bound = self.bias_bound.unwrap_or(0.0) + more;
        Self {
            standard_error: self.scatter().hypot(bound / 3f64.sqrt()),
            bias_bound: Some(bound),
            ..self
        }
    }

    /// The part of the standard error that other paths would show.
    pub fn scatter(&self) -> f64 {
        let of_bias = self.bias_bound.map_or(0.0, |bound| bound * bound / 3.0);
        (self.standard_error * self.standard_error - of_bias).max(0.0).sqrt()
    }

    /// True unless the bias that picking may leave exceeds the scatter.
    pub fn is_resolved(&self) -> bool {
        self.bias_bound.is_none_or(|bound| bound <= self.scatter())
    }

    /// The ends between which a figure lies that is not resolved, with 95 % confidence or more; `None`
    /// of one that is. Its bias is an estimate, of two readings or of bins twice as wide, and may be
    /// twice as large: they lie beyond it by two standard errors, which hold it.
    pub fn interval(&self) -> Option<[f64; 2]> {
        self.ends(2.0 * self.standard_error)
    }

    /// The same of a bias that no place exceeds: nothing counts it twice.
    pub fn interval_of_bound(&self) -> Option<[f64; 2]> {
        self.ends(2.0 * self.scatter())
    }

    fn ends(&self, beyond: f64) -> Option<[f64; 2]> {
        let reach = self.bias_bound.unwrap_or(0.0) + beyond;
        (!self.is_resolved()).then_some([self.value - reach, self.value + reach])
    }

    /// The same in a unit that is smaller by `factor`.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            standard_error: self.standard_error * factor,
            bias_bound: self.bias_bound.map(|bound| bound * factor),
        }
    }

    /// The same with another error beside its own.
    #[must_use]
    pub fn with_error(self, error: f64) -> Self {
        Self { standard_error: self.standard_error.hypot(error), ..self }
    }

    /// A rising function of the value, which is not negative, though noise may drive it there. One
    /// that two errors lead to 0 is not resolved: the function bends there, and lies between those of
    /// 1.5 errors below and above.
    #[must_use]
    pub fn mapped(self, f: impl Fn(f64) -> f64) -> Self {
        let at = |error: f64| f((self.value.max(0.0) + error).max(0.0));
        let half = |error: f64| 0.5 * (at(error) - at(-error));
        if self.value < 2.0 * self.standard_error {
            let reach = 1.5 * self.standard_error;
            return Self::between(at(-reach), at(reach), 0.0);
        }
        let bias_bound = self.bias_bound.map(half);
        let of_bias = bias_bound.unwrap_or(0.0) / 3f64.sqrt();
        let standard_error = half(self.scatter()).hypot(of_bias);
        Self { value: at(0.0), standard_error, bias_bound }
    }

    /// The square root; that of a value that noise drives below 0 is 0. The error is the larger of
    /// the steps to the roots of one standard error above and below.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = |square: f64| square.max(0.0).sqrt();
        let value = root(self.value);
        let up = root(self.value.max(0.0) + self.standard_error) - value;
        let down = value - root(self.value - self.standard_error);
        Self::new(value, up.max(down))
    }
}

/// Reads a standard error, which is not negative.
pub fn standard_error<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let error = f64::deserialize(deserializer)?;
    if error < 0.0 {
        let expected = &"a number of at least 0";
        return Err(D::Error::invalid_value(Unexpected::Float(error), expected));
    }
    Ok(error)
}
