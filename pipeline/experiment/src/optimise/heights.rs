// SPDX-License-Identifier: MIT OR Apache-2.0
//! A profile of heights as a smooth dome of a design.

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};
use toml::Value;

use design::Design;

use super::spline::BSpline;

/// Pieces of arc for each coefficient of a profile of heights.
const PIECES: usize = 6;

/// Radius that a profile of heights reaches, mm.
///
/// # Errors
/// A package without a dome of revolution.
pub(super) fn radius_mm(design: &Design) -> Result<f64> {
    let base = design.base();
    let base = base.context("profile: expected a design with a dome of revolution")?;
    Ok(base.reach_mm())
}

/// Where the coefficients of a profile of heights act, as shares of the radius. The first two of
/// the spline are one, so that the dome is level at the axis.
pub(super) fn abscissae(count: usize) -> Vec<f64> {
    let mut at = BSpline::new(count + 1).abscissae();
    at.remove(1);
    at
}

/// The `count` coefficients of the profile of heights that follows the smooth dome of `design`: it
/// meets it at [`abscissae`].
///
/// # Errors
/// A package without a dome of revolution.
pub(super) fn of_design(design: &Design, count: usize) -> Result<Vec<f64>> {
    let radius = radius_mm(design)?;
    let base = design.base();
    let height = |share: &f64| base.map_or(0.0, |base| base.height_at(share * radius));
    let at = abscissae(count);
    let heights = DVector::from_iterator(count, at.iter().map(height));
    let spline = BSpline::new(count + 1);
    let mut basis = DMatrix::zeros(count, count);
    for k in 0..count {
        let mut unit = vec![0.0; count];
        unit[k] = 1.0;
        let unit = coefficients(&unit);
        for (row, share) in at.iter().enumerate() {
            basis[(row, k)] = spline.value(&unit, *share);
        }
    }
    // Of full rank: every abscissa lies within the support of its own coefficient [Schoenberg,
    // Whitney 1953].
    let solved = basis.lu().solve(&heights);
    let solved = solved.context("profile: expected a dome that a spline of heights follows")?;
    Ok(solved.as_slice().to_vec())
}

/// Coefficients of the spline of a profile: the first two are one.
fn coefficients(heights: &[f64]) -> Vec<f64> {
    heights[..1].iter().chain(heights).copied().collect()
}

/// The value of `dome`: a smooth dome with these coefficients of a spline of heights, arcs between
/// points of the spline, and a cylinder below its rim. Coatings of the dome are kept.
pub(super) fn dome(heights: &[f64], design: &Design, source: &toml::Table) -> Result<Value> {
    let radius = radius_mm(design)?;
    let coefficients = coefficients(heights);
    let spline = BSpline::new(coefficients.len());
    let pieces = PIECES * heights.len();
    let at = |t: f64| [radius * t, spline.value(&coefficients, t.clamp(0.0, 1.0))];
    let slope = |t: f64| {
        const H: f64 = 1e-6;
        let (a, b) = (at((t - H).max(0.0)), at((t + H).min(1.0)));
        (b[1] - a[1]).atan2(b[0] - a[0])
    };
    let mut rows = vec![vec![0.0, heights[0]]];
    for k in 1..=pieces {
        let (from, to) = ((k - 1) as f64 / pieces as f64, k as f64 / pieces as f64);
        let [r, z] = at(to);
        // The angle that an arc turns through is that between the tangents at its ends.
        let turn = slope(to) - if k == 1 { 0.0 } else { slope(from) };
        let bulge = (0.25 * turn).tan();
        rows.push(if bulge.abs() < 1e-6 { vec![r, z] } else { vec![r, z, bulge] });
    }
    if at(1.0)[1] > 0.0 {
        rows.push(vec![radius, 0.0]);
    }
    let row = |row: Vec<f64>| Value::Array(row.into_iter().map(Value::Float).collect());
    let mut dome = toml::Table::new();
    dome.insert("meridian_mm".to_owned(), Value::Array(rows.into_iter().map(row).collect()));
    let coating = source.get("dome").and_then(|dome| dome.get("coating"));
    if let Some(coating) = coating {
        dome.insert("coating".to_owned(), coating.clone());
    }
    Ok(Value::Table(dome))
}
