// SPDX-License-Identifier: MIT OR Apache-2.0
//! The paper's figures, compiled in from `data/published/tables.toml`.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use serde::Deserialize;

/// Text of the file.
pub const TABLES: &str = include_str!("../../data/published/tables.toml");

/// Published figures of one design and model.
pub type Figures = BTreeMap<String, f64>;

/// All published figures.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Published {
    /// Where they were published.
    pub source: String,
    /// Design → model → figure → value (fractions and degrees).
    #[serde(flatten)]
    pub designs: BTreeMap<String, BTreeMap<String, Figures>>,
}

impl Published {
    /// The compiled-in figures.
    pub fn load() -> Result<Self> {
        toml::from_str(TABLES).context("data/published/tables.toml")
    }

    /// The figure, if the paper gives it.
    pub fn figure(&self, design: &str, model: &str, figure: &str) -> Option<f64> {
        self.designs.get(design)?.get(model)?.get(figure).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_both_tables_are_there() {
        let published = Published::load().expect("valid");
        assert_eq!(
            published.figure("D1", "geometric_100um", "uniformity"),
            Some(0.755)
        );
        assert_eq!(
            published.figure("D3", "hybrid_10um", "peak_angle_deg"),
            Some(20.0)
        );
        assert_eq!(
            published.figure("D3", "hybrid_10um", "extraction_efficiency"),
            None
        );
        assert_eq!(
            published
                .designs
                .values()
                .flat_map(BTreeMap::values)
                .map(BTreeMap::len)
                .sum::<usize>(),
            21
        );
    }
}
