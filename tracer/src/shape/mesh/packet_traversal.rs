// SPDX-License-Identifier: MIT OR Apache-2.0
//! Packet traversal of a mesh: up to [`PACKET`] rays searched together, node by node instead of ray
//! by ray.
//!
//! The result for each ray is that of [`Mesh::intersect`]. A node is read once and its children are
//! compared with all rays that reached it, sixteen at a time. The rays that meet a child form its
//! list, and the triangles of all leaves of a node are read once for the rays of its list. Boxes
//! are compared in f32 with the padding that they have for [`Mesh::intersect`]. Triangles are
//! compared in f32 by a [`Prefilter`] that keeps all rays that may cross, then by
//! [`Triangle::cross`].

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    clippy::needless_range_loop,
    reason = "a branch or a call within a loop would keep it from being compiled to wide \
        instructions"
)]

use obvhs::cwbvh::node::CwBvhNode;
use pulp::{Arch, Simd, WithSimd};

use super::prefilter::{PRIMITIVES, Prefilter, WIDE};
use super::{BEFORE, Mesh, ShearedRay, divisor};
use crate::ray::Ray;
use crate::shape::{Intersection, Reach, Sides};

/// Most rays that are searched for together.
pub(crate) const PACKET: usize = 4096;

/// Rows of rays that are compared together.
const ROWS: usize = PACKET / WIDE;

/// The rays as boxes see them: scaled, from where they enter the box of the mesh.
struct Coarse {
    origin: [[f32; PACKET]; 3],
    direction: [[f32; PACKET]; 3],
    /// Length of each ray.
    bound: [f32; PACKET],
}

/// A number of each ray that came to a node, in the order of its list.
type Rows<T> = [T; ROWS];

/// Rays that came to a node.
struct Here {
    origin: Rows<[[f32; WIDE]; 3]>,
    direction: Rows<[[f32; WIDE]; 3]>,
    inverse: Rows<[[f32; WIDE]; 3]>,
    /// Origin × direction.
    moment: Rows<[[f32; WIDE]; 3]>,
    bound: Rows<[f32; WIDE]>,
    /// The children that they meet, a bit for each.
    met: Rows<[u32; WIDE]>,
    /// Triangles that any ray of a row meets.
    any: Rows<u32>,
}

/// Boxes of the children of a node.
struct Boxes {
    low: [[f32; 8]; 3],
    high: [[f32; 8]; 3],
}

/// Room for a search.
pub(crate) struct PacketTraversal {
    coarse: Box<Coarse>,
    here: Box<Here>,
    prefilter: Box<Prefilter>,
    /// Lists of rays: those of the nodes that wait, one after the other.
    lists: Vec<u32>,
    /// Nodes that wait, read when they are put here so that no step begins with a wait for memory,
    /// and where their lists begin and end.
    waiting: Vec<(CwBvhNode, usize, usize)>,
    /// Rays, and the triangles of a node that they may cross, a bit for each.
    near: Vec<(u32, u32)>,
}

impl PacketTraversal {
    #[expect(clippy::large_stack_arrays, reason = "moved to the heap at once")]
    pub fn new() -> Self {
        Self {
            coarse: Box::new(Coarse {
                origin: [[0.0; PACKET]; 3],
                direction: [[1.0; PACKET]; 3],
                bound: [0.0; PACKET],
            }),
            here: Box::new(Here {
                origin: [[[0.0; WIDE]; 3]; ROWS],
                direction: [[[1.0; WIDE]; 3]; ROWS],
                inverse: [[[1.0; WIDE]; 3]; ROWS],
                moment: [[[0.0; WIDE]; 3]; ROWS],
                bound: [[0.0; WIDE]; ROWS],
                met: [[0; WIDE]; ROWS],
                any: [0; ROWS],
            }),
            prefilter: Box::new(Prefilter::new()),
            lists: Vec::new(),
            waiting: Vec::new(),
            near: Vec::new(),
        }
    }
}

