// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing converge`: error and cost of one ring over orders and over slices.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use rcwa::Truncation;
use serde::Deserialize as _;
use serde_json::json;

use arrays::csv::{Column, write_csv};
use gratings::interface::interface;
use report::convergence_study::ConvergenceStudy;
use runtime::atomic_file;
use runtime::run_context::RunContext;
use simulate::{cells, scene_check};

use super::arguments::whole;
use super::outputs::writable;
use gratings::convergence::{ConvergenceSweep, MAX_SWEPT, SweepPlan, SweepPoint, study};

/// `batwing converge`.
#[derive(Debug, Args)]
pub struct ConvergeArgs {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Ring, from 1
    #[arg(long, value_name = "N")]
    pub ring: usize,
    /// Highest orders to try, such as 30,40,60 [default: from what propagates to nearly twice that]
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        value_parser = whole(1..=Truncation::MAX)
    )]
    pub orders: Option<Vec<usize>>,
    /// Numbers of slices to try [default: from 1 to 14 per wavelength of depth]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = whole(1..=MAX_SWEPT))]
    pub slices: Option<Vec<usize>>,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "convergence")]
    pub out: PathBuf,
}

/// Sweeps both resolutions and writes JSON, CSV and a picture.
pub fn run(arguments: &ConvergeArgs, context: RunContext) -> Result<()> {
    let design = scene_check::load(&arguments.design)?;
    let of_file = || arguments.design.display().to_string();
    let cell = cells::ring(&design, arguments.ring).with_context(of_file)?;
    let wavelength_um = design.wavelength_nm * 1e-3;
    let plan = SweepPlan::new(
        &interface(&cell, wavelength_um)?,
        arguments.orders.clone(),
        arguments.slices.clone(),
    )?;
    writable(&arguments.out)?;
    let found = study(&cell, wavelength_um, plan, context)?;

    let stem = format!("{}-ring-{:03}-convergence", design.name, arguments.ring);
    let path = |ending: &str| arguments.out.join(format!("{stem}{ending}"));
    csv(&path("-orders.csv"), &found.by_orders)?;
    if !found.by_slices.is_empty() {
        csv(&path("-slices.csv"), &found.by_slices)?;
    }
    let json = json!({
        "design": design.name,
        "ring": arguments.ring,
        "period_um": cell.period_um,
        "depth_um": cell.depth_um,
        "wavelength_um": wavelength_um,
        "tolerance": design.hybrid.tolerance,
        "study": found,
    });
    if let Some(picture) = ConvergenceStudy::deserialize(&json)?.picture()? {
        atomic_file::write_bytes(&path(".png"), &picture.png()?)?;
    }
    atomic_file::write_json(&path(".json"), &json)?;
    context
        .console
        .result(&json, || format!("{}\nwritten to {}", describe(&found), arguments.out.display()))
}

fn describe(study: &ConvergenceSweep) -> String {
    const HEADING: &str = "orders  slices      mean       rms      99 %       max   diffuse   largest order  operations  seconds";
    let plan = &study.plan;
    let mut text = String::new();
    let mut table = |what: String, points: &[SweepPoint]| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{what}\n{HEADING}");
        for p in points {
            let e = &p.errors;
            let _ = writeln!(
                text,
                "{:>6}  {:>6}  {:>8.1e}  {:>8.1e}  {:>8.1e}  {:>8.1e}  {:>8.1e}  {:>14.1e}  {:>10.2e}  {:>7.2}",
                p.orders,
                p.slices,
                e.flux_weighted_mean,
                e.rms,
                e.percentile_99,
                e.max,
                e.diffuse,
                e.largest_order,
                p.operations_per_problem,
                p.seconds
            );
        }
    };
    table(
        format!("Orders, against -{m}..{m} on as many slices:", m = plan.reference_orders),
        &study.by_orders,
    );
    if !study.by_slices.is_empty() {
        table(
            format!("\nSlices, against {} with as many orders:", plan.reference_slices),
            &study.by_slices,
        );
    }
    let _ = write!(
        text,
        "\nErrors of a direction's R or T over {} incident waves; operations of one (kx0, ky); worst energy residual {:.0e}",
        study.incident_waves, study.worst_energy_residual
    );
    text
}

fn csv(path: &Path, points: &[SweepPoint]) -> Result<()> {
    let column = |name: &str, value: &dyn Fn(&SweepPoint) -> f64| {
        Column::plain(name, points.iter().map(value).collect())
    };
    let columns = [
        Column::whole("orders", points.iter().map(|p| p.orders as f64).collect()),
        Column::whole("slices", points.iter().map(|p| p.slices as f64).collect()),
        column("error_flux_weighted_mean", &|p| p.errors.flux_weighted_mean),
        column("error_rms", &|p| p.errors.rms),
        column("error_percentile_99", &|p| p.errors.percentile_99),
        column("error_max", &|p| p.errors.max),
        column("error_diffuse", &|p| p.errors.diffuse),
        column("error_largest_order", &|p| p.errors.largest_order),
        column("operations_per_problem", &|p| p.operations_per_problem),
        column("seconds", &|p| p.seconds),
    ];
    write_csv(path, &columns)
}
