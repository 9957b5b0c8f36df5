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
//! waves, and the power through the surface is that of Im(u* v).

use super::error::{IntegralError, positive};
use super::kernel::{CMat, Layers, layers};
use super::lattice::{Far, MOST, Place};
use super::nodes::{Fineness, Nodes};
use super::outline::Outline;
use super::sides::check_media;
use super::solution::{Order, Solution, all_orders, number};
use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, SolveCore};
use num_complex::Complex64;
use rcwa::relief::Relief;
use rcwa::{Pol, Side};
use std::f64::consts::TAU;

/// Most nodes accepted: the matrix has twice as many rows.
const MOST_NODES: usize = 6000;

/// Orders beyond |kx| = |n| whose poles may matter, in both directions.
const MORE_POLES: f64 = 3.0;

/// A surface between two media, lit at one wavelength.
#[derive(Clone, Debug, PartialEq)]
pub struct Grating {
    outline: Outline,
    wavelength: f64,
    index: [Complex64; 2],
}

impl Grating {
    /// The surface `outline` with `n_top` above (smaller z) and `n_bottom` below; lengths in one
    /// unit.
    ///
    /// # Errors
    /// A wavelength that is not a finite number above 0; indices that no passive medium has, or equal
    /// ones.
    pub fn new(
        outline: Outline,
        wavelength: f64,
        n_top: impl Into<Complex64>,
        n_bottom: impl Into<Complex64>,
    ) -> Result<Self, IntegralError> {
        positive("the wavelength", wavelength)?;
        // Adding zero makes -0 a 0, on which branches of square roots hang.
        let index = [n_top.into() + Complex64::ZERO, n_bottom.into() + Complex64::ZERO];
        check_media(index[0], index[1])?;
        Ok(Self { outline, wavelength, index })
    }

    /// The surface that a relief of the two media makes, see [`Outline::of_relief`].
    ///
    /// # Errors
    /// As [`Outline::of_relief`] and [`Grating::new`].
    pub fn of_relief(
        relief: &Relief,
        wavelength: f64,
        n_top: impl Into<Complex64>,
        n_bottom: impl Into<Complex64>,
    ) -> Result<Self, IntegralError> {
        let (n_top, n_bottom) = (n_top.into(), n_bottom.into());
        Self::new(Outline::of_relief(relief, n_top, n_bottom)?, wavelength, n_top, n_bottom)
    }

    /// The surface.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// Solves for all waves whose kx differs from `kx0` (in units of k0) by multiples of λ/Λ: all
    /// propagating orders from both sides without loss, in both polarisations, ky = 0.
    ///
    /// # Errors
    /// A wavevector that is not finite, an order next to its cut-off, too many nodes.
    pub fn solve(&self, kx0: f64, fineness: Fineness) -> Result<Solution, IntegralError> {
        self.solve_within(kx0, fineness, MOST_NODES)
    }

    /// As [`Grating::solve`] with so many nodes at most.
    pub(super) fn solve_within(
        &self,
        kx0: f64,
        fineness: Fineness,
        most: usize,
    ) -> Result<Solution, IntegralError> {
        Ok(Problem::new(self, kx0, fineness, most)?.solve())
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
    index: [Complex64; 2],
    kx0: f64,
    nodes: Nodes,
    /// Orders that carry power, above and below.
    orders: [Vec<Order>; 2],
    /// How many of them bring light: all without loss, or none.
    sources: [usize; 2],
    /// Planes through which power is counted, next to the surface.
    planes: [f64; 2],
    far: [Far; 2],
}

impl Problem {
    fn new(
        grating: &Grating,
        kx0: f64,
        fineness: Fineness,
        most: usize,
    ) -> Result<Self, IntegralError> {
        if !kx0.is_finite() {
            return Err(IntegralError::Wavevector { got: kx0 });
        }
        let outline = grating.outline.scaled(TAU / grating.wavelength);
        let index = grating.index;
        let densest = index[0].norm().max(index[1].norm());
        let nodes = Nodes::new(&outline, densest, fineness, most)?;
        let (low, high) = nodes.extent();
        let place = Place { period: outline.period(), low, high };
        let spacing = TAU / place.period;
        let far = |side: Side| {
            let n = index[number(side)];
            let all = all_orders(n, kx0, spacing, n.norm() + MORE_POLES * spacing);
            let poles: Vec<Complex64> = all.iter().map(|o| o.kz).collect();
            Far::new(n, kx0, &poles, place).ok_or_else(|| {
                let nearest = all.iter().min_by(|a, b| a.kz.norm().total_cmp(&b.kz.norm()));
                let (order, kz) = nearest.map_or((0, 0.0), |o| (o.order, o.kz.norm()));
                IntegralError::CutOff { order, side, kz, most: MOST }
            })
        };
        let far = [far(Side::Top)?, far(Side::Bottom)?];
        let orders = index.map(|n| {
            let mut all = all_orders(n, kx0, spacing, n.norm());
            all.retain(|o| if n.im == 0.0 { o.kz.re > 0.0 } else { o.kx.abs() < n.norm() });
            all
        });
        let sources = [0, 1].map(|side| if index[side].im == 0.0 { orders[side].len() } else { 0 });
        let planes = outline.extent();
        Ok(Self { index, kx0, nodes, orders, sources, planes, far })
    }

