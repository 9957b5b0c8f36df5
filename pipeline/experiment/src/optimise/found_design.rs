// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design that a search has found as a file: made, written beside the files that it names, and
//! read again.

use std::path::Path;

use anyhow::{Context, Result};

use design::Design;
use design::dotted_keys::Settings;
use runtime::atomic_file;
use simulate::scene_check;

use super::named_files::NamedFiles;
use super::outputs::{FRONT_PICTURE, is_of_front};
use super::problem::Problem;
use crate::design_file::DesignFile;

/// A design that was found, as its file will be.
pub(super) struct FoundDesign {
    /// Name under the directory of results.
    pub name: String,
    pub file: DesignFile,
    pub design: Design,
}

impl FoundDesign {
    /// The design of `problem` with `settings` under a name.
    ///
    /// # Errors
    /// One that does not pass its checks.
    pub fn new(problem: &Problem, settings: &Settings, name: String, file: String) -> Result<Self> {
        let source = &problem.variables.source;
        let mut table = source.table_with(settings)?;
        let of = format!("{} optimised: {}", problem.design.name, problem.description);
        let of = of.trim_end_matches([':', ' ']).to_owned();
        table.insert("name".to_owned(), toml::Value::String(name));
        table.insert("description".to_owned(), toml::Value::String(of));
        let source = DesignFile::new(source.path.clone(), table);
        let design = source.with(&Settings::new());
        Ok(Self {
            design: design.with_context(|| format!("{file}: the design found"))?,
            name: file,
            file: source,
        })
    }

    /// Writes it into the directory of results with the files that it names, and reads it again.
    ///
    /// # Errors
    /// Errors of files; a design that does not pass its checks.
    pub fn write(mut self, named: &mut NamedFiles, out: &Path) -> Result<Self> {
        let path = out.join(&self.name);
        let copies = named.place(&mut self.file.table, &self.design);
        named.write(&copies)?;
        atomic_file::write_bytes(&path, toml::to_string(&self.file.table)?.as_bytes())?;
        let design = scene_check::load(&path)
            .with_context(|| format!("{}: the design found", path.display()))?;
        Ok(Self { file: DesignFile::new(path, self.file.table), design, ..self })
    }
}

/// Removes the designs and the picture of the front of an earlier search.
pub(super) fn remove_front(out: &Path) -> Result<()> {
    for entry in std::fs::read_dir(out)? {
        let entry = entry?;
        let name = entry.file_name();
        if name.to_str().is_some_and(is_of_front) || name == FRONT_PICTURE {
            std::fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}
