// SPDX-License-Identifier: MIT OR Apache-2.0
//! The films of a design as one layer: whether light that meets them takes an outcome of a table, and
//! the films alone, of which the tracer draws the outcomes.

use anyhow::Result;
use serde_json::{Value, json};
use tracer::glam::DVec3;
use tracer::random;
use tracer::receiver::{Sense, underscored};
use tracer::shape::{Extent, Plane};
use tracer::{
    Emission, Emitter, FilmTable, Filter, Measurement, Medium, Passage, Patch, Prototype, Region,
    Scene, SceneBuilder, Shape, Source, StackBorder, StackSymmetry, Surface, SurfaceModel, Viewer,
};

use design::Design;
use design::resolved::dome::Dome;
use design::resolved::reflector::Reflector;
use design::resolved::solids::{CheckedSolid, LEAST_MM, Orientation};
use design::resolved::sources::Part;
use design::schema::FilmTracing;
use design::schema::prints::Print;
use design::schema::solids::Per;
use metrics::kinds::Carrying;
use runtime::store::program_sha256;

/// Half the lengths of films without ends, mm.
const ENDLESS_MM: f64 = 1e4;
/// Name of the walls of the housing in the ledger.
const WALL: &str = "wall";
/// Lengths and heights that differ by less are equal, mm.
const SAME_MM: f64 = 1e-6;
/// Directions that differ by less are equal, degrees.
const SAME_DEG: f64 = 1e-9;

/// Length of the mean direction of light above which it fills a few cells of incidence alone: that of
/// the thirteenth power of a cosine, 14/15. As many directions are drawn of a source.
const NARROW_MEAN: f64 = 14.0 / 15.0;
const DRAWN: u32 = 1024;
/// Receivers of every run, before those of the design: far field and plane.
pub(super) const BUILT_IN: usize = 2;
/// Half the angle of cones into which light is followed as a share of its own, at most, degrees.
const NARROW_DEG: f64 = 30.0;

/// Treatment of the films of a design.
#[derive(Debug, Clone, PartialEq)]
pub enum FilmTreatment {
    /// There are none.
    NoFilms,
    /// Light takes an outcome of a table.
    Table(FilmStack),
    /// Light is traced film by film, and why.
    Traced(String),
}

impl FilmTreatment {
    /// In words; `None` without films.
    pub fn describe(&self) -> Option<String> {
        match self {
            Self::NoFilms => None,
            Self::Table(stack) => Some(stack.describe()),
            Self::Traced(why) => Some(format!("film by film: {why}")),
        }
    }
}

/// The stack that a table stands for.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmStack {
    /// Heights of the lowest and of the highest face, mm.
    ends_mm: [f64; 2],
    /// Lengths along x and y, mm.
    size_mm: [f64; 2],
    symmetry: StackSymmetry,
    borders: [StackBorder; 2],
}

/// The treatment of the films of `design`.
pub fn treatment(design: &Design) -> FilmTreatment {
    let films: Vec<&CheckedSolid> = design.solids.iter().filter(|solid| solid.is_film()).collect();
    let ends: Vec<_> = films.iter().filter_map(|film| film.film_mm()).collect();
    let (Some(([low, _], size_mm)), Some(([_, high], _))) = (ends.first(), ends.last()) else {
        return FilmTreatment::NoFilms;
    };
    let ends_mm = [*low, *high];
    let why = (design.trace.films == FilmTracing::Traced)
        .then(|| "trace.films = \"traced\"".to_owned())
        .or_else(|| other_lengths(&films, *size_mm))
        .or_else(|| printed_film(design))
        .or_else(|| body_in_stack(design, ends_mm))
        .or_else(|| reading_in_stack(design, &films, ends_mm))
        .or_else(|| narrow_source(design))
        .or_else(|| clear_lowest(&films))
        .or_else(|| light_from_mirrors(design));
    if let Some(why) = why {
        return FilmTreatment::Traced(why);
    }
    let symmetry = symmetry(&films);
    FilmTreatment::Table(FilmStack {
        ends_mm,
        size_mm: *size_mm,
        symmetry,
        borders: borders(design, *size_mm, *high, symmetry),
    })
}

