// SPDX-License-Identifier: MIT OR Apache-2.0
//! Construction of an order table: rows in any order in, checked and packed arrays out.

use super::alias_table::{AliasTable, FULL};
use super::layout::{Layout, NodeOrders};
use super::{EFFICIENCY_TOLERANCE, EfficiencyRow, Grid, NodeId, OrderTable, TableHeader};
use crate::bsdf::Polarisation;
use crate::direction::Side;
use crate::error::Error;

impl OrderTable {
    /// Table from one row per node and polarisation, in any order.
    ///
    /// # Errors
    /// If the grid is invalid, a row is missing, doubled or outside the grid, an efficiency lies
    /// outside 0 to 1 or belongs to an evanescent order, or the efficiencies of a node sum to more
    /// than 1.
    pub fn build(
        header: TableHeader,
        grid: Grid,
        rows: impl IntoIterator<Item = EfficiencyRow>,
    ) -> Result<Self, Error> {
        grid.validate()?;
        let layout = Layout::new(&grid);
        let mut arrays = [vec![0.0_f32; layout.entries], vec![0.0_f32; layout.entries]];
        let mut seen = [vec![false; layout.nodes.len()], vec![false; layout.nodes.len()]];
        let mut filled = vec![false; layout.entries];
        for row in rows {
            let which = match row.polarisation {
                Polarisation::S => 0,
                Polarisation::P => 1,
                Polarisation::Unpolarised => return Err(Error::UnpolarisedRow),
            };
            let index =
                layout.find(row.node).ok_or(Error::NoSuchNode { node: row.node.to_string() })?;
            if std::mem::replace(&mut seen[which][index], true) {
                let row = described(row.node, row.polarisation);
                return Err(Error::NodeTwice { row });
            }
            let node = layout.nodes[index];
            filled[node.all()].fill(false);
            for order in row.orders {
                let value = order.efficiency;
                let refuse =
                    |expected| Err(invalid(row.node, order.to, order.order, expected, value));
                match node.entry(order.to, order.order) {
                    // NaN fails every comparison, so the range is tested positively.
                    _ if !(-EFFICIENCY_TOLERANCE..=1.0 + EFFICIENCY_TOLERANCE).contains(&value) => {
                        return refuse("an efficiency between 0 and 1");
                    }
                    Some(entry) if filled[entry] => return refuse("each order once"),
                    Some(entry) => {
                        filled[entry] = true;
                        arrays[which][entry] = value.clamp(0.0, 1.0) as f32;
                    }
                    None if value <= EFFICIENCY_TOLERANCE => {}
                    None => return refuse("no power in an order that does not propagate"),
                }
            }
        }
        for (which, polarisation) in [Polarisation::S, Polarisation::P].into_iter().enumerate() {
            let missing = grid.nodes().zip(&seen[which]).find(|(_, seen)| !**seen);
            if let Some((node, _)) = missing {
                let row = described(node, polarisation);
                return Err(Error::NodeMissing { row });
            }
        }
        let [s, p] = arrays;
        assemble(header, grid, layout, s, p)
    }

    /// Table from the arrays of a file, entry by entry.
    pub(crate) fn from_parts(
        header: TableHeader,
        grid: Grid,
        s: Vec<f32>,
        p: Vec<f32>,
    ) -> Result<Self, Error> {
        grid.validate()?;
        let layout = Layout::new(&grid);
        for array in [&s, &p] {
            if array.len() != layout.entries {
                return Err(Error::Inconsistent {
                    part: "number of efficiencies",
                    expected: layout.entries.to_string(),
                    got: array.len().to_string(),
                });
            }
        }
        // The layout lists its nodes in the order of the grid.
        for (id, node) in grid.nodes().zip(&layout.nodes) {
            for (entry, to, order) in node.orders() {
                let range = 0.0..=1.0;
                if let Some(value) = [s[entry], p[entry]].into_iter().find(|v| !range.contains(v)) {
                    let expected = "an efficiency between 0 and 1";
                    return Err(invalid(id, to, order, expected, f64::from(value)));
                }
            }
        }
        assemble(header, grid, layout, s, p)
    }
}

/// A row as messages name it.
fn described(node: NodeId, polarisation: Polarisation) -> String {
    format!("{node}, {polarisation:?}")
}

/// The error of an invalid efficiency.
fn invalid(node: NodeId, to: Side, order: i32, expected: &'static str, value: f64) -> Error {
    Error::Efficiency {
        order: format!("relative order {order} to the {to} side at {node}"),
        expected,
        value,
    }
}

/// Checks the header and the sums, and accumulates the efficiencies for sampling.
fn assemble(
    header: TableHeader,
    grid: Grid,
    layout: Layout,
    s: Vec<f32>,
    p: Vec<f32>,
) -> Result<OrderTable, Error> {
    for (name, value) in
        [("estimated_error", header.estimated_error), ("energy_residual", header.energy_residual)]
    {
        if !(value.is_finite() && value >= 0.0) {
            return Err(Error::Header { name, value });
        }
    }
    let mut cumulative = vec![0; layout.entries];
    for (id, node) in grid.nodes().zip(&layout.nodes) {
        accumulate(id, *node, [&s, &p], &mut cumulative)?;
    }
    let alias_table = AliasTable::new(&grid, &layout, &cumulative);
    Ok(OrderTable { header, grid, layout, s, p, cumulative, alias_table, jones: None })
}

/// Running sums of the unpolarised efficiencies of one node.
fn accumulate(
    id: NodeId,
    node: NodeOrders,
    [s, p]: [&[f32]; 2],
    cumulative: &mut [u32],
) -> Result<(), Error> {
    let range = node.all();
    let mut total = 0.0;
    for array in [s, p] {
        let sum: f64 = array[range.clone()].iter().map(|v| f64::from(*v)).sum();
        if sum > 1.0 + EFFICIENCY_TOLERANCE {
            let node = id.to_string();
            return Err(Error::Gain { node, sum });
        }
        total += 0.5 * sum;
    }
    // A sum within rounding of 1 is 1: a lossless table never absorbs a ray.
    let lossless = total > 1.0 - EFFICIENCY_TOLERANCE;
    let scale = if lossless { 0.5 / total } else { 0.5 };
    let mut sum = 0.0;
    for entry in range.clone() {
        sum += scale * (f64::from(s[entry]) + f64::from(p[entry]));
        cumulative[entry] = (sum * f64::from(FULL)).round() as u32;
    }
    if lossless {
        close(&mut cumulative[range]);
    }
    Ok(())
}

/// Makes the running sums of a lossless node end in exactly [`FULL`]: the last order with a
/// non-zero efficiency takes the rounding.
fn close(cumulative: &mut [u32]) {
    let Some(&last) = cumulative.last() else {
        return;
    };
    let from = cumulative.partition_point(|c| *c < last);
    cumulative[from..].fill(FULL);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_gives_rounding_to_the_last_order_with_a_share() {
        let mut sums = [10, 20, FULL - 3, FULL - 3];
        close(&mut sums);
        assert_eq!(sums, [10, 20, FULL, FULL]);
    }
}
