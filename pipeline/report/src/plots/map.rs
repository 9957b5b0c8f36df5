// SPDX-License-Identifier: MIT OR Apache-2.0
//! Illuminance maps in false colours, linear beside logarithmic, with the LEDs outlined.

use anyhow::{Result, ensure};

use metrics::quantity::{Axis, Map};

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Picture, Point, Rect};
use super::draw::colour::{Colour, diverging, glow};
use super::draw::palette::LED;
use super::draw::panel::{BAND_ERRORS, LABEL_SIZE, Mark, Panel, PanelAxis, colour_bar, draw_marks};
use super::draw::scale::{common_power, power_of_ten, rounded, significant};
use super::draw::sheet::{Entry, Sample, Sheet, led_outline};

/// The outline of an LED seen from above, in the unit of the map's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LedOutline {
    /// Middle along the column axis (x) and the row axis (y).
    pub centre: [f64; 2],
    /// Extent along its own x and y.
    pub size: [f64; 2],
    /// Turn of these, degrees, counterclockwise.
    pub turn_deg: f64,
}

impl LedOutline {
    /// Corners, in order.
    fn corners(&self) -> [Point; 4] {
        let (sin, cos) = self.turn_deg.to_radians().sin_cos();
        [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, y]| {
            let [u, v] = [x * self.size[0], y * self.size[1]];
            [self.centre[0] + u * cos - v * sin, self.centre[1] + u * sin + v * cos]
        })
    }
}

/// Scale of the colours of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapScale {
    /// From 0 to the largest value.
    Linear,
    /// From the smallest positive value to the largest.
    Logarithmic,
    /// Differences, from minus to plus the largest; within two errors they have the colour of 0.
    Difference,
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
    /// Smallest positive and largest value that have a colour of their own, where maps are to be
    /// compared; without it, those of the map.
    pub range: Option<[f64; 2]>,
    /// Image of the bins.
    pub image: BinImage,
    /// Peaks and valleys.
    pub marks: &'a [Mark],
    /// The line of the cross-section.
    pub section: Option<[Point; 2]>,
}

impl<'a> IlluminanceMap<'a> {
    /// The bins of `map` alone, on its own scale.
    pub fn plain(heading: &'a Heading, map: &'a Map) -> Self {
        let image = BinImage::Sharp;
        Self { heading, map, leds: &[], range: None, image, marks: &[], section: None }
    }
}

/// Smallest positive and largest value, at most [`LEVELS`] apart; of a dark map 1 and [`LEVELS`].
pub fn map_range(values: &[f64]) -> [f64; 2] {
    let lit = values.iter().copied().filter(|v| *v > 0.0);
    let [least, most] = lit.fold([f64::INFINITY, 0.0], |[a, b], v| [v.min(a), v.max(b)]);
    if most <= f64::MIN_POSITIVE {
        return [1.0, LEVELS];
    }
    let least = least.max(most / LEVELS);
    // An even map still needs two ends.
    [if least < 0.9 * most { least } else { 0.5 * most }, most]
}

/// Draws a map on a linear and on a logarithmic scale side by side, the y axis upwards.
///
/// # Errors
/// A range that is not positive and ascending.
pub fn illuminance_map(picture: &IlluminanceMap) -> Result<Picture> {
    let mut sheet = Sheet::new(1600, 770, picture.heading, &legend(picture));
    let [mut left, mut right] = [sheet.body; 2];
    (left.right, right.left) = (sheet.body.centre()[0], sheet.body.centre()[0]);
    let bottom = draw(&mut sheet, left, picture, MapScale::Linear)?;
    draw(&mut sheet, right, picture, MapScale::Logarithmic)?;
    sheet.canvas.cut(bottom);
    Ok(sheet.canvas.finish())
}

/// Draws a map on one scale.
///
/// # Errors
/// As [`illuminance_map`].
pub fn map_on_scale(picture: &IlluminanceMap, scale: MapScale) -> Result<Picture> {
    let mut sheet = Sheet::new(840, 770, picture.heading, &legend(picture));
    let body = sheet.body;
    let bottom = draw(&mut sheet, body, picture, scale)?;
    sheet.canvas.cut(bottom);
    Ok(sheet.canvas.finish())
}

