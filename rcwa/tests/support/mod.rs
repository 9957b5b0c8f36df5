// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the tests share: layers in a line, reference cases, comparisons that name what they
//! compare.
#![allow(dead_code, reason = "each test program uses a part of it")]

use num_complex::Complex64;
use rcwa::relief::{Layer, Polygon, Relief, Segment};
use rcwa::{Bloch, Pol, Scattering, Side, Stack, Truncation};
use serde_json::Value;

pub const SIDES: [Side; 2] = [Side::Top, Side::Bottom];

/// One case of a file of `data/reference/`.
#[expect(clippy::disallowed_methods, reason = "tests read the reference cases from their files")]
pub fn case(file: &str, id: &str) -> Value {
    let path = format!("{}/../data/reference/{file}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let document: Value = serde_json::from_str(&text).unwrap();
    let cases = document["cases"].as_array().unwrap();
    let found = cases.iter().find(|c| c["id"] == id);
    found.unwrap_or_else(|| panic!("no case {id} in {path}")).clone()
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// The members of an object, keys as numbers.
pub fn entries(value: &Value) -> Vec<(f64, Value)> {
    let object = value.as_object().unwrap_or_else(|| panic!("{value} is no object"));
    object.iter().map(|(k, v)| (k.parse().unwrap(), v.clone())).collect()
}

pub fn real(n: f64) -> Complex64 {
    Complex64::new(n, 0.0)
}

/// The relief with every x taken through `place`.
pub fn moved(relief: &Relief, place: impl Fn(f64) -> f64) -> Relief {
    let polygon = |p: &Polygon| {
        let points = p.points.iter().map(|[x, z]| [place(*x), *z]).collect();
        Polygon { index: p.index, points }
    };
    let polygons = relief.polygons().iter().map(polygon).collect();
    Relief::new(relief.period(), relief.depth(), relief.background(), polygons).unwrap()
}

/// A layer of segments given by where they end and their index.
pub fn layer(thickness: f64, ends: &[(f64, Complex64)]) -> Layer {
    let mut x0 = 0.0;
    let segments = ends
        .iter()
        .map(|&(x1, index)| {
            let segment = Segment { x0, x1, index };
            x0 = x1;
            segment
        })
        .collect();
    Layer::new(thickness, segments).unwrap()
}

pub fn uniform(thickness: f64, n: f64) -> Layer {
    Layer::uniform(thickness, real(n)).unwrap()
}

/// The index `inside` within `half` of `centre` (in periods), which must be 0 or such that the
/// ridge does not wrap.
pub fn ridge(
    thickness: f64,
    centre: f64,
    half: f64,
    inside: Complex64,
    outside: Complex64,
) -> Layer {
    if centre == 0.0 {
        layer(thickness, &[(half, inside), (1.0 - half, outside), (1.0, inside)])
    } else {
        layer(thickness, &[(centre - half, outside), (centre + half, inside), (1.0, outside)])
    }
}

pub fn solve(stack: &Stack, bloch: Bloch, highest: usize) -> Scattering {
    rcwa::solve(stack, bloch, Truncation::new(highest).unwrap()).unwrap()
}

/// Order 0 from the top at angles in degrees.
pub fn from_top(stack: &Stack, theta: f64, phi: f64) -> Bloch {
    Bloch::from_angles(stack, Side::Top, theta.to_radians(), phi.to_radians())
}

/// R + T - 1 of the incident wave where it is largest in magnitude.
pub fn balance(scattering: &Scattering) -> f64 {
    scattering.worst_balance().map_or(0.0, |w| w.3)
}

/// Every channel with its polarisation.
pub fn waves(scattering: &Scattering) -> Vec<(Side, i32, Pol)> {
    let mut all = Vec::new();
    for side in SIDES {
        for order in scattering.orders(side) {
            all.extend(Pol::BOTH.map(|pol| (side, order, pol)));
        }
    }
    all
}

/// Share of power of `from` that leaves in one channel and polarisation.
pub fn share(scattering: &Scattering, from: (Side, i32, Pol), to: (Side, i32, Pol)) -> f64 {
    scattering.efficiency_in(from, (to.0, to.1), to.2)
}

/// Largest difference of any element of the efficiency matrix.
pub fn largest_difference(a: &Scattering, b: &Scattering) -> f64 {
    let all = waves(a);
    assert_eq!(all, waves(b), "the same channels");
    let mut worst = 0.0_f64;
    for &from in &all {
        for &to in &all {
            let difference = (share(a, from, to) - share(b, from, to)).abs();
            assert!(difference.is_finite(), "{from:?} to {to:?}");
            worst = worst.max(difference);
        }
    }
    worst
}

#[track_caller]
pub fn assert_near(what: &str, got: f64, expected: f64, allowed: f64) {
    assert!(
        (got - expected).abs() <= allowed,
        "{what}: got {got:.15e}, expected {expected:.15e}, difference {:.1e}, allowed {allowed:.0e}",
        got - expected
    );
}
