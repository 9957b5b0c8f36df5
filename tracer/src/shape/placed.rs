// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shapes rotated and moved, alone or several that together enclose a space.
//!
//! A ray is brought into the frame of the member shapes, the nearest of their hits is found, and
//! the hit is brought back. The outer faces can be inset by a length far above rounding and far
//! below the wavelength, so that solids stated face to face have a gap: of two coincident faces no
//! tracer can tell which comes first. An inset scales the members along their own axes about the
//! middle of their box.

use bsdf::direction::Frame;
use glam::{DMat3, DVec3};

use super::{Bounds, Face, Facet, Hull, Intersection, Reach, Shape, Sides, Window};
use crate::error::{Error, check, finite};
use crate::ray::Ray;

/// Chords of a circle in [`Placed::edges`].
const CHORDS: usize = 48;

/// Distance from a crossing within which it is found again, as a share of the coordinates.
const SAME: f64 = 1e-14;

/// Largest deviation of an upright axis, 1 less its cosine.
const UPRIGHT: f64 = 1e-12;

/// A rotation, a translation and an inset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Axes in the frame of the body, as columns: a rotation.
    pub rotation: DMat3,
    /// Origin in the frame of the body, mm.
    pub origin: DVec3,
    /// Inset of its outermost faces, mm; 0 or more.
    pub inset: f64,
    /// Direction in which the inset moves the lowest face.
    pub foot: Foot,
}

/// Direction in which the inset moves the lowest face of a placed shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Foot {
    /// Upwards: inwards as all others.
    #[default]
    Raised,
    /// Downwards, into what the shape stands on. One axis of the members must be upright.
    Sunk,
}

impl Placement {
    /// At `origin` (mm), without rotation.
    pub fn at(origin: DVec3) -> Self {
        Self { rotation: DMat3::IDENTITY, origin, inset: 0.0, foot: Foot::Raised }
    }

    /// Rotated so that z becomes `axis`, of any length above 0, by the shortest way.
    ///
    /// # Errors
    /// A direction that is none.
    pub fn along(mut self, axis: DVec3) -> Result<Self, Error> {
        check("length of an axis", axis.length(), "a finite number above 0", axis.length() > 0.0)?;
        let axis = axis.normalize();
        self.rotation = if axis == DVec3::Z {
            DMat3::IDENTITY
        } else {
            DMat3::from_quat(glam::DQuat::from_rotation_arc(DVec3::Z, axis))
        };
        Ok(self)
    }
}

/// True if the members of a placed shape enclose a space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closing {
    /// They are the whole surface of a solid.
    Closed,
    /// They are a sheet.
    Open,
}

/// A solid by which the surface of another is clipped: it keeps the points on whose outer side the
/// solid lies, or does not lie.
#[derive(Debug, Clone)]
pub struct Clip {
    /// The solid, which is closed.
    pub solid: Shape,
    /// True if the points beside the solid are kept, false if all others are.
    pub keeps: bool,
    /// Distances from the surface, along its normal, at which the solid is looked for, mm: above the
    /// gap between faces that touch.
    pub reaches_mm: Vec<f64>,
}

impl Clip {
    fn admits(&self, at: DVec3, normal: DVec3) -> bool {
        let mut reaches = self.reaches_mm.iter();
        reaches.any(|reach| self.solid.holds(at + normal * *reach)) == self.keeps
    }
}

/// Shapes with one placement, as one shape: with the patches of its member if it has one alone, with
/// one patch if it has several.
#[derive(Debug, Clone)]
pub struct Placed {
    members: Vec<Shape>,
    clips: Vec<Clip>,
    closing: Closing,
    rotation: DMat3,
    /// Scale factors along the axes of the members.
    scale: DVec3,
    origin: DVec3,
    bounds: Bounds,
}

impl Placed {
    /// Centre and radius of a whole ball with the same scale along all axes.
    pub(crate) fn ball(&self) -> Option<(DVec3, f64)> {
        let [member] = &self.members[..] else {
            return None;
        };
        let (centre, radius) = member.ball()?;
        let even = (self.scale - DVec3::splat(self.scale.x)).abs().max_element() <= 1e-9;
        let at = self.origin + self.rotation * (centre * self.scale);
        even.then_some((at, radius * self.scale.x))
    }

