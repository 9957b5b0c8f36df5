// SPDX-License-Identifier: MIT OR Apache-2.0
//! JSON Schemas of the files that users write, by which editors complete and check them.
//!
//! They follow from the types that read these files: keys, kinds, words and what each means. Ranges
//! and what depends on several keys are checked by `batwing check` alone.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value;

use super::dotted_keys::bracketed;
use super::schema;

/// Keys with values of any kind, as the schema of [`super::dotted_keys::Settings`].
pub type AnyValues = BTreeMap<String, Value>;

/// The schema of the file that `T` reads, JSON Schema 2020-12.
pub fn of_file<T: JsonSchema>(name: &str) -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<T>().to_value();
    schema["title"] = format!("{name} file of batwing").into();
    without_null(&mut schema);
    schema
}

/// The schema of the design file.
pub fn of_designs() -> Value {
    of_file::<schema::Design>("Design")
}

/// Takes out `null`, which TOML has not: a key without a value is left out.
fn without_null(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            map.retain(|key, value| key != "default" || !value.is_null());
            if let Some(Value::Array(types)) = map.get_mut("type") {
                types.retain(|name| name != "null");
                if let [one] = &types[..] {
                    let one = one.clone();
                    map.insert("type".to_owned(), one);
                }
            }
            if let Some(Value::Array(any)) = map.get_mut("anyOf") {
                any.retain(|of| of["type"] != "null");
                if let [Value::Object(one)] = &mut any[..] {
                    let one = std::mem::take(one);
                    map.remove("anyOf");
                    // What the key means goes before what its table is.
                    for (key, value) in one {
                        map.entry(key).or_insert(value);
                    }
                }
            }
            map.values_mut().for_each(without_null);
        }
        Value::Array(list) => list.iter_mut().for_each(without_null),
        _ => {}
    }
}

/// Numbers that a key takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberKind {
    /// Any number.
    Real,
    /// Whole numbers alone.
    Whole,
}

/// The numbers that the key at the dotted `path` takes; `None` where it takes none.
pub fn number_kind(path: &str) -> Option<NumberKind> {
    let schemas = schemas_at(path);
    let takes = |name: &str| schemas.iter().any(|schema| schema["type"] == name);
    let whole = takes("integer").then_some(NumberKind::Whole);
    if takes("number") { Some(NumberKind::Real) } else { whole }
}

/// Lengths of the lists of so many numbers that the key at the dotted `path` takes.
pub(crate) fn list_lengths(path: &str) -> Vec<usize> {
    let schemas = schemas_at(path);
    let lists = schemas.into_iter().filter(|schema| is_number(&schema["items"]));
    let lengths: BTreeSet<_> = lists.filter_map(|list| list["minItems"].as_u64()).collect();
    lengths.into_iter().map(|length| length as usize).collect()
}

fn is_number(schema: &Value) -> bool {
    schema["type"] == "number" || schema["type"] == "integer"
}

/// Lets texts stand where numbers do, or lists of so many numbers: formulas of a design.
pub fn allow_formulas(schema: &mut Value) {
    let is_list = schema.get("minItems").is_some() && is_number(&schema["items"]);
    if is_number(schema) || is_list {
        schema["type"] = serde_json::json!([schema["type"], "string"]);
    }
    match schema {
        Value::Object(map) => map.values_mut().for_each(allow_formulas),
        Value::Array(list) => list.iter_mut().for_each(allow_formulas),
        _ => {}
    }
}

/// Schemas of the value at the dotted `path`, of all kinds of tables.
fn schemas_at(path: &str) -> Vec<&'static Value> {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    let mut schemas = Vec::new();
    let path = bracketed(path).replace('[', ".[");
    let parts: Vec<&str> = path.split('.').collect();
    collect_schemas(SCHEMA.get_or_init(of_designs), &parts, &mut schemas);
    schemas
}

fn collect_schemas<'a>(schema: &'a Value, parts: &[&str], schemas: &mut Vec<&'a Value>) {
    for key in ["anyOf", "oneOf", "allOf"] {
        let kinds = schema[key].as_array().into_iter().flatten();
        kinds.for_each(|kind| collect_schemas(kind, parts, schemas));
    }
    let Some((part, rest)) = parts.split_first() else {
        schemas.push(schema);
        return;
    };
    for below in [schema["properties"].get(part), schema.get("items")].into_iter().flatten() {
        collect_schemas(below, rest, schemas);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_take_real_or_whole_numbers() {
        let (real, whole) = (Some(NumberKind::Real), Some(NumberKind::Whole));
        for (path, kind) in [
            ("array.pitch_mm", real),
            ("array.columns", whole),
            ("led.size_mm.0", real),
            ("solids[2].position_mm[3]", real),
            ("led.offsets_mm.3.1", real),
            ("elements.shapes.0.apex_angle_deg", real),
            ("dome.meridian_mm.2.1", real),
            ("dome.sphere_radius_mm", real),
            ("trace.paths", whole),
            ("receivers.0.phi_bin_deg", real),
            ("led.reflection", None),
            ("led.colour", None),
            ("led", None),
        ] {
            assert_eq!(number_kind(path), kind, "{path}");
        }
    }

    fn at<'a>(schema: &'a Value, pointer: &str) -> &'a Value {
        schema.pointer(pointer).unwrap_or_else(|| panic!("no {pointer}"))
    }

    #[test]
    fn keys_kinds_and_words_are_those_that_designs_take() {
        let schema = of_designs();
        assert_eq!(at(&schema, "/additionalProperties"), false);
        let led = at(&schema, "/properties/led/oneOf").as_array().expect("kinds");
        let specular =
            led.iter().find(|kind| kind["properties"]["reflection"]["const"] == "specular");
        let specular = specular.expect("a specular box");
        let needed = specular["required"].as_array().expect("keys");
        assert!(
            ["reflection", "size_mm", "reflectance"]
                .iter()
                .all(|key| needed.contains(&(*key).into()))
        );
        assert!(!needed.contains(&"power_lm".into()));
        let size = &specular["properties"]["size_mm"];
        assert_eq!((&size["minItems"], &size["maxItems"]), (&2.into(), &2.into()));
        let average = at(&schema, "/properties/receiver/properties/average").to_string();
        assert!(average.contains("symmetries") && average.contains("none"), "{average}");
        let text = schema.to_string();
        assert!(!text.contains("\"null\"") && !text.contains("(shared)"), "{text}");
    }

    #[test]
    fn a_table_that_its_keys_tell_needs_no_kind() {
        let schema = of_designs();
        let surfaces = at(&schema, "/properties/solids/items/oneOf/0/properties/surface/oneOf");
        let kinds = surfaces.as_array().expect("kinds").iter();
        let untold: Vec<&Value> = kinds
            .filter(|kind| !kind["required"].as_array().is_some_and(|k| k.contains(&"kind".into())))
            .map(|kind| &kind["properties"]["kind"]["const"])
            .collect();
        assert_eq!(untold, ["file"]);
    }
}
