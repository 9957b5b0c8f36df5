// SPDX-License-Identifier: MIT OR Apache-2.0
//! A refusal with the key or the line that it is about, as the page shows it.

use anyhow::Error;
use serde::Serialize;

use design::ConfigError;

/// A refusal, as the page reads it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fault {
    /// Dotted path of the key.
    key: Option<String>,
    /// Line of the text, from 1.
    line: Option<usize>,
    message: String,
    /// True where what was asked for meets something that changed meanwhile.
    #[serde(skip)]
    is_conflict: bool,
}

impl Fault {
    /// The refusal of a design whose file is called `file`.
    pub fn of_design(error: &Error, file: &str) -> Self {
        let (key, message) = match error.downcast_ref::<ConfigError>() {
            Some(known) => {
                let key = match known {
                    ConfigError::Value { key, .. } => Some(key.clone()),
                    _ => None,
                };
                (key, known.without_file())
            }
            None => (None, format!("{error:#}")),
        };
        let is_of_text = matches!(error.downcast_ref(), Some(ConfigError::Syntax { .. }));
        let message =
            message.strip_prefix(&format!("{file}: ")).map_or(message.clone(), str::to_owned);
        let line = line(&message).filter(|_| is_of_text);
        Self { key, line, message, is_conflict: false }
    }

    /// A refusal that is about no key.
    pub fn new(message: impl Into<String>) -> Self {
        Self { key: None, line: None, message: message.into(), is_conflict: false }
    }

    /// A refusal since something changed meanwhile.
    pub fn conflict(message: impl Into<String>) -> Self {
        Self { is_conflict: true, ..Self::new(message) }
    }

    /// Status of the answer.
    pub fn status(&self) -> u16 {
        if self.is_conflict { 409 } else { 400 }
    }

    /// The message.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The same about the key that was to be set, where it names none.
    pub fn about(self, key: &str) -> Self {
        Self { key: self.key.or_else(|| Some(key.to_owned())), ..self }
    }
}

/// The line that a message of the TOML reader names.
fn line(message: &str) -> Option<usize> {
    let after = message.strip_prefix("line ")?;
    let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_refusal_names_its_key_or_its_line() {
        let of = |text: &str| {
            let error = simulate::scene_check::parse("own.toml", text, Path::new(""));
            Fault::of_design(&error.expect_err("refused"), "own.toml")
        };
        let text = design::NEW_DESIGN.replace("NAME", "own");
        let value = of(&text.replace("pitch_mm = 5.0", "pitch_mm = -5.0"));
        assert_eq!(value.key.as_deref(), Some("array.pitch_mm"));
        assert!(!value.message.contains("own.toml"), "{value:?}");
        let syntax = of(&text.replace("pitch_mm = 5.0", "pitch_mm = = 5.0"));
        let expected = text.lines().position(|line| line.contains("pitch_mm")).map(|k| k + 1);
        assert_eq!((syntax.key, syntax.line), (None, expected));
        // A word of another message.
        let other =
            Fault::of_design(&anyhow::anyhow!("line 3 of light.csv: no number"), "own.toml");
        assert_eq!(other.line, None);
    }
}
