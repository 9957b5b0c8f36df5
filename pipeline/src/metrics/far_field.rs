// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far field: intensity over the polar angle, averaged over azimuth, its peak angle and its centre.
//!
//! Bin i covers θ between two edges over all azimuths; its intensity is its power over its solid angle 2π (cos θ_i - cos θ_{i+1}).
//! Edges are multiples of the width, or lie half way between them. The peak is the vertex of the parabola that fits the largest bin and
//! its neighbours on both sides best, across the axis the profile goes on as its own mirror image; or the middle of the largest bin. The profile
//! is the mean over azimuth or a cut. The centre is the mean intensity below `centre_deg` over all azimuths, in a cut too: near the axis they
//! hardly differ, and a cut holds few rays there.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::{Estimate, Grouped, jackknife};

/// Bins of the far field: θ from 0 to 180°, φ from 0 to 360°; bin (θ, φ) is at `theta * azimuths + phi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Bin of θ, degrees.
    pub bin_deg: f64,
    /// Number of bins of θ.
    pub polar: usize,
    /// Number of bins of φ.
    pub azimuths: usize,
    /// Where the bins of θ lie.
    pub bins: Bins,
}

/// Where the bins of the polar angle lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Bins {
    /// Between multiples of their width.
    #[default]
    Between,
    /// About multiples of their width: the first about the axis, half as wide on this side of it.
    About,
}

impl Sphere {
    /// The polar angles between which ring `i` lies, degrees.
    fn edges_deg(&self, i: usize) -> [f64; 2] {
        let shift = match self.bins {
            Bins::Between => 0.0,
            Bins::About => 0.5,
        };
        [i, i + 1].map(|k| (self.bin_deg * (k as f64 - shift)).clamp(0.0, 180.0))
    }

    /// Solid angle of the ring `i` of θ over all azimuths, sr.
    pub fn ring_sr(&self, i: usize) -> f64 {
        let [from, to] = self.edges_deg(i).map(|edge| edge.to_radians().cos());
        2.0 * PI * (from - to)
    }

    /// Middle of ring `i`, degrees; of one about the axis, 0.
    pub fn centre_deg(&self, i: usize) -> f64 {
        match self.bins {
            Bins::Between => (i as f64 + 0.5) * self.bin_deg,
            Bins::About => i as f64 * self.bin_deg,
        }
    }

    /// Number of rings within the upper hemisphere, at least 1.
    fn upper(&self) -> usize {
        let within = |i: &usize| self.edges_deg(*i)[1] <= 90.0 + 1e-9;
        (0..self.polar).take_while(within).count().max(1)
    }

    /// Number of rings below the polar angle `deg`, at least 1.
    fn below(&self, deg: f64) -> usize {
        let within = |i: &usize| self.edges_deg(*i)[1] <= deg + 1e-9;
        (0..self.polar).take_while(within).count().max(1)
    }

    /// Middles of all rings, degrees.
    pub fn centres_deg(&self) -> Vec<f64> {
        (0..self.polar).map(|i| self.centre_deg(i)).collect()
    }

    /// Intensity averaged over azimuth in every ring, W/sr, for powers in all bins.
    pub fn profile(&self, powers: &[f64]) -> Vec<f64> {
        (0..self.polar)
            .map(|i| {
                powers[i * self.azimuths..(i + 1) * self.azimuths]
                    .iter()
                    .sum::<f64>()
                    / self.ring_sr(i)
            })
            .collect()
    }

    /// Share of the power in polar angles between two, bins taken where their middle lies; 0 without any power.
    pub fn share(&self, powers: &[f64], from_deg: f64, to_deg: f64) -> f64 {
        let within = |i: usize| (from_deg..to_deg).contains(&self.centre_deg(i));
        let ring = |i: usize| {
            powers[i * self.azimuths..(i + 1) * self.azimuths]
                .iter()
                .sum::<f64>()
        };
        let all: f64 = powers.iter().sum();
        let part: f64 = (0..self.polar).filter(|&i| within(i)).map(ring).sum();
        if all > 0.0 { part / all } else { 0.0 }
    }

