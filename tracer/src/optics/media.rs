// SPDX-License-Identifier: MIT OR Apache-2.0
//! Media: refractive index, absorption, and scattering, whose density may differ over the place.

use std::sync::Arc;

use super::luminescence::Luminophore;
use super::phase::Scattering;
use crate::error::{Error, check};
use crate::pattern::Pattern;

/// A medium at one wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    /// Name under which the ledger lists the power absorbed in it.
    pub name: String,
    /// Real refractive index, above 0.
    pub index: f64,
    /// Absorption coefficient in 1/mm, 0 or more; power falls as exp(-a·length).
    pub absorption_per_mm: f64,
    /// Scattering on the way, if any; of a body, not of the world.
    pub scattering: Option<Scattering>,
    /// Substances that convert light, all for the same wavelengths; of a body, not of the world.
    pub luminophores: Vec<Luminophore>,
    /// Density of all that scatters and converts, as a share of what is stated, over x and y in the
    /// frame of the body; `None` where it is the same everywhere.
    pub density: Option<Arc<Pattern>>,
}

impl Medium {
    /// A medium that absorbs nothing.
    pub fn clear(name: impl Into<String>, index: f64) -> Self {
        Self {
            name: name.into(),
            index,
            absorption_per_mm: 0.0,
            scattering: None,
            luminophores: Vec::new(),
            density: None,
        }
    }

    /// Air with index 1.
    pub fn air() -> Self {
        Self::clear("air", 1.0)
    }

    /// The same medium, absorbing.
    #[must_use]
    pub fn absorbing(mut self, absorption_per_mm: f64) -> Self {
        self.absorption_per_mm = absorption_per_mm;
        self
    }

    /// The same medium, scattering; a coefficient of 0 is none.
    #[must_use]
    pub fn scattering(mut self, scattering: Option<Scattering>) -> Self {
        self.scattering = scattering.filter(|scattering| scattering.per_mm != 0.0);
        self
    }

    /// The same medium with these luminescent substances.
    #[must_use]
    pub fn luminescent(mut self, luminophores: Vec<Luminophore>) -> Self {
        self.luminophores = luminophores;
        self
    }

    /// The same medium with its particles in the places of a pattern.
    #[must_use]
    pub fn with_density(mut self, density: Option<Arc<Pattern>>) -> Self {
        self.density = density;
        self
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        check(
            &format!("refractive index of '{}'", self.name),
            self.index,
            "a finite number above 0",
            self.index > 0.0,
        )?;
        check(
            &format!("absorption of '{}' per mm", self.name),
            self.absorption_per_mm,
            "a finite number, 0 or more",
            self.absorption_per_mm >= 0.0,
        )?;
        self.scattering.as_ref().map_or(Ok(()), |scattering| scattering.validate(&self.name))
    }
}
