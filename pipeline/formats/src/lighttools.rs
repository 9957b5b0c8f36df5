// SPDX-License-Identifier: MIT OR Apache-2.0
//! LightTools BSDF as text.

pub mod convert;
pub mod layout;

use std::path::Path;

use crate::text::utf8;
use anyhow::Result;

use super::content::ScatterFile;
use super::sniff::Sniff;
use super::tables::{CellTable, Written};
use super::{Reader, Reads, Writer, Writes, zemax};
use runtime::atomic_file::write_atomic;

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a LightTools BSDF",
    endings: &["bsdf", "txt"],
    // Zemax has these keywords too, beside its own.
    sniff: Sniff::Keywords(|text| {
        (text.contains("ScatterAzimuth") || text.contains("ScatterRadial"))
            && !zemax::has_keywords(text)
    }),
    reads: Reads::Scatter(|bytes| {
        let file = layout::read(utf8(bytes)?)?;
        // 0 stands for a wavelength that is not stated.
        let wavelength_nm = Some(file.blocks[0].wavelength).filter(|w| *w > 0.0);
        let surface = ScatterFile::two_sided("LightTools BSDF", move |indices, between| {
            convert::from_lighttools(&file, indices, between)
        });
        Ok(ScatterFile { wavelength_nm, ..surface })
    }),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "lighttools",
    help: "Table: LightTools BSDF text, .bsdf",
    endings: &["bsdf"],
    writes: Writes::Cells { targets: |path| vec![path.to_path_buf()], write },
};

fn write(table: &CellTable<'_>, path: &Path) -> Result<Vec<Written>> {
    let wavelength = table.wavelength_nm.unwrap_or(0.0);
    let (mut file, smearing) =
        convert::to_lighttools(table.surface, wavelength, &table.fineness.resolution)?;
    file.comments = table.comments(&smearing);
    file.comments.push("Front is the outer side of the surface, Back the inner side".to_owned());
    write_atomic(path, |mut sink| Ok(layout::write(&file, &mut sink)?))?;
    Ok(vec![Written { path: path.to_path_buf(), smearing }])
}
