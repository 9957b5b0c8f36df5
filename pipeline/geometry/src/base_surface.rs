// SPDX-License-Identifier: MIT OR Apache-2.0
//! The smooth surface that carries relief: a sphere, or a generating curve as far out as it is a
//! function z(r).

use std::f64::consts::FRAC_PI_2;

use super::planar::distance;
use super::profile::SphericalDome;
use super::{Curve, Meridian, Piece, Role};

/// What counts as one place, as a share of the size of the curve.
const SAME: f64 = 1e-9;

/// The smooth surface that carries relief.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BaseSurface<'a> {
    /// A truncated sphere.
    Sphere(&'a SphericalDome),
    /// A generating curve.
    Curve(CurveBase<'a>),
}

/// A generating curve, and how far out it is a function z(r).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveBase<'a> {
    curve: &'a Meridian,
    /// Its largest coordinate, mm.
    size_mm: f64,
    reach_mm: f64,
    /// The piece that it reaches into.
    last: usize,
}

impl<'a> From<&'a SphericalDome> for BaseSurface<'a> {
    fn from(sphere: &'a SphericalDome) -> Self {
        Self::Sphere(sphere)
    }
}

impl<'a> From<&'a Meridian> for BaseSurface<'a> {
    fn from(curve: &'a Meridian) -> Self {
        let (reach_mm, last) = reach(curve);
        let ends = curve.pieces.iter().flat_map(|piece| piece.end);
        Self::Curve(CurveBase {
            curve,
            size_mm: ends.fold(0.0, |size: f64, v| size.max(v.abs())),
            reach_mm,
            last,
        })
    }
}

impl BaseSurface<'_> {
    /// Largest radius up to which it is a function z(r), mm: the rim of a sphere; where a curve
    /// first goes straight down or back to the axis.
    pub fn reach_mm(&self) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.radius_mm,
            Self::Curve(base) => base.reach_mm,
        }
    }

    /// Height at radius `r_mm` from the axis, mm; beyond [`Self::reach_mm`] that there.
    pub fn height_at(&self, r_mm: f64) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.height_at(r_mm),
            Self::Curve(base) => base.place(r_mm).1[1],
        }
    }

    /// The pieces between two radii, mm, in `role`.
    pub(super) fn between(&self, [from, to]: [f64; 2], role: Role) -> Vec<Piece> {
        match self {
            Self::Sphere(sphere) => {
                let at = |r: f64| [r, sphere.height_at(r)];
                vec![arc(sphere, at(from), at(to), role)]
            }
            Self::Curve(base) => {
                let ((first, start), (last, end)) = (base.place(from), base.place(to));
                let cut = |k: usize| {
                    let piece = base.curve.pieces[k];
                    Piece {
                        start: if k == first { start } else { piece.start },
                        end: if k == last { end } else { piece.end },
                        role,
                        ..piece
                    }
                };
                let all = (first..=last).map(cut);
                all.filter(|piece| base.is_long(piece)).collect()
            }
        }
    }

    /// Adds what lies beyond radius `from_mm` to `pieces`, down to the bottom.
    pub(super) fn close(&self, from_mm: f64, pieces: &mut Vec<Piece>) {
        match self {
            Self::Sphere(sphere) => close_sphere(sphere, from_mm, pieces),
            Self::Curve(base) => {
                let (first, start) = base.place(from_mm);
                let all = &base.curve.pieces[first..];
                let cut = Piece { start, ..all[0] };
                let cut = Some(cut).filter(|piece| base.is_long(piece));
                pieces.extend(cut.into_iter().chain(all[1..].iter().copied()));
            }
        }
    }

    /// Least and largest fall outwards between two radii, degrees; below 0 where it rises.
    pub fn slopes_deg(&self, [from, to]: [f64; 2]) -> [f64; 2] {
        let falls = match self {
            Self::Sphere(sphere) => [from, to]
                .map(|r| (r / sphere.sphere_radius_mm).min(1.0).asin().to_degrees())
                .to_vec(),
            Self::Curve(_) => {
                // Along an arc the direction turns one way.
                let pieces = self.between([from, to], Role::Stated).into_iter();
                let ends = pieces.flat_map(|piece| piece.directions());
                ends.map(|[r, z]| (-z).atan2(r).min(FRAC_PI_2).to_degrees()).collect()
            }
        };
        let start = [f64::INFINITY, f64::NEG_INFINITY];
        falls.into_iter().fold(start, |[least, most], fall| [least.min(fall), most.max(fall)])
    }
}

/// The radius at which the curve first goes straight down or back, and the piece that leads there.
fn reach(curve: &Meridian) -> (f64, usize) {
    let (mut reached, mut last) = (0.0, 0);
    for (k, piece) in curve.pieces.iter().enumerate() {
        if piece.directions()[0][0] <= SAME {
            break;
        }
        let outermost = match piece.curve {
            Curve::Line => None,
            Curve::Arc { radius_mm, .. } => Some(radius_mm),
            Curve::Bend { radius_mm, centre_mm, .. } => Some(centre_mm[0] + radius_mm),
        };
        let [_, high] = piece.extent();
        (reached, last) = (high[0].max(0.0), k);
        // An arc that reaches its outermost point turns back there.
        if outermost.is_some_and(|r| (r - reached).abs() <= SAME * r) {
            break;
        }
    }
    (reached, last)
}

