// SPDX-License-Identifier: MIT OR Apache-2.0
//! Smooth normals: light meets the faces of a mesh, and turns as on the surface that they stand for.
//!
//! The normal at a corner is the mean of those of the faces about it, each by its angle there
//! \[Thurmer & Wuthrich 1998\]; between corners it is linear. On a sphere it is off by the square of
//! the angle between faces, where that of a face is off by the angle. Normals of a known surface are
//! taken as they are.
//!
//! \[Thurmer & Wuthrich 1998\] G. Thurmer, C. Wuthrich, *Computing vertex normals from polygonal
//! facets*, J. Graph. Tools 3(1), 43.

use glam::{DVec3, Vec3};

use super::Mesh;

impl Mesh {
    /// The same mesh with smooth normals: at a corner of a face those faces of its patch count that turn
    /// by `max_deg` degrees at most from it; sharper edges stay sharp.
    #[must_use]
    pub fn smoothed(self, max_deg: f64) -> Self {
        let min_cos = max_deg.to_radians().cos() - 1e-12;
        let faces: Vec<GivenTriangle> = self.faces_once();
        let mut about = vec![Vec::new(); self.vertices.len()];
        for face in &faces {
            for corner in 0..3 {
                about[face.ends[corner] as usize].push((face, self.angle(face.ends, corner)));
            }
        }
        let normals = |own: &GivenTriangle| {
            own.ends.map(|end| -> Vec3 {
                let smooth = about[end as usize].iter().filter(|(other, _)| {
                    other.patch == own.patch && other.normal.dot(own.normal) >= min_cos
                });
                let sum: DVec3 = smooth.map(|(other, angle)| other.normal * *angle).sum();
                sum.normalize_or(own.normal).as_vec3()
            })
        };
        let by_number: Vec<[Vec3; 3]> = faces.iter().map(normals).collect();
        self.with_normals(&by_number)
    }

    /// The same mesh with these unit normals at the corners of each triangle, in the order given.
    #[must_use]
    pub fn with_normals(mut self, normals: &[[Vec3; 3]]) -> Self {
        let in_leaves = self.numbers.iter().map(|number| normals[*number as usize]);
        self.corner_normals = Some(in_leaves.collect());
        self
    }

    #[inline]
    pub(in crate::shape) fn is_smooth(&self) -> bool {
        self.corner_normals.is_some()
    }

    /// Each triangle once, in the order given.
    fn faces_once(&self) -> Vec<GivenTriangle> {
        let nothing = GivenTriangle { ends: [0; 3], normal: DVec3::Z, patch: 0 };
        let mut faces = vec![nothing; self.count];
        for (leaf, number) in self.numbers.iter().enumerate() {
            faces[*number as usize] = GivenTriangle {
                ends: self.triangles[leaf],
                normal: self.triangle(leaf).normal.normalize(),
                patch: self.patch_of[leaf],
            };
        }
        faces
    }

    /// Angle of a triangle at one of its corners.
    fn angle(&self, ends: [u32; 3], corner: usize) -> f64 {
        let [at, next, last] = [0, 1, 2].map(|k| self.vertices[ends[(corner + k) % 3] as usize]);
        (next - at).angle_between(last - at)
    }

    /// The smooth normal at a point of a triangle whose own is `normal`.
    pub(in crate::shape) fn shading(&self, at: DVec3, primitive: u32, normal: DVec3) -> DVec3 {
        let Some(normals) = &self.corner_normals else { return normal };
        let corners = self.triangle(primitive as usize).corners;
        // Areas opposite of the corners.
        let area = |a: DVec3, b: DVec3| normal.dot((a - at).cross(b - at)).max(0.0);
        let [a, b, c] = corners;
        let areas = [area(b, c), area(c, a), area(a, b)];
        let of_corners = normals[primitive as usize].map(Vec3::as_dvec3);
        (0..3).map(|k| of_corners[k] * areas[k]).sum::<DVec3>().normalize_or(normal)
    }
}

/// A triangle of the mesh as given.
#[derive(Clone, Copy)]
struct GivenTriangle {
    ends: [u32; 3],
    normal: DVec3,
    patch: u32,
}
