// SPDX-License-Identifier: MIT OR Apache-2.0
//! Packages that stand in a solid of the array: light leaves them into its medium, meets their
//! neighbours there, comes back from its faces; what does not fit is refused.
//!
//! Source: Fresnel's formulas with all inner reflections, integrated over directions; the law of
//! Beer and Lambert; solid angles; one radiance everywhere within a white furnace; a package of the
//! index of what it stands in.

use crate::common::package::Dome;
use crate::common::placed::{at, brick, in_furnace, turned};
use crate::common::*;
use tracer::glam::{DMat3, DVec3};
use tracer::receiver::{DetectorRectangle, Facing, Sense};
use tracer::shape::{Closing, Element, Placement};
use tracer::{
    Detector, Emission, Emitter, Error, FarField, Measurement, Medium, Meridian, Outcome, Patch,
    PlaneMap, Polarisation, Prototype, Region, Scene, SceneBuilder, Settings, Shape, Source,
    Surface, SurfaceModel, run,
};

const CLEAR: SurfaceModel = SurfaceModel::Interface;

/// A ball of a medium with a source in its middle.
fn bead(radius: f64, medium: Medium, emission: Emission) -> Prototype {
    Prototype {
        media: vec![medium],
        surfaces: vec![Surface::new(
            "bead",
            Shape::sphere(0.0, radius).unwrap(),
            BODY,
            Region::World,
            &CLEAR,
        )],
        sources: vec![inside(DVec3::ZERO, Emitter::Point, emission)],
    }
}

/// Something dark in the middle of nothing.
fn coal(radius: f64) -> Prototype {
    let shape = Shape::sphere(0.0, radius).unwrap();
    Prototype {
        media: Vec::new(),
        surfaces: vec![Surface::new(
            "coal",
            shape,
            Region::Opaque,
            Region::World,
            &SurfaceModel::Absorber,
        )],
        sources: Vec::new(),
    }
}

/// A solid of the array in the world.
fn holder(medium: Medium, shape: Shape, optics: &SurfaceModel) -> Prototype {
    let name = medium.name.clone();
    Prototype {
        media: vec![medium],
        surfaces: vec![Surface::new(&name, shape, BODY, Region::World, optics)],
        sources: Vec::new(),
    }
}

/// Prototypes in their places, within another.
fn enclosed(packages: Vec<(Prototype, [f64; 3])>, solids: Prototype) -> SceneBuilder {
    let mut scene = SceneBuilder::new(Medium::air());
    for (package, place) in packages {
        let id = scene.prototype(package);
        scene.place(id, DVec3::from_array(place));
    }
    let id = scene.prototype(solids);
    scene.array_solids(id);
    scene
}

fn line(outcome: &Outcome, name: &str) -> f64 {
    let ledger = &outcome.total.ledger;
    ledger.surface(name).unwrap().absorbed
}

fn absorbed_in(outcome: &Outcome, name: &str) -> f64 {
    let ledger = &outcome.total.ledger;
    let line = ledger.lines.media.iter().position(|known| known == name);
    ledger.media[line.unwrap()]
}

fn air_ball(name: &str, radius: f64, absorption: f64) -> Prototype {
    let medium = Medium::clear(name, 1.0).absorbing(absorption);
    holder(medium, Shape::sphere(0.0, radius).unwrap(), &CLEAR)
}

/// Reflectances of s and p from `from` to `to` at the cosine `c`.
fn fresnel([from, to]: [f64; 2], c: f64) -> [f64; 2] {
    let sin2 = (from / to).powi(2) * (1.0 - c * c);
    if sin2 >= 1.0 {
        return [1.0; 2];
    }
    let t = (1.0 - sin2).sqrt();
    let s = (from * c - to * t) / (from * c + to * t);
    let p = (to * c - from * t) / (to * c + from * t);
    [s * s, p * p]
}

/// Shares of Lambertian light in a slab of index `n` that leave by the face it goes to, and by the
/// other, after all inner reflections.
fn out_of_slab(n: f64, carried: bool) -> [f64; 2] {
    const STEPS: usize = 400_000;
    let mut out = [0.0; 2];
    for k in 0..STEPS {
        // Equal shares of the flux: sin² θ is uniform.
        let sin2 = (k as f64 + 0.5) / STEPS as f64;
        let [s, p] = fresnel([n, 1.0], (1.0 - sin2).sqrt());
        let each = if carried { [s, p] } else { [0.5 * (s + p); 2] };
        for r in each.into_iter().filter(|r| *r < 1.0) {
            out[0] += 0.5 / (1.0 + r) / STEPS as f64;
            out[1] += 0.5 * r / (1.0 + r) / STEPS as f64;
        }
    }
    out
}

