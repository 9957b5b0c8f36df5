// SPDX-License-Identifier: MIT OR Apache-2.0
//! Text ray files of LightTools and Zemax: a line for each ray, of start, direction, power and,
//! where it has one, wavelength.
//!
//! LightTools writes a header of `lt_` keys, the flux of all rays among them, and `lt_endofdata`
//! behind the rays, whose powers are relative as in its binary files. A file for Zemax begins with
//! the number of rays and the code of the unit of length, states no unit of flux (W is the
//! program's), and has wavelengths in micrometres. Lines pass one after another.
//!
//! Layouts: the public code and files of TM25RaySetTools.

use crate::text::{parse_number, quoted};
use std::io::{BufRead, BufReader, ErrorKind, Read, Seek, Write};

use crate::rays::{
    LIGHTTOOLS_UNITS, LightToolsHeader, RayColumns, RayFileError, RayRecord, RaySink,
    ZEMAX_MILLIMETRES, sound,
};
use crate::text::{FormatError, Position};

/// Largest number of bytes of a line.
const MAX_LINE: usize = 4096;
/// Columns of a ray.
const ROW: &str = "x, y, z, direction, power and perhaps a wavelength";

/// Lines that are not blank, with their numbers.
struct Lines<R> {
    inner: BufReader<R>,
    bytes: Vec<u8>,
    number: usize,
    after_return: bool,
}

impl<R: Read> Lines<R> {
    fn new(source: R) -> Self {
        let inner = BufReader::with_capacity(1 << 16, source);
        Self { inner, bytes: Vec::new(), number: 0, after_return: false }
    }

    /// The next one, trimmed; `None` at the end.
    fn next(&mut self) -> Result<Option<String>, RayFileError> {
        loop {
            self.bytes.clear();
            let end = self.line()?;
            let pair = self.after_return && end == Some(b'\n') && self.bytes.is_empty();
            self.number += usize::from(!pair);
            self.after_return = end == Some(b'\r');
            let text = String::from_utf8_lossy(&self.bytes);
            let text = text.trim_start_matches('\u{feff}').trim();
            if !text.is_empty() {
                return Ok(Some(text.to_owned()));
            }
            if end.is_none() {
                return Ok(None);
            }
        }
    }

    /// Reads a line of any ending, and returns the byte that ended it.
    fn line(&mut self) -> Result<Option<u8>, RayFileError> {
        loop {
            let buffer = match self.inner.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                other => other?,
            };
            let found = buffer.iter().position(|b| matches!(b, b'\n' | b'\r'));
            let used = found.unwrap_or(buffer.len());
            self.bytes.extend_from_slice(&buffer[..used]);
            let end = found.map(|at| buffer[at]);
            let at_end = buffer.is_empty();
            self.inner.consume(used + usize::from(found.is_some()));
            if self.bytes.len() > MAX_LINE {
                let expected = format!("a line of at most {MAX_LINE} bytes");
                return Err(FormatError::line(self.number + 1, expected, "a longer one").into());
            }
            if at_end || end.is_some() {
                return Ok(end);
            }
        }
    }
}

/// Rows of rays, all of one number of columns.
struct Rows {
    /// 7 or 8; 0 before the first row.
    columns: usize,
    millimetres: f32,
    nanometres: f32,
    rays: u64,
    sum: f64,
}

impl Rows {
    fn ray(&mut self, text: &str, line: usize) -> Result<RayRecord, FormatError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let fits = match self.columns {
            0 => matches!(words.len(), 7 | 8),
            columns => words.len() == columns,
        };
        if !fits {
            let expected = match self.columns {
                0 => format!("7 or 8 numbers, {ROW}"),
                columns => format!("{columns} numbers, as in the rows above"),
            };
            let got = format!("{} in {}", words.len(), quoted(text));
            return Err(FormatError::line(line, expected, got));
        }
        self.columns = words.len();
        let mut row = [f32::NAN; 8];
        for (slot, word) in row.iter_mut().zip(words) {
            *slot = parse_number(word, line, ROW)? as f32;
        }
        let [x, y, z, l, m, n, flux, wavelength] = row;
        let ray = RayRecord {
            position: [x, y, z].map(|p| p * self.millimetres),
            direction: [l, m, n],
            flux,
            wavelength: wavelength * self.nanometres,
        };
        let ray = sound(ray, |_| Position::Line(line))?;
        self.rays += 1;
        self.sum += f64::from(ray.flux);
        Ok(ray)
    }
}

/// Reads rays from a text of LightTools.
pub struct LightToolsTextReader<R> {
    lines: Lines<R>,
    rows: Rows,
    header: LightToolsHeader,
}

