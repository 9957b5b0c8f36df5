// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far field and map of each model of a folder, in the form in which the page keeps them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};

use arrays::exr;
use metrics::extraction::{ROUNDING, is_end};
use metrics::quantity::{Axis, Curve, Map, Quantity, Unit};
use results::package::{self, PackageFile};
use results::schema::{BY_ANGLE, ModelEntries, ModelEntry};

use super::folder::Folder;
use super::pack::{base64_of_numbers, linear};
use crate::plots::{map_range, receiver_title};

/// Counter that every model has.
pub const SURFACES: &str = "surfaces_per_path";
/// Letters that the pictures of colours and of all receivers may take.
const PICTURES_BUDGET: usize = 1_500_000;
/// Key of the power ledger.
const LEDGER: &str = "power_ledger";

/// One model of one design.
#[derive(Clone, Debug)]
pub struct Model<'a> {
    /// Name of the design.
    pub design: &'a str,
    /// Key of the model.
    pub key: &'a str,
    /// Entry in `results.json`.
    pub entry: &'a ModelEntry,
    /// Key of that entry.
    pub place: String,
}

impl Model<'_> {
    /// Name for people: `hybrid, 10 µm` for `hybrid_10um`.
    pub fn label(&self) -> String {
        label(self.key)
    }

    /// Checks that the entry holds what its units name: every figure, every counter, and a ledger
    /// whose accounts add up to what was emitted.
    ///
    /// # Errors
    /// A key that is missing.
    pub fn complete(&self, folder: &Folder) -> Result<()> {
        let ModelEntry { figures, counters, units, power_ledger, .. } = self.entry;
        let place = |key: &str| folder.place(&format!("{}.{key}", self.place));
        let missing = |key: &str| format!("{}: expected a value, got none", place(key));
        ensure!(counters.contains_key(SURFACES), missing(&format!("counters.{SURFACES}")));
        let named = units.keys().map(String::as_str);
        for key in named {
            let known = key == LEDGER || figures.contains_key(key) || counters.contains_key(key);
            ensure!(known, missing(key));
        }
        let account = |name: &str| power_ledger.accounts.iter().find(|(n, _)| n == name);
        let emitted = account("emitted");
        let (_, emitted) = emitted.with_context(|| missing(&format!("{LEDGER}.emitted")))?;
        let ends = power_ledger.accounts.iter().filter(|(name, _)| is_end(name));
        let found: f64 = ends.map(|(_, share)| share.value).sum();
        ensure!(
            (found - emitted.value).abs() <= ROUNDING * emitted.value,
            "{}: expected accounts that add up to what was emitted, {}, got {found}",
            place(LEDGER),
            emitted.value
        );
        Ok(())
    }

    /// The package and a few paths; `None` of results without them.
    ///
    /// # Errors
    /// A file of another layout.
    pub fn package(&self, folder: &Folder) -> Result<Option<PackageFile>> {
        let name = format!("{}/{}/{}", self.design, self.key, package::FILE);
        let mut files = folder.results().files.iter();
        if files.all(|entry| entry.file != name) {
            return Ok(None);
        }
        let path = self.file(folder, package::FILE)?;
        let shown = path.display();
        let text = std::fs::read(&path).with_context(|| format!("cannot read `{shown}`"))?;
        let json = bsdf::json::parse(&text).with_context(|| format!("`{shown}`"))?;
        let file = serde_json::from_value(json).with_context(|| format!("`{shown}`"))?;
        Ok(Some(file))
    }

    /// The path of a file of the model.
    ///
    /// # Errors
    /// If the results do not list it.
    pub fn file(&self, folder: &Folder, name: &str) -> Result<PathBuf> {
        let file = format!("{}/{}/{name}", self.design, self.key);
        folder.file(&file, &folder.place(&self.place))
    }
}

/// Contents of the folder, of all models.
#[derive(Clone, Copy, Debug)]
pub struct Contents<'a> {
    /// Models.
    pub models: &'a [Model<'a>],
    /// Their far fields.
    pub fields: &'a [FarFieldTable],
    /// Their maps.
    pub maps: &'a [Plane],
    /// Their packages.
    pub packages: &'a [Option<PackageFile>],
}

/// Pictures within the page as they are, as many as it has room for.
#[derive(Debug)]
pub struct Pictures<'a> {
    folder: &'a Folder,
    /// Letters that pictures may still take.
    room: usize,
}

impl<'a> Pictures<'a> {
    /// No picture yet.
    pub fn new(folder: &'a Folder) -> Self {
        Self { folder, room: PICTURES_BUDGET }
    }

