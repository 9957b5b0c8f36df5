// SPDX-License-Identifier: MIT OR Apache-2.0
//! Polarising faces and filters of a checked design.

use bsdf::direction::Frame;
use bsdf::{AxisShares, Polariser};
use serde::Serialize;
use tracer::glam::DVec3;

use crate::check::Context;
use crate::error::ConfigError;

/// A share over the wavelength and the angle of incidence, with the key that states it.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct SharesByAngle {
    #[serde(skip)]
    pub(crate) key: String,
    /// Wavelengths in nm, ascending, each with rows (angle in degrees, share); 0 nm for all.
    pub(crate) curves: Vec<(f64, Vec<[f64; 2]>)>,
}

impl SharesByAngle {
    /// True if it depends on the wavelength.
    pub(crate) fn is_spectral(&self) -> bool {
        self.curves.iter().all(|(nm, _)| *nm > 0.0)
    }

    /// Rows (angle in degrees, share) at a wavelength.
    fn at(&self, wavelength_nm: f64, at: &Context) -> Result<Vec<[f64; 2]>, ConfigError> {
        let beyond = self.curves.partition_point(|(nm, _)| *nm < wavelength_nm);
        let ends = [self.curves.first(), self.curves.last()].map(|c| c.map_or(0.0, |(nm, _)| *nm));
        let (nm, upper) = match self.curves.get(beyond) {
            _ if !self.is_spectral() => return Ok(self.curves[0].1.clone()),
            Some((nm, rows)) if *nm <= wavelength_nm => return Ok(rows.clone()),
            Some((nm, rows)) if beyond > 0 => (nm, rows),
            _ => {
                let got = format!("rows from {} to {} nm", ends[0], ends[1]);
                let expected = format!("a value at {wavelength_nm} nm, of the design's light");
                return Err(at.value(&self.key, got, &expected));
            }
        };
        let (low, lower) = &self.curves[beyond - 1];
        let part = (wavelength_nm - low) / (nm - low);
        let mut angles: Vec<f64> = lower.iter().chain(upper).map(|row| row[0]).collect();
        angles.sort_by(f64::total_cmp);
        angles.dedup();
        let mixed = |angle: f64| {
            let [a, b] = [lower, upper].map(|rows| bsdf::analytic::linear(rows, angle));
            [angle, a + part * (b - a)]
        };
        Ok(angles.into_iter().map(mixed).collect())
    }
}

/// Transmittance and reflectance of an axis, or of unpolarised light.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct StatedShares {
    pub(crate) transmittance: SharesByAngle,
    pub(crate) reflectance: SharesByAngle,
}

impl StatedShares {
    /// True if they depend on the wavelength.
    fn is_spectral(&self) -> bool {
        self.transmittance.is_spectral() || self.reflectance.is_spectral()
    }

    /// Wavelengths between which the shares are linear.
    pub(crate) fn wavelengths_nm(&self) -> impl Iterator<Item = f64> {
        let both = [&self.transmittance, &self.reflectance].into_iter();
        both.filter(|shares| shares.is_spectral()).flat_map(|s| &s.curves).map(|(nm, _)| *nm)
    }

    /// Rows (angle in degrees, reflected share) at a wavelength at which all is stated.
    pub(crate) fn reflectance_at(
        &self,
        wavelength_nm: f64,
        at: &Context,
    ) -> Result<Vec<[f64; 2]>, ConfigError> {
        self.at(wavelength_nm, at)?;
        self.reflectance.at(wavelength_nm, at)
    }

    pub(crate) fn at(&self, wavelength_nm: f64, at: &Context) -> Result<AxisShares, ConfigError> {
        let transmittance = self.transmittance.at(wavelength_nm, at)?;
        let reflectance = self.reflectance.at(wavelength_nm, at)?;
        AxisShares::new(&transmittance, &reflectance).map_err(|error| {
            let got = format!("beside {}", self.transmittance.key);
            at.value(&self.reflectance.key, got, &error.to_string())
        })
    }
}

/// A polarising face or a filter.
#[derive(Debug, Clone)]
pub(crate) enum PolarisingFace {
    /// Of two axes, pass and block, the first in this direction from the x axis.
    Axes {
        /// Shares of both.
        shares: Box<[StatedShares; 2]>,
        /// Direction of the pass axis.
        axis_deg: f64,
    },
    /// A filter, of unpolarised light.
    Unpolarised(StatedShares),
}

impl PolarisingFace {
    /// Shares as stated: of both axes, or of unpolarised light.
    pub(crate) fn stated(&self) -> &[StatedShares] {
        match self {
            Self::Axes { shares, .. } => &shares[..],
            Self::Unpolarised(shares) => std::slice::from_ref(shares),
        }
    }

    /// True if it depends on the wavelength.
    pub(crate) fn is_spectral(&self) -> bool {
        self.stated().iter().any(StatedShares::is_spectral)
    }

    /// Refuses a wavelength at which it is not stated.
    pub(crate) fn check(&self, wavelength_nm: f64, at: &Context) -> Result<(), ConfigError> {
        self.stated().iter().try_for_each(|shares| shares.at(wavelength_nm, at).map(|_| ()))
    }

    /// The face in the frame of its surface between media of these indices, inner and outer.
    pub(crate) fn optics(
        &self,
        frame: &Frame,
        wavelength_nm: f64,
        indices: [f64; 2],
        at: &Context,
    ) -> anyhow::Result<Polariser> {
        Ok(match self {
            Self::Axes { shares, axis_deg } => {
                let (sin, cos) = axis_deg.to_radians().sin_cos();
                let axis = DVec3::new(cos, sin, 0.0);
                let turn = axis.dot(frame.b).atan2(axis.dot(frame.t));
                let [pass, block] = &**shares;
                let axes = [pass.at(wavelength_nm, at)?, block.at(wavelength_nm, at)?];
                Polariser::new(axes, turn, indices)?
            }
            Self::Unpolarised(shares) => {
                Polariser::of_unpolarised(&shares.at(wavelength_nm, at)?, indices)?
            }
        })
    }
}
