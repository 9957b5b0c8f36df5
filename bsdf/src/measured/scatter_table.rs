// SPDX-License-Identifier: MIT OR Apache-2.0
//! One table: how light from one side, at any incidence, is distributed over the cells of one hemisphere.
//!
//! All directions are in the upper hemisphere (z ≥ 0), `wi` and `wo` both away from the surface; [`MeasuredBsdf`](super::MeasuredBsdf) knows the sides.

use crate::angular_basis::{AngularBasis, square_to_disc};
use crate::tensor_tree::{Leaf, TensorTree};
use glam::DVec3;
use rand::RngExt;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Tries to draw a direction above the horizon in a cell that reaches below it. They are many where little of it lies above, and a cell is drawn as seldom: what
/// all cells take on the mean does not grow with it.
const TRIES: usize = 1 << 20;
/// Points along each edge of a cell from which its integral above the horizon is taken.
const POINTS: usize = 6;

/// An axis other than the normal, about which cells are given: a right-handed frame whose z is the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolarFrame {
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl PolarFrame {
    /// About `axis` (unit, z ≥ 0), azimuth 0 towards the normal; for an axis along the normal, towards `zero` (tangential).
    #[must_use]
    pub fn new(axis: DVec3, zero: DVec3) -> Self {
        let towards = DVec3::Z - axis * axis.z;
        let x = if towards.length() > 1e-9 {
            towards.normalize()
        } else {
            (zero - axis * axis.dot(zero)).normalize()
        };
        Self {
            x,
            y: axis.cross(x),
            z: axis,
        }
    }

    /// From the frame of the axis.
    #[must_use]
    pub fn world(self, v: DVec3) -> DVec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// Into the frame of the axis.
    #[must_use]
    pub fn local(self, v: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Integral of cos θ dΩ over the part of a cell about this axis above the horizon, θ from the normal; sr.
    #[must_use]
    pub fn projected(self, cells: &AngularBasis, cell: usize) -> f64 {
        let at = |k: usize| (k as f64 + 0.5) / POINTS as f64;
        let mut sum = 0.0;
        for i in 0..POINTS {
            for j in 0..POINTS {
                let direction = self.world(cells.inside_solid(cell, at(i), at(j)));
                sum += direction.z.max(0.0);
            }
        }
        cells.solid(cell) * sum / (POINTS * POINTS) as f64
    }
}

/// Shares of power over cells.
#[derive(Clone, Debug)]
pub struct CellDistribution {
    cells: Arc<AngularBasis>,
    pole: Option<PolarFrame>,
    /// Cells with power, ascending, with the running sum of the shares up to and with each.
    entries: Vec<(u32, f64)>,
    /// What the shares were multiplied by to reach a stated sum.
    factor: f64,
}

impl CellDistribution {
    /// From the BSDF of each cell in 1/sr, about the normal or about `pole`. With `total`, shares are scaled to that sum.
    #[must_use]
    pub fn new(
        cells: &Arc<AngularBasis>,
        pole: Option<PolarFrame>,
        values: impl IntoIterator<Item = f64>,
        total: Option<f64>,
    ) -> Self {
        let mut cloud = Self {
            cells: Arc::clone(cells),
            pole,
            entries: Vec::new(),
            factor: 1.0,
        };
        let mut sum = 0.0;
        for (cell, value) in values.into_iter().enumerate() {
            if value > 0.0 {
                let share = value * cloud.projected(cell);
                if share > 0.0 {
                    sum += share;
                    cloud.entries.push((cell as u32, sum));
                }
            }
        }
        cloud.entries.shrink_to_fit();
        if let Some(total) = total
            && sum > 0.0
        {
            cloud.factor = total / sum;
            return cloud.scaled(total / sum);
        }
        cloud
    }

    /// All shares times `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for entry in &mut self.entries {
            entry.1 *= factor;
        }
        self
    }

    /// What the shares of the cells were multiplied by to reach the sum that the file states; 1 where it states none.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Sum of all shares.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.entries.last().map_or(0.0, |e| e.1)
    }

    /// Integral of cos θ dΩ over the part of a cell above the horizon.
    fn projected(&self, cell: usize) -> f64 {
        self.pole.map_or_else(
            || self.cells.projected(cell),
            |pole| pole.projected(&self.cells, cell),
        )
    }

    fn share(&self, entry: usize) -> f64 {
        let before = if entry == 0 {
            0.0
        } else {
            self.entries[entry - 1].1
        };
        self.entries[entry].1 - before
    }

    fn draw(&self, rng: &mut dyn rand::Rng) -> Option<DVec3> {
        let level = rng.random::<f64>() * self.total();
        let entry = self
            .entries
            .partition_point(|e| e.1 <= level)
            .min(self.entries.len().checked_sub(1)?);
        let cell = self.entries[entry].0 as usize;
        let Some(pole) = self.pole else {
            return Some(self.cells.inside(cell, rng.random(), rng.random()));
        };
        for _ in 0..TRIES {
            let inside = self.cells.inside_solid(cell, rng.random(), rng.random());
            let direction = pole.world(inside);
            if direction.z > rng.random::<f64>() {
                return Some(direction);
            }
        }
        let middle = pole.world(self.cells.middle(cell));
        Some(DVec3::new(middle.x, middle.y, middle.z.max(1e-9)).normalize())
    }

    /// BSDF at a direction, 1/sr.
    fn value(&self, wo: DVec3) -> f64 {
        let local = self.pole.map_or(wo, |pole| pole.local(wo));
        let Some(cell) = self.cells.locate(local) else {
            return 0.0;
        };
        match self.entries.binary_search_by_key(&(cell as u32), |e| e.0) {
            Ok(entry) => self.share(entry) / self.projected(cell),
            Err(_) => 0.0,
        }
    }

    fn visit(&self, take: &mut dyn FnMut(DVec3, f64)) {
        for entry in 0..self.entries.len() {
            let middle = self.cells.middle(self.entries[entry].0 as usize);
            let world = self.pole.map_or(middle, |pole| pole.world(middle));
            let above = DVec3::new(world.x, world.y, world.z.max(1e-9)).normalize();
            take(above, self.share(entry));
        }
    }
}

