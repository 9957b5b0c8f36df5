// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays in the two formats of LightTools, binary and text.

pub mod layout;

use std::io::Read;
use std::path::Path;

use crate::rays::RayColumns;
use crate::text_rays;
use anyhow::Result;

use super::ray_files::{
    Fill, FluxRule, HeaderWavelengths, RayFormat, RayHeader, RayMetadata, Take, unit,
};
use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes, program};
use runtime::atomic_file::Sink;

static RAYS: RayFormat = RayFormat {
    name: "LightTools ray file",
    flux: FluxRule::OfHeader,
    has_lumens: true,
    needs_column: true,
    scan,
    write,
};

static TEXT: RayFormat =
    RayFormat { name: "LightTools text ray file", scan: scan_text, write: write_text, ..RAYS };

/// Reads the binary format.
pub static READER: Reader = Reader {
    name: "a LightTools ray file",
    endings: &["ray"],
    sniff: Sniff::Mark(|start| start.starts_with(b"LTRF")),
    reads: Reads::Rays(&RAYS),
};

/// Reads the text format.
pub static TEXT_READER: Reader = Reader {
    name: "a LightTools text ray file",
    endings: &["ray", "txt"],
    sniff: Sniff::Lines(|lines| lines.iter().any(|line| line.starts_with("lt_"))),
    reads: Reads::Rays(&TEXT),
};

/// Writes the binary format.
pub static WRITER: Writer = Writer {
    word: "ray",
    help: "Rays: LightTools, .ray",
    endings: &["ray"],
    writes: Writes::Rays(&RAYS),
};

/// Writes the text format.
pub static TEXT_WRITER: Writer = Writer {
    word: "ray-text",
    help: "Rays: LightTools text, .ray or .txt",
    endings: &["ray", "txt"],
    writes: Writes::Rays(&TEXT),
};

fn stated(header: &layout::LightToolsHeader) -> RayHeader {
    RayHeader {
        flux: Some(f64::from(header.flux)).filter(|flux| flux.is_finite()),
        unit: unit(header.radiant),
        wavelengths: HeaderWavelengths::of_column(header.coloured),
    }
}

fn scan(file: &mut dyn Read, _: u64, take: Take<'_>) -> Result<(RayHeader, f64)> {
    let mut reader = layout::LightToolsReader::new(file)?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    Ok((stated(reader.header()), reader.sum()))
}

fn scan_text(file: &mut dyn Read, _: u64, take: Take<'_>) -> Result<(RayHeader, f64)> {
    let mut reader = text_rays::LightToolsTextReader::new(file)?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    Ok((stated(&reader.header()), reader.sum()))
}

fn columns(about: &RayMetadata) -> RayColumns {
    RayColumns { coloured: about.per_ray, radiant: about.radiant }
}

fn write(file: &mut dyn Sink, _: &Path, about: &RayMetadata, fill: Fill<'_>) -> Result<(u64, f64)> {
    let mut writer = layout::LightToolsWriter::with_columns(file, columns(about))?;
    fill(&mut |ray| Ok(writer.write(ray)?))?;
    Ok(writer.finish()?)
}

fn write_text(
    file: &mut dyn Sink,
    _: &Path,
    about: &RayMetadata,
    fill: Fill<'_>,
) -> Result<(u64, f64)> {
    let name = format!("{}, {}", about.name, program());
    let mut writer = text_rays::TextRayWriter::lighttools(file, &name, columns(about))?;
    fill(&mut |ray| Ok(writer.write(ray)?))?;
    Ok(writer.finish()?)
}
