// SPDX-License-Identifier: MIT OR Apache-2.0
//! Emitters in flat faces and across them: what sends any light into a surface that it lies in, or
//! starts any behind one, is refused, however little that is.
//!
//! Source: geometry.

use crate::common::placed::{at, brick, turned};
use tracer::glam::{DMat3, DVec3};
use tracer::{
    Emission, Emitter, Error, Medium, Prototype, Region, SceneBuilder, Shape, Source, Surface,
    SurfaceModel,
};

const FACE: Emitter = Emitter::Rectangle { half_x: 0.25, half_y: 0.25 };

fn opaque(name: &str, shape: Shape) -> Surface {
    Surface::new(name, shape, Region::Opaque, Region::World, &SurfaceModel::Absorber)
}

/// True if a source of the world is accepted beside surfaces, of the world or of a package.
fn accepted(surfaces: &[Surface], source: &Source) -> bool {
    let mut results = Vec::new();
    for of_package in [false, true] {
        let mut scene = SceneBuilder::new(Medium::air());
        if of_package {
            let id =
                scene.prototype(Prototype { surfaces: surfaces.to_vec(), ..Prototype::default() });
            scene.place(id, DVec3::ZERO);
        } else {
            for surface in surfaces {
                scene.surface(surface.clone());
            }
        }
        scene.source(source.clone());
        results.push(match scene.build() {
            Ok(_) => true,
            Err(Error::SourceInSurface { .. } | Error::SourceOutside { .. }) => false,
            Err(other) => panic!("{other}"),
        });
    }
    assert_eq!(results[0], results[1]);
    results[0]
}

fn lamp(position: DVec3, emitter: Emitter, emission: Emission, normal: DVec3) -> Source {
    Source::new("lamp", position, Region::World, emitter, emission).facing(normal)
}

fn mirrors() -> [Surface; 3] {
    [
        opaque("ground", Shape::ground(0.0, 3.0, 3.0).unwrap()),
        opaque("disc", Shape::annulus(0.0, 0.0, 3.0).unwrap()),
        opaque(
            "box",
            Shape::cuboid(DVec3::new(-2.0, -2.0, -1.0), DVec3::new(2.0, 2.0, 0.0)).unwrap(),
        ),
    ]
}

#[test]
fn in_a_mirror_every_tilt_is_refused() {
    let emitters = [FACE, Emitter::Disc { radius: 0.25 }, Emitter::Point];
    for mirror in mirrors() {
        for emitter in emitters {
            for degrees in [0.0, 0.01, 0.1, 1.0, 30.0] {
                for azimuth in [0.0, 0.7, 2.0] {
                    let (sin, cos) = f64::to_radians(degrees).sin_cos();
                    let (sin_phi, cos_phi) = f64::sin_cos(azimuth);
                    let normal = DVec3::new(sin * cos_phi, sin * sin_phi, cos);
                    for emission in [
                        Emission::LAMBERTIAN,
                        // Almost all of it straight ahead.
                        Emission::CosinePower { exponent: 1000.0 },
                    ] {
                        let place = DVec3::new(0.3, -0.2, 0.0);
                        let source = lamp(place, emitter, emission, normal);
                        let good = accepted(std::slice::from_ref(&mirror), &source);
                        assert_eq!(good, degrees == 0.0, "{degrees} {azimuth} {emitter:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn what_reaches_below_a_mirror_is_refused_by_any_depth() {
    let emissions = [
        Emission::LAMBERTIAN,
        Emission::Lambertian { half_angle_deg: 10.0 },
        Emission::CosinePower { exponent: 50.0 },
        Emission::Isotropic,
    ];
    for mirror in mirrors() {
        for emission in &emissions {
            for emitter in [FACE, Emitter::Disc { radius: 0.25 }] {
                for (below, good) in [(0.0, true), (1e-6, false), (1e-4, false), (0.1, false)] {
                    let place = DVec3::new(0.3, -0.2, 0.25 - below);
                    let source = lamp(place, emitter, emission.clone(), DVec3::X);
                    let found = accepted(std::slice::from_ref(&mirror), &source);
                    assert_eq!(found, good, "{below} {emission:?} {emitter:?}");
                }
            }
        }
        // Beside the mirror there is nothing to reach below.
        let beside = lamp(DVec3::X * 3.5, FACE, Emission::LAMBERTIAN, DVec3::X);
        let endless = mirror.name() == "ground";
        assert_eq!(accepted(&[mirror], &beside), !endless);
    }
}

#[test]
fn what_shares_a_corner_with_a_face_that_it_lies_in_faces_away_from_it() {
    let half = DVec3::new(0.5, 0.5, 0.5);
    for rotation in [DMat3::IDENTITY, turned()] {
        let block = opaque("block", brick(half.to_array(), &at([0.0; 3], rotation, 0.0)));
        let up = rotation.z_axis;
        // The axes of the emitter are its own: a disc has none.
        let emitter = Emitter::Disc { radius: 0.25 };
        let place = |off: f64| rotation * DVec3::new(0.5 + off, 0.0, 0.5);
        for (off, towards, good) in
            [(0.0, up, true), (0.249, up, true), (0.249, -up, false), (0.26, -up, true)]
        {
            let source = lamp(place(off), emitter, Emission::LAMBERTIAN, towards);
            let found = accepted(std::slice::from_ref(&block), &source);
            assert_eq!(found, good, "{off} {towards}");
        }
        // A beam, away from the face and into it.
        for (tilt, good) in [(1e-3, true), (-1e-3, false)] {
            let direction = rotation.x_axis + up * tilt;
            let source = lamp(place(-0.3), emitter, Emission::Beam { direction }, up);
            assert_eq!(accepted(std::slice::from_ref(&block), &source), good, "{tilt}");
        }
    }
}

#[test]
fn a_pin_through_an_emitter_is_refused_and_one_that_ends_in_its_plane_is_not() {
    let wide = Emitter::Rectangle { half_x: 2.0, half_y: 2.0 };
    for (top, good) in [(0.9, true), (1.0, true), (1.1, false)] {
        let low = DVec3::new(0.31, 0.42, 0.0);
        let high = DVec3::new(0.32, 0.43, top);
        let pin = opaque("pin", Shape::cuboid(low, high).unwrap());
        let source = lamp(DVec3::Z, wide, Emission::LAMBERTIAN, DVec3::Z);
        assert_eq!(accepted(std::slice::from_ref(&pin), &source), good, "{top}");
        // Towards the pin, its end covers what lies on it.
        let source = lamp(DVec3::Z, wide, Emission::LAMBERTIAN, -DVec3::Z);
        assert_eq!(accepted(&[pin], &source), top < 1.0, "{top}, down");
    }
}
