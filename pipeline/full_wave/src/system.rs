// SPDX-License-Identifier: MIT OR Apache-2.0
//! The linear equations of a body: their matrices in single precision, and the refinement of the
//! solution by residuals in double precision, whose kernels are computed anew.

use crate::FullWaveError;
use crate::compression::{CMat, PER_PANEL};
use crate::kernel::Media;
use crate::mesh::Mesh;
use crate::panel::{Block, add, for_each_column};
use crate::quadrature::NODES;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::lu::partial_pivoting::solve::{solve_in_place, solve_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place;
use faer::perm::Perm;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par, Spec};
use num_complex::{Complex32, Complex64};
use pulp::Arch;
use rayon::prelude::*;

/// Error of the solution, relative to its norm, at which refinement ends.
const TARGET: f64 = 1e-10;
/// A correction must be less than this share of the last one.
const CONTRACTION: f64 = 0.3;
/// Columns that are factorised together, and rows that are updated together: the fastest of 256 and 384
/// by 288 to 512, measured on two cores with 1 MiB of cache each.
pub(crate) const LU_WIDTH: usize = 384;
const LU_TILE: usize = 288;
/// Right-hand sides that are solved together.
const SIDES_TOGETHER: usize = 16;

/// Equations (1 + K° R) ρ' = f of one polarisation, for light of each parity in x.
pub(crate) struct System<'a> {
    mesh: &'a Mesh,
    media: &'a Media,
    parities: &'static [f64],
    mirror: f64,
    groups: Vec<Group>,
}

/// Panels of one corner with its block R for each parity, or a panel of no corner.
struct Group {
    panels: Vec<usize>,
    blocks: Vec<CMat>,
}

impl<'a> System<'a> {
    /// `blocks` are the compressed blocks of the corners.
    pub fn new(
        mesh: &'a Mesh,
        media: &'a Media,
        parities: &'static [f64],
        mirror: f64,
        blocks: &[CMat],
    ) -> Self {
        let corners = blocks.iter().enumerate().map(|(corner, block)| Group {
            panels: mesh.corners[corner].panels.into_iter().flatten().collect(),
            blocks: parities.iter().map(|&p| folded(mesh, corner, block, p, mirror)).collect(),
        });
        let alone = (0..mesh.panels.len()).filter(|&panel| mesh.corner_of[panel].is_none());
        let alone = alone.map(|panel| Group { panels: vec![panel], blocks: Vec::new() });
        Self { mesh, media, parities, mirror, groups: corners.chain(alone).collect() }
    }

    fn size(&self) -> usize {
        self.mesh.panels.len() * PER_PANEL
    }

    /// Densities ρ = R ρ' for the right-hand sides f of each parity, a column a source, weighted so
    /// that a sum over the coarse nodes integrates them.
    ///
    /// # Errors
    /// Corrections that do not shrink.
    pub fn solve(&self, right: &[CMat]) -> Result<Vec<CMat>, FullWaveError> {
        let factors = self.factorised();
        let mut found = factors.iter().zip(right).map(|(f, r)| f.solve(r)).collect::<Vec<_>>();
        // Size of the last correction of each parity that is not yet done.
        let mut last = vec![Some(1.0); found.len()];
        while last.iter().any(Option::is_some) {
            let images = self.images(&found);
            let corrections: Vec<CMat> = factors
                .par_iter()
                .zip(right.par_iter().zip(&images))
                .map(|(factors, (right, image))| factors.solve(&(right - image)))
                .collect();
            for ((found, correction), last) in found.iter_mut().zip(&corrections).zip(&mut last) {
                let Some(before) = *last else {
                    continue;
                };
                let size = relative_size(correction, found);
                *found += correction;
                let contraction = size / before;
                *last = (size * contraction >= TARGET).then_some(size);
                // Also where it is no number.
                if last.is_some() && contraction >= CONTRACTION || !size.is_finite() {
                    return Err(FullWaveError::Resonance { correction: size });
                }
            }
        }
        Ok(self.densities(&found))
    }

