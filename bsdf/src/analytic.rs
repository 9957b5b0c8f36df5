// SPDX-License-Identifier: MIT OR Apache-2.0
//! BSDFs in closed form: smooth interface, mirror, Lambertian, diffusers, haze, polariser.
//!
//! In: refractive indices or a reflectance. Out: a [`Bsdf`]. Fresnel's formulas give the
//! reflectance of a smooth interface; only cosines appear, and total reflection is a separate case.
//! With q = n cos θ, the normal component of the wavevector in units of the vacuum wavenumber, they
//! hold in any mount: `r_s = (q₁ - q₂)/(q₁ + q₂)` and, for the magnetic field,
//! `r_p = (n₂² q₁ - n₁² q₂)/(n₂² q₁ + n₁² q₂)` [Born 1999, section 1.5.2].
//!
//! \[Born 1999\] M. Born, E. Wolf, *Principles of Optics*, 7th edition, Cambridge University Press.

mod diffuser;
mod haze;
mod polariser;

pub use diffuser::{DiffuseLaw, DiffuseLobe, Diffuser, GaussianLobe};
pub use haze::{HAZE_DEG, HazyFace};
pub use polariser::{AxisShares, Polariser, linear};

use crate::bsdf::{Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarisation, Transport};
use crate::direction::{Side, mirrored};
use crate::error::Error;
use glam::DVec3;
use rand::RngExt;

/// Reflectances of a smooth boundary between lossless media.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflectance {
    /// Reflectance for s, 0 to 1.
    pub s: f64,
    /// Reflectance for p, 0 to 1.
    pub p: f64,
}

impl Reflectance {
    /// Total reflection.
    pub const TOTAL: Self = Self { s: 1.0, p: 1.0 };

    /// Reflectance for a polarisation.
    pub fn for_polarisation(self, polarisation: Polarisation) -> f64 {
        match polarisation {
            Polarisation::S => self.s,
            Polarisation::P => self.p,
            Polarisation::Unpolarised => 0.5 * (self.s + self.p),
        }
    }
}

/// Fresnel reflectances for light in index `n1` at an angle of cosine `cos_theta_i` (0 to 1) to the
/// normal of a boundary to index `n2`; 1 beyond the critical angle.
pub fn fresnel(n1: f64, n2: f64, cos_theta_i: f64) -> Reflectance {
    let q1 = n1 * cos_theta_i;
    // Snell: the tangential component n1 sin θ is conserved, so q2² = n2² - n1² sin² θ.
    let q2_squared = n2 * n2 - n1 * n1 + q1 * q1;
    if q2_squared <= 0.0 {
        Reflectance::TOTAL
    } else {
        fresnel_normal(n1, n2, q1, q2_squared.sqrt())
    }
}

/// Fresnel reflectances from the normal components of the wavevector, `q1` and `q2` > 0, on both
/// sides of a boundary from index `n1` to `n2`, in units of the vacuum wavenumber. At grazing
/// incidence on both sides, `q1 = q2 = 0`, the reflectance is 1.
pub(crate) fn fresnel_normal(n1: f64, n2: f64, q1: f64, q2: f64) -> Reflectance {
    if q1 + q2 <= 0.0 {
        return Reflectance::TOTAL;
    }
    let (e1, e2) = (n1 * n1, n2 * n2);
    let s = (q1 - q2) / (q1 + q2);
    let p = (e2 * q1 - e1 * q2) / (e2 * q1 + e1 * q2);
    Reflectance { s: s * s, p: p * p }
}

const DIFFUSE_REFLECTION: Lobe = Lobe { transport: Transport::Reflection, kind: LobeKind::Diffuse };

fn specular(transport: Transport) -> Lobe {
    Lobe { transport, kind: LobeKind::Specular }
}

/// A smooth boundary between two lossless media: Fresnel's formulas and Snell's law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothInterface {
    index: [f64; 2],
}

