// SPDX-License-Identifier: MIT OR Apache-2.0
//! Levels of regions of a noisy map: extremes, mean and variance, with their errors.
//!
//! An extreme of noisy bins is biased. The largest bin lies above the true maximum on average; the
//! place that one half of the paths picks, read in the other half, lies below it. The value is the
//! middle of both, averaged over many halvings, and half their distance b bounds its bias. A
//! smallest bin is treated likewise, with the signs exchanged. The standard error holds the scatter
//! σ and, as that of a value anywhere between the two, b/√3. With b above σ the figure is not
//! resolved ([`Estimate::is_resolved`]).
//!
//! The scatter is half the difference of two halves, as a root mean square over the halvings
//! ([`Grouped::halves`]). A jackknife moves no choice among bins that noise makes alike, and would
//! state the noise of one bin where the extreme of several scatters less.
//!
//! The valley of a local fit ([`super::valley`]) is read in one half where the other is lowest. It
//! has no bias of choice among valleys of one depth, and one below the error among others. It is not
//! resolved where the lowest fit to all paths lies farther off, as another extreme; else its scatter
//! is the jackknife error at its place.
//!
//! Where a few paths decide, no half sees the paths that might have come: what one path more at the
//! smallest place changes is added, so that no error is 0 and three errors are the three paths of an
//! empty bin at 95 % confidence. Where it exceeds the scatter the figure is not resolved.
//!
//! The variance of noisy bins holds the variance of the noise. The covariance of two groups of paths
//! does not: the variance is that of all pairs of different groups ([`without_noise`]).

use rayon::prelude::*;

use super::halves::{by_halves, half_difference};
use super::illuminance::{Grid, largest, smallest};
use super::jackknife::{spread, without_noise};
use super::sample::Sample;
use super::valley::{Lowest, Valley};
use super::{Estimate, Grouped, JackknifedFigure};

/// Samples of a region.
#[derive(Debug, Clone)]
enum Samples {
    /// Bins, each with its weight.
    Bins(Vec<(usize, f64)>),
    /// Places between bins.
    Points(Vec<Sample>),
}

impl Samples {
    fn get(&self, k: usize) -> Sample {
        match self {
            Self::Bins(bins) => Sample::bin(bins[k].0, bins[k].1),
            Self::Points(points) => points[k].clone(),
        }
    }

    fn values(&self, map: &[f64]) -> Vec<f64> {
        match self {
            Self::Bins(bins) => bins.iter().map(|(k, weight)| weight * map[*k]).collect(),
            Self::Points(points) => points.iter().map(|sample| sample.of(map)).collect(),
        }
    }
}

/// One region of a map: where it is sampled, and how its lowest value is read.
#[derive(Debug, Clone)]
pub(crate) struct Sampled {
    samples: Samples,
    /// Share of each sample in means.
    areas: Vec<f64>,
    /// The first so many samples are those of extremes.
    extremes: usize,
    /// Of segments and diagonals, whose peak is that of the whole map; elsewhere the smallest sample.
    valley: Option<Valley>,
}

/// Where a region has its extremes.
#[derive(Debug, Clone)]
struct Picks {
    low: Pick,
    high: Sample,
}

/// What reads the lowest value at its place.
#[derive(Debug, Clone)]
enum Pick {
    Valley(Lowest),
    Sample(Sample),
}

impl Pick {
    fn of(&self, map: &[f64]) -> f64 {
        match self {
            Self::Valley(lowest) => lowest.value(map),
            Self::Sample(sample) => sample.of(map),
        }
    }

    /// Σ c² / Σ c over the weights c of the bins that are read: the share of one bin's noise.
    fn concentration(&self) -> f64 {
        match self {
            Self::Valley(lowest) => lowest.concentration(),
            Self::Sample(sample) => sample.concentration(),
        }
    }
}

/// Values of one region in one map.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Levels {
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Mean by area.
    pub mean: f64,
    /// Variance by area, of one map with all of its paths.
    pub variance: f64,
}

