// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files of other programs: the registry of formats, and one module a format.
//!
//! `batwing import`, `batwing export`, the recognising of files, their messages and the table in
//! `docs/reference/formats.md` read [`READERS`] and [`WRITERS`]. A new format is one module with a
//! `READER`, a `WRITER` or both, and its lines in these lists; `layout` in it reads and writes the text or the
//! stream, `convert` turns scattering tables into those of the file.
//!
//! | modules | hold |
//! |---|---|
//! | [`native`], [`order_json`], [`npz`] | tables of diffraction orders |
//! | [`zemax`], [`lighttools`], [`speos`], [`window`] | scattering on direction cells |
//! | [`ies`], [`eulumdat`], [`tm33`] | far fields |
//! | [`tm25`], [`lighttools_rays`], [`speos_rays`], [`zemax_rays`] | rays |
//! | [`step`], [`stl`], [`obj`], [`dxf`], [`svg`] | bodies and meridians |
//! | [`sniff`], [`content`] | recognising, reading and describing of any of them |
//! | [`tables`], [`scattering`] | scattering written, and scattering as a surface |
//! | [`text`], [`fields`], [`convert`], [`rays`], [`text_rays`] | places in texts, numbers, cells and rays that layouts share |
//! | [`photometry`], [`bin_entries`], [`ray_files`], [`body`], [`mesh`] | parts that formats share |
//! | [`level_image`] | levels from 0 to 1 as text or PNG |

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Result;
use bsdf::OrderTable;
use geometry::Meridian;
use tracer::Distribution;

use body::Body;
use content::{FarField, ScatterFile};
use mesh::Mesh;
use photometry::{Labels, Photometry};
use ray_files::RayFormat;
use runtime::atomic_file::Sink;
use sniff::Sniff;
use tables::{CellTable, Written};

pub mod bin_entries;
pub mod body;
pub mod content;
pub mod convert;
pub mod dxf;
pub mod eulumdat;
pub mod fields;
mod icc;
pub mod ies;
pub mod level_image;
pub mod lighttools;
pub mod lighttools_rays;
pub mod mesh;
pub mod native;
pub mod npz;
pub mod obj;
pub mod order_json;
pub mod photometry;
pub mod ray_files;
pub mod rays;
pub mod scattering;
pub mod sniff;
pub mod speos;
pub mod speos_rays;
pub mod step;
pub mod stl;
pub mod svg;
pub mod tables;
pub mod text;
pub mod text_rays;
pub mod tm25;
pub mod tm33;
pub mod window;
pub mod zemax;
pub mod zemax_rays;

/// Formats that are read, in the order in which messages list them; of several with one ending the
/// first is the usual one.
pub static READERS: [&Reader; 16] = [
    &native::READER,
    &order_json::READER,
    &npz::READER,
    &lighttools::READER,
    &zemax::READER,
    &window::READER,
    &speos::READER,
    &ies::READER,
    &eulumdat::READER,
    &tm33::READER,
    &tm25::READER,
    &lighttools_rays::READER,
    &lighttools_rays::TEXT_READER,
    &speos_rays::READER,
    &zemax_rays::READER,
    &zemax_rays::TEXT_READER,
];

/// Formats that are written, in the order in which the command line lists them.
pub static WRITERS: [&Writer; 20] = [
    &zemax::WRITER,
    &lighttools::WRITER,
    &speos::WRITER,
    &window::KLEMS,
    &window::TENSOR_TREE,
    &order_json::WRITER,
    &npz::WRITER,
    &ies::WRITER,
    &eulumdat::WRITER,
    &tm25::WRITER,
    &lighttools_rays::WRITER,
    &lighttools_rays::TEXT_WRITER,
    &speos_rays::WRITER,
    &zemax_rays::WRITER,
    &zemax_rays::TEXT_WRITER,
    &step::WRITER,
    &stl::WRITER,
    &obj::WRITER,
    &dxf::WRITER,
    &svg::WRITER,
];

/// A format that is read.
#[derive(Debug)]
pub struct Reader {
    /// Name with its article: "a TM-25 ray file".
    pub name: &'static str,
    /// Endings of its files in small letters, the usual one first.
    pub endings: &'static [&'static str],
    /// Test of the first bytes.
    pub sniff: Sniff,
    /// Reader of the content.
    pub reads: Reads,
}

/// Readers by what they are given and what they find.
#[derive(Debug)]
pub enum Reads {
    /// Table of orders in a file.
    OrdersOfFile(fn(&Path) -> Result<OrderTable>),
    /// Table of orders in bytes.
    Orders(fn(&[u8]) -> Result<OrderTable>),
    /// Scattering in bytes.
    Scatter(fn(&[u8]) -> Result<ScatterFile>),
    /// Far field in text, which may be Latin-1.
    FarField(fn(&str) -> Result<FarField>),
    /// Far field for one of several sets of lamps, from 1; `None` is the first.
    LampSets(fn(&str, Option<usize>) -> Result<FarField>),
    /// Rays, one by one.
    Rays(&'static RayFormat),
}

/// A format that is written.
#[derive(Debug)]
pub struct Writer {
    /// Word of `--format`.
    pub word: &'static str,
    /// Line of the help.
    pub help: &'static str,
    /// Endings of its files in small letters.
    pub endings: &'static [&'static str],
    /// Writer of the content.
    pub writes: Writes,
}

