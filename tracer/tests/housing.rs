// SPDX-License-Identifier: MIT OR Apache-2.0
//! Walls around an array: what mirrors conserve, view factors of black walls, and radiosity between
//! grey ones.

use std::f64::consts::PI;

use crate::common::package::Dome;
use crate::common::*;
use tracer::glam::DVec3;
use tracer::housing::Housing;
use tracer::{
    Emission, Emitter, Error, FarField, Medium, Region, SceneBuilder, Settings, Source,
    SurfaceModel,
};

/// A housing with the same optics all over its inside.
fn housing(half: [f64; 2], height: f64, walls: &SurfaceModel, floor: &SurfaceModel) -> Housing {
    Housing {
        half,
        height,
        thickness: 0.5,
        walls: walls.clone(),
        floor: floor.clone(),
        mirror: None,
    }
}

fn well(housing: &Housing, source: DVec3, emission: Emission) -> SceneBuilder {
    let mut scene = SceneBuilder::new(Medium::air());
    for surface in housing.surfaces().unwrap() {
        scene.surface(surface);
    }
    scene.source(Source::new("LED", source, Region::World, Emitter::Point, emission));
    scene
}

#[test]
fn upright_mirrors_let_everything_out_and_keep_polar_angles() {
    let perfect = SurfaceModel::Mirror { reflectance: 1.0 };
    let off_axis = DVec3::new(0.7, -1.1, 0.4);
    let scene = well(&housing([2.0, 1.5], 3.0, &perfect, &perfect), off_axis, Emission::Isotropic);
    let far = FarField::new(10.0, 90.0).unwrap();
    // Level light takes as many mirrors as it likes.
    let settings = Settings { max_bounces: u32::MAX, ..Settings::new(many() / 20, 3) };
    let outcome = trace(&scene.build().unwrap(), &[&far], &settings);
    assert!((outcome.total.ledger.escaped_up - 1.0).abs() < 1e-12);

    // Mirrors turn azimuths and the sign of z alone: a point leaves with twice the power in every
    // upward zone.
    let bins = outcome.bins(0);
    for theta in 0..9 {
        let zone: f64 = (0..4).map(|phi| bins[theta * 4 + phi].value).sum();
        let edge = |k: usize| (k as f64 * 10.0).to_radians().cos();
        let expected = edge(theta) - edge(theta + 1);
        assert_share("zone", zone, expected, outcome.paths, 0.0);
    }
}

/// Share of a level Lambertian element's light that a level rectangle catches, whose corner stands
/// at height `h` above it and whose sides are `a` and `b`.
fn corner(a: f64, b: f64, h: f64) -> f64 {
    let (a, b) = (a / h, b / h);
    let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * PI)
}

#[test]
fn between_black_walls_a_view_factor_leaves() {
    let black = SurfaceModel::Absorber;
    let [x, y] = [3.0, 2.0];
    let (source, height) = (DVec3::new(1.0, -0.5, 0.25), 4.0);
    let scene = well(&housing([x, y], height, &black, &black), source, Emission::LAMBERTIAN);
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many() / 10, 4));
    let h = height - source.z;
    let sides = [x - source.x, x + source.x];
    let expected: f64 =
        sides.iter().flat_map(|a| [y - source.y, y + source.y].map(|b| corner(*a, b, h))).sum();
    let ledger = &outcome.total.ledger;
    assert_share("escaped", ledger.escaped_up, expected, outcome.paths, 0.0);
    let walls = ledger.surface("wall").unwrap().absorbed;
    assert_share("absorbed", walls, 1.0 - expected, outcome.paths, 0.0);
}

