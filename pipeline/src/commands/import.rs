// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing import`: reads a file of another program, checks it, describes it, and converts it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, ensure};
use bsdf::{LobeMotion, Side};
use clap::Args;
use serde_json::json;

use formats::content::{self, Content};
use formats::ray_files::Subset;
use formats::tables::CellTable;
use formats::{Holds, Reads, Writes, endings, ray_files, words};
use metrics::plural::count;
use runtime::atomic_file::{write_atomic, write_bytes};
use runtime::run_context::RunContext;

use super::arguments::{IncidentSide, whole};
use super::file_formats::{CellSteps, FileFormat, nanometres, not_over, print_written};
use super::outputs::file_writable;

/// Allowed refractive indices.
const INDICES: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Refractive index where none is given.
const INDEX: f64 = 1.0;
/// Side of the light where none is given.
const FROM: IncidentSide = IncidentSide::Outer;

/// `batwing import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// File of a format that is read.
    #[arg(value_name = "FILE", help = file_help())]
    pub file: PathBuf,
    /// File to convert it into
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Format to convert into, where the ending of --out leaves it open; tables go into formats of
    /// tables, far fields into far fields, rays into rays
    #[arg(long, value_enum, requires = "out")]
    pub format: Option<FileFormat>,
    /// Number of rays to write of a file of rays, taken by chance in proportion to their flux, which
    /// is kept in all [default: all]
    #[arg(long, value_name = "N", requires = "out", value_parser = whole(1..=1_000_000_000_000_u64))]
    pub rays: Option<u64>,
    /// Resolution of tables.
    #[command(flatten)]
    pub steps: CellSteps,
    /// Refractive index on the inner side, for scattering tables
    #[arg(long, value_name = "N", default_value_t = INDEX)]
    pub index_inner: f64,
    /// Refractive index on the outer side, for scattering tables
    #[arg(long, value_name = "N", default_value_t = INDEX)]
    pub index_outer: f64,
    /// Set of lamps of an EULUMDAT file, from 1 [default: 1]
    #[arg(long, value_name = "N", value_parser = whole(1..=10_000_usize))]
    pub lamp_set: Option<usize>,
    /// Side that the light of a Zemax or Speos file comes from
    #[arg(long, value_enum, default_value_t = FROM)]
    pub from: IncidentSide,
}

/// Help on the file, with the endings of all formats.
fn file_help() -> String {
    let list = |chosen: fn(&Reads) -> bool| endings(chosen).join(", ");
    let scatter = list(|reads| matches!(reads, Reads::Scatter(_)));
    let orders = list(|reads| matches!(reads, Reads::Orders(_)));
    let native = list(|reads| matches!(reads, Reads::OrdersOfFile(_)));
    let far = list(|reads| matches!(reads, Reads::FarField(_) | Reads::LampSets(_)));
    let rays = list(|reads| matches!(reads, Reads::Rays(_)));
    format!("File of tables ({scatter}, {orders}, {native}), a far field ({far}) or rays ({rays})")
}

/// Reads, checks, describes, converts.
pub fn run(arguments: &ImportArgs, context: RunContext) -> Result<()> {
    let file = &arguments.file;
    let format = match &arguments.out {
        Some(out) => {
            let format = FileFormat::of(arguments.format, out)?;
            file_writable(out).context("--out")?;
            not_over(file, out, format)?;
            Some((out, format))
        }
        None => None,
    };
    let content = content::read_lamp_set(file, arguments.lamp_set)?;
    let (mut json, text) = content.describe().with_context(|| file.display().to_string())?;
    json["file"] = file.display().to_string().into();
    ensure!(
        arguments.rays.is_none() || matches!(content, Content::Rays(_)),
        "--rays: expected a file of rays, got `{}`, {}",
        file.display(),
        content.format()
    );
    let is_table = matches!(content, Content::Orders(_) | Content::Scatter(_));
    let of_tables = [
        ("--index-inner", arguments.index_inner.to_bits() != INDEX.to_bits()),
        ("--index-outer", arguments.index_outer.to_bits() != INDEX.to_bits()),
        ("--from", arguments.from != FROM),
    ];
    let changed: Vec<&str> = arguments
        .steps
        .changed()
        .into_iter()
        .chain(of_tables)
        .filter_map(|(name, is_given)| is_given.then_some(name))
        .collect();
    ensure!(
        is_table || changed.is_empty(),
        "{}: expected a file of tables, got `{}`, {}",
        changed.join(", "),
        file.display(),
        content.format()
    );
    if let Some((out, format)) = format {
        return convert(&content, (out, format), arguments, context);
    }
    context.console.result(&json, || format!("{}: {text}", file.display()))
}

/// Refusal of a format that the `content` of `file` does not go into.
fn misfit(file: &Path, content: &Content, format: FileFormat) -> anyhow::Error {
    let expected = words(match content {
        Content::Rays(_) => &[Holds::Rays],
        Content::FarField(_) => &[Holds::FarField],
        Content::Orders(_) => &[Holds::Cells, Holds::Orders],
        Content::Scatter(_) => &[Holds::Cells],
    });
    anyhow!(
        "--format: expected {expected} for `{}`, {}, got {}",
        file.display(),
        content.format(),
        format.word
    )
}

fn convert(
    content: &Content,
    (out, format): (&Path, FileFormat),
    arguments: &ImportArgs,
    context: RunContext,
) -> Result<()> {
    let plain = |what: String| {
        let json = json!({"file": out.display().to_string(), "holds": what});
        context.console.result(&json, || format!("{}: {what}", out.display()))
    };
    match (content, format.writes) {
        (Content::Rays(_), Writes::Rays(to)) => {
            let subset = arguments.rays.map(|rays| Subset { rays, seed: context.seed });
            let written = ray_files::convert(&arguments.file, out, to, subset)?;
            let (flux, unit) = (written.flux, written.unit);
            plain(format!("{}, {flux:.6} {unit}", count(written.rays, "ray")))
        }
        (Content::FarField(far), Writes::FarField(text)) => {
            let table = (far.distribution)()?;
            let name = arguments.file.file_stem().unwrap_or_default();
            let labels = far.labels.clone().named(&name.to_string_lossy());
            write_bytes(out, text(&labels, &table, far.photometry).as_bytes())?;
            plain(format!("{:.4} lm", table.flux()))
        }
        (Content::Orders(table), Writes::Orders(write)) => {
            write_atomic(out, |file| write(table, file))?;
            plain(count(table.node_count(), "incidence"))
        }
        (Content::Orders(_) | Content::Scatter(_), Writes::Cells { write, .. }) => {
            let indices = [arguments.index_inner, arguments.index_outer];
            ensure!(
                indices.iter().all(|n| INDICES.contains(n)),
                "--index-inner, --index-outer: expected refractive indices from {} to {}, got {indices:?}",
                INDICES.start(),
                INDICES.end()
            );
            let side = match arguments.from {
                IncidentSide::Inner => Side::Inner,
                IncidentSide::Outer => Side::Outer,
            };
            let name = arguments.file.display().to_string();
            let surface = content.bsdf(&name, indices, LobeMotion::Fixed, side)?;
            let wavelength_nm = match content {
                Content::Scatter(file) => file.wavelength_nm,
                Content::Orders(table) => Some(nanometres(table)?),
                _ => None,
            };
            let fineness = arguments.steps.fineness();
            let table = CellTable { surface: surface.as_ref(), fineness: &fineness, wavelength_nm };
            print_written(&write(&table, out)?, None, context)
        }
        _ => Err(misfit(&arguments.file, content, format)),
    }
}
