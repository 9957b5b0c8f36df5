// SPDX-License-Identifier: MIT OR Apache-2.0
//! Solids of a design as surfaces of the scene, each between its own medium and its surroundings.
//!
//! Points just inside every surface tell which solid holds which: a solid lies in all those that
//! hold all of its points, and the innermost of these surrounds it. The order of the tables in the
//! design means nothing. Solids that overlap partly come out as neighbours; the scene refuses their
//! crossing with a place.
//!
//! Between a solid and what it stands on or touches there is a gap, unless the design asks for
//! optical contact: with the bottom (`contact`), with other solids (`touching`). A sheet lies on the
//! outer side of the face in which it is stated: those on the bottom are lifted into that gap.

mod contact;
mod nesting;
mod thin_gaps;
mod touching;

use std::collections::BTreeMap;

use anyhow::Result;
pub use contact::{Bottom, BottomPart};
use contact::{Coverage, Covered, covered, plates};
use nesting::{NestedObject, NestedPlace, Nesting};
use rayon::prelude::*;
use serde::Serialize;
pub use thin_gaps::check_gaps;
pub use touching::NARROW_MM;
pub(super) use touching::surface_points;
use touching::{Displacement, NarrowGap, narrow_gaps};
use tracer::glam::{DVec2, DVec3};
use tracer::{
    Containment, Patch, Prototype, PrototypeId, Region, SceneBuilder, Shape, Surface, SurfaceModel,
    Surroundings,
};

use design::resolved::array::Pose;
use design::resolved::dome::Dome;
use design::resolved::solids::{self, CheckedSolid};
use design::schema::solids::Per;
use design::{ConfigError, Design};
use metrics::digits::shortest;

use super::film_table::fills;

/// Distance by which the outer faces of a solid are drawn in, as a share of the size of the scene,
/// for every solid that it lies in: a thousand times the offset of a ray's start from a surface.
const INSET: f64 = 1e-9;

/// The error of a value that does not fit the scene of `design`.
pub(super) fn refused(
    design: &Design,
    key: impl Into<String>,
    got: impl Into<String>,
    expected: impl Into<String>,
) -> ConfigError {
    let file = design.provenance.file.clone();
    ConfigError::Value { file, key: key.into(), got: got.into(), expected: expected.into() }
}

/// The error of an optical contact that does not fit.
fn contact_refused(placing: &Placing, solid: &CheckedSolid, expected: String) -> ConfigError {
    let key = format!("{}.optical_contact", solid.table);
    refused(placing.design, key, solid.stated.shared.optical_contact.shown(), expected)
}

/// Placement of all solids of a design.
struct Placing<'a> {
    design: &'a Design,
    bottom: &'a Bottom,
    /// Distance by which faces are drawn in, mm.
    inset_mm: f64,
}

impl<'a> Placing<'a> {
    fn new(design: &'a Design, bottom: &'a Bottom) -> Self {
        Self { design, bottom, inset_mm: INSET * extent_mm(design) }
    }

    /// The same before a package is scaled, after which its faces are drawn in as all others.
    fn within(&self, pose: Pose) -> Self {
        Self { inset_mm: self.inset_mm / pose.scale, ..*self }
    }
}

/// A solid that light enters and that stands on the bottom with a flat face.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SolidOnBottom {
    /// Name.
    pub name: String,
    /// The parts of the bottom that it touches; none across a gap.
    pub touches: Vec<&'static str>,
    /// The medium in the gap, or around the solid.
    pub around: String,
}

impl SolidOnBottom {
    /// Place of the solid, in words.
    pub fn describe(&self) -> String {
        let Self { name, touches, around } = self;
        if touches.is_empty() {
            format!("{name} stands above a gap of {around}")
        } else {
            format!("{name} is in optical contact with {}", touches.join(" and "))
        }
    }
}

/// A gap between two bodies that is narrower than [`NARROW_MM`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gap {
    /// The bodies.
    pub between: [String; 2],
    /// Least width, mm; 0 where they touch.
    pub width_mm: f64,
    /// The medium in it.
    pub of: String,
    /// True where the second body is a film, which states no optical contact itself.
    #[serde(skip)]
    pub is_with_film: bool,
}

