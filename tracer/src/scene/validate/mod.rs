// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks of a compiled scene: no overlaps, no cuts, and every source in the medium it names.

mod coplanar_sheets;
mod crossing;
mod gjk;
mod overlap;
mod source_regions;

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::Scene;
use super::compiled::Body;
use super::surroundings::Containments;
use crate::error::Error;
use crate::shape::{Bounds, Closing, Placement, Shape};
use crate::surface::Region;
use crossing::Space;
use gjk::Solid;

/// Checks a compiled scene.
pub(super) fn check(scene: &Scene, containments: Containments) -> Result<(), Error> {
    // A scene of dark sources has no light.
    if !scene.sources.last().is_some_and(|placed| placed.cumulated > 0.0) {
        return Err(Error::NoSource);
    }
    check_overlaps(scene)?;
    check_ground(scene)?;
    check_walls(scene)?;
    for (number, body) in scene.bodies.iter().enumerate() {
        let placed = scene.instances.list.iter().any(|i| i.prototype as usize == number);
        if placed {
            let media = names(scene, body);
            let space = Space { surfaces: &body.surfaces, media: &media };
            crossing::check(&space, &scene.lines)?;
        }
    }
    check_array_solids(scene, &containments)?;
    // Reported after crossings, which describe the cause better.
    containments.straddles.map_or(Ok(()), Err)?;
    coplanar_sheets::check(scene)?;
    source_regions::check(scene)
}

/// Names of the media of a body, and last that of the medium around it.
fn names<'a>(scene: &'a Scene, body: &'a Body) -> Vec<&'a str> {
    let media = body.media.iter().map(|medium| medium.line);
    media.chain([body.outside]).map(|line| &*scene.lines.media[line]).collect()
}

/// Checks that array solids cut no instance and no wall, with each as if both were one body.
fn check_array_solids(scene: &Scene, containments: &Containments) -> Result<(), Error> {
    let Some(array_solids) = scene.array_solids() else {
        return Ok(());
    };
    let touches = |other: Bounds| {
        let mut boxes = array_solids.surfaces.iter().map(|s| s.shape.bounds());
        boxes.any(|one| one.overlaps(&other))
    };
    let walls = scene.ground.surfaces.iter().filter(|s| s.is_wall());
    let mut surfaces = array_solids.surfaces.clone();
    surfaces.extend(walls.filter(|wall| touches(wall.shape.bounds())).cloned());
    let media = names(scene, array_solids);
    if surfaces.len() > array_solids.surfaces.len() {
        let space = Space { surfaces: &surfaces, media: &media };
        crossing::check(&space, &scene.lines)?;
    }
    let packages: Vec<(&Body, DVec3)> = scene.packages().collect();
    let wrong = packages
        .par_iter()
        .zip(&containments.outside)
        .zip(&containments.clear)
        .filter(|(((body, at), _), clear)| !**clear && touches(body.bounds.moved(*at)))
        .find_map_first(|(((body, at), outside), _)| {
            check_instance(scene, array_solids, body, *at, *outside).err()
        });
    wrong.map_or(Ok(()), Err)
}

/// Checks that array solids do not cut one instance, which stands in their medium `outside` or in
/// the world.
fn check_instance(
    scene: &Scene,
    array_solids: &Body,
    body: &Body,
    position: DVec3,
    outside: Option<u8>,
) -> Result<(), Error> {
    // The media of the package come first, and the world's is the last.
    let first = body.media.len() as u8;
    let (of_package, of_array) = (names(scene, body), names(scene, array_solids));
    let of_package = &of_package[..body.media.len()];
    let media: Vec<&str> = of_package.iter().chain(&of_array).copied().collect();
    let mut surfaces = array_solids.surfaces.clone();
    for region in surfaces.iter_mut().flat_map(|s| &mut s.regions) {
        if let Region::Body(number) = region {
            *number += first;
        }
    }
    let around = outside.map_or(Region::World, |medium| Region::Body(first + medium));
    for surface in &body.surfaces {
        let shape = vec![surface.shape.clone()];
        let closing = if surface.shape.closed() { Closing::Closed } else { Closing::Open };
        let mut surface = surface.clone();
        surface.shape = Shape::placed(shape, closing, &Placement::at(position))?;
        for region in surface.regions.iter_mut().filter(|r| **r == Region::World) {
            *region = around;
        }
        // A message names the first patch where there are several members.
        surface.patches.truncate(surface.shape.patches());
        surfaces.push(surface);
    }
    let space = Space { surfaces: &surfaces, media: &media };
    crossing::check(&space, &scene.lines)
}

