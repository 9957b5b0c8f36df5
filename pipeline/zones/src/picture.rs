// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures on a panel: the light that they ask for, and what they look like on it.

use anyhow::{Result, bail};
use rayon::prelude::*;

use formats::level_image::{ColourImage, LevelImage};
use metrics::chromaticity;
use metrics::gamut::{self, Matrix, Primaries, apply, inverse};
use metrics::transfer::Transfer;

use super::map_receiver::Frame;
use super::panel_colour::{Backlight, SubPixels};
use super::pattern_colours::PatternColours;

/// How levels of a picture stand for light: primaries, none of grey, and the transfer.
pub type Law = (Option<Primaries>, Transfer);

/// Refuses primaries that a panel's white lies outside of.
///
/// # Errors
/// These.
pub fn check_white(primaries: &Primaries, white: [f64; 2]) -> Result<()> {
    if primaries.hold(white) { Ok(()) } else { Err(outside(primaries, white)) }
}

/// The refusal of primaries that a panel's white lies outside of.
pub(super) fn outside(primaries: &Primaries, [x, y]: [f64; 2]) -> anyhow::Error {
    anyhow::anyhow!(
        "--gamut: expected primaries about the white of the panel, {x:.4},{y:.4}, got {}; --white states another white",
        primaries.name
    )
}

/// X, Y and Z that a picture asks for in each pixel, row after row from the bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureLight {
    /// Pixels along x.
    pub columns: usize,
    /// Pixels along y.
    pub rows: usize,
    /// X, Y and Z over Y of white, or in cd/m² where the transfer states them.
    pub xyz: Vec<[f32; 3]>,
}

impl PictureLight {
    /// The light of `image` on a panel of this white (x, y); without primaries it is grey, a share of
    /// that white.
    ///
    /// # Errors
    /// A white outside the primaries.
    pub fn new(image: &ColourImage, (primaries, transfer): Law, white: [f64; 2]) -> Result<Self> {
        let level = |level: u16| transfer.light(f64::from(level) / 65_535.0);
        let light: Vec<f64> = (0..=u16::MAX).map(level).collect();
        let peak = transfer.peak_cd_m2().unwrap_or(1.0);
        let to_xyz = match &primaries {
            Some(primaries) => {
                check_white(primaries, white)?;
                primaries.to_xyz(white)
            }
            None if white[1] <= 0.0 => {
                bail!("--picture: expected channels that shine on the panel, got none")
            }
            None => chromaticity::xyz_of_xy(white).map(|value| [value, 0.0, 0.0]),
        };
        let to_xyz = to_xyz.map(|row| row.map(|value| peak * value));
        let one = |levels: &[u16; 3]| {
            let light = levels.map(|level| light[usize::from(level)]);
            apply(&to_xyz, light).map(|value| value as f32)
        };
        let xyz = image.levels.par_iter().map(one).collect();
        Ok(Self { columns: image.columns, rows: image.rows, xyz })
    }

    /// Levels as light, in place of X, Y and Z.
    pub fn grey(image: &LevelImage) -> Self {
        Self::of_levels(image, [1.0; 3])
    }

    /// Levels as light of a panel of this white (x, y).
    pub fn greys(image: &LevelImage, white: [f64; 2]) -> Self {
        Self::of_levels(image, chromaticity::xyz_of_xy(white))
    }

    fn of_levels(image: &LevelImage, white: [f64; 3]) -> Self {
        let of = |level: &f64| white.map(|value| (level * value) as f32);
        let xyz = image.levels.iter().map(of).collect();
        Self { columns: image.columns, rows: image.rows, xyz }
    }
}

/// A picture on a panel of sub-pixels.
pub struct PictureOnPanel<'a> {
    /// What it asks for.
    pub picture: &'a PictureLight,
    /// The panel, before parts of the light.
    pub sub_pixels: SubPixels,
    /// Factor from the picture to the numbers of the responses, by readings.
    pub scale: Vec<f64>,
    /// Readings of X, Y and Z of white behind the panel, in the numbers of the responses.
    pub white: Vec<[f64; 3]>,
    /// Δu'v' of white that light from beyond the traced array may make.
    pub white_moves_uv: f64,
}

