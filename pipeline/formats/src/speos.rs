// SPDX-License-Identifier: MIT OR Apache-2.0
//! Speos BSDF, written as text: two files, for both sides.

mod binary;
pub mod convert;
pub mod layout;

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use bsdf::Side;

use super::content::ScatterFile;
use super::sniff::Sniff;
use super::tables::{CellTable, Written, beside};
use super::{Reader, Reads, Writer, Writes};
use runtime::atomic_file::FileSet;

/// Reads the format, anisotropic or by wavelengths.
pub static READER: Reader = Reader {
    name: "a Speos BSDF",
    endings: &["anisotropicbsdf", "brdf"],
    sniff: Sniff::Mark(|start| {
        let line = start.split(|b| matches!(b, b'\r' | b'\n')).next().unwrap_or_default();
        let line = String::from_utf8_lossy(line).to_ascii_lowercase();
        line.starts_with("optis - anisotropic bsdf") || line.starts_with("optis - brdf")
    }),
    reads: Reads::Scatter(|bytes| {
        let file = layout::read(bytes)?;
        let warnings = file.warnings.clone();
        let surface = ScatterFile::one_sided("Speos BSDF", move |side, _| {
            convert::speos_tables(&[(side, &file)])
        });
        Ok(ScatterFile { warnings, ..surface })
    }),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "speos",
    help: "Table: Speos anisotropic BSDF text, two .anisotropicbsdf files",
    endings: &["anisotropicbsdf"],
    writes: Writes::Cells { targets, write },
};

fn targets(path: &Path) -> Vec<PathBuf> {
    Side::BOTH.map(|side| beside(path, &side.to_string())).to_vec()
}

fn write(table: &CellTable<'_>, path: &Path) -> Result<Vec<Written>> {
    let (mut set, mut files) = (FileSet::default(), Vec::new());
    let all = targets(path);
    for (side, path) in Side::BOTH.into_iter().zip(&all) {
        let (mut file, smearing) =
            convert::to_speos(table.surface, side, &table.fineness.resolution)?;
        // A side from which nothing is scattered has no file: the format has no place for none.
        if file.parts.is_empty() {
            continue;
        }
        let said = table.comments(&smearing).join("; ");
        file.comment = format!("light from the {side} side; {said}");
        set.write(path, |mut sink| Ok(layout::write(&file, &mut sink)?))?;
        files.push(Written { path: path.clone(), smearing });
    }
    ensure!(!files.is_empty(), "expected a surface that scatters light from some side, got none");
    set.publish(&all)?;
    Ok(files)
}
