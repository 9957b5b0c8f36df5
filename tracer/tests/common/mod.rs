// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shared by the physics tests and the benches: numbers of paths, judgement in standard errors,
//! small scenes.
#![allow(dead_code, reason = "each test binary and bench uses its own part of this module")]

pub mod package;
pub mod placed;

use std::f64::consts::{FRAC_PI_3, TAU};

use self::package::{Cap, Dome, Package};
use bsdf::{Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarisation, Side, Transport};
use tracer::glam::DVec3;
use tracer::package::ground;
use tracer::shape::{Element, Mesh};
use tracer::{
    Detector, Emission, Emitter, LedBox, Medium, Meridian, Outcome, Patch, Prototype, PrototypeId,
    Receiver, Region, Scene, SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, run,
};

/// Index of silicone.
pub const N: f64 = 1.41;

/// The medium inside of a body.
pub const BODY: Region = Region::Body(0);

/// The dome of the paper.
pub const CAP: Cap = Cap { radius: 2.0, apex: 1.0, rim: 1.7 };

/// Paths of a test: those of `BATWING_TEST_PATHS`, or 2.5 million where the code is optimised and fewer
/// where it is not.
pub fn many() -> u64 {
    let stated = std::env::var("BATWING_TEST_PATHS").ok();
    let stated = stated.map(|number| number.parse().expect("BATWING_TEST_PATHS: a number"));
    stated.unwrap_or(if cfg!(debug_assertions) { 100_000 } else { 2_500_000 })
}

/// Fails where a run has lost anything.
pub fn assert_none_lost(what: &str, outcome: &Outcome) {
    let ledger = &outcome.total.ledger;
    assert!(ledger.lost_total() <= 0.0, "{what}: {:?}", ledger.lost);
}

/// Detectors as a run takes them.
pub fn receivers(detectors: &[Detector]) -> Vec<&dyn Receiver> {
    detectors.iter().map(|d| d as &dyn Receiver).collect()
}

/// Traces and checks that all power is accounted for.
pub fn trace(scene: &Scene, receivers: &[&dyn Receiver], settings: &Settings) -> Outcome {
    let outcome = run(scene, receivers, settings).unwrap();
    let ledger = &outcome.total.ledger;
    assert!(ledger.imbalance().abs() < 1e-11, "imbalance {:e}", ledger.imbalance());
    assert!((ledger.emitted - scene.power()).abs() < 1e-12);
    outcome
}

/// |estimate - p| < 5 √(p (1 - p)/paths) + `quadrature`.
pub fn assert_share(what: &str, estimate: f64, expected: f64, paths: u64, quadrature: f64) {
    let bound =
        5.0 * (expected * (1.0 - expected) / paths as f64).max(0.0).sqrt() + quadrature + 1e-12;
    assert!(
        (estimate - expected).abs() < bound,
        "{what}: {estimate} instead of {expected}, off by {:e}, allowed {bound:e}",
        estimate - expected
    );
}

/// The cosine-rule refraction of an interface, without Fresnel losses: passes all below the
/// critical angle, absorbs the rest.
pub struct NoFresnel {
    pub inner: f64,
    pub outer: f64,
}

impl NoFresnel {
    fn refracted(&self, wi: DVec3) -> Option<DVec3> {
        let from = Side::from_direction(wi);
        let ratio = self.index(from) / self.index(from.opposite());
        let (x, y) = (-ratio * wi.x, -ratio * wi.y);
        let z2 = 1.0 - x * x - y * y;
        (z2 > 0.0).then(|| DVec3::new(x, y, from.opposite().sign() * z2.sqrt()))
    }
}

const THROUGH: Lobe = Lobe { transport: Transport::Transmission, kind: LobeKind::Specular };

impl Bsdf for NoFresnel {
    fn sample(&self, wi: DVec3, _rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        self.refracted(wi).map(|wo| BsdfSample { wo, weight: 1.0, lobe: THROUGH })
    }

    fn pdf(&self, _wi: DVec3, _sample: &BsdfSample) -> Option<f64> {
        Some(1.0)
    }

    fn lobes(&self, wi: DVec3, _polarisation: Polarisation) -> Vec<OutgoingLobe> {
        self.refracted(wi)
            .map(|wo| OutgoingLobe { wo, power: 1.0, lobe: THROUGH })
            .into_iter()
            .collect()
    }

