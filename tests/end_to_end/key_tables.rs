// SPDX-License-Identifier: MIT OR Apache-2.0
//! Key tables of the reference, generated from the JSON Schemas of the files that users write and of
//! those that hold results.
//!
//! In: a page with marked places and the schema of its file. Out: the page with each place filled.
//! A place begins with `<!-- keys: PATH -->` and ends with `<!-- end -->`; PATH is the dotted path
//! of a table, empty for the file itself. Types, kinds, choices, required keys and defaults follow
//! from the schema types, what a key means from their doc comments.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use serde_json::Value;

use design::json_schema::of_file;
use gratings::grating_case::keys::CaseKeys;
use pipeline::commands::schema::InputFile;
use results::package::PackageFile;
use results::schema::ResultsFile;
use results::zones::ZonesFile;

const BEGIN: &str = "<!-- keys:";
const END: &str = "<!-- end -->";

/// Fills all marked places of a page.
///
/// # Errors
/// A place without an end, or of a table that the file does not have.
fn fill(page: &str, schema: &Value) -> Result<String> {
    let mut filled = String::new();
    let mut rest = page;
    while let Some(start) = rest.find(BEGIN) {
        let (before, place) = rest.split_at(start);
        ensure!(!before.contains(END), "{END} without {BEGIN}");
        let (path, after) = place[BEGIN.len()..].split_once("-->").context("an open marker")?;
        let path = path.trim();
        let end = after.find(END).with_context(|| format!("{path}: expected {END}"))?;
        let table = table(at(schema, path).with_context(|| format!("{path}: no such table"))?);
        let marker = format!("{BEGIN} {path}").trim_end().to_owned();
        write!(filled, "{before}{marker} -->\n\n{table}\n{END}")?;
        rest = &after[end + END.len()..];
    }
    ensure!(!rest.contains(END), "{END} without {BEGIN}");
    Ok(filled + rest)
}

/// The schema of the table at a dotted path; of lists and of tables by name, that of their entries.
fn at<'a>(schema: &'a Value, path: &str) -> Option<&'a Value> {
    let steps = path.split('.').filter(|step| !step.is_empty());
    steps.into_iter().try_fold(schema, |table, step| {
        let mut forms = forms(table).into_iter();
        let found = forms.find_map(|form| form["properties"].get(step))?;
        let entry = |of: &&'a Value| {
            let named = of.get("additionalProperties").filter(|entry| entry.is_object());
            of.get("items").or(named).filter(|_| of.get("properties").is_none())
        };
        std::iter::successors(Some(found), entry).last()
    })
}

/// The kinds of a table; the table itself where it is of one kind.
fn forms(table: &Value) -> Vec<&Value> {
    table["oneOf"].as_array().map_or_else(|| vec![table], |forms| forms.iter().collect())
}

/// One key of a table.
struct Row<'a> {
    schema: &'a Value,
    is_required: bool,
    /// Kinds that have the key.
    kinds: Vec<&'a str>,
    /// Texts of the kinds that the key names.
    choices: Vec<(&'a str, &'a Value)>,
}

fn table(schema: &Value) -> String {
    let forms = forms(schema);
    let mut rows: BTreeMap<&str, Row<'_>> = BTreeMap::new();
    for form in &forms {
        let Some(keys) = form["properties"].as_object() else { continue };
        let tag = keys.iter().find_map(|(key, value)| Some((&**key, value["const"].as_str()?)));
        let tag = tag.or_else(|| Some(("", form["title"].as_str()?)));
        for (key, value) in keys {
            let needed = form["required"].as_array();
            let row = rows.entry(key).or_insert_with(|| Row {
                schema: value,
                is_required: true,
                kinds: Vec::new(),
                choices: Vec::new(),
            });
            row.is_required &= needed.is_some_and(|all| all.contains(&Value::from(&**key)));
            row.kinds.extend(tag.map(|(_, kind)| kind));
            if let Some((_, kind)) = tag.filter(|(tag, _)| tag == key) {
                row.choices.push((kind, &form["description"]));
            }
        }
    }
    let mut sorted: Vec<_> = rows.into_iter().collect();
    sorted.sort_by_key(|(key, row)| (row.choices.is_empty(), !row.is_required, *key));
    let mut text = "| key | value | meaning |\n|---|---|---|\n".to_owned();
    for (key, row) in sorted {
        let of_all = row.kinds.len() == forms.len() || row.kinds.is_empty();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| `{key}` | {} | {} |", row.value(), row.meaning(of_all));
    }
    text
}

