// SPDX-License-Identifier: MIT OR Apache-2.0
//! One layer for near fields: Fourier coefficients to coordinates and back, and the transfer
//! through a slab.
//!
//! In: tangential coefficients, rows 0..N of Ex or Hy, rows N..2N of Ey or -Hx, any number of
//! columns. Out: the same a thickness higher up. A slab must be so thin that its evanescent waves
//! grow by a few e-folds at most; cos(kz d) and sin(kz d)/kz are even in kz, so that no branch
//! matters and kz = 0 is no exception.

use crate::error::Error;
use crate::factorization::toeplitz;
use crate::linalg::{Accum, CMat, Lu, mul, product};
use crate::modes::{Modes, modes};
use crate::orders::outgoing_kz;
use crate::relief::Layer;
use crate::stack::arithmetic::{Arithmetic as _, THIN};
use faer::Mat;
use num_complex::Complex64;

/// Tangential coefficients, or their coordinates in a layer: (N, columns) each.
#[derive(Clone, Debug)]
pub(super) struct Tangential {
    /// Ex, or the LSM coordinate of E.
    pub(super) ex: CMat,
    /// Ey, or the LSE coordinate of E.
    pub(super) ey: CMat,
    /// Hy, or the LSM coordinate of H.
    pub(super) hy: CMat,
    /// -Hx, or the LSE coordinate of H.
    pub(super) hx: CMat,
}

/// A part of a layer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slab {
    /// Layer, counted from the top.
    pub(super) layer: usize,
    /// Part of it, counted from below, and how many there are.
    pub(super) part: usize,
    pub(super) parts: usize,
    /// Thickness times k0.
    pub(super) thickness: f64,
}

impl Slab {
    /// Depths of its top and bottom within its layer, as fractions of the layer's thickness.
    pub(super) fn extent(&self) -> [f64; 2] {
        [self.part + 1, self.part].map(|p| 1.0 - p as f64 / self.parts as f64)
    }

    pub(super) fn is_lowest(&self) -> bool {
        self.part == 0
    }
}

/// Modes and permittivity of a layer.
pub(super) struct Medium {
    modes: Modes,
    /// Modes LSM first, as in the coordinates.
    kz: Vec<Complex64>,
    ky: f64,
    /// Factors of the Toeplitz matrix of ε.
    permittivity: Lu<Complex64>,
}

impl Medium {
    pub(super) fn new(layer: &Layer, kx: &[f64], ky: f64) -> Result<Self, Error> {
        let modes = modes(layer, kx)?;
        let kz = modes.b_lsm.iter().chain(&modes.b_lse).map(|b| outgoing_kz(b - ky * ky)).collect();
        let permittivity = Lu::new(&toeplitz(&layer.segments, kx.len()).permittivity);
        Ok(Self { modes, kz, ky, permittivity })
    }

    /// Slabs that a thickness `d` (times k0) is to be cut into.
    pub(super) fn slabs(&self, d: f64) -> usize {
        let growth = self.kz.iter().map(|k| k.im * d).fold(0.0, f64::max);
        ((growth / THIN).ceil() as usize).max(1)
    }

    /// Coordinates of Fourier coefficients.
    pub(super) fn to_own(&self, fields: &Tangential) -> Tangential {
        let (basis, ky) = (&self.modes.basis, Complex64::from(self.ky));
        let ex = mul(&basis.ag_inverse, &fields.ex);
        let mut ey = mul(&basis.f_inverse, &fields.ey);
        add(&mut ey, ky, &basis.o, &ex);
        let hx = mul(&basis.f_inverse, &fields.hx);
        let mut hy = mul(&basis.g_inverse, &fields.hy);
        add(&mut hy, -ky, &basis.q, &hx);
        Tangential { ex, ey, hy, hx }
    }

    /// Fourier coefficients of coordinates.
    pub(super) fn to_fourier(&self, mut own: Tangential) -> Tangential {
        let (basis, ky) = (&self.modes.basis, Complex64::from(self.ky));
        add(&mut own.ey, -ky, &basis.o, &own.ex);
        add(&mut own.hy, ky, &basis.q, &own.hx);
        Tangential {
            ex: mul(&basis.ag, &own.ex),
            ey: mul(&basis.f, &own.ey),
            hy: mul(&basis.g, &own.hy),
            hx: mul(&basis.f, &own.hx),
        }
    }

