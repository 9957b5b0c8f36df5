// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shapes turned and moved to any place: they are met where the same shapes at home are, refract as
//! Snell's law says, nest in each other without loss, and are met by the light of all packages.
//!
//! Source: the shapes at home; exact refraction at a ball; one radiance everywhere within a white
//! furnace.

use std::f64::consts::PI;

use crate::common::package::Dome;
use crate::common::placed::{at, brick, disc, in_furnace, turned};
use crate::common::*;
use bsdf::Side;
use tracer::glam::{DMat3, DVec3};
use tracer::shape::{
    Bounds, Clip, Closing, Element, Extent, Foot, Mesh, Placement, Plane, Reach, Sides,
};
use tracer::{
    Emission, Emitter, Fate, Interaction, Medium, Meridian, Observer, Prototype, Ray, Region,
    SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, random, trace_observed,
};

const WHOLE: Reach = Reach { from: 0.0, to: f64::INFINITY };

fn ball(radius: f64, placement: &Placement) -> Shape {
    let sphere = Shape::sphere(0.0, radius).unwrap();
    Shape::placed(vec![sphere], Closing::Closed, placement).unwrap()
}

fn rod(radius: f64, half: f64, placement: &Placement) -> Shape {
    let points = vec![[0.0, half], [radius, half], [radius, -half], [0.0, -half]];
    let meridian = Meridian::new(&[Element { points }]).unwrap();
    let pieces = vec![Shape::revolution(&meridian)];
    Shape::placed(pieces, Closing::Closed, placement).unwrap()
}

/// Rays from everywhere to everywhere about the origin.
fn rays(count: usize) -> impl Iterator<Item = Ray> {
    let mut rng = random::stream(17, 0);
    (0..count).map(move |_| {
        let origin = random::isotropic(&mut rng) * (3.0 * random::unit(&mut rng));
        let target = random::isotropic(&mut rng) * random::unit(&mut rng);
        Ray { origin, direction: (target - origin).normalize() }
    })
}

#[test]
fn a_placed_shape_is_met_where_the_shape_at_home_is() {
    let rotation = turned();
    let origin = DVec3::new(0.3, -0.2, 0.5);
    let points = vec![[0.0, 0.9], [0.6, 0.5], [0.5, -0.1], [0.8, -0.6], [0.0, -0.7]];
    let vase = Shape::revolution(&Meridian::new(&[Element { points }]).unwrap());
    let homes = [
        Shape::sphere(0.2, 0.8).unwrap(),
        Shape::cuboid(DVec3::new(-0.4, -0.7, -0.2), DVec3::new(0.5, 0.3, 0.9)).unwrap(),
        vase,
        Shape::annulus(0.1, 0.2, 0.9).unwrap(),
    ];
    for home in homes {
        let placement = Placement { rotation, ..Placement::at(origin) };
        let away = Shape::placed(vec![home.clone()], Closing::Open, &placement).unwrap();
        let mut met = 0;
        for ray in rays(20_000) {
            let there =
                Ray { origin: origin + rotation * ray.origin, direction: rotation * ray.direction };
            for sides in [Sides::Inner, Sides::Outer, Sides::Both] {
                let (a, b) =
                    (home.intersect(&ray, WHOLE, sides), away.intersect(&there, WHOLE, sides));
                let (Some(a), Some(b)) = (a, b) else {
                    // What one meets by its edge the other may miss by rounding.
                    assert_eq!(a.is_some(), b.is_some(), "{ray:?}");
                    continue;
                };
                let (p, n) = home.settle(ray.at(a.distance), a.primitive);
                // Rounding moves places where a ray grazes.
                let slack = 1e-11 / ray.direction.dot(n).abs().max(1e-6).powi(2);
                assert!((a.distance - b.distance).abs() < slack && a.side == b.side);
                let (q, m) = away.settle(there.at(b.distance), b.primitive);
                assert!((origin + rotation * p - q).length() < slack);
                // Near the axis a body of revolution turns its normal fast.
                let radius = p.truncate().length().max(1e-6);
                assert!((rotation * n - m).length() < slack / radius);
                let (frame, local) = (away.frame(q, m), home.frame(p, n));
                assert!((frame.t - rotation * local.t).length() < 10.0 * slack / radius);
                assert!((frame.t.cross(frame.b) - m).length() < 1e-12);
                let Bounds { low, high } = away.bounds();
                assert!(q.cmpge(low - 1e-9).all() && q.cmple(high + 1e-9).all());
                met += 1;
            }
        }
        assert!(met > 5_000, "{met}");
    }
}

