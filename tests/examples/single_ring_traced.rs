// SPDX-License-Identifier: MIT OR Apache-2.0
//! D1 traced with a table of rings 74 to 76 as they stand beside each other for band 8, with one of
//! ring 75 endlessly repeated, and with none.
//!
//! The other bands, in the last trace all, scatter by ray optics in their unit cells, so that no
//! other table is needed. Both tables have the same nodes of incidence, orders to the same
//! wavevector and slices of the same thickness. `cargo run --release -p batwing-tests --example
//! single_ring_traced [PATHS]`, minutes of CPU.

#![expect(clippy::print_stdout, reason = "figures on the terminal are what it is for")]

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use bsdf::{Bsdf, Grid, OrderTable};
use rcwa::Truncation;
use rcwa::hemisphere::Resolution;
use rcwa::relief::Relief;

use batwing_tests::supercell::surface::{Neighbours, Ring};
use batwing_tests::tables::{SILICONE, WAVELENGTH_UM, on_silicone, order_table};
use batwing_tests::traces::design;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::scene::DomeSurface;
use simulate::trace::observe;

/// Band of D1, from 1, and the ring that stands for it.
const BAND: (usize, usize) = (8, 75);
/// Chords of the supercell.
const TEETH: usize = 3;
/// Orders kept beyond those that propagate in silicone, in orders of the grating of one tooth.
const MORE_ORDERS: usize = 8;
/// Thickness of slices before they are raised to multiples of three, µm.
const SLICE_UM: f64 = 0.1;
/// Nodes of ky.
const KY_COUNT: usize = 10;

/// The table of a relief of `teeth` chords.
fn table(relief: &Relief, teeth: usize) -> Result<OrderTable> {
    let slices = (relief.depth() / SLICE_UM).ceil() as usize;
    let chord = relief.period() / teeth as f64;
    let highest = (SILICONE * chord / WAVELENGTH_UM) as usize + MORE_ORDERS;
    let resolution = Resolution {
        truncation: Truncation::new(teeth * highest + teeth / 2)?,
        plan: relief.slice_plan(slices),
    };
    // Two nodes to a zone of the supercell, six to one of the grating.
    order_table(
        &on_silicone(relief.clone()),
        2 * TEETH / teeth,
        Grid::ky_nodes(SILICONE, 1.0, KY_COUNT),
        &resolution,
    )
}

fn main() -> Result<()> {
    let paths: u64 = std::env::args()
        .nth(1)
        .map_or(Ok(10_000_000), |n| n.parse())
        .context("a number of paths")?;
    let ring = Ring::of("d1.toml", BAND.1)?;
    let together = ring.supercell(TEETH, Neighbours::True)?;
    let alone = ring.grating(&together)?;
    let design = design("d1.toml");
    let interrupt = Interrupt::install()?;
    let env = RunContext::quiet(&interrupt, 1);
    let mut traced = Vec::new();
    for (what, of) in [
        ("rays", None),
        ("grating", Some((&alone.relief, 1))),
        ("neighbours", Some((&together.relief, TEETH))),
    ] {
        let DomeSurface::Banded(meridian, mut bands) = dome_surface(&design, Model::Control, None)?
        else {
            bail!("the control has bands");
        };
        if let Some((relief, teeth)) = of {
            bands[BAND.0 - 1] = Some(Arc::new(table(relief, teeth)?) as Arc<dyn Bsdf>);
        }
        let seen = observe(&design, &DomeSurface::Banded(meridian, bands), paths, what, env)?;
        traced.push(seen.figures(&design));
    }
    for ((rays, grating), neighbours) in traced[0].iter().zip(&traced[1]).zip(&traced[2]) {
        let (a, b) = (grating.entry, neighbours.entry);
        println!(
            "{}: rays {:.5} ± {:.5}, grating {:.5} ± {:.5}, neighbours {:.5} ± {:.5}; neighbours less grating {:.5} ± {:.5}",
            grating.key,
            rays.entry.value,
            rays.entry.standard_error,
            a.value,
            a.standard_error,
            b.value,
            b.standard_error,
            b.value - a.value,
            a.standard_error.hypot(b.standard_error),
        );
    }
    Ok(())
}
