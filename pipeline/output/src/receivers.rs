// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files of the receivers of `[[receivers]]`, and their entry in `results.json`.
//!
//! Every receiver writes `receivers/<name>.npy` (values, then standard errors, over its axes),
//! `.csv` (a line for each bin) and `.json` (axes, units, provenance); those over two or four axes
//! write an image `.exr` too, and rectangles a picture `.png` of their map. Luminance by angle has a table
//! and a picture over the angle to the normal. Stokes parameters are an axis before the others, and layers
//! of the image. Colours stand in the table, and as an array and a picture in [`COLOURS`].

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::{Value, json};
use tracer::Measurement;
use tracer::receiver::{Angles, DetectorRectangle, FLUX_BINS, STOKES};

use arrays::csv::{self, Column};
use arrays::exr;
use arrays::exr_layers::Layers;
use design::Design;
use design::resolved::receivers::CheckedReceiver;
use metrics::chromaticity::Tristimulus;
use metrics::hits::with_one_path;
use metrics::kinds::ReceiverKind;
use metrics::quantity::{Axis, Curve, Map, Quantity, Unit};
use metrics::{Estimate, Grouped};
use report::plots::{
    FarField, Heading, IlluminanceMap, LineColours, far_field_cartesian, illuminance_map,
    receiver_title,
};
use results::Figure;
use results::figure_entry::FigureEntry;
use results::schema::{BY_ANGLE, ReceiverEntry};
use runtime::atomic_file::{write_bytes, write_json};
use simulate::observation::by_angle::curves_by_angle;
use simulate::observation::colours::Tristimulus as Tristimuli;
use simulate::units::Units;

use super::array::Array;
use super::capitalised;
use super::colours::{self, draw_map, scaled};

/// Folder of the files, in that of the model.
pub(super) const FOLDER: &str = "receivers";
/// Folder of their colours.
pub(super) const COLOURS: &str = "colour/receivers";

/// What all receivers of a model share.
pub(super) struct Shared<'a> {
    pub units: Units,
    /// Power of one path, W.
    pub one_path: f64,
    /// Figures of all receivers.
    pub figures: &'a [Figure],
    /// Folder of the model.
    pub folder: &'a Path,
    /// Design and model, for people.
    pub subtitle: String,
    pub provenance: &'a Value,
    /// X, Y and Z of each.
    pub colours: Option<&'a [Tristimuli]>,
}

/// Writes the files of all receivers of `design`, and frees the bins of each. Returns the files,
/// relative to the folder of the model, and the entries of `results.json`.
pub(super) fn write(
    design: &Design,
    seen: Vec<Cow<'_, Grouped>>,
    shared: &Shared,
) -> Result<(Vec<PathBuf>, BTreeMap<String, ReceiverEntry>)> {
    let (mut files, mut said) = (Vec::new(), BTreeMap::new());
    for (number, (receiver, powers)) in design.receivers.iter().zip(seen).enumerate() {
        let colours = shared.colours.map(|all| &all[number]);
        let output = ReceiverOutput::new(receiver, &powers, colours, shared)?;
        let sums = output.sums(&powers, shared.units);
        let by_angle = curves_by_angle(receiver, &powers, shared.units, shared.one_path)?;
        // Files take memory too.
        drop(powers);
        let mut of_receiver = output.write(shared)?;
        if let Some(curves) = by_angle {
            of_receiver.extend(output.write_by_angle(&curves, shared)?);
        }
        said.insert(receiver.name().to_owned(), output.describe(&sums, &of_receiver, shared));
        files.extend(of_receiver);
    }
    Ok((files, said))
}

/// Keeps the arrays of all receivers of `design`, with their entries of `results.json`.
pub(super) fn keep(
    design: &Design,
    seen: Vec<Cow<'_, Grouped>>,
    shared: &Shared,
) -> Result<(Vec<Array>, BTreeMap<String, ReceiverEntry>)> {
    let (mut arrays, mut said) = (Vec::new(), BTreeMap::new());
    for (number, (receiver, powers)) in design.receivers.iter().zip(seen).enumerate() {
        let colours = shared.colours.map(|all| &all[number]);
        let output = ReceiverOutput::new(receiver, &powers, colours, shared)?;
        let sums = output.sums(&powers, shared.units);
        drop(powers);
        said.insert(receiver.name().to_owned(), output.describe(&sums, &[], shared));
        arrays.extend(output.colour_array());
        arrays.push(output.array());
    }
    Ok((arrays, said))
}

/// Quantity of the bins, and the factor to it from power over their measures.
fn scale(measurement: &Measurement, units: Units) -> (Quantity, f64) {
    match measurement {
        Measurement::Plane(_) => (units.irradiance(), units.per_irradiance()),
        Measurement::FarField(_) => (units.intensity(), units.per_intensity()),
        Measurement::Luminance(..) => (units.radiance(), units.per_radiance()),
        Measurement::Flux(_) => (units.flux(), units.per_flux()),
    }
}

