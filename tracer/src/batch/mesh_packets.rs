// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray packets for large meshes: paths in an order in which neighbours meet the same triangles.
//!
//! While many paths lie within bodies, they are sorted by where they leave a rough outline of the
//! body, and [`PACKET`] of them traverse the mesh together. The rest, and those that get out, go to
//! the walker. Every path draws from the stream of its number, so only the order of sums differs
//! from tracing path by path; it is the same on any number of threads.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "a branch or a call within the loop over many rays would keep it from being compiled \
        to wide instructions"
)]

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use crate::optics::polarisation::Unpolarised;
use crate::path::{PathState, Tracer, Walk};
use crate::random::{PathStream, Streams};
use crate::ray::Ray;
use crate::receiver::Tally;
use crate::scene::{Body, Hit, Location, Scene};
use crate::shape::{PACKET, PacketTraversal, Reach, Shape};
use crate::source_picker::SourcePicker;

/// Paths that are sorted together: enough for neighbours to meet the same triangles of a
/// mesh of 200 000.
const BLOCK: u64 = 1 << 18;
const _: () = assert!(BLOCK.is_power_of_two());

/// Fewest paths that are sorted together; the rest go one by one.
const MIN_SORTED: usize = 256;

/// Fewest triangles of a large mesh.
const LARGE: usize = 2_000;

/// Cells of an outline on each edge of a cube around it.
const CELLS: usize = 32;

/// Bits of each coordinate on a face of that cube by which paths are put into order.
const BITS: u32 = 9;

/// Bits of a place in the order of paths within bodies of one kind.
const KEY: u32 = 2 * BITS + 3;

/// Digits by which places are sorted, a power of two.
const DIGITS: usize = 1 << 11;

/// Reach of a body from its middle in any direction: roughly, as only the order depends on
/// it.
struct Outline {
    centre: [f64; 3],
    radius: f64,
    /// By direction, see [`place`]; the last quarter is not used.
    reach: Box<[f64; 8 * CELLS * CELLS]>,
}

/// Rays whose places are found together.
const WIDE: usize = 64;

/// Rays coordinate by coordinate, and their places in the order.
struct Rays {
    origin: [[f64; WIDE]; 3],
    direction: [[f64; WIDE]; 3],
    key: [u64; WIDE],
}

/// A scene whose paths go in packets.
pub(crate) struct MeshPackets {
    /// By prototype; none for those without a large mesh.
    outlines: Vec<Option<Outline>>,
}

/// A path within a body, with its stream.
type PathWithStream = (PathState, PathStream);

impl MeshPackets {
    /// `None` where it does not pay: if no light begins in a body with a large mesh.
    pub fn new(scene: &Scene) -> Option<Self> {
        let large = |shape: &Shape| matches!(shape, Shape::Mesh(mesh) if mesh.triangles() >= LARGE);
        let outlines: Vec<Option<Outline>> = scene
            .bodies
            .iter()
            .map(|body| {
                let meshed = body.surfaces.iter().any(|surface| large(&surface.shape));
                meshed.then(|| Outline::new(body))
            })
            .collect();
        let pays = scene
            .sources
            .iter()
            .any(|placed| prototype(scene, placed.location).is_some_and(|p| outlines[p].is_some()));
        pays.then_some(Self { outlines })
    }

