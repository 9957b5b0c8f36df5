// SPDX-License-Identifier: MIT OR Apache-2.0
//! Radiance over place and direction as an EXR image of many layers.
//!
//! In: values and standard errors over four axes (two of the place, two of the direction). Out: one
//! linear, losslessly compressed image file whose layers are the directions, each an image of the
//! places; or, where there are fewer places than directions, the places, each an image of the
//! directions. Where Stokes parameters are given, layers are doubled and doubled again, those of I
//! before those of Q, U and V, and there may be two axes, those of one image; the name of the
//! parameter follows the unit. Every layer has the 32-bit channels [`VALUE_CHANNEL`] and
//! [`ERROR_CHANNEL`] and a name that says what it holds, in which unit, and the middle of its bin:
//! `radiance_w_per_m2_sr_theta_15_deg_phi_45_deg`. The attribute [`ATTRIBUTE`] of the first layer
//! holds all axes and where the values come from as a JSON text. First row = first bin of the row
//! axis, as in [`super::exr`].

use std::path::Path;

use anyhow::{Result, ensure};
use exr::prelude::{
    AnyChannels, AttributeValue, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
    Layer, LayerAttributes, SmallVec, Text, Vec2, WritableImage,
};
use serde_json::{Value, json};

use metrics::quantity::{Axis, Quantity};

use super::exr::{
    ATTRIBUTE, AxisDescription, ERROR_CHANNEL, LAYOUT_VERSION, VALUE_CHANNEL, ascii, channel,
};
use runtime::atomic_file::write_atomic;

/// Values over place and direction.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    /// Quantity of the values.
    pub quantity: &'a Quantity,
    /// Names of Stokes parameters, or none: values of the first are followed by those of the
    /// second.
    pub parameters: &'a [&'a str],
    /// Rows and columns of the place, then of the direction; the last axis runs fastest. Two axes
    /// are those of one image.
    pub axes: &'a [Axis],
    /// Values.
    pub value: &'a [f64],
    /// Their standard errors.
    pub standard_error: &'a [f64],
}

impl Layers<'_> {
    /// Number of bins along two axes.
    fn bins(axes: &[Axis]) -> usize {
        axes.iter().map(Axis::bins).product()
    }

    /// Writes them to `path`, with `provenance` (any JSON) beside the axes.
    ///
    /// # Errors
    /// A number of values that does not fit the axes, a value outside the range of 32-bit floats,
    /// or a file that cannot be written.
    pub fn write(&self, path: &Path, provenance: &Value) -> Result<()> {
        ensure!(
            matches!(self.axes.len(), 2 | 4),
            "expected two axes or four, got {}",
            self.axes.len()
        );
        let (place, direction) = self.axes.split_at(2);
        let (places, directions) = (Self::bins(place), Self::bins(direction));
        let (each, count) = (places * directions, self.parameters.len().max(1));
        for values in [self.value, self.standard_error] {
            ensure!(
                values.len() == each * count,
                "expected {} x {directions} values, got {}",
                count * places,
                values.len()
            );
        }
        // Layers run over the shorter pair of axes, images over the other.
        let of_directions = directions <= places;
        let (layer, image) = if of_directions { (direction, place) } else { (place, direction) };
        let of_parameter = Self::bins(layer);
        let pick = |values: &[f64], number: usize| -> Vec<f64> {
            let values = &values[number / of_parameter * each..][..each];
            let layer = number % of_parameter;
            if of_directions {
                values.iter().skip(layer).step_by(directions).copied().collect()
            } else {
                values[layer * directions..(layer + 1) * directions].to_vec()
            }
        };
        let described = |axes: &[Axis]| -> Vec<AxisDescription> {
            axes.iter().map(AxisDescription::from).collect()
        };
        let mut description = json!({
            "layout_version": LAYOUT_VERSION,
            "quantity": self.quantity.name(),
            "unit": self.quantity.unit().suffix(),
            "layers": described(layer),
            "rows": AxisDescription::from(&image[0]),
            "columns": AxisDescription::from(&image[1]),
            "provenance": provenance,
        });
        if !self.parameters.is_empty() {
            description["parameters"] = json!(self.parameters);
        }
        let size = Vec2(image[1].bins(), image[0].bins());
        let of_layer = |number: usize| -> Result<Layer<AnyChannels<FlatSamples>>> {
            let mut attributes = LayerAttributes::named(
                self.name(layer, number / of_parameter, number % of_parameter).as_str(),
            );
            if number == 0 {
                let text = ascii(&description.to_string());
                attributes
                    .other
                    .insert(Text::from(ATTRIBUTE), AttributeValue::Text(Text::from(text.as_str())));
            }
            let channels = SmallVec::from_vec(vec![
                channel(ERROR_CHANNEL, &pick(self.standard_error, number))?,
                channel(VALUE_CHANNEL, &pick(self.value, number))?,
            ]);
            let channels = AnyChannels::sort(channels);
            Ok(Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels))
        };
        let layers: SmallVec<[_; 2]> =
            (0..count * of_parameter).map(of_layer).collect::<Result<_>>()?;
        let window = IntegerBounds::from_dimensions(size);
        let image = Image::from_layers(ImageAttributes::new(window), layers);
        write_atomic(path, |file| {
            // One thread, so that blocks land in the file in one order.
            image.write().non_parallel().to_buffered(file)?;
            Ok(())
        })
    }

    /// Quantity, unit, Stokes parameter and the middle of the bin along both axes.
    fn name(&self, axes: &[Axis], parameter: usize, number: usize) -> String {
        let columns = axes.get(1).map_or(1, Axis::bins);
        let middles = [number / columns, number % columns];
        let parameter = self.parameters.get(parameter);
        let parameter = parameter.map_or(String::new(), |name| format!("_{name}"));
        let places = axes.iter().zip(middles).map(|(axis, bin)| {
            let (quantity, middle) = (axis.quantity(), axis.centres()[bin]);
            // A millionth of a unit is enough to tell bins apart, and hides what rounding leaves.
            let middle = (middle * 1e6).round() / 1e6;
            format!("_{}_{middle}_{}", quantity.name(), quantity.unit().suffix())
        });
        self.quantity.key() + &parameter + &places.collect::<String>()
    }
}

