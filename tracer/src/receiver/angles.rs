// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bins of direction: polar angle to an axis and azimuth about it, between angles or about planes
//! as luminaires are measured.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use crate::error::{Error, check};

/// Position of bins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Between multiples of the widths: bin 0 of the polar angle from 0 to one width.
    Between,
    /// About multiples of the widths, as C-γ planes are: C is φ and γ is θ; bin 0 of γ ends at half
    /// a width, and so does the last one begin; bin 0 of C reaches half a width to either side of C
    /// = 0.
    About,
}

/// Bins of polar angle θ from 0 to an end, and of azimuth φ all round. Bin number = θ bin · number
/// of φ bins + φ bin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angles {
    layout: Layout,
    /// Largest polar angle, degrees.
    end_deg: f64,
    /// Widths into which θ is divided; bins about multiples are one more.
    steps: usize,
    phis: usize,
    /// Axes of a cone whose polar axis is not that of the directions: at azimuth 0 and 90° and along
    /// it, as columns.
    view: Option<DMat3>,
}

impl Angles {
    /// The whole sphere in bins of these widths in degrees, which must divide 180 and 360.
    pub fn sphere(layout: Layout, theta_deg: f64, phi_deg: f64) -> Result<Self, Error> {
        Self::new(layout, 180.0, theta_deg, phi_deg)
    }

    /// Directions up to the polar angle `end_deg`, at most 90 degrees, which the width must divide.
    pub fn cone(end_deg: f64, theta_deg: f64, phi_deg: f64) -> Result<Self, Error> {
        check("largest polar angle, degrees", end_deg, "up to 90", end_deg <= 90.0)?;
        Self::new(Layout::Between, end_deg, theta_deg, phi_deg)
    }

    /// True of directions about a view, not about the polar axis.
    pub fn has_view(&self) -> bool {
        self.view.is_some()
    }

    /// The same cone about the direction at this polar angle and azimuth, degrees, and no longer
    /// about the polar axis; azimuth 0 leads away from that. The cone does not reach below it.
    pub fn about(self, [theta_deg, phi_deg]: [f64; 2]) -> Result<Self, Error> {
        let end = 90.0 - self.end_deg;
        let range = "at least 0, and up to 90 with the cone";
        let is_above = (0.0..=end).contains(&theta_deg);
        check("polar angle of a view, degrees", theta_deg, range, is_above)?;
        check("azimuth of a view, degrees", phi_deg, "finite", phi_deg.is_finite())?;
        let [theta, phi] = [theta_deg, phi_deg].map(f64::to_radians);
        let turn = DMat3::from_rotation_z(phi) * DMat3::from_rotation_y(theta);
        Ok(Self { view: (theta > 0.0).then_some(turn), ..self })
    }

    fn new(layout: Layout, end_deg: f64, theta_deg: f64, phi_deg: f64) -> Result<Self, Error> {
        Ok(Self {
            layout,
            end_deg,
            steps: super::far_field::count("θ bins", end_deg, theta_deg)?,
            phis: super::far_field::count("φ bins", 360.0, phi_deg)?,
            view: None,
        })
    }

    /// Number of bins in θ.
    pub fn thetas(&self) -> usize {
        match self.layout {
            Layout::Between => self.steps,
            Layout::About => self.steps + 1,
        }
    }

    /// Number of bins in φ.
    pub fn phis(&self) -> usize {
        self.phis
    }

    /// Number of all bins.
    pub fn bins(&self) -> usize {
        self.thetas() * self.phis
    }

    /// Bounds of the bins in θ, degrees, one more than bins.
    pub fn theta_edges_deg(&self) -> Vec<f64> {
        let width = self.end_deg / self.steps as f64;
        (0..=self.thetas())
            .map(|k| match self.layout {
                Layout::Between => k as f64 * width,
                Layout::About => ((k as f64 - 0.5) * width).clamp(0.0, self.end_deg),
            })
            .collect()
    }