    /// Traces paths; returns how many surfaces they met, `None` if stopped by `keep_going`, which
    /// is told how many are begun.
    pub fn trace(
        &self,
        tracer: &Tracer<'_>,
        paths: u64,
        (streams, mut picker): (Streams, SourcePicker<'_>),
        tally: &mut Tally<'_>,
        mut keep_going: impl FnMut(u64) -> bool,
    ) -> Option<u64> {
        let mut hits = 0;
        let mut room = PacketTraversal::new();
        for first in (0..paths).step_by(BLOCK as usize) {
            let mut active: Vec<PathWithStream> = Vec::new();
            for number in first..(first + BLOCK).min(paths) {
                let mut stream = streams.path(number);
                let (source, placed) = picker.next();
                let ray = picker.begin(number, placed, tracer.scene.offset(), &mut stream);
                let path = tracer.begin(ray, (source, placed), tally, &mut ());
                active.push((path, stream));
            }
            while active.len() >= MIN_SORTED {
                active = self.go_on(
                    tracer,
                    &active,
                    tally,
                    &mut room,
                    (&mut hits, &mut || keep_going(first)),
                )?;
            }
            for (path, mut stream) in active {
                hits += finish(tracer, path, &mut stream, tally);
            }
        }
        Some(hits)
    }

    /// Takes paths beyond the next surface, and those that leave their bodies to their end; returns
    /// those that fly on within.
    fn go_on(
        &self,
        tracer: &Tracer<'_>,
        active: &[PathWithStream],
        tally: &mut Tally<'_>,
        room: &mut PacketTraversal,
        (hits, keep_going): (&mut u64, &mut dyn FnMut() -> bool),
    ) -> Option<Vec<PathWithStream>> {
        let scene = tracer.scene;
        let order = self.order(scene, active);
        let mut within = Vec::new();
        for numbers in order.chunks(PACKET) {
            if !keep_going() {
                return None;
            }
            let mut paths: Vec<PathWithStream> =
                numbers.iter().map(|word| active[(word % BLOCK) as usize]).collect();
            let ahead = look_ahead(scene, &paths, room);
            for (number, (path, stream)) in paths.iter_mut().enumerate() {
                let Some(ahead) = &ahead else {
                    *hits += finish(tracer, *path, stream, tally);
                    continue;
                };
                let mut hit = ahead[number];
                if let (Some(hit), Location::Inside { instance, .. }) = (&mut hit, path.location) {
                    hit.instance = Some(instance);
                }
                let mut walk = Walk {
                    tracer,
                    path: *path,
                    light: &mut Unpolarised,
                    rng: stream,
                    tally,
                    observer: &mut (),
                };
                let goes_on = walk.interact(hit).is_some();
                *path = walk.path;
                if !goes_on {
                    *hits += u64::from(path.history.bounces);
                } else if path.location == Location::World
                    || path.history.bounces >= tracer.max_bounces
                {
                    *hits += finish(tracer, *path, stream, tally);
                } else {
                    within.push((*path, *stream));
                }
            }
        }
        Some(within)
    }

    /// The order of paths: those that go to the same part of the same kind of body stand together.
    /// The number of each is the rest of a division by [`BLOCK`].
    fn order(&self, scene: &Scene, active: &[PathWithStream]) -> Vec<u64> {
        let mut rays = Box::new(Rays {
            origin: [[0.0; WIDE]; 3],
            direction: [[0.0; WIDE], [0.0; WIDE], [1.0; WIDE]],
            key: [0; WIDE],
        });
        let mut order = Vec::with_capacity(active.len());
        let kind = |path: &PathState| prototype(scene, path.location).unwrap_or(0);
        for paths in active.chunks(WIDE) {
            // Paths of another kind than the first one's stand by themselves, by its outline.
            if let Some(outline) = &self.outlines[kind(&paths[0].0)] {
                outline.keys(paths, &mut rays);
            }
            for ((path, _), key) in paths.iter().zip(rays.key) {
                let place = (kind(path) as u64) << KEY | key;
                order.push(place * BLOCK + order.len() as u64);
            }
        }
        sort(&mut order);
        order
    }
}

/// Sorts words, numbered in ascending order, by what stands above their numbers, those with the
/// smallest digits first: each time, every word is moved once to where its digit tells.
fn sort(words: &mut Vec<u64>) {
    let max = words.iter().fold(0, |all, word| all | word);
    let mut sorted = vec![0; words.len()];
    let mut shift = BLOCK.trailing_zeros();
    while shift < u64::BITS && max >> shift != 0 {
        let digit = |word: u64| (word >> shift) as usize % DIGITS;
        let mut begins = [0; DIGITS];
        for word in &*words {
            begins[digit(*word)] += 1;
        }
        let mut sum = 0;
        for begin in &mut begins {
            (*begin, sum) = (sum, sum + *begin);
        }
        for word in &*words {
            let place = &mut begins[digit(*word)];
            sorted[*place] = *word;
            *place += 1;
        }
        std::mem::swap(words, &mut sorted);
        shift += DIGITS.trailing_zeros();
    }
}

/// Follows a path to its end by itself; returns how many surfaces it met.
fn finish(
    tracer: &Tracer<'_>,
    path: PathState,
    rng: &mut PathStream,
    tally: &mut Tally<'_>,
) -> u64 {
    let (light, observer) = (&mut Unpolarised, &mut ());
    let walk = Walk { tracer, path, light, rng, tally, observer };
    let (path, _) = walk.follow_to(u32::MAX);
    u64::from(path.history.bounces)
}

/// The kind of body that a ray is in.
fn prototype(scene: &Scene, location: Location) -> Option<usize> {
    match location {
        Location::Inside { instance, .. } => {
            Some(scene.instances.list[instance as usize].prototype as usize)
        }
        Location::World => None,
    }
}

/// Next surfaces of paths, if they are in the same medium of one kind of body.
fn look_ahead<'a>(
    scene: &'a Scene,
    paths: &[PathWithStream],
    room: &mut PacketTraversal,
) -> Option<Vec<Option<Hit<'a>>>> {
    let (first, _) = paths.first()?;
    let Location::Inside { instance, medium } = first.location else {
        return None;
    };
    if scene.meets_other_bodies(first.location) {
        return None;
    }
    let kind = prototype(scene, first.location);
    let alike = paths.iter().all(|(path, _)| {
        prototype(scene, path.location) == kind
            && matches!(path.location, Location::Inside { medium: other, .. } if other == medium)
    });
    if !alike {
        return None;
    }
    let rays: Vec<Ray> = paths.iter().map(|(path, _)| path.ray).collect();
    Some(scene.nearest_of_many(&rays, instance, medium, room))
}

