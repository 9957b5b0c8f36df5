// SPDX-License-Identifier: MIT OR Apache-2.0
//! serde's complaints in the words of all other messages: key, expected, got.

use serde_path_to_error::{Path, Segment};

/// A complaint in plain words.
#[derive(Debug, PartialEq, Eq)]
pub struct PlainWords {
    /// The key that is missing in the table or object at the path, if one is.
    pub missing: Option<String>,
    /// Words on what was expected and found.
    pub message: String,
}

/// serde's complaint `said` in plain words; `None` where it is no such complaint. A table or object
/// is called `table`; `kind` is the kind of table that a key does not belong to.
pub fn plain(said: &str, table: &str, kind: Option<&str>) -> Option<PlainWords> {
    let found = |message: String| Some(PlainWords { missing: None, message });
    if let Some(rest) = said.strip_prefix("missing field `") {
        return Some(PlainWords {
            missing: Some(rest.split('`').next()?.to_owned()),
            message: "expected a value, got none".to_owned(),
        });
    }
    if let Some(rest) = said.strip_prefix("unknown field `") {
        let known = rest.split_once("expected ").map(|(_, known)| names(known));
        return found(match (kind, known) {
            (Some(kind), Some(known)) => {
                format!("no such key for {kind:?}, expected {known}, or one that all kinds have")
            }
            (Some(kind), None) => format!("no such key for {kind:?}, which has none of its own"),
            (None, Some(known)) => format!("no such key, expected {known}"),
            (None, None) => "no such key, expected none".to_owned(),
        });
    }
    if let Some(rest) = said.strip_prefix("unknown variant `") {
        let (got, known) = rest.split_once("`, expected ")?;
        return found(format!("expected {}, got {got:?}", names(known)));
    }
    if let Some(rest) = said.strip_prefix("invalid length ") {
        let (got, expected) = rest.split_once(", expected ")?;
        return found(format!("expected {}, got {got}", plain_type(expected, table)));
    }
    let rest = ["invalid type: ", "invalid value: "].map(|prefix| said.strip_prefix(prefix));
    let (got, expected) = rest.into_iter().flatten().next()?.rsplit_once(", expected ")?;
    let expected = plain_type(expected, table);
    found(format!("expected {expected}, got {}", plain_value(got, table)))
}

/// Names without the marks about them.
fn names(known: &str) -> String {
    known.replace('`', "")
}

/// A type as serde and its implementations name it.
fn plain_type(said: &str, table: &str) -> String {
    match said {
        "usize" | "u64" | "u32" => "a whole number from 0".to_owned(),
        "f64" => "a number".to_owned(),
        "a string" => "a text".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list".to_owned(),
        "a map" => table.to_owned(),
        _ if said.starts_with("struct ") || said.starts_with("enum ") => table.to_owned(),
        _ => said.replace("an array of length", "a list of"),
    }
}

/// A value as serde describes it: the value itself, or what it is.
fn plain_value(said: &str, table: &str) -> String {
    match said {
        "sequence" => return "a list".to_owned(),
        "map" => return table.to_owned(),
        _ => {}
    }
    let kinds = ["integer ", "floating point ", "boolean ", "string ", "unit value "];
    let value = kinds.iter().find_map(|kind| said.strip_prefix(kind));
    readable(&value.unwrap_or(said).replace('`', ""))
}

/// The key at `path`, entries of lists from 1; empty for the file itself.
pub fn key_text(path: &Path) -> String {
    key(path, |_| false).0
}

/// The key that leads to the value at fault, entries of lists from 1, without the steps that
/// `is_inserted` names, and the kind of table that it lies in.
pub fn key(path: &Path, is_inserted: impl Fn(&str) -> bool) -> (String, Option<&str>) {
    let (mut steps, mut kind) = (Vec::new(), None);
    for segment in path {
        match segment {
            Segment::Seq { index } => steps.push(format!("[{}]", index + 1)),
            Segment::Map { key } if is_inserted(key) => {}
            Segment::Map { key } => steps.push(format!(".{key}")),
            Segment::Enum { variant } => kind = Some(&**variant),
            Segment::Unknown => {}
        }
    }
    (steps.concat().trim_start_matches('.').to_owned(), kind)
}

/// A number that somebody wrote, in powers of ten where it has more digits than doubles hold; other
/// text as it is.
pub fn readable(text: &str) -> String {
    let long = text.len() > 24 && text.bytes().all(|b| b.is_ascii_digit() || b"+-.".contains(&b));
    let number = text.parse::<f64>().ok().filter(|_| long);
    number.map_or_else(|| text.to_owned(), |number| format!("{number:e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_that_no_double_holds_are_a_power_of_ten() {
        assert_eq!(readable(&1e308f64.to_string()), "1e308");
        assert_eq!(readable(&format!("{:?}", -2.5e200)), "-2.5e200");
        for plain in ["0.123456789", "a text that is rather long, with 3.0 in it", "1e-300"] {
            assert_eq!(readable(plain), plain);
        }
    }
}
