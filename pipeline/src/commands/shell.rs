// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing completions` and `batwing man`: what shells and manuals know of the commands.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;
use serde_json::json;

use runtime::atomic_file::write_bytes;
use runtime::run_context::RunContext;

use super::outputs::writable;

/// `batwing completions`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Shell that reads the script
    #[arg(value_enum, value_name = "SHELL")]
    pub shell: Shell,
}

/// `batwing man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Directory for the pages
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,
}

/// Prints the script of `cli` for a shell.
pub fn complete(arguments: &CompletionsArgs, mut cli: Command, context: RunContext) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut cli, "batwing", &mut script);
    let script = String::from_utf8(script)?;
    context.console.result(&json!(script), || script.clone())
}

/// Writes `batwing.1` and a page for each command of `cli`, such as `batwing-run.1`.
pub fn man(arguments: &ManArgs, mut cli: Command, context: RunContext) -> Result<()> {
    writable(&arguments.directory)?;
    cli.build();
    let source = format!("batwing {}", cli.get_version().unwrap_or_default());
    let commands = cli.get_subcommands().filter(|command| command.get_name() != "help");
    // Without a blank for the date the source would stand in its place.
    let pages = std::iter::once(&cli).chain(commands).map(|command| {
        Man::new(command.clone()).date(" ").source(&source).manual("Manual of batwing")
    });
    let mut files = Vec::new();
    for page in pages {
        let file = arguments.directory.join(page.get_filename());
        let mut text = Vec::new();
        page.render(&mut text)?;
        write_bytes(&file, &text)?;
        files.push(file.display().to_string());
    }
    context.console.result(&json!({ "files": files }), || {
        format!("{} pages in {}", files.len(), arguments.directory.display())
    })
}
