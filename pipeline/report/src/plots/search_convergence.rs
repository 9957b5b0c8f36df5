// SPDX-License-Identifier: MIT OR Apache-2.0
//! The convergence of a search: the best candidate of every generation, as the search saw it, beside the
//! verified objective before and after.

use anyhow::{Result, ensure};

use metrics::quantity::{Curve, Quantity, Unit};

use super::Heading;
use super::draw::canvas::Picture;
use super::draw::line_colours::LineColours;
use super::draw::panel::{BAND_ERRORS, Panel, PanelAxis};
use super::draw::scale::ends_with_room;
use super::draw::sheet::{HEIGHT, Sheet, WIDTH, curve_legend, curve_pens};

/// Room above and below the curves, as a share of what they span.
const ROOM: f64 = 0.06;

/// Draws curves of the objective over the number of candidates, with their error bands.
///
/// # Errors
/// No curve.
pub fn search_convergence(heading: &Heading, curves: &[Curve]) -> Result<Picture> {
    ensure!(!curves.is_empty(), "a convergence picture needs at least one curve");
    let points = curves.iter().flat_map(|c| c.value().iter().zip(c.standard_error()));
    let bands = points.flat_map(|(v, e)| [v - BAND_ERRORS * e, v + BAND_ERRORS * e]);
    let last = curves.iter().flat_map(Curve::x).copied().fold(1.0, f64::max);
    let pens = curve_pens(LineColours::Neutral, curves.len(), &[]);
    let mut sheet = Sheet::new(WIDTH, HEIGHT, heading, &curve_legend(curves, &pens));
    let linear = |name: &str, ends, count| {
        PanelAxis::linear(&Quantity::new(name, Unit::Relative), ends, count)
    };
    let panel = Panel {
        area: sheet.body.inset(80.0, 12.0, 10.0, 65.0),
        x: linear("candidates", [0.0, last], 8),
        y: linear("objective, smaller is better", ends_with_room(bands, ROOM), 6),
    };
    let canvas = &mut sheet.canvas;
    panel.grid(canvas);
    panel.curves(canvas, curves, &pens);
    panel.frame(canvas);
    Ok(sheet.canvas.finish())
}
