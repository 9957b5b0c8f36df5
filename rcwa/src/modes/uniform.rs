// SPDX-License-Identifier: MIT OR Apache-2.0
//! A uniform layer: its modes are the orders themselves, f = g = 1, with b = ε - kx².

use super::degenerate_modes::DegenerateModes;
use super::{Basis, DEGENERACY, Modes};
use crate::linalg::CMat;
use faer::Mat;
use num_complex::Complex64;

pub(super) fn modes(index: Complex64, kx: &[f64]) -> Modes {
    let n = kx.len();
    let epsilon = index * index;
    let b: Vec<Complex64> = kx.iter().map(|k| epsilon - k * k).collect();
    let diagonal = |value: &dyn Fn(usize) -> Complex64| -> CMat {
        Mat::from_fn(n, n, |i, j| if i == j { value(i) } else { Complex64::ZERO })
    };
    let regular = |m: usize, value: Complex64| {
        if b[m].norm() < DEGENERACY { Complex64::ZERO } else { value / b[m] }
    };
    let one = || diagonal(&|_| Complex64::ONE);
    let basis = Basis {
        f: one(),
        f_inverse: one(),
        ag: diagonal(&|_| epsilon.inv()),
        ag_inverse: diagonal(&|_| epsilon),
        g: one(),
        g_inverse: one(),
        o: diagonal(&|m| regular(m, kx[m] / epsilon)),
        q: diagonal(&|m| regular(m, Complex64::from(kx[m]))),
    };
    let near_degenerate: Vec<usize> = (0..n).filter(|&m| b[m].norm() < DEGENERACY).collect();
    let degenerate =
        (!near_degenerate.is_empty()).then(|| uniform_pairs(&near_degenerate, kx, epsilon));
    Modes { basis, b_lse: b.clone(), b_lsm: b, degenerate }
}

/// The expressions of [`DegenerateModes`] where every sum over other modes is empty.
fn uniform_pairs(near_degenerate: &[usize], kx: &[f64], epsilon: Complex64) -> DegenerateModes {
    let size = near_degenerate.len();
    let b: Vec<Complex64> = near_degenerate.iter().map(|&m| epsilon - kx[m] * kx[m]).collect();
    let diagonal = |value: &dyn Fn(f64) -> Complex64| -> CMat {
        Mat::from_fn(size, size, |i, j| {
            if i == j { value(kx[near_degenerate[i]]) } else { Complex64::ZERO }
        })
    };
    DegenerateModes {
        lse: near_degenerate.to_vec(),
        lsm: near_degenerate.to_vec(),
        o_by_lsm: diagonal(&|k| k / epsilon),
        o_by_lse: diagonal(&|k| k / epsilon),
        q_by_lse: diagonal(&|k| Complex64::from(k)),
        q_by_lsm: diagonal(&|k| Complex64::from(k)),
        b_lse: b.clone(),
        b_lsm: b,
        rest_lse: diagonal(&|_| epsilon.inv()),
        rest_lsm: diagonal(&|_| epsilon.inv()),
    }
}
