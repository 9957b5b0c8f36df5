// SPDX-License-Identifier: MIT OR Apache-2.0
//! Panels, and the matrix of the kernels between two of them.
//!
//! Three rules, by the place of the target: on the panel itself or on its neighbour on one curve
//! the logarithm has weights of its own \[Helsing2008\]; close to it the panel is halved until its
//! pieces are at least twice as far away as they are long; elsewhere Gauss-Legendre does.

use crate::kernel::{Entry, Media, Pair, Pairs, diagonal, kernels, kernels_of_panel};
use crate::outline::Curve;
use crate::quadrature::{NODES, PerNode, rule};
use num_complex::Complex64;

/// A piece nearer than this many of its lengths is halved.
const NEAR: f64 = 0.5;
/// Halvings of a panel before its pieces are used as they are.
const MAX_HALVINGS: u32 = 60;

/// Reflections in x and in z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Reflection {
    pub x: bool,
    pub z: bool,
}

impl Reflection {
    pub const IDENTITY: Self = Self { x: false, z: false };

    /// Sign of a density's image: `parity` for x, `mirror` for z.
    pub fn sign(self, parity: f64, mirror: f64) -> f64 {
        (if self.x { parity } else { 1.0 }) * (if self.z { mirror } else { 1.0 })
    }

    pub fn of(self, [x, z]: [f64; 2]) -> [f64; 2] {
        [if self.x { -x } else { x }, if self.z { -z } else { z }]
    }
}

/// Quadrature node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub point: [f64; 2],
    pub normal: [f64; 2],
    /// Arc length on the curve.
    pub along: f64,
    /// Weight of an integral over the arc length.
    pub weight: f64,
}

/// Piece of a curve with the nodes of one rule.
#[derive(Clone, Debug)]
pub(crate) struct Panel {
    /// Number of the curve: panels of one number lie on one line or arc.
    pub number: usize,
    pub curve: Curve,
    pub start: f64,
    pub end: f64,
    pub nodes: [Node; NODES],
}

impl Panel {
    pub fn new(number: usize, curve: Curve, start: f64, end: f64) -> Self {
        let (mid, half) = (0.5 * (start + end), 0.5 * (end - start));
        let rule = rule();
        let nodes = std::array::from_fn(|i| {
            let along = mid + half * rule.nodes[i];
            Node {
                point: curve.point(along),
                normal: curve.normal(along),
                along,
                weight: half * rule.weights[i],
            }
        });
        Self { number, curve, start, end, nodes }
    }

    pub fn length(&self) -> f64 {
        self.end - self.start
    }

    fn middle(&self) -> [f64; 2] {
        self.curve.point(0.5 * (self.start + self.end))
    }

    /// True for the panel itself and its neighbours on one curve.
    fn touches(&self, other: &Self) -> bool {
        let gap = (other.start - self.end).max(self.start - other.end);
        self.number == other.number && gap < 1e-9 * self.length()
    }
}

/// Kernels times weights: `[row][column][source node][part][target node]`, the part real or
/// imaginary.
pub(crate) type Block = [[[[PerNode; 2]; NODES]; 2]; 2];

/// Visits the columns of a block by first row, column, and real and imaginary part of the rows.
pub(crate) fn for_each_column(block: &Block, mut visit: impl FnMut(usize, usize, &[PerNode; 2])) {
    for (row, columns) in block.iter().enumerate() {
        for (column, sources) in columns.iter().enumerate() {
            for (j, parts) in sources.iter().enumerate() {
                visit(row * NODES, column * NODES + j, parts);
            }
        }
    }
}

/// Adds `factor` times the kernels from `source`, reflected, to `target`.
pub(crate) fn add(
    media: &Media,
    target: &Panel,
    source: &Panel,
    image: Reflection,
    factor: f64,
    block: &mut Block,
) {
    let one_curve = image == Reflection::IDENTITY && source.number == target.number;
    if one_curve && source.touches(target) {
        add_touching(media, target, source, factor, block);
        return;
    }
    let shared_curvature = one_curve.then_some(source.curve.curvature);
    let [x, z] = target.middle();
    let [sx, sz] = image.of(source.middle());
    let reach = 0.5 * target.length() + (0.5 + NEAR) * source.length();
    if (x - sx).hypot(z - sz) < reach {
        for (i, node) in target.nodes.iter().enumerate() {
            let pair = |s: f64| {
                if let Some(curvature) = shared_curvature {
                    return Pair::along(curvature, node.along - s);
                }
                let (point, normal) = (source.curve.point(s), source.curve.normal(s));
                Pair::apart(node.point, node.normal, image.of(point), image.of(normal))
            };
            let identity = std::array::from_fn(unit);
            let whole = Piece { start: source.start, end: source.end, basis: &identity };
            add_near(media, &pair, &whole, 0, &mut |j, entry| {
                add_entry(block, i, j, entry, factor);
            });
        }
        return;
    }
    for (j, from) in source.nodes.iter().enumerate() {
        let (point, normal) = (image.of(from.point), image.of(from.normal));
        let pairs = Pairs::new(|i| {
            let to = &target.nodes[i];
            match shared_curvature {
                Some(curvature) => Pair::along(curvature, to.along - from.along),
                None => Pair::apart(to.point, to.normal, point, normal),
            }
        });
        let entries = kernels_of_panel(media, &pairs);
        let weight = factor * from.weight;
        for (row, column, part) in parts() {
            let lanes = &mut block[row][column][j][part];
            for (lane, entry) in lanes.iter_mut().zip(entries[row][column][part]) {
                *lane += weight * entry;
            }
        }
    }
}

