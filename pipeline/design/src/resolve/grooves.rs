// SPDX-License-Identifier: MIT OR Apache-2.0
//! Grooves of a face, checked: prisms and any profile, as one period of a line.

use std::f64::consts::PI;

use bsdf::ray_optics::{Outline, UnitCell};

use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::solids::GroovedFace;
use crate::schema::solids::{Grooves, Prisms};
use runtime::serde_arrays::List;

/// Largest angle that a chord of a rounded tip turns through.
const CHORD_TURN: f64 = PI / 90.0;

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
    let (direction_deg, tips_um) = (stated.direction_deg.unwrap_or_default(), stated.tips_um);
    let face = GroovedFace { line_um: line, is_symmetric: true, direction_deg, tips_um };
    checked(face, [table, "tip_radius_um"], at)
}

/// Grooves of any profile, in the table `table`.
pub(crate) fn any(stated: &Grooves, table: &str, at: &Context) -> Result<GroovedFace, ConfigError> {
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
    let period = last[0] - first[0];
    let is_image = |([x, z], [of_x, of_z]): (&[f64; 2], &[f64; 2])| {
        (x - first[0] + of_x - last[0]).abs() < 1e-9 * period && (z - of_z).abs() < 1e-9 * period
    };
    let is_symmetric = line.iter().zip(line.iter().rev()).all(is_image);
    let (direction_deg, tips_um) = (stated.direction_deg.unwrap_or_default(), stated.tips_um);
    let face = GroovedFace { line_um: line, is_symmetric, direction_deg, tips_um };
    checked(face, [table, "profile_um"], at)
}

/// Checks the face; `key` of `table` is what is wrong with a line that meets itself.
fn checked(
    face: GroovedFace,
    [table, key]: [&str; 2],
    at: &Context,
) -> Result<GroovedFace, ConfigError> {
    at.within(&format!("{table}.direction_deg"), face.direction_deg, -360.0, 360.0)?;
    // Whatever the indices, the outline is the same.
    UnitCell::new(&Outline::below(&face.line_um, [1.5, 1.0])).map_err(|error| {
        let expected = format!("a line that does not meet itself: {error}");
        at.value(&format!("{table}.{key}"), "a bad profile", &expected)
    })?;
    if let Some(tips_um) = face.tips_um {
        let heights = || face.line_um.iter().map(|[_, z]| *z);
        let height_um =
            heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
        if !(tips_um > 0.0 && tips_um <= height_um) {
            let expected =
                format!("a depth above 0, at most {height_um:.4} um, the height of the grooves");
            return Err(at.value(&format!("{table}.tips_um"), tips_um, &expected));
        }
    }
    Ok(face)
}
