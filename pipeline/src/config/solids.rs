// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]`, checked: further solids and sheets, what they are of, and what their surfaces do.
//!
//! In: the tables of the design. Out: forms, placements, media at the wavelength and what surfaces are made of. What surrounds each follows from the
//! geometry, and whether they cut each other is judged by the scene: see `stages::solids`.

mod form;

use std::path::Path;
use std::sync::Arc;

use bsdf::{Bsdf, LobeMotion};
use serde::{Deserialize, Serialize};
use tracer::glam::DVec3;
use tracer::{Mixed, Region, SurfaceModel};

use super::check::Context;
use super::design::Silicone;
use super::films::{Coats, Layer, Stack, Substrate};
use super::schema::{self, Reflection, is_default};
use super::{ConfigError, package};
use crate::formats::scattering::{self, Scattering};
use crate::metrics::illuminance::Symmetry;
use crate::provenance::FileRecord;
pub use form::Form;

/// Most solids: the tracer counts media of a body in eight bits, those of packages and those of the array together.
pub const MOST_SOLIDS: usize = 100;

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

/// `[[solids]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Solid {
    /// Its name in the ledger, as a surface and as a medium.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Whether every package carries it or it stands once.
    #[serde(default, skip_serializing_if = "is_default")]
    pub per: Per,
    /// Its place, mm: the middle; of a meridian or a mesh the origin of its coordinates.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact",
        default,
        skip_serializing_if = "is_default"
    )]
    pub position_mm: [f64; 3],
    /// Box, rectangle, mesh: turned about x, then y, then z by these angles, degrees.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub rotation_deg: Option<[f64; 3]>,
    /// Cylinder, meridian, disc: direction of the axis, of any length; +z if absent.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub axis: Option<[f64; 3]>,
    /// Box: lengths along x, y and z; rectangle: along x and y, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_mm: Option<Vec<f64>>,
    /// Cylinder, sphere, disc, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// Cylinder: length along the axis, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_mm: Option<f64>,
    /// Meridian: rows as of `dome.meridian_mm`, from the axis back to the axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meridian_mm: Option<Vec<Vec<f64>>>,
    /// Meridian: a file of such rows, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meridian_file: Option<String>,
    /// Mesh: an STL or OBJ file, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Mesh: unit of the lengths in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_unit: Option<String>,
    /// What it is of, if light enters it; keys of `[silicone]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub medium: Option<schema::Silicone>,
    /// Thin layers on it, from its inside outwards, where light enters it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<Layer>,
    /// What its surface does by a file, where light enters it; of a sheet, what it does to light from either side.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<RawScatter>,
    /// What it does with light that does not enter it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<Reflector>,
}

/// Kinds of solids and sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A box.
    Box,
    /// A cylinder with both ends.
    Cylinder,
    /// A ball.
    Sphere,
    /// A body of revolution by its generating curve.
    Meridian,
    /// A closed mesh of triangles.
    Mesh,
    /// A flat rectangle without thickness.
    Rectangle,
    /// A flat disc without thickness.
    Disc,
}

impl Kind {
    /// Whether it is a sheet, without an inside.
    pub fn is_sheet(self) -> bool {
        matches!(self, Self::Rectangle | Self::Disc)
    }
}

impl Solid {
    /// The key that says how large it is, and what stands there; of a meridian or a mesh its place.
    pub fn size(&self) -> (&'static str, String) {
        match (self.size_mm.as_deref(), self.radius_mm) {
            (Some(size), _) => ("size_mm", format!("{size:?}")),
            (None, Some(radius)) => ("radius_mm", radius.to_string()),
            (None, None) => ("position_mm", format!("{:?}", self.position_mm)),
        }
    }
}

/// How often a solid stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Per {
    /// In every package, in its coordinates.
    #[default]
    Package,
    /// Once, in the coordinates of the array.
    Array,
}

/// `[solids.scatter]`: as of `[[files.bands]]`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct RawScatter {
    /// A file that says itself which side is meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Zemax files for light from the inner side.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inner: Vec<String>,
    /// Zemax files for light from the outer side.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outer: Vec<String>,
    /// How lobes move between the incidences of the files.
    pub between: LobeMotion,
}

/// `[solids.surface]`: as of `[mirror]` and of `[files.mirror]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Reflector {
    /// Law of reflection.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<Reflection>,
    /// Reflectance, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<f64>,
    /// Mixed: share of what is reflected that goes on as from a mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular_fraction: Option<f64>,
    /// The metal of a specular one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub substrate: Option<Substrate>,
    /// Thin layers on the metal, from the light towards it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<Layer>,
    /// A file by which it reflects instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// How lobes move between the incidences of the file.
    #[serde(default, skip_serializing_if = "is_default")]
    pub between: LobeMotion,
}

