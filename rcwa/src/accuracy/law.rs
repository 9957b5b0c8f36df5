// SPDX-License-Identifier: MIT OR Apache-2.0
//! The law by which errors fall as a resolution rises, and the error that a change leaves.
//!
//! If errors go as n^-p in the number n of orders or slices, two results on n and n' > n differ by
//! the part 1 - (n/n')^p of the error of the first. Fields at the corners of two media go as
//! r^(τ-1) [Meixner 1972, IEEE Trans. Antennas Propag. 20, 442], so that efficiencies of 2M + 1
//! orders are off by about M^(-2τ). At a right angle of two media of ε ratio κ,
//!
//! tan²(πτ/4) = (3 + κ)/(1 + 3κ) or its inverse,
//!
//! which is 1 at κ = 1, 2/3 at a perfect conductor, and next to 0 at a metal of -3 < Re κ < -1/3
//! and little loss, where nothing settles.

use crate::hemisphere::Interface;
use num_complex::Complex64;
use std::f64::consts::PI;

// The powers and factors of all searches. Each says what it was measured on, and what holds it.

/// Smallest exponent of a law: below it no number of orders gets anywhere.
const MIN_EXPONENT: f64 = 0.2;
/// Errors go as this power of the thickness of a slice, or faster (docs/validation/table-error.md).
pub(super) const SLICES_EXPONENT: f64 = 2.0;
/// Errors go as this power of 1/M, or faster, where walls are followed at low contrast
/// (docs/validation/table-error.md).
const FOLLOWED_EXPONENT: f64 = 3.0;
/// Elsewhere as this one, from the beginning, or as corners make it.
pub(super) const ORDERS_EXPONENT: f64 = 2.0;
/// Errors of orders and stairs together, in TM.
pub(super) const TOGETHER_EXPONENT: f64 = 1.0;
/// Largest index over the smallest from which single waves, near resonances, are off by more than
/// those looked at (tests/physics/contrast.rs).
const HIGH_CONTRAST: f64 = 1.8;
/// Tolerance below which errors of orders are in their tails, and estimates too low.
const TAIL: f64 = 5e-4;
/// Factor of hemispheres there and at high contrast: what 99 % of the directions stay below
/// (docs/validation/table-error.md, tests/physics/contrast.rs).
pub(super) const HEMISPHERE_SAFETY: f64 = 1.4;
/// Law of hemispheres on walls that are not followed, unless corners make it slower: lamellae of
/// 0.05 to 10 wavelengths (rcwa/tests/accuracy.rs).
pub(super) const ORDERS: Law = Law { exponent: ORDERS_EXPONENT, safety: 1.6 };
/// Factor of single waves, which swing about their limit more than most of a hemisphere: the
/// eleven gratings of tests/end_to_end/grating_command.rs, silver in rcwa/tests/accuracy.rs.
pub(super) const WAVES_SAFETY: f64 = 2.0;
/// Orders next to those found that must agree, where walls are not followed: efficiencies of every
/// second or third order lie on curves of their own (silver in TM, rcwa/tests/accuracy.rs).
pub(super) const NEIGHBOURS: usize = 2;

/// Error proportional to n^-exponent, times a factor for its swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Law {
    /// Power of 1/n, at least; a whole one is taken by multiplication.
    pub(super) exponent: f64,
    /// Factor for what departs from the law.
    pub(super) safety: f64,
}

impl Law {
    /// Error on n' over that on n, for `ratio` = n/n' < 1.
    pub(super) fn fall(self, ratio: f64) -> f64 {
        if self.exponent.fract() == 0.0 {
            ratio.powi(self.exponent as i32)
        } else {
            ratio.powf(self.exponent)
        }
    }

    /// Error of the coarser of two results that differ by `change`.
    pub(super) fn left_by_coarser(self, change: f64, ratio: f64) -> f64 {
        self.safety * change / (1.0 - self.fall(ratio))
    }

    /// Error of the finer one.
    pub(super) fn left_by_finer(self, change: f64, ratio: f64) -> f64 {
        let fall = self.fall(ratio);
        self.safety * change * fall / (1.0 - fall)
    }

    /// Factor of n that takes an error from `estimate` to `allowed`.
    pub(super) fn growth(self, estimate: f64, allowed: f64) -> f64 {
        (estimate / allowed).powf(1.0 / self.exponent)
    }
}

/// True where errors of orders fall only as the square of 1/M from the beginning, and single waves
/// depart by more than most.
pub(super) fn is_of_high_contrast(interface: &Interface) -> bool {
    interface.relief.contrast() > HIGH_CONTRAST
}

/// Law of orders where walls are followed; slices have its safety.
pub(super) fn followed_law(interface: &Interface, tolerance: f64) -> Law {
    if is_of_high_contrast(interface) {
        Law { exponent: ORDERS_EXPONENT, safety: HEMISPHERE_SAFETY }
    } else {
        let safety = if tolerance < TAIL { HEMISPHERE_SAFETY } else { 1.0 };
        Law { exponent: FOLLOWED_EXPONENT, safety }
    }
}

/// Law of orders where walls are vertical: that of the corners, where media differ much.
pub(super) fn unfollowed_law(interface: &Interface) -> Law {
    if interface.follows_walls() && !is_of_high_contrast(interface) {
        return ORDERS;
    }
    Law { exponent: ORDERS.exponent.min(corner_exponent(&interface.indices())), ..ORDERS }
}

/// Exponent 2τ of the least convergent corner of any two of the media, from 0.2.
pub(super) fn corner_exponent(indices: &[Complex64]) -> f64 {
    let pairs =
        indices.iter().enumerate().flat_map(|(i, a)| indices[..i].iter().map(move |b| a / b));
    pairs.map(|ratio| 2.0 * singularity(ratio * ratio)).fold(2.0, f64::min).max(MIN_EXPONENT)
}

/// Real part of τ at a right angle of two media of ε ratio κ.
fn singularity(kappa: Complex64) -> f64 {
    let squared = (3.0 + kappa) / (1.0 + 3.0 * kappa);
    [squared, squared.inv()]
        .map(|t| (4.0 / PI * t.sqrt().atan()).re.abs())
        .into_iter()
        .filter(|tau| tau.is_finite())
        .fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_continues_its_own_errors_exactly() {
        for exponent in [0.5, 1.0, 2.0, 3.0] {
            let law = Law { exponent, safety: 1.0 };
            let error = |n: f64| n.powf(-exponent);
            let (coarse, fine, change) = (error(8.0), error(10.0), error(8.0) - error(10.0));
            assert!((law.left_by_coarser(change, 0.8) / coarse - 1.0).abs() < 1e-12);
            assert!((law.left_by_finer(change, 0.8) / fine - 1.0).abs() < 1e-12);
            assert!((law.growth(coarse, fine) - 10.0 / 8.0).abs() < 1e-12);
        }
    }

    #[test]
    fn corners_have_the_exponents_of_the_literature() {
        let conductor = singularity(Complex64::new(-1e12, 1.0));
        assert!((conductor - 2.0 / 3.0).abs() < 1e-9, "{conductor}");
        let glass = singularity(Complex64::from(2.25));
        assert!((glass - 0.877).abs() < 1e-3, "{glass}");
        assert!((singularity(Complex64::from(1.0 / 2.25)) - glass).abs() < 1e-12);
        // No field of finite energy.
        assert!(singularity(Complex64::from(-2.0)) < 1e-9);
        let silver = corner_exponent(&[Complex64::new(0.132, 2.766), Complex64::from(1.5)]);
        assert!((0.4..0.7).contains(&silver), "{silver}");
    }
}
