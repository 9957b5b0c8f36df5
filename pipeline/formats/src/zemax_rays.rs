// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays in the two formats of Zemax, binary and text.

pub mod layout;

use std::io::Read;
use std::path::Path;

use crate::text_rays;
use anyhow::{Result, ensure};

use super::ray_files::{
    Fill, FluxRule, HeaderWavelengths, RayFormat, RayHeader, RayMetadata, Take, unit,
};
use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes, program};
use runtime::atomic_file::Sink;

static RAYS: RayFormat = RayFormat {
    name: "Zemax ray file",
    flux: FluxRule::OfRays,
    has_lumens: true,
    needs_column: true,
    scan,
    write,
};

static TEXT: RayFormat = RayFormat {
    name: "Zemax text ray file",
    has_lumens: false,
    scan: scan_text,
    write: write_text,
    ..RAYS
};

/// Reads the binary format.
pub static READER: Reader = Reader {
    name: "a Zemax ray file",
    endings: &["dat", "sdf"],
    sniff: Sniff::Mark(|start| {
        let identifier = start.first_chunk().map(|four| u32::from_le_bytes(*four));
        identifier.is_some_and(|found| layout::IDENTIFIERS.contains(&found))
    }),
    reads: Reads::Rays(&RAYS),
};

/// Reads the text format.
pub static TEXT_READER: Reader = Reader {
    name: "a Zemax text ray file",
    endings: &["txt", "dat"],
    sniff: Sniff::Lines(text_rays::begins_like_zemax),
    reads: Reads::Rays(&TEXT),
};

/// Writes the binary format.
pub static WRITER: Writer = Writer {
    word: "zemax-ray",
    help: "Rays: Zemax, .sdf or .dat",
    endings: &["sdf", "dat"],
    writes: Writes::Rays(&RAYS),
};

/// Writes the text format.
pub static TEXT_WRITER: Writer = Writer {
    word: "zemax-ray-text",
    help: "Rays: Zemax text, .txt",
    endings: &["txt"],
    writes: Writes::Rays(&TEXT),
};

fn scan(file: &mut dyn Read, length: u64, take: Take<'_>) -> Result<(RayHeader, f64)> {
    let mut reader = layout::ZemaxReader::new(file, Some(length))?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    let header = reader.header();
    let found = RayHeader {
        flux: Some(f64::from(header.flux)).filter(|flux| flux.is_finite()),
        unit: unit(header.radiant),
        // The wavelength of the header is not used by the program itself.
        wavelengths: HeaderWavelengths::of_column(header.coloured),
    };
    Ok((found, reader.sum()))
}

/// Writes a file; one ending in `.sdf` has a wavelength for each ray where one is known.
fn write(
    file: &mut dyn Sink,
    path: &Path,
    about: &RayMetadata,
    fill: Fill<'_>,
) -> Result<(u64, f64)> {
    let spectral = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("sdf"));
    ensure!(
        spectral || !about.per_ray,
        "expected a file that ends in .sdf, as each ray has its wavelength, got `{}`",
        path.display()
    );
    let known = spectral && about.radiant && about.wavelength_nm.is_finite();
    let header = layout::ZemaxMetadata {
        description: format!("{}, {}", about.name, program()),
        wavelength: about.wavelength_nm as f32,
        coloured: about.per_ray || known,
        radiant: about.radiant,
    };
    let mut writer = layout::ZemaxWriter::new(file, &header)?;
    fill(&mut |ray| Ok(writer.write(&about.coloured(ray))?))?;
    Ok(writer.finish()?)
}

fn scan_text(file: &mut dyn Read, _: u64, take: Take<'_>) -> Result<(RayHeader, f64)> {
    let mut reader = text_rays::ZemaxTextReader::new(file)?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    let wavelengths = HeaderWavelengths::of_column(reader.is_coloured());
    Ok((RayHeader { flux: None, unit: unit(true), wavelengths }, reader.sum()))
}

fn write_text(
    file: &mut dyn Sink,
    _: &Path,
    about: &RayMetadata,
    fill: Fill<'_>,
) -> Result<(u64, f64)> {
    let mut writer = text_rays::TextRayWriter::zemax(file, about.per_ray)?;
    fill(&mut |ray| Ok(writer.write(ray)?))?;
    Ok(writer.finish()?)
}
