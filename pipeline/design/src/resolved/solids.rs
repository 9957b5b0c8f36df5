// SPDX-License-Identifier: MIT OR Apache-2.0
//! Solids and sheets of a checked design.

use std::sync::Arc;

use anyhow::Context as _;
use bsdf::direction::Frame;
use bsdf::ray_optics::{Outline, UnitCell};
use bsdf::{DiffuseLaw, DiffuseLobe, Diffuser, HazyFace, Relief, ReliefCell, ReliefLattice};
use serde::Serialize;
use tracer::glam::DVec3;
use tracer::{Region, Shape, SurfaceModel};

use formats::scattering::Scattering;
use metrics::digits::shortest;
use metrics::illuminance::Symmetry;
use runtime::provenance::FileRecord;

use super::films::{Coats, Stack};
use super::form::Form;
use super::haze::StatedHaze;
use super::medium::{self, Medium};
use super::polariser::PolarisingFace;
use super::reflector::Reflector;
use crate::check::Context;
use crate::error::ConfigError;
use crate::schema::is_default;
use crate::schema::solids::{Contacts, Per, Solid, SolidForm, SolidScatter};
use runtime::serde_arrays::List;

/// Faces of a film, with the patches of a box that they are.
pub(crate) const BOX_FACES: [(&str, usize); 2] = [("top", 1), ("bottom", 2)];

/// Maximum number of solids and films: the tracer counts media of a body in eight bits, those of
/// packages and those of the array together.
pub const MAX_SOLIDS: usize = 100;

/// Least width of a gap and thickness of what light enters, mm: below it there is no way through by
/// rays, and no reflection at the faces of its own.
pub const LEAST_MM: f64 = 1e-4;

/// A solid or a sheet of a checked design.
#[derive(Debug, Clone, Serialize)]
pub struct CheckedSolid {
    /// Its table in the design file: `solids[1]`, `films[2]`.
    #[serde(skip)]
    pub table: String,
    /// As written; of a film the box that it is.
    pub stated: Solid,
    /// Upper and lower face of a film as written.
    #[serde(skip_serializing_if = "is_default")]
    pub stated_faces: [Option<SolidScatter>; 2],
    /// Medium at the wavelength, if light enters it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub medium: Option<Medium>,
    /// Layers and metal at the wavelength.
    #[serde(skip_serializing_if = "is_default")]
    pub coats: Coats,
    /// Layers on the upper and the lower face of a film at the wavelength.
    #[serde(skip_serializing_if = "is_default")]
    pub face_coats: [Coats; 2],
    /// Files of its form and of its surface, with their hashes; those of materials are told by what
    /// they say at the wavelength.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<FileRecord>,
    /// Form, in its own coordinates.
    #[serde(skip)]
    pub form: Form,
    /// The symmetry of the form about the axis of its package, or of the array.
    #[serde(skip)]
    pub symmetry: Symmetry,
    /// Surface as stated, at any wavelength.
    #[serde(skip)]
    pub(crate) surface: Arc<CheckedSurface>,
}

/// Surface as stated, whatever the wavelength.
#[derive(Debug)]
pub(crate) struct CheckedSurface {
    pub(crate) stack: Stack,
    pub(crate) optics: SolidOptics,
    /// Upper and lower face, where they are not as the others.
    pub(crate) faces: [Option<SolidOptics>; 2],
}

/// Optical depth of a film that leaves a hundredth of light on its way through it and back unscattered.
const SCATTERED: f64 = 2.3;
/// Optical depth times 1 - g of a film that turns most of it far beyond a cell of incidence.
const TURNED: f64 = 0.5;

impl CheckedSurface {
    /// Layers on the faces at a wavelength, at which shares of polarisers and filters are stated.
    pub(crate) fn face_coats(
        &self,
        wavelength_nm: f64,
        at: &Context,
    ) -> Result<[Coats; 2], ConfigError> {
        let coats = |face: &Option<SolidOptics>| match face {
            Some(SolidOptics::Coated(stack)) => stack.at(wavelength_nm, at),
            Some(SolidOptics::Polarising(face)) => {
                face.check(wavelength_nm, at).map(|()| Coats::default())
            }
            _ => Ok(Coats::default()),
        };
        let [top, bottom] = &self.faces;
        Ok([coats(top)?, coats(bottom)?])
    }
}

