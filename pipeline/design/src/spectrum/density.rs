// SPDX-License-Identifier: MIT OR Apache-2.0
//! A continuous spectrum, weighted or not, as a density that is linear between closely spaced
//! wavelengths, and its quantiles.

use metrics::{colour_matching, photopic};

use super::SpectralPower;

/// Gaussians are cut off this many full widths from their peak: three standard deviations, beyond
/// which 0.27 % of the power would lie.
pub(super) const REACH_FWHM: f64 = 3.0 / FWHM;
/// Full width at half maximum of a Gaussian of standard deviation 1, 2 √(2 ln 2).
const FWHM: f64 = 2.354_820_045_030_949_3;
/// Widest step, nm, and most steps.
const STEP_NM: f64 = 1.0;
const MAX_STEPS: f64 = 20_000.0;
/// Steps to a full width of a Gaussian.
const STEPS_PER_WIDTH: f64 = 40.0;

/// A density over wavelengths, linear between its points.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Density {
    /// Wavelengths, ascending, nm.
    nm: Vec<f64>,
    /// Weighted power per nm at each.
    value: Vec<f64>,
    /// Integral from the first wavelength to each.
    below: Vec<f64>,
}

impl Density {
    /// The density of a checked source of kind white LED or table, times V(λ) if `photometric`.
    pub(super) fn new(source: &SpectralPower, photometric: bool) -> Self {
        let (nm, mut value) = points(source, photometric);
        if photometric {
            for (nm, value) in nm.iter().zip(&mut value) {
                *value *= photopic::v(*nm);
            }
        }
        Self::from_points(nm, value)
    }

    /// The density of wavelengths that stand for a source: the cube root of the mean of its weighted
    /// power, X, Y and Z, each by its integral. Between wavelengths h apart linear interpolation is
    /// off by h² f''/12, and a weight w makes ∫ w h² the least where 1/h goes as w to the power 1/3.
    pub(super) fn of_wavelengths(source: &SpectralPower, photometric: bool) -> Self {
        let (nm, power) = points(source, true);
        let of = |weight: &dyn Fn(f64) -> f64| {
            let value = nm.iter().zip(&power).map(|(nm, power)| power * weight(*nm)).collect();
            Self::from_points(nm.clone(), value)
        };
        let matching = |k: usize| of(&move |nm| colour_matching::xyz(nm)[k]);
        let seen = of(&|nm| if photometric { photopic::v(nm) } else { 1.0 });
        let parts = [seen, matching(0), matching(1), matching(2)];
        let parts = parts.iter().filter(|part| part.total() > 0.0);
        let mut mean = vec![0.0; nm.len()];
        for part in parts {
            let total = part.total();
            mean.iter_mut().zip(&part.value).for_each(|(sum, value)| *sum += value / total);
        }
        Self::from_points(nm, mean.into_iter().map(f64::cbrt).collect())
    }

    fn from_points(nm: Vec<f64>, value: Vec<f64>) -> Self {
        let mut below = vec![0.0];
        let mut sum = 0.0;
        for i in 1..nm.len() {
            sum += 0.5 * (value[i] + value[i - 1]) * (nm[i] - nm[i - 1]);
            below.push(sum);
        }
        Self { nm, value, below }
    }

    /// Integral over all wavelengths.
    pub(super) fn total(&self) -> f64 {
        self.below[self.below.len() - 1]
    }

    /// First and last wavelength with power, nm.
    pub(super) fn range_nm(&self) -> [f64; 2] {
        let total = self.total();
        let first = self.below.iter().rposition(|&b| b <= 0.0).unwrap_or(0);
        let last = self.below.partition_point(|&b| b < total);
        [self.nm[first], self.nm[last.min(self.nm.len() - 1)]]
    }

    /// The wavelength below which the share `u` of the integral lies, 0 < u < 1, nm.
    pub(super) fn quantile_nm(&self, u: f64) -> f64 {
        let wanted = u * self.total();
        let i = self.below.partition_point(|&b| b <= wanted).clamp(1, self.nm.len() - 1);
        let (step, rest) = (self.nm[i] - self.nm[i - 1], wanted - self.below[i - 1]);
        let (a, slope) = (self.value[i - 1], (self.value[i] - self.value[i - 1]) / step);
        // The root t of a t + slope t²/2 = rest in the form that does not cancel.
        let t = 2.0 * rest / (a + (a * a + 2.0 * slope * rest).max(0.0).sqrt());
        self.nm[i - 1] + if t.is_finite() { t.clamp(0.0, step) } else { 0.0 }
    }
}

