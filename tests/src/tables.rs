// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of diffraction orders from a relief between two media, by the libraries alone.

use anyhow::Result;
use bsdf::{EfficiencyRow, Grid, NodeId, OrderEfficiency, OrderTable, Polarisation, TableHeader};
use num_complex::Complex64;
use rcwa::hemisphere::{Directions, Interface, Resolution, hemisphere};
use rcwa::no_progress;
use rcwa::relief::Relief;
use rcwa::{Bloch, Pol, Scattering, Side, Truncation};

/// Index of silicone.
pub const SILICONE: f64 = 1.41;
/// Vacuum wavelength, µm.
pub const WAVELENGTH_UM: f64 = 0.55;

/// `relief` (µm) between silicone on top and air below.
pub fn on_silicone(relief: Relief) -> Interface {
    Interface {
        relief,
        wavelength: WAVELENGTH_UM,
        n_top: Complex64::new(SILICONE, 0.0),
        n_bottom: Complex64::new(1.0, 0.0),
    }
}

/// A resolution that keeps `more` orders beyond those that propagate; exact for a relief without
/// slanted sides.
///
/// # Errors
/// Those of the solver's truncation.
pub fn resolution(interface: &Interface, more: usize, slices: usize) -> Result<Resolution> {
    Ok(Resolution {
        truncation: Truncation::new(interface.highest_order() + more)?,
        plan: interface.relief.slice_plan(slices),
    })
}

/// The table of `interface` over both hemispheres.
///
/// # Errors
/// Those of solver and table.
pub fn order_table(
    interface: &Interface,
    kx_per_zone: usize,
    ky: Vec<f64>,
    resolution: &Resolution,
) -> Result<OrderTable> {
    let directions = Directions { kx_per_zone, ky: ky.clone() };
    let solved = hemisphere(interface, &directions, resolution, &no_progress)?;
    let grid = Grid {
        period: interface.relief.period(),
        wavelength: interface.wavelength,
        index_inner: interface.n_top.re,
        index_outer: interface.n_bottom.re,
        kx_per_zone,
        ky,
    };
    let header = TableHeader {
        length_unit: "um".to_owned(),
        truncation: resolution.truncation.highest(),
        slices: resolution.plan.count(),
        energy_residual: solved.worst_balance,
        ..TableHeader::default()
    };
    let rows = solved.incidences.into_iter().map(|i| EfficiencyRow {
        node: NodeId { side: scatter_side(i.side), kx_index: i.kx_index, ky_index: i.ky_index },
        polarisation: if i.pol == Pol::S { Polarisation::S } else { Polarisation::P },
        orders: i
            .efficiencies
            .into_iter()
            .map(|(to, order, share)| OrderEfficiency::new(scatter_side(to), order, share))
            .collect(),
    });
    Ok(OrderTable::build(header, grid, rows)?)
}

/// The lossless table of a smooth surface of silicone: Fresnel's formulas in order 0, on the grid
/// of a grating of `period_um`.
///
/// # Panics
/// If there is no such grid.
pub fn smooth(period_um: f64, kx_per_zone: usize, ky: Vec<f64>) -> OrderTable {
    let grid = Grid {
        period: period_um,
        wavelength: WAVELENGTH_UM,
        index_inner: SILICONE,
        index_outer: 1.0,
        kx_per_zone,
        ky,
    };
    let rows: Vec<_> = grid
        .rows(|side, kx, ky, polarisation| {
            let (n1, n2) = (grid.index(side), grid.index(side.opposite()));
            let cos = (1.0 - (kx * kx + ky * ky) / (n1 * n1)).max(0.0).sqrt();
            let r = bsdf::analytic::fresnel(n1, n2, cos).for_polarisation(polarisation);
            let mut orders = vec![OrderEfficiency::new(side, 0, r)];
            if r < 1.0 {
                orders.push(OrderEfficiency::new(side.opposite(), 0, 1.0 - r));
            }
            orders
        })
        .collect();
    let header = TableHeader { length_unit: "um".to_owned(), ..TableHeader::default() };
    OrderTable::build(header, grid, rows).expect("a valid table")
}

/// The solver's top is the inner side of a surface.
pub fn scatter_side(side: Side) -> bsdf::Side {
    match side {
        Side::Top => bsdf::Side::Inner,
        Side::Bottom => bsdf::Side::Outer,
    }
}

/// The other way round.
pub fn solver_side(side: bsdf::Side) -> Side {
    match side {
        bsdf::Side::Inner => Side::Top,
        bsdf::Side::Outer => Side::Bottom,
    }
}

/// Where the light of one incident wave goes: side, order relative to its own, share.
pub type Shares = Vec<(Side, i32, f64)>;

/// Shares of s and of p light that comes from `side` with wavevector (`kx`, `ky`), solved for
/// itself at `resolution`, as the table is.
///
/// # Errors
/// Those of the solver.
pub fn direct(
    interface: &Interface,
    side: Side,
    (kx, ky): (f64, f64),
    resolution: &Resolution,
) -> Result<[Shares; 2]> {
    let read = |stack| -> Result<[Shares; 2]> {
        let solved = rcwa::solve(stack, Bloch::new(kx, ky), resolution.truncation)?;
        Ok(Pol::BOTH.map(|pol| shares(&solved, side, pol)))
    };
    let (stack, finer) = interface.stacks(resolution)?;
    let mut coarse = read(&stack)?;
    if let Some(finer) = finer {
        let fine = read(&finer)?;
        for (c, f) in coarse.iter_mut().flatten().zip(fine.iter().flatten()) {
            c.2 = (16.0 * f.2 - 9.0 * c.2) / 7.0;
        }
    }
    Ok(coarse)
}

fn shares(solved: &Scattering, side: Side, pol: Pol) -> Shares {
    let both = [Side::Top, Side::Bottom];
    both.into_iter()
        .flat_map(|to| solved.orders(to).map(move |m| (to, m)))
        .map(|(to, m)| (to, m, solved.efficiency((side, 0, pol), (to, m))))
        .collect()
}
