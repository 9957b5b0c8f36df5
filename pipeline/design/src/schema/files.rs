// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[files]` as written: bands, mirror and source from files of other programs.

use bsdf::LobeMotion;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::sources::LightOf;
use crate::tagged::names;

/// `[files]` as it is written.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Files {
    /// `[[files.bands]]`.
    #[serde(default)]
    pub bands: Vec<FileBands>,
    /// `[files.mirror]`.
    pub mirror: Option<FileMirror>,
    /// `[files.source]`.
    pub source: Option<FileSource>,
}

/// `[[files.bands]]`: the hybrid's bands `from..=to` scatter by tables from files.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileBands {
    /// First band, from 1.
    pub from: usize,
    /// Last band, included.
    pub to: usize,
    /// A file that says itself which side is meant; `{band}` in its name stands for the number of
    /// the band.
    pub file: Option<String>,
    /// Zemax files for light from the inner side.
    #[serde(default)]
    pub inner: Vec<String>,
    /// Zemax files for light from the outer side.
    #[serde(default)]
    pub outer: Vec<String>,
    /// How lobes move between the incidences of the files.
    #[serde(default)]
    #[schemars(schema_with = "lobe_motion")]
    pub between: LobeMotion,
}

/// `[files.mirror]`: the reflector in the plane z = 0 scatters by a table for light from its outer
/// side.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileMirror {
    /// The file.
    pub file: String,
    /// How lobes move between the incidences of the file.
    #[serde(default)]
    #[schemars(schema_with = "lobe_motion")]
    pub between: LobeMotion,
}

/// `[files.source]`: the light of the LED.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSource {
    /// An `.ies`, `.ldt`, `.tm25ray` or `.ray` file; its axis is +z, rays start about the middle of
    /// the top of the LED box.
    pub file: String,
    /// LightOf light it shines in: that of the file where it has wavelengths, else that of the
    /// design.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<LightOf>,
    /// Light of the file: largest change of a figure from one number of wavelengths to the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Light of the file: number of wavelengths instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<usize>,
}

/// Words of [`LobeMotion`], whose crate knows nothing of schemas.
pub(super) fn lobe_motion(_: &mut SchemaGenerator) -> Schema {
    json_schema!({"type": "string", "enum": names::<LobeMotion>()})
}
