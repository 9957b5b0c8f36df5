// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design file in which keys are set: one design of many that a study or a search asks for.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};

use design::dotted_keys::{self, Settings};
use design::{ConfigError, Design, toml_errors};
use runtime::provenance::FileRecord;
use simulate::scene_check;

/// Key of the places of packages.
const POSITIONS: &str = "array.positions_file";

/// A design file as TOML, before keys are set.
#[derive(Debug, Clone)]
pub struct DesignFile {
    /// The file, which files that it names lie beside.
    pub path: PathBuf,
    /// Its keys.
    pub table: toml::Table,
    /// Name of the design in it.
    pub name: String,
}

impl DesignFile {
    /// The design file at `path`, which holds `table`.
    pub fn new(path: PathBuf, table: toml::Table) -> Self {
        let name = table.get("name").and_then(toml::Value::as_str);
        let name = name.unwrap_or_default().to_owned();
        Self { path, table, name }
    }

    /// The design file at `path`, with its record.
    ///
    /// # Errors
    /// A file that cannot be read, or is no TOML.
    pub fn read(path: &Path) -> Result<(Self, FileRecord)> {
        let text = design::read_text(path);
        Self::of_text(path, &text.with_context(|| format!("`{}` cannot be read", path.display()))?)
    }

    /// The design whose text stands for the file at `path`.
    ///
    /// # Errors
    /// Text that is no TOML.
    pub fn of_text(path: &Path, text: &str) -> Result<(Self, FileRecord)> {
        let name = path.display();
        let table = toml_errors::read(text, &[]).map_err(|said| anyhow!("`{name}`: {said}"))?;
        let record = FileRecord::new(name.to_string(), text.as_bytes());
        Ok((Self::new(path.to_path_buf(), table), record))
    }

    /// Its table with the keys of `settings` set.
    ///
    /// # Errors
    /// A key that cannot be set.
    pub fn table_with(&self, settings: &Settings) -> Result<toml::Table> {
        let mut table = self.table.clone();
        let file = || self.path.display().to_string();
        dotted_keys::set_all(&mut table, settings).with_context(file)?;
        Ok(table)
    }

    /// The design with the keys of `settings` set.
    ///
    /// # Errors
    /// A key that cannot be set; a design that does not pass its checks.
    pub fn with(&self, settings: &Settings) -> Result<Design> {
        let table = self.table_with(settings)?;
        self.check_effect(settings, &table)?;
        let text = toml::to_string(&table);
        let text = text.with_context(|| self.path.display().to_string())?;
        let design = self.parse(&text);
        let design = design.map_err(|error| self.by_key(shorter(error), settings))?;
        scene_check::check(&design)?;
        Ok(design)
    }

    /// Refuses a pitch in `settings` that moves no package of `table`, whose places are those of a
    /// file.
    ///
    /// # Errors
    /// Such a pitch.
    pub fn check_effect(
        &self,
        settings: &Settings,
        table: &toml::Table,
    ) -> Result<(), ConfigError> {
        let is_within = |key: &str, whole: &str| {
            key.strip_prefix(whole).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let places = dotted_keys::get(table, POSITIONS);
        let states_places = settings.keys().any(|key| key == "array" || key == POSITIONS);
        match (settings.keys().find(|key| is_within(key, "array.pitch_mm")), places) {
            (Some(key), Some(file)) if !states_places => Err(ConfigError::Syntax {
                file: self.path.display().to_string(),
                message: format!(
                    "{key}: expected a key that moves packages, which stand where {POSITIONS} = \
                     {file} says; its choices can be such files"
                ),
            }),
            _ => Ok(()),
        }
    }

    fn parse(&self, text: &str) -> Result<Design, ConfigError> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        design::parse(&self.path.display().to_string(), text, folder)
    }

    /// A syntax error with the keys of `settings` that cause it: those without which it changes or
    /// vanishes.
    fn by_key(&self, error: ConfigError, settings: &Settings) -> anyhow::Error {
        let said = error.to_string();
        let without = |key: &str| -> Result<bool> {
            let mut others = settings.clone();
            others.remove(key);
            let text = toml::to_string(&self.table_with(&others)?)?;
            let parsed = self.parse(&text);
            Ok(parsed.map_or_else(|e| shorter(e).to_string() != said, |_| true))
        };
        let keys: Vec<&str> = match error {
            ConfigError::Syntax { .. } => settings.keys().map(String::as_str).collect(),
            _ => Vec::new(),
        };
        let about = keys.into_iter().filter(|key| without(key).unwrap_or(false));
        let about: Vec<&str> = about.collect();
        if about.is_empty() {
            error.into()
        } else {
            anyhow::Error::from(error).context(about.join(", "))
        }
    }
}

/// The last line of a syntax error: the text it quotes is generated.
fn shorter(error: ConfigError) -> ConfigError {
    match error {
        ConfigError::Syntax { file, message } => ConfigError::Syntax {
            file,
            message: message.lines().last().unwrap_or_default().to_owned(),
        },
        other => other,
    }
}
