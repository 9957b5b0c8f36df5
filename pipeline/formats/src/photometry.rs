// SPDX-License-Identifier: MIT OR Apache-2.0
//! A traced far field as a table of intensities, and how photometric files state such tables.
//!
//! In: power in bins of direction for 1 W emitted. Out: an intensity at points of angle, in cd for
//! a stated luminous flux of the sources. Bins hold means, files hold values between which readers
//! interpolate. Polar angles and azimuths are the edges and the middles of the bins, with the
//! values of [`bin_entries`], so that a reader that interpolates finds the flux of every bin; none
//! of it crosses an edge, such as the horizon. The rings about the axis are averaged over azimuth,
//! since on the axis all azimuths are one. The axis of the package (+z) is γ = 0.

use anyhow::{Result, ensure};
use tracer::Distribution;

use metrics::far_field::{AngularBins, BinPlacement};

use super::bin_entries::{self, Weights, polar_weights};
use super::program;

/// Statement of intensities in a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Photometry {
    /// Luminous flux of the sources, lm.
    pub lumens: f64,
    /// Absolute, else relative to the flux of the sources.
    pub absolute: bool,
    /// Electrical power, W; 0 where it is not stated.
    pub watts: f64,
}

/// Maker and names of a luminaire.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Labels {
    /// Maker.
    pub maker: String,
    /// Report of the measurement.
    pub report: String,
    /// Name of the luminaire.
    pub luminaire: String,
    /// Number in the maker's catalogue.
    pub number: String,
    /// Date.
    pub date: String,
    /// Type of lamps.
    pub lamp: String,
}

impl Labels {
    /// Labels of a simulation.
    pub fn of_simulation(name: &str) -> Self {
        Self {
            maker: program(),
            report: name.to_owned(),
            luminaire: name.to_owned(),
            date: "simulated".to_owned(),
            lamp: "LED".to_owned(),
            ..Self::default()
        }
    }

    /// Labels with the luminaire called `fallback` where it is not named.
    #[must_use]
    pub fn named(mut self, fallback: &str) -> Self {
        if self.luminaire.is_empty() {
            fallback.clone_into(&mut self.luminaire);
        }
        self
    }

    /// Labels in one order.
    pub(super) fn all(&self) -> [&str; 6] {
        [&self.maker, &self.report, &self.luminaire, &self.number, &self.date, &self.lamp]
    }
}

