// SPDX-License-Identifier: MIT OR Apache-2.0
//! A scene → what its receivers saw: the Monte Carlo run of one model of one design.

use std::sync::Arc;

use anyhow::{Result, anyhow};
use bsdf::Scatter;
use bsdf::geometric::{Outline, Polygon, UnitCell};
use tracer::{Control, FarField, PlaneMap, Scene, Settings};

use super::model::Model;
use super::observation::{Observation, plane_grid};
use super::scene::{self, Skin};
use super::tables::DesignTables;
use crate::config::resolved::{Design, Dome, Elements};
use crate::geometry::{Cell, Meridian, ring_cell};
use crate::interrupt::{Interrupt, Interrupted};
use crate::progress::Console;

/// Groups of paths, from whose scatter all errors come.
pub(super) const GROUPS: usize = 64;

/// What a trace needs beside the scene.
#[derive(Clone, Copy)]
pub struct Environment<'a> {
    /// Progress and messages.
    pub console: Console,
    /// Ctrl-C.
    pub interrupt: &'a Interrupt,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl<'a> Environment<'a> {
    /// One that says nothing, for programs that call a stage themselves.
    pub fn quiet(interrupt: &'a Interrupt, seed: u64) -> Self {
        let console = Console {
            quiet: true,
            json: false,
        };
        Self {
            console,
            interrupt,
            seed,
        }
    }
}

/// The dome's surface for `model`; `tables` for the hybrid.
pub fn skin(design: &Design, model: Model, tables: Option<&DesignTables>) -> Result<Skin> {
    let Some(dome) = &design.dome else {
        return Ok(Skin::Refracting(Meridian { pieces: Vec::new() }));
    };
    Ok(match model {
        Model::Geometric => Skin::Refracting(Meridian::stepped(dome, &design.elements)?),
        Model::Fine => Skin::Refracting(Meridian::stepped(dome, &design.hybrid_rings())?),
        Model::Control => {
            let cells = band_cells(design);
            let scatter = cells.iter().map(|cell| {
                cell.as_ref()
                    .map(|c| Ok(Arc::new(UnitCell::new(&outline(c))?) as Arc<dyn Scatter>))
                    .transpose()
            });
            banded(design, dome, scatter.collect::<Result<_>>()?)
        }
        Model::Hybrid => {
            let tables =
                tables.ok_or_else(|| anyhow!("the hybrid of {} needs its tables", design.name))?;
            banded(
                design,
                dome,
                tables
                    .bands
                    .iter()
                    .enumerate()
                    .map(|(band, t)| {
                        let solved =
                            || t.as_ref().map(|t| Arc::clone(&t.table) as Arc<dyn Scatter>);
                        design.files.band_scatter(band).or_else(solved)
                    })
                    .collect(),
            )
        }
    })
}

fn banded(design: &Design, dome: &Dome, scatter: Vec<Option<Arc<dyn Scatter>>>) -> Skin {
    let width_mm = design.hybrid.element_width_um * 1e-3 * design.hybrid.rings_per_band as f64;
    let ends: Vec<f64> = (1..=scatter.len()).map(|k| k as f64 * width_mm).collect();
    Skin::Banded(Meridian::banded(dome, &ends), scatter)
}

/// The unit cell of every band's representative ring; `None` where the band is smooth.
pub fn band_cells(design: &Design) -> Vec<Option<Cell>> {
    let Some(dome) = &design.dome else {
        return Vec::new();
    };
    let rings: Elements = design.hybrid_rings();
    (0..rings.shapes.len() / design.hybrid.rings_per_band)
        .map(|band| {
            ring_cell(
                dome,
                &rings,
                band * design.hybrid.rings_per_band + design.hybrid.representative,
                design.silicone.index,
            )
        })
        .collect()
}

/// The cell as the ray-optics control takes it.
pub fn outline(cell: &Cell) -> Outline {
    Outline {
        period: cell.period_um,
        depth: cell.depth_um,
        index_inner: cell.inner_index,
        index_outer: cell.background_index,
        background: cell.background_index,
        polygons: cell
            .polygons
            .iter()
            .map(|p| Polygon {
                index: p.index,
                points: p.points_um.clone(),
            })
            .collect(),
    }
}

/// Traces `paths` paths of `design` with the dome's surface `skin`; `what` is shown beside the progress.
pub fn observe(
    design: &Design,
    skin: &Skin,
    paths: u64,
    what: &str,
    env: Environment,
) -> Result<Observation> {
    env.interrupt.check()?;
    let scene: Scene = scene::build(design, skin)?;
    let grid = plane_grid(design);
    let plane = PlaneMap::centred(
        design.receiver.plane_height_mm,
        grid.bin_mm,
        grid.columns,
        grid.rows,
    )?;
    let far = FarField::new(design.far_field.bin_deg, design.far_field.azimuth_bin_deg)?;
    let settings = Settings {
        groups: GROUPS,
        max_bounces: design.trace.max_interactions,
        ..Settings::new(paths, env.seed)
    };
    let bar = env.console.bar(paths, what);
    let progress = |done: u64| bar.inc(done);
    let control = Control {
        progress: Some(&progress),
        cancel: Some(env.interrupt.flag()),
    };
    let outcome = tracer::run_with(&scene, &[&far, &plane], &settings, control);
    bar.finish_and_clear();
    env.interrupt.check()?;
    let outcome = match outcome {
        Err(tracer::Error::Cancelled) => return Err(Interrupted.into()),
        other => other?,
    };
    Ok(Observation::new(design, &outcome))
}
