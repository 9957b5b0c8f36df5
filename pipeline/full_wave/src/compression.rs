// SPDX-License-Identifier: MIT OR Apache-2.0
//! Compressed inverse of a corner \[Helsing2013\].
//!
//! Near a corner the densities are singular, and panels would have to shrink towards it. The
//! equations of the shrinking panels are solved once a kind of corner, from the smallest scale to
//! the scale of the coarse panels, and leave one block R: with the densities ρ = R ρ' the equation
//! (1 + K° R) ρ' = f needs the coarse panels alone, where K° is K without what joins two panels of
//! one corner. In each step of the recursion the inverse of the last block stands for the four
//! inner of six panels.

use crate::kernel::Media;
use crate::mesh::{Corner, PER_SIDE};
use crate::outline::Curve;
use crate::panel::{Block, Panel, Reflection, add};
use crate::quadrature::{NODES, rule};
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, MatRef};
use num_complex::Complex64;

/// Halvings from the coarse panels to the smallest: 2^-56 of a panel.
const LEVELS: i32 = 56;
/// Unknowns of a panel: field and derivative.
pub(crate) const PER_PANEL: usize = 2 * NODES;
/// Panels of a corner on the coarse and on the fine mesh.
const COARSE: usize = 2 * PER_SIDE;
const FINE: usize = COARSE + 2;

/// Dense complex matrix.
pub(crate) type CMat = Mat<Complex64>;

/// Returns the block R of a corner: rows and columns by panel in the order of travel, within a
/// panel the field and then the derivative.
pub(crate) fn compressed(media: &Media, corner: &Corner) -> CMat {
    let [before, after] = corner.curvature;
    let (sin, cos) = corner.turn.sin_cos();
    let curves = [
        Curve { origin: [0.0, 0.0], tangent: [1.0, 0.0], curvature: before },
        Curve { origin: [0.0, 0.0], tangent: [cos, sin], curvature: after },
    ];
    let (prolong, restrict) = between_meshes();
    let mut block = CMat::identity(COARSE * PER_PANEL, COARSE * PER_PANEL);
    for level in (0..LEVELS).rev() {
        let scale = corner.panel * 0.5_f64.powi(level);
        let mut fine = fine_matrix(media, &curves, scale);
        let inner = inverse(block.as_ref());
        let at = PER_PANEL;
        for column in 0..inner.ncols() {
            for row in 0..inner.nrows() {
                fine[(at + row, at + column)] = inner[(row, column)];
            }
        }
        block = &restrict * inverse(fine.as_ref()) * &prolong;
    }
    block
}

fn inverse(matrix: MatRef<Complex64>) -> CMat {
    matrix.partial_piv_lu().inverse()
}

/// 1 + K° on the fine mesh, without the square of its inner four panels.
fn fine_matrix(media: &Media, curves: &[Curve; 2], scale: f64) -> CMat {
    let ends = [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0];
    let panels: [Panel; FINE] = std::array::from_fn(|p| {
        let side = usize::from(p >= FINE / 2);
        Panel::new(side, curves[side], scale * ends[p], scale * ends[p + 1])
    });
    let mut matrix = CMat::identity(FINE * PER_PANEL, FINE * PER_PANEL);
    for (s, source) in panels.iter().enumerate() {
        for (t, target) in panels.iter().enumerate() {
            let is_inner = |panel: usize| panel > 0 && panel < FINE - 1;
            if is_inner(s) && is_inner(t) {
                continue;
            }
            let mut block = Block::default();
            add(media, target, source, Reflection::IDENTITY, 1.0, &mut block);
            for_each(&block, |row, column, value| {
                matrix[(t * PER_PANEL + row, s * PER_PANEL + column)] += value;
            });
        }
    }
    matrix
}

/// Visits the entries of a block by row and column of a pair of panels.
pub(crate) fn for_each(block: &Block, mut visit: impl FnMut(usize, usize, Complex64)) {
    for (row, columns) in block.iter().enumerate() {
        for (column, targets) in columns.iter().enumerate() {
            for (i, sources) in targets.iter().enumerate() {
                for (j, value) in sources.iter().enumerate() {
                    visit(row * NODES + i, column * NODES + j, *value);
                }
            }
        }
    }
}

/// The interpolation P from the coarse to the fine mesh and the transpose of W_fine P / W_coarse.
fn between_meshes() -> (CMat, CMat) {
    let rule = rule();
    let mut prolong = CMat::zeros(FINE * PER_PANEL, COARSE * PER_PANEL);
    let mut restrict = CMat::zeros(COARSE * PER_PANEL, FINE * PER_PANEL);
    // Coarse panel, fine panel and its half of the coarse one; the outer panels are the same.
    let parts = [
        (0, 0, None),
        (1, 1, Some(0)),
        (1, 2, Some(1)),
        (2, 3, Some(0)),
        (2, 4, Some(1)),
        (3, 5, None),
    ];
    for (coarse, fine, half) in parts {
        for density in 0..2 {
            for i in 0..NODES {
                for j in 0..NODES {
                    let (value, size) = match half {
                        None => (if i == j { 1.0 } else { 0.0 }, 1.0),
                        Some(half) => (rule.to_halves[half][i][j], 0.5),
                    };
                    let row = fine * PER_PANEL + density * NODES + i;
                    let column = coarse * PER_PANEL + density * NODES + j;
                    prolong[(row, column)] = value.into();
                    let weight = size * rule.weights[i] / rule.weights[j];
                    restrict[(column, row)] = (value * weight).into();
                }
            }
        }
    }
    (prolong, restrict)
}
