// SPDX-License-Identifier: MIT OR Apache-2.0
//! Exact shapes in f64: nearest intersection of a ray from an allowed side.
//!
//! A hit counts only from a side that borders the region of the ray: light inside of a dome meets
//! the dome on its way out, never on its way in. A ray that leaves a surface starts off it by about
//! 1e-12 of the scene, towards the side on which it goes on (see [`crate::scene::Scene::offset`]).
//! Together these exclude self-intersection by logic, not by tolerance: the surface just left would
//! be met from the wrong side. A slightly negative smallest distance is therefore allowed; it
//! catches a ray that starts beyond another surface of an acute edge.
//!
//! Shapes are bodies of revolution about the local z axis (from segments and arcs), axis-aligned
//! boxes, planes, and closed triangle meshes. Any of them, or several that join, can be rotated and
//! moved. Where two shapes meet, their zones are padded by the same 1e-12, so that no ray slips
//! through a seam.

mod bounds;
mod cuboid;
mod faces;
mod facets;
mod flat;
mod frustum;
mod hull;
mod meridian;
mod mesh;
mod placed;
mod revolution;
mod shell;
mod sphere;
mod stairs;
mod torus;

pub use bounds::Bounds;
pub use cuboid::Cuboid;
pub(crate) use cuboid::box_passage;
pub(crate) use faces::Face;
pub(crate) use facets::{Facet, Window};
pub use flat::{Extent, Plane};
pub use frustum::Frustum;
pub(crate) use frustum::{Axial, quadratic_root};
pub(crate) use hull::Hull;
pub use meridian::{Element, Meridian};
pub use mesh::{Mesh, MeshError};
pub(crate) use mesh::{PACKET, PacketTraversal};
pub use placed::{Clip, Closing, Foot, Placed, Placement};
pub use revolution::Revolution;
pub(crate) use shell::Shell;
pub use sphere::Sphere;
pub(crate) use sphere::chord;
pub(crate) use stairs::Stairs;
pub use torus::{Bend, Torus};

use bsdf::Side;
use bsdf::direction::Frame;
use glam::{DMat3, DVec3};
use std::sync::Arc;

use crate::error::Error;
use crate::ray::Ray;

/// Padding of zones and offset of start points, as a share of the size of what they belong to.
pub const RELATIVE_PAD: f64 = 1e-12;

/// Sides from which a hit counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    /// Only from the side of -n.
    Inner,
    /// Only from the side of +n.
    Outer,
    /// From both.
    Both,
}

impl Sides {
    #[inline]
    pub(crate) fn admit(self, side: Side) -> bool {
        match self {
            Self::Inner => side == Side::Inner,
            Self::Outer => side == Side::Outer,
            Self::Both => true,
        }
    }
}

/// Open interval of distances in which a hit counts, mm.
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    /// Smallest distance; may be slightly negative.
    pub from: f64,
    /// Largest distance; infinite at first, then the nearest hit so far.
    pub to: f64,
}

impl Reach {
    /// All distances ahead.
    pub const AHEAD: Self = Self { from: 0.0, to: f64::INFINITY };

    #[inline]
    pub(crate) fn holds(self, distance: f64) -> bool {
        distance > self.from && distance < self.to
    }
}

/// Intersection of a ray with a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intersection {
    /// Distance along the ray, mm.
    pub distance: f64,
    /// Number of the primitive: face, zone, segment of the meridian or triangle.
    pub primitive: u32,
    /// The side from which the ray comes.
    pub side: Side,
}

/// A shape. The set is closed, because the innermost loop matches on it.
#[derive(Debug, Clone)]
pub enum Shape {
    /// A plane, whole or in part.
    Plane(Plane),
    /// Disc, annulus, cylinder or cone frustum about the z axis.
    Frustum(Frustum),
    /// Zones of a sphere about a point of the z axis.
    Sphere(Sphere),
    /// Axis-aligned box.
    Cuboid(Cuboid),
    /// An arc turned about the z axis.
    Torus(Arc<Torus>),
    /// A meridian of many segments turned about the z axis.
    Revolution(Arc<Revolution>),
    /// The surface of a solid as triangles.
    Mesh(Arc<Mesh>),
    /// Shapes of the other kinds, rotated and moved.
    Placed(Arc<Placed>),
}

impl Shape {
    /// Centre and radius of a whole ball.
    pub(crate) fn ball(&self) -> Option<(DVec3, f64)> {
        match self {
            Self::Sphere(sphere) => {
                let (centre, radius, _) = sphere.ball();
                sphere.whole().then_some((DVec3::Z * centre, radius))
            }
            Self::Placed(placed) => placed.ball(),
            _ => None,
        }
    }

