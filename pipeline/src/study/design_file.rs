// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design file of a study as TOML, before keys are set.

use std::path::{Path, PathBuf};

/// A design file as text, before keys are set.
pub(super) struct DesignFile {
    pub path: PathBuf,
    pub table: toml::Table,
    /// Name of the design in it.
    pub name: String,
}

impl DesignFile {
    /// Name of the file, and its folder.
    pub fn place(&self) -> (String, PathBuf) {
        let folder = self.path.parent();
        let folder = folder.map_or_else(PathBuf::new, Path::to_path_buf);
        (self.path.display().to_string(), folder)
    }
}
