// SPDX-License-Identifier: MIT OR Apache-2.0
//! Solids that are not round: one meridian along x, one along y, ellipses between.
//!
//! Both meridians are taken apart where they turn from falling to rising or to level. Of each pair of
//! such stretches points at one share s of their height (of a level stretch: of their width) belong
//! together. With (r_x, z_x)(s) and (r_y, z_y)(s) the surface is
//!
//!   x = r_x cos ψ,   y = r_y sin ψ,   z = z_x cos² ψ + z_y sin² ψ.
//!
//! Where both stretches lie between the same heights, z_x = z_y, every level line is an ellipse,
//! r(φ, z) = 1/√((cos φ/r_x)² + (sin φ/r_y)²): two half-ellipses give the ellipsoid, and equal
//! meridians the round solid. The surface meets both meridians at right angles to their planes, and
//! has a continuous normal wherever both have a continuous tangent.

use std::f64::consts::FRAC_PI_2;
use std::fmt::{self, Display, Formatter};

use glam::DVec3;

use crate::outline::OutlineError;
use crate::tessellation::{Cells, Tessellation};
use crate::{Meridian, Piece, Role};

/// Difference of heights that counts as none, as a share of the width.
const SAME: f64 = 1e-9;
/// Difference of shares of a stretch that counts as none.
const NEAR: f64 = 1e-6;
/// Share of a row from its ends at which normals are taken there: where both curves are level,
/// tangents by one share vanish.
const WITHIN: f64 = 1e-4;

/// Pieces that fall, rise or are level one after the other, each with its row.
struct Stretch {
    pieces: Vec<(usize, Piece)>,
    /// Coordinate by which shares are measured: 0 for r of a level stretch, else 1 for z.
    axis: usize,
    /// Shares at the ends of the pieces.
    knots: Vec<f64>,
}

/// Pieces of one share of their stretches, along x and y.
struct Row {
    pieces: [Piece; 2],
    axis: usize,
}

/// The solid between two meridians from the axis to the axis, or of a dome to the bottom, which is
/// closed there.
///
/// # Errors
/// The row of the meridian along y that does not fit the one along x; too many triangles, row 0.
pub fn oval(x: &Meridian, y: &Meridian) -> Result<Tessellation, OutlineError> {
    let width_mm = 2.0 * x.radius_mm().max(y.radius_mm());
    let slack = SAME * width_mm;
    let last = y.pieces.len() + 1;
    let [(top_x, low_x), (top_y, low_y)] =
        [x, y].map(|curve| (curve.pieces[0].start[1], curve.end_mm()[1]));
    for (row, place, of_x, of_y) in [(1, "first", top_x, top_y), (last, "last", low_x, low_y)] {
        if (of_x - of_y).abs() > slack {
            let expected =
                format!("the height of the {place} point of the meridian along x, {of_x}");
            return Err(OutlineError { row, got: format!("z = {of_y}"), expected });
        }
    }
    let rows = rows([x, y].map(|curve| stretches(curve, width_mm)), slack)?;
    let at = |[i, j]: [usize; 2], share: [f64; 2]| rows[i].at(j, share);
    let cells = Cells { counts: [rows.len(), 4], is_round: true, width_mm, at: &at };
    cells.tessellated().map_err(|[got, expected]| OutlineError { row: 0, got, expected })
}

/// The stretches of a curve, which a dome ends with its bottom.
fn stretches(curve: &Meridian, width_mm: f64) -> Vec<Stretch> {
    let end = curve.end_mm();
    let bottom = (end[0] > 0.0).then(|| Piece::line(end, [0.0, end[1]], Role::Stated));
    let pieces = curve.pieces.iter().copied().chain(bottom);
    let parts: Vec<(usize, Piece)> = (2..)
        .zip(pieces)
        .flat_map(|(row, piece): (usize, Piece)| {
            // The bottom of a dome has no row.
            let row = row.min(curve.pieces.len() + 1);
            piece.between_heights(NEAR * width_mm).into_iter().map(move |part| (row, part))
        })
        .collect();
    let way = |piece: &Piece| Way::of(piece, SAME * width_mm);
    let runs = parts.chunk_by(|a, b| way(&a.1) == way(&b.1));
    let stretch = |pieces: &[(usize, Piece)]| {
        let axis = usize::from(matches!(way(&pieces[0].1), Way::Rising | Way::Falling));
        let (from, to) = (pieces[0].1.start[axis], pieces[pieces.len() - 1].1.end[axis]);
        let ends = pieces.iter().map(|(_, piece)| (piece.end[axis] - from) / (to - from));
        let knots = std::iter::once(0.0).chain(ends).collect();
        Stretch { pieces: pieces.to_vec(), axis, knots }
    };
    runs.map(stretch).collect()
}

