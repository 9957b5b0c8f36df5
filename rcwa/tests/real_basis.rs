// SPDX-License-Identifier: MIT OR Apache-2.0
//! Self-mirror Bloch wavevectors in real arithmetic against running waves in complex arithmetic.

use num_complex::Complex64;
use rcwa::hemisphere::{Interface, Resolution};
use rcwa::no_progress;
use rcwa::relief::{Layer, Polygon, Relief, Segment};
use rcwa::solve::{solve_line, solve_symmetric_line};
use rcwa::{Pol, Scattering, Side, Stack, SymmetricBloch, Truncation};

fn stack(n_top: f64, n_bottom: f64, period: f64, layers: Vec<Layer>) -> Stack {
    Stack::new(0.55, period, n_top.into(), n_bottom.into(), layers).expect("valid")
}

fn layer(thickness: f64, ends: &[(f64, f64)]) -> Layer {
    let mut x0 = 0.0;
    let segments = ends.iter().map(|&(x1, n)| {
        let segment = Segment { x0, x1, index: Complex64::from(n) };
        x0 = x1;
        segment
    });
    Layer::new(thickness, segments.collect()).expect("valid")
}

/// Largest difference of any amplitude.
fn difference(a: &Scattering, b: &Scattering) -> f64 {
    let mut worst = 0.0_f64;
    let sides = [Side::Top, Side::Bottom];
    for (from, to) in sides.into_iter().flat_map(|f| sides.map(|t| (f, t))) {
        assert!(a.orders(from).eq(b.orders(from)));
        for m in a.orders(from) {
            for n in a.orders(to) {
                for (p, q) in Pol::BOTH.into_iter().flat_map(|p| Pol::BOTH.map(|q| (p, q))) {
                    let of = |s: &Scattering| s.amplitude((from, m, p), (to, n, q));
                    worst = worst.max((of(a) - of(b)).norm());
                }
            }
        }
    }
    worst
}

const KY: [f64; 5] = [0.0, 0.21, 0.77, 1.13, 1.38];

/// At kx0 = 0 both ways keep the same orders; of stacks that are their own mirror image both ways
/// would be one.
fn same_at_centre(stack: &Stack, highest: usize, tolerance: f64) {
    let truncation = Truncation::new(highest).expect("valid");
    let real = solve_symmetric_line(stack, SymmetricBloch::Centre, &KY, truncation, &no_progress)
        .expect("solves");
    let complex = solve_line(stack, 0.0, &KY, truncation, &no_progress).expect("solves");
    for ((a, b), ky) in real.iter().zip(&complex).zip(KY) {
        let difference = difference(a, b);
        assert!(difference < tolerance, "ky = {ky}: amplitudes differ by {difference:e}");
    }
}

#[test]
fn layer_without_symmetry() {
    let ends = [(0.2, 1.9), (0.35, 1.0), (0.7, 1.3), (1.0, 1.0)];
    same_at_centre(
        &stack(1.0, 1.52, 2.7, vec![layer(0.25, &ends), layer(0.1, &[(0.4, 1.2), (1.0, 2.0)])]),
        11,
        1e-11,
    );
}

#[test]
fn slanted_relief_with_many_slices() {
    let tooth = Polygon { index: 1.41.into(), points: vec![[0.0, 0.0], [5.0, 0.0], [4.5, 2.0]] };
    let relief = Relief::new(5.0, 2.0, 1.0.into(), vec![tooth]).expect("valid");
    same_at_centre(&stack(1.41, 1.0, 5.0, relief.slices(60)), 20, 1e-10);
}

/// At the edge of the zone the sets of orders differ by one that hardly matters.
#[test]
fn edge_of_the_zone_converges_to_the_same() {
    let ends = [(0.13, 1.0), (0.57, 1.41), (0.7, 1.2), (1.0, 1.0)];
    let stack = stack(1.41, 1.0, 2.2, vec![layer(0.014, &ends); 12]);
    let kx0 = SymmetricBloch::Edge.kx0(&stack);
    let mut last = f64::INFINITY;
    for highest in [10, 40, 120] {
        let truncation = Truncation::new(highest).expect("valid");
        let real =
            solve_symmetric_line(&stack, SymmetricBloch::Edge, &KY, truncation, &no_progress)
                .expect("solves");
        let complex = solve_line(&stack, kx0, &KY, truncation, &no_progress).expect("solves");
        let worst = real.iter().zip(&complex).map(|(a, b)| difference(a, b)).fold(0.0, f64::max);
        assert!(worst < last / 4.0, "M = {highest}: {worst:e} after {last:e}");
        last = worst;
    }
    assert!(last < 1e-4, "{last:e}");
}

/// Slices that follow their sides, with corrections for strips and walls; out of the plane these do
/// not commute.
#[test]
fn followed_slices_are_the_same_in_real_and_in_complex_numbers_and_near_thinner_ones() {
    let tooth =
        Polygon { index: Complex64::from(1.41), points: vec![[0.0, 0.0], [2.3, 0.8], [3.0, 0.0]] };
    let interface = Interface {
        relief: Relief::new(3.0, 0.8, Complex64::from(1.0), vec![tooth]).expect("valid"),
        wavelength: 0.55,
        n_top: Complex64::from(1.41),
        n_bottom: Complex64::from(1.0),
    };
    let truncation = Truncation::new(13).expect("valid");
    let stack = |slices: usize| {
        let resolution = Resolution { truncation, plan: interface.relief.slice_plan(slices) };
        let (stack, other) = interface.stacks(&resolution).expect("valid");
        assert!(other.is_none());
        stack
    };
    same_at_centre(&stack(9), 13, 1e-9);
    let run = |slices: usize| {
        solve_symmetric_line(&stack(slices), SymmetricBloch::Centre, &KY, truncation, &no_progress)
            .expect("solves")
    };
    let (coarse, middle, fine) = (run(9), run(18), run(72));
    for (i, ky) in KY.into_iter().enumerate() {
        let [nine, eighteen] = [&coarse, &middle].map(|run| difference(&run[i], &fine[i]));
        assert!(nine < 4e-2 && eighteen < 0.3 * nine, "ky = {ky}: {nine:.1e}, {eighteen:.1e}");
    }
}
