// SPDX-License-Identifier: MIT OR Apache-2.0
//! The answer of the integral equations: shares of all orders for light by every order.

use faer::Mat;
use num_complex::Complex64;
use rcwa::{Pol, Side};

/// An order that carries power away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// Its number m.
    pub order: i32,
    /// kx0 + m λ/Λ, in units of k0.
    pub kx: f64,
    /// sqrt(n² - kx²), in units of k0; above 0 without loss.
    pub kz: Complex64,
}

/// All efficiencies at one Bloch wavevector.
#[derive(Clone, Debug)]
pub struct Solution {
    orders: [Vec<Order>; 2],
    /// Number of the first incident wave from either side, and of all.
    first: [usize; 3],
    /// [polarisation](to, from), orders of the top first; light comes from media without loss.
    efficiencies: [Mat<f64>; 2],
    worst_balance: f64,
    nodes: usize,
}

impl Solution {
    pub(super) fn new(
        orders: [Vec<Order>; 2],
        sources: [usize; 2],
        efficiencies: [Mat<f64>; 2],
        worst_balance: f64,
        nodes: usize,
    ) -> Self {
        let first = [0, sources[0], sources[0] + sources[1]];
        Self { orders, first, efficiencies, worst_balance, nodes }
    }

    /// Orders that carry power into a half-space, ascending: without loss those that propagate, else
    /// those with |kx| below |n|.
    pub fn orders(&self, side: Side) -> &[Order] {
        &self.orders[number(side)]
    }

    /// Nodes on the surface.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Share of the power of the wave that comes in by order `from.1` of side `from.0` which leaves
    /// by `to`, in an absorbing half-space through the plane next to the surface; 0 where `to`
    /// carries none or no light comes by `from`. In the planar mount the polarisation is kept.
    pub fn efficiency(&self, from: (Side, i32, Pol), to: (Side, i32)) -> f64 {
        let place =
            |(side, order): (Side, i32)| self.orders(side).iter().position(|o| o.order == order);
        let (Some(row), Some(column)) = (place(to), place((from.0, from.1))) else {
            return 0.0;
        };
        let row = row + if to.0 == Side::Top { 0 } else { self.orders[0].len() };
        let column = self.first[number(from.0)] + column;
        if column >= self.first[number(from.0) + 1] {
            return 0.0;
        }
        self.efficiencies[usize::from(from.2 == Pol::P)][(row, column)]
    }

    /// Share that leaves on one side, all orders together.
    pub fn total(&self, from: (Side, i32, Pol), to: Side) -> f64 {
        self.orders(to).iter().map(|o| self.efficiency(from, (to, o.order))).sum()
    }

    /// Largest |R + T - 1| of any incident wave; T, if the other half-space absorbs, is the power
    /// through the surface. Nothing in the equations enforces 0: it shows the error.
    pub fn worst_balance(&self) -> f64 {
        self.worst_balance
    }

    /// Largest difference of any efficiency from another solution of the same problem.
    pub(super) fn largest_difference(&self, other: &Self) -> f64 {
        let of = |a: &Mat<f64>, b: &Mat<f64>| {
            (0..a.ncols())
                .flat_map(|j| (0..a.nrows()).map(move |i| (i, j)))
                .map(|at| (a[at] - b[at]).abs())
                .fold(0.0, f64::max)
        };
        self.efficiencies.iter().zip(&other.efficiencies).map(|(a, b)| of(a, b)).fold(0.0, f64::max)
    }
}

/// Place of a side in arrays of both.
pub(super) fn number(side: Side) -> usize {
    match side {
        Side::Top => 0,
        Side::Bottom => 1,
    }
}

/// Orders with |kx| up to `reach` and their kz, outgoing.
pub(super) fn all_orders(n: Complex64, kx0: f64, spacing: f64, reach: f64) -> Vec<Order> {
    let (first, last) =
        (((-reach - kx0) / spacing).floor() as i32, ((reach - kx0) / spacing).ceil() as i32);
    (first..=last)
        .map(|order| {
            let kx = kx0 + f64::from(order) * spacing;
            let root = ((n - kx) * (n + kx)).sqrt();
            Order { order, kx, kz: if root.im < 0.0 { -root } else { root } }
        })
        .collect()
}
