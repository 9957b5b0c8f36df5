// SPDX-License-Identifier: MIT OR Apache-2.0
//! The hash that a JSON file of results holds of its own content, so that a change of it is
//! noticed.
//!
//! It is the SHA-256 of the file's text without white space at its end and without the digits of
//! the hash themselves: whoever reads the file can find it without knowing how numbers were
//! printed.

use std::io::{self, Read};
use std::path::Path;

use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::bounded_text::open;

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
    hexadecimal(Sha256::digest(bytes).iter())
}

/// Hexadecimal SHA-256 of the file at `path`, of any size.
///
/// # Errors
/// A file that cannot be read.
pub fn sha256_of_file(path: &Path) -> io::Result<String> {
    let (mut file, mut hash, mut part) = (open(path)?, Sha256::new(), Vec::new());
    while Read::by_ref(&mut file).take(1 << 20).read_to_end(&mut part)? > 0 {
        hash.update(&part);
        part.clear();
    }
    Ok(hexadecimal(hash.finalize().iter()))
}

fn hexadecimal<'a>(bytes: impl Iterator<Item = &'a u8>) -> String {
    use std::fmt::Write;
    bytes.fold(String::with_capacity(64), |mut s, b| {
        let _ = write!(s, "{b:02x}");
        s
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_file_is_hashed_whole() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        for length in [0, 1, 1 << 20, (5 << 19) + 3] {
            let bytes: Vec<u8> = (0..=250).cycle().take(length).collect();
            std::fs::write(file.path(), &bytes).expect("written");
            assert_eq!(sha256_of_file(file.path()).expect("read"), sha256_hex(&bytes));
        }
    }

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
