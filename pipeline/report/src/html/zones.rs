// SPDX-License-Identifier: MIT OR Apache-2.0
//! The page of a sum of dimming zones: figures, backlight and panel, the light of one zone.

use anyhow::{Context, Result};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};

use metrics::digits::{shortest, thousands};
use metrics::quantity::{Curve, Quantity, Unit};
use results::zones::{COLOUR_PICTURES, MAPS, SPREAD, ZonesFile};

use super::folder::SealedFolder;
use super::models::{Columns, label};
use super::pictures::Album;
use crate::plots::{Heading, LineColours, Section, cross_section};

/// Figures and pictures of `folder` for the template.
///
/// # Errors
/// A file of another layout.
pub fn zones(album: &mut Album, folder: &SealedFolder<ZonesFile>) -> Result<Value> {
    let file = &folder.file;
    let captions = MAPS.into_iter().zip([
        format!("Backlight at the drives of the pattern, {}.", file.unit),
        format!("Light behind the panel, which shows the picture, {}.", file.unit),
    ]);
    let in_colour = COLOUR_PICTURES.into_iter().zip([
        "Picture, backlight and panel as they look beside a white of D65, at one exposure."
            .to_owned(),
        "Halo: ΔE_ITP of what the panel shows where the picture is black.".to_owned(),
        "Error: ΔE_ITP of what the panel shows against the picture.".to_owned(),
    ]);
    let is_listed = |name: &str| file.files.iter().any(|one| one.file == format!("{name}.png"));
    let captions = in_colour.filter(|(name, _)| is_listed(name)).chain(captions);
    let picture = |(name, caption): (&str, String)| -> Result<Value> {
        let path = folder.directory().join(format!("{name}.png"));
        let png = std::fs::read(&path);
        let png = png.with_context(|| format!("cannot read `{}`", path.display()))?;
        Ok(json!({"png": BASE64_STANDARD.encode(png), "caption": caption}))
    };
    Ok(json!({
        "model": label(&file.model),
        "receiver": file.receiver,
        "contrast": shortest(file.contrast),
        "paths": thousands(file.paths),
        "lines": file.lines(),
        "pictures": captions.map(picture).collect::<Result<Vec<_>>>()?,
        "spread": spread(album, folder)?,
    }))
}

/// Light of one zone over the distance from its middle.
fn spread(album: &mut Album, folder: &SealedFolder<ZonesFile>) -> Result<Value> {
    let (file, path) = (&folder.file, folder.directory().join(SPREAD));
    let columns = Columns::read(&path)?;
    let unit = Unit::from_name(&file.unit).unwrap_or(Unit::Relative);
    let column = |begin: &str, end: &str| {
        let found = columns.find(begin, end).map(<[f64]>::to_vec);
        let wanted = || format!("`{}`: expected a column {begin}...{end}", path.display());
        found.with_context(wanted)
    };
    let value = column(&file.quantity, unit.suffix())?;
    let error = column(&file.quantity, &format!("standard_error_{}", unit.suffix()))?;
    let [zone_column, zone_row] = file.light_spread.zone;
    let name = format!("zone {zone_column}, {zone_row}");
    let curve = Curve::new(&name, column("distance", "mm")?, value, error)?;
    let picture = cross_section(&Section {
        heading: &Heading::new("Light of one zone", &file.design),
        position: &Quantity::new("distance from its middle", Unit::Millimetre),
        quantity: &Quantity::new(&file.quantity, unit),
        curves: &[curve],
        leds: &[],
        marks: &[],
        level: None,
        colours: LineColours::Ordered,
        range: None,
    })?;
    let caption = format!(
        "Backlight of the zone in column {zone_column} and row {zone_row} from the top, at full drive, as means over rings."
    );
    Ok(album.fixed(&picture, &caption))
}
