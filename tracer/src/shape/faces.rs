// SPDX-License-Identifier: MIT OR Apache-2.0
//! Flat faces of shapes as polygons with a normal. Module `facets` lists the faces in one plane.

use glam::DVec3;

use super::{Plane, Shape};

/// A flat face: one of its points, n, and the corners in order where it is a polygon.
#[derive(Debug, Clone)]
pub(crate) struct Face {
    pub point: DVec3,
    pub normal: DVec3,
    pub corners: Option<Vec<DVec3>>,
}

impl Face {
    /// The part of a segment in the plane of the face that lies in its polygon; all of it where the
    /// face is no polygon.
    pub fn clipped(&self, [from, to]: [DVec3; 2]) -> Option<[DVec3; 2]> {
        let Some(corners) = &self.corners else {
            return Some([from, to]);
        };
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let (mut begin, mut end) = (0.0f64, 1.0f64);
        for (k, corner) in corners.iter().enumerate() {
            let inward = self.normal.cross(corners[(k + 1) % corners.len()] - *corner);
            let inward = inward * inward.dot(middle - *corner).signum();
            let (a, b) = (inward.dot(from - *corner), inward.dot(to - *corner));
            if a < 0.0 && b < 0.0 {
                return None;
            }
            if a < 0.0 {
                begin = begin.max(a / (a - b));
            } else if b < 0.0 {
                end = end.min(a / (a - b));
            }
        }
        let at = |share: f64| from + (to - from) * share;
        (begin < end).then(|| [at(begin), at(end)])
    }

    /// The middle of the area that the face shares with a polygon in its plane, if there is one.
    pub fn shared(&self, polygon: &[DVec3]) -> Option<DVec3> {
        let left = shared_polygon(polygon, self.corners.as_ref()?, self.normal);
        let middle = left.iter().sum::<DVec3>() / left.len().max(1) as f64;
        (left.len() > 2).then_some(middle)
    }
}

/// The part of a polygon within another one of its plane, whose normal is `normal`; both are convex.
pub(crate) fn shared_polygon(polygon: &[DVec3], within: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let middle = within.iter().sum::<DVec3>() / within.len() as f64;
    let mut left = polygon.to_vec();
    for (k, corner) in within.iter().enumerate() {
        let inward = normal.cross(within[(k + 1) % within.len()] - *corner);
        let inward = inward * inward.dot(middle - *corner).signum();
        let depth = |p: DVec3| inward.dot(p - *corner);
        let before = std::mem::take(&mut left);
        for (number, &p) in before.iter().enumerate() {
            let next = before[(number + 1) % before.len()];
            let (a, b) = (depth(p), depth(next));
            if a >= 0.0 {
                left.push(p);
            }
            if (a >= 0.0) != (b >= 0.0) {
                left.push(p + (next - p) * (a / (a - b)));
            }
        }
    }
    left
}

impl Shape {
    /// Flat faces; meshes have none here.
    pub(crate) fn faces(&self) -> Vec<Face> {
        let of_plane = |plane: &Plane, corners: Option<Vec<DVec3>>| Face {
            point: plane.anchor(),
            normal: plane.frame().n,
            corners,
        };
        match self {
            Self::Plane(plane) => {
                let corners: Vec<DVec3> = plane.edges().iter().map(|[from, _]| *from).collect();
                vec![of_plane(plane, (!corners.is_empty()).then_some(corners))]
            }
            Self::Frustum(frustum) => {
                let [nr, nz, k] = frustum.line();
                let face =
                    Face { point: DVec3::Z * (k * nz), normal: DVec3::Z * nz, corners: None };
                if nr == 0.0 { vec![face] } else { Vec::new() }
            }
            Self::Cuboid(cuboid) => {
                let face = |(primitive, corners): (u32, [DVec3; 4])| {
                    let (axis, upper) = (primitive as usize / 2, primitive % 2);
                    Face {
                        point: corners[0],
                        normal: DVec3::AXES[axis] * (2.0 * f64::from(upper) - 1.0),
                        corners: Some(corners.to_vec()),
                    }
                };
                cuboid.faces().map(face).into()
            }
            Self::Placed(placed) => placed.faces(),
            Self::Sphere(_) | Self::Torus(_) | Self::Revolution(_) | Self::Mesh(_) => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Extent;

    #[test]
    fn polygons_share_what_lies_in_both() {
        let square = |half: f64, at: DVec3| {
            let corner = |[x, y]: [f64; 2]| at + DVec3::new(x * half, y * half, 0.0);
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner)
        };
        let face = Face {
            point: DVec3::ZERO,
            normal: -DVec3::Z,
            corners: Some(square(1.0, DVec3::ZERO).to_vec()),
        };
        let found = face.shared(&square(0.25, DVec3::new(1.0, 1.0, 0.0)));
        assert_eq!(found, Some(DVec3::new(0.875, 0.875, 0.0)));
        assert_eq!(face.shared(&square(0.25, DVec3::X * 1.3)), None);
        let line = [DVec3::new(-4.0, 0.5, 0.0), DVec3::new(4.0, 0.5, 0.0)];
        let ends = [DVec3::new(-1.0, 0.5, 0.0), DVec3::new(1.0, 0.5, 0.0)];
        assert_eq!(face.clipped(line), Some(ends));
        assert_eq!(face.clipped(line.map(|p| p + DVec3::Y)), None);
        let endless = Plane::new(DVec3::ONE, DVec3::Z, Extent::Infinite).expect("a plane");
        let faces = Shape::Plane(endless).faces();
        assert!(faces[0].corners.is_none() && faces[0].clipped(line) == Some(line));
    }
}
