// SPDX-License-Identifier: MIT OR Apache-2.0
//! Results that lie in a directory before a run: those of other designs and models are kept.
//!
//! A run replaces the models that it computes. Models of the same design in another content would
//! stand beside them as if they were of one, and are left out; so are those whose files are gone.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Error, Result, ensure};
use serde_json::Value;

use runtime::atomic_file;
use runtime::content_hash::{self, sealed, sha256_hex};
use runtime::provenance::FileRecord;

use super::FILE;
use super::schema::{ModelEntries, ResultsFile};

/// Results of earlier runs that stay.
#[derive(Debug, Clone)]
pub struct Earlier {
    file: ResultsFile,
    /// Designs and models that are left out, each with the reason.
    pub left_out: Vec<String>,
}

impl Earlier {
    /// Reads `results.json` in `out` for a run of `models` of the design `name` with this hash;
    /// `None` where there is none.
    ///
    /// # Errors
    /// A file that is no results of this version.
    pub fn read(
        out: &Path,
        name: &str,
        design_sha256: &str,
        models: &[String],
    ) -> Result<Option<Self>> {
        let path = out.join(FILE);
        let Ok(text) = std::fs::read(&path) else {
            return Ok(None);
        };
        let (expected, got) =
            std::str::from_utf8(&text).ok().and_then(content_hash::hashes).unwrap_or_default();
        ensure!(!got.is_empty() && expected == got, "it was altered after the run that wrote it");
        let json: Value = serde_json::from_slice(&text).context("it is no usable JSON")?;
        let mut file = ResultsFile::from_json(&json).map_err(Error::msg)?;
        ensure!(!file.quick, "it is of a quick run");
        let program = super::schema::Program::this();
        ensure!(file.program == program, "it is of version {}", file.program.version);
        let is_whole = |record: &FileRecord| {
            let bytes = std::fs::read(out.join(&record.file));
            bytes.is_ok_and(|bytes| sha256_hex(&bytes) == record.sha256)
        };
        let altered: Vec<String> =
            file.files.iter().filter(|record| !is_whole(record)).map(|r| r.file.clone()).collect();
        let mut left_out = Vec::new();
        let mut gone: Vec<String> = Vec::new();
        for group in [&mut file.designs, &mut file.references] {
            for (design, entries) in group.iter_mut() {
                entries.retain(|model, entry| {
                    let folder = format!("{design}/{model}/");
                    let replaced = design == name && models.contains(model);
                    let other = design == name && entry.design_sha256 != design_sha256;
                    let torn = altered.iter().any(|file| file.starts_with(&folder));
                    if !replaced && (other || torn) {
                        let why = if other {
                            "of another content of the design"
                        } else {
                            "whose files were altered or removed"
                        };
                        left_out.push(format!("{design}/{model}, {why}"));
                    }
                    let stays = !(replaced || other || torn);
                    if stays {
                        entry.seed.get_or_insert(file.seed);
                    } else {
                        gone.push(folder);
                    }
                    stays
                });
            }
            group.retain(|_, entries| !entries.is_empty());
        }
        file.files.retain(|record| {
            !gone.iter().any(|folder| record.file.starts_with(folder))
                && !altered.contains(&record.file)
        });
        Ok(Some(Self { file, left_out }))
    }

    /// True if nothing stays.
    pub fn is_empty(&self) -> bool {
        self.file.designs.is_empty() && self.file.references.is_empty()
    }

    /// Names of designs that stay, with their models.
    pub fn kept(&self) -> Vec<String> {
        let all = self.file.designs.iter().chain(&self.file.references);
        all.flat_map(|(design, entries)| entries.keys().map(move |m| format!("{design}/{m}")))
            .collect()
    }

    /// Writes them alone, as `results.json` under `out`: while a run replaces files that they do not
    /// list.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, out: &Path) -> Result<()> {
        atomic_file::write_json(&out.join(FILE), &sealed(serde_json::to_value(&self.file)?)?)
    }

    /// The results of a run with these beside them.
    pub fn with(&self, new: ResultsFile) -> ResultsFile {
        let mut file = self.file.clone();
        let join = |kept: &mut BTreeMap<String, ModelEntries>, new| {
            for (design, entries) in new {
                kept.entry(design).or_default().extend(entries);
            }
        };
        join(&mut file.designs, new.designs);
        join(&mut file.references, new.references);
        for input in new.inputs {
            file.inputs.retain(|known| known.file != input.file);
            file.inputs.push(input);
        }
        file.files.extend(new.files);
        file.files.sort_by(|a, b| a.file.cmp(&b.file));
        ResultsFile { seed: new.seed, ..file }
    }
}
