// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures of the paper's Figures 3 and 4, from `results.json`.

use anyhow::{Context, Result};

use metrics::quantity::{Curve, Quantity, Unit};
use results::schema::{CurveEntry, CurvesEntry};

use super::plots::{FarField, Heading, LineColours, Picture, element_far_fields};

/// Titles and subtitles of Figures 3 and 4.
pub const ELEMENTS: [[&str; 2]; 2] = [
    ["Figure 3: single elements", "S1 to S6 as OS1, all others absorbing"],
    ["Figure 4: shapes of one element", "S6 as OS1, OS2, OS3, all others absorbing"],
];

/// Far fields of single elements.
///
/// # Errors
/// Curves that cannot be drawn.
pub fn elements_picture(figure: &CurvesEntry, [title, subtitle]: [&str; 2]) -> Result<Picture> {
    let curve = |c: &CurveEntry| {
        let [x, value, error] = [&c.theta_deg, &c.intensity_w_per_sr, &c.standard_error_w_per_sr];
        Curve::new(&c.label, x.clone(), value.clone(), error.clone())?.mirrored()
    };
    let curves = figure.curves.iter().map(curve).collect::<Result<Vec<_>>>();
    element_far_fields(&FarField {
        heading: &Heading::new(title, subtitle),
        quantity: &Quantity::new("intensity", Unit::WattPerSteradian),
        curves: &curves.context("figures")?,
        colours: LineColours::Ordered,
        numbers: &[],
        peaks: &[],
    })
}
