// SPDX-License-Identifier: MIT OR Apache-2.0
//! Packages that are not round are judged by their shapes where the boxes around them share space:
//! what is clear of its neighbours is accepted, what is not is refused.
//!
//! Source: geometry; for boxes the theorem of separating axes, for others points within.

use crate::common::placed::{at, brick, turned};
use tracer::glam::{DMat3, DVec3};
use tracer::random::{isotropic, stream, unit};
use tracer::shape::{Closing, Element, Placement};
use tracer::{
    Emission, Emitter, Error, Medium, Meridian, Prototype, Region, Scene, SceneBuilder, Shape,
    Source, Surface, SurfaceModel,
};

fn closed(shape: Shape) -> Prototype {
    Prototype {
        surfaces: vec![Surface::new(
            "solid",
            shape,
            Region::Opaque,
            Region::World,
            &SurfaceModel::Absorber,
        )],
        ..Prototype::default()
    }
}

fn built(kinds: &[Prototype], places: &[(usize, DVec3)]) -> Result<Scene, Error> {
    let mut scene = SceneBuilder::new(Medium::air());
    let ids: Vec<_> = kinds.iter().map(|k| scene.prototype(k.clone())).collect();
    for (kind, place) in places {
        scene.place(ids[*kind], *place);
    }
    let sky = DVec3::new(0.0, 0.0, 99.0);
    let (point, all) = (Emitter::Point, Emission::Isotropic);
    scene.source(Source::new("sky", sky, Region::World, point, all));
    scene.build()
}

/// True if bodies are accepted; what is wrong can only be that they overlap.
fn fits(kinds: &[Prototype], places: &[(usize, DVec3)]) -> bool {
    match built(kinds, places) {
        Ok(_) => true,
        Err(Error::Overlap { .. }) => false,
        Err(other) => panic!("{other}"),
    }
}

/// A rod whose axis leans towards x by 30°, its middle at the origin.
fn rod(radius: f64, half: f64, placement: &Placement) -> Shape {
    let pieces = vec![
        Shape::annulus(half, 0.0, radius).unwrap(),
        Shape::cylinder(radius, -half, half).unwrap(),
        Shape::frustum([radius, -half], [0.0, -half]).unwrap(),
    ];
    Shape::placed(pieces, Closing::Closed, placement).unwrap()
}

fn leaning() -> Placement {
    let lean = 30f64.to_radians();
    at([0.0; 3], DMat3::from_rotation_y(lean), 0.0)
}

fn hexagonal(pitch: f64, count: usize) -> Vec<(usize, DVec3)> {
    let place = |k: usize| {
        let (row, column) = ((k / count) as f64, (k % count) as f64);
        let x = pitch * (column + 0.5 * (row % 2.0));
        DVec3::new(x, pitch * 0.75f64.sqrt() * row, 0.0)
    };
    (0..count * count).map(|k| (0, place(k))).collect()
}

#[test]
fn slanted_rods_may_stand_as_near_as_they_do_not_cut() {
    let kinds = [closed(rod(0.4, 2.0, &leaning()))];
    let touch = 0.8 / 30f64.to_radians().cos();
    for (pitch, good) in [(1.0, true), (touch, true), (touch - 1e-6, false), (0.85, false)] {
        assert_eq!(fits(&kinds, &hexagonal(pitch, 4)), good, "{pitch}");
    }
    let Err(Error::Overlap { first, second, distance_mm, needed_mm }) =
        built(&kinds, &hexagonal(0.85, 4))
    else {
        panic!("refused");
    };
    assert_eq!((first, second), (0, 1));
    assert!((distance_mm - 0.85).abs() < 1e-12 && needed_mm > distance_mm);
    // Ten thousand, one of which leans the other way.
    let mut kinds = kinds.to_vec();
    let mut many = hexagonal(1.0, 100);
    assert!(fits(&kinds, &many));
    let other = at([0.0; 3], DMat3::from_rotation_y(-30f64.to_radians()), 0.0);
    kinds.push(closed(rod(0.4, 2.0, &other)));
    many[5050].0 = 1;
    assert!(!fits(&kinds, &many));
}

