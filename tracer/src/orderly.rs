// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths one after the other, but those that begin towards the same part of a body together: then what a search of a large mesh has just read is still at hand.
//!
//! Every path has the stream of its number, so the order changes nothing but the rounding of the sums. It is the same on any number of threads.

use glam::DVec3;

use crate::path::{Books, Tracer};
use crate::polarization::Unpolarised;
use crate::random::Streams;
use crate::ray::Ray;
use crate::run::Turns;
use crate::scene::{Place, Scene};
use crate::shape::Shape;

/// Bits of the number of a path among those that are put into order together: enough for neighbours to meet the same triangles of a mesh of 200 000.
const NUMBER: u32 = 18;

/// Bits of the number of a source; a scene with more of them is traced in the order of its paths.
const SOURCE: u32 = 24;

/// Triangles from which a mesh is large.
const LARGE: usize = 2_000;

/// Bits of each coordinate of a direction by which paths are put into order.
const BITS: u32 = 10;

/// Whether a scene gains by it: light begins in a body with a large mesh.
pub(crate) fn pays(scene: &Scene) -> bool {
    let large = |shape: &Shape| matches!(shape, Shape::Mesh(mesh) if mesh.triangles() >= LARGE);
    if scene.slots.len() >= 1 << SOURCE {
        return false;
    }
    let mut slots = scene.slots.iter();
    slots.any(|slot| match slot.place {
        Place::Inside { instance, .. } => {
            let body = &scene.bodies[scene.instances.list[instance as usize].prototype as usize];
            body.surfaces.iter().any(|surface| large(&surface.shape))
        }
        Place::World => false,
    })
}

/// Traces paths; returns how many surfaces they met, `None` if stopped by `look`, which is told how many are done.
pub(crate) fn trace(
    tracer: &Tracer<'_>,
    paths: u64,
    (streams, mut turns): (Streams, Turns<'_>),
    books: &mut Books,
    mut look: impl FnMut(u64) -> bool,
) -> Option<u64> {
    let mut hits = 0;
    let (slots, offset) = (&tracer.scene.slots, tracer.scene.offset());
    let mask = |bits: u32| (1_u64 << bits) - 1;
    let mut order: Vec<u64> = Vec::new();
    for first in (0..paths).step_by(1 << NUMBER) {
        order.clear();
        for number in first..(first + (1 << NUMBER)).min(paths) {
            let (source, slot) = turns.next();
            // Begun twice, which is cheaper than to keep what has begun.
            let ray = turns.begin(number, slot, offset, &mut streams.path(number));
            let key = u64::from(key(tracer.scene, &ray, slot.place));
            order.push((key << SOURCE | source as u64) << NUMBER | (number - first));
        }
        order.sort_unstable();
        for (done, path) in (first..).zip(&order) {
            if done % 4096 == 0 && !look(done) {
                return None;
            }
            let slot = &slots[(path >> NUMBER & mask(SOURCE)) as usize];
            let number = first + (path & mask(NUMBER));
            let mut stream = streams.path(number);
            let ray = turns.begin(number, slot, offset, &mut stream);
            hits += tracer.follow::<Unpolarised>(ray, slot.place, &mut stream, books, &mut ());
        }
    }
    Some(hits)
}

/// Where a ray leaves the ball around the body in which it begins, along a curve that keeps near what is near.
fn key(scene: &Scene, ray: &Ray, place: Place) -> u32 {
    let Place::Inside { instance, .. } = place else {
        return 0;
    };
    let body = &scene.bodies[scene.instances.list[instance as usize].prototype as usize];
    let (centre, radius) = (
        0.5 * (body.low + body.high),
        0.5 * (body.high - body.low).length(),
    );
    let from = ray.origin - centre;
    let nearest = -from.dot(ray.direction);
    let half = (radius * radius - (from + ray.direction * nearest).length_squared()).max(0.0);
    let point: DVec3 = (from + ray.direction * (nearest + half.sqrt())) / radius;
    let cell = |x: f64| ((0.5 * (x + 1.0) * f64::from(1 << BITS)) as u32).min((1 << BITS) - 1);
    (u32::from(point.z < 0.0) << (2 * BITS)) | spread(cell(point.x)) | spread(cell(point.y)) << 1
}

/// Bits moved to the even places.
fn spread(mut x: u32) -> u32 {
    for (shift, mask) in [
        (8, 0x00ff_00ff),
        (4, 0x0f0f_0f0f),
        (2, 0x3333_3333),
        (1, 0x5555_5555),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}
