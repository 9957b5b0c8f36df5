// SPDX-License-Identifier: MIT OR Apache-2.0
//! The tables of a design whose surfaces send light back.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::films::{FilterKeys, Layer, Substrate};
use super::{NoKeys, is_default};
use crate::tagged::{Kinds, Tagged};
use runtime::serde_arrays::List;

/// Laws of reflection; `S` are the keys of a specular surface.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Law<S> {
    /// As a mirror.
    Specular(S),
    /// By the cosine law.
    Lambertian(Reflectance),
    /// Nothing is reflected.
    Absorbing(Absorbing),
    /// Partly as a mirror, partly by the cosine law.
    Mixed(SpecularAndDiffuse),
}

impl<S: DeserializeOwned + Serialize> Kinds for Law<S> {
    const TAG: &'static str = "kind";
}

/// Keys of a surface with one law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reflectance {
    /// Power reflected per incident power, at every angle, 0 to 1.
    pub reflectance: f64,
}

/// Keys of a mirror that may be of metal.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Metal {
    /// Power reflected per incident power, at every angle, 0 to 1. With `substrate` or `filter` the
    /// share kept of what these reflect.
    pub reflectance: f64,
    /// Table of the reflected share over angle and wavelength, as of a filter on a film, of angles in
    /// the medium before it: a mirror of layers by its data sheet. What is transmitted is absorbed
    /// behind it. Light leaves it unpolarised. Not beside `substrate`.
    pub filter: Option<FilterKeys>,
    /// Metal, a table of `index` or `material_file`, whose reflectance follows at every angle. Of
    /// `[mirror]` not with `[files.mirror]`.
    pub substrate: Option<Substrate>,
    /// Thin layers on the metal, from the light towards it; needs `substrate`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<Layer>,
}

/// Keys of a specular surface.
pub trait Specular {
    /// Reflectance, 0 to 1.
    fn reflectance(&self) -> f64;
}

impl Specular for Reflectance {
    fn reflectance(&self) -> f64 {
        self.reflectance
    }
}

impl Specular for Metal {
    fn reflectance(&self) -> f64 {
        self.reflectance
    }
}

/// Keys of a surface that absorbs.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Absorbing {
    /// Any reflectance, which counts as 0.
    pub reflectance: Option<f64>,
}

/// Keys of a mixture.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpecularAndDiffuse {
    /// Power reflected per incident power, both parts together, 0 to 1; the rest is absorbed.
    pub reflectance: f64,
    /// Share of the reflected light that is specular, 0 to 1.
    pub specular_fraction: f64,
}

/// Reach of the mirror.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Extent {
    /// A rectangle of columns × rows pitches about the array.
    Array,
    /// Under each package only.
    Package,
}

/// `[mirror]`.
pub type Mirror = Tagged<MirrorKeys, Law<Metal>>;

/// Keys of a mirror of any law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorKeys {
    /// Reach of the mirror. Beyond it, a black floor.
    pub extent: Extent,
}

/// `[led.sides]`.
pub type LedSides = Tagged<NoKeys, Law<Metal>>;

/// `[led]`: box on the bottom, source on its top face.
pub type Led = Tagged<LedKeys, LedLaw>;

/// Keys of a box of any law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LedKeys {
    /// Lengths along x and y, mm; 1e-6 to 10 000, the corners inside the dome.
    pub size_mm: List<f64, 2>,
    /// Height of the top face, mm; 1e-6 to 10 000.
    pub height_mm: f64,
    /// Upright faces of the box: `kind` and the keys of `[mirror]` but `extent`. Default as its top.
    pub sides: Option<LedSides>,
    /// Radiant flux of one package, W, the mean where `array.positions_file` states powers; 1e-12 to
    /// 1e9. Without a flux all packages together emit 1 W.
    pub power_w: Option<f64>,
    /// Luminous flux of one package, lm, in place of `power_w`; 1e-12 to 1e9. Weighting is then
    /// photometric by default; 360 to 830 nm.
    pub power_lm: Option<f64>,
    /// Electrical power of one package, W, beside its flux: no less than the radiant one, at most 1e9.
    /// The input watts of IES and EULUMDAT files; without it these hold 0, for unknown.
    pub electrical_w: Option<f64>,
    /// Centre of the foot [x, y] from the axis of the package, mm; every corner inside the dome.
    /// Default [0, 0].
    #[serde(default, skip_serializing_if = "is_default")]
    pub offset_mm: List<f64, 2>,
    /// Rotation [about x, about y], in this order, degrees; -10 to 10. Default [0, 0].
    #[serde(default, skip_serializing_if = "is_default")]
    pub tilt_deg: List<f64, 2>,
    /// Rows [x, y] added to `offset_mm`: one a package, row after row from the lowest y, along x;
    /// of a file its lines.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub offsets_mm: Vec<List<f64, 2>>,
    /// Rows [about x, about y] added to `tilt_deg`, one a package in the same order; each -10 to
    /// 10.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tilts_deg: Vec<List<f64, 2>>,
}

/// Law of reflection of the box, which the key `reflection` names.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct LedLaw(pub Law<Metal>);

impl Kinds for LedLaw {
    const TAG: &'static str = "reflection";
}

/// `[housing]`: upright walls around the array, open at the top.
pub type Housing = Tagged<HousingKeys, Walls>;

/// What walls do.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Walls {
    /// As mirrors.
    Specular(Reflectance),
    /// By the cosine law.
    Lambertian(Reflectance),
    /// Nothing is reflected.
    Absorbing(Absorbing),
    /// Partly as a mirror, partly by the cosine law.
    Mixed(SpecularAndDiffuse),
    /// No walls: light that leaves the cell on one side enters it on the other, as in an endless array
    /// of such cells.
    Periodic(NoKeys),
}

impl Kinds for Walls {
    const TAG: &'static str = "kind";
}

impl Walls {
    /// The law of reflection; `None` where there are no walls.
    pub fn law(&self) -> Option<Law<Reflectance>> {
        Some(match self.clone() {
            Self::Specular(keys) => Law::Specular(keys),
            Self::Lambertian(keys) => Law::Lambertian(keys),
            Self::Absorbing(keys) => Law::Absorbing(keys),
            Self::Mixed(keys) => Law::Mixed(keys),
            Self::Periodic(_) => return None,
        })
    }
}

/// Keys of walls of any law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HousingKeys {
    /// Distance from the outermost bodies of the outermost packages (dome, LED's box, solids of each
    /// package) to the inside of the walls, mm; 1e-6 to 10 000. This or `inner_size_mm`.
    pub distance_mm: Option<f64>,
    /// Lengths between the walls along x and y, about the middle of the array, mm; 0.001 to 200 000.
    pub inner_size_mm: Option<List<f64, 2>>,
    /// Height of the walls above the bottom, mm; 0.001 to 10 000.
    pub height_mm: f64,
    /// Thickness of the walls, mm; 0.001 to 10 000.
    #[serde(default = "wall_thickness")]
    pub thickness_mm: f64,
    /// Bottom between mirror and walls: `kind`, `reflectance`, `specular_fraction`. Default black.
    pub floor: Option<Floor>,
}

fn wall_thickness() -> f64 {
    1.0
}

/// `[housing.floor]`.
pub type Floor = Tagged<NoKeys, Law<Reflectance>>;
