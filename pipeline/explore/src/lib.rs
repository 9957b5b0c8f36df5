// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design seen live: a page on the user's own machine in which numbers are turned and light is
//! seen with its shrinking error.
//!
//! In: a design file, [`Options`], and the [`Actions`] of the caller, which run whole commands. Out: a
//! server on the loopback address until the context is interrupted. Every picture is what
//! `batwing run` gives for the same text, model, seed and number of paths.
//!
//! ```
//! use explore::draft;
//!
//! // An edit keeps comments and order.
//! let text = "[array]\npitch_mm = 8.3 # as built\n";
//! let edited = draft::set(text, "array.pitch_mm", &serde_json::json!(9))?;
//! assert_eq!(edited, "[array]\npitch_mm = 9.0 # as built\n");
//! # Ok::<(), anyhow::Error>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | `design_file` | the file, and the draft kept beside it |
//! | [`draft`] | edits of the text of a design |
//! | [`fields`] | numbers of a design for people: label, unit, meaning, range of a slider |
//! | `fault` | refusals by key and line |
//! | `frame` | what one trace shows: figures, ledger, pictures |
//! | `waves` | tables of the hybrid, ring by ring |
//! | `tracer_thread` | progressive trace of the present design |
//! | [`session`] | draft, history, kept states, choice of the model |
//! | `view_3d` | package and paths in three dimensions |
//! | `search`, `search_thread` | a search from the present design by its candidates, and its work |
//! | `page` | the page, its style and scripts |
//! | `http` | connections, and bounds on what clients send |
//! | [`server`] | requests, and who may make them |

mod design_file;
pub mod draft;
mod fault;
pub mod fields;
mod frame;
mod http;
mod page;
mod search;
mod search_thread;
pub mod server;
pub mod session;
mod tracer_thread;
mod view_3d;
mod waves;

use std::path::{Path, PathBuf};

use anyhow::Result;

use arrays::cache::Cache;
use design::Design;
use runtime::run_context::RunContext;
use simulate::model::Model;

/// What to show, and where.
#[derive(Debug)]
pub struct Options {
    /// The design file.
    pub design: PathBuf,
    /// Port on 127.0.0.1, 0 for one that is free; without one [`server::PORT`] where that is free.
    pub port: Option<u16>,
    /// Directory of tables of diffraction orders.
    pub cache: Cache,
    /// Directory of searches that the page starts.
    pub out: PathBuf,
}

/// Whole commands, which the page starts.
pub trait Actions: Sync {
    /// Writes `design` to the file `out` in the format of this word.
    ///
    /// # Errors
    /// Those of the command.
    fn export(
        &self,
        design: &Design,
        word: &str,
        model: Model,
        out: &Path,
        context: RunContext,
    ) -> Result<()>;

    /// Runs `design` in `model` in the folder `out`, and returns its page.
    ///
    /// # Errors
    /// Those of the commands.
    fn report(
        &self,
        design: &Design,
        model: Model,
        out: &Path,
        context: RunContext,
    ) -> Result<String>;

    /// Searches by the problem file `problem`, in which `text` stands for the file `design`; returns
    /// the text of the design found, and words on constraints that it misses when verified.
    ///
    /// # Errors
    /// Those of the command.
    fn optimise(
        &self,
        problem: &Path,
        design: (&str, &str),
        out: &Path,
        context: RunContext,
    ) -> Result<(String, Vec<String>)>;
}
