// SPDX-License-Identifier: MIT OR Apache-2.0
//! `results.json` as a file: the same types write it and read it.
//!
//! The reference is `docs/reference/results-schema.md`. Maps are sorted by key, so that equal
//! results give equal bytes.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

use metrics::Estimate;
use metrics::kinds::{Carrying, ReceiverKind, Weighting};
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::serde_messages::{key_text, plain};

use super::SCHEMA_VERSION;
use super::figure_entry::FigureEntry;
use super::ledger::Ledger;

/// Ending of the account of the energy that photons which a luminophore emits lack.
pub const STOKES_LOSS: &str = "stokes_loss";

/// Models of a design, by key.
pub type ModelEntries = BTreeMap<String, ModelEntry>;

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResultsFile {
    /// Version of the layout, 4.
    pub schema_version: u32,
    /// Name and version of the program.
    pub program: Program,
    /// True with `--quick`, which reduces tables and paths.
    pub quick: bool,
    /// What `--quick` means.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quick_note: Option<String>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Files that went in, each with `file` and `sha256`; files under `[files]` stand with their
    /// tables.
    pub inputs: Vec<FileRecord>,
    /// Files beside `results.json`, each with `file` and `sha256`, sorted, parts of names joined by
    /// `/`.
    pub files: Vec<FileRecord>,
    /// Of `reproduce`: source of the figures under `published`.
    #[serde(rename = "published_source", default, skip_serializing_if = "Option::is_none")]
    pub reference_source: Option<String>,
    /// By name, the designs of `run`, or `D1`, `D2` and `D3` of `reproduce`: models by key.
    pub designs: BTreeMap<String, ModelEntries>,
    /// Designs beside those of `designs`, `bare-dome` and `commercial-7p5` of `reproduce`: models
    /// by key.
    pub references: BTreeMap<String, ModelEntries>,
    /// Light of parts of domes by themselves, of `reproduce`.
    #[serde(rename = "figures")]
    pub parts: DomeParts,
}

/// Name and version of a program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Program {
    /// Name.
    pub name: String,
    /// Version.
    pub version: String,
}

impl Program {
    /// This program.
    pub fn this() -> Self {
        Self { name: "batwing".to_owned(), version: env!("CARGO_PKG_VERSION").to_owned() }
    }
}

impl ResultsFile {
    /// The file as JSON, sealed by the hash of its content.
    ///
    /// # Errors
    /// A value that cannot be written as JSON.
    pub fn to_json(&self) -> Result<Value, serde_json::Error> {
        sealed(serde_json::to_value(self)?)
    }

    /// Refuses the parsed text of a file of another schema version.
    ///
    /// # Errors
    /// The versions expected and got.
    pub fn check_version(json: &Value) -> Result<(), String> {
        let version = &json["schema_version"];
        if version != SCHEMA_VERSION {
            return Err(format!(
                "schema_version: expected {SCHEMA_VERSION}, got {version}; run the design again with this version"
            ));
        }
        Ok(())
    }

    /// Reads the parsed text of a file.
    ///
    /// # Errors
    /// Another schema version; key and value that do not fit the schema.
    pub fn from_json(json: &Value) -> Result<Self, String> {
        Self::check_version(json)?;
        serde_path_to_error::deserialize(json)
            .map_err(|e| complaint(&key_text(e.path()), &e.inner().to_string()))
    }
}

/// A reader's message in the words of all others: key, expected, got.
fn complaint(path: &str, said: &str) -> String {
    let Some(words) = plain(said, "an object", None) else {
        return format!("{path}: {said}");
    };
    let keys = [Some(path.trim_end_matches('.')), words.missing.as_deref()];
    let keys = keys.into_iter().flatten().filter(|key| !key.is_empty());
    format!("{}: {}", keys.collect::<Vec<_>>().join("."), words.message)
}

/// One model of one design.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct ModelEntry {
    /// Figures of merit by key.
    #[serde(flatten)]
    pub figures: BTreeMap<String, FigureEntry>,
    /// Shares of the emitted power, by account.
    pub power_ledger: Ledger,
    /// Of converted light, the ledger of photons, as shares of those emitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub photon_ledger: Option<Ledger>,
    /// `surfaces_per_path`: mean number of surfaces that a path meets; by a table of films those of
    /// the light that comes back.
    pub counters: BTreeMap<String, f64>,
    /// Paths traced.
    pub paths: u64,
    /// Unit of every figure (`1`, `deg`, `k`), of the ledger (`W/W`, `lm/lm`) and of counters.
    pub units: BTreeMap<String, String>,
    /// Tables of the hybrid, one a band; in the light of a spectrum under each wavelength.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<TableEntry>,
    /// Sampling of light of several wavelengths, or of sources by themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<SpectrumEntry>,
    /// Figures in absolute units, of a design with a stated flux.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absolute: Option<AbsoluteEntry>,
    /// With `light.polarization = "carried"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarization: Option<PolarizationEntry>,
    /// `[[receivers]]` by name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receivers: Option<BTreeMap<String, ReceiverEntry>>,
    /// With `--until-error`: outcome of the stopping rule.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until_error: Option<UntilError>,
    /// SHA-256 of the design file that was traced.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub design_sha256: String,
    /// Seed of a model that an earlier run computed; absent: that of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
}

