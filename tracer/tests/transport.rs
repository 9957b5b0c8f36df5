// SPDX-License-Identifier: MIT OR Apache-2.0
//! Laws of transport: integrating sphere, white furnace, etendue, view factors, cos⁴, power that
//! balances.

use crate::common::package::Dome;
use crate::common::*;
use std::f64::consts::PI;
use std::sync::Arc;
use tracer::glam::{DMat3, DVec3};
use tracer::shape::{Extent, Plane};
use tracer::{
    Emission, Emitter, FarField, Medium, Mixed, Patch, PlaneMap, Polarisation, Prototype, Region,
    SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, random,
};

#[test]
#[ignore = "slow: 4 s"]
fn integrating_sphere_multiplies() {
    // A port of share f of the sphere is a zone of height 2 R f.
    let (rho, f) = (0.98, 0.05);
    let wall = Shape::sphere_zones(0.0, 1.0, &[1.0, 1.0 - 2.0 * f, -1.0]).unwrap();
    let parts = vec![
        Patch::new("port", SurfaceModel::Absorber),
        Patch::new("wall", SurfaceModel::Lambertian { reflectance: rho }),
    ];
    let wall = Surface::zoned(wall, BODY, Region::Opaque, parts);
    let scene =
        single(lamp(1.0, vec![wall], inside(DVec3::ZERO, Emitter::Point, Emission::Isotropic)));
    let outcome = trace(&scene, &[], &Settings::new(many(), 60));
    // The first strike meets the port itself with probability f, else the multiplied light exits
    // through it.
    let multiplier = rho / (1.0 - rho * (1.0 - f));
    assert!((f * multiplier - 0.710_145).abs() < 1e-6);
    let exit = outcome.mean(|totals| totals.ledger.surface("port").unwrap().absorbed);
    let expected = f + (1.0 - f) * f * multiplier;
    assert!(exit.deviations_from(expected) < 5.0, "{exit:?} instead of {expected}");
}

#[test]
fn sphere_of_albedo_one_half_is_met_twice() {
    // Radiance 1 from a unit emission means incident = emitted/(1 - albedo).
    let wall = Shape::sphere(0.0, 1.0).unwrap();
    let wall = Surface::new(
        "wall",
        wall,
        BODY,
        Region::Opaque,
        &SurfaceModel::Lambertian { reflectance: 0.5 },
    );
    let scene =
        single(lamp(1.0, vec![wall], inside(DVec3::ZERO, Emitter::Point, Emission::Isotropic)));
    let settings = Settings { roulette_below: 1.0, ..Settings::new(many(), 61) };
    let outcome = trace(&scene, &[], &settings);
    // All or nothing from the first strike on: the number of strikes is geometric, mean 2, variance
    // 2.
    let mean = outcome.hits as f64 / outcome.paths as f64;
    assert!((mean - 2.0).abs() < 5.0 * (2.0 / outcome.paths as f64).sqrt(), "{mean}");
}

/// A body in the middle of a black sphere whose inside shines with one radiance everywhere:
/// whatever the body is, if it absorbs nothing the wall must find the same irradiance all over.
fn furnace(prototype: Prototype, place: DVec3, seed: u64) {
    furnace_of(prototype, place, &Settings::new(many() / 2, seed));
}

fn furnace_of(prototype: Prototype, place: DVec3, settings: &Settings) {
    let radius = 3.0;
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(prototype);
    scene.place(id, place);
    scene.surface(furnace_wall(radius));
    let enclosure = Emitter::Enclosure { radius };
    scene.source(Source::new("wall", DVec3::ZERO, Region::World, enclosure, Emission::LAMBERTIAN));
    let outcome = trace(&scene.build().unwrap(), &[], settings);
    let ledger = &outcome.total.ledger;
    assert!(ledger.lost_total() < 1e-6, "{:?}", ledger.lost);
    for zone in 0..20 {
        let power = ledger.surface(&format!("zone {zone}")).unwrap().absorbed;
        assert_share("zone", power, 0.05, outcome.paths, 1e-6);
    }
}

/// A lossless package with an underside, so that light may come from below.
fn closed_package(dome: Dome) -> Prototype {
    let mut prototype = package(N, dome, 1.0, 1.0).prototype().unwrap();
    let mirror = SurfaceModel::Mirror { reflectance: 1.0 };
    let plinth = [Shape::annulus(-0.01, 0.0, CAP.rim), Shape::cylinder(CAP.rim, -0.01, 0.0)];
    for (shape, (inner, outer)) in
        plinth.into_iter().zip([(Region::World, Region::Opaque), (Region::Opaque, Region::World)])
    {
        prototype.surfaces.push(Surface::new("plinth", shape.unwrap(), inner, outer, &mirror));
    }
    prototype.sources.clear();
    prototype
}

