// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours: lines that colour-blind readers tell apart, and scales whose lightness grows evenly.
//!
//! Meanings of single colours stand in the palette. The scales are curves in the space OKLCH
//! [Ottosson 2020], in which equal steps look equal: lightness rises linearly along them while the
//! hue turns, with a chroma that a screen can show everywhere.

use std::sync::LazyLock;

use metrics::gamut::{BT709, D65, Matrix, apply, inverse};
use metrics::transfer::Transfer;

/// A colour with opacity; red, green, blue in 0..=255 as encoded in sRGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// Red, green, blue.
    pub rgb: [u8; 3],
    /// 0 invisible, 1 opaque.
    pub opacity: f64,
}

impl Colour {
    /// Black.
    pub const BLACK: Self = Self::new(0, 0, 0);
    /// White.
    pub const WHITE: Self = Self::new(255, 255, 255);
    /// Letters.
    pub const TEXT: Self = Self::new(30, 30, 34);
    /// Secondary letters and axis lines.
    pub const MUTED: Self = Self::new(95, 95, 102);
    /// Grid lines.
    pub const GRID: Self = Self::new(214, 214, 219);
    /// Faint grid lines between the others.
    pub const FAINT: Self = Self::new(236, 236, 240);

    /// An opaque colour.
    pub const fn new(red: u8, green: u8, blue: u8) -> Self {
        Self { rgb: [red, green, blue], opacity: 1.0 }
    }

    /// The same colour, partly transparent.
    #[must_use]
    pub const fn with_opacity(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }
}

/// Colour at `share` of the scale of light, held within 0..=1: black through violet and orange to
/// pale yellow.
pub fn glow(share: f64) -> Colour {
    let share = share.clamp(0.0, 1.0);
    let mix = |from: f64, to: f64| from + (to - from) * share;
    let bump = (std::f64::consts::PI * share).sin();
    oklch(mix(0.14, 0.97), 0.035 + 0.145 * bump.powf(0.9), mix(-75.0, 102.0))
}

/// Colour of a difference at `share` of the scale from minus to plus the largest: blue through pale
/// grey to brown.
pub fn diverging(share: f64) -> Colour {
    let from_middle = 2.0 * share.clamp(0.0, 1.0) - 1.0;
    let hue = if from_middle < 0.0 { 250.0 } else { 50.0 };
    oklch(0.95 - 0.45 * from_middle.abs(), 0.105 * from_middle.abs(), hue)
}

/// The sRGB colour of X, Y and Z that look so beside a white of D65 with Y = 1 (IEC 61966-2-1). A
/// colour that no screen shows loses saturation at its Y, one that is too bright its brightness.
pub fn real(xyz: [f64; 3]) -> Colour {
    let channels = linear_srgb(xyz);
    let grey = xyz[1].max(0.0);
    let lowest = channels.iter().copied().fold(grey, f64::min);
    let kept = if lowest < 0.0 { grey / (grey - lowest) } else { 1.0 };
    let mixed = channels.map(|v| (grey + kept * (v - grey)).max(0.0));
    let most = mixed.iter().copied().fold(1.0, f64::max);
    let [r, g, b] = mixed.map(|v| (Transfer::Srgb.level(v / most) * 255.0).round() as u8);
    Colour::new(r, g, b)
}

/// The largest channel of [`real`] before it is limited.
pub fn largest_channel(xyz: [f64; 3]) -> f64 {
    linear_srgb(xyz).into_iter().fold(0.0, f64::max)
}

/// True of a colour that no channels of sRGB make, however bright.
pub fn is_out_of_srgb(xyz: [f64; 3]) -> bool {
    /// Least channel of sRGB, over the largest: of white in four digits it is less.
    const LEAST: f64 = -2e-3;
    let channels = linear_srgb(xyz);
    let least = channels.into_iter().fold(0.0, f64::min);
    least < LEAST * channels.into_iter().fold(0.0, f64::max)
}