#[cfg(test)]
mod tests {
    use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
    use tempfile::tempdir;

    use super::*;
    use metrics::quantity::Unit;

    fn axes(bins: [usize; 4]) -> [Axis; 4] {
        let of = |name: &str, unit: Unit, ends: [f64; 2], bins: usize| {
            Axis::uniform(Quantity::new(name, unit), ends[0], ends[1], bins).expect("an axis")
        };
        [
            of("y", Unit::Millimetre, [-1.0, 1.0], bins[0]),
            of("x", Unit::Millimetre, [-3.0, 3.0], bins[1]),
            of("theta", Unit::Degree, [0.0, 90.0], bins[2]),
            of("phi", Unit::Degree, [0.0, 360.0], bins[3]),
        ]
    }

    /// Name of every layer, width, height, values; and the JSON text.
    type Found = (Vec<(String, [usize; 2], Vec<f32>)>, Value);

    fn written(bins: [usize; 4]) -> Found {
        let directory = tempdir().expect("a folder");
        let path = directory.path().join("glow.exr");
        let count = bins.iter().product::<usize>();
        let value: Vec<f64> = (0..count).map(|k| k as f64).collect();
        let standard_error: Vec<f64> = value.iter().map(|v| 0.5 * v).collect();
        let layers = Layers {
            quantity: &Quantity::new("radiance", Unit::WattPerSquareMetreSteradian),
            parameters: &[],
            axes: &axes(bins),
            value: &value,
            standard_error: &standard_error,
        };
        layers.write(&path, &json!({"design": "λ"})).expect("written");
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_file(&path)
            .expect("an image");
        let mut text = String::new();
        let found = image.layer_data.iter().map(|layer| {
            let attribute = layer.attributes.other.get(&Text::from(ATTRIBUTE));
            if let Some(AttributeValue::Text(described)) = attribute {
                text += &described.to_string();
            }
            let samples = |name: &str| {
                let found = layer.channel_data.list.iter().find(|c| c.name == *name);
                let channel = found.expect("a channel");
                match &channel.sample_data {
                    FlatSamples::F32(samples) => samples.clone(),
                    _ => Vec::new(),
                }
            };
            let value = samples(VALUE_CHANNEL);
            for (v, e) in value.iter().zip(samples(ERROR_CHANNEL)) {
                assert!((0.5 * v - e).abs() < 1e-6);
            }
            let name = layer.attributes.layer_name.clone().expect("a name");
            (name.to_string(), [layer.size.width(), layer.size.height()], value)
        });
        let found = found.collect();
        (found, serde_json::from_str(&text).expect("JSON"))
    }

