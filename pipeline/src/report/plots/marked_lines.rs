// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numbers with errors on lines one under the other: what many set-ups do to a figure, or how far off each is.

use anyhow::{Result, ensure};

use super::Heading;
use super::draw::canvas::{Align, Letters, Pen, Rect};
use super::draw::colour::{Colour, LineColours};
use super::draw::panel::{BAND_ERRORS, Panel, PanelAxis, TICK_SIZE};
use super::draw::scale::Scale;
use super::draw::sheet::{Entry, Sample, Sheet};
use crate::quantity::{Quantity, Unit};

/// Pixels of a line, of one whose label has two, of a picture without lines, and of the highest picture.
const LINE: f64 = 30.0;
const BROKEN: f64 = 46.0;
const REST: f64 = 290.0;
const HIGHEST: f64 = 12_000.0;
/// Radius of a mark.
const MARK: f64 = 5.5;
/// Widest part of the picture that labels may take, pixels, and letters of a label on one line.
const LABELS: f64 = 620.0;
const LETTERS: usize = 58;
/// Distance of the two lines of a label, pixels.
const APART: f64 = 20.0;
/// Half the range drawn where nothing differs from 0.
const NOTHING: f64 = 0.01;

/// One line of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkedLine {
    /// Name at the left.
    pub label: String,
    /// Series, value, standard error.
    pub marks: Vec<(String, f64, f64)>,
}

