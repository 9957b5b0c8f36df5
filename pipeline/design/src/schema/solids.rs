// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]` as written.

use bsdf::LobeMotion;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::files::lobe_motion;
use super::films::Layer;
use super::reflectors::{Absorbing, Law, Metal, Reflectance, SpecularAndDiffuse};
use super::{MeshUnit, NoKeys, Silicone, is_default};
use crate::serde_arrays::List;
use crate::tagged::{Kinds, Tagged};

/// `[[solids]]`.
pub type Solid = Tagged<SolidKeys, SolidForm>;

/// Keys of all solids and sheets.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidKeys {
    /// Its name in the ledger, as a surface and as a medium.
    pub name: String,
    /// Whether every package carries it or it stands once.
    #[serde(default, skip_serializing_if = "is_default")]
    pub per: Per,
    /// Its place, mm: the middle; of a meridian or a mesh the origin of its coordinates.
    #[serde(default, skip_serializing_if = "is_default")]
    pub position_mm: List<f64, 3>,
    /// What it stands on without a gap, where light enters it.
    pub optical_contact: Option<OpticalContact>,
    /// What it is of, if light enters it; keys of `[silicone]`.
    pub medium: Option<Silicone>,
    /// Thin layers on it, from its inside outwards, where light enters it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<Layer>,
    /// What its surface does by a file or a formula, where light enters it; of a sheet, what it
    /// does to light from either side.
    pub scatter: Option<SolidScatter>,
    /// What it does with light that does not enter it.
    pub surface: Option<SolidSurface>,
}

/// Kinds of solids and sheets.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SolidForm {
    /// A box.
    Box(Flat<3>),
    /// A cylinder with both ends.
    Cylinder(Cylinder),
    /// A ball.
    Sphere(Ball),
    /// A body of revolution by its generating curve.
    Meridian(SolidMeridian),
    /// A closed mesh of triangles.
    Mesh(SolidMesh),
    /// A flat rectangle without thickness.
    Rectangle(Flat<2>),
    /// A flat disc without thickness.
    Disc(Disc),
}

impl Kinds for SolidForm {
    const TAG: &'static str = "kind";
}

/// Keys of a box and of a rectangle.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Flat<const N: usize> {
    /// Lengths along x, y and, of a box, z, mm.
    pub size_mm: List<f64, N>,
    /// Turned about x, then y, then z by these angles, degrees.
    pub rotation_deg: Option<List<f64, 3>>,
}

/// Keys of a cylinder.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Length along the axis, mm.
    pub height_mm: f64,
    /// Direction of the axis, of any length; +z if absent.
    pub axis: Option<List<f64, 3>>,
}

/// Keys of a sphere.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// Radius, mm.
    pub radius_mm: f64,
}

/// Keys of a body of revolution.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidMeridian {
    /// Rows as of `dome.meridian_mm`, from the axis back to the axis.
    pub meridian_mm: Option<Vec<Vec<f64>>>,
    /// A file of such rows, relative to the design file.
    pub meridian_file: Option<String>,
    /// Direction of the axis, of any length; +z if absent.
    pub axis: Option<List<f64, 3>>,
}

/// Keys of a mesh.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidMesh {
    /// An STL or OBJ file, relative to the design file.
    pub mesh: String,
    /// Unit of the lengths in it.
    pub mesh_unit: MeshUnit,
    /// Turned about x, then y, then z by these angles, degrees.
    pub rotation_deg: Option<List<f64, 3>>,
}

/// Keys of a disc.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Direction of the axis, of any length; +z if absent.
    pub axis: Option<List<f64, 3>>,
}

impl SolidForm {
    /// Whether it is a sheet, without an inside.
    pub fn is_sheet(&self) -> bool {
        matches!(self, Self::Rectangle(_) | Self::Disc(_))
    }

    /// The name of the kind.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Box(_) => "box",
            Self::Cylinder(_) => "cylinder",
            Self::Sphere(_) => "sphere",
            Self::Meridian(_) => "meridian",
            Self::Mesh(_) => "mesh",
            Self::Rectangle(_) => "rectangle",
            Self::Disc(_) => "disc",
        }
    }
}

