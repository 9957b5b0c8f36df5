// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[panel]`, checked: filters of sub-pixels that pass the light of the sources.

use std::path::Path;

use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::panel::{CONTRAST, Panel, SubPixel};
use crate::schema::light::SpectrumRows;
use crate::schema::panel;
use crate::spectrum::lights::Lights;
use metrics::digits::shortest;

/// Colours of the sub-pixels.
const COLOURS: usize = 3;

/// Checks `raw` against the light of the sources, and of the luminophores where a medium `converts`.
pub(crate) fn resolve(
    raw: &panel::Panel,
    (lights, converts): (&Lights, bool),
    folder: &Path,
    at: &Context,
) -> Result<Panel, ConfigError> {
    let contrast = at.within("panel.contrast", raw.contrast.unwrap_or(CONTRAST), 1.0, 1e12)?;
    let count = raw.sub_pixels.len();
    if count != 0 && count != COLOURS {
        let expected = "three tables, of red, green and blue in this order, or none";
        return Err(at.value("panel.sub_pixels", format!("{count} tables"), expected));
    }
    let numbered = raw.sub_pixels.iter().enumerate();
    let sub_pixels = numbered.map(|(k, raw)| {
        let table = format!("panel.sub_pixels[{}]", k + 1);
        let found = sub_pixel(raw, &table, folder, at)?;
        if !lights.lights.iter().any(|light| light.light.passes(&|nm| found.at(nm))) {
            let [from, to] = [0, found.wavelength_nm.len() - 1].map(|k| found.wavelength_nm[k]);
            let got = format!("rows from {from} to {to} nm");
            let of = if converts { "sources and luminophores" } else { "sources" };
            let expected =
                format!("a filter that passes visible light of the {of}: {}", ranges(lights));
            return Err(at.value(&format!("{table}.transmittance"), got, &expected));
        }
        Ok(found)
    });
    let sub_pixels: Vec<SubPixel> = sub_pixels.collect::<Result<_, _>>()?;
    shares_of_a_pixel(&sub_pixels, raw, at)?;
    let is_stopped = |light: &&crate::spectrum::lights::Light| {
        // Light that is converted need not come as far as the panel.
        count > 0
            && !converts
            && !sub_pixels.iter().any(|filter| light.light.passes(&|nm| filter.at(nm)))
    };
    if let Some(light) = lights.lights.iter().find(is_stopped) {
        let [low, high] = light.light.range_nm();
        let got = format!("none that passes the light of {}", light.sources.join(", "));
        let expected = format!("a filter that passes visible light from {low} to {high} nm");
        return Err(at.value("panel.sub_pixels", got, &expected));
    }
    Ok(Panel { contrast, sub_pixels })
}

/// Refuses sub-pixels that together pass more than meets a pixel.
fn shares_of_a_pixel(
    sub_pixels: &[SubPixel],
    raw: &panel::Panel,
    at: &Context,
) -> Result<(), ConfigError> {
    for (number, own) in sub_pixels.iter().enumerate() {
        for nm in &own.wavelength_nm {
            let shares = sub_pixels.iter().map(|sub_pixel| sub_pixel.at(*nm));
            let sum: f64 = shares.sum();
            if sum > 1.0 + 1e-9 {
                let is_file = raw.sub_pixels[number].file.is_some();
                let name = if is_file { "file" } else { "transmittance" };
                let key = format!("panel.sub_pixels[{}].{name}", number + 1);
                let got = format!("{} at {nm} nm, with the others {}", own.at(*nm), shortest(sum));
                let expected = "shares of what meets the whole pixel, together at most 1";
                return Err(at.value(&key, got, expected));
            }
        }
    }
    Ok(())
}

/// Names and wavelengths of all lights.
fn ranges(lights: &Lights) -> String {
    let one = lights.lights.iter().map(|light| {
        let [low, high] = light.light.range_nm();
        format!("{} {low} to {high} nm", light.sources.join(", ")).trim_start().to_owned()
    });
    one.collect::<Vec<_>>().join("; ")
}

fn sub_pixel(
    raw: &panel::SubPixel,
    table: &str,
    folder: &Path,
    at: &Context,
) -> Result<SubPixel, ConfigError> {
    let rows = SpectrumRows {
        wavelength_nm: raw.wavelength_nm.clone(),
        power: raw.transmittance.clone(),
        file: raw.file.clone(),
    };
    let [wavelength_nm, transmittance] =
        super::light::rows_of(&rows, (table, "transmittance"), folder, at)?;
    let (rows, values) = (wavelength_nm.len(), transmittance.len());
    if rows < 2 || rows != values {
        let expected = "at least two wavelengths, and a transmittance at each";
        return Err(at.value(table, format!("{rows} wavelengths, {values} values"), expected));
    }
    let key = |name: &str| match &raw.file {
        Some(_) => format!("{table}.file"),
        None => format!("{table}.{name}"),
    };
    let [low, high] = crate::spectrum::WAVELENGTHS_NM;
    for nm in &wavelength_nm {
        at.within(&key("wavelength_nm"), *nm, low, high)?;
    }
    if let Some([before, after]) = wavelength_nm.array_windows().find(|[a, b]| a >= b) {
        let got = format!("{after} after {before}");
        return Err(at.value(&key("wavelength_nm"), got, "wavelengths in ascending order"));
    }
    for value in &transmittance {
        at.within(&key("transmittance"), *value, 0.0, 1.0)?;
    }
    if let Some(black) = raw.black {
        at.within(&format!("{table}.black"), black, 0.0, 1.0)?;
    }
    Ok(SubPixel { wavelength_nm, transmittance, black: raw.black })
}
