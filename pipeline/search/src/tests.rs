// SPDX-License-Identifier: MIT OR Apache-2.0
//! Searches against pycma on functions of BBOB, and against what must hold for any objective.

use nalgebra::{DMatrix, DVector};

use super::bipop::Bipop;
use super::cma_es::{CmaEs, Settings};
use super::coordinate::{self, CoordinateSearch};
use super::normal::Normal;
use super::nsga2::{Judgement, Nsga2};
use super::random::RandomSearch;
use super::{Minimiser, Point};

mod functions;

/// Value at which a function counts as minimised.
const TARGET: f64 = 1e-8;

/// A box so wide that its border plays no part: \[-20, 20\]^n.
const WIDE: f64 = 40.0;

fn coordinates(point: &[f64], width: f64) -> Vec<f64> {
    point.iter().map(|u| (u - 0.5) * width).collect()
}

/// Runs `search` to its end or to the target. `judge` gives the value told and the value judged.
/// Returns the evaluations up to the first candidate that reaches the target.
fn minimise(
    search: &mut impl Minimiser,
    mut judge: impl FnMut(&[f64]) -> (f64, f64),
) -> Option<usize> {
    loop {
        let candidates = search.ask();
        if candidates.is_empty() {
            return None;
        }
        let inside = |point: &Point| point.iter().all(|u| (0.0..=1.0).contains(u));
        assert!(candidates.iter().all(inside), "{candidates:?}");
        let before = search.evaluations();
        let values: Vec<(f64, f64)> = candidates.iter().map(|x| judge(x)).collect();
        if let Some(hit) = values.iter().position(|v| v.1 <= TARGET) {
            return Some(before + hit + 1);
        }
        search.tell(&values.iter().map(|v| v.0).collect::<Vec<_>>());
    }
}

/// A judge without noise.
fn quiet(f: impl Fn(&[f64]) -> f64) -> impl Fn(&[f64]) -> (f64, f64) {
    move |x| {
        let value = f(x);
        (value, value)
    }
}

/// From the middle of the box, step 2 in coordinates of the function, as the runs of pycma.
fn central(n: usize, seed: u64, sigma: f64) -> Settings {
    Settings { sigma, smallest_change: 0.0, ..Settings::new(vec![0.5; n], seed, 200_000) }
}

/// Evaluations to the target of those of 25 runs that reach it, in ascending order.
fn hits(mut run: impl FnMut(u64) -> Option<usize>) -> Vec<usize> {
    let mut hits: Vec<usize> = (1..=25).filter_map(&mut run).collect();
    hits.sort_unstable();
    hits
}

fn wide_hits(n: usize, f: impl Fn(&[f64]) -> f64) -> Vec<usize> {
    hits(|seed| {
        let mut search = CmaEs::new(central(n, seed, 2.0 / WIDE));
        minimise(&mut search, quiet(|u| f(&coordinates(u, WIDE))))
    })
}

fn noisy_hits(n: usize) -> Vec<usize> {
    hits(|seed| {
        let mut noise = Normal::new(1000 + seed);
        minimise(&mut CmaEs::new(central(n, seed, 2.0 / WIDE)), |u| {
            let sphere = functions::sphere(&coordinates(u, WIDE));
            (functions::moderate_noise(sphere, noise.normal()), sphere)
        })
    })
}

fn slope_hits(n: usize) -> Vec<usize> {
    hits(|seed| {
        let mut search = CmaEs::new(central(n, seed, 0.3));
        minimise(&mut search, quiet(|u| functions::linear_slope(&coordinates(u, 10.0))))
    })
}

/// Compares the median of `hits` with `pycma`: median evaluations of those of 25 runs of pycma
/// 4.5.0 (seeds 1 to 25, default options, criteria other than the target off) that reach the
/// target on the same function from the same start with the same first step. Its box is unbounded
/// but for the slope, which has its `BoundTransform`.
fn assert_as_fast(name: &str, hits: &[usize], pycma: f64) {
    assert!(hits.len() >= 20, "{name}: {} of 25 runs", hits.len());
    let median = hits[hits.len() / 2];
    assert!(median as f64 <= 1.2 * pycma, "{name}: {median} against {pycma}");
}

