// SPDX-License-Identifier: MIT OR Apache-2.0
//! Receivers with a memory: radiance, irradiance, intensity and flux against closed forms; filters
//! that divide the light without changing it.

use std::f64::consts::PI;

use crate::common::package::Dome;
use crate::common::*;
use tracer::glam::DVec3;
use tracer::receiver::{Angles, DetectorRectangle, FLUX_BINS, Facing, Layout, Sense};
use tracer::{
    Detector, Emission, Emitter, Error, Estimate, FarField, Filter, Measurement, Medium, Outcome,
    PlaneMap, Prototype, Receiver, Region, Sampling, Scene, SceneBuilder, Settings, Shape, Source,
    Surface, SurfaceModel, run,
};

const UP: Facing = Facing::Z(Sense::Plus);

fn rectangle(
    facing: Facing,
    centre: [f64; 3],
    size: [f64; 2],
    bins: [usize; 2],
) -> DetectorRectangle {
    DetectorRectangle::new(facing, DVec3::from_array(centre), size, bins).unwrap()
}

fn seen(scene: &Scene, detectors: &[Detector], paths: u64, seed: u64) -> Outcome {
    let settings = Settings::new(paths, seed);
    run(scene, &receivers(detectors), &settings).unwrap()
}

/// A Lambertian disc of this radius that emits 1 W from the origin upwards, in air.
fn disc(radius: f64) -> Scene {
    let mut scene = SceneBuilder::new(Medium::air());
    let emitter = Emitter::Disc { radius };
    let position = DVec3::ZERO;
    scene.source(Source::new("disc", position, Region::World, emitter, Emission::LAMBERTIAN));
    scene.build().unwrap()
}

/// Fails where bins are not `expected` within five standard errors, or where their errors are not
/// small.
fn assert_bins(what: &str, bins: &[Estimate], expected: f64, error: f64) {
    for (number, bin) in bins.iter().enumerate() {
        assert!(
            bin.standard_error > 0.0 && bin.standard_error < error * expected,
            "{what} {number}: {bin:?}"
        );
        assert!(
            bin.deviations_from(expected) < 5.0,
            "{what} {number}: {bin:?} instead of {expected}"
        );
    }
}

/// Estimates of the bins over their measures.
fn values(outcome: &Outcome, detector: &Detector, reading: usize) -> Vec<Estimate> {
    let bins = outcome.bins(reading);
    let measures = detector.measures();
    bins.iter()
        .zip(&measures)
        .map(|(bin, measure)| Estimate {
            value: bin.value / measure,
            standard_error: bin.standard_error / measure,
        })
        .collect()
}

#[test]
fn a_lambertian_disc_looks_equally_bright_from_everywhere() {
    let radius = 2.0;
    // Just above it, where every direction still comes from it: radiance is 1 W/(π · π r²) in all
    // places and directions.
    let near = Detector::new(
        "near",
        Measurement::Luminance(
            rectangle(UP, [0.1, -0.2, 1e-9], [1.6, 1.2], [2, 3]),
            Angles::cone(90.0, 15.0, 60.0).unwrap(),
        ),
    );
    let outcome = seen(&disc(radius), std::slice::from_ref(&near), many() / 4, 1);
    let radiance = 1.0 / (PI * PI * radius * radius);
    let values = values(&outcome, &near, 0);
    assert_eq!(values.len(), 6 * 36);
    assert_bins("direction", &values, radiance, 0.2);

    // Nothing passes downwards.
    let level = Detector::new(
        "down",
        Measurement::Plane(rectangle(Facing::Z(Sense::Minus), [0.0, 0.0, 1.0], [9.0, 9.0], [1, 1])),
    );
    let outcome = seen(&disc(radius), &[level], 10_000, 1);
    assert!(outcome.bins(0)[0].value.abs() < 1e-300);
}