#[test]
fn white_furnace_stays_white_around_a_smooth_dome() {
    furnace(closed_package(Dome::smooth(&CAP)), DVec3::new(0.4, -0.3, 0.2), 62);
}

#[test]
fn white_furnace_stays_white_around_stepped_domes() {
    furnace(closed_package(Dome::relief(staircase(17))), DVec3::new(0.4, -0.3, 0.2), 63);
    furnace(closed_package(Dome::relief(teeth(17, 45.0, 10.0))), DVec3::new(-0.4, 0.3, 0.2), 64);
}

#[test]
fn white_furnace_stays_white_around_scattering_bands() {
    let interface: Arc<dyn bsdf::Bsdf> = Arc::new(bsdf::SmoothInterface::new(N, 1.0).unwrap());
    let zones = (1..=17)
        .map(|k| {
            (
                0.1 * f64::from(k),
                Patch::new(format!("band {k}"), SurfaceModel::Scatter(Arc::clone(&interface))),
            )
        })
        .collect();
    furnace(closed_package(Dome::Zones(zones)), DVec3::new(0.4, -0.3, 0.2), 65);
}

#[test]
fn white_furnace_stays_white_around_mixed_reflectors_with_and_without_polarisation() {
    for (seed, polarisation) in [(66, Polarisation::Unpolarised), (67, Polarisation::Carried)] {
        let mut prototype = closed_package(Dome::smooth(&CAP));
        for part in prototype.surfaces.iter_mut().flat_map(|s| &mut s.patches) {
            if let SurfaceModel::Mirror { reflectance } = part.optics {
                part.optics = SurfaceModel::Mixed(Mixed { reflectance, specular: 0.6 });
            }
        }
        let settings = Settings { polarisation, ..Settings::new(many() / 5, seed) };
        furnace_of(prototype, DVec3::new(0.4, -0.3, 0.2), &settings);
    }
}

#[test]
fn uniform_light_enters_a_sphere_by_the_diffuse_transmittance() {
    // Of the light that fills a sphere of radius R, (r/R)² strikes a concentric sphere of radius r;
    // T = 1 - F_ext of that enters, and since all of it comes out again in one pass or by inner
    // reflection, as much leaves.
    let ball = Shape::sphere(0.0, 1.0).unwrap();
    let ball = Surface::new("ball", ball, BODY, Region::World, &SurfaceModel::Interface);
    let mut scene = SceneBuilder::new(Medium::air());
    let media = vec![Medium::clear("silicone", N)];
    let id = scene.prototype(Prototype { media, surfaces: vec![ball], sources: vec![] });
    scene.place(id, DVec3::ZERO);
    scene.surface(Surface::new(
        "wall",
        Shape::sphere(0.0, 2.0).unwrap(),
        Region::World,
        Region::Opaque,
        &SurfaceModel::Absorber,
    ));
    let emitter = Emitter::Enclosure { radius: 2.0 };
    scene.source(Source::new("wall", DVec3::ZERO, Region::World, emitter, Emission::LAMBERTIAN));
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many(), 66));
    let ball = outcome.total.ledger.surface("ball").unwrap();
    let expected = 0.25 * (1.0 - 0.078_335_481_6);
    assert_share("entered", ball.inward, expected, outcome.paths, 1e-10);
    assert!((ball.inward - ball.outward).abs() < 1e-12);
}

