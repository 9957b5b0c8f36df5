// SPDX-License-Identifier: MIT OR Apache-2.0
//! Samples of a table against the powers of its lobes.

use super::*;
use crate::tests::chi_square::{sidak_level, test_lobes};

#[test]
fn draws_agree_with_listed_shares() {
    let directions = [
        spherical(PI - 0.03, 0.3),
        spherical(PI - 0.9, 1.1),
        spherical(PI - 1.2, 1.5),
        spherical(PI - 1.5, 3.0),
        spherical(0.2, 5.0),
        spherical(0.8, 0.1),
        spherical(1.5, 2.0),
    ];
    let mut rng = Pcg64::seed_from_u64(25);
    let grid = grid(2, 9);
    let tables = [table(&grid, blazed(0.0)), table(&grid, blazed(0.15)), table(&grid, smooth)];
    let level = sidak_level(tables.len() * directions.len());
    for (k, table) in tables.iter().enumerate() {
        for wi in directions {
            let drawn = test_lobes(table, wi, 200_000, &mut rng);
            assert_eq!(drawn.unlisted, 0);
            assert!(drawn.p_value > level, "table {k}, wi {wi}: p = {}", drawn.p_value);
        }
    }
}

#[test]
fn stray_power_is_drawn_as_it_is_listed() {
    // Incidences within a hair of Rayleigh points, where the nodes around disagree on what
    // propagates, and tables that put most power into the orders that pass off, or all power of one
    // side.
    let edge = |only: bool| {
        move |side: Side, kx: f64, ky: f64, _: Polarisation| {
            let n = if only { 1.0 } else { N };
            let to = if only { Side::Outer } else { Side::Inner };
            let highest = (-60..=60).rev().find(|l| {
                let out = kx + f64::from(*l) * 0.125;
                out * out + ky * ky < n * n
            });
            highest.map_or(vec![OrderEfficiency::new(side, 0, 1.0)], |l| {
                vec![OrderEfficiency::new(to, l, 0.9), OrderEfficiency::new(side, 0, 0.1)]
            })
        }
    };
    let grid = grid(2, 9);
    let mut rng = Pcg64::seed_from_u64(26);
    // Where the highest order is order 0, the two shares are one.
    let merged = |only: bool| {
        let edge = edge(only);
        move |side: Side, kx: f64, ky: f64, p: Polarisation| {
            let mut orders: Vec<OrderEfficiency> = Vec::new();
            for o in edge(side, kx, ky, p) {
                match orders.iter_mut().find(|s| (s.to, s.order) == (o.to, o.order)) {
                    Some(same) => same.efficiency += o.efficiency,
                    None => orders.push(o),
                }
            }
            orders
        }
    };
    let tables = [table(&grid, merged(false)), table(&grid, merged(true))];
    let directions: Vec<DVec3> = (0..12)
        .map(|k| {
            let (side, ky) = (Side::BOTH[k % 2], 0.08 * k as f64);
            let n = if k < 6 { N } else { 1.0 };
            // Order 3 a hair beyond or before the rim.
            let kx = (n * n - ky * ky).sqrt() - 7.0 * 0.125 + if k % 3 == 0 { -1e-9 } else { 0.01 };
            Wavevector { kx, ky }.arriving(side, grid.index(side)).unwrap()
        })
        .collect();
    let level = sidak_level(2 * directions.len());
    for table in &tables {
        for wi in &directions {
            let drawn = test_lobes(table, *wi, 50_000, &mut rng);
            assert_eq!(drawn.unlisted, 0);
            assert!(drawn.p_value > level, "wi {wi}: p = {}", drawn.p_value);
        }
    }
}

#[test]
fn pdf_is_the_listed_share() {
    let table = table(&grid(2, 9), blazed(0.1));
    let mut rng = Pcg64::seed_from_u64(27);
    for k in 0..300 {
        let side = Side::BOTH[k % 2];
        let wi = validate::random_incidence(&table, side, &mut rng)
            .arriving(side, table.index(side))
            .unwrap();
        let Some(sample) = table.sample(wi, &mut rng) else {
            continue;
        };
        let lobes = table.lobes(wi, Polarisation::Unpolarised);
        let lobe = lobes.iter().find(|l| l.lobe == sample.lobe).unwrap();
        assert!((lobe.wo - sample.wo).length() < 1e-14);
        assert_abs_diff_eq!(table.pdf(wi, &sample).unwrap(), lobe.power, epsilon = 1e-12);
    }
}
