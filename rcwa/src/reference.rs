// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe of rigorous coupled-wave analysis on one screen.
//!
//! Nothing here is fast: everything else in this crate gives the same numbers sooner, and tests
//! hold it against this file. In: a [`Stack`] of layers with vertical walls, a Bloch wavevector, a
//! truncation. Out: the efficiency of every order for light of any order from either side.
//!
//! Lengths are times k0, H is scaled by the impedance of free space, fields vary as exp(-iωt), so
//! that ∇×E = iH and ∇×H = -iεE. Each field is a vector of Fourier coefficients over the orders m of
//! kx_m = kx0 + m λ/Λ; K = diag(kx_m), and primes are derivatives along z.
//!
//! 1. Fourier coefficients of a layer: c_n = ∫ ε(x) exp(-2πinx) dx over one period, in closed form.
//! 2. Li's rules \[Li1996a\]: εEy and εEz are products of functions that do not jump together, by the
//!    Toeplitz matrix E of ε; εEx is continuous where ε and Ex jump, and takes the inverse of the
//!    Toeplitz matrix A of 1/ε.
//! 3. Without Ez = E⁻¹(ky Hx - K Hy) and Hz = K Ey - ky Ex, Maxwell's equations for e = (Ex, Ey) and
//!    h = (Hy, -Hx) read e' = iPh, h' = iQe with
//!    P = [1 - K E⁻¹K, -ky K E⁻¹; -ky E⁻¹K, 1 - ky² E⁻¹] and Q = [A⁻¹ - ky², ky K; ky K, E - K²].
//! 4. Eigenmodes: P Q w = kz² w, e = w exp(±ikz z), h = ±v exp(±ikz z), v = Q w/kz, with the root
//!    kz of a wave that leaves.
//! 5. Amplitudes a± and b± on the two sides of an interface: with X = W_a⁻¹W_b and Y = V_a⁻¹V_b,
//!    a± = ½(X + Y) b± + ½(X - Y) b∓.
//! 6. S-matrices \[Li1996b\], outgoing from incoming amplitudes, joined from the top down; a thickness
//!    d multiplies by exp(ikz d), which never grows.
//! 7. Efficiency of an order: its power through z = const over that of the incident wave.

use crate::error::Error;
use crate::linalg::{CMat, delta, eigen_general, inverse, mul};
use crate::orders::{Bloch, Channel, Truncation};
use crate::orders::{channels, half_space_kz, outgoing_kz, tangent, wavevectors};
use crate::relief::Segment;
use crate::stack::Stack;
use crate::wave::{Pol, Side};
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Modes of a layer or a half-space: columns of W and V, and kz.
struct Modes {
    w: CMat,
    v: CMat,
    kz: Vec<Complex64>,
}

/// Outgoing by incoming amplitudes: reflected at the top, from bottom to top, from top to bottom,
/// reflected at the bottom.
struct SMatrix {
    r_top: CMat,
    up: CMat,
    down: CMat,
    r_bottom: CMat,
}

/// Solution of one Bloch wavevector.
pub struct Reference {
    s: SMatrix,
    highest: i32,
    bloch: Bloch,
    indices: [Complex64; 2],
    channels: [Vec<Channel>; 2],
}

/// Toeplitz matrix of a function of the index of a layer (steps 1 and 2).
fn toeplitz(segments: &[Segment], n: usize, value: fn(Complex64) -> Complex64) -> CMat {
    let coefficient = |order: f64| -> Complex64 {
        let primitive = |x: f64| {
            if order == 0.0 {
                Complex64::from(x)
            } else {
                Complex64::cis(-TAU * order * x) / Complex64::new(0.0, -TAU * order)
            }
        };
        segments.iter().map(|s| value(s.index) * (primitive(s.x1) - primitive(s.x0))).sum()
    };
    Mat::from_fn(n, n, |i, j| coefficient(i as f64 - j as f64))
}

