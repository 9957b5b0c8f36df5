// SPDX-License-Identifier: MIT OR Apache-2.0
//! Optics of media and interfaces: Fresnel's formulas, thin films, Stokes parameters, phase
//! functions, Mie's series, luminescence.

pub mod fresnel;
pub mod luminescence;
pub mod media;
pub mod mie;
pub mod phase;
pub mod polarisation;
pub mod thin_film;
