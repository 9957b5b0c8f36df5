// SPDX-License-Identifier: MIT OR Apache-2.0
//! Design files: TOML text in, a checked [`Design`] out.
//!
//! Two steps. [`schema`] mirrors the file key by key and refuses unknown keys; [`resolved`] holds
//! only values that passed every check, so nothing later asks again whether a length is positive.
//! Every error names the file, the key, what was found and what was expected.
//!
//! ```
//! use std::path::Path;
//!
//! let text = design::NEW_DESIGN.replace("NAME", "my-package");
//! let checked = design::parse("my-package.toml", &text, Path::new(""))?;
//! assert_eq!(checked.name, "my-package");
//!
//! let wrong = text.replace("pitch_mm = 5.0", "pitch_mm = -5.0");
//! let error = design::parse("my-package.toml", &wrong, Path::new("")).unwrap_err();
//! assert!(error.to_string().contains("array.pitch_mm"));
//! # Ok::<(), design::ConfigError>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`schema`] | the file as written, one field a key; doc comments are the reference |
//! | [`tagged`] | tables of several kinds |
//! | [`toml_errors`], [`error`] | messages on the form of the file, and on its values |
//! | `check` | ranges of lengths, numbers, counts and names |
//! | [`resolve`] | defaults and checks, a file a table |
//! | [`resolved`] | the checked design, and the names of what its traces depend on |
//! | [`spectrum`], [`material`] | wavelengths and their weights; indices from files |
//! | [`shapes`] | generating curves as the tracer's shapes |
//! | [`dotted_keys`] | keys of a design by path, set by studies and searches |
//! | [`formulas`] | numbers that are sums and products of numbers and keys |
//! | [`json_schema`] | JSON Schema for editors, Python and the reference |

mod check;
pub mod dotted_keys;
pub mod error;
pub mod formulas;
pub mod json_schema;
pub mod material;
pub mod resolve;
pub mod resolved;
pub mod schema;
pub mod shapes;
pub mod spectrum;
pub mod tagged;
#[cfg(test)]
mod tests;
pub mod toml_errors;

use std::path::{Path, PathBuf};

use runtime::bounded_text::{MAX_KEYS, bounded_text};

pub use error::ConfigError;
pub use resolved::Design;

/// The embedded design files, by name: `reproduce` needs no file beside the binary.
pub const EMBEDDED: [(&str, &str); 5] = [
    ("d1.toml", include_str!("../../../data/designs/d1.toml")),
    ("d2.toml", include_str!("../../../data/designs/d2.toml")),
    ("d3.toml", include_str!("../../../data/designs/d3.toml")),
    ("bare-dome.toml", include_str!("../../../data/designs/bare-dome.toml")),
    ("commercial-7p5.toml", include_str!("../../../data/designs/commercial-7p5.toml")),
];

/// Commented design that `batwing new` writes, with NAME where its name stands.
pub const NEW_DESIGN: &str = include_str!("new_design.toml");

/// The same of packages under films.
pub const NEW_BACKLIGHT: &str = include_str!("new_backlight.toml");

/// The same of packages with dies of three colours, before a panel.
pub const NEW_RGB_BACKLIGHT: &str = include_str!("new_rgb_backlight.toml");

/// Keys of earlier versions, with the reason why they are gone.
const REMOVED: [(&str, &str); 4] = [
    (
        "trace.split",
        "path splitting costs more time than it saves (docs/performance.md); take more paths",
    ),
    ("hybrid.incidence", ABLATIONS),
    ("hybrid.scattering", ABLATIONS),
    ("hybrid.spread_deg", ABLATIONS),
];
const ABLATIONS: &str = "tables with something left out were for the reproduction of the paper, which has their results (docs/reproduction.md)";

/// Reads and checks the design file at `path`. Material files are looked for beside it.
pub fn load(path: &Path) -> Result<Design, ConfigError> {
    let file = path.display().to_string();
    let unreadable = |source| ConfigError::Read { file: file.clone(), source };
    refuse_large(&file, std::fs::metadata(path).map_err(unreadable)?.len())?;
    let text = read_text(path).map_err(unreadable)?;
    let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    parse(&file, &text, &folder)
}

/// Reads a text file that is no larger than a design may be.
///
/// # Errors
/// A file that cannot be read or is too large.
pub fn read_text(path: &Path) -> std::io::Result<String> {
    bounded_text(path, MAX_KEYS)
        .map_err(|error| error.downcast().unwrap_or_else(std::io::Error::other))
}

fn refuse_large(file: &str, bytes: u64) -> Result<(), ConfigError> {
    if bytes <= MAX_KEYS {
        return Ok(());
    }
    let message = format!(
        "expected a design of at most {} MB, got {}; long lists go into files that it names",
        MAX_KEYS / 1_000_000,
        bytes as f64 / 1e6
    );
    Err(ConfigError::Syntax { file: file.to_owned(), message })
}

/// Checks the text of a design; `file` names it in messages, `folder` is where material files lie.
pub fn parse(file: &str, text: &str, folder: &Path) -> Result<Design, ConfigError> {
    refuse_large(file, text.len() as u64)?;
    let wrong = |message| ConfigError::Syntax { file: file.to_owned(), message };
    let written: toml::Table = text.parse().unwrap_or_default();
    for (key, reason) in REMOVED {
        if dotted_keys::get(&written, key).is_some() {
            return Err(wrong(format!("{key}: removed: {reason}")));
        }
    }
    let numbers = formulas::numbers(&written)
        .map_err(|(key, message)| wrong(toml_errors::at_key(text, &key, &message)))?;
    let mut raw: schema::Design =
        toml_errors::read_with(text, &schema::tagged_tables(), &numbers).map_err(wrong)?;
    resolve::defaults::derive(&mut raw, &written);
    let asks_for_bands = written.contains_key("hybrid");
    Design::resolve(&raw, (file, text), folder, asks_for_bands)
}

/// The embedded design called `name`, checked like any other.
pub fn embedded(name: &str) -> Result<Design, ConfigError> {
    let (file, text) =
        EMBEDDED.iter().find(|(n, _)| *n == name).ok_or_else(|| ConfigError::Read {
            file: name.to_owned(),
            source: std::io::Error::from(std::io::ErrorKind::NotFound),
        })?;
    parse(file, text, Path::new(""))
}
