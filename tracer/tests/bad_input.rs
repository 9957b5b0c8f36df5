// SPDX-License-Identifier: MIT OR Apache-2.0
//! Mistakes of users: each mistake has its own error, and the message says what was
//! expected.

use crate::common::package::{Dome, Package};
use crate::common::*;
use std::sync::Arc;
use tracer::glam::DVec3;
use tracer::shape::Element;
use tracer::{
    Emission, Emitter, Error, FarField, Medium, Meridian, Patch, PlaneMap, Prototype, Ray,
    Receiver, Region, Scene, SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, run,
};

fn smooth() -> Package {
    package(N, Dome::smooth(&CAP), 0.95, 0.86)
}

/// The error of an array of packages, which must not be valid.
fn refused(package: &Package) -> Error {
    let prototype = match package.prototype() {
        Ok(prototype) => prototype,
        Err(error) => return error,
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(prototype);
    scene.place(id, DVec3::ZERO);
    error(scene.build())
}

fn error(result: Result<Scene, Error>) -> Error {
    match result {
        Ok(_) => panic!("accepted"),
        Err(error) => error,
    }
}

fn assert_says(error: &Error, words: &str) {
    let message = error.to_string();
    assert!(message.contains(words), "'{message}' does not say '{words}'");
}

#[test]
fn numbers_out_of_range() {
    for index in [0.0, -1.4, f64::NAN, f64::INFINITY] {
        let mut bad = smooth();
        bad.silicone.index = index;
        assert_says(&refused(&bad), "refractive index of 'silicone'");
    }
    for reflectance in [-0.1, 1.1, f64::NAN] {
        let mut bad = smooth();
        bad.bottom = SurfaceModel::Mirror { reflectance };
        assert_says(&refused(&bad), "reflectance of 'bottom': expected a number from 0 to 1");
    }
    let mut bad = smooth();
    bad.silicone.absorption_per_mm = -1.0;
    assert_says(&refused(&bad), "absorption");
    assert!(Shape::sphere(0.0, -1.0).is_err());
    assert!(Shape::cylinder(1.0, f64::NAN, 1.0).is_err());
    assert!(Shape::cuboid(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)).is_err());
    assert!(Shape::sphere_zones(0.0, 1.0, &[0.5, 0.6]).is_err());
    assert!(Shape::sphere_zones(0.0, 1.0, &[0.5]).is_err());
    assert!(Shape::sphere_zones(0.0, 1.0, &[1.5, 0.5]).is_err());
}

#[test]
fn overlapping_packages() {
    let mut scene = array(&smooth(), 2, 3.3);
    let message = error(scene.build()).to_string();
    assert!(
        message.contains("instances 1 and 2 are 3.3 mm apart, they need at least 3.4"),
        "{message}"
    );
    // Touching is allowed.
    assert!(array(&smooth(), 2, 3.4).build().is_ok());
    // Among ten thousand the first pair is named: the new one comes too near to number 30 of row
    // 20.
    let mut many = array(&smooth(), 100, 4.0);
    assert!(many.build().is_ok());
    let id = many.prototype(smooth().prototype().unwrap());
    many.place(id, DVec3::new(-78.0 + 0.2, -118.0 + 3.3, 0.0));
    let message = error(many.build()).to_string();
    assert!(message.contains("instances 2031 and 10001"), "{message}");
    let id = scene.prototype(smooth().prototype().unwrap());
    scene = array(&smooth(), 2, 8.3);
    scene.place(id, DVec3::new(f64::NAN, 0.0, 0.0));
    assert_says(&error(scene.build()), "position of an instance");
}

#[test]
fn overlapping_boxes_are_judged_by_their_sides() {
    let cube = Shape::cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
    let cube = Surface::new("cube", cube, Region::Opaque, Region::World, &SurfaceModel::Absorber);
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype { surfaces: vec![cube], ..Prototype::default() });
    let sky = DVec3::new(0.0, 0.0, 9.0);
    scene.source(Source::new("sky", sky, Region::World, Emitter::Point, Emission::Isotropic));
    scene
        .place(id, DVec3::ZERO)
        .place(id, DVec3::new(1.0, 0.9, 0.0))
        .place(id, DVec3::new(0.5, 0.5, 1.0));
    assert!(scene.build().is_ok());
    scene.place(id, DVec3::new(-0.9, -0.9, 0.0));
    assert!(matches!(error(scene.build()), Error::Overlap { first: 0, second: 3, .. }));
}

