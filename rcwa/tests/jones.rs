// SPDX-License-Identifier: MIT OR Apache-2.0
//! Jones matrices: Fresnel's coefficients with their signs, the efficiencies they imply, unitarity,
//! reciprocity and symmetry with the signs that the bases of `docs/explanation/conventions.md` give
//! them.
//!
//! Sign rules, from s = z × k∥/|k∥| and p = s × k/|k|. Reversing a wave (k to -k): s to -s, p to p.
//! A mirror x → -x or y → -y takes s to -s and p to p of the mirrored wave, so that elements
//! between s and p change sign. Half a turn about z takes s to s and p to p.

use crate::support::{SIDES, assert_near, layer, real, ridge, solve, waves};
use num_complex::Complex64;
use rcwa::relief::{Layer, Segment};
use rcwa::{Bloch, Error, Pol, Scattering, Side, Stack};

const EXACT: f64 = 1e-11;

/// What reversal and mirrors do to an element of a matrix over (s, p).
const SIGNS: [[f64; 2]; 2] = [[1.0, -1.0], [-1.0, 1.0]];

fn asymmetric(absorption: f64) -> Vec<Layer> {
    let lossy = Complex64::new(1.7, absorption);
    vec![
        layer(0.2, &[(0.2, real(1.0)), (0.5, lossy), (1.0, real(1.41))]),
        layer(0.35, &[(0.1, lossy), (0.6, real(1.2)), (1.0, real(2.0))]),
    ]
}

fn mirrored(layers: &[Layer]) -> Vec<Layer> {
    layers
        .iter()
        .map(|l| {
            let segments = l.segments.iter().rev().map(|s| Segment {
                x0: 1.0 - s.x1,
                x1: 1.0 - s.x0,
                index: s.index,
            });
            Layer::new(l.thickness, segments.collect()).unwrap()
        })
        .collect()
}

fn stack(layers: Vec<Layer>) -> Stack {
    Stack::new(0.55, 0.9, real(1.41), real(1.0), layers).unwrap()
}

/// All pairs of orders by which light comes and leaves.
fn pairs(scattering: &Scattering) -> Vec<[(Side, i32); 2]> {
    let orders = || {
        SIDES
            .into_iter()
            .flat_map(|side| scattering.orders(side).map(move |m| (side, m)))
            .collect::<Vec<_>>()
    };
    orders().into_iter().flat_map(|from| orders().into_iter().map(move |to| [from, to])).collect()
}

/// Each matrix of `a` from (side, m) to (side, n) against that of `b` from (side, -m) to (side,
/// -n), with these signs.
fn assert_opposite_orders(what: &str, a: &Scattering, b: &Scattering, signs: [[f64; 2]; 2]) {
    let all = pairs(a);
    assert!(all.len() >= 9, "{what}: only {} pairs", all.len());
    for [from, to] in all {
        let x = a.jones(from, to).unwrap().matrix;
        let y = b.jones((from.0, -from.1), (to.0, -to.1)).unwrap().matrix;
        for (q, p) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let difference = (x[q][p] - signs[q][p] * y[q][p]).norm();
            assert_near(&format!("{what}: {from:?} to {to:?}, {q}{p}"), difference, 0.0, EXACT);
        }
    }
}

#[test]
fn a_bare_surface_has_the_coefficients_of_fresnel() {
    let (n1, n2) = (1.41, 1.0);
    let bare = stack(Vec::new());
    for (theta, phi) in [(0.0f64, 0.0), (0.0, 0.7), (30f64, 0.0), (30.0, 200.0), (43.0, 75.0)] {
        let (t, f) = (theta.to_radians(), f64::to_radians(phi));
        let scattering = solve(&bare, Bloch::from_angles(&bare, Side::Top, t, f), 2);
        let (c1, c2) = (t.cos(), (1.0 - (n1 / n2 * t.sin()).powi(2)).sqrt());
        let get = |to| scattering.jones((Side::Top, 0), (to, 0)).unwrap().matrix;
        let (r, t) = (get(Side::Top), get(Side::Bottom));
        for (what, got, expected) in [
            ("r_s", r[0][0], (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2)),
            ("r_p", r[1][1], (n2 * c1 - n1 * c2) / (n2 * c1 + n1 * c2)),
            ("t_s", t[0][0], 2.0 * n1 * c1 / (n1 * c1 + n2 * c2)),
            ("t_p", t[1][1], 2.0 * n1 * c1 / (n2 * c1 + n1 * c2)),
            ("r_sp", r[0][1], 0.0),
            ("t_ps", t[1][0], 0.0),
        ] {
            assert_near(what, (got - expected).norm(), 0.0, 1e-12);
        }
    }
}

#[test]
fn matrices_give_the_efficiencies() {
    let incident = [Complex64::new(0.3, -1.1), Complex64::new(-0.8, 0.45)];
    let metal =
        Stack::new(0.55, 0.9, real(1.41), Complex64::new(0.4, 3.0), asymmetric(0.2)).unwrap();
    for stack in [stack(asymmetric(0.0)), stack(asymmetric(0.3)), metal] {
        let scattering = solve(&stack, Bloch::new(0.21, 0.4), 8);
        for [from, to] in pairs(&scattering) {
            let Some(jones) = scattering.jones(from, to) else {
                assert!(scattering.source(from.0, from.1).is_none());
                continue;
            };
            assert_eq!((jones.side, jones.order), to);
            for (column, p) in Pol::BOTH.into_iter().enumerate() {
                let normalised = jones.power_normalised();
                for (row, q) in Pol::BOTH.into_iter().enumerate() {
                    let expected = scattering.efficiency_in((from.0, from.1, p), to, q);
                    assert_near("element", normalised[row][column].norm_sqr(), expected, 1e-13);
                }
            }
            let flux_in = scattering.source(from.0, from.1).unwrap().flux[0];
            let power_in: f64 = incident.iter().map(|a| flux_in * a.norm_sqr()).sum();
            let target = scattering.channel(to.0, to.1).unwrap();
            let expected = Pol::BOTH.map(|q| {
                let part = |p: Pol| scattering.amplitude((from.0, from.1, p), (to.0, to.1, q));
                let wave = incident[0] * part(Pol::S) + incident[1] * part(Pol::P);
                target.flux[usize::from(q == Pol::P)] * wave.norm_sqr() / power_in
            });
            for (got, expected) in jones.efficiencies(incident).into_iter().zip(expected) {
                assert_near("any state", got, expected, 1e-13);
            }
        }
    }
}

