// SPDX-License-Identifier: MIT OR Apache-2.0
//! Coefficients against quadrature and the laws of Fourier series; centres of symmetry.

use approx::assert_abs_diff_eq;
use num_complex::Complex64;

use super::symmetry_centre;
use crate::relief::Segment;

const MAX: usize = 40;

fn coefficients_about(
    segments: &[Segment],
    value: impl Fn(Complex64) -> Complex64,
    max: usize,
    centre: f64,
) -> Vec<Complex64> {
    let [c] = super::coefficients(segments, |index| [value(index)], max, centre);
    c
}

fn coefficients(
    segments: &[Segment],
    value: impl Fn(Complex64) -> Complex64,
    max: usize,
) -> Vec<Complex64> {
    coefficients_about(segments, value, max, 0.0)
}

/// Segments of the given widths (the last one fills up) and indices.
fn segments(widths: &[f64], indices: &[Complex64]) -> Vec<Segment> {
    let mut x0 = 0.0;
    let mut list = Vec::new();
    for (i, &index) in indices.iter().enumerate() {
        let x1 = widths.get(i).map_or(1.0, |w| x0 + w);
        list.push(Segment { x0, x1, index });
        x0 = x1;
    }
    list
}

fn real(indices: &[f64]) -> Vec<Complex64> {
    indices.iter().map(|&n| n.into()).collect()
}

fn lossy() -> Vec<Segment> {
    let indices =
        [Complex64::new(1.41, 0.0), Complex64::new(0.06, 3.586), Complex64::new(1.0, 0.0)];
    segments(&[0.23, 0.381], &indices)
}

fn permittivity(index: Complex64) -> Complex64 {
    index * index
}

/// The same segments moved by `dx`, wrapped at the period.
fn shifted(list: &[Segment], dx: f64) -> Vec<Segment> {
    let mut moved: Vec<Segment> = list
        .iter()
        .flat_map(|s| {
            let (a, b) = (s.x0 + dx, s.x1 + dx);
            let parts = if b <= 1.0 {
                vec![(a, b)]
            } else if a >= 1.0 {
                vec![(a - 1.0, b - 1.0)]
            } else {
                vec![(a, 1.0), (0.0, b - 1.0)]
            };
            parts.into_iter().map(|(x0, x1)| Segment { x0, x1, index: s.index })
        })
        .collect();
    moved.sort_by(|a, b| a.x0.total_cmp(&b.x0));
    moved
}

/// ∫ f(x) exp(-2πi n x) dx by Gauss-Legendre of three points on many panels of each segment.
fn quadrature(list: &[Segment], n: i32) -> Complex64 {
    const PANELS: usize = 2000;
    let (node, inner, outer) = (0.6_f64.sqrt(), 8.0 / 18.0, 5.0 / 18.0);
    let mut sum = Complex64::ZERO;
    for s in list {
        let h = s.width() / PANELS as f64;
        for panel in 0..PANELS {
            let middle = s.x0 + (panel as f64 + 0.5) * h;
            for (x, w) in [
                (middle, inner),
                (middle - 0.5 * h * node, outer),
                (middle + 0.5 * h * node, outer),
            ] {
                sum += permittivity(s.index)
                    * w
                    * h
                    * Complex64::cis(-std::f64::consts::TAU * f64::from(n) * x);
            }
        }
    }
    sum
}

