// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing export`: designs, tables of diffraction orders and far fields in the formats of other
//! programs.

pub mod far_field;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use tracer::Distribution;

use arrays::cache::Cache;
use arrays::order_tables::{EXTENSION, read_table};
use design::Design;
use design::resolved::solids::CheckedSolid;
use design::spectrum::Spectrum;
use far_field::Stored;
use formats::body::{Body, DOME};
use formats::content::{self, Content};
use formats::photometry::{self, Labels, Photometry};
use formats::ray_files::RayFormat;
use formats::tables::CellTable;
use formats::{Holds, Writes, words};
use metrics::digits::shortest;
use metrics::plural::count;
use runtime::atomic_file::{write_atomic, write_bytes};
use runtime::run_context::RunContext;
use simulate::model::Model;
use simulate::scene::DomeSurface;
use simulate::spectral::SpectralJob;
use simulate::tables::tables as solve;
use simulate::trace::observe;
use simulate::trace_plan::TracePlan;
use simulate::{bodies, scene_check};

use super::arguments::{cache, paths};
use super::file_formats::{CellSteps, FileFormat, nanometres, not_over, print_written};
use super::outputs::file_writable;
use crate::ray_export::{ExportedRays, RayExport, common_wavelength};

/// Models for traced rays and far fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportModel {
    /// Rays on the relief as designed.
    Geometric,
    /// Rays, with the relief as a BSDF by RCWA or from files.
    Hybrid,
}

/// Allowed flux of the sources, lm.
const LUMENS: std::ops::RangeInclusive<f64> = 1e-12..=1e12;

/// `batwing export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// Design file, table (.bworders, .json, .npz), or directory of one model's results
    #[arg(value_name = "DESIGN|TABLE|RESULTS")]
    pub input: PathBuf,
    /// Format to write, where the ending of --out leaves it open; designs give far fields, rays and
    /// CAD, tables of orders give tables, results give far fields
    #[arg(long, value_enum)]
    pub format: Option<FileFormat>,
    /// File to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Resolution of tables.
    #[command(flatten)]
    pub steps: CellSteps,
    /// How a design's rays and far field are traced
    #[arg(long, value_enum, default_value = "geometric")]
    pub model: ExportModel,
    /// Paths to trace, instead of the design's trace.paths
    #[arg(long, value_name = "N", value_parser = paths)]
    pub paths: Option<u64>,
    /// Luminous flux of the sources in lm (of converted light that which leaves), for far fields
    /// [default: that of the design, else 1000]
    /// and ray files [default: that of the design, else not stated]
    #[arg(long, value_name = "LM")]
    pub lumens: Option<f64>,
    /// Absolute photometry instead of relative to the flux of the sources
    #[arg(long)]
    pub absolute: bool,
    /// Largest distance of a mesh from the true surface, micrometres
    #[arg(long, value_name = "UM", default_value_t = 0.5)]
    pub chord_error: f64,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the file written]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// Writes the input in the format asked for.
pub fn run(arguments: &ExportArgs, context: RunContext) -> Result<()> {
    let format = checked(arguments)?;
    let input = &arguments.input;
    not_over(input, &arguments.out, format)?;
    if input.is_dir() {
        return of_results(arguments, format, context);
    }
    if input.extension().is_some_and(|e| e == "toml") {
        let design = scene_check::load(input)?;
        return write_design(&design, arguments, format, context);
    }
    of_table(arguments, format, context)
}

/// Writes `design` in place of the input that the arguments name.
///
/// # Errors
/// Those of the command.
pub fn of_design(design: &Design, arguments: &ExportArgs, context: RunContext) -> Result<()> {
    write_design(design, arguments, checked(arguments)?, context)
}

/// The format, of arguments that can be met.
fn checked(arguments: &ExportArgs) -> Result<FileFormat> {
    if let Some(lumens) = arguments.lumens {
        ensure!(
            LUMENS.contains(&lumens),
            "--lumens: expected a flux from {:e} to {:e} lm, got {lumens}",
            LUMENS.start(),
            LUMENS.end()
        );
    }
    let format = FileFormat::of(arguments.format, &arguments.out)?;
    file_writable(&arguments.out).context("--out")?;
    Ok(format)
}

