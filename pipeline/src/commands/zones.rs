// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing zones`: dimming patterns of a backlight, and what a panel before it shows.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;

use arrays::cache::Cache;
use arrays::csv::{self, Column};
use arrays::exr;
use design::Design;
use design::resolved::panel::CONTRAST;
use experiment::checked_file::Texts;
use formats::level_image::{ColourImage, LevelImage, png_of_rgb};
use metrics::Estimate;
use metrics::digits::significant;
use metrics::figures::OF_RECEIVER;
use metrics::gamut::{D65, Primaries};
use metrics::quantity::{Axis, Map, Quantity, Unit};
use metrics::transfer::Transfer;
use report::plots::{Heading, IlluminanceMap, illuminance_map};
use results::figure_entry::FigureEntry;
use results::zones::{
    BeyondReach, ChannelEntry, ColourEntry, ColourOfLight, Direct, FILE, GamutEntry, Halo,
    LevelsEntry, LightSpread, MAPS, Radius, SCHEMA_VERSION, SPREAD, ZonesFile,
};
use runtime::atomic_file::{supersede, write_bytes, write_json};
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use serde_json::json;
use simulate::model::Model;
use simulate::scene_check;
use simulate::warnings::warnings;
use zones::colour::{ColourEstimate, ColourFigures, FullDrive, PictureLight, painted};
use zones::levels::{Needs, Rule, check_size, from_picture, power_share};
use zones::reference::SHARES;
use zones::{Array, Dimmed, Pattern, Request, ZonedDesign};

use super::arguments::{ModelChoice, cache, paths};
use super::outputs::results_writable;
use super::zone_inputs::{
    Drives, PictureGamut, check_lit, colour_space, colours, columns_and_rows, contrast, drives,
    levels, pictures, rule, rule_name, share, transfer, transfer_name, white,
};
use output::capitalised;

/// Table of the zones.
const TABLE: &str = "zones.csv";
/// Arrays of X, Y and Z of the maps, and what the panel shows.
const COLOUR_ARRAYS: [&str; 2] = ["backlight_xyz.npy", "panel_xyz.npy"];
const PAINTED: &str = "panel_picture.png";
/// Table of several pictures, and the folder of what the panel shows of them.
const FILM_TABLE: &str = "film.csv";
const FILM_FOLDER: &str = "film";
const FILM_COLUMNS: [&str; 10] = [
    "picture",
    "panel_mean",
    "panel_largest_zone",
    "power_share",
    "halo_black",
    "halo_black_standard_error",
    "halo_contrast",
    "halo_contrast_standard_error",
    "missing",
    "leaking",
];
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
    /// Drives of the zones from 0 to 1: rows of numbers, or a PNG; the first row is the top. Once for
    /// all channels, or CHANNEL=FILE for each
    #[arg(long, value_name = "FILE", required_unless_present = "levels")]
    pub pattern: Vec<String>,
    /// White of the panel at full drive, which the levels of three channels give with the most light:
    /// x and y, or a temperature of daylight, below 4000K of a radiator [default: all channels at 1]
    #[arg(long, value_name = "X,Y|KELVIN", value_parser = white)]
    pub white: Option<[f64; 2]>,
    /// Drives from the picture in place of a pattern: max, mean, rms or percentile=P of what the
    /// pixels of a zone need
    #[arg(
        long,
        value_name = "RULE",
        requires = "picture",
        conflicts_with = "pattern",
        value_parser = rule
    )]
    pub levels: Option<Rule>,
    /// Largest power of these drives over that of full white, which lowers them all
    #[arg(long, value_name = "SHARE", requires = "levels", default_value_t = 1.0, value_parser = share)]
    pub power_limit: f64,
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
    /// Largest over smallest transmittance of the panel [default: that of [panel], else 5000]
    #[arg(long, value_name = "C", value_parser = contrast)]
    pub contrast: Option<f64>,
    /// Picture that the panel shows, in a form of the pattern and of any size, with sub-pixels in
    /// colours; of a folder all PNG files by name [default: the pattern]
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// Light of the levels of a picture on sub-pixels: srgb, linear, pq or gamma=G [default: that of
    /// the file, else srgb; linear of grey]
    #[arg(long, value_name = "NAME", value_parser = transfer)]
    pub transfer: Option<Transfer>,
    /// Primaries of a picture on sub-pixels [default: those of the file, else bt709]
    #[arg(long, value_enum)]
    pub gamut: Option<PictureGamut>,
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
    let request = Request {
        zones: arguments.zones,
        packages: arguments.packages,
        receiver: arguments.receiver.as_deref(),
    };
    let zoned = ZonedDesign::new(&design, model, request)
        .with_context(|| arguments.design.display().to_string())?;
    let command = Command::new((arguments, texts), &design, model, &zoned)?;
    command.compute(context)
}

