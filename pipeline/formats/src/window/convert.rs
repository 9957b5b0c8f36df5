// SPDX-License-Identifier: MIT OR Apache-2.0
//! Matrices on the Klems basis and tensor trees: means over cells of incidence *and* of exit.

use super::layout::{DIRECTIONS, KLEMS, ScatteringData, WindowBlock, WindowBsdf};
use crate::convert::{PowerBalance, Smearing, check_discrete, of_transport, upper_lobes};
use bsdf::Error;
use bsdf::angular_basis::{AngularBasis, OrientedBasis, above};
use bsdf::direction::{Side, lattice_point, mirrored};
use bsdf::measured::{CellDistribution, IncidentNode, LobeMotion, MeasuredBsdf, ScatterTable};
use bsdf::tensor_tree::{TensorTree, cell_of, cell_point};
use bsdf::{Bsdf, OutgoingLobe, Transport};
use glam::DVec3;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// Finest tree for export: cells of 1/128 of the square.
const FINEST: u32 = 7;

/// The table of `surface` on the full Klems basis: the mean over `samples` incidences in each cell.
///
/// # Errors
/// If there are no samples, or the surface has a diffuse lobe.
pub fn to_klems(surface: &dyn Bsdf, samples: usize) -> Result<(WindowBsdf, Smearing), Error> {
    check_samples(samples)?;
    check_discrete(surface)?;
    let cells = AngularBasis::klems();
    let mut smearing = Smearing::new(cells.widest());
    let mut matrices = vec![vec![0.0; KLEMS * KLEMS]; 4];
    for side in Side::BOTH {
        for incidence in 0..KLEMS {
            let mut balances = [PowerBalance::default(); 4];
            let inside = |[u, v]: [f64; 2]| mirrored(cells.sample_projected(incidence, u, v));
            each_incidence(surface, side, samples, inside, |number, lobes| {
                smearing.neighbours(lobes);
                let balance = &mut balances[number];
                let mut seen = BTreeMap::new();
                for lobe in lobes {
                    let power = lobe.power / samples as f64;
                    balance.before += power;
                    if let Some(exit) = cells.locate(lobe.wo) {
                        matrices[number][exit * KLEMS + incidence] +=
                            power / cells.projected_solid_angle(exit);
                        smearing.shifted(power, cells.centre(exit).angle_between(lobe.wo));
                        let entry: &mut (f64, u32) = seen.entry(exit).or_default();
                        *entry = (entry.0 + power, entry.1 + 1);
                    }
                }
                balance.merged += seen.values().filter(|s| s.1 > 1).map(|s| s.0).sum::<f64>();
            });
            for (number, transport) in directions(side) {
                let balance = &mut balances[number];
                balance.after = (0..KLEMS)
                    .map(|exit| {
                        matrices[number][exit * KLEMS + incidence]
                            * cells.projected_solid_angle(exit)
                    })
                    .sum();
                let wi = mirrored(cells.centre(incidence));
                smearing.incidences.push(balance.at(side, transport, wi));
            }
        }
    }
    let data = matrices.into_iter().map(ScatteringData::Klems);
    Ok((unnamed(data), smearing))
}

/// Indices and transports of the blocks for light from `side`.
fn directions(side: Side) -> impl Iterator<Item = (usize, Transport)> {
    DIRECTIONS
        .iter()
        .enumerate()
        .filter(move |(_, d)| d.1.from == side)
        .map(|(number, d)| (number, d.1.transport))
}

/// Calls `take` with the index and the lobes of each block for each of `samples` incidences on
/// `side`; `inside` maps the unit square to a cell of incidence.
fn each_incidence(
    surface: &dyn Bsdf,
    side: Side,
    samples: usize,
    inside: impl Fn([f64; 2]) -> DVec3,
    mut take: impl FnMut(usize, &[&OutgoingLobe]),
) {
    for k in 0..samples {
        let lobes = upper_lobes(surface, side, inside(lattice_point(k, samples)));
        for (number, transport) in directions(side) {
            take(number, &of_transport(&lobes, transport));
        }
    }
}

fn check_samples(samples: usize) -> Result<(), Error> {
    if samples == 0 {
        return Err(Error::Resolution(
            "expected at least one incidence in a cell, got 0".to_owned(),
        ));
    }
    Ok(())
}