    /// Colours over map and angle, of models that have them.
    ///
    /// # Errors
    /// A picture that cannot be read.
    pub fn of_colours(&mut self, models: &[Model]) -> Result<Vec<Value>> {
        let mut pictures = Vec::new();
        for (number, model) in models.iter().enumerate() {
            for (name, words) in [
                ("colour/illuminance.png", "colours of the map"),
                ("colour/far_field.png", "colours over the polar angle"),
            ] {
                let file = format!("{}/{}/{name}", model.design, model.key);
                if self.folder.results().files.iter().any(|listed| listed.file == file) {
                    pictures.extend(self.picture(model, number, name, words)?);
                }
            }
        }
        Ok(pictures)
    }

    /// Maps of `[[receivers]]` and their colours.
    ///
    /// # Errors
    /// A picture that the results do not list, or that cannot be read.
    pub fn of_receivers(&mut self, models: &[Model]) -> Result<Vec<Value>> {
        let mut pictures = Vec::new();
        for (number, model) in models.iter().enumerate() {
            for (name, receiver) in model.entry.receivers.iter().flatten() {
                let is_picture = |file: &&PathBuf| file.extension().is_some_and(|e| e == "png");
                for file in receiver.files.iter().filter(is_picture) {
                    let is_colour = file.starts_with("colour");
                    let quantity = if is_colour { "colours" } else { &receiver.quantity };
                    let mut title = receiver_title(quantity, name);
                    if file.starts_with(BY_ANGLE) {
                        title += " by the angle to the normal";
                    }
                    let parts: Vec<_> = file.iter().map(|part| part.to_string_lossy()).collect();
                    pictures.extend(self.picture(model, number, &parts.join("/"), &title)?);
                }
            }
        }
        Ok(pictures)
    }

    /// The picture in a file of a model; `None` without room.
    fn picture(
        &mut self,
        model: &Model,
        number: usize,
        name: &str,
        title: &str,
    ) -> Result<Option<Value>> {
        let path = model.file(self.folder, name)?;
        let shown = path.display();
        let png = std::fs::read(&path).with_context(|| format!("cannot read `{shown}`"))?;
        let png = BASE64_STANDARD.encode(png);
        let Some(room) = self.room.checked_sub(png.len()) else { return Ok(None) };
        self.room = room;
        let caption = format!("{}, {}: {title}.", model.design, model.label());
        Ok(Some(json!({"png": png, "caption": caption, "model": number})))
    }
}

/// `hybrid, 10 µm` for `hybrid_10um`.
pub fn label(key: &str) -> String {
    let words = key.split('_').map(|word| match word.strip_suffix("um") {
        Some(number) if number.parse::<f64>().is_ok() => format!("{number} µm"),
        _ => word.to_owned(),
    });
    words.collect::<Vec<_>>().join(", ")
}

/// All models: of the designs first, then of those beside them.
///
/// # Errors
/// None at all.
pub fn models(folder: &Folder) -> Result<Vec<Model<'_>>> {
    let results = folder.results();
    let mut all = Vec::new();
    for (group, designs) in [("designs", &results.designs), ("references", &results.references)] {
        for (design, entries) in designs {
            let entries: &ModelEntries = entries;
            let mut of_design: Vec<Model> = entries
                .iter()
                .map(|(key, entry)| Model {
                    design,
                    key,
                    entry,
                    place: format!("{group}.{design}.{key}"),
                })
                .collect();
            of_design.sort_by_key(|model| rank(model.key));
            all.extend(of_design);
        }
    }
    ensure!(!all.is_empty(), "{}: expected at least one design, got none", folder.place("designs"));
    Ok(all)
}

/// Rays before controls before hybrids, coarse before fine: the order of the chapters of the
/// documentation.
fn rank(key: &str) -> (usize, std::cmp::Reverse<u64>) {
    let kinds = ["geometric", "control", "hybrid"];
    let kind = kinds.iter().position(|kind| key.starts_with(kind));
    let digits: String = key.chars().filter(char::is_ascii_digit).collect();
    (kind.unwrap_or(kinds.len()), std::cmp::Reverse(digits.parse().unwrap_or(0)))
}

/// Five digits are more than any standard error here leaves meaning to.
pub fn rounded(value: f64) -> Value {
    let text = format!("{value:.4e}");
    text.parse::<f64>().map_or(Value::Null, Value::from)
}

/// A table of columns, by name.
pub(super) struct Columns(Vec<(String, Vec<f64>)>);

