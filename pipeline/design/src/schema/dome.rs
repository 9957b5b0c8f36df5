// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[dome]` and `[elements]` as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use geometry::profile::Reference;

use super::films::Layer;
use super::{NoKeys, is_default};
use crate::tagged::{Kinds, Tagged};
use runtime::serde_arrays::List;

/// `[dome]`: truncated sphere on a short cylinder, a curve point by point, or a mesh.
pub type Dome = Tagged<DomeKeys, DomeForm>;

/// Keys of all domes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DomeKeys {
    /// Thin layers on dome and cylinder, from the silicone outwards.
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
    /// Radius R of the sphere, mm; 1e-6 to 10 000.
    pub sphere_radius_mm: f64,
    /// Height H of the pole above the bottom, mm; 1e-6 to 10 000, at most 2R.
    pub height_mm: f64,
    /// Diameter, mm; 1e-6 to 10 000. The sphere is still above the bottom there.
    pub width_mm: f64,
}

/// Keys of a generating curve.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeridianDome {
    /// Generating curve from the axis outwards and down, mm: 2 to 4001 rows, as below.
    pub meridian_mm: Vec<Vec<f64>>,
    /// Curve along y of a dome that is not round, rows likewise; `meridian_mm` is then the one along
    /// x, and ellipses lie between.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meridian_y_mm: Option<Vec<Vec<f64>>>,
}

/// Keys of a generating curve in a file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeridianFileDome {
    /// Text file of such rows: commas, semicolons or spaces between numbers, `#` for comments, a
    /// heading allowed.
    pub meridian_file: String,
    /// File of the curve along y of a dome that is not round, as `meridian_y_mm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meridian_y_file: Option<String>,
}

/// Keys of a mesh.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshDome {
    /// STL (binary or text) or OBJ file: a closed solid about the z axis that stands on z = 0,
    /// holds the LED's box and carries no `[elements]`. Triangles in z = 0 are the mirror under it.
    pub mesh: String,
    /// Unit of the lengths in it.
    pub mesh_unit: MeshUnit,
    /// Smooth normals: at a corner the mean of those faces about it that turn by at most this from the
    /// face met, linear between corners; 0 to 90 degrees. Default flat faces.
    pub smooth_deg: Option<f64>,
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
    /// Number of elements, 1 to 2000; at most as far as the dome is a function z(r).
    pub count: usize,
    /// Radial width of each, µm; 0.001 to 1e7.
    pub width_um: f64,
    /// Radius of corners that point away from the silicone, µm; 0 to 1e7. Default 0, sharp.
    #[serde(default, skip_serializing_if = "is_default")]
    pub tip_radius_um: f64,
    /// Radius of corners that point into the silicone, also between elements, µm; 0 to 1e7. Default
    /// 0, sharp.
    #[serde(default, skip_serializing_if = "is_default")]
    pub valley_radius_um: f64,
    /// Tables `[[elements.shapes]]`, which give every element exactly one shape.
    pub shapes: Vec<Shape>,
}

/// `[[elements.shapes]]`: the shape of the elements `from..=to`.
pub type Shape = Tagged<ShapeKeys, ShapeForm>;

/// Keys of all shapes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeKeys {
    /// First element of this shape, from 1.
    pub from: usize,
    /// Last element of this shape, at most `count`.
    pub to: usize,
}

/// Kinds of cross-section.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ShapeForm {
    /// Level tread at the height of the inner end, upright riser at the outer end; not where a
    /// curve rises outwards.
    #[serde(rename = "OS1")]
    Os1(NoKeys),
    /// Triangle on the chord, by two of its three angles.
    Triangle(TriangleShape),
    /// Open polygon on the chord.
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
    /// Interior angle at the base corner nearer the axis, degrees; above 0, below 180. With
    /// `reference = "horizontal"` above -90, if the side falls less steeply than the dome.
    pub inner_base_angle_deg: Option<f64>,
    /// Interior angle at the apex, degrees; above 0, below 180.
    pub apex_angle_deg: Option<f64>,
    /// Interior angle at the base corner farther out, degrees; as the inner one.
    pub outer_base_angle_deg: Option<f64>,
    /// Line from which angles at the base are measured; the outer side stays steeper than the dome.
    #[serde(default)]
    pub reference: Reference,
}

/// Keys of a polygon.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolylineShape {
    /// Vertices [along, above] the chord between the inner corner [0, 0] and the outer corner [1,
    /// 0], in chords; above it, at most 2 chords wide.
    pub points_chords: Vec<List<f64, 2>>,
}
