// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[solids]]` → surfaces of the scene, each between what it is of and what surrounds it.
//!
//! In: a design and the prototype of its package without them. Out: the prototype with the solids of every package, and one of those that stand once.
//! What surrounds what is found by points just inside of every surface: a solid lies in all those that hold all of its points, and its
//! surroundings are the innermost of these. The order of the tables means nothing. Solids that neither hold each other nor stand apart come out as
//! neighbours, whose crossing the scene then refuses with a place.

mod nest;

use anyhow::Result;
use tracer::glam::DVec3;
use tracer::{Medium, Optics, Part, Prototype, Region, SceneBuilder, Shape, Surface};

use crate::config::ConfigError;
use crate::config::resolved::Design;
use crate::config::solids::{self, Checked, Per};
use crate::config::sources::Kind as SourceKind;
use nest::{Nest, Object};

/// By how much the outer faces of a solid are drawn in, as a share of the size of the scene, and again for every solid that it lies in: a
/// thousand times what a ray's start is moved off a surface.
const INSET: f64 = 1e-9;

/// Adds the solids of `design` to the prototype of a package, and those of the array to the scene.
///
/// # Errors
/// Solids that lie in something opaque or in one place, sheets that lie in a surface, scattering that does not fit the media.
pub fn add(design: &Design, package: &mut Prototype, scene: &mut SceneBuilder) -> Result<()> {
    if design.solids.is_empty() {
        return Ok(());
    }
    let inset_mm = INSET * extent_mm(design);
    into(design, Per::Package, package, inset_mm)?;
    holds_no_package(design, package)?;
    let mut array = Prototype::default();
    into(design, Per::Array, &mut array, inset_mm)?;
    if !array.surfaces.is_empty() {
        let array = scene.prototype(array);
        scene.among(array);
    }
    Ok(())
}

/// A length that no coordinate of the scene exceeds, mm.
fn extent_mm(design: &Design) -> f64 {
    let solids = design.solids.iter().filter_map(|solid| {
        let (low, high) = solid.form.shape(0.0).ok()?.bounds();
        Some(low.abs().max(high.abs()).max_element())
    });
    let largest = solids.fold(0.0, f64::max);
    let half = design.half_extent_mm();
    let walls = design
        .housing
        .as_ref()
        .map_or(0.0, |h| h.distance_mm + h.thickness_mm + h.height_mm);
    let package = design.package_width_mm() + design.dome.map_or(0.0, |d| d.height_mm);
    half[0].max(half[1]) + design.array.pitch_mm + package + walls + largest
}

/// Most packages of which each is looked at: those first in the array.
const LOOKED_AT: usize = 64;

/// Refuses solids of the array that hold a package, whose outside is the air between packages and nothing else.
fn holds_no_package(design: &Design, package: &Prototype) -> Result<()> {
    let around = nest::around(package);
    for solid in design.solids.iter().filter(|s| s.stated.per == Per::Array) {
        if solid.stated.kind.is_sheet() {
            continue;
        }
        let shape = solid.form.shape(0.0)?;
        for [x, y] in design.axes_mm().into_iter().take(LOOKED_AT) {
            let moved: Vec<DVec3> = around.iter().map(|at| at + DVec3::new(x, y, 0.0)).collect();
            if nest::all_in(&moved, &shape) {
                return Err(ConfigError::Value {
                    file: design.provenance.file.clone(),
                    key: format!("solids[{}].position_mm", number(design, solid)),
                    got: format!("{:?}", solid.stated.position_mm),
                    expected: "a solid that holds no package: one around each, with per = \"package\", may".to_owned(),
                }
                .into());
            }
        }
    }
    Ok(())
}

/// Puts the solids of one kind into a body, which holds nothing else or a package.
fn into(design: &Design, per: Per, body: &mut Prototype, inset_mm: f64) -> Result<()> {
    let own: Vec<&Checked> = design
        .solids
        .iter()
        .filter(|solid| solid.stated.per == per)
        .collect();
    if own.is_empty() {
        return Ok(());
    }
    let domed = design.dome.is_some();
    let regions = solids::regions(&design.solids, per, domed);
    let objects = own.iter().map(|solid| {
        let inner = regions
            .iter()
            .find(|(other, _)| other.name() == solid.name());
        Ok(Object {
            shape: solid.form.shape(0.0)?,
            sheet: solid.stated.kind.is_sheet(),
            inner: inner.map_or(Region::Opaque, |(_, region)| *region),
        })
    });
    let objects = objects.collect::<Result<Vec<_>>>()?;
    let nest = Nest::of(&objects, body).map_err(|wrong| {
        let key = format!("solids[{}].position_mm", number(design, own[wrong.object]));
        let expected = wrong.with.map_or_else(
            || wrong.expected.to_owned(),
            |other| format!("{} {:?}", wrong.expected, own[other].name()),
        );
        ConfigError::Value {
            file: design.provenance.file.clone(),
            key,
            got: format!("{:?}", own[wrong.object].stated.position_mm),
            expected,
        }
    })?;

    if design.has_relief() && nest.about_dome != Region::World {
        let held_by = regions
            .iter()
            .find(|(_, region)| *region == nest.about_dome);
        let name = held_by.map_or("", |(solid, _)| solid.name());
        return Err(ConfigError::Value {
            file: design.provenance.file.clone(),
            key: "solids".to_owned(),
            got: format!("{name:?} around the dome"),
            expected: "no solid that holds a dome with [elements], whose tables are those of silicone in air".to_owned(),
        }
        .into());
    }
    for (solid, _) in &regions {
        let Some(medium) = &solid.medium else {
            continue;
        };
        body.media
            .push(Medium::clear(solid.name(), medium.index).absorbing(medium.absorption_per_mm));
    }
    nest.surround(body);
    for source in &mut body.sources {
        // A chip emits from the box, whatever surrounds it; other sources say where they lie.
        let stated = design.sources.iter().find(|s| s.stated.name == source.name);
        if stated.is_none_or(|s| s.stated.kind == SourceKind::Chip) {
            source.region = nest.about_box;
        }
    }
    for ((solid, object), place) in own.iter().zip(&objects).zip(&nest.places) {
        let index = |region: Region| match region {
            Region::World => 1.0,
            Region::Body(number) => body.media[usize::from(number)].index,
            Region::Opaque => 0.0,
        };
        let inner = if object.sheet {
            place.outer
        } else {
            object.inner
        };
        let sides = [inner, place.outer];
        let optics = solid
            .optics(design.wavelength_nm, sides.map(index))
            .map_err(|error| ConfigError::Files {
                file: design.provenance.file.clone(),
                message: format!(
                    "solids[{}].scatter: {error:#}, at {} nm",
                    number(design, solid),
                    design.wavelength_nm
                ),
            })?;
        let shape = solid.form.shape(inset_mm * (1 + place.depth) as f64)?;
        body.surfaces.push(surface(solid, shape, sides, optics));
    }
    Ok(())
}

/// The number of the table of a solid, from 1.
fn number(design: &Design, solid: &Checked) -> usize {
    let mut all = design.solids.iter();
    all.position(|other| other.name() == solid.name())
        .map_or(0, |k| k + 1)
}

fn surface(solid: &Checked, shape: Shape, [inner, outer]: [Region; 2], optics: Optics) -> Surface {
    Surface::zoned(shape, inner, outer, vec![Part::new(solid.name(), optics)])
}
