// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reads TOML, and says what the reader complains of in one line: place, key, what it expected,
//! what it found.

use std::ops::Range;

use serde::de::DeserializeOwned;
use serde_path_to_error::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use runtime::control_characters::refusal;
use runtime::serde_messages::{key, plain};

use super::dotted_keys::{Step, steps};
use super::tagged::{Complaint, TaggedTable, is_inserted};

/// Most characters of a word that are shown.
const MAX_SHOWN: usize = 16;

/// Reads `text`; `tagged` are the tables in it that are of one of several kinds.
///
/// # Errors
/// The complaint about it, with line and column, both from 1, and the key whose value is at fault.
pub fn read<T: DeserializeOwned>(text: &str, tagged: &[TaggedTable]) -> Result<T, String> {
    read_with(text, tagged, &[])
}

/// The same with `values` in place of those at some keys, each as TOML.
pub(super) fn read_with<T: DeserializeOwned>(
    text: &str,
    tagged: &[TaggedTable],
    values: &[(String, String)],
) -> Result<T, String> {
    // `2e6` may be meant for either kind of number. `3.0` is a real one, and names of set-ups keep it;
    // where a key takes whole numbers alone it is one.
    read_as(text, tagged, values, |text| text.contains(['e', 'E']))
        .or_else(|first| read_as(text, tagged, values, |_| true).map_err(|_| first))
}

/// `message` on the value at the dotted `key` of `text`, with its place.
pub(super) fn at_key(text: &str, key: &str, message: &str) -> String {
    let mut file = DeTable::parse(text).ok();
    let value = file.as_mut().and_then(|file| value_at(file.get_mut(), key));
    let place = value.map_or_else(String::new, |value| at(text, &value.span()));
    format!("{place}{key}: {message}")
}

/// The value at the dotted `key`.
fn value_at<'a, 'i>(table: &'a mut DeTable<'i>, key: &str) -> Option<&'a mut Spanned<DeValue<'i>>> {
    let mut steps = steps(key)?.into_iter();
    let Some(Step::Key(first)) = steps.next() else { return None };
    steps.try_fold(table.get_mut(first)?, |at, step| match (at.get_mut(), step) {
        (DeValue::Table(table), Step::Key(key)) => table.get_mut(key),
        (DeValue::Array(list), Step::Entry(number)) => list.get_mut(number.checked_sub(1)?),
        _ => None,
    })
}

/// `text` as TOML with `values` at some keys.
fn parsed<'i>(
    text: &'i str,
    values: &'i [(String, String)],
) -> Result<Spanned<DeTable<'i>>, toml::de::Error> {
    let mut file = DeTable::parse(text)?;
    for (key, value) in values {
        if let Some(at) = value_at(file.get_mut(), key) {
            *at.get_mut() = DeValue::parse(value)?.into_inner();
        }
    }
    Ok(file)
}

/// The same with numbers taken as whole ones that are and that `may_be`.
fn read_as<T: DeserializeOwned>(
    text: &str,
    tagged: &[TaggedTable],
    values: &[(String, String)],
    may_be: fn(&str) -> bool,
) -> Result<T, String> {
    let syntax = |error: toml::de::Error| {
        let span = error.span().unwrap_or_default();
        at(text, &span) + &in_syntax(error.message(), text, span)
    };
    // Keys that hold any number take whole ones too.
    let mut digits = Vec::new();
    let mut plain = parsed(text, values).map_err(syntax)?;
    whole_numbers(plain.get_mut(), may_be, &mut |_, whole| digits.push(whole));
    let mut whole = digits.iter();
    let mut file = parsed(text, values).map_err(syntax)?;
    whole_numbers(file.get_mut(), may_be, &mut |value, _| {
        if let Some(Ok(number)) = whole.next().map(|digits| DeValue::parse(digits)) {
            *value = number.into_inner();
        }
    });
    let placed = |(span, said): Complaint| at(text, &span) + &said;
    refuse_controls(file.get_ref(), "").map_err(placed)?;
    for table in tagged {
        table.rearrange(file.get_mut()).map_err(placed)?;
    }
    serde_path_to_error::deserialize(toml::Deserializer::from(file))
        .map_err(|e| complaint(text, e.path(), e.inner()))
}

