// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing full-wave`: the section of a design's dome by rays, hybrid and Maxwell's equations.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use full_wave::{Body, FullWaveError, Resolution};
use rcwa::guard::free_bytes;
use section::compare::{FINE_DEG, Request, SETS, SourceRequest, WIDTHS_DEG, body, compare};
use section::dome::{Base, Section};
use serde_json::{Value, json};

use arrays::csv;
use design::Design;
use design::resolved::dome::Dome;
use geometry::profile::{Elements, Rounding, Shape};
use metrics::digits::format_value_with_error;
use metrics::quantity::{Quantity, Unit};
use report::full_wave::{curves, far_field_picture, quantity};
use results::full_wave::{Comparison, FILE, FullWaveFile, SCHEMA_VERSION};
use runtime::atomic_file::{supersede, write_bytes, write_json};
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use runtime::store::Store;
use simulate::scene::index_about_domes;
use simulate::scene_check;

use super::arguments::{cache, finite, paths, whole};
use super::outputs::{checkpoints, writable};

/// Share of the free memory that is taken without `--memory-gib`.
const MEMORY_SHARE: f64 = 0.6;
/// Kernels, operations of factorisations (four real products to a complex one) and of the rest a second and
/// core, for the time said beforehand.
const KERNELS_PER_SECOND: f64 = 1.2e7;
const OPERATIONS_PER_SECOND: f64 = 1.2e11;
const OTHER_OPERATIONS_PER_SECOND: f64 = 4e10;
/// Operations of a source over the square of the unknowns: of a far field whose angles grow with them, chosen,
/// and of the products of a step of refinement for two parities.
const OPERATIONS_OF_SOURCE: [f64; 2] = [12.0, 16.0];
/// Time beyond which fewer rings are taken by default, seconds. Chosen.
const DEFAULT_SECONDS: f64 = 600.0;
/// Time from which the solution of each polarisation is kept in the cache, seconds. Chosen.
const KEPT_SECONDS: f64 = 30.0;
/// Tables of the far fields and their picture, beside [`FILE`].
const TABLE: &str = "far_field.csv";
const PICTURE: &str = "far_field.png";

/// Parts of a design that the comparison takes and leaves out.
const IDEAL: &str = "Of the design: dome, relief, indices, one wavelength, and width, height and offset along x of \
    the LED, over a perfect and endless mirror. Left out: body, tilt and offset along y of the LED, other sources, \
    scattering, losses, films, solids and neighbours.";

/// `batwing full-wave`.
#[derive(Debug, Args)]
pub struct FullWaveArgs {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Rings from the axis to the rim [default: as many as ten minutes and the memory allow, at
    /// most those of the design]; of a dome without relief they state its size
    #[arg(long, value_name = "N", value_parser = whole(1..=2000_usize))]
    pub rings: Option<usize>,
    /// Width of a ring, µm [default: `hybrid.element_width_um`]
    #[arg(long, value_name = "UM", value_parser = finite, conflicts_with = "scale")]
    pub ring_width_um: Option<f64>,
    /// The whole dome, with the rings as designed, times this factor
    #[arg(long, value_name = "S", value_parser = finite)]
    pub scale: Option<f64>,
    /// Line sources over the chip, in twelve sets of as many, two at least: a number between is
    /// rounded up
    #[arg(long, value_name = "N", default_value = "360", value_parser = whole(2..=2000_usize))]
    pub sources: usize,
    /// Paths of rays and of the hybrid, for each polarisation
    #[arg(long, value_name = "N", default_value = "2e6", value_parser = paths)]
    pub paths: u64,
    /// Error of full wave over the largest bin of a source, 1e-10 to 1e-3
    #[arg(long, value_name = "SHARE", default_value_t = 1e-5, value_parser = finite)]
    pub tolerance: f64,
    /// Nodes of full wave to a wavelength in the dome, up to 40 [default: those that the tolerance
    /// needs, 7]
    #[arg(long, value_name = "N", value_parser = finite)]
    pub nodes: Option<f64>,
    /// Memory for full wave, GiB [default: 60 % of what is free]
    #[arg(long, value_name = "GIB", value_parser = finite)]
    pub memory_gib: Option<f64>,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "full-wave")]
    pub out: PathBuf,
}

