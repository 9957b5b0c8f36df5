// SPDX-License-Identifier: MIT OR Apache-2.0
//! The choice between orders and boundary integrals, and directions by the latter.
//!
//! Boundary integrals solve one surface between the half-spaces, lit in the plane across the grooves.
//! With a tolerance they come first where orders make stairs of slanted walls, which converge as slowly
//! as 1/N in TM whatever is done, and else where orders miss it.

use rcwa::accuracy::{NOTHING_KNOWN, Structure};
use rcwa::hemisphere::Interface;
use rcwa::lines::{Direction, DirectionOrders, SolvedDirections};
use rcwa::{Pol, Progress, Side};

use crate::boundary_integral::{Converged, Grating};

/// Components of a wavevector, in k0, and sines of an azimuth up to this are none: rounding of angles.
const NONE: f64 = 1e-9;

/// Error and answer of the method that reaches the tolerance, or else the better of both;
/// `integrals` gives none of what it cannot solve.
///
/// # Errors
/// Those of `orders`, where there is no other answer.
pub fn choose<A, E>(
    interface: &Interface,
    tolerance: f64,
    integrals: impl Fn() -> Option<(f64, A)>,
    orders: impl FnOnce() -> Result<(f64, A), E>,
) -> Result<(f64, A), E> {
    let is_first = Structure::Relief(interface).is_of_stairs();
    let first = match is_first.then(&integrals).flatten() {
        Some(found) if found.0 <= tolerance => return Ok(found),
        first => first,
    };
    let found = orders();
    let error = found.as_ref().map_or(f64::INFINITY, |found| found.0);
    if error <= tolerance {
        return found;
    }
    match if is_first { first } else { integrals() } {
        Some(other) if other.0 < error => Ok(other),
        _ => found,
    }
}

/// Solution of directions by boundary integrals: nodes on a period at most, and the largest error;
/// `None` where they cannot solve them.
pub fn directions_by_integrals(
    interface: &Interface,
    (side, directions): (Side, &[Direction]),
    tolerance: f64,
    progress: &Progress<'_>,
) -> Option<(SolvedDirections, usize, f64)> {
    let is_across =
        |d: &Direction| d.ky.abs() <= NONE && (d.kx.abs() > NONE || d.azimuth.sin().abs() <= NONE);
    if !directions.iter().all(is_across) {
        return None;
    }
    let (n_top, n_bottom) = (interface.n_top, interface.n_bottom);
    let grating =
        Grating::of_relief(&interface.relief, interface.wavelength, n_top, n_bottom).ok()?;
    let mut all = SolvedDirections { orders: Vec::new(), balance: 0.0, problems: 0 };
    let (mut nodes, mut largest) = (0, 0.0);
    for direction in directions {
        let found = grating.converge(direction.kx, tolerance, progress).ok()?;
        let Converged { solution, error } = found;
        let efficiencies = Side::BOTH.into_iter().flat_map(|to| {
            let share = |order, pol| solution.efficiency((side, 0, pol), (to, order));
            let parts = move |order| [[share(order, Pol::S), 0.0], [0.0, share(order, Pol::P)]];
            let orders = solution.orders(to).iter().map(|o| o.order);
            orders.map(|order| (to, order, parts(order))).collect::<Vec<_>>()
        });
        all.orders
            .push(DirectionOrders { efficiencies: efficiencies.collect(), jones: Vec::new() });
        all.balance = f64::max(all.balance, solution.worst_balance());
        all.problems += 1;
        nodes = nodes.max(solution.nodes());
        largest = f64::max(largest, error);
    }
    (largest < NOTHING_KNOWN).then_some((all, nodes, largest))
}

/// Why a tolerance was not reached with so many nodes.
pub fn missed(tolerance: f64, nodes: usize, error: f64) -> Option<String> {
    (error > tolerance).then(|| {
        format!(
            "tolerance: {tolerance:e} was not reached with {nodes} nodes on the surface; reached: an error of {error:.1e}"
        )
    })
}
