// SPDX-License-Identifier: MIT OR Apache-2.0
//! Generating curves of domes with relief: the elements themselves, or the smooth surface in bands.

use super::planar::{distance, meetings};
use super::profile::{Elements, Shape};
use super::{BaseSurface, Chord, Curve, GeometryError, Meridian, Piece, Role, rounding, vertices};

impl Meridian {
    /// The real relief on `base`: every element's outline, its corners rounded, and what lies
    /// beyond the last one. Refuses outlines that cross each other or leave the half-plane r ≥ 0,
    /// z ≥ 0, and radii that do not fit.
    pub fn stepped<'a>(
        base: impl Into<BaseSurface<'a>>,
        elements: &Elements,
    ) -> Result<Self, GeometryError> {
        let base = base.into();
        let mut pieces = Vec::new();
        for element in 1..=elements.shapes.len() {
            let chord = Chord::of(base, elements.width_mm, element);
            let shape = &elements.shapes[element - 1];
            let role = Role::Element(element);
            if *shape == Shape::Smooth {
                let ends = [chord.inner[0], chord.outer[0]];
                pieces.extend(base.between(ends, role));
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
                // A step on level ground has no riser.
                if distance(corner, start) > 0.0 {
                    pieces.push(Piece::line(start, corner, role));
                }
                start = corner;
            }
        }
        let covered = elements.width_mm * elements.shapes.len() as f64;
        base.close(covered.min(base.reach_mm()), &mut pieces);
        let meridian = Self { pieces };
        meridian.check_crossings(elements.shapes.len())?;
        meridian.rounded(elements)
    }

    /// The same with the corners of its relief rounded.
    fn rounded(self, elements: &Elements) -> Result<Self, GeometryError> {
        let rounding = elements.rounding;
        if rounding.is_sharp() {
            return Ok(self);
        }
        let sides = &self.pieces;
        let is_relief = |k: usize| match sides[k].role {
            Role::Element(number) => elements.shapes[number - 1] != Shape::Smooth,
            Role::Rest | Role::Cylinder | Role::Stated => false,
        };
        match rounding::rounded(sides, is_relief, rounding) {
            Ok(pieces) => {
                let meridian = Self { pieces };
                meridian.check_crossings(elements.shapes.len())?;
                Ok(meridian)
            }
            Err(misfit) => {
                let fits = |other| rounding::rounded(sides, is_relief, other).is_ok();
                let beyond = elements.shapes.len();
                let element = match sides[misfit.piece].role {
                    Role::Element(number) => number,
                    Role::Rest | Role::Cylinder | Role::Stated => beyond,
                };
                Err(misfit.at(element, rounding, fits))
            }
        }
    }

    /// The smooth surface divided at the given radii (ascending, mm): band k ends at the k-th.
    pub fn banded<'a>(base: impl Into<BaseSurface<'a>>, band_ends_mm: &[f64]) -> Self {
        let base = base.into();
        let mut pieces = Vec::new();
        let mut r0 = 0.0;
        for (band, &end) in band_ends_mm.iter().enumerate() {
            let r1 = end.min(base.reach_mm());
            pieces.extend(base.between([r0, r1], Role::Element(band + 1)));
            r0 = r1;
        }
        base.close(r0, &mut pieces);
        Self { pieces }
    }

    fn outline(shape: &Shape, chord: &Chord) -> Vec<[f64; 2]> {
        let mut corners: Vec<[f64; 2]> = if *shape == Shape::Os1 {
            // Written with the corners' own coordinates, so that treads are level to the last bit.
            vec![[chord.outer[0], chord.inner[1]]]
        } else {
            vertices(shape, chord).into_iter().map(|v| chord.point(v[0], v[1])).collect()
        };
        corners.push(chord.outer);
        corners
    }

    fn check_crossings(&self, elements: usize) -> Result<(), GeometryError> {
        let number = |role: Role| match role {
            Role::Element(k) => k,
            Role::Rest | Role::Cylinder | Role::Stated => elements + 1,
        };
        // By their least radii: those that may meet stand near each other.
        let reaches = self.pieces.iter().map(|piece| {
            let [low, high] = piece.extent();
            [low[0], high[0].max(0.0)]
        });
        let mut sorted: Vec<([f64; 2], usize)> = reaches.zip(0..).collect();
        sorted.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        let mut first: Option<[usize; 2]> = None;
        for (at, &([_, high], i)) in sorted.iter().enumerate() {
            let near = sorted[at + 1..].iter().take_while(|([low, _], _)| *low <= high);
            for &(_, j) in near {
                let pair = [i.min(j), i.max(j)];
                let apart = pair[1] - pair[0] > 1 && first.is_none_or(|first| pair < first);
                if apart && cross(&self.pieces[pair[0]], &self.pieces[pair[1]]) {
                    first = Some(pair);
                }
            }
        }
        match first.map(|pair| pair.map(|k| number(self.pieces[k].role))) {
            None => Ok(()),
            Some([first, second]) => Err(GeometryError::Crossing { first, second }),
        }
    }
}

/// Whether two pieces cross. Arcs of a sphere are taken by their chords, which bend away by far
/// less than an element.
fn cross(a: &Piece, b: &Piece) -> bool {
    if [a, b].iter().any(|piece| matches!(piece.curve, Curve::Bend { .. })) {
        return !meetings(a, b, 0.0).is_empty();
    }
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
    use crate::DOME;
    use crate::profile::{Reference, Rounding};

    fn elements(width_mm: f64, count: usize, shape: Shape) -> Elements {
        Elements { width_mm, shapes: vec![shape; count], rounding: Rounding::default() }
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
        assert!(matches!(Meridian::stepped(&DOME, &e), Err(GeometryError::Crossing { .. })));
        // Crossing itself.
        e.shapes[8] = Shape::Polyline(vec![[0.8, 0.5], [0.2, 0.5], [0.9, 0.1], [0.1, 0.1]]);
        assert!(matches!(Meridian::stepped(&DOME, &e), Err(GeometryError::Crossing { .. })));
    }

    #[test]
    fn first_element_must_not_lean_across_the_axis() {
        let mut e = elements(0.1, 17, Shape::Os1);
        e.shapes[0] =
            Shape::Triangle { inner_base_deg: 125.0, apex_deg: 45.0, reference: Reference::Chord };
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
