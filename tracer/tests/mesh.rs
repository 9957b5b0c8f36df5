// SPDX-License-Identifier: MIT OR Apache-2.0
//! Meshes: closed ones lose no ray and emit as the exact shape does; open and inverted ones are
//! refused by name.

use crate::common::{cap_triangles, meshed_cap, mirrored_cap, single, trace};
use rand::Rng;
use tracer::glam::DVec3;
use tracer::random::{isotropic, stream, unit};
use tracer::shape::{Mesh, MeshError, Reach, Sides};
use tracer::{Emission, Error, FarField, Ray, Settings, Shape};

const OPEN: Reach = Reach { from: 0.0, to: f64::INFINITY };

fn cap(rings: usize, sides: usize, scale: f64) -> Mesh {
    let (vertices, triangles) = cap_triangles(rings, sides);
    let vertices: Vec<DVec3> = vertices.iter().map(|v| *v * scale).collect();
    Mesh::new(&vertices, &triangles, &vec![0; triangles.len()]).unwrap()
}

#[test]
fn the_far_field_is_that_of_the_exact_cap() {
    let far = FarField::new(6.0, 360.0).unwrap();
    let scenes = [
        single(meshed_cap(200_000, Emission::LAMBERTIAN)),
        single(mirrored_cap(Emission::LAMBERTIAN)),
    ];
    let [mesh, exact] =
        [0, 1].map(|k| trace(&scenes[k], &[&far], &Settings::new(300_000, 3 + k as u64)));
    assert!(mesh.total.ledger.lost_total() <= 0.0);
    let mut chi2 = 0.0;
    let rows: Vec<_> = mesh.bins(0).into_iter().zip(exact.bins(0)).take(15).collect();
    for (a, b) in &rows {
        chi2 += ((a.value - b.value) / a.standard_error.hypot(b.standard_error)).powi(2);
    }
    let freedom = rows.len() as f64;
    assert!(chi2 < freedom + 5.0 * (2.0 * freedom).sqrt(), "{chi2}");
    let up = |outcome: &tracer::Outcome| outcome.mean(|totals| totals.ledger.escaped_up);
    let (a, b) = (up(&mesh), up(&exact));
    assert!((a.value - b.value).abs() < 5.0 * a.standard_error.hypot(b.standard_error));
}

#[test]
fn no_ray_of_a_million_leaks() {
    let scene = single(meshed_cap(5_000, Emission::Isotropic));
    let outcome = trace(&scene, &[], &Settings::new(700_000, 8));
    assert!(outcome.hits > 1_000_000, "{}", outcome.hits);
    assert!(outcome.total.ledger.lost_total() <= 0.0);
}

/// Rays from inside, half of them aimed at edges and corners, always meet the mesh, and where the
/// search over all triangles says.
#[test]
fn the_hierarchy_finds_what_all_triangles_hold() {
    let (vertices, triangles) = cap_triangles(7, 24);
    let mesh = cap(7, 24, 1.0);
    let mut rng = stream(21, 0);
    for number in 0..20_000 {
        let origin =
            DVec3::new(unit(&mut rng) - 0.5, unit(&mut rng) - 0.5, 0.05 + 0.5 * unit(&mut rng));
        let [a, b, c] =
            triangles[rng.next_u64() as usize % triangles.len()].map(|k| vertices[k as usize]);
        let direction = match number % 4 {
            0 => (a - origin).normalize(),
            1 => (a.lerp(b, unit(&mut rng)) - origin).normalize(),
            2 => (c.lerp(b, 0.5) - origin).normalize(),
            _ => isotropic(&mut rng),
        };
        let ray = Ray { origin, direction };
        let shape = Shape::mesh(mesh.clone());
        let hit = shape.intersect(&ray, OPEN, Sides::Inner).expect("a hit from inside");
        let all = mesh.intersect_all(&ray, OPEN, Sides::Inner).expect("a hit from inside");
        assert!((hit.distance - all.distance).abs() < 1e-13, "{hit:?} {all:?}");
        // From far outside it is met on the way in.
        let outside = Ray { origin: origin - direction * 1e4, direction };
        let entry = shape.intersect(&outside, OPEN, Sides::Outer);
        assert!(entry.is_some_and(|hit| hit.distance < 1e4), "{outside:?}");
    }
}

