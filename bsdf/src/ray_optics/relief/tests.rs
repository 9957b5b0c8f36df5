// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reliefs against closed forms, a flat face and grooves, and the laws of radiometry. Meshes of the
//! same reliefs: `tracer/tests/reliefs.rs`.

use super::*;
use crate::analytic::{fresnel, sample_cosine_hemisphere};
use crate::bsdf::Transport;
use crate::direction::spherical;
use crate::{Outline, SmoothInterface, UnitCell};
use approx::assert_abs_diff_eq;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::f64::consts::FRAC_PI_4;

const N: f64 = 1.586;
const SHAPES: [ReliefShape; 3] = [ReliefShape::Lens, ReliefShape::Pyramid, ReliefShape::Cone];
const LATTICES: [ReliefLattice; 2] = [ReliefLattice::Square, ReliefLattice::Hexagonal];

fn relief(
    lattice: ReliefLattice,
    shape: ReliefShape,
    base: f64,
    height: f64,
    is_pressed_in: bool,
) -> Relief {
    Relief { lattice, shape, pitch: 50.0, base, height, is_pressed_in }
}

fn cell(relief: Relief) -> ReliefCell {
    ReliefCell::new(relief, [N, 1.0]).unwrap().turned(0.4)
}

/// Full and partial bases, up to half balls and steep tips, raised and pressed in.
fn zoo() -> Vec<Relief> {
    let mut all = Vec::new();
    for lattice in LATTICES {
        for shape in SHAPES {
            for (base, height) in [(50.0, 25.0), (50.0, 4.0), (35.0, 12.0)] {
                for is_pressed_in in [false, true] {
                    all.push(relief(lattice, shape, base, height, is_pressed_in));
                }
            }
        }
        all.push(relief(lattice, ReliefShape::Cone, 30.0, 90.0, false));
        all.push(relief(lattice, ReliefShape::Pyramid, 50.0, 120.0, true));
    }
    all
}

/// Share that passes, and its standard error.
fn passed(cell: &ReliefCell, wi: DVec3, draws: u32, rng: &mut Pcg64) -> (f64, f64) {
    let through = (0..draws)
        .filter_map(|_| cell.sample(wi, rng))
        .filter(|s| s.lobe.transport == Transport::Transmission)
        .count();
    let t = through as f64 / f64::from(draws);
    (t, (t * (1.0 - t) / f64::from(draws)).sqrt().max(1e-9))
}

#[test]
fn vanishing_reliefs_are_smooth_interfaces() {
    let interface = SmoothInterface::new(N, 1.0).unwrap();
    let mut rng = Pcg64::seed_from_u64(31);
    for lattice in LATTICES {
        for shape in SHAPES {
            // Flat over the whole cell, and steep on next to nothing of it.
            for (base, height) in [(50.0, 1e-8), (1e-4, 5e-5)] {
                for pressed in [false, true] {
                    let cell = cell(relief(lattice, shape, base, height, pressed));
                    for wi in [spherical(0.5, 1.0), spherical(PI - 0.4, 2.0), spherical(2.2, 0.1)] {
                        let expected = interface.albedo(wi, Polarisation::Unpolarised).transmitted;
                        let (t, error) = passed(&cell, wi, 20_000, &mut rng);
                        assert!((t - expected).abs() < 4.5 * error, "{shape:?} {t} {expected}");
                        for lobe in cell.lobes(wi, Polarisation::Unpolarised) {
                            let straight = match lobe.lobe.transport {
                                Transport::Reflection => crate::direction::mirrored(wi),
                                Transport::Transmission => interface.refracted(wi).unwrap(),
                            };
                            assert!((lobe.wo - straight).length() < 1e-6);
                        }
                    }
                }
            }
        }
    }
}