/// Compares the models and writes what they give.
pub fn run(arguments: &FullWaveArgs, context: RunContext) -> Result<()> {
    of_design(&scene_check::load(&arguments.design)?, arguments, context)
}

/// Compares the models of `design` in place of the file that the arguments name.
///
/// # Errors
/// Those of the command.
pub fn of_design(design: &Design, arguments: &FullWaveArgs, context: RunContext) -> Result<()> {
    compute(design, arguments, context).with_context(|| arguments.design.display().to_string())
}

fn compute(design: &Design, arguments: &FullWaveArgs, context: RunContext) -> Result<()> {
    for (option, value, most) in [
        ("--ring-width-um", arguments.ring_width_um, 1e3),
        ("--scale", arguments.scale, 10.0),
        ("--memory-gib", arguments.memory_gib, 1e6),
    ] {
        if let Some(got) = value.filter(|got| !(*got > 0.0 && *got <= most)) {
            bail!("{option}: expected a number above 0 to {most}, got {got}");
        }
    }
    let resolution = resolution(arguments)?;
    writable(&arguments.out)?;
    let section = scaled_section(design, arguments, resolution)?;
    let sources = source_request(design, arguments.sources);
    let places = sources.places(&section, context.seed);
    let bodies = bodies(&section, resolution).map_err(name_memory_options)?;
    for body in &bodies {
        body.check_sources(&places.concat()).context(
            "led.size_mm, led.offset_mm, led.height_mm: sources over the LED, which is scaled with the dome, a \
             wavelength apart in height (um); more --rings, a larger --ring-width-um or --scale leave room",
        )?;
    }
    context.console.say(&plan(&section, &bodies, SETS * sources.per_set()));
    context.console.say(IDEAL);
    let request = Request {
        sources,
        resolution,
        paths: usize::try_from(arguments.paths)?,
        seed: context.seed,
        ..Request::default()
    };
    let step = |what: &str| -> Result<()> {
        context.console.say(what);
        Ok(context.interrupt.check()?)
    };
    let cache = cache(None, &arguments.out);
    let cache = Some(&cache).filter(|_| seconds(&bodies, arguments.sources) > KEPT_SECONDS);
    let store = checkpoints(cache, context)?;
    let comparison = compare(&section, &request, store.as_ref(), step)?;
    let of_smooth_dome = |what: &str| step(&format!("smooth dome: {what}"));
    let baseline = (!section.is_smooth())
        .then(|| compare(&section.smooth(), &request, store.as_ref(), of_smooth_dome))
        .transpose()?;
    let compared = [Some(&comparison), baseline.as_ref()];
    let path = |name: &str| arguments.out.join(name);
    let describe = |files: &[FileRecord]| describe(design, &section, &request, compared, files);
    let file: FullWaveFile = serde_json::from_value(describe(&[]))?;
    supersede(&path(FILE))?;
    let theta = Quantity::new("theta", Unit::Degree);
    let columns =
        file.parts().map(|(dome, part)| curves(dome, part)).collect::<Result<Vec<_>>>()?;
    csv::write_curves_csv(&path(TABLE), &theta, &quantity(), &columns.concat())?;
    write_bytes(&path(PICTURE), &far_field_picture(&file)?.png()?)?;
    let record = |name| FileRecord::of_output(&arguments.out, name);
    let mut json = describe(&[record(TABLE)?, record(PICTURE)?]);
    json["verdict"] = file.verdict().into();
    let json = sealed(json)?;
    write_json(&path(FILE), &json)?;
    store.iter().for_each(Store::finish);
    context
        .console
        .result(&json, || format!("{}\nwritten to {}", table(&file), arguments.out.display()))
}

/// Names the options that change what memory full wave needs or has, where it has too little.
fn name_memory_options(error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref() {
        Some(FullWaveError::Memory { .. }) => {
            error.context("--memory-gib, --rings, --ring-width-um or --scale, --nodes, --tolerance")
        }
        _ => error,
    }
}

