// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths that divide at the first surface that lets light through: the same means, all power in the
//! balance, errors by path.

use std::sync::Arc;

use crate::common::*;
use num_complex::Complex64;
use tracer::glam::DVec3;
use tracer::receiver::{Angles, DetectorRectangle, Facing, Layout, Sense};
use tracer::run::{Control, run_rays};
use tracer::{
    Detector, Dome, Emission, Emitter, FarField, Film, Layer, Measurement, Outcome, Package, Patch,
    PlaneMap, Polarization, Receiver, Region, Scene, Settings, Shape, Surface, SurfaceModel, run,
};

/// Divided at every interface, however weak the reflection.
fn dividing(paths: u64, seed: u64, path_splitting: u32) -> Settings {
    Settings { path_splitting, roulette_below: 1e-3, ..Settings::new(paths, seed) }
}

/// A point in the middle of a hemisphere on a black floor, all of whose light meets the dome
/// straight on.
fn hemisphere() -> Scene {
    let dome = Shape::sphere_zones(0.0, 2.0, &[2.0, 0.0]).unwrap();
    let base = Shape::annulus(0.0, 0.0, 2.001).unwrap();
    let surfaces = vec![
        Surface::new("dome", dome, BODY, Region::World, &SurfaceModel::Interface),
        Surface::new("base", base, Region::Opaque, BODY, &SurfaceModel::Absorber),
    ];
    let source = inside(DVec3::Z * 1e-6, Emitter::Point, Emission::LAMBERTIAN);
    single(lamp(N, surfaces, source))
}

#[test]
fn what_is_divided_needs_no_chance() {
    let scene = hemisphere();
    let transmitted = 1.0 - ((N - 1.0) / (N + 1.0_f64)).powi(2);
    let whole = trace(&scene, &[], &Settings::new(20_000, 1));
    let parts = trace(&scene, &[], &dividing(20_000, 1, 2));
    let escaped = |outcome: &Outcome| outcome.mean(|t| t.ledger.escaped_up);
    assert!((escaped(&parts).value - transmitted).abs() < 1e-9);
    assert!(escaped(&parts).standard_error < 1e-9);
    assert!(escaped(&whole).standard_error > 1e-4);
    assert!(escaped(&whole).deviations_from(transmitted) < 5.0);
    // Each part meets the floor or nothing: two surfaces, the dome counted once.
    assert_eq!(parts.hits, 2 * parts.paths);
}

#[test]
fn weak_parts_are_drawn_for() {
    // 3 % are reflected: below the threshold of 0.1, all goes one way.
    let scene = hemisphere();
    let settings = Settings { path_splitting: 2, ..Settings::new(20_000, 1) };
    // Path by path, from the same draws.
    let rays = |settings: &Settings| {
        let mut rays = Vec::new();
        let take = |ray: &tracer::Ray, power: f64| {
            rays.push((*ray, power));
            Ok(())
        };
        run_rays(&scene, settings, Control::default(), take).unwrap();
        rays
    };
    assert!(rays(&settings) == rays(&Settings::new(20_000, 1)));
    // The threshold decides.
    let lower = Settings { roulette_below: 0.02, ..settings };
    assert_eq!(rays(&lower).len(), 20_000);
}

/// Chi-square of the differences of all bins and lines of the ledger, and their number.
fn chi_square(a: &Outcome, b: &Outcome) -> (f64, f64) {
    let mut all: Vec<[tracer::Estimate; 2]> = Vec::new();
    for receiver in 0..a.total.readings.len() {
        let both = a.bins(receiver).into_iter().zip(b.bins(receiver));
        all.extend(both.map(|(a, b)| [a, b]));
    }
    for line in 0..a.total.ledger.surfaces.len() {
        all.push([a, b].map(|o| o.mean(|t| t.ledger.surfaces[line].absorbed)));
        all.push([a, b].map(|o| o.mean(|t| t.ledger.surfaces[line].outward)));
        all.push([a, b].map(|o| o.mean(|t| t.ledger.surfaces[line].inward)));
    }
    for line in 0..a.total.ledger.media.len() {
        all.push([a, b].map(|o| o.mean(|t| t.ledger.media[line])));
    }
    let terms = all.iter().filter_map(|[a, b]| {
        let variance = a.standard_error.powi(2) + b.standard_error.powi(2);
        (variance > 1e-24).then(|| (a.value - b.value).powi(2) / variance)
    });
    let terms: Vec<f64> = terms.collect();
    (terms.iter().sum(), terms.len() as f64)
}

