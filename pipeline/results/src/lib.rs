// SPDX-License-Identifier: MIT OR Apache-2.0
//! Results files: `results.json` and its siblings, written and read by the same types.
//!
//! In: figures with standard errors, ledgers, tables, names of files. Out: JSON with the hash of
//! every file beside it, so that a reader can tell whether they still are what the run wrote; and
//! the same read back. No time and no host appear, so the same inputs and seed give the same bytes.
//! [`SCHEMA_VERSION`] changes when a key changes its meaning; the layout stands in
//! `docs/reference/results-schema.md`.
//!
//! ```
//! // A file of another layout is refused with the version expected.
//! let other = serde_json::json!({"schema_version": 1});
//! assert!(results::schema::ResultsFile::from_json(&other).unwrap_err().contains("schema_version"));
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`schema`] | `results.json` key by key |
//! | [`earlier`] | results of other designs and models that stay |
//! | [`package`], [`ray_paths`] | drawing of the package, single paths |
//! | [`optimisation`], [`tolerance`], [`study`] | `optimise.json`, `tolerance.json`, `study.json` |
//! | [`full_wave`], [`zones`] | `full_wave.json`, `zones.json` |
//! | [`target`], [`constraint`] | what is asked of a figure, verdict on its value |
//! | [`figure_entry`], [`shown`] | a figure with its state, and for people |
//! | [`ledger`] | shares of the emitted power by where it goes |
//! | [`headline`] | figures that stand first on a page |
//! | [`paired_figure`] | a figure with its replicates, for changes between paired traces |
//! | `stored_figure` | figures of a model by their keys |
//! | [`sealed_file`] | version and hash of a file |

pub mod constraint;
pub mod earlier;
pub mod figure_entry;
pub mod film_light;
pub mod film_stack;
pub mod full_wave;
pub mod headline;
pub mod ledger;
pub mod optimisation;
pub mod package;
pub mod paired_figure;
pub mod ray_paths;
pub mod schema;
pub mod sealed_file;
pub mod shown;
mod stored_figure;
pub mod study;
pub mod target;
pub mod tolerance;
pub mod zones;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use schema::{
    AbsoluteEntry, DomeParts, ModelEntries, ModelEntry, PolarizationEntry, Program, ReceiverEntry,
    ResultsFile, SpectrumEntry, StoppedBy, TableEntry, UntilError,
};
use serde_json::Value;

use metrics::kinds::Weighting;
use metrics::plural::count;
use metrics::quantity::Unit;
use runtime::atomic_file;
use runtime::provenance::FileRecord;

use crate::earlier::Earlier;
use crate::figure_entry::FigureEntry;
use crate::ledger::Ledger;

/// Version of the layout of `results.json`.
pub const SCHEMA_VERSION: u32 = 4;

/// File under the directory of results.
pub const FILE: &str = "results.json";

/// One figure of merit.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Key in `results.json`.
    pub key: Cow<'static, str>,
    /// Name for people.
    pub label: Cow<'static, str>,
    /// Unit of the stored value.
    pub unit: Unit,
    /// Value, error and state.
    pub entry: FigureEntry,
}

/// Results of one model of one design.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelResult {
    /// Key in `results.json`: `hybrid_10um`.
    pub key: String,
    /// Name for people: `hybrid, 10 um`.
    pub label: String,
    /// Paths traced.
    pub paths: u64,
    /// The figures, in the order in which they are shown.
    pub figures: Vec<Figure>,
    /// Ledger of the power, as shares of the emitted power.
    pub ledger: Ledger,
    /// Ledger of the photons of converted light, as shares of those emitted.
    pub photons: Option<Ledger>,
    /// Rare events the tracer counted, by name.
    pub counters: Vec<(String, f64)>,
    /// Tables used: what each says of itself.
    pub tables: Vec<TableEntry>,
    /// Light of a spectrum with its sampling and the figures of every wavelength.
    pub spectrum: Option<SpectrumEntry>,
    /// Figures in absolute units of a design that states what its LEDs emit.
    pub absolute: Option<AbsoluteEntry>,
    /// Outcome of a stopping rule.
    pub until_error: Option<UntilError>,
    /// `[[receivers]]` by name.
    pub receivers: Option<BTreeMap<String, ReceiverEntry>>,
    /// Statement on rays that carried their polarisation, and on surfaces that left them without.
    pub polarization: Option<PolarizationEntry>,
    /// Files written, under the directory of results.
    pub files: Vec<PathBuf>,
}

/// All models of one design.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignResult {
    /// Name of the design.
    pub name: String,
    /// SHA-256 of the design file.
    pub design_sha256: String,
    /// Models.
    pub models: Vec<ModelResult>,
}

/// Everything one run found.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// True if tables and paths were reduced by `--quick`.
    pub quick: bool,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
    /// The designs that were run, or are compared with reference values.
    pub designs: Vec<DesignResult>,
    /// Designs beside them.
    pub references: Vec<DesignResult>,
    /// Parts of domes by themselves.
    pub parts: DomeParts,
    /// Files that came out, from [`written`].
    pub files: Vec<FileRecord>,
}

