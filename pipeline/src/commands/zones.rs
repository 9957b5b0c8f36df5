// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing zones`: dimming patterns of a backlight, and what a panel before it shows.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, ensure};

use arrays::cache::Cache;
use arrays::csv::{self, Column};
use arrays::exr;
use design::Design;
use experiment::checked_file::Texts;
use metrics::Estimate;
use metrics::digits::significant;
use metrics::figures::OF_RECEIVER;
use metrics::itp;
use metrics::quantity::{Axis, Map, Quantity, Unit};
use report::plots::{Heading, IlluminanceMap, SeenPicture, illuminance_map, seen};
use results::figure_entry::FigureEntry;
use results::sealed_file::SealedFile;
use results::zones::{
    BeyondReach, COLOUR_PICTURES, Direct, FILE, FILM_FOLDER, FILM_TABLE, Halo, HiddenFrom,
    LightSpread, MAPS, Radius, SCHEMA_VERSION, SPREAD, ViewingEntry, ZoneCount, ZonesFile,
};
use runtime::atomic_file::{write_bytes, write_json};
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use serde_json::json;
use simulate::model::Model;
use simulate::scene_check;
use simulate::warnings::warnings;
use zones::full_drive::{Channels, FullDrive};
use zones::pattern_colours::PatternColours;
use zones::reference::SHARES;
use zones::wide::WideDesign;
use zones::{Array, Dimmed, Request, ZonedDesign};

use super::arguments::cache;
use super::outputs::results_writable;
use super::zone_film::Film;
pub use super::zone_options::ZonesArgs;
use super::zone_pictures::{COLOUR_ARRAYS, Frame, PAINTED, Pictures};
use output::capitalised;

/// Table of the zones.
const TABLE: &str = "zones.csv";
/// Endings of their files.
const ENDINGS: [&str; 3] = ["exr", "npy", "png"];

/// Standard errors between zones and a direct trace that chance does not make.
const CONTRADICTS: f64 = 6.0;

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
    let one = arguments.model.one();
    let model = one.context("--model: expected one model, got all")?.available(&design)?;
    ensure!(
        arguments.compare_zones.is_empty() || arguments.levels.is_some(),
        "--compare-zones: expected --levels RULE and --picture FILE, which give drives to any zones, got --pattern"
    );
    let request = Request {
        zones: arguments.zones,
        packages: arguments.packages,
        receiver: arguments.receiver.as_deref(),
    };
    let file = || arguments.design.display().to_string();
    let wide = WideDesign::new(&design, model, request).with_context(file)?;
    let zoned_by = |zones| ZonedDesign::new(&wide, model, Request { zones, ..request });
    let zoned = zoned_by(request.zones).with_context(file)?;
    let command = |zoned| -> Result<Command> {
        let pictures = Pictures::new((arguments, texts), zoned)?;
        Ok(Command { arguments, design: &design, model, zoned, pictures })
    };
    let first = command(&zoned)?;
    ensure!(
        arguments.compare_zones.is_empty() || first.pictures.files.len() == 1,
        "--compare-zones: expected one --picture, got a folder of {}",
        first.pictures.files.len()
    );
    let mut known = vec![zoned.zones];
    for [columns, rows] in &arguments.compare_zones {
        ensure!(
            !known.contains(&[*columns, *rows]),
            "--compare-zones: expected other zones than those of --zones, each once, got {columns} x {rows} again"
        );
        known.push([*columns, *rows]);
    }
    let other = |zones: &[usize; 2]| {
        let option = || format!("--compare-zones {}x{}", zones[0], zones[1]);
        zoned_by(Some(*zones)).with_context(option).with_context(file)
    };
    let others = arguments.compare_zones.iter().map(other).collect::<Result<Vec<_>>>()?;
    let others = others.iter().map(command).collect::<Result<Vec<_>>>()?;
    first.compute(&others, context)
}

/// A checked command.
struct Command<'a> {
    arguments: &'a ZonesArgs,
    design: &'a Design,
    model: Model,
    zoned: &'a ZonedDesign<'a>,
    pictures: Pictures<'a>,
}

