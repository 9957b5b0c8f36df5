// SPDX-License-Identifier: MIT OR Apache-2.0
//! Errors of this crate: one variant a cause, each with the expectation and the value found.

/// Invalid input of this crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A length that must be positive and finite.
    #[error("{name} must be a positive, finite length, got {value}")]
    Length {
        /// Name of the length.
        name: &'static str,
        /// Value found.
        value: f64,
    },
    /// A refractive index that must be positive and finite.
    #[error("refractive index of {name} must be positive and finite, got {value}")]
    Index {
        /// Of which medium.
        name: String,
        /// Value found.
        value: f64,
    },
    /// A fraction outside 0 to 1.
    #[error("{name} must lie between 0 and 1, got {value}")]
    Fraction {
        /// Name of the quantity.
        name: &'static str,
        /// Value found.
        value: f64,
    },
    /// Shares of a diffuser that give more power than comes in.
    #[error(
        "shares of a diffuser must add up to at most 1, got {reflected} reflected and {transmitted} transmitted"
    )]
    Shares {
        /// Reflected share.
        reflected: f64,
        /// Transmitted share.
        transmitted: f64,
    },
    /// Angles of incidence of a polariser that do not ascend from 0 to 90 degrees.
    #[error("angles of incidence of a polariser must ascend from 0 to 90 degrees")]
    Angles,
    /// Shares of an axis of a polariser that give more power than comes in.
    #[error(
        "transmittance and reflectance of an axis must add up to at most 1, got {transmitted} and {reflected} at {angle} degrees"
    )]
    AxisGain {
        /// Angle of incidence, degrees.
        angle: f64,
        /// Transmittance.
        transmitted: f64,
        /// Reflectance.
        reflected: f64,
    },
    /// A Gaussian lobe that is too narrow or too wide.
    #[error(
        "full width at half maximum of a Gaussian lobe must lie between {min} and {max} degrees, got {value}"
    )]
    Width {
        /// Least width, degrees.
        min: f64,
        /// Largest width, degrees.
        max: f64,
        /// Value found, degrees.
        value: f64,
    },
    /// Jones matrices that contradict their table.
    #[error("matrices at {node}: expected {expected}, got {got}")]
    Matrices {
        /// Node of incidence.
        node: String,
        /// Expected value.
        expected: &'static str,
        /// Value found.
        got: String,
    },
    /// An invalid grid of incident wavevectors.
    #[error("grid of incident wavevectors: {0}")]
    Grid(String),
    /// A quantity in the header of a table that is negative or not finite.
    #[error("table header: {name} must be finite and not negative, got {value}")]
    Header {
        /// Name of the quantity.
        name: &'static str,
        /// Value found.
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
    UnpolarisedRow,
    /// An invalid efficiency of a diffraction order.
    #[error("efficiency of {order}: expected {expected}, got {value}")]
    Efficiency {
        /// Relative order, the side it leaves on, and its node of incidence.
        order: String,
        /// Expected value.
        expected: &'static str,
        /// Value found.
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
    /// An invalid resolution of a file.
    #[error("resolution of a file: {0}")]
    Resolution(String),
    /// An invalid outline of a unit cell.
    #[error("unit cell: {0}")]
    Cell(String),
    /// A file of another format.
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
        /// End.
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
        /// Name of the part.
        part: &'static str,
        /// Expected value.
        expected: String,
        /// Value found.
        got: String,
    },
    /// An invalid JSON header.
    #[error("table header is not valid: {0}")]
    Json(serde_json::Error),
    /// An invalid table of measured scattering.
    #[error("measured scattering: {0}")]
    Measured(String),
    /// Reading or writing failed.
    #[error("table could not be read or written: {0}")]
    Io(std::io::Error),
}

// The messages of these two hold their cause: as a source it would be printed twice.
impl From<serde_json::Error> for Error {
    fn from(error: serde_json::Error) -> Self {
        Self::Json(error)
    }
}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

impl Error {
    /// `value` if it is a positive, finite length.
    pub(crate) fn check_length(name: &'static str, value: f64) -> Result<f64, Self> {
        if value.is_finite() && value > 0.0 { Ok(value) } else { Err(Self::Length { name, value }) }
    }

    /// `value` if it is a positive, finite refractive index.
    pub(crate) fn check_index(name: &str, value: f64) -> Result<f64, Self> {
        if value.is_finite() && value > 0.0 {
            Ok(value)
        } else {
            Err(Self::Index { name: name.to_owned(), value })
        }
    }

    /// `value` if it lies between 0 and 1.
    pub(crate) fn check_fraction(name: &'static str, value: f64) -> Result<f64, Self> {
        if (0.0..=1.0).contains(&value) { Ok(value) } else { Err(Self::Fraction { name, value }) }
    }
}
