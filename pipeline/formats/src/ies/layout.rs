// SPDX-License-Identifier: MIT OR Apache-2.0
//! IES LM-63 photometric files (`.ies`).
//!
//! [`read`] parses a text into an [`Ies`], [`write()`] does the reverse, and [`Ies::distribution`]
//! gives the intensities as a [`Distribution`]. Vertical angles are measured from the axis of the
//! luminaire (nadir in the file, +z here). Horizontal angles are azimuths of type C; types A and B
//! are refused. Relative photometry gives candela for `lumens_per_lamp`, absolute photometry has -1
//! there.
//!
//! Layout: the public descriptions of LM-63-1995 and LM-63-2002. Of LM-63-2019 only the version
//! line is known here.

use crate::fields::Fields;
use crate::fields::LARGEST;
use crate::text::FormatError;
use crate::text::{check_line_ends, quoted};
use std::fmt::Write as _;
use tracer::Distribution;
use tracer::Error;

/// Known version lines; the oldest layout has none. Years of two digits are a commercial program's.
const VERSIONS: [&str; 8] = [
    "IESNA91",
    "IESNA:LM-63-1995",
    WRITTEN,
    "IES:LM-63-2019",
    "IESNA:LM-63-1986",
    "IESNA:LM-63-95",
    "IESNA:LM-63-86",
    "IESNA86",
];
/// The version that is written.
const WRITTEN: &str = "IESNA:LM-63-2002";

/// Most values on a written line.
const PER_LINE: usize = 10;

/// The content of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Ies {
    /// First line; empty for files of 1986, which have none.
    pub version: String,
    /// `[KEYWORD] text` lines in order, keyword without brackets; other lines of the header have an
    /// empty keyword.
    pub keywords: Vec<(String, String)>,
    /// Number of lamps.
    pub lamps: usize,
    /// Lumens of one lamp; -1 for absolute photometry.
    pub lumens_per_lamp: f64,
    /// Factor on all candela values.
    pub multiplier: f64,
    /// Vertical angles, degrees.
    pub vertical: Vec<f64>,
    /// Horizontal angles, degrees.
    pub horizontal: Vec<f64>,
    /// True if lengths are in metres, else feet.
    pub metres: bool,
    /// Width, length, height of the luminous opening.
    pub size: [f64; 3],
    /// Ballast factor.
    pub ballast_factor: f64,
    /// Input power, W.
    pub watts: f64,
    /// Shape (horizontal, vertical), before `multiplier` and `ballast_factor`.
    pub candela: Vec<f64>,
    /// Oddities of the file that was read, though it can be used.
    pub warnings: Vec<String>,
}

/// Reads the text of a file.
///
/// # Errors
/// If it is not of this layout or of type A or B; several kinds of line end; NaN or infinite
/// values, negative intensities, angles out of order or not covering what their symmetry needs;
/// decimal commas; no flux. An unknown version and more flux than the lamps have are
/// [warnings](Ies::warnings).
pub fn read(text: &str) -> Result<Ies, FormatError> {
    check_line_ends(text)?;
    let separator = if text.contains('\n') { '\n' } else { '\r' };
    let lines: Vec<(usize, &str)> = text
        .split(separator)
        .enumerate()
        .map(|(k, l)| (k + 1, l.trim_matches(|c: char| c == '\r' || c == ' ' || c == '\t')))
        .collect();
    let (mut version, mut keywords, mut warnings) = (String::new(), Vec::new(), Vec::new());
    let mut at = 0;
    let tilt = loop {
        let Some(&(line, content)) = lines.get(at) else {
            let end = lines.len();
            return Err(FormatError::line(end, "a line TILT=NONE", "the end of the file"));
        };
        at += 1;
        if let Some(tilt) = content.strip_prefix("TILT=") {
            break (line, tilt.trim());
        }
        if at == 1 && content.starts_with("IES") {
            if !VERSIONS.contains(&content) {
                warnings.push(format!(
                    "line {line}: version {} is not known here; read as {WRITTEN}",
                    quoted(content)
                ));
            }
            content.clone_into(&mut version);
            continue;
        }
        let bracketed = content.strip_prefix('[').and_then(|c| c.split_once(']'));
        match bracketed {
            Some((name, rest)) => keywords.push((name.to_owned(), rest.trim().to_owned())),
            None if content.is_empty() => {}
            None if at == 1 && !text.contains("TILT=") => {
                let expected = "a version line, keywords, and a line TILT=NONE";
                return Err(FormatError::line(line, expected, quoted(content)));
            }
            None => keywords.push((String::new(), content.to_owned())),
        }
    };
    let (mut ies, line) = numbers(&lines[at..], tilt)?;
    // The ballast factor lowers the lamps and the candela alike.
    let stated = ies.lumens_per_lamp * ies.lamps as f64 * ies.ballast_factor;
    let stated = (!ies.is_absolute()).then_some(stated);
    warnings.extend(crate::fields::usable(ies.distribution(), stated, line)?);
    (ies.version, ies.keywords, ies.warnings) = (version, keywords, warnings);
    Ok(ies)
}