#[test]
fn refraction_of_a_full_lambertian_fills_the_critical_cone() {
    // From a body of index 1 into a world of index n: radiance is uniform up to the critical angle
    // and 0 beyond.
    for (half_angle_deg, edge_deg) in [(90.0f64, 45.171_476_246f64), (30.0, 20.769_539_735)] {
        let bare = SurfaceModel::Scatter(Arc::new(NoFresnel { inner: 1.0, outer: N }));
        let surfaces = vec![
            Surface::new("face", Shape::horizontal(0.0).unwrap(), BODY, Region::World, &bare),
            Surface::new(
                "back",
                Shape::horizontal(-1.0).unwrap(),
                Region::Opaque,
                BODY,
                &SurfaceModel::Absorber,
            ),
        ];
        let emission = Emission::Lambertian { half_angle_deg };
        let source = inside(DVec3::new(0.0, 0.0, -1.0), Emitter::Point, emission);
        let mut scene = SceneBuilder::new(Medium::clear("silicone", N));
        let id = scene.prototype(lamp(1.0, surfaces, source));
        let scene = scene.place(id, DVec3::ZERO).build().unwrap();
        let far = FarField::new(1.0, 360.0).unwrap();
        let outcome = trace(&scene, &[&far], &Settings::new(many(), 67));
        let edge = (half_angle_deg.to_radians().sin() / N).asin();
        assert!((edge.to_degrees() - edge_deg).abs() < 1e-8);
        // Power within θ is sin²θ/sin²(edge): etendue n² sin² is kept.
        let within = |theta: f64| (theta.to_radians().min(edge).sin() / edge.sin()).powi(2);
        for (bin, &power) in outcome.total.readings[0].iter().enumerate() {
            let expected = within(bin as f64 + 1.0) - within(bin as f64);
            assert_share("ring", power, expected, outcome.paths, 1e-12);
        }
    }
}

/// Power on an absorbing surface from a Lambertian source about the origin.
fn view_factor(emitter: Emitter, at: DVec3, receiver: Shape, seed: u64) -> (f64, u64) {
    let mut scene = SceneBuilder::new(Medium::air());
    scene.source(Source::new("rectangle", at, Region::World, emitter, Emission::LAMBERTIAN));
    scene.surface(Surface::new(
        "receiver",
        receiver,
        Region::World,
        Region::World,
        &SurfaceModel::Absorber,
    ));
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many(), seed));
    (outcome.total.ledger.surface("receiver").unwrap().absorbed, outcome.paths)
}

#[test]
#[ignore = "slow: 3 s"]
fn view_factors_of_discs() {
    for (r1, r2, h, expected) in [
        (1.0, 1.0, 1.0, 0.381_966_011),
        (1.0, 2.0, 1.0, 0.763_932_023),
        (0.5, 1.0, 2.0, 0.192_235_936),
    ] {
        let disc = Shape::annulus(h, 0.0, r2).unwrap();
        let (power, paths) = view_factor(Emitter::Disc { radius: r1 }, DVec3::ZERO, disc, 70);
        assert_share("coaxial discs", power, expected, paths, 1e-9);
    }
    for (aside, expected) in [
        (0.0, 0.5),
        (0.5, 0.437_982_633),
        (1.0, 0.276_393_202),
        (2.0, 0.052_786_405),
        (3.0, 0.011_906_470),
    ] {
        let disc = Shape::annulus(1.0, 0.0, 1.0).unwrap();
        let (power, paths) = view_factor(Emitter::Point, DVec3::new(0.0, aside, 0.0), disc, 71);
        assert_share("element to disc", power, expected, paths, 1e-9);
    }
}

#[test]
fn view_factors_of_rectangles() {
    let rectangle = |centre: DVec3, half_u: f64, half_v: f64| {
        Shape::Plane(Plane::new(centre, DVec3::Z, Extent::Rectangle { half_u, half_v }).unwrap())
    };
    for (a, b, expected) in [(1.0, 1.0, 0.138_531_606), (1.0, 2.0, 0.167_375_010)] {
        let shape = rectangle(DVec3::new(0.5 * a, 0.5 * b, 1.0), 0.5 * a, 0.5 * b);
        let (power, paths) = view_factor(Emitter::Point, DVec3::ZERO, shape, 72);
        assert_share("element to rectangle", power, expected, paths, 1e-9);
    }
    for (h, expected) in [(1.0, 0.199_824_896), (0.5, 0.415_253_284), (2.0, 0.068_589_589)] {
        let emitter = Emitter::Rectangle { half_x: 0.5, half_y: 0.5 };
        let shape = rectangle(DVec3::new(0.0, 0.0, h), 0.5, 0.5);
        let (power, paths) = view_factor(emitter, DVec3::ZERO, shape, 73);
        assert_share("parallel squares", power, expected, paths, 1e-9);
    }
}

/// View factor from a Lambertian element to the rectangle 0..a × 0..b at height 1; odd in a and b.
fn corner(a: f64, b: f64) -> f64 {
    let (u, v) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / u * (b / u).atan() + b / v * (a / v).atan()) / (2.0 * PI)
}

