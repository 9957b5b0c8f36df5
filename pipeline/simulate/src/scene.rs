// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene of a design: packages, array, mirror, housing and solids, as the tracer takes them.
//!
//! The world is air over the plane z = 0. All packages are instances of one prototype, so light
//! crosses between them. The dome's meridian becomes one surface of revolution for each stretch of
//! straight pieces and one zoned sphere for each stretch of arcs; nothing is tessellated.

use std::sync::Arc;

use anyhow::{Context, Result};
use bsdf::Bsdf;
use tracer::glam::DVec3;
use tracer::housing::Housing;
use tracer::{
    Emission, Emitter, Interior, LedBox, Medium, Patch, Polarisation, Prototype, Region, Sampling,
    Scene, SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel,
};

use design::Design;
use design::resolved::dome::Dome;
use design::resolved::films::Coats;
use design::resolved::led::BoxPlace;
use design::resolved::reflector::Reflector;
use design::schema::{self, Extent};
use design::shapes;
use geometry::{Meridian, Piece, Role};
use metrics::kinds::Carrying;

use super::solids::{self, Bottom, BottomPart, Packages, Standing};

/// Ledger name of the dome's surface.
pub const DOME: &str = "dome";
/// Ledger name of the cylinder below it.
pub const CYLINDER: &str = "side";
/// Ledger name of the mirror under the dome.
const BOTTOM: &str = "bottom";
/// Ledger name of the first patch of the box.
const BOX_SIDE: &str = "box side";
/// Ledger name of elements made absorbing for Figures 3 and 4.
pub const MASK: &str = "mask";

/// True if a ledger line is a surface between silicone and air.
pub fn is_skin(name: &str) -> bool {
    name == DOME || name == CYLINDER
}

/// The surface of the dome, element by element.
#[derive(Clone)]
pub enum DomeSurface {
    /// A smooth or stepped meridian that refracts everywhere.
    Refracting(Meridian),
    /// One element (from 1) of a meridian refracts; all others and the cylinder absorb.
    Only(Meridian, usize),
    /// The smooth dome in bands with a BSDF each; `None` refracts.
    Banded(Meridian, Vec<Option<Arc<dyn Bsdf>>>),
    /// The dome in bands with BSDFs at several wavelengths in nm, of which light takes the one that is
    /// the nearest but so many.
    ByWavelength(Vec<(f64, Self)>, usize),
}

impl DomeSurface {
    /// The generating curve.
    pub fn meridian(&self) -> &Meridian {
        match self {
            Self::Refracting(m) | Self::Only(m, _) | Self::Banded(m, _) => m,
            Self::ByWavelength(all, _) => all[0].1.meridian(),
        }
    }

    /// The surface for light of a wavelength.
    fn at(&self, wavelength_nm: f64) -> &Self {
        let Self::ByWavelength(all, skipped) = self else { return self };
        let mut order: Vec<&(f64, Self)> = all.iter().collect();
        let distance = |at: &(f64, Self)| (at.0 - wavelength_nm).abs();
        order.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        &order[(*skipped).min(order.len() - 1)].1
    }

    /// The same with the BSDFs of the second nearest wavelength, where there are several: the change
    /// of what is seen estimates the error of the choice.
    pub fn second_nearest(&self) -> Option<Self> {
        match self {
            Self::ByWavelength(all, _) if all.len() > 1 => Some(Self::ByWavelength(all.clone(), 1)),
            _ => None,
        }
    }

    fn part(&self, role: Role) -> Patch {
        let refracting = || {
            Patch::new(
                if role == Role::Cylinder { CYLINDER } else { DOME },
                SurfaceModel::Interface,
            )
        };
        match (self, role) {
            (Self::Only(_, open), Role::Element(k)) if k == *open => refracting(),
            (Self::Only(..), _) => Patch::new(MASK, SurfaceModel::Absorber),
            (Self::Banded(_, bands), Role::Element(k)) => match &bands[k - 1] {
                Some(bsdf) => Patch::new(DOME, SurfaceModel::Scatter(Arc::clone(bsdf))),
                None => refracting(),
            },
            (Self::Refracting(_) | Self::Banded(..) | Self::ByWavelength(..), _) => refracting(),
        }
    }
}

