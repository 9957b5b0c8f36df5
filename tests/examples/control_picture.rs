// SPDX-License-Identifier: MIT OR Apache-2.0
//! Draws D1's far field: rays on the true 170 steps, the control with a cell for every ring, and
//! the control with one cell for ten rings.
//!
//! `cargo run --release -p batwing-tests --example control_picture -- control-d1.png`

use std::path::PathBuf;

use anyhow::Result;

use batwing_tests::traces::{design, every_ring, trace};
use metrics::quantity::{Quantity, Unit};
use report::plots::{FarField, Heading, LineColours, far_field_cartesian};
use runtime::atomic_file::write_bytes;
use simulate::model::Model;

const PATHS: u64 = 20_000_000;

fn main() -> Result<()> {
    let file = std::env::args_os().nth(1).map_or_else(|| "control-d1.png".into(), PathBuf::from);
    let (bands, rings) = (design("d1.toml"), every_ring("d1.toml"));
    let curves = [
        trace(&bands, Model::Fine, PATHS, 1).azimuthal_mean("170 steps, rays")?,
        trace(&rings, Model::Control, PATHS, 2).azimuthal_mean("control, 170 cells")?,
        trace(&bands, Model::Control, PATHS, 3).azimuthal_mean("control, 17 cells")?,
    ];
    let heading = Heading::new("What 17 representatives do", "D1, far field averaged over azimuth");
    let quantity = Quantity::new("intensity", Unit::WattPerSteradian);
    let picture = FarField {
        heading: &heading,
        quantity: &quantity,
        curves: &curves,
        colours: LineColours::Ordered,
        numbers: &[],
        peaks: &[],
    };
    write_bytes(&file, &far_field_cartesian(&picture)?.png()?)
}