/// P and Q of step 3.
fn maxwell(segments: &[Segment], kx: &[f64], ky: f64) -> [CMat; 2] {
    let n = kx.len();
    let e = toeplitz(segments, n, |index| index * index);
    let e_inverse = inverse(&e);
    let a_inverse = inverse(&toeplitz(segments, n, |index| (index * index).inv()));
    let blocks = |block: &dyn Fn(usize, usize, usize, usize) -> Complex64| -> CMat {
        Mat::from_fn(2 * n, 2 * n, |i, j| block(i / n, j / n, i % n, j % n))
    };
    let p = blocks(&|row, column, i, j| {
        let k = |of_row: usize, m: usize| if of_row == 0 { kx[m] } else { ky };
        delta::<Complex64>(row * n + i, column * n + j)
            - k(row, i) * e_inverse[(i, j)] * k(column, j)
    });
    let q = blocks(&|row, column, i, j| match (row, column) {
        (0, 0) => a_inverse[(i, j)] - delta::<Complex64>(i, j) * ky * ky,
        (1, 1) => e[(i, j)] - delta::<Complex64>(i, j) * kx[i] * kx[i],
        _ => delta::<Complex64>(i, j) * ky * kx[i],
    });
    [p, q]
}

/// Modes of a layer (step 4).
fn layer_modes(segments: &[Segment], kx: &[f64], ky: f64) -> Result<Modes, Error> {
    let [p, q] = maxwell(segments, kx, ky);
    let (kz_squared, w) = eigen_general(&mul(&p, &q))?;
    let kz: Vec<Complex64> = kz_squared.into_iter().map(outgoing_kz).collect();
    let qw = mul(&q, &w);
    let v = Mat::from_fn(w.nrows(), w.ncols(), |i, j| qw[(i, j)] / kz[j]);
    Ok(Modes { w, v, kz })
}

/// Plane waves of a half-space: W = 1.
fn half_space_modes(index: Complex64, kx: &[f64], ky: f64) -> Modes {
    let n = kx.len();
    let uniform = [Segment { x0: 0.0, x1: 1.0, index }];
    let [_, q] = maxwell(&uniform, kx, ky);
    let kz = half_space_kz(index, kx, ky);
    let v = Mat::from_fn(2 * n, 2 * n, |i, j| q[(i, j)] / kz[j % n]);
    Modes { w: Mat::identity(2 * n, 2 * n), v, kz: [kz.as_slice(), &kz].concat() }
}

impl SMatrix {
    /// Nothing: all light passes.
    fn nothing(size: usize) -> Self {
        let (zero, one) = (|| Mat::zeros(size, size), || Mat::identity(size, size));
        Self { r_top: zero(), up: one(), down: one(), r_bottom: zero() }
    }

    /// An interface between modes a above and b below (step 5).
    fn interface(a: &Modes, b: &Modes) -> Self {
        let (x, y) = (mul(&inverse(&a.w), &b.w), mul(&inverse(&a.v), &b.v));
        let (same, other): (CMat, CMat) =
            ((&x + &y) * faer::Scale(0.5.into()), (&x - &y) * faer::Scale(0.5.into()));
        let down = inverse(&same);
        let r_top = mul(&other, &down);
        let r_bottom = -mul(&down, &other);
        Self { up: &same + mul(&other, &r_bottom), r_top, down, r_bottom }
    }

    /// The thickness `d` below it, passed by every mode.
    fn thickness(self, modes: &Modes, d: f64) -> Self {
        let pass = |j: usize| (Complex64::I * modes.kz[j] * d).exp();
        let n = modes.kz.len();
        let rows = |m: &CMat| -> CMat { Mat::from_fn(n, n, |i, j| pass(i) * m[(i, j)]) };
        let columns = |m: &CMat| -> CMat { Mat::from_fn(n, n, |i, j| m[(i, j)] * pass(j)) };
        Self {
            r_top: self.r_top,
            up: columns(&self.up),
            down: rows(&self.down),
            r_bottom: rows(&columns(&self.r_bottom)),
        }
    }