impl Command<'_> {
    /// Computes all, and beside it the halo of the same picture in the zones of `others`.
    fn compute(&self, others: &[Self], context: RunContext) -> Result<()> {
        let started = Instant::now();
        for warning in warnings(self.design)? {
            context.console.warn(&warning);
        }
        let states_black = self.design.sub_pixels().iter().any(|of| of.black.is_some());
        if self.arguments.contrast.is_some() && states_black {
            context.console.warn(&format!(
                "{}: panel.sub_pixels: a stated `black` stays, whatever --contrast",
                self.design.provenance.file
            ));
        }
        if self.zoned.places.is_narrow() {
            context.console.warn(&format!(
                "{}: --packages: responses are traced among the packages of the design alone, whose walls send back what would lie farther out: something in it does not repeat, or takes too much memory; solids that stand once stand beside each package that the middle one stands for (docs/guide/backlight.md, section 8)",
                self.design.provenance.file
            ));
        }
        if self.zoned.passes_over_tolerance() {
            context.console.warn(&format!(
                "{}: sources.spectrum.tolerance: zones take three wavelengths of a light, whatever its tolerance, and their errors do not hold what that leaves out; `samples` states more",
                self.design.provenance.file
            ));
        }
        let out = &self.arguments.out;
        let cache = cache(self.arguments.cache.as_deref(), out);
        let files = self.files();
        let names: Vec<&str> = files.iter().map(String::as_str).collect();
        let is_film = self.pictures.files.len() > 1;
        let folder = is_film.then(|| PathBuf::from(FILM_FOLDER));
        results_writable(out, folder, &names, Some(&cache))?;
        context.interrupt.note(format!(
            "before {FILE} was written; finished responses stay in `{}`",
            cache.directory().display()
        ));
        let by_zones = self.by_zones(others, &cache, context)?;
        let (array, full) = self.light(&cache, context)?;
        let frame = self.shown(&array, full.as_ref(), &cache, context)?;
        let found = &frame.dimmed;
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
        self.pictures.write_colours(&frame)?;
        self.write_tables(found, &frame.drives)?;
        self.write_maps(found)?;
        let mut empty = Vec::new();
        if let (Some(full), Some(colours)) = (&full, &found.colours) {
            empty = self.draw_colours(full.white_figures().luminance.value, colours)?;
        }
        let drawn = names.iter().skip(1).filter(|name| !empty.iter().any(|one| one == *name));
        let written = drawn.map(|name| FileRecord::of_output(out, name));
        let written = written.collect::<Result<Vec<_>>>()?;
        let patterns = full.as_ref().filter(|_| self.arguments.test_patterns);
        let patterns = patterns
            .map(|full| self.pictures.test_patterns(&array, full, &cache, context))
            .transpose()?;
        let colour = full.map(|full| self.pictures.colour_entry(&full, (&frame, patterns)));
        let halo_hidden_from = HiddenFrom::new(&by_zones);
        let file = self.describe(found, written, context.seed);
        let file = ZonesFile { colour, by_zones, halo_hidden_from, ..file };
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

    /// Light of the packages, and where there are colours the panel at full drive.
    fn light(&self, cache: &Cache, context: RunContext) -> Result<(Array<'_>, Option<FullDrive>)> {
        let array = self.zoned.light(cache, context)?;
        if !self.zoned.has_colours() {
            return Ok((array, None));
        }
        let names = self.design.channels();
        let channels = Channels { names: &names, white: self.arguments.white };
        let panel = (self.design.panel.as_ref(), self.pictures.contrast);
        let drive = array.full_drive_of(panel, channels, (cache, context))?;
        Ok((array.driven_by(&drive), Some(drive)))
    }

    /// The picture in these zones and those of `others`, the fewest first; its halo is in the same places
    /// in all.
    fn by_zones(
        &self,
        others: &[Self],
        cache: &Cache,
        context: RunContext,
    ) -> Result<Vec<ZoneCount>> {
        let mut all: Vec<&Self> = others.iter().chain([self]).collect();
        all.sort_by_key(|of| of.zoned.zones.iter().product::<usize>());
        let fewest = all[0].zoned.zones;
        let count = |of: &&Self| -> Result<ZoneCount> {
            context.interrupt.check()?;
            let zones @ [columns, rows] = of.zoned.zones;
            context.console.say(&format!("in {columns} x {rows} zones"));
            let (array, full) = of.light(cache, context)?;
            let picture = of.pictures.files.first().map(PathBuf::as_path);
            let at = (picture, Some(fewest));
            let frame = of.pictures.frame(at, &array, full.as_ref(), cache, context)?;
            of.check_lit(&frame)?;
            let found = &frame.dimmed;
            Ok(ZoneCount {
                zones,
                contrast: found.halo.map(|[.., contrast]| FigureEntry::bounded(contrast)),
                hidden: found.hidden.map(FigureEntry::share),
                missing: found.colours.as_ref().and_then(|of| of.missing).map(FigureEntry::share),
                power_share: frame.power_share,
            })
        };
        if others.is_empty() { Ok(Vec::new()) } else { all.iter().map(count).collect() }
    }

    /// Refuses a rule by which the picture lights no zone.
    fn check_lit(&self, frame: &Frame) -> Result<()> {
        let [columns, rows] = self.zoned.zones;
        ensure!(
            frame.drives.iter().flatten().any(|drive| *drive > 0.0),
            "--levels: expected a rule by which the first picture lights one of {columns} x {rows} zones, got drives of 0 alone"
        );
        Ok(())
    }

    /// Shows all pictures, and writes the table and the pictures of several; the first.
    fn shown(
        &self,
        array: &Array,
        full: Option<&FullDrive>,
        cache: &Cache,
        context: RunContext,
    ) -> Result<Frame> {
        let out = &self.arguments.out;
        let is_film = self.pictures.files.len() > 1;
        let (mut first, mut film) = (None, Film::default());
        for number in 0..self.pictures.files.len().max(1) {
            context.interrupt.check()?;
            let path = self.pictures.files.get(number);
            let frame = self.pictures.frame(
                (path.map(PathBuf::as_path), None),
                array,
                full,
                cache,
                context,
            )?;
            if first.is_none() {
                self.check_lit(&frame)?;
                ZonesFile::remove_earlier(out, &self.pictures.inputs)?;
            }
            if let Some(path) = path.filter(|_| is_film) {
                let name = path.file_name().unwrap_or_default();
                context.console.say(&format!(
                    "picture {} of {}: {}",
                    number + 1,
                    self.pictures.files.len(),
                    name.display()
                ));
                film.add(&name.to_string_lossy(), &frame, out)?;
            }
            first.get_or_insert(frame);
        }
        if is_film {
            film.write(out, &self.zoned.receiver.quantity)?;
        }
        first.context("no picture")
    }

    /// Files under the directory of results, the sealed one first.
    fn files(&self) -> Vec<String> {
        let maps = MAPS.iter().flat_map(|map| ENDINGS.map(|ending| format!("{map}.{ending}")));
        let mut files: Vec<String> = [FILE, TABLE, SPREAD].map(str::to_owned).to_vec();
        files.extend(maps);
        if self.zoned.has_colours() {
            files.extend(COLOUR_ARRAYS.map(str::to_owned));
        }
        if self.pictures.has_sub_pixels() {
            files.push(PAINTED.to_owned());
            let drawn = if self.pictures.is_absolute() {
                &COLOUR_PICTURES[..]
            } else {
                &COLOUR_PICTURES[..1]
            };
            files.extend(drawn.iter().map(|name| format!("{name}.png")));
        }
        if self.pictures.files.len() > 1 {
            files.push(FILM_TABLE.to_owned());
            let names = self.pictures.files.iter().filter_map(|path| path.file_name());
            let painted = names.filter(|_| self.pictures.has_sub_pixels());
            files.extend(painted.map(|name| format!("{FILM_FOLDER}/{}", name.to_string_lossy())));
        }
        files
    }

    /// Backlight and light behind the panel.
    fn quantities(&self) -> [Quantity; 2] {
        let quantity = &self.zoned.receiver.quantity;
        let named = |name| Quantity::new(format!("{name} {}", quantity.name()), quantity.unit());
        [named("backlight"), named("panel")]
    }

    fn write_tables(&self, found: &Dimmed, drives: &[Vec<f64>]) -> Result<()> {
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
        ];
        let names = self.design.channels();
        for (name, drives) in names.iter().zip(drives) {
            let name = if names.len() > 1 { format!("drive_{name}") } else { "drive".to_owned() };
            table.push(number(&name, &|i, j| drives[j * columns + i]));
        }
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

    /// Axes along x and y.
    fn axes(&self) -> Result<[Axis; 2]> {
        let frame = &self.zoned.frame;
        let axis = |k: usize| {
            let low = frame.low_mm[k];
            let high = low + frame.bins[k] as f64 * frame.bin_mm[k];
            Axis::uniform(Quantity::new(["x", "y"][k], Unit::Millimetre), low, high, frame.bins[k])
        };
        Ok([axis(0)?, axis(1)?])
    }

    /// Pictures of what a panel of sub-pixels shows, with this luminance of white; in cd/m² also
    /// ΔE_ITP of halo and panel, but those that are 0 everywhere, whose names it gives.
    fn draw_colours(&self, white: f64, colours: &PatternColours) -> Result<Vec<String>> {
        let mut empty = Vec::new();
        if colours.wanted.is_empty() {
            return Ok(empty);
        }
        let [x, y] = self.axes()?;
        let size = self.zoned.frame.bins;
        let file = |k: usize| format!("{}.png", COLOUR_PICTURES[k]);
        let path = |k: usize| self.arguments.out.join(file(k));
        let [backlight, panel] = &colours.xyz;
        let pictures = [("picture", &colours.wanted), ("backlight", backlight), ("panel", panel)];
        let pictures = pictures.map(|(name, xyz)| SeenPicture { name, size, xyz });
        let heading = Heading::new("As it looks".to_owned(), &self.design.name);
        let exposure = (white, &self.zoned.receiver.quantity);
        write_bytes(&path(0), &seen(&heading, [&x, &y], &pictures, exposure)?.png()?)?;
        if !self.pictures.is_absolute() {
            return Ok(empty);
        }
        let pairs = || colours.wanted.iter().zip(panel);
        let error: Vec<f64> = pairs().map(|(a, b)| itp::difference(*a, *b)).collect();
        let halo =
            pairs().zip(&error).map(|((wanted, _), e)| if wanted[1] > 0.0 { 0.0 } else { *e });
        for (k, values) in [(1, halo.collect::<Vec<f64>>()), (2, error.clone())] {
            if values.iter().all(|value| *value == 0.0) {
                empty.push(file(k));
                continue;
            }
            let quantity = Quantity::new("difference ITP", Unit::Relative);
            let none = vec![0.0; error.len()];
            let map = Map::new(quantity, y.clone(), x.clone(), values, none)?;
            let heading = Heading::new(capitalised(COLOUR_PICTURES[k]), &self.design.name);
            let picture = illuminance_map(&IlluminanceMap::plain(&heading, &map))?;
            write_bytes(&path(k), &picture.png()?)?;
        }
        Ok(empty)
    }

    fn write_maps(&self, found: &Dimmed) -> Result<()> {
        let [x, y] = self.axes()?;
        let provenance = json!({"design": self.design.name, "inputs": self.pictures.inputs});
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
            inputs: self.pictures.inputs.clone(),
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
                share: beyond.share.map(FigureEntry::share),
                walls: beyond.walls.map(FigureEntry::share),
            }),
            contrast: self.pictures.contrast,
            white: FigureEntry::bounded(found.white),
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
                let [black, bright, contrast] = all.map(FigureEntry::bounded);
                Halo {
                    black,
                    bright,
                    contrast,
                    hidden: found.hidden.map(FigureEntry::share),
                    viewing: self.arguments.viewing().map(|eye| ViewingEntry {
                        distance_mm: eye.distance_mm,
                        age_years: eye.observer.age_years,
                        pigment: eye.observer.pigment,
                    }),
                }
            }),
            light_spread: LightSpread {
                zone: [column + 1, self.zoned.zones[1] - row],
                centre_mm: reference.spread.centre_mm,
                radii: radii
                    .map(|(share, radius)| Radius {
                        share,
                        radius_mm: radius.map(FigureEntry::bounded),
                    })
                    .collect(),
            },
            direct: found.direct.map(|direct| Direct {
                zones: self.zoned.zones.iter().product(),
                chi_square: direct.chi_square,
                largest: direct.largest,
            }),
            colour: None,
            by_zones: Vec::new(),
            halo_hidden_from: None,
        }
    }
}