impl SmoothInterface {
    /// Boundary between refractive indices `index_inner` (z < 0) and `index_outer` (z > 0).
    ///
    /// # Errors
    /// If an index is not positive and finite.
    pub fn new(index_inner: f64, index_outer: f64) -> Result<Self, Error> {
        Ok(Self {
            index: [
                Error::check_index("inner side", index_inner)?,
                Error::check_index("outer side", index_outer)?,
            ],
        })
    }

    /// Refracted direction; `None` for total reflection.
    pub fn refracted(&self, wi: DVec3) -> Option<DVec3> {
        let from = Side::from_direction(wi);
        let to = from.opposite();
        let ratio = self.index(from) / self.index(to);
        let tangential = DVec3::new(-ratio * wi.x, -ratio * wi.y, 0.0);
        let cos2_theta_t = 1.0 - tangential.length_squared();
        (cos2_theta_t > 0.0).then(|| tangential + to.sign() * cos2_theta_t.sqrt() * DVec3::Z)
    }

    /// Fresnel reflectances of light from `wi`; total where nothing is refracted.
    pub fn reflectance(&self, wi: DVec3) -> Reflectance {
        let from = Side::from_direction(wi);
        fresnel(self.index(from), self.index(from.opposite()), wi.z.abs())
    }
}

impl Bsdf for SmoothInterface {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let reflectance = self.reflectance(wi).for_polarisation(Polarisation::Unpolarised);
        let u: f64 = rng.random();
        let (wo, transport) = match self.refracted(wi) {
            Some(wo) if u >= reflectance => (wo, Transport::Transmission),
            _ => (mirrored(wi), Transport::Reflection),
        };
        Some(BsdfSample { wo, weight: 1.0, lobe: specular(transport) })
    }

    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        let albedo = self.albedo(wi, Polarisation::Unpolarised);
        Some(match sample.lobe.transport {
            Transport::Reflection => albedo.reflected,
            Transport::Transmission => albedo.transmitted,
        })
    }

    fn lobes(&self, wi: DVec3, polarisation: Polarisation) -> Vec<OutgoingLobe> {
        let refracted = self.refracted(wi);
        let reflectance = if refracted.is_some() {
            self.reflectance(wi).for_polarisation(polarisation)
        } else {
            1.0
        };
        let mut lobes = vec![OutgoingLobe {
            wo: mirrored(wi),
            power: reflectance,
            lobe: specular(Transport::Reflection),
        }];
        lobes.extend(refracted.map(|wo| OutgoingLobe {
            wo,
            power: 1.0 - reflectance,
            lobe: specular(Transport::Transmission),
        }));
        lobes
    }

    fn index(&self, side: Side) -> f64 {
        self.index[side.index()]
    }

    fn is_reciprocal(&self) -> bool {
        true
    }
}

/// A matt surface: diffuse reflection with a cosine distribution, on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambertian {
    reflectance: f64,
    index: f64,
}

impl Lambertian {
    /// Matt surface of the given `reflectance` (0 to 1) in a medium of refractive index `index`.
    ///
    /// # Errors
    /// If the reflectance lies outside 0 to 1 or the index is not positive and finite.
    pub fn new(reflectance: f64, index: f64) -> Result<Self, Error> {
        Ok(Self {
            reflectance: Error::check_fraction("reflectance of a Lambertian", reflectance)?,
            index: Error::check_index("medium before a Lambertian", index)?,
        })
    }
}

impl Bsdf for Lambertian {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let wo =
            sample_cosine_hemisphere(rng) * DVec3::new(1.0, 1.0, Side::from_direction(wi).sign());
        (self.reflectance > 0.0).then_some(BsdfSample {
            wo,
            weight: self.reflectance,
            lobe: DIFFUSE_REFLECTION,
        })
    }

    fn pdf(&self, _wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        Some(sample.wo.z.abs() * std::f64::consts::FRAC_1_PI)
    }

    fn lobes(&self, wi: DVec3, _polarisation: Polarisation) -> Vec<OutgoingLobe> {
        vec![OutgoingLobe {
            wo: DVec3::Z * Side::from_direction(wi).sign(),
            power: self.reflectance,
            lobe: DIFFUSE_REFLECTION,
        }]
    }

    fn index(&self, _side: Side) -> f64 {
        self.index
    }

    fn is_reciprocal(&self) -> bool {
        true
    }
}

