// SPDX-License-Identifier: MIT OR Apache-2.0
//! A figure for people: value and error, or what stands in their place.
//!
//! Terminal, tables and page take every figure from here, so that one figure has one state
//! everywhere: `75.31 ± 0.12`, `none (maximum on axis)`, `17.5 to 22.5`, `below 7.5e-7`.

use metrics::digits::{Digits, format_value_with_error, shortest, significant};
use metrics::figures::receiver::{FLUX, MEAN, WIDTH_U, WIDTH_V};
use metrics::figures::{
    self, BEAM_ANGLE, FIELD_ANGLE, OF_RECEIVER, OF_SURFACE, Source, colours_of_receiver,
};
use metrics::kinds::Weighting;
use metrics::quantity::Unit;
use metrics::{Bounds, Estimate};

use crate::figure_entry::FigureEntry;
use crate::schema::{Emitted, ReceiverEntry, SpectrumEntry};

/// Errors below this part of a value, or of the whole for a fraction, are rounding.
const ROUNDING: f64 = 1e-11;

/// Name of the figure under `key`, and the unit of its value in files that do not state it: none
/// where the light of the design decides.
pub fn named(key: &str) -> (String, Unit) {
    let Some(figure) = figures::find(key) else {
        // Probes of studies, and what a receiver has of the light, are shares.
        let is_share = ["share_", "receiver."].into_iter().any(|start| key.starts_with(start));
        let unit = if is_share { Unit::Fraction } else { Unit::Relative };
        return (key.replace('_', " "), unit);
    };
    let is_of_light = figure.is_absolute || figure.source == Source::Receiver;
    let unit = match figure.unit {
        unit if unit.is_percentage() || unit == Unit::Degree => unit,
        _ if is_of_light => Unit::Relative,
        unit => unit,
    };
    let name = match (figure.source, key.split_once('.')) {
        (source, Some((_, name))) if source.is_of_receiver() => {
            figure.of_receiver(name).label.into_owned()
        }
        (Source::Ledger, _) if !figure.is_absolute => key.replace('_', " "),
        _ => figure.heading.unwrap_or(figure.label).to_owned(),
    };
    (name, unit)
}

/// Factor from a stored value to the one shown, and the symbol of its unit.
pub fn shown_unit(unit: Unit) -> (f64, &'static str) {
    match unit {
        unit if unit.is_percentage() => (100.0, "%"),
        other => (1.0, other.symbol()),
    }
}

/// Words in place of a figure that its design has and cannot be read.
pub fn absent(key: &str) -> &'static str {
    if [BEAM_ANGLE.key, FIELD_ANGLE.key].contains(&key) {
        "none (the intensity does not fall so far)"
    } else if [WIDTH_U, WIDTH_V].iter().any(|figure| key.starts_with(&format!("{}.", figure.key))) {
        "none (the luminance does not fall so far)"
    } else {
        "cannot be read"
    }
}

/// Words in place of value and error, in the unit shown; `None` where the figure is resolved.
pub fn in_words(entry: &FigureEntry, unit: Unit) -> Option<String> {
    let (scale, _) = shown_unit(unit);
    let whole = whole(entry.value * scale, unit);
    if let Some(words) = entry.peak_place.words() {
        return Some(words.to_owned());
    }
    if let Some([low, high]) = entry.interval {
        let [low, high] = [low * scale, high * scale];
        if high - low > ROUNDING * whole {
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
        if error <= ROUNDING * whole(value, unit) {
            return shortest(value);
        }
        format_value_with_error(value, error)
    })
}

/// What rounding of a value in the unit shown is compared with.
fn whole(value: f64, unit: Unit) -> f64 {
    if unit.is_percentage() { shown_unit(unit).0 } else { value.abs() }
}