/// Share that leaves a trench without end, of width 1 and this depth, black at the bottom, with
/// Lambertian walls of this reflectance, from a Lambertian point in the middle of the bottom:
/// radiosity by Simpson's rule, integrated along the trench, where the light of a point is that of
/// a line.
fn trench(depth: f64, reflectance: f64) -> f64 {
    const NODES: usize = 401;
    let step = depth / (NODES - 1) as f64;
    let z = |i: usize| i as f64 * step;
    let weight = |i: usize| match i {
        0 => step / 3.0,
        i if i == NODES - 1 => step / 3.0,
        i if i % 2 == 1 => 4.0 * step / 3.0,
        _ => 2.0 * step / 3.0,
    };
    // The line's light on a wall at height z: with sin φ the sine of its angle to the vertical, dF
    // = ½ d(sin φ).
    let first = |i: usize| 0.5 * 0.5 * z(i) / (0.25 + z(i) * z(i)).powf(1.5);
    // From wall to wall.
    let kernel = |i: usize, k: usize| 0.5 / (1.0 + (z(i) - z(k)).powi(2)).powf(1.5);
    // From a place on a wall through the opening: half of 1 less the sine of the angle between the
    // wall's normal and the edge opposite.
    let out = |i: usize| {
        let up = depth - z(i);
        0.5 * (1.0 - up / up.hypot(1.0))
    };
    let mut arrives: Vec<f64> = (0..NODES).map(first).collect();
    for _ in 0..60 {
        arrives = (0..NODES)
            .map(|i| {
                let from: f64 = (0..NODES).map(|k| weight(k) * kernel(i, k) * arrives[k]).sum();
                first(i) + reflectance * from
            })
            .collect();
    }
    // The direct light, and that of both walls.
    let direct = 0.5 / (0.25 + depth * depth).sqrt();
    direct + 2.0 * (0..NODES).map(|i| weight(i) * reflectance * arrives[i] * out(i)).sum::<f64>()
}

#[test]
fn grey_walls_send_out_what_radiosity_says() {
    let (depth, reflectance) = (0.8, 0.7);
    let grey = SurfaceModel::Lambertian { reflectance };
    // Two thousand widths long: what its ends catch is a millionth.
    let long = housing([0.5, 1000.0], depth, &grey, &SurfaceModel::Absorber);
    let scene = well(&long, DVec3::new(0.0, 0.0, 1e-9), Emission::LAMBERTIAN);
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many() / 10, 5));
    let expected = trench(depth, reflectance);
    assert_share("escaped", outcome.total.ledger.escaped_up, expected, outcome.paths, 1e-5);
}

#[test]
fn a_mirror_ends_where_the_floor_begins() {
    let mut housing = housing([4.0, 3.0], 1.0, &SurfaceModel::Absorber, &SurfaceModel::Absorber);
    housing.mirror = Some(([2.0, 1.0], SurfaceModel::Absorber));
    // A lamp that shines straight down on points all over the bottom.
    let mut scene = SceneBuilder::new(Medium::air());
    for surface in housing.surfaces().unwrap() {
        scene.surface(surface);
    }
    let emitter = Emitter::Rectangle { half_x: 5.0, half_y: 4.0 };
    let down = Emission::Beam { direction: -DVec3::Z };
    scene.source(Source::new("lamp", DVec3::Z * 9.0, Region::World, emitter, down));
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many() / 20, 6));
    let (ledger, whole) = (&outcome.total.ledger, 10.0 * 8.0);
    let rim = 9.0 * 7.0 - 8.0 * 6.0;
    for (name, area) in [
        ("ground mirror", 4.0 * 2.0),
        ("housing floor", 8.0 * 6.0 - 4.0 * 2.0),
        ("wall", rim),
        ("floor", whole - 9.0 * 7.0),
    ] {
        let absorbed = ledger.surface(name).unwrap().absorbed;
        assert_share(name, absorbed, area / whole, outcome.paths, 0.0);
    }

    // Walls inside of the mirror cut it, and there is no floor.
    housing.half = [1.0, 0.5];
    let names: Vec<String> =
        housing.surfaces().unwrap().iter().map(|s| s.name().to_owned()).collect();
    assert_eq!(names[0], "ground mirror");
    assert!(!names.contains(&"housing floor".to_owned()));
}

#[test]
fn what_stands_in_a_wall_is_refused() {
    let package = package(N, Dome::smooth(&CAP), 0.95, 0.86);
    let grey = SurfaceModel::Lambertian { reflectance: 0.5 };
    let built = |half: f64| {
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(package.prototype().unwrap());
        place_array(&mut scene, id, [2, 1], 4.0);
        for surface in housing([half, 3.0], 2.0, &grey, &grey).surfaces().unwrap() {
            scene.surface(surface);
        }
        scene.build().map(|_| ())
    };
    // Axes at ±2 mm, domes 1.7 mm in radius.
    assert_eq!(built(3.71), Ok(()));
    let error = built(3.6).unwrap_err();
    assert!(matches!(error, Error::IntoWall { .. }), "{error}");
    assert!(error.to_string().contains("'wall'"), "{error}");
    let thin = Housing { thickness: 0.0, ..housing([1.0, 1.0], 1.0, &grey, &grey) };
    assert!(thin.surfaces().is_err());
}
