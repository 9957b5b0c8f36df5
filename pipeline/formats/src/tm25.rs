// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays as IES TM-25.

pub mod layout;

use std::io::Read;
use std::path::Path;

use anyhow::Result;

use super::ray_files::{
    Fill, FluxRule, HeaderWavelengths, RayFormat, RayHeader, RayMetadata, Take, unit,
};
use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes, program};
use runtime::atomic_file::Sink;

static RAYS: RayFormat = RayFormat {
    name: "TM-25 ray file",
    flux: FluxRule::Checked,
    has_lumens: false,
    needs_column: false,
    scan,
    write,
};

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a TM-25 ray file",
    endings: &["tm25ray"],
    sniff: Sniff::Mark(|start| start.starts_with(b"TM25")),
    reads: Reads::Rays(&RAYS),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "tm25",
    help: "Rays: TM-25, .tm25ray",
    endings: &["tm25ray"],
    writes: Writes::Rays(&RAYS),
};

fn scan(file: &mut dyn Read, length: u64, take: Take<'_>) -> Result<(RayHeader, f64)> {
    let mut reader = layout::Tm25Reader::new(file, Some(length))?;
    while let Some(ray) = reader.next_ray()? {
        take(ray, reader.spectrum_index())?;
    }
    let header = reader.header();
    let tables = || header.tables.clone();
    let found = RayHeader {
        flux: header.flux().map(f64::from),
        unit: unit(header.is_radiant()),
        wavelengths: match header.spectrum {
            layout::Spectrum::Unknown => HeaderWavelengths::Nothing,
            layout::Spectrum::Single(nm) => HeaderWavelengths::One(nm),
            layout::Spectrum::PerRay => HeaderWavelengths::PerRay,
            layout::Spectrum::Table => HeaderWavelengths::Tables(tables(), false),
            layout::Spectrum::Tables => HeaderWavelengths::Tables(tables(), true),
        },
    };
    Ok((found, reader.sum()))
}

fn write(file: &mut dyn Sink, _: &Path, about: &RayMetadata, fill: Fill<'_>) -> Result<(u64, f64)> {
    let mut descriptions: [String; 9] = Default::default();
    about.name.clone_into(&mut descriptions[0]);
    descriptions[3] = program();
    about.operation.clone_into(&mut descriptions[7]);
    let header = layout::Tm25Metadata {
        wavelength: about.wavelength_nm as f32,
        per_ray: about.per_ray,
        lumens_per_watt: about.lumens_per_watt as f32,
        date: String::new(),
        descriptions,
    };
    let mut writer = layout::Tm25Writer::new(file, &header)?;
    fill(&mut |ray| Ok(writer.write(ray)?))?;
    Ok(writer.finish()?)
}