/// Nodes that the tolerance needs, or more, and the memory.
fn resolution(arguments: &FullWaveArgs) -> Result<Resolution> {
    let tolerance = arguments.tolerance;
    ensure!(
        (1e-10..=1e-3).contains(&tolerance),
        "--tolerance: expected 1e-10 to 1e-3, got {tolerance:e}"
    );
    let within = Resolution::within(tolerance);
    let needed = within.nodes_per_wavelength;
    let nodes = arguments.nodes.unwrap_or(needed);
    ensure!(
        (needed..=40.0).contains(&nodes),
        "--nodes: expected {needed:.1}, which a tolerance of {tolerance:e} needs, to 40, got {nodes}"
    );
    let free = || MEMORY_SHARE * free_bytes().min(1e15);
    let max_bytes = arguments.memory_gib.map_or_else(free, |gib| gib * f64::from(1 << 30));
    Ok(Resolution { nodes_per_wavelength: nodes, max_bytes, ..within })
}

/// The relief of the design at the size asked for, or at the largest that fits.
fn scaled_section(
    design: &Design,
    arguments: &FullWaveArgs,
    resolution: Resolution,
) -> Result<Section> {
    let base = match &design.dome {
        Some(Dome::Sphere(sphere)) => Base::Sphere(*sphere),
        Some(Dome::Meridian(curve)) => Base::Curve(curve.clone()),
        Some(Dome::Mesh(mesh)) if mesh.file.is_some() => {
            bail!("dome.mesh: expected a dome with a section, got a mesh")
        }
        Some(Dome::Mesh(_)) => bail!("dome: expected a round one, got one by two meridians"),
        None => bail!("dome: expected a dome, got none"),
    };
    let ring_um = design.hybrid.element_width_um;
    let (mut relief, mut all) = (design.elements.clone(), design.hybrid_rings().shapes.len());
    if let Some(dome) = design.dome.as_ref().filter(|_| relief.shapes.is_empty()) {
        all = (1e3 * dome.radius_mm() / ring_um).ceil() as usize;
        relief = Elements {
            width_mm: dome.radius_mm() / all as f64,
            shapes: vec![Shape::Smooth; all],
            rounding: Rounding::default(),
        };
    }
    let width_um = match arguments.scale {
        Some(scale) => {
            all = relief.shapes.len();
            1e3 * relief.width_mm * scale
        }
        None => arguments.ring_width_um.unwrap_or(ring_um),
    };
    let index = [design.silicone.index, index_about_domes(design)?];
    // Radii of corners are those of a ring as the design has it.
    let times = arguments.scale.unwrap_or(width_um / ring_um);
    relief.rounding.tip_mm *= times;
    relief.rounding.valley_mm *= times;
    let make = |rings: usize| {
        let wavelength_um = 1e-3 * design.wavelength_nm;
        Section::new(&base, &relief, rings, width_um, wavelength_um, index)
    };
    if let Some(rings) = arguments.rings.or(arguments.scale.map(|_| all)) {
        return make(rings);
    }
    // Unknowns grow with the rings; the last number that fits is found by halving.
    let fits = |rings: usize| {
        let section = make(rings).ok()?;
        let bodies = bodies(&section, resolution).ok()?;
        (seconds(&bodies, arguments.sources) <= DEFAULT_SECONDS).then_some(section)
    };
    let (mut low, mut high) = (0, all + 1);
    let mut found = None;
    while high - low > 1 {
        let middle = low.midpoint(high);
        match fits(middle) {
            Some(section) => (low, found) = (middle, Some(section)),
            None => high = middle,
        }
    }
    if let Some(section) = found {
        return Ok(section);
    }
    let section = make(1)?;
    body(&section, resolution).map_err(name_memory_options)?;
    Ok(section)
}

/// Bodies that full wave solves: the section, and the smooth dome of its size where it has relief.
fn bodies(section: &Section, resolution: Resolution) -> Result<Vec<Body>> {
    let smooth = (!section.is_smooth()).then(|| section.smooth());
    std::iter::once(section).chain(&smooth).map(|dome| body(dome, resolution)).collect()
}

/// The chip of the design, in shares of its dome.
fn source_request(design: &Design, count: usize) -> SourceRequest {
    design.dome.as_ref().map_or_else(SourceRequest::default, |dome| SourceRequest {
        count,
        width: 0.5 * design.led.size_mm[0] / dome.radius_mm(),
        offset: design.led.offset_mm[0] / dome.radius_mm(),
        height: design.led.height_mm / dome.height_mm(),
    })
}

