// SPDX-License-Identifier: MIT OR Apache-2.0
//! Speos BSDFs: `.anisotropicbsdf` (rotations of the sample, one spectrum for all) and `.brdf`
//! (isotropic, a table for each wavelength), as text; the first also in binary mode.
//!
//! In: the bytes of a file, or a [`SpeosBsdf`]. Out: the other. Light arrives travelling along +x
//! of a frame about the normal z; scatter angles are spherical in that frame, so the specular
//! direction is at the angle of incidence and azimuth 0, and transmission lies from 90 to 180
//! degrees. A file holds light from one side and does not say which.
//!
//! Sources of the layout: the vendor's help, "Structure of Anisotropic BSDF Files" and "Structure
//! of BRDF files" (Optis Labs), text mode; sample files of `ansys/optical-automation` and
//! `ansys/pyspeos`. Binary `.brdf` and `.bsdf180` are refused with a hint.

use super::binary;
use crate::text::{FormatError, Tokens, check_line_ends, push_rows, quoted, utf8};
use bsdf::Transport;
use std::fmt::Write as _;
use std::io::{self, Write};

/// First words of the two kinds of file.
const HEADINGS: [&str; 2] = ["OPTIS - Anisotropic BSDF surface file", "OPTIS - brdf surface file"];
/// The version that is written.
const VERSION: &str = "v8.0";
/// Wavelength at which coefficients of a spectrum are taken, nm: middle of the visible.
pub const WAVELENGTH_NM: f64 = 550.0;

/// Meaning of the values of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Values {
    /// Proportional to the BSDF.
    Bsdf,
    /// Proportional to the intensity: BSDF times the cosine to the normal.
    Intensity,
}

/// The table of one incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeosTable {
    /// Rotation of the sample: azimuth of the anisotropy vector about the normal, degrees, from the
    /// plane of incidence; 0 in isotropic files.
    pub rotation: f64,
    /// Angle of incidence, degrees.
    pub incidence: f64,
    /// Scattered power per incident power, where the file states it for this table.
    pub total: Option<f64>,
    /// Azimuths, degrees.
    pub azimuths: Vec<f64>,
    /// Angles from the normal of the side that light leaves on, 0 to 90 degrees.
    pub thetas: Vec<f64>,
    /// Values, shape (theta, azimuth).
    pub values: Vec<f64>,
}

/// Reflection or transmission of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeosPart {
    /// The one of the two.
    pub transport: Transport,
    /// Angle of incidence and share of the power that the spectrum belongs to; the tables follow it
    /// in proportion. `None` where every table states its own.
    pub reference: Option<[f64; 2]>,
    /// Tables by rotation, then by incidence, both ascending.
    pub tables: Vec<SpeosTable>,
}

/// The content of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeosBsdf {
    /// The comment line.
    pub comment: String,
    /// Meaning of the values.
    pub values: Values,
    /// Reflection, transmission or both.
    pub parts: Vec<SpeosPart>,
    /// Oddities of the file that was read, and what was left out.
    pub warnings: Vec<String>,
}

/// Reads the bytes of a file.
///
/// # Errors
/// If it is not of this layout, or of binary content that is not known; several kinds of line end;
/// NaN, infinite or negative values; angles out of order; a power above 1.
pub fn read(bytes: &[u8]) -> Result<SpeosBsdf, FormatError> {
    let mut lines = bytes.split(|b| matches!(b, b'\r' | b'\n'));
    let heading = String::from_utf8_lossy(lines.next().unwrap_or_default()).into_owned();
    let kind = HEADINGS.iter().position(|known| {
        let start = heading.get(..known.len());
        start.is_some_and(|start| start.eq_ignore_ascii_case(known))
    });
    let Some(kind) = kind else {
        let expected = format!("`{}` or `{}`", HEADINGS[0], HEADINGS[1]);
        return Err(FormatError::line(1, expected, quoted(&heading)));
    };
    let mode = lines.find(|line| !line.is_empty()).unwrap_or_default();
    // Binary content follows the mode without a line end.
    let begins_binary = mode.starts_with(b"1") && mode.get(1).is_some_and(u8::is_ascii_control);
    if begins_binary && kind == 0 {
        // The mode is a part of the bytes.
        let begin = mode.as_ptr() as usize - bytes.as_ptr() as usize + 1;
        let text = binary::as_text(&heading, bytes, begin)?;
        return read(text.as_bytes()).map_err(|FormatError { at, expected, got }| {
            FormatError::offset(
                begin as u64,
                format!("{expected} (at {at} of the file as text)"),
                got,
            )
        });
    }
    if mode.trim_ascii() == b"1" || begins_binary {
        let expected = "0 (text): the layout of mode 1 (binary) is not public; open the file in the BSDF viewer of Speos and save it as text";
        return Err(FormatError::line(2, expected, "1, a binary Speos BSDF"));
    }
    let text = utf8(bytes)?;
    check_line_ends(text)?;
    let mut words = Tokens::new(text, false);
    words.text_line();
    words.count("mode", 0, 0)?;
    words.text_line();
    let comment = words.text_line().trim().to_owned();
    let length = words.count("number of characters of the description", 0, 1 << 20)?;
    words.text_line();
    words.characters(length)?;
    words.text_line();
    let mut bsdf =
        SpeosBsdf { comment, values: Values::Bsdf, parts: Vec::new(), warnings: Vec::new() };
    if kind == 0 {
        anisotropic(&mut words, &mut bsdf)?;
    } else {
        by_wavelength(&mut words, &mut bsdf)?;
    }
    let line = words.line();
    match words.take() {
        // The vendor's converter ends its files so.
        None | Some("End") => Ok(bsdf),
        Some(word) => {
            let expected = "the end of the file after the last table";
            Err(FormatError::line(line, expected, quoted(word)))
        }
    }
}

