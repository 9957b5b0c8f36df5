// SPDX-License-Identifier: MIT OR Apache-2.0
//! The steps through a layer in which complex and real arithmetic differ.

use super::state::State;
use super::thick;
use crate::linalg::Scalar;
use crate::modes::Modes;
use crate::orders::outgoing_kz;
use num_complex::Complex64;

/// Largest growth exponent Im(kz) d of a slice that is treated as thin: cosh of it loses a digit.
pub(crate) const THIN: f64 = 2.5;
/// Largest growth exponent of layers that are passed together. At 10 energy closes as well; at 14
/// it does not.
pub(crate) const MAX_EXPONENT: f64 = 8.0;

/// Numbers for the coordinates of a line: complex for orders, real where [`crate::real_basis`]
/// applies.
pub(crate) trait Arithmetic: Scalar {
    /// e' = c e + `ELECTRIC_STEP` se h towards the top.
    const ELECTRIC_STEP: Self;
    /// h' = c h + `MAGNETIC_STEP` sh e towards the top.
    const MAGNETIC_STEP: Self;
    /// Largest element of an impedance e = N h that is accepted: each digit of it costs a digit of
    /// the fields.
    const LARGEST_IMPEDANCE: f64;
    /// The α of the parameters t = e + α h, in the order of trial where an impedance is near a
    /// pole.
    const SUMS: &'static [f64];

    /// Growth exponent of evanescent waves beyond which thin slices take new parameters.
    const MAX_GROWN_EXPONENT: f64;

    /// cos(kz d) and sin(kz d)/kz, both even in kz.
    fn cosine_and_sinc(kz_squared: Self, d: f64) -> (Self, Self);

    /// Im kz of the wave that leaves.
    fn decay(kz_squared: Self) -> f64;

    /// Takes a state through a thick layer in upward and downward amplitudes. Returns `false`, and
    /// leaves the state as it was, where these cannot be told apart.
    fn thick(state: &mut State<Self>, modes: &Modes<Self>, d: f64) -> bool;
}

impl Arithmetic for Complex64 {
    const ELECTRIC_STEP: Self = Self::new(0.0, -1.0);
    const MAGNETIC_STEP: Self = Self::new(0.0, -1.0);
    const LARGEST_IMPEDANCE: f64 = 1e3;
    // For a passive structure |e + h|² ≥ |e|² + |h|².
    const SUMS: &'static [f64] = &[1.0];
    const MAX_GROWN_EXPONENT: f64 = THIN;

    fn cosine_and_sinc(kz_squared: Self, d: f64) -> (Self, Self) {
        let x2 = kz_squared * d * d;
        if x2.norm_sqr() < 1e-12 {
            series(x2, d)
        } else {
            let x = x2.sqrt();
            (x.cos(), x.sin() / x * d)
        }
    }

    fn decay(kz_squared: Self) -> f64 {
        outgoing_kz(kz_squared).im
    }

    fn thick(state: &mut State<Self>, modes: &Modes<Self>, d: f64) -> bool {
        thick::propagate(state, modes, d)
    }
}

impl Arithmetic for f64 {
    const ELECTRIC_STEP: Self = 1.0;
    const MAGNETIC_STEP: Self = -1.0;
    const LARGEST_IMPEDANCE: f64 = 300.0;
    // Without radiation each sum has poles of its own, never at the same place.
    const SUMS: &'static [f64] = &[1.0, -1.0, 0.5, -0.5, 2.0, -2.0];
    // The same as for layers that pass together.
    const MAX_GROWN_EXPONENT: f64 = MAX_EXPONENT;

    fn cosine_and_sinc(kz_squared: Self, d: f64) -> (Self, Self) {
        let x2 = kz_squared * d * d;
        if x2.abs() < 1e-6 {
            series(x2, d)
        } else if x2 > 0.0 {
            let x = x2.sqrt();
            let (sin, cos) = x.sin_cos();
            (cos, sin / x * d)
        } else {
            let x = (-x2).sqrt();
            let up = x.exp();
            let down = 1.0 / up;
            (0.5 * (up + down), 0.5 * (up - down) / x * d)
        }
    }

    fn decay(kz_squared: Self) -> f64 {
        (-kz_squared).max(0.0).sqrt()
    }

    fn thick(_: &mut State<Self>, _: &Modes<Self>, _: f64) -> bool {
        false
    }
}

/// The first terms, for small x² = kz² d².
fn series<T: Scalar>(x2: T, d: f64) -> (T, T) {
    (
        T::ONE - x2.scaled(0.5) * (T::ONE - x2.scaled(1.0 / 12.0)),
        (T::ONE - x2.scaled(1.0 / 6.0) * (T::ONE - x2.scaled(0.05))).scaled(d),
    )
}
