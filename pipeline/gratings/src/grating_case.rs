// SPDX-License-Identifier: MIT OR Apache-2.0
//! One grating and one incident wave from a JSON file, as `batwing grating` takes it.
//!
//! In: the text of a file that holds either the inputs themselves or an object with them under
//! `inputs` (as the reference cases in `data/reference/` do). Out: a [`Case`] of checked values
//! and `rcwa`'s own types. Lengths are in any one unit, indices `[n, k]`, angles in degrees; light
//! comes from the top, z points into the structure (see `docs/explanation/conventions.md`).
//!
//! Every refusal is one line: file, key, what was expected, what was found.

pub mod keys;
#[cfg(test)]
mod tests;

use std::fmt::{Debug, Display};
use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context, Error, Result, anyhow, bail};
use bsdf::json;
use num_complex::Complex64;
use rcwa::Truncation;
use rcwa::accuracy::{MAX_TOLERANCE, MIN_TOLERANCE};
use rcwa::relief::floating::{Ridges, floating_words};
use rcwa::relief::{Layer, Polygon, Relief, Segment};
use runtime::bounded_text::{MAX_KEYS, bounded_text};
use serde_json::Value;

use runtime::control_characters::refusal;
use runtime::field_names::names;
use runtime::serde_arrays::List;
use runtime::serde_messages::key_text;
use runtime::serde_messages::plain;

use crate::boundary_integral::Outline;

pub use keys::Polarization;
use keys::{CaseKeys, LayerKeys, Mount, ProfileKeys, ReliefKeys};

/// A grating, a wave that falls on it, and how exactly to solve it.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Vacuum wavelength, in the unit of all lengths here.
    pub wavelength: f64,
    /// Period along x.
    pub period: f64,
    /// Index of the half-space from which light comes; real.
    pub n_top: Complex64,
    /// Index n + ik of the half-space behind the structure.
    pub n_bottom: Complex64,
    /// What lies between.
    pub structure: Structure,
    /// Polar angle of incidence in the top half-space, -90 < θ < 90 degrees; a negative one is the
    /// positive one at the opposite azimuth.
    pub theta_deg: f64,
    /// Azimuth of the plane of incidence from x, in degrees.
    pub phi_deg: f64,
    /// Polarisation of the incident wave.
    pub polarization: Polarization,
    /// Orders to keep, or the error to stay below.
    pub accuracy: Accuracy,
    /// Whether the Jones matrices are wanted too.
    pub jones: bool,
}

/// Refuses texts and keys with control characters.
fn refuse_controls(value: &Value) -> Result<()> {
    let usable = |text: &str| refusal(text, true).map_or(Ok(()), |said| bail!(said));
    match value {
        Value::String(text) => usable(text),
        Value::Array(entries) => entries.iter().try_for_each(refuse_controls),
        Value::Object(fields) => fields.iter().try_for_each(|(key, value)| {
            usable(key)?;
            refuse_controls(value).with_context(|| key.clone())
        }),
        _ => Ok(()),
    }
}

/// What lies between the half-spaces.
#[derive(Debug, Clone, PartialEq)]
pub enum Structure {
    /// Layers from top to bottom, each thicker than 0; none is a bare interface.
    Layers(Vec<Layer>),
    /// A cross-section still to be cut into layers.
    Relief(Relief),
    /// The surface between the half-spaces.
    Profile(Outline),
}

/// How exactly to solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Accuracy {
    /// Keep the orders -N..N.
    Orders(usize),
    /// Choose orders and slices so that no efficiency is off by more than this, from
    /// [`MIN_TOLERANCE`] to [`MAX_TOLERANCE`].
    Tolerance(f64),
}

/// Periods in wavelengths that need no second look.
pub const USUAL_PERIODS: RangeInclusive<f64> = 0.02..=1000.0;

impl Case {
    /// The warning of a period and a wavelength that are probably in different units.
    fn unlike_units(&self) -> Option<String> {
        let ratio = self.period / self.wavelength;
        (!USUAL_PERIODS.contains(&ratio)).then(|| {
            format!(
                "period: {} beside a wavelength of {}: their ratio {ratio:e} suggests that one is in another unit",
                self.period, self.wavelength
            )
        })
    }

    /// The warning of ridges of the material of a half-space that do not stand on it.
    fn floating(&self) -> Option<String> {
        let Structure::Relief(relief) = &self.structure else {
            return None;
        };
        let polygons: Vec<_> =
            relief.polygons().iter().map(|p| (p.index, p.points.as_slice())).collect();
        let ridges = Ridges {
            period: self.period,
            depth: relief.depth(),
            background: &relief.background(),
            polygons: &polygons,
            half_spaces: [&self.n_top, &self.n_bottom],
        };
        let (number, half_spaces) = ridges.floating()?;
        let name = format!("index {}", polygons[number].0);
        Some(format!(
            "relief.polygons: {}; z points from the top to the bottom",
            floating_words(&name, &half_spaces)
        ))
    }

