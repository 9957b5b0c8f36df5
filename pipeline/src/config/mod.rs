// SPDX-License-Identifier: MIT OR Apache-2.0
//! Design files: TOML text in, a checked [`design::Design`] out.
//!
//! Two steps. [`raw`] mirrors the file key by key and refuses unknown keys; [`resolved`] holds only
//! values that passed every check, so nothing later asks again whether a length is positive.
//! Every error names the file, the key, what was found and what was expected.

pub mod at_wavelength;
mod check;
pub mod design;
pub mod dome_mesh;
mod dome_shape;
pub mod films;
mod input_files;
mod light;
mod package;
mod positions;
pub mod receivers;
pub mod schema;
pub(crate) mod serde_arrays;
mod shapes;
pub mod solids;
pub mod source_spectra;
pub mod sources;
pub(crate) mod tables;
#[cfg(test)]
mod tests;
pub(crate) mod toml_errors;

use std::path::{Path, PathBuf};

/// What is wrong with a design file.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{file}: expected a design, cannot read it")]
    Read {
        /// File as given by the user.
        file: String,
        /// Cause reported by the operating system.
        source: std::io::Error,
    },
    /// The text is not TOML, lacks a key, has an unknown key or a value of another type.
    #[error("{file}: {message}")]
    Syntax {
        /// File as given by the user.
        file: String,
        /// Message of the TOML reader, with line, column and key.
        message: String,
    },
    /// A file of `[files]` cannot be used.
    #[error("{file}: {message}")]
    Files {
        /// File as given by the user.
        file: String,
        /// Key, file, what was expected and got.
        message: String,
    },
    /// A key holds a value outside its range.
    #[error("{file}: {key} = {got}: expected {expected}")]
    Value {
        /// File as given by the user.
        file: String,
        /// Dotted path of the key.
        key: String,
        /// The value found.
        got: String,
        /// The range or set that is allowed.
        expected: String,
    },
}

/// The embedded design files, by name: `reproduce` needs no file beside the binary.
pub const EMBEDDED: [(&str, &str); 5] = [
    ("d1.toml", include_str!("../../../data/designs/d1.toml")),
    ("d2.toml", include_str!("../../../data/designs/d2.toml")),
    ("d3.toml", include_str!("../../../data/designs/d3.toml")),
    (
        "bare-dome.toml",
        include_str!("../../../data/designs/bare-dome.toml"),
    ),
    (
        "commercial-7p5.toml",
        include_str!("../../../data/designs/commercial-7p5.toml"),
    ),
];

/// Reads and checks the design file at `path`. Material files are looked for beside it.
pub fn load(path: &Path) -> Result<design::Design, ConfigError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|source| ConfigError::Read {
        file: file.clone(),
        source,
    })?;
    let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    parse(&file, &text, &folder)
}

/// Checks the text of a design; `file` names it in messages, `folder` is where material files lie.
pub fn parse(file: &str, text: &str, folder: &Path) -> Result<design::Design, ConfigError> {
    let raw: schema::Design = toml_errors::read(text).map_err(|message| ConfigError::Syntax {
        file: file.to_owned(),
        message,
    })?;
    design::Design::resolve(&raw, file, text, folder)
}

/// The embedded design called `name`, checked like any other.
pub fn embedded(name: &str) -> Result<design::Design, ConfigError> {
    let (file, text) =
        EMBEDDED
            .iter()
            .find(|(n, _)| *n == name)
            .ok_or_else(|| ConfigError::Read {
                file: name.to_owned(),
                source: std::io::Error::from(std::io::ErrorKind::NotFound),
            })?;
    parse(file, text, Path::new(""))
}
