// SPDX-License-Identifier: MIT OR Apache-2.0
//! Errors of outlines, sources and sizes.

/// Reason why a body is not solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FullWaveError {
    /// Outline.
    #[error("outline: expected {expected}, got {got}")]
    Outline {
        /// Condition that does not hold.
        expected: String,
        /// Value found.
        got: String,
    },
    /// Index, wavelength or fineness.
    #[error("{name}: expected a number above {above}, got {got}")]
    Number {
        /// Name of the value.
        name: &'static str,
        /// Bound.
        above: f64,
        /// Value found.
        got: f64,
    },
    /// Source that is outside or too close to the outline.
    #[error(
        "source {number} at ({x:.4}, {z:.4}): expected a place inside the outline and at least {distance:.4} from it, got {got}"
    )]
    Source {
        /// Number of the source from 1.
        number: usize,
        /// Place across.
        x: f64,
        /// Place along the axis.
        z: f64,
        /// Least distance.
        distance: f64,
        /// Distance found, or "outside".
        got: String,
    },
    /// Matrix beyond the limit.
    #[error(
        "memory: expected at most {limit:.3} GiB, got {needed:.3} GiB for {unknowns} unknowns ({width:.1} wavelengths of outline)"
    )]
    Memory {
        /// GiB that may be used.
        limit: f64,
        /// GiB needed.
        needed: f64,
        /// Size of the largest matrix.
        unknowns: usize,
        /// Length of the outline in wavelengths inside.
        width: f64,
    },
    /// Resonance too sharp for single precision.
    #[error(
        "solution: expected refinement to converge, got a correction of {correction:.0e}; the wavelength meets a resonance, a change in its fifth digit leaves it"
    )]
    Resonance {
        /// Norm of the last correction over that of the solution.
        correction: f64,
    },
}
