// SPDX-License-Identifier: MIT OR Apache-2.0
//! A dome that is a closed mesh of triangles.

use glam::DVec3;
use serde::Serialize;
use tracer::Shape;

/// The solid of a dome.
#[derive(Debug, Clone, Serialize)]
pub struct DomeMesh {
    /// Name in the design.
    pub file: String,
    /// Hexadecimal SHA-256 of the file.
    pub sha256: String,
    /// Number of triangles.
    pub triangles: usize,
    /// Part 0 is the dome, part 1 the bottom.
    #[serde(skip)]
    pub shape: Shape,
}

impl DomeMesh {
    /// Whether the upper corners of a box on the bottom, centred on the axis, lie within.
    pub fn holds_box(&self, size_mm: [f64; 2], height_mm: f64) -> bool {
        let [x, y] = size_mm.map(|length| 0.5 * length);
        [[x, y], [-x, y], [-x, -y], [x, -y]]
            .into_iter()
            .all(|[x, y]| self.shape.holds(DVec3::new(x, y, height_mm)))
    }

    /// The closed lines (x, z) in which the plane y = 0 cuts it, mm.
    pub fn section(&self) -> Vec<Vec<[f64; 2]>> {
        let Shape::Mesh(mesh) = &self.shape else {
            return Vec::new();
        };
        let lines = mesh.section(DVec3::ZERO, DVec3::Y).into_iter();
        lines
            .map(|line| line.into_iter().map(|at| [at.x, at.z]).collect())
            .collect()
    }
}