#[test]
fn boxes_turned_by_an_eighth_touch_along_their_faces() {
    let eighth = DMat3::from_rotation_z(45f64.to_radians());
    let kinds = [closed(brick([0.5, 0.5, 0.2], &at([0.0; 3], eighth, 0.0)))];
    for (pitch, good) in [(1.0, true), (1.01, true), (1.0 - 1e-6, false), (0.8, false)] {
        let along = [eighth.x_axis * pitch, eighth.y_axis * pitch];
        let places: Vec<_> = (0..16)
            .map(|k| (0, along[0] * f64::from(k / 4) + along[1] * f64::from(k % 4)))
            .collect();
        assert_eq!(fits(&kinds, &places), good, "{pitch}");
    }
}

#[test]
fn what_lies_within_another_is_refused() {
    let large = closed(brick([1.0; 3], &at([0.0; 3], turned(), 0.0)));
    let small = closed(brick([0.1; 3], &at([0.3, 0.1, 0.2], DMat3::IDENTITY, 0.0)));
    let kinds = [large, small];
    for order in [[0, 1], [1, 0]] {
        let places = order.map(|kind| (kind, DVec3::ZERO));
        assert!(!fits(&kinds, &places));
    }
    assert!(!fits(&kinds, &[(0, DVec3::ZERO), (0, DVec3::ZERO)]));
    // Within the walls of six sheets, whose hulls hold nothing.
    let walls = (0..6).map(|face| {
        let normal = turned() * DVec3::AXES[face / 2] * if face % 2 == 0 { 1.0 } else { -1.0 };
        let extent = tracer::shape::Extent::Rectangle { half_u: 1.0, half_v: 1.0 };
        let placed = at((normal).to_array(), DMat3::IDENTITY, 0.0).along(normal).unwrap();
        let sheet = Shape::Plane(tracer::shape::Plane::new(DVec3::ZERO, DVec3::Z, extent).unwrap());
        let wall = Shape::placed(vec![sheet], Closing::Open, &placed).unwrap();
        Surface::new("wall", wall, Region::Opaque, Region::World, &SurfaceModel::Absorber)
    });
    let room = Prototype { surfaces: walls.collect(), ..Prototype::default() };
    let kinds = [room, kinds[1].clone()];
    assert!(!fits(&kinds, &[(0, DVec3::ZERO), (1, DVec3::ZERO)]));
    assert!(!fits(&kinds, &[(1, DVec3::ZERO), (0, DVec3::ZERO)]));
}

