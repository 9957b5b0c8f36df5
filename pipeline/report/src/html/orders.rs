// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of diffraction orders in a form small enough for a page.
//!
//! In: the tables that the hybrids of the results list. Out: for a few ky, beginning with 0, the
//! shares of all orders at all or every second, fourth ... node of kx, for both sides and for s and
//! p, as roots in 16 bits ([`pack::root`]).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use bsdf::order_table::NodeId;
use bsdf::{OrderTable, Polarisation, Side};
use serde_json::{Value, json};

use arrays::cache::Cache;
use arrays::order_tables::{EXTENSION, read_table};
use results::schema::TableEntry;

use super::folder::Folder;
use super::models::Model;
use super::pack::{self, base64_of_numbers};

/// Letters that all tables together may take.
pub const BUDGET: usize = 2_500_000;
/// Numbers of ky beside the lowest with their strides of kx, from the most to the least.
const MORE: [(usize, i64); 6] = [(5, 1), (3, 1), (3, 2), (3, 4), (2, 4), (1, 4)];

/// A table that the results list.
#[derive(Clone, Debug)]
pub struct Listed<'a> {
    /// Name of the design.
    pub design: &'a str,
    /// Wavelength, nm, where a spectrum has several.
    pub wavelength_nm: Option<f64>,
    /// Entry in `results.json`.
    pub entry: &'a TableEntry,
    /// File and key of that entry.
    place: String,
}

/// All tables that `models` list. In the light of a spectrum those of the wavelength of the largest
/// weight.
pub fn listed<'a>(models: &[Model<'a>], folder: &Folder) -> Vec<Listed<'a>> {
    let mut all = Vec::new();
    for Model { design, entry, place, .. } in models {
        let mut add = |tables: &'a [TableEntry], wavelength_nm, under: &str| {
            all.extend(tables.iter().enumerate().map(|(i, entry)| Listed {
                design,
                wavelength_nm,
                entry,
                place: folder.place(&format!("{place}{under}.tables[{}]", i + 1)),
            }));
        };
        add(&entry.tables, None, "");
        let wavelengths = entry.spectrum.iter().flat_map(|s| s.wavelengths.iter().enumerate());
        // Of equal weights the first.
        let heaviest = wavelengths
            .filter(|(_, w)| !w.tables.is_empty())
            .reduce(|a, b| if b.1.weight > a.1.weight { b } else { a });
        if let Some((i, w)) = heaviest {
            let under = format!(".spectrum.wavelengths[{}]", i + 1);
            add(&w.tables, Some(w.wavelength_nm), &under);
        }
    }
    all
}

/// Place of the tables.
#[derive(Debug)]
pub struct Source {
    /// The directory.
    pub directory: PathBuf,
    /// True if a table that is not there is an error.
    pub must: bool,
}

/// Reads and packs the tables of `listed`; returns their JSON, and the numbers of those found and of
/// those listed.
///
/// # Errors
/// A table that is damaged or is not the one listed; one that is missing, where it must be there.
pub fn embed(listed: &[Listed], source: &Source) -> Result<(Value, (usize, usize))> {
    let mut tables: BTreeMap<&str, OrderTable> = BTreeMap::new();
    let mut distinct: Vec<&str> = Vec::new();
    for Listed { entry, place, .. } in listed {
        let hash = entry.sha256.as_str();
        if distinct.contains(&hash) {
            continue;
        }
        ensure!(
            hash.len() == 64 && hash.bytes().all(|b| b.is_ascii_hexdigit()),
            "{place}.sha256: expected 64 hexadecimal digits, got {hash:?}"
        );
        distinct.push(hash);
        let path = source.directory.join(format!("{hash}.{EXTENSION}"));
        if !path.exists() {
            ensure!(
                !source.must,
                "{place}.sha256: expected the table `{}` (--tables), got no such file",
                path.display()
            );
            continue;
        }
        let table = read_table(&path)?;
        same(&table, entry, place, &path)?;
        tables.insert(hash, table);
    }
    let thinning = Thinning::choose(&tables.values().collect::<Vec<_>>());
    let found = listed.iter().filter(|t| tables.contains_key(t.entry.sha256.as_str()));
    let list: Vec<Value> = found
        .map(|Listed { design, wavelength_nm, entry, .. }| {
            json!({
                "design": design, "band": entry.band, "ring": entry.ring, "period": entry.period_um,
                "depth": entry.depth_um, "error": entry.estimated_error, "nm": wavelength_nm,
                "table": entry.sha256,
            })
        })
        .collect();
    let packed: serde_json::Map<String, Value> = tables
        .iter()
        .map(|(hash, table)| Ok(((*hash).to_owned(), thinning.pack(table)?)))
        .collect::<Result<_>>()?;
    let json = json!({"list": list, "tables": packed, "stride": thinning.stride, "moreKy": thinning.more_ky, "moreStride": thinning.more_stride});
    Ok((json, (tables.len(), distinct.len())))
}

