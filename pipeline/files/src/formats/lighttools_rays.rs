// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays in the binary format of LightTools.

use std::io::Read;
use std::path::Path;

use anyhow::Result;
use tracer::formats::lighttools_rays as layout;

use super::ray_files::{
    Fill, HeaderWavelengths, RayFormat, RayHeader, RayMetadata, Take, WavelengthColumn, unit,
};
use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes};
use crate::atomic_file::Sink;

static RAYS: RayFormat = RayFormat {
    name: "LightTools ray file",
    checks_flux: true,
    has_lumens: false,
    wavelengths: WavelengthColumn::Never,
    scan,
    write,
};

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a LightTools ray file",
    endings: &["ray"],
    sniff: Sniff::Mark(|start| start.starts_with(b"LTRF")),
    reads: Reads::Rays(&RAYS),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "ray",
    help: "Rays: LightTools, .ray",
    endings: &["ray"],
    writes: Writes::Rays(&RAYS),
};

fn scan(file: &mut dyn Read, _: u64, take: Take<'_>) -> Result<(RayHeader, f64)> {
    let mut reader = layout::LightToolsReader::new(file)?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    let header = reader.header();
    let found = RayHeader {
        flux: Some(f64::from(header.flux)),
        unit: unit(header.radiant),
        wavelengths: HeaderWavelengths::of_column(header.coloured),
    };
    Ok((found, reader.sum()))
}

fn write(file: &mut dyn Sink, _: &Path, _: &RayMetadata, fill: Fill<'_>) -> Result<(u64, f64)> {
    let mut writer = layout::LightToolsWriter::new(file)?;
    fill(&mut |ray| Ok(writer.write(ray)?))?;
    Ok(writer.finish()?)
}
