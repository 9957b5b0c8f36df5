// SPDX-License-Identifier: MIT OR Apache-2.0
//! The linear equations of a body: their solution in single precision, reduced to what tiles of the
//! outline exchange, its error by exact equations of some panels, and the refinement by residuals in
//! double precision, whose kernels are computed anew, where the error is too large.

use crate::FullWaveError;
use crate::compression::{CMat, PER_PANEL};
use crate::equations::System;
use crate::panel::for_each_column;
use crate::quadrature::NODES;
use crate::reduced::Reduced;
use faer::MatMut;
use faer::prelude::ReborrowMut;
use num_complex::Complex64;
use rayon::prelude::*;

/// Share of the last correction that a correction must stay below, chosen.
const CONTRACTION: f64 = 0.3;
/// Unknowns whose exact equations state the error of the first solution, and factor from what they find to
/// the error that is stated. Chosen; a test finds that 1.9 to 3.4 times as large as the true one.
pub(crate) const SAMPLE: usize = 4096;
const SAFETY: f64 = 2.0;

impl System<'_> {
    /// Densities ρ = R ρ' for the right-hand sides f of each parity, a column a source, weighted so
    /// that a sum over the coarse nodes integrates them.
    ///
    /// # Errors
    /// Corrections that do not shrink.
    pub fn solve(&self, right: &[CMat]) -> Result<Vec<CMat>, FullWaveError> {
        let factors = Reduced::all(self);
        let (first, error) = self.first(&factors, right, SAMPLE);
        let found = if error < self.target { first } else { self.refined(&factors, first, right)? };
        Ok(self.densities(&found))
    }

    /// The solution ρ' of the reduced equations, and its error by the exact equations of `sample` unknowns.
    pub fn first(
        &self,
        factors: &[Reduced<'_>],
        right: &[CMat],
        sample: usize,
    ) -> (Vec<CMat>, f64) {
        let found = factors.iter().zip(right).map(|(f, r)| f.solve(r)).collect::<Vec<_>>();
        let error = self.error(factors, &found, right, sample);
        (found, error)
    }

    /// Refines a solution ρ' until its error is below the target.
    ///
    /// # Errors
    /// Corrections that do not shrink.
    pub fn refined(
        &self,
        factors: &[Reduced<'_>],
        mut found: Vec<CMat>,
        right: &[CMat],
    ) -> Result<Vec<CMat>, FullWaveError> {
        let all: Vec<usize> = (0..self.coupling.mesh.panels.len()).collect();
        // Size of the last correction of each parity that is not yet done.
        let mut last = vec![Some(1.0); found.len()];
        while last.iter().any(Option::is_some) {
            let rests = self.rests(&found, right, &all);
            let parts = factors.par_iter().zip(&rests);
            let corrections: Vec<CMat> = parts.map(|(factors, rest)| factors.solve(rest)).collect();
            for ((found, correction), last) in found.iter_mut().zip(&corrections).zip(&mut last) {
                let Some(before) = *last else {
                    continue;
                };
                let size = relative_size(correction, found);
                *found += correction;
                let contraction = size / before;
                *last = (size * contraction >= self.target).then_some(size);
                // Also where it is no number.
                if last.is_some() && contraction >= CONTRACTION || !size.is_finite() {
                    return Err(FullWaveError::Resonance { correction: size });
                }
            }
        }
        Ok(found)
    }

    /// Error of solutions, relative to their norm, by the exact equations of some panels: the larger of
    /// their residuals and of what these correct, which a resonance enlarges, times [`SAFETY`].
    fn error(&self, factors: &[Reduced<'_>], found: &[CMat], right: &[CMat], sample: usize) -> f64 {
        let count = self.coupling.mesh.panels.len();
        let sampled = (sample / PER_PANEL).min(count);
        // The golden section spreads the panels evenly.
        let golden = 0.5 * (5_f64.sqrt() - 1.0);
        let panel = |i: usize| ((golden * i as f64).fract() * count as f64) as usize;
        let mut panels: Vec<usize> = (0..sampled).map(panel).collect();
        panels.sort_unstable();
        panels.dedup();
        let rests = self.rests(found, right, &panels);
        let share = (count as f64 / panels.len() as f64).sqrt();
        let corrected = |(factors, rest): (&Reduced<'_>, &CMat)| {
            let mut all = CMat::zeros(self.size(), rest.ncols());
            for (number, panel) in panels.iter().enumerate() {
                let rows = rest.subrows(number * PER_PANEL, PER_PANEL);
                all.subrows_mut(panel * PER_PANEL, PER_PANEL).copy_from(rows);
            }
            factors.solve(&all)
        };
        let corrections: Vec<CMat> = factors.par_iter().zip(&rests).map(corrected).collect();
        let sizes = rests.iter().chain(&corrections).zip(found.iter().chain(found));
        let sizes = sizes.map(|(rest, found)| relative_size(rest, found));
        SAFETY * share * sizes.fold(0.0, larger)
    }

    /// Densities R ρ'.
    pub fn densities(&self, found: &[CMat]) -> Vec<CMat> {
        let mut densities = found.to_vec();
        for (parity, densities) in densities.iter_mut().enumerate() {
            for group in &self.groups {
                multiply_rows(densities.as_mut(), &group.panels, &group.blocks[parity]);
            }
        }
        densities
    }

    /// f - (1 + K° R) ρ' in the equations of some panels, with kernels in double precision.
    fn rests(&self, found: &[CMat], right: &[CMat], panels: &[usize]) -> Vec<CMat> {
        let densities = self.densities(found);
        let strips: Vec<Vec<CMat>> = panels
            .par_iter()
            .map(|&target| {
                let mut strips = vec![CMat::zeros(PER_PANEL, self.size()); self.parities.len()];
                for source in 0..self.coupling.mesh.panels.len() {
                    self.visit(target, source, |parity, row, column, values| {
                        let column = strips[parity].col_as_slice_mut(source * PER_PANEL + column);
                        column[row..row + NODES].copy_from_slice(values);
                    });
                }
                strips.into_iter().zip(&densities).map(|(strip, d)| strip * d).collect()
            })
            .collect();
        let rest = |parity: usize| {
            let (found, right): (&CMat, &CMat) = (&found[parity], &right[parity]);
            CMat::from_fn(panels.len() * PER_PANEL, found.ncols(), |i, j| {
                let (panel, i) = (i / PER_PANEL, i % PER_PANEL);
                let row = panels[panel] * PER_PANEL + i;
                right[(row, j)] - found[(row, j)] - strips[panel][parity][(i, j)]
            })
        };
        (0..found.len()).map(rest).collect()
    }

    /// Visits the kernels K° between two panels, with all images, by parity, first row and column.
    fn visit(
        &self,
        target: usize,
        source: usize,
        mut visit: impl FnMut(usize, usize, usize, &[Complex64; NODES]),
    ) {
        let sides = self.coupling.sides(target, source);
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
pub(crate) fn relative_size(correction: &CMat, found: &CMat) -> f64 {
    let norm = |part: &CMat, source| part.col(source).norm_l2();
    // A source on the axis has no odd part.
    (0..found.ncols())
        .filter(|&source| norm(found, source) != 0.0)
        .map(|source| norm(correction, source) / norm(found, source))
        .fold(0.0, larger)
}

/// The larger of two numbers, or the one that is none.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