#[test]
fn light_of_a_enclosed_bead_leaves_the_slab_as_fresnel_says() {
    // A small ball of another index in the middle of a wide slab with black edges: what its surface
    // sends back goes out by its other side.
    let (n, of_bead) = (1.5, 2.5);
    let shape = Shape::cuboid(DVec3::new(-100.0, -100.0, -1.0), DVec3::new(100.0, 100.0, 1.0));
    let parts = [SurfaceModel::Absorber, CLEAR, CLEAR].map(|optics| Patch::new("slab", optics));
    let slab = Prototype {
        media: vec![Medium::clear("glass", n)],
        surfaces: vec![Surface::zoned(shape.unwrap(), BODY, Region::World, parts.to_vec())],
        sources: Vec::new(),
    };
    let package = bead(1e-3, Medium::clear("gem", of_bead), Emission::LAMBERTIAN);
    let scene = enclosed(vec![(package, [0.0; 3])], slab).build().unwrap();
    let r = ((of_bead - n) / (of_bead + n)).powi(2);
    let (there, back) = (1.0 / (1.0 + r), r / (1.0 + r));
    let plain = Settings::new(many() / 20, 3);
    let carried = Settings { polarisation: Polarisation::Carried, ..plain };
    for settings in [plain, carried] {
        let is_carried = settings.polarisation == Polarisation::Carried;
        let [up, down] = out_of_slab(n, is_carried);
        let outcome = trace(&scene, &[], &settings);
        let ledger = &outcome.total.ledger;
        assert!(ledger.lost_total() < 1e-9, "{:?}", ledger.lost);
        let expected = [up * there + down * back, down * there + up * back];
        let paths = outcome.paths;
        assert_share("up", ledger.escaped_up, expected[0], paths, 2e-4);
        assert_share("down", ledger.escaped_down, expected[1], paths, 2e-4);
        // Out of bodies into the world goes what leaves the slab, not what leaves the bead.
        let escaped = ledger.escaped_up + ledger.escaped_down;
        assert!((ledger.extraction() - escaped).abs() < 1e-9);
    }
    // Polarisation matters, or the second case proves nothing.
    assert!((out_of_slab(n, true)[0] - out_of_slab(n, false)[0]).abs() > 1e-3);
}

#[test]
fn media_absorb_as_beer_and_lambert_say() {
    let (alpha, beta, radius) = (0.7, 1.3, 0.25);
    let medium = Medium::clear("inner", 1.0).absorbing(beta);
    let package = bead(radius, medium, Emission::Isotropic);
    let scene = enclosed(vec![(package, [0.0; 3])], air_ball("slab", 1.0, alpha));
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many() / 20, 5));
    let passed = (-beta * radius).exp();
    let expected = passed * (1.0 - (-alpha * (1.0 - radius)).exp());
    let paths = outcome.paths;
    assert_share("slab", absorbed_in(&outcome, "slab"), expected, paths, 0.0);
    assert_share("inner", absorbed_in(&outcome, "inner"), 1.0 - passed, paths, 0.0);
}

#[test]
fn packages_meet_their_neighbours_within_the_slab_unless_they_stand_apart() {
    let (radius, distance) = (0.5, 1.5);
    let lamp = || bead(0.1, Medium::clear("inner", 1.0), Emission::Isotropic);
    let places = |far: [f64; 3]| vec![(lamp(), [-0.5, 0.2, 0.1]), (coal(radius), far)];
    let near = [-0.5, 0.2 + distance, 0.1];
    let seen = 0.5 * (1.0 - (1.0 - (radius / distance).powi(2)).sqrt());
    for (apart, expected) in [(false, seen), (true, 0.0)] {
        let scene =
            enclosed(places(near), air_ball("slab", 3.0, 0.0)).isolated(apart).build().unwrap();
        let outcome = trace(&scene, &[], &Settings::new(many() / 20, 6));
        assert_share("coal", line(&outcome, "coal"), expected, outcome.paths, 0.0);
    }
    // One in the slab and one in the world: light goes on from the one into the other.
    let outside = [-0.5, 0.2, 0.1 + 6.0];
    let seen = 0.5 * (1.0 - (1.0 - (radius / 6.0f64).powi(2)).sqrt());
    let scene = enclosed(places(outside), air_ball("slab", 3.0, 0.0));
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many() / 20, 7));
    assert_share("coal", line(&outcome, "coal"), seen, outcome.paths, 0.0);
}

