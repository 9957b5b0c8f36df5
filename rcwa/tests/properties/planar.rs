// SPDX-License-Identifier: MIT OR Apache-2.0
//! Films: closed forms in any azimuth and at any truncation, and the half-wave layer that is not
//! there.

use super::random::{Fill, Verdict, check, index, small, solve};
use num_complex::Complex64;
use proptest::prelude::*;
use rcwa::relief::Layer;
use rcwa::{Bloch, Pol, Scattering, Side, Stack};
use std::f64::consts::TAU;

/// Reflectance and transmittance of films from the top by Abelès' matrices; the tangential
/// wavevector is `kt`.
fn abeles(stack: &Stack, kt: f64, pol: Pol) -> [f64; 2] {
    let admittance = |n: Complex64| {
        let root = (n * n - kt * kt).sqrt();
        let kz = if root.im < 0.0 { -root } else { root };
        (kz, if pol == Pol::S { kz } else { n * n / kz })
    };
    let (_, y_top) = admittance(stack.index(Side::Top));
    let (_, y_bottom) = admittance(stack.index(Side::Bottom));
    let (mut e, mut h) = (Complex64::ONE, y_bottom);
    for layer in stack.layers().iter().rev() {
        let (kz, y) = admittance(layer.segments[0].index);
        let delta = kz * TAU * layer.thickness;
        let (c, s) = (delta.cos(), -Complex64::I * delta.sin());
        (e, h) = (c * e + s / y * h, c * h + s * y * e);
    }
    let incoming = y_top * e + h;
    [((y_top * e - h) / incoming).norm_sqr(), 4.0 * y_top.re * y_bottom.re / incoming.norm_sqr()]
}

/// Order 0 from the top at the azimuth `phi` with the tangential wavevector `kt`.
fn solved(stack: &Stack, kt: f64, phi: f64, highest: usize) -> Result<Scattering, TestCaseError> {
    solve(stack, Bloch::new(kt * phi.cos(), kt * phi.sin()), highest)
}

fn films(fill: Fill) -> impl Strategy<Value = Vec<Layer>> {
    let film = (0.01..0.8_f64, index(fill)).prop_map(|(d, n)| Layer::uniform(d, n).unwrap());
    prop::collection::vec(film, 0..=4)
}

#[test]
fn films_are_what_closed_forms_say_at_any_azimuth() {
    let inputs = (
        films(Fill::Absorbing),
        (1.0..2.5_f64, 1.0..2.5_f64, 0.2..3.0_f64),
        (0.0..0.99_f64, -4.0..4.0_f64),
        0..=4_usize,
    );
    check(500, &inputs, |(films, (top, bottom, period), (sine, phi), highest)| {
        let kt = top * sine;
        // Transmitted light at its critical angle has no closed form worth comparing.
        prop_assume!((bottom - kt).abs() > 1e-6);
        let stack = Stack::new(1.0, period, top.into(), bottom.into(), films).unwrap();
        let scattering = solved(&stack, kt, phi, highest)?;
        for pol in Pol::BOTH {
            let from = (Side::Top, 0, pol);
            let [r, t] = abeles(&stack, kt, pol);
            let got = [Side::Top, Side::Bottom]
                .map(|side| scattering.efficiency_in(from, (side, 0), pol));
            small("reflected", got[0] - r, 1e-10)?;
            small("transmitted", got[1] - t, 1e-10)?;
            // Nothing else: no other order and no other polarisation.
            let all = scattering.total(from, Side::Top) + scattering.total(from, Side::Bottom);
            small("elsewhere", all - got[0] - got[1], 1e-12)?;
        }
        Ok(())
    });
}

fn without_difference(a: &Scattering, b: &Scattering) -> Verdict {
    for pol in Pol::BOTH {
        for side in [Side::Top, Side::Bottom] {
            let of = |s: &Scattering| s.efficiency((Side::Top, 0, pol), (side, 0));
            small("share", of(a) - of(b), 1e-9)?;
        }
    }
    Ok(())
}

#[test]
fn a_half_wave_layer_is_absent() {
    let around = (1.0..2.5_f64, 1.0..2.5_f64);
    let angle = (0.0..0.95_f64, -4.0..4.0_f64);
    let layer = (1.0..3.0_f64, 1..=4_u32, 0..=4_usize);
    check(
        300,
        &(films(Fill::Dielectric), around, angle, layer),
        |(films, (top, bottom), (sine, phi), (n, halves, place))| {
            let kt = top * sine;
            prop_assume!(n > kt + 0.05);
            let cos = (1.0 - (kt / n).powi(2)).sqrt();
            let film = Layer::uniform(f64::from(halves) / (2.0 * n * cos), n.into()).unwrap();
            let mut more = films.clone();
            more.insert(place.min(films.len()), film);
            let of = |layers| Stack::new(1.0, 0.7, top.into(), bottom.into(), layers).unwrap();
            without_difference(&solved(&of(films), kt, phi, 1)?, &solved(&of(more), kt, phi, 1)?)
        },
    );
}

#[test]
fn a_quarter_wave_of_the_mean_index_reflects_nothing() {
    // At normal incidence, n = √(n₁ n₂) and an odd number of quarter waves; two of them make it
    // absent instead.
    let inputs = (1.0..2.5_f64, 1.0..2.5_f64, 0..=3_u32, 0..=3_usize);
    check(100, &inputs, |(top, bottom, extra, highest)| {
        let n = (top * bottom).sqrt();
        let quarters = f64::from(2 * extra + 1);
        let film = Layer::uniform(quarters / (4.0 * n), n.into()).unwrap();
        let stack = Stack::new(1.0, 0.6, top.into(), bottom.into(), vec![film]).unwrap();
        let scattering = solved(&stack, 0.0, 0.0, highest)?;
        for pol in Pol::BOTH {
            let r = scattering.total((Side::Top, 0, pol), Side::Top);
            small("reflected", r, 1e-20)?;
        }
        Ok(())
    });
}