/// Checks that a file holds the table that the results list under its name.
fn same(table: &OrderTable, entry: &TableEntry, place: &str, path: &Path) -> Result<()> {
    let (header, grid) = (table.header(), table.grid());
    for (key, listed, got) in [
        ("orders", entry.orders, header.truncation),
        ("slices", entry.slices, header.slices),
        ("kx_per_zone", entry.kx_per_zone, grid.kx_per_zone),
        ("ky", entry.ky, grid.ky.len()),
    ] {
        ensure!(
            listed == got,
            "{place}.{key}: expected {got} as `{}` has, got {listed}",
            path.display()
        );
    }
    Ok(())
}

/// Part of each table that is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Thinning {
    /// Stride of the nodes of kx that are kept at the lowest ky.
    stride: i64,
    /// Number of ky that are kept beside the lowest.
    more_ky: usize,
    /// Stride of the nodes of kx that are kept there.
    more_stride: i64,
}

impl Thinning {
    /// The most that fits into [`BUDGET`].
    fn choose(tables: &[&OrderTable]) -> Self {
        let fits = |choice: &Self| {
            let letters = tables.iter().map(|t| pack::letters(2 * choice.entries(t)));
            letters.sum::<usize>() <= BUDGET
        };
        let with_more =
            MORE.into_iter().map(|(more_ky, more_stride)| Self { stride: 1, more_ky, more_stride });
        let thinner = |power: u32| Self { stride: 1 << power, more_ky: 0, more_stride: 1 };
        let mut choices = with_more.chain((0..14).map(thinner));
        choices.find(fits).unwrap_or_else(|| thinner(14))
    }

    /// Indices of the ky kept, with the stride of kx: the first, which is the lowest, and others
    /// evenly over those below the critical one.
    fn rows(self, table: &OrderTable) -> Vec<(usize, i64)> {
        let grid = table.grid();
        let critical = grid.critical_ky();
        let below = grid.ky.iter().filter(|&&ky| ky < critical).count();
        let count = (1 + self.more_ky).min(below).max(1);
        let stride = |i| {
            if i == 0 { self.stride } else { self.more_stride }
        };
        (0..count).map(|i| (i * below / count, stride(i))).collect()
    }

    /// Shares of one polarisation that are kept of a table, more or less: every node has as many
    /// orders as propagate.
    fn entries(self, table: &OrderTable) -> usize {
        let grid = table.grid();
        let of_row = |(ky_index, stride): (usize, i64)| -> usize {
            let kx = Side::BOTH.map(|side| {
                let rim = grid.index(side).powi(2) - grid.ky[ky_index].powi(2);
                2.0 * rim.max(0.0).sqrt() / grid.zone()
            });
            let orders = (kx[0] + kx[1]).ceil() as usize;
            let nodes = Side::BOTH.map(|side| nodes(table, side, ky_index, stride).len());
            (nodes[0] + nodes[1]) * orders
        };
        self.rows(table).into_iter().map(of_row).sum()
    }

    fn pack(self, table: &OrderTable) -> Result<Value> {
        let grid = table.grid();
        let mut lines = Vec::new();
        for (ky_index, stride) in self.rows(table) {
            for side in Side::BOTH {
                let (mut kx, mut spans, mut shares) = (Vec::new(), Vec::new(), Vec::new());
                for node in nodes(table, side, ky_index, stride) {
                    let s = table.node_efficiencies(node, Polarisation::S)?;
                    let p = table.node_efficiencies(node, Polarisation::P)?;
                    kx.push(grid.kx(node.kx_index));
                    for to in Side::BOTH {
                        let mut orders = s.iter().filter(|e| e.to == to).map(|e| e.order);
                        spans.push(orders.next().unwrap_or(0));
                        spans.push(s.iter().filter(|e| e.to == to).count() as i32);
                    }
                    shares.extend(s.iter().chain(&p).map(|e| pack::root(e.efficiency)));
                }
                lines.push(json!({
                    "ky": grid.ky[ky_index], "side": side.index(), "kx": kx, "spans": spans, "shares": base64_of_numbers(&shares),
                }));
            }
        }
        let header = table.header();
        Ok(json!({
            "zone": grid.zone(), "index": [grid.index_inner, grid.index_outer], "wavelength": grid.wavelength,
            "kyCount": grid.ky.len(), "kxPerZone": grid.kx_per_zone, "orders": header.truncation, "slices": header.slices,
            "lines": lines,
        }))
    }
}

/// Every `stride`-th node of a row, counted so that kx = 0 or the node beside it is among them.
fn nodes(table: &OrderTable, side: Side, ky_index: usize, stride: i64) -> Vec<NodeId> {
    let indices = table.grid().kx_indices(side, ky_index);
    let kept = indices.filter(|kx_index| kx_index.rem_euclid(stride) == 0);
    kept.map(|kx_index| NodeId { side, kx_index, ky_index }).collect()
}

impl Source {
    /// The directory of tables: the one given, or the one beside the results.
    pub fn new(given: Option<&Path>, results: &Path) -> Result<Self> {
        if let Some(directory) = given {
            let kind = directory.metadata();
            let kind = kind.with_context(|| {
                format!("--tables: expected a directory, got `{}`", directory.display())
            })?;
            ensure!(
                kind.is_dir(),
                "--tables: expected a directory, got the file `{}`",
                directory.display()
            );
        }
        Ok(Self {
            must: given.is_some(),
            directory: given
                .map_or_else(|| Cache::beside(results).directory().to_owned(), Path::to_owned),
        })
    }
}
