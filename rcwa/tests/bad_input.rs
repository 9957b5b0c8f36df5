// SPDX-License-Identifier: MIT OR Apache-2.0
//! What cannot be done is refused in words that say what was asked and what was found: tolerances
//! out of reach, eigenproblems next to a defective one and such as do not exist, wavelengths
//! without data.

use crate::support::{SIDES, largest_difference, layer, real, waves};
use num_complex::Complex64;
use rcwa::accuracy::{Found, Structure, Waves, converge_hemisphere, converge_waves};
use rcwa::hemisphere::{Interface, Resolution};
use rcwa::incidence_grid::{GridRequest, solve_adaptive};
use rcwa::material::{Formula, Material, MaterialError};
use rcwa::no_progress;
use rcwa::relief::shapes::{self, Materials};
use rcwa::{Bloch, Error, Scattering, Stack, Truncation};
use std::f64::consts::{PI, SQRT_2};

/// Lamellae of metal in p polarisation, whose reflectance converges slowly.
fn slow() -> Interface {
    let metal = Complex64::new(0.13, 2.77);
    let materials = Materials { ridge: metal, groove: real(1.5) };
    let relief = shapes::lamellar(0.36, 0.16, 1.0 / 3.0, materials).unwrap();
    Interface { relief, wavelength: 1.0, n_top: real(1.0), n_bottom: metal }
}

/// The reflectance at `tolerance`, if `solve` is asked at all.
fn searched(
    interface: &Interface,
    tolerance: f64,
    solve: &dyn Fn(&Resolution) -> Result<f64, Error>,
) -> Result<Found<f64>, Error> {
    let distance = |a: &f64, b: &f64| (a - b).abs();
    let waves = Waves { solve, distance: &distance, highest_order: 0, first: None };
    converge_waves(Structure::Relief(interface), &waves, tolerance, &no_progress)
}

/// The error, what it says was reached, and its words, which must hold all of it.
fn not_converged(found: Result<Found<f64>, Error>) -> (f64, usize, usize) {
    let error = found.unwrap_err();
    let words = error.to_string();
    let Error::NotConverged { limit, tolerance, allowed, estimate, truncation, slices } = error
    else {
        panic!("{error}");
    };
    for part in [
        format!("{limit} allowed"),
        format!("{allowed:.2e}"),
        format!("{estimate:.2e}"),
        format!("-{truncation}..{truncation}"),
        format!("{slices} slices"),
        format!("{tolerance:.1e}"),
    ] {
        assert!(words.contains(&part), "{part} in: {words}");
    }
    assert!(estimate > allowed && allowed <= tolerance, "{words}");
    (tolerance, truncation, slices)
}

#[test]
fn a_tolerance_out_of_reach_says_how_far_the_search_went() {
    // More slowly than any corner lets orders converge.
    let solve = |at: &Resolution| Ok((at.truncation.count() as f64).powf(-0.1));
    let found = searched(&slow(), 1e-6, &solve).unwrap();
    assert!(found.limit.is_some() && found.errors.sum() > 1e-6);
    let (tolerance, truncation, _) = not_converged(found.within(1e-6));
    assert!((tolerance - 1e-6).abs() < 1e-18 && truncation > 50);
}

#[test]
fn tolerances_that_no_arithmetic_keeps_are_refused_before_any_work() {
    for asked in [0.0, -1e-3, 1e-12, 0.5, f64::NAN, f64::INFINITY] {
        let never = |_: &Resolution| panic!("nothing is solved for a tolerance of {asked}");
        let error = searched(&slow(), asked, &never).unwrap_err();
        let words = error.to_string();
        assert!(
            words.contains("1e-8") && words.contains("0.1") && words.contains(&asked.to_string()),
            "{words}"
        );
        assert!(matches!(
            converge_hemisphere(&small_steps(), asked, &no_progress),
            Err(Error::Tolerance { .. })
        ));
    }
}

#[test]
fn a_structure_that_no_light_reaches_has_no_resolution() {
    let metal = Complex64::new(0.13, 2.77);
    let dark = Interface { n_top: metal, ..slow() };
    let error = converge_hemisphere(&dark, 1e-2, &no_progress).unwrap_err();
    assert!(matches!(error, Error::NoLight { .. }), "{error}");
}

fn small_steps() -> Interface {
    Interface {
        relief: shapes::step(1.0, 0.4, Materials::lossless(1.41, 1.0)).unwrap(),
        wavelength: 0.55,
        n_top: real(1.41),
        n_bottom: real(1.0),
    }
}

#[test]
fn a_grid_of_too_few_directions_is_no_table() {
    let interface = small_steps();
    let request = GridRequest {
        kx_per_zone: 1,
        max_kx: None,
        ky: vec![0.05, 0.6, 1.3],
        critical_ky: 1.0,
        tolerance: 1e-6,
        max_ky: 7,
    };
    let resolution = rcwa::hemisphere::Resolution {
        truncation: Truncation::new(interface.highest_order() + 2).unwrap(),
        plan: interface.relief.slice_plan(3),
    };
    let error = solve_adaptive(&interface, &request, &resolution, &no_progress).unwrap_err();
    assert!(
        matches!(error, Error::NotConverged { tolerance, estimate, .. } if estimate > tolerance),
        "{error}"
    );
    assert!(error.to_string().contains("values of ky allowed"), "{error}");
}

