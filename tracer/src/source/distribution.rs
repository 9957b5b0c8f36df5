// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tabulated intensity distributions, as photometric files hold them.
//!
//! Between the table's angles the intensity is bilinear in θ and φ. The flux is its exact integral,
//! cell by cell. A direction is sampled by choosing a cell in proportion to its largest corner
//! times its solid angle, then by rejection within the cell. θ is measured from the axis of the
//! source (+z), φ from +x towards +y.

use glam::DVec3;
use rand::Rng;
use std::f64::consts::TAU;

use crate::error::{Error, check};
use crate::random;

/// Smallest distance of two angles of a table, degrees: below, it is lost in rounding.
const CLOSEST_DEG: f64 = 1e-6;
/// Highest intensity; sums of it stay far from overflow.
const HIGHEST: f64 = 1e100;

/// A tabulated intensity in any unit per steradian.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    /// Polar angles, radians, ascending, at least two.
    thetas: Vec<f64>,
    /// Azimuths, radians, ascending from 0, below a whole turn; one stands for rotational symmetry.
    phis: Vec<f64>,
    /// Shape (azimuth, polar angle).
    values: Vec<f64>,
    /// Running sums of largest corner × solid angle, cell by cell, azimuth slower.
    bounds: Vec<f64>,
}

impl Distribution {
    /// Values of shape (azimuth, polar angle) at angles in degrees: polar angles ascending within 0
    /// to 180, at least two; azimuths ascending, from 0 up to below 360. Beyond the first and last
    /// polar angle the intensity is 0.
    pub fn new(thetas_deg: &[f64], phis_deg: &[f64], values: Vec<f64>) -> Result<Self, Error> {
        for (what, angles, min, range) in [
            ("polar angles of an intensity table", thetas_deg, 2, 0.0..=180.0),
            ("azimuths of an intensity table", phis_deg, 1, 0.0..=359.999_999),
        ] {
            if angles.len() < min {
                return Err(Error::TooFew { what, expected: min, got: angles.len() });
            }
            for (k, angle) in angles.iter().enumerate() {
                let ascends = k == 0 || *angle >= angles[k - 1] + CLOSEST_DEG;
                check(
                    &format!("{what}, degrees"),
                    *angle,
                    "angles ascending by 1e-6 degrees at least, within the range",
                    ascends && range.contains(angle),
                )?;
            }
        }
        let expected = thetas_deg.len() * phis_deg.len();
        check(
            "number of intensities",
            values.len() as f64,
            "one for each combination of angles",
            values.len() == expected,
        )?;
        for value in &values {
            let range = 0.0..=HIGHEST;
            check("intensity", *value, "0 to 1e100", range.contains(value))?;
        }
        let radians = |list: &[f64]| list.iter().map(|a| a.to_radians()).collect();
        let mut distribution = Self {
            thetas: radians(thetas_deg),
            phis: radians(phis_deg),
            values,
            bounds: Vec::new(),
        };
        let mut sum = 0.0;
        for plane in 0..distribution.phis.len() {
            for ring in 0..distribution.thetas.len() - 1 {
                let corners = distribution.corners(plane, ring);
                let largest = corners.into_iter().fold(0.0, f64::max);
                sum += largest * distribution.solid_angle(plane, ring);
                distribution.bounds.push(sum);
            }
        }
        check("flux of an intensity table", sum, "above 0", sum > 0.0)?;
        Ok(distribution)
    }

    /// Polar angles, degrees.
    pub fn thetas_deg(&self) -> Vec<f64> {
        degrees(&self.thetas)
    }

    /// Azimuths, degrees.
    pub fn phis_deg(&self) -> Vec<f64> {
        degrees(&self.phis)
    }

    /// The value at an azimuth and a polar angle of the table.
    pub fn value(&self, phi: usize, theta: usize) -> f64 {
        self.values[phi * self.thetas.len() + theta]
    }

    fn next_plane(&self, plane: usize) -> usize {
        (plane + 1) % self.phis.len()
    }