    /// Coordinates a thickness `d` (times k0) above those given.
    pub(super) fn raised(&self, own: &Tangential, d: f64) -> Tangential {
        let modes = &self.modes;
        let mut raised = own.clone();
        for (row, &b) in modes.b_lsm.iter().enumerate() {
            // -i e' = b h, -i h' = (kz²/b) e.
            let kz = self.kz[row];
            let (cosine, sinc) = Complex64::cosine_and_sinc(kz * kz, d);
            let (by_h, by_e) = (b * sinc, kz * kz / b * sinc);
            rotate(&mut raised.ex, &mut raised.hy, row, cosine, (by_h, by_e));
        }
        for (row, &b) in modes.b_lse.iter().enumerate() {
            // The reverse.
            let kz = self.kz[modes.b_lsm.len() + row];
            let (cosine, sinc) = Complex64::cosine_and_sinc(kz * kz, d);
            let (by_h, by_e) = (kz * kz / b * sinc, b * sinc);
            rotate(&mut raised.ey, &mut raised.hx, row, cosine, (by_h, by_e));
        }
        if let Some(pairs) = &modes.degenerate {
            let transfer = pairs.transfer(self.ky, d);
            let minus_i = -Complex64::I;
            for column in 0..own.ex.ncols() {
                let of = |lsm: &CMat, lse: &CMat| -> CMat {
                    let lsm = pairs.lsm.iter().map(|&m| lsm[(m, column)]);
                    let all: Vec<Complex64> =
                        lsm.chain(pairs.lse.iter().map(|&m| lse[(m, column)])).collect();
                    Mat::from_fn(all.len(), 1, |i, _| all[i])
                };
                let (before_e, before_h) = (of(&own.ex, &own.ey), of(&own.hy, &own.hx));
                let mut e = mul(&transfer.ce, &before_e);
                add(&mut e, minus_i, &transfer.se, &before_h);
                let mut h = mul(&transfer.ch, &before_h);
                add(&mut h, minus_i, &transfer.sh, &before_e);
                for (i, &m) in pairs.lsm.iter().enumerate() {
                    (raised.ex[(m, column)], raised.hy[(m, column)]) = (e[(i, 0)], h[(i, 0)]);
                }
                for (i, &m) in pairs.lse.iter().enumerate() {
                    let i = pairs.lsm.len() + i;
                    (raised.ey[(m, column)], raised.hx[(m, column)]) = (e[(i, 0)], h[(i, 0)]);
                }
            }
        }
        raised
    }

    /// Coefficients of the normal displacement εEx, A⁻¹ Ex = g ex, from the coordinates of a single
    /// field.
    pub(super) fn displacement(&self, own: &Tangential) -> Vec<Complex64> {
        let g = &self.modes.basis.g;
        let n = g.nrows();
        let row = |m: usize| (0..n).map(|j| g[(m, j)] * own.ex[(j, 0)]).sum();
        (0..n).map(row).collect()
    }

    /// Coefficients of Ez from those of εEz.
    pub(super) fn divided_by_permittivity(&self, displacement: &[Complex64]) -> Vec<Complex64> {
        let n = displacement.len();
        let mut out: CMat = Mat::from_fn(n, 1, |i, _| displacement[i]);
        self.permittivity.solve(out.as_mut());
        (0..n).map(|i| out[(i, 0)]).collect()
    }
}

/// `to + factor a b` in place of `to`.
fn add(to: &mut CMat, factor: Complex64, a: &CMat, b: &CMat) {
    product(to.as_mut(), Accum::Add, factor, a.as_ref(), b.as_ref());
}

/// e' = c e - i `by_h` h, h' = c h - i `by_e` e in one row.
fn rotate(
    e: &mut CMat,
    h: &mut CMat,
    row: usize,
    cosine: Complex64,
    (by_h, by_e): (Complex64, Complex64),
) {
    let minus_i = -Complex64::I;
    for column in 0..e.ncols() {
        let (before_e, before_h) = (e[(row, column)], h[(row, column)]);
        e[(row, column)] = cosine * before_e + minus_i * by_h * before_h;
        h[(row, column)] = cosine * before_h + minus_i * by_e * before_e;
    }
}
