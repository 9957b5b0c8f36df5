// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]` as written.

use std::borrow::Cow;

use bsdf::LobeMotion;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::SeqAccessDeserializer;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::files::lobe_motion;
use super::films::{ByAngle, FilterKeys, Layer};
use super::reflectors::{Absorbing, Law, Metal, Reflectance, SpecularAndDiffuse};
use super::{MeshUnit, NoKeys, Silicone, is_default};
use crate::tagged::{Kinds, Tagged};
use runtime::serde_arrays::List;

/// `[[solids]]`.
pub type Solid = Tagged<SolidKeys, SolidForm>;

/// Keys of all solids and sheets.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidKeys {
    /// Name in the ledger, receivers and `sources.inside`: letters, digits, `-`, `_`, `.`; none
    /// twice, none that the ledger has already.
    pub name: String,
    /// Number of its copies; default `"package"`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub per: Per,
    /// Middle (x, y, z), mm; of a meridian or mesh its own origin, under a height map that of the
    /// bottom. Within 10 m, nothing below z = 0; default the origin.
    #[serde(default, skip_serializing_if = "is_default")]
    pub position_mm: List<f64, 3>,
    /// Bodies that light in the solid, which has a `medium`, meets without a gap: names of solids
    /// that it touches or overlaps, `"bottom"`, a list of these, or `"all"` for whatever it
    /// touches. The body named displaces this one where both overlap. `"bottom"` is the mirror or
    /// floor below a solid that stands on z = 0 with a flat face: a box with one axis upright, an
    /// upright cylinder or round meridian. Default none: a gap to everything that it touches.
    #[serde(default, skip_serializing_if = "Contacts::is_empty")]
    pub optical_contact: Contacts,
    /// Material: a table with the keys of `[silicone]`.
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
    /// A body of revolution by its meridian, or an oval one by two.
    Meridian(SolidMeridian),
    /// A closed mesh of triangles.
    Mesh(SolidMesh),
    /// A solid with upright sides and a flat bottom under a height map.
    #[serde(rename = "height_map")]
    HeightMap(SolidHeightMap),
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

/// Keys of a body of revolution, and of an oval one.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidMeridian {
    /// Rows as of `dome.meridian_mm`, from the axis back to a lower point of it; any z. This or
    /// `meridian_file`.
    pub meridian_mm: Option<Vec<Vec<f64>>>,
    /// File of such rows.
    pub meridian_file: Option<String>,
    /// Rows of the meridian along y of a body that is not round; the other one is then that along x,
    /// and ellipses lie between. `rotation_deg` turns it, not `axis`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meridian_y_mm: Option<Vec<Vec<f64>>>,
    /// File of such rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meridian_y_file: Option<String>,
    /// Direction of the axis, of any length; default [0, 0, 1].
    pub axis: Option<List<f64, 3>>,
    /// Rotation about the fixed x, then y, then z, degrees; -360 to 360.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_deg: Option<List<f64, 3>>,
}

/// Keys of a mesh.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidMesh {
    /// STL or OBJ file of a closed solid.
    pub mesh: String,
    /// Unit of the lengths in it.
    pub mesh_unit: MeshUnit,
    /// Smooth normals: at a corner the mean of those faces about it that turn by at most this from the
    /// face met, linear between corners; 0 to 90 degrees. Default flat faces.
    pub smooth_deg: Option<f64>,
    /// Rotation about the fixed x, then y, then z, degrees; -360 to 360.
    pub rotation_deg: Option<List<f64, 3>>,
}

/// Keys of a solid under a height map.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidHeightMap {
    /// Lengths along x and y, mm; 1e-6 to 10 000.
    pub size_mm: List<f64, 2>,
    /// Heights at equal steps from edge to edge, at least 4 by 4 and at most about 700 by 700
    /// numbers, the largest y first: rows of numbers, a `.npy` of f64 or a grey PNG of 8 or 16 bits
    /// (0 to 1). Between them the bicubic spline.
    pub map_file: String,
    /// Height of 1 in the file, of white in a picture, mm; -10 000 to 10 000.
    pub scale_mm: f64,
    /// Height of 0 in the file above the bottom, mm; -10 000 to 10 000. Default 0.
    #[serde(default, skip_serializing_if = "is_default")]
    pub base_mm: f64,
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

