// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tiles of the outline, and the few unknowns of each by which it acts on the others.
//!
//! What a tile receives from or sends to places outside it is a sum of as many waves as its aperture
//! holds. An interpolative decomposition \[Cheng2005\] of the kernels between the tile and its
//! surroundings finds as many of its unknowns, its skeleton, and interpolates all others from them
//! \[Martinsson2005\] \[Ho2012\]. Tiles beside it are taken as they are, of those farther away the
//! nodes that resolve the waves of the tile; random sums of them hold all that matters
//! \[Halko2011\].

#![expect(clippy::inline_always, reason = "compiled for the instructions that were found")]

use crate::compression::{CMat, PER_PANEL};
use crate::coupling::{Coupling, place};
use crate::lu::{SingleMat, to_single};
use crate::mesh::{Corner, Mesh, PER_SIDE};
use crate::panel::{Node, Reflection};
use crate::quadrature::NODES;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{ColMut, Mat, MatRef, Par};
use num_complex::{Complex32, Complex64};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Random sums beyond the rank, and lanes that are computed together, both chosen; sums are a multiple of
/// both.
const SPARE: usize = 32;
const LANES: usize = 8;
/// Random sums that one of the surroundings is in: 8 are as good as sums of all \[Tropp2019\].
const SUMS_OF_ONE: usize = 8;
/// Free distance of two tiles, over their longest panel, from which sums over nodes stand for integrals over
/// panels. Chosen.
const FAR: f64 = 1.5;

/// Panels that follow each other along the outline; no corner is cut.
pub(crate) struct Tile {
    pub panels: Vec<usize>,
    middle: [f64; 2],
    radius: f64,
}

/// Unknowns of a tile that stand for all: a matrix T B interpolates all from the kept ones, a row each, a
/// column an unknown of the tile. Its norm is 20 to 50, and single precision would lose as much between large
/// sums of the kept ones; sums by B lose nothing.
pub(crate) struct Skeleton {
    /// Places of the kept ones among the unknowns of the tile, in the order of pivots.
    pub kept: Vec<usize>,
    /// The triangle T.
    pub triangle: CMat,
    /// The orthonormal rows B.
    pub basis: SingleMat,
}

/// How a tile acts on the others, and they on it.
pub(crate) struct Skeletons {
    pub sends: Skeleton,
    pub receives: Skeleton,
}

impl Tile {
    /// Cuts the outline into tiles of about so many unknowns.
    pub fn all(mesh: &Mesh, unknowns: usize) -> Vec<Self> {
        let count = mesh.panels.len();
        // The corner where a closed chain begins and ends is not cut.
        let wraps =
            |corner: &&Corner| corner.panels[0] > corner.panels[3] && corner.panels[3].is_some();
        let first = mesh.corners.iter().find(wraps).map_or(0, |_| PER_SIDE);
        let order: Vec<usize> = (0..count).map(|i| (i + first) % count).collect();
        let tiles = (count * PER_PANEL + unknowns / 2) / unknowns;
        let mut cuts = vec![0];
        for i in 1..tiles {
            let is_cut = |&at: &usize| {
                let [a, b] = [order[at - 1], order[at]].map(|panel| mesh.corner_of[panel]);
                a.is_none() || a != b
            };
            let ideal = (count * i).div_ceil(tiles);
            cuts.extend((ideal..count).find(is_cut).filter(|at| *at > cuts[cuts.len() - 1]));
        }
        cuts.push(count);
        cuts.windows(2).map(|pair| Self::new(mesh, order[pair[0]..pair[1]].to_vec())).collect()
    }

