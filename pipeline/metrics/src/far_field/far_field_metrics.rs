// SPDX-License-Identifier: MIT OR Apache-2.0
//! Peak angle and centre/peak of a far field.
//!
//! The profile is the mean over azimuth or a cut. Its peak is the middle of the largest bin, or the
//! vertex of a parabola fitted to a window that the vertex is the middle of: a window about the
//! largest bin would jump with it, and the jackknife would see the jump or none of it. Across the
//! axis the profile continues as its mirror image. The centre is the mean intensity below `centre_deg`
//! over all azimuths, for a cut too: near the axis azimuths hardly differ, and a cut holds few rays
//! there.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::peak_place::PeakPlace;
use super::{AngularBins, BinPlacement};
use crate::estimate::DISTINCT;
use crate::halves::picked;
use crate::illuminance::Symmetry;
use crate::jackknife::spread;
use crate::sampled::event;
use crate::{Estimate, Grouped, jackknife};

/// The largest of the bins of the upper hemisphere of `profile`.
fn largest(profile: &[f64], sphere: &AngularBins) -> usize {
    (0..sphere.upper()).fold(0, |best, i| if profile[i] > profile[best] { i } else { best })
}

/// Angle between the directions on both sides of the axis at which `profile` falls below `level`,
/// outwards from its largest bin, degrees; NaN where it does not, or only at the horizon, below which
/// no light goes.
fn width(profile: &[f64], sphere: &AngularBins, level: f64) -> f64 {
    let best = largest(profile, sphere);
    let below = (best + 1..profile.len()).find(|&i| profile[i] < level);
    below.map_or(f64::NAN, |i| {
        let part = (profile[i - 1] - level) / (profile[i - 1] - profile[i]);
        let [inner, outer] = [i - 1, i].map(|i| sphere.centre_deg(i));
        let at = inner + part.max(0.0) * (outer - inner);
        let is_below = |i: usize| sphere.edges_deg(i)[0] >= 90.0 - 1e-9;
        let is_dark = || (0..profile.len()).all(|i| !is_below(i) || profile[i] <= 0.0);
        if at > 90.0 && is_dark() { f64::NAN } else { 2.0 * at }
    })
}

/// Half the width, in bins, of the lobe about the largest bin of `profile` in which it exceeds `level`; of
/// one that holds the axis, beyond which it is its mirror image, from the axis. NaN where it has no outer
/// end.
fn lobe(profile: &[f64], sphere: &AngularBins, level: f64) -> f64 {
    let outer = 0.5 * width(profile, sphere, level) / sphere.bin_deg;
    let best = largest(profile, sphere);
    let below = (0..best).rev().find(|&i| profile[i] < level);
    below.map_or(outer, |i| {
        let part = (level - profile[i]) / (profile[i + 1] - profile[i]);
        let [inner, next] = [i, i + 1].map(|i| sphere.centre_deg(i));
        let inner = (inner + part * (next - inner)) / sphere.bin_deg;
        0.5 * (outer - inner)
    })
}

/// Power that one path adds to a sum of paths, as of counts: the variance of the sum over its
/// value; `None` of no light.
fn one_path(value: f64, noise: f64) -> Option<f64> {
    (value > 0.0).then(|| noise * noise / value)
}

/// Steps in which a window finds the vertex; each takes most of what is left.
const MAX_STEPS: usize = 40;

/// Peak of a profile, and the place where another profile is read.
#[derive(Debug, Clone, Copy)]
struct Peak {
    angle_deg: f64,
    height: f64,
    place: Place,
}

/// Where a peak is read, in bins.
#[derive(Debug, Clone, Copy)]
enum Place {
    /// A bin.
    Bin(usize),
    /// A distance from the middle of the window of a parabola that reaches so far.
    Window { middle: f64, reach: f64, from_middle: f64 },
}

impl Peak {
    fn of_bin(profile: &[f64], sphere: &AngularBins) -> Self {
        let best = largest(profile, sphere);
        Self { angle_deg: sphere.centre_deg(best), height: profile[best], place: Place::Bin(best) }
    }
}

