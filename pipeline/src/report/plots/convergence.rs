// SPDX-License-Identifier: MIT OR Apache-2.0
//! Error and cost of a solver against its resolution: a column for each thing that is refined, errors above, cost below, all
//! logarithmic.

use anyhow::{Result, ensure};

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Rect};
use super::draw::colour::{Colour, LineColours};
use super::draw::panel::{LABEL_SIZE, Panel, PanelAxis};
use super::draw::sheet::{Entry, Sample, Sheet, curve_pen};
use crate::quantity::{Quantity, Unit};

/// One curve of errors over the resolutions of a [`Refinement`].
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorCurve {
    /// Name in the legend.
    pub label: String,
    /// One error a resolution; those of 0 are left out.
    pub errors: Vec<f64>,
}

/// What is refined, and what comes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// What the numbers count: `highest order kept`.
    pub what: String,
    /// Title of the column: `Orders, on 54 slices`.
    pub title: String,
    /// Resolutions, ascending, positive.
    pub at: Vec<f64>,
    /// Errors; the same labels in every refinement of a picture.
    pub curves: Vec<ErrorCurve>,
    /// Cost of each resolution.
    pub cost: Vec<f64>,
}

const BLACK_DASHES: &[f32] = &[3.0, 5.0];

/// Draws one or two refinements side by side, all errors on one scale, with a line at `tolerance`.
///
/// # Errors
/// No refinements, lengths that differ, no positive error, or a cost that is not positive.
pub fn convergence(
    heading: &Heading,
    refinements: &[Refinement],
    tolerance: f64,
    cost: &str,
) -> Result<Vec<u8>> {
    check(refinements)?;
    let positive = || {
        let curves = refinements.iter().flat_map(|r| &r.curves);
        curves
            .flat_map(|c| c.errors.iter().copied())
            .filter(|&e| e > 0.0 && e.is_finite())
    };
    let (low, high) =
        ends(positive()).ok_or_else(|| anyhow::anyhow!("expected an error above 0"))?;
    let errors = [low.min(tolerance) / 1.6, high.max(tolerance) * 1.6];
    let (least, most) = ends(refinements.iter().flat_map(|r| r.cost.iter().copied()))
        .ok_or_else(|| anyhow::anyhow!("expected a cost"))?;

    let labels: Vec<&str> = refinements[0]
        .curves
        .iter()
        .map(|c| c.label.as_str())
        .collect();
    let mut legend: Vec<Entry> = labels
        .iter()
        .enumerate()
        .map(|(i, label)| Entry::new(Sample::Line(pen(i, labels.len())), *label))
        .collect();
    let limit = Pen::dashed(Colour::TEXT, 1.8, BLACK_DASHES);
    legend.push(Entry::new(Sample::Line(limit), "tolerance of the design"));
    let mut sheet = Sheet::new(1600, 1000, heading, &legend)?;
    let body = sheet.body.inset(80.0, 42.0, 10.0, 65.0);
    let gap = [110.0, 34.0];
    let width = (body.width() - gap[0]) / 2.0;
    let high_part = (body.height() - gap[1]) * 0.66;
    for (column, r) in refinements.iter().enumerate() {
        let left = body.left + column as f64 * (width + gap[0]);
        let x = axis(&r.what, &r.at);
        let upper = Panel {
            area: Rect::new(left, body.top, left + width, body.top + high_part),
            x: x.clone().bare(),
            y: PanelAxis::log(
                &Quantity::new("error", Unit::Relative),
                errors[0],
                errors[1],
                8,
            ),
        };
        let lower = Panel {
            area: Rect::new(left, upper.area.bottom + gap[1], left + width, body.bottom),
            x,
            y: PanelAxis::log(
                &Quantity::new(cost, Unit::Relative),
                least / 1.6,
                most * 1.6,
                5,
            ),
        };
        let canvas = &mut sheet.canvas;
        upper.grid(canvas);
        lower.grid(canvas);
        let y = upper.at(r.at[0], tolerance)[1];
        canvas.line([upper.area.left, y], [upper.area.right, y], &limit);
        for (i, curve) in r.curves.iter().enumerate() {
            series(
                canvas,
                &upper,
                &r.at,
                &curve.errors,
                &pen(i, r.curves.len()),
            );
        }
        series(
            canvas,
            &lower,
            &r.at,
            &r.cost,
            &Pen::solid(Colour::MUTED, 2.6),
        );
        let room = upper.number_room().max(lower.number_room());
        upper.frame_with_room(canvas, room);
        lower.frame_with_room(canvas, room);
        let place = [upper.area.centre()[0], upper.area.top - 20.0];
        let letters = Letters::new(LABEL_SIZE, Align::Centre).bold();
        canvas.text(&r.title, place, &letters);
    }
    sheet.canvas.into_png()
}

fn check(refinements: &[Refinement]) -> Result<()> {
    ensure!(
        (1..=2).contains(&refinements.len()),
        "expected one or two refinements, got {}",
        refinements.len()
    );
    for r in refinements {
        let lengths = r
            .curves
            .iter()
            .map(|c| c.errors.len())
            .chain([r.cost.len()]);
        ensure!(
            r.at.len() >= 2 && lengths.into_iter().all(|l| l == r.at.len()),
            "{}: expected two resolutions or more, and a number for each",
            r.what
        );
        ensure!(
            r.at.iter()
                .chain(&r.cost)
                .all(|v| *v > 0.0 && v.is_finite()),
            "{}: expected resolutions and costs above 0",
            r.what
        );
    }
    Ok(())
}

fn pen(index: usize, count: usize) -> Pen {
    curve_pen(LineColours::Distinct, index, count)
}

fn axis(what: &str, at: &[f64]) -> PanelAxis {
    let (first, last) = (at[0], at[at.len() - 1]);
    let room = (last / first).powf(0.04);
    PanelAxis::log(
        &Quantity::new(what, Unit::Relative),
        first / room,
        last * room,
        8,
    )
}

fn ends(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |ends, v| match ends {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

/// A line with a dot at every positive value.
fn series(canvas: &mut Canvas, panel: &Panel, at: &[f64], values: &[f64], pen: &Pen) {
    let points: Vec<_> = at
        .iter()
        .zip(values)
        .filter(|(_, v)| **v > 0.0)
        .map(|(&x, &v)| panel.at(x, v))
        .collect();
    canvas.clipped(panel.area, |canvas| canvas.polyline(&points, pen));
    for point in points {
        canvas.disk(point, 4.2, pen.colour);
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
            curves: vec![ErrorCurve {
                label: "largest".to_owned(),
                errors,
            }],
            cost,
        }
    }

    #[test]
    fn curves_fall_to_the_right_and_zeros_are_left_out() {
        let heading = Heading::new("Convergence", "ring 75");
        let good = refinement(vec![1e-1, 1e-3, 0.0], vec![1.0, 2.0, 4.0]);
        let picture = decode(&convergence(&heading, &[good], 1e-3, "cost").unwrap());
        let blue = LineColours::Distinct.pick(0, 1).rgb;
        // Below the legend: mean height of the curve's pixels in the left and the right part of its column.
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
            assert!(convergence(&heading, &[bad], 1e-3, "cost").is_err());
        }
        assert!(convergence(&heading, &[], 1e-3, "cost").is_err());
    }
}