/// The two flags of reflection and transmission, and what values are.
fn flags(words: &mut Tokens<'_>, bsdf: &mut SpeosBsdf) -> Result<Vec<Transport>, FormatError> {
    let mut given = Vec::new();
    for transport in Transport::BOTH {
        if words.count("flag of reflection or transmission", 0, 1)? == 1 {
            given.push(transport);
        }
    }
    if given.is_empty() {
        let expected = "reflection or transmission or both";
        return Err(FormatError::line(words.line(), expected, "neither"));
    }
    let proportional = words.count("type of values", 0, 1)?;
    bsdf.values = [Values::Intensity, Values::Bsdf][proportional];
    Ok(given)
}

fn anisotropic(words: &mut Tokens<'_>, bsdf: &mut SpeosBsdf) -> Result<(), FormatError> {
    for _ in 0..3 {
        words.number("a component of the anisotropy vector")?;
    }
    let given = flags(words, bsdf)?;
    let mut incidences = Vec::new();
    for _ in &given {
        let rotations = words.angles("anisotropy", 0.0, 360.0)?;
        let mut all = Vec::new();
        for rotation in rotations {
            let angles = words.angles("incidence", 0.0, 90.0)?;
            all.extend(angles.into_iter().map(|incidence| (rotation, incidence)));
        }
        incidences.push(all);
    }
    for transport in &given {
        let reference = spectrum(words, bsdf)?;
        bsdf.parts.push(SpeosPart {
            transport: *transport,
            reference: Some(reference),
            tables: Vec::new(),
        });
    }
    for (part, incidences) in bsdf.parts.iter_mut().zip(incidences) {
        for (rotation, incidence) in incidences {
            let mut table = table(words, part.transport)?;
            (table.rotation, table.incidence) = (rotation, incidence);
            part.tables.push(table);
        }
    }
    Ok(())
}

/// The angle of incidence of a spectrum, and its share at [`WAVELENGTH_NM`].
fn spectrum(words: &mut Tokens<'_>, bsdf: &mut SpeosBsdf) -> Result<[f64; 2], FormatError> {
    let incidence = words.number_that("incidence of the spectrum", "0 to 90 degrees", |a| {
        (0.0..=90.0).contains(&a)
    })?;
    words.number("anisotropy angle of the spectrum")?;
    words.text_line();
    words.text_line();
    let max = words.at_most();
    let count = words.count("number of wavelengths", 1, max.max(1))?;
    let mut rows: Vec<[f64; 2]> = Vec::new();
    for _ in 0..count {
        let before = rows.last().map_or(0.0, |row| row[0]);
        let expected = format!("above {before} nm");
        let wavelength = words.number_that("a wavelength", &expected, |w| w > before)?;
        rows.push([wavelength, percentage(words)?]);
    }
    let above = rows.partition_point(|row| row[0] < WAVELENGTH_NM);
    let share = match (above.checked_sub(1).map(|k| rows[k]), rows.get(above)) {
        (Some([x0, y0]), Some(&[x1, y1])) => y0 + (y1 - y0) * (WAVELENGTH_NM - x0) / (x1 - x0),
        (Some([_, y]), None) | (None, Some(&[_, y])) => y,
        (None, None) => 0.0,
    };
    if rows.iter().any(|row| (row[1] - share).abs() > 1e-9) {
        bsdf.warnings.push(format!(
            "its shares change with the wavelength; those at {WAVELENGTH_NM} nm are taken"
        ));
    }
    Ok([incidence, share])
}

/// A percentage as a share.
fn percentage(words: &mut Tokens<'_>) -> Result<f64, FormatError> {
    let high = 100.0 * (1.0 + bsdf::GAIN_TOLERANCE);
    let percent = words.number_that("a percentage", "0 to 100", |p| (0.0..=high).contains(&p))?;
    Ok(percent / 100.0)
}

