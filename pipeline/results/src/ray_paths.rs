// SPDX-License-Identifier: MIT OR Apache-2.0
//! Single paths of light, as `batwing rays` writes them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Fate of a path.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum PathEnd {
    /// Left the scene with direction z ≥ 0.
    EscapedUp,
    /// Left the scene with direction z < 0.
    EscapedDown,
    /// Absorbed by the mirror or the floor.
    AbsorbedMirror,
    /// Absorbed by the LED's box.
    AbsorbedLed,
    /// Absorbed by another surface.
    AbsorbedSurface,
    /// Absorbed on its way through a medium.
    AbsorbedMedium,
    /// Given up.
    Lost,
}

impl PathEnd {
    /// All of them in the order of the variants, as pictures list them.
    pub const ALL: [Self; 7] = [
        Self::EscapedUp,
        Self::EscapedDown,
        Self::AbsorbedMirror,
        Self::AbsorbedLed,
        Self::AbsorbedSurface,
        Self::AbsorbedMedium,
        Self::Lost,
    ];

    /// Absorption by the surface of this name in the ledger.
    pub fn at_surface(name: &str) -> Self {
        match name {
            "bottom" | "ground mirror" | "floor" | "housing floor" => Self::AbsorbedMirror,
            "box side" | "box top" => Self::AbsorbedLed,
            _ => Self::AbsorbedSurface,
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::EscapedUp => "escaped upwards",
            Self::EscapedDown => "escaped downwards",
            Self::AbsorbedMirror => "absorbed by mirror or floor",
            Self::AbsorbedLed => "absorbed by the LED",
            Self::AbsorbedSurface => "absorbed by another surface",
            Self::AbsorbedMedium => "absorbed by a medium",
            Self::Lost => "lost",
        }
    }
}

/// A place where a path bends or ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Vertex {
    /// Place, mm.
    pub point_mm: [f64; 3],
    /// The surface met there, or `source`, or the medium that scattered or absorbed it.
    pub at: String,
}

/// One path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TracedPath {
    /// Power that it carries from its source to its end, W.
    pub power_w: f64,
    /// Wavelength, nm, where sources shine in lights of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelength_nm: Option<f64>,
    /// Fate.
    pub fate: PathEnd,
    /// From the source on.
    pub vertices: Vec<Vertex>,
    /// Direction of the last flight of a path that escaped or was given up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaves_along: Option<[f64; 3]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_number_ends_as_they_list_them() {
        assert!(PathEnd::ALL.iter().enumerate().all(|(number, end)| *end as usize == number));
    }
}