impl<R: Read> LightToolsTextReader<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// If it is none, of another version, or of rays whose starts do not count.
    pub fn new(source: R) -> Result<Self, RayFileError> {
        let mut lines = Lines::new(source);
        let mut header = LightToolsHeader {
            radiant: true,
            coloured: false,
            origin: [0.0; 3],
            flux: f32::NAN,
            millimetres: 1.0,
        };
        let mut columns = 0;
        loop {
            let Some(text) = lines.next()? else {
                let expected = "lt_startofdata before the rays";
                return Err(FormatError::line(lines.number, expected, "the end of the file").into());
            };
            let text = text.to_ascii_lowercase();
            if text == "lt_startofdata" {
                break;
            }
            let (key, value) = text.split_once([':', ' ', '\t']).unwrap_or((&text, ""));
            let value = value.trim();
            let expected = match (key, value) {
                ("lt_rdf_version", v) if !v.starts_with('2') => "version 2",
                ("lt_datatype", "radiant_power" | "luminous_flux") => {
                    header.radiant = value == "radiant_power";
                    continue;
                }
                ("lt_datatype", _) => "radiant_power or luminous_flux",
                ("lt_far_field_data", v) if v != "no" => "no (rays with their starts)",
                ("lt_color_info", "none" | "wavelength") => {
                    columns = if value == "none" { 7 } else { 8 };
                    continue;
                }
                ("lt_color_info", _) => "none or wavelength",
                ("lt_length_units", _) => {
                    match LIGHTTOOLS_UNITS.iter().find(|unit| unit.0 == value) {
                        Some(unit) => {
                            header.millimetres = unit.1;
                            continue;
                        }
                        None => "a unit of length, as millimeters",
                    }
                }
                ("lt_radiant_flux" | "lt_luminous_flux", _) => {
                    header.flux = parse_number(value, lines.number, key)? as f32;
                    if header.flux >= 0.0 && header.flux.is_finite() {
                        continue;
                    }
                    "a flux of 0 or more"
                }
                _ => continue,
            };
            let expected = format!("{key}: {expected}");
            return Err(FormatError::line(lines.number, expected, quoted(value)).into());
        }
        let millimetres = header.millimetres;
        let rows = Rows { columns, millimetres, nanometres: 1.0, rays: 0, sum: 0.0 };
        Ok(Self { lines, rows, header })
    }

    /// The header; where it says nothing of colour, the first ray does.
    pub fn header(&self) -> LightToolsHeader {
        LightToolsHeader { coloured: self.rows.columns == 8, ..self.header }
    }

    /// Sum of the powers of the rays read so far.
    pub fn sum(&self) -> f64 {
        self.rows.sum
    }

    /// The next ray; `None` after the last.
    ///
    /// # Errors
    /// If a line is no ray, or the file does not end with its end mark.
    pub fn next_ray(&mut self) -> Result<Option<RayRecord>, RayFileError> {
        let Some(text) = self.lines.next()? else {
            let expected = "lt_endofdata after the rays";
            let line = self.lines.number;
            return Err(FormatError::line(line, expected, "the end of the file").into());
        };
        if !text.eq_ignore_ascii_case("lt_endofdata") {
            return Ok(Some(self.rows.ray(&text, self.lines.number)?));
        }
        match self.lines.next()? {
            None => Ok(None),
            Some(more) => {
                let expected = "the end after lt_endofdata";
                Err(FormatError::line(self.lines.number, expected, quoted(&more)).into())
            }
        }
    }
}

/// Number of rays and millimetres of the unit of length, of the first line of a text for Zemax.
fn zemax_header(text: &str) -> Option<(u64, f32)> {
    let mut numbers = text.split_whitespace().map(|word| word.parse::<f64>().ok());
    let mut whole = || numbers.next().flatten().filter(|v| v.fract() == 0.0 && *v >= 0.0);
    let (rays, unit) = (whole()? as u64, whole()? as usize);
    Some((rays, *ZEMAX_MILLIMETRES.get(unit)?))
}

/// Least numbers in a line that is meant to be a ray, and most of an oddly written one.
const NUMBERS_OF_RAY: std::ops::RangeInclusive<usize> = 6..=16;

/// True if a text of these lines begins as one for Zemax does: number of rays and unit, then a line of
/// numbers that is meant to be a ray, whatever is wrong with it.
pub fn begins_like_zemax(lines: &[&str]) -> bool {
    let mut filled =
        lines.iter().filter(|line| !line.is_empty()).map(|line| line.replace(',', " "));
    // Some programs fill the first line up with zeros.
    let is_filled =
        |line: &str| line.split_whitespace().skip(2).all(|word| word.parse() == Ok(0.0));
    let header = filled.next().filter(|line| is_filled(line)).and_then(|line| zemax_header(&line));
    let is_row = |line: String| {
        let words: Vec<&str> = line.split_whitespace().collect();
        NUMBERS_OF_RAY.contains(&words.len())
            && words.iter().all(|word| word.parse::<f64>().is_ok())
    };
    header.is_some_and(|(rays, _)| rays > 0) && filled.next().is_some_and(is_row)
}