fn by_wavelength(words: &mut Tokens<'_>, bsdf: &mut SpeosBsdf) -> Result<(), FormatError> {
    let given = flags(words, bsdf)?;
    let max = words.at_most().max(1);
    let [incidences, wavelengths] = [
        words.count("number of incidence angles", 1, max)?,
        words.count("number of wavelengths", 1, max)?,
    ];
    let angles = words.ascending("incidence", incidences, [0.0, 90.0])?;
    let nanometres = words.ascending("wavelength", wavelengths, [1.0, 1e6])?;
    let distance = |nm: f64| (nm - WAVELENGTH_NM).abs();
    let chosen = (0..nanometres.len())
        .min_by(|a, b| distance(nanometres[*a]).total_cmp(&distance(nanometres[*b])))
        .unwrap_or(0);
    if nanometres.len() > 1 {
        bsdf.warnings.push(format!(
            "tables for {} wavelengths; that for {} nm is taken",
            nanometres.len(),
            nanometres[chosen]
        ));
    }
    for transport in given {
        let mut tables = Vec::new();
        for incidence in &angles {
            for number in 0..nanometres.len() {
                let total = percentage(words)?;
                let read = table(words, transport)?;
                if number == chosen {
                    tables.push(SpeosTable { incidence: *incidence, total: Some(total), ..read });
                }
            }
        }
        bsdf.parts.push(SpeosPart { transport, reference: None, tables });
    }
    Ok(())
}

/// One table: numbers of angles, a row of azimuths, and a row of values for each angle.
fn table(words: &mut Tokens<'_>, transport: Transport) -> Result<SpeosTable, FormatError> {
    let max = words.at_most().max(1);
    let rows = words.count("number of theta angles", 1, max)?;
    let columns = words.count("number of phi angles", 1, max)?;
    let azimuths = words.ascending("phi", columns, [0.0, 360.0])?;
    let range = match transport {
        Transport::Reflection => [0.0, 90.0],
        Transport::Transmission => [90.0, 180.0],
    };
    let (mut thetas, mut values): (Vec<f64>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    for _ in 0..rows {
        let before = thetas.last().copied();
        let expected = format!("ascending within {} to {} degrees", range[0], range[1]);
        let theta = words.number_that("theta", &expected, |t| {
            (range[0]..=range[1]).contains(&t) && before.is_none_or(|b| t > b)
        })?;
        thetas.push(theta);
        values.push(words.values("a value of the BSDF", columns)?);
    }
    if transport == Transport::Transmission {
        thetas = thetas.iter().rev().map(|theta| 180.0 - theta).collect();
        values.reverse();
    }
    Ok(SpeosTable {
        rotation: 0.0,
        incidence: 0.0,
        total: None,
        azimuths,
        thetas,
        values: values.concat(),
    })
}

/// Writes a file in the form of `.anisotropicbsdf`, as text; every part has a reference.
///
/// # Errors
/// If the writer fails.
pub fn write(bsdf: &SpeosBsdf, writer: &mut impl Write) -> io::Result<()> {
    let mut text = String::new();
    let description = "computed";
    let given = |transport| bsdf.parts.iter().any(|part| part.transport == transport);
    let [reflects, transmits] = Transport::BOTH.map(|t| u8::from(given(t)));
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "{} {VERSION}\n0\n{}\n{}\n{description}\n1\t0\t0\n{reflects}\t{transmits}\n{}\n",
        HEADINGS[0],
        bsdf.comment.replace(['\r', '\n'], " "),
        description.len(),
        u8::from(bsdf.values == Values::Bsdf)
    );
    for part in &bsdf.parts {
        let mut rotations: Vec<f64> = part.tables.iter().map(|t| t.rotation).collect();
        rotations.dedup();
        push_list(&mut text, &rotations);
        for rotation in rotations {
            let of_rotation =
                part.tables.iter().filter(|t| t.rotation.to_bits() == rotation.to_bits());
            push_list(&mut text, &of_rotation.map(|t| t.incidence).collect::<Vec<f64>>());
        }
    }
    for part in &bsdf.parts {
        let [incidence, share] = part.reference.unwrap_or_default();
        let percent = 100.0 * share;
        let _ = write!(
            text,
            "{incidence}\t0\nshare of the power at every wavelength\n2\n360\t{percent:.9}\n830\t{percent:.9}\n"
        );
    }
    for part in &bsdf.parts {
        for table in &part.tables {
            push_table(&mut text, table, part.transport);
            writer.write_all(text.as_bytes())?;
            text.clear();
        }
    }
    writer.write_all(text.as_bytes())
}

fn push_list(text: &mut String, angles: &[f64]) {
    let list: Vec<String> = angles.iter().map(ToString::to_string).collect();
    let _ = writeln!(text, "{}\n{}", angles.len(), list.join("\t"));
}

fn push_table(text: &mut String, table: &SpeosTable, transport: Transport) {
    let columns = table.azimuths.len();
    let list: Vec<String> = table.azimuths.iter().map(ToString::to_string).collect();
    let _ = writeln!(text, "{}\t{columns}\n\t{}", table.thetas.len(), list.join("\t"));
    let mut rows: Vec<(f64, &[f64])> =
        table.thetas.iter().copied().zip(table.values.chunks_exact(columns)).collect();
    if transport == Transport::Transmission {
        rows = rows.into_iter().rev().map(|(t, row)| (180.0 - t, row)).collect();
    }
    for (theta, row) in rows {
        let _ = write!(text, "{theta}\t");
        push_rows(text, row, columns);
    }
}