/// Light from one direction.
#[derive(Clone, Debug)]
pub struct IncidentNode {
    /// Towards where it comes from.
    pub wi: DVec3,
    /// Where it goes.
    pub cloud: CellDistribution,
}

/// A table over incidences.
#[derive(Clone, Debug)]
pub enum ScatterTable {
    /// Nodes at all combinations of polar angle and azimuth (radians, both ascending), node number = polar · azimuths + azimuth; linear
    /// interpolation, constant beyond the first and last polar angle. One azimuth means isotropic: given for incidence at azimuth 0.
    Grid {
        /// Polar angles.
        thetas: Vec<f64>,
        /// Azimuths, cyclic.
        phis: Vec<f64>,
        /// The nodes.
        nodes: Vec<IncidentNode>,
        /// Polar angle beyond which nothing is scattered: the critical angle of tables by the angle behind a surface, else π/2.
        end: f64,
    },
    /// One node for each cell of incidence, whose tangential part is that of the *travelling* light; no interpolation.
    Patches {
        /// The cells.
        cells: Arc<AngularBasis>,
        /// The nodes.
        nodes: Vec<IncidentNode>,
    },
    /// A tensor tree; no interpolation. Made by [`ScatterTable::tree`].
    Tree(Arc<TensorTree>, Option<IncidenceTotals>),
}

/// Power of every cell of incidence of a tree, so that drawing needs one way through it instead of three.
#[derive(Clone, Debug)]
pub struct IncidenceTotals {
    side: usize,
    sums: Arc<[f64]>,
}

/// Some nodes with weights that sum to 1, and the azimuth by which they are turned.
struct WeightedNodes<'a> {
    nodes: [(Option<&'a IncidentNode>, f64); 4],
    turn: f64,
}

fn turned(v: DVec3, angle: f64) -> DVec3 {
    if angle == 0.0 {
        return v;
    }
    let (sin, cos) = angle.sin_cos();
    DVec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z)
}

impl ScatterTable {
    /// Of a tree. The power of all cells of incidence is kept where the file has at least as many values.
    #[must_use]
    pub fn tree(tree: TensorTree) -> Self {
        let side = (1.0 / tree.finest()).round() as usize;
        let coordinates = tree.rank - 2;
        let count = side.pow(coordinates as u32);
        let totals = (count <= tree.values()).then(|| {
            let at = |k: usize| (k as f64 + 0.5) / side as f64;
            let sums = (0..count).map(|cell| {
                let incidence: Vec<f64> = if coordinates == 1 {
                    vec![at(cell)]
                } else {
                    vec![at(cell / side), at(cell % side)]
                };
                tree.total(&incidence)
            });
            IncidenceTotals {
                side,
                sums: sums.collect(),
            }
        });
        Self::Tree(Arc::new(tree), totals)
    }

    /// Power of a tree for light of these coordinates.
    fn tree_total(tree: &TensorTree, totals: Option<&IncidenceTotals>, incidence: &[f64]) -> f64 {
        let Some(totals) = totals else {
            return tree.total(incidence);
        };
        let cell = incidence.iter().fold(0, |cell, c| {
            cell * totals.side + ((c * totals.side as f64) as usize).min(totals.side - 1)
        });
        totals.sums[cell]
    }