/// A solid or a sheet of a checked design.
#[derive(Debug, Clone, Serialize)]
pub struct Checked {
    /// As written.
    pub stated: Solid,
    /// What it is of at the wavelength, if light enters it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub medium: Option<Silicone>,
    /// Layers and metal at the wavelength.
    #[serde(skip_serializing_if = "is_default")]
    pub coats: Coats,
    /// Files of its form and of its surface, with their hashes; those of materials are told by what they say at the wavelength.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<FileRecord>,
    /// Its form, in its own coordinates.
    #[serde(skip)]
    pub form: Form,
    /// The symmetry of the form about the axis of its package, or of the array.
    #[serde(skip)]
    pub symmetry: Symmetry,
    #[serde(skip)]
    made: Arc<Made>,
}

/// What the file says of a surface, whatever the wavelength.
#[derive(Debug, Default)]
struct Made {
    stack: Stack,
    scattering: Option<Scattering>,
    reflector: Option<ByFile>,
}

/// A reflector by a file.
struct ByFile(Arc<dyn Bsdf>);

impl std::fmt::Debug for ByFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a reflector by a file")
    }
}

impl Checked {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.stated.name
    }

    /// At another wavelength.
    fn tuned(&self, wavelength_nm: f64, at: &Context) -> Result<Self, ConfigError> {
        let medium = self.medium.as_ref();
        let medium = medium.map(|m| package::medium_at(&m.stated, wavelength_nm, at));
        Ok(Self {
            medium: medium.transpose()?,
            coats: self.made.stack.at(wavelength_nm, at)?,
            ..self.clone()
        })
    }

    /// Whether what it does depends on the wavelength by itself, not only by the indices of media.
    pub fn is_coated(&self) -> bool {
        self.coats != Coats::default()
    }

    /// Whether tables of files that are made for one pair of indices say what light meets on it.
    pub fn scatters(&self) -> bool {
        self.made.scattering.is_some()
    }

    /// What light meets on it between media of these indices, inner and outer.
    ///
    /// # Errors
    /// Scattering that does not fit the media.
    pub fn optics(&self, wavelength_nm: f64, indices: [f64; 2]) -> anyhow::Result<SurfaceModel> {
        if let Some(scattering) = &self.made.scattering {
            return Ok(SurfaceModel::Scatter(scattering.scatter(indices)?));
        }
        if let Some(ByFile(table)) = &self.made.reflector {
            return Ok(SurfaceModel::Coating(Arc::clone(table)));
        }
        let Some(surface) = &self.stated.surface else {
            let coated = self.coats.interface(wavelength_nm)?;
            return Ok(coated.unwrap_or(SurfaceModel::Interface));
        };
        let reflectance = surface.reflectance.unwrap_or_default();
        if let Some(metal) = self.coats.mirror(wavelength_nm, reflectance)? {
            return Ok(metal);
        }
        Ok(match surface.kind {
            Some(Reflection::Specular) => SurfaceModel::Mirror { reflectance },
            Some(Reflection::Lambertian) => SurfaceModel::Lambertian { reflectance },
            Some(Reflection::Mixed) => SurfaceModel::Mixed(Mixed {
                reflectance,
                specular: surface.specular_fraction.unwrap_or_default(),
            }),
            Some(Reflection::Absorbing) | None => SurfaceModel::Absorber,
        })
    }
}

/// Checks the tables of a design with or without a dome; files lie in `folder`.
pub(super) fn resolve(
    raw: &[Solid],
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Vec<Checked>, ConfigError> {
    if raw.len() > MOST_SOLIDS {
        let expected = format!("at most {MOST_SOLIDS} tables");
        return Err(at.value("solids", raw.len(), &expected));
    }
    let mut checked: Vec<Checked> = Vec::new();
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

/// All solids at another wavelength.
pub(super) fn tuned(
    solids: &[Checked],
    wavelength_nm: f64,
    at: &Context,
) -> Result<Vec<Checked>, ConfigError> {
    let tuned = solids.iter().map(|solid| solid.tuned(wavelength_nm, at));
    tuned.collect()
}

fn one(
    solid: &Solid,
    table: &str,
    wavelength_nm: f64,
    folder: &Path,
    at: &Context,
) -> Result<Checked, ConfigError> {
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
    Ok(Checked {
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
    surface: &Reflector,
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

/// The solids of packages, or of the array, that light enters, with the numbers of their media; in a package with a dome the silicone is the first one.
pub fn regions(solids: &[Checked], per: Per, domed: bool) -> Vec<(&Checked, Region)> {
    let first = u8::from(domed && per == Per::Package);
    let entered = solids
        .iter()
        .filter(|s| s.stated.per == per && s.medium.is_some());
    let numbered = (first..).zip(entered);
    numbered
        .map(|(number, solid)| (solid, Region::Body(number)))
        .collect()
}

/// Names of the files that solids name, in the order of the tables.
pub(super) fn named_files(raw: &[Solid]) -> Vec<Option<String>> {
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

/// A direction of any length, or the complaint about it.
fn direction(key: &str, stated: [f64; 3], at: &Context) -> Result<DVec3, ConfigError> {
    let direction = DVec3::from_array(stated);
    if direction.is_finite() && direction.length() > 0.0 && direction.length().is_finite() {
        return Ok(direction.normalize());
    }
    Err(at.value(
        key,
        format!("{stated:?}"),
        "a direction, of any length above 0",
    ))
}
