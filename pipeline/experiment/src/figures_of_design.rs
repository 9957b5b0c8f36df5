// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures of merit that a design has, which a trace tells.

use anyhow::{Error, Result};

use design::Design;
use files::run_context::RunContext;
use metrics::digits::thousands;
use simulate::model::Model;
use simulate::model_traces::ModelTraces;
use simulate::trace_plan::DomeChoice;

/// Keys of the figures that a trace of `design` shows.
///
/// # Errors
/// Those of the solver and the tracer; an interrupt.
pub fn figures_of_design(
    design: &Design,
    model: Model,
    traces: &mut ModelTraces,
    context: RunContext,
) -> Result<Vec<&'static str>> {
    let seen = traces.observe(design, DomeChoice::Model(model), "", context)?;
    Ok(seen.figures(design).into_iter().map(|figure| figure.key).collect())
}

/// Complaint about `key`, which asks for a figure that is not among those that the design has.
pub fn missing(key: &str, figure: &str, figures: &[&str], paths: u64) -> Error {
    Error::msg(format!(
        "{key}: expected a figure that the design has, {} (as {} paths show), got {figure:?}",
        figures.join(", "),
        thousands(paths),
    ))
}