/// Names of the bodies that a solid is in optical contact with.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Contacts(pub Vec<String>);

impl Contacts {
    /// The mirror or the floor below.
    pub const BOTTOM: &str = "bottom";
    /// Whatever it touches.
    pub const ALL: &str = "all";

    /// True if it has a gap to all others.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// True if a body is named, by its own name or among all.
    pub fn include(&self, name: &str) -> bool {
        self.0.iter().any(|known| known == name || known == Self::ALL)
    }

    /// True if a body is named by its own name.
    pub fn names(&self, name: &str) -> bool {
        self.0.iter().any(|known| known == name)
    }

    /// The names, as messages show them.
    pub fn shown(&self) -> String {
        match &self.0[..] {
            [one] => format!("{one:?}"),
            all => format!("{all:?}"),
        }
    }
}

impl<'de> Deserialize<'de> for Contacts {
    fn deserialize<D: Deserializer<'de>>(reader: D) -> Result<Self, D::Error> {
        struct Names;

        impl<'de> Visitor<'de> for Names {
            type Value = Contacts;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a name or a list of names")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Contacts, E> {
                Ok(Contacts(vec![name.to_owned()]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, names: A) -> Result<Contacts, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(names)).map(Contacts)
            }
        }

        reader.deserialize_any(Names)
    }
}

impl Serialize for Contacts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0[..] {
            [one] => one.serialize(serializer),
            all => all.serialize(serializer),
        }
    }
}

impl JsonSchema for Contacts {
    fn schema_name() -> Cow<'static, str> {
        "names".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [
            {"type": "string"},
            {"type": "array", "items": {"type": "string"}},
        ]})
    }
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
    /// Prisms side by side, of the film's material, by ray optics; a face of `[[films]]` only.
    Prisms(Prisms),
    /// Grooves of any profile, likewise.
    Grooves(Grooves),
    /// Spherical lenses in cells side by side, likewise.
    Microlenses(Relief),
    /// Pyramids in cells, with a face towards each neighbour, likewise.
    Pyramids(Relief),
    /// Circular cones in cells, likewise.
    Cones(Relief),
    /// A polarising sheet, which does not scatter; a face of `[[films]]` only.
    Polariser(PolariserKeys),
    /// Stated shares of unpolarised light by wavelength and angle, without scattering, likewise: an
    /// edge filter, a panel.
    Filter(FilterKeys),
    /// Thin layers, likewise.
    Coated(CoatedFace),
    /// A diffuser by the data sheet of its film, haze and total transmittance; a face of `[[films]]` or
    /// a sheet.
    Haze(HazeKeys),
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

impl ScatterLaw {
    /// Depth to which tips of grooves stand in the film beyond, µm.
    pub fn tips_um(&self) -> Option<f64> {
        match self {
            Self::Prisms(prisms) => prisms.tips_um,
            Self::Grooves(grooves) => grooves.tips_um,
            _ => None,
        }
    }
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
    pub reflected_width_deg: Option<f64>,
}

/// Keys of prisms.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Prisms {
    /// Angle at the tip, of pyramids between opposite faces, degrees; 10 to 170; default 90. Of
    /// pyramids and cones this or `height_um`.
    pub apex_deg: Option<f64>,
    /// Distance from tip to tip, or of the middles of neighbouring cells, µm; 1e-6 to 1e7; default
    /// 50. Without other lengths it changes nothing.
    pub pitch_um: Option<f64>,
    /// Radius of the tip, µm; below half the pitch over the cosine of half the angle; default 0.
    pub tip_radius_um: Option<f64>,
    /// Direction of the tips, or from cell to cell, from the x axis, degrees; -360 to 360; default 0.
    pub direction_deg: Option<f64>,
    /// Depth to which the tips stand in the film beyond them, a layer of glue in optical contact, µm;
    /// above 0, at most the height of the grooves. Default: they stand in air.
    pub tips_um: Option<f64>,
}

