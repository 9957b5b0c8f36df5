// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray files: looked through, converted, written from a trace, and read as sources. Rays pass one
//! by one; no file has to fit into the memory.

use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};
use tracer::formats::rays::RayRecord;
use tracer::formats::{lighttools_rays, speos_rays, tm25, zemax_rays};

use metrics::photopic;
use metrics::plural::count;

use super::sniff::{self, Kind};
use crate::atomic_file::write_atomic;

/// How far the sum of the rays may lie from the flux in the header.
const FLUX_TOLERANCE: f64 = 1e-3;

/// Formats of ray files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayFormat {
    /// IES TM-25.
    Tm25,
    /// LightTools binary.
    LightTools,
    /// Speos binary.
    Speos,
    /// Zemax binary.
    Zemax,
}

impl RayFormat {
    /// That of the file at `path`, by its content.
    ///
    /// # Errors
    /// If it is none, or its ending says another.
    pub fn of(path: &Path) -> Result<Self> {
        Ok(match sniff::kind(path)? {
            Kind::Tm25 => Self::Tm25,
            Kind::LightToolsRays => Self::LightTools,
            Kind::SpeosRays => Self::Speos,
            Kind::ZemaxRays => Self::Zemax,
            other => bail!("expected a ray file, got {}", other.name()),
        })
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tm25 => "TM-25 ray file",
            Self::LightTools => "LightTools ray file",
            Self::Speos => "Speos ray file",
            Self::Zemax => "Zemax ray file",
        }
    }

    /// Whether each ray of a file can have a wavelength where it is written.
    fn writes_wavelengths(self) -> bool {
        matches!(self, Self::Speos | Self::Zemax)
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
    /// Lowest and highest wavelength of the rays, nm, where they have wavelengths.
    pub wavelengths: Option<[f32; 2]>,
    /// Lowest and highest coordinates of the starts, mm.
    pub bounds: [[f32; 3]; 2],
    /// What is odd in the file, though it can be used.
    pub warnings: Vec<String>,
}

impl RaySummary {
    /// For programs and for people.
    pub fn describe(&self) -> (Value, Vec<String>) {
        let [low, high] = self.bounds;
        let stated = self.stated.map_or("none".to_owned(), |f| format!("{f:.6}"));
        let mut lines = vec![
            format!(
                "{}, {:.6} {} in all, {stated} in the header",
                count(self.rays, "ray"),
                self.flux,
                self.unit
            ),
            format!("starts from {low:?} to {high:?} mm"),
        ];
        if let Some([first, last]) = self.wavelengths {
            lines.push(format!("wavelengths from {first} to {last} nm"));
        }
        (
            json!({"rays": self.rays, "flux": self.flux, "flux_in_header": self.stated, "unit": self.unit, "low_mm": low, "high_mm": high, "wavelengths_nm": self.wavelengths}),
            lines,
        )
    }
}

/// The wavelengths of the rays of a file.
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

/// The rays of a file with their wavelengths.
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
pub fn with_wavelengths(path: &Path) -> Result<RayLight> {
    let (mut rays, mut tables) = (Vec::new(), Vec::new());
    let header = scan(path, |ray, table| {
        rays.push(ray);
        tables.push(table);
        Ok(())
    });
    let header = header.with_context(|| path.display().to_string())?;
    let stated = match header.wavelengths {
        HeaderWavelengths::Nothing => StatedWavelengths::Nothing,
        HeaderWavelengths::One(nm) => StatedWavelengths::One(nm),
        HeaderWavelengths::PerRay => StatedWavelengths::PerRay,
        HeaderWavelengths::Tables(all, false) => match all.into_iter().next() {
            Some(table) => StatedWavelengths::Spectrum(table),
            None => bail!(
                "{}: expected the spectral table that the header says all rays have, got none",
                path.display()
            ),
        },
        HeaderWavelengths::Tables(all, true) => StatedWavelengths::Spectra(all, tables),
    };
    Ok(RayLight { rays, radiant: header.unit == "W", stated })
}

