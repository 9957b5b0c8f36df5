// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin-film stacks between two media: amplitudes for s and p at any angle, with or without
//! absorption.
//!
//! In layer j the wave has q_j = √(n_j² - s²) with s = n_0 sin θ_0 and Im q_j ≥ 0. Its admittance
//! Y_j is q_j for s and n_j²/q_j for p. As tangential fields are continuous, the border between
//! layers j and j+1 reflects
//!
//! ρ_j = (Y_j - Y_{j+1})/(Y_j + Y_{j+1}).
//!
//! With the phase e = exp(2πi q_j d_j/λ) of a layer, the amplitudes follow from the bottom up:
//!
//! r_j = (ρ_j + r_{j+1} e²)/(1 + ρ_j r_{j+1} e²),
//!
//! t_j = (1 + ρ_j) e t_{j+1}/(1 + ρ_j r_{j+1} e²).
//!
//! This is the product of the layers' transfer matrices \[Macleod 2010\], in an order in which
//! nothing grows, so layers may have any thickness. The time factor is exp(-iωt), indices are n +
//! ik.
//!
//! \[Macleod 2010\] H. A. Macleod, *Thin-Film Optical Filters*, 4th ed., chapter 2.

use num_complex::Complex64;

use crate::error::{Error, check};

/// Smallest |q| and cosine, used at the very edge of total reflection and at grazing incidence.
const TINY: f64 = 1e-9;

/// One layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Refractive index n + ik; k ≥ 0 absorbs.
    pub index: Complex64,
    /// Thickness, nm.
    pub thickness_nm: f64,
}

/// Layers at one wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    layers: Vec<Layer>,
    /// 2π over the vacuum wavelength, 1/nm.
    wavenumber: f64,
}

/// Amplitudes of a film, scaled so that their squares are shares of the incident
/// power. s and p are those of `docs/explanation/conventions.md`: at normal incidence r_s = -r_p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplitudes {
    /// Reflection of s and p.
    pub reflected: [Complex64; 2],
    /// Transmission of s and p.
    pub transmitted: [Complex64; 2],
}

impl Amplitudes {
    /// Reflected share of the power of s and p.
    #[inline]
    pub fn reflectances(&self) -> [f64; 2] {
        self.reflected.map(|a| a.norm_sqr())
    }

    /// Transmitted share of the power of s and p.
    #[inline]
    pub fn transmittances(&self) -> [f64; 2] {
        self.transmitted.map(|a| a.norm_sqr())
    }
}

/// The end from which light comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// It meets the first layer first.
    First,
    /// It meets the last layer first.
    Last,
}

impl Film {
    /// Layers in order; none make a bare surface.
    pub fn new(wavelength_nm: f64, layers: Vec<Layer>) -> Result<Self, Error> {
        crate::error::positive("wavelength of a film, nm", wavelength_nm)?;
        for layer in &layers {
            crate::error::positive("thickness of a layer, nm", layer.thickness_nm)?;
            check_index("refractive index of a layer", layer.index)?;
        }
        Ok(Self { layers, wavenumber: std::f64::consts::TAU / wavelength_nm })
    }

    /// No layers.
    pub(crate) const fn bare() -> Self {
        Self { layers: Vec::new(), wavenumber: 0.0 }
    }

    /// Amplitudes for light that comes at an angle of cosine `cos_theta` to the normal in a medium
    /// of index `from` towards one of index `to`.
    pub fn amplitudes(&self, end: End, from: f64, to: Complex64, cos_theta: f64) -> Amplitudes {
        let cos = cos_theta.clamp(TINY, 1.0);
        let s2 = from * from * (1.0 - cos * cos);
        let wave = |index: Complex64| -> (Complex64, [Complex64; 2]) {
            let square = index * index;
            let mut q = (square - s2).sqrt();
            if q.im < 0.0 {
                q = -q;
            }
            if q.norm_sqr() < TINY * TINY {
                q = Complex64::new(TINY, 0.0);
            }
            (q, [q, square / q])
        };
        let first = [Complex64::from(from * cos), Complex64::from(from / cos)];
        let (_, last) = wave(to);
        // From the border farthest from the light.
        let (mut r, mut t) = ([Complex64::ZERO; 2], [Complex64::ONE; 2]);
        let (mut below, mut e) = (last, Complex64::ONE);
        let mut cross = |above: [Complex64; 2], below: [Complex64; 2], e: Complex64| {
            for pol in 0..2 {
                let rho = (above[pol] - below[pol]) / (above[pol] + below[pol]);
                let back = r[pol] * e * e;
                let all = Complex64::ONE / (1.0 + rho * back);
                t[pol] = (1.0 + rho) * e * t[pol] * all;
                r[pol] = (rho + back) * all;
            }
        };
        let count = self.layers.len();
        for k in 0..count {
            let layer = match end {
                End::First => &self.layers[count - 1 - k],
                End::Last => &self.layers[k],
            };
            let (q, here) = wave(layer.index);
            cross(here, below, e);
            below = here;
            e = (Complex64::I * q * (self.wavenumber * layer.thickness_nm)).exp();
        }
        cross(first, below, e);
        // The flow of power along the normal is the real part of the admittance.
        let scale = |pol: usize| (last[pol].re.max(0.0) / first[pol].re).sqrt();
        Amplitudes {
            // The vector p of the reflected wave points the other way along the surface.
            reflected: [r[0], -r[1]],
            transmitted: [t[0] * scale(0), t[1] * scale(1)],
        }
    }
}