    /// Intensity in the half-planes φ = `azimuth_deg` + 0, 90, 180, 270°, averaged, W/sr. A half-plane on an edge
    /// between two bins takes both.
    pub fn cut(&self, powers: &[f64], azimuth_deg: f64) -> Vec<f64> {
        let width = 360.0 / self.azimuths as f64;
        let mut chosen = Vec::new();
        for quarter in 0..4 {
            let place = (azimuth_deg + 90.0 * f64::from(quarter)) / width;
            let bin = place.floor() as usize % self.azimuths;
            chosen.push(bin);
            if (place - place.round()).abs() < 1e-9 {
                chosen.push((place.round() as usize + self.azimuths - 1) % self.azimuths);
            }
        }
        let solid_share = chosen.len() as f64 / self.azimuths as f64;
        (0..self.polar)
            .map(|i| {
                chosen
                    .iter()
                    .map(|&j| powers[i * self.azimuths + j])
                    .sum::<f64>()
                    / (self.ring_sr(i) * solid_share)
            })
            .collect()
    }
}

/// The largest of the bins of the upper hemisphere of `profile`.
fn largest(profile: &[f64], sphere: &Sphere) -> usize {
    (0..sphere.upper()).fold(
        0,
        |best, i| if profile[i] > profile[best] { i } else { best },
    )
}

/// Peak of a profile over its bins, (angle in degrees, intensity): the vertex of the parabola fitted to the largest bin of
/// the upper hemisphere and `reach` bins on either side.
fn vertex(profile: &[f64], sphere: &Sphere, reach: usize) -> (f64, f64) {
    let best = largest(profile, sphere);
    let middle = sphere.centre_deg(best);
    let reach = reach.max(1) as i64;
    // Beyond the axis lies the mirror image: of bin 0 itself, or of the bin beside it.
    let first = match sphere.bins {
        Bins::Between => -1,
        Bins::About => 0,
    };
    let bin = |i: i64| {
        profile
            .get(if i < 0 { first - i } else { i } as usize)
            .map(|&v| (i - best as i64, v))
    };
    let points: Vec<(f64, f64)> = (best as i64 - reach..=best as i64 + reach)
        .filter_map(bin)
        .map(|(x, v)| (x as f64, v))
        .collect();
    let Some([a, b, c]) = parabola(&points) else {
        return (middle, profile[best]);
    };
    if c >= 0.0 {
        return (middle, profile[best]);
    }
    let vertex = (-0.5 * b / c).clamp(-(reach as f64), reach as f64);
    (
        (middle + vertex * sphere.bin_deg).abs(),
        a + vertex * (b + vertex * c),
    )
}

/// Coefficients of the least-squares parabola a + b x + c x²; `None` if the points do not determine it.
fn parabola(points: &[(f64, f64)]) -> Option<[f64; 3]> {
    let moment = |k: i32| points.iter().map(|p| p.0.powi(k)).sum::<f64>();
    let right = |k: i32| points.iter().map(|p| p.0.powi(k) * p.1).sum::<f64>();
    let m: Vec<f64> = (0..5).map(moment).collect();
    let column = |k: usize| [m[k], m[k + 1], m[k + 2]];
    let (x, y, z, r) = (
        column(0),
        column(1),
        column(2),
        [right(0), right(1), right(2)],
    );
    let det = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
            + c[0] * (a[1] * b[2] - a[2] * b[1])
    };
    // Cramer's rule on the normal equations.
    let whole = det(x, y, z);
    (whole.abs() > 1e-9 * m[0] * m[2] * m[4]).then(|| {
        [
            det(r, y, z) / whole,
            det(x, r, z) / whole,
            det(x, y, r) / whole,
        ]
    })
}

