// SPDX-License-Identifier: MIT OR Apache-2.0
//! Near fields in false colours over a cross-section, with the surface drawn in and, where there is
//! a flow, arrows along it.

use anyhow::{Result, ensure};

use metrics::quantity::Map;

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Picture, Point, Rect};
use super::draw::colour::{Colour, glow};
use super::draw::panel::{Panel, PanelAxis, TICK_SIZE, colour_bar};
use super::draw::sheet::Sheet;
use super::map::{BinImage, false_colours};

const WIDTH: u32 = 1600;
/// Pixels between arrows.
const ARROW_SPACING: f64 = 34.0;
/// Share of the values that the colour scale covers; the rest, at tips and in foci, takes its last
/// colour.
const COVERED: f64 = 0.999;

/// A picture of a near field.
#[derive(Clone, Copy, Debug)]
pub struct NearFieldMap<'a> {
    /// Title, design and wave.
    pub heading: &'a Heading,
    /// Values; rows along z (drawn upwards), columns along x.
    pub map: &'a Map,
    /// Flow along x and z in every bin, for arrows; empty for none.
    pub flow: &'a [[f64; 2]],
    /// The surface of one period: points (x, z) from one end of the period to the other.
    pub surface: &'a [[f64; 2]],
    /// Length of a period, in the unit of x.
    pub period: f64,
    /// Names of the media below and above.
    pub media: [&'a str; 2],
}

/// Draws a near field; colours are linear from 0 to what 99.9 % of the values stay below.
///
/// # Errors
/// Values without a positive one, or a flow that does not fit them.
pub fn near_field_map(picture: &NearFieldMap) -> Result<Picture> {
    let map = picture.map;
    let count = map.value().len();
    ensure!(
        picture.flow.is_empty() || picture.flow.len() == count,
        "expected a flow in each of {count} bins, got {}",
        picture.flow.len()
    );
    let mut sorted = map.value().to_vec();
    sorted.sort_by(f64::total_cmp);
    let high = sorted[((count - 1) as f64 * COVERED) as usize];
    ensure!(high > 0.0, "expected a positive value in the field");

    let [columns, rows] = [map.columns().range(), map.rows().range()];
    let aspect = (rows[1] - rows[0]) / (columns[1] - columns[0]);
    // Beside the panel: 115 left and 200 right; above and below it 200.
    let height = ((f64::from(WIDTH) - 315.0) * aspect).clamp(300.0, 1300.0) + 200.0;
    let mut sheet = Sheet::new(WIDTH, height as u32, picture.heading, &[]);
    let levels = PanelAxis::linear(map.quantity(), [0.0, high], 6);
    let room = sheet.body;
    let panel = false_colours(&mut sheet, room, map, &levels, BinImage::Smooth);
    let canvas = &mut sheet.canvas;
    canvas.clipped(panel.area, |canvas| {
        surface(canvas, &panel, picture);
        if !picture.flow.is_empty() {
            arrows(canvas, &panel, map, picture.flow);
        }
    });
    for (name, y) in
        [(picture.media[0], panel.area.bottom - 24.0), (picture.media[1], panel.area.top + 24.0)]
    {
        let letters = Letters::new(TICK_SIZE, Align::Left);
        let left = panel.area.left + 10.0;
        let plate = Rect::new(left, y - 14.0, left + letters.width(name) + 20.0, y + 14.0);
        canvas.rectangle(plate, Colour::WHITE.with_opacity(0.85));
        canvas.text(name, [left + 10.0, y], &letters);
    }
    panel.frame(canvas);
    colour_bar(canvas, &panel, &levels, glow);
    Ok(sheet.canvas.finish())
}

/// The surface in every period that shows, white on a dark rim.
fn surface(canvas: &mut Canvas, panel: &Panel, picture: &NearFieldMap) {
    let [from, to] = picture.map.columns().range();
    let (first, last) =
        ((from / picture.period).floor() as i64 - 1, (to / picture.period).ceil() as i64 + 1);
    let points: Vec<Vec<Point>> = (first..=last)
        .map(|copy| {
            let shift = copy as f64 * picture.period;
            let at = |p: &[f64; 2]| panel.at(p[0] + shift, p[1]);
            picture.surface.iter().map(at).collect()
        })
        .collect();
    for pen in [Pen::solid(Colour::BLACK.with_opacity(0.55), 4.6), Pen::solid(Colour::WHITE, 2.0)] {
        for line in &points {
            canvas.polyline(line, &pen);
        }
    }
}

