// SPDX-License-Identifier: MIT OR Apache-2.0
//! Layers with degenerate modes: an LSE and an LSM eigenvalue b = kz² + ky² at or near 0 together,
//! where the modes of the two families become one (kz² = -ky²). The index of a lamella is found by
//! bisection with other eigensolvers (nalgebra's) so that b is 0 to round-off; the solver must not
//! notice.

use crate::support;
use crate::support::{balance, largest_difference, real, ridge, solve, waves};
use nalgebra::DMatrix;
use rcwa::{Bloch, Scattering, Side, Stack};
use std::f64::consts::{PI, TAU};

const WAVELENGTH: f64 = 0.55;
const PERIOD: f64 = 0.9;
const HIGHEST: usize = 6;

/// Lamella centred in the cell.
#[derive(Clone, Copy, Debug)]
struct Lamella {
    ridge: f64,
    groove: f64,
    fill: f64,
    kx0: f64,
}

impl Lamella {
    fn kx(&self) -> Vec<f64> {
        let highest = HIGHEST as i32;
        let order = |m: i32| self.kx0 + f64::from(m) * WAVELENGTH / PERIOD;
        (-highest..=highest).map(order).collect()
    }

    /// Toeplitz matrix of ε (power 2) or 1/ε (power -2), seen from the centre of the ridge.
    fn toeplitz(&self, power: i32) -> DMatrix<f64> {
        let (inside, outside) = (self.ridge.powi(power), self.groove.powi(power));
        let n = 2 * HIGHEST + 1;
        DMatrix::from_fn(n, n, |i, j| {
            let m = i.abs_diff(j) as f64;
            if i == j {
                outside + (inside - outside) * self.fill
            } else {
                (inside - outside) * (PI * m * self.fill).sin() / (PI * m)
            }
        })
    }

    /// b of the LSE modes, descending.
    fn lse(&self) -> Vec<f64> {
        let k = DMatrix::from_diagonal(&self.kx().into());
        descending(&(self.toeplitz(2) - &k * &k))
    }

    /// b of the LSM modes, descending.
    fn lsm(&self) -> Vec<f64> {
        let k = DMatrix::from_diagonal(&self.kx().into());
        let e_inverse = self.toeplitz(2).try_inverse().unwrap();
        let one = DMatrix::identity(k.nrows(), k.nrows());
        let l = self.toeplitz(-2).cholesky().unwrap().l();
        let left = l.solve_lower_triangular(&(one - &k * e_inverse * &k)).unwrap();
        let both = l.solve_lower_triangular(&left.transpose()).unwrap();
        descending(&(0.5 * (&both + both.transpose())))
    }

    fn with_groove(self, groove: f64) -> Self {
        Self { groove, ..self }
    }

    /// The same with the index of the groove such that LSE eigenvalue number `mode` is 0, if there
    /// is one.
    fn tuned(self, mode: usize) -> Option<Self> {
        let b = |groove: f64| self.with_groove(groove).lse()[mode];
        root(b, 0.3, 5.0).map(|groove| self.with_groove(groove))
    }

    /// The same with index and width of the groove such that LSE and LSM eigenvalues number `mode`
    /// are both 0.
    fn tuned_twice(self, mode: usize) -> Option<Self> {
        let at = |fill: f64| Self { fill, ..self }.tuned(mode);
        let b = |fill: f64| at(fill).map_or(f64::NAN, |l| l.lsm()[mode]);
        let widths: Vec<f64> = (2..=18).map(|i| 0.05 * f64::from(i)).collect();
        widths.windows(2).find_map(|w| root(b, w[0], w[1])).and_then(at)
    }

    fn stack(&self, thickness: f64) -> Stack {
        let layer = ridge(thickness, 0.5, 0.5 * self.fill, real(self.ridge), real(self.groove));
        Stack::new(WAVELENGTH, PERIOD, real(1.41), real(1.0), vec![layer]).unwrap()
    }
}