#[test]
fn ten_dimensions_take_the_evaluations_of_pycma() {
    assert_as_fast("sphere", &wide_hits(10, functions::sphere), 1444.0);
    assert_as_fast("noisy sphere", &noisy_hits(10), 1453.0);
    assert_as_fast("linear slope", &slope_hits(10), 1836.0);
    assert_as_fast("Rosenbrock", &wide_hits(10, functions::rosenbrock), 5107.5);
    assert_as_fast("ellipsoid", &wide_hits(10, functions::ellipsoid), 4057.0);
}

#[test]
#[ignore = "slow: 125 runs in 20 dimensions (6 s)"]
fn twenty_dimensions_take_the_evaluations_of_pycma() {
    assert_as_fast("sphere", &wide_hits(20, functions::sphere), 2745.0);
    assert_as_fast("noisy sphere", &noisy_hits(20), 2725.0);
    assert_as_fast("linear slope", &slope_hits(20), 3746.0);
    assert_as_fast("Rosenbrock", &wide_hits(20, functions::rosenbrock), 16_818.0);
    assert_as_fast("ellipsoid", &wide_hits(20, functions::ellipsoid), 13_492.0);
}

/// Start uniform in \[1, 5\]^n, step 2, as in [Hansen, Kern 2004]; pycma 4.5.0 as above, with its
/// criteria TolX and TolFun at 1e-10 and its own stagnation.
#[test]
#[ignore = "nightly: 100 runs with large populations (10 s)"]
fn nightly_large_populations_find_the_optimum_of_rastrigin() {
    for (n, population, successes, pycma) in [
        (10, 400, 23, 31_335.0),
        (10, 800, 25, 52_050.0),
        (20, 400, 18, 97_827.5),
        (20, 1000, 25, 134_242.0),
    ] {
        let hits = hits(|seed| {
            let mut random = Normal::new(500 + seed);
            let place = |_| 0.5 + (1.0 + 4.0 * random.uniform()) / WIDE;
            let mut search = CmaEs::new(Settings {
                start: (0..n).map(place).collect(),
                population,
                max_evaluations: 1_000_000,
                ..central(n, seed, 2.0 / WIDE)
            });
            minimise(&mut search, quiet(|u| functions::rastrigin(&coordinates(u, WIDE))))
        });
        let median = hits[hits.len() / 2];
        // Standard error of the difference of two shares of 25 runs at their mean.
        let mean = (hits.len() as f64 + f64::from(successes)) / 50.0;
        let error = (2.0 * mean * (1.0 - mean) * 25.0).sqrt();
        let missing = f64::from(successes) - hits.len() as f64;
        assert!(missing <= 3.0 * error, "{n} {population}: {} of 25", hits.len());
        assert!(median as f64 <= 1.2 * pycma, "{n} {population}: {median}");
    }
}

/// An orthogonal matrix, drawn.
fn rotation(n: usize) -> DMatrix<f64> {
    let mut random = Normal::new(7);
    DMatrix::from_fn(n, n, |_, _| random.normal()).qr().q()
}

#[test]
fn rotating_the_objective_changes_nothing() {
    let plain = wide_hits(10, functions::ellipsoid);
    let turn = rotation(10);
    let turned =
        wide_hits(10, |x| functions::ellipsoid((&turn * DVector::from_column_slice(x)).as_slice()));
    assert_eq!((plain.len(), turned.len()), (25, 25));
    let ratio = turned[12] as f64 / plain[12] as f64;
    assert!((ratio - 1.0).abs() < 0.15, "{ratio}");
}

#[test]
fn an_optimum_in_a_corner_is_the_favourite() {
    let mut search = CmaEs::new(Settings::new(vec![0.5; 4], 3, 5000));
    let none = minimise(&mut search, |u| (u[0] - u[1] + 2.0 * u[2] - u[3], 1.0));
    assert_eq!(none, None);
    assert_ne!(search.ended(), Some(super::BUDGET_SPENT));
    for (got, expected) in search.favourite().iter().zip([0.0, 1.0, 0.0, 1.0]) {
        assert!((got - expected).abs() < 1e-9, "{got} {expected}");
    }
}

