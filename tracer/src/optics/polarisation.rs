// SPDX-License-Identifier: MIT OR Apache-2.0
//! Polarisation of a ray: none, or Stokes parameters.
//!
//! The loop that follows a path has the polarisation as a type parameter. Unpolarised light has no
//! size and costs nothing. [`Stokes`] holds Q/I, U/I and V/I and the direction of s that they refer
//! to.
//!
//! The formulas are those of [`bsdf::stokes`].

use bsdf::stokes;
use glam::DVec3;
use num_complex::Complex64;

/// True if rays carry their polarisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Polarisation {
    /// Every surface sees unpolarised light.
    #[default]
    Unpolarised,
    /// Rays carry Stokes parameters. Sources emit unpolarised light. Smooth interfaces, films,
    /// mirrors and tables with Jones matrices change it; all other scattering depolarises.
    Carried,
}

/// The polarisation of a ray: [`Unpolarised`] or [`Stokes`].
pub(crate) trait Light: Default + Copy {
    /// True if there are Stokes parameters.
    const CARRIED: bool;

    /// Refers it to the plane of incidence of a ray along `direction` on a surface with unit
    /// `normal`; returns Q/I in that plane.
    fn meet(&mut self, direction: DVec3, normal: DVec3) -> f64;

    /// Multiplies E_s and E_p, and normalises; returns the share of the power that is left.
    fn pass(&mut self, amplitudes: [Complex64; 2]) -> f64;

    /// Makes the light unpolarised.
    fn depolarise(&mut self);

    /// Sets Q/I, U/I and V/I referred to `s`.
    fn become_light(&mut self, parameters: [f64; 3], s: DVec3);

    /// The Stokes parameters.
    fn stokes(&self) -> Stokes;
}

/// Unpolarised light, of no size.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Unpolarised;

impl Light for Unpolarised {
    const CARRIED: bool = false;

    #[inline]
    fn meet(&mut self, _direction: DVec3, _normal: DVec3) -> f64 {
        0.0
    }

    #[inline]
    fn pass(&mut self, amplitudes: [Complex64; 2]) -> f64 {
        0.5 * (amplitudes[0].norm_sqr() + amplitudes[1].norm_sqr())
    }

    #[inline]
    fn depolarise(&mut self) {}

    #[inline]
    fn become_light(&mut self, _parameters: [f64; 3], _s: DVec3) {}

    fn stokes(&self) -> Stokes {
        Stokes::default()
    }
}

/// Stokes parameters over I, and the direction of s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stokes {
    /// (|E_s|² - |E_p|²)/I, from -1 to 1.
    pub q: f64,
    /// 2 Re(E_s E_p*)/I.
    pub u: f64,
    /// -2 Im(E_s E_p*)/I.
    pub v: f64,
    /// Unit vector along s, at right angles to the ray; of no meaning for unpolarised light.
    pub s: DVec3,
}

impl Stokes {
    /// Degree of polarisation, 0 to 1.
    pub fn degree(&self) -> f64 {
        (self.q * self.q + self.u * self.u + self.v * self.v).sqrt()
    }

    /// The same light referred to `s`, another direction at right angles to a ray along
    /// `direction`.
    #[must_use]
    pub fn turned(&self, direction: DVec3, s: DVec3) -> Self {
        let [q, u, v] = stokes::turned([self.q, self.u, self.v], direction, self.s, s);
        Self { q, u, v, s }
    }
}

impl Light for Stokes {
    const CARRIED: bool = true;

    #[inline]
    fn meet(&mut self, direction: DVec3, normal: DVec3) -> f64 {
        let across = direction.cross(normal);
        let s = if across.length_squared() > 1e-24 {
            across.normalize()
        } else {
            // Straight on, every direction will do.
            direction.any_orthonormal_vector()
        };
        *self = self.turned(direction, s);
        self.q
    }

    #[inline]
    fn pass(&mut self, amplitudes: [Complex64; 2]) -> f64 {
        let ([q, u, v], share) = stokes::passed([self.q, self.u, self.v], amplitudes);
        *self = Self { q, u, v, s: self.s };
        share
    }

    #[inline]
    fn depolarise(&mut self) {
        *self = Self::default();
    }

    fn become_light(&mut self, parameters: [f64; 3], s: DVec3) {
        let [q, u, v] = stokes::physical(parameters);
        *self = Self { q, u, v, s };
    }

