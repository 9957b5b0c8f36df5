// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prints the table "Error of a table" of `docs/validation/table-error.md`: requested, stated and
//! true error of a ring's table. The reference has 1.8 times the orders and twice the slices, some
//! twelve times the work.
//!
//! `cargo run --release -p batwing-tests --example table_error -- 2e-3 1e-3`

#![expect(clippy::print_stdout, reason = "a table on the terminal is what it is for")]

use anyhow::{Context as _, Result};
use batwing_tests::solver_comparison::{RINGS, ring};
use rcwa::accuracy::converge_hemisphere;
use rcwa::hemisphere::{Directions, Hemisphere, Interface, Resolution, hemisphere};
use rcwa::no_progress;
use rcwa::{Side, Truncation};

/// ky none of which the search looks at.
const KY: [f64; 5] = [0.09, 0.37, 0.71, 0.96, 1.23];

fn main() -> Result<()> {
    let tolerances = std::env::args()
        .skip(1)
        .map(|t| t.parse::<f64>().with_context(|| format!("tolerance: expected a number, got {t}")))
        .collect::<Result<Vec<_>>>()?;
    println!(
        "| ring | asked | M | slices | stated | mean | 99 % | largest | of any order, r.m.s. |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (file, band) in RINGS {
        let (name, interface) = ring(file, band)?;
        for &tolerance in &tolerances {
            let (coarse, stated) = converge_hemisphere(&interface, tolerance, &no_progress)?;
            let fine = Resolution {
                truncation: Truncation::new(coarse.truncation.highest() * 9 / 5)?,
                plan: coarse.plan.refined(2),
            };
            let of = |resolution: &Resolution| shares(&interface, resolution);
            let (table, finer) = (of(&coarse)?, of(&fine)?);
            let error = errors(&table, &finer);
            println!(
                "| {file} {name} | {tolerance:.0e} | {} | {} | {stated:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.1e} |",
                coarse.truncation.highest(),
                coarse.plan.count(),
                error.mean,
                error.nearly_all,
                error.largest,
                error.order,
            );
        }
    }
    Ok(())
}

fn shares(interface: &Interface, resolution: &Resolution) -> Result<Hemisphere> {
    let directions = Directions { kx_per_zone: 2, ky: KY.to_vec() };
    Ok(hemisphere(interface, &directions, resolution, &no_progress)?)
}

/// Departures of what each wave has transmitted, over all waves, which weighs them as diffuse light
/// does.
struct Errors {
    mean: f64,
    nearly_all: f64,
    largest: f64,
    /// Root mean square over the waves of the largest departure of an order.
    order: f64,
}

fn errors(table: &Hemisphere, finer: &Hemisphere) -> Errors {
    let transmitted = |shares: &[(Side, i32, f64)]| -> f64 {
        let through = shares.iter().filter(|s| s.0 == Side::Bottom);
        through.map(|s| s.2).sum()
    };
    let waves = table.incidences.iter().zip(&finer.incidences);
    let (mut totals, mut squares) = (Vec::new(), 0.0);
    for (a, b) in waves {
        totals.push((transmitted(&a.efficiencies) - transmitted(&b.efficiencies)).abs());
        let orders = a.efficiencies.iter().zip(&b.efficiencies);
        squares += orders.map(|(a, b)| (a.2 - b.2).abs()).fold(0.0_f64, f64::max).powi(2);
    }
    totals.sort_by(f64::total_cmp);
    let count = totals.len();
    Errors {
        mean: totals.iter().sum::<f64>() / count as f64,
        nearly_all: totals[(count - 1) * 99 / 100],
        largest: totals[count - 1],
        order: (squares / count as f64).sqrt(),
    }
}
