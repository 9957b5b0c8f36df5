// SPDX-License-Identifier: MIT OR Apache-2.0
//! Luminescent substances of media, checked; and what a design that has some must be.

use std::path::Path;
use std::sync::Mutex;

use super::light;
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::Design;
use crate::resolved::luminescence::StatedLuminophore;
use crate::resolved::scattering::Spectral;
use crate::resolved::solids::CheckedSolid;
use crate::schema;
use crate::schema::light::SpectrumRows;
use crate::schema::luminescence::{Emission, Luminophore};
use crate::spectrum::lights::Colour;
use crate::spectrum::{Sampling, SpectralPower, Spectrum, SpectrumError, WAVELENGTHS_NM};
use metrics::kinds::Weighting;

/// Points of a Gaussian.
const POINTS: usize = 121;
/// Standard deviations at which it is cut off.
const REACH: f64 = 3.0;
/// Widths of use of a peak, nm.
const WIDTHS_NM: [f64; 2] = [1.0, 1000.0];
/// Most wavelengths of a trace.
const MAX_WAVELENGTHS: usize = 256;

/// Substances of the medium of the table `table`.
pub(super) fn resolve(
    table: &str,
    raw: &[Luminophore],
    folder: &Path,
    at: &Context,
) -> Result<Vec<StatedLuminophore>, ConfigError> {
    let mut all: Vec<StatedLuminophore> = Vec::new();
    for (number, one) in raw.iter().enumerate() {
        let key = |name: &str| format!("{table}.luminophores[{}].{name}", number + 1);
        at.file_name(&key("name"), &one.name)?;
        if all.iter().any(|known| known.name == one.name) {
            let expected = "a name that no other luminophore of the medium has";
            return Err(at.value(&key("name"), format!("{:?}", one.name), expected));
        }
        let absorption = key("absorption_per_mm");
        let quantum_yield = key("quantum_yield");
        all.push(StatedLuminophore {
            name: one.name.clone(),
            absorption_per_mm: Spectral::new(absorption, &one.absorption_per_mm, [0.0, 1e6], at)?,
            quantum_yield: Spectral::new(quantum_yield, &one.quantum_yield, [0.0, 1.0], at)?,
            emission: emission(&one.emission, &key("emission"), folder, at)?,
            stokes_only: one.stokes_only,
            emitted: Mutex::default(),
        });
    }
    Ok(all)
}

fn emission(
    raw: &Emission,
    table: &str,
    folder: &Path,
    at: &Context,
) -> Result<Spectrum, ConfigError> {
    let key = |name: &str| format!("{table}.{name}");
    let has_rows = raw.wavelength_nm.is_some() || raw.power.is_some() || raw.file.is_some();
    let source = match (raw.peak_nm, raw.fwhm_nm) {
        (Some(peak_nm), Some(fwhm_nm)) if !has_rows => {
            at.within(&key("fwhm_nm"), fwhm_nm, WIDTHS_NM[0], WIDTHS_NM[1])?;
            let deviation_nm = fwhm_nm / (8.0 * 2f64.ln()).sqrt();
            let reach_nm = REACH * deviation_nm;
            let [low, high] = WAVELENGTHS_NM;
            at.within(&key("peak_nm"), peak_nm, low + reach_nm, high - reach_nm)?;
            let place = |k: usize| 2.0 * k as f64 / (POINTS - 1) as f64 - 1.0;
            let places: Vec<f64> = (0..POINTS).map(place).collect();
            let height = |t: &f64| (-0.5 * (REACH * t).powi(2)).exp();
            SpectralPower::Table {
                wavelength_nm: places.iter().map(|t| peak_nm + reach_nm * t).collect(),
                power: places.iter().map(height).collect(),
            }
        }
        (None, None) if has_rows => {
            let rows = SpectrumRows {
                wavelength_nm: raw.wavelength_nm.clone(),
                power: raw.power.clone(),
                file: raw.file.clone(),
            };
            let [wavelength_nm, power] = light::rows(&rows, table, folder, at)?;
            SpectralPower::Table { wavelength_nm, power }
        }
        _ => {
            let expected = "`peak_nm` and `fwhm_nm`, or `wavelength_nm` and `power`, or `file`";
            return Err(at.value(table, "other keys", expected));
        }
    };
    let refuse = |error: SpectrumError| light::of_rows(error, (table, raw.file.as_ref()), at);
    // It is shared among the wavelengths of the trace.
    let sampling = Some(Sampling::Samples(1));
    Spectrum::new(source, Weighting::Radiometric, sampling).map_err(refuse)
}

