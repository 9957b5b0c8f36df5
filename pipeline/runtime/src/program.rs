// SPDX-License-Identifier: MIT OR Apache-2.0
//! Identity of this program: the file whose hash tells it from other versions, and the words that start
//! it. A program that calls this crate from an interpreter states both.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::OnceLock;

use anyhow::{Context, Result};

/// A program as another process starts it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// The file that holds its code.
    pub file: PathBuf,
    /// Words that a command line of it begins with.
    pub words: Vec<OsString>,
}

static STATED: OnceLock<Program> = OnceLock::new();

/// States what this program is; what was stated first holds.
pub fn state(program: Program) {
    STATED.get_or_init(|| program);
}

/// File of this program: the one stated, or else the running executable.
///
/// # Errors
/// An executable that cannot be found.
pub fn current() -> Result<Program> {
    if let Some(program) = STATED.get() {
        return Ok(program.clone());
    }
    let file = std::env::current_exe().context("cannot find the program itself")?;
    let words = vec![file.clone().into()];
    Ok(Program { file, words })
}
