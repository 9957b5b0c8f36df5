// SPDX-License-Identifier: MIT OR Apache-2.0
//! The convergence of a search: the best candidate of every generation, as the search saw it, beside the
//! verified objective before and after.

use anyhow::{Result, ensure};

use metrics::quantity::{Curve, Quantity, Unit};

use super::Heading;
use super::draw::canvas::Picture;
use super::draw::line_colours::LineColours;
use super::draw::panel::{BAND_ERRORS, Panel, PanelAxis};
use super::draw::scale::AxisScale;
use super::draw::sheet::{HEIGHT, Sheet, WIDTH, curve_legend, curve_pens};

/// Room above and below the curves, as a share of what they span.
const ROOM: f64 = 0.06;

/// Draws curves of the objective over the number of candidates, with their error bands.
///
/// # Errors
/// No curve.
pub fn search_convergence(heading: &Heading, curves: &[Curve]) -> Result<Picture> {
    ensure!(!curves.is_empty(), "a convergence picture needs at least one curve");
    let band = |sign: f64| {
        let points = |curve: &Curve| {
            let pairs = curve.value().iter().zip(curve.standard_error());
            pairs.map(move |(v, e)| v + sign * BAND_ERRORS * e).collect::<Vec<_>>()
        };
        curves.iter().flat_map(points).collect::<Vec<f64>>()
    };
    let low = band(-1.0).into_iter().fold(f64::INFINITY, f64::min);
    let high = band(1.0).into_iter().fold(f64::NEG_INFINITY, f64::max);
    let room = ROOM * (high - low).max(1e-9);
    let last = curves.iter().flat_map(Curve::x).copied().fold(1.0, f64::max);
    let pens = curve_pens(LineColours::Neutral, curves.len(), &[]);
    let mut sheet = Sheet::new(WIDTH, HEIGHT, heading, &curve_legend(curves, &pens));
    let linear = |name: &str, low, high, count| {
        let scale = AxisScale::Linear { low, high };
        PanelAxis::linear(&Quantity::new(name, Unit::Relative), scale, count)
    };
    let panel = Panel {
        area: sheet.body.inset(80.0, 12.0, 10.0, 65.0),
        x: linear("candidates", 0.0, last, 8),
        y: linear("objective, smaller is better", low - room, high + room, 6),
    };
    let canvas = &mut sheet.canvas;
    panel.grid(canvas);
    panel.curves(canvas, curves, &pens);
    panel.frame(canvas);
    Ok(sheet.finish())
}
