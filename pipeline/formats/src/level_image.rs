// SPDX-License-Identifier: MIT OR Apache-2.0
//! Images of levels from 0 to 1: drives of dimming zones, pictures on a panel.
//!
//! A text file has a line for each row of numbers, between commas, semicolons or blanks; lines that
//! are empty or begin with `#` are skipped. A PNG is grey with 8 or 16 bits, whose largest number
//! is 1. The first row of both is the top, of the largest y. Height maps are read alike, of any finite
//! numbers, and as `.npy` too. Colour images are the same with red, green and blue of a PNG. Numbers
//! come as they are: what light they stand for follows from the [`ColourSpace`] that the file states.

use std::io::{Cursor, Read};
use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use png::{BitDepth, ColorType, Decoder, Limits, ScaledFloat};

use arrays::npy;
use metrics::gamut::{BT709, D65};
use runtime::bounded_text::{MAX_ROWS, bounded_bytes, open};
use runtime::content_hash::sha256_hex;
use runtime::provenance::FileRecord;

use super::icc::is_srgb;

/// Numbers that a file may hold, and their name in messages.
type Numbers = (RangeInclusive<f64>, &'static str);
const LEVELS: Numbers = (0.0..=1.0, "a number from 0 to 1");
const FINITE: Numbers = (f64::MIN..=f64::MAX, "a finite number");

/// First bytes of a PNG.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
/// First bytes of a `.npy`.
const NPY: &[u8] = b"\x93NUMPY";
/// Largest PNG, bytes: one of [`MAX_LEVELS`] in 16 bits of red, green and blue that nothing shortens.
const MAX_PNG: u64 = 110_000_000;
/// Largest number of levels.
const MAX_LEVELS: usize = 16_000_000;

/// Levels in columns and rows.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelImage {
    /// Levels along x.
    pub columns: usize,
    /// Levels along y.
    pub rows: usize,
    /// Levels from 0 to 1, row after row from the bottom, of the smallest y.
    pub levels: Vec<f64>,
}

/// The colour space that a file states of its levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourSpace {
    /// None.
    Unstated,
    /// sRGB.
    Srgb,
    /// Primaries and transfer by the code points of ITU-T H.273, of RGB in full range.
    CodePoints([u8; 2]),
    /// Another, that is not read.
    Unread(&'static str),
}

impl LevelImage {
    /// Reads the file at `path`, with what it states of its levels and its record.
    ///
    /// # Errors
    /// A file that cannot be read, and where in it which number was expected.
    pub fn read(path: &Path) -> Result<(Self, ColourSpace, FileRecord)> {
        let name = path.display().to_string();
        let read = || -> Result<(Self, ColourSpace, FileRecord)> {
            let bytes = image_bytes(path)?;
            let (image, space) = if bytes.starts_with(PNG) {
                from_png(&bytes)?
            } else {
                (from_text(&bytes, &LEVELS)?, ColourSpace::Unstated)
            };
            Ok((image, space, FileRecord::new(name.clone(), &bytes)))
        };
        read().with_context(|| format!("`{name}`"))
    }

    /// Reads a map of any finite numbers at `path`, also from `.npy`; the hash of the file beside it.
    ///
    /// # Errors
    /// As [`LevelImage::read`].
    pub fn read_heights(path: &Path) -> Result<(Self, String)> {
        let read = || -> Result<(Self, String)> {
            let bytes = image_bytes(path)?;
            let image = match &bytes {
                png if png.starts_with(PNG) => from_png(png).map(|(image, _)| image),
                array if array.starts_with(NPY) => from_npy(array),
                text => from_text(text, &FINITE),
            };
            Ok((image?, sha256_hex(&bytes)))
        };
        read().with_context(|| format!("`{}`", path.display()))
    }

    /// The same of a text in place of the file `name`.
    ///
    /// # Errors
    /// As [`LevelImage::read`].
    pub fn of_text(name: &str, text: &str) -> Result<(Self, FileRecord)> {
        let image = from_text(text.as_bytes(), &LEVELS).with_context(|| format!("`{name}`"))?;
        Ok((image, FileRecord::new(name.to_owned(), text.as_bytes())))
    }

    /// From rows of levels, the top first.
    fn from_top(columns: usize, rows: &[f64]) -> Self {
        let levels = rows.chunks(columns).rev().flatten().copied().collect();
        Self { columns, rows: rows.len() / columns, levels }
    }
}

/// Red, green and blue in columns and rows.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourImage {
    /// Pixels along x.
    pub columns: usize,
    /// Pixels along y.
    pub rows: usize,
    /// Levels from 0 to 65535, row after row from the bottom; of a grey image three alike.
    pub levels: Vec<[u16; 3]>,
    /// True if the file is grey.
    pub is_grey: bool,
    /// What the file states of them.
    pub space: ColourSpace,
}

