// SPDX-License-Identifier: MIT OR Apache-2.0
//! Error and cost of a solver against its resolution: a column for each thing that is refined,
//! errors above, cost below, both logarithmic.

use anyhow::{Context, Result, ensure};

use metrics::quantity::{Quantity, Unit};

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Picture, Rect};
use super::draw::colour::Colour;
use super::draw::line_colours::LineColours;
use super::draw::panel::{LABEL_SIZE, Panel, PanelAxis};
use super::draw::sheet::{Entry, Sample, Sheet, curve_pens};

/// One curve of errors over the resolutions of a [`Refinement`].
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorCurve {
    /// Name in the legend.
    pub label: String,
    /// One error a resolution; those of 0 are left out.
    pub errors: Vec<f64>,
}

/// A refinement and the errors that it leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// Name of the numbers: `highest order kept`.
    pub what: String,
    /// Title of the column: `Orders, on 54 slices`.
    pub title: String,
    /// Resolutions, ascending, positive.
    pub at: Vec<f64>,
    /// True if they stand on a logarithmic axis.
    pub logarithmic: bool,
    /// Errors; the same labels in every refinement of a picture.
    pub curves: Vec<ErrorCurve>,
    /// Cost of each resolution; empty for none.
    pub cost: Vec<f64>,
}

const BLACK_DASHES: &[f32] = &[3.0, 5.0];

/// Draws refinements side by side, all errors on one scale, with a line at the tolerance where
/// there is one. `cost` names what the lower panels show.
///
/// # Errors
/// No refinements, lengths that differ, no positive error, or a cost that is not positive.
pub fn convergence(
    heading: &Heading,
    refinements: &[Refinement],
    tolerance: Option<f64>,
    cost: &str,
) -> Result<Picture> {
    check(refinements)?;
    let errors = refinements
        .iter()
        .flat_map(|r| &r.curves)
        .flat_map(|c| c.errors.iter().copied())
        .filter(|&e| e > 0.0 && e.is_finite());
    let [low, high] = ends(errors, 1.6).context("expected an error above 0")?;
    let errors = tolerance.map_or([low, high], |t| [low.min(t / 1.6), high.max(t * 1.6)]);
    let costs = ends(refinements.iter().flat_map(|r| r.cost.iter().copied()), 1.6);

    let curves = &refinements[0].curves;
    let pens = curve_pens(LineColours::Neutral, curves.len(), &[]);
    let mut legend: Vec<Entry> = curves
        .iter()
        .zip(&pens)
        .map(|(curve, pen)| Entry::new(Sample::Line(*pen), &curve.label))
        .collect();
    let limit = Pen::dashed(Colour::TEXT, 1.8, BLACK_DASHES);
    if tolerance.is_some() {
        legend.push(Entry::new(Sample::Line(limit), "tolerance of the design"));
    }
    let height = if costs.is_some() { 1000 } else { 700 };
    let mut sheet = Sheet::new(1600, height, heading, &legend);
    let body = sheet.body.inset(80.0, 42.0, 10.0, 65.0);
    let columns = refinements.len().max(2) as f64;
    let width = (body.width() - GAP[0] * (columns - 1.0)) / columns;
    let split = costs.map_or(body.bottom, |_| body.top + (body.height() - GAP[1]) * 0.66);
    let log = |name: &str, [low, high]: [f64; 2], count| {
        PanelAxis::log(&Quantity::new(name, Unit::Relative), low, high, count)
    };
    for (column, r) in refinements.iter().enumerate() {
        let left = body.left + column as f64 * (width + GAP[0]);
        let area = |top, bottom| Rect::new(left, top, left + width, bottom);
        let x = axis(r);
        let upper = Panel {
            area: area(body.top, split),
            x: if costs.is_some() { x.clone().bare() } else { x.clone() },
            y: log("error", errors, 8),
        };
        let lower = costs.map(|costs| Panel {
            area: area(split + GAP[1], body.bottom),
            x,
            y: log(cost, costs, 5),
        });
        let canvas = &mut sheet.canvas;
        upper.grid(canvas);
        if let Some(tolerance) = tolerance {
            let y = upper.at(r.at[0], tolerance)[1];
            canvas.line([upper.area.left, y], [upper.area.right, y], &limit);
        }
        for (curve, pen) in r.curves.iter().zip(&pens) {
            series(canvas, &upper, (&curve.label, &r.at, &curve.errors), pen);
        }
        let mut room = upper.number_room();
        if let Some(lower) = &lower {
            lower.grid(canvas);
            let pen = Pen::solid(Colour::MUTED, 2.6);
            series(canvas, lower, (cost, &r.at, &r.cost), &pen);
            room = room.max(lower.number_room());
            lower.frame_with_room(canvas, room);
        }
        upper.frame_with_room(canvas, room);
        let place = [upper.area.centre()[0], upper.area.top - 20.0];
        let letters = Letters::new(LABEL_SIZE, Align::Centre).bold();
        canvas.text(&r.title, place, &letters);
    }
    Ok(sheet.canvas.finish())
}

