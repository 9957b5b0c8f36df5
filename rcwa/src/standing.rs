// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bloch wavevectors that are their own mirror image, in real arithmetic.
//!
//! At kx0 = 0 and at half a zone the orders come in pairs ±κ, and a lossless structure has fields that are real but for
//! fixed factors: reversal of time, together with y → -y, leaves exp(i ky y) alone. In the basis of √2 cos κx and √2 sin κx
//!
//! - Ex = ex,   Ey = -i ey,   Hy = i hy,   -Hx = hx
//!
//! with real ex, ey, hy, hx. A layer's matrices, its modes and all products and factorisations of a slice then are real, a
//! quarter of the work. Complex numbers enter
//! only where the half-spaces are matched, with the orders that propagate: `ends`. The idea is that of the R matrix and of
//! the logarithmic derivative in scattering theory \[Manolopoulos1986\]. Real relations have poles (standing waves between
//! the planes), so that the parameters are changed wherever one is near: `crate::stack::propagate`.

pub(crate) mod ends;

use crate::modes::standing::Harmonics;
use crate::orders::{Bloch, Truncation};
use crate::stack::Stack;
use crate::stack::propagate::THIN;

/// A Bloch wavevector that is its own mirror image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mirrored {
    /// kx0 = 0: normal incidence and its orders. Orders -M..=M are kept.
    Centre,
    /// kx0 half an order spacing. Orders -M-1..=M are kept, a set that is its own mirror image.
    Edge,
}

impl Mirrored {
    /// kx0 in units of k0.
    pub fn kx0(self, stack: &Stack) -> f64 {
        match self {
            Self::Centre => 0.0,
            Self::Edge => 0.5 / stack.period_per_wavelength(),
        }
    }
}

/// Layers so thick that they would have to be cut into more slabs than this are left to complex arithmetic.
const MOST_SLABS: f64 = 4.0;

/// The cosines and sines of a line, if real arithmetic serves it: no loss, no metal, no thick layer.
pub(crate) fn harmonics(stack: &Stack, at: Mirrored, truncation: Truncation) -> Option<Harmonics> {
    let harmonics = Harmonics::new(at, truncation.highest(), stack.period_per_wavelength());
    let real = |n: num_complex::Complex64| n.im == 0.0 && n.re > 0.0;
    let half_spaces = [crate::Side::Top, crate::Side::Bottom];
    let steepest = harmonics.wavenumbers().last().copied().unwrap_or(0.0);
    let serves = half_spaces.iter().all(|&side| real(stack.index(side)))
        && stack.layers().iter().all(|layer| {
            layer.segments.iter().all(|s| real(s.index))
                && steepest * stack.optical_thickness(layer) <= MOST_SLABS * THIN
        });
    serves.then_some(harmonics)
}

/// The line's wavevectors with these ky.
pub(crate) fn blochs(stack: &Stack, at: Mirrored, ky: &[f64]) -> Vec<Bloch> {
    let kx0 = at.kx0(stack);
    ky.iter().map(|&ky| Bloch::new(kx0, ky)).collect()
}
