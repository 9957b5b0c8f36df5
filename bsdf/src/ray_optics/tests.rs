// SPDX-License-Identifier: MIT OR Apache-2.0
//! Unit cells against closed forms, sampling against beam tracing, and the laws of radiometry.

use super::*;
use crate::SmoothInterface;
use crate::analytic::fresnel;
use crate::direction::spherical;
use crate::tests::chi_square::{sidak_level, test_lobes};
use approx::assert_abs_diff_eq;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

const N: f64 = 1.41;

/// The same cell with another power below which it splits no beam.
fn split_to(power_cutoff: f64, cell: UnitCell) -> UnitCell {
    UnitCell { power_cutoff, ..cell }
}

/// A silicone outline under air.
fn silicone(period: f64, depth: f64, points: &[&[[f64; 2]]]) -> Outline {
    Outline {
        period,
        depth,
        index_inner: N,
        index_outer: 1.0,
        background: 1.0,
        polygons: points
            .iter()
            .map(|points| Polygon { index: N, points: points.to_vec() })
            .collect(),
    }
}

/// OS1 of ring 75 in its local frame: tread level and riser upright in the world, chord along t.
fn os1() -> (Outline, f64) {
    let height = |r: f64| (4.0 - r * r).sqrt() - 1.0;
    let slope = ((height(0.74) - height(0.75)) / 0.01_f64).atan();
    let period = 10.0 / slope.cos();
    let apex = [10.0 * slope.cos(), 10.0 * slope.sin()];
    (silicone(period, apex[1], &[&[[0.0, 0.0], [period, 0.0], apex]]), slope)
}

/// Reliefs of all kinds: stairs, leaning triangle, two materials, lamellar, buried, wider than a
/// period.
fn zoo() -> Vec<Outline> {
    let mut layered = silicone(5.0, 3.0, &[&[[0.0, 0.0], [5.0, 0.0], [5.0, 1.0], [0.0, 1.0]]]);
    layered
        .polygons
        .push(Polygon { index: 1.6, points: vec![[1.0, 0.5], [4.0, 0.5], [3.0, 2.5], [2.0, 3.0]] });
    layered.polygons.push(Polygon { index: 1.0, points: vec![[2.2, 1.2], [3.0, 1.4], [2.4, 2.0]] });
    vec![
        os1().0,
        silicone(10.0, 9.0, &[&[[0.0, 0.0], [10.0, 0.0], [14.0, 9.0]]]),
        silicone(10.0, 4.0, &[&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]]),
        silicone(10.0, 6.0, &[&[[-4.0, 0.0], [13.0, 0.0], [5.0, 6.0]]]),
        layered,
    ]
}

#[test]
fn flat_cell_is_a_smooth_interface() {
    let interface = SmoothInterface::new(N, 1.0).unwrap();
    for depth in [0.0, 2.0] {
        let cell = split_to(1e-14, UnitCell::new(&silicone(10.0, depth, &[])).unwrap());
        for theta in [0.0, 0.3, 0.7, 0.8, 1.2, 1.9, 2.3, 2.8, PI] {
            let wi = spherical(theta, 0.9);
            let expected = interface.lobes(wi, Polarisation::Unpolarised);
            let got = cell.lobes(wi, Polarisation::Unpolarised);
            assert_eq!(got.len(), expected.len());
            for lobe in got {
                let same =
                    expected.iter().find(|e| e.lobe.transport == lobe.lobe.transport).unwrap();
                assert!((same.wo - lobe.wo).length() < 1e-14);
                assert_abs_diff_eq!(same.power, lobe.power, epsilon = 1e-14);
            }
        }
    }
}

