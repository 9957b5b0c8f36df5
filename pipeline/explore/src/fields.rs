// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numbers of a design as fields and curves: label, unit, meaning, and the range of a slider.
//!
//! Numbers that the file states come in its order, then those of the schema that have a number as
//! their default in tables that the design has. Lists of numbers, lists of points, also of a file, and
//! one key of many tables are curves.

use std::path::Path;
use std::sync::OnceLock;

use serde_json::{Value as Json, json};
use toml::Value;

use design::dotted_keys::number;
use design::json_schema::{NumberKind, number_kind, of_designs};
use design::resolve::rows_in_file;

use crate::draft::channel_path;

/// Keys of pitch, lens and films, of any entry of a list: where the design states them, they have a
/// slider from the start and are what a search offers first.
const FIRST: [&str; 25] = [
    "array.pitch_mm",
    "dome.sphere_radius_mm",
    "dome.height_mm",
    "dome.width_mm",
    "silicone.index",
    "elements.width_um",
    "elements.shapes.inner_base_angle_deg",
    "elements.shapes.apex_angle_deg",
    "elements.shapes.outer_base_angle_deg",
    "films.z_mm",
    "films.gap_mm",
    "films.thickness_mm",
    "films.medium.scattering_per_mm",
    "films.top.haze",
    "films.top.total_transmittance",
    "films.top.transmitted",
    "films.top.width_deg",
    "films.top.apex_deg",
    "films.top.direction_deg",
    "films.bottom.haze",
    "films.bottom.total_transmittance",
    "films.bottom.transmitted",
    "films.bottom.width_deg",
    "films.bottom.apex_deg",
    "films.bottom.direction_deg",
];
/// Tables that every design has, whether it states them or not.
const OF_ALL: [&str; 3] = ["receiver", "far_field", "trace"];
/// Start of the keys of shapes of rings.
const SHAPES: &str = "elements.shapes[";
/// Entries from which on a list is a curve.
const CURVE: usize = 3;
/// Most points of a file that are drawn.
const MOST: usize = 500;
/// Endings of keys, and the units that they name.
const UNITS: [(&str, &str); 12] = [
    ("_per_mm", "1/mm"),
    ("_mm", "mm"),
    ("_um", "µm"),
    ("_nm", "nm"),
    ("_per_m2", "1/m²"),
    ("_deg", "°"),
    ("_lm", "lm"),
    ("_w", "W"),
    ("_k", "K"),
    ("_kelvin", "K"),
    ("_gib", "GiB"),
    ("_percent", "%"),
];
/// Keys within 0 and 1.
const SHARES: [&str; 10] = [
    "reflectance",
    "transmittance",
    "absorptance",
    "specular_share",
    "yield",
    "fill",
    "transmitted",
    "reflected",
    "haze",
    "total_",
];

/// Fields and curves of the text of a design in `folder`, as the page reads them; both are empty of
/// what is no TOML.
pub fn fields(text: &str, folder: &Path) -> (Vec<Json>, Vec<Json>) {
    static SCHEMA: OnceLock<Json> = OnceLock::new();
    let Ok(table) = text.parse::<toml::Table>() else { return (Vec::new(), Vec::new()) };
    let schema = SCHEMA.get_or_init(of_designs);
    let mut found = Found { schema, folder, fields: Vec::new(), curves: Vec::new() };
    found.table(&table, "");
    found.defaults(&table);
    found.channels(&table);
    // Rings of many shapes are drawn.
    let are_drawn = |curve: &Json| curve["path"].as_str().is_some_and(|p| p.starts_with(SHAPES));
    if found.curves.iter().any(are_drawn) {
        for field in &mut found.fields {
            if field["path"].as_str().is_some_and(|path| path.starts_with(SHAPES)) {
                field["pinned"] = false.into();
            }
        }
    }
    (found.fields, found.curves)
}

struct Found<'a> {
    schema: &'a Json,
    folder: &'a Path,
    fields: Vec<Json>,
    curves: Vec<Json>,
}

