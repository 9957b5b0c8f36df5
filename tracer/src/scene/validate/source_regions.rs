// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks that every source lies inside the medium it names.
//!
//! The surface that a ray sees first must face it with the region of the source. Some sampled rays
//! stand for all rays of a source; of a ray set, every ray is judged. [`coplanar_emitters`] judges
//! the flat faces in which an emitter lies or through which it reaches.

mod coplanar_emitters;

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::error::Error;
use crate::random;
use crate::ray::Ray;
use crate::scene::compiled::FirstSeen;
use crate::scene::instances::Instance;
use crate::scene::{Body, Location, PlacedSource, Scene};
use crate::shape::{Bounds, Reach};
use crate::source::{Emission, RaySet, Source};
use crate::surface::Region;

/// Sampled rays of a source that are judged.
const PROBES: u64 = 256;

/// Judges all sources, one of each kind.
pub(super) fn check(scene: &Scene) -> Result<(), Error> {
    let wrong = kinds(scene).into_par_iter().find_map_first(|placed| judge(scene, placed).err());
    wrong.map_or(Ok(()), Err)
}

/// The surroundings that decide on a source of the world: the body of the only instance near it, and
/// its position relative to that; with no instance near it, its height alone.
type Surroundings = (Option<u32>, DVec3);

/// The first source of each kind. Sources of a kind see the same.
fn kinds(scene: &Scene) -> Vec<&PlacedSource> {
    let mut first = vec![None; scene.bodies.len()];
    let mut known: Vec<(Surroundings, &PlacedSource)> = Vec::new();
    // No path begins at a dark source.
    let lit = scene.sources.iter().filter(|placed| placed.source.weight > 0.0);
    lit.filter(|placed| {
        if let Location::Inside { instance, .. } = placed.location {
            let prototype = scene.instances.list[instance as usize].prototype as usize;
            return scene.meets_other_bodies(placed.location)
                || *first[prototype].get_or_insert(instance) == instance;
        }
        let Some(surroundings) = surroundings(scene, &placed.source) else {
            return true;
        };
        let (body, at) = surroundings;
        let is_known = known.iter().any(|((known_body, known_at), known)| {
            body == *known_body
                && at.distance(*known_at) <= scene.offset()
                && is_alike(&placed.source, &known.source)
        });
        if !is_known {
            known.push((surroundings, *placed));
        }
        !is_known
    })
    .collect()
}

/// True of sources that differ in name, position and weight at most.
fn is_alike(one: &Source, other: &Source) -> bool {
    let emission = match (&one.emission, &other.emission) {
        (Emission::Rays(one), Emission::Rays(other)) => Arc::ptr_eq(one, other),
        (Emission::Table(one), Emission::Table(other)) => Arc::ptr_eq(one, other),
        (one, other) => one == other,
    };
    let Source { region, emitter, normal, along, .. } = one;
    let same = (region, emitter, normal, along);
    emission && same == (&other.region, &other.emitter, &other.normal, &other.along)
}

/// The surroundings of a source of the world that starts near no wall, below none, and near one
/// instance at most: the outer faces of all others look the same to it.
fn surroundings(scene: &Scene, source: &Source) -> Option<Surroundings> {
    let starts = coplanar_emitters::around(scene, source);
    let mut walls = scene.ground.surfaces.iter().map(|surface| surface.shape.bounds());
    let is_beside = |wall: &Bounds| starts.overlaps(wall) || starts.low.z < wall.low.z;
    if walls.any(|wall| wall.is_finite() && is_beside(&wall)) {
        return None;
    }
    match scene.instances.near(&starts, 2)[..] {
        [] => Some((None, DVec3::Z * source.position.z)),
        [only] => {
            let instance = &scene.instances.list[only as usize];
            Some((Some(instance.prototype), source.position - instance.position))
        }
        _ => None,
    }
}

/// Judges one source.
fn judge(scene: &Scene, placed: &PlacedSource) -> Result<(), Error> {
    if let Emission::Rays(set) = &placed.source.emission {
        return each_ray(scene, placed, set);
    }
    let mut rng = random::stream(0x0b5e_55ed, 0);
    (0..PROBES)
        .try_for_each(|_| {
            let exact = placed.source.sample(0.0, &mut rng.clone());
            let ray = placed.source.sample(scene.offset(), &mut rng);
            probe(scene, placed, &exact, &ray)
        })
        .and_then(|()| coplanar_emitters::check(scene, placed))
        .map_err(|wrong| wrong.into_error(scene, placed, None))
}

