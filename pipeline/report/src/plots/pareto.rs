// SPDX-License-Identifier: MIT OR Apache-2.0
//! A Pareto front: designs by two figures, with error bars, beside the design that the search began
//! with.

use anyhow::{Result, ensure};

use metrics::quantity::Quantity;
use results::figure_entry::FigureEntry;
use results::shown;

use super::Heading;
use super::draw::canvas::{Canvas, Pen, Picture, Point};
use super::draw::colour::Colour;
use super::draw::palette;
use super::draw::panel::{BAND_ERRORS, Panel, PanelAxis};
use super::draw::scale::ends_with_room;
use super::draw::sheet::{Entry, HEIGHT, Sample, Sheet, WIDTH, diamond};

/// Radius of a dot, pixels.
const DOT: f64 = 6.0;
/// Room around the points, as a share of what they span.
const ROOM: f64 = 0.08;

/// Draws designs, each by two figures of the keys `names`; `before` is the design at the beginning.
///
/// # Errors
/// No design.
pub fn pareto_front(
    heading: &Heading,
    names: [&str; 2],
    designs: &[[FigureEntry; 2]],
    before: Option<[FigureEntry; 2]>,
) -> Result<Picture> {
    ensure!(!designs.is_empty(), "a front needs at least one design");
    let colour = palette::neutral(0);
    let mut legend = vec![Entry::new(Sample::Dot(colour, DOT), "designs of the front")];
    if before.is_some() {
        let diamond = Sample::Diamond(Colour::TEXT);
        legend.push(Entry::new(diamond, "design at the beginning"));
    }
    let bar = Pen::solid(Colour::MUTED, 2.0);
    legend.push(Entry::new(Sample::Line(bar), "±2 standard errors, or between two ends"));
    let mut sheet = Sheet::new(WIDTH, HEIGHT, heading, &legend);
    let axis = |number: usize, count: usize| {
        let all = designs.iter().chain(&before).flat_map(|pair| ends(&pair[number]));
        let (name, unit) = shown::named(names[number]);
        PanelAxis::linear(&Quantity::new(name, unit), ends_with_room(all, ROOM), count)
    };
    let panel =
        Panel { area: sheet.body.inset(90.0, 12.0, 10.0, 65.0), x: axis(0, 8), y: axis(1, 6) };
    let canvas = &mut sheet.canvas;
    panel.grid(canvas);
    for design in designs {
        bars(canvas, &panel, design, colour);
        canvas.with_tooltip(&caption(names, design), |canvas| {
            canvas.disk(at(&panel, design), DOT, colour);
        });
    }
    if let Some(before) = &before {
        bars(canvas, &panel, before, Colour::TEXT);
        canvas.with_tooltip(&caption(names, before), |canvas| {
            diamond(canvas, at(&panel, before), 8.5, Colour::TEXT);
        });
    }
    panel.frame(canvas);
    Ok(sheet.canvas.finish())
}

/// Ends of the bar of a figure.
fn ends(figure: &FigureEntry) -> [f64; 2] {
    let half = BAND_ERRORS * figure.standard_error;
    figure.ends().unwrap_or([figure.value - half, figure.value + half])
}

/// Where a figure stands: the middle of one that is known between two ends alone.
fn middle(figure: &FigureEntry) -> f64 {
    figure.ends().map_or(figure.value, |[low, high]| f64::midpoint(low, high))
}

fn at(panel: &Panel, [x, y]: &[FigureEntry; 2]) -> Point {
    panel.at(middle(x), middle(y))
}

fn bars(canvas: &mut Canvas, panel: &Panel, [x, y]: &[FigureEntry; 2], colour: Colour) {
    let pen = Pen::solid(colour, 2.0);
    let [left, right] = ends(x).map(|x| panel.at(x, middle(y)));
    let [low, high] = ends(y).map(|y| panel.at(middle(x), y));
    canvas.line(left, right, &pen);
    canvas.line(low, high, &pen);
}

/// Names and values of both figures.
fn caption(names: [&str; 2], design: &[FigureEntry; 2]) -> String {
    let pairs = names.iter().zip(design);
    let each = pairs.map(|(key, e)| {
        let (name, unit) = shown::named(key);
        format!("{name} {}", shown::text(e, unit))
    });
    each.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;

    use metrics::Estimate;

    /// What a figure between two ends is drawn and said as is between them.
    #[test]
    fn figures_between_ends_reach_from_end_to_end() {
        let open = FigureEntry::new(Estimate::between(0.3, 0.7, 0.01));
        let [low, high] = open.interval.expect("not resolved");
        assert_eq!((ends(&open), middle(&open)), ([low, high], f64::midpoint(low, high)));
        let words = caption(["uniformity", "uniformity"], &[open, open]);
        assert!(words.contains(" to ") && !words.contains('±'), "{words}");
    }

    /// Every design is a dot, where its figures are.
    #[test]
    fn every_design_is_drawn() {
        let heading = Heading::new("front", "test");
        let blue = palette::neutral(0).rgb;
        let pixels = |designs: &[[FigureEntry; 2]]| {
            let picture = pareto_front(&heading, ["a", "b"], designs, None).expect("drawn");
            let picture = decode(&picture);
            let pixels = picture.pixels().iter();
            let of_dots = pixels.filter(|p| [p.red(), p.green(), p.blue()] == blue);
            of_dots.count() as f64
        };
        let design = |x: f64, y: f64| [x, y].map(|v| FigureEntry::new(Estimate::new(v, 0.0)));
        let two = pixels(&[design(0.1, 0.9), design(0.9, 0.1)]);
        let three = pixels(&[design(0.1, 0.9), design(0.5, 0.4), design(0.9, 0.1)]);
        // The legend holds one more.
        assert!((two / three - 0.75).abs() < 0.05, "{two} {three}");
        assert!(pareto_front(&heading, ["a", "b"], &[], None).is_err());
    }
}