/// All searches of one problem with a budget.
fn searches(n: usize, seed: u64, most: usize) -> Vec<Box<dyn Minimiser>> {
    let settings = Settings::new(vec![0.3; n], seed, most);
    vec![
        Box::new(CmaEs::new(settings.clone())),
        Box::new(Bipop::new(settings)),
        Box::new(RandomSearch::new(n, 7, seed, most)),
        Box::new(CoordinateSearch::new(coordinate::Settings {
            start: vec![0.3; n],
            step: 0.25,
            smallest_step: 1e-6,
            max_evaluations: most,
        })),
    ]
}

#[test]
fn the_same_seed_and_values_give_the_same_bits() {
    for which in 0..4 {
        let mut random = Normal::new(11);
        let mut first = searches(3, 5, 3000).remove(which);
        let mut second = searches(3, 5, 3000).remove(which);
        loop {
            let candidates = first.ask();
            // Asked twice before it is told.
            assert_eq!(second.ask(), candidates);
            assert_eq!(second.ask(), candidates);
            if candidates.is_empty() {
                break;
            }
            let value = |u: &Point| {
                let noise = random.normal();
                let infeasible = noise > 1.5;
                if infeasible { f64::NAN } else { u.iter().sum::<f64>() + 0.1 * noise }
            };
            let values: Vec<f64> = candidates.iter().map(value).collect();
            first.tell(&values);
            second.tell(&values);
        }
        assert_eq!(first.favourite(), second.favourite());
        assert!(first.ended().is_some() && first.evaluations() <= 3000, "{which}");
    }
    let [a, b] = [1, 2].map(|seed| CmaEs::new(Settings::new(vec![0.5; 3], seed, 99)).ask());
    assert_ne!(a, b);
}

#[test]
fn one_dimension_is_enough() {
    for (which, close) in [(0, 1e-6), (1, 1e-6), (2, 1e-2), (3, 1e-5)] {
        let mut search = searches(1, 2, 2000).remove(which);
        while !search.ask().is_empty() {
            let values: Vec<f64> = search.ask().iter().map(|u| (u[0] - 0.7).powi(2)).collect();
            search.tell(&values);
        }
        let found = search.favourite()[0];
        assert!((found - 0.7).abs() < close, "{which}: {found}");
    }
}

#[test]
fn infeasible_candidates_do_not_move_the_mean() {
    // Feasible where u0 > 0.5; the start lies deep in the other half.
    for (optimum, expected, close) in [(0.8, 0.8, 1e-5), (0.4, 0.5, 1e-3)] {
        for seed in 1..=10 {
            let start = vec![0.1, 0.5, 0.5, 0.5];
            let settings = Settings { sigma: 0.02, ..Settings::new(start, seed, 6000) };
            let mut search = CmaEs::new(settings);
            minimise(&mut search, |u| {
                let value = u.iter().map(|u| (u - optimum).powi(2)).sum();
                (if u[0] > 0.5 { value } else { f64::INFINITY }, 1.0)
            });
            let best = search.best().expect("a feasible candidate").point[0];
            assert!((best - expected).abs() < close, "{expected} {seed}: {best}");
        }
    }
}

#[test]
fn nothing_feasible_and_nothing_to_choose_both_end() {
    let mut search = CmaEs::new(Settings::new(vec![0.5; 3], 1, 100_000));
    minimise(&mut search, |_| (f64::NAN, 1.0));
    assert_eq!(search.ended(), Some("no candidate is feasible"));
    assert_eq!((search.best(), search.favourite()), (None, vec![0.5; 3]));
    let mut search = CmaEs::new(Settings::new(vec![0.5; 3], 1, 100_000));
    minimise(&mut search, |_| (4.0, 1.0));
    assert!(search.evaluations() < 1000);
    assert_eq!(search.ended(), Some("the best values of the last generations are equal"));
}

