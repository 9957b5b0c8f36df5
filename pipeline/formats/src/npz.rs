// SPDX-License-Identifier: MIT OR Apache-2.0
//! A table of diffraction orders as `.npz`, for NumPy: one row an order, one row a node.
//!
//! Arrays: `node_side` (0 inner, 1 outer), `node_kx`, `node_ky` (units of the vacuum wavenumber),
//! `node_kx_index`, `node_ky_index`, `order_node`, `order_side`, `order` (relative order), `s`, `p`
//! (shares of the incident power), and `header`, the bytes of a JSON text with `format`, `version`,
//! `header` and `grid` as in the JSON format. `docs/guide/other-programs.md` shows how to load it.

use std::io::{Cursor, Read, Seek, Write};

use anyhow::{Context, Result, anyhow, ensure};
use bsdf::{
    EfficiencyRow, Grid, NodeId, OrderEfficiency, OrderTable, Polarisation, Side, TableHeader,
};
use serde::{Deserialize, Serialize};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes};
use arrays::npy::{self, Element};

/// Maximum length of the header of an array, bytes.
const MAX_HEADER: u64 = 1 << 16;
/// Maximum length of the text of the header of a table, bytes.
const MAX_TEXT: usize = 1 << 24;

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a NumPy archive",
    endings: &["npz"],
    sniff: Sniff::Mark(|start| start.starts_with(b"PK\x03\x04")),
    reads: Reads::Orders(|bytes| read(Cursor::new(bytes))),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "npz",
    help: "Table of orders: NumPy archive, .npz",
    endings: &["npz"],
    writes: Writes::Orders(|table, mut file| write(table, &mut file)),
};

/// Content of the array `header`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct About {
    format: String,
    version: u32,
    header: TableHeader,
    grid: Grid,
}

/// Writes a table.
pub fn write(table: &OrderTable, file: &mut (impl Write + Seek)) -> Result<()> {
    let grid = table.grid();
    let about = About {
        format: crate::order_json::layout::NAME.to_owned(),
        version: crate::order_json::layout::VERSION,
        header: table.header().clone(),
        grid: grid.clone(),
    };
    let [mut side, mut to] = [const { Vec::<u8>::new() }; 2];
    let [mut kx, mut ky] = [const { Vec::<f64>::new() }; 2];
    let [mut kx_index, mut ky_index, mut of_node, mut order] = [const { Vec::<i32>::new() }; 4];
    let [mut s, mut p] = [const { Vec::<f32>::new() }; 2];
    for (number, node) in grid.nodes().enumerate() {
        side.push(node.side.index() as u8);
        kx.push(grid.kx(node.kx_index));
        ky.push(grid.ky[node.ky_index]);
        kx_index.push(i32::try_from(node.kx_index)?);
        ky_index.push(i32::try_from(node.ky_index)?);
        let shares =
            [Polarisation::S, Polarisation::P].map(|pol| table.node_efficiencies(node, pol));
        let [in_s, in_p] = shares;
        for (in_s, in_p) in in_s?.into_iter().zip(in_p?) {
            of_node.push(i32::try_from(number)?);
            to.push(in_s.to.index() as u8);
            order.push(in_s.order);
            s.push(in_s.efficiency as f32);
            p.push(in_p.efficiency as f32);
        }
    }
    let mut archive = ZipWriter::new(file);
    add_array(&mut archive, "header", &serde_json::to_vec(&about)?)?;
    add_array(&mut archive, "node_side", &side)?;
    add_array(&mut archive, "node_kx", &kx)?;
    add_array(&mut archive, "node_ky", &ky)?;
    add_array(&mut archive, "node_kx_index", &kx_index)?;
    add_array(&mut archive, "node_ky_index", &ky_index)?;
    add_array(&mut archive, "order_node", &of_node)?;
    add_array(&mut archive, "order_side", &to)?;
    add_array(&mut archive, "order", &order)?;
    add_array(&mut archive, "s", &s)?;
    add_array(&mut archive, "p", &p)?;
    archive.finish()?;
    Ok(())
}

/// Adds an array of one dimension.
fn add_array<T: Element>(
    archive: &mut ZipWriter<impl Write + Seek>,
    name: &str,
    values: &[T],
) -> Result<()> {
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    archive.start_file(format!("{name}.npy"), options)?;
    npy::write(archive, &[values.len()], values)
}

/// The archive on its way in.
struct Members<R>(ZipArchive<R>);

