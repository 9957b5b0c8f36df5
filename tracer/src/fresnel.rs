// SPDX-License-Identifier: MIT OR Apache-2.0
//! Smooth dielectric interface for unpolarised light: reflectance and refracted direction.
//!
//! With c the cosines to the normal, r_s = (n1 c1 - n2 c2)/(n1 c1 + n2 c2), r_p = (n2 c1 - n1 c2)/(n2 c1 + n1 c2),
//! R = (r_s² + r_p²)/2; beyond the critical angle all is reflected, a case of its own.

use glam::DVec3;

/// What an interface does to a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refraction {
    /// Beyond the critical angle.
    Total,
    /// Reflected share of the power, and the direction of the rest.
    Partial {
        /// Reflectance for unpolarised light, 0 to 1.
        reflectance: f64,
        /// Unit direction of the refracted ray.
        refracted: DVec3,
    },
}

/// Light along `direction` in index `n1` meets an interface to index `n2`, whose unit `normal` points to where light
/// came from.
#[inline]
pub fn refract(direction: DVec3, normal: DVec3, n1: f64, n2: f64) -> Refraction {
    let ratio = n1 / n2;
    let cos_theta_i = -direction.dot(normal);
    let sin2_theta_t = ratio * ratio * (1.0 - cos_theta_i * cos_theta_i).max(0.0);
    if sin2_theta_t >= 1.0 {
        return Refraction::Total;
    }
    let cos_theta_t = (1.0 - sin2_theta_t).sqrt();
    let s = (n1 * cos_theta_i - n2 * cos_theta_t) / (n1 * cos_theta_i + n2 * cos_theta_t);
    let p = (n2 * cos_theta_i - n1 * cos_theta_t) / (n2 * cos_theta_i + n1 * cos_theta_t);
    let refracted = direction * ratio + normal * (ratio * cos_theta_i - cos_theta_t);
    Refraction::Partial {
        reflectance: 0.5 * (s * s + p * p),
        refracted: refracted.normalize(),
    }
}

/// Specular reflection at a plane with unit `normal`.
#[inline]
pub fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    (direction - normal * (2.0 * direction.dot(normal))).normalize()
}
