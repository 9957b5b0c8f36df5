// SPDX-License-Identifier: MIT OR Apache-2.0
//! The native half of the Python package `batwing`: plain functions and two classes over arrays.
//!
//! `python/batwing` holds what users see: names, units, checks, dataclasses and pictures. Here
//! arrays become the crates' own types, work runs on threads of its own ([`job`]), and errors become
//! exceptions ([`errors`]).
#![allow(clippy::too_many_arguments, clippy::type_complexity)]
// Python calls these functions by value.
#![allow(clippy::needless_pass_by_value)]

mod bsdf;
mod command;
mod errors;
mod figure;
mod job;
mod rays;
mod rcwa;

use gratings::grating_case::USUAL_PERIODS;
use pyo3::prelude::*;

/// The number of threads of calls that state none; `None` for all processors.
#[pyfunction]
#[pyo3(signature = (threads))]
fn set_threads(py: Python<'_>, threads: Option<usize>) -> PyResult<()> {
    match threads {
        Some(count) if !(1..=job::MOST_THREADS).contains(&count) => {
            let expected = format!("a whole number from 1 to {}", job::MOST_THREADS);
            Err(errors::refused(py, "threads", &expected, &count.to_string()))
        }
        _ => {
            job::set_threads(threads);
            Ok(())
        }
    }
}

/// The number of threads of calls that state none.
#[pyfunction]
fn threads() -> usize {
    job::default_threads()
}

/// What reports of progress go to: a function of the steps done, of all steps, and of whether the
/// work has ended; `None` for nobody.
#[pyfunction]
#[pyo3(signature = (function))]
fn set_progress(function: Option<Py<PyAny>>) {
    job::set_listener(function);
}

/// Nodes of ky between media of two indices, dense where efficiencies vary most.
#[pyfunction]
fn ky_nodes(top: f64, bottom: f64, count: usize) -> Vec<f64> {
    ::bsdf::Grid::ky_nodes(top, bottom, count)
}

/// TOML of an object given as JSON.
#[pyfunction]
fn toml_of_json(py: Python<'_>, text: &str) -> PyResult<String> {
    let convert = || -> anyhow::Result<String> {
        let value: serde_json::Value = serde_json::from_str(text)?;
        Ok(toml::to_string(&value)?)
    };
    convert().map_err(|error| errors::to_python(py, &error))
}

/// Bytes of memory that are free.
#[pyfunction]
fn free_bytes() -> f64 {
    ::rcwa::guard::free_bytes()
}

/// Sleeps on a worker thread until it is interrupted, or to the end where it is deaf: the tests'
/// long call.
#[pyfunction]
#[pyo3(signature = (seconds, deaf=false, threads=None))]
fn wait(py: Python<'_>, seconds: f64, deaf: bool, threads: Option<usize>) -> PyResult<()> {
    job::run(py, threads, move |job| {
        let until = std::time::Instant::now() + std::time::Duration::from_secs_f64(seconds);
        while std::time::Instant::now() < until {
            if !deaf {
                job.interrupt.check()?;
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        Ok(())
    })
}

/// Panics on a worker thread: the test of the border.
#[pyfunction]
fn panic(py: Python<'_>) -> PyResult<()> {
    job::run(py, None, |_| -> anyhow::Result<()> { panic!("asked to") })
}

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::bsdf::{Surface, build_table, design_cell};
    #[pymodule_export]
    use super::command::{
        call, command, design_schema, discard_pending, new_design, run, set_program,
    };
    #[pymodule_export]
    use super::figure::{shown_figure, unit_symbol};
    #[pymodule_export]
    use super::rays::{ray_endings, read_rays, write_rays};
    #[pymodule_export]
    use super::rcwa::{Interface, floating_ridges, material_indices, solve_case};
    #[pymodule_export]
    use super::{
        free_bytes, ky_nodes, panic, set_progress, set_threads, threads, toml_of_json, wait,
    };
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
    /// Range of period over wavelength beyond which one is taken to be in another unit.
    #[pymodule_export]
    const USUAL_RATIOS: (f64, f64) = (*super::USUAL_PERIODS.start(), *super::USUAL_PERIODS.end());
}
