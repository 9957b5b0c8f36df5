// SPDX-License-Identifier: MIT OR Apache-2.0
//! Hemispheres, extrapolation in the number of slices, and searches for a tolerance: against direct
//! solutions and much finer runs.

use crate::support::{assert_near, real, solve};
use num_complex::Complex64;
use rcwa::accuracy::{
    Structure, Waves, converge_hemisphere, converge_waves, hemisphere_change, largest_change,
};
use rcwa::hemisphere::{
    Directions, Hemisphere, Incidence, Interface, Resolution, hemisphere, work,
};
use rcwa::incidence_grid::{GridRequest, solve_adaptive};
use rcwa::no_progress;
use rcwa::relief::Relief;
use rcwa::relief::shapes::{self, Materials};
use rcwa::{Bloch, Error, Pol, Side, Stack, Truncation};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

fn interface(relief: Relief) -> Interface {
    Interface { relief, wavelength: 0.55, n_top: real(1.41), n_bottom: real(1.0) }
}

fn sawtooth() -> Interface {
    interface(shapes::triangle(1.7, [1.3, 0.6], Materials::lossless(1.41, 1.0)).unwrap())
}

fn resolution(interface: &Interface, highest: usize, slices: usize) -> Resolution {
    Resolution {
        truncation: Truncation::new(highest).unwrap(),
        plan: interface.relief.slice_plan(slices),
    }
}

fn run(interface: &Interface, directions: &Directions, resolution: &Resolution) -> Hemisphere {
    hemisphere(interface, directions, resolution, &no_progress).unwrap()
}

fn directions(kx_per_zone: usize) -> Directions {
    Directions { kx_per_zone, ky: vec![0.05, 0.7, 1.2] }
}

#[test]
fn every_node_of_both_hemispheres_is_there_once() {
    let lamella =
        interface(shapes::lamellar(1.7, 0.6, 0.4, Materials::lossless(1.41, 1.0)).unwrap());
    for kx_per_zone in [1, 2, 3, 4] {
        let directions = directions(kx_per_zone);
        let solved = run(&lamella, &directions, &resolution(&lamella, 9, 1));
        let mut found: Vec<_> =
            solved.incidences.iter().map(|i| (i.side, i.ky_index, i.kx_index, i.pol)).collect();
        found.sort_unstable();
        let step = lamella.order_spacing() / kx_per_zone as f64;
        let mut expected = Vec::new();
        for (side, n) in [(Side::Top, 1.41_f64), (Side::Bottom, 1.0)] {
            for (ky_index, ky) in directions.ky.iter().enumerate() {
                for kx_index in -100..100_i64 {
                    let offset = [0.0, 0.5][kx_per_zone % 2];
                    let kx = (kx_index as f64 + offset) * step;
                    if kx * kx + ky * ky < n * n {
                        expected.extend(Pol::BOTH.map(|pol| (side, ky_index, kx_index, pol)));
                    }
                }
            }
        }
        assert_eq!(found, expected, "{kx_per_zone} nodes to a zone");
    }
}

