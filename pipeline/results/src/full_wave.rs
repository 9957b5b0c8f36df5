// SPDX-License-Identifier: MIT OR Apache-2.0
//! `full_wave.json` as a file: the far field of a dome's section by three models, how far two of them
//! lie from full wave, and how far rays do in the same dome without relief.

use serde::{Deserialize, Serialize};

use metrics::digits::{format_value_with_error, significant};
use runtime::provenance::FileRecord;

use super::sealed_file::SealedFile;

/// File under the directory of results.
pub const FILE: &str = "full_wave.json";
/// Version of the layout.
pub const SCHEMA_VERSION: u32 = 2;
/// Bins of the verdict, degrees.
pub const VERDICT_DEG: f64 = 2.5;

/// The whole file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct FullWaveFile {
    /// Version of the program that wrote it.
    pub version: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
    /// Files that came out.
    pub files: Vec<FileRecord>,
    /// Name of the design.
    pub design: String,
    /// Wavelength, nm.
    pub wavelength_nm: f64,
    /// Width of a ring, µm.
    pub ring_width_um: f64,
    /// Line sources.
    pub sources: usize,
    /// Paths of each ray model in each polarisation.
    pub paths: usize,
    /// Nodes of full wave to a wavelength in the dome.
    pub nodes_per_wavelength: f64,
    /// Width of the bins of the far fields, degrees.
    pub bin_deg: f64,
    /// Parts of the design that are taken and left out, as a sentence.
    pub taken: String,
    /// Far fields and their distances.
    pub comparison: Comparison,
    /// The same of the smooth dome of this size; none where the design is smooth itself.
    pub baseline: Option<Comparison>,
}

/// Far fields of one section.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub struct Comparison {
    /// Rings from axis to rim.
    pub rings: usize,
    /// Radius of the section, µm.
    pub radius_um: f64,
    /// Unknowns of a matrix of full wave.
    pub unknowns: usize,
    /// Largest difference of emitted and radiated power of a source, over the emitted power.
    pub balance: f64,
    /// Far fields.
    pub far_fields: Vec<FarField>,
    /// Distances from full wave, by model and width of the bins; none of a model that misses more
    /// light than its error.
    pub distances: Vec<Distance>,
}

/// Treatment of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Model {
    /// Maxwell's equations.
    FullWave,
    /// Smooth surface with tables of orders.
    Hybrid,
    /// Rays on the relief.
    Rays,
}

impl Model {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::FullWave => "full wave",
            Self::Hybrid => "hybrid",
            Self::Rays => "rays",
        }
    }
}

/// Shares of the emitted power, mean of TE and TM.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub struct FarField {
    /// Model.
    pub model: Model,
    /// Share in each of even bins from -90 to 90 degrees.
    pub bins: Vec<f64>,
    /// Standard error of each, from the scatter of sets of sources.
    pub errors: Vec<f64>,
    /// The same in wider bins.
    pub wide: Vec<Binned>,
    /// Peak and centre; none where more light is missing than the error.
    pub figures: Option<Figures>,
    /// Power that is not in the bins: lost paths, or what full wave's balance lacks.
    pub missing: f64,
}

/// Shares in bins of one width.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub struct Binned {
    /// Width, degrees.
    pub bin_deg: f64,
    /// Shares of the emitted power.
    pub shares: Vec<f64>,
    /// Standard errors.
    pub errors: Vec<f64>,
}

/// Figures of one far field in bins of 5 degrees, both sides averaged.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
pub struct Figures {
    /// Middles of the first and the last bin that the largest does not exceed by two standard
    /// errors, degrees from the axis: one number twice where the peak is resolved.
    pub peak_deg: [f64; 2],
    /// Bins beside the axis over the largest.
    pub centre_to_peak: f64,
    /// Standard error of that.
    pub centre_to_peak_error: f64,
}

impl FarField {
    /// Shares and errors in bins of the verdict.
    pub fn of_verdict(&self) -> Option<&Binned> {
        self.wide.iter().find(|binned| is_of_verdict(binned.bin_deg))
    }

