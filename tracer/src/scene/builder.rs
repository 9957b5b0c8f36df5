// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene builder: prototypes, their places, surfaces of the world, sources.

mod checks;

use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::compiled::{Around, Body, CompiledMedium};
use super::instances::{Instance, Instances};
use super::lines::Lines;
use super::nested::Nested;
use super::prototype::Prototype;
use super::surroundings::{Containments, Surroundings, medium};
use super::validate;
use super::{InstanceSearch, Location, PlacedSource, Scene};
use crate::error::Error;
use crate::optics::media::Medium;
use crate::shape::{Bounds, RELATIVE_PAD};
use crate::source::Source;
use crate::surface::{Region, Surface};

/// The number of a prototype of a scene being built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrototypeId(usize);

/// A scene being built.
#[derive(Debug, Clone)]
pub struct SceneBuilder {
    world: Medium,
    prototypes: Vec<Prototype>,
    instances: Vec<(PrototypeId, DVec3)>,
    surfaces: Vec<Surface>,
    sources: Vec<Source>,
    /// The prototype of the array solids, which stand between, above or around the instances.
    array_solids: Option<PrototypeId>,
    power: f64,
    search: InstanceSearch,
    isolated: bool,
}

impl SceneBuilder {
    /// An empty scene in the medium `world`, whose sources will emit 1 W together.
    pub fn new(world: Medium) -> Self {
        Self {
            world,
            prototypes: Vec::new(),
            instances: Vec::new(),
            surfaces: Vec::new(),
            sources: Vec::new(),
            array_solids: None,
            power: 1.0,
            search: InstanceSearch::Automatic,
            isolated: false,
        }
    }

    /// Adds a prototype, to be placed.
    pub fn prototype(&mut self, prototype: Prototype) -> PrototypeId {
        self.prototypes.push(prototype);
        PrototypeId(self.prototypes.len() - 1)
    }

    /// Places an instance with its origin at `position`, mm.
    pub fn place(&mut self, prototype: PrototypeId, position: DVec3) -> &mut Self {
        self.instances.push((prototype, position));
        self
    }

    /// Places the array solids: a prototype at the origin whose solids stand between, above or
    /// around the instances. A solid encloses an instance wholly or not at all; its medium then is
    /// the instance's [`Region::World`], which scattering tables have to fit. Array solids cut no
    /// instance, no wall and not each other, and carry no sources. A second call replaces the
    /// first.
    pub fn array_solids(&mut self, prototype: PrototypeId) -> &mut Self {
        self.array_solids = Some(prototype);
        self
    }

    /// Adds a surface of the world: a ground, a wall. Its sides are `World` or `Opaque`.
    pub fn surface(&mut self, surface: Surface) -> &mut Self {
        self.surfaces.push(surface);
        self
    }

    /// Adds a source of the world.
    pub fn source(&mut self, source: Source) -> &mut Self {
        self.sources.push(source);
        self
    }

    /// Power that all sources emit together, W (default 1).
    pub fn power(&mut self, watts: f64) -> &mut Self {
        self.power = watts;
        self
    }

    /// Chooses the search for instances; for tests and measurements, results do not depend on it.
    pub fn search(&mut self, search: InstanceSearch) -> &mut Self {
        self.search = search;
        self
    }

    /// True if light meets no instance but the one that carries its source, as if each stood alone
    /// on the ground of all; default: it meets any.
    pub fn isolated(&mut self, isolated: bool) -> &mut Self {
        self.isolated = isolated;
        self
    }

    /// Checks everything and prepares the scene.
    pub fn build(&self) -> Result<Scene, Error> {
        let containments = self.containments()?;
        let outside = |instance: usize| {
            let array_solids = self.array_solids.map(|id| &self.prototypes[id.0]);
            medium(array_solids, containments.outside[instance], &self.world)
        };
        self.check(outside)?;
        crate::error::positive("power of the scene, W", self.power)?;

        let mut lines = Lines::default();
        let world = CompiledMedium {
            index: self.world.index,
            absorption: self.world.absorption_per_mm,
            line: lines.medium(&self.world.name),
            collisions: None,
        };
        let (bodies, list) = self.bodies(&containments, &mut lines);
        let around = Around { medium: &self.world, enclosed: false };
        let ground = Body::new(&[], &self.surfaces, around, &mut lines);
        let instances = Instances::new(list, &bodies, self.search);
        let nested = Nested::new(&containments.outside, &instances.list, &bodies, self.search);
        let of_prototypes = self.instances.iter().flat_map(|(id, position)| {
            let prototype = &self.prototypes[id.0];
            let anchors = prototype.surfaces.iter().filter_map(|s| s.shape.anchor());
            let sources = prototype.sources.iter().map(|source| source.position);
            let place = *position;
            anchors.chain(sources).map(move |at| at + place)
        });
        let of_world = self.surfaces.iter().filter_map(|s| s.shape.anchor());
        let sources = self.sources.iter().map(|source| source.position);
        let offset = RELATIVE_PAD
            * extent(&instances, &ground, of_prototypes.chain(of_world).chain(sources));

        let scene = Scene {
            world,
            ground,
            sources: self.sources(&containments.outside),
            instances,
            bodies,
            lines: Arc::new(lines),
            power: self.power,
            offset,
            isolated: self.isolated,
            array_solids: self.array_solids.map(|_| self.instances.len() as u32),
            nested,
        };
        validate::check(&scene, containments)?;
        Ok(scene)
    }

