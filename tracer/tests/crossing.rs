// SPDX-License-Identifier: MIT OR Apache-2.0
//! Solids of one package that cut each other are refused, with both names and a place; those that
//! touch are not. Sets of rays are judged ray by ray.

use std::sync::Arc;

use crate::common::package::Dome;
use crate::common::*;
use tracer::RayRecord;
use tracer::glam::DVec3;
use tracer::{
    Emission, Emitter, Error, Medium, Prototype, RaySet, Region, Scene, SceneBuilder, Shape,
    Source, Surface, SurfaceModel,
};

fn build(prototype: Prototype) -> Result<Scene, Error> {
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(prototype);
    scene.place(id, DVec3::ZERO).build()
}

/// A box of an LED in a body.
fn chip(low: DVec3, high: DVec3) -> Surface {
    let shape = Shape::cuboid(low, high).unwrap();
    Surface::new("chip", shape, Region::Opaque, BODY, &SurfaceModel::Absorber)
}

fn assert_crossing(result: Result<Scene, Error>, names: [&str; 2], within: impl Fn(DVec3) -> bool) {
    let Err(error) = result else { panic!("accepted: {names:?}") };
    let Error::Crossing { first, second, at_mm, .. } = &error else { panic!("{error}") };
    let mut found = [first.as_str(), second.as_str()];
    found.sort_unstable();
    assert_eq!(found, names, "{error}");
    assert!(within(DVec3::from_array(*at_mm)), "{error}");
}

#[test]
fn a_box_through_a_dome_is_refused() {
    // The cap has a radius of 1.732 at z = 0 and is 1 high.
    let with = |mut prototype: Prototype, low: DVec3, high: DVec3| {
        prototype.sources[0].emitter = Emitter::Point;
        prototype.sources[0].position = DVec3::new(-0.9, -0.6, 0.2);
        prototype.surfaces.push(chip(low, high));
        build(prototype)
    };
    for prototype in [meshed_cap(2000, Emission::Isotropic), mirrored_cap(Emission::Isotropic)] {
        let with = |low, high| with(prototype.clone(), low, high);
        let low = DVec3::new(-0.5, -0.5, -2e-9);
        assert!(with(low, DVec3::new(0.5, 0.5, 0.35)).is_ok());
        // Through the top, through the side, and by a corner of a few hundredths of a millimetre.
        let out = |at: DVec3| at.z > 0.0 && at.length() < 3.0;
        assert_crossing(with(low, DVec3::new(0.5, 0.5, 1.3)), ["chip", "dome"], out);
        assert_crossing(with(low, DVec3::new(2.2, 0.5, 0.35)), ["chip", "dome"], out);
        let corner = DVec3::new(0.86, 0.86, 0.64);
        assert_crossing(with(low, corner), ["chip", "dome"], |at| at.distance(corner) < 0.2);
    }
}

#[test]
fn solids_within_a_dome_may_touch_but_not_cut() {
    let glass = Region::Body(1);
    let with = |solids: Vec<(&str, Shape)>| {
        let mut prototype = package(N, Dome::smooth(&CAP), 0.95, 0.86).prototype().unwrap();
        prototype.media.push(Medium::clear("glass", 1.6));
        for (name, shape) in solids {
            let solid = Surface::new(name, shape, glass, BODY, &SurfaceModel::Interface);
            prototype.surfaces.push(solid);
        }
        build(prototype)
    };
    let cube = |x: f64, z: f64, half: f64| {
        let at = DVec3::new(x, 0.0, z);
        Shape::cuboid(at - half, at + half).unwrap()
    };
    let ball = |z: f64, radius: f64| Shape::sphere(z, radius).unwrap();
    assert!(with(vec![("ball", ball(0.65, 0.2))]).is_ok());
    assert!(with(vec![("cube", cube(0.9, 0.3, 0.1)), ("ball", ball(0.65, 0.2))]).is_ok());
    // On the mirror and against the side of the box, face on face.
    assert!(with(vec![("cube", cube(0.6, 0.1, 0.1))]).is_ok());
    assert_crossing(with(vec![("ball", ball(0.8, 0.3))]), ["ball", "dome"], |at| at.z > 0.9);
    assert_crossing(with(vec![("ball", ball(0.45, 0.2))]), ["ball", "box top"], |at| {
        at.z <= 0.36 && at.truncate().length() < 0.2
    });
    // Two kinds of glass that share a sliver of a twentieth of a millimetre.
    let sliver = vec![("ball", ball(0.65, 0.2)), ("cube", cube(0.24, 0.65, 0.05))];
    let other = |mut prototype: Prototype| {
        prototype.media.push(Medium::clear("other", 1.7));
        prototype
    };
    let mut prototype = other(package(N, Dome::smooth(&CAP), 0.95, 0.86).prototype().unwrap());
    prototype.media.push(Medium::clear("glass", 1.6));
    for ((name, shape), region) in sliver.into_iter().zip([Region::Body(1), Region::Body(2)]) {
        prototype.surfaces.push(Surface::new(name, shape, region, BODY, &SurfaceModel::Interface));
    }
    assert_crossing(build(prototype), ["ball", "cube"], |at| {
        at.x > 0.15 && at.x < 0.22 && (at.z - 0.65).abs() < 0.06
    });
}

