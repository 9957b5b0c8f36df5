// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]`, checked: further solids and sheets, what they are of, and what their surfaces do.
//!
//! What surrounds each follows from the geometry; the scene checks whether they cut each other, see
//! `stages::solids`.

use std::path::Path;
use std::sync::Arc;

use bsdf::{DiffuseLaw, DiffuseLobe, GaussianLobe, ReliefShape};
use tracer::SurfaceModel;

use formats::scattering::{self, Scattering};
use metrics::digits::shortest;
use metrics::illuminance::Symmetry;
use runtime::provenance::FileRecord;

use super::form::{self, SolidTable};
use super::{grooves, haze, package, polariser, relief};
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::films::Stack;
use crate::resolved::form::Form;
use crate::resolved::solids::{
    BOX_FACES, CheckedSolid, CheckedSurface, LEAST_MM, MAX_SOLIDS, SolidOptics,
};
use crate::schema::reflectors::Law;
use crate::schema::solids::{
    CoatedFace, Contacts, GaussianShares, ReflectorFile, ScatterLaw, Solid, SolidScatter,
};

/// Rounding of a sum of shares.
const SHARES_ROUNDING: f64 = 1e-12;

/// Names that surfaces and media of a scene have without solids.
const TAKEN: [&str; 13] = [
    "air",
    "all",
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

/// Checks the tables of a design with or without a dome, in light of a wavelength that carries its
/// polarisation or not; files lie in `folder`.
pub(crate) fn resolve(
    raw: &[Solid],
    (wavelength_nm, is_polarised): (f64, bool),
    folder: &Path,
    at: &Context,
) -> Result<Vec<CheckedSolid>, ConfigError> {
    if raw.len() > MAX_SOLIDS {
        let expected = format!("at most {MAX_SOLIDS} tables");
        return Err(at.value("solids", raw.len(), &expected));
    }
    let mut checked: Vec<CheckedSolid> = Vec::new();
    for (number, solid) in raw.iter().enumerate() {
        let table = format!("solids[{}]", number + 1);
        let read = SolidTable { name: &table, folder, is_polarised, at };
        read.check_name(&solid.shared.name, checked.iter().map(CheckedSolid::name))?;
        checked.push(resolve_one(solid, [None, None], wavelength_nm, &read)?);
    }
    for (number, solid) in raw.iter().enumerate() {
        contacts(solid, number, raw, at)?;
    }
    Ok(checked)
}

/// Refuses contacts with what is no other solid of as many copies.
fn contacts(solid: &Solid, number: usize, all: &[Solid], at: &Context) -> Result<(), ConfigError> {
    let stated = &solid.shared.optical_contact;
    let usable = |other: &&Solid| {
        other.shared.per == solid.shared.per
            && other.shared.name != solid.shared.name
            && !other.kind.is_sheet()
    };
    let known: Vec<&str> =
        all.iter().filter(usable).map(|other| other.shared.name.as_str()).collect();
    let fixed = [Contacts::BOTTOM, Contacts::ALL];
    let is_known = |name: &&String| fixed.iter().chain(&known).any(|other| **other == ***name);
    let Some(wrong) = stated.0.iter().find(|name| !is_known(name)) else {
        return Ok(());
    };
    let known = known.iter().map(|name| format!(", {name:?}")).collect::<Vec<_>>().concat();
    let key = format!("solids[{}].optical_contact", number + 1);
    let expected = format!("\"bottom\", \"all\" or another solid with the same `per`{known}");
    Err(at.value(&key, format!("{wrong:?}"), &expected))
}

impl SolidTable<'_> {
    /// Refuses names that are `known` already or that the ledger has for something else.
    pub(super) fn check_name<'b>(
        &self,
        name: &str,
        mut known: impl Iterator<Item = &'b str>,
    ) -> Result<(), ConfigError> {
        let refuse = |expected: &str| {
            let got = format!("{name:?}");
            Err(self.at.value(&self.key("name"), got, expected))
        };
        let in_words = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        let usable = !name.is_empty() && name.chars().all(in_words);
        if !usable || known.any(|other| other == name) {
            return refuse(
                "letters, digits, '-', '_' and '.' only, no name twice, and none that the scene has \
                 for something else",
            );
        }
        let in_ledger = |taken: &str| taken.replace(' ', "_");
        if TAKEN.iter().any(|taken| in_ledger(taken) == *name) {
            let taken = TAKEN.map(in_ledger).join(", ");
            return refuse(&format!(
                "a name that the ledger has not for something else, as it has {taken}"
            ));
        }
        Ok(())
    }

    /// What a law of scattering does at a surface; the table of the law is `key`. Files are added
    /// to `files`.
    fn scattering(
        &self,
        law: &ScatterLaw,
        key: &str,
        files: &mut Vec<FileRecord>,
    ) -> Result<SolidOptics, ConfigError> {
        let at = self.at;
        Ok(match law {
            ScatterLaw::File(stated) => {
                let sides = [&*stated.inner, &*stated.outer];
                let file = stated.file.as_deref();
                let loaded = Scattering::load(file, sides, stated.between, self.folder)
                    .map_err(|error| at.of_files(&error.context(key.to_owned())))?;
                files.extend(loaded.files.iter().cloned());
                SolidOptics::Scattering(Box::new(loaded))
            }
            ScatterLaw::Lambertian(stated) => {
                let shares = [stated.reflected, stated.transmitted];
                diffusing(key, shares, [DiffuseLaw::Lambertian; 2], at)?
            }
            ScatterLaw::Gaussian(stated) => {
                let shares = [stated.reflected, stated.transmitted];
                diffusing(key, shares, gaussian(key, stated, at)?, at)?
            }
            ScatterLaw::Prisms(stated) => SolidOptics::Grooved(grooves::prisms(stated, key, at)?),
            ScatterLaw::Grooves(stated) => SolidOptics::Grooved(grooves::any(stated, key, at)?),
            ScatterLaw::Microlenses(stated) => {
                SolidOptics::Relief(relief::resolve(stated, ReliefShape::Lens, key, at)?)
            }
            ScatterLaw::Pyramids(stated) => {
                SolidOptics::Relief(relief::resolve(stated, ReliefShape::Pyramid, key, at)?)
            }
            ScatterLaw::Cones(stated) => {
                SolidOptics::Relief(relief::resolve(stated, ReliefShape::Cone, key, at)?)
            }
            ScatterLaw::Polariser(stated) => {
                SolidOptics::Polarising(polariser::resolve(stated, key, self)?)
            }
            ScatterLaw::Filter(stated) => {
                SolidOptics::Polarising(polariser::filter(stated, key, at)?)
            }
            ScatterLaw::Haze(stated) => SolidOptics::Hazy(haze::resolve(stated, key, at)?),
            ScatterLaw::Coated(CoatedFace { coating }) if coating.is_empty() => {
                return Err(at.value(&format!("{key}.coating"), "no layers", "at least one"));
            }
            ScatterLaw::Coated(CoatedFace { coating }) => {
                SolidOptics::Coated(Box::new(Stack::new(key, coating, self.folder, at)?))
            }
        })
    }
}

