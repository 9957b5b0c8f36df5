// SPDX-License-Identifier: MIT OR Apache-2.0
//! A figure of merit in `results.json`: value, error and state.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use metrics::Estimate;
use metrics::estimate::{self, DISTINCT};
use metrics::far_field::PeakPlace;
use metrics::figures;
use metrics::hits::upper_bound;
use metrics::quantity::Unit;

/// Headings of a figure in tables: value and error; the ends between which one lies that is not
/// resolved, empty of others; and where the peak is whose angle it is, empty where it has one.
pub const COLUMNS: [&str; 5] = ["value", "standard_error", "low", "high", "peak_place"];

/// Largest ratio, such as a variation over its mean, that tells more than none where 0 is as likely.
const LARGEST_RATIO: f64 = 1.0;

/// Smallest and largest amount of light, and of what is no less than 0.
const LIGHT: [f64; 2] = [0.0, f64::INFINITY];

/// Smallest and largest value of figures of a unit.
fn range(unit: Unit) -> [f64; 2] {
    match unit {
        Unit::Fraction => [0.0, 1.0],
        Unit::Degree => [0.0, 180.0],
        Unit::Relative => [f64::NEG_INFINITY, f64::INFINITY],
        _ => LIGHT,
    }
}

/// Standard errors beyond which an error of a film table is seen.
const SEEN: f64 = 2.0;

/// A figure of merit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FigureEntry {
    /// Best value.
    pub value: f64,
    /// One standard deviation of the value.
    #[serde(deserialize_with = "estimate::standard_error")]
    pub standard_error: f64,
    /// Of figures that pick the largest or smallest bin: bound of the bias that picking leaves in
    /// the value. The standard error holds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bias_bound: Option<f64>,
    /// Of a peak angle, place of the peak. `"not_resolved"` marks others too: a change that may be
    /// as large as the range of its figure, a ratio between 0 and more than 1.
    #[serde(default, skip_serializing_if = "PeakPlace::is_off_axis")]
    pub peak_place: PeakPlace,
    /// Of a peak that is the middle of a bin: middles of the first and last bins that three
    /// standard errors do not tell from the largest, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_range_deg: Option<[f64; 2]>,
    /// Of a figure that is known between two ends alone: these ends, which terminal, tables and
    /// page show in place of value and error. Of a peak that is the middle of a bin they are the
    /// outer edges of `peak_range_deg`; of a beam or field angle twice the angles between which the
    /// intensity passes its level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// Of a value of 0 that is no more than not seen: the bound below which it lies, with 95 %
    /// confidence or more. Of a sum that no path reached, three times the power of one path; of a
    /// figure that noise drives to 0, three standard errors. Accounts in which no path can end (media
    /// that do not absorb, downwards without a housing) are 0 ± 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper_bound: Option<f64>,
    /// Of a figure of the map: where its valley was read, (x, y) in mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valley_at_mm: Option<[f64; 2]>,
    /// Of a figure of the map: the middle of its largest bin, (x, y) in mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_at_mm: Option<[f64; 2]>,
    /// In the light of a spectrum: change of the figure when the last wavelengths were added.
    /// Absent for lines and for a single sample. Errors on terminal and page hold it;
    /// `standard_error` does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelength_error: Option<Estimate>,
    /// Where films are traced by a table: what its cells add, estimated from cells of twice the
    /// width, with its own error. `standard_error` holds the noise of the table, and not this;
    /// errors on terminal and page hold it where it is beyond two of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub film_table_error: Option<Estimate>,
    /// Published value of the figure, where the paper gives one.
    #[serde(rename = "published", default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<f64>,
}

impl FigureEntry {
    /// Value, standard error and bias.
    pub fn estimate(&self) -> Estimate {
        Estimate {
            value: self.value,
            standard_error: self.standard_error,
            bias_bound: self.bias_bound,
        }
    }

