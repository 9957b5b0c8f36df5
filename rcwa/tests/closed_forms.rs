// SPDX-License-Identifier: MIT OR Apache-2.0
//! Stacks of uniform layers against closed forms, to 1e-12: at any truncation and any azimuth the
//! solver must be exact.
//!
//! Formulas: Born and Wolf, Principles of Optics, chapter 1; numbers:
//! `data/reference/analytic.json` and `published.json`. r_p is the ratio of the magnetic
//! amplitudes; with the polarisation vectors of `docs/explanation/conventions.md` it is the ratio
//! of the amplitudes along p as well, while t_p needs the ratio of the indices.

use crate::support;
use crate::support::{assert_near, case, entries, from_top, number, real, solve, uniform};
use num_complex::Complex64;
use rcwa::relief::Layer;
use rcwa::{Bloch, Pol, Scattering, Side, Stack};
use std::f64::consts::{FRAC_PI_2, TAU};

const EXACT: f64 = 1e-12;
/// Tables print ten decimals.
const PRINTED: f64 = 1e-9;
const WAVELENGTH: f64 = 0.55;

fn stack(n_top: f64, n_bottom: Complex64, layers: Vec<Layer>) -> Stack {
    Stack::new(WAVELENGTH, 0.9, real(n_top), n_bottom, layers).unwrap()
}

/// Runs `check` on solutions at several truncations and azimuths, with what they are called.
fn everywhere(stack: &Stack, side: Side, theta_deg: f64, check: impl Fn(&str, &Scattering)) {
    for highest in [0, 1, 4] {
        for phi in [0.0, 17.0, 90.0, 213.0] {
            let bloch =
                Bloch::from_angles(stack, side, theta_deg.to_radians(), f64::to_radians(phi));
            let what = format!("{theta_deg}° from the {side:?}, azimuth {phi}°, M = {highest}");
            let scattering = solve(stack, bloch, highest);
            for other in [-1, 1] {
                for pol in Pol::BOTH {
                    for to in support::SIDES {
                        let leak = scattering.efficiency((side, 0, pol), (to, other));
                        assert!(leak < 1e-28, "{what}: order {other} gets {leak}");
                    }
                }
            }
            check(&what, &scattering);
        }
    }
}

/// Amplitudes (r_s, r_p, t_s, t_p) of the electric vector at one interface.
fn fresnel(n1: f64, n2: Complex64, theta_deg: f64) -> [Complex64; 4] {
    let (sin, c1) = theta_deg.to_radians().sin_cos();
    let c2 = (1.0 - (n1 * sin / n2).powu(2)).sqrt();
    // Evanescent waves must decay: the root with Im(n2 c2) > 0.
    let c2 = if (n2 * c2).im < 0.0 { -c2 } else { c2 };
    [
        (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2),
        (n2 * c1 - n1 * c2) / (n2 * c1 + n1 * c2),
        2.0 * n1 * c1 / (n1 * c1 + n2 * c2),
        2.0 * n1 * c1 / (n2 * c1 + n1 * c2),
    ]
}

fn reflectance(scattering: &Scattering, side: Side, pol: Pol) -> f64 {
    scattering.efficiency((side, 0, pol), (side, 0))
}

fn transmittance(scattering: &Scattering, pol: Pol) -> f64 {
    scattering.efficiency((Side::Top, 0, pol), (Side::Bottom, 0))
}

#[test]
fn one_interface_is_fresnel_from_both_sides() {
    let plain = stack(1.41, real(1.0), vec![]);
    let ways = [(Side::Top, Side::Bottom, 1.41, 1.0), (Side::Bottom, Side::Top, 1.0, 1.41)];
    for (side, behind, n1, n2) in ways {
        for theta in [0.0, 12.0, 33.0, 44.9, 45.3, 60.0, 89.0] {
            let [r_s, r_p, t_s, t_p] = fresnel(n1, real(n2), theta);
            everywhere(&plain, side, theta, |what, s| {
                for (pol, r, t) in [(Pol::S, r_s, t_s), (Pol::P, r_p, t_p)] {
                    let other = if pol == Pol::S { Pol::P } else { Pol::S };
                    let amplitude = s.amplitude((side, 0, pol), (side, 0, pol));
                    assert!((amplitude - r).norm() < EXACT, "{what}, {pol:?}: r {amplitude}, {r}");
                    let cross = s.amplitude((side, 0, pol), (side, 0, other)).norm();
                    assert!(cross < EXACT, "{what}, {pol:?}: cross {cross}");
                    let passes = n1 * theta.to_radians().sin() < n2;
                    assert_eq!(s.channel(behind, 0).is_some(), passes, "{what}");
                    if passes {
                        let amplitude = s.amplitude((side, 0, pol), (behind, 0, pol));
                        assert!(
                            (amplitude - t).norm() < EXACT,
                            "{what}, {pol:?}: t {amplitude}, {t}"
                        );
                        let power = s.efficiency((side, 0, pol), (behind, 0));
                        assert_near(what, power, 1.0 - r.norm_sqr(), EXACT);
                    }
                }
            });
        }
    }
}