/// One receiver, ready to be written.
struct ReceiverOutput<'a> {
    receiver: &'a CheckedReceiver,
    quantity: Quantity,
    axes: Vec<Axis>,
    value: Vec<f64>,
    standard_error: Vec<f64>,
    /// By place, of a rectangle: of luminance the mean over directions.
    map: Option<Map>,
    colours: Option<ReceiverColours>,
}

/// Colours of one receiver.
struct ReceiverColours {
    /// Unit of X, Y and Z.
    unit: Unit,
    bins: Vec<Tristimulus>,
    /// Sums over the bins of each place of a rectangle.
    places: Option<Tristimuli>,
}

impl<'a> ReceiverOutput<'a> {
    fn new(
        receiver: &'a CheckedReceiver,
        powers: &Grouped,
        colours: Option<&Tristimuli>,
        shared: &Shared,
    ) -> Result<Self> {
        let (detector, units) = (&receiver.detector, shared.units);
        let (quantity, factor) = scale(&detector.measurement, units);
        let measures = detector.measures();
        let (value, mut standard_error) = powers.each(|bin, power| factor * power / measures[bin]);
        // The power of a bin that no path reached is not known to be 0.
        let bins = value.iter().zip(&mut standard_error).zip(&measures);
        for ((value, error), measure) in bins.take(detector.places()) {
            let one_path = factor * shared.one_path / measure;
            *error = with_one_path(Estimate::new(*value, *error), one_path).standard_error;
        }
        let angle =
            |name: &str, edges: Vec<f64>| Axis::new(Quantity::new(name, Unit::Degree), edges);
        let c_gamma = receiver.kind() == ReceiverKind::CGamma;
        let directions = |angles: &Angles| -> Result<[Axis; 2]> {
            let names = if c_gamma { ["gamma", "c"] } else { ["theta", "phi"] };
            Ok([
                angle(names[0], angles.theta_edges_deg())?,
                angle(names[1], angles.phi_edges_deg())?,
            ])
        };
        let names = receiver.stated.kind.rectangle().unwrap_or_default().normal.axes();
        let places = |rectangle: &DetectorRectangle| -> Result<[Axis; 2]> {
            let (ends, bins) = (rectangle.ends_mm(), rectangle.bins());
            let axis = |k: usize| {
                let quantity = Quantity::new(names[k], Unit::Millimetre);
                Axis::uniform(quantity, ends[k][0], ends[k][1], bins[k])
            };
            Ok([axis(1)?, axis(0)?])
        };
        let axes = match &detector.measurement {
            Measurement::Plane(rectangle) => places(rectangle)?.to_vec(),
            Measurement::FarField(angles) => directions(angles)?.to_vec(),
            Measurement::Luminance(rectangle, angles) => {
                [places(rectangle)?, directions(angles)?].concat()
            }
            Measurement::Flux(_) => Vec::new(),
        };
        let mut map = None;
        if let Measurement::Plane(_) | Measurement::Luminance(..) = &detector.measurement {
            let places = axes[0].bins() * axes[1].bins();
            let directions = detector.places() / places;
            let mean = |place: usize| {
                let bins = place * directions..(place + 1) * directions;
                let power: f64 = powers.total()[bins.clone()].iter().sum();
                factor * power / measures[bins].iter().sum::<f64>()
            };
            let means: Vec<f64> = (0..places).map(mean).collect();
            // A dark picture, or one of a single bin, shows nothing.
            if places > 1 && means.iter().any(|mean| *mean > 0.0) {
                let [rows, columns] = [0, 1].map(|k| axes[k].clone());
                let errors = vec![0.0; places];
                map = Some(Map::new(quantity.clone(), rows, columns, means, errors)?);
            }
        }
        let colours = colours.map(|colours| {
            let (quantity, factor) = scale(&detector.measurement, units.of_colours());
            let places = map.as_ref().map(|map| {
                let directions = detector.places() / map.value().len();
                let sums = |bins: &[f64]| -> Vec<f64> {
                    bins.chunks(directions).map(|bins| bins.iter().sum()).collect()
                };
                [0, 1, 2].map(|k| colours[k].map(sums))
            });
            let bins = scaled(colours, |bin| factor / measures[bin]);
            ReceiverColours { unit: quantity.unit(), bins, places }
        });
        Ok(Self { receiver, quantity, axes, value, standard_error, map, colours })
    }