    fn index(&self, side: Side) -> f64 {
        [self.inner, self.outer][side.index()]
    }
}

/// A scene of one prototype at the origin, in air.
pub fn single(prototype: Prototype) -> Scene {
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(prototype);
    scene.place(id, DVec3::ZERO).build().unwrap()
}

/// A body of silicone with one source inside.
pub fn lamp(index: f64, surfaces: Vec<Surface>, source: Source) -> Prototype {
    Prototype { media: vec![Medium::clear("silicone", index)], surfaces, sources: vec![source] }
}

/// A source at `position` in a body.
pub fn inside(position: DVec3, emitter: Emitter, emission: Emission) -> Source {
    Source::new("LED", position, BODY, emitter, emission)
}

/// The package of the paper with the reflectances of its bottom and its box.
pub fn package(index: f64, dome: Dome, bottom: f64, led: f64) -> Package {
    Package {
        cap: CAP,
        silicone: Medium::clear("silicone", index),
        dome,
        side: SurfaceModel::Interface,
        bottom: SurfaceModel::Mirror { reflectance: bottom },
        led: LedBox {
            size: DVec3::new(1.0, 1.0, 0.35),
            side: SurfaceModel::Mirror { reflectance: led },
            top: SurfaceModel::Mirror { reflectance: led },
        },
    }
}

/// A cap of radius 2 about z = -1 over a mirror of reflectance 0.95 at z = 0, with a source on a
/// square of 1 mm at z = 0.35 and nothing else.
pub fn mirrored_cap(emission: Emission) -> Prototype {
    let rim = f64::sqrt(3.0);
    let dome = Shape::sphere_zones(-1.0, 2.0, &[1.0, 0.0]).unwrap();
    let base = Shape::annulus(0.0, 0.0, rim * (1.0 + 1e-9)).unwrap();
    let mirror = SurfaceModel::Mirror { reflectance: 0.95 };
    let surfaces = vec![
        Surface::new("dome", dome, BODY, Region::World, &SurfaceModel::Interface),
        Surface::new("mirror", base, Region::Opaque, BODY, &mirror),
    ];
    let square = Emitter::Rectangle { half_x: 0.5, half_y: 0.5 };
    lamp(N, surfaces, inside(DVec3::Z * 0.35, square, emission))
}

/// Vertices and triangles of the cap of radius 2 about z = -1 with its base at z = 0: `sides`
/// vertices on each of `rings` rings, base last, as a fan of `sides` triangles.
pub fn cap_triangles(rings: usize, sides: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut vertices = vec![DVec3::Z];
    for ring in 1..=rings {
        let theta = FRAC_PI_3 * ring as f64 / rings as f64;
        // The last ring at z = 0 to the bit.
        let z = if ring == rings { 0.0 } else { 2.0 * theta.cos() - 1.0 };
        for side in 0..sides {
            let (sin, cos) = (TAU * side as f64 / sides as f64).sin_cos();
            let r = 2.0 * theta.sin();
            vertices.push(DVec3::new(r * cos, r * sin, z));
        }
    }
    let middle = vertices.len() as u32;
    vertices.push(DVec3::ZERO);
    let at = |ring: usize, side: usize| (1 + ring * sides + side % sides) as u32;
    let mut triangles = Vec::new();
    for k in 0..sides {
        triangles.push([0, at(0, k), at(0, k + 1)]);
        for ring in 0..rings - 1 {
            triangles.push([at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)]);
            triangles.push([at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)]);
        }
    }
    for k in 0..sides {
        triangles.push([middle, at(rings - 1, k + 1), at(rings - 1, k)]);
    }
    (vertices, triangles)
}

