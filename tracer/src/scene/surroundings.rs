// SPDX-License-Identifier: MIT OR Apache-2.0
//! The medium around each instance: the world's, or that of an array solid.
//!
//! For each instance, [`Surroundings::of`] finds the region of the solids in which all of it lies,
//! the innermost one where solids enclose each other. The instance's [`Region::World`] is that
//! region.
//!
//! One point of an instance decides where no surface of the solids reaches into its box. Elsewhere
//! points just inside its skin are compared. Where these differ the instance is cut, and the scene
//! is refused.

use glam::DVec3;
use rayon::prelude::*;

use super::prototype::Prototype;
use super::prototype::{LOOKS, first_seen};
use crate::error::Error;
use crate::optics::media::Medium;
use crate::random;
use crate::ray::Ray;
use crate::shape::{Bounds, Reach, Shape, Sides};
use crate::surface::{Region, Surface};

/// Lines by which points of a surface are found.
const LINES: usize = 64;
/// Depth inside of a surface at which its points are taken, and height above the ground at which
/// what stands on it is looked at: as a share of the size of all.
const DEEP: f64 = 1e-6;
/// Most ends of edges of a surface that are looked at.
const ENDS: usize = 512;
/// The array solids and the ground, as what instances may stand in.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    array_solids: &'a Prototype,
    /// Height of the ground on which everything stands; -∞ without.
    ground: f64,
}

/// The region in which an instance stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Containment {
    /// All of it lies in this region of the array solids.
    Within(Region),
    /// Most of it lies in the first region, and what is near the point (mm) in the second.
    Straddles([Region; 2], DVec3),
}

impl<'a> Surroundings<'a> {
    /// Array solids at the origin on a ground at this height, mm; -∞ for none.
    pub fn new(array_solids: &'a Prototype, ground_mm: f64) -> Self {
        Self { array_solids, ground: ground_mm }
    }

    /// The region in which an instance of `prototype` at `position` (mm) stands.
    pub fn containment(&self, prototype: &Prototype, position: DVec3) -> Containment {
        self.look(prototype, position).0
    }

    /// The same, and whether no surface of the array solids reaches into its box.
    fn look(&self, prototype: &Prototype, position: DVec3) -> (Containment, bool) {
        let skin: Vec<&Surface> = skin(prototype).collect();
        if skin.is_empty() {
            return (Containment::Within(Region::World), false);
        }
        let around = Bounds::union_of(skin.iter().map(|surface| surface.shape.bounds()));
        let around = around.moved(position);
        let whole = skin.len() == bordering(prototype).count();
        if whole && self.clear(around) {
            let seen = self.array_solids.region_at(around.middle());
            return (Containment::Within(seen), true);
        }
        let slack = self.slack(around);
        let above = self.ground + slack;
        let seen: Vec<(DVec3, Region)> = points(&skin, above - position.z, slack)
            .map(|point| point + position)
            .filter(|point| point.z > above)
            .map(|point| (point, self.array_solids.region_at(point)))
            .collect();
        let Some(main) = majority(&seen) else {
            return (Containment::Within(Region::World), false);
        };
        let containment = match seen.iter().find(|(_, region)| *region != main) {
            Some((at, other)) => Containment::Straddles([main, *other], *at),
            None => Containment::Within(main),
        };
        (containment, false)
    }

    /// True if no surface of the array solids reaches into a box above the ground: each surface
    /// lies beside the box, on the ground, or is that of a convex solid that holds its corners.
    fn clear(&self, around: Bounds) -> bool {
        // What stands on the ground is looked at a little above it: solids that stand there keep a
        // gap.
        let above = self.ground + self.slack(around);
        let mut lifted = around;
        lifted.low.z = lifted.low.z.max(above);
        self.array_solids.surfaces.iter().all(|surface| {
            let shape = &surface.shape;
            let solid = shape.closed() && shape.convex();
            let bounds = shape.bounds();
            bounds.high.z <= above
                || !bounds.overlaps(&around)
                || (solid && lifted.corners().iter().all(|corner| shape.holds(*corner)))
        })
    }

    /// Height above the ground at which an instance with this box is looked at, mm.
    fn slack(&self, around: Bounds) -> f64 {
        let boxes = self.array_solids.surfaces.iter().map(|s| s.shape.bounds());
        let size = Bounds::union_of(boxes).union(around).size().max_element();
        if size.is_finite() { DEEP * size } else { 0.0 }
    }

    /// The name of the surface by which a point is known to lie in a region.
    fn bounding(&self, point: DVec3, region: Region) -> String {
        let faces = LOOKS.iter().filter_map(|look| first_seen(self.array_solids, point, *look));
        let mut found = faces.filter(|(_, faces)| *faces == region);
        let name = found.next().map(|(surface, _)| surface.name().to_owned());
        name.unwrap_or_else(|| "something opaque".to_owned())
    }
}

/// The medium around an instance: that of the array solids, or the world's.
pub(super) fn medium<'a>(
    array_solids: Option<&'a Prototype>,
    outside: Option<u8>,
    world: &'a Medium,
) -> &'a Medium {
    array_solids
        .zip(outside)
        .and_then(|(array_solids, number)| array_solids.media.get(usize::from(number)))
        .unwrap_or(world)
}

/// The regions in which all instances of a scene stand.
pub(super) struct Containments {
    /// By instance: the medium of the array solids in which it stands.
    pub outside: Vec<Option<u8>>,
    /// By instance: whether no array solid reaches into its box, so that nothing can cut it.
    pub clear: Vec<bool>,
    /// The first instance that stands in two regions, reported unless a crossing tells it better.
    pub straddles: Option<Error>,
}

