// SPDX-License-Identifier: MIT OR Apache-2.0
//! Diffraction orders: their in-plane wavevectors, which of them propagate, and their polarisation
//! vectors.
//!
//! Wavevector components are in units of k0; see `docs/explanation/conventions.md`.

use crate::error::Error;
use num_complex::Complex64;

/// Orders kept: -M..=M.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Truncation(usize);

impl Truncation {
    /// Largest highest order accepted; beyond it a matrix would take gigabytes.
    pub const MAX: usize = 2000;

    /// Keeps orders `-highest..=highest`.
    pub fn new(highest: usize) -> Result<Self, Error> {
        if highest > Self::MAX {
            return Err(Error::Truncation { got: highest, max: Self::MAX });
        }
        Ok(Self(highest))
    }

    /// Highest order kept, M.
    pub fn highest(self) -> usize {
        self.0
    }

    /// Number of orders kept, 2M + 1.
    pub fn count(self) -> usize {
        2 * self.0 + 1
    }

    /// The orders kept, ascending.
    pub fn orders(self) -> impl Iterator<Item = i32> + Clone {
        let m = self.0 as i32;
        -m..=m
    }
}

/// Bloch wavevector of a scattering problem: that of order 0, in units of k0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bloch {
    /// Component along the grating vector.
    pub kx0: f64,
    /// Component along the grooves.
    pub ky: f64,
    /// Azimuth that stands for the plane of incidence of an order with no tangential wavevector, in
    /// radians.
    pub azimuth_at_normal: f64,
}

impl Bloch {
    /// The Bloch wavevector (kx0, ky) in units of k0.
    pub fn new(kx0: f64, ky: f64) -> Self {
        Self { kx0, ky, azimuth_at_normal: 0.0 }
    }
}

/// A Bloch wavevector that is its own mirror image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SymmetricBloch {
    /// kx0 = 0: normal incidence and its orders. Orders -M..=M are kept.
    Centre,
    /// kx0 is half an order spacing. Orders -M-1..=M are kept, a set that is its own mirror image.
    Edge,
}

impl Bloch {
    /// # Errors
    /// A component that is not a finite number.
    pub(crate) fn check(self) -> Result<(), Error> {
        let Self { kx0, ky, .. } = self;
        if kx0.is_finite() && ky.is_finite() { Ok(()) } else { Err(Error::Bloch { kx0, ky }) }
    }
}

/// Unit vector of the tangential wavevector (cos, sin), from which s and p follow.
pub(crate) fn tangent(kx: f64, bloch: Bloch) -> (f64, f64) {
    let length = kx.hypot(bloch.ky);
    if length == 0.0 {
        let (sin, cos) = bloch.azimuth_at_normal.sin_cos();
        (cos, sin)
    } else {
        (kx / length, bloch.ky / length)
    }
}

/// z component of the wavevector with `kz² = kz_squared`, on the branch of waves that leave: Re > 0
/// where it propagates, Im > 0 where it decays.
///
/// A propagating mode of a general eigensolver carries an imaginary part of round-off of either
/// sign; a strict test of that sign would turn it into a wave that comes back. Only an imaginary
/// part above 1e-10 of the magnitude counts.
pub fn outgoing_kz(kz_squared: Complex64) -> Complex64 {
    let root = kz_squared.sqrt();
    if kz_squared.im.abs() <= 1e-10 * kz_squared.norm() {
        // Lossless: the principal root is on the positive real axis or, up to sign, on the
        // imaginary one.
        return if kz_squared.re >= 0.0 {
            Complex64::new(root.re.abs(), root.im)
        } else {
            Complex64::new(root.re * root.im.signum(), root.im.abs())
        };
    }
    if root.im < 0.0 { -root } else { root }
}

/// kz that stands for 0 in a half-space. Next to a cut-off kz² moves in steps of round-off, kz in
/// steps of 1e-8.
pub(crate) const BARELY_EVANESCENT: Complex64 = Complex64::new(0.0, 1e-12);

/// kz of every order. An order exactly at its cut-off counts as barely evanescent: between
/// half-spaces of one index kz = 0 would be a wave without a source, and evanescent waves of any kz
/// keep energy and reciprocity exact.
pub(crate) fn half_space_kz(n: Complex64, kx: &[f64], ky: f64) -> Vec<Complex64> {
    kx.iter()
        .map(|k| {
            let kz = outgoing_kz(n * n - k * k - ky * ky);
            if kz == Complex64::ZERO { BARELY_EVANESCENT } else { kz }
        })
        .collect()
}

