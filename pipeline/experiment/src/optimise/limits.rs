// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a mould can make: checked on the outline of a dome before anything is traced.

use anyhow::{Result, ensure};

use design::Design;
use geometry::{Curve, Meridian, Role};

use super::file::LimitKeys;

/// Distance from a limit below which a length counts as at it, as a share.
const AT_LIMIT: f64 = 1e-3;
/// Distance from a limit below which an angle counts as at it, degrees.
const AT_LIMIT_DEG: f64 = 0.05;
/// Rounding of angles, degrees.
const ROUNDING_DEG: f64 = 1e-6;

/// Checked limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Least angle of a side against the vertical, degrees.
    pub draft_deg: f64,
    /// Least interior angle of a tip, degrees.
    pub apex_deg: f64,
    total_height_mm: f64,
    ring_width_um: f64,
    tip_radius_um: f64,
    valley_radius_um: f64,
    overhang: bool,
}

impl Limits {
    /// # Errors
    /// Angles and lengths out of range.
    pub fn new(keys: &LimitKeys) -> Result<Self> {
        let angle = |key: &str, value: Option<f64>, most: f64| -> Result<f64> {
            let value = value.unwrap_or(0.0);
            ensure!(
                (0.0..=most).contains(&value),
                "limits.{key}: expected degrees from 0 to {most}, got {value}"
            );
            Ok(value)
        };
        let length = |key: &str, value: Option<f64>, none: f64| -> Result<f64> {
            let given = value.unwrap_or(1.0);
            ensure!(
                given > 0.0 && given.is_finite(),
                "limits.{key}: expected a length above 0, got {given}"
            );
            Ok(value.unwrap_or(none))
        };
        Ok(Self {
            draft_deg: angle("draft_deg", keys.draft_deg, 45.0)?,
            apex_deg: angle("apex_deg", keys.apex_deg, 170.0)?,
            total_height_mm: length("total_height_mm", keys.total_height_mm, f64::INFINITY)?,
            ring_width_um: length("ring_width_um", keys.ring_width_um, 0.0)?,
            tip_radius_um: length("tip_radius_um", keys.tip_radius_um, 0.0)?,
            valley_radius_um: length("valley_radius_um", keys.valley_radius_um, 0.0)?,
            overhang: keys.overhang,
        })
    }

    /// Which limit `design` breaks, with value and limit.
    pub fn broken(&self, design: &Design) -> Option<String> {
        let outline = design.outline().ok()?;
        let top = outline.top_mm();
        if top > self.total_height_mm * (1.0 + 1e-12) {
            let limit = self.total_height_mm;
            return Some(format!("limits.total_height_mm: {top:.4} above {limit}"));
        }
        for (key, value, limit) in self.of_relief(design) {
            if value < limit * (1.0 - 1e-12) {
                return Some(format!("limits.{key}: {value} below {limit}"));
            }
        }
        if !self.overhang && leans(&outline) {
            return Some("limits.overhang: the outline leans over itself".to_owned());
        }
        if !design.has_relief() {
            return None;
        }
        let steepest = walls(&outline).fold((0, 90.0), least);
        if steepest.1 < self.draft_deg - ROUNDING_DEG {
            return Some(format!(
                "limits.draft_deg: {:.3} below {} in element {}",
                steepest.1, self.draft_deg, steepest.0
            ));
        }
        let sharpest = tips(&outline).into_iter().fold((0, 180.0), least);
        (sharpest.1 < self.apex_deg - ROUNDING_DEG).then(|| {
            format!(
                "limits.apex_deg: {:.3} below {} in element {}",
                sharpest.1, self.apex_deg, sharpest.0
            )
        })
    }

    /// Key, length and least length of what `design` has of a relief, µm.
    fn of_relief(&self, design: &Design) -> impl Iterator<Item = (&'static str, f64, f64)> {
        let elements = &design.elements;
        let lengths = [
            ("ring_width_um", 1e3 * elements.width_mm, self.ring_width_um),
            ("tip_radius_um", 1e3 * elements.rounding.tip_mm, self.tip_radius_um),
            ("valley_radius_um", 1e3 * elements.rounding.valley_mm, self.valley_radius_um),
        ];
        lengths.into_iter().take(if design.has_relief() { lengths.len() } else { 0 })
    }

    /// Limits at which `design` stands, each with the elements that do.
    pub fn active(&self, design: &Design) -> Vec<String> {
        let Ok(outline) = design.outline() else {
            return Vec::new();
        };
        let height = [("total_height_mm", outline.top_mm(), self.total_height_mm)];
        let lengths = height.into_iter().chain(self.of_relief(design));
        let at_limit = lengths.filter(|(_, value, limit)| (value / limit - 1.0).abs() < AT_LIMIT);
        let mut active: Vec<String> = at_limit.map(|(key, ..)| key.to_owned()).collect();
        let mut at = |key: &str, limit: f64, angles: Vec<(usize, f64)>| {
            let near = angles
                .into_iter()
                .filter(|(_, angle)| limit > 0.0 && (angle - limit).abs() < AT_LIMIT_DEG);
            let mut elements: Vec<usize> = near.map(|(element, _)| element).collect();
            elements.dedup();
            if !elements.is_empty() {
                let list: Vec<String> = elements.iter().map(usize::to_string).collect();
                active.push(format!("{key} in element {}", list.join(", ")));
            }
        };
        at("draft_deg", self.draft_deg, walls(&outline).collect());
        at("apex_deg", self.apex_deg, tips(&outline));
        active
    }
}

fn least(a: (usize, f64), b: (usize, f64)) -> (usize, f64) {
    if b.1 < a.1 { b } else { a }
}

/// True where a piece goes back towards the axis.
fn leans(outline: &Meridian) -> bool {
    let back = |[a, _]: [f64; 2], [b, _]: [f64; 2]| b < a - 1e-9;
    outline.pieces.iter().any(|p| back(p.start, p.end))
}

/// Element and angle against the vertical of every straight side, degrees.
fn walls(outline: &Meridian) -> impl Iterator<Item = (usize, f64)> {
    outline.pieces.iter().filter_map(|piece| match piece.role {
        Role::Element(element) if piece.curve == Curve::Line => {
            let [dr, dz] = [0, 1].map(|k| (piece.end[k] - piece.start[k]).abs());
            Some((element, dr.atan2(dz).to_degrees()))
        }
        _ => None,
    })
}

/// Element and interior angle of every tip, degrees: corners at which the outline turns clockwise,
/// seen with r to the right and z up.
fn tips(outline: &Meridian) -> Vec<(usize, f64)> {
    let along = |k: usize| {
        let p = &outline.pieces[k];
        [p.end[0] - p.start[0], p.end[1] - p.start[1]]
    };
    let tip = |k: usize| {
        let (a, b) = (&outline.pieces[k], &outline.pieces[k + 1]);
        let (Role::Element(element), Role::Element(next)) = (a.role, b.role) else {
            return None;
        };
        if element != next || a.curve != Curve::Line || b.curve != Curve::Line {
            return None;
        }
        let ([ar, az], [br, bz]) = (along(k), along(k + 1));
        let turn = (ar * bz - az * br).atan2(ar * br + az * bz).to_degrees();
        (turn < 0.0).then_some((element, 180.0 + turn))
    };
    (0..outline.pieces.len().saturating_sub(1)).filter_map(tip).collect()
}
