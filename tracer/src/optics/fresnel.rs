// SPDX-License-Identifier: MIT OR Apache-2.0
//! Smooth dielectric interfaces: reflectance for unpolarised light and refracted direction.
//!
//! With c the cosines to the normal:
//!
//! r_s = (n1 c1 - n2 c2)/(n1 c1 + n2 c2), r_p = (n2 c1 - n1 c2)/(n2 c1 + n1 c2),
//!
//! R = (r_s² + r_p²)/2. Beyond the critical angle all is reflected.

use glam::DVec3;

use crate::ray::unit;

/// Fresnel's formulas at one angle of incidence, without branches: the kernel of scalar and batched
/// tracing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fresnel {
    /// n1/n2.
    ratio: f64,
    cos_theta_i: f64,
    /// 0 beyond the critical angle.
    cos_theta_t: f64,
    /// True if all is reflected.
    pub total: bool,
    /// Reflectance as a quotient: (r_s² + r_p²)/2 over the common denominator.
    numerator: f64,
    denominator: f64,
}

impl Fresnel {
    /// Light in index `n1` meets an interface to index `n2`.
    #[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
    #[inline(always)]
    pub fn new(cos_theta_i: f64, n1: f64, n2: f64) -> Self {
        let ratio = n1 / n2;
        let positive = |x: f64| if x > 0.0 { x } else { 0.0 };
        let sin2_theta_t = ratio * ratio * positive(1.0 - cos_theta_i * cos_theta_i);
        let cos_theta_t = positive(1.0 - sin2_theta_t).sqrt();
        let (a, b) = (n1 * cos_theta_i, n2 * cos_theta_t);
        let (c, d) = (n2 * cos_theta_i, n1 * cos_theta_t);
        let (s, p) = ((a - b) * (c + d), (c - d) * (a + b));
        let whole = (a + b) * (c + d);
        Self {
            ratio,
            cos_theta_i,
            cos_theta_t,
            total: sin2_theta_t >= 1.0,
            numerator: s * s + p * p,
            denominator: 2.0 * whole * whole,
        }
    }

    /// True if light is reflected when `chance`, uniform on [0, 1), decides.
    #[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
    #[inline(always)]
    pub fn reflects(&self, chance: f64) -> bool {
        chance * self.denominator < self.numerator
    }

    /// Factors u and v of the direction u d + v n in which light along d goes on, where n points to
    /// where it came from.
    #[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
    #[inline(always)]
    pub fn factors(&self, reflected: bool) -> [f64; 2] {
        let refracted = self.ratio * self.cos_theta_i - self.cos_theta_t;
        let mirrored = 2.0 * self.cos_theta_i;
        [if reflected { 1.0 } else { self.ratio }, if reflected { mirrored } else { refracted }]
    }

    /// The direction in which light along `direction` is refracted.
    #[inline]
    pub fn refracted(&self, direction: DVec3, normal: DVec3) -> DVec3 {
        let [along, aside] = self.factors(false);
        unit(direction * along + normal * aside)
    }
}

/// Light along `direction` in index `n1` meets an interface to index `n2`, whose unit `normal`
/// points to where light came from: reflectance of unpolarised light, 0 to 1, and unit direction of
/// the refracted ray; `None` beyond the critical angle.
#[inline]
pub fn refract(direction: DVec3, normal: DVec3, n1: f64, n2: f64) -> Option<(f64, DVec3)> {
    let fresnel = Fresnel::new(-direction.dot(normal), n1, n2);
    let reflectance = fresnel.numerator / fresnel.denominator;
    (!fresnel.total).then(|| (reflectance, fresnel.refracted(direction, normal)))
}

/// Specular reflection at a plane with unit `normal`.
#[inline]
pub fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    unit(direction - normal * (2.0 * direction.dot(normal)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (R_s + R_p)/2 from the formulas evaluated elsewhere, and Snell's law.
    #[test]
    fn reflectance_and_direction_match_fresnel_and_snell() {
        let cases = [
            (1.41, 1.0, 0.0, 0.028_942_339_147),
            (1.41, 1.0, 20.0, 0.5 * (0.041_602_626_4 + 0.018_462_182_8)),
            (1.41, 1.0, 30.0, 0.5 * (0.070_323_381_4 + 0.005_153_513_1)),
            (1.41, 1.0, 40.0, 0.5 * (0.191_479_253_8 + 0.015_622_804_5)),
            (1.41, 1.0, 44.0, 0.5 * (0.446_742_243_6 + 0.187_946_964_0)),
            (1.0, 1.41, 45.0, 0.5 * (0.070_809_173_0 + 0.005_013_939_0)),
            (1.0, 1.41, 60.0, 0.5 * (0.144_340_458_1 + 0.003_171_797_7)),
            (1.0, 1.41, 85.0, 0.5 * (0.704_499_143_9 + 0.495_739_694_0)),
        ];
        for (n1, n2, degrees, expected) in cases {
            let theta = f64::to_radians(degrees);
            let direction = DVec3::new(theta.sin(), 0.0, -theta.cos());
            let found = refract(direction, DVec3::Z, n1, n2);
            let (reflectance, refracted) = found.expect("below the critical angle");
            assert!((reflectance - expected).abs() < 1e-9, "{degrees}: {reflectance}");
            assert!((n2 * refracted.x - n1 * theta.sin()).abs() < 1e-14);
            assert!(refracted.z < 0.0 && (refracted.length() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        let total = |degrees: f64| {
            let theta = degrees.to_radians();
            let direction = DVec3::new(0.0, theta.sin(), theta.cos());
            refract(direction, -DVec3::Z, 1.41, 1.0).is_none()
        };
        assert!(!total(45.171_476_245) && total(45.171_476_247) && total(75.0));
    }

    #[test]
    fn equal_indices_let_pass_everything() {
        let direction = DVec3::new(0.6, 0.0, -0.8);
        let found = refract(direction, DVec3::Z, 1.3, 1.3);
        let (reflectance, refracted) = found.expect("refraction");
        assert!(reflectance == 0.0 && (refracted - direction).length() < 1e-15);
        assert!((reflect(direction, DVec3::Z) - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-15);
    }
}
