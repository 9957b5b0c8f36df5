// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scatter table of one side and transport: outgoing power over cells of direction, for any
//! incidence.
//!
//! All directions lie in the upper hemisphere (z ≥ 0), `wi` and `wo` both away from the surface;
//! [`MeasuredBsdf`](super::MeasuredBsdf) knows the sides.

use crate::angular_basis::{
    AngularBasis, OrientedBasis, above, disc_to_square, raised, square_to_disc,
};
use crate::direction::mirrored;
use crate::tensor_tree::{Leaf, TensorTree};
use glam::DVec3;
use rand::RngExt;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Discrete distribution of power over cells.
#[derive(Clone, Debug)]
pub struct CellDistribution {
    basis: OrientedBasis,
    /// Cells with power, ascending, each with the running sum of power up to and including it.
    entries: Vec<(u32, f64)>,
    /// Factor that brought the powers to a stated sum.
    factor: f64,
}

impl CellDistribution {
    /// From the BSDF of each cell, 1/sr. With `total`, powers are scaled to that sum.
    pub fn new(
        basis: OrientedBasis,
        values: impl IntoIterator<Item = f64>,
        total: Option<f64>,
    ) -> Self {
        let mut distribution = Self { basis, entries: Vec::new(), factor: 1.0 };
        let mut sum = 0.0;
        for (cell, value) in values.into_iter().enumerate() {
            if value > 0.0 {
                let power = value * distribution.basis.projected_solid_angle(cell);
                if power > 0.0 {
                    sum += power;
                    distribution.entries.push((cell as u32, sum));
                }
            }
        }
        distribution.entries.shrink_to_fit();
        if let Some(total) = total
            && sum > 0.0
        {
            distribution.factor = total / sum;
            return distribution.scaled(total / sum);
        }
        distribution
    }

    /// All powers times `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for entry in &mut self.entries {
            entry.1 *= factor;
        }
        self
    }

    /// Factor that brought the powers to the sum stated by the file; 1 where it states none.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Power of all cells.
    pub fn total(&self) -> f64 {
        self.entries.last().map_or(0.0, |e| e.1)
    }

    fn power(&self, entry: usize) -> f64 {
        let before = if entry == 0 { 0.0 } else { self.entries[entry - 1].1 };
        self.entries[entry].1 - before
    }

    fn sample(&self, rng: &mut dyn rand::Rng) -> Option<DVec3> {
        let level = rng.random::<f64>() * self.total();
        let entry =
            self.entries.partition_point(|e| e.1 <= level).min(self.entries.len().checked_sub(1)?);
        let cell = self.entries[entry].0 as usize;
        Some(self.basis.sample(cell, rng))
    }

    /// BSDF at a direction, 1/sr.
    pub(super) fn value(&self, wo: DVec3) -> f64 {
        let Some(cell) = self.basis.locate(wo) else {
            return 0.0;
        };
        match self.entries.binary_search_by_key(&(cell as u32), |e| e.0) {
            Ok(entry) => self.power(entry) / self.basis.projected_solid_angle(cell),
            Err(_) => 0.0,
        }
    }

    fn visit_cells(&self, take: &mut dyn FnMut(DVec3, f64)) {
        for entry in 0..self.entries.len() {
            let centre = self.basis.centre(self.entries[entry].0 as usize);
            take(raised(centre), self.power(entry));
        }
    }
}

/// A node of incidence.
#[derive(Clone, Debug)]
pub struct IncidentNode {
    /// Towards the light's origin.
    pub wi: DVec3,
    /// Distribution of the outgoing power.
    pub distribution: CellDistribution,
}

/// A table over incidences.
#[derive(Clone, Debug)]
pub enum ScatterTable {
    /// Nodes at all combinations of polar angle and azimuth (radians, both ascending), node number
    /// = polar · azimuths + azimuth. Interpolation is linear, and constant beyond the first and
    /// last polar angle. A single azimuth means an isotropic table.
    Grid {
        /// Polar angles.
        thetas: Vec<f64>,
        /// Azimuths, cyclic.
        phis: Vec<f64>,
        /// The nodes.
        nodes: Vec<IncidentNode>,
        /// Polar angle beyond which nothing is scattered: the critical angle for a table over the
        /// angle behind the surface, else π/2.
        end: f64,
    },
    /// One node for each cell of incidence, located by the direction of the *travelling* light; no
    /// interpolation.
    Matrix {
        /// The cells.
        cells: Arc<AngularBasis>,
        /// The nodes.
        nodes: Vec<IncidentNode>,
    },
    /// A tensor tree, from [`ScatterTable::tree`]; no interpolation.
    Tree(Arc<TensorTree>, Option<IncidenceTotals>),
}