impl ColourImage {
    /// Reads the file at `path`; its record beside the image.
    ///
    /// # Errors
    /// As [`LevelImage::read`].
    pub fn read(path: &Path) -> Result<(Self, FileRecord)> {
        let name = path.display().to_string();
        let read = || -> Result<(Self, FileRecord)> {
            let bytes = image_bytes(path)?;
            let image = if bytes.starts_with(PNG) {
                Png::decode(&bytes, true)?.colours()
            } else {
                Self::grey(&from_text(&bytes, &LEVELS)?)
            };
            Ok((image, FileRecord::new(name.clone(), &bytes)))
        };
        read().with_context(|| format!("`{name}`"))
    }

    /// The same grey as levels.
    pub fn grey(image: &LevelImage) -> Self {
        let levels = image.levels.iter().map(|level| [(65_535.0 * level).round() as u16; 3]);
        let (columns, rows) = (image.columns, image.rows);
        let levels = levels.collect();
        Self { columns, rows, levels, is_grey: true, space: ColourSpace::Unstated }
    }

    /// Levels of red, green or blue from 0 to 1, as they are.
    pub fn plane(&self, colour: usize) -> LevelImage {
        let levels = self.levels.iter().map(|levels| f64::from(levels[colour]) / 65_535.0);
        LevelImage { columns: self.columns, rows: self.rows, levels: levels.collect() }
    }
}

/// The bytes of a PNG, or those of another file of rows of numbers.
fn image_bytes(path: &Path) -> Result<Vec<u8>> {
    let mut start = [0; PNG.len()];
    let is_png = open(path)?.read_exact(&mut start).is_ok() && start == PNG;
    bounded_bytes(path, if is_png { MAX_PNG } else { MAX_ROWS })
}

fn from_npy(bytes: &[u8]) -> Result<LevelImage> {
    let (shape, values) = npy::read::<f64>(bytes)?;
    let &[rows, columns] = &shape[..] else {
        bail!("expected an array of rows and columns, got one of shape {shape:?}");
    };
    ensure!(rows > 0 && columns > 0, "expected rows of numbers, got the shape {shape:?}");
    if let Some(at) = values.iter().position(|value| !value.is_finite()) {
        let (row, column) = (at / columns + 1, at % columns + 1);
        bail!("row {row}, column {column}: expected {}, got {}", FINITE.1, values[at]);
    }
    Ok(LevelImage::from_top(columns, &values))
}

fn from_text(bytes: &[u8], (range, one): &Numbers) -> Result<LevelImage> {
    let text = std::str::from_utf8(bytes).context("expected a PNG or text in UTF-8")?;
    let (mut columns, mut levels) = (0, Vec::new());
    for (number, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fields: Vec<&str> = match [',', ';'].into_iter().find(|mark| line.contains(*mark)) {
            Some(mark) => line.split(mark).map(str::trim).collect(),
            None => line.split_whitespace().collect(),
        };
        let number = number + 1;
        if columns == 0 {
            columns = fields.len();
        }
        let count = fields.len();
        ensure!(
            count == columns,
            "line {number}: expected {columns} numbers as in the first row, got {count}"
        );
        for (column, field) in fields.iter().enumerate() {
            let level = field.parse().ok().filter(|level| range.contains(level));
            let Some(level) = level else {
                bail!("line {number}, column {}: expected {one}, got {field:?}", column + 1);
            };
            levels.push(level);
        }
    }
    ensure!(columns > 0, "expected rows of numbers, got none");
    Ok(LevelImage::from_top(columns, &levels))
}

fn from_png(bytes: &[u8]) -> Result<(LevelImage, ColourSpace)> {
    let png = Png::decode(bytes, false)?;
    let levels: Vec<f64> = png.numbers.iter().map(|n| f64::from(*n) / 65_535.0).collect();
    Ok((LevelImage::from_top(png.columns, &levels), png.space))
}

/// A PNG of `columns` pixels a row from red, green and blue of 8 bits, the top row first.
///
/// # Errors
/// No whole rows.
pub fn png_of_rgb(columns: usize, rgb: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let size = [columns, rgb.len() / (3 * columns).max(1)].map(u32::try_from);
    let [columns, rows] = size;
    let mut encoder = png::Encoder::new(&mut bytes, columns?, rows?);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(bytes)
}

/// Pixels of a PNG from the top.
struct Png {
    columns: usize,
    /// Numbers of a pixel: 1 of grey, 3 of colours.
    depth: usize,
    /// From 0 to 65535.
    numbers: Vec<u16>,
    space: ColourSpace,
}

