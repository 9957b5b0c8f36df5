// SPDX-License-Identifier: MIT OR Apache-2.0
//! Material files: opens a file in refractiveindex.info's YAML form and evaluates it at a wavelength.

use std::path::Path;

use anyhow::{Context, Result};
use rcwa::material::Material;

/// Index and extinction (n, k) of the material in the file at `path` at the vacuum wavelength `wavelength_nm`.
pub fn index(path: &Path, wavelength_nm: f64) -> Result<(f64, f64)> {
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("cannot read `{}`", path.display()))?;
    let material = Material::from_yaml(&text).with_context(|| path.display().to_string())?;
    let index = material
        .index_at(wavelength_nm * 1e-3)
        .with_context(|| path.display().to_string())?;
    Ok((index.n(), index.k()))
}
