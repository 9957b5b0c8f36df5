// SPDX-License-Identifier: MIT OR Apache-2.0
//! Profiles of a dome and of the rings of relief on it.
//!
//! In a design file they are `[dome]` and `[elements]`; here lengths are in one unit and nothing is
//! open.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Tolerance for lengths that must agree, relative.
pub const SAME_LENGTH: f64 = 1e-9;

/// Truncated sphere z(r) = √(R² - r²) - (R - H) on a short cylinder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SphericalDome {
    /// Radius R of the sphere, mm.
    pub sphere_radius_mm: f64,
    /// Height H of the pole, mm.
    pub height_mm: f64,
    /// Largest radius, mm.
    pub radius_mm: f64,
}

impl SphericalDome {
    /// Height of the sphere at radius `r_mm` from the axis, mm.
    pub fn height_at(&self, r_mm: f64) -> f64 {
        (self.sphere_radius_mm.powi(2) - r_mm.powi(2)).max(0.0).sqrt() + self.centre_mm()
    }

    /// Height of the sphere's centre, mm (usually negative).
    pub fn centre_mm(&self) -> f64 {
        self.height_mm - self.sphere_radius_mm
    }
}

/// Rings of relief of one width.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Elements {
    /// Radial width, mm.
    pub width_mm: f64,
    /// Shapes from the axis outwards.
    pub shapes: Vec<Shape>,
    /// Radii of their corners: those of the tool, whatever the width of a ring.
    #[serde(skip_serializing_if = "Rounding::is_sharp")]
    pub rounding: Rounding,
}

/// Radii of the corners of relief; 0 is sharp.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Rounding {
    /// Of corners that point away from the silicone, mm.
    pub tip_mm: f64,
    /// Of corners that point into it, those between neighbouring elements among them, mm.
    pub valley_mm: f64,
}

impl Rounding {
    /// Whether all corners are sharp.
    pub fn is_sharp(&self) -> bool {
        *self == Self::default()
    }
}

impl Elements {
    /// The same relief in rings of `width_mm`: each ring takes the shape of the element it lies in,
    /// and the radii as they are.
    /// `None` if the width does not divide that of an element.
    pub fn refined(&self, width_mm: f64) -> Option<Self> {
        let ratio = (self.width_mm / width_mm).round();
        if ratio < 1.0 || (ratio * width_mm / self.width_mm - 1.0).abs() > SAME_LENGTH {
            return None;
        }
        let shapes = self
            .shapes
            .iter()
            .flat_map(|s| std::iter::repeat_n(s.clone(), ratio as usize))
            .collect();
        Some(Self { width_mm, shapes, rounding: self.rounding })
    }
}

/// Cross-section of one element, standing on its chord.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Shape {
    /// Horizontal tread, vertical riser.
    Os1,
    /// Triangle on the chord.
    Triangle {
        /// Angle at the base corner nearer the axis, degrees.
        inner_base_deg: f64,
        /// Interior angle at the apex, degrees.
        apex_deg: f64,
        /// Line from which the base angle is measured.
        reference: Reference,
    },
    /// Vertices between the base corners, in chords.
    Polyline(Vec<[f64; 2]>),
    /// The sphere itself.
    Smooth,
}

/// Lines from which the angles at the base of a triangle are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Reference {
    /// The chord of the element.
    #[default]
    Chord,
    /// The horizontal.
    Horizontal,
}