#[test]
fn plate_obeys_incoherent_airy_sums() {
    // A layer of silicone in air: R = 2 R0 / (1 + R0), T = (1 - R0) / (1 + R0).
    let mut plate = silicone(10.0, 3.0, &[]);
    plate.index_inner = 1.0;
    plate.background = N;
    let cell = split_to(1e-12, UnitCell::new(&plate).unwrap());
    let albedo = cell.albedo(-DVec3::Z, Polarisation::Unpolarised);
    assert_abs_diff_eq!(albedo.reflected, 0.056_256_484_1, epsilon = 1e-10);
    assert_abs_diff_eq!(albedo.transmitted, 0.943_743_515_9, epsilon = 1e-10);
}

#[test]
fn right_angled_prism_sends_light_back() {
    // A 45° roof of silicone: light along the normal meets both facets at 45°, in any plane of
    // incidence totally if 45° is beyond the critical angle. For n = 1.5 it is; back comes the
    // whole power, reversed in the plane of the roof.
    let mut roof = silicone(10.0, 5.0, &[&[[0.0, 0.0], [10.0, 0.0], [5.0, 5.0]]]);
    roof.index_inner = 1.5;
    roof.polygons[0].index = 1.5;
    let cell = UnitCell::new(&roof).unwrap();
    let lobes = cell.lobes(-DVec3::Z, Polarisation::Unpolarised);
    assert_eq!(lobes.len(), 1);
    assert!((lobes[0].wo + DVec3::Z).length() < 1e-12);
    assert_abs_diff_eq!(lobes[0].power, 1.0, epsilon = 1e-14);

    // Tilted by δ, light is still totally reflected at both facets and returns, reversed in x and
    // z: all but what the outer facet turns a little downward so near to the base that it passes
    // below the other facet, tan δ of the period.
    let delta = 0.02_f64;
    let wi = spherical(PI - delta, 0.0);
    let back = cell.lobes(wi, Polarisation::Unpolarised);
    let retro = back.iter().find(|l| (l.wo - wi).length() < 1e-9).unwrap();
    assert_abs_diff_eq!(retro.power, 1.0 - delta.tan(), epsilon = 1e-12);
    // In the groove direction nothing is reversed: ky goes on.
    let wi = spherical(PI - 0.1, PI / 2.0);
    let back = cell.lobes(wi, Polarisation::Unpolarised);
    let retro = back.iter().max_by(|a, b| a.power.total_cmp(&b.power)).unwrap();
    assert!((retro.wo - DVec3::new(0.0, -wi.y, wi.z)).length() < 1e-12);
    assert_abs_diff_eq!(retro.power, 1.0, epsilon = 1e-13);
}

#[test]
fn roof_of_low_index_splits_by_two_fresnel_coefficients() {
    // At n = 1.41, 45° lies just inside the critical angle 45.17°: R at the first facet, then R
    // again at the second.
    let cell =
        UnitCell::new(&silicone(10.0, 5.0, &[&[[0.0, 0.0], [10.0, 0.0], [5.0, 5.0]]])).unwrap();
    let r = fresnel(N, 1.0, FRAC_1_SQRT_2).for_polarisation(Polarisation::Unpolarised);
    let lobes = cell.lobes(-DVec3::Z, Polarisation::Unpolarised);
    let back = lobes.iter().find(|l| (l.wo + DVec3::Z).length() < 1e-12).unwrap();
    assert!(back.power >= r * r - 1e-12);
    // Refracted at nearly grazing angle along the facet, it meets the next roof; what stays is
    // bounded by power.
    assert_abs_diff_eq!(lobes.iter().map(|l| l.power).sum::<f64>(), 1.0, epsilon = 1e-12);
}