/// The files of `designs` and `others`, all under `out`, with their hashes, sorted by name; parts
/// of names are joined by `/` on every system.
///
/// # Errors
/// A file that cannot be read.
pub fn written<'a>(
    out: &Path,
    designs: impl IntoIterator<Item = &'a DesignResult>,
    others: impl IntoIterator<Item = PathBuf>,
) -> Result<Vec<FileRecord>> {
    let models = designs.into_iter().flat_map(|design| &design.models);
    let of_models = models.flat_map(|model| model.files.iter().cloned());
    let record = |file: PathBuf| -> Result<FileRecord> {
        let parts: Vec<_> = file.iter().map(|part| part.to_string_lossy()).collect();
        FileRecord::of_output(out, &parts.join("/"))
    };
    let mut files = of_models.chain(others).map(record).collect::<Result<Vec<_>>>()?;
    files.sort_by(|a, b| a.file.cmp(&b.file));
    Ok(files)
}

impl Results {
    /// JSON of all, sealed.
    ///
    /// # Errors
    /// A value that cannot be written as JSON.
    pub fn to_json(&self) -> Result<Value> {
        Ok(self.to_file().to_json()?)
    }

    /// The file as it is written.
    pub fn to_file(&self) -> ResultsFile {
        let group = |designs: &[DesignResult]| {
            designs.iter().map(|d| (d.name.clone(), d.entries())).collect()
        };
        ResultsFile {
            schema_version: SCHEMA_VERSION,
            program: Program::this(),
            quick: self.quick,
            quick_note: self.quick.then(|| QUICK_NOTE.to_owned()),
            seed: self.seed,
            inputs: self.inputs.clone(),
            files: self.files.clone(),
            reference_source: None,
            designs: group(&self.designs),
            references: group(&self.references),
            parts: self.parts.clone(),
        }
    }

    /// Writes `results.json` under `out`.
    pub fn write(&self, out: &Path) -> Result<()> {
        atomic_file::write_json(&out.join(FILE), &self.to_json()?)
    }

    /// Writes `results.json` under `out` with those that `earlier` keeps.
    pub fn write_beside(&self, earlier: &Earlier, out: &Path) -> Result<()> {
        let file = earlier.with(self.to_file());
        atomic_file::write_json(&out.join(FILE), &file.to_json()?)
    }
}

impl Results {
    /// Errors that sampling a spectrum adds to those in the final table, one line a model; empty
    /// without spectra.
    pub fn wavelength_errors(&self) -> String {
        let models = self.designs.iter().chain(&self.references).flat_map(|design| {
            let of_design = |model: &ModelResult| model.wavelength_errors(&design.name);
            design.models.iter().filter_map(of_design)
        });
        models.collect()
    }
}

/// Statement on `--quick`, in the file and on the terminal.
pub const QUICK_NOTE: &str = "quick run: coarser tables of diffraction orders and fewer rays than a full run; errors are larger than the tolerances the designs ask for";

impl DesignResult {
    fn entries(&self) -> ModelEntries {
        let entry = |model: &ModelResult| ModelEntry {
            design_sha256: self.design_sha256.clone(),
            ..model.entry()
        };
        self.models.iter().map(|m| (m.key.clone(), entry(m))).collect()
    }
}

impl ModelResult {
    /// The figure with this key.
    pub fn figure(&self, key: &str) -> Option<&Figure> {
        self.figures.iter().find(|f| f.key == key)
    }

    /// Units of the figures, of the ledger and of the counters. Shares of flux name what is divided
    /// by what.
    fn units(&self) -> BTreeMap<String, String> {
        let figures = self.figures.iter().map(|figure| {
            let unit = match figure.unit {
                other if other.suffix().is_empty() => "1",
                other => other.suffix(),
            };
            (figure.key.to_string(), unit.to_owned())
        });
        let mut units: BTreeMap<String, String> = figures.collect();
        let spectrum = self.spectrum.as_ref();
        let photometric = spectrum.is_some_and(|s| s.light.weighting == Weighting::Photometric);
        let ledger = if photometric { "lm/lm" } else { "W/W" };
        units.insert("power_ledger".to_owned(), ledger.to_owned());
        let counters = self.counters.iter();
        units.extend(counters.map(|(key, _)| (key.clone(), "1".to_owned())));
        units
    }