/// Rows, columns and parts of the kernels.
fn parts() -> impl Iterator<Item = (usize, usize, usize)> {
    (0..8).map(|k| (k / 4, k / 2 % 2, k % 2))
}

fn unit(j: usize) -> PerNode {
    std::array::from_fn(|i| if i == j { 1.0 } else { 0.0 })
}

fn add_entry(block: &mut Block, i: usize, j: usize, entry: &Entry, weight: f64) {
    for (row, column, part) in parts() {
        let value = entry[row][column];
        block[row][column][j][part][i] += weight * [value.re, value.im][part];
    }
}

/// Part of a panel: row m of `basis` takes values at the nodes of the panel to node m of the part.
struct Piece<'a> {
    start: f64,
    end: f64,
    basis: &'a [PerNode; NODES],
}

/// Halves a piece until it is far enough from the target, and gives for each node of the panel the
/// integral of the kernels times the polynomial that is 1 there and 0 at the others.
fn add_near(
    media: &Media,
    pair: &impl Fn(f64) -> Pair,
    piece: &Piece,
    halvings: u32,
    out: &mut impl FnMut(usize, &Entry),
) {
    let rule = rule();
    let (mid, half) = (0.5 * (piece.start + piece.end), 0.5 * (piece.end - piece.start));
    let pairs = Pairs::new(|m| pair(mid + half * rule.nodes[m]));
    if pairs.min_distance() < NEAR * 2.0 * half && halvings < MAX_HALVINGS {
        for (side, (start, end)) in [(piece.start, mid), (mid, piece.end)].into_iter().enumerate() {
            let basis: [PerNode; NODES] = std::array::from_fn(|m| {
                let row = &rule.to_halves[side][m];
                std::array::from_fn(|j| (0..NODES).map(|l| row[l] * piece.basis[l][j]).sum())
            });
            add_near(media, pair, &Piece { start, end, basis: &basis }, halvings + 1, out);
        }
        return;
    }
    let entries = kernels_of_panel(media, &pairs);
    for j in 0..NODES {
        let weights: PerNode = std::array::from_fn(|m| half * rule.weights[m] * piece.basis[m][j]);
        let sum = |lanes: PerNode| lanes.iter().zip(&weights).map(|(l, w)| l * w).sum();
        out(j, &entries.map(|row| row.map(|[re, im]| Complex64::new(sum(re), sum(im)))));
    }
}

/// K = K_smooth + K_log log|t - s| with t and s of the rule of the source panel.
fn add_touching(media: &Media, target: &Panel, source: &Panel, factor: f64, block: &mut Block) {
    let rule = rule();
    let itself = (target.start - source.start).abs() < 1e-9 * source.length();
    let (mid, half) = (0.5 * (source.start + source.end), 0.5 * source.length());
    for (i, node) in target.nodes.iter().enumerate() {
        let t = (node.along - mid) / half;
        let outside;
        let log_weights = if itself {
            &rule.log_weights[i]
        } else {
            outside = rule.log_weights_at(t);
            &outside
        };
        for (j, from) in source.nodes.iter().enumerate() {
            let (full, log, logarithm) = if itself && i == j {
                let (full, log) = diagonal(media, source.curve.curvature, half);
                (full, log, 0.0)
            } else {
                let pair = Pair::along(source.curve.curvature, node.along - from.along);
                let (full, log) = kernels(media, &pair);
                (full, log, (t - rule.nodes[j]).abs().ln())
            };
            add_entry(block, i, j, &full, factor * from.weight);
            let excess = half * log_weights[j] - from.weight * logarithm;
            add_entry(block, i, j, &log, factor * excess);
        }
    }
}
