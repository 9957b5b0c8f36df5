// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray files: looked through, converted, written from a trace, and read as sources. Rays pass one
//! by one; no file has to fit into the memory.

use std::io::Read;
use std::path::Path;

use crate::rays::RayRecord;
use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};
use tracer::random;

use metrics::plural::count;

use super::{READERS, Reads, listed, sniff};
use runtime::atomic_file::{Sink, write_atomic};
use runtime::bounded_text::open;

/// Allowed relative difference of the sum of the rays from the flux in the header.
const FLUX_TOLERANCE: f64 = 1e-3;

/// Receiver of rays, each with the number of its spectral table, NaN where it has none.
pub type Take<'a> = &'a mut dyn FnMut(RayRecord, f32) -> Result<()>;

/// Function that hands all rays of a file to its writer.
pub type Fill<'a> = Box<dyn FnOnce(&mut dyn FnMut(&RayRecord) -> Result<()>) -> Result<()> + 'a>;

/// Reader of a ray file of so many bytes: header, and the sum of the flux of the rays.
pub type Scan = fn(&mut dyn Read, u64, Take<'_>) -> Result<(RayHeader, f64)>;
/// Writer of a ray file for a path: number of rays, and their flux.
pub type Write = fn(&mut dyn Sink, &Path, &RayMetadata, Fill<'_>) -> Result<(u64, f64)>;

/// Reader and writer of a format of rays.
#[derive(Debug)]
pub struct RayFormat {
    /// Name.
    pub name: &'static str,
    /// Meaning of the flux in the header.
    pub flux: FluxRule,
    /// True where flux in lm can be written.
    pub has_lumens: bool,
    /// True where one wavelength of all rays stands in a column too, for want of a place in the
    /// header.
    pub needs_column: bool,
    /// Reads the header and hands every ray on; returns the sum of their flux too.
    pub scan: Scan,
    /// Writes a file for this path; returns the number of rays and their flux.
    pub write: Write,
}

/// Meaning of the flux in a header that is not the sum of the rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FluxRule {
    /// A damaged file.
    Checked,
    /// None: the rays are taken. Programs scale by them, and makers write what they like here.
    OfRays,
    /// The flux of all rays, whose powers are relative.
    OfHeader,
}

impl RayFormat {
    /// Format of the file at `path`, by its content.
    ///
    /// # Errors
    /// If it is none, or its ending says another.
    pub fn from_path(path: &Path) -> Result<&'static Self> {
        let reader = sniff::reader(path)?;
        match reader.reads {
            Reads::Rays(format) => Ok(format),
            _ => bail!("expected a ray file, got {}", reader.name),
        }
    }

    /// Names of the formats of flux in lm, for messages.
    fn with_lumens() -> String {
        let makers = READERS.iter().filter_map(|reader| match reader.reads {
            Reads::Rays(format) if format.has_lumens => {
                Some(format.name.trim_end_matches(" ray file"))
            }
            _ => None,
        });
        listed(&makers.collect::<Vec<_>>(), "and")
    }
}

/// Content of a ray file.
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
    /// Statement of the header on wavelengths.
    pub light: HeaderWavelengths,
    /// Lowest and highest coordinates of the starts, mm.
    pub bounds: [[f32; 3]; 2],
    /// Oddities of a file that can be used.
    pub warnings: Vec<String>,
}

impl RaySummary {
    /// Figures for programs, and lines for people.
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
        let mut value = json!({"rays": self.rays, "flux": self.flux, "flux_in_header": self.stated, "unit": self.unit, "low_mm": low, "high_mm": high, "wavelengths_nm": self.wavelengths});
        match &self.light {
            HeaderWavelengths::One(nm) => {
                lines.push(format!("one wavelength for all, {nm} nm"));
                value["wavelength_nm"] = json!(nm);
            }
            HeaderWavelengths::Tables(tables, each) => {
                let whose = if *each { "each ray names one" } else { "for all rays" };
                for (number, table) in (1..).zip(tables) {
                    lines.push(format!("spectral table {number}, {whose}: {}", spectrum(table)));
                }
                value["spectra"] = json!({"each_ray_names_one": each, "nm_and_power": tables});
            }
            HeaderWavelengths::Nothing | HeaderWavelengths::PerRay => {}
        }
        (value, lines)
    }
}

/// A spectral table in words.
fn spectrum(table: &[[f32; 2]]) -> String {
    let rows = count(table.len(), "row");
    let peak = table.iter().copied().reduce(|a, b| if b[1] > a[1] { b } else { a });
    match (table.first(), table.last(), peak) {
        (Some([first, _]), Some([last, _]), Some([peak, _])) => {
            format!("{rows} from {first} to {last} nm, highest at {peak} nm")
        }
        _ => rows,
    }
}

