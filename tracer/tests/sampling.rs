// SPDX-License-Identifier: MIT OR Apache-2.0
//! Samplers against their densities by chi-square, and runs against themselves: seeds, threads,
//! cancellation.

use crate::common::package::Dome;
use crate::common::*;
use rand::Rng;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use tracer::glam::DVec3;
use tracer::random::{Streams, cosine, disc, isotropic, stream, unit};
use tracer::run::{Control, run_with};
use tracer::{
    Emission, Emitter, Error, FarField, Medium, Outcome, PlaneMap, Region, Sampling, Scene,
    SceneBuilder, Settings, Source, run,
};

/// Chi-square of `counts` against equally likely cells, as a normal deviate [Wilson, Hilferty
/// 1931].
fn deviate(counts: &[u64]) -> f64 {
    let total: u64 = counts.iter().sum();
    let expected = total as f64 / counts.len() as f64;
    assert!(expected > 5.0);
    let chi2: f64 = counts.iter().map(|&count| (count as f64 - expected).powi(2) / expected).sum();
    let k = (counts.len() - 1) as f64;
    ((chi2 / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt()
}

/// Counts of 10⁶ points (u, v) of the unit square on 40 × 40 cells.
fn histogram(seed: u64, mut draw: impl FnMut(&mut rand_pcg::Pcg64) -> (f64, f64)) -> Vec<u64> {
    let mut rng = stream(seed, 3);
    let mut counts = vec![0; 1600];
    for _ in 0..1_000_000 {
        let (u, v) = draw(&mut rng);
        assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v), "{u} {v}");
        let cell = |x: f64| ((x * 40.0) as usize).min(39);
        counts[cell(u) * 40 + cell(v)] += 1;
    }
    counts
}

fn azimuth(x: f64, y: f64) -> f64 {
    (y.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0)
}

#[test]
fn samplers_pass_chi_square() {
    // Each is mapped by its own cumulated density onto the unit square. Five tests at 1 % with
    // Šidák's correction: 2.88.
    let flat = histogram(1, |rng| (unit(rng), unit(rng)));
    let lambertian = histogram(2, |rng| {
        let d = cosine(rng, 1.0);
        (1.0 - d.z * d.z, azimuth(d.x, d.y))
    });
    let cone = histogram(3, |rng| {
        let d = cosine(rng, 0.5);
        ((1.0 - d.z * d.z) / 0.25, azimuth(d.x, d.y))
    });
    let sphere = histogram(4, |rng| {
        let d = isotropic(rng);
        (0.5 * (d.z + 1.0), azimuth(d.x, d.y))
    });
    let round = histogram(5, |rng| {
        let (x, y) = disc(rng, 3.0);
        ((x * x + y * y) / 9.0, azimuth(x, y))
    });
    for (name, counts) in [
        ("unit", flat),
        ("cosine", lambertian),
        ("cone", cone),
        ("sphere", sphere),
        ("disc", round),
    ] {
        let z = deviate(&counts);
        assert!(z < 2.88, "{name}: {z}");
        assert!(z > -4.0, "{name} is too even: {z}");
    }
}

#[test]
fn chi_square_notices_a_wrong_density() {
    // A hemisphere uniform in z instead of z² must fail.
    let wrong = histogram(6, |rng| {
        let d = isotropic(rng);
        (1.0 - d.z * d.z, azimuth(d.x, d.y))
    });
    assert!(deviate(&wrong) > 100.0);
}

