// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sums of power that no path reached.
//!
//! Counting none of n paths does not mean that none ever arrives: a mean of three arrivals shows
//! none in exp(-3) = 5 % of all runs. The error of such a sum is the power of one path, and three
//! times that bounds it with 95 % confidence.

use super::Estimate;

/// Mean number of arrivals that one run in twenty shows none of.
const ARRIVALS: f64 = 3.0;

/// `sum`, with the power of one path as its error where no path reached it.
pub fn with_one_path(sum: Estimate, one_path: f64) -> Estimate {
    let reached = sum.value != 0.0 || sum.standard_error > 0.0;
    if reached { sum } else { Estimate::new(0.0, one_path) }
}

/// The bound that replaces a value of 0 that has an error: 95 % confidence for a sum that no path
/// reached, three standard errors for a figure that noise drives to the end of its range.
pub fn upper_bound(value: f64, standard_error: f64) -> Option<f64> {
    (value == 0.0 && standard_error > 0.0 && standard_error.is_finite())
        .then_some(ARRIVALS * standard_error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_without_arrivals_has_a_bound_and_others_stay() {
        let none = with_one_path(Estimate::new(0.0, 0.0), 1e-4);
        let bound = upper_bound(none.value, none.standard_error).expect("a bound");
        // One in twenty runs of a Poisson process of that mean shows nothing.
        assert!((f64::exp(-bound / 1e-4) - 0.05).abs() < 3e-4);
        let some = Estimate::new(2e-4, 1e-4);
        assert_eq!(with_one_path(some, 1e-4), some);
        assert_eq!(upper_bound(some.value, some.standard_error), None);
        // A sum that no path can reach is 0.
        let never = with_one_path(Estimate::new(0.0, 0.0), 0.0);
        assert_eq!(upper_bound(never.value, never.standard_error), None);
    }
}
