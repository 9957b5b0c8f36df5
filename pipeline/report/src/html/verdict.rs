// SPDX-License-Identifier: MIT OR Apache-2.0
//! The box beside the first picture: what was asked of a model, what it reached, and whether that
//! meets it.

use metrics::digits::shortest;
use metrics::figures::{
    self, CELL_MEAN, EXTRACTION, FLUX_UP, INTENSITY_PEAK, PEAK_ANGLE, UNIFORMITY,
};
use metrics::quantity::Unit;
use metrics::{Bounds, Estimate};
use results::figure_entry::FigureEntry;
use results::optimisation::{self, OptimisationFile};
use results::shown::{self, shown_unit};
use results::target::{Sought, Target, Verdict};
use serde_json::{Value, json};

use super::models::Model;
use super::tables::figures as papers_figures;

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
    asked.extend(search.into_iter().flat_map(constraints));
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
        let published = figure.entry.published?;
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
    papers_figures(model).into_iter().filter_map(line).collect()
}

/// Constraints of a search, as verified by the model of its last stage.
fn constraints(file: &OptimisationFile) -> Vec<Asked> {
    let by = file.stages.last().map_or(String::new(), |stage| format!(", by {}", stage.model));
    let words = |met: bool| if met { Verdict::Met.words() } else { Verdict::NotMet.words() };
    let constraint = |entry: &optimisation::ConstraintEntry| {
        let (name, unit) = named(&entry.figure);
        let wanted = bounds(Bounds { at_least: entry.at_least, at_most: entry.at_most }, unit);
        Asked {
            name: format!("{name}{by}"),
            wanted: format!("{wanted} by {} errors", shortest(entry.margin)),
            reached: entry.value.map_or("–".to_owned(), |value| shown::text(&value, unit)),
            verdict: words(entry.met),
        }
    };
    file.constraints.iter().map(constraint).collect()
}

/// The error that `--until-error` asked for.
fn stopping_rule(model: &Model) -> Option<Asked> {
    let rule = model.entry.until_error.as_ref()?;
    let (name, unit) = named(&rule.figure);
    let error = |value: f64| {
        let (factor, symbol) = shown_unit(unit);
        format!("{} {symbol}", shortest(value * factor)).trim_end().to_owned()
    };
    let reached = model.entry.figures.get(&rule.figure).map(|figure| figure.standard_error);
    let rounded = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
    Some(Asked {
        name: format!("error of {name}"),
        wanted: format!("at most {}", error(rule.error)),
        reached: reached.map_or("–".to_owned(), |value| error(rounded(value))),
        verdict: if rule.reached { Verdict::Met.words() } else { Verdict::NotMet.words() },
    })
}

/// Efficiency, uniformity, fluxes, intensities and illuminances with their errors.
fn reached(model: &Model) -> Vec<(String, String)> {
    let mut lines = Vec::new();
    if let Some(share) = model.entry.power_ledger.account(figures::ESCAPED_UP.key) {
        lines.push(("leaves upwards".to_owned(), text(share, Unit::Fraction)));
    }
    for figure in [EXTRACTION, UNIFORMITY, PEAK_ANGLE] {
        if let Some(entry) = model.entry.figures.get(figure.key) {
            let name = figure.heading.unwrap_or(figure.label);
            lines.push((name.to_owned(), shown::text(entry, figure.unit)));
        }
    }
    let absolute = model.entry.absolute.iter();
    for figure in [FLUX_UP, CELL_MEAN, INTENSITY_PEAK] {
        for entry in absolute.clone().filter_map(|absolute| absolute.figures.get(figure.key)) {
            let number = shown::number(&entry.array, Unit::Relative);
            let value = shown::with_symbol(number, &entry.array, &entry.unit);
            lines.push((figure.label.to_owned(), value));
        }
    }
    for (name, receiver) in model.entry.receivers.iter().flatten() {
        let main =
            shown::of_receiver(receiver).filter(|(label, _)| ["mean", "min/max"].contains(label));
        lines.extend(main.map(|(label, value)| (format!("{name}, {label}"), value)));
    }
    lines
}

/// Name and unit of a figure for people.
pub(super) fn named(key: &str) -> (String, Unit) {
    match figures::find(key) {
        Some(figure) => (figure.heading.unwrap_or(figure.label).to_owned(), figure.unit),
        None => (key.replace('_', " "), Unit::Relative),
    }
}

/// Value and error of a figure in its unit.
pub(super) fn text(value: Estimate, unit: Unit) -> String {
    shown::text(&FigureEntry::new(value), unit)
}

/// Bounds in the unit shown.
pub(super) fn bounds(bounds: Bounds, unit: Unit) -> String {
    let (factor, symbol) = shown_unit(unit);
    let scaled = |bound: Option<f64>| bound.map(|bound| round(bound * factor));
    let scaled = Bounds { at_least: scaled(bounds.at_least), at_most: scaled(bounds.at_most) };
    format!("{} {symbol}", scaled.words()).trim_end().to_owned()
}

/// A stated number without the rounding of its factor.
fn round(value: f64) -> f64 {
    format!("{value:.12e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_stand_in_the_unit_shown() {
        let at_least = Bounds { at_least: Some(0.07), at_most: None };
        assert_eq!(bounds(at_least, Unit::Fraction), "at least 7 %");
        assert_eq!(bounds(at_least, Unit::Relative), "at least 0.07");
    }
}