/// Judges every ray of a set; the error names the first wrong one.
fn each_ray(scene: &Scene, placed: &PlacedSource, set: &RaySet) -> Result<(), Error> {
    let wrong = (0..set.len()).into_par_iter().find_map_first(|number| {
        let ray = placed.source.placed(set.ray(number), scene.offset());
        let exact = placed.source.placed(set.ray(number), 0.0);
        let wrong = probe(scene, placed, &exact, &ray).err()?;
        Some(wrong.into_error(scene, placed, Some((set.record(number), ray))))
    });
    wrong.map_or(Ok(()), Err)
}

/// The name of the medium in a region of a body.
fn named(scene: &Scene, body: &Body, region: Region) -> String {
    let line = match region {
        Region::World => body.outside,
        Region::Body(medium) => body.media[usize::from(medium)].line,
        Region::Opaque => return "something opaque".to_owned(),
    };
    scene.lines.media[line].clone()
}

/// The name of the medium that a source names.
fn claimed(scene: &Scene, placed: &PlacedSource) -> String {
    let body = match placed.location {
        Location::Inside { instance, .. } => scene.body(instance),
        Location::World => &scene.ground,
    };
    named(scene, body, placed.source.region)
}

/// Why a ray of a source is wrong.
pub(super) enum Misplacement {
    /// It sees the surface of this ledger line first, from the side of a medium of this name.
    Faces(usize, String),
    /// It starts in the surface of this ledger line and goes into it.
    Into(usize),
    /// It sees no surface.
    Nothing,
}

impl Misplacement {
    /// The error; `ray` holds the number and the ray where it is one of a set.
    fn into_error(self, scene: &Scene, placed: &PlacedSource, ray: Option<(usize, Ray)>) -> Error {
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
            Self::Into(line) => {
                Error::SourceInSurface { source_name, surface: scene.lines.surfaces[line].clone() }
            }
            Self::Nothing => Error::OpenBody { source_name, region },
        }
    }
}

/// The surface that a ray sees first, and its body.
type Seen<'a> = (FirstSeen, &'a Body);

/// The first surface that a ray of a source sees.
fn first<'a>(scene: &'a Scene, placed: &PlacedSource, ray: &Ray) -> Option<Seen<'a>> {
    let mut reach = Reach::AHEAD;
    let mut seen = None;
    let around = match placed.location {
        Location::Inside { instance, .. } => scene.body(instance),
        Location::World => &scene.ground,
    };
    if let Some(found) = around.first_seen(ray, reach) {
        reach.to = found.distance;
        seen = Some((found, around));
    }
    let mut look = |instance: &Instance, reach: &mut Reach| {
        let body = &scene.bodies[instance.prototype as usize];
        if let Some(mut found) = body.first_seen(&instance.local(ray), *reach) {
            reach.to = found.distance;
            if found.faces == Region::World {
                // Outside of an instance lies the medium of the source.
                found.faces = placed.source.region;
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

/// Checks one ray of a source. The surface it sees first must face it with the region of the
/// source, and the ray must not start in a surface and go into it, because it would continue
/// behind. `exact` is the ray before its start is moved off the surface that carries the source.
pub(super) fn probe(
    scene: &Scene,
    placed: &PlacedSource,
    exact: &Ray,
    ray: &Ray,
) -> Result<(), Misplacement> {
    let back = scene.offset();
    let before = Ray { origin: exact.origin - back * exact.direction, ..*exact };
    let mut seen = first(scene, placed, &before);
    if let Some((met, _)) = seen
        && met.distance <= 2.0 * back
    {
        if met.faces == placed.source.region {
            return Err(Misplacement::Into(met.line));
        }
        seen = first(scene, placed, ray);
    }
    match seen {
        Some((met, body)) if met.faces != placed.source.region => {
            Err(Misplacement::Faces(met.line, named(scene, body, met.faces)))
        }
        None if placed.source.region != Region::World => Err(Misplacement::Nothing),
        _ => Ok(()),
    }
}
