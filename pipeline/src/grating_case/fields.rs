// SPDX-License-Identifier: MIT OR Apache-2.0
//! A JSON object whose values are asked for by key, kind and range; refusals name the path.

use std::fmt::Display;

use anyhow::{Error, Result};
use num_complex::Complex64;
use serde_json::{Map, Value};

/// What an index looks like, for messages.
const INDEX: &str = "[n, k] with n >= 0 and k >= 0, not both 0, at most 1e6";
/// Largest part of an index.
const MAX_INDEX: f64 = 1e6;

/// An object and the path that leads to it.
pub(super) struct Fields<'a> {
    path: String,
    map: &'a Map<String, Value>,
}

/// The message that everything here is refused with.
pub(super) fn wrong(key: impl Display, expected: impl Display, got: impl Display) -> Error {
    anyhow::anyhow!("{key}: expected {expected}, got {got}")
}

impl<'a> Fields<'a> {
    /// `value` as an object; `path` leads to it, empty for the file itself.
    pub(super) fn of(path: impl Into<String>, value: &'a Value) -> Result<Self> {
        let path = path.into();
        match value {
            Value::Object(map) => Ok(Self { path, map }),
            _ if path.is_empty() => Err(wrong("the file", "a JSON object", shown(value))),
            _ => Err(wrong(path, "a JSON object", shown(value))),
        }
    }

    /// The whole path of one of the keys.
    pub(super) fn path(&self, key: &str) -> String {
        if self.path.is_empty() { key.into() } else { format!("{}.{key}", self.path) }
    }

    /// The refusal of a key's value.
    pub(super) fn refuse(&self, key: &str, expected: impl Display) -> Error {
        let got = self.map.get(key).map_or_else(|| "nothing".into(), shown);
        wrong(self.path(key), expected, got)
    }

    /// Refuses keys that are not in the list.
    pub(super) fn only(&self, keys: &[&str]) -> Result<()> {
        match self.map.keys().find(|k| !keys.contains(&k.as_str())) {
            None => Ok(()),
            Some(unknown) => {
                let expected = format!("one of the keys {}", keys.join(", "));
                Err(wrong(self.path(unknown), expected, "an unknown key"))
            }
        }
    }

    /// In a file whose inputs stand under `inputs`, refuses those that stand beside it and would be
    /// overlooked. (`tolerance` as an object belongs to a reference case's outputs.)
    pub(super) fn refuse_inputs_outside(&self, keys: &[&str]) -> Result<()> {
        let outside = |(key, value): &(&String, &Value)| {
            keys.contains(&key.as_str()) && !(key.as_str() == "tolerance" && value.is_object())
        };
        match self.map.iter().find(outside) {
            None => Ok(()),
            Some((key, _)) => Err(wrong(key, "this key inside inputs", "it beside inputs")),
        }
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.map.contains_key(key)
    }

    pub(super) fn required(&self, key: &str) -> Result<&'a Value> {
        self.map.get(key).ok_or_else(|| self.refuse(key, "a value"))
    }

    pub(super) fn optional_text(&self, key: &str) -> Result<Option<&'a str>> {
        match self.map.get(key) {
            None => Ok(None),
            Some(value) => value.as_str().map(Some).ok_or_else(|| self.refuse(key, "a text")),
        }
    }

    /// `true` or `false`; false unless given.
    pub(super) fn flag(&self, key: &str) -> Result<bool> {
        match self.map.get(key) {
            None => Ok(false),
            Some(value) => value.as_bool().ok_or_else(|| self.refuse(key, "true or false")),
        }
    }

    /// A finite number (JSON has no others).
    pub(super) fn number(&self, key: &str) -> Result<f64> {
        self.required(key)?.as_f64().ok_or_else(|| self.refuse(key, "a number"))
    }

    /// A number above 0, with room for its ratios to others.
    pub(super) fn length(&self, key: &str) -> Result<f64> {
        let value = self.required(key)?.as_f64();
        let length = match value {
            Some(x) if x > 0.0 => "a length from 1e-100 to 1e100",
            _ => "a length above 0",
        };
        let value = value.filter(|x| (1e-100..=1e100).contains(x));
        value.ok_or_else(|| self.refuse(key, length))
    }

    /// A number from 0.
    pub(super) fn thickness(&self, key: &str) -> Result<f64> {
        let value = self.required(key)?.as_f64().filter(|&x| x >= 0.0);
        value.ok_or_else(|| self.refuse(key, "a length from 0"))
    }

    /// A refractive index `[n, k]`.
    pub(super) fn index(&self, key: &str) -> Result<Complex64> {
        let index = pair(self.required(key)?);
        let range = 0.0..=MAX_INDEX;
        let passive =
            index.filter(|[n, k]| range.contains(n) && range.contains(k) && (*n > 0.0 || *k > 0.0));
        // Adding zero makes -0 a 0, on which branches of square roots hang.
        let index = passive.map(|[n, k]| Complex64::new(n + 0.0, k + 0.0));
        index.ok_or_else(|| self.refuse(key, INDEX))
    }

    pub(super) fn object(&self, key: &str) -> Result<Fields<'a>> {
        Fields::of(self.path(key), self.required(key)?)
    }

    /// A list of objects.
    pub(super) fn list(&self, key: &str) -> Result<Vec<Fields<'a>>> {
        let list = self.required(key)?.as_array().ok_or_else(|| self.refuse(key, "a list"))?;
        let path = |i| format!("{}[{i}]", self.path(key));
        list.iter().enumerate().map(|(i, value)| Fields::of(path(i), value)).collect()
    }

    /// A list of pairs of numbers.
    pub(super) fn pairs(&self, key: &str) -> Result<Vec<[f64; 2]>> {
        let list = self.required(key)?.as_array().ok_or_else(|| self.refuse(key, "a list"))?;
        let number = |(i, value)| {
            let path = || format!("{}[{i}]", self.path(key));
            pair(value).ok_or_else(|| wrong(path(), "a point [x, z]", shown(value)))
        };
        list.iter().enumerate().map(number).collect()
    }
}

fn pair(value: &Value) -> Option<[f64; 2]> {
    let [a, b] = value.as_array()?.as_slice() else {
        return None;
    };
    Some([a.as_f64()?, b.as_f64()?])
}

/// A value as text, long ones cut.
fn shown(value: &Value) -> String {
    const LONGEST: usize = 60;
    let text = value.to_string();
    match text.char_indices().nth(LONGEST) {
        None => text,
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}