/// Wavelengths and power per nm; of tables the rows, or `fine` steps in which a product with V(λ) is
/// linear.
fn points(source: &SpectralPower, fine: bool) -> (Vec<f64>, Vec<f64>) {
    match source {
        SpectralPower::WhiteLed(led) => white_led(&[
            Peak { nm: led.blue_nm, fwhm_nm: led.blue_fwhm_nm, part: led.blue_part },
            Peak { nm: led.phosphor_nm, fwhm_nm: led.phosphor_fwhm_nm, part: 1.0 - led.blue_part },
        ]),
        SpectralPower::Table { wavelength_nm, power }
        | SpectralPower::Lines { wavelength_nm, power } => table(wavelength_nm, power, fine),
    }
}

/// A Gaussian.
struct Peak {
    nm: f64,
    fwhm_nm: f64,
    part: f64,
}

impl Peak {
    fn range(&self) -> [f64; 2] {
        let reach = REACH_FWHM * self.fwhm_nm;
        [self.nm - reach, self.nm + reach]
    }

    /// Height of the Gaussian of height 1, 0 beyond its range.
    fn at(&self, nm: f64) -> f64 {
        let [low, high] = self.range();
        if (low..=high).contains(&nm) {
            (-0.5 * (FWHM * (nm - self.nm) / self.fwhm_nm).powi(2)).exp()
        } else {
            0.0
        }
    }
}

/// Two peaks; each integrates to its part.
fn white_led(peaks: &[Peak; 2]) -> (Vec<f64>, Vec<f64>) {
    let mut nm = Vec::new();
    for peak in peaks.iter().filter(|p| p.part > 0.0) {
        let [low, high] = peak.range();
        // The cut is a jump, which two points an eyelash apart hold.
        let outside = 1e-9 * (high - low);
        nm.extend([low - outside, high + outside]);
        let steps = (high - low) / (peak.fwhm_nm / STEPS_PER_WIDTH).min(STEP_NM);
        let steps = steps.clamp(1.0, MAX_STEPS).ceil();
        nm.extend((0..=steps as usize).map(|k| low + (high - low) * k as f64 / steps));
    }
    let nm = sorted(nm);
    let mut value = vec![0.0; nm.len()];
    for peak in peaks.iter().filter(|p| p.part > 0.0) {
        let shape: Vec<f64> = nm.iter().map(|&nm| peak.at(nm)).collect();
        let total = Density::from_points(nm.clone(), shape.clone()).total();
        for (sum, height) in value.iter_mut().zip(shape) {
            *sum += peak.part * height / total;
        }
    }
    (nm, value)
}

/// The rows; if `fine` with V's knots and steps between them.
fn table(wavelength_nm: &[f64], power: &[f64], fine: bool) -> (Vec<f64>, Vec<f64>) {
    let (first, last) = (wavelength_nm[0], wavelength_nm[wavelength_nm.len() - 1]);
    let mut nm = wavelength_nm.to_vec();
    if fine {
        nm.extend(colour_matching::knots_nm().filter(|k| (first..=last).contains(k)));
        let steps = ((last - first) / STEP_NM).clamp(1.0, MAX_STEPS).ceil();
        nm.extend((1..steps as usize).map(|k| first + (last - first) * k as f64 / steps));
    }
    let nm = sorted(nm);
    let at = |x: f64| {
        let i = wavelength_nm.partition_point(|&k| k < x).clamp(1, wavelength_nm.len() - 1);
        let share = (x - wavelength_nm[i - 1]) / (wavelength_nm[i] - wavelength_nm[i - 1]);
        power[i - 1] + (power[i] - power[i - 1]) * share
    };
    let value = nm.iter().map(|&x| at(x).max(0.0)).collect();
    (nm, value)
}

fn sorted(mut nm: Vec<f64>) -> Vec<f64> {
    nm.sort_by(f64::total_cmp);
    nm.dedup();
    nm
}
