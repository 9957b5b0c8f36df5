// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[elements]`: as many rings as the dome holds, and one shape for every element, ranges neither
//! overlapping nor leaving gaps.

use geometry::profile::{Elements, Reference, Rounding, SAME_LENGTH, Shape};
use geometry::{BaseSurface, GeometryError};

use crate::check::Context;
use crate::error::ConfigError;
use crate::schema;
use crate::schema::dome::{PolylineShape, ShapeForm, TriangleShape};

/// Most radii of corners, µm.
const MAX_RADIUS_UM: f64 = 1e7;

/// The relief of `raw` on `base`.
pub(crate) fn resolve(
    raw: Option<&schema::Elements>,
    base: Option<BaseSurface<'_>>,
    at: &Context,
) -> Result<Elements, ConfigError> {
    let Some(raw) = raw else {
        return Ok(Elements { width_mm: 0.0, shapes: Vec::new(), rounding: Rounding::default() });
    };
    let Some(base) = base else {
        return Err(at.value("elements", "given", "no such table without [dome]"));
    };
    at.count("elements.count", raw.count, 1, 2_000)?;
    let width_mm = 1e-3 * at.length_um("elements.width_um", raw.width_um)?;
    let reach_mm = base.reach_mm();
    if raw.count as f64 * width_mm > reach_mm * (1.0 + SAME_LENGTH) {
        let most = (reach_mm / width_mm * (1.0 + SAME_LENGTH)).floor();
        let carrier = match base {
            BaseSurface::Sphere(_) => format!("on a dome {} mm wide", 2.0 * reach_mm),
            BaseSurface::Curve(_) => {
                format!("on a meridian that is a function z(r) as far as r = {reach_mm} mm")
            }
        };
        let expected = format!("at most {most} elements of {} um {carrier}", raw.width_um);
        return Err(at.value("elements.count", raw.count, &expected));
    }
    let radius = |key: &str, um: f64| {
        let key = format!("elements.{key}_radius_um");
        at.within(&key, um, 0.0, MAX_RADIUS_UM).map(|um| 1e-3 * um)
    };
    let rounding = Rounding {
        tip_mm: radius("tip", raw.tip_radius_um)?,
        valley_mm: radius("valley", raw.valley_radius_um)?,
    };
    let shapes = shapes(raw, at)?;
    for (k, shape) in shapes.iter().enumerate() {
        stands(shape, base, (k + 1, width_mm)).map_err(|expected| {
            at.value("elements.shapes", format!("element {}", k + 1), &expected)
        })?;
    }
    Ok(Elements { width_mm, shapes, rounding })
}

/// The error of relief that cannot be built, under `key` unless a radius is to blame.
pub(crate) fn refused(error: &GeometryError, key: &str, at: &Context) -> ConfigError {
    let &GeometryError::Radius { element, corner, radius_um, most_um } = error else {
        return at.value(key, error, "rings that neither cross nor overlap");
    };
    let ring = if key == "elements.shapes" {
        format!("element {element}")
    } else {
        format!("ring {element} of hybrid.element_width_um")
    };
    let expected = format!("at most {most_um} um, which the sides at {ring} hold");
    let radius_um = (radius_um * 1e6).round() / 1e6;
    at.value(&format!("elements.{corner}_radius_um"), radius_um, &expected)
}

/// True if a shape stands outside the dome all over its element, of this number and width: a
/// triangle by angles from the horizontal rises above the chord on both sides, and a step stands
/// where the dome falls outwards.
fn stands(
    shape: &Shape,
    base: BaseSurface<'_>,
    (element, width_mm): (usize, f64),
) -> Result<(), String> {
    let outer_mm = element as f64 * width_mm;
    let [least, most] = base.slopes_deg([outer_mm - width_mm, outer_mm]);
    match *shape {
        Shape::Triangle { inner_base_deg, apex_deg, reference: Reference::Horizontal } => {
            let outer = 180.0 - inner_base_deg - apex_deg;
            if outer <= most {
                return Err(format!(
                    "a triangle whose outer side is steeper than the dome, {most:.1} degrees \
                     there, not {outer:.1}"
                ));
            }
            if inner_base_deg <= -least {
                return Err(format!(
                    "a triangle whose inner side is steeper than the dome, which rises by {:.1} \
                     degrees there, not {inner_base_deg:.1}",
                    -least
                ));
            }
            Ok(())
        }
        Shape::Os1 if least < -LEVEL_DEG => Err(format!(
            "a step where the dome falls outwards; it rises by {:.1} degrees there",
            -least
        )),
        _ => Ok(()),
    }
}

