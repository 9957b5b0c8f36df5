// SPDX-License-Identifier: MIT OR Apache-2.0
//! The whole solver against brute force: Maxwell's equations of each layer as one dense system of
//! 4N first-order equations for (Ex, Ey, Hx, Hy), a matrix exponential, one linear system for the
//! amplitudes. No eigenproblem, no splitting into families, no recursion; it shares with the solver
//! only the factorisation rules and the orders.
//!
//! Exponentials grow, so only a few orders and thin layers can be compared this way.

use crate::support::{layer, real, ridge, solve, uniform, waves};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rcwa::orders::outgoing_kz;
use rcwa::relief::{Layer, Segment};
use rcwa::{Bloch, Pol, Side, Stack};
use std::f64::consts::TAU;

type Matrix = DMatrix<Complex64>;

/// Toeplitz matrix of a function of the index.
fn toeplitz(segments: &[Segment], size: usize, f: fn(Complex64) -> Complex64) -> Matrix {
    Matrix::from_fn(size, size, |i, j| {
        let m = i as f64 - j as f64;
        segments
            .iter()
            .map(|s| {
                let value = f(s.index);
                if i == j {
                    value * s.width()
                } else {
                    let primitive =
                        |x: f64| Complex64::cis(-TAU * m * x) / Complex64::new(0.0, -TAU * m);
                    value * (primitive(s.x1) - primitive(s.x0))
                }
            })
            .sum()
    })
}

/// d/dz of (Ex, Ey, Hx, Hy), divided by i, in units of k0.
fn equations(layer: &Layer, kx: &[f64], ky: f64) -> Matrix {
    let n = kx.len();
    let one = Matrix::identity(n, n);
    let k = Matrix::from_diagonal(&DVector::from_iterator(n, kx.iter().map(|&k| real(k))));
    let e = toeplitz(&layer.segments, n, |n| n * n);
    let inner = toeplitz(&layer.segments, n, |n| (n * n).inv()).try_inverse().unwrap();
    let e_inverse = e.clone().try_inverse().unwrap();
    let (y, y2) = (real(ky), real(ky * ky));
    let mut m = Matrix::zeros(4 * n, 4 * n);
    let mut set = |row: usize, column: usize, block: Matrix| {
        m.view_mut((row * n, column * n), (n, n)).copy_from(&block);
    };
    set(0, 2, &k * &e_inverse * y);
    set(0, 3, &one - &k * &e_inverse * &k);
    set(1, 2, &e_inverse * y2 - &one);
    set(1, 3, &e_inverse * &k * -y);
    set(2, 0, &k * -y);
    set(2, 1, &k * &k - &e);
    set(3, 0, inner - &one * y2);
    set(3, 1, &k * y);
    m
}

/// (Ex, Ey, Hx, Hy) of the wave of unit electric vector with kz of the given sign.
fn plane_wave(n: Complex64, kx: f64, bloch: Bloch, pol: Pol, sign: f64) -> [Complex64; 4] {
    let k = kx.hypot(bloch.ky);
    let (cos, sin) = if k == 0.0 { (1.0, 0.0) } else { (kx / k, bloch.ky / k) };
    let kz = outgoing_kz(n * n - k * k) * sign;
    match pol {
        Pol::S => [real(-sin), real(cos), -kz * cos, -kz * sin],
        Pol::P => [kz / n * cos, kz / n * sin, -n * sin, n * cos],
    }
}

/// Largest difference of any amplitude.
fn difference(stack: &Stack, bloch: Bloch, highest: usize) -> f64 {
    let n = 2 * highest + 1;
    let period = stack.period() / stack.wavelength();
    let order = |m: usize| m as i32 - highest as i32;
    let kx: Vec<f64> = (0..n).map(|m| bloch.kx0 + f64::from(order(m)) / period).collect();
    let mut transfer = Matrix::identity(4 * n, 4 * n);
    for layer in stack.layers() {
        let depth = TAU * layer.thickness / stack.wavelength();
        transfer = (equations(layer, &kx, bloch.ky) * Complex64::new(0.0, depth)).exp() * transfer;
    }
    let columns = |side: Side, sign: f64| {
        let mut out = Matrix::zeros(4 * n, 2 * n);
        for m in 0..n {
            for (p, pol) in Pol::BOTH.into_iter().enumerate() {
                let wave = plane_wave(stack.index(side), kx[m], bloch, pol, sign);
                for (component, value) in wave.into_iter().enumerate() {
                    out[(component * n + m, 2 * m + p)] = value;
                }
            }
        }
        out
    };
    // transfer (down + up r) = down' t (light from the top) and so on: all at once.
    let mut system = Matrix::zeros(4 * n, 4 * n);
    system.view_mut((0, 0), (4 * n, 2 * n)).copy_from(&(&transfer * columns(Side::Top, -1.0)));
    system.view_mut((0, 2 * n), (4 * n, 2 * n)).copy_from(&-columns(Side::Bottom, 1.0));
    let mut sources = Matrix::zeros(4 * n, 4 * n);
    sources.view_mut((0, 0), (4 * n, 2 * n)).copy_from(&-(&transfer * columns(Side::Top, 1.0)));
    sources.view_mut((0, 2 * n), (4 * n, 2 * n)).copy_from(&columns(Side::Bottom, -1.0));
    let answer = system.lu().solve(&sources).unwrap();

    let scattering = solve(stack, bloch, highest);
    let place = |(side, m, pol): (Side, i32, Pol)| {
        let offset = if side == Side::Top { 0 } else { 2 * n };
        offset + 2 * (m + highest as i32) as usize + usize::from(pol == Pol::P)
    };
    let all = waves(&scattering);
    assert!(!all.is_empty());
    let mut worst = 0.0_f64;
    for &from in all.iter().filter(|w| scattering.source(w.0, w.1).is_some()) {
        for &to in &all {
            let ours = scattering.amplitude(from, to);
            let theirs = answer[(place(to), place(from))];
            assert!(ours.is_finite() && theirs.is_finite());
            worst = worst.max((ours - theirs).norm());
        }
    }
    worst
}