/// Samples the hemisphere about +z with density cos θ/π: uniform on the unit disc, projected onto
/// the sphere; never exactly tangent.
pub fn sample_cosine_hemisphere(rng: &mut dyn rand::Rng) -> DVec3 {
    let radius_squared: f64 = rng.random();
    let phi = std::f64::consts::TAU * rng.random::<f64>();
    let radius = radius_squared.sqrt();
    DVec3::new(radius * phi.cos(), radius * phi.sin(), (1.0 - radius_squared).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direction::spherical;
    use crate::tests::chi_square::{density_p_value, sidak_level};
    use approx::assert_abs_diff_eq;
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    #[test]
    fn fresnel_agrees_with_closed_form_table() {
        let n = 1.41;
        let inside = [
            (20.0, 0.041_602_626_4, 0.018_462_182_8),
            (30.0, 0.070_323_381_4, 0.005_153_511_9),
            (40.0, 0.191_479_253_8, 0.015_622_804_5),
            (44.0, 0.446_742_243_6, 0.187_946_964_0),
            (50.0, 1.0, 1.0),
            (75.0, 1.0, 1.0),
        ];
        let outside = [
            (30.0, 0.042_882_156_6, 0.017_605_064_7),
            (45.0, 0.070_809_173_0, 0.005_013_939_0),
            (60.0, 0.144_340_458_1, 0.003_171_797_7),
            (75.0, 0.356_982_351_5, 0.110_552_023_8),
            (85.0, 0.704_499_143_9, 0.495_739_694_0),
        ];
        for (n1, n2, table) in [(n, 1.0, &inside[..]), (1.0, n, &outside[..])] {
            for &(degrees, s, p) in table {
                let r = fresnel(n1, n2, f64::to_radians(degrees).cos());
                assert_abs_diff_eq!(r.s, s, epsilon = 5.1e-11);
                assert_abs_diff_eq!(r.p, p, epsilon = 5.1e-11);
            }
        }
        assert_abs_diff_eq!(
            fresnel(n, 1.0, 1.0).s,
            ((n - 1.0) / (n + 1.0)).powi(2),
            epsilon = 1e-16
        );
        let brewster = (1.0 / n).atan();
        assert!(fresnel(n, 1.0, brewster.cos()).p < 1e-30);
        assert_eq!(fresnel(n, 1.0, 0.704_987_370), Reflectance::TOTAL);
        assert!(fresnel(n, 1.0, 0.704_987_371).s < 1.0);
    }

    #[test]
    fn interface_obeys_snell_and_conserves_power() {
        let interface = SmoothInterface::new(1.41, 1.0).unwrap();
        for degrees in [0.0_f64, 10.0, 30.0, 45.0, 46.0, 89.0] {
            let wi = spherical(std::f64::consts::PI - degrees.to_radians(), 0.3);
            for polarisation in [Polarisation::S, Polarisation::P, Polarisation::Unpolarised] {
                let lobes = interface.lobes(wi, polarisation);
                assert_abs_diff_eq!(
                    lobes.iter().map(|l| l.power).sum::<f64>(),
                    1.0,
                    epsilon = 1e-15
                );
                assert_eq!(lobes.len(), if degrees > 45.17 { 1 } else { 2 });
                for lobe in &lobes {
                    let n = interface.index(Side::from_direction(lobe.wo));
                    assert_abs_diff_eq!(n * lobe.wo.x, -1.41 * wi.x, epsilon = 1e-15);
                    assert_abs_diff_eq!(n * lobe.wo.y, -1.41 * wi.y, epsilon = 1e-15);
                    assert_abs_diff_eq!(lobe.wo.length(), 1.0, epsilon = 1e-15);
                }
            }
        }
    }

    #[test]
    fn interface_samples_fresnel_shares() {
        let interface = SmoothInterface::new(1.41, 1.0).unwrap();
        let mut rng = Pcg64::seed_from_u64(1);
        let n = 200_000;
        for wi in [spherical(2.5, 1.0), spherical(1.4, 0.2), spherical(2.0, 0.2)] {
            let expected = interface.albedo(wi, Polarisation::Unpolarised).reflected;
            let reflected = (0..n)
                .filter(|_| {
                    interface.sample(wi, &mut rng).unwrap().lobe.transport == Transport::Reflection
                })
                .count() as f64
                / f64::from(n);
            let sigma = (expected * (1.0 - expected) / f64::from(n)).sqrt();
            assert!((reflected - expected).abs() <= 5.0 * sigma);
        }
    }

    #[test]
    fn lambertian_has_the_moments_of_a_cosine() {
        let matt = Lambertian::new(0.86, 1.41).unwrap();
        let mut rng = Pcg64::seed_from_u64(2);
        let n = 200_000;
        let (mut z, mut z2, mut x) = (0.0, 0.0, 0.0);
        for _ in 0..n {
            let s = matt.sample(DVec3::new(0.6, 0.0, -0.8), &mut rng).unwrap();
            assert!(s.wo.z < 0.0 && (s.wo.length() - 1.0).abs() < 1e-14);
            assert_abs_diff_eq!(s.weight, 0.86);
            z -= s.wo.z;
            z2 += s.wo.z * s.wo.z;
            x += s.wo.x;
        }
        // <cos> = 2/3 with variance 1/18; <cos²> = 1/2 with variance 1/12; <sin θ cos φ> = 0 with
        // variance 1/4.
        let n = f64::from(n);
        assert!((z / n - 2.0 / 3.0).abs() < 5.0 * (1.0 / 18.0 / n).sqrt());
        assert!((z2 / n - 0.5).abs() < 5.0 * (1.0 / 12.0 / n).sqrt());
        assert!((x / n).abs() < 5.0 * (0.25 / n).sqrt());
        assert_abs_diff_eq!(matt.albedo(DVec3::Z, Polarisation::S).total(), 0.86);
    }

    #[test]
    fn lambertian_draws_follow_their_density() {
        let matt = Lambertian::new(0.86, 1.41).unwrap();
        let mut rng = Pcg64::seed_from_u64(6);
        let directions = [0.0, 0.7, 1.55, 1.7, 3.1].map(|theta| spherical(theta, 2.0));
        let level = sidak_level(directions.len());
        for wi in directions {
            let lobe = matt.sample(wi, &mut rng).unwrap().lobe;
            let back = move |wo: DVec3| wo.z * wi.z > 0.0;
            let density = |wo: DVec3| {
                let sample = BsdfSample { wo, weight: 1.0, lobe };
                matt.pdf(wi, &sample).unwrap() * f64::from(u8::from(back(wo)))
            };
            let p = density_p_value(&matt, &density, wi, 200_000, &mut rng);
            assert!(p > level, "wi {wi}: p = {p}");
            // All directions alike, one cosine less, would not pass.
            let even = |wo: DVec3| f64::from(u8::from(back(wo))) / std::f64::consts::TAU;
            let p = density_p_value(&matt, &even, wi, 200_000, &mut rng);
            assert!(p < 1e-9, "wi {wi}: p = {p}");
        }
    }

    #[test]
    fn bad_parameters_are_refused() {
        let message = |e: Result<Lambertian, Error>| e.unwrap_err().to_string();
        assert_eq!(
            message(Lambertian::new(1.2, 1.0)),
            "reflectance of a Lambertian must lie between 0 and 1, got 1.2"
        );
        assert!(message(Lambertian::new(0.5, 0.0)).contains("must be positive and finite, got 0"));
        assert!(Lambertian::new(f64::NAN, 1.0).is_err());
        assert!(SmoothInterface::new(1.41, f64::NAN).is_err());
    }
}