/// Draws a dot with a bar of two standard errors for every mark, coloured by its series, and a line at 0. Fractions are drawn as percentages.
///
/// # Errors
/// No finite value, or more lines than a picture can hold.
pub fn marked_lines(
    heading: &Heading,
    quantity: &str,
    unit: Unit,
    lines: &[MarkedLine],
) -> Result<Vec<u8>> {
    let finite = |v: f64| v.is_finite();
    let marks = || lines.iter().flat_map(|l| &l.marks).filter(|m| finite(m.1));
    ensure!(marks().next().is_some(), "expected a finite value to draw");
    let labels: Vec<Vec<String>> = lines.iter().map(|l| broken(&l.label)).collect();
    let line = if labels.iter().any(|l| l.len() > 1) {
        BROKEN
    } else {
        LINE
    };
    let height = REST + line * lines.len() as f64;
    ensure!(
        height <= HIGHEST,
        "expected at most {} lines to draw, got {}",
        ((HIGHEST - REST) / line).floor(),
        lines.len()
    );
    let mut series: Vec<&str> = Vec::new();
    for (name, ..) in marks() {
        if !series.contains(&name.as_str()) {
            series.push(name);
        }
    }
    let colour = |name: &str| {
        let index = series.iter().position(|s| *s == name).unwrap_or(0);
        LineColours::Distinct.pick(index, series.len())
    };
    let mut legend: Vec<Entry> = series
        .iter()
        .filter(|name| !name.is_empty())
        .map(|name| Entry::new(Sample::Dot(colour(name), MARK), *name))
        .collect();
    let bar = Pen::solid(Colour::MUTED, 2.0);
    legend.push(Entry::new(Sample::Line(bar), "±2 standard errors"));
    let mut sheet = Sheet::new(1600, height as u32, heading, &legend)?;

    let names = Letters::new(TICK_SIZE, Align::Right);
    let widest = labels.iter().flatten().map(|l| names.width(l));
    let widest = widest.fold(0.0, f64::max);
    let body = sheet
        .body
        .inset(widest.min(LABELS) + 26.0, 10.0, 20.0, 65.0);
    let ends = marks().flat_map(|&(_, v, e)| {
        let bar = if e.is_finite() { BAND_ERRORS * e } else { 0.0 };
        [v - bar, v + bar]
    });
    let (low, high) = ends.fold((0.0_f64, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
    let (low, high) = drawn(low, high);
    let margin = 0.06 * (high - low);
    let scale = Scale::Linear {
        low: if low < 0.0 { low - margin } else { 0.0 },
        high: high + margin,
    };
    let panel = Panel {
        area: Rect::new(body.left, body.top, body.right, body.bottom),
        x: PanelAxis::linear(&Quantity::new(quantity, unit), scale, 8),
        y: PanelAxis {
            scale: Scale::Linear {
                low: 0.0,
                high: 1.0,
            },
            ticks: Vec::new(),
            label: String::new(),
            numbered: false,
        },
    };
    panel.grid(&mut sheet.canvas);
    let zero = panel.at(0.0, 0.5)[0];
    let axis = Pen::solid(Colour::TEXT, 1.4);
    sheet
        .canvas
        .line([zero, body.top], [zero, body.bottom], &axis);
    for (index, (line, label)) in lines.iter().zip(&labels).enumerate() {
        let part = (index as f64 + 0.5) / lines.len() as f64;
        let y = body.top + body.height() * part;
        for (name, value, error) in line.marks.iter().filter(|m| finite(m.1)) {
            let x = |v: f64| panel.at(v, 0.5)[0];
            if error.is_finite() {
                let reach = BAND_ERRORS * error;
                let pen = Pen::solid(colour(name), 2.0);
                sheet
                    .canvas
                    .line([x(value - reach), y], [x(value + reach), y], &pen);
            }
            sheet.canvas.disk([x(*value), y], MARK, colour(name));
        }
        for (k, part) in label.iter().enumerate() {
            let down = APART * (k as f64 - 0.5 * (label.len() as f64 - 1.0));
            sheet
                .canvas
                .text(part, [body.left - 14.0, y + down], &names);
        }
    }
    panel.frame(&mut sheet.canvas);
    sheet.canvas.into_png()
}

/// The range that is drawn for values from `low` to `high`.
fn drawn(low: f64, high: f64) -> (f64, f64) {
    if high > low {
        (low, high)
    } else {
        (-NOTHING, NOTHING)
    }
}

/// A label on one line, or a longer one on two, broken after the comma that leaves the shortest lines.
fn broken(label: &str) -> Vec<String> {
    let count = |part: &str| part.chars().count();
    if count(label) <= LETTERS {
        return vec![label.to_owned()];
    }
    let commas = label
        .match_indices(", ")
        .map(|(at, _)| label.split_at(at + 1));
    let best = commas.min_by_key(|(a, b)| count(a).max(count(b)));
    best.map_or_else(
        || vec![shortened(label)],
        |(a, b)| vec![shortened(a), shortened(b.trim_start())],
    )
}

fn shortened(label: &str) -> String {
    if label.chars().count() <= LETTERS {
        return label.to_owned();
    }
    let kept: String = label.chars().take(LETTERS - 1).collect();
    format!("{kept}...")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(label: &str, value: f64) -> MarkedLine {
        MarkedLine {
            label: label.to_owned(),
            marks: vec![
                ("D1".to_owned(), value, 0.01),
                ("D2".to_owned(), -value, f64::NAN),
            ],
        }
    }

    #[test]
    fn pictures_differ_with_their_numbers_and_hold_long_names() {
        let heading = Heading::new("study", "test");
        let draw = |value: f64| {
            let lines = [line("base", value), line(&"long name ".repeat(20), 0.2)];
            marked_lines(&heading, "change of uniformity", Unit::Fraction, &lines).expect("drawn")
        };
        assert_eq!(draw(0.1), draw(0.1));
        assert_ne!(draw(0.1), draw(0.15));
    }

    #[test]
    fn labels_of_two_factors_are_kept_whole() {
        let label =
            "OS2 = inner alpha, apex beta, chord, OS3 = inner alpha, outer beta, horizontal";
        let lines = broken(label);
        assert_eq!(lines.join(" "), label);
        assert!(lines.len() == 2 && lines.iter().all(|l| l.len() <= LETTERS));
        assert_eq!(broken("base"), ["base"]);
        assert!(broken(&"x".repeat(200))[0].ends_with("..."));
    }

    #[test]
    fn no_change_is_drawn_in_a_range_around_0() {
        assert_eq!(drawn(0.0, 0.0), (-NOTHING, NOTHING));
        assert_eq!(drawn(-0.2, 0.1), (-0.2, 0.1));
    }

    #[test]
    fn nothing_to_draw_and_too_much_are_refused() {
        let heading = Heading::new("study", "test");
        let draw = |lines: &[MarkedLine]| marked_lines(&heading, "misfit", Unit::Relative, lines);
        assert!(draw(&[]).is_err());
        assert!(draw(&[line("x", f64::NAN)]).is_err());
        assert!(draw(&vec![line("x", 1.0); 5000]).is_err());
    }
}