/// A solid, or a film with laws of its upper and its lower face.
pub(super) fn resolve_one(
    solid: &Solid,
    faces: [Option<SolidScatter>; 2],
    wavelength_nm: f64,
    read: &SolidTable,
) -> Result<CheckedSolid, ConfigError> {
    let SolidTable { name: table, folder, at, .. } = *read;
    let key = |name: &str| read.key(name);
    let mut files = Vec::new();
    let form = form::resolve(solid, read, &mut files)?;
    substance(solid, read)?;
    if solid.shared.optical_contact.names(Contacts::BOTTOM) && form.footprint().is_none() {
        return Err(no_foot(&form, &key("optical_contact"), at));
    }
    let keys = &solid.shared;
    let medium = keys.medium.as_ref();
    let medium = medium.map(|raw| package::medium(&key("medium"), raw, wavelength_nm, folder, at));
    let thickness_mm = form.shape_at_home().map_or(0.0, |bounds| bounds.size().min_element());
    if medium.is_some() && thickness_mm < LEAST_MM {
        let expected = format!(
            "at least {} mm along each axis of a body that light enters: thinner layers stand in \
             `coating`",
            shortest(LEAST_MM)
        );
        return Err(at.value(&key("medium"), format!("in {thickness_mm:e} mm"), &expected));
    }
    let mut stack = Stack::new(table, &keys.coating, folder, at)?;
    let optics = match (&keys.scatter, &keys.surface) {
        (Some(scatter), _) => match &scatter.kind {
            law @ (ScatterLaw::File(_) | ScatterLaw::Lambertian(_) | ScatterLaw::Gaussian(_)) => {
                read.scattering(law, &key("scatter"), &mut files)?
            }
            law @ ScatterLaw::Haze(_) if solid.kind.is_sheet() => {
                read.scattering(law, &key("scatter"), &mut files)?
            }
            _ => {
                let expected = "file, lambertian, gaussian or, of a sheet, haze: others are of a face of \
                                [[films]]";
                return Err(at.value(&key("scatter.kind"), scatter.kind_name(), expected));
            }
        },
        (None, None) => SolidOptics::Refracting,
        (None, Some(surface)) => match surface.kind.law() {
            Err(ReflectorFile { file, between }) => {
                let opened = scattering::open(file, folder, &mut files);
                let (table, is_isotropic) = opened
                    .and_then(|content| scattering::reflector(&content, file, *between))
                    .map_err(|error| at.of_files(&error.context(key("surface.file"))))?;
                SolidOptics::File { reflector: SurfaceModel::Coating(table), is_isotropic }
            }
            Ok(law) => {
                if let Law::Specular(metal) = &law {
                    stack = Stack::on_metal(&key("surface"), metal, folder, at)?;
                }
                SolidOptics::Law(package::reflector(&key("surface"), &law, at)?)
            }
        },
    };
    let [top, bottom] = [0, 1].map(|k| {
        let law = faces[k].as_ref().map(|face| &face.kind);
        law.map(|law| read.scattering(law, &key(BOX_FACES[k].0), &mut files)).transpose()
    });
    let surface = CheckedSurface { stack, optics, faces: [top?, bottom?] };
    let optics = [&surface.optics].into_iter().chain(surface.faces.iter().flatten());
    let symmetry =
        optics.map(SolidOptics::symmetry).fold(form.symmetry(&solid.kind), Symmetry::min);
    let checked = CheckedSolid {
        table: table.to_owned(),
        stated: solid.clone(),
        stated_faces: faces,
        medium: medium.transpose()?,
        coats: surface.stack.at(wavelength_nm, at)?,
        face_coats: surface.face_coats(wavelength_nm, at)?,
        files,
        form,
        symmetry,
        surface: Arc::new(surface),
    };
    checked.check_haze(at)?;
    Ok(checked)
}

