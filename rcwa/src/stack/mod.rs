// SPDX-License-Identifier: MIT OR Apache-2.0
//! A stack of layers between two half-spaces, and the recursion of its fields from the bottom to
//! the top.
//!
//! At a plane z = const all fields below are linear in a parameter vector t of length 2N and in the
//! waves u from the bottom half-space (3.1):
//!
//! e = N t + V u,   h = D t - V' u,   outgoing at the bottom: T t + R u
//!
//! with e and h in the coordinates of [`crate::modes`]. Every layer takes two steps: `interface`
//! changes the coordinates (3.2), and `propagate` carries them through its thickness (3.3). New
//! parameters are chosen before evanescent waves have grown far, so that all matrices stay bounded
//! and any thickness is stable:
//!
//! - t = h in thin slices. N is then an impedance, and D the identity.
//! - t = e + h where that impedance is near a pole. For a passive structure Re eᴴh ≥ 0, so |e + h|²
//!   ≥ |e|² + |h|²: there is no pole.
//! - the downward amplitudes in a thick layer.
//!
//! One pass gives the amplitudes in both half-spaces for light from both.

pub(crate) mod arithmetic;
pub(crate) mod interface;
pub(crate) mod ky_batch;
pub(crate) mod propagate;
pub(crate) mod recursion;
pub(crate) mod state;
mod thick;
pub(crate) mod transfer;
pub(crate) mod transfer_cache;

use crate::error::Error;
use crate::orders::{Bloch, SymmetricBloch};
use crate::relief::{Layer, WallCorrection, check_index};
use crate::wave::Side;
use num_complex::Complex64;

/// A periodic structure between two half-spaces.
#[derive(Clone, Debug, PartialEq)]
pub struct Stack {
    wavelength: f64,
    period: f64,
    n_top: Complex64,
    n_bottom: Complex64,
    layers: Vec<Layer>,
    /// Corrections of each layer for its slanted walls.
    wall_corrections: Vec<Vec<WallCorrection>>,
}

impl Stack {
    /// Layers from top to bottom between half-spaces of index `n_top` and `n_bottom`; all lengths
    /// in one unit. Layers of zero thickness are dropped.
    ///
    /// # Errors
    /// Lengths that are not positive, indices of no passive medium, layers that do not cover the
    /// period.
    pub fn new(
        wavelength: f64,
        period: f64,
        n_top: Complex64,
        n_bottom: Complex64,
        layers: Vec<Layer>,
    ) -> Result<Self, Error> {
        for (what, got) in [("wavelength", wavelength), ("period", period)] {
            if !(got.is_finite() && got > 0.0) {
                return Err(Error::Length { what, got });
            }
        }
        check_index(|| "top half-space".into(), n_top)?;
        check_index(|| "bottom half-space".into(), n_bottom)?;
        let layers = layers
            .into_iter()
            .enumerate()
            .map(|(i, layer)| {
                Layer::new(layer.thickness, layer.segments)
                    .map_err(|e| Error::Segments { layer: i, problem: e.to_string() })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let layers: Vec<Layer> = layers.into_iter().filter(|l| l.thickness > 0.0).collect();
        Ok(Self {
            wavelength,
            period,
            n_top,
            n_bottom,
            wall_corrections: vec![Vec::new(); layers.len()],
            layers,
        })
    }

    /// [`Stack::new`] of layers each with its wall corrections, from its bottom to its top.
    pub(crate) fn with_wall_corrections(
        wavelength: f64,
        period: f64,
        n_top: Complex64,
        n_bottom: Complex64,
        layers: Vec<(Layer, Vec<WallCorrection>)>,
    ) -> Result<Self, Error> {
        let thick = layers.into_iter().filter(|l| l.0.thickness > 0.0);
        let (layers, wall_corrections) = thick.unzip();
        let stack = Self::new(wavelength, period, n_top, n_bottom, layers)?;
        Ok(Self { wall_corrections, ..stack })
    }

    /// Wall corrections of each layer, from top to bottom.
    pub(crate) fn wall_corrections(&self) -> &[Vec<WallCorrection>] {
        &self.wall_corrections
    }

    /// Layers with their wall corrections, from bottom to top.
    pub(crate) fn bottom_up(&self) -> impl Iterator<Item = (&Layer, &[WallCorrection])> {
        let corrections = self.wall_corrections.iter().map(Vec::as_slice);
        self.layers.iter().zip(corrections).rev()
    }

    /// Vacuum wavelength.
    pub fn wavelength(&self) -> f64 {
        self.wavelength
    }

    /// Period, in the same unit.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Layers from top to bottom.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Refractive index of a half-space.
    pub fn index(&self, side: Side) -> Complex64 {
        match side {
            Side::Top => self.n_top,
            Side::Bottom => self.n_bottom,
        }
    }

    /// True where no half-space and no layer absorbs.
    pub fn is_lossless(&self) -> bool {
        self.n_top.im == 0.0
            && self.n_bottom.im == 0.0
            && self.layers.iter().all(Layer::is_lossless)
    }

    /// Period over wavelength: orders lie 1 over this apart in kx.
    pub fn period_per_wavelength(&self) -> f64 {
        self.period / self.wavelength
    }

    /// Thickness of a layer times k0.
    pub(crate) fn optical_thickness(&self, layer: &Layer) -> f64 {
        self.in_waves(layer.thickness)
    }

    /// A length, in the unit of the period, times k0.
    pub(crate) fn in_waves(&self, length: f64) -> f64 {
        std::f64::consts::TAU * length / self.wavelength
    }
}

impl Bloch {
    /// Order 0 is the plane wave from `side` at polar angle `theta` and azimuth `phi`, in radians.
    pub fn from_angles(stack: &Stack, side: Side, theta: f64, phi: f64) -> Self {
        let n = stack.index(side).re;
        let tangential = n * theta.sin();
        Self { kx0: tangential * phi.cos(), ky: tangential * phi.sin(), azimuth_at_normal: phi }
    }
}

impl SymmetricBloch {
    /// kx0 in units of k0.
    pub fn kx0(self, stack: &Stack) -> f64 {
        match self {
            Self::Centre => 0.0,
            Self::Edge => 0.5 / stack.period_per_wavelength(),
        }
    }
}
