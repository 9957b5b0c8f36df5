// SPDX-License-Identifier: MIT OR Apache-2.0
//! The fields at one plane as a function of parameters t and of light u from below (3.1).
//!
//! Matrices are kept transposed, a row for each parameter and a column for each coordinate, since
//! every step is then a product from the right and a solve from the left. Columns hold first the
//! LSM coordinates (ex or hy), then the LSE coordinates (ey or hx): N of each, unless parities are
//! solved apart.

use super::interface::InterfaceMatrices;
use crate::linalg::{Accum, Scalar, product};
use crate::orders::{Bloch, Channel, half_space_kz, tangent};
use faer::Mat;
use faer::prelude::ReborrowMut;
use num_complex::Complex64;

/// The kind of parameters t.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parameters {
    /// h = t whatever u: `magnetic` is the identity, `magnetic_by_below` is 0, and neither is read.
    Magnetic,
    /// Anything else.
    General,
}

/// Fields and outgoing waves; all matrices transposed.
#[derive(Clone, Debug)]
pub(crate) struct State<T = Complex64> {
    /// y component of the wavevector.
    pub(crate) ky: f64,
    /// The kind of t.
    pub(crate) parameters: Parameters,
    /// Exponent by which fields may have grown apart since t was chosen.
    pub(crate) growth: f64,
    /// Electric coordinates by t, (2N, 2N).
    pub(crate) electric: Mat<T>,
    /// Magnetic coordinates by t, (2N, 2N).
    pub(crate) magnetic: Mat<T>,
    /// Electric coordinates by u, (u, 2N).
    pub(crate) electric_by_below: Mat<T>,
    /// Magnetic coordinates by u, (u, 2N).
    pub(crate) magnetic_by_below: Mat<T>,
    /// Outgoing amplitudes at the bottom by t, (2N, outgoing).
    pub(crate) transmitted: Mat<T>,
    /// Outgoing amplitudes at the bottom by u, (u, outgoing).
    pub(crate) reflected_below: Mat<T>,
    /// Scratch memory.
    pub(crate) scratch: Scratch<T>,
}

/// Scratch matrices, so that a step allocates nothing.
#[derive(Clone, Debug)]
pub(crate) struct Scratch<T = Complex64> {
    /// (2N, 2N) each.
    pub(crate) squares: [Mat<T>; 2],
    /// (u, 2N).
    pub(crate) by_below: Mat<T>,
    /// (2N, outgoing).
    pub(crate) outgoing: Mat<T>,
}

impl<T: Scalar> Scratch<T> {
    pub(crate) fn new(size: usize, by_below: usize, outgoing: usize) -> Self {
        Self {
            squares: [Mat::zeros(size, size), Mat::zeros(size, size)],
            by_below: Mat::zeros(by_below, size),
            outgoing: Mat::zeros(size, outgoing),
        }
    }
}

impl State {
    /// Just above the bottom half-space of index `n`, in [`crate::modes::Basis::fourier`]
    /// coordinates; t are the amplitudes of all downward waves, u those of the upward channels, in
    /// the order (channel, s then p); outgoing amplitudes are those of all `channels`.
    ///
    /// s: E = s, H = -kz k∥/|k∥| downward; p: E = (kz/n) k∥/|k∥|, H = n s; upward waves have kz
    /// reversed.
    pub(crate) fn at_bottom(n: Complex64, kx: &[f64], bloch: Bloch, channels: &[Channel]) -> Self {
        let kz = half_space_kz(n, kx, bloch.ky);
        let orders = kx.len();
        let mut electric = Mat::zeros(2 * orders, 2 * orders);
        let mut magnetic = Mat::zeros(2 * orders, 2 * orders);
        for m in 0..orders {
            let (cos, sin) = tangent(kx[m], bloch);
            let (s, p) = (2 * m, 2 * m + 1);
            let (lsm, lse) = (m, orders + m);
            electric[(s, lsm)] = (-sin).into();
            electric[(s, lse)] = cos.into();
            magnetic[(s, lsm)] = -kz[m] * sin;
            magnetic[(s, lse)] = kz[m] * cos;
            electric[(p, lsm)] = kz[m] / n * cos;
            electric[(p, lse)] = kz[m] / n * sin;
            magnetic[(p, lsm)] = n * cos;
            magnetic[(p, lse)] = n * sin;
        }
        let first = -((orders - 1) as i32 / 2);
        let row = |u: usize| 2 * (channels[u / 2].order - first) as usize + u % 2;
        let outgoing = 2 * channels.len();
        // An absorbing half-space sends no light.
        let incoming = if n.im == 0.0 { outgoing } else { 0 };
        // Upward: s keeps E and reverses H, p reverses E and keeps H.
        let sign = |u: usize| if u.is_multiple_of(2) { 1.0 } else { -1.0 };
        Self {
            ky: bloch.ky,
            parameters: Parameters::General,
            growth: 0.0,
            electric_by_below: Mat::from_fn(incoming, 2 * orders, |u, c| {
                electric[(row(u), c)] * sign(u)
            }),
            magnetic_by_below: Mat::from_fn(incoming, 2 * orders, |u, c| {
                magnetic[(row(u), c)] * -sign(u)
            }),
            transmitted: Mat::from_fn(2 * orders, outgoing, |t, o| {
                if t == row(o) { Complex64::ONE } else { Complex64::ZERO }
            }),
            reflected_below: Mat::zeros(incoming, outgoing),
            scratch: Scratch::new(2 * orders, incoming, outgoing),
            electric,
            magnetic,
        }
    }
}

