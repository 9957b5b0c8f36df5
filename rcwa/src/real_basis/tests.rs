// SPDX-License-Identifier: MIT OR Apache-2.0
//! Stacks that are their own mirror image, in real arithmetic, against running waves in complex
//! arithmetic.

use super::*;
use crate::expansion::FieldGroup;
use crate::hemisphere::{Interface, Resolution};
use crate::linalg::Scalar;
use crate::progress::no_progress;
use crate::real_basis::solve::{LineCache, RealSolutions, solve_real};
use crate::relief::shapes::{self, Materials};
use crate::relief::{Layer, Polygon, Relief, Segment};
use crate::solve::solve_plainly;
use crate::{Pol, Scattering};

/// Largest difference of any amplitude, for light from both sides.
fn difference(a: &Scattering, b: &Scattering) -> f64 {
    let waves = |s: &Scattering| -> Vec<(Side, i32, Pol)> {
        let of = |side| s.orders(side).map(move |m| (side, m)).collect::<Vec<_>>();
        let both = [of(Side::Top), of(Side::Bottom)].concat();
        both.into_iter().flat_map(|(side, m)| Pol::BOTH.map(|pol| (side, m, pol))).collect()
    };
    let all = waves(a);
    assert_eq!(all, waves(b));
    let pairs = all.iter().flat_map(|&from| all.iter().map(move |&to| (from, to)));
    pairs
        .map(|(from, to)| (a.amplitude(from, to) - b.amplitude(from, to)).norm())
        .fold(0.0, f64::max)
}

const KY: [f64; 6] = [0.0, 0.21, 0.77, 1.13, 1.38, 1.62];

fn solved(stack: &Stack, line: &RealBasis, blochs: &[Bloch]) -> Vec<Option<Scattering>> {
    let mut cache = LineCache::none();
    match solve_real(stack, line, blochs, &mut cache, &no_progress).unwrap() {
        RealSolutions::Each(found) => found,
        RealSolutions::NoModes { .. } => panic!("modes are real"),
    }
}

/// Largest difference between real numbers and running waves, which keep the same orders unless at
/// the edge of a zone.
fn worst(stack: &Stack, line: &RealBasis, kx0: f64, truncation: Truncation) -> f64 {
    let blochs: Vec<Bloch> = KY.iter().map(|&ky| Bloch::new(kx0, ky)).collect();
    let ours = solved(stack, line, &blochs);
    let each = ours.iter().zip(&blochs).map(|(ours, &bloch)| {
        let plain = solve_plainly(stack, bloch, truncation).unwrap();
        difference(ours.as_ref().expect("in real numbers"), &plain)
    });
    each.fold(0.0, f64::max)
}

/// The wavevectors at the edge of the zone with these ky.
fn edge(stack: &Stack, ky: &[f64]) -> Vec<Bloch> {
    let kx0 = SymmetricBloch::Edge.kx0(stack);
    ky.iter().map(|&ky| Bloch::new(kx0, ky)).collect()
}

fn truncation(highest: usize) -> Truncation {
    Truncation::new(highest).unwrap()
}

/// An isosceles tooth of stairs, off the origin and across the end of the period.
fn stairs(apex: f64) -> Stack {
    let tooth = Polygon {
        index: 1.41.into(),
        points: vec![[apex - 1.1, 0.0], [apex + 1.1, 0.0], [apex, 1.3]],
    };
    let relief = Relief::new(2.7, 1.3, 1.0.into(), vec![tooth]).unwrap();
    Stack::new(0.55, 2.7, 1.41.into(), 1.0.into(), relief.slices(9)).unwrap()
}

/// The same with its sides followed.
fn followed(apex: [f64; 2], slices: usize) -> Stack {
    let tooth = Polygon { index: 1.41.into(), points: vec![[0.5, 0.0], [2.7, 0.0], apex] };
    let relief = Relief::new(2.9, 1.3, 1.0.into(), vec![tooth]).unwrap();
    let plan = relief.slice_plan(slices);
    let interface =
        Interface { relief, wavelength: 0.55, n_top: 1.41.into(), n_bottom: 1.0.into() };
    let resolution = Resolution { truncation: truncation(12), plan };
    let (stack, None) = interface.stacks(&resolution).unwrap() else {
        panic!("sides are followed");
    };
    assert!(stack.wall_corrections().iter().any(|d| !d.is_empty()));
    stack
}