/// The scene of `design` with `surface` on its domes; a bare package ignores it.
pub fn build(design: &Design, surface: &DomeSurface) -> Result<Scene> {
    let surface = surface.at(design.wavelength_nm);
    let mirror = mirror(design)?;
    let mut scene = SceneBuilder::new(Medium::air());
    let mut prototype = without_led(design, surface, &mirror)?;
    design.files.light_up(&mut prototype);
    if !design.sources.is_empty() {
        let emitters = design.sources.iter().flat_map(|s| &s.emitters);
        prototype.sources = emitters.map(|emitter| emitter.source.clone()).collect();
    }
    let bottom = bottom(design, &mirror);
    let packages = solids::add(design, &packages(design, &prototype)?, &bottom, &mut scene)?;
    scene.isolated(!design.array.crossing);
    for (package, [x, y]) in packages.into_iter().zip(design.array.axes_mm()) {
        scene.place(package, DVec3::new(x, y, 0.0));
    }
    if let Some(housing) = housing(design, &mirror) {
        for surface in housing.surfaces()? {
            scene.surface(surface);
        }
        return built(&scene, design);
    }
    let floor = SurfaceModel::Absorber;
    scene.surface(match design.mirror.extent {
        Extent::Array => {
            let [x, y] = mirror_half_mm(design);
            tracer::package::ground(x, y, mirror, floor)?
        }
        Extent::Package => {
            Surface::new("floor", Shape::horizontal(0.0)?, Region::Opaque, Region::World, &floor)
        }
    });
    built(&scene, design)
}

/// Refuses gaps between bodies that are too thin to be one, with `surface` on the domes.
///
/// # Errors
/// The solid that stands so near to something; solids that do not fit.
pub fn check_gaps(design: &Design, surface: &DomeSurface) -> Result<()> {
    if design.solids.is_empty() {
        return Ok(());
    }
    let mirror = mirror(design)?;
    let package = without_led(design, surface, &mirror)?;
    let package = with_led_at(design, &package, design.led.place(0))?;
    solids::check_gaps(design, &package, &bottom(design, &mirror))
}

/// What the solids of `design` stand on, and the narrow gaps between them, with `surface` on its
/// domes.
///
/// # Errors
/// Solids that do not fit.
pub fn standing(design: &Design, surface: &DomeSurface) -> Result<Standing> {
    if design.solids.is_empty() {
        return Ok(Standing::default());
    }
    let mirror = mirror(design)?;
    let packages = packages(design, &without_led(design, surface, &mirror)?)?;
    solids::standing(design, &packages, &bottom(design, &mirror))
}

/// The packages of `design`: `prototype` with its box where it stands in each, their turns and sizes.
fn packages(design: &Design, prototype: &Prototype) -> Result<Packages> {
    let (kinds, numbers) = design.package_kinds();
    let kinds = kinds
        .into_iter()
        .map(|(place, pose)| with_led_at(design, prototype, place).map(|kind| (kind, pose)));
    Ok(Packages { kinds: kinds.collect::<Result<_>>()?, numbers })
}

/// A package of `design` with its own source alone, and `surface` on its dome.
fn without_led(design: &Design, surface: &DomeSurface, mirror: &SurfaceModel) -> Result<Prototype> {
    let mut prototype = match &design.dome {
        Some(dome) => package(design, dome, surface, mirror)?,
        None => bare(design)?,
    };
    coat(design, &mut prototype)?;
    Ok(prototype)
}

