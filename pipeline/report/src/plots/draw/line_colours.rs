// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours of the curves of one picture: by their kinds, or along a scale.

use super::colour::{Colour, oklch};
use super::palette;

/// Choice of the colours of the curves of one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineColours {
    /// Models, by their numbers in the palette.
    Models,
    /// Cuts or profiles of the model of this number: its colour, told apart by dashes.
    OfModel(usize),
    /// Errors of different origin: greys, told apart by dashes.
    Neutral,
    /// A numbered series: one scale from dark to light.
    Ordered,
    /// A numbered series and, last, what it adds up to: the scale, then black.
    OrderedAndSum,
}

impl LineColours {
    /// Colour of curve `index` of `count`.
    pub fn pick(self, index: usize, count: usize) -> Colour {
        match self {
            Self::Models => palette::model(index),
            Self::OfModel(number) => palette::model(number),
            Self::Neutral => palette::neutral(index),
            Self::OrderedAndSum if index + 1 == count => Colour::BLACK,
            Self::OrderedAndSum => Self::Ordered.pick(index, count - 1),
            Self::Ordered => {
                let share = index as f64 / (count.max(2) - 1) as f64;
                let mix = |from: f64, to: f64| from + (to - from) * share;
                oklch(mix(0.36, 0.80), 0.155, mix(-75.0, 85.0))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_stays_within_what_screens_show() {
        // The assertion within `oklch` judges.
        for i in 0..=1000 {
            LineColours::Ordered.pick(i, 1001);
        }
    }

    #[test]
    fn neighbouring_lines_differ() {
        for colours in [LineColours::Models, LineColours::Ordered] {
            for i in 1..4 {
                let (a, b) = (colours.pick(i - 1, 6).rgb, colours.pick(i, 6).rgb);
                let distance: i32 = (0..3).map(|k| (i32::from(a[k]) - i32::from(b[k])).abs()).sum();
                assert!(distance > 30, "{colours:?} {i}: {a:?} {b:?}");
            }
        }
    }
}
