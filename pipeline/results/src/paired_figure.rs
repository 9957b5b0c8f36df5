// SPDX-License-Identifier: MIT OR Apache-2.0
//! A figure of one trace with its state and its jackknife replicates, for changes between traces by
//! the same random numbers.

use serde::{Deserialize, Serialize};

use metrics::far_field::PeakPlace;
use metrics::{Estimate, JackknifedFigure, spread};

use crate::figure_entry::FigureEntry;

/// A scatter of replicates below this part of a value is rounding.
const ROUNDING: f64 = 1e-13;

/// `difference` of two values of about `size`, 0 where it is no more than rounding.
pub fn above_rounding(difference: f64, size: f64) -> f64 {
    if difference.abs() <= ROUNDING * size { 0.0 } else { difference }
}

/// What replicates do not contain of the value that they belong to, the difference of two values of
/// about `size`: its distance from their mean, where that exceeds their scatter. An extreme that all
/// replicates hold at one place may jump to another in the halves of the paths that give its value.
pub fn jump(value: f64, replicates: &[f64], size: f64) -> f64 {
    let mean = replicates.iter().sum::<f64>() / replicates.len() as f64;
    let distance = (value - mean).abs();
    if distance > spread(replicates).max(ROUNDING * size) { distance } else { 0.0 }
}

/// A figure with its state and its replicates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairedFigure {
    /// Value, error and state.
    pub entry: FigureEntry,
    /// Values without each group of paths.
    pub without: Vec<f64>,
}

impl From<JackknifedFigure> for PairedFigure {
    fn from(figure: JackknifedFigure) -> Self {
        Self { entry: FigureEntry::new(figure.estimate()), without: figure.without }
    }
}

impl PairedFigure {
    /// A figure by its value and its replicates.
    pub fn new(value: f64, without: Vec<f64>) -> Self {
        JackknifedFigure::new(value, without).into()
    }

    /// The error that replicates do not show: what that of the figure, or of its ends, is beyond
    /// their scatter.
    pub fn hidden_error(&self) -> f64 {
        let between = self.entry.between_ends().map(|middle| middle.standard_error);
        let error = between.unwrap_or(self.entry.standard_error);
        (error.powi(2) - spread(&self.without).powi(2)).max(0.0).sqrt()
    }

    /// True where traces by the same random numbers have the hidden error in common, so that of a
    /// change it is the difference of both: that of picking an extreme, and of noise of which the
    /// replicates show a part.
    pub fn hides_a_bias(&self) -> bool {
        let is_still = spread(&self.without) <= ROUNDING * self.entry.value.abs();
        self.entry.bias_bound.is_some() || !is_still && self.entry.interval.is_none()
    }

