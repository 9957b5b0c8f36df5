// SPDX-License-Identifier: MIT OR Apache-2.0
//! Maps as EXR images: a far field (θ × φ, W/sr) or an illuminance map (y × x, W/mm²).
//!
//! [`write_channels`] writes any number of named quantities over one pair of axes instead.
//!
//! In: a [`Map`] and where it comes from. Out: a linear, losslessly compressed image with the
//! 32-bit channels [`VALUE_CHANNEL`] and [`ERROR_CHANNEL`], one pixel a bin, first row = first bin
//! of the row axis (not flipped for viewing). Units, axes, bin edges and provenance stand in the
//! one attribute [`ATTRIBUTE`] as a JSON text: the format keeps several attributes in an arbitrary
//! order, and the same map must give the same bytes.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    ReadChannels, ReadLayers, SmallVec, Text, Vec2, WritableImage, read as exr_read,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use metrics::quantity::{Axis, Map};

use runtime::atomic_file::write_atomic;

/// Name of the attribute that holds the JSON text.
pub const ATTRIBUTE: &str = "batwing";
/// Channel of the values, in the unit that the attribute names.
pub const VALUE_CHANNEL: &str = "value";
/// Channel of the standard errors, in the same unit.
pub const ERROR_CHANNEL: &str = "standard_error";
/// Version of the JSON text's layout.
pub const LAYOUT_VERSION: u32 = 1;

/// The JSON text of the attribute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// [`LAYOUT_VERSION`].
    pub layout_version: u32,
    /// Quantity of the channels: `intensity`.
    pub quantity: String,
    /// Unit as in column names: `w_per_sr`.
    pub unit: String,
    /// Axis from the first row of pixels to the last.
    pub rows: AxisDescription,
    /// Axis from the first column of pixels to the last.
    pub columns: AxisDescription,
    /// Design, model, seed, paths, program version: whatever the caller states.
    pub provenance: Value,
}

/// One axis in the JSON text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisDescription {
    /// Name: `theta`.
    pub name: String,
    /// Unit as in column names: `deg`.
    pub unit: String,
    /// Bin edges, one more than there are pixels.
    pub edges: Vec<f64>,
}

impl From<&Axis> for AxisDescription {
    fn from(axis: &Axis) -> Self {
        Self {
            name: axis.quantity().name().to_owned(),
            unit: axis.quantity().unit().suffix().to_owned(),
            edges: axis.edges().to_vec(),
        }
    }
}

/// Content that [`read_map`] finds in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// Units, axes and provenance.
    pub description: Description,
    /// Values, row by row.
    pub value: Vec<f32>,
    /// Standard errors, row by row.
    pub standard_error: Vec<f32>,
}

/// Writes `map` to `path`, with `provenance` (any JSON) beside the axes.
///
/// # Errors
/// A value outside the range of 32-bit floats, or a file that cannot be written.
pub fn write_map(path: &Path, map: &Map, provenance: &Value) -> Result<()> {
    let description = Description {
        layout_version: LAYOUT_VERSION,
        quantity: map.quantity().name().to_owned(),
        unit: map.quantity().unit().suffix().to_owned(),
        rows: map.rows().into(),
        columns: map.columns().into(),
        provenance: provenance.clone(),
    };
    let channels = SmallVec::from_vec(vec![
        channel(ERROR_CHANNEL, map.standard_error())?,
        channel(VALUE_CHANNEL, map.value())?,
    ]);
    let size = [map.rows().bins(), map.columns().bins()];
    write_image(path, size, channels, &serde_json::to_string(&description)?)
}

/// One quantity of [`write_channels`].
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name in the file: letters, digits and underscores.
    pub name: &'static str,
    /// Quantity: `real part of Ex`.
    pub quantity: &'static str,
    /// Unit: `incident amplitude`.
    pub unit: &'static str,
    /// Values, row by row.
    pub values: Vec<f64>,
}

/// Writes several quantities over the same axes as the channels of one image; the attribute lists
/// name, quantity and unit of each.
///
/// # Errors
/// No channels, two of one name, a length that does not fit the axes, a value outside the range of
/// 32-bit floats, or a file that cannot be written.
pub fn write_channels(
    path: &Path,
    [rows, columns]: [&Axis; 2],
    channels: &[Channel],
    provenance: &Value,
) -> Result<()> {
    ensure!(!channels.is_empty(), "an image needs at least one channel");
    for (i, c) in channels.iter().enumerate() {
        ensure!(
            channels[..i].iter().all(|other| other.name != c.name),
            "channel `{}` appears twice",
            c.name
        );
        ensure!(
            c.values.len() == rows.bins() * columns.bins(),
            "channel `{}`: expected {} x {} values, got {}",
            c.name,
            rows.bins(),
            columns.bins(),
            c.values.len()
        );
    }
    let list: Vec<Value> = channels
        .iter()
        .map(|c| serde_json::json!({"name": c.name, "quantity": c.quantity, "unit": c.unit}))
        .collect();
    let description = serde_json::json!({
        "layout_version": LAYOUT_VERSION,
        "channels": list,
        "rows": AxisDescription::from(rows),
        "columns": AxisDescription::from(columns),
        "provenance": provenance,
    });
    let samples =
        channels.iter().map(|c| channel(c.name, &c.values)).collect::<Result<Vec<_>>>()?;
    let size = [rows.bins(), columns.bins()];
    write_image(path, size, SmallVec::from_vec(samples), &description.to_string())
}

