// SPDX-License-Identifier: MIT OR Apache-2.0
//! Errors of a design file.

/// Errors of a design file.
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

impl ConfigError {
    /// Message without the name of the design's file.
    pub fn without_file(&self) -> String {
        match self {
            Self::Value { key, got, expected, .. } => format!("{key} = {got}: expected {expected}"),
            Self::Syntax { message, .. } | Self::Files { message, .. } => message.clone(),
            Self::Read { source, .. } => source.to_string(),
        }
    }
}
