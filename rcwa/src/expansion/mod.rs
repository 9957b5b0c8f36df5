// SPDX-License-Identifier: MIT OR Apache-2.0
//! Functions of x in which fields are expanded: Fourier orders, or real functions.

pub(crate) mod real;

use crate::linalg::{CMat, Scalar};
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// The two groups of field components, each expanded in functions of its own: K leads from those of
/// the first to those of the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FieldGroup {
    /// Ex and Hy, which LSM modes are made of.
    X,
    /// Ey, Ez and Hx; of LSE modes.
    Z,
}

/// The functions in which fields are expanded.
pub(crate) trait Expansion<T: Scalar> {
    /// Number of functions for a group of components.
    fn count(&self, of: FieldGroup) -> usize;

    /// Highest order of Fourier coefficients that a product needs.
    fn reach(&self) -> usize;

    /// Place (a fraction of the period) about which these coefficients are to be taken.
    fn origin(&self) -> f64;

    /// Matrix of the product with a real function of these coefficients, rows for `to`, columns for
    /// `from`.
    fn multiplication(&self, to: FieldGroup, from: FieldGroup, c: &[Complex64]) -> Mat<T>;

    /// The sign of the matrix of a product from X to Z under the conjugate transpose, 1 or -1;
    /// `None` where the two groups have different functions.
    fn adjoint_sign(&self) -> Option<f64>;

    /// K m, or ∂ m where coordinates are real: from X to Z.
    fn derivative(&self, m: &Mat<T>) -> Mat<T>;

    /// Vectors v whose sum of v v* is the product, from Z to Z, with a delta function at x (a
    /// fraction of the period).
    fn point_values(&self, x: f64) -> Vec<Vec<T>>;

    /// True where [`point_values`](Self::point_values) stands for the mirror image of x about the
    /// origin too.
    fn counts_mirror_image(&self) -> bool;

    /// A random real function of X, then one of Z, for a randomised range finder.
    fn random_vector(&self, column: usize, number: &mut dyn FnMut() -> f64) -> Vec<T>;

    /// Factors of the increments of electric and magnetic coordinates towards the top.
    fn step_factors(&self) -> (T, T);
}

/// Fourier orders with these kx.
pub(crate) struct FourierOrders<'a>(pub(crate) &'a [f64]);

impl Expansion<Complex64> for FourierOrders<'_> {
    fn count(&self, _: FieldGroup) -> usize {
        self.0.len()
    }

    fn reach(&self) -> usize {
        self.0.len() - 1
    }

    fn origin(&self) -> f64 {
        0.0
    }

    fn multiplication(&self, _: FieldGroup, _: FieldGroup, c: &[Complex64]) -> CMat {
        let reach = self.reach();
        Mat::from_fn(reach + 1, reach + 1, |i, j| c[reach + i - j])
    }

    fn adjoint_sign(&self) -> Option<f64> {
        Some(1.0)
    }

    fn derivative(&self, m: &CMat) -> CMat {
        Mat::from_fn(m.nrows(), m.ncols(), |i, j| self.0[i] * m[(i, j)])
    }

    fn point_values(&self, x: f64) -> Vec<Vec<Complex64>> {
        // The common factor of all orders counts for nothing.
        let order = |m: usize| Complex64::cis(-TAU * m as f64 * x);
        vec![(0..self.0.len()).map(order).collect()]
    }

    fn counts_mirror_image(&self) -> bool {
        false
    }

    fn random_vector(&self, _: usize, number: &mut dyn FnMut() -> f64) -> Vec<Complex64> {
        let last = self.reach();
        let mut both = vec![Complex64::ZERO; 2 * (last + 1)];
        for c in both.chunks_mut(last + 1) {
            for i in 0..=last / 2 {
                let value = Complex64::new(number(), if 2 * i == last { 0.0 } else { number() });
                (c[i], c[last - i]) = (value, value.conj());
            }
        }
        both
    }

    fn step_factors(&self) -> (Complex64, Complex64) {
        (-Complex64::I, -Complex64::I)
    }
}
