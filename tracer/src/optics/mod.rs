// SPDX-License-Identifier: MIT OR Apache-2.0
//! Optics of media and interfaces: Fresnel's formulas, thin films, Stokes parameters.

pub mod fresnel;
pub mod media;
pub mod polarisation;
pub mod thin_film;
