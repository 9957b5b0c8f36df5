// SPDX-License-Identifier: MIT OR Apache-2.0
//! Compressed inverse of a corner \[Helsing2013\].
//!
//! Near a corner the densities are singular, and panels would have to shrink towards it. The
//! equations of the shrinking panels are solved once a kind of corner, from the smallest scale to
//! the scale of the coarse panels, and leave one block R: with the densities ρ = R ρ' the equation
//! (1 + K° R) ρ' = f needs the coarse panels alone, where K° is K without what joins two panels of
//! one corner. In each step of the recursion the last block stands for the inverse of the four
//! inner of six panels, which Schur's complement of the outer two completes.

use crate::kernel::Media;
use crate::mesh::{Corner, PER_SIDE};
use crate::outline::Curve;
use crate::panel::{Block, Panel, Reflection, add, for_each_column};
use crate::quadrature::{NODES, rule};
use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;
use num_complex::Complex64;

/// Halvings from the coarse panels to the smallest: 2^-40 of a panel.
const LEVELS: i32 = 40;
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
        let fine = Fine::new(media, &curves, corner.panel * 0.5_f64.powi(level));
        let (prolonged, restricted) = (&block * &prolong, &restrict * &block);
        let complement = &fine.outer - &fine.to_outer * (&block * &fine.from_outer);
        let outer = complement.partial_piv_lu().inverse();
        let (into, out) = (&restricted * &fine.from_outer * &outer, &fine.to_outer * &prolonged);
        let inner = &restrict * &prolonged + &into * &out;
        let across = &outer * &out;
        let place = |i: usize| {
            let (panel, unknown) = (i / PER_PANEL, i % PER_PANEL);
            match panel {
                0 => (true, unknown),
                1 | 2 => (false, (panel - 1) * PER_PANEL + unknown),
                _ => (true, PER_PANEL + unknown),
            }
        };
        block = CMat::from_fn(COARSE * PER_PANEL, COARSE * PER_PANEL, |i, j| {
            match (place(i), place(j)) {
                ((true, i), (true, j)) => outer[(i, j)],
                ((true, i), (false, j)) => -across[(i, j)],
                ((false, i), (true, j)) => -into[(i, j)],
                ((false, i), (false, j)) => inner[(i, j)],
            }
        });
    }
    block
}

/// Blocks of 1 + K on the fine mesh: of its outer two panels, from them to the inner four, and back.
struct Fine {
    outer: CMat,
    from_outer: CMat,
    to_outer: CMat,
}

impl Fine {
    fn new(media: &Media, curves: &[Curve; 2], scale: f64) -> Self {
        let ends = [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0];
        let panels: [Panel; FINE] = std::array::from_fn(|p| {
            let side = usize::from(p >= FINE / 2);
            Panel::new(side, curves[side], scale * ends[p], scale * ends[p + 1])
        });
        let between = |targets: &[usize], sources: &[usize]| {
            let mut matrix = CMat::zeros(targets.len() * PER_PANEL, sources.len() * PER_PANEL);
            for (t, &target) in targets.iter().enumerate() {
                for (s, &source) in sources.iter().enumerate() {
                    let mut block = Block::default();
                    let (target, source) = (&panels[target], &panels[source]);
                    add(media, target, source, Reflection::IDENTITY, 1.0, &mut block);
                    for_each_column(&block, |row, column, [re, im]| {
                        for i in 0..NODES {
                            let (row, column) = (t * PER_PANEL + row + i, s * PER_PANEL + column);
                            matrix[(row, column)] = Complex64::new(re[i], im[i]);
                        }
                    });
                }
            }
            matrix
        };
        let (outer, inner) = ([0, FINE - 1], [1, 2, 3, 4]);
        let size = outer.len() * PER_PANEL;
        Self {
            outer: CMat::identity(size, size) + between(&outer, &outer),
            from_outer: between(&inner, &outer),
            to_outer: between(&outer, &inner),
        }
    }
}

/// The interpolation P from the inner two coarse panels to the inner four fine ones, and the
/// transpose of W_fine P / W_coarse.
fn between_meshes() -> (CMat, CMat) {
    let rule = rule();
    let (coarse, fine) = ((COARSE - 2) * PER_PANEL, (FINE - 2) * PER_PANEL);
    let mut prolong = CMat::zeros(fine, coarse);
    let mut restrict = CMat::zeros(coarse, fine);
    for panel in 0..FINE - 2 {
        let half = &rule.to_halves[panel % 2];
        for density in 0..2 {
            for (i, values) in half.iter().enumerate() {
                for (j, value) in values.iter().enumerate() {
                    let row = panel * PER_PANEL + density * NODES + i;
                    let column = panel / 2 * PER_PANEL + density * NODES + j;
                    let weight = 0.5 * rule.weights[i] / rule.weights[j];
                    prolong[(row, column)] = (*value).into();
                    restrict[(column, row)] = (value * weight).into();
                }
            }
        }
    }
    (prolong, restrict)
}
