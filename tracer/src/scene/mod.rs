// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scenes: prototypes placed as instances, surfaces of the world around them, and sources.
//!
//! [`SceneBuilder`] checks its input and compiles a [`Scene`]; a scene that exists is valid. A
//! package is described once in its own frame and placed many times, so light that leaves one
//! instance can enter another.
//!
//! A ray inside a body is kept in the frame of that body and meets only the surfaces that border
//! its medium. In the world it meets the surfaces of the world and the skins of all instances.
//!
//! Array solids may stand between the instances and enclose some of them. For an enclosed instance
//! the world is the medium of that solid. A ray in such a medium meets the solid's own surfaces and
//! the skins of the instances in it.

mod builder;
mod compiled;
mod film_faces;
mod instances;
mod lines;
mod nested;
mod prototype;
mod surroundings;
mod validate;

pub use builder::{PrototypeId, SceneBuilder};
pub use instances::{HIERARCHY_FROM, InstanceSearch};
pub use lines::Lines;
pub use prototype::Prototype;
pub use surroundings::{Containment, Surroundings};

use bsdf::Side;
use glam::DVec3;
use std::collections::BTreeSet;
use std::sync::Arc;

use crate::optics::luminescence::{Collisions, Luminophore};
use crate::ray::Ray;
use crate::shape::{Bounds, PacketTraversal, RELATIVE_PAD, Reach};
use crate::source::Source;
use crate::surface::SurfaceModel;
pub(crate) use compiled::Body;
use compiled::BodyHit;
pub(crate) use compiled::{CompiledMedium, CompiledPatch, CompiledSurface};
pub(crate) use film_faces::FilmFaces;
pub(crate) use instances::Instance;
use instances::Instances;
use nested::Nested;

/// The region of a ray: the world, or a medium of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Location {
    World,
    Inside { instance: u32, medium: u8 },
}

/// A source at its place in the scene.
#[derive(Debug, Clone)]
pub(crate) struct PlacedSource {
    pub source: Source,
    pub location: Location,
    /// The instance that carries it; `None` for a source of the world.
    pub instance: Option<u32>,
    /// Sum of the weights of this source and of all before it, as a share of the whole.
    pub cumulated: f64,
}

/// A hit in the frame of the body that the surface belongs to.
#[derive(Clone, Copy)]
pub(crate) struct Hit<'a> {
    pub distance: f64,
    pub surface: &'a CompiledSurface,
    pub primitive: u32,
    pub side: Side,
    /// The instance met; `None` for a surface of the world.
    pub instance: Option<u32>,
}

/// The instances that a ray of the world may meet next.
#[derive(Clone, Copy)]
pub(crate) struct Candidates {
    /// An instance that it has left for good, see [`Scene::convex_exit`].
    pub except: Option<u32>,
    /// The only instance that it may meet, see [`Scene::only_candidate`].
    pub only: Option<u32>,
}

/// Names of these lines of `all`, each once and in the order of `all`.
fn names(all: &[String], lines: impl Iterator<Item = usize>) -> Vec<String> {
    let lines: BTreeSet<usize> = lines.collect();
    lines.into_iter().map(|line| all[line].clone()).collect()
}

/// A valid scene, ready for tracing.
pub struct Scene {
    pub(crate) world: CompiledMedium,
    /// Surfaces of the world itself.
    pub(crate) ground: Body,
    pub(crate) bodies: Vec<Body>,
    pub(crate) instances: Instances,
    pub(crate) sources: Vec<PlacedSource>,
    pub(crate) lines: Arc<Lines>,
    pub(crate) power: f64,
    offset: f64,
    /// True if light meets no instance but the one that carries its source.
    isolated: bool,
    /// The instance of the array solids, which is the last one.
    array_solids: Option<u32>,
    /// Search structures where instances stand in array solids.
    pub(crate) nested: Option<Nested>,
}

impl Scene {
    /// Power emitted by all sources together, W.
    pub fn power(&self) -> f64 {
        self.power
    }

    /// The scene with the sources of instance `number` alone, in the order in which instances were
    /// placed. They emit the power of the whole scene. An instance without sources changes nothing.
    #[must_use]
    pub fn lit_by(self, number: usize) -> Self {
        if !self.sources.iter().any(|placed| placed.instance == Some(number as u32)) {
            return self;
        }
        let mut drives = vec![0.0; self.instances.list.len()];
        drives[number] = 1.0;
        let power = self.power;
        Self { power, ..self.driven(&drives) }
    }

    /// The scene with the power of the sources of each instance times its drive, a number of at least
    /// 0, in the order in which instances were placed. Sources keep their numbers; those of the world
    /// and of instances beyond the last drive stay as they are.
    #[must_use]
    pub fn driven(mut self, drives: &[f64]) -> Self {
        let (mut before, mut sum) = (0.0, 0.0);
        for placed in &mut self.sources {
            let weight = placed.cumulated - before;
            before = placed.cumulated;
            let drive = placed.instance.and_then(|number| drives.get(number as usize));
            sum += weight * drive.copied().unwrap_or(1.0);
            placed.cumulated = sum;
        }
        if sum > 0.0 {
            self.sources.iter_mut().for_each(|placed| placed.cumulated /= sum);
        }
        self.power *= sum;
        self
    }

