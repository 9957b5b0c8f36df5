// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing zones`: dimming patterns of a backlight, and what a panel before it shows.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;

use arrays::csv::{self, Column};
use arrays::exr;
use design::Design;
use experiment::checked_file::Texts;
use formats::level_image::LevelImage;
use metrics::Estimate;
use metrics::digits::significant;
use metrics::figures::OF_RECEIVER;
use metrics::quantity::{Axis, Map, Quantity, Unit};
use report::plots::{Heading, IlluminanceMap, illuminance_map};
use results::figure_entry::FigureEntry;
use results::zones::{
    BeyondReach, Direct, FILE, Halo, LightSpread, MAPS, Radius, SCHEMA_VERSION, SPREAD, ZonesFile,
};
use runtime::atomic_file::{supersede, write_bytes, write_json};
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use serde_json::json;
use simulate::model::Model;
use simulate::scene_check;
use simulate::warnings::warnings;
use zones::reference::SHARES;
use zones::{Dimmed, Pattern, Request, ZonedDesign};

use super::arguments::{ModelChoice, cache, paths};
use super::outputs::results_writable;
use output::capitalised;

/// Table of the zones.
const TABLE: &str = "zones.csv";
/// Endings of their files.
const ENDINGS: [&str; 3] = ["exr", "npy", "png"];

/// Standard errors between zones and a direct trace that chance does not make.
const CONTRADICTS: f64 = 6.0;

/// `batwing zones`.
#[derive(Debug, Args)]
pub struct ZonesArgs {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Drives of the zones from 0 to 1: rows of numbers, or a grey PNG; the first row is the top
    #[arg(long, value_name = "FILE")]
    pub pattern: PathBuf,
    /// Zones, which divide the packages evenly [default: one for each package]
    #[arg(
        long,
        value_name = "COLUMNSxROWS",
        allow_hyphen_values = true,
        value_parser = columns_and_rows
    )]
    pub zones: Option<[usize; 2]>,
    /// Packages of a larger array, for which those of the design stand [default: those of the
    /// design]
    #[arg(
        long,
        value_name = "COLUMNSxROWS",
        allow_hyphen_values = true,
        value_parser = columns_and_rows
    )]
    pub packages: Option<[usize; 2]>,
    /// Plane or luminance receiver of the design [default: the plane of `[receiver]`]
    #[arg(long, value_name = "NAME")]
    pub receiver: Option<String>,
    /// Largest over smallest transmittance of the panel
    #[arg(long, value_name = "C", default_value_t = 5000.0, value_parser = contrast)]
    pub contrast: f64,
    /// Picture that the panel shows, in a form of the pattern and of any size [default: the pattern]
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// How to compute the responses
    #[arg(long, value_enum, default_value = "geometric")]
    pub model: ModelChoice,
    /// Paths of each response, instead of the design's trace.paths
    #[arg(long, value_name = "N", value_parser = paths)]
    pub paths: Option<u64>,
    /// Also trace the pattern itself, and compare
    #[arg(long, conflicts_with = "packages")]
    pub direct: bool,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "zones")]
    pub out: PathBuf,
    /// Directory that keeps responses for later patterns [default: .batwing-cache beside the
    /// results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// A parser of columns and rows: `48x27`.
fn columns_and_rows(text: &str) -> Result<[usize; 2], String> {
    let number = |text: &str| text.trim().parse().ok().filter(|n: &usize| (1..=10_000).contains(n));
    let both = text.split_once(['x', 'X', '×', ',']);
    let both = both.and_then(|(columns, rows)| Some([number(columns)?, number(rows)?]));
    both.ok_or_else(|| "expected columns and rows from 1 to 10000, such as 48x27".to_owned())
}

/// A parser of contrasts.
fn contrast(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|c: &f64| c.is_finite() && *c >= 1.0);
    number.ok_or_else(|| "expected a number of at least 1".to_owned())
}

/// Adds up the pattern and writes what it gives.
pub fn run(arguments: &ZonesArgs, context: RunContext) -> Result<()> {
    of_design(scene_check::load(&arguments.design)?, &Texts::new(), arguments, context)
}

/// Adds up the pattern on `design` in place of the file that the arguments name; `texts` stand for
/// files of pattern and picture.
///
/// # Errors
/// Those of the command.
pub fn of_design(
    mut design: Design,
    texts: &Texts,
    arguments: &ZonesArgs,
    context: RunContext,
) -> Result<()> {
    if let Some(paths) = arguments.paths {
        design.trace.paths = paths;
    }
    // As of packages that are turned or off their places.
    ensure!(
        arguments.packages.is_none() || !design.array.is_scaled(),
        "--packages: expected none where packages have other sizes (array.scales or the file of positions), which do not repeat"
    );
    let one = arguments.model.one();
    let model = one.context("--model: expected one model, got all")?.available(&design)?;
    let request = Request {
        zones: arguments.zones,
        packages: arguments.packages,
        receiver: arguments.receiver.as_deref(),
    };
    let zoned = ZonedDesign::new(&design, model, request)
        .with_context(|| arguments.design.display().to_string())?;
    let (drives, of_pattern) = levels(&arguments.pattern, texts)?;
    zoned.check_drives(&drives, &of_pattern.file)?;
    let picture = arguments.picture.as_deref().map(|path| picture(path, texts)).transpose()?;
    let mut inputs = design.provenance.inputs();
    inputs.push(of_pattern);
    inputs.extend(picture.as_ref().map(|(_, record)| record.clone()));
    let pattern = Pattern {
        drives: &drives,
        picture: picture.as_ref().map_or(&drives, |(picture, _)| picture),
        contrast: arguments.contrast,
    };
    Command { arguments, design: &design, model, zoned: &zoned, inputs }.compute(pattern, context)
}