#[test]
fn an_inset_draws_outer_faces_in_and_nothing_else() {
    let inset = 1e-3;
    let shape = brick([0.5, 1.0, 0.25], &at([1.0, 0.0, 2.0], DMat3::IDENTITY, inset));
    let Bounds { low, high } = shape.bounds();
    assert!((low - DVec3::new(0.501, -0.999, 1.751)).length() < 1e-12);
    assert!((high - DVec3::new(1.499, 0.999, 2.249)).length() < 1e-12);
    let down = Ray { origin: DVec3::new(1.2, 0.3, 5.0), direction: -DVec3::Z };
    let hit = shape.intersect(&down, WHOLE, Sides::Both).unwrap();
    assert!((hit.distance - 2.751).abs() < 1e-12 && hit.side == Side::Outer);
    // A ball becomes a smaller ball.
    let small = ball(0.5, &at([0.0, 0.0, 1.0], turned(), inset));
    for ray in rays(1000) {
        if let Some(hit) = small.intersect(&ray, WHOLE, Sides::Both) {
            let (point, normal) = small.settle(ray.at(hit.distance), hit.primitive);
            assert!((point.distance(DVec3::Z) - 0.499).abs() < 1e-12);
            assert!((normal - (point - DVec3::Z) / 0.499).length() < 1e-12);
        }
    }
}

/// The foot goes down by the inset, below the plane of the stated one; all else stays.
#[test]
fn a_foot_is_sunk_by_the_inset() {
    let inset = 1e-3;
    let quarter = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
    for rotation in [DMat3::IDENTITY, quarter] {
        let raised = at([1.0, 0.0, 2.0], rotation, inset);
        let sunk = Placement { foot: Foot::Sunk, ..raised };
        let [before, after] = [raised, sunk].map(|p| brick([0.5, 1.0, 0.25], &p).bounds());
        assert!((after.high - before.high).length() < 1e-12);
        assert!((after.low - before.low + DVec3::Z * (2.0 * inset)).length() < 1e-12);
    }
}

#[test]
fn what_is_no_placement_is_refused() {
    let sphere = || vec![Shape::sphere(0.0, 1.0).unwrap()];
    let build = |placement: &Placement| Shape::placed(sphere(), Closing::Closed, placement);
    let stretched = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.1));
    for (placement, word) in [
        (at([0.0, f64::NAN, 0.0], DMat3::IDENTITY, 0.0), "place of a shape"),
        (at([0.0; 3], stretched, 0.0), "rotation"),
        (at([0.0; 3], DMat3::from_diagonal(-DVec3::ONE), 0.0), "rotation"),
        (at([0.0; 3], DMat3::IDENTITY, 1.0), "inset"),
        (at([0.0; 3], DMat3::IDENTITY, -1e-6), "inset"),
    ] {
        let said = build(&placement).expect_err(word).to_string();
        assert!(said.contains(word), "{said}");
    }
    let leaning = Placement { foot: Foot::Sunk, ..at([0.0; 3], turned(), 0.0) };
    let said = build(&leaning).expect_err("leans").to_string();
    assert!(said.contains("expected one axis upright"), "{said}");
    assert!(Shape::placed(Vec::new(), Closing::Closed, &Placement::at(DVec3::ZERO)).is_err());
    let plane = vec![Shape::horizontal(0.0).unwrap()];
    assert!(Shape::placed(plane, Closing::Open, &Placement::at(DVec3::ZERO)).is_err());
}

/// Keeps the direction in which paths that met two surfaces left, with their starts.
#[derive(Default)]
struct Through {
    met: usize,
    start: DVec3,
    seen: Vec<(DVec3, DVec3)>,
}

impl Observer for Through {
    fn begins(&mut self, ray: &Ray) {
        (self.met, self.start) = (0, ray.origin);
    }

    fn meets(&mut self, _meeting: &Interaction) {
        self.met += 1;
    }

    fn ends(&mut self, ray: &Ray, fate: Fate, _weight: f64) {
        if self.met == 2 && matches!(fate, Fate::EscapedUp | Fate::EscapedDown) {
            self.seen.push((self.start, ray.direction));
        }
    }
}