impl Prisms {
    /// Angle at the tip where none is stated, degrees.
    pub const APEX_DEG: f64 = 90.0;
    /// Distance of tips where none is stated, µm.
    pub const PITCH_UM: f64 = 50.0;
}

/// Keys of grooves of any profile.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grooves {
    /// One period of the face, points (x, z), µm: z away from the film, x to the left of
    /// `direction_deg` seen from above, on either face, along +y for 0; the last at the height of the
    /// first.
    pub profile_um: Vec<List<f64, 2>>,
    /// Direction of the grooves, from the x axis, degrees; -360 to 360; default 0.
    pub direction_deg: Option<f64>,
    /// Depth to which the tips stand in the film beyond them, a layer of glue in optical contact, µm;
    /// above 0, at most the height of the grooves. Default: they stand in air.
    pub tips_um: Option<f64>,
}

/// Keys of microlenses, pyramids and cones.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Relief {
    /// Distance of the middles of neighbouring cells, µm; 1e-6 to 1e7; default 50.
    pub pitch_um: Option<f64>,
    /// Form of the cells; default `"square"`.
    #[serde(skip_serializing_if = "is_default")]
    pub cell: ReliefCells,
    /// Diameter of a lens or cone, or distance of opposite sides of a pyramid, where it stands, µm;
    /// at most the pitch. Default the pitch; between is a level face.
    pub base_um: Option<f64>,
    /// Height or depth, µm: of lenses, at most half of `base_um`, this or `radius_um`.
    pub height_um: Option<f64>,
    /// Of lenses: radius of curvature, µm; from half of `base_um` to 1000 times of it.
    pub radius_um: Option<f64>,
    /// Angle at the tip of pyramids, between opposite faces, and cones, degrees; 10 to 170; default
    /// 90.
    pub apex_deg: Option<f64>,
    /// True for hollows in the film; default false.
    #[serde(skip_serializing_if = "is_default")]
    pub pressed_in: bool,
    /// Direction from cell to cell, from the x axis, degrees; -360 to 360; default 0.
    pub direction_deg: Option<f64>,
}

impl Relief {
    /// Distance of the middles of neighbouring cells, µm.
    pub fn pitch_um(&self) -> f64 {
        self.pitch_um.unwrap_or(Prisms::PITCH_UM)
    }
}

/// Arrangement of the cells of a relief.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ReliefCells {
    /// Squares.
    #[default]
    Square,
    /// Regular hexagons.
    Hexagonal,
}

/// Keys of a polariser: `pass`, with or without `block`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PolariserKeys {
    /// Direction of the pass axis, from the x axis, degrees; -360 to 360; default 0.
    pub axis_deg: Option<f64>,
    /// Light along the pass axis: a table of `transmittance` and `reflectance`, as of `filter`; needs
    /// `light.polarization = "carried"`.
    pub pass: Option<FilterKeys>,
    /// Light along the block axis, likewise; default all absorbed.
    pub block: Option<FilterKeys>,
    /// Former place of the keys of `filter`, which is refused.
    #[schemars(skip)]
    pub transmittance: Option<ByAngle>,
    /// Likewise.
    #[schemars(skip)]
    pub reflectance: Option<ByAngle>,
}

/// Keys of a diffuser by its haze, in air at normal incidence.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HazeKeys {
    /// Total transmittance of the film, with this face and a smooth one, 0 to 1.
    pub total_transmittance: f64,
    /// Share of the transmitted light that leaves more than 2.5 degrees off the beam, 0 to 1.
    pub haze: f64,
    /// Reflectance of the same film, 0 to 1; default so that its face absorbs nothing.
    pub total_reflectance: Option<f64>,
    /// Full width at half maximum of the intensity of what is scattered, degrees; 0.001 to 180. What
    /// makes no haze goes straight on. Default the width at which all light is scattered.
    pub scattered_width_deg: Option<f64>,
}

/// Keys of a face with thin layers.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoatedFace {
    /// Layers from the film outwards, at least one, as `dome.coating`.
    pub coating: Vec<Layer>,
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
