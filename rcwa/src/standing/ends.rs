// SPDX-License-Identifier: MIT OR Apache-2.0
//! The half-spaces of a self-mirror line: where standing waves begin at the bottom and become orders again.
//!
//! At the bottom an order that decays is one real wave for each cosine or sine and polarisation; an order that propagates
//! leaves its E and H free. t are the amplitudes of the former and the H of the latter, u the E of the latter. At the top the
//! decaying orders are matched in real numbers, and v = h + α e of those that propagate is prescribed. What is left,
//!
//! - e = K₁₁ v + K₁₂ u at the top,   h = K₂₁ v + K₂₂ u at the bottom,
//!
//! concerns orders of light alone, and is matched to incoming and outgoing waves in complex numbers.
//!
//! Along a wavevector k = (κ, ky), with φ a cosine or sine and γ = Im kz, the waves that decay downwards are
//!
//! - s: (ex, ey) = (-ky φ, ∂φ)/k,        (hy, hx) = γ (-ky φ, ∂φ)/k
//! - p: (ex, ey) = (γ/n) (∂φ, -ky φ)/k,  (hy, hx) = n (-∂φ, ky φ)/k

use crate::linalg::{CMat, Lu, Onto, RMat, product};
use crate::modes::standing::Harmonics;
use crate::orders::{Bloch, Channel, tangent};
use crate::solve::BARELY_EVANESCENT;
use crate::stack::propagate::{Coordinates, is_bounded};
use crate::stack::state::{Parameters, Spare, State};
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::FRAC_1_SQRT_2;

/// Largest element of a relation K that is accepted before another α is tried.
const LARGEST: f64 = 1e3;

/// A half-space seen by one problem of the line.
pub(crate) struct HalfSpace<'a> {
    harmonics: &'a Harmonics,
    n: f64,
    ky: f64,
}

impl<'a> HalfSpace<'a> {
    pub(crate) fn new(harmonics: &'a Harmonics, n: f64, ky: f64) -> Self {
        Self { harmonics, n, ky }
    }

    fn kz_squared(&self, kappa: f64) -> f64 {
        self.n * self.n - kappa * kappa - self.ky * self.ky
    }

    /// Columns of the coordinates (ex and ey, or hy and hx) of the orders that propagate.
    fn open(&self) -> Vec<usize> {
        let count = self.harmonics.count();
        let mut columns: Vec<usize> = (0..self.harmonics.wavenumbers().len())
            .filter(|&i| self.kz_squared(self.harmonics.wavenumbers()[i]) > 0.0)
            .flat_map(|i| std::iter::once(i).chain(self.harmonics.sine(i)))
            .flat_map(|place| [place, count + place])
            .collect();
        columns.sort_unstable();
        columns
    }