/// `prototype`, whose box stands level about the axis, with its box at `place` and what emits on
/// it.
fn with_led_at(design: &Design, prototype: &Prototype, place: BoxPlace) -> Result<Prototype> {
    let mut seated = prototype.clone();
    if place == BoxPlace::default() {
        return Ok(seated);
    }
    let led = design.led.at(place);
    for surface in seated.surfaces.iter_mut().filter(|s| s.name() == BOX_SIDE) {
        surface.shape = led.shape(surface.shape.bounds().low.z)?;
    }
    for source in &mut seated.sources {
        // Sources that state a place keep it.
        let stated = design.sources.iter().find(|s| s.name() == source.name);
        if stated.is_none_or(|s| s.stated.kind.place().is_none()) {
            *source = led.carry(source.clone());
        }
    }
    Ok(seated)
}

/// Refractive index of the medium around the domes with relief; 1 without relief.
///
/// # Errors
/// Solids that do not fit, or packages in different media.
pub fn index_about_domes(design: &Design) -> Result<f64> {
    let entered = design.solids.iter().any(|solid| solid.medium.is_some());
    match &design.dome {
        Some(dome) if entered && design.has_relief() => {
            let surface = DomeSurface::Refracting(design.outline()?);
            let mirror = mirror(design)?;
            let package = package(design, dome, &surface, &mirror)?;
            let packages = packages(design, &package)?;
            solids::index_about_domes(design, &packages, &bottom(design, &mirror))
        }
        _ => Ok(1.0),
    }
}

/// Settings of a trace of `paths` paths through scenes of `design`.
pub fn settings(design: &Design, paths: u64, seed: u64) -> Settings {
    Settings {
        max_bounces: design.trace.max_interactions,
        polarisation: match design.polarization {
            Carrying::Unpolarised => Polarisation::Unpolarised,
            Carrying::Carried => Polarisation::Carried,
        },
        sampling: match design.trace.sampling {
            schema::Sampling::Random => Sampling::Random,
            schema::Sampling::Sobol => Sampling::Sobol,
        },
        ..Settings::new(paths, seed)
    }
}

/// The mirror: by a file, by films on metal, or by its reflectance.
fn mirror(design: &Design) -> Result<SurfaceModel> {
    let coats = design.films.as_ref().map(|films| &films.mirror);
    let unprinted = match design.files.mirror() {
        Some(of_file) => of_file,
        None => reflecting(design, design.mirror.reflector, coats)?,
    };
    Ok(design.printed_mirror(unprinted))
}

/// The top and the sides of the LED.
fn led_faces(design: &Design) -> Result<[SurfaceModel; 2]> {
    let films = design.films.as_ref();
    let top = design.led.reflector;
    let sides = design.led.sides.unwrap_or(top);
    Ok([
        reflecting(design, top, films.map(|films| &films.led_top))?,
        reflecting(design, sides, films.map(|films| &films.led_sides))?,
    ])
}

/// A reflector: by films on metal, or by its reflectance.
fn reflecting(
    design: &Design,
    reflector: Reflector,
    coats: Option<&Coats>,
) -> Result<SurfaceModel> {
    let metal = coats.map(|coats| coats.mirror(design.wavelength_nm, reflector.reflectance()));
    Ok(metal.transpose()?.flatten().unwrap_or_else(|| reflector.optics()))
}

/// Puts the thin films of the dome on every refracting patch.
fn coat(design: &Design, prototype: &mut Prototype) -> Result<()> {
    let Some(films) = &design.films else {
        return Ok(());
    };
    let Some(film) = films.dome.interface(design.wavelength_nm)? else {
        return Ok(());
    };
    let patches = prototype.surfaces.iter_mut().flat_map(|s| &mut s.patches);
    for patch in patches.filter(|patch| matches!(patch.optics, SurfaceModel::Interface)) {
        patch.optics = film.clone();
    }
    Ok(())
}

fn built(scene: &SceneBuilder, design: &Design) -> Result<Scene> {
    let scene = scene.build().with_context(|| format!("scene of {}", design.name))?;
    Ok(match &design.array.drives {
        Some(drives) => scene.driven(drives),
        None => scene,
    })
}

/// Half lengths of the mirror under the whole array, mm.
pub(crate) fn mirror_half_mm(design: &Design) -> [f64; 2] {
    design.cells_mm().map(|length| 0.5 * length)
}

