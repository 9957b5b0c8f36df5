// SPDX-License-Identifier: MIT OR Apache-2.0
//! Patterns and pictures of `batwing zones`: checked, shown one after the other, and their colours.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use arrays::cache::Cache;
use arrays::csv;
use design::Design;
use design::resolved::panel::CONTRAST;
use experiment::checked_file::Texts;
use formats::level_image::{ColourImage, LevelImage, png_of_rgb};
use metrics::dimming::window;
use metrics::gamut::D65;
use metrics::quantity::Unit;
use metrics::transfer::Transfer;
use metrics::{Estimate, chromaticity};
use results::figure_entry::FigureEntry;
use results::zones::{
    ChannelEntry, ColourEntry, ColourOfLight, GamutEntry, LevelsEntry, LitPattern, TestPatterns,
};
use runtime::atomic_file::write_bytes;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use zones::colour_estimates::ColourEstimate;
use zones::full_drive::{Channels, FullDrive};
use zones::levels::{Needs, check_size, from_picture, power_share};
use zones::pattern_colours::PatternColours;
use zones::picture::{Law, PictureLight, check_white, painted};
use zones::{Array, Dimmed, Pattern, PatternPicture, ZonedDesign};

use super::zone_inputs::{Drives, check_lit, colour_space, colours, drives, grey_light, pictures};
use super::zone_options::{ZonesArgs, rule_name, transfer_name};

/// Arrays of X, Y and Z of the maps.
pub const COLOUR_ARRAYS: [&str; 2] = ["backlight_xyz.npy", "panel_xyz.npy"];
/// What the panel shows of the picture.
pub const PAINTED: &str = "panel_picture.png";
/// Share of the area of the white window.
const WINDOW: f64 = 0.1;

/// A picture on the panel.
#[derive(Clone)]
enum Picture {
    /// Levels as light, and the transfer of their file.
    Grey(LevelImage, Transfer),
    /// Colours or grey on sub-pixels.
    Colours(ColourImage, Law),
}

impl Picture {
    /// Columns and rows, and how levels stand for light.
    fn size_and_law(&self) -> ([usize; 2], Law) {
        match self {
            Self::Grey(image, transfer) => ([image.columns, image.rows], (None, *transfer)),
            Self::Colours(image, law) => ([image.columns, image.rows], *law),
        }
    }
}

/// A law for people.
fn law_name((primaries, transfer): Law) -> String {
    let primaries = primaries.map_or("grey", |primaries| primaries.name);
    format!("{primaries}, {}", transfer_name(transfer))
}

/// Patterns and pictures of a command, checked.
pub struct Pictures<'a> {
    arguments: &'a ZonesArgs,
    texts: &'a Texts,
    design: &'a Design,
    zoned: &'a ZonedDesign<'a>,
    /// Largest over smallest transmittance of the panel.
    pub contrast: f64,
    /// All files that went in.
    pub inputs: Vec<FileRecord>,
    /// Drives of a pattern; none where pictures give them.
    drives: Option<Drives>,
    /// Files of pictures; none where the pattern is the picture.
    pub files: Vec<PathBuf>,
    /// The picture, where there is one file.
    only: Option<Picture>,
    /// The panel before channels as they emit.
    emitted: Option<FullDrive>,
}

/// What one picture gives.
pub struct Frame {
    /// Light.
    pub dimmed: Dimmed,
    /// Drives by channel.
    pub drives: Vec<Vec<f64>>,
    needs: Option<Needs>,
    law: Option<Law>,
    /// Power over that of full white.
    pub power_share: f64,
    /// What the panel shows, as PNG.
    pub painted: Option<Vec<u8>>,
}

