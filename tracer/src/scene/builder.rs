// SPDX-License-Identifier: MIT OR Apache-2.0
//! Building a scene step by step: prototypes, their places, surfaces of the world, sources.

use glam::DVec3;
use std::sync::Arc;

use super::compiled::{Body, ReadyMedium, media_line};
use super::instances::{Instance, Instances};
use super::validate;
use super::{Place, Scene, Search, Slot};
use crate::error::Error;
use crate::ledger::Lines;
use crate::medium::Medium;
use crate::shape::RELATIVE_PAD;
use crate::source::Source;
use crate::surface::{Region, Surface};

/// A body described once, in its own frame (its axis is z).
#[derive(Debug, Clone, Default)]
pub struct Prototype {
    /// The media inside; `Region::Body(k)` is the k-th.
    pub media: Vec<Medium>,
    /// All surfaces.
    pub surfaces: Vec<Surface>,
    /// Sources that every instance carries.
    pub sources: Vec<Source>,
}

/// A prototype of a scene being built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrototypeId(usize);

/// A scene being built.
#[derive(Debug, Clone)]
pub struct SceneBuilder {
    pub(super) world: Medium,
    pub(super) prototypes: Vec<Prototype>,
    pub(super) instances: Vec<(PrototypeId, DVec3)>,
    pub(super) surfaces: Vec<Surface>,
    pub(super) sources: Vec<Source>,
    /// The prototype whose solids stand among the instances.
    pub(super) among: Option<PrototypeId>,
    power: f64,
    search: Search,
    apart: bool,
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
            among: None,
            power: 1.0,
            search: Search::Automatic,
            apart: false,
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

    /// Places `columns` × `rows` instances at distances of `pitch` mm along x and y, centred on the origin.
    pub fn place_array(
        &mut self,
        prototype: PrototypeId,
        columns: usize,
        rows: usize,
        pitch: f64,
    ) -> &mut Self {
        let middle = |count: usize| 0.5 * (count as f64 - 1.0);
        for row in 0..rows {
            for column in 0..columns {
                let (x, y) = (column as f64 - middle(columns), row as f64 - middle(rows));
                self.place(prototype, DVec3::new(x * pitch, y * pitch, 0.0));
            }
        }
        self
    }

    /// Places a prototype once, at the origin, whose solids stand among the instances, between, above or around them: they may stand in the box around one,
    /// but cut none, nor each other, nor a wall. It carries no sources. The last one placed so counts.
    pub fn among(&mut self, prototype: PrototypeId) -> &mut Self {
        self.among = Some(prototype);
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

    /// How instances are searched; for tests and measurements, results do not depend on it.
    pub fn search(&mut self, search: Search) -> &mut Self {
        self.search = search;
        self
    }

    /// Whether light meets no instance but the one that carries its source, as if each stood alone on the ground of all; default: it meets any.
    pub fn apart(&mut self, apart: bool) -> &mut Self {
        self.apart = apart;
        self
    }

    /// Checks everything and prepares the scene.
    pub fn build(&self) -> Result<Scene, Error> {
        validate::parts(self)?;
        crate::error::positive("power of the scene, W", self.power)?;

        let mut lines = Lines {
            surfaces: Vec::new(),
            skin: Vec::new(),
            media: Vec::new(),
        };
        let world = ReadyMedium {
            absorption: self.world.absorption_per_mm,
            line: media_line(&mut lines, &self.world.name),
        };
        let bodies: Vec<Body> = self
            .prototypes
            .iter()
            .map(|prototype| {
                Body::new(
                    &prototype.media,
                    &prototype.surfaces,
                    &self.world,
                    &mut lines,
                )
            })
            .collect();
        let ground = Body::new(&[], &self.surfaces, &self.world, &mut lines);
        let among = self.among.map(|id| (id, DVec3::ZERO));
        let list: Vec<Instance> = self
            .instances
            .iter()
            .chain(among.as_ref())
            .map(|&(PrototypeId(prototype), position)| Instance {
                prototype: prototype as u32,
                position,
            })
            .collect();
        let instances = Instances::new(list, &bodies, self.search);
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
            * extent(
                &instances,
                &ground,
                of_prototypes.chain(of_world).chain(sources),
            );

        let scene = Scene {
            world,
            ground,
            slots: self.slots(),
            instances,
            bodies,
            lines: Arc::new(lines),
            power: self.power,
            offset,
            apart: self.apart,
            among: among.map(|_| self.instances.len() as u32),
        };
        validate::whole(&scene)?;
        Ok(scene)
    }

    fn slots(&self) -> Vec<Slot> {
        let mut slots: Vec<Slot> = Vec::new();
        let mut sum = 0.0;
        let mut add = |source: &Source, place: Place, instance: Option<u32>| {
            sum += source.weight;
            slots.push(Slot {
                source: source.clone(),
                place,
                instance,
                cumulated: sum,
            });
        };
        for (number, (PrototypeId(prototype), position)) in self.instances.iter().enumerate() {
            let instance = number as u32;
            for source in &self.prototypes[*prototype].sources {
                match source.region {
                    Region::Body(medium) => {
                        add(source, Place::Inside { instance, medium }, Some(instance));
                    }
                    Region::World | Region::Opaque => {
                        let source = Source {
                            position: source.position + *position,
                            ..source.clone()
                        };
                        add(&source, Place::World, Some(instance));
                    }
                }
            }
        }
        for source in &self.sources {
            add(source, Place::World, None);
        }
        for slot in &mut slots {
            slot.cumulated /= sum;
        }
        slots
    }
}

/// Largest finite coordinate of the scene, mm, the points of its planes and sources among them; 1 if there is none.
fn extent(instances: &Instances, ground: &Body, points: impl Iterator<Item = DVec3>) -> f64 {
    let corners = [instances.low, instances.high, ground.low, ground.high];
    let numbers = corners
        .into_iter()
        .chain(points)
        .flat_map(|corner| corner.to_array());
    let largest = numbers
        .map(f64::abs)
        .filter(|value| value.is_finite())
        .fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}