/// Checks the index of a layer or a substrate.
pub(crate) fn check_index(what: &str, index: Complex64) -> Result<(), Error> {
    check(what, index.re, "a finite real part, 0 or more", index.re >= 0.0)?;
    check(what, index.im, "a finite imaginary part, 0 or more", index.im >= 0.0)?;
    check(what, index.norm(), "an index other than 0", index.norm() > TINY)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::fresnel::refract;
    use glam::DVec3;

    const WAVELENGTH: f64 = 550.0;

    fn film(layers: &[(f64, f64, f64)]) -> Film {
        let layer = |&(n, k, thickness_nm): &(f64, f64, f64)| Layer {
            index: Complex64::new(n, k),
            thickness_nm,
        };
        Film::new(WAVELENGTH, layers.iter().map(layer).collect()).unwrap()
    }

    fn real(n: f64) -> Complex64 {
        Complex64::new(n, 0.0)
    }

    /// Quarter of the wavelength in index n, nm.
    fn quarter(n: f64) -> f64 {
        0.25 * WAVELENGTH / n
    }

    #[test]
    fn a_quarter_wave_turns_the_index_and_half_a_wave_is_absent() {
        let (n0, ns) = (1.0, 1.52);
        for n in [1.23, 1.38, 2.3] {
            let a = film(&[(n, 0.0, quarter(n))]).amplitudes(End::First, n0, real(ns), 1.0);
            let expected = ((n0 * ns - n * n) / (n0 * ns + n * n)).powi(2);
            for reflectance in a.reflectances() {
                assert!((reflectance - expected).abs() < 1e-14);
            }
            assert!((a.reflected[0] + a.reflected[1]).norm() < 1e-14);
        }
        let n = (n0 * ns).sqrt();
        let a = film(&[(n, 0.0, quarter(n))]).amplitudes(End::First, n0, real(ns), 1.0);
        assert!(a.reflectances()[0] < 1e-28 && (a.transmittances()[0] - 1.0).abs() < 1e-14);

        let bare = film(&[]).amplitudes(End::First, n0, real(ns), 1.0);
        let half =
            film(&[(2.3, 0.0, 2.0 * quarter(2.3))]).amplitudes(End::First, n0, real(ns), 1.0);
        assert!((bare.reflectances()[0] - half.reflectances()[0]).abs() < 1e-14);
        assert!((bare.reflectances()[0] - (0.52f64 / 2.52).powi(2)).abs() < 1e-15);

        // A stack of N pairs of quarter waves: admittance (n_H/n_L)^2N n_s.
        let pairs: Vec<_> =
            (0..6).flat_map(|_| [(2.3, 0.0, quarter(2.3)), (1.38, 0.0, quarter(1.38))]).collect();
        let y = (2.3f64 / 1.38).powi(12) * ns;
        let a = film(&pairs).amplitudes(End::First, n0, real(ns), 1.0);
        assert!((a.reflectances()[0] - ((n0 - y) / (n0 + y)).powi(2)).abs() < 1e-13);
    }

    #[test]
    fn without_layers_it_is_fresnels_interface() {
        for (n1, n2) in [(1.0, 1.41), (1.41, 1.0)] {
            for degrees in [0.0, 20.0, 44.0, 45.3, 60.0, 85.0] {
                let theta = f64::to_radians(degrees);
                let direction = DVec3::new(theta.sin(), 0.0, -theta.cos());
                let a = film(&[]).amplitudes(End::First, n1, real(n2), theta.cos());
                let [s, p] = a.reflectances();
                let expected = refract(direction, DVec3::Z, n1, n2).map_or(1.0, |(r, _)| r);
                assert!((0.5 * (s + p) - expected).abs() < 1e-13, "{degrees}");
            }
        }
        // Layers of the media themselves change nothing.
        let same = film(&[(1.41, 0.0, 77.0), (1.0, 0.0, 31.0)]);
        let (a, b) = (
            same.amplitudes(End::First, 1.41, real(1.0), 0.8),
            film(&[]).amplitudes(End::First, 1.41, real(1.0), 0.8),
        );
        for pol in 0..2 {
            assert!((a.reflectances()[pol] - b.reflectances()[pol]).abs() < 1e-14);
            assert!((a.transmittances()[pol] - b.transmittances()[pol]).abs() < 1e-14);
        }
    }

    #[test]
    fn energy_is_kept_or_absorbed_and_transmission_is_the_same_from_both_sides() {
        let clear = film(&[(2.1, 0.0, 83.0), (1.38, 0.0, 140.0), (1.7, 0.0, 40.0)]);
        let metal = film(&[(1.45, 0.0, 60.0), (0.06, 3.6, 18.0), (2.0, 0.1, 35.0)]);
        let (n1, n2) = (1.41, 1.0);
        for k in 1..=60 {
            let sin = f64::from(k) / 60.0 * 0.999;
            let cos = (1.0 - sin * sin).sqrt();
            for film in [&clear, &metal] {
                let there = film.amplitudes(End::First, n1, real(n2), cos);
                for pol in 0..2 {
                    let sum = there.reflectances()[pol] + there.transmittances()[pol];
                    if film == &clear {
                        assert!((sum - 1.0).abs() < 1e-12, "{sum} at {sin}");
                    } else {
                        assert!(sum < 1.0 - 1e-6, "{sum} at {sin}");
                    }
                }
                let sin2 = n1 * sin / n2;
                if sin2 < 0.999 {
                    let back = film.amplitudes(End::Last, n2, real(n1), (1.0 - sin2 * sin2).sqrt());
                    for pol in 0..2 {
                        let (a, b) = (there.transmittances()[pol], back.transmittances()[pol]);
                        assert!((a - b).abs() < 1e-12, "{a} {b}");
                        if film == &clear {
                            let (a, b) = (there.reflectances()[pol], back.reflectances()[pol]);
                            assert!((a - b).abs() < 1e-12, "{a} {b}");
                        }
                    }
                } else if sin2 > 1.001 {
                    assert!(there.transmittances() == [0.0, 0.0]);
                }
            }
        }
    }

    #[test]
    fn thick_metal_is_a_half_space_and_light_tunnels_through_thin_gaps() {
        let silver = Complex64::new(0.06, 3.6);
        let mirror = film(&[]).amplitudes(End::First, 1.41, silver, 0.7);
        let thick =
            film(&[(silver.re, silver.im, 1e7)]).amplitudes(End::First, 1.41, real(1.0), 0.7);
        for pol in 0..2 {
            let (a, b) = (mirror.reflectances()[pol], thick.reflectances()[pol]);
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert!(thick.transmittances()[0] < 1e-300);

        // Two prisms with air between them, beyond the critical angle: T_s = 1/(1 + (κ² + q²)²
        // sinh²(κ k d)/(4 κ² q²)).
        let (n, gap) = (1.5, 150.0);
        let theta = f64::to_radians(50.0);
        let (q, kappa) = (n * theta.cos(), ((n * theta.sin()).powi(2) - 1.0).sqrt());
        let depth = kappa * std::f64::consts::TAU / WAVELENGTH * gap;
        let factor = (kappa * kappa + q * q).powi(2) / (4.0 * kappa * kappa * q * q);
        let expected = 1.0 / (1.0 + factor * depth.sinh().powi(2));
        let a = film(&[(1.0, 0.0, gap)]).amplitudes(End::First, n, real(n), theta.cos());
        assert!((a.transmittances()[0] - expected).abs() < 1e-13);
    }

    #[test]
    fn what_is_no_layer_is_refused() {
        let one = |n: f64, k: f64, thickness_nm: f64| {
            let index = Complex64::new(n, k);
            Film::new(WAVELENGTH, vec![Layer { index, thickness_nm }])
        };
        assert!(one(1.5, 0.0, 100.0).is_ok());
        for (n, k, d) in [
            (1.5, 0.0, 0.0),
            (-1.5, 0.0, 1.0),
            (1.5, -0.1, 1.0),
            (0.0, 0.0, 1.0),
            (f64::NAN, 0.0, 1.0),
        ] {
            assert!(one(n, k, d).is_err(), "{n} {k} {d}");
        }
        assert!(Film::new(0.0, Vec::new()).is_err());
    }
}