/// The film whose lengths the fewest others share, of several the last, if some differ.
pub(super) fn other_lengths(films: &[&CheckedSolid], size_mm: [f64; 2]) -> Option<String> {
    let is_alike = |film: &CheckedSolid, lengths_mm: [f64; 2]| {
        let own = film.film_mm().map(|(_, own)| own);
        own.is_some_and(|own| (0..2).all(|k| is_same_length(own[k], lengths_mm[k])))
    };
    let alike = |lengths_mm| films.iter().filter(|film| is_alike(film, lengths_mm)).count();
    if alike(size_mm) == films.len() {
        return None;
    }
    let film = films.iter().rev().min_by_key(|film| film.film_mm().map(|(_, own)| alike(own)))?;
    Some(format!("film {:?} has lengths of its own", film.name()))
}

/// A film that is not the same everywhere.
pub(super) fn printed_film(design: &Design) -> Option<String> {
    let print = design.prints.iter().find(|print| print.stated.on != Print::MIRROR)?;
    Some(format!("{} differs from place to place", print.name()))
}

/// True of a stretch of heights that reaches into the stack.
fn is_in([low, high]: [f64; 2], [from, to]: [f64; 2]) -> bool {
    to > low + SAME_MM && from < high - SAME_MM
}

/// A package, a solid or a source that reaches into the stack, or a solid in contact with it.
pub(super) fn body_in_stack(design: &Design, ends_mm: [f64; 2]) -> Option<String> {
    if is_in(ends_mm, [f64::NEG_INFINITY, top_mm(design)]) {
        return Some("a package reaches into the films".to_owned());
    }
    let around_mm = [ends_mm[0] - LEAST_MM, ends_mm[1] + LEAST_MM];
    let touches = |solid: &&CheckedSolid| {
        let shape = solid.form.shape(0.0);
        shape.is_ok_and(|shape| is_in(around_mm, [shape.bounds().low.z, shape.bounds().high.z]))
    };
    let mut others =
        design.solids.iter().filter(|solid| !solid.is_film() && solid.per() == Per::Array);
    if let Some(solid) = others.find(touches) {
        return Some(format!("solid {:?} stands in, between or against films", solid.name()));
    }
    let mut emitters = design.sources.iter().flat_map(|source| &source.emitters);
    let scales = design.array.scale_range();
    emitters
        .any(|emitter| is_in(ends_mm, scales.map(|scale| scale * emitter.source.position.z)))
        .then(|| "a source shines between films".to_owned())
}

/// A receiver that reads light within the stack, or the past of light.
fn reading_in_stack(design: &Design, films: &[&CheckedSolid], ends_mm: [f64; 2]) -> Option<String> {
    if is_in(ends_mm, [design.receiver.plane_height_mm; 2]) {
        return Some("the plane of the receiver lies between films".to_owned());
    }
    design.receivers.iter().find_map(|receiver| {
        let is_read = match &receiver.detector.measurement {
            Measurement::Plane(at) | Measurement::Luminance(at, _) => {
                is_in(ends_mm, [at.bounds().low.z, at.bounds().high.z])
            }
            Measurement::Flux(name) => {
                let of_films = films.iter().map(|film| film.name());
                of_films.chain([WALL]).any(|known| underscored(known) == underscored(name))
            }
            Measurement::FarField(_) => false,
        };
        let Filter { sources: _, ref last_surface, last_radii_mm, bounces } =
            receiver.detector.filter;
        let is_of_past = last_surface.is_some()
            || last_radii_mm.is_some()
            || bounces != Filter::default().bounces;
        let name = receiver.name();
        if is_read {
            Some(format!("receiver {name:?} lies between films, on one or on the walls"))
        } else {
            is_of_past.then(|| format!("receiver {name:?} asks for the past"))
        }
    })
}

/// Light of the LED or of a source that fills few cells of incidence, which the table would widen.
fn narrow_source(design: &Design) -> Option<String> {
    let is_narrow = |source: &Source| {
        let mut rng = random::stream(0, 0);
        let directions = (0..DRAWN).map(|_| source.sample(0.0, &mut rng).direction);
        directions.sum::<DVec3>().length() > NARROW_MEAN * f64::from(DRAWN)
    };
    let emission = |part: &Part| {
        let (place, medium) = (DVec3::ZERO, Region::World);
        Source::new("LED", place, medium, Emitter::Point, part.emission.clone())
    };
    if design.files.parts().iter().any(|part| is_narrow(&emission(part))) {
        return Some("the light of the LED is narrow".to_owned());
    }
    let narrow = design
        .sources
        .iter()
        .find(|source| source.emitters.iter().any(|emitter| is_narrow(&emitter.source)))?;
    Some(format!("the light of source {:?} is narrow", narrow.name()))
}

