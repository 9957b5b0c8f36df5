// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[sources]]` as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Spectrum;
use crate::serde_arrays::List;
use crate::tagged::{Kinds, Tagged};

/// `[[sources]]`.
pub type Source = Tagged<SourceKeys, SourceForm>;

/// Keys of all sources.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceKeys {
    /// Its name, by which receivers tell its light from other.
    pub name: String,
    /// Power beside the other sources, in any unit.
    #[serde(default = "one")]
    pub power: f64,
    /// Which light it shines in: that of the file where it has wavelengths, else that of the
    /// design.
    pub light: Option<LightOf>,
    /// A wavelength of its own, nm.
    pub wavelength_nm: Option<f64>,
    /// A spectrum of its own.
    pub spectrum: Option<Spectrum>,
}

fn one() -> f64 {
    1.0
}

/// Kinds of source.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SourceForm {
    /// A point with the same intensity everywhere.
    Isotropic(IsotropicSource),
    /// A point with an intensity in proportion to a power of the cosine.
    Cosine(CosineSource),
    /// A Lambertian rectangle.
    Rectangle(RectangleSource),
    /// The top and the four sides of the LED box, Lambertian.
    Chip(ChipSource),
    /// A point that emits a far field, or the rays of a file.
    File(SourceOfFile),
}

impl Kinds for SourceForm {
    const TAG: &'static str = "kind";
}

/// Keys of a point that shines alike everywhere.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IsotropicSource {
    /// Its place, mm, in the package.
    pub position_mm: List<f64, 3>,
    /// What surrounds it: `silicone`, `air`, or a solid of the package by its name; silicone where
    /// there is a dome, else air.
    pub inside: Option<String>,
}

/// Keys of a point with a power of the cosine.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CosineSource {
    /// Its place, mm, in the package.
    pub position_mm: List<f64, 3>,
    /// What surrounds it, as of an isotropic one.
    pub inside: Option<String>,
    /// The direction that it faces, of any length; +z if absent.
    pub normal: Option<List<f64, 3>>,
    /// The power of the cosine.
    pub exponent: f64,
}

/// Keys of a rectangle.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleSource {
    /// Its middle, mm, in the package.
    pub position_mm: List<f64, 3>,
    /// What surrounds it, as of an isotropic one.
    pub inside: Option<String>,
    /// The direction that it faces, of any length; +z if absent.
    pub normal: Option<List<f64, 3>>,
    /// Lengths along u and v, mm.
    pub size_mm: List<f64, 2>,
}

/// Keys of the LED box as a source.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChipSource {
    /// Power of the top and of the sides towards +x, -x, +y and -y, in any unit.
    pub face_powers: List<f64, 5>,
}

/// Keys of a source by a file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceOfFile {
    /// The place of the file's origin, mm, in the package.
    pub position_mm: List<f64, 3>,
    /// What surrounds it, as of an isotropic one.
    pub inside: Option<String>,
    /// A far field or a file of rays, relative to the design file.
    pub file: String,
    /// Largest change of a figure from one number of wavelengths of the file to the next.
    pub tolerance: Option<f64>,
    /// Number of wavelengths of the file instead.
    pub samples: Option<usize>,
}

impl SourceForm {
    /// Its place, mm, and what it says that it lies in; of a chip there is neither.
    pub fn place(&self) -> Option<([f64; 3], Option<&str>)> {
        let (position_mm, inside) = match self {
            Self::Isotropic(source) => (&source.position_mm, &source.inside),
            Self::Cosine(source) => (&source.position_mm, &source.inside),
            Self::Rectangle(source) => (&source.position_mm, &source.inside),
            Self::File(source) => (&source.position_mm, &source.inside),
            Self::Chip(_) => return None,
        };
        Some((position_mm.0, inside.as_deref()))
    }

    /// The name of its file.
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::File(source) => Some(&source.file),
            _ => None,
        }
    }
}

/// Which light a source shines in, where it states none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LightOf {
    /// That of `[light]`.
    Design,
    /// That of its file of rays.
    File,
}