    fn nearby(&self, wi: DVec3) -> WeightedNodes<'_> {
        let mut nearby = WeightedNodes {
            nodes: [(None, 0.0); 4],
            turn: 0.0,
        };
        match self {
            Self::Grid {
                thetas,
                phis,
                nodes,
                end,
            } => {
                let theta = wi.z.clamp(-1.0, 1.0).acos();
                if theta > *end {
                    return nearby;
                }
                let azimuth = wi.y.atan2(wi.x).rem_euclid(TAU);
                let (low, high, t) = span(thetas, theta);
                let (left, right, s) = if phis.len() == 1 {
                    nearby.turn = azimuth - phis[0];
                    (0, 0, 0.0)
                } else {
                    cyclic(phis, azimuth)
                };
                let node = |i: usize, j: usize| nodes.get(i * phis.len() + j);
                nearby.nodes = [
                    (node(low, left), (1.0 - t) * (1.0 - s)),
                    (node(low, right), (1.0 - t) * s),
                    (node(high, left), t * (1.0 - s)),
                    (node(high, right), t * s),
                ];
            }
            Self::Patches { cells, nodes } => {
                let travelling = DVec3::new(-wi.x, -wi.y, wi.z);
                nearby.nodes[0] = (cells.locate(travelling).and_then(|c| nodes.get(c)), 1.0);
            }
            Self::Tree(..) => {}
        }
        nearby
    }

    /// Coordinates of `wi` in a tree, and by how much its exit is turned.
    fn in_tree(tree: &TensorTree, wi: DVec3) -> (Vec<f64>, f64) {
        let turn = if tree.rank == 3 {
            (-wi.y).atan2(-wi.x)
        } else {
            0.0
        };
        (tree.incidence([-wi.x, -wi.y]), turn)
    }

    /// Power scattered per incident power for light from `wi`.
    #[must_use]
    pub fn total(&self, wi: DVec3) -> f64 {
        if let Self::Tree(tree, totals) = self {
            return Self::tree_total(tree, totals.as_ref(), &Self::in_tree(tree, wi).0);
        }
        let nearby = self.nearby(wi);
        nearby
            .nodes
            .iter()
            .map(|(node, weight)| weight * node.map_or(0.0, |n| n.cloud.total()))
            .sum()
    }

    /// Draws where scattered light goes, and the incidence of the node that it was drawn from.
    pub(super) fn draw(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<(DVec3, DVec3)> {
        if let Self::Tree(tree, totals) = self {
            let (incidence, turn) = Self::in_tree(tree, wi);
            let total = Self::tree_total(tree, totals.as_ref(), &incidence);
            let mut level = rng.random::<f64>() * total;
            let mut chosen: Option<Leaf> = None;
            tree.leaves(&incidence, &mut |leaf| {
                let share = leaf.value * leaf.projected();
                if share > 0.0 {
                    chosen = Some(leaf);
                    level -= share;
                }
                level >= 0.0
            });
            let leaf = chosen?;
            let at = |k: usize, u: f64| leaf.corner[k] + leaf.edge * u;
            let [x, y] = square_to_disc([at(0, rng.random()), at(1, rng.random())]);
            let wo = DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt());
            return Some((wi, turned(wo, turn)));
        }
        let nearby = self.nearby(wi);
        let part = |k: usize| {
            let (node, weight) = nearby.nodes[k];
            weight * node.map_or(0.0, |n| n.cloud.total())
        };
        let mut level = rng.random::<f64>() * (0..4).map(part).sum::<f64>();
        let mut chosen = None;
        for k in 0..4 {
            if part(k) > 0.0 {
                chosen = nearby.nodes[k].0;
                level -= part(k);
                if level < 0.0 {
                    break;
                }
            }
        }
        let node = chosen?;
        let wo = node.cloud.draw(rng)?;
        Some((turned(node.wi, nearby.turn), turned(wo, nearby.turn)))
    }

    /// Probability density with which [`ScatterTable::draw`] gives `wo` times the total, 1/sr: BSDF times cosine.
    pub(super) fn density(&self, wi: DVec3, wo: DVec3) -> f64 {
        if let Self::Tree(tree, _) = self {
            let (incidence, turn) = Self::in_tree(tree, wi);
            let back = turned(wo, -turn);
            let [u, v] = crate::angular_basis::disc_to_square([back.x, back.y]);
            let mut value = 0.0;
            tree.leaves(&incidence, &mut |leaf| {
                let inside =
                    |k: usize, c: f64| c >= leaf.corner[k] && c < leaf.corner[k] + leaf.edge;
                let found = inside(0, u) && inside(1, v);
                if found {
                    value = leaf.value;
                }
                !found
            });
            return value * wo.z;
        }
        let nearby = self.nearby(wi);
        let back = turned(wo, -nearby.turn);
        nearby
            .nodes
            .iter()
            .filter(|(_, weight)| *weight > 0.0)
            .map(|(node, weight)| weight * node.map_or(0.0, |n| n.cloud.value(back)))
            .sum::<f64>()
            * wo.z
    }

    /// Calls `take` for every cell with power: incidence of the node, middle of the cell, share.
    pub(super) fn visit(&self, wi: DVec3, take: &mut dyn FnMut(DVec3, DVec3, f64)) {
        if let Self::Tree(tree, _) = self {
            let (incidence, turn) = Self::in_tree(tree, wi);
            tree.leaves(&incidence, &mut |leaf| {
                if leaf.value > 0.0 {
                    let [x, y] = square_to_disc(leaf.corner.map(|c| c + 0.5 * leaf.edge));
                    let wo = DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt());
                    take(wi, turned(wo, turn), leaf.value * leaf.projected());
                }
                true
            });
            return;
        }
        let nearby = self.nearby(wi);
        for (node, weight) in nearby.nodes {
            if let Some(node) = node.filter(|_| weight > 0.0) {
                let from = turned(node.wi, nearby.turn);
                node.cloud.visit(&mut |middle, share| {
                    take(from, turned(middle, nearby.turn), weight * share);
                });
            }
        }
    }

    /// Whether the table is given at `wi` and not only between its nodes.
    #[must_use]
    pub(super) fn knows(&self, wi: DVec3) -> bool {
        match self {
            Self::Tree(..) => true,
            Self::Grid { nodes, .. } | Self::Patches { nodes, .. } => {
                nodes.iter().any(|n| (n.wi - wi).length() < 1e-9)
            }
        }
    }

    /// Whether it turns with the incidence: given at one azimuth for all.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        match self {
            Self::Grid { phis, .. } => phis.len() == 1,
            Self::Patches { .. } => false,
            Self::Tree(tree, _) => tree.rank == 3,
        }
    }

    /// Smallest and largest of what shares were multiplied by to reach a stated sum; `None` where no power is stated.
    #[must_use]
    pub fn factors(&self) -> Option<[f64; 2]> {
        let Self::Grid { nodes, .. } = self else {
            return None;
        };
        let factors = nodes.iter().filter(|n| n.cloud.total() > 0.0);
        factors.map(|n| n.cloud.factor()).fold(None, |span, f| {
            let [low, high] = span.unwrap_or([f, f]);
            Some([low.min(f), high.max(f)])
        })
    }

    /// The incidences at which the table is given; for a tree, the middles of a grid over its square, as fine as the tree but for 32 to 128 cells
    /// along each coordinate.
    #[must_use]
    pub fn incidences(&self) -> Vec<DVec3> {
        match self {
            Self::Grid { nodes, .. } | Self::Patches { nodes, .. } => {
                nodes.iter().map(|n| n.wi).collect()
            }
            Self::Tree(tree, _) => {
                let side = (1.0 / tree.finest()).clamp(32.0, 128.0) as u32;
                let at = |k: u32| (f64::from(k) + 0.5) / f64::from(side);
                let points = (0..side).flat_map(|i| (0..side).map(move |j| [at(i), at(j)]));
                points
                    .map(|p| {
                        let [x, y] = square_to_disc(p);
                        DVec3::new(-x, -y, (1.0 - x * x - y * y).max(0.0).sqrt())
                    })
                    .collect()
            }
        }
    }
}

/// The points around `x` in an ascending list, and the weight of the upper one.
fn span(points: &[f64], x: f64) -> (usize, usize, f64) {
    let above = points.partition_point(|p| *p <= x);
    if above == 0 {
        return (0, 0, 0.0);
    }
    if above == points.len() {
        return (above - 1, above - 1, 0.0);
    }
    let weight = (x - points[above - 1]) / (points[above] - points[above - 1]);
    (above - 1, above, weight)
}

/// As [`span`], around the circle.
fn cyclic(points: &[f64], x: f64) -> (usize, usize, f64) {
    let n = points.len();
    let above = points.partition_point(|p| *p <= x);
    let (low, high) = ((above + n - 1) % n, above % n);
    let gap = (points[high] - points[low]).rem_euclid(TAU);
    if gap <= 0.0 {
        return (low, low, 0.0);
    }
    (low, high, (x - points[low]).rem_euclid(TAU) / gap)
}