/// A picture on the panel.
enum Picture {
    /// Levels as light.
    Grey(LevelImage),
    /// Colours with their primaries and transfer.
    Colours(ColourImage, (Primaries, Transfer)),
}

/// A checked command.
struct Command<'a> {
    arguments: &'a ZonesArgs,
    texts: &'a Texts,
    design: &'a Design,
    model: Model,
    zoned: &'a ZonedDesign<'a>,
    contrast: f64,
    inputs: Vec<FileRecord>,
    /// Drives of a pattern; none where pictures give them.
    drives: Option<Drives>,
    /// Files of pictures; none where the pattern is the picture.
    pictures: Vec<PathBuf>,
}

/// What one picture gives.
struct Frame {
    found: Dimmed,
    /// Drives by channel.
    drives: Vec<Vec<f64>>,
    needs: Option<Needs>,
    colour_space: Option<(Primaries, Transfer)>,
    power_share: f64,
    /// What the panel shows, as PNG.
    painted: Option<Vec<u8>>,
}

impl<'a> Command<'a> {
    fn new(
        (arguments, texts): (&'a ZonesArgs, &'a Texts),
        design: &'a Design,
        model: Model,
        zoned: &'a ZonedDesign<'a>,
    ) -> Result<Self> {
        let stated = &arguments.pattern;
        let channels = design.channels();
        let drives = (!stated.is_empty()).then(|| drives(stated, &channels, zoned, texts));
        let drives = drives.transpose()?;
        let file = &design.provenance.file;
        ensure!(
            arguments.white.is_none() || zoned.has_colours(),
            "--white: expected a design with several channels of [[sources]] or [panel] sub_pixels, got `{file}` without"
        );
        ensure!(
            !(arguments.direct && zoned.has_colours()),
            "--direct: expected none with channels or [panel] sub_pixels"
        );
        let pictures = arguments.picture.as_deref().map(pictures).transpose()?.unwrap_or_default();
        let has_picture = !pictures.is_empty() || drives.as_ref().is_some_and(|d| d.grey.is_some());
        ensure!(has_picture, "--picture: expected one beside a pattern for each channel, got none");
        let of_panel = design.panel.as_ref().map(|panel| panel.contrast);
        let mut command = Self {
            contrast: arguments.contrast.or(of_panel).unwrap_or(CONTRAST),
            inputs: design.provenance.inputs(),
            arguments,
            texts,
            design,
            model,
            zoned,
            drives,
            pictures,
        };
        command.inputs.extend(command.drives.iter().flat_map(|drives| drives.inputs.clone()));
        if let Some(white) = arguments.white {
            // Before anything is traced: channels keep their colours on their way, but for dispersion.
            let mut drive = zoned.emitted_drive(command.contrast);
            drive.levels(white, &channels).with_context(|| file.clone())?;
        }
        // All are read before anything is traced or written.
        let mut size = None;
        for (number, path) in command.pictures.iter().enumerate() {
            let (picture, record) = command.picture(path, number > 0)?;
            let found = match &picture {
                Picture::Grey(image) => [image.columns, image.rows],
                Picture::Colours(image, _) => [image.columns, image.rows],
            };
            let [columns, rows] = *size.get_or_insert(found);
            ensure!(
                found == [columns, rows],
                "`{}`: --picture: expected {columns} x {rows} pixels as in the first, got {} x {}",
                record.file,
                found[0],
                found[1]
            );
            if arguments.levels.is_some() {
                check_size(found, zoned.zones, &record.file)?;
            }
            command.inputs.push(record);
        }
        Ok(command)
    }

    fn has_sub_pixels(&self) -> bool {
        self.design.panel.as_ref().is_some_and(|panel| !panel.sub_pixels.is_empty())
    }

    /// True if levels are cd/m².
    fn is_absolute(&self) -> bool {
        let unit = self.zoned.receiver.quantity.unit();
        self.design.emitted.is_some() && unit == Unit::CandelaPerSquareMetre
    }

