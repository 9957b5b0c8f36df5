// SPDX-License-Identifier: MIT OR Apache-2.0
//! Order tables as JSON, for scripts: order by order, node by node, nothing binned.
//!
//! In: an [`OrderTable`] or the text of a file. Out: the other. Efficiencies stand as
//! `[side, relative order, efficiency]`, and tangential wavevectors of the incident light in units
//! of the vacuum wavenumber (`docs/explanation/conventions.md`):
//!
//! ```json
//! {
//!   "format": "batwing-orders", "version": 2,
//!   "header": {"design": "D1", "ring": "75", "band": "8", "length_unit": "um", "truncation": 60,
//!              "slices": 128, "estimated_error": 0.001, "energy_residual": 1e-12, "more": {}},
//!   "grid": {"period": 10.78, "wavelength": 0.55, "index_inner": 1.41, "index_outer": 1.0,
//!            "kx_per_zone": 2, "ky": [0.0, 0.5]},
//!   "nodes": [{"side": "inner", "kx_index": -1, "ky_index": 0, "kx": -0.0128, "ky": 0.0,
//!              "s": [["outer", -1, 0.3], ["outer", 0, 0.7]], "p": [["outer", 0, 1.0]]}]
//! }
//! ```

use bsdf::Error;
use bsdf::Polarisation;
use bsdf::direction::Side;
use bsdf::order_table::{EfficiencyRow, Grid, NodeId, OrderEfficiency, OrderTable, TableHeader};
use std::io::Write;

/// Value of `format`.
pub const NAME: &str = "batwing-orders";
/// Version that this crate writes and reads.
pub const VERSION: u32 = 2;

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct NodeRecord {
    side: Side,
    kx_index: i64,
    ky_index: usize,
    kx: f64,
    ky: f64,
    s: Vec<(Side, i32, f32)>,
    p: Vec<(Side, i32, f32)>,
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u32,
    header: TableHeader,
    grid: Grid,
    nodes: Vec<NodeRecord>,
}

/// The two keys that are checked first.
#[derive(serde::Deserialize)]
struct Kind {
    format: String,
    version: u32,
}

/// Writes a table.
///
/// # Errors
/// If the writer fails.
pub fn write(table: &OrderTable, writer: impl Write) -> Result<(), Error> {
    let grid = table.grid();
    let mut nodes = Vec::with_capacity(table.node_count());
    for id in grid.nodes() {
        let orders = |polarisation| -> Result<Vec<(Side, i32, f32)>, Error> {
            let orders = table.node_efficiencies(id, polarisation)?.into_iter();
            // The table stores f32: nothing is lost.
            Ok(orders.map(|o| (o.to, o.order, o.efficiency as f32)).collect())
        };
        nodes.push(NodeRecord {
            side: id.side,
            kx_index: id.kx_index,
            ky_index: id.ky_index,
            kx: grid.kx(id.kx_index),
            ky: grid.ky[id.ky_index],
            s: orders(Polarisation::S)?,
            p: orders(Polarisation::P)?,
        });
    }
    let file = File {
        format: NAME.to_owned(),
        version: VERSION,
        header: table.header().clone(),
        grid: grid.clone(),
        nodes,
    };
    serde_json::to_writer(writer, &file)?;
    Ok(())
}

/// Reads the text of a file and checks it as in [`OrderTable::build`].
///
/// # Errors
/// If it is not such a file, of another version, has several kinds of line end, or is inconsistent.
pub fn read(text: &str) -> anyhow::Result<OrderTable> {
    crate::text::check_line_ends(text)?;
    Ok(parsed(text)?)
}

