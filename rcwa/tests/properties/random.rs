// SPDX-License-Identifier: MIT OR Apache-2.0
//! Random structures and wavevectors, and how a law is checked on them: the same cases in every
//! run, no files, the failing input printed.
//!
//! The wavelength is 1, so lengths are in wavelengths.

use num_complex::Complex64;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};
use rcwa::relief::{Layer, Polygon, Relief, Segment};
use rcwa::{Bloch, Pol, Scattering, Side, Stack, Truncation};
use std::f64::consts::TAU;

/// A law on one case.
pub type Verdict = Result<(), TestCaseError>;

/// Checks `law` on `cases` random inputs.
pub fn check<S: Strategy>(cases: u32, inputs: &S, law: impl Fn(S::Value) -> Verdict) {
    let config = Config {
        cases,
        failure_persistence: None,
        max_shrink_iters: 300,
        max_global_rejects: 4 * cases,
        ..Config::default()
    };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    if let Err(failure) = TestRunner::new_with_rng(config, rng).run(inputs, law) {
        panic!("{failure}");
    }
}

/// `what` must not exceed `allowed` in magnitude; NaN does.
pub fn small(what: &str, got: f64, allowed: f64) -> Verdict {
    if got.abs() <= allowed {
        Ok(())
    } else {
        Err(TestCaseError::fail(format!("{what}: {got:.3e}, allowed {allowed:.0e}")))
    }
}

/// What fills a structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fill {
    /// Real indices from 1 to 3.
    Dielectric,
    /// The same, and purely imaginary indices: permittivities from -9 to -0.1, without loss.
    Plasma,
    /// Real and complex indices, weak and strong absorption.
    Absorbing,
}

pub fn index(fill: Fill) -> BoxedStrategy<Complex64> {
    let dielectric = (1.0..3.0_f64).prop_map(Complex64::from);
    match fill {
        Fill::Dielectric => dielectric.boxed(),
        Fill::Plasma => {
            let plasma = (0.3..3.0_f64).prop_map(|k| Complex64::new(0.0, k));
            prop_oneof![2 => dielectric, 1 => plasma].boxed()
        }
        Fill::Absorbing => {
            let weak = (1.0..3.0_f64, -8.0..-1.0_f64)
                .prop_map(|(n, log)| Complex64::new(n, 10_f64.powf(log)));
            let strong = (0.1..3.0_f64, 0.1..5.0_f64).prop_map(|(n, k)| Complex64::new(n, k));
            prop_oneof![1 => dielectric, 1 => weak, 1 => strong].boxed()
        }
    }
}

/// Segments of these widths, scaled to fill the period.
pub fn segments(parts: &[(f64, Complex64)]) -> Vec<Segment> {
    let whole: f64 = parts.iter().map(|p| p.0).sum();
    let (mut x0, mut sum) = (0.0, 0.0);
    let count = parts.len();
    let ends = parts.iter().enumerate().map(|(i, &(width, index))| {
        sum += width / whole;
        let x1 = if i + 1 == count { 1.0 } else { sum };
        let segment = Segment { x0, x1, index };
        x0 = x1;
        segment
    });
    ends.collect()
}

fn parts(fill: Fill) -> impl Strategy<Value = Vec<(f64, Complex64)>> {
    prop::collection::vec((0.1..1.0_f64, index(fill)), 1..=4)
}

/// Up to three layers of up to four segments.
fn lamellae(fill: Fill) -> impl Strategy<Value = Vec<Layer>> {
    let layer = (0.01..1.2_f64, parts(fill))
        .prop_map(|(thickness, parts)| Layer::new(thickness, segments(&parts)).unwrap());
    prop::collection::vec(layer, 1..=3)
}

/// A sawtooth of period 1, its apex anywhere, overhanging too, in up to six slices.
fn sawtooth(fill: Fill) -> impl Strategy<Value = Vec<Layer>> {
    let apex = (-0.3..1.3_f64, 0.1..1.5_f64);
    (apex, index(fill), index(fill), 1..=6_usize).prop_map(|((x, depth), ridge, groove, count)| {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [x, depth]];
        let tooth = Polygon { index: ridge, points };
        Relief::new(1.0, depth, groove, vec![tooth]).unwrap().slices(count)
    })
}