impl Gap {
    /// The gap in words, with what closes it.
    pub fn describe(&self) -> String {
        let Self { between: [first, second], width_mm, of, is_with_film } = self;
        let stands = if *width_mm > 0.0 {
            // Found by lines, to some per cent.
            let width = format!("{width_mm:.1e}").parse().unwrap_or(*width_mm);
            format!("a gap of {of}, {} mm wide", shortest(width))
        } else {
            format!("they touch, and a gap of {of} is kept")
        };
        let closes = if first == "the LED" {
            format!("{second} wets it where it holds the LED's box")
        } else if *is_with_film {
            format!("where {first} meets it, optical_contact = \"all\" under {first} closes it")
        } else if *width_mm > 0.0 {
            format!("to wet it, let {second} reach into {first} and write optical_contact")
        } else {
            format!("optical_contact = [{first:?}] under {second} closes it")
        };
        format!("{first} and {second}: {stands}; {closes}")
    }
}

/// Contacts and narrow gaps of the solids of a design.
#[derive(Debug, Clone, Default)]
pub struct Standing {
    /// Solids that light enters and that stand on the bottom, in the order of the design.
    pub on_bottom: Vec<SolidOnBottom>,
    /// Gaps narrower than [`NARROW_MM`].
    pub gaps: Vec<Gap>,
}

impl Standing {
    /// Names and words, a line each.
    pub fn describe(&self) -> Vec<(&'static str, String)> {
        let on_bottom = self.on_bottom.iter().map(|solid| ("bottom", solid.describe()));
        on_bottom.chain(self.gaps.iter().map(|gap| ("gap", gap.describe()))).collect()
    }
}

/// Packages without the solids of the design.
pub struct Packages {
    /// Those that differ as they are stated, each with its turn and its size.
    pub kinds: Vec<(Prototype, Pose)>,
    /// The number of the kind of every package, in order.
    pub numbers: Vec<usize>,
}

/// Adds the packages of `design` (`packages` with their solids) and the solids of the array to the
/// scene; returns the prototype of every package in order.
///
/// # Errors
/// Solids within an opaque one or in the place of another, sheets in a surface, scattering that
/// does not fit the media, sources that name another medium.
pub fn add(
    design: &Design,
    packages: &Packages,
    bottom: &Bottom,
    scene: &mut SceneBuilder,
) -> Result<Vec<PrototypeId>> {
    let Packages { kinds, numbers } = packages;
    if design.solids.is_empty() {
        let kinds =
            kinds.iter().map(|(kind, pose)| Ok(scene.prototype(posed(kind.clone(), *pose)?)));
        let kinds: Vec<PrototypeId> = kinds.collect::<Result<_>>()?;
        return Ok(numbers.iter().map(|number| kinds[*number]).collect());
    }
    let placing = Placing::new(design, bottom);
    let outlines = outlines(&placing, kinds)?;
    let mut array = Prototype::default();
    let depths = place_solids(&placing, Per::Array, &mut array, Some(AIR))?.depths;
    let holders = enclosing_solids(design, |package| &outlines[numbers[package]], &array)?;
    if !array.surfaces.is_empty() {
        let array = scene.prototype(array);
        scene.array_solids(array);
    }
    let mut known: BTreeMap<(Option<&str>, usize), PrototypeId> = BTreeMap::new();
    let mut packages = Vec::with_capacity(numbers.len());
    for (holder, number) in holders.into_iter().zip(numbers) {
        let held = (holder.map(CheckedSolid::name), *number);
        let id = if let Some(id) = known.get(&held) {
            *id
        } else {
            let (mut body, pose) = kinds[*number].clone();
            let outside = outside(holder, &depths);
            place_solids(&placing.within(pose), Per::Package, &mut body, Some(outside))?;
            sources_fit(design, holder)?;
            let id = scene.prototype(posed(body, pose)?);
            known.insert(held, id);
            id
        };
        packages.push(id);
    }
    Ok(packages)
}

