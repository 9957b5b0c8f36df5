// SPDX-License-Identifier: MIT OR Apache-2.0
//! LightTools BSDF text (`.bsdf`, `.txt`): one block for each side, scatter type and incidence.
//!
//! In: the text of a file, or a [`LightToolsBsdf`]. Out: the other. Scatter angles are absolute,
//! from the normal of the side that light leaves on. Azimuths count from an axis at 90° to the
//! incidence with `POI` 0; the azimuth of `wi` is `POI` + 90°. Source of the layout: the public
//! reader of libbsdf (`LightToolsBsdfReader`, MPL-2.0), which knows `POI` 0 alone. That other
//! planes rotate the incidence and not the scatter azimuths is our reading.

use crate::text::{
    FormatError, Tokens, check_line_ends, leading_comments, push_angles, push_comments, push_rows,
    scatter_type,
};
use bsdf::Transport;
use bsdf::direction::Side;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::{self, Write};

/// Sides as files spell them, in the order of [`Side::BOTH`]: *front* is the side of the normal.
const SIDES: [&str; 2] = ["Back", "Front"];

/// A side of incidence as files spell it.
pub(crate) fn side_word(side: Side) -> &'static str {
    SIDES[side.index()]
}

/// Tristimulus channel of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tristimulus {
    /// X.
    X,
    /// Y.
    Y,
    /// Z.
    Z,
}

const TRISTIMULUS: [(&str, Tristimulus); 3] =
    [("TrisX", Tristimulus::X), ("TrisY", Tristimulus::Y), ("TrisZ", Tristimulus::Z)];

/// Scatter values of one incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct LightToolsBlock {
    /// Angle of incidence, degrees from the normal.
    pub incidence: f64,
    /// Plane of incidence, degrees.
    pub plane: f64,
    /// Side that light comes from.
    pub side: Side,
    /// Wavelength, nm; 0 where the file gives none.
    pub wavelength: f64,
    /// Reflected or transmitted.
    pub transport: Transport,
    /// Channel, in files with `SpectralContent XYZ`.
    pub tristimulus: Option<Tristimulus>,
    /// Power scattered per incident power.
    pub tis: f64,
    /// BSDF in 1/sr, shape (azimuth, radial).
    pub values: Vec<f64>,
}

/// The content of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct LightToolsBsdf {
    /// Lines before the data, written as comments.
    pub comments: Vec<String>,
    /// True if azimuths go from 0 to 180 only, mirrored at the plane of incidence.
    pub plane_symmetrical: bool,
    /// Scatter azimuths, degrees.
    pub azimuths: Vec<f64>,
    /// Scatter angles from the normal, degrees.
    pub radials: Vec<f64>,
    /// All blocks.
    pub blocks: Vec<LightToolsBlock>,
}

/// Reads the text of a file.
///
/// # Errors
/// If it is not of this layout; several kinds of line end; several wavelengths; blocks missing or
/// double; NaN, infinite or negative values; angles out of order; a power above 1.
pub fn read(text: &str) -> Result<LightToolsBsdf, FormatError> {
    check_line_ends(text)?;
    let comments = leading_comments(text);
    let mut words = Tokens::new(text, true);
    let (mut symmetry, mut content) = (None, None);
    let [mut azimuths, mut radials] = [const { Vec::new() }; 2];
    loop {
        let keywords =
            ["Symmetry", "SpectralContent", "ScatterAzimuth", "ScatterRadial", "DataBegin"];
        match words.one_of(&keywords)? {
            0 => symmetry = Some(words.one_of(&["PlaneSymmetrical", "Asymmetric"])?),
            1 => content = Some(words.one_of(&["Monochrome", "XYZ"])?),
            2 => azimuths = words.angles("ScatterAzimuth", 0.0, 360.0)?,
            3 => radials = words.angles("ScatterRadial", 0.0, 90.0)?,
            _ => break,
        }
    }
    let line = words.line();
    let missing = |name: &str| FormatError::line(line, format!("{name} before DataBegin"), "none");
    let plane_symmetrical = symmetry.ok_or_else(|| missing("Symmetry"))? == 0;
    let coloured = content.ok_or_else(|| missing("SpectralContent"))? == 1;
    if azimuths.is_empty() {
        return Err(missing("ScatterAzimuth"));
    }
    if radials.is_empty() {
        return Err(missing("ScatterRadial"));
    }
    let mut bsdf =
        LightToolsBsdf { comments, plane_symmetrical, azimuths, radials, blocks: Vec::new() };
    let mut lines = Vec::new();
    loop {
        let line = words.line();
        let Some(block) = block(&bsdf, coloured, &mut words)? else {
            break;
        };
        bsdf.blocks.push(block);
        lines.push(line);
    }
    complete(&bsdf.blocks, &lines)?;
    let line = words.line();
    if bsdf.blocks.is_empty() {
        return Err(FormatError::line(line, "at least one block of data", "none"));
    }
    words.end("the end of the file after DataEnd")?;
    Ok(bsdf)
}