/// The way of a stretch.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Rising,
    Falling,
    LevelOutwards,
    LevelInwards,
}

impl Way {
    fn of(piece: &Piece, slack: f64) -> Self {
        match piece.end[1] - piece.start[1] {
            up if up > slack => Self::Rising,
            up if up < -slack => Self::Falling,
            _ if piece.end[0] > piece.start[0] => Self::LevelOutwards,
            _ => Self::LevelInwards,
        }
    }
}

impl Display for Way {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rising => "rising",
            Self::Falling => "falling",
            Self::LevelOutwards => "level outwards",
            Self::LevelInwards => "level inwards",
        })
    }
}

/// The rows of cells of two curves.
fn rows([x, y]: [Vec<Stretch>; 2], slack: f64) -> Result<Vec<Row>, OutlineError> {
    let ways =
        |all: &[Stretch]| all.iter().map(|s| Way::of(&s.pieces[0].1, slack)).collect::<Vec<_>>();
    let [ways_x, ways_y] = [ways(&x), ways(&y)];
    if ways_x != ways_y {
        let other = ways_y.iter().zip(&ways_x).take_while(|(a, b)| a == b).count();
        let row = y.get(other).or(y.last()).map_or(1, |stretch| stretch.pieces[0].0);
        let [got, expected] = [ways_y, ways_x]
            .map(|ways| ways.iter().map(Way::to_string).collect::<Vec<_>>().join(", "));
        let expected = format!("stretches as of the meridian along x: {expected}");
        return Err(OutlineError { row, got, expected });
    }
    let mut rows = Vec::new();
    for (x, y) in x.iter().zip(&y) {
        let mut knots = [&*x.knots, &*y.knots].concat();
        knots.sort_by(f64::total_cmp);
        knots.dedup_by(|next, knot| *next - *knot < NEAR);
        let pairs = knots.windows(2).map(|ends| [x, y].map(|all| all.between([ends[0], ends[1]])));
        rows.extend(pairs.map(|pieces| Row { pieces, axis: x.axis }));
    }
    Ok(rows)
}

impl Stretch {
    /// The part of a piece between two shares.
    fn between(&self, ends: [f64; 2]) -> Piece {
        let middle = 0.5 * (ends[0] + ends[1]);
        let last = self.pieces.len() - 1;
        let k = (self.knots.partition_point(|knot| *knot < middle) - 1).min(last);
        let piece = self.pieces[k].1;
        let [from, to] = [self.knots[k], self.knots[k + 1]];
        let [start, end] = ends.map(|share| {
            if (share - from).abs() < NEAR {
                piece.start
            } else if (share - to).abs() < NEAR {
                piece.end
            } else {
                at_share(&piece, self.axis, (share - from) / (to - from))
            }
        });
        Piece { start, end, ..piece }
    }
}

/// The point at a share of the height or, for axis 0, the width of a piece.
fn at_share(piece: &Piece, axis: usize, share: f64) -> [f64; 2] {
    if share <= 0.0 {
        return piece.start;
    }
    if share >= 1.0 {
        return piece.end;
    }
    if axis == 0 {
        return [0, 1].map(|k| piece.start[k] + share * (piece.end[k] - piece.start[k]));
    }
    piece.at_height(piece.start[1] + share * (piece.end[1] - piece.start[1]))
}

impl Row {
    /// Point and normal at shares of the row and of quadrant `quadrant`.
    fn at(&self, quadrant: usize, [s, t]: [f64; 2]) -> (DVec3, DVec3) {
        let (sin, cos) = (t * FRAC_PI_2).sin_cos();
        let (cos, sin) = [(cos, sin), (-sin, cos), (-cos, -sin), (sin, -cos)][quadrant];
        let [[rx, zx], [ry, zy]] = self.points(s);
        // Equal heights are kept to the last bit: triangles of one point have no area.
        let point = DVec3::new(rx * cos, ry * sin, zx + (zy - zx) * sin * sin);
        let near = self.points(s.clamp(WITHIN, 1.0 - WITHIN));
        let [(dx, rate_x), (dy, rate_y)] = [0, 1].map(|k| {
            let (piece, direction) = (&self.pieces[k], self.pieces[k].direction(near[k]));
            let length = piece.end[self.axis] - piece.start[self.axis];
            (direction, direction[self.axis] / length)
        });
        let [[drx, dzx], [dry, dzy]] = [dx.map(|d| d * rate_y), dy.map(|d| d * rate_x)];
        let along = DVec3::new(drx * cos, dry * sin, dzx * cos * cos + dzy * sin * sin);
        let [[rx, zx], [ry, zy]] = near;
        let across = DVec3::new(-rx * sin, ry * cos, 2.0 * (zy - zx) * sin * cos);
        // On the axis radii may be lost in rounding.
        let on_axis = if s < 0.5 { DVec3::Z } else { DVec3::NEG_Z };
        (point, along.cross(across).normalize_or(on_axis))
    }

