// SPDX-License-Identifier: MIT OR Apache-2.0
//! The correction of slanted walls in Ey: the permittivity in strips along the sides (4.1).
//!
//! Ey is continuous, so that the difference of the two matrices is that of the Fourier coefficients
//! of ε, which differ in narrow strips: a sum over points x of each,
//!
//! - ΔE_L = Σ w Δε u u*,   u the functions of the expansion at x,
//!
//! with the points and weights w of Gauss. Its flow adds to Hx what ΔE_L makes of Ey, a change of
//! small rank that keeps the flux of power to the last bit.

use super::Basis;
use crate::expansion::Expansion;
use crate::linalg::{Scalar, mul, transpose};
use crate::relief::{SAME_PLACE, Strip};
use faer::Mat;
use std::f64::consts::PI;

/// Points across a strip: the first number, and the second for each radian of the phase of the
/// highest order over half of it. That order is then right to 4e-4 of a strip, lower ones to more
/// digits.
const MIN_POINTS: f64 = 1.8;
const POINTS_PER_RADIAN: f64 = 0.8;

/// The change of coordinates by strips.
#[derive(Clone, Debug)]
pub(crate) struct StripFlow<T> {
    /// Ey at the points by ey and by -ky ex, transposed: (N, points).
    pub(super) reads: [Mat<T>; 2],
    /// Their conjugates times the gain: (points, N).
    pub(super) writes: [Mat<T>; 2],
}

impl<T: Scalar> StripFlow<T> {
    /// The identity, for so many coordinates of X and of Z.
    pub(super) fn none([x, z]: [usize; 2]) -> Self {
        Self { reads: [z, x].map(|n| Mat::zeros(n, 0)), writes: [z, x].map(|n| Mat::zeros(0, n)) }
    }

    /// Over the height `d` (times k0); `None` if there are none.
    pub(crate) fn new(
        expansion: &impl Expansion<T>,
        strips: &[Strip],
        basis: &Basis<T>,
        d: f64,
    ) -> Option<Self> {
        let (mut functions, mut gains) = (Vec::new(), Vec::new());
        let folded = expansion.counts_mirror_image().then(|| folded(strips, expansion.origin()));
        for strip in folded.as_deref().unwrap_or(strips) {
            let (half, middle) = (0.5 * (strip.x1 - strip.x0), 0.5 * (strip.x0 + strip.x1));
            // Radians from the middle to the end for the highest order of the difference.
            let phase = 2.0 * PI * expansion.reach() as f64 * half;
            for (x, weight) in gauss((MIN_POINTS + POINTS_PER_RADIAN * phase).ceil() as usize) {
                let all = expansion.point_values(middle + half * x);
                gains.extend(all.iter().map(|_| d * strip.rise * weight * half));
                functions.extend(all);
            }
        }
        let n = functions.first()?.len();
        let points = Mat::from_fn(functions.len(), n, |i, m| functions[i][m].conjugate());
        let (_, magnetic) = expansion.step_factors();
        let by_ey = mul(&points, &basis.f);
        let by_ex = mul(&by_ey, &basis.o);
        let write = |m: &Mat<T>| {
            Mat::from_fn(m.nrows(), m.ncols(), |i, j| {
                magnetic * m[(i, j)].conjugate().scaled(gains[i])
            })
        };
        Some(Self {
            reads: [transpose(&by_ey), transpose(&by_ex)],
            writes: [write(&by_ey), write(&by_ex)],
        })
    }
}

/// The parts of mirror-symmetric strips in the half period from `origin` on.
fn folded(strips: &[Strip], origin: f64) -> Vec<Strip> {
    let mut halves = Vec::with_capacity(strips.len());
    for strip in strips {
        for period in -1..=1 {
            let from = origin + f64::from(period);
            let (x0, x1) = (strip.x0.max(from), strip.x1.min(from + 0.5));
            if x1 - x0 > SAME_PLACE {
                let rise = strip.rise;
                halves.push(Strip { x0, x1, rise });
            }
        }
    }
    halves
}

/// Points and weights of Gauss on -1..1: zeros of Legendre's polynomial by Newton's method.
fn gauss(count: usize) -> Vec<(f64, f64)> {
    let polynomial = |x: f64| {
        // That of this degree, and the one before.
        let (mut before, mut here) = (1.0, x);
        for k in 1..count {
            let k = k as f64;
            (before, here) = (here, ((2.0 * k + 1.0) * x * here - k * before) / (k + 1.0));
        }
        (here, before)
    };
    let degree = count as f64;
    (0..count)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (degree + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (here, before) = polynomial(x);
                slope = degree * (before - x * here) / (1.0 - x * x);
                x -= here / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expansion::real::RealFunctions;
    use crate::expansion::{FieldGroup, FourierOrders};
    use crate::fourier::coefficients;
    use crate::modes::correction_step::CorrectionStep;
    use crate::modes::normal_vector::NormalVectorFlow;
    use crate::orders::SymmetricBloch;
    use crate::relief::Segment;
    use num_complex::Complex64;

    #[test]
    fn points_of_gauss_integrate_polynomials() {
        for count in 2..9 {
            for power in 0..2 * count as i32 {
                let sum: f64 = gauss(count).iter().map(|(x, w)| w * x.powi(power)).sum();
                let exact = if power % 2 == 0 { 2.0 / f64::from(power + 1) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-13, "{count} {power}: {sum}");
            }
        }
    }

    /// The flow of strips, in the functions themselves, is the matrix of their Fourier
    /// coefficients.
    fn worst<T: Scalar>(expansion: &impl Expansion<T>, size: usize) -> f64 {
        let strip = Strip { x0: 0.31, x1: 0.36, rise: 0.7 };
        let index = |x0, x1, index: f64| Segment { x0, x1, index: Complex64::from(index) };
        let segments = [index(0.0, 0.31, 0.0), index(0.31, 0.36, 1.0), index(0.36, 1.0, 0.0)];
        let expected = expansion.multiplication(
            FieldGroup::Z,
            FieldGroup::Z,
            &coefficients(&segments, |n| [n * 0.7], expansion.reach(), 0.0)[0],
        );
        let strips =
            StripFlow::new(expansion, &[strip], &Basis::fourier([size, size]), 0.5).unwrap();
        let correction =
            CorrectionStep::from_flows(0.0, strips, NormalVectorFlow::none([size, size]));
        let mut e =
            Mat::from_fn(size, 2 * size, |i, j| if j == size + i { T::ONE } else { T::ZERO });
        let mut h = Mat::zeros(size, 2 * size);
        correction.add(&mut e, &mut h, 0.4);
        let (_, magnetic) = expansion.step_factors();
        let mut worst = 0.0_f64;
        for i in 0..size {
            for j in 0..size {
                // Transposed.
                let deviation = h[(j, size + i)] + -(magnetic * expected[(i, j)]);
                worst = worst.max(deviation.squared().sqrt());
                assert!(h[(j, i)].squared() == 0.0);
            }
        }
        worst
    }

    #[test]
    fn strips_are_the_difference_of_permittivities() {
        let kx: Vec<f64> = (-12..=12).map(|m| 0.2 * f64::from(m) + 0.03).collect();
        let largest = worst(&FourierOrders(&kx), 25);
        assert!(largest < 1e-5, "{largest}");
        for at in [SymmetricBloch::Centre, SymmetricBloch::Edge] {
            let functions = RealFunctions::standing(at, 12, 5.0);
            let largest = worst(&functions, functions.count(FieldGroup::Z));
            assert!(largest < 1e-5, "{largest}");
        }
    }
}