impl Place {
    /// Value of `profile` here.
    fn read(&self, profile: &[f64], sphere: &AngularBins) -> f64 {
        match *self {
            Self::Bin(bin) => profile[bin],
            Self::Window { middle, reach, from_middle: x } => {
                let fit = parabola(&window(profile, sphere, middle, reach));
                fit.map_or(f64::NAN, |[a, b, c]| a + x * (b + x * c))
            }
        }
    }
}

/// Peak of a profile: the vertex of the parabola fitted to `reach` bins and a half on either side of
/// it, in bins that count by their part in there. It lies within `reach` bins of the largest of the
/// upper hemisphere. A window that would reach across the axis, whose mirror image would draw it on,
/// is narrower, at least three bins, and stays about the largest.
fn vertex(profile: &[f64], sphere: &AngularBins, reach: usize) -> Peak {
    let (bin, largest) = (largest(profile, sphere), Peak::of_bin(profile, sphere));
    let (best, reach) = (bin as f64, reach.max(1) as f64);
    let axis = -sphere.centre_deg(0) / sphere.bin_deg;
    let at = |middle: f64, reach: f64, x: f64, height: f64| Peak {
        angle_deg: (middle + x - axis).abs() * sphere.bin_deg,
        height,
        place: Place::Window { middle, reach, from_middle: x },
    };
    let step = |middle: f64, reach: f64| {
        let [a, b, c] = parabola(&window(profile, sphere, middle, reach))?;
        let step = (-0.5 * b / c).clamp(-reach, reach);
        (c < 0.0).then_some((step, a + step * (b + step * c)))
    };
    let innermost = axis + reach + 0.5;
    let (mut middle, mut steps) = (best, 0);
    while middle >= innermost {
        let Some((moved, height)) = step(middle, reach) else {
            return largest;
        };
        let next = (middle + moved).clamp(best - reach, best + reach);
        steps += 1;
        if (next - middle).abs() < 1e-9 || steps == MAX_STEPS {
            return at(middle, reach, next - middle, height);
        }
        middle = next;
    }
    let narrow = (best - axis - 0.5).floor().clamp(1.0, reach);
    step(best, narrow).map_or(largest, |(moved, height)| at(best, narrow, moved, height))
}

/// Bins about `middle`, in bins: distance from it, value, and the part that lies within `reach` and
/// a half.
fn window(profile: &[f64], sphere: &AngularBins, middle: f64, reach: f64) -> Vec<[f64; 3]> {
    // Beyond the axis lies the mirror image: of bin 0 itself, or of the bin beside it.
    let first = match sphere.bins {
        BinPlacement::Between => -1,
        BinPlacement::About => 0,
    };
    let half = reach + 0.5;
    let bins = (middle - half).floor() as i64..=(middle + half).ceil() as i64;
    let part = |i: i64| {
        let value = *profile.get(if i < 0 { first - i } else { i } as usize)?;
        let at = i as f64 - middle;
        let inside = (at + 0.5).min(half) - (at - 0.5).max(-half);
        (inside > 1e-12).then_some([at, value, inside])
    };
    bins.filter_map(part).collect()
}

/// Coefficients of the least-squares parabola a + b x + c x² of points (x, value, weight); `None` if
/// they do not determine it.
fn parabola(points: &[[f64; 3]]) -> Option<[f64; 3]> {
    let moment = |k: i32| points.iter().map(|p| p[2] * p[0].powi(k)).sum::<f64>();
    let right = |k: i32| points.iter().map(|p| p[2] * p[0].powi(k) * p[1]).sum::<f64>();
    let m: Vec<f64> = (0..5).map(moment).collect();
    let column = |k: usize| [m[k], m[k + 1], m[k + 2]];
    let (x, y, z, r) = (column(0), column(1), column(2), [right(0), right(1), right(2)]);
    let det = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
            + c[0] * (a[1] * b[2] - a[2] * b[1])
    };
    // Cramer's rule on the normal equations.
    let whole = det(x, y, z);
    (whole.abs() > 1e-9 * m[0] * m[2] * m[4])
        .then(|| [det(r, y, z) / whole, det(x, r, z) / whole, det(x, y, r) / whole])
}

