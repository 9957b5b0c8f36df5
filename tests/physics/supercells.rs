// SPDX-License-Identifier: MIT OR Apache-2.0
//! Supercells of equal teeth give the efficiencies of the grating of one tooth.
//!
//! Sources: equivalence of a grating and its multiple periods; energy; Fresnel's coefficients.

use batwing_tests::supercell::effect::{Gathered, effect};
use batwing_tests::supercell::surface::{Neighbours, Ring};
use batwing_tests::supercell::waves::{Lines, Wave, grating, of_one_tooth, supercell};
use rcwa::Side;

/// Far fewer orders than propagate: exact laws hold at any truncation.
const FEW: usize = 5;

fn lines() -> Lines {
    let passing = Lines::passing();
    Lines { ky: passing.ky[..2].to_vec(), weight: passing.weight[..2].to_vec() }
}

fn largest_difference(a: &[Wave], b: &[Wave]) -> f64 {
    assert_eq!(a.len(), b.len());
    let of = |(x, y): (&Wave, &Wave)| {
        assert_eq!((x.side, x.line, x.node), (y.side, y.line, y.node));
        let pairs = x.transmitted.iter().zip(&y.transmitted);
        pairs.map(|(p, q)| (p - q).abs()).fold((x.reflected - y.reflected).abs(), f64::max)
    };
    a.iter().zip(b).map(of).fold(0.0, f64::max)
}

#[test]
#[ignore = "slow: 5 s"]
fn equal_teeth_are_the_grating_of_one() {
    for (file, number) in [("d1.toml", 75), ("d2.toml", 25)] {
        let ring = Ring::of(file, number).expect("a ring");
        for teeth in [1, 3, 5] {
            let surface = ring.supercell(teeth, Neighbours::Same).expect("a surface");
            let plan = surface.plan(1.0);
            let together = surface.stack(&plan).expect("a stack");
            let together = supercell(&together, teeth, FEW, &lines()).expect("waves");
            let alone = ring.grating(&surface).expect("a surface");
            let alone = alone.stack(&plan).expect("a stack");
            let alone = grating(&alone, teeth, FEW, &lines()).expect("waves");
            assert!(together.len() > 20 * teeth, "{}", together.len());
            let difference = largest_difference(&together, &alone);
            assert!(difference < 1e-9, "{file} {number}, {teeth}: {difference:.1e}");
        }
    }
}

#[test]
fn one_tooth_and_a_plane_share_all_power() {
    let ring = Ring::of("d1.toml", 75).expect("a ring");
    let surface = ring.supercell(3, Neighbours::Plane).expect("a surface");
    let stack = surface.stack(&surface.plan(1.0)).expect("a stack");
    let with_plane = supercell(&stack, 3, FEW, &lines()).expect("waves");
    let plane = surface.plane().expect("a stack");
    let plane = supercell(&plane, 3, FEW, &lines()).expect("waves");
    // s and p of Fresnel's coefficients, for the waves with kx = 0.
    for wave in plane.iter().filter(|w| w.node == 0) {
        let (n, ky) = (1.41_f64, lines().ky[wave.line]);
        let (inner, outer) = ((n * n - ky * ky).sqrt(), (1.0 - ky * ky).sqrt());
        let s = (inner - outer) / (inner + outer);
        let p = (inner / (n * n) - outer) / (inner / (n * n) + outer);
        let expected = 1.0 - 0.5 * (s * s + p * p);
        assert!((wave.passes() - expected).abs() < 1e-12, "{wave:?}");
    }
    let tooth = of_one_tooth(&with_plane, &plane, 3);
    assert_eq!(tooth.len(), with_plane.len());
    for wave in &tooth {
        assert!((wave.passes() + wave.reflected - 1.0).abs() < 1e-9, "{wave:?}");
    }
    // A plane is not a tooth.
    assert!(largest_difference(&tooth, &plane) > 0.1);
}

#[test]
fn true_neighbours_stand_on_the_sphere() {
    for (number, teeth) in [(5, 3), (75, 3), (75, 5), (165, 3)] {
        let ring = Ring::of("d1.toml", number).expect("a ring");
        let surface = ring.supercell(teeth, Neighbours::True).expect("a surface");
        let outline = &surface.relief.polygons()[0].points;
        // Base corners and apices of OS1, and two corners below.
        assert_eq!(outline.len(), 2 * teeth + 1 + 2);
        let chord = ring.period_um();
        let heights: Vec<f64> = outline[..=2 * teeth].iter().map(|p| p[1]).collect();
        // A circle of 2 mm falls by x²/4 mm at x from the middle of a chord.
        for (corner, height) in heights.iter().step_by(2).enumerate() {
            let x = (corner as f64 - 0.5 * teeth as f64) * chord;
            let fall = (x * x - 0.25 * chord * chord) / 4000.0;
            // Chords grow outwards, by 1.3 % at ring 165; the ends were brought to one height.
            let tolerance = 0.03 * fall.abs() + surface.mismatch_um.abs() + 1e-6;
            let got = surface.level_um - height;
            assert!(
                (got - fall).abs() < tolerance,
                "{number}, {teeth}, corner {corner}: {got}, {fall}"
            );
        }
        assert!(surface.stretched.abs() < 1e-3 && surface.mismatch_um.abs() < 0.01);
        let flat = ring.supercell(teeth, Neighbours::InLine).expect("a surface");
        let outline = &flat.relief.polygons()[0].points;
        for corner in outline[..=2 * teeth].iter().step_by(2) {
            assert!((corner[1] - flat.level_um).abs() < 1e-12);
        }
    }
}

#[test]
fn effects_are_those_put_in() {
    let ring = Ring::of("d1.toml", 5).expect("a ring");
    let surface = ring.supercell(3, Neighbours::Same).expect("a surface");
    let plane = surface.plane().expect("a stack");
    let waves = supercell(&plane, 3, 40, &lines()).expect("waves");
    let same = effect(&waves, &waves, Side::Top, Gathered::Ranges(10.0));
    assert!(same.passes[0] > 0.3 && same.passes[0].to_bits() == same.passes[1].to_bits());
    assert_eq!((same.total, same.moved, same.turn_deg), (0.0, 0.0, 0.0));

    let mut turned = waves.clone();
    for wave in &mut turned {
        wave.transmitted.rotate_right(1);
    }
    let got = effect(&waves, &turned, Side::Top, Gathered::Single);
    assert!(got.total < 1e-12 && (got.moved - got.passes[0]).abs() < 1e-12);
    // No light is in the last bin, which would come round to the first.
    assert!((got.turn_deg - 2.0).abs() < 1e-9, "{got:?}");

    let mut weaker = waves.clone();
    for share in weaker.iter_mut().flat_map(|w| &mut w.transmitted) {
        *share *= 0.9;
    }
    for how in [Gathered::Single, Gathered::Ranges(10.0), Gathered::Diffuse] {
        let got = effect(&waves, &weaker, Side::Bottom, how);
        assert!((got.total - 0.1 * got.passes[0]).abs() < 1e-12);
        assert!((got.moved - 0.05 * got.passes[0]).abs() < 1e-12 && got.turn_deg < 1e-9);
    }
}
