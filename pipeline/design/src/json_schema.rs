// SPDX-License-Identifier: MIT OR Apache-2.0
//! JSON Schema of the design file, by which editors complete and check it.
//!
//! It follows from the types of [`super::schema`]: keys, kinds, words and what each means. Ranges
//! and what depends on several keys are checked by `batwing check` alone.

use schemars::generate::SchemaSettings;
use serde_json::Value;

use super::schema;

/// The schema, JSON Schema 2020-12.
pub fn of_designs() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<schema::Design>().to_value();
    schema["title"] = "Design file of batwing".into();
    without_null(&mut schema);
    schema
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

#[cfg(test)]
mod tests {
    use super::*;

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