/// A film that reflects a good part and absorbs some.
fn coated() -> Package {
    let layer =
        |n: f64, k: f64, thickness_nm: f64| Layer { index: Complex64::new(n, k), thickness_nm };
    let film = Film::new(550.0, vec![layer(2.3, 0.02, 60.0), layer(1.38, 0.0, 100.0)]).unwrap();
    let optics = SurfaceModel::Layered(Arc::new(film));
    let part = Patch::new("dome", optics.clone());
    let mut package = package(N, Dome::Zones(vec![(CAP.rim, part)]), 0.95, 0.86);
    package.side = optics;
    package.silicone = package.silicone.absorbing(0.1);
    package
}

#[test]
fn means_are_those_of_whole_paths() {
    let far = FarField::new(10.0, 45.0).unwrap();
    let plane = PlaneMap::centred(3.0, 2.0, 6, 6).unwrap();
    let receivers: [&dyn Receiver; 2] = [&far, &plane];
    let scattering: Arc<dyn bsdf::Bsdf> = Arc::new(bsdf::SmoothInterface::new(N, 1.0).unwrap());
    let part = Patch::new("dome", SurfaceModel::Scatter(scattering));
    let packages = [
        package(N, Dome::smooth(&CAP), 0.95, 0.86),
        package(N, Dome::relief(staircase(17)), 0.95, 0.86),
        package(N, Dome::Zones(vec![(CAP.rim, part)]), 0.95, 0.86),
        coated(),
    ];
    for (number, package) in packages.iter().enumerate() {
        let scene = array(package, 2, 4.0).build().unwrap();
        for polarization in [Polarization::Unpolarised, Polarization::Carried] {
            let with = |settings: Settings| Settings { polarization, ..settings };
            let whole = trace(&scene, &receivers, &with(Settings::new(300_000, 5)));
            let parts = trace(&scene, &receivers, &with(dividing(150_000, 6, 3)));
            let (chi2, count) = chi_square(&parts, &whole);
            // Five deviations of chi-square over bins that are nearly independent.
            let bound = count * 63.0 / 61.0 + 5.0 * (2.2 * count).sqrt();
            assert!(
                count > 100.0 && chi2 < bound,
                "package {number}, {polarization:?}: {chi2} of {count}"
            );
        }
    }
}

#[test]
fn errors_are_as_large_as_they_say() {
    // Over 100 seeds the scatter of the escaped power and the errors that the runs state agree.
    let scene = single(mirrored_cap(Emission::LAMBERTIAN));
    let runs = (0..100).map(|seed| {
        let outcome = run(&scene, &[], &dividing(6400, seed, 2)).unwrap();
        outcome.mean(|t| t.ledger.escaped_up)
    });
    let runs: Vec<_> = runs.collect();
    let mean = runs.iter().map(|e| e.value).sum::<f64>() / 100.0;
    let scatter = runs.iter().map(|e| (e.value - mean).powi(2)).sum::<f64>() / 99.0;
    let stated = runs.iter().map(|e| e.standard_error.powi(2)).sum::<f64>() / 100.0;
    // A variance of 100 values is known to 14 %.
    assert!((scatter / stated - 1.0).abs() < 0.6, "{scatter} {stated}");
}

#[test]
fn detectors_read_every_part_once() {
    let far = FarField::new(10.0, 45.0).unwrap();
    let plane = PlaneMap::centred(3.0, 2.0, 6, 6).unwrap();
    let scene = array(&package(N, Dome::smooth(&CAP), 0.95, 0.86), 2, 4.0).build().unwrap();
    let rectangle = |z: f64| {
        let centre = DVec3::new(0.0, 0.0, z);
        DetectorRectangle::new(Facing::Z(Sense::Plus), centre, [12.0, 12.0], [6, 6]).unwrap()
    };
    let sky = Angles::sphere(Layout::Between, 10.0, 45.0).unwrap();
    let detectors = [
        Detector::new("sky", Measurement::FarField(sky)),
        Detector::new("plane", Measurement::Plane(rectangle(3.0))),
        Detector::new("dome", Measurement::Flux("dome".to_owned())),
    ];
    let mut receivers: Vec<&dyn Receiver> = vec![&far, &plane];
    receivers.extend(detectors.iter().map(|d| d as &dyn Receiver));
    let seen = |settings: &Settings| run(&scene, &receivers, settings).unwrap();
    let parts = seen(&dividing(60_000, 8, 2));
    for (receiver, detector) in [(0, 2), (1, 3)] {
        let [a, b] = [receiver, detector].map(|k| &parts.total.readings[k]);
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
    // What meets the dome and passes it, as the ledger has it, and as whole paths do.
    let whole = seen(&Settings::new(240_000, 9));
    let line = parts.total.ledger.surface("dome").unwrap();
    assert!((parts.total.readings[4][2] - line.outward).abs() < 1e-12);
    for (a, b) in parts.bins(4).iter().zip(whole.bins(4)) {
        let error = a.standard_error.hypot(b.standard_error);
        assert!((a.value - b.value).abs() <= 5.0 * error, "{a:?} {b:?}");
    }
}
