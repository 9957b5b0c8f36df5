// SPDX-License-Identifier: MIT OR Apache-2.0
//! Keys of a design by dotted path, and tables in which they are set.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use anyhow::{Context, Result, bail, ensure};

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

/// `path` in [`bracketed`] form, with numbers in place of names of entries of lists in `design`:
/// `films.diffuser.gap_mm` is `films[2].gap_mm`. A name that two entries have stays.
pub fn numbered(design: &toml::Table, path: &str) -> String {
    let path = bracketed(path);
    let Some(steps) = steps(&path) else { return path };
    let (mut text, mut at) = (String::new(), None::<&toml::Value>);
    for (place, step) in steps.into_iter().enumerate() {
        let entry = match (step, at) {
            (Step::Key(name), Some(toml::Value::Array(list))) => entry_of_name(list, name),
            _ => None,
        };
        let step = entry.map_or(step, |entry| Step::Entry(entry + 1));
        at = match (step, place) {
            (Step::Key(key), 0) => design.get(key),
            (step, _) => at.and_then(|at| below(at, step)),
        };
        match step {
            Step::Key(key) if text.is_empty() => text.push_str(key),
            Step::Key(key) => text.extend([".", key]),
            Step::Entry(number) => text.extend(["[", &number.to_string(), "]"]),
        }
    }
    text
}

/// The place of the only entry called `name`, from 0.
fn entry_of_name(list: &[toml::Value], name: &str) -> Option<usize> {
    let mut called = (0..list.len()).filter(|k| name_of(&list[*k]) == Some(name));
    called.next().filter(|_| called.next().is_none())
}

fn name_of(entry: &toml::Value) -> Option<&str> {
    entry.get("name")?.as_str()
}

/// What stands one step below `at`.
fn below<'a>(at: &'a toml::Value, step: Step<'_>) -> Option<&'a toml::Value> {
    match (at, step) {
        (toml::Value::Table(table), Step::Key(key)) => table.get(key),
        (toml::Value::Array(list), Step::Entry(number)) => list.get(number.checked_sub(1)?),
        _ => None,
    }
}

/// Sets the key at the dotted `path`; `""` removes a key of a table, and stands in the place of an
/// entry that is to be removed.
fn set(design: &mut toml::Table, path: &str, value: &toml::Value) -> Result<()> {
    let path = &numbered(design, path);
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
                "{path}: expected an entry of `{key}`, `{key}[1]` to `{key}[{}]`{}, got `{next}`",
                list.len(),
                names_of(list)
            ),
            _ => bail!("{path}: expected a table at `{key}`, got a value"),
        };
        key = next;
    }
}

/// Sets all keys of `settings`, with entries of lists in brackets from 1, between dots from 0, or by
/// their names: `elements.shapes[2].apex_angle_deg`, `films.diffuser.gap_mm`. The value `""` removes
/// a key or an entry, a list of names puts a list of tables into their order and removes all others.
/// Numbers and names of entries are those before.
///
/// # Errors
/// The first key that cannot be set: a path through a plain value, or beyond the end of a list.
pub fn set_all(design: &mut toml::Table, settings: &Settings) -> Result<()> {
    let settings = settings_by_number(design, settings);
    let mut orders = BTreeMap::new();
    for (path, value) in &settings {
        orders.extend(order(design, path, value)?.map(|order| (path.as_str(), order)));
    }
    let removed: Vec<String> = removed_entries(&settings).collect();
    let is_of_entry = |path: &String| orders.contains_key(path.as_str()) || removed.contains(path);
    for (path, value) in settings.iter().filter(|(path, _)| !is_of_entry(path)) {
        set(design, path, value)?;
    }
    let lowest = lowest_film(design).cloned();
    for path in &removed {
        set(design, path, &toml::Value::String(String::new()))?;
    }
    let lists = removed.iter().filter_map(|path| Some(path.rsplit_once('[')?.0));
    let mut lists: Vec<&str> = lists.chain(orders.keys().copied()).collect();
    check_references(design, &lists)?;
    // Lists within entries first, as their numbers are those of the file.
    lists.sort_by_key(|path| Reverse(path.matches('[').count()));
    for path in lists {
        let Some(toml::Value::Array(list)) = get(design, path) else { continue };
        let order = orders.remove(path).unwrap_or_else(|| (0..list.len()).collect());
        let entries = order.iter().filter_map(|k| list.get(*k));
        let left = entries.filter(|entry| entry.as_str() != Some("")).cloned();
        let left = toml::Value::Array(left.collect());
        set(design, path, &left)?;
    }
    keep_height(design, lowest);
    Ok(())
}

/// Refuses formulas that name an entry of one of `lists`, whose numbers change, by its number.
fn check_references(design: &toml::Table, lists: &[&str]) -> Result<()> {
    for key in texts(design) {
        let text = get(design, &key).and_then(toml::Value::as_str).unwrap_or_default();
        if let Some(list) = lists.iter().find(|list| text.contains(&format!("{list}["))) {
            bail!("{key}: expected names of entries of {list}, whose numbers change, got {text:?}");
        }
    }
    Ok(())
}

