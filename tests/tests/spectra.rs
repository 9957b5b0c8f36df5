// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light of more than one wavelength.

mod coloured_led;
mod coloured_rays;
mod colours;
mod spectrum;