#[test]
fn illuminance_above_a_disc_is_that_of_the_closed_form() {
    // On the axis E = π L sin² u, with tan u = radius/height; π L = 1 W over the area of the disc.
    let (radius, height) = (1.5f64, 2.0f64);
    let sin2 = radius * radius / (radius * radius + height * height);
    let expected = sin2 / (PI * radius * radius);
    let small = Detector::new(
        "axis",
        Measurement::Plane(rectangle(UP, [0.0, 0.0, height], [0.2, 0.2], [1, 1])),
    );
    let outcome = seen(&disc(radius), std::slice::from_ref(&small), many(), 2);
    // Over the bin it falls by less than 4e-3.
    let value = values(&outcome, &small, 0)[0];
    assert!(
        (value.value - expected).abs() < 5.0 * value.standard_error + 4e-3 * expected,
        "{value:?} instead of {expected}"
    );

    // All light passes a large plane, and five sides of a box, in the direction of their normals.
    let (far, high) = (50.0, 100.0);
    let sides = [
        (UP, [0.0, 0.0, high], [100.0, 100.0]),
        (Facing::X(Sense::Plus), [far, 0.0, 50.0], [100.0, 100.0]),
        (Facing::X(Sense::Minus), [-far, 0.0, 50.0], [100.0, 100.0]),
        (Facing::Y(Sense::Plus), [0.0, far, 50.0], [100.0, 100.0]),
        (Facing::Y(Sense::Minus), [0.0, -far, 50.0], [100.0, 100.0]),
    ];
    let sides = sides.map(|(facing, centre, size)| {
        Detector::new("side", Measurement::Plane(rectangle(facing, centre, size, [3, 3])))
    });
    let outcome = seen(&disc(radius), &sides, 64_000, 3);
    let all: f64 = outcome.total.readings.iter().flatten().sum();
    assert!((all - 1.0).abs() < 1e-12, "{all}");
}

#[test]
fn far_fields_between_and_about_planes_show_the_cosine() {
    for layout in [Layout::Between, Layout::About] {
        let far = Detector::new(
            "far",
            Measurement::FarField(Angles::sphere(layout, 10.0, 90.0).unwrap()),
        );
        let Measurement::FarField(angles) = &far.measurement else { unreachable!() };
        let outcome = seen(&disc(0.1), std::slice::from_ref(&far), many() / 10, 4);
        let edges = angles.theta_edges_deg();
        let sin2 = |deg: f64| deg.min(90.0).to_radians().sin().powi(2);
        for (row, pair) in edges.windows(2).enumerate() {
            let share: f64 = outcome.total.readings[0][4 * row..4 * row + 4].iter().sum();
            assert_share("row", share, sin2(pair[1]) - sin2(pair[0]), outcome.paths, 0.0);
        }
    }
}

/// Two packages with a relief between Lambertian walls: light of every history.
fn packages() -> Scene {
    let package = package(N, Dome::relief(staircase(17)), 0.9, 0.8);
    between_walls(package.prototype().unwrap())
}

fn between_walls(prototype: Prototype) -> Scene {
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(prototype);
    place_array(&mut scene, id, [2, 1], 4.0);
    let housing = tracer::housing::Housing {
        half: [5.0, 3.0],
        height: 2.0,
        thickness: 0.5,
        walls: SurfaceModel::Lambertian { reflectance: 0.8 },
        floor: SurfaceModel::Lambertian { reflectance: 0.6 },
        mirror: None,
    };
    for surface in housing.surfaces().unwrap() {
        scene.surface(surface);
    }
    scene.build().unwrap()
}

fn measurements_of_each_kind() -> Vec<Measurement> {
    vec![
        Measurement::FarField(Angles::sphere(Layout::Between, 10.0, 30.0).unwrap()),
        Measurement::Plane(rectangle(UP, [0.0, 0.0, 2.5], [8.0, 6.0], [4, 3])),
        Measurement::Luminance(
            rectangle(UP, [0.0, 0.0, 2.5], [8.0, 6.0], [2, 1]),
            Angles::cone(90.0, 30.0, 90.0).unwrap(),
        ),
        Measurement::Flux("wall".to_owned()),
    ]
}

/// Filters that divide the light between them: their readings add up, with the same draws, to those
/// without a filter.
#[test]
fn filters_divide_the_light() {
    let scene = packages();
    let bounces = [[0, 3], [4, 4], [5, 30], [31, u32::MAX]]
        .map(|bounces| Filter { bounces, ..Filter::default() });
    let sources = [0, 1].map(|source| Filter { sources: Some(vec![source]), ..Filter::default() });
    let radii = [[-1.0, 0.3], [0.3, 1.1], [1.1, f64::INFINITY]]
        .map(|radii| Filter { last_radii_mm: Some(radii), ..Filter::default() });
    let (names, none) = (scene.lines().surfaces.clone(), [0, 0]);
    let mut surfaces: Vec<Filter> = names
        .iter()
        .map(|name| Filter { last_surface: Some(name.clone()), ..Filter::default() })
        .collect();
    surfaces.push(Filter { bounces: none, ..Filter::default() });
    for measurement in measurements_of_each_kind() {
        for filters in [&bounces[..], &sources, &surfaces, &radii] {
            let mut detectors = vec![Detector::new("all", measurement.clone())];
            detectors.extend(
                filters.iter().map(|filter| {
                    Detector::new("part", measurement.clone()).filtered(filter.clone())
                }),
            );
            let outcome = seen(&scene, &detectors, 40_000, 6);
            let readings = &outcome.total.readings;
            let nonzero = readings[1..].iter().filter(|r| r.iter().sum::<f64>() > 0.0);
            assert!(nonzero.count() > 1, "{measurement:?}");
            for bin in 0..detectors[0].bins() {
                let sum: f64 = readings[1..].iter().map(|reading| reading[bin]).sum();
                // The same numbers in another order.
                assert!(
                    (sum - readings[0][bin]).abs() <= 1e-12 * readings[0][bin],
                    "{measurement:?}, bin {bin}"
                );
            }
        }
    }
}

