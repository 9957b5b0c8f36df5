// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shapes: nothing is met twice, nothing leaks, and every shortcut gives what the long way gives.

use crate::common::package::Dome;
use crate::common::*;
use bsdf::Side;
use tracer::glam::DVec3;
use tracer::random::{about, cosine, isotropic, stream, unit};
use tracer::scene::InstanceSearch;
use tracer::shape::{
    Bend, Element, Extent, Frustum, Intersection, Plane, RELATIVE_PAD, Reach, Revolution, Sides,
};
use tracer::{FarField, Meridian, Patch, PlaneMap, Ray, Settings, Shape, SurfaceModel};

const EVERYWHERE: Reach = Reach { from: 0.0, to: f64::INFINITY };

fn scaled(meridian: &Meridian, scale: f64) -> Meridian {
    let elements: Vec<Element> = meridian
        .frusta()
        .iter()
        .map(|(edge, _)| Element {
            points: edge.ends().map(|[r, z]| [r * scale, z * scale]).to_vec(),
        })
        .collect();
    Meridian::new(&elements).unwrap()
}

/// All shapes, about 4 scale units wide, with whether n points out of a convex body.
fn shapes(scale: f64) -> Vec<(Shape, bool)> {
    let at = |r: f64, z: f64| [r * scale, z * scale];
    let plane = |extent: Extent| {
        Shape::Plane(
            Plane::new(DVec3::splat(0.1 * scale), DVec3::new(1.0, 2.0, 3.0), extent).unwrap(),
        )
    };
    vec![
        (plane(Extent::Infinite), true),
        (plane(Extent::Half), true),
        (plane(Extent::Rectangle { half_u: scale, half_v: 2.0 * scale }), true),
        (Shape::ground(0.2 * scale, scale, scale).unwrap(), true),
        (Shape::annulus(0.3 * scale, 0.5 * scale, 2.0 * scale).unwrap(), true),
        (Shape::cylinder(1.7 * scale, -scale, 0.7 * scale).unwrap(), true),
        (Shape::frustum(at(0.0, 1.0), at(2.0, -0.5)).unwrap(), true),
        (Shape::frustum(at(0.4, 0.3), at(1.9, 0.3001)).unwrap(), false),
        (Shape::frustum(at(1.0, 1.0), at(1.0001, -1.0)).unwrap(), true),
        (Shape::frustum(at(1.0, 1.0), at(0.7, -1.0)).unwrap(), true),
        (Shape::sphere(-0.4 * scale, 2.0 * scale).unwrap(), true),
        (
            Shape::sphere_zones(-scale, 2.0 * scale, &[scale, 0.5 * scale, 0.1 * scale]).unwrap(),
            true,
        ),
        (
            Shape::cuboid(DVec3::new(-1.0, -2.0, 0.1) * scale, DVec3::new(0.5, 2.0, 1.0) * scale)
                .unwrap(),
            true,
        ),
        (Shape::arc(at(0.0, 1.0), at(1.0, 0.0), at(-1.0, -1.0), Bend::Clockwise).unwrap(), true),
        (Shape::arc(at(1.4, 0.5), at(1.4, -0.5), at(1.4, 0.0), Bend::Clockwise).unwrap(), false),
        (
            Shape::arc(at(0.2, 0.8), at(1.7, -0.7), at(1.7, 0.8), Bend::Counterclockwise).unwrap(),
            false,
        ),
        (Shape::revolution(&scaled(&staircase(17), scale)), false),
        (Shape::revolution(&scaled(&teeth(17, 45.0, 10.0), scale)), false),
    ]
}

fn random_ray(rng: &mut rand_pcg::Pcg64, scale: f64) -> Ray {
    // Aimed at a point near the shapes, from a distance of up to 20 units, at all angles.
    let target = DVec3::new(unit(rng) - 0.5, unit(rng) - 0.5, unit(rng) - 0.5) * (4.0 * scale);
    let direction = isotropic(rng);
    Ray { origin: target - direction * (scale * 20.0 * unit(rng).powi(3)), direction }
}

