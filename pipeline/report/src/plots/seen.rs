// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures of a display as they look, beside each other at one exposure.

use anyhow::{Result, ensure};

use metrics::quantity::{Axis, Quantity};

use super::Heading;
use super::draw::canvas::{Align, Letters, Picture, Rect};
use super::draw::colour::{Colour, is_out_of_srgb, real};
use super::draw::panel::LABEL_SIZE;
use super::draw::scale::significant;
use super::draw::sheet::{Entry, Sample, Sheet};
use super::map::{BELOW, map_panel};

/// Stripes over colours that sRGB does not hold.
const STRIPE: Colour = Colour::new(128, 128, 132);
/// Stripes over the longer side of a picture.
const STRIPES: usize = 150;
/// Most pixels along a side; more are put together by their mean light.
const MOST_PIXELS: usize = 1200;
/// Width and height of a sheet for each picture, and its least height.
const WIDTH: u32 = 900;
const HEIGHT: u32 = 770;

/// One of the pictures of [`seen`].
#[derive(Clone, Copy, Debug)]
pub struct SeenPicture<'a> {
    /// Name of the picture.
    pub name: &'a str,
    /// Columns and rows.
    pub size: [usize; 2],
    /// X, Y and Z of every place, row by row from the bottom.
    pub xyz: &'a [[f64; 3]],
}

/// Draws pictures of one display over these axes as they look: light of D65 whose Y is `white`, a
/// luminance of `quantity`, is the white of sRGB. Brighter light keeps its colour at the full
/// brightness; colours beyond sRGB lose saturation and are striped.
///
/// # Errors
/// A `white` that is not positive; a picture that has not its number of places.
pub fn seen(
    heading: &Heading,
    axes: [&Axis; 2],
    pictures: &[SeenPicture],
    (white, quantity): (f64, &Quantity),
) -> Result<Picture> {
    ensure!(white > 0.0 && white.is_finite(), "expected a positive exposure, got {white}");
    for SeenPicture { name, size: [columns, rows], xyz } in pictures {
        ensure!(
            *columns > 0 && columns * rows == xyz.len(),
            "{name}: expected {columns} x {rows} places, got {}",
            xyz.len()
        );
    }
    let legend = [Entry::new(Sample::Area(STRIPE), "stripes: beyond sRGB, shown less saturated")];
    let mut sheet = Sheet::new(WIDTH * pictures.len() as u32, HEIGHT, heading, &legend);
    let mut bottom = 0.0f64;
    let width = sheet.body.width() / pictures.len().max(1) as f64;
    for (number, picture) in pictures.iter().enumerate() {
        let left = sheet.body.left + number as f64 * width;
        let room = Rect::new(left, sheet.body.top, left + width, sheet.body.bottom);
        let panel = map_panel(&mut sheet, room, axes);
        let (size, light) = reduced(picture, white);
        let beyond = light.iter().filter(|xyz| is_out_of_srgb(**xyz)).count();
        let step = (size[0].max(size[1]) / STRIPES).max(1);
        sheet.canvas.image(panel.area, size, false, |column, row| {
            let xyz = light[(size[1] - 1 - row) * size[0] + column];
            let is_striped = is_out_of_srgb(xyz) && ((column + row) / step).is_multiple_of(4);
            if is_striped { STRIPE } else { real(xyz) }
        });
        let share = match 100.0 * beyond as f64 / light.len() as f64 {
            0.0 => "nothing".to_owned(),
            share => format!("{} %", significant(share, 2)),
        };
        let words = format!(
            "{}: white is {} {}; {share} beyond sRGB",
            picture.name,
            significant(white, 3),
            quantity.unit().symbol()
        );
        let letters = Letters::new(LABEL_SIZE, Align::Left).bold();
        sheet.canvas.text(&words, [panel.area.left, panel.area.top - 18.0], &letters);
        panel.frame(&mut sheet.canvas);
        bottom = bottom.max(panel.area.bottom + BELOW);
    }
    sheet.canvas.cut(bottom);
    Ok(sheet.canvas.finish())
}

/// Means over so many places together that at most [`MOST_PIXELS`] stand along a side, for a white
/// of 1.
fn reduced(picture: &SeenPicture, white: f64) -> ([usize; 2], Vec<[f64; 3]>) {
    let [columns, rows] = picture.size;
    let together = columns.max(rows).div_ceil(MOST_PIXELS);
    let size = picture.size.map(|count| count.div_ceil(together));
    let mean = |k: usize| {
        let [i, j] = [k % size[0] * together, k / size[0] * together];
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for row in j..(j + together).min(rows) {
            for xyz in &picture.xyz[row * columns + i..row * columns + (i + together).min(columns)]
            {
                (0..3).for_each(|k| sum[k] += xyz[k]);
                count += white;
            }
        }
        sum.map(|v| v / count)
    };
    (size, (0..size[0] * size[1]).map(mean).collect())
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;
    use metrics::quantity::Unit;

    const D65: [f64; 3] = [0.9505, 1.0, 1.0890];

    fn drawn(pictures: &[SeenPicture], white: f64) -> Result<Picture> {
        let axis = |name| Axis::uniform(Quantity::new(name, Unit::Millimetre), -2.0, 2.0, 2);
        let [x, y] = [axis("x")?, axis("y")?];
        let quantity = Quantity::new("luminance", Unit::CandelaPerSquareMetre);
        seen(&Heading::new("Seen", "a panel"), [&x, &y], pictures, (white, &quantity))
    }

    #[test]
    fn exposure_and_colours_beyond_srgb_are_stated() {
        // White at the exposure, half of it, a laser at 532 nm, and black.
        let xyz = [D65.map(|v| 400.0 * v), D65.map(|v| 200.0 * v), [43.0, 200.0, 9.0], [0.0; 3]];
        let one = SeenPicture { name: "panel", size: [2, 2], xyz: &xyz };
        let picture = drawn(&[one, one], 400.0).expect("drawn");
        // The slash is escaped.
        let svg = picture.svg().replace("&#x2f;", "/");
        assert!(svg.contains("panel: white is 400 cd/m²; 25 % beyond sRGB"));
        let dark = SeenPicture { name: "film", size: [1, 1], xyz: &xyz[3..] };
        let words = drawn(&[dark], 1.0).expect("drawn");
        assert!(words.svg().contains("nothing beyond sRGB"), "{}", words.svg());
        // The row from the bottom: white, then half of it, 188 of 255.
        let pixels = decode(&picture);
        let found: Vec<[u8; 3]> = pixels
            .pixels()
            .iter()
            .map(|p| [p.red(), p.green(), p.blue()])
            .filter(|[r, g, b]| r == g && g == b)
            .collect();
        assert!(found.iter().filter(|p| **p == [188; 3]).count() > 10_000);
        for (white, size) in [(0.0, [2, 2]), (f64::NAN, [2, 2]), (1.0, [3, 2])] {
            assert!(drawn(&[SeenPicture { size, ..one }], white).is_err());
        }
    }

    #[test]
    fn large_pictures_keep_their_mean_light() {
        let xyz: Vec<[f64; 3]> = (0..2500 * 3).map(|k| [f64::from(k % 3); 3]).collect();
        let large = SeenPicture { name: "film", size: [2500, 3], xyz: &xyz };
        let (size, light) = reduced(&large, 2.0);
        assert_eq!(size, [834, 1]);
        // Every three by three places hold all three levels, of mean 1, but for the last column.
        assert!(light[..833].iter().all(|v| (v[1] - 0.5).abs() < 1e-12));
    }
}
