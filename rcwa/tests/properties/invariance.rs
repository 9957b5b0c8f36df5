// SPDX-License-Identifier: MIT OR Apache-2.0
//! What must change nothing, or only a phase: shifts, scales, cuts, walls between equals, layers of
//! a half-space's own index.

use super::random::{
    Fill, Verdict, Wave, bloch, check, highest, layers, polygon, small, solve, stack, wavevector,
    with_layers,
};
use crate::support::{largest_difference, moved, waves};
use num_complex::Complex64;
use proptest::prelude::*;
use rcwa::relief::{Layer, Segment};
use rcwa::{Scattering, Side, Stack};
use std::f64::consts::TAU;

fn dielectric_or_absorbing() -> impl Strategy<Value = Fill> {
    prop::sample::select(vec![Fill::Dielectric, Fill::Absorbing])
}

/// The segments moved by a fraction of the period, 0 ≤ dx < 1.
fn shifted(layer: &Layer, dx: f64) -> Layer {
    let mut parts: Vec<Segment> = Vec::new();
    for s in &layer.segments {
        for whole in [0.0, 1.0] {
            let (x0, x1) = ((s.x0 + dx - whole).max(0.0), (s.x1 + dx - whole).min(1.0));
            // Nothing is kept of what round-off pushes over the border.
            if x1 - x0 > 1e-14 {
                let index = s.index;
                parts.push(Segment { x0, x1, index });
            }
        }
    }
    parts.sort_by(|a, b| a.x0.total_cmp(&b.x0));
    for i in 1..parts.len() {
        parts[i].x0 = parts[i - 1].x1;
    }
    parts[0].x0 = 0.0;
    let last = parts.len() - 1;
    parts[last].x1 = 1.0;
    Layer::new(layer.thickness, parts).unwrap()
}

/// Both stacks send as much from every wave into every wave.
fn same_shares(a: &Stack, b: &Stack, k: (f64, f64), highest: usize) -> Verdict {
    let bloch = bloch(a, k);
    let (a, b) = (solve(a, bloch, highest)?, solve(b, bloch, highest)?);
    small("shares", largest_difference(&a, &b), 1e-9)
}

/// The amplitudes of `b` are those of `a`, turned by the phase between two waves.
fn same_but_for(a: &Scattering, b: &Scattering, phase: impl Fn(Wave, Wave) -> f64) -> Verdict {
    for from in waves(a) {
        for to in waves(a) {
            let (before, after) = (a.amplitude(from, to), b.amplitude(from, to));
            // Amplitudes out of grazing waves' reach are large; shares are not.
            let scale = before.norm().max(1.0);
            let turned = before * Complex64::cis(phase(from, to));
            small(&format!("{from:?} to {to:?}"), (turned - after).norm() / scale, 1e-9)?;
        }
    }
    Ok(())
}

#[test]
fn shifting_turns_order_m_by_its_phase() {
    let inputs =
        dielectric_or_absorbing().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    check(400, &(inputs, 0.0..1.0_f64), |((stack, k, highest), dx)| {
        let moved: Vec<Layer> = stack.layers().iter().map(|l| shifted(l, dx)).collect();
        let moved = with_layers(&stack, moved);
        let bloch = bloch(&stack, k);
        let (a, b) = (solve(&stack, bloch, highest)?, solve(&moved, bloch, highest)?);
        let phase = |from: Wave, to: Wave| -TAU * dx * f64::from(to.1 - from.1);
        same_but_for(&a, &b, phase)
    });
}

#[test]
fn moving_a_polygon_moves_its_layers() {
    let inputs =
        dielectric_or_absorbing().prop_flat_map(|fill| (polygon(fill), wavevector(), highest()));
    check(150, &(inputs, -2.0..2.0_f64, 0.3..3.0_f64), |((relief, k, highest), dx, period)| {
        let of = |relief: &rcwa::relief::Relief| {
            Stack::new(1.0, period, 1.5.into(), 1.0.into(), relief.slices(3)).unwrap()
        };
        let (stack, image) = (of(&relief), of(&moved(&relief, |x| x + dx)));
        same_shares(&stack, &image, k, highest)
    });
}

