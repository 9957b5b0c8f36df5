// SPDX-License-Identifier: MIT OR Apache-2.0
//! A table of diffraction orders as `.npz`, for NumPy: one row an order, one row a node.
//!
//! Arrays: `node_side` (0 inner, 1 outer), `node_kx`, `node_ky` (units of the vacuum wavenumber), `node_kx_index`, `node_ky_index`, `order_node`,
//! `order_side`, `order` (relative order), `s`, `p` (shares of the incident power), and `header`, the bytes of a JSON text with `format`, `version`, `header`
//! and `grid` as in the JSON format. `docs/exchange.md` shows how to load it.

use std::io::{Read, Seek, Write};

use anyhow::{Context, Result, ensure};
use bsdf::{Grid, OrderTable, Polarization, Row, Side, TableHeader};
use ndarray::Array1;
use ndarray_npy::{NpzReader, NpzWriter};
use serde::{Deserialize, Serialize};

/// What `header` says.
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
        format: bsdf::format::orders::NAME.to_owned(),
        version: bsdf::format::orders::VERSION,
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
        let shares = [Polarization::S, Polarization::P].map(|pol| table.node_shares(node, pol));
        let [in_s, in_p] = shares;
        for ((leaves, l, share_s), (_, _, share_p)) in in_s?.into_iter().zip(in_p?) {
            of_node.push(i32::try_from(number)?);
            to.push(leaves.index() as u8);
            order.push(l);
            s.push(share_s as f32);
            p.push(share_p as f32);
        }
    }
    let mut npz = NpzWriter::new_compressed(file);
    npz.add_array("header", &Array1::from(serde_json::to_vec(&about)?))?;
    npz.add_array("node_side", &Array1::from(side))?;
    npz.add_array("node_kx", &Array1::from(kx))?;
    npz.add_array("node_ky", &Array1::from(ky))?;
    npz.add_array("node_kx_index", &Array1::from(kx_index))?;
    npz.add_array("node_ky_index", &Array1::from(ky_index))?;
    npz.add_array("order_node", &Array1::from(of_node))?;
    npz.add_array("order_side", &Array1::from(to))?;
    npz.add_array("order", &Array1::from(order))?;
    npz.add_array("s", &Array1::from(s))?;
    npz.add_array("p", &Array1::from(p))?;
    npz.finish()?;
    Ok(())
}

fn array<T: ndarray_npy::ReadableElement + Clone>(
    npz: &mut NpzReader<impl Read + Seek>,
    name: &str,
) -> Result<Vec<T>> {
    let array: Array1<T> = npz
        .by_name(name)
        .with_context(|| format!("expected an array `{name}` of one dimension"))?;
    Ok(array.to_vec())
}

/// Reads a table and checks it as any other.
pub fn read(file: impl Read + Seek) -> Result<OrderTable> {
    let mut npz = NpzReader::new(file).context("expected a .npz file")?;
    let about: About = serde_json::from_slice(&array::<u8>(&mut npz, "header")?)
        .context("array `header`: expected a JSON text")?;
    let (name, version) = (bsdf::format::orders::NAME, bsdf::format::orders::VERSION);
    ensure!(
        about.format == name && about.version == version,
        "array `header`: expected {name} version {version}, got {} version {}",
        about.format,
        about.version
    );
    let sides = array::<u8>(&mut npz, "node_side")?;
    let kx = array::<i32>(&mut npz, "node_kx_index")?;
    let ky = array::<i32>(&mut npz, "node_ky_index")?;
    let of_node = array::<i32>(&mut npz, "order_node")?;
    let to = array::<u8>(&mut npz, "order_side")?;
    let order = array::<i32>(&mut npz, "order")?;
    let (s, p) = (array::<f32>(&mut npz, "s")?, array::<f32>(&mut npz, "p")?);
    ensure!(
        kx.len() == sides.len() && ky.len() == sides.len(),
        "expected as many node_kx_index and node_ky_index as node_side, got {}, {} and {}",
        kx.len(),
        ky.len(),
        sides.len()
    );
    for (name, length) in [
        ("order_side", to.len()),
        ("order", order.len()),
        ("s", s.len()),
        ("p", p.len()),
    ] {
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
        let row = |polarization| -> Result<Row> {
            Ok(Row {
                side: side(*code)?,
                kx_index: i64::from(kx[number]),
                ky_index: usize::try_from(ky[number]).context("node_ky_index below 0")?,
                polarization,
                shares: Vec::new(),
            })
        };
        rows.push(row(Polarization::S)?);
        rows.push(row(Polarization::P)?);
    }
    for (k, node) in of_node.iter().enumerate() {
        let first = usize::try_from(*node)
            .ok()
            .filter(|n| *n < sides.len())
            .with_context(|| format!("order_node: expected 0 to {}, got {node}", sides.len()))?;
        for (which, shares) in [&s, &p].into_iter().enumerate() {
            let share = (side(to[k])?, order[k], f64::from(shares[k]));
            rows[2 * first + which].shares.push(share);
        }
    }
    Ok(OrderTable::build(about.header, about.grid, rows)?)
}