impl Containments {
    /// Of instances of `prototypes`, given by number and position.
    pub fn new(
        prototypes: &[Prototype],
        instances: &[(usize, DVec3)],
        surroundings: Option<Surroundings<'_>>,
        world: &Medium,
    ) -> Result<Self, Error> {
        let Some(surroundings) = surroundings else {
            return Ok(Self {
                outside: vec![None; instances.len()],
                clear: vec![true; instances.len()],
                straddles: None,
            });
        };
        let of_one = |(prototype, position): &(usize, DVec3)| {
            surroundings.look(&prototypes[*prototype], *position)
        };
        let (all, clear): (Vec<Containment>, Vec<bool>) = instances.par_iter().map(of_one).unzip();
        let name = |region: Region| match region {
            Region::Opaque => "something opaque".to_owned(),
            Region::World => world.name.clone(),
            Region::Body(number) => {
                medium(Some(surroundings.array_solids), Some(number), world).name.clone()
            }
        };
        let (mut outside, mut straddles) = (Vec::with_capacity(all.len()), None);
        for (instance, containment) in all.into_iter().enumerate() {
            let main = match containment {
                Containment::Within(region) => region,
                Containment::Straddles(regions, at) => {
                    straddles = straddles.or_else(|| {
                        Some(Error::Straddles {
                            instance,
                            at_mm: at.to_array(),
                            regions: regions.map(name),
                        })
                    });
                    regions[0]
                }
            };
            outside.push(match main {
                Region::World => None,
                Region::Body(number) => Some(number),
                Region::Opaque if straddles.is_some() => None,
                Region::Opaque => {
                    let (prototype, position) = &instances[instance];
                    let at = skin(&prototypes[*prototype])
                        .next()
                        .map_or(DVec3::ZERO, |s| s.shape.bounds().middle());
                    return Err(Error::InOpaque {
                        instance,
                        surface: surroundings.bounding(at + *position, Region::Opaque),
                    });
                }
            });
        }
        Ok(Self { outside, clear, straddles })
    }
}

/// Surfaces of a body that border the world.
fn bordering(prototype: &Prototype) -> impl Iterator<Item = &Surface> {
    prototype
        .surfaces
        .iter()
        .filter(|surface| [surface.inner, surface.outer].contains(&Region::World))
}

/// Finite surfaces of a body that border the world.
fn skin(prototype: &Prototype) -> impl Iterator<Item = &Surface> {
    bordering(prototype).filter(|surface| surface.shape.bounds().is_finite())
}

/// The region of most points; the first of equal ones.
fn majority(seen: &[(DVec3, Region)]) -> Option<Region> {
    let count = |region: Region| seen.iter().filter(|(_, r)| *r == region).count();
    let highest = seen.iter().map(|(_, region)| count(*region)).max()?;
    let found = seen.iter().find(|(_, region)| count(*region) == highest);
    found.map(|(_, region)| *region)
}

/// Points of a skin, just inside of it: where lines through it meet it, level ones `slack` below
/// its top and above its foot or `ground` among them, and ends of its edges.
fn points<'a>(skin: &'a [&Surface], ground: f64, slack: f64) -> impl Iterator<Item = DVec3> + 'a {
    skin.iter().flat_map(move |surface| {
        let shape = &surface.shape;
        let around = shape.bounds();
        let (middle, size) = (around.middle(), around.size().length());
        let deep = DEEP * size;
        // Away from the world; of a sheet in it both sides.
        let sides: &[f64] = match [surface.inner, surface.outer] {
            [Region::World, Region::World] => &[-1.0, 1.0],
            [Region::World, _] => &[1.0],
            _ => &[-1.0],
        };
        let mut points = Vec::new();
        let heights = [around.low.z.max(ground) + slack, around.high.z - slack];
        let level = heights.into_iter().flat_map(|z| level(&around, z));
        for line in lines(around).chain(level) {
            let mut reach = Reach::AHEAD;
            while let Some(hit) = shape.intersect(&line, reach, Sides::Both) {
                let (at, normal) = shape.settle(line.at(hit.distance), hit.primitive);
                points.extend(sides.iter().map(|side| at + normal * (side * deep)));
                reach.from = hit.distance + 1e-12 * size;
            }
        }
        let ends: Vec<DVec3> = match shape {
            Shape::Cuboid(cuboid) => cuboid.edges().into_iter().flatten().collect(),
            Shape::Mesh(mesh) => mesh.edges().flatten().collect(),
            Shape::Placed(placed) => placed.edges().into_iter().flatten().collect(),
            _ => Vec::new(),
        };
        let stride = ends.len().div_ceil(ENDS).max(1);
        let ends = ends.into_iter().step_by(stride);
        points.extend(ends.map(|end| end + (middle - end) * (2.0 * DEEP)));
        points
    })
}

/// Lines through a box: through its middle along its axes, and through random points of it.
fn lines(around: Bounds) -> impl Iterator<Item = Ray> {
    let mut rng = random::stream(0x5011_d5ed, 0);
    let (middle, size) = (around.middle(), around.size().length());
    (0..LINES).map(move |number| {
        let (through, direction) = if number < 3 {
            (middle, DVec3::AXES[number])
        } else {
            let share =
                DVec3::new(random::unit(&mut rng), random::unit(&mut rng), random::unit(&mut rng));
            (around.low + share * around.size(), random::isotropic(&mut rng))
        };
        Ray { origin: through - direction * (2.0 * size), direction }
    })
}

/// Level lines at a height through the middle of a box.
fn level(around: &Bounds, z: f64) -> impl Iterator<Item = Ray> {
    let (middle, size) = (around.middle(), around.size().length());
    let directions = [DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, -1.0, 0.0)];
    directions.into_iter().map(move |direction| {
        let direction = direction.normalize();
        Ray { origin: middle.with_z(z) - direction * (2.0 * size), direction }
    })
}
