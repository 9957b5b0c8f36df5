// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far field: power by direction, over both hemispheres.
//!
//! Bins are uniform in θ (from +z) and φ (from +x towards +y). A bin has the exact solid angle
//! Δφ (cos θ₀ - cos θ₁), so that power over solid angle is the mean intensity in it.
//!
//! \[Abramowitz, Stegun 1964\] M. Abramowitz, I. A. Stegun (eds.), *Handbook of Mathematical
//! Functions*, chapter 4.

use glam::DVec3;
use pulp::Arch;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{Bins, NO_BIN, Needs, RAY_BUFFER, RayBuffer, Receiver};
use crate::error::Error;
use crate::ray::Ray;

/// A receiver at infinity. Bin number = θ bin · number of φ bins + φ bin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FarField {
    thetas: usize,
    phis: usize,
}

impl Default for FarField {
    /// Bins of 1° in θ and 5° in φ.
    fn default() -> Self {
        Self { thetas: 180, phis: 72 }
    }
}

impl FarField {
    /// Bins of the given widths in degrees, which must divide 180 and 360.
    pub fn new(theta_deg: f64, phi_deg: f64) -> Result<Self, Error> {
        Ok(Self {
            thetas: count("θ bins", 180.0, theta_deg)?,
            phis: count("φ bins", 360.0, phi_deg)?,
        })
    }

    /// Number of bins in θ, from 0 to 180 degrees.
    pub fn thetas(&self) -> usize {
        self.thetas
    }

    /// Number of bins in φ, from 0 to 360 degrees.
    pub fn phis(&self) -> usize {
        self.phis
    }

    /// The middle of a θ bin, degrees.
    pub fn theta_deg(&self, theta: usize) -> f64 {
        (theta as f64 + 0.5) * 180.0 / self.thetas as f64
    }

    /// The middle of a φ bin, degrees.
    pub fn phi_deg(&self, phi: usize) -> f64 {
        (phi as f64 + 0.5) * 360.0 / self.phis as f64
    }

    /// Solid angle of one bin in row `theta`, sr.
    pub fn solid_angle(&self, theta: usize) -> f64 {
        // cos a - cos b = 2 sin((a + b)/2) sin((b - a)/2), without cancellation.
        let step = PI / self.thetas as f64;
        let middle = (theta as f64 + 0.5) * step;
        TAU / self.phis as f64 * 2.0 * middle.sin() * (0.5 * step).sin()
    }
}

impl Receiver for FarField {
    fn bins(&self) -> usize {
        self.thetas * self.phis
    }

    fn needs(&self) -> Needs<'_> {
        Needs::Escapes
    }

    #[inline]
    fn bin(&self, ray: &Ray, length: f64) -> Option<usize> {
        let d = ray.direction;
        (length == f64::INFINITY).then(|| self.bin_at(d, polar(d.z), azimuth(d.x, d.y)))
    }

    fn bin_many(&self, rays: &RayBuffer, bins: &mut Bins) {
        let [x, y, z] = &rays.direction;
        let mut angles = [[0.0; RAY_BUFFER]; 2];
        // The same operations lane by lane, with the widest instructions that the machine has: no
        // bit depends on them.
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for k in 0..RAY_BUFFER {
                    angles[0][k] = polar(z[k]);
                    angles[1][k] = azimuth(x[k], y[k]);
                }
            },
        );
        for (k, bin) in bins.iter_mut().enumerate().take(rays.count) {
            let direction = DVec3::new(x[k], y[k], z[k]);
            *bin = if rays.length[k] == f64::INFINITY {
                self.bin_at(direction, angles[0][k], angles[1][k]) as u32
            } else {
                NO_BIN
            };
        }
    }
}

impl FarField {
    /// The bin of a direction whose angles are known to [`ANGLE_ERROR`]: nearly every one lies
    /// farther than that from the bounds of its bin.
    #[inline]
    fn bin_at(&self, d: DVec3, theta: f64, phi: f64) -> usize {
        let inside = |value: f64, per: f64, count: usize| {
            let (value, err) = (value * per, ANGLE_ERROR * per);
            // Through i32: one instruction there and one back.
            let whole = value as i32;
            let part = value - f64::from(whole);
            (part > err && part < 1.0 - err && (whole as usize) < count).then_some(whole as usize)
        };
        let theta = inside(theta, self.thetas as f64 / PI, self.thetas);
        let phi = inside(phi, self.phis as f64 / TAU, self.phis);
        let (theta, phi) = theta.zip(phi).unwrap_or_else(|| self.exact(d));
        theta * self.phis + phi
    }

    /// Bins by the library's arc tangent.
    #[cold]
    fn exact(&self, d: DVec3) -> (usize, usize) {
        let theta = (d.x * d.x + d.y * d.y).sqrt().atan2(d.z) * (self.thetas as f64 / PI);
        let azimuth = d.y.atan2(d.x);
        let phi = if azimuth < 0.0 { azimuth + TAU } else { azimuth } * (self.phis as f64 / TAU);
        ((theta as usize).min(self.thetas - 1), (phi as usize).min(self.phis - 1))
    }
}

/// More than [`polar`] and [`azimuth`] err, radians.
const ANGLE_ERROR: f64 = 5e-8;

