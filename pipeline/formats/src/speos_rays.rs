// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays in the binary format of Speos.

pub mod layout;

use std::io::Read;
use std::path::Path;

use anyhow::Result;
use metrics::photopic;

use super::ray_files::{
    Fill, FluxRule, HeaderWavelengths, RayFormat, RayHeader, RayMetadata, Take, unit,
};
use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes};
use runtime::atomic_file::Sink;

static RAYS: RayFormat = RayFormat {
    name: "Speos ray file",
    flux: FluxRule::OfHeader,
    has_lumens: false,
    needs_column: false,
    scan,
    write,
};

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a Speos ray file",
    endings: &["ray"],
    sniff: Sniff::Layout(layout::begins_like_one),
    reads: Reads::Rays(&RAYS),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "speos-ray",
    help: "Rays: Speos, .ray",
    endings: &["ray"],
    writes: Writes::Rays(&RAYS),
};

fn scan(file: &mut dyn Read, length: u64, take: Take<'_>) -> Result<(RayHeader, f64)> {
    let mut reader = layout::SpeosReader::new(file, length)?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, f32::NAN)?;
    }
    let found = RayHeader {
        flux: Some(f64::from(reader.header().radiant_flux)),
        unit: unit(true),
        wavelengths: HeaderWavelengths::PerRay,
    };
    Ok((found, reader.sum()))
}

fn write(file: &mut dyn Sink, _: &Path, about: &RayMetadata, fill: Fill<'_>) -> Result<(u64, f64)> {
    let mut writer = layout::SpeosWriter::new(file)?;
    fill(&mut |ray| {
        let ray = about.coloured(ray);
        let seen = photopic::v(f64::from(ray.wavelength));
        let lumens = photopic::LUMENS_PER_WATT * seen * f64::from(ray.flux);
        Ok(writer.write(&ray, lumens)?)
    })?;
    Ok(writer.finish()?)
}