/// kx of the orders kept.
pub(crate) fn wavevectors(
    bloch: Bloch,
    period_per_wavelength: f64,
    truncation: Truncation,
) -> Vec<f64> {
    let of = |m| bloch.kx0 + f64::from(m) / period_per_wavelength;
    truncation.orders().map(of).collect()
}

/// A plane wave that carries power away from the structure.
///
/// In a half-space without loss these are the orders that propagate, and light can come in by each
/// of them. In an absorbing one every order carries some power through the first plane, and none
/// can bring light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// Diffraction order.
    pub order: i32,
    /// Wavevector along the grating vector, in units of k0.
    pub kx: f64,
    /// Wavevector along the grooves, in units of k0.
    pub ky: f64,
    /// Wavevector along z, in units of k0: its magnitude > 0 without loss.
    pub kz: Complex64,
    /// Power through z = const of a wave of unit electric amplitude, in s and in p: Re kz and
    /// Re(kz/ε) |ε|; without loss both are kz.
    pub flux: [f64; 2],
}

/// The channels of a half-space of index `n` among `orders`, ascending.
pub(crate) fn channels(
    n: Complex64,
    period_per_wavelength: f64,
    bloch: Bloch,
    orders: impl Iterator<Item = i32>,
) -> Vec<Channel> {
    let kx = |order| bloch.kx0 + f64::from(order) / period_per_wavelength;
    channels_at(n, bloch, orders.map(|order| (order, kx(order))))
}

/// [`channels`] for orders with these kx, which decide to the last bit which orders propagate.
pub(crate) fn channels_at(
    n: Complex64,
    bloch: Bloch,
    orders: impl Iterator<Item = (i32, f64)>,
) -> Vec<Channel> {
    let epsilon = n * n;
    orders
        .filter_map(|(order, kx)| {
            let kz_squared = epsilon - kx * kx - bloch.ky * bloch.ky;
            let carries = if n.im == 0.0 { kz_squared.re > 0.0 } else { true };
            carries.then(|| {
                let kz = outgoing_kz(kz_squared);
                let flux = if n.im == 0.0 {
                    [kz.re; 2]
                } else {
                    [kz.re, (kz / epsilon).re * epsilon.norm()]
                };
                Channel { order, kx, ky: bloch.ky, kz, flux }
            })
        })
        .collect()
}

/// Highest |m| that propagates in a half-space of index `n` (0 if none or if it absorbs), without
/// truncation.
pub(crate) fn highest_propagating(n: Complex64, period_per_wavelength: f64, bloch: Bloch) -> usize {
    let reach = n.re * n.re - bloch.ky * bloch.ky;
    if n.im != 0.0 || reach <= 0.0 {
        return 0;
    }
    ((reach.sqrt() + bloch.kx0.abs()) * period_per_wavelength).floor() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branch_ignores_round_off_and_follows_decay() {
        for sign in [-1.0, 1.0] {
            let propagating = outgoing_kz(Complex64::new(2.0, sign * 1e-15));
            assert!(propagating.re > 1.4 && propagating.im.abs() < 1e-14);
            let evanescent = outgoing_kz(Complex64::new(-2.0, sign * 1e-15));
            assert!(evanescent.im > 1.4 && evanescent.re.abs() < 1e-14);
        }
        let absorbing = outgoing_kz(Complex64::new(-40.0, 3.0));
        assert!(absorbing.im > 0.0 && absorbing.re > 0.0);
        let gaining = outgoing_kz(Complex64::new(2.0, -0.5));
        assert!(gaining.im > 0.0);
    }

    #[test]
    fn grating_equation_of_the_worked_example() {
        // n 1.41 -> 1, wavelength 0.55, period 0.9, theta 33°, phi 40° (analytic reference 2.7).
        let (theta, phi) = (33f64.to_radians(), 40f64.to_radians());
        let bloch = Bloch::new(1.41 * theta.sin() * phi.cos(), 1.41 * theta.sin() * phi.sin());
        let truncation = Truncation::new(6).unwrap();
        let air = channels(Complex64::ONE, 0.9 / 0.55, bloch, truncation.orders());
        let kz: Vec<(i32, f64)> = air.iter().map(|c| (c.order, c.kz.re)).collect();
        let expected = [(-2, 0.595_357), (-1, 0.869_376), (0, 0.640_521)];
        assert_eq!(kz.len(), expected.len());
        for ((m, value), (me, ve)) in kz.into_iter().zip(expected) {
            assert!(m == me && (value - ve).abs() < 1e-6);
        }
        assert_eq!(highest_propagating(Complex64::ONE, 0.9 / 0.55, bloch), 2);
    }
}
