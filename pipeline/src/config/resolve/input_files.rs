// SPDX-License-Identifier: MIT OR Apache-2.0
//! Records of the files that a design names: mesh, curve, materials, positions, spectra, sources and solids.
//!
//! Files of other programs under `[files]` keep records of their own.

use std::path::Path;

use anyhow::{Context, Result};

use super::solids;
use crate::config::schema;
use crate::config::schema::films::Layer;
use crate::provenance::FileRecord;

/// Each file that `raw` names, once, in the order of the design file.
///
/// # Errors
/// A file that cannot be read.
pub fn inputs(raw: &schema::Design, folder: &Path) -> Result<Vec<FileRecord>> {
    let layers = |layers: &[Layer]| -> Vec<Option<String>> {
        layers.iter().map(|l| l.material_file.clone()).collect()
    };
    let dome = raw.dome.as_ref();
    let substrate = raw.mirror.substrate.as_ref();
    let spectra = raw
        .sources
        .iter()
        .map(|s| s.spectrum.as_ref()?.file.clone());
    let named = [
        vec![dome.and_then(|d| d.mesh.clone())],
        vec![dome.and_then(|d| d.meridian_file.clone())],
        dome.map_or_else(Vec::new, |d| layers(&d.coating)),
        vec![raw.silicone.as_ref().and_then(|s| s.material_file.clone())],
        vec![substrate.and_then(|s| s.material_file.clone())],
        layers(&raw.mirror.coating),
        vec![raw.array.positions_file.clone()],
        vec![raw.light.spectrum.as_ref().and_then(|s| s.file.clone())],
        raw.sources.iter().map(|s| s.file.clone()).collect(),
        spectra.collect(),
        solids::named_files(&raw.solids),
    ];
    let mut inputs: Vec<FileRecord> = Vec::new();
    for name in named.into_iter().flatten().flatten() {
        let path = folder.join(name);
        let file = path.display().to_string();
        if inputs.iter().any(|known| known.file == file) {
            continue;
        }
        let bytes = std::fs::read(&path).with_context(|| format!("cannot read `{file}`"))?;
        inputs.push(FileRecord::new(file, &bytes));
    }
    Ok(inputs)
}
