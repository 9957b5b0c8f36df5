// SPDX-License-Identifier: MIT OR Apache-2.0
//! Luminance over the angle to the normal of a receiver, over its whole rectangle: curves in the planes
//! of u and v, and the figures read from them.

use std::borrow::Cow;

use anyhow::Result;
use design::resolved::receivers::CheckedReceiver;
use metrics::far_field::{
    AngularBins, BinPlacement, FarFieldFigures, FarFieldReading, PeakMethod, PlainFarField,
};
use metrics::figures::Definition;
use metrics::figures::receiver::{AXIAL, WIDTH_U, WIDTH_V};
use metrics::hits::with_one_path;
use metrics::illuminance::Symmetry;
use metrics::kinds::ReceiverKind;
use metrics::quantity::Curve;
use metrics::{Estimate, Grouped};
use results::figure_entry::FigureEntry;
use tracer::Measurement;
use tracer::receiver::Angles;

use super::Observation;
use super::reader::{Column, Reader, of_width, unit_of_receiver};
use crate::units::Units;

/// Azimuths of which a plane takes half at most, so that it is not the mean of all.
const MIN_AZIMUTHS: usize = 8;
/// Planes in which luminance is read, with the azimuths of their halves, degrees.
const PLANES: [(&str, [f64; 2]); 2] = [("plane of u", [0.0, 180.0]), ("plane of v", [90.0, 270.0])];

/// Curves of luminance over the angle to the normal, W/(m² sr) or cd/m²: the mean over azimuth and, of
/// eight azimuths or more, means of both halves of the planes of u and v. The power of one path is
/// `one_path`, W. `None` of a receiver without fine bins of angle about its normal, or in the dark.
///
/// # Errors
/// Light that is not finite.
pub fn curves_by_angle(
    receiver: &CheckedReceiver,
    powers: &Grouped,
    units: Units,
    one_path: f64,
) -> Result<Option<Vec<Curve>>> {
    let Some(profile) = AngleProfile::new(receiver) else { return Ok(None) };
    let of_directions = profile.by_direction(powers);
    if of_directions.total().iter().sum::<f64>() <= 0.0 {
        return Ok(None);
    }
    let rings = profile.readings[0].recorded;
    // The least part of a ring that a curve is read from is two bins.
    let curve = |name: &str, share: f64, read: &(dyn Fn(&[f64]) -> Vec<f64> + Sync)| {
        let seen = of_directions.map(read);
        let errors = seen.standard_errors();
        let of_ring = |k: usize| {
            let value = Estimate::new(seen.total()[k], errors[k]);
            let bin = k * rings.azimuths;
            let one_path = one_path * profile.per_intensity[bin] / (share * rings.ring_sr(k));
            with_one_path(value, one_path).times(units.per_radiance())
        };
        let all: Vec<Estimate> = (0..rings.polar).map(of_ring).collect();
        let values: Vec<f64> = all.iter().map(|e| e.value).collect();
        let errors: Vec<f64> = all.iter().map(|e| e.standard_error).collect();
        Curve::new(name, rings.centres_deg(), values, errors)
    };
    let planes = PLANES.iter().filter(|_| rings.azimuths >= MIN_AZIMUTHS);
    let planes = planes.map(|(name, azimuths_deg)| {
        let share = 2.0 / rings.azimuths as f64;
        curve(name, share, &|powers: &[f64]| rings.half_planes(powers, azimuths_deg))
    });
    let mean = curve("mean over azimuth", 1.0, &|powers: &[f64]| rings.profile(powers));
    std::iter::once(mean).chain(planes).collect::<Result<_>>().map(Some)
}

/// Bins of the polar angle for figures by angle: their least number, and their largest width in
/// degrees, within which there is still the axis.
const MIN_BINS_OF_ANGLE: usize = 3;
const MAX_BIN_OF_ANGLE_DEG: f64 = 10.0;

/// Rectangle and directions of a receiver that has figures by angle.
fn angles_of_profile(receiver: &CheckedReceiver) -> Option<Angles> {
    let Measurement::Luminance(_, angles) = &receiver.detector.measurement else {
        return None;
    };
    let is_fine = angles.thetas() >= MIN_BINS_OF_ANGLE
        && angles.theta_edges_deg()[1] <= MAX_BIN_OF_ANGLE_DEG * (1.0 + 1e-9);
    (is_fine && receiver.stated.kind.is_by_angle()).then_some(*angles)
}

/// A figure with its value and its entry in the far fields of the planes of u and v.
type Read = (Definition, fn([PlainFarField; 2]) -> f64, fn([FarFieldFigures; 2]) -> FigureEntry);
const FIGURES: [Read; 3] = [
    (AXIAL, |[u, _]| u.centre_w_per_sr, |[u, _]| FigureEntry::new(u.centre_w_per_sr)),
    (WIDTH_U, |[u, _]| u.widths_deg[0], |[u, _]| of_width(u.widths_deg[0])),
    (WIDTH_V, |[_, v]| v.widths_deg[0], |[_, v]| of_width(v.widths_deg[0])),
];

