// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours of a map, as they look and as differences from their mean, and colours over the angle.
//! What is not resolved is hatched in grey.

use anyhow::Result;

use metrics::colour_map::{ColourBin, ColourMap};
use metrics::quantity::{Axis, Curve, Quantity, Unit};

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Picture, Rect};
use super::draw::colour::{Colour, glow, largest_channel, real};
use super::draw::line_colours::LineColours;
use super::draw::panel::{BAND_ERRORS, LABEL_SIZE, Panel, PanelAxis, colour_bar};
use super::draw::scale::significant;
use super::draw::sheet::{Entry, HEIGHT, Sample, Sheet, WIDTH, curve_legend, curve_pens};
use super::map::{BELOW, LedOutline, draw_led, map_panel};

/// Ground of what is not resolved, and the lines over it.
const UNRESOLVED: [Colour; 2] = [Colour::new(205, 205, 210), Colour::new(185, 185, 191)];
/// Lines of the hatch over the longer side of a picture.
const HATCH: usize = 60;

/// The smallest end of a scale of differences, where all are one.
const MIN_SCALE: f64 = 1e-4;

/// Draws the colours as they look beside their differences Δu'v' from the mean, the y axis upwards.
/// The bins of `map` hold recorded ones, whose columns and rows are `axes`.
pub fn colour_map(
    heading: &Heading,
    axes: [&Axis; 2],
    map: &ColourMap,
    leds: &[LedOutline],
) -> Picture {
    let bins = 0..map.bins.len();
    let lengths: Vec<Option<f64>> =
        bins.map(|bin| map.difference(bin).map(|[u, v]| u.hypot(v))).collect();
    let high = lengths.iter().flatten().copied().fold(MIN_SCALE, f64::max);
    let mut legend = Vec::new();
    if !leds.is_empty() {
        legend.push(Entry::new(Sample::Frame(super::palette::LED), "LED"));
    }
    if lengths.iter().any(Option::is_none) {
        legend.push(Entry::new(Sample::Area(UNRESOLVED[0]), "not resolved"));
    }
    let mut sheet = Sheet::new(1600, 770, heading, &legend);
    let [mut left, mut right] = [sheet.body; 2];
    (left.right, right.left) = (sheet.body.centre()[0], sheet.body.centre()[0]);
    let recorded = axes.map(Axis::bins);
    let step = (recorded[0].max(recorded[1]) / HATCH).max(1);
    let mut draw = |room: Rect, words: &str, colour: &dyn Fn(&ColourBin) -> Option<Colour>| {
        let panel = map_panel(&mut sheet, room, axes);
        let canvas = &mut sheet.canvas;
        canvas.image(panel.area, recorded, false, |column, row| {
            let row = recorded[1] - 1 - row;
            let bin = row / map.together[1] * map.size[0] + column / map.together[0];
            colour(&map.bins[bin]).unwrap_or(UNRESOLVED[(column + row) / step % 2])
        });
        let letters = Letters::new(LABEL_SIZE, Align::Left).bold();
        canvas.text(words, [panel.area.left, panel.area.top - 18.0], &letters);
        for led in leds {
            draw_led(canvas, &panel, led);
        }
        panel.frame(canvas);
        panel
    };

    // The brightest channel of all bins is full.
    let resolved = map.bins.iter().filter(|bin| bin.colour.is_some());
    let full = resolved.map(|bin| largest_channel(bin.xyz)).fold(f64::MIN_POSITIVE, f64::max);
    draw(left, "as it looks, linear in luminance", &|bin| real_beside(bin, full));
    let quantity = Quantity::new("Δu'v' from the mean", Unit::Relative);
    let levels = PanelAxis::linear(&quantity, [0.0, high], 6);
    let words = format!("Δu'v' from the mean, 0 to {}", significant(high, 2));
    let panel = draw(right, &words, &|bin| {
        let uv = bin.colour?.uv;
        let length = (uv[0] - map.mean.uv[0]).hypot(uv[1] - map.mean.uv[1]);
        Some(glow(levels.scale.share(length)))
    });
    let bar = colour_bar(&mut sheet.canvas, &panel, &levels, glow);
    sheet.canvas.cut((panel.area.bottom + BELOW).max(bar.bottom + 20.0));
    sheet.canvas.finish()
}