/// X, Y and Z to linear red, green and blue of BT.709 in which `white` is (1, 1, 1) at Y = 1. Before a
/// white outside BT.709 one of the primaries would be negative; X, Y and Z then are scaled to D65.
fn to_painted(white: [f64; 2]) -> Matrix {
    let of = |white| inverse(&gamut::BT709.to_xyz(white)).unwrap_or_default();
    if gamut::BT709.hold(white) {
        return of(white);
    }
    let [xyz, d65] = [white, gamut::D65].map(chromaticity::xyz_of_xy);
    of(gamut::D65).map(|row| [0, 1, 2].map(|k| row[k] * d65[k] / xyz[k]))
}

/// What a panel shows, pixel by pixel from the top, as sRGB of 8 bits in which the panel's white is
/// white: red, green and blue of light that sRGB does not reach are cut off.
pub fn painted(
    shown: &PatternColours,
    (frame, area): (&Frame, [[f64; 2]; 2]),
    on_panel: &PictureOnPanel,
    white: [f64; 2],
) -> Vec<u8> {
    /// Steps of the table of levels.
    const STEPS: usize = 65_535;
    let within = [0, 1].map(|k| frame.middles_within(k, area[k]));
    let [columns, rows] = within.clone().map(|range| range.len());
    let row = |y: usize| &shown.pixels[y * frame.bins[0]..][within[0].clone()];
    let pixels = within[1].clone().flat_map(row).copied().collect();
    let scale = on_panel.scale[on_panel.scale.len() - 1];
    let picture = on_panel.picture;
    let wanted = |i: usize, j: usize| {
        picture.xyz[j * picture.columns + i].map(|value| scale * f64::from(value))
    };
    let white_y = on_panel.white[on_panel.white.len() - 1][1];
    let to_rgb = to_painted(white).map(|row| row.map(|value| value / white_y));
    let level = |k: usize| (255.0 * Transfer::Srgb.level(k as f64 / STEPS as f64)).round() as u8;
    let table: Vec<u8> = (0..=STEPS).map(level).collect();
    let encoded = |light: f64| table[(light.clamp(0.0, 1.0) * STEPS as f64).round() as usize];
    let in_bins = [0, 1].map(|k| {
        let [low, length] = area[k];
        let first = frame.low_mm[k] + within[k].start as f64 * frame.bin_mm[k];
        [(low - first) / frame.bin_mm[k], length / frame.bin_mm[k]]
    });
    let backlight = Backlight::new([columns, rows], in_bins, pixels);
    let size = [picture.columns, picture.rows];
    let rows = backlight.show(size, wanted, |xyz| apply(&to_rgb, xyz).map(encoded));
    rows.into_iter().rev().flatten().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whites_beyond_the_primaries_are_refused() {
        let image = ColourImage::grey(&LevelImage { columns: 1, rows: 1, levels: vec![1.0] });
        let of = |law| move |white| PictureLight::new(&image, (law, Transfer::Srgb), white);
        let in_colours = of(Some(gamut::BT709));
        let error = in_colours([0.2, 0.33]).expect_err("beyond").to_string();
        assert!(error.contains("got BT.709"), "{error}");
        let light = in_colours(gamut::D65).expect("within").xyz[0];
        assert!((light[1] - 1.0).abs() < 1e-6 && light.iter().all(|value| *value > 0.0));
    }

    /// Grey is a share of any white, and is painted grey beside it; light that is red stays so.
    #[test]
    fn grey_is_a_share_of_any_white() {
        let levels = vec![0.25, 1.0];
        let image = ColourImage::grey(&LevelImage { columns: 2, rows: 1, levels });
        for white in [gamut::D65, [0.2, 0.33]] {
            let light = PictureLight::new(&image, (None, Transfer::Gamma(2.0)), white);
            let [dim, full] = light.expect("grey").xyz[..] else { panic!("two pixels") };
            let xyz = chromaticity::xyz_of_xy(white);
            for (k, expected) in xyz.into_iter().enumerate() {
                let [dim, full] = [dim, full].map(|xyz| f64::from(xyz[k]));
                assert!((full - expected).abs() < 1e-6 && (dim - expected / 16.0).abs() < 1e-5);
            }
            let to_rgb = to_painted(white);
            assert!(apply(&to_rgb, xyz).iter().all(|value| (value - 1.0).abs() < 1e-12));
            let [r, g, b] = apply(&to_rgb, chromaticity::xyz_of_xy([0.6, 0.35]));
            assert!(r > g && r > b, "{white:?}: {r} {g} {b}");
        }
    }
}