impl Outline {
    #[expect(clippy::large_stack_arrays, reason = "moved to the heap at once")]
    fn new(body: &Body) -> Self {
        let centre = body.bounds.middle();
        let radius = 0.5 * body.bounds.size().length();
        let reach = Reach { from: 0.0, to: radius };
        let mut reaches = Box::new([radius; 8 * CELLS * CELLS]);
        for (cell, to) in reaches.iter_mut().enumerate().take(6 * CELLS * CELLS) {
            let ray = Ray { origin: centre, direction: middle(cell) };
            *to = body.first_seen(&ray, reach).map_or(radius, |met| met.distance);
        }
        Self { centre: centre.to_array(), radius, reach: reaches }
    }

    /// Numbers of paths along a curve that keeps near what is near, by where they leave the
    /// outline.
    fn keys(&self, paths: &[PathWithStream], rays: &mut Rays) {
        for (k, (path, _)) in paths.iter().enumerate().take(WIDE) {
            path.ray.into_lane(&mut rays.origin, &mut rays.direction, k);
        }
        Arch::new().dispatch(Keys { outline: self, rays });
    }
}

/// Finds the keys of rays.
struct Keys<'a> {
    outline: &'a Outline,
    rays: &'a mut Rays,
}

impl WithSimd for Keys<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Outline { centre, radius, reach } = self.outline;
        keys(*centre, *radius, reach, self.rays);
    }
}