/// What a header says of wavelengths.
enum HeaderWavelengths {
    Nothing,
    One(f32),
    PerRay,
    /// Spectral tables, and whether each ray names one of them.
    Tables(Vec<Vec<[f32; 2]>>, bool),
}

/// What a header says of all rays.
struct RayHeader {
    format: RayFormat,
    flux: Option<f64>,
    unit: &'static str,
    wavelengths: HeaderWavelengths,
    /// Where the flux of the header is not that of the rays.
    warning: Option<String>,
}

/// Calls `take` for every ray of the file at `path` and the number of its spectral table, NaN where
/// it has none.
fn scan(path: &Path, take: impl FnMut(RayRecord, f32) -> Result<()>) -> Result<RayHeader> {
    let file = File::open(path).context("expected rays, cannot open it")?;
    let length = file.metadata().context("cannot look at it")?.len();
    let format = RayFormat::of(path)?;
    let (mut header, sum) = match format {
        RayFormat::Tm25 => scan_tm25(file, length, take)?,
        RayFormat::LightTools => scan_lighttools(file, take)?,
        RayFormat::Speos => scan_speos(file, length, take)?,
        RayFormat::Zemax => scan_zemax(file, length, take)?,
    };
    let unit = header.unit;
    if let Some(flux) = header.flux
        && (sum - flux).abs() > FLUX_TOLERANCE * flux.abs().max(f64::MIN_POSITIVE)
    {
        // Programs scale by the rays, and makers write what they like into these headers.
        ensure!(
            matches!(format, RayFormat::Speos | RayFormat::Zemax),
            "flux in the header: expected the sum of the rays, {sum:.6} {unit}, got {flux:.6} {unit}"
        );
        header.warning = Some(format!(
            "the header states {flux:.6} {unit}, the rays add up to {sum:.6} {unit}; the rays are taken"
        ));
    }
    Ok(header)
}

/// The unit of flux.
fn unit(radiant: bool) -> &'static str {
    if radiant { "W" } else { "lm" }
}

fn scan_tm25(
    file: File,
    length: u64,
    mut take: impl FnMut(RayRecord, f32) -> Result<()>,
) -> Result<(RayHeader, f64)> {
    let mut reader = tm25::Tm25Reader::new(file, Some(length))?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, reader.spectrum_index())?;
    }
    let header = reader.header();
    let tables = || header.tables.clone();
    let found = RayHeader {
        format: RayFormat::Tm25,
        flux: header.flux().map(f64::from),
        unit: unit(header.is_radiant()),
        wavelengths: match header.spectrum {
            tm25::Spectrum::Unknown => HeaderWavelengths::Nothing,
            tm25::Spectrum::Single(nm) => HeaderWavelengths::One(nm),
            tm25::Spectrum::PerRay => HeaderWavelengths::PerRay,
            tm25::Spectrum::Table => HeaderWavelengths::Tables(tables(), false),
            tm25::Spectrum::Tables => HeaderWavelengths::Tables(tables(), true),
        },
        warning: None,
    };
    Ok((found, reader.sum()))
}

fn scan_lighttools(
    file: File,
    mut take: impl FnMut(RayRecord, f32) -> Result<()>,
) -> Result<(RayHeader, f64)> {
    let mut reader = lighttools_rays::LightToolsReader::new(file)?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    let header = reader.header();
    let found = RayHeader {
        format: RayFormat::LightTools,
        flux: Some(f64::from(header.flux)),
        unit: unit(header.radiant),
        wavelengths: per_ray(header.coloured),
        warning: None,
    };
    Ok((found, reader.sum()))
}

fn scan_speos(
    file: File,
    length: u64,
    mut take: impl FnMut(RayRecord, f32) -> Result<()>,
) -> Result<(RayHeader, f64)> {
    let mut reader = speos_rays::SpeosReader::new(file, length)?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    let found = RayHeader {
        format: RayFormat::Speos,
        flux: Some(f64::from(reader.header().radiant_flux)),
        unit: unit(true),
        wavelengths: HeaderWavelengths::PerRay,
        warning: None,
    };
    Ok((found, reader.sum()))
}