/// By how much two boxes overlap: the least over all directions that can tell.
fn overlap(half: [DVec3; 2], axes: [DMat3; 2], apart: DVec3) -> f64 {
    let columns = |m: DMat3| [m.x_axis, m.y_axis, m.z_axis];
    let [a, b] = axes.map(columns);
    let crossed = a.into_iter().flat_map(|u| b.map(|v| u.cross(v)));
    let all = a.into_iter().chain(b).chain(crossed);
    let reach = |n: DVec3, k: usize| {
        let of = [a, b][k];
        (0..3).map(|axis| half[k][axis] * of[axis].dot(n).abs()).sum::<f64>()
    };
    all.map(DVec3::normalize_or_zero)
        .filter(|n| *n != DVec3::ZERO)
        .map(|n| reach(n, 0) + reach(n, 1) - apart.dot(n).abs())
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn boxes_at_random_are_accepted_where_an_axis_separates_them() {
    let mut rng = stream(921, 0);
    let mut found = [0; 2];
    for _ in 0..4000 {
        let mut half = || DVec3::new(unit(&mut rng), unit(&mut rng), unit(&mut rng)) + 0.05;
        let halves = [half(), half()];
        let axes =
            [0, 1].map(|_| DMat3::from_axis_angle(isotropic(&mut rng), 6.0 * unit(&mut rng)));
        let apart = isotropic(&mut rng) * (2.5 * unit(&mut rng));
        let depth = overlap(halves, axes, apart);
        if depth.abs() < 1e-7 {
            continue;
        }
        let kinds =
            [0, 1].map(|k| closed(brick(halves[k].to_array(), &at([0.0; 3], axes[k], 0.0))));
        let good = fits(&kinds, &[(0, DVec3::ZERO), (1, apart)]);
        assert_eq!(good, depth < 0.0, "{depth}: {halves:?} {axes:?} {apart}");
        found[usize::from(good)] += 1;
    }
    assert!(found.iter().all(|count| *count > 800), "{found:?}");
}

#[test]
fn rods_cones_and_balls_at_random_that_share_a_point_are_refused() {
    let mut rng = stream(922, 0);
    let (mut found, mut near) = ([0; 2], 0);
    for number in 0..3000 {
        let shapes = [0, 1].map(|_| {
            let place = at(
                [0.0; 3],
                DMat3::from_axis_angle(isotropic(&mut rng), 6.0 * unit(&mut rng)),
                0.0,
            );
            let (r, z) = (0.1 + unit(&mut rng), 0.1 + unit(&mut rng));
            match (unit(&mut rng) * 4.0) as u32 {
                0 => rod(r, z, &place),
                1 => {
                    let points = vec![[0.0, z], [r, -z], [0.0, -z]];
                    let cone = Meridian::new(&[Element { points }]).unwrap();
                    Shape::placed(vec![Shape::revolution(&cone)], Closing::Closed, &place).unwrap()
                }
                2 => {
                    let ball = Shape::sphere(0.3, r).unwrap();
                    Shape::placed(vec![ball], Closing::Closed, &place).unwrap()
                }
                _ => brick([r, z, 0.5], &place),
            }
        });
        let apart = isotropic(&mut rng) * (3.0 * unit(&mut rng));
        // Balls stand in the same place as round bodies do; they are judged by their radii.
        let kinds = shapes.clone().map(closed);
        let good = fits(&kinds, &[(0, DVec3::ZERO), (1, apart)]);
        found[usize::from(good)] += 1;
        let (a, b) = (shapes[0].bounds(), shapes[1].bounds().moved(apart));
        let (low, high) = (a.low.max(b.low), a.high.min(b.high));
        let mut shared = false;
        for _ in 0..2000 {
            let part = DVec3::new(unit(&mut rng), unit(&mut rng), unit(&mut rng));
            let point = low + part * (high - low);
            let within = low.cmple(high).all();
            shared |= within && shapes[0].holds(point) && shapes[1].holds(point - apart);
        }
        assert!(!(good && shared), "{number}: {apart}");
        near += u32::from(!good && !shared);
    }
    assert!(found.iter().all(|count| *count > 500), "{found:?}");
    // Refused though no point was found: thin overlaps.
    assert!(near < 150, "{near} of {found:?}");
}

#[test]
fn sheets_in_one_plane_may_touch_but_not_overlap() {
    for rotation in [DMat3::IDENTITY, turned()] {
        let place = at([0.0; 3], rotation, 0.0);
        let extent = tracer::shape::Extent::Rectangle { half_u: 1.5, half_v: 0.5 };
        let sheet = tracer::shape::Plane::new(DVec3::ZERO, DVec3::Z, extent).unwrap();
        let sheet = Shape::placed(vec![Shape::Plane(sheet)], Closing::Open, &place).unwrap();
        // Something that stands on it, so that boxes tell nothing.
        let post = brick([0.1, 0.1, 0.5], &at((rotation.z_axis * 0.8).to_array(), rotation, 0.0));
        let mut kind = closed(post);
        kind.surfaces.push(Surface::new(
            "sheet",
            sheet,
            Region::World,
            Region::World,
            &SurfaceModel::Absorber,
        ));
        for (pitch, good) in [(2.0, false), (2.999, false), (3.0, true), (3.1, true)] {
            let places = [(0, DVec3::ZERO), (0, rotation.x_axis * pitch)];
            assert_eq!(fits(std::slice::from_ref(&kind), &places), good, "{pitch}");
        }
    }
}
