// SPDX-License-Identifier: MIT OR Apache-2.0
//! Straight sides of a surface, and when points, sides and media are the same.

use super::error::IntegralError;
use num_complex::Complex64;
use rcwa::relief::check_index;

/// Points nearer than this fraction of the period are one.
pub(super) const SAME: f64 = 1e-9;
/// Indices that differ by less than this fraction are those of one medium.
const SAME_INDEX: f64 = 1e-12;

pub(super) type Point = [f64; 2];

/// A straight side, or part of one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub from: Point,
    pub to: Point,
}

/// The corner after corner `i`, in the next period after the last.
pub(super) fn following(corners: &[[f64; 2]], period: f64, i: usize) -> [f64; 2] {
    corners.get(i + 1).copied().unwrap_or([corners[0][0] + period, corners[0][1]])
}

/// Unit vector from `a` to `b`.
pub(super) fn direction(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let length = length(a, b);
    [(b[0] - a[0]) / length, (b[1] - a[1]) / length]
}

/// Distance from `a` to `b`.
pub(super) fn length(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// True if two indices are those of one medium.
pub(super) fn same_medium(a: Complex64, b: Complex64) -> bool {
    (a - b).norm() <= SAME_INDEX * a.norm()
}

/// Refuses half-spaces that are none, or one.
pub(super) fn check_media(top: Complex64, bottom: Complex64) -> Result<(), IntegralError> {
    check_index(|| "the top half-space".into(), top)?;
    check_index(|| "the bottom half-space".into(), bottom)?;
    if same_medium(top, bottom) {
        return Err(IntegralError::NoSurface { index: top });
    }
    Ok(())
}