/// Power of every cell of incidence of a tree: sampling then descends the tree once, not three
/// times.
#[derive(Clone, Debug)]
pub struct IncidenceTotals {
    side: usize,
    sums: Arc<[f64]>,
}

/// Nodes with weights that sum to 1, and the azimuth by which they are rotated.
struct WeightedNodes<'a> {
    nodes: [(Option<&'a IncidentNode>, f64); 4],
    rotation: f64,
}

fn rotated(v: DVec3, angle: f64) -> DVec3 {
    if angle == 0.0 {
        return v;
    }
    let (sin, cos) = angle.sin_cos();
    DVec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z)
}

impl ScatterTable {
    /// From a tree. The power of all cells of incidence is precomputed where the tree has at least
    /// as many values.
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
            IncidenceTotals { side, sums: sums.collect() }
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
        let mut nearby = WeightedNodes { nodes: [(None, 0.0); 4], rotation: 0.0 };
        match self {
            Self::Grid { thetas, phis, nodes, end } => {
                let theta = wi.z.clamp(-1.0, 1.0).acos();
                if theta > *end {
                    return nearby;
                }
                let azimuth = wi.y.atan2(wi.x).rem_euclid(TAU);
                let (low, high, t) = bracket(thetas, theta);
                let (left, right, s) = if phis.len() == 1 {
                    nearby.rotation = azimuth - phis[0];
                    (0, 0, 0.0)
                } else {
                    bracket_cyclic(phis, azimuth)
                };
                let node = |i: usize, j: usize| nodes.get(i * phis.len() + j);
                nearby.nodes = [
                    (node(low, left), (1.0 - t) * (1.0 - s)),
                    (node(low, right), (1.0 - t) * s),
                    (node(high, left), t * (1.0 - s)),
                    (node(high, right), t * s),
                ];
            }
            Self::Matrix { cells, nodes } => {
                nearby.nodes[0] = (cells.locate(mirrored(wi)).and_then(|c| nodes.get(c)), 1.0);
            }
            Self::Tree(..) => {}
        }
        nearby
    }

    /// Coordinates of `wi` in a tree, and the rotation of its exit.
    fn tree_coordinates(tree: &TensorTree, wi: DVec3) -> (Vec<f64>, f64) {
        let rotation = if tree.rank == 3 { (-wi.y).atan2(-wi.x) } else { 0.0 };
        (tree.incidence([-wi.x, -wi.y]), rotation)
    }

    /// Power scattered per incident power for light from `wi`.
    pub fn total(&self, wi: DVec3) -> f64 {
        if let Self::Tree(tree, totals) = self {
            return Self::tree_total(tree, totals.as_ref(), &Self::tree_coordinates(tree, wi).0);
        }
        let nearby = self.nearby(wi);
        nearby
            .nodes
            .iter()
            .map(|(node, weight)| weight * node.map_or(0.0, |n| n.distribution.total()))
            .sum()
    }

    /// Samples an outgoing direction; returns it after the incidence of its node.
    pub(super) fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<(DVec3, DVec3)> {
        if let Self::Tree(tree, totals) = self {
            let (incidence, rotation) = Self::tree_coordinates(tree, wi);
            let total = Self::tree_total(tree, totals.as_ref(), &incidence);
            let mut level = rng.random::<f64>() * total;
            let mut chosen: Option<Leaf> = None;
            tree.leaves(&incidence, &mut |leaf| {
                let power = leaf.value * leaf.projected();
                if power > 0.0 {
                    chosen = Some(leaf);
                    level -= power;
                }
                level >= 0.0
            });
            let leaf = chosen?;
            let at = |k: usize, u: f64| leaf.corner[k] + leaf.edge * u;
            let wo = above(square_to_disc([at(0, rng.random()), at(1, rng.random())]));
            return Some((wi, rotated(wo, rotation)));
        }
        let nearby = self.nearby(wi);
        let part = |k: usize| {
            let (node, weight) = nearby.nodes[k];
            weight * node.map_or(0.0, |n| n.distribution.total())
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
        let wo = node.distribution.sample(rng)?;
        Some((rotated(node.wi, nearby.rotation), rotated(wo, nearby.rotation)))
    }

    /// Density of [`ScatterTable::sample`] at `wo` times the total, 1/sr: BSDF times cosine.
    pub(super) fn density(&self, wi: DVec3, wo: DVec3) -> f64 {
        if let Self::Tree(tree, _) = self {
            let (incidence, rotation) = Self::tree_coordinates(tree, wi);
            let back = rotated(wo, -rotation);
            let [u, v] = disc_to_square([back.x, back.y]);
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
        let back = rotated(wo, -nearby.rotation);
        nearby
            .nodes
            .iter()
            .filter(|(_, weight)| *weight > 0.0)
            .map(|(node, weight)| weight * node.map_or(0.0, |n| n.distribution.value(back)))
            .sum::<f64>()
            * wo.z
    }

    /// Calls `take` for every cell with power: incidence of the node, centre of the cell, power.
    pub(super) fn visit_cells(&self, wi: DVec3, take: &mut dyn FnMut(DVec3, DVec3, f64)) {
        if let Self::Tree(tree, _) = self {
            let (incidence, rotation) = Self::tree_coordinates(tree, wi);
            tree.leaves(&incidence, &mut |leaf| {
                if leaf.value > 0.0 {
                    let wo = above(square_to_disc(leaf.corner.map(|c| c + 0.5 * leaf.edge)));
                    take(wi, rotated(wo, rotation), leaf.value * leaf.projected());
                }
                true
            });
            return;
        }
        let nearby = self.nearby(wi);
        for (node, weight) in nearby.nodes {
            if let Some(node) = node.filter(|_| weight > 0.0) {
                let from = rotated(node.wi, nearby.rotation);
                node.distribution.visit_cells(&mut |centre, power| {
                    take(from, rotated(centre, nearby.rotation), weight * power);
                });
            }
        }
    }

    /// Scales the nodes whose power is above `most` of their incidence down to it.
    pub(super) fn limit(&mut self, most: impl Fn(DVec3) -> f64) {
        if let Self::Grid { nodes, .. } | Self::Matrix { nodes, .. } = self {
            for node in nodes {
                let (total, most) = (node.distribution.total(), most(node.wi));
                if total > most {
                    node.distribution = node.distribution.clone().scaled(most / total);
                }
            }
        }
    }

    /// True if `wi` is a node of the table.
    pub(super) fn has_node(&self, wi: DVec3) -> bool {
        match self {
            Self::Tree(..) => true,
            Self::Grid { nodes, .. } | Self::Matrix { nodes, .. } => {
                nodes.iter().any(|n| (n.wi - wi).length() < 1e-9)
            }
        }
    }

    /// True if the table is given at one azimuth for all and rotates with the incidence.
    pub fn is_isotropic(&self) -> bool {
        match self {
            Self::Grid { phis, .. } => phis.len() == 1,
            Self::Matrix { .. } => false,
            Self::Tree(tree, _) => tree.rank == 3,
        }
    }

    /// Smallest and largest factor that brought powers to a stated sum; `None` where none is
    /// stated.
    pub fn factors(&self) -> Option<[f64; 2]> {
        let Self::Grid { nodes, .. } = self else {
            return None;
        };
        let factors = nodes.iter().filter(|n| n.distribution.total() > 0.0);
        factors.map(|n| n.distribution.factor()).fold(None, |range, f| {
            let [low, high] = range.unwrap_or([f, f]);
            Some([low.min(f), high.max(f)])
        })
    }

    /// The incidences at which the table is given. For a tree, the centres of a grid over its
    /// square, as fine as the tree within 32 to 128 cells along each coordinate.
    pub fn incidences(&self) -> Vec<DVec3> {
        match self {
            Self::Grid { nodes, .. } | Self::Matrix { nodes, .. } => {
                nodes.iter().map(|n| n.wi).collect()
            }
            Self::Tree(tree, _) => {
                let side = (1.0 / tree.finest()).clamp(32.0, 128.0) as u32;
                let at = |k: u32| (f64::from(k) + 0.5) / f64::from(side);
                let points = (0..side).flat_map(|i| (0..side).map(move |j| [at(i), at(j)]));
                points.map(|p| mirrored(above(square_to_disc(p)))).collect()
            }
        }
    }
}

/// Indices of the points around `x` in an ascending list, and the weight of the upper one.
fn bracket(points: &[f64], x: f64) -> (usize, usize, f64) {
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

/// [`bracket`] around the circle.
fn bracket_cyclic(points: &[f64], x: f64) -> (usize, usize, f64) {
    let n = points.len();
    let above = points.partition_point(|p| *p <= x);
    let (low, high) = ((above + n - 1) % n, above % n);
    let gap = (points[high] - points[low]).rem_euclid(TAU);
    if gap <= 0.0 {
        return (low, low, 0.0);
    }
    (low, high, (x - points[low]).rem_euclid(TAU) / gap)
}
