// SPDX-License-Identifier: MIT OR Apache-2.0
//! The paper's figures, compiled in from `data/published/tables.toml`.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use serde::Deserialize;

use design::EMBEDDED;
use files::content_hash::sha256_hex;

/// Text of the file.
pub const TABLES: &str = include_str!("../../../data/published/tables.toml");

/// Published figures of one design and model.
pub type Figures = BTreeMap<String, f64>;

/// Published figures of one design, by model.
pub type Models = BTreeMap<String, Figures>;

/// Embedded designs that the paper describes, with their names there.
const DESIGNS: [(&str, &str); 3] = [("D1", "d1.toml"), ("D2", "d2.toml"), ("D3", "d3.toml")];

/// SHA-256 of an embedded design.
fn embedded_hash(file: &str) -> Option<String> {
    let (_, text) = EMBEDDED.iter().find(|(name, _)| *name == file)?;
    Some(sha256_hex(text.as_bytes()))
}

/// All published figures.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Published {
    /// Publication.
    pub source: String,
    /// Design → model → figure → value (fractions and degrees).
    #[serde(flatten)]
    pub designs: BTreeMap<String, Models>,
}

impl Published {
    /// The compiled-in figures.
    pub fn load() -> Result<Self> {
        toml::from_str(TABLES).context("data/published/tables.toml")
    }

    /// The figures of the design whose file has this SHA-256, if the paper describes it. A design
    /// that only has the name of one of the paper's has none.
    pub fn design(&self, sha256: &str) -> Option<&Models> {
        let described =
            |(_, file): &&(&str, &str)| embedded_hash(file).is_some_and(|hash| hash == sha256);
        let (name, _) = DESIGNS.iter().find(described)?;
        self.designs.get(*name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_both_tables_are_there() {
        let published = Published::load().expect("valid");
        let figure = |design: usize, model: &str, figure: &str| {
            let hash = embedded_hash(DESIGNS[design].1)?;
            published.design(&hash)?.get(model)?.get(figure).copied()
        };
        assert_eq!(figure(0, "geometric_100um", "uniformity"), Some(0.755));
        assert_eq!(figure(2, "hybrid_10um", "peak_angle_deg"), Some(20.0));
        assert_eq!(figure(2, "hybrid_10um", "extraction_efficiency"), None);
        let altered = format!("{}\n", EMBEDDED[0].1);
        assert_eq!(published.design(&sha256_hex(altered.as_bytes())), None);
        assert_eq!(
            published.designs.values().flat_map(BTreeMap::values).map(BTreeMap::len).sum::<usize>(),
            21
        );
    }
}
