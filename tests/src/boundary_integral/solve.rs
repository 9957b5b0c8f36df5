// SPDX-License-Identifier: MIT OR Apache-2.0
//! The integral equations: from a surface between two media to the share of every order.
//!
//! With u the field along the grooves (E for TE, H for TM) and v its derivative along the normal on
//! the top side, Green's theorem in both media reads on the surface
//!
//! u/2 + D₁u - S₁v = u_inc (light from the top),   u/2 - D₂u + ρ S₂v = u_inc (light from the
//! bottom),
//!
//! ρ = 1 for TE and ε₂/ε₁ for TM. The amplitudes of the orders are integrals of u and v with plane
//! waves.

use super::error::{IntegralError, positive};
use super::kernel::{CMat, Layers, layers};
use super::lattice::{Far, MOST, Place};
use super::nodes::{Fineness, Nodes};
use super::outline::Outline;
use super::sides::same_medium;
use super::solution::{Order, Solution, all_orders, number, propagating};
use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, SolveCore};
use num_complex::Complex64;
use rcwa::relief::Relief;
use rcwa::{Pol, Side};
use std::f64::consts::TAU;

/// Most nodes accepted: the matrix has twice as many rows.
const MOST_NODES: usize = 6000;

/// A surface between two media without loss, lit at one wavelength.
#[derive(Clone, Debug, PartialEq)]
pub struct Grating {
    outline: Outline,
    wavelength: f64,
    index: [f64; 2],
}

impl Grating {
    /// The surface `outline` with `n_top` above (smaller z) and `n_bottom` below; lengths in one
    /// unit.
    ///
    /// # Errors
    /// A wavelength or an index that is not a finite number above 0; equal indices.
    pub fn new(
        outline: Outline,
        wavelength: f64,
        n_top: f64,
        n_bottom: f64,
    ) -> Result<Self, IntegralError> {
        positive("the wavelength", wavelength)?;
        positive("the index of the top half-space", n_top)?;
        positive("the index of the bottom half-space", n_bottom)?;
        if same_medium(n_top, n_bottom) {
            return Err(IntegralError::NoSurface { index: n_top });
        }
        Ok(Self { outline, wavelength, index: [n_top, n_bottom] })
    }

    /// The surface that a relief of the two media makes, see [`Outline::of_relief`].
    ///
    /// # Errors
    /// As [`Outline::of_relief`] and [`Grating::new`].
    pub fn of_relief(
        relief: &Relief,
        wavelength: f64,
        n_top: f64,
        n_bottom: f64,
    ) -> Result<Self, IntegralError> {
        Self::new(Outline::of_relief(relief, n_top, n_bottom)?, wavelength, n_top, n_bottom)
    }

    /// The surface.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// Solves for all waves whose kx differs from `kx0` (in units of k0) by multiples of λ/Λ: all
    /// propagating orders from both sides, in both polarisations, ky = 0.
    ///
    /// # Errors
    /// A wavevector that is not finite, an order next to its cut-off, too many nodes.
    pub fn solve(&self, kx0: f64, fineness: Fineness) -> Result<Solution, IntegralError> {
        Ok(Problem::new(self, kx0, fineness)?.solve())
    }

    /// As [`Grating::solve`], and again with 1.5 times as many nodes. The finer solution and the
    /// largest difference of any efficiency between both: an upper estimate of its error where it
    /// converges.
    ///
    /// # Errors
    /// As [`Grating::solve`].
    pub fn solve_twice(
        &self,
        kx0: f64,
        fineness: Fineness,
    ) -> Result<(Solution, f64), IntegralError> {
        let coarse = self.solve(kx0, fineness)?;
        let fine = self.solve(kx0, fineness.refined(1.5))?;
        let difference = fine.largest_difference(&coarse);
        Ok((fine, difference))
    }
}

/// One Bloch wavevector on discrete nodes; lengths times k0.
struct Problem {
    index: [f64; 2],
    kx0: f64,
    nodes: Nodes,
    /// Orders that propagate, above and below.
    orders: [Vec<Order>; 2],
    far: [Far; 2],
}

impl Problem {
    fn new(grating: &Grating, kx0: f64, fineness: Fineness) -> Result<Self, IntegralError> {
        if !kx0.is_finite() {
            return Err(IntegralError::Wavevector { got: kx0 });
        }
        let outline = grating.outline.scaled(TAU / grating.wavelength);
        let index = grating.index;
        let nodes = Nodes::new(&outline, index[0].max(index[1]), fineness)?;
        if nodes.list.len() > MOST_NODES {
            return Err(IntegralError::TooLarge { nodes: nodes.list.len(), most: MOST_NODES });
        }
        let (low, high) = nodes.extent();
        let place = Place { period: outline.period(), low, high };
        let far = |side: Side| {
            let n = index[number(side)];
            let all = all_orders(n, kx0, TAU / place.period);
            let poles: Vec<Complex64> = all.iter().map(|o| o.1).collect();
            Far::new(n, kx0, &poles, place).ok_or_else(|| {
                let nearest = all.iter().min_by(|a, b| a.1.norm().total_cmp(&b.1.norm()));
                let (order, kz) = nearest.map_or((0, 0.0), |o| (o.0, o.1.norm()));
                IntegralError::CutOff { order, side, kz, most: MOST }
            })
        };
        let far = [far(Side::Top)?, far(Side::Bottom)?];
        let orders = index.map(|n| propagating(n, kx0, TAU / place.period));
        Ok(Self { index, kx0, nodes, orders, far })
    }