    /// R ρ'.
    fn densities(&self, found: &[CMat]) -> Vec<CMat> {
        let mut densities = found.to_vec();
        for (parity, densities) in densities.iter_mut().enumerate() {
            for group in self.groups.iter().filter(|group| !group.blocks.is_empty()) {
                multiply_rows(densities.as_mut(), &group.panels, &group.blocks[parity]);
            }
        }
        densities
    }

    /// (1 + K° R) ρ'.
    fn images(&self, found: &[CMat]) -> Vec<CMat> {
        let densities = self.densities(found);
        let count = self.mesh.panels.len();
        let strips: Vec<Vec<CMat>> = (0..count)
            .into_par_iter()
            .map(|target| {
                let mut strips = vec![CMat::zeros(PER_PANEL, self.size()); self.parities.len()];
                for source in 0..count {
                    self.visit(target, source, |parity, row, column, values| {
                        let column = strips[parity].col_as_slice_mut(source * PER_PANEL + column);
                        column[row..row + NODES].copy_from_slice(values);
                    });
                }
                strips.into_iter().zip(&densities).map(|(strip, d)| strip * d).collect()
            })
            .collect();
        let mut images = found.to_vec();
        for (target, strips) in strips.iter().enumerate() {
            for (image, strip) in images.iter_mut().zip(strips) {
                let mut rows = image.as_mut().subrows_mut(target * PER_PANEL, PER_PANEL);
                rows += strip;
            }
        }
        images
    }

    /// The factors of 1 + K° R for each parity.
    fn factorised(&self) -> Vec<Factors> {
        let size = self.size();
        let mut matrices = vec![vec![Complex32::ZERO; size * size]; self.parities.len()];
        // The columns of each panel, handed out to the groups.
        let mut columns: Vec<Vec<Option<Columns>>> = matrices
            .iter_mut()
            .map(|matrix| matrix.chunks_mut(size * PER_PANEL).map(Some).collect())
            .collect();
        let tasks: Vec<(&Group, Vec<Vec<Columns>>)> =
            self.groups.iter().map(|group| (group, taken(&mut columns, group))).collect();
        tasks.into_par_iter().for_each(|(group, columns)| self.fill(group, columns));
        matrices.into_par_iter().map(|matrix| Factors::new(matrix, size)).collect()
    }

    /// Computes the columns of the panels of a group. The product with the block in single precision
    /// would take a step of refinement more.
    fn fill(&self, group: &Group, out: Vec<Vec<Columns>>) {
        let width = group.panels.len() * PER_PANEL;
        let mut columns = vec![CMat::zeros(self.size(), width); self.parities.len()];
        for (place, &source) in group.panels.iter().enumerate() {
            for target in 0..self.mesh.panels.len() {
                self.visit(target, source, |parity, row, column, values| {
                    let column = columns[parity].col_as_slice_mut(place * PER_PANEL + column);
                    let row = target * PER_PANEL + row;
                    column[row..row + NODES].copy_from_slice(values);
                });
            }
        }
        for (parity, (mut columns, out)) in columns.into_iter().zip(out).enumerate() {
            if let Some(block) = group.blocks.get(parity) {
                columns = columns * block;
            }
            for (place, (&panel, out)) in group.panels.iter().zip(out).enumerate() {
                for (j, out) in out.chunks_mut(self.size()).enumerate() {
                    let column = columns.col_as_slice_mut(place * PER_PANEL + j);
                    column[panel * PER_PANEL + j] += 1.0;
                    out.iter_mut().zip(column).for_each(|(out, value)| *out = single(*value));
                }
            }
        }
    }

    /// Visits the kernels K° between two panels, with all images, by parity, first row and column.
    fn visit(
        &self,
        target: usize,
        source: usize,
        mut visit: impl FnMut(usize, usize, usize, &[Complex64; NODES]),
    ) {
        let panels = &self.mesh.panels;
        // From images on the same side of the axis, and on the other.
        let mut sides = vec![Block::default(); 2];
        for &image in &self.mesh.images {
            if !self.mesh.is_one_corner(target, source, image) {
                let sign = image.sign(1.0, self.mirror);
                let side = &mut sides[usize::from(image.x)];
                add(self.media, &panels[target], &panels[source], image, sign, side);
            }
        }
        for (number, &parity) in self.parities.iter().enumerate() {
            for_each_column(&sides[0], |row, column, parts| {
                let other = &sides[1][row / NODES][column / NODES][column % NODES];
                let values = std::array::from_fn(|i| {
                    let part = |part: usize| parts[part][i] + parity * other[part][i];
                    Complex64::new(part(0), part(1))
                });
                visit(number, row, column, &values);
            });
        }
    }
}