impl Columns {
    pub fn read(path: &Path) -> Result<Self> {
        let shown = path.display();
        let text =
            std::fs::read_to_string(path).with_context(|| format!("cannot read `{shown}`"))?;
        let mut lines = text.lines();
        let names = lines.next().unwrap_or_default().split(',');
        let mut columns: Vec<(String, Vec<f64>)> =
            names.map(|name| (name.to_owned(), Vec::new())).collect();
        for (row, line) in lines.enumerate() {
            let fields: Vec<&str> = line.split(',').collect();
            ensure!(
                fields.len() == columns.len(),
                "`{shown}`: line {}: expected {} fields, got {}",
                row + 2,
                columns.len(),
                fields.len()
            );
            for ((name, values), field) in columns.iter_mut().zip(fields) {
                let number = field.parse::<f64>().ok().filter(|x| x.is_finite());
                values.push(number.with_context(|| {
                    format!("`{shown}`: line {}, {name}: expected a number, got `{field}`", row + 2)
                })?);
            }
        }
        Ok(Self(columns))
    }

    /// The values of the one column whose name begins and ends so, and what is between.
    pub fn find(&self, begin: &str, end: &str) -> Option<&[f64]> {
        let mut found = self
            .0
            .iter()
            .filter(|(name, _)| name.strip_prefix(begin).is_some_and(|rest| rest.ends_with(end)));
        found.next().map(|(_, values)| values.as_slice())
    }
}

/// Names of the curves of a far field, as the columns begin and as people read them.
const CURVES: [(&str, &str); 6] = [
    ("mean_over_azimuth_", "mean over azimuth"),
    ("azimuth_0_", "azimuth 0°"),
    ("azimuth_45_", "azimuth 45°"),
    ("azimuth_90_", "azimuth 90°"),
    ("azimuth_180_", "azimuth 180°"),
    ("azimuth_270_", "azimuth 270°"),
];
/// Half-planes that make one section with the one opposite to them.
const OPPOSITE: [(&str, &str); 2] =
    [("azimuth 0°", "azimuth 180°"), ("azimuth 90°", "azimuth 270°")];

/// The curves of `far_field.csv`, from θ = 0 to 180°.
#[derive(Debug)]
pub struct FarFieldTable {
    /// Unit of the intensity.
    pub unit: Unit,
    /// Azimuthal mean and cuts, as far as there are.
    pub curves: Vec<Curve>,
}

impl FarFieldTable {
    /// Reads the file of a model.
    ///
    /// # Errors
    /// A file that the results do not list, or of another layout.
    pub fn read(model: &Model, folder: &Folder) -> Result<Self> {
        let path = model.file(folder, "far_field.csv")?;
        let shown = path.display();
        let columns = Columns::read(&path)?;
        let units = [Unit::WattPerSteradian, Unit::Candela];
        let unit = units
            .into_iter()
            .find(|unit| columns.find(CURVES[0].0, unit.suffix()).is_some())
            .with_context(|| {
                let column = CURVES[0].0;
                format!("`{shown}`: expected a column `{column}...` in W/sr or cd, got none")
            })?;
        let theta = columns
            .find("theta_deg", "")
            .with_context(|| format!("`{shown}`: expected a column theta_deg"))?;
        let error_end = format!("standard_error_{}", unit.suffix());
        // The value's column is the first that begins so.
        let curves = CURVES.into_iter().filter_map(|(begin, name)| {
            let value = columns.find(begin, unit.suffix())?;
            let error = columns.find(begin, &error_end)?;
            Some(Curve::new(name, theta.to_vec(), value.to_vec(), error.to_vec()))
        });
        let curves = curves.collect::<Result<_>>();
        Ok(Self { unit, curves: curves.with_context(|| format!("`{shown}`"))? })
    }

    /// The curve of this name.
    pub fn curve(&self, name: &str) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.label() == name)
    }

    /// The curve opposite to the one of this name, of light that is not its mirror image.
    pub fn opposite(&self, name: &str) -> Option<&Curve> {
        let (_, opposite) = OPPOSITE.iter().find(|(cut, _)| *cut == name)?;
        self.curve(opposite)
    }

    /// JSON of the curves, in five digits.
    pub fn to_json(&self) -> Value {
        let numbers = |values: &[f64]| values.iter().copied().map(rounded).collect::<Vec<_>>();
        let curve = |c: &Curve| json!({"name": c.label(), "value": numbers(c.value()), "error": numbers(c.standard_error())});
        json!({
            "unit": self.unit.symbol(),
            "theta": self.curves.first().map(Curve::x),
            "curves": self.curves.iter().map(curve).collect::<Vec<_>>(),
            "opposite": OPPOSITE.into_iter().collect::<BTreeMap<_, _>>(),
        })
    }
}