/// Largest whole number that every format of numbers holds.
const MAX_WHOLE: f64 = 9_007_199_254_740_992.0;

/// Called for a number, with the digits that it stands for.
type Seen<'a, 'i> = &'a mut dyn FnMut(&mut DeValue<'i>, String);

/// Calls `see` for every number of `table` without a fraction whose text `may_be` whole.
fn whole_numbers<'i>(table: &mut DeTable<'i>, may_be: fn(&str) -> bool, see: Seen<'_, 'i>) {
    for (_, entry) in table.iter_mut() {
        whole_number(entry.get_mut(), may_be, see);
    }
}

fn whole_number<'i>(value: &mut DeValue<'i>, may_be: fn(&str) -> bool, see: Seen<'_, 'i>) {
    match value {
        DeValue::Float(float) => {
            let text = float.as_str();
            let number = text.parse::<f64>().ok().filter(|_| may_be(text));
            let is_whole = |number: &f64| number.fract() == 0.0 && number.abs() <= MAX_WHOLE;
            if let Some(number) = number.filter(is_whole) {
                see(value, format!("{number:.0}"));
            }
        }
        DeValue::Array(list) => {
            for entry in list.iter_mut() {
                whole_number(entry.get_mut(), may_be, see);
            }
        }
        DeValue::Table(table) => whole_numbers(table, may_be, see),
        _ => {}
    }
}

/// Refuses keys and texts with control characters: they would steer the terminal, and pictures and
/// pages have no place for them.
fn refuse_controls(table: &DeTable<'_>, path: &str) -> Result<(), Complaint> {
    for (name, value) in table {
        if let Some(said) = refusal(name.get_ref(), false) {
            return Err((name.span(), format!("key: {said}")));
        }
        let path = if path.is_empty() { name.to_string() } else { format!("{path}.{name}") };
        refuse_controls_of(value, &path)?;
    }
    Ok(())
}

fn refuse_controls_of(value: &Spanned<DeValue<'_>>, path: &str) -> Result<(), Complaint> {
    match value.get_ref() {
        DeValue::String(text) => {
            let lines = path == "description" || path.ends_with(".description");
            let said = refusal(text, lines);
            said.map_or(Ok(()), |said| Err((value.span(), format!("{path}: {said}"))))
        }
        DeValue::Array(entries) => (1..).zip(entries.iter()).try_for_each(|(number, entry)| {
            refuse_controls_of(entry, &format!("{path}[{number}]"))
        }),
        DeValue::Table(table) => refuse_controls(table, path),
        _ => Ok(()),
    }
}

/// The place of a complaint.
fn at(text: &str, span: &Range<usize>) -> String {
    let before = text.get(..span.start).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    format!("line {line}, column {column}: ")
}

fn complaint(text: &str, path: &Path, error: &toml::de::Error) -> String {
    let span = error.span().unwrap_or_default();
    let place = at(text, &span);
    let said = error.message().split_whitespace();
    let said = said.collect::<Vec<_>>().join(" ");
    let (mut key, kind) = key(path, is_inserted);
    let message = match plain(&said, "a table", kind) {
        Some(words) => {
            if let Some(missing) = words.missing {
                key = format!("{key}.{missing}");
            }
            words.message
        }
        None => in_syntax(&said, text, span),
    };
    match key.trim_start_matches('.') {
        "" => place + &message,
        key => format!("{place}{key}: {message}"),
    }
}

/// Message on the form of the text, with what stands there.
fn in_syntax(said: &str, text: &str, span: Range<usize>) -> String {
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let expected = match &*said {
        "duplicate key" => "expected each key once".to_owned(),
        "wanted string or table" => "expected a text".to_owned(),
        // A type that states what it expects, and nothing else.
        _ if said.starts_with("a ") => format!("expected {said}"),
        _ if said.contains("expected") => said,
        _ => said + ", expected TOML",
    };
    format!("{expected}, got {}", found(text, span.start))
}

