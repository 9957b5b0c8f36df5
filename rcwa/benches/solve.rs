// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a user waits for, size swept: a slice (its modes and one step), a line of ky, a relief like
//! ring 75 of the paper.

use num_complex::Complex64;
use rcwa::no_progress;
use rcwa::relief::shapes::{self, Materials};
use rcwa::relief::{Layer, Segment};
use rcwa::solve::{solve_line, solve_symmetric_line};
use rcwa::{Bloch, Side, Stack, SymmetricBloch, Truncation};

fn main() {
    divan::main();
}

const SILICONE: Complex64 = Complex64::new(1.41, 0.0);
const AIR: Complex64 = Complex64::new(1.0, 0.0);

/// Treads of 10 µm, risers of 4.03 µm.
fn ring_75(slices: usize) -> Stack {
    let relief = shapes::step(10.0, 4.03, Materials::lossless(1.41, 1.0)).expect("valid");
    Stack::new(0.55, relief.period(), SILICONE, AIR, relief.slices(slices)).expect("valid")
}

/// One slice of the given walls and indices.
fn one_slice(ends: &[(f64, Complex64)]) -> Stack {
    let mut x0 = 0.0;
    let segments = ends.iter().map(|&(x1, index)| {
        let segment = Segment { x0, x1, index };
        x0 = x1;
        segment
    });
    let layer = Layer::new(0.05, segments.collect()).expect("valid");
    Stack::new(0.55, 10.78, SILICONE, AIR, vec![layer]).expect("valid")
}

/// Spread over the silicone's hemisphere.
fn ky(count: usize) -> Vec<f64> {
    (0..count).map(|i| (i as f64 + 0.5) * 1.41 / count as f64).collect()
}

fn line(bencher: divan::Bencher<'_, '_>, stack: &Stack, highest: usize, lines: usize) {
    let ky = ky(lines);
    let truncation = Truncation::new(highest).expect("valid");
    bencher.bench(|| solve_line(stack, 0.0128, &ky, truncation, &no_progress).expect("solves"));
}

/// Real symmetric eigenproblems, one ky.
#[divan::bench(args = [30, 50, 80])]
fn slice_with_one_ridge(bencher: divan::Bencher<'_, '_>, highest: usize) {
    line(bencher, &one_slice(&[(0.3, SILICONE), (1.0, AIR)]), highest, 1);
}

/// Complex Hermitian eigenproblems, one ky.
#[divan::bench(args = [30, 50, 80])]
fn slice_without_symmetry(bencher: divan::Bencher<'_, '_>, highest: usize) {
    let ends = [(0.3, SILICONE), (0.5, AIR), (0.6, SILICONE), (1.0, AIR)];
    line(bencher, &one_slice(&ends), highest, 1);
}

/// General complex eigenproblems, one ky.
#[divan::bench(args = [30, 50, 80])]
fn absorbing_slice(bencher: divan::Bencher<'_, '_>, highest: usize) {
    let ends = [(0.3, Complex64::new(1.41, 0.01)), (1.0, AIR)];
    line(bencher, &one_slice(&ends), highest, 1);
}

/// Half-spaces only: what every problem costs besides its slices.
#[divan::bench(args = [30, 50, 80])]
fn no_slice(bencher: divan::Bencher<'_, '_>, highest: usize) {
    let stack = Stack::new(0.55, 10.78, SILICONE, AIR, vec![]).expect("valid");
    let truncation = Truncation::new(highest).expect("valid");
    bencher.bench(|| rcwa::solve(&stack, Bloch::new(0.0128, 0.3), truncation).expect("solves"));
}

/// The same line and orders in real arithmetic, for its ratio to the next.
#[divan::bench(args = [32, 48, 64], sample_count = 10)]
fn ring_75_eight_ky_real_basis(bencher: divan::Bencher<'_, '_>, highest: usize) {
    let stack = ring_75(6);
    let truncation = Truncation::new(highest).expect("valid");
    bencher.bench(|| {
        solve_symmetric_line(&stack, SymmetricBloch::Centre, &ky(8), truncation, &no_progress)
            .expect("solves")
    });
}

/// Eight ky share the eigenproblems of six slices.
#[divan::bench(args = [32, 48, 64], sample_count = 10)]
fn ring_75_eight_ky(bencher: divan::Bencher<'_, '_>, highest: usize) {
    line(bencher, &ring_75(6), highest, 8);
}

/// A triangle of 10 µm period and 3 µm height, 121 orders, 32 slices.
fn triangle() -> (Stack, Truncation) {
    let materials = Materials::lossless(1.41, 1.0);
    let relief = shapes::triangle(10.0, [5.0, 3.0], materials).expect("valid");
    let stack = Stack::new(0.55, 10.0, SILICONE, AIR, relief.slices(32)).expect("valid");
    (stack, Truncation::new(60).expect("valid"))
}

/// One direction from the silicone at 25°, azimuth 40°, s and p, and all others of its Bloch
/// wavevector.
#[divan::bench(sample_count = 8)]
fn one_direction(bencher: divan::Bencher<'_, '_>) {
    let (stack, truncation) = triangle();
    let bloch = Bloch::from_angles(&stack, Side::Top, 25_f64.to_radians(), 40_f64.to_radians());
    bencher.bench(|| rcwa::solve(&stack, bloch, truncation).expect("solves"));
}
