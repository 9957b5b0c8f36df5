// SPDX-License-Identifier: MIT OR Apache-2.0
//! Readers of the patterns and pictures of `batwing zones`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use experiment::checked_file::Texts;
use formats::level_image::{ColourImage, ColourSpace, LevelImage};
use metrics::gamut::{BT709, BT2020, DCI_P3, Primaries};
use metrics::transfer::Transfer;
use runtime::provenance::FileRecord;
use zones::ZonedDesign;
use zones::picture::Law;

use super::zone_options::PictureGamut;

/// Channels that red, green and blue of a picture drive.
const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// The levels in a file, or in the text that stands for it, as they are, and what the file states.
fn levels(path: &Path, texts: &Texts) -> Result<(LevelImage, ColourSpace, FileRecord)> {
    let name = path.display().to_string();
    let Some(text) = texts.get(&name) else { return LevelImage::read(path) };
    let (image, record) = LevelImage::of_text(&name, text)?;
    Ok((image, ColourSpace::Unstated, record))
}

/// The picture in a file, in colours or grey.
pub fn colours(path: &Path, texts: &Texts) -> Result<(ColourImage, FileRecord)> {
    if texts.contains_key(&path.display().to_string()) {
        let (image, _, record) = levels(path, texts)?;
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
        let (image, _, record) = levels(path, texts)?;
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

/// Primaries by their code point in ITU-T H.273.
fn primaries_of(code: u8) -> Option<Primaries> {
    match code {
        1 => Some(BT709),
        9 => Some(BT2020),
        11 | 12 => Some(DCI_P3),
        _ => None,
    }
}

/// A transfer by its code point in ITU-T H.273.
fn transfer_of(code: u8) -> Option<Transfer> {
    match code {
        8 => Some(Transfer::Linear),
        13 => Some(Transfer::Srgb),
        16 => Some(Transfer::Pq),
        _ => None,
    }
}

/// What a file states, for people.
fn space_text(space: ColourSpace) -> String {
    match space {
        ColourSpace::Unstated => "none".to_owned(),
        ColourSpace::Srgb => "sRGB".to_owned(),
        ColourSpace::CodePoints(points) => format!("the code points {points:?}"),
        ColourSpace::Unread(what) => what.to_owned(),
    }
}

/// Primaries and transfer of a picture: as stated, else as its file says, else of sRGB. Grey has no
/// primaries, and its levels that nothing is said of are light.
///
/// # Errors
/// A file that says others than these.
pub fn colour_space(
    image: &ColourImage,
    file: &str,
    (gamut, transfer): (Option<PictureGamut>, Option<Transfer>),
) -> Result<Law> {
    let is_grey = image.is_grey;
    let options = if is_grey { "--transfer states" } else { "--gamut and --transfer state" };
    let (primaries_said, transfer_said) = match image.space {
        ColourSpace::Unstated if is_grey => (None, Some(Transfer::Linear)),
        ColourSpace::Unstated | ColourSpace::Srgb => (Some(BT709), Some(Transfer::Srgb)),
        ColourSpace::CodePoints([primaries, transfer]) => {
            (primaries_of(primaries), transfer_of(transfer))
        }
        ColourSpace::Unread(what) => {
            ensure!(
                (is_grey || gamut.is_some()) && transfer.is_some(),
                "`{file}`: colour space: expected sRGB, or cICP of full range, got {what}; {options} it"
            );
            (None, None)
        }
    };
    let refused = |expected: &str| {
        format!(
            "`{file}`: colour space: expected {expected}, got {}; {options} others",
            space_text(image.space)
        )
    };
    let primaries = gamut.map(PictureGamut::primaries).or(primaries_said).filter(|_| !is_grey);
    if !is_grey && primaries.is_none() {
        bail!(refused("primaries of BT.709, BT.2020 or P3"));
    }
    let transfer = transfer.or(transfer_said);
    let transfer = transfer.with_context(|| refused("a transfer of sRGB, PQ or linear light"))?;
    Ok((primaries, transfer))
}

/// The picture of a panel without sub-pixels as light, and the transfer that its file states.
///
/// # Errors
/// A file that cannot be read, or that states another than sRGB or linear light.
pub fn grey_light(path: &Path, texts: &Texts) -> Result<(LevelImage, Transfer, FileRecord)> {
    let (mut image, space, record) = levels(path, texts)?;
    let transfer = match space {
        ColourSpace::Unstated | ColourSpace::CodePoints([_, 8]) => Transfer::Linear,
        ColourSpace::Srgb | ColourSpace::CodePoints([_, 13]) => Transfer::Srgb,
        ColourSpace::CodePoints(_) | ColourSpace::Unread(_) => bail!(
            "`{}`: colour space: expected sRGB or linear light on a panel without sub_pixels, got {}",
            record.file,
            space_text(space)
        ),
    };
    image.levels.iter_mut().for_each(|level| *level = transfer.light(*level));
    Ok((image, transfer, record))
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