    fn solve(&self) -> Solution {
        let [top, bottom] =
            [0, 1].map(|i| layers(&self.nodes, self.index[i], self.kx0, &self.far[i]));
        let incident = self.incident();
        let projections = [self.projection(Side::Top), self.projection(Side::Bottom)];
        let mut worst_balance: f64 = 0.0;
        let efficiencies = Pol::BOTH.map(|pol| {
            let weights = match pol {
                Pol::S => [Complex64::ONE; 2],
                Pol::P => self.index.map(|n| n * n),
            };
            let mut fields = incident.clone();
            self.factor(&top, &bottom, weights[1] / weights[0])
                .solve_in_place_with_conj(faer::Conj::No, fields.as_mut());
            let shares = self.efficiencies(&fields, &projections, weights);
            worst_balance = self.balance(&fields, &shares, weights).fold(worst_balance, f64::max);
            shares
        });
        let (orders, count) = (self.orders.clone(), self.nodes.list.len());
        Solution::new(orders, self.sources, efficiencies, worst_balance, count)
    }

    /// LU of the equations in u (first half) and ψ (second half).
    fn factor(&self, top: &Layers, bottom: &Layers, ratio: Complex64) -> PartialPivLu<Complex64> {
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

    /// Incident waves: side and order.
    fn waves(&self) -> impl Iterator<Item = (usize, &Order)> {
        [0, 1].into_iter().flat_map(|side| {
            self.orders[side][..self.sources[side]].iter().map(move |order| (side, order))
        })
    }

    /// Every incident wave on the surface: the orders from the top, then those from the bottom.
    fn incident(&self) -> CMat {
        let count = self.nodes.list.len();
        let waves: Vec<_> = self.waves().collect();
        Mat::from_fn(2 * count, waves.len(), |row, wave| {
            let (side, order) = waves[wave];
            if usize::from(row >= count) != side {
                return Complex64::ZERO;
            }
            let [x, z] = self.nodes.place(&self.nodes.list[row % count]);
            let kz = if side == 0 { order.kz } else { -order.kz };
            (Complex64::I * (order.kx * x + kz * z)).exp()
        })
    }

    /// Amplitudes that leave on a side through the plane next to the surface, as a matrix on u and on
    /// ψ (on ρψ at the bottom), since there G = Σ i/(2 d kz_m) e^{i kx_m (x-x') + i kz_m |z-z'|}.
    fn projection(&self, side: Side) -> CMat {
        let count = self.nodes.list.len();
        let step = TAU / count as f64;
        let orders = &self.orders[number(side)];
        let up = if side == Side::Top { 1.0 } else { -1.0 };
        let plane = self.planes[number(side)];
        let i = Complex64::I;
        Mat::from_fn(orders.len(), 2 * count, |m, column| {
            let order = &orders[m];
            let node = &self.nodes.list[column % count];
            let [x, z] = self.nodes.place(node);
            let wave = (i * (up * order.kz * (z - plane) - order.kx * x)).exp();
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

    /// Shares (to, from) of all orders, those of the top first; powers are Re(kz/weight) of a unit wave.
    fn efficiencies(
        &self,
        fields: &CMat,
        projections: &[CMat; 2],
        weights: [Complex64; 2],
    ) -> Mat<f64> {
        let count = self.nodes.list.len();
        let mut below = fields.clone();
        for wave in 0..below.ncols() {
            for row in count..2 * count {
                below[(row, wave)] *= weights[1] / weights[0];
            }
        }
        let leaving = [&projections[0] * fields, &projections[1] * &below];
        // Adding zero makes the -0 of metals without loss a 0.
        let power = |side: usize, order: &Order| (order.kz / weights[side]).re + 0.0;
        let incident: Vec<f64> = self.waves().map(|(side, order)| power(side, order)).collect();
        let top = self.orders[0].len();
        Mat::from_fn(top + self.orders[1].len(), incident.len(), |to, from| {
            let side = usize::from(to >= top);
            let m = to - side * top;
            power(side, &self.orders[side][m]) / incident[from]
                * leaving[side][(m, from)].norm_sqr()
        })
    }

    /// |R + T - 1| of every incident wave. If the other half-space absorbs, T is the power through the
    /// surface, Σ Im(u* ψ)/kz of a period.
    fn balance<'a>(
        &'a self,
        fields: &'a CMat,
        shares: &'a Mat<f64>,
        weights: [Complex64; 2],
    ) -> impl Iterator<Item = f64> + 'a {
        let count = self.nodes.list.len();
        let area = self.nodes.period * count as f64 / TAU;
        self.waves().enumerate().map(move |(from, (side, order))| {
            let sum = |rows: std::ops::Range<usize>| rows.map(|to| shares[(to, from)]).sum::<f64>();
            let top = self.orders[0].len();
            let own = if side == 0 { sum(0..top) } else { sum(top..shares.nrows()) };
            let other = if self.sources[1 - side] > 0 {
                sum(0..shares.nrows()) - own
            } else {
                let flow = |row: usize| {
                    (fields[(row, from)].conj() * fields[(row + count, from)] / weights[0]).im
                };
                let sign = if side == 0 { 1.0 } else { -1.0 };
                let incident = area * (order.kz / weights[side]).re;
                sign * (0..count).map(flow).sum::<f64>() / incident
            };
            (own + other - 1.0).abs()
        })
    }
}
