// SPDX-License-Identifier: MIT OR Apache-2.0
//! Energy on the grating on which public solvers lose it: a lossless triangle 10 µm wide and 3 µm
//! high at 550 nm, dozens of orders on both sides, many orders kept, many slices. Up to 321 orders
//! and 512 slices at once: `examples/energy.rs`.

use crate::support::{SIDES, real, waves};
use nalgebra::DMatrix;
use rcwa::no_progress;
use rcwa::relief::shapes::{self, Materials};
use rcwa::solve::solve_symmetric_line;
use rcwa::{Pol, Scattering, Side, Stack, SymmetricBloch, Truncation, solve_line};
use std::f64::consts::PI;

const WAVELENGTH: f64 = 0.55;
const PERIOD: f64 = 10.0;
const HEIGHT: f64 = 3.0;
const SILICONE: f64 = 1.41;
const SPACING: f64 = WAVELENGTH / PERIOD;

/// Isosceles; with another apex nothing is symmetric.
fn triangle(apex: f64, slices: usize) -> Stack {
    let materials = Materials::lossless(SILICONE, 1.0);
    let relief = shapes::triangle(PERIOD, [apex, HEIGHT], materials).unwrap();
    let layers = relief.slices(slices);
    assert_eq!(layers.len(), slices);
    Stack::new(WAVELENGTH, PERIOD, real(SILICONE), real(1.0), layers).unwrap()
}

/// Every incident wave of both sides: R + T = 1. Returns how many there were.
fn check(line: &[Scattering], what: &str) -> usize {
    let mut count = 0;
    for scattering in line {
        for from in waves(scattering) {
            let kept: f64 = SIDES.iter().map(|&to| scattering.total(from, to)).sum();
            let ky = scattering.bloch().ky;
            assert!((kept - 1.0).abs() < 1e-10, "{what}, ky = {ky}, {from:?}: {:.1e}", kept - 1.0);
            count += 1;
        }
    }
    count
}

fn solved(stack: &Stack, kx0: f64, ky: &[f64], orders: usize) -> Vec<Scattering> {
    let truncation = Truncation::new(orders / 2).unwrap();
    solve_line(stack, kx0, ky, truncation, &no_progress).unwrap()
}

/// The i-th of points that fill the square evenly [R2 sequence of Roberts].
fn point(i: usize) -> (f64, f64) {
    let g = 1.324_717_957_244_746_f64;
    let i = i as f64;
    ((0.5 + i / g).fract(), (0.5 + i / (g * g)).fract())
}

#[test]
#[ignore = "nightly: up to 321 orders or 512 slices (8 s)"]
fn nightly_hundreds_of_orders_and_of_slices() {
    let mut count = 0;
    for (i, (orders, slices)) in [(121, 64), (41, 512), (201, 16), (321, 6)].into_iter().enumerate()
    {
        let apex = [5.0, 6.7, 10.0][i % 3];
        let stack = triangle(apex, slices);
        let (x, y) = point(i);
        let ky = [SILICONE * y, 0.35 * SILICONE * x];
        let line = solved(&stack, SPACING * x, &ky, orders);
        count += check(&line, &format!("{orders} orders, {slices} slices"));
    }
    assert!(count > 500, "{count} waves");
}

#[test]
fn normal_incidence_zone_borders_and_cut_offs() {
    // Wavevectors that are their own mirror image, planar mount, orders that pass off to the last
    // bit in silicone and in air.
    let mut count = 0;
    for (apex, kx0) in [(5.0, 0.0), (5.0, 0.5 * SPACING), (7.3, 0.0), (7.3, 0.3 * SPACING)] {
        let stack = triangle(apex, 16);
        let mut ky = vec![0.0];
        for (n, m) in [(1.0, 3), (1.0, -11), (SILICONE, 0), (SILICONE, 20)] {
            let kx = kx0 + f64::from(m) * SPACING;
            ky.push((n * n - kx * kx).sqrt());
        }
        let line = solved(&stack, kx0, &ky, 81);
        count += check(&line, &format!("kx0 = {kx0}, apex {apex}"));
    }
    assert!(count > 1000, "{count} waves");
}

#[test]
#[ignore = "nightly: up to 241 orders or 384 slices in real arithmetic (10 s)"]
fn nightly_real_arithmetic_at_both_self_mirror_wavevectors() {
    let mut count = 0;
    for (orders, slices) in [(121, 96), (61, 384), (241, 24)] {
        let stack = triangle(6.7, slices);
        for at in [SymmetricBloch::Centre, SymmetricBloch::Edge] {
            let kx = at.kx0(&stack) + 3.0 * SPACING;
            let ky = [0.0, 0.43, (1.0 - kx * kx).sqrt(), 1.2];
            let truncation = Truncation::new(orders / 2).unwrap();
            let line = solve_symmetric_line(&stack, at, &ky, truncation, &no_progress).unwrap();
            count += check(&line, &format!("{at:?}, {orders} orders, {slices} slices"));
        }
    }
    assert!(count > 1000, "{count} waves");
}

/// Eigenvalues kz² + ky² of the modes without Ex of a slice with a ridge of this share of the
/// period.
fn lse(kx0: f64, fill: f64, highest: i32) -> Vec<f64> {
    let size = 2 * highest as usize + 1;
    let contrast = SILICONE * SILICONE - 1.0;
    let matrix = DMatrix::from_fn(size, size, |i, j| {
        let m = i as f64 - j as f64;
        if i == j {
            let kx = kx0 + (i as f64 - f64::from(highest)) * SPACING;
            1.0 + contrast * fill - kx * kx
        } else {
            contrast * (PI * m * fill).sin() / (PI * m)
        }
    });
    matrix.symmetric_eigenvalues().iter().copied().collect()
}

#[test]
fn degenerate_modes_in_some_slice() {
    // kx0 such that an eigenvalue of one slice is 0: there a mode without Ex and one without Hx
    // have kz² = -ky² nearly together.
    let (slices, highest) = (16, 40);
    let mut found = 0;
    for slice in 0..slices {
        let fill = 1.0 - (slice as f64 + 0.5) / slices as f64;
        let nearest = |kx0: f64| {
            let all = lse(kx0, fill, highest);
            all.into_iter().fold(f64::INFINITY, |a: f64, b| if b.abs() < a.abs() { b } else { a })
        };
        let (mut low, mut high) = (0.0, 0.5 * SPACING);
        let sign = nearest(low) > 0.0;
        if (nearest(high) > 0.0) == sign {
            continue;
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if (nearest(middle) > 0.0) == sign {
                low = middle;
            } else {
                high = middle;
            }
        }
        // The sign may also change between two eigenvalues.
        if nearest(low).abs() > 1e-12 {
            continue;
        }
        let line = solved(
            &triangle([5.0, 7.3][found % 2], slices),
            low,
            &[0.0, 1e-7, 0.02, 0.7],
            2 * highest as usize + 1,
        );
        let count = check(&line, &format!("slice {slice}, kx0 = {low}"));
        assert!(count > 100);
        let normal = line[0].total((Side::Top, 0, Pol::S), Side::Bottom);
        assert!(normal > 0.5, "{normal}");
        found += 1;
        if found == 3 {
            break;
        }
    }
    assert!(found > 0, "no slice has such a kx0");
}
