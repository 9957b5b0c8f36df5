// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the binary does, one file a command.

mod bsdf;
mod check;
mod converge;
mod field;
mod grating;
mod reproduce;
mod run;

use std::path::Path;

use anyhow::{Context, Result};

use crate::cli::{Cli, Command, Common};
use crate::interrupt::Interrupt;
use crate::progress::Console;
use crate::stages::trace::Environment;

/// Runs the command of `cli`.
pub fn run(cli: &Cli) -> Result<()> {
    let interrupt = Interrupt::install()?;
    threads(cli.common)?;
    let console = Console {
        quiet: cli.common.quiet,
        json: cli.common.json,
    };
    let env = Environment {
        console,
        interrupt: &interrupt,
        seed: cli.common.seed,
    };
    match &cli.command {
        Command::Reproduce(arguments) => reproduce::run(arguments, env),
        Command::Run(arguments) => run::run(arguments, env),
        Command::Bsdf(arguments) => bsdf::run(arguments, env),
        Command::Converge(arguments) => converge::run(arguments, env),
        Command::Field(arguments) => field::run(arguments, env),
        Command::Grating(arguments) => grating::run(arguments, env),
        Command::Check(arguments) => check::run(arguments, env),
    }
}

/// Sets the number of threads for everything that follows.
fn threads(common: Common) -> Result<()> {
    let mut pool = rayon::ThreadPoolBuilder::new();
    if let Some(count) = common.threads {
        pool = pool.num_threads(usize::from(count));
    }
    pool.build_global().context("cannot start the threads")
}

/// Fails early, with one message, where results cannot be written.
fn writable(out: &Path) -> Result<()> {
    std::fs::create_dir_all(out)
        .with_context(|| format!("cannot create the directory `{}`", out.display()))?;
    let probe = tempfile::Builder::new()
        .prefix(".batwing-")
        .tempfile_in(out);
    probe
        .map(drop)
        .with_context(|| format!("cannot write into `{}`", out.display()))
}
