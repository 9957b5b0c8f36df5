// SPDX-License-Identifier: MIT OR Apache-2.0
//! The tables of a design that say what is built, checked one by one.

use std::path::Path;
use std::sync::Arc;

use geometry::profile::SphericalDome;

use super::positions::{MAX_TURN_DEG, Placed, SCALES};
use super::{luminescence, positions, scattering};
use crate::check::{Context, MAX_LENGTH_MM};
use crate::error::ConfigError;
use crate::resolved::Housing;
use crate::resolved::array::{Array, PackagePositions};
use crate::resolved::dome::Dome;
use crate::resolved::led::Led;
use crate::resolved::medium::{MaterialFile, Medium, StatedMedium, medium_at};
use crate::resolved::reflector::Reflector;
use crate::resolved::scattering::Spectral;
use crate::schema::dome::SphereDome;
use crate::schema::reflectors::{Law, Specular};
use crate::schema::{Arrangement, ByWavelength, Pitch};
use crate::{material, schema};
use runtime::serde_arrays::List;

pub(crate) fn dome(raw: &SphereDome, at: &Context) -> Result<SphericalDome, ConfigError> {
    let sphere_radius_mm = at.length("dome.sphere_radius_mm", raw.sphere_radius_mm)?;
    let height_mm = at.length("dome.height_mm", raw.height_mm)?;
    let width_mm = at.length("dome.width_mm", raw.width_mm)?;
    let radius_mm = 0.5 * width_mm;
    if height_mm > 2.0 * sphere_radius_mm {
        return Err(at.value("dome.height_mm", height_mm, "at most the diameter of the sphere"));
    }
    let dome = SphericalDome { sphere_radius_mm, height_mm, radius_mm };
    if radius_mm > sphere_radius_mm || dome.height_at(radius_mm) < 0.0 {
        return Err(at.value(
            "dome.width_mm",
            width_mm,
            "a width at which the sphere is still above the bottom",
        ));
    }
    Ok(dome)
}

