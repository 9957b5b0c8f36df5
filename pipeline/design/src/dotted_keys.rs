// SPDX-License-Identifier: MIT OR Apache-2.0
//! Keys of a design by dotted path, and tables in which they are set.

use std::collections::BTreeMap;

use anyhow::{Result, bail, ensure};

/// Keys of a design by dotted path, and what they are set to.
pub type Settings = BTreeMap<String, toml::Value>;

/// Most parts of a dotted key; designs nest no deeper than a few.
const MAX_PARTS: usize = 16;

/// Sets the key at the dotted `path`, with numbers from 0 for entries of lists:
/// `elements.shapes.1.apex_angle_deg`. The value `""` removes the key.
///
/// # Errors
/// A path through a plain value, or beyond the end of a list.
pub fn set(design: &mut toml::Table, path: &str, value: &toml::Value) -> Result<()> {
    let mut parts: Vec<&str> = path.split('.').collect();
    let last = parts.pop().unwrap_or_default();
    ensure!(
        !last.is_empty() && parts.iter().all(|p| !p.is_empty()),
        "expected a key such as led.reflectance, got {path:?}"
    );
    ensure!(
        parts.len() < MAX_PARTS,
        "expected a key of at most {MAX_PARTS} parts, got {}",
        parts.len() + 1
    );
    let mut at = design;
    let mut steps = parts.into_iter();
    while let Some(part) = steps.next() {
        let mut next = at.entry(part).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        while let toml::Value::Array(list) = next {
            // The end of the path may be an entry itself.
            let (place, is_last) = steps.next().map_or((last, true), |place| (place, false));
            let highest = list.len().saturating_sub(1);
            let Some(entry) = place.parse().ok().and_then(|k: usize| list.get_mut(k)) else {
                bail!("{path}: expected an entry of `{part}` from 0 to {highest}, got {place:?}");
            };
            if is_last {
                *entry = value.clone();
                return Ok(());
            }
            next = entry;
        }
        let toml::Value::Table(table) = next else {
            bail!("{path}: expected a table at `{part}`, got a value");
        };
        at = table;
    }
    if value.as_str() == Some("") {
        at.remove(last);
    } else {
        at.insert(last.to_owned(), value.clone());
    }
    Ok(())
}

/// A number of either kind.
pub fn number(value: &toml::Value) -> Option<f64> {
    let whole = value.as_integer().map(|whole| whole as f64);
    value.as_float().or(whole)
}

/// The value at the dotted `path`, if there is one.
pub fn get<'a>(design: &'a toml::Table, path: &str) -> Option<&'a toml::Value> {
    let mut parts = path.split('.');
    let mut at = design.get(parts.next()?)?;
    for part in parts {
        at = match at {
            toml::Value::Table(table) => table.get(part)?,
            toml::Value::Array(list) => list.get(part.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_set_in_tables_and_lists_and_removed() {
        let mut design: toml::Table = toml::from_str(
            "[led]\nheight_mm = 1\nsize_mm = [1, 2]\nrows = [[1, 2], [3, 4]]\n[[shapes]]\na = 1\n[[shapes]]\na = 2",
        )
        .expect("valid");
        set(&mut design, "led.height_mm", &toml::Value::Float(0.5)).expect("set");
        set(&mut design, "shapes.1.a", &toml::Value::Integer(7)).expect("set");
        set(&mut design, "hybrid.kind", &toml::Value::String("x".into())).expect("set");
        set(&mut design, "led.size_mm.1", &toml::Value::Integer(3)).expect("set");
        assert_eq!(design["led"]["size_mm"][1].as_integer(), Some(3));
        set(&mut design, "led.rows.1.0", &toml::Value::Integer(9)).expect("set");
        assert_eq!(design["led"]["rows"][1][0].as_integer(), Some(9));
        assert_eq!(design["led"]["height_mm"].as_float(), Some(0.5));
        assert_eq!(design["shapes"][1]["a"].as_integer(), Some(7));
        set(&mut design, "shapes.0.a", &toml::Value::String(String::new())).expect("removed");
        assert!(design["shapes"][0].get("a").is_none());
        for (path, word) in [
            ("shapes.2.a", "from 0 to 1"),
            ("led.height_mm.x", "a table"),
            ("led.size_mm.2", "from 0 to 1"),
            ("led.size_mm.0.1", "a table"),
            (&"a.".repeat(20_000), "a key such as"),
            (&format!("{}a", "a.".repeat(20_000)), "at most 16 parts"),
            ("led..x", "a key"),
        ] {
            let error = set(&mut design, path, &toml::Value::Integer(1)).expect_err(path);
            assert!(error.to_string().contains(word), "{error}");
        }
    }
}
