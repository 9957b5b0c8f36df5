// SPDX-License-Identifier: MIT OR Apache-2.0
//! A generating curve that is stated point by point, with arcs between points where wanted.
//!
//! In: rows, each a point [r, z] in mm and how the way from the point before gets there: straight,
//! by the bulge of an arc (the tangent of a quarter of the angle it turns through, above 0 for
//! counterclockwise, as in DXF), or about a centre. Out: pieces, or the row that is wrong. The
//! outside lies to the left of the way, r to the right and z up; no piece may touch another one but
//! at the point where they join.

use super::planar::{centre_of_bulge, distance, meetings, shorter_is_clockwise};
use super::{Curve, Meridian, Piece, Role};

/// Most pieces: every pair of them is compared.
pub const MOST_PIECES: usize = 4000;
/// What counts as one place, as a share of the size of the curve.
const SAME: f64 = 1e-9;
/// Length of the shortest piece, as a share of the size of the curve.
const SHORTEST: f64 = 1e-6;
/// How far from their common end neighbours that join smoothly may seem to meet, as a share of the
/// size of the curve: the root of rounding.
const JOINT: f64 = 1e-7;

/// How a point is reached from the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// Straight.
    Line,
    /// By an arc of this bulge, not 0.
    Bulge(f64),
    /// By the shorter arc about this centre.
    Centre([f64; 2]),
}

/// A point and how it is reached; the way of the first one counts for nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// (r, z), mm.
    pub to: [f64; 2],
    /// From the point before.
    pub way: Way,
}

impl Row {
    /// From two numbers r and z, three with a bulge (0 for straight), or four with the centre of an
    /// arc.
    pub fn of(numbers: &[f64]) -> Option<Self> {
        let (to, way) = match *numbers {
            [r, z] | [r, z, 0.0] => ([r, z], Way::Line),
            [r, z, bulge] => ([r, z], Way::Bulge(bulge)),
            [r, z, centre_r, centre_z] => ([r, z], Way::Centre([centre_r, centre_z])),
            _ => return None,
        };
        numbers.iter().all(|v| v.is_finite()).then_some(Self { to, way })
    }
}

/// Where a curve begins and ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// A dome: from the axis above the bottom to the bottom, z = 0, away from the axis; all above
    /// the bottom.
    OnBottom,
    /// A body by itself: from the axis down to a lower point of the axis.
    OnAxis,
}

/// What is wrong with rows.
#[derive(Debug, Clone, PartialEq)]
pub struct OutlineError {
    /// The row, from 1; 0 where no row is to blame.
    pub row: usize,
    /// What was found.
    pub got: String,
    /// What was expected.
    pub expected: String,
}

impl OutlineError {
    fn new(row: usize, got: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { row, got: got.into(), expected: expected.into() }
    }
}

/// The curve of `rows`, checked.
///
/// # Errors
/// The first row that does not fit.
pub fn outline(rows: &[Row], ends: Ends) -> Result<Meridian, OutlineError> {
    if !(2..=MOST_PIECES + 1).contains(&rows.len()) {
        let got = format!("{} rows", rows.len());
        let expected = format!("2 to {} points", MOST_PIECES + 1);
        return Err(OutlineError::new(rows.len(), got, expected));
    }
    let size = rows.iter().flat_map(|row| row.to).fold(0.0, |size: f64, v| size.max(v.abs()));
    check_ends(rows, ends)?;
    let mut pieces: Vec<Piece> = Vec::new();
    for (k, pair) in rows.windows(2).enumerate() {
        let piece = piece([pair[0].to, pair[1].to], pair[1].way, size, k + 2)?;
        check_place(&piece, k, rows.len() - 1, ends, size)?;
        pieces.push(piece);
    }
    check_meetings(&pieces, size)?;
    if let (Ends::OnBottom, Some(last)) = (ends, pieces.last_mut())
        && last.curve == Curve::Line
        && (last.start[0] - last.end[0]).abs() <= 0.0
    {
        last.role = Role::Cylinder;
    }
    Ok(Meridian { pieces })
}

