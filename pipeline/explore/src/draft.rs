// SPDX-License-Identifier: MIT OR Apache-2.0
//! Edits of the text of a design: values change, comments, order and all else stay. The line of
//! `meridian_file` goes, with its comment, once its points stand in the design.

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value as Json;
use toml_edit::{Array, DocumentMut, Item, Table, Value, value};

use design::dotted_keys::{MAX_PARTS, Step, steps};
use design::json_schema::{NumberKind, number_kind};

/// The text with the key at `path` set to a number, or a list of them, with entries of lists from 1
/// in brackets. A path with `[*]` sets the key in every entry that has it, in turn.
///
/// # Errors
/// Text that is no TOML; a path through a plain value or beyond a list; a value that is no number.
pub fn set(text: &str, path: &str, new: &Json) -> Result<String> {
    let mut document: DocumentMut = text.parse()?;
    if let Some(channel) = channel_of(path) {
        put_channel(document.as_item_mut(), (path, channel), new)?;
        return Ok(document.to_string());
    }
    match path.split_once("[*].") {
        None => put(document.as_item_mut(), path, &number_or_list(path, new)?)?,
        Some((list, key)) => {
            let values = new.as_array().with_context(|| format!("{path}: expected a list"))?;
            let mut values = values.iter();
            let count = entries(document.as_item_mut(), list)?;
            for entry in 1..=count {
                let one = format!("{list}[{entry}].{key}");
                let stated = find(document.as_item_mut(), &one)?;
                if stated.is_some_and(|stated| !stated.is_str()) {
                    let value = values.next().context("expected a value for every entry")?;
                    put(document.as_item_mut(), &one, &number_or_list(&one, value)?)?;
                }
            }
            ensure!(
                values.next().is_none(),
                "{path}: expected one value for every entry, got more"
            );
        }
    }
    Ok(document.to_string())
}

/// The text without the key at `path`.
///
/// # Errors
/// Text that is no TOML; an entry of a list.
pub fn unset(text: &str, path: &str) -> Result<String> {
    let mut document: DocumentMut = text.parse()?;
    let paths = match channel_of(path) {
        Some(channel) => powers(document.as_item_mut(), channel)?,
        None => vec![path.to_owned()],
    };
    for path in paths {
        let (table, key) = path.rsplit_once('.').unwrap_or(("", path.as_str()));
        let holder = match table {
            "" => Some(document.as_item_mut()),
            table => find(document.as_item_mut(), table)?,
        };
        if let Some(table) = holder.and_then(Item::as_table_like_mut) {
            table.remove(key);
        }
    }
    Ok(document.to_string())
}

/// The path of the power of all sources of a channel, which is no key of a design.
pub fn channel_path(channel: &str) -> String {
    format!("channels.{channel}.power")
}

fn channel_of(path: &str) -> Option<&str> {
    path.strip_prefix("channels.")?.strip_suffix(".power")
}

/// Paths of the powers of the sources of a channel.
fn powers(root: &mut Item, channel: &str) -> Result<Vec<String>> {
    let mut paths = Vec::new();
    for entry in 1..=entries(root, "sources")? {
        let stated = find(root, &format!("sources[{entry}].channel"))?;
        if stated.is_some_and(|stated| stated.as_str() == Some(channel)) {
            paths.push(format!("sources[{entry}].power"));
        }
    }
    Ok(paths)
}

/// Sets the power of all sources of a channel, which keep their shares of it.
fn put_channel(root: &mut Item, (path, channel): (&str, &str), new: &Json) -> Result<()> {
    let new = new.as_f64().filter(|number| number.is_finite());
    let new = new.with_context(|| format!("{path}: expected a number"))?;
    let mut parts = Vec::new();
    for one in powers(root, channel)? {
        let power = match find(root, &one)? {
            None => Some(1.0),
            Some(stated) => stated.as_float().or(stated.as_integer().map(|whole| whole as f64)),
        };
        let power = power.with_context(|| {
            format!(
                "{one}: expected a number to change, got a formula, which the text alone changes"
            )
        })?;
        parts.push((one, power));
    }
    let sum: f64 = parts.iter().map(|(_, power)| power).sum();
    ensure!(sum > 0.0, "{path}: expected sources of the channel with a power, got none");
    for (one, power) in parts {
        // Without the rounding of the factor.
        let power: f64 = format!("{:.9e}", power * new / sum).parse()?;
        put(root, &one, &power.into())?;
    }
    Ok(())
}