    /// A line on the light of a spectrum: weighting, number of wavelengths, changes by the last of
    /// them. `None` for monochromatic light.
    fn wavelength_errors(&self, design: &str) -> Option<String> {
        let spectrum = self.spectrum.as_ref()?;
        let weighting = spectrum.light.weighting.name();
        if spectrum.is_line() {
            return None;
        }
        let begin = format!("\n{design}, {}: {weighting}, ", self.label);
        if spectrum.stopped_by == StoppedBy::NoDispersion {
            return Some(format!("{begin}the same at all wavelengths"));
        }
        let shown = |figure: &Figure| {
            let FigureEntry { wavelength_error, peak_place, .. } = figure.entry;
            let error = wavelength_error.filter(|_| peak_place.is_off_axis())?;
            if !shown::is_change(&figure.entry, error, figure.unit) {
                return None;
            }
            Some(format!("{} {}", figure.label, shown::difference(error, figure.unit)))
        };
        let errors: Vec<String> = self.figures.iter().filter_map(shown).collect();
        let changed = if errors.is_empty() {
            String::new()
        } else {
            format!("; changed by the last ones: {}", errors.join("; "))
        };
        let number = count(spectrum.wavelengths.len(), "wavelength");
        Some(format!("{begin}{number}{changed}"))
    }

    fn entry(&self) -> ModelEntry {
        ModelEntry {
            figures: self.figures.iter().map(|f| (f.key.to_string(), f.entry)).collect(),
            power_ledger: self.ledger.clone(),
            photon_ledger: self.photons.clone(),
            counters: self.counters.iter().cloned().collect(),
            paths: self.paths,
            units: self.units(),
            tables: self.tables.clone(),
            spectrum: self.spectrum.clone(),
            absolute: self.absolute.clone(),
            polarization: self.polarization.clone(),
            receivers: self.receivers.clone(),
            until_error: self.until_error.clone(),
            design_sha256: String::new(),
            seed: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use metrics::Estimate;
    use metrics::far_field::PeakPlace;
    use serde_json::json;

    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let figure = Figure {
            key: "uniformity".into(),
            label: "uniformity".into(),
            unit: Unit::Fraction,
            entry: FigureEntry {
                wavelength_error: Some(Estimate::new(0.002, 0.001)),
                ..FigureEntry::new(Estimate::new(0.76, 0.001))
            },
        };
        let axial = Figure {
            key: "peak_angle_deg".into(),
            label: "peak angle".into(),
            unit: Unit::Degree,
            entry: FigureEntry {
                peak_place: PeakPlace::OnAxis,
                ..FigureEntry::new(Estimate::new(4.0, 10.0))
            },
        };
        let model = ModelResult {
            key: "geometric_100um".to_owned(),
            label: "rays, 100 um".to_owned(),
            paths: 10,
            figures: vec![figure, axial],
            ledger: Ledger {
                accounts: vec![("escaped".to_owned(), FigureEntry::new(Estimate::new(0.9, 0.01)))],
            },
            photons: None,
            counters: Vec::new(),
            tables: Vec::new(),
            files: Vec::new(),
            spectrum: serde_json::from_value(json!({
                "light": {"weighting": "photometric"},
                "units": {"intensity": "cd", "map": "lx"},
                "emitted": {"emitted_w": 1.0, "emitted_lm": 300.0},
                "stopped_by": "tolerance",
                "wavelengths": vec![json!({"wavelength_nm": 550.0, "weight": 1.0, "paths": 1, "silicone_index": 1.4,
                    "silicone_absorption_per_mm": 0.0}); 3],
            }))
            .expect("a spectrum"),
            absolute: None,
            until_error: None,
            receivers: None,
            polarization: None,
        };
        let results = Results {
            quick: false,
            seed: 1,
            inputs: Vec::new(),
            designs: vec![DesignResult {
                name: "mine".to_owned(),
                design_sha256: "0".repeat(64),
                models: vec![model],
            }],
            references: Vec::new(),
            parts: DomeParts::default(),
            files: vec![FileRecord {
                file: "summary.md".to_owned(),
                sha256: runtime::content_hash::sha256_hex(b""),
            }],
        };
        let json = results.to_json().expect("JSON");
        assert_eq!(
            json["designs"]["mine"]["geometric_100um"]["uniformity"],
            json!({"value": 0.76, "standard_error": 0.001,
                "wavelength_error": {"value": 0.002, "standard_error": 0.001}})
        );
        assert_eq!(
            json["designs"]["mine"]["geometric_100um"]["power_ledger"]["escaped"]["value"],
            json!(0.9)
        );
        assert_eq!(
            json["designs"]["mine"]["geometric_100um"]["units"],
            json!({"uniformity": "1", "peak_angle_deg": "deg", "power_ledger": "lm/lm"})
        );
        let back = ResultsFile::from_json(&json).expect("what was written");
        assert_eq!(back.to_json().expect("JSON"), json);
        assert_eq!(json["files"][0]["file"], json!("summary.md"));
        assert_eq!(json.get("quick_note"), None);
        assert_eq!(
            json["designs"]["mine"]["geometric_100um"]["peak_angle_deg"],
            json!({"value": 4.0, "standard_error": 10.0, "peak_place": "on_axis"})
        );
        let errors = results.wavelength_errors();
        assert_eq!(
            errors,
            "\nmine, rays, 100 um: photometric, 3 wavelengths; changed by the last ones: uniformity 0.20 ± 0.10 points"
        );
    }
}
