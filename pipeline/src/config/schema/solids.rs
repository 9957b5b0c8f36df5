// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]` as written.

use bsdf::LobeMotion;
use serde::{Deserialize, Serialize};

use super::films::{Layer, Substrate};
use super::{Reflection, Silicone, is_default};

/// `[[solids]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Solid {
    /// Its name in the ledger, as a surface and as a medium.
    pub name: String,
    /// What it is.
    pub kind: SolidKind,
    /// Whether every package carries it or it stands once.
    #[serde(default, skip_serializing_if = "is_default")]
    pub per: Per,
    /// Its place, mm: the middle; of a meridian or a mesh the origin of its coordinates.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact",
        default,
        skip_serializing_if = "is_default"
    )]
    pub position_mm: [f64; 3],
    /// Box, rectangle, mesh: turned about x, then y, then z by these angles, degrees.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub rotation_deg: Option<[f64; 3]>,
    /// Cylinder, meridian, disc: direction of the axis, of any length; +z if absent.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub axis: Option<[f64; 3]>,
    /// Box: lengths along x, y and z; rectangle: along x and y, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_mm: Option<Vec<f64>>,
    /// Cylinder, sphere, disc, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// Cylinder: length along the axis, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_mm: Option<f64>,
    /// Meridian: rows as of `dome.meridian_mm`, from the axis back to the axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meridian_mm: Option<Vec<Vec<f64>>>,
    /// Meridian: a file of such rows, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meridian_file: Option<String>,
    /// Mesh: an STL or OBJ file, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Mesh: unit of the lengths in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_unit: Option<String>,
    /// What it is of, if light enters it; keys of `[silicone]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub medium: Option<Silicone>,
    /// Thin layers on it, from its inside outwards, where light enters it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<Layer>,
    /// What its surface does by a file, where light enters it; of a sheet, what it does to light from either side.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<SolidScatter>,
    /// What it does with light that does not enter it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SolidSurface>,
}

/// Kinds of solids and sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SolidKind {
    /// A box.
    Box,
    /// A cylinder with both ends.
    Cylinder,
    /// A ball.
    Sphere,
    /// A body of revolution by its generating curve.
    Meridian,
    /// A closed mesh of triangles.
    Mesh,
    /// A flat rectangle without thickness.
    Rectangle,
    /// A flat disc without thickness.
    Disc,
}

impl SolidKind {
    /// Whether it is a sheet, without an inside.
    pub fn is_sheet(self) -> bool {
        matches!(self, Self::Rectangle | Self::Disc)
    }
}

impl Solid {
    /// The key that says how large it is, and what stands there; of a meridian or a mesh its place.
    pub fn size(&self) -> (&'static str, String) {
        match (self.size_mm.as_deref(), self.radius_mm) {
            (Some(size), _) => ("size_mm", format!("{size:?}")),
            (None, Some(radius)) => ("radius_mm", radius.to_string()),
            (None, None) => ("position_mm", format!("{:?}", self.position_mm)),
        }
    }
}

/// How often a solid stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Per {
    /// In every package, in its coordinates.
    #[default]
    Package,
    /// Once, in the coordinates of the array.
    Array,
}

/// `[solids.scatter]`: as of `[[files.bands]]`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolidScatter {
    /// A file that says itself which side is meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Zemax files for light from the inner side.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inner: Vec<String>,
    /// Zemax files for light from the outer side.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outer: Vec<String>,
    /// How lobes move between the incidences of the files.
    pub between: LobeMotion,
}

/// `[solids.surface]`: as of `[mirror]` and of `[files.mirror]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SolidSurface {
    /// Law of reflection.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<Reflection>,
    /// Reflectance, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<f64>,
    /// Mixed: share of what is reflected that goes on as from a mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular_fraction: Option<f64>,
    /// The metal of a specular one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub substrate: Option<Substrate>,
    /// Thin layers on the metal, from the light towards it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<Layer>,
    /// A file by which it reflects instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// How lobes move between the incidences of the file.
    #[serde(default, skip_serializing_if = "is_default")]
    pub between: LobeMotion,
}
