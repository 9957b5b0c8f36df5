// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing import`: reads a file of another program, checks it, describes it, and converts it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use bsdf::{LobeMotion, Side};
use clap::{Args, ValueEnum};
use serde_json::json;

use super::arguments::IncidentSide;
use super::file_formats::{CellFile, CellSteps, FileFormat, nanometres};
use super::outputs::file_writable;
use crate::atomic_file::write_bytes;
use crate::formats::content::{self, Content};
use crate::formats::photometry::{self, Photometry};
use crate::formats::{ray_files, tables};
use crate::plural::count;
use crate::run_context::RunContext;

/// `batwing import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// File: .bsdf, .txt, .xml, .json, .npz, .ies, .ldt, .tm25ray or .ray
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// File to convert it into
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Format of a scattering table to convert into; other formats follow from the ending of --out
    #[arg(long, value_enum, requires = "out")]
    pub format: Option<FileFormat>,
    /// Resolution of tables.
    #[command(flatten)]
    pub steps: CellSteps,
    /// Refractive index on the inner side, for scattering tables
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    pub index_inner: f64,
    /// Refractive index on the outer side, for scattering tables
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    pub index_outer: f64,
    /// Side that the light of a Zemax file comes from
    #[arg(long, value_enum, default_value = "outer")]
    pub from: IncidentSide,
}

/// Reads, checks, describes, converts.
pub fn run(arguments: &ImportArgs, context: RunContext) -> Result<()> {
    let file = &arguments.file;
    let content = content::read(file)?;
    let (mut json, text) = content
        .describe()
        .with_context(|| file.display().to_string())?;
    json["file"] = file.display().to_string().into();
    if let Some(out) = &arguments.out {
        file_writable(out).context("--out")?;
        return convert(&content, out, arguments, context);
    }
    context
        .console
        .result(&json, || format!("{}: {text}", file.display()))
}

fn convert(
    content: &Content,
    out: &Path,
    arguments: &ImportArgs,
    context: RunContext,
) -> Result<()> {
    let plain = |what: String| {
        let json = json!({"file": out.display().to_string(), "holds": what});
        context
            .console
            .result(&json, || format!("{}: {what}", out.display()))
    };
    match content {
        Content::Rays(_) => {
            let (rays, flux) = ray_files::convert(&arguments.file, out)?;
            plain(format!("{}, {flux:.6} W", count(rays, "ray")))
        }
        Content::Ies(_) | Content::Ldt(_) => {
            let table = content.distribution()?;
            let (lumens, absolute, watts) = match content {
                Content::Ies(f) if f.is_absolute() => (table.flux(), true, f.watts),
                Content::Ies(f) => (f.lumens_per_lamp * f.lamps as f64, false, f.watts),
                Content::Ldt(f) => (f.flux, f.is_absolute(), f.watts),
                _ => bail!("expected a far field"),
            };
            let photometry = Photometry { lumens, absolute };
            let name = arguments.file.display().to_string();
            let text = photometry::text(out, &name, &table, photometry, watts)?;
            write_bytes(out, text.as_bytes())?;
            plain(format!("{:.4} lm", table.flux()))
        }
        Content::Orders(table)
            if matches!(arguments.format, Some(FileFormat::Json | FileFormat::Npz)) =>
        {
            if arguments.format == Some(FileFormat::Json) {
                tables::write_json(table, out)?;
            } else {
                tables::write_npz(table, out)?;
            }
            plain(count(table.node_count(), "incidence"))
        }
        _ => {
            let format = arguments.format.and_then(FileFormat::cells).with_context(|| {
                let got = arguments.format.and_then(|f| f.to_possible_value());
                let got = got.map_or("none".to_owned(), |v| v.get_name().to_owned());
                format!(
                    "--format: expected zemax, lighttools, klems or tensortree for {}, got {got}",
                    content.format()
                )
            })?;
            let indices = [arguments.index_inner, arguments.index_outer];
            ensure!(
                indices.iter().all(|n| n.is_finite() && *n > 0.0),
                "--index-inner, --index-outer: expected refractive indices above 0, got {indices:?}"
            );
            let side = match arguments.from {
                IncidentSide::Inner => Side::Inner,
                IncidentSide::Outer => Side::Outer,
            };
            let surface = content.bsdf(indices, LobeMotion::Fixed, side)?;
            // 0 stands for a wavelength that is not stated.
            let wavelength = match content {
                Content::LightTools(file) => Some(file.blocks[0].wavelength).filter(|w| *w > 0.0),
                Content::Orders(table) => Some(nanometres(table)?),
                _ => None,
            };
            let file = CellFile {
                format,
                steps: &arguments.steps,
                wavelength_nm: wavelength,
                out,
            };
            file.write(surface.as_ref(), None, context)
        }
    }
}
