// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures of a stored model by their keys in the registry, wherever `results.json` holds them.

use metrics::figures::{self, OF_SURFACE, receiver};
use metrics::photopic::LUMENS_PER_WATT;
use metrics::quantity::Unit;

use crate::figure_entry::FigureEntry;
use crate::schema::{AbsoluteFigure, Emitted, ModelEntry, ReceiverEntry};

impl ModelEntry {
    /// The figure under `key` of the registry with its unit: a main figure, one in absolute units,
    /// a share of the ledger or a figure of a receiver, whose flux is a share of what is emitted.
    pub fn figure(&self, key: &str) -> Option<(FigureEntry, Unit)> {
        if let Some(entry) = self.figures.get(key) {
            return Some((*entry, figures::find(key).map_or(Unit::Relative, |found| found.unit)));
        }
        if let Some(share) = self.power_ledger.account(key) {
            return Some((*share, Unit::Fraction));
        }
        let absolute = self.absolute.as_ref().and_then(|all| all.figures.get(key));
        if let Some(figure) = absolute {
            return Some((figure.array, figure.unit()));
        }
        let (figure, name) = key.split_once('.')?;
        let (entry, unit) = self.receivers.as_ref()?.get(name)?.figure(figure)?;
        if is_flux(figure) {
            Some((entry.times(1.0 / self.emitted(unit)), Unit::Fraction))
        } else {
            Some((*entry, unit))
        }
    }

    /// Flux that all sources emit, in lm or W; without a stated flux results are per watt.
    fn emitted(&self, unit: Unit) -> f64 {
        let of_light = self.spectrum.as_ref().map(|spectrum| spectrum.emitted);
        let emitted = of_light.or(self.absolute.as_ref().map(|absolute| absolute.emitted));
        let emitted = emitted.unwrap_or(Emitted { emitted_w: 1.0, emitted_lm: None });
        match unit {
            // Of converted light lumens are shares of those that all power would be at 555 nm.
            Unit::Lumen => emitted.emitted_lm.unwrap_or(emitted.emitted_w * LUMENS_PER_WATT),
            _ => emitted.emitted_w,
        }
    }
}

impl AbsoluteFigure {
    /// Unit of its values.
    pub fn unit(&self) -> Unit {
        Unit::from_name(&self.unit).unwrap_or(Unit::Relative)
    }
}

impl ReceiverEntry {
    /// A figure with its unit.
    pub fn figure(&self, key: &str) -> Option<(&FigureEntry, Unit)> {
        let known = figures::of_receivers().find(|known| known.key == key)?;
        let unit = match known.unit {
            // Files without `flux_unit` state fluxes of surfaces in the unit of their rows.
            _ if is_flux(key) => Unit::from_name(self.flux_unit.as_ref().unwrap_or(&self.unit))?,
            Unit::WattPerSquareMillimetre => Unit::from_name(&self.unit)?,
            unit => unit,
        };
        Some((self.figures.get(key)?, unit))
    }
}

/// True of figures of receivers that files hold as flux, and the registry as a share of the emitted.
fn is_flux(key: &str) -> bool {
    key == receiver::FLUX.key || OF_SURFACE.iter().any(|figure| figure.key == key)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::shown;

    #[test]
    fn every_figure_of_the_registry_is_found_with_its_unit() {
        let figure = |value: f64| json!({"value": value, "standard_error": 0.01 * value});
        let mut flux = figure(80.0);
        flux["unit"] = "lm".into();
        let model: ModelEntry = serde_json::from_value(json!({
            "uniformity": figure(0.5),
            "power_ledger": {"emitted": figure(1.0), "escaped_up": figure(0.8)},
            "counters": {}, "paths": 1, "units": {},
            "absolute": {
                "packages": 2,
                "emitted": {"emitted_w": 0.3, "emitted_lm": 100.0},
                "emitted_per_package": {"emitted_w": 0.15, "emitted_lm": 50.0},
                "figures": {"flux_up": flux},
            },
            "receivers": {"plate": {
                "kind": "luminance", "quantity": "luminance", "unit": "cd/m²", "flux_unit": "lm",
                "files": [], "flux": figure(70.0), "mean": figure(9000.0), "nine_points": figure(0.8),
            }},
        }))
        .expect("a model");
        for (key, words) in [
            ("uniformity", Some("50.00 ± 0.50 %")),
            ("escaped_up", Some("80.00 ± 0.80 %")),
            ("flux_up", Some("80.00 ± 0.80 lm")),
            ("flux.plate", Some("70.00 ± 0.70 %")),
            ("mean.plate", Some("9000 ± 90 cd/m²")),
            ("nine_points.plate", Some("80.00 ± 0.80 %")),
            ("min_to_max.plate", None),
            ("flux.floor", None),
            ("field_angle_deg", None),
        ] {
            let found = model.figure(key).map(|(entry, unit)| shown::text(&entry, unit));
            assert_eq!(found.as_deref(), words, "{key}");
        }
        let plate = json!({"kind": "plane", "quantity": "illuminance", "unit": "lx", "flux_unit": "lm",
            "files": [], "flux": figure(68.3), "mean": figure(9000.0)});
        let sheet = json!({"kind": "surface", "quantity": "radiant flux", "unit": "W", "files": [],
            "from_inside": figure(0.2), "from_inside_absorbed": figure(0.1)});
        let per_watt: ModelEntry = serde_json::from_value(json!({
            "power_ledger": {"emitted": figure(1.0)}, "counters": {}, "paths": 1, "units": {},
            "receivers": {"plate": plate, "sheet": sheet},
        }))
        .expect("a model");
        let (share, unit) = per_watt.figure("flux.plate").expect("a flux");
        assert_eq!(shown::text(&share, unit), "10.00 ± 0.10 %");
        let (share, unit) = per_watt.figure("from_inside.sheet").expect("a flux");
        assert_eq!(shown::text(&share, unit), "20.00 ± 0.20 %");
    }
}