impl Mesh {
    /// The nearest hits of up to [`PACKET`] rays within their reaches.
    pub(crate) fn intersect_many(
        &self,
        traversal: &mut PacketTraversal,
        rays: &[Ray],
        reach: &[Reach],
        sides: Sides,
    ) -> Vec<Option<Intersection>> {
        let mut found = vec![None; rays.len()];
        let mut aims = Vec::with_capacity(rays.len());
        traversal.lists.clear();
        for (k, (ray, reach)) in rays.iter().zip(reach).enumerate() {
            let start = self.entry(ray, *reach);
            aims.push((ShearedRay::new(ray), *reach, start.unwrap_or(0.0)));
            let Some(start) = start else {
                continue;
            };
            let coarse = &mut traversal.coarse;
            let at = ray.at(start) * self.scale;
            for axis in 0..3 {
                coarse.origin[axis][k] = at[axis] as f32;
                coarse.direction[axis][k] = divisor(ray.direction[axis]);
            }
            coarse.bound[k] = bound(reach.to, start, self.scale);
            traversal.lists.push(k as u32);
        }
        if !self.hierarchy.nodes.is_empty() && !traversal.lists.is_empty() {
            Arch::new().dispatch(Traversal {
                mesh: self,
                sides,
                buffers: traversal,
                aims: &mut aims,
                found: &mut found,
            });
        }
        found
    }
}

/// Distance up to which boxes are searched, rounded up: a bound that is too far costs a test, one
/// that is too near costs a hit.
#[inline(always)]
fn bound(to: f64, start: f64, scale: f64) -> f32 {
    ((to - start) * scale * (1.0 + 1e-5) + 1e-5) as f32
}

struct Traversal<'a, 'b> {
    mesh: &'a Mesh,
    sides: Sides,
    buffers: &'a mut PacketTraversal,
    /// The rays as triangles see them, with the reaches left to them and where they enter the box
    /// of the mesh.
    aims: &'a mut [(ShearedRay<'b>, Reach, f64)],
    found: &'a mut [Option<Intersection>],
}

impl WithSimd for Traversal<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _simd: S) {
        let nodes = &self.mesh.hierarchy.nodes;
        self.buffers.waiting.clear();
        self.buffers.waiting.push((nodes[0], 0, self.buffers.lists.len()));
        while let Some((node, begin, end)) = self.buffers.waiting.pop() {
            self.visit(&node, begin, end);
        }
    }
}

impl Traversal<'_, '_> {
    /// Compares the rays of a list with the children of a node.
    #[inline(always)]
    fn visit(&mut self, node: &CwBvhNode, begin: usize, end: usize) {
        let PacketTraversal { coarse, here, lists, waiting, .. } = &mut *self.buffers;
        // All lists behind this one are done with; this one is made to fill whole rows.
        lists.truncate(end);
        let rows = (end - begin).div_ceil(WIDE);
        lists.resize(begin + rows * WIDE, lists[end - 1]);
        gather(coarse, &lists[begin..], here);

        let boxes = Boxes::from_node(node);
        let mut there = 0;
        for child in 0..8 {
            there |= u32::from(node.child_meta[child] != 0) << child;
        }
        let met = meet(&boxes, here, rows) & there;
        here.met[rows - 1][WIDE - (begin + rows * WIDE - end)..].fill(0);

        let (inner, leaves) = (met & u32::from(node.imask), met & !u32::from(node.imask));
        for &child in &order(&boxes, here, inner)[..inner.count_ones() as usize] {
            let before = node.imask & ((1 << child) - 1);
            let number = node.child_base_idx + before.count_ones();
            let first = lists.len();
            pick(lists, begin, here, rows, child);
            let node = self.mesh.hierarchy.nodes[number as usize];
            waiting.push((node, first, lists.len()));
        }
        if leaves != 0 {
            self.cross(node, leaves, begin, rows);
        }
    }

