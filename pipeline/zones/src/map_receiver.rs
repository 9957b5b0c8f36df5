// SPDX-License-Identifier: MIT OR Apache-2.0
//! The receiver whose map is added up: the plane of the design, or a level rectangle of
//! `[[receivers]]`.

use std::ops::Range;

use anyhow::{Result, ensure};
use serde_json::{Value, json};
use tracer::Measurement;

use design::Design;
use design::resolved::receivers::CheckedReceiver;
use design::schema::receivers::Normal;
use metrics::Grouped;
use metrics::illuminance::Symmetry;
use metrics::quantity::Quantity;

use super::places::Places;
use simulate::observation::{Observation, plane_grid};
use simulate::symmetry::symmetry;
use simulate::units::Units;

/// Bins of a level rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Bins along x and y.
    pub bins: [usize; 2],
    /// Lengths of a bin, mm.
    pub bin_mm: [f64; 2],
    /// Lower end along x and y, mm.
    pub low_mm: [f64; 2],
}

impl Frame {
    /// Number of bins.
    pub fn count(&self) -> usize {
        self.bins[0] * self.bins[1]
    }

    /// Coordinate of the middle of bin `k` along an axis, mm.
    pub fn middle_mm(&self, axis: usize, k: usize) -> f64 {
        self.at_mm(axis, k as isize)
    }

    /// The same of a bin that may lie beyond its ends.
    pub fn at_mm(&self, axis: usize, k: isize) -> f64 {
        self.low_mm[axis] + (k as f64 + 0.5) * self.bin_mm[axis]
    }

    /// Bins whose middles lie within a lower end and a length along an axis, mm.
    pub fn middles_within(&self, axis: usize, [low, length]: [f64; 2]) -> Range<usize> {
        let is_on = |bin: &usize| (low..low + length).contains(&self.middle_mm(axis, *bin));
        let on: Vec<usize> = (0..self.bins[axis]).filter(is_on).collect();
        on.first().map_or(0..0, |first| *first..on[on.len() - 1] + 1)
    }
}

/// The receiver of responses and patterns.
pub struct MapReceiver<'a> {
    receiver: Option<(usize, &'a CheckedReceiver)>,
    /// Bins in the array of the design.
    pub frame: Frame,
    /// Quantity of its map.
    pub quantity: Quantity,
    /// Factor from W/mm² or W/(mm² sr) of 1 W from all traced packages.
    factor: f64,
    /// Divisor of the power of all directions in a bin: mm² or mm² sr; 1 of the plane of the
    /// design, which is read in W/mm².
    measure: f64,
}

impl<'a> MapReceiver<'a> {
    /// The receiver of `design` of this name, or its plane, in units of X, Y and Z where it
    /// `has_colours`. Where the design does not state what its packages emit, all of `places`
    /// together emit 1 W.
    ///
    /// # Errors
    /// A receiver that `design` does not have, that is no level rectangle, or that reads some
    /// packages or sources alone.
    pub fn new(
        design: &'a Design,
        name: Option<&str>,
        places: &Places,
        has_colours: bool,
    ) -> Result<Self> {
        let units = Units::from_design(design, design.all_lights().as_deref());
        let units = if has_colours { units.of_colours() } else { units };
        let per_watt = if design.emitted.is_some() {
            1.0
        } else {
            design.array.count() as f64 / places.count() as f64
        };
        let Some(name) = name else {
            let grid = plane_grid(design);
            let bins = [grid.columns, grid.rows];
            return Ok(Self {
                receiver: None,
                frame: Frame {
                    bins,
                    bin_mm: [grid.bin_mm; 2],
                    low_mm: bins.map(|count| -0.5 * count as f64 * grid.bin_mm),
                },
                quantity: units.irradiance(),
                factor: per_watt * units.per_irradiance(),
                measure: 1.0,
            });
        };
        let is_level = |receiver: &CheckedReceiver| {
            let rectangle = receiver.stated.kind.rectangle();
            rectangle.is_some_and(|rectangle| rectangle.normal == Normal::Up)
        };
        let level: Vec<&str> =
            design.receivers.iter().filter(|r| is_level(r)).map(CheckedReceiver::name).collect();
        let found = design.receivers.iter().enumerate().find(|(_, r)| r.name() == name);
        let Some((number, receiver)) = found.filter(|(_, receiver)| is_level(receiver)) else {
            anyhow::bail!(
                "--receiver: expected a plane or luminance receiver that faces up ({}), got {name:?}",
                if level.is_empty() { "the design has none".to_owned() } else { level.join(", ") }
            );
        };
        ensure!(
            receiver.detector.filter.sources.is_none(),
            "--receiver: expected one that reads all packages and sources, got {name:?} with `only`"
        );
        let measures = receiver.detector.measures();
        let (rectangle, quantity, factor, directions) = match &receiver.detector.measurement {
            Measurement::Luminance(rectangle, angles) => {
                (rectangle, units.radiance(), units.per_radiance(), angles.bins())
            }
            Measurement::Plane(rectangle) => {
                (rectangle, units.irradiance(), units.per_irradiance(), 1)
            }
            _ => anyhow::bail!("--receiver: expected a rectangle, got {name:?}"),
        };
        let (bins, ends) = (rectangle.bins(), rectangle.ends_mm());
        Ok(Self {
            receiver: Some((number, receiver)),
            frame: Frame {
                bins,
                bin_mm: [0, 1].map(|k| (ends[k][1] - ends[k][0]) / bins[k] as f64),
                low_mm: ends.map(|[low, _]| low),
            },
            quantity,
            factor: per_watt * factor,
            measure: measures[..directions].iter().sum(),
        })
    }

