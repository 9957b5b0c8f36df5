// SPDX-License-Identifier: MIT OR Apache-2.0
//! The command line as a function: it neither ends the process nor watches for signals.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use clap::Parser;
use pyo3::prelude::*;

use files::interrupt::Interrupt;
use files::program::{self, Program};
use pipeline::cli::Cli;
use pipeline::exit;

use crate::job::{self, Job};

fn parse(arguments: Vec<String>) -> Result<Cli, clap::Error> {
    Cli::try_parse_from(std::iter::once("batwing".to_owned()).chain(arguments))
}

/// Runs a command line, messages on the standard streams; returns the exit code.
#[pyfunction]
pub fn command(py: Python<'_>, arguments: Vec<String>) -> PyResult<u8> {
    let cli = match parse(arguments) {
        Ok(cli) => cli,
        Err(error) => return Ok(exit::of_command_line(&error)),
    };
    let threads = cli.common.threads.map(usize::from);
    let interrupt = Arc::new(OnceLock::new());
    let of_job = Arc::clone(&interrupt);
    let code = job::run(py, threads, move |job| {
        let interrupt = of_job.get_or_init(|| job.interrupt.clone());
        Ok(match cli.run_until(interrupt) {
            Ok(()) => 0,
            Err(error) => exit::report(&error),
        })
    });
    // After a signal, a command may have an exit code of its own.
    code.or_else(|error| {
        let interrupt: Option<&Interrupt> = interrupt.get();
        let raised = interrupt.filter(|interrupt| interrupt.is_raised());
        raised.and_then(Interrupt::own_exit_code).ok_or(error)
    })
}

/// Removes files of this process that are not whole, at its end.
#[pyfunction]
pub fn discard_pending() {
    files::atomic_file::discard_pending();
}

/// States the file of this module, and the words that start the package as a program.
#[pyfunction]
pub fn set_program(file: PathBuf, words: Vec<OsString>) {
    program::state(Program { file, words });
}

/// Runs a command line, errors as exceptions. With `text`, a design in TOML, the design file of the
/// arguments is a name alone, and files that the design names lie in `folder`.
#[pyfunction]
#[pyo3(signature = (arguments, text=None, folder=None))]
pub fn call(
    py: Python<'_>,
    arguments: Vec<String>,
    text: Option<String>,
    folder: Option<PathBuf>,
) -> PyResult<()> {
    let cli = parse(arguments).map_err(|error| {
        let message =
            pipeline::cli_errors::message(&error, &<Cli as clap::CommandFactory>::command());
        crate::errors::to_python(py, &anyhow::anyhow!(message))
    })?;
    let threads = cli.common.threads.map(usize::from);
    job::run(py, threads, move |job: &Job| match text {
        Some(text) => cli.run_text(&text, &folder.unwrap_or_default(), &job.interrupt),
        None => cli.run_until(&job.interrupt),
    })
}

/// The text of the design that `batwing new` writes.
#[pyfunction]
pub fn new_design(py: Python<'_>, name: &str) -> PyResult<String> {
    pipeline::commands::new::text(name).map_err(|error| crate::errors::to_python(py, &error))
}