    fn solve(&self) -> Solution {
        let [top, bottom] =
            [0, 1].map(|i| layers(&self.nodes, self.index[i], self.kx0, &self.far[i]));
        let incident = self.incident();
        let projections = [self.projection(Side::Top), self.projection(Side::Bottom)];
        let efficiencies = Pol::BOTH.map(|pol| {
            let ratio = match pol {
                Pol::S => 1.0,
                Pol::P => (self.index[1] / self.index[0]).powi(2),
            };
            let mut fields = incident.clone();
            self.factor(&top, &bottom, ratio)
                .solve_in_place_with_conj(faer::Conj::No, fields.as_mut());
            self.efficiencies(&fields, &projections, ratio)
        });
        Solution::new(self.orders.clone(), efficiencies, self.nodes.list.len())
    }

    /// LU of the equations in u (first half) and ψ (second half).
    fn factor(&self, top: &Layers, bottom: &Layers, ratio: f64) -> PartialPivLu<Complex64> {
        let count = self.nodes.list.len();
        let half = |i: usize, j: usize| if i == j { 0.5 } else { 0.0 };
        let matrix: CMat = Mat::from_fn(2 * count, 2 * count, |row, column| {
            let (i, j) = (row % count, column % count);
            match (row < count, column < count) {
                (true, true) => half(i, j) + top.double[(i, j)],
                (true, false) => -top.single[(i, j)],
                (false, true) => half(i, j) - bottom.double[(i, j)],
                (false, false) => ratio * bottom.single[(i, j)],
            }
        });
        matrix.partial_piv_lu()
    }

    /// Every incident wave on the surface: the orders from the top, then those from the bottom.
    fn incident(&self) -> CMat {
        let count = self.nodes.list.len();
        let from_top = self.orders[0].len();
        Mat::from_fn(2 * count, from_top + self.orders[1].len(), |row, wave| {
            let side = usize::from(wave >= from_top);
            if usize::from(row >= count) != side {
                return Complex64::ZERO;
            }
            let order = &self.orders[side][wave - side * from_top];
            let [x, z] = self.nodes.place(&self.nodes.list[row % count]);
            let kz = if side == 0 { order.kz } else { -order.kz };
            (Complex64::I * (order.kx * x + kz * z)).exp()
        })
    }

    /// Amplitudes that leave on a side, as a matrix on u and on ψ (on ρψ at the bottom), since far
    /// from the surface G = Σ i/(2 d kz_m) e^{i kx_m (x-x') + i kz_m |z-z'|}.
    fn projection(&self, side: Side) -> CMat {
        let count = self.nodes.list.len();
        let step = TAU / count as f64;
        let orders = &self.orders[number(side)];
        let up = if side == Side::Top { 1.0 } else { -1.0 };
        let i = Complex64::I;
        Mat::from_fn(orders.len(), 2 * count, |m, column| {
            let order = &orders[m];
            let node = &self.nodes.list[column % count];
            let [x, z] = self.nodes.place(node);
            let wave = (i * (up * order.kz * z - order.kx * x)).exp();
            let weight = up * i * step / (2.0 * self.nodes.period * order.kz) * wave;
            if column < count {
                weight
                    * i
                    * (order.kx * node.normal[0] - up * order.kz * node.normal[1])
                    * node.speed
            } else {
                weight
            }
        })
    }

    /// Shares [to][from] of all propagating orders, those of the top first.
    fn efficiencies(&self, fields: &CMat, projections: &[CMat; 2], ratio: f64) -> Mat<f64> {
        let count = self.nodes.list.len();
        let mut below = fields.clone();
        for wave in 0..below.ncols() {
            for row in count..2 * count {
                below[(row, wave)] *= ratio;
            }
        }
        let leaving = [&projections[0] * fields, &projections[1] * &below];
        // Power of a unit wave: kz for TE, kz/ε for TM; ρ is the ratio of the permittivities there.
        let channels: Vec<(usize, usize, f64)> = (0..2)
            .flat_map(|side| {
                let per = if side == 0 { 1.0 } else { ratio };
                self.orders[side].iter().enumerate().map(move |(m, o)| (side, m, o.kz / per))
            })
            .collect();
        Mat::from_fn(channels.len(), channels.len(), |to, from| {
            let (side, m, power) = channels[to];
            power / channels[from].2 * leaving[side][(m, from)].norm_sqr()
        })
    }
}
