// SPDX-License-Identifier: MIT OR Apache-2.0
//! Laws that hold exactly at any truncation: energy, reciprocity, symmetry, and what must change
//! nothing.
//!
//! Reciprocity and mirror images are between problems at (kx0, ky) and (-kx0, ±ky) with the same
//! orders -M..M, so both keep the same waves and agree to round-off, not only to truncation.

use crate::support;
use crate::support::{
    SIDES, assert_near, balance, largest_difference, layer, moved, real, ridge, share, solve,
    uniform, waves,
};
use num_complex::Complex64;
use rcwa::hemisphere::{Directions, Interface, Resolution, hemisphere};
use rcwa::no_progress;
use rcwa::relief::shapes::{self, Materials};
use rcwa::relief::{Layer, Segment};
use rcwa::{Bloch, Pol, Scattering, Side, Stack, Truncation};
use std::f64::consts::TAU;

const EXACT: f64 = 1e-12;
const WAVELENGTH: f64 = 0.55;
const PERIOD: f64 = 0.9;

fn silicone_air(layers: Vec<Layer>) -> Stack {
    Stack::new(WAVELENGTH, PERIOD, real(1.41), real(1.0), layers).unwrap()
}

/// Three layers without any symmetry; `absorption` is the imaginary part of the index of some of
/// it.
fn asymmetric(absorption: f64) -> Vec<Layer> {
    let lossy = Complex64::new(1.8, absorption);
    vec![
        layer(0.21, &[(0.15, real(1.0)), (0.4, lossy), (0.85, real(1.3)), (1.0, real(2.1))]),
        layer(0.1, &[(0.35, lossy), (1.0, real(1.2))]),
        layer(0.4, &[(0.05, real(1.0)), (0.55, real(1.41)), (0.7, lossy), (1.0, real(1.41))]),
    ]
}

fn mirror_symmetric() -> Stack {
    let outer = ridge(0.2, 0.5, 0.17, real(1.41), real(1.0));
    let metal = Complex64::new(0.5, 3.0);
    let inner = layer(
        0.3,
        &[(0.1, metal), (0.4, real(1.0)), (0.6, real(1.41)), (0.9, real(1.0)), (1.0, metal)],
    );
    silicone_air(vec![outer, inner])
}

/// Directions all over the place, in units of k0.
const BLOCHS: [(f64, f64); 6] =
    [(0.0, 0.0), (0.27, 0.0), (0.0, 0.61), (0.21, 0.43), (-0.3, 0.99), (0.11, 1.3)];

#[test]
fn power_is_conserved_at_every_truncation() {
    let sawtooth = shapes::triangle(PERIOD, [0.8, 0.5], Materials::lossless(1.41, 1.0)).unwrap();
    let plasma = ridge(0.3, 0.5, 0.2, Complex64::new(0.0, 2.5), real(1.3));
    let high = ridge(0.7, 0.4, 0.21, real(3.5), real(1.0));
    let structures = [asymmetric(0.0), sawtooth.slices(24), vec![plasma, high]];
    for layers in structures {
        let stack = silicone_air(layers);
        for highest in 0..=12 {
            for (kx0, ky) in BLOCHS {
                let residual = balance(&solve(&stack, Bloch::new(kx0, ky), highest));
                assert!(residual.abs() < EXACT, "M = {highest} at ({kx0}, {ky}): {residual:.1e}");
            }
        }
    }
}

#[test]
fn dozens_of_orders_conserve_power_too() {
    let relief = shapes::step(10.0, 4.03, Materials::lossless(1.41, 1.0)).unwrap();
    let stack =
        Stack::new(WAVELENGTH, relief.period(), real(1.41), real(1.0), relief.slices(12)).unwrap();
    for ky in [0.0, 0.3, 1.2] {
        let scattering = solve(&stack, Bloch::new(0.01, ky), 32);
        assert!(waves(&scattering).len() > 50);
        assert!(balance(&scattering).abs() < EXACT, "ky = {ky}: {:.1e}", balance(&scattering));
    }
}

#[test]
fn absorption_takes_power_and_never_gives() {
    for absorption in [1e-6, 1e-2, 1.0, 4.0] {
        let stack = silicone_air(asymmetric(absorption));
        for highest in [0, 1, 4, 9] {
            for (kx0, ky) in BLOCHS {
                let scattering = solve(&stack, Bloch::new(kx0, ky), highest);
                for from in waves(&scattering) {
                    let kept: f64 = SIDES.iter().map(|&side| scattering.total(from, side)).sum();
                    let what = format!("k = {absorption}, M = {highest}, ({kx0}, {ky}), {from:?}");
                    assert!(kept < 1.0 && kept > 0.0, "{what}: {kept}");
                    // A weak absorption takes in proportion.
                    assert!(absorption > 1e-5 || 1.0 - kept < 1e-3, "{what}: {kept}");
                }
            }
        }
    }
}

