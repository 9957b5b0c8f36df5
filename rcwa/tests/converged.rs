// SPDX-License-Identifier: MIT OR Apache-2.0
//! Converged and tabulated values of others, each within the tolerance stated with it in
//! `data/reference/published.json` (which names paper or code), at resolutions high enough for that
//! tolerance.

use crate::support::{assert_near, case, entries, from_top, number, real, ridge, solve};
use num_complex::Complex64;
use rcwa::relief::{Layer, Polygon, Relief};
use rcwa::{Bloch, Pol, Scattering, Side, Stack};
use serde_json::Value;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// (side, order, value) of an object with the keys R and T.
fn tabulated(outputs: &Value) -> Vec<(Side, i32, Value)> {
    let of = |side: Side, key: &str| {
        entries(&outputs[key]).into_iter().map(move |(m, value)| (side, m as i32, value))
    };
    of(Side::Top, "R").chain(of(Side::Bottom, "T")).collect()
}

/// A sinusoid cut into slices of equal thickness, walls where it crosses their mid-height; the
/// ridge widens downwards or upwards.
fn sinusoid(
    height: f64,
    slices: u32,
    widens: Side,
    centre: f64,
    inside: f64,
    outside: f64,
) -> Vec<Layer> {
    (0..slices)
        .map(|i| {
            let from_tip = if widens == Side::Bottom { i } else { slices - 1 - i };
            let level = 1.0 - 2.0 * (f64::from(from_tip) + 0.5) / f64::from(slices);
            let half = level.acos() / TAU;
            ridge(height / f64::from(slices), centre, half, real(inside), real(outside))
        })
        .collect()
}

fn conical_sinusoid(slices: u32) -> (Stack, Bloch) {
    let layers = sinusoid(0.3, slices, Side::Bottom, 0.0, 2.0, 1.0);
    let stack = Stack::new(0.5, 1.0, real(1.0), real(2.0), layers).unwrap();
    let bloch =
        Bloch::new(75f64.to_radians().sin() * 60f64.to_radians().sin(), 75f64.to_radians().cos());
    (stack, bloch)
}

fn jones(scattering: &Scattering, wave: [Complex64; 2], to: (Side, i32)) -> f64 {
    let matrix = scattering.jones((Side::Top, 0), to).unwrap();
    matrix.efficiencies(wave).iter().sum()
}

#[test]
fn gdcalc_sinusoid_in_six_states_of_polarisation() {
    let case = case("published.json", "gdcalc/demo1a_sinusoid_conical");
    let (stack, bloch) = conical_sinusoid(50);
    let scattering = solve(&stack, bloch, 20);
    let (i, one, zero) = (Complex64::I, Complex64::ONE, Complex64::ZERO);
    let states = [
        [one, zero],
        [zero, one],
        [one * FRAC_1_SQRT_2; 2],
        [FRAC_1_SQRT_2 * one, -i * FRAC_1_SQRT_2],
    ];
    // H ∝ (-p E_s + s E_p): no Hy needs (s_y, p_y), no Ey (p_y, -s_y).
    let source = *scattering.channel(Side::Top, 0).unwrap();
    let across = source.kx.hypot(source.ky);
    let (s_y, p_y) = (source.kx / across, source.kz.re * source.ky / across);
    let lines = [[real(s_y), real(p_y)], [real(p_y), real(-s_y)]];
    let mut compared = 0;
    let mut compare = |table: &Value, states: &[[Complex64; 2]]| {
        for (side, m, row) in tabulated(table) {
            for (column, &state) in states.iter().enumerate() {
                let (got, expected) = (jones(&scattering, state, (side, m)), number(&row[column]));
                let what = format!("{side:?} {m}, column {column}");
                assert_near(&what, got, expected, number(&case["tolerance"]["rel"]) * expected);
                compared += 1;
            }
        }
    };
    compare(&case["outputs"], &states);
    compare(&case["outputs_line_polarisation"], &lines);
    assert_eq!(compared, 72);
}

#[test]
fn staircase_of_the_same_sinusoid_approaches_the_smooth_one() {
    let case = case("published.json", "derived/cmethod_sinusoid_conical");
    let (stack, bloch) = conical_sinusoid(100);
    let scattering = solve(&stack, bloch, 40);
    for (pol, key, tolerance) in [(Pol::S, "s", "abs_s"), (Pol::P, "p", "abs_p")] {
        let allowed = number(&case["tolerance"][tolerance]);
        for (side, m, row) in tabulated(&case["outputs"][key]) {
            let from = (Side::Top, 0, pol);
            let parts = Pol::BOTH.map(|to| scattering.efficiency_in(from, (side, m), to));
            let what = format!("{key}, {side:?} {m}");
            assert_near(&what, parts[0] + parts[1], number(&row[0]), allowed);
            assert_near(&what, parts[0], number(&row[1]), allowed);
            assert_near(&what, parts[1], number(&row[2]), allowed);
        }
    }
}

