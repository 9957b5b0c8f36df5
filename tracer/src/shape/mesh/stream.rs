// SPDX-License-Identifier: MIT OR Apache-2.0
//! What many rays meet of a mesh, searched together, node by node instead of ray by ray.
//!
//! In: up to [`STREAM`] rays and their reaches. Out: what [`Mesh::intersect`] finds for each. A node is read once and its children are compared with all rays
//! that came to it, sixteen at a time; those that meet a child make up its list, and the triangles of a leaf are read once for all rays of its list.
//! Boxes are compared in f32 with the padding that they have for [`Mesh::intersect`]; triangles by [`Facet::cross`].

#![expect(
    clippy::inline_always,
    clippy::needless_range_loop,
    reason = "a branch or a call within a loop would keep it from being compiled to wide instructions"
)]

use obvhs::cwbvh::node::CwBvhNode;
use pulp::{Arch, Simd, WithSimd};

use super::{Aim, BEFORE, Mesh, divisor};
use crate::ray::Ray;
use crate::shape::{Intersection, Reach, Sides};

/// Most rays that are searched for together.
pub(crate) const STREAM: usize = 4096;

/// Rays that are compared together.
const WIDE: usize = 16;

/// The rays as boxes see them: scaled, from where they enter the box of the mesh.
struct Coarse {
    origin: [[f32; STREAM]; 3],
    inverse: [[f32; STREAM]; 3],
    /// How far they look.
    bound: [f32; STREAM],
}

/// Those that came to a node, in the order of its list.
struct Here {
    origin: [[[f32; WIDE]; STREAM / WIDE]; 3],
    inverse: [[[f32; WIDE]; STREAM / WIDE]; 3],
    bound: [[f32; WIDE]; STREAM / WIDE],
}

/// Room for a search.
pub(crate) struct Stream {
    coarse: Box<Coarse>,
    here: Box<Here>,
    /// Lists of rays: those of the nodes that wait, one after the other.
    lists: Vec<u32>,
    /// Nodes that wait, and where their lists begin and end.
    waiting: Vec<(u32, usize, usize)>,
}

impl Stream {
    #[expect(clippy::large_stack_arrays, reason = "moved to the heap at once")]
    pub fn new() -> Self {
        Self {
            coarse: Box::new(Coarse {
                origin: [[0.0; STREAM]; 3],
                inverse: [[1.0; STREAM]; 3],
                bound: [0.0; STREAM],
            }),
            here: Box::new(Here {
                origin: [[[0.0; WIDE]; STREAM / WIDE]; 3],
                inverse: [[[0.0; WIDE]; STREAM / WIDE]; 3],
                bound: [[0.0; WIDE]; STREAM / WIDE],
            }),
            lists: Vec::new(),
            waiting: Vec::new(),
        }
    }
}

impl Mesh {
    /// The nearest hits of up to [`STREAM`] rays within their reaches.
    pub(crate) fn intersect_many(
        &self,
        stream: &mut Stream,
        rays: &[Ray],
        reach: &[Reach],
        sides: Sides,
    ) -> Vec<Option<Intersection>> {
        let mut found = vec![None; rays.len()];
        let mut aims = Vec::with_capacity(rays.len());
        stream.lists.clear();
        for (k, (ray, reach)) in rays.iter().zip(reach).enumerate() {
            let start = self.entry(ray, *reach);
            aims.push((Aim::new(ray), *reach, start.unwrap_or(0.0)));
            let Some(start) = start else {
                continue;
            };
            let coarse = &mut stream.coarse;
            let at = ray.at(start) * self.scale;
            for axis in 0..3 {
                coarse.origin[axis][k] = at[axis] as f32;
                coarse.inverse[axis][k] = 1.0 / divisor(ray.direction[axis]);
            }
            coarse.bound[k] = bound(reach.to, start, self.scale);
            stream.lists.push(k as u32);
        }
        if !self.hierarchy.nodes.is_empty() && !stream.lists.is_empty() {
            Arch::new().dispatch(Search {
                mesh: self,
                sides,
                stream,
                aims: &mut aims,
                found: &mut found,
            });
        }
        found
    }
}

/// How far boxes are looked for, rounded up: a bound that is too far costs a test, one that is too near costs a hit.
#[inline(always)]
fn bound(to: f64, start: f64, scale: f64) -> f32 {
    ((to - start) * scale * (1.0 + 1e-5) + 1e-5) as f32
}

struct Search<'a, 'b> {
    mesh: &'a Mesh,
    sides: Sides,
    stream: &'a mut Stream,
    /// The rays as triangles see them, with the reaches left to them and where they enter the box of the mesh.
    aims: &'a mut [(Aim<'b>, Reach, f64)],
    found: &'a mut [Option<Intersection>],
}