/// A lowest film that lets light through as it came. Prisms send light back the way it came, and mirrors
/// send it to them at the same angle again: no cell of incidence holds that.
fn clear_lowest(films: &[&CheckedSolid]) -> Option<String> {
    let clear = films.first().filter(|lowest| !lowest.diffuses())?;
    Some(format!(
        "the lowest film {:?} does not diffuse light, which comes back as it came",
        clear.name()
    ))
}

/// Light that carries its polarisation and comes back from mirrors: outcomes keep what it has of Q
/// alone.
fn light_from_mirrors(design: &Design) -> Option<String> {
    let is_met = design.polarization == Carrying::Carried && mirrors_light(design);
    is_met.then(|| "light that carries its polarisation comes back from mirrors".to_owned())
}

/// True if two lengths are the same, mm.
fn is_same_length(a: f64, b: f64) -> bool {
    (a - b).abs() < SAME_MM
}

/// True if films of these lengths fill what the walls of `design` leave.
pub(super) fn fills(design: &Design, size_mm: [f64; 2]) -> bool {
    let half = design.housing_half_mm();
    half.is_some_and(|half| (0..2).all(|axis| is_same_length(size_mm[axis], 2.0 * half[axis])))
}

/// True if something beside the films sends light back without depolarising it.
fn mirrors_light(design: &Design) -> bool {
    let is_mirror = |reflector: Reflector| match reflector {
        Reflector::Specular { reflectance } => reflectance > 0.0,
        Reflector::Mixed { specular_fraction, .. } => specular_fraction > 0.0,
        Reflector::Lambertian { .. } | Reflector::Absorbing | Reflector::Periodic => false,
    };
    let housing = design.housing.as_ref();
    let of_housing = housing.into_iter().flat_map(|h| [Some(h.reflector), h.floor]).flatten();
    let own = [design.mirror.reflector, design.led.reflector].into_iter().chain(design.led.sides);
    let mut reflectors = own.chain(of_housing);
    let mut solids = design.solids.iter().filter(|solid| !solid.is_film());
    reflectors.any(is_mirror)
        || design.files.mirror().is_some()
        || solids.any(|solid| solid.medium.is_none() && !solid.is_diffuse())
}

/// Height of the highest body of a package, mm.
fn top_mm(design: &Design) -> f64 {
    let own = design.dome.as_ref().map_or(0.0, Dome::height_mm).max(design.led.height_mm);
    let of_package = design.solids.iter().filter(|solid| solid.per() == Per::Package);
    let tops = of_package.filter_map(|solid| Some(solid.form.shape(0.0).ok()?.bounds().high.z));
    let [_, scale] = design.array.scale_range();
    scale * tops.fold(own, f64::max)
}

/// The symmetry of all films together.
fn symmetry(films: &[&CheckedSolid]) -> StackSymmetry {
    let mut axis_deg = None;
    let mut symmetry = StackSymmetry::Round;
    for orientation in films.iter().flat_map(|film| film.orientations()) {
        match (orientation, axis_deg) {
            (Orientation::Round, _) => {}
            (Orientation::Directed, _) => return StackSymmetry::None,
            (Orientation::Axis(deg), None) => {
                axis_deg = Some(deg.rem_euclid(90.0));
                symmetry = StackSymmetry::Mirrors(deg.rem_euclid(90.0).to_radians());
            }
            (Orientation::Axis(deg), Some(first)) => {
                let apart = (deg - first).rem_euclid(90.0);
                if apart.min(90.0 - apart) > SAME_DEG {
                    symmetry = StackSymmetry::HalfTurn;
                }
            }
        }
    }
    symmetry
}

