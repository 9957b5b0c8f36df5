// SPDX-License-Identifier: MIT OR Apache-2.0
//! Packages are traced many paths at once: every path must go as it goes when it is followed by
//! itself, and no ray may be lost.

use crate::common;
use std::sync::Arc;

use crate::common::package::{Dome, Package};
use crate::common::{
    CAP, N, NoFresnel, array, mirrored_cap, package, single, staircase, teeth, trace,
};
use bsdf::{Grid, OrderEfficiency, OrderTable, TableHeader};
use tracer::housing::Housing;
use tracer::run::{Control, run_rays};
use tracer::shape::{Bend, Reach, Revolution, Sides};
use tracer::{
    Emission, FarField, Patch, PhaseFunction, PlaneMap, Prototype, Ray, Region, Scattering, Scene,
    Settings, Shape, Surface, SurfaceModel, run,
};

const GROUPS: usize = 6;
/// Paths of a group of [`run_rays`], which follows path by path.
const IN_GROUP: u64 = 16_384;

/// Surfaces after which rounding has not yet grown to where a path goes another way.
const SURE: u32 = 60;

/// Every line of the ledger, path by path and many at once: as the draws are the same, only a ray
/// that meets an edge to within rounding, or one that is caught and meets a hundred surfaces, may
/// go another way.
fn agree(what: &str, scene: &Scene) {
    let mut settings = Settings::new(IN_GROUP * GROUPS as u64, 7);
    settings.groups = GROUPS;
    let both = |settings: &Settings| {
        let single = run_rays(scene, settings, Control::default(), |_, _| Ok(())).unwrap();
        [run(scene, &[], settings).unwrap(), single]
    };
    let [many, single] = both(&settings);
    assert_eq!(many.paths, single.paths);
    let paths = many.paths as f64;
    let lines = |outcome: &tracer::Outcome| {
        let ledger = &outcome.total.ledger;
        let mut all = vec![ledger.escaped_up, ledger.escaped_down, ledger.lost_total()];
        for (_, line) in ledger.named_surfaces() {
            all.extend([line.absorbed, line.outward, line.inward]);
        }
        all.extend(&ledger.media);
        all
    };
    for (k, (a, b)) in lines(&many).into_iter().zip(lines(&single)).enumerate() {
        assert!((a - b).abs() < 4.0 / paths, "{what}, line {k}: {a} {b}");
    }
    assert!(many.total.ledger.imbalance().abs() < 1e-11, "{what}");
    settings.max_bounces = SURE;
    let [many, single] = both(&settings);
    assert_eq!(many.hits, single.hits, "{what}");
}

fn domes() -> Vec<(&'static str, Dome)> {
    let bent: Arc<dyn bsdf::Bsdf> = Arc::new(NoFresnel { inner: N, outer: 1.0 });
    let zones = vec![
        (0.5, Patch::new("a", SurfaceModel::Interface)),
        (1.1, Patch::new("b", SurfaceModel::Scatter(bent))),
        (CAP.rim, Patch::new("c", SurfaceModel::Mirror { reflectance: 0.4 })),
    ];
    vec![
        ("smooth", Dome::smooth(&CAP)),
        ("gratings", gratings()),
        ("zones", Dome::Zones(zones)),
        ("17 steps", Dome::relief(staircase(17))),
        ("170 steps", Dome::relief(staircase(170))),
        ("teeth", Dome::relief(teeth(17, 50.0, 70.0))),
        ("overhanging", Dome::relief(teeth(60, 45.0, 10.0))),
    ]
}

/// A table in which orders -1 to 1 of both sides share the power by made-up laws, a tenth of it
/// absorbed.
fn gratings() -> Dome {
    let zones = (1..=5).map(|zone| {
        let grid = Grid {
            period: 1.5 + 0.5 * f64::from(zone),
            wavelength: 0.55,
            index_inner: N,
            index_outer: 1.0,
            kx_per_zone: 2,
            ky: Grid::ky_nodes(N, 1.0, 9),
        };
        let propagates = |n: f64, kx: f64, ky: f64| kx * kx + ky * ky < n * n;
        let rows: Vec<_> = grid
            .rows(|_, kx, ky, _| {
                let mut efficiencies = Vec::new();
                for (side, n) in [(bsdf::Side::Inner, N), (bsdf::Side::Outer, 1.0)] {
                    for order in -1..=1 {
                        if propagates(n, kx + f64::from(order) * grid.zone(), ky) {
                            let efficiency =
                                0.9 / 7.0 * (1.0 + 0.1 * kx - 0.05 * ky * f64::from(order));
                            efficiencies.push(OrderEfficiency::new(side, order, efficiency));
                        }
                    }
                }
                efficiencies
            })
            .collect();
        let table = OrderTable::build(TableHeader::default(), grid.clone(), rows).unwrap();
        let optics = SurfaceModel::Scatter(Arc::new(table));
        (CAP.rim * f64::from(zone) / 5.0, Patch::new(format!("band {zone}"), optics))
    });
    Dome::Zones(zones.collect())
}

