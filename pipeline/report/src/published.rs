// SPDX-License-Identifier: MIT OR Apache-2.0
//! The paper's figures, compiled in from `data/published/tables.toml`, and how they join results.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use serde::Deserialize;

use results::schema::{ModelEntries, ResultsFile};
use runtime::content_hash::sha256_hex;

/// Text of the file.
pub const TABLES: &str = include_str!("../../../data/published/tables.toml");

/// Published figures of one design and model.
pub type Figures = BTreeMap<String, f64>;

/// Published figures of one design, by model.
pub type Models = BTreeMap<String, Figures>;

/// Designs that the paper describes, by their names there: the texts of their files.
const DESIGNS: [(&str, &str); 3] = [
    ("D1", include_str!("../../../data/designs/d1.toml")),
    ("D2", include_str!("../../../data/designs/d2.toml")),
    ("D3", include_str!("../../../data/designs/d3.toml")),
];

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
        let described = |(_, text): &&(&str, &str)| sha256_hex(text.as_bytes()) == sha256;
        let (name, _) = DESIGNS.iter().find(described)?;
        self.designs.get(*name)
    }

    /// Puts published figures beside those of `file` whose design the paper describes.
    pub fn join(&self, file: &mut ResultsFile) {
        let mut is_joined = false;
        for entries in file.designs.values_mut().chain(file.references.values_mut()) {
            is_joined |= self.join_models(entries);
        }
        if is_joined {
            file.reference_source = Some(self.source.clone());
        }
    }

    fn join_models(&self, entries: &mut ModelEntries) -> bool {
        let mut is_joined = false;
        for (model, entry) in entries {
            let of_design = self.design(&entry.design_sha256);
            let Some(of_model) = of_design.and_then(|models| models.get(model)) else {
                continue;
            };
            for (key, figure) in &mut entry.figures {
                if let Some(value) = of_model.get(key) {
                    figure.reference = Some(*value);
                    is_joined = true;
                }
            }
        }
        is_joined
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_both_tables_are_there() {
        let published = Published::load().expect("valid");
        let figure = |design: usize, model: &str, figure: &str| {
            let hash = sha256_hex(DESIGNS[design].1.as_bytes());
            published.design(&hash)?.get(model)?.get(figure).copied()
        };
        assert_eq!(figure(0, "geometric_100um", "uniformity"), Some(0.755));
        assert_eq!(figure(2, "hybrid_10um", "peak_angle_deg"), Some(20.0));
        assert_eq!(figure(2, "hybrid_10um", "extraction_efficiency"), None);
        let altered = format!("{}\n", DESIGNS[0].1);
        assert_eq!(published.design(&sha256_hex(altered.as_bytes())), None);
        assert_eq!(
            published.designs.values().flat_map(BTreeMap::values).map(BTreeMap::len).sum::<usize>(),
            21
        );
    }
}
