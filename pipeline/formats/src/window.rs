// SPDX-License-Identifier: MIT OR Apache-2.0
//! XML of WINDOW and Radiance, on the Klems basis or with tensor trees.

pub mod convert;
pub mod layout;

use std::path::Path;

use crate::convert::Smearing;
use crate::text::utf8;
use anyhow::Result;

use super::content::ScatterFile;
use super::sniff::Sniff;
use super::tables::{CellTable, Written};
use super::{Reader, Reads, Writer, Writes, program};
use runtime::atomic_file::write_atomic;

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a WINDOW/Radiance BSDF",
    endings: &["xml"],
    sniff: Sniff::Markup(|text| text.starts_with('<') && text.contains("<WindowElement")),
    reads: Reads::Scatter(|bytes| {
        let file = layout::read(utf8(bytes)?)?;
        Ok(ScatterFile::two_sided("WINDOW/Radiance BSDF XML", move |indices, between| {
            convert::from_window(&file, indices, between)
        }))
    }),
};

/// Writes the Klems basis.
pub static KLEMS: Writer = Writer {
    word: "klems",
    help: "Table: WINDOW/Radiance XML, Klems matrix, .xml",
    endings: &["xml"],
    writes: Writes::Cells {
        targets: |path| vec![path.to_path_buf()],
        write: |table, path| {
            let samples = table.fineness.resolution.samples;
            write(table, convert::to_klems(table.surface, samples)?, path)
        },
    },
};

/// Writes tensor trees.
pub static TENSOR_TREE: Writer = Writer {
    word: "tensortree",
    help: "Table: WINDOW/Radiance XML, tensor tree, .xml",
    endings: &["xml"],
    writes: Writes::Cells {
        targets: |path| vec![path.to_path_buf()],
        write: |table, path| {
            let samples = table.fineness.resolution.samples;
            let tree = convert::to_tree(table.surface, table.fineness.tree_log2, samples)?;
            write(table, tree, path)
        },
    },
};

fn write(
    table: &CellTable<'_>,
    (mut file, smearing): (layout::WindowBsdf, Smearing),
    path: &Path,
) -> Result<Vec<Written>> {
    file.name = table.stated_wavelength();
    file.manufacturer = program();
    write_atomic(path, |mut sink| Ok(layout::write(&file, &mut sink)?))?;
    Ok(vec![Written { path: path.to_path_buf(), smearing }])
}