#[test]
fn a_ray_that_leaves_a_surface_does_not_meet_it_again() {
    let mut rng = stream(100, 0);
    let (mut tested, mut grazing) = (0, 0);
    for _ in 0..1000 {
        let scale = 10f64.powf(12.0 * unit(&mut rng) - 6.0);
        let offset = RELATIVE_PAD * 20.0 * scale;
        for (shape, convex) in shapes(scale) {
            for _ in 0..4 {
                let ray = random_ray(&mut rng, scale);
                let Some(hit) = shape.intersect(&ray, EVERYWHERE, Sides::Both) else {
                    continue;
                };
                let (point, normal) = shape.settle(ray.at(hit.distance), hit.primitive);
                assert!((point - ray.at(hit.distance)).length() < 1e-7 * scale);
                for side in Side::BOTH {
                    // Every third direction grazes to a billionth.
                    let mut local = cosine(&mut rng, 1.0);
                    if unit(&mut rng) < 0.3 {
                        local.z *= 1e-9;
                        grazing += 1;
                    }
                    let away = normal * side.sign();
                    let next = Ray {
                        origin: point + away * offset,
                        direction: about(away, local).normalize(),
                    };
                    let sides = if side == Side::Inner { Sides::Inner } else { Sides::Outer };
                    let reach = Reach { from: -4.0 * offset, to: f64::INFINITY };
                    let again = shape.intersect(&next, reach, sides);
                    tested += 1;
                    let Some(again) = again else { continue };
                    let leaves = convex && side == Side::Outer;
                    assert!(!leaves, "scale {scale:e}, {shape:?}: {again:?} after {hit:?}");
                    // On a hollow side the same piece may be met far away, never at once: a chord
                    // grows with the angle to the surface, at least as 2 · (smallest radius of
                    // curvature) · cos θ.
                    let here = again.primitive == hit.primitive && local.z > 1e-3;
                    assert!(
                        !here || again.distance > 1e-6 * scale * local.z,
                        "scale {scale:e}: {again:?} after {hit:?}"
                    );
                }
            }
        }
    }
    assert!(tested > 40_000 && grazing > 10_000, "{tested} {grazing}");
}

#[test]
fn chord_of_a_sphere_and_a_cylinder_is_exact() {
    let mut rng = stream(101, 0);
    let sphere = Shape::sphere(0.3, 2.0).unwrap();
    let cylinder = Shape::cylinder(1.7, -1e9, 1e9).unwrap();
    for _ in 0..10_000 {
        let local = cosine(&mut rng, 1.0);
        let out = isotropic(&mut rng);
        let ray =
            Ray { origin: DVec3::new(0.0, 0.0, 0.3) + out * 2.0, direction: about(-out, local) };
        let reach = Reach { from: -1e-12, to: f64::INFINITY };
        let hit = sphere.intersect(&ray, reach, Sides::Inner).unwrap();
        assert!((hit.distance - 4.0 * local.z).abs() < 1e-13);
        let flat = DVec3::new(out.x, out.y, 0.0).normalize();
        let ray = Ray { origin: flat * 1.7, direction: about(-flat, local) };
        let across = ray.direction.x.hypot(ray.direction.y);
        let hit = cylinder.intersect(&ray, reach, Sides::Inner).unwrap();
        assert!((hit.distance * across * across - 3.4 * local.z).abs() < 1e-12);
    }
}

/// A hit as it should be: on the shape, with d·n of the sign that its side says.
fn check_hit(shape: &Shape, ray: &Ray, hit: &Intersection) {
    let (point, normal) = shape.settle(ray.at(hit.distance), hit.primitive);
    assert!((normal.length() - 1.0).abs() < 1e-12);
    assert!((point - ray.at(hit.distance)).length() < 1e-9);
    assert!(ray.direction.dot(normal) * hit.side.sign() < 1e-9, "{hit:?}");
}

#[test]
fn sides_tell_from_where_a_ray_comes() {
    let mut rng = stream(102, 0);
    for (shape, _) in shapes(1.0) {
        let mut hits = [0, 0];
        for _ in 0..20_000 {
            let ray = random_ray(&mut rng, 1.0);
            let both = shape.intersect(&ray, EVERYWHERE, Sides::Both);
            let inner = shape.intersect(&ray, EVERYWHERE, Sides::Inner);
            let outer = shape.intersect(&ray, EVERYWHERE, Sides::Outer);
            for (hit, side) in [(inner, Side::Inner), (outer, Side::Outer)] {
                if let Some(hit) = hit {
                    assert_eq!(hit.side, side);
                    check_hit(&shape, &ray, &hit);
                    hits[side.index()] += 1;
                }
            }
            let nearest = [inner, outer]
                .into_iter()
                .flatten()
                .min_by(|a, b| a.distance.total_cmp(&b.distance));
            assert_eq!(both, nearest);
        }
        assert!(hits[0] > 50 && hits[1] > 50, "{shape:?}: {hits:?}");
    }
}