fn linear_srgb(xyz: [f64; 3]) -> [f64; 3] {
    static TO_RGB: LazyLock<Matrix> =
        LazyLock::new(|| inverse(&BT709.to_xyz(D65)).unwrap_or_default());
    apply(&TO_RGB, xyz)
}

/// The sRGB colour of this lightness, chroma and hue, which must lie within what a screen shows.
pub(super) fn oklch(lightness: f64, chroma: f64, hue_deg: f64) -> Colour {
    let linear = linear_rgb(lightness, chroma, hue_deg.to_radians());
    debug_assert!(
        linear.iter().all(|v| (-1e-3..=1.001).contains(v)),
        "colour outside sRGB: {linear:?}"
    );
    let [r, g, b] = linear.map(|v| (Transfer::Srgb.level(v.clamp(0.0, 1.0)) * 255.0).round() as u8);
    Colour::new(r, g, b)
}

/// OKLCH to linear sRGB [Ottosson 2020].
fn linear_rgb(lightness: f64, chroma: f64, hue: f64) -> [f64; 3] {
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of an sRGB colour.
    fn luminance(colour: Colour) -> f64 {
        let [r, g, b] = colour.rgb.map(|v| Transfer::Srgb.light(f64::from(v) / 255.0));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    #[test]
    fn the_scale_grows_lighter_all_the_way() {
        let steps: Vec<f64> = (0..=64).map(|i| luminance(glow(f64::from(i) / 64.0))).collect();
        assert!(steps.windows(2).all(|w| w[1] > w[0]), "{steps:?}");
        assert!(luminance(glow(0.0)) < 0.01);
        assert!(luminance(glow(1.0)) > 0.85);
        assert_eq!(glow(-1.0), glow(0.0));
    }

    #[test]
    fn the_scale_steps_evenly_in_lightness() {
        // CIE lightness L* of neighbouring steps differs by no more than twice the mean step.
        let star = |i: u32| {
            let y = luminance(glow(f64::from(i) / 32.0));
            if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
        };
        let mean = (star(32) - star(0)) / 32.0;
        for i in 0..32 {
            let step = star(i + 1) - star(i);
            assert!(step > 0.3 * mean && step < 2.0 * mean, "{i}: {step} of {mean}");
        }
    }

    #[test]
    fn scales_stay_within_what_screens_show() {
        // The assertion within `oklch` judges.
        for i in 0..=1000u32 {
            glow(f64::from(i) / 1000.0);
            diverging(f64::from(i) / 1000.0);
        }
    }

    #[test]
    fn real_colours_are_those_of_the_standard() {
        // White of D65 and the primaries of IEC 61966-2-1: xyY of red is (0.64, 0.33, 0.2126).
        let of = |x: f64, y: f64, luminance: f64| {
            real([x / y, 1.0, (1.0 - x - y) / y].map(|v| v * luminance)).rgb
        };
        let off = |a: [u8; 3], b: [u8; 3]| (0..3).all(|k| a[k].abs_diff(b[k]) <= 1);
        for (found, expected) in [
            (of(0.3127, 0.3290, 1.0), [255, 255, 255]),
            // A luminance of 0.2140 is the middle of the scale.
            (of(0.3127, 0.3290, 0.2140), [127, 127, 127]),
            (of(0.64, 0.33, 0.2126), [255, 0, 0]),
            (of(0.15, 0.06, 0.0722), [0, 0, 255]),
            (real([0.0; 3]).rgb, [0, 0, 0]),
        ] {
            assert!(off(found, expected), "{found:?} {expected:?}");
        }
        // Spectral green is no colour of a screen; it stays green.
        let [r, g, b] = of(0.08, 0.83, 0.3);
        assert!(g > 100 && r < 80 && b < g, "{r} {g} {b}");
    }

    #[test]
    fn white_and_grey_convert_to_themselves() {
        assert_eq!(oklch(1.0, 0.0, 0.0).rgb, [255, 255, 255]);
        assert_eq!(oklch(0.0, 0.0, 0.0).rgb, [0, 0, 0]);
    }
}