impl<R: Read + Seek> Members<R> {
    /// The array `name` of one dimension, of at most `max` values: more than the file can mean are
    /// not unpacked.
    fn array<T: Element>(&mut self, name: &str, max: usize) -> Result<Vec<T>> {
        let file = format!("{name}.npy");
        let member = self
            .0
            .by_name(&file)
            .map_err(|e| anyhow!("expected an array `{name}`, got none: {e}"))?;
        let limit = MAX_HEADER + (max.saturating_mul(T::SIZE)) as u64;
        let mut bytes = Vec::new();
        member
            .take(limit + 1)
            .read_to_end(&mut bytes)
            .map_err(|e| anyhow!("array `{name}`: expected what was written, got {e}"))?;
        ensure!(
            bytes.len() as u64 <= limit,
            "array `{name}`: expected at most {max} values, got more"
        );
        let (shape, values) = npy::read(&bytes).with_context(|| format!("array `{name}`"))?;
        ensure!(
            shape.len() == 1,
            "array `{name}`: expected one dimension, got the shape {shape:?}"
        );
        Ok(values)
    }
}

/// Reads a table and checks it as any other.
///
/// # Errors
/// If it is no such archive, arrays are missing, of other types or lengths, or do not make a table.
pub fn read(file: impl Read + Seek) -> Result<OrderTable> {
    let archive = ZipArchive::new(file).map_err(|e| anyhow!("expected a .npz file, got {e}"))?;
    let mut npz = Members(archive);
    let about: About = serde_json::from_slice(&npz.array::<u8>("header", MAX_TEXT)?)
        .context("array `header`: expected a JSON text")?;
    let (name, version) = (crate::order_json::layout::NAME, crate::order_json::layout::VERSION);
    ensure!(
        about.format == name && about.version == version,
        "array `header`: expected {name} version {version}, got {} version {}",
        about.format,
        about.version
    );
    about.grid.validate()?;
    let nodes = about.grid.node_count();
    let highest = about.grid.index_inner.max(about.grid.index_outer);
    let orders = nodes.saturating_mul(4 * (highest / about.grid.zone()).ceil() as usize + 4);
    let sides = npz.array::<u8>("node_side", nodes)?;
    let kx = npz.array::<i32>("node_kx_index", nodes)?;
    let ky = npz.array::<i32>("node_ky_index", nodes)?;
    let of_node = npz.array::<i32>("order_node", orders)?;
    let to = npz.array::<u8>("order_side", orders)?;
    let order = npz.array::<i32>("order", orders)?;
    let s = npz.array::<f32>("s", orders)?;
    let p = npz.array::<f32>("p", orders)?;
    ensure!(
        kx.len() == sides.len() && ky.len() == sides.len(),
        "expected as many node_kx_index and node_ky_index as node_side, got {}, {} and {}",
        kx.len(),
        ky.len(),
        sides.len()
    );
    for (name, length) in
        [("order_side", to.len()), ("order", order.len()), ("s", s.len()), ("p", p.len())]
    {
        ensure!(
            length == of_node.len(),
            "expected as many {name} as order_node ({}), got {length}",
            of_node.len()
        );
    }
    let side = |code: u8| match code {
        0 => Ok(Side::Inner),
        1 => Ok(Side::Outer),
        _ => anyhow::bail!("expected sides 0 and 1, got {code}"),
    };
    let mut rows = Vec::new();
    for (number, code) in sides.iter().enumerate() {
        let row = |polarisation| -> Result<EfficiencyRow> {
            Ok(EfficiencyRow {
                node: NodeId {
                    side: side(*code)?,
                    kx_index: i64::from(kx[number]),
                    ky_index: usize::try_from(ky[number]).context("node_ky_index below 0")?,
                },
                polarisation,
                orders: Vec::new(),
            })
        };
        rows.push(row(Polarisation::S)?);
        rows.push(row(Polarisation::P)?);
    }
    for (k, node) in of_node.iter().enumerate() {
        let first =
            usize::try_from(*node).ok().filter(|n| *n < sides.len()).with_context(|| {
                let last = sides.len().saturating_sub(1);
                format!("order_node[{k}]: expected 0 to {last}, got {node}")
            })?;
        for (which, shares) in [&s, &p].into_iter().enumerate() {
            let order = OrderEfficiency::new(side(to[k])?, order[k], f64::from(shares[k]));
            rows[2 * first + which].orders.push(order);
        }
    }
    Ok(OrderTable::build(about.header, about.grid, rows)?)
}
