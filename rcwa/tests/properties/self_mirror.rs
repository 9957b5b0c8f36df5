// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bloch wavevectors that are their own mirror image, kx0 = 0 and kx0 = half an order spacing: each
//! must be the limit of its neighbours, and what real arithmetic makes of them
//! ([`solve_symmetric_line`]) must be what comes of two periods taken as one, in complex arithmetic
//! unless the stack is its own mirror image.

use super::random::{
    Fill, Verdict, Wave, check, mirror_symmetric, normalised, small, solve, stack, with_layers,
};
use crate::support::{SIDES, balance, share, waves};
use proptest::prelude::*;
use rcwa::no_progress;
use rcwa::relief::{Layer, Segment};
use rcwa::solve::solve_symmetric_line;
use rcwa::{Bloch, Scattering, Stack, SymmetricBloch, Truncation};

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

/// Largest deviation of any share from the mean of those beside it, and their largest difference
/// from one another.
fn deviation(below: &Scattering, here: &Scattering, above: &Scattering) -> [f64; 2] {
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
        found.push(deviation(&below, &here, &above));
    }
    // Shares are smooth here: with a tenth of the step goes a tenth of the difference and a
    // hundredth of the deviation of the mean, in narrow resonances too. What is wrong at the
    // wavevector alone stays whatever the step.
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
    check(500, &inputs(stack(Fill::Dielectric)), |(stack, half, ky, highest)| {
        is_the_limit(&stack, half, ky, highest)
    });
}

#[test]
fn absorbers_at_self_mirror_wavevectors() {
    check(300, &inputs(stack(Fill::Absorbing)), |(stack, half, ky, highest)| {
        is_the_limit(&stack, half, ky, highest)
    });
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
    check(150, &(structures, kx0, ky, 0..=5_usize), |(stack, kx0, ky, highest)| {
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
    });
}

/// Layers thinned by a factor: what is thick is left to complex arithmetic.
fn thinned(fill: Fill) -> impl Strategy<Value = Stack> {
    (stack(fill), -2.0..0.0_f64).prop_map(|(stack, log)| {
        let thin = |l: &Layer| Layer::new(l.thickness * 10_f64.powf(log), l.segments.clone());
        let layers = stack.layers().iter().map(|l| thin(l).unwrap()).collect();
        with_layers(&stack, layers)
    })
}

/// Two periods as one. At kx0 = 0 its even orders 2m are the orders m at kx0 = 0 of one period, its
/// odd ones 2m + 1 those at half an order spacing, and the two do not mix.
fn twice(stack: &Stack) -> Stack {
    let layers = stack.layers().iter().map(|layer| {
        let halves = [0.0, 0.5].into_iter().flat_map(|start| {
            layer.segments.iter().map(move |s| Segment {
                x0: start + 0.5 * s.x0,
                x1: start + 0.5 * s.x1,
                index: s.index,
            })
        });
        Layer::new(layer.thickness, halves.collect()).unwrap()
    });
    let [top, bottom] = SIDES.map(|side| stack.index(side));
    let period = 2.0 * stack.period();
    Stack::new(stack.wavelength(), period, top, bottom, layers.collect()).unwrap()
}

fn mirrored(
    stack: &Stack,
    at: SymmetricBloch,
    ky: f64,
    highest: usize,
) -> Result<Scattering, TestCaseError> {
    let truncation = Truncation::new(highest).unwrap();
    let mut line = solve_symmetric_line(stack, at, &[ky], truncation, &no_progress)
        .map_err(|e| TestCaseError::fail(e.to_string()))?;
    Ok(line.remove(0))
}

/// Largest difference of any element between waves of unit power; infinite if the channels are
/// others.
fn amplitudes_apart(a: &Scattering, b: &Scattering, renumber: impl Fn(i32) -> i32) -> f64 {
    let of = |(side, m, pol): Wave| (side, renumber(m), pol);
    let all = waves(a);
    if all.iter().any(|&w| b.channel(w.0, of(w).1).is_none()) {
        return f64::INFINITY;
    }
    let pairs = all.iter().flat_map(|&from| all.iter().map(move |&to| (from, to)));
    pairs
        .map(|(from, to)| (normalised(a, from, to) - normalised(b, of(from), of(to))).norm())
        .fold(0.0, f64::max)
}

#[test]
fn two_periods_are_the_centre_and_the_edge_of_the_zone() {
    let fills = prop::sample::select(vec![Fill::Dielectric, Fill::Dielectric, Fill::Absorbing]);
    let ky = prop_oneof![5 => -1.5..1.5_f64, 1 => Just(0.0)];
    let inputs = (fills.prop_flat_map(thinned), ky, 0..=6_usize);
    check(600, &inputs, |(stack, ky, highest)| {
        let both = solve(&twice(&stack), Bloch::new(0.0, ky), 2 * highest + 1)?;
        let centre = mirrored(&stack, SymmetricBloch::Centre, ky, highest)?;
        small("centre", amplitudes_apart(&centre, &both, |m| 2 * m), 1e-9)?;
        // In real arithmetic with the orders -M-1..=M, in complex with -M..=M.
        let edge = mirrored(&stack, SymmetricBloch::Edge, ky, highest)?;
        let complex = solve(&stack, edge.bloch(), highest)?;
        let real = amplitudes_apart(&edge, &both, |m| 2 * m + 1);
        small("edge", real.min(amplitudes_apart(&edge, &complex, |m| m)), 1e-9)
    });
}

#[test]
fn laws_hold_at_the_centre_and_the_edge_of_the_zone() {
    // Energy, and reciprocity: reversed waves are of the same wavevector, their orders -m or -1 -
    // m, but for the sign of ky.
    let at = prop::sample::select(vec![SymmetricBloch::Centre, SymmetricBloch::Edge]);
    let inputs = (thinned(Fill::Dielectric), at, 0.01..1.5_f64, 0..=6_usize);
    check(600, &inputs, |(stack, at, ky, highest)| {
        let [here, there] = [ky, -ky].map(|ky| mirrored(&stack, at, ky, highest));
        let (here, there) = (here?, there?);
        small("energy", balance(&here), 1e-10)?;
        let complex = at == SymmetricBloch::Edge && {
            let complex = solve(&stack, here.bloch(), highest)?;
            amplitudes_apart(&here, &complex, |m| m) < 1e-9
        };
        // Complex arithmetic keeps orders that are not their own mirror image.
        prop_assume!(!complex);
        let reversed = |(side, m, pol): Wave| match at {
            SymmetricBloch::Centre => (side, -m, pol),
            SymmetricBloch::Edge => (side, -1 - m, pol),
        };
        for from in waves(&here) {
            for to in waves(&here) {
                let sign = if from.2 == to.2 { 1.0 } else { -1.0 };
                let difference = normalised(&here, from, to)
                    - sign * normalised(&there, reversed(to), reversed(from));
                small(&format!("{from:?} to {to:?}"), difference.norm(), 1e-9)?;
            }
        }
        Ok(())
    });
}
