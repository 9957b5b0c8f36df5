// SPDX-License-Identifier: MIT OR Apache-2.0
//! From numbers to pixels: linear and logarithmic scales with the ticks a reader expects.

/// Logarithmic axes shorter than this many decades label multiples of powers of ten too.
pub const DECADES_WITH_FACTORS: f64 = 2.6;
/// Labels below which a logarithmic axis takes the ticks of a linear one.
const MIN_LABELS: usize = 3;
/// Least labels of an axis, from which a reader tells its scale, and halvings of the step to find them.
const LEAST_LABELS: usize = 2;
const MAX_HALVINGS: usize = 4;
/// Most ticks of an axis; a step that rounding loses has more.
const MAX_TICKS: i64 = 1000;

/// Map from numbers to places along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisScale {
    /// Numbers at the start of the axis and at its end.
    pub ends: [f64; 2],
    /// True for equal distances of equal ratios, between positive ends; else of equal differences.
    pub is_log: bool,
}

/// A number on an axis, with its label where it has one.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Number at its place.
    pub at: f64,
    /// Label; `None` for a minor tick.
    pub label: Option<String>,
}

impl Tick {
    /// Length of its line, pixels.
    pub fn length(&self) -> f64 {
        if self.label.is_some() { 7.0 } else { 4.0 }
    }
}

impl AxisScale {
    /// Equal distances for equal differences.
    pub const fn linear(ends: [f64; 2]) -> Self {
        Self { ends, is_log: false }
    }

    /// Equal distances for equal ratios.
    pub const fn log(ends: [f64; 2]) -> Self {
        Self { ends, is_log: true }
    }

    /// The scale of the same numbers in another unit.
    #[must_use]
    pub fn divided(self, unit: f64) -> Self {
        Self { ends: self.ends.map(|end| end / unit), ..self }
    }

    /// Place of `number`: 0 at the start, 1 at the end. Numbers at or below zero lie far before a
    /// logarithmic axis.
    pub fn share(self, number: f64) -> f64 {
        let [low, high] = self.ends;
        if self.is_log && number > 0.0 {
            (number / low).ln() / (high / low).ln()
        } else if self.is_log {
            -10.0
        } else {
            (number - low) / (high - low)
        }
    }

    /// Ticks within the scale, about `count` of them labelled and no fewer than two; none of a scale
    /// without a length.
    pub fn ticks(self, count: usize) -> Vec<Tick> {
        let [low, high] = self.ends;
        let labelled = |ticks: &[Tick]| ticks.iter().filter(|tick| tick.label.is_some()).count();
        if self.is_log {
            let ticks = log_ticks(low, high, count);
            // A short range may hold no round factor of a power of ten.
            let is_short = high < 10.0 * low;
            if labelled(&ticks) >= if is_short { MIN_LABELS } else { LEAST_LABELS } {
                return ticks;
            }
        }
        let finer = (0..MAX_HALVINGS).map(|halvings| {
            let count = count.max(1) << halvings;
            every(low, high, round_step((high - low) / count as f64))
        });
        let mut finer = finer.filter(|ticks| labelled(ticks) >= LEAST_LABELS);
        finer.next().unwrap_or_default()
    }
}

/// Ticks at the multiples of `step` from `low` to `high`, labelled with as many decimals as the
/// step needs.
pub fn every(low: f64, high: f64, step: f64) -> Vec<Tick> {
    let first = (low / step - 1e-6).ceil() as i64;
    let last = (high / step + 1e-6).floor() as i64;
    let decimals = decimals_of(step);
    let last = if last.saturating_sub(first) < MAX_TICKS { last } else { first };
    (first..=last)
        .map(|index| {
            let at = index as f64 * step;
            Tick { at, label: Some(number_label(at, decimals)) }
        })
        .collect()
}

/// A number for people: a true minus sign, so many decimals, no negative zero.
pub fn number_label(number: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", number.abs());
    let zero = text.chars().all(|c| matches!(c, '0' | '.'));
    if number < 0.0 && !zero { format!("−{text}") } else { text }
}

/// A number to so many significant digits, with a power of ten where it is far from 1.
pub fn significant(number: f64, digits: usize) -> String {
    if number == 0.0 || !number.is_finite() {
        return number_label(number, 0);
    }
    let power = common_power(number);
    let text = rounded(number / 10f64.powi(power), digits);
    if power == 0 { text } else { format!("{text} × {}", power_of_ten(power)) }
}

/// A number to so many significant digits, without a power of ten.
pub fn rounded(number: f64, digits: usize) -> String {
    let whole = number.abs().max(f64::MIN_POSITIVE).log10().floor() as i64;
    let decimals = (digits as i64 - 1 - whole).clamp(0, 12) as usize;
    number_label(number, decimals)
}

/// `10⁻³` in superscript letters.
pub fn power_of_ten(exponent: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => {
            char::from_u32(u32::from('⁰') + u32::from(digit) - u32::from('0')).unwrap_or(digit)
        }
    };
    let exponent: String = exponent.to_string().chars().map(raised).collect();
    format!("10{exponent}")
}

/// Power of ten to take out of the labels of a linear axis up to `size`: 0 where plain numbers are
/// short enough.
pub fn common_power(size: f64) -> i32 {
    let size = size.abs();
    if size > 0.0 && size.is_finite() && !(0.2..20_000.0).contains(&size) {
        let power = size.log10().floor() as i32;
        // Thousands and thousandths are what units are made of.
        power.div_euclid(3) * 3
    } else {
        0
    }
}

