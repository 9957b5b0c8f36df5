// SPDX-License-Identifier: MIT OR Apache-2.0
//! The package of a design as plain lines: what `rays` and the page draw.

use tracer::glam::{DMat3, DVec3};

use design::Design;
use design::resolved::array::Pose;
use design::resolved::dome::Dome;
use design::resolved::led::BoxPlace;
use design::resolved::solids::CheckedSolid;
use design::schema::Extent;
use design::schema::solids::Per;
use geometry::{Curve, Meridian, Piece, Role};
use results::package::{PackageDrawing, RingOutline, SolidDrawing};

use super::paths::middle_package;

/// Points of an arc of the outline.
const ARC_POINTS: usize = 24;
/// Rings of equal width that stand for those of a dome without relief.
const PLAIN_RINGS: usize = 12;
/// Name of the walls of the housing, as in the ledger.
const WALL: &str = "wall";

/// The package with this generating curve on its dome.
pub fn package_drawing(design: &Design, meridian: &Meridian) -> PackageDrawing {
    let (number, at) = middle_package(design);
    let axes_mm = design.array.axes_mm();
    let Pose { turn_deg, scale } = design.array.pose(number);
    let radius_mm = scale * 0.5 * design.package_width_mm();
    let dome_mm = match &design.dome {
        Some(Dome::Mesh(mesh)) => mesh.section(turn_deg),
        _ => outline(meridian).into_iter().collect(),
    };
    let [width, depth] = design.led.size_mm;
    PackageDrawing {
        dome_mm: dome_mm.into_iter().map(|line| rounded_line(scaled(line, scale))).collect(),
        dome_index: design.dome.as_ref().map(|_| design.silicone.index),
        rings: rings(&meridian.clone().scaled(scale)),
        radius_mm,
        led_mm: [width, depth, design.led.height_mm].map(|length| scale * length),
        led_corners_mm: led_corners(design, number),
        led_offsets_mm: led_offsets(design),
        turns_deg: if design.array.is_turned() {
            (0..axes_mm.len()).map(|package| design.array.turn_deg(package)).collect()
        } else {
            Vec::new()
        },
        scales: if design.array.scale_range().map(f64::to_bits) == [scale.to_bits(); 2] {
            Vec::new()
        } else {
            (0..axes_mm.len()).map(|package| design.array.scale(package) / scale).collect()
        },
        mirror_half_mm: match design.mirror.extent {
            Extent::Array => 0.5 * design.array.pitch_mm.along()[0],
            Extent::Package => radius_mm,
        },
        plane_mm: design.receiver.plane_height_mm,
        pitch_mm: pitch_mm(&axes_mm, at),
        axes_mm,
        at_mm: at,
        solids: solids(design, number, at),
    }
}

/// Distance of the package at `at` from the nearest beside it in the plane that is drawn, along x.
fn pitch_mm(axes_mm: &[[f64; 2]], at: [f64; 2]) -> Option<f64> {
    let beside = axes_mm.iter().map(|axis| [0, 1].map(|k| (axis[k] - at[k]).abs()));
    let beside = beside.filter(|[x, y]| *x > 0.0 && *y <= 1e-3 * x).map(|[x, _]| x);
    beside.reduce(f64::min).map(rounded)
}

/// Corners of the box of a package, unless it stands level about the axis and is not turned.
fn led_corners(design: &Design, package: usize) -> Vec<[f64; 3]> {
    let (place, Pose { turn_deg, scale }) = (design.led.place(package), design.array.pose(package));
    if place == BoxPlace::default() && turn_deg == 0.0 {
        return Vec::new();
    }
    let rotation = DMat3::from_rotation_z(turn_deg.to_radians());
    let corners = design.led.at(place).corners(0.0).into_iter();
    corners.map(|corner| (scale * (rotation * corner)).to_array().map(rounded)).collect()
}

/// Solids, sheets and walls about this package, whose axis lies at `at`.
fn solids(design: &Design, package: usize, [x, y]: [f64; 2]) -> Vec<SolidDrawing> {
    let moved = |stated: &CheckedSolid| {
        let mut stated = stated.clone();
        let Pose { turn_deg, scale } = design.array.pose(package);
        match stated.per() {
            Per::Array => {
                stated.form.placement.origin -= DVec3::new(x, y, 0.0);
                solid(&stated, 1.0)
            }
            Per::Package => {
                stated.form = stated.form.turned(turn_deg);
                solid(&stated, scale)
            }
        }
    };
    let mut all: Vec<SolidDrawing> = design.solids.iter().map(moved).collect();
    let (Some(housing), Some(half)) = (&design.housing, design.housing_half_mm()) else {
        return all;
    };
    if design.is_periodic() {
        return all;
    }
    let outer = half.map(|half| half + housing.thickness_mm);
    for k in [0, 1] {
        for side in [-1.0, 1.0] {
            let ends = |k: usize| [side * half[k], side * outer[k]];
            let mut low = [-outer[0], -outer[1], 0.0];
            let mut high = [outer[0], outer[1], housing.height_mm];
            let [a, b] = ends(k);
            (low[k], high[k]) = (a.min(b), a.max(b));
            all.push(wall([low, high].map(|[a, b, c]| [a - x, b - y, c].map(rounded))));
        }
    }
    all
}

