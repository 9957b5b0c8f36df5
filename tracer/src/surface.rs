// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfaces: a shape, the regions on its two sides, and a surface model for each patch.
//!
//! *Inner* is the side of -n, *outer* that of +n. A surface names the region on both sides, so a
//! ray always knows its medium: it starts in the region of its source and changes region where it
//! passes a surface.
//!
//! Both sides may be the same region, as with a sheet in the air. There the side does not tell a
//! surface just left from one ahead; the distance does, as rounding is a thousandth of the step off
//! the surface.

use std::fmt;
use std::sync::Arc;

use bsdf::Bsdf;
use glam::DVec3;
use num_complex::Complex64;
use rand::Rng;

use crate::error::{Error, fraction};
use crate::optics::thin_film::{Film, check_index};
use crate::pattern::Pattern;
use crate::shape::Shape;

/// A region of space on one side of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// Between the bodies: the medium of the scene.
    World,
    /// Inside a body: the medium of that number in its prototype.
    Body(u8),
    /// A space without light: inside of metal or the LED box, below the floor.
    Opaque,
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::World => write!(f, "the world"),
            Self::Body(number) => write!(f, "body medium {number}"),
            Self::Opaque => write!(f, "an opaque region"),
        }
    }
}

/// The effect of a surface patch on light.
#[derive(Clone)]
pub enum SurfaceModel {
    /// Smooth dielectric interface between the media of the two sides: unpolarised Fresnel, total
    /// reflection.
    Interface,
    /// Specular mirror of the given reflectance, from 0 to 1.
    Mirror {
        /// Reflected share of the power, at every angle.
        reflectance: f64,
    },
    /// Diffuse (Lambertian) reflector of the given reflectance, from 0 to 1.
    Lambertian {
        /// Reflected share of the power, at every angle.
        reflectance: f64,
    },
    /// Reflects part of the light as a mirror and part of it diffusely, at every angle alike, and
    /// absorbs the rest.
    Mixed(Mixed),
    /// An interface with thin films between the media, the first layer on the inner side.
    Layered(Arc<Film>),
    /// Specular mirror of thin films on metal.
    LayeredMirror(Arc<LayeredMirror>),
    /// Absorbs everything.
    Absorber,
    /// An upright face, at right angles to x or y, of a cell about the axis of z that repeats without
    /// end: light that meets it goes on from the opposite face, in its direction and its medium. It is
    /// no surface in any count.
    Periodic,
    /// Scatters in the local frame x = t, y = b, z = n at the point of impact; inner is the side of
    /// -n.
    Scatter(Arc<dyn Bsdf>),
    /// Reflects by the table's values for its outer side, whichever side the ray comes from, and
    /// absorbs the rest: a paint or a mirror, which may be opaque behind.
    Coating(Arc<dyn Bsdf>),
    /// One of two models by the place in the world.
    Printed(Arc<Printed>),
}

/// A reflector that is partly a mirror and partly diffuse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixed {
    /// Reflected share of the power, both parts together, 0 to 1.
    pub reflectance: f64,
    /// Specular share of the reflected power, 0 to 1; the rest follows the cosine law.
    pub specular: f64,
}

/// Thin films on an opaque substrate, for light from either side.
#[derive(Debug, Clone, PartialEq)]
pub struct LayeredMirror {
    /// The layers, the first one towards the light.
    pub film: Film,
    /// Refractive index n + ik of the substrate.
    pub substrate: Complex64,
    /// Factor on the reflectance, 0 to 1.
    pub factor: f64,
}

/// Ink on a level surface, in the places of a pattern.
#[derive(Debug, Clone)]
pub struct Printed {
    /// The model elsewhere.
    pub base: SurfaceModel,
    /// The model of the ink.
    pub ink: SurfaceModel,
    /// Places of the ink.
    pub pattern: Arc<Pattern>,
}

impl SurfaceModel {
    /// True if all or some light goes on in random directions, unpolarised.
    pub(crate) fn scatters(&self) -> bool {
        match self {
            Self::Lambertian { .. } | Self::Mixed(_) | Self::Coating(_) => true,
            Self::Scatter(table) => table.as_polarised().is_none(),
            Self::Printed(printed) => printed.base.scatters() || printed.ink.scatters(),
            _ => false,
        }
    }

    /// True if light on the reversed path has the same share.
    pub(crate) fn is_reciprocal(&self) -> bool {
        match self {
            Self::Scatter(table) => table.is_reciprocal(),
            Self::Coating(_) => false,
            Self::Printed(printed) => printed.base.is_reciprocal() && printed.ink.is_reciprocal(),
            Self::Interface
            | Self::Mirror { .. }
            | Self::Lambertian { .. }
            | Self::Mixed(_)
            | Self::Layered(_)
            | Self::LayeredMirror(_)
            | Self::Absorber
            | Self::Periodic => true,
        }
    }

    /// What light meets at a point of the world: of a printed surface one of its two models.
    #[inline]
    pub(crate) fn at(&self, point: impl FnOnce() -> DVec3, rng: &mut impl Rng) -> &Self {
        match self {
            Self::Printed(printed) => {
                let at = point();
                if printed.pattern.covers([at.x, at.y], rng) { &printed.ink } else { &printed.base }
            }
            model => model,
        }
    }

