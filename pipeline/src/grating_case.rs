// SPDX-License-Identifier: MIT OR Apache-2.0
//! One grating and one incident wave from a JSON file, as `batwing grating` takes it.
//!
//! In: the text of a file that holds either the inputs themselves or an object with them under
//! `inputs` (as the reference cases in `data/reference/` do). Out: a [`Case`] of checked values
//! and `rcwa`'s own types. Lengths are in any one unit, indices `[n, k]`, angles in degrees; light
//! comes from the top, z points into the structure (see `docs/explanation/conventions.md`).
//!
//! | key | value |
//! |---|---|
//! | `wavelength`, `period` | lengths |
//! | `n_top`, `n_bottom` | indices of the half-spaces, the top one lossless |
//! | `layers_top_to_bottom` | list of `thickness` and `segments` (`x0`, `x1` as fractions of the period, `n`); a layer of thickness 0 is dropped |
//! | `relief` | instead of layers: `depth`, `background`, `polygons` (`n`, `points` `[x, z]`) |
//! | `theta_deg`, `phi_deg` | direction of incidence, -90 < θ < 90; φ is 0 unless given |
//! | `pol` | `"s"`, `"p"` or `"unpolarised"` |
//! | `N` | highest order kept: orders -N..N |
//! | `tolerance` | instead of `N`: largest error of an efficiency, from which orders and slices follow |
//! | `jones` | optional, `true` for the Jones matrices of all orders too |
//! | `mount` | optional, `"classical"` or `"conical"`, only checked |
//!
//! Every refusal is one line: file, key, what was expected, what was found.

mod fields;
#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context, Result, bail};
use bsdf::json;
use files::bounded_text::{MAX_KEYS, bounded_text};
use files::control_characters::refusal;
use num_complex::Complex64;
use rcwa::Truncation;
use rcwa::accuracy::{MAX_TOLERANCE, MIN_TOLERANCE};
use rcwa::relief::{Layer, Polygon, Relief, Segment};
use serde_json::Value;

use fields::{Fields, wrong};

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
}

/// Polarisation of the incident wave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Polarization {
    /// E normal to the plane of incidence.
    S,
    /// H normal to the plane of incidence.
    P,
    /// Half of each.
    Unpolarised,
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

/// Periods in wavelengths that need no second look, as in the Python package.
const USUAL_PERIODS: RangeInclusive<f64> = 0.02..=1000.0;

impl Case {
    /// What is to be said of a period and a wavelength that are probably in different units.
    pub fn unlike_units(&self) -> Option<String> {
        let ratio = self.period / self.wavelength;
        (!USUAL_PERIODS.contains(&ratio)).then(|| {
            format!(
                "period: {} beside a wavelength of {}: their ratio {ratio:e} suggests that one is in another unit",
                self.period, self.wavelength
            )
        })
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
        let file = Fields::of("", &value)?;
        let inputs = match value.get("inputs") {
            Some(inputs) => {
                file.refuse_inputs_outside(&KEYS)?;
                Fields::of("inputs", inputs)?
            }
            None => file,
        };
        inputs.only(&KEYS)?;

        let wavelength = inputs.length("wavelength")?;
        let period = inputs.length("period")?;
        let (theta_deg, phi_deg) = direction(&inputs)?;
        let structure = structure(&inputs, period)?;
        let (key, thickness) = match &structure {
            Structure::Layers(layers) => {
                ("layers_top_to_bottom", layers.iter().map(|layer| layer.thickness).sum())
            }
            Structure::Relief(relief) => ("relief.depth", relief.depth()),
        };
        if thickness > MAX_WAVELENGTHS * wavelength {
            let expected = format!("at most {MAX_WAVELENGTHS:e} wavelengths in all");
            return Err(wrong(key, expected, format!("{:e}", thickness / wavelength)));
        }
        Ok(Self {
            wavelength,
            period,
            n_top: lossless_index(&inputs, "n_top")?,
            n_bottom: inputs.index("n_bottom")?,
            structure,
            theta_deg,
            phi_deg,
            polarization: polarization(&inputs)?,
            accuracy: accuracy(&inputs)?,
            jones: inputs.flag("jones")?,
        })
    }
}

const KEYS: [&str; 13] = [
    "wavelength",
    "period",
    "n_top",
    "n_bottom",
    "layers_top_to_bottom",
    "relief",
    "theta_deg",
    "phi_deg",
    "pol",
    "N",
    "tolerance",
    "jones",
    "mount",
];

/// Largest thickness in wavelengths: beyond, rounding decides the phase behind it.
const MAX_WAVELENGTHS: f64 = 1e9;
/// Highest N: a third more orders, for the estimated error, are the most that the solver takes.
const MOST_ORDERS: usize = Truncation::MAX / 4 * 3;