/// Centre over peak; 0 without light.
fn over(centre: f64, peak: f64) -> f64 {
    if peak > 0.0 { centre / peak } else { 0.0 }
}

/// Figures of one far field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FarFieldFigures {
    /// Polar angle of the largest azimuthal mean, degrees.
    pub peak_angle_deg: Estimate,
    /// The same by a parabola through recorded bins, where `peak_angle_deg` is the middle of a bin.
    pub peak_angle_parabola_deg: Option<Estimate>,
    /// Mean below the centre angle over the peak.
    pub centre_to_peak: Estimate,
    /// Angles between the directions at which the intensity falls to half and to a tenth of the
    /// peak, degrees, NaN where it does not; and ends between which one that is not resolved lies.
    pub widths_deg: [(Estimate, Option<[f64; 2]>); 2],
    /// Intensity at the peak, W/sr.
    pub peak_w_per_sr: Estimate,
    /// Mean intensity below the centre angle, W/sr.
    pub centre_w_per_sr: Estimate,
    /// Whether there is a peak off the axis.
    pub peak_place: PeakPlace,
    /// Of a peak read as the middle of a bin: middles of the first and last bins that cannot be
    /// told from it, degrees. Their intensity is below the largest by at most [`DISTINCT`] standard
    /// errors of the difference.
    pub peak_range_deg: Option<[f64; 2]>,
    /// Ends between which `peak_angle_deg` is known: the outer edges of these bins, for a parabola
    /// only where it is not resolved.
    pub peak_edges_deg: Option<[f64; 2]>,
    /// The same of `peak_angle_parabola_deg`.
    pub parabola_edges_deg: Option<[f64; 2]>,
}

/// Figures of one far field without errors, as [`FarFieldFigures`] has them with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlainFarField {
    /// Polar angle of the peak, degrees.
    pub peak_angle_deg: f64,
    /// The same by a parabola; NaN where `peak_angle_deg` is no middle of a bin.
    pub peak_angle_parabola_deg: f64,
    /// Mean below the centre angle over the peak.
    pub centre_to_peak: f64,
    /// Beam and field angle, degrees; NaN where the intensity does not fall so far.
    pub widths_deg: [f64; 2],
    /// Intensity at the peak, W/sr.
    pub peak_w_per_sr: f64,
    /// Mean intensity below the centre angle, W/sr.
    pub centre_w_per_sr: f64,
}

/// Parts of the peak at which the beam and the field angle end.
const WIDTHS: [f64; 2] = [0.5, 0.1];

/// Largest standard error of a vertex that is resolved, as a part of half its window: farther off a
/// window finds other maxima, which the jackknife may see or not.
const MAX_UNCERTAIN: f64 = 1.0 / 6.0;

/// Paths of which one more is felt.
const FEW: f64 = 10.0;

/// Standard errors of a centre that two of them lead to 0 which, with two more, bound it: those of one
/// path hold the five and a half that may have come.
const FEW_MORE: f64 = 1.5;

/// Fewest bins of half a [lobe] that is resolved, and the number from which on their width tells
/// nothing.
const COARSE: f64 = 4.0;
const FINE: f64 = 16.0;
/// Bins of half a lobe below which one about the axis may lie within the first, and one elsewhere within
/// the two that share it.
const WITHIN_ONE: f64 = 1.2;
const WITHIN_TWO: f64 = 1.45;
/// What bins twice as wide change over the error of bins, which grows with the square of their width.
const DOUBLED: f64 = 3.0;

/// Most bins that noise leaves open at the end of a beam that is resolved.
const MAX_TIED: usize = 3;

