// SPDX-License-Identifier: MIT OR Apache-2.0
//! Transmission of light from one side by that from the other.
//!
//! Reciprocity: f(a → b)/n_b² = f(b → a)/n_a², with n the refractive indices of the media of a and
//! b. Matrices and trees of rank 4 are transposed cell by cell. Tables on angles are averaged over
//! cells of 5 degrees in polar angle and 10 in azimuth, and keep their étendue.

use super::scatter_table::{CellDistribution, IncidentNode, ScatterTable};
use crate::angular_basis::{AngularBasis, OrientedBasis, above, square_to_disc};
use crate::direction::{lattice_point, mirrored, spherical};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Steps of tables on angles, degrees: polar, azimuth of exit, azimuth of incidence.
const STEPS: [usize; 3] = [5, 10, 15];
/// Points of a pair of cells of tables that turn with the incidence, and of others.
const POINTS: [usize; 2] = [32, 6];
/// Points of the hemisphere for an étendue, along an edge of the square.
const EDGE: u32 = 64;

/// The table for light from the other side; `scale` is (n/n')², with n the index on the side that
/// the light of `table` comes from, and n' that on the other.
pub(super) fn reversed(table: &ScatterTable, scale: f64) -> ScatterTable {
    match table {
        ScatterTable::Matrix { cells, nodes } => transposed(cells, nodes, scale),
        ScatterTable::Tree(tree, _) if tree.rank == 4 => ScatterTable::tree(tree.reversed(scale)),
        ScatterTable::Grid { .. } | ScatterTable::Tree(..) => averaged(table, scale),
    }
}

fn transposed(cells: &Arc<AngularBasis>, nodes: &[IncidentNode], scale: f64) -> ScatterTable {
    let basis = OrientedBasis::about_normal(cells);
    let back: Vec<usize> = (0..cells.len())
        .map(|cell| cells.locate(mirrored(cells.centre(cell))).unwrap_or(cell))
        .collect();
    // A cell of incidence is that of the travelling light.
    let node = |incidence: usize| {
        let exit = |cell: &usize| {
            let node = nodes.get(*cell);
            scale * node.map_or(0.0, |node| node.distribution.value(cells.centre(back[incidence])))
        };
        IncidentNode {
            wi: mirrored(cells.centre(incidence)),
            distribution: CellDistribution::new(basis.clone(), back.iter().map(exit), None),
        }
    };
    let nodes = (0..cells.len()).map(node).collect();
    ScatterTable::Matrix { cells: Arc::clone(cells), nodes }
}

fn averaged(table: &ScatterTable, scale: f64) -> ScatterTable {
    let turns = table.is_isotropic();
    let degrees = |range: usize, step: usize| (0..range / step).map(move |k| (k * step) as f64);
    let thetas: Vec<f64> = degrees(90, STEPS[0]).chain([89.0]).collect();
    let mut phis: Vec<f64> = degrees(360, STEPS[2]).collect();
    phis.truncate(if turns { 1 } else { phis.len() });
    let radials: Vec<f64> = degrees(90, STEPS[0]).chain([90.0]).collect();
    let exits: Vec<f64> = degrees(360, STEPS[1]).collect();
    let cells = Arc::new(AngularBasis::around_points(&exits, &radials, 90.0));
    let basis = OrientedBasis::about_normal(&cells);
    let points = POINTS[usize::from(!turns)];
    let half = 0.5 * STEPS[0] as f64;
    let mean = |theta: f64, phi: f64, cell: usize| {
        let [low, high] = [theta - half, theta + half]
            .map(|edge| edge.clamp(0.0, 90.0).to_radians().sin().powi(2));
        let value = |k: usize| {
            let [u, v] = lattice_point(k, points);
            // A second pair of coordinates that goes evenly with the first.
            let [s, t] =
                [(0.5 + k as f64 * 0.754_877_666).fract(), (k as f64 * 0.569_840_291).fract()];
            let from = cells.sample_projected(cell, u, v);
            let to = (low + s * (high - low)).sqrt().min(1.0 - 1e-9).asin();
            let turn = if turns { 0.0 } else { (t - 0.5) * STEPS[2] as f64 };
            let to = spherical(to, (phi + turn).to_radians());
            table.density(from, to) / to.z
        };
        scale * (0..points).map(value).sum::<f64>() / points as f64
    };
    let node = |theta: f64, phi: f64| IncidentNode {
        wi: spherical(theta.to_radians(), phi.to_radians()),
        distribution: CellDistribution::new(
            basis.clone(),
            (0..cells.len()).map(|cell| mean(theta, phi, cell)),
            None,
        ),
    };
    let mut nodes: Vec<IncidentNode> = thetas
        .iter()
        .flat_map(|theta| phis.iter().map(|phi| (*theta, *phi)))
        .map(|(theta, phi)| node(theta, phi))
        .collect();
    let radians = |list: &[f64]| list.iter().map(|d| d.to_radians()).collect::<Vec<_>>();
    let grid = |nodes: Vec<IncidentNode>| ScatterTable::Grid {
        thetas: radians(&thetas),
        phis: radians(&phis),
        nodes,
        end: FRAC_PI_2,
    };
    let [before, after] = [etendue(table), etendue(&grid(nodes.clone()))];
    if after > 0.0 {
        for node in &mut nodes {
            node.distribution = node.distribution.clone().scaled(scale * before / after);
        }
    }
    grid(nodes)
}

/// Mean power of light from everywhere, which is the étendue that passes over π.
fn etendue(table: &ScatterTable) -> f64 {
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(EDGE);
    let points = (0..EDGE).flat_map(|i| (0..EDGE).map(move |k| [at(i), at(k)]));
    let sum: f64 = points.map(|point| table.total(above(square_to_disc(point)))).sum();
    sum / f64::from(EDGE * EDGE)
}
