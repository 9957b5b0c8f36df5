// SPDX-License-Identifier: MIT OR Apache-2.0
//! Search over the instances of an array.
//!
//! Few instances are tested one after another by their boxes. From [`HIERARCHY_FROM`] on, a
//! bounding volume hierarchy (obvhs, f32) finds the instances that a ray may meet. Its boxes are
//! padded by far more than the rounding of f32; all intersections are in f64.
//!
//! A ray is first clipped to the box around all instances. The hierarchy sees the ray from its
//! entry into that box, so that its f32 origin is never far away.

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray as Ray32, RayHit};

use super::compiled::{Body, BodyHit};
use crate::ray::Ray;
use crate::shape::{Bounds, Reach};

/// Number of instances from which the hierarchy is faster than the list (`benches/arrays.rs`: equal
/// at 9, 5 % at 16, 75 % at 64, elevenfold at 1024).
pub const HIERARCHY_FROM: usize = 10;

/// Search for instances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstanceSearch {
    /// By number of instances.
    Automatic,
    /// One after the other.
    Linear,
    /// By bounding volume hierarchy, if the bodies are finite.
    Hierarchy,
}

/// A body and where it stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instance {
    pub prototype: u32,
    pub position: DVec3,
}

impl Instance {
    /// A ray of the world in the frame of the body.
    #[inline]
    pub fn local(&self, ray: &Ray) -> Ray {
        Ray { origin: ray.origin - self.position, direction: ray.direction }
    }
}

/// All instances with their search structure.
pub(crate) struct Instances {
    pub list: Vec<Instance>,
    boxes: Vec<Bounds>,
    /// The same by coordinate.
    boxes_by_lane: Vec<BoxLanes>,
    pub bounds: Bounds,
    hierarchy: Option<Bvh2>,
}

/// Boxes that are tested together.
const BOX_LANES: usize = 4;

/// Boxes by coordinate.
struct BoxLanes {
    low: [[f64; BOX_LANES]; 3],
    high: [[f64; BOX_LANES]; 3],
}

impl BoxLanes {
    /// Up to [`BOX_LANES`] boxes, at least one; the last one fills what is left.
    fn new(boxes: &[Bounds]) -> Self {
        let by_axis = |pick: fn(&Bounds) -> DVec3| {
            [0, 1, 2]
                .map(|axis| std::array::from_fn(|k| pick(&boxes[k.min(boxes.len() - 1)])[axis]))
        };
        Self { low: by_axis(|one| one.low), high: by_axis(|one| one.high) }
    }

    /// Distances at which a ray enters and leaves the boxes; it meets those that it does not leave
    /// before it enters. `inverse` holds the reciprocals of its direction.
    #[inline]
    fn passages(&self, origin: DVec3, inverse: DVec3) -> [[f64; BOX_LANES]; 2] {
        let min = |a: f64, b: f64| if a < b { a } else { b };
        let max = |a: f64, b: f64| if a > b { a } else { b };
        let mut enter = [f64::NEG_INFINITY; BOX_LANES];
        let mut leave = [f64::INFINITY; BOX_LANES];
        for axis in 0..3 {
            let (o, inverse) = (origin[axis], inverse[axis]);
            for k in 0..BOX_LANES {
                let (a, b) =
                    ((self.low[axis][k] - o) * inverse, (self.high[axis][k] - o) * inverse);
                enter[k] = max(min(a, b), enter[k]);
                leave[k] = min(max(a, b), leave[k]);
            }
        }
        [enter, leave]
    }
}

impl Instances {
    pub fn new(list: Vec<Instance>, bodies: &[Body], search: InstanceSearch) -> Self {
        let boxes: Vec<Bounds> = list
            .iter()
            .map(|instance| {
                let body = &bodies[instance.prototype as usize];
                // Boxes only save work: a slack far above rounding costs nothing.
                let slack = 1e-9 * (body.bounds.farthest() + instance.position.length());
                let slack = if slack.is_finite() { slack } else { 0.0 };
                body.bounds.moved(instance.position).padded(slack)
            })
            .collect();
        let bounds = Bounds::union_of(boxes.iter().copied());
        let wanted = match search {
            InstanceSearch::Automatic => list.len() >= HIERARCHY_FROM,
            InstanceSearch::Linear => false,
            InstanceSearch::Hierarchy => !list.is_empty(),
        };
        let hierarchy = (wanted && bounds.is_finite()).then(|| build(&boxes, &bounds));
        Self {
            list,
            boxes_by_lane: boxes.chunks(BOX_LANES).map(BoxLanes::new).collect(),
            boxes,
            bounds,
            hierarchy,
        }
    }

