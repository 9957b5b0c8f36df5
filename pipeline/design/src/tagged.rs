// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables that are of one of several kinds, each with keys of its own.
//!
//! serde finds out the kind of a table through a buffer that forgets where keys stand. Therefore
//! the parsed text is rearranged before serde reads it:
//!
//! ```toml
//! { kind = "sphere", name = "ball", radius_mm = 1.0 }
//! { "(shared)" = { name = "ball" }, "(kind)" = { sphere = { radius_mm = 1.0 } } }
//! ```
//!
//! The second form is a struct of a struct and an enum, and all positions stay as they are.

use std::borrow::Cow;
use std::ops::Range;

use runtime::field_names::names;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::DeserializeOwned;
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

/// Key under which the shared keys of a table go.
const SHARED: &str = "(shared)";
/// Key under which its kind goes, with the keys of that kind.
const KIND: &str = "(kind)";

/// True for steps of a path that are inserted here.
pub(super) fn is_inserted(step: &str) -> bool {
    step == SHARED || step == KIND
}

/// A table of one of several kinds: the keys that all kinds share, and those of its kind.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Tagged<S, K> {
    /// Keys of every kind.
    #[serde(rename = "(shared)")]
    pub shared: S,
    /// The kind with its own keys.
    #[serde(rename = "(kind)")]
    pub kind: K,
}

impl<S, K: Kinds> Tagged<S, K> {
    /// The name of the kind, as the design file has it.
    pub fn kind_name(&self) -> String {
        let kinds = serde_json::to_value(&self.kind).unwrap_or_default();
        kinds.as_object().and_then(|kinds| kinds.keys().next().cloned()).unwrap_or_default()
    }
}

/// Tells the kind of a table by the keys that it has.
type Untagged = fn(&dyn Fn(&str) -> bool) -> Option<&'static str>;

/// Kinds of a table, one variant each, which holds a struct of the keys.
pub trait Kinds: DeserializeOwned + Serialize {
    /// The key that names the kind.
    const TAG: &'static str;

    /// The kind of a table without that key.
    fn untagged(_keys: &dyn Fn(&str) -> bool) -> Option<&'static str> {
        None
    }
}

/// As written: keys of both kinds side by side; those that are left out stay so.
impl<S: Serialize, K: Kinds> Serialize for Tagged<S, K> {
    fn serialize<Z: Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        let object = |value: Result<Value, serde_json::Error>| match value {
            Ok(Value::Object(object)) => Ok(object),
            Ok(other) => Err(serde::ser::Error::custom(format!("expected a table, got {other}"))),
            Err(error) => Err(serde::ser::Error::custom(error)),
        };
        let mut all = object(serde_json::to_value(&self.shared))?;
        for (kind, keys) in object(serde_json::to_value(&self.kind))? {
            all.insert(K::TAG.to_owned(), kind.into());
            all.extend(object(Ok(keys))?);
        }
        all.retain(|_, value| !value.is_null());
        all.serialize(serializer)
    }
}

/// Complaint about a part of the text: its place, and the message with the dotted key, entries of
/// lists from 1.
pub(super) type Complaint = (Range<usize>, String);

/// Tables that are of one of several kinds.
pub struct TaggedTable {
    path: &'static [&'static str],
    tag: &'static str,
    shared: &'static [&'static str],
    kinds: &'static [&'static str],
    untagged: Untagged,
}