impl Sampled {
    /// Places that all count alike.
    pub fn points(points: Vec<Sample>) -> Self {
        Self::even(Samples::Points(points))
    }

    fn even(samples: Samples) -> Self {
        let count = match &samples {
            Samples::Bins(bins) => bins.len(),
            Samples::Points(points) => points.len(),
        };
        Self { samples, areas: vec![1.0 / count as f64; count], extremes: count, valley: None }
    }

    /// The bins that are counted, the value of each its content over its measure.
    pub fn densities(measures: &[f64], is_counted: impl Fn(usize) -> bool) -> Self {
        let counted = || measures.iter().enumerate().filter(|(k, _)| is_counted(*k));
        let whole: f64 = counted().map(|(_, measure)| measure).sum();
        let bins: Vec<_> = counted().map(|(k, measure)| (k, 1.0 / measure)).collect();
        let areas = counted().map(|(_, measure)| measure / whole).collect();
        Self { extremes: bins.len(), samples: Samples::Bins(bins), areas, valley: None }
    }

    /// Samples half a bin apart along `segments`, or the bins that `valley` is read from.
    pub fn lines(
        grid: Grid,
        counted: Option<&[f64]>,
        segments: &[[[f64; 2]; 2]],
        valley: Valley,
    ) -> Self {
        let samples = match &valley {
            Valley::Bins(bins) => Samples::Bins(bins.iter().map(|bin| (*bin, 1.0)).collect()),
            Valley::Fit(_) => Samples::Points(along(grid, counted, segments)),
        };
        Self { valley: Some(valley), ..Self::even(samples) }
    }

    /// The bins of a rectangle, by their area inside of which no more counts than is `counted`; those
    /// with their middles inside come first.
    pub fn rectangle(grid: Grid, counted: Option<&[f64]>, [low, high]: [[f64; 2]; 2]) -> Self {
        let rounding = 1e-9 * grid.bin_mm;
        // Bin, length inside as a fraction of the bin, and whether the middle lies inside.
        let line = |k: usize, count: usize| {
            let half = 0.5 * grid.bin_mm;
            let bins = (0..count).map(move |i| (i, grid.centre_mm(i, count)));
            let parts = bins.map(move |(i, at)| {
                let inside = (at + half).min(high[k]) - (at - half).max(low[k]);
                let has_middle = at >= low[k] - rounding && at <= high[k] + rounding;
                (i, inside / grid.bin_mm, has_middle)
            });
            parts.filter(|part| part.1 > 1e-9).collect::<Vec<_>>()
        };
        let (columns, rows) = (line(0, grid.columns), line(1, grid.rows));
        let bins = rows.iter().flat_map(|(j, height, row)| {
            let bin = move |(i, width, column): &(usize, f64, bool)| {
                ((j * grid.columns + i, 1.0), width * height, *row && *column)
            };
            columns.iter().map(bin)
        });
        let bins = bins.map(|(bin, area, has_middle): ((usize, f64), f64, bool)| {
            (bin, area.min(counted.map_or(1.0, |parts| parts[bin.0])), has_middle)
        });
        let bins = bins.filter(|(_, area, _)| *area > 0.0);
        let (within, border): (Vec<_>, Vec<_>) = bins.partition(|(_, _, has_middle)| *has_middle);
        if counted.is_some() && within.is_empty() {
            // Beyond what is lit all bins are alike.
            return Self::rectangle(grid, None, [low, high]);
        }
        let extremes = within.len();
        let all = within.into_iter().chain(border);
        let (bins, mut areas): (Vec<_>, Vec<_>) = all.map(|(bin, area, _)| (bin, area)).unzip();
        let whole: f64 = areas.iter().sum();
        for area in &mut areas {
            *area /= whole;
        }
        Self { samples: Samples::Bins(bins), areas, extremes, valley: None }
    }

    /// Mean of `map` over the region.
    pub fn mean(&self, map: &[f64]) -> f64 {
        self.mean_of(&self.samples.values(map))
    }