fn largest_difference(a: &[Complex64], b: &[Complex64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
}

#[test]
fn coefficients_are_the_integrals_they_are_defined_as() {
    let c = coefficients(&lossy(), permittivity, MAX);
    let integrals: Vec<_> = (-40..=40).map(|n| quadrature(&lossy(), n)).collect();
    let difference = largest_difference(&c, &integrals);
    assert!(difference < 5e-12, "{difference:e}");
}

#[test]
fn power_is_kept_as_parseval_says() {
    // What is beyond the highest order M is about Σ|jump|²/(2π² M).
    let max = 20_000;
    let list = lossy();
    let c = coefficients(&list, permittivity, max);
    let series: f64 = c.iter().map(Complex64::norm_sqr).sum();
    let integral: f64 = list.iter().map(|s| s.width() * permittivity(s.index).norm_sqr()).sum();
    let jumps: f64 = (0..list.len())
        .map(|i| {
            (permittivity(list[i].index) - permittivity(list[(i + 1) % list.len()].index))
                .norm_sqr()
        })
        .sum();
    let tail = jumps / (2.0 * std::f64::consts::PI.powi(2) * max as f64);
    assert_abs_diff_eq!(series + tail, integral, epsilon = 0.05 * tail);
}

#[test]
fn a_shift_turns_the_phases_only() {
    let (list, dx) = (lossy(), 0.37);
    let c = coefficients(&list, permittivity, MAX);
    let moved = coefficients(&shifted(&list, dx), permittivity, MAX);
    let turned: Vec<_> = (-40..=40)
        .zip(&c)
        .map(|(n, c)| c * Complex64::cis(-std::f64::consts::TAU * f64::from(n) * dx))
        .collect();
    assert!(largest_difference(&moved, &turned) < 1e-14);
    // The same by moving the origin.
    let about = coefficients_about(&shifted(&list, dx), permittivity, MAX, dx);
    assert!(largest_difference(&about, &c) < 1e-14);
}

#[test]
fn real_values_give_conjugate_pairs_to_the_last_bit() {
    let list = segments(&[0.123, 0.4], &real(&[1.41, 1.0, 1.7]));
    let c = coefficients(&list, permittivity, MAX);
    for n in 0..=MAX {
        assert_eq!(c[MAX - n], c[MAX + n].conj());
    }
}

#[test]
fn a_uniform_layer_has_no_orders_at_all() {
    let c = coefficients(&segments(&[0.123, 0.4], &real(&[1.41, 1.41, 1.41])), permittivity, MAX);
    assert_eq!(c[MAX], permittivity(1.41.into()));
    assert!(c.iter().enumerate().all(|(i, c)| i == MAX || *c == Complex64::ZERO));
}

#[test]
fn a_half_filled_period_has_no_even_orders() {
    let c = coefficients(&segments(&[0.5], &real(&[1.41, 1.0])), permittivity, MAX);
    for n in (2..=MAX).step_by(2) {
        assert_eq!(c[MAX + n], Complex64::ZERO);
    }
    // c_1 = (ε1 - ε2)/(iπ) for a ridge from 0 to 1/2.
    let expected = Complex64::new(0.0, -(1.41 * 1.41 - 1.0) / std::f64::consts::PI);
    assert!((c[MAX + 1] - expected).norm() < 1e-15);
}

#[test]
fn a_sliver_keeps_its_relative_accuracy() {
    let width = 1e-11;
    let c = coefficients(&segments(&[0.3, width], &real(&[1.0, 2.0, 1.0])), permittivity, MAX);
    for n in 1..=MAX {
        // sin(πnw)/(πn) is w to 1 part in 1e18 here; what is left is the rounding of x1 - x0.
        assert!((c[MAX + n].norm() / (3.0 * width) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn one_and_two_materials_in_a_row_have_a_centre() {
    let approx = |list: &[Segment], centre: f64| {
        assert_abs_diff_eq!(symmetry_centre(list).unwrap(), centre, epsilon = 1e-14);
    };
    approx(&segments(&[], &real(&[1.4])), 0.0);
    approx(&segments(&[0.3], &real(&[1.4, 1.0])), 0.15);
    approx(&segments(&[0.2, 0.5], &real(&[1.0, 1.4, 1.0])), 0.95);
    assert_eq!(symmetry_centre(&[]), None);
}

#[test]
fn symmetric_layers_of_many_segments_are_recognised_wherever_they_lie() {
    let coated = segments(&[0.1, 0.2, 0.1], &real(&[2.0, 1.4, 2.0, 1.0]));
    for dx in [0.0, 0.05, 0.13, 0.3, 0.71, 0.99] {
        let centre = symmetry_centre(&shifted(&coated, dx)).unwrap();
        assert!(symmetric_about(&shifted(&coated, dx), centre), "{dx}: {centre}");
    }
    let two_ridges = segments(&[0.2, 0.1, 0.2], &real(&[1.4, 1.0, 1.4, 1.0]));
    assert!(symmetric_about(&two_ridges, symmetry_centre(&two_ridges).unwrap()));
}

/// True where the coefficients about the centre are even in n.
fn symmetric_about(list: &[Segment], centre: f64) -> bool {
    let c = coefficients_about(list, permittivity, MAX, centre);
    (1..=MAX).all(|n| (c[MAX + n] - c[MAX - n]).norm() < 1e-13)
}

#[test]
fn asymmetric_layers_have_no_centre() {
    for (widths, indices) in [
        (vec![0.2, 0.3], vec![1.4, 2.0, 1.0]),
        (vec![0.1, 0.2, 0.1], vec![2.0, 1.4, 1.7, 1.0]),
        (vec![0.1, 0.2, 0.1 + 1e-11], vec![2.0, 1.4, 2.0, 1.0]),
        (vec![0.2, 0.1, 0.3], vec![1.4, 1.0, 1.5, 1.0]),
    ] {
        let list = segments(&widths, &real(&indices));
        assert_eq!(symmetry_centre(&list), None, "{list:?}");
    }
}
