// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lists of so many numbers, no more and no fewer, for `#[serde(deserialize_with = "...")]`: serde's arrays let readers pass over what is too much.

use serde::de::{Deserialize, Deserializer, Error};

/// A list.
pub fn exact<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    reader: D,
) -> Result<[T; N], D::Error> {
    of_length(Vec::deserialize(reader)?)
}

/// A list that may be left out (with `default`).
pub fn exact_if_any<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    reader: D,
) -> Result<Option<[T; N]>, D::Error> {
    exact(reader).map(Some)
}

/// Any number of lists.
pub fn each_exact<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    reader: D,
) -> Result<Vec<[T; N]>, D::Error> {
    let lists = Vec::<Vec<T>>::deserialize(reader)?;
    lists.into_iter().map(of_length).collect()
}

/// Any number of lists that may be left out (with `default`).
pub fn each_exact_if_any<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    reader: D,
) -> Result<Option<Vec<[T; N]>>, D::Error> {
    each_exact(reader).map(Some)
}

fn of_length<T, E: Error, const N: usize>(list: Vec<T>) -> Result<[T; N], E> {
    let got = list.len();
    let expected = format!("a list of {N} numbers");
    list.try_into()
        .map_err(|_| E::invalid_length(got, &expected.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Deserialize)]
    struct Lists {
        #[serde(deserialize_with = "exact")]
        one: [f64; 2],
        #[serde(default, deserialize_with = "exact_if_any")]
        maybe: Option<[usize; 3]>,
        #[serde(default, deserialize_with = "each_exact")]
        many: Vec<[f64; 2]>,
        #[serde(default, deserialize_with = "each_exact_if_any")]
        any: Option<Vec<[f64; 2]>>,
    }

    #[test]
    fn lists_have_their_length() {
        let read = |text: &str| toml::from_str::<Lists>(text).map_err(|e| e.message().to_owned());
        let plain = read("one = [1, 2]").expect("two numbers");
        assert_eq!(
            (plain.one, plain.maybe, plain.any),
            ([1.0, 2.0], None, None)
        );
        let full = "one = [1, 2]\nmaybe = [1, 2, 3]\nmany = [[1, 2]]\nany = [[1, 2], [3, 4]]";
        assert_eq!(read(full).map(|l| l.many.len()), Ok(1));
        for (text, got, expected) in [
            ("one = [1, 2, 3]", 3, 2),
            ("one = [1]", 1, 2),
            ("one = [1, 2]\nmaybe = [1, 2, 3, 4]", 4, 3),
            ("one = [1, 2]\nmany = [[1, 2], [1, 2, 3]]", 3, 2),
            ("one = [1, 2]\nany = [[]]", 0, 2),
        ] {
            let expected = format!("invalid length {got}, expected a list of {expected} numbers");
            assert_eq!(read(text), Err(expected), "{text}");
        }
    }
}