/// Where a profile has its peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PeakMethod {
    /// At the vertex of a parabola through the bins about the largest.
    #[default]
    Parabola,
    /// In the middle of the largest bin.
    Bin,
}

/// Settings of the figures of a far field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FarFieldReading {
    /// Recorded bins, between multiples of their width.
    pub recorded: AngularBins,
    /// Width of the bins of θ that are read, degrees: a whole multiple of recorded ones, an even
    /// one for bins about multiples.
    pub read_bin_deg: f64,
    /// Placement of the bins that are read.
    pub read_bins: BinPlacement,
    /// The centre is the mean below this polar angle, degrees.
    pub centre_deg: f64,
    /// Where the profile has its peak.
    pub peak: PeakMethod,
    /// Half width of the parabola through the peak, degrees.
    pub peak_fit_deg: f64,
    /// Azimuth of the cut that the peak is read from, degrees; `None`: from the mean over azimuth.
    pub cut_deg: Option<f64>,
    /// Symmetries over whose images a cut is averaged.
    pub symmetry: Symmetry,
}

impl FarFieldReading {
    /// Recorded rings in one that is read.
    fn together(&self) -> usize {
        (self.read_bin_deg / self.recorded.bin_deg).round() as usize
    }

    /// Recorded rings in the first that is read.
    fn first(&self) -> usize {
        match self.read_bins {
            BinPlacement::Between => self.together(),
            BinPlacement::About => self.together() / 2,
        }
    }

    /// Bins that are read.
    fn sphere(&self) -> AngularBins {
        AngularBins {
            bin_deg: self.read_bin_deg,
            polar: 1 + (self.recorded.polar - self.first()).div_ceil(self.together()),
            azimuths: self.recorded.azimuths,
            bins: self.read_bins,
        }
    }

    /// Powers in the bins that are read.
    fn rebinned(&self, powers: &[f64]) -> Vec<f64> {
        let azimuths = self.recorded.azimuths;
        let (first, rest) = powers.split_at(azimuths * self.first());
        let rings = std::iter::once(first).chain(rest.chunks(azimuths * self.together()));
        let sum = |rings: &[f64], j: usize| rings.iter().skip(j).step_by(azimuths).sum();
        rings.flat_map(|rings| (0..azimuths).map(move |j| sum(rings, j))).collect()
    }

    /// Intensities that the peak is read from, W/sr, for powers in the bins that are read.
    fn profile(&self, powers: &[f64]) -> Vec<f64> {
        self.cut_deg.map_or_else(
            || self.sphere().profile(powers),
            |azimuth| self.sphere().half_planes(powers, &self.symmetry.azimuths(azimuth)),
        )
    }

    /// Intensity of the centre, then the profile, from the powers in all recorded bins.
    fn seen(&self, powers: &[f64]) -> Vec<f64> {
        let sphere = self.sphere();
        let powers = &self.rebinned(powers)[..];
        let inner = sphere.below(self.centre_deg);
        let power: f64 = powers[..inner * sphere.azimuths].iter().sum();
        let mut seen = vec![power / self.centre_sr()];
        seen.extend(self.profile(powers));
        seen
    }

    /// Solid angle of the centre, sr.
    fn centre_sr(&self) -> f64 {
        let sphere = self.sphere();
        (0..sphere.below(self.centre_deg)).map(|i| sphere.ring_sr(i)).sum()
    }

    /// Bins on either side of the vertex of a parabola.
    fn reach(&self) -> usize {
        (self.peak_fit_deg / self.read_bin_deg).round() as usize
    }

    /// The peak of what was [seen](Self::seen).
    fn peak(&self, seen: &[f64]) -> Peak {
        let (sphere, profile) = (self.sphere(), &seen[1..]);
        match self.peak {
            PeakMethod::Parabola => vertex(profile, &sphere, self.reach()),
            PeakMethod::Bin => Peak::of_bin(profile, &sphere),
        }
    }