#[test]
fn stairs_refract_through_tread_and_riser() {
    let (outline, slope) = os1();
    assert_abs_diff_eq!(outline.period, 10.78, epsilon = 0.01);
    assert_abs_diff_eq!(outline.depth, 3.73, epsilon = 0.01);
    let cell = UnitCell::new(&outline).unwrap();
    // In the frame of the world: e across (outward), u up. t falls by the slope.
    let (e, u) =
        (DVec3::new(slope.cos(), 0.0, slope.sin()), DVec3::new(-slope.sin(), 0.0, slope.cos()));
    for (alpha, ky) in [(0.35_f64, 0.0), (0.6, 0.0), (0.5, 0.35), (0.2, 0.2)] {
        // Light that rises at angle alpha from the axis, outward, with some motion along the
        // grooves.
        let across = (N * N - ky * ky).sqrt();
        let (out, up) = (across * alpha.sin(), across * alpha.cos());
        let k = e * out + u * up + DVec3::Y * ky;
        let lobes = cell.lobes(-k / N, Polarisation::Unpolarised);
        // The tread lies level: it keeps `out`. The riser stands upright and keeps `up`: too much
        // for air, so it reflects totally, and the ray goes on inward to the tread above it.
        // Leaving that, it clears the next riser.
        let up_in_air = (1.0 - ky * ky - out * out).sqrt();
        let rise = 10.0 * slope.tan();
        assert!(ky * ky + up * up > 1.0 && (10.0 - rise * out / up) * up_in_air > rise * out);
        let share = |direction: DVec3| {
            let lobe = lobes.iter().find(|l| (l.wo - direction).length() < 1e-9);
            lobe.expect("a lobe in the direction that Snell's law gives").power
        };
        let direct = share(u * up_in_air + e * out + DVec3::Y * ky);
        let by_riser = share(u * up_in_air - e * out + DVec3::Y * ky);
        // Across the beam the tread (10 µm level) and the riser (upright) share the period.
        let (level, upright) = (10.0 * up, rise * out);
        let transmitted = 1.0 - fresnel(N, 1.0, up / N).for_polarisation(Polarisation::Unpolarised);
        assert_abs_diff_eq!(direct, transmitted * level / (level + upright), epsilon = 1e-10);
        assert_abs_diff_eq!(by_riser, transmitted * upright / (level + upright), epsilon = 1e-10);
        assert_abs_diff_eq!(lobes.iter().map(|l| l.power).sum::<f64>(), 1.0, epsilon = 1e-12);
    }
}

#[test]
fn power_closes_for_every_relief_and_side() {
    let mut rng = Pcg64::seed_from_u64(11);
    for outline in zoo() {
        let cell = UnitCell::new(&outline).unwrap();
        for k in 0..30 {
            let side = Side::BOTH[k % 2];
            let wi = crate::analytic::sample_cosine_hemisphere(&mut rng)
                * DVec3::new(1.0, 1.0, side.sign());
            let lobes = cell.lobes(wi, Polarisation::Unpolarised);
            assert_abs_diff_eq!(lobes.iter().map(|l| l.power).sum::<f64>(), 1.0, epsilon = 1e-12);
            let ky = -cell.index(side) * wi.y;
            for lobe in &lobes {
                assert_abs_diff_eq!(
                    cell.index(Side::from_direction(lobe.wo)) * lobe.wo.y,
                    ky,
                    epsilon = 1e-9
                );
            }
        }
        assert_eq!(cell.lost(), 0);
    }
}

#[test]
fn draws_agree_with_listed_lobes() {
    let mut rng = Pcg64::seed_from_u64(12);
    let directions = [
        spherical(PI - 0.5, 0.4),
        spherical(PI - 0.2, 2.6),
        spherical(0.9, 3.6),
        spherical(0.1, 0.0),
    ];
    let level = sidak_level(zoo().len() * directions.len());
    for (k, outline) in zoo().iter().enumerate() {
        let cell = split_to(1e-6, UnitCell::new(outline).unwrap());
        for wi in directions {
            let drawn = test_lobes(&cell, wi, 100_000, &mut rng);
            // Beams below the cutoff are not split, so a few of the weakest directions are drawn
            // without being listed.
            assert!(
                drawn.unlisted < 50,
                "relief {k}, wi {wi}: {} draws not listed",
                drawn.unlisted
            );
            assert!(drawn.p_value > level, "relief {k}, wi {wi}: p = {}", drawn.p_value);
        }
    }
}

