// SPDX-License-Identifier: MIT OR Apache-2.0
//! Media of domes and solids at a wavelength.

use std::sync::Arc;

use rcwa::material::Material;
use serde::Serialize;

use crate::check::Context;
use crate::error::ConfigError;
use crate::material;

/// The material of the dome, or of a solid, at the wavelength.
#[derive(Debug, Clone, Serialize)]
pub struct Medium {
    /// Refractive index, real part.
    pub index: f64,
    /// Absorption coefficient for power, 1/mm.
    pub absorption_per_mm: f64,
    /// From which both follow at other wavelengths.
    #[serde(skip)]
    pub(crate) stated: Arc<StatedMedium>,
}

/// Medium as stated, whatever the wavelength.
#[derive(Debug)]
pub(crate) struct StatedMedium {
    /// Key of its table.
    pub(crate) table: String,
    /// Index, unless a material is given.
    pub(crate) index: f64,
    /// Absorption beside that of the material, 1/mm.
    pub(crate) absorption_per_mm: f64,
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
    let absorption_per_mm =
        stated.absorption_per_mm + 4.0 * std::f64::consts::PI * extinction / (wavelength_nm * 1e-6);
    Ok(Medium { index, absorption_per_mm, stated: Arc::clone(stated) })
}
