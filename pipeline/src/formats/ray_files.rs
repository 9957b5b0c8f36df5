// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray files: looked through, converted, written from a trace, and read as sources. Rays pass one by one; no file has to fit into the memory.

use crate::atomic_file::write_atomic;
use crate::plural::count;
use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};
use std::fs::File;
use std::path::Path;
use tracer::formats::rays::RayRecord;
use tracer::formats::{ltray, tm25};

/// How far the sum of the rays may lie from the flux in the header.
const FLUX_TOLERANCE: f64 = 1e-3;

/// Formats of ray files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayFormat {
    /// IES TM-25.
    Tm25,
    /// LightTools binary.
    LightTools,
}

impl RayFormat {
    /// By the ending of a file.
    ///
    /// # Errors
    /// If it is another.
    pub fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|e| e.to_str()) {
            Some(e) if e.eq_ignore_ascii_case("tm25ray") => Ok(Self::Tm25),
            Some(e) if e.eq_ignore_ascii_case("ray") => Ok(Self::LightTools),
            _ => bail!("expected a ray file ending in .tm25ray or .ray"),
        }
    }
}

/// What a ray file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct RaySummary {
    /// Name of the format.
    pub format: &'static str,
    /// Number of rays.
    pub rays: u64,
    /// Sum of their flux.
    pub flux: f64,
    /// Flux in the header, if it says one.
    pub stated: Option<f64>,
    /// `W` or `lm`.
    pub unit: &'static str,
    /// Lowest and highest coordinates of the starts, mm.
    pub bounds: [[f32; 3]; 2],
}

impl RaySummary {
    /// For programs and for people.
    pub fn describe(&self) -> (Value, Vec<String>) {
        let [low, high] = self.bounds;
        let stated = self.stated.map_or("none".to_owned(), |f| format!("{f:.6}"));
        let lines = vec![
            format!(
                "{}, {:.6} {} in all, {stated} in the header",
                count(self.rays, "ray"),
                self.flux,
                self.unit
            ),
            format!("starts from {low:?} to {high:?} mm"),
        ];
        (
            json!({"rays": self.rays, "flux": self.flux, "flux_in_header": self.stated, "unit": self.unit, "low_mm": low, "high_mm": high}),
            lines,
        )
    }
}

/// What a file of rays says of their wavelengths.
#[derive(Debug, Clone, PartialEq)]
pub enum StatedWavelengths {
    /// Nothing.
    Nothing,
    /// One wavelength for all, nm.
    One(f32),
    /// One for each ray.
    PerRay,
    /// One spectrum for all: wavelength, nm, and power per nm.
    Spectrum(Vec<[f32; 2]>),
    /// Spectra, and for each ray the number of its own, from 1.
    Spectra(Vec<Vec<[f32; 2]>>, Vec<f32>),
}

/// The rays of a file and what it says of their wavelengths.
#[derive(Debug)]
pub struct RayLight {
    /// The rays.
    pub rays: Vec<RayRecord>,
    /// Whether their flux is in W; else in lm.
    pub radiant: bool,
    /// Their wavelengths.
    pub stated: StatedWavelengths,
}

/// All rays of the file at `path`, with their wavelengths.
///
/// # Errors
/// As [`summary`]; a table of wavelengths that the file says it has and has not.
pub fn lit(path: &Path) -> Result<RayLight> {
    let (mut rays, mut tables) = (Vec::new(), Vec::new());
    let heard = hear(path, |ray, table| {
        rays.push(ray);
        tables.push(table);
        Ok(())
    });
    let heard = heard.with_context(|| path.display().to_string())?;
    let stated = match heard.colours {
        Colours::Nothing => StatedWavelengths::Nothing,
        Colours::One(nm) => StatedWavelengths::One(nm),
        Colours::PerRay => StatedWavelengths::PerRay,
        Colours::Tables(all, false) => match all.into_iter().next() {
            Some(table) => StatedWavelengths::Spectrum(table),
            None => bail!(
                "{}: expected the spectral table that the header says all rays have, got none",
                path.display()
            ),
        },
        Colours::Tables(all, true) => StatedWavelengths::Spectra(all, tables),
    };
    Ok(RayLight {
        rays,
        radiant: heard.unit == "W",
        stated,
    })
}

/// What a header says of wavelengths.
enum Colours {
    Nothing,
    One(f32),
    PerRay,
    /// Spectral tables, and whether each ray names one of them.
    Tables(Vec<Vec<[f32; 2]>>, bool),
}

/// What a file says of all its rays.
struct Heard {
    flux: Option<f64>,
    unit: &'static str,
    colours: Colours,
}

/// Calls `take` for every ray of the file at `path`; returns the stated flux and its unit.
fn each(
    path: &Path,
    mut take: impl FnMut(RayRecord) -> Result<()>,
) -> Result<(Option<f64>, &'static str)> {
    let heard = hear(path, |ray, _| take(ray))?;
    Ok((heard.flux, heard.unit))
}

