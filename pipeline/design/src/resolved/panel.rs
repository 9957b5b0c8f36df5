// SPDX-License-Identifier: MIT OR Apache-2.0
//! The panel before a backlight.

use serde::Serialize;

/// Contrast of a panel that states none.
pub const CONTRAST: f64 = 5000.0;

/// Sub-pixels and what they leak.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    /// Largest over smallest transmittance.
    pub contrast: f64,
    /// Red, green and blue; none without filters of their own.
    pub sub_pixels: Vec<SubPixel>,
}

impl Panel {
    /// What each sub-pixel passes closed, over open, before a panel of this contrast; `None` without
    /// sub-pixels.
    pub fn closed(&self, contrast: f64) -> Option<[f64; 3]> {
        let of = |sub_pixel: &SubPixel| sub_pixel.black.unwrap_or(1.0 / contrast);
        let all: Vec<f64> = self.sub_pixels.iter().map(of).collect();
        all.try_into().ok()
    }
}

/// A filter that opens and closes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubPixel {
    /// Wavelengths, nm, ascending.
    pub wavelength_nm: Vec<f64>,
    /// Transmittance at each, open.
    pub transmittance: Vec<f64>,
    /// Transmittance closed over that open, where it is stated.
    pub black: Option<f64>,
}

impl SubPixel {
    /// Transmittance of the open sub-pixel; 0 beyond the rows.
    pub fn at(&self, nm: f64) -> f64 {
        let (x, y) = (&self.wavelength_nm, &self.transmittance);
        let after = x.partition_point(|row| *row < nm);
        match after.checked_sub(1) {
            Some(k) if after < x.len() => {
                y[k] + (y[after] - y[k]) * (nm - x[k]) / (x[after] - x[k])
            }
            None if x.first().is_some_and(|first| *first <= nm) => y[0],
            _ => 0.0,
        }
    }
}
