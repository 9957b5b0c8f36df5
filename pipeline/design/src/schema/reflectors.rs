// SPDX-License-Identifier: MIT OR Apache-2.0
//! The tables of a design whose surfaces send light back.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::films::{Layer, Substrate};
use super::{NoKeys, is_default};
use crate::serde_arrays::List;
use crate::tagged::{Kinds, Tagged};

/// Laws of reflection; `S` are the keys of a specular surface.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Law<S> {
    /// Mirror.
    Specular(S),
    /// Cosine law.
    Lambertian(Reflectance),
    /// Not at all.
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
    /// Reflectance, 0 to 1.
    pub reflectance: f64,
}

/// Keys of a mirror that may be of metal.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Metal {
    /// Reflectance, 0 to 1; of metal, the share of what it reflects that is kept.
    pub reflectance: f64,
    /// The metal, where the reflectance is to follow from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub substrate: Option<Substrate>,
    /// Thin layers on the metal, from the light towards it.
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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<f64>,
}

/// Keys of a mixture.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpecularAndDiffuse {
    /// Reflectance of both parts together, 0 to 1.
    pub reflectance: f64,
    /// Share of what is reflected that goes on as from a mirror.
    pub specular_fraction: f64,
}

/// How far the mirror extends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Extent {
    /// Under the whole array: a rectangle of columns × rows pitches.
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
    /// How far it extends.
    pub extent: Extent,
}

/// `[led]`: box on the bottom, source on its top face.
pub type Led = Tagged<LedKeys, LedLaw>;

/// Keys of a box of any law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LedKeys {
    /// Width along x and y, mm.
    pub size_mm: List<f64, 2>,
    /// Height of the top face, mm.
    pub height_mm: f64,
    /// Radiant flux that the sources of one package emit, W.
    pub power_w: Option<f64>,
    /// Luminous flux that they emit, lm, instead.
    pub power_lm: Option<f64>,
    /// From the axis of the package to the centre of the foot, along x and y, mm.
    #[serde(default, skip_serializing_if = "is_default")]
    pub offset_mm: List<f64, 2>,
    /// Rotation about x, then about y, degrees, -10 to 10.
    #[serde(default, skip_serializing_if = "is_default")]
    pub tilt_deg: List<f64, 2>,
    /// What is added to the offset in each package, one row for each in the order of the array,
    /// mm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub offsets_mm: Vec<List<f64, 2>>,
    /// What is added to the tilt in each package, as the offsets are, degrees.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tilts_deg: Vec<List<f64, 2>>,
}

/// Law of reflection of the box, which the key `reflection` names.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct LedLaw(pub Law<Reflectance>);

impl Kinds for LedLaw {
    const TAG: &'static str = "reflection";
}

/// `[housing]`: upright walls around the array, open at the top.
pub type Housing = Tagged<HousingKeys, Law<Reflectance>>;

/// Keys of walls of any law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HousingKeys {
    /// From the outermost packages to the walls, mm.
    pub distance_mm: f64,
    /// Height of the walls above the bottom, mm.
    pub height_mm: f64,
    /// Thickness of the walls, mm.
    #[serde(default = "wall_thickness")]
    pub thickness_mm: f64,
    /// What the bottom does between the mirror and the walls; black if absent.
    pub floor: Option<Floor>,
}

fn wall_thickness() -> f64 {
    1.0
}

/// `[housing.floor]`.
pub type Floor = Tagged<NoKeys, Law<Reflectance>>;