#[test]
fn sources_in_the_wrong_place() {
    let base = || smooth().prototype().unwrap();
    let build = |prototype: Prototype| {
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(prototype);
        error(scene.place(id, DVec3::ZERO).build())
    };
    let mut in_box = base();
    in_box.sources[0].position.z = 0.2;
    assert_says(&build(in_box), "the first surface it sees, 'box");
    let mut below = base();
    below.sources[0].position.z = -0.2;
    assert!(matches!(build(below), Error::SourceOutside { .. }));
    let mut above = base();
    above.sources[0].position.z = 1.2;
    // Outside, looking up, it sees nothing at all.
    assert!(matches!(build(above), Error::OpenBody { .. }));
    let mut nowhere = base();
    nowhere.sources[0].region = Region::Body(1);
    assert_says(&build(nowhere), "body medium 1 does not exist");
    let mut none = base();
    none.sources.clear();
    assert!(matches!(build(none), Error::NoSource));
    let mut world = base();
    world.sources[0].region = Region::World;
    assert!(matches!(build(world), Error::SourceOutside { .. }));
}

/// Sources that look alike are judged once, which may hide none that stands elsewhere.
#[test]
fn one_wrong_source_among_many_is_found() {
    let cube = Shape::cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
    let cube = Surface::new("cube", cube, Region::Opaque, Region::World, &SurfaceModel::Absorber);
    let refused = |shift: DVec3, turned: bool| {
        let mut scene = SceneBuilder::new(Medium::air());
        let id =
            scene.prototype(Prototype { surfaces: vec![cube.clone()], ..Prototype::default() });
        for k in 0..100 {
            let corner = DVec3::new(2.0 * f64::from(k % 10), 2.0 * f64::from(k / 10), 0.0);
            scene.place(id, corner);
            let emitter = Emitter::Rectangle { half_x: 0.25, half_y: 0.25 };
            let is_wrong = k == 57;
            let middle = corner + DVec3::new(0.5, 0.5, 1.0);
            let at = if is_wrong { middle + shift } else { middle };
            let name = format!("LED {k}");
            let led = Source::new(&name, at, Region::World, emitter, Emission::LAMBERTIAN);
            let down = is_wrong && turned;
            scene.source(led.facing(if down { DVec3::NEG_Z } else { DVec3::Z }));
        }
        scene.build().err()
    };
    assert!(refused(DVec3::ZERO, false).is_none());
    assert!(refused(DVec3::new(0.2, 0.0, 0.3), true).is_none());
    for (shift, turned) in [
        (DVec3::new(0.0, 0.0, -0.5), false),
        (DVec3::new(1.7, 0.0, -0.5), false),
        (DVec3::new(0.6, 0.0, -0.5), false),
        (DVec3::ZERO, true),
    ] {
        let error = refused(shift, turned).expect("refused");
        assert_says(&error, "LED 57");
    }
}

#[test]
fn sources_in_a_surface_emit_away_from_it_or_are_refused() {
    let build = |height: f64, normal: DVec3, emission: Emission| {
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(Prototype {
            media: Vec::new(),
            surfaces: vec![Surface::new(
                "mirror",
                Shape::annulus(0.0, 0.0, 3.0).unwrap(),
                Region::Opaque,
                Region::World,
                &SurfaceModel::Absorber,
            )],
            sources: Vec::new(),
        });
        let at = DVec3::new(0.1, 0.2, height);
        let lamp = Source::new("lamp", at, Region::World, Emitter::Point, emission);
        scene.place(id, DVec3::ZERO).source(lamp.facing(normal)).build()
    };
    let (up, tilted) = (DVec3::Z, DVec3::new(0.3, 0.0, 1.0));
    for (height, normal, emission, good) in [
        (0.0, up, Emission::LAMBERTIAN, true),
        (0.0, tilted, Emission::LAMBERTIAN, false),
        (0.0, -up, Emission::LAMBERTIAN, false),
        (0.0, up, Emission::Isotropic, false),
        (1e-3, up, Emission::Isotropic, true),
        (1e-3, -up, Emission::LAMBERTIAN, true),
    ] {
        let built = build(height, normal, emission);
        let in_surface = matches!(built, Err(Error::SourceInSurface { .. }));
        assert_eq!((built.is_ok(), in_surface), (good, !good), "{height} {normal}");
    }
    assert_says(
        &error(build(0.0, up, Emission::Isotropic)),
        "lies in the surface of 'mirror' and emits into it",
    );
}

