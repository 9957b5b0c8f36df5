// SPDX-License-Identifier: MIT OR Apache-2.0
//! The design file of a session, and the draft that is kept in a hidden file beside it until it is
//! saved or discarded.

use std::ffi::OsString;
use std::fs;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use runtime::atomic_file::{Flush, replace, rewrite};

/// Links that may lead from one to the next.
const MAX_LINKS: usize = 40;

/// The file.
#[derive(Debug)]
pub struct DesignFile {
    /// As given.
    path: PathBuf,
    /// The draft beside the file that links lead to.
    draft: PathBuf,
}

impl DesignFile {
    /// The file at `path`.
    ///
    /// # Errors
    /// Links that lead in a circle; a path that ends in no name.
    pub fn new(path: &Path) -> Result<Self> {
        let target = target(path)?;
        let name = target.file_name();
        let name = name.with_context(|| format!("{}: expected a file", path.display()))?;
        let hidden = [".".as_ref(), name, ".draft".as_ref()].into_iter().collect::<OsString>();
        Ok(Self { path: path.to_owned(), draft: target.with_file_name(hidden) })
    }

    /// The path as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path of the draft.
    pub fn draft_path(&self) -> &Path {
        &self.draft
    }

    /// Text of the file with `\n` at the ends of its lines, and whether they end as on Windows.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(&self) -> Result<(String, bool), Error> {
        let text = design::read_text(&self.path)?;
        let has_crlf = text.contains("\r\n");
        Ok((text.replace("\r\n", "\n"), has_crlf))
    }

    /// Writes the file. Its mode, its owner, its other names and the links that lead to it stay.
    ///
    /// # Errors
    /// A file that must not or cannot be written.
    pub fn write(&self, text: &str) -> Result<()> {
        let target = target(&self.path)?;
        match fs::metadata(&target) {
            Ok(_) => rewrite(&target, text.as_bytes()),
            Err(error) if error.kind() == ErrorKind::NotFound => {
                self.replace(&target, text, Flush::Now)
            }
            Err(error) => Err(error).with_context(|| format!("`{}`", target.display())),
        }
    }

    /// The draft of a session that ended without saving it.
    ///
    /// # Errors
    /// A draft that is there and cannot be read.
    pub fn draft(&self) -> Result<Option<String>> {
        match design::read_text(&self.draft) {
            Ok(text) => Ok(Some(text)),
            Err(_) if !self.draft.exists() => Ok(None),
            Err(error) => Err(error).with_context(|| {
                let draft = self.draft.display();
                format!("`{draft}`: a draft of an earlier session that cannot be read")
            }),
        }
    }

    /// Keeps `draft`, or none; the system flushes it when it likes where `is_passing`.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn keep(&self, draft: Option<&str>, is_passing: bool) -> Result<()> {
        let flush = if is_passing { Flush::Later } else { Flush::Now };
        match draft {
            Some(text) => self.replace(&self.draft, text, flush),
            None => match fs::remove_file(&self.draft) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    Err(error).with_context(|| format!("cannot remove `{}`", self.draft.display()))
                }
                _ => Ok(()),
            },
        }
    }

    /// Replaces `path` by a file with the mode of the design file or, where that is gone, of its
    /// draft.
    fn replace(&self, path: &Path, text: &str, flush: Flush) -> Result<()> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let is_there = folder.is_none_or(Path::is_dir);
        ensure!(is_there, "`{}` cannot be written: its folder is gone", path.display());
        let about = fs::metadata(&self.path).or_else(|_| fs::metadata(&self.draft));
        let permissions = about.ok().map(|about| about.permissions());
        replace(path, text.as_bytes(), flush, permissions)
    }
}

/// The path that the links from `path` lead to, be there a file or not.
fn target(path: &Path) -> Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..=MAX_LINKS {
        let Ok(next) = fs::read_link(&target) else { return Ok(target) };
        target = target.parent().unwrap_or(Path::new("")).join(next);
    }
    bail!("`{}`: expected a file, got links that lead in a circle", path.display())
}
