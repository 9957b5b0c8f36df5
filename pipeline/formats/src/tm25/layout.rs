// SPDX-License-Identifier: MIT OR Apache-2.0
//! IES TM-25 ray files (`.tm25ray`), version 2013: a header, then one block of little-endian f32
//! columns for each ray.
//!
//! [`Tm25Reader`] and [`Tm25Writer`] pass rays one after another, so memory does not grow with the
//! file. Positions are in mm, flux in W (radiant) or lm (luminous).
//!
//! The text of TM-25-20 was not available; every public file carries version 2013. Layout: a
//! byte-level parse of a vendor's file of 100 000 rays whose every byte is accounted for, and the
//! public reference code of the format.

use crate::rays::{
    Counted, RayBlocks, RayFileError, RayRecord, RaySink, f32_at, u32_at, vector_at,
};
use crate::text::FormatError;
use std::io::{Read, Seek, Write};

/// The only known version.
pub const VERSION: u32 = 2013;
/// Bytes before the spectral tables.
const FIXED: u64 = 36_288;
/// Position of the luminous flux; the radiant flux and the number of rays follow it.
const LUMINOUS_AT: u64 = 12;
/// Code points of each of the nine descriptions.
const DESCRIPTION: usize = 1000;
/// Most spectral tables and extra columns that are accepted.
const MAX_COUNT: u32 = 1 << 16;

/// Columns beyond position and direction, in the order of a ray, with the number of f32 of each.
const COLUMNS: [(&str, usize); 6] = [
    ("radiant flux", 1),
    ("wavelength", 1),
    ("luminous flux", 1),
    ("Stokes", 6),
    ("tristimulus", 2),
    ("spectrum index", 1),
];

/// Spectral data of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spectrum {
    /// None.
    Unknown,
    /// One wavelength, nm.
    Single(f32),
    /// Each ray has its wavelength.
    PerRay,
    /// One table for all rays.
    Table,
    /// A table for each ray.
    Tables,
}

/// The header of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Tm25Header {
    /// Luminous flux, lm; NaN if unknown.
    pub luminous_flux: f32,
    /// Radiant flux, W; NaN if unknown.
    pub radiant_flux: f32,
    /// Number of rays.
    pub rays: u64,
    /// Spectrum.
    pub spectrum: Spectrum,
    /// Flags of the columns, in the order of a ray.
    pub columns: [bool; 6],
    /// Number of columns beyond the standard ones.
    pub extra_columns: u32,
    /// Spectral tables in the order of the file: wavelength, nm, and relative power per nm.
    pub tables: Vec<Vec<[f32; 2]>>,
    /// Nine descriptions: name, maker, maker of the model, maker of the file, equipment, camera,
    /// operation, information, reference.
    pub descriptions: [String; 9],
}

impl Tm25Header {
    /// True if rays carry radiant flux (W); else luminous flux (lm).
    pub fn is_radiant(&self) -> bool {
        self.columns[0]
    }

    /// Flux of the kind that rays carry; `None` if unknown.
    pub fn flux(&self) -> Option<f32> {
        let flux = if self.is_radiant() { self.radiant_flux } else { self.luminous_flux };
        flux.is_finite().then_some(flux)
    }

    /// f32 columns of a ray.
    fn width(&self) -> usize {
        let chosen = COLUMNS.iter().zip(self.columns).filter(|(_, on)| *on);
        6 + chosen.map(|(c, _)| c.1).sum::<usize>() + self.extra_columns as usize
    }
}

/// Reads rays from a file.
pub struct Tm25Reader<R> {
    rays: RayBlocks<R>,
    header: Tm25Header,
    /// Spectrum index of the last ray; NaN without such a column.
    spectrum_index: f32,
}