/// The colour space that a PNG states: cICP comes before iCCP, sRGB, and gAMA with cHRM (PNG, third
/// edition, 4.3).
fn stated_space(info: &png::Info) -> ColourSpace {
    if let Some(points) = info.coding_independent_code_points {
        let is_rgb = points.is_video_full_range_image && points.matrix_coefficients == 0;
        return if is_rgb {
            ColourSpace::CodePoints([points.color_primaries, points.transfer_function])
        } else {
            ColourSpace::Unread("cICP of narrow range or no RGB")
        };
    }
    if let Some(profile) = &info.icc_profile {
        return if is_srgb(profile) {
            ColourSpace::Srgb
        } else {
            ColourSpace::Unread("an ICC profile other than sRGB")
        };
    }
    if info.srgb.is_some() {
        return ColourSpace::Srgb;
    }
    let is_near = |a: f32, b: f64| (f64::from(a) - b).abs() <= 1e-3;
    // Writers of sRGB state 1/2.2, as the standard asks them to.
    let has_gamma = info.gama_chunk.map(|gamma| is_near(gamma.into_value(), 1.0 / 2.2));
    let has_primaries = info.chrm_chunk.is_none_or(|of| {
        let found = [of.white, of.red, of.green, of.blue];
        let [red, green, blue] = BT709.xy;
        let same = |((x, y), [a, b]): (&(ScaledFloat, ScaledFloat), [f64; 2])| {
            is_near(x.into_value(), a) && is_near(y.into_value(), b)
        };
        found.iter().zip([D65, red, green, blue]).all(same)
    });
    match has_gamma {
        Some(true) if has_primaries => ColourSpace::Srgb,
        None if has_primaries => ColourSpace::Unstated,
        _ => ColourSpace::Unread("gAMA or cHRM other than of sRGB"),
    }
}

impl Png {
    fn decode(bytes: &[u8], takes_colours: bool) -> Result<Self> {
        let limits = Limits { bytes: 8 * MAX_LEVELS };
        let mut reader = Decoder::new_with_limits(Cursor::new(bytes), limits).read_info()?;
        let info = reader.info();
        let (columns, rows) = (info.width as usize, info.height as usize);
        ensure!(
            columns.saturating_mul(rows) <= MAX_LEVELS,
            "expected at most {MAX_LEVELS} pixels, got {columns} x {rows}"
        );
        let (colour, bits) = (info.color_type, info.bit_depth);
        let depth = match colour {
            ColorType::Grayscale => Some(1),
            ColorType::Rgb if takes_colours => Some(3),
            _ => None,
        };
        let depth = depth.filter(|_| matches!(bits, BitDepth::Eight | BitDepth::Sixteen));
        let Some(depth) = depth else {
            bail!(
                "colour type: expected grey{} of 8 or 16 bits without alpha, got {colour:?} of {} bits",
                if takes_colours { " or RGB" } else { "" },
                bits as u8
            );
        };
        let space = stated_space(info);
        let per_number = if bits == BitDepth::Eight { 1 } else { 2 };
        let mut pixels = vec![0; columns * rows * depth * per_number];
        reader.next_frame(&mut pixels)?;
        let number = |bytes: &[u8]| match bytes {
            [high, low] => u16::from_be_bytes([*high, *low]),
            _ => 257 * u16::from(bytes[0]),
        };
        let numbers = pixels.chunks_exact(per_number).map(number).collect();
        Ok(Self { columns, depth, numbers, space })
    }

