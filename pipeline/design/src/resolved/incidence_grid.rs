// SPDX-License-Identifier: MIT OR Apache-2.0
//! Grids of incidence of the tables of a design's rings.

use bsdf::Grid;

use geometry::Cell;

use super::Design;

/// Nodes of ky with which a grid chosen by error begins, at least and at most.
const FIRST_KY: [usize; 2] = [12, 24];

/// Nodes of ky that it comes to, about.
pub(crate) const USUAL_KY: usize = 40;

/// Most nodes of ky that it may come to.
pub const MAX_KY: usize = 400;

/// Nodes of kx in a Brillouin zone where they are not stated, to begin with.
pub const FIRST_KX: usize = 2;

/// Most nodes of kx in a Brillouin zone.
pub const MAX_KX: usize = 64;

/// Nodes of ky with which a grid chosen by error begins at a tolerance: with the middles between
/// them mostly enough, so that the modes of a line are found once.
pub fn first_ky(tolerance: f64) -> usize {
    let [least, most] = FIRST_KY;
    let usual = least as f64 * (2e-3 / tolerance).powf(0.9);
    (usual.round() as usize).clamp(least, most)
}

/// The grid of incidence of `cell`'s table, or what it begins with: `ky` nodes along ky where the
/// design does not state their number.
pub fn grid(design: &Design, cell: &Cell, ky: usize) -> Grid {
    let h = &design.hybrid;
    Grid {
        period: cell.period_um,
        wavelength: design.wavelength_nm * 1e-3,
        index_inner: cell.inner_index,
        index_outer: cell.background_index,
        kx_per_zone: h.kx_per_zone.unwrap_or(FIRST_KX),
        ky: Grid::ky_nodes(cell.inner_index, cell.background_index, h.ky_count.unwrap_or(ky)),
    }
}
