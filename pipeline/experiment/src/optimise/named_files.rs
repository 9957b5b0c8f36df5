// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files that a found design names: copies of them under the directory of results, and the names by
//! which the design finds them there.
//!
//! A file below the folder of the design keeps its place. One that lies elsewhere, or whose name is
//! that of an output, goes into a folder of its own, and its name in the design follows.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result};
use toml::Value;

use design::Design;
use runtime::atomic_file;
use runtime::bounded_text;

use super::outputs::is_output;
use super::problem::Problem;
use crate::design_file::DesignFile;

/// Folder of files that cannot keep their places; further ones have a number.
const MOVED: &str = "files";
/// Stands for the number of a band in names of files.
const BAND: &str = "{band}";

/// Places of copies, the same for all designs of one search.
pub(super) struct NamedFiles<'a> {
    problem: &'a Problem,
    out: &'a Path,
    /// Folder of the design, which names are relative to.
    folder: &'a Path,
    /// Folders whose files are moved, in the order of their numbers.
    moved: Vec<PathBuf>,
}

impl<'a> NamedFiles<'a> {
    pub fn new(problem: &'a Problem, out: &'a Path) -> Self {
        let source = &problem.variables.source.path;
        let folder = source.parent().unwrap_or(Path::new(""));
        Self { problem, out, folder, moved: Vec::new() }
    }

    /// Sets the names of files in `table` to those of their copies; returns source by copy, the
    /// latter relative to the directory of results.
    pub fn place(
        &mut self,
        table: &mut toml::Table,
        design: &Design,
    ) -> BTreeMap<PathBuf, PathBuf> {
        let named = design.provenance.all_named().map(|record| PathBuf::from(&record.file));
        let used = design.files.used.iter().map(|used| self.folder.join(&used.file));
        let known: Vec<PathBuf> = named.chain(used).collect();
        let mut copies = BTreeMap::new();
        for (_, value) in table.iter_mut() {
            self.place_in(value, &known, &mut copies);
        }
        copies
    }

    fn place_in(
        &mut self,
        value: &mut Value,
        known: &[PathBuf],
        copies: &mut BTreeMap<PathBuf, PathBuf>,
    ) {
        match value {
            Value::Table(table) => {
                table.iter_mut().for_each(|(_, value)| self.place_in(value, known, copies));
            }
            Value::Array(list) => {
                for value in list {
                    self.place_in(value, known, copies);
                }
            }
            Value::String(name) => {
                let sources: Vec<&PathBuf> =
                    known.iter().filter(|path| self.is_named(name, path)).collect();
                if sources.is_empty() {
                    return;
                }
                let placed = self.placed(name);
                let folder = Path::new(&placed).parent().unwrap_or(Path::new(""));
                for source in sources {
                    let file = source.file_name().unwrap_or_default();
                    copies.insert(folder.join(file), source.clone());
                }
                *name = placed;
            }
            _ => {}
        }
    }

    /// True where `name` is that of the file at `path`, with the number of a band in it or not.
    fn is_named(&self, name: &str, path: &Path) -> bool {
        let stated = self.folder.join(name);
        let (stated, path) = (stated.to_string_lossy(), path.to_string_lossy());
        match stated.split_once(BAND) {
            None => stated == path,
            Some((before, after)) => {
                let band = path.strip_prefix(before).and_then(|rest| rest.strip_suffix(after));
                band.is_some_and(|band| band.parse::<usize>().is_ok())
            }
        }
    }

    /// The name of the copy of the file `name`.
    fn placed(&mut self, name: &str) -> String {
        let path = Path::new(name);
        let is_below = path.components().all(|part| matches!(part, Component::Normal(_)));
        if is_below && !self.is_taken(path) {
            return name.to_owned();
        }
        let folder = self.folder.join(path.parent().unwrap_or(Path::new("")));
        let number = self.moved.iter().position(|known| *known == folder).unwrap_or_else(|| {
            self.moved.push(folder);
            self.moved.len() - 1
        });
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        match number {
            0 => format!("{MOVED}/{file}"),
            _ => format!("{MOVED}-{}/{file}", number + 1),
        }
    }

    /// True where a copy at `path` would replace an output, an input or the copy of a moved file.
    fn is_taken(&self, path: &Path) -> bool {
        let first = path.components().next().map(|part| part.as_os_str().to_string_lossy());
        let first = first.unwrap_or_default().to_ascii_lowercase();
        let designs = [&self.problem.name, &self.problem.design.name];
        let is_moved = first.strip_prefix(MOVED).is_some_and(|rest| {
            rest.is_empty() || rest.strip_prefix('-').is_some_and(|k| k.parse::<usize>().is_ok())
        });
        is_moved
            || is_output(&first)
            || designs.iter().any(|name| name.eq_ignore_ascii_case(&first))
            || self.is_other_input(path)
    }

    /// True where another file that the search reads lies where the copy of `path` would.
    fn is_other_input(&self, path: &Path) -> bool {
        let Ok(target) = self.out.join(path).canonicalize() else {
            return false;
        };
        let is_input = |file: &str| Path::new(file).canonicalize().is_ok_and(|at| at == target);
        let is_itself = self.folder.join(path).canonicalize().is_ok_and(|at| at == target);
        !is_itself && self.problem.inputs.iter().any(|input| is_input(&input.file))
    }

    /// Writes the copies.
    ///
    /// # Errors
    /// Files that cannot be read or written.
    pub fn write(&self, copies: &BTreeMap<PathBuf, PathBuf>) -> Result<()> {
        for (copy, source) in copies {
            let cannot = || format!("`{}` cannot be read", source.display());
            let mut file = bounded_text::open(source).with_context(cannot)?;
            atomic_file::write_atomic(&self.out.join(copy), |copy| {
                std::io::copy(&mut file, copy).with_context(cannot)?;
                Ok(())
            })?;
        }
        Ok(())
    }
}

/// Copies of the files that the design of `problem` names, relative to the directory `out` of
/// results.
pub fn copies(problem: &Problem, out: &Path) -> Vec<PathBuf> {
    let DesignFile { mut table, .. } = problem.variables.source.clone();
    let placed = NamedFiles::new(problem, out).place(&mut table, &problem.design);
    placed.into_keys().collect()
}
