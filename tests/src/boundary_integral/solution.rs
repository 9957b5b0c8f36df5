// SPDX-License-Identifier: MIT OR Apache-2.0
//! The answer of the integral equations: shares of all orders for light by every order.

use faer::Mat;
use num_complex::Complex64;
use rcwa::{Pol, Side};

/// An order that propagates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// Its number m.
    pub order: i32,
    /// kx0 + m λ/Λ, in units of k0.
    pub kx: f64,
    /// sqrt(n² - kx²) > 0, in units of k0.
    pub kz: f64,
}

/// All efficiencies at one Bloch wavevector.
#[derive(Clone, Debug)]
pub struct Solution {
    orders: [Vec<Order>; 2],
    /// [polarisation](to, from), orders of the top first.
    efficiencies: [Mat<f64>; 2],
    nodes: usize,
}

impl Solution {
    pub(super) fn new(orders: [Vec<Order>; 2], efficiencies: [Mat<f64>; 2], nodes: usize) -> Self {
        Self { orders, efficiencies, nodes }
    }

    /// Orders that propagate in a half-space, ascending.
    pub fn orders(&self, side: Side) -> &[Order] {
        &self.orders[number(side)]
    }

    /// Nodes on the surface.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    fn position(&self, side: Side, order: i32) -> Option<usize> {
        let before = if side == Side::Top { 0 } else { self.orders[0].len() };
        let found = self.orders(side).iter().position(|o| o.order == order)?;
        Some(before + found)
    }

    /// Share of the power of the wave that comes in by order `from.1` of side `from.0` which leaves
    /// by `to`; 0 where either does not propagate. In the planar mount the polarisation is kept.
    pub fn efficiency(&self, from: (Side, i32, Pol), to: (Side, i32)) -> f64 {
        let places = (self.position(to.0, to.1), self.position(from.0, from.1));
        let (Some(row), Some(column)) = places else {
            return 0.0;
        };
        self.efficiencies[usize::from(from.2 == Pol::P)][(row, column)]
    }

    /// Share that leaves on one side, all orders together.
    pub fn total(&self, from: (Side, i32, Pol), to: Side) -> f64 {
        self.orders(to).iter().map(|o| self.efficiency(from, (to, o.order))).sum()
    }

    /// Largest |R + T - 1| of any incident wave. Nothing in the equations enforces 0: it shows the
    /// error.
    pub fn worst_balance(&self) -> f64 {
        let residual = |matrix: &Mat<f64>, from: usize| {
            ((0..matrix.nrows()).map(|to| matrix[(to, from)]).sum::<f64>() - 1.0).abs()
        };
        let each = |matrix: &Mat<f64>| {
            (0..matrix.ncols()).map(|from| residual(matrix, from)).fold(0.0, f64::max)
        };
        self.efficiencies.iter().map(each).fold(0.0, f64::max)
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

/// Orders and their kz up to a few beyond the last that propagates; `spacing` is λ/Λ.
pub(super) fn all_orders(n: f64, kx0: f64, spacing: f64) -> Vec<(i32, Complex64)> {
    let reach = n + 3.0 * spacing;
    let (first, last) =
        (((-reach - kx0) / spacing).floor() as i32, ((reach - kx0) / spacing).ceil() as i32);
    (first..=last)
        .map(|m| {
            let kx = kx0 + f64::from(m) * spacing;
            (m, Complex64::from((n - kx) * (n + kx)).sqrt())
        })
        .collect()
}

/// The orders that propagate.
pub(super) fn propagating(n: f64, kx0: f64, spacing: f64) -> Vec<Order> {
    let all = all_orders(n, kx0, spacing).into_iter();
    all.filter(|(_, kz)| kz.re > 0.0)
        .map(|(order, kz)| Order { order, kx: kx0 + f64::from(order) * spacing, kz: kz.re })
        .collect()
}
