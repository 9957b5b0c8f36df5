// SPDX-License-Identifier: MIT OR Apache-2.0
//! Closed bodies of every kind of surface, for rays that must not get lost in them. Each absorbs a
//! little on the way and at its mirrors, so that a path meets many surfaces and yet ends.

use crate::common::package::Dome;
use tracer::glam::DVec3;
use tracer::shape::{Extent, Mesh, Plane};
use tracer::{
    Emission, Emitter, Medium, Patch, Prototype, Region, Shape, Source, Surface, SurfaceModel,
};

use crate::common::{BODY, CAP, N, cap_triangles, inside, meshed_cap, package, staircase, teeth};

fn dome(dome: Dome) -> Prototype {
    package(N, dome, 0.99, 0.99).prototype().unwrap()
}

/// A slanted room of six planes; `reach` is by how much they pass their neighbours, `None` for
/// endless ones.
fn room(reach: Option<f64>) -> Prototype {
    let half = DVec3::new(1.0, 0.8, 0.6);
    let x = DVec3::new(0.8, 0.36, 0.48).normalize();
    let axes = [x, x.any_orthonormal_pair().0, x.any_orthonormal_pair().1];
    let mirror = SurfaceModel::Mirror { reflectance: 0.9 };
    let planes = (0..6).map(|face| {
        let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
        let extent = reach.map_or(Extent::Infinite, |reach| {
            let max = half.max_element() * (2.0 + reach);
            Extent::Rectangle { half_u: max, half_v: max }
        });
        let normal = axes[axis] * sign;
        let shape = Shape::Plane(Plane::new(normal * half[axis], normal, extent).unwrap());
        Surface::new("wall", shape, BODY, Region::Opaque, &mirror)
    });
    Prototype {
        media: vec![Medium::clear("air", 1.0)],
        surfaces: planes.collect(),
        sources: vec![inside(DVec3::ZERO, Emitter::Point, Emission::Isotropic)],
    }
}

/// Balls and a mesh, one in the other: three media that light passes between.
fn shells() -> Prototype {
    let medium = |k: u8| Region::Body(k);
    let ball = |z: f64, radius: f64| Shape::sphere(z, radius).unwrap();
    let (vertices, triangles) = cap_triangles(8, 24);
    let vertices: Vec<DVec3> = vertices.iter().map(|v| (*v - DVec3::Z * 0.4) * 0.3).collect();
    let mesh = Mesh::new(&vertices, &triangles, &vec![0; triangles.len()]).unwrap();
    let interface = SurfaceModel::Interface;
    let mirror = SurfaceModel::Mirror { reflectance: 0.8 };
    let surfaces = vec![
        Surface::new("wall", ball(0.0, 2.0), medium(0), Region::Opaque, &mirror),
        Surface::new("shell", ball(0.2, 1.5), medium(1), medium(0), &interface),
        Surface::new("core", ball(0.1, 1.0), medium(2), medium(1), &interface),
        Surface::zoned(
            Shape::mesh(mesh),
            medium(3),
            medium(2),
            vec![Patch::new("mesh", interface.clone())],
        ),
    ];
    let media = [("gap", 1.0), ("glass", 1.5), ("oil", 1.41), ("stone", 2.2)];
    Prototype {
        media: media.map(|(name, n)| Medium::clear(name, n)).to_vec(),
        surfaces,
        sources: vec![Source::new(
            "lamp",
            DVec3::ZERO,
            medium(3),
            Emitter::Point,
            Emission::Isotropic,
        )],
    }
}

/// Names and bodies; the large mesh has this many triangles.
pub fn bodies(triangles: usize) -> Vec<(&'static str, Prototype)> {
    let mut bodies = vec![
        ("smooth dome, side, box", dome(Dome::smooth(&CAP))),
        ("17 steps", dome(Dome::relief(staircase(17)))),
        ("170 steps", dome(Dome::relief(staircase(170)))),
        ("17 teeth", dome(Dome::relief(teeth(17, 50.0, 70.0)))),
        ("mesh", meshed_cap(triangles, Emission::Isotropic)),
        ("six endless planes", room(None)),
        ("six rectangles", room(Some(1e-9))),
        ("shells and a mesh, nested", shells()),
    ];
    for (_, body) in &mut bodies {
        // In the nest light goes round by total reflection.
        let per_mm = if body.media.len() > 1 { 0.3 } else { 1e-3 };
        for medium in &mut body.media {
            *medium = medium.clone().absorbing(per_mm);
        }
    }
    bodies
}