    fn mean_of(&self, values: &[f64]) -> f64 {
        values.iter().zip(&self.areas).map(|(value, area)| value * area).sum()
    }

    /// Covariance of the values of two maps over the region.
    fn covariance(&self, a: &[f64], b: &[f64]) -> f64 {
        let (mean_a, mean_b) = (self.mean_of(a), self.mean_of(b));
        let products = a.iter().zip(b).zip(&self.areas);
        products.map(|((a, b), area)| (a - mean_a) * (b - mean_b) * area).sum()
    }

    /// Variance over squared mean of `map` without the variance of its noise, which may lie below 0,
    /// and the same without each group of paths.
    pub fn squared_variation(&self, map: &Grouped) -> JackknifedFigure {
        let total = self.samples.values(map.total());
        let (mean, square) = (self.mean_of(&total), self.covariance(&total, &total));
        let of_group = |g: usize| {
            let values = self.samples.values(map.group(g));
            let square = self.covariance(&values, &values);
            (self.mean_of(&values), square, self.covariance(&total, &values))
        };
        let groups: Vec<_> = (0..map.count()).into_par_iter().map(of_group).collect();
        let squares: f64 = groups.iter().map(|(_, square, _)| square).sum();
        let count = map.count();
        let without = groups.iter().map(|(of_mean, own, with_total)| {
            let (square, squares) = (square - 2.0 * with_total + own, squares - own);
            let mean = mean - of_mean;
            if mean <= 0.0 {
                // As of one bright sample among dark ones.
                return self.areas.len() as f64 - 1.0;
            }
            without_noise(square, squares, count - 1) / (mean * mean)
        });
        let value = without_noise(square, squares, count) / (mean * mean);
        JackknifedFigure::new(value, without.collect())
    }

    /// Levels of `map`; the peak of the whole map is `peak`.
    pub fn levels(&self, map: &[f64], peak: f64) -> Levels {
        let values = &self.samples.values(map)[..];
        let extremes = || values[..self.extremes].iter().copied();
        Levels {
            low: match &self.valley {
                Some(valley) => valley.lowest(map).value(map),
                None => extremes().fold(f64::INFINITY, f64::min),
            },
            high: match self.valley {
                Some(_) => peak,
                None => extremes().fold(f64::NEG_INFINITY, f64::max),
            },
            mean: self.mean_of(values),
            variance: self.covariance(values, values),
        }
    }

    /// Places of the extremes of `map`, whose largest bin is `peak`.
    fn picks(&self, map: &[f64], values: &[f64], peak: usize) -> Picks {
        let extremes = &values[..self.extremes];
        match &self.valley {
            Some(valley) => {
                Picks { low: Pick::Valley(valley.lowest(map)), high: Sample::bin(peak, 1.0) }
            }
            None => Picks {
                low: Pick::Sample(self.samples.get(smallest(extremes).0)),
                high: self.samples.get(largest(extremes).0),
            },
        }
    }

    /// Levels of `map` at the places `held`.
    fn held(&self, map: &[f64], held: &Picks) -> Levels {
        let values = self.samples.values(map);
        Levels {
            low: held.low.of(map),
            high: held.high.of(map),
            mean: self.mean_of(&values),
            ..Levels::default()
        }
    }

    /// True if the lowest value is that of a fit.
    fn is_fitted(&self) -> bool {
        matches!(self.valley, Some(Valley::Fit(_)))
    }

    /// True if the region is a set of places, which are few, without a valley.
    fn is_of_places(&self) -> bool {
        self.valley.is_none() && matches!(self.samples, Samples::Points(_))
    }

