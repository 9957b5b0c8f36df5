// SPDX-License-Identifier: MIT OR Apache-2.0
//! Errors of triangle meshes that are not the surface of a solid.

use thiserror::Error;

/// Why triangles are no surface of a solid. Triangles are counted from 0 in the order given,
/// vertices by their coordinates in mm.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// Fewer triangles than a tetrahedron has, or more than can be counted.
    #[error("mesh: expected 4 to 4e9 triangles, got {0}")]
    Count(usize),
    /// A coordinate is NaN or infinite.
    #[error("mesh: vertex {vertex}: expected finite coordinates, got {at:?}")]
    NotFinite {
        /// Number of the vertex.
        vertex: usize,
        /// Coordinates, mm.
        at: [f64; 3],
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("mesh: triangle {triangle}: vertex {vertex} does not exist, there are {vertices}")]
    NoVertex {
        /// Number of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A triangle has no area.
    #[error("mesh: triangle {triangle} with corners {corners:?} mm has no area")]
    Degenerate {
        /// Number of the triangle.
        triangle: usize,
        /// Corners, mm.
        corners: [[f64; 3]; 3],
    },
    /// An edge belongs to one triangle only: the mesh has a hole there.
    #[error(
        "mesh: open edge of triangle {triangle} from {from:?} to {to:?} mm: no other triangle has \
            it, so the solid is not closed ({open} open edges in all)"
    )]
    Open {
        /// Number of the triangle.
        triangle: usize,
        /// Start of the edge, mm.
        from: [f64; 3],
        /// End of the edge, mm.
        to: [f64; 3],
        /// Number of open edges.
        open: usize,
    },
    /// Two triangles run along an edge in the same sense: one of them is inverted.
    #[error(
        "mesh: triangles {first} and {second} run along the edge from {from:?} to {to:?} mm in \
            the same sense: one of them is inverted"
    )]
    Inverted {
        /// One triangle.
        first: usize,
        /// The other.
        second: usize,
        /// Start of the edge, mm.
        from: [f64; 3],
        /// End of the edge, mm.
        to: [f64; 3],
    },
    /// More than two triangles share an edge.
    #[error(
        "mesh: {count} triangles share the edge from {from:?} to {to:?} mm, of which {triangle} \
            is the first; expected two"
    )]
    NonManifold {
        /// Number of the first triangle.
        triangle: usize,
        /// Number of triangles.
        count: usize,
        /// Start of the edge, mm.
        from: [f64; 3],
        /// End of the edge, mm.
        to: [f64; 3],
    },
    /// All triangles face inwards.
    #[error(
        "mesh: volume {volume} mm³: expected one above 0; the triangles face inwards, \
            counter-clockwise from inside"
    )]
    InsideOut {
        /// The volume enclosed, with its sign, mm³.
        volume: f64,
    },
    /// Two triangles cross.
    #[error(
        "mesh: triangles {first} and {second} cut each other at {at:?} mm: expected the surface \
            of a solid, which does not cross itself"
    )]
    CutsItself {
        /// One triangle.
        first: usize,
        /// The other.
        second: usize,
        /// A place where they cross, mm.
        at: [f64; 3],
    },
    /// Another number of parts than of triangles.
    #[error("mesh: expected the part of each of {expected} triangles, got {got}")]
    Patches {
        /// Number of triangles.
        expected: usize,
        /// Number of parts given.
        got: usize,
    },
}
