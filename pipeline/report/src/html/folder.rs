// SPDX-License-Identifier: MIT OR Apache-2.0
//! A folder of results, checked before anything is read from it.
//!
//! In: the directory that `reproduce`, `run` or `optimise` wrote. Out: `results.json` and the
//! certainty that every file that it lists is there and is the one that the run wrote. Files that
//! it does not list are no part of the results.

use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail, ensure};

use results::FILE;
use results::schema::ResultsFile;
use runtime::content_hash::{self, sha256_hex};
use runtime::provenance::FileRecord;

use crate::published::Published;
use results::sealed_file::SealedFile;

/// A folder of results.
#[derive(Debug)]
pub struct Folder {
    directory: PathBuf,
    path: PathBuf,
    results: ResultsFile,
}

impl Folder {
    /// Reads `results.json` in `directory` and checks every file that it lists.
    ///
    /// # Errors
    /// No such folder, no results in it, another schema version, a file that is missing or altered.
    pub fn open(directory: &Path) -> Result<Self> {
        let shown = directory.display();
        let kind = directory.metadata();
        let kind = kind.with_context(|| format!("`{shown}`: expected a directory of results"))?;
        ensure!(kind.is_dir(), "`{shown}`: expected a directory of results, got a file");
        let path = directory.join(FILE);
        let text = std::fs::read(&path).with_context(|| {
            format!(
                "cannot read `{}`; expected a directory written by `reproduce`, `run`, `optimise`, `study`, `tolerance`, `full-wave`, `zones` or `bsdf --films`",
                path.display()
            )
        })?;
        let json = bsdf::json::parse(&text)
            .with_context(|| format!("`{}` is no usable JSON", path.display()))?;
        let of_file = |said: String| anyhow!("`{}`: {said}", path.display());
        for key in ["schema_version", content_hash::KEY] {
            if json.get(key).is_none() {
                bail!(of_file(format!("{key}: expected a value, got none")));
            }
        }
        ResultsFile::check_version(&json).map_err(of_file)?;
        let (expected, got) =
            std::str::from_utf8(&text).ok().and_then(content_hash::hashes).unwrap_or_default();
        ensure!(
            !got.is_empty() && expected == got,
            "`{0}`: {1}: `{0}` was altered after the run: its content has SHA-256 {expected}, got {got}",
            path.display(),
            content_hash::KEY
        );
        let mut results = ResultsFile::from_json(&json).map_err(of_file)?;
        Published::load()?.join(&mut results);
        check_files(directory, FILE, &results.files)?;
        Ok(Self { directory: directory.to_owned(), path, results })
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// `results.json`.
    pub fn results(&self) -> &ResultsFile {
        &self.results
    }

    /// File and key, as messages begin.
    pub fn place(&self, key: &str) -> String {
        format!("`{}`: {key}", self.path.display())
    }

    /// The path of a file that the entry under the key `user` needs.
    ///
    /// # Errors
    /// If the results do not list it.
    pub fn file(&self, name: &str, user: &str) -> Result<PathBuf> {
        ensure!(
            self.results.files.iter().any(|entry| entry.file == name),
            "{}: expected `{name}`, which {user} needs, got none",
            self.place("files")
        );
        Ok(self.directory.join(name))
    }
}

/// A folder with a sealed file, checked.
#[derive(Debug)]
pub struct SealedFolder<T> {
    directory: PathBuf,
    /// The sealed file.
    pub file: T,
}

impl<T: SealedFile> SealedFolder<T> {
    /// Reads the sealed file in `directory` and checks every file that it lists; none where there is no
    /// such file.
    ///
    /// # Errors
    /// A file of another layout; one that is missing or altered.
    pub fn open(directory: &Path) -> Result<Option<Self>> {
        let Some(file) = T::read(directory)? else {
            return Ok(None);
        };
        check_files(directory, T::FILE, file.files())?;
        Ok(Some(Self { directory: directory.to_owned(), file }))
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }
}

/// True if `path` is `main` in `directory` or one of the `files` that it lists.
pub(super) fn is_one_of(directory: &Path, files: &[FileRecord], main: &str, path: &Path) -> bool {
    let Ok(path) = path.canonicalize() else {
        return false;
    };
    let own = files.iter().map(|entry| entry.file.as_str());
    own.chain([main]).any(|name| directory.join(name).canonicalize().ok().as_deref() == Some(&path))
}

/// Checks that the files that `main` in `directory` lists lie there and are the ones that were written.
pub(super) fn check_files(directory: &Path, main: &str, files: &[FileRecord]) -> Result<()> {
    let main = directory.join(main);
    files.iter().enumerate().try_for_each(|(i, entry)| {
        check_file(directory, entry, &format!("`{}`: files[{}]", main.display(), i + 1))
    })
}

fn check_file(directory: &Path, entry: &FileRecord, place: &str) -> Result<()> {
    let file = Path::new(&entry.file);
    let inside = |part: Component| matches!(part, Component::Normal(_));
    ensure!(
        file.components().all(inside) && file.components().next().is_some(),
        "{place}.file: expected a path under the folder, got {:?}",
        entry.file
    );
    let path = directory.join(file);
    let bytes = std::fs::read(&path).with_context(|| {
        format!("{place}.file: cannot read `{}`, which belongs to these results", path.display())
    })?;
    let (expected, got) = (&entry.sha256, sha256_hex(&bytes));
    ensure!(
        *expected == got,
        "{place}.sha256: `{}` was altered after the run that wrote it: expected {expected}, got {got}",
        path.display()
    );
    Ok(())
}
