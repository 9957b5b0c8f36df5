// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bodies of a design by their exact forms, as CAD formats take them.

use glam::{DMat3, DVec3};

use anyhow::{Context, Result};
use geometry::{Curve, Meridian, Piece, Role};

use super::mesh::{Mesh, cuboid, revolved};

/// Name of the dome.
pub const DOME: &str = "dome";

/// A body, and where it stands.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name.
    pub name: String,
    /// Form in its own coordinates.
    pub form: Form,
    /// Rotation from its own coordinates.
    pub rotation: DMat3,
    /// Places of its origin, one for each copy, mm.
    pub places: Vec<DVec3>,
}

/// Form of a body, mm.
#[derive(Debug, Clone)]
pub enum Form {
    /// Turned about z; a curve that ends off the axis is closed by the plane of its end.
    Revolved(Meridian),
    /// Corners of a body with six flat faces, the bits of their numbers low or high along its x, y
    /// and z.
    Box([DVec3; 8]),
    /// Flat triangles.
    Mesh(Mesh),
    /// Half lengths of a rectangle in z = 0, a sheet.
    Rectangle([f64; 2]),
    /// Radius of a disc in z = 0, a sheet.
    Disc(f64),
}

impl Form {
    /// A box about the origin, or one that stands on it.
    pub fn cuboid(low: DVec3, high: DVec3) -> Self {
        let side = |k: usize, bit: usize| if k >> bit & 1 == 1 { high[bit] } else { low[bit] };
        Self::Box(std::array::from_fn(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))))
    }

    /// A ball about the origin.
    pub fn ball(radius_mm: f64) -> Self {
        let curve = Curve::Arc { radius_mm, centre_mm: 0.0 };
        let (start, end) = ([0.0, radius_mm], [0.0, -radius_mm]);
        Self::Revolved(Meridian { pieces: vec![Piece { start, end, curve, role: Role::Stated }] })
    }

    /// A cylinder about the origin.
    pub fn cylinder(radius_mm: f64, half_mm: f64) -> Self {
        let rows = [[0.0, half_mm], [radius_mm, half_mm], [radius_mm, -half_mm], [0.0, -half_mm]];
        let piece = |ends: &[[f64; 2]]| Piece {
            start: ends[0],
            end: ends[1],
            curve: Curve::Line,
            role: Role::Stated,
        };
        Self::Revolved(Meridian { pieces: rows.windows(2).map(piece).collect() })
    }
}

impl Body {
    /// The same with all lengths times `factor` about the origin; its places as well.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        self.form = match self.form {
            Form::Revolved(meridian) => Form::Revolved(meridian.scaled(factor)),
            Form::Box(corners) => Form::Box(corners.map(|corner| factor * corner)),
            Form::Mesh(mut mesh) => {
                mesh.vertices.iter_mut().flatten().for_each(|along| *along *= factor);
                Form::Mesh(mesh)
            }
            Form::Rectangle(half) => Form::Rectangle(half.map(|length| factor * length)),
            Form::Disc(radius) => Form::Disc(factor * radius),
        };
        self.places.iter_mut().for_each(|place| *place *= factor);
        self
    }

    /// True for a sheet, which encloses nothing.
    pub fn is_sheet(&self) -> bool {
        matches!(self.form, Form::Rectangle(_) | Form::Disc(_))
    }

    /// Triangles of its first copy within `error_mm` of the true surface; none of a sheet.
    ///
    /// # Errors
    /// An error that is not positive, or so small that the mesh would have too many triangles.
    pub fn mesh(&self, error_mm: f64) -> Result<Option<Mesh>> {
        let name = &self.name;
        let mut mesh = match &self.form {
            Form::Revolved(meridian) => revolved(name, meridian, error_mm)?,
            Form::Box(corners) => cuboid(name, corners.map(|corner| corner.to_array())),
            Form::Mesh(mesh) => mesh.clone(),
            Form::Rectangle(_) | Form::Disc(_) => return Ok(None),
        };
        let place = self.places.first().with_context(|| format!("{name}: expected a place"))?;
        if self.rotation != DMat3::IDENTITY || *place != DVec3::ZERO {
            for vertex in &mut mesh.vertices {
                *vertex = (*place + self.rotation * DVec3::from_array(*vertex)).to_array();
            }
        }
        Ok(Some(mesh))
    }
}