/// Writes named meridians with a title into a file.
pub type WriteMeridians = fn(&[(String, Meridian)], &str, &mut dyn Write) -> Result<()>;

/// Writers by what they write.
#[derive(Debug, Clone, Copy)]
pub enum Writes {
    /// Scattering on direction cells.
    Cells {
        /// Files that are written for a path.
        targets: fn(&Path) -> Vec<PathBuf>,
        /// Writes them.
        write: fn(&CellTable<'_>, &Path) -> Result<Vec<Written>>,
    },
    /// Table of orders.
    Orders(fn(&OrderTable, &mut dyn Sink) -> Result<()>),
    /// Far field, in cd for a source of the lumens stated.
    FarField(fn(&Labels, &Distribution, Photometry) -> String),
    /// Rays.
    Rays(&'static RayFormat),
    /// All bodies of a design by their exact forms, with its name.
    Solids(fn(&[Body], &str, &mut dyn Sink) -> Result<()>),
    /// Bodies of a package as triangles.
    Bodies {
        /// True for formats without names, which leave out the LED box.
        single: bool,
        /// Writes them with a line about them.
        write: fn(&[Mesh], &str, &mut dyn Write) -> Result<()>,
    },
    /// Meridians of a dome and of solids about its axis by their names, with a line about them.
    Meridians(WriteMeridians),
}

/// Kinds of content of a file that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holds {
    /// Scattering on direction cells.
    Cells,
    /// Table of orders.
    Orders,
    /// Far field.
    FarField,
    /// Rays.
    Rays,
    /// Bodies or meridians.
    Geometry,
}

impl Writer {
    /// Kind of content.
    pub fn holds(&self) -> Holds {
        match self.writes {
            Writes::Cells { .. } => Holds::Cells,
            Writes::Orders(_) => Holds::Orders,
            Writes::FarField(_) => Holds::FarField,
            Writes::Rays(_) => Holds::Rays,
            Writes::Solids(_) | Writes::Bodies { .. } | Writes::Meridians(_) => Holds::Geometry,
        }
    }
}

/// Writer with this word of `--format`.
pub fn writer(word: &str) -> Option<&'static Writer> {
    WRITERS.iter().copied().find(|writer| writer.word == word)
}

/// Words of `--format` for these kinds of content: `a, b or c`.
pub fn words(kinds: &[Holds]) -> String {
    let of_kind = |kind: &Holds| {
        let kind = *kind;
        WRITERS.iter().filter(move |writer| writer.holds() == kind).map(|writer| writer.word)
    };
    listed(&kinds.iter().flat_map(of_kind).collect::<Vec<_>>(), "or")
}

/// Joins to `a, b or c`, with `word` before the last.
pub fn listed(all: &[impl AsRef<str>], word: &str) -> String {
    let all: Vec<&str> = all.iter().map(AsRef::as_ref).collect();
    match &all[..] {
        [rest @ .., last] if !rest.is_empty() => format!("{} {word} {last}", rest.join(", ")),
        _ => all.concat(),
    }
}

/// Endings, with their dots and each once, of the readers that `chosen` takes.
pub fn endings(chosen: impl Fn(&Reads) -> bool) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for reader in READERS.iter().filter(|reader| chosen(&reader.reads)) {
        for ending in reader.endings.iter().map(|ending| format!(".{ending}")) {
            if !all.contains(&ending) {
                all.push(ending);
            }
        }
    }
    all
}

/// Name and version of this program for the files that it writes.
fn program() -> String {
    format!("batwing {}", env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texts between backticks in a cell of a table.
    fn quoted(cell: &str) -> Vec<&str> {
        cell.split('`').skip(1).step_by(2).collect()
    }

    #[test]
    fn the_reference_lists_the_formats_of_the_registry() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/formats.md");
        let page = std::fs::read_to_string(page).expect("the page of formats");
        let rows = page.lines().skip_while(|line| !line.starts_with("| format |")).skip(2);
        let mut listed: Vec<String> = rows
            .take_while(|line| line.starts_with('|'))
            .map(|row| match quoted(row.split('|').nth(2).expect("a cell"))[..] {
                // A word is the ending where no ending follows.
                [word] => format!("{word} .{word}"),
                ref all => all.join(" "),
            })
            .collect();
        let mut expected: Vec<String> = WRITERS
            .iter()
            .map(|writer| format!("{} .{}", writer.word, writer.endings.join(" .")))
            .collect();
        listed.sort();
        expected.sort();
        assert_eq!(listed, expected);
        for ending in endings(|_| true) {
            let [alone, bare] = [format!("`{ending}`"), format!("`{}`", &ending[1..])];
            assert!(page.contains(&alone) || page.contains(&bare), "{ending} is not on the page");
        }
    }
}
