// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reciprocity of the whole scattering matrix, mirrors, the sign of ky, planar mount.

use super::random::{
    Fill, Verdict, Wave, bloch, check, highest, index, mirror_symmetric, normalised, small, solve,
    stack, wavevector, with_bottom, with_layers,
};
use crate::support::{SIDES, share, waves};
use proptest::prelude::*;
use rcwa::relief::{Layer, Segment};
use rcwa::{Bloch, Pol, Scattering, Side};

fn any_fill() -> impl Strategy<Value = Fill> {
    prop::sample::select(vec![Fill::Dielectric, Fill::Plasma, Fill::Absorbing])
}

#[test]
fn reciprocity_of_every_element() {
    let inputs = any_fill().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    check(1200, &inputs, |(stack, k, highest)| {
        let here = bloch(&stack, k);
        // At normal incidence the azimuth, not the wavevector, says where s and p are, and -k has
        // the same.
        let at_normal = here.kx0 == 0.0 && here.ky == 0.0;
        let there = Bloch::new(-here.kx0, -here.ky);
        let (forward, backward) = (solve(&stack, here, highest)?, solve(&stack, there, highest)?);
        let reversed = |(side, m, pol): Wave| (side, -m, pol);
        let all = waves(&forward);
        for &from in &all {
            for &to in &all {
                if at_normal && (from.1 == 0 || to.1 == 0) {
                    let shares =
                        share(&forward, from, to) - share(&backward, reversed(to), reversed(from));
                    small(&format!("{from:?} to {to:?}"), shares, 1e-9)?;
                    continue;
                }
                // Reversed waves keep their p vector and reverse s.
                let sign = if from.2 == to.2 { 1.0 } else { -1.0 };
                let difference = normalised(&forward, from, to)
                    - sign * normalised(&backward, reversed(to), reversed(from));
                small(&format!("{from:?} to {to:?}"), difference.norm(), 1e-9)?;
            }
        }
        Ok(())
    });
}

/// The layer in a mirror x → -x.
fn mirrored(layer: &Layer) -> Layer {
    let turned = layer.segments.iter().rev().map(|s| Segment {
        x0: 1.0 - s.x1,
        x1: 1.0 - s.x0,
        index: s.index,
    });
    Layer::new(layer.thickness, turned.collect()).unwrap()
}

/// Orders m of `a` and -m of `b` have the same shares.
fn mirror_images(a: &Scattering, b: &Scattering) -> Verdict {
    let swap = |(side, m, pol): Wave| (side, -m, pol);
    for from in waves(a) {
        for to in waves(a) {
            let difference = share(a, from, to) - share(b, swap(from), swap(to));
            small(&format!("{from:?} to {to:?}"), difference, 1e-9)?;
        }
    }
    Ok(())
}

#[test]
fn a_mirror_image_scatters_as_in_the_mirror() {
    let inputs = any_fill().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    check(600, &inputs, |(stack, k, highest)| {
        let here = bloch(&stack, k);
        let image = with_layers(&stack, stack.layers().iter().map(mirrored).collect());
        let (a, b) = (
            solve(&stack, here, highest)?,
            solve(&image, Bloch::new(-here.kx0, here.ky), highest)?,
        );
        mirror_images(&a, &b)
    });
}

#[test]
fn a_mirror_symmetric_grating_treats_both_sides_alike() {
    // kx0 = 0: normal incidence and azimuth 90°. Orders m and -m get equal shares, and order 0
    // keeps its polarisation.
    let ky = prop_oneof![1 => Just(0.0), 3 => -2.0..2.0_f64];
    let inputs = any_fill().prop_flat_map(mirror_symmetric);
    check(300, &(inputs, ky, highest()), |(stack, ky, highest)| {
        let scattering = solve(&stack, Bloch::new(0.0, ky), highest)?;
        for side in SIDES.into_iter().filter(|&s| scattering.source(s, 0).is_some()) {
            for (pol, other) in [(Pol::S, Pol::P), (Pol::P, Pol::S)] {
                let from = (side, 0, pol);
                for to in SIDES {
                    for m in scattering.orders(to) {
                        let [plus, minus] = [m, -m].map(|m| scattering.efficiency(from, (to, m)));
                        small(&format!("{from:?} to {m}"), plus - minus, 1e-10)?;
                    }
                    let converted = scattering.efficiency_in(from, (to, 0), other);
                    small(&format!("{from:?} converted"), converted, 1e-18)?;
                }
            }
        }
        Ok(())
    });
}

#[test]
fn a_mirror_symmetric_grating_swaps_orders_with_the_sign_of_kx() {
    let inputs = any_fill().prop_flat_map(mirror_symmetric);
    check(300, &(inputs, wavevector(), highest()), |(stack, k, highest)| {
        let here = bloch(&stack, k);
        let (a, b) = (
            solve(&stack, here, highest)?,
            solve(&stack, Bloch::new(-here.kx0, here.ky), highest)?,
        );
        mirror_images(&a, &b)
    });
}

#[test]
fn the_sign_of_ky_changes_no_share() {
    let bottom = prop_oneof![2 => Just(None), 1 => index(Fill::Absorbing).prop_map(Some)];
    let inputs = any_fill().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    check(600, &(inputs, bottom), |((stack, k, highest), bottom)| {
        let stack = bottom.map_or_else(|| stack.clone(), |n| with_bottom(&stack, n));
        let here = bloch(&stack, k);
        let (a, b) = (
            solve(&stack, here, highest)?,
            solve(&stack, Bloch::new(here.kx0, -here.ky), highest)?,
        );
        for from in waves(&a) {
            for to in waves(&a) {
                let difference = share(&a, from, to) - share(&b, from, to);
                small(&format!("{from:?} to {to:?}"), difference, 1e-9)?;
            }
        }
        Ok(())
    });
}

#[test]
fn planar_mount_keeps_s_and_p_apart() {
    let inputs = any_fill().prop_flat_map(|fill| (stack(fill), -1.5..1.5_f64, highest()));
    check(300, &inputs, |(stack, kx0, highest)| {
        let scattering = solve(&stack, bloch(&stack, (kx0, 0.0)), highest)?;
        for from in waves(&scattering) {
            for to in waves(&scattering).into_iter().filter(|to| to.2 != from.2) {
                small(&format!("{from:?} to {to:?}"), share(&scattering, from, to), 1e-18)?;
            }
        }
        Ok(())
    });
}

#[test]
fn light_from_below_is_light_from_above_upside_down() {
    let inputs = any_fill().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    check(300, &inputs, |(stack, k, highest)| {
        let here = bloch(&stack, k);
        let layers = stack.layers().iter().rev().cloned().collect();
        let [top, bottom] = SIDES.map(|side| stack.index(side));
        let turned = rcwa::Stack::new(1.0, stack.period(), bottom, top, layers).unwrap();
        let (a, b) = (solve(&stack, here, highest)?, solve(&turned, here, highest)?);
        let other = |(side, m, pol): Wave| match side {
            Side::Top => (Side::Bottom, m, pol),
            Side::Bottom => (Side::Top, m, pol),
        };
        for from in waves(&a) {
            for to in waves(&a) {
                let difference = share(&a, from, to) - share(&b, other(from), other(to));
                small(&format!("{from:?} to {to:?}"), difference, 1e-9)?;
            }
        }
        Ok(())
    });
}
