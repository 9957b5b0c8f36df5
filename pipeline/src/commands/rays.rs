// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing rays`: traced paths through one package, as a cross-section and as JSON.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use serde_json::json;

use design::Design;
use metrics::plural::count;
use report::path_picture::path_picture;
use report::plots::Heading;
use results::ray_paths::PathEnd;
use runtime::atomic_file;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::package_drawing::package_drawing;
use simulate::paths::{by_light, paths};
use simulate::scene_check;
use simulate::tables::tables;

use super::arguments::{ModelChoice, cache, whole};
use super::outputs::writable;

/// `batwing rays`.
#[derive(Debug, Args)]
pub struct RaysArgs {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Model of the dome's surface; not `all`
    #[arg(long, value_enum, default_value = "geometric")]
    pub model: ModelChoice,
    /// Paths to trace
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole(1..=100_000_u64))]
    pub count: u64,
    /// Directory for the picture and the paths
    #[arg(long, value_name = "DIR", default_value = "rays")]
    pub out: PathBuf,
    /// Directory that keeps tables of the hybrid model [default: .batwing-cache beside DIR]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// Traces the paths and writes them.
pub fn run(arguments: &RaysArgs, context: RunContext) -> Result<()> {
    let design = scene_check::load(&arguments.design)?;
    let model = arguments.model.one();
    let model = model.context("--model: expected one model, got `all`")?;
    let model = model.available(&design)?;
    writable(&arguments.out)?;
    if design.converts() {
        context.console.warn(&format!(
            "{}: paths are those of the light of the sources, and end where a medium converts it",
            design.provenance.file
        ));
    }
    let cache = (model == Model::Hybrid).then(|| cache(arguments.cache.as_deref(), &arguments.out));
    let skin_of = |design: &Design| {
        let tables = match &cache {
            Some(cache) => Some(tables(&[design], Some(cache), None, context)?.remove(0)),
            None => None,
        };
        dome_surface(design, model, tables.as_ref())
    };
    // One design for each light and wavelength, with its share of the paths; all have one meridian.
    let parts = match design.colours() {
        None => vec![(design.clone(), arguments.count)],
        Some(lights) => by_light(&design, &lights, arguments.count)?,
    };
    let (mut found, mut meridian) = (Vec::new(), None);
    for (place, (lit, count)) in parts.iter().enumerate() {
        let surface = skin_of(lit)?;
        let seed = context.seed.wrapping_add(place as u64);
        let mut paths = paths(lit, &surface, *count, seed)?;
        if lit.lit.is_some() {
            for path in &mut paths {
                path.power_w = 1.0 / arguments.count as f64;
                path.wavelength_nm = Some(lit.wavelength_nm);
            }
        }
        found.extend(paths);
        meridian.get_or_insert_with(|| surface.meridian().clone());
    }
    let meridian = meridian.context("expected at least one path")?;
    context.interrupt.check()?;

    let stem = format!("{}-{}-rays", design.name, model.key(&design));
    let heading = Heading::new(
        "Paths in the plane y = 0",
        format!("{}, {}, {}", design.name, model.label(&design), count(found.len(), "path")),
    );
    let drawing = package_drawing(&design, &meridian);
    let picture = path_picture(&drawing, &heading, &found);
    let mut fates = serde_json::Map::new();
    for end in PathEnd::ALL {
        let count = found.iter().filter(|path| path.fate == end).count();
        let key = serde_json::to_value(end)?;
        fates.insert(key.as_str().unwrap_or_default().to_owned(), count.into());
    }
    let mut wavelengths: Vec<f64> = found.iter().filter_map(|path| path.wavelength_nm).collect();
    wavelengths.dedup();
    let wavelength =
        if wavelengths.is_empty() { json!(design.wavelength_nm) } else { json!(wavelengths) };
    let summary = json!({
        "design": design.name,
        "model": model.key(&design),
        "seed": context.seed,
        "wavelength_nm": wavelength,
        "plane": "y = 0",
        "fates": fates,
    });
    let mut whole = summary.clone();
    whole["paths"] = serde_json::to_value(&found)?;
    let path = |ending: &str| arguments.out.join(format!("{stem}{ending}"));
    atomic_file::write_bytes(&path(".svg"), picture.svg().as_bytes())?;
    let text = serde_json::to_string(&whole)? + "\n";
    atomic_file::write_bytes(&path(".json"), text.as_bytes())?;
    context.console.result(&summary, || {
        let counts = PathEnd::ALL.into_iter().filter_map(|end| {
            let count = found.iter().filter(|path| path.fate == end).count();
            (count > 0).then(|| format!("{count} {}\n", end.words()))
        });
        format!(
            "{}written to {}",
            counts.collect::<String>(),
            arguments.out.join(stem.clone() + ".*").display()
        )
    })
}
