// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chi-square tests of measured tables: samples against densities, for every kind of table, from
//! both sides, from the normal to grazing.

use super::*;
use crate::angular_basis::{AngularBasis, OrientedBasis};
use crate::direction::spherical;
use crate::tensor_tree::{Branch, TensorTree};
use crate::tests::chi_square::{WithoutCosine, density_p_value, sidak_level};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

const DRAWS: usize = 100_000;

/// At the normal, oblique, grazing, from both sides.
const INCIDENCES: [(f64, f64); 8] = [
    (0.0, 0.0),
    (0.5, 1.1),
    (1.1, 4.0),
    (1.55, 2.5),
    (PI, 0.0),
    (PI - 0.4, 5.2),
    (PI - 1.0, 0.7),
    (PI - 1.56, 3.3),
];

/// AngularBasis `polar` by `azimuthal` degrees wide.
fn cells(polar: f64, azimuthal: f64) -> AngularBasis {
    let middles = |width: f64, to: f64| -> Vec<f64> {
        let count = (to / width).round() as u32;
        (0..count).map(|k| (f64::from(k) + 0.5) * width).collect()
    };
    AngularBasis::around_points(&middles(azimuthal, 360.0), &middles(polar, 90.0), 90.0)
}

/// A node with values from 0 to 1 without order, a third of them 0, scaled to `total`.
fn node(basis: OrientedBasis, wi: DVec3, total: f64, rng: &mut Pcg64) -> IncidentNode {
    let values: Vec<f64> =
        (0..basis.cells().len()).map(|_| (1.5 * rng.random::<f64>() - 0.5).max(0.0)).collect();
    let distribution = CellDistribution::new(basis, values, Some(total));
    IncidentNode { wi, distribution }
}

fn grid(
    cells: AngularBasis,
    thetas: &[f64],
    phis: &[f64],
    lobed: bool,
    total: f64,
    rng: &mut Pcg64,
) -> ScatterTable {
    let cells = Arc::new(cells);
    let mut nodes = Vec::new();
    for theta in thetas {
        for phi in phis {
            let wi = spherical(theta.to_radians(), phi.to_radians());
            let mirrored = DVec3::new(-wi.x, -wi.y, wi.z);
            let basis = if lobed {
                OrientedBasis::about(&cells, mirrored, DVec3::X)
            } else {
                OrientedBasis::about_normal(&cells)
            };
            nodes.push(node(basis, wi, total, rng));
        }
    }
    ScatterTable::Grid {
        thetas: thetas.iter().map(|t| t.to_radians()).collect(),
        phis: phis.iter().map(|p| p.to_radians()).collect(),
        nodes,
        end: FRAC_PI_2,
    }
}

/// One node for each Klems patch.
fn patches(total: f64, rng: &mut Pcg64) -> ScatterTable {
    let cells = Arc::new(AngularBasis::klems());
    let nodes = (0..cells.len())
        .map(|c| node(OrientedBasis::about_normal(&cells), cells.centre(c), total, rng));
    ScatterTable::Matrix { nodes: nodes.collect(), cells: Arc::clone(&cells) }
}

/// 4 by 4 squares of exit for each of 4 or 4 by 4 of incidence, with one power for all of these.
fn tree(rank: usize, total: f64, rng: &mut Pcg64) -> ScatterTable {
    let incidences = 4_usize.pow(rank as u32 - 2);
    let mut values = Vec::new();
    for _ in 0..incidences {
        let row: Vec<f64> = (0..16).map(|_| rng.random::<f64>()).collect();
        // Every square has π/16 of cos θ dΩ.
        let sum = row.iter().sum::<f64>() * PI / 16.0;
        values.extend(row.iter().map(|v| (v * total / sum) as f32));
    }
    let root = Branch::Block { log2: 2, values };
    ScatterTable::tree(TensorTree { rank, root })
}

/// Light from the inner side is reflected and transmitted by one table each, light from the outer
/// side by two others.
fn surface(between: LobeMotion, mut response: impl FnMut(f64) -> ScatterTable) -> MeasuredBsdf {
    let responses = [
        (Side::Inner, Transport::Reflection, response(0.3)),
        (Side::Inner, Transport::Transmission, response(0.6)),
        (Side::Outer, Transport::Reflection, response(0.5)),
        (Side::Outer, Transport::Transmission, response(0.4)),
    ];
    MeasuredBsdf::new([1.41, 1.0], between, responses).unwrap()
}

fn sample_to(from: DVec3, wo: DVec3) -> BsdfSample {
    let transport = Transport::between(Side::from_direction(from), Side::from_direction(wo));
    let kind = LobeKind::Cell;
    BsdfSample { wo, weight: 1.0, lobe: Lobe { transport, kind } }
}

/// A grid whose response does not depend on azimuth.
fn isotropic(total: f64, rng: &mut Pcg64) -> ScatterTable {
    let thetas = [0.0, 35.0, 80.0];
    grid(cells(15.0, 30.0), &thetas, &[0.0], false, total, rng)
}

