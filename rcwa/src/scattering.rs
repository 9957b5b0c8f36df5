// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scattering matrix: amplitude and efficiency of every propagating order, for light from both
//! sides.

use crate::linalg::{Accum, CMat, Lu, product, transpose};
use crate::orders::{Bloch, Channel, half_space_kz, tangent};
use crate::stack::state::State;
use crate::wave::{Pol, Side};
use faer::Mat;
use num_complex::Complex64;

/// Largest |R + T - 1| of a lossless stack, and largest R + T - 1 of an absorbing one.
pub const ENERGY_TOLERANCE: f64 = 1e-10;

/// Scattering matrix of one Bloch wavevector among all channels.
///
/// Rows and columns of the blocks run over (channel, polarisation), s before p. Amplitudes are
/// those of the electric vector, with the phase reference at the top plane of the structure for the
/// top half-space and at its bottom plane for the bottom half-space.
#[derive(Clone, Debug)]
pub struct Scattering {
    bloch: Bloch,
    channels: [Vec<Channel>; 2],
    /// True where light can come from a half-space: where it is lossless.
    sources: [bool; 2],
    /// Blocks [to][from].
    blocks: [[CMat; 2]; 2],
}

impl Scattering {
    /// Matches the fields just below the top half-space of index `n`, in Fourier coordinates, to
    /// its waves.
    pub(crate) fn match_top(
        state: &State,
        n: Complex64,
        kx: &[f64],
        bloch: Bloch,
        [top, bottom]: [Vec<Channel>; 2],
    ) -> Self {
        let orders = kx.len();
        let kz = half_space_kz(n, kx, bloch.ky);
        // Twice the amplitude of what comes from above, times kz: kz E·s - H·k̂ for s, n E·k̂ +
        // (kz/n) H·s for p. The reflected wave drops out of these, and they stay regular where kz =
        // 0.
        let incoming = |e: &CMat, h: &CMat| -> CMat {
            Mat::from_fn(2 * orders, e.nrows(), |row, t| {
                let m = row / 2;
                let (cos, sin) = tangent(kx[m], bloch);
                let (ex, ey, hy, hx) =
                    (e[(t, m)], e[(t, orders + m)], h[(t, m)], h[(t, orders + m)]);
                if row.is_multiple_of(2) {
                    kz[m] * (ey * cos - ex * sin) + (hx * cos - hy * sin)
                } else {
                    n * (ex * cos + ey * sin) + kz[m] / n * (hx * sin + hy * cos)
                }
            })
        };
        // Upward waves: E·s - a for s, H·s/n - a for p.
        let upward = |e: &CMat, h: &CMat| -> CMat {
            Mat::from_fn(2 * top.len(), e.nrows(), |row, t| {
                let m = (top[row / 2].order + (orders as i32 - 1) / 2) as usize;
                let (cos, sin) = tangent(kx[m], bloch);
                if row.is_multiple_of(2) {
                    e[(t, orders + m)] * cos - e[(t, m)] * sin
                } else {
                    (h[(t, orders + m)] * sin + h[(t, m)] * cos) / n
                }
            })
        };
        let (to_top, to_bottom) = (2 * top.len(), 2 * bottom.len());
        let from_top = if n.im == 0.0 { to_top } else { 0 };
        let from_bottom = state.electric_by_below.nrows();
        // Columns: t for a unit wave of every channel from the top, then for each from the bottom.
        let mut parameters: CMat = Mat::zeros(2 * orders, from_top + from_bottom);
        for column in 0..from_top {
            let channel = &top[column / 2];
            let m = (channel.order + (orders as i32 - 1) / 2) as usize;
            parameters[(2 * m + column % 2, column)] = 2.0 * channel.kz;
        }
        let by_below = incoming(&state.electric_by_below, &state.magnetic_by_below);
        for column in 0..from_bottom {
            for row in 0..2 * orders {
                parameters[(row, from_top + column)] = -by_below[(row, column)];
            }
        }
        Lu::new(&incoming(&state.electric, &state.magnetic)).solve(parameters.as_mut());

        let one = Complex64::ONE;
        let mut up: CMat = Mat::zeros(to_top, from_top + from_bottom);
        let reads = upward(&state.electric, &state.magnetic);
        product(up.as_mut(), Accum::Replace, one, reads.as_ref(), parameters.as_ref());
        let reads_below = upward(&state.electric_by_below, &state.magnetic_by_below);
        let mut down: CMat = Mat::zeros(to_bottom, from_top + from_bottom);
        let transmitted = transpose(&state.transmitted);
        product(down.as_mut(), Accum::Replace, one, transmitted.as_ref(), parameters.as_ref());

        let delta = |i: usize, j: usize| if i == j { one } else { Complex64::ZERO };
        let top_top = Mat::from_fn(to_top, from_top, |i, j| up[(i, j)] - delta(i, j));
        let top_bottom =
            Mat::from_fn(to_top, from_bottom, |i, j| up[(i, from_top + j)] + reads_below[(i, j)]);
        let bottom_top = Mat::from_fn(to_bottom, from_top, |i, j| down[(i, j)]);
        let bottom_bottom = Mat::from_fn(to_bottom, from_bottom, |i, j| {
            down[(i, from_top + j)] + state.reflected_below[(j, i)]
        });
        let sources = [n.im == 0.0, from_bottom > 0 || bottom.is_empty()];
        Self {
            bloch,
            channels: [top, bottom],
            sources,
            blocks: [[top_top, top_bottom], [bottom_top, bottom_bottom]],
        }
    }

