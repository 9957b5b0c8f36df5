// SPDX-License-Identifier: MIT OR Apache-2.0
//! Depth to which two solids reach into each other, for messages.

use glam::DVec3;
use rand::Rng;

use crate::random;
use crate::ray::Ray;
use crate::shape::{Bounds, Reach, Shape, Sides};

/// Lines through the space that the boxes around both share.
const LINES: usize = 192;
/// Directions in which the way out of a solid is looked for.
const WAYS: usize = 48;
/// Least depth that is an overlap, as a share of the size of both.
const LEAST: f64 = 1e-7;

/// Largest distance by which the surface of one of two closed shapes reaches into the other, mm;
/// `None` where they do not overlap, or where one holds the other.
pub(super) fn depth(a: &Shape, b: &Shape) -> Option<f64> {
    let [one, two] = [a, b].map(Shape::bounds);
    let shared = Bounds { low: one.low.max(two.low), high: one.high.min(two.high) };
    if !shared.is_finite() || !shared.low.cmple(shared.high).all() {
        return None;
    }
    let least = LEAST * one.union(two).size().max_element();
    let mut rng = random::stream(0x0e1a_9d37, 0);
    let (mut deepest, mut is_cut) = (0.0_f64, [false; 2]);
    for (k, (from, into)) in [(a, b), (b, a)].into_iter().enumerate() {
        let inside: Vec<DVec3> =
            points(from, &shared, &mut rng).into_iter().filter(|at| into.holds(*at)).collect();
        for at in inside.iter().step_by(inside.len().div_ceil(WAYS).max(1)) {
            deepest = deepest.max(way_out(*at, into, &mut rng));
        }
        let whole = points(from, &from.bounds(), &mut rng);
        is_cut[k] = !inside.is_empty() && whole.iter().any(|at| !into.holds(*at));
    }
    (is_cut[0] || is_cut[1]).then_some(deepest).filter(|depth| *depth > least)
}

/// Points of the surface of `shape` on lines through `within`.
fn points(shape: &Shape, within: &Bounds, rng: &mut impl Rng) -> Vec<DVec3> {
    let size = shape.bounds().size().length();
    let mut points = Vec::new();
    for _ in 0..LINES {
        let share = DVec3::new(random::unit(rng), random::unit(rng), random::unit(rng));
        let through = within.low + share * within.size();
        let direction = random::isotropic(rng);
        let line = Ray { origin: through - direction * (2.0 * size), direction };
        let mut reach = Reach::AHEAD;
        while let Some(hit) = shape.intersect(&line, reach, Sides::Both) {
            let at = line.at(hit.distance);
            if at.cmpge(within.low - 1e-9 * size).all() && at.cmple(within.high + 1e-9 * size).all()
            {
                points.push(at);
            }
            reach.from = hit.distance + 1e-12 * size;
        }
    }
    points
}

/// Distance of a point within `shape` from its surface, mm, to a few per cent; exact from flat
/// faces.
fn way_out(at: DVec3, shape: &Shape, rng: &mut impl Rng) -> f64 {
    let towards = |direction: DVec3| {
        let ray = Ray { origin: at, direction };
        let hit = shape.intersect(&ray, Reach::AHEAD, Sides::Both)?;
        Some((hit.distance, shape.settle(ray.at(hit.distance), hit.primitive).1))
    };
    let mut shortest = f64::INFINITY;
    for _ in 0..WAYS {
        let Some((distance, normal)) = towards(random::isotropic(rng)) else {
            continue;
        };
        shortest = shortest.min(distance);
        // The normal of the face met is the shortest way to it.
        shortest = shortest.min(towards(normal).map_or(f64::INFINITY, |(distance, _)| distance));
    }
    if shortest.is_finite() { shortest } else { 0.0 }
}
