// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours of an observation: X, Y and Z (CIE 1931), group by group, of what its receivers saw.
//!
//! Whoever has observations of several wavelengths makes [`Colours`] of them; figures, files and
//! pictures read these alone. X, Y and Z are for 1 W of all lights, Y in units of 683 lm.

use std::borrow::Cow;
use std::ops::Range;

use design::Design;
use metrics::Grouped;
use metrics::colour_regions::{self, Directions};
use metrics::lit::LitBins;
use metrics::uniformity_forms::nine_points;

use super::{Observation, layout, plane_grid, sphere};
use crate::lit;

/// Groups of paths in one of the arrays: 16 groups are left of 64, whose errors are known to a
/// fifth.
pub const GROUPS_TOGETHER: usize = 4;

/// Numbers in memory for each bin of an array that is written: colours with covariances, columns,
/// text.
const WRITTEN: usize = 90;

/// X, Y and Z of the bins of a receiver.
pub type Tristimulus = [Grouped; 3];

/// An observation of one wavelength, or of X, Y or Z alone, open or behind one sub-pixel.
#[derive(Debug, Clone)]
pub struct Part<'a> {
    /// Weights that make X, Y and Z of it.
    pub weights: [f64; 3],
    /// The same behind each open sub-pixel of the panel.
    pub behind: Vec<[f64; 3]>,
    /// The observation.
    pub seen: &'a Observation,
}

/// X, Y and Z of what an observation saw.
#[derive(Debug, Clone)]
pub struct Colours {
    /// Of the regions that figures are read from, one after the other, in all groups of paths.
    pub sums: Grouped,
    /// Places of the regions in `sums`.
    pub regions: Regions,
    /// Of every bin; none where only figures are read.
    pub arrays: Option<ColourArrays>,
}

/// X, Y and Z of every bin, in fewer groups of paths ([`GROUPS_TOGETHER`]).
#[derive(Debug, Clone)]
pub struct ColourArrays {
    /// Of the map, 1/mm².
    pub illuminance: Tristimulus,
    /// Of the far field.
    pub far_field: Tristimulus,
    /// Of each of `[[receivers]]`, without Stokes parameters.
    pub receivers: Vec<Tristimulus>,
}

/// Places of regions among the sums.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Regions {
    /// Nine points of the cell; empty without one.
    pub points: Range<usize>,
    /// Parts of the cell; empty without one.
    pub parts: Range<usize>,
    /// Parts of the upper half-space.
    pub directions: Range<usize>,
    /// The whole map.
    pub plane: usize,
    /// The whole far field upwards.
    pub upwards: usize,
    /// The first of `[[receivers]]`, each whole.
    pub receivers: usize,
    /// The first of these behind the first sub-pixel; those of each sub-pixel follow one another.
    pub behind: usize,
}

impl Colours {
    /// Colours of observations of `design` in the same groups; `None` without one.
    pub fn new(design: &Design, parts: &[Part], with_arrays: bool) -> Option<Self> {
        let reader = RegionReader::new(design);
        let first = parts.first()?.seen;
        let regions = regions(&reader.read(first, 0));
        let of_part = |Part { weights, behind, seen }: &Part| {
            let groups = (0..seen.far_field.count()).map(|group| {
                let values = reader.read(seen, group);
                let receivers = &values[RECEIVERS];
                let open = values.concat().into_iter().map(|value| (value, weights));
                let behind = behind.iter().flat_map(|xyz| receivers.iter().map(move |v| (*v, xyz)));
                let all = open.chain(behind);
                all.flat_map(|(value, xyz)| xyz.map(|weight| weight * value)).collect()
            });
            Grouped::new(groups.collect())
        };
        let sums: Vec<Grouped> = parts.iter().map(of_part).collect();
        let sums: Vec<(f64, &Grouped)> = sums.iter().map(|part| (1.0, part)).collect();
        let sums = Grouped::weighted(&sums);
        let arrays = with_arrays.then(|| ColourArrays::new(design, parts));
        Some(Self { sums, regions, arrays })
    }
}

/// X, Y and Z of some regions, one after the other.
pub fn slice<'a>(sums: &'a [f64], regions: &Range<usize>) -> &'a [f64] {
    &sums[3 * regions.start..3 * regions.end]
}

/// X, Y and Z of a region.
pub fn region(sums: &[f64], number: usize) -> [f64; 3] {
    [0, 1, 2].map(|k| sums[3 * number + k])
}

