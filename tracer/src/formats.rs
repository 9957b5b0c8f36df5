// SPDX-License-Identifier: MIT OR Apache-2.0
//! Readers and writers of photometric files and ray files.
//!
//! Each format is one module. They read and write text or streams; opening files is the caller's
//! business.

pub mod eulumdat;
mod fields;
pub mod ies;
pub mod lighttools_rays;
pub mod rays;
pub mod speos_rays;
pub mod text_rays;
pub mod tm25;
pub mod tm33;
pub mod zemax_rays;

use crate::error::Error;
use crate::source::Distribution;

pub use bsdf::formats::text::{FormatError, Position, utf8};

/// By how much the flux of relative photometry may exceed that of its lamps: files state both
/// rounded, and intensities at few angles.
pub const GAIN_TOLERANCE: f64 = 0.05;
/// Largest number that a photometric file may hold: products of three are still numbers.
const LARGEST: f64 = 1e30;
/// Closest that angles of a photometric file may stand, degrees.
const CLOSEST_DEG: f64 = 1e-6;

/// Checks that the intensities of a file, the last of them on `line`, make a far field. Returns a
/// warning where it has more flux than `lamps` lumens, where those are stated: such files are
/// common, and their intensities are taken as they stand.
fn usable(
    table: Result<Distribution, Error>,
    lamps: Option<f64>,
    line: usize,
) -> Result<Option<String>, FormatError> {
    let flux = table
        .map_err(|e| FormatError::line(line, "intensities of a far field", e.to_string()))?
        .flux();
    let stated = lamps.filter(|lamps| flux > lamps * (1.0 + GAIN_TOLERANCE));
    Ok(stated.map(|lamps| {
        format!(
            "the intensities add up to {flux:.6} lm, more than the {lamps} lm that the file states for its lamps; they are taken as they stand"
        )
    }))
}

/// The text of a photometric file: UTF-8 where it is, else every byte one character (Latin-1), as
/// the names in older files need it.
///
/// # Errors
/// If it is UTF-16 or holds zero bytes.
pub fn photometric_text(bytes: &[u8]) -> Result<String, FormatError> {
    match utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) if error.got.starts_with("byte") => {
            Ok(bytes.iter().map(|&b| char::from(b)).collect())
        }
        Err(error) => Err(error),
    }
}