    /// (cosine, its sine if it has one, κ, γ) of every order that decays.
    fn closed(&self) -> impl Iterator<Item = (usize, Option<usize>, f64, f64)> + '_ {
        let kappa = self.harmonics.wavenumbers().iter().enumerate();
        kappa.filter_map(|(i, &kappa)| {
            let kz_squared = self.kz_squared(kappa);
            let gamma = (-kz_squared).max(0.0).sqrt().max(BARELY_EVANESCENT.im);
            (kz_squared <= 0.0).then(|| (i, self.harmonics.sine(i), kappa, gamma))
        })
    }

    /// Waves that decay: for each a list of (column, e, h); `sign` 1 downwards, -1 upwards.
    fn decaying(&self, sign: f64) -> Vec<Vec<(usize, f64, f64)>> {
        let (n, ky, count) = (self.n, self.ky, self.harmonics.count());
        let mut waves = Vec::new();
        for (cosine, sine, kappa, gamma) in self.closed() {
            let k = kappa.hypot(ky);
            let each = std::iter::once((cosine, sine, -kappa))
                .chain(sine.map(|s| (s, Some(cosine), kappa)));
            for (phi, other, slope) in each {
                // ∂φ is `slope` times the other of the pair.
                let mut s = vec![(phi, -ky / k, -gamma * sign * ky / k)];
                let mut p = vec![(count + phi, -sign * gamma / n * ky / k, n * ky / k)];
                if let Some(other) = other {
                    s.push((count + other, slope / k, gamma * sign * slope / k));
                    p.push((other, sign * gamma / n * slope / k, -n * slope / k));
                }
                waves.push(s);
                waves.push(p);
            }
        }
        waves
    }

    /// Just above the bottom half-space.
    pub(crate) fn at_bottom(&self) -> State<f64> {
        let size = 2 * self.harmonics.count();
        let open = self.open();
        let mut electric: RMat = Mat::zeros(size, size);
        let mut magnetic: RMat = Mat::zeros(size, size);
        let mut transmitted: RMat = Mat::zeros(size, open.len());
        for (t, &column) in open.iter().enumerate() {
            magnetic[(t, column)] = 1.0;
            transmitted[(t, t)] = 1.0;
        }
        for (wave, elements) in self.decaying(1.0).into_iter().enumerate() {
            for (column, e, h) in elements {
                electric[(open.len() + wave, column)] += e;
                magnetic[(open.len() + wave, column)] += h;
            }
        }
        State {
            ky: self.ky,
            parameters: Parameters::General,
            growth: 0.0,
            electric_by_below: Mat::from_fn(open.len(), size, |u, column| {
                if open[u] == column { 1.0 } else { 0.0 }
            }),
            magnetic_by_below: Mat::zeros(open.len(), size),
            transmitted,
            reflected_below: Mat::zeros(open.len(), open.len()),
            spare: Spare::new(size, open.len(), open.len()),
            electric,
            magnetic,
        }
    }

    /// Fields (by open column) of a wave of unit amplitude in each channel, s then p, downwards: e and h.
    fn waves(&self, bloch: Bloch, channels: &[Channel]) -> (CMat, CMat) {
        let (open, count) = (self.open(), self.harmonics.count());
        let mut e: CMat = Mat::zeros(open.len(), 2 * channels.len());
        let mut h = e.clone();
        let row = |column: usize| open.partition_point(|&c| c < column);
        for (number, channel) in channels.iter().enumerate() {
            let (cos, sin) = tangent(channel.kx, bloch);
            let kz = channel.kz.re;
            let kappa = channel.kx.abs();
            let cosine = self
                .harmonics
                .wavenumbers()
                .partition_point(|&k| k < kappa - 1e-9);
            // exp(iκx) = (√2cos + i √2sin)/√2; E_y = -i ey, H_y = i hy.
            let parts: Vec<(usize, Complex64)> = match self.harmonics.sine(cosine) {
                None => vec![(cosine, Complex64::ONE)],
                Some(sine) => vec![
                    (cosine, FRAC_1_SQRT_2.into()),
                    (
                        sine,
                        Complex64::new(0.0, FRAC_1_SQRT_2 * channel.kx.signum()),
                    ),
                ],
            };
            let vectors = [
                (-sin, cos, -kz * sin, kz * cos),
                (
                    kz / self.n * cos,
                    kz / self.n * sin,
                    self.n * cos,
                    self.n * sin,
                ),
            ];
            for (pol, (ex, ey, hy, hx)) in vectors.into_iter().enumerate() {
                let column = 2 * number + pol;
                for &(place, part) in &parts {
                    e[(row(place), column)] = part * ex;
                    e[(row(count + place), column)] = part * Complex64::I * ey;
                    h[(row(place), column)] = -part * Complex64::I * hy;
                    h[(row(count + place), column)] = part * hx;
                }
            }
        }
        (e, h)
    }
}

