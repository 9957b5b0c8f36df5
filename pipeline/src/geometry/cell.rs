// SPDX-License-Identifier: MIT OR Apache-2.0
//! One period of the relief in the frame of its chord, as plain points and indices.
//!
//! x runs along t (meridional tangent, outward and down), z along the outward normal from the chord
//! (0, silicone side) to the apex (`depth`, outer side). Outside the polygons is air, or what else
//! lies around the dome; below z = 0 is silicone and beyond `depth` is the same as between the
//! polygons. The outline wraps at the period and a later polygon lies over an earlier one.
//! Micrometres.

use serde::Serialize;

use super::Chord;

/// A polygon of one material.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellPolygon {
    /// Refractive index.
    pub index: f64,
    /// Corners (x, z), µm.
    pub points_um: Vec<[f64; 2]>,
}

/// One period of a ring's relief.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Ring it belongs to, from 1.
    pub ring: usize,
    /// Length of the chord, µm.
    pub period_um: f64,
    /// Height of the apex above the chord, µm.
    pub depth_um: f64,
    /// Inclination of the chord, degrees.
    pub slope_deg: f64,
    /// Index between the polygons and beyond them, of what lies around the dome.
    pub background_index: f64,
    /// Index below the chord.
    pub inner_index: f64,
    /// The relief itself.
    pub polygons: Vec<CellPolygon>,
}

impl Cell {
    /// The cell whose outline has `vertices` (along, above the chord, mm) between the base corners.
    /// `None` if nothing stands on the chord.
    pub(super) fn standing_on(
        chord: &Chord,
        vertices: &[[f64; 2]],
        index: f64,
        ring: usize,
    ) -> Option<Self> {
        let depth_um = 1e3 * vertices.iter().map(|v| v[1]).fold(0.0, f64::max);
        if depth_um <= 0.0 {
            return None;
        }
        let period_um = 1e3 * chord.length_mm();
        let mut points_um = vec![[0.0, 0.0]];
        points_um.extend(vertices.iter().map(|v| [1e3 * v[0], 1e3 * v[1]]));
        points_um.push([period_um, 0.0]);
        Some(Self {
            ring,
            period_um,
            depth_um,
            slope_deg: chord.slope().to_degrees(),
            background_index: 1.0,
            inner_index: index,
            polygons: vec![CellPolygon { index, points_um }],
        })
    }

    /// The same in a medium of this index, in place of air.
    #[must_use]
    pub fn within(self, background_index: f64) -> Self {
        Self {
            background_index,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::geometry::profile::Reference;
    use crate::geometry::profile::{Elements, Shape};
    use crate::geometry::{DOME, ring_cell};

    fn rings(shape: Shape) -> Elements {
        Elements {
            width_mm: 0.01,
            shapes: vec![shape; 170],
        }
    }

    fn near(got: f64, expected: f64, tolerance: f64) {
        assert!(
            (got - expected).abs() < tolerance,
            "got {got}, expected {expected}"
        );
    }

    #[test]
    fn steps_of_10_um_have_the_periods_and_heights_of_the_specification() {
        for (ring, period, height) in [(75, 10.78, 3.73), (165, 17.58, 8.23)] {
            let cell = ring_cell(&DOME, &rings(Shape::Os1), ring, 1.41).expect("a step");
            near(cell.period_um, period, 5e-3);
            near(cell.depth_um, height, 5e-3);
            // Right angle at the apex: apex at 10 cos(slope) along the chord.
            near(
                cell.polygons[0].points_um[1][0],
                10.0 * cell.slope_deg.to_radians().cos(),
                1e-9,
            );
        }
    }

    #[test]
    fn triangle_has_its_angles() {
        let shape = Shape::Triangle {
            inner_base_deg: 50.0,
            apex_deg: 60.0,
            reference: Reference::Chord,
        };
        let cell = ring_cell(&DOME, &rings(shape), 40, 1.41).expect("a triangle");
        let [a, apex, b] = cell.polygons[0].points_um[..] else {
            panic!("three corners")
        };
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
            let [a, apex, b] = cell.polygons[0].points_um[..] else {
                panic!("three corners")
            };
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