/// Figures by angle of a receiver: none of planes where its azimuths have none.
pub(super) fn figures_by_angle(receiver: &CheckedReceiver) -> impl Iterator<Item = Definition> {
    let angles = angles_of_profile(receiver);
    let has_planes = angles.is_some_and(|angles| angles.phis() >= MIN_AZIMUTHS);
    let of_planes = has_planes.then_some([WIDTH_U, WIDTH_V]).into_iter().flatten();
    angles.map(|_| AXIAL).into_iter().chain(of_planes)
}

/// Luminance by the angle to the normal, over the whole rectangle.
struct AngleProfile<'a> {
    receiver: &'a CheckedReceiver,
    /// In the planes of u and v. What it takes for intensity is luminance.
    readings: [FarFieldReading; 2],
    /// Factor on the power in each direction that makes its intensity luminance.
    per_intensity: Vec<f64>,
}

impl<'a> AngleProfile<'a> {
    fn new(receiver: &'a CheckedReceiver) -> Option<Self> {
        let angles = angles_of_profile(receiver)?;
        let (directions, edges) = (angles.bins(), angles.theta_edges_deg());
        let measures = receiver.detector.measures();
        let places = (receiver.detector.places() / directions) as f64;
        let solid = angles.solid_angles();
        let per_intensity = measures[..directions].iter().enumerate();
        let per_intensity =
            per_intensity.map(|(k, measure)| solid[k / angles.phis()] / (measure * places));
        let reading = |azimuth_deg: f64| FarFieldReading {
            recorded: AngularBins {
                bin_deg: edges[1],
                polar: angles.thetas(),
                azimuths: angles.phis(),
                bins: BinPlacement::Between,
            },
            read_bin_deg: edges[1],
            read_bins: BinPlacement::Between,
            centre_deg: edges[1],
            peak: PeakMethod::Bin,
            peak_fit_deg: 0.0,
            cut_deg: Some(azimuth_deg),
            symmetry: Symmetry::Rectangle,
        };
        Some(Self {
            receiver,
            readings: [0.0, 90.0].map(reading),
            per_intensity: per_intensity.collect(),
        })
    }

    /// Sums over all places of the power in each direction, so that its intensity is luminance.
    fn by_direction(&self, powers: &Grouped) -> Grouped {
        let (per_intensity, places) = (&self.per_intensity, self.receiver.detector.places());
        let directions = per_intensity.len();
        powers.map(|bins| {
            let of = |k: usize| bins[..places].iter().skip(k).step_by(directions).sum::<f64>();
            (0..directions).map(|k| per_intensity[k] * of(k)).collect()
        })
    }
}

/// Figures of such a profile.
pub(super) struct AngleReader<'a> {
    number: usize,
    units: Units,
    profile: AngleProfile<'a>,
    read: Vec<Read>,
}

impl<'a> AngleReader<'a> {
    pub fn new(number: usize, receiver: &'a CheckedReceiver, units: Units) -> Option<Self> {
        let profile = AngleProfile::new(receiver)?;
        let has = |read: &Read| figures_by_angle(receiver).any(|figure| figure.key == read.0.key);
        let read = FIGURES.into_iter().filter(has).collect();
        Some(Self { number, units, profile, read })
    }
}

impl Reader for AngleReader<'_> {
    fn columns(&self) -> Vec<Column> {
        let receiver = self.profile.receiver;
        let of = |(figure, ..): &Read| {
            let unit = unit_of_receiver(*figure, ReceiverKind::Luminance);
            Column::new(figure.of_receiver(receiver.name()), unit, &self.units)
        };
        self.read.iter().map(of).collect()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        Some(Cow::Owned(self.profile.by_direction(seen.receivers.get(self.number)?)))
    }

    fn values(&self, powers: &[f64]) -> Vec<f64> {
        let planes = self.profile.readings.map(|reading| reading.plain(powers));
        self.read.iter().map(|(_, value, _)| value(planes)).collect()
    }

    fn entries(&self, powers: &Grouped) -> Vec<FigureEntry> {
        let planes = self.profile.readings.map(|reading| reading.figures(powers));
        // Nothing is read without light.
        if planes[0].peak_w_per_sr.value <= 0.0 {
            return Vec::new();
        }
        self.read.iter().map(|(.., entry)| entry(planes)).collect()
    }

    fn one_path(&self, power: f64) -> Vec<f64> {
        let rings = self.profile.readings[0].recorded;
        vec![power * self.profile.per_intensity[0] / rings.ring_sr(0)]
    }
}
