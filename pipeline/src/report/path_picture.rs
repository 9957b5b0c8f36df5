// SPDX-License-Identifier: MIT OR Apache-2.0
//! A cross-section of a package with paths of light, as SVG.
//!
//! In: the generating curve of the dome or its mesh, the LED, the mirror, the solids, and paths. Out: the text of an SVG image, x to the right and z upwards, one colour for
//! each fate, with a legend that counts them. Points beside the plane are projected onto it.

use std::fmt::Write;

use crate::config::design::Design;
use crate::config::design::dome_mesh::DomeMesh;
use crate::config::design::solids::CheckedSolid;
use crate::config::schema::Extent;
use crate::geometry::{Curve, Meridian, Piece};
use crate::results::ray_paths::{PathEnd, TracedPath};

/// Width of the image, pixels.
const WIDTH: f64 = 1200.0;
/// Height of the strip with title and legend, pixels.
const STRIP: f64 = 92.0;

/// Colours that can be told apart with any colour vision.
fn colour(end: PathEnd) -> &'static str {
    match end {
        PathEnd::EscapedUp => "#0072b2",
        PathEnd::EscapedDown => "#009e73",
        PathEnd::AbsorbedMirror => "#d55e00",
        PathEnd::AbsorbedLed => "#cc79a7",
        PathEnd::AbsorbedSurface => "#8c564b",
        PathEnd::AbsorbedMedium => "#e69f00",
        PathEnd::Lost => "#e00000",
    }
}

/// The part of the plane that is drawn, mm.
struct Frame {
    half: f64,
    low: f64,
    high: f64,
}

impl Frame {
    fn scale(&self) -> f64 {
        WIDTH / (2.0 * self.half)
    }

