// SPDX-License-Identifier: MIT OR Apache-2.0
//! Errors of this crate, a variant for each cause.

use crate::relief::ReliefError;
use crate::wave::{Pol, Side};
use num_complex::Complex64;

/// The resource that a search for a resolution has exhausted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Diffraction orders.
    Orders,
    /// Slices of the relief.
    Slices,
    /// Nodes of the wavevector along the grooves.
    Ky,
    /// Nodes of kx in a Brillouin zone.
    Kx,
    /// Work of one search.
    Work,
    /// Digits of a number: orders of a period far below the wavelength.
    Digits,
    /// Free memory.
    Memory,
}

impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Orders => "orders",
            Self::Slices => "slices",
            Self::Ky => "values of ky",
            Self::Kx => "kx in a Brillouin zone",
            Self::Work => "work",
            Self::Digits => "digits",
            Self::Memory => "memory",
        })
    }
}

/// The orders kept with `highest` as the highest one, as the beginning of a sentence: `orders -8..8
/// are kept`.
pub fn kept_orders(highest: usize) -> String {
    match highest {
        0 => "order 0 alone is kept".to_owned(),
        m => format!("orders -{m}..{m} are kept"),
    }
}

/// Error of this crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A length that must be positive is not.
    #[error("{what}: expected a finite length > 0, got {got}")]
    Length {
        /// Which length.
        what: &'static str,
        /// The value.
        got: f64,
    },
    /// Segments of a layer do not cover one period.
    #[error("layer {}: {problem}", layer + 1)]
    Segments {
        /// Layer counted from the top, from 0.
        layer: usize,
        /// The problem.
        problem: String,
    },
    /// A wavevector component that is not a finite number.
    #[error("Bloch wavevector: expected finite kx0 and ky, got kx0 = {kx0}, ky = {ky}")]
    Bloch {
        /// Given x component, in units of k0.
        kx0: f64,
        /// Given y component, in units of k0.
        ky: f64,
    },
    /// Amplitudes of an incident wave that are not finite or both 0.
    #[error("incident wave: expected finite amplitudes that are not both 0, got s = {s}, p = {p}")]
    Amplitudes {
        /// Given amplitude of s.
        s: Complex64,
        /// Given amplitude of p.
        p: Complex64,
    },
    /// A position that is not a finite number.
    #[error("positions of a field: expected finite numbers, got {got}")]
    Position {
        /// The position.
        got: f64,
    },
    /// A truncation beyond the largest allowed.
    #[error("orders to keep: expected a highest one of at most {max}, got {got}")]
    Truncation {
        /// Highest order asked for.
        got: usize,
        /// Highest order allowed.
        max: usize,
    },
    /// Fewer orders are kept than propagate.
    #[error(
        "{}, but orders up to ±{propagating} propagate; ask for more", kept_orders(*.got)
    )]
    TooFewOrders {
        /// Highest order kept.
        got: usize,
        /// Highest order that propagates.
        propagating: usize,
    },
    /// A tolerance out of range.
    #[error("tolerance: expected a number from {smallest:e} to {largest}, got {got}")]
    Tolerance {
        /// Smallest tolerance accepted.
        smallest: f64,
        /// Largest tolerance accepted.
        largest: f64,
        /// Tolerance asked for.
        got: f64,
    },
    /// The asked tolerance was not reached within the allowed effort.
    #[error(
        "no convergence within the {limit} allowed: with orders -{truncation}..{truncation} and {slices} slices \
         they leave an estimated error of {estimate:.2e}, expected at most {allowed:.2e} for a tolerance of {tolerance:.1e}"
    )]
    NotConverged {
        /// The resource exhausted.
        limit: Limit,
        /// Tolerance asked for.
        tolerance: f64,
        /// The part of it that errors of this kind may take.
        allowed: f64,
        /// Error of this kind, estimated at the last attempt.
        estimate: f64,
        /// Highest order of the last attempt.
        truncation: usize,
        /// Slices of the last attempt.
        slices: usize,
    },
    /// More orders than fit into memory.
    #[error(
        "orders: expected at most {max_orders} in {:.1} GiB of free memory, got {got}", free_bytes / f64::from(1 << 30)
    )]
    Memory {
        /// Highest order that fits.
        max_orders: usize,
        /// Bytes that are free.
        free_bytes: f64,
        /// Highest order kept.
        got: usize,
    },
    /// More work than anybody waits for.
    #[error(
        "work: expected at most {max:.0e} operations in one solution, got about {work:.0e} with orders -{highest}..{highest} in {layers} layers"
    )]
    Work {
        /// Highest order kept.
        highest: usize,
        /// Layers.
        layers: usize,
        /// Operations.
        work: f64,
        /// Operations allowed.
        max: f64,
    },
    /// More slices than fit into memory.
    #[error("slices: expected at most {max}, got {got}")]
    Slices {
        /// Slices asked for.
        got: usize,
        /// Slices allowed.
        max: usize,
    },
    /// Both half-spaces absorb, so that no light falls on the structure.
    #[error(
        "half-spaces: expected one without loss, from which light comes, got {n_top} and {n_bottom}"
    )]
    NoLight {
        /// Index above.
        n_top: Complex64,
        /// Index below.
        n_bottom: Complex64,
    },
    /// Orders whose wavevectors leave too few digits for the layers.
    #[error(
        "{}, at a period of {period_per_wavelength:e} wavelengths: rounding of their wavevectors would leave an error of {rounding:.1e};          expected fewer orders or a longer period", kept_orders(*.highest)
    )]
    Rounding {
        /// Highest order kept.
        highest: usize,
        /// Period over wavelength.
        period_per_wavelength: f64,
        /// Error left.
        rounding: f64,
    },
    /// The eigensolver failed.
    #[error("the eigenvalue problem of a layer ({size} × {size}) did not converge")]
    Eigen {
        /// Size of the matrix.
        size: usize,
    },
    /// Power is not conserved.
    #[error(
        "energy balance does not close: incident order {order} ({pol:?}) from the {side:?} at ky = {ky} gives \
         R + T = 1 {residual:+.3e}, allowed {allowed:.0e}; the least accurate modes are those of layer {} \
         (residual {mode_residual:.1e})",
        layer + 1
    )]
    Energy {
        /// Layer with the worst mode residual, counted from the top.
        layer: usize,
        /// Incident order with the worst balance.
        order: i32,
        /// The polarisation.
        pol: Pol,
        /// Half-space that it comes from.
        side: Side,
        /// y component of its wavevector.
        ky: f64,
        /// R + T - 1.
        residual: f64,
        /// Largest allowed magnitude.
        allowed: f64,
        /// Residual of that layer's modes.
        mode_residual: f64,
    },
    /// The caller's progress function said to stop.
    #[error("stopped by the caller")]
    Stopped,
    /// The wave asked for does not propagate in its half-space.
    #[error("order {order} from the {side:?} does not propagate at this Bloch wavevector")]
    Evanescent {
        /// The order.
        order: i32,
        /// The half-space.
        side: Side,
    },
    /// Invalid relief.
    #[error(transparent)]
    Relief(#[from] ReliefError),
}

impl Error {
    /// The resource of which a finer solution has too little, if that is the cause.
    pub(crate) fn limit(&self) -> Option<Limit> {
        match self {
            Self::Rounding { .. } => Some(Limit::Digits),
            Self::Memory { .. } => Some(Limit::Memory),
            Self::Slices { .. } => Some(Limit::Slices),
            Self::Work { .. } => Some(Limit::Work),
            Self::Truncation { .. } => Some(Limit::Orders),
            _ => None,
        }
    }
}
