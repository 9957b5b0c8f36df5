// SPDX-License-Identifier: MIT OR Apache-2.0
//! One period of the relief in the frame of its chord, as plain points and indices.
//!
//! x runs along t (meridional tangent, outward and down), z along the outward normal from the chord
//! (0, silicone side; with rounded valleys from their lowest point) to the apex (`depth`, outer
//! side). Rounded corners are polygons of at least 8 chords each, within 5 nm of their arcs. Outside
//! the relief is air, or what else lies around the dome; below z = 0 is silicone. The outline wraps at
//! the period. Micrometres.

use super::profile::Rounding;
use super::rounding::rounded;
use super::{Chord, Curve, GeometryError, Piece, Role};

/// One period of a ring's relief.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Ring it belongs to, from 1.
    pub ring: usize,
    /// Length of the chord, µm.
    pub period_um: f64,
    /// Height of the apex above the chord, µm.
    pub depth_um: f64,
    /// Inclination of the chord, degrees.
    pub slope_deg: f64,
    /// Index beyond the relief, of what lies around the dome.
    pub background_index: f64,
    /// Index of the relief and below the chord.
    pub inner_index: f64,
    /// Corners (x, z) of the relief, µm.
    pub points_um: Vec<[f64; 2]>,
}

/// The role of the period that is cut out.
const OWN: Role = Role::Element(1);
/// Fewest chords of a rounded corner.
const CHORDS: f64 = 8.0;
/// Largest distance of an arc from its chords, µm: below a fiftieth of a wavelength of 0.4 µm in a
/// medium of index 1.6.
const SAGITTA_UM: f64 = 0.005;

/// One period of the outline with these corners (µm), rounded as one of many that repeat, from its
/// lowest point to the next one, both at z = 0.
fn rounded_period(
    corners: &[[f64; 2]],
    rounding: Rounding,
    ring: usize,
) -> Result<Vec<[f64; 2]>, GeometryError> {
    let in_um = |rounding: Rounding| Rounding {
        tip_mm: 1e3 * rounding.tip_mm,
        valley_mm: 1e3 * rounding.valley_mm,
    };
    let period = corners[corners.len() - 1][0];
    let side = |ends: &[[f64; 2]], shift: f64, role: Role| {
        let [start, end] = [0, 1].map(|k| [ends[k][0] + shift, ends[k][1]]);
        Piece::line(start, end, role)
    };
    // The last side of the period before, and the first of the one after.
    let mut sides = vec![side(&corners[corners.len() - 2..], -period, Role::Element(0))];
    sides.extend(corners.windows(2).map(|ends| side(ends, 0.0, OWN)));
    sides.push(side(&corners[..2], period, Role::Element(2)));
    let all = |other: Rounding| rounded(&sides, |_| true, in_um(other));
    let pieces =
        all(rounding).map_err(|misfit| misfit.at(ring, rounding, |other| all(other).is_ok()))?;
    // Halves of the arcs between periods at both ends.
    let own: Vec<&Piece> = pieces.iter().filter(|piece| piece.role == OWN).collect();
    let mut points = vec![own[0].start];
    for (k, piece) in own.iter().enumerate() {
        let least = if k == 0 || k + 1 == own.len() { 0.5 * CHORDS } else { CHORDS };
        points.extend(piece.points(chords(piece, least)));
    }
    // Rounding must not open the period.
    let last = points.len() - 1;
    points[last] = [points[0][0] + period, points[0][1]];
    let by_height = |a: &usize, b: &usize| points[*a][1].total_cmp(&points[*b][1]);
    let lowest = (0..last).min_by(by_height).unwrap_or(0);
    let [_, level] = points[lowest];
    let later = points[..=lowest].iter().map(|[x, z]| [x + period, *z]);
    let around: Vec<[f64; 2]> = points[lowest..last].iter().copied().chain(later).collect();
    Ok(around.into_iter().map(|[x, z]| [x, z - level]).collect())
}

/// Chords of an arc; 1 of a line.
fn chords(piece: &Piece, least: f64) -> usize {
    let Curve::Bend { radius_mm: radius_um, .. } = piece.curve else {
        return 1;
    };
    let half = (1.0 - (SAGITTA_UM / radius_um).min(1.0)).acos();
    (piece.sweep() / (2.0 * half)).ceil().max(least) as usize
}