/// Time of full wave in both polarisations.
fn seconds(bodies: &[Body], sources: usize) -> f64 {
    let threads = rayon::current_num_threads() as f64;
    let core = |body: &Body| {
        let size = body.cost();
        let [far_field, refinement] = OPERATIONS_OF_SOURCE;
        let of_source = far_field + refinement * f64::from(size.refinements);
        let of_sources = of_source * (size.unknowns as f64).powi(2) * sources as f64;
        size.kernels / KERNELS_PER_SECOND
            + size.operations / OPERATIONS_PER_SECOND
            + of_sources / OTHER_OPERATIONS_PER_SECOND
    };
    2.0 * bodies.iter().map(core).sum::<f64>() / threads
}

fn plan(section: &Section, bodies: &[Body], sources: usize) -> String {
    let size = bodies[0].cost();
    format!(
        "{} {} of {:.2} um, radius {:.1} um, {:.1} nm: {} unknowns reduced to some {}, {:.2} GiB, full wave takes \
         some {:.0} s",
        section.rings(),
        if section.is_smooth() { "smooth rings" } else { "rings" },
        section.ring_width_um(),
        section.radius_um(),
        1e3 * section.wavelength_um,
        size.unknowns,
        size.reduced,
        (size.bytes + bodies[0].bytes_of_sources(sources)) / f64::from(1 << 30),
        seconds(bodies, sources) + 5.0
    )
}

fn table(file: &FullWaveFile) -> String {
    let mut text = String::new();
    let _ =
        writeln!(text, "{:<22} {:>18} {:>17} {:>9}", "model", "|peak|", "centre/peak", "missing");
    for (dome, part) in file.parts() {
        for far in &part.far_fields {
            let (peak, centre) = far.figures.map_or(("-".into(), "-".into()), |figures| {
                let [low, high] = figures.peak_deg;
                let peak =
                    if low < high { format!("{low}° to {high}°") } else { format!("{low}°") };
                let percent = [figures.centre_to_peak, figures.centre_to_peak_error];
                let [centre, error] = percent.map(|share| 100.0 * share);
                (peak, format!("{} %", format_value_with_error(centre, error)))
            });
            let name = format!("{dome}{}", far.model.name());
            let _ = writeln!(text, "{name:<22} {peak:>18} {centre:>17} {:>9.0e}", far.missing);
        }
    }
    let _ = writeln!(
        text,
        "\n{:<22} {:>6} {:>20} {:>8} {:>10} {:>10}",
        "distance", "bins", "r.m.s. beyond noise", "noise", "largest", "L1"
    );
    for (dome, d) in
        file.parts().flat_map(|(dome, part)| part.distances.iter().map(move |d| (dome, d)))
    {
        let _ = writeln!(
            text,
            "{:<22} {:>5}° {:>20} {:>6.1} % {:>8.1} % {:>8.1} %",
            format!("{dome}{}", d.model.name()),
            d.bin_deg,
            d.beyond_noise(),
            100.0 * d.noise,
            100.0 * d.largest,
            100.0 * d.l1
        );
    }
    text + &file.verdict()
}

/// The content of `full_wave.json` without verdict and hash.
fn describe(
    design: &Design,
    section: &Section,
    request: &Request,
    [comparison, baseline]: [Option<&Comparison>; 2],
    files: &[FileRecord],
) -> Value {
    json!({
        "schema_version": SCHEMA_VERSION,
        "version": env!("CARGO_PKG_VERSION"),
        "seed": request.seed,
        "inputs": design.provenance.inputs(),
        "files": files,
        "design": design.name,
        "wavelength_nm": design.wavelength_nm,
        "index": section.index,
        "ring_width_um": section.ring_width_um(),
        "sources": SETS * request.sources.per_set(),
        "places_um": request.sources.places(section, request.seed),
        "paths": request.paths,
        "nodes_per_wavelength": request.resolution.nodes_per_wavelength,
        "bin_deg": FINE_DEG,
        "widths_deg": WIDTHS_DEG,
        "taken": IDEAL,
        "comparison": comparison,
        "baseline": baseline,
    })
}