    /// Names of surfaces and media, in the order of their numbers in a ledger and an observer.
    pub fn lines(&self) -> &Lines {
        &self.lines
    }

    /// Ledger names of the surfaces that scatter, and so leave light unpolarised, in ledger order.
    pub fn scattering_surfaces(&self) -> Vec<String> {
        let patches = self
            .bodies
            .iter()
            .chain([&self.ground])
            .flat_map(|body| body.surfaces.iter().flat_map(|s| &s.patches));
        let lines = patches.filter(|patch| patch.optics.scatters()).map(|patch| patch.line);
        names(&self.lines.surfaces, lines)
    }

    /// Names of the media that scatter, and so leave light unpolarised, in ledger order.
    pub fn scattering_media(&self) -> Vec<String> {
        let media = self.bodies.iter().flat_map(|body| &body.media);
        let scatters =
            |medium: &&CompiledMedium| medium.collisions.as_ref().is_some_and(Collisions::scatter);
        names(&self.lines.media, media.filter(scatters).map(|medium| medium.line))
    }

    /// Luminophores of all media.
    pub(crate) fn luminophores(&self) -> impl Iterator<Item = &Luminophore> {
        let media = self.bodies.iter().flat_map(|body| &body.media);
        let all = media.filter_map(|medium| medium.collisions.as_ref());
        all.flat_map(Collisions::luminophores).map(|(luminophore, _)| luminophore)
    }

    /// True if light goes round in a cell that repeats.
    pub(crate) fn is_periodic(&self) -> bool {
        let mut patches = self.ground.surfaces.iter().flat_map(|surface| &surface.patches);
        patches.any(|patch| matches!(patch.optics, SurfaceModel::Periodic))
    }

    /// Number of sources of all instances and of the world.
    pub fn sources(&self) -> usize {
        self.sources.len()
    }

    /// Number of instances, without the array solids.
    pub fn instances(&self) -> usize {
        self.instances.list.len() - usize::from(self.array_solids.is_some())
    }

    /// Highest point of all instances, mm, without the array solids; -∞ without instances.
    pub fn top_mm(&self) -> f64 {
        let tops = self.packages().map(|(body, position)| body.bounds.high.z + position.z);
        tops.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Bodies and positions of all instances, without the array solids.
    pub(crate) fn packages(&self) -> impl Iterator<Item = (&Body, DVec3)> {
        let list = &self.instances.list;
        let count = list.len() - usize::from(self.array_solids.is_some());
        let body = |prototype: u32| &self.bodies[prototype as usize];
        list[..count].iter().map(move |instance| (body(instance.prototype), instance.position))
    }

    /// The body of the array solids.
    pub(crate) fn array_solids(&self) -> Option<&Body> {
        self.array_solids.map(|number| self.body(number))
    }

    /// Boxes around everything solid: the bodies, with one box for each placed shape, and the
    /// walls.
    pub(crate) fn filled(&self) -> impl Iterator<Item = Bounds> {
        let bodies = self
            .packages()
            .chain(self.array_solids().map(|body| (body, DVec3::ZERO)))
            .flat_map(|(body, position)| body.boxes.iter().map(move |one| one.moved(position)));
        let walls = self.ground.surfaces.iter().filter(|s| s.is_wall());
        bodies.chain(walls.map(|wall| wall.shape.bounds()))
    }

    /// Distance of the start of a ray from the surface it leaves, mm: 1e-12 of the largest
    /// finite coordinate of the scene. That is a thousand times the rounding error of a point
    /// settled on its surface, and a millionth of the finest structure that light at 550 nm feels.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Distance of the start of a ray from `point` of `surface`, mm. It is [`Scene::offset`],
    /// or more where the same region lies on both sides and the point is farther out than the
    /// finite coordinates of the scene: such a surface must be left by more than rounding.
    #[inline]
    pub(crate) fn offset_from(&self, surface: &CompiledSurface, point: DVec3) -> f64 {
        let [inner, outer] = surface.regions;
        if inner == outer {
            return self.offset.max(RELATIVE_PAD * point.abs().max_element());
        }
        self.offset
    }

    /// Position of an instance; the origin for the world.
    #[inline]
    pub(crate) fn position(&self, instance: Option<u32>) -> DVec3 {
        instance.map_or(DVec3::ZERO, |number| self.instances.list[number as usize].position)
    }

    #[inline]
    fn body(&self, instance: u32) -> &Body {
        &self.bodies[self.instances.list[instance as usize].prototype as usize]
    }

    /// The instance, if it is convex: a ray that leaves it into the world cannot meet it again
    /// before it meets something else.
    #[inline]
    pub(crate) fn convex_exit(&self, instance: Option<u32>) -> Option<u32> {
        instance.filter(|number| self.body(*number).convex)
    }

    /// The only instance that light from this one can meet, where instances are isolated.
    #[inline]
    pub(crate) fn only_candidate(&self, instance: Option<u32>) -> Option<u32> {
        instance.filter(|_| self.isolated)
    }

    /// The location outside of an instance, or on the near side of a surface of the world.
    #[inline]
    pub(crate) fn around(&self, instance: Option<u32>) -> Location {
        match (&self.nested, instance) {
            (Some(nested), Some(instance)) => nested.around(instance),
            _ => Location::World,
        }
    }

    /// True if a ray in `location` may meet other bodies than its own.
    #[inline]
    pub(crate) fn meets_other_bodies(&self, location: Location) -> bool {
        let nested = self.nested.as_ref();
        location == Location::World
            || nested.is_some_and(|nested| nested.between(location).is_some())
    }

    /// A point of a ray in `location` in the frame of the instance that it meets.
    #[inline]
    pub(crate) fn in_frame(&self, at: DVec3, location: Location, met: Option<u32>) -> DVec3 {
        match (location, met) {
            // A ray in an array solid is kept in the frame of the world.
            (Location::Inside { instance, .. }, Some(met)) if instance == met => at,
            (_, None) => at,
            (_, Some(_)) => at - self.position(met),
        }
    }

    /// The medium at a location.
    #[inline]
    pub(crate) fn medium(&self, location: Location) -> &CompiledMedium {
        match location {
            Location::World => &self.world,
            Location::Inside { instance, medium } => {
                &self.body(instance).media[usize::from(medium)]
            }
        }
    }

    /// [`Scene::nearest`] for up to [`PACKET`](crate::shape::PACKET) rays within one medium of
    /// instances of one prototype. Every hit names `instance`, that of the first ray.
    pub(crate) fn nearest_of_many(
        &self,
        rays: &[Ray],
        instance: u32,
        medium: u8,
        traversal: &mut PacketTraversal,
    ) -> Vec<Option<Hit<'_>>> {
        let body = self.body(instance);
        let reach = self.reach();
        let hits = body.nearest_of_many(medium, rays, vec![reach; rays.len()], traversal);
        let numbered = |hit| Self::hit_of(body, Some(instance), hit);
        hits.into_iter().map(|hit| hit.map(numbered)).collect()
    }

