// SPDX-License-Identifier: MIT OR Apache-2.0
//! Instances that stand in solids among them.
//!
//! Light in the medium of such a solid meets the solid's surfaces and the skins of the instances in
//! it. Light of the world meets the solid and the instances that stand in the world. Each of these
//! media has its own search structure. The solids' frame is that of the world.

use super::compiled::{Body, BodyHit};
use super::instances::{Instance, InstanceSearch, Instances};
use super::{Hit, Location, Scene};
use crate::ray::Ray;
use crate::shape::Reach;
use crate::surface::Region;

/// The instances that light in one medium may meet.
struct Group {
    instances: Instances,
    /// Their numbers in the scene.
    numbers: Vec<u32>,
}

/// Which instances stand where, if any stands in a solid among them.
pub(crate) struct Nested {
    /// The instance of what stands among the others.
    among: u32,
    /// What each instance stands in: the world, or a medium of what stands among them.
    outside: Vec<Region>,
    /// Those of the world, what stands among them included.
    world: Group,
    /// Those of each medium of what stands among them; none for media in which nothing stands.
    within: Vec<Option<Group>>,
    /// The place of every instance in its group.
    local: Vec<u32>,
}

impl Group {
    fn new(numbers: Vec<u32>, list: &[Instance], bodies: &[Body], search: InstanceSearch) -> Self {
        let own = numbers.iter().map(|number| list[*number as usize]);
        Self {
            instances: Instances::new(own.collect(), bodies, search),
            numbers,
        }
    }
}

impl Nested {
    /// `outside` is what each instance but the last of `list` stands in; `None` where all stand in
    /// the world.
    pub fn new(
        outside: &[Option<u8>],
        list: &[Instance],
        bodies: &[Body],
        search: InstanceSearch,
    ) -> Option<Self> {
        let most = outside.iter().copied().flatten().max()?;
        let among = outside.len() as u32;
        let stands = outside.iter().chain([&None]);
        let outside: Vec<Region> = stands
            .map(|medium| medium.map_or(Region::World, Region::Body))
            .collect();
        let mut local = vec![0; outside.len()];
        let mut group = |region: Region| {
            let numbers = (0..=among).filter(|number| outside[*number as usize] == region);
            let numbers: Vec<u32> = numbers.collect();
            for (location, number) in (0..).zip(&numbers) {
                local[*number as usize] = location;
            }
            Group::new(numbers, list, bodies, search)
        };
        let world = group(Region::World);
        let within = (0..=most).map(|medium| {
            let group = group(Region::Body(medium));
            (!group.numbers.is_empty()).then_some(group)
        });
        let within = within.collect();
        Some(Self {
            among,
            outside,
            world,
            within,
            local,
        })
    }

    /// Where light goes that leaves an instance.
    pub fn around(&self, instance: u32) -> Location {
        match self.outside[instance as usize] {
            Region::Body(medium) => Location::Inside {
                instance: self.among,
                medium,
            },
            Region::World | Region::Opaque => Location::World,
        }
    }

    /// In what a location lies among the instances: the world, or a medium of what stands among
    /// them; none for places inside of instances.
    pub fn between(&self, location: Location) -> Option<Region> {
        match location {
            Location::World => Some(Region::World),
            Location::Inside { instance, medium } if instance == self.among => {
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

    /// The nearest hit on an instance that light in this region meets, with its number; see
    /// [`Scene::nearest`].
    fn nearest(
        &self,
        bodies: &[Body],
        ray: &Ray,
        mut reach: Reach,
        region: Region,
        [left, own]: [Option<u32>; 2],
    ) -> Option<(u32, BodyHit)> {
        let group = self.group(region)?;
        let stands_here = |number: &u32| self.outside[*number as usize] == region;
        let local = |number: u32| self.local[number as usize];
        let left = left.filter(stands_here);
        let Some(own) = own else {
            let met = group.instances.nearest(bodies, ray, reach, left.map(local));
            return met.map(|(location, hit)| (group.numbers[location as usize], hit));
        };
        let mut found = None;
        for number in [own, self.among].into_iter().filter(stands_here) {
            if left == Some(number) {
                continue;
            }
            if let Some((_, hit)) = group.instances.one(bodies, ray, reach, local(number)) {
                reach.to = hit.at.distance;
                found = Some((number, hit));
            }
        }
        found
    }

    /// Shows to `test` every instance that light in this region may meet within `reach`, which
    /// `test` may shorten.
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
    /// What [`Scene::nearest`] finds, also where instances stand in solids among them.
    pub(crate) fn nearest_anywhere(
        &self,
        ray: &Ray,
        location: Location,
        met_by: [Option<u32>; 2],
    ) -> Option<Hit<'_>> {
        match &self.nested {
            Some(nested) => self.nearest_of_nested(nested, ray, location, met_by),
            None => self.nearest(ray, location, met_by),
        }
    }

    /// What [`Scene::nearest`] finds where instances stand in solids among them.
    fn nearest_of_nested(
        &self,
        nested: &Nested,
        ray: &Ray,
        location: Location,
        met_by: [Option<u32>; 2],
    ) -> Option<Hit<'_>> {
        let mut reach = Reach {
            from: -4.0 * self.offset,
            to: f64::INFINITY,
        };
        // The surfaces of the region itself: of the world, or of the body that it belongs to.
        let own = match location {
            Location::World => self.ground.nearest_from_world(ray, reach).map(|hit| Hit {
                distance: hit.at.distance,
                surface: &self.ground.surfaces[hit.surface as usize],
                primitive: hit.at.primitive,
                side: hit.at.side,
                instance: None,
            }),
            Location::Inside { instance, medium } => {
                let body = self.body(instance);
                let hit = body.nearest_from_medium(medium, ray, reach);
                hit.map(|hit| Self::hit_of(body, instance, hit))
            }
        };
        let Some(region) = nested.between(location) else {
            return own;
        };
        if let Some(hit) = &own {
            reach.to = hit.distance;
        }
        let met = nested.nearest(&self.bodies, ray, reach, region, met_by);
        met.map_or(own, |(instance, hit)| {
            Some(Self::hit_of(self.body(instance), instance, hit))
        })
    }
}
