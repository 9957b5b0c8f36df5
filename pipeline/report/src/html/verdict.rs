// SPDX-License-Identifier: MIT OR Apache-2.0
//! The box beside the first picture: figures asked of a model, figures reached, and verdicts.

use metrics::digits::shortest;
use metrics::far_field::PeakPlace;
use metrics::figures::{
    self, CELL_MEAN, ESCAPED_UP, EXTRACTION, FLUX_UP, INTENSITY_PEAK, PEAK_ANGLE, UNIFORMITY,
};
use metrics::quantity::Unit;
use results::figure_entry::FigureEntry;
use results::headline::headline;
use results::optimisation::{self, OptimisationFile};
use results::shown::{self, named, shown_unit};
use results::target::{Sought, Target, Verdict};
use serde_json::{Value, json};

use super::models::Model;
use super::tables::figures as first_figures;

/// A line of what was asked.
struct Asked {
    name: String,
    wanted: String,
    reached: String,
    verdict: &'static str,
}

impl Asked {
    fn to_json(&self) -> Value {
        json!({
            "name": self.name, "asked": self.wanted, "reached": self.reached,
            "verdict": self.verdict, "is_met": self.verdict == Verdict::Met.words(),
        })
    }
}

/// The box of `model`; a search states what it asked of the design found.
pub fn verdict(model: &Model, search: Option<&OptimisationFile>) -> Value {
    let mut asked = published(model);
    let search = search.filter(|file| file.name == model.design);
    asked.extend(search.into_iter().flat_map(|file| constraints(model, file)));
    asked.extend(stopping_rule(model));
    let met = asked.iter().filter(|line| line.verdict == Verdict::Met.words()).count();
    let stated: Vec<&str> = asked.iter().map(|line| line.name.as_str()).collect();
    let reached = reached(model).into_iter().filter(|(name, _)| !stated.contains(&name.as_str()));
    json!({
        "design": model.design,
        "model": model.label(),
        "asked": asked.iter().map(Asked::to_json).collect::<Vec<_>>(),
        "met": met,
        "reached": reached.collect::<Vec<_>>(),
    })
}

/// Published figures, met within the scale that studies take.
fn published(model: &Model) -> Vec<Asked> {
    let line = |figure: super::tables::FigureOfMerit| {
        let published = figure.entry.reference?;
        let scale = figures::find(figure.key)?.scale?;
        let target = Target { sought: Sought::Near(published), scale };
        let (factor, symbol) = shown_unit(figure.unit);
        let [value, scale] = [published, scale].map(|number| shortest(number * factor));
        Some(Asked {
            name: figure.label.clone(),
            wanted: format!("{value} ± {scale} {symbol}, published"),
            reached: shown::text(figure.entry, figure.unit),
            verdict: target.judge(figure.entry).words(),
        })
    };
    first_figures(model).into_iter().filter_map(line).collect()
}

/// Constraints of a search, as verified by the model of its last stage.
fn constraints(model: &Model, file: &OptimisationFile) -> Vec<Asked> {
    let by = file.stages.last().map_or(String::new(), |stage| format!(", by {}", stage.model));
    let constraint = |entry: &optimisation::ConstraintEntry| {
        let (name, unit) = named_in(model, &entry.figure);
        let wanted = shown::bounds(entry.bounds(), unit);
        Asked {
            name: format!("{name}{by}"),
            wanted: format!("{wanted} by {} errors", shortest(entry.margin)),
            reached: entry.value.map_or("–".to_owned(), |value| shown::text(&value, unit)),
            verdict: met(entry.met),
        }
    };
    file.constraints.iter().map(constraint).collect()
}

fn met(is_met: bool) -> &'static str {
    if is_met { Verdict::Met.words() } else { Verdict::NotMet.words() }
}

/// The error that `--until-error` asked for.
fn stopping_rule(model: &Model) -> Option<Asked> {
    let rule = model.entry.until_error.as_ref()?;
    let (name, unit) = named_in(model, &rule.figure);
    let error = |value: f64| {
        let (factor, symbol) = shown_unit(unit);
        format!("{} {symbol}", shortest(value * factor)).trim_end().to_owned()
    };
    let two_digits = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
    let reached = |(figure, _): (FigureEntry, Unit)| match figure.peak_place {
        PeakPlace::NotResolved => Verdict::NotResolved.words().to_owned(),
        _ => error(two_digits(figure.error_left(&rule.figure))),
    };
    Some(Asked {
        name: format!("error of {name}"),
        wanted: if rule.is_relative {
            format!("at most {} % of its value", shortest(100.0 * rule.error))
        } else {
            format!("at most {}", error(rule.error))
        },
        reached: model.entry.figure(&rule.figure).map_or("–".to_owned(), reached),
        verdict: met(rule.reached),
    })
}

/// The figures that stand first, with their errors.
fn reached(model: &Model) -> Vec<(String, String)> {
    let general =
        [ESCAPED_UP, EXTRACTION, UNIFORMITY, PEAK_ANGLE, FLUX_UP, CELL_MEAN, INTENSITY_PEAK];
    let general = general.map(|figure| figure.key);
    let line = |key: String| {
        let (entry, unit) = model.entry.figure(&key)?;
        let name = if key == ESCAPED_UP.key { "leaves upwards".to_owned() } else { named(&key).0 };
        Some((name, shown::text(&entry, unit)))
    };
    headline(&general, model.entry.receivers.as_ref()).into_iter().filter_map(line).collect()
}

/// Name of a figure for people, and its unit in the light of `model`.
pub(super) fn named_in(model: &Model, key: &str) -> (String, Unit) {
    let (name, unit) = named(key);
    (name, model.entry.figure(key).map_or(unit, |(_, unit)| unit))
}