fn solid(name: &str, shape: Shape, inner: Region, outer: Region, optics: &SurfaceModel) -> Surface {
    Surface::new(name, shape, inner, outer, optics)
}

/// Index and radius of a ball lens, the point in front of it from whose axis heights count.
const LENS: (f64, f64) = (1.7, 0.4);
const FAR: DVec3 = DVec3::new(0.7, -0.3, -5.0);

fn middle_of_lens() -> Placement {
    at([0.7, -0.3, 1.1], turned(), 0.0)
}

/// Light parallel to the axis at heights up to nine tenths of the radius through the lens `shape`.
fn through_lens(shape: Shape) -> Through {
    let (index, radius) = LENS;
    let lens = Prototype {
        media: vec![Medium::clear("glass", index)],
        surfaces: vec![solid("ball", shape, BODY, Region::World, &SurfaceModel::Interface)],
        sources: Vec::new(),
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(lens);
    scene.place(id, DVec3::ZERO);
    scene.source(Source::new("lamp", FAR, Region::World, Emitter::Point, Emission::Isotropic));
    let scene = scene.build().unwrap();
    let mut through = Through::default();
    let mut number = 0;
    let aim = |ray: Ray| {
        number += 1;
        let height = 0.9 * radius * f64::from(number % 100) / 100.0;
        Ray { origin: ray.origin + DVec3::new(0.6, 0.8, 0.0) * height, direction: DVec3::Z }
    };
    trace_observed(&scene, &Settings::new(2000, 3), aim, &mut through).unwrap();
    assert!(through.seen.len() > 1000);
    through
}

/// Heights, and how far each direction is off that by Snell's law.
fn errors_of_lens(through: &Through) -> Vec<(f64, f64)> {
    let (index, radius) = LENS;
    let error = |(start, direction): &(DVec3, DVec3)| {
        let height = (*start - FAR).length();
        let sin = height / radius;
        let turn = 2.0 * (sin.asin() - (sin / index).asin());
        let expected = DVec3::new(-0.6 * turn.sin(), -0.8 * turn.sin(), turn.cos());
        // Near the axis it crosses it at n R/(2 (n - 1)) from the middle.
        if height > 0.0 && height < 0.02 * radius {
            let focus = index * radius / (2.0 * (index - 1.0));
            let back = height * (turn - sin.asin()).cos() / turn.tan();
            assert!((back / focus - 1.0).abs() < 2e-3, "{back} {focus}");
        }
        (height, (*direction - expected).length())
    };
    through.seen.iter().map(error).collect()
}

#[test]
fn a_ball_lens_anywhere_bends_rays_as_snell_says() {
    let through = through_lens(ball(LENS.1, &middle_of_lens()));
    for (height, error) in errors_of_lens(&through) {
        assert!(error < 1e-10, "{height}: {error}");
    }
}

/// A ball of triangles between circles of latitude and longitude, `sides` around.
fn meshed_ball(radius: f64, sides: usize) -> Mesh {
    let rings = sides / 2;
    let point = |ring: usize, side: usize| {
        let theta = PI * ring as f64 / rings as f64;
        let phi = 2.0 * PI * (side % sides) as f64 / sides as f64;
        let ends = ring == 0 || ring == rings;
        let across = if ends { 0.0 } else { theta.sin() };
        radius * DVec3::new(across * phi.cos(), across * phi.sin(), theta.cos())
    };
    let mut triangles = Vec::new();
    for (ring, side) in (0..rings).flat_map(|ring| (0..sides).map(move |side| (ring, side))) {
        let [a, b] = [side, side + 1].map(|side| point(ring, side));
        let [c, d] = [side, side + 1].map(|side| point(ring + 1, side));
        if ring > 0 {
            triangles.push([a, c, b]);
        }
        if ring + 1 < rings {
            triangles.push([b, c, d]);
        }
    }
    let patches = vec![0; triangles.len()];
    Mesh::welded(&triangles, &patches).expect("a ball")
}

/// A mesh with smooth normals against the ball: root mean squares of what directions are off.
#[test]
fn smooth_normals_bend_rays_as_the_ball_does() {
    let rms = |mesh: Mesh| {
        let placement = middle_of_lens();
        let shape = Shape::placed(vec![Shape::mesh(mesh)], Closing::Closed, &placement).unwrap();
        let errors = errors_of_lens(&through_lens(shape));
        (errors.iter().map(|(_, error)| error * error).sum::<f64>() / errors.len() as f64).sqrt()
    };
    let [coarse, fine] = [64, 128].map(|sides| {
        let mesh = meshed_ball(LENS.1, sides);
        [rms(mesh.clone()), rms(mesh.clone().smoothed(20.0)), rms(mesh.smoothed(0.01))]
    });
    for [flat, smooth, sharp] in [coarse, fine] {
        assert!(smooth < 0.1 * flat, "{flat} {smooth}");
        // Edges that turn by more than the limit stay sharp.
        assert!((sharp / flat - 1.0).abs() < 1e-6, "{flat} {sharp}");
    }
    // Flat faces are off by their size, smooth ones by its square.
    let [of_flat, of_smooth] = [0, 1].map(|k| coarse[k] / fine[k]);
    assert!((1.6..2.5).contains(&of_flat), "{of_flat} {coarse:?} {fine:?}");
    assert!(of_smooth > 3.0, "{of_smooth} {coarse:?} {fine:?}");
}

/// A turned rod that holds a ball, which holds a turned brick; beside the ball a mirror of both
/// sides and a white grain.
fn nested() -> Prototype {
    let (glass, ruby, gel) = (Region::Body(0), Region::Body(1), Region::Body(2));
    let white = SurfaceModel::Lambertian { reflectance: 1.0 };
    let mirror = SurfaceModel::Mirror { reflectance: 1.0 };
    let clear = SurfaceModel::Interface;
    let rotation = turned();
    let along = |by: f64| (rotation.z_axis * by).to_array();
    Prototype {
        media: vec![
            Medium::clear("glass", 1.5),
            Medium::clear("ruby", 2.0),
            Medium::clear("gel", 1.2),
        ],
        surfaces: vec![
            solid("rod", rod(0.8, 1.0, &at([0.0; 3], rotation, 0.0)), glass, Region::World, &clear),
            solid("ball", ball(0.5, &at(along(0.4), DMat3::IDENTITY, 0.0)), ruby, glass, &clear),
            solid(
                "brick",
                brick([0.1, 0.2, 0.3], &at(along(0.4), rotation.transpose(), 0.0)),
                gel,
                ruby,
                &clear,
            ),
            solid("sheet", disc(0.5, &at(along(-0.3), rotation, 0.0)), glass, glass, &mirror),
            solid(
                "grain",
                ball(0.2, &at(along(-0.6), DMat3::IDENTITY, 0.0)),
                Region::Opaque,
                glass,
                &white,
            ),
        ],
        sources: Vec::new(),
    }
}

/// The wall of a white furnace finds the same irradiance all over, whatever stands in it.
#[test]
fn a_white_furnace_stays_white_around_nested_solids() {
    for among in [false, true] {
        let radius = 2.0;
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(nested());
        if among {
            scene.array_solids(id);
        } else {
            scene.place(id, DVec3::ZERO);
        }
        let outcome = in_furnace(scene, radius);
        let ledger = &outcome.total.ledger;
        for name in ["rod", "ball", "brick"] {
            let line = ledger.surface(name).unwrap();
            // All that goes in comes out again, and a good part does.
            assert!(line.inward > 1e-3, "{name}: {line:?}");
        }
        for zone in 0..20 {
            let power = ledger.surface(&format!("zone {zone}")).unwrap().absorbed;
            assert_share("zone", power, 0.05, outcome.paths, 1e-6);
        }
    }
}

#[test]
fn packages_apart_all_see_what_stands_among_them() {
    // A black lid over two packages takes the same from either, whether they see each other or not.
    let lid = brick([20.0, 20.0, 0.1], &at([0.0, 0.0, 2.0], DMat3::IDENTITY, 0.0));
    let absorbed = |apart: bool| {
        let mut scene = SceneBuilder::new(Medium::air());
        let dome = package(N, Dome::smooth(&CAP), 0.95, 0.86).prototype().unwrap();
        let id = scene.prototype(dome);
        place_array(&mut scene, id, [2, 1], 8.0);
        scene.isolated(apart);
        let among = scene.prototype(Prototype {
            media: Vec::new(),
            surfaces: vec![solid(
                "lid",
                lid.clone(),
                Region::Opaque,
                Region::World,
                &SurfaceModel::Absorber,
            )],
            sources: Vec::new(),
        });
        scene.array_solids(among);
        let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many() / 20, 7));
        outcome.mean(|t| t.ledger.surface("lid").unwrap().absorbed)
    };
    let (apart, together) = (absorbed(true), absorbed(false));
    assert!(apart.value > 0.8 && together.value > 0.8, "{apart:?} {together:?}");
    // The neighbour turns a little of the light away, no more.
    assert!((apart.value - together.value).abs() < 0.02);
}

