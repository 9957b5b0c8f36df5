// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]`, checked: further solids and sheets, what they are of, and what their surfaces do.
//!
//! What surrounds each follows from the geometry; the scene checks whether they cut each other, see `stages::solids`.

use std::path::Path;
use std::sync::Arc;

use super::{form, package};
use crate::config::check::Context;
use crate::config::design::films::Stack;
use crate::config::design::solids::{ByFile, CheckedSolid, MOST_SOLIDS, Made};
use crate::config::error::ConfigError;
use crate::config::schema::Reflection;
use crate::config::schema::solids::{Solid, SolidSurface};
use crate::formats::scattering::{self, Scattering};
use crate::metrics::illuminance::Symmetry;

/// Names that surfaces and media of a scene have without solids.
const TAKEN: [&str; 12] = [
    "air",
    "silicone",
    "dome",
    "side",
    "bottom",
    "mask",
    "box side",
    "box top",
    "ground mirror",
    "floor",
    "housing floor",
    "wall",
];

/// Checks the tables of a design with or without a dome; files lie in `folder`.
pub(in crate::config) fn resolve(
    raw: &[Solid],
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Vec<CheckedSolid>, ConfigError> {
    if raw.len() > MOST_SOLIDS {
        let expected = format!("at most {MOST_SOLIDS} tables");
        return Err(at.value("solids", raw.len(), &expected));
    }
    let mut checked: Vec<CheckedSolid> = Vec::new();
    for (number, solid) in raw.iter().enumerate() {
        let table = format!("solids[{}]", number + 1);
        let refuse = |expected: &str| {
            let got = format!("{:?}", solid.name);
            Err(at.value(&format!("{table}.name"), got, expected))
        };
        let usable = !solid.name.is_empty()
            && solid
                .name
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
            && checked.iter().all(|c| c.stated.name != solid.name);
        if !usable {
            return refuse(
                "letters, digits, '-', '_' and '.' only, no name twice, and none that the scene has for something else",
            );
        }
        let in_ledger = |taken: &str| taken.replace(' ', "_");
        if TAKEN.iter().any(|taken| in_ledger(taken) == solid.name) {
            let taken = TAKEN.map(in_ledger).join(", ");
            return refuse(&format!(
                "a name that the ledger has not for something else, as it has {taken}"
            ));
        }
        checked.push(one(solid, &table, wavelength_nm, folder, at)?);
    }
    Ok(checked)
}

fn one(
    solid: &Solid,
    table: &str,
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<CheckedSolid, ConfigError> {
    let key = |name: &str| format!("{table}.{name}");
    let mut files = Vec::new();
    let form = form::resolve(solid, table, folder, &mut files, at)?;
    substance(solid, &key, at)?;
    let medium = solid.medium.as_ref();
    let medium = medium.map(|raw| package::medium(&key("medium"), raw, wavelength_nm, folder, at));
    let mut made = Made {
        stack: Stack::new(table, &solid.coating, folder, at)?,
        ..Made::default()
    };
    let of_files = |table: String, error: &anyhow::Error| ConfigError::Files {
        file: at.file.to_owned(),
        message: format!("{table}: {error:#}"),
    };
    let mut turns = true;
    if let Some(scatter) = &solid.scatter {
        let sides = [&*scatter.inner, &*scatter.outer];
        let loaded = Scattering::load(scatter.file.as_deref(), sides, scatter.between, folder)
            .map_err(|error| of_files(key("scatter"), &error))?;
        turns = loaded.is_isotropic();
        files.extend(loaded.files.iter().cloned());
        made.scattering = Some(loaded);
    }
    if let Some(surface) = &solid.surface {
        let surface_key = key("surface");
        match &surface.file {
            Some(name) => {
                let opened = scattering::open(name, folder, &mut files);
                let (table, isotropic) = opened
                    .and_then(|content| scattering::reflector(&content, name, surface.between))
                    .map_err(|error| of_files(format!("{surface_key}.file"), &error))?;
                turns = isotropic;
                made.reflector = Some(ByFile(table));
            }
            None => made.stack = reflector(surface, &surface_key, folder, at)?,
        }
    }
    let symmetry = if turns {
        form.symmetry(solid)
    } else {
        Symmetry::None
    };
    Ok(CheckedSolid {
        stated: solid.clone(),
        medium: medium.transpose()?,
        coats: made.stack.at(wavelength_nm, at)?,
        files,
        form,
        symmetry,
        made: Arc::new(made),
    })
}

/// What a solid is of, and what a sheet does: one of the tables that say it, and none that says the opposite.
fn substance(
    solid: &Solid,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<(), ConfigError> {
    let refuse = |name: &str, got: &str, expected: &str| Err(at.value(&key(name), got, expected));
    let coated = !solid.coating.is_empty();
    if solid.kind.is_sheet() {
        if solid.medium.is_some() {
            return refuse(
                "medium",
                "given",
                "no such table for a sheet, which has no inside",
            );
        }
        if coated {
            return refuse("coating", "given", "no such key for a sheet");
        }
        return match (&solid.surface, &solid.scatter) {
            (None, None) => refuse("surface", "missing", "this table or `scatter`, for a sheet"),
            (Some(_), Some(_)) => refuse("scatter", "given", "no such table beside `surface`"),
            _ => Ok(()),
        };
    }
    match (&solid.medium, &solid.surface) {
        (None, None) => refuse(
            "medium",
            "missing",
            "this table, or `surface` for a solid that light does not enter",
        ),
        (Some(_), Some(_)) => refuse(
            "surface",
            "given",
            "no such table beside `medium`: light enters the solid",
        ),
        (None, Some(_)) if coated => refuse(
            "coating",
            "given",
            "no such key without `medium`; layers on metal stand in `surface`",
        ),
        (None, Some(_)) if solid.scatter.is_some() => refuse(
            "scatter",
            "given",
            "no such table without `medium`; a reflector by a file is `surface.file`",
        ),
        (Some(_), None) if coated && solid.scatter.is_some() => {
            refuse("scatter", "given", "no such table beside `coating`")
        }
        _ => Ok(()),
    }
}

/// The layers and the metal of a reflector that is stated by a law.
fn reflector(
    surface: &SolidSurface,
    table: &str,
    folder: &Path,
    at: &Context,
) -> Result<Stack, ConfigError> {
    let missing =
        |name: &str, expected: &str| at.value(&format!("{table}.{name}"), "missing", expected);
    let kind = surface
        .kind
        .ok_or_else(|| missing("kind", "a law of reflection, or `file`"))?;
    let reflectance = match (surface.reflectance, kind) {
        (Some(reflectance), _) => reflectance,
        (None, Reflection::Absorbing) => 0.0,
        (None, _) => return Err(missing("reflectance", "a number from 0 to 1")),
    };
    let law = (kind, reflectance, surface.specular_fraction);
    package::reflector([table, &format!("{table}.kind")], law, at)?;
    let metal = (&*surface.coating, surface.substrate.as_ref());
    Stack::on_metal(table, metal, kind == Reflection::Specular, folder, at)
}

/// Names of the files that solids name, in the order of the tables.
pub(in crate::config) fn named_files(raw: &[Solid]) -> Vec<Option<String>> {
    let mut names = Vec::new();
    for solid in raw {
        names.extend([solid.meridian_file.clone(), solid.mesh.clone()]);
        names.push(solid.medium.as_ref().and_then(|m| m.material_file.clone()));
        names.extend(solid.coating.iter().map(|l| l.material_file.clone()));
        if let Some(scatter) = &solid.scatter {
            names.push(scatter.file.clone());
            names.extend(
                scatter
                    .inner
                    .iter()
                    .chain(&scatter.outer)
                    .cloned()
                    .map(Some),
            );
        }
        if let Some(surface) = &solid.surface {
            names.push(surface.file.clone());
            let substrate = surface.substrate.as_ref();
            names.push(substrate.and_then(|s| s.material_file.clone()));
            names.extend(surface.coating.iter().map(|l| l.material_file.clone()));
        }
    }
    names
}
