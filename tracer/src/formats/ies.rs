// SPDX-License-Identifier: MIT OR Apache-2.0
//! IES LM-63 photometric files (`.ies`).
//!
//! [`read`] parses a text into an [`Ies`], [`write`] does the reverse, and [`Ies::distribution`]
//! gives the intensities as a [`Distribution`]. Vertical angles are measured from the axis of the
//! luminaire (nadir in the file, +z here). Horizontal angles are azimuths of type C; types A and B
//! are refused. Relative photometry gives candela for `lumens_per_lamp`, absolute photometry has -1
//! there.
//!
//! Layout: the public descriptions of LM-63-1995 and LM-63-2002. Of LM-63-2019 only the version
//! line is known here.

use super::{CLOSEST_DEG, FormatError, LARGEST};
use crate::error::Error;
use crate::source::Distribution;
use bsdf::formats::text::{check_line_ends, parse_number, quoted};
use std::fmt::Write as _;

/// Version lines that are known, the oldest layout has none.
const VERSIONS: [&str; 5] = [
    "IESNA91",
    "IESNA:LM-63-1995",
    "IESNA:LM-63-2002",
    "IES:LM-63-2019",
    "IESNA:LM-63-1986",
];

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
    /// Whether lengths are in metres, else feet.
    pub metres: bool,
    /// Width, length, height of the luminous opening.
    pub size: [f64; 3],
    /// Ballast factor.
    pub ballast_factor: f64,
    /// Input power, W.
    pub watts: f64,
    /// Shape (horizontal, vertical), before `multiplier` and `ballast_factor`.
    pub candela: Vec<f64>,
}

/// Words after the TILT line, separated by blanks, line ends, or a comma behind a word.
struct Numbers<'a> {
    words: std::vec::IntoIter<(usize, &'a str)>,
    line: usize,
}

impl<'a> Numbers<'a> {
    fn word(&mut self, what: &str) -> Result<(usize, &'a str), FormatError> {
        match self.words.next() {
            Some((line, word)) => {
                self.line = line;
                // A comma may stand behind a number, never in one.
                Ok((line, word.strip_suffix(',').unwrap_or(word)))
            }
            None => Err(FormatError::line(self.line, what, "the end of the file")),
        }
    }

    fn real(&mut self, what: &str) -> Result<f64, FormatError> {
        let (line, word) = self.word(what)?;
        parse_number(word, line, what)
    }

    fn real_that(
        &mut self,
        what: &str,
        expected: &str,
        holds: impl Fn(f64) -> bool,
    ) -> Result<f64, FormatError> {
        let (line, word) = self.word(what)?;
        let value = parse_number(word, line, what)?;
        if holds(value) {
            Ok(value)
        } else {
            let expected = format!("{what}: {expected}");
            Err(FormatError::line(line, expected, quoted(word)))
        }
    }

    /// A whole number within `low..=high`; some files write 1.0.
    fn count(&mut self, what: &str, low: usize, high: usize) -> Result<usize, FormatError> {
        let expected = format!("a whole number from {low} to {high}");
        let value = self.real_that(what, &expected, |v| {
            v.fract() == 0.0 && v >= low as f64 && v <= high as f64
        })?;
        Ok(value as usize)
    }

    /// Ascending angles.
    fn angles(
        &mut self,
        what: &str,
        count: usize,
        low: f64,
        high: f64,
    ) -> Result<Vec<f64>, FormatError> {
        let mut angles: Vec<f64> = Vec::new();
        for _ in 0..count {
            let before = angles.last().copied();
            let expected = before.map_or_else(
                || format!("{low} to {high} degrees"),
                |b| format!("above {b}, at most {high} degrees"),
            );
            let above = |a: f64| before.is_none_or(|b| a >= b + CLOSEST_DEG);
            let holds = |a: f64| (low..=high).contains(&a) && above(a);
            angles.push(self.real_that(what, &expected, holds)?);
        }
        Ok(angles)
    }

