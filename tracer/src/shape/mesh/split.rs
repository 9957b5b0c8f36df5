// SPDX-License-Identifier: MIT OR Apache-2.0
//! Boxes of triangles for the hierarchy: one for most, several for a long triangle that lies across
//! the axes.
//!
//! The single box of such a triangle would hold far more than it. Without the split a ray would
//! test one in ten slivers of a fan around one vertex.

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;

/// A box is divided if its faces are more than so many times larger than those of the mean one, and
/// than the triangle in it.
const LARGER: f64 = 4.0;

/// Times that a triangle is halved at most.
const HALVINGS: u32 = 6;

/// Padded boxes of the triangles times `scale`, and the triangle that each belongs to.
pub(super) fn boxes(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    scale: f64,
    pad: Vec3A,
) -> (Vec<Aabb>, Vec<u32>) {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| vertices[vertex as usize]);
    let all = triangles.iter().map(|triangle| faces(corners(triangle)));
    let large = LARGER * all.sum::<f64>() / triangles.len() as f64;
    let (mut boxes, mut owners) = (Vec::new(), Vec::new());
    for (number, triangle) in (0..).zip(triangles) {
        let mut add = |[a, b, c]: [DVec3; 3]| {
            let [a, b, c] = [a, b, c].map(|corner| (corner * scale).as_vec3a());
            boxes.push(Aabb::new(a.min(b).min(c) - pad, a.max(b).max(c) + pad));
            owners.push(number);
        };
        halve(corners(triangle), large, HALVINGS, &mut add);
    }
    (boxes, owners)
}

/// Gives a triangle, or its halves, to `add`.
fn halve(corners: [DVec3; 3], large: f64, times: u32, add: &mut impl FnMut([DVec3; 3])) {
    let [a, b, c] = corners;
    let (faces, own) = (faces(corners), (b - a).cross(c - a).length());
    if times == 0 || faces < large || faces < LARGER * own {
        return add(corners);
    }
    // Across the longest edge.
    let lengths = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
    let [a, b, c] = if lengths[0] >= lengths[1] && lengths[0] >= lengths[2] {
        [a, b, c]
    } else if lengths[1] >= lengths[2] {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let middle = 0.5 * (a + b);
    halve([a, middle, c], large, times - 1, add);
    halve([middle, b, c], large, times - 1, add);
}

/// Half the surface of the box around a triangle.
fn faces([a, b, c]: [DVec3; 3]) -> f64 {
    let size = a.max(b).max(c) - a.min(b).min(c);
    size.x * size.y + size.y * size.z + size.z * size.x
}