/// What ends films of these lengths that reach up to `high_mm`.
fn borders(
    design: &Design,
    size_mm: [f64; 2],
    high_mm: f64,
    symmetry: StackSymmetry,
) -> [StackBorder; 2] {
    let housing = design.housing.as_ref().filter(|housing| housing.height_mm >= high_mm);
    let is_periodic = housing.is_some_and(|housing| housing.reflector == Reflector::Periodic);
    // Edges of plates at mirrors reflect totally and change the polarisation.
    let keeps_light = design.polarization == Carrying::Unpolarised
        || design.solids.iter().filter(|solid| solid.is_film()).all(|film| {
            film.medium.as_ref().is_none_or(|medium| (medium.index - 1.0).abs() < SAME_MM)
        });
    let is_own_image = match symmetry {
        StackSymmetry::Round => true,
        StackSymmetry::Mirrors(axis) => axis == 0.0,
        StackSymmetry::HalfTurn | StackSymmetry::None => false,
    };
    let mirrors = housing
        .is_some_and(|housing| housing.reflector == Reflector::Specular { reflectance: 1.0 });
    let border = if is_periodic && fills(design, size_mm) {
        StackBorder::Periodic
    } else if is_own_image && keeps_light && mirrors && fills(design, size_mm) {
        StackBorder::Mirror
    } else {
        StackBorder::Edge
    };
    [border; 2]
}

impl FilmStack {
    /// Symmetry and ends, in words.
    fn describe(&self) -> String {
        let symmetry = match self.symmetry {
            StackSymmetry::Round => "alike from all azimuths",
            StackSymmetry::Mirrors(_) => "with two mirror planes",
            StackSymmetry::HalfTurn => "alike after half a turn",
            StackSymmetry::None => "without symmetry",
        };
        let ends = match self.borders {
            [StackBorder::Mirror, StackBorder::Mirror] => "mirrored by the walls",
            [StackBorder::Periodic, StackBorder::Periodic] => "without ends",
            _ => "film by film at their ends",
        };
        format!(
            "by a table of the whole stack ({symmetry}, {ends}), drawn as light asks for it; trace.films = \"traced\" traces film by film"
        )
    }

    /// The table, of the design at each wavelength of its trace; `planes` between films are numbers of
    /// receivers with heights, mm, and ways.
    ///
    /// # Errors
    /// Scattering that does not fit the media.
    pub fn table(&self, designs: &[Design], planes: &[(usize, f64, Sense)]) -> Result<FilmTable> {
        let [low, high] = self.ends_mm;
        let ends = designs[0].solids.iter().filter_map(CheckedSolid::film_mm);
        let tops: Vec<f64> = ends.map(|([_, top], _)| top).collect();
        let inside = planes.iter().filter(|(_, z, _)| *z > low && *z < high);
        let passage = |(receiver, z, sense): &(usize, f64, Sense)| {
            let gap = tops.iter().filter(|top| *top < z).count() - 1;
            Passage { receiver: *receiver, gap, z_mm: z - low, sense: *sense }
        };
        let (viewers, cones): (Vec<Option<Viewer>>, Vec<f64>) =
            narrow_cones(&designs[0], high).into_iter().unzip();
        // Light traced backwards has no polarisation at its receiver.
        let viewers: Option<Vec<Viewer>> = viewers.into_iter().collect();
        Ok(FilmTable {
            scenes: designs.iter().map(|design| alone(design, low)).collect::<Result<_>>()?,
            passages: inside.map(passage).collect(),
            low_mm: low,
            symmetry: self.symmetry,
            half_mm: self.size_mm.map(|length| 0.5 * length),
            borders: self.borders,
            seen_sin2: cones.into_iter().fold(0.0, f64::max),
            viewers: viewers.unwrap_or_default(),
        })
    }

    /// All that outcomes depend on, of the same designs.
    ///
    /// # Errors
    /// A program that cannot be read.
    pub fn key_fields(&self, designs: &[Design], seed: u64) -> Result<Value> {
        let low = self.ends_mm[0];
        let films = designs[0].solids.iter().filter_map(CheckedSolid::film_mm);
        let heights: Vec<[f64; 2]> =
            films.map(|(ends, _)| ends.map(|z| level_mm(z - low))).collect();
        let media = designs.iter().map(|design| {
            let media = design.solids.iter().filter(|solid| solid.is_film()).map(|film| {
                let medium = film.medium.as_ref();
                medium.map(|medium| format!("{:?}", medium.to_tracer(film.name()).luminophores))
            });
            media.collect::<Vec<_>>()
        });
        Ok(json!({
            "films": designs.iter().map(Design::film_fields).collect::<Vec<_>>(),
            "luminophores": media.collect::<Vec<_>>(),
            "heights_mm": heights,
            "symmetry": format!("{:?}", self.symmetry),
            "seed": seed,
            // Another one may draw other outcomes.
            "program": program_sha256()?,
        }))
    }
}

