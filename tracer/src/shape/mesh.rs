// SPDX-License-Identifier: MIT OR Apache-2.0
//! Triangle meshes: the closed surface of a solid.
//!
//! A bounding volume hierarchy (obvhs, f32) finds the triangles that a ray may meet. Its leaf boxes
//! are padded by far more than the rounding of f32, and a ray is first clipped to the box of the
//! mesh, so that its f32 origin is never far away.
//!
//! The triangle met is decided in f64 \[Woop, Benthin, Wald 2013\]: space is sheared so that the
//! ray becomes an axis, every corner is projected along it independently, and the sign of the turn
//! between the two ends of an edge, computed exactly, tells on which side the ray passes. All
//! triangles thus see the same flat picture, in which every point belongs to one of them or lies on
//! an edge of two, and no ray slips through an edge or a corner. The distance is the closed form
//! for the plane of the triangle, with its normal in f64.
//!
//! A hit counts from one side, as for all shapes: the triangle just left would be met from the
//! wrong side, whatever the rounding of the start.
//!
//! \[Woop, Benthin, Wald 2013\] S. Woop, C. Benthin, I. Wald, *Watertight ray/triangle
//! intersection*, J. Comput. Graph. Tech. 2(1), 65.

mod crossing;
mod packet_traversal;
mod prefilter;
mod section;
mod smooth;
mod split;
mod topology;

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use bsdf::Side;
use glam::{DVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as Ray32, RayHit};

pub(crate) use packet_traversal::{PACKET, PacketTraversal};

use super::{Bounds, Intersection, Reach, Sides};
pub use crate::error::MeshError;
use crate::ray::Ray;

/// By how many f32 epsilons of the size of the mesh the boxes of its triangles are padded.
const PAD: f64 = 64.0;

/// Distance before its start at which a ray begins in the hierarchy, which does not look nearer
/// than 1e-4 there.
const BEFORE: f64 = 2e-4;

/// Smallest component of a direction that boxes are divided by.
const MIN_COMPONENT: f32 = 1e-20;

/// Cosine to the normal below which rounding might decide from which side a ray comes.
const GRAZING: f64 = 1e-9;

/// Relative difference of two products above which rounding cannot give it a wrong sign.
const SURE: f64 = 1e-15;

/// A triangle ready for intersection.
#[derive(Debug, Clone, Copy)]
struct Triangle {
    corners: [DVec3; 3],
    /// n, of twice the area.
    normal: DVec3,
}

/// A closed surface of triangles, n outward. Copies of another size share all but the vertices.
#[derive(Clone)]
pub struct Mesh {
    /// In the order in which the triangles first name them, so that what is near lies near in
    /// memory.
    vertices: Vec<DVec3>,
    /// Triangles in the order of the hierarchy's leaves; a long one stands in several.
    triangles: Arc<[[u32; 3]]>,
    count: usize,
    /// Number of each triangle in the order given, and its patch.
    numbers: Arc<[u32]>,
    patch_of: Arc<[u32]>,
    patches: usize,
    hierarchy: Arc<CwBvh>,
    /// Factor on lengths for the hierarchy, so that the mesh has about the size of 1
    /// there.
    scale: f64,
    bounds: Bounds,
    convex: bool,
    /// Normals at the corners of each triangle, where faces are smooth.
    corner_normals: Option<Arc<[[Vec3; 3]]>>,
}

impl fmt::Debug for Mesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Mesh")
            .field("triangles", &self.count)
            .field("bounds", &self.bounds)
            .finish_non_exhaustive()
    }
}

impl Mesh {
    /// The solid with these triangles, corners counter-clockwise from outside, `vertices` in mm;
    /// `patch_of` names the patch of each triangle, from 0.
    ///
    /// # Errors
    /// If the triangles are not the closed surface of a solid: see [`MeshError`].
    pub fn new(
        vertices: &[DVec3],
        triangles: &[[u32; 3]],
        patch_of: &[u32],
    ) -> Result<Self, MeshError> {
        if patch_of.len() != triangles.len() {
            return Err(MeshError::Patches { expected: triangles.len(), got: patch_of.len() });
        }
        let convex = topology::check(vertices, triangles)?;
        let used = triangles.iter().flatten().map(|k| vertices[*k as usize]);
        let bounds = Bounds::of_points(used);
        let size = bounds.farthest();
        // A power of two loses nothing.
        let scale = (-size.log2().ceil()).exp2();
        let pad = Vec3A::splat((PAD * f64::from(f32::EPSILON)) as f32);
        let (boxes, owners) = split::boxes(vertices, triangles, scale, pad);
        let hierarchy =
            build_cwbvh(&boxes, BvhBuildParams::slow_build(), &mut std::time::Duration::default());
        let numbers: Arc<[u32]> =
            hierarchy.primitive_indices.iter().map(|patch| owners[*patch as usize]).collect();
        let count = triangles.len();
        let (vertices, triangles) = in_order(vertices, triangles, &numbers);
        let mesh = Self {
            vertices,
            triangles: triangles.into(),
            count,
            patch_of: numbers.iter().map(|number| patch_of[*number as usize]).collect(),
            patches: patch_of.iter().max().map_or(0, |max| *max as usize + 1),
            numbers,
            hierarchy: Arc::new(hierarchy),
            scale,
            bounds,
            convex,
            corner_normals: None,
        };
        // A convex solid has no crossings.
        if !convex {
            mesh.uncut()?;
        }
        Ok(mesh)
    }

