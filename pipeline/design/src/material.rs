// SPDX-License-Identifier: MIT OR Apache-2.0
//! Material files: opens a file in refractiveindex.info's YAML form and evaluates it at a
//! wavelength.

use std::path::Path;

use anyhow::{Context, Result};
use rcwa::material::{Material, SLIGHT_GAIN};

use runtime::bounded_text::{MAX_KEYS, bounded_text};
use runtime::progress::warn_once;

/// The material in the file at `path`.
pub fn read(path: &Path) -> Result<Material> {
    let text = bounded_text(path, MAX_KEYS)
        .with_context(|| format!("`{}`: expected a material, cannot read it", path.display()))?;
    let material = Material::from_yaml(&text).with_context(|| path.display().to_string())?;
    for repair in material.repairs() {
        warn_once(&format!("{}: {repair}", path.display()));
    }
    let lowest = material.lowest_k();
    if lowest < 0.0 {
        let below = if lowest < -SLIGHT_GAIN {
            format!(" down to -{SLIGHT_GAIN}, and refused below that where it is used")
        } else {
            String::new()
        };
        let path = path.display();
        warn_once(&format!("{path}: k down to {lowest}, taken as 0 where it is below 0{below}"));
    }
    Ok(material)
}

/// Index and extinction (n, k) of a material at the vacuum wavelength `wavelength_nm`.
pub fn index(material: &Material, wavelength_nm: f64) -> Result<(f64, f64)> {
    // Divided, 700 nm are 0.7 µm to the last bit and lie within data that end there.
    let index = material.index_at(wavelength_nm / 1e3)?;
    Ok((index.n(), index.k()))
}
