// SPDX-License-Identifier: MIT OR Apache-2.0
//! The change of coordinates at an interface (3.2), from the layer below to the layer above.
//!
//! The tangential fields are continuous. With F = f₊⁻¹ f₋, G_E = (Ag)₊⁻¹(Ag)₋ and G_H = g₊⁻¹ g₋ (₊
//! above, ₋ below)
//!
//! - ex₊ = G_E ex₋,   ey₊ = F ey₋ + ky (O₊ G_E - F O₋) ex₋
//! - hy₊ = G_H hy₋ + ky (G_H Q₋ - Q₊ F) hx₋,     hx₊ = F hx₋
//!
//! Five matrices of size N that do not depend on ky: all ky share their cost.

use crate::linalg::{Scalar, combined, mul, transpose};
use crate::modes::Basis;
use faer::Mat;

/// The five matrices, transposed as in [`super::state::State`].
pub(crate) struct InterfaceMatrices<T> {
    /// Fᵀ: ey to ey and hx to hx.
    pub(crate) lse: Mat<T>,
    /// Of ex to ex.
    pub(crate) electric: Mat<T>,
    /// Of ex to ey, to be multiplied by ky.
    pub(crate) electric_coupling: Mat<T>,
    /// Of hy to hy.
    pub(crate) magnetic: Mat<T>,
    /// Of hx to hy, to be multiplied by ky.
    pub(crate) magnetic_coupling: Mat<T>,
}

impl<T: Scalar> InterfaceMatrices<T> {
    /// From coordinates `below` to coordinates `above`.
    pub(crate) fn new(above: &Basis<T>, below: &Basis<T>) -> Self {
        let lse = mul(&above.f_inverse, &below.f);
        let electric = mul(&above.ag_inverse, &below.ag);
        let magnetic = mul(&above.g_inverse, &below.g);
        let electric_coupling = combined(&mul(&above.o, &electric), &mul(&lse, &below.o), -1.0);
        let magnetic_coupling = combined(&mul(&magnetic, &below.q), &mul(&above.q, &lse), -1.0);
        Self {
            lse: transpose(&lse),
            electric: transpose(&electric),
            electric_coupling: transpose(&electric_coupling),
            magnetic: transpose(&magnetic),
            magnetic_coupling: transpose(&magnetic_coupling),
        }
    }
}
