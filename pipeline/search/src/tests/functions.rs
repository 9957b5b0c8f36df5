// SPDX-License-Identifier: MIT OR Apache-2.0
//! Test functions: those of BBOB with the optimum at a place of ours, and a value of 0 there.
//!
//! \[BBOB\] N. Hansen, S. Finck, R. Ros, A. Auger, *Real-parameter black-box optimization
//! benchmarking 2009: noiseless functions definitions*, INRIA RR-6829, and *noisy functions
//! definitions*, RR-6869. \[Hansen, Kern 2004\] N. Hansen, S. Kern, *Evaluating the CMA evolution
//! strategy on multimodal test functions*, PPSN VIII, 282.

use std::f64::consts::TAU;

/// x - x_opt, with x_opt_i = 3 cos i.
fn from_optimum(x: &[f64]) -> impl Iterator<Item = f64> + '_ {
    (1..).zip(x).map(|(i, x)| x - 3.0 * f64::from(i).cos())
}

/// i/(n - 1), for i = 0 to n - 1.
fn fractions(n: usize) -> impl Iterator<Item = f64> {
    (0..n).map(move |i| i as f64 / (n - 1) as f64)
}

/// T_osz of [BBOB], section 0.2.
fn oscillated(x: f64) -> f64 {
    if x == 0.0 {
        return 0.0;
    }
    let (c1, c2) = if x > 0.0 { (10.0, 7.9) } else { (5.5, 3.1) };
    let log = x.abs().ln();
    x.signum() * (log + 0.049 * ((c1 * log).sin() + (c2 * log).sin())).exp()
}

/// f1.
pub(super) fn sphere(x: &[f64]) -> f64 {
    from_optimum(x).map(|z| z * z).sum()
}

/// f2, condition 1e6.
pub(super) fn ellipsoid(x: &[f64]) -> f64 {
    let squares = from_optimum(x).map(|z| oscillated(z).powi(2));
    let scales = fractions(x.len()).map(|f| 10f64.powf(6.0 * f));
    squares.zip(scales).map(|(square, scale)| square * scale).sum()
}

/// f5 in [-5, 5]^n: slopes from 1 to 10, the optimum in the corner of the signs of cos i.
pub(super) fn linear_slope(x: &[f64]) -> f64 {
    let one = |((i, &x), f): ((i32, &f64), f64)| {
        let sign = f64::from(i).cos().signum();
        let z = if sign * x < 5.0 { x } else { 5.0 * sign };
        10f64.powf(f) * (5.0 - sign * z)
    };
    (1..).zip(x).zip(fractions(x.len())).map(one).sum()
}

/// f8.
pub(super) fn rosenbrock(x: &[f64]) -> f64 {
    let scale = ((x.len() as f64).sqrt() / 8.0).max(1.0);
    let z: Vec<f64> = from_optimum(x).map(|z| scale * z + 1.0).collect();
    let pair = |z: &[f64]| 100.0 * (z[0] * z[0] - z[1]).powi(2) + (z[0] - 1.0).powi(2);
    z.windows(2).map(pair).sum()
}

/// Value of f101 where the sphere is `sphere`: moderate Gaussian noise, `normal` a normal number.
pub(super) fn moderate_noise(sphere: f64, normal: f64) -> f64 {
    if sphere < 1e-8 {
        return sphere;
    }
    sphere * (0.01 * normal).exp() + 1.01e-8
}

/// Rastrigin's function as in [Hansen, Kern 2004]: the optimum at 0, some 10^n minima.
pub(super) fn rastrigin(x: &[f64]) -> f64 {
    x.iter().map(|x| 10.0 + x * x - 10.0 * (TAU * x).cos()).sum()
}
