// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[files]` as written: bands, mirror and source from files of other programs.

use bsdf::LobeMotion;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::sources::LightOf;
use runtime::field_names::names;

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
    /// First band, from 1; each band in one entry.
    pub from: usize,
    /// Last band.
    pub to: usize,
    /// A `.bworders`, `.json`, `.npz`, `.xml` or LightTools `.bsdf` file; `{band}` is the number of
    /// the band. This, or `inner` and `outer`.
    pub file: Option<String>,
    /// Zemax `.bsdf` or Speos `.anisotropicbsdf` or `.brdf` files for light from the inner side.
    #[serde(default)]
    pub inner: Vec<String>,
    /// Such files for light from the outer side.
    #[serde(default)]
    pub outer: Vec<String>,
    /// Lobes between the incidences of the file: `"fixed"` as at the nearest ones; `"shifted"` with
    /// the tangential wavevector, as orders do.
    #[serde(default)]
    #[schemars(schema_with = "lobe_motion")]
    pub between: LobeMotion,
}

/// `[files.mirror]`: the reflector in the plane z = 0 scatters by a table for light from its outer
/// side.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileMirror {
    /// Scattering on its outer (front) side, instead of `mirror.kind` and `mirror.reflectance`.
    pub file: String,
    /// Lobes between the incidences of the file, as of `[[files.bands]]`.
    #[serde(default)]
    #[schemars(schema_with = "lobe_motion")]
    pub between: LobeMotion,
}

/// `[files.source]`: the light of the LED.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSource {
    /// An `.ies` or `.ldt` far field, or a `.tm25ray`, `.ray`, `.dat`, `.sdf` or `.txt` file of
    /// rays. Every point of the top of the LED box (the part above its plane) emits the far field.
    /// Rays of a file start about the middle of that top; rays that go down or start below it are
    /// left out.
    pub file: String,
    /// Light of the source. Default `"file"` where the file states wavelengths, else `"design"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<LightOf>,
    /// As in `[light.spectrum]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// As in `[light.spectrum]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<usize>,
}

/// Words of [`LobeMotion`], whose crate knows nothing of schemas.
pub(super) fn lobe_motion(_: &mut SchemaGenerator) -> Schema {
    json_schema!({"type": "string", "enum": names::<LobeMotion>()})
}