    fn colours(self) -> ColourImage {
        let pixel = |numbers: &[u16]| [0, 1, 2].map(|k| numbers[k % self.depth]);
        let rows = self.numbers.chunks(self.columns * self.depth).rev();
        let levels = rows.flat_map(|row| row.chunks_exact(self.depth).map(pixel));
        let levels: Vec<[u16; 3]> = levels.collect();
        ColourImage {
            columns: self.columns,
            rows: levels.len() / self.columns,
            levels,
            is_grey: self.depth == 1,
            space: self.space,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(colour: ColorType, depth: BitDepth, pixels: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(pixels).expect("pixels");
        writer.finish().expect("written");
        bytes
    }

    #[test]
    fn the_first_row_is_the_top_of_all_forms() {
        let bottom_up = vec![1.0, 0.2, 0.0, 0.6];
        let expected = LevelImage { columns: 2, rows: 2, levels: bottom_up };
        for text in ["0,0.6\n1,0.2\n", "\u{feff}# drives\n0 0.6\n\n1 0.2", "0; .6\r\n1e0; 2e-1\r\n"]
        {
            assert_eq!(from_text(text.as_bytes(), &LEVELS).expect(text), expected);
        }
        let eight = png(ColorType::Grayscale, BitDepth::Eight, &[0, 153, 255, 51]);
        assert_eq!(from_png(&eight).expect("8 bits").0, expected);
        let wide = [0, 0, 0x99, 0x99, 0xff, 0xff, 0x33, 0x33];
        let sixteen = png(ColorType::Grayscale, BitDepth::Sixteen, &wide);
        assert_eq!(from_png(&sixteen).expect("16 bits").0, expected);
    }

    /// What a file states of its levels comes in the order of the standard.
    #[test]
    fn files_state_their_colour_spaces() {
        let of = |state: &dyn Fn(&mut png::Info)| {
            let mut info = png::Info::with_size(1, 1);
            state(&mut info);
            stated_space(&info)
        };
        let points = |full, matrix| png::CodingIndependentCodePoints {
            color_primaries: 9,
            transfer_function: 16,
            matrix_coefficients: matrix,
            is_video_full_range_image: full,
        };
        let scaled = |v: f32| Some(ScaledFloat::new(v));
        let profile = || Some(b"a profile called sRGB".to_vec().into());
        assert_eq!(of(&|_| {}), ColourSpace::Unstated);
        assert_eq!(of(&|info| info.gama_chunk = scaled(0.45455)), ColourSpace::Srgb);
        let words = |space| match space {
            ColourSpace::Unread(words) => words,
            other => panic!("{other:?}"),
        };
        assert!(words(of(&|info| info.gama_chunk = scaled(1.0))).contains("gAMA"));
        assert!(words(of(&|info| info.icc_profile = profile())).contains("ICC"));
        for (full, matrix, is_read) in [(true, 0, true), (false, 0, false), (true, 9, false)] {
            let found = of(&|info| {
                info.icc_profile = profile();
                info.gama_chunk = scaled(1.0);
                info.coding_independent_code_points = Some(points(full, matrix));
            });
            assert_eq!(found == ColourSpace::CodePoints([9, 16]), is_read, "{found:?}");
        }
    }

    /// Grey and RGB files alike say what they are of.
    #[test]
    fn grey_pictures_and_coloured_ones_state_srgb_alike() {
        for (colour, depth) in [(ColorType::Grayscale, 1), (ColorType::Rgb, 3)] {
            for (is_stated, expected) in [(false, ColourSpace::Unstated), (true, ColourSpace::Srgb)]
            {
                let mut bytes = Vec::new();
                let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
                encoder.set_color(colour);
                if is_stated {
                    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
                }
                let mut writer = encoder.write_header().expect("a header");
                writer.write_image_data(&vec![7; 4 * depth]).expect("pixels");
                writer.finish().expect("written");
                let read = Png::decode(&bytes, true).expect("a picture").colours();
                assert_eq!((read.space, read.is_grey), (expected, depth == 1));
                if depth == 1 {
                    assert_eq!(from_png(&bytes).expect("grey").1, expected);
                }
            }
        }
    }

    /// Noise of 16 bits takes more than any text may, and comes back as it is.
    #[test]
    fn large_pictures_are_read() {
        let (columns, rows) = (2000u32, 1500u32);
        let mut state = 1u64;
        let noise = (0..columns * rows * 6).map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 56) as u8
        });
        let noise: Vec<u8> = noise.collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, columns, rows);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Sixteen);
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&noise).expect("pixels");
        writer.finish().expect("written");
        assert!(bytes.len() as u64 > MAX_ROWS);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("noise.png");
        std::fs::write(&path, &bytes).expect("written");
        let (image, _) = ColourImage::read(&path).expect("a picture");
        let top = (rows as usize - 1) * columns as usize;
        assert_eq!(image.levels[top][0], u16::from_be_bytes([noise[0], noise[1]]));
        // Control: a text of this size is refused.
        std::fs::write(&path, vec![b' '; bytes.len()]).expect("written");
        let error = format!("{:#}", ColourImage::read(&path).expect_err("too large"));
        assert!(error.contains("expected at most 16 MB"), "{error}");
    }

    #[test]
    fn what_is_no_image_of_levels_is_refused() {
        for (text, words) in [
            ("", "got none"),
            ("0,1\n0\n", "line 2: expected 2 numbers"),
            ("0,1.01", "line 1, column 2: expected a number from 0 to 1, got \"1.01\""),
            ("# x\n0,nan", "line 2, column 2"),
            ("0,-0.1", "got \"-0.1\""),
            ("0,,1", "got \"\""),
            ("zone,drive", "got \"zone\""),
        ] {
            let error = format!("{:#}", from_text(text.as_bytes(), &LEVELS).expect_err(text));
            assert!(error.contains(words), "{error}");
        }
        assert!(from_text(&[0xff, 0xfe], &LEVELS).is_err());
        let colours = png(ColorType::Rgb, BitDepth::Eight, &[0; 12]);
        let error = from_png(&colours).expect_err("colours").to_string();
        assert!(error.contains("got Rgb of 8 bits"), "{error}");
        let grey = png(ColorType::Grayscale, BitDepth::Eight, &[0; 4]);
        assert!(from_png(&grey[..grey.len() / 2]).is_err());
    }
}