    fn new(mesh: &Mesh, panels: Vec<usize>) -> Self {
        let ends = |&panel: &usize| {
            let panel = &mesh.panels[panel];
            [panel.start, 0.5 * (panel.start + panel.end), panel.end].map(|s| panel.curve.point(s))
        };
        let points: Vec<[f64; 2]> = panels.iter().flat_map(ends).collect();
        let middle = [0, 1].map(|axis| {
            let values = points.iter().map(|point| point[axis]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
            0.5 * (low + high)
        });
        let distance = |p: &[f64; 2]| (p[0] - middle[0]).hypot(p[1] - middle[1]);
        let radius = points.iter().map(distance).fold(0.0, f64::max);
        Self { panels, middle, radius }
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.panels.len() * PER_PANEL
    }

    /// Nodes, in the order of the unknowns.
    pub fn nodes(&self, mesh: &Mesh) -> Vec<Node> {
        self.panels.iter().flat_map(|&panel| mesh.panels[panel].nodes).collect()
    }

    /// Free distance from another tile and its images.
    fn gap(&self, other: &Self, mesh: &Mesh) -> f64 {
        let distance = |image: &Reflection| {
            let [x, z] = image.of(other.middle);
            (x - self.middle[0]).hypot(z - self.middle[1]) - self.radius - other.radius
        };
        mesh.images.iter().map(distance).fold(f64::INFINITY, f64::min)
    }

    /// True if panels of both may be too near for the rule of far ones.
    pub fn is_near(&self, other: &Self, mesh: &Mesh) -> bool {
        let panels = self.panels.iter().chain(&other.panels);
        let longest = panels.map(|&panel| mesh.panels[panel].length()).fold(0.0, f64::max);
        self.gap(other, mesh) < FAR * longest
    }
}

/// Skeletons of all tiles; what they leave out is less than about `tolerance` of the largest kernels.
pub(crate) fn skeletons(coupling: Coupling, tiles: &[Tile], tolerance: f32) -> Vec<Skeletons> {
    let skeleton = |number: usize, sends| {
        let size = tiles[number].size();
        if tiles.len() == 1 {
            return Skeleton {
                kept: Vec::new(),
                triangle: CMat::zeros(0, 0),
                basis: SingleMat::zeros(0, size),
            };
        }
        let mut sums = (size / 4).next_multiple_of(LANES) + SPARE;
        loop {
            let sketch = Sketch::new(coupling, tiles, number, sends, sums);
            let skeleton = sketch.skeleton(tolerance);
            if skeleton.kept.len() + SPARE <= sums || sums >= size {
                return skeleton;
            }
            sums = (2 * sums).min(size);
        }
    };
    let both =
        |number| Skeletons { sends: skeleton(number, true), receives: skeleton(number, false) };
    (0..tiles.len()).into_par_iter().map(both).collect()
}

impl Skeleton {
    /// Splits the matrix from the kept unknowns to all, by QR of its adjoint.
    fn new(kept: Vec<usize>, interpolation: &CMat) -> Self {
        let factors = interpolation.adjoint().to_owned().qr();
        let triangle = factors.thin_R().adjoint().to_owned();
        let basis = to_single(&factors.compute_thin_Q().adjoint().to_owned());
        Self { kept, triangle, basis }
    }
}

/// Random sums of the kernels between a tile and its surroundings, a column an unknown of the tile:
/// real parts, then imaginary parts.
struct Sketch(Mat<f32>);

impl Sketch {
    fn new(coupling: Coupling, tiles: &[Tile], number: usize, sends: bool, sums: usize) -> Self {
        let mesh = coupling.mesh;
        let tile = &tiles[number];
        let nodes = tile.nodes(mesh);
        // A row an unknown of the tile, so that a sum takes up a whole column.
        let mut sketch = Mat::zeros(2 * tile.size(), sums);
        let mut random = Random(2 * number as u64 + u64::from(sends));
        for other in tiles.iter().enumerate().filter(|(i, _)| *i != number).map(|(_, tile)| tile) {
            let near = tile.is_near(other, mesh);
            // The waves of the tile change over their length times distance over width: nodes are taken
            // the more sparsely the farther they are.
            let stride = 1 + (tile.gap(other, mesh).max(0.0) / tile.radius) as usize;
            let sampled: Vec<Node> =
                other.nodes(mesh).into_iter().skip(stride / 2).step_by(stride).collect();
            let sides = match (near, sends) {
                (true, true) => coupling.of_panels(&other.panels, &tile.panels),
                (true, false) => coupling.of_panels(&tile.panels, &other.panels),
                (false, true) => coupling.of_nodes(&sampled, &nodes),
                (false, false) => coupling.of_nodes(&nodes, &sampled),
            };
            let scale = if near { 1.0 } else { (stride as f32).sqrt() };
            for side in &sides {
                let side = if sends { side.transpose() } else { side.as_ref() };
                add(&mut sketch, side, scale, &mut random);
            }
        }
        Self(sketch.transpose().to_owned())
    }