/// The rays of a file with their wavelengths.
#[derive(Debug)]
pub struct RayLight {
    /// The rays.
    pub rays: Vec<RayRecord>,
    /// True for flux in W; else in lm.
    pub radiant: bool,
    /// Their wavelengths.
    pub stated: HeaderWavelengths,
    /// For each ray the number of its spectral table, from 1; NaN where it has none.
    pub tables: Vec<f32>,
}

/// All rays of the file at `path`, with their wavelengths.
///
/// # Errors
/// As [`summary`]; a table of wavelengths that the file says it has and has not.
pub fn with_wavelengths(path: &Path) -> Result<RayLight> {
    let (mut rays, mut tables) = (Vec::new(), Vec::new());
    let scanned = scan(path, |ray, table| {
        rays.push(ray);
        tables.push(table);
        Ok(())
    });
    let scanned = scanned.with_context(|| path.display().to_string())?;
    for ray in &mut rays {
        *ray = scanned.scaled(*ray);
    }
    let header = scanned.header;
    ensure!(
        !matches!(&header.wavelengths, HeaderWavelengths::Tables(all, false) if all.is_empty()),
        "{}: expected the spectral table that the header says all rays have, got none",
        path.display()
    );
    Ok(RayLight { rays, radiant: header.unit == "W", stated: header.wavelengths, tables })
}

/// Statement of a header on wavelengths.
#[derive(Debug, Clone, PartialEq)]
pub enum HeaderWavelengths {
    /// None.
    Nothing,
    /// One for all rays, nm.
    One(f32),
    /// One for each ray.
    PerRay,
    /// Spectral tables; true where each ray names one of them.
    Tables(Vec<Vec<[f32; 2]>>, bool),
}

impl HeaderWavelengths {
    /// Of a file with or without a column of wavelengths.
    pub fn of_column(coloured: bool) -> Self {
        if coloured { Self::PerRay } else { Self::Nothing }
    }
}

/// Statement of a header on all rays.
#[derive(Debug)]
pub struct RayHeader {
    /// Their flux, where it is stated.
    pub flux: Option<f64>,
    /// Unit of flux: `W` or `lm`.
    pub unit: &'static str,
    /// Their wavelengths.
    pub wavelengths: HeaderWavelengths,
}

/// A file that was scanned.
struct Scanned {
    format: &'static RayFormat,
    header: RayHeader,
    /// Factor from the powers that stand in the file to flux.
    scale: f64,
    /// Sum of these powers.
    sum: f64,
    /// Warning where the flux of the header is not that of the rays.
    warning: Option<String>,
}

impl Scanned {
    /// A ray of the file with its flux.
    fn scaled(&self, ray: RayRecord) -> RayRecord {
        RayRecord { flux: (f64::from(ray.flux) * self.scale) as f32, ..ray }
    }
}

/// Calls `take` for every ray of the file at `path` and the number of its spectral table, NaN where
/// it has none.
fn scan(path: &Path, mut take: impl FnMut(RayRecord, f32) -> Result<()>) -> Result<Scanned> {
    let mut file = open(path).context("expected rays, cannot open it")?;
    let length = file.metadata().context("cannot look at it")?.len();
    let format = RayFormat::from_path(path)?;
    let (header, sum) = (format.scan)(&mut file, length, &mut take)?;
    let (mut scale, mut warning) = (1.0, None);
    if let Some(flux) = header.flux
        && (sum - flux).abs() > FLUX_TOLERANCE * flux.abs().max(f64::MIN_POSITIVE)
    {
        let unit = header.unit;
        let stated = format!("the header states {flux:.6} {unit}");
        warning = Some(match format.flux {
            FluxRule::Checked => bail!(
                "flux in the header: expected the sum of the rays, {sum:.6} {unit}, got {flux:.6} {unit}"
            ),
            FluxRule::OfHeader if flux > 0.0 && sum > 0.0 => {
                scale = flux / sum;
                format!(
                    "{stated}, the powers of the rays are relative and add up to {sum:.6}; they are scaled to the header"
                )
            }
            FluxRule::OfHeader | FluxRule::OfRays => {
                format!("{stated}, the rays add up to {sum:.6} {unit}; the rays are taken")
            }
        });
    }
    Ok(Scanned { format, header, scale, sum, warning })
}

/// Unit of flux.
pub(super) fn unit(radiant: bool) -> &'static str {
    if radiant { "W" } else { "lm" }
}

/// Looks through the file at `path`.
///
/// # Errors
/// If it does not keep to its format, or its flux is not that of its header.
pub fn summary(path: &Path) -> Result<RaySummary> {
    let (mut rays, mut flux) = (0, 0.0);
    let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    let mut wavelengths = [f32::INFINITY, f32::NEG_INFINITY];
    let Scanned { format, header, scale, warning, .. } = scan(path, |ray, _| {
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
        format: format.name,
        rays,
        flux: flux * scale,
        stated: header.flux,
        unit: header.unit,
        light: header.wavelengths,
        wavelengths: wavelengths[0].is_finite().then_some(wavelengths),
        bounds,
        warnings: warning.into_iter().collect(),
    })
}

