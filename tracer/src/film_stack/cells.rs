// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cells of incidence of a film stack: equal parts of sin² θ times equal parts of the azimuths that
//! the symmetry of the stack leaves. Equal parts of both hold equal shares of diffuse light.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat2, DVec2, DVec3};
use rand::Rng;

use crate::random;

/// Rotations about z and mirror planes that leave a film stack as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StackSymmetry {
    /// All rotations.
    Round,
    /// Two mirror planes at right angles, one of them at this azimuth, radians.
    Mirrors(f64),
    /// Half a turn.
    HalfTurn,
    /// None.
    None,
}

/// Rows of sin² θ, an even number.
const ROWS: u32 = 32;
/// Columns of azimuth for a quarter of a turn, an even number. With eight, four times as many cells share
/// the outcomes: luminance behind a panel had 1.2 times the error.
const COLUMNS: u32 = 2;

/// The cells of one side of a stack.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells {
    symmetry: StackSymmetry,
    columns: u32,
}

/// Turns what the table has for a cell to an incident ray: a rotation or a mirror that leaves the stack
/// as it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn(DMat2);

impl Turn {
    /// A vector of the table in the frame of the ray.
    pub fn apply(&self, v: DVec3) -> DVec3 {
        (self.0 * v.truncate()).extend(v.z)
    }

    /// A vector of the frame of the ray in the table.
    pub fn undo(&self, v: DVec3) -> DVec3 {
        (self.0.transpose() * v.truncate()).extend(v.z)
    }

    /// True if it mirrors.
    pub fn mirrors(&self) -> bool {
        self.0.determinant() < 0.0
    }
}

impl Cells {
    pub fn new(symmetry: StackSymmetry) -> Self {
        let quarters = match symmetry {
            StackSymmetry::Round => return Self { symmetry, columns: 1 },
            StackSymmetry::Mirrors(_) => 1,
            StackSymmetry::HalfTurn => 2,
            StackSymmetry::None => 4,
        };
        Self { symmetry, columns: quarters * COLUMNS }
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        (ROWS * self.columns) as usize
    }

    /// Azimuths that the columns divide.
    fn range(&self) -> f64 {
        match self.symmetry {
            StackSymmetry::Round => 0.0,
            StackSymmetry::Mirrors(_) => FRAC_PI_2,
            StackSymmetry::HalfTurn => PI,
            StackSymmetry::None => TAU,
        }
    }

    /// The cell of a unit vector, and the turn from the table to it.
    pub fn find(&self, direction: DVec3) -> (u32, Turn) {
        let DVec3 { x, y, .. } = direction;
        let sin2 = x * x + y * y;
        let row = ((sin2 * f64::from(ROWS)) as u32).min(ROWS - 1);
        let across = direction.truncate();
        let (azimuth, turn) = match self.symmetry {
            StackSymmetry::Round => {
                let along = across.try_normalize().unwrap_or(DVec2::X);
                return (row, Turn(DMat2::from_cols(along, along.perp())));
            }
            StackSymmetry::Mirrors(axis) => {
                let frame = DMat2::from_angle(axis);
                let seen = frame.transpose() * across;
                let signs = DVec2::select(seen.cmplt(DVec2::ZERO), DVec2::NEG_ONE, DVec2::ONE);
                let (u, v) = (seen * signs).into();
                (v.atan2(u), Turn(frame * DMat2::from_diagonal(signs) * frame.transpose()))
            }
            StackSymmetry::HalfTurn => {
                let sign = if y < 0.0 { -1.0 } else { 1.0 };
                let (u, v) = (across * sign).into();
                (v.atan2(u), Turn(DMat2::from_diagonal(DVec2::splat(sign))))
            }
            StackSymmetry::None => (y.atan2(x).rem_euclid(TAU), Turn(DMat2::IDENTITY)),
        };
        let column = (azimuth / self.range() * f64::from(self.columns)) as u32;
        (row * self.columns + column.min(self.columns - 1), turn)
    }

    /// Draws a direction from a cell, rising or falling: evenly, as diffuse light fills it.
    pub fn draw(&self, cell: u32, rises: bool, rng: &mut impl Rng) -> DVec3 {
        let (row, column) = (cell / self.columns, cell % self.columns);
        let sin2 = (f64::from(row) + random::unit(rng)) / f64::from(ROWS);
        let azimuth = match self.symmetry {
            StackSymmetry::Round => 0.0,
            _ => (f64::from(column) + random::unit(rng)) / f64::from(self.columns) * self.range(),
        };
        let first = if let StackSymmetry::Mirrors(axis) = self.symmetry { axis } else { 0.0 };
        let (sin, cos) = (first + azimuth).sin_cos();
        let z = (1.0 - sin2).max(f64::EPSILON).sqrt();
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * cos, across * sin, if rises { z } else { -z })
    }

    /// One of the cells that make one of twice the width with this one.
    pub fn widened(&self, cell: u32, rng: &mut impl Rng) -> u32 {
        let (row, column) = (cell / self.columns, cell % self.columns);
        let mut other = |of: u32| of ^ u32::from(random::unit(rng) < 0.5);
        let row = other(row);
        let column = if self.columns > 1 { other(column) } else { column };
        row * self.columns + column
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions fall into the cell that they are drawn from, and the turn brings the table's frame
    /// to the ray: of any direction, the one drawn from its cell and turned lies near.
    #[test]
    fn directions_are_found_in_the_cell_that_draws_them() {
        let mut rng = random::stream(5, 0);
        for symmetry in [
            StackSymmetry::Round,
            StackSymmetry::Mirrors(0.3),
            StackSymmetry::HalfTurn,
            StackSymmetry::None,
        ] {
            let cells = Cells::new(symmetry);
            for _ in 0..4000 {
                let ray = random::isotropic(&mut rng);
                let (cell, turn) = cells.find(ray);
                assert!((cell as usize) < cells.count());
                let drawn = cells.draw(cell, ray.z > 0.0, &mut rng);
                assert!((drawn.length() - 1.0).abs() < 1e-12 && drawn.z * ray.z > 0.0);
                // The table holds directions as they are.
                let (own, identity) = cells.find(drawn);
                assert_eq!(own, cell, "{symmetry:?}");
                assert!((identity.apply(drawn) - drawn).length() < 1e-12);
                let near = turn.apply(drawn);
                assert_eq!(cells.find(near).0, cell, "{symmetry:?}");
                let apart = (near - ray).truncate().length();
                let most = if symmetry == StackSymmetry::Round { 0.27 } else { 0.8 };
                assert!(apart < most, "{symmetry:?} {ray} {near}");
                let wide = cells.widened(cell, &mut rng);
                assert!((wide as usize) < cells.count());
            }
        }
    }
}
