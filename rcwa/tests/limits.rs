// SPDX-License-Identifier: MIT OR Apache-2.0
//! Regimes with known limits: effective media, thin and thick phase gratings, blazes.
//!
//! Formulas and numbers: `data/reference/analytic.json`; Rytov 1956; Raman and Nath 1936; Kogelnik
//! 1969; Swanson 1989 (multilevel blazes).

use crate::support::{
    assert_near, case, entries, from_top, layer, number, real, ridge, solve, uniform,
};
use rcwa::relief::Layer;
use rcwa::{Bloch, Pol, Side, Stack};
use std::f64::consts::{PI, TAU};

#[test]
fn one_order_is_the_effective_uniaxial_film() {
    // With one order Li's rules give the film of ε = (TM mean, TE mean, TE mean), in any mount;
    // numbers by a 4 × 4 method.
    let film = ridge(0.3, 0.5, 0.25, real(1.41), real(1.0));
    let stack = Stack::new(0.55, 0.1, real(1.0), real(1.41), vec![film]).unwrap();
    let scattering = solve(&stack, from_top(&stack, 40.0, 30.0), 0);
    let expected = [
        (Pol::S, Pol::S, 0.051_822_622_5),
        (Pol::S, Pol::P, 8.354_856_60e-5),
        (Pol::P, Pol::S, 8.354_856_60e-5),
        (Pol::P, Pol::P, 0.008_572_073_2),
    ];
    for (from, to, r) in expected {
        let got = scattering.efficiency_in((Side::Top, 0, from), (Side::Top, 0), to);
        assert_near(&format!("{from:?} to {to:?}"), got, r, 1e-10);
    }
}

#[test]
fn short_periods_become_effective_films_as_their_square() {
    let fill = 0.5;
    let (te, tm) = (0.5 * (1.41_f64.powi(2) + 1.0), 1.0 / (0.5 / 1.41_f64.powi(2) + 0.5));
    let reflected = |stack: &Stack, highest: usize, pol: Pol| {
        let scattering = solve(stack, Bloch::new(0.0, 0.0), highest);
        scattering.efficiency((Side::Top, 0, pol), (Side::Top, 0))
    };
    // Normal incidence, E along x is p at azimuth 0.
    for (pol, epsilon) in [(Pol::S, te), (Pol::P, tm)] {
        let stack = |period: f64, layer: Layer| {
            Stack::new(0.55, period, real(1.0), real(1.41), vec![layer]).unwrap()
        };
        let film = reflected(&stack(0.1, uniform(0.13, epsilon.sqrt())), 0, pol);
        let error = |period: f64| {
            let lamella = ridge(0.13, 0.5, 0.5 * fill, real(1.41), real(1.0));
            (reflected(&stack(period, lamella), 20, pol) - film).abs()
        };
        let (long, short) = (error(0.04), error(0.02));
        assert!(short < long && long < 1e-4, "{pol:?}: {long:.2e} {short:.2e}");
        // In p the fields at the edges of the film add something that truncation resolves slowly.
        assert!(pol == Pol::P || (long / short / 4.0 - 1.0).abs() < 0.1, "{long:.2e} {short:.2e}");
    }
}

const PHASE_WAVELENGTH: f64 = 1.0037;
const LOW: f64 = 1.45;
const HIGH: f64 = 1.55;

/// Steps of equal height that rise towards larger x in a medium of index 1.5: `levels` phases of a
/// full wave.
fn blaze(levels: usize, period: f64) -> Stack {
    let step = PHASE_WAVELENGTH / (HIGH - LOW) / levels as f64;
    let layers = (1..levels).map(|i| {
        let x = i as f64 / levels as f64;
        layer(step, &[(x, real(LOW)), (1.0, real(HIGH))])
    });
    let n = real(1.5);
    Stack::new(PHASE_WAVELENGTH, period, n, n, layers.collect()).unwrap()
}

fn transmitted(stack: &Stack, highest: usize, order: i32, pol: Pol) -> f64 {
    let scattering = solve(stack, Bloch::new(0.0, 0.0), highest);
    scattering.efficiency((Side::Top, 0, pol), (Side::Bottom, order))
}

#[test]
fn thin_binary_phase_grating() {
    let case = case("analytic.json", "analytic/binary_phase_pi");
    let mut zeroth = Vec::new();
    for (period, row) in entries(&case["outputs"]["rcwa_s_by_period"]) {
        // All that propagates, and some more.
        let highest = (1.5 * period) as usize + 12;
        let scattering = solve(&blaze(2, period), Bloch::new(0.0, 0.0), highest);
        for m in 0..4 {
            let both: Vec<f64> = [m, -m]
                .iter()
                .map(|&m| scattering.efficiency((Side::Top, 0, Pol::S), (Side::Bottom, m)))
                .collect();
            assert_near("mirror", both[0], both[1], 1e-12);
            let what = format!("period {period}, order {m}");
            // Theirs are of fewer orders: at 20 instead of 27 ours agree to 2e-6.
            assert_near(&what, both[0], number(&row[m as usize]), 6e-5);
            let theory = number(&case["outputs"]["theory"][m.to_string()]);
            if period >= 40.0 {
                assert_near(&what, both[0], theory, number(&case["tolerance"]["abs"]));
            }
        }
        zeroth.push((period, scattering.efficiency((Side::Top, 0, Pol::S), (Side::Bottom, 0))));
    }
    // The order that should be dark falls as the square of the period.
    zeroth.sort_by(|a, b| a.0.total_cmp(&b.0));
    for pair in zeroth.windows(2) {
        assert!((pair[0].1 / pair[1].1 / 4.0 - 1.0).abs() < 0.05, "{zeroth:?}");
    }
}

