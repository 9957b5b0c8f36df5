// SPDX-License-Identifier: MIT OR Apache-2.0
//! Matrices on the Klems basis and tensor trees: means over cells of incidence *and* of exit.

use super::{IncidenceLoss, Smearing, discrete, lobes_of, of_transport, spread};
use crate::angular_basis::AngularBasis;
use crate::bsdf::{Bsdf, OutgoingLobe, Transport};
use crate::direction::Side;
use crate::error::Error;
use crate::formats::window::{DIRECTIONS, KLEMS, ScatteringData, WindowBlock, WindowBsdf};
use crate::measured::{CellDistribution, IncidentNode, LobeMotion, MeasuredBsdf, ScatterTable};
use crate::tensor_tree::{TensorTree, cell_of, cell_point};
use glam::DVec3;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// Finest tree that is written: cells of 1/128 of the square.
const FINEST: u32 = 7;

/// Towards the light that travels along `d`, both in the upper hemisphere.
fn towards(d: DVec3) -> DVec3 {
    DVec3::new(-d.x, -d.y, d.z)
}

/// The table of `surface` on the full Klems basis: the mean over `samples` incidences in each cell.
///
/// # Errors
/// If there are no samples, or the surface has a diffuse lobe.
pub fn to_klems(surface: &dyn Bsdf, samples: usize) -> Result<(WindowBsdf, Smearing), Error> {
    at_least_one(samples)?;
    discrete(surface)?;
    let cells = AngularBasis::klems();
    let mut smearing = Smearing::new();
    smearing.width_deg = (0..KLEMS)
        .map(|c| cells.width(c))
        .fold(0.0, f64::max)
        .to_degrees();
    let mut bsdf = empty();
    let mut matrices = vec![vec![0.0; KLEMS * KLEMS]; 4];
    for side in Side::BOTH {
        for incidence in 0..KLEMS {
            let mut losses = [[0.0; 3]; 4];
            let inside = |[u, v]: [f64; 2]| towards(cells.inside(incidence, u, v));
            each_incidence(surface, side, samples, inside, |number, lobes| {
                smearing.neighbours(lobes);
                let loss = &mut losses[number];
                let mut seen = BTreeMap::new();
                for lobe in lobes {
                    let share = lobe.power / samples as f64;
                    loss[0] += share;
                    if let Some(exit) = cells.locate(lobe.wo) {
                        matrices[number][exit * KLEMS + incidence] += share / cells.projected(exit);
                        smearing.shifted(share, cells.middle(exit).angle_between(lobe.wo));
                        let entry: &mut (f64, u32) = seen.entry(exit).or_default();
                        *entry = (entry.0 + share, entry.1 + 1);
                    }
                }
                loss[2] += seen.values().filter(|s| s.1 > 1).map(|s| s.0).sum::<f64>();
            });
            for (number, transport) in directions(side) {
                let loss = &mut losses[number];
                loss[1] = (0..KLEMS)
                    .map(|exit| matrices[number][exit * KLEMS + incidence] * cells.projected(exit))
                    .sum();
                let wi = towards(cells.middle(incidence));
                smearing.incidences.push(stated(side, transport, wi, *loss));
            }
        }
    }
    for ((_, from, transport), matrix) in DIRECTIONS.iter().zip(matrices) {
        bsdf.blocks.push(WindowBlock {
            from: *from,
            transport: *transport,
            data: ScatteringData::Klems(matrix),
        });
    }
    Ok((bsdf, smearing))
}

/// Numbers and transports of the blocks for light from `side`.
fn directions(side: Side) -> impl Iterator<Item = (usize, Transport)> {
    let all = DIRECTIONS.iter().enumerate();
    all.filter(move |(_, d)| d.1 == side)
        .map(|(number, d)| (number, d.2))
}

/// Lets `take` have the lobes of each block, by its number, for each of `samples` incidences on `side`; `inside` is a cell, from the unit square.
fn each_incidence(
    surface: &dyn Bsdf,
    side: Side,
    samples: usize,
    inside: impl Fn([f64; 2]) -> DVec3,
    mut take: impl FnMut(usize, &[&OutgoingLobe]),
) {
    for k in 0..samples {
        let lobes = lobes_of(surface, side, inside(spread(k, samples)));
        for (number, transport) in directions(side) {
            take(number, &of_transport(&lobes, transport));
        }
    }
}

