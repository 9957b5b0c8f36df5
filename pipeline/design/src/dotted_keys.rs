// SPDX-License-Identifier: MIT OR Apache-2.0
//! Keys of a design by dotted path, and tables in which they are set.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use anyhow::{Result, bail, ensure};

/// Keys of a design by dotted path, and what they are set to.
pub type Settings = BTreeMap<String, toml::Value>;

/// Most parts of a dotted key; designs nest no deeper than a few.
pub const MAX_PARTS: usize = 16;

/// One step of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step<'a> {
    /// Key of a table.
    Key(&'a str),
    /// Entry of a list, from 1.
    Entry(usize),
}

/// `path` with entries of lists in brackets, as messages name them: `solids.1.radius_mm` is
/// `solids[2].radius_mm`, and `.*` is `[*]`.
pub fn bracketed(path: &str) -> String {
    let is_entry = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let mut parts = path.split('.');
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let step = match part.parse::<usize>() {
            Ok(number) if is_entry(part) => format!("[{}]", number.saturating_add(1)),
            _ if part == "*" => "[*]".to_owned(),
            _ => format!(".{part}"),
        };
        text.push_str(&step);
    }
    text
}

/// The steps of a path in [`bracketed`] form; `None` of what is no key.
pub fn steps(path: &str) -> Option<Vec<Step<'_>>> {
    let mut steps = Vec::new();
    for part in path.split('.') {
        let (name, entries) = part.split_at(part.find('[').unwrap_or(part.len()));
        steps.push(Step::Key(Some(name).filter(|name| !name.is_empty())?));
        let mut rest = entries;
        while !rest.is_empty() {
            let (number, after) = rest.strip_prefix('[')?.split_once(']')?;
            steps.push(Step::Entry(number.parse().ok()?));
            rest = after;
        }
    }
    Some(steps)
}

/// Sets the key at the dotted `path`; `""` removes a key of a table, and stands in the place of an
/// entry that is to be removed.
fn set(design: &mut toml::Table, path: &str, value: &toml::Value) -> Result<()> {
    let path = &bracketed(path);
    let Some(all) = steps(path) else {
        bail!("expected a key such as led.reflectance or solids[1].position_mm[3], got {path:?}");
    };
    let count = all.len();
    ensure!(count <= MAX_PARTS, "expected a key of at most {MAX_PARTS} parts, got {count}");
    let is_removed = value.as_str() == Some("");
    let mut parts = all.into_iter().peekable();
    let Some(Step::Key(mut key)) = parts.next() else {
        bail!("expected a key such as led.reflectance, got {path:?}");
    };
    let mut table = design;
    loop {
        if parts.peek().is_none() {
            if is_removed {
                table.remove(key);
            } else {
                table.insert(key.to_owned(), value.clone());
            }
            return Ok(());
        }
        if let (Some(Step::Entry(_)), None) = (parts.peek(), table.get(key)) {
            bail!("{path}: expected a design that states the list `{key}`, got one without it");
        }
        let mut at = table.entry(key).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        while let Some(Step::Entry(number)) = parts.peek().copied() {
            parts.next();
            let toml::Value::Array(list) = at else {
                let got = if at.is_table() { "a table" } else { "one value" };
                bail!("{path}: expected a list at `{key}`, got {got}");
            };
            let last = list.len();
            let Some(entry) = number.checked_sub(1).and_then(|k| list.get_mut(k)) else {
                bail!("{path}: expected an entry of `{key}` from 1 to {last}, got {number}");
            };
            at = entry;
        }
        let Some(Step::Key(next)) = parts.next() else {
            *at = value.clone();
            return Ok(());
        };
        table = match at {
            toml::Value::Table(table) => table,
            toml::Value::Array(list) => bail!(
                "{path}: expected an entry of `{key}`, `{key}[1]` to `{key}[{}]`, got `{next}`",
                list.len()
            ),
            _ => bail!("{path}: expected a table at `{key}`, got a value"),
        };
        key = next;
    }
}