    /// The whole plane z = `z`, n = +z. One patch.
    pub fn horizontal(z: f64) -> Result<Self, Error> {
        Plane::new(DVec3::new(0.0, 0.0, z), DVec3::Z, Extent::Infinite).map(Self::Plane)
    }

    /// The plane z = `z` in two patches: the rectangle |x| ≤ `half_x`, |y| ≤ `half_y`, and what
    /// lies beyond it. n = +z.
    pub fn ground(z: f64, half_x: f64, half_y: f64) -> Result<Self, Error> {
        Plane::new(
            DVec3::new(0.0, 0.0, z),
            DVec3::Z,
            Extent::Split { half_u: half_x, half_v: half_y },
        )
        .map(Self::Plane)
    }

    /// The ring `inner` ≤ r ≤ `outer` in the plane z = `z`, a disc if `inner` is 0. n = +z. One
    /// patch.
    pub fn annulus(z: f64, inner: f64, outer: f64) -> Result<Self, Error> {
        Frustum::new([inner, z], [outer, z]).map(Self::Frustum)
    }

    /// The cylinder of `radius` from z = `low` to `high`, n pointing away from the axis. One patch.
    pub fn cylinder(radius: f64, low: f64, high: f64) -> Result<Self, Error> {
        Frustum::new([radius, high], [radius, low]).map(Self::Frustum)
    }

    /// The surface of the meridian segment from `start` to `end`, both [r, z]; n lies to the left
    /// of its way as seen with r to the right and z up: outward for a segment that goes outward and
    /// down. One patch.
    pub fn frustum(start: [f64; 2], end: [f64; 2]) -> Result<Self, Error> {
        Frustum::new(start, end).map(Self::Frustum)
    }

    /// The surface of the arc from `start` to `end` about `centre`, all [r, z], turned about the z
    /// axis; n lies to the left of its way. One patch.
    ///
    /// # Errors
    /// Same as [`Torus::new`].
    pub fn arc(
        start: [f64; 2],
        end: [f64; 2],
        centre: [f64; 2],
        bend: Bend,
    ) -> Result<Self, Error> {
        Torus::new(start, end, centre, bend).map(|arc| Self::Torus(Arc::new(arc)))
    }

    /// A whole sphere of `radius` about (0, 0, `centre_z`), n outward. One patch.
    pub fn sphere(centre_z: f64, radius: f64) -> Result<Self, Error> {
        Sphere::new(centre_z, radius, &[centre_z + radius, centre_z - radius]).map(Self::Sphere)
    }

    /// Zones of a sphere between the heights `bounds`, from top to bottom; n outward. One patch for
    /// each zone.
    pub fn sphere_zones(centre_z: f64, radius: f64, bounds: &[f64]) -> Result<Self, Error> {
        Sphere::new(centre_z, radius, bounds).map(Self::Sphere)
    }

    /// An axis-aligned box, n outward. Three patches: sides, top, bottom.
    pub fn cuboid(low: DVec3, high: DVec3) -> Result<Self, Error> {
        Cuboid::new(low, high).map(Self::Cuboid)
    }

    /// The surface of `meridian` turned about the z axis. One patch for each element of the
    /// meridian.
    pub fn revolution(meridian: &Meridian) -> Self {
        Self::Revolution(Arc::new(Revolution::new(meridian)))
    }

    /// A closed surface of triangles, n outward. One patch for each number that the mesh gives to
    /// its triangles.
    pub fn mesh(mesh: Mesh) -> Self {
        Self::Mesh(Arc::new(mesh))
    }

    /// `members` at another place, as one shape with one patch; see [`Placed`].
    ///
    /// # Errors
    /// Same as [`Placed::new`].
    pub fn placed(
        primitives: Vec<Self>,
        closing: Closing,
        placement: &Placement,
    ) -> Result<Self, Error> {
        Placed::new(primitives, closing, placement).map(|placed| Self::Placed(Arc::new(placed)))
    }

    /// The part of the surface of a placed shape that all `clips` keep; any other shape is kept
    /// whole.
    #[must_use]
    pub fn clipped(&self, clips: Vec<Clip>) -> Self {
        match self {
            Self::Placed(placed) => Self::Placed(Arc::new(placed.clipped(clips))),
            other => other.clone(),
        }
    }

