// SPDX-License-Identifier: MIT OR Apache-2.0
//! A dome's section at the size that full wave can hold. Lengths in µm.

use anyhow::{Result, ensure};
use full_wave::Outline;
use geometry::profile::{Elements, Shape, SphericalDome};
use geometry::{BaseSurface, Curve, Meridian, Piece, Role, ring_cell};

/// Smooth surface that carries the relief.
#[derive(Clone, Debug)]
pub enum Base {
    /// Sphere on a cylinder.
    Sphere(SphericalDome),
    /// Stated curve.
    Curve(Meridian),
}

impl Base {
    fn surface(&self) -> BaseSurface<'_> {
        match self {
            Self::Sphere(sphere) => sphere.into(),
            Self::Curve(curve) => curve.into(),
        }
    }

    /// Height and largest radius, mm.
    fn size_mm(&self) -> [f64; 2] {
        match self {
            Self::Sphere(sphere) => [sphere.height_mm, sphere.radius_mm],
            Self::Curve(curve) => [curve.top_mm(), curve.radius_mm()],
        }
    }

    fn scaled(self, by: f64) -> Self {
        match self {
            Self::Sphere(SphericalDome { sphere_radius_mm, height_mm, radius_mm }) => {
                Self::Sphere(SphericalDome {
                    sphere_radius_mm: by * sphere_radius_mm,
                    height_mm: by * height_mm,
                    radius_mm: by * radius_mm,
                })
            }
            Self::Curve(meridian) => Self::Curve(meridian.scaled(by)),
        }
    }
}

/// Dome with relief, and what light meets in it.
#[derive(Clone, Debug)]
pub struct Section {
    base: Base,
    rings: Elements,
    /// Wavelength, µm.
    pub wavelength_um: f64,
    /// Index inside and outside.
    pub index: [f64; 2],
}

/// Line or arc of the section as rays meet it, by its ends in counter-clockwise order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Begin (x, z), µm.
    pub start: [f64; 2],
    /// End, µm.
    pub end: [f64; 2],
    /// Centre and radius of an arc. The normal out of the dome points away from the centre, or to it
    /// where the radius is negative.
    pub arc: Option<([f64; 2], f64)>,
    /// Ring, from 1, whose table scatters; rays of the geometry ignore it.
    pub ring: Option<usize>,
}

impl Section {
    /// The dome `base` with the shapes of `relief` from axis to rim, scaled so that `count` rings
    /// of `width_um` cover what the relief covers.
    ///
    /// # Errors
    /// No rings, or a dome that relief does not fit.
    pub fn new(
        base: &Base,
        relief: &Elements,
        count: usize,
        width_um: f64,
        wavelength_um: f64,
        index: [f64; 2],
    ) -> Result<Self> {
        let elements = relief.shapes.len();
        ensure!(elements > 0, "relief: expected the shape of a ring, got none");
        ensure!(count > 0, "rings: expected at least 1, got 0");
        ensure!(
            width_um.is_finite() && width_um > 0.0,
            "ring width: expected above 0 um, got {width_um}"
        );
        let scale = 1e-3 * width_um * count as f64 / (relief.width_mm * elements as f64);
        let base = base.clone().scaled(scale);
        // A ring takes the shape of the element at its share of the radius.
        let shape = |ring: usize| relief.shapes[(2 * ring + 1) * elements / (2 * count)].clone();
        let rings = Elements {
            width_mm: 1e-3 * width_um,
            shapes: (0..count).map(shape).collect(),
            rounding: relief.rounding,
        };
        let section = Self { base, rings, wavelength_um, index };
        section.meridian()?;
        Ok(section)
    }

    /// The same dome without relief.
    #[must_use]
    pub fn smooth(&self) -> Self {
        let shapes = vec![Shape::Smooth; self.rings()];
        Self { rings: Elements { shapes, ..self.rings.clone() }, ..self.clone() }
    }

