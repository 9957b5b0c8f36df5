// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing report`: writes a folder of results as one HTML page.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::Args;
use serde_json::json;

use metrics::plural::count;
use report::html::orders::Source;
use runtime::atomic_file;
use runtime::content_hash::sha256_hex;
use runtime::run_context::RunContext;

use super::outputs::writable;

/// Default name of the page, under the directory of results.
const PAGE: &str = "report.html";

/// `batwing report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Directory of results, written by `reproduce`, `run`, `optimise`, `study`, `tolerance`,
    /// `full-wave`, `zones` or `bsdf --films`
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
    let contents = report::html::open(&arguments.results)?;
    let out = arguments.out.clone().unwrap_or_else(|| arguments.results.join(PAGE));
    ensure!(
        !out.is_dir(),
        "--out: expected the name of a file, got the directory `{}`",
        out.display()
    );
    ensure!(
        !contents.holds(&out),
        "--out: expected a file beside the results, got `{}`, which belongs to them",
        out.display()
    );
    let is_page = out.extension().is_some_and(|end| end == "html" || end == "htm");
    ensure!(
        is_page || !out.exists(),
        "--out: expected a new file or a page, got `{}`, which is something else",
        out.display()
    );
    writable(out.parent().unwrap_or(Path::new("")))?;
    let source = Source::new(arguments.tables.as_deref(), &arguments.results)?;
    let page = contents.page(&source)?;
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
        let tables = match listed {
            0 => String::new(),
            listed => format!(", {found} of {} of diffraction orders", count(listed, "table")),
        };
        format!("{:.2} MB{tables}\nwritten to {}", bytes as f64 * 1e-6, out.display())
    })
}