#[test]
fn sources_emit_from_where_they_are() {
    let at = DVec3::new(1.0, -2.0, 0.5);
    let source = |emitter| Source::new("s", at, Region::World, emitter, Emission::LAMBERTIAN);
    let rectangle = source(Emitter::Rectangle { half_x: 0.5, half_y: 2.0 });
    let counts = histogram(7, |rng| {
        let ray = rectangle.sample(0.0, rng);
        assert!((ray.origin.z - 0.5).abs() <= 0.0);
        ((ray.origin.x - 0.5) / 1.0, (ray.origin.y + 4.0) / 4.0)
    });
    assert!(deviate(&counts) < 2.88);
    // An enclosure shines inward, evenly from all around.
    let enclosure = source(Emitter::Enclosure { radius: 3.0 });
    let counts = histogram(8, |rng| {
        let ray = enclosure.sample(0.0, rng);
        let out = (ray.origin - at) / 3.0;
        assert!((out.length() - 1.0).abs() < 1e-12 && ray.direction.dot(out) < 0.0);
        (ray.direction.dot(out).powi(2), 0.5 * (out.z + 1.0))
    });
    assert!(deviate(&counts) < 2.88);
}

#[test]
fn sources_that_face_anywhere_pass_chi_square() {
    // Four exponents and six directions; twelve tests at 1 % with Šidák's correction: 3.15.
    let directions = [
        DVec3::Z,
        -DVec3::Z,
        DVec3::X,
        -DVec3::Y,
        DVec3::new(1.0, 2.0, 3.0),
        DVec3::new(-0.1, 0.02, -0.3),
    ];
    for (number, normal) in (0..).zip(directions) {
        let exponent = [0.0, 0.5, 1.0, 2.0, 7.5, 80.0][number as usize];
        let emitter = Emitter::Rectangle { half_x: 0.5, half_y: 2.0 };
        let emission = Emission::CosinePower { exponent };
        let at = DVec3::new(1.0, -2.0, 0.5);
        let source = Source::new("s", at, Region::World, emitter, emission).facing(normal);
        let (n, (u, v)) = (normal.normalize(), source.axes());
        assert!(u.dot(v).abs() < 1e-15 && u.cross(v).dot(n) > 1.0 - 1e-12);
        assert!(u.z.abs() < 1e-15 && (v.z >= 0.0 || n.z.abs() > 0.999));
        let places = histogram(20 + number, |rng| {
            let off = source.sample(0.0, rng).origin - at;
            assert!(off.dot(n).abs() < 1e-14);
            (off.dot(u) + 0.5, 0.25 * (off.dot(v) + 2.0))
        });
        let toward = histogram(40 + number, |rng| {
            let d = source.sample(0.0, rng).direction;
            assert!((d.length() - 1.0).abs() < 1e-12);
            let cos = d.dot(n);
            assert!(cos >= 0.0);
            (cos.powf(exponent + 1.0), azimuth(d.dot(u), d.dot(v)))
        });
        for counts in [places, toward] {
            let z = deviate(&counts);
            assert!(z.abs() < 3.15, "{normal} {exponent}: {z}");
        }
    }
}

#[test]
fn tilted_faces_and_lobes_send_what_geometry_says() {
    let share = |emitter: Emitter, emission: Emission, normal: DVec3, net: bool| {
        let far = FarField::new(10.0, 30.0).unwrap();
        let mut scene = SceneBuilder::new(Medium::air());
        scene
            .source(Source::new("s", DVec3::ZERO, Region::World, emitter, emission).facing(normal));
        let sampling = if net { Sampling::Sobol } else { Sampling::Random };
        let settings = Settings { sampling, ..Settings::new(640_000, 31) };
        let outcome = run(&scene.build().unwrap(), &[&far], &settings).unwrap();
        let up = outcome.jackknife(|t| t.ledger.escaped_up);
        let cap: f64 = outcome.total.readings[0][..36].iter().sum();
        (up, cap)
    };
    let face = Emitter::Rectangle { half_x: 0.1, half_y: 0.4 };
    for tilt_deg in [0.0f64, 30.0, 90.0, 120.0, 180.0] {
        let (sin, cos) = tilt_deg.to_radians().sin_cos();
        for net in [false, true] {
            let normal = DVec3::new(sin * 0.6, sin * 0.8, cos);
            // A Lambertian face tilted by β sends (1 + cos β)/2 of its light upwards.
            let (up, _) = share(face, Emission::LAMBERTIAN, normal, net);
            let error = up.standard_error.max(1e-4);
            let off = (up.value - 0.5 * (1.0 + cos)) / error;
            assert!(off.abs() < 4.5, "{tilt_deg} {net}: {up:?}");
        }
    }
    for exponent in [0.0, 1.0, 3.0, 25.0] {
        // What lies within 30 degrees of the axis: 1 - cos^(m + 1).
        let expected = 1.0 - 30f64.to_radians().cos().powf(exponent + 1.0);
        for net in [false, true] {
            let (_, cap) = share(Emitter::Point, Emission::CosinePower { exponent }, DVec3::Z, net);
            let error = (expected * (1.0 - expected) / 640_000.0).sqrt();
            assert!((cap - expected).abs() < 4.5 * error, "{exponent} {net}: {cap}");
        }
    }
}