/// Filling of the dome: silicone, or air where there is none.
pub(crate) fn inside(
    raw: &schema::Design,
    domed: bool,
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Medium, ConfigError> {
    match (domed, &raw.silicone) {
        (true, Some(given)) => medium("silicone", given, wavelength_nm, folder, at),
        (true, None) => Err(at.value(
            "silicone",
            "missing",
            "a table with `index` or `material_file` for the dome",
        )),
        (false, Some(_)) => Err(at.value("silicone", "given", "no such table without [dome]")),
        (false, None) => {
            let air = schema::Silicone { index: Some(1.0), ..schema::Silicone::default() };
            medium("air", &air, wavelength_nm, folder, at)
        }
    }
}

/// The medium of the table `table` at the wavelength.
pub(crate) fn medium(
    table: &str,
    raw: &schema::Silicone,
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Medium, ConfigError> {
    let key = format!("{table}.absorption_per_mm");
    let absorption_per_mm = Spectral::new(key, &raw.absorption_per_mm, [0.0, 1e6], at)?;
    let scattering = scattering::resolve(table, raw, at)?;
    let luminophores = luminescence::resolve(table, &raw.luminophores, folder, at)?;
    if let (Some(glass), None) = (&raw.glass, &raw.material_file) {
        let expected = "no such key without `material_file`, a catalogue that has it";
        return Err(at.value(&format!("{table}.glass"), glass, expected));
    }
    let (index, material) = match (raw.index, &raw.material_file) {
        (Some(index), None) => (index, None),
        (None, Some(name)) => {
            let path = folder.join(name);
            let material = material::read(&path, raw.glass.as_deref()).map_err(|e| {
                let expected = format!("a readable material: {e:#}");
                at.value(&format!("{table}.material_file"), name, &expected)
            })?;
            let (file, path) = (name.clone(), path.display().to_string());
            (f64::NAN, Some(MaterialFile { file, path, material }))
        }
        _ => {
            return Err(at.value(table, "both or neither", "one of `index` and `material_file`"));
        }
    };
    let table = table.to_owned();
    let varies = matches!(raw.absorption_per_mm, ByWavelength::Rows(_));
    let keeps_table = varies || scattering.is_some() || !luminophores.is_empty();
    let spectral = keeps_table.then(|| raw.clone());
    let stated = StatedMedium {
        table,
        index,
        absorption_per_mm,
        scattering,
        luminophores,
        spectral,
        material,
    };
    medium_at(&Arc::new(stated), wavelength_nm, at)
}

/// The law of reflection of the table `table`.
pub(crate) fn reflector<S: Specular>(
    table: &str,
    law: &Law<S>,
    at: &Context,
) -> Result<Reflector, ConfigError> {
    let share = |name: &str, value| at.within(&format!("{table}.{name}"), value, 0.0, 1.0);
    let reflectance = |value| share("reflectance", value);
    Ok(match law {
        Law::Specular(stated) => {
            Reflector::Specular { reflectance: reflectance(stated.reflectance())? }
        }
        Law::Lambertian(stated) => {
            Reflector::Lambertian { reflectance: reflectance(stated.reflectance)? }
        }
        Law::Absorbing(stated) => {
            // A study that makes a mirror black leaves its reflectance in the design.
            reflectance(stated.reflectance.unwrap_or_default())?;
            Reflector::Absorbing
        }
        Law::Mixed(stated) => Reflector::Mixed {
            reflectance: reflectance(stated.reflectance)?,
            specular_fraction: share("specular_fraction", stated.specular_fraction)?,
        },
    })
}

/// Walls around the array.
pub(crate) fn housing(raw: &schema::Housing, at: &Context) -> Result<Housing, ConfigError> {
    let keys = &raw.shared;
    let within = |key: &str, value: f64| at.within(key, value, 1e-3, 1e4);
    let floor = keys.floor.as_ref();
    let floor = floor.map(|floor| reflector("housing.floor", &floor.kind, at));
    if keys.distance_mm.is_some() == keys.inner_size_mm.is_some() {
        let got = if keys.distance_mm.is_some() { "given" } else { "missing" };
        let expected = "one of this key and housing.inner_size_mm";
        return Err(at.value("housing.distance_mm", got, expected));
    }
    for size in keys.inner_size_mm.iter().flat_map(|size| size.0) {
        at.within("housing.inner_size_mm", size, 1e-3, 2e5)?;
    }
    let distance_mm = keys.distance_mm.map(|mm| at.length("housing.distance_mm", mm));
    Ok(Housing {
        height_mm: within("housing.height_mm", keys.height_mm)?,
        thickness_mm: within("housing.thickness_mm", keys.thickness_mm)?,
        distance_mm: distance_mm.transpose()?,
        inner_size_mm: keys.inner_size_mm.map(|size| size.0),
        reflector: match raw.kind.law() {
            Some(law) => reflector("housing", &law, at)?,
            None => Reflector::Periodic,
        },
        floor: floor.transpose()?,
    })
}

/// Most packages along one axis.
const MAX_ALONG: usize = 128;

/// Most that the plane may reach beyond the outermost packages, mm.
pub(crate) const MAX_MARGIN_MM: f64 = 1e3;

/// Largest pitch, mm.
const MAX_PITCH_MM: f64 = 2.0 * MAX_MARGIN_MM;

/// Least distance of staggered rows of packages of these widths, or the least of the one pitch of
/// hexagonal rows, mm: neighbours in the next row stand aslant, those of every other row in one
/// column. Domes are ellipses, which are clear where circles are in stretched coordinates.
fn least_of_staggered(raw: &schema::Array, are_domes: bool, [wide, deep]: [f64; 2]) -> f64 {
    let (next, rise) = match raw.pitch_mm {
        Pitch::Along(List([pitch, _])) => {
            let share = (0.5 * pitch / wide).min(1.0);
            let oval = deep * (1.0 - share * share).sqrt();
            (if are_domes || share >= 1.0 { oval } else { deep }, 1.0)
        }
        Pitch::Same(_) => {
            let rise = 0.75_f64.sqrt();
            let oval = (0.5 / wide).hypot(rise / deep).recip();
            (if are_domes { oval } else { (deep / rise).min(2.0 * wide) }, rise)
        }
    };
    if raw.rows < 3 { next } else { next.max(0.5 * deep / rise) }
}

pub(crate) fn array(
    raw: &schema::Array,
    dome: Option<&Dome>,
    led: &Led,
    folder: &Path,
    at: &Context,
) -> Result<Array, ConfigError> {
    if raw.positions_file.is_none() {
        at.count("array.columns", raw.columns, 1, MAX_ALONG)?;
        at.count("array.rows", raw.rows, 1, MAX_ALONG)?;
    }
    let pitches = raw.pitch_mm.along();
    for pitch_mm in pitches {
        at.length("array.pitch_mm", pitch_mm)?;
    }
    if let (Pitch::Along(pitch), Some(_)) = (raw.pitch_mm, &raw.positions_file) {
        let expected = "one number beside positions_file, the least distance allowed";
        return Err(at.value("array.pitch_mm", format!("{pitch:?}"), expected));
    }
    for (k, scale) in raw.scales.iter().enumerate() {
        at.within(&format!("array.scales[{}]", k + 1), *scale, *SCALES.start(), *SCALES.end())?;
    }
    let Placed { positions_mm, turns_deg, scales: stated_scales, drives } =
        match &raw.positions_file {
            Some(name) => positions::load(raw, name, folder).map_err(|e| at.of_files(&e))?,
            None => Placed::default(),
        };
    let array = Array {
        positions: if let Some(file) = &raw.positions_file {
            PackagePositions::List { positions_mm, turns_deg, file: file.clone() }
        } else {
            let (columns, rows, arrangement) = (raw.columns, raw.rows, raw.arrangement);
            PackagePositions::Grid { columns, rows, arrangement }
        },
        pitch_mm: raw.pitch_mm,
        crossing: raw.crossing,
        drives,
        offsets_mm: raw.offsets_mm.iter().map(|List(offset)| *offset).collect(),
        turns_deg: raw.turns_deg.clone(),
        scales: raw.scales.clone(),
        stated_scales,
    };
    pitches_fit(raw, &array, dome, led, at)?;
    for (k, List(offset)) in raw.offsets_mm.iter().enumerate() {
        for v in offset {
            at.within(&format!("array.offsets_mm[{}]", k + 1), *v, -MAX_LENGTH_MM, MAX_LENGTH_MM)?;
        }
    }
    for (k, turn) in raw.turns_deg.iter().enumerate() {
        let key = format!("array.turns_deg[{}]", k + 1);
        at.within(&key, *turn, -MAX_TURN_DEG, MAX_TURN_DEG)?;
    }
    at.one_for_each("array.offsets_mm", raw.offsets_mm.len(), array.count())?;
    at.one_for_each("array.turns_deg", raw.turns_deg.len(), array.count())?;
    at.one_for_each("array.scales", raw.scales.len(), array.count())?;
    Ok(array)
}

/// Refuses pitches at which the smallest packages would overlap; the scene tells of others.
fn pitches_fit(
    raw: &schema::Array,
    array: &Array,
    dome: Option<&Dome>,
    led: &Led,
    at: &Context,
) -> Result<(), ConfigError> {
    let widths = dome.map_or(led.size_mm, |d| [0, 1].map(|axis| 2.0 * d.reach_mm(axis, 0.0)));
    let [least_scale, _] = array.scale_range();
    let widths = widths.map(|width| least_scale * width);
    let pitches = raw.pitch_mm.along();
    let mut is_clear = [0, 1].map(|k| pitches[k] >= widths[k]);
    let is_staggered = raw.arrangement == Arrangement::Hexagonal && raw.rows > 1;
    let least_mm = least_of_staggered(raw, dome.is_some(), widths);
    if is_staggered {
        is_clear[1] = pitches[1] >= least_mm * (1.0 - 1e-9);
    }
    for (k, (pitch_mm, width)) in pitches.into_iter().zip(widths).enumerate() {
        if !is_clear[k] {
            let rows = if is_staggered && k == 1 {
                // Rounded up, so that the bound fits.
                let least_mm = (1e6 * least_mm - 1e-6).ceil() / 1e6;
                format!(" between packages of all rows: {least_mm} mm here")
            } else {
                String::new()
            };
            let smallest = if array.is_scaled() { "the smallest" } else { "a" };
            let expected = format!("at least the width of {smallest} package, {width} mm{rows}");
            return Err(at.value("array.pitch_mm", pitch_mm, &expected));
        }
        if pitch_mm > MAX_PITCH_MM {
            let expected = format!(
                "at most {MAX_PITCH_MM} mm: receiver.margin_mm, which is at most {MAX_MARGIN_MM}, \
                 reaches half a pitch beyond the outermost packages"
            );
            return Err(at.value("array.pitch_mm", pitch_mm, &expected));
        }
    }
    Ok(())
}
