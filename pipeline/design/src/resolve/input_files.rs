// SPDX-License-Identifier: MIT OR Apache-2.0
//! Records of the files that a design names: mesh, curve, materials, positions, spectra, sources
//! and solids.
//!
//! Files of other programs under `[files]` keep records of their own.

use std::path::Path;

use anyhow::{Context, Result};

use files::provenance::FileRecord;

use crate::schema::film_stack::Film;
use crate::schema::films::Layer;
use crate::schema::reflectors::{Law, Metal};
use crate::schema::solids::{ScatterLaw, Solid, SolidForm, SolidScatter, SurfaceLaw};
use crate::schema::{self, DomeForm, Silicone, Spectrum, SpectrumForm};

/// Each file that `raw` names, once, in the order of the design file.
///
/// # Errors
/// A file that cannot be read.
pub fn inputs(raw: &schema::Design, folder: &Path) -> Result<Vec<FileRecord>> {
    let dome = raw.dome.as_ref();
    let form = match dome.map(|dome| &dome.kind) {
        Some(DomeForm::Mesh(dome)) => Some(dome.mesh.clone()),
        Some(DomeForm::MeridianFile(dome)) => Some(dome.meridian_file.clone()),
        _ => None,
    };
    let metal = match &raw.mirror.kind {
        Law::Specular(metal) => of_metal(metal),
        _ => Vec::new(),
    };
    let sources = || raw.sources.iter();
    let spectra = sources().map(|s| s.shared.spectrum.as_ref().and_then(of_spectrum));
    let named = [
        vec![form],
        dome.map_or_else(Vec::new, |d| of_layers(&d.shared.coating)),
        raw.silicone.as_ref().map_or_else(Vec::new, of_medium),
        metal,
        vec![raw.array.positions_file.clone()],
        vec![raw.light.spectrum.as_ref().and_then(of_spectrum)],
        sources().map(|s| s.kind.file().map(str::to_owned)).collect(),
        spectra.collect(),
        of_solids(&raw.solids),
        of_films(&raw.films),
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

/// Names of the files that solids name, in the order of the tables.
fn of_solids(raw: &[Solid]) -> Vec<Option<String>> {
    let mut names = Vec::new();
    for solid in raw {
        names.push(match &solid.kind {
            SolidForm::Meridian(meridian) => meridian.meridian_file.clone(),
            SolidForm::Mesh(mesh) => Some(mesh.mesh.clone()),
            _ => None,
        });
        let keys = &solid.shared;
        names.extend(keys.medium.iter().flat_map(of_medium));
        names.extend(of_layers(&keys.coating));
        names.extend(of_scattering(keys.scatter.as_ref()));
        match keys.surface.as_ref().map(|surface| &surface.kind) {
            Some(SurfaceLaw::File(reflector)) => names.push(Some(reflector.file.clone())),
            Some(SurfaceLaw::Specular(metal)) => names.extend(of_metal(metal)),
            _ => {}
        }
    }
    names
}

/// Names of the files that films name, likewise.
fn of_films(raw: &[Film]) -> Vec<Option<String>> {
    let of_one = |film: &Film| {
        [
            of_medium(&film.medium),
            of_scattering(film.top.as_ref()),
            of_scattering(film.bottom.as_ref()),
        ]
        .concat()
    };
    raw.iter().flat_map(of_one).collect()
}

/// Names of the files that a medium names.
fn of_medium(raw: &Silicone) -> Vec<Option<String>> {
    let emissions = raw.luminophores.iter().map(|of| of.emission.file.clone());
    std::iter::once(raw.material_file.clone()).chain(emissions).collect()
}

fn of_scattering(scatter: Option<&SolidScatter>) -> Vec<Option<String>> {
    let Some(ScatterLaw::File(files)) = scatter.map(|scatter| &scatter.kind) else {
        return Vec::new();
    };
    let sides = files.inner.iter().chain(&files.outer).cloned();
    [files.file.clone()].into_iter().chain(sides.map(Some)).collect()
}

/// Names of the files that the metal of a reflector and the layers on it name.
fn of_metal(metal: &Metal) -> Vec<Option<String>> {
    let substrate = metal.substrate.as_ref();
    let substrate = substrate.and_then(|s| s.material_file.clone());
    [vec![substrate], of_layers(&metal.coating)].concat()
}

fn of_layers(layers: &[Layer]) -> Vec<Option<String>> {
    layers.iter().map(|l| l.material_file.clone()).collect()
}

fn of_spectrum(spectrum: &Spectrum) -> Option<String> {
    match &spectrum.kind {
        SpectrumForm::WhiteLed(_) => None,
        SpectrumForm::Table(rows) | SpectrumForm::Lines(rows) => rows.file.clone(),
    }
}
