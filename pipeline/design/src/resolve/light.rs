// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[light]`, checked: one wavelength or a spectrum.

use std::path::Path;

use metrics::columns;
use runtime::bounded_text::{MAX_ROWS, bounded_text};

use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::Design;
use crate::schema;
use crate::schema::light::{SpectrumForm, SpectrumKeys, SpectrumRows};
use crate::spectrum::{Sampling, SpectralPower, Spectrum, SpectrumError, WAVELENGTHS_NM};
use metrics::kinds::Weighting;

/// Change from one number of wavelengths to the next where the design says nothing: half a point.
const USUAL_TOLERANCE: f64 = 5e-3;

/// The light of a design.
pub(crate) struct ResolvedLight {
    /// The wavelength, or the one that stands for the spectrum, nm.
    pub(crate) wavelength_nm: f64,
    /// The spectrum, if there is one.
    pub(crate) spectrum: Option<Spectrum>,
    /// True if converted light is counted in lumens; the spectrum is radiometric then.
    pub(crate) converts_in_lumens: bool,
}

impl ResolvedLight {
    /// Weighting of figures.
    pub(crate) fn weighting(&self) -> Weighting {
        let spectrum = self.spectrum.as_ref();
        spectrum.map_or(Weighting::Radiometric, |s| s.weighting)
    }

    /// It as a spectrum, of one line where it is a wavelength.
    pub(crate) fn whole(&self, at: &Context) -> Result<Spectrum, ConfigError> {
        match &self.spectrum {
            Some(spectrum) => Ok(spectrum.clone()),
            None => line(self.wavelength_nm, self.weighting(), "light.wavelength_nm", at),
        }
    }
}

pub(crate) fn resolve(
    design: &schema::Design,
    folder: &Path,
    at: &Context,
) -> Result<ResolvedLight, ConfigError> {
    let raw = &design.light;
    // Who states lumens asks for lumens, unless the design says otherwise.
    let in_lumens = design.led.shared.power_lm.is_some();
    let usual = in_lumens.then_some(Weighting::Photometric);
    // Light is converted watt by watt, whatever is counted at the end.
    let converts = design.converts();
    let traced = |weighting: Weighting| if converts { Weighting::Radiometric } else { weighting };
    let counted = |weighting: Weighting| converts && weighting == Weighting::Photometric;
    match (raw.wavelength_nm, &raw.spectrum) {
        (Some(wavelength_nm), None) => {
            let key = "light.wavelength_nm";
            at.within(key, wavelength_nm, WAVELENGTHS_NM[0], WAVELENGTHS_NM[1])?;
            // Lumens of one wavelength are those of a spectrum of one line.
            let weighting = raw.weighting.or(usual).unwrap_or(Weighting::Radiometric);
            let photometric = traced(weighting) == Weighting::Photometric;
            let line = photometric.then(|| line(wavelength_nm, Weighting::Photometric, key, at));
            let converts_in_lumens = counted(weighting);
            Ok(ResolvedLight { wavelength_nm, spectrum: line.transpose()?, converts_in_lumens })
        }
        (None, Some(spectrum)) => {
            if raw.weighting.is_some() {
                let expected = "no such key beside [light.spectrum], which states it";
                return Err(at.value("light.weighting", "given", expected));
            }
            let key = "light.spectrum";
            let weighting = spectrum.shared.weighting.or(usual).ok_or_else(|| {
                let expected = "\"radiometric\" or \"photometric\"";
                at.value("light.spectrum.weighting", "missing", expected)
            })?;
            let spectrum = resolve_spectrum(spectrum, (key, traced(weighting)), folder, at)?;
            Ok(ResolvedLight {
                wavelength_nm: spectrum.median_nm(),
                spectrum: Some(spectrum),
                converts_in_lumens: counted(weighting),
            })
        }
        (both, _) => Err(at.value(
            "light",
            if both.is_some() { "both" } else { "neither" },
            "one of `wavelength_nm` and `[light.spectrum]`",
        )),
    }
}

/// ResolvedLight of one wavelength, from `key`.
pub(crate) fn line(
    wavelength_nm: f64,
    weighting: Weighting,
    key: &str,
    at: &Context,
) -> Result<Spectrum, ConfigError> {
    let refuse = |error: SpectrumError| at.value(key, wavelength_nm, &error.expected);
    Spectrum::line(wavelength_nm, weighting).map_err(refuse)
}

