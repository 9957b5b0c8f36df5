// SPDX-License-Identifier: MIT OR Apache-2.0
//! Places to cut a relief: at every kink, and between kinks into slices of equal thickness.

use super::{Relief, SAME_PLACE, geometry};
use std::ops::{Div, Mul, Sub};

/// Side slopes |dx/dz| above this weigh no more: a nearly horizontal side is a thin wedge whose
/// own slices would take all there are.
const SLOPE_CAP: f64 = 8.0;

/// A range of z without a kink in it, cut into equal slices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Upper end, in the unit of the relief.
    pub z0: f64,
    /// Lower end.
    pub z1: f64,
    /// Number of slices; 1 where no side is slanted.
    pub count: usize,
    /// True where any side is slanted; if not, one slice is exact.
    pub slanted: bool,
    /// Length of its most slanted side, in the unit of the relief, less where that side is steep; 0
    /// without slanted sides.
    pub stairs: f64,
}

/// Cut of a relief: intervals from kink to kink that cover 0 to the depth, each cut evenly.
///
/// Kinks are the corners of the polygons and the places where outlines cross. Since no slice
/// contains one, what the cutting does to any smooth result is an even power series in the
/// thickness, so that results on a plan and on [`SlicePlan::refined`] ones can be extrapolated
/// ([`extrapolate`]).
#[derive(Debug, Clone, PartialEq)]
pub struct SlicePlan {
    intervals: Vec<Interval>,
}

impl SlicePlan {
    /// About `count` slices: one for each interval without slanted sides, and the rest shared by
    /// the others in proportion to the length of their most slanted side, at least one each.
    pub(super) fn new(relief: &Relief, count: usize) -> Self {
        let cuts = cuts(relief);
        let mut intervals = Vec::with_capacity(cuts.len() - 1);
        for z in cuts.windows(2) {
            let (z0, z1) = (z[0], z[1]);
            let slope = steepest(relief, 0.5 * (z0 + z1));
            let slanted = slope * (z1 - z0) > SAME_PLACE * relief.period();
            intervals.push(Interval {
                z0,
                z1,
                count: 1,
                slanted,
                stairs: if slanted { (z1 - z0) * stairs(slope.min(SLOPE_CAP)) } else { 0.0 },
            });
        }
        let weights: Vec<f64> = intervals.iter().map(|i| i.stairs).collect();
        let straight = intervals.iter().filter(|i| !i.slanted).count();
        for (interval, share) in
            intervals.iter_mut().zip(shares(&weights, count.saturating_sub(straight)))
        {
            interval.count = share.max(1);
        }
        Self { intervals }
    }

    /// The plan of a structure that is not cut: no intervals.
    pub fn none() -> Self {
        Self { intervals: Vec::new() }
    }

    /// The intervals from top to bottom.
    pub fn intervals(&self) -> &[Interval] {
        &self.intervals
    }

    /// Length that is cut into stairs, in the unit of the relief.
    pub fn stairs(&self) -> f64 {
        self.intervals.iter().map(|i| i.stairs).sum()
    }

    /// Number of slices in all.
    pub fn count(&self) -> usize {
        self.intervals.iter().map(|i| i.count).sum()
    }

    /// True where it represents the relief exactly (no slanted sides), so that refining changes
    /// nothing.
    pub fn is_exact(&self) -> bool {
        self.intervals.iter().all(|i| !i.slanted)
    }

    /// The same cut with every slice that is not exact cut into `factor` equal ones.
    ///
    /// # Panics
    /// If `factor` is 0.
    #[must_use]
    pub fn refined(&self, factor: usize) -> Self {
        assert!(factor > 0, "a plan is refined by a factor of at least 1");
        self.with_counts(|count| count * factor)
    }

    /// The coarsest plan not coarser than this one whose intervals are cut into multiples of
    /// `multiple` slices, where they are cut at all.
    ///
    /// # Panics
    /// If `multiple` is 0.
    #[must_use]
    pub fn raised(&self, multiple: usize) -> Self {
        assert!(multiple > 0, "numbers of slices are multiples of at least 1");
        self.with_counts(|count| count.next_multiple_of(multiple))
    }

    /// A plan [`Self::raised`] to multiples of three, with `n` slices for every three.
    #[must_use]
    pub fn thirds(&self, n: usize) -> Self {
        self.with_counts(|count| count.div_ceil(3) * n)
    }