/// A package as it stands.
fn posed(package: Prototype, Pose { turn_deg, scale }: Pose) -> Result<Prototype> {
    Ok(package.scaled(scale)?.turned(turn_deg)?)
}

/// The kinds of packages with their solids, turned and scaled as they stand.
fn outlines(placing: &Placing, kinds: &[(Prototype, Pose)]) -> Result<Vec<Prototype>> {
    let outline = |(kind, pose): &(Prototype, Pose)| {
        let mut outline = kind.clone();
        place_solids(&placing.within(*pose), Per::Package, &mut outline, None)?;
        posed(outline, *pose)
    };
    kinds.iter().map(outline).collect()
}

/// Refractive index of the medium around the domes of `design`; `packages` have no solids yet.
///
/// # Errors
/// Solids that [`add`] refuses; packages in different media.
pub fn index_about_domes(design: &Design, packages: &Packages, bottom: &Bottom) -> Result<f64> {
    let placing = Placing::new(design, bottom);
    let Packages { kinds, numbers } = packages;
    let mut outline = kinds[0].0.clone();
    let put = place_solids(&placing, Per::Package, &mut outline, None)?;
    if let Region::Body(medium) = put.about_dome {
        return Ok(outline.media[usize::from(medium)].index);
    }
    let mut array = Prototype::default();
    place_solids(&placing, Per::Array, &mut array, Some(AIR))?;
    let outlines = outlines(&placing, kinds)?;
    let holders = enclosing_solids(design, |package| &outlines[numbers[package]], &array)?;
    let index = |holder: Option<&CheckedSolid>| outside(holder, &[]).index;
    let first = index(holders.first().copied().flatten());
    let other = holders.iter().find(|holder| index(**holder).to_bits() != first.to_bits());
    let Some(other) = other else {
        return Ok(first);
    };
    let name = |holder: Option<&CheckedSolid>| holder.map_or("air", CheckedSolid::name).to_owned();
    let [a, b] = [name(holders[0]), name(*other)];
    let got = format!("some packages in {a:?} and some in {b:?}");
    let expected = "one index around all domes with [elements], whose tables are those of silicone in one medium";
    Err(refused(design, "solids", got, expected).into())
}

/// What the solids of `design` stand on, and the narrow gaps between bodies of a package and between
/// solids of the array; `packages` have no solids yet.
///
/// # Errors
/// Solids that [`add`] refuses.
pub fn standing(design: &Design, packages: &Packages, bottom: &Bottom) -> Result<Standing> {
    let placing = Placing::new(design, bottom);
    let Packages { kinds, numbers } = packages;
    let (mut outline, mut array) = (kinds[0].0.clone(), Prototype::default());
    let own = place_solids(&placing, Per::Package, &mut outline, None)?;
    let once = place_solids(&placing, Per::Array, &mut array, None)?;
    let outlines = outlines(&placing, kinds)?;
    let holders = enclosing_solids(design, |package| &outlines[numbers[package]], &array)?;
    let about_packages = holders.first().copied().flatten().map_or("air", CheckedSolid::name);
    let mut all = Standing::default();
    for (placed, body, world) in [(own, &outline, about_packages), (once, &array, "air")] {
        let medium = |region: Region, world: &str| match region {
            Region::Body(number) => body.media[usize::from(number)].name.clone(),
            Region::World | Region::Opaque => world.to_owned(),
        };
        let is_film = |name: &String| {
            let mut films = design.solids.iter().filter(|solid| solid.is_film());
            films.any(|film| film.name() == name)
        };
        all.on_bottom.extend(placed.on_bottom.into_iter().map(|contact| SolidOnBottom {
            name: contact.solid.name().to_owned(),
            touches: contact.parts.iter().map(|part| part.name).collect(),
            around: medium(contact.outer, world),
        }));
        all.gaps.extend(placed.gaps.into_iter().map(|gap| Gap {
            is_with_film: is_film(&gap.names[1]),
            between: gap.names,
            width_mm: gap.width_mm,
            of: medium(gap.outer, "air"),
        }));
    }
    all.on_bottom.sort_by_key(|one| design.solids.iter().position(|s| s.name() == one.name));
    Ok(all)
}

