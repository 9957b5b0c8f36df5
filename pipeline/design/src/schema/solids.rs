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
    /// Name in the ledger, receivers and `sources.inside`: letters, digits, `-`, `_`, `.`; none
    /// twice, none that the ledger has already.
    pub name: String,
    /// Number of its copies; default `"package"`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub per: Per,
    /// Middle (x, y, z), mm; of a meridian or mesh its own origin. Within 10 m, nothing below z =
    /// 0; default the origin.
    #[serde(default, skip_serializing_if = "is_default")]
    pub position_mm: List<f64, 3>,
    /// Contact with the bottom, of a box, cylinder or meridian with a `medium` that stands upright
    /// and flat on z = 0. Default a gap.
    pub optical_contact: Option<OpticalContact>,
    /// Material: keys of `[silicone]`.
    pub medium: Option<Silicone>,
    /// Thin layers on a solid with a medium, from its inside outwards, as `dome.coating`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<Layer>,
    /// Diffuser, of a solid with a medium or a sheet; not with `coating`.
    pub scatter: Option<SolidScatter>,
    /// Opaque reflection, of a sheet on both sides: keys of `[mirror]` but `extent`, or of
    /// `[files.mirror]`.
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
    /// A body of revolution by its meridian.
    Meridian(SolidMeridian),
    /// A closed mesh of triangles.
    Mesh(SolidMesh),
    /// A flat sheet.
    Rectangle(Flat<2>),
    /// A flat round sheet.
    Disc(Disc),
}

impl Kinds for SolidForm {
    const TAG: &'static str = "kind";
}

/// Keys of a box and of a rectangle.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Flat<const N: usize> {
    /// Lengths along x, y and, of a box, z, mm; 1e-6 to 10 000.
    pub size_mm: List<f64, N>,
    /// Rotation about the fixed x, then y, then z, degrees; -360 to 360.
    pub rotation_deg: Option<List<f64, 3>>,
}

/// Keys of a cylinder.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Radius, mm; 1e-6 to 10 000.
    pub radius_mm: f64,
    /// Length along the axis, mm; 1e-6 to 10 000.
    pub height_mm: f64,
    /// Direction of the axis, of any length; default [0, 0, 1].
    pub axis: Option<List<f64, 3>>,
}

/// Keys of a sphere.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// Radius, mm; 1e-6 to 10 000.
    pub radius_mm: f64,
}

/// Keys of a body of revolution.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidMeridian {
    /// Rows as of `dome.meridian_mm`, from the axis back to a lower point of it; any z. This or
    /// `meridian_file`.
    pub meridian_mm: Option<Vec<Vec<f64>>>,
    /// File of such rows.
    pub meridian_file: Option<String>,
    /// Direction of the axis, of any length; default [0, 0, 1].
    pub axis: Option<List<f64, 3>>,
}

/// Keys of a mesh.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidMesh {
    /// STL or OBJ file of a closed solid.
    pub mesh: String,
    /// Unit of the lengths in it.
    pub mesh_unit: MeshUnit,
    /// Rotation about the fixed x, then y, then z, degrees; -360 to 360.
    pub rotation_deg: Option<List<f64, 3>>,
}

/// Keys of a disc.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// Radius, mm; 1e-6 to 10 000.
    pub radius_mm: f64,
    /// Direction of the axis, of any length; default [0, 0, 1].
    pub axis: Option<List<f64, 3>>,
}

impl SolidForm {
    /// True if it is a sheet, without an inside.
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

    /// Place, as messages show it.
    pub fn place(&self) -> String {
        format!("{:?}", self.shared.position_mm.0)
    }
}

/// Number of copies of a solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Per {
    /// One a package, from the middle of its bottom.
    #[default]
    Package,
    /// One, from the middle of the array.
    Array,
}

/// Partner of an optical contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OpticalContact {
    /// Light in the solid meets the bottom directly.
    Bottom,
}

/// `[solids.scatter]`.
pub type SolidScatter = Tagged<NoKeys, ScatterLaw>;

/// Law of scattering of a solid with a medium, or a sheet, for light from either side.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ScatterLaw {
    /// As files say; the inner side of a sheet is -z before rotation.
    File(ScatterFiles),
    /// By the cosine law about the normal, whatever the incidence.
    Lambertian(DiffuseShares),
    /// Gaussian lobes about the straight and the mirrored direction.
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
    /// File as of `[[files.bands]]`, for the indices on both sides, at all wavelengths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Files for light from the inner side.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inner: Vec<String>,
    /// Files for light from the outer side.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outer: Vec<String>,
    /// Lobes between the incidences of the files, as of `[[files.bands]]`.
    #[schemars(schema_with = "lobe_motion")]
    pub between: LobeMotion,
}

/// Keys of a Lambertian diffuser.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiffuseShares {
    /// Power on the other side per incident power, at every incidence; 0 to 1.
    pub transmitted: f64,
    /// Power on the side of incidence, likewise; with `transmitted` at most 1.
    pub reflected: f64,
}

/// Keys of a Gaussian diffuser.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaussianShares {
    /// Power on the other side per incident power, at every incidence; 0 to 1.
    pub transmitted: f64,
    /// Power on the side of incidence, likewise; with `transmitted` at most 1.
    pub reflected: f64,
    /// Full width at half maximum of the intensity about the lobe's axis, degrees; 0.001 to 180.
    pub width_deg: f64,
    /// Width of the reflected lobe, degrees; default `width_deg`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflected_width_deg: Option<f64>,
}

/// `[solids.surface]`: as of `[mirror]` and of `[files.mirror]`.
pub type SolidSurface = Tagged<NoKeys, SurfaceLaw>;

/// Law of reflection of an opaque solid or a sheet.
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
    /// File, as of `[files.mirror]`.
    pub file: String,
    /// Lobes between the incidences of the file, as of `[[files.bands]]`.
    #[serde(default, skip_serializing_if = "is_default")]
    #[schemars(schema_with = "lobe_motion")]
    pub between: LobeMotion,
}
