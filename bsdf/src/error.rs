// SPDX-License-Identifier: MIT OR Apache-2.0
//! What can be wrong with what this crate is given: one variant a cause, each saying what was expected and got.

use std::fmt;

/// Everything that this crate refuses.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A length that must be positive and finite.
    #[error("{name} must be a positive, finite length, got {value}")]
    Length {
        /// Which length.
        name: &'static str,
        /// What it was.
        value: f64,
    },
    /// A refractive index that must be positive and finite.
    #[error("refractive index of {name} must be positive and finite, got {value}")]
    Index {
        /// Of which medium.
        name: String,
        /// What it was.
        value: f64,
    },
    /// A share of power outside 0 to 1.
    #[error("{name} must lie between 0 and 1, got {value}")]
    Fraction {
        /// Which quantity.
        name: &'static str,
        /// What it was.
        value: f64,
    },
    /// Jones matrices that contradict their table.
    #[error("matrices at {node}: expected {expected}, got {got}")]
    Matrices {
        /// Node of incidence.
        node: String,
        /// What was expected.
        expected: &'static str,
        /// What was there.
        got: String,
    },
    /// A grid of incident wavevectors that cannot be used.
    #[error("grid of incident wavevectors: {0}")]
    Grid(String),
    /// A quantity in the header of a table that is not a finite number.
    #[error("table header: {name} must be finite and not negative, got {value}")]
    Header {
        /// Which quantity.
        name: &'static str,
        /// What it was.
        value: f64,
    },
    /// A row for an incidence outside the grid.
    #[error("no node at {node}: expected a propagating incidence of the grid")]
    NoSuchNode {
        /// Node of incidence.
        node: String,
    },
    /// A row given twice.
    #[error("two rows for {row}: expected one")]
    NodeTwice {
        /// Node and polarisation.
        row: String,
    },
    /// A missing row.
    #[error("no row for {row}: expected one for every node")]
    NodeMissing {
        /// Node and polarisation.
        row: String,
    },
    /// A row for unpolarised light, which a table does not store.
    #[error("rows are given for s and p apart, got one for unpolarised light")]
    UnpolarizedRow,
    /// An invalid efficiency of a diffraction order.
    #[error("efficiency of {order}: expected {expected}, got {value}")]
    Efficiency {
        /// Relative order, the side it leaves on, and its node of incidence.
        order: String,
        /// What was expected.
        expected: &'static str,
        /// What it was.
        value: f64,
    },
    /// More power out than in.
    #[error("efficiencies at {node} sum to {sum}, expected at most 1")]
    Gain {
        /// Node of incidence.
        node: String,
        /// Sum of all efficiencies of one polarisation.
        sum: f64,
    },
    /// A resolution of a file that is none.
    #[error("resolution of a file: {0}")]
    Resolution(String),
    /// An outline of a unit cell that cannot be traced.
    #[error("unit cell: {0}")]
    Cell(String),
    /// Not a file of this format.
    #[error(
        "not a table of diffraction orders: expected it to begin with {expected:?}, got {got:?}"
    )]
    Magic {
        /// First bytes expected.
        expected: String,
        /// First bytes found.
        got: String,
    },
    /// A file of another version of the format.
    #[error("table format version {got}, expected {expected}")]
    Version {
        /// The version that this crate reads.
        expected: u32,
        /// The version found.
        got: u32,
    },
    /// A file that ends too early.
    #[error("table is truncated in its {part}: expected {expected} bytes, got {got}")]
    Truncated {
        /// Where it ends.
        part: &'static str,
        /// Bytes expected in that part.
        expected: u64,
        /// Bytes found.
        got: u64,
    },
    /// A file that goes on after its end.
    #[error("table is followed by more bytes: expected the end after {expected}")]
    TrailingBytes {
        /// Length that the file states.
        expected: u64,
    },
    /// A file whose content changed after it was written.
    #[error("table is altered: expected SHA-256 {expected}, got {got}")]
    Checksum {
        /// Checksum stored in the file.
        expected: String,
        /// Checksum of what was read.
        got: String,
    },
    /// A file whose parts contradict each other.
    #[error("table contradicts itself in {part}: expected {expected}, got {got}")]
    Inconsistent {
        /// Which part.
        part: &'static str,
        /// What was expected.
        expected: String,
        /// What was found.
        got: String,
    },
    /// A header that is not the JSON text it should be.
    #[error("table header is not valid: {0}")]
    Json(#[from] serde_json::Error),
    /// A file of another program that does not keep to its format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A table of measured scattering that cannot be sampled.
    #[error("measured scattering: {0}")]
    Measured(String),
    /// Reading or writing failed.
    #[error("table could not be read or written: {0}")]
    Io(#[from] std::io::Error),
}

impl Error {
    /// `value` if it is a positive, finite length.
    pub(crate) fn check_length(name: &'static str, value: f64) -> Result<f64, Self> {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(Self::Length { name, value })
        }
    }

    /// `value` if it is a positive, finite refractive index.
    pub(crate) fn check_index(name: &str, value: f64) -> Result<f64, Self> {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(Self::Index {
                name: name.to_owned(),
                value,
            })
        }
    }

    /// `value` if it lies between 0 and 1.
    pub(crate) fn check_fraction(name: &'static str, value: f64) -> Result<f64, Self> {
        if (0.0..=1.0).contains(&value) {
            Ok(value)
        } else {
            Err(Self::Fraction { name, value })
        }
    }
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// Line of a text, from 1.
    Line(usize),
    /// Byte from the beginning, from 0.
    Offset(u64),
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Offset(offset) => write!(f, "offset {offset}"),
        }
    }
}

/// Something in a file that its format does not allow.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{at}: expected {expected}, got {got}")]
pub struct FormatError {
    /// Where.
    pub at: Position,
    /// What the format asks for there.
    pub expected: String,
    /// What stands there.
    pub got: String,
}

impl FormatError {
    /// At a line of a text.
    pub fn line(line: usize, expected: impl Into<String>, got: impl Into<String>) -> Self {
        Self {
            at: Position::Line(line),
            expected: expected.into(),
            got: got.into(),
        }
    }

    /// At a byte of a file.
    pub fn offset(offset: u64, expected: impl Into<String>, got: impl Into<String>) -> Self {
        Self {
            at: Position::Offset(offset),
            expected: expected.into(),
            got: got.into(),
        }
    }
}
