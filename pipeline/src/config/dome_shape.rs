// SPDX-License-Identifier: MIT OR Apache-2.0
//! The shape of the dome: a truncated sphere, or a generating curve point by point (`dome.meridian_mm` and `dome.meridian_file`).
//!
//! In, for a curve: rows of two numbers (r, z), three (and the bulge of an arc) or four (and its centre), in the design or in a file. Out: a checked curve. The file
//! holds a row on each line, numbers with commas, semicolons or spaces between them; `#` begins a comment, a first line of words is passed over.

use std::path::Path;

use serde::Serialize;

use super::ConfigError;
use super::context::Context;
use super::{parts, raw};
use crate::geometry::Meridian;
use crate::geometry::outline::{Ends, Row, outline};

/// Truncated sphere z(r) = √(R² - r²) - (R - H) on a short cylinder; of a dome by a curve its height and largest radius.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Dome {
    /// Radius R of the sphere, mm; infinite of a dome by a curve, which has none.
    #[serde(skip_serializing_if = "is_infinite")]
    pub sphere_radius_mm: f64,
    /// Height H of the pole, mm.
    pub height_mm: f64,
    /// Largest radius, mm.
    pub radius_mm: f64,
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature serde asks for"
)]
fn is_infinite(length: &f64) -> bool {
    length.is_infinite()
}

impl Dome {
    /// Height of the sphere at radius `r_mm` from the axis, mm.
    pub fn height_at(&self, r_mm: f64) -> f64 {
        (self.sphere_radius_mm.powi(2) - r_mm.powi(2))
            .max(0.0)
            .sqrt()
            + self.centre_mm()
    }

    /// Height of the sphere's centre, mm (usually negative).
    pub fn centre_mm(&self) -> f64 {
        self.height_mm - self.sphere_radius_mm
    }
}

/// What a row is, in messages.
const ROW: &str =
    "two to four numbers: r and z in mm, the bulge of an arc, or the r and z of its centre";

/// The dome of `raw`, if it has one, and its curve, if it is stated by one.
pub(super) fn shape(
    raw: &raw::Design,
    folder: &Path,
    at: &Context,
) -> Result<(Option<Dome>, Option<Meridian>), ConfigError> {
    let Some(stated) = &raw.dome else {
        return Ok((None, None));
    };
    let Some((dome, meridian)) = load(stated, folder, at)? else {
        return Ok((Some(parts::dome(stated, at)?), None));
    };
    if raw.elements.is_some() {
        let expected = "no such table with a meridian, which is the whole surface";
        return Err(at.value("elements", "given", expected));
    }
    Ok((Some(dome), Some(meridian)))
}

/// The curve of `raw` and the dome's outermost measures, if the dome is stated by a curve.
fn load(
    raw: &raw::Dome,
    folder: &Path,
    at: &Context,
) -> Result<Option<(Dome, Meridian)>, ConfigError> {
    let stated = match (&raw.meridian_mm, &raw.meridian_file) {
        (None, None) => return Ok(None),
        (Some(_), Some(_)) => {
            let expected = "no such key beside dome.meridian_mm";
            return Err(at.value("dome.meridian_file", "given", expected));
        }
        (Some(rows), None) => in_design("dome.meridian_mm", rows, Ends::OnBottom, at)?,
        (None, Some(name)) => in_file(["dome.meridian_file", name], folder, Ends::OnBottom, at)?,
    };
    let others = [
        ("dome.sphere_radius_mm", raw.sphere_radius_mm.is_some()),
        ("dome.height_mm", raw.height_mm.is_some()),
        ("dome.width_mm", raw.width_mm.is_some()),
        ("dome.mesh", raw.mesh.is_some()),
    ];
    for (key, given) in others {
        if given {
            let expected = "no such key beside a meridian, which is the whole dome";
            return Err(at.value(key, "given", expected));
        }
    }
    let dome = Dome {
        sphere_radius_mm: f64::INFINITY,
        height_mm: stated.top_mm(),
        radius_mm: stated.radius_mm(),
    };
    Ok(Some((dome, stated)))
}

/// The curve of rows that stand in the design under `key`.
pub(super) fn in_design(
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
pub(super) fn in_file(
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