    /// Chooses the unknowns whose columns are farthest from the span of those chosen before: QR with
    /// column pivoting by Gram and Schmidt.
    fn skeleton(mut self, tolerance: f32) -> Skeleton {
        let size = self.0.ncols() / 2;
        let mut norms: Vec<f32> = (0..size).map(|column| self.norm(column)).collect();
        let (mut order, mut rows) = (Vec::new(), Vec::new());
        let mut largest = 0.0;
        while order.len() < self.0.nrows() {
            let pivot = (0..size).fold(0, |best, i| if norms[i] > norms[best] { i } else { best });
            let norm = norms[pivot].sqrt();
            largest = if order.is_empty() { norm } else { largest };
            if norm <= tolerance * largest {
                break;
            }
            let direction = [pivot, size + pivot].map(|part| {
                let column = self.0.col_as_slice(part).iter();
                column.map(|value| value / norm).collect::<Vec<f32>>()
            });
            let mut row = vec![Complex32::ZERO; size];
            for (column, (norm, product)) in norms.iter_mut().zip(&mut row).enumerate() {
                if *norm > 0.0 {
                    (*product, *norm) = self.without(column, &direction);
                }
            }
            // What rounding leaves of it is not chosen again.
            norms[pivot] = 0.0;
            order.push(pivot);
            rows.push(row);
        }
        let rank = order.len();
        let double = |i: usize, j: usize| {
            let value = rows[i][j];
            Complex64::new(value.re.into(), value.im.into())
        };
        let square = CMat::from_fn(rank, rank, |i, j| double(i, order[j]));
        let mut interpolation = CMat::from_fn(rank, size, double);
        solve_upper_triangular_in_place(square.as_ref(), interpolation.as_mut(), Par::Seq);
        for (i, &unknown) in order.iter().enumerate() {
            for row in 0..rank {
                interpolation[(row, unknown)] =
                    if row == i { Complex64::ONE } else { Complex64::ZERO };
            }
        }
        Skeleton::new(order, &interpolation)
    }

    /// Square of the norm of a column.
    fn norm(&self, column: usize) -> f32 {
        let size = self.0.ncols() / 2;
        let parts = [column, size + column].map(|part| self.0.col_as_slice(part));
        parts.iter().flat_map(|part| part.iter()).map(|value| value * value).sum()
    }

    /// Takes a unit vector out of a column; returns its share, and the square of the norm of the rest.
    fn without(&mut self, column: usize, direction: &[Vec<f32>; 2]) -> (Complex32, f32) {
        let size = self.0.ncols() / 2;
        let (left, right) = self.0.as_mut().split_at_col_mut(size);
        let columns = [left.col_mut(column), right.col_mut(column)];
        let columns = columns.map(|column| column.try_as_col_major_mut().map(ColMut::as_slice_mut));
        let [Some(re), Some(im)] = columns else { return (Complex32::ZERO, 0.0) };
        let [x, y] = [re, im].map(|part| part.as_chunks_mut::<LANES>().0);
        let [re, im] = [0, 1].map(|part: usize| direction[part].as_chunks::<LANES>().0);
        Arch::new().dispatch(Removal { column: [x, y], direction: [re, im] })
    }
}

/// Values that are computed together.
type Lanes = [f32; LANES];

/// A unit vector that is taken out of a column, real and imaginary parts.
struct Removal<'a> {
    column: [&'a mut [Lanes]; 2],
    direction: [&'a [Lanes]; 2],
}

impl WithSimd for Removal<'_> {
    type Output = (Complex32, f32);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let Self { column: [x, y], direction: [re, im] } = self;
        let (mut a, mut b) = ([0.0; LANES], [0.0; LANES]);
        for (((x, y), re), im) in x.iter().zip(y.iter()).zip(re).zip(im) {
            for l in 0..LANES {
                a[l] += re[l] * x[l] + im[l] * y[l];
                b[l] += re[l] * y[l] - im[l] * x[l];
            }
        }
        let [a, b] = [a, b].map(|lanes| lanes.iter().sum::<f32>());
        let mut norm = [0.0; LANES];
        for (((x, y), re), im) in x.iter_mut().zip(y.iter_mut()).zip(re).zip(im) {
            for l in 0..LANES {
                x[l] -= re[l] * a - im[l] * b;
                y[l] -= re[l] * b + im[l] * a;
                norm[l] += x[l] * x[l] + y[l] * y[l];
            }
        }
        (Complex32::new(a, b), norm.iter().sum::<f32>())
    }
}

