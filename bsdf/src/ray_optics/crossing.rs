// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fresnel's formulas at one facet, and light that keeps its polarisation from facet to facet.

use crate::analytic::fresnel_normal;
use crate::bsdf::Polarisation;
use crate::stokes;
use glam::DVec3;
use num_complex::Complex64;
use rand::RngExt;

/// Two media and the wavevector that meets their boundary, in units of the vacuum wavenumber.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// Indices of the media in which the ray arrives and beyond.
    pub media: [f64; 2],
    /// Normal component of the wavevector that arrives, without sign, and the square of that
    /// beyond.
    pub across: [f64; 2],
}

impl Crossing {
    /// Reflected share of unpolarised light.
    pub fn reflectance(&self) -> f64 {
        let ([n1, n2], [q1, q2_squared]) = (self.media, self.across);
        if q2_squared <= 0.0 {
            return 1.0;
        }
        fresnel_normal(n1, n2, q1, q2_squared.sqrt()).for_polarisation(Polarisation::Unpolarised)
    }

    /// Amplitudes of s and p, reflected and refracted, scaled so that their squares are shares of
    /// the power; at normal incidence r_s = -r_p.
    fn amplitudes(&self) -> [[Complex64; 2]; 2] {
        let ([e1, e2], [q1, q2_squared]) = (self.media.map(|n| n * n), self.across);
        let q2 = Complex64::from(q2_squared).sqrt();
        let reflected = [(q1 - q2) / (q1 + q2), (e2 * q1 - e1 * q2) / (e2 * q1 + e1 * q2)];
        let left = |r: Complex64| Complex64::from((1.0 - r.norm_sqr()).max(0.0).sqrt());
        [reflected, reflected.map(left)]
    }
}

/// Light on its way from facet to facet: Stokes parameters over I, referred to `s`.
pub(super) struct Carried {
    pub light: [f64; 3],
    pub s: DVec3,
}

impl Carried {
    /// Turns light along `k` into the plane of incidence of a facet, draws whether it is reflected,
    /// and leaves the light that goes on.
    pub fn reflects(
        &mut self,
        k: DVec3,
        normal: DVec3,
        crossing: &Crossing,
        rng: &mut dyn rand::Rng,
    ) -> bool {
        let across = k.cross(normal).try_normalize();
        let across = across.unwrap_or_else(|| k.any_orthonormal_vector());
        let light = stokes::turned(self.light, k, self.s, across);
        self.s = across;
        let [reflected, refracted] = crossing.amplitudes();
        let (back, share) = stokes::passed(light, reflected);
        let reflects = crossing.reflectance() >= 1.0 || rng.random::<f64>() < share;
        self.light = if reflects { back } else { stokes::passed(light, refracted).0 };
        reflects
    }
}