fn check_ends(rows: &[Row], ends: Ends) -> Result<(), OutlineError> {
    let (first, last) = (rows[0].to, rows[rows.len() - 1].to);
    let point = |p: [f64; 2]| format!("[{}, {}]", p[0], p[1]);
    if first[0] != 0.0 {
        let expected = "a first point on the axis, r = 0";
        return Err(OutlineError::new(1, point(first), expected));
    }
    match ends {
        Ends::OnBottom => {
            if first[1] <= 0.0 {
                let expected = "a first point above the bottom, z above 0";
                return Err(OutlineError::new(1, point(first), expected));
            }
            if last[1] != 0.0 || last[0] <= 0.0 {
                let expected = "a last point on the bottom, z = 0, away from the axis";
                return Err(OutlineError::new(rows.len(), point(last), expected));
            }
        }
        Ends::OnAxis => {
            if last[0] != 0.0 || last[1] >= first[1] {
                let expected = "a last point on the axis, r = 0, below the first one";
                return Err(OutlineError::new(rows.len(), point(last), expected));
            }
        }
    }
    Ok(())
}

/// The piece that ends at row `row`.
fn piece(
    [start, end]: [[f64; 2]; 2],
    way: Way,
    size: f64,
    row: usize,
) -> Result<Piece, OutlineError> {
    let straight = Piece::line(start, end, Role::Stated);
    let chord = distance(start, end);
    if chord < SHORTEST * size {
        let got = format!("{chord:e} mm from the point before");
        let expected = format!("at least a millionth of the size, {:e} mm", SHORTEST * size);
        return Err(OutlineError::new(row, got, expected));
    }
    let (mut centre, clockwise) = match way {
        Way::Line => return Ok(straight),
        Way::Bulge(bulge) => {
            if !(1e-6..=1e3).contains(&bulge.abs()) {
                let expected = "a bulge of 1e-6 to 1000 in size, or 0 for a line";
                return Err(OutlineError::new(row, bulge.to_string(), expected));
            }
            (centre_of_bulge(start, end, bulge), bulge < 0.0)
        }
        Way::Centre(centre) => {
            let off = (distance(start, centre) - distance(end, centre)).abs();
            if off > 1e-6 * distance(end, centre) {
                let got = format!(
                    "a centre {} mm from one end and {} from the other",
                    distance(start, centre),
                    distance(end, centre)
                );
                let expected = "one that is as far from both, to a millionth";
                return Err(OutlineError::new(row, got, expected));
            }
            let Some(clockwise) = shorter_is_clockwise(start, end, centre) else {
                let expected = "less than half a circle about a centre; a bulge of 1 or -1 says which half is meant";
                return Err(OutlineError::new(row, "half a circle", expected));
            };
            (equidistant(start, end, centre), clockwise)
        }
    };
    let radius = distance(start, centre);
    // A centre on the axis, but for rounding, makes a sphere.
    if centre[0].abs() <= SAME * radius && (start[1] - end[1]).abs() > SHORTEST * size {
        let middle = 0.5 * (start[1] + end[1]);
        let height = middle + 0.5 * (start[0] - end[0]) * (start[0] + end[0]) / (start[1] - end[1]);
        centre = [0.0, height];
    }
    let radius_mm = 0.5 * (distance(start, centre) + distance(end, centre));
    let curve = if centre[0] == 0.0 && clockwise && end[1] < start[1] {
        Curve::Arc { radius_mm, centre_mm: centre[1] }
    } else {
        Curve::Bend { radius_mm, centre_mm: centre, clockwise }
    };
    Ok(Piece { curve, ..straight })
}

/// The point nearest to `centre` that is as far from both ends.
fn equidistant(start: [f64; 2], end: [f64; 2], centre: [f64; 2]) -> [f64; 2] {
    let step = [end[0] - start[0], end[1] - start[1]];
    let middle = [0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])];
    let square = step[0] * step[0] + step[1] * step[1];
    let off = ((centre[0] - middle[0]) * step[0] + (centre[1] - middle[1]) * step[1]) / square;
    [centre[0] - off * step[0], centre[1] - off * step[1]]
}