/// A map before it is put into the page.
#[derive(Debug)]
pub struct Plane {
    rows: usize,
    columns: usize,
    /// Middle of the first column and row, mm.
    first_mm: [f64; 2],
    /// Width of a bin along x and y, mm.
    pub bin_mm: [f64; 2],
    /// Unit of the values.
    pub unit: Unit,
    /// Name of the values.
    pub quantity: String,
    value: Vec<f64>,
    error: Vec<f64>,
    /// Bins of the file that one of these stands for, along an edge.
    pub merged: usize,
}

impl Plane {
    /// The map of `illuminance.exr`.
    ///
    /// # Errors
    /// A file that the results do not list, or that cannot be read.
    pub fn read(model: &Model, folder: &Folder) -> Result<Self> {
        let path = model.file(folder, "illuminance.exr")?;
        let contents = exr::read_map(&path)?;
        let d = contents.description;
        let axis = |edges: &[f64]| {
            let bin = (edges[edges.len() - 1] - edges[0]) / (edges.len() - 1) as f64;
            (edges[0] + 0.5 * bin, bin)
        };
        let ((x, dx), (y, dy)) = (axis(&d.columns.edges), axis(&d.rows.edges));
        let unit =
            if d.unit == Unit::Lux.suffix() { Unit::Lux } else { Unit::WattPerSquareMillimetre };
        Ok(Self {
            rows: d.rows.edges.len() - 1,
            columns: d.columns.edges.len() - 1,
            first_mm: [x, y],
            bin_mm: [dx, dy],
            unit,
            quantity: d.quantity,
            value: contents.value.into_iter().map(f64::from).collect(),
            error: contents.standard_error.into_iter().map(f64::from).collect(),
            merged: 1,
        })
    }

    /// Half as many bins along both edges; an odd row or column at the end goes. Standard errors
    /// are those of a bin before: neighbours are smoothed over each other, so that merging them
    /// gains little.
    pub fn halve(&mut self) {
        let (rows, columns) = (self.rows / 2, self.columns / 2);
        let merge = |values: &[f64]| -> Vec<f64> {
            let four = |r: usize, c: usize| {
                let at = |i: usize, j: usize| values[(2 * r + i) * self.columns + 2 * c + j];
                0.25 * (at(0, 0) + at(0, 1) + at(1, 0) + at(1, 1))
            };
            (0..rows * columns).map(|k| four(k / columns, k % columns)).collect()
        };
        (self.value, self.error) = (merge(&self.value), merge(&self.error));
        for axis in 0..2 {
            self.first_mm[axis] += 0.5 * self.bin_mm[axis];
            self.bin_mm[axis] *= 2.0;
        }
        (self.rows, self.columns, self.merged) = (rows, columns, 2 * self.merged);
    }

    /// Largest number of letters that it takes in the page.
    pub fn letters(&self) -> usize {
        let (r, c) = self.kept();
        2 * super::pack::letters(r * c)
    }

    /// True if any light is on it.
    pub fn is_lit(&self) -> bool {
        self.value.iter().any(|value| *value > 0.0)
    }

    /// Smallest positive and largest value of a map's colours.
    pub fn range(&self) -> [f64; 2] {
        map_range(&self.value)
    }

    /// First and last edge along x and y, mm.
    pub fn ends_mm(&self) -> [[f64; 2]; 2] {
        let bins = [self.columns, self.rows];
        std::array::from_fn(|axis| {
            let low = self.first_mm[axis] - 0.5 * self.bin_mm[axis];
            [low, low + bins[axis] as f64 * self.bin_mm[axis]]
        })
    }

    /// The whole map.
    ///
    /// # Errors
    /// A map without extent.
    pub fn to_map(&self) -> Result<Map> {
        let [x, y] = self.ends_mm();
        let axis = |name, [low, high]: [f64; 2], bins| {
            Axis::uniform(Quantity::new(name, Unit::Millimetre), low, high, bins)
        };
        let quantity = Quantity::new(&self.quantity, self.unit);
        let (rows, columns) = (axis("y", y, self.rows)?, axis("x", x, self.columns)?);
        Map::new(quantity, rows, columns, self.value.clone(), self.error.clone())
    }