#[test]
fn light_that_a_face_sends_back_meets_its_package_again() {
    // Straight up out of a ball, back from the mirror, through the ball and into the bottom.
    let (alpha, radius) = (0.8, 0.3);
    let beam = Emission::Beam { direction: DVec3::Z };
    let medium = Medium::clear("inner", 1.0).absorbing(alpha);
    let shape = Shape::cuboid(DVec3::splat(-1.0), DVec3::ONE).unwrap();
    let mirror = SurfaceModel::Mirror { reflectance: 1.0 };
    let parts = [CLEAR, mirror, SurfaceModel::Absorber].map(|optics| Patch::new("slab", optics));
    let slab = Prototype {
        media: vec![Medium::clear("glass", 1.0)],
        surfaces: vec![Surface::zoned(shape, BODY, Region::World, parts.to_vec())],
        sources: Vec::new(),
    };
    let scene = enclosed(vec![(bead(radius, medium, beam), [0.1, 0.0, 0.0])], slab);
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(20_000, 8));
    let expected = 1.0 - (-3.0 * alpha * radius).exp();
    assert_share("inner", absorbed_in(&outcome, "inner"), expected, outcome.paths, 0.0);
    assert!((line(&outcome, "slab") + absorbed_in(&outcome, "inner") - 1.0).abs() < 1e-9);
}

#[test]
fn a_white_furnace_stays_white_around_a_slab_with_packages() {
    let radius = 3.0;
    let grain = |index: f64| Prototype {
        sources: Vec::new(),
        ..bead(0.4, Medium::clear("grain", index), Emission::Isotropic)
    };
    let mut solids = holder(
        Medium::clear("slab", 1.4),
        brick([1.3, 1.2, 0.8], &at([0.1, 0.0, 0.2], turned(), 0.0)),
        &CLEAR,
    );
    // A smaller solid within the slab, which holds one of the grains.
    let drop = Shape::sphere(0.0, 0.7).unwrap();
    let drop =
        Shape::placed(vec![drop], Closing::Closed, &Placement::at(DVec3::new(0.1, 0.0, 0.2)));
    solids.media.push(Medium::clear("drop", 1.2));
    solids.surfaces.push(Surface::new("drop", drop.unwrap(), Region::Body(1), BODY, &CLEAR));
    let along = |by: f64| (DVec3::new(0.1, 0.0, 0.2) + turned() * DVec3::X * by).to_array();
    let packages = vec![
        (grain(1.9), [0.1, 0.0, 0.2]),
        (coat(1.0), along(1.05)),
        (grain(1.7), [0.0, 0.0, -2.0]),
    ];
    let scene = enclosed(packages, solids);
    let outcome = in_furnace(scene, radius);
    let ledger = &outcome.total.ledger;
    for name in ["bead", "slab", "drop", "coat"] {
        let lines = ledger.named_surfaces().filter(|(known, _)| *known == name);
        let inward: f64 = lines.map(|(_, line)| line.inward).sum();
        assert!(inward > 1e-3, "{name}: {inward}");
    }
    for zone in 0..20 {
        let power = line(&outcome, &format!("zone {zone}"));
        assert_share("zone", power, 0.05, outcome.paths, 1e-6);
    }
}

/// A small box of this index that scatters nothing and keeps nothing.
fn coat(index: f64) -> Prototype {
    let shape = Shape::cuboid(DVec3::splat(-0.08), DVec3::splat(0.08)).unwrap();
    Prototype {
        media: vec![Medium::clear("coat", index)],
        surfaces: vec![Surface::new("coat", shape, BODY, Region::World, &CLEAR)],
        sources: Vec::new(),
    }
}

/// A dome of the paper on a mirror, with another beside it, in a slab of this index.
fn domes(dome: &Prototype, index: f64) -> Scene {
    let shape = brick([6.0, 5.0, 1.0], &at([0.0, 0.0, 1.0], DMat3::IDENTITY, 1e-8));
    let slab = holder(Medium::clear("slab", index), shape, &CLEAR);
    let mut scene = enclosed(Vec::new(), slab);
    let id = scene.prototype(dome.clone());
    place_array(&mut scene, id, [2, 2], 4.0);
    let mirror = SurfaceModel::Mirror { reflectance: 0.95 };
    let ground = tracer::package::ground(8.0, 8.0, mirror, SurfaceModel::Absorber);
    scene.surface(ground.unwrap());
    scene.build().unwrap()
}