/// Light has a direction and a share of power only where it is not absorbed.
fn lossless_index(inputs: &Fields, key: &str) -> Result<Complex64> {
    let index = inputs.index(key)?;
    if index.re > 0.0 && index.im == 0.0 {
        return Ok(index);
    }
    Err(inputs.refuse(key, "[n, 0] with n > 0, since light comes from this half-space"))
}

fn direction(inputs: &Fields) -> Result<(f64, f64)> {
    let theta = inputs.number("theta_deg")?;
    if theta.abs() >= 90.0 {
        return Err(inputs.refuse("theta_deg", "an angle above -90 and below 90 degrees"));
    }
    let phi = if inputs.has("phi_deg") { inputs.number("phi_deg")? } else { 0.0 };
    if phi.abs() > 360.0 {
        return Err(inputs.refuse("phi_deg", "an angle from -360 to 360 degrees"));
    }
    let planar = theta == 0.0 || phi % 180.0 == 0.0;
    match inputs.optional_text("mount")? {
        None | Some("conical") => Ok((theta, phi)),
        Some("classical") if planar => Ok((theta, phi)),
        Some("classical") => Err(wrong("phi_deg", "0 in a classical mount", phi)),
        Some(_) => Err(inputs.refuse("mount", "\"classical\" or \"conical\"")),
    }
}

fn polarization(inputs: &Fields) -> Result<Polarization> {
    match inputs.required("pol")?.as_str() {
        Some("s") => Ok(Polarization::S),
        Some("p") => Ok(Polarization::P),
        Some("unpolarised") => Ok(Polarization::Unpolarised),
        _ => Err(inputs.refuse("pol", "\"s\", \"p\" or \"unpolarised\"")),
    }
}

fn accuracy(inputs: &Fields) -> Result<Accuracy> {
    match (inputs.has("N"), inputs.has("tolerance")) {
        (true, false) => {
            let orders = inputs
                .required("N")?
                .as_u64()
                .and_then(|n| usize::try_from(n).ok())
                .filter(|&n| n <= MOST_ORDERS);
            orders.map(Accuracy::Orders).ok_or_else(|| {
                inputs.refuse("N", format!("a whole number from 0 to {MOST_ORDERS}"))
            })
        }
        (false, true) => {
            let tolerance = inputs.number("tolerance")?;
            if (MIN_TOLERANCE..=MAX_TOLERANCE).contains(&tolerance) {
                Ok(Accuracy::Tolerance(tolerance))
            } else {
                let range = format!("a number from {MIN_TOLERANCE:e} to {MAX_TOLERANCE}");
                Err(inputs.refuse("tolerance", range))
            }
        }
        (true, true) => Err(wrong("N", "either N or tolerance", "both")),
        (false, false) => Err(wrong("N", "either N or tolerance", "neither")),
    }
}

fn structure(inputs: &Fields, period: f64) -> Result<Structure> {
    let key = "layers_top_to_bottom";
    match (inputs.has(key), inputs.has("relief")) {
        (true, false) => {
            let mut layers: Vec<Layer> =
                inputs.list(key)?.iter().map(layer).collect::<Result<_>>()?;
            layers.retain(|layer| layer.thickness > 0.0);
            Ok(Structure::Layers(layers))
        }
        (false, true) => relief(&inputs.object("relief")?, period).map(Structure::Relief),
        (true, true) => Err(wrong(key, "either layers_top_to_bottom or relief", "both")),
        (false, false) => Err(wrong(key, "either layers_top_to_bottom or relief", "neither")),
    }
}

fn layer(layer: &Fields) -> Result<Layer> {
    layer.only(&["thickness", "segments"])?;
    let segments = layer.list("segments")?.iter().map(segment).collect::<Result<_>>()?;
    let thickness = layer.thickness("thickness")?;
    Layer::new(thickness, segments).with_context(|| layer.path("segments"))
}

fn segment(segment: &Fields) -> Result<Segment> {
    segment.only(&["x0", "x1", "n"])?;
    Ok(Segment { x0: segment.number("x0")?, x1: segment.number("x1")?, index: segment.index("n")? })
}

fn relief(relief: &Fields, period: f64) -> Result<Relief> {
    relief.only(&["depth", "background", "polygons"])?;
    let polygons = relief.list("polygons")?.iter().map(polygon).collect::<Result<_>>()?;
    let (depth, background) = (relief.length("depth")?, relief.index("background")?);
    Relief::new(period, depth, background, polygons).with_context(|| relief.path("polygons"))
}

fn polygon(polygon: &Fields) -> Result<Polygon> {
    polygon.only(&["n", "points"])?;
    Ok(Polygon { index: polygon.index("n")?, points: polygon.pairs("points")? })
}
