// SPDX-License-Identifier: MIT OR Apache-2.0
//! A ray that leaves a surface does not meet it again: every kind of surface in whole scenes of a
//! thousand random scales, in air and within a body, with different regions on both sides and with
//! the same.

use crate::common::{cap_triangles, staircase, teeth};
use bsdf::Side;
use tracer::glam::DVec3;
use tracer::random::{isotropic, stream, unit};
use tracer::shape::{Element, Extent, Mesh, Plane};
use tracer::{
    Emission, Emitter, Fate, Interaction, Medium, Meridian, Mixed, Observer, Prototype, Ray,
    Region, Scene, SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, trace_observed,
};

/// A shape, and on which of its sides (inner, outer) light that leaves it may meet it again.
type Case = (&'static str, Shape, [bool; 2]);

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

/// Every kind of shape, about 4 `scale` wide and off the origin.
fn cases(scale: f64) -> Vec<Case> {
    const NEVER: [bool; 2] = [false, false];
    const INSIDE: [bool; 2] = [true, false];
    const BOTH: [bool; 2] = [true, true];
    let at = |r: f64, z: f64| [r * scale, z * scale];
    let plane = |extent: Extent| {
        let point = DVec3::new(0.1, 0.2, 0.37) * scale;
        Shape::Plane(Plane::new(point, DVec3::new(1.0, 2.0, 3.0), extent).unwrap())
    };
    let rectangle = Extent::Rectangle { half_u: scale, half_v: 2.0 * scale };
    let corners = [DVec3::new(-1.0, -2.0, 0.1), DVec3::new(0.5, 2.0, 1.0)].map(|c| c * scale);
    let (vertices, triangles) = cap_triangles(3, 8);
    let vertices: Vec<DVec3> = vertices.iter().map(|v| *v * scale).collect();
    let mesh = Mesh::new(&vertices, &triangles, &vec![0; triangles.len()]).unwrap();
    let zones = [1.0, 0.5, 0.1].map(|z| z * scale);
    vec![
        ("plane", plane(Extent::Infinite), NEVER),
        ("half plane", plane(Extent::Half), NEVER),
        ("rectangle", plane(rectangle), NEVER),
        ("level", Shape::horizontal(0.3 * scale).unwrap(), NEVER),
        ("level at 0", Shape::ground(0.0, scale, scale).unwrap(), NEVER),
        ("annulus", Shape::annulus(0.3 * scale, 0.5 * scale, 2.0 * scale).unwrap(), NEVER),
        ("cylinder", Shape::cylinder(1.7 * scale, -scale, 0.7 * scale).unwrap(), INSIDE),
        ("cone", Shape::frustum(at(0.0, 1.0), at(2.0, -0.5)).unwrap(), INSIDE),
        ("shallow cone", Shape::frustum(at(0.4, 0.3), at(1.9, 0.2999)).unwrap(), INSIDE),
        ("steep cone", Shape::frustum(at(1.0, 1.0), at(1.0001, -1.0)).unwrap(), INSIDE),
        ("sphere", Shape::sphere(-0.4 * scale, 2.0 * scale).unwrap(), INSIDE),
        ("zones", Shape::sphere_zones(-scale, 2.0 * scale, &zones).unwrap(), INSIDE),
        ("box", Shape::cuboid(corners[0], corners[1]).unwrap(), INSIDE),
        ("steps", Shape::revolution(&scaled(&staircase(17), scale)), BOTH),
        ("teeth", Shape::revolution(&scaled(&teeth(17, 45.0, 10.0), scale)), BOTH),
        ("mesh", Shape::mesh(mesh), INSIDE),
    ]
}

/// Regions on both sides of a shape.
#[derive(Clone, Copy, Debug)]
enum Around {
    /// Air on both sides.
    Air,
    /// Opaque within, air without.
    Solid,
    /// Glass within, air without.
    Glass,
    /// The medium of a ball on both sides.
    Ball,
    /// Another glass within a ball.
    Nested,
}

const OUTER: Region = Region::Body(0);
const CORE: Region = Region::Body(1);

fn scene(shape: &Shape, around: Around, scale: f64) -> Scene {
    let ball = Shape::sphere(0.0, 30.0 * scale).unwrap();
    let regions = match around {
        Around::Air => [Region::World; 2],
        Around::Solid => [Region::Opaque, Region::World],
        Around::Glass => [CORE, Region::World],
        Around::Ball => [OUTER; 2],
        Around::Nested => [CORE, OUTER],
    };
    // Half of the light that a reflector returns is diffuse; interfaces, films and reflectors all
    // leave a surface at all angles.
    let optics = match around {
        Around::Air | Around::Solid | Around::Ball => {
            SurfaceModel::Mixed(Mixed { reflectance: 1.0, specular: 0.5 })
        }
        Around::Glass | Around::Nested => SurfaceModel::Interface,
    };
    let what = Surface::new("it", shape.clone(), regions[0], regions[1], &optics);
    let nested = matches!(around, Around::Ball | Around::Nested);
    let around = if nested { OUTER } else { Region::World };
    let mut surfaces = vec![what];
    if nested {
        let skin = Surface::new("ball", ball, OUTER, Region::World, &SurfaceModel::Interface);
        surfaces.push(skin);
    }
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype {
        media: vec![Medium::clear("ball", 1.41), Medium::clear("core", 1.8)],
        surfaces,
        sources: vec![Source::new(
            "lamp",
            DVec3::new(0.0, 0.0, 20.0 * scale),
            around,
            Emitter::Point,
            Emission::Lambertian { half_angle_deg: 0.1 },
        )],
    });
    // Off the origin, so that positions are rounded.
    scene.place(id, DVec3::new(1.3, -0.7, 0.0) * scale);
    scene.build().unwrap()
}

