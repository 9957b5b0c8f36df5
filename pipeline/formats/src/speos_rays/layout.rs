// SPDX-License-Identifier: MIT OR Apache-2.0
//! Speos binary ray files (`.ray`): seven f32 before the rays, then eight for each ray: start in
//! mm, direction, wavelength in nm and flux in W, all little-endian.
//!
//! The header is the radiant flux of all rays, whose powers are weights, five numbers that public
//! code writes as 2 and passes over, and the luminous flux. It holds no mark and no number of rays:
//! a file is told from one of LightTools by what it holds, see [`begins_like_one`].
//!
//! Layout: the public converter `ansys/optical-automation` (`dpf_rayfile.py`,
//! `rayfile_converter.py`).

use crate::rays::{Counted, RayBlocks, RayFileError, RayRecord, RaySink, f32_at, vector_at};
use crate::text::FormatError;
use std::io::{Read, Seek, Write};

/// Bytes before the rays.
const HEADER: usize = 28;
/// Bytes of a ray.
const STRIDE: usize = 32;
/// First rays of which one tells a file.
const SEEN: usize = 16;
/// Bytes that public code writes between the two fluxes.
const UNUSED: [f32; 5] = [2.0; 5];

/// The header of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeosHeader {
    /// Number of rays, as the length of the file has it.
    pub rays: u64,
    /// Radiant flux, W.
    pub radiant_flux: f32,
    /// Luminous flux, lm.
    pub luminous_flux: f32,
}

/// True if a file of `length` bytes that begins with `start` is one: it holds whole rays, and one of
/// the first is a ray of light.
pub fn begins_like_one(start: &[u8], length: u64) -> bool {
    let body = length.checked_sub(HEADER as u64);
    let whole = body.is_some_and(|body| body > 0 && body.is_multiple_of(STRIDE as u64));
    if !whole || start.len() < HEADER + STRIDE {
        return false;
    }
    let is_ray = |ray: &[u8]| {
        let direction = [12, 16, 20].map(|at| f32_at(ray, at));
        let square = direction.iter().map(|d| d * d).sum::<f32>();
        (square - 1.0).abs() < 0.01 && (100.0..=100_000.0).contains(&f32_at(ray, 24))
    };
    let mut first = start[HEADER..].chunks_exact(STRIDE).take(SEEN);
    f32_at(start, 0) > 0.0 && first.any(is_ray)
}

/// Reads rays from a file.
pub struct SpeosReader<R> {
    rays: RayBlocks<R>,
    header: SpeosHeader,
}

impl<R: Read> SpeosReader<R> {
    /// Reads the header of a file of `length` bytes.
    ///
    /// # Errors
    /// If it is no such file: too short, without whole rays, or of a flux that is none.
    pub fn new(source: R, length: u64) -> Result<Self, RayFileError> {
        let mut source = Counted::new(source);
        let bytes = source.part("a Speos ray header", HEADER as u64)?;
        let body = length.saturating_sub(HEADER as u64);
        if !body.is_multiple_of(STRIDE as u64) {
            let expected = format!("whole rays of {STRIDE} bytes after the first {HEADER}");
            let got = format!("{} bytes more", body % STRIDE as u64);
            return Err(FormatError::offset(length, expected, got).into());
        }
        let header = SpeosHeader {
            rays: body / STRIDE as u64,
            radiant_flux: f32_at(&bytes, 0),
            luminous_flux: f32_at(&bytes, 24),
        };
        for (at, flux) in [(0, header.radiant_flux), (24, header.luminous_flux)] {
            if !(flux.is_finite() && flux >= 0.0) {
                return Err(FormatError::offset(at, "a flux of 0 or more", flux.to_string()).into());
            }
        }
        let rays = RayBlocks::new(source, header.rays, STRIDE, Some(length))?;
        Ok(Self { rays, header })
    }

    /// The header.
    pub fn header(&self) -> &SpeosHeader {
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
        self.rays.next_ray(|bytes| RayRecord {
            position: vector_at(bytes, 0),
            direction: vector_at(bytes, 12),
            flux: f32_at(bytes, 28),
            wavelength: f32_at(bytes, 24),
        })
    }
}

/// Writes rays with flux in W, each with its wavelength.
pub struct SpeosWriter<W: Write + Seek> {
    sink: RaySink<W>,
    lumens: f64,
}

impl<W: Write + Seek> SpeosWriter<W> {
    /// Writes a header whose fluxes are filled in by [`SpeosWriter::finish`].
    ///
    /// # Errors
    /// If the sink fails.
    pub fn new(sink: W) -> Result<Self, RayFileError> {
        Ok(Self { sink: RaySink::new(sink, &[0; HEADER])?, lumens: 0.0 })
    }

    /// Writes one ray with its wavelength; `lumens` is its luminous flux.
    ///
    /// # Errors
    /// If it has no wavelength, or the sink fails.
    #[inline]
    pub fn write(&mut self, ray: &RayRecord, lumens: f64) -> Result<(), RayFileError> {
        if !(ray.wavelength.is_finite() && ray.wavelength > 0.0) {
            let offset = HEADER as u64 + STRIDE as u64 * self.sink.rays() + 24;
            let got = ray.wavelength.to_string();
            return Err(FormatError::offset(offset, "a wavelength for every ray", got).into());
        }
        let ([x, y, z], [l, m, n]) = (ray.position, ray.direction);
        self.lumens += lumens;
        let row = [x, y, z, l, m, n, ray.wavelength, ray.flux];
        Ok(self.sink.push_row(&row, ray.flux)?)
    }

    /// Fills in the header, and returns the number of rays and their flux in W.
    ///
    /// # Errors
    /// If the sink fails.
    pub fn finish(self) -> Result<(u64, f64), RayFileError> {
        let lumens = self.lumens as f32;
        let late = |_, sum: f64| {
            let all = [&[sum as f32][..], &UNUSED, &[lumens]].concat();
            all.iter().flat_map(|v| v.to_le_bytes()).collect()
        };
        Ok(self.sink.finish(&[], 0, late)?)
    }
}