fn check(what: &str, stack: &Stack, highest: usize) {
    let blochs = [(0.31, 0.22), (-0.31, -0.57), (0.31, 0.0), (0.0, 0.0), (0.0, 0.8), (0.5, 1.2)];
    for (kx0, ky) in blochs {
        let bloch = Bloch::new(kx0, ky);
        let worst = difference(stack, bloch, highest);
        assert!(worst < 2e-11, "{what} at ({kx0}, {ky}): {worst:.1e}");
    }
}

fn silicone_air(layers: Vec<Layer>) -> Stack {
    Stack::new(0.55, 0.9, real(1.41), real(1.0), layers).unwrap()
}

#[test]
fn lossless_layers_with_a_centre_of_symmetry() {
    let two = vec![
        ridge(0.2, 0.3, 0.21, real(1.41), real(1.0)),
        ridge(0.15, 0.62, 0.33, real(2.2), real(1.3)),
    ];
    check("lamellae", &silicone_air(two), 3);
}

#[test]
fn lossless_layers_without_symmetry() {
    let ends = [(0.15, real(1.0)), (0.4, real(1.8)), (0.85, real(1.3)), (1.0, real(2.1))];
    let stack = silicone_air(vec![layer(0.25, &ends), uniform(0.1, 1.2)]);
    check("four segments", &stack, 3);
}

#[test]
fn absorbing_layers_and_substrates() {
    let silver = Complex64::new(0.06, 3.586);
    let ends = [(0.15, silver), (0.4, real(1.8)), (1.0, Complex64::new(1.3, 0.2))];
    let layers =
        vec![layer(0.03, &ends), ridge(0.1, 0.5, 0.2, Complex64::new(1.5, 0.01), real(1.0))];
    check("metal", &silicone_air(layers.clone()), 3);
    let silicon = Complex64::new(4.08, 0.028);
    let stack = Stack::new(0.55, 0.9, real(1.0), silicon, layers).unwrap();
    check("absorbing substrate", &stack, 3);
}

#[test]
fn negative_permittivity_without_loss() {
    let plasma = Complex64::new(0.0, 1.7);
    let stack = silicone_air(vec![ridge(0.08, 0.4, 0.15, plasma, real(1.2))]);
    check("plasma", &stack, 3);
}

#[test]
fn modes_at_their_cut_off() {
    // Uniform: the orders ±1 of index 1.5 pass off at kx = ±1.5 exactly, so that four b are 0.
    let stack = Stack::new(1.5, 1.0, real(1.6), real(1.1), vec![uniform(0.3, 1.5)]).unwrap();
    for ky in [0.0, 1e-9, 1e-4, 0.3, 0.9] {
        let worst = difference(&stack, Bloch::new(0.0, ky), 2);
        assert!(worst < 1e-11, "uniform, ky = {ky}: {worst:.1e}");
    }
    // Weakly patterned: the same four modes, split a little, near 0 but not at it.
    for contrast in [1e-13, 1e-9, 1e-5, 1e-3, 1e-2] {
        let patterned = ridge(0.3, 0.5, 0.2, real(1.5 + contrast), real(1.5 - contrast));
        let stack = Stack::new(1.5, 1.0, real(1.6), real(1.1), vec![patterned]).unwrap();
        for ky in [0.0, 1e-9, 1e-4, 0.3, 0.9] {
            let worst = difference(&stack, Bloch::new(0.0, ky), 2);
            assert!(worst < 1e-11, "contrast {contrast}, ky = {ky}: {worst:.1e}");
        }
    }
}