/// A package of two media is traced path by path, one of a single medium in batches. Paths draw the
/// same numbers on both routes, so every bin is the same sum in another order; a bin may differ by
/// few paths that run within rounding of its edge.
#[test]
fn receivers_read_the_same_in_batches_and_path_by_path() {
    let mut prototype = package(N, Dome::relief(staircase(17)), 0.9, 0.8).prototype().unwrap();
    prototype.media.push(Medium::clear("unused", 1.7));
    let (batched, walked) = (packages(), between_walls(prototype));
    let filters = [
        Filter::default(),
        Filter { bounces: [2, 5], ..Filter::default() },
        Filter {
            // Between the risers: on one, rounding decides.
            last_radii_mm: Some([0.25, 1.15]),
            ..Filter::default()
        },
        Filter { last_surface: Some("element_9".to_owned()), ..Filter::default() },
        Filter { sources: Some(vec![1]), ..Filter::default() },
    ];
    let mut measurements = measurements_of_each_kind();
    measurements.push(Measurement::Flux("element_9".to_owned()));
    let detectors: Vec<Detector> = measurements
        .iter()
        .flat_map(|measurement| {
            filters
                .iter()
                .map(|filter| Detector::new("read", measurement.clone()).filtered(filter.clone()))
        })
        .collect();
    let paths = 64_000;
    for sampling in [Sampling::Random, Sampling::Sobol] {
        let settings = Settings { sampling, ..Settings::new(paths, 8) };
        let [a, b] =
            [&batched, &walked].map(|scene| run(scene, &receivers(&detectors), &settings).unwrap());
        let pairs = a.total.readings.iter().zip(&b.total.readings);
        for (detector, (a, b)) in detectors.iter().zip(pairs) {
            let sum: f64 = b.iter().sum();
            assert!(sum > 0.0, "{detector:?}");
            assert!((a.iter().sum::<f64>() - sum).abs() <= 1e-9 * sum, "{detector:?}");
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() <= 3.0 / paths as f64, "{detector:?}: {a} {b}");
            }
        }
    }
}

#[test]
fn detectors_see_what_receivers_and_the_ledger_see() {
    let scene = packages();
    let (far, plane) =
        (FarField::new(10.0, 30.0).unwrap(), PlaneMap::centred(2.5, 2.0, 4, 3).unwrap());
    let detectors: Vec<Detector> = measurements_of_each_kind()
        .into_iter()
        .map(|measurement| Detector::new("all", measurement))
        .collect();
    let settings = Settings::new(64_000, 7);
    let receivers: [&dyn Receiver; 2] = [&far, &plane];
    let plain = run(&scene, &receivers, &settings).unwrap();
    let more = detectors.iter().map(|d| d as &dyn Receiver);
    let all: Vec<_> = receivers.into_iter().chain(more).collect();
    let outcome = run(&scene, &all, &settings).unwrap();
    let total = &outcome.total;
    // Receivers read and draw nothing.
    for (a, b) in total.readings[..2].iter().flatten().zip(plain.total.readings.iter().flatten()) {
        assert!((a - b).abs() <= 1e-12, "{a} {b}");
    }
    for ((name, a), (_, b)) in
        total.ledger.named_surfaces().zip(plain.total.ledger.named_surfaces())
    {
        let differences = [a.absorbed - b.absorbed, a.outward - b.outward, a.inward - b.inward];
        assert!(differences.iter().all(|d| d.abs() <= 1e-12), "{name}: {a:?} {b:?}");
    }
    for (ours, theirs) in [(2, 0), (3, 1)] {
        for (a, b) in total.readings[ours].iter().zip(&total.readings[theirs]) {
            assert!((a - b).abs() <= 1e-12 * b, "{a} {b}");
        }
    }
    // Radiance over all directions is irradiance.
    for (column, radiance) in total.readings[4].chunks(12).enumerate() {
        let halves: f64 =
            (0..12).filter(|bin| bin % 4 / 2 == column).map(|bin| total.readings[3][bin]).sum();
        assert!((radiance.iter().sum::<f64>() - halves).abs() < 1e-12);
    }
    let flux = |name: &str| {
        let bin = FLUX_BINS.iter().position(|known| *known == name).unwrap();
        total.readings[5][bin]
    };
    let absorbed = total.ledger.surface("wall").unwrap().absorbed;
    assert!((flux("from_outside_absorbed") - absorbed).abs() < 1e-12);
    // Grey walls absorb a fifth of what comes; roulette takes its share by chance.
    let share = absorbed / flux("from_outside");
    assert!((share - 0.2).abs() < 0.01, "{share}");
    assert!(flux("from_inside") + flux("from_outside_passed") < 1e-300);
}