/// Adds the columns of a matrix, each to few random sums with random signs \[Tropp2019\].
fn add(sketch: &mut Mat<f32>, side: MatRef<Complex64>, scale: f32, random: &mut Random) {
    let size = side.nrows();
    let mut parts = vec![0.0; 2 * size];
    for column in side.col_iter() {
        let (re, im) = parts.split_at_mut(size);
        for ((re, im), value) in re.iter_mut().zip(im).zip(column.iter()) {
            (*re, *im) = (scale * value.re as f32, scale * value.im as f32);
        }
        for _ in 0..SUMS_OF_ONE {
            let bits = random.next();
            let sign = if bits & 1 == 0 { 1.0 } else { -1.0 };
            let sum = (bits >> 32) as usize % sketch.ncols();
            let sum = sketch.col_as_slice_mut(sum).iter_mut();
            sum.zip(&parts).for_each(|(sum, part)| *sum += sign * part);
        }
    }
}

/// Random bits \[Steele2014\].
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

/// The nodes of chosen unknowns of a tile, and the place of each unknown among theirs.
pub(crate) fn nodes_of(nodes: &[Node], unknowns: &[usize]) -> (Vec<Node>, Vec<usize>) {
    let node = |unknown: usize| unknown / PER_PANEL * NODES + unknown % NODES;
    let mut numbers: Vec<usize> = unknowns.iter().map(|&unknown| node(unknown)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let places = unknowns.iter().map(|&unknown| {
        let index = numbers.partition_point(|&number| number < node(unknown));
        place(index, unknown % PER_PANEL / NODES)
    });
    let places = places.collect();
    (numbers.into_iter().map(|number| nodes[number]).collect(), places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outline::Outline;
    use std::f64::consts::TAU;

    /// Steps on a mirror, and a closed outline with its first corner at its ends.
    #[test]
    fn tiles_hold_each_panel_once_and_cut_no_corner() {
        let steps =
            (1..8).fold(Outline::on_mirror([30.0, 0.0]).line_to([30.0, 3.0]), |outline, i| {
                let (x, z) = (30.0 - 4.0 * f64::from(i), 3.0 * f64::from(i));
                outline.line_to([x, z]).line_to([x, z + 3.0])
            });
        let corners = [[30.0, 0.0], [30.0, 25.0], [0.0, 20.0], [0.0, 0.0]];
        let closed = corners.into_iter().fold(Outline::closed([0.0, 0.0]), Outline::line_to);
        for outline in [steps.line_to([-30.0, 0.0]), closed] {
            let mesh = Mesh::new(&outline, TAU);
            for unknowns in [160, 320, 1280] {
                let tiles = Tile::all(&mesh, unknowns);
                let mut panels: Vec<usize> = tiles.iter().flat_map(|t| t.panels.clone()).collect();
                panels.sort_unstable();
                assert_eq!(panels, (0..mesh.panels.len()).collect::<Vec<_>>());
                for corner in &mesh.corners {
                    let of_corner = |tile: &&Tile| {
                        corner.panels.iter().flatten().any(|panel| tile.panels.contains(panel))
                    };
                    assert_eq!(tiles.iter().filter(of_corner).count(), 1, "{unknowns}");
                }
            }
            assert!(Tile::all(&mesh, 160).len() > 2);
        }
    }
}
