// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures of the pictures of a film, each over the number of the picture in a small panel of its own.

use anyhow::{Result, ensure};

use metrics::Estimate;
use metrics::quantity::{Curve, Quantity, Unit};

use super::Heading;
use super::draw::canvas::{Align, Letters, Picture, Rect};
use super::draw::line_colours::LineColours;
use super::draw::panel::{BAND_ERRORS, LABEL_SIZE, Panel, PanelAxis};
use super::draw::sheet::{Sheet, WIDTH, curve_pens};

/// Panels beside each other.
const COLUMNS: usize = 2;
/// Height of a panel with its name and numbers, and of the heading.
const HEIGHT: f64 = 220.0;
const HEAD: f64 = 120.0;

/// Draws figures with their error bands; a picture without a figure leaves a gap.
///
/// # Errors
/// No figure, or one without any value.
pub fn film(heading: &Heading, figures: &[(Quantity, Vec<Option<Estimate>>)]) -> Result<Picture> {
    ensure!(!figures.is_empty(), "expected a figure of a film, got none");
    let height = HEAD + HEIGHT * figures.len().div_ceil(COLUMNS) as f64;
    let mut sheet = Sheet::new(WIDTH, height as u32, heading, &[]);
    let pens = curve_pens(LineColours::Neutral, 1, &[]);
    let width = sheet.body.width() / COLUMNS as f64;
    for (number, (quantity, values)) in figures.iter().enumerate() {
        ensure!(values.iter().any(Option::is_some), "{}: no value", quantity.name());
        let band = |of: &Estimate| of.value + BAND_ERRORS * of.standard_error;
        let top = values.iter().flatten().map(band).fold(0.0, f64::max);
        let top = if top > 0.0 { 1.08 * top } else { 1.0 };
        let count = values.len();
        let ends = [1.0, (count as f64).max(2.0)];
        let pictures = Quantity::new("picture", Unit::Relative);
        let mut x = PanelAxis::linear(&pictures, ends, (count - 1).clamp(1, 8));
        x.label.clear();
        let mut y = PanelAxis::linear(quantity, [0.0, top], 3);
        let name = std::mem::take(&mut y.label);
        let [column, row] = [number % COLUMNS, number / COLUMNS].map(|place| place as f64);
        let left = sheet.body.left + width * column;
        let above = sheet.body.top + HEIGHT * row;
        let area = Rect::new(left + 70.0, above + 30.0, left + width - 20.0, above + 170.0);
        let panel = Panel { area, x, y };
        let canvas = &mut sheet.canvas;
        canvas.text(&name, [area.left, above + 10.0], &Letters::new(LABEL_SIZE, Align::Left));
        panel.grid(canvas);
        let points: Vec<(f64, Estimate)> = values
            .iter()
            .enumerate()
            .filter_map(|(place, value)| Some((place as f64 + 1.0, (*value)?)))
            .collect();
        // A point by itself has no line.
        for run in points.chunk_by(|a, b| b.0 - a.0 < 1.5).filter(|run| run.len() > 1) {
            let column = |read: fn(&(f64, Estimate)) -> f64| run.iter().map(read).collect();
            let error = column(|(_, of)| of.standard_error);
            let curve = Curve::new(&name, column(|(x, _)| *x), column(|(_, of)| of.value), error)?;
            panel.curves(canvas, &[curve], &pens);
        }
        for (x, of) in points {
            canvas.disk(panel.at(x, of.value), 3.5, pens[0].colour);
        }
        panel.frame(canvas);
    }
    Ok(sheet.canvas.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_without_a_figure_leave_gaps() {
        let of = |value: f64| Some(Estimate::new(value, 0.1));
        let draw = |values: &[Option<Estimate>]| {
            let quantity = Quantity::new("halo", Unit::Fraction);
            film(&Heading::new("Film", "b"), &[(quantity, values.to_vec())])
        };
        let count = |values: &[Option<Estimate>], what: &str| {
            draw(values).expect("figures").svg().matches(what).count()
        };
        let (whole, broken) =
            ([of(1.0), of(2.0), of(3.0), of(2.0)], [of(1.0), None, of(3.0), of(2.0)]);
        assert_eq!([count(&whole, "<circle"), count(&broken, "<circle")], [4, 3]);
        // A band and a line of each run.
        assert_eq!([count(&whole, "data-curve"), count(&[of(1.0), None], "data-curve")], [2, 0]);
        assert_eq!(count(&[of(0.0), of(0.0)], "<circle"), 2);
        assert!(draw(&[None, None]).is_err());
    }
}