/// The innermost solid of the array that holds each package; `None` in air. `package` gives each
/// with its solids.
fn enclosing_solids<'a, 'b>(
    design: &'a Design,
    package: impl Fn(usize) -> &'b Prototype + Sync,
    array: &Prototype,
) -> Result<Vec<Option<&'a CheckedSolid>>> {
    let axes = design.array.axes_mm();
    if array.surfaces.is_empty() {
        return Ok(vec![None; axes.len()]);
    }
    let media = solids::regions(&design.solids, Per::Array, false);
    let surroundings = Surroundings::new(array, 0.0);
    let places = axes.par_iter().map(|[x, y]| DVec3::new(*x, *y, 0.0));
    let stands = places.enumerate().map(|(number, at)| {
        let package = package(number);
        match surroundings.containment(package, at) {
            // The scene reports the place of the cut.
            Containment::Straddles(..) => Ok(None),
            Containment::Within(Region::Opaque) => Err(within_opaque(design, package, at)),
            Containment::Within(region) => {
                let holder = media.iter().find(|(_, of)| *of == region);
                Ok(holder.map(|(solid, _)| *solid))
            }
        }
    });
    // The first package that fails is reported, in any order of threads.
    stands.collect::<Vec<Result<_, anyhow::Error>>>().into_iter().collect()
}

/// The medium around packages within `holder`; `depths` are those of all solids of the array.
fn outside(holder: Option<&CheckedSolid>, depths: &[(&CheckedSolid, usize)]) -> Surrounding {
    let medium = holder.and_then(|solid| Some((solid.name(), solid.medium.as_ref()?.index)));
    medium.map_or(AIR, |(name, index)| {
        let depth = depths.iter().find(|(solid, _)| solid.name() == name);
        Surrounding { index, depth: 1 + depth.map_or(0, |(_, depth)| *depth) }
    })
}

/// The error of a package within an opaque solid.
fn within_opaque(design: &Design, package: &Prototype, at: DVec3) -> anyhow::Error {
    let around: Vec<DVec3> = nesting::around(package).into_iter().map(|point| point + at).collect();
    let opaque = |solid: &&CheckedSolid| {
        let stated = &solid.stated;
        solid.per() == Per::Array && stated.shared.medium.is_none() && !stated.kind.is_sheet()
    };
    let holds = |solid: &&CheckedSolid| {
        let shape = solid.form.shape(0.0);
        shape.is_ok_and(|shape| nesting::all_in(&around, &shape))
    };
    let solid = design.solids.iter().filter(opaque).find(holds);
    let stated = solid.map(CheckedSolid::place);
    let (key, got) = stated.unwrap_or_else(|| ("solids".to_owned(), "a package".to_owned()));
    let expected = "a solid that holds no package, as light does not enter it";
    refused(design, key, got, expected).into()
}

/// Checks that sources outside a package name the medium that the package stands in.
fn sources_fit(design: &Design, holder: Option<&CheckedSolid>) -> Result<()> {
    let around = holder.map_or("air", CheckedSolid::name);
    let of_array = |name: &str| {
        let solids = design.solids.iter().filter(|s| s.per() == Per::Array);
        name == "air" || solids.into_iter().any(|solid| solid.name() == name)
    };
    for (at, source) in design.sources.iter().enumerate() {
        let Some(inside) = source.stated.kind.place().and_then(|(_, inside)| inside) else {
            continue;
        };
        if of_array(inside) && inside != around {
            let (key, got) = (format!("sources[{}].inside", at + 1), format!("{inside:?}"));
            let expected = format!("{around:?}, in which packages stand");
            return Err(refused(design, key, got, expected).into());
        }
    }
    Ok(())
}

