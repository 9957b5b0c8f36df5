// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the tables of a design's rings need: rings that divide the elements, and orders that solver
//! and table can hold.

use rcwa::Truncation;

use geometry::{BaseSurface, Cell, GeometryError, Meridian, ring_cell};
use metrics::digits::shortest;

use super::elements;
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::Design;
use crate::resolved::incidence_grid::{USUAL_KY, grid};
use crate::schema::{Polarization, TableContent};
use metrics::kinds::Carrying;

/// Most rings: narrower ones than a tenth of a micrometre are no relief for light.
const MAX_RINGS: f64 = 10_000.0;

/// Orders beyond which a ring is too wide for a table that is refused.
const FEW_ORDERS: f64 = 10.0;

/// Checks `[hybrid]` of a design with relief on `base`.
pub(crate) fn check(
    design: &Design,
    base: BaseSurface<'_>,
    at: &Context,
) -> Result<(), ConfigError> {
    let (elements, width) = (&design.elements, design.hybrid.element_width_um);
    let refuse = |expected: String| at.value("hybrid.element_width_um", width, &expected);
    let count = elements.width_mm * elements.shapes.len() as f64 / (width * 1e-3);
    if count > MAX_RINGS {
        return Err(refuse(format!("a width that makes at most {MAX_RINGS} rings")));
    }
    let rings = elements.refined(width * 1e-3).ok_or_else(|| {
        refuse(format!("a width that divides elements.width_um = {}", elements.width_mm * 1e3))
    })?;
    if !rings.shapes.len().is_multiple_of(design.hybrid.rings_per_band) {
        return Err(at.value(
            "hybrid.rings_per_band",
            design.hybrid.rings_per_band,
            &format!("a divisor of the {} rings", rings.shapes.len()),
        ));
    }
    let refused = |e: GeometryError| elements::refused(&e, "hybrid.element_width_um", at);
    Meridian::stepped(base, &rings).map_err(refused)?;
    let cells = (1..=rings.shapes.len())
        .filter_map(|ring| ring_cell(base, &rings, ring, design.silicone.index).transpose());
    let cells: Vec<Cell> = cells.collect::<Result<_, _>>().map_err(refused)?;
    grids(design, &cells, at)?;
    matrices(design, at)?;
    let h = &design.hybrid;
    let solved = |cell: &&Cell| cell.ring % h.rings_per_band == h.representative % h.rings_per_band;
    orders(design, cells.iter().filter(solved), at)
}

/// Checks that matrices meet light that carries its polarisation.
fn matrices(design: &Design, at: &Context) -> Result<(), ConfigError> {
    let h = &design.hybrid;
    if h.tables != TableContent::Matrices {
        return Ok(());
    }
    let others = [
        (design.polarization == Carrying::Carried, "light.polarization = \"carried\""),
        (h.polarization == Polarization::Unpolarised, "hybrid.polarization = \"unpolarised\""),
    ];
    match others.into_iter().find(|(holds, _)| !holds) {
        Some((_, needed)) => {
            Err(at.value("hybrid.tables", "\"matrices\"", &format!("\"shares\" without {needed}")))
        }
        None => Ok(()),
    }
}

/// True if there can be tables of these cells, one for each band that is solved.
///
/// # Errors
/// More orders than can be solved, fewer than propagate, or a grid that holds no node.
pub fn fit(design: &Design, cells: &[Cell]) -> Result<(), ConfigError> {
    let at = Context::new(&design.provenance.file);
    grids(design, cells, &at)?;
    orders(design, cells.iter(), &at)
}

/// Highest order that propagates on either side of `cell`, whatever the direction.
fn propagating(design: &Design, cell: &Cell) -> f64 {
    let waves = cell.inner_index.max(cell.background_index) * cell.period_um
        / (design.wavelength_nm * 1e-3);
    (waves + 0.5).floor()
}

/// The widest and the narrowest ring must have a table that can be solved and kept.
fn grids(design: &Design, cells: &[Cell], at: &Context) -> Result<(), ConfigError> {
    let by_period = |a: &&Cell, b: &&Cell| a.period_um.total_cmp(&b.period_um);
    let ends = [cells.iter().max_by(by_period), cells.iter().min_by(by_period)];
    for cell in ends.into_iter().flatten() {
        // The search for orders begins a little above what propagates.
        let highest = propagating(design, cell);
        let most = (Truncation::MAX as f64 - 5.0) / (1.0 + 1.0 / 16.0);
        let valid = grid(design, cell, USUAL_KY).validate();
        let wide = match &valid {
            _ if highest > most => format!("at most {most:.0} orders"),
            Err(bsdf::Error::Grid(error)) if highest > FEW_ORDERS => {
                format!("fewer orders for a table ({error})")
            }
            _ => String::new(),
        };
        if !wide.is_empty() {
            let expected = format!(
                "rings narrow enough for waves: {wide} on either side at {} = {}, not {highest} at \
                 ring {}, {} µm wide",
                design.light_key(),
                design.wavelength_nm,
                cell.ring,
                shortest(cell.period_um)
            );
            let width = design.hybrid.element_width_um;
            return Err(at.value("hybrid.element_width_um", width, &expected));
        }
        valid.map_err(|error| {
            let expected =
                format!("a wavelength for which ring {} has a table ({error})", cell.ring);
            at.value(design.light_key(), design.wavelength_nm, &expected)
        })?;
    }
    Ok(())
}

/// `hybrid.orders` must hold what propagates on either side of the widest of the cells that are
/// solved, and be no more than can be solved.
fn orders<'a>(
    design: &Design,
    solved: impl Iterator<Item = &'a Cell>,
    at: &Context,
) -> Result<(), ConfigError> {
    let Some(orders) = design.hybrid.orders else {
        return Ok(());
    };
    let Some(cell) = solved.max_by(|a, b| a.period_um.total_cmp(&b.period_um)) else {
        return Ok(());
    };
    let propagating = propagating(design, cell);
    if (orders as f64) < propagating {
        let expected = format!(
            "at least {propagating}, the highest order that propagates at ring {}",
            cell.ring
        );
        return Err(at.value("hybrid.orders", orders, &expected));
    }
    at.count("hybrid.orders", orders, 0, Truncation::MAX)?;
    Ok(())
}
