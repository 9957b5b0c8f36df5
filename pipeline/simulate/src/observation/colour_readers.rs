// SPDX-License-Identifier: MIT OR Apache-2.0
//! Readers of colours, of an observation that has them.

use std::borrow::Cow;

use design::Design;
use design::resolved::receivers::CheckedReceiver;
use metrics::chromaticity::{self, MAX_RELATIVE_ERROR};
use metrics::colour_regions::Directions;
use metrics::figures::{
    ANGLE_DIFFERENCE, COLOUR_DIFFERENCE, COVERAGE, ColourFigures, Definition, FAR_FIELD_COLOUR,
    PARTS_DIFFERENCE, PLANE_COLOUR, Source, colours_of_receiver,
};
use metrics::{Estimate, Grouped, JackknifedFigure, colour_difference, gamut, jackknife};
use results::figure_entry::FigureEntry;
use tracer::Measurement;

use super::Observation;
use super::colours::{Colours, Regions, region, slice};
use super::reader::{Column, Reader};

/// Differences over cell and angle, and the colours of map and far field.
pub(super) struct ColourReader {
    regions: Regions,
    /// Directions whose colours are compared.
    bright: Vec<bool>,
    /// Figures of map and far field, each with its region, and true of one with light enough to state
    /// its colour.
    wholes: [(ColourFigures, usize, bool); 2],
}

/// Differences, each with X, Y and Z of what is compared.
type Compared = fn(&ColourReader, &[f64]) -> Vec<f64>;
const DIFFERENCES: [(Definition, Compared); 3] = [
    (COLOUR_DIFFERENCE, |reader, sums| slice(sums, &reader.regions.points).to_vec()),
    (PARTS_DIFFERENCE, |reader, sums| slice(sums, &reader.regions.parts).to_vec()),
    (ANGLE_DIFFERENCE, ColourReader::bright_directions),
];

impl ColourReader {
    /// `None` of what has no colours.
    pub(super) fn new(seen: &Observation) -> Option<Self> {
        let colours = seen.colours.as_ref()?;
        let regions = colours.regions.clone();
        let fluxes = slice(colours.sums.total(), &regions.directions);
        let (fluxes, _) = fluxes.as_chunks::<3>();
        let fluxes: Vec<f64> = fluxes.iter().map(|[_, y, _]| *y).collect();
        let bright = Directions::new(seen.sphere).are_bright(&fluxes);
        let wholes = [(PLANE_COLOUR, regions.plane), (FAR_FIELD_COLOUR, regions.upwards)]
            .map(|(figures, at)| (figures, at, is_known(&colours.sums, at)));
        Some(Self { regions, bright, wholes })
    }

    fn bright_directions(&self, sums: &[f64]) -> Vec<f64> {
        let (all, _) = slice(sums, &self.regions.directions).as_chunks::<3>();
        let bright = all.iter().zip(&self.bright).filter(|(_, bright)| **bright);
        bright.flat_map(|(xyz, _)| *xyz).collect()
    }
}

/// True of a region with light enough to state its colour.
fn is_known(sums: &Grouped, at: usize) -> bool {
    is_stated(sums, |sums| region(sums, at))
}

/// The same of X, Y and Z that are read so.
fn is_stated(sums: &Grouped, read: impl Fn(&[f64]) -> [f64; 3] + Sync) -> bool {
    let of = |sums: &[f64]| {
        let [x, y, z] = read(sums);
        x + 15.0 * y + 3.0 * z
    };
    let found = jackknife(sums, of);
    found.value > 0.0 && found.standard_error <= MAX_RELATIVE_ERROR * found.value
}

/// Colours of a region that is known.
fn colours(sums: &[f64], at: usize, is_known: bool) -> ColourFigures<f64> {
    let figures = || chromaticity::figures(region(sums, at));
    let [u_prime, v_prime, cct_k, duv] = if is_known { figures() } else { [f64::NAN; 4] };
    ColourFigures { u_prime, v_prime, cct_k, duv }
}

impl Reader for ColourReader {
    fn columns(&self) -> Vec<Column> {
        let differences = DIFFERENCES.into_iter().map(|(figure, _)| figure);
        let wholes = self.wholes.iter().flat_map(|(figures, ..)| figures.all());
        differences.chain(wholes).map(Column::plain).collect()
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
        let differences = DIFFERENCES.into_iter().map(|(_, of)| difference(of(self, sums)));
        let wholes = self.wholes.iter();
        let wholes = wholes.flat_map(|(_, at, is_known)| colours(sums, *at, *is_known).all());
        differences.chain(wholes).collect()
    }

