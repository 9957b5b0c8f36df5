// SPDX-License-Identifier: MIT OR Apache-2.0
//! Options of `batwing zones` with their parsers, and readers of its patterns and pictures.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};

use experiment::checked_file::Texts;
use formats::level_image::{ColourImage, LevelImage};
use metrics::chromaticity;
use metrics::gamut::{BT709, BT2020, DCI_P3, Primaries};
use metrics::glare::{Observer, Viewing};
use metrics::transfer::Transfer;
use runtime::provenance::FileRecord;
use zones::ZonedDesign;
use zones::levels::Rule;

use super::arguments::{ModelChoice, paths};

/// Channels that red, green and blue of a picture drive.
const COLOURS: [&str; 3] = ["red", "green", "blue"];

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
    /// Distance of an eye before the middle of the panel, mm, whose own glare hides a part of the halo
    #[arg(long, value_name = "MM", value_parser = distance)]
    pub distance: Option<f64>,
    /// Its age, years
    #[arg(long, value_name = "YEARS", requires = "distance", default_value_t = 25.0, value_parser = age)]
    pub age: f64,
    /// Its pigment: 0 black, 0.5 brown, 1.2 light blue
    #[arg(long, value_name = "P", requires = "distance", default_value_t = 0.5, value_parser = pigment)]
    pub pigment: f64,
    /// Also show a white window of 10 % of the area, a single zone and a checkerboard of zones
    #[arg(long)]
    pub test_patterns: bool,
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

impl ZonesArgs {
    /// The eye that looks, if its distance is stated.
    pub fn viewing(&self) -> Option<Viewing> {
        let observer = Observer { age_years: self.age, pigment: self.pigment };
        self.distance.map(|distance_mm| Viewing { distance_mm, observer })
    }
}

/// Primaries of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PictureGamut {
    /// BT.709 and sRGB
    Bt709,
    /// DCI-P3 and Display P3
    DciP3,
    /// BT.2020 and BT.2100
    Bt2020,
}

impl PictureGamut {
    fn primaries(self) -> Primaries {
        match self {
            Self::Bt709 => BT709,
            Self::DciP3 => DCI_P3,
            Self::Bt2020 => BT2020,
        }
    }
}

/// A parser of columns and rows: `48x27`.
pub fn columns_and_rows(text: &str) -> Result<[usize; 2], String> {
    let number = |text: &str| text.trim().parse().ok().filter(|n: &usize| (1..=10_000).contains(n));
    let both = text.split_once(['x', 'X', '×', ',']);
    let both = both.and_then(|(columns, rows)| Some([number(columns)?, number(rows)?]));
    both.ok_or_else(|| "expected columns and rows from 1 to 10000, such as 48x27".to_owned())
}

/// A parser of distances of an eye.
pub fn distance(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|d: &f64| (10.0..=1e6).contains(d));
    number.ok_or_else(|| "expected millimetres from 10 to 1e6".to_owned())
}

/// A parser of ages.
pub fn age(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|a: &f64| (0.0..=120.0).contains(a));
    number.ok_or_else(|| "expected years from 0 to 120".to_owned())
}

/// A parser of pigments of the eye.
pub fn pigment(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|p: &f64| (0.0..=1.2).contains(p));
    number.ok_or_else(|| "expected a number from 0 (black) to 1.2 (light blue)".to_owned())
}

/// A parser of contrasts.
pub fn contrast(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|c: &f64| c.is_finite() && *c >= 1.0);
    number.ok_or_else(|| "expected a number of at least 1".to_owned())
}

/// A parser of whites: `0.3127,0.3290` or `6504K`.
pub fn white(text: &str) -> Result<[f64; 2], String> {
    let found = match text.strip_suffix(['K', 'k']) {
        Some(kelvin) => kelvin.trim().parse().ok().and_then(chromaticity::white_of),
        None => text.split_once(',').and_then(|(x, y)| {
            let [x, y]: [Option<f64>; 2] = [x, y].map(|number| number.trim().parse().ok());
            Some([x?, y?]).filter(|[x, y]| *x > 0.0 && *y > 0.0 && x + y < 1.0)
        }),
    };
    found.ok_or_else(|| {
        "expected x and y with a sum below 1, such as 0.3127,0.3290, or a temperature from 1000K to 25000K"
            .to_owned()
    })
}

/// A parser of rules of levels.
pub fn rule(text: &str) -> Result<Rule, String> {
    let percentile = |p: &str| p.parse().ok().filter(|p: &f64| *p > 0.0 && *p <= 100.0);
    match (text, text.strip_prefix("percentile=")) {
        ("max", _) => Some(Rule::Max),
        ("mean", _) => Some(Rule::Mean),
        ("rms", _) => Some(Rule::Rms),
        ("percentile", _) => Some(Rule::Percentile(95.0)),
        (_, Some(p)) => percentile(p).map(Rule::Percentile),
        _ => None,
    }
    .ok_or_else(|| {
        "expected max, mean, rms, percentile or percentile=P with P above 0, up to 100".to_owned()
    })
}

