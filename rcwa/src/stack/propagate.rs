// SPDX-License-Identifier: MIT OR Apache-2.0
//! Through the thickness of a layer, from its bottom to its top.
//!
//! A thin slice needs only even functions of kz (cos kz d, sin(kz d)/kz), so no branch and no degeneracy matters; its
//! evanescent waves must not grow by more than a few e-folds. A thick layer is written in upward and downward
//! amplitudes, where only decaying exponentials occur. Where that basis degenerates (kz near 0, or modes that
//! coalesce) a thick layer is cut into thin slices instead.

use super::state::{Parameters, State};
use crate::linalg::{CMat, Into, Lu, product};
use crate::modes::{Coalescing, Modes};
use crate::orders::outgoing_kz;
use faer::Mat;
use num_complex::Complex64;

/// Largest growth exponent Im(kz) d of a slice that is treated as thin: cosh of it loses a digit.
const THIN: f64 = 2.5;
/// Largest element of an impedance E = Z H that is carried on as such: each digit of it costs a digit of the fields.
const LARGEST_IMPEDANCE: f64 = 1e3;
/// Below this |kz| the upward and downward waves of a mode are too alike to tell apart.
const GRAZING: f64 = 1e-4;

/// Coordinates and their propagation factors through a slab: e' = c e - i se h, h' = c h - i sh e, a column each.
struct Factors {
    c: Vec<Complex64>,
    se: Vec<Complex64>,
    sh: Vec<Complex64>,
}

/// Takes the state from the bottom to the top of a layer of thickness `d` (times k0) with these modes.
pub(crate) fn propagate(state: &mut State, modes: &Modes, d: f64) {
    let ky2 = state.ky * state.ky;
    let kz: Vec<Complex64> = modes
        .b_lsm
        .iter()
        .chain(&modes.b_lse)
        .map(|b| outgoing_kz(b - ky2))
        .collect();
    let growth = kz.iter().map(|k| k.im * d).fold(0.0, f64::max);
    if growth <= THIN {
        thin(state, modes, &kz, d);
        return;
    }
    if modes.coalescing.is_some() || kz.iter().any(|k| k.norm() < GRAZING) {
        let slices = (growth / THIN).ceil();
        for _ in 0..slices as usize {
            thin(state, modes, &kz, d / slices);
        }
        return;
    }
    thick(state, modes, &kz, d);
}

fn factors(modes: &Modes, kz: &[Complex64], d: f64) -> Factors {
    let count = modes.b_lsm.len();
    let (mut c, mut se, mut sh) = (Vec::new(), Vec::new(), Vec::new());
    for (column, &kz) in kz.iter().enumerate() {
        let (cosine, sinc) = cosine_and_sinc(kz, d);
        c.push(cosine);
        // The coordinates of LSM modes obey -i e' = b h, -i h' = (kz²/b) e; those of LSE modes the reverse.
        if column < count {
            let b = modes.b_lsm[column];
            se.push(b * sinc);
            sh.push(kz * kz / b * sinc);
        } else {
            let b = modes.b_lse[column - count];
            se.push(kz * kz / b * sinc);
            sh.push(b * sinc);
        }
    }
    Factors { c, se, sh }
}

/// cos(kz d) and sin(kz d)/kz.
fn cosine_and_sinc(kz: Complex64, d: f64) -> (Complex64, Complex64) {
    let x = kz * d;
    if x.norm() < 1e-3 {
        let x2 = x * x;
        (
            1.0 - x2 / 2.0 * (1.0 - x2 / 12.0),
            d * (1.0 - x2 / 6.0 * (1.0 - x2 / 20.0)),
        )
    } else {
        (x.cos(), x.sin() / kz)
    }
}

fn thin(state: &mut State, modes: &Modes, kz: &[Complex64], d: f64) {
    state.make_explicit();
    let factors = factors(modes, kz, d);
    let pairs = modes.coalescing.as_ref();
    advance(
        &mut state.electric,
        &mut state.magnetic,
        &factors,
        modes,
        pairs,
        state.ky,
        d,
    );
    advance(
        &mut state.electric_by_below,
        &mut state.magnetic_by_below,
        &factors,
        modes,
        pairs,
        state.ky,
        d,
    );

    if !take_magnetic(state) {
        take_sum(state);
    }
}

/// New parameters t' = h, transposed (h by t) N' = e by t: the cheapest choice, since nothing has to be multiplied for
/// h at the next interface. Leaves the state as it is and returns false where this impedance is close to a pole.
fn take_magnetic(state: &mut State) -> bool {
    let lu = Lu::new(&state.magnetic);
    let mut impedance = state.electric.clone();
    lu.solve(impedance.as_mut());
    let bounded = (0..impedance.ncols()).all(|j| {
        impedance
            .col_as_slice(j)
            .iter()
            .all(|z| z.norm_sqr() < LARGEST_IMPEDANCE.powi(2))
    });
    if !bounded {
        return false;
    }
    lu.solve(state.transmitted.as_mut());
    let minus = -Complex64::ONE;
    let below = &state.magnetic_by_below;
    product(
        state.electric_by_below.as_mut(),
        Into::Add,
        minus,
        below.as_ref(),
        impedance.as_ref(),
    );
    product(
        state.reflected_below.as_mut(),
        Into::Add,
        minus,
        below.as_ref(),
        state.transmitted.as_ref(),
    );
    state.electric = impedance;
    state.magnetic_by_below = Mat::zeros(below.nrows(), below.ncols());
    state.parameters = Parameters::Magnetic;
    true
}

