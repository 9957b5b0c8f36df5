// SPDX-License-Identifier: MIT OR Apache-2.0
//! A folder of results, checked before anything is read from it.
//!
//! In: the directory that `reproduce` or `run` wrote. Out: `results.json` and the certainty that every file that it lists is there
//! and is the one that the run wrote. Files that it does not list are no part of the results.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use super::value::At;
use crate::content_hash;
use crate::content_hash::sha256_hex;
use crate::results::{FILE, SCHEMA_VERSION};

/// A folder of results.
#[derive(Debug)]
pub struct Folder {
    directory: PathBuf,
    path: PathBuf,
    results: Value,
    files: BTreeMap<String, String>,
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
        ensure!(
            kind.is_dir(),
            "`{shown}`: expected a directory of results, got a file"
        );
        let path = directory.join(FILE);
        let text = std::fs::read(&path).with_context(|| {
            format!(
                "cannot read `{}`; expected a directory written by `reproduce` or `run`",
                path.display()
            )
        })?;
        let results = bsdf::json::parse(&text)
            .with_context(|| format!("`{}` is no usable JSON", path.display()))?;
        let top = At::top(&path, &results);
        let version = top.get("schema_version")?;
        if version.value() != &Value::from(SCHEMA_VERSION) {
            bail!(
                "{}: expected {SCHEMA_VERSION}, got {}; run the design again with this version",
                version.place(),
                version.value()
            );
        }
        let known = top.get(content_hash::KEY)?;
        let (expected, got) = std::str::from_utf8(&text)
            .ok()
            .and_then(content_hash::hashes)
            .unwrap_or_default();
        ensure!(
            !got.is_empty() && expected == got,
            "{}: `{}` was altered after the run: its content has SHA-256 {expected}, got {got}",
            known.place(),
            path.display()
        );
        let mut files = BTreeMap::new();
        for entry in top.get("files")?.list()? {
            let (name, hash) = (entry.get("file")?, entry.get("sha256")?);
            check(directory, &name, &hash)?;
            files.insert(name.text()?.to_owned(), hash.text()?.to_owned());
        }
        Ok(Self {
            directory: directory.to_owned(),
            path,
            results,
            files,
        })
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// `results.json`.
    pub fn results(&self) -> At<'_> {
        At::top(&self.path, &self.results)
    }

    /// Names and hashes of the files that belong to the results.
    pub fn files(&self) -> &BTreeMap<String, String> {
        &self.files
    }

    /// The path of a file that `user` needs.
    ///
    /// # Errors
    /// If the results do not list it.
    pub fn file(&self, name: &str, user: &At) -> Result<PathBuf> {
        ensure!(
            self.files.contains_key(name),
            "`{}`: files: expected `{name}`, which {} needs, got none",
            self.path.display(),
            user.place()
        );
        Ok(self.directory.join(name))
    }

    /// Whether `path` is one of the files of the results, or `results.json` itself.
    pub fn holds(&self, path: &Path) -> bool {
        let Ok(path) = path.canonicalize() else {
            return false;
        };
        self.files
            .keys()
            .map(String::as_str)
            .chain([FILE])
            .any(|name| self.directory.join(name).canonicalize().ok().as_deref() == Some(&path))
    }
}

/// Checks one entry of `files`.
fn check(directory: &Path, name: &At, hash: &At) -> Result<()> {
    let file = Path::new(name.text()?);
    let inside = |part: Component| matches!(part, Component::Normal(_));
    ensure!(
        file.components().all(inside) && file.components().next().is_some(),
        "{}: expected a path under the folder, got {}",
        name.place(),
        name.value()
    );
    let path = directory.join(file);
    let bytes = std::fs::read(&path).with_context(|| {
        format!(
            "{}: cannot read `{}`, which belongs to these results",
            name.place(),
            path.display()
        )
    })?;
    let (expected, got) = (hash.text()?, sha256_hex(&bytes));
    ensure!(
        expected == got,
        "{}: `{}` was altered after the run that wrote it: expected {expected}, got {got}",
        hash.place(),
        path.display()
    );
    Ok(())
}