impl Cell {
    /// The cell of a ring (from 1) of this index whose outline has `vertices` (along, above the
    /// chord, mm) between the base corners, rounded. `None` if nothing stands on the chord.
    ///
    /// # Errors
    /// Radii that do not fit.
    pub(super) fn standing_on(
        chord: &Chord,
        vertices: &[[f64; 2]],
        rounding: Rounding,
        (ring, index): (usize, f64),
    ) -> Result<Option<Self>, GeometryError> {
        if vertices.iter().all(|v| v[1] <= 0.0) {
            return Ok(None);
        }
        let period_um = 1e3 * chord.length_mm();
        let mut points_um = vec![[0.0, 0.0]];
        points_um.extend(vertices.iter().map(|v| [1e3 * v[0], 1e3 * v[1]]));
        points_um.push([period_um, 0.0]);
        if !rounding.is_sharp() {
            points_um = rounded_period(&points_um, rounding, ring)?;
        }
        Ok(Some(Self {
            ring,
            period_um,
            depth_um: points_um.iter().map(|p| p[1]).fold(0.0, f64::max),
            slope_deg: chord.slope().to_degrees(),
            background_index: 1.0,
            inner_index: index,
            points_um,
        }))
    }

    /// The same in a medium of this index, in place of air.
    #[must_use]
    pub fn within(self, background_index: f64) -> Self {
        Self { background_index, ..self }
    }
}

#[cfg(test)]
mod tests {
    use crate::profile::{Elements, Reference, Rounding, Shape};
    use crate::{Cell, DOME, SphericalDome};

    fn ring_cell(dome: &SphericalDome, rings: &Elements, ring: usize, index: f64) -> Option<Cell> {
        crate::ring_cell(dome, rings, ring, index).expect("radii that fit")
    }

    fn rings(shape: Shape) -> Elements {
        Elements { width_mm: 0.01, shapes: vec![shape; 170], rounding: Rounding::default() }
    }

    fn near(got: f64, expected: f64, tolerance: f64) {
        assert!((got - expected).abs() < tolerance, "got {got}, expected {expected}");
    }

    #[test]
    fn steps_of_10_um_have_the_periods_and_heights_of_the_specification() {
        for (ring, period, height) in [(75, 10.78, 3.73), (165, 17.58, 8.23)] {
            let cell = ring_cell(&DOME, &rings(Shape::Os1), ring, 1.41).expect("a step");
            near(cell.period_um, period, 5e-3);
            near(cell.depth_um, height, 5e-3);
            // Right angle at the apex: apex at 10 cos(slope) along the chord.
            near(cell.points_um[1][0], 10.0 * cell.slope_deg.to_radians().cos(), 1e-9);
        }
    }

    #[test]
    fn triangle_has_its_angles() {
        let shape =
            Shape::Triangle { inner_base_deg: 50.0, apex_deg: 60.0, reference: Reference::Chord };
        let cell = ring_cell(&DOME, &rings(shape), 40, 1.41).expect("a triangle");
        let [a, apex, b] = cell.points_um[..] else { panic!("three corners") };
        let angle = |at: [f64; 2], p: [f64; 2], q: [f64; 2]| {
            let (u, v) = ([p[0] - at[0], p[1] - at[1]], [q[0] - at[0], q[1] - at[1]]);
            ((u[0] * v[0] + u[1] * v[1]) / (u[0].hypot(u[1]) * v[0].hypot(v[1])))
                .acos()
                .to_degrees()
        };
        near(angle(a, apex, b), 50.0, 1e-9);
        near(angle(apex, a, b), 60.0, 1e-9);
        near(angle(b, a, apex), 70.0, 1e-9);
    }

    #[test]
    fn angles_from_the_horizontal_are_those_of_the_sides_in_space() {
        let shape = Shape::Triangle {
            inner_base_deg: 50.0,
            apex_deg: 70.0,
            reference: Reference::Horizontal,
        };
        for ring in [3, 40, 90] {
            let cell = ring_cell(&DOME, &rings(shape.clone()), ring, 1.41).expect("a triangle");
            let [a, apex, b] = cell.points_um[..] else { panic!("three corners") };
            // Inclination against the chord, less what the chord falls by.
            let rise = |p: [f64; 2], q: [f64; 2]| {
                (q[1] - p[1]).atan2(q[0] - p[0]).to_degrees() - cell.slope_deg
            };
            near(rise(a, apex), 50.0, 1e-9);
            near(rise(apex, b), -60.0, 1e-9);
        }
    }

    #[test]
    fn smooth_ring_has_no_cell() {
        assert_eq!(ring_cell(&DOME, &rings(Shape::Smooth), 12, 1.41), None);
    }
}