/// Figures in the units of light as it is sold, of all packages together and of one of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AbsoluteEntry {
    /// Number of packages.
    pub packages: usize,
    /// Flux that the sources of all packages emit.
    pub emitted: Emitted,
    /// Flux that the sources of one package emit.
    pub emitted_per_package: Emitted,
    /// Electrical power of all packages, W, where the design states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub electrical_w: Option<f64>,
    /// Figures by key: those of `intensity_*`, `illuminance_*`, `flux_up` and `flux_down`.
    pub figures: BTreeMap<String, AbsoluteFigure>,
}

/// One of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AbsoluteFigure {
    /// `W`, `lm`, `W/sr`, `cd`, `W/mm²` or `lx`.
    pub unit: String,
    /// Of all packages together.
    #[serde(flatten)]
    pub array: FigureEntry,
    /// Mean share of one package; none of the illuminance, to which all contribute.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per_package: Option<FigureEntry>,
}

/// A table of diffraction orders.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TableEntry {
    /// Band, from 1, from the axis.
    pub band: usize,
    /// Ring that was solved, from 1, from the axis.
    pub ring: usize,
    /// Wavelength for which it was solved, nm; absent in files of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelength_nm: Option<f64>,
    /// Period of the unit cell, µm.
    pub period_um: f64,
    /// Depth of the unit cell, µm.
    pub depth_um: f64,
    /// Highest order M kept.
    pub orders: usize,
    /// Slices of the relief.
    pub slices: usize,
    /// Error of an efficiency that the solver estimates.
    pub estimated_error: f64,
    /// Worst departure of the solver's power balance from 1.
    pub energy_residual: f64,
    /// Nodes of kx in a Brillouin zone.
    pub kx_per_zone: usize,
    /// Nodes of ky.
    pub ky: usize,
    /// Estimated error of diffuse light by interpolation in ky; null where the design states the
    /// nodes.
    pub grid_error: Option<f64>,
    /// The same in kx.
    pub kx_error: Option<f64>,
    /// Key of the cache: hash of everything that the table depends on.
    pub sha256: String,
}

/// Sampling of the light of a spectrum.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SpectrumEntry {
    /// Spectrum of the design with its `weighting`, `luminous_efficacy_lm_per_w` and `range_nm`;
    /// or, of sources that shine in lights of their own, `sources`: for each light the names of its
    /// sources, `emitted_w` of 1 W together, `emitted_lm`, `light`, and `power_ledger` in shares of
    /// its own flux.
    pub light: LightEntry,
    /// Units of `intensity` and `map` in the files.
    pub units: FileUnits,
    /// Flux that all sources emit: `emitted_w`; `emitted_lm` in photometric weighting.
    pub emitted: Emitted,
    /// Reason why no more wavelengths were added.
    pub stopped_by: StoppedBy,
    /// The wavelengths, each with its figures.
    pub wavelengths: Vec<WavelengthEntry>,
    /// Number of wavelengths that `wavelength_error` compares with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compared_with: Option<usize>,
    /// Of sources in lights of their own, for `radiometric` and `photometric`: `unit`, flux
    /// `emitted`, and the estimates `extraction_efficiency` and `escaped_up`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub efficiency: Option<BTreeMap<Weighting, EfficiencyEntry>>,
    /// With `trace.ledger_by_source`, also at a single wavelength, for every source: `emitted_w`,
    /// `emitted_lm`, and `power_ledger` in shares of its own flux; `wavelengths` then has an entry
    /// for each source.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_source: Option<BTreeMap<String, SourceEntry>>,
    /// The same of every channel of `[[sources]]`, where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_channel: Option<BTreeMap<String, SourceEntry>>,
}

impl SpectrumEntry {
    /// True of light of one wavelength.
    pub fn is_line(&self) -> bool {
        let is_lines = self.light.described.get("kind").is_some_and(|kind| kind == "lines");
        is_lines && self.wavelengths.len() == 1
    }
}

