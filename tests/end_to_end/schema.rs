// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing schema`: every shipped file is one that the schema of its kind admits, and misspelt,
//! missing and ill-typed keys are none.
//!
//! Source: JSON Schema 2020-12, the keywords that the schemas use.

use std::path::Path;

use serde_json::{Value, json};

use batwing_tests::workspace;

use crate::support::binary::json;

/// Kinds of files, each with a key that it alone has.
const KINDS: [(&str, &str); 4] = [
    ("design", "led"),
    ("study", "designs"),
    ("problem", "variables"),
    ("tolerance", "tolerances"),
];

/// Refuses a value that `schema` does not admit, with its path.
fn admit(schema: &Value, value: &Value, at: &str) -> Result<(), String> {
    let list = |key: &str| schema[key].as_array();
    let sure = |holds: bool, what: &str| {
        if holds { Ok(()) } else { Err(format!("{at}: expected {what}, got {value}")) }
    };
    for key in ["oneOf", "anyOf"] {
        let tried = list(key).map(|all| all.iter().map(|one| admit(one, value, at)));
        let mut tried = tried.into_iter().flatten().peekable();
        if let Some(Err(reason)) = tried.peek().cloned() {
            sure(tried.any(|one| one.is_ok()), &format!("another value ({reason})"))?;
        }
    }
    sure(schema.get("const").is_none_or(|one| one == value), "the constant")?;
    sure(list("enum").is_none_or(|all| all.contains(value)), "a listed word")?;
    let is_of_type = |kind: &Value| match kind.as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("boolean") => value.is_boolean(),
        Some("number") => value.is_number(),
        Some("integer") => value.as_f64().is_some_and(|number| number.fract() == 0.0),
        other => other.is_none(),
    };
    let kinds = list("type").map_or(std::slice::from_ref(&schema["type"]), Vec::as_slice);
    sure(kinds.iter().any(is_of_type), &schema["type"].to_string())?;
    for (entry, value) in value.as_array().into_iter().flatten().enumerate() {
        admit(&schema["items"], value, &format!("{at}[{entry}]"))?;
    }
    let Some(table) = value.as_object() else { return Ok(()) };
    for key in list("required").into_iter().flatten().filter_map(Value::as_str) {
        sure(table.contains_key(key), &format!("a key {key}"))?;
    }
    for (key, value) in table {
        let known = schema["properties"].get(key).or(schema.get("additionalProperties"));
        let at = format!("{at}.{key}");
        match known {
            Some(Value::Bool(false)) => return Err(format!("{at}: no such key")),
            Some(known) => admit(known, value, &at)?,
            None => {}
        }
    }
    Ok(())
}

/// The TOML files below `folder`.
fn files(folder: &Path) -> Vec<(String, Value)> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("entry"));
    let below = entries.flat_map(|entry| match entry.path() {
        path if path.is_dir() => files(&path),
        path if path.extension().is_some_and(|ending| ending == "toml") => {
            let text = std::fs::read_to_string(&path).expect("a file");
            let table: toml::Table = toml::from_str(&text).expect("TOML");
            vec![(path.display().to_string(), json!(table))]
        }
        _ => Vec::new(),
    });
    below.collect()
}

#[test]
fn schemas_admit_every_shipped_file_of_their_kind() {
    let shipped = files(&workspace().join("data"));
    assert_eq!(json(workspace(), &["schema"]), json(workspace(), &["schema", "design"]));
    for (kind, key) in KINDS {
        let schema = json(workspace(), &["schema", kind]);
        assert_eq!(schema["$comment"], format!("batwing {}", env!("CARGO_PKG_VERSION")));
        let own: Vec<_> = shipped.iter().filter(|(_, file)| file.get(key).is_some()).collect();
        assert!(own.len() > 1, "{kind}");
        for (name, file) in own {
            assert_eq!(admit(&schema, file, name), Ok(()));
            let altered = |key: &str, value: Option<Value>| {
                let mut file = file.clone();
                let table = file.as_object_mut().expect("a table");
                match value {
                    Some(value) => table.insert(key.to_owned(), value),
                    None => table.remove(key),
                };
                admit(&schema, &file, name).expect_err("not admitted")
            };
            assert!(altered("nmae", Some(json!("x"))).ends_with(".nmae: no such key"));
            assert!(altered(key, None).contains(&format!("expected a key {key}")));
            assert!(altered("name", Some(json!(1))).contains(r#"expected "string", got 1"#));
        }
    }
    let schema = json(workspace(), &["schema"]);
    let backlight =
        design::NEW_BACKLIGHT.replace("[32.0, 24.0]\nheight", "\"4 * array.pitch_mm\"\nheight");
    let backlight = backlight.replace("columns = 4", "columns = \"array.rows + 1\"");
    let backlight: toml::Table =
        backlight.replace("z_mm = 5.0", "z_mm = \"5\"").parse().expect("TOML");
    assert_eq!(admit(&schema, &json!(backlight), "formulas"), Ok(()));
    let others = shipped.iter().filter(|(_, file)| KINDS.iter().all(|of| file.get(of.1).is_none()));
    let others: Vec<_> = others.map(|(name, _)| name).collect();
    assert!(matches!(&others[..], [one] if one.ends_with("published/tables.toml")), "{others:?}");
}