/// Checks that no two instances overlap; they may touch. Bodies of revolution are compared by their
/// radii, others by their boxes and, where these overlap, by their shapes. Only neighbours are
/// compared: instances are sorted into cells as wide as the widest body.
fn check_overlaps(scene: &Scene) -> Result<(), Error> {
    let list = &scene.instances.list[..scene.instances()];
    let body = |number: usize| &scene.bodies[list[number].prototype as usize];
    let width = (0..list.len()).map(|k| width(body(k))).fold(0.0, f64::max);
    let cell = |at: f64| {
        if width.is_finite() && width > 0.0 { (at / width).floor() as i64 } else { 0 }
    };
    let mut cells: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    let mut shapes = Shapes::new(scene, width);
    for (second, b) in list.iter().enumerate() {
        let [x, y] = [cell(b.position.x), cell(b.position.y)];
        let mut worst: Option<(usize, (f64, f64))> = None;
        for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
            let key = [x.saturating_add(dx), y.saturating_add(dy)];
            for &first in cells.get(&key).into_iter().flatten() {
                let apart = b.position - list[first].position;
                if let Some(found) = overlap([body(first), body(second)], apart)
                    && worst.is_none_or(|(known, _)| first < known)
                    && !shapes.apart([first, second].map(|k| list[k].prototype as usize), apart)
                {
                    worst = Some((first, found));
                }
            }
        }
        if let Some((first, (distance_mm, needed_mm))) = worst {
            return Err(Error::Overlap { first, second, distance_mm, needed_mm });
        }
        cells.entry([x, y]).or_default().push(second);
    }
    Ok(())
}

/// Two bodies and the position of the second relative to the first, to within rounding.
type Pair = ([usize; 2], [i64; 3]);

/// The shapes of bodies that are not round, and results for pairs of them: an array has few
/// relative positions.
struct Shapes<'a> {
    /// Upper bound of the rounding of positions, mm.
    step: f64,
    round: Vec<bool>,
    solids: Vec<Option<Solid<'a>>>,
    found: HashMap<Pair, bool>,
}

impl<'a> Shapes<'a> {
    fn new(scene: &'a Scene, width: f64) -> Self {
        let bodies = &scene.bodies;
        let any = bodies.iter().any(|body| !body.round);
        let solid = |body: &'a Body| any.then(|| Solid::new(body)).flatten();
        Self {
            step: 1e-10 * width,
            round: bodies.iter().map(|body| body.round).collect(),
            solids: bodies.iter().map(solid).collect(),
            found: HashMap::new(),
        }
    }

    /// True if two bodies, not both round, certainly do not overlap; the second one stands at
    /// `apart` from the first.
    fn apart(&mut self, pair: [usize; 2], apart: DVec3) -> bool {
        let [Some(a), Some(b)] = pair.map(|number| self.solids[number].as_ref()) else {
            return false;
        };
        if pair.iter().all(|number| self.round[*number]) {
            return false;
        }
        let steps = (apart / self.step).to_array().map(|v| v.round() as i64);
        let found = self.found.entry((pair, steps));
        *found.or_insert_with(|| a.apart_from(b, apart))
    }
}

