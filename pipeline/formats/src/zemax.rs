// SPDX-License-Identifier: MIT OR Apache-2.0
//! Zemax tabular BSDF: four files, for both sides and types.

pub mod convert;
pub mod layout;

use std::path::{Path, PathBuf};

use crate::text::{Tokens, scatter_type, utf8};
use anyhow::Result;
use bsdf::{Side, Transport};

use super::content::ScatterFile;
use super::sniff::Sniff;
use super::tables::{CellTable, Written, beside};
use super::{Reader, Reads, Writer, Writes};
use runtime::atomic_file::FileSet;

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a Zemax tabular BSDF",
    endings: &["bsdf", "txt"],
    sniff: Sniff::Keywords(has_keywords),
    reads: Reads::Scatter(|bytes| {
        let file = layout::read(utf8(bytes)?)?;
        Ok(ScatterFile::one_sided("Zemax tabular BSDF", move |side, indices| {
            convert::zemax_tables(&[(side, &file)], indices)
        }))
    }),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "zemax",
    help: "Table: Zemax tabular BSDF, four .bsdf files",
    endings: &["bsdf"],
    writes: Writes::Cells { targets, write },
};

/// True for text with keywords of the format.
pub(super) fn has_keywords(text: &str) -> bool {
    let first = Tokens::new(text, true).take().unwrap_or_default();
    first.eq_ignore_ascii_case("Source")
        || ["AngleOfIncidence", "SampleRotation"].iter().any(|word| text.contains(word))
}

/// Sides and types of the files, in their order.
fn parts() -> impl Iterator<Item = (Side, Transport)> {
    Side::BOTH.into_iter().flat_map(|side| Transport::BOTH.map(|transport| (side, transport)))
}

fn targets(path: &Path) -> Vec<PathBuf> {
    parts()
        .map(|(side, t)| beside(path, &format!("{side}-{}", scatter_type(t).to_ascii_lowercase())))
        .collect()
}

fn write(table: &CellTable<'_>, path: &Path) -> Result<Vec<Written>> {
    let (mut set, mut files) = (FileSet::default(), Vec::new());
    let all = targets(path);
    for ((side, transport), path) in parts().zip(&all) {
        let (mut file, smearing) =
            convert::to_zemax(table.surface, side, transport, &table.fineness.resolution)?;
        file.comments = table.comments(&smearing);
        file.comments.push(format!("light from the {side} side"));
        set.write(path, |mut sink| Ok(layout::write(&file, &mut sink)?))?;
        files.push(Written { path: path.clone(), smearing });
    }
    set.publish(&all)?;
    Ok(files)
}