/// Piece `k` of `count` stays off the axis but for the ends of the curve, and a dome above the
/// bottom but for its end.
fn check_place(
    piece: &Piece,
    k: usize,
    count: usize,
    ends: Ends,
    size: f64,
) -> Result<(), OutlineError> {
    let slack = SAME * size;
    let may_touch_axis = |p: [f64; 2]| {
        let first = k == 0 && distance(p, piece.start) <= slack;
        let last = ends == Ends::OnAxis && k + 1 == count && distance(p, piece.end) <= slack;
        first || last
    };
    for p in piece.extremes() {
        let off_axis = p[0] > slack || (may_touch_axis(p) && p[0] >= -slack);
        if !off_axis {
            let got = format!("a way over [{}, {}]", p[0], p[1]);
            let expected = match ends {
                Ends::OnBottom => "one that touches the axis at its first point only",
                Ends::OnAxis => "one that touches the axis at its first and last point only",
            };
            return Err(OutlineError::new(k + 2, got, expected));
        }
        let at_end = k + 1 == count && distance(p, piece.end) <= slack;
        if ends == Ends::OnBottom && p[1] <= slack && !at_end {
            let got = format!("a way over [{}, {}]", p[0], p[1]);
            let expected = "one that touches the bottom, z = 0, at its last point only";
            return Err(OutlineError::new(k + 2, got, expected));
        }
    }
    Ok(())
}

/// No two pieces meet but neighbours where they join, and those do not turn back.
fn check_meetings(pieces: &[Piece], size: f64) -> Result<(), OutlineError> {
    let slack = SAME * size;
    let boxes: Vec<[[f64; 2]; 2]> = pieces.iter().map(Piece::extent).collect();
    for (i, a) in pieces.iter().enumerate() {
        for (j, b) in pieces.iter().enumerate().skip(i + 1) {
            let apart = |axis: usize| {
                boxes[i][0][axis] > boxes[j][1][axis] + slack
                    || boxes[j][0][axis] > boxes[i][1][axis] + slack
            };
            if apart(0) || apart(1) {
                continue;
            }
            let joined = j == i + 1;
            let met = meetings(a, b, slack);
            let wrong = met.into_iter().find(|p| !(joined && distance(*p, a.end) <= JOINT * size));
            let ([_, out], [into, _]) = (a.directions(), b.directions());
            let turns_back = joined && out[0] * into[0] + out[1] * into[1] < -1.0 + 1e-12;
            if let Some([r, z]) = wrong.or(turns_back.then_some(a.end)) {
                let to = i + 2;
                let got = format!("a way that meets the one to point {to} at [{r:.9}, {z:.9}]");
                let expected = "a curve that does not meet itself";
                return Err(OutlineError::new(j + 2, got, expected));
            }
        }
    }
    Ok(())
}