impl Found<'_> {
    fn table(&mut self, table: &toml::Table, before: &str) {
        for (key, value) in table {
            let path = if before.is_empty() { key.clone() } else { format!("{before}.{key}") };
            self.value(value, &path);
        }
        // A dome has both meridians in files, or both in the design.
        let is_pair = before.ends_with("dome") && table.contains_key("meridian_y_file");
        let name = table.get("meridian_file").and_then(Value::as_str);
        if let Some(name) = name.filter(|_| !is_pair) {
            self.meridian(name, before);
        }
    }

    /// The curve of a file: its points stand in the design once one is moved.
    fn meridian(&mut self, name: &str, table: &str) {
        let rows = rows_in_file(self.folder, name).unwrap_or_default();
        if (CURVE..=MOST).contains(&rows.len()) {
            self.curve(&format!("{table}.meridian_mm"), "points", &json!(rows));
            if let Some(curve) = self.curves.last_mut() {
                curve["file"] = name.into();
            }
        }
    }

    fn value(&mut self, value: &Value, path: &str) {
        match value {
            Value::Integer(_) | Value::Float(_) => self.number(value, path, true),
            Value::Table(table) => self.table(table, path),
            Value::Array(list) => self.list(list, path),
            _ => {}
        }
    }

    fn list(&mut self, list: &[Value], path: &str) {
        let numbers: Option<Vec<f64>> = list.iter().map(number).collect();
        let points: Option<Vec<Vec<f64>>> = list.iter().map(point).collect();
        match (numbers, points) {
            (Some(numbers), _) if numbers.len() > CURVE => {
                self.curve(path, "values", &json!(numbers));
            }
            (_, Some(points)) if points.len() >= CURVE => {
                self.curve(path, "points", &json!(points));
            }
            _ => {
                for (k, value) in list.iter().enumerate() {
                    self.value(value, &format!("{path}[{}]", k + 1));
                }
                self.of_tables(list, path);
            }
        }
    }

    /// Curves of the numbers that many tables of a list have under one key.
    fn of_tables(&mut self, list: &[Value], path: &str) {
        let tables = || list.iter().filter_map(Value::as_table);
        let Some(first) = tables().next() else { return };
        for key in first.keys().filter(|key| !["from", "to"].contains(&&***key)) {
            let values: Vec<f64> = tables().filter_map(|t| number(t.get(key)?)).collect();
            if values.len() >= CURVE {
                self.curve(&format!("{path}[*].{key}"), "values", &json!(values));
            }
        }
    }

    fn curve(&mut self, path: &str, kind: &str, values: &Json) {
        let (label, unit) = label(path);
        self.curves.push(json!({"path": path, "label": label, "unit": unit, kind: values}));
    }

    fn number(&mut self, value: &Value, path: &str, written: bool) {
        let Some(kind) = number_kind(path) else { return };
        let Some(value) = number(value) else { return };
        let (label, unit) = label(path);
        let whole = kind == NumberKind::Whole;
        let [low, high] = range(path, value, whole);
        self.fields.push(json!({
            "path": path,
            "table": path.split(['.', '[']).next(),
            "label": label,
            "unit": unit,
            "value": value,
            "whole": whole,
            "doc": meaning(self.schema, path),
            "written": written,
            "low": low,
            "high": high,
            "pinned": written && FIRST.contains(&&*of_any_entry(path)),
        }));
    }

    /// The power of all sources of a channel is its level: each channel has a slider from the start, named
    /// after it, unless a formula makes a part of it.
    fn channels(&mut self, written: &toml::Table) {
        let sources = written.get("sources").and_then(Value::as_array);
        let mut channels: Vec<(&str, Option<f64>)> = Vec::new();
        for source in sources.into_iter().flatten() {
            let Some(channel) = source.get("channel").and_then(Value::as_str) else { continue };
            let power = source.get("power").map_or(Some(1.0), number);
            match channels.iter_mut().find(|(name, _)| *name == channel) {
                Some((_, sum)) => *sum = sum.zip(power).map(|(sum, power)| sum + power),
                None => channels.push((channel, power)),
            }
        }
        for (name, power) in channels {
            let Some(power) = power else { continue };
            self.number(&Value::Float(power), "sources[1].power", true);
            if let Some(field) = self.fields.last_mut() {
                field["path"] = channel_path(name).into();
                field["label"] = format!("power, {name}").into();
                field["doc"] =
                    "Power of all sources of the channel; their shares of it stay.".into();
                field["pinned"] = true.into();
                field["low"] = (0.01 * power).into();
            }
        }
    }

    /// Numbers that the file leaves to their defaults, in tables that it has or every design.
    fn defaults(&mut self, written: &toml::Table) {
        let schema = self.schema;
        for (table, of) in schema["properties"].as_object().into_iter().flatten() {
            let stated = written.get(table).and_then(Value::as_table);
            if stated.is_none() && !OF_ALL.contains(&&**table) {
                continue;
            }
            for (key, one) in of["properties"].as_object().into_iter().flatten() {
                let default = &one["default"];
                let default = if default.is_number() { default } else { &of["default"][key] };
                let is_stated = stated.is_some_and(|table| table.contains_key(key));
                if let (Some(default), false) = (default.as_f64(), is_stated) {
                    self.number(&Value::Float(default), &format!("{table}.{key}"), false);
                }
            }
        }
    }
}

