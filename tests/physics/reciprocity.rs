// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reciprocity between a face A in air and the top B of an LED box in silicone.
//!
//! Light of one basic radiance (L/n²) from A brings to B what the same from B brings to A
//! [Helmholtz 1856]. With shares s of the emitted power and Lambertian faces, s(B→A) n² area(B) =
//! s(A→B) area(A).

use crate::package::{Cap, Dome, Package};
use tracer::glam::DVec3;
use tracer::receiver::{DetectorRectangle, Facing, Sense};
use tracer::shape::{Bend, Element};
use tracer::{
    Detector, Emission, Emitter, Estimate, Interior, LedBox, Measurement, Medium, Meridian, Mixed,
    Polarisation, Prototype, Region, Scene, SceneBuilder, Settings, Shape, Source, Surface,
    SurfaceModel, run,
};

const N: f64 = 1.41;
/// Reflectance of the top of the box.
const TOP: f64 = 0.6;
/// Lengths of the box and of the face A, mm.
const BOX: [f64; 3] = [1.0, 0.8, 0.35];
const FACE: [f64; 2] = [1.4, 0.9];
const PATHS: u64 = 2_000_000;

fn led() -> LedBox {
    LedBox {
        size: DVec3::from_array(BOX),
        side: SurfaceModel::Mirror { reflectance: 0.86 },
        top: SurfaceModel::Lambertian { reflectance: TOP },
    }
}

fn silicone() -> Medium {
    Medium::clear("silicone", N).absorbing(0.05)
}

/// The stepped dome on a mirror.
fn stepped() -> Prototype {
    let cap = Cap { radius: 2.0, apex: 1.0, rim: 1.7 };
    let at = |k: usize| cap.rim * k as f64 / 17.0;
    let step = |k: usize| {
        let [inner, outer] = [at(k), at(k + 1)];
        let [top, foot] = [inner, outer].map(|r| cap.height(r));
        Element { points: vec![[inner, top], [outer, top], [outer, foot]] }
    };
    let steps: Vec<Element> = (0..17).map(step).collect();
    let package = Package {
        cap,
        silicone: silicone(),
        dome: Dome::relief(Meridian::new(&steps).expect("steps")),
        side: SurfaceModel::Interface,
        bottom: SurfaceModel::Mirror { reflectance: 0.95 },
        led: led(),
    };
    package.prototype().expect("a package")
}

/// A dome of arcs on a bottom that is partly a mirror.
fn freeform() -> Prototype {
    let interior = Interior {
        rim: 1.6,
        foot: 0.0,
        size: 2.0,
        silicone: silicone(),
        side: SurfaceModel::Interface,
        bottom: SurfaceModel::Mixed(Mixed { reflectance: 0.9, specular: 0.4 }),
        led: led(),
    };
    let mut prototype = interior.prototype().expect("a package");
    let arcs = [
        Shape::arc([0.0, 0.7], [0.8, 1.1], [0.0, 1.7], Bend::Counterclockwise),
        Shape::arc([0.8, 1.1], [1.8, 0.6], [1.0, 0.25], Bend::Clockwise),
        Shape::frustum([1.8, 0.6], [1.6, 0.0]),
    ];
    for arc in arcs {
        let arc = arc.expect("a piece of the dome");
        let (inside, air) = (Region::Body(0), Region::World);
        let surface = Surface::new("dome", arc, inside, air, &SurfaceModel::Interface);
        prototype.surfaces.push(surface);
    }
    prototype
}

/// Two packages on a mirror; light comes from the first one's box or from `face`.
fn scene(package: &Prototype, face: Option<&Source>) -> Scene {
    let (mut first, mut other) = (package.clone(), package.clone());
    other.sources.clear();
    for part in other.surfaces.iter_mut().flat_map(|s| &mut s.patches) {
        part.name = format!("other {}", part.name);
    }
    if face.is_some() {
        first.sources.clear();
    }
    let mut scene = SceneBuilder::new(Medium::air());
    let (first, other) = (scene.prototype(first), scene.prototype(other));
    scene.place(first, DVec3::ZERO);
    scene.place(other, DVec3::new(3.9, 0.4, 0.0));
    let mirror = SurfaceModel::Mirror { reflectance: 0.95 };
    let floor = SurfaceModel::Lambertian { reflectance: 0.3 };
    scene.surface(tracer::package::ground(4.0, 4.0, mirror, floor).expect("a ground"));
    if let Some(face) = face {
        scene.source(face.clone());
    }
    scene.build().expect("a valid scene")
}

/// What a bin of the detector gets of the emitted power.
fn share(scene: &Scene, (detector, bin): (&Detector, usize), settings: &Settings) -> Estimate {
    let outcome = run(scene, &[detector], settings);
    let outcome = outcome.expect("a trace");
    assert!(outcome.total.ledger.imbalance().abs() < 1e-9);
    outcome.jackknife(|totals| totals.readings[0][bin])
}

#[test]
#[ignore = "slow: 8 s"]
fn source_and_receiver_may_be_exchanged() {
    // The face lies over the edge of the dome, so that nothing is symmetric.
    let at = DVec3::new(1.1, -0.5, 1.9);
    let patch = DetectorRectangle::new(Facing::Z(Sense::Plus), at, FACE, [1, 1]).expect("a face");
    let above = Detector::new("A", Measurement::Plane(patch));
    let below = Detector::new("B", Measurement::Flux("box top".to_owned()));
    let emitter = Emitter::Rectangle { half_x: 0.5 * FACE[0], half_y: 0.5 * FACE[1] };
    let face = Source::new("A", at, Region::World, emitter, Emission::LAMBERTIAN);
    let face = face.facing(-DVec3::Z);
    for (name, package, polarisation) in [
        ("stepped", stepped(), Polarisation::Unpolarised),
        ("stepped, polarised", stepped(), Polarisation::Carried),
        ("freeform", freeform(), Polarisation::Unpolarised),
    ] {
        let settings = |seed: u64| Settings { polarisation, ..Settings::new(PATHS, seed) };
        let up = share(&scene(&package, None), (&above, 0), &settings(1));
        // What comes to the top from outside of the box.
        let down = share(&scene(&package, Some(&face)), (&below, 3), &settings(2));
        let scale = N * N * BOX[0] * BOX[1] / (FACE[0] * FACE[1]);
        let (a, b) = (up.value * scale, down.value);
        let error = (up.standard_error * scale).hypot(down.standard_error);
        assert!((a - b).abs() < 4.5 * error, "{name}: {a} {b} ± {error}");
        // The test would notice an error of 3 %.
        assert!(error < 6e-3 * b, "{name}: {b} ± {error}");
    }
}