/// Medium that a body on the bottom meets there.
fn bottom(design: &Design, mirror: &SurfaceModel) -> Bottom {
    let part =
        |name, half_mm, optics: &SurfaceModel| BottomPart { name, half_mm, optics: optics.clone() };
    let housing = housing(design, mirror);
    let within = |half: [f64; 2]| match &housing {
        Some(housing) => [0, 1].map(|k| half[k].min(housing.half[k])),
        None => half,
    };
    let mut outside = Vec::new();
    if design.mirror.extent == Extent::Array {
        let half = within(mirror_half_mm(design));
        outside.push(part("ground mirror", Some(half), mirror));
    }
    if let Some(housing) = &housing {
        outside.push(part("housing floor", Some(housing.half), &housing.floor));
    }
    outside.push(part("floor", None, &SurfaceModel::Absorber));
    Bottom { in_dome: part(BOTTOM, None, mirror), outside }
}

/// The housing with its floor, if the design has one.
fn housing(design: &Design, mirror: &SurfaceModel) -> Option<Housing> {
    let (stated, half) = (design.housing.as_ref()?, design.housing_half_mm()?);
    Some(Housing {
        half,
        height: stated.height_mm,
        thickness: stated.thickness_mm,
        walls: stated.reflector.optics(),
        floor: stated.floor.unwrap_or(Reflector::Absorbing).optics(),
        mirror: match design.mirror.extent {
            Extent::Array => Some((mirror_half_mm(design), mirror.clone())),
            Extent::Package => None,
        },
    })
}

/// A package with a dome: the tracer's own within `surface`.
fn package(
    design: &Design,
    dome: &Dome,
    surface: &DomeSurface,
    mirror: &SurfaceModel,
) -> Result<Prototype> {
    let led = &design.led;
    let [top, side] = led_faces(design)?;
    let size = DVec3::new(led.size_mm[0], led.size_mm[1], led.height_mm);
    let led = LedBox { size, side, top };
    let (rim, foot) = match dome {
        Dome::Sphere(sphere) => (sphere.radius_mm, sphere.height_at(sphere.radius_mm)),
        Dome::Meridian(curve) => {
            let last = curve.pieces.last();
            let cylinder = last.filter(|piece| piece.role == Role::Cylinder);
            (curve.end_mm()[0], cylinder.map_or(0.0, |piece| piece.start[1]))
        }
        Dome::Mesh(_) => (dome.radius_mm(), 0.0),
    };
    let interior = Interior {
        rim,
        foot,
        size: dome.radius_mm().max(dome.height_mm()),
        silicone: design.silicone.to_tracer("silicone"),
        side: surface.part(Role::Cylinder).optics,
        bottom: mirror.clone(),
        led,
    };
    let mut prototype = interior.prototype()?;
    if let Dome::Mesh(mesh) = dome {
        // Dome and bottom in one solid; the box stays.
        prototype.surfaces.retain(|s| s.name() != BOTTOM);
        let parts =
            vec![Patch::new(DOME, SurfaceModel::Interface), Patch::new(BOTTOM, mirror.clone())];
        let (inner, outer) = (tracer::package::SILICONE, Region::World);
        prototype.surfaces.push(Surface::zoned(mesh.shape.clone(), inner, outer, parts));
    } else {
        prototype.surfaces.extend(dome_surfaces(surface)?);
    }
    Ok(prototype)
}

/// The box alone, in air.
fn bare(design: &Design) -> Result<Prototype> {
    let led = &design.led;
    let half = DVec3::new(0.5 * led.size_mm[0], 0.5 * led.size_mm[1], 0.0);
    let solid = Shape::cuboid(-half, half + DVec3::Z * led.height_mm)?;
    let [top, side] = led_faces(design)?;
    let sides = Patch::new(BOX_SIDE, side);
    let parts = vec![sides.clone(), Patch::new("box top", top), sides];
    let emitter = Emitter::Rectangle { half_x: half.x, half_y: half.y };
    let source =
        Source::new("LED", DVec3::Z * led.height_mm, Region::World, emitter, Emission::LAMBERTIAN);
    Ok(Prototype {
        media: Vec::new(),
        surfaces: vec![Surface::zoned(solid, Region::Opaque, Region::World, parts)],
        sources: vec![source],
    })
}

