// SPDX-License-Identifier: MIT OR Apache-2.0
//! The figures of one design's maps: the paper's uniformity, whose zero is the design's, and the
//! forms of [`uniformity_forms`], whose zero is darkness.
//!
//! [`uniformity_forms`]: metrics::uniformity_forms

use std::borrow::Cow;

use design::Design;
use design::schema::Zero;
use metrics::figures::{self, Definition, PAPERS_MAP};
use metrics::illuminance::{Grid, coarser};
use metrics::uniformity::{MapReading, Places, above_smallest, smallest_bin};
use metrics::uniformity_forms::{Regions, Uniformity};
use metrics::{Estimate, Grouped};

use super::{layout, reading};

/// Reads figures from maps of one design.
pub(super) struct MapReader {
    reading: MapReading,
    /// Bin that counts as dark, of designs that count from the smallest.
    smallest: Option<usize>,
    /// `None` where the paper's figures cannot be read.
    regions: Option<Regions>,
}

impl MapReader {
    /// For maps recorded on `recorded`; windows and zero are found in `map`, which has the bins
    /// that are read.
    pub(super) fn new(design: &Design, recorded: Grid, map: &Grouped) -> Self {
        let total = map.total();
        let mut reader = Self {
            reading: MapReading::new(
                coarser(&[], recorded, design.receiver.read_together()).1,
                layout(design),
                design.receiver.full_scale,
                reading(design),
            ),
            smallest: match design.receiver.zero {
                Zero::Dark => None,
                Zero::Smallest => Some(smallest_bin(total)),
            },
            regions: None,
        };
        let regions = reader.papers(total);
        reader.regions = regions.map(|_| Regions::new(&reader.reading));
        reader
    }

    /// Whether maps of the design have figures.
    pub(super) fn has_figures(&self) -> bool {
        self.regions.is_some()
    }

    /// Where the valleys and the peak of `map` are read; a zero that is not darkness moves neither.
    pub(super) fn places(&self, map: &[f64]) -> Option<Places> {
        self.reading.places(map)
    }

    fn papers(&self, map: &[f64]) -> Option<[f64; 3]> {
        let above = match self.smallest {
            None => Cow::Borrowed(map),
            Some(k) => map.iter().map(|l| l - map[k]).collect(),
        };
        self.reading.plain(&above)
    }

    /// All figures of one map, without errors.
    pub(super) fn values(&self, map: &[f64]) -> Vec<f64> {
        let Some(regions) = &self.regions else {
            return Vec::new();
        };
        let forms = regions.plain(map).into_iter().map(|(_, value)| value);
        let papers = self.papers(map).unwrap_or_default();
        papers.into_iter().chain(forms).collect()
    }

    /// One value for each of [`MapReader::values`], with its key.
    pub(super) fn keyed<T>(&self, values: Vec<T>) -> Vec<(&'static str, T)> {
        let forms = self.regions.iter().flat_map(Regions::forms);
        let keys = PAPERS_MAP.iter().map(|figure| figure.key).chain(forms.map(|form| form.key));
        keys.zip(values).collect()
    }

    /// All figures of `map` with their estimates.
    pub(super) fn estimates(&self, map: &Grouped) -> Vec<(Definition, Estimate)> {
        let Some(regions) = &self.regions else {
            return Vec::new();
        };
        let forms = regions.estimates(map);
        let papers = match self.smallest {
            None => Uniformity::of(&forms),
            Some(_) => self.above_zero(map),
        };
        let papers = papers.map(|u| [u.straight, u.diagonal, u.valley_to_peak]);
        let papers = papers.into_iter().flat_map(|estimates| PAPERS_MAP.into_iter().zip(estimates));
        papers.chain(forms.into_iter().map(|(form, e)| (figures::of_form(form), e))).collect()
    }

    /// The paper's figures of `map` above its smallest bin; `None` of an even map.
    fn above_zero(&self, map: &Grouped) -> Option<Uniformity> {
        let above = above_smallest(map);
        let total = above.total();
        let lit = total.iter().any(|l| *l > 0.0);
        let regions = Regions::between_neighbours(&self.reading);
        Uniformity::of(&regions.estimates(&above)).filter(|_| lit)
    }
}
