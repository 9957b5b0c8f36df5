// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tiles of the outline, and the few unknowns of each by which it acts on the others.
//!
//! What a tile receives from or sends to places outside it is a sum of as many waves as its aperture
//! holds. An interpolative decomposition \[Cheng2005\] of the kernels between the tile and its
//! surroundings finds as many of its unknowns, its skeleton, and interpolates all others from them
//! \[Martinsson2005\] \[Ho2012\]. Tiles beside it are taken as they are, of those farther away the
//! nodes that resolve the waves of the tile; random sums of them hold all that matters
//! \[Halko2011\].

use crate::compression::{CMat, PER_PANEL};
use crate::coupling::{Coupling, place};
use crate::lu::SingleMat;
use crate::mesh::{Corner, Mesh, PER_SIDE};
use crate::panel::{Node, Reflection};
use crate::quadrature::NODES;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Accum, ColMut, Mat, Par};
use num_complex::Complex32;
use pulp::Arch;
use rayon::prelude::*;

/// Random sums beyond the rank, and lanes that are computed together, both chosen; sums are a multiple of
/// both.
const SPARE: usize = 32;
const LANES: usize = 8;
/// Free distance of two tiles, over their longest panel, from which sums over nodes stand for integrals over
/// panels. Chosen.
const FAR: f64 = 1.5;

/// Panels that follow each other along the outline; no corner is cut.
pub(crate) struct Tile {
    pub panels: Vec<usize>,
    middle: [f64; 2],
    radius: f64,
}

/// Unknowns of a tile that stand for all.
pub(crate) struct Skeleton {
    /// Places of the kept ones among the unknowns of the tile, in the order of pivots.
    pub kept: Vec<usize>,
    /// Matrix from the kept ones to all: a row each, a column an unknown of the tile.
    pub interpolation: SingleMat,
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
            return Skeleton { kept: Vec::new(), interpolation: SingleMat::zeros(0, size) };
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

/// Random sums of the kernels between a tile and its surroundings, a column an unknown of the tile:
/// real parts, then imaginary parts.
struct Sketch(Mat<f32>);

impl Sketch {
    fn new(coupling: Coupling, tiles: &[Tile], number: usize, sends: bool, sums: usize) -> Self {
        let mesh = coupling.mesh;
        let tile = &tiles[number];
        let nodes = tile.nodes(mesh);
        let mut sketch = Mat::zeros(sums, 2 * tile.size());
        let mut signs = Signs(2 * number as u64 + u64::from(sends));
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
                add(&mut sketch, side, sends, scale, &mut signs);
            }
        }
        Self(sketch)
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
        let square = SingleMat::from_fn(rank, rank, |i, j| rows[i][order[j]]);
        let mut interpolation = SingleMat::from_fn(rank, size, |i, j| rows[i][j]);
        solve_upper_triangular_in_place(square.as_ref(), interpolation.as_mut(), Par::Seq);
        for (i, &unknown) in order.iter().enumerate() {
            for row in 0..rank {
                interpolation[(row, unknown)] =
                    if row == i { Complex32::ONE } else { Complex32::ZERO };
            }
        }
        Skeleton { kept: order, interpolation }
    }

    /// Square of the norm of a column.
    fn norm(&self, column: usize) -> f32 {
        let size = self.0.ncols() / 2;
        let parts = [column, size + column].map(|part| self.0.col_as_slice(part));
        parts.iter().flat_map(|part| part.iter()).map(|value| value * value).sum()
    }

    /// Takes a unit vector out of a column; returns its share, and the square of the norm of the rest.
    fn without(&mut self, column: usize, [re, im]: &[Vec<f32>; 2]) -> (Complex32, f32) {
        let size = self.0.ncols() / 2;
        let (left, right) = self.0.as_mut().split_at_col_mut(size);
        let columns = [left.col_mut(column), right.col_mut(column)];
        let columns = columns.map(|column| column.try_as_col_major_mut().map(ColMut::as_slice_mut));
        let [Some(x), Some(y)] = columns else { return (Complex32::ZERO, 0.0) };
        Arch::new().dispatch(
            #[inline(always)]
            || {
                let (x, _) = x.as_chunks_mut::<LANES>();
                let (y, _) = y.as_chunks_mut::<LANES>();
                let (re, _) = re.as_chunks::<LANES>();
                let (im, _) = im.as_chunks::<LANES>();
                let (mut a, mut b) = ([0.0; LANES], [0.0; LANES]);
                for i in 0..x.len() {
                    for l in 0..LANES {
                        a[l] += re[i][l] * x[i][l] + im[i][l] * y[i][l];
                        b[l] += re[i][l] * y[i][l] - im[i][l] * x[i][l];
                    }
                }
                let [a, b] = [a, b].map(|lanes| lanes.iter().sum::<f32>());
                let mut norm = [0.0; LANES];
                for i in 0..x.len() {
                    for l in 0..LANES {
                        x[i][l] -= re[i][l] * a - im[i][l] * b;
                        y[i][l] -= re[i][l] * b + im[i][l] * a;
                        norm[l] += x[i][l] * x[i][l] + y[i][l] * y[i][l];
                    }
                }
                (Complex32::new(a, b), norm.iter().sum::<f32>())
            },
        )
    }
}

/// Adds random sums of the rows of a matrix, or of its columns where the tile receives.
fn add(sketch: &mut Mat<f32>, side: &CMat, sends: bool, scale: f32, signs: &mut Signs) {
    let size = sketch.ncols() / 2;
    let count = if sends { side.nrows() } else { side.ncols() };
    let random = Mat::from_fn(sketch.nrows(), count, |_, _| signs.next());
    let parts = Mat::from_fn(count, 2 * size, |i, j| {
        let (part, j) = (j / size, j % size);
        let value = if sends { side[(i, j)] } else { side[(j, i)] };
        (if part == 0 { value.re } else { value.im }) as f32
    });
    matmul(sketch.as_mut(), Accum::Add, &random, &parts, scale, Par::Seq);
}

/// Random signs \[Steele2014\].
struct Signs(u64);

impl Signs {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        if (z ^ (z >> 31)) & 1 == 0 { 1.0 } else { -1.0 }
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
