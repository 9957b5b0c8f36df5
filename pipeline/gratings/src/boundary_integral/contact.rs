// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whether a surface of straight sides touches itself or its images in other periods.

use super::sides::{Piece, Point, SAME, direction, following, length};

/// A point where sides that are no neighbours meet, of a surface and its images one and two periods
/// on.
pub(super) fn crossing(corners: &[Point], period: f64) -> Option<Point> {
    let sides: Vec<Piece> = (0..corners.len())
        .map(|i| Piece { from: corners[i], to: following(corners, period, i) })
        .collect();
    let count = sides.len() as i32;
    for (i, a) in sides.iter().enumerate() {
        for (j, b) in sides.iter().enumerate() {
            let (left, right) = (a.from[0].min(a.to[0]), a.from[0].max(a.to[0]));
            let (b_left, b_right) = (b.from[0].min(b.to[0]), b.from[0].max(b.to[0]));
            let first = ((left - b_right) / period).floor() as i32;
            let last = ((right - b_left) / period).ceil() as i32;
            for lap in first..=last {
                // Number of sides from a to b along the surface: 0 and ±1 share a corner or are the
                // same.
                let apart = j as i32 - i as i32 + lap * count;
                let dx = f64::from(lap) * period;
                let moved =
                    Piece { from: [b.from[0] + dx, b.from[1]], to: [b.to[0] + dx, b.to[1]] };
                if apart.abs() > 1 && meet(a, &moved, SAME * period) {
                    return Some(moved.from);
                }
                if apart == 1 && folds_back(a, &moved) {
                    return Some(moved.from);
                }
            }
        }
    }
    None
}

/// Whether two sides come nearer than `same`.
fn meet(a: &Piece, b: &Piece, same: f64) -> bool {
    let distance = |p: Point, s: &Piece| {
        let [tx, tz] = direction(s.from, s.to);
        let length = length(s.from, s.to);
        let (dx, dz) = (p[0] - s.from[0], p[1] - s.from[1]);
        let along = (dx * tx + dz * tz).clamp(0.0, length);
        (dx - along * tx).hypot(dz - along * tz)
    };
    let across = |p: Point, s: &Piece| {
        (s.to[0] - s.from[0]) * (p[1] - s.from[1]) - (s.to[1] - s.from[1]) * (p[0] - s.from[0])
    };
    let parted = |s: &Piece, t: &Piece| (across(t.from, s) > 0.0) != (across(t.to, s) > 0.0);
    (parted(a, b) && parted(b, a))
        || [distance(a.from, b), distance(a.to, b), distance(b.from, a), distance(b.to, a)]
            .iter()
            .any(|&d| d <= same)
}

/// Whether a side runs back along the one before it.
fn folds_back(a: &Piece, b: &Piece) -> bool {
    let (u, v) = (direction(a.from, a.to), direction(b.from, b.to));
    (u[0] * v[1] - u[1] * v[0]).abs() < SAME && u[0] * v[0] + u[1] * v[1] < 0.0
}
