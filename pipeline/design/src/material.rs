// SPDX-License-Identifier: MIT OR Apache-2.0
//! Material files: opens a file of refractiveindex.info or a glass catalogue and evaluates it at a
//! wavelength.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use rcwa::material::{Material, SLIGHT_GAIN};

use runtime::bounded_text::{MAX_KEYS, bounded_bytes};
use runtime::progress::warn_once;

/// The material in the file at `path`, of a catalogue the `glass`.
pub fn read(path: &Path, glass: Option<&str>) -> Result<Material> {
    let text = bounded_bytes(path, MAX_KEYS)
        .and_then(text)
        .with_context(|| format!("`{}`: expected a material, cannot read it", path.display()))?;
    let material = Material::from_text(&text, glass).with_context(|| path.display().to_string())?;
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

/// Text in UTF-8, or in UTF-16 with its mark, as OpticStudio writes catalogues.
fn text(bytes: Vec<u8>) -> Result<String> {
    let utf16 = |unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].as_chunks().0.iter().map(|two| unit(*two)).collect();
        String::from_utf16(&units).map_err(|_| anyhow!("expected text in UTF-16"))
    };
    match bytes[..] {
        [0xff, 0xfe, ..] => utf16(u16::from_le_bytes),
        [0xfe, 0xff, ..] => utf16(u16::from_be_bytes),
        _ => String::from_utf8(bytes)
            .map_err(|error| anyhow!("expected text in UTF-8, got {}", error.utf8_error())),
    }
}

/// Index and extinction (n, k) of a material at the vacuum wavelength `wavelength_nm`.
pub fn index(material: &Material, wavelength_nm: f64) -> Result<(f64, f64)> {
    // Divided, 700 nm are 0.7 µm to the last bit and lie within data that end there.
    let index = material.index_at(wavelength_nm / 1e3)?;
    Ok((index.n(), index.k()))
}