/// Points where rays leave the outline, found in two rounds from where they leave the ball around
/// it.
#[inline(always)]
fn keys(centre: [f64; 3], radius: f64, reach: &[f64; 8 * CELLS * CELLS], rays: &mut Rays) {
    for k in 0..WIDE {
        let (d, o) = (&rays.direction, &rays.origin);
        let (dx, dy, dz) = (d[0][k], d[1][k], d[2][k]);
        let (x, y, z) = (o[0][k] - centre[0], o[1][k] - centre[1], o[2][k] - centre[2]);
        let nearest = -(x * dx + y * dy + z * dz);
        let (bx, by, bz) = (x + nearest * dx, y + nearest * dy, z + nearest * dz);
        let beside = bx * bx + by * by + bz * bz;
        let at = |reach: f64| {
            let half = reach * reach - beside;
            let half = if half > 0.0 { half } else { 0.0 }.sqrt();
            (bx + half * dx, by + half * dy, bz + half * dz)
        };
        let mut point = at(radius);
        for _ in 0..2 {
            let cell = place(point, CELLS as f64);
            let cell = (cell[0] * CELLS as u64 + cell[1]) * CELLS as u64 + cell[2];
            point = at(reach[cell as usize & (8 * CELLS * CELLS - 1)]);
        }
        let [face, u, v] = place(point, f64::from(1 << BITS));
        rays.key[k] = face << (2 * BITS) | spread(u) | spread(v) << 1;
    }
}

/// Face of a cube that a point is seen through from its middle, and the cell there, of `count` by
/// `count`.
#[inline(always)]
fn place((x, y, z): (f64, f64, f64), count: f64) -> [u64; 3] {
    let (a, b, c) = (x.abs(), y.abs(), z.abs());
    let by_x = (a >= b) & (a >= c);
    let by_y = !by_x & (b >= c);
    let pick = |x: f64, y: f64, z: f64| {
        let other = if by_y { y } else { z };
        if by_x { x } else { other }
    };
    let (along, u, v) = (pick(x, y, z), pick(y, z, x), pick(z, x, y));
    let scale = 0.5 / (along.abs() + f64::MIN_POSITIVE);
    let cell = |x: f64| {
        let cell = (0.5 + x * scale) * count;
        let cell = if cell < count - 1.0 { cell } else { count - 1.0 };
        (if cell > 0.0 { cell } else { 0.0 }) as i64 as u64
    };
    let face = pick(0.0, 2.0, 4.0) + if along < 0.0 { 1.0 } else { 0.0 };
    [face as i64 as u64, cell(u), cell(v)]
}

/// Direction of the middle of a cell.
fn middle(cell: usize) -> DVec3 {
    let (face, place) = (cell / (CELLS * CELLS), cell % (CELLS * CELLS));
    let at = |k: usize| (2 * k + 1) as f64 / CELLS as f64 - 1.0;
    let (u, v) = (at(place / CELLS), at(place % CELLS));
    let w = if face % 2 == 0 { 1.0 } else { -1.0 };
    let direction = match face / 2 {
        0 => DVec3::new(w, u, v),
        1 => DVec3::new(v, w, u),
        _ => DVec3::new(u, v, w),
    };
    direction.normalize()
}

/// Bits moved to the even places.
#[inline(always)]
fn spread(mut x: u64) -> u64 {
    x = (x | x << 8) & 0x00ff_00ff;
    x = (x | x << 4) & 0x0f0f_0f0f;
    x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_words_stand_in_the_order_of_their_places_then_of_their_numbers() {
        for kinds in [1, 3, 1 << 20] {
            let place = |number: u64| {
                let mixed = number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
                (mixed % kinds) << KEY | (mixed % 1000) << (KEY - 10)
            };
            let words: Vec<u64> = (0..5_000).map(|n| place(n) * BLOCK + n).collect();
            let (mut sorted, mut expected) = (words.clone(), words);
            sort(&mut sorted);
            expected.sort_unstable();
            assert_eq!(sorted, expected);
        }
        sort(&mut Vec::new());
    }
}