/// Arrows on an even grid, each the mean flow of the square about it; length goes as the root of
/// the flow, so that weak flow shows.
fn arrows(canvas: &mut Canvas, panel: &Panel, map: &Map, flow: &[[f64; 2]]) {
    let area = panel.area;
    let [across, down] =
        [area.width(), area.height()].map(|l| (l / ARROW_SPACING).floor().max(1.0));
    let (rows, columns) = (map.rows().bins(), map.columns().bins());
    let half = [
        (columns as f64 / across / 2.0).ceil() as usize,
        (rows as f64 / down / 2.0).ceil() as usize,
    ];
    let mut found: Vec<(Point, [f64; 2])> = Vec::new();
    for j in 0..down as usize {
        for i in 0..across as usize {
            let at = [
                area.left + area.width() * (i as f64 + 0.5) / across,
                area.top + area.height() * (j as f64 + 0.5) / down,
            ];
            let column = ((i as f64 + 0.5) / across * columns as f64) as usize;
            let row = ((down - j as f64 - 0.5) / down * rows as f64) as usize;
            let (mut sum, mut count) = ([0.0; 2], 0.0);
            for r in row.saturating_sub(half[1])..(row + half[1]).min(rows) {
                for c in column.saturating_sub(half[0])..(column + half[0]).min(columns) {
                    let [x, z] = flow[r * columns + c];
                    (sum, count) = ([sum[0] + x, sum[1] + z], count + 1.0);
                }
            }
            found.push((at, sum.map(|s| s / f64::max(count, 1.0))));
        }
    }
    let size = |f: &[f64; 2]| f[0].hypot(f[1]);
    let largest = found.iter().map(|(_, f)| size(f)).fold(0.0, f64::max);
    for (at, f) in &found {
        let length = 0.92 * ARROW_SPACING * (size(f) / largest).sqrt();
        if length >= 4.0 {
            arrow(canvas, *at, [f[0] / size(f), -f[1] / size(f)], length);
        }
    }
}

/// An arrow with its middle at `at`, along a unit vector in pixels.
fn arrow(canvas: &mut Canvas, at: Point, [x, y]: Point, length: f64) {
    let along = |l: f64, side: f64| [at[0] + x * l - y * side, at[1] + y * l + x * side];
    let (tip, tail) = (along(length / 2.0, 0.0), along(-length / 2.0, 0.0));
    let head = (0.42 * length).min(9.0);
    let neck = length / 2.0 - head;
    let barbs = [tip, along(neck, 0.45 * head), along(neck, -0.45 * head)];
    let rim = Colour::BLACK.with_opacity(0.6);
    canvas.line(tail, along(neck, 0.0), &Pen::solid(rim, 3.4));
    canvas.outline(&barbs, &Pen::solid(rim, 2.0));
    canvas.line(tail, along(neck, 0.0), &Pen::solid(Colour::WHITE, 1.5));
    canvas.polygon(&barbs, Colour::WHITE);
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;
    use metrics::quantity::{Axis, Quantity, Unit};

    fn map(value: Vec<f64>, columns: usize) -> Map {
        let rows = value.len() / columns;
        let axis = |name, high, bins| {
            Axis::uniform(Quantity::new(name, Unit::Micrometre), 0.0, high, bins).unwrap()
        };
        let error = vec![0.0; value.len()];
        let (z, x) = (axis("z", rows as f64, rows), axis("x", columns as f64, columns));
        Map::new(Quantity::new("|E|²", Unit::Relative), z, x, value, error).unwrap()
    }

    fn drawn(map: &Map, flow: &[[f64; 2]]) -> Result<Picture> {
        near_field_map(&NearFieldMap {
            heading: &Heading::new("Field", "D1"),
            map,
            flow,
            surface: &[[0.0, 1.0], [3.0, 1.5], [4.0, 1.0]],
            period: 4.0,
            media: ["silicone", "air"],
        })
    }

    #[test]
    fn z_goes_upwards() {
        // Bright below, dark above.
        let bright: Vec<f64> = (0..40).map(|i| if i < 20 { 1.0 } else { 0.0 }).collect();
        let picture = decode(&drawn(&map(bright, 10), &[]).unwrap());
        let red = |y: u32| u32::from(picture.pixel(700, y).unwrap().red());
        let height = picture.height();
        assert!(red(height - 150) > 200 && red(150) < 60);
    }

    #[test]
    fn arrows_follow_the_flow() {
        // All dark but for a few bins in a corner.
        let dark = map((0..800).map(|i| if i < 4 { 1.0 } else { 0.0 }).collect(), 40);
        let white = |flow: [f64; 2]| {
            let picture = decode(&drawn(&dark, &vec![flow; 800]).unwrap());
            // Pixels of arrows in a square without surface or letters.
            let mut runs = [0; 2];
            for y in 400..470 {
                for x in 700..900 {
                    let at = |x, y| picture.pixel(x, y).unwrap().red() > 240;
                    runs[0] += usize::from(at(x, y) && at(x + 3, y));
                    runs[1] += usize::from(at(x, y) && at(x, y + 3));
                }
            }
            runs
        };
        let (along, up) = (white([1.0, 0.0]), white([0.0, 1.0]));
        assert!(along[0] > 2 * along[1] && up[1] > 2 * up[0], "{along:?} {up:?}");
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        assert!(drawn(&map(vec![0.0; 40], 10), &[]).is_err());
        assert!(drawn(&map(vec![1.0; 40], 10), &[[1.0, 0.0]; 3]).is_err());
    }
}
