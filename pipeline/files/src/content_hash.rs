// SPDX-License-Identifier: MIT OR Apache-2.0
//! The hash that a JSON file of results holds of its own content, so that a change of it is
//! noticed.
//!
//! It is the SHA-256 of the file's text without white space at its end and without the digits of
//! the hash themselves: whoever reads the file can find it without knowing how numbers were
//! printed.

use serde_json::Value;
use sha2::{Digest, Sha256};

/// The key that holds it.
pub const KEY: &str = "content_sha256";

/// `value`, an object, with its hash, for a file that is written as
/// [`serde_json::to_string_pretty`] prints it.
///
/// # Errors
/// A value that cannot be written as JSON.
pub fn sealed(mut value: Value) -> serde_json::Result<Value> {
    value[KEY] = "".into();
    value[KEY] = digest(&serde_json::to_string_pretty(&value)?).into();
    Ok(value)
}

/// The hash of a text and the one that it holds; `None` without a place for one.
#[must_use]
pub fn hashes(text: &str) -> Option<(String, &str)> {
    let key = format!("\"{KEY}\"");
    let after = text.find(&key)? + key.len();
    let value = text[after..].trim_start().strip_prefix(':')?.trim_start();
    let from = text.len() - value.strip_prefix('"')?.len();
    let digits = &text[from..from + text[from..].find('"')?];
    let rest = [&text[..from], &text[from + digits.len()..]].concat();
    Some((digest(&rest), digits))
}

/// SHA-256 of a text without white space at its end.
fn digest(text: &str) -> String {
    sha256_hex(text.trim_end().as_bytes())
}

/// Hexadecimal SHA-256.
pub fn sha256_hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    Sha256::digest(bytes).iter().fold(String::with_capacity(64), |mut s, b| {
        let _ = write!(s, "{b:02x}");
        s
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn any_change_is_noticed() {
        let value = sealed(json!({"b": 1.5, "a": ["x"], "z": {"content": 2}})).expect("JSON");
        let text = serde_json::to_string_pretty(&value).expect("JSON") + "\n";
        let holds = |text: &str| hashes(text).is_some_and(|(a, b)| a == b);
        assert!(holds(&text) && holds(text.trim_end()));
        for (from, to) in [("1.5", "1.6"), ("\"z\"", "\"y\""), ("x", ""), ("{\n", "{\r\n")] {
            assert!(!holds(&text.replacen(from, to, 1)), "{from} to {to}");
        }
        for none in ["", "{}", "{\"content_sha256\": 5, \"a\": \"b\"}"] {
            assert_eq!(hashes(none), None);
        }
    }
}
