// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films and polarisation in whole scenes: what rays carry through piles of plates, and what
//! films let pass.

use crate::common::package::Dome;
use crate::common::*;
use num_complex::Complex64;
use std::sync::Arc;
use tracer::glam::DVec3;
use tracer::optics::thin_film::End;
use tracer::{
    Emission, Emitter, Error, Film, Layer, LayeredMirror, Medium, Outcome, Polarisation, Prototype,
    Region, Scene, SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel,
};

/// Level planes from above, with the index below each; a beam comes down on them at this angle.
fn pile(surfaces: &[(f64, SurfaceModel)], theta: f64) -> Scene {
    let count = surfaces.len();
    let region = |k: usize| {
        if k == 0 || k == count { Region::World } else { Region::Body(k as u8 - 1) }
    };
    let planes = surfaces.iter().enumerate().map(|(k, (_, optics))| {
        let shape = Shape::horizontal(-(k as f64)).unwrap();
        Surface::new(&format!("plane {k}"), shape, region(k + 1), region(k), optics)
    });
    let media = surfaces[..count - 1].iter().enumerate();
    let prototype = Prototype {
        media: media.map(|(k, (index, _))| Medium::clear(format!("medium {k}"), *index)).collect(),
        surfaces: planes.collect(),
        sources: Vec::new(),
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(prototype);
    scene.place(id, DVec3::ZERO);
    let direction = DVec3::new(theta.sin() * 0.6, theta.sin() * 0.8, -theta.cos());
    let beam = Emission::Beam { direction };
    scene.source(Source::new("lamp", DVec3::Z, Region::World, Emitter::Point, beam));
    scene.build().unwrap()
}

fn traced(scene: &Scene, polarisation: Polarisation, paths: u64, seed: u64) -> Outcome {
    let settings = Settings { polarisation, ..Settings::new(paths, seed) };
    trace(scene, &[], &settings)
}

/// R of s and p of a surface between air and glass.
fn fresnel(n: f64, theta: f64) -> [f64; 2] {
    let film = Film::new(550.0, Vec::new()).unwrap();
    film.amplitudes(End::First, 1.0, n.into(), theta.cos()).reflectances()
}

/// m plates let (1 - R)/(1 + (2m - 1) R) of each polarisation pass [Born, Wolf 1999, section 1.5]:
/// their surfaces return light to each other, not waves.
#[test]
fn a_pile_of_plates_polarises_by_the_closed_form() {
    let (n, plates) = (1.52, 4_i32);
    let surfaces: Vec<(f64, SurfaceModel)> = (0..2 * plates)
        .map(|k| (if k % 2 == 0 { n } else { 1.0 }, SurfaceModel::Interface))
        .collect();
    for theta in [f64::atan(n), 0.4, 1.2] {
        let passed = |r: f64| (1.0 - r) / (1.0 + f64::from(2 * plates - 1) * r);
        let [s, p] = fresnel(n, theta);
        let scene = pile(&surfaces, theta);
        let carried = traced(&scene, Polarisation::Carried, many() / 50, 1);
        let expected = 0.5 * (passed(s) + passed(p));
        assert_share("carried", carried.total.ledger.escaped_down, expected, carried.paths, 0.0);

        // Where every surface sees unpolarised light it is another number.
        let mean = passed(0.5 * (s + p));
        let plain = traced(&scene, Polarisation::Unpolarised, many() / 50, 2);
        assert_share("unpolarised", plain.total.ledger.escaped_down, mean, plain.paths, 0.0);
        assert!(theta < 0.5 || expected - mean > 0.02, "{expected} {mean}");
    }
}

/// Index of fused silica, silver and two coatings.
fn layer(n: f64, k: f64, thickness_nm: f64) -> Layer {
    Layer { index: Complex64::new(n, k), thickness_nm }
}

#[test]
fn films_pass_reflect_and_absorb_what_their_matrix_says() {
    let layers = vec![layer(1.45, 0.0, 60.0), layer(0.06, 3.6, 12.0), layer(2.1, 0.02, 45.0)];
    let film = Film::new(550.0, layers).unwrap();
    let n = 1.41;
    for theta in [0.0, 0.7, 1.3] {
        // From above the last layer is met first: the silicone is on the inner side.
        let met = film.amplitudes(End::Last, 1.0, n.into(), f64::cos(theta));
        let half = |[s, p]: [f64; 2]| 0.5 * (s + p);
        let (r, t) = (half(met.reflectances()), half(met.transmittances()));
        let surfaces =
            [(n, SurfaceModel::Layered(Arc::new(film.clone()))), (n, SurfaceModel::Absorber)];
        for polarisation in [Polarisation::Unpolarised, Polarisation::Carried] {
            let outcome = traced(&pile(&surfaces, theta), polarisation, many() / 50, 3);
            let ledger = &outcome.total.ledger;
            assert_share("reflected", ledger.escaped_up, r, outcome.paths, 0.0);
            let beyond = ledger.surface("plane 1").unwrap().absorbed;
            assert_share("transmitted", beyond, t, outcome.paths, 0.0);
            let absorbed = ledger.surface("plane 0").unwrap().absorbed;
            assert!((absorbed - (1.0 - r - t)).abs() < 1e-9, "{absorbed}");
        }
    }

    let mirror = LayeredMirror {
        film: Film::new(550.0, vec![layer(1.38, 0.0, 95.0), layer(2.1, 0.0, 66.0)]).unwrap(),
        substrate: Complex64::new(0.06, 3.6),
        factor: 0.9,
    };
    let met = mirror.film.amplitudes(End::First, 1.0, mirror.substrate, f64::cos(0.7));
    let [s, p] = met.reflectances();
    let surfaces = [(1.0, SurfaceModel::LayeredMirror(Arc::new(mirror)))];
    let outcome = traced(&pile(&surfaces, 0.7), Polarisation::Carried, 6400, 4);
    let expected = 0.45 * (s + p);
    assert!((outcome.total.ledger.escaped_up - expected).abs() < 1e-12);
}

/// A dome that is coated by a quarter wave of the root of its index lets more light out than a bare
/// one, and one with half a wave the same.
#[test]
fn a_coated_dome_extracts_more() {
    let extraction = |optics: SurfaceModel| {
        let mut prototype = package(N, Dome::smooth(&CAP), 0.95, 0.5).prototype().unwrap();
        for surface in &mut prototype.surfaces {
            for part in &mut surface.patches {
                if matches!(part.optics, SurfaceModel::Interface) {
                    part.optics = optics.clone();
                }
            }
        }
        let outcome = trace(&single(prototype), &[], &Settings::new(many() / 50, 5));
        outcome.jackknife(|totals| totals.ledger.extraction())
    };
    let film = |n: f64, quarters: f64| {
        let layers = vec![layer(n, 0.0, quarters * 550.0 / 4.0 / n)];
        SurfaceModel::Layered(Arc::new(Film::new(550.0, layers).unwrap()))
    };
    let bare = extraction(SurfaceModel::Interface);
    let none = extraction(SurfaceModel::Layered(Arc::new(Film::new(550.0, Vec::new()).unwrap())));
    let coated = extraction(film(N.sqrt(), 1.0));
    let error = |a: tracer::Estimate, b: tracer::Estimate| a.standard_error.hypot(b.standard_error);
    assert!((bare.value - none.value).abs() < 5.0 * error(bare, none), "{bare:?} {none:?}");
    assert!(coated.value - bare.value > 5.0 * error(bare, coated), "{bare:?} {coated:?}");
}

#[test]
fn the_same_bits_on_any_number_of_threads_and_nothing_lost() {
    let package = package(N, Dome::relief(staircase(17)), 0.95, 0.86);
    let scene = array(&package, 2, 8.3).build().unwrap();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| traced(&scene, Polarisation::Carried, 128_000, 6))
    };
    let one = run(1);
    assert_eq!(one, run(3));
    assert!(one.total.ledger.lost_total() < 1e-3);

    // Relief polarises: what comes back to its treads and risers finds them changed, a little.
    let plain = traced(&scene, Polarisation::Unpolarised, 128_000, 6);
    let of = |outcome: &Outcome| outcome.jackknife(|t| t.ledger.extraction());
    let (a, b) = (of(&one), of(&plain));
    assert!((a.value - b.value).abs() < 0.02, "{a:?} {b:?}");
}

