// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files, arrays and pictures of one model of one design.
//!
//! In: results and observation of a model, as `simulate` hands them to a
//! [`ModelWriter`]. Out: files under `<out>/<design>/<model>/` ([`ModelFilesWriter`]), arrays in
//! memory ([`in_memory`]) or pictures in memory ([`live`]). Powers are per watt emitted by all
//! sources together.
//!
//! ```
//! use output::{FILES, ModelFilesWriter};
//!
//! // A writer for a folder without results of other models.
//! let writer = ModelFilesWriter::default();
//! assert!(writer.earlier.is_none() && FILES.contains(&"illuminance.exr"));
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`mod@array`], [`in_memory`] | arrays with axes and units |
//! | [`live`] | pictures of a model, also beside another |
//! | `map_pictures`, `by_wavelength`, `colours`, `receivers`, `labels` | one kind of file each |

pub mod array;
mod by_wavelength;
mod colours;
pub mod in_memory;
mod labels;
pub mod live;
mod map_pictures;
mod receivers;

use std::borrow::Cow;
use std::mem;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use arrays::{csv, exr};
use design::Design;
use metrics::Grouped;
use metrics::extraction::ROUNDING;
use metrics::figures;
use metrics::illuminance::Symmetry;
use metrics::quantity::{Axis, Curve, Map, Quantity, Unit};
use receivers::Shared;
use report::plots::{
    FarField, Heading, LineColours, Picture, far_field_cartesian, far_field_polar,
};
use results::earlier::Earlier;
use results::schema::BY_ANGLE;
use results::{Figure, ModelResult};
use runtime::atomic_file::{discard_abandoned, supersede, write_bytes};
use runtime::run_context::RunContext;
use simulate::absolute::absolute;
use simulate::model_writer::{ModelWriter, Output};
use simulate::observation::colours::ColourArrays;
use simulate::observation::{Observation, curve};
use simulate::symmetry::{cuts, symmetry};
use simulate::units::Units;

/// Files that [`ModelFilesWriter`] writes into the folder of a model.
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

/// The files of a model, as [`FILES`] lists them.
#[derive(Default)]
pub struct ModelFilesWriter {
    /// Results that stay while those of a model are replaced.
    pub earlier: Option<Earlier>,
}

impl ModelWriter for ModelFilesWriter {
    fn write(
        &self,
        output: Output,
        result: &mut ModelResult,
        observation: &mut Cow<'_, Observation>,
        context: RunContext,
    ) -> Result<()> {
        let design = output.design;
        let inner = Path::new(&design.name).join(&result.key);
        let folder = &output.out.join(&inner);
        let (of_receivers, receivers) = take_receivers(design, result, observation);
        let files = ModelFiles::new(output, result, observation, folder, context.seed);
        files.check(context)?;
        match &self.earlier {
            Some(earlier) => earlier.write(output.out)?,
            None => supersede(&output.out.join(results::FILE))?,
        }
        for inner in ["", receivers::FOLDER, BY_ANGLE, colours::FOLDER, receivers::COLOURS] {
            discard_abandoned(&folder.join(inner));
        }
        let (far_field, illuminance) = rayon::join(|| files.far_field(), || files.illuminance());
        far_field.and(illuminance)?;
        let provenance = files.provenance();
        let mut written: Vec<PathBuf> = FILES.map(PathBuf::from).to_vec();
        if let Some(arrays) = files.arrays() {
            written.extend(files.colour_files(arrays)?);
        }
        if !design.receivers.is_empty() {
            let shared = files.of_receivers(&of_receivers, &provenance);
            let (others, said) = receivers::write(design, receivers, &shared)?;
            written.extend(others);
            result.receivers = Some(said);
        }
        let under_out = written.into_iter().map(|file| inner.join(file));
        result.files.extend(under_out);
        Ok(())
    }

    fn write_by_wavelength(
        &self,
        output: Output,
        result: &mut ModelResult,
        nodes: &[(Option<&str>, f64, &Observation)],
        sum: &Observation,
    ) -> Result<()> {
        let inner = Path::new(&output.design.name).join(&result.key);
        let heading = Heading::new(
            "Far field by wavelength, mean over azimuth",
            format!("{}, {}", output.design.name, result.label),
        );
        by_wavelength::write(&output.out.join(&inner), &heading, nodes, sum)?;
        let files = by_wavelength::FILES.map(|file| inner.join(file));
        result.files.extend(files);
        Ok(())
    }
}

/// Figures and bins of all receivers, which an owned observation loses. States absolute figures in
/// `result` before that.
fn take_receivers<'a>(
    design: &Design,
    result: &mut ModelResult,
    observation: &mut Cow<'a, Observation>,
) -> (Vec<Figure>, Vec<Cow<'a, Grouped>>) {
    let is_of_receiver = |key: &str| figures::find(key).is_some_and(|f| f.source.is_of_receiver());
    let of_receivers = observation.estimates(design, is_of_receiver);
    result.absolute = absolute(design, observation);
    let receivers = match &mut *observation {
        Cow::Owned(own) => mem::take(&mut own.receivers).into_iter().map(Cow::Owned).collect(),
        Cow::Borrowed(seen) => seen.receivers.iter().map(Cow::Borrowed).collect(),
    };
    (of_receivers, receivers)
}

/// Values times a factor; a factor of 1 keeps every bit.
fn scaled(values: &[f64], factor: f64) -> Vec<f64> {
    values.iter().map(|x| x * factor).collect()
}

