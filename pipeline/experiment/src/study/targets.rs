// SPDX-License-Identifier: MIT OR Apache-2.0
//! Targets of a study and the scales of their misses.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail, ensure};

use design::dotted_keys;
use metrics::Bounds;
use metrics::figures::{self, Definition};
use results::target::{Sought, Target};

use super::file::Probe;

/// Least scale; a smaller one makes misses that no picture can show.
const LEAST_SCALE: f64 = 1e-9;

/// Keys of a target that is no plain number.
const SOUGHT: [&str; 3] = ["near", "at_least", "at_most"];

/// Design → model → figure → sought value.
pub type TargetFigures = BTreeMap<String, BTreeMap<String, BTreeMap<String, Sought>>>;

/// Targets of all traces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Targets {
    /// The figures.
    pub figures: TargetFigures,
    /// Figure → scale.
    pub scales: BTreeMap<String, f64>,
    /// By design, element and figure.
    probes: BTreeMap<[String; 3], Target>,
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
                    let sought = sought(&key, &known, value)?;
                    let of_design = figures.entry(design.clone()).or_default();
                    of_design.entry(model.clone()).or_default().insert(figure.clone(), sought);
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
                let sought = Sought::Near(target);
                self.probes.insert(key, Target { sought, scale: probe.scale });
            }
        }
        self
    }

    /// Target of a figure.
    pub fn of(&self, design: &str, model: &str, figure: &str) -> Option<Target> {
        let probe = [design, model, figure].map(str::to_owned);
        if let Some(target) = self.probes.get(&probe) {
            return Some(*target);
        }
        let sought = *self.figures.get(design)?.get(model)?.get(figure)?;
        Some(Target { sought, scale: *self.scales.get(figure)? })
    }
}

/// The sought value of `figure` under `key`: a number, `{ near = .. }` or bounds.
fn sought(key: &str, figure: &Definition, value: &toml::Value) -> Result<Sought> {
    let (most, unit) = figure.largest_target();
    let number = |key: &str, value: &toml::Value| -> Result<f64> {
        let Some(number) = dotted_keys::number(value).filter(|n| n.is_finite()) else {
            bail!("{key}: expected a number, got {value}");
        };
        let bounds = if most < 1e30 { format!("from 0 to {most}") } else { "from 0".to_owned() };
        ensure!((0.0..=most).contains(&number), "{key}: expected {unit} {bounds}, got {number}");
        Ok(number)
    };
    let Some(table) = value.as_table() else {
        return number(key, value).map(Sought::Near);
    };
    if let Some(other) = table.keys().find(|name| !SOUGHT.contains(&name.as_str())) {
        bail!("{key}.{other}: no such key, expected {}", SOUGHT.join(", "));
    }
    let [near, at_least, at_most] = SOUGHT.map(|name| {
        table.get(name).map(|value| number(&format!("{key}.{name}"), value)).transpose()
    });
    match (near?, at_least?, at_most?) {
        (Some(near), None, None) => Ok(Sought::Near(near)),
        (Some(_), ..) => bail!("{key}: expected `near` alone, got a bound beside it"),
        (None, at_least, at_most) => {
            Bounds::new(at_least, at_most).map(Sought::Within).with_context(|| key.to_owned())
        }
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
    use metrics::Estimate;
    use results::target::Verdict::{Met, NotMet, NotResolved};

    use super::*;

    #[test]
    fn published_figures_are_targets() {
        let table: toml::Table =
            toml::from_str(include_str!("../../../../data/published/tables.toml")).expect("valid");
        let targets = Targets::new(&table, &BTreeMap::from([("uniformity".to_owned(), 0.01)]))
            .expect("valid");
        let near = |value, scale| Some(Target { sought: Sought::Near(value), scale });
        assert_eq!(targets.of("D3", "hybrid_10um", "uniformity"), near(0.818, 0.01));
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
        assert_eq!(found, Some(Target { sought: Sought::Near(0.8), scale: 0.03 }));
    }

    #[test]
    fn bounds_are_met_missed_or_not_resolved_by_errors() {
        let of = |text: &str| {
            let table = toml::from_str(&format!("[D.m]\nuniformity = {text}")).expect("TOML");
            let targets = Targets::new(&table, &BTreeMap::new()).expect("valid");
            targets.of("D", "m", "uniformity").expect("a target")
        };
        for (target, value, error, miss, verdict) in [
            ("{ at_least = 0.8 }", 0.9, 0.01, 0.0, Met),
            ("{ at_least = 0.8 }", 0.82, 0.01, 0.0, NotResolved),
            ("{ at_least = 0.8 }", 0.7, 0.01, -5.0, NotMet),
            ("{ at_most = 0.8 }", 0.9, 0.01, 5.0, NotMet),
            ("{ at_most = 0.8 }", 0.79, 0.01, 0.0, NotResolved),
            ("{ at_least = 0.7, at_most = 0.8 }", 0.75, 0.01, 0.0, Met),
            ("{ near = 0.8 }", 0.80, 0.001, 0.0, Met),
            ("0.8", 0.84, 0.001, 2.0, NotMet),
            ("0.8", 0.82, 0.001, 1.0, NotResolved),
            ("{ at_least = 0.8 }", 0.8, 0.0, 0.0, Met),
        ] {
            let of = of(target);
            assert!((of.miss(value) - miss).abs() < 1e-9, "{target} {value}");
            assert_eq!(of.verdict(Estimate::new(value, error)), verdict, "{target} {value}");
        }
    }

    #[test]
    fn targets_without_numbers_are_refused() {
        for (text, word) in [
            ("[D1.geometric_100um]\nuniformity = \"high\"", "expected a number"),
            ("[D1.geometric_100um]\nuniformity = nan", "expected a number"),
            ("[D1.geometric_100um]\nbrightness = 1.0", "targets.D1.geometric_100um.brightness"),
            ("D1 = 3", "expected a table"),
            ("[D1.m]\nuniformity = {}", "neither"),
            ("[D1.m]\nuniformity = { least = 0.5 }", "uniformity.least: no such key"),
            ("[D1.m]\nuniformity = { near = 0.5, at_most = 0.6 }", "`near` alone"),
            ("[D1.m]\nuniformity = { at_least = 7 }", "uniformity.at_least: expected a fraction"),
            ("[D1.m]\nuniformity = { at_least = 0.7, at_most = 0.6 }", "a larger one"),
        ] {
            let table = toml::from_str(text).expect("TOML");
            let error = Targets::new(&table, &BTreeMap::new()).expect_err(text);
            assert!(format!("{error:#}").contains(word), "{error:#}");
        }
        for scale in [0.0, -1.0, 1e-300, f64::NAN] {
            let scales = BTreeMap::from([("uniformity".to_owned(), scale)]);
            assert!(Targets::new(&toml::Table::new(), &scales).is_err(), "{scale}");
        }
    }
}
