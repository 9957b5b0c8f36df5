// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light from the top alone, and in the plane of incidence TE and TM apart, against the general
//! path, which light from both sides takes: the same amplitudes.

use crate::support::real;
use num_complex::Complex64;
use rcwa::relief::shapes::{self, Materials};
use rcwa::relief::{Layer, Segment};
use rcwa::{Bloch, Pol, Scattering, Side, Stack, Truncation, solve, solve_from_top};

/// Largest difference of an amplitude, for light from the top; nothing else has a source in `a`.
fn deviation(a: &Scattering, b: &Scattering) -> f64 {
    for order in b.orders(Side::Bottom) {
        assert!(a.source(Side::Bottom, order).is_none());
    }
    let mut worst = 0.0_f64;
    for order in b.orders(Side::Top) {
        for from in Pol::BOTH.map(|pol| (Side::Top, order, pol)) {
            for to in [Side::Top, Side::Bottom] {
                for out in b.orders(to) {
                    for to in Pol::BOTH.map(|pol| (to, out, pol)) {
                        worst = worst.max((a.amplitude(from, to) - b.amplitude(from, to)).norm());
                    }
                }
            }
        }
    }
    worst
}

/// Of slices thin and thick, with loss and metal, without any layer, and of a relief that is its
/// own mirror image.
fn stacks() -> Vec<(&'static str, Stack)> {
    let new =
        |n_bottom: Complex64, layers| Stack::new(0.55, 2.3, real(1.41), n_bottom, layers).unwrap();
    let step =
        |materials: Materials, slices| shapes::step(2.0, 1.1, materials).unwrap().slices(slices);
    let lossless = Materials::lossless(1.41, 1.0);
    let absorbing = Materials { ridge: Complex64::new(1.41, 0.03), groove: real(1.0) };
    let thick = |index: Complex64| {
        let segments = [(0.0, 0.37, index), (0.37, 1.0, real(1.0))];
        let segments = segments.map(|(x0, x1, index)| Segment { x0, x1, index });
        vec![Layer::new(1.7, segments.to_vec()).unwrap()]
    };
    let isosceles = shapes::triangle(2.3, [1.15, 1.1], lossless).unwrap().slices(16);
    vec![
        ("thin", new(real(1.0), step(lossless, 16))),
        ("few", new(real(1.0), step(lossless, 3))),
        ("dense below", new(real(1.8), step(lossless, 8))),
        ("absorbing", new(real(1.0), step(absorbing, 8))),
        ("absorbing below", new(Complex64::new(1.3, 0.1), step(lossless, 8))),
        ("thick", new(real(1.0), thick(real(1.6)))),
        ("metal", new(real(1.0), thick(Complex64::new(0.2, 3.1)))),
        ("nothing", new(real(1.0), vec![])),
        ("isosceles", new(real(1.0), isosceles)),
    ]
}

#[test]
fn light_from_the_top_is_the_same_alone() {
    for (what, stack) in stacks() {
        for (theta, phi) in [(0.0, 0.0), (0.0, 0.7), (0.6, 1.1), (1.3, 2.0), (0.4, 0.0)] {
            let bloch = Bloch::from_angles(&stack, Side::Top, theta, phi);
            let truncation = Truncation::new(9).unwrap();
            let both = solve(&stack, bloch, truncation).unwrap();
            let alone = solve_from_top(&stack, bloch, truncation).unwrap();
            let worst = deviation(&alone, &both);
            assert!(worst < 1e-12, "{what}, {theta}, {phi}: {worst:.1e}");
        }
    }
}

#[test]
fn in_the_plane_of_incidence_te_and_tm_apart_are_the_general_path() {
    for (what, stack) in stacks() {
        for kx0 in [0.0, 0.031, 0.4, -1.1] {
            let truncation = Truncation::new(11).unwrap();
            let planar = solve_from_top(&stack, Bloch::new(kx0, 0.0), truncation).unwrap();
            let general = solve(&stack, Bloch::new(kx0, 0.0), truncation).unwrap();
            let worst = deviation(&planar, &general);
            assert!(worst < 1e-12, "{what}, {kx0}: {worst:.1e}");
            for (from, to) in [(Pol::S, Pol::P), (Pol::P, Pol::S)] {
                for out in planar.orders(Side::Bottom) {
                    let crossed = planar.amplitude((Side::Top, 0, from), (Side::Bottom, out, to));
                    assert!(crossed.norm() < 1e-14, "{what}, {kx0}: {crossed}");
                }
            }
        }
    }
}
