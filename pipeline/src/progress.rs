// SPDX-License-Identifier: MIT OR Apache-2.0
//! Progress bars, messages and results, each on its stream: bars and messages on standard error,
//! results on standard output.

use std::io::{ErrorKind, IsTerminal, Write};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// The error of a closed standard output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("standard output was closed")]
pub struct Closed;

/// Output of a command.
#[derive(Debug, Clone, Copy)]
pub struct Console {
    /// No progress, no messages; only what was asked for and errors.
    pub quiet: bool,
    /// Results as JSON on standard output.
    pub json: bool,
}

impl Console {
    /// A bar of `length` steps, invisible unless standard error is a terminal.
    pub fn bar(&self, length: u64, what: &str) -> ProgressBar {
        if self.quiet || !std::io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
        // Without the template the default style still shows the progress.
        if let Ok(style) = ProgressStyle::with_template(
            "{msg:28} [{bar:36}] {percent:>3} %  {elapsed} (about {eta} left)",
        ) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message(what.to_owned());
        bar
    }

    /// Prints a message on standard error, unless quiet.
    pub fn say(&self, line: &str) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }

    /// Prints a warning on standard error, also when quiet: it may explain a result.
    pub fn warn(&self, line: &str) {
        let _ = writeln!(std::io::stderr(), "batwing: warning: {line}");
    }

    /// Prints the result on standard output: `json` if JSON is wanted, else `text` unless quiet.
    pub fn result(&self, json: &serde_json::Value, text: impl FnOnce() -> String) -> Result<()> {
        if self.json {
            Self::print(&serde_json::to_string_pretty(json)?)
        } else if self.quiet {
            Ok(())
        } else {
            Self::print(&text())
        }
    }

    /// Prints `text` and a line break on standard output.
    pub fn print(text: &str) -> Result<()> {
        match writeln!(std::io::stdout(), "{}", text.trim_end()) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(Closed.into()),
            other => other.context("cannot write to standard output"),
        }
    }
}
