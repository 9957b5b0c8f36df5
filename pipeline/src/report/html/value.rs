// SPDX-License-Identifier: MIT OR Apache-2.0
//! JSON with the way that led to it, so that every complaint names file and key.

use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value};

/// A value within a JSON file.
#[derive(Clone, Debug)]
pub struct At<'a> {
    file: &'a Path,
    key: String,
    value: &'a Value,
}

/// A value and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// Standard error, not negative.
    pub standard_error: f64,
}

/// What a value is, for messages; long ones are cut.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(map) => format!("an object of {} keys", map.len()),
        other => other.to_string().chars().take(60).collect(),
    }
}

impl<'a> At<'a> {
    /// The whole of `file`.
    pub fn top(file: &'a Path, value: &'a Value) -> Self {
        Self {
            file,
            key: String::new(),
            value,
        }
    }

    /// The value itself.
    pub fn value(&self) -> &'a Value {
        self.value
    }

    /// File and key, as messages begin.
    pub fn place(&self) -> String {
        match self.key.as_str() {
            "" => format!("`{}`", self.file.display()),
            key => format!("`{}`: {key}", self.file.display()),
        }
    }

    fn expected<T>(&self, what: &str) -> Result<T> {
        bail!(
            "{}: expected {what}, got {}",
            self.place(),
            shown(self.value)
        )
    }

    fn below(&self, name: &str, value: &'a Value) -> Self {
        let key = match self.key.as_str() {
            "" => name.to_owned(),
            key => format!("{key}.{name}"),
        };
        Self {
            file: self.file,
            key,
            value,
        }
    }

    /// The entry `name`, if there is one.
    pub fn find(&self, name: &str) -> Option<Self> {
        self.value.get(name).map(|value| self.below(name, value))
    }

    /// The entry `name`.
    ///
    /// # Errors
    /// If there is none.
    pub fn get(&self, name: &str) -> Result<Self> {
        self.find(name).with_context(|| {
            format!(
                "{}: expected a value, got none",
                self.below(name, self.value).place()
            )
        })
    }

    /// The entries of an object.
    ///
    /// # Errors
    /// If it is none.
    pub fn entries(&self) -> Result<Vec<(&'a str, Self)>> {
        let Some(map) = self.value.as_object() else {
            return self.expected("an object");
        };
        Ok(map
            .iter()
            .map(|(k, v)| (k.as_str(), self.below(k, v)))
            .collect())
    }

    /// The object itself.
    ///
    /// # Errors
    /// If it is none.
    pub fn object(&self) -> Result<&'a Map<String, Value>> {
        match self.value {
            Value::Object(map) => Ok(map),
            _ => self.expected("an object"),
        }
    }

    /// The elements of a list, numbered from 0.
    ///
    /// # Errors
    /// If it is none.
    pub fn list(&self) -> Result<Vec<Self>> {
        let Some(list) = self.value.as_array() else {
            return self.expected("a list");
        };
        Ok(list
            .iter()
            .enumerate()
            .map(|(i, value)| Self {
                file: self.file,
                key: format!("{}[{i}]", self.key),
                value,
            })
            .collect())
    }

    /// A number.
    ///
    /// # Errors
    /// If it is none, or not finite.
    pub fn number(&self) -> Result<f64> {
        match self.value.as_f64().filter(|x| x.is_finite()) {
            Some(number) => Ok(number),
            None => self.expected("a number"),
        }
    }

    /// A whole number from 0.
    ///
    /// # Errors
    /// If it is none.
    pub fn count(&self) -> Result<u64> {
        match self.value.as_u64() {
            Some(number) => Ok(number),
            None => self.expected("a whole number from 0"),
        }
    }

    /// A text.
    ///
    /// # Errors
    /// If it is none.
    pub fn text(&self) -> Result<&'a str> {
        match self.value {
            Value::String(text) => Ok(text),
            _ => self.expected("a text"),
        }
    }

    /// True or false.
    ///
    /// # Errors
    /// If it is neither.
    pub fn flag(&self) -> Result<bool> {
        match self.value {
            Value::Bool(flag) => Ok(*flag),
            _ => self.expected("true or false"),
        }
    }

    /// Whether it looks like an estimate: an object with `value` and `standard_error`.
    pub fn is_estimate(&self) -> bool {
        ["value", "standard_error"]
            .iter()
            .all(|key| self.value.get(key).is_some())
    }

    /// Value and standard error.
    ///
    /// # Errors
    /// If one is missing, no number, or the error is negative.
    pub fn estimate(&self) -> Result<Estimate> {
        let (value, error) = (self.get("value")?.number()?, self.get("standard_error")?);
        let standard_error = error.number()?;
        if standard_error < 0.0 {
            return error.expected("a number of at least 0");
        }
        Ok(Estimate {
            value,
            standard_error,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn complaints_name_file_key_expected_and_got() {
        let json = json!({"designs": {"D1": {"tables": [{"ring": "five"}], "uniformity": {"value": 1, "standard_error": -1}}}});
        let top = At::top(Path::new("r/results.json"), &json);
        let design = top.get("designs").unwrap().get("D1").unwrap();
        let ring = &design.get("tables").unwrap().list().unwrap()[0];
        let message = |error: anyhow::Error| format!("{error:#}");
        assert_eq!(
            message(ring.get("ring").unwrap().count().unwrap_err()),
            "`r/results.json`: designs.D1.tables[0].ring: expected a whole number from 0, got \"five\""
        );
        assert_eq!(
            message(top.get("seed").unwrap_err()),
            "`r/results.json`: seed: expected a value, got none"
        );
        assert_eq!(
            message(design.get("uniformity").unwrap().estimate().unwrap_err()),
            "`r/results.json`: designs.D1.uniformity.standard_error: expected a number of at least 0, got -1"
        );
        assert!(
            message(design.text().unwrap_err())
                .ends_with("expected a text, got an object of 2 keys")
        );
    }
}
