// SPDX-License-Identifier: MIT OR Apache-2.0
//! LightTools binary ray files (`.ray`), version 2.0: a short header, seven or eight little-endian
//! f32 for each ray, and an end mark.
//!
//! [`LightToolsReader`] and [`LightToolsWriter`] pass rays one after another, so memory does not
//! grow with the file. The file does not state how many rays it holds: they go on until the end
//! mark.
//!
//! The program writes the flux of all rays into the header and powers beside each other into the
//! rays: their sum is the header times the number of rays. The reader hands both on.
//!
//! Layout: the public code of TM25RaySetTools.

pub use crate::rays::LightToolsHeader;
use crate::rays::{
    BLOCK, Counted, LIGHTTOOLS_UNITS, RayColumns, RayFileError, RayRecord, RaySink, checked,
    f32_at, u32_at, vector_at,
};
use crate::text::FormatError;
use std::io::{Read, Seek, Write};

const MAGIC: &[u8; 4] = b"LTRF";
const END: &[u8; 7] = b"LTRFEND";
/// Bytes before the rays.
const HEADER: usize = 44;
/// Position of the flux.
const FLUX_AT: u64 = 40;

/// Reads rays from a file.
pub struct LightToolsReader<R> {
    source: Counted<R>,
    header: LightToolsHeader,
    block: Vec<u8>,
    used: usize,
    at_end: bool,
    sum: f64,
}

impl<R: Read> LightToolsReader<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// If it is no such file, of another version or in other units than millimetres.
    pub fn new(source: R) -> Result<Self, RayFileError> {
        let mut source = Counted::new(source);
        let bytes = source.part("a LightTools ray header", HEADER as u64)?;
        if &bytes[..4] != MAGIC {
            let got = format!("{:?}", String::from_utf8_lossy(&bytes[..4]));
            return Err(FormatError::offset(0, "\"LTRF\"", got).into());
        }
        let code = |at: usize, expected: &str, range: std::ops::RangeInclusive<u32>| {
            let value = u32_at(&bytes, at);
            if range.contains(&value) {
                Ok(value)
            } else {
                Err(FormatError::offset(at as u64, expected, value.to_string()))
            }
        };
        code(4, "major version 2", 2..=2)?;
        code(8, "minor version 0", 0..=0)?;
        let radiant = code(12, "data type 0 (W) or 1 (lm)", 0..=1)? == 0;
        code(16, "far field 0 (rays with their starts)", 0..=0)?;
        let colour = code(20, "colour information 0 (none) or 2 (wavelengths)", 0..=2)?;
        if colour == 1 {
            let expected = "colour information 0 (none) or 2 (wavelengths)";
            return Err(FormatError::offset(20, expected, "1 (tristimulus values)").into());
        }
        let unit =
            code(24, "a unit of length from 1 (mm) to 7 (nm)", 1..=LIGHTTOOLS_UNITS.len() as u32)?;
        let header = LightToolsHeader {
            radiant,
            coloured: colour == 2,
            origin: [28, 32, 36].map(|at| f32_at(&bytes, at)),
            flux: f32_at(&bytes, 40),
            millimetres: LIGHTTOOLS_UNITS[unit as usize - 1].1,
        };
        if !header.origin.iter().all(|o| o.is_finite()) {
            let got = format!("{:?}", header.origin);
            return Err(FormatError::offset(28, "a finite origin", got).into());
        }
        if !(header.flux.is_finite() && header.flux >= 0.0) {
            let got = header.flux.to_string();
            return Err(FormatError::offset(FLUX_AT, "a flux of 0 or more", got).into());
        }
        Ok(Self { source, header, block: Vec::new(), used: 0, at_end: false, sum: 0.0 })
    }

    /// The header.
    pub fn header(&self) -> &LightToolsHeader {
        &self.header
    }

    /// Sum of the fluxes of the rays read so far.
    pub fn sum(&self) -> f64 {
        self.sum
    }

    /// The next ray; `None` after the last.
    ///
    /// # Errors
    /// If the file does not end with its end mark after whole rays, or a ray is none.
    pub fn next_ray(&mut self) -> Result<Option<RayRecord>, RayFileError> {
        let stride = if self.header.coloured { 32 } else { 28 };
        // Less than a ray and the end mark is left: append the next block.
        if self.block.len() - self.used < stride + END.len() && !self.at_end {
            self.block.drain(..self.used);
            self.used = 0;
            let before = self.block.len();
            self.block.resize(before + BLOCK, 0);
            let filled = self.source.fill(&mut self.block[before..])?;
            self.block.truncate(before + filled);
            self.at_end = filled < BLOCK;
        }
        let rest = &self.block[self.used..];
        let offset = self.source.offset - rest.len() as u64;
        if self.at_end && rest.len() < stride + END.len() {
            if rest == END {
                return Ok(None);
            }
            let expected = format!("\"LTRFEND\" after whole rays of {stride} bytes");
            let got = format!("{} bytes without it at the end", rest.len());
            return Err(FormatError::offset(offset, expected, got).into());
        }
        let ray = RayRecord {
            position: vector_at(rest, 0).map(|p| p * self.header.millimetres),
            direction: vector_at(rest, 12),
            flux: f32_at(rest, 24),
            wavelength: if self.header.coloured { f32_at(rest, 28) } else { f32::NAN },
        };
        self.used += stride;
        let ray = checked(ray, offset)?;
        self.sum += f64::from(ray.flux);
        Ok(Some(ray))
    }
}

/// Writes rays in millimetres.
pub struct LightToolsWriter<W: Write + Seek> {
    sink: RaySink<W>,
    columns: RayColumns,
}

impl<W: Write + Seek> LightToolsWriter<W> {
    /// Writer of rays with flux in W and without wavelengths.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn new(sink: W) -> Result<Self, RayFileError> {
        Self::with_columns(sink, RayColumns { coloured: false, radiant: true })
    }

    /// Writes a header whose flux is filled in by [`LightToolsWriter::finish`].
    ///
    /// # Errors
    /// If the sink fails.
    pub fn with_columns(sink: W, columns: RayColumns) -> Result<Self, RayFileError> {
        let mut header = MAGIC.to_vec();
        let RayColumns { coloured, radiant } = columns;
        // Version 2.0, W or lm, positions count, colour, millimetres.
        for code in [2, 0, u32::from(!radiant), 0, 2 * u32::from(coloured), 1] {
            header.extend(code.to_le_bytes());
        }
        header.resize(HEADER, 0);
        Ok(Self { sink: RaySink::new(sink, &header)?, columns })
    }

    /// Writes one ray.
    ///
    /// # Errors
    /// If the sink fails.
    #[inline]
    pub fn write(&mut self, ray: &RayRecord) -> Result<(), RayFileError> {
        Ok(self.sink.push(ray, self.columns.coloured.then_some(ray.wavelength))?)
    }

    /// Writes the end mark, fills in the header, and returns the number of rays and their flux.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn finish(self) -> Result<(u64, f64), RayFileError> {
        let flux = |_, sum: f64| (sum as f32).to_le_bytes().to_vec();
        Ok(self.sink.finish(END, FLUX_AT, flux)?)
    }
}