/// Light straight from below meets two faces of a right-angled tip at 45°, totally, and goes back;
/// what meets the plane between passes by Fresnel.
#[test]
fn right_angled_tips_send_light_straight_back() {
    let mut rng = Pcg64::seed_from_u64(32);
    let between = 1.0 - fresnel(N, 1.0, 1.0).for_polarisation(Polarisation::Unpolarised);
    for lattice in LATTICES {
        for shape in [ReliefShape::Pyramid, ReliefShape::Cone] {
            for base in [50.0, 30.0] {
                let cell = cell(relief(lattice, shape, base, 0.5 * base, false));
                // Area of the circle in units of the square or hexagon around it.
                let round = match (shape, lattice) {
                    (ReliefShape::Pyramid, _) => 1.0,
                    (_, ReliefLattice::Square) => FRAC_PI_4,
                    (_, ReliefLattice::Hexagonal) => PI / 12.0_f64.sqrt(),
                };
                let expected = (1.0 - round * (base / 50.0).powi(2)) * between;
                let (t, error) = passed(&cell, DVec3::NEG_Z, 40_000, &mut rng);
                assert!((t - expected).abs() < 4.5 * error, "{shape:?} {base}: {t} {expected}");
                for lobe in cell.lobes(DVec3::NEG_Z, Polarisation::Unpolarised) {
                    assert_abs_diff_eq!(lobe.wo.z.abs(), 1.0, epsilon = 1e-12);
                }
            }
        }
    }
}

/// A ray up the axis of a lens at the distance ρ leaves by asin(nρ/R) - asin(ρ/R) from it, and near
/// the axis by ρ/f, f = R/(n - 1).
#[test]
fn lenses_deflect_by_their_curvature() {
    let (base, height) = (50.0_f64, 1.0);
    let radius = 0.5 * (0.25 * base * base + height * height) / height;
    let cell = cell(relief(ReliefLattice::Hexagonal, ReliefShape::Lens, base, height, false));
    let deflection = |rho: f64| (N * rho / radius).asin() - (rho / radius).asin();
    let mut rng = Pcg64::seed_from_u64(33);
    let (mut squares, mut largest, mut lit) = (0.0, 0.0_f64, 0.0);
    let draws = 40_000;
    for _ in 0..draws {
        let sample = cell.sample(DVec3::NEG_Z, &mut rng).unwrap();
        // Beside the lens, and after two reflections, light is none of its focus.
        if sample.lobe.transport == Transport::Transmission && sample.wo.z < 1.0 - 1e-12 {
            let sin = sample.wo.truncate().length();
            lit += 1.0;
            squares += sin * sin;
            largest = largest.max(sin.asin());
        }
    }
    let edge = deflection(0.5 * base);
    assert!(largest <= edge + 1e-12 && largest > 0.998 * edge, "{largest} {edge}");
    // Mean of ρ² over a circle is a²/2, of ρ⁴ a⁴/3.
    let focal = radius / (N - 1.0);
    let expected = 0.5 * (0.5 * base / focal).powi(2);
    let mean = squares / lit;
    let error = expected / (3.0 * lit).sqrt();
    // The next order of the deflection adds 0.4 %.
    assert!((mean - expected).abs() < 4.0 * error + 5e-3 * expected, "{mean} {expected}");
    assert!(lit > 0.85 * f64::from(draws));
}

/// Faces of a wide pyramid far from corners are those of a roof: light in its plane of symmetry, that
/// no other face sends on, leaves into the directions of grooves.
#[test]
fn pyramids_hold_the_directions_of_their_grooves() {
    let cell = ReliefCell::new(
        relief(ReliefLattice::Square, ReliefShape::Pyramid, 50.0, 5.0, false),
        [N, 1.0],
    );
    let cell = cell.unwrap();
    let grooves = UnitCell::new(&Outline::below(&[[0.0, 0.0], [25.0, 5.0], [50.0, 0.0]], [N, 1.0]));
    let grooves = grooves.unwrap();
    let wi = DVec3::NEG_Z;
    let of_roof = grooves.lobes(wi, Polarisation::Unpolarised);
    let up: Vec<_> = of_roof.iter().filter(|l| l.wo.z > 0.0 && l.power > 0.1).collect();
    assert_eq!(up.len(), 2);
    // Half of the pyramid is two faces of the roof, the other half the roof turned by 90°.
    let lobes = cell.lobes(wi, Polarisation::Unpolarised);
    for lobe in up {
        for wo in [lobe.wo, DVec3::new(lobe.wo.y, lobe.wo.x, lobe.wo.z)] {
            let share: f64 =
                lobes.iter().filter(|l| (l.wo - wo).length() < 1e-9).map(|l| l.power).sum();
            assert_abs_diff_eq!(share, 0.5 * lobe.power, epsilon = 0.01);
        }
    }
}

