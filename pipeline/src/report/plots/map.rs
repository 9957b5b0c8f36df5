// SPDX-License-Identifier: MIT OR Apache-2.0
//! Illuminance maps in false colours on a logarithmic scale, with the LEDs outlined.

use anyhow::{Result, ensure};

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Point, Rect};
use super::draw::colour::{Colour, glow};
use super::draw::panel::{Panel, PanelAxis, TICK_SIZE, colour_bar};
use super::draw::scale::Scale;
use super::draw::sheet::{Entry, HEIGHT, Sample, Sheet, WIDTH, led_outline};
use super::section::MarkKind;
use crate::quantity::{Axis, Map};

/// The outline of an LED seen from above, in the unit of the map's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Led {
    /// Middle along the column axis (x) and the row axis (y).
    pub centre: [f64; 2],
    /// Extent along x and y.
    pub size: [f64; 2],
}

/// An illuminance map over a plane.
#[derive(Clone, Copy, Debug)]
pub struct IlluminanceMap<'a> {
    /// Title, design and model.
    pub heading: &'a Heading,
    /// Illuminance; rows along y, columns along x.
    pub map: &'a Map,
    /// LEDs under the plane.
    pub leds: &'a [Led],
    /// Lowest and highest colour. `None`: from the largest value down to a 256th of it, the levels of the paper's equation 2.
    /// Give one range to maps that are to be compared.
    pub range: Option<[f64; 2]>,
    /// Peaks and valleys.
    pub marks: &'a [MapMark],
}

/// A marked point of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapMark {
    /// Peak (a triangle above the point) or valley (below).
    pub kind: MarkKind,
    /// Position along x and y.
    pub at: [f64; 2],
    /// Short text: `valley 25.1 %`.
    pub label: String,
}

/// Draws an illuminance map with the y axis upwards and equal scales.
///
/// # Errors
/// A map without a positive value and without a range, or a range that is not positive and ascending.
pub fn illuminance_map(picture: &IlluminanceMap) -> Result<Vec<u8>> {
    let map = picture.map;
    let top = map.maximum();
    ensure!(
        top > 0.0 || picture.range.is_some(),
        "expected a positive value in the map, or a range"
    );
    let [low, high] = picture.range.unwrap_or([top / 256.0, top]);
    ensure!(
        low > 0.0 && low < high && high.is_finite(),
        "expected a positive, ascending range of colours, got {low} to {high}"
    );
    let mut legend = Vec::new();
    if !picture.leds.is_empty() {
        legend.push(Entry::new(Sample::Frame(LED), "LED"));
    }
    let mut sheet = Sheet::new(WIDTH, HEIGHT, picture.heading, &legend)?;
    let room = sheet.body.inset(75.0, 10.0, 160.0, 65.0);
    let [columns, rows] = [map.columns().range(), map.rows().range()];
    let panel = Panel {
        area: fitted(room, columns, rows),
        x: PanelAxis::linear(map.columns().quantity(), linear(columns), 8),
        y: PanelAxis::linear(map.rows().quantity(), linear(rows), 8),
    };
    let levels = PanelAxis::log(map.quantity(), low, high, 6);
    paint_bins(&mut sheet.canvas, &panel, map, &levels.scale);
    for led in picture.leds {
        draw_led(&mut sheet.canvas, &panel, led);
    }
    for mark in picture.marks {
        draw_mark(&mut sheet.canvas, &panel, mark);
    }
    panel.frame(&mut sheet.canvas);

    let area = panel.area;
    let bar = Rect::new(area.right + 34.0, area.top, area.right + 62.0, area.bottom);
    colour_bar(&mut sheet.canvas, bar, &levels);
    sheet.canvas.into_png()
}

/// Outline of LEDs: light on any colour of the scale, with a dark rim.
const LED: Colour = Colour::new(120, 220, 255);

fn linear([low, high]: [f64; 2]) -> Scale {
    Scale::Linear { low, high }
}

/// The largest area of equal scales in both directions within `room`, in the middle of its width.
fn fitted(room: Rect, columns: [f64; 2], rows: [f64; 2]) -> Rect {
    let (wide, high) = (columns[1] - columns[0], rows[1] - rows[0]);
    let scale = (room.width() / wide).min(room.height() / high);
    let (width, height) = (wide * scale, high * scale);
    let left = room.left + (room.width() - width) / 2.0;
    Rect::new(left, room.top, left + width, room.top + height)
}