/// A mean over azimuth and cuts over -90..90°: mirrored as far as the light is, without symmetry
/// each half-plane beside the one opposite to it.
fn both_sides(curves: &[Curve], symmetry: Symmetry) -> Result<Vec<Curve>> {
    match (symmetry, curves) {
        (Symmetry::None, [mean, east, north, west, south]) => {
            let section = |right: &Curve, left: &Curve, words: &str| {
                right.beside(left).map(|both| both.labelled(words))
            };
            Ok(vec![
                mean.mirrored()?,
                section(east, west, "azimuth 180° (left) and 0°")?,
                section(north, south, "azimuth 270° (left) and 90°")?,
            ])
        }
        _ => curves.iter().map(Curve::mirrored).collect(),
    }
}

/// `name` with a capital at its beginning.
pub fn capitalised(name: &str) -> String {
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

impl<'a> ModelFiles<'a> {
    fn new(
        output: Output<'a>,
        result: &'a ModelResult,
        observation: &'a Observation,
        folder: &'a Path,
        seed: u64,
    ) -> Self {
        let Output { design, units, .. } = output;
        Self { design, result, observation, units, folder, seed }
    }

    /// Colours of all bins.
    fn arrays(&self) -> Option<&'a ColourArrays> {
        self.observation.colours.as_ref()?.arrays.as_ref()
    }

    /// What the receivers share, whose figures these are.
    fn of_receivers<'b>(&'b self, figures: &'b [Figure], provenance: &'b Value) -> Shared<'b> {
        Shared {
            units: self.units,
            one_path: self.observation.path_power(),
            figures,
            folder: self.folder,
            subtitle: format!("{}, {}", self.design.name, self.result.label),
            provenance,
            colours: self.arrays().map(|arrays| &arrays.receivers[..]),
        }
    }

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

    /// Refuses a ledger that does not add up; warns where no uniformity is read, and of light unlike around its axis.
    fn check(&self, context: RunContext) -> Result<()> {
        self.check_ledger()?;
        let (seen, design) = (self.observation, self.design);
        let said = [seen.without_uniformity(design), seen.unlike_half_planes(design)];
        for why in said.into_iter().flatten() {
            context.console.warn(&format!("{}: {why}", design.provenance.file));
        }
        Ok(())
    }

    /// Refuses a ledger that does not add up, a defect of the program.
    fn check_ledger(&self) -> Result<()> {
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

    fn far_field_map(&self) -> Result<Map> {
        let factor = self.units.per_intensity();
        let far = &self.observation.far_field;
        let sphere = self.observation.sphere;
        let per_bin: Vec<f64> = (0..sphere.polar).map(|ring| sphere.ring_sr(ring)).collect();
        let (value, error) = far.each(|k, power| {
            power * factor / per_bin[k / sphere.azimuths] * sphere.azimuths as f64
        });
        let axis =
            |name, turn, bins| Axis::uniform(Quantity::new(name, Unit::Degree), 0.0, turn, bins);
        let rows = axis("theta", 180.0, sphere.polar)?;
        let columns = axis("phi", 360.0, sphere.azimuths)?;
        Map::new(self.units.intensity(), rows, columns, value, error)
    }

    /// The far field up to the polar angle `last`: its mean over azimuth, then `cuts`.
    fn far_field_curves(&self, last: f64, cuts: &[(String, Vec<f64>)]) -> Result<Vec<Curve>> {
        let factor = self.units.per_intensity();
        let (far, sphere) = (&self.observation.far_field, self.observation.sphere);
        let angles = sphere.centres_deg();
        let mean = far.map(|p| sphere.profile(&scaled(p, factor)));
        let mut all = vec![curve("mean over azimuth", &mean, &angles, last)?];
        for (label, azimuths) in cuts {
            let cut = far.map(|p| sphere.half_planes(&scaled(p, factor), azimuths));
            all.push(curve(label, &cut, &angles, last)?);
        }
        Ok(all)
    }

    fn far_field(&self) -> Result<()> {
        let map = self.far_field_map()?;
        exr::write_map(&self.folder.join("far_field.exr"), &map, &self.provenance())?;
        csv::write_map_npy(&self.folder.join("far_field.npy"), &map)?;

        let all = self.far_field_curves(180.0, &cuts(symmetry(self.design)))?;
        let intensity = self.units.intensity();
        let theta = Quantity::new("theta", Unit::Degree);
        csv::write_curves_csv(&self.folder.join("far_field.csv"), &theta, &intensity, &all)?;
        csv::write_curve_npy(&self.folder.join("far_field_mean.npy"), &all[0])?;
        let [straight, polar] =
            self.far_field_pictures(&self.shown_far_field()?, self.colours())?;
        write_bytes(&self.folder.join("far_field.png"), &straight.png()?)?;
        write_bytes(&self.folder.join("far_field_polar.png"), &polar.png()?)
    }

    /// Curves of the far field in both half-planes.
    fn shown_far_field(&self) -> Result<Vec<Curve>> {
        let symmetry = symmetry(self.design);
        both_sides(&self.far_field_curves(90.0, &cuts(symmetry))?, symmetry)
    }

    /// Far fields over a straight axis and over the angle.
    fn far_field_pictures(&self, curves: &[Curve], colours: LineColours) -> Result<[Picture; 2]> {
        let picture = FarField {
            heading: &self.heading("Far field"),
            quantity: &self.units.intensity(),
            curves,
            colours,
            numbers: &[],
            peaks: &[],
        };
        Ok([far_field_cartesian(&picture)?, far_field_polar(&picture)?])
    }
}
