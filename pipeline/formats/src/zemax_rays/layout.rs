// SPDX-License-Identifier: MIT OR Apache-2.0
//! Zemax binary ray files (`.dat`, `.sdf`): a header of 208 bytes, then seven or eight
//! little-endian f32 for each ray.
//!
//! Makers of LEDs publish these files. The program itself uses of the header the number of rays,
//! the unit of length, and whether rays carry flux alone (in W or lm) or a wavelength too (then in
//! W). So does [`ZemaxReader`]: the flux in the header is told and not used, and the wavelength
//! there is passed over, since makers write what they like there. [`ZemaxWriter`] fills in both.
//!
//! Layout: the vendor's support article "Converting a binary Source File into ASCII" and the public
//! code of TM25RaySetTools (`ZemaxBinary.h`).

use crate::rays::{
    Counted, RayBlocks, RayFileError, RayRecord, RaySink, ZEMAX_MILLIMETRES, f32_at, u32_at,
    vector_at,
};
use crate::text::FormatError;
use std::io::{Read, Seek, Write};

/// First bytes of a file: the format's number now and that of older files.
pub const IDENTIFIERS: [u32; 2] = [1010, 8_675_309];
/// Bytes before the rays.
const HEADER: usize = 208;
/// Bytes of the description.
const DESCRIPTION: usize = 100;
/// Code of millimetres.
const IN_MILLIMETRES: u32 = 4;
/// Most rays of a file.
const MAX_RAYS: u64 = 4_000_000_000;

/// The header of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ZemaxHeader {
    /// Number of rays.
    pub rays: u64,
    /// Description of the source.
    pub description: String,
    /// Flux of the rays as stated, in the unit of the rays.
    pub flux: f32,
    /// True if each ray has a wavelength.
    pub coloured: bool,
    /// True if flux is in W; else in lm.
    pub radiant: bool,
    /// Millimetres of the unit of length.
    pub millimetres: f32,
}

/// Reads rays from a file.
pub struct ZemaxReader<R> {
    rays: RayBlocks<R>,
    header: ZemaxHeader,
}

impl<R: Read> ZemaxReader<R> {
    /// Reads the header. `length`, if known, is that of the whole file and is checked against the
    /// number of rays.
    ///
    /// # Errors
    /// If it is no such file, or of another length.
    pub fn new(source: R, length: Option<u64>) -> Result<Self, RayFileError> {
        let mut source = Counted::new(source);
        let bytes = source.part("a Zemax ray header", HEADER as u64)?;
        let code = |at: usize, expected: &str, allowed: &[u32]| {
            let value = u32_at(&bytes, at);
            if allowed.contains(&value) {
                Ok(value)
            } else {
                Err(FormatError::offset(at as u64, expected, value.to_string()))
            }
        };
        code(0, "1010 or 8675309, as Zemax ray files begin", &IDENTIFIERS)?;
        let unit = code(136, "a unit of length from 0 to 4", &[0, 1, 2, 3, 4])?;
        let coloured = code(192, "ray format 0 (flux) or 2 (with wavelengths)", &[0, 2])? == 2;
        let luminous = code(196, "flux type 0 (W) or 1 (lm)", &[0, 1])? == 1;
        let description = bytes[8..8 + DESCRIPTION].iter().map_while(|&b| {
            let printed = b > 0;
            printed.then_some(char::from(b))
        });
        let header = ZemaxHeader {
            rays: u64::from(u32_at(&bytes, 4)),
            description: description.collect::<String>().trim_end().to_owned(),
            flux: f32_at(&bytes, 112),
            coloured,
            radiant: coloured || !luminous,
            millimetres: ZEMAX_MILLIMETRES[unit as usize],
        };
        let stride = if coloured { 32 } else { 28 };
        let rays = RayBlocks::new(source, header.rays, stride, length)?;
        Ok(Self { rays, header })
    }

    /// The header.
    pub fn header(&self) -> &ZemaxHeader {
        &self.header
    }

