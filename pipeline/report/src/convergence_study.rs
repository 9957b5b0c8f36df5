// SPDX-License-Identifier: MIT OR Apache-2.0
//! The JSON file of a study of convergence, and its picture.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use serde::Deserialize;

use metrics::plural::count;
use runtime::serde_messages::key_text;

use super::plots::{ErrorCurve, Heading, Picture, Refinement, convergence};

/// The file of `batwing converge`, as far as it is shown.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ConvergenceStudy {
    /// Name of the design.
    pub design: String,
    /// Ring, from 1.
    pub ring: usize,
    /// Period of the relief, µm.
    pub period_um: f64,
    /// Depth of the relief, µm.
    pub depth_um: f64,
    /// Wavelength, µm.
    pub wavelength_um: f64,
    /// Tolerance of the design.
    pub tolerance: f64,
    study: Sweeps,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Sweeps {
    plan: Plan,
    incident_waves: usize,
    by_orders: Vec<Point>,
    by_slices: Vec<Point>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Plan {
    fixed_slices: usize,
    fixed_orders: usize,
    reference_orders: usize,
    reference_slices: usize,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Point {
    orders: usize,
    slices: usize,
    errors: Errors,
    operations_per_problem: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Errors {
    largest_order: f64,
    max: f64,
    percentile_99: f64,
    rms: f64,
    flux_weighted_mean: f64,
}

/// An error by its name in the legend.
type NamedError = (&'static str, fn(&Errors) -> f64);

/// Errors that are drawn.
const CURVES: [NamedError; 5] = [
    ("largest of any order", |e| e.largest_order),
    ("largest of any direction", |e| e.max),
    ("99 % of directions", |e| e.percentile_99),
    ("rms of directions", |e| e.rms),
    ("mean of directions by flux", |e| e.flux_weighted_mean),
];

impl ConvergenceStudy {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// A file that cannot be read or is of another layout.
    pub fn read(path: &Path) -> Result<Self> {
        let shown = path.display();
        let text = std::fs::read(path).with_context(|| format!("cannot read `{shown}`"))?;
        let json =
            bsdf::json::parse(&text).with_context(|| format!("`{shown}` is no usable JSON"))?;
        serde_path_to_error::deserialize(&json)
            .map_err(|e| anyhow!("`{shown}`: {}: {}", key_text(e.path()), e.inner()))
    }

    /// Caption of the picture.
    pub fn caption(&self) -> String {
        format!(
            "{}, ring {} (period {:.4} µm, depth {:.3} µm): error and cost against orders and slices. The tolerance asked for is {}.",
            self.design, self.ring, self.period_um, self.depth_um, self.tolerance
        )
    }

    /// The picture, or none where each list has one number only.
    ///
    /// # Errors
    /// Resolutions or costs that are not positive.
    pub fn picture(&self) -> Result<Option<Picture>> {
        let sweep = |what: &str, title: String, points: &[Point], at: fn(&Point) -> usize| {
            let curve = |(label, error): (&str, fn(&Errors) -> f64)| ErrorCurve {
                label: label.to_owned(),
                errors: points.iter().map(|p| error(&p.errors)).collect(),
            };
            Refinement {
                what: what.to_owned(),
                title,
                at: points.iter().map(|p| at(p) as f64).collect(),
                logarithmic: true,
                curves: CURVES.into_iter().map(curve).collect(),
                cost: points.iter().map(|p| p.operations_per_problem).collect(),
            }
        };
        let Sweeps { plan, incident_waves, by_orders, by_slices } = &self.study;
        let of_orders = format!(
            "Orders, on {}, against M = {}",
            count(plan.fixed_slices, "slice"),
            plan.reference_orders
        );
        let of_slices = format!(
            "Slices, at M = {}, against {}",
            plan.fixed_orders,
            count(plan.reference_slices, "slice")
        );
        let sweeps = [
            sweep("highest order kept, M", of_orders, by_orders, |p| p.orders),
            sweep("slices", of_slices, by_slices, |p| p.slices),
        ];
        let drawn: Vec<Refinement> = sweeps
            .into_iter()
            .filter(|r| r.at.len() >= 2 && r.curves[0].errors.iter().any(|&e| e > 0.0))
            .collect();
        if drawn.is_empty() {
            return Ok(None);
        }
        let heading = Heading::new(
            format!("{}, ring {}: error and cost of its solution", self.design, self.ring),
            format!(
                "{} nm; errors of R or T of {incident_waves} incident waves from both sides",
                (self.wavelength_um * 1e6).round() * 1e-3
            ),
        );
        convergence(&heading, &drawn, Some(self.tolerance), "multiply-adds").map(Some)
    }
}