    #[test]
    fn directions_are_layers_of_images_of_places() {
        let (layers, described) = written([3, 2, 2, 2]);
        let names: Vec<&str> = layers.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(
            names,
            [
                "radiance_w_per_m2_sr_theta_22.5_deg_phi_90_deg",
                "radiance_w_per_m2_sr_theta_22.5_deg_phi_270_deg",
                "radiance_w_per_m2_sr_theta_67.5_deg_phi_90_deg",
                "radiance_w_per_m2_sr_theta_67.5_deg_phi_270_deg",
            ]
        );
        for (number, (_, size, value)) in layers.iter().enumerate() {
            assert_eq!(*size, [2, 3]);
            let expected: Vec<f32> = (0..6).map(|k| (4 * k + number) as f32).collect();
            assert_eq!(*value, expected);
        }
        assert_eq!(described["layers"][0]["name"], "theta");
        assert_eq!(described["rows"]["name"], "y");
        assert_eq!(described["unit"], "w_per_m2_sr");
        assert_eq!(described["provenance"]["design"], "λ");
    }

    #[test]
    fn few_places_are_layers_of_images_of_directions() {
        let (layers, described) = written([1, 2, 3, 4]);
        let names: Vec<&str> = layers.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(
            names,
            ["radiance_w_per_m2_sr_y_0_mm_x_-1.5_mm", "radiance_w_per_m2_sr_y_0_mm_x_1.5_mm"]
        );
        for (number, (_, size, value)) in layers.iter().enumerate() {
            assert_eq!(*size, [4, 3]);
            let expected: Vec<f32> = (0..12).map(|k| (12 * number + k) as f32).collect();
            assert_eq!(*value, expected);
        }
        assert_eq!(described["columns"]["edges"].as_array().map(Vec::len), Some(5));
    }

    #[test]
    fn lengths_that_do_not_fit_are_refused() {
        let layers = Layers {
            quantity: &Quantity::new("radiance", Unit::Relative),
            parameters: &[],
            axes: &axes([1, 1, 1, 2]),
            value: &[1.0, 2.0],
            standard_error: &[1.0],
        };
        let path = Path::new("never.exr");
        let error = layers.write(path, &Value::Null).expect_err("refused");
        assert_eq!(error.to_string(), "expected 1 x 2 values, got 1");
        assert!(!path.exists());
    }

    #[test]
    fn stokes_parameters_are_layers_of_their_own() {
        let directory = tempdir().expect("a folder");
        let path = directory.path().join("stokes.exr");
        let all = axes([2, 3, 1, 2]);
        let value: Vec<f64> = (0..48).map(f64::from).collect();
        for (axes, count) in [(&all[..], 12), (&all[..2], 6)] {
            let layers = Layers {
                quantity: &Quantity::new("irradiance", Unit::Relative),
                parameters: &["I", "Q", "U", "V"],
                axes,
                value: &value[..4 * count],
                standard_error: &value[..4 * count],
            };
            layers.write(&path, &json!({})).expect("written");
            let image = read()
                .no_deep_data()
                .largest_resolution_level()
                .all_channels()
                .all_layers()
                .all_attributes()
                .from_file(&path)
                .expect("an image");
            assert_eq!(image.layer_data.len(), 4 * count / 6);
            // Directions are fewer than places: layers run over them, within each parameter.
            let third = &image.layer_data[2 * count / 6];
            let name = third.attributes.layer_name.as_ref().expect("a name").to_string();
            assert!(name.contains("_U"), "{name}");
            let channel = third.channel_data.list.iter().find(|c| c.name == *VALUE_CHANNEL);
            let samples = &channel.expect("values").sample_data;
            let first = samples.value_by_flat_index(0).to_f32();
            assert!((first - 2.0 * count as f32).abs() < 1e-6, "{first}");
        }
        let wrong = Layers {
            quantity: &Quantity::new("irradiance", Unit::Relative),
            parameters: &["I", "Q"],
            axes: &all[..2],
            value: &value[..6],
            standard_error: &value[..6],
        };
        assert!(wrong.write(&path, &json!({})).is_err());
    }
}