/// An upper bound of all coordinates of the scene, mm.
fn extent_mm(design: &Design) -> f64 {
    let solids = design
        .solids
        .iter()
        .filter_map(|solid| Some(solid.form.shape(0.0).ok()?.bounds().farthest()));
    let [_, scale] = design.array.scale_range();
    let scale = scale.max(1.0);
    let largest = scale * solids.fold(0.0, f64::max);
    let half = design.half_extent_mm();
    let inner = design.housing_half_mm().unwrap_or_default();
    let walls = design.housing.as_ref().map_or(0.0, |h| {
        let beyond = [0, 1].map(|k| (inner[k] - half[k]).max(0.0));
        beyond[0].max(beyond[1]) + h.thickness_mm + h.height_mm
    });
    let package = design.package_width_mm() + design.dome.as_ref().map_or(0.0, Dome::height_mm);
    half[0].max(half[1]) + design.array.pitch_mm.max() + scale * package + walls + largest
}

/// The medium around a body.
#[derive(Debug, Clone, Copy)]
struct Surrounding {
    /// Refractive index.
    index: f64,
    /// Number of solids that hold the body.
    depth: usize,
}

/// The world.
const AIR: Surrounding = Surrounding { index: 1.0, depth: 0 };

/// A solid that light enters and that stands on the bottom, and what it touches there.
struct BottomContact<'a> {
    solid: &'a CheckedSolid,
    /// The region around the solid.
    outer: Region,
    /// The parts of the bottom that it touches.
    parts: Vec<&'a BottomPart>,
}

/// The result of [`place_solids`].
struct PlacedSolids<'a> {
    /// Solids of the body, each with the number of others that hold it.
    depths: Vec<(&'a CheckedSolid, usize)>,
    /// Region around the dome.
    about_dome: Region,
    /// Solids that stand on the bottom.
    on_bottom: Vec<BottomContact<'a>>,
    /// Narrow gaps, where they are asked for.
    gaps: Vec<NarrowGap>,
}

/// Puts the solids of one kind into an empty body or a package. Without `outside` the medium around
/// the body is unknown, and solids only refract.
fn place_solids<'a>(
    placing: &Placing<'a>,
    per: Per,
    body: &mut Prototype,
    outside: Option<Surrounding>,
) -> Result<PlacedSolids<'a>> {
    let design = placing.design;
    let own: Vec<&CheckedSolid> = design.solids.iter().filter(|solid| solid.per() == per).collect();
    if own.is_empty() {
        return Ok(PlacedSolids {
            depths: Vec::new(),
            about_dome: Region::World,
            on_bottom: Vec::new(),
            gaps: Vec::new(),
        });
    }
    let domed = design.dome.is_some();
    let regions = solids::regions(&design.solids, per, domed);
    let (objects, nest) = nested(design, &own, &regions, body)?;
    let displaced = Displacement::new(placing, &own, &objects, &nest)?;
    // Whoever asks for gaps traces nothing.
    let gaps = match outside {
        None => narrow_gaps(&own, &objects, &nest, &displaced, body, NARROW_MM),
        Some(_) => Vec::new(),
    };

    for (solid, _) in &regions {
        body.media.extend(design.traced_medium(solid));
    }
    nest.surround(body);
    for source in &mut body.sources {
        // A chip emits from the box; other sources name their medium.
        let stated = design.sources.iter().find(|s| s.name() == source.name);
        if stated.is_none_or(|s| s.stated.kind.place().is_none()) {
            source.region = nest.about_box;
        }
    }
    let mut on_bottom = Vec::new();
    for (k, ((solid, object), place)) in own.iter().zip(&objects).zip(&nest.places).enumerate() {
        let index = |region: Region| match region {
            Region::World => outside.unwrap_or(AIR).index,
            Region::Body(number) => body.media[usize::from(number)].index,
            Region::Opaque => 0.0,
        };
        let inner = if object.sheet { place.outer } else { object.inner };
        let depth = outside.map_or(0, |outside| outside.depth) + place.depth;
        let inset_mm = placing.inset_mm * (1 + depth) as f64;
        let shape = drawn_in(placing, solid, inset_mm)?;
        for part in displaced.parts(k, &objects, place.outer, inset_mm) {
            let sides = [inner, part.outer];
            let optics = match outside {
                Some(_) => {
                    let faces = faces_beside(&own, k, part.with);
                    optics(design, solid, &shape, (sides.map(index), faces))?
                }
                None => vec![SurfaceModel::Interface; shape.patches()],
            };
            let shape =
                if part.clips.is_empty() { shape.clone() } else { shape.clipped(part.clips) };
            body.surfaces.push(surface(solid, shape, sides, optics));
        }
        let foot = solid.medium.as_ref().and_then(|_| solid.form.footprint());
        if let Some(foot) = foot {
            let parts = if solid.touches_bottom() {
                let in_dome = domed && in_silicone(place, &objects, &nest);
                touched(placing, solid, in_dome)?
            } else {
                Vec::new()
            };
            body.surfaces.extend(plates(&foot, &parts, object.inner, 0.25 * inset_mm)?);
            on_bottom.push(BottomContact {
                solid,
                outer: place.outer,
                parts: parts.into_iter().map(|(part, _)| part).collect(),
            });
        }
    }
    let depths = own.iter().zip(&nest.places);
    Ok(PlacedSolids {
        depths: depths.map(|(solid, place)| (*solid, place.depth)).collect(),
        about_dome: nest.about_dome,
        on_bottom,
        gaps,
    })
}