impl CurveBase<'_> {
    fn is_long(&self, piece: &Piece) -> bool {
        distance(piece.start, piece.end) > SAME * self.size_mm
    }

    /// The piece at radius `r_mm` and the point there, (r, z) in mm.
    fn place(&self, r_mm: f64) -> (usize, [f64; 2]) {
        let slack = 1e-12 * self.size_mm;
        let r = r_mm.min(self.reach_mm);
        // All pieces but the last go outwards from end to end.
        let before = &self.curve.pieces[..self.last];
        let at = before.partition_point(|piece| piece.end[0] + slack < r);
        let piece = &self.curve.pieces[at];
        let (start, end) = (piece.start, piece.end);
        if let Some(point) = [start, end].into_iter().find(|p| (p[0] - r).abs() <= slack) {
            return (at, point);
        }
        let circle = |[c, z]: [f64; 2], radius: f64, above: f64| {
            let off = r - c;
            z + above * ((radius - off) * (radius + off)).max(0.0).sqrt()
        };
        let z = match piece.curve {
            Curve::Line => start[1] + (r - start[0]) / (end[0] - start[0]) * (end[1] - start[1]),
            Curve::Arc { radius_mm, centre_mm } => circle([0.0, centre_mm], radius_mm, 1.0),
            // Outwards a clockwise way runs over its circle, another one under it.
            Curve::Bend { radius_mm, centre_mm, clockwise } => {
                circle(centre_mm, radius_mm, if clockwise { 1.0 } else { -1.0 })
            }
        };
        (at, [r, z])
    }
}

fn arc(sphere: &SphericalDome, start: [f64; 2], end: [f64; 2], role: Role) -> Piece {
    let curve = Curve::Arc { radius_mm: sphere.sphere_radius_mm, centre_mm: sphere.centre_mm() };
    Piece { start, end, curve, role }
}

/// The sphere beyond `covered_mm`, and the cylinder.
fn close_sphere(sphere: &SphericalDome, covered_mm: f64, pieces: &mut Vec<Piece>) {
    let rim = [sphere.radius_mm, sphere.height_at(sphere.radius_mm)];
    if sphere.radius_mm - covered_mm > 1e-9 * sphere.radius_mm {
        let start = [covered_mm, sphere.height_at(covered_mm)];
        pieces.push(arc(sphere, start, rim, Role::Rest));
    } else if let Some(last) = pieces.last_mut() {
        last.end = rim;
    }
    if rim[1] > 0.0 {
        pieces.push(Piece::line(rim, [rim[0], 0.0], Role::Cylinder));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outline::{Ends, Row, outline};

    fn curve(rows: &[&[f64]]) -> Meridian {
        let rows: Vec<Row> = rows.iter().map(|row| Row::of(row).expect("a row")).collect();
        outline(&rows, Ends::OnBottom).expect("a dome")
    }

    #[test]
    fn a_curve_reaches_as_far_as_it_is_a_function() {
        let quarter = -(std::f64::consts::FRAC_PI_8).tan();
        for (rows, reach) in [
            // A cone on a cylinder; a collar that goes back; a half ball; a bead that overhangs.
            (&[&[0.0, 1.0][..], &[1.0, 0.5], &[1.0, 0.0]][..], 1.0),
            (&[&[0.0, 1.0], &[1.0, 0.6], &[0.8, 0.4], &[0.9, 0.0]], 1.0),
            (&[&[0.0, 1.0], &[1.0, 0.0, quarter]], 1.0),
            (&[&[0.0, 1.0], &[0.5, 1.0], &[0.5, 0.2, -1.0], &[0.6, 0.0]], 0.9),
        ] {
            let curve = curve(rows);
            let base = BaseSurface::from(&curve);
            assert!((base.reach_mm() - reach).abs() < 1e-12, "{rows:?}: {base:?}");
        }
    }

    #[test]
    fn heights_and_slopes_are_those_of_lines_and_circles() {
        // A cone, a hollow about (0.7, 1.2), and a ball about (1.1, 0.3) of radius 0.5.
        let root = |square: f64| square.sqrt();
        let [low, high] = [1.2 - root(0.25 - 0.04), 1.2 - root(0.25 - 0.04)];
        let curve = curve(&[
            &[0.0, 0.9],
            &[0.5, low],
            &[0.9, high, 0.7, 1.2],
            &[1.1, 0.8],
            &[1.6, 0.3, 1.1, 0.3],
            &[1.6, 0.0],
        ]);
        let base = BaseSurface::from(&curve);
        for (r, z) in [
            (0.25, 0.5 * (0.9 + low)),
            (0.7, 0.7),
            (0.8, 1.2 - root(0.24)),
            (1.1, 0.8),
            (1.4, 0.7),
            (9.0, 0.3),
        ] {
            assert!((base.height_at(r) - z).abs() < 1e-12, "{r}: {}", base.height_at(r));
        }
        let slope = (0.2 / root(0.21)).atan().to_degrees();
        let [least, most] = base.slopes_deg([0.5, 0.9]);
        assert!((least + slope).abs() < 1e-9 && (most - slope).abs() < 1e-9);
        let pieces = base.between([0.6, 1.2], Role::Element(3));
        assert_eq!(pieces.len(), 3);
        for pair in pieces.windows(2) {
            let gap = distance(pair[0].end, pair[1].start);
            assert!(gap <= 0.0, "{gap}");
        }
    }
}
