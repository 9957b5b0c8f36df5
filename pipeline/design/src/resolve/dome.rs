// SPDX-License-Identifier: MIT OR Apache-2.0
//! The shape of the dome: a truncated sphere, a generating curve point by point (`dome.meridian_mm`
//! and `dome.meridian_file`), two of them, or a mesh.
//!
//! In, for a curve: rows of two numbers (r, z), three (and the bulge of an arc) or four (and its
//! centre), in the design or in a file. Out: a checked curve. The file holds a row on each line,
//! numbers with commas, semicolons or spaces between them; `#` begins a comment, a first line of
//! words is passed over.

use std::path::Path;

use geometry::Meridian;
use geometry::outline::{Ends, Row, outline};
use geometry::oval::oval;
use geometry::tessellation::Tessellation;
use runtime::bounded_text::{MAX_ROWS, bounded_text};
use runtime::content_hash::sha256_hex;

use super::{dome_mesh, package};
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::dome::Dome;
use crate::schema;
use crate::schema::dome::{DomeForm, MeridianDome, MeridianFileDome};

/// Form of a row, in messages.
const ROW: &str =
    "two to four numbers: r and z in mm, the bulge of an arc, or the r and z of its centre";

/// The dome of `raw`.
pub(crate) fn resolve(
    raw: &schema::Design,
    folder: &Path,
    at: &Context,
) -> Result<Option<Dome>, ConfigError> {
    let Some(stated) = &raw.dome else {
        return Ok(None);
    };
    let dome = match &stated.kind {
        DomeForm::Sphere(sphere) => Dome::Sphere(package::dome(sphere, at)?),
        DomeForm::Meridian(MeridianDome { meridian_mm, meridian_y_mm }) => {
            let x = in_design("dome.meridian_mm", meridian_mm, Ends::OnBottom, at)?;
            let Some(rows) = meridian_y_mm else { return Ok(Some(Dome::Meridian(x))) };
            let key = "dome.meridian_y_mm";
            let y = in_design(key, rows, Ends::OnBottom, at)?;
            oval_dome([x, y], (key, None), raw, at)?
        }
        DomeForm::MeridianFile(MeridianFileDome { meridian_file, meridian_y_file }) => {
            let x = in_file(["dome.meridian_file", meridian_file], folder, Ends::OnBottom, at)?;
            let Some(file) = meridian_y_file else { return Ok(Some(Dome::Meridian(x))) };
            let key = "dome.meridian_y_file";
            let y = in_file([key, file], folder, Ends::OnBottom, at)?;
            oval_dome([x, y], (key, Some(file.as_str())), raw, at)?
        }
        DomeForm::Mesh(mesh) => {
            if let Some(smooth_deg) = mesh.smooth_deg {
                at.within("dome.smooth_deg", smooth_deg, 0.0, 90.0)?;
            }
            let mesh = dome_mesh::load(mesh, folder).map_err(|error| at.of_files(&error))?;
            if raw.elements.is_some() {
                let expected = "no such table with dome.mesh, which is the whole surface";
                return Err(at.value("elements", "given", expected));
            }
            Dome::Mesh(Box::new(mesh))
        }
    };
    Ok(Some(dome))
}

/// The dome by meridians along x and y, the latter under a key or in the file of a key.
fn oval_dome(
    [x, y]: [Meridian; 2],
    (key, file): (&str, Option<&str>),
    raw: &schema::Design,
    at: &Context,
) -> Result<Dome, ConfigError> {
    if x == y {
        return Ok(Dome::Meridian(x));
    }
    if raw.elements.is_some() {
        let expected = format!("no such table with {key}: relief stands on round domes");
        return Err(at.value("elements", "given", &expected));
    }
    let both = [&x, &y].map(|curve| format!("{:?}", curve.pieces));
    let made = between([&x, &y], (key, file), at)?;
    let mesh = dome_mesh::tessellated(made, sha256_hex(both.concat().as_bytes()));
    let mesh = mesh.map_err(|error| no_solid(key, &error.to_string(), at))?;
    Ok(Dome::Mesh(Box::new(mesh)))
}

