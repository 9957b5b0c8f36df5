// SPDX-License-Identifier: MIT OR Apache-2.0
//! Refractive index n + ik of a material against vacuum wavelength in micrometres.
//!
//! In: a constant, a dispersion [`Formula`] with its coefficients, a table, or the text of a data
//! file of refractiveindex.info or of a glass catalogue. Out: [`RefractiveIndex`] at a wavelength.
//! Nothing is extrapolated: a wavelength outside the data's range is an error. Tables are interpolated
//! linearly in the wavelength, n and k apart; k ≥ 0 absorbs. Data format and formulas:
//! [Polyanskiy 2024, Scientific Data 11, 94].
//!
//! ```
//! use rcwa::material::{Formula, Material};
//!
//! let bk7 = [0.0, 1.039_612_12, 0.006_000_698_67, 0.231_792_344, 0.020_017_914_4, 1.010_469_45, 103.560_653];
//! let glass = Material::formula(Formula::Sellmeier2, &bk7, [0.3, 2.5])?;
//! assert!((glass.index_at(0.587_561_8)?.n() - 1.5168).abs() < 5e-5);
//! assert!(glass.index_at(3.0).is_err());
//! # Ok::<(), rcwa::material::MaterialError>(())
//! ```

mod agf;
mod csv;
mod formula;
mod table;
#[cfg(test)]
mod tests;
mod yaml;

use num_complex::Complex64;
use thiserror::Error;

pub use formula::Formula;
use table::Table;

/// Why a material, or its index at a wavelength, was refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// A wavelength that is none.
    #[error("the wavelength must be finite and above 0 micrometres, got {got}")]
    Wavelength {
        /// The value.
        got: f64,
    },
    /// A wavelength the data do not cover.
    #[error("the data cover {min} to {max} micrometres, got the wavelength {got}")]
    OutOfRange {
        /// The wavelength asked for, in micrometres.
        got: f64,
        /// Shortest wavelength covered.
        min: f64,
        /// Longest wavelength covered.
        max: f64,
    },
    /// A range of wavelengths that is none.
    #[error(
        "a range of wavelengths needs 0 < min <= max, both finite, got {min} to {max} micrometres"
    )]
    Range {
        /// The begin.
        min: f64,
        /// The end.
        max: f64,
    },
    /// An index no passive material has.
    #[error(
        "a refractive index n + ik needs finite n >= 0 and k >= 0 that are not both 0, got [{n}, {k}]"
    )]
    Index {
        /// The real part.
        n: f64,
        /// The imaginary part.
        k: f64,
    },
    /// A formula with the wrong number of coefficients.
    #[error("{formula:?} takes {expected} coefficients, got {got}")]
    Coefficients {
        /// The formula.
        formula: Formula,
        /// The allowed numbers in words.
        expected: &'static str,
        /// Number given.
        got: usize,
    },
    /// A coefficient is infinite or not a number.
    #[error("coefficient {place} must be finite, got {got}")]
    Coefficient {
        /// The place, from 1 as in the formulas.
        place: usize,
        /// The value.
        got: f64,
    },
    /// A formula that gives no real index at a wavelength.
    #[error("{formula:?} gives no real index above 0 at {wavelength} micrometres")]
    NoIndex {
        /// The formula.
        formula: Formula,
        /// The wavelength.
        wavelength: f64,
    },
    /// A table without rows.
    #[error("a table needs at least one row")]
    EmptyTable,
    /// A table holds a value that is no number.
    #[error("row {row}: expected finite numbers, got {got}")]
    Value {
        /// The row, from 1.
        row: usize,
        /// The value.
        got: f64,
    },
    /// Data that give no passive index at a wavelength.
    #[error(
        "at {wavelength} micrometres the data give [{n}, {k}]: expected n >= 0 and k >= -{SLIGHT_GAIN}, not both 0"
    )]
    Active {
        /// The wavelength, in micrometres.
        wavelength: f64,
        /// The real part.
        n: f64,
        /// The imaginary part.
        k: f64,
    },
    /// A line of a data file that does not belong there.
    #[error("line {line}: expected {expected}, got {got:?}")]
    Line {
        /// The line, from 1.
        line: usize,
        /// The content expected.
        expected: &'static str,
        /// The content found.
        got: String,
    },
    /// Something in an entry of a data file is wrong as a whole.
    #[error("DATA entry at line {line}: {problem}")]
    Entry {
        /// The line on which the entry begins, from 1.
        line: usize,
        /// The problem.
        problem: Box<MaterialError>,
    },
    /// A key given twice.
    #[error("line {line}: {key} is given a second time")]
    Twice {
        /// The line of the second, from 1.
        line: usize,
        /// The quantity that is given twice.
        key: String,
    },
    /// A glass that a catalogue does not have, or none of several.
    #[error("expected {expected}, got {got}")]
    Glass {
        /// What it could be.
        expected: String,
        /// The name.
        got: String,
    },
    /// Something a data file needs is not there.
    #[error("{0} is missing")]
    Missing(&'static str),
}

