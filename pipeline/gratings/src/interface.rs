// SPDX-License-Identifier: MIT OR Apache-2.0
//! From the cell of a ring to the solver, and from its efficiencies to the rows of a table of orders. The
//! hand-over is plain data: the solver's top half-space is the table's inner side.

use anyhow::Result;
use bsdf::{EfficiencyRow, Grid, NodeId, OrderEfficiency, Polarisation};
use geometry::Cell;
use num_complex::Complex64;
use rcwa::hemisphere::{Directions, Interface};
use rcwa::relief::{Polygon, Relief};

/// The solver's view of `cell` at `wavelength_um`: silicone on top, air below.
pub fn interface(cell: &Cell, wavelength_um: f64) -> Result<Interface> {
    let real = |n: f64| Complex64::new(n, 0.0);
    let relief = vec![Polygon { index: real(cell.inner_index), points: cell.points_um.clone() }];
    Ok(Interface {
        relief: Relief::new(cell.period_um, cell.depth_um, real(cell.background_index), relief)?,
        wavelength: wavelength_um,
        n_top: real(cell.inner_index),
        n_bottom: real(cell.background_index),
    })
}

/// The incident directions of the nodes of `grid`.
pub fn directions(grid: &Grid) -> Directions {
    Directions { kx_per_zone: grid.kx_per_zone, ky: grid.ky.clone() }
}

/// Rows of a table of orders, one for each incident wave of a hemisphere.
pub fn efficiency_rows(
    incidences: Vec<rcwa::hemisphere::Incidence>,
) -> impl Iterator<Item = EfficiencyRow> {
    incidences.into_iter().map(|i| EfficiencyRow {
        node: NodeId { side: side(i.side), kx_index: i.kx_index, ky_index: i.ky_index },
        polarisation: match i.pol {
            rcwa::Pol::S => Polarisation::S,
            rcwa::Pol::P => Polarisation::P,
        },
        orders: i
            .efficiencies
            .into_iter()
            .map(|(to, order, share)| OrderEfficiency::new(side(to), order, share))
            .collect(),
    })
}

/// The dome's frame: top is the silicone, inner; bottom is air, outer.
pub fn side(side: rcwa::Side) -> bsdf::Side {
    match side {
        rcwa::Side::Top => bsdf::Side::Inner,
        rcwa::Side::Bottom => bsdf::Side::Outer,
    }
}