/// The error of two meridians whose surface bounds no solid.
pub(crate) fn no_solid(key: &str, error: &str, at: &Context) -> ConfigError {
    at.value(key, "a bad value", &format!("a surface that does not fold over: {error}"))
}

/// The surface between meridians along x and y, the latter under a key or in the file of a key.
pub(crate) fn between(
    [x, y]: [&Meridian; 2],
    (key, file): (&str, Option<&str>),
    at: &Context,
) -> Result<Tessellation, ConfigError> {
    oval(x, y).map_err(|error| match file {
        // The surface as a whole has no row.
        _ if error.row == 0 => at.value(key, error.got, &error.expected),
        None => at.value(&format!("{key}[{}]", error.row), error.got, &error.expected),
        Some(file) => {
            let got = format!("{file}, point {}: {}", error.row, error.got);
            at.value(key, got, &error.expected)
        }
    })
}

/// The curve of rows that stand in the design under `key`.
pub(crate) fn in_design(
    key: &str,
    rows: &[Vec<f64>],
    ends: Ends,
    at: &Context,
) -> Result<Meridian, ConfigError> {
    let row = |(k, numbers): (usize, &Vec<f64>)| {
        let wrong = || at.value(&format!("{key}[{}]", k + 1), format!("{numbers:?}"), ROW);
        Row::of(numbers).ok_or_else(wrong)
    };
    let rows: Vec<Row> = rows.iter().enumerate().map(row).collect::<Result<_, _>>()?;
    outline(&rows, ends).map_err(|e| at.value(&format!("{key}[{}]", e.row), e.got, &e.expected))
}

/// The curve of the file that stands under `key`.
pub(crate) fn in_file(
    [key, name]: [&str; 2],
    folder: &Path,
    ends: Ends,
    at: &Context,
) -> Result<Meridian, ConfigError> {
    let path = folder.join(name);
    let text = bounded_text(&path, MAX_ROWS).map_err(|e| {
        let expected = format!("a readable file: `{}`: {e}", path.display());
        at.value(key, name, &expected)
    })?;
    let wrong = |line: usize, got: String, expected: &str| {
        at.value(key, format!("{name}, line {line}: {got}"), expected)
    };
    let stated = numbers(&text).map_err(|(line, got)| wrong(line, got, ROW))?;
    let lines: Vec<usize> = stated.iter().map(|(line, _)| *line).collect();
    let rows: Vec<Row> = stated.iter().filter_map(|(_, numbers)| Row::of(numbers)).collect();
    outline(&rows, ends).map_err(|e| {
        let line = lines.get(e.row.saturating_sub(1)).copied().unwrap_or(1);
        wrong(line, e.got, &e.expected)
    })
}

/// The rows of the curve in the file `name` beside `folder`; `None` of what is no such file.
pub fn rows_in_file(folder: &Path, name: &str) -> Option<Vec<Vec<f64>>> {
    let text = bounded_text(&folder.join(name), MAX_ROWS).ok()?;
    Some(numbers(&text).ok()?.into_iter().map(|(_, numbers)| numbers).collect())
}

/// A row of a file with its line.
type NumberedRow = (usize, Vec<f64>);

/// Numbers of the rows in `text` with their lines; a line that is no row.
fn numbers(text: &str) -> Result<Vec<NumberedRow>, (usize, String)> {
    let mut rows = Vec::new();
    for (line, number) in text.trim_start_matches('\u{feff}').lines().zip(1..) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let words = line.split(|c: char| c == ',' || c == ';' || c.is_whitespace());
        let numbers: Option<Vec<f64>> =
            words.filter(|word| !word.is_empty()).map(|word| word.parse().ok()).collect();
        match numbers {
            Some(numbers) if Row::of(&numbers).is_some() => rows.push((number, numbers)),
            None if rows.is_empty() && number == 1 => {}
            _ => return Err((number, format!("{line:?}"))),
        }
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_order_mark_is_no_part_of_a_curve() {
        let of = |text: &str| numbers(text).expect("rows");
        let text = "0, 1\n1, 0\n";
        assert_eq!(of(&format!("\u{feff}{text}")), of(text));
        assert_eq!(of(text).len(), 2);
    }
}