/// A point, with the bulge or the centre of the arc that ends there where it has one.
fn point(value: &Value) -> Option<Vec<f64>> {
    let numbers: Vec<f64> = value.as_array()?.iter().map(number).collect::<Option<_>>()?;
    (2..=4).contains(&numbers.len()).then_some(numbers)
}

/// Name and unit of a key: `pitch` in mm of `array.pitch_mm`.
fn label(path: &str) -> (String, &'static str) {
    let last = path.rsplit('.').next().unwrap_or(path);
    let (key, entry) = last.split_at(last.find('[').unwrap_or(last.len()));
    let known = UNITS.iter().find_map(|(end, unit)| Some((key.strip_suffix(end)?, *unit)));
    let (name, unit) = known.unwrap_or((key, ""));
    let entry = entry.trim_matches(['[', ']']).replace("][", " ");
    (format!("{} {entry}", name.replace('_', " ")).trim_end().to_owned(), unit)
}

/// Range of a slider about `value`; what the design refuses is refused when it is set.
fn range(path: &str, value: f64, whole: bool) -> [f64; 2] {
    let last = path.rsplit('.').next().unwrap_or(path);
    let share = SHARES.iter().any(|name| last.starts_with(name));
    let [low, high] = match value {
        _ if share => [0.0, 1.0],
        _ if last.starts_with("index") => [1.05, 1.2 * value.max(1.25)],
        _ if last.contains("_deg") => [value - 30.0, value + 30.0],
        v if v > 0.0 => [0.5 * v, 2.0 * v],
        v if v < 0.0 => [2.0 * v, -2.0 * v],
        _ => [0.0, 1.0],
    };
    if whole { [low.floor().max(0.0), high.ceil()] } else { [low, high] }
}

/// `path` without the numbers of entries.
fn of_any_entry(path: &str) -> String {
    path.split('[').map(|part| part.split_once(']').map_or(part, |p| p.1)).collect()
}