    /// From the whole matrix of outgoing by incoming amplitudes, top before bottom, of a lossless
    /// structure.
    pub(crate) fn from_matrix(
        matrix: &CMat,
        bloch: Bloch,
        [top, bottom]: [Vec<Channel>; 2],
    ) -> Self {
        let sizes = [2 * top.len(), 2 * bottom.len()];
        let starts = [0, sizes[0]];
        let blocks = [0, 1].map(|to| {
            [0, 1].map(|from| {
                Mat::from_fn(sizes[to], sizes[from], |i, j| {
                    matrix[(starts[to] + i, starts[from] + j)]
                })
            })
        });
        Self { bloch, channels: [top, bottom], sources: [true; 2], blocks }
    }

    /// The Bloch wavevector this belongs to.
    pub fn bloch(&self) -> Bloch {
        self.bloch
    }

    /// Channels of a half-space, by ascending order.
    pub fn channels(&self, side: Side) -> &[Channel] {
        &self.channels[side.number()]
    }

    /// The channel of an order by which light can come from a half-space.
    pub fn source(&self, side: Side, order: i32) -> Option<&Channel> {
        if self.sources[side.number()] { self.channel(side, order) } else { None }
    }

    /// The orders that carry power away into a half-space, ascending.
    pub fn orders(&self, side: Side) -> impl Iterator<Item = i32> + '_ {
        self.channels(side).iter().map(|c| c.order)
    }

    /// The orders by which light can come from a half-space, ascending.
    pub fn sources(&self, side: Side) -> impl Iterator<Item = i32> + '_ {
        let is_lit = self.sources[side.number()];
        self.orders(side).filter(move |_| is_lit)
    }

    /// The channel of an order, if it carries power away.
    pub fn channel(&self, side: Side, order: i32) -> Option<&Channel> {
        self.position(side, order).map(|i| &self.channels(side)[i])
    }

    fn position(&self, side: Side, order: i32) -> Option<usize> {
        let channels = self.channels(side);
        let first = channels.first()?.order;
        let position = usize::try_from(order - first).ok()?;
        (position < channels.len()).then_some(position)
    }

    /// Complex amplitude of the electric vector of `(side, order, polarisation)` for a unit wave
    /// from `(side, order, polarisation)`; 0 where either is no channel.
    pub fn amplitude(&self, from: (Side, i32, Pol), to: (Side, i32, Pol)) -> Complex64 {
        let (Some(i), Some(j)) = (self.position(to.0, to.1), self.position(from.0, from.1)) else {
            return Complex64::ZERO;
        };
        if !self.sources[from.0.number()] {
            return Complex64::ZERO;
        }
        self.blocks[to.0.number()][from.0.number()]
            [(2 * i + to.2.number(), 2 * j + from.2.number())]
    }

    /// Efficiency with which a wave from `(side, order, polarisation)` leaves in `(side, order)` with
    /// polarisation `pol`; 0 where either is no channel.
    pub fn efficiency_in(&self, from: (Side, i32, Pol), to: (Side, i32), pol: Pol) -> f64 {
        let (Some(source), Some(target)) = (self.source(from.0, from.1), self.channel(to.0, to.1))
        else {
            return 0.0;
        };
        let flux = target.flux[pol.number()] / source.flux[from.2.number()];
        flux * self.amplitude(from, (to.0, to.1, pol)).norm_sqr()
    }

    /// Efficiency with which a wave from `(side, order, polarisation)` leaves in `(side, order)`, in
    /// both polarisations together; 0 where either is no channel.
    pub fn efficiency(&self, from: (Side, i32, Pol), to: (Side, i32)) -> f64 {
        Pol::BOTH.iter().map(|&pol| self.efficiency_in(from, to, pol)).sum()
    }

    /// Part of the power that goes back to (`to` = where it came from) or passes into a half-space, all orders
    /// together.
    pub fn total(&self, from: (Side, i32, Pol), to: Side) -> f64 {
        self.orders(to).map(|order| self.efficiency(from, (to, order))).sum()
    }

    /// The incident wave with the largest |R + T - 1|, and its R + T - 1; `None` if nothing
    /// propagates.
    pub fn worst_balance(&self) -> Option<(Side, i32, Pol, f64)> {
        let mut worst: Option<(Side, i32, Pol, f64)> = None;
        for side in Side::BOTH.into_iter().filter(|&s| self.sources[s.number()]) {
            for order in self.orders(side) {
                for pol in Pol::BOTH {
                    let from = (side, order, pol);
                    let residual =
                        self.total(from, Side::Top) + self.total(from, Side::Bottom) - 1.0;
                    if worst.is_none_or(|w| residual.abs() > w.3.abs() || residual.is_nan()) {
                        worst = Some((side, order, pol, residual));
                    }
                }
            }
        }
        worst
    }
}