fn ray(position: [f32; 3], direction: [f32; 3], flux: f32) -> RayRecord {
    RayRecord { position, direction, flux, wavelength: f32::NAN }
}

/// A package whose LED emits these rays, positions from the middle of the bottom.
fn lit(records: Vec<RayRecord>) -> Result<Scene, Error> {
    let mut prototype = package(N, Dome::relief(staircase(17)), 0.95, 0.86).prototype().unwrap();
    let rays = Arc::new(RaySet::new(records).unwrap());
    prototype.sources =
        vec![Source::new("LED", DVec3::ZERO, BODY, Emitter::Point, Emission::Rays(rays))];
    build(prototype)
}

#[test]
fn every_ray_of_a_set_is_judged_by_its_start() {
    let up = [0.0, 0.0, 1.0];
    let good = || {
        let place = |k: u32| [0.4 * (k as f32 * 0.1).cos(), 0.4 * (k as f32 * 0.1).sin(), 0.36];
        (0..5000).map(move |k| ray(place(k), up, 1.0))
    };
    assert!(lit(good().collect()).is_ok());
    // One in five thousand: above the dome going up and down, in the box, under the mirror, beside
    // the package. A ray without flux is none, but counts.
    for (position, direction, sees) in [
        ([0.0, 0.0, 1.4], up, "no surface is seen"),
        ([0.0, 0.0, 1.4], [0.0, 0.0, -1.0], "is seen first, facing it with air"),
        ([0.1, 0.1, 0.1], up, "'box top' is seen first, facing it with something opaque"),
        ([1.0, 0.0, -0.1], up, "'bottom' is seen first, facing it with something opaque"),
        ([2.5, 0.0, 0.1], up, "no surface is seen"),
    ] {
        let mut records: Vec<RayRecord> = good().collect();
        records[100].flux = 0.0;
        records[3210] = ray(position, direction, 1e-6);
        let Err(error) = lit(records) else { panic!("{position:?} was accepted") };
        let text = error.to_string();
        let begins = "source 'LED': ray 3211 starts at [";
        assert!(text.starts_with(begins) && text.contains(sees), "{text}");
        assert!(text.contains("expected a start in silicone, got"), "{text}");
    }
}

/// Rays of the world: each instance of many emits them, and each is judged where another body or a
/// wall may be in the way.
#[test]
fn rays_in_the_air_are_judged_beside_every_body() {
    let scene = |reach: f32, count: usize| {
        let cube = Shape::cuboid(DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, 0.5, 0.4)).unwrap();
        let records = [[0.0, 0.0, 0.41], [reach, 0.0, 0.2]];
        let rays = records.map(|at| ray(at, [0.6, 0.0, 0.8], 1.0));
        let rays = Arc::new(RaySet::new(rays).unwrap());
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(Prototype {
            media: Vec::new(),
            surfaces: vec![Surface::new(
                "box",
                cube,
                Region::Opaque,
                Region::World,
                &SurfaceModel::Absorber,
            )],
            sources: vec![Source::new(
                "LED",
                DVec3::ZERO,
                Region::World,
                Emitter::Point,
                Emission::Rays(rays),
            )],
        });
        place_array(&mut scene, id, [count, 1], 2.0);
        scene.build().map(|_| ())
    };
    assert_eq!(scene(0.7, 400), Ok(()));
    assert_eq!(scene(2.0, 1), Ok(()));
    // The second ray starts in the box beside it.
    let error = scene(2.0, 400).unwrap_err();
    assert!(matches!(&error, Error::RayOutside { ray: 2, .. }), "{error}");
}