#[test]
fn only_ratios_of_lengths_count() {
    let inputs =
        dielectric_or_absorbing().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    check(300, &(inputs, -9.0..6.0_f64), |((stack, k, highest), log)| {
        let scale = 10_f64.powf(log);
        let scaled =
            |l: &Layer| Layer { thickness: l.thickness * scale, segments: l.segments.clone() };
        let other = Stack::new(
            scale,
            stack.period() * scale,
            stack.index(Side::Top),
            stack.index(Side::Bottom),
            stack.layers().iter().map(scaled).collect(),
        )
        .unwrap();
        same_shares(&stack, &other, k, highest)
    });
}

#[test]
fn a_layer_in_pieces_is_the_same_layer() {
    // Cut across z into pieces, and every piece across x at a place of its own, between equals: all
    // of them are one layer.
    let pieces = prop::collection::vec((0.01..1.0_f64, 0.001..0.999_f64), 2..=4);
    let inputs =
        dielectric_or_absorbing().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    let which = 0..3_usize;
    check(300, &(inputs, pieces, which), |((stack, k, highest), pieces, which)| {
        let which = which % stack.layers().len();
        let whole: f64 = pieces.iter().map(|p| p.0).sum();
        let layers = stack.layers().iter().enumerate().flat_map(|(i, layer)| {
            if i != which {
                return vec![layer.clone()];
            }
            let cut = |&(part, x): &(f64, f64)| {
                let walls = |s: &Segment| {
                    if s.x0 < x && x < s.x1 {
                        vec![Segment { x1: x, ..*s }, Segment { x0: x, ..*s }]
                    } else {
                        vec![*s]
                    }
                };
                let segments = layer.segments.iter().flat_map(walls).collect();
                Layer::new(layer.thickness * part / whole, segments).unwrap()
            };
            pieces.iter().map(cut).collect()
        });
        let other = with_layers(&stack, layers.collect());
        prop_assert!(other.layers().len() > stack.layers().len());
        same_shares(&stack, &other, k, highest)
    });
}

#[test]
fn a_layer_turned_round_and_back_is_itself() {
    // Shifted by dx and on by the rest of the period: the same function of x, described by other
    // segments.
    let inputs =
        dielectric_or_absorbing().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    check(150, &(inputs, 0.01..0.99_f64), |((stack, k, highest), dx)| {
        let turned = stack.layers().iter().map(|l| shifted(&shifted(l, dx), 1.0 - dx));
        let turned = with_layers(&stack, turned.collect());
        same_shares(&stack, &turned, k, highest)
    });
}

#[test]
fn more_of_a_half_space_only_turns_phases() {
    // Layers of the half-spaces' own indices above and below: the reference planes move, nothing
    // else.
    let inputs =
        dielectric_or_absorbing().prop_flat_map(|fill| (stack(fill), wavevector(), highest()));
    let thicknesses = (0.0..3.0_f64, 0.0..3.0_f64);
    check(300, &(inputs, thicknesses), |((stack, k, highest), (above, below))| {
        let spacer = |d: f64, side| Layer::uniform(d, stack.index(side)).unwrap();
        let mut layers = vec![spacer(above, Side::Top)];
        layers.extend(stack.layers().iter().cloned());
        layers.push(spacer(below, Side::Bottom));
        let spaced = with_layers(&stack, layers);
        let bloch = bloch(&stack, k);
        let (a, b) = (solve(&stack, bloch, highest)?, solve(&spaced, bloch, highest)?);
        let path = |(side, m)| {
            let d = if side == Side::Top { above } else { below };
            TAU * d * a.channel(side, m).unwrap().kz.re
        };
        let phase = |from: Wave, to: Wave| path((from.0, from.1)) + path((to.0, to.1));
        same_but_for(&a, &b, phase)
    });
}

#[test]
fn nothing_between_layers_is_nothing() {
    // Layers of no thickness, and of next to none, of any material.
    let inputs = dielectric_or_absorbing()
        .prop_flat_map(|fill| (stack(fill), layers(fill), wavevector(), highest()));
    check(200, &inputs, |(stack, films, k, highest)| {
        let bloch = bloch(&stack, k);
        let with_films = |thickness: f64| {
            let film = films[0].segments.clone();
            let film = Layer::new(thickness, film).unwrap();
            let mut layers = stack.layers().to_vec();
            layers.insert(layers.len() / 2, film);
            with_layers(&stack, layers)
        };
        let plain = solve(&stack, bloch, highest)?;
        let none = solve(&with_films(0.0), bloch, highest)?;
        small("no thickness", largest_difference(&plain, &none), 0.0)?;
        let next_to_none = solve(&with_films(1e-13), bloch, highest)?;
        small("next to none", largest_difference(&plain, &next_to_none), 1e-8)
    });
}