fn single(z: Complex64) -> Complex32 {
    Complex32::new(z.re as f32, z.im as f32)
}

/// Columns of a matrix that belong to one panel.
type Columns<'a> = &'a mut [Complex32];

/// Takes the columns of the panels of a group out of each matrix.
fn taken<'a>(columns: &mut [Vec<Option<Columns<'a>>>], group: &Group) -> Vec<Vec<Columns<'a>>> {
    let mut taken = Vec::with_capacity(columns.len());
    for matrix in columns {
        taken.push(group.panels.iter().filter_map(|&panel| matrix[panel].take()).collect());
    }
    taken
}

/// A corner's block for the panels that the mesh holds: images are added with their sign.
fn folded(mesh: &Mesh, corner: usize, block: &CMat, parity: f64, mirror: f64) -> CMat {
    let corner = &mesh.corners[corner];
    let held: Vec<usize> =
        (0..corner.panels.len()).filter(|&place| corner.panels[place].is_some()).collect();
    let sign = corner.reflection.map_or(0.0, |image| image.sign(parity, mirror));
    let size = held.len() * PER_PANEL;
    CMat::from_fn(size, size, |i, j| {
        let row = held[i / PER_PANEL] * PER_PANEL + i % PER_PANEL;
        let (place, column) = (held[j / PER_PANEL], j % PER_PANEL);
        let mut value = block[(row, place * PER_PANEL + column)];
        if sign != 0.0 {
            // An image is travelled the other way.
            let (density, node) = (column / NODES, column % NODES);
            let reversed = density * NODES + (NODES - 1 - node);
            let opposite = corner.panels.len() - 1 - place;
            value += sign * block[(row, opposite * PER_PANEL + reversed)];
        }
        value
    })
}

/// M[panels, :] = R M[panels, :].
fn multiply_rows(mut matrix: MatMut<Complex64>, panels: &[usize], block: &CMat) {
    let rows: Vec<usize> = panels.iter().flat_map(|p| p * PER_PANEL..(p + 1) * PER_PANEL).collect();
    let held = CMat::from_fn(rows.len(), matrix.ncols(), |i, j| matrix[(rows[i], j)]);
    let product = block * held;
    for (i, &row) in rows.iter().enumerate() {
        matrix.rb_mut().row_mut(row).copy_from(product.row(i));
    }
}

/// Largest norm of a source's correction over that of its solution.
fn relative_size(correction: &CMat, found: &CMat) -> f64 {
    let norm = |part: &CMat, source| part.col(source).norm_l2();
    // A source on the axis has no odd part.
    (0..found.ncols())
        .filter(|&source| norm(found, source) != 0.0)
        .map(|source| norm(correction, source) / norm(found, source))
        .fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a })
}

/// Factors of a matrix in its own memory.
struct Factors {
    entries: Vec<Complex32>,
    size: usize,
    permutation: Perm<usize>,
}

impl Factors {
    /// Right-looking LU with partial pivoting. faer factorises a block of columns; each block to its
    /// right is updated by itself on one thread, so that the bits do not depend on the number of
    /// threads. The next block is factorised while the others are updated.
    fn new(mut entries: Vec<Complex32>, size: usize) -> Self {
        let mut rows: Vec<usize> = (0..size).collect();
        let mut moved = factorise_block(&mut entries[..LU_WIDTH.min(size) * size], size, 0);
        for start in (0..size).step_by(LU_WIDTH) {
            let width = LU_WIDTH.min(size - start);
            let end = start + width;
            let held: Vec<usize> = moved.iter().map(|&(_, from)| rows[from]).collect();
            moved.iter().zip(held).for_each(|(&(to, _), row)| rows[to] = row);
            let (done, rest) = entries.split_at_mut(end * size);
            let (left, block) = done.split_at_mut(start * size);
            left.par_chunks_mut(size).for_each(|column| move_rows(column, &moved));
            let block = Eliminator::new(block, size, start);
            let update = |columns: &mut [Complex32]| block.eliminate(columns, &moved);
            let (next, others) = rest.split_at_mut(LU_WIDTH.min(size - end) * size);
            moved = rayon::join(
                || {
                    update(next);
                    factorise_block(next, size, end)
                },
                || others.par_chunks_mut(size * LU_WIDTH).for_each(update),
            )
            .0;
        }
        let mut places = vec![0; size];
        rows.iter().enumerate().for_each(|(place, &row)| places[row] = place);
        let permutation =
            Perm::new_checked(rows.into_boxed_slice(), places.into_boxed_slice(), size);
        Self { entries, size, permutation }
    }

