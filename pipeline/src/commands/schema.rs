// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing schema`: prints the JSON Schema of an input file.

use anyhow::Result;
use clap::{Args, ValueEnum};
use serde_json::Value;

use design::json_schema::{allow_formulas, of_designs, of_file};
use experiment::optimise::file::ProblemFile;
use experiment::study::file::StudyFile;
use experiment::tolerance::file::ToleranceFile;
use runtime::run_context::RunContext;

/// `batwing schema`.
#[derive(Debug, Args)]
pub struct SchemaArgs {
    /// Kind of file that the schema describes
    #[arg(value_enum, value_name = "KIND", default_value_t = InputFile::Design)]
    pub kind: InputFile,
}

/// A file that users write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum InputFile {
    /// Design file
    Design,
    /// Study file
    Study,
    /// Problem file of a search
    Problem,
    /// Tolerance file
    Tolerance,
}

impl InputFile {
    /// The schema of the file.
    pub fn schema(self) -> Value {
        match self {
            Self::Design => of_designs(),
            Self::Study => of_file::<StudyFile>("Study"),
            Self::Problem => of_file::<ProblemFile>("Problem"),
            Self::Tolerance => of_file::<ToleranceFile>("Tolerance"),
        }
    }
}

/// Prints the schema, as JSON with and without `--json`.
pub fn run(arguments: &SchemaArgs, context: RunContext) -> Result<()> {
    let mut schema = arguments.kind.schema();
    if arguments.kind == InputFile::Design {
        allow_formulas(&mut schema);
    }
    schema["$comment"] = format!("batwing {}", env!("CARGO_PKG_VERSION")).into();
    let text = serde_json::to_string_pretty(&schema)?;
    context.console.result(&schema, || text)
}
