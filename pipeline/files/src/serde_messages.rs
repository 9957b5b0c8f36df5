// SPDX-License-Identifier: MIT OR Apache-2.0
//! serde's complaints in the words of all other messages: key, expected, got.

use metrics::digits::readable;

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
