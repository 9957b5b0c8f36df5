// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks that every source lies inside the medium it names.
//!
//! The surface that a ray sees first must face it with the region of the source. Some sampled rays
//! stand for all rays of a source; of a ray set, every ray is judged. [`coplanar_emitters`] judges
//! the flat faces in which an emitter lies or through which it reaches.

use rayon::prelude::*;

use super::coplanar_emitters;
use crate::error::Error;
use crate::random;
use crate::ray::Ray;
use crate::scene::instances::Instance;
use crate::scene::{Body, CompiledSurface, Location, PlacedSource, Scene};
use crate::shape::Reach;
use crate::source::Emission;
use crate::source::RaySet;
use crate::surface::Region;

/// Rays with which the surroundings of a source are probed.
const PROBES: u64 = 256;

/// Judges all sources.
pub(super) fn in_place(scene: &Scene) -> Result<(), Error> {
    // What surrounds a source inside of a body is the same in all instances of it.
    let mut first = vec![None; scene.bodies.len()];
    // Sets of rays that were judged in the world, and how high.
    let mut judged: Vec<(*const RaySet, f64)> = Vec::new();
    // No path begins at a dark one.
    let mut lit = scene
        .sources
        .iter()
        .filter(|placed| placed.source.weight > 0.0);
    lit.try_for_each(|placed| {
        if let Location::Inside { instance, .. } = placed.location
            && !scene.meets_other_bodies(placed.location)
        {
            let prototype = scene.instances.list[instance as usize].prototype as usize;
            if *first[prototype].get_or_insert(instance) != instance {
                return Ok(());
            }
        }
        if let Emission::Rays(set) = &placed.source.emission {
            let known = (std::ptr::from_ref::<RaySet>(set), placed.source.position.z);
            let seen = judged.contains(&known);
            if !seen || placed.location != Location::World || crowded(scene, placed, set) {
                judged.push(known);
                return each_ray(scene, placed, set);
            }
        }
        let mut rng = random::stream(0x0b5e_55ed, 0);
        (0..PROBES).try_for_each(|_| {
            let exact = placed.source.sample(0.0, &mut rng.clone());
            let ray = placed.source.sample(scene.offset(), &mut rng);
            probe(scene, placed, &exact, &ray).map_err(|wrong| wrong.of(scene, placed, None))
        })?;
        coplanar_emitters::judge(scene, placed).map_err(|wrong| wrong.of(scene, placed, None))
    })
}

/// Judges every ray of a set; names the first that starts elsewhere.
fn each_ray(scene: &Scene, placed: &PlacedSource, set: &RaySet) -> Result<(), Error> {
    let wrong = (0..set.len()).into_par_iter().find_map_first(|number| {
        let ray = placed.source.placed(set.ray(number), scene.offset());
        let exact = placed.source.placed(set.ray(number), 0.0);
        let wrong = probe(scene, placed, &exact, &ray).err()?;
        Some(wrong.of(scene, placed, Some((set.record(number), ray))))
    });
    wrong.map_or(Ok(()), Err)
}

/// Whether any ray of a set in the world may start within the box around more than one body, or
/// within a bounded surface of the world.
fn crowded(scene: &Scene, placed: &PlacedSource, set: &RaySet) -> bool {
    let starts = set.starts().moved(placed.source.position);
    let boxes = scene.instances.boxes().iter();
    let mut walls = scene.ground.surfaces.iter().map(|s| s.shape.bounds());
    boxes.filter(|around| starts.overlaps(around)).count() > 1
        || walls.any(|wall| wall.is_finite() && starts.overlaps(&wall))
}

/// The name of what lies in a region of a body.
fn named(scene: &Scene, body: &Body, region: Region) -> String {
    let line = match region {
        Region::World => body.outside,
        Region::Body(medium) => body.media[usize::from(medium)].line,
        Region::Opaque => return "something opaque".to_owned(),
    };
    scene.lines.media[line].clone()
}

/// The name of the medium that a source claims to emit into.
fn claimed(scene: &Scene, placed: &PlacedSource) -> String {
    let body = match placed.location {
        Location::Inside { instance, .. } => scene.body(instance),
        Location::World => &scene.ground,
    };
    named(scene, body, placed.source.region)
}