    /// What one of two halves has where the other has its extremes, without a mean; then the levels
    /// of each, of a fitted valley at the place of the other.
    fn cross(&self, [a, b]: [&[f64]; 2], peaks: [usize; 2]) -> [Levels; 3] {
        let [of_a, of_b] = [a, b].map(|map| self.samples.values(map));
        let (in_a, in_b) = (self.picks(a, &of_a, peaks[0]), self.picks(b, &of_b, peaks[1]));
        let of = |map: &[f64], values: &[f64], [own, other]: [&Picks; 2]| Levels {
            low: if self.is_fitted() { other.low.of(map) } else { own.low.of(map) },
            high: own.high.of(map),
            mean: self.mean_of(values),
            ..Levels::default()
        };
        let crossed = Levels {
            low: 0.5 * (in_a.low.of(b) + in_b.low.of(a)),
            high: 0.5 * (in_a.high.of(b) + in_b.high.of(a)),
            ..Levels::default()
        };
        [crossed, of(a, &of_a, [&in_a, &in_b]), of(b, &of_b, [&in_b, &in_a])]
    }
}

/// Samples half a bin apart along `segments`.
fn along(grid: Grid, counted: Option<&[f64]>, segments: &[[[f64; 2]; 2]]) -> Vec<Sample> {
    let mut samples = Vec::new();
    for [a, b] in segments {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let count = (2.0 * length / grid.bin_mm).ceil().max(1.0) as usize;
        samples.extend((0..count).map(|k| {
            let s = (k as f64 + 0.5) / count as f64;
            Sample::at(grid, counted, [0, 1].map(|i| a[i] + s * (b[i] - a[i])))
        }));
    }
    samples
}

/// Levels of regions of one map, as they are needed for estimates of functions of them.
pub(crate) struct LevelEstimates<'a> {
    regions: &'a [Sampled],
    map: &'a Grouped,
    /// Extremes of all paths.
    plain: Vec<Levels>,
    /// Extremes that one half of the paths has where the other has its own.
    crossed: Vec<Levels>,
    /// Of both halves, by halvings and regions.
    halves: Vec<Vec<[Levels; 2]>>,
    /// Without each group, extremes at the places of all.
    without: Vec<Vec<Levels>>,
    /// Change of the lowest value by one path more.
    one_more: Vec<f64>,
}

impl<'a> LevelEstimates<'a> {
    /// Of `map` by groups of paths.
    pub fn new(regions: &'a [Sampled], map: &'a Grouped) -> Self {
        let (peak_bin, peak) = largest(map.total());
        let of_total = |region: &Sampled| {
            region.picks(map.total(), &region.samples.values(map.total()), peak_bin)
        };
        let picks: Vec<Picks> = regions.iter().map(of_total).collect();
        let without = (0..map.count()).into_par_iter().map(|g| {
            let map = map.without(g);
            regions.iter().zip(&picks).map(|(region, picks)| region.held(&map, picks)).collect()
        });
        let without = without.collect();
        let plain: Vec<Levels> =
            regions.iter().map(|region| region.levels(map.total(), peak)).collect();
        let (crossed, halves) = crossed(regions, map, &plain);
        let event = event(map);
        let one_more = picks.iter().map(|picks| event * picks.low.concentration()).collect();
        Self { regions, map, plain, crossed, halves, without, one_more }
    }

    /// The `figure` of levels of a region, which is a share of its highest value or of its mean. Where
    /// no path has arrived it lies anywhere between 0 and 1.
    pub fn share(&self, region: usize, figure: impl Fn(&Levels) -> f64) -> Estimate {
        if self.plain[region].high <= 0.0 || self.plain[region].mean <= 0.0 {
            return Estimate::between(0.0, 1.0, 0.0);
        }
        self.estimate(region, figure)
    }

