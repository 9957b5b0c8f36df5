// SPDX-License-Identifier: MIT OR Apache-2.0
//! Luminescent substances of media: as stated, and at a wavelength.

use std::sync::{Mutex, PoisonError};

use serde::Serialize;

use super::scattering::Spectral;
use crate::schema::ByWavelength;
use crate::spectrum::Spectrum;
use metrics::kinds::Weighting;

/// A substance as stated, whatever the wavelength.
#[derive(Debug)]
pub(crate) struct StatedLuminophore {
    pub(crate) name: String,
    pub(crate) absorption_per_mm: Spectral,
    pub(crate) quantum_yield: Spectral,
    pub(crate) emission: Spectrum,
    pub(crate) stokes_only: bool,
    /// The wavelengths last asked for, and the shares of the emission there: those of a trace are
    /// asked for once for each of them.
    pub(crate) emitted: Mutex<(Vec<f64>, Vec<f64>)>,
}

/// A substance at a wavelength.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MediumLuminophore {
    /// Name in the ledger.
    pub name: String,
    /// Absorption coefficient, 1/mm.
    pub absorption_per_mm: f64,
    /// Photons emitted for each that is absorbed.
    pub quantum_yield: f64,
    /// Photons emitted at the wavelengths of a trace, in any unit; a single number where there is
    /// one.
    #[serde(skip)]
    pub photons: Vec<f64>,
}

impl StatedLuminophore {
    /// Its table in the design file: `silicone.luminophores[1]`.
    pub(crate) fn table(&self) -> &str {
        let key = &self.absorption_per_mm.key;
        key.rsplit_once('.').map_or(key, |(table, _)| table)
    }

    /// Absorption coefficient at a wavelength, 1/mm; 0 beyond the ends of rows.
    pub(crate) fn absorption_at(&self, wavelength_nm: f64) -> f64 {
        self.absorption_per_mm.found(wavelength_nm).unwrap_or(0.0)
    }

    /// The substance at a wavelength, alone.
    pub(crate) fn at(&self, wavelength_nm: f64) -> MediumLuminophore {
        MediumLuminophore {
            name: self.name.clone(),
            absorption_per_mm: self.absorption_at(wavelength_nm),
            quantum_yield: self.quantum_yield.nearest(wavelength_nm),
            photons: vec![1.0],
        }
    }

    /// Photons emitted at `nodes` after absorption at one of them.
    pub(crate) fn photons(&self, nodes: &[f64], absorbed: usize) -> Vec<f64> {
        let mut emitted = self.emitted.lock().unwrap_or_else(PoisonError::into_inner);
        if emitted.0 != nodes {
            *emitted = (nodes.to_vec(), self.emission.weights(nodes, Weighting::Radiometric));
        }
        let first = if self.stokes_only { absorbed } else { 0 };
        let photons = emitted.1.iter().zip(nodes).enumerate();
        photons.map(|(k, (power, nm))| if k < first { 0.0 } else { power * nm }).collect()
    }
}

impl MediumLuminophore {
    /// The substance as the tracer takes it.
    pub(crate) fn to_tracer(&self) -> tracer::Luminophore {
        // Nothing is emitted where no wavelength is left for it.
        let is_dark = self.photons.iter().all(|photons| *photons <= 0.0);
        let (quantum_yield, photons) = if is_dark {
            (0.0, vec![1.0; self.photons.len()])
        } else {
            (self.quantum_yield, self.photons.clone())
        };
        tracer::Luminophore::new(&self.name, self.absorption_per_mm, quantum_yield, &photons)
            .expect("a checked design")
    }
}

impl Spectral {
    /// The value at a wavelength, of rows the nearest beyond their ends.
    fn nearest(&self, wavelength_nm: f64) -> f64 {
        self.found(wavelength_nm).unwrap_or_else(|| match &self.value {
            ByWavelength::Constant(value) => *value,
            ByWavelength::Rows(rows) => {
                let is_before = wavelength_nm < rows[0].0[0];
                rows[if is_before { 0 } else { rows.len() - 1 }].0[1]
            }
        })
    }
}