#[test]
fn open_bodies_and_opaque_interfaces() {
    let source = || inside(DVec3::new(0.0, 0.0, 0.5), Emitter::Point, Emission::Isotropic);
    let dome = Shape::sphere_zones(0.0, 2.0, &[2.0, 0.0]).unwrap();
    let open = Surface::new("dome", dome.clone(), BODY, Region::World, &SurfaceModel::Interface);
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(lamp(N, vec![open], source()));
    assert!(matches!(error(scene.place(id, DVec3::ZERO).build()), Error::OpenBody { .. }));

    let opaque = Surface::new("dome", dome.clone(), BODY, Region::Opaque, &SurfaceModel::Interface);
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(lamp(N, vec![opaque], source()));
    assert_says(
        &error(scene.place(id, DVec3::ZERO).build()),
        "'interface' needs a medium on both sides",
    );

    let parts =
        vec![Patch::new("a", SurfaceModel::Absorber), Patch::new("b", SurfaceModel::Absorber)];
    let mut scene = SceneBuilder::new(Medium::air());
    let id =
        scene.prototype(lamp(N, vec![Surface::zoned(dome, BODY, Region::World, parts)], source()));
    assert_says(
        &error(scene.place(id, DVec3::ZERO).build()),
        "its shape has 1 parts, got optics for 2",
    );
}

#[test]
fn tables_for_another_index() {
    let other = SurfaceModel::Scatter(Arc::new(NoFresnel { inner: 1.5, outer: 1.0 }));
    let bad = package(N, Dome::Zones(vec![(CAP.rim, Patch::new("band 1", other))]), 0.95, 0.86);
    assert_says(
        &refused(&bad),
        "surface 'band 1': the scattering table is for index 1.5 on the inner side",
    );
}

#[test]
fn bodies_below_the_ground() {
    let mut scene = array(&smooth(), 1, 8.3);
    let id = scene.prototype(smooth().prototype().unwrap());
    scene.place(id, DVec3::new(20.0, 0.0, -0.1));
    assert!(matches!(error(scene.build()), Error::BelowGround { instance: 1, .. }));
}

#[test]
fn broken_meridians() {
    let line = |points: &[[f64; 2]]| Element { points: points.to_vec() };
    assert!(Meridian::new(&[]).is_err());
    assert!(Meridian::new(&[line(&[[0.0, 1.0]])]).is_err());
    let gap = Meridian::new(&[line(&[[0.0, 1.0], [1.0, 1.0]]), line(&[[1.1, 1.0], [1.7, 0.0]])]);
    assert_says(&gap.unwrap_err(), "element 1 begins at r = 1.1");
}

/// A receiver of 2³² bins.
struct Countless;

impl Receiver for Countless {
    fn bins(&self) -> usize {
        1 << 32
    }

    fn bin(&self, _ray: &Ray, _length: f64) -> Option<usize> {
        None
    }
}

#[test]
fn receivers_and_settings() {
    let scene = array(&smooth(), 2, 8.3).build().unwrap();
    let low = PlaneMap::centred(0.9, 0.1, 10, 10).unwrap();
    assert!(matches!(
        run(&scene, &[&low], &Settings::new(100, 1)),
        Err(Error::ReceiverTooLow { .. })
    ));
    assert_says(
        &run(&scene, &[&Countless], &Settings::new(100, 1)).unwrap_err(),
        "bins of a receiver: expected at most 4294967295, got 4294967296",
    );
    assert!(PlaneMap::centred(3.0, 0.0, 10, 10).is_err());
    assert!(PlaneMap::centred(3.0, 0.1, 0, 10).is_err());
    assert_says(&FarField::new(0.7, 5.0).unwrap_err(), "divides 180 degrees");
    for settings in [
        Settings { paths: 0, ..Settings::new(1, 1) },
        Settings { groups: 1, ..Settings::new(100, 1) },
        Settings { max_bounces: 0, ..Settings::new(100, 1) },
        Settings { roulette_below: f64::NAN, ..Settings::new(100, 1) },
    ] {
        assert!(run(&scene, &[], &settings).is_err(), "{settings:?}");
    }
    let mut scene = array(&smooth(), 2, 8.3);
    assert!(scene.power(0.0).build().is_err());
}