#[test]
fn smooth_sinusoid_of_silicone_from_inside() {
    let case = case("published.json", "derived/sinusoid_n1.41_inside");
    let layers = sinusoid(0.1, 100, Side::Top, 0.5, 1.41, 1.0);
    let stack = Stack::new(0.55, 0.8, real(1.41), real(1.0), layers).unwrap();
    for (name, phi) in [("theta20_phi0", 0.0), ("theta20_phi50", 50.0)] {
        let scattering = solve(&stack, from_top(&stack, 20.0, phi), 40);
        for (pol, key) in [(Pol::S, "s"), (Pol::P, "p")] {
            for (side, m, value) in tabulated(&case["outputs"][name][key]) {
                let got = scattering.efficiency((Side::Top, 0, pol), (side, m));
                let what = format!("{name} {key} {side:?} {m}");
                assert_near(&what, got, number(&value), number(&case["tolerance"]["abs"]));
            }
        }
    }
}

fn metallic(height: f64) -> (Stack, Bloch) {
    let metal = Complex64::new(0.22, 6.71);
    let lamella = ridge(height, 0.5, 0.25, metal, real(1.0));
    let stack = Stack::new(1.0, 1.0, real(1.0), metal, vec![lamella]).unwrap();
    let bloch = from_top(&stack, 30.0, 0.0);
    (stack, bloch)
}

fn reflected(stack: &Stack, bloch: Bloch, highest: usize, pol: Pol, order: i32) -> f64 {
    solve(stack, bloch, highest).efficiency((Side::Top, 0, pol), (Side::Top, order))
}

#[test]
fn metallic_lamella_of_granet_and_guizal() {
    let case = case("published.json", "granet_guizal_1996_table1_exact");
    for (height, expected) in entries(&case["outputs"]) {
        let (stack, bloch) = metallic(height);
        let [few, many] = [60, 120].map(|m| solve(&stack, bloch, m));
        for (order, key) in [(0, "R0"), (-1, "R-1")] {
            let [few, many] =
                [&few, &many].map(|s| s.efficiency((Side::Top, 0, Pol::P), (Side::Top, order)));
            let exact = number(&expected[key]);
            let allowed = number(&case["tolerance"][height.to_string()]);
            // What is left falls slowly, about as 1/M^1.5 for a metal in TM; the table has four
            // decimals.
            let limit = many + (many - few) / (2_f64.powf(1.5) - 1.0);
            assert_near(&format!("h = {height}, {key}"), limit, exact, allowed);
            assert!((many - exact).abs() < 3e-3);
        }
    }
}

#[test]
fn metallic_lamella_of_lalanne_and_hugonin() {
    let case = case("published.json", "lalanne_hugonin_2000_tables1_2");
    let (stack, bloch) = metallic(1.0);
    let outputs = &case["outputs"];
    for (pol, name, order) in [(Pol::P, "TM_R0", 0), (Pol::S, "TE_Rm1", -1)] {
        let exact = number(&outputs[&format!("{name}_exact")]);
        let mut errors = Vec::new();
        for (harmonics, value) in entries(&outputs[&format!("{name}_by_number_of_harmonics")]) {
            let got = reflected(&stack, bloch, harmonics as usize / 2, pol, order);
            let what = format!("{name} with {harmonics}");
            assert_near(&what, got, number(&value), number(&case["tolerance"]["abs"]));
            errors.push((got - exact).abs());
        }
        let last = (reflected(&stack, bloch, 110, pol, order) - exact).abs();
        errors.push(last);
        assert!(errors.is_sorted_by(|a, b| a > b), "{name}: {errors:?}");
        let allowed = if pol == Pol::S { 1.5e-4 } else { 1e-3 };
        assert!(last < allowed, "{name}: {last:.1e}");
    }
}

