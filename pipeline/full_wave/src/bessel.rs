// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bessel functions of order 0 and 1 of a positive real argument: J0, J1, Y0, Y1.
//!
//! In: x > 0. Out: all four, to an absolute error of a few 1e-16 (relative to the larger of |Y| and
//! 1). Below an argument of 25 by Miller's backward recurrence for J_n and Neumann's series for Y
//! \[DLMF 3.6, 10.8\]; above by Hankel's asymptotic series \[DLMF 10.17\], whose smallest term,
//! about e^(-2x), is then below rounding.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_4};

/// Euler's constant.
pub const EULER: f64 = 0.577_215_664_901_532_9;

/// From here on the asymptotic series is used.
const ASYMPTOTIC_FROM: f64 = 25.0;
/// Below this J0 = 1 and J1 = x/2 to rounding, and only the leading terms of Y matter.
const TINY: f64 = 1e-8;

/// The four functions at one argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bessel {
    /// Function of its name.
    pub j0: f64,
    /// Function of its name.
    pub j1: f64,
    /// Function of its name.
    pub y0: f64,
    /// Function of its name.
    pub y1: f64,
}

impl Bessel {
    /// At `x` > 0.
    pub fn at(x: f64) -> Self {
        if x >= ASYMPTOTIC_FROM {
            Self::asymptotic(x)
        } else if x > TINY {
            Self::recurrence(x)
        } else {
            let log = (0.5 * x).ln() + EULER;
            Self {
                j0: 1.0,
                j1: 0.5 * x,
                y0: FRAC_2_PI * log,
                y1: -FRAC_2_PI / x + FRAC_2_PI * 0.5 * x * (log - 0.5),
            }
        }
    }

    /// J_n downwards from a high even n, scaled so that J0 + 2 (J2 + J4 + ...) = 1; on the way
    /// Neumann's sums Y0 = 2/π (L J0 - 2 Σ (-1)^k J_2k / k) and Y1 = 2/π (-J0/x + (L - 1) J1 - Σ
    /// (-1)^k (2k+1)/(k(k+1)) J_2k+1), L = ln(x/2) + γ, k ≥ 1.
    fn recurrence(x: f64) -> Self {
        // J_n falls below 1e-17 of the largest beyond this n, for all x of this range.
        let half = (12.0 + 0.85 * x) as usize;
        let per_x = 2.0 / x;
        let (mut above, mut here) = (0.0, 1e-280);
        let (mut total, mut even, mut odd) = (0.0, 0.0, 0.0);
        for k in (1..=half).rev() {
            // `here` is J_2k, `above` J_2k+1, both up to the common scale.
            let index = k as f64;
            let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            total += here;
            even += sign * here / index;
            odd += sign * above * (2.0 * index + 1.0) / (index * (index + 1.0));
            let below = 2.0 * index * per_x * here - above;
            let next = (2.0 * index - 1.0) * per_x * below - here;
            (above, here) = (below, next);
        }
        let scale = 1.0 / (here + 2.0 * total);
        let (j0, j1) = (here * scale, above * scale);
        let log = (0.5 * x).ln() + EULER;
        Self {
            j0,
            j1,
            y0: FRAC_2_PI * (log * j0 - 2.0 * scale * even),
            y1: FRAC_2_PI * ((log - 1.0) * j1 - j0 / x - scale * odd),
        }
    }

    /// H_ν = sqrt(2/πx) exp(i(x - νπ/2 - π/4)) (P + iQ) by [`HANKEL`].
    fn asymptotic(x: f64) -> Self {
        let amplitude = (FRAC_2_PI / x).sqrt();
        let (sin, cos) = (x - FRAC_PI_4).sin_cos();
        let inverse = 1.0 / x;
        let square = inverse * inverse;
        // Terms fall as k!/(2x)^k.
        let count = if x < FEW_TERMS_FROM { TERMS } else { FEW_TERMS };
        let [(p0, q0), (p1, q1)] = [&HANKEL[0], &HANKEL[1]].map(|terms| {
            let start = (0.0, 0.0);
            let (p, q) = terms[..count]
                .iter()
                .rev()
                .fold(start, |(p, q), term| (p * square + term[0], q * square + term[1]));
            (amplitude * p, amplitude * inverse * q)
        });
        Self {
            j0: p0 * cos - q0 * sin,
            y0: p0 * sin + q0 * cos,
            j1: p1 * sin + q1 * cos,
            y1: -p1 * cos + q1 * sin,
        }
    }
}

