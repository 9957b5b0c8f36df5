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
    pub(super) fn incoming(&self, incident: &Incident) -> Coefficients {
        let m = self.position(incident.order);
        let ((cos, sin), n, kz) = (self.frame[m], self.index[0], self.kz[0][m]);
        let [s, p] = incident.amplitudes;
        let at = |value: Complex64| -> Vec<Complex64> {
            let mut all = vec![Complex64::ZERO; self.kx.len()];
            all[m] = value;
            all
        };
        // In (Ex, Ey) and (Hy, -Hx) the magnetic vectors look like the electric ones.
        let (along, across) = (p * kz / n, p * n);
        Coefficients {
            e: [at(along * cos - s * sin), at(along * sin + s * cos)],
            h: [at(across * cos - s * kz * sin), at(across * sin + s * kz * cos)],
        }
    }

    /// Amplitudes (s, p) of the upward waves of the open channels at the first plane, as power.
    pub(super) fn upward_power(
        &self,
        open: &[Channel],
        incident: &Incident,
        top: &Coefficients,
    ) -> f64 {
        let power = |channel: &Channel| {
            let m = self.position(channel.order);
            let (cos, sin) = self.frame[m];
            let [mut s, mut p] = [
                top.e[1][m] * cos - top.e[0][m] * sin,
                (top.h[0][m] * cos + top.h[1][m] * sin) / self.index[0],
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

/// Tangential coefficients of one field: e is (Ex, Ey), h is (Hy, -Hx).
#[derive(Clone, Debug)]
pub(super) struct Coefficients {
    pub(super) e: [Vec<Complex64>; 2],
    pub(super) h: [Vec<Complex64>; 2],
}

impl Coefficients {
    /// Downward power through the plane, in units in which a wave of unit amplitude carries kz.
    pub(super) fn power(&self) -> f64 {
        let of = |e: &[Complex64], h: &[Complex64]| -> f64 {
            e.iter().zip(h).map(|(e, h)| (e.conj() * h).re).sum()
        };
        of(&self.e[0], &self.h[0]) + of(&self.e[1], &self.h[1])
    }

    pub(super) fn from_tangential(fields: &Tangential) -> Self {
        let column = |m: &CMat| (0..m.nrows()).map(|i| m[(i, 0)]).collect();
        Self {
            e: [column(&fields.ex), column(&fields.ey)],
            h: [column(&fields.hy), column(&fields.hx)],
        }
    }

    pub(super) fn tangential(&self) -> Tangential {
        let column = |v: &[Complex64]| Mat::from_fn(v.len(), 1, |i, _| v[i]);
        Tangential {
            ex: column(&self.e[0]),
            ey: column(&self.e[1]),
            hy: column(&self.h[0]),
            hx: column(&self.h[1]),
        }
    }

    /// From N and t.
    pub(super) fn from_state(state: &CMat, t: &[Complex64]) -> Self {
        let n = t.len() / 2;
        let e: Vec<Complex64> =
            (0..2 * n).map(|i| (0..2 * n).map(|j| state[(i, j)] * t[j]).sum()).collect();
        let h: Vec<Complex64> = t.iter().zip(&e).map(|(t, e)| t - e).collect();
        let halves = |v: &[Complex64]| [v[..n].to_vec(), v[n..].to_vec()];
        Self { e: halves(&e), h: halves(&h) }
    }

    pub(super) fn sum(&self) -> Vec<Complex64> {
        let one = |i: usize| self.e[i].iter().zip(&self.h[i]).map(|(e, h)| e + h);
        one(0).chain(one(1)).collect()
    }
}
