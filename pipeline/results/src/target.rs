// SPDX-License-Identifier: MIT OR Apache-2.0
//! Targets of figures, and verdicts on their values.

use serde::{Deserialize, Serialize};

use metrics::estimate::DISTINCT;
use metrics::far_field::PeakPlace;
use metrics::quantity::Unit;
use metrics::{Bounds, Estimate};

use crate::figure_entry::FigureEntry;
use crate::shown;

/// Sought value of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sought {
    /// A value, within a scale.
    Near(f64),
    /// Bounds.
    Within(Bounds),
}

/// A target with its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Sought value.
    pub sought: Sought,
    /// A miss that counts as 1.
    pub scale: f64,
}

/// Verdict on a figure with a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Within the target beyond errors.
    Met,
    /// Outside of the target beyond errors.
    NotMet,
    /// Errors decide.
    NotResolved,
}

impl Verdict {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::NotMet => "not met",
            Self::NotResolved => "not resolved",
        }
    }
}

impl Target {
    /// Signed distance of `value` from the target in scales; 0 within bounds.
    pub fn miss(self, value: f64) -> f64 {
        let miss = match self.sought {
            Sought::Near(target) => value - target,
            Sought::Within(Bounds { at_least, at_most }) => {
                let below = at_least.map_or(0.0, |least| (value - least).min(0.0));
                below + at_most.map_or(0.0, |most| (value - most).max(0.0))
            }
        };
        miss / self.scale
    }

    /// Verdict on a figure: it meets the target where it lies within the scale of a value, or
    /// within bounds.
    pub fn verdict(self, figure: Estimate) -> Verdict {
        let value = figure.value;
        let room = match self.sought {
            Sought::Near(target) => self.scale - (value - target).abs(),
            Sought::Within(Bounds { at_least, at_most }) => {
                let above = at_least.map_or(f64::INFINITY, |least| value - least);
                above.min(at_most.map_or(f64::INFINITY, |most| most - value))
            }
        };
        let error = DISTINCT * figure.standard_error;
        match room {
            room if room >= error => Verdict::Met,
            room if room < -error => Verdict::NotMet,
            _ => Verdict::NotResolved,
        }
    }

    /// Verdict on a figure in any state; one between two ends counts three errors to each.
    pub fn judge(self, figure: &FigureEntry) -> Verdict {
        match figure.peak_place {
            PeakPlace::OnAxis => Verdict::NotMet,
            PeakPlace::NotResolved => Verdict::NotResolved,
            PeakPlace::OffAxis => self.verdict(figure.between_ends().unwrap_or(figure.estimate())),
        }
    }

    /// For people, of a figure in `unit`.
    pub fn words(self, unit: Unit) -> String {
        match self.sought {
            Sought::Near(target) => shown::near(target, self.scale, unit),
            Sought::Within(bounds) => shown::bounds(bounds, unit),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_of_a_figure_is_judged() {
        let target = Target { sought: Sought::Near(20.0), scale: 5.0 };
        let plain = |value: f64, error: f64| FigureEntry::new(Estimate::new(value, error));
        let between = |ends| FigureEntry { interval: Some(ends), ..plain(20.0, 0.0) };
        let placed = |peak_place| FigureEntry { peak_place, ..plain(20.0, 0.1) };
        for (entry, verdict) in [
            (plain(21.0, 0.1), Verdict::Met),
            (plain(26.0, 0.1), Verdict::NotMet),
            (plain(25.0, 1.0), Verdict::NotResolved),
            (between([17.5, 22.5]), Verdict::Met),
            (between([22.5, 27.5]), Verdict::NotResolved),
            (between([27.5, 32.5]), Verdict::NotMet),
            (placed(PeakPlace::OnAxis), Verdict::NotMet),
            (placed(PeakPlace::NotResolved), Verdict::NotResolved),
        ] {
            assert_eq!(target.judge(&entry), verdict, "{entry:?}");
        }
    }
}
