// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cylinder functions of order 0 and 1 in the upper half-plane, for media that absorb.
//!
//! In: z = kr with Im z ≥ 0. Out: H0 and H1, which decay as e^(-Im z), and J0 and J1, which grow so.
//! Next to 0 by their power series \[DLMF 10.2.2, 10.8.1\], where the digits that H loses are few.
//! Beyond by H0 = 2/(πi) K0(w) and H1 = -2/π K1(w), w = -iz, with
//!
//! K0 = e^(-w)/√w ∫ e^(-σ²) dσ / sqrt(2 + σ²/w) over all σ,
//!
//! K1 with a factor 1 + σ²/w besides \[DLMF 10.32.9\], by the trapezoidal rule. Real arguments are
//! those of `full_wave::bessel`.

use full_wave::bessel::{Bessel, EULER};
use num_complex::Complex64;
use std::f64::consts::{FRAC_1_PI, FRAC_2_PI};

/// |z| up to which H comes from the power series, and J.
const SERIES_OF_H: f64 = 4.0;
const SERIES_OF_J: f64 = 9.0;
/// Step of the rule and number of its nodes with σ > 0: it leaves e^(-2π sqrt|w| / step).
const STEP: f64 = 0.35;
const NODES: i32 = 17;

/// H and J, each of order 0 and 1, at one argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cylinder {
    pub h: [Complex64; 2],
    pub j: [Complex64; 2],
}

impl Cylinder {
    /// At `z` with Im z ≥ 0; J, unless `with_j`, may be 0. J is asked for where Im z ≤ 8.
    pub(super) fn at(z: Complex64, with_j: bool) -> Self {
        if z.im == 0.0 {
            let Bessel { j0, j1, y0, y1 } = Bessel::at(z.re);
            let h = [Complex64::new(j0, y0), Complex64::new(j1, y1)];
            return Self { h, j: [j0, j1].map(Complex64::from) };
        }
        let size = z.norm();
        if size <= SERIES_OF_H {
            return series(z);
        }
        let h = hankel(z);
        let j = if !with_j {
            [Complex64::ZERO; 2]
        } else if size <= SERIES_OF_J {
            series(z).j
        } else {
            let other = hankel(z.conj()).map(|h| h.conj());
            [0, 1].map(|i| 0.5 * (h[i] + other[i]))
        };
        Self { h, j }
    }
}

/// The power series.
fn series(z: Complex64) -> Cylinder {
    let half = 0.5 * z;
    let log = half.ln() + EULER;
    let square = -half * half;
    // term = (-z²/4)^m / (m!)²; harmonic = 1 + ... + 1/m.
    let (mut term, mut harmonic, mut m) = (Complex64::ONE, 0.0, 0.0);
    let [mut j0, mut j1, mut y0, mut y1] = [Complex64::ZERO; 4];
    while term.norm() > 1e-18 {
        let next = 1.0 / (m + 1.0);
        j0 += term;
        j1 += next * term;
        y0 -= harmonic * term;
        y1 -= next * (2.0 * harmonic + next) * term;
        m += 1.0;
        term *= square / (m * m);
        harmonic += next;
    }
    j1 *= half;
    let y0 = FRAC_2_PI * (log * j0 + y0);
    let y1 = FRAC_2_PI * (log * j1 - 1.0 / z) + FRAC_1_PI * half * y1;
    let i = Complex64::I;
    Cylinder { h: [j0 + i * y0, j1 + i * y1], j: [j0, j1] }
}

/// H0 and H1 by the integrals.
fn hankel(z: Complex64) -> [Complex64; 2] {
    let w = -Complex64::I * z;
    let inverse = 1.0 / w;
    let [mut k0, mut k1] = [0.5 * Complex64::from(0.5).sqrt(); 2];
    for node in 1..=NODES {
        let square = (STEP * f64::from(node)).powi(2);
        let ratio = square * inverse;
        let value = (-square).exp() / (2.0 + ratio).sqrt();
        k0 += value;
        k1 += value * (1.0 + ratio);
    }
    let common = 2.0 * STEP * FRAC_2_PI * (-w).exp() / w.sqrt();
    [-Complex64::I * common * k0, -common * k1]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At angles from next to the real axis to the imaginary one, across all borders of the methods:
    /// the Wronskian J1 H0 - J0 H1 = 2i/(πz), and next to the real axis the real functions.
    #[test]
    fn wronskian_and_real_axis() {
        for degrees in [1e-9_f64, 1.0, 20.0, 45.0, 70.0, 89.0, 90.0] {
            let mut size = 1e-12;
            while size < 60.0 {
                let z = Complex64::from_polar(size, degrees.to_radians());
                size *= 1.07;
                if z.im > 8.0 {
                    continue;
                }
                let Cylinder { h, j } = Cylinder::at(z, true);
                let wronskian = (j[1] * h[0] - j[0] * h[1]) * z / Complex64::new(0.0, FRAC_2_PI);
                let error = (wronskian - 1.0).norm();
                assert!(error < 1e-9, "{z}: {error:.1e}");
                if degrees < 1e-6 {
                    let real = Cylinder::at(z.re.into(), true);
                    let off = |i: usize| (h[i] - real.h[i]).norm() / real.h[i].norm().max(1.0);
                    assert!(off(0).max(off(1)) < 5e-9, "{z}: {} {}", off(0), off(1));
                }
            }
        }
    }

    /// x, K0, K1 \[Abramowitz1964, tables 9.8 and 9.9\].
    #[test]
    fn the_imaginary_axis_has_the_values_of_the_tables() {
        for (x, k0, k1) in [
            (1.0, 0.421_024_438_240_708_34, 0.601_907_230_197_234_6),
            (5.0, 3.691_098_334_042_594e-3, 4.044_613_445_452_164e-3),
            (10.0, 1.778_006_231_616_765e-5, 1.864_877_345_382_558e-5),
        ] {
            let h = Cylinder::at(Complex64::new(0.0, x), false).h;
            let expected = [Complex64::new(0.0, -k0), Complex64::from(-k1)];
            for (h, k) in h.iter().zip(expected) {
                let error = (h / FRAC_2_PI - k).norm() / k.norm();
                assert!(error < 1e-12, "x {x}: {error:.1e}");
            }
        }
    }
}