/// Sets all keys of `settings`, with entries of lists in brackets from 1:
/// `elements.shapes[2].apex_angle_deg`, or as `elements.shapes.1.apex_angle_deg` from 0. The value `""`
/// removes a key or an entry; numbers of entries are those before any is removed.
///
/// # Errors
/// The first key that cannot be set: a path through a plain value, or beyond the end of a list.
pub fn set_all(design: &mut toml::Table, settings: &Settings) -> Result<()> {
    for (path, value) in settings {
        set(design, path, value)?;
    }
    let mut entries: Vec<String> = removed_entries(settings).collect();
    // Lists within entries first, as their numbers are those of the file.
    entries.sort_by_key(|path| Reverse(path.matches('[').count()));
    for path in entries {
        if let Some((list, _)) = path.rsplit_once('[')
            && let Some(toml::Value::Array(entries)) = get(design, list)
        {
            let left = entries.iter().filter(|entry| entry.as_str() != Some("")).cloned();
            let left = toml::Value::Array(left.collect());
            set(design, list, &left)?;
        }
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
    let path = bracketed(path);
    let mut parts = steps(&path)?.into_iter();
    let Some(Step::Key(first)) = parts.next() else { return None };
    parts.try_fold(design.get(first)?, |at, step| match (at, step) {
        (toml::Value::Table(table), Step::Key(key)) => table.get(key),
        (toml::Value::Array(list), Step::Entry(number)) => list.get(number.checked_sub(1)?),
        _ => None,
    })
}

/// The entries of lists that `settings` remove.
pub fn removed_entries(settings: &Settings) -> impl Iterator<Item = String> {
    let removed = settings.iter().filter(|(_, value)| value.as_str() == Some(""));
    removed.map(|(path, _)| bracketed(path)).filter(|path| path.ends_with(']'))
}

/// Refuses settings that remove entries of lists, which studies alone do.
///
/// # Errors
/// The first entry.
pub fn check_entries_stay(settings: &Settings) -> Result<()> {
    match removed_entries(settings).next() {
        Some(entry) => bail!(
            "{entry}: expected a value, got \"\"; studies alone take entries of lists away, here \
             the design file does"
        ),
        None => Ok(()),
    }
}

/// True where the dotted key `outer` is `inner` or holds it.
pub fn contains(outer: &str, inner: &str) -> bool {
    let (outer, inner) = (bracketed(outer), bracketed(inner));
    let rest = inner.strip_prefix(&*outer);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_lists_are_removed_by_their_numbers_in_the_file() {
        let mut design: toml::Table =
            toml::from_str("[[films]]\na = 1\n[[films]]\na = 2\n[[films]]\na = [3, 4, 5]")
                .expect("valid");
        let none = toml::Value::String(String::new());
        let settings = [
            ("films[1]", none.clone()),
            ("films.1", none.clone()),
            ("films[3].a[2]", none),
            ("films[3].b", toml::Value::Integer(7)),
        ];
        let settings = settings.map(|(key, value)| (key.to_owned(), value)).into();
        set_all(&mut design, &settings).expect("set");
        assert_eq!(design, toml::from_str("[[films]]\na = [3, 5]\nb = 7").expect("valid"));
    }

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
        set(&mut design, "led.rows[1][2]", &toml::Value::Integer(8)).expect("set");
        assert_eq!(design["led"]["rows"][0][1].as_integer(), Some(8));
        assert_eq!(get(&design, "led.rows.0.1"), get(&design, "led.rows[1][2]"));
        assert_eq!(get(&design, "led.rows[0]"), None);
        assert_eq!(bracketed("a.*.1.b"), "a[*][2].b");
        assert!(contains("shapes.0", "shapes[1].a") && !contains("shapes.1", "shapes[1].a"));
        assert_eq!(design["led"]["rows"][1][0].as_integer(), Some(9));
        assert_eq!(design["led"]["height_mm"].as_float(), Some(0.5));
        assert_eq!(design["shapes"][1]["a"].as_integer(), Some(7));
        set(&mut design, "shapes.0.a", &toml::Value::String(String::new())).expect("removed");
        assert!(design["shapes"][0].get("a").is_none());
        for (path, word) in [
            ("shapes.2.a", "shapes[3].a: expected an entry of `shapes` from 1 to 2, got 3"),
            ("shapes[0].a", "from 1 to 2, got 0"),
            ("shapes[x].a", "a key such as"),
            ("shapes.a", "`shapes[1]` to `shapes[2]`"),
            ("led[1]", "led[1]: expected a list at `led`, got a table"),
            ("led.offset_mm[1]", "a design that states the list `offset_mm`"),
            ("led.height_mm.x", "a table"),
            ("led.size_mm.2", "from 1 to 2"),
            ("led.size_mm.0.1", "expected a list at `size_mm`, got one value"),
            (&"a.".repeat(20_000), "a key such as"),
            (&format!("{}a", "a.".repeat(20_000)), "at most 16 parts"),
            ("led..x", "a key"),
        ] {
            let error = set(&mut design, path, &toml::Value::Integer(1)).expect_err(path);
            assert!(error.to_string().contains(word), "{error}");
        }
    }
}