#[test]
fn flux_through_an_interface_is_fresnels() {
    // A beam straight through a slab's upper face: of index 1.5 inside, 4 % come back.
    let detector = Detector::new("face", Measurement::Flux("face".to_owned()));
    let outcome = seen(&beam_in_a_slab(), &[detector], many() / 20, 8);
    let bins = outcome.bins(0);
    let sent = bins[0].value;
    assert_share("passed", bins[2].value / sent, 0.96, outcome.paths, 0.0);
    assert!(bins[1].value < 1e-300);
}

/// A beam inside of a body whose upper face refracts and whose lower one absorbs.
fn beam_in_a_slab() -> Scene {
    let face = Shape::annulus(1.0, 0.0, 5.0).unwrap();
    let base = Shape::annulus(0.0, 0.0, 5.0).unwrap();
    let side = Shape::cylinder(5.0, -1e-9, 1.0 + 1e-9).unwrap();
    let surfaces = vec![
        Surface::new("face", face, BODY, Region::World, &SurfaceModel::Interface),
        Surface::new("base", base, Region::Opaque, BODY, &SurfaceModel::Absorber),
        Surface::new("side", side, BODY, Region::World, &SurfaceModel::Absorber),
    ];
    let beam = Emission::Beam { direction: DVec3::Z };
    let source = inside(DVec3::Z * 0.5, Emitter::Point, beam);
    single(lamp(1.5, surfaces, source))
}

#[test]
fn what_does_not_fit_the_scene_is_refused() {
    let scene = packages();
    let refused = |detector: Detector| {
        let settings = Settings::new(1000, 1);
        run(&scene, &[&detector], &settings).unwrap_err()
    };
    let cut = |centre, size| {
        Detector::new("cut", Measurement::Plane(rectangle(UP, centre, size, [1, 1])))
    };
    // Through a dome, and through a wall.
    let error = refused(cut([0.0, 0.0, 0.5], [2.0, 2.0]));
    assert!(matches!(error, Error::ReceiverCuts { .. }), "{error}");
    let error = refused(cut([0.0, 0.0, 1.5], [11.0, 2.0]));
    assert!(matches!(error, Error::ReceiverCuts { .. }), "{error}");
    let error = refused(Detector::new("x", Measurement::Flux("roof".to_owned())));
    assert!(error.to_string().contains("'roof'") && error.to_string().contains("wall"));
    let error = refused(
        Detector::new("x", Measurement::Flux("wall".to_owned()))
            .filtered(Filter { sources: Some(vec![2]), ..Filter::default() }),
    );
    assert_eq!(error.to_string(), "receiver 'x': expected a source from 1 to 2, got 3");
}

