// SPDX-License-Identifier: MIT OR Apache-2.0
//! Why the integral equations were refused, a variant per cause.

use num_complex::Complex64;
use rcwa::Side;
use rcwa::relief::ReliefError;

/// Error of the solver by integral equations.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IntegralError {
    /// A length or another number that must be positive is not.
    #[error("{what}: expected a finite number above 0, got {got}")]
    Positive {
        /// Which number.
        what: &'static str,
        /// Its value.
        got: f64,
    },
    /// An index that no passive medium has.
    #[error(transparent)]
    Index(#[from] ReliefError),
    /// Something in the relief is neither of the two media.
    #[error(
        "{what}: expected the index of a half-space, {} or {}, got {}; one surface between two media is all that is solved here",
        pair(*top), pair(*bottom), pair(*got)
    )]
    ThirdMedium {
        /// What it is.
        what: String,
        /// Its index.
        got: Complex64,
        /// Index of the top half-space.
        top: Complex64,
        /// Index of the bottom half-space.
        bottom: Complex64,
    },
    /// The two media are the same: there is no surface.
    #[error("expected two different media, got {} above and below", pair(*index))]
    NoSurface {
        /// Their index.
        index: Complex64,
    },
    /// A body or a hole apart from the surface between the half-spaces.
    #[error(
        "expected one surface from x = 0 to x = {period}, got {closed} closed outline(s) besides it"
    )]
    Islands {
        /// Number of closed outlines.
        closed: usize,
        /// The period.
        period: f64,
    },
    /// The surface touches itself.
    #[error("expected a surface that does not touch itself, but more than two sides meet at [{}, {}]", at[0], at[1])]
    Touching {
        /// Where.
        at: [f64; 2],
    },
    /// Corners that are no outline of a surface.
    #[error("surface: {problem}")]
    Outline {
        /// What is wrong.
        problem: String,
    },
    /// A resolution out of its range.
    #[error("{what}: expected {expected}, got {got}")]
    Fineness {
        /// Which number.
        what: &'static str,
        /// The allowed range in words.
        expected: &'static str,
        /// Its value.
        got: f64,
    },
    /// A component of the wavevector is not a finite number.
    #[error("kx0: expected a finite number, got {got}")]
    Wavevector {
        /// Its value.
        got: f64,
    },
    /// An order so near its cut-off that the Green's function does not exist in practice.
    #[error(
        "order {order} in the {} half-space has |kz| = {kz:.1e} k0 and needs more than {most} nodes on a contour: expected a direction off its cut-off and a period not far below the wavelength",
        side.name()
    )]
    CutOff {
        /// The order.
        order: i32,
        /// Its half-space.
        side: Side,
        /// |kz| in units of k0.
        kz: f64,
        /// Nodes of the contour allowed.
        most: usize,
    },
    /// Stopped by the caller.
    #[error("stopped")]
    Stopped,
    /// More unknowns than are sensible.
    #[error(
        "{nodes} nodes on the surface are more than {most}: expected a shorter period or less relief"
    )]
    TooLarge {
        /// Nodes needed.
        nodes: usize,
        /// Nodes allowed.
        most: usize,
    },
}

/// An index as case files write it.
fn pair(n: Complex64) -> String {
    format!("[{}, {}]", n.re, n.im)
}

/// Refuses a number that is not finite and above 0.
pub(super) fn positive(what: &'static str, got: f64) -> Result<(), IntegralError> {
    if got.is_finite() && got > 0.0 { Ok(()) } else { Err(IntegralError::Positive { what, got }) }
}

/// The error of an outline that makes no surface.
pub(super) fn outline(problem: impl Into<String>) -> IntegralError {
    IntegralError::Outline { problem: problem.into() }
}