/// Colours every pixel of the panel by the bin that it lies in.
pub fn paint_bins(canvas: &mut Canvas, panel: &Panel, map: &Map, levels: &Scale) {
    let width = map.columns().bins();
    canvas.paint(panel.area, |at| {
        let [x, y] = panel.numbers(at);
        let (row, column) = (bin(map.rows(), y)?, bin(map.columns(), x)?);
        let share = levels.share(map.value()[row * width + column]);
        Some(glow(share))
    });
}

/// Bin of an axis that holds `number`.
fn bin(axis: &Axis, number: f64) -> Option<usize> {
    let after = axis.edges().partition_point(|&edge| edge <= number);
    (1..=axis.bins()).contains(&after).then(|| after - 1)
}

fn draw_led(canvas: &mut Canvas, panel: &Panel, led: &Led) {
    let corner = |sx: f64, sy: f64| -> Point {
        panel.at(
            led.centre[0] + sx * led.size[0] / 2.0,
            led.centre[1] + sy * led.size[1] / 2.0,
        )
    };
    let outline = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    canvas.clipped(panel.area, |canvas| {
        led_outline(canvas, &outline, LED);
    });
}

fn draw_mark(canvas: &mut Canvas, panel: &Panel, mark: &MapMark) {
    let [x, y] = panel.at(mark.at[0], mark.at[1]);
    let up = match mark.kind {
        MarkKind::Peak => -1.0,
        MarkKind::Valley => 1.0,
    };
    let (tip, base) = (y + up * 2.0, y + up * 14.0);
    let triangle = [[x, tip], [x - 8.0, base], [x + 8.0, base]];
    canvas.polygon(&triangle, Colour::WHITE);
    canvas.outline(&triangle, &Pen::solid(Colour::BLACK, 1.2));
    let letters = Letters::new(TICK_SIZE, Align::Centre);
    let half = letters.width(&mark.label) / 2.0 + 8.0;
    let [left, right] = [panel.area.left + half, panel.area.right - half];
    let x = x.clamp(left, right.max(left));
    canvas.text_with_rim(&mark.label, [x, base + up * 14.0], &letters);
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;
    use crate::quantity::{Quantity, Unit};

    fn map(value: Vec<f64>) -> Map {
        let axis =
            |name| Axis::uniform(Quantity::new(name, Unit::Millimetre), -2.0, 2.0, 2).unwrap();
        let quantity = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let error = vec![0.0; value.len()];
        Map::new(quantity, axis("y"), axis("x"), value, error).unwrap()
    }

    fn picture(map: &Map, range: Option<[f64; 2]>) -> Result<Vec<u8>> {
        illuminance_map(&IlluminanceMap {
            heading: &Heading::new("Map", "D1"),
            map,
            leds: &[],
            range,
            marks: &[],
        })
    }

    #[test]
    fn rows_go_upwards_and_colours_follow_the_logarithm() {
        let map = map(vec![0.01, 1.0, 0.1, 0.01]);
        let png = picture(&map, Some([0.01, 1.0])).unwrap();
        let picture = decode(&png);
        // A pixel well inside each quarter of the map, which lies left of the middle of the sheet.
        let colour = |x: u32, y: u32| {
            let p = picture.pixel(x, y).unwrap();
            [p.red(), p.green(), p.blue()]
        };
        let at = |share| glow(share).rgb;
        assert_eq!(colour(750, 650), at(1.0));
        assert_eq!(colour(350, 650), at(0.0));
        assert_eq!(colour(350, 250), at(0.5));
        assert_eq!(colour(750, 250), at(0.0));
    }

    #[test]
    fn dark_maps_and_wrong_ranges_are_refused() {
        assert!(picture(&map(vec![0.0; 4]), None).is_err());
        assert!(picture(&map(vec![1.0; 4]), Some([0.0, 1.0])).is_err());
        assert!(picture(&map(vec![1.0; 4]), Some([2.0, 1.0])).is_err());
    }

    #[test]
    fn bins_hold_their_lower_edge() {
        let axis = Axis::uniform(Quantity::new("x", Unit::Millimetre), 0.0, 3.0, 3).unwrap();
        assert_eq!(bin(&axis, 0.0), Some(0));
        assert_eq!(bin(&axis, 1.0), Some(1));
        assert_eq!(bin(&axis, 2.999), Some(2));
        assert_eq!(bin(&axis, 3.0), None);
        assert_eq!(bin(&axis, -0.1), None);
    }
}