impl TaggedTable {
    /// Those at `path`, or in the list there.
    pub(super) fn new<S: DeserializeOwned, K: Kinds>(path: &'static [&'static str]) -> Self {
        Self { path, tag: K::TAG, shared: names::<S>(), kinds: names::<K>(), untagged: K::untagged }
    }

    /// Rearranges all of them in a file.
    pub(super) fn rearrange(&self, file: &mut DeTable<'_>) -> Result<(), Complaint> {
        self.descend(self.path, file, "")
    }

    fn descend(
        &self,
        path: &[&str],
        table: &mut DeTable<'_>,
        above: &str,
    ) -> Result<(), Complaint> {
        let [step, rest @ ..] = path else {
            return Ok(());
        };
        let Some(value) = table.get_mut(*step) else {
            return Ok(());
        };
        let key = [above, step].concat();
        let each = |value: &mut Spanned<DeValue<'_>>, key: &str| {
            let span = value.span();
            match value.get_mut() {
                DeValue::Table(table) if rest.is_empty() => self.split(table, span, key),
                DeValue::Table(table) => self.descend(rest, table, &format!("{key}.")),
                // Of a value that is no table serde says so.
                _ => Ok(()),
            }
        };
        if let DeValue::Array(list) = value.get_mut() {
            let mut numbered = list.iter_mut().zip(1..);
            return numbered
                .try_for_each(|(entry, number)| each(entry, &format!("{key}[{number}]")));
        }
        each(value, &key)
    }

    fn split(
        &self,
        table: &mut DeTable<'_>,
        span: Range<usize>,
        key: &str,
    ) -> Result<(), Complaint> {
        let wrong = |span: Range<usize>, got: &str| {
            let kinds = self.kinds.join(", ");
            (span, format!("{key}.{}: expected one of {kinds}, got {got}", self.tag))
        };
        let all = std::mem::take(table);
        let untagged = (self.untagged)(&|name| all.contains_key(name));
        let (mut kind, mut shared, mut own) = (None, DeTable::new(), DeTable::new());
        for (name, value) in all {
            if name.get_ref() == self.tag {
                kind = Some(value);
            } else if self.shared.contains(&name.get_ref().as_ref()) {
                shared.insert(name, value);
            } else {
                own.insert(name, value);
            }
        }
        let kind = match (kind, untagged) {
            (Some(kind), _) => match kind.get_ref() {
                DeValue::String(name) if self.kinds.contains(&name.as_ref()) => {
                    Spanned::new(kind.span(), name.clone())
                }
                DeValue::String(name) => return Err(wrong(kind.span(), &format!("{name:?}"))),
                other => return Err(wrong(kind.span(), other.type_str())),
            },
            (None, Some(name)) => Spanned::new(span.clone(), DeString::Borrowed(name)),
            (None, None) => return Err(wrong(span, "none")),
        };
        let inner = |table| Spanned::new(span.clone(), DeValue::Table(table));
        let name = |name| Spanned::new(span.clone(), DeString::Borrowed(name));
        let of_kind = DeTable::from_iter([(kind, inner(own))]);
        table.insert(name(SHARED), inner(shared));
        table.insert(name(KIND), inner(of_kind));
        Ok(())
    }
}

/// Keys of all kinds beside those of each, with the key that names the kind.
impl<S: JsonSchema, K: JsonSchema + Kinds> JsonSchema for Tagged<S, K> {
    fn schema_name() -> Cow<'static, str> {
        format!("{} of {}", K::schema_name(), S::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let shared = S::json_schema(generator).to_value();
        let kinds = K::json_schema(generator).to_value();
        let of_kind = |kind: &Value| one_kind::<K>(kind, &shared);
        let kinds: Vec<Value> = kinds["oneOf"]
            .as_array()
            .map_or_else(Vec::new, |all| all.iter().filter_map(of_kind).collect());
        json_schema!({"oneOf": kinds})
    }
}

/// The table of one kind, from `{"kind": {keys}}` as serde writes an enum.
fn one_kind<K: Kinds>(kind: &Value, shared: &Value) -> Option<Value> {
    let (name, own) = kind["properties"].as_object()?.iter().next()?;
    let properties = |of: &Value| of["properties"].as_object().cloned().unwrap_or_default();
    let required = |of: &Value| of["required"].as_array().cloned().unwrap_or_default();
    let mut keys: Map<String, Value> = properties(shared);
    let own_keys = properties(own);
    let told_by_keys = K::untagged(&|key| own_keys.contains_key(key)) == Some(name.as_str());
    keys.extend(own_keys);
    if !K::TAG.is_empty() {
        keys.insert(K::TAG.to_owned(), json!({"const": name}));
    }
    let mut needed = [required(shared), required(own)].concat();
    if !told_by_keys {
        needed.insert(0, K::TAG.into());
    }
    Some(json!({
        "title": name,
        "description": kind["description"],
        "type": "object",
        "properties": keys,
        "required": needed,
        "additionalProperties": false,
    }))
}