    /// True of a luminance receiver.
    pub fn is_luminance(&self) -> bool {
        let of = self.receiver.map(|(_, receiver)| &receiver.detector.measurement);
        of.is_some_and(|of| matches!(of, Measurement::Luminance(..)))
    }

    /// Name for people.
    pub fn name(&self) -> &str {
        self.receiver.map_or("plane", |(_, receiver)| receiver.name())
    }

    /// Names of all that the map of a trace depends on beside the trace.
    pub(super) fn key_fields(&self) -> Value {
        json!({"receiver": self.name(), "number": self.receiver.map(|(number, _)| number)})
    }

    /// Factor from the numbers of the map to the quantity.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// The map of `seen`, W/mm² or W/(mm² sr) by groups, a mean over directions.
    pub(super) fn map(&self, seen: &Observation) -> Grouped {
        let Some((number, receiver)) = self.receiver else {
            return seen.illuminance.clone();
        };
        let count = self.frame.count();
        let directions = receiver.detector.places() / count;
        let place = |bins: &[f64]| bins.iter().sum::<f64>() / self.measure;
        seen.receivers[number]
            .map(|bins| bins[..count * directions].chunks(directions).map(place).collect())
    }

    /// What one path of this power adds to a bin of the map.
    pub(super) fn one_path(&self, power: f64) -> f64 {
        match self.receiver {
            Some(_) => power / self.measure,
            None => power / (self.frame.bin_mm[0] * self.frame.bin_mm[1]),
        }
    }

    /// Symmetries that responses of `design` have, by which one place stands for others.
    pub(super) fn symmetry(&self, design: &Design, places: &Places) -> Symmetry {
        let Frame { bins, bin_mm, low_mm } = self.frame;
        let centred =
            (0..2).all(|k| (2.0 * low_mm[k] + bins[k] as f64 * bin_mm[k]).abs() < 1e-9 * bin_mm[k]);
        let square = bins[0] == bins[1]
            && (bin_mm[0] - bin_mm[1]).abs() < 1e-12 * bin_mm[0]
            && places.traced[0] == places.traced[1];
        // Seen from the side, an image of light is other light.
        let is_level =
            self.receiver.is_none_or(|(_, receiver)| match &receiver.detector.measurement {
                Measurement::Luminance(_, angles) => !angles.has_view(),
                _ => true,
            });
        let of_frame = match (centred && is_level && places.is_lattice(), square) {
            (true, true) => Symmetry::Square,
            (true, false) => Symmetry::Rectangle,
            (false, _) => Symmetry::None,
        };
        symmetry(design).min(of_frame)
    }

    /// Bins from a package to the next along each axis, and the bins over the whole array.
    ///
    /// # Errors
    /// Bins that do not divide the pitch, where the traced array stands for a larger one.
    pub fn over(&self, places: &Places) -> Result<([usize; 2], Frame)> {
        let mut steps = [0; 2];
        let mut whole = self.frame;
        for (k, step) in steps.iter_mut().enumerate() {
            if !places.is_extended(k) {
                continue;
            }
            let (pitch, bin) = (places.pitch_mm[k], self.frame.bin_mm[k]);
            *step = (pitch / bin).round() as usize;
            ensure!(
                *step > 0 && (*step as f64 * bin - pitch).abs() < 1e-6 * bin,
                "{}: expected bins that divide the pitch of {pitch} mm, got {bin} mm; then {} x {} packages stand for --packages {}x{}",
                match self.receiver {
                    Some((_, receiver)) => format!("receivers: {:?}: bins", receiver.name()),
                    None => "receiver.bin_mm".to_owned(),
                },
                places.stated[0],
                places.stated[1],
                places.whole[0],
                places.whole[1]
            );
            let more = places.whole[k] - places.traced[k];
            whole.bins[k] += more * *step;
            whole.low_mm[k] -= 0.5 * more as f64 * pitch;
        }
        Ok((steps, whole))
    }
}
