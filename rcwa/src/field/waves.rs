// SPDX-License-Identifier: MIT OR Apache-2.0
//! The plane waves of the half-spaces, and the tangential Fourier coefficients of one field on a
//! plane.

use super::Incident;
use super::slab::Tangential;
use crate::linalg::CMat;
use crate::orders::{Bloch, Channel, Truncation, half_space_kz, tangent, wavevectors};
use crate::stack::Stack;
use crate::wave::Side;
use faer::Mat;
use num_complex::Complex64;

/// Wavevectors of all orders, and the frames of s and p.
pub(super) struct Waves {
    pub(super) kx: Vec<f64>,
    pub(super) ky: f64,
    /// Indices of the half-spaces, top first.
    pub(super) index: [Complex64; 2],
    /// kz of every order in the half-spaces.
    pub(super) kz: [Vec<Complex64>; 2],
    /// Unit vector (cos, sin) along the tangential wavevector.
    pub(super) frame: Vec<(f64, f64)>,
    lowest: i32,
}

impl Waves {
    pub(super) fn new(stack: &Stack, bloch: Bloch, truncation: Truncation) -> Self {
        let kx = wavevectors(bloch, stack.period_per_wavelength(), truncation);
        let index = Side::BOTH.map(|side| stack.index(side));
        Self {
            ky: bloch.ky,
            kz: index.map(|n| half_space_kz(n, &kx, bloch.ky)),
            frame: kx.iter().map(|&k| tangent(k, bloch)).collect(),
            index,
            kx,
            lowest: -(truncation.highest() as i32),
        }
    }

    pub(super) fn position(&self, order: i32) -> usize {
        (order - self.lowest) as usize
    }

    /// Coefficients of the incident wave on the first plane: s has E = s and H = kz k∥/|k∥|, p has
    /// E = (kz/n) k∥/|k∥| and H = n s.
    pub(super) fn incoming(&self, incident: &Incident) -> Tangential {
        let m = self.position(incident.order);
        let ((cos, sin), n, kz) = (self.frame[m], self.index[0], self.kz[0][m]);
        let [s, p] = incident.amplitudes;
        let at = |value: Complex64| -> CMat {
            let mut all: CMat = Mat::zeros(self.kx.len(), 1);
            all[(m, 0)] = value;
            all
        };
        // In (Ex, Ey) and (Hy, -Hx) the magnetic vectors look like the electric ones.
        let (along, across) = (p * kz / n, p * n);
        Tangential {
            ex: at(along * cos - s * sin),
            ey: at(along * sin + s * cos),
            hy: at(across * cos - s * kz * sin),
            hx: at(across * sin + s * kz * cos),
        }
    }

    /// Amplitudes (s, p) of the upward waves of the open channels at the first plane, as power.
    pub(super) fn upward_power(
        &self,
        open: &[Channel],
        incident: &Incident,
        top: &Tangential,
    ) -> f64 {
        let power = |channel: &Channel| {
            let m = self.position(channel.order);
            let (cos, sin) = self.frame[m];
            let [mut s, mut p] = [
                top.ey[(m, 0)] * cos - top.ex[(m, 0)] * sin,
                (top.hy[(m, 0)] * cos + top.hx[(m, 0)] * sin) / self.index[0],
            ];
            if channel.order == incident.order {
                // The incident wave has E·s = a_s and H·s = n a_p.
                s -= incident.amplitudes[0];
                p -= incident.amplitudes[1];
            }
            channel.kz.re * (s.norm_sqr() + p.norm_sqr())
        };
        open.iter().map(power).sum()
    }
}

/// Of one field, in a single column.
impl Tangential {
    /// Downward power through the plane, in units in which a wave of unit amplitude carries kz.
    pub(super) fn power(&self) -> f64 {
        let of = |e: &CMat, h: &CMat| -> f64 {
            e.col_as_slice(0).iter().zip(h.col_as_slice(0)).map(|(e, h)| (e.conj() * h).re).sum()
        };
        of(&self.ex, &self.hy) + of(&self.ey, &self.hx)
    }

    /// From N and t.
    pub(super) fn from_state(state: &CMat, t: &[Complex64]) -> Self {
        let n = t.len() / 2;
        let e: Vec<Complex64> =
            (0..2 * n).map(|i| (0..2 * n).map(|j| state[(i, j)] * t[j]).sum()).collect();
        let h: Vec<Complex64> = t.iter().zip(&e).map(|(t, e)| t - e).collect();
        let column = |v: &[Complex64]| Mat::from_fn(n, 1, |i, _| v[i]);
        Self { ex: column(&e[..n]), ey: column(&e[n..]), hy: column(&h[..n]), hx: column(&h[n..]) }
    }

    /// t.
    pub(super) fn sum(&self) -> Vec<Complex64> {
        let pairs = [(&self.ex, &self.hy), (&self.ey, &self.hx)];
        let rows = pairs.map(|(e, h)| e.col_as_slice(0).iter().zip(h.col_as_slice(0)));
        rows.into_iter().flatten().map(|(e, h)| e + h).collect()
    }
}
