// SPDX-License-Identifier: MIT OR Apache-2.0
//! The frame that all pictures share: heading at the top, legend in rows below it, the rest for the
//! data.
//!
//! The legend never lies over data: it has its own strip, as high as it needs.

use metrics::quantity::Curve;

use super::super::Heading;
use super::canvas::{Align, Canvas, Letters, Pen, Point, Rect};
use super::colour::Colour;
use super::line_colours::LineColours;

/// Width of most pictures in pixels.
pub const WIDTH: u32 = 1200;
/// Height of most pictures in pixels.
pub const HEIGHT: u32 = 900;

/// Attribute of a group that belongs to the curve of this name.
pub const CURVE: &str = "data-curve";

const MARGIN: f64 = 40.0;
const LEGEND_SIZE: f64 = 17.0;
const LEGEND_ROW: f64 = 28.0;
const SAMPLE_WIDTH: f64 = 44.0;

/// Sample before a name in the legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sample {
    /// A piece of a line.
    Line(Pen),
    /// A piece of an error band.
    Band(Colour),
    /// An area.
    Area(Colour),
    /// A dot of this radius.
    Dot(Colour, f64),
    /// An open diamond.
    Diamond(Colour),
    /// A frame, as LEDs are marked on a map.
    Frame(Colour),
}

/// One name in the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Sample before the name.
    pub sample: Sample,
    /// The name.
    pub label: String,
}

impl Entry {
    /// An entry.
    pub fn new(sample: Sample, label: impl Into<String>) -> Self {
        Self { sample, label: label.into() }
    }
}

/// A canvas with heading and legend, and the room that is left.
pub struct Sheet {
    /// To draw on.
    pub canvas: Canvas,
    /// Room below heading and legend, within the margins.
    pub body: Rect,
}

impl Sheet {
    /// A sheet of so many pixels with its heading and legend.
    pub fn new(width: u32, height: u32, heading: &Heading, legend: &[Entry]) -> Self {
        let mut canvas = Canvas::new(width, height);
        let area = canvas.area();
        let title = fitted(&heading.title, 28.0, area.width() - 2.0 * MARGIN).bold();
        canvas.text(&heading.title, [MARGIN, 40.0], &title);
        let subtitle = fitted(&heading.subtitle, 19.0, area.width() - 2.0 * MARGIN);
        canvas.text(&heading.subtitle, [MARGIN, 73.0], &subtitle.coloured(Colour::MUTED));

        let names = Letters::new(LEGEND_SIZE, Align::Left);
        let mut pen = [MARGIN, 107.0];
        for (index, entry) in legend.iter().enumerate() {
            let width = SAMPLE_WIDTH + 10.0 + names.width(&entry.label);
            if index > 0 && pen[0] + width > area.right - MARGIN {
                pen = [MARGIN, pen[1] + LEGEND_ROW];
            }
            canvas.group(&[(CURVE, &entry.label)], |canvas| {
                draw_sample(canvas, entry.sample, pen);
                canvas.text(&entry.label, [pen[0] + SAMPLE_WIDTH + 10.0, pen[1]], &names);
            });
            pen[0] += width + 34.0;
        }
        let top = if legend.is_empty() { 95.0 } else { pen[1] + 24.0 };
        Self { canvas, body: area.inset(MARGIN, top, MARGIN, 20.0) }
    }
}

/// Letters of `size`, or smaller where `text` would be wider than the room.
fn fitted(text: &str, size: f64, room: f64) -> Letters {
    let letters = Letters::new(size, Align::Left);
    // Bold letters are about an eighth wider.
    let width = letters.width(text) * 1.13;
    Letters::new(size * (room / width).min(1.0), Align::Left)
}

fn draw_sample(canvas: &mut Canvas, sample: Sample, [x, y]: Point) {
    let right = x + SAMPLE_WIDTH;
    let middle = x + SAMPLE_WIDTH / 2.0;
    let patch = Rect::new(x, y - 8.0, right, y + 8.0);
    match sample {
        Sample::Line(pen) => canvas.line([x, y], [right, y], &pen),
        Sample::Band(colour) => canvas.rectangle(patch, colour.with_opacity(0.25)),
        Sample::Area(colour) => canvas.rectangle(patch, colour),
        Sample::Dot(colour, radius) => canvas.disk([middle, y], radius, colour),
        Sample::Diamond(colour) => diamond(canvas, [middle, y], 7.0, colour),
        Sample::Frame(colour) => {
            let frame = Rect::new(middle - 8.0, y - 8.0, middle + 8.0, y + 8.0);
            led_outline(canvas, &frame.corners(), colour);
        }
    }
}