/// A scaled mesh stays one, is met where all of its triangles say, and turns light as the plain one does
/// at the plain places.
#[test]
fn a_scaled_mesh_is_met_where_its_triangles_are() {
    let mesh = cap(7, 24, 1.0).smoothed(60.0);
    let plain = Shape::mesh(mesh.clone());
    let mut rng = stream(22, 0);
    for factor in [0.5, 1.7, 2.0] {
        let shape = plain.scaled(factor).expect("finite");
        let Shape::Mesh(scaled) = &shape else { panic!("{shape:?}") };
        assert_eq!(scaled.triangles(), mesh.triangles());
        let mut others = 0;
        for _ in 0..5_000 {
            let origin =
                DVec3::new(unit(&mut rng) - 0.5, unit(&mut rng) - 0.5, 0.05 + 0.3 * unit(&mut rng));
            let ray = Ray { origin, direction: isotropic(&mut rng) };
            let wide = Ray { origin: factor * origin, ..ray };
            let hit = shape.intersect(&wide, OPEN, Sides::Inner).expect("a hit from inside");
            let all = scaled.intersect_all(&wide, OPEN, Sides::Inner).expect("a hit from inside");
            assert!((hit.distance - all.distance).abs() < 1e-13, "{hit:?} {all:?}");
            let there = plain.intersect(&ray, OPEN, Sides::Inner).expect("a hit from inside");
            assert!((hit.distance - factor * there.distance).abs() < 1e-12, "{hit:?} {there:?}");
            let (_, normal) = shape.settle(wide.at(hit.distance), hit.primitive);
            let (_, expected) = plain.settle(ray.at(there.distance), there.primitive);
            // Rays through an edge may take either of its faces.
            others += usize::from((normal - expected).length() > 1e-12);
        }
        assert!(others < 5, "{factor}: {others}");
        let [low, high] = [plain.bounds().low, plain.bounds().high].map(|end| factor * end);
        assert_eq!((shape.bounds().low, shape.bounds().high), (low, high));
    }
}

/// A ray that leaves a triangle on either side does not meet it again, whatever the size of the
/// mesh.
#[test]
fn a_triangle_just_left_is_not_met_again() {
    let mut rng = stream(22, 0);
    for _ in 0..1000 {
        let scale = 10_f64.powf(12.0 * unit(&mut rng) - 6.0);
        let shape = Shape::mesh(cap(3, 8, scale));
        let origin = DVec3::new(0.1, 0.05, 0.3) * scale;
        let direction = isotropic(&mut rng);
        let ray = Ray { origin, direction };
        let hit = shape.intersect(&ray, OPEN, Sides::Inner).expect("a hit from inside");
        let (point, normal) = shape.settle(ray.at(hit.distance), hit.primitive);
        let offset = 1e-12 * 2.0 * scale;
        let reach = Reach { from: -4.0 * offset, to: f64::INFINITY };
        for (side, sides) in [(-1.0, Sides::Inner), (1.0, Sides::Outer)] {
            let mut away = isotropic(&mut rng);
            if away.dot(normal) * side < 0.0 {
                away = -away;
            }
            let start = Ray { origin: point + normal * (side * offset), direction: away };
            let again = shape.intersect(&start, reach, sides);
            assert!(
                again.is_none_or(|again| again.primitive != hit.primitive),
                "{scale} {again:?}"
            );
            // The cap is convex: outside there is nothing more, inside always something.
            assert_eq!(again.is_some(), side < 0.0, "{scale} {direction} {away}");
        }
    }
}

#[test]
fn what_is_no_solid_is_refused_by_name() {
    let (vertices, triangles) = cap_triangles(3, 8);
    let build = |vertices: &[DVec3], triangles: &[[u32; 3]]| {
        Mesh::new(vertices, triangles, &vec![0; triangles.len()]).map(|mesh| mesh.triangles())
    };
    assert_eq!(build(&vertices, &triangles), Ok(triangles.len()));

    let mut open = triangles.clone();
    open.remove(5);
    assert!(matches!(build(&vertices, &open), Err(MeshError::Open { open: 3, .. })));

    let mut turned = triangles.clone();
    turned[4].swap(0, 1);
    let error = build(&vertices, &turned).unwrap_err();
    assert!(
        matches!(error, MeshError::Inverted { first, second, .. } if first == 4 || second == 4),
        "{error}"
    );

    let all_turned: Vec<[u32; 3]> = triangles.iter().map(|[a, b, c]| [*b, *a, *c]).collect();
    let error = build(&vertices, &all_turned).unwrap_err();
    assert!(matches!(error, MeshError::InsideOut { volume } if volume < -1.0), "{error}");

    let mut doubled = triangles.clone();
    doubled.push(triangles[0]);
    let error = build(&vertices, &doubled).unwrap_err();
    assert!(matches!(error, MeshError::NonManifold { count: 3, .. }), "{error}");

    let mut flat = triangles.clone();
    flat[7][1] = flat[7][0];
    let error = build(&vertices, &flat).unwrap_err();
    assert!(matches!(error, MeshError::Degenerate { triangle: 7, .. }), "{error}");

    let mut far = vertices.clone();
    far[6].x = f64::NAN;
    let error = build(&far, &triangles).unwrap_err();
    assert!(matches!(error, MeshError::NotFinite { vertex: 6, .. }), "{error}");

    let mut missing = triangles.clone();
    missing[2][2] = 999;
    let error = build(&vertices, &missing).unwrap_err();
    assert!(matches!(error, MeshError::NoVertex { triangle: 2, vertex: 999, .. }), "{error}");
    assert!(build(&vertices, &triangles[..3]).is_err());
    assert!(Mesh::new(&vertices, &triangles, &[0]).is_err());

    // As an error of the tracer it says the same.
    let error = build(&vertices, &open).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("open edge") && Error::from(error).to_string() == text);
}