/// What the schema says of the key at `path`, in one line.
fn meaning(schema: &Json, path: &str) -> String {
    let plain = of_any_entry(path);
    let parts: Vec<&str> = plain.split('.').collect();
    let words = described(schema, &parts).unwrap_or_default();
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn described<'a>(schema: &'a Json, parts: &[&str]) -> Option<&'a str> {
    let Some((part, rest)) = parts.split_first() else { return schema["description"].as_str() };
    let forms =
        ["oneOf", "anyOf"].into_iter().flat_map(|of| schema[of].as_array().into_iter().flatten());
    let items = schema.get("items").into_iter();
    let own = schema["properties"].get(part).and_then(|below| described(below, rest));
    own.or_else(|| forms.chain(items).find_map(|below| described(below, parts)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_label_unit_meaning_and_range() {
        let text = design::NEW_DESIGN.replace("NAME", "own");
        let (fields, curves) = fields(&text, Path::new(""));
        assert!(curves.is_empty());
        let of = |path: &str| fields.iter().find(|field| field["path"] == path).expect(path);
        let pitch = of("array.pitch_mm");
        assert_eq!((&pitch["label"], &pitch["unit"]), (&json!("pitch"), &json!("mm")));
        assert!(pitch["doc"].as_str().is_some_and(|doc| doc.contains("neighbours")), "{pitch}");
        assert_eq!((&pitch["low"], &pitch["high"]), (&json!(2.5), &json!(10.0)));
        assert_eq!(of("led.size_mm[2]")["label"], "size 2");
        assert_eq!(of("array.columns")["whole"], true);
        // A default, which the file does not state, in a table that it has.
        assert_eq!(
            (&of("hybrid.tolerance")["value"], &of("hybrid.tolerance")["written"]),
            (&json!(2e-3), &json!(false))
        );
        // A backlight without domes has no number of theirs.
        let (bare, _) = super::fields(design::NEW_BACKLIGHT, Path::new(""));
        let has = |table: &str| bare.iter().any(|field| field["table"] == table);
        assert_eq!(
            ["far_field", "films", "hybrid", "silicone"].map(has),
            [true, true, false, false]
        );
        let gap = bare.iter().find(|field| field["path"] == "films[3].gap_mm").expect("a gap");
        assert_eq!(gap["pinned"], true);
        let pinned = fields.iter().filter(|field| field["pinned"] == true);
        let mut pinned: Vec<_> = pinned.filter_map(|field| field["path"].as_str()).collect();
        pinned.sort_unstable();
        let dome = ["dome.height_mm", "dome.sphere_radius_mm", "dome.width_mm"];
        let [pitch, width, index] = ["array.pitch_mm", "elements.width_um", "silicone.index"];
        assert_eq!(pinned, [&[pitch][..], &dome, &[width, index]].concat());
    }

    #[test]
    fn each_channel_has_a_slider_from_the_start() {
        // Two dies of one channel, one without a power of its own, one of a formula, one of no channel.
        let of_channel =
            |name: &str, keys: &str| format!("[[sources]]\nchannel = \"{name}\"\n{keys}");
        let text = [
            of_channel("red", "power = 1.5 # a\n"),
            of_channel("red", "power = 0.5\n"),
            of_channel("blue 4.5", ""),
            of_channel("green", "power = \"2 * led.reflectance\"\n"),
            "[[sources]]\npower = 1.0\n".to_owned(),
        ]
        .concat();
        let (all, _) = fields(&text, Path::new(""));
        let pinned: Vec<_> = all.iter().filter(|field| field["pinned"] == true).collect();
        let of = |k: usize, key: &str| pinned[k][key].clone();
        assert_eq!(pinned.len(), 2, "{pinned:?}");
        assert_eq!((of(0, "label"), of(0, "value")), (json!("power, red"), json!(2.0)));
        assert_eq!((of(0, "low"), of(0, "high")), (json!(0.02), json!(4.0)));
        assert_eq!((of(1, "label"), of(1, "value")), (json!("power, blue 4.5"), json!(1.0)));
        // The sliders change the sources of their channel by one factor, and no others.
        let moved = crate::draft::set(&text, "channels.red.power", &json!(3)).expect("set");
        assert_eq!(moved, text.replace("1.5 #", "2.25 #").replace("= 0.5", "= 0.75"));
        let moved = crate::draft::set(&text, "channels.blue 4.5.power", &json!(0.25)).expect("set");
        assert_eq!(moved, text.replace("4.5\"\n", "4.5\"\npower = 0.25\n"));
        let back = crate::draft::unset(&moved, "channels.blue 4.5.power");
        assert_eq!(back.expect("unset"), text);
        for name in ["green", "pink"] {
            let path = format!("channels.{name}.power");
            assert!(crate::draft::set(&text, &path, &json!(1)).is_err(), "{name}");
        }
    }

    #[test]
    fn lists_and_keys_of_many_tables_are_curves() {
        let text = "[dome]\nmeridian_mm = [[0.0, 1.0], [0.5, 0.9, -0.01], [1.0, 0.4]]\n[[elements.shapes]]\nfrom = 1\napex_angle_deg = 80\n[[elements.shapes]]\nfrom = 2\napex_angle_deg = 81\n[[elements.shapes]]\nfrom = 3\napex_angle_deg = 82.5\n";
        let folder = tempfile::tempdir().expect("a folder");
        let (_, curves) = fields(text, folder.path());
        let paths: Vec<_> = curves.iter().map(|curve| curve["path"].as_str()).collect();
        assert_eq!(paths, [Some("dome.meridian_mm"), Some("elements.shapes[*].apex_angle_deg")]);
        assert_eq!(curves[1]["values"], json!([80.0, 81.0, 82.5]));
        assert_eq!(fields("[a", folder.path()).0.len(), 0);
        // Points of a file are drawn likewise, and stand in the design once they are moved.
        let text = "[dome]\nmeridian_file = \"lens.csv\" # measured\n";
        assert_eq!(fields(text, folder.path()).1, Vec::<Json>::new());
        std::fs::write(folder.path().join("lens.csv"), "r, z\n0, 1 # top\n0.5; 0.9; -0.01\n1 0\n")
            .expect("written");
        let (_, curves) = fields(text, folder.path());
        let points = json!([[0.0, 1.0], [0.5, 0.9, -0.01], [1.0, 0.0]]);
        let curve = json!({"path": "dome.meridian_mm", "label": "meridian", "unit": "mm", "points": points, "file": "lens.csv"});
        assert_eq!(curves, [curve]);
        let pair = format!("{text}meridian_y_file = \"lens.csv\"\n");
        assert_eq!(fields(&pair, folder.path()).1, Vec::<Json>::new());
        std::fs::write(folder.path().join("lens.csv"), "0 1\n".repeat(501)).expect("written");
        assert_eq!(fields(text, folder.path()).1, Vec::<Json>::new());
        let moved = crate::draft::set(text, "dome.meridian_mm", &json!([[0, 1], [1, 0.5], [1, 0]]));
        assert_eq!(
            moved.expect("set"),
            "[dome]\nmeridian_mm = [[0.0, 1.0], [1.0, 0.5], [1.0, 0.0]]\n"
        );
    }
}