#[test]
fn no_ray_is_lost_in_ten_million() {
    let mut rng = Pcg64::seed_from_u64(13);
    for outline in zoo() {
        let cell = UnitCell::new(&outline).unwrap();
        for k in 0..2_000_000 {
            let side = Side::BOTH[k % 2];
            let wi = crate::analytic::sample_cosine_hemisphere(&mut rng)
                * DVec3::new(1.0, 1.0, side.sign());
            let sample = cell.sample(wi, &mut rng);
            assert!(sample.is_some_and(|s| (s.wo.length_squared() - 1.0).abs() < 1e-12));
        }
        assert_eq!(cell.lost(), 0);
    }
}

#[test]
fn diffuse_light_obeys_reciprocity_of_etendue() {
    // n1² T(1→2) = n2² T(2→1) for Lambertian illumination of any lossless relief.
    let mut rng = Pcg64::seed_from_u64(14);
    let draws = 400_000;
    for outline in zoo() {
        let cell = UnitCell::new(&outline).unwrap();
        let [(inner, inner_error), (outer, outer_error)] = Side::BOTH.map(|side| {
            let through = (0..draws)
                .filter(|_| {
                    let wi = crate::analytic::sample_cosine_hemisphere(&mut rng)
                        * DVec3::new(1.0, 1.0, side.sign());
                    cell.sample(wi, &mut rng)
                        .is_some_and(|s| s.lobe.transport == Transport::Transmission)
                })
                .count();
            let t = through as f64 / f64::from(draws);
            let n2 = cell.index(side).powi(2);
            (n2 * t, n2 * (t * (1.0 - t) / f64::from(draws)).sqrt())
        });
        assert!(
            (inner - outer).abs() < 5.0 * inner_error.hypot(outer_error),
            "{inner} and {outer}"
        );
        assert!(inner < 1.0 && inner > 0.3);
    }
}

/// A triangle under air.
fn triangle() -> Outline {
    silicone(10.0, 4.0, &[&[[0.0, 0.0], [10.0, 0.0], [8.0, 4.0]]])
}

#[test]
fn ways_of_writing_one_relief_are_one_relief() {
    let wi = spherical(PI - 0.4, 0.7);
    let reference = UnitCell::new(&triangle()).unwrap();
    let expected = reference.lobes(wi, Polarisation::Unpolarised);
    let shifted: &[[f64; 2]] = &[[33.0, 0.0], [43.0, 0.0], [41.0, 4.0]];
    let clockwise: &[[f64; 2]] = &[[8.0, 4.0], [10.0, 0.0], [0.0, 0.0]];
    let left: &[[f64; 2]] = &[[0.0, 0.0], [8.0, 0.0], [8.0, 4.0]];
    let right: &[[f64; 2]] = &[[8.0, 0.0], [10.0, 0.0], [8.0, 4.0]];
    let level: &[[f64; 2]] = &[[0.0, 0.0], [10.0, 0.0], [10.0, 4.0], [0.0, 4.0]];
    let mut carved = silicone(10.0, 4.0, &[level]);
    for air in [[[0.0, 0.0], [8.0, 4.0], [0.0, 4.0]], [[8.0, 4.0], [10.0, 0.0], [10.0, 4.0]]] {
        carved.polygons.push(Polygon { index: 1.0, points: air.to_vec() });
    }
    let others = [
        silicone(10.0, 4.0, &[shifted]),
        silicone(10.0, 4.0, &[clockwise]),
        silicone(10.0, 4.0, &[left, right]),
        carved,
    ];
    for outline in others {
        let cell = UnitCell::new(&outline).unwrap();
        assert_eq!(cell.facets.len(), reference.facets.len());
        let lobes = cell.lobes(wi, Polarisation::Unpolarised);
        assert_eq!(lobes.len(), expected.len());
        for (a, b) in lobes.iter().zip(&expected) {
            assert!((a.wo - b.wo).length() < 1e-9);
            assert_abs_diff_eq!(a.power, b.power, epsilon = 1e-4);
        }
    }
}

