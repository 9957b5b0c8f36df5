// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bessel functions of order 0 and 1 of a positive real argument: J0, J1, Y0, Y1.
//!
//! In: x > 0. Out: all four, to an absolute error of a few 1e-16 (relative to the larger of |Y| and
//! 1), above 1e6 of about 1e-16 x. Below an argument of 25 by Miller's backward recurrence for J_n
//! and Neumann's series for Y \[DLMF 3.6, 10.8\]; above by Hankel's asymptotic series
//! \[DLMF 10.17\], whose smallest term, about e^(-2x), is then below rounding.

#![expect(clippy::inline_always, reason = "compiled for the instructions that were found")]

use std::f64::consts::{FRAC_1_PI, FRAC_2_PI};

/// Euler's constant.
pub const EULER: f64 = 0.577_215_664_901_532_9;

/// From here on the asymptotic series is used.
pub(crate) const ASYMPTOTIC_FROM: f64 = 25.0;
/// Below this J0 = 1 and J1 = x/2 to rounding, and only the leading terms of Y matter.
const TINY: f64 = 1e-8;

/// π/2 as a sum; the first two have 33 bits.
const HALF_PI: [f64; 3] =
    [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

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
        if x >= FEW_TERMS_FROM {
            Self::asymptotic::<FEW_TERMS>(x)
        } else if x >= ASYMPTOTIC_FROM {
            Self::asymptotic::<TERMS>(x)
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

    /// H_ν = sqrt(2/πx) exp(i(x - νπ/2 - π/4)) (P + iQ) by `COUNT` pairs of terms of [`HANKEL`]: one
    /// straight line for lanes of arguments.
    #[inline(always)]
    pub(crate) fn asymptotic<const COUNT: usize>(x: f64) -> Self {
        // sin(x - π/4) = (sin x - cos x)/√2, cos(x - π/4) = (sin x + cos x)/√2; the amplitude
        // holds the 1/√2.
        let inverse = 1.0 / x;
        let amplitude = (FRAC_1_PI * inverse).sqrt();
        let (sin, cos) = sin_cos(x);
        let (sin, cos) = (amplitude * (sin - cos), amplitude * (sin + cos));
        let square = inverse * inverse;
        let (mut p0, mut q0, mut p1, mut q1) = (0.0, 0.0, 0.0, 0.0);
        for j in (0..COUNT).rev() {
            p0 = p0 * square + HANKEL[0][j][0];
            q0 = q0 * square + HANKEL[0][j][1];
            p1 = p1 * square + HANKEL[1][j][0];
            q1 = q1 * square + HANKEL[1][j][1];
        }
        let (q0, q1) = (q0 * inverse, q1 * inverse);
        Self {
            j0: p0 * cos - q0 * sin,
            y0: p0 * sin + q0 * cos,
            j1: p1 * sin + q1 * cos,
            y1: q1 * sin - p1 * cos,
        }
    }
}

/// Sine and cosine of |x| < 1e6 without branches: π/2 in parts whose products with the number of
/// quadrants are exact \[Cody1980\], and Taylor's series on the quadrant.
#[inline(always)]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    // Adding it rounds to a whole number, which stands in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let shifted = x * FRAC_2_PI + ROUND;
    let (quadrant, count) = (shifted.to_bits(), shifted - ROUND);
    let r = ((x - count * HALF_PI[0]) - count * HALF_PI[1]) - count * HALF_PI[2];
    let square = r * r;
    let (mut sin, mut cos) = (0.0, 0.0);
    for k in (1..=8).rev() {
        let even = 2.0 * f64::from(k);
        sin = (1.0 + sin) * (-1.0 / (even * (even + 1.0))) * square;
        cos = (1.0 + cos) * (-1.0 / (even * (even - 1.0))) * square;
    }
    let (sin, cos) = (r + r * sin, 1.0 + cos);
    let (sin, cos) = if quadrant & 1 == 0 { (sin, cos) } else { (cos, sin) };
    (signed(sin, quadrant), signed(cos, quadrant + 1))
}

/// The value with its sign turned in the third and fourth of four quadrants.
#[inline(always)]
fn signed(value: f64, quadrant: u64) -> f64 {
    f64::from_bits(value.to_bits() ^ ((quadrant & 2) << 62))
}

/// Pairs of terms of Hankel's series at every argument, from [`FEW_TERMS_FROM`] on, and from
/// [`FEWEST_TERMS_FROM`] on. Terms fall as k!/(2x)^k.
pub(crate) const TERMS: usize = 13;
pub(crate) const FEW_TERMS: usize = 7;
pub(crate) const FEW_TERMS_FROM: f64 = 60.0;
pub(crate) const FEWEST_TERMS: usize = 4;
pub(crate) const FEWEST_TERMS_FROM: f64 = 300.0;

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
    use std::f64::consts::FRAC_PI_2;

    /// x, J0, J1, Y0, Y1 from Abramowitz and Stegun, tables 9.1 and 9.2, to the digits printed
    /// there; the last two rows by mpmath 1.3 in 40 digits.
    const TABLE: [(f64, [f64; 4]); 6] = [
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
        (
            1e3,
            [
                0.024_786_686_152_420_175,
                0.004_728_311_907_089_524,
                0.004_715_917_977_622_813_4,
                -0.024_784_331_292_351_779,
            ],
        ),
        (
            1e5,
            [
                -0.001_719_201_116_235_972_2,
                0.001_846_757_562_882_567_7,
                0.001_846_766_158_865_064,
                0.001_719_210_350_088_256_3,
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
    fn sines_are_right_to_the_last_digit() {
        let check = |x: f64| {
            let (sin, cos) = sin_cos(x);
            assert!((sin - x.sin()).abs().max((cos - x.cos()).abs()) < 2.3e-16, "x = {x:e}");
        };
        let mut x = 1e-3_f64;
        while x < 1e6 {
            // Itself, and the multiple of π/2 beside it, where most digits cancel.
            let near = (x * FRAC_2_PI).round() * FRAC_PI_2;
            [x, -x, near, -near].into_iter().for_each(check);
            x *= 1.000_37;
        }
    }

    #[test]
    fn both_ways_agree_where_they_meet() {
        for i in 0..100 {
            let x = ASYMPTOTIC_FROM - 2.0 + 0.04 * f64::from(i);
            let (a, b) = (Bessel::recurrence(x), Bessel::asymptotic::<TERMS>(x));
            for (a, b) in [(a.j0, b.j0), (a.j1, b.j1), (a.y0, b.y0), (a.y1, b.y1)] {
                assert!((a - b).abs() < 2e-15, "x = {x}: {a:e} and {b:e}");
            }
        }
    }
}
