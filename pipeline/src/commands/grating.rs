// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing grating`: solves one case file and prints every order as JSON.

use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use rcwa::error::kept_orders;

use files::progress::Console;
use files::run_context::RunContext;
use metrics::plural::count;

use crate::grating;
use crate::grating_case::Case;

/// `batwing grating`.
#[derive(Debug, Args)]
pub struct GratingArgs {
    /// Case file
    #[arg(value_name = "CASE.json")]
    pub case: PathBuf,
}

/// Solves the case and prints it; JSON is the only form, with and without `--json`.
pub fn run(arguments: &GratingArgs, context: RunContext) -> Result<()> {
    let case = Case::read(&arguments.case)?;
    let file = arguments.case.display().to_string();
    let watch = context.interrupt.watch();
    let solve = || grating::solve(&case, &watch);
    let unlike = case.unlike_units();
    let solved = context.console.waiting(&file, solve).map_err(|error| match &unlike {
        Some(unlike) if !context.interrupt.is_raised() => anyhow!("{error:#}; {unlike}"),
        _ => error,
    });
    let solved = solved.with_context(|| file.clone())?;
    if let Some(unlike) = &unlike {
        context.console.warn(&format!("{file}: {unlike}"));
    }
    if let Some(highest) = solved.too_few_for {
        context.console.warn(&format!(
            "{file}: {}, but orders up to ±{highest} propagate; the result is that of the truncated problem",
            kept_orders(solved.truncation)
        ));
    }
    if let Some(missed) = &solved.missed {
        context.console.warn(&format!("{file}: {missed}"));
    }
    if let Some(left) = solved.coarse_slices {
        context.console.warn(&format!(
            "{file}: an error of {left:.1e} is left with {}, more than aimed at; more of them are too much work",
            count(solved.slices, "slice")
        ));
    }
    if let Some(unsettled) = solved.unsettled() {
        context.console.warn(&format!("{file}: {unsettled}"));
    }
    Console::print(&grating::in_numerical_order(&solved.to_json())?)
}