#[test]
fn only_what_is_its_own_mirror_image_has_a_centre() {
    for apex in [1.3, 0.2] {
        let found = centre(&stairs(apex)).unwrap();
        let beside = 2.0 * (found - apex / 2.7);
        assert!((beside - beside.round()).abs() < 1e-12, "{apex}: {found}");
    }
    assert!(centre(&followed([1.6, 1.3], 12)).is_some());
    // Apex aside; and sections that are symmetric, each about a centre of its own.
    assert!(centre(&followed([1.7, 1.3], 12)).is_none());
    let ridge = |x0: f64, x1: f64| {
        let segments = [(0.0, x0, 1.0), (x0, x1, 1.41), (x1, 1.0, 1.0)];
        let segments = segments.map(|(x0, x1, n): (_, _, f64)| Segment { x0, x1, index: n.into() });
        Layer::new(0.1, segments.to_vec()).unwrap()
    };
    let of = |layers| Stack::new(0.55, 2.0, 1.41.into(), 1.0.into(), layers).unwrap();
    assert!(centre(&of(vec![ridge(0.1, 0.5), ridge(0.2, 0.4)])).is_some());
    assert!(centre(&of(vec![ridge(0.1, 0.5), ridge(0.2, 0.41)])).is_none());
    // Opposite centres are one axis.
    assert!(centre(&of(vec![ridge(0.1, 0.3), ridge(0.6, 0.8)])).is_some());
    // Of two ridges alike the axis between them may be the one that serves.
    let ends = [(0.0, 0.1, 1.0), (0.1, 0.3, 1.41), (0.3, 0.6, 1.0)];
    let ends = [&ends[..], &[(0.6, 0.8, 1.41), (0.8, 1.0, 1.0)]].concat();
    let segments =
        ends.into_iter().map(|(x0, x1, n): (_, _, f64)| Segment { x0, x1, index: n.into() });
    let two = Layer::new(0.1, segments.collect()).unwrap();
    assert!(centre(&of(vec![two, ridge(0.35, 0.55)])).is_some());
}

#[test]
fn walls_that_lean_the_same_way_are_no_mirror_images() {
    let wall = |x, xz| Wall { x, xx: 0.8, xz };
    assert!(are_mirrored(&[wall(0.2, 0.4), wall(0.6, -0.4)], 0.4));
    assert!(are_mirrored(&[wall(0.05, -0.4), wall(0.95, 0.4)], 0.0));
    assert!(!are_mirrored(&[wall(0.2, 0.4), wall(0.6, 0.4)], 0.4));
}

#[test]
fn parities_apart_are_running_waves() {
    for apex in [1.3, 0.2] {
        let stack = stairs(apex);
        let line =
            RealBasis::of_symmetric_line(&stack, SymmetricBloch::Centre, truncation(14)).unwrap();
        assert_eq!(line.parts().len(), 2);
        let deviation = worst(&stack, &line, 0.0, truncation(14));
        assert!(deviation < 1e-10, "{apex}: {deviation:.1e}");
    }
}

#[test]
fn orders_in_real_numbers_are_running_waves() {
    for (apex, kx0) in [(1.3, 0.043), (0.2, 0.043), (0.2, -0.091), (0.2, 0.7)] {
        let stack = stairs(apex);
        let line = RealBasis::of_any_line(&stack, kx0, truncation(14)).unwrap();
        assert_eq!(line.parts().len(), 1);
        let deviation = worst(&stack, &line, kx0, truncation(14));
        assert!(deviation < 1e-10, "{apex} {kx0}: {deviation:.1e}");
    }
}

/// At the edge running waves keep other orders: all standing waves together are compared with the
/// two parities.
#[test]
fn parities_at_the_edge_are_all_standing_waves() {
    for stack in [stairs(0.2), followed([1.6, 1.3], 12)] {
        let apart =
            RealBasis::of_symmetric_line(&stack, SymmetricBloch::Edge, truncation(12)).unwrap();
        assert_eq!(apart.parts().len(), 2);
        let all = RealFunctions::standing(SymmetricBloch::Edge, 12, stack.period_per_wavelength());
        let together = RealBasis { parts: vec![all], orders: apart.orders.clone() };
        let blochs = edge(&stack, &KY);
        let solved = [&apart, &together].map(|line| solved(&stack, line, &blochs));
        let has_sides = !stack.wall_corrections()[0].is_empty();
        let allowed = if has_sides { 2e-4 } else { 1e-10 };
        for (a, b) in solved[0].iter().zip(&solved[1]) {
            let deviation = difference(a.as_ref().unwrap(), b.as_ref().unwrap());
            assert!(deviation < allowed, "{deviation:.1e}");
        }
    }
}

/// The parts of the walls' corrections that are left out differ.
#[test]
fn followed_sides_are_those_of_running_waves() {
    let stack = followed([1.6, 1.3], 12);
    for kx0 in [0.0, 0.043, -0.091] {
        let line = RealBasis::of_any_line(&stack, kx0, truncation(12)).unwrap();
        let deviation = worst(&stack, &line, kx0, truncation(12));
        assert!(deviation < 6e-5, "{kx0}: {deviation:.1e}");
    }
}