#[test]
fn metal_reflects_by_fresnel_and_takes_the_rest() {
    let metal = Complex64::new(0.22, 6.71);
    for theta in [0.0, 30.0, 80.0] {
        let [r_s, r_p, ..] = fresnel(1.2, metal, theta);
        everywhere(&stack(1.2, metal, vec![]), Side::Top, theta, |what, s| {
            for (pol, r) in [(Pol::S, r_s), (Pol::P, r_p)] {
                let amplitude = s.amplitude((Side::Top, 0, pol), (Side::Top, 0, pol));
                assert!((amplitude - r).norm() < EXACT, "{what}, {pol:?}: {amplitude}, {r}");
                // What passes the surface is absorbed behind it: all that is not reflected.
                assert_near(what, transmittance(s, pol), 1.0 - r.norm_sqr(), EXACT);
            }
        });
    }
}

#[test]
fn fresnel_table_of_silicone() {
    let table = &case("analytic.json", "analytic/fresnel_1.41")["outputs"];
    let plain = stack(1.41, real(1.0), vec![]);
    for (side, key) in [(Side::Top, "Rs_Rp_inside"), (Side::Bottom, "Rs_Rp_outside")] {
        for (theta, row) in entries(&table[key]) {
            everywhere(&plain, side, theta, |what, s| {
                assert_near(what, reflectance(s, side, Pol::S), number(&row[0]), PRINTED);
                assert_near(what, reflectance(s, side, Pol::P), number(&row[1]), PRINTED);
            });
        }
        let brewster =
            if side == Side::Top { "brewster_inside_deg" } else { "brewster_outside_deg" };
        everywhere(&plain, side, number(&table[brewster]), |what, s| {
            assert_near(what, reflectance(s, side, Pol::P), 0.0, 1e-24);
        });
        everywhere(&plain, side, 0.0, |what, s| {
            for pol in Pol::BOTH {
                assert_near(what, reflectance(s, side, pol), number(&table["R_normal"]), EXACT);
            }
        });
    }
    for (theta, row) in entries(&table["TIR_phase_s_p_rad"]) {
        everywhere(&plain, Side::Top, theta, |what, s| {
            for (i, pol) in Pol::BOTH.into_iter().enumerate() {
                let r = s.amplitude((Side::Top, 0, pol), (Side::Top, 0, pol));
                assert_near(what, r.norm(), 1.0, EXACT);
                assert_near(what, r.arg(), number(&row[i]), PRINTED);
            }
        });
    }
    // On either side of the critical angle, and at the double nearest to it.
    let critical = number(&table["critical_deg"]);
    for theta in [critical - 1e-9, critical, critical + 1e-9] {
        everywhere(&plain, Side::Top, theta, |what, s| {
            for pol in Pol::BOTH {
                let expected = fresnel(1.41, real(1.0), theta)[pol as usize].norm_sqr();
                // The root of what is left of 1 - sin²: its argument has lost seven digits here.
                assert_near(what, reflectance(s, Side::Top, pol), expected, 1e-6);
            }
        });
    }
}

