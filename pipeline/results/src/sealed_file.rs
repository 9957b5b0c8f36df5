// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reads a JSON file of results that holds the version of its layout and the hash of its content.

use std::path::Path;

use anyhow::{Context, Result, anyhow, ensure};
use serde::de::DeserializeOwned;

use design::toml_errors::key_text;
use files::content_hash;

/// Writer of a file, for messages.
pub(super) struct Writer {
    /// Work, such as `search`.
    pub work: &'static str,
    /// Remedy of a file of another version, such as `search again`.
    pub again: &'static str,
}

/// The file at `path` in layout `version`, if there is one.
///
/// # Errors
/// A file that cannot be read, was altered or is of another layout.
pub(super) fn read<T: DeserializeOwned>(
    path: &Path,
    version: u32,
    writer: &Writer,
) -> Result<Option<T>> {
    if !path.exists() {
        return Ok(None);
    }
    let shown = path.display();
    let text = std::fs::read(path).with_context(|| format!("cannot read `{shown}`"))?;
    let json = bsdf::json::parse(&text).with_context(|| format!("`{shown}` is no usable JSON"))?;
    let found = &json["schema_version"];
    ensure!(
        found == version,
        "`{shown}`: schema_version: expected {version}, got {found}; {} with this version",
        writer.again
    );
    let (expected, got) =
        std::str::from_utf8(&text).ok().and_then(content_hash::hashes).unwrap_or_default();
    ensure!(
        !got.is_empty() && expected == got,
        "`{shown}`: {}: it was altered after the {}: its content has SHA-256 {expected}, got {got}",
        content_hash::KEY,
        writer.work
    );
    let file = serde_path_to_error::deserialize(&json)
        .map_err(|e| anyhow!("`{shown}`: {}: {}", key_text(e.path()), e.inner()))?;
    Ok(Some(file))
}
