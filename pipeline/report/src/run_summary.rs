// SPDX-License-Identifier: MIT OR Apache-2.0
//! Text that `batwing run` prints of each model: ends of the light, then uniformity in the usual
//! forms, the far field, the colours and the receivers.

use std::fmt::Write as _;

use metrics::Estimate;
use metrics::digits::thousands;
use metrics::extraction::is_end;
use metrics::figures::{self, BEAM_ANGLE, EXTRACTION, FAR_FIELD, FIELD_ANGLE, UNIFORMITY};
use metrics::plural::count;
use metrics::quantity::Unit;
use metrics::uniformity_forms::{FORMS, Form, Region};
use results::figure_entry::FigureEntry;
use results::film_light;
use results::ledger::Ledger;
use results::{DesignResult, Figure, ModelResult, shown};

/// Accounts of the ledger below this fraction of the emitted power are left out.
const NEGLIGIBLE: f64 = 5e-7;

/// Width of the column of names.
const NAMES: usize = 28;
/// Width of a column of values.
const COLUMN: usize = 18;
/// Width of a column of values with units.
const UNITS_COLUMN: usize = 28;

/// Blocks of lines, one for each model of `design`.
pub fn plain_text(design: &DesignResult) -> String {
    let blocks: Vec<String> = design.models.iter().map(|m| block(&design.name, m)).collect();
    blocks.join("\n")
}

fn block(design: &str, model: &ModelResult) -> String {
    let paths = thousands(model.paths);
    let mut text = format!("{design}, {}: {paths} paths\n", model.label);
    light(&mut text, &model.ledger, model.photons.as_ref());
    films(&mut text, &model.ledger);
    uniformity(&mut text, model);
    far_field(&mut text, model);
    colours(&mut text, model);
    absolute(&mut text, model);
    receivers(&mut text, model);
    text
}

fn line(text: &mut String, name: &str, value: &str) {
    // A name that fills its column is set apart too.
    let name = format!("{name} ");
    let _ = writeln!(text, "  {name:<NAMES$}{value}");
}

/// A share of the ledger, per cent.
fn percent(share: Estimate) -> String {
    shown::estimate(share, Unit::Fraction)
}

/// Light that passes between films, the uppermost plane first.
fn films(text: &mut String, ledger: &Ledger) {
    let planes = film_light::planes(ledger);
    if !planes.is_empty() {
        let ways = in_columns(COLUMN, ["up", "down"].map(str::to_owned).into_iter());
        let _ = writeln!(text, " {:<w$}{}", "between films", ways.trim_end(), w = NAMES + 1);
    }
    for (name, shares) in planes.into_iter().rev() {
        let shares = shares.map(|share| shown::estimate(share.with_added_errors(), Unit::Ratio));
        line(text, &name, in_columns(COLUMN, shares.into_iter()).trim_end());
    }
}

fn light(text: &mut String, ledger: &Ledger, photons: Option<&Ledger>) {
    let heading = "light, of what the sources emit";
    let columns = photons.map_or("", |_| "photons");
    let _ =
        writeln!(text, "{}", format!(" {heading:<w$}{columns}", w = NAMES + 1 + COLUMN).trim_end());
    let of = |ledger: &Ledger, key: &str| ledger.account(key).map(FigureEntry::with_added_errors);
    let shares = |key: &str, share: Estimate| {
        let photons = photons.and_then(|photons| of(photons, key)).map(percent);
        let cells = [percent(share)].into_iter().chain(photons);
        in_columns(COLUMN, cells).trim_end().to_owned()
    };
    for (key, name) in [("escaped_up", "up"), ("escaped_down", "down")] {
        if let Some(estimate) = of(ledger, key) {
            line(text, name, &shares(key, estimate));
        }
    }
    let mut lost = Estimate::new(0.0, 0.0);
    for (key, _) in &ledger.accounts {
        if !is_end(key) || key.starts_with("escaped_") {
            continue;
        }
        let Some(share) = of(ledger, key) else { continue };
        if key.starts_with("lost_") {
            lost = together(lost, share);
        } else if share.value > NEGLIGIBLE {
            line(text, &key.replace('_', " "), &shares(key, share));
        }
    }
    line(text, "lost", &percent(lost));
}

/// The sum of two shares of the light. One path that none of them has seen counts once.
fn together(a: Estimate, b: Estimate) -> Estimate {
    let (errors, value) = ([a, b].map(|share| share.standard_error), a.value + b.value);
    let largest = errors[0].max(errors[1]);
    Estimate::new(value, if value == 0.0 { largest } else { errors[0].hypot(errors[1]) })
}

