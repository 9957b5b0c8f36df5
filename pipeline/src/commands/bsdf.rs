// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing bsdf`: tables of diffraction orders of chosen rings, as files, with the cost of each; or
//! the film stack.

mod films;

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use bsdf::{Side, validate};
use clap::Args;
use rcwa::accuracy::{MAX_TOLERANCE, MIN_TOLERANCE};
use serde_json::{Value, json};

use arrays::order_tables::{EXTENSION, write_table};
use design::Design;
use metrics::plural::count;
use runtime::progress::Console;
use runtime::run_context::RunContext;
use simulate::job::{Job, SharedWork};
use simulate::scene_check;
use simulate::tables::labelled;

use super::arguments::{cache, whole};
use super::file_formats::{CellFormat, CellSteps};
use super::outputs::writable;
use super::shardable::{CommandLine, JobOptions, Shardable, Sharing};
use simulate::rings::{self, RingChoice, RingTable, each};

/// A parser of tolerances that the solver accepts.
fn tolerance(text: &str) -> Result<f64, String> {
    let range = MIN_TOLERANCE..=MAX_TOLERANCE;
    text.parse()
        .ok()
        .filter(|t| range.contains(t))
        .ok_or_else(|| format!("expected a number from {MIN_TOLERANCE:e} to {MAX_TOLERANCE}"))
}

const HEADING: &str = "ring  period (um)  orders  slices  kx0 x ky  est. error  one direction  energy   seconds  operations     bytes  file";

/// `batwing bsdf`.
#[derive(Debug, Args)]
pub struct BsdfArgs {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Rings: numbers from 1, `representatives` (one for each band) or `all`, each from its own
    /// cell
    #[arg(long, value_name = "75|5,75,165|representatives|all", default_value = "representatives")]
    pub rings: RingChoice,
    /// Largest error of a direction's R or T, instead of the design's hybrid.tolerance
    #[arg(long, value_name = "T", value_parser = tolerance)]
    pub tolerance: Option<f64>,
    /// Directory for the tables
    #[arg(long, value_name = "DIR", default_value = "tables")]
    pub out: PathBuf,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the tables]
    #[arg(long, value_name = "DIR", conflicts_with = "no_cache")]
    pub cache: Option<PathBuf>,
    /// Compute everything, and keep nothing but the tables themselves
    #[arg(long, conflicts_with = "shard")]
    pub no_cache: bool,
    /// The whole film stack as one scattering file, from rays, in place of rings
    #[arg(long, conflicts_with_all = ["rings", "tolerance", "cache", "no_cache", "shard"])]
    pub films: bool,
    /// Format of the film stack [default: klems]
    #[arg(long, value_enum, requires = "films")]
    pub format: Option<CellFormat>,
    /// Paths for each incidence of the film stack's file
    #[arg(
        long,
        value_name = "N",
        requires = "films",
        default_value_t = 8192,
        value_parser = whole(1..=1_000_000_000_u64)
    )]
    pub paths: u64,
    /// Resolution of the film stack's file.
    #[command(flatten)]
    pub steps: CellSteps,
    /// Shards.
    #[command(flatten)]
    pub sharing: Sharing,
}

