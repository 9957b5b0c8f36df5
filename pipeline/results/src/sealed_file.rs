// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reads a JSON file of results that holds the version of its layout and the hash of its content.

use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, anyhow, ensure};
use serde::de::DeserializeOwned;

use runtime::atomic_file::supersede;
use runtime::content_hash;
use runtime::provenance::FileRecord;
use runtime::serde_messages::key_text;

/// A file of results that holds the version of its layout and the hash of its content, and lists the
/// files written with it.
pub trait SealedFile: DeserializeOwned {
    /// Name under the directory of results.
    const FILE: &'static str;
    /// Version of the layout.
    const VERSION: u32;
    /// Work that writes it, for messages, such as `search`.
    const WORK: &'static str;
    /// Remedy of a file of another version, such as `search again`.
    const AGAIN: &'static str;

    /// Files written with it.
    fn files(&self) -> &[FileRecord];

    /// Reads the file in `directory`, if there is one.
    ///
    /// # Errors
    /// A file that cannot be read, was altered or is of another layout.
    fn read(directory: &Path) -> Result<Option<Self>> {
        let path = directory.join(Self::FILE);
        if path.exists() { read::<Self>(&path).map(Some) } else { Ok(None) }
    }

    /// Removes the file in `directory` and those that it lists there, before others take their place;
    /// what is among `inputs` stays. A file that cannot be read lists none.
    ///
    /// # Errors
    /// A file that cannot be removed.
    fn remove_earlier(directory: &Path, inputs: &[FileRecord]) -> Result<()> {
        let path = directory.join(Self::FILE);
        let json = std::fs::read(&path).ok().and_then(|text| bsdf::json::parse(&text).ok());
        let listed = json.as_ref().and_then(|json| json["files"].as_array());
        let names = listed.into_iter().flatten().filter_map(|file| file["file"].as_str());
        let inputs: Vec<PathBuf> =
            inputs.iter().filter_map(|input| std::fs::canonicalize(&input.file).ok()).collect();
        for name in names.map(Path::new).filter(|name| lies_within(name)) {
            let listed = directory.join(name);
            let is_input = std::fs::canonicalize(&listed).is_ok_and(|path| inputs.contains(&path));
            if !is_input {
                supersede(&listed)?;
            }
        }
        supersede(&path)
    }
}

/// True of a path that does not leave the folder that it starts from.
fn lies_within(name: &Path) -> bool {
    name.components().all(|part| matches!(part, Component::Normal(_)))
}

fn read<T: SealedFile>(path: &Path) -> Result<T> {
    let shown = path.display();
    let text = std::fs::read(path).with_context(|| format!("cannot read `{shown}`"))?;
    let json = bsdf::json::parse(&text).with_context(|| format!("`{shown}` is no usable JSON"))?;
    let found = &json["schema_version"];
    ensure!(
        *found == T::VERSION,
        "`{shown}`: schema_version: expected {}, got {found}; {} with this version",
        T::VERSION,
        T::AGAIN
    );
    let (expected, got) =
        std::str::from_utf8(&text).ok().and_then(content_hash::hashes).unwrap_or_default();
    ensure!(
        !got.is_empty() && expected == got,
        "`{shown}`: {}: it was altered after the {}: its content has SHA-256 {expected}, got {got}",
        content_hash::KEY,
        T::WORK
    );
    serde_path_to_error::deserialize(&json)
        .map_err(|e| anyhow!("`{shown}`: {}: {}", key_text(e.path()), e.inner()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_outside_of_the_folder_is_removed() {
        for (name, expected) in [
            ("film.csv", true),
            ("film/1.png", true),
            ("../film.csv", false),
            ("/etc/film.csv", false),
            ("film/../../x", false),
        ] {
            assert_eq!(lies_within(Path::new(name)), expected, "{name}");
        }
    }
}