    /// `self` above `below`: all reflections between them summed (step 6).
    fn join(&self, below: &Self) -> Self {
        let one: CMat = Mat::identity(self.up.nrows(), self.up.nrows());
        let from_top = mul(&inverse(&(&one - mul(&self.r_bottom, &below.r_top))), &self.down);
        let from_bottom = mul(&inverse(&(&one - mul(&below.r_top, &self.r_bottom))), &below.up);
        Self {
            r_top: &self.r_top + mul(&self.up, &mul(&below.r_top, &from_top)),
            down: mul(&below.down, &from_top),
            up: mul(&self.up, &from_bottom),
            r_bottom: &below.r_bottom + mul(&below.down, &mul(&self.r_bottom, &from_bottom)),
        }
    }
}

/// Solves one Bloch wavevector by the recipe.
///
/// # Errors
/// Wavevectors that are not finite, eigenproblems that fail.
pub fn solve(stack: &Stack, bloch: Bloch, truncation: Truncation) -> Result<Reference, Error> {
    bloch.check()?;
    let ratio = stack.period_per_wavelength();
    let kx = wavevectors(bloch, ratio, truncation);
    let indices = Side::BOTH.map(|side| stack.index(side));
    let mut above = half_space_modes(indices[0], &kx, bloch.ky);
    let mut s = SMatrix::nothing(2 * kx.len());
    for layer in stack.layers() {
        let modes = layer_modes(&layer.segments, &kx, bloch.ky)?;
        let d = stack.optical_thickness(layer);
        s = s.join(&SMatrix::interface(&above, &modes)).thickness(&modes, d);
        above = modes;
    }
    s = s.join(&SMatrix::interface(&above, &half_space_modes(indices[1], &kx, bloch.ky)));
    let channels = indices.map(|n| channels(n, ratio, bloch, truncation.orders()));
    Ok(Reference { s, highest: truncation.highest() as i32, bloch, indices, channels })
}

impl Reference {
    /// Efficiency with which a wave from (side, order, polarisation) leaves in (side, order,
    /// polarisation); 0 where either does not propagate.
    pub fn efficiency(&self, from: (Side, i32, Pol), to: (Side, i32, Pol)) -> f64 {
        let find = |(side, order, _): (Side, i32, Pol)| {
            self.channels[side.number()].iter().find(|channel| channel.order == order)
        };
        let (Some(source), Some(target)) = (find(from), find(to)) else {
            return 0.0;
        };
        if self.indices[from.0.number()].im != 0.0 {
            return 0.0;
        }
        // Tangential E of a unit wave: s along (-sin, cos), p along (cos, sin) kz/n.
        let tangential = |channel: &Channel, (side, _, pol): (Side, i32, Pol)| {
            let (cos, sin) = tangent(channel.kx, self.bloch);
            let n = self.indices[side.number()];
            match pol {
                Pol::S => [Complex64::from(-sin), cos.into()],
                Pol::P => [channel.kz / n * cos, channel.kz / n * sin],
            }
        };
        let block = match (from.0, to.0) {
            (Side::Top, Side::Top) => &self.s.r_top,
            (Side::Top, Side::Bottom) => &self.s.down,
            (Side::Bottom, Side::Top) => &self.s.up,
            (Side::Bottom, Side::Bottom) => &self.s.r_bottom,
        };
        let orders = (2 * self.highest + 1) as usize;
        let place = |order: i32| (order + self.highest) as usize;
        let (i, j) = (place(to.1), place(from.1));
        let incident = tangential(source, from);
        let out = [0, 1].map(|component| {
            let row = component * orders + i;
            block[(row, j)] * incident[0] + block[(row, orders + j)] * incident[1]
        });
        // Amplitude of the wave with this tangential field: the two directions are orthogonal.
        let unit = tangential(target, to);
        let length: Complex64 = unit.iter().map(|u| u * u).sum();
        let amplitude = (out[0] * unit[0] + out[1] * unit[1]) / length;
        let flux = target.flux[to.2.number()] / source.flux[from.2.number()]; // Step 7.
        flux * amplitude.norm_sqr()
    }
}
