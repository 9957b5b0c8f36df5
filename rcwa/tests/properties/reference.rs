// SPDX-License-Identifier: MIT OR Apache-2.0
//! The fast path against the plain recipe (`rcwa::reference`), every efficiency of every order.

use super::random::{
    Fill, Verdict, bloch, check, highest, mirror_symmetric, small, solve, stack, wavevector,
};
use proptest::prelude::*;
use rcwa::{Pol, Side, Stack, Truncation, reference};

fn compare(stack: &Stack, at: (f64, f64), highest: usize) -> Verdict {
    let bloch = bloch(stack, at);
    let fast = solve(stack, bloch, highest)?;
    let plain = reference::solve(stack, bloch, Truncation::new(highest).unwrap())
        .map_err(|e| TestCaseError::fail(e.to_string()))?;
    for (side, other) in Side::BOTH.into_iter().flat_map(|a| Side::BOTH.map(|b| (a, b))) {
        for m in fast.sources(side) {
            for n in fast.orders(other) {
                for (p, q) in Pol::BOTH.into_iter().flat_map(|p| Pol::BOTH.map(|q| (p, q))) {
                    let expected = plain.efficiency((side, m, p), (other, n, q));
                    let got = fast.efficiency_in((side, m, p), (other, n), q);
                    let what = format!("{side:?} {m} {p:?} to {other:?} {n} {q:?}: {expected}");
                    small(&what, got - expected, 1e-7)?;
                }
            }
        }
    }
    Ok(())
}

#[test]
fn the_fast_path_is_the_plain_recipe() {
    for fill in [Fill::Dielectric, Fill::Absorbing] {
        check(300, &(stack(fill), wavevector(), highest()), |(stack, at, highest)| {
            compare(&stack, at, highest)
        });
    }
    check(
        200,
        &(mirror_symmetric(Fill::Dielectric), -2.0..2.0_f64, highest()),
        |(stack, ky, m)| compare(&stack, (0.0, ky), m),
    );
}