#[test]
fn power_normalised_matrices_are_unitary_without_loss() {
    for (kx0, ky) in [(0.0, 0.0), (0.21, 0.4), (-0.3, 0.93), (0.11, 1.2)] {
        let scattering = solve(&stack(asymmetric(0.0)), Bloch::new(kx0, ky), 8);
        let all = waves(&scattering);
        assert!(all.len() >= 4);
        let column = |from: (Side, i32, Pol)| -> Vec<Complex64> {
            let jones = scattering.jones_of_all((from.0, from.1)).unwrap();
            let p = usize::from(from.2 == Pol::P);
            jones.iter().flat_map(|j| j.power_normalised().map(|row| row[p])).collect()
        };
        for (i, &a) in all.iter().enumerate() {
            for (j, &b) in all.iter().enumerate() {
                let overlap: Complex64 =
                    column(a).iter().zip(column(b)).map(|(x, y)| x.conj() * y).sum();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert_near(&format!("{a:?} {b:?}"), (overlap - expected).norm(), 0.0, EXACT);
            }
        }
    }
}

#[test]
fn reversed_waves_have_transposed_matrices() {
    for absorption in [0.0, 0.3] {
        let stack = stack(asymmetric(absorption));
        for (kx0, ky) in [(0.21, 0.4), (-0.3, 0.93), (0.17, 0.0)] {
            let forth = solve(&stack, Bloch::new(kx0, ky), 8);
            let back = solve(&stack, Bloch::new(-kx0, -ky), 8);
            for [from, to] in pairs(&forth) {
                let x = forth.jones(from, to).unwrap().power_normalised();
                let reversed = back.jones((to.0, -to.1), (from.0, -from.1)).unwrap();
                let y = reversed.power_normalised();
                for (q, p) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let difference = (x[q][p] - SIGNS[q][p] * y[p][q]).norm();
                    assert_near(&format!("{from:?} to {to:?}, {q}{p}"), difference, 0.0, EXACT);
                }
            }
        }
    }
}

#[test]
fn mirrors_change_the_sign_of_what_turns_s_into_p() {
    let lossy = Complex64::new(1.5, 0.2);
    let symmetric = stack(vec![
        ridge(0.2, 0.5, 0.17, lossy, real(1.0)),
        ridge(0.3, 0.0, 0.3, real(1.41), real(1.1)),
    ]);
    for (kx0, ky) in [(0.2, 0.5), (0.31, 0.9), (0.0, 0.3)] {
        let a = solve(&symmetric, Bloch::new(kx0, ky), 8);
        let b = solve(&symmetric, Bloch::new(-kx0, ky), 8);
        assert_opposite_orders("mirror x", &a, &b, SIGNS);
    }
    // Every grating is its own image in y → -y; the orders keep their numbers.
    let any = stack(asymmetric(0.3));
    for (kx0, ky) in [(0.2, 0.5), (0.31, 0.9), (0.2, 0.0)] {
        let a = solve(&any, Bloch::new(kx0, ky), 8);
        let b = solve(&any, Bloch::new(kx0, -ky), 8);
        let mut between = 0.0_f64;
        for [from, to] in pairs(&a) {
            let (x, y) = (a.jones(from, to).unwrap().matrix, b.jones(from, to).unwrap().matrix);
            for (q, p) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                assert_near("mirror y", (x[q][p] - SIGNS[q][p] * y[q][p]).norm(), 0.0, EXACT);
            }
            between = between.max(x[0][1].norm());
        }
        assert_eq!(between > 1e-3, ky != 0.0, "s and p mix in conical mounts only: {between}");
    }
}

#[test]
fn half_a_turn_about_z_changes_nothing() {
    let layers = asymmetric(0.3);
    let (here, turned) = (stack(layers.clone()), stack(mirrored(&layers)));
    for (kx0, ky) in [(0.2, 0.5), (0.31, 0.9), (0.2, 0.0)] {
        let a = solve(&here, Bloch::new(kx0, ky), 8);
        let b = solve(&turned, Bloch::new(-kx0, -ky), 8);
        assert_opposite_orders("half a turn", &a, &b, [[1.0; 2]; 2]);
    }
}

#[test]
fn orders_without_light_are_refused() {
    let scattering = solve(&stack(asymmetric(0.0)), Bloch::new(0.2, 0.1), 8);
    assert!(scattering.jones((Side::Top, 7), (Side::Top, 0)).is_none());
    assert!(scattering.jones((Side::Top, 0), (Side::Bottom, 7)).is_none());
    assert!(matches!(
        scattering.jones_of_all((Side::Bottom, 7)),
        Err(Error::Evanescent { order: 7, side: Side::Bottom })
    ));
    let all = scattering.jones_of_all((Side::Top, 0)).unwrap();
    let count = SIDES.iter().map(|&s| scattering.channels(s).len()).sum::<usize>();
    assert_eq!(all.len(), count);
}
