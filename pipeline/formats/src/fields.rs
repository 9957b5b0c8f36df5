// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fields of a photometric text file, read in order: words, checked numbers, ascending angles.

use tracer::Distribution;

use crate::text::{FormatError, utf8};
use crate::text::{parse_number, quoted};

/// The fields that are left, each with the number of its line.
pub(crate) struct Fields<'a> {
    rest: std::vec::IntoIter<(usize, &'a str)>,
    /// Line of the last field read.
    pub line: usize,
    /// The line that is named where a field is missing.
    end: usize,
}

impl<'a> Fields<'a> {
    pub fn new(fields: Vec<(usize, &'a str)>, end: usize) -> Self {
        Self { rest: fields.into_iter(), line: end, end }
    }

    /// Number of fields left.
    pub fn left(&self) -> usize {
        self.rest.len()
    }

    /// The next field as text.
    pub fn text(&mut self, what: &str) -> Result<&'a str, FormatError> {
        let missing = || FormatError::line(self.end, what, "the end of the file");
        let (line, field) = self.rest.next().ok_or_else(missing)?;
        self.line = line;
        Ok(field)
    }

    /// A finite number.
    pub fn real(&mut self, what: &str) -> Result<f64, FormatError> {
        let field = self.text(what)?;
        parse_number(field, self.line, what)
    }

    /// A finite number that `holds`.
    pub fn real_that(
        &mut self,
        what: &str,
        expected: &str,
        holds: impl Fn(f64) -> bool,
    ) -> Result<f64, FormatError> {
        let field = self.text(what)?;
        let value = parse_number(field, self.line, what)?;
        if holds(value) {
            Ok(value)
        } else {
            let expected = format!("{what}: {expected}");
            Err(FormatError::line(self.line, expected, quoted(field)))
        }
    }

    /// A whole number within `low..=high`; some files write 1.0.
    pub fn whole(&mut self, what: &str, low: i32, high: i32) -> Result<i32, FormatError> {
        let expected = format!("a whole number from {low} to {high}");
        let value = self.real_that(what, &expected, |v| {
            v.fract() == 0.0 && v >= f64::from(low) && v <= f64::from(high)
        })?;
        Ok(value as i32)
    }

    /// A whole number from `low` to the larger one of `low` and `high`.
    pub fn count(&mut self, what: &str, low: i32, high: usize) -> Result<usize, FormatError> {
        let high = i32::try_from(high).unwrap_or(i32::MAX);
        Ok(self.whole(what, low, high.max(low))? as usize)
    }

    /// Ascending angles from 0 to `high` degrees.
    pub fn angles(&mut self, what: &str, count: usize, high: f64) -> Result<Vec<f64>, FormatError> {
        let mut angles: Vec<f64> = Vec::new();
        for _ in 0..count {
            let before = angles.last().copied();
            let expected = before.map_or_else(
                || format!("0 to {high} degrees"),
                |b| format!("above {b}, at most {high} degrees"),
            );
            let above = |a: f64| before.is_none_or(|b| a >= b + CLOSEST_DEG);
            let holds = |a: f64| (0.0..=high).contains(&a) && above(a);
            angles.push(self.real_that(what, &expected, holds)?);
        }
        Ok(angles)
    }
}

/// By how much the flux of relative photometry may exceed that of its lamps: files state both
/// rounded, and intensities at few angles.
pub const GAIN_TOLERANCE: f64 = 0.05;
/// Largest number that a photometric file may hold: products of three are still numbers.
pub(crate) const LARGEST: f64 = 1e30;
/// Closest that angles of a photometric file may stand, degrees.
const CLOSEST_DEG: f64 = 1e-6;

/// Checks that the intensities of a file, the last of them on `line`, make a far field. Returns a
/// warning where it has more flux than `lamps` lumens, where those are stated: such files are
/// common, and their intensities are taken as they stand.
pub(crate) fn usable(
    table: Result<Distribution, tracer::Error>,
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
