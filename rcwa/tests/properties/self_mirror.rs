// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bloch wavevectors that are their own mirror image, kx0 = 0 and kx0 = half an order spacing: each must be the limit of its neighbours.

use crate::random::{Fill, Verdict, check, mirror_symmetric, small, solve, stack};
use crate::support::{SIDES, share, waves};
use proptest::prelude::*;
use rcwa::solve::no_progress;
use rcwa::{Bloch, Scattering, Stack, Truncation};

/// Steps in kx0 beside the wavevector in question.
const STEPS: [f64; 2] = [1e-6, 1e-7];

/// The smallest |kz²| of any order kept in a half-space without loss: how far the next cut-off is.
fn from_cut_off(stack: &Stack, bloch: Bloch, highest: usize) -> f64 {
    let spacing = stack.wavelength() / stack.period();
    let highest = highest as i32;
    let orders = (-highest..=highest).map(|m| bloch.kx0 + f64::from(m) * spacing);
    let distances = orders.flat_map(|kx| {
        SIDES.map(|side| {
            let n = stack.index(side).re;
            (n * n - kx * kx - bloch.ky * bloch.ky).abs()
        })
    });
    distances.fold(f64::INFINITY, f64::min)
}

/// Largest departure of any share from the mean of those beside it, and their largest difference from one another.
fn departure(below: &Scattering, here: &Scattering, above: &Scattering) -> [f64; 2] {
    let all = waves(here);
    let (mut worst, mut difference) = (0.0_f64, 0.0_f64);
    for &from in &all {
        for &to in &all {
            let [b, h, a] = [below, here, above].map(|s| share(s, from, to));
            worst = worst.max((h - 0.5 * (a + b)).abs());
            difference = difference.max((a - b).abs());
        }
    }
    [worst, difference]
}

fn is_the_limit(stack: &Stack, half: bool, ky: f64, highest: usize) -> Verdict {
    let spacing = stack.wavelength() / stack.period();
    let kx0 = if half { 0.5 * spacing } else { 0.0 };
    let bloch = Bloch::new(kx0, ky);
    prop_assume!(from_cut_off(stack, bloch, highest) > 0.02);
    let here = solve(stack, bloch, highest)?;
    let mut found = Vec::new();
    for step in STEPS {
        let [below, above] =
            [-step, step].map(|step| solve(stack, Bloch::new(kx0 + step, ky), highest));
        let (below, above) = (below?, above?);
        prop_assert_eq!(waves(&below), waves(&here));
        prop_assert_eq!(waves(&above), waves(&here));
        found.push(departure(&below, &here, &above));
    }
    // Shares are smooth here: with a tenth of the step goes a tenth of the difference and a hundredth of the departure of the mean, in
    // narrow resonances too. What is wrong at the wavevector alone stays whatever the step.
    let [coarse, fine] = [found[0], found[1]];
    small("limit", fine[0], 1e-9 + 0.02 * coarse[0])?;
    small("step", fine[1], 1e-9 + 0.11 * coarse[1])?;
    small("bend", coarse[0], 1e-4)
}

fn inputs(
    structures: impl Strategy<Value = Stack>,
) -> impl Strategy<Value = (Stack, bool, f64, usize)> {
    // Close to normal incidence, but not there, s and p of order 0 turn fast with kx0.
    let ky = prop_oneof![3 => 0.01..1.5_f64, 2 => -1.5..-0.01_f64, 1 => Just(0.0)];
    (structures, prop::bool::ANY, ky, 0..=6_usize)
}

#[test]
fn dielectrics_at_self_mirror_wavevectors() {
    check(
        500,
        &inputs(stack(Fill::Dielectric)),
        |(stack, half, ky, highest)| is_the_limit(&stack, half, ky, highest),
    );
}

#[test]
fn absorbers_at_self_mirror_wavevectors() {
    check(
        300,
        &inputs(stack(Fill::Absorbing)),
        |(stack, half, ky, highest)| is_the_limit(&stack, half, ky, highest),
    );
}

#[test]
fn mirror_symmetric_gratings_at_self_mirror_wavevectors() {
    let structures = prop::sample::select(vec![Fill::Dielectric, Fill::Absorbing])
        .prop_flat_map(mirror_symmetric);
    check(300, &inputs(structures), |(stack, half, ky, highest)| {
        is_the_limit(&stack, half, ky, highest)
    });
}

#[test]
fn a_line_of_ky_is_its_single_problems() {
    // Several ky at once, at wavevectors that are their own mirror image and at others.
    let kx0 = prop_oneof![Just(0.0), Just(0.5), Just(-0.5), -1.0..1.0_f64];
    let ky = prop::collection::vec(-1.5..1.5_f64, 1..=4);
    let structures =
        prop::sample::select(vec![Fill::Dielectric, Fill::Absorbing]).prop_flat_map(stack);
    check(
        150,
        &(structures, kx0, ky, 0..=5_usize),
        |(stack, kx0, ky, highest)| {
            let kx0 = kx0 * stack.wavelength() / stack.period();
            let truncation = Truncation::new(highest).unwrap();
            let line = rcwa::solve_line(&stack, kx0, &ky, truncation, &no_progress)
                .map_err(|e| TestCaseError::fail(e.to_string()))?;
            prop_assert_eq!(line.len(), ky.len());
            for (one, &ky) in line.iter().zip(&ky) {
                let alone = solve(&stack, Bloch::new(kx0, ky), highest)?;
                prop_assert_eq!(waves(one), waves(&alone));
                for from in waves(one) {
                    for to in waves(one) {
                        let difference = share(one, from, to) - share(&alone, from, to);
                        small(&format!("{from:?} to {to:?}"), difference, 1e-9)?;
                    }
                }
            }
            Ok(())
        },
    );
}