/// Refuses options that the design of `zoned` has no use for.
fn check_options(arguments: &ZonesArgs, zoned: &ZonedDesign) -> Result<()> {
    let file = &zoned.design.provenance.file;
    for (option, is_stated) in
        [("--white", arguments.white.is_some()), ("--test-patterns", arguments.test_patterns)]
    {
        ensure!(
            zoned.has_colours() || !is_stated,
            "{option}: expected a design with several channels of [[sources]] or [panel] sub_pixels, got `{file}` without"
        );
    }
    ensure!(
        !(arguments.direct && zoned.has_colours()),
        "--direct: expected none with channels or [panel] sub_pixels"
    );
    let has_sub_pixels = !zoned.design.sub_pixels().is_empty();
    for (option, is_stated) in
        [("--transfer", arguments.transfer.is_some()), ("--gamut", arguments.gamut.is_some())]
    {
        ensure!(
            has_sub_pixels || !is_stated,
            "{option}: expected a design with [panel] sub_pixels, got `{file}` without; levels of its pictures are light"
        );
    }
    ensure!(
        arguments.distance.is_none() || zoned.receiver.is_luminance(),
        "--distance: expected a luminance --receiver, whose light an eye sees, got {:?}",
        zoned.receiver.name()
    );
    Ok(())
}

impl<'a> Pictures<'a> {
    /// Reads and checks them all.
    ///
    /// # Errors
    /// Options that do not fit the design; files that are no patterns or pictures, or of other sizes.
    pub fn new(
        (arguments, texts): (&'a ZonesArgs, &'a Texts),
        zoned: &'a ZonedDesign<'a>,
    ) -> Result<Self> {
        let design = zoned.design;
        let stated = &arguments.pattern;
        let channels = design.channels();
        let drives = (!stated.is_empty()).then(|| drives(stated, &channels, zoned, texts));
        let drives = drives.transpose()?;
        let file = &design.provenance.file;
        check_options(arguments, zoned)?;
        let panel = design.panel.as_ref();
        let files = arguments.picture.as_deref().map(pictures).transpose()?.unwrap_or_default();
        let has_picture = !files.is_empty() || drives.as_ref().is_some_and(|d| d.grey.is_some());
        ensure!(has_picture, "--picture: expected one beside a pattern for each channel, got none");
        let mut command = Self {
            contrast: arguments.contrast.or(panel.map(|panel| panel.contrast)).unwrap_or(CONTRAST),
            inputs: design.provenance.inputs(),
            arguments,
            texts,
            design,
            zoned,
            drives,
            files,
            only: None,
            emitted: None,
        };
        command.inputs.extend(command.drives.iter().flat_map(|drives| drives.inputs.clone()));
        if zoned.has_colours() {
            let channels = Channels { names: &channels, white: arguments.white };
            channels.check().with_context(|| file.clone())?;
            // Before anything is traced: channels keep their colours on their way, but for dispersion and
            // where light is converted.
            let emitted =
                (!design.converts()).then(|| zoned.emitted_drive(command.contrast, channels));
            command.emitted = emitted.transpose().with_context(|| file.clone())?;
        }
        let grey = command.drives.as_ref().and_then(|drives| drives.grey.as_ref());
        if let Some(grey) = grey.filter(|_| command.files.is_empty() && command.has_sub_pixels()) {
            command.coloured(ColourImage::grey(grey), &arguments.pattern[0])?;
        }
        // All are read before anything is traced or written.
        let mut size = None;
        let mut law_of_all = None;
        let mut only = None;
        for (number, path) in command.files.iter().enumerate() {
            let (picture, record) = command.picture(path, number > 0)?;
            let (pixels, law) = picture.size_and_law();
            let expected = law_of_all.get_or_insert(law);
            // Grey goes with all primaries.
            let is_same = expected.0.zip(law.0).is_none_or(|(a, b)| a == b);
            ensure!(
                is_same && expected.1 == law.1,
                "`{}`: colour space: expected {} as in the first picture, got {}{}",
                record.file,
                law_name(*expected),
                law_name(law),
                if command.has_sub_pixels() {
                    "; --gamut and --transfer state those of all"
                } else {
                    ""
                }
            );
            expected.0 = expected.0.or(law.0);
            let [columns, rows] = *size.get_or_insert(pixels);
            ensure!(
                pixels == [columns, rows],
                "`{}`: --picture: expected {columns} x {rows} pixels as in the first, got {} x {}",
                record.file,
                pixels[0],
                pixels[1]
            );
            if arguments.levels.is_some() {
                check_size(pixels, zoned.zones, &record.file)?;
            }
            command.inputs.push(record);
            if command.files.len() == 1 {
                only = Some(picture);
            }
        }
        command.only = only;
        Ok(command)
    }

