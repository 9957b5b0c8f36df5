// SPDX-License-Identifier: MIT OR Apache-2.0
//! The pictures of a film of `batwing zones`: figures over the number of the picture, and small pictures
//! of what the panel shows of each.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};
use tiny_skia::{ColorU8, Pixmap};

use metrics::Estimate;
use metrics::quantity::{Quantity, Unit};
use metrics::transfer::Transfer;
use results::zones::{FILM_FOLDER, FILM_TABLE, ZonesFile, film_figures};

use super::folder::SealedFolder;
use super::pictures::Album;
use crate::plots::{self, Heading};

/// Most pictures on the page, and their pixels together: some 2 MB of it.
const MOST_PICTURES: usize = 60;
const MOST_PIXELS: usize = 600_000;

/// Figures and pictures of a film for the template; null of a single picture.
///
/// # Errors
/// A table of another layout; a picture that is no PNG.
pub fn film(album: &mut Album, folder: &SealedFolder<ZonesFile>) -> Result<Value> {
    let (file, directory) = (&folder.file, folder.directory());
    if !file.files.iter().any(|one| one.file == FILM_TABLE) {
        return Ok(Value::Null);
    }
    let heading = Heading::new("Film", format!("{}, over the number of the picture", file.design));
    let picture = plots::film(&heading, &figures(&directory.join(FILM_TABLE), file)?)?;
    let curves = album.fixed(&picture, "Figures of the pictures of the film, with bands of two standard errors; a picture without black beside bright has no halo, and a dark one misses nothing.");
    let names = file.files.iter().filter_map(|one| one.file.strip_prefix(FILM_FOLDER));
    let names: Vec<&str> = names.filter_map(|name| name.strip_prefix('/')).collect();
    let step = names.len().div_ceil(MOST_PICTURES).max(1);
    let most = MOST_PIXELS / names.len().clamp(1, MOST_PICTURES);
    let pictures = names.iter().enumerate().step_by(step).map(|(number, name)| {
        let png = reduced(&directory.join(FILM_FOLDER).join(name), most)?;
        Ok(json!({"png": BASE64_STANDARD.encode(png), "caption": format!("{}: {name}", number + 1)}))
    });
    Ok(json!({
        "curves": curves,
        "pictures": pictures.collect::<Result<Vec<_>>>()?,
        "step": step,
    }))
}

/// The figures in the table at `path` that any picture has, with their errors.
fn figures(path: &Path, file: &ZonesFile) -> Result<Vec<(Quantity, Vec<Option<Estimate>>)>> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read `{shown}`"))?;
    // From the right: the names on the left may hold commas.
    let mut rows = text.lines().map(|line| line.rsplit(',').collect::<Vec<_>>());
    let heads = rows.next().unwrap_or_default();
    let rows: Vec<Vec<&str>> = rows.collect();
    ensure!(!rows.is_empty(), "`{shown}`: expected a row for each picture, got none");
    let column = |key: &str| {
        let place = heads.iter().position(|head| *head == key)?;
        let cell = |row: &Vec<&str>| row.get(place).and_then(|cell| cell.parse::<f64>().ok());
        Some(rows.iter().map(cell).collect::<Vec<_>>())
    };
    let light =
        Quantity::new(&file.quantity, Unit::from_name(&file.unit).unwrap_or(Unit::Relative));
    let mut figures = Vec::new();
    for quantity in film_figures(&light) {
        let values = column(&quantity.key());
        let values =
            values.with_context(|| format!("`{shown}`: expected a column {}", quantity.key()))?;
        let of_error =
            Quantity::new(format!("{} standard error", quantity.name()), quantity.unit());
        // The share of power is exact.
        let errors = column(&of_error.key()).unwrap_or_else(|| vec![Some(0.0); values.len()]);
        let both = values.into_iter().zip(errors).map(|(value, error)| {
            Some(Estimate::new(value.filter(|v| v.is_finite())?, error.filter(|e| e.is_finite())?))
        });
        figures.push((quantity, both.collect::<Vec<_>>()));
    }
    figures.retain(|(_, values)| values.iter().any(Option::is_some));
    Ok(figures)
}

/// The picture at `path` in at most so many pixels, each the mean light of a block, as PNG.
fn reduced(path: &Path, most: usize) -> Result<Vec<u8>> {
    let shown = path.display();
    let png = std::fs::read(path).with_context(|| format!("cannot read `{shown}`"))?;
    let whole = Pixmap::decode_png(&png).with_context(|| format!("`{shown}`: expected a PNG"))?;
    let size = [whole.width(), whole.height()].map(|count| count as usize);
    let pixels = |block: usize| size[0].div_ceil(block) * size[1].div_ceil(block);
    let block = (1..=size[0].max(size[1])).find(|block| pixels(*block) <= most.max(1)).unwrap_or(1);
    let columns = size[0].div_ceil(block);
    let small = Pixmap::new(columns as u32, size[1].div_ceil(block) as u32);
    let mut small = small.with_context(|| format!("no memory for `{shown}`"))?;
    let light: Vec<f64> = (0..=255).map(|k| Transfer::Srgb.light(f64::from(k) / 255.0)).collect();
    for (number, pixel) in small.pixels_mut().iter_mut().enumerate() {
        let range =
            |place: usize, axis: usize| place * block..((place + 1) * block).min(size[axis]);
        let (across, along) = (range(number % columns, 0), range(number / columns, 1));
        let mut sums = [0.0; 3];
        for place in along.clone().flat_map(|y| across.clone().map(move |x| y * size[0] + x)) {
            let of = whole.pixels()[place];
            let levels = [of.red(), of.green(), of.blue()];
            (0..3).for_each(|k| sums[k] += light[usize::from(levels[k])]);
        }
        let count = (across.len() * along.len()) as f64;
        let level = |sum: f64| (255.0 * Transfer::Srgb.level(sum / count)).round() as u8;
        let [r, g, b] = sums.map(level);
        *pixel = ColorU8::from_rgba(r, g, b, 255).premultiply();
    }
    small.encode_png().context("cannot encode a picture")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One white pixel of four is a quarter of the light, 137 of 255 in sRGB; in full it stays.
    #[test]
    fn small_pictures_have_the_mean_light_of_their_blocks() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let mut picture = Pixmap::new(4, 2).expect("pixels");
        picture.fill(tiny_skia::Color::BLACK);
        picture.pixels_mut()[5] = ColorU8::from_rgba(255, 255, 255, 255).premultiply();
        std::fs::write(&path, picture.encode_png().expect("a PNG")).expect("written");
        let pixels = |most: usize| {
            let small = Pixmap::decode_png(&reduced(&path, most).expect("a picture"));
            small.expect("a PNG").pixels().iter().map(|of| of.green()).collect::<Vec<_>>()
        };
        assert_eq!(pixels(2), [137, 0]);
        assert_eq!(pixels(8), [0, 0, 0, 0, 0, 255, 0, 0]);
    }
}
