// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[sources]]` as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Spectrum;
use crate::tagged::{Kinds, Tagged};
use runtime::serde_arrays::List;

/// `[[sources]]`.
pub type Source = Tagged<SourceKeys, SourceForm>;

/// Keys of all sources.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceKeys {
    /// Name for `only.sources`; none twice.
    pub name: String,
    /// Part of the radiant power, in any unit; 1e-12 to 1e12.
    #[serde(default = "one")]
    pub power: f64,
    /// Light of the source. Default `"file"` where its file states wavelengths, else `"design"`.
    pub light: Option<LightOf>,
    /// Vacuum wavelength of its own, nm; 10 to 100 000.
    pub wavelength_nm: Option<f64>,
    /// Spectrum of its own: keys of `[light.spectrum]` but `weighting`. Not beside `wavelength_nm`.
    pub spectrum: Option<Spectrum>,
    /// Channel that drives the source, such as `"red"`; sources of one name are driven together.
    /// Default `"all"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
}

fn one() -> f64 {
    1.0
}

/// Kinds of source.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SourceForm {
    /// A point with one intensity everywhere.
    Isotropic(IsotropicSource),
    /// A point with a power of the cosine to its normal.
    Cosine(CosineSource),
    /// Lambertian, on one side.
    Rectangle(RectangleSource),
    /// Top and four sides of the LED box, Lambertian unless `top` and `sides` state other laws.
    Chip(ChipSource),
    /// A point that emits a far field (`.ies`, `.ldt`), whole, or a set of rays (`.tm25ray`,
    /// `.ray`, `.dat`, `.sdf`, `.txt`) that start about it.
    File(SourceOfFile),
    /// A point with the angular table of a data sheet.
    Table(TableSource),
}

impl Kinds for SourceForm {
    const TAG: &'static str = "kind";
}

/// Keys of a point that shines alike everywhere.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IsotropicSource {
    /// Middle (x, y, z) in the package, z from the bottom, mm; within 10 m, in the medium of
    /// `inside` alone.
    pub position_mm: List<f64, 3>,
    /// Surroundings: `"silicone"`, `"air"` or a solid with a medium; one with `per = "array"` where
    /// all packages stand in it. Default silicone where there is a dome, else air.
    pub inside: Option<String>,
}

/// Keys of a point with a power of the cosine.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CosineSource {
    /// Middle (x, y, z) in the package, z from the bottom, mm; within 10 m, in the medium of
    /// `inside` alone.
    pub position_mm: List<f64, 3>,
    /// Surroundings: `"silicone"`, `"air"` or a solid with a medium; one with `per = "array"` where
    /// all packages stand in it. Default silicone where there is a dome, else air.
    pub inside: Option<String>,
    /// Direction that it faces, of any length; default [0, 0, 1].
    pub normal: Option<List<f64, 3>>,
    /// Power of the cosine, 0 to 1e6: 1 is Lambert's law.
    pub exponent: f64,
}

/// Keys of a rectangle.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleSource {
    /// Middle (x, y, z) in the package, z from the bottom, mm; within 10 m, in the medium of
    /// `inside` alone.
    pub position_mm: List<f64, 3>,
    /// Surroundings: `"silicone"`, `"air"` or a solid with a medium; one with `per = "array"` where
    /// all packages stand in it. Default silicone where there is a dome, else air.
    pub inside: Option<String>,
    /// Direction that it faces, of any length; default [0, 0, 1].
    pub normal: Option<List<f64, 3>>,
    /// Lengths along u and v, mm; 1e-6 to 10 000. (u, v) are (x, y) where it faces up, else u is
    /// level and v rises.
    pub size_mm: List<f64, 2>,
}

/// Keys of the LED box as a source.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChipSource {
    /// Power of the top and of the sides towards +x, -x, +y and -y, in any unit; one above 0.
    pub face_powers: List<f64, 5>,
    /// Angular law of the top, about its normal. Default Lambert's.
    pub top: Option<FaceLaw>,
    /// The same of the sides.
    pub sides: Option<FaceLaw>,
}

