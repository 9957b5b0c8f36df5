// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing schema`: prints the JSON Schema of the design file.

use anyhow::Result;
use clap::Args;

use design::json_schema;
use files::run_context::RunContext;

/// `batwing schema`.
#[derive(Debug, Args)]
pub struct SchemaArgs {}

/// Prints the schema, as JSON with and without `--json`.
pub fn run(_: &SchemaArgs, context: RunContext) -> Result<()> {
    let schema = json_schema::of_designs();
    let text = serde_json::to_string_pretty(&schema)?;
    context.console.result(&schema, || text)
}