/// Upward waves have the E of downward ones in s and the H in p, and the other reversed.
fn upward(number: usize) -> f64 {
    if number.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// The relation among the orders that propagate: e (top) and h (bottom) by v = h + α e (top) and u = e (bottom).
struct Reactance {
    alpha: f64,
    k: RMat,
}

/// With the first α that is not near a pole.
fn reactance(state: &State<f64>, top: &HalfSpace<'_>) -> Reactance {
    let mut found = relation(state, top, 0.0);
    for &alpha in <f64 as Coordinates>::SUMS {
        if is_bounded(&found.k, LARGEST) {
            break;
        }
        found = relation(state, top, alpha);
    }
    found
}

/// With a given α, of a state below the top half-space, in the coordinates of the harmonics.
fn relation(state: &State<f64>, top: &HalfSpace<'_>, alpha: f64) -> Reactance {
    let open = top.open();
    let from_below = state.electric_by_below.nrows();
    let size = state.electric.nrows();
    let closed = top.decaying(-1.0);
    // A decaying field is orthogonal, in e₁h₂ - e₂h₁, to the decaying waves themselves: those equations match it.
    let matched = |e: &RMat, h: &RMat, row: usize, wave: usize| -> f64 {
        let elements = &closed[wave];
        elements
            .iter()
            .map(|&(column, we, wh)| e[(row, column)] * wh - h[(row, column)] * we)
            .sum()
    };
    let prescribed = |e: &RMat, h: &RMat, row: usize, i: usize| -> f64 {
        if i < open.len() {
            h[(row, open[i])] + alpha * e[(row, open[i])]
        } else {
            matched(e, h, row, i - open.len())
        }
    };
    let equations: RMat = Mat::from_fn(size, size, |i, t| {
        prescribed(&state.electric, &state.magnetic, t, i)
    });
    // t by v, then t by u.
    let mut t: RMat = Mat::from_fn(size, open.len() + from_below, |i, j| {
        if j < open.len() {
            if i == j { 1.0 } else { 0.0 }
        } else {
            let u = j - open.len();
            -prescribed(&state.electric_by_below, &state.magnetic_by_below, u, i)
        }
    });
    Lu::new(&equations).solve(t.as_mut());
    let reads: RMat = Mat::from_fn(open.len() + from_below, size, |i, t| {
        if i < open.len() {
            state.electric[(t, open[i])]
        } else {
            state.transmitted[(t, i - open.len())]
        }
    });
    let mut k: RMat = Mat::from_fn(reads.nrows(), t.ncols(), |i, j| {
        match (i.checked_sub(open.len()), j.checked_sub(open.len())) {
            (_, None) => 0.0,
            (None, Some(u)) => state.electric_by_below[(u, open[i])],
            (Some(o), Some(u)) => state.reflected_below[(u, o)],
        }
    });
    product(k.as_mut(), Onto::Add, 1.0, reads.as_ref(), t.as_ref());
    Reactance { alpha, k }
}

/// The scattering matrix among channels: outgoing by incoming amplitudes, those of the top first.
pub(crate) fn close(
    state: &State<f64>,
    bloch: Bloch,
    (top, above): (&HalfSpace<'_>, &[Channel]),
    (bottom, below): (&HalfSpace<'_>, &[Channel]),
) -> CMat {
    let Reactance { alpha, k } = reactance(state, top);
    let (top_e, top_h) = top.waves(bloch, above);
    let (bottom_e, bottom_h) = bottom.waves(bloch, below);
    let (rows, size) = (top_e.nrows(), k.nrows());
    let (over, under) = (top_e.ncols(), bottom_e.ncols());
    // Fields of each wave: x = (v, u) and y = (e at the top, h at the bottom); K x - y = 0.
    let wave = |column: usize, outgoing: bool| -> (Vec<Complex64>, Vec<Complex64>) {
        let zeros = || vec![Complex64::ZERO; size];
        let (mut x, mut y) = (zeros(), zeros());
        if column < over {
            // Outgoing is upward.
            let (by_e, by_h) = if outgoing {
                (upward(column), -upward(column))
            } else {
                (1.0, 1.0)
            };
            for row in 0..rows {
                y[row] = top_e[(row, column)] * by_e;
                x[row] = top_h[(row, column)] * by_h + alpha * y[row];
            }
        } else {
            let column = column - over;
            let (by_e, by_h) = if outgoing {
                (1.0, 1.0)
            } else {
                (upward(column), -upward(column))
            };
            for row in 0..size - rows {
                x[rows + row] = bottom_e[(row, column)] * by_e;
                y[rows + row] = bottom_h[(row, column)] * by_h;
            }
        }
        (x, y)
    };
    let residuals = |outgoing: bool| -> CMat {
        let (mut real, mut imaginary): (RMat, RMat) = (
            Mat::zeros(size, over + under),
            Mat::zeros(size, over + under),
        );
        let mut y: CMat = Mat::zeros(size, over + under);
        for column in 0..over + under {
            let (xs, ys) = wave(column, outgoing);
            for row in 0..size {
                (real[(row, column)], imaginary[(row, column)]) = (xs[row].re, xs[row].im);
                y[(row, column)] = ys[row];
            }
        }
        let (real, imaginary) = (
            crate::linalg::mul(&k, &real),
            crate::linalg::mul(&k, &imaginary),
        );
        Mat::from_fn(size, over + under, |i, j| {
            Complex64::new(real[(i, j)], imaginary[(i, j)]) - y[(i, j)]
        })
    };
    let incoming = residuals(false);
    let mut scattering: CMat = Mat::from_fn(size, over + under, |i, j| -incoming[(i, j)]);
    Lu::new(&residuals(true)).solve(scattering.as_mut());
    scattering
}