/// The smallest and the largest of `values`.
pub fn ends(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    values.into_iter().fold(start, |[low, high], v| [low.min(v), high.max(v)])
}

/// The range of `values` with so much room at both ends, as a share of what they span.
pub fn ends_with_room(values: impl IntoIterator<Item = f64>, share: f64) -> [f64; 2] {
    let [low, high] = ends(values);
    let room = share * (high - low).max(1e-9);
    [low - room, high + room]
}

/// The next of 1, 2, 2.5 and 5 times a power of ten at or above `step`.
pub fn round_step(step: f64) -> f64 {
    if !(step.is_finite() && step > 0.0) {
        return 1.0;
    }
    let unit = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 2.5, 5.0, 10.0]
        .iter()
        .map(|factor| factor * unit)
        .find(|&candidate| candidate >= step * (1.0 - 1e-9))
        .unwrap_or(10.0 * unit)
}

fn decimals_of(step: f64) -> usize {
    (0..12)
        .find(|&decimals| {
            let scaled = step * 10f64.powi(decimals);
            (scaled - scaled.round()).abs() < 1e-6 * scaled.max(1.0)
        })
        .unwrap_or(12) as usize
}

fn log_ticks(low: f64, high: f64, count: usize) -> Vec<Tick> {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let decades = (high / low).log10();
    // With few decades labels between them help, with many only some powers of ten have room.
    let (labelled, stride): (&[u32], i32) = if decades < 0.9 {
        (&[1, 2, 3, 4, 5, 6, 8], 1)
    } else if decades < DECADES_WITH_FACTORS {
        (&[1, 2, 5], 1)
    } else {
        let stride = (decades / count.max(1) as f64).ceil().max(1.0);
        (&[1], stride as i32)
    };
    // One style along the axis: plain numbers where all of them are short, powers of ten otherwise.
    let plain = decades < DECADES_WITH_FACTORS || (low > 0.9e-3 && high < 1.1e4);
    let mut ticks = Vec::new();
    for power in first..=last {
        for factor in 1..10u32 {
            let at = f64::from(factor) * 10f64.powi(power);
            // Where not every power of ten has a label, ticks between them would only be grey.
            let between = factor > 1 && stride > 1;
            if between || at < low * (1.0 - 1e-9) || at > high * (1.0 + 1e-9) {
                continue;
            }
            let shown = labelled.contains(&factor) && (factor > 1 || power.rem_euclid(stride) == 0);
            let label = || {
                if plain { number_label(at, (-power).max(0) as usize) } else { power_of_ten(power) }
            };
            ticks.push(Tick { at, label: shown.then(label) });
        }
    }
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().filter_map(|tick| tick.label.as_deref()).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        let scale = AxisScale::linear([-0.03, 1.07]);
        assert_eq!(labels(&scale.ticks(5)), ["0.00", "0.25", "0.50", "0.75", "1.00"]);
        let scale = AxisScale::linear([0.0, 1.0]);
        assert_eq!(labels(&scale.ticks(5)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&every(-90.0, 90.0, 45.0)), ["−90", "−45", "0", "45", "90"]);
        // A step of the count asked for may have one multiple in the range.
        assert_eq!(labels(&AxisScale::linear([1.1, 2.9]).ticks(1)), ["1.5", "2.0", "2.5"]);
        assert_eq!(labels(&AxisScale::linear([0.93, 1.06]).ticks(2)), ["0.95", "1.00", "1.05"]);
        for ends in [[-1e308, 1e308], [f64::NAN, 1.0], [2.0, 2.0]] {
            assert!(AxisScale::linear(ends).ticks(5).len() < 3, "{ends:?}");
        }
    }

    #[test]
    fn shares_go_from_end_to_end() {
        let linear = AxisScale::linear([-1.0, 4.0]);
        let log = AxisScale::log([1e-3, 10.0]);
        for (scale, numbers) in [(linear, [-1.0, 0.5, 4.0]), (log, [1e-3, 1.584_893_192e-2, 10.0])]
        {
            for (number, share) in numbers.into_iter().zip([0.0, 0.3, 1.0]) {
                assert!((scale.share(number) - share).abs() < 1e-9, "{scale:?} {number}");
            }
        }
        assert!(log.share(0.0) < 0.0);
    }

    #[test]
    fn log_ticks_label_decades_and_mark_between() {
        let ticks = AxisScale::log([1e-5, 1.0]).ticks(6);
        assert_eq!(labels(&ticks), ["10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰"]);
        assert_eq!(ticks.len(), 46);
        let short = AxisScale::log([0.04, 0.9]).ticks(6);
        assert_eq!(labels(&short), ["0.05", "0.1", "0.2", "0.5"]);
        // A range without any of the usual factors.
        let narrow = AxisScale::log([11.5, 15.9]).ticks(6);
        assert_eq!(labels(&narrow), ["12", "13", "14", "15"]);
        let plain = AxisScale::log([1e-3, 1.0]).ticks(6);
        assert_eq!(labels(&plain), ["0.001", "0.01", "0.1", "1"]);
    }

    #[test]
    fn common_power_is_taken_out_of_long_labels_only() {
        assert_eq!(common_power(0.5), 0);
        assert_eq!(common_power(3.0e-3), -3);
        assert_eq!(common_power(0.08), -3);
        assert_eq!(common_power(7.0e5), 3);
        assert_eq!(common_power(0.0), 0);
        assert_eq!(power_of_ten(-12), "10⁻¹²");
        assert_eq!(significant(8.337e-3, 3), "8.34 × 10⁻³");
        assert_eq!(significant(42.3, 2), "42");
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(rounded(0.0143, 2), "0.014");
    }
}