/// The word or the mark at a place: what is no TOML may be a file of another kind, of which no line
/// is shown.
fn found(text: &str, place: usize) -> String {
    let rest = text.get(place..).unwrap_or_default();
    let line = rest.lines().next().unwrap_or_default().trim_start();
    let is_of_word = |c: &char| c.is_alphanumeric() || "_-.".contains(*c);
    let word: String = line.chars().take_while(is_of_word).take(MAX_SHOWN).collect();
    match (word.is_empty(), line.chars().next()) {
        (false, _) => format!("`{word}`"),
        (true, Some(mark)) => format!("`{mark}`"),
        (true, None) if rest.trim().is_empty() => "the end of the file".to_owned(),
        (true, None) => "the end of the line".to_owned(),
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
        #[expect(dead_code, reason = "only refused")]
        count: Option<usize>,
    }

    #[test]
    fn a_number_without_a_fraction_is_a_whole_one_where_a_key_asks_for_it() {
        for count in ["3", "3.0", "3e0", "0.3e1"] {
            let text = format!("name = \"a\"\n[[parts]]\nheight = 1.0\ncount = {count}");
            assert!(read::<Sheet>(&text, &[]).is_ok(), "{count}");
        }
    }

    #[test]
    fn every_complaint_is_one_line_with_its_place() {
        for (text, expected) in [
            ("name = = \"bad\"\n", "line 1, column 8: "),
            (
                "name = \"a\"\nname = \"b\"\n",
                "line 2, column 1: expected each key once, got `name`",
            ),
            ("root:x:0:0:root:/root\n", "line 1, column "),
            ("name = \"a\"\n\n[size", "line 3, column 6: "),
            ("name = \"a\nsize = 1", "line 1, column 10: "),
            ("name = \"ä\" size = [1, 2]", "line 1, column 12: "),
            ("name = 3", "line 1, column 8: name: expected a text, got 3"),
            (
                "name = \"a\"\nwidth = 3",
                "line 2, column 1: width: no such key, expected one of name, size, parts",
            ),
            ("size = [1.0, 2.0]", "line 1, column 1: name: expected a value, got none"),
            ("name = \"a\"\nsize = [1.0]", "line 2, column 8: size: expected a list of 2, got 1"),
            (
                "name = \"a\"\nsize = [1.0, \"b\"]",
                "line 2, column 14: size[2]: expected a number, got \"b\"",
            ),
            ("name = \"a\"\nparts = 1.5", "line 2, column 9: parts: expected a list, got 1.5"),
            (
                "name = \"a\\u001b[31m\"",
                "line 1, column 8: name: expected text without control characters, got \"a\\u{1b}[31m\"",
            ),
            (
                "name = \"a\"\n[[parts]]\n\"a\\u0007\" = 1",
                "line 3, column 1: key: expected text without control characters, got \"a\\u{7}\"",
            ),
            (
                "name = \"a\"\n[[parts]]\nheight = 1.0\nwidth = 1.0",
                "line 4, column 1: parts[1].width: no such key, expected height or count",
            ),
            (
                "name = \"a\"\n[[parts]]\nheight = 1.0\n[[parts]]\nheight = true",
                "line 5, column 10: parts[2].height: expected a number, got true",
            ),
            (
                "name = \"a\"\n[[parts]]\nheight = 1.0\ncount = -1",
                "line 4, column 9: parts[1].count: expected a whole number from 0, got -1",
            ),
            (
                "name = \"a\"\n[[parts]]\nheight = 1.0\ncount = 1.5",
                "line 4, column 9: parts[1].count: expected a whole number from 0, got 1.5",
            ),
        ] {
            let said = read::<Sheet>(text, &[]).expect_err(text);
            assert!(said.starts_with(expected) && !said.contains('\n'), "{said}");
            assert!(said.contains("expected") && !said.contains("/root"), "{said}");
        }
    }
}
