// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks that no sheet lies in a face.
//!
//! Of a sheet and a face in one plane rounding would decide which light meets first, where they share
//! area. Faces that are drawn in ([`crate::shape::Placement`]) stand apart from a sheet where they
//! are stated: it lies on them.

use glam::DVec3;
use rayon::prelude::*;

use crate::error::Error;
use crate::scene::{Body, CompiledSurface, Scene};
use crate::shape::{Bounds, Facet, Window};
use crate::surface::Region;

/// Largest distance, in units of [`Scene::offset`], at which a sheet and a face are in one plane: a
/// tenth of what placed faces are drawn in by.
const SAME: f64 = 100.0;

/// Judges the sheets of all bodies against the faces of their own body, of the array solids and of
/// the world.
pub(super) fn check(scene: &Scene) -> Result<(), Error> {
    let ground = (&scene.ground, DVec3::ZERO);
    let array_solids = scene.array_solids().map(|body| (body, DVec3::ZERO));
    let around: Vec<(&Body, DVec3)> = array_solids.into_iter().chain([ground]).collect();
    for (number, (body, at)) in around.iter().enumerate() {
        for other in &around[number..] {
            between(scene, (*body, *at), *other)?;
        }
    }
    let own = scene.bodies.iter().try_for_each(|body| {
        let placed = (body, DVec3::ZERO);
        between(scene, placed, placed)
    });
    own?;
    let packages: Vec<(&Body, DVec3)> = scene.packages().collect();
    let wrong = packages.into_par_iter().find_map_first(|package| {
        around.iter().find_map(|other| between(scene, package, *other).err())
    });
    wrong.map_or(Ok(()), Err)
}

/// True of a surface with one medium on both sides.
fn is_sheet(surface: &CompiledSurface) -> bool {
    surface.regions[0] == surface.regions[1] && surface.regions[0] != Region::Opaque
}

/// Judges the sheets of each of two bodies, at their places, against the faces of the other.
fn between(
    scene: &Scene,
    (one, at): (&Body, DVec3),
    (other, place): (&Body, DVec3),
) -> Result<(), Error> {
    let has_sheets = |body: &Body| body.surfaces.iter().any(is_sheet);
    if !has_sheets(one) && !has_sheets(other) {
        return Ok(());
    }
    for first in &one.surfaces {
        for second in &other.surfaces {
            let is_same = std::ptr::eq(first, second);
            if is_same || !(is_sheet(first) || is_sheet(second)) {
                continue;
            }
            let [low, high] = [at, place];
            let (sheet, face) = if is_sheet(first) { (first, second) } else { (second, first) };
            let apart = if is_sheet(first) { high - low } else { low - high };
            lies_in(scene, sheet, face, apart)?;
        }
    }
    Ok(())
}

/// Refuses a sheet in the plane of a face of a surface whose body stands at `place` from its own.
fn lies_in(
    scene: &Scene,
    sheet: &CompiledSurface,
    face: &CompiledSurface,
    place: DVec3,
) -> Result<(), Error> {
    let bounds: Bounds = sheet.shape.bounds().moved(-place);
    let apart_mm = SAME * scene.offset() + 4.0 * f64::EPSILON * sheet.shape.bounds().farthest();
    let window = Window { bounds, axis: 2, within: apart_mm };
    if !bounds.is_finite() || !window.meets(&face.shape.bounds()) {
        return Ok(());
    }
    let mut own = Vec::new();
    sheet.shape.facets(&window, &mut |patch, facet| own.push((patch, facet.moved(-place))));
    let mut overlap = None;
    face.shape.facets(&window, &mut |patch, facet| {
        let shared = |(_, own): &&(u32, Facet)| facet.shares(own, apart_mm);
        if let (None, Some((own, _))) = (overlap, own.iter().find(shared)) {
            overlap = Some((*own, patch));
        }
    });
    let name = |surface: &CompiledSurface, patch: u32| {
        scene.lines.surfaces[surface.patches[patch as usize].line].clone()
    };
    overlap.map_or(Ok(()), |(own, patch)| {
        Err(Error::SheetInFace { sheet: name(sheet, own), surface: name(face, patch), apart_mm })
    })
}
