// SPDX-License-Identifier: MIT OR Apache-2.0
//! Common parts of the ray file formats: errors, checks of a ray, and blocks of little-endian
//! numbers.
//!
//! Files are read and written a megabyte at a time, so that a file may be larger than the memory.

pub use crate::source::RayRecord;

use super::FormatError;
use std::io::{self, Read, Seek, SeekFrom, Write};

/// Bytes read or written at once.
pub(super) const BLOCK: usize = 1 << 20;

/// Errors of reading and writing ray files.
#[derive(Debug, thiserror::Error)]
pub enum RayFileError {
    /// The file does not keep to its format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Reading or writing failed.
    #[error("ray file could not be read or written: {0}")]
    Io(#[from] io::Error),
}

/// A reader that counts the bytes read.
pub(super) struct Counted<R> {
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

/// Writer of rays in blocks, which counts them and sums their flux for the header.
pub(super) struct RaySink<W> {
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
        Ok(Self {
            inner,
            start,
            block: Vec::with_capacity(BLOCK + 28),
            rays: 0,
            sum: 0.0,
        })
    }

    /// Writes position, direction and flux of one ray.
    #[inline]
    pub fn push(&mut self, ray: &RayRecord) -> io::Result<()> {
        for value in ray.position.iter().chain(&ray.direction).chain([&ray.flux]) {
            self.block.extend_from_slice(&value.to_le_bytes());
        }
        self.rays += 1;
        self.sum += f64::from(ray.flux);
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
pub(super) fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}

/// The u32 at `at` of at least `at + 4` bytes.
pub(super) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Checks position, direction and flux of the ray at `offset`; brings the direction to unit length.
pub(super) fn checked(mut ray: RayRecord, offset: u64) -> Result<RayRecord, FormatError> {
    if !ray.position.iter().all(|p| p.is_finite()) {
        let got = format!("{:?}", ray.position);
        return Err(FormatError::offset(offset, "a finite position", got));
    }
    let length = ray.direction.iter().map(|d| d * d).sum::<f32>().sqrt();
    if !(0.99..=1.01).contains(&length) {
        let got = format!("{:?}, length {length}", ray.direction);
        return Err(FormatError::offset(offset + 12, "a unit vector", got));
    }
    if !(ray.flux.is_finite() && ray.flux >= 0.0) {
        let got = ray.flux.to_string();
        return Err(FormatError::offset(offset + 24, "a flux of 0 or more", got));
    }
    for component in &mut ray.direction {
        *component /= length;
    }
    Ok(ray)
}
