// SPDX-License-Identifier: MIT OR Apache-2.0
//! `package.json` of a model: the design in words, the package as lines, a few paths.

use std::path::PathBuf;

use anyhow::{Context, Result};

use design::Design;
use results::ModelResult;
use results::package::{FILE, PackageFile};
use results::ray_paths::TracedPath;
use runtime::atomic_file::write_bytes;
use runtime::run_context::RunContext;

use super::description::description;
use super::model_writer::Output;
use super::package_drawing::package_drawing;
use super::paths::paths;
use super::paths_3d::{WavelengthScene, paths_3d};

/// Paths in the plane of the section.
const IN_SECTION: u64 = 120;

/// The package of `design`, with a few paths of `parts`, each a wavelength with its dome and its
/// share of the flux.
///
/// # Errors
/// Scenes that cannot be built.
pub(super) fn package(
    design: &Design,
    parts: &[WavelengthScene],
    is_spectral: bool,
    surfaces_per_path: f64,
    seed: u64,
) -> Result<PackageFile> {
    let first = parts.first().context("expected light to trace")?;
    let drawing = package_drawing(design, first.surface.meridian());
    let words = description(design).into_iter();
    let mut simulated: Vec<(String, String)> =
        words.map(|(name, words)| (name.to_owned(), words)).collect();
    if !is_spectral {
        simulated.push(("wavelength".to_owned(), format!("{} nm", design.wavelength_nm)));
    }
    Ok(PackageFile {
        simulated,
        section_paths: section_paths(parts, seed)?,
        paths_3d: paths_3d(parts, &drawing.rings, surfaces_per_path, seed)?,
        drawing,
    })
}

/// Writes the file into the folder of the model and lists it in `result`. A package that cannot be
/// drawn costs a warning, not the trace.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn write(
    package: Result<PackageFile>,
    output: Output,
    result: &mut ModelResult,
    context: RunContext,
) -> Result<()> {
    let Output { design, out, .. } = output;
    let package = match package {
        Ok(package) => package,
        Err(error) => {
            let (file, label) = (&design.provenance.file, &result.label);
            context.console.warn(&format!("{file}, {label}: the package is not drawn: {error:#}"));
            return Ok(());
        }
    };
    let inner: PathBuf = [design.name.as_str(), &result.key, FILE].iter().collect();
    let text = serde_json::to_string(&package)? + "\n";
    write_bytes(&out.join(&inner), text.as_bytes())?;
    result.files.push(inner);
    Ok(())
}

/// Paths in the plane y = 0, shared among the parts by their flux.
fn section_paths(parts: &[WavelengthScene], seed: u64) -> Result<Vec<TracedPath>> {
    let mut all = Vec::new();
    let mut begun = 0.0;
    for (place, part) in parts.iter().enumerate() {
        let first = (begun * IN_SECTION as f64).round() as u64;
        begun += part.share;
        let count = (begun * IN_SECTION as f64).round() as u64 - first;
        if count > 0 {
            let seed = seed.wrapping_add(place as u64);
            all.extend(paths(part.design, part.surface, count, seed)?);
        }
    }
    Ok(all)
}
