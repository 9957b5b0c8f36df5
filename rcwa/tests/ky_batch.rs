// SPDX-License-Identifier: MIT OR Apache-2.0
//! Many ky of one kx0 are taken through several layers at once, by transfers that are interpolated
//! in ky; one ky alone goes layer by layer. Both must give the same, in real and in complex
//! arithmetic, at the ends of the range of ky and in it.

use crate::support::real;
use rcwa::hemisphere::{Directions, Interface, Resolution, hemisphere};
use rcwa::incidence_grid::{GridRequest, solve_adaptive};
use rcwa::no_progress;
use rcwa::relief::shapes::{self, Materials};
use rcwa::solve::{solve_line, solve_symmetric_line};
use rcwa::{Pol, Scattering, Side, Stack, SymmetricBloch, Truncation};

const SILICONE: f64 = 1.41;

fn interface(period: f64, height: f64) -> Interface {
    Interface {
        relief: shapes::step(period, height, Materials::lossless(SILICONE, 1.0)).unwrap(),
        wavelength: 0.55,
        n_top: real(SILICONE),
        n_bottom: real(1.0),
    }
}

/// A relief that is its own mirror image: even and odd fields are solved apart, or orders in real
/// numbers.
fn isosceles() -> Interface {
    let tooth = shapes::triangle(3.0, [1.5, 1.2], Materials::lossless(SILICONE, 1.0));
    Interface { relief: tooth.unwrap(), ..interface(3.0, 1.2) }
}

fn stack(interface: &Interface, slices: usize) -> Stack {
    interface.stack(&interface.relief.slice_plan(slices)).unwrap()
}

fn spread(count: usize) -> Vec<f64> {
    (0..count).map(|i| SILICONE * i as f64 / count as f64).collect()
}

/// Largest difference of an efficiency, of any wave and order.
fn deviation(a: &Scattering, b: &Scattering) -> f64 {
    let mut worst = 0.0_f64;
    for side in [Side::Top, Side::Bottom] {
        for order in a.orders(side).filter(|&m| a.source(side, m).is_some()) {
            for pol in Pol::BOTH {
                for to in [Side::Top, Side::Bottom] {
                    for out in a.orders(to) {
                        let of = |s: &Scattering| s.efficiency((side, order, pol), (to, out));
                        worst = worst.max((of(a) - of(b)).abs());
                    }
                }
            }
        }
    }
    worst
}

#[test]
fn mirrored_lines_are_those_of_single_ky() {
    let stacks = [interface(3.0, 1.2), isosceles()].map(|i| stack(&i, 24));
    let ky = spread(40);
    let truncation = Truncation::new(14).unwrap();
    let lines = [SymmetricBloch::Centre, SymmetricBloch::Edge];
    for (stack, at) in stacks.iter().flat_map(|s| lines.map(|at| (s, at))) {
        let solve =
            |ky: &[f64]| solve_symmetric_line(stack, at, ky, truncation, &no_progress).unwrap();
        let all = solve(&ky);
        for i in [0, 1, 7, 19, 28, 39] {
            let alone = &solve(&ky[i..=i])[0];
            let worst = deviation(&all[i], alone);
            assert!(worst < 2e-11, "{at:?}, ky = {}: {worst:.1e}", ky[i]);
            // Not the same steps: otherwise nothing would be compared.
            assert!(worst > 0.0, "{at:?}, ky = {}", ky[i]);
        }
    }
}

#[test]
fn lines_of_running_waves_are_those_of_single_ky_with_loss_too() {
    let lossless = stack(&interface(2.0, 0.8), 16);
    let absorbing = {
        let tooth =
            Materials { ridge: num_complex::Complex64::new(SILICONE, 0.02), groove: real(1.0) };
        let relief = shapes::step(2.0, 0.8, tooth).unwrap();
        let layers = relief.slices(16);
        Stack::new(0.55, relief.period(), real(SILICONE), real(1.0), layers).unwrap()
    };
    let ky = spread(40);
    let truncation = Truncation::new(9).unwrap();
    for stack in [&lossless, &absorbing, &stack(&isosceles(), 24)] {
        let solve = |ky: &[f64]| solve_line(stack, 0.061, ky, truncation, &no_progress).unwrap();
        let all = solve(&ky);
        for i in [0, 11, 27, 39] {
            let worst = deviation(&all[i], &solve(&ky[i..=i])[0]);
            assert!(worst > 0.0 && worst < 2e-11, "ky = {}: {worst:.1e}", ky[i]);
        }
    }
}

#[test]
fn several_ky_that_are_all_0_are_solved() {
    let truncation = Truncation::new(9).unwrap();
    for interface in [interface(2.0, 0.8), isosceles()] {
        let stack = stack(&interface, 16);
        let found = solve_line(&stack, 0.061, &[0.0; 3], truncation, &no_progress).unwrap();
        let alone = solve_line(&stack, 0.061, &[0.0], truncation, &no_progress).unwrap();
        for one in &found {
            assert!(deviation(one, &alone[0]) < 2e-11);
        }
    }
}

#[test]
fn ky_added_later_go_through_what_was_kept_as_if_alone() {
    for interface in [interface(3.0, 1.2), isosceles()] {
        added_later(&interface);
    }
}

fn added_later(interface: &Interface) {
    // Sides that are followed; the tolerance makes a second pass necessary.
    let ky = (0..20).map(|i| (f64::from(i) + 0.5) * SILICONE / 20.0).collect();
    let request = GridRequest {
        kx_per_zone: 2,
        max_kx: None,
        ky,
        critical_ky: 1.0,
        tolerance: 5e-4,
        max_ky: 300,
    };
    let resolution = Resolution {
        truncation: Truncation::new(13).unwrap(),
        plan: interface.relief.slice_plan(20),
    };
    let found = solve_adaptive(interface, &request, &resolution, &no_progress).unwrap();
    let step = SILICONE / 40.0;
    // Neither of those to begin with nor half-way between them.
    let added: Vec<usize> = (0..found.directions.ky.len())
        .filter(|&i| {
            let place = found.directions.ky[i] / step;
            (place - place.round()).abs() > 0.1
        })
        .collect();
    assert!(added.len() > 2, "{added:?}");
    for i in [added[0], added[added.len() / 2], added[added.len() - 1]] {
        let directions = Directions { kx_per_zone: 2, ky: vec![found.directions.ky[i]] };
        let alone = hemisphere(interface, &directions, &resolution, &no_progress).unwrap();
        let both = found.solved.incidences.iter().filter(|w| w.ky_index == i);
        let mut count = 0;
        for (a, b) in both.zip(&alone.incidences) {
            assert_eq!((a.side, a.kx_index, a.pol), (b.side, b.kx_index, b.pol));
            for (a, b) in a.efficiencies.iter().zip(&b.efficiencies) {
                assert!((a.2 - b.2).abs() < 2e-11, "{} {}", a.2, b.2);
            }
            count += 1;
        }
        assert_eq!(count, alone.incidences.len());
    }
}