/// Receivers of `design` above the films that look into a narrow cone about z, each with the sine squared
/// of its half angle; `None` of one that reads polarisation.
fn narrow_cones(design: &Design, high_mm: f64) -> Vec<(Option<Viewer>, f64)> {
    let cones = design.receivers.iter().enumerate().filter_map(|(number, receiver)| {
        let Measurement::Luminance(at, angles) = &receiver.detector.measurement else {
            return None;
        };
        let is_above = at.axes()[2].z > 0.5 && at.bounds().low.z > high_mm - SAME_MM;
        let end_deg = angles.theta_edges_deg().last().copied()?;
        let is_narrow = !angles.has_view() && end_deg <= NARROW_DEG;
        let viewer =
            Viewer { receiver: BUILT_IN + number, ends_mm: at.ends_mm(), z_mm: at.bounds().low.z };
        let viewer = (!receiver.detector.stokes).then_some(viewer);
        (is_above && is_narrow).then(|| (viewer, end_deg.to_radians().sin().powi(2)))
    });
    cones.collect()
}

/// A height over the lowest face without the rounding of sums, mm.
fn level_mm(z_mm: f64) -> f64 {
    (z_mm * 1e9).round() / 1e9
}

/// The interface of the film `number` and the next one, in optical contact: that of the film which
/// displaces the other.
fn interface(
    design: &Design,
    films: &[&CheckedSolid],
    number: usize,
    z_mm: f64,
) -> Result<Surface> {
    let is_below = !films[number].stated.shared.optical_contact.names(films[number + 1].name());
    let (face, normal, own, other) = if is_below {
        (0, DVec3::Z, number, number + 1)
    } else {
        (1, DVec3::NEG_Z, number + 1, number)
    };
    let extent = Extent::Rectangle { half_u: ENDLESS_MM, half_v: ENDLESS_MM };
    let shape = Shape::Plane(Plane::new(z_mm * DVec3::Z, normal, extent)?);
    let index = |film: usize| films[film].medium.as_ref().map_or(1.0, |medium| medium.index);
    let optics = films[own].face(face, &shape, design.wavelength_nm, [index(own), index(other)])?;
    let sides = [own, other].map(|film| Region::Body(film as u8));
    let optics = optics.unwrap_or(SurfaceModel::Interface);
    Ok(Surface::new(films[own].name(), shape, sides[0], sides[1], &optics))
}

/// The films of `design` alone and without ends, the lowest face at the height 0.
pub(super) fn alone(design: &Design, low_mm: f64) -> Result<Scene> {
    let mut body = Prototype::default();
    let films: Vec<&CheckedSolid> = design.solids.iter().filter(|solid| solid.is_film()).collect();
    let joins = |k: usize| films.get(k + 1).is_some_and(|above| films[k].joins(above));
    for (number, film) in films.iter().enumerate() {
        let (Some((ends, _)), Some(medium)) = (film.film_mm(), &film.medium) else { continue };
        let [low, high] = ends.map(|z| level_mm(z - low_mm));
        let across = |sign: f64, z: f64| DVec3::new(sign * ENDLESS_MM, sign * ENDLESS_MM, z);
        let shape = Shape::cuboid(across(-1.0, low), across(1.0, high))?;
        let faces = [!joins(number), !number.checked_sub(1).is_some_and(joins)];
        let optics = film.patches(&shape, design.wavelength_nm, [medium.index, 1.0], faces)?;
        let patches = optics.into_iter().map(|optics| Patch::new(film.name(), optics)).collect();
        body.media.push(medium.to_tracer(film.name()));
        let inside = Region::Body(number as u8);
        body.surfaces.push(Surface::zoned(shape, inside, Region::World, patches));
        if joins(number) {
            body.surfaces.push(interface(design, &films, number, high)?);
        }
    }
    let mut scene = SceneBuilder::new(Medium::air());
    let body = scene.prototype(body);
    // A scene has a source; outcomes begin at the outer faces.
    let below = DVec3::new(0.0, 0.0, -1.0);
    let source = Source::new("light", below, Region::World, Emitter::Point, Emission::Isotropic);
    Ok(scene.source(source).place(body, DVec3::ZERO).build()?)
}
