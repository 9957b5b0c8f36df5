// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rectangles in the plane of a face or of something that emits are refused; those beside it, and
//! those at a face that is drawn in, count what they should.

use std::f64::consts::FRAC_PI_2;

use crate::common::placed::{at, brick, disc};
use crate::common::*;
use tracer::glam::{DMat3, DVec3};
use tracer::receiver::{DetectorRectangle, Facing, Sense};
use tracer::shape::{Closing, Extent, Plane};
use tracer::{
    Detector, Emission, Emitter, Error, Measurement, Medium, Prototype, Receiver, Region, Scene,
    SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, run,
};

const UP: Facing = Facing::Z(Sense::Plus);

/// A point 3 mm above a black floor, and one solid or sheet about (0, 0, 5).
fn scene(shape: Shape, inner: Region, optics: &SurfaceModel) -> Scene {
    let mut scene = SceneBuilder::new(Medium::air());
    let body = scene.prototype(Prototype {
        surfaces: vec![Surface::new("thing", shape, inner, Region::World, optics)],
        ..Prototype::default()
    });
    scene.array_solids(body);
    scene.surface(Surface::new(
        "floor",
        Shape::horizontal(0.0).unwrap(),
        Region::Opaque,
        Region::World,
        &SurfaceModel::Absorber,
    ));
    scene.source(Source::new(
        "point",
        DVec3::Z * 3.0,
        Region::World,
        Emitter::Point,
        Emission::Isotropic,
    ));
    scene.build().unwrap()
}

fn detector(facing: Facing, centre: [f64; 3], size: [f64; 2]) -> Detector {
    let rectangle =
        DetectorRectangle::new(facing, DVec3::from_array(centre), size, [1, 1]).unwrap();
    Detector::new("q", Measurement::Plane(rectangle))
}

/// A rectangle of 4 × 4 mm as a sheet, upright across x for a turn of a quarter about y.
fn sheet(turn: f64) -> Shape {
    let extent = Extent::Rectangle { half_u: 2.0, half_v: 2.0 };
    let plane = Plane::new(DVec3::ZERO, DVec3::Z, extent).unwrap();
    let placement = at([0.0, 0.0, 5.0], DMat3::from_rotation_y(turn), 1e-8);
    Shape::placed(vec![Shape::Plane(plane)], Closing::Open, &placement).unwrap()
}

#[test]
fn rectangles_in_a_sheet_are_refused() {
    for optics in [
        SurfaceModel::Absorber,
        SurfaceModel::Mirror { reflectance: 1.0 },
        SurfaceModel::Lambertian { reflectance: 0.5 },
    ] {
        let level = scene(sheet(0.0), Region::World, &optics);
        let upright = scene(sheet(FRAC_PI_2), Region::World, &optics);
        let round = disc(1.0, &at([0.0, 0.0, 5.0], DMat3::IDENTITY, 1e-8));
        let round = scene(round, Region::World, &optics);
        for (scene, facing, offset) in [
            (&level, UP, [0.0, 0.0]),
            (&level, Facing::Z(Sense::Minus), [2.9, 0.0]),
            (&upright, Facing::X(Sense::Plus), [0.0, 0.0]),
            (&upright, Facing::X(Sense::Minus), [1.0, 2.9]),
            (&round, UP, [1.4, 1.4]),
        ] {
            let centre = |off: f64| match facing {
                Facing::Z(_) => [offset[0], offset[1], 5.0 + off],
                _ => [off, offset[0], 5.0 + offset[1]],
            };
            for off in [0.0, 1e-15, -1e-12] {
                let refused = detector(facing, centre(off), [2.0, 2.0]).check(scene);
                let error = refused.expect_err("in the sheet");
                assert!(
                    matches!(&error, Error::ReceiverInFace { surface, .. } if surface == "thing"),
                    "{error}"
                );
            }
            for off in [1e-6, -1e-6] {
                let beside = detector(facing, centre(off), [2.0, 2.0]).check(scene);
                assert_eq!(beside, Ok(()), "{facing:?} {off}");
            }
        }
        // In its plane, but edge to edge, and at a corner of the box around the disc.
        let edge = detector(UP, [3.0, 0.0, 5.0], [2.0, 2.0]);
        assert_eq!(edge.check(&level), Ok(()));
        let corner = detector(UP, [1.8, 1.8, 5.0], [2.0, 2.0]);
        assert_eq!(corner.check(&round), Ok(()));
    }
}