/// Cells beside each other, each so wide.
fn in_columns(width: usize, cells: impl Iterator<Item = String>) -> String {
    // A cell that fills its column is set apart too.
    cells.fold(String::new(), |line, cell| format!("{line}{:<width$}", cell + " "))
}

/// Names of the rows of the table of uniformity, with what each takes from a region.
const ROWS: [(&str, Form); 4] = [
    ("valley/peak", Form::ValleyToPeak),
    ("min/mean", Form::MinToMean),
    ("coefficient of variation", Form::Variation),
    ("logarithmic", Form::Logarithmic),
];

/// Forms of uniformity, a column for each region that was read.
fn uniformity(text: &mut String, model: &ModelResult) {
    let regions = [
        ("segment", Region::Segment),
        ("diagonal", Region::Diagonal),
        ("cell", Region::Cell),
        ("area", Region::Area),
    ];
    let value = |region: Region, form: Form| {
        let known = FORMS.iter().find(|f| f.region == region && f.form == form)?;
        model.figure(known.key).map(|f| shown::text(&f.entry, f.unit))
    };
    let read: Vec<_> = regions
        .into_iter()
        .filter(|(_, region)| value(*region, Form::ValleyToPeak).is_some())
        .collect();
    if read.is_empty() {
        return;
    }
    let heading = in_columns(COLUMN, read.iter().map(|(name, _)| (*name).to_owned()));
    let _ = writeln!(text, " {:<w$}{}", "uniformity", heading.trim_end(), w = NAMES + 1);
    for (name, form) in ROWS {
        let cells = read.iter().map(|(_, region)| value(*region, form).unwrap_or_default());
        let cells = in_columns(COLUMN, cells);
        line(text, name, cells.trim_end());
    }
    for (name, of_cell, of_area) in [
        ("nine points, min/max", Region::NinePoints, Region::AreaNinePoints),
        ("thirteen points, min/max", Region::ThirteenPoints, Region::AreaThirteenPoints),
    ] {
        let cells = read.iter().map(|(_, region)| match region {
            Region::Cell => value(of_cell, Form::ValleyToPeak),
            Region::Area => value(of_area, Form::ValleyToPeak),
            _ => None,
        });
        let cells = in_columns(COLUMN, cells.map(Option::unwrap_or_default));
        if !cells.trim().is_empty() {
            line(text, name, cells.trim_end());
        }
    }
    if let Some(figure) = model.figure(UNIFORMITY.key) {
        line(text, "as the design reads it", &shown::text(&figure.entry, figure.unit));
    }
    let is_open = |f: &Figure| f.entry.interval.is_some() && f.entry.bias_bound.is_some();
    if model.figures.iter().any(is_open) {
        text.push_str("  from ... to: not resolved by so few paths a bin; more paths, wider bins and smoothing help\n");
    }
}

fn far_field(text: &mut String, model: &ModelResult) {
    let has_far_field = FAR_FIELD.iter().any(|figure| model.figure(figure.key).is_some());
    if has_far_field {
        text.push_str(" far field\n");
    }
    for definition in FAR_FIELD.into_iter().chain([EXTRACTION]) {
        let is_extraction = definition == EXTRACTION;
        let name = if is_extraction { "extraction from the domes" } else { definition.label };
        match model.figure(definition.key) {
            Some(figure) => line(text, name, &shown::text(&figure.entry, figure.unit)),
            None if has_far_field && [BEAM_ANGLE, FIELD_ANGLE].contains(&definition) => {
                line(text, name, shown::absent(definition.key));
            }
            None => {}
        }
    }
}

fn colours(text: &mut String, model: &ModelResult) {
    let found = figures::colours().filter_map(|definition| model.figure(definition.key));
    for (number, figure) in found.enumerate() {
        if number == 0 {
            text.push_str(" colour\n");
        }
        line(text, &figure.label, &shown::text(&figure.entry, figure.unit));
    }
}

/// Figures in the units of the light that the LEDs emit, of all packages and of one.
fn absolute(text: &mut String, model: &ModelResult) {
    let Some(absolute) = &model.absolute else {
        return;
    };
    let packages = count(absolute.packages, "package");
    let heading = if absolute.packages == 1 {
        String::new()
    } else {
        in_columns(UNITS_COLUMN, [packages, "one package".to_owned()].into_iter())
    };
    let heading = format!(" {:<w$}{heading}", "absolute", w = NAMES + 1);
    let _ = writeln!(text, "{}", heading.trim_end());
    let in_line = |text: &mut String, name: &str, cells: [String; 2]| {
        let shown = if absolute.packages == 1 { 1 } else { 2 };
        let cells = in_columns(UNITS_COLUMN, cells.into_iter().take(shown));
        line(text, name, cells.trim_end());
    };
    let both = [&absolute.emitted, &absolute.emitted_per_package];
    in_line(text, "emitted", both.map(|flux| shown::emitted(flux, model.spectrum.as_ref())));
    for (key, figure) in &absolute.figures {
        let shown = |e: &FigureEntry| shown::text(e, figure.unit());
        let of_package = figure.per_package.as_ref().map(shown).unwrap_or_default();
        in_line(text, &key.replace('_', " "), [shown(&figure.array), of_package]);
    }
}

