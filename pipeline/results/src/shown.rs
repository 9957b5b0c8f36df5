// SPDX-License-Identifier: MIT OR Apache-2.0
//! A figure for people: value and error, or what stands in their place.
//!
//! Terminal, tables and page take every figure from here, so that one figure has one state
//! everywhere: `75.31 ± 0.12`, `none (maximum on axis)`, `17.5 to 22.5`, `below 7.5e-7`.

use metrics::Estimate;
use metrics::digits::{Digits, format_value_with_error, shortest};
use metrics::figures::OF_RECEIVER;
use metrics::quantity::Unit;

use crate::figure_entry::FigureEntry;
use crate::schema::ReceiverEntry;

/// Errors below this part of a value, or of the whole for a fraction, are rounding.
const ROUNDING: f64 = 1e-11;

/// Factor from a stored value to the one shown, and the symbol of its unit.
pub fn shown_unit(unit: Unit) -> (f64, &'static str) {
    match unit {
        Unit::Fraction => (100.0, "%"),
        other => (1.0, other.symbol()),
    }
}

/// Words in place of value and error, in the unit shown; `None` where the figure is resolved.
pub fn in_words(entry: &FigureEntry, unit: Unit) -> Option<String> {
    let (scale, _) = shown_unit(unit);
    if let Some(words) = entry.peak_place.words() {
        return Some(words.to_owned());
    }
    if let Some([low, high]) = entry.interval {
        let [low, high] = [low * scale, high * scale];
        if low < high {
            let step = 10f64.powi((high - low).log10().floor() as i32 - 1);
            let (low, high) = (rounded(low, step, f64::floor), rounded(high, step, f64::ceil));
            return Some(format!("{} to {}", shortest(low), shortest(high)));
        }
    }
    entry.upper_bound.map(|bound| format!("below {}", two_digits(bound * scale)))
}

/// The figure without its unit. An error that is rounding is left out.
pub fn number(entry: &FigureEntry, unit: Unit) -> String {
    in_words(entry, unit).unwrap_or_else(|| {
        let (scale, _) = shown_unit(unit);
        let (value, error) = (entry.value * scale, shown_error(entry) * scale);
        let whole = if unit == Unit::Fraction { scale } else { value.abs() };
        if error <= ROUNDING * whole {
            return shortest(value);
        }
        format_value_with_error(value, error)
    })
}

/// A value with its error. An error that is rounding is left out.
pub fn with_error(estimate: Estimate) -> String {
    let Estimate { value, standard_error, .. } = estimate;
    if standard_error <= ROUNDING * value.abs() {
        return shortest(value);
    }
    format_value_with_error(value, standard_error)
}

/// The figure with its unit.
pub fn text(entry: &FigureEntry, unit: Unit) -> String {
    with_symbol(number(entry, unit), entry, shown_unit(unit).1)
}

/// `number` of `entry` with the symbol of its unit, unless words stand for it that have none.
pub fn with_symbol(number: String, entry: &FigureEntry, symbol: &str) -> String {
    match symbol {
        "" => number,
        _ if entry.peak_place.words().is_some() => number,
        symbol => format!("{number} {symbol}"),
    }
}

/// Digits of a figure that stands as value and error.
pub fn digits(entry: &FigureEntry, unit: Unit) -> Option<Digits> {
    let (scale, _) = shown_unit(unit);
    let resolved = in_words(entry, unit).is_none();
    resolved.then(|| Digits::new(entry.value * scale, shown_error(entry) * scale))
}

/// The standard error with that of the wavelengths.
fn shown_error(entry: &FigureEntry) -> f64 {
    entry.with_wavelengths().standard_error
}

/// Labels and values of the figures of a receiver: flux, mean and extremes; of a dark one the bounds
/// of flux and mean.
pub fn of_receiver(receiver: &ReceiverEntry) -> impl Iterator<Item = (&'static str, String)> {
    let is_dark = receiver.figures.get("mean").is_some_and(|mean| mean.upper_bound.is_some());
    let shown = OF_RECEIVER.into_iter().take(if is_dark { 2 } else { OF_RECEIVER.len() });
    shown.filter_map(|figure| {
        let entry = receiver.figures.get(figure.key)?;
        let absolute = |unit: &str| with_symbol(number(entry, Unit::Relative), entry, unit);
        let value = match (figure.key, figure.unit) {
            ("flux", _) => absolute(receiver.flux_unit.as_deref()?),
            (_, Unit::Fraction) => text(entry, Unit::Fraction),
            _ => absolute(&receiver.unit),
        };
        Some((figure.label, value))
    })
}

/// `value` as a multiple of `step`, a power of ten, to which `whole` rounds it, in as few digits as
/// that takes. Rounding errors of `value` do not count.
fn rounded(value: f64, step: f64, whole: fn(f64) -> f64) -> f64 {
    let steps = value / step;
    let steps = if (steps - steps.round()).abs() < 1e-6 { steps.round() } else { whole(steps) };
    if step < 1.0 { steps / (1.0 / step).round() } else { steps * step }
}

/// A bound to two digits, rounded up.
fn two_digits(bound: f64) -> String {
    let unit = 10f64.powi(bound.log10().floor() as i32 - 1);
    let rounded = (bound / unit - 1e-9).ceil() * unit;
    if (1e-3..1e6).contains(&rounded) { shortest(rounded) } else { format!("{rounded:.1e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    use metrics::far_field::PeakPlace;

    #[test]
    fn every_state_has_its_words() {
        let plain = |value: f64, error: f64| FigureEntry::new(Estimate::new(value, error));
        let of = |entry: FigureEntry, unit: Unit| text(&entry, unit);
        assert_eq!(of(plain(0.7531, 0.0012), Unit::Fraction), "75.31 ± 0.12 %");
        assert_eq!(of(plain(0.75, 1e-17), Unit::Fraction), "75 %");
        assert_eq!(of(plain(20.1, 0.3), Unit::Degree), "20.10 ± 0.30 °");
        let bin = FigureEntry { interval: Some([17.5, 22.5]), ..plain(20.0, 0.0) };
        assert_eq!(of(bin, Unit::Degree), "17.5 to 22.5 °");
        let noisy = Estimate::between(0.0, 0.873, 0.05);
        assert_eq!(of(FigureEntry::new(noisy).at_most(1.0), Unit::Fraction), "0 to 98 %");
        let axial = FigureEntry { peak_place: PeakPlace::OnAxis, ..bin };
        assert_eq!(of(axial, Unit::Degree), "none (maximum on axis)");
        assert_eq!(of(plain(0.0, 2.5e-7), Unit::Watt), "below 7.5e-7 W");
        assert_eq!(of(plain(0.0, 1.0 / 30_000.0), Unit::Fraction), "below 0.01 %");
        assert_eq!(of(plain(0.0, 0.0), Unit::Fraction), "0 %");
        assert_eq!(of(plain(0.0041, 0.0002), Unit::Relative), "0.00410 ± 0.00020");
        assert!(digits(&bin, Unit::Degree).is_none());
    }
}
