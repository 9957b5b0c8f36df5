// SPDX-License-Identifier: MIT OR Apache-2.0
//! Differences between RCWA and boundary integrals on one surface, order by order.
//!
//! In: a relief of silicone in air, a Bloch wavevector, a resolution of the RCWA. Out: the largest
//! differences over all incident waves of the wavevector, from both sides, for each polarisation.

use anyhow::Result;
use rcwa::accuracy::{hemisphere_change, largest_change};
use rcwa::hemisphere::{Interface, Resolution};
use rcwa::{Bloch, Pol, Scattering, Side};

use gratings::interface::interface;
use simulate::cells::band_cells;

use crate::tables::WAVELENGTH_UM;
use crate::traces::design;
use gratings::boundary_integral::{Fineness, Grating, Solution};

/// Designs and bands (from 1) compared: shallow, middling and steep OS1, and OS2.
pub const RINGS: [(&str, usize); 4] =
    [("d1.toml", 1), ("d1.toml", 8), ("d1.toml", 17), ("d2.toml", 3)];
/// Bloch wavevector, near normal incidence; the other waves lie λ/Λ apart up to grazing incidence.
pub const KX0: f64 = 0.0123;

const SIDES: [Side; 2] = [Side::Top, Side::Bottom];

/// Largest differences in one polarisation.
#[derive(Debug, Clone, Copy, Default)]
pub struct Difference {
    /// Of the efficiency of any order.
    pub order: f64,
    /// Of the same, root mean square over all pairs of orders.
    pub mean_square: f64,
    /// Of what passes to the other side, all orders together.
    pub transmitted: f64,
    /// The same in the distance in which tables are asked for ([`hemisphere_change`]).
    pub of_tables: f64,
}

/// The relief of a ring that stands for a band of a design's hybrid model, from 1.
///
/// # Errors
/// No such band, or a relief that the solver refuses.
pub fn ring(file: &str, band: usize) -> Result<(usize, Interface)> {
    let cells = band_cells(&design(file));
    let cell = cells.into_iter().nth(band - 1).flatten();
    let cell = cell.ok_or_else(|| anyhow::anyhow!("{file} has no relief in band {band}"))?;
    Ok((cell.ring, interface(&cell, WAVELENGTH_UM)?))
}

/// The integral equations at one Bloch wavevector, and how far their efficiencies move with 1.5
/// times as many nodes.
///
/// # Errors
/// Those of the solver.
pub fn by_integrals(interface: &Interface, kx0: f64) -> Result<(Solution, f64)> {
    let (top, bottom) = (interface.n_top.re, interface.n_bottom.re);
    let grating = Grating::of_relief(&interface.relief, interface.wavelength, top, bottom)?;
    Ok(grating.solve_twice(kx0, Fineness::default())?)
}

/// The RCWA at one Bloch wavevector, as tables are computed: following slanted sides.
///
/// # Errors
/// Those of the solver.
pub fn by_rcwa(interface: &Interface, kx0: f64, resolution: &Resolution) -> Result<Scattering> {
    let (stack, other) = interface.stacks(resolution)?;
    anyhow::ensure!(other.is_none(), "expected a relief whose sides are followed");
    Ok(rcwa::solve(&stack, Bloch::new(kx0, 0.0), resolution.truncation)?)
}

/// How far the RCWA is from the integral equations.
pub fn difference(exact: &Solution, approximate: &Scattering, pol: Pol) -> Difference {
    let mut worst = Difference::default();
    let (mut squares, mut pairs) = (0.0, 0.0);
    let mut through = Vec::new();
    for side in SIDES {
        for from in exact.orders(side).iter().map(|o| (side, o.order, pol)) {
            for to_side in SIDES {
                let mut sum = 0.0;
                for to in exact.orders(to_side).iter().map(|o| (to_side, o.order)) {
                    let difference = approximate.efficiency(from, to) - exact.efficiency(from, to);
                    worst.order = worst.order.max(difference.abs());
                    squares += difference * difference;
                    pairs += 1.0;
                    sum += difference;
                }
                if to_side != side {
                    through.push(sum);
                }
            }
        }
    }
    let none = vec![0.0; through.len()];
    worst.transmitted = largest_change(&through, &none);
    worst.of_tables = hemisphere_change(&through, &none);
    worst.mean_square = f64::sqrt(squares / pairs);
    worst
}