    /// The nearest hit on any instance but `except`, with its number.
    #[inline]
    pub fn nearest(
        &self,
        bodies: &[Body],
        ray: &Ray,
        reach: Reach,
        except: Option<u32>,
    ) -> Option<(u32, BodyHit)> {
        if let [only] = self.list[..] {
            if except.is_some() {
                return None;
            }
            let body = &bodies[only.prototype as usize];
            return body.nearest(None, &only.local(ray), reach).map(|hit| (0, hit));
        }
        self.nearest_of_many(bodies, ray, reach, except)
    }

    /// The nearest hit on the instances of these numbers, with its number.
    pub fn nearest_of(
        &self,
        bodies: &[Body],
        ray: &Ray,
        mut reach: Reach,
        numbers: impl IntoIterator<Item = u32>,
    ) -> Option<(u32, BodyHit)> {
        let inverse = ray.direction.recip();
        let mut found = None;
        for number in numbers {
            let instance = &self.list[number as usize];
            let body = &bodies[instance.prototype as usize];
            if self.boxes[number as usize].entry(ray.origin, inverse, reach).is_some()
                && let Some(hit) = body.nearest(None, &instance.local(ray), reach)
            {
                reach.to = hit.at.distance;
                found = Some((number, hit));
            }
        }
        found
    }

    fn nearest_of_many(
        &self,
        bodies: &[Body],
        ray: &Ray,
        mut reach: Reach,
        except: Option<u32>,
    ) -> Option<(u32, BodyHit)> {
        let mut found = None;
        self.visit(ray, &mut reach, |number, instance, reach| {
            if Some(number) == except {
                return;
            }
            let body = &bodies[instance.prototype as usize];
            if let Some(hit) = body.nearest(None, &instance.local(ray), *reach) {
                reach.to = hit.at.distance;
                found = Some((number, hit));
            }
        });
        found
    }

    /// Calls `test` for every instance whose box the ray may meet within `reach`, which `test` may
    /// shorten.
    #[inline]
    pub fn visit(
        &self,
        ray: &Ray,
        reach: &mut Reach,
        mut test: impl FnMut(u32, &Instance, &mut Reach),
    ) {
        let inverse = ray.direction.recip();
        let Some(entry) = self.bounds.entry(ray.origin, inverse, *reach) else {
            return;
        };
        let Some(hierarchy) = &self.hierarchy else {
            let chunks = self.list.chunks(BOX_LANES).zip(&self.boxes_by_lane);
            for (chunk, (instances, lanes)) in chunks.enumerate() {
                let [enter, leave] = lanes.passages(ray.origin, inverse);
                for (k, instance) in instances.iter().enumerate() {
                    if enter[k] <= leave[k] && leave[k] > reach.from && enter[k] < reach.to {
                        test((chunk * BOX_LANES + k) as u32, instance, reach);
                    }
                }
            }
            return;
        };
        let mut test = |number: u32, reach: &mut Reach| {
            let around = &self.boxes[number as usize];
            if around.entry(ray.origin, inverse, *reach).is_some() {
                test(number, &self.list[number as usize], reach);
            }
        };

        let start = entry.max(0.0);
        // Rounded up: a bound that is too far costs a test, one that is too near costs a hit.
        let bound = |to: f64| ((to - start) * (1.0 + 1e-5) + 1e-5) as f32;
        let single =
            Ray32::new(ray.at(start).as_vec3a(), ray.direction.as_vec3a(), 0.0, bound(reach.to));
        hierarchy.ray_traverse(single, &mut RayHit::none(), |_, leaf| {
            test(hierarchy.primitive_indices[leaf], reach);
            bound(reach.to)
        });
    }

    /// The numbers of up to `most` instances whose boxes overlap `around`.
    pub fn near(&self, around: &Bounds, most: usize) -> Vec<u32> {
        let is_near = |number: &u32| self.boxes[*number as usize].overlaps(around);
        let Some(hierarchy) = &self.hierarchy else {
            return (0..self.list.len() as u32).filter(is_near).take(most).collect();
        };
        let mut near = Vec::new();
        let boxed = Aabb::new(around.low.as_vec3a(), around.high.as_vec3a());
        hierarchy.aabb_traverse(boxed, |bvh, node| {
            let node = &bvh.nodes[node as usize];
            let leaves = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            near.extend(bvh.primitive_indices[leaves].iter().filter(|number| is_near(number)));
            near.len() < most
        });
        near.truncate(most);
        near
    }
}

fn build(boxes: &[Bounds], all: &Bounds) -> Bvh2 {
    // Single precision errs by its epsilon times the largest coordinate; slopes add as much along
    // the scene.
    let extent = all.farthest().max(all.size().length());
    let pad = Vec3A::splat((extent * f64::from(f32::EPSILON) * 8.0) as f32);
    let boxes: Vec<Aabb> = boxes
        .iter()
        .map(|one| Aabb::new(one.low.as_vec3a() - pad, one.high.as_vec3a() + pad))
        .collect();
    build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut std::time::Duration::default())
}
