// SPDX-License-Identifier: MIT OR Apache-2.0
//! Topology of a closed mesh: every edge has two triangles that run along it in opposite senses,
//! and the volume is positive.

use glam::DVec3;

use crate::error::MeshError;

/// One side of an edge, by its ends in ascending order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    ends: (u32, u32),
    /// True if the triangle runs along it from the higher end to the lower.
    back: bool,
    triangle: u32,
}

/// Checks that `triangles` are the surface of a solid; tells whether the solid is convex.
pub(super) fn check(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<bool, MeshError> {
    if !(4..=4_000_000_000).contains(&triangles.len()) {
        return Err(MeshError::Count(triangles.len()));
    }
    if let Some(vertex) = vertices.iter().position(|v| !v.is_finite()) {
        let at = vertices[vertex].to_array();
        return Err(MeshError::NotFinite { vertex, at });
    }
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for (triangle, &corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|k| **k as usize >= vertices.len()) {
            let vertices = vertices.len();
            return Err(MeshError::NoVertex { triangle, vertex, vertices });
        }
        let [a, b, c] = corners.map(|k| vertices[k as usize]);
        let area = (b - a).cross(c - a).length();
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        // Below, rounding decides where the normal points.
        if area.is_nan() || area <= 1e-10 * longest * longest {
            let corners = [a, b, c].map(|v| v.to_array());
            return Err(MeshError::Degenerate { triangle, corners });
        }
        for k in 0..3 {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            edges.push(HalfEdge {
                ends: (from.min(to), from.max(to)),
                back: from > to,
                triangle: triangle as u32,
            });
        }
    }
    edges.sort_unstable();
    let pairs = paired(vertices, &edges)?;

    let volume: f64 = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|k| vertices[k as usize] - vertices[0]);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    if volume.is_nan() || volume <= 0.0 {
        return Err(MeshError::InsideOut { volume });
    }
    Ok(convex(vertices, triangles, &pairs))
}

/// The two triangles of every edge.
fn paired(vertices: &[DVec3], edges: &[HalfEdge]) -> Result<Vec<[u32; 2]>, MeshError> {
    let mut pairs = Vec::with_capacity(edges.len() / 2);
    let (mut open, mut first_open) = (0, None);
    for edge in edges.chunk_by(|a, b| a.ends == b.ends) {
        let [from, to] =
            [edge[0].ends.0, edge[0].ends.1].map(|end| vertices[end as usize].to_array());
        match edge {
            [one] => {
                open += 1;
                first_open.get_or_insert((one.triangle as usize, from, to));
            }
            [a, b] if a.back == b.back => {
                return Err(MeshError::Inverted {
                    first: a.triangle as usize,
                    second: b.triangle as usize,
                    from,
                    to,
                });
            }
            [a, b] => pairs.push([a.triangle, b.triangle]),
            more => {
                return Err(MeshError::NonManifold {
                    triangle: more[0].triangle as usize,
                    count: more.len(),
                    from,
                    to,
                });
            }
        }
    }
    match first_open {
        Some((triangle, from, to)) => Err(MeshError::Open { triangle, from, to, open }),
        None => Ok(pairs),
    }
}

/// True if no neighbour of a triangle rises above its plane, and all hang together: then the solid
/// is convex.
fn convex(vertices: &[DVec3], triangles: &[[u32; 3]], pairs: &[[u32; 2]]) -> bool {
    let corners = |t: u32| triangles[t as usize].map(|k| vertices[k as usize]);
    let bends_out = pairs.iter().all(|&[one, other]| {
        let [a, b, c] = corners(one);
        let normal = (b - a).cross(c - a);
        let size = normal.length() * (b - a).length().max((c - a).length());
        corners(other).iter().all(|v| normal.dot(*v - a) <= 1e-9 * size)
    });
    bends_out && {
        // Two convex bodies side by side are none: join triangles over their edges.
        let mut parent: Vec<u32> = (0..triangles.len() as u32).collect();
        for &[one, other] in pairs {
            let (a, b) = (root(&mut parent, one), root(&mut parent, other));
            parent[a as usize] = b;
        }
        let first = root(&mut parent, 0);
        (0..triangles.len() as u32).all(|t| root(&mut parent, t) == first)
    }
}

fn root(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
}
