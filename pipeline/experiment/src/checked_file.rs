// SPDX-License-Identifier: MIT OR Apache-2.0
//! Head of the input files of experiments: reads the TOML, records the file and those that it names,
//! and names the file in errors.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result, ensure};
use serde::de::DeserializeOwned;

use design::toml_errors;
use metrics::figures;
use runtime::progress::warn_once;
use runtime::provenance::FileRecord;

use crate::design_file::DesignFile;

/// Texts that stand for files, by the names by which commands and other files call them.
pub type Texts = BTreeMap<String, String>;

/// Keys of an input file, as written.
pub trait FileKeys: DeserializeOwned {
    /// Former names of keys at the top, each with the name of today.
    const FORMER: &[(&str, &str)] = &[];
    /// Keys at the top that are gone, each with the reason.
    const REMOVED: &[(&str, &str)] = &[];
}

/// An input file while it is checked.
#[derive(Debug)]
pub struct CheckedFile<T> {
    /// Its keys.
    pub keys: T,
    /// Its text.
    pub text: String,
    /// Folder of the files that it names.
    pub folder: PathBuf,
    /// Files that went in so far.
    pub inputs: Vec<FileRecord>,
    /// Texts in place of files.
    texts: Texts,
}

impl<T: FileKeys> CheckedFile<T> {
    /// Reads the file at `path`, unless `texts` holds it, and returns what `check` makes of it.
    ///
    /// # Errors
    /// A file that cannot be read or has other keys; those of `check`.
    pub fn load<C>(path: &Path, texts: &Texts, check: impl FnOnce(Self) -> Result<C>) -> Result<C> {
        let name = path.display().to_string();
        let text =
            texts.get(&name).map_or_else(|| design::read_text(path), |text| Ok(text.clone()));
        let text = text.with_context(|| format!("{name}: cannot be read"))?;
        let read = || -> Result<Self> {
            let record = FileRecord::new(name.clone(), text.as_bytes());
            let text = of_today(&name, &text);
            let has =
                |key: &str| toml::from_str(&text).is_ok_and(|t: toml::Table| t.contains_key(key));
            for (former, now) in T::FORMER {
                ensure!(
                    !has(former),
                    "{former}: expected it to be called `{now}`, got the former name"
                );
            }
            for (removed, why) in T::REMOVED {
                ensure!(!has(removed), "{removed}: {why}");
            }
            Ok(Self {
                keys: toml_errors::read(&text, &[]).map_err(Error::msg)?,
                folder: path.parent().map_or_else(PathBuf::new, Path::to_path_buf),
                inputs: vec![record],
                text,
                texts: texts.clone(),
            })
        };
        read().and_then(check).with_context(|| name.clone())
    }
}

impl<T> CheckedFile<T> {
    /// The design file that `key` calls `name`.
    ///
    /// # Errors
    /// A file that cannot be read, or is no TOML.
    pub fn design(&mut self, key: &'static str, name: &str) -> Result<DesignFile> {
        let path = self.folder.join(name);
        let read = match self.texts.get(name) {
            Some(text) => DesignFile::of_text(&path, text),
            None => DesignFile::read(&path),
        };
        let (source, record) = read.context(key)?;
        self.inputs.push(record);
        Ok(source)
    }

    /// The TOML file that `key` calls `name`, with its path.
    ///
    /// # Errors
    /// A file that cannot be read, or is no TOML.
    pub fn toml(&mut self, key: &'static str, name: &str) -> Result<(PathBuf, toml::Table)> {
        let path = self.folder.join(name);
        let at = || format!("{key}: `{}`", path.display());
        let text = design::read_text(&path).with_context(|| format!("{} cannot be read", at()))?;
        let name = path.display().to_string();
        self.inputs.push(FileRecord::new(name.clone(), text.as_bytes()));
        let table = toml_errors::read(&of_today(&name, &text), &[])
            .map_err(|said| Error::msg(format!("{}: {said}", at())))?;
        Ok((path, table))
    }

    /// Records further files, each once.
    pub fn record<'a>(&mut self, files: impl IntoIterator<Item = &'a FileRecord>) {
        for file in files {
            if !self.inputs.contains(file) {
                self.inputs.push(file.clone());
            }
        }
    }
}

/// `text` of the file `name` with the names of figures of today; a former one is warned of.
fn of_today(name: &str, text: &str) -> String {
    let (of_today, warnings) = figures::with_names_of_today(text);
    for warning in warnings {
        warn_once(&format!("{name}: {warning}"));
    }
    of_today.into_owned()
}

/// True where a name can be that of a file in any folder.
pub fn is_file_name(name: &str) -> bool {
    let usable = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    !name.is_empty() && !name.starts_with('.') && name.chars().all(usable)
}