/// Whoever ends a search early finds what the run under way has found.
#[test]
fn a_run_under_way_is_among_runs() {
    let mut search = Bipop::new(Settings::new(vec![0.9; 4], 1, 30_000));
    assert_eq!(search.runs(), []);
    for _ in 0..3 {
        let values: Vec<f64> = search.ask().iter().map(|u| u.iter().sum()).collect();
        search.tell(&values);
    }
    let runs = search.runs();
    let best = search.best().expect("a feasible candidate");
    assert_eq!((runs.len(), runs[0].evaluations), (1, 24));
    assert_eq!(runs[0].why, "it goes on");
    assert_eq!((&runs[0].best_point, runs[0].best_value), (&best.point, best.value));
}

/// Candidates that replace refused ones are ranked with those that were told before.
#[test]
fn a_generation_of_which_most_is_refused_is_filled_up() {
    let mut search = CmaEs::new(Settings::new(vec![0.5; 4], 1, 1000));
    assert!(!search.reuses_population());
    assert_eq!(search.ask().len(), 8);
    let mut values = [f64::INFINITY; 8];
    (values[0], values[3]) = (1.0, 2.0);
    search.tell(&values);
    assert!(search.reuses_population());
    assert_eq!(search.ask().len(), 6);
    search.tell(&[3.0; 6]);
    assert!(!search.reuses_population());
}

#[test]
fn restarts_alternate_and_keep_to_the_budget() {
    let settings = Settings { smallest_change: 1e-9, ..Settings::new(vec![0.9; 4], 1, 30_000) };
    let mut search = Bipop::new(settings);
    minimise(&mut search, |u| (functions::rastrigin(&coordinates(u, 10.0)), 1.0));
    let runs = search.runs();
    let populations: Vec<usize> = runs.iter().map(|r| r.population).collect();
    assert_eq!(populations[..2], [8, 16]);
    assert!(populations.contains(&32) && populations.contains(&64));
    let spent: usize = runs.iter().map(|r| r.evaluations).sum();
    assert_eq!(spent, search.evaluations());
    assert!((29_000..=30_000).contains(&spent), "{spent}");
    let best = search.best().expect("a feasible candidate");
    assert!(best.value < 1e-8, "{best:?}");
    let smallest = runs.iter().map(|r| r.best_value).fold(f64::INFINITY, f64::min);
    assert_eq!(smallest.to_bits(), best.value.to_bits());
    assert!(search.favourite().iter().all(|u| (u - 0.5).abs() < 1e-5));
}

/// The border cuts the valley of the ellipsoid, which costs pycma evaluations too.
#[test]
fn a_rotated_ellipsoid_in_a_box_takes_the_evaluations_of_pycma() {
    let turn = rotation(6);
    let hits = hits(|seed| {
        minimise(
            &mut CmaEs::new(central(6, seed, 0.3)),
            quiet(|u| {
                let x = &turn * DVector::from_vec(coordinates(u, 10.0));
                functions::ellipsoid(x.as_slice())
            }),
        )
    });
    assert_as_fast("rotated ellipsoid in a box", &hits, 2171.0);
}

#[test]
fn cma_es_beats_simpler_searches_on_a_rotated_ellipsoid() {
    let turn = rotation(6);
    let best: Vec<f64> = searches(6, 4, 10_000)
        .into_iter()
        .map(|mut search| {
            while !search.ask().is_empty() {
                let value = |u: &Point| {
                    let x = &turn * DVector::from_vec(coordinates(u, 10.0));
                    functions::ellipsoid(x.as_slice())
                };
                let values: Vec<f64> = search.ask().iter().map(value).collect();
                search.tell(&values);
            }
            search.best().expect("all are feasible").value
        })
        .collect();
    assert!(best[0] < 1e-8 && best[1] < 1e-8, "{best:?}");
    assert!(best[2] > 1.0 && best[3] > 1e-3, "{best:?}");
}