    /// The picture in a file; of a film some may be dark.
    fn picture(&self, path: &Path, may_be_dark: bool) -> Result<(Picture, FileRecord)> {
        if !self.has_sub_pixels() {
            let (image, record) = levels(path, self.texts)?;
            check_lit(may_be_dark || image.levels.iter().any(|level| *level > 0.0), &record.file)?;
            return Ok((Picture::Grey(image), record));
        }
        let (image, record) = colours(path, self.texts)?;
        check_lit(
            may_be_dark || image.levels.iter().flatten().any(|level| *level > 0),
            &record.file,
        )?;
        Ok((self.coloured(image, &record.file)?, record))
    }

    fn coloured(&self, image: ColourImage, file: &str) -> Result<Picture> {
        let stated = (self.arguments.gamut, self.arguments.transfer);
        let space = colour_space(&image, file, stated)?;
        ensure!(
            space.1.peak_cd_m2().is_none() || self.is_absolute(),
            "`{file}`: --transfer: expected srgb, linear or gamma=G where levels are not in cd/m², got pq; a luminance --receiver and led.power_w make them so"
        );
        Ok(Picture::Colours(image, space))
    }

    fn compute(&self, context: RunContext) -> Result<()> {
        let started = Instant::now();
        for warning in warnings(self.design)? {
            context.console.warn(&warning);
        }
        let out = &self.arguments.out;
        let cache = cache(self.arguments.cache.as_deref(), out);
        let files = self.files();
        let names: Vec<&str> = files.iter().map(String::as_str).collect();
        let is_film = self.pictures.len() > 1;
        let folder = is_film.then(|| PathBuf::from(FILM_FOLDER));
        results_writable(out, folder, &names, Some(&cache))?;
        context.interrupt.note(format!(
            "before {FILE} was written; finished responses stay in `{}`",
            cache.directory().display()
        ));
        let mut array = self.zoned.light(&cache, context)?;
        let mut full = None;
        if self.zoned.has_colours() {
            let panel = self.design.panel.as_ref();
            let mut drive = array.full_drive_of(panel, self.contrast, (&cache, context))?;
            let channels = self.design.channels();
            let levels = match self.arguments.white {
                Some(white) => drive.levels(white, &channels)?,
                None => vec![1.0; channels.len()],
            };
            array.set(&drive);
            full = Some((drive, levels));
        }
        let (mut first, mut film) = (None, Vec::new());
        for number in 0..self.pictures.len().max(1) {
            context.interrupt.check()?;
            let path = self.pictures.get(number);
            let frame =
                self.frame(path.map(PathBuf::as_path), &array, full.as_ref(), &cache, context)?;
            if first.is_none() {
                ensure!(
                    frame.drives.iter().flatten().any(|drive| *drive > 0.0),
                    "--levels: expected a rule by which the first picture lights a zone, got drives of 0 alone"
                );
                supersede(&out.join(FILE))?;
            }
            if let Some(path) = path.filter(|_| is_film) {
                let name = path.file_name().unwrap_or_default();
                context.console.say(&format!(
                    "picture {} of {}: {}",
                    number + 1,
                    self.pictures.len(),
                    name.display()
                ));
                if let Some(painted) = &frame.painted {
                    let folder = out.join(FILM_FOLDER);
                    std::fs::create_dir_all(&folder)
                        .with_context(|| format!("cannot create `{}`", folder.display()))?;
                    write_bytes(&folder.join(name), painted)?;
                }
                film.push(self.film_row(&name.to_string_lossy(), &frame));
            }
            first.get_or_insert(frame);
        }
        let frame = first.context("no picture")?;
        let found = &frame.found;
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
        if is_film {
            csv::write_text_csv(&out.join(FILM_TABLE), &FILM_COLUMNS, &film)?;
        }
        self.write_colours(&frame)?;
        self.write_tables(found, &frame.drives)?;
        self.write_maps(found)?;
        let written = names.iter().skip(1).map(|name| FileRecord::of_output(out, name));
        let written = written.collect::<Result<Vec<_>>>()?;
        let colour = full.map(|full| self.colour_entry(&full, &frame));
        let file = ZonesFile { colour, ..self.describe(found, written, context.seed) };
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

    /// Files under the directory of results, the sealed one first.
    fn files(&self) -> Vec<String> {
        let maps = MAPS.iter().flat_map(|map| ENDINGS.map(|ending| format!("{map}.{ending}")));
        let mut files: Vec<String> = [FILE, TABLE, SPREAD].map(str::to_owned).to_vec();
        files.extend(maps);
        if self.zoned.has_colours() {
            files.extend(COLOUR_ARRAYS.map(str::to_owned));
        }
        if self.has_sub_pixels() {
            files.push(PAINTED.to_owned());
        }
        if self.pictures.len() > 1 {
            files.push(FILM_TABLE.to_owned());
            let names = self.pictures.iter().filter_map(|path| path.file_name());
            let painted = names.filter(|_| self.has_sub_pixels());
            files.extend(painted.map(|name| format!("{FILM_FOLDER}/{}", name.to_string_lossy())));
        }
        files
    }

    /// Light of one picture, or of the pattern.
    fn frame(
        &self,
        path: Option<&Path>,
        array: &Array,
        full: Option<&(FullDrive, Vec<f64>)>,
        cache: &Cache,
        context: RunContext,
    ) -> Result<Frame> {
        let (picture, file) = match path {
            Some(path) => {
                self.picture(path, true).map(|(picture, record)| (picture, record.file))?
            }
            None => {
                let grey = self.drives.as_ref().and_then(|drives| drives.grey.clone());
                let grey = grey.context("--picture: expected one, got none")?;
                let file = self.arguments.pattern[0].clone();
                let picture = match self.has_sub_pixels() {
                    true => self.coloured(ColourImage::grey(&grey), &file)?,
                    false => Picture::Grey(grey),
                };
                (picture, file)
            }
        };
        let (image, light, space) = match picture {
            Picture::Grey(image) => (image, None, None),
            Picture::Colours(image, space) => {
                let white = full.map_or(D65, |(full, _)| full.white_xy());
                let light = PictureLight::new(&image, (&space.0, space.1), white);
                (LevelImage { columns: 1, rows: 1, levels: vec![0.0] }, Some(light), Some(space))
            }
        };
        let powers = self.powers(full.map(|(_, levels)| &levels[..]));
        let mut needs = None;
        let drives = match (&self.drives, self.arguments.levels) {
            (Some(drives), _) => drives.levels.clone(),
            (None, rule) => {
                let rule = rule.context("--levels: expected a rule or a pattern, got neither")?;
                let grey = || PictureLight::grey(&image);
                let picture = light.as_ref().map_or_else(|| Cow::Owned(grey()), Cow::Borrowed);
                let of = match (full, space) {
                    (Some((full, _)), Some((primaries, transfer))) => {
                        full.needs(&primaries, transfer, powers.len())?
                    }
                    _ => Needs::GREY,
                };
                needs = Some(of);
                let limit = self.arguments.power_limit;
                let (rule, zones) = ((rule, of), self.zoned.zones);
                from_picture(&picture, zones, rule, (&powers, limit))
            }
        };
        let on_panel = match (&light, full, space) {
            (Some(light), Some((full, _)), Some((_, transfer))) => full.show(light, transfer),
            _ => None,
        };
        let pattern = Pattern {
            drives: &drives,
            picture: &image,
            contrast: self.contrast,
            colours: on_panel.as_ref(),
        };
        let found = self.zoned.dim(array, pattern, self.arguments.direct, cache, context)?;
        let painted = match (&on_panel, &found.colours, full) {
            (Some(on_panel), Some(colours), Some((full, _))) => {
                let area = [0, 1].map(|axis| self.zoned.places.area_mm(axis));
                let place = (&self.zoned.frame, area);
                let rgb = painted(colours, place, on_panel, full.white_xy());
                Some(png_of_rgb(on_panel.picture.columns, &rgb)?)
            }
            _ => None,
        };
        let power_share = power_share(&drives, &powers);
        Ok(Frame { found, needs, colour_space: space, power_share, painted, drives })
    }

    /// Light that each channel emits at its level of full drive.
    fn powers(&self, levels: Option<&[f64]>) -> Vec<f64> {
        let mut powers = vec![0.0; self.design.channels().len()];
        for light in &self.design.colour_lights().lights {
            powers[self.design.channel_of(light)] += light.emitted_w;
        }
        let levels = levels.unwrap_or(&[1.0]).iter();
        powers.iter_mut().zip(levels).for_each(|(power, level)| *power *= level);
        powers
    }

    /// Electrical power of all packages at this share of full white, W.
    fn power_w(&self, share: f64, levels: &[f64]) -> Option<f64> {
        let of_package = self.design.emitted?.electrical_w?;
        let [all, white]: [f64; 2] =
            [&vec![1.0; levels.len()], levels].map(|l| self.powers(Some(l)).iter().sum());
        Some(of_package * self.zoned.places.count() as f64 * share * white / all)
    }

    /// A row of [`FILM_COLUMNS`].
    fn film_row(&self, name: &str, frame: &Frame) -> Vec<String> {
        let found = &frame.found;
        let zones = &found.zones[1];
        let mean = zones.iter().map(|zone| zone.value).sum::<f64>() / zones.len() as f64;
        let largest = zones.iter().map(|zone| zone.value).fold(0.0, f64::max);
        let halo = found.halo.map(|[black, _, contrast]| [black, contrast]);
        let of = |k: usize, read: fn(&Estimate) -> f64| halo.map(|halo| read(&halo[k]));
        let of_panel = found.colours.as_ref().map(|colours| [colours.missing, colours.leaking]);
        let numbers = [
            Some(mean),
            Some(largest),
            Some(frame.power_share),
            of(0, |halo| halo.value),
            of(0, |halo| halo.standard_error),
            of(1, |halo| halo.value),
            of(1, |halo| halo.standard_error),
            of_panel.map(|panel| panel[0].value),
            of_panel.map(|panel| panel[1].value),
        ];
        let text = |number: Option<f64>| {
            let number = number.filter(|number| number.is_finite());
            number.map_or_else(String::new, |number| format!("{number:?}"))
        };
        std::iter::once(name.to_owned()).chain(numbers.map(text)).collect()
    }

    /// Arrays of X, Y and Z, and what the panel shows.
    fn write_colours(&self, frame: &Frame) -> Result<()> {
        let out = &self.arguments.out;
        let [columns, rows] = self.zoned.frame.bins;
        for (name, xyz) in COLOUR_ARRAYS.iter().zip(frame.found.colours.iter().flat_map(|c| &c.xyz))
        {
            let planes: Vec<f64> = (0..3).flat_map(|k| xyz.iter().map(move |xyz| xyz[k])).collect();
            csv::write_npy(&out.join(name), &[3, rows, columns], &planes)?;
        }
        frame.painted.iter().try_for_each(|png| write_bytes(&out.join(PAINTED), png))
    }

    fn colour_entry(&self, (full, levels): &(FullDrive, Vec<f64>), frame: &Frame) -> ColourEntry {
        let entry = FigureEntry::new;
        let of_light = |of: ColourEstimate| {
            let [x, y, u, v] = of.chromaticity.map(entry);
            let [cct, duv] = [0, 1].map(|k| of.temperature.map(|both| entry(both[k])));
            ColourOfLight { xy: [x, y], uv: [u, v], cct, duv, luminance: entry(of.luminance) }
        };
        let channels = self.design.channels().into_iter().zip(levels).enumerate();
        let channels = channels.map(|(number, (name, level))| ChannelEntry {
            name: name.to_owned(),
            level: *level,
            light: of_light(full.channel_figures(number)),
        });
        let colours = frame.found.colours.as_ref();
        let figure = |read: fn(&ColourFigures) -> Estimate| {
            entry(colours.map_or(Estimate::new(0.0, 0.0), read)).in_range(Unit::Fraction)
        };
        let white = of_light(full.white_figures());
        let name = |(primaries, transfer): (Primaries, Transfer)| {
            format!("{}, {}", primaries.name, transfer_name(transfer))
        };
        ColourEntry {
            channels: channels.collect(),
            exposure: frame.painted.as_ref().map(|_| white.luminance.value),
            white,
            picture: frame.colour_space.map(name),
            gamut: full
                .gamut()
                .into_iter()
                .map(|of| GamutEntry {
                    standard: of.standard.to_owned(),
                    xy: of.shares[0].map(entry),
                    uv: of.shares[1].map(entry),
                })
                .collect(),
            levels: frame.needs.zip(self.arguments.levels).map(|(needs, rule)| LevelsEntry {
                rule: rule_name(rule),
                matrix: needs.matrix,
                by_channel: needs.by_channel,
                power_limit: self.arguments.power_limit,
            }),
            power_share: frame.power_share,
            power_w: self.power_w(frame.power_share, levels),
            missing: figure(|colours| colours.missing),
            leaking: figure(|colours| colours.leaking),
            halo_itp: colours.and_then(|c| c.halo_itp).filter(|_| self.is_absolute()).map(entry),
        }
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
            contrast: self.contrast,
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
            colour: None,
        }
    }
}