#[test]
fn slab_is_airy() {
    let outputs = &case("analytic.json", "analytic/slab_1.41_airy")["outputs"];
    let slab = stack(1.0, real(1.0), vec![uniform(1.0, 1.41)]);
    everywhere(&slab, Side::Top, 0.0, |what, s| {
        for pol in Pol::BOTH {
            assert_near(what, transmittance(s, pol), number(&outputs["T_normal"]), EXACT);
        }
    });
    everywhere(&slab, Side::Top, 40.0, |what, s| {
        assert_near(what, transmittance(s, Pol::S), number(&outputs["T_40deg_s"]), EXACT);
        assert_near(what, transmittance(s, Pol::P), number(&outputs["T_40deg_p"]), EXACT);
    });
    for (thickness, theta) in [(0.01_f64, 10.0_f64), (0.37, 71.0), (23.0, 55.0), (1000.0, 3.0)] {
        let slab = stack(1.0, real(1.0), vec![uniform(thickness, 1.41)]);
        let sin2 = theta.to_radians().sin().powi(2);
        let delta = TAU / WAVELENGTH * thickness * (1.41_f64.powi(2) - sin2).sqrt();
        let surface = fresnel(1.0, real(1.41), theta);
        everywhere(&slab, Side::Top, theta, |what, s| {
            for pol in Pol::BOTH {
                let r = surface[pol as usize].norm_sqr();
                let finesse = 4.0 * r / (1.0 - r).powi(2);
                let expected = 1.0 / (1.0 + finesse * delta.sin().powi(2));
                // The phase itself is only known to eps times its thousands of turns.
                let allowed = EXACT.max(1e-15 * delta);
                assert_near(what, transmittance(s, pol), expected, allowed);
            }
        });
    }
}

#[test]
fn slabs_of_another_solver() {
    let slabs = case("published.json", "moose/slabs");
    for (name, input) in slabs["inputs"].as_object().unwrap() {
        let film = uniform(number(&input["d"]), number(&input["film_n"]));
        let stack = Stack::new(1.0, 0.4, real(1.0), real(number(&input["n_bottom"])), vec![film]);
        let scattering = solve(&stack.unwrap(), Bloch::new(0.0, 0.0), 1);
        let got = reflectance(&scattering, Side::Top, Pol::S);
        let allowed = number(&slabs["tolerance"]["abs"]);
        assert_near(name, got, number(&slabs["outputs"][name]), allowed);
    }
}

#[test]
fn quarter_wave_films() {
    let outputs = &case("analytic.json", "analytic/quarter_wave")["outputs"];
    let cases = [
        (number(&outputs["ideal_film_n"]), 1.41, number(&outputs["R_ideal"])),
        (1.38, 1.41, number(&outputs["R_MgF2_1.38_on_1.41"])),
        (1.38, 1.52, number(&outputs["R_MgF2_1.38_on_1.52"])),
    ];
    for (film, substrate, expected) in cases {
        let coated = stack(1.0, real(substrate), vec![uniform(WAVELENGTH / (4.0 * film), film)]);
        everywhere(&coated, Side::Top, 0.0, |what, s| {
            for pol in Pol::BOTH {
                assert_near(what, reflectance(s, Side::Top, pol), expected, EXACT);
                assert_near(what, reflectance(s, Side::Bottom, pol), expected, EXACT);
            }
        });
    }
}

/// Transmittance (s, p) through a gap of index 1 in silicone beyond the critical angle.
fn frustrated(gap: f64, theta_deg: f64) -> [f64; 2] {
    let n2 = 1.41_f64.powi(2);
    let (sin, cos) = theta_deg.to_radians().sin_cos();
    let beyond = n2 * sin * sin - 1.0;
    let y = TAU / WAVELENGTH * gap * beyond.sqrt();
    let a_s = (n2 - 1.0).powi(2) / (4.0 * n2 * cos * cos * beyond);
    let a_p = a_s * ((n2 + 1.0) * sin * sin - 1.0).powi(2);
    [a_s, a_p].map(|a| 1.0 / (1.0 + a * y.sinh().powi(2)))
}