/// A design that converts light states a spectrum for all of its sources, has data for its media
/// over all wavelengths, and light that its luminophores absorb.
pub(super) fn check(
    design: &Design,
    raw: &schema::Design,
    at: &Context,
) -> Result<(), ConfigError> {
    let keys = raw.light.spectrum.as_ref().map(|spectrum| &spectrum.shared);
    let samples = keys.and_then(|keys| keys.samples.map(|samples| ("samples", samples as f64)));
    let tolerance = keys.and_then(|keys| Some(("tolerance", keys.tolerance?)));
    match (design.converts(), raw.light.step_nm, samples.or(tolerance)) {
        (false, Some(step_nm), _) => {
            let expected = "no such key but where a medium has luminophores";
            return Err(at.value("light.step_nm", step_nm, expected));
        }
        (false, None, _) => return Ok(()),
        (true, _, Some((name, value))) => {
            let expected = "no such key where a medium converts light: all of its wavelengths are \
                traced together, light.step_nm apart";
            return Err(at.value(&format!("light.spectrum.{name}"), value, expected));
        }
        (true, _, None) => {}
    }
    if design.trace.ledger_by_source {
        let expected = "false where a medium converts light: it has no ledger by source";
        return Err(at.value("trace.ledger_by_source", true, expected));
    }
    if let Some(lumens) = raw.led.shared.power_lm {
        let expected = "led.power_w where a medium converts light: lumens that leave are no share \
            of those of the source";
        return Err(at.value("led.power_lm", lumens, expected));
    }
    let lights = design.lights.iter().flat_map(|lights| &lights.lights);
    for light in lights {
        if let Colour::Rays(_) = light.light {
            let expected = "`light = \"design\"` where a medium converts light: the wavelengths of \
                single rays are not followed";
            return Err(at.value("sources", light.sources.join(", "), expected));
        }
    }
    let nodes = design.traced_nm();
    if nodes.len() > MAX_WAVELENGTHS {
        let expected = format!("a step that leaves at most {MAX_WAVELENGTHS} wavelengths");
        let got = format!("{} nm, {} wavelengths", design.step_nm, nodes.len());
        return Err(at.value("light.step_nm", got, &expected));
    }
    for number in 0..nodes.len() {
        design.converting_at(&nodes, number)?;
    }
    let excited = design.excited(&nodes);
    for (number, (luminophore, first)) in excited.iter().enumerate() {
        let key = &luminophore.absorption_per_mm.key;
        let Some(first) = *first else {
            let [from, to] = [nodes[0], nodes[nodes.len() - 1]];
            let expected = format!(
                "absorption where there is light, of the sources or of other luminophores, within \
                 {from} to {to} nm"
            );
            return Err(at.value(key, "none where there is light", &expected));
        };
        if luminophore.photons(&nodes, first).iter().all(|photons| *photons <= 0.0) {
            let expected = "emission at waves longer than those absorbed, or no `stokes_only`";
            return Err(at.value(key, "absorption at longer waves than its emission", expected));
        }
        let name = &luminophore.name;
        if excited[..number].iter().any(|(other, _)| other.name == *name) {
            let expected = "luminophores with a name of their own in the whole design";
            return Err(at.value(key, format!("another luminophore {name:?}"), expected));
        }
        let mut solids = design.solids.iter().map(CheckedSolid::name);
        if let Some(solid) = solids.find(|solid| solid.starts_with(&format!("{name}_"))) {
            let expected = "a solid or film with another name, which does not begin with that of a \
                luminophore: the ledger could not tell their accounts apart";
            return Err(at.value("name", format!("{solid:?}"), expected));
        }
    }
    Ok(())
}

/// Rings of a design that converts light are solved at wavelengths of its light, for one index.
pub(super) fn check_tables(design: &Design, at: &Context) -> Result<(), ConfigError> {
    let stated = design.hybrid.tables_nm.as_deref();
    if !design.converts() {
        return stated.map_or(Ok(()), |_| {
            let expected = "no such key but where a medium has luminophores";
            Err(at.value("hybrid.tables_nm", "given", expected))
        });
    }
    if let (true, Some(material)) = (design.has_relief(), &design.silicone.stated.material) {
        let expected = "`index` for relief with tables where a medium converts light: a table holds \
            for one index";
        return Err(at.value("silicone.material_file", &material.file, expected));
    }
    let nodes = design.traced_nm();
    let [first, last] = [nodes[0], nodes[nodes.len() - 1]];
    let mut before = 0.0;
    for nm in stated.unwrap_or_default() {
        if !(first..=last).contains(nm) || *nm <= before {
            let expected = format!("ascending wavelengths of the light, {first} to {last} nm");
            return Err(at.value("hybrid.tables_nm", nm, &expected));
        }
        before = *nm;
    }
    if stated.is_some_and(<[f64]>::is_empty) {
        return Err(at.value("hybrid.tables_nm", "[]", "at least one wavelength"));
    }
    let mut tables = design.tables_nm().into_iter();
    tables.try_for_each(|nm| design.tuned(nm)?.check_tables(at))
}
