// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whole hemispheres: diffuse light passes both ways by the squares of the indices, and no share is
//! lost.

use super::random::{Fill, check, index, polygon, small};
use num_complex::Complex64;
use proptest::prelude::*;
use rcwa::hemisphere::{Directions, Hemisphere, Interface, Resolution, hemisphere};
use rcwa::no_progress;
use rcwa::relief::{Polygon, Relief};
use rcwa::{Side, Truncation};

/// Rectangles of the period 1, which slices do not approximate but are.
fn rectangles() -> impl Strategy<Value = Relief> {
    let one = (0.0..1.0_f64, 0.1..0.9_f64, 0.0..0.5_f64, 0.55..1.0_f64, index(Fill::Dielectric));
    let several = prop::collection::vec(one, 1..=2);
    (several, 0.1..0.8_f64, index(Fill::Dielectric)).prop_map(|(several, depth, background)| {
        let polygon = |(x, width, z0, z1, index): (f64, f64, f64, f64, Complex64)| {
            let [z0, z1] = [z0, z1].map(|z| z * depth);
            let points = vec![[x, z0], [x + width, z0], [x + width, z1], [x, z1]];
            Polygon { index, points }
        };
        let polygons = several.into_iter().map(polygon).collect();
        Relief::new(1.0, depth, background, polygons).unwrap()
    })
}

fn solved(
    interface: &Interface,
    kx_per_zone: usize,
    ky: &[f64],
    slices: usize,
) -> Result<Hemisphere, TestCaseError> {
    let largest = interface.n_top.re.max(interface.n_bottom.re);
    let directions = Directions { kx_per_zone, ky: ky.iter().map(|part| part * largest).collect() };
    let resolution = Resolution {
        truncation: Truncation::new(interface.highest_order() + 1).unwrap(),
        plan: interface.relief.slice_plan(slices),
    };
    hemisphere(interface, &directions, &resolution, &no_progress)
        .map_err(|e| TestCaseError::fail(e.to_string()))
}

fn grid() -> impl Strategy<Value = (usize, Vec<f64>)> {
    (1..=4_usize, prop::collection::vec(0.0..1.0_f64, 1..=3))
}

#[test]
fn diffuse_light_passes_both_ways_by_the_squares_of_the_indices() {
    // n₁² T(1 → 2) = n₂² T(2 → 1): with nodes that lie evenly in (kx, ky) the sums of what passes
    // are equal.
    let around = (index(Fill::Dielectric), index(Fill::Dielectric));
    check(
        100,
        &(rectangles(), around, grid(), 1.1..2.5_f64),
        |(relief, (n_top, n_bottom), (kx_per_zone, ky), periods)| {
            let interface = Interface { relief, wavelength: 1.0 / periods, n_top, n_bottom };
            prop_assert!(interface.relief.slice_plan(1).is_exact());
            let solved = solved(&interface, kx_per_zone, &ky, 1)?;
            let mut through = [0.0; 2];
            for incidence in &solved.incidences {
                for &(side, _, share) in &incidence.efficiencies {
                    if side != incidence.side {
                        through[usize::from(incidence.side == Side::Bottom)] += share;
                    }
                }
            }
            small("down - up", through[0] - through[1], 1e-9)
        },
    );
}

#[test]
fn extrapolated_shares_still_add_up() {
    let around = (index(Fill::Dielectric), index(Fill::Dielectric));
    check(
        60,
        &(polygon(Fill::Dielectric), around, grid(), 1..=3_usize, 1.1..2.5_f64),
        |(relief, (n_top, n_bottom), (kx_per_zone, ky), slices, periods)| {
            let interface = Interface { relief, wavelength: 1.0 / periods, n_top, n_bottom };
            let solved = solved(&interface, kx_per_zone, &ky, slices)?;
            prop_assert!(!solved.incidences.is_empty());
            for incidence in &solved.incidences {
                let all: f64 = incidence.efficiencies.iter().map(|s| s.2).sum();
                prop_assert!(incidence.efficiencies.iter().all(|s| s.2 >= 0.0));
                small("shares - 1", all - 1.0, 1e-10)?;
            }
            Ok(())
        },
    );
}
