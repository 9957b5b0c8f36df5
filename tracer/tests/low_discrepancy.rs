// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths that begin at the points of a scrambled net: the same means as by chance, honest errors,
//! the same bits on any machine, less scatter.

use std::collections::BTreeMap;
use std::sync::Mutex;

use crate::common::package::Dome;
use crate::common::*;
use tracer::glam::DVec3;
use tracer::run::{Control, run_rays, run_with};
use tracer::{
    CheckpointStore, Emission, Emitter, FarField, Medium, Outcome, PlaneMap, Receiver, Region,
    Sampling, Scene, SceneBuilder, Settings, Source, run,
};

/// A Lambertian rectangle in the open.
fn lamp_in_air() -> Scene {
    let mut scene = SceneBuilder::new(Medium::air());
    let face = Emitter::Rectangle { half_x: 0.5, half_y: 0.3 };
    scene
        .source(Source::new(
            "LED",
            DVec3::new(0.1, 0.2, 1.0),
            Region::World,
            face,
            Emission::LAMBERTIAN,
        ))
        .build()
        .unwrap()
}

fn settings(paths: u64, seed: u64, sampling: Sampling) -> Settings {
    Settings { sampling, ..Settings::new(paths, seed) }
}

#[test]
#[ignore = "slow: 12 s"]
fn errors_are_as_large_as_they_say() {
    // (estimate - p)/error of the share of every bin is Student's t with 63 degrees of freedom:
    // variance 63/61, beyond 2 in 4.98 % of cases.
    const SEEDS: u64 = 400;
    let scene = lamp_in_air();
    let far = FarField::new(10.0, 40.0).unwrap();
    let expected = |bin: usize| {
        let ring = (bin / 9) as f64 * 10.0;
        let sin2 = |deg: f64| deg.to_radians().sin().powi(2);
        if ring < 90.0 { (sin2(ring + 10.0) - sin2(ring)) / 9.0 } else { 0.0 }
    };
    let lit = 9 * 9;
    let mut squares = vec![0.0; lit];
    let mut beyond = 0.0;
    for seed in 0..SEEDS {
        let settings = settings(64 * 200, seed, Sampling::Sobol);
        let outcome = run(&scene, &[&far], &settings).unwrap();
        for (bin, estimate) in outcome.bins(0).iter().enumerate() {
            if bin >= lit {
                assert!(estimate.value.abs() < 1e-300);
                continue;
            }
            let t = (estimate.value - expected(bin)) / estimate.standard_error;
            squares[bin] += t * t / SEEDS as f64;
            beyond += f64::from(u32::from(t.abs() > 2.0)) / (SEEDS * lit as u64) as f64;
        }
    }
    // The mean of 400 squares is known to 0.08, that of all bins, which have the points in common,
    // to less.
    let mean = squares.iter().sum::<f64>() / lit as f64;
    assert!((mean - 63.0 / 61.0).abs() < 0.05, "{mean}");
    assert!((beyond - 0.0498).abs() < 0.006, "{beyond}");
    for (bin, square) in squares.iter().enumerate() {
        assert!((square - 63.0 / 61.0).abs() < 5.0 * 0.08, "bin {bin}: {square}");
    }
}

#[test]
fn scatter_is_less_where_the_beginning_decides() {
    // Means over 20 seeds of the square of the error of one bin.
    let scene = lamp_in_air();
    let far = FarField::new(10.0, 40.0).unwrap();
    let square = |sampling: Sampling| -> f64 {
        let of = |seed| {
            let outcome = run(&scene, &[&far], &settings(64 << 10, seed, sampling)).unwrap();
            let bins = outcome.bins(0);
            bins[30..50].iter().map(|b| b.standard_error.powi(2)).sum::<f64>()
        };
        (0..20).map(of).sum()
    };
    let gain = square(Sampling::Random) / square(Sampling::Sobol);
    assert!(gain > 5.0, "{gain}");
}

/// Largest difference of two outcomes, over all bins and lines of the ledger, as chi-square over
/// their number.
fn chi_square(a: &Outcome, b: &Outcome) -> (f64, usize) {
    let mut all: Vec<[tracer::Estimate; 2]> = Vec::new();
    for receiver in 0..a.total.readings.len() {
        all.extend(a.bins(receiver).into_iter().zip(b.bins(receiver)).map(|(a, b)| [a, b]));
    }
    let lines = a.total.ledger.surfaces.len();
    for line in 0..lines {
        all.push([a, b].map(|o| o.mean(|t| t.ledger.surfaces[line].absorbed)));
        all.push([a, b].map(|o| o.mean(|t| t.ledger.surfaces[line].outward)));
    }
    let terms = all.iter().filter_map(|[a, b]| {
        let variance = a.standard_error.powi(2) + b.standard_error.powi(2);
        (variance > 0.0).then(|| (a.value - b.value).powi(2) / variance)
    });
    let terms: Vec<f64> = terms.collect();
    (terms.iter().sum(), terms.len())
}

