// SPDX-License-Identifier: MIT OR Apache-2.0
//! The fields at one plane as a function of the parameters t and of the light u from below; see [`super`].
//!
//! Matrices are kept transposed (a row for each parameter, a column for each coordinate), since every step then is a
//! product from the right and a solve from the left. Columns: 0..N are the LSM coordinates (ex or hy), N..2N the LSE
//! coordinates (ey or hx).

use super::interface::Interface;
use crate::linalg::{CMat, Into, product};
use crate::orders::{Bloch, Channel, tangent};
use faer::Mat;
use num_complex::Complex64;

/// Whether the parameters t are the magnetic coordinates themselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parameters {
    /// h = t whatever u: `magnetic` is the identity, `magnetic_by_below` is 0, and neither is read.
    Magnetic,
    /// Anything else.
    General,
}

/// Fields and outgoing waves; all matrices transposed.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// y component of the wavevector.
    pub(crate) ky: f64,
    /// What t is.
    pub(crate) parameters: Parameters,
    /// Electric coordinates by t, (2N, 2N).
    pub(crate) electric: CMat,
    /// Magnetic coordinates by t, (2N, 2N).
    pub(crate) magnetic: CMat,
    /// Electric coordinates by u, (u, 2N).
    pub(crate) electric_by_below: CMat,
    /// Magnetic coordinates by u, (u, 2N).
    pub(crate) magnetic_by_below: CMat,
    /// Outgoing amplitudes at the bottom by t, (2N, outgoing).
    pub(crate) transmitted: CMat,
    /// Outgoing amplitudes at the bottom by u, (u, outgoing).
    pub(crate) reflected_below: CMat,
}

impl State {
    /// Just above the bottom half-space of index `n`, in [`crate::modes::Basis::fourier`] coordinates; t are the
    /// amplitudes of all downward waves, u those of the upward channels, in the order (channel, s then p); outgoing amplitudes are those of all `channels`.
    ///
    /// s: E = s, H = -kz k∥/|k∥| downward; p: E = (kz/n) k∥/|k∥|, H = n s; upward waves have kz reversed.
    pub(crate) fn at_bottom(
        n: Complex64,
        kx: &[f64],
        kz: &[Complex64],
        bloch: Bloch,
        channels: &[Channel],
    ) -> Self {
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
            electric_by_below: Mat::from_fn(incoming, 2 * orders, |u, c| {
                electric[(row(u), c)] * sign(u)
            }),
            magnetic_by_below: Mat::from_fn(incoming, 2 * orders, |u, c| {
                magnetic[(row(u), c)] * -sign(u)
            }),
            transmitted: Mat::from_fn(2 * orders, outgoing, |t, o| {
                if t == row(o) {
                    Complex64::ONE
                } else {
                    Complex64::ZERO
                }
            }),
            reflected_below: Mat::zeros(incoming, outgoing),
            electric,
            magnetic,
        }
    }

    /// Writes out `magnetic` where the parameters are the magnetic coordinates.
    pub(crate) fn make_explicit(&mut self) {
        if self.parameters == Parameters::Magnetic {
            self.magnetic = Mat::identity(self.electric.nrows(), self.electric.ncols());
            self.parameters = Parameters::General;
        }
    }

    /// Goes over to the coordinates above an interface.
    pub(crate) fn cross(&mut self, interface: &Interface) {
        let ky = Complex64::from(self.ky);
        self.electric = cross_electric(&self.electric, interface, ky);
        self.electric_by_below = cross_electric(&self.electric_by_below, interface, ky);
        if self.parameters == Parameters::Magnetic {
            self.magnetic = magnetic_blocks(interface, ky);
            self.parameters = Parameters::General;
        } else {
            self.magnetic = cross_magnetic(&self.magnetic, interface, ky);
            self.magnetic_by_below = cross_magnetic(&self.magnetic_by_below, interface, ky);
        }
    }
}

fn cross_electric(e: &CMat, interface: &Interface, ky: Complex64) -> CMat {
    let (rows, n) = (e.nrows(), e.ncols() / 2);
    let (ex, ey) = (e.as_ref().subcols(0, n), e.as_ref().subcols(n, n));
    let mut out = Mat::zeros(rows, 2 * n);
    product(
        out.as_mut().subcols_mut(0, n),
        Into::Replace,
        Complex64::ONE,
        ex,
        interface.electric.as_ref(),
    );
    product(
        out.as_mut().subcols_mut(n, n),
        Into::Replace,
        Complex64::ONE,
        ey,
        interface.lse.as_ref(),
    );
    if ky != Complex64::ZERO {
        product(
            out.as_mut().subcols_mut(n, n),
            Into::Add,
            ky,
            ex,
            interface.electric_coupling.as_ref(),
        );
    }
    out
}

fn cross_magnetic(h: &CMat, interface: &Interface, ky: Complex64) -> CMat {
    let (rows, n) = (h.nrows(), h.ncols() / 2);
    let (hy, hx) = (h.as_ref().subcols(0, n), h.as_ref().subcols(n, n));
    let mut out = Mat::zeros(rows, 2 * n);
    product(
        out.as_mut().subcols_mut(0, n),
        Into::Replace,
        Complex64::ONE,
        hy,
        interface.magnetic.as_ref(),
    );
    product(
        out.as_mut().subcols_mut(n, n),
        Into::Replace,
        Complex64::ONE,
        hx,
        interface.lse.as_ref(),
    );
    if ky != Complex64::ZERO {
        product(
            out.as_mut().subcols_mut(0, n),
            Into::Add,
            ky,
            hx,
            interface.magnetic_coupling.as_ref(),
        );
    }
    out
}

/// What [`cross_magnetic`] makes of the identity.
fn magnetic_blocks(interface: &Interface, ky: Complex64) -> CMat {
    let n = interface.lse.nrows();
    Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => interface.magnetic[(i, j)],
        (true, false) => Complex64::ZERO,
        (false, true) => ky * interface.magnetic_coupling[(i - n, j)],
        (false, false) => interface.lse[(i - n, j - n)],
    })
}
