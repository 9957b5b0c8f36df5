// SPDX-License-Identifier: MIT OR Apache-2.0
//! Helpers of the cross-crate tests: rules of the workspace, bad input, scenes, statistics.
//!
//! The tests lie beside `src/`, one program a folder, since each program links all libraries:
//! `rules` and `physics` belong to this package, `end_to_end` runs the binary and is declared by
//! package `batwing`. Monte Carlo is judged in standard errors at fixed seeds. Conventions:
//! `docs/explanation/conventions.md`.

pub mod bad_input;
pub mod fuzz;
pub mod judgement;
pub mod ray_files;
pub mod reference_cases;
pub mod solver_comparison;
pub mod source_scan;
pub mod statistics;
pub mod supercell;
pub mod tables;
pub mod tilted_box;
pub mod traces;
pub mod validation_report;

use std::path::{Path, PathBuf};

/// The top of the workspace.
pub fn workspace() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The text of a file under the top of the workspace.
///
/// # Panics
/// If it cannot be read.
pub fn read(path: impl AsRef<Path>) -> String {
    let path: PathBuf = workspace().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
