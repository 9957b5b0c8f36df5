// SPDX-License-Identifier: MIT OR Apache-2.0
//! Homogeneous media: refractive index and absorption coefficient.

use crate::error::{Error, check};

/// A homogeneous medium at one wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    /// Name under which the ledger lists the power absorbed in it.
    pub name: String,
    /// Real refractive index, above 0.
    pub index: f64,
    /// Absorption coefficient in 1/mm, 0 or more; power falls as exp(-a·length).
    pub absorption_per_mm: f64,
}

impl Medium {
    /// A medium that absorbs nothing.
    pub fn clear(name: impl Into<String>, index: f64) -> Self {
        Self { name: name.into(), index, absorption_per_mm: 0.0 }
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
        Ok(())
    }
}