/// A polygon of three to seven corners around its centre, wrapped at the period 1, in up to four
/// slices or more if it has more corners.
pub fn polygon(fill: Fill) -> impl Strategy<Value = Relief> {
    let corner = (0.05..0.95_f64, 0.3..1.0_f64);
    let corners = prop::collection::vec(corner, 3..=7);
    (corners, 0.1..1.5_f64, 0.0..1.0_f64, index(fill), index(fill)).prop_map(
        |(corners, depth, x, inside, outside)| {
            let count = corners.len() as f64;
            // One corner in each sector, so that the outline cannot cross itself.
            let of = |(i, &(turn, radius)): (usize, &(f64, f64))| {
                let (sin, cos) = (TAU * (i as f64 + turn) / count).sin_cos();
                [x + 0.6 * radius * cos, 0.5 * depth * (1.0 + radius * sin)]
            };
            let points = corners.iter().enumerate().map(of).collect();
            let polygon = Polygon { index: inside, points };
            Relief::new(1.0, depth, outside, vec![polygon]).unwrap()
        },
    )
}

/// Layers of any kind, lengths along x in periods.
pub fn layers(fill: Fill) -> BoxedStrategy<Vec<Layer>> {
    let polygons = (polygon(fill), 1..=4_usize).prop_map(|(relief, count)| relief.slices(count));
    prop_oneof![2 => lamellae(fill), 1 => sawtooth(fill), 1 => polygons].boxed()
}

/// Layers and what lies around them, in periods from deep below the wavelength to several of it.
pub fn stack(fill: Fill) -> BoxedStrategy<Stack> {
    between(layers(fill))
}

/// These layers between random half-spaces without loss.
pub fn between(layers: impl Strategy<Value = Vec<Layer>> + 'static) -> BoxedStrategy<Stack> {
    let around = (1.0..2.5_f64, 1.0..2.5_f64);
    (0.2..3.0_f64, around, layers)
        .prop_map(|(period, (top, bottom), layers)| {
            Stack::new(1.0, period, top.into(), bottom.into(), layers).unwrap()
        })
        .boxed()
}

/// A mirror-symmetric structure: every layer reads the same from both ends.
pub fn mirror_symmetric(fill: Fill) -> BoxedStrategy<Stack> {
    let symmetric = (0.01..1.2_f64, parts(fill)).prop_map(|(thickness, mut parts)| {
        let back: Vec<_> = parts.iter().rev().copied().collect();
        parts.extend(back);
        Layer::new(thickness, segments(&parts)).unwrap()
    });
    between(prop::collection::vec(symmetric, 1..=3))
}

/// kx0 in order spacings and ky in units of k0, exact zeros and halves among them.
pub fn wavevector() -> impl Strategy<Value = (f64, f64)> {
    let kx0 = prop_oneof![4 => -1.0..1.0_f64, 1 => Just(0.0), 1 => Just(0.5), 1 => Just(-0.5)];
    let ky = prop_oneof![4 => -2.0..2.0_f64, 1 => Just(0.0)];
    (kx0, ky)
}

/// The wavevector in units of k0.
pub fn bloch(stack: &Stack, (kx0, ky): (f64, f64)) -> Bloch {
    Bloch::new(kx0 / stack.period_per_wavelength(), ky)
}

/// Highest orders kept.
pub fn highest() -> impl Strategy<Value = usize> {
    0..=6_usize
}

pub fn solve(stack: &Stack, bloch: Bloch, highest: usize) -> Result<Scattering, TestCaseError> {
    let truncation = Truncation::new(highest).unwrap();
    rcwa::solve(stack, bloch, truncation).map_err(|e| TestCaseError::fail(e.to_string()))
}

/// An incident or outgoing wave.
pub type Wave = (Side, i32, Pol);

/// Element of the scattering matrix between waves of unit power.
pub fn normalised(scattering: &Scattering, from: Wave, to: Wave) -> Complex64 {
    let flux = |(side, m, pol): Wave| {
        scattering.channel(side, m).unwrap().flux[usize::from(pol == Pol::P)]
    };
    scattering.amplitude(from, to) * (flux(to) / flux(from)).sqrt()
}

/// A half-space around a stack replaced.
pub fn with_bottom(stack: &Stack, index: Complex64) -> Stack {
    Stack::new(
        stack.wavelength(),
        stack.period(),
        stack.index(Side::Top),
        index,
        stack.layers().to_vec(),
    )
    .unwrap()
}

/// The same half-spaces and period around other layers.
pub fn with_layers(stack: &Stack, layers: Vec<Layer>) -> Stack {
    let n = [Side::Top, Side::Bottom].map(|side| stack.index(side));
    Stack::new(stack.wavelength(), stack.period(), n[0], n[1], layers).unwrap()
}
