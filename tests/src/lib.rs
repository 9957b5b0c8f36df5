// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the cross-crate tests share: the rules of the workspace, the binary, reference cases, bad input, judgement.
//!
//! The tests themselves lie in `tests/tests/`, one file a subject; each says what it tests and against what source. They are modules of a few programs
//! (`cargo test --release -p batwing-tests --test spectra colours::`), since each program links all libraries. They judge
//! Monte Carlo in standard errors at fixed seeds. Conventions: `docs/explanation/conventions.md`.

pub mod bad;
pub mod binary;
pub mod boundary_integral;
pub mod cases;
pub mod coloured;
pub mod control;
pub mod crate_dependencies;
pub mod fuzz;
pub mod module_dependencies;
pub mod observed;
#[cfg(unix)]
pub mod runs;
pub mod second_opinion;
pub mod single_ring;
pub mod sources;
pub mod statistics;
pub mod tables;
pub mod wedge;

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