/// Largest departure of the scattering matrix at k from the transpose of that at -k, signs
/// included: reversed waves keep their p vector and reverse s.
fn irreciprocity(stack: &Stack, kx0: f64, ky: f64, highest: usize) -> f64 {
    let forward = solve(stack, Bloch::new(kx0, ky), highest);
    let backward = solve(stack, Bloch::new(-kx0, -ky), highest);
    let all = waves(&forward);
    let mut worst = 0.0_f64;
    for &from in &all {
        for &to in &all {
            let reversed = |(side, m, pol): (Side, i32, Pol)| (side, -m, pol);
            let kz = |(side, m, _): (Side, i32, Pol)| forward.channel(side, m).unwrap().kz.re;
            let there = forward.amplitude(from, to) * (kz(to) / kz(from)).sqrt();
            let back =
                backward.amplitude(reversed(to), reversed(from)) * (kz(from) / kz(to)).sqrt();
            let sign = if from.2 == to.2 { 1.0 } else { -1.0 };
            assert!(there.is_finite());
            worst = worst.max((there - sign * back).norm());
            let shares = share(&forward, from, to) - share(&backward, reversed(to), reversed(from));
            worst = worst.max(shares.abs());
        }
    }
    worst
}

#[test]
fn reciprocity_of_the_whole_scattering_matrix() {
    for absorption in [0.0, 0.05, 2.0] {
        let stack = silicone_air(asymmetric(absorption));
        for highest in [2, 5, 12] {
            for (kx0, ky) in BLOCHS.into_iter().filter(|&(kx0, ky)| kx0 != 0.0 || ky != 0.0) {
                let worst = irreciprocity(&stack, kx0, ky, highest);
                assert!(
                    worst < EXACT,
                    "k = {absorption}, M = {highest}, ({kx0}, {ky}): {worst:.1e}"
                );
            }
        }
    }
}

#[test]
fn another_brillouin_zone_is_the_same_problem_but_for_truncation() {
    let stack = silicone_air(asymmetric(0.05));
    let difference = |highest: usize| {
        let here = solve(&stack, Bloch::new(0.2, 0.4), highest);
        let next = solve(&stack, Bloch::new(0.2 - WAVELENGTH / PERIOD, 0.4), highest);
        let renumbered = |(side, m, pol): (Side, i32, Pol)| (side, m + 1, pol);
        let all = waves(&here);
        let of = |&from| all.iter().map(move |&to| (from, to));
        let pairs = all.iter().flat_map(of);
        pairs
            .map(|(a, b)| (share(&here, a, b) - share(&next, renumbered(a), renumbered(b))).abs())
            .fold(0.0, f64::max)
    };
    let (few, many) = (difference(10), difference(40));
    assert!(many < 1e-5 && many < 0.05 * few && few > 0.0, "{few:.1e}, {many:.1e}");
}

#[test]
fn mirror_symmetric_gratings_send_equal_shares_to_both_sides() {
    let stack = mirror_symmetric();
    // Normal incidence and phi = 90°: kx0 = 0.
    for ky in [0.0, 0.3, 0.9] {
        let scattering = solve(&stack, Bloch::new(0.0, ky), 6);
        for (side, to) in [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| (SIDES[a], SIDES[b])) {
            for pol in Pol::BOTH {
                let from = (side, 0, pol);
                for m in scattering.orders(to) {
                    let [plus, minus] = [m, -m].map(|m| scattering.efficiency(from, (to, m)));
                    assert_near(&format!("{from:?} to {m}, ky = {ky}"), plus, minus, EXACT);
                }
                let other = if pol == Pol::S { Pol::P } else { Pol::S };
                let converted = scattering.efficiency_in(from, (to, 0), other);
                assert!(converted < 1e-26, "{from:?}, ky = {ky}: {converted:.1e}");
            }
        }
    }
}

#[test]
fn opposite_azimuths_swap_the_orders_of_a_mirror_symmetric_grating() {
    let stack = mirror_symmetric();
    for (theta, phi) in [(20.0, 0.0), (33.0, 50.0), (60.0, 77.0)] {
        let here = solve(&stack, support::from_top(&stack, theta, phi), 6);
        let there = solve(&stack, support::from_top(&stack, theta, 180.0 - phi), 6);
        for from in waves(&here) {
            for to in waves(&here) {
                let swap = |(side, m, pol): (Side, i32, Pol)| (side, -m, pol);
                let (a, b) = (share(&here, from, to), share(&there, swap(from), swap(to)));
                assert_near(&format!("{from:?} to {to:?}"), a, b, EXACT);
            }
        }
    }
}

