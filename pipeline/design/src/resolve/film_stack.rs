// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[films]]`, checked: each film is a box over the array whose upper and lower face may do more
//! than refract.

use std::f64::consts::PI;
use std::path::Path;

use bsdf::ray_optics::{Outline, UnitCell};

use super::solids::{SolidTable, resolve_one};
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::Design;
use crate::resolved::solids::{CheckedSolid, GroovedFace};
use crate::schema::film_stack::Film;
use crate::schema::solids::{
    Contacts, Flat, Grooves, Per, Prisms, Solid, SolidForm, SolidKeys, SolidScatter,
};
use crate::serde_arrays::List;

/// Air between films, mm.
const GAP_MM: f64 = 0.01;
/// Largest angle that a chord of a rounded tip turns through.
const CHORD_TURN: f64 = PI / 90.0;

/// Faces of a film, the upper one first.
pub(crate) const FACES: [&str; 2] = ["top", "bottom"];

/// The films of a design whose other parts are checked.
pub(crate) fn resolve(
    raw: &[Film],
    design: &Design,
    folder: &Path,
    at: &Context,
) -> Result<Vec<CheckedSolid>, ConfigError> {
    let mut films = Vec::new();
    let mut below_mm = None;
    for (number, film) in raw.iter().enumerate() {
        let table = format!("films[{}]", number + 1);
        let key = |name: &str| format!("{table}.{name}");
        let thickness_mm = at.length(&key("thickness_mm"), film.thickness_mm)?;
        let low_mm = lower_face_mm(film, below_mm, &key, at)?;
        below_mm = Some(low_mm + thickness_mm);
        let [x, y] = lengths_mm(film, design, &key, at)?;
        let stated = Solid {
            shared: SolidKeys {
                name: film.name.clone(),
                per: Per::Array,
                position_mm: List([0.0, 0.0, low_mm + 0.5 * thickness_mm]),
                optical_contact: Contacts::default(),
                medium: Some(film.medium.clone()),
                coating: Vec::new(),
                scatter: None,
                surface: None,
            },
            kind: SolidForm::Box(Flat { size_mm: List([x, y, thickness_mm]), rotation_deg: None }),
        };
        let read = SolidTable { table: &table, wavelength_nm: design.wavelength_nm, folder, at };
        let known = design.solids.iter().chain(&films).map(CheckedSolid::name);
        read.check_name(&film.name, known)?;
        let faces = [film.top.as_ref(), film.bottom.as_ref()].map(Option::<&SolidScatter>::cloned);
        films.push(resolve_one(&stated, faces, &read)?);
    }
    Ok(films)
}

/// Height of the lower face of a film over one that ends at `below_mm`.
fn lower_face_mm(
    film: &Film,
    below_mm: Option<f64>,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<f64, ConfigError> {
    match (film.z_mm, film.gap_mm, below_mm) {
        (Some(z_mm), None, Some(top_mm)) if z_mm <= top_mm => {
            let expected = format!("above {top_mm} mm, where the film below ends");
            Err(at.value(&key("z_mm"), z_mm, &expected))
        }
        (Some(z_mm), None, _) => at.length(&key("z_mm"), z_mm),
        (None, gap_mm, Some(top_mm)) => {
            Ok(top_mm + at.length(&key("gap_mm"), gap_mm.unwrap_or(GAP_MM))?)
        }
        (Some(_), Some(_), _) => {
            Err(at.value(&key("gap_mm"), "given", "no such key beside `z_mm`"))
        }
        (None, _, None) => {
            Err(at.value(&key("z_mm"), "missing", "the height of the lowest film, mm"))
        }
    }
}

/// Lengths of a film along x and y.
fn lengths_mm(
    film: &Film,
    design: &Design,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<[f64; 2], ConfigError> {
    if let Some(List(stated)) = film.size_mm {
        for length in stated {
            at.length(&key("size_mm"), length)?;
        }
        return Ok(stated);
    }
    // The walls of the housing end at a height; a film above them may reach farther.
    if let Some(half) = design.housing_half_mm() {
        return Ok(half.map(|half| 2.0 * half));
    }
    let (half, pitch) = (design.half_extent_mm(), design.array.pitch_mm.along());
    Ok([0, 1].map(|k| 2.0 * half[k] + pitch[k]))
}

/// The grooves of prisms, in the table `table`.
pub(crate) fn prisms(
    stated: &Prisms,
    table: &str,
    at: &Context,
) -> Result<GroovedFace, ConfigError> {
    let key = |name: &str| format!("{table}.{name}");
    let apex_deg =
        at.within(&key("apex_deg"), stated.apex_deg.unwrap_or(Prisms::APEX_DEG), 10.0, 170.0)?;
    let pitch = at.length_um(&key("pitch_um"), stated.pitch_um.unwrap_or(Prisms::PITCH_UM))?;
    let half = 0.5 * apex_deg.to_radians();
    let max_um = 0.5 * pitch / half.cos();
    let radius = stated.tip_radius_um.unwrap_or_default();
    if !(0.0..max_um).contains(&radius) {
        let expected = format!("a radius from 0 and below {max_um:.4} um, which rounds all of it");
        return Err(at.value(&key("tip_radius_um"), radius, &expected));
    }
    let height = 0.5 * pitch / half.tan();
    let mut line = vec![[0.0, 0.0]];
    if radius > 0.0 {
        // An arc that touches both flanks, by chords, from left to right.
        let (centre, turn) = (height - radius / half.sin(), PI - 2.0 * half);
        let chords = (turn / CHORD_TURN).ceil().max(1.0) as usize;
        line.extend((0..=chords).map(|k| {
            let angle = PI - half - turn * k as f64 / chords as f64;
            [0.5 * pitch + radius * angle.cos(), centre + radius * angle.sin()]
        }));
    } else {
        line.push([0.5 * pitch, height]);
    }
    line.push([pitch, 0.0]);
    face(line, true, stated.direction_deg, table, at)
}

/// Grooves of any profile, in the table `table`.
pub(crate) fn grooves(
    stated: &Grooves,
    table: &str,
    at: &Context,
) -> Result<GroovedFace, ConfigError> {
    let line: Vec<[f64; 2]> = stated.profile_um.iter().map(|List(point)| *point).collect();
    let key = format!("{table}.profile_um");
    let (Some(first), Some(last)) = (line.first(), line.last()) else {
        return Err(at.value(&key, "[]", "the points of one period"));
    };
    if let Some(point) = line.iter().find(|point| point.iter().any(|v| v.abs() > 1e7)) {
        return Err(at.value(&key, format!("{point:?}"), "points within 1e7 um"));
    }
    if first[1].to_bits() != last[1].to_bits() || last[0] <= first[0] {
        let got = format!("{first:?} to {last:?}");
        return Err(at.value(&key, got, "one period: both ends at one z, the last at a larger x"));
    }
    face(line, false, stated.direction_deg, table, at)
}

fn face(
    line: Vec<[f64; 2]>,
    is_symmetric: bool,
    direction_deg: Option<f64>,
    table: &str,
    at: &Context,
) -> Result<GroovedFace, ConfigError> {
    let direction = direction_deg.unwrap_or_default();
    let direction_deg = at.within(&format!("{table}.direction_deg"), direction, -360.0, 360.0)?;
    // Whatever the indices, the outline is the same.
    UnitCell::new(&Outline::below(&line, [1.5, 1.0])).map_err(|error| {
        let expected = format!("a line that does not meet itself: {error}");
        at.value(&format!("{table}.profile_um"), "a bad profile", &expected)
    })?;
    Ok(GroovedFace { line_um: line, direction_deg, is_symmetric })
}