    /// Compares the rays of a list with the triangles of those leaves of a node that any of them
    /// meets.
    #[inline(always)]
    fn cross(&mut self, node: &CwBvhNode, leaves: u32, begin: usize, rows: usize) {
        let PacketTraversal { coarse, here, prefilter, lists, near, .. } = &mut *self.buffers;
        let (mut primitives, mut homes, mut count) = ([0; PRIMITIVES], [0; PRIMITIVES], 0);
        let mut left = leaves;
        while left != 0 {
            let meta = node.child_meta[left.trailing_zeros() as usize];
            let first = node.primitive_base_idx + u32::from(meta & 31);
            for primitive in first..first + (meta >> 5).count_ones() {
                primitives[count] = primitive;
                homes[count] = left & left.wrapping_neg();
                count += 1;
            }
            left &= left - 1;
        }
        let (primitives, homes) = (&primitives[..count], &homes[..count]);

        // All are read before the first is compared, so that none waits for another to come from
        // memory.
        let mut ends = [[0; 3]; PRIMITIVES];
        for (ends, primitive) in ends.iter_mut().zip(primitives) {
            *ends = self.mesh.triangles[*primitive as usize];
        }
        for (place, [a, b, c]) in ends[..count].iter().enumerate() {
            let corner = |vertex: u32| self.mesh.vertices[vertex as usize];
            prefilter.put(place, [corner(*a), corner(*b), corner(*c)]);
        }
        prefilter.ready(count, self.mesh.scale, self.sides);

        near.clear();
        for row in (0..rows).filter(|row| here.any[*row] & leaves != 0) {
            let (d, m) = (&here.direction[row], &here.moment[row]);
            let passing = prefilter.pass(homes, &here.met[row], d, m);
            let mut kept = near.len();
            near.resize(kept + WIDE, (0, 0));
            let rays = &lists[begin + row * WIDE..][..WIDE];
            for k in 0..WIDE {
                near[kept] = (rays[k], passing[k]);
                kept += usize::from(passing[k] != 0);
            }
            near.truncate(kept);
        }
        for &(ray, mut passing) in &*near {
            let ray = ray as usize;
            let (sheared, reach, start) = &mut self.aims[ray];
            while passing != 0 {
                let primitive = primitives[passing.trailing_zeros() as usize];
                passing &= passing - 1;
                let triangle = self.mesh.triangle(primitive as usize);
                let Some((distance, side)) = triangle.cross(sheared, *reach, self.sides) else {
                    continue;
                };
                reach.to = distance;
                coarse.bound[ray] = bound(distance, *start, self.mesh.scale);
                self.found[ray] = Some(Intersection { distance, primitive, side });
            }
        }
    }
}

impl Boxes {
    #[inline(always)]
    fn from_node(node: &CwBvhNode) -> Self {
        let (p, e) = (node.p.to_array(), node.e);
        let corner = |sides: [&[u8; 8]; 3]| {
            let mut corner = [[0.0; 8]; 3];
            for axis in 0..3 {
                let step = f32::from_bits(u32::from(e[axis]) << 23);
                for child in 0..8 {
                    corner[axis][child] = p[axis] + step * f32::from(sides[axis][child]);
                }
            }
            corner
        };
        Self {
            low: corner([&node.child_min_x, &node.child_min_y, &node.child_min_z]),
            high: corner([&node.child_max_x, &node.child_max_y, &node.child_max_z]),
        }
    }
}

/// The children of a set in order, the one whose box lies farthest ahead of the first ray first;
/// behind them the others.
#[inline(always)]
fn order(boxes: &Boxes, here: &Here, set: u32) -> [usize; 8] {
    let ahead = [0, 1, 2].map(|axis| here.direction[0][axis][0]);
    let (mut keys, mut ranks) = ([f32::NEG_INFINITY; 8], [0_u32; 8]);
    for child in 0..8 {
        let middle = |axis: usize| ahead[axis] * (boxes.low[axis][child] + boxes.high[axis][child]);
        let key = middle(0) + middle(1) + middle(2);
        keys[child] = if set >> child & 1 == 0 { keys[child] } else { key };
    }
    for other in 0..8 {
        for child in 0..8 {
            let (this, that) = (keys[child], keys[other]);
            ranks[child] += u32::from((that > this) | ((that >= this) & (other < child)));
        }
    }
    let mut order = [0; 8];
    for child in 0..8 {
        order[ranks[child] as usize & 7] = child;
    }
    order
}