impl WithSimd for Search<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _simd: S) {
        let nodes = &self.mesh.hierarchy.nodes;
        self.stream.waiting.clear();
        self.stream.waiting.push((0, 0, self.stream.lists.len()));
        while let Some((number, begin, end)) = self.stream.waiting.pop() {
            self.visit(&nodes[number as usize], begin, end);
        }
    }
}

impl Search<'_, '_> {
    /// Compares the rays of a list with the children of a node.
    #[inline(always)]
    fn visit(&mut self, node: &CwBvhNode, begin: usize, end: usize) {
        let Stream {
            coarse,
            here,
            lists,
            waiting,
        } = &mut *self.stream;
        // All lists behind this one are done with; this one is made to fill whole rows.
        lists.truncate(end);
        let rows = (end - begin).div_ceil(WIDE);
        lists.resize(begin + rows * WIDE, lists[end - 1]);
        gather(coarse, &lists[begin..], here);
        lists.truncate(end);

        let ray = self.aims[lists[begin] as usize].0.ray;
        let (order, children) = children(node, ray);
        for &child in &order[..children] {
            let (low, high) = child_box(node, child);
            let first = lists.len();
            lists.resize(first + rows * WIDE, 0);
            let (list, meeting) = lists.split_at_mut(first);
            let met = meet(&low, &high, here, &list[begin..end], meeting);
            lists.truncate(first + met);
            if met == 0 {
                continue;
            }
            if node.imask & (1 << child) != 0 {
                let before = node.imask & ((1 << child) - 1);
                let number = node.child_base_idx + before.count_ones();
                waiting.push((number, first, first + met));
                continue;
            }
            let meta = node.child_meta[child];
            let piece = node.primitive_base_idx + u32::from(meta & 31);
            for piece in piece..piece + (meta >> 5).count_ones() {
                let facet = self.mesh.facet(piece as usize);
                for &ray in &lists[first..] {
                    let ray = ray as usize;
                    let (aim, reach, start) = &mut self.aims[ray];
                    let Some((distance, side)) = facet.cross(aim, *reach, self.sides) else {
                        continue;
                    };
                    reach.to = distance;
                    coarse.bound[ray] = bound(distance, *start, self.mesh.scale);
                    self.found[ray] = Some(Intersection {
                        distance,
                        piece,
                        side,
                    });
                }
            }
            lists.truncate(first);
        }
    }
}

/// The children of a node, the one whose box lies farthest ahead of a ray first and leaves before all others, and how many there are.
#[inline(always)]
fn children(node: &CwBvhNode, ray: &Ray) -> ([usize; 8], usize) {
    let ahead = ray.direction.as_vec3().to_array();
    let (mut order, mut keys, mut count) = ([0; 8], [0.0_f32; 8], 0);
    for child in 0..8 {
        if node.child_meta[child] == 0 {
            continue;
        }
        let (low, high) = child_box(node, child);
        let middle = |axis: usize| ahead[axis] * (low[axis] + high[axis]);
        let leaf = node.imask & (1 << child) == 0;
        let key = if leaf {
            f32::INFINITY
        } else {
            middle(0) + middle(1) + middle(2)
        };
        let mut place = count;
        while place > 0 && keys[place - 1] < key {
            (order[place], keys[place]) = (order[place - 1], keys[place - 1]);
            place -= 1;
        }
        (order[place], keys[place]) = (child, key);
        count += 1;
    }
    (order, count)
}

/// Corners of the box of a child.
#[inline(always)]
fn child_box(node: &CwBvhNode, child: usize) -> ([f32; 3], [f32; 3]) {
    let step = |axis: usize| f32::from_bits(u32::from(node.e[axis]) << 23);
    let at = |p: f32, step: f32, q: u8| p + step * f32::from(q);
    let (p, x, y, z) = (node.p, step(0), step(1), step(2));
    (
        [
            at(p.x, x, node.child_min_x[child]),
            at(p.y, y, node.child_min_y[child]),
            at(p.z, z, node.child_min_z[child]),
        ],
        [
            at(p.x, x, node.child_max_x[child]),
            at(p.y, y, node.child_max_y[child]),
            at(p.z, z, node.child_max_z[child]),
        ],
    )
}

/// Puts the rays of a list beside each other.
#[inline(always)]
fn gather(coarse: &Coarse, list: &[u32], here: &mut Here) {
    for (row, rays) in list.chunks_exact(WIDE).enumerate().take(STREAM / WIDE) {
        for k in 0..WIDE {
            let ray = rays[k] as usize & (STREAM - 1);
            for axis in 0..3 {
                here.origin[axis][row][k] = coarse.origin[axis][ray];
                here.inverse[axis][row][k] = coarse.inverse[axis][ray];
            }
            here.bound[row][k] = coarse.bound[ray];
        }
    }
}

