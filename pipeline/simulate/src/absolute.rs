// SPDX-License-Identifier: MIT OR Apache-2.0
//! Flux, intensity and illuminance of a design that states what its LEDs emit.

use design::Design;
use metrics::figures;
use metrics::quantity::Unit;
use results::Figure;
use results::schema::{AbsoluteEntry, AbsoluteFigure, Emitted};

use super::observation::Observation;

/// Figures in absolute units; `None` of a design whose results are per watt.
pub fn absolute(design: &Design, seen: &Observation) -> Option<AbsoluteEntry> {
    let of_package = design.emitted?;
    let packages = design.array.axes_mm().len();
    let flux = |packages: f64| Emitted {
        emitted_w: of_package.radiant_w * packages,
        emitted_lm: design.emitted_lm().map(|_| of_package.luminous_lm * packages),
    };
    let is_absolute = |key: &str| figures::find(key).is_some_and(|figure| figure.is_absolute);
    let all = seen.estimates(design, is_absolute).into_iter();
    // Nothing is said of flux that cannot be.
    let told = all.filter(|f| f.entry.value > 0.0 || f.entry.upper_bound.is_some());
    let figures = told.map(|Figure { key, unit, entry, .. }| {
        let of_all = [Unit::Lux, Unit::WattPerSquareMillimetre, Unit::CandelaPerKilolumen];
        let per_package = !of_all.contains(&unit);
        let figure = AbsoluteFigure {
            unit: unit.symbol().to_owned(),
            array: entry,
            per_package: per_package.then(|| entry.times(1.0 / packages as f64)),
        };
        (key.into_owned(), figure)
    });
    Some(AbsoluteEntry {
        packages,
        emitted: flux(packages as f64),
        emitted_per_package: flux(1.0),
        electrical_w: design.electrical_w(),
        figures: figures.collect(),
    })
}