    /// A function of what was seen and of the intensity at its peak.
    fn at_peak(&self, seen: &Grouped, figure: impl Fn(&[f64], f64) -> f64 + Sync) -> Estimate {
        let sphere = self.sphere();
        picked(seen, |s| self.peak(s).place, |place, s| figure(s, place.read(&s[1..], &sphere)))
    }

    /// The reading by a parabola through recorded bins, if this one takes the middle of a bin.
    fn between(&self) -> Option<Self> {
        (self.peak == PeakMethod::Bin).then_some(Self {
            read_bin_deg: self.recorded.bin_deg,
            read_bins: BinPlacement::Between,
            peak: PeakMethod::Parabola,
            ..*self
        })
    }

    /// Peak angle and centre/peak of the far field `powers` (W in bins by groups).
    pub fn figures(&self, powers: &Grouped) -> FarFieldFigures {
        let seen = powers.map(|p| self.seen(p));
        // Where few paths show the centre, none of them shows those that might have come.
        let one_path = one_path(seen.total()[0], seen.standard_errors()[0])
            .unwrap_or_else(|| event(powers) / self.centre_sr());
        let one_path = if seen.total()[0] < FEW * one_path { one_path } else { 0.0 };
        let excess = jackknife(&seen, |s| self.peak(s).height - s[0]).with_error(one_path);
        let between = self.between().map(|judge| judge.angle(&powers.map(|p| judge.seen(p))));
        let peak_w_per_sr = self.at_peak(&seen, |_, peak| peak);
        let (peak_angle_deg, peak_edges_deg) = self.angle(&seen);
        let tied = (self.peak == PeakMethod::Bin).then(|| self.tied(&seen));
        // Bins about the axis have their first middle on it.
        let beside = peak_angle_deg.value > 1e-6 * self.read_bin_deg;
        let coarse = Self { read_bin_deg: 2.0 * self.read_bin_deg, ..*self };
        let wide = coarse.seen(powers.total());
        let in_wide = coarse.peak(&wide).height;
        let widths_deg = WIDTHS.map(|part| {
            let in_wide = width(&wide[1..], &coarse.sphere(), part * in_wide);
            let half = self.lobe(seen.total(), part);
            self.by_bins(self.width(&seen, part), in_wide, half)
        });
        // What bins do to an intensity is known by what they do to the beam.
        let beam = self.lobe(seen.total(), WIDTHS[0]);
        let within =
            if self.is_about_axis(beam, widths_deg[0].0.value) { WITHIN_ONE } else { WITHIN_TWO };
        let of_intensity = |found: Estimate, in_wide: f64| match beam {
            beam if beam < within => Estimate::new(f64::NAN, 0.0),
            beam if beam < COARSE => found.with_bias((in_wide - found.value).abs()),
            _ => found.with_bias(self.bias_of_bins(beam, in_wide - found.value)),
        };
        FarFieldFigures {
            peak_angle_deg,
            peak_angle_parabola_deg: between.map(|(angle, _)| angle),
            centre_to_peak: of_intensity(
                self.at_peak(&seen, |s, peak| over(s[0], peak))
                    .with_error(over(one_path, peak_w_per_sr.value)),
                over(seen.total()[0], in_wide),
            ),
            widths_deg,
            peak_w_per_sr: of_intensity(peak_w_per_sr, in_wide),
            centre_w_per_sr: {
                let centre = jackknife(&seen, |s| s[0]).with_error(one_path);
                let may_be_dark = centre.value > 0.0 && centre.value < 2.0 * centre.standard_error;
                // Between nothing and what a few paths more would be.
                if may_be_dark {
                    centre.with_bias(FEW_MORE * centre.standard_error)
                } else {
                    centre
                }
            },
            peak_place: PeakPlace::of(excess, peak_w_per_sr.value, beside),
            peak_range_deg: tied.map(|bins| bins.map(|bin| self.sphere().centre_deg(bin))),
            peak_edges_deg,
            parabola_edges_deg: between.and_then(|(_, edges)| edges),
        }
    }

