// SPDX-License-Identifier: MIT OR Apache-2.0
//! What can be wrong with what this crate is given: one variant a cause, each saying what was expected and got.

use crate::direction::Side;
use crate::orders::NodeId;
use crate::scatter::Polarization;

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
    /// Jones matrices that do not fit their table.
    #[error(
        "matrices of the node of {side} incidence with kx index {kx_index} and ky index {ky_index}: expected {expected}, got {got}"
    )]
    Matrices {
        /// Side of incidence.
        side: Side,
        /// Index of kx.
        kx_index: i64,
        /// Index of ky.
        ky_index: usize,
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
    /// A row for an incidence that the grid does not have.
    #[error(
        "no node at side {side}, kx index {kx_index}, ky index {ky_index}: expected a propagating incidence of the grid"
    )]
    NoSuchNode {
        /// Side of incidence.
        side: Side,
        /// Index of kx.
        kx_index: i64,
        /// Index of ky.
        ky_index: usize,
    },
    /// A row given twice.
    #[error(
        "two rows for side {side}, kx index {kx_index}, ky index {ky_index}, {polarization:?}: expected one"
    )]
    NodeTwice {
        /// Side of incidence.
        side: Side,
        /// Index of kx.
        kx_index: i64,
        /// Index of ky.
        ky_index: usize,
        /// Its polarisation.
        polarization: Polarization,
    },
    /// A row that never came.
    #[error(
        "no row for side {side}, kx index {kx_index}, ky index {ky_index}, {polarization:?}: expected one for every node"
    )]
    NodeMissing {
        /// Side of incidence.
        side: Side,
        /// Index of kx.
        kx_index: i64,
        /// Index of ky.
        ky_index: usize,
        /// Its polarisation.
        polarization: Polarization,
    },
    /// A row for unpolarised light, which a table does not store.
    #[error("rows are given for s and p apart, got one for unpolarised light")]
    UnpolarizedRow,
    /// A share that is no share.
    #[error(
        "share of relative order {order} to the {to} side at side {side}, kx index {kx_index}, ky index {ky_index}: \
         expected {expected}, got {value}"
    )]
    Share {
        /// Side of incidence.
        side: Side,
        /// Index of kx.
        kx_index: i64,
        /// Index of ky.
        ky_index: usize,
        /// Side that the order leaves on.
        to: Side,
        /// Relative order.
        order: i32,
        /// What was expected.
        expected: &'static str,
        /// What it was.
        value: f64,
    },
    /// More power out than in.
    #[error(
        "shares at side {side}, kx index {kx_index}, ky index {ky_index} sum to {sum}, expected at most 1"
    )]
    Gain {
        /// Side of incidence.
        side: Side,
        /// Index of kx.
        kx_index: i64,
        /// Index of ky.
        ky_index: usize,
        /// Sum of all shares of one polarisation.
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
    Format(#[from] crate::format::text::FormatError),
    /// A table of measured scattering that cannot be sampled.
    #[error("measured scattering: {0}")]
    Measured(String),
    /// Reading or writing failed.
    #[error("table could not be read or written: {0}")]
    Io(#[from] std::io::Error),
}

impl Error {
    /// Matrices of `node` that are not what was expected.
    pub(crate) fn matrices(node: NodeId, expected: &'static str, got: String) -> Self {
        Self::Matrices {
            side: node.side,
            kx_index: node.kx_index,
            ky_index: node.ky_index,
            expected,
            got,
        }
    }

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