/// Optical surface of a solid.
#[derive(Debug)]
pub(crate) enum SolidOptics {
    /// An interface, with the layers on it.
    Refracting,
    /// Tables of files.
    Scattering(Box<Scattering>),
    /// Stated shares by a formula.
    Diffusing {
        /// Reflected part.
        reflection: DiffuseLobe,
        /// Transmitted part.
        transmission: DiffuseLobe,
    },
    /// Grooves, by ray optics.
    Grooved(GroovedFace),
    /// Lenses, pyramids or cones, likewise.
    Relief(ReliefFace),
    /// A polarising sheet or a filter.
    Polarising(PolarisingFace),
    /// Thin layers on a face.
    Coated(Box<Stack>),
    /// A diffuser by its haze.
    Hazy(StatedHaze),
    /// A reflector by a file.
    File {
        /// What light meets.
        reflector: SurfaceModel,
        /// True if it looks the same from all azimuths.
        is_isotropic: bool,
    },
    /// A law of reflection; with the metal under it where it is of metal.
    Law(Reflector),
}

/// Directions about the vertical in which a surface is the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Orientation {
    /// All.
    Round,
    /// Its images in the planes along this direction from the x axis, degrees, and across it.
    Axis(f64),
    /// None.
    Directed,
}

/// Grooves of a face.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GroovedFace {
    /// One period, z away from the film.
    pub(crate) line_um: Vec<[f64; 2]>,
    /// Direction of the grooves, from the x axis.
    pub(crate) direction_deg: f64,
    /// True if the line is mirrored in its middle.
    pub(crate) is_symmetric: bool,
    /// Depth to which it stands in the outer medium, µm, with air below.
    pub(crate) tips_um: Option<f64>,
}

impl GroovedFace {
    /// The face with the normal `frame.n` between media of these indices, inner and outer.
    fn optics(&self, frame: &Frame, indices: [f64; 2]) -> Result<SurfaceModel, bsdf::Error> {
        let (sin, cos) = self.direction_deg.to_radians().sin_cos();
        let across = DVec3::new(-sin, cos, 0.0);
        let outline = Outline::below(&self.line_um, indices);
        let outline = match self.tips_um {
            Some(tips_um) => outline.standing_in_outer(tips_um),
            None => outline,
        };
        let cell = UnitCell::new(&outline)?;
        let turn = across.dot(frame.b).atan2(across.dot(frame.t));
        Ok(SurfaceModel::Scatter(Arc::new(cell.turned(turn))))
    }
}

/// Relief of a face that repeats in two directions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReliefFace {
    /// Lengths in µm.
    pub(crate) relief: Relief,
    /// Direction from cell to cell, from the x axis.
    pub(crate) direction_deg: f64,
}

impl ReliefFace {
    /// The face with the normal `frame.n` between media of these indices, inner and outer.
    fn optics(&self, frame: &Frame, indices: [f64; 2]) -> Result<SurfaceModel, bsdf::Error> {
        let (sin, cos) = self.direction_deg.to_radians().sin_cos();
        let along = DVec3::new(cos, sin, 0.0);
        let turn = along.dot(frame.b).atan2(along.dot(frame.t));
        Ok(SurfaceModel::Scatter(Arc::new(ReliefCell::new(self.relief, indices)?.turned(turn))))
    }

    /// The symmetry about the axes x and y that it leaves: planes that mirror squares follow each
    /// other by 45°, those that mirror hexagons by 30°.
    fn symmetry(&self) -> Symmetry {
        let (step_deg, symmetry) = match self.relief.lattice {
            ReliefLattice::Square => (45.0, Symmetry::Square),
            ReliefLattice::Hexagonal => (30.0, Symmetry::Rectangle),
        };
        if self.direction_deg % step_deg == 0.0 { symmetry } else { Symmetry::None }
    }
}

impl SolidOptics {
    /// The directions in which it is the same.
    fn orientation(&self) -> Orientation {
        match self {
            Self::Grooved(face) if face.is_symmetric => Orientation::Axis(face.direction_deg),
            Self::Grooved(_) | Self::File { is_isotropic: false, .. } => Orientation::Directed,
            Self::Relief(face) if face.symmetry() == Symmetry::None => {
                Orientation::Axis(face.direction_deg)
            }
            Self::Relief(_) => Orientation::Axis(0.0),
            Self::Polarising(PolarisingFace::Axes { axis_deg, .. }) => Orientation::Axis(*axis_deg),
            Self::Scattering(table) if !table.is_isotropic() => Orientation::Directed,
            _ => Orientation::Round,
        }
    }

