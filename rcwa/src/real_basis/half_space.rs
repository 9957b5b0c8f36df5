// SPDX-License-Identifier: MIT OR Apache-2.0
//! The half-spaces in real arithmetic: real fields begin at the bottom one and become orders of
//! light again.
//!
//! At the bottom an order that decays is one real wave for each function and polarisation; an order
//! that propagates leaves its E and H free. t are the amplitudes of the former and the H of the
//! latter, u the E of the latter. At the top the decaying orders are matched in real numbers, and v
//! = h + α e of those that propagate is prescribed. What is left (3.4),
//!
//! - e = K₁₁ v + K₁₂ u at the top,   h = K₂₁ v + K₂₂ u at the bottom,
//!
//! concerns orders of light alone, and is matched to incoming and outgoing waves in complex
//! numbers, for both parities together where they are solved apart.
//!
//! Along a wavevector k = (κ, ky), with γ = Im kz, D for ∂ or K and φ a function of X (s) or of Z
//! (p), the waves that decay downwards are
//!
//! - s: (ex, ey) = (-ky φ, Dφ)/k,          (hy, hx) = γ (-ky φ, Dφ)/k
//! - p: (ex, ey) = (γ/n) (-Dᵀφ, -ky φ)/k,  (hy, hx) = n (Dᵀφ, ky φ)/k

use crate::expansion::real::{FunctionKind, FunctionSet, RealFunction, RealFunctions};
use crate::expansion::{Expansion, FieldGroup};
use crate::linalg::{Accum, CMat, Lu, RMat, is_bounded, mul, product};
use crate::orders::BARELY_EVANESCENT;
use crate::orders::{Bloch, Channel, tangent};
use crate::stack::arithmetic::Arithmetic;
use crate::stack::state::{Parameters, Scratch, State};
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Largest element of a relation K that is accepted before another α is tried.
const LARGEST: f64 = 1e3;

/// Distance in units of k0 within which a channel and a function have one κ.
const SAME_KAPPA: f64 = 1e-9;

/// A half-space at one ky.
pub(crate) struct HalfSpace<'a> {
    functions: &'a RealFunctions,
    n: f64,
    ky: f64,
}

impl<'a> HalfSpace<'a> {
    pub(crate) fn new(functions: &'a RealFunctions, n: f64, ky: f64) -> Self {
        Self { functions, n, ky }
    }

    fn kz_squared(&self, wave: &RealFunction) -> f64 {
        self.n * self.n - wave.kappa * wave.kappa - self.ky * self.ky
    }

    /// Number of coordinates.
    fn size(&self) -> usize {
        self.functions.count(FieldGroup::X) + self.functions.count(FieldGroup::Z)
    }

    /// Columns of the coordinates (ex and ey, or hy and hx) of the orders that propagate,
    /// ascending.
    fn propagating(&self) -> Vec<usize> {
        let [x, z] =
            [FieldGroup::X, FieldGroup::Z].map(|field| self.functions.functions_of(field).iter());
        let all = x.chain(z).enumerate();
        all.filter(|(_, wave)| self.kz_squared(wave) > 0.0).map(|(column, _)| column).collect()
    }

