// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whole numbers as people write them: `2000000`, `2_000_000` or `2e6`.

use std::fmt::Formatter;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};

/// Largest power of two below which every whole number is a float.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// A whole number from 0.
struct Whole<T>(T);

struct WholeVisitor<T>(PhantomData<T>);

impl<T: TryFrom<u64>> Visitor<'_> for WholeVisitor<T> {
    type Value = Whole<T>;

    fn expecting(&self, text: &mut Formatter) -> std::fmt::Result {
        text.write_str("a whole number from 0")
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        let wrong = || E::invalid_value(Unexpected::Signed(value), &self);
        let whole = u64::try_from(value).ok().and_then(|whole| T::try_from(whole).ok());
        whole.map(Whole).ok_or_else(wrong)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        if (0.0..EXACT).contains(&value) && value.fract() == 0.0 {
            return self.visit_i64(value as i64);
        }
        Err(E::invalid_value(Unexpected::Float(value), &self))
    }
}

impl<'de, T: TryFrom<u64>> Deserialize<'de> for Whole<T> {
    fn deserialize<D: Deserializer<'de>>(reader: D) -> Result<Self, D::Error> {
        reader.deserialize_any(WholeVisitor(PhantomData))
    }
}

/// Reads a whole number.
pub fn one<'de, T: TryFrom<u64>, D: Deserializer<'de>>(reader: D) -> Result<T, D::Error> {
    Whole::deserialize(reader).map(|Whole(value)| value)
}

/// Reads a whole number that may be left out.
pub fn maybe<'de, T: TryFrom<u64>, D: Deserializer<'de>>(reader: D) -> Result<Option<T>, D::Error> {
    one(reader).map(Some)
}

/// Reads a list of whole numbers.
pub fn list<'de, T: TryFrom<u64>, D: Deserializer<'de>>(reader: D) -> Result<Vec<T>, D::Error> {
    let all: Vec<Whole<T>> = Vec::deserialize(reader)?;
    Ok(all.into_iter().map(|Whole(value)| value).collect())
}

#[cfg(test)]
mod tests {
    #[derive(Debug, PartialEq, serde::Deserialize)]
    struct Keys {
        #[serde(default, deserialize_with = "super::maybe")]
        paths: Option<u64>,
        #[serde(default, deserialize_with = "super::list")]
        runs: Vec<usize>,
    }

    #[test]
    fn powers_of_ten_are_whole_numbers() {
        let read = |text: &str| toml::from_str::<Keys>(text).map_err(|e| e.message().to_owned());
        let keys = |paths, runs: &[usize]| Ok(Keys { paths, runs: runs.to_vec() });
        assert_eq!(read(""), keys(None, &[]));
        assert_eq!(read("paths = 2e6\nruns = [1, 2.5e1]"), keys(Some(2_000_000), &[1, 25]));
        for wrong in ["1.5", "-1", "-1e3", "1e300", "nan", "\"a\"", "true"] {
            let said = read(&format!("paths = {wrong}")).expect_err(wrong);
            assert!(said.contains("expected a whole number from 0"), "{said}");
        }
    }
}
