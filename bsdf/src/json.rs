// SPDX-License-Identifier: MIT OR Apache-2.0
//! JSON without duplicate keys, and without numbers that overflow what is made of them.
//!
//! RFC 8259 leaves the meaning of duplicate keys open, and most readers silently take the last.
//! These functions refuse such a text with the path of the key.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

/// Largest number that is read, in size: squares and sums of such are numbers, too.
const LARGEST: f64 = 1e100;

/// The value of `text`.
///
/// # Errors
/// Text that is not JSON, a number above 1e100, or an object with a duplicate key; the last two are
/// errors in [data](serde_json::error::Category::Data).
pub fn parse(text: &[u8]) -> Result<Value, serde_json::Error> {
    let mut deserializer = serde_json::Deserializer::from_slice(text);
    let path = String::new();
    let value = Unique { path }.deserialize(&mut deserializer)?;
    deserializer.end()?;
    Ok(value)
}

/// The object of a deserializer, for a part of a larger text; `name` begins the path in messages.
///
/// # Errors
/// Another value, or an object with a duplicate key.
pub fn object<'de, D: Deserializer<'de>>(
    deserializer: D,
    name: &str,
) -> Result<Map<String, Value>, D::Error> {
    let path = name.to_owned();
    match (Unique { path }).deserialize(deserializer)? {
        Value::Object(object) => Ok(object),
        other => Err(D::Error::custom(format!("{name}: expected an object, got {other}"))),
    }
}

/// Reads one value; `path` leads to it, empty for the whole text.
struct Unique {
    path: String,
}

impl Unique {
    fn key(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }
}

impl<'de> DeserializeSeed<'de> for Unique {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Unique {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        if value.abs() > LARGEST {
            let path = if self.path.is_empty() { "the value" } else { &self.path };
            return Err(E::custom(format!(
                "{path}: expected a number of at most {LARGEST:e}, got {value:e}"
            )));
        }
        Ok(value.into())
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_string<E>(self, value: String) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Value, A::Error> {
        let mut values = Vec::new();
        let item = |i: usize| Self { path: format!("{}[{}]", self.path, i + 1) };
        while let Some(value) = list.next_element_seed(item(values.len()))? {
            values.push(value);
        }
        Ok(values.into())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Value, A::Error> {
        let mut values = Map::new();
        while let Some(key) = object.next_key::<String>()? {
            let path = self.key(&key);
            if values.contains_key(&key) {
                let message = format!("{path}: expected this key once, got it twice");
                return Err(A::Error::custom(message));
            }
            values.insert(key, object.next_value_seed(Self { path })?);
        }
        Ok(values.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_without_doubles_reads_as_usual() {
        let refusal = parse(br#"{"a": [1, 1e308]}"#).unwrap_err().to_string();
        assert!(
            refusal.starts_with("a[2]: expected a number of at most 1e100, got 1e308"),
            "{refusal}"
        );
        for text in [
            r#"{"a": {"b": 1, "c": [1, -2, 2.5e-3, true, null, "x\n"]}, "b": {"b": {}}, "": 18446744073709551615}"#,
            "[]",
            "0.1",
            "\"text\"",
        ] {
            let plain: Value = serde_json::from_str(text).unwrap();
            assert_eq!(parse(text.as_bytes()).unwrap(), plain, "{text}");
        }
    }

    #[test]
    fn a_double_is_refused_with_its_path() {
        for (text, path) in [
            (r#"{"a": 1, "b": 2, "a": 1}"#, "a: "),
            (r#"{"a": {"b": 2, "b": 3}}"#, "a.b: "),
            (r#"{"a": [0, {"b": [], "c": 1, "b": []}]}"#, "a[2].b: "),
            (r#"[{"x": 1, "\u0078": 2}]"#, "[1].x: "),
        ] {
            let error = parse(text.as_bytes()).unwrap_err();
            assert!(error.is_data(), "{text}");
            let expected = format!("{path}expected this key once, got it twice at line 1");
            assert!(error.to_string().starts_with(&expected), "{error}");
        }
    }

    #[test]
    fn what_is_no_json_stays_none() {
        for text in ["", "{\"a\": NaN}", "{} {}", "{\"a\": 1e999}", "{\"a\" 1}"] {
            let error = parse(text.as_bytes()).unwrap_err();
            assert!(!error.is_data(), "{text}: {error}");
        }
    }
}