/// Rise that counts as level ground, degrees.
const LEVEL_DEG: f64 = 1e-6;

/// Shapes of all elements, in order from the axis.
fn shapes(elements: &schema::Elements, at: &Context) -> Result<Vec<Shape>, ConfigError> {
    let mut shapes: Vec<Option<Shape>> = vec![None; elements.count];
    for (entry, schema::Shape { shared: range, kind }) in elements.shapes.iter().enumerate() {
        let table = format!("elements.shapes[{}].", entry + 1);
        let at = &Context { file: at.file, prefix: &table };
        if range.from < 1 || range.from > elements.count {
            return Err(at.value(
                "from",
                range.from,
                &format!("an element from 1 to {}", elements.count),
            ));
        }
        if range.to < range.from || range.to > elements.count {
            return Err(at.value(
                "to",
                range.to,
                &format!("an element from {} to {}", range.from, elements.count),
            ));
        }
        let resolved = one(kind, at)?;
        for element in range.from..=range.to {
            if shapes[element - 1].replace(resolved.clone()).is_some() {
                return Err(at.value(
                    "from",
                    format!("{} to {}", range.from, range.to),
                    &format!("elements that no other entry shapes; element {element} overlaps"),
                ));
            }
        }
    }
    shapes
        .into_iter()
        .enumerate()
        .map(|(i, s)| {
            s.ok_or_else(|| {
                at.value(
                    "elements.shapes",
                    format!("none for element {}", i + 1),
                    "a shape for every element",
                )
            })
        })
        .collect()
}

fn one(shape: &ShapeForm, at: &Context) -> Result<Shape, ConfigError> {
    match shape {
        ShapeForm::Os1(_) => Ok(Shape::Os1),
        ShapeForm::Smooth(_) => Ok(Shape::Smooth),
        ShapeForm::Triangle(shape) => triangle(shape, at),
        ShapeForm::Polyline(PolylineShape { points_chords }) => {
            let points: Vec<[f64; 2]> = points_chords.iter().map(|point| point.0).collect();
            if points.is_empty()
                || !points.iter().flatten().all(|v| v.is_finite())
                || points.iter().any(|p| p[1] <= 0.0)
            {
                return Err(at.value(
                    "points_chords",
                    format!("{points:?}"),
                    "at least one vertex, all above the chord",
                ));
            }
            let (low, high) =
                points.iter().fold((0.0f64, 1.0f64), |(a, b), p| (a.min(p[0]), b.max(p[0])));
            if high - low > 2.0 {
                return Err(at.value(
                    "points_chords",
                    format!("{} chords wide", high - low),
                    "at most two chords of width",
                ));
            }
            Ok(Shape::Polyline(points))
        }
    }
}

/// A triangle by two of its three angles.
fn triangle(shape: &TriangleShape, at: &Context) -> Result<Shape, ConfigError> {
    let angles = [
        ("inner_base_angle_deg", shape.inner_base_angle_deg),
        ("apex_angle_deg", shape.apex_angle_deg),
        ("outer_base_angle_deg", shape.outer_base_angle_deg),
    ];
    let given: Vec<(&str, f64)> =
        angles.iter().filter_map(|&(name, angle)| angle.map(|a| (name, a))).collect();
    let &[(_, first), (second_name, second)] = given.as_slice() else {
        let missing = angles.iter().find(|a| a.1.is_none());
        return Err(at.value(
            missing.map_or("outer_base_angle_deg", |a| a.0),
            if missing.is_some() { "nothing" } else { "given" },
            "two of the three angles of a triangle, in degrees",
        ));
    };
    for (name, angle) in &given {
        // Above the horizontal a side may fall outwards, less than the dome does.
        let falls = *name == "inner_base_angle_deg" && shape.reference == Reference::Horizontal;
        let least = if falls { -90.0 } else { 0.0 };
        if !(*angle > least && *angle < 180.0) {
            let expected = format!("an angle above {least} and below 180 degrees");
            return Err(at.value(name, angle, &expected));
        }
    }
    let third = 180.0 - first - second;
    if third <= 0.0 {
        let expected = format!("less than {} beside the other angle of {first}", 180.0 - first);
        return Err(at.value(second_name, second, &expected));
    }
    Ok(Shape::Triangle {
        inner_base_deg: shape.inner_base_angle_deg.unwrap_or(third),
        apex_deg: shape.apex_angle_deg.unwrap_or(third),
        reference: shape.reference,
    })
}