/// Calls `take` for every ray of the file at `path` and the number of its spectral table, NaN where it has none.
fn hear(path: &Path, mut take: impl FnMut(RayRecord, f32) -> Result<()>) -> Result<Heard> {
    let file = File::open(path).context("expected rays, cannot open it")?;
    let length = file.metadata().context("cannot look at it")?.len();
    let unit = |radiant: bool| if radiant { "W" } else { "lm" };
    let (heard, sum) = match RayFormat::of(path)? {
        RayFormat::Tm25 => {
            let mut reader = tm25::Reader::new(file, Some(length))?;
            while let Some(ray) = reader.next_ray()? {
                take(ray, reader.spectrum_index())?;
            }
            let header = reader.header();
            let heard = Heard {
                flux: header.flux().map(f64::from),
                unit: unit(header.is_radiant()),
                colours: match header.spectrum {
                    tm25::Spectrum::Unknown => Colours::Nothing,
                    tm25::Spectrum::Single(nm) => Colours::One(nm),
                    tm25::Spectrum::PerRay => Colours::PerRay,
                    tm25::Spectrum::Table => Colours::Tables(header.tables.clone(), false),
                    tm25::Spectrum::Tables => Colours::Tables(header.tables.clone(), true),
                },
            };
            (heard, reader.sum())
        }
        RayFormat::LightTools => {
            let mut reader = ltray::Reader::new(file)?;
            while let Some(ray) = reader.next_ray()? {
                take(ray, f32::NAN)?;
            }
            let header = reader.header();
            let heard = Heard {
                flux: Some(f64::from(header.flux)),
                unit: unit(header.radiant),
                colours: if header.coloured {
                    Colours::PerRay
                } else {
                    Colours::Nothing
                },
            };
            (heard, reader.sum())
        }
    };
    let unit = heard.unit;
    if let Some(flux) = heard.flux {
        ensure!(
            (sum - flux).abs() <= FLUX_TOLERANCE * flux.abs().max(f64::MIN_POSITIVE),
            "flux in the header: expected the sum of the rays, {sum:.6} {unit}, got {flux:.6} {unit}"
        );
    }
    Ok(heard)
}

/// Looks through the file at `path`.
///
/// # Errors
/// If it does not keep to its format, or its flux is not that of its header.
pub fn summary(path: &Path) -> Result<RaySummary> {
    let (mut rays, mut flux) = (0, 0.0);
    let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    let (stated, unit) = each(path, |ray| {
        rays += 1;
        flux += f64::from(ray.flux);
        for (axis, value) in ray.position.into_iter().enumerate() {
            bounds[0][axis] = bounds[0][axis].min(value);
            bounds[1][axis] = bounds[1][axis].max(value);
        }
        Ok(())
    })?;
    ensure!(rays > 0, "expected at least one ray, got none");
    Ok(RaySummary {
        format: match RayFormat::of(path)? {
            RayFormat::Tm25 => "TM-25 ray file",
            RayFormat::LightTools => "LightTools ray file",
        },
        rays,
        flux,
        stated,
        unit,
        bounds,
    })
}

/// All rays of the file at `path`.
///
/// # Errors
/// As [`summary`].
pub fn records(path: &Path) -> Result<Vec<RayRecord>> {
    let mut rays = Vec::new();
    each(path, |ray| {
        rays.push(ray);
        Ok(())
    })
    .with_context(|| path.display().to_string())?;
    Ok(rays)
}

/// What a written file says of itself.
pub fn about(design: &str, wavelength_nm: f64, lumens_per_watt: f64) -> tm25::About {
    let mut descriptions: [String; 9] = Default::default();
    design.clone_into(&mut descriptions[0]);
    format!("batwing {}", env!("CARGO_PKG_VERSION")).clone_into(&mut descriptions[3]);
    "rays that leave the package, traced".clone_into(&mut descriptions[7]);
    tm25::About {
        wavelength: wavelength_nm as f32,
        lumens_per_watt: lumens_per_watt as f32,
        date: String::new(),
        descriptions,
    }
}

/// Writes `path` with what `fill` hands over, in the format of its ending; returns the number of rays and their flux.
pub fn write(
    path: &Path,
    about: &tm25::About,
    fill: impl FnOnce(&mut dyn FnMut(&RayRecord) -> Result<()>) -> Result<()>,
) -> Result<(u64, f64)> {
    let format = RayFormat::of(path).with_context(|| path.display().to_string())?;
    let mut written = (0, 0.0);
    write_atomic(path, |file| {
        written = match format {
            RayFormat::Tm25 => {
                let mut writer = tm25::Writer::new(file, about)?;
                fill(&mut |ray| Ok(writer.write(ray)?))?;
                writer.finish()?
            }
            RayFormat::LightTools => {
                let mut writer = ltray::Writer::new(file)?;
                fill(&mut |ray| Ok(writer.write(ray)?))?;
                writer.finish()?
            }
        };
        Ok(())
    })?;
    Ok(written)
}

/// Writes the rays of one file into another, in the format of its ending; flux in W.
///
/// # Errors
/// If rays carry lumens, which the writers do not, or a file cannot be read or written.
pub fn convert(from: &Path, to: &Path) -> Result<(u64, f64)> {
    let head = summary(from).with_context(|| from.display().to_string())?;
    ensure!(
        head.unit == "W",
        "{}: expected rays with flux in W, got lm: writing luminous flux is not supported",
        from.display()
    );
    let mut wavelength = f32::NAN;
    each(from, |ray| {
        ensure!(
            wavelength.is_nan() || (ray.wavelength - wavelength).abs() < 1e-3,
            "expected one wavelength for all rays, got {wavelength} and {} nm: writing one for each ray is not supported",
            ray.wavelength
        );
        wavelength = ray.wavelength;
        Ok(())
    })
    .with_context(|| from.display().to_string())?;
    let name = from
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    write(to, &about(&name, f64::from(wavelength), f64::NAN), |put| {
        each(from, |ray| put(&ray)).map(|_| ())
    })
}