/// `[sources.top]`, `[sources.sides]`: `exponent`, or `angle_deg` and `intensity`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceLaw {
    /// Intensity as this power of the cosine to the normal, 0 to 1e6: 1 is Lambert's law.
    pub exponent: Option<f64>,
    /// Angles to the normal, degrees, ascending, -90 to 90; as of `kind = "table"`, x of the top
    /// along x, of a side level: positive counterclockwise as seen from above.
    pub angle_deg: Option<Vec<f64>>,
    /// Intensity at each, in any unit; of Lambert's law the cosine.
    pub intensity: Option<Vec<f64>>,
    /// Intensity at each in the plane of y, of a side the upright one: positive upwards.
    pub across: Option<Vec<f64>>,
}

/// Keys of a source by a file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceOfFile {
    /// Middle (x, y, z) in the package, z from the bottom, mm; within 10 m, in the medium of
    /// `inside` alone.
    pub position_mm: List<f64, 3>,
    /// Surroundings: `"silicone"`, `"air"` or a solid with a medium; one with `per = "array"` where
    /// all packages stand in it. Default silicone where there is a dome, else air.
    pub inside: Option<String>,
    /// File, relative to the design file; axis and azimuths are those of the package unless it is
    /// turned. Of a table two or three columns in place of the lists: angle, intensity, `across`.
    pub file: String,
    /// Rotation about x, then y, then z of the package, about `position_mm`, degrees; each -360 to
    /// 360. Default [0, 0, 0].
    pub rotation_deg: Option<List<f64, 3>>,
    /// As in `[light.spectrum]`.
    pub tolerance: Option<f64>,
    /// As in `[light.spectrum]`.
    pub samples: Option<usize>,
}

/// Keys of a point with a table of angles.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TableSource {
    /// Middle (x, y, z) in the package, z from the bottom, mm; within 10 m, in the medium of
    /// `inside` alone.
    pub position_mm: List<f64, 3>,
    /// Surroundings: `"silicone"`, `"air"` or a solid with a medium; one with `per = "array"` where
    /// all packages stand in it. Default silicone where there is a dome, else air.
    pub inside: Option<String>,
    /// Angles to the axis +z, degrees, ascending, -180 to 180; dark beyond the ends. Below 0, where
    /// any are as far as above: towards -x, of `across` towards -y.
    pub angle_deg: Option<Vec<f64>>,
    /// Intensity at each, in any unit, on straight lines between: all round, with `across` in the
    /// plane of x.
    pub intensity: Option<Vec<f64>>,
    /// Intensity at each in the plane of y; between the planes by azimuth.
    pub across: Option<Vec<f64>>,
    /// File of these columns instead.
    pub file: Option<String>,
    /// Rotation about x, then y, then z of the package, about `position_mm`, degrees; each -360 to
    /// 360. Default [0, 0, 0].
    pub rotation_deg: Option<List<f64, 3>>,
}

impl SourceForm {
    /// Place, mm, and the stated surroundings; `None` of a chip.
    pub fn place(&self) -> Option<([f64; 3], Option<&str>)> {
        let (position_mm, inside) = match self {
            Self::Isotropic(source) => (&source.position_mm, &source.inside),
            Self::Cosine(source) => (&source.position_mm, &source.inside),
            Self::Rectangle(source) => (&source.position_mm, &source.inside),
            Self::File(source) => (&source.position_mm, &source.inside),
            Self::Table(source) => (&source.position_mm, &source.inside),
            Self::Chip(_) => return None,
        };
        Some((position_mm.0, inside.as_deref()))
    }

    /// The name of its file.
    pub fn file(&self) -> Option<&String> {
        match self {
            Self::File(source) => Some(&source.file),
            Self::Table(source) => source.file.as_ref(),
            _ => None,
        }
    }
}

/// Light of a source that states none of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LightOf {
    /// That of `[light]`.
    Design,
    /// The wavelengths of its file of rays.
    File,
}