#[test]
fn corners_without_numbers_are_welded() {
    let (vertices, triangles) = cap_triangles(4, 9);
    let soup: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(|k| vertices[k as usize])).collect();
    let welded = Mesh::welded(&soup, &vec![0; soup.len()]).unwrap();
    assert!(welded.triangles() == soup.len() && welded.convex());
    // Two caps apart from each other are no convex solid.
    let apart = soup.iter().map(|t| t.map(|v| v + DVec3::X * 9.0));
    let both: Vec<[DVec3; 3]> = soup.iter().copied().chain(apart).collect();
    assert!(!Mesh::welded(&both, &vec![0; both.len()]).unwrap().convex());
}

#[test]
fn meshes_that_cut_themselves_are_refused_with_a_place() {
    let (vertices, triangles) = cap_triangles(3, 8);
    let build = |vertices: &[DVec3], triangles: &[[u32; 3]]| {
        Mesh::new(vertices, triangles, &vec![0; triangles.len()]).map(|mesh| mesh.triangles())
    };
    // Two caps in one file, the second aside by less than a width, by more, and by so much that
    // they touch in a corner.
    let pair = |aside: DVec3| {
        let count = vertices.len() as u32;
        let both: Vec<DVec3> =
            vertices.iter().copied().chain(vertices.iter().map(|v| *v + aside)).collect();
        let shifted = triangles.iter().map(|t| t.map(|v| v + count));
        let all: Vec<[u32; 3]> = triangles.iter().copied().chain(shifted).collect();
        build(&both, &all)
    };
    let rim = vertices.iter().map(|v| v.x).fold(0.0, f64::max);
    for free in [4.0, 2.0 * rim, 2.0 * rim + 1e-6] {
        assert_eq!(pair(DVec3::X * free), Ok(2 * triangles.len()));
    }
    for cut in [DVec3::new(2.0 * rim - 1e-3, 0.0, 0.0), DVec3::new(1.0, 0.4, 0.3)] {
        let error = pair(cut).unwrap_err();
        let MeshError::CutsItself { first, second, at } = error else { panic!("{error}") };
        let half = triangles.len();
        assert!((first < half) != (second < half), "{first} {second}");
        let place = DVec3::from_array(at);
        assert!(place.is_finite() && place.length() < 5.0, "{place}");
        assert!(error.to_string().contains("cut each other at ["), "{error}");
    }

    // A single corner pushed through the wall on the other side.
    let mut folded = vertices.clone();
    let near = (0..folded.len()).find(|k| folded[*k].x > 1.0 && folded[*k].z > 0.3).unwrap();
    folded[near] = DVec3::new(-2.5, 0.1, 0.5);
    let error = build(&folded, &triangles).unwrap_err();
    assert!(matches!(error, MeshError::CutsItself { .. }), "{error}");

    // A shell within a shell is a hollow solid.
    let count = vertices.len() as u32;
    let within = vertices.iter().map(|v| *v * 0.5 + DVec3::Z * 0.2);
    let both: Vec<DVec3> = vertices.iter().copied().chain(within).collect();
    let turned = triangles.iter().map(|[a, b, c]| [b + count, a + count, c + count]);
    let all: Vec<[u32; 3]> = triangles.iter().copied().chain(turned).collect();
    assert_eq!(build(&both, &all), Ok(2 * triangles.len()));
}

/// The outline of a cap over its height is that of its polygon: the area within, and nothing off
/// the plane.
#[test]
fn a_section_is_closed_and_has_the_area_of_the_solid() {
    let mesh = cap(20, 60, 1.0);
    let area = |line: &[DVec3]| -> f64 {
        line.iter()
            .zip(line.iter().cycle().skip(1))
            .map(|(a, b)| 0.5 * (a.x * b.z - b.x * a.z))
            .sum::<f64>()
            .abs()
    };
    // A segment of the circle of radius 2 with a half angle of 60 degrees.
    let exact = 0.5 * 4.0 * (2.0 * std::f64::consts::FRAC_PI_3 - 0.75_f64.sqrt());
    let lines = mesh.section(DVec3::ZERO, DVec3::Y);
    assert_eq!(lines.len(), 1);
    assert!(lines[0].iter().all(|at| at.y.abs() < 1e-12));
    let share = area(&lines[0]) / exact;
    assert!(share > 0.995 && share < 1.0, "{share}");
    assert!(mesh.section(DVec3::Y * 3.0, DVec3::Y).is_empty());
    // A level cut of two solids in one mesh is two lines.
    let (vertices, triangles) = cap_triangles(3, 8);
    let count = vertices.len() as u32;
    let aside = vertices.iter().map(|v| *v + DVec3::X * 5.0);
    let both: Vec<DVec3> = vertices.iter().copied().chain(aside).collect();
    let more = triangles.iter().map(|t| t.map(|v| v + count));
    let all: Vec<[u32; 3]> = triangles.iter().copied().chain(more).collect();
    let two = Mesh::new(&both, &all, &vec![0; all.len()]).unwrap();
    let lines = two.section(DVec3::Z * 0.2, DVec3::Z);
    assert_eq!(lines.iter().map(Vec::len).collect::<Vec<_>>(), [16, 16]);
}