fn scan_zemax(
    file: File,
    length: u64,
    mut take: impl FnMut(RayRecord, f32) -> Result<()>,
) -> Result<(RayHeader, f64)> {
    let mut reader = zemax_rays::ZemaxReader::new(file, Some(length))?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    let header = reader.header();
    let found = RayHeader {
        format: RayFormat::Zemax,
        flux: Some(f64::from(header.flux)).filter(|flux| flux.is_finite()),
        unit: unit(header.radiant),
        // The wavelength of the header is not used by the program itself.
        wavelengths: per_ray(header.coloured),
        warning: None,
    };
    Ok((found, reader.sum()))
}

fn per_ray(coloured: bool) -> HeaderWavelengths {
    if coloured { HeaderWavelengths::PerRay } else { HeaderWavelengths::Nothing }
}

/// Looks through the file at `path`.
///
/// # Errors
/// If it does not keep to its format, or its flux is not that of its header.
pub fn summary(path: &Path) -> Result<RaySummary> {
    let (mut rays, mut flux) = (0, 0.0);
    let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    let mut wavelengths = [f32::INFINITY, f32::NEG_INFINITY];
    let header = scan(path, |ray, _| {
        rays += 1;
        flux += f64::from(ray.flux);
        wavelengths = [wavelengths[0].min(ray.wavelength), wavelengths[1].max(ray.wavelength)];
        for (axis, value) in ray.position.into_iter().enumerate() {
            bounds[0][axis] = bounds[0][axis].min(value);
            bounds[1][axis] = bounds[1][axis].max(value);
        }
        Ok(())
    })?;
    ensure!(rays > 0, "expected at least one ray, got none");
    Ok(RaySummary {
        format: header.format.name(),
        rays,
        flux,
        stated: header.flux,
        unit: header.unit,
        wavelengths: wavelengths[0].is_finite().then_some(wavelengths),
        bounds,
        warnings: header.warning.into_iter().collect(),
    })
}

/// What a written file says of itself.
#[derive(Debug, Clone)]
pub struct RayMetadata {
    /// Name of the source.
    pub name: String,
    /// What the rays are.
    pub operation: String,
    /// One wavelength for all rays, nm; NaN where they have their own or none.
    pub wavelength_nm: f64,
    /// Whether each ray has its own wavelength.
    pub per_ray: bool,
    /// Luminous flux of 1 W, lm; NaN if it is not known.
    pub lumens_per_watt: f64,
    /// Whether flux is in W; else in lm.
    pub radiant: bool,
}

impl RayMetadata {
    /// Of rays traced in light of one wavelength.
    pub fn traced(design: &str, wavelength_nm: f64, lumens_per_watt: f64) -> Self {
        Self {
            name: design.to_owned(),
            operation: "rays that leave the package, traced".to_owned(),
            wavelength_nm,
            per_ray: false,
            lumens_per_watt,
            radiant: true,
        }
    }

    /// A ray with the wavelength of all, where rays have none of their own.
    fn coloured(&self, ray: &RayRecord) -> RayRecord {
        let wavelength = if self.per_ray { ray.wavelength } else { self.wavelength_nm as f32 };
        RayRecord { wavelength, ..*ray }
    }

    fn tm25(&self) -> tm25::Tm25Metadata {
        let mut descriptions: [String; 9] = Default::default();
        self.name.clone_into(&mut descriptions[0]);
        descriptions[3] = format!("batwing {}", env!("CARGO_PKG_VERSION"));
        self.operation.clone_into(&mut descriptions[7]);
        tm25::Tm25Metadata {
            wavelength: self.wavelength_nm as f32,
            lumens_per_watt: self.lumens_per_watt as f32,
            date: String::new(),
            descriptions,
        }
    }