#[test]
fn a_sheet_reflects_from_both_sides_and_lets_nothing_through() {
    // An isotropic point above a large white sheet, tilted: half of the light meets it and comes
    // back.
    let rectangle = Extent::Rectangle { half_u: 300.0, half_v: 300.0 };
    let plane = Shape::Plane(Plane::new(DVec3::ZERO, DVec3::Z, rectangle).unwrap());
    let place = at([0.0; 3], DMat3::from_rotation_x(0.5 * PI - 0.2), 0.0);
    let sheet = Shape::placed(vec![plane], Closing::Open, &place).unwrap();
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype {
        media: Vec::new(),
        surfaces: vec![solid(
            "sheet",
            sheet,
            Region::World,
            Region::World,
            &SurfaceModel::Lambertian { reflectance: 0.7 },
        )],
        sources: Vec::new(),
    });
    scene.array_solids(id);
    for side in [-1.0, 1.0] {
        scene.source(Source::new(
            "lamp",
            DVec3::new(0.0, side * 0.5, 0.0),
            Region::World,
            Emitter::Point,
            Emission::Isotropic,
        ));
    }
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many() / 10, 5));
    let absorbed = outcome.mean(|t| t.ledger.surface("sheet").unwrap().absorbed);
    // But for the 0.1 % that pass by its edges.
    assert!((absorbed.value - 0.15).abs() < 5.0 * absorbed.standard_error + 3e-4, "{absorbed:?}");
    let line = outcome.total.ledger.surface("sheet").unwrap();
    assert!(line.inward == 0.0 && line.outward == 0.0, "{line:?}");
}

