// SPDX-License-Identifier: MIT OR Apache-2.0
//! Published against computed: one panel a figure of merit, one line a design and model.

use anyhow::{Result, ensure};

use super::super::summary::SummaryRow;
use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Rect};
use super::draw::colour::{Colour, LineColours};
use super::draw::panel::{BAND_ERRORS, Panel, PanelAxis, TICK_SIZE};
use super::draw::scale::Scale;
use super::draw::sheet::{Entry, HEIGHT, Sample, Sheet, diamond};
use crate::quantity::{Quantity, Unit};

/// Pixels a line of the picture takes at least.
const LINE: f64 = 46.0;

/// Draws published values as open diamonds and computed values as dots with bars of two standard errors. Panels and lines stand
/// in the order in which `rows` first names them; fractions are drawn as percentages.
///
/// # Errors
/// No row with a number, or more than six figures of merit.
pub fn published_vs_computed(heading: &Heading, rows: &[SummaryRow]) -> Result<Vec<u8>> {
    let mut quantities: Vec<(&str, Unit)> = Vec::new();
    let mut lines: Vec<(&str, &str)> = Vec::new();
    for row in rows.iter().filter(|row| numbers(row).next().is_some()) {
        let quantity = (row.quantity.as_str(), row.unit);
        if !quantities.contains(&quantity) {
            quantities.push(quantity);
        }
        let line = (row.design.as_str(), row.model.as_str());
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    ensure!(
        (1..=6).contains(&quantities.len()),
        "expected one to six figures of merit to compare, got {}",
        quantities.len()
    );
    let models = distinct(lines.iter().map(|line| line.1));
    let mut legend = vec![Entry::new(Sample::Diamond(Colour::TEXT), "published")];
    for (index, model) in models.iter().enumerate() {
        let colour = LineColours::Distinct.pick(index, models.len());
        legend.push(Entry::new(
            Sample::Dot(colour, 6.5),
            format!("computed, {model} (bar: ±2 standard errors)"),
        ));
    }
    if models.len() > 1 {
        for (entry, model) in legend[1..].iter_mut().zip(&models) {
            entry.label = format!("computed, {model}");
        }
        legend.push(Entry::new(
            Sample::Line(Pen::solid(Colour::MUTED, 2.4)),
            "±2 standard errors",
        ));
    }

    let height = f64::from(HEIGHT).max(260.0 + LINE * lines.len() as f64) as u32;
    let mut sheet = Sheet::new(1600, height, heading, &legend)?;
    let names = Letters::new(TICK_SIZE, Align::Right);
    let widest = lines
        .iter()
        .map(|(design, model)| names.width(&line_name(design, model)))
        .fold(0.0, f64::max);
    let body = sheet.body.inset(widest + 20.0, 10.0, 10.0, 65.0);
    let gap = 40.0;
    let width = (body.width() + gap) / quantities.len() as f64 - gap;
    for (column, &(quantity, unit)) in quantities.iter().enumerate() {
        let left = body.left + column as f64 * (width + gap);
        let area = Rect::new(left, body.top, left + width, body.bottom);
        let chosen: Vec<&SummaryRow> = rows
            .iter()
            .filter(|row| row.quantity == quantity && row.unit == unit)
            .collect();
        let panel = panel_of(area, quantity, unit, &chosen);
        draw_panel(&mut sheet.canvas, &panel, &lines, &models, &chosen);
    }
    for (index, (design, model)) in lines.iter().enumerate() {
        let y = line_place(body, index, lines.len());
        let at = [body.left - 16.0, y];
        sheet.canvas.text(&line_name(design, model), at, &names);
    }
    sheet.canvas.into_png()
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut list = Vec::new();
    for name in names {
        if !list.contains(&name) {
            list.push(name);
        }
    }
    list
}

fn line_name(design: &str, model: &str) -> String {
    [design, model]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join(", ")
}

/// The finite numbers of a row: published, and the ends of the bar of the computed value.
fn numbers(row: &SummaryRow) -> impl Iterator<Item = f64> {
    let computed = row.computed.map(|c| {
        let bar = bar_of(c.standard_error);
        [c.value - bar, c.value + bar]
    });
    row.published
        .into_iter()
        .chain(computed.into_iter().flatten())
        .filter(|number| number.is_finite())
}

/// Half the length of an error bar; none where the error is not known.
fn bar_of(standard_error: f64) -> f64 {
    if standard_error.is_finite() {
        BAND_ERRORS * standard_error
    } else {
        0.0
    }
}

fn panel_of(area: Rect, quantity: &str, unit: Unit, rows: &[&SummaryRow]) -> Panel {
    let all = || rows.iter().flat_map(|row| numbers(row));
    let (low, high) = (
        all().fold(f64::INFINITY, f64::min),
        all().fold(f64::NEG_INFINITY, f64::max),
    );
    let margin = 0.1 * (high - low).max(0.01 * high.abs()).max(1e-9);
    let scale = Scale::Linear {
        low: low - margin,
        high: high + margin,
    };
    let x = PanelAxis::linear(&Quantity::new(quantity, unit), scale, 5);
    let y = PanelAxis {
        scale: Scale::Linear {
            low: 0.0,
            high: 1.0,
        },
        ticks: Vec::new(),
        label: String::new(),
        numbered: false,
    };
    Panel { area, x, y }
}

fn line_place(area: Rect, index: usize, count: usize) -> f64 {
    area.top + area.height() * (index as f64 + 0.5) / count as f64
}

fn draw_panel(
    canvas: &mut Canvas,
    panel: &Panel,
    lines: &[(&str, &str)],
    models: &[&str],
    rows: &[&SummaryRow],
) {
    panel.grid(canvas);
    let area = panel.area;
    for (index, pair) in lines.windows(2).enumerate() {
        // Designs are set apart by a stronger line.
        if pair[0].0 != pair[1].0 {
            let y = area.top + area.height() * (index + 1) as f64 / lines.len() as f64;
            canvas.line(
                [area.left, y],
                [area.right, y],
                &Pen::solid(Colour::MUTED, 1.0),
            );
        }
    }
    for row in rows {
        let Some(index) = lines
            .iter()
            .position(|line| *line == (row.design.as_str(), row.model.as_str()))
        else {
            continue;
        };
        let y = line_place(area, index, lines.len());
        let place = |value: f64| panel.at(value, 0.0)[0];
        let published = row.published.filter(|v| v.is_finite()).map(place);
        let computed = row.computed.filter(|c| c.value.is_finite());
        if let (Some(from), Some(to)) = (published, computed) {
            let pen = Pen::dashed(Colour::MUTED, 1.2, &[3.0, 4.0]);
            canvas.line([from, y], [place(to.value), y], &pen);
        }
        if let Some(x) = published {
            diamond(canvas, [x, y], 8.5, Colour::TEXT);
        }
        if let Some(estimate) = computed {
            let model = models.iter().position(|m| *m == row.model).unwrap_or(0);
            let colour = LineColours::Distinct.pick(model, models.len());
            let bar = bar_of(estimate.standard_error);
            let ends = [estimate.value - bar, estimate.value + bar].map(place);
            let pen = Pen::solid(colour, 2.4);
            canvas.line([ends[0], y], [ends[1], y], &pen);
            for x in ends {
                if ends[1] - ends[0] > 13.0 {
                    canvas.line([x, y - 6.0], [x, y + 6.0], &pen);
                }
            }
            canvas.disk([place(estimate.value), y], 6.0, colour);
        }
    }
    panel.frame(canvas);
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;
    use crate::metrics::Estimate;

    fn row(quantity: &str, published: Option<f64>, computed: Option<f64>) -> SummaryRow {
        SummaryRow {
            design: "D1".into(),
            model: "rays".into(),
            quantity: quantity.into(),
            unit: Unit::Fraction,
            published,
            computed: computed.map(|value| Estimate::new(value, 0.01)),
            instead: None,
        }
    }

    #[test]
    fn missing_numbers_leave_their_place_empty() {
        let heading = Heading::new("Comparison", "all designs");
        let blue = LineColours::Distinct.pick(0, 1).rgb;
        let dots = |rows: &[SummaryRow]| {
            let picture = decode(&published_vs_computed(&heading, rows).unwrap());
            // Below the legend, which holds a dot of its own.
            let from = (picture.width() * 140) as usize;
            let pixels = &picture.pixels()[from..];
            pixels
                .iter()
                .filter(|p| [p.red(), p.green(), p.blue()] == blue)
                .count()
        };
        assert!(dots(&[row("uniformity", Some(0.7), Some(0.8))]) > 50);
        assert_eq!(dots(&[row("uniformity", Some(0.7), None)]), 0);
        assert!(dots(&[row("uniformity", None, Some(0.8))]) > 50);
        assert!(published_vs_computed(&heading, &[row("uniformity", None, None)]).is_err());
        assert!(published_vs_computed(&heading, &[]).is_err());
    }

    #[test]
    fn a_panel_holds_all_its_numbers() {
        let rows = [row("a", Some(0.5), Some(0.9)), row("a", Some(0.95), None)];
        let chosen: Vec<&SummaryRow> = rows.iter().collect();
        let panel = panel_of(Rect::new(0.0, 0.0, 1.0, 1.0), "a", Unit::Fraction, &chosen);
        let [low, high] = panel.x.scale.ends();
        assert!(low < 0.5 && high > 0.95);
        assert_eq!(panel.x.label, "a (%)");
    }
}