    /// How many words are left.
    fn left(&self) -> usize {
        self.words.len()
    }
}

/// Reads the text of a file.
///
/// # Errors
/// If it is not of this layout or of type A or B; an unknown version; several kinds of line end;
/// NaN or infinite values, negative intensities, angles out of order or not covering what their
/// symmetry needs; decimal commas; more flux than the lamps have, or none.
pub fn read(text: &str) -> Result<Ies, FormatError> {
    check_line_ends(text)?;
    let separator = if text.contains('\n') { '\n' } else { '\r' };
    let lines: Vec<(usize, &str)> = text
        .split(separator)
        .enumerate()
        .map(|(k, l)| {
            (
                k + 1,
                l.trim_matches(|c: char| c == '\r' || c == ' ' || c == '\t'),
            )
        })
        .collect();
    let (mut version, mut keywords) = (String::new(), Vec::new());
    let mut at = 0;
    let tilt = loop {
        let Some(&(line, content)) = lines.get(at) else {
            let end = lines.len();
            return Err(FormatError::line(
                end,
                "a line TILT=NONE",
                "the end of the file",
            ));
        };
        at += 1;
        if let Some(tilt) = content.strip_prefix("TILT=") {
            break (line, tilt.trim());
        }
        if at == 1 && content.starts_with("IES") {
            if !VERSIONS.contains(&content) {
                let expected = format!("a version line such as {}", VERSIONS[2]);
                return Err(FormatError::line(line, expected, quoted(content)));
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
    let words: Vec<(usize, &str)> = lines[at..]
        .iter()
        .flat_map(|(line, l)| l.split_whitespace().map(move |w| (*line, w)))
        .collect();
    let mut numbers = Numbers {
        words: words.into_iter(),
        line: tilt.0,
    };
    match tilt.1 {
        "NONE" => {}
        "INCLUDE" => {
            // Lamp geometry, then pairs of tilt angle and factor: read and left aside, they concern
            // tilted lamps only.
            numbers.count("lamp geometry", 1, 3)?;
            let most = numbers.left() / 2;
            let pairs = numbers.count("number of tilt angles", 1, most.max(1))?;
            for _ in 0..2 * pairs {
                numbers.real("a tilt angle or factor")?;
            }
        }
        other => {
            let expected = "TILT=NONE or TILT=INCLUDE";
            return Err(FormatError::line(
                tilt.0,
                expected,
                quoted(&format!("TILT={other}")),
            ));
        }
    }
    body(version, keywords, &mut numbers)
}

fn body(
    version: String,
    keywords: Vec<(String, String)>,
    numbers: &mut Numbers<'_>,
) -> Result<Ies, FormatError> {
    let lamps = numbers.count("number of lamps", 1, 10_000)?;
    let positive = |v: f64| v > 0.0 && v <= LARGEST;
    let lumens_per_lamp =
        numbers.real_that("lumens per lamp", "above 0 up to 1e30, or -1", |v| {
            positive(v) || (v + 1.0).abs() < 1e-9
        })?;
    let lamp_line = numbers.line;
    let multiplier = numbers.real_that("multiplier", "above 0 up to 1e30", positive)?;
    let most = numbers.left();
    let count_v = numbers.count("number of vertical angles", 2, most.max(2))?;
    let count_h = numbers.count("number of horizontal angles", 1, most.max(1))?;
    numbers.real_that(
        "photometric type",
        "1 (C, about the axis of the luminaire)",
        |v| (v - 1.0).abs() < 1e-9,
    )?;
    let metres = numbers.count("units type", 1, 2)? == 2;
    let mut size = [0.0; 3];
    for length in &mut size {
        *length = numbers.real("a length of the luminous opening")?;
    }
    let ballast_factor = numbers.real_that("ballast factor", "above 0 up to 1e30", positive)?;
    numbers.real("ballast-lamp factor")?;
    let watts = numbers.real_that("input watts", "0 or more", |v| v >= 0.0)?;
    let angles = count_v.saturating_add(count_h);
    let (left, line) = (numbers.left(), numbers.line);
    let stated = angles.saturating_add(count_v.saturating_mul(count_h));
    // Wrong counts let angles of one kind, or candela, be read as those of the other.
    let miscounted = |wrong: FormatError| {
        if left == stated || left < angles {
            return wrong;
        }
        let expected = format!(
            "{stated} numbers behind the input watts, for {count_v} vertical and {count_h} horizontal angles with {count_h} x {count_v} candela values"
        );
        FormatError::line(line, expected, left.to_string())
    };
    let vertical = numbers
        .angles("a vertical angle", count_v, 0.0, 180.0)
        .map_err(miscounted)?;
    let horizontal = numbers
        .angles("a horizontal angle", count_h, 0.0, 360.0)
        .map_err(miscounted)?;
    if mirrors(&horizontal).is_none() {
        let expected = "horizontal angles: one alone, or 0 to 90, 180 or 360, or 90 to 270 degrees";
        let got = format!("{} to {}", horizontal[0], horizontal[count_h - 1]);
        return Err(FormatError::line(numbers.line, expected, got));
    }
    let left = numbers.left();
    let expected = count_v.saturating_mul(count_h);
    if left != expected {
        let line = numbers.line;
        let expected = format!("{expected} candela values ({count_h} x {count_v})");
        return Err(FormatError::line(line, expected, left.to_string()));
    }
    let mut candela = Vec::with_capacity(expected);
    for _ in 0..expected {
        let range = 0.0..=LARGEST;
        candela.push(
            numbers.real_that("a candela value", "0 or more, up to 1e30", |v| {
                range.contains(&v)
            })?,
        );
    }
    let ies = Ies {
        version,
        keywords,
        lamps,
        lumens_per_lamp,
        multiplier,
        vertical,
        horizontal,
        metres,
        size,
        ballast_factor,
        watts,
        candela,
    };
    // The ballast factor lowers the lamps and the candela alike.
    let stated = lumens_per_lamp * lamps as f64 * ballast_factor;
    let stated = (!ies.is_absolute()).then_some(stated);
    super::usable(ies.distribution(), stated, [lamp_line, numbers.line])?;
    Ok(ies)
}

impl Ies {
    /// Whether candela values are absolute.
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
            version: VERSIONS[2].to_owned(),
            keywords,
            lamps: 1,
            lumens_per_lamp,
            multiplier: 1.0,
            vertical,
            horizontal,
            metres: true,
            size: [0.0; 3],
            ballast_factor: 1.0,
            watts,
            candela,
        }
    }
}

/// Whether two angles in degrees are the same to rounding.
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
            "horizontal angles: expected one alone, or 0 to 90, 180 or 360, or 90 to 270 degrees, got {first} to {last}"
        ))
    })?;
    let mut planes: Vec<(f64, Vec<f64>)> = horizontal
        .iter()
        .zip(rows)
        .map(|(h, row)| (h.rem_euclid(360.0), row.to_vec()))
        .collect();
    for mirror in mirrors {
        let images: Vec<_> = planes
            .iter()
            .map(|(h, row)| ((2.0 * mirror - h).rem_euclid(360.0), row.clone()))
            .collect();
        planes.extend(images);
    }
    planes.sort_by(|a, b| a.0.total_cmp(&b.0));
    planes.dedup_by(|a, b| is(a.0, b.0) || is(a.0 - 360.0, b.0));
    // 360 wraps to 0; what is a rounding error below it is 0 too.
    if planes.len() > 1 && is(planes[planes.len() - 1].0, 360.0) {
        planes.pop();
    }
    if planes.len() == 1 {
        planes[0].0 = 0.0;
    }
    Ok(planes.into_iter().unzip())
}

/// The text of a file.
#[must_use]
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
pub(super) fn significant(value: f64, digits: usize) -> String {
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