    fn solve(&self, right: &CMat) -> CMat {
        let factors = MatRef::from_column_major_slice(&self.entries, self.size, self.size);
        let parts: Vec<Mat<Complex32>> = (0..right.ncols())
            .into_par_iter()
            .step_by(SIDES_TOGETHER)
            .map(|first| {
                let count = SIDES_TOGETHER.min(right.ncols() - first);
                let mut found =
                    Mat::from_fn(self.size, count, |i, j| single(right[(i, first + j)]));
                let scratch =
                    solve_in_place_scratch::<usize, Complex32>(self.size, count, Par::Seq);
                let mut memory = MemBuffer::new(scratch);
                let stack = MemStack::new(&mut memory);
                let permutation = self.permutation.as_ref();
                solve_in_place(factors, factors, permutation, found.as_mut(), Par::Seq, stack);
                found
            })
            .collect();
        CMat::from_fn(self.size, right.ncols(), |i, j| {
            let value = parts[j / SIDES_TOGETHER][(i, j % SIDES_TOGETHER)];
            Complex64::new(f64::from(value.re), f64::from(value.im))
        })
    }
}

/// Factorises the columns `block` of a matrix of `size` rows from row `start` on; returns the rows that
/// move, as to and from.
fn factorise_block(block: &mut [Complex32], size: usize, start: usize) -> Vec<(usize, usize)> {
    let (width, height) = (block.len() / size, size - start);
    let columns = MatMut::from_column_major_slice_mut(block, size, width);
    let (mut forward, mut backward) = (vec![0_usize; height], vec![0_usize; height]);
    let scratch = lu_in_place_scratch::<usize, Complex32>(height, width, Par::Seq, Spec::default());
    let mut memory = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut memory);
    let below = columns.subrows_mut(start, height);
    lu_in_place(below, &mut forward, &mut backward, Par::Seq, stack, Spec::default());
    let rows = forward.into_iter().enumerate().filter(|(to, from)| to != from);
    rows.map(|(to, from)| (start + to, start + from)).collect()
}

/// Factorised block of columns, laid out to take its part away from columns to its right.
struct Eliminator<'a> {
    /// Rows of the matrix, and the first of the block.
    size: usize,
    start: usize,
    lower: MatRef<'a, Complex32>,
    below: Vec<Planes>,
}

/// Real and imaginary part of a complex matrix, and their sum.
struct Planes {
    re: Mat<f32>,
    im: Mat<f32>,
    sum: Mat<f32>,
}

impl Planes {
    fn new(matrix: MatRef<Complex32>) -> Self {
        let plane = |part: fn(Complex32) -> f32| {
            Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| part(matrix[(i, j)]))
        };
        Self { re: plane(|z| z.re), im: plane(|z| z.im), sum: plane(|z| z.re + z.im) }
    }
}

impl<'a> Eliminator<'a> {
    /// `block` is factorised from row `start` on.
    fn new(block: &'a [Complex32], size: usize, start: usize) -> Self {
        let block = MatRef::from_column_major_slice(block, size, block.len() / size);
        let (lower, below) = block.split_at_row(start).1.split_at_row(block.ncols());
        let tiles = (0..below.nrows()).into_par_iter().step_by(LU_TILE);
        let below = tiles
            .map(|row| Planes::new(below.subrows(row, LU_TILE.min(below.nrows() - row))))
            .collect();
        Self { size, start, lower, below }
    }