#[test]
#[ignore = "nightly: domes of all kinds in a slab (25 s)"]
fn nightly_a_dome_of_the_index_of_the_slab_is_not_seen_whatever_it_is_made_of() {
    // A smooth dome, a relief and a large mesh, which is searched in another order, all of one
    // body: the same light leaves the slab.
    let smooth = package(N, Dome::smooth(&CAP), 0.95, 0.86);
    let stepped = package(N, Dome::relief(staircase(17)), 0.95, 0.86);
    let same = [&smooth, &stepped].map(|dome| dome.prototype().unwrap());
    let far = FarField::new(15.0, 90.0).unwrap();
    let seen = |dome: &Prototype, seed: u64| {
        let scene = domes(dome, N);
        let outcome = trace(&scene, &[&far], &Settings::new(many() / 40, seed));
        assert!(outcome.total.ledger.lost_total() < 1e-3);
        (0..24).map(|bin| outcome.mean(|t| t.readings[0][bin])).collect::<Vec<_>>()
    };
    let [a, b] = [seen(&same[0], 1), seen(&same[1], 2)];
    for (a, b) in a.iter().zip(&b) {
        let error = a.standard_error.hypot(b.standard_error).max(1e-6);
        assert!((a.value - b.value).abs() < 5.0 * error, "{a:?} {b:?}");
    }
    let [ball, mesh] =
        [mirrored_cap(Emission::LAMBERTIAN), meshed_cap(4_000, Emission::LAMBERTIAN)];
    for (a, b) in seen(&ball, 3).iter().zip(&seen(&mesh, 4)) {
        let error = a.standard_error.hypot(b.standard_error).max(1e-6);
        assert!((a.value - b.value).abs() < 5.0 * error, "{a:?} {b:?}");
    }
}

#[test]
fn light_between_two_patches_above_enclosed_domes_is_the_same_both_ways() {
    let dome = package(N, Dome::smooth(&CAP), 0.95, 0.86);
    let dark = Prototype { sources: Vec::new(), ..dome.prototype().unwrap() };
    let there = |[from, to]: [([f64; 3], [f64; 2]); 2], seed: u64| {
        let glass = Medium::clear("slab", 1.6).absorbing(0.05);
        let shape = brick([4.5, 4.2, 0.7], &at([0.2, 0.1, 0.7], DMat3::IDENTITY, 1e-8));
        let mut scene = enclosed(Vec::new(), holder(glass, shape, &CLEAR));
        let id = scene.prototype(dark.clone());
        place_array(&mut scene, id, [2, 2], 4.0);
        let white = SurfaceModel::Lambertian { reflectance: 0.9 };
        scene.surface(tracer::package::ground(9.0, 9.0, white, SurfaceModel::Absorber).unwrap());
        let ([x, y, z], [along_x, along_y]) = from;
        let emitter = Emitter::Rectangle { half_x: 0.5 * along_x, half_y: 0.5 * along_y };
        let place = DVec3::new(x, y, z);
        let lamp = Source::new("lamp", place, Region::World, emitter, Emission::LAMBERTIAN);
        scene.source(lamp.facing(-DVec3::Z));
        let rectangle =
            DetectorRectangle::new(Facing::Z(Sense::Plus), DVec3::from_array(to.0), to.1, [1, 1]);
        let seen = [Detector::new("rectangle", Measurement::Plane(rectangle.unwrap()))];
        let settings = Settings::new(many() / 20, seed);
        let scene = scene.build().unwrap();
        let outcome = run(&scene, &receivers(&seen), &settings).unwrap();
        let share = outcome.mean(|t| t.readings[0][0]);
        // Times the area of the lamp: with one radiance then.
        let area = along_x * along_y;
        [share.value * area, share.standard_error * area]
    };
    let (a, b) = (([-2.0, 0.5, 1.8], [1.4, 1.4]), ([1.5, -1.0, 2.6], [2.0, 2.0]));
    let (forth, back) = (there([a, b], 41), there([b, a], 43));
    let error = forth[1].hypot(back[1]);
    assert!(forth[0] > 0.01 && error < 0.05 * forth[0], "{forth:?}");
    assert!((forth[0] - back[0]).abs() < 5.0 * error, "{forth:?} {back:?}");
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_number_of_threads() {
    let dome = package(N, Dome::smooth(&CAP), 0.95, 0.86).prototype().unwrap();
    let scene = domes(&dome, 1.5);
    let plane = PlaneMap::centred(3.0, 0.5, 8, 8).unwrap();
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| run(&scene, &[&plane], &Settings::new(50_000, 11)).unwrap())
    };
    let (one, three) = (of(1), of(3));
    assert_eq!(one.total.readings, three.total.readings);
    assert_eq!(one.total.ledger, three.total.ledger);
    assert!(one.total.readings[0].iter().sum::<f64>() > 0.1);
}

