// SPDX-License-Identifier: MIT OR Apache-2.0
//! Records of files, by name and SHA-256: what a design was read from, what a run read and wrote.

use std::path::Path;

use anyhow::{Context, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::content_hash::sha256_hex;

/// Name and hash of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FileRecord {
    /// Name as given; of an output, the path under the directory of results.
    pub file: String,
    /// Hexadecimal SHA-256.
    pub sha256: String,
}

impl FileRecord {
    /// The record of a file with this content.
    pub fn new(file: impl Into<String>, content: &[u8]) -> Self {
        Self { file: file.into(), sha256: sha256_hex(content) }
    }

    /// The record of the output `file` under `out`, from its bytes there.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn of_output(out: &Path, file: &str) -> Result<Self> {
        let path = out.join(file);
        let bytes = std::fs::read(&path)
            .with_context(|| format!("cannot read `{}` again", path.display()))?;
        Ok(Self::new(file, &bytes))
    }
}

/// Source of a design.
#[derive(Debug, Clone, Serialize)]
pub struct Provenance {
    /// The design file, as given.
    pub file: String,
    /// Hexadecimal SHA-256 of its text.
    pub sha256: String,
    /// Files that it names: mesh, materials, positions, spectra, sources, solids.
    pub named: Vec<FileRecord>,
    /// Files that its panel names, on which no trace depends.
    pub of_panel: Vec<FileRecord>,
}

impl Provenance {
    /// Files that it names, each once.
    pub fn all_named(&self) -> impl Iterator<Item = &FileRecord> {
        let of_panel = self.of_panel.iter().filter(|file| !self.named.contains(file));
        self.named.iter().chain(of_panel)
    }

    /// All files: the design itself, then those that it names.
    pub fn inputs(&self) -> Vec<FileRecord> {
        let design = FileRecord { file: self.file.clone(), sha256: self.sha256.clone() };
        std::iter::once(design).chain(self.all_named().cloned()).collect()
    }
}
