// SPDX-License-Identifier: MIT OR Apache-2.0
//! Kinds of light and of receivers, as designs and results name them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Weighting of a spectrum.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Weighting {
    /// Radiant power: W, W/sr, W/mm².
    Radiometric,
    /// Luminous flux, radiant power times V(λ) times 683 lm/W: lm, cd, lx; 360 to 830 nm.
    Photometric,
}

impl Weighting {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Radiometric => "radiometric",
            Self::Photometric => "photometric",
        }
    }
}

/// Polarisation of light on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Carrying {
    /// Every surface sees unpolarised light.
    #[default]
    #[serde(alias = "unpolarized")]
    Unpolarised,
    /// Interfaces, layers and specular mirrors see and change polarisation and phases.
    Carried,
}

/// Kinds of receiver, as results name them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReceiverKind {
    /// Irradiance on a rectangle.
    Plane,
    /// Intensity over polar angle and azimuth, bins between multiples of their widths.
    FarField,
    /// Intensity on C-γ planes, bins about them.
    CGamma,
    /// Radiance on a rectangle by place and direction.
    Luminance,
    /// Flux on surfaces.
    Surface,
}
