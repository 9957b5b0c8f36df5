// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing bsdf --films`: the whole film stack of a design as a scattering file, with what it sends
//! back and lets through of diffuse light.

use anyhow::{Context, Result, bail};
use bsdf::Side;
use serde_json::json;
use tracer::{StackLight, StackSurface};

use design::Design;
use formats::tables::{self, CellTable, Written};
use formats::{Holds, Writes, window, words};
use metrics::Estimate;
use metrics::digits::{format_value_with_error, shortest};
use results::film_stack::{
    BothSides, FILE, FilmStackFile, SCHEMA_VERSION, SharesAtAngle, StackIntensity, StackShares,
};
use runtime::atomic_file::{supersede, write_json};
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use simulate::{film_surface, scene_check};

use super::BsdfArgs;
use crate::commands::outputs::writable;

/// Rays by which diffuse light, and light along the normal, is sorted, from each side.
const DIFFUSE: u64 = 1 << 18;
/// Angles of incidence up to 90 degrees, and bins of those at which light leaves.
const ANGLES: u32 = 18;
const BINS: usize = 18;

/// Draws what the films do to light from each incidence of a file, and writes `<design>-films`.
pub fn run(arguments: &BsdfArgs, context: RunContext) -> Result<()> {
    let format = arguments.format.as_deref().unwrap_or(&window::KLEMS);
    let Writes::Cells { write, .. } = format.writes else {
        bail!("--format: expected {}, got {}", words(&[Holds::Cells]), format.word);
    };
    let design = scene_check::load(&arguments.design)?;
    let fineness = arguments.steps.fineness();
    let samples = fineness.resolution.samples as u64;
    // Each of the incidences that a file averages has its part of the paths.
    let each = arguments.paths.div_ceil(samples);
    let surface = film_surface::surface(&design, each, context.seed)?;
    writable(&arguments.out)?;
    let path = arguments.out.join(format!("{}-films.{}", design.name, format.endings[0]));
    let wavelength_nm = Some(design.wavelength_nm);
    let cells = CellTable { surface: &surface, fineness: &fineness, wavelength_nm };
    supersede(&arguments.out.join(FILE))?;
    let written = write(&cells, &path).with_context(|| path.display().to_string())?;

    let record = |file: &Written| {
        let name = file.path.file_name().unwrap_or_default().to_string_lossy();
        FileRecord::of_output(&arguments.out, &name)
    };
    let files = written.iter().map(record).collect::<Result<_>>()?;
    let file = describe(&design, &surface, files, (each * samples, context.seed));
    let results = arguments.out.join(FILE);
    write_json(&results, &sealed(serde_json::to_value(&file)?)?)?;
    let FilmStackFile { paths_of_an_incidence: paths, largest_standard_error: error, .. } = file;
    let json = json!({
        "design": design.name,
        "wavelength_nm": design.wavelength_nm,
        "seed": context.seed,
        "paths_of_an_incidence": paths,
        "largest_standard_error": error,
        "diffuse_light": file.diffuse_light,
        "files": written.iter().map(tables::describe).collect::<Vec<_>>(),
        "results": results.display().to_string(),
    });
    context.console.result(&json, || {
        let mut lines: Vec<String> = Vec::new();
        for file in &written {
            lines.push(format!(
                "{}\n  cells up to {:.3} degrees wide; {paths} paths for each incidence, whose shares have \
                 standard errors of at most {error:.1e}",
                file.path.display(),
                file.smearing.width_deg
            ));
        }
        for (from, own) in file.diffuse_light.each() {
            lines.push(format!("  diffuse light from {from}: {}", text_of(own)));
        }
        let wavelength = shortest(design.wavelength_nm);
        lines.push(format!("  at {wavelength} nm, without regard to where light leaves"));
        lines.push(format!(
            "over the angle: {}, drawn by `batwing report {}`",
            results.display(),
            arguments.out.display()
        ));
        lines.join("\n")
    })
}

/// What the stack sends back and lets through, with `paths` rays of each angle.
fn describe(
    design: &Design,
    surface: &StackSurface,
    files: Vec<FileRecord>,
    (paths, seed): (u64, u64),
) -> FilmStackFile {
    let shares = |side, light, count| {
        let tracer::StackShares { reflected, transmitted, absorbed } =
            surface.shares(side, light, count);
        let [transmittance, reflectance, absorptance] =
            [transmitted, reflected, absorbed].map(estimate);
        StackShares { transmittance, reflectance, absorptance }
    };
    let angles = |side| {
        let steps = (0..ANGLES).map(|step| 90.0 / f64::from(ANGLES) * f64::from(step));
        let at = |theta_deg| SharesAtAngle {
            theta_deg,
            shares: shares(side, StackLight::Angle(theta_deg), paths),
        };
        steps.map(at).collect::<Vec<_>>()
    };
    let normal = |side| {
        let bins = surface.intensity(side, StackLight::Angle(0.0), DIFFUSE, BINS);
        let [transmitted, reflected] = bins.map(|own| own.into_iter().map(estimate).collect());
        StackIntensity { transmitted, reflected }
    };
    FilmStackFile {
        schema_version: SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed,
        inputs: design.provenance.inputs(),
        files,
        design: design.name.clone(),
        wavelength_nm: design.wavelength_nm,
        paths_of_an_incidence: paths,
        // A share of independent paths scatters most where it is a half.
        largest_standard_error: 0.5 / (paths as f64).sqrt(),
        diffuse_light: both(|side| shares(side, StackLight::Diffuse, DIFFUSE)),
        over_angle: both(angles),
        normal_incidence: both(normal),
    }
}

fn both<T>(of: impl Fn(Side) -> T) -> BothSides<T> {
    BothSides { from_below: of(Side::Inner), from_above: of(Side::Outer) }
}

fn estimate(of: tracer::Estimate) -> Estimate {
    Estimate::new(of.value, of.standard_error)
}

fn text_of(shares: &StackShares) -> String {
    let of = |e: &Estimate| format_value_with_error(100.0 * e.value, 100.0 * e.standard_error);
    let StackShares { transmittance, reflectance, absorptance } = shares;
    format!(
        "{} % pass, {} % come back, {} % are absorbed",
        of(transmittance),
        of(reflectance),
        of(absorptance)
    )
}
