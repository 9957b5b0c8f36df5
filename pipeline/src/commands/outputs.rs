// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks that results can be written before anything is computed, and says what an interrupted
//! command keeps.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use arrays::cache::Cache;
use runtime::atomic_file::discard_abandoned;
use runtime::control_characters::refusal;
use runtime::run_context::RunContext;
use runtime::store::Store;

/// Parts that an interrupted run keeps: tables of orders.
pub(super) const TABLES: &str = "tables";
/// Parts that an interrupted run keeps: groups of paths.
pub(super) const PATHS: &str = "groups of paths";

/// Sets the line that an interrupt before `results.json` prints: which finished parts stay in
/// `cache`.
pub(super) fn note_interrupt(context: RunContext, cache: Option<&Cache>, what: &[Option<&str>]) {
    let what: Vec<&str> = what.iter().copied().flatten().collect();
    let cache = cache.filter(|_| !what.is_empty());
    let kept = cache.map_or(String::new(), |cache| {
        let (what, directory) = (what.join(" and "), cache.directory().display());
        format!("; finished {what} stay in `{directory}`, a new run goes on from there")
    });
    context.interrupt.note(format!("before {} was written{kept}", results::FILE));
}

/// The store of finished groups of paths in `cache`; none where a job has one already.
pub(super) fn checkpoints(cache: Option<&Cache>, context: RunContext) -> Result<Option<Store>> {
    let cache = cache.filter(|_| context.checkpoints.is_none());
    cache.map(|cache| Store::of_program(cache.directory(), context.console)).transpose()
}

/// Refuses a path, called `what`, that steers the terminal on which it is shown.
pub(super) fn refuse_control(what: &str, path: &Path) -> Result<()> {
    match refusal(&path.to_string_lossy(), false) {
        Some(refusal) => bail!("{what}: {refusal}"),
        None => Ok(()),
    }
}

/// Refuses a directory into which no file can be written, whether it exists or not. Leaves nothing
/// behind, and removes what writers there left that were killed.
pub(super) fn writable(directory: &Path) -> Result<()> {
    refuse_control("path of results", directory)?;
    let refused = || format!("cannot write into `{}`", directory.display());
    let there = directory
        .ancestors()
        .map(|ancestor| if ancestor.as_os_str().is_empty() { Path::new(".") } else { ancestor })
        .find(|ancestor| ancestor.symlink_metadata().is_ok())
        .unwrap_or(Path::new("."));
    let kind = there.metadata().with_context(refused)?;
    ensure!(
        kind.is_dir(),
        "{}: expected a directory, got the file `{}`",
        refused(),
        there.display()
    );
    // A file without a name stays behind in no case.
    tempfile::tempfile_in(there).map(drop).with_context(refused)?;
    discard_abandoned(directory);
    Ok(())
}

/// Refuses a file that cannot be written: its directory refuses, or it is a directory itself.
pub(super) fn file_writable(path: &Path) -> Result<()> {
    refuse_control("path of results", path)?;
    ensure!(
        !path.is_dir(),
        "cannot write `{}`: expected a file or nothing, got a directory",
        path.display()
    );
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    writable(parent.unwrap_or(Path::new(".")))
}

/// Refuses results that cannot be written: `folders` and `files` under `out`, tables in `cache`.
/// Then makes `out`.
pub(super) fn results_writable(
    out: &Path,
    folders: impl IntoIterator<Item = PathBuf>,
    files: &[&str],
    cache: Option<&Cache>,
) -> Result<()> {
    writable(out)?;
    for folder in folders {
        writable(&out.join(folder))?;
    }
    for file in files {
        file_writable(&out.join(file))?;
    }
    if let Some(cache) = cache {
        writable(cache.directory()).context("tables cannot be kept (--cache)")?;
    }
    std::fs::create_dir_all(out)
        .with_context(|| format!("cannot create the directory `{}`", out.display()))
}
