// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scattering of media: as stated, and at a wavelength.

use std::f64::consts::PI;

use metrics::digits::shortest;
use serde::Serialize;
use tracer::{Mie, PhaseFunction, Scattering, Sphere};

use crate::check::Context;
use crate::error::ConfigError;
use crate::schema::ByWavelength;
use runtime::serde_arrays::List;

/// Scattering of a medium at a wavelength.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MediumScattering {
    /// Scattering coefficient, 1/mm.
    pub per_mm: f64,
    /// Phase function.
    pub phase: Phase,
    /// Both, ready to be sampled.
    #[serde(skip)]
    pub optics: Scattering,
}

/// A phase function by what it follows from.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Henyey-Greenstein's of this mean cosine.
    G(f64),
    /// Rows of angle in degrees and value.
    Table(Vec<[f64; 2]>),
    /// Mie's of spheres.
    Spheres {
        /// Diameter, µm.
        diameter_um: f64,
        /// Their refractive index over that of the medium.
        relative_index: f64,
        /// Wavelength in the medium, nm.
        wavelength_nm: f64,
        /// Share of the volume that they fill.
        volume_fraction: f64,
    },
}

/// A number over the wavelength with the key that states it.
#[derive(Debug, Clone)]
pub(crate) struct Spectral {
    pub(crate) key: String,
    pub(crate) value: ByWavelength,
}

impl Spectral {
    /// A value that is `low` to `high` at all wavelengths.
    pub(crate) fn new(
        key: String,
        value: &ByWavelength,
        [low, high]: [f64; 2],
        at: &Context,
    ) -> Result<Self, ConfigError> {
        match value {
            ByWavelength::Constant(value) => {
                at.within(&key, *value, low, high)?;
            }
            ByWavelength::Rows(rows) => {
                let mut before = 0.0;
                for [nm, value] in rows.iter().map(|row| row.0) {
                    if !(nm > before && nm.is_finite()) {
                        let expected = "wavelengths in nm, above 0 and ascending";
                        return Err(at.value(&key, format!("[{nm}, {value}]"), expected));
                    }
                    at.within(&key, value, low, high)?;
                    before = nm;
                }
                if rows.is_empty() {
                    let expected = "a number or rows [wavelength in nm, value]";
                    return Err(at.value(&key, "[]", expected));
                }
            }
        }
        Ok(Self { key, value: value.clone() })
    }

    /// The value at a wavelength.
    pub(crate) fn at(&self, wavelength_nm: f64, at: &Context) -> Result<f64, ConfigError> {
        self.found(wavelength_nm).ok_or_else(|| {
            let rows = match &self.value {
                ByWavelength::Constant(_) => &[][..],
                ByWavelength::Rows(rows) => rows,
            };
            let end = |row: Option<&List<f64, 2>>| row.map_or(f64::NAN, |row| row.0[0]);
            let got = format!("rows from {} to {} nm", end(rows.first()), end(rows.last()));
            let expected = format!("a value at {wavelength_nm} nm, of the design's light");
            at.value(&self.key, got, &expected)
        })
    }

    /// The value at a wavelength; `None` beyond the ends of rows.
    pub(crate) fn found(&self, wavelength_nm: f64) -> Option<f64> {
        let rows = match &self.value {
            ByWavelength::Constant(value) => return Some(*value),
            ByWavelength::Rows(rows) => rows,
        };
        let beyond = rows.partition_point(|row| row.0[0] < wavelength_nm);
        let [b, to] = rows.get(beyond)?.0;
        if b <= wavelength_nm {
            return Some(to);
        }
        let [a, from] = rows[beyond.checked_sub(1)?].0;
        Some(from + (wavelength_nm - a) / (b - a) * (to - from))
    }
}

/// Scattering as stated.
#[derive(Debug)]
pub(crate) enum StatedScattering {
    /// By coefficient and phase function.
    Coefficient { per_mm: Spectral, phase: StatedPhase },
    /// By spheres, of the table of this key.
    Spheres { key: String, diameter_um: f64, index: Spectral, volume_fraction: f64 },
}

/// Phase function as stated.
#[derive(Debug)]
pub(crate) enum StatedPhase {
    G(Spectral),
    Table(Vec<[f64; 2]>, PhaseFunction),
}

impl StatedScattering {
    /// In a medium of this index at a wavelength.
    pub(crate) fn at(
        &self,
        wavelength_nm: f64,
        index: f64,
        at: &Context,
    ) -> Result<MediumScattering, ConfigError> {
        match self {
            Self::Coefficient { per_mm, phase } => {
                let per_mm = per_mm.at(wavelength_nm, at)?;
                let (phase, function) = match phase {
                    StatedPhase::G(g) => {
                        let g = g.at(wavelength_nm, at)?;
                        (Phase::G(g), PhaseFunction::HenyeyGreenstein(g))
                    }
                    StatedPhase::Table(rows, function) => {
                        (Phase::Table(rows.clone()), function.clone())
                    }
                };
                let optics = Scattering { per_mm, phase: function };
                Ok(MediumScattering { per_mm, phase, optics })
            }
            Self::Spheres { key, diameter_um, index: spheres, volume_fraction } => {
                let sphere =
                    Sphere { diameter_um: *diameter_um, index: spheres.at(wavelength_nm, at)? };
                let optics =
                    Scattering::of_spheres(&sphere, *volume_fraction, index, wavelength_nm);
                let optics = optics.map_err(|_| {
                    // All else is checked.
                    let most = Mie::MAX_SIZE * wavelength_nm * 1e-3 / (index * PI);
                    let expected = format!(
                        "at most {} um: Mie's series is summed for diameters up to {} wavelengths \
                         in the medium over pi",
                        shortest((most * 10.0).floor() / 10.0),
                        Mie::MAX_SIZE
                    );
                    at.value(&format!("{key}.diameter_um"), diameter_um, &expected)
                })?;
                let phase = Phase::Spheres {
                    diameter_um: *diameter_um,
                    relative_index: sphere.index / index,
                    wavelength_nm: wavelength_nm / index,
                    volume_fraction: *volume_fraction,
                };
                Ok(MediumScattering { per_mm: optics.per_mm, phase, optics })
            }
        }
    }
}