    fn entries(&self, sums: &Grouped) -> Vec<FigureEntry> {
        let differences = DIFFERENCES.into_iter().map(|(_, of)| {
            let compared = sums.map(|sums| of(self, sums));
            let is_compared = compared.total().len() > 3;
            let found = is_compared.then(|| colour_difference::estimate(&compared)).flatten();
            found.map(FigureEntry::new)
        });
        let all = self.replicates(sums);
        let means = all.iter().map(JackknifedFigure::estimate).map(FigureEntry::new);
        // A figure that there is not has no number.
        let none = FigureEntry::new(Estimate::new(f64::NAN, 0.0));
        let differences = differences.map(|entry| entry.unwrap_or(none));
        differences.chain(means.skip(DIFFERENCES.len())).collect()
    }
}

/// Colours of a receiver that has one flux, and of the panel before its light.
pub(super) struct ReceiverColourReader<'a> {
    receiver: &'a CheckedReceiver,
    /// Its region.
    at: usize,
    is_known: bool,
    panel: Option<PanelBeforeReceiver>,
}

/// Sub-pixels before the light of a receiver.
struct PanelBeforeReceiver {
    /// Regions of the light behind each open one.
    at: [usize; 3],
    /// What each passes closed, over open.
    closed: [f64; 3],
    /// True where there is light enough to state white, and to state all primaries.
    are_known: [bool; 2],
}

impl PanelBeforeReceiver {
    fn new(number: usize, design: &Design, colours: &Colours) -> Option<Self> {
        let panel = design.panel.as_ref()?;
        let closed = panel.closed(panel.contrast)?;
        let at = [0, 1, 2].map(|s| colours.regions.behind + s * design.receivers.len() + number);
        let mut panel = Self { at, closed, are_known: [false; 2] };
        let is_known = |shares: [f64; 3]| is_stated(&colours.sums, |sums| panel.sum(sums, shares));
        let are_known = [is_known([1.0; 3]), (0..3).all(|s| is_known(panel.primary(s)))];
        panel.are_known = are_known;
        Some(panel)
    }

    /// Openings of one sub-pixel with the others closed.
    fn primary(&self, open: usize) -> [f64; 3] {
        let mut shares = self.closed;
        shares[open] = 1.0;
        shares
    }

    /// X, Y and Z of sub-pixels that are open so far.
    fn sum(&self, sums: &[f64], shares: [f64; 3]) -> [f64; 3] {
        let open = self.at.map(|at| region(sums, at));
        [0, 1, 2].map(|k| (0..3).map(|s| shares[s] * open[s][k]).sum())
    }

    /// White, then [`COVERAGE`].
    fn figures(&self, sums: &[f64]) -> Vec<f64> {
        let [has_white, has_primaries] = self.are_known;
        let white = || chromaticity::figures(self.sum(sums, [1.0; 3]));
        let white = if has_white { white() } else { [f64::NAN; 4] };
        let primaries = || [0, 1, 2].map(|s| self.sum(sums, self.primary(s)));
        let coverages = has_primaries.then(|| gamut::coverages(primaries()));
        white.into_iter().chain(coverages.unwrap_or([f64::NAN; COVERAGE.len()])).collect()
    }
}

impl<'a> ReceiverColourReader<'a> {
    /// `None` of what has no colours, and of surfaces, whose bins hold one another.
    pub(super) fn new(number: usize, design: &'a Design, seen: &Observation) -> Option<Self> {
        let colours = seen.colours.as_ref()?;
        let receiver = &design.receivers[number];
        if matches!(receiver.detector.measurement, Measurement::Flux(_)) {
            return None;
        }
        let at = colours.regions.receivers + number;
        let panel = PanelBeforeReceiver::new(number, design, colours);
        Some(Self { receiver, at, is_known: is_known(&colours.sums, at), panel })
    }
}

impl Reader for ReceiverColourReader<'_> {
    fn columns(&self) -> Vec<Column> {
        let is_read = |of: &Definition| of.source != Source::PanelColours || self.panel.is_some();
        let all = colours_of_receiver().filter(is_read);
        all.map(|figure| Column::plain(figure.of_receiver(self.receiver.name()))).collect()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        seen.colours.as_ref().map(|colours| Cow::Borrowed(&colours.sums))
    }

    fn values(&self, sums: &[f64]) -> Vec<f64> {
        let open = colours(sums, self.at, self.is_known).all();
        let behind = self.panel.iter().flat_map(|panel| panel.figures(sums));
        open.into_iter().chain(behind).collect()
    }
}
