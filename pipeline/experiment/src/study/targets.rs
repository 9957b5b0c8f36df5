// SPDX-License-Identifier: MIT OR Apache-2.0
//! Target figures of a study, and the scales of their misses.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail, ensure};

use design::dotted_keys;
use metrics::figures::{self, Definition};

use super::file::Probe;

/// Least scale; a smaller one makes misses that no picture can show.
const LEAST_SCALE: f64 = 1e-9;

/// Design → model → figure → value.
pub type TargetFigures = BTreeMap<String, BTreeMap<String, BTreeMap<String, f64>>>;

/// Targets of all traces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Targets {
    /// The figures.
    pub figures: TargetFigures,
    /// Figure → scale.
    pub scales: BTreeMap<String, f64>,
    /// Design, element, figure → target and scale.
    probes: BTreeMap<[String; 3], (f64, f64)>,
}

impl Targets {
    /// From a table of designs; its entry `source` is ignored.
    ///
    /// # Errors
    /// An unknown figure, or a value that is no number.
    pub fn new(table: &toml::Table, scales: &BTreeMap<String, f64>) -> Result<Self> {
        let defaults =
            figures::all().filter_map(|figure| Some((figure.key.to_owned(), figure.scale?)));
        let mut all: BTreeMap<String, f64> = defaults.collect();
        for (figure, &scale) in scales {
            known(figure, &format!("scales.{figure}"))?;
            ensure!(
                scale.is_finite() && scale >= LEAST_SCALE,
                "scales.{figure}: expected a number of at least {LEAST_SCALE:e}, got {scale}"
            );
            all.insert(figure.clone(), scale);
        }
        let mut figures = TargetFigures::new();
        for (design, models) in table.iter().filter(|(key, _)| *key != "source") {
            for (model, targets) in tables(design, models)? {
                for (figure, value) in tables(&format!("{design}.{model}"), targets)? {
                    let key = format!("targets.{design}.{model}.{figure}");
                    let known = known(figure, &key)?;
                    let scale = all.get(figure).copied().or(known.scale);
                    let scale = scale.with_context(|| {
                        format!("scales.{figure}: expected a scale for {key}, got none")
                    })?;
                    all.insert(figure.clone(), scale);
                    let Some(number) = dotted_keys::number(value).filter(|n| n.is_finite()) else {
                        bail!("{key}: expected a number, got {value}");
                    };
                    let (most, unit) = known.largest_target();
                    ensure!(
                        (0.0..=most).contains(&number),
                        "{key}: expected {unit} from 0 to {most}, got {number}"
                    );
                    let of_design = figures.entry(design.clone()).or_default();
                    of_design.entry(model.clone()).or_default().insert(figure.clone(), number);
                }
            }
        }
        Ok(Self { figures, scales: all, probes: BTreeMap::new() })
    }

    /// Adds the targets of `probes`.
    #[must_use]
    pub fn with_probes(mut self, probes: &[Probe]) -> Self {
        for probe in probes {
            if let Some(target) = probe.target {
                let key = [probe.design.clone(), probe.place(), probe.figure()];
                self.probes.insert(key, (target, probe.scale));
            }
        }
        self
    }

    /// Targets that are no figures of `results.json` for every design: those of receivers, of the
    /// ledger and in absolute units.
    pub fn besides(&self) -> BTreeSet<&str> {
        let targets = self.figures.values().flat_map(BTreeMap::values);
        let keys = targets.flat_map(BTreeMap::keys).map(String::as_str);
        keys.filter(|key| figures::find(key).is_some_and(|figure| !figure.is_main())).collect()
    }

    /// Target and scale of a figure.
    pub fn of(&self, design: &str, model: &str, figure: &str) -> Option<(f64, f64)> {
        let probe = [design, model, figure].map(str::to_owned);
        if let Some(target) = self.probes.get(&probe) {
            return Some(*target);
        }
        let target = *self.figures.get(design)?.get(model)?.get(figure)?;
        Some((target, *self.scales.get(figure)?))
    }
}

fn known(figure: &str, key: &str) -> Result<Definition> {
    figures::find(figure).with_context(|| format!("{key}: expected one of {}", figures::keys()))
}

fn tables<'a>(key: &str, value: &'a toml::Value) -> Result<&'a toml::Table> {
    let Some(table) = value.as_table() else {
        bail!("targets.{key}: expected a table, got {value}");
    };
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_figures_are_targets() {
        let table: toml::Table = toml::from_str(results::published::TABLES).expect("valid");
        let targets = Targets::new(&table, &BTreeMap::from([("uniformity".to_owned(), 0.01)]))
            .expect("valid");
        assert_eq!(targets.of("D3", "hybrid_10um", "uniformity"), Some((0.818, 0.01)));
        assert_eq!(targets.of("D3", "hybrid_10um", "extraction_efficiency"), None);
        assert_eq!(
            targets.figures.values().flat_map(BTreeMap::values).map(BTreeMap::len).sum::<usize>(),
            21
        );
    }

    #[test]
    fn forms_of_uniformity_may_be_targets() {
        let table = toml::from_str("[own.geometric]\ncell_min_to_mean = 0.8").expect("TOML");
        let targets = Targets::new(&table, &BTreeMap::new()).expect("valid");
        let found = targets.of("own", "geometric", "cell_min_to_mean");
        assert_eq!(found, Some((0.8, 0.03)));
    }

    #[test]
    fn targets_without_numbers_are_refused() {
        for (text, word) in [
            ("[D1.geometric_100um]\nuniformity = \"high\"", "expected a number"),
            ("[D1.geometric_100um]\nuniformity = nan", "expected a number"),
            ("[D1.geometric_100um]\nbrightness = 1.0", "targets.D1.geometric_100um.brightness"),
            ("D1 = 3", "expected a table"),
        ] {
            let table = toml::from_str(text).expect("TOML");
            let error = Targets::new(&table, &BTreeMap::new()).expect_err(text);
            assert!(error.to_string().contains(word), "{error}");
        }
        for scale in [0.0, -1.0, 1e-300, f64::NAN] {
            let scales = BTreeMap::from([("uniformity".to_owned(), scale)]);
            assert!(Targets::new(&toml::Table::new(), &scales).is_err(), "{scale}");
        }
    }
}