    /// This shape turned by a rotation about the z axis; bodies of revolution stay as they are.
    ///
    /// # Errors
    /// A shape that reaches to infinity.
    pub fn turned(&self, rotation: &DMat3) -> Result<Self, Error> {
        match self {
            shape if shape.round() => Ok(shape.clone()),
            Self::Placed(placed) => Ok(Self::Placed(Arc::new(placed.turned(rotation)?))),
            shape => {
                let closing = if shape.closed() { Closing::Closed } else { Closing::Open };
                let placement = Placement { rotation: *rotation, ..Placement::at(DVec3::ZERO) };
                Self::placed(vec![shape.clone()], closing, &placement)
            }
        }
    }

    /// This shape with all of its coordinates times `factor`, which is above 0.
    ///
    /// # Errors
    /// Coordinates too large for a number.
    pub fn scaled(&self, factor: f64) -> Result<Self, Error> {
        Ok(match self {
            Self::Plane(plane) => Self::Plane(plane.scaled(factor)),
            Self::Frustum(frustum) => Self::Frustum(frustum.scaled(factor)?),
            Self::Sphere(sphere) => Self::Sphere(sphere.scaled(factor)),
            Self::Cuboid(cuboid) => Self::Cuboid(cuboid.scaled(factor)?),
            Self::Torus(torus) => Self::Torus(Arc::new(torus.scaled(factor)?)),
            Self::Revolution(revolution) => Self::Revolution(Arc::new(revolution.scaled(factor)?)),
            Self::Mesh(mesh) => Self::mesh(mesh.scaled(factor)),
            Self::Placed(placed) => Self::Placed(Arc::new(placed.scaled(factor)?)),
        })
    }

    /// Number of patches, each with a surface model of its own.
    pub fn patches(&self) -> usize {
        match self {
            Self::Plane(plane) => plane.patches(),
            Self::Frustum(_) | Self::Torus(_) => 1,
            Self::Placed(placed) => placed.patches(),
            Self::Sphere(sphere) => sphere.patches(),
            Self::Cuboid(_) => 3,
            Self::Revolution(revolution) => revolution.patches(),
            Self::Mesh(mesh) => mesh.patches(),
        }
    }

    /// The nearest hit within `reach` from one of `sides`.
    #[inline]
    pub fn intersect(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        match self {
            Self::Plane(plane) => plane.intersect(ray, reach, sides),
            Self::Frustum(frustum) => frustum.intersect(ray, reach, sides),
            Self::Sphere(sphere) => sphere.intersect(ray, reach, sides),
            Self::Cuboid(cuboid) => cuboid.intersect(ray, reach, sides),
            Self::Torus(torus) => torus.intersect(ray, reach, sides),
            Self::Revolution(revolution) => revolution.intersect(ray, reach, sides),
            Self::Mesh(mesh) => mesh.intersect(ray, reach, sides),
            Self::Placed(placed) => placed.intersect(ray, reach, sides),
        }
    }

    /// The patch of a primitive.
    #[inline]
    pub fn patch(&self, primitive: u32) -> u32 {
        match self {
            Self::Plane(_) | Self::Sphere(_) => primitive,
            Self::Frustum(_) | Self::Torus(_) => 0,
            Self::Placed(placed) => placed.patch(primitive),
            Self::Cuboid(_) => Cuboid::patch(primitive),
            Self::Revolution(revolution) => revolution.patch(primitive),
            Self::Mesh(mesh) => mesh.patch(primitive),
        }
    }

    /// The point of the surface nearest to `point`, which is off by rounding only, and the unit
    /// normal n there.
    #[inline]
    pub fn settle(&self, point: DVec3, primitive: u32) -> (DVec3, DVec3) {
        match self {
            Self::Plane(plane) => plane.settle(point),
            Self::Frustum(frustum) => frustum.settle(point),
            Self::Sphere(sphere) => sphere.settle(point),
            Self::Cuboid(cuboid) => cuboid.settle(point, primitive),
            Self::Torus(torus) => torus.settle(point),
            Self::Revolution(revolution) => revolution.settle(point, primitive),
            Self::Mesh(mesh) => mesh.settle(point, primitive),
            Self::Placed(placed) => placed.settle(point, primitive),
        }
    }

    /// True if light is turned by other normals than those of the faces.
    #[inline]
    pub(crate) fn is_smooth(&self) -> bool {
        match self {
            Self::Mesh(mesh) => mesh.is_smooth(),
            Self::Placed(placed) => placed.is_smooth(),
            _ => false,
        }
    }