    /// True if the panel shows colours.
    pub fn has_sub_pixels(&self) -> bool {
        !self.design.sub_pixels().is_empty()
    }

    /// True if levels are cd/m².
    pub fn is_absolute(&self) -> bool {
        let unit = self.zoned.receiver.quantity.unit();
        self.design.emitted.is_some() && unit == Unit::CandelaPerSquareMetre
    }

    /// The picture in a file; of a film some may be dark.
    fn picture(&self, path: &Path, may_be_dark: bool) -> Result<(Picture, FileRecord)> {
        if !self.has_sub_pixels() {
            let (image, transfer, record) = grey_light(path, self.texts)?;
            check_lit(may_be_dark || image.levels.iter().any(|level| *level > 0.0), &record.file)?;
            return Ok((Picture::Grey(image, transfer), record));
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
        let (primaries, transfer) = colour_space(&image, file, stated)?;
        let is_within = match (&primaries, self.arguments.white, &self.emitted) {
            (Some(primaries), Some(white), _) => check_white(primaries, white),
            (Some(primaries), None, Some(emitted)) => emitted.check_emitted_white(primaries),
            _ => Ok(()),
        };
        is_within.with_context(|| format!("`{file}`"))?;
        ensure!(
            transfer.peak_cd_m2().is_none() || self.is_absolute(),
            "`{file}`: --transfer: expected srgb, linear or gamma=G where levels are not in cd/m², got pq; a luminance --receiver and led.power_w make them so"
        );
        Ok(Picture::Colours(image, (primaries, transfer)))
    }

    /// The picture of a file, or the pattern as one.
    fn picture_of(&self, path: Option<&Path>) -> Result<Picture> {
        match (path, &self.only) {
            (Some(_), Some(only)) => Ok(only.clone()),
            (Some(path), None) => {
                let (picture, record) = self.picture(path, true)?;
                ensure!(
                    self.inputs.contains(&record),
                    "`{}`: --picture: expected the file that was checked, got one that has changed since",
                    record.file
                );
                Ok(picture)
            }
            (None, _) => {
                let grey = self.drives.as_ref().and_then(|drives| drives.grey.clone());
                let grey = grey.context("--picture: expected one, got none")?;
                if self.has_sub_pixels() {
                    self.coloured(ColourImage::grey(&grey), &self.arguments.pattern[0])
                } else {
                    Ok(Picture::Grey(grey, Transfer::Linear))
                }
            }
        }
    }

    /// Light of one picture, or of the pattern, with black in or beside bright `halo_zones` as its halo.
    pub fn frame(
        &self,
        (path, halo_zones): (Option<&Path>, Option<[usize; 2]>),
        array: &Array,
        full: Option<&FullDrive>,
        cache: &Cache,
        context: RunContext,
    ) -> Result<Frame> {
        let picture = self.picture_of(path)?;
        let (light, law) = match &picture {
            Picture::Grey(image, _) => (PictureLight::grey(image), None),
            Picture::Colours(image, law) => {
                let white = full.map_or(D65, FullDrive::white_xy);
                (PictureLight::new(image, *law, white)?, Some(*law))
            }
        };
        let powers = self.powers(full.map(|full| &full.channel_levels[..]));
        let mut needs = None;
        let drives = if let Some(drives) = &self.drives {
            drives.levels.clone()
        } else {
            let rule = self.arguments.levels;
            let rule = rule.context("--levels: expected a rule or a pattern, got neither")?;
            let pixel_needs = match (full, law) {
                (Some(full), Some(law)) => full.needs(law, &self.design.channels())?,
                _ => Needs::GREY,
            };
            needs = Some(pixel_needs);
            let limit = self.arguments.power_limit;
            from_picture(&light, self.zoned.zones, (rule, pixel_needs), (&powers, limit))
        };
        let on_panel = match (full, law) {
            (Some(full), Some((_, transfer))) => full.show(&light, transfer),
            _ => None,
        };
        let pattern_picture = match (&on_panel, &picture) {
            (Some(on_panel), _) => PatternPicture::Coloured(on_panel),
            (None, Picture::Grey(image, _)) => PatternPicture::Grey(image, self.contrast),
            (None, Picture::Colours(..)) => {
                anyhow::bail!("--picture: expected a panel with sub_pixels, got none")
            }
        };
        let pattern = Pattern {
            drives: &drives,
            picture: pattern_picture,
            halo_zones,
            viewing: self.arguments.viewing(),
            full,
        };
        let dimmed = self.zoned.dim(array, pattern, self.arguments.direct, cache, context)?;
        let painted = match (&on_panel, &dimmed.colours, full) {
            (Some(on_panel), Some(colours), Some(full)) => {
                let area = [0, 1].map(|axis| self.zoned.places.area_mm(axis));
                let place = (&self.zoned.frame, area);
                let rgb = painted(colours, place, on_panel, full.white_xy());
                Some(png_of_rgb(on_panel.picture.columns, &rgb)?)
            }
            _ => None,
        };
        let power_share = power_share(&drives, &powers);
        Ok(Frame { dimmed, drives, needs, law, power_share, painted })
    }

    /// Light that each channel emits at its level of full drive.
    fn powers(&self, channel_levels: Option<&[f64]>) -> Vec<f64> {
        let mut powers = vec![0.0; self.design.channels().len()];
        for light in &self.design.colour_lights().lights {
            powers[self.design.channel_of(light)] += light.emitted_w;
        }
        let channel_levels = channel_levels.unwrap_or(&[1.0]).iter();
        powers.iter_mut().zip(channel_levels).for_each(|(power, level)| *power *= level);
        powers
    }

    /// Electrical power of all packages at this share of full white, W.
    fn power_w(&self, share: f64, channel_levels: &[f64]) -> Option<f64> {
        let package_w = self.design.emitted?.electrical_w?;
        let sum = |levels: &[f64]| self.powers(Some(levels)).iter().sum::<f64>();
        let (all, white) = (sum(&vec![1.0; channel_levels.len()]), sum(channel_levels));
        Some(package_w * self.zoned.places.count() as f64 * share * white / all)
    }

    /// A window, a single zone, a checkerboard of zones and a grey ramp on the panel.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn test_patterns(
        &self,
        array: &Array,
        full: &FullDrive,
        cache: &Cache,
        context: RunContext,
    ) -> Result<TestPatterns> {
        let channel_levels = &full.channel_levels;
        let [columns, rows] = self.zoned.zones;
        let image_of_zones = |is_white: &dyn Fn(usize, usize) -> bool| {
            let level = |k: usize| f64::from(is_white(k % columns, k / columns));
            LevelImage { columns, rows, levels: (0..columns * rows).map(level).collect() }
        };
        let [across, along] = self.zoned.frame.bins;
        let window = |columns, rows| {
            let levels = window(columns, rows, WINDOW);
            LevelImage { columns, rows, levels }
        };
        let lit = window(columns, rows);
        let lit = image_of_zones(&|i, j| lit.levels[j * columns + i] > 0.0);
        let zone = image_of_zones(&|i, j| [i, j] == [columns / 2, rows / 2]);
        let board = image_of_zones(&|i, j| (i + j) % 2 == 0);
        let shown = |picture: &LevelImage, lit: &LevelImage| -> Result<Dimmed> {
            context.interrupt.check()?;
            let drives = vec![lit.levels.clone(); channel_levels.len()];
            let light = PictureLight::greys(picture, full.white_xy());
            let on_panel = full.show(&light, Transfer::Linear);
            let grey = PatternPicture::Grey(picture, self.contrast);
            let pattern = Pattern {
                drives: &drives,
                picture: on_panel.as_ref().map_or(grey, PatternPicture::Coloured),
                halo_zones: None,
                viewing: None,
                full: Some(full),
            };
            self.zoned.dim(array, pattern, false, cache, context)
        };
        let powers = self.powers(Some(channel_levels));
        let lit_pattern = |picture: &LevelImage, lit: &LevelImage| -> Result<LitPattern> {
            let drives = vec![lit.levels.clone(); channel_levels.len()];
            let share = power_share(&drives, &powers);
            let halo = shown(picture, lit)?.halo;
            Ok(LitPattern {
                luminance: halo.map(|[_, bright, _]| FigureEntry::bounded(bright)),
                power_share: share,
                power_w: self.power_w(share, channel_levels),
            })
        };
        Ok(TestPatterns {
            window: lit_pattern(&window(across, along), &lit)?,
            zone: lit_pattern(&zone, &zone)?,
            checkerboard: shown(&board, &board)?
                .halo
                .map(|[.., ratio]| FigureEntry::bounded(ratio)),
            grey_ramp: array.grey_ramp(full).map(FigureEntry::bounded),
        })
    }

