// SPDX-License-Identifier: MIT OR Apache-2.0
//! A cross-section of a package with paths of light.
//!
//! In: the generating curve of the dome or its mesh, the LED, the mirror, the solids, and paths. Out:
//! a picture, x to the right and z upwards, one colour for each fate, with a legend that counts them.
//! Points beside the plane are projected onto it.

use super::plots::Heading;
use super::plots::draw::canvas::{Pen, Picture, Point, Rect};
use super::plots::draw::colour::{Colour, LineColours};
use super::plots::draw::sheet::{Entry, Sample, Sheet};
use crate::config::design::Design;
use crate::config::design::dome::Dome;
use crate::config::design::solids::CheckedSolid;
use crate::config::schema::Extent;

use crate::geometry::Meridian;
use crate::results::ray_paths::{PathEnd, TracedPath};

/// Width of the picture, pixels.
const WIDTH: u32 = 1200;
/// Height of heading and legend, pixels.
const STRIP: f64 = 190.0;
/// Points of an arc of the outline.
const ARC_POINTS: usize = 48;

const DOME: [Colour; 2] = [Colour::new(232, 241, 248), Colour::new(69, 107, 140)];
const MEDIUM: [Colour; 2] = [Colour::new(220, 234, 217), Colour::new(79, 122, 71)];
const BODY: [Colour; 2] = [Colour::new(215, 211, 206), Colour::new(91, 81, 72)];
const LED: [Colour; 2] = [Colour::new(242, 201, 76), Colour::new(122, 92, 0)];
const FLOOR: Colour = Colour::new(51, 51, 51);
const MIRROR: Colour = Colour::new(138, 151, 163);

fn colour(end: PathEnd) -> Colour {
    let place = PathEnd::ALL.iter().position(|other| *other == end);
    LineColours::Distinct.pick(place.unwrap_or(0), PathEnd::ALL.len())
}

/// The part of the plane that is drawn, mm, and where it lies in the picture.
struct Frame {
    half: f64,
    low: f64,
    high: f64,
    area: Rect,
}

impl Frame {
    fn at(&self, [x, z]: [f64; 2]) -> Point {
        let scale = self.area.width() / (2.0 * self.half);
        [
            self.area.left + (x + self.half) * scale,
            self.area.top + (self.high - z) * scale,
        ]
    }

    fn all(&self, points: &[[f64; 2]]) -> Vec<Point> {
        points.iter().map(|p| self.at(*p)).collect()
    }

    /// Where a ray from inside leaves the frame; its start if it lies outside.
    fn exit(&self, [x, z]: [f64; 2], [dx, dz]: [f64; 2]) -> [f64; 2] {
        let until = |at: f64, d: f64, low: f64, high: f64| {
            if d > 0.0 {
                (high - at) / d
            } else if d < 0.0 {
                (low - at) / d
            } else {
                f64::INFINITY
            }
        };
        let along = until(x, dx, -self.half, self.half)
            .min(until(z, dz, self.low, self.high))
            .clamp(0.0, 1e3);
        [x + along * dx, z + along * dz]
    }
}