    /// Points of both pieces at one share: even in the angle of arcs, and close at each end at which one
    /// of them is level.
    fn points(&self, s: f64) -> [[f64; 2]; 2] {
        let of_piece = |piece: &Piece| {
            let [from, to] = [piece.start[1], piece.end[1]];
            if piece.sweep() > 0.0 { (piece.along(s)[1] - from) / (to - from) } else { s }
        };
        let share = if s <= 0.0 || s >= 1.0 || self.axis == 0 {
            s
        } else {
            let [a, b] = self.pieces.each_ref().map(of_piece);
            a.min(b) + s * (a - b).abs()
        };
        [0, 1].map(|k| at_share(&self.pieces[k], self.axis, share))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::outline::{Ends, Row as Point, outline};

    fn curve(rows: &[&[f64]]) -> Meridian {
        let rows: Vec<Point> = rows.iter().map(|row| Point::of(row).expect("a row")).collect();
        outline(&rows, Ends::OnAxis).expect("a curve")
    }

    fn ball(radius: f64) -> Meridian {
        curve(&[&[0.0, radius], &[radius, 0.0, 0.0, 0.0], &[0.0, -radius, 0.0, 0.0]])
    }

    /// The sphere by two equal meridians is as far off its triangles as is stated.
    #[test]
    fn triangles_are_as_far_off_as_is_stated() {
        let ball = ball(2.0);
        let made = oval(&ball, &ball).expect("an oval");
        let (mut most, mut turn, mut volume) = (0.0_f64, 0.0_f64, 0.0);
        for ([a, b, c], normals) in made.triangles.iter().zip(&made.normals) {
            volume += a.dot(b.cross(*c)) / 6.0;
            for (i, j) in [(0.2, 0.3), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5), (0.3, 0.4)] {
                let k = 1.0 - i - j;
                let at = *a * i + *b * j + *c * k;
                let normal = normals[0] * i + normals[1] * j + normals[2] * k;
                most = most.max((at.length() - 2.0).abs());
                turn = turn.max(normal.angle_between(at).to_degrees());
            }
        }
        let stated = made.deviation;
        assert!(most > 0.5 * stated.surface_mm && most < 1.05 * stated.surface_mm, "{most}");
        assert!(turn < crate::tessellation::NORMAL_DEG, "{turn} {stated}");
        assert!((volume / (32.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 3e-4, "{volume}");
    }

    /// Level lines are ellipses also where one curve has its corners at other heights than the other.
    #[test]
    fn level_lines_are_ellipses() {
        let x = curve(&[&[0.0, 1.0], &[1.0, 1.0], &[1.5, 0.4], &[1.5, -1.0], &[0.0, -1.0]]);
        let y = curve(&[&[0.0, 1.0], &[0.5, 1.0], &[1.1, -0.3], &[0.6, -1.0], &[0.0, -1.0]]);
        let made = oval(&x, &y).expect("an oval");
        let at = |ends: [[f64; 2]; 2], z: f64| {
            let [[r, top], [to, low]] = ends;
            r + (to - r) * (top - z) / (top - low)
        };
        let radii = |z: f64| {
            let of_x = if z > 0.4 { at([[1.0, 1.0], [1.5, 0.4]], z) } else { 1.5 };
            let of_y = if z > -0.3 {
                at([[0.5, 1.0], [1.1, -0.3]], z)
            } else {
                at([[1.1, -0.3], [0.6, -1.0]], z)
            };
            [of_x, of_y]
        };
        let sides = made.triangles.iter().flatten().filter(|p| p.z.abs() < 1.0 - 1e-9);
        let mut heights: Vec<f64> = sides
            .map(|p| {
                let [x, y] = radii(p.z);
                assert!(((p.x / x).hypot(p.y / y) - 1.0).abs() < 1e-9, "{p}");
                p.z
            })
            .collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        // Corners of both are kept.
        assert!([0.4, -0.3].iter().all(|z| heights.iter().any(|h| (h - z).abs() < 1e-9)));
    }

    /// A cap along x beside a trumpet along y, which is all but level where the cap is steep.
    #[test]
    fn an_arc_may_be_level_at_the_other_end() {
        let (sin, cos) = 5_f64.to_radians().sin_cos();
        let [half, low] = [3_f64.sqrt(), 1.0 - 2.0 * cos];
        let foot = 2.0 * (half - sin);
        let trumpet = curve(&[
            &[0.0, 1.0],
            &[half, 0.0, 0.0, -1.0],
            &[foot, low, 2.0 * half, 1.0],
            &[0.0, low],
        ]);
        let wide = (2.5 * 2.5 - (low + 1.5) * (low + 1.5)).sqrt();
        let cap = curve(&[&[0.0, 1.0], &[wide, low, 0.0, -1.5], &[0.0, low]]);
        let made = oval(&cap, &trumpet).expect("an oval");
        assert!(made.deviation.normal_deg <= crate::tessellation::NORMAL_DEG);
    }

    /// Half-ellipses by many points, and a dome of an arc beside one of a line, close at their tops.
    #[test]
    fn tops_are_one_point() {
        let half_ellipse = |radius: f64| {
            let rows: Vec<[f64; 2]> = (0..=120)
                .map(|k| {
                    let (sin, cos) = (PI * f64::from(k) / 120.0).sin_cos();
                    [if k % 120 == 0 { 0.0 } else { radius * sin }, 0.6 * cos]
                })
                .collect();
            curve(&rows.iter().map(|row| &row[..]).collect::<Vec<_>>())
        };
        let by_arcs = |radius: f64| {
            let at = |k: f64| {
                let (sin, cos) = (PI * k / 120.0).sin_cos();
                [radius * sin, 0.6 * cos]
            };
            let mut rows = vec![vec![0.0, 0.6]];
            for k in 1..=120 {
                let [from, middle, to] = [-1.0, -0.5, 0.0].map(|before| at(f64::from(k) + before));
                let chord = [to[0] - from[0], to[1] - from[1]];
                let half = [middle[0] - from[0], middle[1] - from[1]];
                let turn = half[0] * chord[1] - half[1] * chord[0];
                let bulge = 2.0 * turn / (chord[0] * chord[0] + chord[1] * chord[1]);
                rows.push(vec![if k == 120 { 0.0 } else { to[0] }, to[1], bulge]);
            }
            curve(&rows.iter().map(|row| &row[..]).collect::<Vec<_>>())
        };
        let pairs = [
            [half_ellipse(1.2), half_ellipse(0.8)],
            [by_arcs(1.2), by_arcs(0.8)],
            [
                curve(&[&[0.0, 0.7], &[0.7, 0.0, 0.0, 0.0], &[0.0, 0.0]]),
                curve(&[&[0.0, 0.7], &[1.0, 0.0], &[0.0, 0.0]]),
            ],
        ];
        for [x, y] in &pairs {
            let made = oval(x, y).expect("an oval");
            let area = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length();
            assert!(made.triangles.iter().all(|triangle| area(triangle) > 1e-12));
            assert!(made.deviation.triangles < 300_000, "{}", made.deviation);
        }
    }

    #[test]
    fn curves_that_do_not_fit_are_refused() {
        let dip = curve(&[&[0.0, 1.0], &[0.5, 1.2], &[1.0, 0.0], &[0.0, 0.0]]);
        let cone = curve(&[&[0.0, 1.0], &[1.0, 0.0], &[0.0, 0.0]]);
        let high = curve(&[&[0.0, 1.1], &[1.0, 0.0], &[0.0, 0.0]]);
        let deep = curve(&[&[0.0, 1.0], &[1.0, 0.0], &[0.0, -0.1]]);
        for (y, row, words) in
            [(&dip, 2, "falling, level"), (&high, 1, "first"), (&deep, 3, "last")]
        {
            let said = oval(&cone, y).expect_err(words);
            assert!(said.row == row && said.expected.contains(words), "{said:?}");
        }
        assert!(oval(&cone, &cone.clone().lifted(1e-12)).is_ok());
        // No row is to blame for a rim that is upright along x and all but level elsewhere.
        let cap = curve(&[&[0.0, 1.0], &[1.0, 0.0, 0.0, 0.0], &[0.0, 0.0]]);
        let trumpet = curve(&[&[0.0, 1.0], &[2.0, 0.0, 2.01, 2.52], &[0.0, 0.0]]);
        assert_eq!(oval(&cap, &trumpet).expect_err("a rim").row, 0);
    }
}