/// A parser of shares of power.
pub fn share(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|s: &f64| *s > 0.0 && *s <= 1.0);
    number.ok_or_else(|| "expected a share of full white above 0, up to 1".to_owned())
}

/// A parser of transfer functions.
pub fn transfer(text: &str) -> Result<Transfer, String> {
    let gamma = |g: &str| g.parse().ok().filter(|g: &f64| (0.1..=10.0).contains(g));
    match (text, text.strip_prefix("gamma=")) {
        ("srgb", _) => Some(Transfer::Srgb),
        ("linear", _) => Some(Transfer::Linear),
        ("pq", _) => Some(Transfer::Pq),
        (_, Some(g)) => gamma(g).map(Transfer::Gamma),
        _ => None,
    }
    .ok_or_else(|| "expected srgb, linear, pq or gamma=G with G from 0.1 to 10".to_owned())
}

/// The name of a rule, as it is written.
pub fn rule_name(rule: Rule) -> String {
    match rule {
        Rule::Max => "max".to_owned(),
        Rule::Mean => "mean".to_owned(),
        Rule::Rms => "rms".to_owned(),
        Rule::Percentile(p) => format!("percentile={p}"),
    }
}

/// Name of a transfer function for people.
pub fn transfer_name(transfer: Transfer) -> String {
    match transfer {
        Transfer::Srgb => "sRGB".to_owned(),
        Transfer::Linear => "linear".to_owned(),
        Transfer::Gamma(gamma) => format!("gamma {gamma}"),
        Transfer::Pq => "PQ".to_owned(),
    }
}

/// The levels in a file, or in the text that stands for it.
pub fn levels(path: &Path, texts: &Texts) -> Result<(LevelImage, FileRecord)> {
    let name = path.display().to_string();
    texts.get(&name).map_or_else(|| LevelImage::read(path), |text| LevelImage::of_text(&name, text))
}

/// The picture in a file, in colours or grey.
pub fn colours(path: &Path, texts: &Texts) -> Result<(ColourImage, FileRecord)> {
    if texts.contains_key(&path.display().to_string()) {
        let (image, record) = levels(path, texts)?;
        return Ok((ColourImage::grey(&image), record));
    }
    ColourImage::read(path)
}

/// Refuses a picture of nothing.
pub fn check_lit(is_lit: bool, file: &str) -> Result<()> {
    ensure!(is_lit, "`{file}`: --picture: expected a level above 0, got none");
    Ok(())
}

/// Drives of zones, one image for each channel, with the files that they come from.
pub struct Drives {
    /// By channel.
    pub levels: Vec<Vec<f64>>,
    /// The single grey pattern of all channels, which is the picture where there is no other.
    pub grey: Option<LevelImage>,
    /// Files.
    pub inputs: Vec<FileRecord>,
}

/// Reads `--pattern`: one file for all channels, one for each, or a picture of red, green and blue.
///
/// # Errors
/// Files of other sizes or no drives; channels that the design does not have, or twice, or not all.
pub fn drives(
    stated: &[String],
    channels: &[&str],
    zoned: &ZonedDesign,
    texts: &Texts,
) -> Result<Drives> {
    let read = |path: &Path, may_be_dark: bool| -> Result<(LevelImage, FileRecord)> {
        let (image, record) = levels(path, texts)?;
        zoned.check_drives(&image, &record.file, may_be_dark)?;
        Ok((image, record))
    };
    if let [one] = stated {
        let path = Path::new(one);
        let is_named = one.split_once('=').is_some_and(|(name, _)| channels.contains(&name));
        if !is_named {
            let is_png = one.to_ascii_lowercase().ends_with(".png");
            if is_png && zoned.has_colours() {
                let (image, record) = colours(path, texts)?;
                if !image.is_grey {
                    return by_colour(&image, record, channels, zoned);
                }
            }
            let (grey, record) = read(path, false)?;
            let levels = vec![grey.levels.clone(); channels.len()];
            return Ok(Drives { levels, grey: Some(grey), inputs: vec![record] });
        }
    }
    let known = || channels.join(", ");
    let mut by_channel: Vec<Option<Vec<f64>>> = vec![None; channels.len()];
    let mut inputs = Vec::new();
    for one in stated {
        let Some((name, file)) = one.split_once('=') else {
            bail!("--pattern: expected CHANNEL=FILE of each channel ({}), got {one:?}", known());
        };
        let Some(number) = channels.iter().position(|channel| *channel == name) else {
            bail!("--pattern: expected a channel of the design ({}), got {name:?}", known());
        };
        ensure!(by_channel[number].is_none(), "--pattern: expected one file for {name:?}, got two");
        let (image, record) = read(Path::new(file), true)?;
        by_channel[number] = Some(image.levels);
        inputs.push(record);
    }
    let missing = channels.iter().zip(&by_channel).find(|(_, levels)| levels.is_none());
    if let Some((name, _)) = missing {
        bail!("--pattern: expected a file for each channel ({}), got none for {name:?}", known());
    }
    let levels: Vec<Vec<f64>> = by_channel.into_iter().flatten().collect();
    ensure!(
        levels.iter().flatten().any(|drive| *drive > 0.0),
        "--pattern: expected a drive above 0 in a zone of a channel, got none"
    );
    Ok(Drives { levels, grey: None, inputs })
}

