// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scattering of media, checked.

use std::sync::Arc;

use tracer::{PhaseFunction, PhaseTable};

use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::scattering::{Spectral, StatedPhase, StatedScattering};
use crate::schema::{ByWavelength, Silicone};

/// Highest scattering coefficient, 1/mm.
const MAX_PER_MM: f64 = 1e5;
/// Range of a refractive index.
const INDICES: [f64; 2] = [0.1, 10.0];

/// Scattering of the medium of the table `table`: by one of the ways to state it.
pub(super) fn resolve(
    table: &str,
    raw: &Silicone,
    at: &Context,
) -> Result<Option<StatedScattering>, ConfigError> {
    let key = |name: &str| format!("{table}.{name}");
    let given = |name: &str, expected: &str| Err(at.value(&key(name), "given", expected));
    if let Some(particles) = &raw.particles {
        for (name, is_given) in [
            ("scattering_per_mm", raw.scattering_per_mm.is_some()),
            ("g", raw.g.is_some()),
            ("phase_table", raw.phase_table.is_some()),
        ] {
            if is_given {
                return given(name, "no such key beside `particles`, from which it follows");
            }
        }
        let of = |name: &str| key(&format!("particles.{name}"));
        let diameter_um = at.within(&of("diameter_um"), particles.diameter_um, 1e-3, 100.0)?;
        let index = Spectral::new(of("index"), &particles.index, INDICES, at)?;
        let volume_fraction =
            at.within(&of("volume_fraction"), particles.volume_fraction, 0.0, 1.0)?;
        let key = key("particles");
        return Ok(Some(StatedScattering::Spheres { key, diameter_um, index, volume_fraction }));
    }
    let Some(per_mm) = &raw.scattering_per_mm else {
        for (name, is_given) in [("g", raw.g.is_some()), ("phase_table", raw.phase_table.is_some())]
        {
            if is_given {
                return given(name, "no such key without `scattering_per_mm`");
            }
        }
        return Ok(None);
    };
    let per_mm = Spectral::new(key("scattering_per_mm"), per_mm, [0.0, MAX_PER_MM], at)?;
    let phase = match (&raw.g, &raw.phase_table) {
        (Some(_), Some(_)) => return given("phase_table", "no such key beside `g`"),
        (None, Some(rows)) => {
            let rows: Vec<[f64; 2]> = rows.iter().map(|row| row.0).collect();
            let (angles, values): (Vec<f64>, Vec<f64>) =
                rows.iter().map(|[angle, value]| (*angle, *value)).unzip();
            let phase = PhaseTable::new(&angles, &values).map_err(|error| {
                at.value(&key("phase_table"), format!("{} rows", rows.len()), &error.to_string())
            })?;
            StatedPhase::Table(rows, PhaseFunction::Table(Arc::new(phase)))
        }
        (g, None) => {
            let isotropic = ByWavelength::default();
            let g = g.as_ref().unwrap_or(&isotropic);
            StatedPhase::G(Spectral::new(key("g"), g, [-1.0, 1.0], at)?)
        }
    };
    Ok(Some(StatedScattering::Coefficient { per_mm, phase }))
}
