// SPDX-License-Identifier: MIT OR Apache-2.0
//! The shape of the dome: a truncated sphere, a generating curve point by point (`dome.meridian_mm` and `dome.meridian_file`), or a mesh.
//!
//! In, for a curve: rows of two numbers (r, z), three (and the bulge of an arc) or four (and its centre), in the design or in a file. Out: a checked curve. The file
//! holds a row on each line, numbers with commas, semicolons or spaces between them; `#` begins a comment, a first line of words is passed over.

use std::path::Path;

use super::{dome_mesh, package};
use crate::config::check::Context;
use crate::config::design::dome::{Dome, DomeMesh};
use crate::config::error::ConfigError;
use crate::config::schema;
use crate::geometry::Meridian;
use crate::geometry::outline::{Ends, Row, outline};

/// What a row is, in messages.
const ROW: &str =
    "two to four numbers: r and z in mm, the bulge of an arc, or the r and z of its centre";

/// The dome of `raw`: by a curve, by a mesh, or else by its sphere.
pub(in crate::config) fn resolve(
    raw: &schema::Design,
    folder: &Path,
    at: &Context,
) -> Result<Option<Dome>, ConfigError> {
    let Some(stated) = &raw.dome else {
        return Ok(None);
    };
    let (dome, what) = if stated.meridian_mm.is_some() || stated.meridian_file.is_some() {
        (Dome::Meridian(by_curve(stated, folder, at)?), "a meridian")
    } else if let Some(name) = &stated.mesh {
        (Dome::Mesh(by_mesh(stated, name, folder, at)?), "dome.mesh")
    } else {
        if stated.mesh_unit.is_some() {
            let expected = "no such key without dome.mesh";
            return Err(at.value("dome.mesh_unit", "given", expected));
        }
        return Ok(Some(Dome::Sphere(package::dome(stated, at)?)));
    };
    if raw.elements.is_some() {
        let expected = format!("no such table with {what}, which is the whole surface");
        return Err(at.value("elements", "given", &expected));
    }
    Ok(Some(dome))
}

/// Refuses the keys of a sphere, and `others`, beside `what`.
fn nothing_beside(
    raw: &schema::Dome,
    others: &[(&str, bool)],
    what: &str,
    at: &Context,
) -> Result<(), ConfigError> {
    let of_sphere = [
        ("dome.sphere_radius_mm", raw.sphere_radius_mm.is_some()),
        ("dome.height_mm", raw.height_mm.is_some()),
        ("dome.width_mm", raw.width_mm.is_some()),
    ];
    match of_sphere.iter().chain(others).find(|(_, given)| *given) {
        Some((key, _)) => {
            let expected = format!("no such key beside {what}, which is the whole dome");
            Err(at.value(key, "given", &expected))
        }
        None => Ok(()),
    }
}

fn by_mesh(
    raw: &schema::Dome,
    name: &str,
    folder: &Path,
    at: &Context,
) -> Result<DomeMesh, ConfigError> {
    nothing_beside(raw, &[], "dome.mesh", at)?;
    dome_mesh::load(raw, name, folder).map_err(|error| ConfigError::Files {
        file: at.file.to_owned(),
        message: format!("{error:#}"),
    })
}

/// The curve of `raw`.
fn by_curve(raw: &schema::Dome, folder: &Path, at: &Context) -> Result<Meridian, ConfigError> {
    let stated = match (&raw.meridian_mm, &raw.meridian_file) {
        (Some(_), Some(_)) => {
            let expected = "no such key beside dome.meridian_mm";
            return Err(at.value("dome.meridian_file", "given", expected));
        }
        (Some(rows), None) => in_design("dome.meridian_mm", rows, Ends::OnBottom, at)?,
        (None, name) => {
            let name = name.as_deref().unwrap_or_default();
            in_file(["dome.meridian_file", name], folder, Ends::OnBottom, at)?
        }
    };
    let others = [
        ("dome.mesh", raw.mesh.is_some()),
        ("dome.mesh_unit", raw.mesh_unit.is_some()),
    ];
    nothing_beside(raw, &others, "a meridian", at)?;
    Ok(stated)
}

/// The curve of rows that stand in the design under `key`.
pub(in crate::config) fn in_design(
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
pub(in crate::config) fn in_file(
    [key, name]: [&str; 2],
    folder: &Path,
    ends: Ends,
    at: &Context,
) -> Result<Meridian, ConfigError> {
    let path = folder.join(name);
    let text = std::fs::read_to_string(&path).map_err(|e| {
        let expected = format!("a readable file: `{}`: {e}", path.display());
        at.value(key, name, &expected)
    })?;
    let wrong = |line: usize, got: String, expected: &str| {
        at.value(key, format!("{name}, line {line}: {got}"), expected)
    };
    let (mut rows, mut lines) = (Vec::new(), Vec::new());
    for (line, number) in text.lines().zip(1..) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let words = line.split(|c: char| c == ',' || c == ';' || c.is_whitespace());
        let numbers: Option<Vec<f64>> = words
            .filter(|word| !word.is_empty())
            .map(|word| word.parse().ok())
            .collect();
        match numbers.as_deref().map(Row::of) {
            Some(Some(row)) => {
                rows.push(row);
                lines.push(number);
            }
            None if rows.is_empty() && number == 1 => {}
            _ => return Err(wrong(number, format!("{line:?}"), ROW)),
        }
    }
    outline(&rows, ends).map_err(|e| {
        let line = lines.get(e.row.saturating_sub(1)).copied().unwrap_or(1);
        wrong(line, e.got, &e.expected)
    })
}