/// The outline of an LED on a map: a bright line with a dark rim, visible on any colour.
pub fn led_outline(canvas: &mut Canvas, corners: &[Point], colour: Colour) {
    canvas.outline(corners, &Pen::solid(Colour::BLACK.with_opacity(0.7), 4.4));
    canvas.outline(corners, &Pen::solid(colour, 2.2));
}

/// An open diamond.
pub fn diamond(canvas: &mut Canvas, [x, y]: Point, radius: f64, colour: Colour) {
    let points = [[x, y - radius], [x + radius, y], [x, y + radius], [x - radius, y]];
    canvas.polygon(&points, Colour::WHITE);
    canvas.outline(&points, &Pen::solid(colour, 2.2));
}

const DASHES: [&[f32]; 4] = [&[], &[12.0, 5.0], &[14.0, 4.0, 3.0, 4.0], &[4.0, 4.0]];

/// Lines of `count` curves; those that no scale orders differ by dashes too. `numbers` says which
/// models curves belong to; without them they are numbered.
pub fn curve_pens(colours: LineColours, count: usize, numbers: &[usize]) -> Vec<Pen> {
    let pen = |i: usize| {
        let number = numbers.get(i).copied().unwrap_or(i);
        let solid = Pen::solid(colours.pick(number, count), 2.6);
        match colours {
            LineColours::Models | LineColours::OfModel(_) | LineColours::Neutral => {
                Pen { dash: DASHES[number % DASHES.len()], ..solid }
            }
            LineColours::Ordered | LineColours::OrderedAndSum => solid,
        }
    };
    (0..count).map(pen).collect()
}

/// Legend of curves, with a line that explains the bands where there is an error to see.
pub fn curve_legend(curves: &[Curve], pens: &[Pen]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = curves
        .iter()
        .zip(pens)
        .map(|(curve, pen)| Entry::new(Sample::Line(*pen), curve.label()))
        .collect();
    if curves.iter().any(|c| c.standard_error().iter().any(|&e| e > 0.0)) {
        entries.push(Entry::new(Sample::Band(Colour::MUTED), "±2 standard errors"));
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::super::canvas::tests::decode;
    use super::*;

    #[test]
    fn a_long_legend_takes_rows_from_the_body() {
        let heading = Heading::new("Far field", "D1");
        let entries = |count: usize| -> Vec<Entry> {
            (0..count)
                .map(|i| {
                    Entry::new(Sample::Dot(Colour::BLACK, 4.0), format!("a rather long name {i}"))
                })
                .collect()
        };
        let top = |count| {
            let sheet = Sheet::new(WIDTH, HEIGHT, &heading, &entries(count));
            sheet.body.top
        };
        assert!(top(0) < top(1));
        assert!((top(12) - top(1)) / LEGEND_ROW >= 2.0);
    }

    #[test]
    fn a_long_title_stays_on_the_sheet() {
        let heading = Heading::new("Very long title ".repeat(12), "sub");
        let sheet = Sheet::new(600, 200, &heading, &[]);
        let picture = decode(&sheet.canvas.finish());
        let dark = |x: u32| (0..200).any(|y| picture.pixel(x, y).unwrap().red() < 200);
        assert!((580..600).all(|x| !dark(x)));
        assert!((40..400).any(dark));
    }

    #[test]
    fn bands_are_explained_only_where_there_are_errors() {
        let curve =
            |error| Curve::new("a", vec![0.0, 1.0], vec![1.0, 2.0], vec![error; 2]).unwrap();
        let pens = curve_pens(LineColours::Models, 1, &[]);
        assert_eq!(curve_legend(&[curve(0.0)], &pens).len(), 1);
        assert_eq!(curve_legend(&[curve(0.1)], &pens).len(), 2);
    }
}