/// Twice the largest distance of a body from its origin along x or y, and at least twice its
/// radius. Two bodies whose origins are farther apart than the larger of their widths do not
/// overlap.
fn width(body: &Body) -> f64 {
    let sides = [body.bounds.low.x, body.bounds.low.y, body.bounds.high.x, body.bounds.high.y];
    let farthest = sides.into_iter().map(f64::abs).fold(0.0, f64::max);
    2.0 * farthest.max(body.radius.unwrap_or(0.0))
}

/// The distance of two overlapping bodies and the distance they need; the second one stands at
/// `apart` from the first.
fn overlap([a, b]: [&Body; 2], apart: DVec3) -> Option<(f64, f64)> {
    // Rounding of positions may not turn touching into overlapping.
    const TOUCH: f64 = 1.0 - 1e-9;
    // Along each axis, the one on the higher side must begin where the other ends.
    let needed = |axis: usize| {
        if apart[axis] >= 0.0 {
            a.bounds.high[axis] - b.bounds.low[axis]
        } else {
            b.bounds.high[axis] - a.bounds.low[axis]
        }
    };
    let clear = |axis: usize| apart[axis].abs() >= needed(axis) * TOUCH;
    if clear(2) {
        return None;
    }
    if let (Some(radius_a), Some(radius_b)) = (a.radius, b.radius) {
        // Boxes around bodies of revolution that share space share space too; those of placed
        // shapes may not, nor what lies within their radii.
        let (distance, needed) = (apart.truncate().length(), radius_a + radius_b);
        let shared = distance < needed * TOUCH && !clear(0) && !clear(1);
        return shared.then_some((distance, needed));
    }
    let axis = usize::from(apart.y.abs() * needed(0) > apart.x.abs() * needed(1));
    (!clear(0) && !clear(1)).then(|| (apart[axis].abs(), needed(axis)))
}

/// Depth below the ground that counts as standing on it, in offsets of a ray's start: a ten
/// millionth of the scene. A foot may be sunk, so that walls leave no gap.
const SUNK: f64 = 1e5;

/// Checks that no body reaches below a horizontal ground that is opaque underneath.
fn check_ground(scene: &Scene) -> Result<(), Error> {
    for ground in
        scene.ground.surfaces.iter().filter(|surface| surface.regions[0] == Region::Opaque)
    {
        let Bounds { low, high } = ground.shape.bounds();
        let level = high.z - low.z <= 0.0 && low.truncate() == DVec2::NEG_INFINITY;
        for (number, instance) in scene.instances.list.iter().enumerate() {
            let body = &scene.bodies[instance.prototype as usize];
            let low_mm = body.bounds.low.z + instance.position.z;
            let slack = (1e-6 * body.bounds.size().z).max(SUNK * scene.offset());
            if level && low_mm < low.z - slack {
                return Err(Error::BelowGround { instance: number, low_mm, ground_mm: low.z });
            }
        }
    }
    Ok(())
}

/// Checks that no body reaches into a wall. Bodies of revolution are judged by their radii, others
/// by their boxes.
fn check_walls(scene: &Scene) -> Result<(), Error> {
    for solid in scene.ground.surfaces.iter().filter(|s| s.is_wall()) {
        let Bounds { low, high } = solid.shape.bounds();
        for (number, (body, at)) in scene.packages().enumerate() {
            // Rounding of positions may not turn touching into overlapping.
            let slack = 1e-9 * body.bounds.size();
            let (from, to) = (body.bounds.low + at + slack, body.bounds.high + at - slack);
            if !(from.cmplt(high).all() && to.cmpgt(low).all()) {
                continue;
            }
            let nearest = at.clamp(low, high).truncate();
            let away_mm = nearest.distance(at.truncate());
            if body.radius.is_none_or(|radius| away_mm < radius * (1.0 - 1e-9)) {
                return Err(Error::IntoWall {
                    instance: number,
                    surface: scene.lines.surfaces[solid.patches[0].line].clone(),
                    away_mm,
                });
            }
        }
    }
    Ok(())
}