/// Two blocks of different glass that touch: each surface ends where the other begins, and light
/// passes between them at one face. In a white furnace as much goes in as out, and nothing is lost.
#[test]
fn clipped_surfaces_of_blocks_in_contact_are_closed() {
    let (one, two) = (Region::Body(0), Region::Body(1));
    let inset = 1e-9;
    for (apart, slant) in [(1.0, 0.0), (0.9, 0.0), (1.0, 0.4)] {
        let rotation = DMat3::from_rotation_z(slant);
        let lower = brick([0.5; 3], &at([0.0; 3], DMat3::IDENTITY, inset));
        let upper = brick([0.4, 0.6, 0.5], &at([0.1, 0.0, apart], rotation, inset));
        let clip = |solid: &Shape, keeps: bool| {
            vec![Clip { solid: solid.clone(), keeps, reaches_mm: vec![1e-8, 1e-6] }]
        };
        let ended = |solid: &Shape| {
            vec![Clip { solid: solid.clone(), keeps: false, reaches_mm: vec![0.0, 1e-8, 1e-6] }]
        };
        let clear = |name: &str, shape: Shape, inner: Region, outer: Region| {
            Surface::new(name, shape, inner, outer, &SurfaceModel::Interface)
        };
        // The upper block displaces the lower one.
        let surfaces = vec![
            clear("lower", lower.clipped(ended(&upper)), one, Region::World),
            clear("upper", upper.clipped(clip(&lower, false)), two, Region::World),
            clear("face", upper.clipped(clip(&lower, true)), two, one),
        ];
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(Prototype {
            media: vec![Medium::clear("crown", 1.5), Medium::clear("flint", 1.8)],
            surfaces,
            sources: Vec::new(),
        });
        scene.place(id, DVec3::ZERO);
        let outcome = in_furnace(scene, 3.0);
        let paths = outcome.paths as f64;
        for name in ["lower", "upper", "face"] {
            let line = outcome.total.ledger.surface(name).expect("a line");
            let error = 5.0 * ((line.outward + line.inward) / paths).sqrt();
            assert!(line.inward > 0.01, "{name}: {line:?}");
            assert!((line.outward - line.inward).abs() < error, "{name} {apart}: {line:?}");
        }
    }
}
