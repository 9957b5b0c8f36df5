// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design that a search has found as a file: made, written beside the files that it names, and
//! read again.

use std::path::{Component, Path};

use anyhow::{Context, Result, ensure};

use design::Design;
use design::dotted_keys::Settings;
use files::atomic_file;
use simulate::scene_check;

use super::problem::Problem;
use crate::design_file::DesignFile;

/// The design that was found, under the directory of results.
pub const DESIGN: &str = "design.toml";
/// Picture of the Pareto front, beside it.
pub const FRONT_PICTURE: &str = "front.png";
/// Start of the names of files of a Pareto front.
pub(super) const FRONT: &str = "front-";

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

    /// Writes it into `out` with the files that it names, and reads it again.
    ///
    /// # Errors
    /// Errors of files; a design that does not pass its checks.
    pub fn write(self, problem: &Problem, out: &Path) -> Result<Self> {
        let path = out.join(&self.name);
        copy_named_files(problem, out)?;
        atomic_file::write_bytes(&path, toml::to_string(&self.file.table)?.as_bytes())?;
        let design = scene_check::load(&path)
            .with_context(|| format!("{}: the design found", path.display()))?;
        Ok(Self { file: DesignFile::new(path, self.file.table), design, ..self })
    }
}

/// Copies the files that the design names to where the design that was found looks for them.
fn copy_named_files(problem: &Problem, out: &Path) -> Result<()> {
    let source = &problem.variables.source.path;
    let folder = source.parent().unwrap_or(Path::new(""));
    for record in &problem.design.provenance.named {
        let name = Path::new(&record.file);
        let relative = name.strip_prefix(folder).unwrap_or(name);
        let plain = relative.components().all(|part| matches!(part, Component::Normal(_)));
        ensure!(
            plain,
            "design: expected files that it names below its own folder, got `{}`",
            record.file
        );
        let bytes = std::fs::read(folder.join(relative))
            .with_context(|| format!("`{}` cannot be read", record.file))?;
        atomic_file::write_bytes(&out.join(relative), &bytes)?;
    }
    Ok(())
}

/// True where `name` is that of a design of a Pareto front.
pub fn is_of_front(name: &str) -> bool {
    let number = name.strip_prefix(FRONT).and_then(|rest| rest.strip_suffix(".toml"));
    number.is_some_and(|number| number.parse::<u32>().is_ok())
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