fn legend(picture: &IlluminanceMap) -> Vec<Entry> {
    let mut legend = Vec::new();
    if !picture.leds.is_empty() {
        legend.push(Entry::new(Sample::Frame(LED), "LED"));
    }
    if picture.section.is_some() {
        legend.push(Entry::new(Sample::Line(SECTION), "cross-section"));
    }
    legend
}

/// Draws one map with its colour bar in this room; returns the lower end of both.
fn draw(sheet: &mut Sheet, room: Rect, picture: &IlluminanceMap, scale: MapScale) -> Result<f64> {
    let map = picture.map;
    let [low, high] = match scale {
        MapScale::Difference => [f64::MIN_POSITIVE, largest_difference(map).unwrap_or(1.0)],
        _ => picture.range.unwrap_or_else(|| map_range(map.value())),
    };
    ensure!(
        low > 0.0 && low < high && high.is_finite(),
        "expected a positive, ascending range of colours, got {low} to {high}"
    );
    let (levels, words) = match scale {
        MapScale::Linear => {
            let words = format!("linear, 0 to {}", significant(high, 2));
            (PanelAxis::linear(map.quantity(), [0.0, high], 6), words)
        }
        MapScale::Logarithmic => {
            let ratio = significant(high / low, 2);
            let power = common_power(high);
            let [from, to] = [low, high].map(|end| rounded(end / 10f64.powi(power), 2));
            let ends = match power {
                0 => format!("{from} to {to}"),
                power => format!("({from} to {to}) × {}", power_of_ten(power)),
            };
            let words = format!("logarithmic, 1 : {ratio}, {ends}");
            (PanelAxis::log(map.quantity(), low, high, 6), words)
        }
        MapScale::Difference => {
            let words = match largest_difference(map) {
                Some(high) => format!("difference, within ±{}", significant(high, 2)),
                None => "no difference beyond two errors, of".to_owned(),
            };
            (PanelAxis::linear(map.quantity(), [-high, high], 6), words)
        }
    };
    let tint = if scale == MapScale::Difference { diverging } else { glow };
    let symbol = map.quantity().unit().symbol();
    let panel = match scale {
        MapScale::Difference => differences(sheet, room, map, &levels),
        _ => false_colours(sheet, room, map, &levels, picture.image),
    };
    let canvas = &mut sheet.canvas;
    let place = [panel.area.left, panel.area.top - 18.0];
    let letters = Letters::new(LABEL_SIZE, Align::Left).bold();
    canvas.text(&format!("{words} {symbol}"), place, &letters);
    if let Some(ends) = picture.section {
        canvas.clipped(panel.area, |canvas| {
            let [from, to] = ends.map(|[x, y]| panel.at(x, y));
            canvas.line(from, to, &Pen::solid(Colour::WHITE.with_opacity(0.5), 2.6));
            canvas.line(from, to, &SECTION);
        });
    }
    for led in picture.leds {
        draw_led(canvas, &panel, led);
    }
    let boxes: Vec<Rect> = picture.leds.iter().map(|led| led_place(&panel, led)).collect();
    draw_marks(canvas, &panel, picture.marks, &boxes);
    panel.frame(canvas);
    let bar = colour_bar(canvas, &panel, &levels, tint);
    Ok((panel.area.bottom + BELOW).max(bar.bottom + MARGIN))
}

/// Room below a map for the numbers and the name of its axis, and below the rest of a picture,
/// pixels.
pub(super) const BELOW: f64 = 76.0;
const MARGIN: f64 = 20.0;

/// The line of the cross-section.
const SECTION: Pen = Pen::dashed(Colour::BLACK, 1.4, &[6.0, 5.0]);

/// Largest ratio of the largest value to that of the first colour: the 256 levels of the paper's
/// equation 2.
pub const LEVELS: f64 = 256.0;

