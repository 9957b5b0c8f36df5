// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing import`: reads a file of another program, checks it, describes it, and converts it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail, ensure};
use bsdf::{LobeMotion, Side};
use clap::Args;
use serde_json::json;

use files::atomic_file::write_bytes;
use files::formats::content::{self, Content};
use files::formats::photometry::{self, Labels, Photometry};
use files::formats::{ray_files, tables};
use files::run_context::RunContext;
use metrics::plural::count;

use super::arguments::{IncidentSide, whole};
use super::file_formats::{CellFile, CellSteps, FileFormat, nanometres, not_over};
use super::outputs::file_writable;

/// `batwing import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// File of tables (.bsdf, .txt, .xml, .anisotropicbsdf, .brdf, .json, .npz, .bworders), a far
    /// field (.ies, .ldt) or rays (.tm25ray, .ray, .dat, .sdf)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// File to convert it into
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Format to convert into, where the ending of --out leaves it open; tables go into formats of
    /// tables, far fields into far fields, rays into rays
    #[arg(long, value_enum, requires = "out")]
    pub format: Option<FileFormat>,
    /// Resolution of tables.
    #[command(flatten)]
    pub steps: CellSteps,
    /// Refractive index on the inner side, for scattering tables
    #[arg(long, value_name = "N", default_value_t = 1.0, allow_negative_numbers = true)]
    pub index_inner: f64,
    /// Refractive index on the outer side, for scattering tables
    #[arg(long, value_name = "N", default_value_t = 1.0, allow_negative_numbers = true)]
    pub index_outer: f64,
    /// Set of lamps of an EULUMDAT file, from 1 [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=10_000_usize))]
    pub lamp_set: Option<usize>,
    /// Side that the light of a Zemax or Speos file comes from
    #[arg(long, value_enum, default_value = "outer")]
    pub from: IncidentSide,
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
    let (mut json, text) =
        content.describe(arguments.lamp_set).with_context(|| file.display().to_string())?;
    json["file"] = file.display().to_string().into();
    if let Some((out, format)) = format {
        return convert(&content, (out, format), arguments, context);
    }
    context.console.result(&json, || format!("{}: {text}", file.display()))
}

/// The formats in words that `content` goes into.
fn wanted(content: &Content, format: FileFormat) -> anyhow::Error {
    let expected = match content {
        Content::Rays(_) => "tm25, ray, speos-ray or zemax-ray",
        Content::Ies(_) | Content::Ldt(_) => "ies or ldt",
        Content::Orders(_) => "zemax, lighttools, speos, klems, tensortree, json or npz",
        _ => "zemax, lighttools, speos, klems or tensortree",
    };
    anyhow!("--format: expected {expected} for {}, got {}", content.format(), format.word())
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
    match content {
        Content::Rays(_) => {
            let to = format.rays().ok_or_else(|| wanted(content, format))?;
            let written = ray_files::convert(&arguments.file, out, to)?;
            let (flux, unit) = (written.flux, written.unit);
            plain(format!("{}, {flux:.6} {unit}", count(written.rays, "ray")))
        }
        Content::Ies(_) | Content::Ldt(_) => {
            ensure!(matches!(format, FileFormat::Ies | FileFormat::Ldt), wanted(content, format));
            let table = content.distribution()?;
            let name = arguments.file.file_stem().unwrap_or_default();
            let name = name.to_string_lossy();
            let (labels, lumens, absolute, watts) = match content {
                Content::Ies(f) => {
                    let (absolute, lumens) = (f.is_absolute(), f.lumens_per_lamp * f.lamps as f64);
                    let lumens = if absolute { table.flux() } else { lumens };
                    (Labels::of_ies(f, &name), lumens, absolute, f.watts)
                }
                Content::Ldt(f) => (Labels::of_ldt(f, &name), f.flux, f.is_absolute(), f.watts),
                _ => bail!("expected a far field"),
            };
            let photometry = Photometry { lumens, absolute, watts };
            let text = photometry::text(out, &labels, &table, photometry)?;
            write_bytes(out, text.as_bytes())?;
            plain(format!("{:.4} lm", table.flux()))
        }
        Content::Orders(table) if format == FileFormat::Json => {
            tables::write_json(table, out)?;
            plain(count(table.node_count(), "incidence"))
        }
        Content::Orders(table) if format == FileFormat::Npz => {
            tables::write_npz(table, out)?;
            plain(count(table.node_count(), "incidence"))
        }
        _ => {
            let format = format.cells().ok_or_else(|| wanted(content, format))?;
            let indices = [arguments.index_inner, arguments.index_outer];
            ensure!(
                indices.iter().all(|n| n.is_finite() && *n > 0.0),
                "--index-inner, --index-outer: expected refractive indices above 0, got {indices:?}"
            );
            let side = match arguments.from {
                IncidentSide::Inner => Side::Inner,
                IncidentSide::Outer => Side::Outer,
            };
            let name = arguments.file.display().to_string();
            let surface = content.bsdf(&name, indices, LobeMotion::Fixed, side)?;
            // 0 stands for a wavelength that is not stated.
            let wavelength = match content {
                Content::LightTools(file) => Some(file.blocks[0].wavelength).filter(|w| *w > 0.0),
                Content::Orders(table) => Some(nanometres(table)?),
                _ => None,
            };
            let file = CellFile { format, steps: &arguments.steps, wavelength_nm: wavelength, out };
            file.write(surface.as_ref(), None, context)
        }
    }
}
