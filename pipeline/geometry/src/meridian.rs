// SPDX-License-Identifier: MIT OR Apache-2.0
//! The generating curve of a dome, from the axis outwards and down to the bottom.

use serde::Serialize;

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
    /// The curve higher by `by_mm`.
    #[must_use]
    pub fn lifted(mut self, by_mm: f64) -> Self {
        for piece in &mut self.pieces {
            piece.start[1] += by_mm;
            piece.end[1] += by_mm;
            match &mut piece.curve {
                Curve::Line => {}
                Curve::Arc { centre_mm, .. } => *centre_mm += by_mm,
                Curve::Bend { centre_mm, .. } => centre_mm[1] += by_mm,
            }
        }
        self
    }

    /// The curve with all lengths times `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        let scale = |length: &mut f64| *length *= factor;
        for Piece { start, end, curve, .. } in &mut self.pieces {
            start.iter_mut().chain(end).for_each(scale);
            match curve {
                Curve::Line => {}
                Curve::Arc { radius_mm, centre_mm } => {
                    [radius_mm, centre_mm].into_iter().for_each(scale);
                }
                Curve::Bend { radius_mm, centre_mm, .. } => {
                    std::iter::once(radius_mm).chain(centre_mm).for_each(scale);
                }
            }
        }
        self
    }

    /// Where it ends, (r, z), mm; the origin if it has no pieces.
    pub fn end_mm(&self) -> [f64; 2] {
        self.pieces.last().map_or([0.0; 2], |piece| piece.end)
    }

    /// Height of the highest point, mm.
    pub fn top_mm(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.extent()[1][1]).fold(0.0, f64::max)
    }

    /// Largest radius, mm.
    pub fn radius_mm(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.extent()[1][0]).fold(0.0, f64::max)
    }
}