impl Row<'_> {
    fn value(&self) -> String {
        let value = match &self.choices[..] {
            [] => kind_of_value(self.schema),
            choices => quoted(choices.iter().map(|(kind, _)| *kind)),
        };
        // A default that follows from other keys is stated in words.
        let is_in_words = words(&self.schema["description"]).contains("Default ");
        match &self.schema["default"] {
            _ if self.is_required => format!("{value}; required"),
            _ if is_in_words => value,
            Value::Object(_) | Value::Null => value,
            Value::Array(list) if list.is_empty() => value,
            Value::String(text) if text.is_empty() => value,
            default => format!("{value}; default `{default}`"),
        }
    }

    fn meaning(&self, of_all: bool) -> String {
        let kinds = self.kinds.iter().map(|kind| format!("`{kind}`")).collect::<Vec<_>>();
        let kinds = if of_all { String::new() } else { format!("Of {}. ", kinds.join(", ")) };
        let own = words(&self.schema["description"]);
        let mut choices = self.choices.clone();
        let stated = self.schema["oneOf"].as_array().into_iter().flatten();
        choices
            .extend(stated.filter_map(|one| Some((one["const"].as_str()?, &one["description"]))));
        let choices = choices.iter().map(|(choice, description)| {
            let description = words(description);
            format!("`\"{choice}\"`: {}", description.trim_end_matches('.'))
        });
        let choices = choices.collect::<Vec<_>>().join("; ");
        let space = if own.is_empty() || choices.is_empty() { "" } else { " " };
        format!("{kinds}{own}{space}{choices}")
    }
}

/// A description in one line, as a cell of a table takes it.
fn words(description: &Value) -> String {
    let text = description.as_str().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

fn quoted<'a>(choices: impl Iterator<Item = &'a str>) -> String {
    choices.map(|choice| format!("`\"{choice}\"`")).collect::<Vec<_>>().join(", ")
}

/// The type of a value in words.
fn kind_of_value(schema: &Value) -> String {
    let all = |key: &str| schema[key].as_array().into_iter().flatten();
    let constants = all("oneOf").chain(all("anyOf")).filter_map(|one| one["const"].as_str());
    let words: Vec<&str> = constants.chain(all("enum").filter_map(Value::as_str)).collect();
    if !words.is_empty() {
        return quoted(words.into_iter());
    }
    if schema.get("anyOf").is_some() {
        return all("anyOf").map(kind_of_value).collect::<Vec<_>>().join(" or ");
    }
    match schema["type"].as_str() {
        _ if !schema.is_object() => "value".to_owned(),
        Some("number") => "number".to_owned(),
        Some("integer") => "whole number".to_owned(),
        Some("string") => "text".to_owned(),
        Some("boolean") => "`true`, `false`".to_owned(),
        Some("array") => list(schema),
        _ => "table".to_owned(),
    }
}

fn list(schema: &Value) -> String {
    let entry = kind_of_value(&schema["items"]);
    match schema["minItems"].as_u64() {
        Some(count) if entry.ends_with('s') => format!("{count} rows of {entry}"),
        Some(count) => format!("{count} {entry}s"),
        None if entry.starts_with('`') => format!("list of {entry}"),
        None if entry.ends_with('s') => format!("rows of {}", entry.trim_start_matches("list of ")),
        None => format!("list of {entry}s"),
    }
}

/// Rewrites the pages where `BATWING_BLESS` is set.
#[test]
fn key_tables_of_the_reference_are_fresh() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/reference");
    let files = InputFile::value_variants().iter().map(|file| {
        let name = file.to_possible_value().expect("a name");
        (format!("{}-file.md", name.get_name()), file.schema())
    });
    let case = ("grating-case.md".to_owned(), of_file::<CaseKeys>("Case"));
    let results = serde_json::json!({"properties": {
        "results": of_file::<ResultsFile>("Results"),
        "package": of_file::<PackageFile>("Package"),
        "zones": of_file::<ZonesFile>("Zones"),
    }});
    let results = ("results-schema.md".to_owned(), results);
    for (page, schema) in files.chain([case, results]) {
        let path = folder.join(&page);
        let text = std::fs::read_to_string(&path).expect("a page");
        let fresh = fill(&text, &schema).expect("tables");
        if std::env::var_os("BATWING_BLESS").is_some() {
            std::fs::write(&path, fresh).expect("written");
        } else {
            assert!(text == fresh, "{page}: stale tables: test once with BATWING_BLESS=1");
        }
    }
}

#[test]
fn a_table_of_kinds_says_which_kind_takes_a_key() {
    let schema = serde_json::json!({"properties": {"solids": {"items": {"oneOf": [
        {"description": "A ball.", "required": ["kind", "radius"],
            "properties": {"kind": {"const": "ball"}, "radius": {"type": "number"}}},
        {"description": "A slab.", "required": ["kind"],
            "properties": {"kind": {"const": "slab"}, "flat": {"type": "boolean", "default": true}}},
    ]}}}});
    let page = "Before\n<!-- keys: solids -->stale<!-- end -->\nafter";
    let expected = "Before\n<!-- keys: solids -->\n\n| key | value | meaning |\n|---|---|---|\n\
        | `kind` | `\"ball\"`, `\"slab\"`; required | `\"ball\"`: A ball; `\"slab\"`: A slab |\n\
        | `radius` | number; required | Of `ball`.  |\n\
        | `flat` | `true`, `false`; default `true` | Of `slab`.  |\n\n<!-- end -->\nafter";
    assert_eq!(fill(page, &schema).expect("filled"), expected);
    assert!(fill("<!-- keys: none --><!-- end -->", &schema).is_err());
}