    /// `members`, which join where they end, at `placement`.
    ///
    /// # Errors
    /// No member; members that reach to infinity; a matrix that is no rotation; an origin that is
    /// not finite; an inset that leaves nothing; a foot to sink below axes that all lean.
    pub fn new(
        members: Vec<Shape>,
        closing: Closing,
        placement: &Placement,
    ) -> Result<Self, Error> {
        if members.is_empty() {
            return Err(Error::TooFew { what: "pieces of a placed shape", expected: 1, got: 0 });
        }
        let Placement { rotation, origin, inset, foot } = *placement;
        for value in origin.to_array() {
            finite("place of a shape, mm", value)?;
        }
        let off = rotation * rotation.transpose() - DMat3::IDENTITY;
        let off = off.to_cols_array().into_iter().fold(0.0, |max: f64, v| max.max(v.abs()));
        check(
            "deviation of a matrix from a rotation",
            off.max((rotation.determinant() - 1.0).abs()),
            "at most 1e-9",
            off <= 1e-9 && (rotation.determinant() - 1.0).abs() <= 1e-9,
        )?;
        let bounds = Bounds::union_of(members.iter().map(Shape::bounds));
        let Bounds { low, high } = bounds;
        for value in low.to_array().into_iter().chain(high.to_array()) {
            finite("end of a placed shape, mm", value)?;
        }
        let (middle, half) = (bounds.middle(), 0.5 * bounds.size());
        let mut scale = DVec3::ONE;
        for axis in 0..3 {
            if half[axis] > 0.0 {
                check(
                    "inset of a shape, mm",
                    inset,
                    "0 or more, and less than half its thickness",
                    inset >= 0.0 && inset < half[axis],
                )?;
                scale[axis] = 1.0 - inset / half[axis];
            }
        }
        let mut sunk = 0.0;
        if foot == Foot::Sunk {
            let tilts = [0, 1, 2].map(|axis| 1.0 - rotation.col(axis).z.abs());
            let upright = (0..3).find(|axis| tilts[*axis] < UPRIGHT);
            let min = tilts.into_iter().fold(f64::INFINITY, f64::min);
            let axis = upright.ok_or(Error::Number {
                what: "tilt of a shape whose foot is sunk".to_owned(),
                expected: "one axis upright",
                got: min,
            })?;
            // As high as before, and lower.
            scale[axis] = 1.0;
            sunk = inset;
        }
        let origin = origin + rotation * (middle - scale * middle) - DVec3::Z * sunk;
        let clips = Vec::new();
        let placed = Self { members, clips, closing, rotation, scale, origin, bounds };
        let corners = bounds.corners().map(|corner| placed.outwards(corner));
        Ok(Self { bounds: Bounds::of_points(corners), ..placed })
    }

    /// The part of the surface that all `clips` keep. It encloses nothing by itself.
    #[must_use]
    pub(super) fn clipped(&self, clips: Vec<Clip>) -> Self {
        Self { clips, ..self.clone() }
    }

    /// The same turned by a rotation about the origin of its body.
    pub(super) fn turned(&self, rotation: &DMat3) -> Result<Self, Error> {
        let clip = |clip: &Clip| Ok(Clip { solid: clip.solid.turned(rotation)?, ..clip.clone() });
        let turned = Self {
            clips: self.clips.iter().map(clip).collect::<Result<_, Error>>()?,
            rotation: *rotation * self.rotation,
            origin: *rotation * self.origin,
            ..self.clone()
        };
        let bounds = Bounds::union_of(self.members.iter().map(Shape::bounds));
        let corners = bounds.corners().map(|corner| turned.outwards(corner));
        Ok(Self { bounds: Bounds::of_points(corners), ..turned })
    }