/// Surfaces of the dome from the axis outwards, without the cylinder.
fn dome_surfaces(surface: &DomeSurface) -> Result<Vec<Surface>> {
    let pieces: Vec<&Piece> =
        surface.meridian().pieces.iter().filter(|p| p.role != Role::Cylinder).collect();
    let (inner, outer) = (tracer::package::SILICONE, Region::World);
    let runs = shapes::runs(&pieces)?.into_iter();
    let zoned = |(shape, roles): (Shape, Vec<Role>)| {
        let parts = roles.into_iter().map(|role| surface.part(role)).collect();
        Surface::zoned(shape, inner, outer, parts)
    };
    Ok(runs.map(zoned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    use geometry::profile::Shape as Relief;

    fn extraction(design: &Design, surface: &DomeSurface) -> tracer::Estimate {
        let scene = build(design, surface).expect("valid scene");
        let outcome = tracer::run(&scene, &[], &tracer::Settings::new(200_000, 7)).expect("runs");
        assert!(outcome.total.ledger.imbalance().abs() < 1e-9);
        assert!(outcome.total.ledger.lost_total() < 1e-4, "{:?}", outcome.total.ledger.lost);
        outcome.jackknife(|t| t.ledger.extraction())
    }

    fn stepped(design: &Design) -> Meridian {
        Meridian::stepped(design.sphere().expect("a sphere"), &design.elements).expect("valid")
    }

    #[test]
    fn smooth_elements_are_the_smooth_dome() {
        let bare = design::embedded("bare-dome.toml").expect("valid");
        let mut zoned = bare.clone();
        zoned.elements = geometry::profile::Elements {
            width_mm: 0.1,
            shapes: vec![Relief::Smooth; 17],
            rounding: geometry::profile::Rounding::default(),
        };
        let a = extraction(&bare, &DomeSurface::Refracting(stepped(&bare)));
        let b = extraction(&zoned, &DomeSurface::Refracting(stepped(&zoned)));
        assert!(
            (a.value - b.value).abs() < 5.0 * a.standard_error.hypot(b.standard_error),
            "{a:?} {b:?}"
        );
    }

    #[test]
    fn relief_may_alternate_with_smooth_elements() {
        let mut design = design::embedded("d3.toml").expect("valid");
        for k in (0..17).step_by(3) {
            design.elements.shapes[k] = Relief::Smooth;
        }
        let e = extraction(&design, &DomeSurface::Refracting(stepped(&design)));
        assert!(e.value > 0.9 && e.value < 1.0, "{e:?}");
    }

    #[test]
    fn one_open_element_lets_little_out() {
        let design = design::embedded("d1.toml").expect("valid");
        let all = extraction(&design, &DomeSurface::Refracting(stepped(&design)));
        let one = extraction(&design, &DomeSurface::Only(stepped(&design), 6));
        assert!(one.value > 0.01 && one.value < 0.3 * all.value, "{one:?} of {all:?}");
    }

    #[test]
    fn smooth_interface_in_bands_is_the_smooth_dome() {
        let design = design::embedded("bare-dome.toml").expect("valid");
        let dome = design.sphere().expect("a sphere");
        let ends: Vec<f64> = (1..=17).map(|k| 0.1 * f64::from(k)).collect();
        let interface = bsdf::SmoothInterface::new(1.41, 1.0).expect("valid");
        let shared: Arc<dyn Bsdf> = Arc::new(interface);
        let bands = vec![Some(shared); 17];
        let a = extraction(&design, &DomeSurface::Banded(Meridian::banded(dome, &ends), bands));
        let b = extraction(&design, &DomeSurface::Refracting(stepped(&design)));
        assert!(
            (a.value - b.value).abs() < 5.0 * a.standard_error.hypot(b.standard_error),
            "{a:?} {b:?}"
        );
    }
}
