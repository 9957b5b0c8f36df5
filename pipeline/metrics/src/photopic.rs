// SPDX-License-Identifier: MIT OR Apache-2.0
//! V(λ), the spectral luminous efficiency for photopic vision, and the constant that makes lumens
//! of watts.

use super::colour_matching;

/// Lumens per watt where V is 1: 683 lm/W at 540 THz (SI brochure, 9th edition), there 555 nm.
pub const LUMENS_PER_WATT: f64 = 683.0;

/// V at a wavelength, which is ȳ; 0 outside [`colour_matching::range_nm`].
pub fn v(wavelength_nm: f64) -> f64 {
    colour_matching::xyz(wavelength_nm)[1]
}