/// Puts the rays of a list beside each other.
#[inline(always)]
fn gather(coarse: &Coarse, list: &[u32], here: &mut Here) {
    for (row, rays) in list.chunks_exact(WIDE).enumerate().take(ROWS) {
        let (origin, direction) = (&mut here.origin[row], &mut here.direction[row]);
        let (inverse, moment) = (&mut here.inverse[row], &mut here.moment[row]);
        for k in 0..WIDE {
            let ray = rays[k] as usize & (PACKET - 1);
            let at = |of: &[[f32; PACKET]; 3]| [of[0][ray], of[1][ray], of[2][ray]];
            let (o, d) = (at(&coarse.origin), at(&coarse.direction));
            let o_d =
                [o[1] * d[2] - o[2] * d[1], o[2] * d[0] - o[0] * d[2], o[0] * d[1] - o[1] * d[0]];
            for axis in 0..3 {
                origin[axis][k] = o[axis];
                direction[axis][k] = d[axis];
                inverse[axis][k] = 1.0 / d[axis];
                moment[axis][k] = o_d[axis];
            }
            here.bound[row][k] = coarse.bound[ray];
        }
    }
}

/// Notes which boxes the rays of the first rows meet; those that any of them meets.
#[inline(always)]
fn meet(boxes: &Boxes, here: &mut Here, rows: usize) -> u32 {
    let less = |a: f32, b: f32| if a < b { a } else { b };
    let more = |a: f32, b: f32| if a > b { a } else { b };
    let mut all = 0;
    for row in 0..rows.min(ROWS) {
        let (origin, inverse, bound) = (here.origin[row], here.inverse[row], here.bound[row]);
        let mut met = [0; WIDE];
        for child in 0..8 {
            let (low, high) = (&boxes.low, &boxes.high);
            for k in 0..WIDE {
                let (mut near, mut far) = (-BEFORE as f32, bound[k]);
                for axis in 0..3 {
                    let (o, i) = (origin[axis][k], inverse[axis][k]);
                    let (a, b) = ((low[axis][child] - o) * i, (high[axis][child] - o) * i);
                    near = more(near, less(a, b));
                    far = less(far, more(a, b));
                }
                met[k] |= if near <= far { 1 << child } else { 0 };
            }
        }
        let mut any = 0;
        for k in 0..WIDE {
            any |= met[k];
        }
        here.met[row] = met;
        here.any[row] = any;
        all |= any;
    }
    all
}

/// Adds those rays of the list from `begin` on that meet a child.
#[inline(always)]
fn pick(lists: &mut Vec<u32>, begin: usize, here: &Here, rows: usize, child: usize) {
    let first = lists.len();
    lists.resize(first + rows * WIDE, 0);
    let (list, picked) = lists.split_at_mut(first);
    let mut count = 0;
    for (row, rays) in list[begin..].chunks_exact(WIDE).enumerate().take(rows) {
        if here.any[row] >> child & 1 == 0 {
            continue;
        }
        for k in 0..WIDE {
            picked[count] = rays[k];
            count += (here.met[row][k] >> child & 1) as usize;
        }
    }
    lists.truncate(first + count);
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
        let mut traversal = PacketTraversal::new();
        for (sides, spread) in [(Sides::Inner, 0.4), (Sides::Outer, 3.0), (Sides::Both, 300.0)] {
            let (mut rays, mut reaches) = (Vec::new(), Vec::new());
            for number in 0..PACKET - 7 {
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
            let many = mesh.intersect_many(&mut traversal, &rays, &reaches, sides);
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