/// The numbers behind the TILT line, and the number of the last line, of words that blanks, line ends,
/// or a comma and a blank separate. Commas alone separate too (LM-63 before 2002) where the counts are
/// right by that; a word with one of them is else a number with a decimal comma.
fn numbers(lines: &[(usize, &str)], tilt: (usize, &str)) -> Result<(Ies, usize), FormatError> {
    let by_blanks = words(lines, char::is_whitespace);
    let commas = by_blanks.iter().map(|(_, word)| word.matches(',').count()).max().unwrap_or(0);
    let read = tilted(by_blanks, tilt);
    if read.is_ok() || commas == 0 {
        return read;
    }
    let by_commas = tilted(words(lines, |c| c.is_whitespace() || c == ','), tilt);
    if by_commas.is_ok() || commas > 1 { by_commas } else { read }
}

/// The words of lines, each with the number of its line; a comma behind a word is none of it.
fn words<'a>(lines: &[(usize, &'a str)], is_separator: fn(char) -> bool) -> Vec<(usize, &'a str)> {
    let words = lines.iter().flat_map(|(line, content)| {
        let words = content.split(is_separator);
        words.map(|word| (*line, word.strip_suffix(',').unwrap_or(word)))
    });
    words.filter(|(_, word)| !word.is_empty()).collect()
}

/// The numbers behind the TILT line, and the number of the last line.
fn tilted(words: Vec<(usize, &str)>, tilt: (usize, &str)) -> Result<(Ies, usize), FormatError> {
    let end = words.last().map_or(tilt.0, |(line, _)| *line);
    let mut fields = Fields::new(words, end);
    match tilt.1 {
        "NONE" => {}
        "INCLUDE" => {
            // Lamp geometry, then pairs of tilt angle and factor, which concern tilted lamps only.
            fields.count("lamp geometry", 1, 3)?;
            let max = fields.left() / 2;
            let pairs = fields.count("number of tilt angles", 1, max)?;
            for _ in 0..2 * pairs {
                fields.real("a tilt angle or factor")?;
            }
        }
        other => {
            let expected = "TILT=NONE or TILT=INCLUDE";
            return Err(FormatError::line(tilt.0, expected, quoted(&format!("TILT={other}"))));
        }
    }
    let ies = body(&mut fields)?;
    Ok((ies, fields.line))
}