fn parsed(text: &str) -> Result<OrderTable, Error> {
    let kind: Kind = serde_json::from_str(text)?;
    if kind.format != NAME {
        return Err(Error::Magic {
            expected: NAME.to_owned(),
            got: kind.format.chars().take(40).collect(),
        });
    }
    if kind.version != VERSION {
        return Err(Error::Version { expected: VERSION, got: kind.version });
    }
    let file: File = serde_json::from_str(text)?;
    file.grid.validate()?;
    // The text must be large enough before anything is allocated for the grid.
    let expected = file.grid.node_count();
    if file.nodes.len() != expected {
        return Err(Error::Inconsistent {
            part: "number of nodes",
            expected: expected.to_string(),
            got: file.nodes.len().to_string(),
        });
    }
    for node in &file.nodes {
        let ky = file.grid.ky.get(node.ky_index).copied();
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9;
        if !near(node.kx, file.grid.kx(node.kx_index)) || !ky.is_some_and(|ky| near(node.ky, ky)) {
            return Err(Error::Inconsistent {
                part: "wavevector of a node",
                expected: format!(
                    "that of kx index {}, ky index {} of the grid",
                    node.kx_index, node.ky_index
                ),
                got: format!("kx {}, ky {}", node.kx, node.ky),
            });
        }
    }
    let rows = file.nodes.into_iter().flat_map(|node| {
        let row = |polarisation, orders: Vec<(Side, i32, f32)>| EfficiencyRow {
            node: NodeId { side: node.side, kx_index: node.kx_index, ky_index: node.ky_index },
            polarisation,
            orders: orders
                .into_iter()
                .map(|(to, order, efficiency)| {
                    OrderEfficiency::new(to, order, f64::from(efficiency))
                })
                .collect(),
        };
        [row(Polarisation::S, node.s), row(Polarisation::P, node.p)]
    });
    OrderTable::build(file.header, file.grid.clone(), rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> OrderTable {
        let grid = Grid {
            period: 2.2,
            wavelength: 0.55,
            index_inner: 1.41,
            index_outer: 1.0,
            kx_per_zone: 2,
            ky: vec![0.0, 0.6, 0.95, 1.2],
        };
        let more = serde_json::Map::from_iter([("solver".to_owned(), "closed form".into())]);
        let header = TableHeader {
            design: "d1".to_owned(),
            ring: "75".to_owned(),
            length_unit: "um".to_owned(),
            truncation: 60,
            slices: 128,
            estimated_error: 1.3e-3,
            energy_residual: 2e-12,
            more,
            ..TableHeader::default()
        };
        let rows = grid.rows(|side, kx, ky, polarisation| {
            let of_s = if polarisation == Polarisation::S { 0.1 } else { 0.0 };
            vec![OrderEfficiency::new(side, 0, 0.3 + 0.1 * kx.sin() * ky + of_s)]
        });
        OrderTable::build(header, grid.clone(), rows).unwrap()
    }

    fn text() -> String {
        let mut bytes = Vec::new();
        write(&table(), &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn what_was_written_comes_back_to_the_bit() {
        let back = read(&text()).unwrap();
        for id in back.grid().nodes() {
            for polarisation in [Polarisation::S, Polarisation::P] {
                let efficiencies =
                    |of: &OrderTable| of.node_efficiencies(id, polarisation).unwrap();
                assert_eq!(efficiencies(&back), efficiencies(&table()));
            }
        }
        assert_eq!((back.header(), back.grid()), (table().header(), table().grid()));
    }

    #[test]
    fn other_files_versions_and_contradictions_are_named() {
        let text = text();
        for (from, to, expected) in [
            ("batwing-orders", "other", "begin with \"batwing-orders\""),
            ("\"version\":2", "\"version\":3", "version 3, expected 2"),
            ("\"kx_index\":0", "\"kx_index\":1", "wavevector of a node"),
            ("\"period\":2.2", "\"period\":4.4", "number of nodes"),
            ("\"period\":2.2", "\"period\":1e300", "grid of incident wavevectors"),
            ("\"side\":\"inner\"", "\"side\":\"left\"", "line 1 column"),
            ("\"format\"", "format", "line 1 column"),
        ] {
            assert!(text.contains(from), "{from}");
            let message = read(&text.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(expected), "{from}: {message}");
        }
        for (more, expected) in [
            (r#"{"a": {"b": 1, "b": 1}}"#, "more.a.b: expected this key once, got it twice"),
            (r#"{"a": 1, "c": 2, "a": 3}"#, "more.a: expected this key once, got it twice"),
            ("3", "more: expected an object, got 3"),
        ] {
            let written = "\"more\":{\"solver\":\"closed form\"}";
            assert!(text.contains(written));
            let more = format!("\"more\": {more}");
            let message = read(&text.replacen(written, &more, 1)).unwrap_err().to_string();
            assert!(message.contains(expected) && message.contains("line 1 column"), "{message}");
        }
        assert!(read(&text[..text.len() / 2]).is_err() && read("").is_err());
    }
}