impl<T: Scalar> State<T> {
    /// Fills `magnetic` where the parameters are the magnetic coordinates.
    pub(crate) fn make_explicit(&mut self) {
        if self.parameters == Parameters::Magnetic {
            self.magnetic.fill(T::ZERO);
            self.magnetic.diagonal_mut().fill(T::ONE);
            self.magnetic_by_below.fill(T::ZERO);
            self.parameters = Parameters::General;
        }
    }

    /// Changes to the coordinates above an interface (3.2).
    pub(crate) fn cross(&mut self, interface: &InterfaceMatrices<T>) {
        let ky = self.ky;
        let scratch = &mut self.scratch;
        let [square, _] = &mut scratch.squares;
        cross_electric(square, &self.electric, interface, ky);
        std::mem::swap(square, &mut self.electric);
        cross_electric(&mut scratch.by_below, &self.electric_by_below, interface, ky);
        std::mem::swap(&mut scratch.by_below, &mut self.electric_by_below);
        if self.parameters == Parameters::Magnetic {
            magnetic_blocks(&mut self.magnetic, 0, interface, ky);
            self.magnetic_by_below.fill(T::ZERO);
            self.parameters = Parameters::General;
        } else {
            cross_magnetic(square, &self.magnetic, interface, ky);
            std::mem::swap(square, &mut self.magnetic);
            cross_magnetic(&mut scratch.by_below, &self.magnetic_by_below, interface, ky);
            std::mem::swap(&mut scratch.by_below, &mut self.magnetic_by_below);
        }
    }
}

/// Writes e in the coordinates above to `out`.
fn cross_electric<T: Scalar>(
    out: &mut Mat<T>,
    e: &Mat<T>,
    interface: &InterfaceMatrices<T>,
    ky: f64,
) {
    let n = interface.electric.nrows();
    let (ex, ey) = e.as_ref().split_at_col(n);
    let (mut x, mut y) = out.as_mut().split_at_col_mut(n);
    let one = T::ONE;
    product(x.rb_mut(), Accum::Replace, one, ex, interface.electric.as_ref());
    product(y.rb_mut(), Accum::Replace, one, ey, interface.lse.as_ref());
    if ky != 0.0 {
        let coupling = interface.electric_coupling.as_ref();
        product(y, Accum::Add, one.scaled(ky), ex, coupling);
    }
}

/// Writes h in the coordinates above to `out`.
fn cross_magnetic<T: Scalar>(
    out: &mut Mat<T>,
    h: &Mat<T>,
    interface: &InterfaceMatrices<T>,
    ky: f64,
) {
    let n = interface.magnetic.nrows();
    let (hy, hx) = h.as_ref().split_at_col(n);
    let (mut y, mut x) = out.as_mut().split_at_col_mut(n);
    let one = T::ONE;
    product(y.rb_mut(), Accum::Replace, one, hy, interface.magnetic.as_ref());
    product(x.rb_mut(), Accum::Replace, one, hx, interface.lse.as_ref());
    if ky != 0.0 {
        let coupling = interface.magnetic_coupling.as_ref();
        product(y, Accum::Add, one.scaled(ky), hx, coupling);
    }
}

/// Writes to `out`, from `row` on, what [`cross_magnetic`] makes of the identity; 0 elsewhere.
pub(super) fn magnetic_blocks<T: Scalar>(
    out: &mut Mat<T>,
    row: usize,
    interface: &InterfaceMatrices<T>,
    ky: f64,
) {
    let lsm = interface.magnetic.nrows();
    out.fill(T::ZERO);
    place(out, [row, 0], &interface.magnetic, 1.0);
    place(out, [row + lsm, 0], &interface.magnetic_coupling, ky);
    place(out, [row + lsm, lsm], &interface.lse, 1.0);
}

/// Writes a matrix, scaled, into a larger one, from a row and a column on.
pub(super) fn place<T: Scalar>(to: &mut Mat<T>, [row, column]: [usize; 2], from: &Mat<T>, by: f64) {
    for j in 0..from.ncols() {
        let target = &mut to.col_as_slice_mut(column + j)[row..row + from.nrows()];
        for (to, from) in target.iter_mut().zip(from.col_as_slice(j)) {
            *to = from.scaled(by);
        }
    }
}