#[test]
fn the_sign_of_ky_changes_no_share() {
    let stack = silicone_air(asymmetric(0.3));
    for (kx0, ky) in BLOCHS {
        let (a, b) =
            (solve(&stack, Bloch::new(kx0, ky), 6), solve(&stack, Bloch::new(kx0, -ky), 6));
        for from in waves(&a) {
            for side in SIDES {
                for m in a.orders(side) {
                    let (plus, minus) =
                        (a.efficiency(from, (side, m)), b.efficiency(from, (side, m)));
                    assert_near(&format!("{from:?} to {side:?} {m}"), plus, minus, EXACT);
                }
            }
        }
    }
}

#[test]
fn a_mirrored_relief_is_the_same_in_the_mirror() {
    let relief = shapes::triangle(PERIOD, [0.8, 0.5], Materials::lossless(1.41, 1.0)).unwrap();
    let (stack, image) =
        (silicone_air(relief.slices(8)), silicone_air(moved(&relief, |x| -x).slices(8)));
    for (kx0, ky) in BLOCHS {
        let (a, b) =
            (solve(&stack, Bloch::new(kx0, ky), 7), solve(&image, Bloch::new(-kx0, ky), 7));
        for from in waves(&a) {
            for to in waves(&a) {
                let swap = |(side, m, pol): (Side, i32, Pol)| (side, -m, pol);
                let what = format!("{from:?} to {to:?} at ({kx0}, {ky})");
                assert_near(&what, share(&a, from, to), share(&b, swap(from), swap(to)), EXACT);
            }
        }
    }
}

#[test]
fn only_ratios_of_lengths_count() {
    let (stack, bloch) = (silicone_air(asymmetric(0.1)), Bloch::new(0.2, 0.4));
    for scale in [1e-9, 550.0] {
        let scaled =
            |l: &Layer| Layer { thickness: l.thickness * scale, segments: l.segments.clone() };
        let layers = stack.layers().iter().map(scaled).collect();
        let other =
            Stack::new(WAVELENGTH * scale, PERIOD * scale, real(1.41), real(1.0), layers).unwrap();
        let difference = largest_difference(&solve(&stack, bloch, 6), &solve(&other, bloch, 6));
        assert!(difference < EXACT, "{difference:.1e}");
    }
}

/// The segments moved by a fraction of the period.
fn shifted(layer: &Layer, dx: f64) -> Layer {
    let mut parts: Vec<Segment> = Vec::new();
    for s in &layer.segments {
        let (x0, x1) = (s.x0 + dx, s.x1 + dx);
        for whole in [0.0, 1.0] {
            let (x0, x1) = ((x0 - whole).max(0.0), (x1 - whole).min(1.0));
            if x1 > x0 {
                parts.push(Segment { x0, x1, index: s.index });
            }
        }
    }
    parts.sort_by(|a, b| a.x0.total_cmp(&b.x0));
    Layer::new(layer.thickness, parts).unwrap()
}

