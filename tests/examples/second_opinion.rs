// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prints the table "Second opinion" of `docs/validation.md`: RCWA against integral equations on the paper's rings.
//!
//! `cargo run --release -p batwing-tests --example second_opinion`, several minutes of CPU.

#![expect(
    clippy::print_stdout,
    reason = "a table on the terminal is what it is for"
)]

use anyhow::Result;
use batwing_tests::second_opinion::{
    Difference, KX0, RINGS, by_integrals, by_rcwa, difference, ring,
};
use batwing_tests::tables::resolution;
use rcwa::Pol;

fn main() -> Result<()> {
    println!(
        "| ring | integral equations: nodes, moved by, balance | RCWA: orders, slices | TE: order, r.m.s., transmitted | TM: the same |"
    );
    println!("|---|---|---|---|---|");
    for (file, band) in RINGS {
        let (ring, interface) = ring(file, band)?;
        let (exact, moved) = by_integrals(&interface, KX0)?;
        for more in [30, 90] {
            let resolution = resolution(&interface, more, 80)?;
            let approximate = by_rcwa(&interface, KX0, &resolution)?;
            let [te, tm] = Pol::BOTH.map(|pol| {
                let Difference {
                    order,
                    mean_square,
                    transmitted,
                } = difference(&exact, &approximate, pol);
                format!("{order:.1e}, {mean_square:.1e}, {transmitted:.1e}")
            });
            let (nodes, balance) = (exact.nodes(), exact.worst_balance());
            let (orders, slices) = (resolution.truncation.highest(), resolution.plan.count());
            println!(
                "| {file} {ring} | {nodes}, {moved:.0e}, {balance:.0e} | ±{orders}, {slices} and twice that | {te} | {tm} |"
            );
        }
    }
    Ok(())
}