    /// The symmetry that it leaves.
    pub(crate) fn symmetry(&self) -> Symmetry {
        match self {
            Self::Grooved(face) if !face.is_symmetric || face.direction_deg % 90.0 != 0.0 => {
                Symmetry::None
            }
            Self::Grooved(_) => Symmetry::Rectangle,
            Self::Relief(face) => face.symmetry(),
            Self::Polarising(PolarisingFace::Axes { axis_deg, .. }) => {
                if axis_deg % 90.0 == 0.0 {
                    Symmetry::Rectangle
                } else {
                    Symmetry::None
                }
            }
            Self::Scattering(table) if !table.is_isotropic() => Symmetry::None,
            Self::File { is_isotropic: false, .. } => Symmetry::None,
            _ => Symmetry::Square,
        }
    }
}

impl CheckedSolid {
    /// Name.
    pub fn name(&self) -> &str {
        &self.stated.shared.name
    }

    /// The key that says where it stands, and what stands there.
    pub fn place(&self) -> (String, String) {
        let List(position_mm) = self.stated.shared.position_mm;
        match self.lower_face_mm() {
            Some(z_mm) => (format!("{}.z_mm", self.table), z_mm.to_string()),
            None => (format!("{}.position_mm", self.table), format!("{position_mm:?}")),
        }
    }

    /// Height of the lower face of a film, which its design states.
    fn lower_face_mm(&self) -> Option<f64> {
        let SolidForm::Box(flat) = &self.stated.kind else { return None };
        let List([_, _, middle_mm]) = self.stated.shared.position_mm;
        let low_mm = middle_mm - 0.5 * flat.size_mm.0[2];
        // Without the rounding of the difference.
        self.is_film().then(|| (low_mm * 1e9).round() / 1e9)
    }

    /// The key that says how large it is, and what stands there; of a meridian or a mesh its place.
    pub fn size(&self) -> (String, String) {
        let radius = |radius: f64| ("radius_mm", radius.to_string());
        let (key, got) = match &self.stated.kind {
            SolidForm::Box(flat) => ("size_mm", format!("{:?}", flat.size_mm.0)),
            SolidForm::Rectangle(flat) => ("size_mm", format!("{:?}", flat.size_mm.0)),
            SolidForm::HeightMap(map) => ("size_mm", format!("{:?}", map.size_mm.0)),
            SolidForm::Cylinder(cylinder) => radius(cylinder.radius_mm),
            SolidForm::Sphere(ball) => radius(ball.radius_mm),
            SolidForm::Disc(disc) => radius(disc.radius_mm),
            SolidForm::Meridian(_) | SolidForm::Mesh(_) => return self.place(),
        };
        (format!("{}.{key}", self.table), got)
    }

    /// True for a film of `[[films]]`.
    pub fn is_film(&self) -> bool {
        self.table.starts_with("films")
    }

    /// Number of copies.
    pub fn per(&self) -> Per {
        self.stated.shared.per
    }

    /// True if it stands on the bottom without a gap.
    pub fn touches_bottom(&self) -> bool {
        let contacts = &self.stated.shared.optical_contact;
        contacts.names(Contacts::BOTTOM)
            || (contacts.include(Contacts::BOTTOM) && self.form.footprint().is_some())
    }

    /// At another wavelength.
    pub(super) fn tuned(&self, wavelength_nm: f64, at: &Context) -> Result<Self, ConfigError> {
        let medium = self.medium.as_ref();
        let medium = medium.map(|m| medium::medium_at(&m.stated, wavelength_nm, at));
        let tuned = Self {
            medium: medium.transpose()?,
            coats: self.surface.stack.at(wavelength_nm, at)?,
            face_coats: self.surface.face_coats(wavelength_nm, at)?,
            ..self.clone()
        };
        tuned.check_haze(at)?;
        Ok(tuned)
    }

    /// Refuses values of hazy faces that its medium does not give.
    pub(crate) fn check_haze(&self, at: &Context) -> Result<(), ConfigError> {
        let faces = [&self.surface.optics].into_iter().chain(self.surface.faces.iter().flatten());
        for optics in faces {
            let SolidOptics::Hazy(haze) = optics else { continue };
            let is_milky =
                |medium: &Medium| medium.scattering.is_some() || !medium.luminophores.is_empty();
            if self.medium.as_ref().is_some_and(is_milky) {
                let expected = "a medium that neither scatters nor converts light: its haze would add \
                                to the stated one";
                let got = "one that scatters or converts light";
                return Err(at.value(&format!("{}.medium", self.table), got, expected));
            }
            haze.shares(self.along_normal(), at)?;
        }
        Ok(())
    }

    /// Index of a film, and the share of light that its medium lets pass along the normal; of a sheet
    /// 1 and 1.
    fn along_normal(&self) -> (f64, f64) {
        let medium = self.medium.as_ref().zip(self.film_mm());
        medium.map_or((1.0, 1.0), |(medium, ([low, high], _))| {
            (medium.index, (-medium.absorption_per_mm * (high - low)).exp())
        })
    }