/// What a ray sees first, where it should not.
pub(super) enum Wrong {
    /// A surface of this line of the ledger, which faces it with a medium of this name.
    Faces(usize, String),
    /// A surface of this line of the ledger, in which it starts and into which it goes.
    Into(usize),
    Nothing,
}

impl Wrong {
    /// As an error; `ray` is the number of one of a set, and the ray.
    fn of(self, scene: &Scene, placed: &PlacedSource, ray: Option<(usize, Ray)>) -> Error {
        let (source_name, region) = (placed.source.name.clone(), claimed(scene, placed));
        if let Some((number, ray)) = ray {
            return Error::RayOutside {
                source_name,
                ray: number,
                at_mm: ray.origin.to_array(),
                region,
                seen: match self {
                    Self::Faces(line, faces) => {
                        format!(
                            "'{}' is seen first, facing it with {faces}",
                            scene.lines.surfaces[line]
                        )
                    }
                    Self::Into(line) => format!(
                        "it goes at once into '{}', in whose surface it starts",
                        scene.lines.surfaces[line]
                    ),
                    Self::Nothing => "no surface is seen".to_owned(),
                },
            };
        }
        match self {
            Self::Faces(line, _) => Error::SourceOutside {
                source_name,
                region,
                surface: scene.lines.surfaces[line].clone(),
            },
            Self::Into(line) => Error::SourceInSurface {
                source_name,
                surface: scene.lines.surfaces[line].clone(),
            },
            Self::Nothing => Error::OpenBody {
                source_name,
                region,
            },
        }
    }
}

/// What a ray sees: distance, surface, the region with which that faces it and the part of it, and
/// the body that it is of.
type Seen<'a> = ((f64, &'a CompiledSurface, Region, u32), &'a Body);

/// The first surface that a ray of a source sees.
fn first<'a>(scene: &'a Scene, placed: &PlacedSource, ray: &Ray) -> Option<Seen<'a>> {
    let mut reach = Reach::AHEAD;
    let mut seen = None;
    let around = match placed.location {
        Location::Inside { instance, .. } => scene.body(instance),
        Location::World => &scene.ground,
    };
    if let Some(found) = around.first_seen(ray, reach) {
        reach.to = found.0;
        seen = Some((found, around));
    }
    let mut look = |instance: &Instance, reach: &mut Reach| {
        let body = &scene.bodies[instance.prototype as usize];
        if let Some(mut found) = body.first_seen(&instance.local(ray), *reach) {
            reach.to = found.0;
            if found.2 == Region::World {
                // What an instance stands in is what the source claims to emit into.
                found.2 = placed.source.region;
            }
            seen = Some((found, body));
        }
    };
    match &scene.nested {
        _ if !scene.meets_other_bodies(placed.location) => {}
        Some(nested) => {
            let region = nested.between(placed.location).unwrap_or(Region::World);
            nested.visit(region, ray, &mut reach, look);
        }
        None => {
            let instances = &scene.instances;
            instances.visit(ray, &mut reach, |_, instance, reach| look(instance, reach));
        }
    }
    seen
}

/// The first surface that a ray from a source sees must face it with the region of the source, and
/// the ray must not start in a surface and go into it: it would go on behind as if there were none.
/// `exact` is the same ray before its start is moved off what carries the source.
pub(super) fn probe(
    scene: &Scene,
    placed: &PlacedSource,
    exact: &Ray,
    ray: &Ray,
) -> Result<(), Wrong> {
    let back = scene.offset();
    let before = Ray {
        origin: exact.origin - back * exact.direction,
        ..*exact
    };
    let line = |surface: &CompiledSurface, patch: u32| surface.patches[patch as usize].line;
    let mut seen = first(scene, placed, &before);
    if let Some(((distance, surface, faces, patch), _)) = seen
        && distance <= 2.0 * back
    {
        if faces == placed.source.region {
            return Err(Wrong::Into(line(surface, patch)));
        }
        seen = first(scene, placed, ray);
    }
    match seen {
        Some(((_, surface, faces, patch), body)) if faces != placed.source.region => Err(
            Wrong::Faces(line(surface, patch), named(scene, body, faces)),
        ),
        None if placed.source.region != Region::World => Err(Wrong::Nothing),
        _ => Ok(()),
    }
}