fn layer(thickness: f64, ends: &[(f64, f64)]) -> Layer {
    let mut x0 = 0.0;
    let segments = ends.iter().map(|&(x1, n)| {
        let index = n.into();
        let segment = Segment { x0, x1, index };
        x0 = x1;
        segment
    });
    Layer::new(thickness, segments.collect()).unwrap()
}

/// Nothing, a film, a ridge across the end of the period, several ridges, and degenerate modes:
/// κ of order 9 is 1.5, the index of the film.
#[test]
fn simple_stacks_are_running_waves_on_all_lines() {
    let ridge = layer(0.2, &[(0.13, 1.0), (0.57, 1.41), (1.0, 1.0)]);
    let across = layer(0.2, &[(0.1, 1.7), (0.8, 1.0), (1.0, 1.7)]);
    let several =
        layer(0.1, &[(0.1, 1.2), (0.3, 1.7), (0.5, 1.0), (0.7, 1.7), (0.8, 1.2), (1.0, 2.0)]);
    let film = |n| layer(0.2, &[(1.0, n)]);
    let grating = layer(0.1, &[(0.3, 1.2), (1.0, 1.7)]);
    let all = [
        (1.0, vec![]),
        (1.0, vec![film(2.1)]),
        (1.41, vec![ridge]),
        (1.0, vec![across.clone(), film(1.9), across]),
        (1.0, vec![several]),
        (1.0, vec![film(1.5), grating]),
    ];
    for (number, (n_bottom, layers)) in all.into_iter().enumerate() {
        let stack = Stack::new(0.55, 3.3, 1.41.into(), n_bottom.into(), layers).unwrap();
        for kx0 in [0.0, 0.043, -1.31] {
            let line = RealBasis::of_any_line(&stack, kx0, truncation(12)).unwrap();
            assert_eq!(line.parts().len(), if kx0 == 0.0 { 2 } else { 1 });
            let deviation = worst(&stack, &line, kx0, truncation(12));
            assert!(deviation < 1e-11, "{number} {kx0}: {deviation:.1e}");
        }
    }
}

/// At these periods and wavelengths κ of an order and its kx by the grating equation differ in the
/// last bit, on either side of the cut-off.
#[test]
fn orders_at_their_cut_off_at_the_edge_of_the_zone_are_kept_or_left_in_pairs() {
    for (wavelength, period) in [(0.5, 2.75), (0.55, 9.625), (0.6, 3.3), (0.6, 2.1)] {
        let ridges = [
            layer(0.1, &[(0.4, 1.41), (1.0, 1.0)]),
            layer(0.1, &[(0.2, 1.41), (0.5, 1.2), (1.0, 1.0)]),
        ];
        for ridge in ridges {
            let stack =
                Stack::new(wavelength, period, 1.41.into(), 1.0.into(), vec![ridge]).unwrap();
            let line =
                RealBasis::of_symmetric_line(&stack, SymmetricBloch::Edge, truncation(30)).unwrap();
            let found = &solved(&stack, &line, &edge(&stack, &[0.0, 0.3]))[0];
            let (_, _, _, balance) = found.as_ref().unwrap().worst_balance().unwrap();
            assert!(balance.abs() < 1e-12, "{wavelength} {period}: {balance:.1e}");
        }
    }
}

#[test]
fn one_order_alone_is_not_split() {
    let materials = Materials::lossless(1.41, 1.0);
    let layers = shapes::step(0.3, 0.2, materials).unwrap().slices(3);
    let stack = Stack::new(0.55, 0.3, 1.41.into(), 1.0.into(), layers).unwrap();
    let line = RealBasis::of_symmetric_line(&stack, SymmetricBloch::Centre, truncation(0)).unwrap();
    assert_eq!(line.parts().len(), 1);
    assert!(worst(&stack, &line, 0.0, truncation(0)) < 1e-12);
}

/// A folded point makes of Ey the same as it and its mirror image.
#[test]
fn folded_points_have_those_of_both_halves() {
    use crate::expansion::Expansion;
    let all = RealFunctions::standing(SymmetricBloch::Centre, 4, 3.0);
    let [_, odd] = all.halves();
    let even_in_z = &all.parities(0.0)[1];
    let sum = |vectors: Vec<Vec<f64>>, i: usize, j: usize| -> f64 {
        vectors.iter().map(|v| v[i] * v[j]).sum()
    };
    let z = odd[1].clone();
    for i in 0..even_in_z.count(FieldGroup::Z) {
        for j in 0..even_in_z.count(FieldGroup::Z) {
            let folded = sum(even_in_z.point_values(0.2), i, j);
            let (i, j) = (z.start + i, z.start + j);
            let both = sum(all.point_values(0.2), i, j) + sum(all.point_values(-0.2), i, j);
            assert!((folded - both).squared() < 1e-24);
        }
    }
}
