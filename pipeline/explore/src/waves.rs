// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of the hybrid band by band: coarse ones first, and rays in the bands that have none yet.

use anyhow::Result;

use arrays::cache::Cache;
use design::Design;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::scene::DomeSurface;
use simulate::tables::{DesignTables, keys, tables};

use crate::frame::WavesState;

/// Tolerance of tables while they are coarse, and their nodes of the wavevector along the grooves;
/// Bloch wavevectors have one node a zone.
const COARSE: f64 = 5e-2;
const COARSE_KY: usize = 10;

/// True where the cache holds every table of `design`.
pub fn are_cached(design: &Design, cache: &Cache) -> bool {
    keys(design).iter().all(|key| cache.holds(key))
}

/// Coarse tables of a design, as far as they are solved.
pub struct CoarseTables {
    design: Design,
    tables: DesignTables,
    /// Bands that still need one, the outermost last.
    missing: Vec<usize>,
    rings: usize,
}

impl CoarseTables {
    /// No table yet; `None` of designs whose tables are not one a band.
    pub fn new(design: &Design) -> Option<Self> {
        if design.converts() || design.all_lights().is_some() {
            return None;
        }
        let mut design = design.clone();
        design.hybrid.tolerance = design.hybrid.tolerance.max(COARSE);
        design.hybrid.kx_per_zone = Some(1);
        let ky = design.hybrid.ky_count;
        design.hybrid.ky_count = Some(ky.map_or(COARSE_KY, |count| count.min(COARSE_KY)));
        let cells = simulate::cells::band_cells(&design);
        let needed = |(band, cell): (usize, &Option<_>)| {
            (cell.is_some() && !design.files.covers(band)).then_some(band)
        };
        let missing: Vec<usize> = cells.iter().enumerate().filter_map(needed).collect();
        let tables = DesignTables { bands: vec![None; cells.len()], others: Vec::new() };
        let rings = missing.len();
        Some(Self { design, tables, missing, rings })
    }

    /// Solves the outermost band that has no table; false where all have one.
    ///
    /// # Errors
    /// Errors of the solver and of the cache; an interrupt.
    pub fn solve_next(&mut self, cache: &Cache, context: RunContext) -> Result<bool> {
        let Some(band) = self.missing.last().copied() else { return Ok(false) };
        let mut solved = tables(&[&self.design], Some(cache), Some(band + 1), context)?.remove(0);
        self.tables.bands[band] = solved.bands[band].take();
        self.missing.pop();
        Ok(true)
    }

    /// The dome, with rays in the bands without a table.
    ///
    /// # Errors
    /// A dome that cannot be built.
    pub fn surface(&self) -> Result<DomeSurface> {
        let waves = dome_surface(&self.design, Model::Hybrid, Some(&self.tables))?;
        let rays = dome_surface(&self.design, Model::Control, None)?;
        Ok(match (waves, rays) {
            (DomeSurface::Banded(meridian, waves), DomeSurface::Banded(_, rays)) => {
                let both = waves.into_iter().zip(rays);
                DomeSurface::Banded(meridian, both.map(|(waves, rays)| waves.or(rays)).collect())
            }
            (waves, _) => waves,
        })
    }

    /// What of the picture is by waves.
    pub fn state(&self) -> WavesState {
        let solved = self.rings - self.missing.len();
        let words = match (solved, self.rings) {
            (0, _) => "all bands still by rays, tables are being solved".to_owned(),
            (solved, rings) if solved < rings => {
                format!(
                    "{solved} of {rings} bands by waves (coarse tables), from the rim inwards; the others still by rays"
                )
            }
            _ => format!(
                "all bands by waves, coarse tables (tolerance {}); those of the design are being solved",
                self.design.hybrid.tolerance
            ),
        };
        WavesState { solved, rings: self.rings, words }
    }
}