/// [`mirrored_cap`] as one closed mesh of about `count` triangles, its base the mirror.
pub fn meshed_cap(count: usize, emission: Emission) -> Prototype {
    // Triangles about as wide as high: the arc is 1.05 times the mean radius of a turn of 2π.
    let sides = ((count as f64 * 2.0).sqrt() as usize).max(3);
    let rings = (count / sides).div_ceil(2).max(2);
    let (vertices, triangles) = cap_triangles(rings, sides);
    let parts: Vec<u32> =
        (0..triangles.len()).map(|k| u32::from(k + sides >= triangles.len())).collect();
    let mesh = Shape::mesh(Mesh::new(&vertices, &triangles, &parts).unwrap());
    let optics = vec![
        Patch::new("dome", SurfaceModel::Interface),
        Patch::new("mirror", SurfaceModel::Mirror { reflectance: 0.95 }),
    ];
    let square = Emitter::Rectangle { half_x: 0.5, half_y: 0.5 };
    lamp(
        N,
        vec![Surface::zoned(mesh, BODY, Region::World, optics)],
        inside(DVec3::Z * 0.35, square, emission),
    )
}

/// A square array of packages over a mirror of reflectance 0.95.
pub fn array(package: &Package, side: usize, pitch: f64) -> SceneBuilder {
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(package.prototype().unwrap());
    let half = 0.5 * pitch * side as f64;
    place_array(&mut scene, id, [side, side], pitch);
    scene.surface(
        ground(half, half, SurfaceModel::Mirror { reflectance: 0.95 }, SurfaceModel::Absorber)
            .unwrap(),
    );
    scene
}

/// Places `columns` × `rows` instances at distances of `pitch` mm along x and y, centred on the
/// origin.
pub fn place_array(
    scene: &mut SceneBuilder,
    prototype: PrototypeId,
    [columns, rows]: [usize; 2],
    pitch: f64,
) {
    let middle = |count: usize| 0.5 * (count as f64 - 1.0);
    for row in 0..rows {
        for column in 0..columns {
            let (x, y) = (column as f64 - middle(columns), row as f64 - middle(rows));
            scene.place(prototype, DVec3::new(x * pitch, y * pitch, 0.0));
        }
    }
}

/// A staircase on the dome of the paper.
pub fn staircase(steps: usize) -> Meridian {
    staircase_to(CAP.rim, steps)
}

/// A staircase on the dome of the paper from the axis to `rim` in equal steps: each a level tread
/// at the height of the dome at its inner end, then a riser down to the dome.
pub fn staircase_to(rim: f64, steps: usize) -> Meridian {
    let height = |r: f64| CAP.centre_z() + (CAP.radius * CAP.radius - r * r).sqrt();
    let at = |k: usize| rim * k as f64 / steps as f64;
    let elements: Vec<Element> = (0..steps)
        .map(|k| {
            let (inner, outer) = (at(k), at(k + 1));
            let (top, foot) = (height(inner), height(outer));
            Element { points: vec![[inner, top], [outer, top], [outer, foot]] }
        })
        .collect();
    Meridian::new(&elements).unwrap()
}

/// Triangles on the chords of the dome, with interior angles `inner` and `outer` (degrees) at the
/// base corners of all elements: with 10 degrees outside they lean out and overhang.
pub fn teeth(steps: usize, inner: f64, outer: f64) -> Meridian {
    let point = |k: usize| {
        let r = CAP.rim * k as f64 / steps as f64;
        [r, CAP.height(r)]
    };
    let elements: Vec<Element> = (0..steps)
        .map(|k| {
            let (a, b) = (point(k), point(k + 1));
            let (dr, dz) = (b[0] - a[0], b[1] - a[1]);
            let (tan_inner, tan_outer) = (inner.to_radians().tan(), outer.to_radians().tan());
            let along = tan_outer / (tan_inner + tan_outer);
            let height = along * tan_inner;
            let apex = [a[0] + along * dr - height * dz, a[1] + along * dz + height * dr];
            Element { points: vec![a, apex, b] }
        })
        .collect();
    Meridian::new(&elements).unwrap()
}

/// The black inside of a sphere about the origin, in twenty zones of equal area, "zone 0" highest.
pub fn furnace_wall(radius: f64) -> Surface {
    let bounds: Vec<f64> = (0..=20).map(|k| radius * (1.0 - 0.1 * f64::from(k))).collect();
    let wall = Shape::sphere_zones(0.0, radius, &bounds).unwrap();
    let parts = (0..20).map(|k| Patch::new(format!("zone {k}"), SurfaceModel::Absorber)).collect();
    Surface::zoned(wall, Region::World, Region::Opaque, parts)
}