/// Reads rays from a text for Zemax.
pub struct ZemaxTextReader<R> {
    lines: Lines<R>,
    rows: Rows,
    left: u64,
}

impl<R: Read> ZemaxTextReader<R> {
    /// Reads the first line.
    ///
    /// # Errors
    /// If it is none.
    pub fn new(source: R) -> Result<Self, RayFileError> {
        let mut lines = Lines::new(source);
        let text = lines.next()?.unwrap_or_default();
        let Some((left, millimetres)) = zemax_header(&text) else {
            let expected = "number of rays and unit of length, 0 to 4, with a blank between";
            return Err(FormatError::line(lines.number, expected, quoted(&text)).into());
        };
        let rows = Rows { columns: 0, millimetres, nanometres: 1e3, rays: 0, sum: 0.0 };
        Ok(Self { lines, rows, left })
    }

    /// True if rays have wavelengths, as the first of them says.
    pub fn is_coloured(&self) -> bool {
        self.rows.columns == 8
    }

    /// Sum of the powers of the rays read so far.
    pub fn sum(&self) -> f64 {
        self.rows.sum
    }

    /// The next ray; `None` after the last.
    ///
    /// # Errors
    /// If a line is no ray, or there are more or fewer than the first line says.
    pub fn next_ray(&mut self) -> Result<Option<RayRecord>, RayFileError> {
        let text = self.lines.next()?;
        let line = self.lines.number;
        match (text, self.left) {
            (None, 0) => Ok(None),
            (Some(text), 1..) => {
                self.left -= 1;
                Ok(Some(self.rows.ray(&text, line)?))
            }
            (text, left) => {
                let expected = format!("{} rays, as the first line says", self.rows.rays + left);
                let got = text.map_or("the end of the file".to_owned(), |more| quoted(&more));
                Err(FormatError::line(line, expected, got).into())
            }
        }
    }
}

/// Writes rays as text, in millimetres.
pub struct TextRayWriter<W: Write + Seek> {
    sink: RaySink<W>,
    columns: usize,
    /// Unit of wavelengths in nm.
    nanometres: f32,
    /// Last line, and the place of the number that is known at the end.
    end: &'static str,
    late_at: u64,
    late: fn(u64, f64) -> String,
}

impl<W: Write + Seek> TextRayWriter<W> {
    /// Writer for LightTools.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn lighttools(sink: W, about: &str, columns: RayColumns) -> Result<Self, RayFileError> {
        let about: String = about.chars().filter(|c| !c.is_control()).collect();
        let datatype = if columns.radiant { "radiant_power" } else { "luminous_flux" };
        let colour = if columns.coloured { "wavelength" } else { "none" };
        let start = format!(
            "# {about}\n# Ray Data Export File\nlt_rdf_version: 2.0\nlt_datatype: {datatype}\n\
             lt_far_field_data: no\nlt_color_info: {colour}\nlt_length_units: millimeters\n\
             lt_data_origin: 0 0 0\nlt_radiant_flux: "
        );
        let late = |_, sum: f64| format!("{:<16e}", sum as f32);
        let header = format!("{start}{}\nlt_startofdata\n", late(0, 0.0));
        Ok(Self {
            sink: RaySink::new(sink, header.as_bytes())?,
            columns: 7 + usize::from(columns.coloured),
            nanometres: 1.0,
            end: "lt_endofdata\n",
            late_at: start.len() as u64,
            late,
        })
    }

    /// Writer for Zemax, of rays with flux in W.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn zemax(sink: W, coloured: bool) -> Result<Self, RayFileError> {
        // Code 4 is a millimetre.
        let late = |rays: u64, _| format!("{rays:<20}");
        let header = format!("{} 4\n", late(0, 0.0));
        Ok(Self {
            sink: RaySink::new(sink, header.as_bytes())?,
            columns: 7 + usize::from(coloured),
            nanometres: 1e3,
            end: "",
            late_at: 0,
            late,
        })
    }

    /// Writes one ray.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn write(&mut self, ray: &RayRecord) -> Result<(), RayFileError> {
        let ([x, y, z], [l, m, n]) = (ray.position, ray.direction);
        let row = [x, y, z, l, m, n, ray.flux, ray.wavelength / self.nanometres];
        Ok(self.sink.push_line(&row[..self.columns], ray.flux)?)
    }

    /// Writes the last line, fills in the header, and returns the number of rays and their flux.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn finish(self) -> Result<(u64, f64), RayFileError> {
        let late = |rays: u64, sum: f64| (self.late)(rays, sum).into_bytes();
        Ok(self.sink.finish(self.end.as_bytes(), self.late_at, late)?)
    }
}