#[test]
fn multilevel_blaze_goes_to_order_plus_one() {
    let outputs = &case("analytic.json", "analytic/multilevel_blaze")["outputs"];
    for levels in [4, 8] {
        let stack = blaze(levels, 40.0);
        let plus = transmitted(&stack, 72, 1, Pol::S);
        // Theirs, again, are of fewer orders.
        let expected = number(&outputs["rcwa_period40"][levels.to_string()]);
        assert_near("period 40", plus, expected, 1e-3);
        assert!(transmitted(&stack, 72, -1, Pol::S) < 0.01, "the other side stays dark");
        // The deficit is proportional to 1 / period.
        let limit = 2.0 * plus - transmitted(&blaze(levels, 20.0), 42, 1, Pol::S);
        let theory = number(&outputs["theory_sinc2(1/L)"][levels.to_string()]);
        assert_near(&format!("{levels} levels"), limit, theory, 0.012);
    }
}

/// n0 + n1 cos(2π x) in equal pieces, harmonics raised by what constant pieces lose of them.
fn cosine(n0: f64, n1: f64, thickness: f64) -> Layer {
    let pieces = 96;
    let kept = |harmonic: f64| {
        let x = PI * harmonic / f64::from(pieces);
        x.sin() / x
    };
    let ends: Vec<_> = (0..pieces)
        .map(|i| {
            let x = TAU * (f64::from(i) + 0.5) / f64::from(pieces);
            let first = 2.0 * n0 * n1 * x.cos() / kept(1.0);
            let second = 0.5 * n1 * n1 * (2.0 * x).cos() / kept(2.0);
            let epsilon = n0 * n0 + 0.5 * n1 * n1 + first + second;
            (f64::from(i + 1) / f64::from(pieces), real(epsilon.sqrt()))
        })
        .collect();
    layer(thickness, &ends)
}

#[test]
fn raman_nath() {
    let case = case("analytic.json", "analytic/raman_nath");
    let theory = &case["outputs"]["theory_J0^2..J3^2"];
    let thickness = PHASE_WAVELENGTH / (TAU * 0.05);
    for period in [40.0, 80.0] {
        let n = real(1.5);
        let layers = vec![cosine(1.5, 0.05, thickness)];
        let stack = Stack::new(PHASE_WAVELENGTH, period, n, n, layers).unwrap();
        for m in 0..4 {
            let got = transmitted(&stack, 12, m, Pol::S);
            let what = format!("period {period}, order {m}");
            assert_near(&what, got, number(&theory[m as usize]), number(&case["tolerance"]["abs"]));
            if period > 60.0 {
                let rigorous = number(&case["outputs"]["rcwa_period80_s"][m as usize]);
                assert_near(&what, got, rigorous, 2e-6);
            }
        }
    }
}

#[test]
fn kogelnik() {
    let outputs = &case("analytic.json", "analytic/kogelnik")["outputs"];
    let (wavelength, period, n0, thickness) = (0.5, 0.3, 1.5, 20.787);
    // Bragg incidence: kx0 is half a grating vector, on either side.
    let diffracted = |thickness: f64, pol: Pol| {
        let layers = vec![cosine(n0, 0.01, thickness)];
        let stack = Stack::new(wavelength, period, real(n0), real(n0), layers).unwrap();
        let scattering = solve(&stack, Bloch::new(-0.5 * wavelength / period, 0.0), 4);
        scattering.efficiency((Side::Top, 0, pol), (Side::Bottom, 1))
    };
    let cos_bragg = (1.0 - (wavelength / (2.0 * n0 * period)).powi(2)).sqrt();
    for (pol, name) in [(Pol::S, "s"), (Pol::P, "p")] {
        let full = &outputs[&format!("eta_{name}")];
        let half = &outputs["half_thickness"][name];
        let references =
            [(thickness, &full["theory"], &full["rcwa"]), (0.5 * thickness, &half[0], &half[1])];
        for (thickness, theory, rigorous) in references {
            let mut nu = PI * 0.01 * thickness / (wavelength * cos_bragg);
            if pol == Pol::P {
                nu *= 2.0 * cos_bragg * cos_bragg - 1.0;
            }
            let got = diffracted(thickness, pol);
            assert_near("formula", nu.sin().powi(2), number(theory), 1e-5);
            assert_near(&format!("{name}, {thickness}"), got, number(theory), 1e-3);
            assert_near(&format!("{name}, {thickness}"), got, number(rigorous), 3e-6);
        }
    }
}
