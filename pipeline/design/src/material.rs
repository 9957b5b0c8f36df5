// SPDX-License-Identifier: MIT OR Apache-2.0
//! Material files: opens a file in refractiveindex.info's YAML form and evaluates it at a
//! wavelength.

use std::path::Path;

use anyhow::{Context, Result};
use rcwa::material::Material;

use files::progress::warn_once;

/// The material in the file at `path`.
pub fn read(path: &Path) -> Result<Material> {
    let text = crate::read_text(path)
        .with_context(|| format!("`{}`: expected a material, cannot read it", path.display()))?;
    let material = Material::from_yaml(&text).with_context(|| path.display().to_string())?;
    if material.lowest_k() < 0.0 {
        let (path, lowest) = (path.display(), material.lowest_k());
        warn_once(&format!("{path}: k down to {lowest}, taken as 0 where it is below 0"));
    }
    Ok(material)
}

/// Index and extinction (n, k) of a material at the vacuum wavelength `wavelength_nm`.
pub fn index(material: &Material, wavelength_nm: f64) -> Result<(f64, f64)> {
    // Divided, 700 nm are 0.7 µm to the last bit and lie within data that end there.
    let index = material.index_at(wavelength_nm / 1e3)?;
    Ok((index.n(), index.k()))
}