fn receivers(text: &mut String, model: &ModelResult) {
    let figures = model.receivers.iter().flatten().flat_map(|(name, receiver)| {
        shown::of_receiver(receiver).map(move |(label, value)| (format!("{name}, {label}"), value))
    });
    let figures: Vec<(String, String)> = figures.collect();
    let longest = figures.iter().map(|(name, _)| name.chars().count()).max();
    let width = longest.unwrap_or(0).max(NAMES - 1);
    for (number, (name, value)) in figures.iter().enumerate() {
        if number == 0 {
            let per_watt = if model.absolute.is_none() { ", of 1 W emitted in all" } else { "" };
            let _ = writeln!(text, " receivers{per_watt}");
        }
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {name:<width$} {value}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use metrics::far_field::PeakPlace;

    fn model() -> ModelResult {
        let figure = |key: &'static str, label: &'static str, unit, value, error| Figure {
            key: key.into(),
            label: label.into(),
            unit,
            entry: FigureEntry::new(Estimate::new(value, error)),
        };
        let forms =
            FORMS.iter().map(|form| figure(form.key, form.label, Unit::Fraction, 0.5, 0.001));
        let mut figures: Vec<Figure> = forms.collect();
        let mut angle = figure("peak_angle_deg", "peak angle", Unit::Degree, 20.0, 5.0);
        angle.entry.peak_place = PeakPlace::NotResolved;
        figures.push(angle);
        let account = |name: &str, value: f64, error: f64| {
            (name.to_owned(), FigureEntry::new(Estimate::new(value, error)))
        };
        ModelResult {
            key: "geometric".to_owned(),
            label: "rays".to_owned(),
            paths: 1_234_560,
            figures,
            ledger: Ledger {
                accounts: vec![
                    account("emitted", 1.0, 0.0),
                    account("escaped_up", 0.75, 0.0002),
                    account("escaped_down", 0.0, 0.0),
                    account("absorbed_by_bottom", 0.249_99, 0.0001),
                    account("absorbed_by_led_top", 1e-9, 0.0),
                    account("lost_depth", 1e-5, 1e-6),
                ],
            },
            photons: None,
            counters: Vec::new(),
            tables: Vec::new(),
            spectrum: None,
            absolute: None,
            until_error: None,
            receivers: None,
            polarization: None,
            files: Vec::new(),
        }
    }

    #[test]
    fn light_comes_first_and_every_part_of_it_is_there() {
        let text = block("mine", &model());
        let place =
            |words: &str| text.find(words).unwrap_or_else(|| panic!("no {words:?} in\n{text}"));
        assert!(text.starts_with("mine, rays: 1,234,560 paths\n"), "{text}");
        assert!(place("75.000 ± 0.020 %") < place("absorbed by bottom"));
        assert!(place("absorbed by bottom") < place("uniformity"));
        assert!(place("0.00100 ± 0.00010 %") < place("uniformity"));
        assert!(!text.contains("led top"), "{text}");
        assert!(text.contains("not resolved"), "{text}");
        assert!(
            text.lines().all(|line| line.chars().count() < 100 && !line.ends_with(' ')),
            "{text}"
        );
    }

    #[test]
    fn light_that_is_lost_has_the_error_of_its_parts() {
        let mut lossy = model();
        let account = |name: &str, value: f64, error: f64| {
            (name.into(), FigureEntry::new(Estimate::new(value, error)))
        };
        lossy.ledger.accounts.push(account("lost_too_many_bounces", 4e-5, 2e-6));
        let text = block("mine", &lossy);
        assert!(text.contains("lost                        0.00500 ± 0.00022 %"), "{text}");
        lossy.ledger.accounts.retain(|(name, _)| !name.starts_with("lost_"));
        lossy.ledger.accounts.push(account("lost_depth", 0.0, 1e-6));
        lossy.ledger.accounts.push(account("lost_too_many_bounces", 0.0, 1e-6));
        let text = block("mine", &lossy);
        assert!(text.contains("below 3.0e-4 %") || text.contains("below 0.0003 %"), "{text}");
    }

    #[test]
    fn a_package_alone_has_no_uniformity() {
        let mut alone = model();
        alone.figures.clear();
        let text = block("mine", &alone);
        assert!(!text.contains("uniformity") && !text.contains("far field"), "{text}");
    }
}