/// Lobes of what is reflected and of what is transmitted.
fn gaussian(
    table: &str,
    stated: &GaussianShares,
    at: &Context,
) -> Result<[DiffuseLaw; 2], ConfigError> {
    let lobe = |name: &str, width_deg: f64| {
        let [least, most] = GaussianLobe::WIDTHS_DEG;
        at.within(&format!("{table}.{name}"), width_deg, least, most)?;
        let lobe = GaussianLobe::new(width_deg);
        let lobe = lobe.map_err(|error| at.of_files(&anyhow::Error::new(error)))?;
        Ok(DiffuseLaw::Gaussian(lobe))
    };
    let through = lobe("width_deg", stated.width_deg)?;
    let back = stated
        .reflected_width_deg
        .map_or(Ok(through), |width_deg| lobe("reflected_width_deg", width_deg))?;
    Ok([back, through])
}

/// The error of a solid that is to touch the bottom and has no flat face there.
fn no_foot(form: &Form, key: &str, at: &Context) -> ConfigError {
    let low = form.shape(0.0).map_or(0.0, |shape| shape.bounds().low.z);
    let expected = format!(
        "a box, upright cylinder or upright round meridian that stands on z = 0 with a flat face; the lowest point of this solid lies at {} mm",
        shortest((low * 1e9).round() * 1e-9)
    );
    at.value(key, "\"bottom\"", &expected)
}

/// A diffuser of these reflected and transmitted shares, of the table `table`.
pub(super) fn diffusing(
    table: &str,
    [reflected, transmitted]: [f64; 2],
    [back, through]: [DiffuseLaw; 2],
    at: &Context,
) -> Result<SolidOptics, ConfigError> {
    let key = |name: &str| format!("{table}.{name}");
    let lobe = |name: &str, share: f64, law: DiffuseLaw| {
        let share = at.within(&key(name), share, 0.0, 1.0)?;
        Ok(DiffuseLobe { share, law })
    };
    let transmission = lobe("transmitted", transmitted, through)?;
    let reflection = lobe("reflected", reflected, back)?;
    if reflected + transmitted > 1.0 + SHARES_ROUNDING {
        let expected =
            format!("at most {}, what `transmitted` leaves of 1", shortest(1.0 - transmitted));
        return Err(at.value(&key("reflected"), reflected, &expected));
    }
    Ok(SolidOptics::Diffusing { reflection, transmission })
}

/// What a solid is of, and what a sheet does: one of the tables that say it, and none that says the
/// opposite.
fn substance(solid: &Solid, read: &SolidTable) -> Result<(), ConfigError> {
    let refuse =
        |name: &str, got: &str, expected: &str| Err(read.at.value(&read.key(name), got, expected));
    let keys = &solid.shared;
    let coated = !keys.coating.is_empty();
    if !keys.optical_contact.is_empty() && keys.medium.is_none() {
        return refuse(
            "optical_contact",
            &keys.optical_contact.shown(),
            "no such key without `medium`: light does not enter the solid",
        );
    }
    if solid.kind.is_sheet() {
        if keys.medium.is_some() {
            return refuse("medium", "given", "no such table for a sheet, which has no inside");
        }
        if coated {
            return refuse("coating", "given", "no such key for a sheet");
        }
        return match (&keys.surface, &keys.scatter) {
            (None, None) => refuse("surface", "missing", "this table or `scatter`, for a sheet"),
            (Some(_), Some(_)) => refuse("scatter", "given", "no such table beside `surface`"),
            _ => Ok(()),
        };
    }
    match (&keys.medium, &keys.surface) {
        (None, None) => refuse(
            "medium",
            "missing",
            "this table, or `surface` for a solid that light does not enter",
        ),
        (Some(_), Some(_)) => {
            refuse("surface", "given", "no such table beside `medium`: light enters the solid")
        }
        (None, Some(_)) if coated => refuse(
            "coating",
            "given",
            "no such key without `medium`; layers on metal stand in `surface`",
        ),
        (None, Some(_)) if keys.scatter.is_some() => refuse(
            "scatter",
            "given",
            "no such table without `medium`; a reflector by a file is `surface.file`",
        ),
        (Some(_), None) if coated && keys.scatter.is_some() => {
            refuse("scatter", "given", "no such table beside `coating`")
        }
        _ => Ok(()),
    }
}
