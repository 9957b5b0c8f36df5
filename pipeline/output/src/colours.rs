// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files of colours, in the folder [`FOLDER`] of a model that has them: X, Y and Z of every bin with
//! their covariances, colours over the polar angle, and pictures of both.

use std::path::{Path, PathBuf};

use anyhow::Result;

use arrays::csv::{self, Column};
use metrics::Grouped;
use metrics::chromaticity::Tristimulus;
use metrics::colour_map::ColourMap;
use metrics::quantity::{Axis, Map, Quantity, Unit};
use report::plots::{Heading, LedOutline, Picture, colour_map, colour_over_angle};
use runtime::atomic_file::write_bytes;
use simulate::observation::colours::ColourArrays;

use super::ModelFiles;
use super::array::Array;

/// Folder of the files, in that of the model.
pub(super) const FOLDER: &str = "colour";
/// Arrays there.
const ILLUMINANCE: &str = "colour/illuminance";
const FAR_FIELD: &str = "colour/far_field";

/// X, Y and Z with covariances, an array over these bins.
pub(super) fn array(name: &str, bins: &[usize], all: &[Tristimulus], axes: Vec<Axis>) -> Array {
    let rows: Vec<[f64; 9]> = all.iter().map(Tristimulus::numbers).collect();
    Array {
        name: name.to_owned(),
        shape: [9].into_iter().chain(bins.iter().copied()).collect(),
        values: (0..9).flat_map(|k| rows.iter().map(move |row| row[k])).collect(),
        axes,
        quantity: None,
    }
}

/// Columns of X, Y and Z in `unit`, u', v', colour temperature and Duv, each with its standard error.
/// What is not stated is empty.
pub(super) fn columns(unit: Unit, all: &[Tristimulus]) -> Vec<Column> {
    let mut columns = Vec::new();
    let mut add = |quantity: &Quantity, pairs: Vec<[f64; 2]>| {
        let values: Vec<f64> = pairs.iter().map(|pair| pair[0]).collect();
        let errors: Vec<f64> = pairs.iter().map(|pair| pair[1]).collect();
        columns.push(Column::new(quantity, values));
        columns.push(Column::standard_error(quantity, errors));
    };
    for (k, name) in ["X", "Y", "Z"].into_iter().enumerate() {
        // XX, YY and ZZ.
        let pair = |t: &Tristimulus| [t.xyz[k], t.covariance[[0, 3, 5][k]].max(0.0).sqrt()];
        let quantity = Quantity::new(format!("tristimulus {name}"), unit);
        add(&quantity, all.iter().map(pair).collect());
    }
    let names = [
        ("u prime", Unit::Relative),
        ("v prime", Unit::Relative),
        ("cct", Unit::Kelvin),
        ("duv", Unit::Relative),
    ];
    let rows: Vec<[[f64; 2]; 4]> = all.iter().map(figures).collect();
    for (k, (name, unit)) in names.into_iter().enumerate() {
        add(&Quantity::new(name, unit), rows.iter().map(|row| row[k]).collect());
    }
    columns
}

/// u', v', colour temperature and Duv, each with its standard error; NaN of what is not stated.
fn figures(all: &Tristimulus) -> [[f64; 2]; 4] {
    let mut figures = [[f64::NAN; 2]; 4];
    let colour = all.chromaticity();
    let correlated = colour.and_then(|colour| colour.correlated());
    let estimates = colour.map(|colour| colour.estimates()).into_iter().flatten();
    for (k, estimate) in estimates.chain(correlated.into_iter().flatten()).enumerate() {
        figures[k] = [estimate.value, estimate.standard_error];
    }
    figures
}

/// The picture of a map, whose axes are columns and rows; `None` where its light is too faint.
fn picture_of_map(
    heading: &Heading,
    axes: [&Axis; 2],
    colours: &[Grouped; 3],
    leds: &[LedOutline],
) -> Option<Picture> {
    let bins = axes.map(Axis::bins);
    let map = ColourMap::new(colours, bins, &vec![1.0; bins[0] * bins[1]]);
    map.map(|map| colour_map(heading, axes, &map, leds))
}