    /// Bounds of the bins in φ, degrees, one more than bins; the first may be negative.
    pub fn phi_edges_deg(&self) -> Vec<f64> {
        let width = 360.0 / self.phis as f64;
        let shift = match self.layout {
            Layout::Between => 0.0,
            Layout::About => 0.5,
        };
        (0..=self.phis).map(|k| (k as f64 - shift) * width).collect()
    }

    /// Solid angle of one bin in every row of θ, sr: Δφ (cos θ₀ - cos θ₁).
    pub fn solid_angles(&self) -> Vec<f64> {
        // cos a - cos b = 2 sin((a + b)/2) sin((b - a)/2), without cancellation.
        self.rows(|a, b| 2.0 * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin())
    }

    /// Solid angle times the cosine to the polar axis of the directions, integrated over every bin,
    /// sr: Δφ (sin² θ₁ - sin² θ₀)/2. About a view at α to that axis, cos α times this less
    ///
    /// sin α (sin φ₁ - sin φ₀) (θ₁ - θ₀ - sin θ₁ cos θ₁ + sin θ₀ cos θ₀)/2.
    pub fn projected_solid_angles(&self) -> Vec<f64> {
        let rows = self.rows(|a, b| 0.5 * (a + b).sin() * (b - a).sin());
        let Some(view) = self.view else {
            return rows.iter().flat_map(|row| std::iter::repeat_n(*row, self.phis)).collect();
        };
        let [across, along] = [view.x_axis.z, view.z_axis.z];
        let thetas = self.theta_edges_deg();
        let phis: Vec<f64> =
            self.phi_edges_deg().iter().map(|edge| edge.to_radians().sin()).collect();
        let of_row = |(row, edges): (f64, &[f64])| -> Vec<f64> {
            let part = |edge: f64| edge.to_radians() - 0.5 * (2.0 * edge.to_radians()).sin();
            let polar = 0.5 * (part(edges[1]) - part(edges[0]));
            phis.windows(2).map(|ends| along * row + across * polar * (ends[1] - ends[0])).collect()
        };
        rows.into_iter().zip(thetas.windows(2)).flat_map(of_row).collect()
    }

    fn rows(&self, per_azimuth: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let edges = self.theta_edges_deg();
        let rows = edges.windows(2).map(|pair| {
            let [a, b] = [pair[0], pair[1]].map(f64::to_radians);
            TAU / self.phis as f64 * per_azimuth(a, b)
        });
        rows.collect()
    }

