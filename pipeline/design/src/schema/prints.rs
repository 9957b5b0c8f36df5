// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[prints]]` as written: white ink, or the density of a film, over the place.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;
use runtime::serde_arrays::List;

/// `[[prints]]`: ink on the mirror or on a face of a film, or the density of a film, one table for each.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Print {
    /// The printed surface: `"mirror"`, or `"NAME.top"` or `"NAME.bottom"` of a film that has air there;
    /// or a film, `"NAME"`, whose medium scatters or converts light: the pattern is the density of all that
    /// does so, through its thickness, as a share of what the medium states.
    pub on: String,
    /// Power that the ink sends back by the cosine law per incident power, at every incidence; 0 to 1;
    /// needed but of a density, which has none.
    pub reflected: Option<f64>,
    /// Power that it lets through by the cosine law, likewise, of ink on a film; with `reflected` at most
    /// 1; default 0.
    #[serde(default, skip_serializing_if = "is_default")]
    pub transmitted: f64,
    /// Round dots; this or `picture_file`.
    pub dots: Option<Dots>,
    /// Share of the area under ink, in grains much finer than all else: a grey PNG of 8 or 16 bits, or
    /// rows of numbers from 0 to 1, the largest y first, over the whole surface; of a film its density.
    pub picture_file: Option<String>,
}

impl Print {
    /// Name of the mirror.
    pub const MIRROR: &str = "mirror";
}

/// `[prints.dots]`: dots in rows and columns about the middle of the array.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dots {
    /// Distance of neighbours along x and y, mm; 0.001 to 10 000.
    pub pitch_mm: f64,
    /// Rows of distance from the axis of the nearest package and radius of a dot there, mm, straight
    /// lines between; no dots overlap.
    pub radius_mm: Vec<List<f64, 2>>,
}