#[test]
fn shifting_turns_order_m_by_its_phase() {
    let dx = 0.37;
    for absorption in [0.0, 0.2] {
        let mut layers = asymmetric(absorption);
        layers.push(ridge(0.1, 0.3, 0.2, real(1.41), real(1.0)));
        let moved: Vec<Layer> = layers.iter().map(|l| shifted(l, dx)).collect();
        let (stack, moved) = (silicone_air(layers), silicone_air(moved));
        for (kx0, ky) in BLOCHS {
            let bloch = Bloch::new(kx0, ky);
            let (a, b) = (solve(&stack, bloch, 6), solve(&moved, bloch, 6));
            for from in waves(&a) {
                for to in waves(&a) {
                    let phase = Complex64::cis(-TAU * dx * f64::from(to.1 - from.1));
                    let difference = (a.amplitude(from, to) * phase - b.amplitude(from, to)).norm();
                    assert!(
                        difference < EXACT,
                        "{from:?} to {to:?} at ({kx0}, {ky}): {difference:.1e}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_layer_cut_in_two_is_the_same_layer() {
    for absorption in [0.0, 0.2] {
        let layers = asymmetric(absorption);
        // Parts of every kind: thick and thick, thick and thin, thin and nothing.
        let parts = [(0, 0.5), (1, 0.02), (2, 1.0)];
        let mut cut = Vec::new();
        for (i, share) in parts {
            for share in [share, 1.0 - share] {
                let thickness = layers[i].thickness * share;
                cut.push(Layer { thickness, segments: layers[i].segments.clone() });
            }
        }
        let (whole, cut) = (silicone_air(layers), silicone_air(cut));
        for (kx0, ky) in BLOCHS {
            let bloch = Bloch::new(kx0, ky);
            let difference = largest_difference(&solve(&whole, bloch, 6), &solve(&cut, bloch, 6));
            assert!(difference < EXACT, "({kx0}, {ky}): {difference:.1e}");
        }
    }
}

#[test]
fn layers_of_no_thickness_and_walls_between_equals_change_nothing() {
    let plain = asymmetric(0.0);
    let mut more = plain.clone();
    more.insert(1, Layer { thickness: 0.0, segments: plain[2].segments.clone() });
    more.insert(0, uniform(0.0, 3.0));
    let mut walls = plain.clone();
    let first = walls[0].segments[0];
    walls[0].segments.splice(0..1, [Segment { x1: 0.07, ..first }, Segment { x0: 0.07, ..first }]);
    let nearly_nothing = [uniform(1e-13, 3.0)].into_iter().chain(plain.clone()).collect();
    let stack = silicone_air(plain);
    for other in [more, walls, nearly_nothing].map(silicone_air) {
        for (kx0, ky) in BLOCHS {
            let bloch = Bloch::new(kx0, ky);
            let difference = largest_difference(&solve(&stack, bloch, 6), &solve(&other, bloch, 6));
            assert!(difference < 1e-11, "({kx0}, {ky}): {difference:.1e}");
        }
    }
}

#[test]
fn patterned_layers_of_equal_indices_are_uniform_ones() {
    let uniform_stack = silicone_air(vec![uniform(0.3, 1.6), uniform(2.0, 1.2)]);
    // Different enough not to be merged, by a few units in the last place; real, then through the
    // general solver.
    let tiny = [Complex64::new(4e-16, 0.0), Complex64::new(0.0, 1e-14)];
    for difference in tiny {
        let patterned = |thickness: f64, n: f64| {
            let l = ridge(thickness, 0.4, 0.13, real(n) + difference, real(n));
            assert!(l.uniform_index().is_none());
            l
        };
        let stack = silicone_air(vec![patterned(0.3, 1.6), patterned(2.0, 1.2)]);
        for (kx0, ky) in BLOCHS {
            let bloch = Bloch::new(kx0, ky);
            let worst =
                largest_difference(&solve(&uniform_stack, bloch, 6), &solve(&stack, bloch, 6));
            assert!(worst < 1e-10, "{difference} at ({kx0}, {ky}): {worst:.1e}");
        }
    }
}

#[test]
fn a_little_absorption_is_nearly_none() {
    // The general complex solver against the symmetric one.
    let lossless = silicone_air(asymmetric(0.0));
    let lossy = silicone_air(asymmetric(1e-13));
    for (kx0, ky) in BLOCHS {
        let bloch = Bloch::new(kx0, ky);
        let difference = largest_difference(&solve(&lossless, bloch, 8), &solve(&lossy, bloch, 8));
        assert!(difference < 1e-10, "({kx0}, {ky}): {difference:.1e}");
    }
}

fn all_finite(scattering: &Scattering) -> bool {
    let all = waves(scattering);
    all.iter().all(|&from| all.iter().all(|&to| scattering.amplitude(from, to).is_finite()))
}

#[test]
fn exact_cut_offs_are_survived() {
    // λ = 1, Λ = 10, n = 1.5: orders ±15 have kx = ±1.5 and kz = 0, to the last bit; 1.3 at kx0 =
    // 0.5 the same.
    let patterns = [
        vec![ridge(0.4, 0.5, 0.2, real(1.5), real(1.0))],
        vec![uniform(0.2, 1.5), ridge(0.4, 0.3, 0.2, real(1.7), real(1.0)), uniform(7.0, 1.5)],
        vec![uniform(0.01, 1.5)],
    ];
    for layers in patterns {
        for (n_top, n_bottom) in [(1.5, 1.0), (1.0, 1.5), (1.5, 1.5), (1.6, 1.2)] {
            let stack = Stack::new(1.0, 10.0, real(n_top), real(n_bottom), layers.clone()).unwrap();
            for kx0 in [0.0, 0.5] {
                for ky in [0.0, 0.25] {
                    let scattering = solve(&stack, Bloch::new(kx0, ky), 21);
                    let what = format!("{n_top} to {n_bottom}, kx0 = {kx0}, ky = {ky}");
                    assert!(all_finite(&scattering), "{what}");
                    assert!(
                        balance(&scattering).abs() < 1e-10,
                        "{what}: {:.1e}",
                        balance(&scattering)
                    );
                }
            }
        }
    }
}

#[test]
fn passing_off_is_continuous() {
    // A wave in a half-space that is just cut off, and one just not: the others do not notice the
    // difference.
    let lamella = vec![ridge(0.4, 0.3, 0.2, real(1.7), real(1.0))];
    let stack = Stack::new(1.0, 10.0, real(1.5), real(1.0), lamella).unwrap();
    let [below, at, above] =
        [-1e-13, 0.0, 1e-13].map(|kx0| solve(&stack, Bloch::new(kx0, 0.0), 18));
    for other in [&below, &above] {
        for m in at.orders(Side::Bottom) {
            for pol in Pol::BOTH {
                let from = (Side::Top, 0, pol);
                let (a, b) = (
                    at.efficiency(from, (Side::Bottom, m)),
                    other.efficiency(from, (Side::Bottom, m)),
                );
                // kz = sqrt(2 · 1.5 · 1e-13) = 5e-7.
                assert_near(&format!("order {m}"), a, b, 2e-6);
            }
        }
    }
}

#[test]
fn directions_of_the_worked_example() {
    let stack = silicone_air(vec![ridge(0.2, 0.5, 0.2, real(1.41), real(1.0))]);
    let scattering = solve(&stack, support::from_top(&stack, 33.0, 40.0), 6);
    let expected = [
        (Side::Top, -3, &[0.440_762, 1.158_684, 1.320_574, 1.182_526, 0.553_086][..]),
        (Side::Bottom, -2, &[0.595_357, 0.869_376, 0.640_521][..]),
    ];
    for (side, first, kz) in expected {
        let channels = scattering.channels(side);
        assert_eq!(channels.len(), kz.len());
        for ((channel, kz), m) in channels.iter().zip(kz).zip(first..) {
            assert_eq!(channel.order, m);
            assert_near("ky", channel.ky, 0.493_623, 1e-6);
            assert_near("kz", channel.kz.re, *kz, 1e-6);
        }
    }
    let kx = [-0.633_945, -0.022_834, 0.588_277, 1.199_388];
    for (channel, kx) in scattering.channels(Side::Top)[1..].iter().zip(kx) {
        assert_near("kx", channel.kx, kx, 1e-6);
    }
}

/// Transmittance of Lambertian light from either side, s and p alike: ∫ T dkx dky / (π n²).
fn diffuse_transmittance(
    interface: &Interface,
    per_zone: usize,
    lines: usize,
    highest: usize,
) -> [f64; 2] {
    let n = [interface.n_top.re, interface.n_bottom.re];
    let largest = n[0].max(n[1]);
    let dky = largest / lines as f64;
    let directions = Directions {
        kx_per_zone: per_zone,
        ky: (0..lines).map(|i| (i as f64 + 0.5) * dky).collect(),
    };
    let resolution = Resolution {
        truncation: Truncation::new(highest).unwrap(),
        plan: interface.relief.slice_plan(1),
    };
    let solved = hemisphere(interface, &directions, &resolution, &no_progress).unwrap();
    let cell = 2.0 * dky * interface.order_spacing() / per_zone as f64;
    let mut sums = [0.0; 2];
    for incidence in &solved.incidences {
        let from = usize::from(incidence.side == Side::Bottom);
        let through = incidence.efficiencies.iter().filter(|s| s.0 != incidence.side).map(|s| s.2);
        sums[from] += 0.5 * cell * through.sum::<f64>() / (std::f64::consts::PI * n[from].powi(2));
    }
    sums
}

#[test]
fn diffuse_light_passes_both_ways_by_the_squares_of_the_indices() {
    let outputs = &support::case("analytic.json", "analytic/diffuse_reciprocity")["outputs"];
    let interface = Interface {
        relief: shapes::lamellar(PERIOD, 0.4, 0.5, Materials::lossless(1.41, 1.0)).unwrap(),
        wavelength: WAVELENGTH,
        n_top: real(1.41),
        n_bottom: real(1.0),
    };
    let [out, into] = diffuse_transmittance(&interface, 16, 48, 7);
    assert_near("n² T", 1.41_f64.powi(2) * out, into, 1e-10);
    assert!(out < 1.0 / 1.41_f64.powi(2));
    for (key, value) in [("T_hemi_dense_to_air", out), ("T_hemi_air_to_dense", into)] {
        let expected = support::number(&outputs[key]);
        assert_near(key, value, expected, 3e-3 * expected);
    }
}
