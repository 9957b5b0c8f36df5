// SPDX-License-Identifier: MIT OR Apache-2.0
//! The package in words and as a section with rays, total efficiency and uniformity; and what the
//! page's 3-D view shows of a model.

use anyhow::Result;
use metrics::figures::{FLUX_UP, UNIFORMITY};
use serde_json::{Value, json};

use arrays::exr;
use metrics::plural::count;
use metrics::quantity::Unit;
use results::package::PackageFile;
use results::shown;

use super::models::{Contents, Model};
use super::pictures::Album;
use super::scene_3d::{FarFieldBins, scene};
use super::tables::{percent, thousands};
use crate::html::folder::Folder;
use crate::path_picture::compact_picture;
use crate::plots::Heading;

/// Paths of all models together that the page holds.
const MAX_PATHS: usize = 9_000;
/// Paths of a section on the first screen.
pub(super) const FEW: usize = 24;

impl Album {
    /// A section with rays for each model that has paths.
    pub fn sections(&mut self, of: Contents) -> Vec<Value> {
        let mut all = Vec::new();
        for (i, (model, package)) in of.models.iter().zip(of.packages).enumerate() {
            let Some(package) = package else {
                continue;
            };
            let paths = &package.section_paths[..package.section_paths.len().min(FEW)];
            let title = format!("{}, {}", model.design, model.label());
            let subtitle = format!("plane y = 0, {}", count(paths.len(), "path"));
            let heading = Heading::new(&title, &subtitle);
            let picture = compact_picture(&package.drawing, &heading, paths, &[]);
            let caption = format!(
                "{title}: section of the package nearest to the middle with {}; it alone shines.",
                count(paths.len(), "path")
            );
            let shown = all.is_empty();
            all.push(self.add(&picture, &caption, &json!({"model": i.to_string()}), shown));
        }
        all
    }
}

/// Packages in words, models, total efficiency and uniformity, design by design.
pub fn overview(of: Contents) -> Vec<Value> {
    let all: Vec<(&Model, &Option<PackageFile>)> = of.models.iter().zip(of.packages).collect();
    let of_design = |design: &[(&Model, &Option<PackageFile>)]| {
        let words = design.iter().find_map(|(_, package)| package.as_ref());
        let row = |(model, _): &(&Model, &Option<PackageFile>)| {
            let ledger = &model.entry.power_ledger;
            let flux = model.entry.figure(FLUX_UP.key);
            let uniformity = model.entry.figures.get(UNIFORMITY.key);
            json!({
                "flux": flux.map(|(flux, unit)| shown::text(&flux, unit)),
                "model": model.label(),
                "paths": thousands(model.entry.paths),
                "efficiency": percent(ledger.account("escaped_up")),
                "uniformity": uniformity.map(|entry| shown::number(entry, Unit::Fraction)),
            })
        };
        let has = |key: &str| design.iter().any(|(model, _)| model.entry.figure(key).is_some());
        json!({
            "design": design[0].0.design,
            "simulated": words.map_or(&[][..], |package| &package.simulated),
            "has_flux": has(FLUX_UP.key),
            "has_uniformity": has(UNIFORMITY.key),
            "rows": design.iter().map(row).collect::<Vec<_>>(),
        })
    };
    let designs = all.chunk_by(|a, b| a.0.design == b.0.design);
    designs.map(of_design).collect()
}

/// The scene of a model for the 3-D view; null of results without paths.
///
/// # Errors
/// A far field that cannot be read.
pub fn view_3d(
    model: &Model,
    package: Option<&PackageFile>,
    folder: &Folder,
    models: usize,
) -> Result<Value> {
    let Some(PackageFile { drawing, paths_3d, .. }) = package else {
        return Ok(Value::Null);
    };
    let contents = exr::read_map(&model.file(folder, "far_field.exr")?)?;
    let far_field = FarFieldBins {
        azimuths: contents.description.columns.edges.len() - 1,
        value: contents.value.iter().copied().map(f64::from).collect(),
        standard_error: contents.standard_error.iter().copied().map(f64::from).collect(),
    };
    Ok(scene(drawing, paths_3d, &far_field, model.key, MAX_PATHS / models.max(1)))
}