#[test]
fn gains_of_coordinates_are_tried_together() {
    let mut search = CoordinateSearch::new(coordinate::Settings {
        start: vec![0.3; 6],
        step: 0.1,
        smallest_step: 1e-4,
        max_evaluations: 4000,
    });
    let sphere = |u: &Point| u.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>();
    // A round: all neighbours, then what gained. On a sum every coordinate moves at once.
    for _ in 0..2 {
        let values: Vec<f64> = search.ask().iter().map(sphere).collect();
        search.tell(&values);
    }
    for coordinate in search.favourite() {
        assert!((coordinate - 0.4).abs() < 1e-12, "{coordinate}");
    }
    // Noise that changes from one generation to the next does not hold the centre.
    let mut random = Normal::new(9);
    while search.ended().is_none() {
        let offset = random.normal();
        let values: Vec<f64> = search.ask().iter().map(|u| sphere(u) + offset).collect();
        search.tell(&values);
    }
    assert!(sphere(&search.favourite()) < 1e-6);
}

/// Area that the points dominate below (1.1, 1.1).
fn hypervolume(points: impl Iterator<Item = [f64; 2]>) -> f64 {
    let mut points: Vec<[f64; 2]> = points.collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut level = 1.1;
    let mut area = 0.0;
    for [x, y] in points {
        if y < level && x < 1.1 {
            area += (1.1 - x) * (level - y);
            level = y;
        }
    }
    area
}

/// Hypervolumes of the front after 150 generations of 40 in ten dimensions, in 25 runs; sorted.
fn front_volumes(second: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let objectives = |x: &Point| {
        let g = 1.0 + x[1..].iter().sum::<f64>();
        [x[0], second(x[0], g)]
    };
    let volume = |seed| {
        let mut search = Nsga2::new(&vec![0.5; 10], 40, seed, 40 + 149 * 80);
        loop {
            let points = search.ask();
            if points.is_empty() {
                return hypervolume(search.front().iter().map(objectives));
            }
            let judged = points.iter().map(|x| Judgement { objectives: objectives(x), miss: 0.0 });
            search.tell(&judged.collect::<Vec<_>>());
        }
    };
    let mut volumes: Vec<f64> = (1..=25).map(volume).collect();
    volumes.sort_by(f64::total_cmp);
    volumes
}

/// ZDT1 (convex), ZDT2 (concave) and ZDT3 (in five parts) against pymoo 0.6.2, NSGA2 with the same
/// operators and generations: medians of 25 runs.
#[test]
fn fronts_are_as_near_as_those_of_pymoo() {
    let zdt1 = front_volumes(|x, g| g * (1.0 - (x / g).sqrt()));
    let zdt2 = front_volumes(|x, g| g * (1.0 - (x / g).powi(2)));
    let zdt3 = front_volumes(|x, g| {
        let wave = (10.0 * std::f64::consts::PI * x).sin();
        g * (1.0 - (x / g).sqrt() - x / g * wave)
    });
    for (name, volumes, published) in
        [("1", zdt1, 0.8605), ("2", zdt2, 0.5279), ("3", zdt3, 1.3228)]
    {
        let median = volumes[12];
        assert!(median > published - 0.002, "ZDT{name}: {median} {volumes:?}");
    }
}

/// A search of which nothing meets the constraint at first goes to where it is met.
#[test]
fn fronts_keep_their_constraints() {
    let judge = |x: &Point| Judgement {
        objectives: [x[0], 1.0 - x[0] + x[1]],
        miss: (0.7 - x[2]).max(0.0) + (x[3] - 0.1).max(0.0),
    };
    let mut search = Nsga2::new(&vec![0.5, 0.5, 0.1, 0.9], 20, 3, 4000);
    loop {
        let points = search.ask();
        if points.is_empty() {
            break;
        }
        let judged: Vec<Judgement> = points.iter().map(judge).collect();
        search.tell(&judged);
    }
    let front: Vec<Judgement> = search.front().iter().map(judge).collect();
    assert!(front.len() > 10);
    for one in &front {
        assert!(one.miss <= 0.0 && one.objectives[0] + one.objectives[1] < 1.01, "{one:?}");
    }
    assert!(front.iter().any(|one| one.objectives[0] < 0.02));
    assert!(front.iter().any(|one| one.objectives[0] > 0.98));
}