/// A file without names, from the data of its four directions.
fn unnamed(data: impl IntoIterator<Item = ScatteringData>) -> WindowBsdf {
    let blocks = DIRECTIONS.iter().zip(data);
    WindowBsdf {
        name: String::new(),
        manufacturer: String::new(),
        blocks: blocks
            .map(|((_, direction), data)| WindowBlock { direction: *direction, data })
            .collect(),
    }
}

/// The table of `surface` as tensor trees of rank 4 with 2^`log2` cells along each coordinate: the
/// mean over `samples` incidences in each cell.
///
/// # Errors
/// If there are no samples, the tree is too coarse or too fine, or the surface has a diffuse lobe.
pub fn to_tree(
    surface: &dyn Bsdf,
    log2: u32,
    samples: usize,
) -> Result<(WindowBsdf, Smearing), Error> {
    check_samples(samples)?;
    check_discrete(surface)?;
    if !(1..=FINEST).contains(&log2) {
        return Err(Error::Resolution(format!(
            "expected a tree of 2^1 to 2^{FINEST} cells along each coordinate, got 2^{log2}"
        )));
    }
    let count = 1_u32 << (2 * log2);
    let projected = PI / f64::from(count);
    // A cell at the rim reaches from its inner edge down to the horizon.
    let edge = 2.0 / f64::from(1 << log2);
    let mut smearing = Smearing::new((1.0 - edge).acos());
    let mut cells: [Vec<([u32; 2], f32)>; 4] = [const { Vec::new() }; 4];
    for side in Side::BOTH {
        for incidence in 0..count {
            let mut balances = [PowerBalance::default(); 4];
            let mut sums: [BTreeMap<u32, (f64, u32)>; 4] = [const { BTreeMap::new() }; 4];
            let inside = |place| mirrored(above(cell_point(incidence, log2, place)));
            each_incidence(surface, side, samples, inside, |number, lobes| {
                smearing.neighbours(lobes);
                for lobe in lobes {
                    let power = lobe.power / samples as f64;
                    balances[number].before += power;
                    let exit = cell_of([lobe.wo.x, lobe.wo.y], log2);
                    let middle = above(cell_point(exit, log2, [0.5, 0.5]));
                    smearing.shifted(power, middle.angle_between(lobe.wo));
                    let entry = sums[number].entry(exit).or_default();
                    *entry = (entry.0 + power, entry.1 + 1);
                }
            });
            for (number, transport) in directions(side) {
                let balance = &mut balances[number];
                for (exit, (power, orders)) in &sums[number] {
                    let value = (power / projected) as f32;
                    balance.after += f64::from(value) * projected;
                    // More orders than incidences: some incidence put two into one cell.
                    balance.merged += power * f64::from(u8::from(*orders as usize > samples));
                    cells[number].push(([incidence, *exit], value));
                }
                let wi = inside([0.5, 0.5]);
                smearing.incidences.push(balance.at(side, transport, wi));
            }
        }
    }
    let data = cells.map(|cells| ScatteringData::Tree(TensorTree::from_cells(log2, cells)));
    Ok((unnamed(data), smearing))
}

/// The content of a file as a surface between media of refractive index `indices` (inner, outer).
///
/// # Errors
/// If a power exceeds 1.
pub fn from_window(
    bsdf: &WindowBsdf,
    indices: [f64; 2],
    between: LobeMotion,
) -> Result<MeasuredBsdf, Error> {
    let cells = Arc::new(AngularBasis::klems());
    let basis = OrientedBasis::about_normal(&cells);
    let mut tables = Vec::new();
    for block in &bsdf.blocks {
        let table = match &block.data {
            ScatteringData::Tree(tree) => ScatterTable::tree(tree.clone()),
            ScatteringData::Klems(matrix) => ScatterTable::Matrix {
                cells: Arc::clone(&cells),
                nodes: (0..KLEMS)
                    .map(|incidence| IncidentNode {
                        wi: mirrored(cells.centre(incidence)),
                        distribution: CellDistribution::new(
                            basis.clone(),
                            (0..KLEMS).map(|exit| matrix[exit * KLEMS + incidence]),
                            None,
                        ),
                    })
                    .collect(),
            },
        };
        tables.push((block.direction.from, block.direction.transport, table));
    }
    MeasuredBsdf::new(indices, between, tables)
}