#[test]
fn power_closes_and_no_ray_is_lost() {
    let mut rng = Pcg64::seed_from_u64(34);
    for relief in zoo() {
        let cell = cell(relief);
        for k in 0..40_000 {
            let side = Side::BOTH[k % 2];
            let wi = sample_cosine_hemisphere(&mut rng) * DVec3::new(1.0, 1.0, side.sign());
            let sample = cell.sample(wi, &mut rng).unwrap();
            assert_abs_diff_eq!(sample.wo.length(), 1.0, epsilon = 1e-12);
            if k % 4000 < 2 {
                let lobes = cell.lobes(wi, Polarisation::Unpolarised);
                assert_abs_diff_eq!(
                    lobes.iter().map(|l| l.power).sum::<f64>(),
                    1.0,
                    epsilon = 1e-9
                );
            }
        }
        assert_eq!(cell.lost(), 0, "{relief:?}");
    }
}

/// n1² T(1→2) = n2² T(2→1) for diffuse light.
#[test]
fn diffuse_light_obeys_reciprocity_of_etendue() {
    let mut rng = Pcg64::seed_from_u64(35);
    let draws = 100_000;
    for relief in zoo() {
        let cell = cell(relief);
        let [(inner, inner_error), (outer, outer_error)] = Side::BOTH.map(|side| {
            let through = (0..draws)
                .filter(|_| {
                    let wi = sample_cosine_hemisphere(&mut rng) * DVec3::new(1.0, 1.0, side.sign());
                    cell.sample(wi, &mut rng)
                        .is_some_and(|s| s.lobe.transport == Transport::Transmission)
                })
                .count();
            let t = through as f64 / f64::from(draws);
            let n2 = cell.index(side).powi(2);
            (n2 * t, n2 * (t * (1.0 - t) / f64::from(draws)).sqrt())
        });
        let apart = (inner - outer).abs() / inner_error.hypot(outer_error);
        assert!(apart < 4.5, "{relief:?}: {inner} and {outer}, {apart}");
    }
}

#[test]
fn listed_directions_are_those_drawn() {
    let mut rng = Pcg64::seed_from_u64(36);
    for relief in zoo() {
        let cell = cell(relief);
        for wi in [spherical(0.6, 2.0), spherical(PI - 0.5, 0.3)] {
            let listed = cell.albedo(wi, Polarisation::Unpolarised).transmitted;
            let (t, error) = passed(&cell, wi, 20_000, &mut rng);
            // The list is a sample of its own, of 4096 rays.
            assert!((t - listed).abs() < 4.5 * 2.5 * error, "{relief:?}: {t} {listed}");
        }
    }
}

/// Total reflection at a face without height changes the polarisation as grooves without height do,
/// raised or pressed in.
#[test]
fn polarisation_of_flat_reliefs_is_that_of_flat_grooves() {
    let mut rng = Pcg64::seed_from_u64(37);
    let flat = UnitCell::new(&Outline::below(&[[0.0, 0.0], [1.0, 0.0]], [N, 1.0])).unwrap();
    let light = [0.3, 0.5, -0.6];
    for wi in [spherical(PI - 0.9, 2.0), spherical(PI - 1.3, 0.2)] {
        let (_, expected) = flat.sample_polarised(wi, light, &mut rng).unwrap();
        for pressed in [false, true] {
            let cell = cell(relief(LATTICES[0], ReliefShape::Pyramid, 50.0, 1e-9, pressed));
            let (_, got) = cell.sample_polarised(wi, light, &mut rng).unwrap();
            for k in 0..3 {
                assert_abs_diff_eq!(got[k], expected[k], epsilon = 1e-6);
            }
        }
    }
}

#[test]
fn bad_reliefs_are_refused() {
    let refuse = |relief: Relief| ReliefCell::new(relief, [N, 1.0]).unwrap_err().to_string();
    let with = |shape, base, height| relief(LATTICES[0], shape, base, height, false);
    assert!(refuse(with(ReliefShape::Lens, 60.0, 5.0)).contains("at most 50, got 60"));
    assert!(refuse(with(ReliefShape::Lens, 40.0, 21.0)).contains("at most 20, got 21"));
    assert!(refuse(with(ReliefShape::Cone, 40.0, 0.0)).contains("height of a relief"));
    let good = with(ReliefShape::Cone, 40.0, 90.0);
    assert!(ReliefCell::new(good, [f64::NAN, 1.0]).is_err());
}