/// Solids of one kind, and how they lie in each other and in the body.
fn nested(
    design: &Design,
    own: &[&CheckedSolid],
    regions: &[(&CheckedSolid, Region)],
    body: &Prototype,
) -> Result<(Vec<NestedObject>, Nesting)> {
    let objects = own.iter().map(|solid| {
        let inner = regions.iter().find(|(other, _)| other.name() == solid.name());
        Ok(NestedObject {
            shape: solid.form.shape(0.0)?,
            sheet: solid.stated.kind.is_sheet(),
            on_bottom: solid.form.is_on_bottom() || solid.touches_bottom(),
            inner: inner.map_or(Region::Opaque, |(_, region)| *region),
        })
    });
    let objects = objects.collect::<Result<Vec<_>>>()?;
    let nest = Nesting::new(&objects, body).map_err(|wrong| {
        let (key, got) = own[wrong.object].place();
        let expected = wrong.with.map_or_else(
            || wrong.expected.to_owned(),
            |other| format!("{} {:?}", wrong.expected, own[other].name()),
        );
        refused(design, key, got, expected)
    })?;
    Ok((objects, nest))
}

/// Patch of the upright faces of a box.
const SIDES: usize = 0;

/// True of a film that goes on in the next cell, where cells repeat.
fn fills_cell(design: &Design, solid: &CheckedSolid) -> bool {
    let is_periodic = design.is_periodic();
    is_periodic && solid.film_mm().is_some_and(|(_, size_mm)| fills(design, size_mm))
}

/// True for the upper and for the lower face of the film `k` if it borders on the film `with`; else if
/// it borders on none.
fn faces_beside(own: &[&CheckedSolid], k: usize, with: Option<usize>) -> [bool; 2] {
    let with = with.filter(|with| own[*with].is_film());
    // Films lie in order.
    [own.get(k + 1), k.checked_sub(1).and_then(|below| own.get(below))].map(|next| {
        let joined = next.filter(|next| next.joins(own[k])).map(|next| next.name());
        joined == with.map(|with| own[with].name())
    })
}

/// Patches of a solid between media of these indices, with its faces that lie between them.
fn optics(
    design: &Design,
    solid: &CheckedSolid,
    shape: &Shape,
    (indices, faces): ([f64; 2], [bool; 2]),
) -> Result<Vec<SurfaceModel>> {
    let optics = solid.patches(shape, design.wavelength_nm, indices, faces);
    let optics = optics.and_then(|mut patches| {
        if fills_cell(design, solid) {
            patches[SIDES] = SurfaceModel::Periodic;
        }
        design.print_film(solid, indices, &mut patches)?;
        Ok(patches)
    });
    optics.map_err(|error| {
        ConfigError::Files {
            file: design.provenance.file.clone(),
            message: format!("{error:#}, at {} nm", design.wavelength_nm),
        }
        .into()
    })
}