/// Red, green and blue of a picture as drives of these channels.
fn by_colour(
    image: &ColourImage,
    record: FileRecord,
    channels: &[&str],
    zoned: &ZonedDesign,
) -> Result<Drives> {
    let colour = |channel: &&str| COLOURS.iter().position(|colour| colour == channel);
    let planes: Option<Vec<usize>> = channels.iter().map(colour).collect();
    let planes = planes.with_context(|| {
        format!(
            "`{}`: --pattern: expected a grey picture, as channels are called otherwise than {} ({}), got colours",
            record.file,
            COLOURS.join(", "),
            channels.join(", ")
        )
    })?;
    let images: Vec<LevelImage> = planes.iter().map(|plane| image.plane(*plane)).collect();
    images.iter().try_for_each(|image| zoned.check_drives(image, &record.file, true))?;
    let levels: Vec<Vec<f64>> = images.into_iter().map(|image| image.levels).collect();
    ensure!(
        levels.iter().flatten().any(|level| *level > 0.0),
        "`{}`: --pattern: expected a drive above 0 in a zone, got none",
        record.file
    );
    Ok(Drives { levels, grey: None, inputs: vec![record] })
}

/// Primaries and transfer of a picture: as stated, else as its file says, else of sRGB; levels of
/// grey are light.
///
/// # Errors
/// A file that says others than these.
pub fn colour_space(
    image: &ColourImage,
    file: &str,
    (gamut, transfer): (Option<PictureGamut>, Option<Transfer>),
) -> Result<(Primaries, Transfer)> {
    if let Some(unread) = image.unread {
        ensure!(
            gamut.is_some() && transfer.is_some(),
            "`{file}`: colour space: expected sRGB, or cICP of full range, got {unread}; --gamut and --transfer state it"
        );
    }
    let usual = if image.is_grey { Transfer::Linear } else { Transfer::Srgb };
    let said = image.code_points;
    let of_file = |of: Option<Option<u8>>, expected: &str| {
        let got = said.unwrap_or_default();
        of.flatten().with_context(|| {
            format!("`{file}`: colour space: expected {expected}, got the code points {got:?}; --gamut and --transfer state others")
        })
    };
    let primaries = match (gamut, said) {
        (Some(gamut), _) => gamut.primaries(),
        (None, None) => BT709,
        (None, Some([primaries, _])) => {
            let known = [1, 9, 11, 12].contains(&primaries).then_some(primaries);
            match of_file(Some(known), "primaries of BT.709, BT.2020 or P3")? {
                1 => BT709,
                9 => BT2020,
                _ => DCI_P3,
            }
        }
    };
    let transfer = match (transfer, said) {
        (Some(transfer), _) => transfer,
        (None, None) => usual,
        (None, Some([_, transfer])) => {
            let known = [8, 13, 16].contains(&transfer).then_some(transfer);
            match of_file(Some(known), "a transfer of sRGB, PQ or linear light")? {
                8 => Transfer::Linear,
                13 => Transfer::Srgb,
                _ => Transfer::Pq,
            }
        }
    };
    Ok((primaries, transfer))
}

/// The pictures that `path` names: itself, or all PNG files of a folder by name.
///
/// # Errors
/// A folder that cannot be read or has none.
pub fn pictures(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let shown = path.display();
    let entries = std::fs::read_dir(path).with_context(|| format!("`{shown}`"))?;
    let mut found: Vec<PathBuf> = Vec::new();
    for entry in entries {
        let path = entry.with_context(|| format!("`{shown}`"))?.path();
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
            found.push(path);
        }
    }
    found.sort();
    ensure!(!found.is_empty(), "`{shown}`: --picture: expected a folder with PNG files, got none");
    Ok(found)
}