#[test]
fn nodes_by_reciprocity_equal_direct_solutions() {
    let lamella =
        interface(shapes::triangle(1.7, [1.3, 0.6], Materials::lossless(1.41, 1.0)).unwrap());
    let (directions, resolution) = (directions(4), resolution(&lamella, 11, 6));
    let solved = run(&lamella, &directions, &resolution);
    let spacing = lamella.order_spacing();
    let (stack, none) = lamella.stacks(&resolution).unwrap();
    assert!(none.is_none());
    let mut compared = 0;
    for (ky_index, &ky) in directions.ky.iter().enumerate() {
        // Line -1 is the one that is never solved: kx0 at -¼ of a zone. Line 0 is its own mirror
        // image.
        for line in [1_i64, -1, 0] {
            let kx0 = line as f64 * spacing / 4.0;
            let run = solve(&stack, Bloch::new(kx0, ky), 11);
            let here = |i: &&Incidence| {
                i.ky_index == ky_index && i.kx_index.rem_euclid(4) == line.rem_euclid(4)
            };
            for incidence in solved.incidences.iter().filter(here) {
                let order = ((incidence.kx_index - line) / 4) as i32;
                let from = (incidence.side, order, incidence.pol);
                for &(side, relative, share) in &incidence.efficiencies {
                    let expected = run.efficiency(from, (side, order + relative));
                    assert_near(&format!("{incidence:?}"), share, expected, 1e-11);
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 500, "{compared}");
}

/// Sum of the shares of every incident wave.
fn sums(solved: &Hemisphere) -> impl Iterator<Item = f64> + '_ {
    solved.incidences.iter().map(|i| i.efficiencies.iter().map(|s| s.2).sum())
}

#[test]
fn extrapolated_shares_keep_their_sums_and_are_nearer_to_the_limit() {
    // Not followed for what it absorbs, which is next to nothing.
    let dull = Materials { ridge: Complex64::new(3.0, 1e-15), ..Materials::lossless(3.0, 1.0) };
    let sawtooth = interface(shapes::triangle(1.1, [0.8, 0.3], dull).unwrap());
    assert!(!sawtooth.follows_walls());
    let directions = Directions { kx_per_zone: 1, ky: vec![0.0] };
    let highest = 12;
    let extrapolated = run(&sawtooth, &directions, &resolution(&sawtooth, highest, 24));
    assert!(sums(&extrapolated).all(|sum| (sum - 1.0).abs() < 1e-11));
    assert!(extrapolated.incidences.iter().all(|i| i.efficiencies.iter().all(|s| s.2 >= 0.0)));
    assert!(extrapolated.worst_balance < 1e-11);

    let kx0 = 0.5 * sawtooth.order_spacing();
    let (_, fine) = resolution(&sawtooth, highest, 24).plans();
    let plan = fine.expect("slanted sides");
    let (mut by_extrapolation, mut by_slices) = (0.0_f64, 0.0_f64);
    for (ky_index, &ky) in directions.ky.iter().enumerate() {
        let at = |factor: usize| {
            let stack = sawtooth.stack(&plan.refined(factor)).unwrap();
            solve(&stack, Bloch::new(kx0, ky), highest)
        };
        // The finer of the two runs behind the extrapolation, and one eight times finer than that.
        let (fine, limit) = (at(1), at(8));
        for incidence in extrapolated
            .incidences
            .iter()
            // In TM what stairs leave is of the first order.
            .filter(|i| i.ky_index == ky_index && i.pol == Pol::S)
        {
            let from = (incidence.side, incidence.kx_index as i32, incidence.pol);
            for &(side, relative, share) in &incidence.efficiencies {
                let of = |s: &rcwa::Scattering| s.efficiency(from, (side, from.1 + relative));
                by_extrapolation += (share - of(&limit)).powi(2);
                by_slices += (of(&fine) - of(&limit)).powi(2);
            }
        }
    }
    let gain = (by_slices / by_extrapolation).sqrt();
    assert!(gain > 3.0, "root mean square error only {gain:.2} times smaller");
}

#[test]
fn too_few_orders_are_refused() {
    let sawtooth = sawtooth();
    let highest = sawtooth.highest_order();
    let error =
        hemisphere(&sawtooth, &directions(1), &resolution(&sawtooth, highest - 1, 4), &no_progress);
    let Err(Error::TooFewOrders { got, propagating }) = error else { panic!("{error:?}") };
    assert_eq!((got, propagating), (highest - 1, highest));
    assert!(
        hemisphere(&sawtooth, &directions(1), &resolution(&sawtooth, highest, 4), &no_progress)
            .is_ok()
    );
}

#[test]
fn progress_adds_up_and_can_stop() {
    let sawtooth = sawtooth();
    let (directions, resolution) = (directions(3), resolution(&sawtooth, 8, 5));
    let count = AtomicUsize::new(0);
    let counting = |problems: usize| {
        count.fetch_add(problems, Ordering::Relaxed);
        ControlFlow::Continue(())
    };
    hemisphere(&sawtooth, &directions, &resolution, &counting).unwrap();
    assert_eq!(count.load(Ordering::Relaxed), work(&sawtooth, &directions, &resolution));
    let stopped = hemisphere(&sawtooth, &directions, &resolution, &|_| ControlFlow::Break(()));
    assert!(matches!(stopped, Err(Error::Stopped)));
}

/// The true error is within the estimate, the estimate within the tolerance.
fn bounded(error: f64, estimate: f64, tolerance: f64) -> bool {
    error <= estimate && estimate <= tolerance
}

/// Transmittance of one wave in s and in p, searched for; with the estimated error.
fn found(wave: &Interface, tolerance: f64) -> (Vec<f64>, f64) {
    let solve = |at: &Resolution| {
        let (coarse, None) = wave.stacks(at)? else { panic!("not followed") };
        transmittances(&coarse, at.truncation)
    };
    let distance = |a: &Vec<f64>, b: &Vec<f64>| largest_change(a, b);
    let waves = Waves { solve: &solve, distance: &distance, highest_order: 5, first: None };
    let structure = Structure::Relief(wave);
    let found = converge_waves(structure, &waves, tolerance, &no_progress).unwrap();
    assert_eq!(found.limit, None);
    (found.answer, found.errors.sum())
}

fn transmittances(stack: &Stack, truncation: Truncation) -> Result<Vec<f64>, Error> {
    let s = rcwa::solve(stack, Bloch::new(0.21, 0.4), truncation)?;
    Ok(Pol::BOTH.iter().map(|&p| s.total((Side::Top, 0, p), Side::Bottom)).collect())
}

#[test]
fn a_search_keeps_its_tolerance_for_a_lamella() {
    let lamella =
        interface(shapes::lamellar(0.9, 0.4, 0.5, Materials::lossless(1.41, 1.0)).unwrap());
    let stack = lamella.stack(&lamella.relief.slice_plan(1)).unwrap();
    let truth = transmittances(&stack, Truncation::new(160).unwrap()).unwrap();
    for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
        let (values, estimate) = found(&lamella, tolerance);
        let error = largest_change(&values, &truth);
        assert!(bounded(error, estimate, tolerance), "{error:.1e} {estimate:.1e} {tolerance:.0e}");
    }
}

#[test]
fn a_search_keeps_its_tolerance_for_a_sinusoid() {
    let relief = shapes::sinusoid(0.8, 0.25, 24, Materials::lossless(1.41, 1.0)).unwrap();
    let wave = interface(relief);
    // Stairs are off by more than the finest tolerance; slices follow the walls here too.
    let fine = resolution(&wave, 48, 150);
    let truth = transmittances(&wave.stacks(&fine).unwrap().0, fine.truncation).unwrap();
    for tolerance in [1e-2, 1e-3, 2e-4] {
        let (values, estimate) = found(&wave, tolerance);
        let error = largest_change(&values, &truth);
        assert!(bounded(error, estimate, tolerance), "{error:.1e} {estimate:.1e} {tolerance:.0e}");
    }
}

/// Share transmitted from every direction.
fn transmitted(solved: &Hemisphere) -> Vec<f64> {
    let through =
        |i: &Incidence| i.efficiencies.iter().filter(|s| s.0 == Side::Bottom).map(|s| s.2).sum();
    solved.incidences.iter().map(through).collect()
}

/// The errors of a resolution at directions where the search did not look, against twice as many
/// orders and twice as many slices (by the laws that they follow eight and four times less error).
fn true_error(interface: &Interface, found: &Resolution, ky: Vec<f64>) -> f64 {
    let directions = Directions { kx_per_zone: 1, ky };
    let here = run(interface, &directions, found);
    assert!(here.worst_balance < 1e-11 && sums(&here).all(|sum| (sum - 1.0).abs() < 1e-11));
    let finer = Resolution {
        truncation: Truncation::new(found.truncation.highest() * 2).unwrap(),
        plan: found.plan.refined(2),
    };
    let there = run(interface, &directions, &finer);
    hemisphere_change(&transmitted(&here), &transmitted(&there))
}

/// A triangle of period 3 with these interior angles at x = 0 and at its apex, in degrees.
fn triangle_by_angles(base: f64, apex: f64) -> Interface {
    // Law of sines: the side from the base corner to the apex faces the third angle.
    let third = (180.0 - (base + apex)).to_radians();
    let side = 3.0 * third.sin() / apex.to_radians().sin();
    let (sin, cos) = base.to_radians().sin_cos();
    let materials = Materials::lossless(1.41, 1.0);
    interface(shapes::triangle(3.0, [side * cos, side * sin], materials).unwrap())
}

#[test]
fn a_search_keeps_its_tolerance_over_the_hemispheres() {
    let lossless = Materials::lossless(1.41, 1.0);
    let reliefs = [
        sawtooth(),
        interface(shapes::step(4.0, 1.5, lossless).unwrap()),
        // Leaning over its neighbour, as OS2.
        triangle_by_angles(125.0, 45.0),
        triangle_by_angles(30.0, 90.0),
        interface(shapes::lamellar(2.3, 1.1, 0.4, lossless).unwrap()),
    ];
    for (number, relief) in reliefs.iter().enumerate() {
        for tolerance in [1e-2, 1.5e-3] {
            let (found, estimate) = converge_hemisphere(relief, tolerance, &no_progress).unwrap();
            let error = true_error(relief, &found, vec![0.0, 0.55, 0.9, 1.3]);
            assert!(
                bounded(error, estimate, tolerance),
                "relief {number}: {error:.1e}, estimated {estimate:.1e}, allowed {tolerance:.0e}, M = {}, {} slices",
                found.truncation.highest(),
                relief.layers(&found)
            );
        }
    }
}

#[test]
fn ring_75_of_the_paper_to_one_part_in_a_thousand() {
    let ring = interface(shapes::step(10.0, 4.03, Materials::lossless(1.41, 1.0)).unwrap());
    let tolerance = 1e-3;
    let (found, estimate) = converge_hemisphere(&ring, tolerance, &no_progress).unwrap();
    let error = true_error(&ring, &found, vec![0.45]);
    assert!(bounded(error, estimate, tolerance), "{error:.1e}, estimated {estimate:.1e}");
}

/// What a hemisphere of diffuse light from the top or the bottom passes on, by the trapezoidal rule
/// within each range of ky.
fn flux(directions: &Directions, solved: &Hemisphere, pols: &[Pol]) -> [f64; 2] {
    [(Side::Top, 1.41_f64), (Side::Bottom, 1.0)].map(|(side, n)| {
        let row = |j: usize| {
            let here = solved
                .incidences
                .iter()
                .filter(|i| i.side == side && i.ky_index == j && pols.contains(&i.pol));
            let all: Vec<f64> = here
                .map(|i| {
                    let through = i.efficiencies.iter().filter(|s| s.0 == Side::Bottom);
                    through.map(|s| s.2).sum()
                })
                .collect();
            let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
            mean * (n * n - directions.ky[j].powi(2)).max(0.0).sqrt()
        };
        let area = std::f64::consts::PI * n * n / 4.0;
        let pieces = (1..directions.ky.len())
            .filter(|&j| (directions.ky[j - 1] < 1.0) == (directions.ky[j] < 1.0));
        pieces
            .map(|j| 0.5 * (row(j) + row(j - 1)) * (directions.ky[j] - directions.ky[j - 1]))
            .sum::<f64>()
            / area
    })
}

/// ky in both ranges, with the same ends whatever their number, so that what lies outside is left
/// out alike.
fn spread(count: usize) -> Vec<f64> {
    let along = |a: f64, b: f64| (0..=count).map(move |i| a + (b - a) * i as f64 / count as f64);
    along(0.0, 0.99).chain(along(1.01, 1.4)).collect()
}

#[test]
fn ky_chosen_by_error_give_the_flux_of_many() {
    let relief = interface(shapes::step(4.0, 1.5, Materials::lossless(1.41, 1.0)).unwrap());
    let resolution = resolution(&relief, relief.highest_order() + 3, 9);
    let many = Directions { kx_per_zone: 2, ky: spread(100) };
    let truth = flux(&many, &run(&relief, &many, &resolution), &Pol::BOTH);
    let mut used = 0;
    for tolerance in [1e-2, 1e-3] {
        let request = GridRequest {
            kx_per_zone: 2,
            max_kx: None,
            ky: spread(4),
            critical_ky: 1.0,
            tolerance,
            max_ky: 200,
        };
        let found = solve_adaptive(&relief, &request, &resolution, &no_progress).unwrap();
        let ky = &found.directions.ky;
        assert!(ky.windows(2).all(|w| w[0] < w[1]) && ky.len() >= used);
        used = ky.len();
        for (here, there) in flux(&found.directions, &found.solved, &Pol::BOTH).iter().zip(truth) {
            let error = (here - there).abs();
            assert!(
                error <= tolerance && found.grid_error <= tolerance,
                "{error:.1e}, estimated {:.1e}, allowed {tolerance:.0e}, {used} ky",
                found.grid_error
            );
        }
    }
    let hopeless = GridRequest {
        kx_per_zone: 2,
        max_kx: None,
        ky: spread(4),
        critical_ky: 1.0,
        tolerance: 1e-6,
        max_ky: 25,
    };
    let error = solve_adaptive(&relief, &hopeless, &resolution, &no_progress).unwrap_err();
    assert!(matches!(error, Error::NotConverged { .. }), "{error}");
}

#[test]
#[ignore = "slow: a grid of eight times as many kx (5 s)"]
fn kx_chosen_by_error_give_the_flux_of_eight_times_as_many() {
    let lossless = Materials::lossless(1.41, 1.0);
    let reliefs = [
        sawtooth(),
        interface(shapes::lamellar(0.6, 0.3, 0.5, lossless).unwrap()),
        triangle_by_angles(125.0, 45.0),
    ];
    let mut most = 0;
    for (number, relief) in reliefs.iter().enumerate() {
        let resolution = resolution(relief, relief.highest_order() + 2, 9);
        for tolerance in [2e-2, 5e-3] {
            let request = GridRequest {
                kx_per_zone: 2,
                max_kx: Some(64),
                ky: spread(8),
                critical_ky: 1.0,
                tolerance,
                max_ky: 200,
            };
            let found = solve_adaptive(relief, &request, &resolution, &no_progress).unwrap();
            let kx_error = found.kx_error.expect("an even number");
            assert!(kx_error <= tolerance);
            let used = found.directions.kx_per_zone;
            most = most.max(used);
            let many = Directions { kx_per_zone: 8 * used, ky: found.directions.ky.clone() };
            let finer = run(relief, &many, &resolution);
            for pol in Pol::BOTH {
                let of = |d: &Directions, h: &Hemisphere| flux(d, h, &[pol]);
                let (here, there) = (of(&found.directions, &found.solved), of(&many, &finer));
                for (here, there) in here.iter().zip(there) {
                    let error = (here - there).abs();
                    assert!(
                        error <= kx_error,
                        "relief {number}, {used} kx: {error:.1e}, estimated {kx_error:.1e}, allowed {tolerance:.0e}"
                    );
                }
            }
        }
    }
    assert!(most >= 8, "at most {most}");
}

#[test]
fn lines_added_between_others_are_those_of_a_grid_twice_as_dense() {
    let relief = sawtooth();
    let resolution = resolution(&relief, relief.highest_order() + 2, 7);
    let request = GridRequest {
        kx_per_zone: 2,
        max_kx: Some(64),
        ky: spread(4),
        critical_ky: 1.0,
        tolerance: 6e-3,
        max_ky: 200,
    };
    let found = solve_adaptive(&relief, &request, &resolution, &no_progress).unwrap();
    assert!(found.directions.kx_per_zone >= 4);
    let at_once = run(&relief, &found.directions, &resolution);
    let key = |i: &&Incidence| (i.side, i.ky_index, i.kx_index, i.pol);
    let sorted = |h: &Hemisphere| {
        let mut all: Vec<Incidence> = h.incidences.clone();
        all.sort_by_key(|i| key(&i));
        all
    };
    let (a, b) = (sorted(&found.solved), sorted(&at_once));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        assert_eq!(key(&a), key(&b));
        assert_eq!(a.efficiencies.len(), b.efficiencies.len());
        for (x, y) in a.efficiencies.iter().zip(&b.efficiencies) {
            assert!((x.0, x.1) == (y.0, y.1) && (x.2 - y.2).abs() < 1e-10);
        }
    }
    // As many kx as it takes are not allowed.
    let few = GridRequest { max_kx: Some(2), ..request };
    let error = solve_adaptive(&relief, &few, &resolution, &no_progress).unwrap_err();
    assert!(error.to_string().contains("kx in a Brillouin zone"), "{error}");
}
