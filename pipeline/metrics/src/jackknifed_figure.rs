// SPDX-License-Identifier: MIT OR Apache-2.0
//! A figure with its jackknife replicates.

use serde::{Deserialize, Serialize};

use super::Estimate;
use super::jackknife::spread;

/// One figure of one trace, with its jackknife replicates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JackknifedFigure {
    /// Best value.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Values without each group of paths.
    pub without: Vec<f64>,
}

impl JackknifedFigure {
    /// A figure by its value and its replicates.
    pub fn new(value: f64, without: Vec<f64>) -> Self {
        Self { value, standard_error: spread(&without), without }
    }

    /// Value with standard error.
    pub fn estimate(&self) -> Estimate {
        Estimate::new(self.value, self.standard_error)
    }
}
