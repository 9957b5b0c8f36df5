// SPDX-License-Identifier: MIT OR Apache-2.0
//! Common parts of the ray file formats: errors, checks of a ray, and blocks of little-endian
//! numbers.
//!
//! Files are read and written a megabyte at a time, so that a file may be larger than the memory.

pub use tracer::RayRecord;

use crate::text::{FormatError, Position};
use std::io::{self, Read, Seek, SeekFrom, Write};

/// Bytes read or written at once.
pub(crate) const BLOCK: usize = 1 << 20;

/// Errors of reading and writing ray files.
#[derive(Debug, thiserror::Error)]
pub enum RayFileError {
    /// The file does not keep to its format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Reading or writing failed.
    #[error("ray file could not be read or written: {0}")]
    Io(io::Error),
}

// The message holds its cause: as a source it would be printed twice.
impl From<io::Error> for RayFileError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Columns of a file beside start, direction and flux.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RayColumns {
    /// True if each ray has a wavelength.
    pub coloured: bool,
    /// True if flux is in W; else in lm.
    pub radiant: bool,
}

/// Units of length of LightTools from code 1 on, as its text form names them, with their millimetres.
pub(crate) const LIGHTTOOLS_UNITS: [(&str, f32); 7] = [
    ("millimeters", 1.0),
    ("centimeters", 10.0),
    ("meters", 1000.0),
    ("inches", 25.4),
    ("feet", 304.8),
    ("microns", 1e-3),
    ("nanometers", 1e-6),
];

/// The header of a file of LightTools, binary or text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightToolsHeader {
    /// True if flux is in W; else in lm.
    pub radiant: bool,
    /// True if each ray has a wavelength.
    pub coloured: bool,
    /// Origin of the rays, mm. Public code ignores it and takes starts as they stand; so does this
    /// crate.
    pub origin: [f32; 3],
    /// Flux of all rays; NaN where a text states none.
    pub flux: f32,
    /// Millimetres of the unit of length.
    pub millimetres: f32,
}

/// Millimetres of the units of length of Zemax: m, inch, cm, foot, mm.
pub(crate) const ZEMAX_MILLIMETRES: [f32; 5] = [1000.0, 25.4, 10.0, 304.8, 1.0];

/// A reader that counts the bytes read.
pub(crate) struct Counted<R> {
    inner: R,
    pub offset: u64,
}

impl<R: Read> Counted<R> {
    pub fn new(inner: R) -> Self {
        Self { inner, offset: 0 }
    }

