// SPDX-License-Identifier: MIT OR Apache-2.0
//! Unit cells of a design's relief: one for each band of rings, or of one ring.

use anyhow::{Result, anyhow, bail, ensure};
use bsdf::ray_optics::{Outline, Polygon};

use design::Design;
use geometry::profile::Elements;
use geometry::{Cell, ring_cell};

use super::scene;

/// The unit cell of every band's representative ring, with the medium around the domes outside;
/// `None` for a smooth band. There are none where the design has no bands.
pub fn band_cells(design: &Design) -> Vec<Option<Cell>> {
    let base = design.base().filter(|_| design.without_bands.is_none());
    let Some(base) = base else {
        return Vec::new();
    };
    // `scene_check` refuses designs whose solids do not fit.
    let around = scene::index_about_domes(design).unwrap_or(1.0);
    let rings: Elements = design.hybrid_rings();
    (0..rings.shapes.len() / design.hybrid.rings_per_band)
        .map(|band| {
            let ring = band * design.hybrid.rings_per_band + design.hybrid.representative;
            // Radii that do not fit leave a design without bands.
            let cell = ring_cell(base, &rings, ring, design.silicone.index).ok()??;
            Some(cell.within(around))
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
        polygons: vec![Polygon { index: cell.inner_index, points: cell.points_um.clone() }],
    }
}

/// The design with every ring a band of its own.
pub fn by_ring(design: &Design) -> Design {
    let mut design = design.clone();
    design.hybrid.rings_per_band = 1;
    design.hybrid.representative = 1;
    design
}

/// Refuses relief without bands: thin layers on the dome, which rings are solved without, and what
/// has no tables.
pub fn has_bands(design: &Design) -> Result<()> {
    let layers = design.films.as_ref().map_or(0, |films| films.dome.layers.len());
    ensure!(
        layers == 0,
        "dome.coating = {layers} layers: expected none; rings are solved without layers, and the models of rays on the relief (`batwing run`) alone know them"
    );
    if let Some(why) = &design.without_bands {
        bail!("{}: {why}", design.provenance.file);
    }
    Ok(())
}

/// The unit cell of ring `ring` (from 1).
///
/// # Errors
/// A ring that the design does not have, or a smooth one; thin layers on the dome.
pub fn ring(design: &Design, ring: usize) -> Result<Cell> {
    has_bands(design)?;
    let cells = band_cells(&by_ring(design));
    let count = cells.len();
    ensure!(count > 0, "the dome is smooth, it has no rings of relief");
    let found = ring.checked_sub(1).and_then(|i| cells.into_iter().nth(i));
    found
        .ok_or_else(|| anyhow!("--ring {ring}: expected a ring from 1 to {count}"))?
        .ok_or_else(|| anyhow!("--ring {ring}: this ring is smooth, it has no relief"))
}