fn variants(dome: Dome) -> Vec<Package> {
    let plain = package(N, dome, 0.95, 0.86);
    let mut painted = plain.clone();
    painted.silicone = painted.silicone.absorbing(0.2);
    painted.bottom = SurfaceModel::Lambertian { reflectance: 0.8 };
    painted.led.top = SurfaceModel::Absorber;
    painted.side = SurfaceModel::Absorber;
    let mut milky = painted.clone();
    let phase = PhaseFunction::HenyeyGreenstein(0.7);
    milky.silicone = milky.silicone.scattering(Some(Scattering { per_mm: 0.8, phase }));
    vec![plain, painted, milky]
}

#[test]
#[ignore = "slow: 5 s"]
fn a_path_goes_as_it_goes_alone() {
    for (name, dome) in domes() {
        for (number, package) in variants(dome).into_iter().enumerate() {
            agree(&format!("{name} {number}"), &single(package.prototype().unwrap()));
        }
    }
}

/// A lens with a hollow, a bead, a cone and a belt of a sphere, whose parts scatter differently.
fn freeform(mut package: Package) -> Prototype {
    package.dome = Dome::smooth(&CAP);
    let on_axis = |[r0, z0]: [f64; 2], [r1, z1]: [f64; 2]| {
        0.5 * (r1 * r1 - r0 * r0 + z1 * z1 - z0 * z0) / (z1 - z0)
    };
    let (middle, shoulder, edge, belt) = ([0.0, 0.75], [0.5, 0.9], [1.1, 0.8], [1.4, 0.5]);
    let rim = [CAP.rim, CAP.height(CAP.rim)];
    let hollow = [0.0, on_axis(middle, shoulder)];
    // Level half a millimetre below the middle of its chord.
    let bead = [0.8 - 0.5 * 0.1, 0.85 - 0.5 * 0.6];
    let sphere = on_axis(belt, rim);
    let radius = belt[0].hypot(belt[1] - sphere);
    let shapes = [
        Shape::arc(middle, shoulder, hollow, Bend::Counterclockwise),
        Shape::arc(shoulder, edge, bead, Bend::Clockwise),
        Shape::frustum(edge, belt),
        Shape::sphere_zones(sphere, radius, &[belt[1], 0.3, rim[1]]),
    ];
    let bent: Arc<dyn bsdf::Bsdf> = Arc::new(NoFresnel { inner: N, outer: 1.0 });
    let mut prototype = package.prototype().unwrap();
    prototype.surfaces.retain(|surface| surface.name() != "dome");
    for (number, shape) in shapes.into_iter().enumerate() {
        let shape = shape.unwrap();
        let patches = (0..shape.patches()).map(|k| match (number, k) {
            (1, _) => Patch::new("bead", SurfaceModel::Scatter(bent.clone())),
            (3, 0) => Patch::new("belt", SurfaceModel::Mirror { reflectance: 0.4 }),
            _ => Patch::new(format!("part {number} {k}"), SurfaceModel::Interface),
        });
        let patches = patches.collect();
        let surface = Surface::zoned(shape, tracer::package::SILICONE, Region::World, patches);
        prototype.surfaces.push(surface);
    }
    prototype
}

#[test]
fn a_path_through_lines_and_arcs_goes_as_it_goes_alone() {
    for (number, package) in variants(Dome::smooth(&CAP)).into_iter().enumerate() {
        agree(&format!("freeform {number}"), &single(freeform(package)));
    }
}