    /// The bin of a direction, with the polar axis of directions along its third component; `None`
    /// beyond the end.
    #[inline]
    pub(super) fn bin(&self, direction: [f64; 3]) -> Option<usize> {
        let seen = |view: DMat3| (view.transpose() * DVec3::from_array(direction)).to_array();
        let [x, y, z] = self.view.map_or(direction, seen);
        let theta = x.hypot(y).atan2(z);
        let end = self.end_deg.to_radians();
        if theta > end && self.end_deg < 180.0 {
            return None;
        }
        let (polar, azimuth) =
            (theta / end * self.steps as f64, y.atan2(x).rem_euclid(TAU) / TAU * self.phis as f64);
        let (theta, phi) = match self.layout {
            Layout::Between => (polar as usize, azimuth as usize),
            Layout::About => ((polar + 0.5) as usize, (azimuth + 0.5) as usize),
        };
        // At the very end of a range rounding may name the bin beyond.
        Some(theta.min(self.thetas() - 1) * self.phis + phi % self.phis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn direction(theta_deg: f64, phi_deg: f64) -> [f64; 3] {
        let (theta, phi) = (theta_deg.to_radians(), phi_deg.to_radians());
        [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
    }

    #[test]
    fn measures_add_up_and_directions_find_their_bins() {
        let between = Angles::sphere(Layout::Between, 7.5, 30.0).unwrap();
        let about = Angles::sphere(Layout::About, 7.5, 30.0).unwrap();
        let half = Angles::cone(90.0, 7.5, 30.0).unwrap();
        assert_eq!((between.thetas(), about.thetas(), half.thetas()), (24, 25, 12));
        for (angles, whole) in [(between, 4.0 * PI), (about, 4.0 * PI), (half, 2.0 * PI)] {
            let sum: f64 = angles.solid_angles().iter().sum();
            assert!((sum * 12.0 / whole - 1.0).abs() < 1e-14);
            let (thetas, phis) = (angles.theta_edges_deg(), angles.phi_edges_deg());
            for (t, row) in thetas.windows(2).enumerate() {
                for (p, column) in phis.windows(2).enumerate() {
                    let middle = direction(0.5 * (row[0] + row[1]), 0.5 * (column[0] + column[1]));
                    assert_eq!(angles.bin(middle), Some(t * 12 + p));
                }
            }
        }
        let projected: f64 = half.projected_solid_angles().iter().sum();
        assert!((projected / PI - 1.0).abs() < 1e-14);
        assert_eq!(half.bin(direction(90.1, 0.0)), None);
        assert_eq!(about.bin(direction(60.0, -14.0)), Some(8 * 12));
        assert_eq!(about.bin(direction(60.0, 14.0)), Some(8 * 12));
        assert!(between.bin([0.0, 0.0, -1.0]).unwrap() < between.bins());
        assert!(Angles::cone(90.0, 7.0, 30.0).is_err());
        let cone = Angles::cone(10.0, 2.5, 90.0).unwrap();
        let projected: f64 = cone.projected_solid_angles().iter().sum();
        assert!((projected / (PI * 10.0f64.to_radians().sin().powi(2)) - 1.0).abs() < 1e-14);
        assert_eq!(cone.bin(direction(9.9, 100.0)), Some(3 * 4 + 1));
        assert_eq!(cone.bin(direction(10.1, 100.0)), None);
        assert!(Angles::cone(100.0, 10.0, 90.0).is_err());
    }

    /// A cone about another direction: every bin is where its middle lies, and the cosines to the
    /// normal add up to those by a fine sum.
    #[test]
    fn a_cone_stands_about_its_view() {
        let view = [35.0, 110.0];
        let cone = Angles::cone(40.0, 10.0, 45.0).unwrap().about(view).unwrap();
        let axis = DVec3::from_array(direction(view[0], view[1]));
        assert_eq!(cone.bin(direction(35.0 + 12.0, 110.0)), Some(8));
        assert_eq!(cone.bin(direction(35.0 - 12.0, 110.0)), Some(12));
        // 33.3° from the view.
        assert_eq!(cone.bin(direction(35.0, 170.0)), Some(3 * 8 + 2));
        assert_eq!(cone.bin(direction(80.0, 110.0)), None);
        let mut sums = vec![0.0; cone.bins()];
        let steps = 900;
        for i in 0..steps {
            // Even in the cosine and in the azimuth, so in the solid angle.
            let z = (f64::from(i) + 0.5) / f64::from(steps);
            for j in 0..2 * steps {
                let phi = 180.0 * (f64::from(j) + 0.5) / f64::from(steps);
                let ray = direction(z.acos().to_degrees(), phi);
                if let Some(bin) = cone.bin(ray) {
                    assert!(DVec3::from_array(ray).angle_between(axis).to_degrees() < 40.0 + 1e-9);
                    sums[bin] += z * TAU / f64::from(2 * steps * steps);
                }
            }
        }
        for (sum, exact) in sums.iter().zip(cone.projected_solid_angles()) {
            assert!((sum - exact).abs() < 2e-4, "{sum} {exact}");
        }
        let all: f64 = cone.projected_solid_angles().iter().sum();
        let cap = PI * 40.0f64.to_radians().sin().powi(2) * 35.0f64.to_radians().cos();
        assert!((all - cap).abs() < 1e-12);
        assert!(Angles::cone(40.0, 10.0, 45.0).unwrap().about([51.0, 0.0]).is_err());
    }
}
