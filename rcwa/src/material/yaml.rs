// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reader of the part of YAML in which refractiveindex.info writes its data files.
//!
//! A file is a mapping at column 0; only its key `DATA` is read, a list of flat mappings whose
//! values are plain, quoted or literal block text. Everything else at column 0 is skipped with what
//! is indented below it. Strict within `DATA`: unknown keys, stray lines and odd columns are
//! errors.

use std::cmp::Ordering;

use super::{Formula, Material, MaterialError, Source, Table, formula_source};

/// Lines of text with their numbers, from 1.
type Numbered<'a> = (usize, &'a str);

/// One entry of the list: where it begins, and its keys with the lines of their values.
struct Entry<'a> {
    line: usize,
    keys: Vec<Key<'a>>,
}

struct Key<'a> {
    line: usize,
    name: &'a str,
    value: Vec<Numbered<'a>>,
}

pub(super) fn parse(text: &str) -> Result<Material, MaterialError> {
    let (mut n, mut k) = (None, None);
    for entry in entries(&data_lines(text)?)? {
        let line = entry.line;
        let [new_n, new_k] = read_entry(&entry)?;
        for (slot, new, key) in [(&mut n, new_n, "n"), (&mut k, new_k, "k")] {
            if slot.is_some() && new.is_some() {
                return Err(MaterialError::Twice { line, key: key.into() });
            }
            *slot = slot.take().or(new);
        }
    }
    let n = n.ok_or(MaterialError::Missing("an entry in DATA that gives n"))?;
    Material::paired(n, k)
}

/// The lines below `DATA:`, blank ones and comments left out.
fn data_lines(text: &str) -> Result<Vec<Numbered<'_>>, MaterialError> {
    let mut inside = false;
    let mut seen = false;
    let mut lines = Vec::new();
    for (i, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let number = i + 1;
        if line.trim().is_empty() || line.trim_start().starts_with('#') {
            continue;
        }
        let list_item = inside && (line == "-" || line.starts_with("- "));
        if line.starts_with([' ', '\t']) || list_item {
            if inside {
                lines.push((number, line));
            }
            continue;
        }
        if line == "---" || line == "..." {
            continue;
        }
        let expected = "KEY: at the left margin, as in the YAML files of refractiveindex.info, a heading wl,n as in its CSV files, or a glass catalogue with lines NM (an index that is one number needs no file)";
        let (key, value) = line.split_once(':').ok_or_else(|| MaterialError::Line {
            line: number,
            expected,
            got: line.chars().take(80).collect(),
        })?;
        inside = key == "DATA";
        if inside && seen {
            return Err(MaterialError::Twice { line: number, key: key.into() });
        }
        if inside && !without_comment(value).is_empty() {
            let expected = "a list below DATA:";
            return Err(MaterialError::Line { line: number, expected, got: value.trim().into() });
        }
        seen |= inside;
    }
    if seen {
        Ok(lines)
    } else {
        Err(MaterialError::Missing("the key DATA of a YAML file of refractiveindex.info"))
    }
}

/// Cuts the lines of the list into entries and their keys.
fn entries<'a>(lines: &[Numbered<'a>]) -> Result<Vec<Entry<'a>>, MaterialError> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut dash_column = None;
    let mut key_column = 0;
    for &(line, text) in lines {
        let error = |expected| MaterialError::Line { line, expected, got: text.trim().into() };
        let content = text.trim_start_matches(' ');
        let mut column = text.len() - content.len();
        if content.starts_with('\t') {
            return Err(error("spaces, not tabs, before the text"));
        }
        let mut pair = content;
        let begins = content == "-" || content.starts_with("- ");
        if begins && dash_column.is_none_or(|c| c == column) {
            dash_column = Some(column);
            pair = content[1..].trim_start();
            column = text.len() - pair.len();
            entries.push(Entry { line, keys: Vec::new() });
            if pair.is_empty() {
                continue;
            }
        }
        let Some(entry) = entries.last_mut() else {
            return Err(error("an entry that begins with \"- type:\""));
        };
        if entry.keys.is_empty() {
            key_column = column;
        }
        match column.cmp(&key_column) {
            Ordering::Equal => {
                let (name, value) = pair.split_once(':').ok_or_else(|| error("key: value"))?;
                if entry.keys.iter().any(|k| k.name == name) {
                    return Err(MaterialError::Twice { line, key: name.into() });
                }
                let value =
                    Some(without_comment(value)).filter(|v| !matches!(*v, "" | "|" | "|-" | "|+"));
                let value = value.map(|v| (line, v)).into_iter().collect();
                entry.keys.push(Key { line, name, value });
            }
            Ordering::Greater => {
                let key = entry.keys.last_mut().ok_or_else(|| error("key: value"))?;
                key.value.push((line, content.trim_end()));
            }
            Ordering::Less => {
                return Err(error("a key in line with the others, or a new entry \"- type:\""));
            }
        }
    }
    Ok(entries)
}