    /// The functions of orders that decay: place, |(κ, ky)| and γ.
    fn evanescent(&self, field: FieldGroup) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let waves = self.functions.functions_of(field).iter().enumerate();
        waves.filter_map(|(place, wave)| {
            let kz_squared = self.kz_squared(wave);
            let gamma = (-kz_squared).max(0.0).sqrt().max(BARELY_EVANESCENT.im);
            (kz_squared <= 0.0).then(|| (place, wave.kappa.hypot(self.ky), gamma))
        })
    }

    /// Waves that decay: for each a list of (column, e, h); `sign` 1 downwards, -1 upwards.
    fn decaying(&self, sign: f64) -> Vec<Vec<(usize, f64, f64)>> {
        let (n, ky, functions) = (self.n, self.ky, self.functions);
        let count = functions.count(FieldGroup::X);
        let s = self.evanescent(FieldGroup::X).map(|(place, k, gamma)| {
            let slope = functions.slope(place);
            let slope = slope.map(|(to, d)| (count + to, d / k, gamma * sign * d / k));
            std::iter::once((place, -ky / k, -gamma * sign * ky / k)).chain(slope).collect()
        });
        let p = self.evanescent(FieldGroup::Z).map(|(place, k, gamma)| {
            let slope = functions.slope_to(place);
            let slope = slope.map(|(from, d)| (from, -sign * gamma / n * d / k, n * d / k));
            std::iter::once((count + place, -sign * gamma / n * ky / k, n * ky / k))
                .chain(slope)
                .collect()
        });
        s.chain(p).collect()
    }

    /// Just above the bottom half-space.
    pub(crate) fn at_bottom(&self) -> State<f64> {
        let size = self.size();
        let open = self.propagating();
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
            scratch: Scratch::new(size, open.len(), open.len()),
            electric,
            magnetic,
        }
    }

    /// Fields (by open column) of a wave of unit amplitude in each channel, s then p, downwards: e
    /// and h.
    fn waves(&self, bloch: Bloch, channels: &[Channel]) -> (CMat, CMat) {
        let open = self.propagating();
        let mut e: CMat = Mat::zeros(open.len(), 2 * channels.len());
        let mut h = e.clone();
        let count = self.functions.count(FieldGroup::X);
        let row = |column: usize| open.partition_point(|&c| c < column);
        let (one, i) = (Complex64::ONE, Complex64::I);
        // Ey = -i ey, Hy = i hy of standing waves; H = i h of orders.
        let [ey, hx] = match self.functions.kind {
            FunctionSet::Standing | FunctionSet::Parity => [i, one],
            FunctionSet::FourierOrders => [one, -i],
        };
        for (number, channel) in channels.iter().enumerate() {
            let (cos, sin) = tangent(channel.kx, bloch);
            let kz = channel.kz.re;
            let vectors = [
                (-sin, cos, -kz * sin, kz * cos),
                (kz / self.n * cos, kz / self.n * sin, self.n * cos, self.n * sin),
            ];
            for (place, part) in self.parts(FieldGroup::X, channel.kx) {
                let row = row(place);
                for (pol, vector) in vectors.iter().enumerate() {
                    e[(row, 2 * number + pol)] = part * vector.0;
                    h[(row, 2 * number + pol)] = part * -i * vector.2;
                }
            }
            for (place, part) in self.parts(FieldGroup::Z, channel.kx) {
                let row = row(count + place);
                for (pol, vector) in vectors.iter().enumerate() {
                    e[(row, 2 * number + pol)] = part * ey * vector.1;
                    h[(row, 2 * number + pol)] = part * hx * vector.3;
                }
            }
        }
        (e, h)
    }

    /// exp(i kx x) by the functions of a group, but for a factor that all orders of the line have.
    fn parts(&self, field: FieldGroup, kx: f64) -> impl Iterator<Item = (usize, Complex64)> + '_ {
        let waves = self.functions.functions_of(field).iter().enumerate();
        waves.filter_map(move |(place, wave)| {
            let is_order = wave.shape == FunctionKind::Order;
            let kappa = if is_order { kx } else { kx.abs() };
            if (wave.kappa - kappa).abs() > SAME_KAPPA {
                return None;
            }
            let sign = if is_order { 1.0 } else { kx.signum() };
            let part = match wave.shape {
                FunctionKind::Order => Complex64::ONE,
                FunctionKind::Cosine if wave.periods() == 0.0 => Complex64::ONE,
                // exp(iκx) = (√2cos + i √2sin)/√2.
                FunctionKind::Cosine => FRAC_1_SQRT_2.into(),
                FunctionKind::Sine => Complex64::new(0.0, sign * FRAC_1_SQRT_2),
            };
            let phase = TAU * sign * wave.periods() * self.functions.origin;
            Some((place, part * Complex64::cis(phase)))
        })
    }
}

