// SPDX-License-Identifier: MIT OR Apache-2.0
//! Self-intersection of a mesh: an edge of one triangle passes through a triangle that shares no
//! corner with it.
//!
//! Two triangles cross only where an edge of one of them passes through the other. So no crossing
//! is overlooked but those thinner than rounding, and coincident faces.

use glam::DVec3;
use obvhs::ray::RayHit;
use rayon::prelude::*;

use super::{Mesh, MeshError, ShearedRay, turn};
use crate::ray::Ray;
use crate::shape::Reach;

/// Depth of the ends of an edge on both sides of a triangle, at least, as a fraction of the size of
/// the mesh, and how far within its edges, as a share of its area, for the one to cut the other.
const DEEP: f64 = 1e-9;

impl Mesh {
    /// Refuses a mesh that cuts itself.
    pub(super) fn uncut(&self) -> Result<(), MeshError> {
        let found = (0..self.triangles.len()).into_par_iter().find_map_first(|primitive| {
            let [a, b, c] = self.triangles[primitive];
            let ways = [(a, b), (b, c), (c, a)].into_iter();
            // Each edge once.
            let mut edges = ways.filter(|(from, to)| from < to);
            edges.find_map(|edge| {
                let (other, at) = self.cut_by(edge)?;
                Some(MeshError::CutsItself {
                    first: self.numbers[primitive] as usize,
                    second: self.numbers[other] as usize,
                    at: at.to_array(),
                })
            })
        });
        found.map_or(Ok(()), Err)
    }

    /// A triangle that an edge passes through, and where.
    fn cut_by(&self, (from, to): (u32, u32)) -> Option<(usize, DVec3)> {
        let ends = [from, to].map(|end| self.vertices[end as usize]);
        let length = ends[0].distance(ends[1]);
        let ray = Ray { origin: ends[0], direction: (ends[1] - ends[0]) / length };
        let reach = Reach { from: 0.0, to: length };
        let (single, bound) = self.single(&ray, 0.0, reach);
        let sheared = ShearedRay::new(&ray);
        let deep = DEEP * self.bounds.size().max_element();
        let mut found = None;
        self.hierarchy.ray_traverse(single, &mut RayHit::none(), |_, primitive| {
            let shares = self.triangles[primitive].iter().any(|v| *v == from || *v == to);
            if !shares && found.is_none() {
                found = self.passes(primitive, &sheared, ends, deep).map(|at| (primitive, at));
            }
            if found.is_some() { 0.0 } else { bound }
        });
        found
    }

    /// Point where the edge between two points passes through a triangle.
    fn passes(
        &self,
        primitive: usize,
        sheared: &ShearedRay<'_>,
        ends: [DVec3; 2],
        deep: f64,
    ) -> Option<DVec3> {
        let triangle = self.triangle(primitive);
        let normal = triangle.normal.normalize();
        let [before, behind] = ends.map(|end| normal.dot(end - triangle.corners[0]));
        if before.abs() <= deep || behind.abs() <= deep || (before > 0.0) == (behind > 0.0) {
            return None;
        }
        let [a, b, c] = triangle.corners.map(|corner| sheared.project(corner));
        let picker = [turn(b, c), turn(c, a), turn(a, b)];
        let min = DEEP * picker.iter().map(|turn| turn.abs()).sum::<f64>();
        let within =
            picker.iter().all(|turn| *turn > min) || picker.iter().all(|turn| *turn < -min);
        let patch = before / (before - behind);
        within.then(|| ends[0] + (ends[1] - ends[0]) * patch)
    }
}