/// True of a change of a figure that is above rounding.
pub fn is_change(entry: &FigureEntry, change: Estimate, unit: Unit) -> bool {
    let (scale, _) = shown_unit(unit);
    let size = change.value.abs().max(change.standard_error) * scale;
    size > ROUNDING * whole(entry.value * scale, unit)
}

/// A value with its error. An error that is rounding is left out.
pub fn with_error(estimate: Estimate) -> String {
    let Estimate { value, standard_error, .. } = estimate;
    if standard_error <= ROUNDING * value.abs() {
        return shortest(value);
    }
    format_value_with_error(value, standard_error)
}

/// The figure with its unit, unless words stand for it that have none.
pub fn text(entry: &FigureEntry, unit: Unit) -> String {
    let number = number(entry, unit);
    match shown_unit(unit).1 {
        "" => number,
        _ if entry.peak_place.words().is_some() => number,
        symbol => format!("{number} {symbol}"),
    }
}

/// The figure of an estimate with its unit.
pub fn estimate(value: Estimate, unit: Unit) -> String {
    let entry = FigureEntry::new(value).in_range(unit);
    // An angle of 0 is one, not a sum of light that no path has reached.
    let upper_bound = entry.upper_bound.filter(|_| unit != Unit::Degree);
    text(&FigureEntry { upper_bound, ..entry }, unit)
}

/// Factor from a stored difference of two values to the one shown, and the symbol of its unit:
/// percentages differ by points.
pub fn unit_of_differences(unit: Unit) -> (f64, &'static str) {
    match unit {
        unit if unit.is_percentage() => (100.0, "points"),
        other => (1.0, other.symbol()),
    }
}

/// A difference of two values of a figure with its unit.
pub fn difference(value: Estimate, unit: Unit) -> String {
    let (factor, symbol) = unit_of_differences(unit);
    format!("{} {symbol}", with_error(value.times(factor))).trim_end().to_owned()
}

/// A difference that may be known between two ends alone.
pub fn difference_between(entry: &FigureEntry, unit: Unit) -> String {
    let (factor, symbol) = unit_of_differences(unit);
    let entry = entry.in_range_of_changes(unit);
    let number = number(&entry.times(factor), Unit::Relative);
    let has_words = symbol.is_empty() || entry.peak_place.words().is_some();
    if has_words { number } else { format!("{number} {symbol}") }
}

/// A spread of a figure, or an amount by which it misses a bound, to two digits with its unit.
pub fn spread(spread: f64, unit: Unit) -> String {
    let (factor, symbol) = unit_of_differences(unit);
    format!("{} {symbol}", significant(factor * spread)).trim_end().to_owned()
}

/// Bounds of a figure with their unit.
pub fn bounds(bounds: Bounds, unit: Unit) -> String {
    let (factor, symbol) = shown_unit(unit);
    let Bounds { at_least, at_most } = bounds;
    let [at_least, at_most] = [at_least, at_most].map(|bound| Some(scaled(bound?, factor)));
    format!("{} {symbol}", Bounds { at_least, at_most }.words()).trim_end().to_owned()
}

/// A sought value of a figure with its unit, and how far off it counts as met.
pub fn near(value: f64, within: f64, unit: Unit) -> String {
    let (factor, symbol) = unit_of_differences(unit);
    let within = shortest(scaled(within, factor));
    format!("near {} by {within} {symbol}", stated(value, unit)).trim_end().to_owned()
}

/// A stated value of a figure with its unit.
pub fn stated(value: f64, unit: Unit) -> String {
    let (factor, symbol) = shown_unit(unit);
    format!("{} {symbol}", shortest(scaled(value, factor))).trim_end().to_owned()
}

/// A stated number in the unit shown, without the rounding of the factor.
fn scaled(stated: f64, factor: f64) -> f64 {
    format!("{:.12e}", stated * factor).parse().unwrap_or(stated * factor)
}