fn utf32(bytes: &[u8]) -> String {
    (0..bytes.len() / 4)
        .map(|k| u32_at(bytes, 4 * k))
        .take_while(|c| *c != 0)
        .map(|c| char::from_u32(c).unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect()
}

/// Tm25Header, number of spectral tables and bytes of further text from the first bytes.
fn parse(fixed: &[u8]) -> Result<(Tm25Header, u32, u64), FormatError> {
    let code = |at: usize, what: &str, high: u32| -> Result<u32, FormatError> {
        let value = u32_at(fixed, at);
        if value <= high {
            Ok(value)
        } else {
            let expected = format!("{what}: 0 to {high}");
            Err(FormatError::offset(at as u64, expected, (value as i32).to_string()))
        }
    };
    let version = u32_at(fixed, 4);
    if version != VERSION {
        let expected = format!("version {VERSION}");
        return Err(FormatError::offset(4, expected, version.to_string()));
    }
    let rays = u64::from(u32_at(fixed, 20)) | u64::from(u32_at(fixed, 24)) << 32;
    let kind = code(60, "spectral identifier", 4)?;
    let wavelength = f32_at(fixed, 64);
    let flag = |k: usize| code(256 + 4 * k, "a flag", 1).map(|v| v == 1);
    for (k, what) in [(0, "flag of the position"), (1, "flag of the direction")] {
        if !flag(k)? {
            let offset = 256 + 4 * k as u64;
            return Err(FormatError::offset(offset, format!("{what}: 1"), "0"));
        }
    }
    let mut columns = [false; 6];
    for (k, column) in columns.iter_mut().enumerate() {
        *column = flag(k + 2)?;
    }
    if !columns[0] && !columns[2] {
        let got = "neither";
        return Err(FormatError::offset(264, "radiant or luminous flux of rays", got));
    }
    if (kind == 2 && !columns[1]) || (kind == 4 && !columns[5]) {
        let expected = "a column for the spectrum of each ray, as the spectral identifier says";
        return Err(FormatError::offset(60, expected, kind.to_string()));
    }
    let mut descriptions: [String; 9] = Default::default();
    for (k, description) in descriptions.iter_mut().enumerate() {
        *description = utf32(&fixed[288 + 4 * DESCRIPTION * k..][..4 * DESCRIPTION]);
    }
    let tables = code(76, "number of spectral tables", MAX_COUNT)?;
    let extra_text = u64::from(code(84, "bytes of further text", u32::MAX >> 1)?);
    code(56, "code of the start positions", 7)?;
    let header = Tm25Header {
        luminous_flux: f32_at(fixed, 12),
        radiant_flux: f32_at(fixed, 16),
        rays,
        spectrum: match kind {
            1 => Spectrum::Single(wavelength),
            2 => Spectrum::PerRay,
            3 => Spectrum::Table,
            4 => Spectrum::Tables,
            _ => Spectrum::Unknown,
        },
        columns,
        extra_columns: code(80, "number of further columns", MAX_COUNT)?,
        tables: Vec::new(),
        descriptions,
    };
    Ok((header, tables, extra_text))
}

impl<R: Read> Tm25Reader<R> {
    /// Reads the header. `length`, if known, is that of the whole file and is checked against what
    /// the header promises.
    ///
    /// # Errors
    /// If it is no such file, of another version, contradicts itself, or is of another length.
    pub fn new(source: R, length: Option<u64>) -> Result<Self, RayFileError> {
        let mut source = Counted::new(source);
        let start = source.part("a TM-25 header", 4)?;
        if start != b"TM25" {
            let got = format!("{:?}", String::from_utf8_lossy(&start));
            return Err(FormatError::offset(0, "\"TM25\"", got).into());
        }
        let mut fixed = start;
        fixed.extend(source.part("a TM-25 header", FIXED - 4)?);
        let (mut header, tables, extra_text) = parse(&fixed)?;
        let begin = source.offset;
        for _ in 0..tables {
            let count = source.part("the length of a spectral table", 4)?;
            let rows = source.part("a spectral table", 8 * u64::from(u32_at(&count, 0)))?;
            let rows = rows.chunks_exact(8).map(|row| [f32_at(row, 0), f32_at(row, 4)]);
            header.tables.push(rows.collect());
        }
        let used = source.offset - begin;
        source.part("the end of the spectral tables", used.next_multiple_of(32) - used)?;
        source.part("names of further columns", 512 * u64::from(header.extra_columns))?;
        source.part("further text", extra_text)?;
        let rays = RayBlocks::new(source, header.rays, 4 * header.width(), length)?;
        Ok(Self { rays, header, spectrum_index: f32::NAN })
    }

    /// The header.
    pub fn header(&self) -> &Tm25Header {
        &self.header
    }

    /// Sum of the fluxes of the rays read so far.
    pub fn sum(&self) -> f64 {
        self.rays.sum()
    }

    /// Number of the table of [`Tm25Header::tables`], from 1, that the file names as the spectrum
    /// of the ray read last; NaN where it names none.
    pub fn spectrum_index(&self) -> f32 {
        self.spectrum_index
    }

    /// The next ray; `None` after the last.
    ///
    /// # Errors
    /// If the file ends early or goes on after the last ray, or a ray is none.
    pub fn next_ray(&mut self) -> Result<Option<RayRecord>, RayFileError> {
        let header = &self.header;
        self.rays.next_ray(|bytes| {
            let mut wavelength = match header.spectrum {
                Spectrum::Single(wavelength) => wavelength,
                _ => f32::NAN,
            };
            let (mut at, mut flux) = (24, [0.0; 2]);
            for (k, ((_, count), on)) in COLUMNS.iter().zip(header.columns).enumerate() {
                if on {
                    match k {
                        0 => flux[0] = f32_at(bytes, at),
                        1 => wavelength = f32_at(bytes, at),
                        2 => flux[1] = f32_at(bytes, at),
                        5 => self.spectrum_index = f32_at(bytes, at),
                        _ => {}
                    }
                    at += 4 * count;
                }
            }
            RayRecord {
                position: vector_at(bytes, 0),
                direction: vector_at(bytes, 12),
                flux: flux[usize::from(!header.is_radiant())],
                wavelength,
            }
        })
    }
}

/// Metadata of a written file.
#[derive(Debug, Clone, PartialEq)]
pub struct Tm25Metadata {
    /// One wavelength for all rays, nm; NaN if it is not known.
    pub wavelength: f32,
    /// True where each ray has its own.
    pub per_ray: bool,
    /// Luminous flux of 1 W, lm.
    pub lumens_per_watt: f32,
    /// Date, as ISO 8601 has it, up to 27 characters; empty if unknown.
    pub date: String,
    /// The nine descriptions of [`Tm25Header::descriptions`].
    pub descriptions: [String; 9],
}

/// Writes rays with radiant flux, of one wavelength or each of its own.
pub struct Tm25Writer<W: Write + Seek> {
    sink: RaySink<W>,
    lumens_per_watt: f32,
    per_ray: bool,
}

impl<W: Write + Seek> Tm25Writer<W> {
    /// Writes a header whose number of rays and flux are filled in by [`Tm25Writer::finish`].
    ///
    /// # Errors
    /// If the sink fails.
    pub fn new(sink: W, about: &Tm25Metadata) -> Result<Self, RayFileError> {
        let mut header = vec![0_u8; FIXED as usize];
        let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, b"TM25");
        put(4, &VERSION.to_le_bytes());
        for (k, byte) in about.date.bytes().take(27).enumerate() {
            put(28 + k, &[byte]);
        }
        let kind = if about.per_ray { 2 } else { u32::from(about.wavelength.is_finite()) };
        put(60, &kind.to_le_bytes());
        for at in [64, 68, 72] {
            put(at, &about.wavelength.to_le_bytes());
        }
        for flag in 0..if about.per_ray { 4 } else { 3 } {
            put(256 + 4 * flag, &1_u32.to_le_bytes());
        }
        for (k, text) in about.descriptions.iter().enumerate() {
            for (c, character) in text.chars().take(DESCRIPTION - 1).enumerate() {
                let at = 288 + 4 * (DESCRIPTION * k + c);
                put(at, &u32::from(character).to_le_bytes());
            }
        }
        let &Tm25Metadata { per_ray, lumens_per_watt, .. } = about;
        Ok(Self { sink: RaySink::new(sink, &header)?, lumens_per_watt, per_ray })
    }

    /// Writes one ray; its wavelength is that of the file where each has not its own.
    ///
    /// # Errors
    /// If the sink fails.
    #[inline]
    pub fn write(&mut self, ray: &RayRecord) -> Result<(), RayFileError> {
        Ok(self.sink.push(ray, self.per_ray.then_some(ray.wavelength))?)
    }

    /// Writes what is left, fills in the header, and returns the number of rays and their flux in
    /// W.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn finish(self) -> Result<(u64, f64), RayFileError> {
        let late = |rays: u64, sum: f64| {
            let radiant = sum as f32;
            let luminous = radiant * self.lumens_per_watt;
            let fluxes = [luminous.to_le_bytes(), radiant.to_le_bytes()];
            [&fluxes.concat()[..], &rays.to_le_bytes()].concat()
        };
        Ok(self.sink.finish(&[], LUMINOUS_AT, late)?)
    }
}