    /// Arrays of X, Y and Z, and what the panel shows.
    pub fn write_colours(&self, frame: &Frame) -> Result<()> {
        let out = &self.arguments.out;
        let [columns, rows] = self.zoned.frame.bins;
        for (name, xyz) in
            COLOUR_ARRAYS.iter().zip(frame.dimmed.colours.iter().flat_map(|c| &c.xyz))
        {
            let planes: Vec<f64> = (0..3).flat_map(|k| xyz.iter().map(move |xyz| xyz[k])).collect();
            csv::write_npy(&out.join(name), &[3, rows, columns], &planes)?;
        }
        frame.painted.iter().try_for_each(|png| write_bytes(&out.join(PAINTED), png))
    }

    /// Entry of the colours in `zones.json`.
    pub fn colour_entry(
        &self,
        full: &FullDrive,
        (frame, test_patterns): (&Frame, Option<TestPatterns>),
    ) -> ColourEntry {
        let (entry, channel_levels) = (FigureEntry::new, &full.channel_levels);
        let light_entry = |light: ColourEstimate| {
            let limits = chromaticity::limits();
            let within = |places: [Estimate; 4]| {
                [0, 1, 2, 3].map(|k| FigureEntry::within(places[k], limits[k]))
            };
            let places = light.chromaticity.map(within);
            let (xy, uv) = (places.map(|[x, y, ..]| [x, y]), places.map(|[.., u, v]| [u, v]));
            let stated = [chromaticity::RANGE_K, [-chromaticity::MAX_DUV, chromaticity::MAX_DUV]];
            let [cct, duv] = [0, 1]
                .map(|k| light.temperature.map(|both| FigureEntry::within(both[k], stated[k])));
            ColourOfLight { xy, uv, cct, duv, luminance: FigureEntry::bounded(light.luminance) }
        };
        let channels = self.design.channels().into_iter().zip(channel_levels).enumerate();
        let channels = channels.map(|(number, (name, level))| ChannelEntry {
            name: name.to_owned(),
            level: *level,
            light: light_entry(full.channel_figures(number)),
        });
        let colours = frame.dimmed.colours.as_ref();
        let figure = |read: fn(&PatternColours) -> Option<Estimate>| {
            colours.and_then(read).map(FigureEntry::share)
        };
        let white = light_entry(full.white_figures());
        ColourEntry {
            channels: channels.collect(),
            exposure: frame.painted.as_ref().map(|_| white.luminance.value),
            white,
            picture: frame.law.map(law_name),
            gamut: full
                .gamut()
                .into_iter()
                .map(|gamut| {
                    let shares = gamut.shares.map(|[area, coverage]| {
                        [FigureEntry::bounded(area), FigureEntry::share(coverage)]
                    });
                    let [xy, uv] = shares;
                    GamutEntry { standard: gamut.standard.to_owned(), xy, uv }
                })
                .collect(),
            levels: frame.needs.zip(self.arguments.levels).map(|(needs, rule)| LevelsEntry {
                rule: rule_name(rule),
                matrix: needs.matrix,
                by_channel: needs.by_channel,
                power_limit: self.arguments.power_limit,
            }),
            power_share: frame.power_share,
            power_w: self.power_w(frame.power_share, channel_levels),
            missing: figure(|colours| colours.missing),
            leaking: figure(|colours| colours.leaking),
            white_difference: full.white_difference().map(entry),
            stated_white: self.arguments.white,
            black_itp: full.black_itp().filter(|_| self.is_absolute()).map(entry),
            test_patterns,
            halo_uv: colours.and_then(|c| c.halo_uv).map(entry),
            halo_itp: colours.and_then(|c| c.halo_itp).filter(|_| self.is_absolute()).map(entry),
        }
    }
}