/// Content behind the TILT line.
fn body(fields: &mut Fields<'_>) -> Result<Ies, FormatError> {
    let lamps = fields.count("number of lamps", 1, 10_000)?;
    let positive = |v: f64| v > 0.0 && v <= LARGEST;
    let lumens_per_lamp =
        fields.real_that("lumens per lamp", "above 0 up to 1e30, or -1", |v| {
            positive(v) || (v + 1.0).abs() < 1e-9
        })?;
    let multiplier = fields.real_that("multiplier", "above 0 up to 1e30", positive)?;
    let max = fields.left();
    let count_v = fields.count("number of vertical angles", 2, max)?;
    let count_h = fields.count("number of horizontal angles", 1, max)?;
    fields.real_that("photometric type", "1 (C, about the axis of the luminaire)", |v| {
        (v - 1.0).abs() < 1e-9
    })?;
    let metres = fields.count("units type", 1, 2)? == 2;
    let mut size = [0.0; 3];
    for length in &mut size {
        *length = fields.real("a length of the luminous opening")?;
    }
    let ballast_factor = fields.real_that("ballast factor", "above 0 up to 1e30", positive)?;
    fields.real("ballast-lamp factor")?;
    let watts = fields.real_that("input watts", "0 or more", |v| v >= 0.0)?;
    let angles = count_v.saturating_add(count_h);
    let (left, line) = (fields.left(), fields.line);
    let stated = angles.saturating_add(count_v.saturating_mul(count_h));
    // Wrong counts let angles of one kind, or candela, be read as those of the other.
    let miscounted = |wrong: FormatError| {
        if left == stated || left < angles {
            return wrong;
        }
        let expected = format!(
            "{stated} numbers behind the input watts, for {count_v} vertical and {count_h} \
                horizontal angles with {count_h} x {count_v} candela values"
        );
        FormatError::line(line, expected, left.to_string())
    };
    let vertical = fields.angles("a vertical angle", count_v, 180.0).map_err(miscounted)?;
    let horizontal = fields.angles("a horizontal angle", count_h, 360.0).map_err(miscounted)?;
    if mirrors(&horizontal).is_none() {
        let expected = "horizontal angles: one alone, or 0 to 90, 180 or 360, or 90 to 270 degrees";
        let got = format!("{} to {}", horizontal[0], horizontal[count_h - 1]);
        return Err(FormatError::line(fields.line, expected, got));
    }
    let left = fields.left();
    let expected = count_v.saturating_mul(count_h);
    if left != expected {
        let line = fields.line;
        let expected = format!("{expected} candela values ({count_h} x {count_v})");
        return Err(FormatError::line(line, expected, left.to_string()));
    }
    let mut candela = Vec::with_capacity(expected);
    for _ in 0..expected {
        let range = 0.0..=LARGEST;
        candela.push(
            fields.real_that("a candela value", "0 or more, up to 1e30", |v| range.contains(&v))?,
        );
    }
    Ok(Ies {
        lamps,
        lumens_per_lamp,
        multiplier,
        metres,
        size,
        ballast_factor,
        watts,
        ..Ies::absolute(vertical, horizontal, candela)
    })
}

impl Ies {
    /// A file of absolute candela values alone.
    pub(crate) fn absolute(vertical: Vec<f64>, horizontal: Vec<f64>, candela: Vec<f64>) -> Self {
        Self {
            version: String::new(),
            keywords: Vec::new(),
            lamps: 1,
            lumens_per_lamp: -1.0,
            multiplier: 1.0,
            vertical,
            horizontal,
            metres: true,
            size: [0.0; 3],
            ballast_factor: 1.0,
            watts: 0.0,
            candela,
            warnings: Vec::new(),
        }
    }

    /// True if candela values are absolute.
    pub fn is_absolute(&self) -> bool {
        self.lumens_per_lamp < 0.0
    }

    /// Candela around the whole circle.
    ///
    /// # Errors
    /// If its horizontal angles fit no symmetry, or there is no light at all.
    pub fn distribution(&self) -> Result<Distribution, Error> {
        let rows: Vec<&[f64]> = self.candela.chunks_exact(self.vertical.len()).collect();
        let (phis, rows) = unfolded(&self.horizontal, &rows)?;
        let factor = self.multiplier * self.ballast_factor;
        let values = rows.into_iter().flatten().map(|v| v * factor).collect();
        Distribution::new(&self.vertical, &phis, values)
    }

    /// A file of candela values over a distribution in candela; `lumens_per_lamp` is -1 for
    /// absolute photometry.
    pub fn from_distribution(
        table: &Distribution,
        keywords: Vec<(String, String)>,
        lumens_per_lamp: f64,
        watts: f64,
    ) -> Self {
        let (vertical, mut horizontal) = (table.thetas_deg(), table.phis_deg());
        let planes = horizontal.len();
        let mut candela: Vec<f64> = (0..planes)
            .flat_map(|p| (0..vertical.len()).map(move |v| (p, v)))
            .map(|(p, v)| table.value(p, v))
            .collect();
        if planes > 1 {
            horizontal.push(360.0);
            candela.extend_from_within(..vertical.len());
        }
        Self {
            version: WRITTEN.to_owned(),
            keywords,
            lumens_per_lamp,
            watts,
            ..Self::absolute(vertical, horizontal, candela)
        }
    }
}

