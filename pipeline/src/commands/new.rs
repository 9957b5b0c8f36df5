// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing new`: writes a commented design to start from.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use serde_json::json;

use runtime::run_context::RunContext;

use design::{NEW_BACKLIGHT, NEW_DESIGN, NEW_RGB_BACKLIGHT};

/// `batwing new`.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// Name of the design; the file is NAME.toml
    #[arg(value_name = "NAME")]
    pub name: String,
    /// Design to start from
    #[arg(long, value_enum, default_value_t)]
    pub template: Template,
}

/// Commented designs to start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Template {
    /// A package with a stepped dome, two by two
    #[default]
    Package,
    /// Packages in a white box under a plate and prism films
    Backlight,
    /// Packages of red, green and blue dies under films, before a panel of sub-pixels
    RgbBacklight,
}

impl Template {
    /// The design, with `NAME` for its name.
    fn text(self) -> &'static str {
        match self {
            Self::Package => NEW_DESIGN,
            Self::Backlight => NEW_BACKLIGHT,
            Self::RgbBacklight => NEW_RGB_BACKLIGHT,
        }
    }
}

/// The text of the design under a name.
///
/// # Errors
/// A name that no design may have.
pub fn text(name: &str, template: Template) -> Result<String> {
    let text = template.text().replace("NAME", name);
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
    let text = text(name, arguments.template)?;
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
