// SPDX-License-Identifier: MIT OR Apache-2.0
//! The angular table of a data sheet as a far field.

use std::path::Path;
use std::sync::Arc;

use tracer::{Distribution, Emission};

use metrics::columns;
use metrics::illuminance::Symmetry;
use runtime::bounded_text::{MAX_ROWS, bounded_text};

use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::files::symmetry_of;
use crate::schema::sources::{FaceLaw, TableSource};

/// Emission of a face by its law, and the symmetry of its light about the normal.
pub(super) fn of_face(law: &FaceLaw, at: &Context) -> Result<(Emission, Symmetry), ConfigError> {
    match law {
        FaceLaw { exponent: Some(exponent), angle_deg: None, intensity: None, across: None } => {
            let exponent = at.within("exponent", *exponent, 0.0, 1e6)?;
            Ok((Emission::CosinePower { exponent }, Symmetry::Square))
        }
        FaceLaw { exponent: None, angle_deg: Some(angles), intensity: Some(along), across } => {
            for angle in angles {
                at.within("angle_deg", *angle, -90.0, 90.0)?;
            }
            let table = TableSource {
                angle_deg: Some(angles.clone()),
                intensity: Some(along.clone()),
                across: across.clone(),
                ..TableSource::default()
            };
            emission(&table, Path::new(""), at)
        }
        FaceLaw { exponent, angle_deg, intensity, across } => {
            let expected = "either `exponent`, or `angle_deg` and `intensity`";
            let is_bare = intensity.is_none() && across.is_none();
            let (key, got) = match (exponent, angle_deg) {
                (Some(exponent), _) => ("exponent", format!("{exponent} beside a table")),
                (None, Some(_)) => ("intensity", "missing".to_owned()),
                (None, None) if is_bare => ("exponent", "missing".to_owned()),
                (None, None) => ("angle_deg", "missing".to_owned()),
            };
            Err(at.value(key, got, expected))
        }
    }
}

/// Emission by the table of `raw`, and the symmetry of its light about the axis.
pub(super) fn emission(
    raw: &TableSource,
    folder: &Path,
    at: &Context,
) -> Result<(Emission, Symmetry), ConfigError> {
    let columns = match (&raw.angle_deg, &raw.intensity, &raw.across, &raw.file) {
        (Some(angles), Some(along), across, None) => {
            [Some(angles), Some(along), across.as_ref()].into_iter().flatten().cloned().collect()
        }
        (None, None, None, Some(file)) => {
            let path = folder.join(file);
            let text = bounded_text(&path, MAX_ROWS).map_err(|error| error.to_string());
            text.and_then(|text| columns::read(&text, 2..=3)).map_err(|why| {
                let expected =
                    format!("a file of two or three columns: `{}`: {why}", path.display());
                at.value("file", format!("{file:?}"), &expected)
            })?
        }
        _ => {
            let expected = "either `angle_deg`, `intensity` and perhaps `across`, or `file`";
            return Err(at.value("angle_deg", "other keys", expected));
        }
    };
    let refuse = |expected: &str| match &raw.file {
        Some(file) => at.value("file", format!("{file:?}"), expected),
        None => at.value("angle_deg", format!("{} angles", columns[0].len()), expected),
    };
    let (angles, planes) = (&columns[0], &columns[1..]);
    let ascends = angles.windows(2).all(|pair| pair[0] < pair[1]);
    let fits = |angle: &f64| (-180.0..=180.0).contains(angle);
    let is_whole = planes.iter().all(|values| values.len() == angles.len());
    let ends = angles.first().copied().zip(angles.last().copied());
    let (true, Some((first, last))) = (ascends && is_whole && angles.iter().all(fits), ends) else {
        let expected = "angles ascending from -180 to 180, and an intensity at each";
        return Err(refuse(expected));
    };
    if first < 0.0 && first + last != 0.0 {
        return Err(refuse(&format!("both halves to one end, got {first} to {last}")));
    }
    let table = distribution(angles, planes);
    let table = table.map_err(|error| refuse(&format!("a table of intensities: {error}")))?;
    let symmetry = symmetry_of(&table);
    Ok((Emission::Table(Arc::new(table)), symmetry))
}

/// Half planes by azimuth: all round, or 180 degrees apart where angles below 0 state the other
/// half, or 90 degrees apart where a second plane is given.
fn distribution(angles: &[f64], planes: &[Vec<f64>]) -> Result<Distribution, tracer::Error> {
    let has_halves = angles[0] < 0.0;
    let azimuths: &[f64] = match (has_halves, planes.len()) {
        (false, 1) => &[0.0],
        (true, 1) => &[0.0, 180.0],
        _ => &[0.0, 90.0, 180.0, 270.0],
    };
    let mut thetas: Vec<f64> = angles.iter().map(|angle| angle.abs()).collect();
    thetas.sort_by(f64::total_cmp);
    thetas.dedup();
    let mut values = Vec::new();
    for (number, azimuth) in azimuths.iter().enumerate() {
        let side = if has_halves && *azimuth >= 180.0 { -1.0 } else { 1.0 };
        let plane = &planes[number % planes.len()];
        values.extend(thetas.iter().map(|theta| between(angles, plane, side * theta)));
    }
    Distribution::new(&thetas, azimuths, values)
}

/// The value at `x`, on straight lines; 0 beyond the ends.
fn between(xs: &[f64], ys: &[f64], x: f64) -> f64 {
    let above = xs.partition_point(|known| *known < x);
    match (above.checked_sub(1), xs.get(above)) {
        (_, Some(known)) if *known <= x => ys[above],
        (Some(below), Some(known)) => {
            ys[below] + (ys[above] - ys[below]) * (x - xs[below]) / (known - xs[below])
        }
        _ => 0.0,
    }
}