/// The rays of a list that meet a box; how many.
#[inline(always)]
fn meet(low: &[f32; 3], high: &[f32; 3], here: &Here, list: &[u32], meeting: &mut [u32]) -> usize {
    let less = |a: f32, b: f32| if a < b { a } else { b };
    let more = |a: f32, b: f32| if a > b { a } else { b };
    let mut count = 0;
    for (row, rays) in list.chunks(WIDE).enumerate().take(STREAM / WIDE) {
        let (mut met, mut any) = ([0_u32; WIDE], 0);
        for k in 0..WIDE {
            let (mut near, mut far) = (-BEFORE as f32, here.bound[row][k]);
            for axis in 0..3 {
                let (o, i) = (here.origin[axis][row][k], here.inverse[axis][row][k]);
                let (a, b) = ((low[axis] - o) * i, (high[axis] - o) * i);
                near = more(near, less(a, b));
                far = less(far, more(a, b));
            }
            met[k] = u32::from(near <= far);
            any |= met[k];
        }
        if any == 0 {
            continue;
        }
        for (ray, met) in rays.iter().zip(met) {
            meeting[count] = *ray;
            count += met as usize;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use bsdf::Side;
    use glam::DVec3;

    use super::*;
    use crate::random;

    /// A dented ball of 60 by 2 · 60 quadrilaterals, each halved.
    fn dented() -> Mesh {
        let (rows, columns) = (60_u32, 120_u32);
        let mut vertices = vec![DVec3::Z, -DVec3::Z * 0.7];
        for row in 1..rows {
            for column in 0..columns {
                let theta = std::f64::consts::PI * f64::from(row) / f64::from(rows);
                let phi = std::f64::consts::TAU * f64::from(column) / f64::from(columns);
                let radius = 1.0 + 0.3 * (5.0 * phi).sin() * theta.sin().powi(2);
                vertices.push(DVec3::new(
                    radius * theta.sin() * phi.cos(),
                    radius * theta.sin() * phi.sin(),
                    theta.cos() * if theta.cos() < 0.0 { 0.7 } else { 1.0 },
                ));
            }
        }
        let at = |row: u32, column: u32| match row {
            0 => 0,
            row if row == rows => 1,
            row => 2 + (row - 1) * columns + column % columns,
        };
        let mut triangles = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let (a, b) = (at(row, column), at(row, column + 1));
                let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
                if row > 0 {
                    triangles.push([a, c, b]);
                }
                if row + 1 < rows {
                    triangles.push([b, c, d]);
                }
            }
        }
        Mesh::new(&vertices, &triangles, &vec![0; triangles.len()]).unwrap()
    }

    /// From within, from far away, along axes, and rays that are given no way at all.
    #[test]
    fn many_rays_meet_what_each_meets_alone() {
        let mesh = dented();
        let mut rng = random::stream(5, 0);
        let mut stream = Stream::new();
        for (sides, spread) in [
            (Sides::Inner, 0.4),
            (Sides::Outer, 3.0),
            (Sides::Both, 300.0),
        ] {
            let (mut rays, mut reaches) = (Vec::new(), Vec::new());
            for number in 0..STREAM - 7 {
                let origin = random::isotropic(&mut rng) * spread * random::unit(&mut rng);
                let direction = match number % 16 {
                    0 => DVec3::X,
                    1 => -DVec3::Z,
                    k if k % 2 == 0 => random::isotropic(&mut rng),
                    _ => (random::isotropic(&mut rng) * 1.2 - origin).normalize(),
                };
                rays.push(Ray { origin, direction });
                reaches.push(Reach {
                    from: -1e-9,
                    to: match number % 5 {
                        0 => random::unit(&mut rng) * spread,
                        1 => f64::NEG_INFINITY,
                        _ => f64::INFINITY,
                    },
                });
            }
            let many = mesh.intersect_many(&mut stream, &rays, &reaches, sides);
            let mut met = 0;
            for (number, ((ray, reach), hit)) in rays.iter().zip(&reaches).zip(many).enumerate() {
                if number % 16 < 2 {
                    let all = mesh.intersect_all(ray, *reach, sides);
                    let distance = |hit: Option<Intersection>| hit.map(|hit| hit.distance);
                    assert_eq!(distance(hit), distance(all), "{ray:?} {reach:?}");
                }
                assert_eq!(hit, mesh.intersect(ray, *reach, sides), "{ray:?} {reach:?}");
                met += usize::from(hit.is_some());
                assert!(sides != Sides::Inner || hit.is_none_or(|hit| hit.side == Side::Inner));
            }
            assert!(met > 500, "{sides:?}: {met}");
        }
    }
}