    fn stokes(&self) -> Stokes {
        *self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::fresnel::reflect;
    use crate::optics::thin_film::{End, Film};
    use crate::random;

    fn bare() -> Film {
        Film::new(550.0, Vec::new()).unwrap()
    }

    fn interface(n1: f64, n2: f64, cos: f64) -> crate::optics::thin_film::Amplitudes {
        bare().amplitudes(End::First, n1, Complex64::new(n2, 0.0), cos)
    }

    /// A ray from above at this angle in the plane y = 0.
    fn down(theta: f64) -> DVec3 {
        DVec3::new(theta.sin(), 0.0, -theta.cos())
    }

    #[test]
    fn at_brewsters_angle_the_reflection_is_s_alone() {
        let n = 1.5f64;
        let theta = n.atan();
        let mut light = Stokes::default();
        light.meet(down(theta), DVec3::Z);
        let share = light.pass(interface(1.0, n, theta.cos()).reflected);
        // R_s = ((n² - 1)/(n² + 1))².
        let expected = 0.5 * ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        assert!((share - expected).abs() < 1e-15);
        assert!((light.q - 1.0).abs() < 1e-15 && light.s.y.abs() > 1.0 - 1e-15);
    }

    /// Two reflections at Brewster's angle whose planes of incidence stand at φ to each other send
    /// back cos² φ of what parallel ones do.
    #[test]
    fn two_plates_at_brewsters_angle_follow_malus() {
        let n = 1.5f64;
        let theta = n.atan();
        let strong = ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        for degrees in [0.0, 25.0, 45.0, 90.0, 130.0] {
            let mut light = Stokes::default();
            light.meet(down(theta), DVec3::Z);
            let first = light.pass(interface(1.0, n, theta.cos()).reflected);
            let along = reflect(down(theta), DVec3::Z);
            // A normal at θ against the ray, in a plane turned by φ about it.
            let phi = f64::to_radians(degrees);
            let p = DVec3::Y.cross(along);
            let aside = p * phi.cos() + DVec3::Y * phi.sin();
            let normal = -along * theta.cos() + aside * theta.sin();
            light.meet(along, normal);
            let second = light.pass(interface(1.0, n, theta.cos()).reflected);
            let expected = 0.5 * strong * strong * phi.cos().powi(2);
            assert!((first * second - expected).abs() < 1e-15, "{degrees}");
        }
    }

    /// Fresnel's rhomb: two total reflections at 54.6° in glass of index 1.51 turn light at 45°
    /// into circular light.
    #[test]
    fn fresnels_rhomb_makes_circular_light() {
        let (n, theta) = (1.51, f64::to_radians(54.6));
        let a = interface(n, 1.0, theta.cos()).reflected;
        let phase = (a[1] / a[0]).arg();
        // tan(δ/2) = cos θ √(sin² θ - 1/n²)/sin² θ.
        let sin2 = theta.sin().powi(2);
        let expected = 2.0 * (theta.cos() * (sin2 - 1.0 / (n * n)).sqrt() / sin2).atan();
        assert!((phase.abs() - expected).abs() < 1e-12, "{phase} {expected}");
        assert!((expected.to_degrees() - 45.0).abs() < 0.1);

        let start = down(theta);
        let mut light = Stokes { u: 1.0, s: DVec3::Y, ..Stokes::default() };
        light.meet(start, DVec3::Z);
        assert!((light.pass(a) - 1.0).abs() < 1e-14);
        let back = reflect(start, DVec3::Z);
        light.meet(back, -DVec3::Z);
        assert!((light.pass(a) - 1.0).abs() < 1e-14);
        assert!(light.v.abs() > 0.9999 && light.q.abs() < 1e-12, "{light:?}");
        assert!((light.degree() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn turning_changes_no_light_and_nothing_becomes_more_than_polarised() {
        let mut rng = random::stream(3, 0);
        for _ in 0..2000 {
            let mut direction = random::isotropic(&mut rng);
            let mut light = Stokes { s: direction.any_orthonormal_vector(), ..Stokes::default() };
            // Every other ray begins fully polarised, and stays so whatever it meets; the others
            // become so little by little.
            let full = random::unit(&mut rng) < 0.5;
            if full {
                light.v = 1.0;
            }
            for _ in 0..20 {
                let normal = random::about(-direction, random::cosine(&mut rng, 1.0));
                let before = light;
                light.meet(direction, normal);
                assert!((light.degree() - before.degree()).abs() < 1e-12);
                assert!(light.s.dot(direction).abs() < 1e-12);
                let again = light.turned(direction, before.s);
                assert!(
                    before.degree() < 1e-12
                        || (again.q - before.q).hypot(again.u - before.u) < 1e-9
                );

                let amplitude = |rng: &mut rand_pcg::Pcg64| {
                    Complex64::from_polar(random::unit(rng), 7.0 * random::unit(rng))
                };
                let pair = [amplitude(&mut rng), amplitude(&mut rng)];
                let share = light.pass(pair);
                assert!((0.0..=1.0).contains(&share));
                assert!(light.degree() <= 1.0 + 1e-12, "{light:?}");
                assert!(!full || light.degree() > 1.0 - 1e-9, "{light:?}");
                direction = reflect(direction, normal);
            }
        }
    }
}
