// SPDX-License-Identifier: MIT OR Apache-2.0
//! Microlenses, pyramids and cones of a face, checked.

use bsdf::{Relief, ReliefLattice, ReliefShape};

use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::solids::ReliefFace;
use crate::schema::solids::{Prisms, Relief as StatedRelief, ReliefCells};
use metrics::digits::shortest;

/// Angles at the tip, degrees.
const APEX_DEG: [f64; 2] = [10.0, 170.0];
/// Radius of curvature of a lens over its base, at most.
const MAX_RADIUS: f64 = 1000.0;

/// The relief of a face, in the table `table`.
pub(crate) fn resolve(
    stated: &StatedRelief,
    shape: ReliefShape,
    table: &str,
    at: &Context,
) -> Result<ReliefFace, ConfigError> {
    let key = |name: &str| format!("{table}.{name}");
    let pitch = at.length_um(&key("pitch_um"), stated.pitch_um())?;
    let base = at.length_um(&key("base_um"), stated.base_um.unwrap_or(pitch))?;
    if base > pitch {
        let expected = format!("at most {} um, the pitch: bases do not overlap", shortest(pitch));
        return Err(at.value(&key("base_um"), shortest(base), &expected));
    }
    let direction = stated.direction_deg.unwrap_or_default();
    let direction_deg = at.within(&key("direction_deg"), direction, -360.0, 360.0)?;
    let height = match shape {
        ReliefShape::Lens => of_lens(stated, base, &key, at)?,
        ReliefShape::Pyramid | ReliefShape::Cone => of_tip(stated, base, &key, at)?,
    };
    let lattice = match stated.cell {
        ReliefCells::Square => ReliefLattice::Square,
        ReliefCells::Hexagonal => ReliefLattice::Hexagonal,
    };
    let is_pressed_in = stated.pressed_in;
    let relief = Relief { lattice, shape, pitch, base, height, is_pressed_in };
    Ok(ReliefFace { relief, direction_deg })
}

/// Height of a lens by its radius of curvature or as stated, µm.
fn of_lens(
    stated: &StatedRelief,
    base: f64,
    key: &dyn Fn(&str) -> String,
    at: &Context,
) -> Result<f64, ConfigError> {
    let half = 0.5 * base;
    if let Some(apex_deg) = stated.apex_deg {
        return Err(at.value(&key("apex_deg"), apex_deg, "no such key of lenses"));
    }
    let of_radius = |radius: f64| {
        let height = half * half / (radius + (radius * radius - half * half).sqrt());
        height.min(half)
    };
    match (stated.radius_um, stated.height_um) {
        (Some(radius), None) => {
            let most = MAX_RADIUS * base;
            if !(half..=most).contains(&radius) {
                let [half, most] = [half, most].map(shortest);
                let expected = format!("from {half}, half of the base, to {most} um");
                return Err(at.value(&key("radius_um"), radius, &expected));
            }
            Ok(of_radius(radius))
        }
        (None, Some(height)) => {
            let least = of_radius(MAX_RADIUS * base);
            if !(least..=half).contains(&height) {
                let expected = format!("from {least:.3e} to {} um, a half ball", shortest(half));
                return Err(at.value(&key("height_um"), height, &expected));
            }
            Ok(height)
        }
        (Some(_), Some(height)) => {
            Err(at.value(&key("height_um"), height, "no such key beside `radius_um`"))
        }
        (None, None) => Err(at.value(&key("radius_um"), "missing", "this key or `height_um`")),
    }
}

/// Height of a pyramid or cone by the angle at the tip or as stated, µm.
fn of_tip(
    stated: &StatedRelief,
    base: f64,
    key: &dyn Fn(&str) -> String,
    at: &Context,
) -> Result<f64, ConfigError> {
    if let Some(radius) = stated.radius_um {
        return Err(at.value(&key("radius_um"), radius, "no such key of pyramids and cones"));
    }
    let of_apex = |apex_deg: f64| 0.5 * base / (0.5 * apex_deg.to_radians()).tan();
    match (stated.apex_deg, stated.height_um) {
        (Some(_), Some(height)) => {
            Err(at.value(&key("height_um"), height, "no such key beside `apex_deg`"))
        }
        (None, Some(height)) => {
            let [most, least] = APEX_DEG.map(of_apex);
            if !(least..=most).contains(&height) {
                let expected =
                    format!("from {least:.4} to {most:.4} um, tips of 170 to 10 degrees");
                return Err(at.value(&key("height_um"), height, &expected));
            }
            Ok(height)
        }
        (apex_deg, None) => {
            let [least, most] = APEX_DEG;
            let apex_deg = apex_deg.unwrap_or(Prisms::APEX_DEG);
            Ok(of_apex(at.within(&key("apex_deg"), apex_deg, least, most)?))
        }
    }
}
