// SPDX-License-Identifier: MIT OR Apache-2.0
//! Convergence at high contrast and with absorption: stated errors bound the true ones.

use gratings::boundary_integral::{Fineness, Grating};
use num_complex::Complex64;
use rcwa::Side;
use rcwa::Truncation;
use rcwa::accuracy::{converge_hemisphere, hemisphere_change};
use rcwa::hemisphere::{Directions, Incidence, Interface, Resolution, hemisphere};
use rcwa::no_progress;
use rcwa::relief::{Polygon, Relief};

const WAVELENGTH: f64 = 0.55;

/// Triangles of index `above` over `below`.
fn triangle(period: f64, apex: [f64; 2], [above, below]: [Complex64; 2]) -> Interface {
    let points = vec![[0.0, 0.0], apex, [period, 0.0]];
    let ridge = Polygon { index: above, points };
    Interface {
        relief: Relief::new(period, apex[1], below, vec![ridge]).unwrap(),
        wavelength: WAVELENGTH,
        n_top: above,
        n_bottom: below,
    }
}

/// All waves with kx half a zone from an order, at these ky.
fn solved(interface: &Interface, resolution: &Resolution, ky: Vec<f64>) -> Vec<Incidence> {
    let directions = Directions { kx_per_zone: 1, ky };
    let all = hemisphere(interface, &directions, resolution, &no_progress);
    all.unwrap().incidences
}

fn share(incidence: &Incidence, side: Side) -> f64 {
    let to = incidence.efficiencies.iter().filter(|share| share.0 == side);
    to.map(|share| share.2).sum()
}

/// In the plane of incidence integral equations know the answer. Stairs would take hundreds of
/// orders here: in TM their edges leave what only orders and stairs together take away.
#[test]
#[ignore = "nightly: 15 s"]
fn nightly_dielectrics_of_any_contrast_keep_their_tolerance() {
    for (index, period, apex) in [
        (2.9, 1.5, [1.2, 0.6]),
        (3.5, 0.9, [0.6, 0.4]),
        (3.5, 1.5, [1.2, 0.6]),
        (4.0, 1.0, [0.5, 0.7]),
        (4.0, 2.0, [1.9, 0.5]),
    ] {
        let interface = triangle(period, apex, [index.into(), 1.0.into()]);
        let exact = Grating::of_relief(&interface.relief, WAVELENGTH, index, 1.0)
            .and_then(|grating| grating.solve(0.5 * WAVELENGTH / period, Fineness::default()))
            .unwrap();
        assert!(exact.worst_balance() < 1e-9);
        for tolerance in [1e-2, 3e-3] {
            let (found, estimate) =
                converge_hemisphere(&interface, tolerance, &no_progress).unwrap();
            let all = solved(&interface, &found, vec![0.0]);
            let here: Vec<f64> = all.iter().map(|i| share(i, Side::Bottom)).collect();
            let there: Vec<f64> = all
                .iter()
                .map(|i| exact.total((i.side, i.kx_index as i32, i.pol), Side::Bottom))
                .collect();
            let error = hemisphere_change(&here, &there);
            assert!(
                error <= estimate && estimate <= tolerance,
                "{index}, {period} um: {error:.1e}, stated {estimate:.1e}, asked {tolerance:.0e}"
            );
        }
    }
}

/// Into an absorbing half-space every order kept carries power, more of them the more are kept.
#[test]
#[ignore = "slow: 5 s"]
fn absorbing_reliefs_keep_their_tolerance() {
    for (index, period, apex) in
        [(Complex64::new(1.5, 0.2), 1.2, [0.9, 0.5]), (Complex64::new(3.0, 0.05), 0.8, [0.6, 0.4])]
    {
        let interface = triangle(period, apex, [1.5.into(), index]);
        let ky = vec![0.0, 0.5];
        let reflected = |resolution: &Resolution| -> Vec<f64> {
            let all = solved(&interface, resolution, ky.clone());
            all.iter().map(|i| share(i, Side::Top)).collect()
        };
        let (found, estimate) = converge_hemisphere(&interface, 1e-2, &no_progress).unwrap();
        let finer = Resolution {
            truncation: Truncation::new(2 * found.truncation.highest()).unwrap(),
            plan: found.plan.refined(2),
        };
        let there = reflected(&finer);
        let error = hemisphere_change(&reflected(&found), &there);
        assert!(
            error <= estimate && estimate <= 1e-2,
            "{index}: {error:.1e}, stated {estimate:.1e}"
        );
    }
}