    /// True if what is missing, in one bin of the verdict, moves the r.m.s. of all bins by no more
    /// than their error.
    pub fn is_complete(&self) -> bool {
        let squares = |binned: &Binned| binned.errors.iter().map(|e| e * e).sum::<f64>();
        self.of_verdict().is_some_and(|binned| self.missing <= squares(binned).sqrt())
    }
}

fn is_of_verdict(bin_deg: f64) -> bool {
    (bin_deg - VERDICT_DEG).abs() < 1e-9
}

/// Distance of a model from full wave in bins of one width, over full wave's largest bin.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
pub struct Distance {
    /// Model.
    pub model: Model,
    /// Width of the bins, degrees.
    pub bin_deg: f64,
    /// Root mean square of the differences.
    pub rms: f64,
    /// Largest difference.
    pub largest: f64,
    /// Sum of all absolute differences, of shares that sum to 1.
    pub l1: f64,
    /// Root mean square of the standard errors of the differences: a distance of this size is
    /// noise.
    pub noise: f64,
    /// Mean square without the noise: below 0 where the differences are less than noise makes them.
    pub square: f64,
    /// Standard error of that.
    pub square_error: f64,
}

impl Distance {
    /// Root mean square without the noise and its standard error, or its bound.
    pub fn beyond_noise(&self) -> String {
        root(self.square, self.square_error)
    }

    /// Excess of the distance over another, as the root of the difference of the squares.
    fn beyond(&self, baseline: &Self) -> String {
        let error = self.square_error.hypot(baseline.square_error);
        root(self.square - baseline.square, error)
    }
}

/// Root of a square with its standard error in percent; twice that error is a bound where the
/// square is not resolved.
fn root(square: f64, error: f64) -> String {
    if square > 2.0 * error {
        let value = square.sqrt();
        format!("{} %", format_value_with_error(100.0 * value, 50.0 * error / value))
    } else {
        format!("below {} %", significant(100.0 * (square.max(0.0) + 2.0 * error).sqrt()))
    }
}

impl Comparison {
    fn of_verdict(&self, model: Model) -> Option<&Distance> {
        self.distances.iter().find(|d| d.model == model && is_of_verdict(d.bin_deg))
    }

    /// Distance of a model in the bins of the verdict, or why it has none.
    fn words(&self, model: Model) -> String {
        if let Some(distance) = self.of_verdict(model) {
            return distance.beyond_noise();
        }
        let mut incomplete = self.far_fields.iter().filter(|far| !far.is_complete());
        let of_model = |far: &&FarField| [model, Model::FullWave].contains(&far.model);
        incomplete.rfind(of_model).map_or_else(
            || "not computed".to_owned(),
            |far| {
                let (missing, name) = (significant(100.0 * far.missing), far.model.name());
                format!("no verdict, as {missing} % of the light of {name} is missing")
            },
        )
    }
}

impl SealedFile for FullWaveFile {
    const FILE: &'static str = FILE;
    const VERSION: u32 = SCHEMA_VERSION;
    const WORK: &'static str = "comparison";
    const AGAIN: &'static str = "run full-wave again";

    fn files(&self) -> &[FileRecord] {
        &self.files
    }
}

impl FullWaveFile {
    /// How far hybrid and rays lie from full wave, and how far beyond the smooth dome of this size, as
    /// a sentence.
    pub fn verdict(&self) -> String {
        let begin = format!(
            "r.m.s. distance from full wave beyond noise, in bins of {VERDICT_DEG}° over its largest bin"
        );
        let rays = self.comparison.words(Model::Rays);
        let Some(baseline) = &self.baseline else {
            return format!("{begin}: rays {rays}, with no relief at all");
        };
        let hybrid = self.comparison.words(Model::Hybrid);
        let smooth = baseline.words(Model::Rays);
        let more = |model| {
            let pair = self.comparison.of_verdict(model).zip(baseline.of_verdict(Model::Rays));
            pair.map_or_else(|| "not known".to_owned(), |(own, smooth)| own.beyond(smooth))
        };
        format!(
            "{begin}: hybrid {hybrid}, rays {rays}; baseline, the smooth dome of this size by rays: {smooth}; \
             beyond it, in squares: hybrid {}, rays {}",
            more(Model::Hybrid),
            more(Model::Rays)
        )
    }

