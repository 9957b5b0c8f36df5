// SPDX-License-Identifier: MIT OR Apache-2.0
//! Instances that stand in array solids.
//!
//! Light in the medium of such a solid meets the solid's surfaces and the skins of the instances in
//! it. Light of the world meets the solid and the instances that stand in the world. Each of these
//! media has its own search structure. The solids' frame is that of the world.

use super::compiled::{Body, BodyHit};
use super::instances::{Instance, InstanceSearch, Instances};
use super::{Candidates, Hit, Location, Scene};
use crate::ray::Ray;
use crate::shape::Reach;
use crate::surface::Region;

/// The instances that light in one medium may meet.
struct Group {
    instances: Instances,
    /// Their numbers in the scene.
    numbers: Vec<u32>,
}

/// The medium around each instance of a scene with instances in array solids.
pub(crate) struct Nested {
    /// The instance of the array solids.
    array_solids: u32,
    /// The region around each instance: the world, or a medium of the array solids.
    outside: Vec<Region>,
    /// Instances in the world, the array solids included.
    world: Group,
    /// Instances in each medium of the array solids; `None` for media without instances.
    within: Vec<Option<Group>>,
    /// Number of each instance in its group.
    local: Vec<u32>,
}

impl Group {
    fn new(numbers: Vec<u32>, list: &[Instance], bodies: &[Body], search: InstanceSearch) -> Self {
        let own = numbers.iter().map(|number| list[*number as usize]);
        Self { instances: Instances::new(own.collect(), bodies, search), numbers }
    }
}

impl Nested {
    /// `outside` names the medium of the array solids around each instance but the last of `list`.
    /// Returns `None` where all stand in the world.
    pub fn new(
        outside: &[Option<u8>],
        list: &[Instance],
        bodies: &[Body],
        search: InstanceSearch,
    ) -> Option<Self> {
        let max = outside.iter().copied().flatten().max()?;
        let array_solids = outside.len() as u32;
        let stands = outside.iter().chain([&None]);
        let outside: Vec<Region> =
            stands.map(|medium| medium.map_or(Region::World, Region::Body)).collect();
        let mut local = vec![0; outside.len()];
        let mut group = |region: Region| {
            let numbers = (0..=array_solids).filter(|number| outside[*number as usize] == region);
            let numbers: Vec<u32> = numbers.collect();
            for (within, number) in (0..).zip(&numbers) {
                local[*number as usize] = within;
            }
            Group::new(numbers, list, bodies, search)
        };
        let world = group(Region::World);
        let within = (0..=max).map(|medium| {
            let group = group(Region::Body(medium));
            (!group.numbers.is_empty()).then_some(group)
        });
        let within = within.collect();
        Some(Self { array_solids, outside, world, within, local })
    }

    /// The location outside of an instance.
    pub fn around(&self, instance: u32) -> Location {
        match self.outside[instance as usize] {
            Region::Body(medium) => Location::Inside { instance: self.array_solids, medium },
            Region::World | Region::Opaque => Location::World,
        }
    }

    /// The region between instances that a location names: the world, or a medium of the array
    /// solids; `None` inside of instances.
    pub fn between(&self, location: Location) -> Option<Region> {
        match location {
            Location::World => Some(Region::World),
            Location::Inside { instance, medium } if instance == self.array_solids => {
                Some(Region::Body(medium))
            }
            Location::Inside { .. } => None,
        }
    }

    fn group(&self, region: Region) -> Option<&Group> {
        match region {
            Region::World => Some(&self.world),
            Region::Body(medium) => self.within.get(usize::from(medium))?.as_ref(),
            Region::Opaque => None,
        }
    }

    /// The nearest hit on an instance in this region, with its number.
    fn nearest(
        &self,
        bodies: &[Body],
        ray: &Ray,
        reach: Reach,
        region: Region,
        candidates: Candidates,
    ) -> Option<(u32, BodyHit)> {
        let group = self.group(region)?;
        let stands_here = |number: &u32| self.outside[*number as usize] == region;
        let local = |number: u32| self.local[number as usize];
        let except = candidates.except.filter(stands_here);
        let met = match candidates.only {
            None => group.instances.nearest(bodies, ray, reach, except.map(local)),
            Some(only) => {
                let here = [only, self.array_solids].into_iter().filter(stands_here);
                let numbers = here.filter(|number| except != Some(*number)).map(local);
                group.instances.nearest_of(bodies, ray, reach, numbers)
            }
        };
        met.map(|(within, hit)| (group.numbers[within as usize], hit))
    }

    /// Calls `test` for every instance of this region whose box the ray may meet within `reach`,
    /// which `test` may shorten.
    pub fn visit(
        &self,
        region: Region,
        ray: &Ray,
        reach: &mut Reach,
        mut test: impl FnMut(&Instance, &mut Reach),
    ) {
        if let Some(group) = self.group(region) {
            let instances = &group.instances;
            instances.visit(ray, reach, |_, instance, reach| test(instance, reach));
        }
    }
}

impl Scene {
    /// [`Scene::nearest`] where instances stand in array solids.
    pub(crate) fn nearest_of_nested(
        &self,
        nested: &Nested,
        ray: &Ray,
        location: Location,
        candidates: Candidates,
    ) -> Option<Hit<'_>> {
        let mut reach = self.reach();
        // The surfaces of the region itself: of the world, or of the body that it belongs to.
        let own = match location {
            Location::World => {
                let hit = self.ground.nearest(None, ray, reach);
                hit.map(|hit| Self::hit_of(&self.ground, None, hit))
            }
            Location::Inside { instance, medium } => {
                let body = self.body(instance);
                let hit = body.nearest(Some(medium), ray, reach);
                hit.map(|hit| Self::hit_of(body, Some(instance), hit))
            }
        };
        let Some(region) = nested.between(location) else {
            return own;
        };
        if let Some(hit) = &own {
            reach.to = hit.distance;
        }
        let met = nested.nearest(&self.bodies, ray, reach, region, candidates);
        met.map_or(own, |(instance, hit)| {
            Some(Self::hit_of(self.body(instance), Some(instance), hit))
        })
    }
}