    /// Peak angle, and the outer edges of the bins that cannot be told from the largest where these
    /// are all that is known: of the middle of a bin, and of a parabola whose window does not hold
    /// them all, or whose vertex is uncertain by a good part of the window.
    fn angle(&self, seen: &Grouped) -> (Estimate, Option<[f64; 2]>) {
        let angle = jackknife(seen, |s| self.peak(s).angle_deg);
        let (sphere, [first, last]) = (self.sphere(), self.tied(seen));
        let edges = [sphere.edges_deg(first)[0], sphere.edges_deg(last)[1]];
        if self.peak == PeakMethod::Bin {
            return (angle, Some(edges));
        }
        let half = self.reach().max(1) as f64 * self.read_bin_deg;
        let is_held = [first, last].iter().all(|bin| {
            (sphere.centre_deg(*bin) - angle.value).abs() <= half + 0.5 * self.read_bin_deg
        });
        if is_held && angle.standard_error <= MAX_UNCERTAIN * half {
            return (angle, None);
        }
        // As of a value anywhere between the edges.
        let spread = (edges[1] - edges[0]) / 12f64.sqrt();
        (Estimate::new(angle.value, angle.standard_error.max(spread)), Some(edges))
    }

    /// Angle at which the intensity falls to this part of the peak, outwards from it: of side lobes
    /// beyond nothing counts. It is not resolved where more than [`MAX_TIED`] bins outwards of the
    /// directions that may hold the peak cannot be told from that intensity, or the choice of the peak
    /// leaves it open: then it lies between the last bin that is surely above, with all before it, and
    /// the first that is surely below.
    fn width(&self, seen: &Grouped, part: f64) -> (Estimate, Option<[f64; 2]>) {
        let sphere = self.sphere();
        let angle = self.at_peak(seen, |s, peak| width(&s[1..], &sphere, part * peak));
        let plain = width(&seen.total()[1..], &sphere, part * self.peak(seen.total()).height);
        if plain.is_nan() {
            return (Estimate::new(plain, 0.0), None);
        }
        let (noise, peaks) = (seen.standard_errors(), self.tied(seen));
        let rings =
            || (0..sphere.polar).map(|i| (sphere.ring_sr(i), seen.total()[i + 1], noise[i + 1]));
        // One path of a dark ring has the mean power of those of others.
        let power: f64 = rings().map(|(sr, value, _)| sr * value).sum();
        let squares: f64 = rings().map(|(sr, _, noise)| (sr * noise).powi(2)).sum();
        let in_ring = |(sr, value, noise)| one_path(value, noise).unwrap_or(squares / power / sr);
        let one_path: Vec<f64> = rings().map(in_ring).collect();
        let left_out: Vec<(Vec<f64>, f64)> = (0..seen.count())
            .map(|g| seen.without(g))
            .map(|s| (s[1..].to_vec(), part * self.peak(&s).height))
            .collect();
        let level = part * self.peak(seen.total()).height;
        let excess = |i: usize| seen.total()[i + 1] - level;
        // Bins from the first that may be at the level to the first that is surely below.
        let open = |error: &dyn Fn(usize) -> f64| {
            let reach = |i: usize| DISTINCT * error(i).hypot(one_path[i]);
            let outer = |from: usize| from..sphere.polar;
            let first = outer(peaks[0]).find(|i| excess(*i) <= reach(*i)).unwrap_or(peaks[0]);
            let last = outer(first.max(peaks[1])).find(|i| excess(*i) < -reach(*i));
            [first, last.unwrap_or(sphere.polar)]
        };
        let [first, last] = open(&|i| noise[i + 1]);
        let is_sharp = last - first <= MAX_TIED;
        if is_sharp && angle.is_resolved() && angle.standard_error.is_finite() {
            return (angle, None);
        }
        let [first, last] = open(&|i| {
            spread(&left_out.iter().map(|(s, level)| s[i] - level).collect::<Vec<f64>>())
        });
        let ends = [first.saturating_sub(1), last];
        let ends = ends.map(|bin| (2.0 * sphere.centre_deg(bin)).min(360.0));
        // As of a value anywhere between the ends.
        (Estimate::new(plain, (ends[1] - ends[0]) / 12f64.sqrt()), Some(ends))
    }

