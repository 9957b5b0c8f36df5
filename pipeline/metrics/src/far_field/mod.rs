// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far field: intensity over the polar angle, averaged over azimuth or in a cut, and the figures
//! read from it.
//!
//! Bin i covers θ between two edges over all azimuths; its intensity is its power over its solid
//! angle 2π (cos θ_i - cos θ_{i+1}). Edges are multiples of the width, or lie half way between
//! them.

mod far_field_metrics;
mod peak_place;

use std::f64::consts::PI;

pub use far_field_metrics::{FarFieldFigures, FarFieldReading, PeakMethod, PlainFarField};
pub use peak_place::{PeakPlace, VISIBLE};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Bins of the far field: θ from 0 to 180°, φ from 0 to 360°; bin (θ, φ) is at `theta * azimuths +
/// phi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngularBins {
    /// Bin of θ, degrees.
    pub bin_deg: f64,
    /// Number of bins of θ.
    pub polar: usize,
    /// Number of bins of φ.
    pub azimuths: usize,
    /// Where the bins of θ lie.
    pub bins: BinPlacement,
}

/// Where the bins of the polar angle lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BinPlacement {
    /// Between multiples of their width.
    #[default]
    Between,
    /// About multiples of their width, the first half as wide.
    About,
}

impl AngularBins {
    /// The polar angles between which ring `i` lies, degrees.
    fn edges_deg(&self, i: usize) -> [f64; 2] {
        let shift = match self.bins {
            BinPlacement::Between => 0.0,
            BinPlacement::About => 0.5,
        };
        [i, i + 1].map(|k| (self.bin_deg * (k as f64 - shift)).clamp(0.0, 180.0))
    }

    /// Solid angle of the ring `i` of θ over all azimuths, sr.
    pub fn ring_sr(&self, i: usize) -> f64 {
        let [from, to] = self.edges_deg(i).map(|edge| edge.to_radians().cos());
        2.0 * PI * (from - to)
    }

    /// Middle of ring `i`, degrees; of one about the axis, 0.
    pub fn centre_deg(&self, i: usize) -> f64 {
        match self.bins {
            BinPlacement::Between => (i as f64 + 0.5) * self.bin_deg,
            BinPlacement::About => i as f64 * self.bin_deg,
        }
    }

    /// Number of rings within the upper hemisphere, at least 1.
    fn upper(&self) -> usize {
        let within = |i: &usize| self.edges_deg(*i)[1] <= 90.0 + 1e-9;
        (0..self.polar).take_while(within).count().max(1)
    }

    /// Number of rings below the polar angle `deg`, at least 1.
    fn below(&self, deg: f64) -> usize {
        let within = |i: &usize| self.edges_deg(*i)[1] <= deg + 1e-9;
        (0..self.polar).take_while(within).count().max(1)
    }

    /// Middles of all rings, degrees.
    pub fn centres_deg(&self) -> Vec<f64> {
        (0..self.polar).map(|i| self.centre_deg(i)).collect()
    }

    /// Intensity averaged over azimuth in every ring, W/sr, for powers in all bins.
    pub fn profile(&self, powers: &[f64]) -> Vec<f64> {
        (0..self.polar)
            .map(|i| {
                powers[i * self.azimuths..(i + 1) * self.azimuths].iter().sum::<f64>()
                    / self.ring_sr(i)
            })
            .collect()
    }

    /// Share of the power between two polar angles; a ring counts where its middle lies. 0 without
    /// power.
    pub fn share(&self, powers: &[f64], from_deg: f64, to_deg: f64) -> f64 {
        let within = |i: usize| (from_deg..to_deg).contains(&self.centre_deg(i));
        let ring =
            |i: usize| powers[i * self.azimuths..(i + 1) * self.azimuths].iter().sum::<f64>();
        let all: f64 = powers.iter().sum();
        let part: f64 = (0..self.polar).filter(|&i| within(i)).map(ring).sum();
        if all > 0.0 { part / all } else { 0.0 }
    }

    /// Intensity in the half-planes at these azimuths, averaged, W/sr. A half-plane on an edge
    /// between two bins takes both.
    pub fn half_planes(&self, powers: &[f64], azimuths_deg: &[f64]) -> Vec<f64> {
        let width = 360.0 / self.azimuths as f64;
        let mut chosen = Vec::new();
        for azimuth in azimuths_deg {
            let place = azimuth / width;
            let bin = place.floor() as usize % self.azimuths;
            chosen.push(bin);
            if (place - place.round()).abs() < 1e-9 {
                let edge = place.round() as usize % self.azimuths;
                // Beside the edge, on whichever side the bin above is not.
                chosen.push(if edge == bin {
                    (edge + self.azimuths - 1) % self.azimuths
                } else {
                    edge
                });
            }
        }
        let solid_share = chosen.len() as f64 / self.azimuths as f64;
        (0..self.polar)
            .map(|i| {
                chosen.iter().map(|&j| powers[i * self.azimuths + j]).sum::<f64>()
                    / (self.ring_sr(i) * solid_share)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::illuminance::Symmetry;

    const BINS: AngularBins =
        AngularBins { bin_deg: 2.0, polar: 90, azimuths: 36, bins: BinPlacement::Between };

    #[test]
    fn cut_reads_its_own_azimuths() {
        let mut p = vec![0.0; BINS.polar * BINS.azimuths];
        // 1 W/sr in the bins on both sides of φ = 90°, nothing elsewhere.
        for j in [8, 9] {
            p[10 * 36 + j] = BINS.ring_sr(10) / 36.0;
        }
        let read = |symmetry: Symmetry, azimuth: f64| {
            BINS.half_planes(&p, &symmetry.azimuths(azimuth))[10]
        };
        assert!((read(Symmetry::Square, 0.0) - 0.25).abs() < 1e-12);
        assert!(read(Symmetry::Square, 45.0).abs() < 1e-15);
        // A rectangle keeps x and y apart, and without symmetry every half-plane stands alone.
        assert!((read(Symmetry::Rectangle, 90.0) - 0.5).abs() < 1e-12);
        assert!(read(Symmetry::Rectangle, 0.0).abs() < 1e-15);
        assert!((read(Symmetry::None, 90.0) - 1.0).abs() < 1e-12);
        assert!(read(Symmetry::None, 270.0).abs() < 1e-15);
        assert!((BINS.profile(&p)[10] - 2.0 / 36.0).abs() < 1e-12);
    }
}
