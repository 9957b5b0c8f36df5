// SPDX-License-Identifier: MIT OR Apache-2.0
//! Records of the files that a design names: mesh, curve, materials, positions, spectra, sources
//! and solids.
//!
//! Files of other programs under `[files]` keep records of their own.

use std::path::Path;

use anyhow::{Context, Result};

use runtime::content_hash::sha256_of_file;
use runtime::provenance::FileRecord;

use crate::schema::films::Layer;
use crate::schema::reflectors::{Law, Metal};
use crate::schema::solids::{ScatterLaw, Solid, SolidForm, SolidScatter, SurfaceLaw};
use crate::schema::{self, DomeForm, Silicone, Spectrum, SpectrumForm};

/// Each file that `raw` names, once, in the order of the design file, and those of its panel.
///
/// # Errors
/// A file that cannot be read.
pub fn inputs(raw: &schema::Design, folder: &Path) -> Result<[Vec<FileRecord>; 2]> {
    let sub_pixels = raw.panel.iter().flat_map(|panel| &panel.sub_pixels);
    let of_panel = sub_pixels.filter_map(|sub_pixel| sub_pixel.file.as_ref()).collect();
    Ok([records(InputNames::of_design(raw).0, folder)?, records(of_panel, folder)?])
}

fn records(names: Vec<&String>, folder: &Path) -> Result<Vec<FileRecord>> {
    let mut inputs: Vec<FileRecord> = Vec::new();
    for name in names {
        let path = folder.join(name);
        let file = path.display().to_string();
        if inputs.iter().any(|known| known.file == file) {
            continue;
        }
        let sha256 = sha256_of_file(&path).with_context(|| format!("cannot read `{file}`"))?;
        inputs.push(FileRecord { file, sha256 });
    }
    Ok(inputs)
}

/// Names of files, in the order of the tables.
#[derive(Default)]
struct InputNames<'a>(Vec<&'a String>);

impl<'a> InputNames<'a> {
    fn of_design(raw: &'a schema::Design) -> Self {
        let mut names = Self::default();
        if let Some(dome) = &raw.dome {
            match &dome.kind {
                DomeForm::Mesh(dome) => names.0.push(&dome.mesh),
                DomeForm::MeridianFile(dome) => {
                    names.0.push(&dome.meridian_file);
                    names.0.extend(&dome.meridian_y_file);
                }
                DomeForm::Sphere(_) | DomeForm::Meridian(_) => {}
            }
            names.layers(&dome.shared.coating);
        }
        raw.silicone.iter().for_each(|medium| names.medium(medium));
        let sides = raw.led.shared.sides.as_ref().map(|sides| &sides.kind);
        for law in [&raw.mirror.kind, &raw.led.kind.0].into_iter().chain(sides) {
            if let Law::Specular(metal) = law {
                names.metal(metal);
            }
        }
        names.0.extend(&raw.array.positions_file);
        raw.light.spectrum.iter().for_each(|spectrum| names.spectrum(spectrum));
        names.0.extend(raw.sources.iter().filter_map(|source| source.kind.file()));
        let spectra = raw.sources.iter().filter_map(|source| source.shared.spectrum.as_ref());
        spectra.for_each(|spectrum| names.spectrum(spectrum));
        raw.solids.iter().for_each(|solid| names.solid(solid));
        for film in &raw.films {
            names.medium(&film.medium);
            film.top.iter().chain(&film.bottom).for_each(|face| names.scattering(face));
        }
        names.0.extend(raw.prints.iter().flat_map(|print| &print.picture_file));
        names
    }

    fn solid(&mut self, raw: &'a Solid) {
        match &raw.kind {
            SolidForm::Meridian(solid) => {
                self.0.extend(solid.meridian_file.iter().chain(&solid.meridian_y_file));
            }
            SolidForm::HeightMap(map) => self.0.push(&map.map_file),
            SolidForm::Mesh(mesh) => self.0.push(&mesh.mesh),
            _ => {}
        }
        let keys = &raw.shared;
        keys.medium.iter().for_each(|medium| self.medium(medium));
        self.layers(&keys.coating);
        keys.scatter.iter().for_each(|scatter| self.scattering(scatter));
        match keys.surface.as_ref().map(|surface| &surface.kind) {
            Some(SurfaceLaw::File(reflector)) => self.0.push(&reflector.file),
            Some(SurfaceLaw::Specular(metal)) => self.metal(metal),
            _ => {}
        }
    }

    fn medium(&mut self, raw: &'a Silicone) {
        self.0.extend(&raw.material_file);
        self.0.extend(raw.luminophores.iter().flat_map(|of| &of.emission.file));
    }

    fn scattering(&mut self, raw: &'a SolidScatter) {
        match &raw.kind {
            ScatterLaw::File(files) => {
                self.0.extend(files.file.iter().chain(&files.inner).chain(&files.outer));
            }
            ScatterLaw::Coated(face) => self.layers(&face.coating),
            _ => {}
        }
    }

    /// The metal of a reflector and the layers on it.
    fn metal(&mut self, raw: &'a Metal) {
        self.0.extend(raw.substrate.iter().flat_map(|substrate| &substrate.material_file));
        self.layers(&raw.coating);
    }

    fn layers(&mut self, layers: &'a [Layer]) {
        self.0.extend(layers.iter().flat_map(|layer| &layer.material_file));
    }

    fn spectrum(&mut self, raw: &'a Spectrum) {
        if let SpectrumForm::Table(rows) | SpectrumForm::Lines(rows) = &raw.kind {
            self.0.extend(&rows.file);
        }
    }
}