    /// The [lobe] about the peak of what was [seen](Self::seen), down to this part of it.
    fn lobe(&self, seen: &[f64], part: f64) -> f64 {
        lobe(&seen[1..], &self.sphere(), part * self.peak(seen).height)
    }

    /// A width with what bins do to it, by its value in bins twice as wide: that of a lobe of `half` a few
    /// bins lies within a bin to both sides of each end.
    fn by_bins(
        &self,
        (found, ends): (Estimate, Option<[f64; 2]>),
        in_wide: f64,
        half: f64,
    ) -> (Estimate, Option<[f64; 2]>) {
        if half < COARSE || (half < FINE && in_wide.is_nan()) {
            let end = 0.5 * found.value / self.read_bin_deg;
            let inner = if half < 2.0 { end - half.max(1.0) } else { end - 1.0 };
            let inner = inner.max(0.0);
            let [inner, outer] = [inner, end + 1.0].map(|end| 2.0 * end * self.read_bin_deg);
            let [low, high] = ends.unwrap_or([inner, outer]);
            let ends = [low.min(inner), high.max(outer)];
            return (Estimate::new(found.value, (ends[1] - ends[0]) / 12f64.sqrt()), Some(ends));
        }
        if half.is_nan() || half >= FINE || ends.is_some() {
            return (found, ends);
        }
        let bias = self.bias_of_bins(half, in_wide - found.value);
        let is_about_axis = self.is_about_axis(half, found.value);
        // Off the axis bins lie anyhow about the lobe, and their error follows no power of their width.
        (found.with_bias(if is_about_axis { bias } else { DOUBLED * bias }), None)
    }

    /// True of a lobe of `half` a width of so many bins that holds the axis, and so is as wide as the beam.
    fn is_about_axis(&self, half: f64, width_deg: f64) -> bool {
        2.0 * half * self.read_bin_deg > 0.999 * width_deg
    }

    /// Bound of what bins do to a figure of a lobe of `half` a width of so many bins, which those twice as
    /// wide change by `change`. A peak that is a bin is one of a plot.
    fn bias_of_bins(&self, half: f64, change: f64) -> f64 {
        let is_read = self.peak == PeakMethod::Parabola && half < FINE;
        if is_read { change.abs() / DOUBLED } else { 0.0 }
    }

    /// The first and the last bin that cannot be told from the largest.
    fn tied(&self, seen: &Grouped) -> [usize; 2] {
        let sphere = self.sphere();
        let best = 1 + largest(&seen.total()[1..], &sphere);
        let tied = |bin: &usize| {
            let below = jackknife(seen, |s| s[best] - s[*bin]);
            below.value <= DISTINCT * below.standard_error
        };
        let bins: Vec<usize> = (0..sphere.upper()).map(|i| i + 1).filter(tied).collect();
        [bins.first(), bins.last()].map(|bin| bin.copied().unwrap_or(best) - 1)
    }

    /// Figures of one far field without groups.
    pub fn plain(&self, powers: &[f64]) -> PlainFarField {
        let seen = self.seen(powers);
        let Peak { angle_deg, height, .. } = self.peak(&seen);
        let between = self.between().map(|judge| judge.peak(&judge.seen(powers)).angle_deg);
        PlainFarField {
            peak_angle_deg: angle_deg,
            peak_angle_parabola_deg: between.unwrap_or(f64::NAN),
            centre_to_peak: over(seen[0], height),
            widths_deg: WIDTHS.map(|part| width(&seen[1..], &self.sphere(), part * height)),
            peak_w_per_sr: height,
            centre_w_per_sr: seen[0],
        }
    }
}

#[cfg(test)]
mod tests;