/// Number of entries of the list at `path`.
fn entries(root: &mut Item, path: &str) -> Result<usize> {
    let list = find(root, path)?.with_context(|| format!("{path}: expected a list, got none"))?;
    let tables = list.as_array_of_tables().map(toml_edit::ArrayOfTables::len);
    tables
        .or_else(|| list.as_array().map(Array::len))
        .with_context(|| format!("{path}: expected a list"))
}

/// What stands at `path`.
fn find<'a>(root: &'a mut Item, path: &str) -> Result<Option<&'a mut Item>> {
    let mut at = root;
    for step in parts(path)? {
        let next = match step {
            Step::Key(key) => at.get_mut(key),
            Step::Entry(number) => at.get_mut(number.wrapping_sub(1)),
        };
        // A key that is missing is there as nothing.
        let Some(next) = next.filter(|next| !next.is_none()) else { return Ok(None) };
        at = next;
    }
    Ok(Some(at))
}

fn parts(path: &str) -> Result<Vec<Step<'_>>> {
    let steps = steps(path)
        .with_context(|| format!("expected a key such as led.reflectance, got {path:?}"))?;
    let count = steps.len();
    ensure!(count <= MAX_PARTS, "expected a key of at most {MAX_PARTS} parts, got {count}");
    Ok(steps)
}

/// Sets what stands at `path`; tables on the way are made where they are missing.
fn put(root: &mut Item, path: &str, new: &Value) -> Result<()> {
    let mut at = root;
    for step in parts(path)? {
        at = match step {
            Step::Entry(number) => {
                let entry = number.checked_sub(1).and_then(|k| at.get_mut(k));
                entry.with_context(|| format!("{path}: expected an entry of the list"))?
            }
            Step::Key(key) => {
                if at.is_none() {
                    *at = Item::Table(Table::new());
                }
                let table = at.as_table_like_mut();
                let table =
                    table.with_context(|| format!("{path}: expected a table before {key}"))?;
                if key == "meridian_mm" {
                    // Points in the design stand in the place of those of a file.
                    table.remove("meridian_file");
                }
                table.entry(key).or_insert(Item::None)
            }
        };
    }
    match at {
        Item::Value(old) if is_formula(old) => {
            let formula = old.to_string();
            let formula = formula.trim();
            bail!(
                "{path}: expected a number to change, got {formula}, which the text alone changes"
            )
        }
        Item::Value(old) => replace(old, new),
        Item::None => *at = value(new.clone()),
        _ => bail!("{path}: expected a number, got a table"),
    }
    Ok(())
}

/// True of a formula, which is a text, or a list with one.
fn is_formula(value: &Value) -> bool {
    value.is_str() || value.as_array().is_some_and(|list| list.iter().any(is_formula))
}

/// Puts `new` in place of `old`. A number that stays keeps how it is written, and lists of as many
/// entries keep their comments and lines.
fn replace(old: &mut Value, new: &Value) {
    let float = |value: &Value| value.as_float().or(value.as_integer().map(|whole| whole as f64));
    match (&mut *old, new) {
        (Value::Array(old), Value::Array(new)) if old.len() == new.len() => {
            old.iter_mut().zip(new.iter()).for_each(|(old, new)| replace(old, new));
        }
        (same, new) if float(new).is_some() && float(same) == float(new) => {}
        _ => {
            let decor = old.decor().clone();
            *old = new.clone();
            *old.decor_mut() = decor;
        }
    }
}