#[test]
fn sources_share_the_power_by_weight() {
    let mut scene = SceneBuilder::new(Medium::air());
    for (direction, weight) in [(DVec3::Z, 3.0), (-DVec3::Z, 1.0)] {
        let beam = Emission::Beam { direction };
        let source = Source::new("beam", DVec3::ZERO, Region::World, Emitter::Point, beam);
        scene.source(Source { weight, ..source });
    }
    scene.power(8.0);
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(640_000, 9));
    // Taking turns: the shares are right to about one path in a group, without the noise of chance.
    assert!((outcome.total.ledger.escaped_up - 6.0).abs() < 8.0 * 3.0 / 10_000.0);
}

#[test]
fn streams_of_paths_pass_chi_square_within_and_across() {
    // Pairs of numbers of one stream, and of the same place in streams of neighbouring paths; ten
    // tests, each of which exceeds 4.5 by chance once in 150 000 times.
    for place in 0..5 {
        let streams = Streams::new(&mut stream(9, place));
        let pair = |number: u64, next: u64| {
            let (mut own, mut other) = (streams.path(number), streams.path(number + next));
            for _ in 0..place {
                unit(&mut own);
                unit(&mut other);
            }
            let first = unit(&mut own);
            (first, unit(if next == 0 { &mut own } else { &mut other }))
        };
        for next in [0, 1] {
            let mut number = 0;
            let counts = histogram(9, |_| {
                number += 1 + next;
                pair(number, next)
            });
            assert!(deviate(&counts).abs() < 4.5, "{place} {next}: {}", deviate(&counts));
        }
    }
}

#[test]
fn neighbouring_streams_are_not_correlated() {
    const PATHS: u64 = 200_000;
    let streams = Streams::new(&mut stream(12, 0));
    let begins = |number: u64| {
        let mut own = streams.path(number);
        [0; 6].map(|_| unit(&mut own) - 0.5)
    };
    // Every place with every place of the stream `apart` paths on: 216 coefficients of a normal law
    // of width 1/√n.
    for apart in [1, 2, 3, 64, 1000, 1 << 32] {
        let mut sums = [[0.0; 6]; 6];
        for number in 0..PATHS {
            let (a, b) = (begins(number), begins(number + apart));
            for (row, a) in sums.iter_mut().zip(a) {
                for (sum, b) in row.iter_mut().zip(b) {
                    *sum += 12.0 * a * b;
                }
            }
        }
        for deviation in sums.into_iter().flatten() {
            let deviation = deviation / (PATHS as f64).sqrt();
            assert!(deviation.abs() < 4.5, "{apart}: {deviation}");
        }
    }
    // Every bit of the first words is as often 1 as 0, and turns independently of the same bit of
    // the next path.
    let (mut ones, mut turns) = ([0_u32; 64], [0_u32; 64]);
    for number in 0..PATHS {
        let word = streams.path(number).next_u64();
        let next = streams.path(number + 1).next_u64();
        for bit in 0..64 {
            ones[bit] += (word >> bit) as u32 & 1;
            turns[bit] += ((word ^ next) >> bit) as u32 & 1;
        }
    }
    for count in ones.into_iter().chain(turns) {
        let deviation = (f64::from(count) - 0.5 * PATHS as f64) / (0.25 * PATHS as f64).sqrt();
        assert!(deviation.abs() < 4.5, "{deviation}");
    }
}

