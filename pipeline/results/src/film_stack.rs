// SPDX-License-Identifier: MIT OR Apache-2.0
//! `film_stack.json` as a file: what a film stack sends back and lets through over the angle.

use serde::{Deserialize, Serialize};

use metrics::Estimate;
use runtime::provenance::FileRecord;

use super::sealed_file::SealedFile;

/// File under the directory of the scattering file.
pub const FILE: &str = "film_stack.json";
/// Version of the layout.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole file. All shares are of the incident power, unpolarised, without regard to where light
/// leaves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FilmStackFile {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// Version of the program that wrote it.
    pub version: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
    /// Scattering files.
    pub files: Vec<FileRecord>,
    /// Name of the design.
    pub design: String,
    /// Wavelength, nm.
    pub wavelength_nm: f64,
    /// Paths of an incidence of the scattering file, and of an angle.
    pub paths_of_an_incidence: u64,
    /// Largest standard error of a share of an incidence of the scattering file.
    pub largest_standard_error: f64,
    /// Shares of diffuse light.
    pub diffuse_light: BothSides<StackShares>,
    /// Shares over the angle of incidence, the mean over all azimuths.
    pub over_angle: BothSides<Vec<SharesAtAngle>>,
    /// Light along the normal: what leaves for each steradian.
    pub normal_incidence: BothSides<StackIntensity>,
}

/// The same for light from either side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BothSides<T> {
    /// Light that rises.
    pub from_below: T,
    /// Light that falls.
    pub from_above: T,
}

impl<T> BothSides<T> {
    /// Each with the word of its side.
    pub fn each(&self) -> [(&'static str, &T); 2] {
        [("below", &self.from_below), ("above", &self.from_above)]
    }
}

/// What becomes of light from one side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StackShares {
    /// Goes through.
    pub transmittance: Estimate,
    /// Comes back.
    pub reflectance: Estimate,
    /// Ends in the films.
    pub absorptance: Estimate,
}

/// Shares at an angle of incidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SharesAtAngle {
    /// Angle to the normal, degrees.
    pub theta_deg: f64,
    /// Shares.
    #[serde(flatten)]
    pub shares: StackShares,
}

/// Shares for each steradian in equal bins of the angle to the normal at which light leaves, up to 90
/// degrees; light that passes straight lies in the first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StackIntensity {
    /// What goes through.
    pub transmitted: Vec<Estimate>,
    /// What comes back.
    pub reflected: Vec<Estimate>,
}

impl SealedFile for FilmStackFile {
    const FILE: &'static str = FILE;
    const VERSION: u32 = SCHEMA_VERSION;
    const WORK: &'static str = "trace of the films";
    const AGAIN: &'static str = "run bsdf --films again";

    fn files(&self) -> &[FileRecord] {
        &self.files
    }
}