/// Judges each meeting by the one before.
struct Judge<'a> {
    what: String,
    again: [bool; 2],
    scale: f64,
    names: &'a [String],
    last: Option<(DVec3, Side)>,
    left: u64,
}

impl Observer for Judge<'_> {
    fn meets(&mut self, meeting: &Interaction) {
        if self.names[meeting.line] != "it" {
            self.last = None;
            return;
        }
        if let Some((point, side)) = self.last {
            assert!(
                self.again[side.index()],
                "{}: met again from {:?}, left on {side:?}",
                self.what,
                meeting.from
            );
            // On a hollow side it lies ahead; the other side can only be met by a ray that passed
            // through.
            assert_eq!(meeting.from, side, "{}", self.what);
            let far = point.distance(meeting.point) / self.scale;
            assert!(far > 1e-8, "{}: met again after {far:e}", self.what);
        }
        self.left += 1;
        self.last = Some((meeting.point, meeting.to));
    }

    fn ends(&mut self, _ray: &Ray, _fate: Fate, _weight: f64) {
        self.last = None;
    }
}

#[test]
fn no_surface_is_met_again_at_any_scale() {
    let mut rng = stream(300, 0);
    let mut left = [0_u64; 16];
    for round in 0..1000 {
        let scale = 10_f64.powf(12.0 * unit(&mut rng) - 6.0);
        for (number, (name, shape, again)) in cases(scale).into_iter().enumerate() {
            let closed = matches!(name, "sphere" | "box" | "mesh");
            let ways: &[Around] = if closed {
                &[Around::Air, Around::Glass, Around::Ball, Around::Nested]
            } else {
                &[Around::Air, Around::Solid, Around::Ball]
            };
            let around = ways[round % ways.len()];
            let scene = scene(&shape, around, scale);
            let mut judge = Judge {
                what: format!("{name} in {around:?} at scale {scale:e}"),
                again,
                scale,
                names: &scene.lines().surfaces,
                last: None,
                left: 0,
            };
            let settings = Settings { max_bounces: 40, ..Settings::new(6, round as u64) };
            let aim = |ray: Ray| {
                let at = DVec3::new(unit(&mut rng), unit(&mut rng), unit(&mut rng)) - 0.5;
                let direction = isotropic(&mut rng);
                // From the start of the source's ray in the frame of its body, about 20 scales
                // away.
                let place = if matches!(around, Around::Ball | Around::Nested) {
                    DVec3::ZERO
                } else {
                    ray.origin - DVec3::Z * 20.0 * scale
                };
                Ray { origin: place + (at * 4.0 - direction * 15.0) * scale, direction }
            };
            trace_observed(&scene, &settings, aim, &mut judge).unwrap();
            left[number] += judge.left;
        }
    }
    // What is small is missed by many.
    assert!(left.iter().all(|n| *n > 1000), "{left:?}");
}