#[test]
fn frustrated_total_reflection_down_to_the_smallest_tails() {
    let outputs = &case("analytic.json", "analytic/ftir_1.41")["outputs"];
    for theta in [50.0, 60.0] {
        let table = &outputs[&format!("{theta}deg")];
        let mut gaps: Vec<(f64, Option<serde_json::Value>)> =
            entries(table).into_iter().map(|(gap, row)| (gap, Some(row))).collect();
        gaps.extend([(3.0, None), (10.0, None), (50.0, None)]);
        for (gap, row) in gaps {
            let expected = frustrated(gap, theta);
            let silicone = stack(1.41, real(1.41), vec![uniform(gap, 1.0)]);
            everywhere(&silicone, Side::Top, theta, |what, s| {
                for (i, pol) in Pol::BOTH.into_iter().enumerate() {
                    let t = transmittance(s, pol);
                    // Relative, as far as doubles reach: the tail at a gap of 50 is below 1e-150.
                    let what_gap = format!("{what}, gap {gap}");
                    let allowed = (1e-11 * expected[i]).max(f64::MIN_POSITIVE);
                    assert_near(&what_gap, t, expected[i], allowed);
                    assert_near(what, t + reflectance(s, Side::Top, pol), 1.0, EXACT);
                    if let Some(row) = &row {
                        assert_near(what, t, number(&row[i]), PRINTED);
                    }
                }
            });
        }
    }
    assert!(frustrated(50.0, 50.0)[0] < 1e-150);
}

fn bragg(pairs: usize) -> Stack {
    let layers = (0..2 * pairs).map(|i| {
        let n = if i % 2 == 0 { 2.3 } else { 1.45 };
        uniform(WAVELENGTH / (4.0 * n), n)
    });
    stack(1.0, real(1.52), layers.collect())
}

#[test]
fn bragg_mirrors() {
    let outputs = &case("analytic.json", "analytic/bragg_2.3_1.45")["outputs"];
    for (pairs, expected) in entries(&outputs["R_normal"]) {
        everywhere(&bragg(pairs as usize), Side::Top, 0.0, |what, s| {
            for pol in Pol::BOTH {
                assert_near(what, reflectance(s, Side::Top, pol), number(&expected), EXACT);
            }
        });
    }
    let [s45, p45] = [0, 1].map(|i| number(&outputs["R_45deg_s_p_P5"][i]));
    everywhere(&bragg(5), Side::Top, 45.0, |what, s| {
        assert_near(what, reflectance(s, Side::Top, Pol::S), s45, EXACT);
        assert_near(what, reflectance(s, Side::Top, Pol::P), p45, EXACT);
    });
}

#[test]
fn bragg_stop_band_has_its_edges_where_it_should() {
    // Inside the band (in frequency, of relative width w) fields decay with every pair, outside
    // they do not.
    let outputs = &case("analytic.json", "analytic/bragg_2.3_1.45")["outputs"];
    let half = 0.5 * number(&outputs["stopband_dlambda_over_lambda"]);
    let mirror = bragg(400);
    for sign in [-1.0, 1.0] {
        let reflected = |detuning: f64| {
            let wavelength = WAVELENGTH / (1.0 + sign * detuning);
            let tuned =
                Stack::new(wavelength, 0.9, real(1.0), real(1.52), mirror.layers().to_vec());
            let tuned = tuned.unwrap();
            let scattering = solve(&tuned, from_top(&tuned, 0.0, 0.0), 0);
            reflectance(&scattering, Side::Top, Pol::S)
        };
        assert!(1.0 - reflected(half * 0.995) < 1e-12, "inside");
        assert!(1.0 - reflected(half * 1.005) > 1e-3, "outside");
    }
}

#[test]
fn half_wave_film_is_not_there() {
    let film = uniform(WAVELENGTH / (2.0 * 2.3), 2.3);
    let coated = stack(1.41, real(1.0), vec![film]);
    everywhere(&coated, Side::Top, 0.0, |what, s| {
        let bare = fresnel(1.41, real(1.0), 0.0);
        for pol in Pol::BOTH {
            // Half a turn of phase: t changes its sign, r does not.
            let r = s.amplitude((Side::Top, 0, pol), (Side::Top, 0, pol));
            assert!((r - bare[pol as usize]).norm() < EXACT, "{what}: {r}");
            let t = s.amplitude((Side::Top, 0, pol), (Side::Bottom, 0, pol));
            assert!((t + bare[2 + pol as usize]).norm() < EXACT, "{what}: {t}");
        }
    });
    // A quarter wave more turns transmitted amplitudes by exp(i π/2): the sign of time.
    let matched = stack(1.41, real(1.41), vec![uniform(WAVELENGTH / (4.0 * 1.41), 1.41)]);
    everywhere(&matched, Side::Top, 0.0, |what, s| {
        let t = s.amplitude((Side::Top, 0, Pol::P), (Side::Bottom, 0, Pol::P));
        assert!((t - Complex64::cis(FRAC_PI_2)).norm() < EXACT, "{what}: {t}");
    });
}