/// A smooth dome over a mirror with nothing else, lit in three ways; few surfaces are allowed too.
#[test]
fn a_path_through_a_lens_goes_as_it_goes_alone() {
    let narrow = Emission::Lambertian { half_angle_deg: 50.0 };
    for emission in [Emission::Isotropic, narrow] {
        agree("lens", &single(mirrored_cap(emission)));
    }
    let scene = single(mirrored_cap(Emission::LAMBERTIAN));
    agree("lens", &scene);
    for max_bounces in [1, 2, 5] {
        let mut settings = Settings::new(IN_GROUP * GROUPS as u64, 3);
        (settings.groups, settings.max_bounces) = (GROUPS, max_bounces);
        let many = run(&scene, &[], &settings).unwrap();
        let alone = run_rays(&scene, &settings, Control::default(), |_, _| Ok(())).unwrap();
        assert_eq!(many.hits, alone.hits);
        let [a, b] = [&many, &alone].map(|outcome| &outcome.total.ledger);
        assert!(a.lost_total() > 0.0 && a.imbalance().abs() < 1e-11, "{max_bounces}");
        let pairs = [
            (a.lost_total(), b.lost_total()),
            (a.escaped_up, b.escaped_up),
            (a.escaped_down, b.escaped_down),
        ];
        for (many, alone) in pairs {
            assert!((many - alone).abs() < 1e-11, "{max_bounces}: {many} {alone}");
        }
    }
}

#[test]
fn a_path_through_many_packages_goes_as_it_goes_alone() {
    for (name, dome) in domes() {
        let scene = array(&package(N, dome, 0.95, 0.86), 3, 4.0).build().unwrap();
        agree(name, &scene);
    }
}

/// Walls twice as high as the packages are met by light that passes over every neighbour; packages
/// of which each is by itself meet nothing but the ground.
#[test]
fn a_path_within_walls_and_one_apart_go_as_they_go_alone() {
    for (walled, apart) in [(true, false), (true, true), (false, true)] {
        let dome = Dome::relief(staircase(17));
        let mut scene = array(&package(N, dome, 0.95, 0.86), 2, 4.0);
        scene.isolated(apart);
        if walled {
            let walls = Housing {
                half: [4.5; 2],
                height: 2.0,
                thickness: 1.0,
                walls: SurfaceModel::Lambertian { reflectance: 0.7 },
                floor: SurfaceModel::Absorber,
                mirror: None,
            };
            for surface in walls.surfaces().unwrap() {
                if surface.name() != "floor" {
                    scene.surface(surface);
                }
            }
        }
        agree(&format!("walls {walled}, apart {apart}"), &scene.build().unwrap());
    }
}

#[test]
fn a_mesh_is_traced_in_another_order_only() {
    agree("mesh", &single(common::meshed_cap(3_000, Emission::LAMBERTIAN)));
}

#[test]
fn receivers_see_the_same() {
    // With a floor far below, light that has left the package may meet something else.
    let prototype = package(N, Dome::relief(staircase(17)), 0.95, 0.86).prototype().unwrap();
    let alone = single(prototype.clone());
    let mut above = tracer::SceneBuilder::new(tracer::Medium::air());
    let id = above.prototype(prototype);
    above.surface(tracer::Surface::new(
        "floor",
        tracer::Shape::horizontal(-50.0).unwrap(),
        Region::Opaque,
        Region::World,
        &SurfaceModel::Absorber,
    ));
    let above = above.place(id, tracer::glam::DVec3::ZERO).build().unwrap();
    let (far, plane) =
        (FarField::new(3.0, 30.0).unwrap(), PlaneMap::centred(2.0, 0.5, 24, 24).unwrap());
    let settings = Settings::new(100_000, 5);
    let [a, b] = [&alone, &above].map(|scene| trace(scene, &[&far, &plane], &settings));
    let up = 30 * far.phis();
    for (a, b, bins) in [(&a, &b, 0..up), (&a, &b, 0..576)].into_iter().enumerate().map(
        |(receiver, (a, b, bins))| (&a.total.readings[receiver], &b.total.readings[receiver], bins),
    ) {
        for bin in bins {
            assert!((a[bin] - b[bin]).abs() < 3.0 / 100_000.0, "{bin}");
        }
    }
}