#[test]
fn dark_sources_keep_their_numbers_and_change_nothing() {
    let beam = |name: &str, x: f64, weight: f64| {
        let position = DVec3::new(x, 0.0, 0.0);
        let emission = Emission::Lambertian { half_angle_deg: 60.0 };
        Source::new(name, position, Region::World, Emitter::Point, emission).weighing(weight)
    };
    let of = |weights: &[f64]| {
        let mut scene = SceneBuilder::new(Medium::air());
        for (k, weight) in weights.iter().enumerate() {
            scene.source(beam(&format!("{k}"), k as f64, *weight));
        }
        scene.build()
    };
    let plane = |source: usize, x: f64| {
        let measurement = Measurement::Plane(rectangle(UP, [x, 0.0, 1.0], [2.0, 2.0], [4, 4]));
        let mut detector = Detector::new("plane", measurement);
        detector.filter.sources = Some(vec![source]);
        detector
    };
    for sampling in [Sampling::Random, Sampling::Sobol] {
        let settings = Settings { sampling, ..Settings::new(64_000, 9) };
        let lit = |weights: &[f64], detectors: &[Detector]| {
            let scene = of(weights).unwrap();
            run(&scene, &receivers(detectors), &settings).unwrap()
        };
        // Sources 1 and 3 of five are those that stand alone, moved there.
        let all = lit(&[0.0, 1.0, 0.0, 3.0, 0.0], &[0, 1, 2, 3, 4].map(|k| plane(k, k as f64)));
        let readings = |o: &Outcome, k: usize| o.total.readings[k].iter().sum::<f64>();
        assert!([0, 2, 4].iter().all(|k| readings(&all, *k) <= 0.0));
        assert!((3.0 * readings(&all, 1) / readings(&all, 3) - 1.0).abs() < 0.02);
        assert!((all.total.ledger.emitted - 1.0).abs() < 1e-12);
        let one = lit(&[0.0, 1.0], &[plane(1, 1.0)]);
        let first = lit(&[1.0, 0.0], &[plane(0, 0.0)]);
        assert!(readings(&one, 0) > 0.3 && readings(&first, 0) > 0.3);
        assert!((readings(&one, 0) - readings(&first, 0)).abs() < 1e-12);
    }
    for weights in [&[0.0, 0.0][..], &[]] {
        assert!(matches!(of(weights), Err(Error::NoSource)));
    }
    assert!(of(&[1.0, -1.0]).is_err() && of(&[f64::NAN]).is_err());
}

#[test]
fn drives_scale_the_light_of_each_package() {
    let detector = Detector::new("plane", measurements_of_each_kind()[1].clone());
    let lit = |scene: Scene| {
        let outcome = seen(&scene, std::slice::from_ref(&detector), 64_000, 6);
        (scene.power(), outcome.total.readings[0].clone())
    };
    assert_eq!(lit(packages().driven(&[1.0, 1.0])), lit(packages()));
    // One alone at half its power: the same paths as those of `lit_by`, of a quarter of the power.
    let (power, half) = lit(packages().driven(&[0.5, 0.0]));
    let (whole, one) = lit(packages().lit_by(0));
    assert_eq!((power, whole), (0.25, 1.0));
    assert!(half.iter().zip(&one).all(|(a, b)| (a - 0.25 * b).abs() <= 1e-15));
    assert!(lit(packages().driven(&[0.0, 0.0])).0 <= 0.0);
    // Light adds up: that of both is that of each by its drive, within the noise of paths.
    let (power, both) = lit(packages().driven(&[0.3, 0.9]));
    let (_, other) = lit(packages().lit_by(1));
    assert!((power - 0.6).abs() < 1e-15);
    let sum = |bins: &[f64]| bins.iter().sum::<f64>();
    let expected = 0.15 * sum(&one) + 0.45 * sum(&other);
    assert!((sum(&both) / expected - 1.0).abs() < 0.02, "{} {expected}", sum(&both));
}

#[test]
fn merged_groups_keep_the_totals_and_average_their_readings() {
    let scene = disc(1.0);
    let outcome = seen(&scene, &[], 64_000, 5);
    let groups = outcome.groups.len();
    assert_eq!(outcome.clone().merged(groups), outcome);
    let merged = outcome.clone().merged(groups / 4);
    assert_eq!(merged.total, outcome.total);
    for (group, four) in merged.groups.iter().zip(outcome.groups.chunks(4)) {
        let mean = four.iter().map(|g| g.ledger.escaped_up).sum::<f64>() / 4.0;
        assert!((group.ledger.escaped_up - mean).abs() < 1e-15);
    }
    let plane = PlaneMap::centred(0.5, 0.5, 4, 4).unwrap();
    let outcome = run(&scene, &[&plane], &Settings::new(64_000, 5)).unwrap();
    let merged = outcome.clone().merged(groups / 4);
    for (group, four) in merged.groups.iter().zip(outcome.groups.chunks(4)) {
        for (bin, value) in group.readings[0].iter().enumerate() {
            let mean = four.iter().map(|g| g.readings[0][bin]).sum::<f64>() / 4.0;
            assert!((value - mean).abs() < 1e-15 && mean > 0.0);
        }
    }
}
