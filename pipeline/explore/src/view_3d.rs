// SPDX-License-Identifier: MIT OR Apache-2.0
//! A few paths of the present design in three dimensions, for the page's 3-D view.

use anyhow::{Context as _, Result};
use serde_json::{Value, json};

use design::Design;
use metrics::quantity::Map;
use report::html::scene_3d::{FarFieldBins, fates, scene};
use results::package::{PackageDrawing, Paths3d};
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::package_drawing::package_drawing;
use simulate::paths::by_light;
use simulate::paths_3d::{WavelengthScene, traced_paths_3d};
use simulate::tables::DesignTables;

/// Paths that are traced and drawn.
const PATHS: u64 = 200;

/// The package with a few paths.
#[derive(Debug)]
pub struct PackageView {
    drawing: PackageDrawing,
    paths: Paths3d,
    /// The model whose surface they met.
    model: String,
}

impl PackageView {
    /// Traces paths of `design` in `model`. A hybrid without `tables` of one wavelength lends the
    /// bands of its control, which scatter by rays.
    ///
    /// # Errors
    /// Scenes that cannot be built.
    pub fn new(
        design: &Design,
        model: Model,
        tables: Option<&DesignTables>,
        seed: u64,
    ) -> Result<Self> {
        let by_rays = if model == Model::Hybrid { Model::Control } else { model };
        let (model, lit) = match design.colours() {
            Some(lights) => (by_rays, by_light(design, &lights, PATHS)?),
            None if tables.is_some() => (model, vec![(design.clone(), PATHS)]),
            None => (by_rays, vec![(design.clone(), PATHS)]),
        };
        let surfaces = lit.iter().map(|(lit, _)| dome_surface(lit, model, tables));
        let surfaces = surfaces.collect::<Result<Vec<_>>>()?;
        let first = surfaces.first().context("expected light to trace")?;
        let drawing = package_drawing(design, first.meridian());
        let parts: Vec<WavelengthScene> = lit
            .iter()
            .zip(&surfaces)
            .map(|((design, count), surface)| WavelengthScene {
                design,
                surface,
                share: *count as f64 / PATHS as f64,
            })
            .collect();
        let paths = traced_paths_3d(&parts, &drawing.rings, PATHS, seed)?;
        Ok(Self { drawing, paths, model: model.label(design) })
    }

    /// As the page reads it, with the far field in the colour of the model with this key.
    pub fn to_json(&self, far_field: &Map, model_key: &str) -> Value {
        let far_field = FarFieldBins {
            azimuths: far_field.columns().bins(),
            value: far_field.value().to_vec(),
            standard_error: far_field.standard_error().to_vec(),
        };
        let scene = scene(&self.drawing, &self.paths, &far_field, model_key, PATHS as usize);
        json!({"scene": scene, "fates": fates(), "model": self.model})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_has_paths_and_the_hybrid_lends_those_of_its_control() {
        let design = design::embedded("d1.toml").expect("valid");
        for model in Model::all_of(&design) {
            let view = PackageView::new(&design, model, None, 3).expect("traced");
            assert_eq!((view.paths.traced, view.paths.paths.len()), (PATHS, PATHS as usize));
            let by_rays = if model == Model::Hybrid { Model::Control } else { model };
            assert_eq!(view.model, by_rays.label(&design));
        }
    }
}
