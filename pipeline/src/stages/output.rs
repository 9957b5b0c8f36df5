// SPDX-License-Identifier: MIT OR Apache-2.0
//! The files of one model of one design: maps, sections, pictures, receivers.
//!
//! Everything lies under `<out>/<design>/<model>/`. Powers are per watt emitted by all sources
//! together.

mod by_wavelength;
mod labels;
mod map_pictures;
mod receivers;

use std::borrow::Cow;
use std::mem;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use super::absolute::absolute;
use super::model::Model;
use super::observation::{Observation, curve};
use super::units::Units;
use crate::atomic_file::{discard_abandoned, supersede, write_bytes};
use crate::config::design::Design;
use crate::config::schema::Carrying;
use crate::formats::{csv, exr};
use crate::metrics::Grouped;
use crate::metrics::extraction::ROUNDING;
use crate::quantity::{Axis, Curve, Map, Quantity, Unit};
use crate::report::plots::{FarField, Heading, far_field_cartesian, far_field_polar};
use crate::results::schema::PolarizationEntry;
use crate::results::{self, ModelResult};
use crate::run_context::RunContext;

/// Files that [`Output::write`] writes into the folder of a model.
pub const FILES: [&str; 12] = [
    "far_field.csv",
    "far_field.exr",
    "far_field.npy",
    "far_field.png",
    "far_field_mean.npy",
    "far_field_polar.png",
    "illuminance.exr",
    "illuminance.npy",
    "illuminance.png",
    "illuminance_cross_section.csv",
    "illuminance_cross_section.npy",
    "illuminance_cross_section.png",
];

/// Folder of the files of `model` of `design`, under the directory of results.
pub fn folder(design: &Design, model: Model) -> PathBuf {
    Path::new(&design.name).join(model.key(design))
}

/// The result of a model: figures, ledger, counters; without tables.
pub fn result(design: &Design, model: Model, observation: &Observation) -> ModelResult {
    ModelResult {
        key: model.key(design),
        label: model.label(design),
        paths: observation.paths,
        figures: observation.figures(design),
        ledger: observation.ledger(),
        counters: observation.counters(),
        tables: Vec::new(),
        spectrum: None,
        absolute: None,
        until_error: None,
        receivers: None,
        polarization: (design.polarization == Carrying::Carried).then(|| PolarizationEntry {
            light: design.polarization,
            depolarised_by: observation.depolarised_by.clone(),
        }),
        files: Vec::new(),
    }
}

/// Directory and units of the files of a design.
#[derive(Clone, Copy)]
pub struct Output<'a> {
    /// The design.
    pub design: &'a Design,
    /// Units of far fields and maps.
    pub units: Units,
    /// Directory of results.
    pub out: &'a Path,
}

impl Output<'_> {
    /// Writes maps, sections, pictures and receivers of `observation` into the model's folder, and
    /// lists files and receivers in `result`. Removes an older `results.json` first. An owned
    /// observation loses its receivers, to free their memory.
    ///
    /// # Errors
    /// A ledger that does not add up; files that cannot be written.
    pub fn write(
        &self,
        result: &mut ModelResult,
        observation: &mut Cow<'_, Observation>,
        context: RunContext,
    ) -> Result<()> {
        let design = self.design;
        let inner = Path::new(&design.name).join(&result.key);
        let folder = &self.out.join(&inner);
        let receivers: Vec<Cow<'_, Grouped>> = match &mut *observation {
            Cow::Owned(own) => mem::take(&mut own.receivers).into_iter().map(Cow::Owned).collect(),
            Cow::Borrowed(seen) => seen.receivers.iter().map(Cow::Borrowed).collect(),
        };
        result.absolute = absolute(design, observation, self.units);
        let files = ModelFiles {
            design,
            result,
            observation,
            units: self.units,
            folder,
            seed: context.seed,
        };
        files.balanced()?;
        if let Some(why) = observation.without_uniformity(design) {
            let file = &design.provenance.file;
            context.console.warn(&format!("{file}: {why}"));
        }
        supersede(&self.out.join(results::FILE))?;
        for folder in [folder, &folder.join(receivers::FOLDER)] {
            discard_abandoned(folder);
        }
        let (far_field, illuminance) = rayon::join(|| files.far_field(), || files.illuminance());
        far_field.and(illuminance)?;
        let provenance = files.provenance();
        let mut written: Vec<PathBuf> = FILES.map(PathBuf::from).to_vec();
        if !design.receivers.is_empty() {
            let (others, said) =
                receivers::write(design, receivers, self.units, folder, &provenance)?;
            written.extend(others);
            result.receivers = Some(said);
        }
        let under_out = written.into_iter().map(|file| inner.join(file));
        result.files.extend(under_out);
        Ok(())
    }

    /// Writes the azimuthal means at every wavelength and of their sum, each per flux that the
    /// sources emit there, and lists the files in `result`.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn write_by_wavelength(
        &self,
        result: &mut ModelResult,
        nodes: &[(Option<&str>, f64, &Observation)],
        sum: &Observation,
    ) -> Result<()> {
        let inner = Path::new(&self.design.name).join(&result.key);
        let heading = Heading::new(
            "Far field by wavelength",
            format!("{}, {}", self.design.name, result.label),
        );
        by_wavelength::write(&self.out.join(&inner), &heading, nodes, sum)?;
        let files = by_wavelength::FILES.map(|file| inner.join(file));
        result.files.extend(files);
        Ok(())
    }
}

