// SPDX-License-Identifier: MIT OR Apache-2.0
//! Flux, intensity and illuminance of a design that states what its LEDs emit.

use std::collections::BTreeMap;

use design::Design;
use metrics::quantity::Quantity;
use metrics::uniformity_forms::mean_over_cell;
use metrics::{Estimate, jackknife};
use results::schema::{AbsoluteEntry, AbsoluteFigure, Emitted};

use super::observation::{Observation, far_field_reading, layout};
use super::units::Units;

/// Figures in absolute units; `None` of a design whose results are per watt.
pub fn absolute(design: &Design, seen: &Observation, units: Units) -> Option<AbsoluteEntry> {
    let of_package = design.emitted?;
    let packages = design.array.axes_mm().len();
    let share = 1.0 / packages as f64;
    let flux = |packages: f64| Emitted {
        emitted_w: of_package.radiant_w * packages,
        emitted_lm: (of_package.luminous_lm > 0.0).then_some(of_package.luminous_lm * packages),
    };
    let mut figures = BTreeMap::new();
    let mut both = |key: &str, quantity: &Quantity, factor: f64, per_watt: Estimate| {
        figures.insert(
            key.to_owned(),
            AbsoluteFigure {
                unit: quantity.unit().symbol().to_owned(),
                array: times(per_watt, factor),
                per_package: Some(times(per_watt, factor * share)),
            },
        );
    };
    let ledger = seen.ledger();
    for (key, account) in [("flux_up", "escaped_up"), ("flux_down", "escaped_down")] {
        let escaped = ledger.account(account).filter(|share| share.value > 0.0);
        if let Some(escaped) = escaped {
            both(key, &units.flux(), units.per_flux(), escaped);
        }
    }
    let far = far_field_reading(design).figures(&seen.far_field);
    let (intensity, factor) = (units.intensity(), units.per_intensity());
    both("intensity_centre", &intensity, factor, far.centre_w_per_sr);
    both("intensity_peak", &intensity, factor, far.peak_w_per_sr);
    for (key, per_watt) in illuminances(design, seen) {
        figures.insert(
            key.to_owned(),
            AbsoluteFigure {
                unit: units.irradiance().unit().symbol().to_owned(),
                array: times(per_watt, units.per_irradiance()),
                per_package: None,
            },
        );
    }
    Some(AbsoluteEntry {
        packages,
        emitted: flux(packages as f64),
        emitted_per_package: flux(1.0),
        figures,
    })
}

/// Mean irradiance of the plane above the axes of the LEDs, and over the cell between them, W/mm²
/// for 1 W.
fn illuminances(design: &Design, seen: &Observation) -> Vec<(&'static str, Estimate)> {
    let (grid, layout) = (seen.grid, layout(design));
    let above = jackknife(&seen.illuminance, |map| {
        let axes = layout.axes_mm.iter();
        axes.map(|[x, y]| grid.at(map, *x, *y)).sum::<f64>() / layout.axes_mm.len() as f64
    });
    let mut all = vec![("illuminance_above_leds", above)];
    let total = seen.illuminance.total();
    if mean_over_cell(grid, &layout, total).is_some() {
        let mean = |map: &[f64]| mean_over_cell(grid, &layout, map).unwrap_or_default();
        all.push(("illuminance_cell_mean", jackknife(&seen.illuminance, mean)));
    }
    all
}

fn times(estimate: Estimate, factor: f64) -> Estimate {
    Estimate::new(estimate.value * factor, estimate.standard_error * factor)
}