    /// The estimate with the errors that sampling a spectrum adds, and cells of a table of films where
    /// that is beyond its own noise.
    pub fn with_added_errors(&self) -> Estimate {
        let of_films = self.film_table_error.filter(|e| e.value > SEEN * e.standard_error);
        let added = [self.wavelength_error, of_films].into_iter().flatten();
        added.fold(self.estimate(), |sum, error| sum.with_error(error.value))
    }

    /// The error that a stopping rule on the figure called `key` judges: its standard error, or the
    /// bound of a sum that no path has reached.
    pub fn error_left(&self, key: &str) -> f64 {
        self.bound_of_sum(key).unwrap_or(self.standard_error)
    }

    /// The bound of a figure called `key` that is a sum over paths of which none has arrived.
    pub fn bound_of_sum(&self, key: &str) -> Option<f64> {
        self.upper_bound.filter(|_| figures::find(key).is_some_and(|of| of.is_sum()))
    }

    /// The ends between which a figure lies that is not resolved; `None` of one that is.
    pub fn ends(&self) -> Option<[f64; 2]> {
        self.interval.or(self.upper_bound.map(|bound| [0.0, bound]))
    }

    /// True of a peak that is a bin: it lies anywhere in it.
    pub fn is_bin(&self) -> bool {
        self.interval.is_some() && self.bias_bound.is_none()
    }

    /// Cells of a line of a table, under [`COLUMNS`].
    pub fn columns(&self) -> [String; 5] {
        let end = |k: usize| self.ends().map_or_else(String::new, |ends| ends[k].to_string());
        let place = match self.peak_place {
            PeakPlace::OffAxis => "",
            PeakPlace::OnAxis => "on_axis",
            PeakPlace::NotResolved => "not_resolved",
        };
        let [value, error] = [self.value, self.standard_error].map(|number| number.to_string());
        [value, error, end(0), end(1), place.to_owned()]
    }

    /// Middle and third of the half width of [`Self::ends`], so that three errors reach both.
    pub fn between_ends(&self) -> Option<Estimate> {
        let [low, high] = self.ends()?;
        Some(Estimate::new(f64::midpoint(low, high), 0.5 * (high - low) / DISTINCT))
    }