fn write_image(
    path: &Path,
    [rows, columns]: [usize; 2],
    channels: SmallVec<[AnyChannel<FlatSamples>; 4]>,
    description: &str,
) -> Result<()> {
    let text = ascii(description);
    let mut attributes = LayerAttributes::default();
    attributes.other.insert(Text::from(ATTRIBUTE), AttributeValue::Text(Text::from(text.as_str())));
    let size = Vec2(columns, rows);
    let image = Image::from_layer(Layer::new(
        size,
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    ));
    write_atomic(path, |file| {
        // One thread, so that blocks land in the file in one order.
        image.write().non_parallel().to_buffered(file)?;
        Ok(())
    })
}

/// Reads what [`write_map`] wrote.
///
/// # Errors
/// A file that is no EXR image, lacks the attribute or a channel, or whose axes do not fit its
/// size.
pub fn read_map(path: &Path) -> Result<Contents> {
    let (layer, text) = read_layer(path)?;
    let description: Description = serde_json::from_str(&text)
        .with_context(|| format!("`{}`: attribute `{ATTRIBUTE}`", path.display()))?;
    ensure!(
        description.layout_version == LAYOUT_VERSION,
        "`{}`: expected layout version {LAYOUT_VERSION}, got {}",
        path.display(),
        description.layout_version
    );
    ensure!(
        description.rows.edges.len() == layer.size.height() + 1
            && description.columns.edges.len() == layer.size.width() + 1,
        "`{}`: {} x {} pixels do not fit the axes",
        path.display(),
        layer.size.height(),
        layer.size.width()
    );
    let samples = |name: &str| -> Result<Vec<f32>> {
        let found = layer.channel_data.list.iter().find(|c| c.name == *name);
        match found.map(|channel| &channel.sample_data) {
            Some(FlatSamples::F32(samples)) => Ok(samples.clone()),
            Some(_) => bail!("`{}`: channel `{name}` is not f32", path.display()),
            None => bail!("`{}`: expected a channel `{name}`", path.display()),
        }
    };
    Ok(Contents {
        value: samples(VALUE_CHANNEL)?,
        standard_error: samples(ERROR_CHANNEL)?,
        description,
    })
}

/// The one layer of an image and the text of its attribute.
fn read_layer(path: &Path) -> Result<(Layer<AnyChannels<FlatSamples>>, String)> {
    let image = exr_read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_file(path)
        .with_context(|| format!("cannot read the EXR image `{}`", path.display()))?;
    let layer = image.layer_data;
    let Some(AttributeValue::Text(text)) = layer.attributes.other.get(&Text::from(ATTRIBUTE))
    else {
        bail!("`{}`: expected the text attribute `{ATTRIBUTE}`", path.display());
    };
    let text = text.to_string();
    Ok((layer, text))
}

/// JSON with every character beyond ASCII escaped, as the image format asks of its texts.
pub(super) fn ascii(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for letter in json.chars() {
        if letter.is_ascii() {
            text.push(letter);
        } else {
            for unit in letter.encode_utf16(&mut [0; 2]) {
                let _ = write!(text, "\\u{unit:04x}");
            }
        }
    }
    text
}