fn descending(matrix: &DMatrix<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

/// A zero between `low` and `high`, to the last bit, if the signs there differ.
fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> Option<f64> {
    let (at_low, at_high) = (f(low), f(high));
    if at_low.is_nan() || at_high.is_nan() || (at_low > 0.0) == (at_high > 0.0) {
        return None;
    }
    while high.next_down() > low {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (f(middle) > 0.0) == (at_low > 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

const KY: [f64; 7] = [0.0, 1e-12, 1e-7, 1e-3, 0.02, 0.35, 1.1];

/// Thin, at the border of what counts as thin, and far beyond it (growth of the steepest mode above
/// 100).
const THICKNESSES: [f64; 4] = [0.01, 0.06, 0.4, 3.0];

fn at(lamella: &Lamella, thickness: f64, ky: f64) -> Scattering {
    solve(&lamella.stack(thickness), Bloch::new(lamella.kx0, ky), HIGHEST)
}

/// Energy, and that every share is a smooth function of the index through the critical one.
fn check(lamella: &Lamella) {
    for thickness in THICKNESSES {
        for ky in KY {
            let what = format!("{lamella:?}, {thickness} thick, ky = {ky}");
            let here = at(lamella, thickness, ky);
            assert!(balance(&here).abs() < 1e-11, "{what}: {:.1e}", balance(&here));
            let [coarse, fine] = [1e-6, 1e-7].map(|step| {
                let groove = |sign: f64| lamella.with_groove(lamella.groove * (1.0 + sign * step));
                let [below, above] = [-1.0, 1.0].map(|sign| at(&groove(sign), thickness, ky));
                for other in [&below, &above] {
                    assert!(balance(other).abs() < 1e-11, "{what}: {:.1e}", balance(other));
                }
                let jump = largest_difference(&here, &below).max(largest_difference(&here, &above));
                (jump, second_difference(&below, &here, &above))
            });
            // A tenth of the step: a tenth of the change and a hundredth of the bend, but for
            // round-off.
            assert!(fine.0 < 0.11 * coarse.0 + 1e-12, "{what}: jump {fine:.1?}, {coarse:.1?}");
            assert!(fine.1 < 0.02 * coarse.1 + 1e-12, "{what}: kink {fine:.1?}, {coarse:.1?}");
        }
    }
}

fn second_difference(below: &Scattering, here: &Scattering, above: &Scattering) -> f64 {
    let all = waves(here);
    let mut worst = 0.0_f64;
    for &from in &all {
        for &to in &all {
            let [b, h, a] = [below, here, above].map(|s| support::share(s, from, to));
            worst = worst.max((a + b - 2.0 * h).abs());
        }
    }
    worst
}

const START: Lamella = Lamella { ridge: 1.41, groove: 1.0, fill: 0.4, kx0: 0.0 };

#[test]
fn an_lse_eigenvalue_of_zero() {
    let mut found = 0;
    for kx0 in [0.0, 0.13, 0.5 * WAVELENGTH / PERIOD] {
        for ridge in [1.41, 2.2] {
            for mode in 1..4 {
                let start = Lamella { ridge, kx0, ..START };
                let Some(lamella) = start.tuned(mode) else {
                    continue;
                };
                assert!(lamella.lse()[mode].abs() < 1e-13, "{lamella:?}");
                check(&lamella);
                found += 1;
            }
        }
    }
    assert!(found >= 8, "only {found} cases");
}

#[test]
#[ignore = "slow: 5 s"]
fn both_eigenvalues_zero_to_round_off() {
    let mut found = 0;
    for kx0 in [0.0, 0.13, 0.5 * WAVELENGTH / PERIOD] {
        for ridge in [1.05, 1.41, 2.5] {
            for mode in 1..5 {
                let start = Lamella { ridge, kx0, ..START };
                let Some(lamella) = start.tuned_twice(mode) else {
                    continue;
                };
                let (lse, lsm) = (lamella.lse()[mode], lamella.lsm()[mode]);
                assert!(lse.abs() < 1e-13 && lsm.abs() < 1e-13, "{lamella:?}: {lse:.1e} {lsm:.1e}");
                check(&lamella);
                found += 1;
            }
        }
    }
    assert!(found >= 3, "only {found} cases");
}

#[test]
fn several_pairs_at_once() {
    // Weak lamellae at normal incidence: orders ±1 of both families pass off together, split by the
    // contrast, so that two pairs lie near 0 for every contrast below.
    for contrast in [1e-12, 1e-9, 1e-6, 1e-4, 3e-3] {
        let mean = WAVELENGTH / PERIOD;
        for fill in [0.5, 0.23] {
            let weak = Lamella { ridge: mean + contrast, groove: mean - contrast, fill, kx0: 0.0 };
            let near = |b: &[f64]| b.iter().filter(|b| b.abs() < 2e-2).count();
            assert!(near(&weak.lse()) >= 2 && near(&weak.lsm()) >= 2, "{weak:?}");
            check(&weak);
        }
    }
}

#[test]
fn nothing_happens_where_the_joint_treatment_begins() {
    // Tune b to just inside and just outside of the threshold of `modes::DEGENERACY`.
    for target in [-2e-2, 2e-2] {
        let mean = (WAVELENGTH / PERIOD).powi(2) + target;
        let lamella = |shift: f64| {
            let n = (mean + shift).sqrt();
            Lamella { ridge: n + 1e-4, groove: n - 1e-4, fill: 0.5, kx0: 0.0 }
        };
        for thickness in THICKNESSES {
            for ky in KY {
                let shares =
                    [-2e-4, -1e-6, 1e-6, 2e-4].map(|shift| at(&lamella(shift), thickness, ky));
                for s in &shares {
                    assert!(balance(s).abs() < 1e-11, "{thickness}, {ky}: {:.1e}", balance(s));
                }
                // Nothing but the smooth dependence on the index.
                let across = largest_difference(&shares[1], &shares[2]);
                let whole = largest_difference(&shares[0], &shares[3]);
                assert!(
                    across < 0.03 * whole + 1e-11,
                    "{thickness}, {ky}: {across:.1e} of {whole:.1e}"
                );
            }
        }
    }
}

#[test]
fn a_thick_layer_is_two_halves() {
    let lamella = (1..4).find_map(|mode| START.tuned(mode)).unwrap();
    for ky in KY {
        for thickness in THICKNESSES {
            let whole = lamella.stack(thickness);
            let half = lamella.stack(0.3 * thickness).layers()[0].clone();
            let rest = lamella.stack(0.7 * thickness).layers()[0].clone();
            let halves = Stack::new(
                WAVELENGTH,
                PERIOD,
                whole.index(Side::Top),
                whole.index(Side::Bottom),
                vec![half, rest],
            );
            let bloch = Bloch::new(0.0, ky);
            let (a, b) = (solve(&whole, bloch, HIGHEST), solve(&halves.unwrap(), bloch, HIGHEST));
            let difference = largest_difference(&a, &b);
            assert!(difference < 1e-11, "{thickness}, ky = {ky}: {difference:.1e}");
        }
    }
    // The steepest mode grows by more than e¹⁰⁰ across the thickest of them.
    let steepest = lamella.lsm().iter().copied().fold(0.0, f64::min);
    let growth = (-steepest).sqrt() * TAU * THICKNESSES[3] / WAVELENGTH;
    assert!(growth > 100.0, "{growth}");
}