    fn write(&self, shared: &Shared) -> Result<Vec<PathBuf>> {
        let Shared { folder, provenance, .. } = *shared;
        let name = self.receiver.name();
        let file = |ending: &str| Path::new(FOLDER).join(format!("{name}.{ending}"));
        let mut files = vec![file("npy"), file("csv"), file("json")];
        let parameters = self.parameters();
        let shape = self.shape();
        let both = [&self.value[..], &self.standard_error].concat();
        csv::write_npy(&folder.join(&files[0]), &shape, &both)?;
        self.write_csv(&folder.join(&files[1]))?;
        let axes = self.axes.iter().map(|axis| {
            json!({"quantity": axis.quantity().name(), "unit": axis.quantity().unit().suffix(), "edges": axis.edges()})
        });
        let mut described = json!({
            "receiver": self.receiver.stated,
            "quantity": self.quantity.name(),
            "unit": self.quantity.unit().symbol(),
            "shape": shape,
            "axes": axes.collect::<Vec<_>>(),
            "provenance": provenance,
        });
        if self.axes.is_empty() {
            described["bins"] = json!(FLUX_BINS);
        }
        if !parameters.is_empty() {
            described["stokes"] = json!(parameters);
            described["s"] = match self.receiver.detector.measurement {
                Measurement::Plane(_) => "v x k",
                Measurement::Luminance(..) => "normal x k",
                Measurement::FarField(_) | Measurement::Flux(_) => "z x k",
            }
            .into();
            described["p"] = "s x k".into();
        }
        write_json(&folder.join(&files[2]), &described)?;
        if self.axes.len() == 4 || !parameters.is_empty() {
            files.push(file("exr"));
            let layers = Layers {
                quantity: &self.quantity,
                parameters,
                axes: &self.axes,
                value: &self.value,
                standard_error: &self.standard_error,
            };
            layers.write(&folder.join(&files[3]), provenance)?;
        } else if let [rows, columns] = &self.axes[..] {
            files.push(file("exr"));
            let map = Map::new(
                self.quantity.clone(),
                rows.clone(),
                columns.clone(),
                self.value.clone(),
                self.standard_error.clone(),
            )?;
            exr::write_map(&folder.join(&files[3]), &map, provenance)?;
        }
        if let Some(map) = &self.map {
            let title = capitalised(&receiver_title(self.quantity.name(), name));
            let heading = Heading::new(title, &shared.subtitle);
            let picture = illuminance_map(&IlluminanceMap::plain(&heading, map))?;
            files.push(file("png"));
            write_bytes(&folder.join(&files[files.len() - 1]), &picture.png()?)?;
        }
        files.extend(self.write_colours(shared)?);
        Ok(files)
    }

    /// Writes luminance over the angle to the normal, as a table and as a picture.
    fn write_by_angle(&self, curves: &[Curve], shared: &Shared) -> Result<[PathBuf; 2]> {
        let name = self.receiver.name();
        let files =
            ["csv", "png"].map(|ending| Path::new(BY_ANGLE).join(format!("{name}.{ending}")));
        let position = Quantity::new("theta", Unit::Degree);
        csv::write_curves_csv(&shared.folder.join(&files[0]), &position, &self.quantity, curves)?;
        let title = receiver_title(self.quantity.name(), name);
        let picture = far_field_cartesian(&FarField {
            heading: &Heading::new(
                format!("{} by the angle to the normal", capitalised(&title)),
                &shared.subtitle,
            ),
            quantity: &self.quantity,
            curves,
            colours: LineColours::Ordered,
            numbers: &[],
            peaks: &[],
        })?;
        write_bytes(&shared.folder.join(&files[1]), &picture.png()?)?;
        Ok(files)
    }

    /// Writes the array of colours and their picture.
    fn write_colours(&self, shared: &Shared) -> Result<Vec<PathBuf>> {
        let (Some(array), Some(colours)) = (self.colour_array(), &self.colours) else {
            return Ok(Vec::new());
        };
        let mut files = vec![PathBuf::from(format!("{}.npy", array.name))];
        csv::write_npy(&shared.folder.join(&files[0]), &array.shape, &array.values)?;
        if let (Some(places), Some(map)) = (&colours.places, &self.map) {
            let file = PathBuf::from(format!("{}.png", array.name));
            let title = format!("Colours of {}", self.receiver.name());
            let heading = Heading::new(title, &shared.subtitle);
            let path = shared.folder.join(&file);
            let axes = [map.columns(), map.rows()];
            files.extend(draw_map(&path, &heading, axes, places, &[])?.map(|()| file));
        }
        Ok(files)
    }

    /// X, Y and Z of its bins with their covariances.
    fn colour_array(&self) -> Option<Array> {
        let name = format!("{COLOURS}/{}", self.receiver.name());
        let bins: Vec<usize> = match &self.axes[..] {
            [] => vec![FLUX_BINS.len()],
            axes => axes.iter().map(Axis::bins).collect(),
        };
        Some(colours::array(&name, &bins, &self.colours.as_ref()?.bins, self.axes.clone()))
    }

