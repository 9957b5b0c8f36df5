// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing report`: writes a folder of results as one HTML page.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::Args;
use serde_json::json;

use super::outputs::writable;
use crate::atomic_file;
use crate::content_hash::sha256_hex;
use crate::plural::count;
use crate::report::html::folder::Folder;
use crate::report::html::{orders::Source, page};
use crate::run_context::RunContext;

/// Default name of the page, under the directory of results.
const PAGE: &str = "report.html";

/// `batwing report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Directory of results, written by `reproduce` or `run`
    #[arg(value_name = "DIR")]
    pub results: PathBuf,
    /// The page [default: report.html in DIR]
    #[arg(long, value_name = "FILE.html")]
    pub out: Option<PathBuf>,
    /// Directory of the tables that the results list; all of them must be there [default: those
    /// found in .batwing-cache beside DIR]
    #[arg(long, value_name = "DIR")]
    pub tables: Option<PathBuf>,
}

/// Checks the folder, makes the page and writes it.
pub fn run(arguments: &ReportArgs, context: RunContext) -> Result<()> {
    let folder = Folder::open(&arguments.results)?;
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| arguments.results.join(PAGE));
    ensure!(
        !out.is_dir(),
        "--out: expected the name of a file, got the directory `{}`",
        out.display()
    );
    ensure!(
        !folder.holds(&out),
        "--out: expected a file beside the results, got `{}`, which belongs to them",
        out.display()
    );
    writable(out.parent().unwrap_or(Path::new("")))?;
    let source = Source::new(arguments.tables.as_deref(), &arguments.results)?;
    let page = page(&folder, &source)?;
    atomic_file::write_bytes(&out, page.html.as_bytes())?;
    let (found, listed) = page.tables;
    if found < listed {
        context.console.warn(&format!(
            "{} of {} {} not in `{}`, the page leaves them out; --tables says where they are",
            listed - found,
            count(listed, "table"),
            if listed - found == 1 { "is" } else { "are" },
            source.directory.display()
        ));
    }
    let bytes = page.html.len();
    let json = json!({
        "file": out.display().to_string(), "bytes": bytes, "sha256": sha256_hex(page.html.as_bytes()),
        "tables": found, "tables_listed": listed,
    });
    context.console.result(&json, || {
        format!(
            "{:.2} MB, {found} of {} of diffraction orders\nwritten to {}",
            bytes as f64 * 1e-6,
            count(listed, "table"),
            out.display()
        )
    })
}