    /// Azimuth where the cells of `plane` end, radians.
    fn plane_end(&self, plane: usize) -> f64 {
        if plane + 1 < self.phis.len() { self.phis[plane + 1] } else { self.phis[0] + TAU }
    }

    /// Values at the corners of a cell: both polar angles of its azimuth, then both of the next.
    fn corners(&self, plane: usize, ring: usize) -> [f64; 4] {
        let next = self.next_plane(plane);
        [
            self.value(plane, ring),
            self.value(plane, ring + 1),
            self.value(next, ring),
            self.value(next, ring + 1),
        ]
    }

    fn solid_angle(&self, plane: usize, ring: usize) -> f64 {
        let width = self.plane_end(plane) - self.phis[plane];
        width * (self.thetas[ring].cos() - self.thetas[ring + 1].cos())
    }

    /// Integral of the intensity over all directions.
    pub fn flux(&self) -> f64 {
        let mut sum = 0.0;
        for plane in 0..self.phis.len() {
            let width = self.plane_end(plane) - self.phis[plane];
            for (ring, ends) in self.thetas.windows(2).enumerate() {
                let [a, b, c, d] = self.corners(plane, ring);
                let (low, high) = (0.5 * (a + c), 0.5 * (b + d));
                // ∫ (low + slope (θ - θ0)) sin θ dθ, with slope (high - low) / (θ1 - θ0).
                let [t0, t1] = [ends[0], ends[1]];
                let slope = (high - low) / (t1 - t0);
                let ring = low * (t0.cos() - t1.cos())
                    + slope * (t1.sin() - t0.sin() - (t1 - t0) * t1.cos());
                // Rounding of a narrow ring must not take light away.
                sum += width * ring.max(0.0);
            }
        }
        sum
    }

    /// Intensity at a direction (unit).
    pub fn intensity(&self, direction: DVec3) -> f64 {
        let theta = direction.z.clamp(-1.0, 1.0).acos();
        let phi = direction.y.atan2(direction.x).rem_euclid(TAU);
        self.at(theta, phi)
    }

    fn at(&self, theta: f64, phi: f64) -> f64 {
        let last = self.thetas.len() - 1;
        if theta < self.thetas[0] || theta > self.thetas[last] {
            return 0.0;
        }
        let ring = self.thetas.partition_point(|t| *t <= theta).clamp(1, last) - 1;
        let planes = self.phis.len();
        let plane = (self.phis.partition_point(|p| *p <= phi) + planes - 1) % planes;
        let from_plane = (phi - self.phis[plane]).rem_euclid(TAU);
        let u = from_plane / (self.plane_end(plane) - self.phis[plane]);
        let v = (theta - self.thetas[ring]) / (self.thetas[ring + 1] - self.thetas[ring]);
        let [a, b, c, d] = self.corners(plane, ring);
        (1.0 - u) * ((1.0 - v) * a + v * b) + u * ((1.0 - v) * c + v * d)
    }

    /// Samples a direction in proportion to the intensity.
    pub fn sample(&self, rng: &mut (impl Rng + ?Sized)) -> DVec3 {
        let all = self.bounds[self.bounds.len() - 1];
        let rings = self.thetas.len() - 1;
        loop {
            let level = random::unit(rng) * all;
            let cell = self.bounds.partition_point(|b| *b <= level).min(self.bounds.len() - 1);
            let (plane, ring) = (cell / rings, cell % rings);
            let phi =
                self.phis[plane] + random::unit(rng) * (self.plane_end(plane) - self.phis[plane]);
            let [top, bottom] = [self.thetas[ring].cos(), self.thetas[ring + 1].cos()];
            let cos_theta = top + random::unit(rng) * (bottom - top);
            let theta = cos_theta.clamp(-1.0, 1.0).acos();
            let largest = self.corners(plane, ring).into_iter().fold(0.0, f64::max);
            if random::unit(rng) * largest <= self.at(theta, phi.rem_euclid(TAU)) {
                let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
                return DVec3::new(sin_theta * phi.cos(), sin_theta * phi.sin(), cos_theta);
            }
        }
    }

