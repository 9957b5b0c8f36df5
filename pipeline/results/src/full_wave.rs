// SPDX-License-Identifier: MIT OR Apache-2.0
//! `full_wave.json` as a file: the far field of a dome's section by three models, and how far two
//! of them lie from full wave.

use serde::{Deserialize, Serialize};

use files::provenance::FileRecord;
use metrics::digits::format_value_with_error;

use super::sealed_file::SealedFile;

/// File under the directory of results.
pub const FILE: &str = "full_wave.json";
/// Version of the layout.
pub const SCHEMA_VERSION: u32 = 1;
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
}

/// Three far fields of one section.
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
    /// Distances from full wave, by width of the bins.
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
    /// Standard error of each: of rays by their number; of full wave by the number of sources,
    /// whose speckle is averaged.
    pub errors: Vec<f64>,
    /// Power that is not in the bins: lost paths, or what full wave's balance lacks.
    pub missing: f64,
}

impl FarField {
    /// Shares and errors in bins of `width_deg`, a multiple of the bins that divides 180.
    pub fn in_bins(&self, width_deg: f64) -> (Vec<f64>, Vec<f64>) {
        let each = (width_deg * self.bins.len() as f64 / 180.0).round().max(1.0) as usize;
        let sum = |part: &[f64]| part.iter().sum();
        let root = |part: &[f64]| part.iter().map(|e| e * e).sum::<f64>().sqrt();
        (self.bins.chunks(each).map(sum).collect(), self.errors.chunks(each).map(root).collect())
    }
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
}

impl Distance {
    /// Root mean square without the noise and its standard error, or that it is no more than noise. The
    /// error is that of N squares of independent normal differences of mean d² and variance n²:
    /// 4 d² n² + 2 n⁴ over N for the mean square.
    pub fn beyond_noise(&self) -> String {
        if self.rms > 2.0 * self.noise {
            let variance = self.noise.powi(2);
            let square = self.rms.powi(2) - variance;
            let of_square = variance * (4.0 * square + 2.0 * variance) * self.bin_deg / 180.0;
            let (beyond, error) = (square.sqrt(), 0.5 * (of_square / square).sqrt());
            format!("{} %", format_value_with_error(100.0 * beyond, 100.0 * error))
        } else {
            format!("below {:.1} %", 200.0 * self.noise)
        }
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
    /// How far hybrid and rays lie from full wave, as a sentence.
    pub fn verdict(&self) -> String {
        let words = |model| {
            let mut all = self.comparison.distances.iter();
            let found = all.find(|d| d.model == model && (d.bin_deg - VERDICT_DEG).abs() < 1e-9);
            found.map_or_else(|| "not computed".to_owned(), Distance::beyond_noise)
        };
        format!(
            "r.m.s. distance from full wave beyond noise, in bins of {VERDICT_DEG}° over its largest bin: hybrid {}, rays {}",
            words(Model::Hybrid),
            words(Model::Rays)
        )
    }

    /// Size of the section, in words.
    pub fn size(&self) -> String {
        let rounded = |um: f64| (1e3 * um).round() / 1e3;
        format!(
            "{} rings of {} µm, radius {} µm, {} nm",
            self.comparison.rings,
            rounded(self.ring_width_um),
            rounded(self.comparison.radius_um),
            rounded(self.wavelength_nm)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_have_the_error_of_a_sum_of_squares_or_are_bounds() {
        let distance = |rms, noise| {
            let (model, bin_deg) = (Model::Rays, VERDICT_DEG);
            Distance { model, bin_deg, rms, largest: 0.3, l1: 0.2, noise }
        };
        // 72 bins: 0.5 sqrt(0.0004 (4 0.0096 + 2 0.0004) / 72 / 0.0096).
        assert_eq!(distance(0.1, 0.02).beyond_noise(), "9.80 ± 0.24 %");
        assert_eq!(distance(0.1, 0.001).beyond_noise(), "9.999 ± 0.012 %");
        assert_eq!(distance(0.03, 0.02).beyond_noise(), "below 4.0 %");
    }
}