/// A number, or a list of numbers or of points, as the key at `path` takes it.
fn number_or_list(path: &str, new: &Json) -> Result<Value> {
    if let Some(list) = new.as_array() {
        let values = list.iter().map(|one| number_or_list(path, one));
        return Ok(Value::Array(values.collect::<Result<Array>>()?));
    }
    let number = new.as_f64().filter(|number| number.is_finite());
    let number = number.with_context(|| format!("{path}: expected a number, got {new}"))?;
    let is_whole = number_kind(path) == Some(NumberKind::Whole);
    // Below 2^53 every whole number is one of both kinds.
    if is_whole && number.fract() == 0.0 && number.abs() < 9e15 {
        return Ok((number as i64).into());
    }
    Ok(number.into())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const TEXT: &str = "# Head\n[led] # box\nsize_mm = [0.6, 0.6] # both\nreflectance = 0.86   # open\n\n[array]\ncolumns = 2\n\n[[elements.shapes]]\nfrom = 1\napex_angle_deg = 90 # one\n[[elements.shapes]]\nfrom = 2\n[[elements.shapes]]\napex_angle_deg = 80.0\n";

    #[test]
    fn edits_change_one_value_and_nothing_else() {
        let changed = |path: &str, new: Json| set(TEXT, path, &new).expect("set");
        assert_eq!(
            changed("led.reflectance", json!(0.5)),
            TEXT.replace("0.86   # open", "0.5   # open")
        );
        assert_eq!(changed("led.size_mm[2]", json!(0.75)), TEXT.replace(", 0.6]", ", 0.75]"));
        assert_eq!(
            changed("array.columns", json!(3.0)),
            TEXT.replace("columns = 2", "columns = 3")
        );
        let two = changed("elements.shapes[*].apex_angle_deg", json!([70, 60.5]));
        assert_eq!(two, TEXT.replace("= 90 #", "= 70.0 #").replace("80.0", "60.5"));
        // What stays is written as it was.
        let one = changed("elements.shapes[*].apex_angle_deg", json!([90, 60.5]));
        assert_eq!(one, TEXT.replace("80.0", "60.5"));
        // A formula stays, in a curve too.
        let formula = TEXT.replace("= 90 #", "= \"10 * array.columns\" #");
        let beside = set(&formula, "elements.shapes[*].apex_angle_deg", &json!([60.5]));
        assert_eq!(beside.expect("set"), formula.replace("80.0", "60.5"));
        let points = "[dome]\nmeridian_mm = [\n  [0, 1.00], # top\n  [1.0, 0.5, -1e-2],\n]\n";
        let moved = set(points, "dome.meridian_mm", &json!([[0.0, 1.0], [1.25, 0.5, -0.01]]));
        assert_eq!(moved.expect("set"), points.replace("[1.0", "[1.25"));
        let made = changed("far_field.bin_deg", json!(5));
        assert!(made.starts_with(TEXT) && made.ends_with("[far_field]\nbin_deg = 5.0\n"), "{made}");
        assert_eq!(
            unset(&made, "far_field.bin_deg").expect("unset"),
            format!("{TEXT}\n[far_field]\n")
        );
    }

    #[test]
    fn what_is_no_number_of_the_design_is_refused() {
        for (path, new) in [
            ("led", json!(1)),
            ("led.reflectance.more", json!(1)),
            ("led.size_mm[3]", json!(1)),
            ("led.size_mm[0]", json!(1)),
            ("..", json!(1)),
            (&*"a.".repeat(100_000), json!(1)),
            (&*format!("a{}", ".a".repeat(16)), json!(1)),
            ("led.reflectance", json!("text")),
            ("led.reflectance", json!(null)),
            ("elements.shapes[*].apex_angle_deg", json!([1])),
            ("elements.shapes[*].apex_angle_deg", json!([1, 2, 3])),
            ("led.height_mm", json!(1)),
            ("array.pitch_mm", json!(1)),
            ("array.pitch_mm[2]", json!(1)),
            ("array.pitch_mm", json!([1, 2])),
        ] {
            let text = TEXT.replace("[led] # box", "[led]\nheight_mm = \"2 * led.reflectance\"");
            let text = text.replace("[array]", "[array]\npitch_mm = [5, \"6 * led.reflectance\"]");
            assert!(set(&text, path, &new).is_err(), "{path} {new}");
        }
        assert!(set("[a", "led.reflectance", &json!(1)).is_err());
    }
}