#[test]
fn what_stands_in_a_solid_in_part_is_refused_with_names_and_place() {
    let with = |shape: Shape| {
        let slab = holder(Medium::clear("slab", 1.5), shape, &CLEAR);
        let dome = package(N, Dome::smooth(&CAP), 0.95, 0.86).prototype().unwrap();
        let mut scene = enclosed(vec![(dome, [0.0; 3])], slab);
        let mirror = SurfaceModel::Mirror { reflectance: 0.95 };
        let ground = tracer::package::ground(8.0, 8.0, mirror, SurfaceModel::Absorber);
        scene.surface(ground.unwrap()).build()
    };
    let slab = |half: [f64; 3], x: f64| {
        let place = at([x, 0.0, half[2]], DMat3::IDENTITY, 1e-8);
        brick(half, &place)
    };
    assert!(with(slab([3.0, 3.0, 0.6], 0.0)).is_ok());
    // Touching from below at one point.
    assert!(with(slab([3.0, 3.0, 0.5], 0.0)).is_ok());
    // Thinner than the dome, by half and by very little; too narrow; beside its middle.
    for (half, x) in [
        ([3.0, 3.0, 0.25], 0.0),
        ([3.0, 3.0, 0.4999], 0.0),
        ([1.6, 3.0, 0.6], 0.0),
        ([3.0, 3.0, 0.6], 1.5),
    ] {
        let error = with(slab(half, x)).err().expect("refused");
        let said = error.to_string();
        assert!(matches!(error, Error::Crossing { .. } | Error::Straddles { .. }), "{said}");
        assert!(said.contains("slab") && said.contains("mm"), "{said}");
    }
    // A hollow that holds the dome is part of the world.
    let points = vec![[0.0, 2.0], [3.0, 2.0], [3.0, 0.1], [2.5, 0.1], [2.5, 1.5], [0.0, 1.5]];
    let bell = Shape::revolution(&Meridian::new(&[Element { points }]).unwrap());
    assert!(with(bell).is_ok());
    // Stone all around.
    let mut scene = enclosed(vec![(coat(1.5), [0.0; 3])], coal(2.0));
    let error = scene.build().err().expect("refused");
    assert!(
        matches!(&error, Error::InOpaque { instance: 0, surface } if surface == "coal"),
        "{error}"
    );
    scene.power(2.0);
    assert!(scene.build().is_err());
}

#[test]
fn tables_and_sources_are_judged_by_what_a_package_stands_in() {
    // A table for silicone in air does not fit in glass, nor one in glass in the air.
    let with = |outer: f64, half: f64| {
        let table = bsdf::SmoothInterface::new(2.0, outer).unwrap();
        let mut dome = bead(0.5, Medium::clear("gem", 2.0), Emission::Isotropic);
        dome.surfaces[0].patches[0].optics = SurfaceModel::Scatter(std::sync::Arc::new(table));
        let cube = Shape::cuboid(DVec3::splat(-half), DVec3::splat(half)).unwrap();
        let slab = holder(Medium::clear("slab", 1.5), cube, &CLEAR);
        enclosed(vec![(dome, [0.0, 0.0, 3.0 - 3.0 * half])], slab).build()
    };
    assert!(with(1.5, 1.0).is_ok() && with(1.0, 0.5).is_ok());
    for (outer, half) in [(1.0, 1.0), (1.5, 0.5)] {
        let error = with(outer, half).err().expect("refused");
        assert!(matches!(error, Error::IndexMismatch { .. }), "{error}");
    }
    // A lamp without a body of its own, in what holds its package: a black one beside it takes its
    // share.
    let mut lamp = coal(0.2);
    lamp.sources.push(Source::new(
        "lamp",
        DVec3::new(0.0, 0.0, 1.0),
        Region::World,
        Emitter::Point,
        Emission::Isotropic,
    ));
    let of = |z: f64| enclosed(vec![(lamp.clone(), [0.0, 0.0, z])], air_ball("slab", 3.0, 0.5));
    let outcome = trace(&of(0.0).build().unwrap(), &[], &Settings::new(many() / 2, 9));
    let seen = 0.5 * (1.0 - (1.0f64 - 0.2 * 0.2).sqrt());
    // Less what the way takes: 0.8 to 0.98 mm.
    let coal = line(&outcome, "coal");
    assert!(coal < seen * (-0.4f64).exp() && coal > seen * (-0.49f64).exp());
    // Beyond the slab it does not stand where its package does.
    let error = of(2.5).build().err().expect("refused");
    assert!(matches!(error, Error::SourceOutside { .. } | Error::OpenBody { .. }), "{error}");
}