    /// The solid with these triangles, corners in mm, joined where their corners are equal to the
    /// last bit, as files without shared vertices write them.
    ///
    /// # Errors
    /// Same as [`Mesh::new`].
    pub fn welded(triangles: &[[DVec3; 3]], patch_of: &[u32]) -> Result<Self, MeshError> {
        let mut known: HashMap<[u64; 3], u32> = HashMap::new();
        let mut vertices = Vec::new();
        let joined: Vec<[u32; 3]> = triangles
            .iter()
            .map(|corners| {
                corners.map(|corner| {
                    // -0 is 0.
                    let corner = corner + DVec3::ZERO;
                    *known.entry(corner.to_array().map(f64::to_bits)).or_insert_with(|| {
                        vertices.push(corner);
                        vertices.len() as u32 - 1
                    })
                })
            })
            .collect();
        Self::new(&vertices, &joined, patch_of)
    }

    /// The same with all coordinates times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let Bounds { low, high } = self.bounds;
        Self {
            vertices: self.vertices.iter().map(|vertex| factor * *vertex).collect(),
            // The hierarchy stays, whose boxes are padded by far more than this rounds.
            scale: self.scale / factor,
            bounds: Bounds { low: factor * low, high: factor * high },
            ..self.clone()
        }
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.count
    }

    /// Vertices in mm, and the triangles in the order given.
    pub fn solid(&self) -> (&[DVec3], Vec<[u32; 3]>) {
        let mut given = vec![[0; 3]; self.count];
        for (number, triangle) in self.numbers.iter().zip(&*self.triangles) {
            given[*number as usize] = *triangle;
        }
        (&self.vertices, given)
    }

    /// True if the solid is convex: a ray that leaves it never meets it again.
    pub fn convex(&self) -> bool {
        self.convex
    }

    /// Every edge once, from end to end; some twice.
    pub(crate) fn edges(&self) -> impl Iterator<Item = [DVec3; 2]> {
        let ends = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
        let edges = self.triangles.iter().copied().flat_map(ends);
        // The two triangles of an edge run along it in opposite senses.
        let once = edges.filter(|(from, to)| from < to);
        once.map(|(from, to)| [from, to].map(|end| self.vertices[end as usize]))
    }

    /// Corners and part of every triangle; some twice.
    pub(super) fn corners_with_patches(&self) -> impl Iterator<Item = ([DVec3; 3], u32)> {
        let corners = |ends: &[u32; 3]| ends.map(|end| self.vertices[end as usize]);
        let patches = self.patch_of.iter().copied();
        self.triangles.iter().map(corners).zip(patches)
    }

    pub(super) fn patches(&self) -> usize {
        self.patches
    }

    #[inline]
    pub(super) fn patch(&self, primitive: u32) -> u32 {
        self.patch_of[primitive as usize]
    }

    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    #[inline]
    pub(super) fn settle(&self, at: DVec3, primitive: u32) -> (DVec3, DVec3) {
        let triangle = self.triangle(primitive as usize);
        let normal = triangle.normal.normalize();
        let off = normal.dot(at - triangle.corners[0]);
        (at - normal * off, normal)
    }

    pub(super) fn intersect(
        &self,
        ray: &Ray,
        mut reach: Reach,
        sides: Sides,
    ) -> Option<Intersection> {
        // Begin where the ray enters the box, so that the f32 origin is never far away.
        let start = self.entry(ray, reach)?;
        let (single, _) = self.single(ray, start, reach);
        let bound = |to: f64| self.bound(to, start);
        let sheared = ShearedRay::new(ray);
        let mut found = None;
        self.hierarchy.ray_traverse(single, &mut RayHit::none(), |_, primitive| {
            if let Some((distance, side)) = self.triangle(primitive).cross(&sheared, reach, sides) {
                reach.to = distance;
                found = Some(Intersection { distance, primitive: primitive as u32, side });
            }
            bound(reach.to)
        });
        found
    }

    /// The ray as the hierarchy sees it from `start` on, and the bound of its reach.
    #[inline]
    fn single(&self, ray: &Ray, start: f64, reach: Reach) -> (Ray32, f32) {
        let bound = self.bound(reach.to, start);
        let single = Ray32::new(
            (ray.at(start) * self.scale - ray.direction * BEFORE).as_vec3a(),
            Vec3A::from_array(ray.direction.to_array().map(divisor)),
            0.0,
            bound,
        );
        (single, bound)
    }

    /// The bound of a distance in the hierarchy, rounded up: one that is too far costs a test, one
    /// that is too near costs a hit.
    #[inline]
    fn bound(&self, to: f64, start: f64) -> f32 {
        ((to - start) * self.scale * (1.0 + 1e-5) + BEFORE + 1e-5) as f32
    }

    #[inline]
    fn triangle(&self, primitive: usize) -> Triangle {
        // Corner by corner: mapping the arrays is not compiled into the loop.
        let [a, b, c] = self.triangles[primitive];
        let corner = |vertex: u32| self.vertices[vertex as usize];
        let (a, b, c) = (corner(a), corner(b), corner(c));
        Triangle { corners: [a, b, c], normal: (b - a).cross(c - a) }
    }

    /// The nearest hit by testing every triangle: the reference for the search.
    pub fn intersect_all(&self, ray: &Ray, mut reach: Reach, sides: Sides) -> Option<Intersection> {
        let sheared = ShearedRay::new(ray);
        let mut found = None;
        for primitive in 0..self.triangles.len() {
            if let Some((distance, side)) = self.triangle(primitive).cross(&sheared, reach, sides) {
                reach.to = distance;
                found = Some(Intersection { distance, primitive: primitive as u32, side });
            }
        }
        found
    }

    /// Distance at which a ray enters the box, 0 if it starts inside; `None` if it passes by.
    #[inline]
    fn entry(&self, ray: &Ray, reach: Reach) -> Option<f64> {
        let around = self.bounds.padded(1e-9 * self.bounds.size().max_element());
        let entry = around.entry(ray.origin, ray.direction.recip(), reach);
        entry.map(|distance| distance.max(0.0))
    }
}

