// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reads TOML, and says what the reader complains of in one line: place, key, what it expected, what it found.

use serde::de::DeserializeOwned;
use serde_path_to_error::{Path, Segment};

/// What begins the messages that say themselves what was expected and found; the text at their place is a value or a whole table.
const COMPLETE: [&str; 5] = [
    "unknown ",
    "missing ",
    "invalid type",
    "invalid value",
    "invalid length",
];
/// Most characters of the text that are shown.
const MOST_SHOWN: usize = 40;

/// What `text` holds.
///
/// # Errors
/// The complaint about it, with line and column, both from 1, and the key whose value is at fault.
pub(crate) fn read<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let reader = toml::Deserializer::parse(text).map_err(|e| complaint(text, "", &e))?;
    serde_path_to_error::deserialize(reader)
        .map_err(|e| complaint(text, &key(e.path(), e.inner()), e.inner()))
}

/// The key that leads to the value at fault, entries of lists from 1; of a key that is not known, which the complaint names itself, the one above it.
fn key(path: &Path, error: &toml::de::Error) -> String {
    let mut steps: Vec<String> = path
        .iter()
        .filter_map(|segment| match segment {
            Segment::Seq { index } => Some(format!("[{}]", index + 1)),
            Segment::Map { key } => Some(format!(".{key}")),
            Segment::Enum { .. } | Segment::Unknown => None,
        })
        .collect();
    if error.message().starts_with("unknown field") {
        steps.pop();
    }
    steps.concat().trim_start_matches('.').to_owned()
}

fn complaint(text: &str, key: &str, error: &toml::de::Error) -> String {
    let span = error.span().unwrap_or_default();
    let before = text.get(..span.start).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    let said = error
        .message()
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    let of = if key.is_empty() {
        String::new()
    } else {
        format!("{key}: ")
    };
    let mut complaint = format!("line {line}, column {column}: {of}{said}");
    if COMPLETE.iter().any(|begin| said.starts_with(begin)) {
        return complaint;
    }
    if !said.contains("expected") {
        complaint += ", expected TOML";
    }
    complaint + ", got " + &found(text, span)
}

/// The text of a place, to the end of its line; of an empty place, what follows it.
fn found(text: &str, span: std::ops::Range<usize>) -> String {
    let rest = text.get(span.start..).unwrap_or_default();
    let length = if span.is_empty() {
        rest.len()
    } else {
        span.len()
    };
    let line = rest.get(..length).unwrap_or(rest).lines().next();
    let shown: String = line.unwrap_or_default().chars().take(MOST_SHOWN).collect();
    match shown.trim_end() {
        "" if rest.trim().is_empty() => "the end of the file".to_owned(),
        "" => "the end of the line".to_owned(),
        shown => format!("`{shown}`"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Sheet {
        #[expect(dead_code, reason = "only refused")]
        name: String,
        #[expect(dead_code, reason = "only refused")]
        size: Option<[f64; 2]>,
        #[expect(dead_code, reason = "only refused")]
        #[serde(default)]
        parts: Vec<Part>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Part {
        #[expect(dead_code, reason = "only refused")]
        height: f64,
    }

    #[test]
    fn every_complaint_is_one_line_with_its_place() {
        for (text, expected) in [
            ("name = = \"bad\"\n", "line 1, column 8: "),
            (
                "name = \"a\"\nname = \"b\"\n",
                "line 2, column 1: duplicate key, expected TOML, got `name`",
            ),
            ("name = \"a\"\n\n[size", "line 3, column 6: "),
            ("name = \"a\nsize = 1", "line 1, column 10: "),
            ("name = \"ä\" size = [1, 2]", "line 1, column 12: "),
            (
                "name = 3",
                "line 1, column 8: name: invalid type: integer `3`, expected a string",
            ),
            (
                "name = \"a\"\nwidth = 3",
                "line 2, column 1: unknown field `width`, expected one of `name`, `size`, `parts`",
            ),
            (
                "size = [1.0, 2.0]",
                "line 1, column 1: missing field `name`",
            ),
            (
                "name = \"a\"\nsize = [1.0]",
                "line 2, column 8: size: invalid length 1, expected an array of length 2",
            ),
            (
                "name = \"a\"\nsize = [1.0, \"b\"]",
                "line 2, column 14: size[2]: invalid type: string \"b\", expected f64",
            ),
            (
                "name = \"a\"\n[[parts]]\nheight = 1.0\nwidth = 1.0",
                "line 4, column 1: parts[1]: unknown field `width`, expected `height`",
            ),
            (
                "name = \"a\"\n[[parts]]\nheight = 1.0\n[[parts]]\nheight = true",
                "line 5, column 10: parts[2].height: invalid type: boolean `true`, expected f64",
            ),
        ] {
            let said = read::<Sheet>(text).expect_err(text);
            assert!(said.starts_with(expected) && !said.contains('\n'), "{said}");
            let complete = COMPLETE.iter().any(|begin| said.contains(begin));
            assert!(
                complete || said.contains("expected") && said.contains(", got "),
                "{said}"
            );
        }
    }
}