/// Angle to +z of a unit vector with this z, radians, by [Abramowitz, Stegun 1964], 4.4.46, which
/// errs by 2e-8.
#[expect(clippy::inline_always, reason = "compiled into the wide loop over a buffer")]
#[inline(always)]
fn polar(z: f64) -> f64 {
    let x = if z.abs() < 1.0 { z.abs() } else { 1.0 };
    let series = [
        -0.001_262_491_1,
        0.006_670_090_1,
        -0.017_088_125_6,
        0.030_891_881_0,
        -0.050_174_304_6,
        0.088_978_987_4,
        -0.214_598_801_6,
        1.570_796_305_0,
    ];
    let angle = (1.0 - x).sqrt() * series.iter().fold(0.0, |sum, c| sum * x + c);
    if z < 0.0 { PI - angle } else { angle }
}

/// Azimuth of a direction from 0 to 2π, radians, by 4.4.49 of the same, which errs by 2e-8; NaN for
/// ±z.
#[expect(clippy::inline_always, reason = "compiled into the wide loop over a buffer")]
#[inline(always)]
fn azimuth(along: f64, aside: f64) -> f64 {
    let (x, y) = (along.abs(), aside.abs());
    let (min, max) = if x < y { (x, y) } else { (y, x) };
    let ratio = min / max;
    let square = ratio * ratio;
    let series = [
        0.002_866_225_7,
        -0.016_165_736_7,
        0.042_909_613_8,
        -0.075_289_640_0,
        0.106_562_639_3,
        -0.142_088_994_4,
        0.199_935_508_5,
        -0.333_331_452_8,
        1.0,
    ];
    let octant = ratio * series.iter().fold(0.0, |sum, c| sum * square + c);
    let quadrant = if y > x { FRAC_PI_2 - octant } else { octant };
    let half = if along < 0.0 { PI - quadrant } else { quadrant };
    if aside < 0.0 { TAU - half } else { half }
}

pub(super) fn count(what: &'static str, range: f64, width: f64) -> Result<usize, Error> {
    let count = (range / width).round();
    if width > 0.0
        && (1.0..=36_000.0).contains(&count)
        && (count * width - range).abs() < 1e-9 * range
    {
        Ok(count as usize)
    } else {
        Err(Error::BinWidth { what, range, got: width })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random;

    /// The short cut never decides otherwise than the arc tangent, and errs by less than it claims.
    #[test]
    fn polynomials_bin_as_the_arc_tangent_does() {
        let mut rng = random::stream(11, 0);
        let fields = [
            FarField::default(),
            FarField::new(0.01, 0.01).unwrap(),
            FarField::new(90.0, 180.0).unwrap(),
        ];
        for _ in 0..300_000 {
            let mut direction = random::isotropic(&mut rng);
            if random::unit(&mut rng) < 0.5 {
                // Half of them within a degree of a pole.
                let (x, y) = random::disc(&mut rng, 0.017);
                let z = (1.0 - x * x - y * y).sqrt() * direction.z.signum();
                direction = DVec3::new(x, y, z);
            }
            let d = direction;
            let theta = (d.x * d.x + d.y * d.y).sqrt().atan2(d.z);
            let phi = d.y.atan2(d.x).rem_euclid(TAU);
            assert!((polar(d.z) - theta).abs() < 0.6 * ANGLE_ERROR, "{d}");
            assert!((azimuth(d.x, d.y) - phi).abs() < 0.6 * ANGLE_ERROR, "{d}");
            let ray = Ray { origin: DVec3::ZERO, direction };
            for far in fields {
                let (theta, phi) = far.exact(direction);
                assert_eq!(far.bin(&ray, f64::INFINITY), Some(theta * far.phis() + phi), "{d}");
            }
        }
    }

    #[test]
    fn solid_angles_add_up_to_the_sphere() {
        let far = FarField::new(2.0, 7.5).unwrap();
        let sum: f64 =
            (0..far.thetas()).map(|theta| far.solid_angle(theta) * far.phis() as f64).sum();
        assert!((sum / (2.0 * TAU) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn directions_fall_into_their_bins() {
        let far = FarField::default();
        for theta in [0, 1, 89, 90, 179] {
            for phi in [0, 17, 36, 71] {
                let (t, p) = (far.theta_deg(theta).to_radians(), far.phi_deg(phi).to_radians());
                let direction = DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos());
                let ray = Ray { origin: DVec3::ZERO, direction };
                assert_eq!(far.bin(&ray, f64::INFINITY), Some(theta * far.phis() + phi));
            }
        }
        for direction in
            [DVec3::Z, -DVec3::Z, DVec3::new(1.0, -0.0, 0.0), DVec3::new(1.0, -1e-300, 0.0)]
        {
            assert!(
                far.bin(&Ray { origin: DVec3::ZERO, direction }, f64::INFINITY).unwrap()
                    < far.bins()
            );
        }
    }

    #[test]
    fn widths_must_divide_the_range() {
        assert!(FarField::new(0.7, 5.0).is_err());
        assert!(FarField::new(1.0, 0.0).is_err());
        assert!(FarField::new(f64::NAN, 5.0).is_err());
    }
}
