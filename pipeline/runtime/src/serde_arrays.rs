// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lists of so many numbers, no more and no fewer: serde's arrays let readers pass over what is too
//! much.

use std::borrow::Cow;
use std::fmt::{Debug, Formatter};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};

/// A list of `N` numbers.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct List<T, const N: usize>(pub [T; N]);

impl<T: Debug, const N: usize> Debug for List<T, N> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl<const N: usize> Default for List<f64, N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for List<T, N> {
    fn deserialize<D: Deserializer<'de>>(reader: D) -> Result<Self, D::Error> {
        let list = Vec::deserialize(reader)?;
        let got = list.len();
        let list = list.try_into();
        let expected = format!("a list of {N} numbers");
        list.map(Self).map_err(|_| D::Error::invalid_length(got, &expected.as_str()))
    }
}

impl<T: Serialize, const N: usize> Serialize for List<T, N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.as_slice().serialize(serializer)
    }
}

impl<T: JsonSchema, const N: usize> JsonSchema for List<T, N> {
    fn schema_name() -> Cow<'static, str> {
        format!("{N} numbers").into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let items = T::json_schema(generator);
        json_schema!({"type": "array", "items": items, "minItems": N, "maxItems": N})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Deserialize)]
    struct Lists {
        one: List<f64, 2>,
        maybe: Option<List<usize, 3>>,
        #[serde(default)]
        many: Vec<List<f64, 2>>,
    }

    #[test]
    fn lists_have_their_length() {
        let read = |text: &str| toml::from_str::<Lists>(text).map_err(|e| e.message().to_owned());
        let plain = read("one = [1, 2]").expect("two numbers");
        assert_eq!((plain.one, plain.maybe), (List([1.0, 2.0]), None));
        let full = "one = [1, 2]\nmaybe = [1, 2, 3]\nmany = [[1, 2]]";
        assert_eq!(read(full).map(|l| l.many.len()), Ok(1));
        for (text, got, expected) in [
            ("one = [1, 2, 3]", 3, 2),
            ("one = [1]", 1, 2),
            ("one = [1, 2]\nmaybe = [1, 2, 3, 4]", 4, 3),
            ("one = [1, 2]\nmany = [[1, 2], [1, 2, 3]]", 3, 2),
        ] {
            let expected = format!("invalid length {got}, expected a list of {expected} numbers");
            assert_eq!(read(text), Err(expected), "{text}");
        }
    }
}