#[test]
#[ignore = "slow: 4 s"]
fn plane_receiver_follows_the_cosine_to_the_fourth() {
    let mut scene = SceneBuilder::new(Medium::air());
    scene.source(Source::new(
        "rectangle",
        DVec3::ZERO,
        Region::World,
        Emitter::Point,
        Emission::LAMBERTIAN,
    ));
    let plane = PlaneMap::centred(1.0, 0.1, 60, 40).unwrap();
    let outcome = trace(&scene.build().unwrap(), &[&plane], &Settings::new(many(), 74));
    let (mut chi2, bins) = (0.0, plane.columns() * plane.rows());
    for row in 0..plane.rows() {
        for column in 0..plane.columns() {
            let (x, y, half) = (plane.x_mm(column), plane.y_mm(row), 0.05);
            let expected = corner(x + half, y + half)
                - corner(x - half, y + half)
                - corner(x + half, y - half)
                + corner(x - half, y - half);
            let power = outcome.total.readings[0][row * plane.columns() + column];
            let variance = expected * (1.0 - expected) / outcome.paths as f64;
            chi2 += (power - expected).powi(2) / variance;
            // E = E0 cos⁴, up to what a bin of 0.1 averages over.
            let cos4 = (1.0 + x * x + y * y).powi(-2);
            assert!((expected / (0.01 * cos4 / PI) - 1.0).abs() < 5e-3);
        }
    }
    let spread = (2.0 * bins as f64).sqrt();
    assert!((chi2 - bins as f64).abs() < 5.0 * spread, "chi² {chi2} for {bins} bins");
    // The same from the groups: errors of bins as estimated are right on average.
    let estimates = outcome.bins(0);
    let mean2: f64 =
        estimates.iter().map(|bin| bin.standard_error.powi(2) / bin.value.max(1e-12)).sum::<f64>()
            / bins as f64
            * outcome.paths as f64;
    assert!((mean2 - 1.0).abs() < 0.05, "{mean2}");
}

#[test]
fn books_balance_in_the_full_array() {
    for (dome, seed) in [(Dome::smooth(&CAP), 80), (Dome::relief(staircase(17)), 81)] {
        let mut package = package(N, dome, 0.95, 0.86);
        package.silicone = package.silicone.absorbing(0.01);
        let scene = array(&package, 2, 8.3).build().unwrap();
        let far = FarField::default();
        let paths = many().max(1_000_000) / 10;
        let outcome = trace(&scene, &[&far], &Settings::new(paths, seed));
        let ledger = &outcome.total.ledger;
        for name in ["bottom", "box side", "box top", "ground mirror", "floor", "side"] {
            let line = ledger.surface(name).unwrap();
            assert_eq!(line.absorbed > 0.0, name != "side", "{name}");
        }
        assert!(ledger.lost_total() <= 0.0, "{:?}", ledger.lost);
        // Light from neighbours enters packages.
        assert!(ledger.surface("side").unwrap().inward > 0.0);
        let extraction = outcome.jackknife(|totals| totals.ledger.extraction());
        assert!(extraction.value > 0.92 && extraction.value < 0.99);
        assert!(extraction.standard_error < 0.3 / (outcome.paths as f64).sqrt());
        // The far field holds what escaped.
        let far_power: f64 = outcome.total.readings[0].iter().sum();
        assert!((far_power - ledger.escaped()).abs() < 1e-12);
    }
}

#[test]
fn the_roulette_changes_no_mean() {
    let scene = array(&package(N, Dome::relief(staircase(17)), 0.8, 0.5), 2, 8.3).build().unwrap();
    let extraction = |roulette_below: f64, seed: u64| {
        let settings = Settings { roulette_below, ..Settings::new(many() / 10, seed) };
        trace(&scene, &[], &settings).jackknife(|totals| totals.ledger.extraction())
    };
    let (always, seldom) = (extraction(1.0, 82), extraction(0.001, 83));
    let error = always.standard_error.hypot(seldom.standard_error);
    assert!((always.value - seldom.value).abs() < 5.0 * error, "{always:?} {seldom:?}");
    assert!(seldom.standard_error < always.standard_error);
}

