// SPDX-License-Identifier: MIT OR Apache-2.0
//! Turned arcs: what they are in special cases, what a fine polyline finds, and that domes and
//! bodies made of them leak nothing.
//!
//! Source: geometry; the tracer's own spheres and segments.

use crate::common::*;
use tracer::glam::DVec3;
use tracer::random::{isotropic, stream, unit};
use tracer::shape::{Bend, Element, Reach, Sides};
use tracer::{
    Emission, Emitter, Interior, LedBox, Loss, Medium, Meridian, Prototype, Ray, Region, Settings,
    Shape, Source, Surface, SurfaceModel,
};

const EVERYWHERE: Reach = Reach { from: 0.0, to: f64::INFINITY };

fn towards(rng: &mut rand_pcg::Pcg64, size: f64) -> Ray {
    let target = DVec3::new(unit(rng) - 0.5, unit(rng) - 0.5, unit(rng) - 0.5) * (2.0 * size);
    let direction = isotropic(rng);
    Ray { origin: target - direction * (size * 10.0 * unit(rng).powi(2)), direction }
}

#[test]
fn an_arc_about_the_axis_is_a_sphere() {
    let foot = 4f64.sqrt() * 0.6 - 1.0;
    let arc = Shape::arc([0.0, 1.0], [1.6, foot], [0.0, -1.0], Bend::Clockwise).unwrap();
    let sphere = Shape::sphere_zones(-1.0, 2.0, &[1.0, foot]).unwrap();
    let mut rng = stream(201, 0);
    let mut hits = 0;
    for _ in 0..100_000 {
        let ray = towards(&mut rng, 2.0);
        for sides in [Sides::Inner, Sides::Outer, Sides::Both] {
            let [a, b] = [&arc, &sphere].map(|shape| shape.intersect(&ray, EVERYWHERE, sides));
            match (a, b) {
                (Some(a), Some(b)) => {
                    assert!((a.distance - b.distance).abs() < 1e-8 && a.side == b.side);
                    let [a, b] = [&arc, &sphere].map(|s| s.settle(ray.at(a.distance), 0));
                    assert!((a.0 - b.0).length() < 1e-12 && (a.1 - b.1).length() < 1e-12);
                    hits += 1;
                }
                (a, b) => assert_eq!(a, b, "{ray:?}"),
            }
        }
    }
    assert!(hits > 20_000, "{hits}");
}