/// Statements of a written file on itself.
#[derive(Debug, Clone)]
pub struct RayMetadata {
    /// Name of the source.
    pub name: String,
    /// Origin of the rays.
    pub operation: String,
    /// One wavelength for all rays, nm; NaN where they have their own or none.
    pub wavelength_nm: f64,
    /// True where each ray has its own wavelength.
    pub per_ray: bool,
    /// Luminous flux of 1 W, lm; NaN if it is not known.
    pub lumens_per_watt: f64,
    /// True for flux in W; else in lm.
    pub radiant: bool,
}

impl RayMetadata {
    /// Metadata of rays traced in light of one wavelength, or of one for each.
    pub fn traced(design: &str, wavelength_nm: Option<f64>, lumens_per_watt: f64) -> Self {
        Self {
            name: design.to_owned(),
            operation: "rays that leave the package, traced".to_owned(),
            wavelength_nm: wavelength_nm.unwrap_or(f64::NAN),
            per_ray: wavelength_nm.is_none(),
            lumens_per_watt,
            radiant: true,
        }
    }

    /// A ray with the wavelength of all, where rays have none of their own.
    pub(super) fn coloured(&self, ray: &RayRecord) -> RayRecord {
        let wavelength = if self.per_ray { ray.wavelength } else { self.wavelength_nm as f32 };
        RayRecord { wavelength, ..*ray }
    }
}

/// Writes `path` in `format` with what `fill` hands over; returns the number of rays and their
/// flux.
///
/// # Errors
/// If `fill` fails, the format has no place for what the rays have, or the file cannot be written.
pub fn write(
    path: &Path,
    format: &RayFormat,
    about: &RayMetadata,
    fill: impl FnOnce(&mut dyn FnMut(&RayRecord) -> Result<()>) -> Result<()>,
) -> Result<(u64, f64)> {
    ensure!(
        about.radiant || format.has_lumens,
        "expected rays with flux in W, got lm, which is written into {} ray files alone",
        RayFormat::with_lumens()
    );
    ensure!(
        about.radiant || !about.per_ray,
        "expected rays with flux in W where each has its wavelength, got lm"
    );
    let mut written = (0, 0.0);
    write_atomic(path, |file| {
        written = (format.write)(file, path, about, Box::new(fill))?;
        Ok(())
    })?;
    Ok(written)
}

/// Rays that were converted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converted {
    /// Number of rays.
    pub rays: u64,
    /// Their flux.
    pub flux: f64,
    /// Unit of flux.
    pub unit: &'static str,
}

/// A part of the rays of a file, in whose place all of them can stand: rays are taken in equal
/// steps of the flux, from a random start on. A ray is taken as often as its flux asks for on the
/// mean, and all flux is kept.
#[derive(Debug, Clone, Copy)]
pub struct Subset {
    /// Number of rays.
    pub rays: u64,
    /// Seed of the start.
    pub seed: u64,
}

/// Writes the rays of one file, or a part of them, into another of `format`.
///
/// # Errors
/// If rays carry lumens or wavelengths that the format has no place for, or a file cannot be read
/// or written.
pub fn convert(
    from: &Path,
    to: &Path,
    format: &RayFormat,
    subset: Option<Subset>,
) -> Result<Converted> {
    let named = || from.display().to_string();
    let mut found: Option<f32> = None;
    let mut several = false;
    let scanned = scan(from, |ray, _| {
        if ray.wavelength.is_finite() {
            let first = *found.get_or_insert(ray.wavelength);
            several |= (ray.wavelength - first).abs() >= 1e-3;
        }
        Ok(())
    })
    .with_context(named)?;
    let radiant = scanned.header.unit == "W";
    let stem = from.file_stem().unwrap_or_default().to_string_lossy();
    let about = RayMetadata {
        name: stem.into_owned(),
        operation: format!("converted from a {}", scanned.format.name),
        wavelength_nm: found.filter(|_| !several).map_or(f64::NAN, f64::from),
        per_ray: several || (radiant && found.is_some() && format.needs_column),
        lumens_per_watt: f64::NAN,
        radiant,
    };
    let written = write(to, format, &about, |put| {
        let Some(Subset { rays, seed }) = subset else {
            return scan(from, |ray, _| put(&scanned.scaled(ray))).map(|_| ());
        };
        let start = random::unit(&mut random::stream(seed, 0));
        let step = scanned.sum / rays as f64;
        let (mut below, mut taken) = (0.0, 0.0);
        let taking = scan(from, |ray, _| {
            below += f64::from(ray.flux);
            // Steps whose place lies below.
            let steps = (below / step - start).ceil().clamp(taken, rays as f64);
            if steps > taken {
                let flux = ((steps - taken) * step) as f32;
                taken = steps;
                put(&scanned.scaled(RayRecord { flux, ..ray }))?;
            }
            Ok(())
        });
        taking.map(|_| ())
    });
    let (rays, flux) = written.with_context(named)?;
    Ok(Converted { rays, flux, unit: scanned.header.unit })
}
