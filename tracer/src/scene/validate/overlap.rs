// SPDX-License-Identifier: MIT OR Apache-2.0
//! Overlaps of two solids, for messages.

use glam::DVec3;
use rand::Rng;

use crate::random;
use crate::ray::Ray;
use crate::shape::{Bounds, Reach, Shape, Sides};

/// Lines through the space that the boxes around both share.
const LINES: usize = 192;
/// Least depth that is an overlap, as a share of the size of both.
const LEAST: f64 = 1e-7;

/// Shortest way along x, y or z by which one of two closed shapes leaves the box around the other, mm,
/// and that axis; `None` where they do not overlap, or where one holds the other.
pub(super) fn depth(a: &Shape, b: &Shape) -> Option<(f64, &'static str)> {
    let [one, two] = [a, b].map(Shape::bounds);
    let shared = Bounds { low: one.low.max(two.low), high: one.high.min(two.high) };
    if !shared.is_finite() || !shared.low.cmple(shared.high).all() {
        return None;
    }
    let least = LEAST * one.union(two).size().max_element();
    let mut rng = random::stream(0x0e1a_9d37, 0);
    let is_cut = [(a, b), (b, a)].map(|(from, into)| {
        let inside = points(from, &shared, &mut rng).iter().any(|at| into.holds(*at));
        let whole = points(from, &from.bounds(), &mut rng);
        inside && whole.iter().any(|at| !into.holds(*at))
    });
    shortest_way(&one, &two).filter(|(depth, _)| (is_cut[0] || is_cut[1]) && *depth > least)
}

/// The same of the boxes around two bodies, of which one may be open where another displaces it;
/// `None` where they do not overlap, or one box holds the other.
pub(super) fn depth_of_boxes(a: &Shape, b: &Shape) -> Option<(f64, &'static str)> {
    let is_body = |shape: &&Shape| matches!(shape, Shape::Cuboid(_) | Shape::Mesh(_));
    let [one, two] = [a, b].map(|shape| Some(shape).filter(is_body).map(Shape::bounds));
    let (one, two) = (one?, two?);
    let holds = |a: &Bounds, b: &Bounds| a.low.cmple(b.low).all() && a.high.cmpge(b.high).all();
    if !one.is_finite() || !two.is_finite() || holds(&one, &two) || holds(&two, &one) {
        return None;
    }
    let least = LEAST * one.union(two).size().max_element();
    shortest_way(&one, &two).filter(|(depth, _)| *depth > least)
}

/// Shortest way along x, y or z by which one of two boxes leaves the other; negative where they are
/// apart.
fn shortest_way(one: &Bounds, two: &Bounds) -> Option<(f64, &'static str)> {
    let ways = (one.high - two.low).min(two.high - one.low).to_array().into_iter();
    ways.zip(["x", "y", "z"]).min_by(|a, b| a.0.total_cmp(&b.0))
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
