// SPDX-License-Identifier: MIT OR Apache-2.0
//! The generating curve of a dome, from the axis outwards and down to the bottom.

use serde::Serialize;

use super::{Chord, GeometryError, vertices};
use crate::geometry::profile::{Elements, Shape, SphericalDome};

/// Form of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Curve {
    /// Straight: turned about the axis an annulus, a cylinder or a cone.
    Line,
    /// Arc of the sphere about (0, `centre_mm`).
    Arc {
        /// Radius, mm.
        radius_mm: f64,
        /// Height of the centre, mm.
        centre_mm: f64,
    },
    /// Any other arc: turned about the axis part of a torus.
    Bend {
        /// Radius, mm.
        radius_mm: f64,
        /// Centre (r, z), mm.
        centre_mm: [f64; 2],
        /// Whether its way is clockwise, r to the right and z up; n then points away from the
        /// centre.
        clockwise: bool,
    },
}

/// What a piece belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Role {
    /// Relief or band number, from 1.
    Element(usize),
    /// The sphere beyond the last element.
    Rest,
    /// The short cylinder at the bottom.
    Cylinder,
    /// A piece of a curve that is stated point by point.
    Stated,
}

/// One piece of the curve; the inside of the dome lies to the right of start → end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Piece {
    /// Start (r, z), mm.
    pub start: [f64; 2],
    /// End (r, z), mm.
    pub end: [f64; 2],
    /// Form between them.
    pub curve: Curve,
    /// What it belongs to.
    pub role: Role,
}

/// A generating curve: pieces joined end to start, from (0, top) to (radius, 0).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Meridian {
    /// The pieces in order.
    pub pieces: Vec<Piece>,
}

impl Meridian {
    /// The real relief: every element's outline, the rest of the sphere, the cylinder.
    /// Refuses outlines that cross each other or leave the half-plane r ≥ 0, z ≥ 0.
    pub fn stepped(dome: &SphericalDome, elements: &Elements) -> Result<Self, GeometryError> {
        let mut pieces = Vec::new();
        for element in 1..=elements.shapes.len() {
            let chord = Chord::of(dome, elements.width_mm, element);
            let shape = &elements.shapes[element - 1];
            let role = Role::Element(element);
            if *shape == Shape::Smooth {
                pieces.push(Self::arc(dome, chord.inner, chord.outer, role));
                continue;
            }
            let mut start = chord.inner;
            for corner in Self::outline(shape, &chord) {
                if corner[0] < 0.0
                    || corner[1] < 0.0
                    || !corner[0].is_finite()
                    || !corner[1].is_finite()
                {
                    return Err(GeometryError::OutOfBounds {
                        element,
                        r_mm: corner[0],
                        z_mm: corner[1],
                    });
                }
                pieces.push(Piece {
                    start,
                    end: corner,
                    curve: Curve::Line,
                    role,
                });
                start = corner;
            }
        }
        Self::finish(dome, elements, &mut pieces);
        let meridian = Self { pieces };
        meridian.check_crossings(elements.shapes.len())?;
        Ok(meridian)
    }

    /// The smooth sphere divided at the given radii (ascending, mm): band k ends at the k-th.
    pub fn banded(dome: &SphericalDome, band_ends_mm: &[f64]) -> Self {
        let mut pieces = Vec::new();
        let mut r0 = 0.0;
        for (band, &end) in band_ends_mm.iter().enumerate() {
            let r1 = end.min(dome.radius_mm);
            pieces.push(Self::arc(
                dome,
                [r0, dome.height_at(r0)],
                [r1, dome.height_at(r1)],
                Role::Element(band + 1),
            ));
            r0 = r1;
        }
        Self::close(dome, r0, &mut pieces);
        Self { pieces }
    }

    /// Where it ends, (r, z), mm; the origin if it has no pieces.
    pub fn end_mm(&self) -> [f64; 2] {
        self.pieces.last().map_or([0.0; 2], |piece| piece.end)
    }

    /// Height of the highest point, mm.
    pub fn top_mm(&self) -> f64 {
        self.pieces
            .iter()
            .flat_map(|p| p.extremes().into_iter().map(|at| at[1]))
            .fold(0.0, f64::max)
    }

    /// Largest radius, mm.
    pub fn radius_mm(&self) -> f64 {
        self.pieces
            .iter()
            .flat_map(|p| p.extremes().into_iter().map(|at| at[0]))
            .fold(0.0, f64::max)
    }

    fn outline(shape: &Shape, chord: &Chord) -> Vec<[f64; 2]> {
        let mut corners: Vec<[f64; 2]> = if *shape == Shape::Os1 {
            // Written with the corners' own coordinates, so that treads are level to the last bit.
            vec![[chord.outer[0], chord.inner[1]]]
        } else {
            vertices(shape, chord)
                .into_iter()
                .map(|v| chord.point(v[0], v[1]))
                .collect()
        };
        corners.push(chord.outer);
        corners
    }

    fn arc(dome: &SphericalDome, start: [f64; 2], end: [f64; 2], role: Role) -> Piece {
        let curve = Curve::Arc {
            radius_mm: dome.sphere_radius_mm,
            centre_mm: dome.centre_mm(),
        };
        Piece {
            start,
            end,
            curve,
            role,
        }
    }

    fn finish(dome: &SphericalDome, elements: &Elements, pieces: &mut Vec<Piece>) {
        let covered = (elements.width_mm * elements.shapes.len() as f64).min(dome.radius_mm);
        Self::close(dome, covered, pieces);
    }

