// SPDX-License-Identifier: MIT OR Apache-2.0
//! Relief by the slopes of both sides of every ring: what searches vary and moulds get wrong.

#[cfg(test)]
mod tests;

use anyhow::{Context, Result, ensure};
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Value;

use design::Design;
use geometry::profile::Shape;
use geometry::{BaseSurface, Chord, vertices};

/// Least angle between a side and the smooth surface below it, degrees.
const LEAST_BASE_DEG: f64 = 0.5;

/// The sides of a ring, as files of searches and tolerances name them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum Side {
    /// Sides nearer the axis, positive where they rise outwards.
    #[serde(rename = "inner_slope_deg")]
    Inner,
    /// Sides farther out, positive where they fall outwards.
    #[serde(rename = "outer_slope_deg")]
    Outer,
}

impl Side {
    /// As written in files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Inner => "inner_slope_deg",
            Self::Outer => "outer_slope_deg",
        }
    }
}

/// Slopes of the sides of every ring against the horizontal, degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct RingSlopes {
    inner: Vec<f64>,
    outer: Vec<f64>,
    /// Least and largest fall of the smooth surface below each ring, degrees.
    falls: Vec<[f64; 2]>,
}

impl RingSlopes {
    /// Of the rings of `design`.
    ///
    /// # Errors
    /// Rings that are no triangles, steps or smooth; a package without rings.
    pub fn of(design: &Design) -> Result<Self> {
        let base = base(design)?;
        let mut slopes = Self { inner: Vec::new(), outer: Vec::new(), falls: Vec::new() };
        for (k, shape) in design.elements.shapes.iter().enumerate() {
            let width_mm = design.elements.width_mm;
            let chord = Chord::of(base, width_mm, k + 1);
            let fall = chord.slope().to_degrees();
            let corners = vertices(shape, &chord);
            ensure!(
                corners.len() <= 1,
                "expected triangles and steps, got a polygon in element {}",
                k + 1
            );
            let (inner, outer) = match corners.first() {
                Some([x, y]) => {
                    let rest = chord.length_mm() - x;
                    (y.atan2(*x).to_degrees(), y.atan2(rest).to_degrees())
                }
                // A smooth ring, and a step on a level chord.
                None => (0.0, 0.0),
            };
            slopes.inner.push(inner - fall);
            slopes.outer.push(match shape {
                Shape::Os1 => 90.0,
                _ => outer + fall,
            });
            slopes.falls.push(falls(base, k, width_mm));
        }
        Ok(slopes)
    }

    /// Puts sides of the same slopes on the smooth surface of `design`, which has as many rings.
    ///
    /// # Errors
    /// A package without rings.
    pub fn place_on(&mut self, design: &Design) -> Result<()> {
        let base = base(design)?;
        let width_mm = design.elements.width_mm;
        for (k, fall) in self.falls.iter_mut().enumerate() {
            *fall = falls(base, k, width_mm);
        }
        Ok(())
    }

    /// Number of rings.
    pub fn count(&self) -> usize {
        self.falls.len()
    }

    /// Slopes of one side of all rings, from the axis.
    pub fn values(&self, side: Side) -> Vec<f64> {
        match side {
            Side::Inner => self.inner.clone(),
            Side::Outer => self.outer.clone(),
        }
    }

    /// Sets the slope of `ring`, from 1.
    pub fn set(&mut self, side: Side, ring: usize, slope_deg: f64) {
        match side {
            Side::Inner => self.inner[ring - 1] = slope_deg,
            Side::Outer => self.outer[ring - 1] = slope_deg,
        }
    }

    /// Clips slopes so that sides stay above the smooth surface, no side is steeper than
    /// `steepest_deg`, and no tip is sharper than `apex_deg`.
    pub fn clip(&mut self, steepest_deg: f64, apex_deg: f64) {
        for k in 0..self.falls.len() {
            let [least, most] = self.falls[k];
            let outer = self.outer[k].min(steepest_deg).max(most + LEAST_BASE_DEG);
            let inner = self.inner[k].min(steepest_deg).min(180.0 - apex_deg - outer);
            self.outer[k] = outer;
            self.inner[k] = inner.max(LEAST_BASE_DEG - least);
        }
    }

    /// The value of `elements.shapes` with every ring smooth.
    pub fn smooth(&self) -> Value {
        let ring = |(key, value): (&str, Value)| (key.to_owned(), value);
        Value::Array(vec![Value::Table(toml::Table::from_iter(
            [
                ("from", Value::Integer(1)),
                ("to", Value::Integer(self.count() as i64)),
                ("type", Value::String("smooth".to_owned())),
            ]
            .map(ring),
        ))])
    }

    /// The value of `elements.shapes`: a triangle for each ring.
    pub fn shapes(&self) -> Value {
        let shape = |k: usize| {
            let number = Value::Integer(k as i64 + 1);
            Value::Table(toml::Table::from_iter([
                ("from".to_owned(), number.clone()),
                ("to".to_owned(), number),
                ("type".to_owned(), Value::String("triangle".to_owned())),
                ("reference".to_owned(), Value::String("horizontal".to_owned())),
                ("inner_base_angle_deg".to_owned(), Value::Float(self.inner[k])),
                ("outer_base_angle_deg".to_owned(), Value::Float(self.outer[k])),
            ]))
        };
        Value::Array((0..self.count()).map(shape).collect())
    }
}

/// The smooth surface below the rings of `design`.
fn base(design: &Design) -> Result<BaseSurface<'_>> {
    let base = design.base();
    let base = base.filter(|_| !design.elements.shapes.is_empty());
    base.context("expected a design with [elements], got a package without rings")
}

/// Least and largest fall of the smooth surface below ring `k` from 0, degrees.
fn falls(base: BaseSurface, k: usize, width_mm: f64) -> [f64; 2] {
    base.slopes_deg([k, k + 1].map(|k| k as f64 * width_mm))
}