impl Solid {
    /// The key that says how large it is, and what stands there; of a meridian or a mesh its place.
    pub fn size(&self) -> (&'static str, String) {
        let radius = |radius: f64| ("radius_mm", radius.to_string());
        match &self.kind {
            SolidForm::Box(flat) => ("size_mm", format!("{:?}", flat.size_mm.0)),
            SolidForm::Rectangle(flat) => ("size_mm", format!("{:?}", flat.size_mm.0)),
            SolidForm::Cylinder(cylinder) => radius(cylinder.radius_mm),
            SolidForm::Sphere(ball) => radius(ball.radius_mm),
            SolidForm::Disc(disc) => radius(disc.radius_mm),
            SolidForm::Meridian(_) | SolidForm::Mesh(_) => ("position_mm", self.place()),
        }
    }

    /// Where it stands, as messages show it.
    pub fn place(&self) -> String {
        format!("{:?}", self.shared.position_mm.0)
    }
}

/// How often a solid stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Per {
    /// In every package, in its coordinates.
    #[default]
    Package,
    /// Once, in the coordinates of the array.
    Array,
}

/// What a solid is in optical contact with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OpticalContact {
    /// The bottom, z = 0: the mirror or the floor there.
    Bottom,
}

/// `[solids.scatter]`.
pub type SolidScatter = Tagged<NoKeys, ScatterLaw>;

/// What the surface of a solid with a medium, or a sheet, does with light from either side.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ScatterLaw {
    /// As files say.
    File(ScatterFiles),
    /// Stated shares by the cosine law.
    Lambertian(DiffuseShares),
    /// Stated shares in Gaussian lobes.
    Gaussian(GaussianShares),
}

impl Kinds for ScatterLaw {
    const TAG: &'static str = "kind";

    fn untagged(keys: &dyn Fn(&str) -> bool) -> Option<&'static str> {
        ["file", "inner", "outer"].into_iter().any(keys).then_some("file")
    }
}

/// Keys of scattering by files, as of `[[files.bands]]`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ScatterFiles {
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
    #[schemars(schema_with = "lobe_motion")]
    pub between: LobeMotion,
}

/// Keys of a Lambertian diffuser.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiffuseShares {
    /// Share of the incident power that is transmitted, 0 to 1.
    pub transmitted: f64,
    /// Share that is reflected, 0 to 1; what both leave is absorbed.
    pub reflected: f64,
}

/// Keys of a Gaussian diffuser.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaussianShares {
    /// Share of the incident power that is transmitted, 0 to 1.
    pub transmitted: f64,
    /// Share that is reflected, 0 to 1; what both leave is absorbed.
    pub reflected: f64,
    /// Full width at half maximum of the intensity, degrees.
    pub width_deg: f64,
    /// That of the reflected light; as of the transmitted light if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflected_width_deg: Option<f64>,
}

/// `[solids.surface]`: as of `[mirror]` and of `[files.mirror]`.
pub type SolidSurface = Tagged<NoKeys, SurfaceLaw>;

/// What a solid does with light that does not enter it.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SurfaceLaw {
    /// Mirror, of metal where layers or a substrate are given.
    Specular(Metal),
    /// Cosine law.
    Lambertian(Reflectance),
    /// Not at all.
    Absorbing(Absorbing),
    /// Partly as a mirror, partly by the cosine law.
    Mixed(SpecularAndDiffuse),
    /// As a file says.
    File(ReflectorFile),
}

impl SurfaceLaw {
    /// The law of reflection, or the file that stands for one.
    pub fn law(&self) -> Result<Law<Metal>, &ReflectorFile> {
        match self {
            Self::Specular(metal) => Ok(Law::Specular(metal.clone())),
            Self::Lambertian(keys) => Ok(Law::Lambertian(keys.clone())),
            Self::Absorbing(keys) => Ok(Law::Absorbing(keys.clone())),
            Self::Mixed(keys) => Ok(Law::Mixed(keys.clone())),
            Self::File(file) => Err(file),
        }
    }
}

impl Kinds for SurfaceLaw {
    const TAG: &'static str = "kind";

    fn untagged(keys: &dyn Fn(&str) -> bool) -> Option<&'static str> {
        keys("file").then_some("file")
    }
}

/// Keys of a reflector by a file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReflectorFile {
    /// The file.
    pub file: String,
    /// How lobes move between the incidences of the file.
    #[serde(default, skip_serializing_if = "is_default")]
    #[schemars(schema_with = "lobe_motion")]
    pub between: LobeMotion,
}
