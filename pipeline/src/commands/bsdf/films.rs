// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing bsdf --films`: the whole film stack of a design as a scattering file, with what it sends
//! back and lets through of diffuse light.

use anyhow::{Context, Result, bail};
use bsdf::Side;
use serde_json::{Value, json};
use tracer::{Estimate, StackShares};

use formats::tables::{self, CellTable};
use formats::{Holds, Writes, window, words};
use metrics::digits::{format_value_with_error, shortest};
use runtime::run_context::RunContext;
use simulate::{film_surface, scene_check};

use super::BsdfArgs;
use crate::commands::outputs::writable;

/// Rays by which the shares of diffuse light are found, from each side.
const DIFFUSE: u64 = 1 << 18;

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
    let written = write(&cells, &path).with_context(|| path.display().to_string())?;

    let shares = Side::BOTH.map(|side| surface.shares(side, DIFFUSE));
    let paths = each * samples;
    // A share of independent paths scatters most where it is a half.
    let error = 0.5 / (paths as f64).sqrt();
    let [below, above] = shares.each_ref().map(json_of);
    let files: Vec<Value> = written.iter().map(tables::describe).collect();
    let json = json!({
        "design": design.name,
        "wavelength_nm": design.wavelength_nm,
        "seed": context.seed,
        "paths_of_an_incidence": paths,
        "largest_standard_error": error,
        "diffuse_light": {"from_below": below, "from_above": above},
        "files": files,
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
        for (from, own) in ["below", "above"].into_iter().zip(&shares) {
            lines.push(format!("  diffuse light from {from}: {}", text_of(own)));
        }
        let wavelength = shortest(design.wavelength_nm);
        lines.push(format!("  at {wavelength} nm, without regard to where light leaves"));
        lines.join("\n")
    })
}

fn json_of(shares: &StackShares) -> Value {
    let of = |e: &Estimate| json!({"value": e.value, "standard_error": e.standard_error});
    json!({
        "transmittance": of(&shares.transmitted),
        "reflectance": of(&shares.reflected),
        "absorptance": of(&shares.absorbed),
    })
}

fn text_of(shares: &StackShares) -> String {
    let of = |e: &Estimate| format_value_with_error(100.0 * e.value, 100.0 * e.standard_error);
    let StackShares { reflected, transmitted, absorbed } = shares;
    format!(
        "{} % pass, {} % come back, {} % are absorbed",
        of(transmitted),
        of(reflected),
        of(absorbed)
    )
}
