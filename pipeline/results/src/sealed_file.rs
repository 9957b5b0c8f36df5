// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reads a JSON file of results that holds the version of its layout and the hash of its content.

use std::path::Path;

use anyhow::{Context, Result, anyhow, ensure};
use serde::de::DeserializeOwned;

use runtime::content_hash;
use runtime::provenance::FileRecord;
use runtime::serde_messages::key_text;

/// A file of results that holds the version of its layout and the hash of its content, and lists the
/// files written with it.
pub trait SealedFile: DeserializeOwned {
    /// Name under the directory of results.
    const FILE: &'static str;
    /// Version of the layout.
    const VERSION: u32;
    /// Work that writes it, for messages, such as `search`.
    const WORK: &'static str;
    /// Remedy of a file of another version, such as `search again`.
    const AGAIN: &'static str;

    /// Files written with it.
    fn files(&self) -> &[FileRecord];

    /// Reads the file in `directory`, if there is one.
    ///
    /// # Errors
    /// A file that cannot be read, was altered or is of another layout.
    fn read(directory: &Path) -> Result<Option<Self>> {
        let path = directory.join(Self::FILE);
        if path.exists() { read::<Self>(&path).map(Some) } else { Ok(None) }
    }
}

fn read<T: SealedFile>(path: &Path) -> Result<T> {
    let shown = path.display();
    let text = std::fs::read(path).with_context(|| format!("cannot read `{shown}`"))?;
    let json = bsdf::json::parse(&text).with_context(|| format!("`{shown}` is no usable JSON"))?;
    let found = &json["schema_version"];
    ensure!(
        *found == T::VERSION,
        "`{shown}`: schema_version: expected {}, got {found}; {} with this version",
        T::VERSION,
        T::AGAIN
    );
    let (expected, got) =
        std::str::from_utf8(&text).ok().and_then(content_hash::hashes).unwrap_or_default();
    ensure!(
        !got.is_empty() && expected == got,
        "`{shown}`: {}: it was altered after the {}: its content has SHA-256 {expected}, got {got}",
        content_hash::KEY,
        T::WORK
    );
    serde_path_to_error::deserialize(&json)
        .map_err(|e| anyhow!("`{shown}`: {}: {}", key_text(e.path()), e.inner()))
}
