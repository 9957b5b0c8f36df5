// SPDX-License-Identifier: MIT OR Apache-2.0
//! The tables of a design whose surfaces send light back.

use serde::{Deserialize, Serialize};

/// How a surface sends light back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reflection {
    /// Mirror.
    Specular,
    /// Cosine law.
    Lambertian,
    /// Not at all.
    Absorbing,
    /// Partly as a mirror, partly by the cosine law.
    Mixed,
}

/// How far the mirror extends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Extent {
    /// Under the whole array: a rectangle of columns × rows pitches.
    Array,
    /// Under each package only.
    Package,
}

/// `[mirror]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Mirror {
    /// Law of reflection.
    pub kind: Reflection,
    /// Reflectance, 0 to 1.
    pub reflectance: f64,
    /// Mixed: share of what is reflected that goes on as from a mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular_fraction: Option<f64>,
    /// How far it extends.
    pub extent: Extent,
    /// The metal, where the reflectance is to follow from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub substrate: Option<super::films::Substrate>,
    /// Thin layers on the metal, from the light towards it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<super::films::Layer>,
}

/// `[led]`: box on the bottom, source on its top face.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Led {
    /// Width along x and y, mm.
    #[serde(deserialize_with = "crate::config::serde_arrays::exact")]
    pub size_mm: [f64; 2],
    /// Height of the top face, mm.
    pub height_mm: f64,
    /// Reflectance of the box, 0 to 1.
    pub reflectance: f64,
    /// Law of reflection of the box.
    pub reflection: Reflection,
    /// Mixed: share of what is reflected that goes on as from a mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular_fraction: Option<f64>,
}

/// `[housing]`: upright walls around the array, open at the top.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Housing {
    /// From the outermost packages to the walls, mm.
    pub distance_mm: f64,
    /// Height of the walls above the bottom, mm.
    pub height_mm: f64,
    /// Thickness of the walls, mm.
    #[serde(default = "wall_thickness")]
    pub thickness_mm: f64,
    /// Law of reflection of the walls.
    pub kind: Reflection,
    /// Reflectance of the walls, 0 to 1.
    pub reflectance: f64,
    /// Mixed: share of what is reflected that goes on as from a mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular_fraction: Option<f64>,
    /// What the bottom does between the mirror and the walls; black if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor: Option<Floor>,
}

fn wall_thickness() -> f64 {
    1.0
}

/// `[housing.floor]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Floor {
    /// Law of reflection.
    pub kind: Reflection,
    /// Reflectance, 0 to 1.
    pub reflectance: f64,
    /// Mixed: share of what is reflected that goes on as from a mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular_fraction: Option<f64>,
}