#[test]
#[ignore = "slow: 6 s"]
fn marching_through_a_relief_finds_what_testing_all_segments_finds() {
    // The last one is no dome at all: a wavy, overhanging body.
    let wave: Vec<[f64; 2]> = (0..=60)
        .map(|k| {
            let s = f64::from(k) / 60.0;
            [
                2.0 * s + 0.08 * (40.0 * s).sin() * s,
                0.7 * (5.0 * s).cos() + 0.05 * (40.0 * s).cos() * s,
            ]
        })
        .collect();
    let reliefs = [
        staircase(17),
        staircase(170),
        teeth(17, 50.0, 70.0),
        teeth(17, 45.0, 10.0),
        teeth(170, 45.0, 10.0),
        Meridian::new(&[Element { points: wave }]).unwrap(),
    ];
    for (number, meridian) in reliefs.iter().enumerate() {
        let shape = Revolution::new(meridian);
        let mut rng = stream(103, number as u64);
        let mut hits = 0;
        for _ in 0..100_000 {
            // From far away, from within, and from the surface itself.
            let mut ray = random_ray(&mut rng, 0.6);
            if unit(&mut rng) < 0.3
                && let Some(hit) = shape.intersect_all(&ray, EVERYWHERE, Sides::Both)
            {
                ray = Ray { origin: ray.at(hit.distance), direction: isotropic(&mut rng) };
            }
            for sides in [Sides::Inner, Sides::Outer, Sides::Both] {
                let from = if unit(&mut rng) < 0.5 { 0.0 } else { -4e-12 };
                let to = if unit(&mut rng) < 0.5 { f64::INFINITY } else { 3.0 * unit(&mut rng) };
                let reach = Reach { from, to };
                let (fast, slow) =
                    (shape.intersect(&ray, reach, sides), shape.intersect_all(&ray, reach, sides));
                match (fast, slow) {
                    (Some(a), Some(b)) => {
                        assert!(a == b || (a.distance - b.distance).abs() <= 0.0, "{a:?} {b:?}");
                    }
                    (a, b) => assert_eq!(a, b),
                }
                hits += usize::from(fast.is_some());
            }
        }
        assert!(hits > 30_000, "{hits}");
    }
}

#[test]
fn closed_bodies_do_not_leak() {
    let paths = if cfg!(debug_assertions) { 20_000 } else { 1_000_000 };
    let domes = [
        Dome::smooth(&CAP),
        Dome::relief(staircase(17)),
        Dome::relief(staircase(170)),
        Dome::relief(teeth(17, 50.0, 70.0)),
        Dome::relief(teeth(170, 45.0, 10.0)),
    ];
    for (seed, dome) in domes.into_iter().enumerate() {
        // With little absorption inside, rays make many bounces each. (Without any, 2e-5 of them
        // circle in a staircase for ever: level treads and upright risers keep |d_z|, and both
        // reflect totally.)
        let scene = array(&package(N, dome, 0.99, 0.99), 2, 4.0).build().unwrap();
        let outcome = trace(&scene, &[], &Settings::new(paths, seed as u64));
        let lost = outcome.total.ledger.lost;
        assert!(lost.iter().all(|&power| power <= 0.0), "dome {seed}: {lost:?}");
        assert!(outcome.hits > outcome.paths);
    }
}

#[test]
fn rays_at_seams_do_not_leak() {
    // From inside, straight at the vertices of a relief and at the edge where side and bottom meet,
    // and past them by up to 1e-9.
    let meridian = teeth(17, 45.0, 10.0);
    let dome = Shape::revolution(&meridian);
    let side = Shape::cylinder(CAP.rim, -2e-9, meridian.end()[1]).unwrap();
    let bottom = Shape::annulus(0.0, 0.0, CAP.rim + 2e-9).unwrap();
    let mut corners: Vec<[f64; 2]> =
        meridian.frusta().iter().map(|(edge, _)| edge.ends()[1]).collect();
    corners.push([CAP.rim, 0.0]);
    let mut rng = stream(104, 0);
    for round in 0..200_000 {
        let [r, z] = corners[round % corners.len()];
        let phi = std::f64::consts::TAU * unit(&mut rng);
        let target = DVec3::new(r * phi.cos(), r * phi.sin(), z);
        let shake = 10f64.powf(-9.0 - 8.0 * unit(&mut rng));
        let origin =
            DVec3::new(unit(&mut rng) - 0.5, unit(&mut rng) - 0.5, 0.3 * unit(&mut rng) + 0.01);
        let direction = (target + isotropic(&mut rng) * shake - origin).normalize();
        let ray = Ray { origin, direction };
        let met = dome.intersect(&ray, EVERYWHERE, Sides::Inner).is_some()
            || side.intersect(&ray, EVERYWHERE, Sides::Inner).is_some()
            || bottom.intersect(&ray, EVERYWHERE, Sides::Outer).is_some();
        assert!(met, "{ray:?} aimed at r = {r}, z = {z}");
    }
}

