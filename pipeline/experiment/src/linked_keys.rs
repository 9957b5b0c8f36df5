// SPDX-License-Identifier: MIT OR Apache-2.0
//! Keys of a design that a variable or a tolerance moves by one amount.

use anyhow::{Context, Result, bail};

/// The first of the keys that move by one amount, or the only one.
pub fn one_of_keys<'a>(
    key: Option<&'a String>,
    keys: Option<&'a Vec<String>>,
) -> Result<Option<&'a String>> {
    match (key, keys) {
        (Some(_), Some(_)) => bail!("expected one of `key` and `keys`, got both"),
        (None, Some(keys)) => {
            let expected = "keys: expected at least one, got none";
            keys.first().map(Some).context(expected)
        }
        (key, None) => Ok(key),
    }
}