    /// The same with all values times `factor`, which is finite and above 0.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for value in self.values.iter_mut().chain(&mut self.bounds) {
            *value *= factor;
        }
        self
    }
}

/// Radians in degrees, without the rounding of degrees to radians and back.
fn degrees(radians: &[f64]) -> Vec<f64> {
    radians.iter().map(|r| (r.to_degrees() * 1e9).round() / 1e9).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn every(step: f64, last: f64) -> Vec<f64> {
        (0..=(last / step).round() as usize).map(|k| k as f64 * step).collect()
    }

    #[test]
    fn flux_of_known_distributions() {
        let isotropic = Distribution::new(&[0.0, 180.0], &[0.0], vec![2.0, 2.0]).unwrap();
        assert!((isotropic.flux() - 8.0 * PI).abs() < 1e-12);
        let thetas = every(0.5, 90.0);
        let cosine = thetas.iter().map(|t: &f64| t.to_radians().cos()).collect();
        let lambertian = Distribution::new(&thetas, &[0.0], cosine).unwrap();
        assert!((lambertian.flux() / PI - 1.0).abs() < 1e-5, "{}", lambertian.flux());
    }

    #[test]
    fn draws_follow_the_intensity() {
        let thetas = every(15.0, 120.0);
        let phis = [0.0, 60.0, 90.0, 200.0];
        let values = (0..phis.len() * thetas.len()).map(|k| 1.0 + ((k * 7) % 5) as f64).collect();
        let table = Distribution::new(&thetas, &phis, values).unwrap();
        let mut rng = random::stream(3, 0);
        let count = 200_000;
        // Power in 6 × 8 cells, by sampling and by a fine midpoint sum.
        let cell = |d: DVec3| {
            let theta = (d.z.acos().to_degrees() / 20.0) as usize;
            let phi = (d.y.atan2(d.x).rem_euclid(TAU).to_degrees() / 45.0) as usize;
            theta.min(5) * 8 + phi.min(7)
        };
        let (mut drawn, mut expected) = ([0.0; 48], [0.0; 48]);
        for _ in 0..count {
            drawn[cell(table.sample(&mut rng))] += 1.0;
        }
        for i in 0..480 {
            for j in 0..1440 {
                let (theta, phi) = (
                    (f64::from(i) + 0.5) * 0.25_f64.to_radians(),
                    (f64::from(j) + 0.5) * 0.25_f64.to_radians(),
                );
                let d = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                expected[cell(d)] +=
                    table.intensity(d) * theta.sin() * 0.25_f64.to_radians().powi(2);
            }
        }
        let whole: f64 = expected.iter().sum();
        assert!((whole / table.flux() - 1.0).abs() < 1e-4);
        for (got, expected) in drawn.iter().zip(expected) {
            let mean = expected / whole * f64::from(count);
            assert!((got - mean).abs() < 5.0 * mean.sqrt().max(1.0), "{got} {mean}");
        }
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let bad: [(&[f64], &[f64], Vec<f64>); 9] = [
            (&[0.0], &[0.0], vec![1.0]),
            (&[0.0, 0.0], &[0.0], vec![1.0; 2]),
            (&[0.0, 190.0], &[0.0], vec![1.0; 2]),
            (&[0.0, 90.0], &[0.0, 360.0], vec![1.0; 4]),
            (&[0.0, 90.0], &[0.0], vec![1.0; 3]),
            (&[0.0, 90.0], &[0.0], vec![1.0, f64::NAN]),
            (&[0.0, 90.0], &[0.0], vec![0.0; 2]),
            (&[0.0, 1e-320, 90.0], &[0.0], vec![1.0; 3]),
            (&[0.0, 90.0], &[0.0], vec![1e308; 2]),
        ];
        for (thetas, phis, values) in bad {
            assert!(Distribution::new(thetas, phis, values).is_err(), "{thetas:?} {phis:?}");
        }
    }
}