/// The direction above the point (x, y) of the unit disc.
fn above([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

fn at_least_one(samples: usize) -> Result<(), Error> {
    if samples == 0 {
        return Err(Error::Resolution(
            "expected at least one incidence in a cell, got 0".to_owned(),
        ));
    }
    Ok(())
}

fn empty() -> WindowBsdf {
    WindowBsdf {
        name: String::new(),
        manufacturer: String::new(),
        blocks: Vec::new(),
    }
}

fn stated(
    side: Side,
    transport: Transport,
    wi: DVec3,
    [before, after, merged]: [f64; 3],
) -> IncidenceLoss {
    IncidenceLoss {
        side,
        transport,
        theta_deg: wi.z.clamp(-1.0, 1.0).acos().to_degrees(),
        phi_deg: wi.y.atan2(wi.x).to_degrees().rem_euclid(360.0),
        before,
        after,
        merged,
    }
}

/// The table of `surface` as tensor trees of rank 4 with 2^`log2` cells along each coordinate: the mean over `samples` incidences in each cell.
///
/// # Errors
/// If there are no samples, the tree is none or too fine, or the surface has a diffuse lobe.
pub fn to_tree(
    surface: &dyn Bsdf,
    log2: u32,
    samples: usize,
) -> Result<(WindowBsdf, Smearing), Error> {
    at_least_one(samples)?;
    discrete(surface)?;
    if !(1..=FINEST).contains(&log2) {
        return Err(Error::Resolution(format!(
            "expected a tree of 2^1 to 2^{FINEST} cells along each coordinate, got 2^{log2}"
        )));
    }
    let count = 1_u32 << (2 * log2);
    let projected = PI / f64::from(count);
    let mut smearing = Smearing::new();
    // A cell at the rim reaches from the horizon up to where its inner edge lies.
    let edge = 2.0 / f64::from(1 << log2);
    smearing.width_deg = (1.0 - edge).acos().to_degrees();
    let mut found: [Vec<([u32; 2], f32)>; 4] = [const { Vec::new() }; 4];
    for side in Side::BOTH {
        for incidence in 0..count {
            let mut sums: [BTreeMap<u32, (f64, u32)>; 4] = [const { BTreeMap::new() }; 4];
            let mut before = [0.0; 4];
            let inside = |place| towards(above(cell_point(incidence, log2, place)));
            each_incidence(surface, side, samples, inside, |number, lobes| {
                smearing.neighbours(lobes);
                for lobe in lobes {
                    let share = lobe.power / samples as f64;
                    before[number] += share;
                    let exit = cell_of([lobe.wo.x, lobe.wo.y], log2);
                    let middle = above(cell_point(exit, log2, [0.5, 0.5]));
                    smearing.shifted(share, middle.angle_between(lobe.wo));
                    let entry = sums[number].entry(exit).or_default();
                    *entry = (entry.0 + share, entry.1 + 1);
                }
            });
            for (number, transport) in directions(side) {
                let mut after = 0.0;
                let mut merged = 0.0;
                for (exit, (share, orders)) in &sums[number] {
                    let value = (share / projected) as f32;
                    after += f64::from(value) * projected;
                    // More orders than incidences: some incidence put two into one cell.
                    merged += share * f64::from(u8::from(*orders as usize > samples));
                    found[number].push(([incidence, *exit], value));
                }
                let wi = inside([0.5, 0.5]);
                let loss = [before[number], after, merged];
                smearing.incidences.push(stated(side, transport, wi, loss));
            }
        }
    }
    let mut bsdf = empty();
    for ((_, from, transport), cells) in DIRECTIONS.iter().zip(found) {
        bsdf.blocks.push(WindowBlock {
            from: *from,
            transport: *transport,
            data: ScatteringData::Tree(TensorTree::from_cells(log2, cells)),
        });
    }
    Ok((bsdf, smearing))
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
    let mut responses = Vec::new();
    for block in &bsdf.blocks {
        let response = match &block.data {
            ScatteringData::Tree(tree) => ScatterTable::tree(tree.clone()),
            ScatteringData::Klems(matrix) => ScatterTable::Patches {
                cells: Arc::clone(&cells),
                nodes: (0..KLEMS)
                    .map(|incidence| IncidentNode {
                        wi: towards(cells.middle(incidence)),
                        cloud: CellDistribution::new(
                            &cells,
                            None,
                            (0..KLEMS).map(|exit| matrix[exit * KLEMS + incidence]),
                            None,
                        ),
                    })
                    .collect(),
            },
        };
        responses.push((block.from, block.transport, response));
    }
    MeasuredBsdf::new(indices, between, responses)
}