#[test]
fn bad_outlines_are_refused() {
    let refuse = |outline: Outline| UnitCell::new(&outline).unwrap_err().to_string();
    let bow: &[[f64; 2]] = &[[0.0, 0.0], [8.0, 4.0], [8.0, 0.0], [0.0, 4.0]];
    assert!(refuse(silicone(10.0, 4.0, &[bow])).contains("do not meet"));
    assert!(
        refuse(silicone(10.0, 4.0, &[&[[0.0, 0.0], [21.0, 0.0], [8.0, 4.0]]]))
            .contains("two periods")
    );
    assert!(
        refuse(silicone(10.0, 4.0, &[&[[0.0, 0.0], [5.0, 0.0], [3.0, 5.0]]]))
            .contains("0 <= z <= 4")
    );
    assert!(
        refuse(silicone(10.0, 4.0, &[&[[0.0, 0.0], [5.0, 0.0]]]))
            .contains("at least 3 points, got 2")
    );
    let flat: &[[f64; 2]] = &[[0.0, 0.0], [5.0, 0.0], [9.0, 0.0]];
    assert!(refuse(silicone(10.0, 4.0, &[flat])).contains("do not meet"));
    let spike: &[[f64; 2]] = &[[0.0, 0.0], [5.0, 0.0], [2.0, 3.0], [2.0, 4.0], [2.0, 3.0]];
    assert!(refuse(silicone(10.0, 4.0, &[spike])).contains("do not meet"));
    let twice: &[[f64; 2]] = &[[0.0, 0.0], [5.0, 0.0], [2.0, 3.0], [0.0, 0.0]];
    assert!(refuse(silicone(10.0, 4.0, &[twice])).contains("[0.0, 0.0] twice"));
    assert!(
        refuse(silicone(-1.0, 4.0, &[]))
            .contains("period of a unit cell must be a positive, finite length, got -1")
    );
    let mut dark = triangle();
    dark.polygons[0].index = f64::NAN;
    assert!(refuse(dark).contains("polygon 1"));
}

#[test]
fn coinciding_corners_and_sides_lose_no_ray() {
    // Polygons on a coarse lattice, light along its directions: shared corners, sides upon sides,
    // grazing and parallel rays.
    let mut rng = Pcg64::seed_from_u64(15);
    let mut built = 0;
    for _ in 0..2000 {
        let mut outline = silicone(4.0, 3.0, &[]);
        for _ in 0..rng.random_range(1..4) {
            let index = [1.0, N, 1.6][rng.random_range(0..3)];
            let corners = rng.random_range(3..6);
            let points = (0..corners)
                .map(|_| [f64::from(rng.random_range(-1..6)), f64::from(rng.random_range(0..4))])
                .collect();
            outline.polygons.push(Polygon { index, points });
        }
        let Ok(cell) = UnitCell::new(&outline) else {
            continue;
        };
        let cell = split_to(1e-3, cell);
        built += 1;
        for k in 0..6 {
            let side = Side::BOTH[k % 2];
            let theta = [0.0, 0.25 * PI, 0.3][k / 2];
            let wi = spherical(theta, 0.0) * DVec3::new(1.0, 1.0, side.sign());
            let total: f64 =
                cell.lobes(wi, Polarisation::Unpolarised).iter().map(|l| l.power).sum();
            assert_abs_diff_eq!(total, 1.0, epsilon = 1e-9);
            for _ in 0..300 {
                assert!(cell.sample(wi, &mut rng).is_some(), "{outline:?} {wi}");
            }
        }
        assert_eq!(cell.lost(), 0, "{outline:?}");
    }
    assert!(built > 200);
}