#[test]
fn elements_carry_their_own_optics() {
    // Only element 6 is an interface, all others absorb: what leaves, leaves there.
    let parts = (1..=17)
        .map(|k| {
            let optics = if k == 6 { SurfaceModel::Interface } else { SurfaceModel::Absorber };
            Patch::new(format!("element {k}"), optics)
        })
        .collect();
    let mut package = package(N, Dome::Relief(staircase(17), parts), 0.95, 0.86);
    package.side = SurfaceModel::Absorber;
    let outcome =
        trace(&array(&package, 1, 8.3).build().unwrap(), &[], &Settings::new(many() / 20, 105));
    let ledger = &outcome.total.ledger;
    for (name, line) in ledger.named_surfaces() {
        assert_eq!(line.outward > 0.0, name == "element 6", "{name}");
    }
    assert!(ledger.extraction() > 0.01 && ledger.extraction() < 0.1);
    assert!(ledger.surface("element 5").unwrap().absorbed > 0.01);
}

#[test]
fn zones_of_a_smooth_dome_split_its_power() {
    // The same dome in one piece and in 17: the same rays, the same power, now told apart.
    let whole = array(&package(N, Dome::smooth(&CAP), 0.95, 0.86), 2, 8.3).build().unwrap();
    let zones = (1..=17)
        .map(|k| (0.1 * f64::from(k), Patch::new(format!("band {k}"), SurfaceModel::Interface)))
        .collect();
    let split = array(&package(N, Dome::Zones(zones), 0.95, 0.86), 2, 8.3).build().unwrap();
    let settings = Settings::new(many() / 20, 106);
    let (whole, split) = (trace(&whole, &[], &settings), trace(&split, &[], &settings));
    let bands: Vec<f64> = (1..=17)
        .map(|k| split.total.ledger.surface(&format!("band {k}")).unwrap().outward)
        .collect();
    assert!(bands.iter().all(|&power| power > 1e-3));
    let sum: f64 = bands.iter().sum();
    assert!((sum - whole.total.ledger.surface("dome").unwrap().outward).abs() < 1e-12);
    assert_eq!(whole.hits, split.hits);
}

#[test]
fn hierarchy_and_list_of_instances_give_the_same_bits() {
    let (far, plane) = (FarField::default(), PlaneMap::centred(3.0, 0.5, 60, 60).unwrap());
    for (dome, side, pitch) in [
        (Dome::smooth(&CAP), 7, 3.4),
        (Dome::smooth(&CAP), 1, 8.3),
        (Dome::smooth(&CAP), 12, 8.3),
        (Dome::relief(staircase(17)), 4, 3.5),
    ] {
        let mut scene = array(&package(N, dome, 0.95, 0.86), side, pitch);
        let settings = Settings::new(many() / 100, 107);
        let mut outcome = |search: InstanceSearch| {
            trace(&scene.search(search).build().unwrap(), &[&far, &plane], &settings)
        };
        let linear = outcome(InstanceSearch::Linear);
        assert!(linear == outcome(InstanceSearch::Hierarchy), "{side} × {side}");
        assert!(linear == outcome(InstanceSearch::Automatic));
    }
}

#[test]
fn frames_are_meridional() {
    let mut rng = stream(108, 0);
    for (shape, _) in shapes(1.0) {
        for _ in 0..2000 {
            let ray = random_ray(&mut rng, 1.0);
            let Some(hit) = shape.intersect(&ray, EVERYWHERE, Sides::Both) else {
                continue;
            };
            let (point, normal) = shape.settle(ray.at(hit.distance), hit.primitive);
            let frame = shape.frame(point, normal);
            assert!((frame.t.cross(frame.b) - frame.n).length() < 1e-12);
            assert!((frame.n - normal).length() < 1e-12);
            if shape.radius().is_some() {
                let radial = DVec3::new(point.x, point.y, 0.0).normalize();
                // b is azimuthal; t goes outward where n looks up, and down where n looks outward.
                assert!((frame.b - DVec3::Z.cross(radial)).length() < 1e-9);
                assert!((frame.t.dot(radial) - normal.z).abs() < 1e-9);
                assert!((frame.t.z + normal.dot(radial)).abs() < 1e-9);
            }
        }
    }
    // On the axis: the frame at azimuth 0.
    let sphere = Shape::sphere(0.0, 1.0).unwrap();
    assert_eq!(sphere.frame(DVec3::Z, DVec3::Z).t, DVec3::X);
}

#[test]
fn zero_length_segments_are_refused() {
    assert!(Frustum::new([1.0, 2.0], [1.0, 2.0]).is_err());
    assert!(Frustum::new([-0.1, 0.0], [1.0, 0.0]).is_err());
    assert!(Frustum::new([f64::NAN, 0.0], [1.0, 0.0]).is_err());
}