    /// Comparison and baseline, each with what tells its models from those of the other.
    pub fn parts(&self) -> impl Iterator<Item = (&'static str, &Comparison)> {
        let baseline = self.baseline.iter().map(|baseline| ("smooth dome, ", baseline));
        std::iter::once(("", &self.comparison)).chain(baseline)
    }

    /// Size of the section, in words.
    pub fn size(&self) -> String {
        let rounded = |um: f64| (1e3 * um).round() / 1e3;
        format!(
            "{} {} of {} µm, radius {} µm, {} nm",
            self.comparison.rings,
            if self.baseline.is_some() { "rings" } else { "smooth rings" },
            rounded(self.ring_width_um),
            rounded(self.comparison.radius_um),
            rounded(self.wavelength_nm)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(model: Model, square: f64, square_error: f64) -> Distance {
        let (bin_deg, rms, noise) = (VERDICT_DEG, 0.1, 0.02);
        Distance { model, bin_deg, rms, largest: 0.3, l1: 0.2, noise, square, square_error }
    }

    /// The error of a root is that of the square over twice the root; what is below two errors is a
    /// bound.
    #[test]
    fn distances_are_roots_with_an_error_or_bounds() {
        let words = |square, error| distance(Model::Rays, square, error).beyond_noise();
        assert_eq!(words(0.0096, 0.0005), "9.80 ± 0.26 %");
        assert_eq!(words(0.0004, 0.0003), "below 3.2 %");
        assert_eq!(words(-0.0004, 0.0002), "below 2.0 %");
    }

    /// 5 % of the light is more than an error of 0.1 % in each of 72 bins, 0.8 % is not.
    #[test]
    fn the_verdict_speaks_of_what_exceeds_the_smooth_dome() {
        let far = |model, missing| {
            let wide = Binned {
                bin_deg: VERDICT_DEG,
                shares: vec![1.0 / 72.0; 72],
                errors: vec![1e-3; 72],
            };
            let (bins, errors, wide) = (Vec::new(), Vec::new(), vec![wide]);
            FarField { model, bins, errors, wide, figures: None, missing }
        };
        let comparison = |distances, missing| Comparison {
            rings: 8,
            radius_um: 16.0,
            unknowns: 1000,
            balance: 1e-6,
            far_fields: vec![far(Model::FullWave, 1e-6), far(Model::Rays, missing)],
            distances,
        };
        let [hybrid, rays] = [(Model::Hybrid, 0.0050), (Model::Rays, 0.0100)]
            .map(|(model, square)| distance(model, square, 0.0003));
        let smooth = comparison(vec![distance(Model::Rays, 0.0030, 0.0004)], 0.0);
        let mut file = FullWaveFile {
            version: String::new(),
            seed: 1,
            inputs: Vec::new(),
            files: Vec::new(),
            design: "D1".to_owned(),
            wavelength_nm: 550.0,
            ring_width_um: 2.0,
            sources: 360,
            paths: 1000,
            nodes_per_wavelength: 7.0,
            bin_deg: 0.5,
            taken: String::new(),
            comparison: comparison(vec![hybrid, rays], 0.008),
            baseline: Some(smooth.clone()),
        };
        let verdict = file.verdict();
        assert!(
            verdict.contains("hybrid 7.07 ± 0.21 %, rays 10.00 ± 0.15 %; baseline"),
            "{verdict}"
        );
        assert!(verdict.contains("by rays: 5.48 ± 0.37 %; beyond it"), "{verdict}");
        assert!(verdict.ends_with("hybrid 4.47 ± 0.56 %, rays 8.37 ± 0.30 %"), "{verdict}");
        file.comparison = comparison(vec![hybrid], 0.05);
        let verdict = file.verdict();
        assert!(verdict.contains("rays no verdict, as 5.0 % of the light of rays"), "{verdict}");
        assert!(verdict.ends_with("rays not known"), "{verdict}");
        (file.comparison, file.baseline) = (smooth, None);
        assert!(file.verdict().ends_with("rays 5.48 ± 0.37 %, with no relief at all"));
    }
}