    /// True if what it does depends on the wavelength by itself, not only by the indices of media.
    pub fn is_coated(&self) -> bool {
        self.coats != Coats::default()
            || self.surface.faces.iter().flatten().any(|optics| match optics {
                SolidOptics::Polarising(face) => face.is_spectral(),
                SolidOptics::Coated(_) => true,
                _ => false,
            })
    }

    /// True of two films in optical contact.
    pub fn joins(&self, other: &Self) -> bool {
        let names = |one: &Self, other: &Self| {
            one.stated.shared.optical_contact.names(other.name()) && one.is_film()
        };
        names(self, other) || names(other, self)
    }

    /// Heights of its lower and upper end, and lengths along x and y, mm, of a film.
    pub fn film_mm(&self) -> Option<([f64; 2], [f64; 2])> {
        let SolidForm::Box(flat) = &self.stated.kind else { return None };
        let [x, y, thickness] = flat.size_mm.0;
        let middle = self.stated.shared.position_mm.0[2];
        let ends = [middle - 0.5 * thickness, middle + 0.5 * thickness];
        self.is_film().then_some((ends, [x, y]))
    }

    /// How deep relief is cut into the upper and the lower face of a film, µm.
    pub(crate) fn depths_of_faces_um(&self) -> [f64; 2] {
        self.surface.faces.each_ref().map(|face| match face {
            Some(SolidOptics::Grooved(face)) => {
                let heights = face.line_um.iter().map(|[_, z]| *z);
                -heights.fold(0.0, f64::min)
            }
            Some(SolidOptics::Relief(face)) if face.relief.is_pressed_in => face.relief.height,
            _ => 0.0,
        })
    }

    /// True if what its surface sends back is depolarised, of a solid that light does not enter.
    pub fn is_diffuse(&self) -> bool {
        match &self.surface.optics {
            SolidOptics::Law(law) => {
                matches!(law, Reflector::Lambertian { .. } | Reflector::Absorbing)
            }
            SolidOptics::Diffusing { .. }
            | SolidOptics::Scattering(_)
            | SolidOptics::File { .. } => true,
            _ => false,
        }
    }

    /// True of a film that leaves hardly any light that goes through it and back its direction.
    pub fn diffuses(&self) -> bool {
        let is_lambertian = |optics: &SolidOptics| {
            let law = DiffuseLaw::Lambertian;
            matches!(optics, SolidOptics::Diffusing { transmission, reflection }
                if transmission.law == law && reflection.law == law)
        };
        let (Some(([low, high], _)), Some(medium)) = (self.film_mm(), &self.medium) else {
            return false;
        };
        let is_turbid = medium.scattering.as_ref().is_some_and(|scattering| {
            let depth = scattering.per_mm * (high - low);
            let g = scattering.optics.phase.mean_cosine();
            depth >= SCATTERED && depth * (1.0 - g) >= TURNED
        });
        is_turbid || self.surface.faces.iter().flatten().any(is_lambertian)
    }

    /// The directions in which each of its surfaces is the same.
    pub fn orientations(&self) -> impl Iterator<Item = Orientation> {
        let surface = &self.surface;
        let faces = surface.faces.iter().flatten();
        std::iter::once(&surface.optics).chain(faces).map(SolidOptics::orientation)
    }

    /// Keys of what its faces do that planes across x or y do not mirror on itself, and what stands
    /// there.
    pub fn oriented(&self) -> Vec<(String, String)> {
        let surface = &self.surface;
        let is_scatter = self.stated.shared.scatter.is_some();
        let own = (if is_scatter { "scatter" } else { "surface" }, &surface.optics);
        let names = BOX_FACES.into_iter().map(|(name, _)| name);
        let faces = names.zip(&surface.faces);
        let faces = faces.filter_map(|(name, optics)| Some((name, optics.as_ref()?)));
        let oriented = [own].into_iter().chain(faces);
        let oriented = oriented.filter(|(_, optics)| optics.symmetry() == Symmetry::None);
        let key = |(name, optics): (&str, &SolidOptics)| {
            let (key, got) = match optics {
                SolidOptics::Grooved(face) if face.is_symmetric => {
                    ("direction_deg", shortest(face.direction_deg))
                }
                SolidOptics::Relief(face) => ("direction_deg", shortest(face.direction_deg)),
                SolidOptics::Grooved(_) => ("profile_um", "one that is not symmetric".to_owned()),
                SolidOptics::Polarising(PolarisingFace::Axes { axis_deg, .. }) => {
                    ("axis_deg", shortest(*axis_deg))
                }
                _ => ("file", "one that is not isotropic".to_owned()),
            };
            (format!("{}.{name}.{key}", self.table), got)
        };
        oriented.map(key).collect()
    }

