// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where the power goes: unitarity without loss, absorption, total reflection, cut-offs,
//! directions.

use super::random::{
    Fill, Verdict, Wave, between, bloch, check, highest, index, layers, normalised, small, solve,
    stack, wavevector, with_bottom,
};
use crate::support::{SIDES, balance, waves};
use num_complex::Complex64;
use proptest::prelude::*;
use rcwa::field::{Grid, Incident, field};
use rcwa::no_progress;
use rcwa::relief::Layer;
use rcwa::{Bloch, Pol, Scattering, Side, Stack, Truncation};

/// S Sᴴ = 1 in waves of unit power: all power is there, and different waves stay orthogonal.
fn unitary(scattering: &Scattering) -> Verdict {
    let all = waves(scattering);
    for &a in &all {
        for &b in &all {
            let sum: Complex64 = all
                .iter()
                .map(|&to| normalised(scattering, a, to).conj() * normalised(scattering, b, to))
                .sum();
            let expected = if a == b { 1.0 } else { 0.0 };
            small(&format!("unitarity of {a:?} and {b:?}"), (sum - expected).norm(), 1e-9)?;
        }
    }
    small("energy", balance(scattering), 1e-10)
}

#[test]
fn dielectrics_scatter_unitarily() {
    check(1500, &(stack(Fill::Dielectric), wavevector(), highest()), |(stack, k, highest)| {
        unitary(&solve(&stack, bloch(&stack, k), highest)?)
    });
}

#[test]
fn plasmas_scatter_unitarily() {
    check(300, &(stack(Fill::Plasma), wavevector(), highest()), |(stack, k, highest)| {
        unitary(&solve(&stack, bloch(&stack, k), highest)?)
    });
}

#[test]
fn absorption_never_gives() {
    let bottom = prop_oneof![Just(None), index(Fill::Absorbing).prop_map(Some)];
    let inputs = (stack(Fill::Absorbing), bottom, wavevector(), highest());
    check(1000, &inputs, |(stack, bottom, k, highest)| {
        let stack = bottom.map_or_else(|| stack.clone(), |n| with_bottom(&stack, n));
        let scattering = solve(&stack, bloch(&stack, k), highest)?;
        for (side, order, pol) in waves(&scattering) {
            if scattering.source(side, order).is_none() {
                continue;
            }
            let from = (side, order, pol);
            let kept: f64 = SIDES.iter().map(|&to| scattering.total(from, to)).sum();
            prop_assert!((0.0..=1.0 + 1e-10).contains(&kept), "{from:?}: {kept}");
            for to in SIDES {
                for m in scattering.orders(to) {
                    prop_assert!(scattering.efficiency(from, (to, m)) >= 0.0);
                }
            }
        }
        Ok(())
    });
}

/// Of the shares of power found from fields.
const ALLOWED: f64 = 1e-9;

#[test]
fn what_is_missing_is_what_the_layers_take() {
    // R + T + A = 1 with A from the fields: the flow of power through the planes between layers
    // falls by what each absorbs, never rises, and stays where nothing absorbs.
    let inputs = (stack(Fill::Absorbing), wavevector(), 0..=4_usize, prop::bool::ANY);
    check(300, &inputs, |(stack, k, highest, s)| {
        let bloch = bloch(&stack, k);
        let pol = if s { Pol::S } else { Pol::P };
        let scattering = solve(&stack, bloch, highest)?;
        // The planes between layers, from the top of the first to the bottom of the last.
        let mut z = vec![0.0];
        for layer in stack.layers() {
            z.push(z[z.len() - 1] + layer.thickness);
        }
        for side in SIDES {
            let from = (side, 0, pol);
            if scattering.source(side, 0).is_none() {
                continue;
            }
            let grid = Grid { x: vec![0.0], z: z.clone() };
            let incident = Incident::unit(side, pol);
            let truncation = Truncation::new(highest).unwrap();
            let mut found = field(&stack, bloch, truncation, &incident, grid, &no_progress)
                .map_err(|e| TestCaseError::fail(e.to_string()))?;
            let mut layers: Vec<&Layer> = stack.layers().iter().collect();
            let mut far = Side::Bottom;
            if side == Side::Bottom {
                found.flux.reverse();
                layers.reverse();
                far = Side::Top;
            }
            let (r, t) = (scattering.total(from, side), scattering.total(from, far));
            small("what goes in", found.flux[0] - (1.0 - r), ALLOWED)?;
            let last = found.flux[layers.len()];
            small("what comes out", last - t, ALLOWED)?;
            let mut absorbed = 0.0;
            for (layer, pair) in layers.iter().zip(found.flux.windows(2)) {
                let taken = pair[0] - pair[1];
                prop_assert!(taken > -ALLOWED, "{from:?}: {taken:.1e}");
                if layer.is_lossless() {
                    small("taken without loss", taken, ALLOWED)?;
                }
                absorbed += taken;
            }
            small("R + T + A - 1", r + t + absorbed - 1.0, 2.0 * ALLOWED)?;
        }
        Ok(())
    });
}

#[test]
fn nothing_passes_beyond_the_critical_angle() {
    let inputs = (
        layers(Fill::Dielectric),
        (0.2..3.0_f64, 1.6..2.5_f64, 1.0..1.5_f64),
        (-0.5..0.5_f64, 0.02..0.98_f64),
        highest(),
    );
    check(300, &inputs, |(layers, (period, top, bottom), (kx0, part), highest)| {
        let stack = Stack::new(1.0, period, top.into(), bottom.into(), layers).unwrap();
        let ky = bottom + part * (top - bottom);
        let scattering = solve(&stack, bloch(&stack, (kx0, ky)), highest)?;
        prop_assert_eq!(scattering.orders(Side::Bottom).count(), 0);
        for from in waves(&scattering) {
            small("reflected", scattering.total(from, Side::Top) - 1.0, 1e-10)?;
        }
        unitary(&scattering)
    });
}