/// The row whose way enters the cylinder of radius `radius_mm` from z = 0 up to `height_mm`, if
/// there is one.
pub fn into_cylinder(meridian: &Meridian, radius_mm: f64, height_mm: f64) -> Option<usize> {
    let corner = [radius_mm, height_mm];
    let walls = [([0.0, height_mm], corner), (corner, [radius_mm, 0.0])];
    let walls = walls.map(|(start, end)| Piece::line(start, end, Role::Stated));
    let inside = |p: [f64; 2]| p[0] <= radius_mm && p[1] <= height_mm;
    let enters = |piece: &Piece| {
        inside(piece.start)
            || inside(piece.end)
            || walls.iter().any(|wall| !meetings(piece, wall, 0.0).is_empty())
    };
    meridian.pieces.iter().position(enters).map(|k| k + 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(points: &[&[f64]]) -> Vec<Row> {
        points.iter().map(|p| Row::of(p).expect("numbers of a row")).collect()
    }

    #[test]
    fn one_arc_is_a_sphere_by_bulge_and_by_centre() {
        // Half an angle of asin(0.85) = 58.2 degrees about the centre (0, -1), radius 2.
        let foot = 4f64.sqrt() * 0.526_782_687_642_637 - 1.0;
        let bulge = -(0.85f64.asin() / 4.0).tan();
        let by_bulge = rows(&[&[0.0, 1.0], &[1.7, foot, bulge], &[1.7, 0.0]]);
        let by_centre = rows(&[&[0.0, 1.0], &[1.7, foot, 0.0, -1.0], &[1.7, 0.0]]);
        for rows in [by_bulge, by_centre] {
            let meridian = outline(&rows, Ends::OnBottom).expect("a dome");
            let Curve::Arc { radius_mm, centre_mm } = meridian.pieces[0].curve else {
                panic!("{:?}", meridian.pieces[0])
            };
            assert!((radius_mm - 2.0).abs() < 1e-12 && (centre_mm + 1.0).abs() < 1e-12);
            assert_eq!(meridian.pieces[1].role, Role::Cylinder);
            assert!((meridian.pieces[0].sweep() - 0.85f64.asin()).abs() < 1e-12);
        }
    }

    #[test]
    fn lengths_and_extremes_of_arcs_are_those_of_their_circles() {
        // A bead: half a circle of radius 0.5 that bulges outwards between two walls.
        let rows = rows(&[&[0.0, 3.0], &[1.0, 3.0], &[1.0, 2.5], &[1.0, 1.5, -1.0], &[1.0, 0.0]]);
        let meridian = outline(&rows, Ends::OnBottom).expect("a dome");
        let bead = meridian.pieces[2];
        assert!((bead.length_mm() - 0.5 * std::f64::consts::PI).abs() < 1e-12);
        assert!((meridian.radius_mm() - 1.5).abs() < 1e-12);
        let points = bead.points(4);
        assert_eq!(points.len(), 4);
        assert!(distance(points[1], [1.5, 2.0]) < 1e-12);
    }

    #[test]
    fn what_is_no_dome_is_refused_by_its_row() {
        let cases: [(&[&[f64]], usize, &str); 11] = [
            (&[&[0.0, 1.0]], 1, "2 to"),
            (&[&[0.1, 1.0], &[1.0, 0.0]], 1, "on the axis"),
            (&[&[0.0, 0.0], &[1.0, 0.0]], 1, "above the bottom"),
            (&[&[0.0, 1.0], &[1.0, 0.1]], 2, "on the bottom"),
            (&[&[0.0, 1.0], &[1.0, 1.0], &[0.0, 0.5], &[1.0, 0.0]], 3, "touches the axis"),
            (&[&[0.0, 1.0], &[1.0, -0.1], &[2.0, 0.0]], 2, "touches the bottom"),
            // A figure of eight, a needle, an arc through a wall, an arc across the axis.
            (
                &[&[0.0, 1.0], &[1.0, 1.0], &[1.0, 0.4], &[0.5, 0.4], &[0.5, 1.2], &[2.0, 0.0]],
                5,
                "does not meet itself",
            ),
            (&[&[0.0, 1.0], &[1.0, 1.0], &[0.5, 1.0], &[1.0, 0.0]], 3, "does not meet itself"),
            (
                &[&[0.0, 1.0], &[1.0, 1.0], &[1.0, 0.6], &[1.3, 0.4, -3.0], &[1.3, 0.0]],
                4,
                "does not meet itself",
            ),
            (&[&[0.0, 1.0], &[1.0, 0.0, 2.0]], 2, "touches"),
            (&[&[0.0, 1.0], &[1.0, 0.0, 0.3, 0.9]], 2, "as far from both"),
        ];
        for (points, row, says) in cases {
            let refused = outline(&rows(points), Ends::OnBottom).expect_err(says);
            assert_eq!(refused.row, row, "{refused:?}");
            assert!(refused.expected.contains(says), "{refused:?}");
        }
    }

    #[test]
    fn bodies_by_themselves_end_on_the_axis() {
        let lens = rows(&[&[0.0, 1.0], &[1.0, 0.5, -0.2], &[0.0, 0.2, -0.1]]);
        assert!(outline(&lens, Ends::OnAxis).is_ok());
        let refused = outline(&lens, Ends::OnBottom).expect_err("a body");
        assert_eq!(refused.row, 3);
    }

    #[test]
    fn a_box_is_looked_for_in_the_whole_curve() {
        let dent = rows(&[&[0.0, 1.0], &[0.4, 0.3], &[1.0, 0.8], &[1.5, 0.0]]);
        let meridian = outline(&dent, Ends::OnBottom).expect("a dome");
        assert_eq!(into_cylinder(&meridian, 0.3, 0.2), None);
        assert_eq!(into_cylinder(&meridian, 0.3, 0.6), Some(2));
        assert_eq!(into_cylinder(&meridian, 0.6, 0.35), Some(2));
        assert_eq!(into_cylinder(&meridian, 1.45, 0.2), Some(4));
    }
}