impl Shardable for BsdfArgs {
    fn job_options(&self) -> JobOptions<'_> {
        JobOptions::new(&self.out, self.cache.as_deref(), &self.sharing)
    }

    fn words(&self) -> Vec<String> {
        CommandLine::new("bsdf", &self.design)
            .option("--rings", Some(&self.rings))
            .option("--tolerance", self.tolerance)
            .all()
    }

    fn work(&self, _: RunContext) -> Result<Box<dyn SharedWork>> {
        ensure!(!self.films, "--films: expected bsdf by itself: shards compute rings");
        ensure!(!self.no_cache, "--no-cache: expected a cache, in which shards leave their tables");
        let (design, rings) = self.rings()?;
        let inputs = design.provenance.inputs();
        Ok(Box::new(Job::new(rings::of(&design, &rings), Vec::new(), inputs)))
    }

    /// Finds or solves the chosen rings, and writes `<design>-ring-075.bworders` and its neighbours.
    fn run(&self, context: RunContext) -> Result<()> {
        if self.films {
            return films::run(self, context);
        }
        let changed = self.steps.changed().into_iter().find(|(_, is_changed)| *is_changed);
        if let Some((name, _)) = changed {
            bail!("{name}: expected it beside --films, got --rings {}", self.rings);
        }
        let (design, rings) = self.rings()?;
        writable(&self.out)?;
        let cache = (!self.no_cache).then(|| cache(self.cache.as_deref(), &self.out));
        if let Some(cache) = &cache {
            writable(cache.directory())?;
        }

        // Rows are printed as they come: all rings of a design take minutes.
        let rows_for_people = !context.console.json && !context.console.quiet;
        if rows_for_people {
            Console::print(HEADING)?;
        }
        let begin = Instant::now();
        let mut rows = Vec::new();
        each(&design, &rings, cache.as_ref(), context, |ring| {
            let file = self.out.join(format!("{}-ring-{:03}.{EXTENSION}", design.name, ring.ring));
            let table = labelled(&ring.table, &design, ring.band, ring.ring)?;
            write_table(&file, &table)?;
            let bytes = std::fs::metadata(&file)
                .with_context(|| format!("cannot look at `{}`", file.display()))?
                .len();
            let file = file.display().to_string();
            if rows_for_people {
                Console::print(&row(&ring, bytes, &file))?;
            }
            rows.push(describe(&ring, bytes, &file));
            Ok(())
        })?;
        let seconds = begin.elapsed().as_secs_f64();
        let total = |key: &str| -> f64 { rows.iter().filter_map(|r| r[key].as_f64()).sum() };
        let summary = format!(
            "{} in {seconds:.1} s, {:.2e} operations, {:.1} MB",
            count(rows.len(), "table"),
            total("operations"),
            total("bytes") * 1e-6
        );
        let json = json!({
            "design": design.name,
            "tolerance": design.hybrid.tolerance,
            "seconds": seconds,
            "rings": rows,
        });
        context.console.result(&json, || summary)
    }
}

impl BsdfArgs {
    /// The design at the tolerance asked for, and the chosen rings.
    fn rings(&self) -> Result<(Design, Vec<usize>)> {
        let mut design = scene_check::load(&self.design)?;
        if let Some(tolerance) = self.tolerance {
            design.hybrid.tolerance = tolerance;
        }
        let of_file = || self.design.display().to_string();
        let rings = self.rings.rings(&design).with_context(of_file)?;
        Ok((design, rings))
    }
}

fn row(ring: &RingTable, bytes: u64, file: &str) -> String {
    let (header, grid) = (ring.table.header(), ring.table.grid());
    let seconds = if ring.from_cache {
        "cached".to_owned()
    } else {
        format!("{:.2}", ring.time.as_secs_f64())
    };
    format!(
        "{:>4}  {:>11.4}  {:>6}  {:>6}  {:>8}  {:>10.1e}  {:>13.1e}  {:>6.0e}  {:>8}  {:>10.2e}  {bytes:>8}  {file}",
        ring.ring,
        ring.cell.period_um,
        header.truncation,
        header.slices,
        format!("{} x {}", grid.kx_per_zone, grid.ky.len()),
        header.estimated_error,
        Side::BOTH
            .map(|side| validate::leave_one_out(&ring.table, side))
            .into_iter()
            .fold(0.0, f64::max),
        header.energy_residual,
        seconds,
        ring.operations.total(),
    )
}

fn describe(ring: &RingTable, bytes: u64, file: &str) -> Value {
    let (header, grid) = (ring.table.header(), ring.table.grid());
    json!({
        "ring": ring.ring,
        "band": ring.band,
        "period_um": ring.cell.period_um,
        "depth_um": ring.cell.depth_um,
        "orders": header.truncation,
        "slices": header.slices,
        "kx0_points": grid.kx_per_zone,
        "ky_points": grid.ky.len(),
        "estimated_error": header.estimated_error,
        "grid_error": header.more.get("grid_error"),
        "kx_error": header.more.get("kx_error"),
        "between_nodes": {
            "inner": validate::leave_one_out(&ring.table, Side::Inner),
            "outer": validate::leave_one_out(&ring.table, Side::Outer),
        },
        "energy_residual": header.energy_residual,
        "seconds": ring.time.as_secs_f64(),
        "from_cache": ring.from_cache,
        "operations": ring.operations.total().round(),
        "operations_of_modes": ring.operations.lines.round(),
        "bytes": bytes,
        "cache_key": ring.key.hex(),
        "file": file,
    })
}