/// A wall of the housing between two corners.
fn wall(bounds_mm: [[f64; 3]; 2]) -> SolidDrawing {
    let [[left, front, low], [right, back, high]] = bounds_mm;
    let around = vec![[left, low], [right, low], [right, high], [left, high]];
    SolidDrawing {
        name: WALL.to_owned(),
        index: None,
        entered: false,
        each: false,
        bounds_mm,
        // Those across the view would hide what stands between them.
        lines_mm: (front <= 0.0 && back >= 0.0 && right - left < back - front)
            .then_some((around, true))
            .into_iter()
            .collect(),
    }
}

/// Offsets of the boxes of all packages; none where all stand on the axes.
fn led_offsets(design: &Design) -> Vec<[f64; 2]> {
    let packages = 0..design.array.count();
    if packages.clone().all(|package| design.led.place(package).is_on_axis()) {
        return Vec::new();
    }
    packages.map(|package| design.led_offset_mm(package)).collect()
}

/// A solid with all its lengths times `scale`.
fn solid(solid: &CheckedSolid, scale: f64) -> SolidDrawing {
    let bounds = solid.form.shape(0.0).map(|shape| shape.bounds());
    let bounds_mm = bounds.map_or([[0.0; 3]; 2], |bounds| {
        [bounds.low, bounds.high].map(|corner| (scale * corner).to_array().map(rounded))
    });
    let lines = solid.form.section().into_iter();
    SolidDrawing {
        name: solid.name().to_owned(),
        index: solid.medium.as_ref().map(|medium| medium.index),
        entered: solid.medium.is_some() || solid.stated.shared.scatter.is_some(),
        each: solid.per() == Per::Package,
        bounds_mm,
        lines_mm: lines.map(|(line, closed)| (rounded_line(scaled(line, scale)), closed)).collect(),
    }
}

/// Rings of the generating curve: one for each element or band; those of a smooth dome have equal
/// widths.
fn rings(meridian: &Meridian) -> Vec<RingOutline> {
    let mut rings: Vec<RingOutline> = Vec::new();
    let radius_mm = meridian.radius_mm();
    for piece in &meridian.pieces {
        let points = points(piece);
        for pair in points.windows(2) {
            let middle = f64::midpoint(pair[0][0], pair[1][0]);
            let name = ring_name(piece.role, middle, radius_mm);
            match rings.last_mut() {
                Some(last) if last.name == name => last.points_mm.push(pair[1]),
                _ => rings.push(RingOutline { name, points_mm: pair.to_vec() }),
            }
        }
    }
    rings
}

fn ring_name(role: Role, r_mm: f64, radius_mm: f64) -> String {
    match role {
        Role::Element(number) => format!("ring {number}"),
        Role::Cylinder => "side".to_owned(),
        Role::Rest | Role::Stated => {
            let width = radius_mm / PLAIN_RINGS as f64;
            let number = (r_mm / width).floor().min(PLAIN_RINGS as f64 - 1.0);
            format!("r {:.2} to {:.2} mm", number * width, (number + 1.0) * width)
        }
    }
}

/// Points of a piece from its start to its end; straight pieces that are long have some between.
fn points(piece: &Piece) -> Vec<[f64; 2]> {
    let mut points = vec![piece.start];
    if piece.curve == Curve::Line {
        let share = |k: usize| k as f64 / PLAIN_RINGS as f64;
        let between =
            |k| [0, 1].map(|i| piece.start[i] + share(k) * (piece.end[i] - piece.start[i]));
        if matches!(piece.role, Role::Rest | Role::Stated) {
            points.extend((1..PLAIN_RINGS).map(between));
        }
        points.push(piece.end);
    } else {
        points.extend(piece.points(ARC_POINTS));
    }
    rounded_line(points)
}

/// The outline of the dome: the right half from the axis down, the left half back.
fn outline(meridian: &Meridian) -> Option<Vec<[f64; 2]>> {
    let mut right = vec![meridian.pieces.first()?.start];
    for piece in &meridian.pieces {
        right.extend(piece.points(2 * ARC_POINTS));
    }
    let left: Vec<[f64; 2]> = right.iter().rev().map(|[r, z]| [-r, *z]).collect();
    Some([right, left].concat())
}

fn scaled(line: Vec<[f64; 2]>, scale: f64) -> Vec<[f64; 2]> {
    line.into_iter().map(|point| point.map(|along| scale * along)).collect()
}

fn rounded_line(line: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    line.into_iter().map(|point| point.map(rounded)).collect()
}

/// To a tenth of a micrometre.
pub(super) fn rounded(length_mm: f64) -> f64 {
    (length_mm * 1e4).round() / 1e4 + 0.0
}
