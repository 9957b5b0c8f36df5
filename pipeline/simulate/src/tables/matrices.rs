// SPDX-License-Identifier: MIT OR Apache-2.0
//! Jones matrices for a solved table: the same directions solved again at the same resolution, with
//! amplitudes.

use anyhow::{Result, ensure};
use bsdf::order_table::{JonesRow, OrderJones};
use bsdf::{NodeId, OrderTable};
use rcwa::hemisphere::{Interface, Resolution, hemisphere_matrices};

use runtime::run_context::RunContext;

use gratings::interface::{directions, side};

/// Adds the matrices of all nodes to `table` of `interface`.
///
/// # Errors
/// An interface whose efficiencies are extrapolated from two runs; those of the solver; matrices
/// that contradict the efficiencies.
pub(super) fn add(
    table: OrderTable,
    interface: &Interface,
    resolution: &Resolution,
    context: RunContext,
) -> Result<OrderTable> {
    let directions = directions(table.grid());
    let watch = context.interrupt.watch();
    let solved = hemisphere_matrices(interface, &directions, resolution, &watch)?;
    ensure!(
        solved.is_some(),
        "hybrid.tables = \"matrices\": expected a relief that absorbs nothing or has upright sides alone, not one whose shares are extrapolated from two runs"
    );
    let rows = solved.into_iter().flatten().map(|node| JonesRow {
        node: NodeId { side: side(node.side), kx_index: node.kx_index, ky_index: node.ky_index },
        orders: node
            .orders
            .into_iter()
            .map(|(to, order, jones)| OrderJones { to: side(to), order, jones })
            .collect(),
    });
    Ok(table.with_jones(rows)?)
}