    /// Eliminates the rows of the block from `columns`, whose rows move first.
    fn eliminate(&self, columns: &mut [Complex32], moved: &[(usize, usize)]) {
        let width = self.lower.ncols();
        columns.chunks_mut(self.size).for_each(|column| move_rows(column, moved));
        let count = columns.len() / self.size;
        let columns = MatMut::from_column_major_slice_mut(columns, self.size, count);
        let (mut beside, mut under) =
            columns.split_at_row_mut(self.start).1.split_at_row_mut(width);
        solve_unit_lower_triangular_in_place(self.lower, beside.rb_mut(), Par::Seq);
        let beside = Planes::new(beside.rb());
        let difference = &beside.im - &beside.re;
        let mut re = Mat::zeros(LU_TILE, count);
        let mut im = Mat::zeros(LU_TILE, count);
        for (tile, left) in self.below.iter().enumerate() {
            let rows = left.re.nrows();
            let (mut re, mut im) = (re.subrows_mut(0, rows), im.subrows_mut(0, rows));
            // (a + ib)(c + id) by three real products: (a + b)c - b(c + d) + i ((a + b)c + a(d - c)).
            // Its error is small beside the norm; refinement mends it.
            matmul(re.rb_mut(), Accum::Replace, &left.sum, &beside.re, 1.0, Par::Seq);
            im.copy_from(re.rb());
            matmul(re.rb_mut(), Accum::Add, &left.im, &beside.sum, -1.0, Par::Seq);
            matmul(im.rb_mut(), Accum::Add, &left.re, &difference, 1.0, Par::Seq);
            let target = under.rb_mut().subrows_mut(tile * LU_TILE, rows);
            let parts = (re.rb(), im.rb());
            Arch::new().dispatch(
                #[inline(always)]
                || subtract(target, parts),
            );
        }
    }
}

/// Takes a matrix, given as its real and imaginary part, away from another.
#[expect(clippy::inline_always, reason = "compiled for the instructions that were found")]
#[inline(always)]
fn subtract(target: MatMut<Complex32>, (re, im): (MatRef<f32>, MatRef<f32>)) {
    for (j, target) in target.col_iter_mut().enumerate() {
        let parts = re.col(j).iter().zip(im.col(j).iter());
        for (target, (re, im)) in target.iter_mut().zip(parts) {
            *target -= Complex32::new(*re, *im);
        }
    }
}

/// Moves the rows of a column that a block moves.
fn move_rows(column: &mut [Complex32], moved: &[(usize, usize)]) {
    let held: Vec<Complex32> = moved.iter().map(|&(_, from)| column[from]).collect();
    moved.iter().zip(held).for_each(|(&(to, _), value)| column[to] = value);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Blocks that end within the matrix and at its end, with rows that move.
    #[test]
    fn factors_solve_and_have_the_same_bits_on_any_number_of_threads() {
        for size in [1, LU_WIDTH - 1, 2 * LU_WIDTH, 4 * LU_WIDTH + 37] {
            let mut rng = Pcg64Mcg::seed_from_u64(1);
            let mut part = || rng.random_range(-1.0..1.0);
            let entries: Vec<Complex32> =
                (0..size * size).map(|_| Complex32::new(part(), part())).collect();
            let matrix = MatRef::from_column_major_slice(&entries, size, size);
            let double = |z: Complex32| Complex64::new(f64::from(z.re), f64::from(z.im));
            let matrix = CMat::from_fn(size, size, |i, j| double(matrix[(i, j)]));
            let right = CMat::from_fn(size, SIDES_TOGETHER + 3, |i, j| {
                Complex64::new((i + j) as f64 / size as f64, 1.0)
            });
            let solved = [1, 2, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let solve = || Factors::new(entries.clone(), size).solve(&right);
                pool.expect("threads").install(solve)
            });
            assert!(solved[1..].iter().all(|other| *other == solved[0]));
            let rest = &matrix * &solved[0] - &right;
            let backward = rest.norm_l2() / (matrix.norm_l2() * solved[0].norm_l2());
            // Random matrices are ill-conditioned: the residual is small beside |A| |x| alone.
            assert!(backward < 3e-6, "{size}: {backward:e}");
        }
    }
}