/// Intensity in W/sr from the power in the bins of `sphere`, W for 1 W emitted.
///
/// # Errors
/// If there is no power at all, or bins lie about multiples of their width.
pub fn distribution(powers: &[f64], sphere: &AngularBins) -> Result<Distribution> {
    let (polar, azimuths) = (sphere.polar, sphere.azimuths);
    ensure!(
        powers.len() == polar * azimuths,
        "far field: expected {polar} x {azimuths} bins, got {}",
        powers.len()
    );
    ensure!(
        sphere.bins == BinPlacement::Between,
        "far field: expected bins between multiples of their width, got bins about them"
    );
    let edge = |i: usize| (sphere.bin_deg * i as f64).to_radians();
    let weights: Vec<Weights> = (0..polar).map(|i| polar_weights(edge(i), edge(i + 1))).collect();
    let step = std::f64::consts::TAU / azimuths as f64;
    // Power per radian of azimuth; about the axis its mean.
    let content = |i: usize, j: usize| {
        let ring = &powers[i * azimuths..(i + 1) * azimuths];
        if i == 0 || i + 1 == polar {
            ring.iter().sum::<f64>() / (azimuths as f64 * step)
        } else {
            ring[j] / step
        }
    };
    let profiles: Vec<Vec<f64>> = (0..azimuths)
        .map(|j| {
            let contents: Vec<f64> = (0..polar).map(|i| content(i, j)).collect();
            bin_entries::in_a_row(&contents, &weights)
        })
        .collect();
    let thetas: Vec<f64> = (0..=2 * polar).map(|k| 0.5 * sphere.bin_deg * k as f64).collect();
    let rings: Vec<Vec<f64>> = (0..thetas.len())
        .map(|k| bin_entries::around(&profiles.iter().map(|p| p[k]).collect::<Vec<f64>>()))
        .collect();
    let phis: Vec<f64> = (0..2 * azimuths).map(|k| 180.0 * k as f64 / azimuths as f64).collect();
    let planes = 0..phis.len();
    let values = planes.flat_map(|p| rings.iter().map(move |ring| ring[p]));
    Ok(Distribution::new(&thetas, &phis, values.collect())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{READERS, Reads, WRITERS, Writes};
    use tracer::glam::DVec3;

    fn sphere(bin_deg: f64, azimuths: usize) -> AngularBins {
        AngularBins {
            bin_deg,
            polar: (180.0 / bin_deg).round() as usize,
            azimuths,
            bins: BinPlacement::Between,
        }
    }

    /// Every file of `table`, read back.
    fn files(table: &Distribution) -> Vec<(String, Distribution)> {
        let mut found = Vec::new();
        for writer in WRITERS {
            let Writes::FarField(text) = writer.writes else { continue };
            for absolute in [false, true] {
                let photometry = Photometry { lumens: 250.0, absolute, watts: 1.0 };
                let table = table.clone().scaled(250.0);
                let text = text(&Labels::of_simulation("x"), &table, photometry);
                let reader = READERS.iter().find(|reader| reader.endings == writer.endings);
                let back = match reader.expect("a reader").reads {
                    Reads::FarField(read) => read(&text),
                    Reads::LampSets(read) => read(&text, None),
                    _ => panic!("{}: expected a reader of far fields", writer.word),
                };
                let back = (back.expect("valid").distribution)().expect("a table");
                found.push((format!("{} {absolute}", writer.word), back));
            }
        }
        found
    }

    /// Flux by the midpoint rule in the quarters of a bin, between which intensities are bilinear.
    fn flux_in(table: &Distribution, sphere: &AngularBins, i: usize, j: usize) -> f64 {
        const POINTS: usize = 12;
        let (theta, phi) = (sphere.bin_deg, 360.0 / sphere.azimuths as f64);
        let at = |k: usize| (k as f64 + 0.5) / (2 * POINTS) as f64;
        let mut sum = 0.0;
        for a in 0..2 * POINTS {
            let (sin, cos) = (theta * (i as f64 + at(a))).to_radians().sin_cos();
            for b in 0..2 * POINTS {
                let (y, x) = (phi * (j as f64 + at(b))).to_radians().sin_cos();
                sum += sin * table.intensity(DVec3::new(sin * x, sin * y, cos));
            }
        }
        sum * (theta * phi).to_radians() * 1_f64.to_radians() / (4 * POINTS * POINTS) as f64
    }

    #[test]
    fn a_reader_that_interpolates_finds_the_flux_of_every_bin() {
        let sphere = sphere(5.0, 24);
        // Bright and dark bins side by side, and nothing below the horizon.
        let counts: Vec<f64> = (0..sphere.polar * 24)
            .map(|k| match (k / 24, k % 24) {
                (i, _) if i >= 18 => 0.0,
                (i, j) if (i + j) % 5 == 0 => 0.0,
                (i, j) => 1.0 + ((7 * i + 3 * j) % 11) as f64,
            })
            .collect();
        let whole: f64 = counts.iter().sum();
        let powers: Vec<f64> = counts.iter().map(|c| c / whole).collect();
        let table = distribution(&powers, &sphere).expect("a far field");
        assert!((table.flux() - 1.0).abs() < 1e-12);
        for (name, back) in files(&table) {
            assert!((back.flux() / 250.0 - 1.0).abs() < 1e-6, "{name}");
            let mut below = 0.0;
            for i in 0..sphere.polar {
                let ring = &counts[i * 24..(i + 1) * 24];
                let found: Vec<f64> =
                    (0..24).map(|j| flux_in(&back, &sphere, i, j) * whole / 250.0).collect();
                if i >= 18 {
                    below += found.iter().sum::<f64>();
                    continue;
                }
                let [total, expected] = [&found[..], ring].map(|r| r.iter().sum::<f64>());
                assert!((total / expected - 1.0).abs() < 2e-3, "{name} {i}: {total} {expected}");
                for (got, expected) in found.iter().zip(ring).filter(|_| i > 0) {
                    assert!((got - expected).abs() < 5e-3, "{name} {i}: {got} {expected}");
                }
            }
            assert!(below.abs() < f64::MIN_POSITIVE, "{name}: {below}");
        }
    }

    #[test]
    fn a_lambertian_far_field_keeps_its_shape() {
        let sphere = sphere(2.0, 36);
        let edge = |i: usize| (2.0 * i as f64).min(90.0).to_radians().sin().powi(2);
        let powers: Vec<f64> =
            (0..90 * 36).map(|k| (edge(k / 36 + 1) - edge(k / 36)) / 36.0).collect();
        let table = distribution(&powers, &sphere).expect("a far field");
        assert!((table.flux() - 1.0).abs() < 1e-12);
        for theta in [0.0_f64, 10.0, 45.0, 80.0] {
            let d = DVec3::new(theta.to_radians().sin(), 0.0, theta.to_radians().cos());
            let expected = theta.to_radians().cos() / std::f64::consts::PI;
            assert!((table.intensity(d) - expected).abs() < 1e-3);
        }
        for (name, back) in files(&table) {
            let flux = back.flux();
            assert!((flux / 250.0 - 1.0).abs() < 1e-6, "{name}: {flux}");
        }
    }
}