/// Arcs as pairs of an exact shape and the same in 4000 segments.
fn pairs() -> Vec<(Shape, Shape)> {
    let arcs = [
        // The outer half of a ring, its inner side, a hollow, a spindle, three quarters of a
        // circle.
        ([1.5, 0.5], [1.5, -0.5], [1.5, 0.0], Bend::Clockwise),
        ([1.0, -0.3], [1.0, 0.3], [1.2, 0.0], Bend::Clockwise),
        ([0.2, 1.0], [1.2, 0.0], [1.2, 1.0], Bend::Counterclockwise),
        ([0.0, 1.0], [std::f64::consts::SQRT_2 - 1.0, 0.0], [-1.0, 0.0], Bend::Clockwise),
        ([1.0, 0.0], [1.5, -0.5], [1.5, 0.0], Bend::Clockwise),
    ];
    let turn = |from: f64, to: f64, bend: Bend| match bend {
        Bend::Clockwise => -(from - to).rem_euclid(std::f64::consts::TAU),
        Bend::Counterclockwise => (to - from).rem_euclid(std::f64::consts::TAU),
    };
    arcs.into_iter()
        .map(|(start, end, centre, bend)| {
            let angle = |p: [f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
            let radius = (start[0] - centre[0]).hypot(start[1] - centre[1]);
            let by = turn(angle(start), angle(end), bend);
            let points = (0..=4000).map(|k| {
                let (sin, cos) = (angle(start) + by * f64::from(k) / 4000.0).sin_cos();
                [(centre[0] + radius * cos).max(0.0), centre[1] + radius * sin]
            });
            let element = Element { points: points.collect() };
            let fine = Shape::revolution(&Meridian::new(&[element]).unwrap());
            (Shape::arc(start, end, centre, bend).unwrap(), fine)
        })
        .collect()
}

#[test]
#[ignore = "nightly: arcs against fine polylines (22 s)"]
fn nightly_arcs_are_met_where_fine_polylines_are() {
    let pairs = pairs();
    std::thread::scope(|scope| {
        for (number, (arc, fine)) in pairs.iter().enumerate() {
            scope.spawn(move || met_where_the_polyline_is(number, arc, fine));
        }
    });
}

fn met_where_the_polyline_is(number: usize, arc: &Shape, fine: &Shape) {
    let mut rng = stream(202, number as u64);
    let (mut hits, mut unlike) = ([0; 2], 0);
    for _ in 0..20_000 {
        let ray = towards(&mut rng, 2.0);
        for sides in [Sides::Inner, Sides::Outer] {
            let [a, b] = [arc, fine].map(|shape| shape.intersect(&ray, EVERYWHERE, sides));
            match (a, b) {
                (Some(a), Some(b)) => {
                    assert_eq!(a.side, b.side);
                    hits[a.side.index()] += 1;
                    // Polylines lie up to 3e-7 inside; along grazing rays that is more.
                    let (point, normal) = arc.settle(ray.at(a.distance), 0);
                    assert!((point - ray.at(a.distance)).length() < 1e-9);
                    let towards = ray.direction.dot(normal);
                    assert!(towards * a.side.sign() < 1e-7);
                    let slack = 1e-5 + 2e-6 / towards.abs().max(1e-3);
                    unlike += u32::from((a.distance - b.distance).abs() > slack);
                }
                (a, b) => unlike += u32::from(a.is_some() != b.is_some()),
            }
        }
    }
    assert!(hits.iter().all(|h| *h > 200), "{number}: {hits:?}");
    // Grazing rays meet one and miss the other.
    assert!(f64::from(unlike) < 3e-4 * 20_000.0, "{number}: {unlike} of {hits:?}");
}

/// A freeform dome of arcs: a hollow at the axis, a bead, a foot that draws in; the package of the
/// paper inside.
fn freeform(index: f64, bottom: f64) -> Prototype {
    let (inside, air) = (Region::Body(0), Region::World);
    let arcs = [
        Shape::arc([0.0, 0.7], [0.8, 1.1], [0.0, 1.7], Bend::Counterclockwise),
        Shape::arc([0.8, 1.1], [1.8, 0.6], [1.0, 0.25], Bend::Clockwise),
        Shape::frustum([1.8, 0.6], [1.6, 0.0]),
    ];
    let mut prototype = Interior {
        rim: 1.6,
        foot: 0.0,
        size: 2.0,
        silicone: Medium::clear("silicone", index),
        side: SurfaceModel::Interface,
        bottom: SurfaceModel::Mirror { reflectance: bottom },
        led: LedBox {
            size: DVec3::new(0.8, 0.8, 0.3),
            side: SurfaceModel::Lambertian { reflectance: 1.0 },
            top: SurfaceModel::Lambertian { reflectance: 1.0 },
        },
    }
    .prototype()
    .unwrap();
    for arc in arcs {
        let arc = arc.expect("ends as far from the centre");
        prototype.surfaces.push(Surface::new("dome", arc, inside, air, &SurfaceModel::Interface));
    }
    prototype
}

#[test]
fn domes_of_arcs_leak_nothing() {
    let scene = single(freeform(1.41, 1.0));
    let outcome = trace(&scene, &[], &Settings::new(many() / 10, 5));
    let ledger = &outcome.total.ledger;
    assert!(ledger.imbalance().abs() < 1e-9);
    assert!(ledger.lost[Loss::Leak as usize] == 0.0, "{:?}", ledger.lost);
    assert!(ledger.lost[Loss::Invalid as usize] == 0.0, "{:?}", ledger.lost);
    // Nothing absorbs: what does not get caught for ever comes out.
    let out = outcome.jackknife(|t| t.ledger.extraction());
    assert!(out.value > 0.999, "{out:?}");
}

#[test]
fn a_closed_ring_keeps_what_starts_inside() {
    // A whole torus of two arcs; light of one radiance inside of it, no index: straight out, once.
    let arcs = [
        Shape::arc([1.5, 0.5], [1.5, -0.5], [1.5, 0.0], Bend::Clockwise).unwrap(),
        Shape::arc([1.5, -0.5], [1.5, 0.5], [1.5, 0.0], Bend::Clockwise).unwrap(),
    ];
    let surface = |arc: &Shape| {
        let optics = SurfaceModel::Lambertian { reflectance: 0.5 };
        Surface::new("wall", arc.clone(), Region::Body(0), Region::Opaque, &optics)
    };
    let source =
        Source::new("lamp", DVec3::X * 1.3, Region::Body(0), Emitter::Point, Emission::Isotropic);
    let scene = single(lamp(1.0, arcs.iter().map(surface).collect(), source));
    let outcome = trace(&scene, &[], &Settings::new(many() / 20, 6));
    let ledger = &outcome.total.ledger;
    assert!(ledger.lost_total() <= 0.0, "{:?}", ledger.lost);
    assert!(ledger.escaped_up + ledger.escaped_down <= 0.0);
}

#[test]
fn a_hollow_just_left_is_not_met_again() {
    // A ray of air whose allowance behind its start ends on the hollow that it left.
    let hollow = Shape::arc([0.0, 0.7], [0.8, 1.1], [0.0, 1.7], Bend::Counterclockwise).unwrap();
    let ray = Ray {
        origin: DVec3::new(
            -0.153_906_011_722_538_9,
            0.442_519_484_630_209_3,
            0.816_546_863_000_263_1,
        ),
        direction: DVec3::new(
            -0.576_518_499_706_457_5,
            0.509_614_067_145_505,
            0.638_686_090_394_672_7,
        ),
    };
    for k in 0..4000 {
        let reach = Reach { from: -1e-15 * f64::from(5_200 + k), to: f64::INFINITY };
        assert_eq!(hollow.intersect(&ray, reach, Sides::Outer), None);
    }
}

#[test]
fn curves_that_begin_away_from_the_axis_are_passed_inside() {
    let element = Element { points: vec![[1.8, 0.6], [1.7, 0.3], [1.6, 0.0]] };
    let wall = Shape::revolution(&Meridian::new(&[element]).unwrap());
    let mut rng = stream(203, 0);
    let (mut out, mut past) = (0, 0);
    for _ in 0..10_000 {
        let direction = isotropic(&mut rng);
        let ray = Ray { origin: DVec3::new(0.1, 0.2, 0.3), direction };
        match wall.intersect(&ray, EVERYWHERE, Sides::Both) {
            Some(hit) => {
                let at = ray.at(hit.distance);
                assert!((0.0..=0.6).contains(&at.z) && at.truncate().length() > 1.59);
                out += 1;
            }
            None => past += 1,
        }
    }
    assert!(out > 1000 && past > 5000, "{out} {past}");
}