/// New parameters t' = e + h, transposed (e + h by t) N' = e by t: never near a pole.
fn take_sum(state: &mut State) {
    let size = state.electric.ncols();
    let sum = added(&state.electric, &state.magnetic);
    let lu = Lu::new(&sum);
    lu.solve(state.electric.as_mut());
    lu.solve(state.transmitted.as_mut());
    state.magnetic = Mat::from_fn(size, size, |i, j| {
        let one = if i == j {
            Complex64::ONE
        } else {
            Complex64::ZERO
        };
        one - state.electric[(i, j)]
    });
    let below = added(&state.electric_by_below, &state.magnetic_by_below);
    let minus = -Complex64::ONE;
    product(
        state.electric_by_below.as_mut(),
        Into::Add,
        minus,
        below.as_ref(),
        state.electric.as_ref(),
    );
    // e + h does not depend on u any more.
    state.magnetic_by_below =
        Mat::from_fn(below.nrows(), size, |i, j| -state.electric_by_below[(i, j)]);
    product(
        state.reflected_below.as_mut(),
        Into::Add,
        minus,
        below.as_ref(),
        state.transmitted.as_ref(),
    );
    state.parameters = Parameters::General;
}

fn added(a: &CMat, b: &CMat) -> CMat {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] + b[(i, j)])
}

/// Applies the slab to the columns of `e` and `h`.
fn advance(
    e: &mut CMat,
    h: &mut CMat,
    factors: &Factors,
    modes: &Modes,
    pairs: Option<&Coalescing>,
    ky: f64,
    d: f64,
) {
    let together = pairs.map(|pairs| {
        let count = modes.b_lsm.len();
        let columns: Vec<usize> = pairs
            .lsm
            .iter()
            .copied()
            .chain(pairs.lse.iter().map(|m| count + m))
            .collect();
        let before: Vec<(Vec<Complex64>, Vec<Complex64>)> = columns
            .iter()
            .map(|&c| (e.col_as_slice(c).to_vec(), h.col_as_slice(c).to_vec()))
            .collect();
        (
            columns,
            before,
            pairs.transfer((&modes.b_lse, &modes.b_lsm), ky, d),
        )
    });
    let minus_i = -Complex64::I;
    for column in 0..e.ncols() {
        let (c, se, sh) = (
            factors.c[column],
            minus_i * factors.se[column],
            minus_i * factors.sh[column],
        );
        for (e, h) in e
            .col_as_slice_mut(column)
            .iter_mut()
            .zip(h.col_as_slice_mut(column))
        {
            (*e, *h) = (c * *e + se * *h, c * *h + sh * *e);
        }
    }
    if let Some((columns, before, transfer)) = together {
        for (i, &column) in columns.iter().enumerate() {
            for row in 0..e.nrows() {
                let (mut electric, mut magnetic) = (Complex64::ZERO, Complex64::ZERO);
                for (j, (eb, hb)) in before.iter().enumerate() {
                    electric +=
                        transfer.ce[(i, j)] * eb[row] + minus_i * transfer.se[(i, j)] * hb[row];
                    magnetic +=
                        transfer.ch[(i, j)] * hb[row] + minus_i * transfer.sh[(i, j)] * eb[row];
                }
                e[(row, column)] = electric;
                h[(row, column)] = magnetic;
            }
        }
    }
}

/// e = p (a + b), h = q (a - b) with a downward and b upward; q/p is kz/b (LSM) or b/kz (LSE), and the larger of the
/// two amplitudes is 1.
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
        .map(|(i, &kz)| {
            if i < count {
                scale(kz, modes.b_lsm[i])
            } else {
                scale(modes.b_lse[i - count], kz)
            }
        })
        .unzip()
}

fn thick(state: &mut State, modes: &Modes, kz: &[Complex64], d: f64) {
    let size = kz.len();
    let (p, q) = amplitudes(modes, kz);
    let decay: Vec<Complex64> = kz.iter().map(|k| (Complex64::I * k * d).exp()).collect();
    let waves = |e: &CMat, h: &CMat, sign: f64| -> CMat {
        Mat::from_fn(e.nrows(), size, |i, j| {
            0.5 * (e[(i, j)] / p[j] + sign * h[(i, j)] / q[j])
        })
    };
    let down = waves(&state.electric, &state.magnetic, 1.0);
    let mut up = waves(&state.electric, &state.magnetic, -1.0);
    let down_by_below = waves(&state.electric_by_below, &state.magnetic_by_below, 1.0);
    let mut up_by_below = waves(&state.electric_by_below, &state.magnetic_by_below, -1.0);

    // New parameters: the downward amplitudes at the top, a. At the bottom X a = down t + down_by_below u.
    let lu = Lu::new(&down);
    lu.solve(up.as_mut());
    lu.solve(state.transmitted.as_mut());
    let minus = -Complex64::ONE;
    product(
        up_by_below.as_mut(),
        Into::Add,
        minus,
        down_by_below.as_ref(),
        up.as_ref(),
    );
    product(
        state.reflected_below.as_mut(),
        Into::Add,
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
        Mat::from_fn(below, size, |i, j| {
            sign * up_by_below[(i, j)] * decay[j] * scale[j]
        })
    };
    state.electric_by_below = by_below(&p, 1.0);
    state.magnetic_by_below = by_below(&q, -1.0);
}