/// The levels in a file, or in the text that stands for it.
fn levels(path: &Path, texts: &Texts) -> Result<(LevelImage, FileRecord)> {
    let name = path.display().to_string();
    texts.get(&name).map_or_else(|| LevelImage::read(path), |text| LevelImage::of_text(&name, text))
}

/// The picture in a file.
fn picture(path: &Path, texts: &Texts) -> Result<(LevelImage, FileRecord)> {
    let (picture, record) = levels(path, texts)?;
    ensure!(
        picture.levels.iter().any(|level| *level > 0.0),
        "`{}`: --picture: expected a level above 0, got none",
        record.file
    );
    Ok((picture, record))
}

/// A checked command.
struct Command<'a> {
    arguments: &'a ZonesArgs,
    design: &'a Design,
    model: Model,
    zoned: &'a ZonedDesign<'a>,
    inputs: Vec<FileRecord>,
}

impl Command<'_> {
    fn compute(&self, pattern: Pattern, context: RunContext) -> Result<()> {
        let started = Instant::now();
        for warning in warnings(self.design)? {
            context.console.warn(&warning);
        }
        let out = &self.arguments.out;
        let cache = cache(self.arguments.cache.as_deref(), out);
        let maps = MAPS.iter().flat_map(|map| ENDINGS.map(|ending| format!("{map}.{ending}")));
        let maps: Vec<String> = maps.collect();
        let files = [FILE, TABLE, SPREAD].into_iter().chain(maps.iter().map(String::as_str));
        results_writable(out, [], &files.clone().collect::<Vec<_>>(), Some(&cache))?;
        context.interrupt.note(format!(
            "before {FILE} was written; finished responses stay in `{}`",
            cache.directory().display()
        ));
        let found = self.zoned.dim(pattern, self.arguments.direct, &cache, context)?;
        if found.reference.beyond.as_ref().is_some_and(|beyond| beyond.share.is_none()) {
            context.console.warn(&format!(
                "{}: the light of a package does not fall off within the array of the design, so that no figure is resolved; more packages there and --packages tell more",
                self.design.provenance.file
            ));
        }
        if let Some(direct) = found.direct.as_ref().filter(|direct| direct.largest > CONTRADICTS) {
            context.console.warn(&format!(
                "{}: the zones are {} standard errors off the direct trace at worst: do not rely on them, and please report it",
                self.design.provenance.file,
                significant(direct.largest)
            ));
        }
        supersede(&out.join(FILE))?;
        self.write_tables(&found, pattern)?;
        self.write_maps(&found)?;
        let written = files.skip(1).map(|name| FileRecord::of_output(out, name));
        let written = written.collect::<Result<Vec<_>>>()?;
        let file = self.describe(&found, written, context.seed);
        let json = sealed(serde_json::to_value(&file)?)?;
        write_json(&out.join(FILE), &json)?;
        context.console.result(&json, || {
            let seconds = started.elapsed().as_secs_f64();
            let lines = file.lines().into_iter();
            let lines = lines.map(|(name, words)| format!("{name:<34} {words}\n"));
            let table: String = lines.collect();
            format!("{table}{seconds:.1} s; results in {}", out.display())
        })
    }

    /// Backlight and light behind the panel.
    fn quantities(&self) -> [Quantity; 2] {
        let quantity = &self.zoned.receiver.quantity;
        let named = |name| Quantity::new(format!("{name} {}", quantity.name()), quantity.unit());
        [named("backlight"), named("panel")]
    }

    fn write_tables(&self, found: &Dimmed, pattern: Pattern) -> Result<()> {
        let [columns, rows] = self.zoned.zones;
        // As in the pattern: from the top.
        let order = || (0..rows).rev().flat_map(|j| (0..columns).map(move |i| (i, j)));
        let whole = |name: &str, of: &dyn Fn(usize, usize) -> usize| {
            Column::whole(name, order().map(|(i, j)| of(i, j) as f64).collect())
        };
        let number = |name: &str, of: &dyn Fn(usize, usize) -> f64| {
            Column::plain(name, order().map(|(i, j)| of(i, j)).collect())
        };
        let middle = |axis: usize, k: usize| {
            let [low, length] = self.zoned.places.area_mm(axis);
            low + length * (k as f64 + 0.5) / self.zoned.zones[axis] as f64
        };
        let mut table = vec![
            whole("column", &|i, _| i + 1),
            whole("row", &|_, j| rows - j),
            number("x_mm", &|i, _| middle(0, i)),
            number("y_mm", &|_, j| middle(1, j)),
            number("drive", &|i, j| pattern.drives.levels[j * columns + i]),
        ];
        for (quantity, levels) in self.quantities().iter().zip(&found.zones) {
            let of = |read: &dyn Fn(&Estimate) -> f64| -> Vec<f64> {
                order().map(|(i, j)| read(&levels[j * columns + i])).collect()
            };
            table.push(Column::new(quantity, of(&|level| level.value)));
            table.push(Column::standard_error(quantity, of(&|level| level.standard_error)));
        }
        csv::write_csv(&self.arguments.out.join(TABLE), &table)?;
        let spread = &found.reference.spread;
        let quantity = &self.zoned.receiver.quantity;
        let of_rings = |error: bool| -> Vec<f64> {
            let rings = spread.rings.iter();
            rings.map(|ring| if error { ring.standard_error } else { ring.value }).collect()
        };
        let distance = Quantity::new("distance", Unit::Millimetre);
        let table = [
            Column::new(&distance, spread.distance_mm.clone()),
            Column::new(quantity, of_rings(false)),
            Column::standard_error(quantity, of_rings(true)),
        ];
        csv::write_csv(&self.arguments.out.join(SPREAD), &table)
    }

    fn write_maps(&self, found: &Dimmed) -> Result<()> {
        let frame = &self.zoned.frame;
        let axis = |k: usize| {
            let low = frame.low_mm[k];
            let high = low + frame.bins[k] as f64 * frame.bin_mm[k];
            Axis::uniform(Quantity::new(["x", "y"][k], Unit::Millimetre), low, high, frame.bins[k])
        };
        let [x, y] = [axis(0)?, axis(1)?];
        let provenance = json!({"design": self.design.name, "inputs": self.inputs});
        let [columns, rows] = self.zoned.zones;
        let subtitle = format!("{}, {columns} × {rows} zones", self.design.name);
        let maps = MAPS.iter().zip(self.quantities()).zip(&found.maps);
        let of = capitalised(self.zoned.receiver.quantity.name());
        for ((name, quantity), (value, error)) in maps {
            let map = Map::new(quantity, y.clone(), x.clone(), value.clone(), error.clone())?;
            let path = |ending: &str| self.arguments.out.join(format!("{name}.{ending}"));
            exr::write_map(&path(ENDINGS[0]), &map, &provenance)?;
            csv::write_map_npy(&path(ENDINGS[1]), &map)?;
            let heading = Heading::new(format!("{of}, {name}"), &subtitle);
            let picture = illuminance_map(&IlluminanceMap::plain(&heading, &map))?;
            write_bytes(&path(ENDINGS[2]), &picture.png()?)?;
        }
        Ok(())
    }

    fn describe(&self, found: &Dimmed, files: Vec<FileRecord>, seed: u64) -> ZonesFile {
        let (reference, places) = (&found.reference, &self.zoned.places);
        let radii = SHARES.into_iter().zip(&reference.spread.radii_mm);
        let [column, row] = reference.spread.zone;
        ZonesFile {
            schema_version: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed,
            inputs: self.inputs.clone(),
            files,
            design: self.design.name.clone(),
            model: self.model.key(self.design),
            receiver: self.zoned.receiver.name().to_owned(),
            quantity: self.zoned.receiver.quantity.name().to_owned(),
            unit: self.zoned.receiver.quantity.unit().symbol().to_owned(),
            packages: places.whole,
            free_places: places.are_free(),
            traced_packages: places.traced,
            zones: self.zoned.zones,
            paths: self.design.trace.paths,
            responses: found.responses,
            beyond_reach: reference.beyond.as_ref().map(|beyond| BeyondReach {
                packages: beyond.reach,
                share: beyond.share.map(FigureEntry::new),
            }),
            contrast: self.arguments.contrast,
            white: FigureEntry::new(found.white),
            uniformity: reference
                .uniformity
                .iter()
                .map(|(key, estimate)| {
                    let figure = OF_RECEIVER.into_iter().find(|figure| figure.key == key);
                    let unit = figure.map_or(Unit::Relative, |figure| figure.unit);
                    (key.clone(), FigureEntry::new(*estimate).in_range(unit))
                })
                .collect(),
            groups_of_extremes: reference.groups_of_extremes,
            halo: found.halo.map(|all| {
                let [black, bright, contrast] = all.map(FigureEntry::new);
                Halo { black, bright, contrast }
            }),
            light_spread: LightSpread {
                zone: [column + 1, self.zoned.zones[1] - row],
                centre_mm: reference.spread.centre_mm,
                radii: radii
                    .map(|(share, radius)| Radius {
                        share,
                        radius_mm: radius.map(FigureEntry::new),
                    })
                    .collect(),
            },
            direct: found.direct.map(|direct| Direct {
                zones: self.zoned.zones.iter().product(),
                chi_square: direct.chi_square,
                largest: direct.largest,
            }),
        }
    }
}