    /// The same with all coordinates times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Result<Self, Error> {
        let clip = |clip: &Clip| {
            let reaches_mm = clip.reaches_mm.iter().map(|reach| factor * reach).collect();
            Ok(Clip { solid: clip.solid.scaled(factor)?, reaches_mm, ..*clip })
        };
        Ok(Self {
            clips: self.clips.iter().map(clip).collect::<Result<_, Error>>()?,
            scale: factor * self.scale,
            origin: factor * self.origin,
            bounds: Bounds { low: factor * self.bounds.low, high: factor * self.bounds.high },
            ..self.clone()
        })
    }

    pub(super) fn patches(&self) -> usize {
        if let [member] = &self.members[..] { member.patches() } else { 1 }
    }

    pub(super) fn patch(&self, primitive: u32) -> u32 {
        if let [member] = &self.members[..] { member.patch(primitive) } else { 0 }
    }

    /// A point of the members' frame in that of the body.
    #[inline]
    fn outwards(&self, local: DVec3) -> DVec3 {
        self.origin + self.rotation * (self.scale * local)
    }

    /// A point of the body's frame in that of the members.
    #[inline]
    fn inwards(&self, point: DVec3) -> DVec3 {
        self.turned_back(point - self.origin) / self.scale
    }

    #[inline]
    fn turned_back(&self, direction: DVec3) -> DVec3 {
        // The transpose of a rotation is its inverse.
        DVec3::new(
            self.rotation.x_axis.dot(direction),
            self.rotation.y_axis.dot(direction),
            self.rotation.z_axis.dot(direction),
        )
    }

    pub(super) fn intersect(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        if self.clips.is_empty() {
            return self.nearest(ray, reach, sides);
        }
        let mut reach = reach;
        loop {
            let hit = self.nearest(ray, reach, sides)?;
            let (at, normal) = self.settle(ray.at(hit.distance), hit.primitive);
            if self.clips.iter().all(|clip| clip.admits(at, normal)) {
                return Some(hit);
            }
            // Rounding may give the same crossing again.
            reach.from = hit.distance + SAME * self.bounds.farthest();
        }
    }

    /// The nearest hit on the whole surface.
    fn nearest(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        let along = self.turned_back(ray.direction) / self.scale;
        // Length in the members' frame per length in the body's.
        let stretch = along.length();
        let local = Ray { origin: self.inwards(ray.origin), direction: along / stretch };
        let mut within = Reach { from: reach.from * stretch, to: reach.to * stretch };
        let mut found = None;
        let count = self.members.len() as u32;
        for (number, member) in (0..).zip(&self.members) {
            if let Some(at) = member.intersect(&local, within, sides) {
                within.to = at.distance;
                found = Some(Intersection {
                    distance: at.distance / stretch,
                    primitive: at.primitive * count + number,
                    side: at.side,
                });
            }
        }
        found
    }

    pub(super) fn settle(&self, at: DVec3, primitive: u32) -> (DVec3, DVec3) {
        let count = self.members.len() as u32;
        let shape = &self.members[(primitive % count) as usize];
        let (local, normal) = shape.settle(self.inwards(at), primitive / count);
        // Normals transform with the inverse of the scale.
        let normal = self.rotation * (normal / self.scale);
        (self.outwards(local), normal.normalize())
    }

    #[inline]
    pub(super) fn is_smooth(&self) -> bool {
        self.members.iter().any(Shape::is_smooth)
    }

    pub(super) fn shading(&self, at: DVec3, primitive: u32, normal: DVec3) -> DVec3 {
        let count = self.members.len() as u32;
        let shape = &self.members[(primitive % count) as usize];
        if !shape.is_smooth() {
            return normal;
        }
        let own = (self.turned_back(normal) * self.scale).normalize();
        let local = shape.shading(self.inwards(at), primitive / count, own);
        (self.rotation * (local / self.scale)).normalize()
    }

    pub(super) fn frame(&self, point: DVec3, normal: DVec3) -> Frame {
        let local = self.members[0].frame(self.inwards(point), self.turned_back(normal));
        let b = normal.cross(self.rotation * local.t).normalize();
        Frame { t: b.cross(normal), b, n: normal }
    }

    pub(super) fn bounds(&self) -> Bounds {
        self.bounds
    }

    pub(super) fn closed(&self) -> bool {
        self.closing == Closing::Closed && self.clips.is_empty()
    }

    pub(super) fn convex(&self) -> bool {
        self.closed() && matches!(&self.members[..], [one] if one.convex())
    }

    /// Convex hulls of its members.
    pub(super) fn hulls(&self) -> Vec<Hull> {
        let matrix = self.rotation * DMat3::from_diagonal(self.scale);
        self.members
            .iter()
            .flat_map(Shape::hulls)
            .map(|hull| hull.within(matrix, self.origin))
            .collect()
    }

    /// Flat faces of its members.
    pub(super) fn faces(&self) -> Vec<Face> {
        let all = self.members.iter().flat_map(Shape::faces);
        let placed = |face: Face| Face {
            point: self.outwards(face.point),
            normal: (self.rotation * (face.normal / self.scale)).normalize(),
            corners: face.corners.map(|all| all.into_iter().map(|c| self.outwards(c)).collect()),
        };
        all.map(placed).collect()
    }

    /// True if its axis is the z axis.
    fn about_axis(&self) -> bool {
        self.origin.truncate() == glam::DVec2::ZERO
            && self.rotation.z_axis.truncate() == glam::DVec2::ZERO
    }

    /// True if it is a body of revolution about the z axis.
    pub(super) fn round(&self) -> bool {
        self.about_axis() && self.members.iter().all(Shape::round)
    }

    /// Distance from the z axis within which it lies: exact for bodies of revolution about that
    /// axis.
    pub(super) fn radius(&self) -> f64 {
        let about_axis = self.about_axis();
        let turned: Option<Vec<f64>> = self.members.iter().map(Shape::radius).collect();
        match turned {
            Some(radii) if about_axis => self.scale.x * radii.into_iter().fold(0.0, f64::max),
            _ => {
                let farthest = self.bounds.low.abs().max(self.bounds.high.abs());
                farthest.truncate().length()
            }
        }
    }

    /// Shows its flat faces to `see`, as [`Shape::facets`] does.
    pub(super) fn facets(&self, see: &mut dyn FnMut(u32, Facet)) {
        // All members are finite, so an infinite window passes over none of their faces.
        let all = Window {
            bounds: Bounds { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY },
            axis: 0,
            within: 0.0,
        };
        let alone = self.members.len() == 1;
        let mut moved = |patch: u32, facet: Facet| {
            let facet = match facet {
                Facet::Polygon(mut corners) => {
                    for corner in &mut corners {
                        *corner = self.outwards(*corner);
                    }
                    Facet::Polygon(corners)
                }
                // An inset scales a body of revolution evenly across its axis.
                Facet::Ring { centre, normal, inner, outer } => Facet::Ring {
                    centre: self.outwards(centre),
                    normal: self.rotation * normal,
                    inner: inner * self.scale.x,
                    outer: outer * self.scale.x,
                },
            };
            see(if alone { patch } else { 0 }, facet);
        };
        for member in &self.members {
            member.facets(&all, &mut moved);
        }
    }

    /// Edges from end to end, circles as chords.
    pub(crate) fn edges(&self) -> Vec<[DVec3; 2]> {
        self.members
            .iter()
            .flat_map(local_edges)
            .map(|ends| ends.map(|end| self.outwards(end)))
            .collect()
    }
}

/// The edges of a member in its own frame.
fn local_edges(shape: &Shape) -> Vec<[DVec3; 2]> {
    let circle = |[r, z]: [f64; 2]| {
        let at = move |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / CHORDS as f64).sin_cos();
            DVec3::new(r * cos, r * sin, z)
        };
        (0..CHORDS).filter(move |_| r > 0.0).map(move |k| [at(k), at(k + 1)])
    };
    match shape {
        Shape::Cuboid(cuboid) => cuboid.edges(),
        Shape::Mesh(mesh) => mesh.edges().collect(),
        Shape::Plane(plane) => plane.edges(),
        Shape::Placed(placed) => placed.edges(),
        Shape::Frustum(frustum) => frustum.ends().into_iter().flat_map(circle).collect(),
        Shape::Torus(torus) => torus.ends().into_iter().flat_map(circle).collect(),
        Shape::Revolution(revolution) => {
            let ends = revolution.frusta().iter().map(|frustum| frustum.ends()[1]);
            ends.flat_map(circle).collect()
        }
        Shape::Sphere(_) => Vec::new(),
    }
}