fn of_table(arguments: &ExportArgs, format: FileFormat, context: RunContext) -> Result<()> {
    let input = &arguments.input;
    let table = if input.extension().is_some_and(|e| e == EXTENSION) {
        Arc::new(read_table(input)?)
    } else {
        match content::read(input)? {
            Content::Orders(table) => table,
            other => bail!(
                "`{}`: expected a design, a table of orders or a directory of results, got {}; `batwing import` converts it",
                input.display(),
                other.format()
            ),
        }
    };
    let out = &arguments.out;
    match format.writes {
        Writes::Orders(write) => {
            write_atomic(out, |file| write(&table, file))?;
            let json = json!({"file": out.display().to_string()});
            context.console.result(&json, || format!("{}", out.display()))
        }
        Writes::Cells { write, .. } => {
            let cells = CellTable {
                surface: table.as_ref(),
                fineness: &arguments.steps.fineness(),
                wavelength_nm: Some(nanometres(&table)?),
            };
            print_written(&write(&cells, out)?, Some(&table), context)
        }
        _ => bail!(
            "`{}` is a table: expected --format {}",
            input.display(),
            words(&[Holds::Cells, Holds::Orders])
        ),
    }
}

fn of_results(arguments: &ExportArgs, format: FileFormat, context: RunContext) -> Result<()> {
    let Writes::FarField(text) = format.writes else {
        bail!(
            "`{}` is a directory of results: expected --format {}",
            arguments.input.display(),
            words(&[Holds::FarField])
        );
    };
    let stored = far_field::of_results(&arguments.input)?;
    let name = arguments
        .input
        .canonicalize()?
        .components()
        .rev()
        .take(2)
        .map(|c| c.as_os_str().to_string_lossy().into_owned())
        .collect::<Vec<_>>();
    let name: Vec<&str> = name.iter().rev().map(String::as_str).collect();
    far_field(&name.join(" "), &stored, text, arguments, context)
}

/// Writes a far field of 1 lm. Photometry is absolute where the design states its lumens and the arguments
/// state no others.
fn far_field(
    name: &str,
    Stored { far, lumens: stated, electrical_w, is_converted }: &Stored,
    text: fn(&Labels, &Distribution, Photometry) -> String,
    arguments: &ExportArgs,
    context: RunContext,
) -> Result<()> {
    let out = &arguments.out;
    let photometry = Photometry {
        lumens: arguments.lumens.or(*stated).unwrap_or(1000.0),
        absolute: arguments.absolute || arguments.lumens.is_none() && stated.is_some(),
        // What both formats have for unknown.
        watts: electrical_w.unwrap_or(0.0),
    };
    let table = far.clone().scaled(photometry.lumens);
    let labels = Labels::of_simulation(name);
    write_bytes(out, text(&labels, &table, photometry).as_bytes())?;
    let flux = table.flux();
    let mut json = json!({"file": out.display().to_string(), "flux_lm": flux});
    let mut of_sources = String::new();
    if !is_converted {
        json["sources_lm"] = photometry.lumens.into();
        of_sources = format!(" of {} lm", photometry.lumens);
    }
    context.console.result(&json, || {
        format!(
            "{}\n  {flux:.4} lm{of_sources} leave; interpolation gives the flux of every bin",
            out.display()
        )
    })
}

