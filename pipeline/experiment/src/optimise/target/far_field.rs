// SPDX-License-Identifier: MIT OR Apache-2.0
//! A target far field: relative intensity over the polar angle, and how far a trace is from it.

use anyhow::{Result, ensure};

use results::paired_figure::PairedFigure;
use simulate::observation::Observation;

use super::rows;

/// Relative intensity over the polar angle.
#[derive(Debug, Clone, PartialEq)]
pub struct FarFieldTarget {
    /// Angle and intensity, angles ascending.
    points: Vec<[f64; 2]>,
}

impl FarFieldTarget {
    /// Lines of an angle in degrees and an intensity in any unit, angles ascending.
    ///
    /// # Errors
    /// A line that is no such pair, fewer than two of them, no light.
    pub fn parse(text: &str) -> Result<Self> {
        let expected = "an ascending angle from 0 to 90 degrees and an intensity of at least 0";
        let points = rows::read(text, expected, |before, [angle, intensity]: [f64; 2]| {
            (0.0..=90.0).contains(&angle)
                && intensity.is_finite()
                && intensity >= 0.0
                && before.last().is_none_or(|last| last[0] < angle)
        })?;
        ensure!(
            points.len() >= 2 && points.iter().any(|p| p[1] > 0.0),
            "expected at least two angles and some light, got {}",
            points.len()
        );
        Ok(Self { points })
    }

    /// Intensity at `angle`: straight between points, 0 beyond the last, level below the first.
    fn at(&self, angle: f64) -> f64 {
        let after = self.points.partition_point(|p| p[0] < angle);
        match (after.checked_sub(1), self.points.get(after)) {
            (_, None) => 0.0,
            (None, Some(first)) => first[1],
            (Some(before), Some([b, high])) => {
                let [a, low] = self.points[before];
                low + (high - low) * (angle - a) / (b - a)
            }
        }
    }

    /// Root mean square difference of the azimuthal mean of the intensity from the target over the
    /// upper hemisphere by solid angle, both scaled to the same flux; 1 is the root mean square of
    /// the target.
    pub fn distance(&self, seen: &Observation) -> PairedFigure {
        let sphere = seen.sphere;
        let upper = sphere.centres_deg().into_iter().take_while(|c| *c < 90.0);
        let target: Vec<f64> = upper.map(|centre| self.at(centre)).collect();
        let weights: Vec<f64> = (0..target.len()).map(|ring| sphere.ring_sr(ring)).collect();
        let intensity = seen.far_field.map(|powers| {
            let mut profile = sphere.profile(powers);
            profile.truncate(target.len());
            profile
        });
        super::distance(&intensity, &target, &weights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_straight_between_points_and_dark_beyond() {
        let target =
            FarFieldTarget::parse("angle, intensity\n10, 1 # low\n30; 3\n").expect("valid");
        for (angle, expected) in [(0.0, 1.0), (10.0, 1.0), (20.0, 2.0), (30.0, 3.0), (31.0, 0.0)] {
            assert!((target.at(angle) - expected).abs() < 1e-15, "{angle}");
        }
    }

    #[test]
    fn lines_that_are_no_pairs_are_refused() {
        for text in ["1 2\n1 3\n", "1 2\n2 x\n", "1 2\n95 3\n", "1 2\n", "1 0\n2 0\n", "1 2 3\n"] {
            assert!(FarFieldTarget::parse(text).is_err(), "{text}");
        }
    }
}