/// The real colour of a bin, where it is resolved, beside channels of at most `full`.
fn real_beside(bin: &ColourBin, full: f64) -> Option<Colour> {
    bin.colour.map(|_| real(bin.xyz.map(|v| v / full)))
}

/// Draws u' and v' less those of all light over the polar angle, above the colours as they look at
/// one luminance; `map` has one column of rings, with their edges in degrees on `axis`.
///
/// # Errors
/// None for an axis that belongs to the map.
pub fn colour_over_angle(heading: &Heading, axis: &Axis, map: &ColourMap) -> Result<Picture> {
    let edges = axis.edges();
    let ring = |bin: usize| {
        let first = bin * map.together[1];
        [edges[first], edges[(first + map.together[1]).min(edges.len() - 1)]]
    };
    let curves = [curves(map, 0, ring)?, curves(map, 1, ring)?];
    let reach = curves.iter().flatten().flat_map(|curve| {
        let values = curve.value().iter().zip(curve.standard_error());
        values.map(|(v, e)| v.abs() + BAND_ERRORS * e)
    });
    let reach = 1.08 * reach.fold(MIN_SCALE, f64::max);

    let pens = curve_pens(LineColours::Ordered, 2, &[]);
    let firsts: Vec<Curve> = curves.iter().filter_map(|runs| runs.first().cloned()).collect();
    let mut legend = curve_legend(&firsts, &pens);
    if map.bins.iter().any(|bin| bin.colour.is_none()) {
        legend.push(Entry::new(Sample::Area(UNRESOLVED[0]), "not resolved"));
    }
    let mut sheet = Sheet::new(WIDTH, HEIGHT, heading, &legend);
    let body = sheet.body.inset(75.0, 5.0, 10.0, 65.0);
    let strip = Rect::new(body.left, body.bottom - 60.0, body.right, body.bottom);
    let [low, high] = axis.range();
    let x = PanelAxis::position(axis.quantity(), low, high, 10);
    let quantity = Quantity::new("difference from the mean", Unit::Relative);
    let y = PanelAxis::linear(&quantity, [-reach, reach], 7);
    let area = Rect::new(body.left, body.top, body.right, strip.top - 20.0);
    let upper = Panel { area, x: x.clone().bare(), y };
    let lower = Panel { area: strip, x, y: PanelAxis::blank(0.0, 1.0) };

    for (bin, colour) in map.bins.iter().enumerate() {
        let ends = ring(bin).map(|deg| upper.at(deg, 0.0)[0]);
        if colour.colour.is_none() {
            let area = Rect::new(ends[0], area.top, ends[1], area.bottom);
            sheet.canvas.rectangle(area, UNRESOLVED[0].with_opacity(0.6));
        }
        draw_strip(&mut sheet.canvas, Rect::new(ends[0], strip.top, ends[1], strip.bottom), colour);
    }
    upper.grid(&mut sheet.canvas);
    for (runs, pen) in curves.iter().zip(&pens) {
        upper.curves(&mut sheet.canvas, runs, &vec![*pen; runs.len()]);
    }
    let room = upper.number_room();
    upper.frame_with_room(&mut sheet.canvas, room);
    lower.frame_with_room(&mut sheet.canvas, room);
    Ok(sheet.canvas.finish())
}

fn draw_strip(canvas: &mut Canvas, area: Rect, bin: &ColourBin) {
    // Neighbours overlap by a little, so that nothing shines through between them.
    let area = Rect::new(area.left, area.top, area.right + 0.5, area.bottom);
    let full = largest_channel(bin.xyz).max(f64::MIN_POSITIVE);
    canvas.rectangle(area, real_beside(bin, full).unwrap_or(UNRESOLVED[0]));
}

