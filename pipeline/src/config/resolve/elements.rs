// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[elements.shapes]]`: one shape for every element, ranges neither overlapping nor leaving gaps.

use crate::config::check::Context;
use crate::config::error::ConfigError;
use crate::config::schema;
use crate::config::schema::dome::{PolylineShape, ShapeForm, TriangleShape};
use crate::geometry::profile::Shape;

/// Shapes of all elements, in order from the axis.
pub(in crate::config) fn resolve(
    elements: &schema::Elements,
    at: &Context,
) -> Result<Vec<Shape>, ConfigError> {
    let mut shapes: Vec<Option<Shape>> = vec![None; elements.count];
    for (
        entry,
        schema::Shape {
            shared: range,
            kind,
        },
    ) in elements.shapes.iter().enumerate()
    {
        let key = |name: &str| format!("elements.shapes[{}].{name}", entry + 1);
        if range.from < 1 || range.from > elements.count {
            return Err(at.value(
                &key("from"),
                range.from,
                &format!("an element from 1 to {}", elements.count),
            ));
        }
        if range.to < range.from || range.to > elements.count {
            return Err(at.value(
                &key("to"),
                range.to,
                &format!("an element from {} to {}", range.from, elements.count),
            ));
        }
        let resolved = one(kind, at, &key)?;
        for element in range.from..=range.to {
            if shapes[element - 1].replace(resolved.clone()).is_some() {
                return Err(at.value(
                    &key("from"),
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

fn one(
    shape: &ShapeForm,
    at: &Context,
    key: &dyn Fn(&str) -> String,
) -> Result<Shape, ConfigError> {
    match shape {
        ShapeForm::Os1(_) => Ok(Shape::Os1),
        ShapeForm::Smooth(_) => Ok(Shape::Smooth),
        ShapeForm::Triangle(shape) => triangle(shape, at, key),
        ShapeForm::Polyline(PolylineShape { points_chords }) => {
            let points: Vec<[f64; 2]> = points_chords.iter().map(|point| point.0).collect();
            if points.is_empty()
                || !points.iter().flatten().all(|v| v.is_finite())
                || points.iter().any(|p| p[1] <= 0.0)
            {
                return Err(at.value(
                    &key("points_chords"),
                    format!("{points:?}"),
                    "at least one vertex, all above the chord",
                ));
            }
            let (low, high) = points
                .iter()
                .fold((0.0f64, 1.0f64), |(a, b), p| (a.min(p[0]), b.max(p[0])));
            if high - low > 2.0 {
                return Err(at.value(
                    &key("points_chords"),
                    format!("{} chords wide", high - low),
                    "at most two chords of width",
                ));
            }
            Ok(Shape::Polyline(points))
        }
    }
}

/// A triangle by two of its three angles.
fn triangle(
    shape: &TriangleShape,
    at: &Context,
    key: &dyn Fn(&str) -> String,
) -> Result<Shape, ConfigError> {
    let angles = [
        ("inner_base_angle_deg", shape.inner_base_angle_deg),
        ("apex_angle_deg", shape.apex_angle_deg),
        ("outer_base_angle_deg", shape.outer_base_angle_deg),
    ];
    let given: Vec<(&str, f64)> = angles
        .iter()
        .filter_map(|&(name, angle)| angle.map(|a| (name, a)))
        .collect();
    let &[(_, first), (second_name, second)] = given.as_slice() else {
        let missing = angles.iter().find(|a| a.1.is_none());
        return Err(at.value(
            &key(missing.map_or("outer_base_angle_deg", |a| a.0)),
            if missing.is_some() {
                "nothing"
            } else {
                "given"
            },
            "two of the three angles of a triangle, in degrees",
        ));
    };
    for (name, angle) in &given {
        if !(*angle > 0.0 && *angle < 180.0) {
            return Err(at.value(&key(name), angle, "an angle above 0 and below 180 degrees"));
        }
    }
    let third = 180.0 - first - second;
    if third <= 0.0 {
        let expected = format!(
            "less than {} beside the other angle of {first}",
            180.0 - first
        );
        return Err(at.value(&key(second_name), second, &expected));
    }
    Ok(Shape::Triangle {
        inner_base_deg: shape.inner_base_angle_deg.unwrap_or(third),
        apex_deg: shape.apex_angle_deg.unwrap_or(third),
        reference: shape.reference,
    })
}
