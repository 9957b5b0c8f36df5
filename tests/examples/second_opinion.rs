// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prints the table "Second opinion" of `docs/validation/second-opinion.md`: RCWA against integral
//! equations on the paper's rings.
//!
//! `cargo run --release -p batwing-tests --example second_opinion`, several minutes of CPU.

#![expect(clippy::print_stdout, reason = "a table on the terminal is what it is for")]

use anyhow::Result;
use batwing_tests::solver_comparison::{
    Difference, KX0, RINGS, by_integrals, by_rcwa, difference, ring,
};
use batwing_tests::tables::resolution;
use rcwa::Pol;
use rcwa::accuracy::converge_hemisphere;
use rcwa::no_progress;

/// Tolerance of the designs' tables.
const TOLERANCE: f64 = 2e-3;

fn main() -> Result<()> {
    println!(
        "| ring | nodes | moved by | balance | RCWA | | order | r.m.s. | transmitted | as tables count |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (file, band) in RINGS {
        let (ring, interface) = ring(file, band)?;
        let (exact, moved) = by_integrals(&interface, KX0)?;
        let (nodes, balance) = (exact.nodes(), exact.worst_balance());
        let (of_tables, _) = converge_hemisphere(&interface, TOLERANCE, &no_progress)?;
        for resolution in [of_tables, resolution(&interface, 90, 80)?] {
            let approximate = by_rcwa(&interface, KX0, &resolution)?;
            let (orders, slices) = (resolution.truncation.highest(), resolution.plan.count());
            for (name, pol) in [("TE", Pol::S), ("TM", Pol::P)] {
                let Difference { order, mean_square, transmitted, of_tables } =
                    difference(&exact, &approximate, pol);
                println!(
                    "| {file} {ring} | {nodes} | {moved:.0e} | {balance:.0e} | ±{orders}, {slices} | {name} \
                     | {order:.1e} | {mean_square:.1e} | {transmitted:.1e} | {of_tables:.1e} |"
                );
            }
        }
    }
    Ok(())
}