    /// For the file at `path`: an `.sdf` file has a wavelength for each ray where one is known.
    fn zemax(&self, path: &Path) -> zemax_rays::ZemaxMetadata {
        let spectral = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("sdf"));
        let known = spectral && self.radiant && self.wavelength_nm.is_finite();
        let program = format!("batwing {}", env!("CARGO_PKG_VERSION"));
        zemax_rays::ZemaxMetadata {
            description: format!("{}, {program}", self.name),
            wavelength: self.wavelength_nm as f32,
            coloured: self.per_ray || known,
            radiant: self.radiant,
        }
    }
}

/// Writes `path` in `format` with what `fill` hands over; returns the number of rays and their
/// flux.
///
/// # Errors
/// If `fill` fails, the format has no place for what the rays have, or the file cannot be written.
pub fn write(
    path: &Path,
    format: RayFormat,
    about: &RayMetadata,
    fill: impl FnOnce(&mut dyn FnMut(&RayRecord) -> Result<()>) -> Result<()>,
) -> Result<(u64, f64)> {
    ensure!(
        about.radiant || format == RayFormat::Zemax,
        "expected rays with flux in W, got lm, which is written into Zemax ray files alone"
    );
    ensure!(
        !about.per_ray || format.writes_wavelengths(),
        "expected one wavelength for all rays, got one for each, which is written into Speos and Zemax ray files alone"
    );
    let mut written = (0, 0.0);
    write_atomic(path, |file| {
        written = match format {
            RayFormat::Tm25 => {
                let mut writer = tm25::Tm25Writer::new(file, &about.tm25())?;
                fill(&mut |ray| Ok(writer.write(ray)?))?;
                writer.finish()?
            }
            RayFormat::LightTools => {
                let mut writer = lighttools_rays::LightToolsWriter::new(file)?;
                fill(&mut |ray| Ok(writer.write(ray)?))?;
                writer.finish()?
            }
            RayFormat::Speos => {
                let mut writer = speos_rays::SpeosWriter::new(file)?;
                fill(&mut |ray| {
                    let ray = about.coloured(ray);
                    let seen = photopic::v(f64::from(ray.wavelength));
                    let lumens = photopic::LUMENS_PER_WATT * seen * f64::from(ray.flux);
                    Ok(writer.write(&ray, lumens)?)
                })?;
                writer.finish()?
            }
            RayFormat::Zemax => {
                let mut writer = zemax_rays::ZemaxWriter::new(file, &about.zemax(path))?;
                fill(&mut |ray| Ok(writer.write(&about.coloured(ray))?))?;
                writer.finish()?
            }
        };
        Ok(())
    })?;
    Ok(written)
}

/// What was converted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converted {
    /// Number of rays.
    pub rays: u64,
    /// Their flux.
    pub flux: f64,
    /// Its unit.
    pub unit: &'static str,
}

/// Writes the rays of one file into another of `format`.
///
/// # Errors
/// If rays carry lumens or wavelengths that the format has no place for, or a file cannot be read
/// or written.
pub fn convert(from: &Path, to: &Path, format: RayFormat) -> Result<Converted> {
    let named = || from.display().to_string();
    let mut found: Option<f32> = None;
    let mut several = false;
    let header = scan(from, |ray, _| {
        if ray.wavelength.is_finite() {
            let first = *found.get_or_insert(ray.wavelength);
            several |= (ray.wavelength - first).abs() >= 1e-3;
        }
        Ok(())
    })
    .with_context(named)?;
    let stem = from.file_stem().unwrap_or_default().to_string_lossy();
    let about = RayMetadata {
        name: stem.into_owned(),
        operation: format!("converted from a {}", header.format.name()),
        wavelength_nm: found.filter(|_| !several).map_or(f64::NAN, f64::from),
        per_ray: several || (found.is_some() && format == RayFormat::Zemax),
        lumens_per_watt: f64::NAN,
        radiant: header.unit == "W",
    };
    let written = write(to, format, &about, |put| scan(from, |ray, _| put(&ray)).map(|_| ()));
    let (rays, flux) = written.with_context(named)?;
    Ok(Converted { rays, flux, unit: header.unit })
}