/// Writes that picture.
pub(super) fn draw_map(
    path: &Path,
    heading: &Heading,
    axes: [&Axis; 2],
    colours: &[Grouped; 3],
    leds: &[LedOutline],
) -> Result<Option<()>> {
    let picture = picture_of_map(heading, axes, colours, leds);
    picture.map(|picture| write_bytes(path, &picture.png()?)).transpose()
}

impl ModelFiles<'_> {
    /// Arrays of map and far field.
    pub(super) fn colour_arrays(&self, colours: &ColourArrays) -> Result<[Array; 2]> {
        let units = self.units.of_colours();
        let per_map = units.per_irradiance();
        let map: Vec<_> = scaled(&colours.illuminance, |_| per_map);
        let sphere = self.observation.sphere;
        let per_sr = |bin: usize| {
            let sr = sphere.ring_sr(bin / sphere.azimuths) / sphere.azimuths as f64;
            units.per_intensity() / sr
        };
        let far = scaled(&colours.far_field, per_sr);
        let of = |name, all: &[Tristimulus], like: &Map| {
            let axes = [like.rows(), like.columns()];
            array(name, &axes.map(Axis::bins), all, axes.map(Axis::clone).into())
        };
        Ok([of(ILLUMINANCE, &map, &self.map()?), of(FAR_FIELD, &far, &self.far_field_map()?)])
    }

    /// Writes the files of map and far field, and lists them relative to the folder of the model.
    pub(super) fn colour_files(&self, colours: &ColourArrays) -> Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        let mut file = |name: &str, ending: &str| {
            let file = PathBuf::from(format!("{name}.{ending}"));
            let path = self.folder.join(&file);
            files.push(file);
            path
        };
        for array in self.colour_arrays(colours)? {
            csv::write_npy(&file(&array.name, "npy"), &array.shape, &array.values)?;
        }
        let units = self.units.of_colours();
        let sphere = self.observation.sphere;
        let profiles = [0, 1, 2].map(|k| colours.far_field[k].map(|p| sphere.profile(p)));
        let theta = Quantity::new("theta", Unit::Degree);
        let rings = scaled(&profiles, |_| units.per_intensity());
        let mut table = vec![Column::new(&theta, sphere.centres_deg())];
        table.extend(columns(units.intensity().unit(), &rings));
        csv::write_csv(&file(FAR_FIELD, "csv"), &table)?;

        let heading = self.heading("Colour over angle");
        let whole = self.far_field_map()?;
        let edges = whole.rows().edges();
        let upper: Vec<f64> =
            edges.iter().copied().take_while(|edge| *edge <= 90.0 + 1e-9).collect();
        let count = upper.len().saturating_sub(1);
        let upwards = profiles.map(|profile| profile.map(|rings| rings[..count].to_vec()));
        let weights: Vec<f64> = (0..count).map(|ring| sphere.ring_sr(ring)).collect();
        let map = (count > 0).then(|| ColourMap::new(&upwards, [1, count], &weights)).flatten();
        if let Some(map) = map {
            let axis = Axis::new(theta, upper)?;
            let picture = colour_over_angle(&heading, &axis, &map)?;
            write_bytes(&file(FAR_FIELD, "png"), &picture.png()?)?;
        }
        if let Some(picture) = self.map_of_colours(colours)? {
            write_bytes(&file(ILLUMINANCE, "png"), &picture.png()?)?;
        }
        Ok(files)
    }

    /// Colours of the map; `None` where its light is too faint.
    pub(super) fn map_of_colours(&self, colours: &ColourArrays) -> Result<Option<Picture>> {
        let title = format!("Colours at z = {} mm", self.design.receiver.plane_height_mm);
        let (heading, map) = (self.heading(&title), self.map()?);
        let axes = [map.columns(), map.rows()];
        Ok(picture_of_map(&heading, axes, &colours.illuminance, &self.led_outlines()))
    }
}

/// Every bin times a factor of its own.
pub(super) fn scaled(colours: &[Grouped; 3], factor: impl Fn(usize) -> f64) -> Vec<Tristimulus> {
    let all = Tristimulus::of_bins(colours).into_iter().enumerate();
    all.map(|(bin, tristimulus)| tristimulus.times(factor(bin))).collect()
}