/// The shape of a solid with its outer faces drawn in; in optical contact its foot is sunk. A sheet
/// on the bottom is lifted, less than the feet of solids.
fn drawn_in(placing: &Placing, solid: &CheckedSolid, inset_mm: f64) -> Result<Shape> {
    let shape = if solid.form.is_on_bottom() {
        solid.form.lifted(0.5 * placing.inset_mm).shape(inset_mm)
    } else if solid.touches_bottom() {
        solid.form.shape_in_contact(inset_mm)
    } else {
        solid.form.shape(inset_mm)
    };
    shape.map_err(|error| {
        let (key, got) = solid.size();
        let expected = format!(
            "a solid thicker than twice {inset_mm:.1e} mm, by which its faces are drawn in: {error}"
        );
        refused(placing.design, key, got, expected).into()
    })
}

/// True if a place lies within the silicone, directly or in solids that do.
fn in_silicone(place: &NestedPlace, objects: &[NestedObject], nest: &Nesting) -> bool {
    let mut outer = place.outer;
    // No chain is longer than there are solids.
    for _ in 0..=objects.len() {
        if outer == tracer::package::SILICONE {
            return true;
        }
        let holder = objects.iter().position(|object| !object.sheet && object.inner == outer);
        match holder {
            Some(holder) => outer = nest.places[holder].outer,
            None => return false,
        }
    }
    false
}

/// The parts of the bottom that the foot of a solid touches, alike in every package.
fn touched<'a>(
    placing: &Placing<'a>,
    solid: &CheckedSolid,
    in_dome: bool,
) -> Result<Vec<(&'a BottomPart, Coverage)>> {
    let bottom = placing.bottom;
    if in_dome {
        return Ok(vec![(&bottom.in_dome, Coverage::Whole)]);
    }
    let array = &placing.design.array;
    let (axes, is_posed) = match solid.per() {
        Per::Package => (array.axes_mm(), array.is_turned() || array.is_scaled()),
        Per::Array => (vec![[0.0; 2]], false),
    };
    let of_axis = |(package, at): (usize, &[f64; 2])| {
        let as_stated = Pose { turn_deg: 0.0, scale: 1.0 };
        let Pose { turn_deg, scale } = if is_posed { array.pose(package) } else { as_stated };
        let footprint = solid.form.turned(turn_deg).footprint()?.scaled(scale);
        covered(&footprint, &bottom.outside, DVec2::from_array(*at))
    };
    let mut all = axes.iter().enumerate().map(of_axis);
    let whole = |covered: &Covered| matches!(covered[..], [(_, Coverage::Whole)]);
    let first = all.next().flatten();
    // Other shares than the whole are those of a package as it is stated.
    let first = first.filter(|first| {
        axes.len() == 1 && !is_posed
            || (whole(first) && all.all(|other| other.as_ref() == Some(first)))
    });
    let Some(first) = first else {
        let names: Vec<&str> = bottom.outside.iter().map(|part| part.name).collect();
        let expected = format!(
            "a solid that stands on one part of the bottom ({}), the same in every package, or with per = \"array\" a box along x and y",
            names.join(", ")
        );
        return Err(contact_refused(placing, solid, expected).into());
    };
    let part = |(number, stretch)| (&bottom.outside[number], stretch);
    Ok(first.into_iter().map(part).collect())
}

fn surface(
    solid: &CheckedSolid,
    shape: Shape,
    [inner, outer]: [Region; 2],
    optics: Vec<SurfaceModel>,
) -> Surface {
    let patches = optics.into_iter().map(|optics| Patch::new(solid.name(), optics)).collect();
    Surface::zoned(shape, inner, outer, patches)
}
