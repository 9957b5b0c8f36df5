// SPDX-License-Identifier: MIT OR Apache-2.0
//! Stokes parameters over I of light along a ray, `[Q/I, U/I, V/I]`.
//!
//! With p = s × k and c = E_s E_p*: Q = |E_s|² - |E_p|², U = 2 Re c, V = -2 Im c \[Born, Wolf
//! 1999\].
//!
//! A surface that multiplies E_s by a and E_p by b leaves I' = (|a|²(1 + Q) + |b|²(1 - Q))/2 of 1,
//! and U' - iV' = a b* (U - iV). Turning s by α about the ray turns (Q, U) by 2α.
//!
//! \[Born, Wolf 1999\] M. Born, E. Wolf, *Principles of Optics*, 7th ed., sections 1.4 and 1.5.

use glam::DVec3;
use num_complex::Complex64;

/// Light along `direction` that was referred to s = `from`, referred to s = `to`.
#[inline]
pub fn turned([q, u, v]: [f64; 3], direction: DVec3, from: DVec3, to: DVec3) -> [f64; 3] {
    let (cos, sin) = (from.dot(to), from.cross(direction).dot(to));
    // Both directions are at right angles to the ray but for rounding.
    let square = cos * cos + sin * sin;
    if square == 0.0 {
        return [q, u, v];
    }
    let (cos2, sin2) = ((cos * cos - sin * sin) / square, 2.0 * cos * sin / square);
    [q * cos2 + u * sin2, u * cos2 - q * sin2, v]
}

/// Light after E_s and E_p are multiplied, and its share of the power.
#[inline]
pub fn passed([q, u, v]: [f64; 3], [a, b]: [Complex64; 2]) -> ([f64; 3], f64) {
    let (s, p) = (0.5 * a.norm_sqr() * (1.0 + q), 0.5 * b.norm_sqr() * (1.0 - q));
    let share = s + p;
    if share <= 0.0 {
        return ([0.0; 3], 0.0);
    }
    let w = a * b.conj() / share;
    (physical([(s - p) / share, w.re * u + w.im * v, w.re * v - w.im * u]), share)
}

/// Light that rounding has not made more than fully polarised.
#[inline]
pub fn physical([q, u, v]: [f64; 3]) -> [f64; 3] {
    let degree = (q * q + u * u + v * v).sqrt();
    if degree <= 1.0 { [q, u, v] } else { [q / degree, u / degree, v / degree] }
}
