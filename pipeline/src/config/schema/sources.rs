// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[sources]]` as written.

use serde::{Deserialize, Serialize};

use super::Spectrum;

/// `[[sources]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Its name, by which receivers tell its light from other.
    pub name: String,
    /// What it is.
    pub kind: SourceKind,
    /// Its middle, mm, in the package; not of a chip.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub position_mm: Option<[f64; 3]>,
    /// What surrounds it: `silicone`, `air`, or a solid of the package by its name; silicone where there is a dome, else air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside: Option<String>,
    /// Cosine, rectangle: the direction that it faces, of any length; +z if absent.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub normal: Option<[f64; 3]>,
    /// Rectangle: lengths along u and v, mm.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub size_mm: Option<[f64; 2]>,
    /// Cosine: the power of the cosine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exponent: Option<f64>,
    /// Chip: power of the top and of the sides towards +x, -x, +y and -y, in any unit.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub face_powers: Option<[f64; 5]>,
    /// File: a far field or a file of rays, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Power beside the other sources, in any unit.
    #[serde(default = "one")]
    pub power: f64,
    /// LightOf light it shines in: that of the file where it has wavelengths, else that of the design.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<LightOf>,
    /// A wavelength of its own, nm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelength_nm: Option<f64>,
    /// A spectrum of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Spectrum>,
    /// Light of a file: largest change of a figure from one number of wavelengths to the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Light of a file: number of wavelengths instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<usize>,
}

fn one() -> f64 {
    1.0
}

impl Source {
    /// One that emits what a file says.
    pub(in crate::config) fn of_file(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            kind: SourceKind::File,
            position_mm: None,
            inside: None,
            normal: None,
            size_mm: None,
            exponent: None,
            face_powers: None,
            file: None,
            power: 1.0,
            light: None,
            wavelength_nm: None,
            spectrum: None,
            tolerance: None,
            samples: None,
        }
    }
}

/// Kinds of source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SourceKind {
    /// A point with the same intensity everywhere.
    Isotropic,
    /// A point with an intensity in proportion to a power of the cosine.
    Cosine,
    /// A Lambertian rectangle.
    Rectangle,
    /// The top and the four sides of the LED box, Lambertian.
    Chip,
    /// A point that emits a far field, or the rays of a file.
    File,
}

/// LightOf light a source shines in, where it states none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LightOf {
    /// That of `[light]`.
    Design,
    /// That of its file of rays.
    File,
}