    /// The `figure` of levels of a region.
    pub fn estimate(&self, region: usize, figure: impl Fn(&Levels) -> f64) -> Estimate {
        let levels = &self.crossed[region];
        let more = Levels { low: levels.low + self.one_more[region], ..*levels };
        let (plain, crossed) = (figure(&self.plain[region]), figure(levels));
        let one_more = (figure(&more) - crossed).abs();
        let halves = self.of_halves(region, &figure);
        // Extremes of a few values in halves may agree by chance.
        let is_of_places = self.regions[region].is_of_places();
        let of_places = if is_of_places { self.noise_of_places(region, &figure) } else { 0.0 };
        let scatter = halves.max(of_places);
        if plain.to_bits() == crossed.to_bits() {
            return Estimate::new(plain, scatter.hypot(one_more));
        }
        let both = Estimate::between(plain, crossed, halves);
        if one_more > halves {
            let reach = if is_of_places { self.reach(region, &figure) } else { 0.0 };
            return both.with_bias((FEW_PATHS * one_more).max(of_places).max(reach));
        }
        let both = Estimate::between(plain, crossed, halves.hypot(one_more));
        if is_of_places && both.is_resolved() {
            return Estimate::between(plain, crossed, scatter.hypot(one_more));
        }
        if self.regions[region].is_fitted() && both.is_resolved() {
            let high = self.plain[region].high;
            let at_peak = figure(&Levels { high, ..*levels });
            // Valley and peak are far apart, and their noise is independent.
            let of_valley = self.left_out(region, |of| figure(&Levels { high, ..*of }));
            let of_peak = self.of_halves(region, |of| figure(&Levels { high: of.high, ..*levels }));
            let scatter = of_valley.hypot(of_peak).hypot(one_more);
            if at_peak.to_bits() == crossed.to_bits() {
                return Estimate::new(crossed, scatter);
            }
            return Estimate::between(at_peak, crossed, scatter);
        }
        if both.is_resolved() { both } else { both.with_bias(of_places) }
    }

    /// The root of the variance of a region over its mean.
    pub fn variation(&self, region: usize) -> Estimate {
        if self.plain[region].mean <= 0.0 {
            // That of one bright sample among dark ones is the largest.
            let samples = self.regions[region].areas.len() as f64;
            return Estimate::between(0.0, (samples - 1.0).sqrt(), 0.0);
        }
        self.regions[region].squared_variation(self.map).estimate().mapped(f64::sqrt)
    }

    fn of_halves(&self, region: usize, figure: impl Fn(&Levels) -> f64) -> f64 {
        let halves = self.halves.iter().map(|levels| levels[region]);
        half_difference(halves.map(|[a, b]| [figure(&a), figure(&b)]))
    }

    /// The error of a figure by the noise of one place at its lowest and one at its highest value, as of
    /// counts. Variance over level is that of the place, which on an axis of symmetry is larger than
    /// elsewhere; where few paths told it, that of the map.
    fn noise_of_places(&self, region: usize, figure: impl Fn(&Levels) -> f64) -> f64 {
        let levels = self.crossed[region];
        let noise = |read: fn(&Levels) -> f64| {
            let one_path = self.one_path(region, read);
            ((read(&levels) + one_path) * one_path).max(0.0).sqrt()
        };
        let lower = Levels { low: levels.low + noise(|of| of.low), ..levels };
        let higher = Levels { high: levels.high + noise(|of| of.high), ..levels };
        let [lower, higher] = [lower, higher].map(|moved| figure(&moved) - figure(&levels));
        lower.hypot(higher)
    }

    /// Half the change of a figure by the largest that the lowest of few places and the smallest that the
    /// highest may be: three paths of an empty place, which may lie on all axes of symmetry, and two
    /// standard errors of others.
    fn reach(&self, region: usize, figure: impl Fn(&Levels) -> f64) -> f64 {
        let (levels, plain) = (self.crossed[region], self.plain[region]);
        let [of_low, of_high] =
            [|of: &Levels| of.low, |of: &Levels| of.high].map(|read| self.one_path(region, read));
        // Below one path there is nothing that tells how much one is.
        let of_map = self.one_more[region];
        let of_low = if plain.low > of_map { of_low } else { MAX_IMAGES * of_map };
        let far = Levels {
            low: levels.low + 2.0 * (levels.low * of_low).sqrt() + 2.0 * FEW_PATHS * of_low,
            high: (levels.high - 2.0 * (levels.high * of_high).sqrt()).max(levels.mean),
            ..levels
        };
        0.5 * (figure(&far) - figure(&levels)).abs()
    }