/// Largest -k of measured data that is taken for an error of measurement, and k for 0.
pub const SLIGHT_GAIN: f64 = 1e-2;

/// k, or 0 for one below 0 by no more than [`SLIGHT_GAIN`].
fn passive(k: f64) -> f64 {
    if (-SLIGHT_GAIN..0.0).contains(&k) { 0.0 } else { k }
}

/// Refractive index n + ik of a passive material: finite, n ≥ 0, k ≥ 0, not 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefractiveIndex(Complex64);

impl RefractiveIndex {
    /// The index n + ik.
    ///
    /// # Errors
    /// [`MaterialError::Index`] if a part is negative or not finite, or both are 0.
    pub fn new(n: f64, k: f64) -> Result<Self, MaterialError> {
        let passive = n.is_finite() && k.is_finite() && n >= 0.0 && k >= 0.0;
        if passive && (n > 0.0 || k > 0.0) {
            // Adding zero makes -0 a 0, on which branches of square roots hang.
            Ok(Self(Complex64::new(n + 0.0, k + 0.0)))
        } else {
            Err(MaterialError::Index { n, k })
        }
    }

    /// Real part: phase.
    pub fn n(self) -> f64 {
        self.0.re
    }

    /// Imaginary part: absorption.
    pub fn k(self) -> f64 {
        self.0.im
    }

    /// n + ik as a complex number.
    pub fn complex(self) -> Complex64 {
        self.0
    }
}

/// Refractive index against vacuum wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    n: Source,
    k: Source,
}

/// Source of one of n and k.
#[derive(Debug, Clone, PartialEq)]
enum Source {
    Constant(f64),
    Formula { formula: Formula, coefficients: Vec<f64>, range: [f64; 2] },
    Table(Table),
}

impl Material {
    /// The same index at every wavelength.
    pub fn constant(index: RefractiveIndex) -> Self {
        Self { n: Source::Constant(index.n()), k: Source::Constant(index.k()) }
    }

    /// A lossless material by a dispersion formula (wavelength in micrometres), valid over the
    /// range [min, max] in micrometres.
    ///
    /// # Errors
    /// A number of coefficients the formula does not take, one that is not finite, a bad range.
    pub fn formula(
        formula: Formula,
        coefficients: &[f64],
        range_um: [f64; 2],
    ) -> Result<Self, MaterialError> {
        Ok(Self { n: formula_source(formula, coefficients, range_um)?, k: Source::Constant(0.0) })
    }

    /// A table of rows [wavelength in micrometres, n, k], in any order; rows of one wavelength
    /// become one with their mean.
    ///
    /// # Errors
    /// No rows, wavelengths that are none, infinite values.
    pub fn tabulated(rows: &[[f64; 3]]) -> Result<Self, MaterialError> {
        let n = Table::new(rows.iter().map(|r| [r[0], r[1]]).collect())?;
        let k = Table::new(rows.iter().map(|r| [r[0], r[2]]).collect())?;
        Ok(Self { n: Source::Table(n), k: Source::Table(k) })
    }

    /// A material from the text of a data file in refractiveindex.info's YAML form.
    ///
    /// Read are the entries of the list `DATA`: `type` (`tabulated nk`, `tabulated n`, `tabulated
    /// k` or `formula 1` to `formula 9`), `data`, `coefficients`, `wavelength_range` (`range` in
    /// older files); one entry gives n, at most one other k (else 0). All other top-level keys are
    /// skipped; any other key in an entry is an error.
    ///
    /// # Errors
    /// The line and what was expected there, or the entry and what is wrong with it.
    pub fn from_yaml(text: &str) -> Result<Self, MaterialError> {
        yaml::parse(text)
    }