/// The sources of n and k that an entry gives.
fn read_entry(entry: &Entry) -> Result<[Option<Source>; 2], MaterialError> {
    const KEYS: [&str; 5] = ["type", "data", "coefficients", "wavelength_range", "range"];
    if let Some(unknown) = entry.keys.iter().find(|k| !KEYS.contains(&k.name)) {
        let line = unknown.line;
        let expected = "one of the keys type, data, coefficients, wavelength_range";
        return Err(MaterialError::Line { line, expected, got: unknown.name.into() });
    }
    let kind = find(entry, "type").ok_or(MaterialError::Missing("type in an entry of DATA"))?;
    let kind: Vec<&str> = kind.value.iter().flat_map(|v| v.1.split_whitespace()).collect();
    let in_entry = |problem| MaterialError::Entry { line: entry.line, problem: Box::new(problem) };
    match kind[..] {
        ["tabulated", "nk"] => {
            let both = Material::tabulated(&rows(entry)?).map_err(in_entry)?;
            Ok([Some(both.n), Some(both.k)])
        }
        ["tabulated", which @ ("n" | "k")] => {
            let table = Some(Source::Table(Table::new(rows(entry)?).map_err(in_entry)?));
            Ok(if which == "n" { [table, None] } else { [None, table] })
        }
        ["formula", number] => {
            let formula = number.parse().ok().and_then(Formula::from_number).ok_or_else(|| {
                MaterialError::Line {
                    line: entry.line,
                    expected: "formula 1 to formula 9",
                    got: kind.join(" "),
                }
            })?;
            let coefficients = find(entry, "coefficients")
                .ok_or(MaterialError::Missing("coefficients of a formula"))?;
            let range = find(entry, "wavelength_range").or_else(|| find(entry, "range"));
            let range = range.ok_or(MaterialError::Missing("wavelength_range of a formula"))?;
            let range =
                numbers(range)?.try_into().map_err(|got: Vec<f64>| MaterialError::Line {
                    line: entry.line,
                    expected: "wavelength_range of two numbers",
                    got: format!("{got:?}"),
                })?;
            let source = formula_source(formula, &numbers(coefficients)?, range);
            Ok([Some(source.map_err(in_entry)?), None])
        }
        _ => Err(MaterialError::Line {
            line: entry.line,
            expected: "type: tabulated nk, tabulated n, tabulated k or formula 1 to 9",
            got: kind.join(" "),
        }),
    }
}

fn find<'a, 'b>(entry: &'b Entry<'a>, name: &str) -> Option<&'b Key<'a>> {
    entry.keys.iter().find(|k| k.name == name)
}

/// The table of an entry, a line a row of N numbers.
fn rows<const N: usize>(entry: &Entry) -> Result<Vec<[f64; N]>, MaterialError> {
    let data = find(entry, "data").ok_or(MaterialError::Missing("data of a table"))?;
    let expected = if N == 2 { "a row of 2 numbers" } else { "a row of 3 numbers" };
    data.value
        .iter()
        .map(|&(line, text)| {
            let error = || MaterialError::Line { line, expected, got: text.into() };
            let row: Option<Vec<f64>> = text.split_whitespace().map(|w| w.parse().ok()).collect();
            row.and_then(|r| r.try_into().ok()).ok_or_else(error)
        })
        .collect()
}

/// The numbers of a value, however many lines it takes.
fn numbers(key: &Key) -> Result<Vec<f64>, MaterialError> {
    let words = key
        .value
        .iter()
        .flat_map(|&(line, text)| text.split_whitespace().map(move |word| (line, word)));
    words
        .map(|(line, word)| {
            let error = || MaterialError::Line { line, expected: "a number", got: word.into() };
            word.parse().map_err(|_| error())
        })
        .collect()
}

/// A value without the comment behind it and without quotes around it.
fn without_comment(value: &str) -> &str {
    let value = if value.trim_start().starts_with('#') { "" } else { value };
    let value = value.split_once(" #").map_or(value, |(before, _)| before).trim();
    let unquoted = |q| value.strip_prefix(q).and_then(|v: &str| v.strip_suffix(q));
    unquoted('"').or_else(|| unquoted('\'')).unwrap_or(value)
}