    fn close(dome: &SphericalDome, covered_mm: f64, pieces: &mut Vec<Piece>) {
        let rim = [dome.radius_mm, dome.height_at(dome.radius_mm)];
        if dome.radius_mm - covered_mm > 1e-9 * dome.radius_mm {
            pieces.push(Self::arc(
                dome,
                [covered_mm, dome.height_at(covered_mm)],
                rim,
                Role::Rest,
            ));
        } else if let Some(last) = pieces.last_mut() {
            last.end = rim;
        }
        if rim[1] > 0.0 {
            pieces.push(Piece {
                start: rim,
                end: [rim[0], 0.0],
                curve: Curve::Line,
                role: Role::Cylinder,
            });
        }
    }

    fn check_crossings(&self, elements: usize) -> Result<(), GeometryError> {
        let number = |role: Role| match role {
            Role::Element(k) => k,
            Role::Rest | Role::Cylinder | Role::Stated => elements + 1,
        };
        for (i, a) in self.pieces.iter().enumerate() {
            for b in &self.pieces[(i + 2).min(self.pieces.len())..] {
                if cross(a, b) {
                    return Err(GeometryError::Crossing {
                        first: number(a.role),
                        second: number(b.role),
                    });
                }
            }
        }
        Ok(())
    }
}

/// Whether two pieces cross; arcs are taken by their chords, which bend away by far less than an
/// element.
fn cross(a: &Piece, b: &Piece) -> bool {
    let side = |p: [f64; 2], q: [f64; 2], x: [f64; 2]| {
        (q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0])
    };
    let apart = |p: f64, q: f64| p * q >= 0.0;
    // Proper crossing: the ends of each lie on both sides of the other.
    !apart(side(a.start, a.end, b.start), side(a.start, a.end, b.end))
        && !apart(side(b.start, b.end, a.start), side(b.start, b.end, a.end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DOME;
    use crate::geometry::profile::Reference;

    fn elements(width_mm: f64, count: usize, shape: Shape) -> Elements {
        Elements {
            width_mm,
            shapes: vec![shape; count],
        }
    }

    #[test]
    fn staircase_has_level_treads_and_upright_risers() {
        let m = Meridian::stepped(&DOME, &elements(0.1, 17, Shape::Os1)).expect("valid");
        assert_eq!(m.pieces.len(), 2 * 17 + 1);
        for pair in m.pieces[..34].chunks(2) {
            assert_eq!(pair[0].start[1].to_bits(), pair[0].end[1].to_bits());
            assert_eq!(pair[1].start[0].to_bits(), pair[1].end[0].to_bits());
        }
        // z(0.1) = sqrt(4 - 0.01) - 1.
        assert!((m.pieces[1].end[1] - 0.997_498_435_543_817_8).abs() < 1e-12);
        let last = m.pieces.last().expect("a cylinder");
        assert!(
            (last.start[0] - 1.7).abs() < 1e-12
                && (last.start[1] - 0.053_565_375_285_274).abs() < 1e-12
        );
        assert!((last.end[0] - 1.7).abs() < 1e-12 && last.end[1].abs() < 1e-15);
        assert!((m.top_mm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn pieces_join_end_to_start() {
        for (w, n) in [(0.1, 17), (0.01, 170), (0.1, 9)] {
            let m = Meridian::stepped(
                &DOME,
                &elements(
                    w,
                    n,
                    Shape::Triangle {
                        inner_base_deg: 45.0,
                        apex_deg: 125.0,
                        reference: Reference::Chord,
                    },
                ),
            )
            .expect("valid");
            for pair in m.pieces.windows(2) {
                assert!(
                    (pair[0].end[0] - pair[1].start[0]).abs() < 1e-12
                        && (pair[0].end[1] - pair[1].start[1]).abs() < 1e-12
                );
            }
        }
    }

    #[test]
    fn crossing_outlines_are_refused() {
        // Leaning so far inwards that a spike pierces its neighbour's flank.
        let leaning = Shape::Polyline(vec![[-0.9, 0.2]]);
        let mut e = elements(0.1, 17, Shape::Os1);
        e.shapes[8] = leaning;
        assert!(matches!(
            Meridian::stepped(&DOME, &e),
            Err(GeometryError::Crossing { .. })
        ));
        // Crossing itself.
        e.shapes[8] = Shape::Polyline(vec![[0.8, 0.5], [0.2, 0.5], [0.9, 0.1], [0.1, 0.1]]);
        assert!(matches!(
            Meridian::stepped(&DOME, &e),
            Err(GeometryError::Crossing { .. })
        ));
    }

    #[test]
    fn first_element_must_not_lean_across_the_axis() {
        let mut e = elements(0.1, 17, Shape::Os1);
        e.shapes[0] = Shape::Triangle {
            inner_base_deg: 125.0,
            apex_deg: 45.0,
            reference: Reference::Chord,
        };
        assert!(matches!(
            Meridian::stepped(&DOME, &e),
            Err(GeometryError::OutOfBounds { element: 1, .. })
        ));
    }

    #[test]
    fn bands_cover_the_sphere() {
        let ends: Vec<f64> = (1..=17).map(|k| 0.1 * f64::from(k)).collect();
        let m = Meridian::banded(&DOME, &ends);
        assert_eq!(m.pieces.len(), 18);
        assert!((m.pieces[16].end[1] - m.pieces[17].start[1]).abs() < 1e-15);
        assert!((m.pieces[16].end[0] - 1.7).abs() < 1e-12);
    }
}