    /// The same cut with `by` times as many slices, where they are not exact.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        self.with_counts(|count| (count as f64 * by).ceil() as usize)
    }

    /// The same cut, slices that are not exact no higher than `height`, but no more than `most`
    /// between two kinks because of that.
    pub(crate) fn no_higher(&self, height: f64, most: usize) -> Self {
        let mut changed = self.clone();
        for interval in changed.intervals.iter_mut().filter(|i| i.slanted) {
            let needed = ((interval.z1 - interval.z0) / height).ceil() as usize;
            interval.count = interval.count.max(needed.min(most));
        }
        changed
    }

    fn with_counts(&self, change: impl Fn(usize) -> usize) -> Self {
        let mut changed = self.clone();
        for interval in changed.intervals.iter_mut().filter(|i| i.slanted) {
            interval.count = change(interval.count);
        }
        changed
    }

    /// Mid-height and thickness of every slice, from top to bottom.
    pub fn slices(&self) -> impl Iterator<Item = (f64, f64)> {
        self.intervals.iter().flat_map(|&Interval { z0, z1, count, .. }| {
            let thickness = (z1 - z0) / count as f64;
            (0..count).map(move |i| (z0 + (i as f64 + 0.5) * thickness, thickness))
        })
    }
}

/// A result at slices of thickness 0, from `coarse` on n slices and `fine` on n + 1 of them, or on
/// n and n + 1 times as many of any number: an even power series in the thickness loses its first
/// term, ((n + 1)² fine - n² coarse) / ((n + 1)² - n²). For `n` of 1 or more.
pub fn extrapolate<T>(coarse: T, fine: T, n: f64) -> T
where
    T: Mul<f64, Output = T> + Sub<Output = T> + Div<f64, Output = T>,
{
    let (here, there) = (n * n, (n + 1.0) * (n + 1.0));
    (fine * there - coarse * here) / (there - here)
}

/// Heights of all kinks with 0 and the depth, ascending, each once.
fn cuts(relief: &Relief) -> Vec<f64> {
    let depth = relief.depth();
    let mut heights: Vec<f64> =
        relief.polygons().iter().flat_map(|p| p.points.iter().map(|q| q[1])).collect();
    heights.extend(outline_crossings(relief));
    heights.sort_by(f64::total_cmp);
    let mut cuts = vec![0.0];
    for z in heights {
        if z - cuts[cuts.len() - 1] > SAME_PLACE * depth && depth - z > SAME_PLACE * depth {
            cuts.push(z);
        }
    }
    cuts.push(depth);
    cuts
}

/// Heights at which the outlines of two polygons, or of a polygon and its wrapped copy, cross.
fn outline_crossings(relief: &Relief) -> Vec<f64> {
    let period = relief.period();
    let mut found = Vec::new();
    for (i, p) in relief.polygons().iter().enumerate() {
        for (j, q) in relief.polygons().iter().enumerate().skip(i) {
            let (p0, p1) = geometry::extent(p.points.iter().map(|c| c[0]));
            let (q0, q1) = geometry::extent(q.points.iter().map(|c| c[0]));
            // Copies of q moved by whole periods that reach p.
            let from = ((p0 - q1) / period).floor() as i64;
            let to = ((p1 - q0) / period).ceil() as i64;
            for copy in from..=to {
                if i == j && copy <= 0 {
                    continue;
                }
                let dx = copy as f64 * period;
                for s in geometry::sides(&p.points) {
                    for (a, b) in geometry::sides(&q.points) {
                        let t = ([a[0] + dx, a[1]], [b[0] + dx, b[1]]);
                        found.extend(geometry::crossing_height(s, t));
                    }
                }
            }
        }
    }
    found
}

/// Length that the stairs of a side of slope |dx/dz| count for, per height. Where the slope is above
/// 1, the side's length: what diffracts is a stair's pitch along it. A steep side has stairs of
/// little area, slope h²/2: they are as good while h goes as the root of the slope.
fn stairs(slope: f64) -> f64 {
    if slope >= 1.0 { slope.hypot(1.0) } else { (2.0 * slope).sqrt() }
}

/// Largest |dx/dz| of the sides that cross the height z.
fn steepest(relief: &Relief, z: f64) -> f64 {
    relief
        .polygons()
        .iter()
        .flat_map(|p| geometry::sides(&p.points))
        .filter(|(a, b)| (a[1] <= z) != (b[1] <= z))
        .map(|(a, b)| ((b[0] - a[0]) / (b[1] - a[1])).abs())
        .fold(0.0, f64::max)
}

/// `total` shared by largest remainders: in proportion to the weights, rounded, the sum kept.
fn shares(weights: &[f64], total: usize) -> Vec<usize> {
    let sum: f64 = weights.iter().sum();
    if sum == 0.0 {
        return vec![0; weights.len()];
    }
    let ideal: Vec<f64> = weights.iter().map(|w| total as f64 * w / sum).collect();
    let mut shares: Vec<usize> = ideal.iter().map(|x| x.floor() as usize).collect();
    let missing = total.saturating_sub(shares.iter().sum());
    let mut order: Vec<usize> = (0..weights.len()).collect();
    order.sort_by(|&a, &b| ideal[b].fract().total_cmp(&ideal[a].fract()));
    for &i in order.iter().take(missing) {
        shares[i] += 1;
    }
    shares
}