/// Pairs of terms of Hankel's series at every argument, and from [`FEW_TERMS_FROM`] on.
const TERMS: usize = 13;
const FEW_TERMS: usize = 7;
const FEW_TERMS_FROM: f64 = 60.0;

/// For ν = 0 and 1: factors of x^-2j in P and of x^-(2j+1) in Q, (-1)^j a_2j and (-1)^j a_2j+1 with
/// a_k/a_{k-1} = (4ν² - (2k-1)²)/(8k).
const HANKEL: [[[f64; 2]; TERMS]; 2] = [hankel(0.0), hankel(4.0)];

const fn hankel(four_nu2: f64) -> [[f64; 2]; TERMS] {
    let mut terms = [[0.0; 2]; TERMS];
    let (mut a, mut sign) = (1.0, 1.0);
    let mut j = 0;
    while j < TERMS {
        let odd = (4 * j + 1) as f64;
        let even = (4 * j + 3) as f64;
        terms[j][0] = sign * a;
        a *= (four_nu2 - odd * odd) / (8 * (2 * j + 1)) as f64;
        terms[j][1] = sign * a;
        a *= (four_nu2 - even * even) / (8 * (2 * j + 2)) as f64;
        sign = -sign;
        j += 1;
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x, J0, J1, Y0, Y1 from Abramowitz and Stegun, tables 9.1 and 9.2, to the digits printed
    /// there.
    const TABLE: [(f64, [f64; 4]); 4] = [
        (
            1.0,
            [
                0.765_197_686_557_966_6,
                0.440_050_585_744_933_5,
                0.088_256_964_215_676_96,
                -0.781_212_821_300_288_7,
            ],
        ),
        (
            5.0,
            [
                -0.177_596_771_314_338_3,
                -0.327_579_137_591_465_2,
                -0.308_517_625_249_033_8,
                0.147_863_143_391_226_84,
            ],
        ),
        (
            10.0,
            [
                -0.245_935_764_451_348_3,
                0.043_472_746_168_861_4,
                0.055_671_167_283_599_4,
                0.249_015_424_206_953_9,
            ],
        ),
        (
            50.0,
            [
                0.055_812_327_669_251_8,
                -0.097_511_828_125_175_2,
                -0.098_064_995_470_077_1,
                -0.056_795_668_562_014_8,
            ],
        ),
    ];

    #[test]
    fn values_of_the_tables() {
        for (x, expected) in TABLE {
            let got = Bessel::at(x);
            for (g, e) in [got.j0, got.j1, got.y0, got.y1].into_iter().zip(expected) {
                assert!((g - e).abs() < 4e-16, "x = {x}: got {g:e}, expected {e:e}");
            }
        }
    }

    #[test]
    fn the_wronskian_is_2_over_pi_x_at_every_argument() {
        let mut x = 1e-18;
        while x < 2000.0 {
            let b = Bessel::at(x);
            let got = (b.j1 * b.y0 - b.j0 * b.y1) * x / FRAC_2_PI;
            // The products are sums of terms as large as |Y0 J1| and |Y1 J0|, and x is exact.
            assert!((got - 1.0).abs() < 3e-14, "x = {x:e}: {:e}", got - 1.0);
            x *= 1.013;
        }
    }

    #[test]
    fn both_ways_agree_where_they_meet() {
        for i in 0..100 {
            let x = ASYMPTOTIC_FROM - 2.0 + 0.04 * f64::from(i);
            let (a, b) = (Bessel::recurrence(x), Bessel::asymptotic(x));
            for (a, b) in [(a.j0, b.j0), (a.j1, b.j1), (a.y0, b.y0), (a.y1, b.y1)] {
                assert!((a - b).abs() < 2e-15, "x = {x}: {a:e} and {b:e}");
            }
        }
    }
}