/// A spectrum, or the lights of single sources.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LightEntry {
    /// Weighting of figures.
    pub weighting: Weighting,
    /// Keys of the spectrum, or `sources`.
    #[serde(flatten)]
    pub described: Map<String, Value>,
}

/// Units of intensity and map in the files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FileUnits {
    /// Of the far field.
    pub intensity: String,
    /// Of the map.
    pub map: String,
}

/// Flux that all sources emit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Emitted {
    /// Radiant, W.
    pub emitted_w: f64,
    /// Luminous, lm, in photometric weighting.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub emitted_lm: Option<f64>,
}

/// Reason why no more wavelengths were added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StoppedBy {
    /// Every line was computed.
    Lines,
    /// Nothing depends on the wavelength.
    NoDispersion,
    /// The number that was asked for.
    Samples,
    /// Figures change by no more than the tolerance.
    Tolerance,
    /// Changes beyond the tolerance are within two of their statistical errors.
    Statistics,
    /// 31 wavelengths, or no memory for more.
    Limit,
}

/// One wavelength.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct WavelengthEntry {
    /// Vacuum wavelength, nm.
    pub wavelength_nm: f64,
    /// Share of the weighted flux.
    pub weight: f64,
    /// Paths traced.
    pub paths: u64,
    /// Refractive index of the silicone.
    pub silicone_index: f64,
    /// Absorption of the silicone for power, 1/mm.
    pub silicone_absorption_per_mm: f64,
    /// Sources that shine, where not all do.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<String>,
    /// Tables of the hybrid.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<TableEntry>,
    /// Figures at this wavelength alone.
    #[serde(flatten)]
    pub figures: BTreeMap<String, FigureEntry>,
}

/// Flux out over flux in, in one weighting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EfficiencyEntry {
    /// `W/W` or `lm/lm`.
    pub unit: String,
    /// Flux emitted, W or lm.
    pub emitted: f64,
    /// Out of the domes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extraction_efficiency: Option<Estimate>,
    /// Upwards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub escaped_up: Option<Estimate>,
}

/// One source that is traced by itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SourceEntry {
    /// Radiant power, W.
    pub emitted_w: f64,
    /// Luminous flux, lm.
    pub emitted_lm: f64,
    /// Ledger of it, as shares of the source's own flux.
    pub power_ledger: Ledger,
}

/// Statement on rays that carried their polarisation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PolarizationEntry {
    /// `light.polarization` of the design.
    pub light: Carrying,
    /// Ledger names of surfaces that take light as unpolarised and leave it so.
    pub depolarised_by: Vec<String>,
}

/// Folder of luminance over the angle to the normal, in that of the model.
pub const BY_ANGLE: &str = "receivers/by_angle";

/// One receiver of `[[receivers]]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReceiverEntry {
    /// Kind of receiver.
    pub kind: ReceiverKind,
    /// Quantity in its files.
    pub quantity: String,
    /// Unit of that quantity, and of `mean`, `min` and `max`.
    pub unit: String,
    /// Files, under the folder of the model.
    pub files: Vec<PathBuf>,
    /// Unit of the fluxes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flux_unit: Option<String>,
    /// `flux` and its Stokes parameters, then `mean`, `min`, `max` of its quantity and `min_to_max`;
    /// or the six fluxes of a surface.
    #[serde(flatten)]
    pub figures: BTreeMap<String, FigureEntry>,
}

/// The outcome of a stopping rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UntilError {
    /// Figure to be known.
    pub figure: String,
    /// Standard error asked for, in the unit of the figure (0.001 for `0.1%`), of a flux a share of
    /// what is emitted; a relative one as a share of the value.
    pub error: f64,
    /// True of a relative error.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_relative: bool,
    /// True if it was reached.
    pub reached: bool,
    /// Batches of paths.
    pub batches: u32,
}

/// Light of parts of domes by themselves; each may be absent.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DomeParts {
    /// Far fields of the elements of one dome.
    #[serde(rename = "figure_3", default, skip_serializing_if = "Option::is_none")]
    pub elements: Option<CurvesEntry>,
    /// Far fields of one element in several shapes.
    #[serde(rename = "figure_4", default, skip_serializing_if = "Option::is_none")]
    pub shapes: Option<CurvesEntry>,
    /// Lobes of one ring.
    #[serde(rename = "figure_6", default, skip_serializing_if = "Option::is_none")]
    pub ring: Option<LobesEntry>,
}

/// Curves of one figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurvesEntry {
    /// The curves.
    pub curves: Vec<CurveEntry>,
}