#[test]
fn elliptic_rods() {
    let case = case("published.json", "popov_book_elliptic_rods");
    let input = |key: &str| number(&case["inputs"][key]);
    let (half_width, half_height) = (input("ax"), input("ay"));
    let slices: u32 = 160;
    let layers = (0..slices)
        .map(|i| {
            let z = 2.0 * (f64::from(i) + 0.5) / f64::from(slices) - 1.0;
            let half = half_width / input("period") * (1.0 - z * z).sqrt();
            let thickness = 2.0 * half_height / f64::from(slices);
            ridge(thickness, 0.5, half, real(input("n_rod")), real(1.0))
        })
        .collect();
    let air = real(1.0);
    let stack = Stack::new(input("wavelength"), input("period"), air, air, layers).unwrap();
    let scattering = solve(&stack, from_top(&stack, input("theta_deg"), 0.0), 36);
    for (pol, output, tolerance) in [(Pol::S, "T0_Epar", "Epar"), (Pol::P, "T0_Hpar", "Hpar")] {
        let got = scattering.efficiency((Side::Top, 0, pol), (Side::Bottom, 0));
        let allowed = number(&case["tolerance"][tolerance]);
        assert_near(output, got, number(&case["outputs"][output]), allowed);
    }
}

#[test]
fn free_standing_lamellae_at_every_tabulated_truncation() {
    let case = case("published.json", "moose/gratings");
    for (name, input) in case["inputs"].as_object().unwrap() {
        let index = Complex64::new(number(&input["n"][0]), number(&input["n"][1]));
        let half = 0.5 * number(&input["fill"]);
        let lamella = ridge(number(&input["d"]), 0.5, half, index, real(1.0));
        let period = number(&input["period"]);
        let stack = Stack::new(1.0, period, real(1.0), real(1.0), vec![lamella]).unwrap();
        let pol = if input["pol"] == "s" { Pol::S } else { Pol::P };
        let total = |highest: usize| {
            let scattering = solve(&stack, Bloch::new(0.0, 0.0), highest);
            scattering.total((Side::Top, 0, pol), Side::Top)
        };
        let outputs = entries(&case["outputs"][name]);
        for (highest, value) in outputs.iter().filter(|(m, _)| *m <= 100.0) {
            let what = format!("{name}, M = {highest}");
            let allowed = number(&case["tolerance"]["abs"]);
            assert_near(&what, total(*highest as usize), number(value), allowed);
        }
        let (_, limit) = outputs.iter().find(|(m, _)| *m > 100.0).unwrap();
        assert_near(name, total(90), number(limit), 5e-4);
    }
}

#[test]
fn s4_grating_by_the_right_rule_and_not_by_the_other() {
    let case = case("published.json", "s4/binary_TM_direct_rule");
    let outputs = &case["outputs"];
    let total = |frequency: f64, highest: usize| {
        let lamella = ridge(0.5, 0.5, 0.25, real(12_f64.sqrt()), real(1.0));
        let stack = Stack::new(1.0 / frequency, 1.0, real(1.0), real(1.0), vec![lamella]).unwrap();
        let scattering = solve(&stack, Bloch::new(0.0, 0.0), highest);
        scattering.total((Side::Top, 0, Pol::P), Side::Bottom)
    };
    let allowed = number(&case["tolerance"]["abs_li"]);
    for (key, highest) in [("T_li_rule_N13", 13), ("T_li_rule_N100", 100)] {
        for (frequency, value) in entries(&outputs[key]) {
            let what = format!("{key} at {frequency}");
            assert_near(&what, total(frequency, highest), number(&value), allowed);
        }
    }
    for (frequency, value) in entries(&outputs["T_direct_rule"]) {
        assert!((total(frequency, 13) - number(&value)).abs() > 1e-3, "{frequency}");
    }
}

#[test]
fn stairs_of_a_slanted_side_converge_as_the_square_of_their_height() {
    let tooth = Polygon { index: real(1.41), points: vec![[0.0, 0.0], [2.0, 0.0], [1.6, 1.0]] };
    let relief = Relief::new(2.0, 1.0, real(1.0), vec![tooth]).unwrap();
    let total = |slices: usize, pol: Pol| {
        let stack = Stack::new(0.55, 2.0, real(1.41), real(1.0), relief.slices(slices)).unwrap();
        solve(&stack, Bloch::new(0.2, 0.3), 14).total((Side::Top, 0, pol), Side::Bottom)
    };
    for pol in Pol::BOTH {
        let [coarse, middle, fine] = [48, 96, 192].map(|slices| total(slices, pol));
        let ratio = (coarse - middle) / (middle - fine);
        assert!((ratio / 4.0 - 1.0).abs() < 0.1, "{pol:?}: {ratio}");
    }
}