    /// The simplest equivalent model: a mixed reflector with one part only becomes pure.
    pub(crate) fn plain(&self) -> Self {
        match *self {
            Self::Mixed(Mixed { reflectance, specular: 1.0 }) => Self::Mirror { reflectance },
            Self::Mixed(Mixed { reflectance, specular: 0.0 }) => Self::Lambertian { reflectance },
            _ => self.clone(),
        }
    }

    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Interface => "interface",
            Self::Layered(_) => "layered interface",
            Self::LayeredMirror(_) => "layered mirror",
            Self::Mirror { .. } => "mirror",
            Self::Lambertian { .. } => "Lambertian reflector",
            Self::Mixed(_) => "mixed reflector",
            Self::Absorber => "absorber",
            Self::Periodic => "periodic face",
            Self::Scatter(_) => "scatter",
            Self::Coating(_) => "coating",
            Self::Printed(_) => "printed surface",
        }
    }
}

impl fmt::Debug for SurfaceModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mirror { reflectance } | Self::Lambertian { reflectance } => {
                write!(f, "{}({reflectance})", self.kind())
            }
            Self::Mixed(Mixed { reflectance, specular }) => {
                write!(f, "{}({reflectance}, {specular} specular)", self.kind())
            }
            _ => f.write_str(self.kind()),
        }
    }
}

/// A patch of a surface: its name in the ledger and its surface model. Patches of one name share
/// one ledger line.
#[derive(Debug, Clone)]
pub struct Patch {
    /// Name in the ledger, for example `element 6` or `box top`.
    pub name: String,
    /// Surface model.
    pub optics: SurfaceModel,
}

impl Patch {
    /// A named patch.
    pub fn new(name: impl Into<String>, optics: SurfaceModel) -> Self {
        Self { name: name.into(), optics }
    }
}

/// A shape between two regions, with a surface model for each patch.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Geometry.
    pub shape: Shape,
    /// The region on the side of -n.
    pub inner: Region,
    /// The region on the side of +n.
    pub outer: Region,
    /// One for each patch of the shape, see [`Shape::patches`].
    pub patches: Vec<Patch>,
}

impl Surface {
    /// A surface with one surface model all over.
    pub fn new(
        name: &str,
        shape: Shape,
        inner: Region,
        outer: Region,
        optics: &SurfaceModel,
    ) -> Self {
        let patches = vec![Patch::new(name, optics.clone()); shape.patches()];
        Self { shape, inner, outer, patches }
    }

    /// A surface with a surface model for each patch.
    pub fn zoned(shape: Shape, inner: Region, outer: Region, patches: Vec<Patch>) -> Self {
        Self { shape, inner, outer, patches }
    }

    /// Name of its first patch.
    pub fn name(&self) -> &str {
        self.patches.first().map_or("(no parts)", |patch| &patch.name)
    }

    /// Checks every patch. `inner` and `outer` are the refractive indices, `None` where opaque.
    pub(crate) fn validate(&self, inner: Option<f64>, outer: Option<f64>) -> Result<(), Error> {
        if self.patches.len() != self.shape.patches() {
            return Err(Error::Patches {
                surface: self.name().to_owned(),
                expected: self.shape.patches(),
                got: self.patches.len(),
            });
        }
        for Patch { name, optics } in &self.patches {
            check_model(name, optics, [inner, outer])?;
        }
        Ok(())
    }
}

/// Checks the surface model of a patch between media of these indices, `None` where opaque.
fn check_model(
    name: &str,
    optics: &SurfaceModel,
    [inner, outer]: [Option<f64>; 2],
) -> Result<(), Error> {
    match optics {
        SurfaceModel::Mirror { reflectance } | SurfaceModel::Lambertian { reflectance } => {
            fraction(&format!("reflectance of '{name}'"), *reflectance)?;
        }
        SurfaceModel::Mixed(mixed) => {
            fraction(&format!("reflectance of '{name}'"), mixed.reflectance)?;
            fraction(&format!("specular share of '{name}'"), mixed.specular)?;
        }
        SurfaceModel::LayeredMirror(mirror) => {
            fraction(&format!("reflectance of '{name}'"), mirror.factor)?;
            check_index(&format!("refractive index under '{name}'"), mirror.substrate)?;
        }
        SurfaceModel::Absorber | SurfaceModel::Periodic | SurfaceModel::Coating(_) => {}
        SurfaceModel::Interface | SurfaceModel::Layered(_) | SurfaceModel::Scatter(_) => {
            let (Some(inner), Some(outer)) = (inner, outer) else {
                return Err(Error::OpaqueSide { surface: name.to_owned(), optics: optics.kind() });
            };
            if let SurfaceModel::Scatter(scatter) = optics {
                check_table(name, "inner", scatter.index(bsdf::Side::Inner), inner)?;
                check_table(name, "outer", scatter.index(bsdf::Side::Outer), outer)?;
            }
        }
        SurfaceModel::Printed(printed) => {
            check_model(name, &printed.base, [inner, outer])?;
            check_model(name, &printed.ink, [inner, outer])?;
        }
    }
    Ok(())
}

fn check_table(surface: &str, side: &'static str, table: f64, medium: f64) -> Result<(), Error> {
    if (table / medium - 1.0).abs() < 1e-6 {
        return Ok(());
    }
    Err(Error::IndexMismatch { surface: surface.to_owned(), side, table, medium })
}