/// Image of a map's bins.
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
/// the room's width, with room for a colour bar at the right; returns its panel.
pub fn false_colours(
    sheet: &mut Sheet,
    room: Rect,
    map: &Map,
    levels: &PanelAxis,
    image: BinImage,
) -> Panel {
    let panel = map_panel(sheet, room, [map.columns(), map.rows()]);
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

/// The largest difference, of either sign, that is more than two errors.
fn largest_difference(map: &Map) -> Option<f64> {
    let bins = map.value().iter().map(|value| value.abs()).zip(map.standard_error());
    let seen = bins.filter(|(size, error)| *size > BAND_ERRORS * **error).map(|(size, _)| size);
    seen.reduce(f64::max)
}

/// Draws the differences that are more than two errors, as [`false_colours`] does values.
fn differences(sheet: &mut Sheet, room: Rect, map: &Map, levels: &PanelAxis) -> Panel {
    let panel = map_panel(sheet, room, [map.columns(), map.rows()]);
    let bins = [map.columns().bins(), map.rows().bins()];
    sheet.canvas.image(panel.area, bins, false, |column, row| {
        let at = (bins[1] - 1 - row) * bins[0] + column;
        let (value, error) = (map.value()[at], map.standard_error()[at]);
        let is_seen = value.abs() > BAND_ERRORS * error;
        diverging(if is_seen { levels.scale.share(value) } else { 0.5 })
    });
    panel
}

/// The panel of a map over these axes, with its grid.
pub fn map_panel(sheet: &mut Sheet, room: Rect, [x, y]: [&Axis; 2]) -> Panel {
    let room = room.inset(75.0, 34.0, 172.0, 65.0);
    let [columns, rows] = [x.range(), y.range()];
    let extent = [columns, rows].map(|[low, high]| high - low);
    let scale = (room.width() / extent[0]).min(room.height() / extent[1]);
    let [width, height] = extent.map(|e| e * scale);
    let left = room.left + (room.width() - width) / 2.0;
    // Equal steps on both axes.
    let ticks = |length: f64| (9.0 * length / extent[0].max(extent[1])).ceil() as usize;
    let panel = Panel {
        area: Rect::new(left, room.top, left + width, room.top + height),
        x: PanelAxis::linear(x.quantity(), columns, ticks(extent[0])),
        y: PanelAxis::linear(y.quantity(), rows, ticks(extent[1])),
    };
    panel.grid(&mut sheet.canvas);
    panel
}

/// Pixels of an LED with its outline.
fn led_place(panel: &Panel, led: &LedOutline) -> Rect {
    let corners = led.corners().map(|[x, y]| panel.at(x, y));
    let end =
        |k: usize, of: fn(f64, f64) -> f64| corners.iter().map(|at| at[k]).fold(corners[0][k], of);
    let [left, top] = [end(0, f64::min), end(1, f64::min)];
    Rect::new(left - 4.0, top - 4.0, end(0, f64::max) + 4.0, end(1, f64::max) + 4.0)
}

pub(super) fn draw_led(canvas: &mut Canvas, panel: &Panel, led: &LedOutline) {
    let outline = led.corners().map(|[x, y]| panel.at(x, y));
    canvas.clipped(panel.area, |canvas| {
        led_outline(canvas, &outline, LED);
    });
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;
    use metrics::quantity::{Quantity, Unit};

    fn map(value: Vec<f64>) -> Map {
        let axis =
            |name| Axis::uniform(Quantity::new(name, Unit::Millimetre), -2.0, 2.0, 2).unwrap();
        let quantity = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let error = vec![0.0; value.len()];
        Map::new(quantity, axis("y"), axis("x"), value, error).unwrap()
    }

    fn picture(map: &Map, range: Option<[f64; 2]>) -> Result<Picture> {
        let heading = Heading::new("Map", "D1");
        illuminance_map(&IlluminanceMap { range, ..IlluminanceMap::plain(&heading, map) })
    }

    #[test]
    fn outlines_turn_counterclockwise() {
        let led = |turn_deg| LedOutline { centre: [1.0, 2.0], size: [2.0, 0.5], turn_deg };
        assert_eq!(led(0.0).corners(), [[0.0, 1.75], [2.0, 1.75], [2.0, 2.25], [0.0, 2.25]]);
        // The corner at low x and low y comes to high x and low y.
        let [[x, y], ..] = led(90.0).corners();
        assert!((x - 1.25).abs() < 1e-12 && (y - 1.0).abs() < 1e-12, "{x} {y}");
    }

    #[test]
    fn rows_go_upwards_and_colours_follow_the_logarithm() {
        let map = map(vec![0.01, 1.0, 0.1, 0.01]);
        let png = picture(&map, Some([0.01, 1.0])).unwrap();
        let picture = decode(&png);
        // A pixel well inside each quarter of the logarithmic map, right of the linear one.
        let colour = |x: u32, y: u32| {
            let p = picture.pixel(x, y).unwrap();
            [p.red(), p.green(), p.blue()]
        };
        let at = |share| glow(share).rgb;
        assert_eq!(colour(1300, 640), at(1.0));
        assert_eq!(colour(1000, 640), at(0.0));
        assert_eq!(colour(1000, 300), at(0.5));
        assert_eq!(colour(1300, 300), at(0.0));
        // On the linear scale a tenth is a tenth of the way.
        assert_eq!(colour(550, 640), at(1.0));
        assert_eq!(colour(250, 300), at(0.1));
    }

    #[test]
    fn differences_of_either_sign_set_the_scale_and_noise_does_not() {
        let with_errors = |value: Vec<f64>, error: Vec<f64>| {
            let plain = map(value.clone());
            let (rows, columns) = (plain.rows().clone(), plain.columns().clone());
            Map::new(plain.quantity().clone(), rows, columns, value, error).unwrap()
        };
        let darker = with_errors(vec![-3.0, -1.0, 0.2, -9.0], vec![0.1, 0.1, 0.5, 8.0]);
        assert_eq!(largest_difference(&darker), Some(3.0));
        let noise = with_errors(vec![-3.0, 1.0, 0.2, 9.0], vec![9.0; 4]);
        assert_eq!(largest_difference(&noise), None);
        let drawn = |map: &Map| {
            let heading = Heading::new("Map", "D1");
            let picture = IlluminanceMap::plain(&heading, map);
            map_on_scale(&picture, MapScale::Difference).unwrap()
        };
        assert!(drawn(&darker).svg().contains("within ±3"));
        assert!(drawn(&noise).svg().contains("no difference beyond two errors"));
        let picture = decode(&drawn(&darker));
        let colour = |x: u32, y: u32| {
            let p = picture.pixel(x, y).unwrap();
            [p.red(), p.green(), p.blue()]
        };
        // The upper row holds the third and fourth bins, which are noise.
        let [left, right] = [200, 500];
        assert_eq!(colour(left, 640), diverging(0.0).rgb);
        assert_eq!(colour(left, 300), diverging(0.5).rgb);
        assert_eq!(colour(right, 300), diverging(0.5).rgb);
    }

    #[test]
    fn pictures_of_wide_maps_end_below_them() {
        let axis = |name, half: f64, bins| {
            Axis::uniform(Quantity::new(name, Unit::Millimetre), -half, half, bins).unwrap()
        };
        let height = |half: f64| {
            let quantity = Quantity::new("illuminance", Unit::Lux);
            let (y, x) = (axis("y", half, 1), axis("x", 30.0, 2));
            let map = Map::new(quantity, y, x, vec![1.0, 2.0], vec![0.0; 2]).unwrap();
            decode(&picture(&map, None).unwrap()).height()
        };
        // 513 pixels wide, with 129 above and 76 below; the colour bar is no shorter than 230.
        assert_eq!([height(30.0), height(20.0), height(0.5)], [718, 547, 379]);
    }

    #[test]
    fn ranges_follow_the_values() {
        for (values, [low, high]) in [
            (&[0.0, 0.5, 4.0][..], [0.5, 4.0]),
            (&[1e-9, 256.0], [1.0, 256.0]),
            (&[2.0, 2.0], [1.0, 2.0]),
            (&[0.0], [1.0, 256.0]),
        ] {
            let found = map_range(values);
            let off = (found[0] - low).abs() + (found[1] - high).abs();
            assert!(off < 1e-12, "{values:?}: {found:?}");
        }
    }

    #[test]
    fn dark_maps_are_drawn_and_wrong_ranges_refused() {
        assert!(picture(&map(vec![0.0; 4]), None).is_ok());
        assert!(picture(&map(vec![1.0; 4]), Some([0.0, 1.0])).is_err());
        assert!(picture(&map(vec![1.0; 4]), Some([2.0, 1.0])).is_err());
    }
}