/// Figures of one far field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FarField {
    /// Polar angle of the largest azimuthal mean, degrees.
    pub peak_angle_deg: Estimate,
    /// Mean below the centre angle over the peak.
    pub centre_to_peak: Estimate,
    /// Intensity at the peak, W/sr.
    pub peak_w_per_sr: Estimate,
    /// Whether the maximum lies on the axis or cannot be told from the centre: the peak exceeds the mean below the centre angle
    /// by no more than [`DISTINCT`] standard errors of the difference. Then the peak angle is that of noise.
    pub on_axis: bool,
}

/// Standard errors by which a peak off the axis must exceed the centre.
pub const DISTINCT: f64 = 3.0;

/// Where a profile has its peak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Peak {
    /// At the vertex of a parabola through the bins about the largest.
    #[default]
    Parabola,
    /// In the middle of the largest bin, as a plot of the bins shows it.
    Bin,
}

/// How a far field is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judge {
    /// Bins in which it was recorded, between multiples of their width.
    pub recorded: Sphere,
    /// Bin of θ in which it is read, degrees: a whole number of recorded ones, an even one about multiples.
    pub read_bin_deg: f64,
    /// Where the bins lie in which it is read.
    pub read_bins: Bins,
    /// The centre is the mean below this polar angle, degrees.
    pub centre_deg: f64,
    /// Where the profile has its peak.
    pub peak: Peak,
    /// Half width of the parabola through the peak, degrees.
    pub peak_fit_deg: f64,
    /// Azimuth of the cut that the peak is read from, degrees; `None`: from the mean over azimuth.
    pub cut_deg: Option<f64>,
}

impl Judge {
    /// Recorded bins of θ in one that is read.
    fn together(&self) -> usize {
        (self.read_bin_deg / self.recorded.bin_deg).round() as usize
    }

    /// Recorded bins of θ in the first that is read.
    fn first(&self) -> usize {
        match self.read_bins {
            Bins::Between => self.together(),
            Bins::About => self.together() / 2,
        }
    }