/// Checks that the blocks, which begin at `lines`, are of one wavelength and that each side, type
/// and channel has one for each combination of its incidences and planes of incidence.
fn complete(blocks: &[LightToolsBlock], lines: &[usize]) -> Result<(), FormatError> {
    let mut seen: Vec<(Group, BTreeMap<[u64; 2], usize>)> = Vec::new();
    for (block, line) in blocks.iter().zip(lines) {
        let wavelength = blocks[0].wavelength;
        if (block.wavelength - wavelength).abs() > 1e-9 {
            let expected = format!("one wavelength in the whole file, {wavelength} nm");
            return Err(FormatError::line(*line, expected, block.wavelength.to_string()));
        }
        let group = (block.side, block.transport, block.tristimulus);
        let at = seen.iter().position(|s| s.0 == group).unwrap_or(seen.len());
        if at == seen.len() {
            seen.push((group, BTreeMap::new()));
        }
        // Bits of numbers of 0 and more are ordered as the numbers are; adding 0 makes the one of
        // -0.
        let key = [block.incidence, block.plane.rem_euclid(360.0)].map(|a| (a + 0.0).to_bits());
        if let Some(first) = seen[at].1.insert(key, *line) {
            let got = format!("a second one (the first: line {first})");
            let expected = format!("one block for {}", named(block));
            return Err(FormatError::line(*line, expected, got));
        }
    }
    for (_, found) in &seen {
        let [incidences, planes] =
            [0, 1].map(|k| found.keys().map(|key| key[k]).collect::<BTreeSet<_>>().len());
        if incidences * planes != found.len() {
            let last = found.values().copied().max().unwrap_or(1);
            let at = lines.iter().position(|l| *l == last).unwrap_or(0);
            let expected = format!(
                "one block for each of {incidences} AOI x {planes} POI, the last being {}",
                named(&blocks[at])
            );
            return Err(FormatError::line(last, expected, found.len().to_string()));
        }
    }
    Ok(())
}

/// Side, type and channel.
type Group = (Side, Transport, Option<Tristimulus>);

/// A block as messages name it.
fn named(block: &LightToolsBlock) -> String {
    let [incidence, plane] = [block.incidence, block.plane];
    let (side, kind) = (side_word(block.side), scatter_type(block.transport));
    format!("{side} {kind}, AOI {incidence}, POI {plane}")
}

/// The next block; `None` at `DataEnd`.
fn block(
    bsdf: &LightToolsBsdf,
    coloured: bool,
    words: &mut Tokens<'_>,
) -> Result<Option<LightToolsBlock>, FormatError> {
    let (mut incidence, mut side, mut transport, mut tristimulus) = (None, None, None, None);
    let (mut plane, mut wavelength, mut begun) = (0.0, 0.0, false);
    loop {
        let line = words.line();
        let keywords = [
            "AOI",
            "POI",
            "Side",
            "Wavelength",
            "ScatterType",
            "TristimulusValue",
            "TIS",
            "DataEnd",
        ];
        let keyword = words.one_of(&keywords)?;
        let within = |range: std::ops::RangeInclusive<f64>| move |a: f64| range.contains(&a);
        match keyword {
            0 => {
                incidence =
                    Some(words.number_that("AOI", "0 to 90 degrees", within(0.0..=90.0))?);
            }
            1 => plane = words.number_that("POI", "0 to 360 degrees", within(0.0..=360.0))?,
            2 => side = Some([Side::Outer, Side::Inner][words.one_of(&["Front", "Back"])?]),
            3 => wavelength = words.number_that("Wavelength", "0 to 1e6 nm", within(0.0..=1e6))?,
            4 => transport = Some(words.scatter_type()?),
            5 => tristimulus = Some(TRISTIMULUS[words.one_of(&TRISTIMULUS.map(|t| t.0))?].1),
            6 => {
                let tis = words.total_scatter()?;
                let missing = |name: &str| {
                    FormatError::line(line, format!("{name} before TIS"), "a block without it")
                };
                if coloured != tristimulus.is_some() {
                    return Err(FormatError::line(
                        line,
                        "TristimulusValue with SpectralContent XYZ, and only there",
                        "a block that differs",
                    ));
                }
                let count = bsdf.azimuths.len() * bsdf.radials.len();
                return Ok(Some(LightToolsBlock {
                    incidence: incidence.ok_or_else(|| missing("AOI"))?,
                    plane,
                    side: side.ok_or_else(|| missing("Side"))?,
                    wavelength,
                    transport: transport.ok_or_else(|| missing("ScatterType"))?,
                    tristimulus,
                    tis,
                    values: words.values("a BSDF value", count)?,
                }));
            }
            _ if begun => return Err(FormatError::line(line, "TIS and values", "`DataEnd`")),
            _ => return Ok(None),
        }
        begun = true;
    }
}

/// Writes a file.
///
/// # Errors
/// If the writer fails.
pub fn write(bsdf: &LightToolsBsdf, writer: &mut impl Write) -> io::Result<()> {
    let mut text = String::new();
    push_comments(&mut text, &bsdf.comments);
    let coloured = bsdf.blocks.iter().any(|b| b.tristimulus.is_some());
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "Symmetry {}\nSpectralContent {}",
        if bsdf.plane_symmetrical { "PlaneSymmetrical" } else { "Asymmetric" },
        if coloured { "XYZ" } else { "Monochrome" }
    );
    push_angles(&mut text, "ScatterAzimuth", &bsdf.azimuths);
    push_angles(&mut text, "ScatterRadial", &bsdf.radials);
    text.push_str("DataBegin\n");
    for block in &bsdf.blocks {
        let _ = writeln!(
            text,
            "AOI {}\nPOI {}\nSide {}\nWavelength {}\nScatterType {}",
            block.incidence,
            block.plane,
            side_word(block.side),
            block.wavelength,
            scatter_type(block.transport)
        );
        if let Some(channel) = block.tristimulus
            && let Some((name, _)) = TRISTIMULUS.iter().find(|t| t.1 == channel)
        {
            let _ = writeln!(text, "TristimulusValue {name}");
        }
        let _ = writeln!(text, "TIS {:.9}", block.tis);
        push_rows(&mut text, &block.values, bsdf.radials.len());
        writer.write_all(text.as_bytes())?;
        text.clear();
    }
    text.push_str("DataEnd\n");
    writer.write_all(text.as_bytes())
}
