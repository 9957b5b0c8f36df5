// SPDX-License-Identifier: MIT OR Apache-2.0
//! Illuminance maps in false colours, with the LEDs outlined.

use anyhow::{Result, ensure};

use super::Heading;
use super::draw::canvas::{Canvas, Picture, Point, Rect};
use super::draw::colour::{Colour, glow};
use super::draw::panel::{Mark, Panel, PanelAxis, colour_bar, draw_marks};
use super::draw::scale::AxisScale;
use super::draw::sheet::{Entry, HEIGHT, Sample, Sheet, WIDTH, led_outline};
use crate::quantity::Map;

/// The outline of an LED seen from above, in the unit of the map's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LedOutline {
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
    pub leds: &'a [LedOutline],
    /// Values of the first and the last colour, on a logarithmic or a linear scale. `None`: logarithmic from the largest
    /// value down to a 256th of it, the levels of the paper's equation 2.
    pub range: Option<AxisScale>,
    /// How bins become an image.
    pub image: BinImage,
    /// Peaks and valleys.
    pub marks: &'a [Mark],
}

/// Draws an illuminance map with the y axis upwards and equal scales.
///
/// # Errors
/// A map without a positive value and without a range, or a range that is not positive and ascending.
pub fn illuminance_map(picture: &IlluminanceMap) -> Result<Picture> {
    let map = picture.map;
    let top = map.maximum();
    ensure!(
        top > 0.0 || picture.range.is_some(),
        "expected a positive value in the map, or a range"
    );
    let scale = picture.range.unwrap_or(AxisScale::Log {
        low: top / LEVELS,
        high: top,
    });
    let [low, high] = scale.ends();
    let positive = low > 0.0 || (low == 0.0 && matches!(scale, AxisScale::Linear { .. }));
    ensure!(
        positive && low < high && high.is_finite(),
        "expected a positive, ascending range of colours, got {low} to {high}"
    );
    let mut legend = Vec::new();
    if !picture.leds.is_empty() {
        legend.push(Entry::new(Sample::Frame(LED), "LED"));
    }
    let mut sheet = Sheet::new(WIDTH, HEIGHT, picture.heading, &legend);
    let levels = match scale {
        AxisScale::Log { .. } => PanelAxis::log(map.quantity(), low, high, 6),
        AxisScale::Linear { .. } => PanelAxis::linear(map.quantity(), scale, 6),
    };
    let panel = false_colours(&mut sheet, map, &levels, picture.image);
    for led in picture.leds {
        draw_led(&mut sheet.canvas, &panel, led);
    }
    draw_marks(&mut sheet.canvas, &panel, picture.marks);
    panel.frame(&mut sheet.canvas);
    colour_bar(&mut sheet.canvas, &panel, &levels);
    Ok(sheet.finish())
}

/// Ratio of the largest value to that of the first colour: the 256 levels of the paper's equation 2.
pub const LEVELS: f64 = 256.0;

/// Outline of LEDs: light on any colour of the scale, with a dark rim.
const LED: Colour = Colour::new(120, 220, 255);

/// How a map's bins become an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BinImage {
    /// A rectangle of one colour for each bin.
    Sharp,
    /// Colours that run into each other.
    Smooth,
    /// None: a script paints it.
    Omitted,
}

/// Draws a map in colours on the largest area of equal scales in both directions, in the middle of
/// the sheet's width, with room for a colour bar at the right; returns its panel.
pub fn false_colours(sheet: &mut Sheet, map: &Map, levels: &PanelAxis, image: BinImage) -> Panel {
    let room = sheet.body.inset(75.0, 10.0, 160.0, 65.0);
    let [columns, rows] = [map.columns().range(), map.rows().range()];
    let extent = [columns, rows].map(|[low, high]| high - low);
    let scale = (room.width() / extent[0]).min(room.height() / extent[1]);
    let [width, height] = extent.map(|e| e * scale);
    let left = room.left + (room.width() - width) / 2.0;
    let linear = |[low, high]: [f64; 2]| AxisScale::Linear { low, high };
    let panel = Panel {
        area: Rect::new(left, room.top, left + width, room.top + height),
        x: PanelAxis::linear(map.columns().quantity(), linear(columns), 9),
        y: PanelAxis::linear(map.rows().quantity(), linear(rows), 8),
    };
    panel.grid(&mut sheet.canvas);
    let bins = [map.columns().bins(), map.rows().bins()];
    if image != BinImage::Omitted {
        let smooth = image == BinImage::Smooth;
        sheet.canvas.image(panel.area, bins, smooth, |column, row| {
            let row = bins[1] - 1 - row;
            glow(levels.scale.share(map.value()[row * bins[0] + column]))
        });
    }
    panel
}

fn draw_led(canvas: &mut Canvas, panel: &Panel, led: &LedOutline) {
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

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;
    use crate::quantity::{Axis, Quantity, Unit};

    fn map(value: Vec<f64>) -> Map {
        let axis =
            |name| Axis::uniform(Quantity::new(name, Unit::Millimetre), -2.0, 2.0, 2).unwrap();
        let quantity = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let error = vec![0.0; value.len()];
        Map::new(quantity, axis("y"), axis("x"), value, error).unwrap()
    }

    fn picture(map: &Map, range: Option<[f64; 2]>) -> Result<Picture> {
        illuminance_map(&IlluminanceMap {
            heading: &Heading::new("Map", "D1"),
            map,
            leds: &[],
            range: range.map(|[low, high]| AxisScale::Log { low, high }),
            image: BinImage::Sharp,
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
}