/// Checks the spectrum of the table `table`.
pub(crate) fn resolve_spectrum(
    raw: &schema::Spectrum,
    (table, weighting): (&str, Weighting),
    folder: &Path,
    at: &Context,
) -> Result<Spectrum, ConfigError> {
    let file = match &raw.kind {
        SpectrumForm::WhiteLed(_) => None,
        SpectrumForm::Table(rows) | SpectrumForm::Lines(rows) => rows.file.as_ref(),
    };
    let source = match &raw.kind {
        SpectrumForm::WhiteLed(led) => SpectralPower::WhiteLed(led.clone()),
        SpectrumForm::Table(stated) => {
            let [wavelength_nm, power] = rows(stated, table, folder, at)?;
            SpectralPower::Table { wavelength_nm, power }
        }
        SpectrumForm::Lines(stated) => {
            let [wavelength_nm, power] = rows(stated, table, folder, at)?;
            SpectralPower::Lines { wavelength_nm, power }
        }
    };
    let SpectrumKeys { tolerance, samples, .. } = raw.shared;
    let sampling = sampling(tolerance, samples, &format!("{table}."), at)?;
    // Lines are all computed.
    let is_stated = tolerance.is_some() || samples.is_some();
    let is_sampled = is_stated || !matches!(raw.kind, SpectrumForm::Lines(_));
    let refuse = |error: SpectrumError| of_rows(error, (table, file), at);
    Spectrum::new(source, weighting, is_sampled.then_some(sampling)).map_err(refuse)
}

/// Sampling by one of these keys, or the usual one.
pub(super) fn sampling(
    tolerance: Option<f64>,
    samples: Option<usize>,
    table: &str,
    at: &Context,
) -> Result<Sampling, ConfigError> {
    match (tolerance, samples) {
        (Some(_), Some(_)) => {
            Err(at.value(&format!("{table}samples"), "beside `tolerance`", "one of the two"))
        }
        (None, Some(samples)) => Ok(Sampling::Samples(samples)),
        (tolerance, None) => Ok(Sampling::Tolerance(tolerance.unwrap_or(USUAL_TOLERANCE))),
    }
}

/// Complaint about a key of the table `table`, or about `file`, if its rows come from one.
pub(super) fn of_rows(
    error: SpectrumError,
    (table, file): (&str, Option<&String>),
    at: &Context,
) -> ConfigError {
    match (file, error.key) {
        (Some(file), "wavelength_nm" | "power") => at.value(
            &format!("{table}.file"),
            file,
            &format!("{} with {}, got {}", error.key, error.expected, error.got),
        ),
        _ => at.value(&format!("{table}.{}", error.key), error.got, &error.expected),
    }
}

/// Wavelengths and powers from the design or from a file.
pub(super) fn rows(
    raw: &SpectrumRows,
    table: &str,
    folder: &Path,
    at: &Context,
) -> Result<[Vec<f64>; 2], ConfigError> {
    rows_of(raw, (table, "power"), folder, at)
}

/// The same of another quantity in place of the power.
pub(super) fn rows_of(
    raw: &SpectrumRows,
    (table, quantity): (&str, &str),
    folder: &Path,
    at: &Context,
) -> Result<[Vec<f64>; 2], ConfigError> {
    match (&raw.wavelength_nm, &raw.power, &raw.file) {
        (Some(wavelength_nm), Some(power), None) => Ok([wavelength_nm.clone(), power.clone()]),
        (None, None, Some(file)) => {
            let path = folder.join(file);
            let refuse = |why: String| {
                at.value(&format!("{table}.file"), file, &format!("a file of two columns: {why}"))
            };
            let text = bounded_text(&path, MAX_ROWS)
                .map_err(|error| refuse(format!("cannot read `{}`: {error}", path.display())))?;
            let columns = columns::read(&text, 2..=2).map_err(|why| {
                let what = format!("columns of wavelength in nm and {quantity}");
                refuse(format!("`{}`: {what}: {why}", path.display()))
            })?;
            Ok(columns.try_into().unwrap_or_default())
        }
        _ => {
            let expected = format!("either `wavelength_nm` and `{quantity}`, or `file`");
            Err(at.value(table, "other keys", &expected))
        }
    }
}

/// A design with a spectrum, or with sources that have their own, must make sense over the whole of
/// each: at both ends there are data of the material, and what `check` asks for.
pub(crate) fn check_ends(
    design: &Design,
    raw: &schema::Design,
    check: fn(&Design, &Context) -> Result<(), ConfigError>,
    at: &Context,
) -> Result<(), ConfigError> {
    let colours = design.colours();
    let stated = match (&design.spectrum, &colours) {
        (None, None) => return Ok(()),
        (Some(_), _) => "[light.spectrum]",
        (None, Some(_)) => "sources of other wavelengths",
    };
    if !raw.files.bands.is_empty() {
        return Err(at.value(
            "files.bands",
            format!("beside {stated}"),
            "light.wavelength_nm for all: tables from files hold for one wavelength",
        ));
    }
    let of_design = design.spectrum.iter().map(|s| (None, s.range_nm));
    let of_sources = colours.iter().flat_map(|lights| &lights.lights);
    let of_sources = of_sources.map(|light| (Some(light), light.light.range_nm()));
    for (light, ends) in of_design.chain(of_sources) {
        for end in ends {
            let fits = design.tuned(end).and_then(|tuned| check(&tuned, at));
            fits.map_err(|error| match (light, error) {
                (Some(light), ConfigError::Value { file, key, got, expected }) => {
                    ConfigError::Value {
                        file,
                        key,
                        got,
                        expected: format!(
                            "{expected}, for light of {end} nm from {}",
                            light.sources.join(", ")
                        ),
                    }
                }
                (_, error) => error,
            })?;
        }
    }
    Ok(())
}