    /// Warnings of what was probably not meant.
    pub fn doubts(&self) -> Vec<String> {
        [self.unlike_units(), self.floating()].into_iter().flatten().collect()
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// A file that cannot be read, and whatever [`Case::parse`] refuses.
    pub fn read(path: &Path) -> Result<Self> {
        let name = path.display();
        let text = bounded_text(path, MAX_KEYS)
            .with_context(|| format!("{name}: expected a case of a grating, cannot read it"))?;
        Self::parse(&name.to_string(), &text)
    }

    /// Checks the text of a file; `name` stands before every message.
    ///
    /// # Errors
    /// Text that is no JSON, a missing or unknown key, a value out of its range.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        Self::from_text(text).map_err(|error| anyhow::anyhow!("{name}: {error:#}"))
    }

    fn from_text(text: &str) -> Result<Self> {
        // Editors of some systems begin a file with a byte order mark.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let value = json::parse(text.as_bytes()).map_err(|error| {
            let other_than_json = !error.is_data();
            let error = anyhow::Error::new(error);
            if other_than_json { error.context("is not valid JSON") } else { error }
        })?;
        refuse_controls(&value)?;
        match value.get("inputs") {
            Some(inputs) => {
                refuse_inputs_outside(&value)?;
                Self::new(read(inputs, "inputs")?)
            }
            None => Self::new(read(&value, "")?),
        }
    }

    fn new(keys: CaseKeys) -> Result<Self> {
        let wavelength = length("wavelength", keys.wavelength)?;
        let period = length("period", keys.period)?;
        let n_top = index("n_top", keys.n_top)?;
        if n_top.re <= 0.0 || n_top.im != 0.0 {
            // Light has a direction and a share of power only where it is not absorbed.
            let expected = "[n, 0] with n > 0, since light comes from this half-space";
            return Err(wrong("n_top", expected, keys.n_top));
        }
        let layers = "layers_top_to_bottom";
        let found = (keys.layers_top_to_bottom, keys.relief, keys.profile);
        let (structure, key, thickness) = match found {
            (Some(all), None, None) => {
                let all = (1..).zip(all).map(|(k, keys)| layer(keys, &format!("{layers}[{k}]")));
                let mut all: Vec<Layer> = all.collect::<Result<_>>()?;
                all.retain(|layer| layer.thickness > 0.0);
                let thickness = all.iter().map(|layer| layer.thickness).sum();
                (Structure::Layers(all), layers, thickness)
            }
            (None, Some(keys), None) => {
                let depth = keys.depth;
                (Structure::Relief(relief(keys, period)?), "relief.depth", depth)
            }
            (None, None, Some(keys)) => {
                let outline = profile(keys, period)?;
                let [low, high] = outline.extent();
                (Structure::Profile(outline), "profile", high - low)
            }
            (None, None, None) => return Err(one_of_structures("none")),
            _ => return Err(one_of_structures("several")),
        };
        if thickness > MAX_WAVELENGTHS * wavelength {
            let expected = format!("at most {MAX_WAVELENGTHS:e} wavelengths in all");
            return Err(wrong(key, expected, thickness / wavelength));
        }
        if keys.theta_deg.abs() >= 90.0 {
            let expected = "an angle above -90 and below 90 degrees";
            return Err(wrong("theta_deg", expected, keys.theta_deg));
        }
        if keys.phi_deg.abs() > 360.0 {
            return Err(wrong("phi_deg", "an angle from -360 to 360 degrees", keys.phi_deg));
        }
        let is_planar = keys.theta_deg == 0.0 || keys.phi_deg % 180.0 == 0.0;
        if keys.mount == Some(Mount::Classical) && !is_planar {
            return Err(wrong("phi_deg", "0 in a classical mount", keys.phi_deg));
        }
        Ok(Self {
            wavelength,
            period,
            n_top,
            n_bottom: index("n_bottom", keys.n_bottom)?,
            structure,
            theta_deg: keys.theta_deg,
            phi_deg: keys.phi_deg,
            polarization: keys.pol,
            accuracy: accuracy(keys.highest_order, keys.tolerance)?,
            jones: keys.jones,
        })
    }
}

/// Largest thickness in wavelengths: beyond, rounding decides the phase behind it.
const MAX_WAVELENGTHS: f64 = 1e9;
/// Highest N: a third more orders, for the estimated error, are the most that the solver takes.
const MOST_ORDERS: usize = Truncation::MAX / 4 * 3;
/// Largest part of an index.
const MAX_INDEX: f64 = 1e6;

/// The message that a value of a key is refused with.
fn wrong(key: impl Display, expected: impl Display, got: impl Debug) -> Error {
    anyhow!("{key}: expected {expected}, got {got:?}")
}

/// The refusal of no structure, or of several.
fn one_of_structures(got: &str) -> Error {
    anyhow!(
        "layers_top_to_bottom: expected either layers_top_to_bottom, relief or profile, got {got}"
    )
}

/// The refusal of two keys of which one is needed, where there are `both` or neither.
fn either(key: &str, other: &str, both: bool) -> Error {
    let got = if both { "both" } else { "neither" };
    anyhow!("{key}: expected either {key} or {other}, got {got}")
}