#[test]
#[ignore = "nightly: five kinds of table (35 s)"]
fn nightly_every_kind_of_table_is_drawn_by_its_density() {
    let rng = &mut Pcg64::seed_from_u64(31);
    let tables = [
        surface(LobeMotion::Fixed, |total| isotropic(total, rng)),
        surface(LobeMotion::Fixed, |total| {
            let azimuths = [10.0, 90.0, 200.0, 275.0];
            grid(cells(10.0, 20.0), &[20.0, 70.0], &azimuths, false, total, rng)
        }),
        surface(LobeMotion::Fixed, |total| {
            grid(cells(15.0, 30.0), &[0.0, 40.0], &[0.0], true, total, rng)
        }),
        surface(LobeMotion::Fixed, |total| patches(total, rng)),
        surface(LobeMotion::Fixed, |total| tree(3, total, rng)),
        surface(LobeMotion::Fixed, |total| tree(4, total, rng)),
    ];
    let level = sidak_level(tables.len() * INCIDENCES.len());
    let judge = |k: usize, table: &MeasuredBsdf| {
        let rng = &mut Pcg64::seed_from_u64(310 + k as u64);
        for (theta, phi) in INCIDENCES {
            let wi = spherical(theta, phi);
            let density = |wo: DVec3| table.pdf(wi, &sample_to(wi, wo)).unwrap();
            let p = density_p_value(table, &density, wi, DRAWS, rng);
            assert!(p > level, "table {k}, wi {wi}: p = {p}");
        }
    };
    std::thread::scope(|scope| {
        for (k, table) in tables.iter().enumerate() {
            let judge = &judge;
            scope.spawn(move || judge(k, table));
        }
    });
}

/// AngularBasis about a tilted axis that have little above the horizon are drawn there, not along
/// it.
#[test]
fn nothing_is_drawn_along_the_horizon() {
    let rng = &mut Pcg64::seed_from_u64(34);
    let table = surface(LobeMotion::Fixed, |total| {
        grid(cells(7.0, 10.0), &[50.0], &[0.0], true, total, rng)
    });
    for (theta, phi) in INCIDENCES {
        let wi = spherical(theta, phi);
        let lowest = (0..DRAWS)
            .filter_map(|_| table.sample(wi, rng))
            .map(|sample| sample.wo.z.abs())
            .fold(1.0, f64::min);
        // Of evenly drawn ones no more than one in a million is so low.
        assert!(lowest > 1e-6, "wi {wi}: {lowest}");
    }
}

#[test]
fn a_sampler_without_the_cosine_is_found_out() {
    let rng = &mut Pcg64::seed_from_u64(32);
    let table = Arc::new(surface(LobeMotion::Fixed, |total| isotropic(total, rng)));
    for (theta, _) in INCIDENCES {
        // Isotropic tables turn with the incidence; at azimuth 0 the cells stand as they were
        // given.
        let wi = spherical(theta, 0.0);
        let wrong = WithoutCosine { surface: table.clone(), cells: cells(15.0, 30.0) };
        let density = |wo: DVec3| table.pdf(wi, &sample_to(wi, wo)).unwrap();
        let p = density_p_value(&wrong, &density, wi, DRAWS, rng);
        assert!(p < 1e-9, "wi {wi}: p = {p}");
    }
}

/// Shifted lobes keep their density over the disc of tangential directions: the density at a point
/// is that of the table at the point before the shift, and where the shift would lead off the disc,
/// light stays.
#[test]
#[ignore = "slow: 8 s"]
fn shifted_lobes_are_drawn_by_the_density_of_their_table() {
    let rng = &mut Pcg64::seed_from_u64(33);
    let tilt = 30.0;
    let shifted = surface(LobeMotion::Shifted, |total| {
        grid(cells(15.0, 30.0), &[tilt], &[0.0], false, total, rng)
    });
    let fixed = MeasuredBsdf { between: LobeMotion::Fixed, ..shifted.clone() };
    let level = sidak_level(INCIDENCES.len());
    let mut moved = 0;
    for (theta, phi) in INCIDENCES {
        let wi = spherical(theta, phi);
        // The azimuth of the normal is 0.
        let node = spherical(f64::to_radians(tilt), wi.y.atan2(wi.x));
        let step = |wo: DVec3| {
            let n = |v: DVec3| shifted.index(Side::from_direction(v));
            (node - wi).truncate() * (n(wi) / n(wo))
        };
        let brdf = |wo: DVec3, at: glam::DVec2| {
            let z2 = 1.0 - at.length_squared();
            if z2 <= 0.0 {
                return 0.0;
            }
            let before = at.extend(z2.sqrt().copysign(wo.z));
            fixed.pdf(wi, &sample_to(wi, before)).unwrap() / z2.sqrt()
        };
        let density = |wo: DVec3| {
            let (at, step) = (wo.truncate(), step(wo));
            let arrives = brdf(wo, at - step);
            let stays = (at + step).length_squared() >= 1.0;
            (arrives + if stays { brdf(wo, at) } else { 0.0 }) * wo.z.abs()
        };
        let p = density_p_value(&shifted, &density, wi, DRAWS, rng);
        assert!(p > level, "wi {wi}: p = {p}");
        // The table as it stands is another density.
        let unmoved = |wo: DVec3| fixed.pdf(wi, &sample_to(wi, wo)).unwrap();
        let p = density_p_value(&shifted, &unmoved, wi, DRAWS, rng);
        moved += usize::from(p < 1e-9);
    }
    assert_eq!(moved, INCIDENCES.len());
}