    /// Rows and columns that are kept: those up to the middle where the others mirror them.
    fn kept(&self) -> (usize, usize) {
        let at = |r: usize, c: usize| self.value[r * self.columns + c];
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-6 * (a.abs() + b.abs());
        let each = || (0..self.rows).flat_map(|r| (0..self.columns).map(move |c| (r, c)));
        let mirrored_rows = each().all(|(r, c)| same(at(r, c), at(self.rows - 1 - r, c)));
        let mirrored_columns = each().all(|(r, c)| same(at(r, c), at(r, self.columns - 1 - c)));
        let half = |count: usize, mirrored: bool| if mirrored { count.div_ceil(2) } else { count };
        (half(self.rows, mirrored_rows), half(self.columns, mirrored_columns))
    }

    /// JSON of values and errors in 65 535 steps of their largest.
    ///
    /// `range` is that of the colours.
    pub fn to_json(&self, range: [f64; 2]) -> Value {
        let (rows, columns) = self.kept();
        let packed = |values: &[f64], full: f64| -> String {
            let one = |k: usize| linear(values[k / columns * self.columns + k % columns], full);
            base64_of_numbers(&(0..rows * columns).map(one).collect::<Vec<_>>())
        };
        let (full_value, full_error) = (largest(&self.value), largest(&self.error));
        json!({
            "rows": self.rows, "columns": self.columns, "keptRows": rows, "keptColumns": columns,
            "first": self.first_mm, "bin": self.bin_mm, "merged": self.merged,
            "range": range, "unit": self.unit.symbol(), "quantity": self.quantity,
            "fullValue": full_value, "fullError": full_error,
            "value": packed(&self.value, full_value), "error": packed(&self.error, full_error),
        })
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::MIN_POSITIVE, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(rows: usize, columns: usize, value: impl Fn(usize, usize) -> f64) -> Plane {
        let all = (0..rows * columns).map(|k| value(k / columns, k % columns));
        Plane {
            rows,
            columns,
            first_mm: [-1.0, -2.0],
            bin_mm: [0.5, 1.0],
            unit: Unit::WattPerSquareMillimetre,
            quantity: "irradiance".to_owned(),
            value: all.collect(),
            error: vec![0.5; rows * columns],
            merged: 1,
        }
    }

    #[test]
    fn labels_and_ranks_follow_keys() {
        assert_eq!(label("hybrid_10um"), "hybrid, 10 µm");
        assert_eq!(label("geometric"), "geometric");
        let mut keys = ["hybrid_10um", "geometric_10um", "control_10um", "geometric_100um"];
        keys.sort_by_key(|key| rank(key));
        assert_eq!(keys, ["geometric_100um", "geometric_10um", "control_10um", "hybrid_10um"]);
    }

    #[test]
    fn mirror_images_are_left_out_and_only_they() {
        let fold = |i: usize, n: usize| i.min(n - 1 - i) as f64;
        let both = plane(4, 5, |r, c| 1.0 + fold(r, 4) + 10.0 * fold(c, 5));
        assert_eq!(both.kept(), (2, 3));
        assert_eq!(plane(4, 5, |r, _| 1.0 + r as f64).kept(), (4, 3));
        assert_eq!(plane(4, 5, |r, c| (r * 5 + c) as f64).kept(), (4, 5));
        let json = both.to_json([1.0, 2.0]);
        assert_eq!(json["value"].as_str().map(str::len), Some(super::super::pack::letters(6)));
        assert_eq!(both.letters(), 2 * super::super::pack::letters(6));
    }

    #[test]
    fn halving_keeps_the_mean_and_the_place() {
        let mut half = plane(4, 6, |r, c| (r * 6 + c) as f64);
        half.halve();
        assert_eq!((half.rows, half.columns, half.merged), (2, 3, 2));
        let same = |got: &[f64], expected: &[f64]| {
            got.len() == expected.len()
                && got.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        let mean = |corner: f64| corner + 0.25 * (0.0 + 1.0 + 6.0 + 7.0);
        let expected = [0.0, 2.0, 4.0, 12.0, 14.0, 16.0].map(mean);
        assert!(same(&half.value, &expected), "{:?}", half.value);
        // The outer edge of the first bin stays where it was.
        assert!(same(&half.first_mm, &[-1.0 + 0.25, -2.0 + 0.5]));
        assert!(same(&half.bin_mm, &[1.0, 2.0]));
        assert!(same(&half.error, &[0.5; 6]));
    }

    #[test]
    fn tables_that_are_none_are_refused_with_line_and_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        for (text, words) in [
            ("a,b\n1,2\n3\n", "line 3: expected 2 fields, got 1"),
            ("a,b\n1,x\n", "line 2, b: expected a number, got `x`"),
        ] {
            std::fs::write(&path, text).unwrap();
            let message = format!("{:#}", Columns::read(&path).err().expect("refused"));
            assert!(message.contains(words), "{message}");
        }
    }
}
