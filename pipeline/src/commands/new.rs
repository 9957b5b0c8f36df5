// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing new`: writes a commented design to start from.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::json;

use files::run_context::RunContext;

/// The design, with `NAME` for its name.
use design::NEW_DESIGN as DESIGN;

/// `batwing new`.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// Name of the design; the file is NAME.toml
    #[arg(value_name = "NAME")]
    pub name: String,
}

/// The text of the design under a name.
///
/// # Errors
/// A name that no design may have.
pub fn text(name: &str) -> Result<String> {
    let text = DESIGN.replace("NAME", name);
    design::parse(&format!("{name}.toml"), &text, Path::new(""))?;
    Ok(text)
}

/// Writes the design into the current directory, beside no file of that name.
pub fn run(arguments: &NewArgs, context: RunContext) -> Result<()> {
    let name = arguments.name.strip_suffix(".toml").unwrap_or(&arguments.name);
    ensure!(
        !name.chars().any(char::is_control),
        "NAME: expected letters, digits, '-', '_' and '.', got {name:?}"
    );
    let file = PathBuf::from(format!("{name}.toml"));
    let shown = file.display().to_string();
    let text = text(name)?;
    let created = std::fs::File::create_new(&file);
    if let Err(error) = &created {
        ensure!(
            error.kind() != std::io::ErrorKind::AlreadyExists,
            "`{shown}`: expected a new file, got one that exists"
        );
    }
    created
        .and_then(|mut created| created.write_all(text.as_bytes()))
        .with_context(|| format!("cannot write `{shown}`"))?;
    context.console.result(&json!({"file": shown}), || {
        format!("{shown}\nnext: batwing check {shown}; batwing run {shown} --out {name}-results")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_design_is_valid_under_any_good_name() {
        let design = design::parse("a.toml", &DESIGN.replace("NAME", "my-own.2"), Path::new(""));
        let design = design.expect("a valid design");
        assert_eq!((design.name.as_str(), design.trace.paths), ("my-own.2", 2_000_000));
        assert!(design::parse("a.toml", &DESIGN.replace("NAME", "a/b"), Path::new("")).is_err());
    }
}