impl ColourArrays {
    fn new(design: &Design, parts: &[Part]) -> Self {
        let is_lit = |xyz: &[f64; 3]| xyz.iter().any(|weight| *weight > 0.0);
        let is_open = |part: &&Part| is_lit(&part.weights) || !part.behind.iter().any(is_lit);
        let open: Vec<&Part> = parts.iter().filter(is_open).collect();
        let tristimulus = |bins: usize, of: &dyn Fn(&Observation) -> &Grouped| {
            [0, 1, 2].map(|k| {
                let parts = open.iter().map(|part| (part.weights[k], of(part.seen)));
                let parts: Vec<(f64, &Grouped)> = parts.collect();
                Grouped::weighted_merged(&parts, bins, GROUPS_TOGETHER)
            })
        };
        let (grid, sphere) = (plane_grid(design), sphere(design));
        let receivers = design.receivers.iter().enumerate().map(|(number, receiver)| {
            tristimulus(receiver.detector.places(), &|seen| &seen.receivers[number])
        });
        Self {
            illuminance: tristimulus(grid.columns * grid.rows, &|seen| &seen.illuminance),
            far_field: tristimulus(sphere.polar * sphere.azimuths, &|seen| &seen.far_field),
            receivers: receivers.collect(),
        }
    }

    /// Numbers that the arrays of `design` take in memory, with those of the largest on its way into
    /// files.
    pub fn count(design: &Design, groups: usize) -> usize {
        let (grid, sphere) = (plane_grid(design), sphere(design));
        let others = design.receivers.iter().map(|receiver| receiver.detector.places());
        let all: Vec<usize> = [grid.columns * grid.rows, sphere.polar * sphere.azimuths]
            .into_iter()
            .chain(others)
            .collect();
        let largest = all.iter().max().copied().unwrap_or_default();
        3 * all.iter().sum::<usize>() * (groups / GROUPS_TOGETHER + 1) + WRITTEN * largest
    }
}

/// Reads the regions of one group of paths.
struct RegionReader<'a> {
    design: &'a Design,
    layout: metrics::layout::Layout,
    parts: Option<colour_regions::Parts>,
    directions: Directions,
    lit: Option<LitBins>,
}

/// Values of points, parts, directions, map, far field upwards and receivers.
type Values = [Vec<f64>; 6];
const RECEIVERS: usize = 5;

impl<'a> RegionReader<'a> {
    fn new(design: &'a Design) -> Self {
        let layout = layout(design);
        let parts = colour_regions::Parts::of_cell(plane_grid(design), &layout);
        let (directions, lit) = (Directions::new(sphere(design)), lit::of_plane(design));
        Self { design, layout, parts, directions, lit }
    }

    fn read(&self, seen: &Observation, group: usize) -> Values {
        let map = seen.illuminance.group(group);
        let spot_mm = self.design.receiver.spot_mm;
        let grid = (seen.grid, self.lit.as_ref().map(|lit| &lit.counted[..]));
        let points = nine_points(grid, &self.layout, spot_mm, map).unwrap_or_default();
        // Sums are those of light, which is irradiance on what is lit.
        let light = self.lit.as_ref().map(|lit| map.iter().zip(&lit.parts).map(|(e, p)| e * p));
        let light = light.map_or(Cow::Borrowed(map), |light| Cow::Owned(light.collect()));
        let map = &*light;
        let parts = self.parts.as_ref().map_or_else(Vec::new, |parts| parts.sums(map));
        let directions = self.directions.parts.sums(seen.far_field.group(group));
        let receivers = self.design.receivers.iter().zip(&seen.receivers);
        let receivers = receivers.map(|(receiver, bins)| {
            bins.group(group)[..receiver.detector.places()].iter().sum::<f64>()
        });
        let upwards = vec![directions.iter().sum()];
        [points, parts, directions, vec![map.iter().sum()], upwards, receivers.collect()]
    }
}

/// Places of values, one after the other.
fn regions(values: &Values) -> Regions {
    let mut end = 0;
    let [points, parts, directions, plane, upwards, receivers] = [0, 1, 2, 3, 4, 5].map(|k| {
        let start = end;
        end += values[k].len();
        start..end
    });
    let [plane, upwards, receivers] = [plane, upwards, receivers].map(|range| range.start);
    Regions { points, parts, directions, plane, upwards, receivers, behind: end }
}