fn write_design(
    design: &Design,
    arguments: &ExportArgs,
    format: FileFormat,
    context: RunContext,
) -> Result<()> {
    let out = &arguments.out;
    let about = format!("{}, batwing {}", design.name, env!("CARGO_PKG_VERSION"));
    match format.writes {
        Writes::Solids(write) => {
            let bodies = bodies::whole(design)?;
            write_atomic(out, |file| write(&bodies, &design.name, file))?;
            let copies = |b: &Body| json!({"body": b.name, "copies": b.places.len()});
            let all: Vec<Value> = bodies.iter().map(copies).collect();
            let json = json!({"file": out.display().to_string(), "bodies": all});
            context.console.result(&json, || {
                let lines = bodies.iter().map(|b| match b.places.len() {
                    1 => format!("  {}", b.name),
                    copies => format!("  {}, {copies} times", b.name),
                });
                format!("{}\n{}", out.display(), lines.collect::<Vec<_>>().join("\n"))
            })
        }
        Writes::Bodies { single, write } => {
            let mut bodies = bodies::bodies(design, arguments.chord_error * 1e-3)
                .with_context(|| format!("--chord-error: {} um", arguments.chord_error))?;
            if single && bodies.len() > 1 {
                // The box, which comes after the dome.
                bodies.remove(usize::from(design.dome.is_some()));
            }
            write_atomic(out, |file| write(&bodies, &about, file))?;
            let left_out = bodies::without_mesh(design);
            let json: Vec<Value> = bodies
                .iter()
                .map(|b| json!({"body": b.name, "triangles": b.triangles.len(), "volume_mm3": b.volume()}))
                .collect();
            let json = json!({"file": out.display().to_string(), "chord_error_um": arguments.chord_error, "bodies": json, "left_out": left_out});
            context.console.result(&json, || {
                let lines = bodies.iter().map(|b| {
                    format!(
                        "  {}: {}, {:.6} mm³",
                        b.name,
                        count(b.triangles.len(), "triangle"),
                        b.volume()
                    )
                });
                let lines = lines.chain(said_left_out("sheets and solids of the array", &left_out));
                format!("{}\n{}", out.display(), lines.collect::<Vec<_>>().join("\n"))
            })
        }
        Writes::Meridians(write) => {
            let curves = bodies::meridians(design)?;
            ensure!(
                !curves.is_empty(),
                "{}: expected a design with a dome by a generating curve or a solid of revolution about the axis, it has none",
                design.provenance.file
            );
            write_atomic(out, |file| write(&curves, &about, file))?;
            let drawn = |name: &str| curves.iter().any(|(other, _)| other == name);
            let all = design.dome.iter().map(|_| DOME);
            let all = all.chain(design.solids.iter().map(CheckedSolid::name));
            let left_out: Vec<&str> = all.filter(|name| !drawn(name)).collect();
            let pieces: usize = curves.iter().map(|(_, curve)| curve.pieces.len()).sum();
            let json =
                json!({"file": out.display().to_string(), "pieces": pieces, "left_out": left_out});
            context.console.result(&json, || {
                let lines = std::iter::once(format!("  {}", count(pieces, "piece")))
                    .chain(said_left_out("not turned about the axis of the package", &left_out));
                format!("{}\n{}", out.display(), lines.collect::<Vec<_>>().join("\n"))
            })
        }
        Writes::FarField(_) | Writes::Rays(_) => light(design, arguments, format, context),
        Writes::Cells { .. } | Writes::Orders(_) => bail!(
            "`{}` is a design: expected --format {}; `batwing bsdf` makes its tables",
            arguments.input.display(),
            words(&[Holds::Geometry, Holds::FarField, Holds::Rays])
        ),
    }
}

/// The line about what a file does not hold, with the reason.
fn said_left_out(why: &str, names: &[&str]) -> Option<String> {
    (!names.is_empty()).then(|| format!("  without {} ({why}); STEP holds all", names.join(", ")))
}

