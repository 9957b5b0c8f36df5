// SPDX-License-Identifier: MIT OR Apache-2.0
//! Propagation through a thick layer in upward and downward amplitudes, where only decaying
//! exponentials occur [Moharam1995b].

use super::state::State;
use crate::linalg::{Accum, CMat, Lu, product};
use crate::modes::Modes;
use crate::orders::outgoing_kz;
use faer::Mat;
use num_complex::Complex64;

/// Below this |kz| the upward and downward waves of a mode are too alike to tell apart.
const GRAZING: f64 = 1e-4;

/// Takes a state through a layer of thickness `d` (times k0). Returns `false`, and leaves the state
/// as it was, where upward and downward waves cannot be told apart.
pub(super) fn propagate(state: &mut State, modes: &Modes, d: f64) -> bool {
    let kz: Vec<Complex64> =
        modes.kz_squared(state.ky * state.ky).into_iter().map(outgoing_kz).collect();
    if modes.degenerate.is_some() || kz.iter().any(|k| k.norm() < GRAZING) {
        return false;
    }
    by_amplitudes(state, modes, &kz, d);
    true
}

/// e = p (a + b), h = q (a - b) with a downward and b upward; q/p is kz/b (LSM) or b/kz (LSE), and
/// the larger of the two amplitudes is 1.
fn amplitudes(modes: &Modes, kz: &[Complex64]) -> (Vec<Complex64>, Vec<Complex64>) {
    let count = modes.b_lsm.len();
    let scale = |numerator: Complex64, denominator: Complex64| {
        if numerator.norm() <= denominator.norm() {
            (Complex64::ONE, numerator / denominator)
        } else {
            (denominator / numerator, Complex64::ONE)
        }
    };
    kz.iter()
        .enumerate()
        .map(
            |(i, &kz)| {
                if i < count {
                    scale(kz, modes.b_lsm[i])
                } else {
                    scale(modes.b_lse[i - count], kz)
                }
            },
        )
        .unzip()
}

fn by_amplitudes(state: &mut State, modes: &Modes, kz: &[Complex64], d: f64) {
    let size = kz.len();
    let (p, q) = amplitudes(modes, kz);
    let decay: Vec<Complex64> = kz.iter().map(|k| (Complex64::I * k * d).exp()).collect();
    let waves = |e: &CMat, h: &CMat, sign: f64| -> CMat {
        Mat::from_fn(e.nrows(), size, |i, j| 0.5 * (e[(i, j)] / p[j] + sign * h[(i, j)] / q[j]))
    };
    let down = waves(&state.electric, &state.magnetic, 1.0);
    let mut up = waves(&state.electric, &state.magnetic, -1.0);
    let down_by_below = waves(&state.electric_by_below, &state.magnetic_by_below, 1.0);
    let mut up_by_below = waves(&state.electric_by_below, &state.magnetic_by_below, -1.0);

    // New parameters: the downward amplitudes at the top, a. At the bottom X a = down t +
    // down_by_below u.
    let lu = Lu::new(&down);
    lu.solve(up.as_mut());
    lu.solve(state.transmitted.as_mut());
    let minus = -Complex64::ONE;
    product(up_by_below.as_mut(), Accum::Add, minus, down_by_below.as_ref(), up.as_ref());
    product(
        state.reflected_below.as_mut(),
        Accum::Add,
        minus,
        down_by_below.as_ref(),
        state.transmitted.as_ref(),
    );
    let outgoing = state.transmitted.ncols();
    state.transmitted = Mat::from_fn(size, outgoing, |i, j| decay[i] * state.transmitted[(i, j)]);

    // Upward amplitudes at the top: ρ a + (up_by_below X) u with ρ = X (up/down) X.
    let reflection: CMat = Mat::from_fn(size, size, |i, j| decay[i] * up[(i, j)] * decay[j]);
    let field = |scale: &[Complex64], sign: f64| -> CMat {
        Mat::from_fn(size, size, |i, j| {
            let one = if i == j { 1.0 } else { 0.0 };
            (one + sign * reflection[(i, j)]) * scale[j]
        })
    };
    state.electric = field(&p, 1.0);
    state.magnetic = field(&q, -1.0);
    let below = up_by_below.nrows();
    let by_below = |scale: &[Complex64], sign: f64| -> CMat {
        Mat::from_fn(below, size, |i, j| sign * up_by_below[(i, j)] * decay[j] * scale[j])
    };
    state.electric_by_below = by_below(&p, 1.0);
    state.magnetic_by_below = by_below(&q, -1.0);
}
