// SPDX-License-Identifier: MIT OR Apache-2.0
//! Media of domes and solids at a wavelength.

use std::sync::Arc;

use rcwa::material::Material;
use serde::Serialize;

use super::luminescence::{MediumLuminophore, StatedLuminophore};
use super::scattering::{MediumScattering, Spectral, StatedScattering};
use crate::check::Context;
use crate::error::ConfigError;
use crate::material;
use crate::schema::Silicone;

/// The material of the dome, or of a solid, at the wavelength.
#[derive(Debug, Clone, Serialize)]
pub struct Medium {
    /// Refractive index, real part.
    pub index: f64,
    /// Absorption coefficient for power, 1/mm.
    pub absorption_per_mm: f64,
    /// Scattering on the way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scattering: Option<MediumScattering>,
    /// Substances that convert light.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub luminophores: Vec<MediumLuminophore>,
    /// From which all follow at other wavelengths.
    #[serde(skip)]
    pub(crate) stated: Arc<StatedMedium>,
}

impl Medium {
    /// The medium as the tracer takes it, under its name in the ledger.
    pub fn to_tracer(&self, name: &str) -> tracer::Medium {
        let scattering = self.scattering.as_ref().map(|of| of.optics.clone());
        tracer::Medium::clear(name, self.index)
            .absorbing(self.absorption_per_mm)
            .scattering(scattering)
            .luminescent(self.luminophores.iter().map(MediumLuminophore::to_tracer).collect())
    }

    /// Sets what its substances emit at `nodes`, after absorption at one of them.
    pub(super) fn luminesce(&mut self, nodes: &[f64], node: usize) {
        let stated = self.stated.luminophores.iter();
        for (luminophore, stated) in self.luminophores.iter_mut().zip(stated) {
            luminophore.photons = stated.photons(nodes, node);
        }
    }
}

/// Medium as stated, whatever the wavelength.
#[derive(Debug)]
pub(crate) struct StatedMedium {
    /// Key of its table.
    pub(crate) table: String,
    /// Index, unless a material is given.
    pub(crate) index: f64,
    /// Absorption beside that of the material, 1/mm.
    pub(crate) absorption_per_mm: Spectral,
    /// Scattering, if any.
    pub(crate) scattering: Option<StatedScattering>,
    /// Substances that convert light.
    pub(crate) luminophores: Vec<StatedLuminophore>,
    /// The table as written, if values over the wavelength stand in it or it scatters or converts
    /// light.
    pub(crate) spectral: Option<Silicone>,
    /// Index and absorption over the wavelength.
    pub(crate) material: Option<MaterialFile>,
}

/// A material and where it came from.
#[derive(Debug)]
pub(crate) struct MaterialFile {
    /// Name in the design.
    pub(crate) file: String,
    /// The file that was read.
    pub(crate) path: String,
    /// Content.
    pub(crate) material: Material,
}

/// A medium at a wavelength. The silicone is denser than the air around it, other media need not
/// be.
pub(crate) fn medium_at(
    stated: &Arc<StatedMedium>,
    wavelength_nm: f64,
    at: &Context,
) -> Result<Medium, ConfigError> {
    let (key, index, extinction) = match &stated.material {
        None => (format!("{}.index", stated.table), stated.index, 0.0),
        Some(d) => {
            let (n, k) = material::index(&d.material, wavelength_nm).map_err(|e| {
                let expected = format!("a readable material: {}: {e:#}", d.path);
                at.value(&format!("{}.material_file", stated.table), &d.file, &expected)
            })?;
            (format!("{}.material_file", stated.table), n, k)
        }
    };
    let (fits, expected) = if stated.table == "silicone" {
        let expected = "a refractive index above 1 (the air outside) and below 10";
        (index > 1.0 && index < 10.0, expected)
    } else {
        let expected = "a refractive index from 0.1, and below 10";
        ((0.1..10.0).contains(&index), expected)
    };
    if !fits {
        return Err(at.value(&key, index, expected));
    }
    // α = 4πk/λ for power.
    let beside = stated.absorption_per_mm.at(wavelength_nm, at)?;
    let absorption_per_mm =
        beside + 4.0 * std::f64::consts::PI * extinction / (wavelength_nm * 1e-6);
    let scattering = stated.scattering.as_ref();
    let scattering = scattering.map(|of| of.at(wavelength_nm, index, at)).transpose()?;
    let luminophores = stated.luminophores.iter().map(|of| of.at(wavelength_nm)).collect();
    Ok(Medium { index, absorption_per_mm, scattering, luminophores, stated: Arc::clone(stated) })
}