    /// Power of one path at the place of a level: its variance over the level, shrunk to that of the
    /// map where few paths told it.
    fn one_path(&self, region: usize, read: fn(&Levels) -> f64) -> f64 {
        let of_map = self.one_more[region];
        let (level, held) = (read(&self.plain[region]), self.left_out(region, read));
        let few = FEW_OF_PLACE * of_map;
        (held * held + few * of_map) / (level + few)
    }

    fn left_out(&self, region: usize, figure: impl Fn(&Levels) -> f64) -> f64 {
        let without = self.without.iter().map(|levels| figure(&levels[region]));
        spread(&without.collect::<Vec<f64>>())
    }
}

/// Means over halvings of what one half has where the other has its extremes; then the levels of both
/// halves, by halvings and regions. Means are those of `plain`, and lie between the extremes.
fn crossed(
    regions: &[Sampled],
    map: &Grouped,
    plain: &[Levels],
) -> (Vec<Levels>, Vec<Vec<[Levels; 2]>>) {
    let of_halves = |[a, b]: [Vec<f64>; 2]| {
        let peaks = [largest(&a).0, largest(&b).0];
        regions.iter().map(|region| region.cross([&a, &b], peaks)).collect::<Vec<_>>()
    };
    let segments = regions.iter().filter_map(|r| r.valley.as_ref().map(Valley::segments));
    let affordable = (MAX_SEGMENTS_READ / segments.max().unwrap_or(1)).max(MIN_HALVINGS);
    let count = HALVINGS.min(map.count() - 1).min(affordable);
    let of_splits: Vec<Vec<[Levels; 3]>> = by_halves(map, count, of_halves);
    let mean_of = |region: usize, level: fn(&Levels) -> f64| {
        of_splits.iter().map(|all| level(&all[region][0])).sum::<f64>() / of_splits.len() as f64
    };
    let mean = |(region, plain): (usize, &Levels)| Levels {
        low: mean_of(region, |levels| levels.low).min(plain.mean),
        high: mean_of(region, |levels| levels.high).max(plain.mean),
        mean: plain.mean,
        ..Levels::default()
    };
    let means = plain.iter().enumerate().map(mean).collect();
    let both = |all: &Vec<[Levels; 3]>| all.iter().map(|[_, a, b]| [*a, *b]).collect();
    (means, of_splits.iter().map(both).collect())
}

/// Ways to halve the paths that a mean takes.
const HALVINGS: usize = 32;
/// Most segments that are searched in halves of the paths, over all halvings.
const MAX_SEGMENTS_READ: usize = 32_768;
/// Fewest halvings that errors are told from.
const MIN_HALVINGS: usize = 7;
/// Paths at the smallest place that bound it together with two standard errors, where one decides.
const FEW_PATHS: f64 = 1.5;

/// Images of a path at a place on all axes of symmetry, where all are one.
const MAX_IMAGES: f64 = 8.0;

/// Paths at one place that say as much about its noise as the whole map.
const FEW_OF_PLACE: f64 = 4.0;

/// Power of one path in a bin of `map`, in its unit: the variance of all bins over their sum, as of
/// counts. Every 16th bin of large maps is looked at.
pub(crate) fn event(map: &Grouped) -> f64 {
    let step = (map.total().len() / 65_536).clamp(1, 16);
    let n = map.count() as f64;
    let mut squares = 0.0;
    let total = map.total();
    for g in 0..map.count() {
        let powers = map.group(g).iter().zip(total).step_by(step);
        squares += powers.map(|(power, total)| (power - total / n).powi(2)).sum::<f64>();
    }
    squares *= n / (n - 1.0);
    let sum = total.iter().step_by(step).sum::<f64>();
    if sum > 0.0 { squares / sum } else { 0.0 }
}