/// Keys of all texts of `design`.
pub(crate) fn texts(design: &toml::Table) -> Vec<String> {
    fn collect(value: &toml::Value, key: String, texts: &mut Vec<String>) {
        match value {
            toml::Value::String(_) => texts.push(key),
            toml::Value::Array(list) => {
                for (entry, number) in list.iter().zip(1..) {
                    collect(entry, format!("{key}[{number}]"), texts);
                }
            }
            toml::Value::Table(table) => {
                for (name, value) in table {
                    collect(value, format!("{key}.{name}"), texts);
                }
            }
            _ => {}
        }
    }
    let mut texts = Vec::new();
    design.iter().for_each(|(key, value)| collect(value, key.clone(), &mut texts));
    texts
}

/// The entries that orders of lists in `settings` leave out.
///
/// # Errors
/// A name that no entry has.
pub fn entries_left_out(design: &toml::Table, settings: &Settings) -> Result<Vec<String>> {
    let mut left_out = Vec::new();
    for (path, value) in settings {
        let Some(kept) = order(design, path, value)? else { continue };
        let count = get(design, path).and_then(toml::Value::as_array).map_or(0, Vec::len);
        let gone = (0..count).filter(|entry| !kept.contains(entry));
        left_out.extend(gone.map(|entry| format!("{path}[{}]", entry + 1)));
    }
    Ok(left_out)
}

/// `settings` with [`numbered`] keys.
pub fn settings_by_number(design: &toml::Table, settings: &Settings) -> Settings {
    settings.iter().map(|(key, value)| (numbered(design, key), value.clone())).collect()
}

/// The places, from 0, of the entries that `value` names, if it is the order of a list of tables.
fn order(design: &toml::Table, path: &str, value: &toml::Value) -> Result<Option<Vec<usize>>> {
    let list = get(design, path).and_then(toml::Value::as_array).map_or(&[][..], Vec::as_slice);
    let names = value.as_array().into_iter().flatten().map(toml::Value::as_str);
    let names = names.collect::<Option<Vec<_>>>().filter(|names| !names.is_empty());
    let (Some(names), Some(toml::Value::Table(_))) = (names, list.first()) else {
        return Ok(None);
    };
    let place = |name: &str| {
        entry_of_name(list, name).with_context(|| {
            let known = names_of(list);
            format!("{path}: expected names of its entries{known}, got {name:?}")
        })
    };
    let twice = (1..names.len()).find(|k| names[..*k].contains(&names[*k]));
    if let Some(twice) = twice.map(|k| names[k]) {
        bail!("{path}: expected each name once, got {twice:?} twice");
    }
    names.into_iter().map(place).collect::<Result<_>>().map(Some)
}

/// Names of entries, as messages list them after a blank.
fn names_of(list: &[toml::Value]) -> String {
    let names: Vec<&str> = list.iter().filter_map(name_of).collect();
    if names.is_empty() { String::new() } else { format!(" ({})", names.join(", ")) }
}

fn lowest_film(design: &toml::Table) -> Option<&toml::Table> {
    design.get("films")?.as_array()?.first()?.as_table()
}

/// Gives the lowest film of a stack the height of that which was, and the latter, where it is still
/// there, the gap in exchange.
fn keep_height(design: &mut toml::Table, before: Option<toml::Table>) {
    const HEIGHT: &str = "z_mm";
    const GAP: &str = "gap_mm";
    let films = design.get_mut("films").and_then(toml::Value::as_array_mut);
    let (Some(films), Some(before)) = (films, before) else { return };
    let Some(height) = before.get(HEIGHT) else { return };
    let Some(lowest) = films.first_mut().and_then(toml::Value::as_table_mut) else { return };
    if lowest.get("name") == before.get("name") || lowest.contains_key(HEIGHT) {
        return;
    }
    lowest.insert(HEIGHT.to_owned(), height.clone());
    let gap = lowest.remove(GAP);
    let mut others = films.iter_mut().skip(1).filter_map(toml::Value::as_table_mut);
    if let Some(former) = others.find(|film| film.get("name") == before.get("name")) {
        former.remove(HEIGHT);
        former.extend(gap.map(|gap| (GAP.to_owned(), gap)));
    }
}

/// A number of either kind.
pub fn number(value: &toml::Value) -> Option<f64> {
    let whole = value.as_integer().map(|whole| whole as f64);
    value.as_float().or(whole)
}

/// The value at the dotted `path`, if there is one.
pub fn get<'a>(design: &'a toml::Table, path: &str) -> Option<&'a toml::Value> {
    let path = numbered(design, path);
    let mut parts = steps(&path)?.into_iter();
    let Some(Step::Key(first)) = parts.next() else { return None };
    parts.try_fold(design.get(first)?, below)
}