    /// The unit normal by which a surface turns light at a point whose normal is `normal`.
    pub(crate) fn shading(&self, point: DVec3, primitive: u32, normal: DVec3) -> DVec3 {
        match self {
            Self::Mesh(mesh) => mesh.shading(point, primitive, normal),
            Self::Placed(placed) => placed.shading(point, primitive, normal),
            _ => normal,
        }
    }

    /// The local frame (t, b, n) at `point`: t is the meridional tangent, outward and down, on
    /// bodies of revolution (on the axis the one at azimuth 0), down the slope on meshes, and fixed
    /// on planes and boxes.
    pub fn frame(&self, point: DVec3, normal: DVec3) -> Frame {
        match self {
            Self::Plane(plane) => plane.frame(),
            Self::Cuboid(_) => cuboid_frame(normal),
            Self::Mesh(_) => slope_frame(normal),
            Self::Placed(placed) => placed.frame(point, normal),
            Self::Frustum(_) | Self::Sphere(_) | Self::Torus(_) | Self::Revolution(_) => {
                meridional_frame(point, normal)
            }
        }
    }

    /// An axis-aligned box around the shape; infinite where the shape is.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Plane(plane) => plane.bounds(),
            Self::Frustum(frustum) => frustum.bounds(),
            Self::Sphere(sphere) => sphere.bounds(),
            Self::Cuboid(cuboid) => cuboid.bounds(),
            Self::Torus(torus) => torus.bounds(),
            Self::Revolution(revolution) => revolution.bounds(),
            Self::Mesh(mesh) => mesh.bounds(),
            Self::Placed(placed) => placed.bounds(),
        }
    }

    /// The point of a plane: the size of its coordinates where [`Shape::bounds`] are infinite.
    pub(crate) fn anchor(&self) -> Option<DVec3> {
        match self {
            Self::Plane(plane) => Some(plane.anchor()),
            _ => None,
        }
    }

    /// True if it is the closed surface of a solid.
    pub fn closed(&self) -> bool {
        match self {
            Self::Cuboid(_) | Self::Mesh(_) => true,
            Self::Sphere(sphere) => sphere.whole(),
            Self::Revolution(revolution) => revolution.closed(),
            Self::Placed(placed) => placed.closed(),
            Self::Plane(_) | Self::Frustum(_) | Self::Torus(_) => false,
        }
    }

    /// True if it lies on the surface of a convex solid with n outward: a ray that leaves it on the
    /// outer side never meets it again.
    pub(crate) fn convex(&self) -> bool {
        match self {
            Self::Sphere(_) | Self::Cuboid(_) => true,
            Self::Mesh(mesh) => mesh.convex(),
            Self::Placed(placed) => placed.convex(),
            Self::Plane(_) | Self::Frustum(_) | Self::Torus(_) | Self::Revolution(_) => false,
        }
    }

    /// True if it is a body of revolution about the z axis.
    pub(crate) fn round(&self) -> bool {
        match self {
            Self::Plane(_) | Self::Cuboid(_) | Self::Mesh(_) => false,
            Self::Placed(placed) => placed.round(),
            Self::Frustum(_) | Self::Sphere(_) | Self::Torus(_) | Self::Revolution(_) => true,
        }
    }

    /// Largest distance of a body of revolution from the z axis; for a placed shape an upper bound.
    pub fn radius(&self) -> Option<f64> {
        match self {
            Self::Plane(_) | Self::Cuboid(_) | Self::Mesh(_) => None,
            Self::Placed(placed) => Some(placed.radius()),
            Self::Frustum(_) | Self::Sphere(_) | Self::Torus(_) | Self::Revolution(_) => {
                Some(self.bounds().high.x)
            }
        }
    }
}

/// b is the azimuthal tangent and t = b × n: for n = (sin α, 0, cos α) this is t = (cos α, 0, -sin
/// α).
fn meridional_frame(point: DVec3, normal: DVec3) -> Frame {
    let radius = point.x.hypot(point.y);
    let b =
        if radius > 0.0 { DVec3::new(-point.y / radius, point.x / radius, 0.0) } else { DVec3::Y };
    Frame { t: b.cross(normal), b, n: normal }
}

/// t points down the slope, b is level; along x and y on level ground.
fn slope_frame(normal: DVec3) -> Frame {
    let level = DVec3::Z.cross(normal);
    let b = if level.length_squared() > 1e-20 { level.normalize() } else { DVec3::Y };
    Frame { t: b.cross(normal), b, n: normal }
}

fn cuboid_frame(normal: DVec3) -> Frame {
    let b = if normal.y.abs() > 0.5 { -DVec3::X * normal.y.signum() } else { DVec3::Y };
    Frame { t: b.cross(normal), b, n: normal }
}