    /// Bins in which it is read.
    fn sphere(&self) -> Sphere {
        Sphere {
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
        rings
            .flat_map(|rings| (0..azimuths).map(move |j| sum(rings, j)))
            .collect()
    }

    /// Intensities that the peak is read from, W/sr, for powers in the bins that are read.
    fn profile(&self, powers: &[f64]) -> Vec<f64> {
        self.cut_deg.map_or_else(
            || self.sphere().profile(powers),
            |azimuth| self.sphere().cut(powers, azimuth),
        )
    }

    /// What is read from the powers in all recorded bins: the intensity of the centre, then the profile.
    fn seen(&self, powers: &[f64]) -> Vec<f64> {
        let sphere = self.sphere();
        let powers = &self.rebinned(powers)[..];
        let inner = sphere.below(self.centre_deg);
        let power: f64 = powers[..inner * sphere.azimuths].iter().sum();
        let solid: f64 = (0..inner).map(|i| sphere.ring_sr(i)).sum();
        let mut seen = vec![power / solid];
        seen.extend(self.profile(powers));
        seen
    }

    /// Angle and intensity of the peak of what was [seen](Self::seen).
    fn peak(&self, seen: &[f64]) -> (f64, f64) {
        let (sphere, profile) = (self.sphere(), &seen[1..]);
        match self.peak {
            Peak::Parabola => {
                let reach = (self.peak_fit_deg / self.read_bin_deg).round() as usize;
                vertex(profile, &sphere, reach)
            }
            Peak::Bin => {
                let best = largest(profile, &sphere);
                (sphere.centre_deg(best), profile[best])
            }
        }
    }

    /// Peak angle and centre/peak of the far field `powers` (W in bins by groups).
    pub fn figures(&self, powers: &Grouped) -> FarField {
        let seen = powers.map(|p| self.seen(p));
        let excess = jackknife(&seen, |s| self.peak(s).1 - s[0]);
        FarField {
            peak_angle_deg: jackknife(&seen, |s| self.peak(s).0),
            centre_to_peak: jackknife(&seen, |s| s[0] / self.peak(s).1),
            peak_w_per_sr: jackknife(&seen, |s| self.peak(s).1),
            on_axis: excess.value <= DISTINCT * excess.standard_error,
        }
    }

    /// Peak angle, degrees, and centre/peak read bin by bin, as a plot of the profile is: the middle of the largest bin, and all in the profile.
    pub fn bin_by_bin(&self, powers: &[f64]) -> [f64; 2] {
        let sphere = self.sphere();
        let profile = self.profile(&self.rebinned(powers));
        let best = largest(&profile, &sphere);
        let inner = sphere.below(self.centre_deg);
        let solid: f64 = (0..inner).map(|i| sphere.ring_sr(i)).sum();
        let centre: f64 = (0..inner).map(|i| profile[i] * sphere.ring_sr(i)).sum();
        [sphere.centre_deg(best), centre / solid / profile[best]]
    }

    /// Peak angle, degrees, and centre/peak of one far field without groups.
    pub fn plain(&self, powers: &[f64]) -> [f64; 2] {
        let seen = self.seen(powers);
        let (angle, height) = self.peak(&seen);
        [angle, seen[0] / height]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPHERE: Sphere = Sphere {
        bin_deg: 2.0,
        polar: 90,
        azimuths: 36,
        bins: Bins::Between,
    };

    const JUDGE: Judge = Judge {
        recorded: SPHERE,
        read_bin_deg: 2.0,
        read_bins: Bins::Between,
        centre_deg: 2.0,
        peak: Peak::Parabola,
        peak_fit_deg: 6.0,
        cut_deg: None,
    };

    /// Powers of the intensity `f(θ°)`, spread evenly over azimuth, integrated over each ring.
    fn powers(f: impl Fn(f64) -> f64) -> Vec<f64> {
        powers_in(SPHERE, f)
    }

    fn powers_in(sphere: Sphere, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let n = 200;
        let ring = |i: usize| -> f64 {
            let step = sphere.bin_deg / f64::from(n);
            let at = |k: i32| sphere.bin_deg * i as f64 + (f64::from(k) + 0.5) * step;
            let weight = |theta: f64| f(theta) * theta.to_radians().sin();
            2.0 * PI * step.to_radians() * (0..n).map(|k| weight(at(k))).sum::<f64>()
        };
        let spread = |i: usize| vec![ring(i) / sphere.azimuths as f64; sphere.azimuths];
        (0..sphere.polar).flat_map(spread).collect()
    }

    fn twice(p: &[f64]) -> Grouped {
        Grouped::new(vec![
            p.iter().map(|v| 0.4 * v).collect(),
            p.iter().map(|v| 0.6 * v).collect(),
        ])
    }

    #[test]
    fn parabola_finds_the_peak_between_bins() {
        let f = |t: f64| 1.0 - ((t - 26.3) / 40.0).powi(2);
        let figures = JUDGE.figures(&twice(&powers(|t| f(t).max(0.0))));
        assert!(
            (figures.peak_angle_deg.value - 26.3).abs() < 0.02,
            "{figures:?}"
        );
        assert!((figures.peak_w_per_sr.value - 1.0).abs() < 1e-3);
        // Mean over the cap below 2°, where sin θ weights the outer part: θ = 4/3°.
        assert!((figures.centre_to_peak.value - f(4.0 / 3.0)).abs() < 2e-3);
        assert!(figures.peak_angle_deg.standard_error < 1e-9);
        let [angle, ratio] = JUDGE.plain(&powers(|t| f(t).max(0.0)));
        assert!((angle - figures.peak_angle_deg.value).abs() < 1e-9);
        assert!((ratio - figures.centre_to_peak.value).abs() < 1e-12);
    }

    #[test]
    fn bins_alone_give_the_middle_of_the_largest() {
        let f = |t: f64| (1.0 - ((t - 26.3) / 40.0).powi(2)).max(0.0);
        let [angle, ratio] = JUDGE.bin_by_bin(&powers(f));
        assert!((angle - 27.0).abs() < 1e-12);
        assert!((ratio - f(4.0 / 3.0) / f(27.0)).abs() < 2e-3);
    }

    #[test]
    fn lambertian_peaks_on_the_axis() {
        let figures = JUDGE.figures(&twice(&powers(|t| t.to_radians().cos().max(0.0) / PI)));
        assert!(figures.peak_angle_deg.value < 1.0, "{figures:?}");
        assert!((figures.centre_to_peak.value - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_peak_off_the_axis_must_stand_out_of_the_noise() {
        let f = |t: f64| (1.0 - ((t - 26.3) / 60.0).powi(2)).max(0.0);
        let dented = powers(f);
        let even = powers(|t| t.to_radians().cos().max(0.0) / PI);
        // Sixteen groups whose rings scatter by `noise`, of one sign or the other by a Walsh code of the ring.
        let noisy = |p: &[f64], noise: f64| {
            let group = |g: usize| {
                let of = |(k, w): (usize, &f64)| {
                    let code = (k / SPHERE.azimuths * 5 + 3) % 15 + 1;
                    let sign = if (g & code).count_ones().is_multiple_of(2) {
                        1.0
                    } else {
                        -1.0
                    };
                    w / 16.0 * (1.0 + noise * sign)
                };
                p.iter().enumerate().map(of).collect()
            };
            JUDGE.figures(&Grouped::new((0..16).map(group).collect()))
        };
        assert!(!noisy(&dented, 0.01).on_axis && !noisy(&dented, 0.1).on_axis);
        assert!(noisy(&dented, 1.0).on_axis, "a dent within the noise");
        for noise in [0.01, 0.1, 1.0] {
            assert!(noisy(&even, noise).on_axis, "{noise}");
        }
    }

    #[test]
    fn cut_reads_its_own_azimuths() {
        let mut p = vec![0.0; SPHERE.polar * SPHERE.azimuths];
        // 1 W/sr in the bins on both sides of φ = 90°, nothing elsewhere.
        for j in [8, 9] {
            p[10 * 36 + j] = SPHERE.ring_sr(10) / 36.0;
        }
        assert!((SPHERE.cut(&p, 0.0)[10] - 0.25).abs() < 1e-12);
        assert!(SPHERE.cut(&p, 45.0)[10].abs() < 1e-15);
        assert!((SPHERE.profile(&p)[10] - 2.0 / 36.0).abs() < 1e-12);
    }

    #[test]
    fn bins_taken_together_read_as_bins_recorded_so() {
        let f = |t: f64| (1.0 - ((t - 26.3) / 60.0).powi(2)).max(0.0);
        let coarse = Sphere {
            bin_deg: 6.0,
            polar: 30,
            ..SPHERE
        };
        let (fine, fewer) = (powers(f), powers_in(coarse, f));
        let judge = |recorded| Judge {
            recorded,
            read_bin_deg: 6.0,
            centre_deg: 6.0,
            ..JUDGE
        };
        let (a, b) = (judge(SPHERE).plain(&fine), judge(coarse).plain(&fewer));
        assert!(
            (a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-4,
            "{a:?} {b:?}"
        );
        let (a, b) = (
            judge(SPHERE).bin_by_bin(&fine),
            judge(coarse).bin_by_bin(&fewer),
        );
        assert!(
            (a[0] - 27.0).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-4,
            "{a:?} {b:?}"
        );
    }

    #[test]
    fn bins_about_multiples_hold_the_intensity_about_them() {
        let judge = Judge {
            recorded: Sphere {
                bin_deg: 2.5,
                polar: 72,
                ..SPHERE
            },
            read_bin_deg: 5.0,
            read_bins: Bins::About,
            centre_deg: 2.5,
            peak: Peak::Bin,
            ..JUDGE
        };
        // All bins together are the whole sphere, and an even intensity is even in them.
        let sphere = judge.sphere();
        assert_eq!(sphere.polar, 37);
        let whole: f64 = (0..sphere.polar).map(|i| sphere.ring_sr(i)).sum();
        assert!((whole - 4.0 * PI).abs() < 1e-12);
        let even = judge.seen(&powers_in(judge.recorded, |_| 3.0));
        assert!(even.iter().all(|i| (i - 3.0).abs() < 1e-7), "{even:?}");

        // Between 25 and 30 degrees the largest bin is that about the nearer of the two.
        for (peak, about) in [(27.0, 25.0), (28.0, 30.0), (1.0, 0.0)] {
            let f = |t: f64| (1.0 - ((t - peak) / 60.0).powi(2)).max(0.0);
            let powers = powers_in(judge.recorded, f);
            let figures = judge.figures(&twice(&powers));
            assert!((figures.peak_angle_deg.value - about).abs() < 1e-12);
            assert!(figures.peak_angle_deg.standard_error < 1e-12);
            // Mean over the cap below 2.5 degrees: θ = 5/3 degrees. Over 5 degrees the mean of a parabola lies w²/24 of its curvature lower.
            let bin = |t: f64| f(t) - 25.0 / 12.0 / 3600.0;
            let ratio = f(5.0 / 3.0)
                / if about > 0.0 {
                    bin(about)
                } else {
                    f(5.0 / 3.0)
                };
            assert!(
                (figures.centre_to_peak.value - ratio).abs() < 2e-3,
                "{figures:?} {ratio}"
            );
            let [angle, drawn] = judge.bin_by_bin(&powers);
            assert!((angle - about).abs() < 1e-12);
            assert!((drawn - figures.centre_to_peak.value).abs() < 1e-12);
            // The parabola through the same bins finds the peak between them, beside the axis a maximum on it.
            let between = Judge {
                peak: Peak::Parabola,
                peak_fit_deg: 10.0,
                ..judge
            }
            .plain(&powers);
            let vertex = if about > 0.0 { peak } else { 0.0 };
            assert!((between[0] - vertex).abs() < 0.1, "{between:?} {peak}");
        }
    }

    #[test]
    fn a_cut_has_its_own_peak_and_the_centre_of_all() {
        // Peak at 20° over most azimuths, at 40° and half as high in the bins about φ = 45°, 135°, 225°, 315°.
        let ridge =
            |t: f64, at: f64, high: f64| (high * (1.0 - ((t - at) / 15.0).powi(2))).max(0.1);
        let (most, few) = (
            powers(|t| ridge(t, 20.0, 1.0)),
            powers(|t| ridge(t, 40.0, 0.5)),
        );
        let mixed: Vec<f64> = (0..most.len())
            .map(|k| {
                if k % SPHERE.azimuths % 9 == 4 {
                    few[k]
                } else {
                    most[k]
                }
            })
            .collect();
        let cut = |cut_deg| Judge { cut_deg, ..JUDGE }.figures(&twice(&mixed));
        let (mean, along, across) = (cut(None), cut(Some(0.0)), cut(Some(45.0)));
        for (figures, angle, ratio) in [
            (mean, 20.0, 0.1 / (8.0 / 9.0 + 0.1 / 9.0)),
            (along, 20.0, 0.1),
            (across, 40.0, 0.2),
        ] {
            assert!(
                (figures.peak_angle_deg.value - angle).abs() < 0.1,
                "{figures:?}"
            );
            assert!(
                (figures.centre_to_peak.value - ratio).abs() < 2e-3,
                "{figures:?}"
            );
        }
    }
}
