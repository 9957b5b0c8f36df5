// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing grating`: solves one case file and prints every order as JSON.

use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use runtime::progress::Console;
use runtime::run_context::RunContext;

use gratings::grating;
use gratings::grating_case::Case;

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
    let solved = context.console.waiting(&file, solve).map_err(|error| {
        let doubts = case.doubts();
        if doubts.is_empty() || context.interrupt.is_raised() {
            error
        } else {
            anyhow!("{error:#}; {}", doubts.join("; "))
        }
    });
    let solved = solved.with_context(|| file.clone())?;
    for warning in case.doubts().into_iter().chain(solved.warnings()) {
        context.console.warn(&format!("{file}: {warning}"));
    }
    Console::print(&grating::in_numerical_order(&solved.to_json())?)
}
