// SPDX-License-Identifier: MIT OR Apache-2.0
//! The command line as a function: it neither ends the process nor watches for signals.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use clap::Parser;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use experiment::checked_file::Texts;
use metrics::quantity::Axis;
use output::array::Array;
use pipeline::cli::Cli;
use pipeline::exit;
use runtime::interrupt::Interrupt;
use runtime::program::{self, Program};
use runtime::progress::collecting;

use crate::job::{self, Job};
use crate::rcwa::array;

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
    runtime::atomic_file::discard_pending();
}

/// States the file of this module, and the words that start the package as a program.
#[pyfunction]
pub fn set_program(file: PathBuf, words: Vec<OsString>) {
    program::state(Program { file, words });
}

fn parsed(py: Python<'_>, arguments: Vec<String>) -> PyResult<Cli> {
    parse(arguments).map_err(|error| {
        let message =
            pipeline::cli_errors::message(&error, &<Cli as clap::CommandFactory>::command());
        crate::errors::to_python(py, &anyhow::anyhow!(message))
    })
}

/// Runs a command line, errors as exceptions. `texts` stand for files that the arguments, or these
/// texts, name; files that the text of a design names lie in `folder`.
#[pyfunction]
#[pyo3(signature = (arguments, texts=None, folder=None))]
pub fn call(
    py: Python<'_>,
    arguments: Vec<String>,
    texts: Option<Texts>,
    folder: Option<PathBuf>,
) -> PyResult<()> {
    let cli = parsed(py, arguments)?;
    let threads = cli.common.threads.map(usize::from);
    let names = names(texts.as_ref());
    let work = move |job: &Job| match texts.filter(|texts| !texts.is_empty()) {
        Some(texts) => cli.run_texts(texts, &folder.unwrap_or_default(), &job.interrupt),
        None => cli.run_until(&job.interrupt),
    };
    with_warnings(py, threads, &names, work)
}

/// Names of texts.
fn names(texts: Option<&Texts>) -> Vec<String> {
    texts.into_iter().flat_map(|texts| texts.keys().cloned()).collect()
}

/// Runs `work` on the texts `names`, whose warnings are Python warnings, also of work that fails.
pub fn with_warnings<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    names: &[String],
    work: impl FnOnce(&Job) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<T> {
    let (outcome, warnings) = job::run(py, threads, move |job| Ok(collecting(|| work(job))))?;
    if !warnings.is_empty() {
        py.import("batwing._show")?.call_method1("warn_of_design", (warnings,))?;
    }
    outcome.map_err(|error| crate::errors::of_texts(py, &error, names))
}

/// Name of an array, its numbers, name, unit and edges of each axis, and quantity and unit of the
/// numbers where the file of the array states them.
type NamedArray<'py> = (
    String,
    Bound<'py, PyArrayDyn<f64>>,
    Vec<(String, String, Vec<f64>)>,
    Option<(String, String)>,
);

/// Traces the design of a command line of `run` and writes no file: the text of `results.json`, and
/// the arrays of each model by its key.
#[pyfunction]
#[pyo3(signature = (arguments, texts=None, folder=None))]
pub fn run(
    py: Python<'_>,
    arguments: Vec<String>,
    texts: Option<Texts>,
    folder: Option<PathBuf>,
) -> PyResult<(String, Vec<(String, Vec<NamedArray<'_>>)>)> {
    let cli = parsed(py, arguments)?;
    let threads = cli.common.threads.map(usize::from);
    let (texts, folder) = (texts.unwrap_or_default(), folder.unwrap_or_default());
    let names = names(Some(&texts));
    let work = move |job: &Job| cli.run_in_memory(&texts, &folder, &job.interrupt);
    let (json, models) = with_warnings(py, threads, &names, work)?;
    let axis = |axis: &Axis| {
        let quantity = axis.quantity();
        let unit = quantity.unit().suffix().to_owned();
        (quantity.name().to_owned(), unit, axis.edges().to_vec())
    };
    let named = |one: Array| {
        let about = one.quantity.as_ref();
        let about = about.map(|q| (q.name().to_owned(), q.unit().symbol().to_owned()));
        let axes = one.axes.iter().map(axis).collect();
        Ok((one.name, array(py, one.values, one.shape)?, axes, about))
    };
    let models = models
        .into_iter()
        .map(|(key, arrays)| Ok((key, arrays.into_iter().map(named).collect::<PyResult<_>>()?)));
    Ok((json.to_string(), models.collect::<PyResult<_>>()?))
}

/// The JSON Schema of design files.
#[pyfunction]
pub fn design_schema() -> String {
    design::json_schema::of_designs().to_string()
}

/// The text of the design that `batwing new` writes.
#[pyfunction]
pub fn new_design(py: Python<'_>, name: &str) -> PyResult<String> {
    pipeline::commands::new::text(name, pipeline::commands::new::Template::default())
        .map_err(|error| crate::errors::to_python(py, &error))
}