    /// Its difference from `base`, which was traced with the same random numbers, group by group.
    ///
    /// The change of a peak that is a bin lies between the differences of the ends, as that of two
    /// sums that no path reached. The bias that picking leaves is that of both less what they have
    /// in common, and no less than a [`jump`] of the change. A change without an error is one of equal
    /// sums, or of exact numbers; one of the size of rounding is none.
    pub fn change(&self, base: &Self) -> FigureEntry {
        let (own, other) = (&self.entry, &base.entry);
        let pairs = self.without.iter().zip(&base.without);
        let differences: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        let size = own.value.abs().max(other.value.abs());
        let value = above_rounding(own.value - other.value, size);
        let unseen = |e: &FigureEntry| e.upper_bound.map_or(0.0, |_| e.standard_error);
        let scatter = above_rounding(spread(&differences), size);
        let mut scatter = scatter.hypot(unseen(own)).hypot(unseen(other));
        if value != 0.0 && scatter <= ROUNDING * size {
            scatter = own.standard_error.hypot(other.standard_error);
        }
        let bias = own.bias_bound.unwrap_or(0.0) - other.bias_bound.unwrap_or(0.0);
        let bias = bias.abs().max(jump(value, &differences, size));
        let change = Estimate {
            value,
            standard_error: scatter.hypot(bias / 3f64.sqrt()),
            bias_bound: (bias > 0.0).then_some(bias),
        };
        let of_ends = || {
            let ends = |e: &FigureEntry| e.ends().unwrap_or([e.value; 2]);
            let ([low, high], [from, to]) = (ends(own), ends(other));
            [low - to, high - from]
        };
        let are_unseen = own.upper_bound.and(other.upper_bound).is_some();
        let between = own.is_bin() || other.is_bin() || are_unseen;
        let places = [own, other].map(|e| e.peak_place);
        let noise = places.into_iter().find(|place| *place == PeakPlace::NotResolved);
        let on_axis = places.into_iter().find(|place| *place == PeakPlace::OnAxis);
        FigureEntry {
            interval: if between { Some(of_ends()) } else { change.interval() },
            upper_bound: None,
            peak_place: noise.or(on_axis).unwrap_or_default(),
            ..FigureEntry::new(change)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bin(low: f64, high: f64) -> PairedFigure {
        let middle = f64::midpoint(low, high);
        let entry = FigureEntry::new(Estimate::new(middle, 0.0));
        PairedFigure {
            entry: FigureEntry { interval: Some([low, high]), ..entry },
            without: vec![middle; 4],
        }
    }

    #[test]
    fn what_groups_have_in_common_cancels_in_a_change() {
        let base = PairedFigure::new(2.0, vec![1.9, 2.0, 2.1, 2.0]);
        let moved = PairedFigure::new(2.5, vec![2.4, 2.5, 2.6, 2.5]);
        let change = moved.change(&base);
        assert!((change.value - 0.5).abs() < 1e-15 && moved.entry.standard_error > 0.1);
        // Replicates that all move alike leave the errors of both.
        let both = moved.entry.standard_error.hypot(base.entry.standard_error);
        assert!(change.standard_error <= both && change.standard_error >= 0.0);
        let other = PairedFigure::new(2.5, vec![2.41, 2.5, 2.6, 2.5]);
        let error = other.change(&base).standard_error;
        assert!(error > 0.0 && error < 0.1 * both, "{error}");
    }

    #[test]
    fn no_change_of_a_bin_or_of_an_unseen_sum_is_exact() {
        let same = bin(17.5, 22.5).change(&bin(17.5, 22.5));
        assert_eq!(same.interval, Some([-5.0, 5.0]));
        assert_eq!(bin(27.5, 32.5).change(&bin(17.5, 22.5)).interval, Some([5.0, 15.0]));
        assert!((bin(17.5, 22.5).hidden_error() - 2.5 / 3.0).abs() < 1e-15);
        let none = PairedFigure::from(JackknifedFigure {
            value: 0.0,
            standard_error: 0.125,
            without: vec![0.0; 4],
        });
        let change = none.change(&none);
        assert_eq!(change.interval, Some([-0.375, 0.375]));
        let seen = PairedFigure::new(0.5, vec![0.5, 0.375, 0.625, 0.5]);
        assert!(seen.change(&none).standard_error > seen.entry.standard_error);
        // The same sums change by nothing, and exact numbers have no error.
        assert_eq!(seen.change(&seen).estimate(), Estimate::new(0.0, 0.0));
        let exact = |value: f64| PairedFigure::new(value, vec![value; 4]);
        assert_eq!(exact(2.0).change(&exact(1.0)).estimate(), Estimate::new(1.0, 0.0));
        // Chromaticities of light that no material tells apart, by sums of two searches.
        let rounded = |ulps: i32| {
            let values = (0..4).map(|k| 0.2 + f64::from(k * ulps) * f64::EPSILON / 8.0);
            PairedFigure::new(0.2 + f64::from(ulps) * f64::EPSILON / 8.0, values.collect())
        };
        assert_eq!(rounded(1).change(&rounded(-1)).estimate(), Estimate::new(0.0, 0.0));
    }

    #[test]
    fn the_bias_that_both_have_drops_out_of_a_change() {
        let picked = |low: f64, high: f64, without: [f64; 4]| PairedFigure {
            entry: FigureEntry::new(Estimate::between(low, high, 0.01)),
            without: without.to_vec(),
        };
        let base = picked(0.5, 0.7, [0.50, 0.51, 0.49, 0.50]);
        let alike = picked(0.6, 0.8, [0.61, 0.60, 0.59, 0.60]);
        let change = alike.change(&base);
        assert!((change.value - 0.1).abs() < 1e-12 && change.interval.is_none(), "{change:?}");
        // A jump of the values that no replicate contains: it may be there or not.
        let held = PairedFigure { without: base.without.clone(), ..alike.clone() };
        let [low, high] = held.change(&base).interval.expect("not resolved");
        assert!(low < 0.0 && high > 0.1, "{low} {high}");
        let wider = picked(0.6, 1.0, [0.61, 0.60, 0.59, 0.60]);
        let [low, high] = wider.change(&base).interval.expect("not resolved");
        assert!(low < 0.1 && high > 0.3, "{low} {high}");
    }
}