/// The keys of the object at `path`, empty for the file itself.
fn read(value: &Value, path: &str) -> Result<CaseKeys> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let said = error.inner().to_string();
        let words = plain(&said, "a JSON object", None);
        let (missing, message) = words.map_or((None, said), |words| (words.missing, words.message));
        let below = key_text(error.path());
        let steps = [path, &below, missing.as_deref().unwrap_or_default()];
        let steps: Vec<&str> = steps.into_iter().filter(|step| !step.is_empty()).collect();
        let key = if steps.is_empty() { "the file".to_owned() } else { steps.join(".") };
        anyhow!("{key}: {message}")
    })
}

/// In a file whose inputs stand under `inputs`, refuses those that stand beside it and would be
/// overlooked. (`tolerance` as an object belongs to a reference case's outputs.)
fn refuse_inputs_outside(file: &Value) -> Result<()> {
    let is_outside = |key: &&&str| {
        let found = file.get(**key);
        found.is_some_and(|value| **key != "tolerance" || !value.is_object())
    };
    match names::<CaseKeys>().iter().find(is_outside) {
        Some(key) => bail!("{key}: expected this key inside inputs, got it beside inputs"),
        None => Ok(()),
    }
}

/// A number above 0, with room for its ratios to others.
fn length(key: &str, value: f64) -> Result<f64> {
    match value {
        1e-100..=1e100 => Ok(value),
        _ if value > 0.0 => Err(wrong(key, "a length from 1e-100 to 1e100", value)),
        _ => Err(wrong(key, "a length above 0", value)),
    }
}

/// A refractive index.
fn index(key: impl Display, List([n, k]): List<f64, 2>) -> Result<Complex64> {
    let range = 0.0..=MAX_INDEX;
    if range.contains(&n) && range.contains(&k) && (n > 0.0 || k > 0.0) {
        // Adding zero makes -0 a 0, on which branches of square roots hang.
        return Ok(Complex64::new(n + 0.0, k + 0.0));
    }
    Err(wrong(key, "[n, k] with n >= 0 and k >= 0, not both 0, at most 1e6", [n, k]))
}

fn accuracy(orders: Option<usize>, tolerance: Option<f64>) -> Result<Accuracy> {
    match (orders, tolerance) {
        (Some(orders), None) if orders <= MOST_ORDERS => Ok(Accuracy::Orders(orders)),
        (Some(orders), None) => {
            Err(wrong("N", format!("a whole number from 0 to {MOST_ORDERS}"), orders))
        }
        (None, Some(tolerance)) if (MIN_TOLERANCE..=MAX_TOLERANCE).contains(&tolerance) => {
            Ok(Accuracy::Tolerance(tolerance))
        }
        (None, Some(tolerance)) => {
            let range = format!("a number from {MIN_TOLERANCE:e} to {MAX_TOLERANCE}");
            Err(wrong("tolerance", range, tolerance))
        }
        (orders, _) => Err(either("N", "tolerance", orders.is_some())),
    }
}

fn layer(keys: LayerKeys, path: &str) -> Result<Layer> {
    if keys.thickness < 0.0 {
        return Err(wrong(format!("{path}.thickness"), "a length from 0", keys.thickness));
    }
    let path = format!("{path}.segments");
    let segments = (1..).zip(keys.segments).map(|(k, keys)| {
        let index = index(format!("{path}[{k}].n"), keys.n)?;
        Ok(Segment { x0: keys.x0, x1: keys.x1, index })
    });
    Layer::new(keys.thickness, segments.collect::<Result<_>>()?).context(path)
}

fn relief(keys: ReliefKeys, period: f64) -> Result<Relief> {
    let depth = length("relief.depth", keys.depth)?;
    let background = index("relief.background", keys.background)?;
    let polygons = (1..).zip(keys.polygons).map(|(k, keys)| {
        let index = index(format!("relief.polygons[{k}].n"), keys.n)?;
        Ok(Polygon { index, points: keys.points.into_iter().map(|List(point)| point).collect() })
    });
    let polygons = polygons.collect::<Result<_>>()?;
    Relief::new(period, depth, background, polygons).context("relief.polygons")
}

fn profile(keys: ProfileKeys, period: f64) -> Result<Outline> {
    match (keys.sinusoid, keys.points) {
        (Some(height), None) => {
            let height = length("profile.sinusoid", height)?;
            Ok(Outline::fourier(period, vec![[0.5 * height, 0.0]])?)
        }
        (None, Some(points)) => {
            let corner = |(k, row): (usize, Vec<f64>)| match row[..] {
                [x, z] => Ok(([x, z], 0.0)),
                [x, z, turn] => Ok(([x, z], turn.to_radians())),
                _ => {
                    let key = format!("profile.points[{k}]");
                    Err(wrong(key, "2 or 3 numbers", row.len()))
                }
            };
            let corners = (1..).zip(points).map(corner).collect::<Result<Vec<_>>>()?;
            Outline::arcs(period, &corners).context("profile.points")
        }
        (sinusoid, _) => Err(either("profile.sinusoid", "profile.points", sinusoid.is_some())),
    }
}