/// The picture.
pub fn path_picture(
    design: &Design,
    meridian: &Meridian,
    heading: &Heading,
    paths: &[TracedPath],
) -> Picture {
    let radius = 0.5 * design.package_width_mm();
    let top = design
        .dome
        .as_ref()
        .map_or(design.led.height_mm, Dome::height_mm);
    let half = (0.5 * design.array.pitch_mm).clamp(1.3 * radius, 2.2 * radius);
    // What stands in view is shown up to its top, but not from so far that the package becomes a dot.
    let points = design.solids.iter().flat_map(|s| s.form.section());
    let seen = points
        .flat_map(|(points, _)| points)
        .filter(|[x, _]| x.abs() <= half)
        .map(|[_, z]| 1.1 * z);
    let high = seen.fold((2.2 * top).max(0.9 * radius), f64::max);
    let (low, high) = (-0.12 * radius, high.min(20.0 * radius));
    let height = STRIP + f64::from(WIDTH) * (high - low) / (2.0 * half);

    let legend: Vec<Entry> = PathEnd::ALL
        .into_iter()
        .filter_map(|end| {
            let count = paths.iter().filter(|path| path.fate == end).count();
            let sample = Sample::Line(Pen::solid(colour(end), 4.0));
            (count > 0).then(|| Entry::new(sample, format!("{} ({count})", end.words())))
        })
        .collect();
    let mut sheet = Sheet::new(WIDTH, height as u32, heading, &legend);
    let frame = Frame {
        half,
        low,
        high,
        area: Rect::new(0.0, sheet.body.top, f64::from(WIDTH), height),
    };
    let canvas = &mut sheet.canvas;

    // The dome, filled, under everything else.
    let outline = match &design.dome {
        Some(Dome::Mesh(mesh)) => mesh.section(),
        _ => outline(meridian).into_iter().collect(),
    };
    let outline: Vec<Vec<Point>> = outline.iter().map(|points| frame.all(points)).collect();
    canvas.shape(&outline, true, Some(DOME[0]), &Pen::solid(DOME[1], 1.2));
    // Solids from the largest to the smallest, so that none hides what it holds.
    let mut solids: Vec<&CheckedSolid> = design.solids.iter().collect();
    solids.sort_by(|a, b| extent(b).total_cmp(&extent(a)));
    for solid in solids {
        let passes = solid.medium.is_some() || solid.stated.shared.scatter.is_some();
        let [fill, edge] = if passes { MEDIUM } else { BODY };
        for (points, closed) in solid.form.section() {
            canvas.with_tooltip(solid.name(), |canvas| {
                let fill = closed.then_some(fill.with_opacity(0.7));
                canvas.shape(&[frame.all(&points)], closed, fill, &Pen::solid(edge, 1.2));
            });
        }
    }
    // The mirror, and the floor beyond it.
    let mirror = match design.mirror.extent {
        Extent::Array => (0.5 * design.array.pitch_mm).min(half),
        Extent::Package => radius,
    };
    for (half, colour, width) in [(half, FLOOR, 2.0), (mirror, MIRROR, 5.0)] {
        let z = -0.01 * radius;
        canvas.line(
            frame.at([-half, z]),
            frame.at([half, z]),
            &Pen::solid(colour, width),
        );
    }
    let [x, z] = [0.5 * design.led.size_mm[0], design.led.height_mm];
    let led = frame.all(&[[-x, 0.0], [-x, z], [x, z], [x, 0.0]]);
    canvas.shape(&[led], true, Some(LED[0]), &Pen::solid(LED[1], 1.0));

    // What becomes of most is drawn first, so that the rest is not covered.
    for end in PathEnd::ALL {
        let pen = Pen::solid(colour(end).with_opacity(0.75), 0.9);
        for path in paths.iter().filter(|path| path.fate == end) {
            let vertices = path.vertices.iter();
            let mut points: Vec<[f64; 2]> = vertices
                .map(|vertex| [vertex.point_mm[0], vertex.point_mm[2]])
                .collect();
            let last = points[points.len() - 1];
            if let Some([dx, _, dz]) = path.leaves_along {
                points.push(frame.exit(last, [dx, dz]));
            }
            canvas.polyline(&frame.all(&points), &pen);
            if path.leaves_along.is_none() {
                canvas.disk(frame.at(last), 2.6, colour(end));
            }
        }
    }
    sheet.finish()
}

/// How far a solid reaches across, mm.
fn extent(solid: &CheckedSolid) -> f64 {
    let shape = solid.form.shape(0.0);
    shape.map_or(0.0, |shape| {
        let bounds = shape.bounds();
        (bounds.high - bounds.low).length()
    })
}

/// The outline of the dome: the right half from the axis down, the left half back.
fn outline(meridian: &Meridian) -> Option<Vec<[f64; 2]>> {
    let mut right = vec![meridian.pieces.first()?.start];
    for piece in &meridian.pieces {
        right.extend(piece.points(ARC_POINTS));
    }
    let left: Vec<[f64; 2]> = right.iter().rev().map(|[r, z]| [-r, *z]).collect();
    Some([right, left].concat())
}