#[test]
fn paths_are_given_up_and_roulette_is_played_as_alone() {
    let scene = single(package(N, Dome::relief(staircase(17)), 0.95, 0.86).prototype().unwrap());
    let mut settings = Settings::new(IN_GROUP * GROUPS as u64, 3);
    settings.groups = GROUPS;
    settings.max_bounces = 3;
    settings.roulette_below = 1.0;
    let many = run(&scene, &[], &settings).unwrap();
    let single = run_rays(&scene, &settings, Control::default(), |_, _| Ok(())).unwrap();
    let paths = many.paths as f64;
    assert!(many.total.ledger.lost_total() > 0.01);
    let lost = many.total.ledger.lost_total() - single.total.ledger.lost_total();
    assert!(lost.abs() < 4.0 / paths, "{lost}");
    assert!(many.hits.abs_diff(single.hits) < 100);
}

/// From every point of a path the staircase finds what testing all segments finds.
#[test]
fn comparing_levels_finds_what_testing_all_segments_finds() {
    use bsdf::Side;
    use tracer::random::{isotropic, stream, unit};
    for steps in [1, 3, 17, 170] {
        let shape = Revolution::new(&staircase(steps));
        let mut rng = stream(31, steps as u64);
        let mut hits = [0; 2];
        for _ in 0..200_000 {
            // A point within the height of the relief, near to it or anywhere; its side from the
            // height of the tread above or below it.
            let width = CAP.rim / steps as f64;
            let (r, phi) =
                (1.2 * CAP.rim * unit(&mut rng).sqrt(), std::f64::consts::TAU * unit(&mut rng));
            let top = if r < CAP.rim {
                CAP.height((r / width).floor() * width)
            } else {
                CAP.height(CAP.rim)
            };
            let near = if unit(&mut rng) < 0.5 { 0.02 } else { 0.5 };
            let z = top + near * (2.0 * unit(&mut rng) - 1.0);
            if z <= CAP.height(CAP.rim) {
                continue;
            }
            let side = if z < top { Side::Inner } else { Side::Outer };
            let ray = Ray {
                origin: tracer::glam::DVec3::new(r * phi.cos(), r * phi.sin(), z),
                direction: isotropic(&mut rng),
            };
            let reach = Reach { from: 0.0, to: f64::INFINITY };
            let sides = if side == Side::Inner { Sides::Inner } else { Sides::Outer };
            let (fast, slow) =
                (shape.intersect_from(&ray, reach, side), shape.intersect_all(&ray, reach, sides));
            // Light that leaves the relief through its open lower end may come back from below: not
            // from this side.
            let foot = CAP.height(CAP.rim);
            let through = ray.direction.z < 0.0 && {
                let t = (foot - z) / ray.direction.z;
                slow.is_none_or(|hit| hit.distance > t)
            };
            if through {
                assert!(fast.is_none(), "{ray:?} {fast:?}");
                continue;
            }
            match (fast, slow) {
                (Some(a), Some(b)) => {
                    assert!((a.distance - b.distance).abs() < 1e-9, "{ray:?} {a:?} {b:?}");
                    assert!(a.primitive == b.primitive && a.side == b.side, "{ray:?} {a:?} {b:?}");
                    hits[side.index()] += 1;
                }
                (a, b) => assert!(a.is_none() && b.is_none(), "{ray:?} {a:?} {b:?}"),
            }
        }
        assert!(hits[0] > 20_000 && hits[1] > 2_000, "{hits:?}");
    }
}

#[test]
fn no_path_is_lost_in_a_package() {
    let paths = common::many() / 4;
    for (seed, (name, dome)) in domes().into_iter().enumerate() {
        if name == "zones" || name == "gratings" {
            continue;
        }
        // A little absorption, as light may circle in a staircase for ever.
        let mut body = package(N, dome, 0.99, 0.99);
        body.silicone = body.silicone.absorbing(1e-3);
        let scene = single(body.prototype().unwrap());
        let outcome = trace(&scene, &[], &Settings::new(paths, seed as u64));
        let lost = outcome.total.ledger.lost;
        assert!(lost.iter().all(|&power| power <= 0.0), "{name}: {lost:?}");
    }
}

#[test]
fn the_emission_of_the_source_does_not_matter() {
    for emission in [Emission::Isotropic, Emission::Lambertian { half_angle_deg: 30.0 }] {
        let mut prototype =
            package(N, Dome::relief(staircase(17)), 0.95, 0.86).prototype().unwrap();
        prototype.sources[0].emission = emission;
        prototype.sources[0].position.z = 0.5;
        agree("emission", &single(prototype));
    }
}