    /// True if tables of files that are made for one pair of indices say what light meets on it.
    pub fn scatters(&self) -> bool {
        let faces = self.surface.faces.iter().flatten();
        let mut all = faces.chain([&self.surface.optics]);
        all.any(|optics| matches!(optics, SolidOptics::Scattering(_)))
    }

    /// Optical surfaces of the patches of its shape, between media of these indices, inner and
    /// outer; of a film the upper and the lower face, if they lie between them.
    ///
    /// # Errors
    /// Scattering that does not fit the media.
    pub fn patches(
        &self,
        shape: &Shape,
        wavelength_nm: f64,
        indices: [f64; 2],
        faces: [bool; 2],
    ) -> anyhow::Result<Vec<SurfaceModel>> {
        let own = (&self.surface.optics, &self.coats);
        let all = self.optics(own, shape, DVec3::Z, wavelength_nm, indices);
        let all = all.with_context(|| format!("{}.scatter", self.table))?;
        let mut patches = vec![all; shape.patches()];
        for (k, (_, patch)) in BOX_FACES.into_iter().enumerate().filter(|(k, _)| faces[*k]) {
            if let Some(optics) = self.face(k, shape, wavelength_nm, indices)? {
                patches[patch] = optics;
            }
        }
        Ok(patches)
    }

    /// The upper (0) or the lower face (1) of a film between media of these indices, if it does more
    /// than refract.
    ///
    /// # Errors
    /// Scattering that does not fit the media.
    pub fn face(
        &self,
        k: usize,
        shape: &Shape,
        wavelength_nm: f64,
        indices: [f64; 2],
    ) -> anyhow::Result<Option<SurfaceModel>> {
        let normal = [DVec3::Z, DVec3::NEG_Z][k];
        let face = self.surface.faces[k].as_ref().map(|face| {
            let optics =
                self.optics((face, &self.face_coats[k]), shape, normal, wavelength_nm, indices);
            optics.with_context(|| format!("{}.{}", self.table, BOX_FACES[k].0))
        });
        face.transpose()
    }

    fn optics(
        &self,
        (optics, coats): (&SolidOptics, &Coats),
        shape: &Shape,
        normal: DVec3,
        wavelength_nm: f64,
        indices: [f64; 2],
    ) -> anyhow::Result<SurfaceModel> {
        Ok(match optics {
            SolidOptics::Grooved(face) => {
                face.optics(&shape.frame(DVec3::ZERO, normal), indices)?
            }
            SolidOptics::Relief(face) => face.optics(&shape.frame(DVec3::ZERO, normal), indices)?,
            SolidOptics::Polarising(face) => {
                let frame = shape.frame(DVec3::ZERO, normal);
                // Shares were checked with the name of the file.
                let at = Context::new("");
                SurfaceModel::Scatter(Arc::new(face.optics(&frame, wavelength_nm, indices, &at)?))
            }
            SolidOptics::Refracting | SolidOptics::Coated(_) => {
                let coated = coats.interface(wavelength_nm)?;
                coated.unwrap_or(SurfaceModel::Interface)
            }
            SolidOptics::Scattering(scattering) => SurfaceModel::Scatter(scattering.bsdf(indices)?),
            SolidOptics::Diffusing { reflection, transmission } => {
                SurfaceModel::Scatter(Arc::new(Diffuser::new(*reflection, *transmission, indices)?))
            }
            SolidOptics::Hazy(haze) => {
                // Values were checked with the name of the file.
                let shares = haze.shares(self.along_normal(), &Context::new(""))?;
                let lobe = (haze.scattered, haze.lobe);
                SurfaceModel::Scatter(Arc::new(HazyFace::new(shares, lobe, indices)?))
            }
            SolidOptics::File { reflector, .. } => reflector.clone(),
            SolidOptics::Law(reflector) => {
                let metal = coats.mirror(wavelength_nm, reflector.reflectance())?;
                metal.unwrap_or_else(|| reflector.optics())
            }
        })
    }
}

/// The solids of packages, or of the array, that light enters, with the numbers of their media; in
/// a package with a dome the silicone is the first one.
pub fn regions(solids: &[CheckedSolid], per: Per, domed: bool) -> Vec<(&CheckedSolid, Region)> {
    let first = u8::from(domed && per == Per::Package);
    let entered = solids.iter().filter(|s| s.per() == per && s.medium.is_some());
    let numbered = (first..).zip(entered);
    numbered.map(|(number, solid)| (solid, Region::Body(number))).collect()
}