/// Distances of panels, pixels.
const GAP: [f64; 2] = [110.0, 34.0];

fn check(refinements: &[Refinement]) -> Result<()> {
    ensure!(!refinements.is_empty(), "expected at least one refinement, got none");
    for r in refinements {
        let lengths = r
            .curves
            .iter()
            .map(|c| c.errors.len())
            .chain((!r.cost.is_empty()).then_some(r.cost.len()));
        ensure!(
            r.at.len() >= if r.logarithmic { 2 } else { 1 }
                && lengths.into_iter().all(|l| l == r.at.len()),
            "{}: expected resolutions, two or more on a logarithmic axis, and a number for each",
            r.what
        );
        ensure!(
            r.at.iter().chain(&r.cost).all(|v| *v > 0.0 && v.is_finite()),
            "{}: expected resolutions and costs above 0",
            r.what
        );
    }
    Ok(())
}

fn axis(r: &Refinement) -> PanelAxis {
    let (first, last) = (r.at[0], r.at[r.at.len() - 1]);
    let what = Quantity::new(&r.what, Unit::Relative);
    if r.logarithmic {
        let room = (last / first).powf(0.04);
        PanelAxis::log(&what, first / room, last * room, 8)
    } else {
        let room = (0.04 * (last - first)).max(0.5);
        PanelAxis::linear(&what, [first - room, last + room], 9)
    }
}

/// The smallest and the largest value, apart by a factor of `room` more on either side.
fn ends(values: impl Iterator<Item = f64>, room: f64) -> Option<[f64; 2]> {
    values.fold(None, |ends, v| match ends {
        None => Some([v / room, v * room]),
        Some([low, high]) => Some([low.min(v / room), high.max(v * room)]),
    })
}

/// A line with a dot at every positive value.
fn series(
    canvas: &mut Canvas,
    panel: &Panel,
    (name, at, values): (&str, &[f64], &[f64]),
    pen: &Pen,
) {
    let positive = at.iter().zip(values).filter(|(_, v)| **v > 0.0);
    let points: Vec<_> = positive.clone().map(|(&x, &v)| panel.at(x, v)).collect();
    canvas.clipped(panel.area, |canvas| canvas.polyline(&points, pen));
    for (point, (x, v)) in points.into_iter().zip(positive) {
        canvas.with_tooltip(&format!("{name}, at {x}: {v:.2e}"), |canvas| {
            canvas.disk(point, 4.2, pen.colour);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;

    fn refinement(errors: Vec<f64>, cost: Vec<f64>) -> Refinement {
        Refinement {
            what: "slices".to_owned(),
            title: "Slices".to_owned(),
            at: vec![10.0, 20.0, 40.0],
            logarithmic: true,
            curves: vec![ErrorCurve { label: "largest".to_owned(), errors }],
            cost,
        }
    }

    #[test]
    fn curves_fall_to_the_right_and_zeros_are_left_out() {
        let heading = Heading::new("Convergence", "ring 75");
        let good = refinement(vec![1e-1, 1e-3, 0.0], vec![1.0, 2.0, 4.0]);
        let picture = decode(&convergence(&heading, &[good], Some(1e-3), "cost").unwrap());
        let blue = LineColours::Neutral.pick(0, 1).rgb;
        // Below the legend: mean height of the curve's pixels in the left and the right part of its
        // column.
        let mean = |columns: std::ops::Range<u32>| {
            let rows: Vec<f64> = columns
                .flat_map(|x| (150..900).map(move |y| (x, y)))
                .filter(|&(x, y)| {
                    let p = picture.pixel(x, y).unwrap();
                    [p.red(), p.green(), p.blue()] == blue
                })
                .map(|(_, y)| f64::from(y))
                .collect();
            assert!(!rows.is_empty());
            rows.iter().sum::<f64>() / rows.len() as f64
        };
        assert!(mean(120..300) + 100.0 < mean(400..500));
    }

    #[test]
    fn what_has_no_logarithm_is_refused() {
        let heading = Heading::new("Convergence", "ring 75");
        let cost = vec![1.0, 2.0, 4.0];
        for bad in [
            refinement(vec![0.0; 3], cost.clone()),
            refinement(vec![0.1; 2], cost.clone()),
            refinement(vec![0.1; 3], vec![1.0, 0.0, 2.0]),
        ] {
            assert!(convergence(&heading, &[bad], Some(1e-3), "cost").is_err());
        }
        assert!(convergence(&heading, &[], Some(1e-3), "cost").is_err());
    }
}
