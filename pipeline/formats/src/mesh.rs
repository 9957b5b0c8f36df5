// SPDX-License-Identifier: MIT OR Apache-2.0
//! Closed triangle meshes of a design's bodies, to a stated chord error.
//!
//! In: a [`Meridian`] and the largest distance that a triangle may lie from the true surface. Out:
//! one watertight [`Mesh`], its triangles counter-clockwise as seen from outside. Half of the error
//! is allowed to the arcs of the meridian, half to the turn about the axis: a chord over the angle
//! 2a of a circle of radius r lies r (1 - cos a) inside of it. All rings have the same number of
//! vertices, so that no edge is split on one side only.

use std::collections::HashMap;

use anyhow::{Result, ensure};
use glam::DVec3;

use geometry::{Curve, Meridian};

/// Maximum number of triangles of a mesh.
const MOST: f64 = 2e7;

/// A triangle mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Name of the body.
    pub name: String,
    /// Vertices, mm.
    pub vertices: Vec<[f64; 3]>,
    /// Vertices of each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Volume, mm³: positive if triangles face outwards.
    pub fn volume(&self) -> f64 {
        let corner = |k: u32| glam::DVec3::from_array(self.vertices[k as usize]);
        self.triangles
            .iter()
            .map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))) / 6.0)
            .sum()
    }
}

/// Largest distance of corners that are joined, as a share of the size of the body: rounding.
pub const JOINED: f64 = 1e-9;

/// The triangles with corners that lie within [`JOINED`] of another at its place, and how many were
/// moved. Triangles that vanish are left out.
pub fn joined(triangles: Vec<[DVec3; 3]>) -> (Vec<[DVec3; 3]>, usize) {
    let corners = || triangles.iter().flatten();
    let [low, high] = corners()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], c| [low.min(*c), high.max(*c)]);
    let reach = JOINED * (high - low).max_element();
    if !(reach > 0.0 && reach.is_finite()) {
        return (triangles, 0);
    }
    let mut known: HashMap<[i64; 3], Vec<DVec3>> = HashMap::new();
    let mut moved = 0;
    let mut place = |corner: DVec3| {
        // Cells of this width: what is near lies in a cell or beside it.
        let cell = ((corner - low) / reach).floor().to_array().map(|v| v as i64);
        let beside = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
        let near =
            beside.filter_map(|[x, y, z]| known.get(&[cell[0] + x, cell[1] + y, cell[2] + z]));
        let found = near.flatten().copied().find(|other| other.distance(corner) <= reach);
        if let Some(other) = found {
            moved += usize::from(other != corner);
            return other;
        }
        known.entry(cell).or_default().push(corner);
        corner
    };
    let vanished = |[a, b, c]: &[DVec3; 3]| a == b || b == c || c == a;
    let kept = triangles.iter().filter_map(|stated| {
        let placed = stated.map(&mut place);
        (vanished(stated) || !vanished(&placed)).then_some(placed)
    });
    let kept = kept.collect();
    (kept, moved)
}

/// Half angle of the chord that stays within `error` of a circle of radius `radius`.
fn half_angle(radius: f64, error: f64) -> f64 {
    (1.0 - (error / radius).min(1.0)).acos()
}

/// Points (r, z) of the meridian from the axis outwards and down, arcs within `error` mm.
fn points(meridian: &Meridian, error: f64) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for piece in &meridian.pieces {
        if points.is_empty() {
            points.push(piece.start);
        }
        match piece.curve {
            Curve::Line => points.push(piece.end),
            Curve::Arc { radius_mm, centre_mm } => {
                let angle = |p: [f64; 2]| p[0].atan2(p[1] - centre_mm);
                let (from, to) = (angle(piece.start), angle(piece.end));
                let count = ((to - from).abs() / (2.0 * half_angle(radius_mm, error))).ceil();
                for k in 1..count as usize {
                    let (sin, cos) = (from + (to - from) * k as f64 / count).sin_cos();
                    points.push([radius_mm * sin, centre_mm + radius_mm * cos]);
                }
                points.push(piece.end);
            }
            Curve::Bend { radius_mm, .. } => {
                let count = (piece.sweep() / (2.0 * half_angle(radius_mm, error))).ceil();
                points.extend(piece.points((count as usize).max(1)));
            }
        }
    }
    // Pieces without length would make triangles without area.
    points.dedup_by(|a, b| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9);
    points
}

/// The body that `meridian` encloses with the plane z = 0, within `error_mm` of the true surface.
///
/// # Errors
/// If the error is not positive, or so small that the mesh would have more than 2e7 triangles.
pub fn revolved(name: &str, meridian: &Meridian, error_mm: f64) -> Result<Mesh> {
    ensure!(error_mm.is_finite() && error_mm > 0.0, "expected a length above 0 mm, got {error_mm}");
    let mut points = points(meridian, 0.5 * error_mm);
    let largest = points.iter().map(|p| p[0]).fold(0.0, f64::max);
    let columns = (std::f64::consts::PI / half_angle(largest, 0.5 * error_mm)).ceil().max(8.0);
    let triangles = 2.0 * columns * points.len() as f64;
    ensure!(
        triangles < MOST,
        "expected one that {MOST:.0e} triangles reach, got {error_mm:.1e} mm, which takes {triangles:.1e}"
    );
    let columns = columns as u32;
    // The bottom closes the body.
    if points.last().is_some_and(|p| p[0] > 1e-9) {
        points.push([0.0, 0.0]);
    }
    let mut mesh = Mesh { name: name.to_owned(), vertices: Vec::new(), triangles: Vec::new() };
    // First vertex of each ring, and whether it is a point on the axis.
    let mut rings = Vec::new();
    for [r, z] in &points {
        let on_axis = *r < 1e-12;
        rings.push((mesh.vertices.len() as u32, on_axis));
        if on_axis {
            mesh.vertices.push([0.0, 0.0, *z]);
            continue;
        }
        for k in 0..columns {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(columns)).sin_cos();
            mesh.vertices.push([r * cos, r * sin, *z]);
        }
    }
    for pair in rings.windows(2) {
        let [(upper, upper_point), (lower, lower_point)] = [pair[0], pair[1]];
        for k in 0..columns {
            let next = (k + 1) % columns;
            if !lower_point {
                let apex = if upper_point { upper } else { upper + k };
                mesh.triangles.push([apex, lower + k, lower + next]);
            }
            if !upper_point {
                let foot = if lower_point { lower } else { lower + next };
                mesh.triangles.push([upper + k, foot, upper + next]);
            }
        }
    }
    Ok(mesh)
}

/// Corners of each face of a box, counter-clockwise from outside; the bits of their numbers say low
/// or high along x, y and z.
pub const BOX_FACES: [[usize; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

/// A box of these corners, the bits of their numbers low or high along its x, y and z.
pub fn cuboid(name: &str, corners: [[f64; 3]; 8]) -> Mesh {
    let vertices = corners.to_vec();
    let triangles = BOX_FACES
        .iter()
        .map(|face| face.map(|corner| corner as u32))
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    Mesh { name: name.to_owned(), vertices, triangles }
}