/// A lamellar layer whose LSE problem of orders -1..1 at kx0 = 0 is defective: in the even
/// combinations of orders it is [[ε₀, √2 ε₁], [√2 ε₁, ε₀ + ε₂ - K²]] with K = λ/Λ; halves of
/// permittivities a and a + iδ have ε₁ = iδ/π up to sign and ε₂ = 0, and K² = 2√2 δ/π makes both
/// eigenvalues and both vectors one.
fn defective(period: f64, thickness: f64, off: f64) -> Stack {
    let k2 = 1.0 / (period * period);
    let delta = PI * k2 / (2.0 * SQRT_2) * (1.0 + off);
    let epsilon = Complex64::new(2.0, delta);
    let halves =
        layer(thickness, &[(0.25, epsilon.sqrt()), (0.75, real(SQRT_2)), (1.0, epsilon.sqrt())]);
    Stack::new(1.0, period, real(1.2), real(1.0), vec![halves]).unwrap()
}

fn at(stack: &Stack, ky: f64, highest: usize) -> Result<Scattering, Error> {
    let truncation = Truncation::new(highest).unwrap();
    rcwa::solve(stack, Bloch::new(0.0, ky), truncation)
}

#[test]
fn shares_stay_smooth_at_and_next_to_a_defective_eigenproblem() {
    for period in [0.7, 1.3, 2.9] {
        for thickness in [0.02, 0.3, 4.0] {
            for ky in [0.0, 0.4] {
                let solved = |off: f64| at(&defective(period, thickness, off), ky, 1).unwrap();
                // Shares are smooth in the permittivity, though the eigenvalues go as the root of
                // its distance.
                for off in [1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-8, 1e-6, 1e-4] {
                    let difference = largest_difference(&solved(off), &solved(-off))
                        .max(largest_difference(&solved(0.0), &solved(off)));
                    assert!(
                        difference < 1e-6 + 10.0 * off,
                        "{period}, {thickness}, {ky}, {off}: {difference:.1e}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_layer_of_that_test_is_defective_indeed() {
    // The discriminant of the even combinations' quadratic equation is 0.
    let period = 1.3;
    let stack = defective(period, 0.3, 0.0);
    let segments = &stack.layers()[0].segments;
    let epsilon = segments[0].index * segments[0].index;
    let one = (epsilon - 2.0) / PI;
    let k2 = 1.0 / (period * period);
    let discriminant = k2 * k2 + 8.0 * one * one;
    assert!(discriminant.norm() < 1e-14 * k2 * k2, "{discriminant:e}");
}

#[test]
fn permittivities_whose_means_vanish_give_an_error_or_finite_shares() {
    // ε = 1 and -1 in equal parts: with one order the mean permittivity and the mean of its inverse
    // are 0 (to the last bit), so that neither eigenproblem exists; with more, some rows of the
    // matrices vanish.
    for (plus, minus) in [(1.0, 1.0), (2.0, 2.0), (1.5, 0.7)] {
        for highest in 0..5 {
            for ky in [0.0, 0.3] {
                let half = layer(0.3, &[(0.5, real(plus)), (1.0, Complex64::new(0.0, minus))]);
                let stack = Stack::new(1.0, 0.8, real(1.0), real(1.5), vec![half]).unwrap();
                let what = format!("{plus}, {minus}i, M = {highest}, ky = {ky}");
                match at(&stack, ky, highest) {
                    Err(error) => {
                        let words = error.to_string();
                        assert!(
                            matches!(error, Error::Eigen { .. } | Error::Energy { .. }),
                            "{what}: {words}"
                        );
                        assert!(
                            words.contains("eigenvalue problem") || words.contains("energy"),
                            "{words}"
                        );
                    }
                    Ok(scattering) => {
                        for from in waves(&scattering) {
                            let kept: f64 =
                                SIDES.iter().map(|&to| scattering.total(from, to)).sum();
                            assert!((kept - 1.0).abs() < 1e-10, "{what}: {kept}");
                        }
                    }
                }
            }
        }
    }
}

fn refused(material: &Material, wavelength: f64, range: [f64; 2]) {
    let error = material.index_at(wavelength).unwrap_err();
    let words = error.to_string();
    let MaterialError::OutOfRange { got, min, max } = error else {
        panic!("{words}");
    };
    assert_eq!(
        [got, min, max].map(f64::to_bits),
        [wavelength, range[0], range[1]].map(f64::to_bits)
    );
    for number in [got, min, max] {
        assert!(words.contains(&number.to_string()), "{number} in: {words}");
    }
}

#[test]
fn wavelengths_without_data_are_refused_to_the_last_bit() {
    let range = [0.4, 0.7];
    let yaml = "DATA:\n  - type: formula 5\n    wavelength_range: 0.4 0.7\n    coefficients: 1.4 0.004 -2\n";
    let rows = [[0.4, 1.425, 0.0], [0.55, 1.413, 0.0], [0.7, 1.408, 0.0]];
    let materials = [
        Material::formula(Formula::Cauchy, &[1.4, 0.004, -2.0], range).unwrap(),
        Material::from_yaml(yaml).unwrap(),
        Material::tabulated(&rows).unwrap(),
    ];
    for material in materials {
        for inside in [0.4, 0.55, 0.7] {
            let n = material.index_at(inside).unwrap().n();
            let cauchy = 1.4 + 0.004 / (inside * inside);
            assert!((n - cauchy).abs() < 5e-4, "{inside}: {n}");
        }
        for outside in [0.4_f64.next_down(), 0.7_f64.next_up(), 0.2, 7.0, 550.0] {
            refused(&material, outside, range);
        }
        for none in [0.0, -0.5, f64::NAN, f64::INFINITY] {
            let error = material.index_at(none).unwrap_err();
            assert!(matches!(error, MaterialError::Wavelength { .. }), "{none}: {error}");
        }
    }
}