/// Upward waves have the E of downward ones in s and the H in p, and the other reversed.
fn upward(number: usize) -> f64 {
    if number.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// The relation among the orders that propagate: e (top) and h (bottom) by v = h + α e (top) and u
/// = e (bottom).
struct Reactance {
    alpha: f64,
    k: RMat,
}

/// With the first α that is not near a pole.
fn reactance(state: &State<f64>, top: &HalfSpace<'_>) -> Reactance {
    let mut found = relation(state, top, 0.0);
    for &alpha in <f64 as Arithmetic>::SUMS {
        if is_bounded(&found.k, LARGEST) {
            break;
        }
        found = relation(state, top, alpha);
    }
    found
}

/// With a given α, of a state below the top half-space, in the functions of the line.
fn relation(state: &State<f64>, top: &HalfSpace<'_>, alpha: f64) -> Reactance {
    let open = top.propagating();
    let from_below = state.electric_by_below.nrows();
    let size = state.electric.nrows();
    let closed = top.decaying(-1.0);
    // A decaying field is orthogonal, in e₁h₂ - e₂h₁, to the decaying waves themselves: those
    // equations match it.
    let matched = |e: &RMat, h: &RMat, row: usize, wave: usize| -> f64 {
        let elements = &closed[wave];
        elements.iter().map(|&(column, we, wh)| e[(row, column)] * wh - h[(row, column)] * we).sum()
    };
    let prescribed = |e: &RMat, h: &RMat, row: usize, i: usize| -> f64 {
        if i < open.len() {
            h[(row, open[i])] + alpha * e[(row, open[i])]
        } else {
            matched(e, h, row, i - open.len())
        }
    };
    let equations: RMat =
        Mat::from_fn(size, size, |i, t| prescribed(&state.electric, &state.magnetic, t, i));
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
    product(k.as_mut(), Accum::Add, 1.0, reads.as_ref(), t.as_ref());
    Reactance { alpha, k }
}

/// The fields below the top half-space in one part of the basis, and both half-spaces.
pub(crate) struct PartFields<'a> {
    pub(crate) state: &'a State<f64>,
    pub(crate) top: HalfSpace<'a>,
    pub(crate) bottom: HalfSpace<'a>,
}

/// The scattering matrix among channels: outgoing by incoming amplitudes, those of the top first.
/// The parts together have all functions.
pub(crate) fn match_half_spaces(
    parts: &[PartFields<'_>],
    bloch: Bloch,
    above: &[Channel],
    below: &[Channel],
) -> CMat {
    let size = 2 * (above.len() + below.len());
    let mut scattering: CMat = Mat::zeros(size, size);
    let mut outgoing = scattering.clone();
    let mut from = 0;
    for part in parts {
        let [incoming_part, outgoing_part] = residuals(part, bloch, above, below);
        for j in 0..size {
            for i in 0..incoming_part.nrows() {
                scattering[(from + i, j)] = -incoming_part[(i, j)];
                outgoing[(from + i, j)] = outgoing_part[(i, j)];
            }
        }
        from += incoming_part.nrows();
    }
    Lu::new(&outgoing).solve(scattering.as_mut());
    scattering
}

/// Residuals of incoming and outgoing waves in the relation K x = y of a part, with x = (v, u) and
/// y = (e at the top, h at the bottom).
fn residuals(
    part: &PartFields<'_>,
    bloch: Bloch,
    above: &[Channel],
    below: &[Channel],
) -> [CMat; 2] {
    let Reactance { alpha, k } = reactance(part.state, &part.top);
    let (top_e, top_h) = part.top.waves(bloch, above);
    let (bottom_e, bottom_h) = part.bottom.waves(bloch, below);
    let (rows, size) = (top_e.nrows(), k.nrows());
    let (over, under) = (top_e.ncols(), bottom_e.ncols());
    // Fields of each wave.
    let wave = |column: usize, outgoing: bool| -> (Vec<Complex64>, Vec<Complex64>) {
        let zeros = || vec![Complex64::ZERO; size];
        let (mut x, mut y) = (zeros(), zeros());
        if column < over {
            // Outgoing is upward.
            let (by_e, by_h) =
                if outgoing { (upward(column), -upward(column)) } else { (1.0, 1.0) };
            for row in 0..rows {
                y[row] = top_e[(row, column)] * by_e;
                x[row] = top_h[(row, column)] * by_h + alpha * y[row];
            }
        } else {
            let column = column - over;
            let (by_e, by_h) =
                if outgoing { (1.0, 1.0) } else { (upward(column), -upward(column)) };
            for row in 0..size - rows {
                x[rows + row] = bottom_e[(row, column)] * by_e;
                y[rows + row] = bottom_h[(row, column)] * by_h;
            }
        }
        (x, y)
    };
    [false, true].map(|outgoing| {
        let (mut real, mut imaginary): (RMat, RMat) =
            (Mat::zeros(size, over + under), Mat::zeros(size, over + under));
        let mut y: CMat = Mat::zeros(size, over + under);
        for column in 0..over + under {
            let (xs, ys) = wave(column, outgoing);
            for row in 0..size {
                (real[(row, column)], imaginary[(row, column)]) = (xs[row].re, xs[row].im);
                y[(row, column)] = ys[row];
            }
        }
        let (real, imaginary) = (mul(&k, &real), mul(&k, &imaginary));
        Mat::from_fn(size, over + under, |i, j| {
            Complex64::new(real[(i, j)], imaginary[(i, j)]) - y[(i, j)]
        })
    })
}