/// The entries of lists that `settings`, by numbers, remove.
pub fn removed_entries(settings: &Settings) -> impl Iterator<Item = String> {
    let removed = settings.iter().filter(|(_, value)| value.as_str() == Some(""));
    removed.map(|(path, _)| bracketed(path)).filter(|path| path.ends_with(']'))
}

/// Refuses settings that remove or reorder entries of lists of `design`, which studies alone do.
///
/// # Errors
/// The first such key.
pub fn check_entries_stay(design: &toml::Table, settings: &Settings) -> Result<()> {
    let settings = settings_by_number(design, settings);
    let removed: Vec<String> = removed_entries(&settings).collect();
    for (key, value) in &settings {
        ensure!(
            !removed.contains(key) && order(design, key, value)?.is_none(),
            "{key}: expected a value, got {value}; studies alone take entries of lists away or \
             reorder them, here the design file does"
        );
    }
    Ok(())
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

    /// A stack of four films, the lowest at 5 mm, with `settings`.
    fn stack(settings: &str) -> Result<toml::Table> {
        let mut design: toml::Table = toml::from_str(
            "films = [{name = \"plate\", z_mm = 5}, {name = \"a-1\", gap_mm = 0.1}, \
             {name = \"b\", gap_mm = 0.2, top = {angle_deg = 90}}, {name = \"c\"}]",
        )?;
        set_all(&mut design, &toml::from_str(settings)?)?;
        Ok(design)
    }

    #[test]
    fn films_are_named_taken_away_and_put_in_order() {
        for (settings, films) in [
            (
                "\"films.b.top.angle_deg\" = 60\n\"films.a-1\" = \"\"",
                "{name = \"plate\", z_mm = 5}, {name = \"b\", gap_mm = 0.2, top = {angle_deg = 60}}, {name = \"c\"}",
            ),
            (
                "films = [\"plate\", \"c\", \"a-1\"]\n\"films.c.gap_mm\" = 0.3\n\"films[2].gap_mm\" = 0.4",
                "{name = \"plate\", z_mm = 5}, {name = \"c\", gap_mm = 0.3}, {name = \"a-1\", gap_mm = 0.4}",
            ),
            // The lowest of a stack has its height, whichever film it is.
            (
                "films = [\"a-1\", \"plate\"]",
                "{name = \"a-1\", z_mm = 5}, {name = \"plate\", gap_mm = 0.1}",
            ),
            ("films = [\"c\", \"plate\"]", "{name = \"c\", z_mm = 5}, {name = \"plate\"}"),
            (
                "films = [\"b\", \"a-1\", \"plate\"]\n\"films.b\" = \"\"\n\"films[1].z_mm\" = 6",
                "{name = \"a-1\", z_mm = 6}, {name = \"plate\", gap_mm = 0.1}",
            ),
            (
                "\"films.plate\" = \"\"\n\"films[3]\" = \"\"",
                "{name = \"a-1\", z_mm = 5}, {name = \"c\"}",
            ),
            ("films = []", ""),
        ] {
            let expected: toml::Table =
                toml::from_str(&format!("films = [{films}]")).expect("TOML");
            assert_eq!(stack(settings).expect("set"), expected, "{settings}");
        }
        for (settings, words) in [
            (
                "films = [\"plate\", \"d\"]",
                "films: expected names of its entries (plate, a-1, b, c), got \"d\"",
            ),
            ("films = [\"b\", \"b\"]", "films: expected each name once, got \"b\" twice"),
            (
                "\"films.d.gap_mm\" = 1",
                "expected an entry of `films`, `films[1]` to `films[4]` (plate, a-1, b, c), got `d`",
            ),
            ("\"films.d\" = \"\"", "got `d`"),
            ("\"films[5]\" = \"\"", "from 1 to 4, got 5"),
            (
                "\"films.b\" = \"\"\n\"films.c.gap_mm\" = \"2 * films[2].gap_mm\"",
                "films[4].gap_mm: expected names of entries of films, whose numbers change",
            ),
            (
                "films = [\"plate\", \"c\"]\n\"films.c.gap_mm\" = \"films[1].z_mm\"",
                "expected names of entries of films",
            ),
        ] {
            let said = stack(settings).expect_err(settings).to_string();
            assert!(said.contains(words), "{said}");
        }
        let design = stack("").expect("set");
        assert_eq!(numbered(&design, "films.b.top.x"), "films[3].top.x");
        assert_eq!(get(&design, "films.a-1.gap_mm"), get(&design, "films[2].gap_mm"));
        for (settings, stay) in [
            ("\"films.b\" = \"\"", false),
            ("films = [\"b\", \"plate\"]", false),
            ("\"films.b.gap_mm\" = \"\"\n\"films.c\" = {name = \"d\"}", true),
        ] {
            let settings: Settings = toml::from_str(settings).expect("TOML");
            assert_eq!(check_entries_stay(&design, &settings).is_ok(), stay, "{settings:?}");
        }
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
