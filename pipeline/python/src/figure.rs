// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures for people, as the terminal shows them.

use pyo3::prelude::*;

use metrics::Estimate;
use metrics::far_field::PeakPlace;
use metrics::quantity::Unit;
use results::figure_entry::FigureEntry;
use results::shown;

/// Symbol of a unit of a file, which names it by suffix; the unit itself where none is known.
#[pyfunction]
pub fn unit_symbol(unit: &str) -> &str {
    Unit::from_name(unit).map_or(unit, |known| known.symbol())
}

/// The figure `key`, or a difference of two such figures, with the unit that JSON files give it, as
/// the terminal shows it.
#[pyfunction]
#[pyo3(signature = (value, standard_error, key, unit, interval, upper_bound, peak_place, is_difference=false))]
#[expect(clippy::too_many_arguments, reason = "the fields of a figure of Python")]
pub fn shown_figure(
    value: f64,
    standard_error: f64,
    key: &str,
    unit: &str,
    interval: Option<[f64; 2]>,
    upper_bound: Option<f64>,
    peak_place: Option<&str>,
    is_difference: bool,
) -> String {
    let peak_place = match peak_place {
        Some("on_axis") => PeakPlace::OnAxis,
        Some("not_resolved") => PeakPlace::NotResolved,
        _ => PeakPlace::OffAxis,
    };
    let entry = FigureEntry {
        interval,
        upper_bound,
        peak_place,
        ..FigureEntry::new(Estimate::new(value, standard_error))
    };
    let text = if is_difference { shown::difference_between } else { shown::text };
    match unit {
        "W/W" | "lm/lm" => text(&entry, Unit::Fraction),
        "1" => text(&entry, shown::named(key).1),
        _ => match Unit::from_name(unit) {
            Some(known) => text(&entry, known),
            None => format!("{} {unit}", shown::number(&entry, Unit::Relative)),
        },
    }
}
