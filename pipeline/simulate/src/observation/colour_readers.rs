// SPDX-License-Identifier: MIT OR Apache-2.0
//! Readers of colours, of an observation that has them.

use std::borrow::Cow;

use design::resolved::receivers::CheckedReceiver;
use metrics::chromaticity::{self, MAX_RELATIVE_ERROR};
use metrics::colour_regions::Directions;
use metrics::figures::{COLOURS, COLOURS_OF_RECEIVER};
use metrics::{Grouped, JackknifedFigure, colour_difference, jackknife};
use results::figure_entry::FigureEntry;
use tracer::Measurement;

use super::Observation;
use super::colours::{Regions, region, slice};
use super::reader::{Column, Reader};

/// Differences over cell and angle, and the colours of map and far field.
pub(super) struct ColourReader {
    regions: Regions,
    /// Directions whose colours are compared.
    bright: Vec<bool>,
    /// True of the regions with light enough to state their colours.
    known: [bool; 2],
}

/// Differences before the other figures.
const DIFFERENCES: usize = 3;

impl ColourReader {
    /// `None` of what has no colours.
    pub(super) fn new(seen: &Observation) -> Option<Self> {
        let colours = seen.colours.as_ref()?;
        let regions = colours.regions.clone();
        let fluxes = slice(colours.sums.total(), &regions.directions);
        let (fluxes, _) = fluxes.as_chunks::<3>();
        let fluxes: Vec<f64> = fluxes.iter().map(|[_, y, _]| *y).collect();
        let bright = Directions::new(seen.sphere).are_bright(&fluxes);
        let known = [regions.plane, regions.upwards].map(|at| is_known(&colours.sums, at));
        Some(Self { regions, bright, known })
    }

    /// X, Y and Z of the points, parts and directions that are compared.
    fn compared(&self, sums: &[f64]) -> [Vec<f64>; DIFFERENCES] {
        let [points, parts] =
            [&self.regions.points, &self.regions.parts].map(|at| slice(sums, at).to_vec());
        let (all, _) = slice(sums, &self.regions.directions).as_chunks::<3>();
        let bright = all.iter().zip(&self.bright).filter(|(_, bright)| **bright);
        [points, parts, bright.flat_map(|(xyz, _)| *xyz).collect()]
    }
}

/// True of a region with light enough to state its colour.
fn is_known(sums: &Grouped, at: usize) -> bool {
    let of = |sums: &[f64]| {
        let [x, y, z] = region(sums, at);
        x + 15.0 * y + 3.0 * z
    };
    let found = jackknife(sums, of);
    found.value > 0.0 && found.standard_error <= MAX_RELATIVE_ERROR * found.value
}

/// Colours of a region that is known.
fn colours(sums: &[f64], at: usize, is_known: bool) -> [f64; 4] {
    if is_known { chromaticity::figures(region(sums, at)) } else { [f64::NAN; 4] }
}

impl Reader for ColourReader {
    fn columns(&self) -> Vec<Column> {
        COLOURS.map(Column::plain).into()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        seen.colours.as_ref().map(|colours| Cow::Borrowed(&colours.sums))
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        // One point has no other to differ from.
        let difference = |xyz: Vec<f64>| {
            let found = colour_difference::plain(&xyz).filter(|_| xyz.len() > 3);
            found.unwrap_or(f64::NAN)
        };
        let mut all: Vec<f64> = self.compared(sums).map(difference).into();
        all.extend(colours(sums, self.regions.plane, self.known[0]));
        all.extend(colours(sums, self.regions.upwards, self.known[1]));
        all
    }

    fn entries(&self, sums: &Grouped) -> Vec<FigureEntry> {
        let differences = (0..DIFFERENCES).map(|k| {
            let compared = sums.map(|sums| self.compared(sums)[k].clone());
            let is_compared = compared.total().len() > 3;
            let found = is_compared.then(|| colour_difference::estimate(&compared)).flatten();
            found.map(FigureEntry::new)
        });
        let all = self.replicates(sums);
        let means = all.iter().map(JackknifedFigure::estimate).map(FigureEntry::new);
        let means: Vec<FigureEntry> = means.collect();
        // A figure that there is not has no number.
        let none = FigureEntry { value: f64::NAN, ..means[DIFFERENCES] };
        let differences = differences.map(|entry| entry.unwrap_or(none));
        differences.chain(means[DIFFERENCES..].iter().copied()).collect()
    }
}

/// Colours of a receiver that has one flux.
pub(super) struct ReceiverColourReader<'a> {
    receiver: &'a CheckedReceiver,
    /// Its region.
    at: usize,
    is_known: bool,
}

impl<'a> ReceiverColourReader<'a> {
    /// `None` of what has no colours, and of surfaces, whose bins hold one another.
    pub(super) fn new(
        number: usize,
        receiver: &'a CheckedReceiver,
        seen: &Observation,
    ) -> Option<Self> {
        let colours = seen.colours.as_ref()?;
        let at = colours.regions.receivers + number;
        let has_flux = !matches!(receiver.detector.measurement, Measurement::Flux(_));
        has_flux.then(|| Self { receiver, at, is_known: is_known(&colours.sums, at) })
    }
}

impl Reader for ReceiverColourReader<'_> {
    fn columns(&self) -> Vec<Column> {
        let name = self.receiver.name();
        COLOURS_OF_RECEIVER.map(|figure| Column::plain(figure.of_receiver(name))).into()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        seen.colours.as_ref().map(|colours| Cow::Borrowed(&colours.sums))
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        colours(sums, self.at, self.is_known).into()
    }
}