    /// All distances ahead, and those just behind the start: a ray may start beyond another surface
    /// of an acute edge.
    #[inline]
    fn reach(&self) -> Reach {
        Reach { from: -4.0 * self.offset, to: f64::INFINITY }
    }

    #[inline]
    fn hit_of(body: &Body, instance: Option<u32>, hit: BodyHit) -> Hit<'_> {
        Hit {
            distance: hit.at.distance,
            surface: &body.surfaces[hit.surface as usize],
            primitive: hit.at.primitive,
            side: hit.at.side,
            instance,
        }
    }

    /// The nearest surface that borders the region of the ray, met from that region. Only for
    /// scenes without instances in array solids; [`Scene::nearest_of_nested`] serves the others.
    #[expect(
        clippy::inline_always,
        reason = "one copy of the loop over a path for each kind of light and observer: left \
            alone, the compiler calls it, a tenth slower"
    )]
    #[inline(always)]
    pub(crate) fn nearest(
        &self,
        ray: &Ray,
        location: Location,
        candidates: Candidates,
    ) -> Option<Hit<'_>> {
        let reach = self.reach();
        match location {
            Location::Inside { instance, medium } => {
                let body = self.body(instance);
                let hit = body.nearest(Some(medium), ray, reach)?;
                Some(Self::hit_of(body, Some(instance), hit))
            }
            Location::World => self.nearest_in_world(ray, reach, candidates),
        }
    }

    /// The nearest surface that a ray of the world meets before the distance `to`. Only for scenes
    /// without instances in array solids.
    #[inline]
    pub(crate) fn nearest_before(
        &self,
        ray: &Ray,
        to: f64,
        candidates: Candidates,
    ) -> Option<Hit<'_>> {
        self.nearest_in_world(ray, Reach { to, ..self.reach() }, candidates)
    }

    #[expect(clippy::inline_always, reason = "part of the loop over a path")]
    #[inline(always)]
    fn nearest_in_world(
        &self,
        ray: &Ray,
        mut reach: Reach,
        Candidates { except, only }: Candidates,
    ) -> Option<Hit<'_>> {
        let ground = self.ground.nearest(None, ray, reach);
        if let Some(hit) = ground {
            reach.to = hit.at.distance;
        }
        let met = match only {
            None => self.instances.nearest(&self.bodies, ray, reach, except),
            Some(only) => {
                let both = [Some(only), self.array_solids].into_iter().flatten();
                let numbers = both.filter(|number| except != Some(*number));
                self.instances.nearest_of(&self.bodies, ray, reach, numbers)
            }
        };
        if let Some((instance, hit)) = met {
            return Some(Self::hit_of(self.body(instance), Some(instance), hit));
        }
        ground.map(|hit| Self::hit_of(&self.ground, None, hit))
    }
}