#[test]
fn exact_cut_offs_are_survived() {
    // Wavevectors, indices and spacings of few binary digits, so that n² = kx² + ky² holds to the
    // last bit for some order.
    let triple = prop::sample::select(vec![
        (1.0, 0.0, 1.0),
        (0.0, 1.0, 1.0),
        (3.0, 4.0, 5.0),
        (4.0, 3.0, 5.0),
        (5.0, 12.0, 13.0),
        (-8.0, 15.0, 17.0),
        (-15.0, 8.0, 17.0),
    ]);
    let spacing = prop::sample::select(vec![1.0, 0.5, 0.25, 0.125]);
    let other = prop_oneof![Just(None), (1.0..2.5_f64).prop_map(Some)];
    let inputs = (
        layers(Fill::Dielectric),
        (triple, 16..40_u32, other, prop::bool::ANY),
        (spacing, -4..=4_i32),
        0..=5_usize,
    );
    check(800, &inputs, |(layers, ((a, b, c), scale, other, swap), (spacing, m), highest)| {
        // n between 1 and 2.5.
        let scale = f64::from(scale) / 16.0;
        let part = [a, b, c].map(|x: f64| x * scale);
        let power = 2_f64.powi(c.log2().floor() as i32);
        let [kx, ky, n] = part.map(|x| x / power);
        let bloch = Bloch::new(kx - f64::from(m) * spacing, ky);
        let other = other.unwrap_or(n);
        let (top, bottom) = if swap { (other, n) } else { (n, other) };
        let stack = Stack::new(1.0, 1.0 / spacing, top.into(), bottom.into(), layers).unwrap();
        small("kz²", n * n - kx * kx - ky * ky, 0.0)?;
        let scattering = solve(&stack, bloch, highest.max(m.unsigned_abs() as usize))?;
        // The wave at its cut-off carries nothing and is no channel.
        let side = if swap { Side::Bottom } else { Side::Top };
        prop_assert!(scattering.channel(side, m).is_none());
        let all = waves(&scattering);
        for &from in &all {
            for &to in &all {
                prop_assert!(scattering.amplitude(from, to).is_finite());
            }
        }
        small("energy", balance(&scattering), 1e-10)
    });
}

#[test]
fn orders_go_where_the_grating_equation_says() {
    let inputs = (stack(Fill::Dielectric), wavevector(), highest());
    check(300, &inputs, |(stack, k, highest)| {
        let bloch = bloch(&stack, k);
        let scattering = solve(&stack, bloch, highest)?;
        let spacing = stack.wavelength() / stack.period();
        for side in SIDES {
            let n = stack.index(side).re;
            let mut next = scattering.orders(side).next();
            for channel in scattering.channels(side) {
                prop_assert_eq!(Some(channel.order), next);
                next = Some(channel.order + 1);
                small("kx", channel.kx - bloch.kx0 - f64::from(channel.order) * spacing, 1e-12)?;
                small("ky", channel.ky - bloch.ky, 0.0)?;
                let length = channel.kx.powi(2) + channel.ky.powi(2) + channel.kz.re.powi(2);
                small("|k| - n", length.sqrt() - n, 1e-12)?;
                prop_assert!(channel.kz.re > 0.0 && channel.kz.im == 0.0);
            }
            let reach = |m: i32| {
                let kx = bloch.kx0 + f64::from(m) * spacing;
                n * n - kx * kx - bloch.ky * bloch.ky
            };
            let kept = highest as i32;
            let count = (-kept..=kept).filter(|&m| reach(m) > 0.0).count();
            prop_assert_eq!(count, scattering.channels(side).len());
        }
        Ok(())
    });
}

#[test]
fn normal_incidence_turns_with_its_azimuth() {
    // At exactly normal incidence s and p are where the azimuth says; a turned pair is a
    // combination of the first.
    let structures = between(layers(Fill::Absorbing));
    check(300, &(structures, -4.0..4.0_f64, highest()), |(stack, azimuth, highest)| {
        let plain = solve(&stack, Bloch::new(0.0, 0.0), highest)?;
        let turned = Bloch { azimuth_at_normal: azimuth, ..Bloch::new(0.0, 0.0) };
        let turned = solve(&stack, turned, highest)?;
        let (sin, cos) = azimuth.sin_cos();
        for side in SIDES {
            // Downward p lies along (cos, sin) of the azimuth in the plane, s across it; upward
            // p lies the other way.
            let sign = if side == Side::Top { 1.0 } else { -1.0 };
            let jones = [
                [cos.into(), Complex64::from(-sign * sin)],
                [Complex64::from(sign * sin), cos.into()],
            ];
            for (pol, mix) in Pol::BOTH.into_iter().zip(jones) {
                for to in SIDES {
                    for m in plain.orders(to) {
                        let from: Wave = (side, 0, pol);
                        let direct = turned.efficiency(from, (to, m));
                        let matrix = plain
                            .jones((side, 0), (to, m))
                            .ok_or_else(|| TestCaseError::fail("order 0 is evanescent"))?;
                        let mixed = matrix.efficiencies(mix);
                        small("share", direct - mixed[0] - mixed[1], 1e-10)?;
                    }
                }
            }
        }
        Ok(())
    });
}
