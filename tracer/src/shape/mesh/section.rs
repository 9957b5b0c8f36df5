// SPDX-License-Identifier: MIT OR Apache-2.0
//! Plane sections of a mesh: closed outlines.
//!
//! Corners on the plane count as above it. So every triangle that is cut has exactly two cut edges,
//! and every cut edge belongs to two triangles: joined over them, the stretches are closed lines.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::Mesh;

/// An edge by its vertices in ascending order.
type Edge = (u32, u32);

impl Mesh {
    /// The closed lines in which the plane through `point` at right angles to `normal` cuts the
    /// surface, mm; the last point of a line joins the first.
    pub fn section(&self, point: DVec3, normal: DVec3) -> Vec<Vec<DVec3>> {
        let height = |vertex: u32| normal.dot(self.vertices[vertex as usize] - point);
        let above = |vertex: u32| height(vertex) >= 0.0;
        let mut beside: HashMap<Edge, [Option<Edge>; 2]> = HashMap::new();
        let mut order = Vec::new();
        let mut seen = HashSet::new();
        for (triangle, number) in self.triangles.iter().zip(&*self.numbers) {
            let [a, b, c] = *triangle;
            let cut = [(a, b), (b, c), (c, a)]
                .into_iter()
                .filter(|(from, to)| above(*from) != above(*to))
                .map(|(from, to)| (from.min(to), from.max(to)));
            let cut: Vec<Edge> = cut.collect();
            // A long triangle stands in several leaves.
            let &[one, other] = &cut[..] else { continue };
            if !seen.insert(*number) {
                continue;
            }
            for (edge, next) in [(one, other), (other, one)] {
                let places = beside.entry(edge).or_insert_with(|| {
                    order.push(edge);
                    [None; 2]
                });
                let place = usize::from(places[0].is_some());
                places[place] = Some(next);
            }
        }
        let at = |(from, to): Edge| {
            let (low, high) = (height(from), height(to));
            let ends = [from, to].map(|vertex| self.vertices[vertex as usize]);
            ends[0] + (ends[1] - ends[0]) * (low / (low - high))
        };
        let mut lines = Vec::new();
        for first in order {
            let mut line = Vec::new();
            let mut next = Some(first);
            while let Some(edge) = next {
                let Some(places) = beside.remove(&edge) else {
                    break;
                };
                line.push(at(edge));
                next = places.into_iter().flatten().find(|edge| beside.contains_key(edge));
            }
            if !line.is_empty() {
                lines.push(line);
            }
        }
        lines
    }
}