/// Digits of a figure that stands as value and error.
pub fn digits(entry: &FigureEntry, unit: Unit) -> Option<Digits> {
    let (scale, _) = shown_unit(unit);
    let resolved = in_words(entry, unit).is_none();
    resolved.then(|| Digits::new(entry.value * scale, shown_error(entry) * scale))
}

/// The standard error with that of the wavelengths.
fn shown_error(entry: &FigureEntry) -> f64 {
    entry.with_added_errors().standard_error
}

/// Flux that sources emit, in lm of photometric light and else in W.
pub fn emitted(flux: &Emitted, spectrum: Option<&SpectrumEntry>) -> String {
    let is_photometric =
        spectrum.is_some_and(|spectrum| spectrum.light.weighting == Weighting::Photometric);
    match flux.emitted_lm.filter(|_| is_photometric) {
        Some(lumens) => format!("{} lm", shortest(lumens)),
        None => format!("{} W", shortest(flux.emitted_w)),
    }
}

/// Labels and values of the figures of a receiver: fluxes of a surface, or flux, mean and extremes,
/// colours; of a dark one the bounds of flux and mean.
pub fn of_receiver(receiver: &ReceiverEntry) -> impl Iterator<Item = (&'static str, String)> {
    let is_dark = receiver.figures.get(MEAN.key).is_some_and(|mean| mean.upper_bound.is_some());
    let shown =
        OF_RECEIVER.into_iter().filter(move |figure| !is_dark || [FLUX, MEAN].contains(figure));
    shown.chain(colours_of_receiver()).chain(OF_SURFACE).filter_map(|figure| {
        let (entry, unit) = receiver.figure(figure.key)?;
        Some((figure.label, text(entry, unit)))
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
    use serde_json::{Value, json};

    #[test]
    fn figures_have_their_names_and_units() {
        for (key, name, unit) in [
            ("illuminance_valley_to_peak", "illuminance valley / peak", Unit::Fraction),
            ("absorbed_by_floor", "absorbed by floor", Unit::Fraction),
            ("flux.plate", "plate, flux", Unit::Fraction),
            ("share_0_to_30_deg", "share 0 to 30 deg", Unit::Fraction),
            ("peak_angle_deg", "peak angle", Unit::Degree),
            // Lumens or watts, by the light.
            ("flux_up", "flux, up", Unit::Relative),
            ("mean.plate", "plate, mean", Unit::Relative),
            ("cct_k.plate", "plate, correlated colour temperature", Unit::Kelvin),
        ] {
            assert_eq!(named(key), (name.to_owned(), unit), "{key}");
        }
    }

    #[test]
    fn ends_and_changes_of_rounding_size_are_no_interval_and_no_change() {
        let exact = FigureEntry::new(Estimate::new(0.4348, 0.0));
        for (ends, words) in [
            ([0.4348, 0.4348 + 1e-16], "43.48"),
            ([0.4348, 0.4348 + 1e-13], "43.48"),
            ([0.43, 0.44], "43 to 44"),
        ] {
            let entry = FigureEntry { interval: Some(ends), ..exact };
            assert_eq!(number(&entry, Unit::Fraction), words);
        }
        let changes = [(0.0, 1.7e-15), (1e-3, 0.0), (0.0, 2e-4)];
        let changed = changes.map(|(a, b)| is_change(&exact, Estimate::new(a, b), Unit::Fraction));
        assert_eq!(changed, [false, true, true]);
    }

    #[test]
    fn differences_of_percentages_are_points() {
        let change = Estimate::new(-0.0125, 0.0012);
        assert_eq!(difference(change, Unit::Fraction), "-1.25 ± 0.12 points");
        assert_eq!(difference(change, Unit::Relative), "-0.0125 ± 0.0012");
        // No fraction changes by more than 1, and one that may change by that is not known at all.
        let changed = |value: f64, error: f64, interval| {
            let entry = FigureEntry::new(Estimate::new(value, error));
            difference_between(&FigureEntry { interval, ..entry }, Unit::Fraction)
        };
        let unknown = "not resolved (too few paths)";
        assert_eq!(changed(0.5, 3.0, Some([-9.0, 10.0])), unknown);
        assert_eq!(changed(0.0, 0.4, None), unknown);
        assert_eq!(changed(0.5, 0.1, Some([-0.2, 1.4])), "-20 to 100 points");
        assert_eq!(changed(0.5, 0.1, None), "50 ± 10 points");
    }

    #[test]
    fn bounds_stand_in_the_unit_shown() {
        let at_least = Bounds { at_least: Some(0.07), at_most: None };
        assert_eq!(bounds(at_least, Unit::Fraction), "at least 7 %");
        assert_eq!(bounds(at_least, Unit::Relative), "at least 0.07");
        assert_eq!(near(0.29, 0.03, Unit::Fraction), "near 29 % by 3 points");
        assert_eq!(near(20.0, 0.5, Unit::Degree), "near 20 ° by 0.5 °");
        assert_eq!(spread(0.00237, Unit::Fraction), "0.24 points");
    }

    #[test]
    fn surfaces_show_their_fluxes_and_others_their_figures() {
        let figure = |value: f64| json!({"value": value, "standard_error": 0.01 * value});
        let shown = |figures: Value| {
            let mut entry = json!({"kind": "surface", "quantity": "flux", "unit": "W", "flux_unit": "W", "files": []});
            entry
                .as_object_mut()
                .expect("an object")
                .extend(figures.as_object().expect("one").clone());
            let receiver: ReceiverEntry = serde_json::from_value(entry).expect("a receiver");
            of_receiver(&receiver)
                .map(|(label, value)| format!("{label} {value}"))
                .collect::<Vec<_>>()
        };
        let surface = json!({"from_inside": figure(2.0), "from_inside_passed": figure(1.0)});
        assert_eq!(
            shown(surface),
            ["from inside 2.000 ± 0.020 W", "from inside, passed 1.000 ± 0.010 W"]
        );
        assert_eq!(shown(json!({"flux": figure(3.0)})), ["flux 3.000 ± 0.030 W"]);
    }

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
        assert_eq!(estimate(noisy, Unit::Fraction), "0 to 100 %");
        // No share is above 1, whatever its error.
        let even = Estimate::between(0.92, 1.02, 0.01);
        assert_eq!(estimate(even, Unit::Fraction), "85 to 100 %");
        assert_eq!(estimate(Estimate::between(0.9, 1.3, 0.1), Unit::Ratio), "50 to 170 %");
        assert_eq!(estimate(even, Unit::Lux), "0.85 to 1.09 lx");
        // A ratio has no largest value: beside 0 its upper end says nothing.
        let open = Estimate::between(0.0, 5e4, 1.0);
        assert_eq!(estimate(open, Unit::Ratio), "not resolved (too few paths)");
        assert_eq!(estimate(Estimate::new(0.0, 3.0), Unit::Ratio), "not resolved (too few paths)");
        assert_eq!(estimate(Estimate::new(0.0, 3.0), Unit::Fraction), "below 100 %");
        assert_eq!(estimate(Estimate::new(0.0, 2.0), Unit::Degree), "0.0 ± 2.0 °");
        let axial = FigureEntry { peak_place: PeakPlace::OnAxis, ..bin };
        assert_eq!(of(axial, Unit::Degree), "none (maximum on axis)");
        assert_eq!(of(plain(0.0, 2.5e-7), Unit::Watt), "below 7.5e-7 W");
        assert_eq!(of(plain(0.0, 1.0 / 30_000.0), Unit::Fraction), "below 0.01 %");
        assert_eq!(of(plain(0.0, 0.0), Unit::Fraction), "0 %");
        assert_eq!(of(plain(0.0041, 0.0002), Unit::Relative), "0.00410 ± 0.00020");
        assert!(digits(&bin, Unit::Degree).is_none());
    }
}