#[test]
fn rectangles_in_other_faces_are_refused() {
    let cuboid = Shape::cuboid(DVec3::new(-1.0, -1.0, 4.0), DVec3::new(1.0, 1.0, 6.0)).unwrap();
    let walled = scene(cuboid, Region::Opaque, &SurfaceModel::Absorber);
    for (facing, centre) in [
        (UP, [0.5, 0.0, 6.0]),
        (UP, [0.5, 0.0, 4.0]),
        (Facing::X(Sense::Plus), [1.0, 0.0, 5.5]),
        (Facing::Y(Sense::Minus), [0.0, -1.0, 5.5]),
    ] {
        let error = detector(facing, centre, [1.0, 1.0]).check(&walled);
        assert!(matches!(error, Err(Error::ReceiverInFace { .. })), "{centre:?} {error:?}");
    }
    // The floor.
    let error = detector(UP, [0.0, 0.0, 1e-13], [1.0, 1.0]).check(&walled);
    assert!(
        matches!(&error, Err(Error::ReceiverInFace { surface, .. }) if surface == "floor"),
        "{error:?}"
    );
    let (corners, triangles) = cap_triangles(8, 12);
    let mesh = tracer::shape::Mesh::new(&corners, &triangles, &vec![0; triangles.len()]).unwrap();
    let top = corners.iter().map(|c| c.z).fold(f64::INFINITY, f64::min);
    let placement = at([0.0, 0.0, 5.0 - top], DMat3::IDENTITY, 0.0);
    let shape = Shape::placed(vec![Shape::mesh(mesh)], Closing::Closed, &placement).unwrap();
    let meshed = scene(shape, Region::Opaque, &SurfaceModel::Absorber);
    let error = detector(UP, [0.1, 0.0, 5.0], [0.2, 0.2]).check(&meshed);
    assert!(matches!(error, Err(Error::ReceiverInFace { .. })), "{error:?}");
}

#[test]
fn rectangles_in_what_emits_are_refused() {
    let emitting = |emitter: Emitter, normal: DVec3| {
        let mut scene = SceneBuilder::new(Medium::air());
        let source = Source::new(
            "lamp",
            DVec3::new(0.3, 0.0, 5.0),
            Region::World,
            emitter,
            Emission::LAMBERTIAN,
        );
        scene.source(source.facing(normal));
        scene.build().unwrap()
    };
    let chip = Emitter::Rectangle { half_x: 0.5, half_y: 0.5 };
    for (emitter, normal, facing) in [
        (chip, DVec3::Z, UP),
        (chip, DVec3::X, Facing::X(Sense::Plus)),
        (Emitter::Disc { radius: 0.5 }, DVec3::Z, UP),
        (Emitter::Point, DVec3::Z, UP),
    ] {
        let scene = emitting(emitter, normal);
        let error = detector(facing, [0.3, 0.0, 5.0], [4.0, 4.0]).check(&scene);
        assert!(
            matches!(&error, Err(Error::ReceiverInSource { source_name, .. }) if source_name == "lamp"),
            "{error:?}"
        );
        let place = 5.0 + f64::from(u8::from(facing == UP)) * 1e-6;
        let beside = detector(facing, [0.3 + 1e-6, 0.0, place], [4.0, 4.0]);
        assert_eq!(beside.check(&scene), Ok(()));
        // It lies in the plane, but elsewhere.
        let elsewhere = detector(facing, [0.3, 3.0, 5.0], [1.0, 1.0]).check(&scene);
        assert_eq!(elsewhere, Ok(()), "{emitter:?}");
    }
}

#[test]
fn a_rectangle_at_a_face_that_is_drawn_in_counts_what_comes_and_what_leaves() {
    // The lower face of a perfect mirror, 2 mm above the point: what comes up to it goes down
    // again.
    let mirror = SurfaceModel::Mirror { reflectance: 1.0 };
    let place = at([0.0, 0.0, 5.5], DMat3::IDENTITY, 1e-8);
    let scene = scene(brick([0.5, 0.5, 0.5], &place), Region::Opaque, &mirror);
    let both = [Sense::Plus, Sense::Minus]
        .map(|sense| detector(Facing::Z(sense), [0.0, 0.0, 5.0], [0.5, 0.5]));
    let settings = Settings::new(many(), 3);
    let seen = run(&scene, &receivers(&both), &settings).unwrap();
    let [up, down] = [0, 1].map(|reading| seen.bins(reading)[0]);
    // Share of the sphere that a square of half side a at the distance d covers.
    let (a, d) = (0.25f64, 2.0f64);
    let expected = (a * a / (d * (d * d + 2.0 * a * a).sqrt())).atan() / std::f64::consts::PI;
    assert!(up.deviations_from(expected) < 5.0, "{up:?} {expected}");
    assert!((up.value - down.value).abs() < 1e-12, "{up:?} {down:?}");
}