/// Values times a factor; a factor of 1 keeps every bit.
fn scaled(values: &[f64], factor: f64) -> Vec<f64> {
    values.iter().map(|x| x * factor).collect()
}

fn capitalised(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

struct ModelFiles<'a> {
    design: &'a Design,
    result: &'a ModelResult,
    observation: &'a Observation,
    units: Units,
    folder: &'a Path,
    seed: u64,
}

impl ModelFiles<'_> {
    fn heading(&self, title: &str) -> Heading {
        Heading::new(title, format!("{}, {}", self.design.name, self.result.label))
    }

    fn provenance(&self) -> Value {
        let emitted = self.units.emitted();
        let mut provenance = json!({
            "program": "batwing",
            "version": env!("CARGO_PKG_VERSION"),
            "design": self.design.name,
            "design_sha256": self.design.provenance.sha256,
            "model": self.result.key,
            "seed": self.seed,
            "paths": self.result.paths,
            "emitted_w": emitted.emitted_w,
        });
        if let Some(lumens) = emitted.emitted_lm {
            provenance["emitted_lm"] = lumens.into();
        }
        provenance
    }

    /// Refuses a ledger that does not add up: a defect of the program.
    fn balanced(&self) -> Result<()> {
        let surplus = self.result.ledger.surplus();
        // NaN fails too.
        let good = surplus.abs() <= ROUNDING;
        ensure!(
            good,
            "internal error: {}, {}: expected escaped, absorbed and lost to add up to what is emitted, got {} of it; nothing of this model was written",
            self.design.provenance.file,
            self.result.label,
            1.0 + surplus
        );
        Ok(())
    }

    fn far_field(&self) -> Result<()> {
        let factor = self.units.per_intensity();
        let far = &self.observation.far_field;
        let sphere = self.observation.sphere;
        let intensity = self.units.intensity();
        let theta = Quantity::new("theta", Unit::Degree);
        let per_bin: Vec<f64> = (0..sphere.polar).map(|ring| sphere.ring_sr(ring)).collect();
        let (value, error) = far.each(|k, power| {
            power * factor / per_bin[k / sphere.azimuths] * sphere.azimuths as f64
        });
        let map = Map::new(
            intensity.clone(),
            Axis::uniform(theta.clone(), 0.0, 180.0, sphere.polar)?,
            Axis::uniform(Quantity::new("phi", Unit::Degree), 0.0, 360.0, sphere.azimuths)?,
            value,
            error,
        )?;
        exr::write_map(&self.folder.join("far_field.exr"), &map, &self.provenance())?;
        csv::write_map_npy(&self.folder.join("far_field.npy"), &map)?;

        let angles = sphere.centres_deg();
        let cut = |label: &str, azimuth: f64, last: f64| {
            let cut = far.map(|p| sphere.cut(&scaled(p, factor), azimuth));
            curve(label, &cut, &angles, last)
        };
        let curves = |last: f64| -> Result<Vec<Curve>> {
            let mean = curve(
                "mean over azimuth",
                &far.map(|p| sphere.profile(&scaled(p, factor))),
                &angles,
                last,
            )?;
            Ok(vec![mean, cut("azimuth 0°", 0.0, last)?, cut("azimuth 45°", 45.0, last)?])
        };
        let all = curves(180.0)?;
        csv::write_curves_csv(&self.folder.join("far_field.csv"), &theta, &intensity, &all)?;
        csv::write_curve_npy(&self.folder.join("far_field_mean.npy"), &all[0])?;
        let shown = curves(90.0)?.iter().map(Curve::mirrored).collect::<Result<Vec<_>>>()?;
        let heading = self.heading("Far field");
        let picture = FarField {
            heading: &heading,
            quantity: &intensity,
            curves: &shown,
            colours: self.colours(),
            numbers: &[],
            peaks: &[],
        };
        write_bytes(&self.folder.join("far_field.png"), &far_field_cartesian(&picture)?.png()?)?;
        write_bytes(&self.folder.join("far_field_polar.png"), &far_field_polar(&picture)?.png()?)
    }
}