    /// The same in a unit that is smaller by `factor`.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        let times = |value: f64| value * factor;
        Self {
            value: times(self.value),
            standard_error: times(self.standard_error),
            bias_bound: self.bias_bound.map(times),
            upper_bound: self.upper_bound.map(times),
            interval: self.interval.map(|ends| ends.map(times)),
            wavelength_error: self.wavelength_error.map(|error| error.times(factor)),
            film_table_error: self.film_table_error.map(|error| error.times(factor)),
            ..self
        }
    }

    /// The same of the other sign.
    #[must_use]
    pub fn negated(self) -> Self {
        Self {
            value: -self.value,
            interval: self.interval.map(|[low, high]| [-high, -low]),
            ..self
        }
    }

    /// The same with ends where figures of this unit have theirs: a fraction at 0 and 1, an angle at 0
    /// and 180°, light at 0. A ratio has no largest value: one that may be 0, or more than
    /// `LARGEST_RATIO`, is not resolved.
    #[must_use]
    pub fn in_range(self, unit: Unit) -> Self {
        let entry = self.clipped(range(unit));
        let is_open = |[low, high]: [f64; 2]| low <= 0.0 && high > LARGEST_RATIO;
        if unit == Unit::Ratio && entry.ends().is_some_and(is_open) {
            return Self {
                peak_place: PeakPlace::NotResolved,
                interval: None,
                upper_bound: None,
                ..entry
            };
        }
        entry
    }

    /// A change of a figure of this unit, in its range: no fraction changes by more than 1. One whose
    /// ends, or three errors, hold all of that is not resolved.
    #[must_use]
    pub fn in_range_of_changes(self, unit: Unit) -> Self {
        let [least, most] = range(unit);
        let largest = most - least;
        let reach = DISTINCT * self.standard_error;
        let [low, high] = self.interval.unwrap_or([self.value - reach, self.value + reach]);
        if low <= -largest && high >= largest {
            return Self { peak_place: PeakPlace::NotResolved, interval: None, ..self };
        }
        let interval = self.interval.map(|ends| ends.map(|end| end.clamp(-largest, largest)));
        Self { interval, ..self }
    }

    /// A sum of figures, of which 0 is a value as others, with its ends where it is known between ends
    /// alone.
    pub fn of_sum(sum: Estimate, interval: Option<[f64; 2]>) -> Self {
        Self { interval, upper_bound: None, ..Self::new(sum) }
    }

    /// The same with ends within the least and the most that it can be.
    fn clipped(self, [least, most]: [f64; 2]) -> Self {
        let interval = self.interval.map(|ends| ends.map(|end| end.clamp(least, most)));
        let upper_bound = self.upper_bound.map(|bound| bound.min(most));
        Self { interval, upper_bound, ..self }
    }

    /// A figure of light, which is not negative, that has this estimate and nothing else.
    pub fn new(estimate: Estimate) -> Self {
        Self::between(estimate, estimate.interval(), LIGHT)
    }

    /// The same of light whose bias is held by its bound.
    pub fn bounded(estimate: Estimate) -> Self {
        Self::within(estimate, LIGHT)
    }

    /// A share from 0 to 1 whose bias is held by its bound.
    pub fn share(estimate: Estimate) -> Self {
        Self::within(estimate, range(Unit::Fraction))
    }

    /// A figure within these limits whose bias is held by its bound.
    pub fn within(estimate: Estimate, limits: [f64; 2]) -> Self {
        Self::between(estimate, estimate.interval_of_bound(), limits)
    }

    fn between(estimate: Estimate, interval: Option<[f64; 2]>, limits: [f64; 2]) -> Self {
        let entry = Self {
            value: estimate.value,
            standard_error: estimate.standard_error,
            bias_bound: estimate.bias_bound,
            peak_place: PeakPlace::OffAxis,
            peak_range_deg: None,
            interval,
            upper_bound: upper_bound(estimate.value, estimate.standard_error),
            valley_at_mm: None,
            peak_at_mm: None,
            wavelength_error: None,
            film_table_error: None,
            reference: None,
        };
        entry.clipped(limits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metrics::chromaticity;

    /// Bounds that hold count once, value ± (bound + two of the scatter), within what a figure can be; as a
    /// control a bias that is an estimate reaches farther.
    #[test]
    fn ends_hold_a_bound_once_and_lie_within_what_a_figure_can_be() {
        let of = |value: f64, bound: f64| Estimate::new(value, 0.01).with_bias(bound);
        let plain = FigureEntry::bounded(of(0.5, 0.1));
        let [low, high] = plain.interval.expect("not resolved");
        assert!((low - 0.38).abs() < 1e-12 && (high - 0.62).abs() < 1e-12, "{low} {high}");
        let [.., wide] = FigureEntry::new(of(0.5, 0.1)).interval.expect("not resolved");
        assert!(wide - 0.5 > 1.5 * (high - 0.5), "{wide}");
        let [x, ..] = chromaticity::limits();
        for (entry, ends) in [
            // Light; a coverage; x of a red; a Duv, which may be negative.
            (FigureEntry::bounded(of(0.05, 0.1)), [0.0, 0.17]),
            (FigureEntry::share(of(0.98, 0.1)), [0.86, 1.0]),
            (FigureEntry::within(of(0.70, 0.1), x), [0.58, x[1]]),
            (FigureEntry::within(of(-0.01, 0.02), [-0.05, 0.05]), [-0.05, 0.03]),
        ] {
            let found = entry.interval.expect("not resolved");
            assert!((0..2).all(|k| (found[k] - ends[k]).abs() < 1e-12), "{found:?} {ends:?}");
        }
        assert_eq!(FigureEntry::share(of(0.98, 0.001)).interval, None);
    }
}