#[test]
fn bands_that_scatter_like_an_interface_are_an_interface() {
    let interface: Arc<dyn bsdf::Bsdf> = Arc::new(bsdf::SmoothInterface::new(N, 1.0).unwrap());
    let bands = (1..=17)
        .map(|k| {
            let optics = SurfaceModel::Scatter(Arc::clone(&interface));
            (0.1 * f64::from(k), Patch::new(format!("band {k}"), optics))
        })
        .collect();
    let far = FarField::new(2.0, 45.0).unwrap();
    let rings = |dome: Dome, seed: u64| {
        let scene = array(&package(N, dome, 0.95, 0.86), 2, 8.3).build().unwrap();
        let outcome = trace(&scene, &[&far], &Settings::new(4 * many() / 5, seed));
        outcome.jackknife_many(|totals| {
            let rows = totals.readings[0].chunks_exact(far.phis());
            let mut values: Vec<f64> = rows.map(|row| row.iter().sum()).collect();
            values.push(totals.ledger.extraction());
            values
        })
    };
    let (direct, banded) = (rings(Dome::smooth(&CAP), 84), rings(Dome::Zones(bands), 85));
    for (a, b) in direct.iter().zip(&banded) {
        let error = a.standard_error.hypot(b.standard_error);
        assert!((a.value - b.value).abs() <= 5.0 * error, "{a:?} {b:?}");
    }
    assert!(direct[10].value > 100.0 * direct[10].standard_error || cfg!(debug_assertions));
}

#[test]
fn a_beam_enters_and_leaves_every_package_on_its_way() {
    // Index-matched, so that it goes straight through all three, above the boxes.
    let mut clear = package(1.0, Dome::relief(staircase(17)), 0.95, 0.86);
    clear.led.size.z = 0.1;
    let mut prototype = clear.prototype().unwrap();
    prototype.sources.clear();
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(prototype);
    place_array(&mut scene, id, [3, 1], 4.0);
    let beam = Emission::Beam { direction: DVec3::X };
    let start = DVec3::new(-9.0, 0.3, 0.2);
    scene.source(Source::new("beam", start, Region::World, Emitter::Point, beam));
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(6400, 86));
    let ledger = &outcome.total.ledger;
    let passed = |inward: bool| -> f64 {
        ledger.surfaces.iter().map(|line| if inward { line.inward } else { line.outward }).sum()
    };
    assert!((passed(true) - 3.0).abs() < 1e-12 && (passed(false) - 3.0).abs() < 1e-12);
    assert!((ledger.escaped_up - 1.0).abs() < 1e-12 && ledger.extraction().abs() < 1e-12);
}

/// A cube of glass that absorbs a little: light beyond the critical angle of all faces stays until
/// it has met as many surfaces as it may. What is left then follows from directions alone: a path
/// meets |x| + |y| + |z| faces per edge length.
#[test]
fn the_roulette_among_long_paths_is_unbiased_and_saves_most_of_the_work() {
    let (index, alpha, most) = (1.5, 1.1e-4, 10_000);
    let cube = placed::brick([0.5; 3], &placed::at([0.0, 0.0, 2.0], DMat3::IDENTITY, 0.0));
    let surface =
        Surface::new("cube", cube, Region::Body(0), Region::World, &SurfaceModel::Interface);
    let place = DVec3::new(0.11, -0.07, 2.03);
    let source = Source::new("lamp", place, Region::Body(0), Emitter::Point, Emission::Isotropic);
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype {
        media: vec![Medium::clear("glass", index).absorbing(alpha)],
        surfaces: vec![surface],
        sources: vec![source],
    });
    scene.place(id, DVec3::ZERO);
    let settings = Settings { max_bounces: most, ..Settings::new(1 << 16, 5) };
    let outcome = trace(&scene.build().unwrap(), &[], &settings);

    let critical = (1.0 - 1.0 / (index * index)).sqrt();
    let mut rng = random::stream(3, 0);
    let (mut left, count) = (0.0, 400_000);
    for _ in 0..count {
        let d = random::isotropic(&mut rng).abs();
        if d.max_element() < critical {
            left += (-alpha * f64::from(most) / d.element_sum()).exp();
        }
    }
    let expected = left / f64::from(count);
    let lost = outcome.jackknife(|totals| totals.ledger.lost_total());
    let error = lost.standard_error.hypot(1e-3 * expected);
    assert!((lost.value - expected).abs() < 4.0 * error, "{lost:?} {expected}");
    assert!(lost.standard_error < 0.02 * expected, "{lost:?}");
    // Without it every fourth path meets ten thousand.
    let met = outcome.hits as f64 / outcome.paths as f64;
    assert!((100.0..500.0).contains(&met), "{met}");
}