/// A component of a direction as boxes are divided by it: a ray along an axis must give no
/// infinity, nor what is left of two of them.
#[inline]
fn divisor(d: f64) -> f32 {
    let d = d as f32;
    if d.abs() < MIN_COMPONENT { MIN_COMPONENT.copysign(d) } else { d }
}

/// Triangles in the order of `numbers`, and the vertices in the order in which they name them.
fn in_order(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    numbers: &[u32],
) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut place = vec![u32::MAX; vertices.len()];
    let mut used = Vec::with_capacity(vertices.len());
    let ordered = numbers.iter().map(|number| {
        triangles[*number as usize].map(|vertex| {
            let place = &mut place[vertex as usize];
            if *place == u32::MAX {
                *place = used.len() as u32;
                used.push(vertices[vertex as usize]);
            }
            *place
        })
    });
    let ordered = ordered.collect();
    (used, ordered)
}

/// A ray, and the shear that turns it into the axis along which it mostly goes.
struct ShearedRay<'a> {
    ray: &'a Ray,
    axes: [usize; 3],
    shear: [f64; 2],
}

impl<'a> ShearedRay<'a> {
    #[inline]
    fn new(ray: &'a Ray) -> Self {
        let d = ray.direction;
        let size = d.abs();
        let z = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            (x, y) = (y, x);
        }
        Self { ray, axes: [x, y, z], shear: [d[x] / d[z], d[y] / d[z]] }
    }

    /// Position of a corner beside the ray. It depends on nothing but the corner and the ray.
    #[inline]
    fn project(&self, corner: DVec3) -> [f64; 2] {
        let from = (corner - self.ray.origin).to_array();
        let [x, y, z] = self.axes;
        let z = from[z];
        [from[x] - self.shear[0] * z, from[y] - self.shear[1] * z]
    }
}

/// a × b, with its sign exact.
#[inline]
fn turn(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (p, q) = (a[0] * b[1], a[1] * b[0]);
    if (p - q).abs() > SURE * (p.abs() + q.abs()) {
        return p - q;
    }
    exact_turn(a, b)
}

/// With the rounding errors of the products, which a fused multiplication gives exactly.
#[cold]
fn exact_turn(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (p, q) = (a[0] * b[1], a[1] * b[0]);
    (p - q) + (a[0].mul_add(b[1], -p) - a[1].mul_add(b[0], -q))
}

impl Triangle {
    /// Distance at which the ray crosses from one of `sides`, and which.
    #[inline]
    fn cross(&self, sheared: &ShearedRay<'_>, reach: Reach, sides: Sides) -> Option<(f64, Side)> {
        // Most are met from the other side; what grazes is left to the exact test.
        let along = self.normal.dot(sheared.ray.direction);
        let grazing = GRAZING * self.normal.abs().element_sum();
        if (sides == Sides::Inner && along < -grazing) || (sides == Sides::Outer && along > grazing)
        {
            return None;
        }
        let [a, b, c] = self.corners;
        let (a, b, c) = (sheared.project(a), sheared.project(b), sheared.project(c));
        let (u, v, w) = (turn(b, c), turn(c, a), turn(a, b));
        // Counter-clockwise as n and the ray go the same way.
        let side = if u >= 0.0 && v >= 0.0 && w >= 0.0 {
            Side::Inner
        } else if u <= 0.0 && v <= 0.0 && w <= 0.0 {
            Side::Outer
        } else {
            return None;
        };
        let distance = self.normal.dot(self.corners[0] - sheared.ray.origin) / along;
        (sides.admit(side) && reach.holds(distance)).then_some((distance, side))
    }
}
