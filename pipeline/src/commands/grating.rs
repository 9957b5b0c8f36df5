// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing grating`: one case file in, every order as JSON out.

use anyhow::{Context, Result};

use crate::case::Case;
use crate::cli;
use crate::progress::Console;
use crate::stages::grating;
use crate::stages::trace::Environment;

/// Solves the case and prints it; JSON is the only form, with and without `--json`.
pub fn run(arguments: &cli::Grating, env: Environment) -> Result<()> {
    let case = Case::read(&arguments.case)?;
    let solved = grating::solve(&case).with_context(|| arguments.case.display().to_string())?;
    if let Some(highest) = solved.too_few_for {
        env.console.warn(&format!(
            "{}: orders -{n}..{n} are kept, but orders up to ±{highest} propagate; the result is that of the truncated problem",
            arguments.case.display(),
            n = solved.truncation
        ));
    }
    Console::print(&serde_json::to_string_pretty(&solved.to_json())?)
}