    /// The number of the prototype of an instance.
    fn prototype_of(&self, instance: usize) -> usize {
        self.instances[instance].0.0
    }

    /// Media in which the instances stand.
    fn containments(&self) -> Result<Containments, Error> {
        let levels = self.surfaces.iter().filter_map(|surface| {
            let Bounds { low, high } = surface.shape.bounds();
            let level = high.z - low.z <= 0.0 && surface.inner == Region::Opaque;
            level.then_some(high.z)
        });
        let ground = levels.fold(f64::NEG_INFINITY, f64::max);
        let array_solids = self.array_solids.map(|id| &self.prototypes[id.0]);
        let placed = self.instances.iter().map(|(id, at)| (id.0, *at));
        Containments::new(
            &self.prototypes,
            &placed.collect::<Vec<_>>(),
            array_solids.map(|array_solids| Surroundings::new(array_solids, ground)),
            &self.world,
        )
    }

    /// Compiled bodies, one of each prototype for each medium around its instances; and all
    /// instances, the array solids last.
    fn bodies(&self, containments: &Containments, lines: &mut Lines) -> (Vec<Body>, Vec<Instance>) {
        let array_solids = self.array_solids.map(|id| (id, DVec3::ZERO));
        let placed = self.instances.iter().chain(array_solids.as_ref());
        let outside = containments.outside.iter().copied().chain([None]);
        let stands: Vec<(usize, Option<u8>)> =
            placed.clone().map(|(id, _)| id.0).zip(outside).collect();
        let holder = self.array_solids.map(|id| &self.prototypes[id.0]);
        let mut around_each = vec![BTreeSet::new(); self.prototypes.len()];
        for (prototype, outside) in &stands {
            around_each[*prototype].insert(*outside);
        }
        let (mut bodies, mut kinds) = (Vec::new(), BTreeMap::new());
        for ((number, prototype), mut held) in self.prototypes.iter().enumerate().zip(around_each) {
            if held.is_empty() {
                held.insert(None);
            }
            for outside in held {
                let around = Around {
                    medium: medium(holder, outside, &self.world),
                    enclosed: outside.is_some(),
                };
                kinds.insert((number, outside), bodies.len() as u32);
                bodies.push(Body::new(&prototype.media, &prototype.surfaces, around, lines));
            }
        }
        let list = stands.iter().zip(placed).map(|(stands, (_, position))| Instance {
            prototype: kinds[stands],
            position: *position,
        });
        (bodies, list.collect())
    }

    /// Sources where they stand; `outside` tells what their instances stand in.
    fn sources(&self, outside: &[Option<u8>]) -> Vec<PlacedSource> {
        let array_solids = self.instances.len() as u32;
        let mut sources: Vec<PlacedSource> = Vec::new();
        let mut sum = 0.0;
        let mut add = |source: &Source, location: Location, instance: Option<u32>| {
            sum += source.weight;
            sources.push(PlacedSource {
                source: source.clone(),
                location,
                instance,
                cumulated: sum,
            });
        };
        for (number, (PrototypeId(prototype), position)) in self.instances.iter().enumerate() {
            let instance = number as u32;
            for source in &self.prototypes[*prototype].sources {
                match source.region {
                    Region::Body(medium) => {
                        add(source, Location::Inside { instance, medium }, Some(instance));
                    }
                    Region::World | Region::Opaque => {
                        let mut source =
                            Source { position: source.position + *position, ..source.clone() };
                        let held = outside[number].map(|medium| {
                            source.region = Region::Body(medium);
                            Location::Inside { instance: array_solids, medium }
                        });
                        add(&source, held.unwrap_or(Location::World), Some(instance));
                    }
                }
            }
        }
        for source in &self.sources {
            add(source, Location::World, None);
        }
        for placed in &mut sources {
            placed.cumulated /= sum;
        }
        sources
    }
}

/// Largest finite coordinate of the scene, mm, the points of its planes and sources among them; 1
/// if there is none.
fn extent(instances: &Instances, ground: &Body, points: impl Iterator<Item = DVec3>) -> f64 {
    let boxes = [instances.bounds, ground.bounds];
    let numbers = boxes
        .into_iter()
        .flat_map(|one| [one.low, one.high])
        .chain(points)
        .flat_map(|corner| corner.to_array());
    let largest = numbers.map(f64::abs).filter(|value| value.is_finite()).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}