    /// Sum of the fluxes of the rays read so far.
    pub fn sum(&self) -> f64 {
        self.rays.sum()
    }

    /// The next ray; `None` after the last.
    ///
    /// # Errors
    /// If the file ends early or goes on after the last ray, or a ray is none.
    pub fn next_ray(&mut self) -> Result<Option<RayRecord>, RayFileError> {
        let ZemaxHeader { millimetres, coloured, .. } = self.header;
        self.rays.next_ray(|bytes| RayRecord {
            position: vector_at(bytes, 0).map(|p| p * millimetres),
            direction: vector_at(bytes, 12),
            flux: f32_at(bytes, 24),
            wavelength: if coloured { 1e3 * f32_at(bytes, 28) } else { f32::NAN },
        })
    }
}

/// Metadata of a written file.
#[derive(Debug, Clone, PartialEq)]
pub struct ZemaxMetadata {
    /// Description, up to 99 characters of ASCII.
    pub description: String,
    /// One wavelength for all rays, nm; NaN where there is none.
    pub wavelength: f32,
    /// True if each ray is written with its own wavelength.
    pub coloured: bool,
    /// True if flux is in W; else in lm, which rays with wavelengths cannot have.
    pub radiant: bool,
}

/// Writes rays, in millimetres.
pub struct ZemaxWriter<W: Write + Seek> {
    sink: RaySink<W>,
    coloured: bool,
    description: [u8; DESCRIPTION],
}

impl<W: Write + Seek> ZemaxWriter<W> {
    /// Writes a header whose number of rays and flux are filled in by [`ZemaxWriter::finish`].
    ///
    /// # Errors
    /// If the sink fails.
    pub fn new(sink: W, about: &ZemaxMetadata) -> Result<Self, RayFileError> {
        let mut header = vec![0_u8; HEADER];
        let mut put = |at: usize, bytes: [u8; 4]| header[at..at + 4].copy_from_slice(&bytes);
        put(0, IDENTIFIERS[0].to_le_bytes());
        if about.wavelength.is_finite() && !about.coloured {
            put(116, (1e-3 * about.wavelength).to_le_bytes());
        }
        put(136, IN_MILLIMETRES.to_le_bytes());
        put(192, (2 * u32::from(about.coloured)).to_le_bytes());
        let luminous = !about.radiant && !about.coloured;
        put(196, u32::from(luminous).to_le_bytes());
        let mut description = [0; DESCRIPTION];
        let printed = about.description.chars().filter(char::is_ascii);
        for (slot, character) in description[..DESCRIPTION - 1].iter_mut().zip(printed) {
            *slot = character as u8;
        }
        Ok(Self { sink: RaySink::new(sink, &header)?, coloured: about.coloured, description })
    }

    /// Writes one ray.
    ///
    /// # Errors
    /// If the sink fails.
    #[inline]
    pub fn write(&mut self, ray: &RayRecord) -> Result<(), RayFileError> {
        Ok(self.sink.push(ray, self.coloured.then_some(1e-3 * ray.wavelength))?)
    }

    /// Fills in the header, and returns the number of rays and their flux.
    ///
    /// # Errors
    /// If there are more rays than the format can count, or the sink fails.
    pub fn finish(self) -> Result<(u64, f64), RayFileError> {
        let rays = self.sink.rays();
        if rays > MAX_RAYS {
            let expected = format!("at most {MAX_RAYS} rays in a Zemax file");
            return Err(FormatError::offset(4, expected, rays.to_string()).into());
        }
        let description = self.description;
        let late = |rays: u64, sum: f64| {
            let mut bytes = (rays as u32).to_le_bytes().to_vec();
            bytes.extend(description);
            // Flux of the source, and of this set of rays.
            bytes.extend([(sum as f32).to_le_bytes(); 2].concat());
            bytes
        };
        Ok(self.sink.finish(&[], 4, late)?)
    }
}
