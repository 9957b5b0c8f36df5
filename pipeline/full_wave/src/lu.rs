// SPDX-License-Identifier: MIT OR Apache-2.0
//! Factors of a dense matrix in single precision, to the same bits on any number of threads.

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

/// Columns that are factorised together, and rows that are updated together: the fastest of 256 and 384
/// by 288 to 512, measured on two cores with 1 MiB of cache each.
pub(crate) const LU_WIDTH: usize = 384;
const LU_TILE: usize = 288;
/// Right-hand sides that are solved together.
const SIDES_TOGETHER: usize = 16;

/// Dense complex matrix in single precision.
pub(crate) type SingleMat = Mat<Complex32>;

/// A number in single precision.
pub(crate) fn single(z: Complex64) -> Complex32 {
    Complex32::new(z.re as f32, z.im as f32)
}

/// A matrix in single precision.
pub(crate) fn to_single(matrix: &Mat<Complex64>) -> SingleMat {
    SingleMat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| single(matrix[(i, j)]))
}

/// Factors of a matrix in its own memory.
pub(crate) struct Factors {
    entries: Vec<Complex32>,
    size: usize,
    permutation: Perm<usize>,
}

impl Factors {
    /// Right-looking LU with partial pivoting. faer factorises a block of columns; each block to its
    /// right is updated by itself on one thread, so that the bits do not depend on the number of
    /// threads. The next block is factorised while the others are updated.
    pub fn new(mut entries: Vec<Complex32>, size: usize) -> Self {
        let mut rows: Vec<usize> = (0..size).collect();
        if size == 0 {
            return Self { entries, size, permutation: Perm::new_checked([].into(), [].into(), 0) };
        }
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

    /// Solutions for right-hand sides.
    pub fn solve(&self, right: &SingleMat) -> SingleMat {
        let factors = MatRef::from_column_major_slice(&self.entries, self.size, self.size);
        let count = right.ncols();
        let part = |first: usize| {
            let width = SIDES_TOGETHER.min(count - first);
            let mut found = right.subcols(first, width).to_owned();
            let scratch = solve_in_place_scratch::<usize, Complex32>(self.size, width, Par::Seq);
            let mut memory = MemBuffer::new(scratch);
            let stack = MemStack::new(&mut memory);
            let permutation = self.permutation.as_ref();
            solve_in_place(factors, factors, permutation, found.as_mut(), Par::Seq, stack);
            found
        };
        let parts = (0..count).into_par_iter().step_by(SIDES_TOGETHER).map(part);
        let mut found = SingleMat::zeros(self.size, count);
        for (number, part) in parts.collect::<Vec<SingleMat>>().iter().enumerate() {
            found.as_mut().subcols_mut(SIDES_TOGETHER * number, part.ncols()).copy_from(part);
        }
        found
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
            let right = SingleMat::from_fn(size, SIDES_TOGETHER + 3, |i, j| {
                Complex32::new((i + j) as f32 / size as f32, 1.0)
            });
            let solved = [1, 2, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let solve = || Factors::new(entries.clone(), size).solve(&right);
                pool.expect("threads").install(solve)
            });
            assert!(solved[1..].iter().all(|other| *other == solved[0]));
            let rest = matrix * &solved[0] - &right;
            let backward = rest.norm_l2() / (matrix.norm_l2() * solved[0].norm_l2());
            // Random matrices are ill-conditioned: the residual is small beside |A| |x| alone.
            assert!(backward < 3e-6, "{size}: {backward:e}");
        }
    }
}