/// A right-angled prism sends the light that comes straight from below back, by two total
/// reflections; light across the other way leaves at 45° - asin(sin(45°)/n) from the axis.
#[test]
fn a_line_of_prisms_is_a_retroreflector_and_turns_with_its_grooves() {
    let line = [[0.0, 0.0], [12.0, 12.0], [24.0, 0.0]];
    let cell =
        |turn: f64| UnitCell::new(&Outline::below(&line, [1.586, 1.0])).unwrap().turned(turn);
    let straight = cell(0.3).lobes(-DVec3::Z, Polarisation::Unpolarised);
    let back: f64 =
        straight.iter().filter(|lobe| lobe.wo.dot(-DVec3::Z) > 1.0 - 1e-12).map(|l| l.power).sum();
    assert_abs_diff_eq!(back, 1.0, epsilon = 1e-9);

    // Refracted straight up by the facet that rises along +x.
    let inside = PI / 4.0 - (FRAC_1_SQRT_2 / 1.586).asin();
    for turn in [0.0, 0.7, PI / 2.0, 2.5] {
        let across = DVec3::new(turn.cos(), turn.sin(), 0.0);
        let wi = -(across * inside.sin() + DVec3::Z * inside.cos());
        let lobes = cell(turn).lobes(wi, Polarisation::Unpolarised);
        let up: f64 = lobes.iter().filter(|l| l.wo.z > 1.0 - 1e-9).map(|l| l.power).sum();
        assert!(up > 0.2, "{turn}: {lobes:?}");
        let along = DVec3::new(-turn.sin(), turn.cos(), 0.0);
        let wi = -(along * inside.sin() + DVec3::Z * inside.cos());
        assert!(cell(turn).lobes(wi, Polarisation::Unpolarised).iter().all(|l| l.wo.z < 0.999));
    }
}

/// Stokes parameters behind a level facet are Fresnel's, and two total reflections turn light that
/// is linearly polarised at 45° by Born and Wolf's phase, tan δ/2 = cos θ √(sin² θ - n⁻²)/sin² θ.
#[test]
fn polarised_light_keeps_account_of_every_facet() {
    let mut rng = Pcg64::seed_from_u64(12);
    let flat = UnitCell::new(&Outline::below(&[[0.0, 0.0], [1.0, 0.0]], [N, 1.0])).unwrap();
    let flat = flat.turned(0.7);
    for (wi, from, to) in [(spherical(1.1, 0.4), 1.0, N), (spherical(PI - 0.6, 2.0), N, 1.0)] {
        let r = fresnel(from, to, wi.z.abs());
        let mut seen = [false; 2];
        while seen != [true; 2] {
            let (sample, [q, u, v]) = flat.sample_polarised(wi, [0.0; 3], &mut rng).unwrap();
            let transport = sample.lobe.transport;
            let [s, p] = match transport {
                Transport::Reflection => [r.s, r.p],
                Transport::Transmission => [1.0 - r.s, 1.0 - r.p],
            };
            seen[transport.index()] = true;
            assert_abs_diff_eq!(q, (s - p) / (s + p), epsilon = 1e-12);
            assert_abs_diff_eq!(u.hypot(v), 0.0, epsilon = 1e-12);
        }
    }
    let n = 1.586_f64;
    let ridges = Outline::below(&[[0.0, 0.0], [25.0, 25.0], [50.0, 0.0]], [n, 1.0]);
    let prisms = UnitCell::new(&ridges).unwrap();
    let phase = 2.0 * ((0.5 - 1.0 / (n * n)).sqrt() * FRAC_1_SQRT_2 / 0.5).atan();
    for _ in 0..20 {
        let (sample, [q, u, v]) =
            prisms.sample_polarised(DVec3::NEG_Z, [0.0, 1.0, 0.0], &mut rng).unwrap();
        assert_abs_diff_eq!(sample.wo.z, -1.0, epsilon = 1e-12);
        assert_abs_diff_eq!(q, 0.0, epsilon = 1e-12);
        assert_abs_diff_eq!(u.abs(), (2.0 * phase).cos().abs(), epsilon = 1e-12);
        assert_abs_diff_eq!(v.abs(), (2.0 * phase).sin().abs(), epsilon = 1e-12);
    }
}
