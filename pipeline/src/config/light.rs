// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[light]`, checked: one wavelength or a spectrum.

use std::path::Path;

use super::ConfigError;
use super::context::Context;
use super::raw::{self, SpectrumKind};
use super::resolved::Design;
use crate::spectrum::{Sampling, Source, Spectrum, SpectrumError, WAVELENGTHS_NM, columns};

/// Change from one number of wavelengths to the next where the design says nothing: half a point.
const USUAL_TOLERANCE: f64 = 5e-3;

/// The light of a design.
pub(super) struct Light {
    /// The wavelength, or the one that stands for the spectrum, nm.
    pub(super) wavelength_nm: f64,
    /// The spectrum, if there is one.
    pub(super) spectrum: Option<Spectrum>,
}

pub(super) fn resolve(raw: &raw::Light, folder: &Path, at: &Context) -> Result<Light, ConfigError> {
    match (raw.wavelength_nm, &raw.spectrum) {
        (Some(wavelength_nm), None) => {
            let key = "light.wavelength_nm";
            at.length(key, wavelength_nm)?;
            at.within(key, wavelength_nm, WAVELENGTHS_NM[0], WAVELENGTHS_NM[1])?;
            Ok(Light {
                wavelength_nm,
                spectrum: None,
            })
        }
        (None, Some(spectrum)) => {
            let spectrum = resolve_spectrum(spectrum, folder, at)?;
            Ok(Light {
                wavelength_nm: spectrum.median_nm(),
                spectrum: Some(spectrum),
            })
        }
        (both, _) => Err(at.value(
            "light",
            if both.is_some() { "both" } else { "neither" },
            "one of `wavelength_nm` and `[light.spectrum]`",
        )),
    }
}

fn resolve_spectrum(
    raw: &raw::Spectrum,
    folder: &Path,
    at: &Context,
) -> Result<Spectrum, ConfigError> {
    let refuse = |error: SpectrumError| {
        let key = format!("light.spectrum.{}", error.key);
        at.value(&key, error.got, &error.expected)
    };
    foreign_keys(raw, at)?;
    let source = match raw.kind {
        SpectrumKind::WhiteLed => {
            let given = |key: &str, value: Option<f64>| {
                let key = format!("light.spectrum.{key}");
                value.ok_or_else(|| at.value(&key, "missing", "a number, for kind = \"white_led\""))
            };
            Source::WhiteLed {
                blue_nm: given("blue_nm", raw.blue_nm)?,
                blue_fwhm_nm: given("blue_fwhm_nm", raw.blue_fwhm_nm)?,
                phosphor_nm: given("phosphor_nm", raw.phosphor_nm)?,
                phosphor_fwhm_nm: given("phosphor_fwhm_nm", raw.phosphor_fwhm_nm)?,
                blue_part: given("blue_part", raw.blue_part)?,
            }
        }
        SpectrumKind::Table | SpectrumKind::Lines => {
            let [wavelength_nm, power] = rows(raw, folder, at)?;
            if raw.kind == SpectrumKind::Table {
                Source::Table {
                    wavelength_nm,
                    power,
                }
            } else {
                Source::Lines {
                    wavelength_nm,
                    power,
                }
            }
        }
    };
    let sampling = match (raw.tolerance, raw.samples) {
        (Some(_), Some(_)) => {
            return Err(at.value(
                "light.spectrum.samples",
                "beside `tolerance`",
                "one of the two",
            ));
        }
        (Some(tolerance), None) => Some(Sampling::Tolerance(tolerance)),
        (None, Some(samples)) => Some(Sampling::Samples(samples)),
        (None, None) if raw.kind == SpectrumKind::Lines => None,
        (None, None) => Some(Sampling::Tolerance(USUAL_TOLERANCE)),
    };
    let in_file = |error: SpectrumError| match (&raw.file, error.key) {
        // What is wrong with rows from a file is said of the file.
        (Some(file), "wavelength_nm" | "power") => at.value(
            "light.spectrum.file",
            file,
            &format!("{} with {}, got {}", error.key, error.expected, error.got),
        ),
        _ => refuse(error),
    };
    Spectrum::new(source, raw.weighting, sampling).map_err(in_file)
}

/// Keys of another kind of spectrum are refused: they would be overlooked.
fn foreign_keys(raw: &raw::Spectrum, at: &Context) -> Result<(), ConfigError> {
    let of_led = [
        ("blue_nm", raw.blue_nm.is_some()),
        ("blue_fwhm_nm", raw.blue_fwhm_nm.is_some()),
        ("phosphor_nm", raw.phosphor_nm.is_some()),
        ("phosphor_fwhm_nm", raw.phosphor_fwhm_nm.is_some()),
        ("blue_part", raw.blue_part.is_some()),
    ];
    let of_rows = [
        ("wavelength_nm", raw.wavelength_nm.is_some()),
        ("power", raw.power.is_some()),
        ("file", raw.file.is_some()),
    ];
    let (foreign, kinds): (&[(&str, bool)], &str) = match raw.kind {
        SpectrumKind::WhiteLed => (&of_rows, "table or lines"),
        SpectrumKind::Table | SpectrumKind::Lines => (&of_led, "white_led"),
    };
    match foreign.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((key, _)) => Err(at.value(
            &format!("light.spectrum.{key}"),
            "given",
            &format!("no such key but with kind = {kinds}"),
        )),
    }
}

/// Wavelengths and powers from the design or from a file.
fn rows(raw: &raw::Spectrum, folder: &Path, at: &Context) -> Result<[Vec<f64>; 2], ConfigError> {
    match (&raw.wavelength_nm, &raw.power, &raw.file) {
        (Some(wavelength_nm), Some(power), None) => Ok([wavelength_nm.clone(), power.clone()]),
        (None, None, Some(file)) => {
            let path = folder.join(file);
            let refuse = |why: String| {
                at.value(
                    "light.spectrum.file",
                    file,
                    &format!("a file of two columns: {why}"),
                )
            };
            let text = std::fs::read_to_string(&path)
                .map_err(|error| refuse(format!("cannot read `{}`: {error}", path.display())))?;
            columns::read(&text).map_err(|why| refuse(format!("`{}`: {why}", path.display())))
        }
        _ => Err(at.value(
            "light.spectrum",
            "other keys",
            "either `wavelength_nm` and `power`, or `file`",
        )),
    }
}

/// A design with a spectrum must make sense over the whole of it: at both ends there are data of the material and tables of the rings.
pub(super) fn check_ends(
    design: &Design,
    raw: &raw::Design,
    at: &Context,
) -> Result<(), ConfigError> {
    let Some(spectrum) = &design.spectrum else {
        return Ok(());
    };
    if !raw.files.bands.is_empty() {
        return Err(at.value(
            "files.bands",
            "beside [light.spectrum]",
            "light.wavelength_nm: tables from files hold for one wavelength",
        ));
    }
    for end in spectrum.range_nm {
        design.tuned(end)?.check_relief(at)?;
    }
    Ok(())
}