    /// Shape of its array: values and standard errors, Stokes parameters, bins along the axes.
    fn shape(&self) -> Vec<usize> {
        if self.axes.is_empty() {
            return vec![2, self.value.len()];
        }
        let parameters = self.parameters();
        let of_stokes = (!parameters.is_empty()).then_some(parameters.len());
        [2].into_iter().chain(of_stokes).chain(self.axes.iter().map(Axis::bins)).collect()
    }

    fn array(self) -> Array {
        Array {
            name: format!("{FOLDER}/{}", self.receiver.name()),
            shape: self.shape(),
            values: [&self.value[..], &self.standard_error].concat(),
            axes: self.axes,
            quantity: Some(self.quantity),
        }
    }

    /// Names of the Stokes parameters; none where the power alone is read.
    fn parameters(&self) -> &'static [&'static str] {
        if self.receiver.detector.stokes { &STOKES } else { &[] }
    }

    /// Writes a line for each bin: the middle of the bin along every axis, value, standard error.
    /// Flux has one line of all its bins.
    fn write_csv(&self, path: &Path) -> Result<()> {
        let mut columns = Vec::new();
        if self.axes.is_empty() {
            for (k, name) in FLUX_BINS.iter().enumerate() {
                let quantity =
                    Quantity::new(format!("{name} {}", self.quantity.name()), self.quantity.unit());
                columns.push(Column::new(&quantity, [self.value[k]]));
                columns.push(Column::standard_error(&quantity, [self.standard_error[k]]));
            }
            return csv::write_csv(path, &columns);
        }
        // The last axis runs fastest.
        let bins = self.receiver.detector.places();
        let mut repeated = bins;
        for axis in &self.axes {
            let (centres, count) = (axis.centres(), axis.bins());
            repeated /= count;
            let middle = |k: usize| centres[k / repeated % count];
            let values: Vec<f64> = (0..bins).map(middle).collect();
            columns.push(Column::new(axis.quantity(), values));
        }
        let values = self.value.chunks(bins).zip(self.standard_error.chunks(bins));
        for (number, (value, error)) in values.enumerate() {
            let name = match (number, self.parameters().get(number)) {
                (1.., Some(parameter)) => format!("{} {parameter}", self.quantity.name()),
                _ => self.quantity.name().to_owned(),
            };
            let quantity = Quantity::new(name, self.quantity.unit());
            columns.push(Column::new(&quantity, value));
            columns.push(Column::standard_error(&quantity, error));
        }
        if let Some(colours) = &self.colours {
            columns.extend(colours::columns(colours.unit, &colours.bins));
        }
        csv::write_csv(path, &columns)
    }

    /// Flux over all bins, for every Stokes parameter.
    fn sums(&self, powers: &Grouped, units: Units) -> Grouped {
        let (places, per_flux) = (self.receiver.detector.places(), units.per_flux());
        powers.map(|bins| {
            let sums = bins.chunks(places).map(|bins| bins.iter().sum::<f64>());
            sums.map(|sum| sum * per_flux).collect()
        })
    }

    fn describe(&self, sum: &Grouped, files: &[PathBuf], shared: &Shared) -> ReceiverEntry {
        let of_bins = self.axes.is_empty();
        let mut figures: BTreeMap<String, FigureEntry> = if of_bins {
            let pairs = self.value.iter().zip(&self.standard_error);
            let entries = pairs.map(|(v, e)| FigureEntry::new(Estimate::new(*v, *e)));
            FLUX_BINS.iter().map(|name| (*name).to_owned()).zip(entries).collect()
        } else {
            let errors = sum.standard_errors();
            let estimates = sum.total().iter().zip(errors).map(|(s, e)| Estimate::new(*s, e));
            // Flux alone is no less than 0.
            let one_path = [shared.units.per_flux() * shared.one_path].into_iter();
            let estimates = estimates.zip(one_path.chain(std::iter::repeat(0.0)));
            let entries = estimates.map(|(e, one)| FigureEntry::new(with_one_path(e, one)));
            let others = self.parameters().iter().skip(1);
            let others = others.map(|parameter| format!("flux_{}", parameter.to_lowercase()));
            std::iter::once("flux".to_owned()).chain(others).zip(entries).collect()
        };
        for figure in shared.figures {
            if let Some((key, name)) = figure.key.split_once('.')
                && name == self.receiver.name()
            {
                figures.entry(key.to_owned()).or_insert(figure.entry);
            }
        }
        ReceiverEntry {
            kind: self.receiver.kind(),
            quantity: self.quantity.name().to_owned(),
            unit: self.quantity.unit().symbol().to_owned(),
            files: files.to_vec(),
            flux_unit: Some(shared.units.flux().unit().symbol().to_owned()),
            figures,
        }
    }
}