/// Runs of rings that are resolved, of u' (0) or v' (1) less the mean.
fn curves(map: &ColourMap, which: usize, ring: impl Fn(usize) -> [f64; 2]) -> Result<Vec<Curve>> {
    let label = ["Δu'", "Δv'"][which];
    let numbers: Vec<usize> = (0..map.bins.len()).collect();
    let is_resolved = |bin: usize| map.bins[bin].colour.is_some();
    let runs = numbers.chunk_by(|a, b| is_resolved(*a) == is_resolved(*b));
    let runs = runs.filter(|run| run.len() > 1 && is_resolved(run[0]));
    let curve = |run: &[usize]| {
        let points = run.iter().filter_map(|bin| {
            let estimate = map.bins[*bin].colour?.estimates()[which];
            let [low, high] = ring(*bin);
            Some([
                f64::midpoint(low, high),
                estimate.value - map.mean.uv[which],
                estimate.standard_error,
            ])
        });
        let points: Vec<[f64; 3]> = points.collect();
        let [x, value, error] = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).collect());
        Curve::new(label, x, value, error)
    };
    runs.map(curve).collect()
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;
    use metrics::chromaticity::Chromaticity;

    fn map(size: [usize; 2], colours: &[Option<[f64; 2]>]) -> ColourMap {
        let colour = |uv| Chromaticity { uv, covariance: [1e-10, 0.0, 1e-10] };
        let bin = |uv: &Option<[f64; 2]>| {
            let [u, v] = uv.unwrap_or([0.2, 0.47]);
            // Y = 1.
            let sum = 9.0 / v;
            let x = 0.25 * u * sum;
            ColourBin { xyz: [x, 1.0, (sum - x - 15.0) / 3.0], colour: uv.map(colour) }
        };
        let bins = colours.iter().map(bin).collect();
        ColourMap { together: [1, 1], size, bins, mean: colour([0.1978, 0.4683]) }
    }

    #[test]
    fn bins_have_their_colours_and_unresolved_ones_are_grey() {
        let (red, white) = ([0.4507, 0.5229], [0.1978, 0.4683]);
        let map = map([2, 2], &[Some(white), None, Some(red), Some(white)]);
        let axis = |name| {
            Axis::uniform(Quantity::new(name, Unit::Millimetre), -2.0, 2.0, 2).expect("an axis")
        };
        let heading = Heading::new("Colours", "D1");
        let picture = colour_map(&heading, [&axis("x"), &axis("y")], &map, &[]);
        let picture = decode(&picture);
        let colour = |x: u32, y: u32| {
            let p = picture.pixel(x, y).expect("a pixel");
            [p.red(), p.green(), p.blue()]
        };
        let greys = UNRESOLVED.map(|colour| colour.rgb);
        // Left as it looks, with rows upwards: red is above white, the grey one below at the right.
        let [above, below] = [colour(250, 300), colour(250, 640)];
        assert!(above[0] > 200 && above[1] < 60 && above[2] < 60, "{above:?}");
        assert!(below.iter().all(|v| v.abs_diff(below[0]) < 6), "{below:?}");
        assert!(greys.contains(&colour(550, 640)) && greys.contains(&colour(1300, 640)));
        // Right the difference: white has none, red the largest.
        assert_eq!([colour(1000, 300), colour(1000, 640)], [glow(1.0).rgb, glow(0.0).rgb]);
    }

    #[test]
    fn curves_end_where_nothing_is_resolved() {
        let uv = |shift: f64| Some([0.1978 + shift, 0.4683]);
        let map = map([1, 6], &[uv(0.0), uv(0.01), None, uv(0.0), uv(0.01), None]);
        let axis = Axis::uniform(Quantity::new("theta", Unit::Degree), 0.0, 90.0, 6);
        let axis = axis.expect("an axis");
        let ring = |bin: usize| [15.0 * bin as f64, 15.0 * (bin + 1) as f64];
        let runs = curves(&map, 0, ring).expect("curves");
        let ends: Vec<&[f64]> = runs.iter().map(Curve::x).collect();
        assert_eq!(ends, [&[7.5, 22.5][..], &[52.5, 67.5]]);
        let heading = Heading::new("Colours", "D1");
        assert!(colour_over_angle(&heading, &axis, &map).is_ok());
    }
}