    /// A material from the text of a data file: YAML as of [`Material::from_yaml`] or CSV of
    /// refractiveindex.info, or the `glass` of a catalogue (`.agf`), which needs no name where it is
    /// the only one.
    ///
    /// # Errors
    /// The line and what was expected there; a glass that is not there.
    pub fn from_text(text: &str, glass: Option<&str>) -> Result<Self, MaterialError> {
        let text = text.trim_start_matches('\u{feff}');
        if text.lines().any(agf::is_name) {
            return agf::parse(text, glass);
        }
        if let Some(glass) = glass {
            let expected = "a catalogue, which has lines NM, for a glass".to_owned();
            return Err(MaterialError::Glass { expected, got: glass.to_owned() });
        }
        let is_text = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
        if text.lines().find(is_text).is_some_and(csv::is_heading) {
            csv::parse(text)
        } else {
            yaml::parse(text)
        }
    }

    /// The material of these data, over the range that both cover; k is 0 without any.
    fn paired(n: Source, k: Option<Source>) -> Result<Self, MaterialError> {
        let material = Self { n, k: k.unwrap_or(Source::Constant(0.0)) };
        let [min, max] = material.range_um();
        if min > max {
            return Err(MaterialError::Range { min, max });
        }
        Ok(material)
    }

    /// The index at a vacuum wavelength in micrometres.
    ///
    /// # Errors
    /// A wavelength that is none or lies outside the data; a formula without a real root there; k
    /// below 0 by more than [`SLIGHT_GAIN`].
    pub fn index_at(&self, wavelength_um: f64) -> Result<RefractiveIndex, MaterialError> {
        let got = wavelength_um;
        if !(got.is_finite() && got > 0.0) {
            return Err(MaterialError::Wavelength { got });
        }
        let [min, max] = self.range_um();
        if got < min || got > max {
            return Err(MaterialError::OutOfRange { got, min, max });
        }
        let (n, k) = (self.n.at(got)?, self.k.at(got)?);
        let index = RefractiveIndex::new(n, passive(k));
        index.map_err(|_| MaterialError::Active { wavelength: got, n, k })
    }

    /// Repairs of its tables: rows that were out of order and are sorted, and rows of one wavelength
    /// that are one now, with the first wavelength of each kind.
    pub fn repairs(&self) -> Vec<String> {
        let tables = [&self.n, &self.k].into_iter().filter_map(|source| match source {
            Source::Table(table) => Some(table.repairs()),
            _ => None,
        });
        let said = |found: &[f64], what: &str| {
            let rows = if found.len() == 1 { "row" } else { "rows" };
            let first = found.first()?;
            Some(format!("{} {rows} {what}, the first at {first} micrometres", found.len()))
        };
        let lines = tables.flat_map(|[misplaced, repeated]| {
            let sorted = said(misplaced, "out of order, now sorted");
            let merged = said(repeated, "of several for one wavelength, now their mean");
            sorted.into_iter().chain(merged)
        });
        let mut all: Vec<String> = Vec::new();
        for line in lines {
            if !all.contains(&line) {
                all.push(line);
            }
        }
        all
    }

    /// The lowest k of a table, 0 where the data have none below 0: [`Material::index_at`] takes a
    /// k below 0 for 0.
    pub fn lowest_k(&self) -> f64 {
        match &self.k {
            Source::Table(table) => table.lowest().min(0.0),
            _ => 0.0,
        }
    }

    /// Shortest and longest wavelength, in micrometres, at which both n and k are known
    /// (0 and infinity for a constant).
    pub fn range_um(&self) -> [f64; 2] {
        let (n, k) = (self.n.range(), self.k.range());
        [n[0].max(k[0]), n[1].min(k[1])]
    }
}

impl Source {
    fn range(&self) -> [f64; 2] {
        match self {
            Self::Constant(_) => [0.0, f64::INFINITY],
            Self::Formula { range, .. } => *range,
            Self::Table(table) => table.range(),
        }
    }

    fn at(&self, wavelength: f64) -> Result<f64, MaterialError> {
        match self {
            Self::Constant(value) => Ok(*value),
            Self::Formula { formula, coefficients, .. } => formula
                .index(coefficients, wavelength)
                .ok_or(MaterialError::NoIndex { formula: *formula, wavelength }),
            Self::Table(table) => Ok(table.at(wavelength)),
        }
    }
}

/// A formula with coefficients and range checked.
fn formula_source(
    formula: Formula,
    coefficients: &[f64],
    range: [f64; 2],
) -> Result<Source, MaterialError> {
    formula.check(coefficients)?;
    let [min, max] = range;
    if !(min > 0.0 && min <= max && max.is_finite()) {
        return Err(MaterialError::Range { min, max });
    }
    Ok(Source::Formula { formula, coefficients: coefficients.to_vec(), range })
}
