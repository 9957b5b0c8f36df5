// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cross-sections of the illuminance between LEDs, linear above and logarithmic below over one
//! axis.

use anyhow::{Result, ensure};

use metrics::quantity::{Curve, Quantity};

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Picture, Rect};
use super::draw::colour::Colour;
use super::draw::line_colours::LineColours;
use super::draw::palette::LED_GROUND;
use super::draw::panel::{BAND_ERRORS, Mark, Panel, PanelAxis, TICK_SIZE, draw_marks};
use super::draw::sheet::{Entry, HEIGHT, Sample, Sheet, WIDTH, curve_legend, curve_pens};
use super::map::LEVELS;

/// A cross-section with the LEDs below it.
#[derive(Clone, Copy, Debug)]
pub struct Section<'a> {
    /// Title, design and model.
    pub heading: &'a Heading,
    /// Quantity of positions: `position between LEDs` in mm.
    pub position: &'a Quantity,
    /// Quantity of values: `illuminance` in W/mm².
    pub quantity: &'a Quantity,
    /// Curves.
    pub curves: &'a [Curve],
    /// Extents of LEDs along the section: first and last position of each.
    pub leds: &'a [[f64; 2]],
    /// Peaks and valleys.
    pub marks: &'a [Mark],
    /// A value that lies beside the section, such as the peak of the map, with its name.
    pub level: Option<(f64, &'a str)>,
    /// The model whose curves these are.
    pub colours: LineColours,
    /// Smallest positive and largest value to be shown, where sections are to be compared.
    pub range: Option<[f64; 2]>,
}

/// Draws a section, linear above and logarithmic below, from the largest value down to one of
/// [`LEVELS`] parts of it at most.
///
/// # Errors
/// No curves, or an LED whose end lies before its start.
pub fn cross_section(section: &Section) -> Result<Picture> {
    ensure!(!section.curves.is_empty(), "a section needs at least one curve");
    ensure!(
        section.leds.iter().all(|[from, to]| from < to),
        "expected the extent of each LED as start and end in ascending order"
    );
    let values = || section.curves.iter().flat_map(|c| c.value().iter().zip(c.standard_error()));
    let level = section.level.map_or(0.0, |(level, _)| level);
    let top = values().fold(level, |top, (v, e)| top.max(v + BAND_ERRORS * e));
    let top = section.range.map_or(top, |[_, high]| top.max(high));
    // A beam beside the axes leaves the section dark.
    let top = if top > 0.0 { top } else { 1.0 };
    let lowest = values().map(|(&v, _)| v).filter(|&v| v > 0.0).fold(top, f64::min);
    let lowest = section.range.map_or(lowest, |[low, _]| lowest.min(low));

    let pens = curve_pens(section.colours, section.curves.len(), &[]);
    let mut legend = curve_legend(section.curves, &pens);
    if !section.leds.is_empty() {
        legend.push(Entry::new(Sample::Area(LED_GROUND), "LED"));
    }
    let mut sheet = Sheet::new(WIDTH, HEIGHT, section.heading, &legend);

    let ends = |pick: fn(&Curve) -> f64, choose: fn(f64, f64) -> f64| {
        section.curves.iter().map(pick).reduce(choose).unwrap_or(0.0)
    };
    let low = ends(|c| c.x()[0], f64::min);
    let high = ends(|c| c.x()[c.x().len() - 1], f64::max);
    // Labels of marks take about a seventh of a panel's height, above the peak and below the
    // valley.
    let lowest = lowest.max(top / LEVELS);
    let log_room = (top / lowest).powf(0.22).max(1.1);
    let x = PanelAxis::position(section.position, low, high, 10);
    let body = sheet.body.inset(75.0, 5.0, 10.0, 65.0);
    let gap = 26.0;
    let height = (body.height() - gap) / 2.0;
    let upper = Panel {
        area: Rect::new(body.left, body.top, body.right, body.top + height),
        x: x.clone().bare(),
        y: PanelAxis::linear(section.quantity, [0.0, top * 1.17], 5),
    };
    let lower = Panel {
        area: Rect::new(body.left, body.bottom - height, body.right, body.bottom),
        x,
        y: PanelAxis::log(section.quantity, lowest / log_room, top * log_room, 5),
    };
    let room = upper.number_room().max(lower.number_room());
    for panel in [&upper, &lower] {
        draw(&mut sheet.canvas, panel, section, &pens);
        panel.frame_with_room(&mut sheet.canvas, room);
    }
    Ok(sheet.canvas.finish())
}

fn draw(canvas: &mut Canvas, panel: &Panel, section: &Section, pens: &[Pen]) {
    let area = panel.area;
    canvas.clipped(area, |canvas| {
        for [from, to] in section.leds {
            let place = |x: f64| panel.at(x, 1.0)[0];
            let led = Rect::new(place(*from), area.top, place(*to), area.bottom);
            canvas.rectangle(led, LED_GROUND);
        }
    });
    panel.grid(canvas);
    panel.curves(canvas, section.curves, pens);
    if let Some((value, name)) = section.level {
        let [_, y] = panel.at(panel.x.scale.ends[0], value);
        canvas.line([area.left, y], [area.right, y], &LEVEL);
        let letters = Letters::new(TICK_SIZE, Align::Centre);
        canvas.text_with_rim(name, [area.centre()[0], y - 14.0], &letters);
    }
    draw_marks(canvas, panel, section.marks, &[]);
}

/// The line of a value beside the section.
const LEVEL: Pen = Pen::dashed(Colour::MUTED, 1.6, &[8.0, 6.0]);

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;
    use metrics::quantity::Unit;

    fn section_of(value: Vec<f64>, leds: &[[f64; 2]]) -> Result<Picture> {
        let heading = Heading::new("Section", "D1");
        let position = Quantity::new("x", Unit::Millimetre);
        let quantity = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let x: Vec<f64> = (0..value.len()).map(|i| i as f64).collect();
        let error = vec![0.0; value.len()];
        let curves = [Curve::new("a", x, value, error)?];
        cross_section(&Section {
            heading: &heading,
            position: &position,
            quantity: &quantity,
            curves: &curves,
            leds,
            marks: &[],
            level: Some((1.0, "peak")),
            colours: LineColours::OfModel(0),
            range: None,
        })
    }

    #[test]
    fn a_dark_section_is_drawn_and_a_reversed_led_refused() {
        assert!(section_of(vec![1.0, 0.5, 1.0], &[]).is_ok());
        assert!(section_of(vec![0.0, 0.0], &[]).is_ok());
        assert!(section_of(vec![1.0, 0.5], &[[0.5, 0.5]]).is_err());
    }

    #[test]
    fn leds_are_shaded_where_they_are() {
        let png = section_of(vec![1.0; 11], &[[4.5, 5.5]]).unwrap();
        let picture = decode(&png);
        let shaded = |x: u32| {
            (0..picture.height()).any(|y| {
                let p = picture.pixel(x, y).unwrap();
                // The sample in the legend lies above the panels.
                y > 160 && [p.red(), p.green(), p.blue()] == LED_GROUND.rgb
            })
        };
        let columns: Vec<u32> = (0..picture.width()).filter(|&x| shaded(x)).collect();
        let width = f64::from(picture.width()) - 40.0 - 75.0 - 10.0 - 40.0;
        assert!((columns.len() as f64 - width / 10.0).abs() < 4.0, "{}", columns.len());
    }
}