pub(super) fn channel(name: &str, values: &[f64]) -> Result<AnyChannel<FlatSamples>> {
    let samples: Vec<f32> = values.iter().map(|&v| v as f32).collect();
    ensure!(
        samples.iter().all(|v| v.is_finite()),
        "channel `{name}`: a value is outside the range of 32-bit floats"
    );
    Ok(AnyChannel::new(name, FlatSamples::F32(samples)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    use metrics::quantity::{Quantity, Unit};

    fn far_field() -> Map {
        let theta = Axis::uniform(Quantity::new("theta", Unit::Degree), 0.0, 180.0, 45).unwrap();
        let phi = Axis::uniform(Quantity::new("phi", Unit::Degree), 0.0, 360.0, 17).unwrap();
        let value: Vec<f64> = (0..45 * 17).map(|i| 0.1 + f64::from(i) / 3.0).collect();
        let error: Vec<f64> = value.iter().map(|v| v * 0.01).collect();
        let intensity = Quantity::new("intensity", Unit::WattPerSteradian);
        Map::new(intensity, theta, phi, value, error).unwrap()
    }

    fn provenance() -> Value {
        serde_json::json!({"design": "D1", "model": "hybrid_10um", "seed": 7, "λ_nm": 550.0, "b": [1, 2], "a": null, "note": "\u{1f4a1}"})
    }

    #[test]
    fn a_map_comes_back_as_it_was_written() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("far-field.exr");
        let map = far_field();
        write_map(&path, &map, &provenance()).unwrap();

        let contents = read_map(&path).unwrap();
        let single = |list: &[f64]| list.iter().map(|&v| v as f32).collect::<Vec<_>>();
        assert_eq!(contents.value, single(map.value()));
        assert_eq!(contents.standard_error, single(map.standard_error()));
        assert_eq!(contents.description.unit, "w_per_sr");
        assert_eq!(contents.description.rows.name, "theta");
        assert_eq!(contents.description.rows.edges, map.rows().edges());
        assert_eq!(contents.description.columns.edges, map.columns().edges());
        assert_eq!(contents.description.provenance, provenance());
    }

    #[test]
    fn the_same_map_gives_the_same_bytes() {
        let directory = tempfile::tempdir().unwrap();
        let bytes: Vec<Vec<u8>> = (0..8)
            .map(|i| {
                let path = directory.path().join(format!("{i}.exr"));
                write_map(&path, &far_field(), &provenance()).unwrap();
                fs::read(path).unwrap()
            })
            .collect();
        assert!(bytes.windows(2).all(|pair| pair[0] == pair[1]));
    }

    #[test]
    fn channels_keep_their_names_and_units() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("channels.exr");
        let axis = |name, bins| {
            Axis::uniform(Quantity::new(name, Unit::Micrometre), -1.0, 1.0, bins).unwrap()
        };
        let (z, x) = (axis("z", 2), axis("x", 3));
        let of = |name, start: f64| Channel {
            name,
            quantity: "number",
            unit: "1",
            values: (0..6).map(|i| start + f64::from(i)).collect(),
        };
        let channels = [of("b", 10.0), of("a", 0.0)];
        write_channels(&path, [&z, &x], &channels, &provenance()).unwrap();
        let (layer, text) = read_layer(&path).unwrap();
        for (channel, (name, start)) in
            layer.channel_data.list.iter().zip([("a", 0.0), ("b", 10.0)])
        {
            assert!(channel.name == *name);
            let FlatSamples::F32(samples) = &channel.sample_data else { panic!("f32") };
            assert_eq!(samples[0].to_bits(), f32::to_bits(start));
            assert_eq!(samples.len(), 6);
        }
        let json: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["channels"][0]["name"], "b");
        assert_eq!(json["rows"]["unit"], "um");
        assert_eq!(json["columns"]["edges"].as_array().unwrap().len(), 4);
        assert_eq!(json["provenance"], provenance());

        let twice = [of("a", 0.0), of("a", 1.0)];
        assert!(write_channels(&path, [&z, &x], &twice, &Value::Null).is_err());
        assert!(write_channels(&path, [&z, &z], &channels, &Value::Null).is_err());
        assert!(write_channels(&path, [&z, &x], &[], &Value::Null).is_err());
    }

    #[test]
    fn rows_follow_the_row_axis() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("map.exr");
        let axis = |name, bins| {
            Axis::uniform(Quantity::new(name, Unit::Millimetre), 0.0, 1.0, bins).unwrap()
        };
        let quantity = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let value = vec![0.0, 1.0, 2.0, 10.0, 11.0, 12.0];
        let map = Map::new(quantity, axis("y", 2), axis("x", 3), value, vec![0.0; 6]).unwrap();
        write_map(&path, &map, &Value::Null).unwrap();
        assert_eq!(read_map(&path).unwrap().value, [0.0, 1.0, 2.0, 10.0, 11.0, 12.0]);
    }

    #[test]
    fn a_value_too_large_for_f32_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let axis =
            |name| Axis::uniform(Quantity::new(name, Unit::Millimetre), 0.0, 1.0, 1).unwrap();
        let quantity = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let map = Map::new(quantity, axis("y"), axis("x"), vec![1e300], vec![0.0]).unwrap();
        let path = directory.path().join("map.exr");
        assert!(write_map(&path, &map, &Value::Null).is_err());
        assert!(!path.exists());
    }

    #[test]
    fn a_file_that_is_no_image_is_an_error_with_its_name() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("text.exr");
        fs::write(&path, "not an image").unwrap();
        let error = read_map(&path).unwrap_err();
        assert!(error.to_string().contains("text.exr"), "{error}");
    }
}