    /// Fills as much of `bytes` as the file has.
    pub fn fill(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < bytes.len() {
            match self.inner.read(&mut bytes[filled..]) {
                Ok(0) => break,
                Ok(count) => filled += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.offset += filled as u64;
        Ok(filled)
    }

    /// Exactly `length` bytes, never allocating more than the file holds.
    pub fn part(&mut self, what: &str, length: u64) -> Result<Vec<u8>, RayFileError> {
        let start = self.offset;
        let mut bytes = Vec::new();
        (&mut self.inner).take(length).read_to_end(&mut bytes)?;
        self.offset += bytes.len() as u64;
        if (bytes.len() as u64) < length {
            let expected = format!("{length} bytes of {what}");
            return Err(FormatError::offset(start, expected, bytes.len().to_string()).into());
        }
        Ok(bytes)
    }
}

/// Reader of a known number of rays that are all of one length, in blocks, which sums their flux.
pub(crate) struct RayBlocks<R> {
    source: Counted<R>,
    block: Vec<u8>,
    /// Bytes of `block` that are used.
    used: usize,
    stride: usize,
    rays: u64,
    /// Rays that are not in `block` yet.
    left: u64,
    sum: f64,
}

impl<R: Read> RayBlocks<R> {
    /// Rays of `stride` bytes behind the header, which has been read; `length`, if known, is that
    /// of the whole file.
    pub fn new(
        source: Counted<R>,
        rays: u64,
        stride: usize,
        length: Option<u64>,
    ) -> Result<Self, FormatError> {
        let bytes = u128::from(source.offset) + u128::from(rays) * stride as u128;
        if let Some(length) = length
            && u128::from(length) != bytes
        {
            let expected = format!("{bytes} bytes in all ({rays} rays of {stride})");
            return Err(FormatError::offset(source.offset, expected, length.to_string()));
        }
        Ok(Self { source, block: Vec::new(), used: 0, stride, rays, left: rays, sum: 0.0 })
    }

    /// Sum of the fluxes of the rays read so far.
    pub fn sum(&self) -> f64 {
        self.sum
    }

    /// The next ray, which `record` finds in its bytes; `None` after the last.
    pub fn next_ray(
        &mut self,
        record: impl FnOnce(&[u8]) -> RayRecord,
    ) -> Result<Option<RayRecord>, RayFileError> {
        let Some((bytes, offset)) = self.next()? else {
            return Ok(None);
        };
        let ray = checked(record(bytes), offset)?;
        self.sum += f64::from(ray.flux);
        Ok(Some(ray))
    }

    /// The bytes of the next ray and their offset; `None` after the last.
    fn next(&mut self) -> Result<Option<(&[u8], u64)>, RayFileError> {
        if self.used == self.block.len() {
            let rays = self.left.min((BLOCK / self.stride) as u64);
            self.block.resize(rays as usize * self.stride, 0);
            let filled = self.source.fill(&mut self.block)?;
            if filled < self.block.len() {
                let expected = format!("{} rays of {} bytes", self.rays, self.stride);
                let whole = self.rays - self.left + (filled / self.stride) as u64;
                let got = format!("the end after {whole} rays");
                return Err(FormatError::offset(self.source.offset, expected, got).into());
            }
            (self.used, self.left) = (0, self.left - rays);
            if rays == 0 {
                let more = self.source.fill(&mut [0])?;
                if more > 0 {
                    let offset = self.source.offset - 1;
                    let expected = format!("the end after {} rays", self.rays);
                    return Err(FormatError::offset(offset, expected, "more bytes").into());
                }
                return Ok(None);
            }
        }
        let offset = self.source.offset - (self.block.len() - self.used) as u64;
        let at = self.used;
        self.used += self.stride;
        Ok(Some((&self.block[at..self.used], offset)))
    }
}

/// Writer of rays in blocks, which counts them and sums their flux for the header.
pub(crate) struct RaySink<W> {
    inner: W,
    start: u64,
    block: Vec<u8>,
    rays: u64,
    sum: f64,
}

impl<W: Write + Seek> RaySink<W> {
    /// Writes `header`; [`RaySink::finish`] fills in the number of rays and their flux.
    pub fn new(mut inner: W, header: &[u8]) -> io::Result<Self> {
        let start = inner.stream_position()?;
        inner.write_all(header)?;
        Ok(Self { inner, start, block: Vec::with_capacity(BLOCK + 32), rays: 0, sum: 0.0 })
    }

    /// Rays written so far.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Writes position, direction and flux of one ray, and its wavelength if it is stated.
    #[inline]
    pub fn push(&mut self, ray: &RayRecord, wavelength: Option<f32>) -> io::Result<()> {
        let ([x, y, z], [l, m, n]) = (ray.position, ray.direction);
        let row = [x, y, z, l, m, n, ray.flux, wavelength.unwrap_or_default()];
        self.push_row(&row[..7 + usize::from(wavelength.is_some())], ray.flux)
    }

    /// Writes the columns of one ray of this flux.
    #[inline]
    pub fn push_row(&mut self, columns: &[f32], flux: f32) -> io::Result<()> {
        for value in columns {
            self.block.extend_from_slice(&value.to_le_bytes());
        }
        self.count(flux)
    }

    /// Writes the columns of one ray of this flux as a line of text.
    pub fn push_line(&mut self, columns: &[f32], flux: f32) -> io::Result<()> {
        for (number, value) in columns.iter().enumerate() {
            write!(self.block, "{}{value:e}", if number > 0 { " " } else { "" })?;
        }
        self.block.push(b'\n');
        self.count(flux)
    }

    #[inline]
    fn count(&mut self, flux: f32) -> io::Result<()> {
        self.rays += 1;
        self.sum += f64::from(flux);
        if self.block.len() >= BLOCK {
            self.inner.write_all(&self.block)?;
            self.block.clear();
        }
        Ok(())
    }

    /// Writes the last block and `end`, then `late(rays, flux)` at byte `at` of the header; returns
    /// the number of rays and their flux.
    pub fn finish(
        mut self,
        end: &[u8],
        at: u64,
        late: impl FnOnce(u64, f64) -> Vec<u8>,
    ) -> io::Result<(u64, f64)> {
        self.block.extend_from_slice(end);
        self.inner.write_all(&self.block)?;
        self.inner.seek(SeekFrom::Start(self.start + at))?;
        self.inner.write_all(&late(self.rays, self.sum))?;
        self.inner.seek(SeekFrom::End(0))?;
        self.inner.flush()?;
        Ok((self.rays, self.sum))
    }
}

/// The f32 at `at` of at least `at + 4` bytes.
pub(crate) fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}

/// Three of them.
pub(crate) fn vector_at(bytes: &[u8], at: usize) -> [f32; 3] {
    [0, 4, 8].map(|k| f32_at(bytes, at + k))
}

/// The u32 at `at` of at least `at + 4` bytes.
pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Checks position, direction and flux of the ray at `offset`; brings the direction to unit length.
pub(crate) fn checked(ray: RayRecord, offset: u64) -> Result<RayRecord, FormatError> {
    sound(ray, |within| Position::Offset(offset + within))
}

/// The same with the place of a byte within the binary ray as `place` has it.
pub(crate) fn sound(
    mut ray: RayRecord,
    place: impl Fn(u64) -> Position,
) -> Result<RayRecord, FormatError> {
    let refused = |within: u64, expected: &str, got: String| {
        Err(FormatError { at: place(within), expected: expected.to_owned(), got })
    };
    if !ray.position.iter().all(|p| p.is_finite()) {
        return refused(0, "a finite position", format!("{:?}", ray.position));
    }
    let length = ray.direction.iter().map(|d| d * d).sum::<f32>().sqrt();
    if !(0.99..=1.01).contains(&length) {
        return refused(12, "a unit vector", format!("{:?}, length {length}", ray.direction));
    }
    if !(ray.flux.is_finite() && ray.flux >= 0.0) {
        return refused(24, "a flux of 0 or more", ray.flux.to_string());
    }
    for component in &mut ray.direction {
        *component /= length;
    }
    Ok(ray)
}