    fn point(&self, x: f64, z: f64) -> String {
        let (u, v) = (
            (x + self.half) * self.scale(),
            STRIP + (self.high - z) * self.scale(),
        );
        format!("{u:.2} {v:.2}")
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

/// The image.
pub fn svg(design: &Design, meridian: &Meridian, title: &str, paths: &[TracedPath]) -> String {
    let radius = 0.5 * design.package_width_mm();
    let top = design.dome.map_or(design.led.height_mm, |d| d.height_mm);
    let half = (0.5 * design.array.pitch_mm).clamp(1.3 * radius, 2.2 * radius);
    // What stands in view is shown up to its top, but not from so far that the package becomes a dot.
    let points = design.solids.iter().flat_map(|s| s.form.section());
    let points = points.flat_map(|(points, _)| points);
    let seen = points
        .filter(|[x, _]| x.abs() <= half)
        .map(|[_, z]| 1.1 * z);
    let frame = Frame {
        half,
        low: -0.12 * radius,
        high: seen
            .fold((2.2 * top).max(0.9 * radius), f64::max)
            .min(20.0 * radius),
    };
    let height = STRIP + (frame.high - frame.low) * frame.scale();
    let mut out = String::new();
    let mut line = |text: String| {
        out.push_str(&text);
        out.push('\n');
    };
    line(format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0} {height:.0}" width="{WIDTH:.0}" height="{height:.0}" font-family="DejaVu Sans, Helvetica, Arial, sans-serif">"#
    ));
    line(format!("<title>{}</title>", escaped(title)));
    line(r##"<rect width="100%" height="100%" fill="#ffffff"/>"##.to_owned());
    line(format!(
        r##"<text x="16" y="30" font-size="20" fill="#222222">{}</text>"##,
        escaped(title)
    ));

    // The dome, filled, under everything else.
    let dome = match &design.mesh {
        Some(mesh) => cut(&frame, mesh),
        None if meridian.pieces.is_empty() => String::new(),
        None => outline(&frame, meridian),
    };
    if !dome.is_empty() {
        line(format!(
            r##"<path d="{dome}" fill="#e8f1f8" fill-rule="evenodd" stroke="#456b8c" stroke-width="1.2" stroke-linejoin="round"/>"##
        ));
    }
    // Solids from the largest to the smallest, so that none hides what it holds.
    let mut solids: Vec<&CheckedSolid> = design.solids.iter().collect();
    solids.sort_by(|a, b| extent(b).total_cmp(&extent(a)));
    for solid in solids {
        for (points, closed) in solid.form.section() {
            line(stroke(&frame, solid, &points, closed));
        }
    }
    ground(&frame, design, radius, &mut line);
    let [x, z] = [0.5 * design.led.size_mm[0], design.led.height_mm];
    line(format!(
        r##"<path d="M {} L {} L {} L {} Z" fill="#f2c94c" stroke="#7a5c00" stroke-width="1"/>"##,
        frame.point(-x, 0.0),
        frame.point(-x, z),
        frame.point(x, z),
        frame.point(x, 0.0)
    ));

    // What becomes of most is drawn first, so that the rest is not covered.
    for end in PathEnd::ALL {
        for path in paths.iter().filter(|path| path.fate == end) {
            line(trail(&frame, path));
        }
    }
    legend(paths, &mut line);
    line("</svg>".to_owned());
    out
}

/// How far a solid reaches across, mm.
fn extent(solid: &CheckedSolid) -> f64 {
    let shape = solid.form.shape(0.0);
    shape.map_or(0.0, |shape| shape.bounds().size().length())
}

/// A line of the section of a solid.
fn stroke(frame: &Frame, solid: &CheckedSolid, points: &[[f64; 2]], closed: bool) -> String {
    let mut d = String::new();
    for (k, [x, z]) in points.iter().enumerate() {
        let before = if k == 0 { "M " } else { " L " };
        let _ = write!(d, "{before}{}", frame.point(*x, *z));
    }
    let (fill, edge) = match (&solid.medium, closed) {
        (Some(_), true) => ("#dcead9", "#4f7a47"),
        (Some(_), false) => ("none", "#4f7a47"),
        (None, true) => ("#d7d3ce", "#5b5148"),
        (None, false) => ("none", "#5b5148"),
    };
    let end = if closed { " Z" } else { "" };
    let name = escaped(solid.name());
    format!(
        r#"<path d="{d}{end}" fill="{fill}" fill-opacity="0.7" stroke="{edge}" stroke-width="1.2" stroke-linejoin="round"><title>{name}</title></path>"#
    )
}

fn trail(frame: &Frame, path: &TracedPath) -> String {
    let mut points: Vec<[f64; 2]> = path
        .vertices
        .iter()
        .map(|vertex| [vertex.point_mm[0], vertex.point_mm[2]])
        .collect();
    let last = points[points.len() - 1];
    if let Some([dx, _, dz]) = path.leaves_along {
        points.push(frame.exit(last, [dx, dz]));
    }
    let mut d = String::new();
    for (k, [x, z]) in points.iter().enumerate() {
        let _ = write!(
            d,
            "{}{}",
            if k == 0 { "M " } else { " L " },
            frame.point(*x, *z)
        );
    }
    let colour = colour(path.fate);
    let mut text = format!(
        r#"<path d="{d}" fill="none" stroke="{colour}" stroke-width="0.9" stroke-opacity="0.75"/>"#
    );
    if path.leaves_along.is_none() {
        let at = frame.point(last[0], last[1]);
        let (u, v) = at.split_once(' ').unwrap_or(("0", "0"));
        let _ = write!(
            text,
            r#"<circle cx="{u}" cy="{v}" r="2.6" fill="{colour}"/>"#
        );
    }
    text
}

/// The outline of the dome: the right half from the axis down, the left half back.
fn outline(frame: &Frame, meridian: &Meridian) -> String {
    let first = meridian.pieces[0].start;
    let mut d = format!("M {}", frame.point(first[0], first[1]));
    for piece in &meridian.pieces {
        let [r, z] = piece.end;
        d += &stretch(frame, piece, [r, z]);
    }
    let mut mirrored = Vec::new();
    for piece in meridian.pieces.iter().rev() {
        // Mirrored and backwards: an arc keeps its sense.
        mirrored.push(stretch(frame, piece, [-piece.start[0], piece.start[1]]));
    }
    let [r, z] = meridian.pieces[meridian.pieces.len() - 1].end;
    let _ = write!(d, " L {}", frame.point(-r, z));
    d + &mirrored.concat() + " Z"
}

/// The outline of a mesh in the plane y = 0.
fn cut(frame: &Frame, mesh: &DomeMesh) -> String {
    let mut d = String::new();
    for loop_of_points in mesh.section() {
        for (k, [x, z]) in loop_of_points.into_iter().enumerate() {
            let _ = write!(
                d,
                "{} {} ",
                if k == 0 { "M" } else { "L" },
                frame.point(x, z)
            );
        }
        d += "Z ";
    }
    d.trim_end().to_owned()
}

/// On to a point along a line or an arc.
fn stretch(frame: &Frame, piece: &Piece, [x, z]: [f64; 2]) -> String {
    match piece.curve {
        Curve::Line => format!(" L {}", frame.point(x, z)),
        Curve::Arc { radius_mm, .. } | Curve::Bend { radius_mm, .. } => {
            let radius = radius_mm * frame.scale();
            let large = u8::from(piece.sweep() > std::f64::consts::PI);
            let sweep = u8::from(piece.clockwise());
            format!(
                " A {radius:.3} {radius:.3} 0 {large} {sweep} {}",
                frame.point(x, z)
            )
        }
    }
}

/// The mirror, and the floor beyond it.
fn ground(frame: &Frame, design: &Design, radius: f64, line: &mut impl FnMut(String)) {
    let mirror = match design.mirror.extent {
        Extent::Array => (0.5 * design.array.pitch_mm).min(frame.half),
        Extent::Package => radius,
    };
    for (half, colour, width) in [(frame.half, "#333333", 2.0), (mirror, "#8a97a3", 5.0)] {
        line(format!(
            r#"<path d="M {} L {}" stroke="{colour}" stroke-width="{width}" fill="none"/>"#,
            frame.point(-half, -0.01 * radius),
            frame.point(half, -0.01 * radius)
        ));
    }
}

/// Colours and counts, in rows of four below the title.
fn legend(paths: &[TracedPath], line: &mut impl FnMut(String)) {
    let shown = PathEnd::ALL.into_iter().filter_map(|end| {
        let count = paths.iter().filter(|path| path.fate == end).count();
        (count > 0).then_some((end, count))
    });
    for (k, (end, count)) in shown.enumerate() {
        let (u, v) = (16.0 + 296.0 * (k % 4) as f64, 54.0 + 22.0 * (k / 4) as f64);
        line(format!(
            r##"<path d="M {u:.0} {:.0} h 26" stroke="{}" stroke-width="4"/><text x="{:.0}" y="{v:.0}" font-size="14" fill="#222222">{} ({count})</text>"##,
            v - 5.0,
            colour(end),
            u + 32.0,
            end.words()
        ));
    }
}

/// Text that XML takes as it is.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
