// SPDX-License-Identifier: MIT OR Apache-2.0
//! The dome of a checked design: a sphere, a generating curve or a mesh.

use glam::{DMat3, DVec3};
use serde::Serialize;
use tracer::Shape;

use geometry::profile::{Elements, SphericalDome};
use geometry::tessellation::Deviation;
use geometry::{BaseSurface, GeometryError, Meridian};

/// A dome, by what states its surface.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum Dome {
    /// A sphere on a cylinder, which may carry relief.
    Sphere(SphericalDome),
    /// A generating curve, which may carry relief as far as it is a function z(r).
    Meridian(Meridian),
    /// A closed mesh of triangles, also in the place of an oval surface.
    Mesh(Box<DomeMesh>),
}

impl Dome {
    /// Height above the bottom, mm.
    pub fn height_mm(&self) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.height_mm,
            Self::Meridian(meridian) => meridian.top_mm(),
            Self::Mesh(mesh) => mesh.height_mm,
        }
    }

    /// Largest distance from the axis, mm.
    pub fn radius_mm(&self) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.radius_mm,
            Self::Meridian(meridian) => meridian.radius_mm(),
            Self::Mesh(mesh) => mesh.radius_mm,
        }
    }

    /// Largest |x| (`axis` 0) or |y| from the axis in a package turned by `turn_deg`, mm.
    pub fn reach_mm(&self, axis: usize, turn_deg: f64) -> f64 {
        let Self::Mesh(dome) = self else { return self.radius_mm() };
        let Shape::Mesh(mesh) = &dome.shape else { return dome.radius_mm };
        let along = DMat3::from_rotation_z(turn_deg.to_radians()).row(axis);
        let reach = |corner: &DVec3| along.dot(*corner).abs();
        mesh.solid().0.iter().map(reach).fold(0.0, f64::max)
    }

    /// The sphere, if it is one.
    pub fn sphere(&self) -> Option<&SphericalDome> {
        match self {
            Self::Sphere(sphere) => Some(sphere),
            Self::Meridian(_) | Self::Mesh(_) => None,
        }
    }

    /// The smooth surface that may carry relief; none of a mesh.
    pub fn base(&self) -> Option<BaseSurface<'_>> {
        match self {
            Self::Sphere(sphere) => Some(sphere.into()),
            Self::Meridian(meridian) => Some(meridian.into()),
            Self::Mesh(_) => None,
        }
    }

    /// The generating curve of the surface with `relief` on it; without pieces for a mesh.
    ///
    /// # Errors
    /// Relief that crosses itself or leaves the half-plane, radii of corners that do not fit.
    pub fn outline(&self, relief: &Elements) -> Result<Meridian, GeometryError> {
        match self {
            Self::Sphere(sphere) => Meridian::stepped(sphere, relief),
            Self::Meridian(meridian) if relief.shapes.is_empty() => Ok(meridian.clone()),
            Self::Meridian(meridian) => Meridian::stepped(meridian, relief),
            Self::Mesh(_) => Ok(Meridian { pieces: Vec::new() }),
        }
    }
}

/// The solid of a dome.
#[derive(Debug, Clone, Serialize)]
pub struct DomeMesh {
    /// Name in the design; none of an oval dome.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Hexadecimal SHA-256 of the file, or of two meridians.
    pub sha256: String,
    /// Height of the highest corner, mm.
    pub height_mm: f64,
    /// Distance of the outermost corner from the axis, mm.
    pub radius_mm: f64,
    /// Number of triangles.
    pub triangles: usize,
    /// Largest angle between faces whose edge is smooth, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smooth_deg: Option<f64>,
    /// What triangles are off an oval dome.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation: Option<Deviation>,
    /// Part 0 is the dome, part 1 the bottom.
    #[serde(skip)]
    pub shape: Shape,
}

impl DomeMesh {
    /// True if the upper corners of a box on the bottom, centred on the axis, lie within.
    pub fn holds_box(&self, size_mm: [f64; 2], height_mm: f64) -> bool {
        let [x, y] = size_mm.map(|length| 0.5 * length);
        [[x, y], [-x, y], [-x, -y], [x, -y]]
            .into_iter()
            .all(|[x, y]| self.shape.holds(DVec3::new(x, y, height_mm)))
    }

    /// The closed lines (x, z) in which the plane y = 0 cuts it in a turned package, mm.
    pub fn section(&self, turn_deg: f64) -> Vec<Vec<[f64; 2]>> {
        let Shape::Mesh(mesh) = &self.shape else {
            return Vec::new();
        };
        let turn = DMat3::from_rotation_z(turn_deg.to_radians());
        let lines = mesh.section(DVec3::ZERO, turn.transpose() * DVec3::Y).into_iter();
        let flat = |at: DVec3| [(turn * at).x, at.z];
        lines.map(|line| line.into_iter().map(flat).collect()).collect()
    }
}