#[test]
fn scenes_that_hardly_differ_see_the_same_paths() {
    let outcome = |box_reflectance: f64, seed: u64| {
        let package = package(N, Dome::relief(staircase(17)), 0.95, box_reflectance);
        let settings = Settings::new(200_000, seed);
        trace(&array(&package, 2, 8.3).build().unwrap(), &[], &settings)
    };
    // Standard error of the difference in extraction, from the groups of both runs pair by pair.
    let spread = |a: &Outcome, b: &Outcome| {
        let pairs = a.groups.iter().zip(&b.groups);
        let all: Vec<f64> =
            pairs.map(|(a, b)| a.ledger.extraction() - b.ledger.extraction()).collect();
        let (n, mean) = (all.len() as f64, all.iter().sum::<f64>() / all.len() as f64);
        (all.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt()
    };
    let base = outcome(0.86, 5);
    let (paired, apart) = (spread(&base, &outcome(0.85, 5)), spread(&base, &outcome(0.85, 6)));
    // One reflection off the box in a hundred ends otherwise: far fewer paths than those that
    // decide the error of either run.
    assert!(paired < 0.5 * apart, "{paired:e} {apart:e}");
}

#[test]
fn same_seed_same_bits_on_any_number_of_threads() {
    let scene =
        array(&package(N, Dome::relief(staircase(17)), 0.95, 0.86), 2, 8.3).build().unwrap();
    let (far, plane) = (FarField::default(), PlaneMap::centred(3.0, 0.2, 100, 100).unwrap());
    let settings = Settings::new(200_000, 10);
    let outcome = |threads: usize, settings: &Settings| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&scene, &[&far, &plane], settings).unwrap())
    };
    let one = outcome(1, &settings);
    assert!(one == outcome(2, &settings));
    assert!(one == outcome(3, &settings));
    // Other seeds and other groups are other paths.
    assert!(one != outcome(2, &Settings { seed: 11, ..settings }));
    assert!(one.groups[0] != one.groups[1]);
}

/// A Lambertian point in empty space.
fn lone_source() -> Scene {
    let source = Source::new("s", DVec3::ZERO, Region::World, Emitter::Point, Emission::LAMBERTIAN);
    SceneBuilder::new(Medium::air()).source(source).build().unwrap()
}

#[test]
fn errors_are_as_large_as_they_say() {
    // Deviations of 200 independent runs from the truth, in their own standard errors, have
    // variance 1.
    let scene = lone_source();
    let plane = PlaneMap::centred(1.0, 2.0, 1, 1).unwrap();
    let truth = 4.0 * 0.138_531_606;
    let mut squares = 0.0;
    for seed in 0..200 {
        let outcome = trace(&scene, &[&plane], &Settings::new(6400, seed));
        let direct = outcome.bins(0)[0];
        let jackknife = outcome.jackknife(|totals| totals.readings[0][0]);
        assert!((direct.standard_error / jackknife.standard_error - 1.0).abs() < 1e-9);
        squares += direct.deviations_from(truth).powi(2);
    }
    let mean = squares / 200.0;
    assert!((mean - 1.0).abs() < 5.0 * (2.0f64 / 200.0).sqrt() * 1.05, "{mean}");
}

#[test]
fn progress_adds_up_and_cancellation_stops() {
    let scene = lone_source();
    let (done, cancel) = (AtomicU64::new(0), AtomicBool::new(false));
    let progress = |paths: u64| {
        done.fetch_add(paths, Ordering::Relaxed);
    };
    let control =
        Control { progress: Some(&progress), cancel: Some(&cancel), ..Control::default() };
    let settings = Settings::new(1_000_000, 12);
    let outcome = run_with(&scene, &[], &settings, control).unwrap();
    assert_eq!(done.load(Ordering::Relaxed), outcome.paths);
    cancel.store(true, Ordering::Relaxed);
    assert_eq!(run_with(&scene, &[], &settings, control), Err(Error::Cancelled));
}