/// Azimuthal mean of a far field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveEntry {
    /// Name in the legend.
    pub label: String,
    /// Polar angles, degrees.
    pub theta_deg: Vec<f64>,
    /// Intensities, W/sr.
    pub intensity_w_per_sr: Vec<f64>,
    /// Their standard errors.
    pub standard_error_w_per_sr: Vec<f64>,
}

/// Lobes of one ring at normal incidence from the silicone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LobesEntry {
    /// Band, from 1.
    pub band: usize,
    /// Ring, from 1.
    pub ring: usize,
    /// Lobes by ray optics.
    pub rays: Vec<LobeEntry>,
    /// Lobes by diffraction.
    pub rcwa: Vec<LobeEntry>,
}

/// One direction into which power goes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LobeEntry {
    /// `reflected` or `transmitted`.
    pub side: String,
    /// Angle to the normal in the medium of the lobe, degrees, positive along the grating vector.
    pub theta_deg: f64,
    /// Power per incident power.
    pub share: f64,
    /// Diffraction order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<i32>,
}

/// Reads an entry with these required and optional keys, whose other keys are figures: derived readers of
/// flattened maps lose the path to a value at fault.
macro_rules! reads_figures {
    ($Entry:ident: $($required:ident)*; $($optional:ident)*) => {
        impl<'de> Deserialize<'de> for $Entry {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Reader;
                impl<'de> Visitor<'de> for Reader {
                    type Value = $Entry;

                    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                        f.write_str("an object")
                    }

                    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<$Entry, A::Error> {
                        let mut entry = $Entry::default();
                        $(let mut $required = None;)*
                        while let Some(key) = map.next_key::<String>()? {
                            match key.as_str() {
                                $(stringify!($required) => $required = Some(map.next_value()?),)*
                                $(stringify!($optional) => entry.$optional = map.next_value()?,)*
                                _ => {
                                    entry.figures.insert(key, map.next_value()?);
                                }
                            }
                        }
                        let missing = A::Error::missing_field;
                        $(entry.$required = $required.ok_or_else(|| missing(stringify!($required)))?;)*
                        Ok(entry)
                    }
                }
                deserializer.deserialize_map(Reader)
            }
        }
    };
}

reads_figures!(ModelEntry: power_ledger counters paths units;
    photon_ledger tables spectrum absolute polarization receivers until_error design_sha256 seed);
reads_figures!(WavelengthEntry: wavelength_nm weight paths silicone_index silicone_absorption_per_mm;
    sources tables);

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn complaints_name_key_expected_and_got() {
        let good = json!({
            "schema_version": SCHEMA_VERSION,
            "program": {"name": "batwing", "version": "1"},
            "quick": false, "seed": 1, "inputs": [], "files": [], "published_source": "",
            "designs": {"D1": {"rays": {
                "uniformity": {"value": 0.5, "standard_error": 0.1},
                "power_ledger": {}, "counters": {}, "paths": 5, "units": {},
                "spectrum": {
                    "light": {"weighting": "photometric", "kind": "lines"},
                    "units": {"intensity": "cd", "map": "lx"},
                    "emitted": {"emitted_w": 1.0}, "stopped_by": "lines",
                    "wavelengths": [{"wavelength_nm": 550.0, "weight": 1.0, "paths": 5,
                        "silicone_index": 1.4, "silicone_absorption_per_mm": 0.0}],
                },
            }}},
            "references": {}, "figures": {},
        });
        let read = ResultsFile::from_json(&good).expect("valid");
        assert_eq!(serde_json::to_value(&read).expect("JSON"), good);
        let model = "/designs/D1/rays";
        for (place, value, said) in [
            ("/seed", json!("one"), "seed: expected a whole number from 0, got \"one\""),
            ("/schema_version", json!(1), "schema_version: expected 4, got 1; run the design"),
            (
                &format!("{model}/uniformity/value"),
                json!("x"),
                "designs.D1.rays.uniformity.value: expected a number, got \"x\"",
            ),
            (
                &format!("{model}/uniformity/standard_error"),
                json!(-1.0),
                "designs.D1.rays.uniformity.standard_error: expected a number of at least 0, got -1.0",
            ),
            (
                &format!("{model}/spectrum/wavelengths/0"),
                json!({"weight": 1.0}),
                "designs.D1.rays.spectrum.wavelengths[1].wavelength_nm: expected a value, got none",
            ),
            (model, json!({}), "designs.D1.rays.power_ledger: expected a value, got none"),
        ] {
            let mut bad = good.clone();
            *bad.pointer_mut(place).expect("a place") = value;
            let error = ResultsFile::from_json(&bad).expect_err(place);
            assert!(error.starts_with(said), "{error}");
        }
    }
}
