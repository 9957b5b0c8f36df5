// SPDX-License-Identifier: MIT OR Apache-2.0
//! The figures of one design's maps: those between neighbours, whose zero is the design's, and the
//! forms of [`uniformity_forms`], whose zero is darkness.
//!
//! [`uniformity_forms`]: metrics::uniformity_forms

use std::borrow::Cow;

use design::Design;
use design::schema::Zero;
use metrics::figures::{self, Definition, UNIFORMITY, UNIFORMITY_DIAGONAL, VALLEY_TO_PEAK};
use metrics::illuminance::coarser;
use metrics::lit::LitBins;
use metrics::uniformity::{MapReading, Uniformity, above};
use metrics::uniformity_forms::Regions;
use metrics::{Estimate, Grouped, JackknifedFigure};
use results::figure_entry::FigureEntry;

use super::reader::{Column, Reader, left_out};
use super::{Observation, layout, reading};
use crate::lit;

/// Reads figures from maps of one design.
pub(super) struct MapReader {
    reading: MapReading,
    /// Bin that counts as dark, of designs that count from the smallest.
    smallest: Option<usize>,
    regions: Regions,
    /// Recorded bins in one that is read, along an edge.
    together: usize,
    /// Parts of the recorded bins that can be lit; all without.
    lit: Option<LitBins>,
}

impl MapReader {
    /// The zero is found in the map of `seen`.
    pub(super) fn new(design: &Design, seen: &Observation) -> Self {
        let together = design.receiver.read_together();
        let lit = lit::of_plane(design);
        let map = seen.binned_map(together, lit.as_ref());
        let reading = MapReading::new(
            coarser(&[], seen.grid, together).1,
            layout(design),
            design.receiver.full_scale,
            reading(design),
        )
        .with_area(design.receiver.area_corners_mm(), design.receiver.spot_mm)
        .with_counted(lit.as_ref().map(|lit| lit.coarser(seen.grid, together).counted));
        let smallest = match design.receiver.zero {
            Zero::Dark => None,
            Zero::Smallest => Some(reading.smallest(map.total())),
        };
        Self { regions: Regions::new(&reading), reading, smallest, together, lit }
    }

    /// True if maps of the design have figures between neighbours.
    pub(super) fn has_valley(&self) -> bool {
        self.reading.has_valley()
    }

    /// Figures of `map` between neighbours, as [`MapReading::plain`].
    fn between_neighbours(&self, map: &[f64]) -> Option<Uniformity<f64>> {
        let above = match self.smallest {
            None => Cow::Borrowed(map),
            Some(k) => map.iter().map(|l| l - map[k]).collect(),
        };
        self.reading.plain(&above)
    }

    /// Figures of `map` between neighbours above its smallest bin; `None` of an even map.
    fn above_zero(&self, map: &Grouped) -> Option<Uniformity> {
        let above = above(map, self.reading.smallest(map.total()));
        let total = above.total();
        let lit = total.iter().any(|l| *l > 0.0);
        let regions = Regions::between_neighbours(&self.reading);
        Uniformity::of(&regions.estimates(&above)).filter(|_| lit)
    }
}

/// Figures between neighbours, each with its value.
fn named<T>(of: Uniformity<T>) -> [(Definition, T); 3] {
    [
        (UNIFORMITY, of.straight),
        (UNIFORMITY_DIAGONAL, of.diagonal),
        (VALLEY_TO_PEAK, of.valley_to_peak),
    ]
}

impl Reader for MapReader {
    fn columns(&self) -> Vec<Column> {
        let forms = self.regions.forms().into_iter().map(figures::of_form);
        let neighbours = self.has_valley().then(|| named(Uniformity::<f64>::default()));
        let neighbours = neighbours.into_iter().flatten().map(|(figure, _)| figure);
        neighbours.chain(forms).map(Column::plain).collect()
    }

    fn sums<'a>(&self, seen: &'a Observation) -> Option<Cow<'a, Grouped>> {
        Some(seen.binned_map(self.together, self.lit.as_ref()))
    }

    fn values(&self, map: &[f64]) -> Vec<f64> {
        let forms = self.regions.plain(map).into_iter().map(|(_, value)| value);
        // As many as there are columns: without neighbours there are none.
        let neighbours =
            self.has_valley().then(|| named(self.between_neighbours(map).unwrap_or_default()));
        let neighbours = neighbours.into_iter().flatten().map(|(_, value)| value);
        neighbours.chain(forms).collect()
    }

    fn replicates(&self, map: &Grouped) -> Vec<JackknifedFigure> {
        let mut figures = left_out(map, |map| self.values(map));
        let first = figures.len() - self.regions.forms().len();
        for (figure, variation) in figures[first..].iter_mut().zip(self.regions.variations(map)) {
            if let Some(variation) = variation {
                *figure = variation;
            }
        }
        figures
    }

    fn entries(&self, map: &Grouped) -> Vec<FigureEntry> {
        let forms = self.regions.estimates(map);
        let neighbours = match self.smallest {
            None => Uniformity::of(&forms),
            Some(_) => self.above_zero(map),
        };
        let unread = Estimate::new(f64::NAN, 0.0);
        let neighbours = neighbours.unwrap_or(Uniformity {
            straight: unread,
            diagonal: unread,
            valley_to_peak: unread,
        });
        // A zero that is not darkness moves neither valley nor peak.
        let places = self.reading.places_mm(map.total());
        let neighbours = named(neighbours).into_iter().filter(|_| self.has_valley());
        let neighbours = neighbours.map(|(figure, estimate)| {
            let valley = usize::from(figure == UNIFORMITY_DIAGONAL);
            FigureEntry {
                valley_at_mm: places.map(|at| at[valley].map(rounded_mm)),
                peak_at_mm: places.map(|at| at[2].map(rounded_mm)),
                ..FigureEntry::new(estimate)
            }
        });
        neighbours.chain(forms.into_iter().map(|(_, e)| FigureEntry::new(e))).collect()
    }
}

/// To a micrometre, far below any bin.
fn rounded_mm(length_mm: f64) -> f64 {
    (length_mm * 1e3).round() / 1e3 + 0.0
}
