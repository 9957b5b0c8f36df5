// SPDX-License-Identifier: MIT OR Apache-2.0
//! Place of the peak of a far field: off the axis, on it, or anywhere.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Estimate;
use crate::estimate::DISTINCT;

/// Minimum excess of a peak over the centre, as a fraction of the peak, that a run must be able to
/// see before it may say that there is none.
pub const VISIBLE: f64 = 0.02;

/// Place of the peak of a far field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PeakPlace {
    /// It exceeds the centre by more than three standard errors of the difference; not written.
    #[default]
    OffAxis,
    /// It does not, and three standard errors are at most 2 % of it: its angle is noise.
    OnAxis,
    /// Too few paths to tell: its angle is noise.
    NotResolved,
}

impl PeakPlace {
    /// Of a peak of this excess over the centre; `beside` says whether its angle lies off the axis.
    pub(super) fn of(excess: Estimate, peak: f64, beside: bool) -> Self {
        let noise = DISTINCT * excess.standard_error;
        if beside && excess.value > noise {
            Self::OffAxis
        } else if noise <= VISIBLE * peak {
            Self::OnAxis
        } else {
            Self::NotResolved
        }
    }

    /// Words in place of an angle that is noise.
    pub fn words(self) -> Option<&'static str> {
        match self {
            Self::OffAxis => None,
            Self::OnAxis => Some("none (maximum on axis)"),
            Self::NotResolved => Some("not resolved (too few paths)"),
        }
    }

    /// True if the angle is that of a peak, so that a file need not say anything.
    pub fn is_off_axis(&self) -> bool {
        *self == Self::OffAxis
    }
}
