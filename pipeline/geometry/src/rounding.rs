// SPDX-License-Identifier: MIT OR Apache-2.0
//! Corners of an outline rounded by arcs that are tangent to both sides.
//!
//! The inside lies to the right of the way. A corner that turns right is a tip, one that turns left
//! a valley. The centre of its arc is as far from both sides as the radius: where the sides, moved
//! by the radius towards it, meet.

use super::planar::{crossings, distance};
use super::profile::Rounding;
use super::{Curve, GeometryError, Piece, Role};

/// Sine of the turn below which sides join smoothly.
const SMOOTH: f64 = 1e-9;
/// What is left of a side that arcs use up, as a share of its length.
const USED_UP: f64 = 1e-9;
/// Halvings in the search for the largest radius that fits.
const STEPS: usize = 40;

/// Radii of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corner {
    /// Corners that point away from the silicone.
    Tip,
    /// Corners that point into it.
    Valley,
}

impl std::fmt::Display for Corner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Tip => "tip",
            Self::Valley => "valley",
        })
    }
}

impl Corner {
    fn other(self) -> Self {
        match self {
            Self::Tip => Self::Valley,
            Self::Valley => Self::Tip,
        }
    }
}

/// A radius that does not fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Misfit {
    /// Which of both.
    pub corner: Corner,
    /// Number of the side that is too short.
    pub piece: usize,
}

impl Misfit {
    /// The error of an element; `fits` tells whether radii do.
    pub(super) fn at(
        self,
        element: usize,
        rounding: Rounding,
        fits: impl Fn(Rounding) -> bool,
    ) -> GeometryError {
        // A side that the other kind uses up is no fault of this one.
        let alone = rounding.scaled(self.corner, 0.0);
        let (corner, rounding) =
            if fits(alone) { (self.corner, rounding) } else { (self.corner.other(), alone) };
        let radius_mm = match corner {
            Corner::Tip => rounding.tip_mm,
            Corner::Valley => rounding.valley_mm,
        };
        let most_um = 1e3 * radius_mm * largest(|factor| fits(rounding.scaled(corner, factor)));
        GeometryError::Radius {
            element,
            corner,
            radius_um: 1e3 * radius_mm,
            // To a nanometre, downwards, so that it fits as written.
            most_um: (1e3 * most_um).floor() / 1e3,
        }
    }
}

/// The arc in a corner.
#[derive(Debug, Clone, Copy)]
struct Fillet {
    corner: Corner,
    radius: f64,
    centre: [f64; 2],
    /// Where it leaves the side before and joins the side after.
    ends: [[f64; 2]; 2],
}

/// `pieces` with rounded corners: those with a straight side for which `is_relief` says so on
/// either hand, but for those of the cylinder.
pub(super) fn rounded(
    pieces: &[Piece],
    is_relief: impl Fn(usize) -> bool,
    rounding: Rounding,
) -> Result<Vec<Piece>, Misfit> {
    let mut fillets = Vec::with_capacity(pieces.len());
    for (k, pair) in pieces.windows(2).enumerate() {
        let of_cylinder = pair.iter().any(|piece| piece.role == Role::Cylinder);
        let counts = !of_cylinder && (is_relief(k) || is_relief(k + 1));
        fillets.push(if counts { fillet([&pair[0], &pair[1]], rounding, k)? } else { None });
    }
    let mut all = Vec::with_capacity(2 * pieces.len());
    for (k, piece) in pieces.iter().enumerate() {
        let before = k.checked_sub(1).and_then(|k| fillets[k]);
        let after = fillets.get(k).copied().flatten();
        let start = before.map_or(piece.start, |fillet| fillet.ends[1]);
        let mut end = after.map_or(piece.end, |fillet| fillet.ends[0]);
        let length = piece.length_mm();
        let left = piece.position(end) - piece.position(start);
        if left < -USED_UP * length {
            return Err(too_short(piece, k, [before, after]));
        }
        if left > USED_UP * length {
            all.push(Piece { start, end, ..*piece });
        } else {
            end = start;
        }
        if let Some(fillet) = after {
            let roles = [piece.role, pieces[k + 1].role];
            all.extend(fillet.pieces(end, roles));
        }
    }
    Ok(all)
}

/// The largest factor of 0 to 1 that fits; 0 if none does.
fn largest(fits: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if fits(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

impl Rounding {
    /// The same with the radius of one kind of corner times a factor.
    fn scaled(self, corner: Corner, factor: f64) -> Self {
        let Self { tip_mm, valley_mm } = self;
        match corner {
            Corner::Tip => Self { tip_mm: factor * tip_mm, valley_mm },
            Corner::Valley => Self { tip_mm, valley_mm: factor * valley_mm },
        }
    }
}

/// The side `piece` is too short for the arcs at its ends; the wider one is to blame.
fn too_short(piece: &Piece, k: usize, [before, after]: [Option<Fillet>; 2]) -> Misfit {
    let eaten = |fillet: Option<Fillet>, end: usize, corner: [f64; 2]| {
        fillet.map(|fillet| (distance(fillet.ends[end], corner), fillet.corner))
    };
    let both = [eaten(before, 1, piece.start), eaten(after, 0, piece.end)];
    let widest = both.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0));
    Misfit { corner: widest.map_or(Corner::Valley, |(_, corner)| corner), piece: k }
}

/// The arc between two sides, the first of number `k`; none where they join smoothly or stay sharp.
fn fillet([a, b]: [&Piece; 2], rounding: Rounding, k: usize) -> Result<Option<Fillet>, Misfit> {
    let ([_, u], [v, _]) = (a.directions(), b.directions());
    let turn = u[0] * v[1] - u[1] * v[0];
    let (corner, radius, to_left) = if turn < 0.0 {
        (Corner::Tip, rounding.tip_mm, -1.0)
    } else {
        (Corner::Valley, rounding.valley_mm, 1.0)
    };
    if radius <= 0.0 || turn.abs() < SMOOTH {
        return Ok(None);
    }
    let misfit = Misfit { corner, piece: k };
    let [Some(moved_a), Some(moved_b)] = [a, b].map(|side| side.moved(to_left * radius)) else {
        return Err(misfit);
    };
    let centres = crossings(&moved_a, &moved_b, 0.0).into_iter();
    let away = |p: &[f64; 2]| distance(*p, a.end);
    let centre = centres.min_by(|p, q| away(p).total_cmp(&away(q))).ok_or(misfit)?;
    let ends = [a, b].map(|side| side.nearest(centre));
    // A foot beyond the far end of either side.
    if a.position(ends[0]) > a.length_mm() * (1.0 + USED_UP) || b.position(ends[1]) < 0.0 {
        return Err(misfit);
    }
    Ok(Some(Fillet { corner, radius, centre, ends }))
}

impl Fillet {
    /// The arc from `start`; where the sides have different roles each has half of it.
    fn pieces(&self, start: [f64; 2], [before, after]: [Role; 2]) -> Vec<Piece> {
        let whole = Piece {
            start,
            end: self.ends[1],
            curve: Curve::Bend {
                radius_mm: self.radius,
                centre_mm: self.centre,
                clockwise: self.corner == Corner::Tip,
            },
            role: before,
        };
        if before == after {
            return vec![whole];
        }
        let middle = whole.along(0.5);
        let first = Piece { end: middle, ..whole };
        let second = Piece { start: middle, role: after, ..whole };
        vec![first, second]
    }
}