#[test]
fn means_are_those_of_random_paths() {
    let far = FarField::new(6.0, 40.0).unwrap();
    let plane = PlaneMap::centred(3.0, 2.0, 6, 6).unwrap();
    let receivers: [&dyn Receiver; 2] = [&far, &plane];
    let steps = || Dome::relief(staircase(17));
    let scenes = [
        // One package and many, 64 paths at a time; the smooth dome without a box; path by path.
        array(&package(N, steps(), 0.95, 0.86), 1, 8.0).build().unwrap(),
        array(&package(N, steps(), 0.95, 0.86), 3, 4.0).build().unwrap(),
        single(mirrored_cap(Emission::LAMBERTIAN)),
        single(mirrored_cap(Emission::Isotropic)),
        lamp_in_air(),
    ];
    for (number, scene) in scenes.iter().enumerate() {
        let trace = |sampling| trace(scene, &receivers, &settings(64 << 12, 11, sampling));
        let (net, chance) = (trace(Sampling::Sobol), trace(Sampling::Random));
        let (chi2, count) = chi_square(&net, &chance);
        // Bins are nearly independent; five deviations of chi-square.
        let bound = count as f64 * 63.0 / 61.0 + 5.0 * (2.2 * count as f64).sqrt();
        assert!(count > 100 && chi2 < bound, "scene {number}: {chi2} of {count}");
    }
}

#[test]
fn sources_take_part_by_weight() {
    let mut scene = SceneBuilder::new(Medium::air());
    for (x, weight) in [(-1.0, 1.0), (0.0, 2.5), (1.0, 0.5)] {
        let place = DVec3::new(x, 0.0, 0.0);
        let direction = DVec3::new(x, 0.0, 1.0);
        let beam = Emission::Beam { direction };
        let mut source = Source::new("beam", place, Region::World, Emitter::Point, beam);
        source.weight = weight;
        scene.source(source);
    }
    let scene = scene.build().unwrap();
    let far = FarField::new(30.0, 90.0).unwrap();
    let outcome = run(&scene, &[&far], &settings(64 << 8, 3, Sampling::Sobol)).unwrap();
    let share = outcome.bins(0)[..4].iter().map(|b| b.value).sum::<f64>() / scene.power();
    // One number of each 256 in every interval of that width: within two of 256.
    assert!((share - 2.5 / 4.0).abs() < 2.0 / 256.0, "{share}");
}

#[test]
fn many_at_once_go_as_one_by_one() {
    const GROUPS: usize = 4;
    let domes = [Dome::smooth(&CAP), Dome::relief(staircase(17))];
    for (side, dome) in [(1, 0), (2, 1), (1, 1)] {
        let package = package(N, domes[dome].clone(), 0.95, 0.86);
        let scene = array(&package, side, 8.0).build().unwrap();
        let settings =
            Settings { groups: GROUPS, ..settings((GROUPS as u64) << 14, 7, Sampling::Sobol) };
        let many = run(&scene, &[], &settings).unwrap();
        let one = run_rays(&scene, &settings, Control::default(), |_, _| Ok(())).unwrap();
        let difference = |of: &dyn Fn(&tracer::Ledger) -> f64| {
            (of(&many.total.ledger) - of(&one.total.ledger)).abs() * many.paths as f64
        };
        assert!(difference(&|l| l.escaped_up) < 4.0);
        assert!(difference(&|l| l.absorbed()) < 4.0);
        assert!(many.hits.abs_diff(one.hits) < 100, "{} {}", many.hits, one.hits);
    }
}

/// Keeps all and gives back the even ones.
#[derive(Default)]
struct Shelf(Mutex<BTreeMap<u64, Vec<u8>>>);

impl CheckpointStore for Shelf {
    fn find(&self, group: u64) -> Option<Vec<u8>> {
        let kept = self.0.lock().unwrap();
        kept.get(&group).filter(|_| group.is_multiple_of(2)).cloned()
    }

    fn keep(&self, group: u64, bytes: &[u8]) {
        self.0.lock().unwrap().insert(group, bytes.to_vec());
    }
}

#[test]
fn bits_depend_neither_on_threads_nor_on_interruptions() {
    let far = FarField::new(10.0, 30.0).unwrap();
    let receivers: [&dyn Receiver; 1] = [&far];
    let relief = package(N, Dome::relief(staircase(17)), 0.95, 0.86);
    let scenes = [
        array(&relief, 2, 4.0).build().unwrap(),
        single(mirrored_cap(Emission::LAMBERTIAN)),
        single(meshed_cap(2500, Emission::LAMBERTIAN)),
    ];
    for scene in &scenes {
        let settings = settings(64 * 300, 5, Sampling::Sobol);
        let on = |threads: usize, control: Control<'_>| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().unwrap();
            pool.install(|| run_with(scene, &receivers, &settings, control).unwrap())
        };
        let whole = on(1, Control::default());
        assert_eq!(whole, on(3, Control::default()));
        let shelf = Shelf::default();
        let keeping = Control { checkpoints: Some(&shelf), ..Control::default() };
        assert_eq!(whole, on(2, keeping));
        assert_eq!(whole, on(2, keeping));
        let other = Settings { seed: 6, ..settings };
        assert_ne!(whole, run(scene, &receivers, &other).unwrap());
    }
}
