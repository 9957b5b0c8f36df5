// SPDX-License-Identifier: MIT OR Apache-2.0
//! Clearance of an array: light that passes over everything when it leaves its package.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "compiled into the wide loop over all rays"
)]

use glam::{DVec2, Vec2Swizzles};

use super::kernels::positive;
use crate::scene::{Instance, Scene};
use crate::shape::Bounds;

/// Obstacle that light must pass over to meet nothing after it has left a package: whatever stands
/// beside the package is at least `gap` away from its outline, and no higher than `top` above its
/// origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clearance {
    gap: f64,
    top: f64,
}

impl Clearance {
    /// True if light along `d` from the height `z` of a package passes over everything.
    #[inline(always)]
    pub fn passed(self, z: f64, [dx, dy, dz]: [f64; 3]) -> bool {
        let below = positive(self.top - z);
        let climb = self.gap * dz;
        (dz > 0.0) & (below * below * (dx * dx + dy * dy) < climb * climb)
    }

    /// Clearance of packages of which nothing lies below `level` in their own frame, which all
    /// stand at one height, and on or above whatever is not beside them.
    pub fn new(scene: &Scene, level: f64) -> Self {
        const NONE: Clearance = Clearance { gap: 0.0, top: f64::INFINITY };
        let list = &scene.instances.list;
        let Some(first) = list.first() else {
            return NONE;
        };
        let body = &scene.bodies[first.prototype as usize];
        let floor = first.position.z + level;
        let raised = |other: &Instance| (other.position.z - first.position.z).abs() > 0.0;
        if list.iter().any(raised) {
            return NONE;
        }
        // Bodies of revolution about upright axes.
        let radius = body.bounds.high.max(-body.bounds.low).truncate().max_element();
        let mut gap = if scene.only_candidate(Some(0)).is_some() {
            f64::INFINITY
        } else {
            let middles: Vec<DVec2> = list.iter().map(|one| one.position.truncate()).collect();
            nearest(middles) - 2.0 * radius
        };
        let mut top = first.position.z + body.bounds.high.z;
        for surface in &scene.ground.surfaces {
            let Bounds { low, high } = surface.shape.bounds();
            if high.z <= floor {
                continue;
            }
            top = top.max(high.z);
            for one in list {
                let middle = one.position.truncate();
                let beside = (low.truncate() - middle).max(middle - high.truncate());
                gap = gap.min(beside.max(DVec2::ZERO).length() - radius);
            }
        }
        // What is rounded away here is far less than a billionth.
        let gap = gap * (1.0 - 1e-9);
        if gap > 0.0 { Self { gap, top: top - first.position.z } } else { NONE }
    }
}

/// Least distance of two of the points, infinite of less than two.
fn nearest(mut points: Vec<DVec2>) -> f64 {
    let low = points.iter().fold(DVec2::INFINITY, |low, p| low.min(*p));
    let high = points.iter().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
    // Swept along the longer side.
    if high.y - low.y > high.x - low.x {
        for point in &mut points {
            *point = point.yx();
        }
    }
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
    let mut min = f64::INFINITY;
    for (k, point) in points.iter().enumerate() {
        for other in &points[k + 1..] {
            if other.x - point.x >= min {
                break;
            }
            min = min.min(point.distance(*other));
        }
    }
    min
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_two_of_many_are_found() {
        assert!(nearest(vec![DVec2::ZERO]).is_infinite());
        // A grid of 7 by 40 whose columns lean, and one point off it.
        let grid = (0..280).map(|k| (f64::from(k % 7), f64::from(k / 7)));
        let mut points: Vec<DVec2> =
            grid.map(|(x, y)| DVec2::new(3.0 * x + 0.1 * y, 2.0 * y)).collect();
        let pairs = |points: &[DVec2]| {
            points
                .iter()
                .enumerate()
                .flat_map(|(k, a)| points[k + 1..].iter().map(|b| a.distance(*b)))
                .fold(f64::INFINITY, f64::min)
        };
        assert!((nearest(points.clone()) - pairs(&points)).abs() < 1e-15);
        points.push(DVec2::new(7.3, 51.4));
        assert!(pairs(&points) < 1.5);
        assert!((nearest(points.clone()) - pairs(&points)).abs() < 1e-15);
    }
}