    /// True for a dome without relief.
    pub fn is_smooth(&self) -> bool {
        self.rings.shapes.iter().all(|shape| *shape == Shape::Smooth)
    }

    /// Number of rings from axis to rim.
    pub fn rings(&self) -> usize {
        self.rings.shapes.len()
    }

    /// Width of a ring, µm.
    pub fn ring_width_um(&self) -> f64 {
        1e3 * self.rings.width_mm
    }

    /// Largest distance from the axis, µm.
    pub fn radius_um(&self) -> f64 {
        1e3 * self.base.size_mm()[1]
    }

    /// Height, µm.
    pub fn height_um(&self) -> f64 {
        1e3 * self.base.size_mm()[0]
    }

    fn meridian(&self) -> Result<Meridian> {
        Ok(Meridian::stepped(self.base.surface(), &self.rings)?)
    }

    /// The unit cell of a ring, from 1; none of a smooth one.
    ///
    /// # Errors
    /// Rounded corners that do not fit.
    pub fn cell(&self, ring: usize) -> Result<Option<geometry::Cell>> {
        let cell = ring_cell(self.base.surface(), &self.rings, ring, self.index[0])?;
        Ok(cell.map(|cell| cell.within(self.index[1])))
    }

    /// The outline of the relief for full wave, from the mirror on the right to that on the left.
    ///
    /// # Errors
    /// Relief that crosses itself.
    pub fn outline(&self) -> Result<Outline> {
        let pieces = self.meridian()?.pieces;
        let end = pieces.last().map_or([0.0; 2], |piece| piece.end);
        let turn = |piece: &Piece| match piece.curve {
            Curve::Line => 0.0,
            // Travelled the other way.
            Curve::Arc { .. } | Curve::Bend { clockwise: true, .. } => piece.sweep(),
            Curve::Bend { clockwise: false, .. } => -piece.sweep(),
        };
        let um = |[r, z]: [f64; 2], side: f64| [1e3 * side * r, 1e3 * z];
        let mut outline = Outline::on_mirror(um(end, 1.0));
        for piece in pieces.iter().rev() {
            outline = outline.arc_to(um(piece.start, 1.0), turn(piece));
        }
        for piece in &pieces {
            outline = outline.arc_to(um(piece.end, -1.0), turn(piece));
        }
        Ok(outline)
    }

    /// The surfaces of the relief itself.
    ///
    /// # Errors
    /// Relief that crosses itself.
    pub fn relief(&self) -> Result<Vec<Surface>> {
        Ok(surfaces(&self.meridian()?))
    }

    /// The smooth surface in bands, one a ring.
    pub fn bands(&self) -> Vec<Surface> {
        let ends: Vec<f64> =
            (1..=self.rings()).map(|ring| self.rings.width_mm * ring as f64).collect();
        surfaces(&Meridian::banded(self.base.surface(), &ends))
    }
}

fn surfaces(meridian: &Meridian) -> Vec<Surface> {
    let um = |[r, z]: [f64; 2], side: f64| [1e3 * side * r, 1e3 * z];
    let mut surfaces = Vec::new();
    for piece in &meridian.pieces {
        let ring = match piece.role {
            Role::Element(ring) => Some(ring),
            Role::Rest | Role::Cylinder | Role::Stated => None,
        };
        for side in [1.0, -1.0] {
            let arc = match piece.curve {
                Curve::Line => None,
                Curve::Arc { radius_mm, centre_mm } => {
                    Some((um([0.0, centre_mm], side), 1e3 * radius_mm))
                }
                Curve::Bend { radius_mm, centre_mm, clockwise } => {
                    let outward = if clockwise { 1e3 } else { -1e3 };
                    Some((um(centre_mm, side), outward * radius_mm))
                }
            };
            let (from, to) = (um(piece.start, side), um(piece.end, side));
            let (start, end) = if side > 0.0 { (to, from) } else { (from, to) };
            surfaces.push(Surface { start, end, arc, ring });
        }
    }
    surfaces
}
