// SPDX-License-Identifier: MIT OR Apache-2.0
//! The checks that every key goes through: each failure names file, key, value and what was
//! expected.

use std::fmt::Display;

use glam::DVec3;
use runtime::serde_messages::readable;

use super::error::ConfigError;

/// Least length of anything that is built, mm: a nanometre, some atoms.
pub(super) const MIN_LENGTH_MM: f64 = 1e-6;

/// Largest length, mm: ten metres.
pub(super) const MAX_LENGTH_MM: f64 = 1e4;

/// Most letters of a name of files, which get endings and stand in folders.
const MAX_LETTERS: usize = 100;

/// A limit as messages show it: `0.001`, `1e-12`, `1e9`.
fn limit(number: f64) -> String {
    let plain = number == 0.0 || (1e-3..1e6).contains(&number.abs());
    if plain { number.to_string() } else { format!("{number:e}") }
}

/// Names the file in every complaint, and the table of the key; those of [`of_files`](Self::of_files)
/// name the whole key themselves.
pub(super) struct Context<'a> {
    pub(super) file: &'a str,
    /// What stands before keys: nothing, or `receivers[1].`.
    pub(super) prefix: &'a str,
}

impl<'a> Context<'a> {
    /// That of keys of the file.
    pub(super) fn new(file: &'a str) -> Self {
        Self { file, prefix: "" }
    }

    pub(super) fn value(&self, key: &str, got: impl Display, expected: &str) -> ConfigError {
        ConfigError::Value {
            file: self.file.to_owned(),
            key: [self.prefix, key].concat(),
            got: readable(&got.to_string()),
            expected: expected.to_owned(),
        }
    }

    /// Error of a file, after the key that names it.
    pub(super) fn of_files(&self, error: &anyhow::Error) -> ConfigError {
        ConfigError::Files { file: self.file.to_owned(), message: format!("{error:#}") }
    }

    /// Refuses a list of so many `entries` that are not one for each of `packages` packages, or none.
    pub(super) fn one_for_each(
        &self,
        key: &str,
        entries: usize,
        packages: usize,
    ) -> Result<(), ConfigError> {
        if entries == 0 || entries == packages {
            return Ok(());
        }
        let expected = format!("an entry for each of the {packages} packages, or none");
        Err(self.value(key, format!("{entries} entries"), &expected))
    }

    /// A length in mm.
    pub(super) fn length(&self, key: &str, value: f64) -> Result<f64, ConfigError> {
        if (MIN_LENGTH_MM..=MAX_LENGTH_MM).contains(&value) {
            return Ok(value);
        }
        let expected = format!("a length from {MIN_LENGTH_MM:e} to {MAX_LENGTH_MM} mm");
        Err(self.value(key, value, &expected))
    }

    /// A length in µm.
    pub(super) fn length_um(&self, key: &str, value: f64) -> Result<f64, ConfigError> {
        let [least, most] = [MIN_LENGTH_MM, MAX_LENGTH_MM].map(|length| 1e3 * length);
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        let expected = format!("a length from {least:e} to {most} um");
        Err(self.value(key, value, &expected))
    }

    /// A direction of any length.
    pub(super) fn direction(&self, key: &str, stated: [f64; 3]) -> Result<DVec3, ConfigError> {
        let direction = DVec3::from_array(stated);
        let length = direction.length();
        if direction.is_finite() && length > 0.0 && length.is_finite() {
            return Ok(direction.normalize());
        }
        let expected = "a direction, of any length above 0";
        Err(self.value(key, format!("{stated:?}"), expected))
    }

    pub(super) fn within(
        &self,
        key: &str,
        value: f64,
        low: f64,
        high: f64,
    ) -> Result<f64, ConfigError> {
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            let [low, high] = [low, high].map(limit);
            Err(self.value(key, value, &format!("a number from {low} to {high}")))
        }
    }

    pub(super) fn count(
        &self,
        key: &str,
        value: usize,
        low: usize,
        high: usize,
    ) -> Result<usize, ConfigError> {
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            Err(self.value(key, value, &format!("a whole number from {low} to {high}")))
        }
    }

    /// A name of output files and folders.
    pub(super) fn file_name(&self, key: &str, name: &str) -> Result<(), ConfigError> {
        let usable = (1..=MAX_LETTERS).contains(&name.len())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
            && !name.starts_with('.');
        if usable {
            return Ok(());
        }
        let expected = format!(
            "letters, digits, '-', '_' and '.' only, at most {MAX_LETTERS}: it names output files"
        );
        Err(self.value(key, format!("{name:?}"), &expected))
    }
}

/// True if `whole` is a multiple of `part` but for rounding.
pub(super) fn divides(part: f64, whole: f64) -> bool {
    let ratio = whole / part;
    (ratio - ratio.round()).abs() < 1e-9
}

/// `part` must divide `whole`.
pub(super) fn whole_division(
    at: &Context,
    key: &str,
    whole: f64,
    part: f64,
) -> Result<(), ConfigError> {
    if divides(part, whole) {
        Ok(())
    } else {
        Err(at.value(key, part, &format!("a divisor of {whole}")))
    }
}

/// `whole` must be a multiple of the value of `part`.
pub(super) fn whole_multiple(
    at: &Context,
    key: &str,
    whole: f64,
    (part, value): (&str, f64),
) -> Result<(), ConfigError> {
    if divides(value, whole) {
        Ok(())
    } else {
        Err(at.value(key, whole, &format!("a multiple of {part}, {value}")))
    }
}
