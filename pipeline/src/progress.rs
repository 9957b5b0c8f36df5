// SPDX-License-Identifier: MIT OR Apache-2.0
//! Progress for people: bars on a terminal, nothing anywhere else; messages and results on the right streams.

use std::io::{ErrorKind, IsTerminal, Write};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// The error where nobody reads standard output any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("standard output was closed")]
pub struct Closed;

/// Where a command tells what it does.
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
        // A template that does not parse would be a defect of this line; the default style still shows the progress.
        if let Ok(style) = ProgressStyle::with_template(
            "{msg:28} [{bar:36}] {percent:>3} %  {elapsed} (about {eta} left)",
        ) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message(what.to_owned());
        bar
    }

    /// A line for people on standard error.
    pub fn say(&self, line: &str) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }

    /// A warning on standard error, also when quiet: it may explain a result.
    pub fn warn(&self, line: &str) {
        let _ = writeln!(std::io::stderr(), "batwing: warning: {line}");
    }

    /// What the command was asked for, on standard output: `json` if JSON is wanted, else `text` unless quiet.
    pub fn result(&self, json: &serde_json::Value, text: impl FnOnce() -> String) -> Result<()> {
        if self.json {
            Self::print(&serde_json::to_string_pretty(json)?)
        } else if self.quiet {
            Ok(())
        } else {
            Self::print(&text())
        }
    }

    /// `text` and a line break on standard output.
    pub fn print(text: &str) -> Result<()> {
        match writeln!(std::io::stdout(), "{}", text.trim_end()) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(Closed.into()),
            other => other.context("cannot write to standard output"),
        }
    }
}
