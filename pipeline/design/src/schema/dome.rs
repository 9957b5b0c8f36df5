// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[dome]` and `[elements]` as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use geometry::profile::Reference;

use super::films::Layer;
use super::{NoKeys, is_default};
use crate::serde_arrays::List;
use crate::tagged::{Kinds, Tagged};

/// `[dome]`: truncated sphere on a short cylinder, a curve point by point, or a mesh.
pub type Dome = Tagged<DomeKeys, DomeForm>;

/// Keys of all domes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DomeKeys {
    /// Thin layers on it, from the silicone outwards.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<Layer>,
}

/// Kinds of dome, which are told by their keys.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DomeForm {
    /// A truncated sphere on a cylinder.
    Sphere(SphereDome),
    /// A generating curve in the design.
    Meridian(MeridianDome),
    /// A generating curve in a file.
    MeridianFile(MeridianFileDome),
    /// A closed mesh.
    Mesh(MeshDome),
}

impl Kinds for DomeForm {
    // No key of a table.
    const TAG: &'static str = "";

    fn untagged(keys: &dyn Fn(&str) -> bool) -> Option<&'static str> {
        let kinds =
            [("meridian_mm", "meridian"), ("meridian_file", "meridian_file"), ("mesh", "mesh")];
        let told = kinds.into_iter().find(|(key, _)| keys(key));
        Some(told.map_or("sphere", |(_, kind)| kind))
    }
}

/// Keys of a sphere on a cylinder.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereDome {
    /// Radius of the sphere, mm.
    pub sphere_radius_mm: f64,
    /// Height of the pole above the bottom, mm.
    pub height_mm: f64,
    /// Overall width (diameter), mm.
    pub width_mm: f64,
}

/// Keys of a generating curve.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeridianDome {
    /// The curve from the axis outwards and down: rows [r, z], [r, z, bulge] or
    /// [r, z, centre r, centre z], mm.
    pub meridian_mm: Vec<Vec<f64>>,
}

/// Keys of a generating curve in a file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeridianFileDome {
    /// A file of rows as of `meridian_mm`, relative to the design file.
    pub meridian_file: String,
}

/// Keys of a mesh.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshDome {
    /// A closed mesh, STL or OBJ, relative to the design file.
    pub mesh: String,
    /// The unit of its lengths.
    pub mesh_unit: MeshUnit,
}

/// Units of the lengths of a mesh, whose file does not say its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MeshUnit {
    /// Micrometre.
    Um,
    /// Millimetre.
    Mm,
    /// Centimetre.
    Cm,
    /// Metre.
    M,
    /// Inch.
    Inch,
}

impl MeshUnit {
    /// The unit in mm.
    pub fn mm(self) -> f64 {
        match self {
            Self::Um => 1e-3,
            Self::Mm => 1.0,
            Self::Cm => 10.0,
            Self::M => 1e3,
            Self::Inch => 25.4,
        }
    }
}

/// `[elements]`: concentric rings of relief, numbered from the axis outwards.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Elements {
    /// Number of elements.
    pub count: usize,
    /// Radial width of each, µm.
    pub width_um: f64,
    /// Radius of corners that point away from the silicone, µm; 0 is sharp.
    #[serde(default, skip_serializing_if = "is_default")]
    pub tip_radius_um: f64,
    /// Radius of corners that point into it, those between elements among them, µm; 0 is sharp.
    #[serde(default, skip_serializing_if = "is_default")]
    pub valley_radius_um: f64,
    /// Which shape stands where.
    pub shapes: Vec<Shape>,
}

/// `[[elements.shapes]]`: the shape of the elements `from..=to`.
pub type Shape = Tagged<ShapeKeys, ShapeForm>;

/// Keys of all shapes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeKeys {
    /// First element, from 1.
    pub from: usize,
    /// Last element, included.
    pub to: usize,
}

/// Kinds of cross-section.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ShapeForm {
    /// Horizontal tread and vertical riser.
    #[serde(rename = "OS1")]
    Os1(NoKeys),
    /// Triangle standing on the chord of the element.
    Triangle(TriangleShape),
    /// Any open polygon standing on the chord.
    Polyline(PolylineShape),
    /// The dome as it is.
    Smooth(NoKeys),
}

impl Kinds for ShapeForm {
    const TAG: &'static str = "type";
}

/// Keys of a triangle: two of its three angles.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TriangleShape {
    /// Interior angle at the base corner nearer the axis, degrees.
    pub inner_base_angle_deg: Option<f64>,
    /// Interior angle at the apex, degrees.
    pub apex_angle_deg: Option<f64>,
    /// Interior angle at the base corner farther out, degrees.
    pub outer_base_angle_deg: Option<f64>,
    /// The line from which angles at the base are measured.
    #[serde(default)]
    pub reference: Reference,
}

/// Keys of a polygon.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolylineShape {
    /// Vertices between the base corners, (along the chord, above it), in chords.
    pub points_chords: Vec<List<f64, 2>>,
}
