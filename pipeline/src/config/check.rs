// SPDX-License-Identifier: MIT OR Apache-2.0
//! The checks that every key goes through: each failure names file, key, value and what was expected.

use std::fmt::Display;

use serde::Serialize;

use super::error::ConfigError;

/// Most letters of a name of files, which get endings and stand in folders.
const MOST_LETTERS: usize = 100;

/// Names the file in every complaint.
pub(super) struct Context<'a> {
    pub(super) file: &'a str,
}

impl Context<'_> {
    pub(super) fn value(&self, key: &str, got: impl Display, expected: &str) -> ConfigError {
        ConfigError::Value {
            file: self.file.to_owned(),
            key: key.to_owned(),
            got: got.to_string(),
            expected: expected.to_owned(),
        }
    }

    /// What is wrong with a file, after the key that names it.
    pub(super) fn of_files(&self, error: &anyhow::Error) -> ConfigError {
        ConfigError::Files {
            file: self.file.to_owned(),
            message: format!("{error:#}"),
        }
    }

    pub(super) fn length(&self, key: &str, value: f64) -> Result<f64, ConfigError> {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(self.value(key, value, "a finite length above 0"))
        }
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
        let usable = (1..=MOST_LETTERS).contains(&name.len())
            && name
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
            && !name.starts_with('.');
        if usable {
            return Ok(());
        }
        let expected = format!(
            "letters, digits, '-', '_' and '.' only, at most {MOST_LETTERS}: it names output files"
        );
        Err(self.value(key, format!("{name:?}"), &expected))
    }

    /// Keys of one kind of table, each with what is given and whether it belongs to this kind: those of other kinds are refused, as they would be
    /// overlooked, and those of this kind must be there unless they are `optional`.
    pub(super) fn of_kind(
        &self,
        key: &impl Fn(&str) -> String,
        keys: &[(&str, Option<String>, bool)],
        optional: &[&str],
    ) -> Result<(), ConfigError> {
        for (name, given, belongs) in keys {
            if let (Some(given), false) = (given, belongs) {
                return Err(self.value(&key(name), given, "no such key for this kind"));
            }
            if *belongs && given.is_none() && !optional.contains(name) {
                return Err(self.value(&key(name), "missing", "a value, for this kind"));
            }
        }
        Ok(())
    }
}

/// A value, if there is one, as messages show it.
pub(super) fn shown<T: Serialize>(value: Option<&T>) -> Option<String> {
    value.and_then(|value| serde_json::to_string(value).ok())
}

/// Whether `whole` is a multiple of `part` but for rounding.
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