#[test]
fn bad_films_are_refused() {
    let mirror = |factor: f64, re: f64| {
        let mirror = LayeredMirror {
            film: Film::new(550.0, Vec::new()).unwrap(),
            substrate: Complex64::new(re, 1.0),
            factor,
        };
        let mut scene = SceneBuilder::new(Medium::air());
        let optics = SurfaceModel::LayeredMirror(Arc::new(mirror));
        let shape = Shape::horizontal(0.0).unwrap();
        scene.surface(Surface::new("silver", shape, Region::Opaque, Region::World, &optics));
        let lamp =
            Source::new("lamp", DVec3::Z, Region::World, Emitter::Point, Emission::Isotropic);
        scene.source(lamp);
        scene.build().map(|_| ())
    };
    assert_eq!(mirror(1.0, 0.1), Ok(()));
    assert!(matches!(mirror(1.5, 0.1), Err(Error::Number { .. })));
    assert!(matches!(mirror(1.0, -0.1), Err(Error::Number { .. })));

    // A film on something opaque is no interface.
    let mut scene = SceneBuilder::new(Medium::air());
    let film = SurfaceModel::Layered(Arc::new(Film::new(550.0, Vec::new()).unwrap()));
    let shape = Shape::horizontal(0.0).unwrap();
    scene.surface(Surface::new("film", shape, Region::Opaque, Region::World, &film));
    assert!(matches!(scene.build().map(|_| ()), Err(Error::OpaqueSide { .. })));
}