/// Traces the design and writes its far field or its rays.
fn light(
    design: &Design,
    arguments: &ExportArgs,
    format: FileFormat,
    context: RunContext,
) -> Result<()> {
    let model = match arguments.model {
        ExportModel::Geometric => Model::Geometric,
        ExportModel::Hybrid => Model::Hybrid,
    };
    let model = model.available(design)?;
    let mut design = design.clone();
    design.trace.paths = arguments.paths.unwrap_or(design.trace.paths);
    let cache = cache(arguments.cache.as_deref(), &arguments.out);
    let surface = |plan: &TracePlan| {
        let tables = match model {
            Model::Hybrid => Some(solve(&[&plan.design], Some(&cache), None, context)?.remove(0)),
            _ => None,
        };
        plan.surface(tables.as_ref())
    };
    match format.writes {
        Writes::Rays(format) => {
            keeps_wavelengths(&design)?;
            rays(&design, (model, &cache), &surface, format, arguments, context)
        }
        Writes::FarField(text) => {
            keeps_wavelengths(&design)?;
            ensure!(
                design.spectrum.as_ref().is_none_or(Spectrum::is_line),
                "{}: light.spectrum: expected light.wavelength_nm; `batwing run` writes what a spectrum gives",
                design.provenance.file
            );
            ensure!(
                design.colours().is_none(),
                "{}: sources: expected the light of [light] for all, got others; `batwing run` writes what lights of several kinds give",
                design.provenance.file
            );
            let plan = TracePlan::of_model(&design, model, context.seed);
            let seen = observe(&design, &surface(&plan)?, plan.paths, &design.name, context)?;
            let far = photometry::distribution(seen.far_field.total(), &seen.sphere)?;
            let name = format!("{} {}", design.name, model.key(&design));
            let (lumens, electrical_w) = (design.emitted_lm(), design.electrical_w());
            let far = Stored { far, lumens, electrical_w, is_converted: false };
            far_field(&name, &far, text, arguments, context)
        }
        _ => bail!("expected a format of far fields or rays, got {}", format.word),
    }
}

/// Refuses a design whose light goes from one wavelength to others.
fn keeps_wavelengths(design: &Design) -> Result<()> {
    let first = design.luminophores().next();
    first.map_or(Ok(()), |luminophore| {
        bail!(
            "{}: luminophores: expected media that keep the wavelength of light, got {:?}; `batwing run` writes what a design that converts light gives",
            design.provenance.file,
            luminophore.name
        )
    })
}

/// Traces the design in all of its light and writes the rays that leave it, each with its wavelength
/// where there are several.
fn rays(
    design: &Design,
    (model, cache): (Model, &Cache),
    surface: &dyn Fn(&TracePlan) -> Result<DomeSurface>,
    format: &'static RayFormat,
    arguments: &ExportArgs,
    context: RunContext,
) -> Result<()> {
    let out = &arguments.out;
    let lights = design.all_lights().map(|lights| lights.radiometric());
    let traces = match &lights {
        Some(lights) => {
            SpectralJob { design, lights, model, cache: Some(cache), context }.shares()?
        }
        None => vec![(TracePlan::of_model(design, model, context.seed), 1.0)],
    };
    let wavelength = common_wavelength(&traces);
    ensure!(
        wavelength.is_some() || arguments.lumens.is_none(),
        "--lumens: expected none for rays of several wavelengths, whose watts say it, got {}",
        arguments.lumens.unwrap_or_default()
    );
    // Of several wavelengths other lumens per watt leave than are emitted.
    let lumens = arguments.lumens.or(design.emitted_lm()).filter(|_| wavelength.is_some());
    let lumens_per_watt = lumens.map(|lumens| lumens / design.emitted_w());
    let export = RayExport { design, traces: &traces, surface, format, lumens_per_watt };
    let ExportedRays { rays, flux_w, escaped_w } = export.write(out, context)?;
    let json = json!({"file": out.display().to_string(), "rays": rays, "flux_w": flux_w, "escaped_w": escaped_w, "wavelengths": traces.len()});
    context.console.result(&json, || {
        let coloured = match wavelength {
            Some(_) => String::new(),
            None => format!(" of {}", count(traces.len(), "wavelength")),
        };
        format!(
            "{}\n  {}{coloured}, {flux_w:.9} W of {} W emitted; the ledger counts {escaped_w:.9} W escaped",
            out.display(),
            count(rays, "ray"),
            shortest(design.emitted_w())
        )
    })
}