/// True if two angles in degrees are the same to rounding.
fn is(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

/// Planes at which those of a file are mirrored to go around the whole circle; `None` where they
/// fit no symmetry.
fn mirrors(horizontal: &[f64]) -> Option<&'static [f64]> {
    let (first, last) = (horizontal[0], horizontal[horizontal.len() - 1]);
    let within = |low: f64, high: f64| is(first, low) && is(last, high);
    Some(if horizontal.len() == 1 || within(0.0, 360.0) {
        &[]
    } else if within(0.0, 180.0) {
        &[180.0]
    } else if within(90.0, 270.0) {
        &[90.0]
    } else if within(0.0, 90.0) {
        &[90.0, 180.0]
    } else {
        return None;
    })
}

/// Planes of one symmetry around the whole circle: those given, and their mirror images.
fn unfolded(horizontal: &[f64], rows: &[&[f64]]) -> Result<(Vec<f64>, Vec<Vec<f64>>), Error> {
    let mirrors = mirrors(horizontal).ok_or_else(|| {
        let (first, last) = (horizontal[0], horizontal[horizontal.len() - 1]);
        Error::Format(format!(
            "horizontal angles: expected one alone, or 0 to 90, 180 or 360, or 90 to 270 degrees, \
                got {first} to {last}"
        ))
    })?;
    let mut planes: Vec<(f64, Vec<f64>)> =
        horizontal.iter().zip(rows).map(|(h, row)| (h.rem_euclid(360.0), row.to_vec())).collect();
    for mirror in mirrors {
        let images: Vec<_> = planes
            .iter()
            .map(|(h, row)| ((2.0 * mirror - h).rem_euclid(360.0), row.clone()))
            .collect();
        planes.extend(images);
    }
    planes.sort_by(|a, b| a.0.total_cmp(&b.0));
    planes.dedup_by(|a, b| is(a.0, b.0) || is(a.0 - 360.0, b.0));
    // 360 wraps to 0, and so does an angle below it by rounding.
    if planes.len() > 1 && is(planes[planes.len() - 1].0, 360.0) {
        planes.pop();
    }
    if planes.len() == 1 {
        planes[0].0 = 0.0;
    }
    Ok(planes.into_iter().unzip())
}

/// The text of a file.
pub fn write(ies: &Ies) -> String {
    let mut text = String::new();
    if !ies.version.is_empty() {
        text.push_str(&ies.version);
        text.push_str("\r\n");
    }
    for (keyword, value) in &ies.keywords {
        let value = value.replace(['\r', '\n'], " ");
        // Writing to a String cannot fail.
        let _ = if keyword.is_empty() {
            write!(text, "{value}\r\n")
        } else {
            write!(text, "[{keyword}] {value}\r\n")
        };
    }
    let [width, length, height] = ies.size;
    let _ = write!(
        text,
        "TILT=NONE\r\n{} {} {} {} {} 1 {} {width} {length} {height}\r\n{} 1 {}\r\n",
        ies.lamps,
        ies.lumens_per_lamp,
        ies.multiplier,
        ies.vertical.len(),
        ies.horizontal.len(),
        if ies.metres { 2 } else { 1 },
        ies.ballast_factor,
        ies.watts
    );
    let mut lines = |values: &[f64], digits: Option<usize>| {
        for line in values.chunks(PER_LINE) {
            let words: Vec<String> = line
                .iter()
                .map(|v| digits.map_or_else(|| v.to_string(), |d| significant(*v, d)))
                .collect();
            text.push_str(&words.join(" "));
            text.push_str("\r\n");
        }
    };
    lines(&ies.vertical, None);
    lines(&ies.horizontal, None);
    for plane in ies.candela.chunks_exact(ies.vertical.len()) {
        lines(plane, Some(7));
    }
    text
}

/// A value with `digits` significant digits, without exponent.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let places = (digits as i32 - 1 - value.abs().log10().floor() as i32).clamp(0, 12);
    let text = format!("{value:.*}", places as usize);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
