// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays on the axis to the last bit, through vertices, and along what they do not cross. No source
//! draws such rays, but files of rays may hold them.
//!
//! Source: geometry. A meridian is met on the axis where it begins or ends there, and nowhere else.

use std::sync::Arc;

use bsdf::Side;
use rand_pcg::Pcg64;

use crate::common::package::Dome;
use crate::common::*;
use tracer::RayRecord;
use tracer::glam::DVec3;
use tracer::random::{stream, unit};
use tracer::shape::{Bend, Element, Reach, Sides};
use tracer::{
    Control, Emission, Emitter, Interior, LedBox, Medium, Meridian, Prototype, Ray, RaySet,
    Settings, Shape, Source, Surface, SurfaceModel, run, run_rays,
};

const OFFSET: f64 = 4e-12;

/// Distances and sides of all that a ray meets that starts outside, each from the region where the
/// one before has left it.
fn walk(pieces: &[Shape], ray: &Ray) -> Vec<(f64, Side)> {
    let mut all: Vec<(f64, Side)> = Vec::new();
    loop {
        let (from, side) =
            all.last().map_or((0.0, Side::Outer), |(t, side)| (t - 4.0 * OFFSET, side.opposite()));
        let sides = match side {
            Side::Inner => Sides::Inner,
            Side::Outer => Sides::Outer,
        };
        let mut reach = Reach { from, to: f64::INFINITY };
        for piece in pieces {
            if let Some(hit) = piece.intersect(ray, reach, sides) {
                assert_eq!(hit.side, side);
                reach.to = hit.distance;
            }
        }
        if reach.to.is_infinite() {
            return all;
        }
        all.push((reach.to, side));
        assert!(all.len() < 1000, "{ray:?}");
    }
}

/// The stretch of a meridian from one point to another: a segment, or an arc where one of a drawn
/// centre stays beside the axis.
fn stretch(from: [f64; 2], to: [f64; 2], rng: &mut Pcg64) -> (Shape, bool) {
    let straight = || (Shape::frustum(from, to).unwrap(), false);
    if unit(rng) < 0.5 {
        return straight();
    }
    let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
    let along = [to[0] - from[0], to[1] - from[1]];
    // Of three kinds: any centre, one on the axis, or one at the height of an end, where an arc
    // that ends on the axis does so as a cusp.
    let aside = match (unit(rng) * 3.0) as u32 {
        0 => 2.0 * (unit(rng) - 0.5),
        1 => middle[0] / along[1],
        _ => -0.5 * along[1] / along[0],
    };
    let centre = [middle[0] - aside * along[1], middle[1] + aside * along[0]];
    let bend = if unit(rng) < 0.5 { Bend::Clockwise } else { Bend::Counterclockwise };
    if !centre[0].is_finite() || centre[0].abs() > 100.0 || centre[1].abs() > 100.0 {
        return straight();
    }
    Shape::arc(from, to, centre, bend).map_or_else(|_| straight(), |arc| (arc, true))
}

#[test]
fn rays_on_the_axis_meet_every_end_on_it_and_nothing_else() {
    let mut rng = stream(911, 0);
    let (mut arcs, mut met) = (0, 0);
    for number in 0..4000 {
        let mut points = vec![[0.0, 3.0 * unit(&mut rng)]];
        for _ in 0..=(unit(&mut rng) * 6.0) as u32 {
            let [_, z] = points[points.len() - 1];
            let drop = if unit(&mut rng) < 0.2 {
                0.0
            } else {
                // Slopes of all sizes.
                unit(&mut rng) * 10f64.powf(-12.0 * unit(&mut rng).powi(2))
            };
            points.push([0.01 + unit(&mut rng), z - drop]);
        }
        let [_, last] = points[points.len() - 1];
        points.push([0.0, last - unit(&mut rng)]);
        // The lower one first.
        let poles = [points[points.len() - 1][1], points[0][1]];

        let mixed: Vec<(Shape, bool)> =
            points.windows(2).map(|pair| stretch(pair[0], pair[1], &mut rng)).collect();
        arcs += mixed.iter().filter(|(_, arc)| *arc).count();
        let mixed: Vec<Shape> = mixed.into_iter().map(|(shape, _)| shape).collect();
        let whole = Shape::revolution(&Meridian::new(&[Element { points }]).unwrap());
        for pieces in [&mixed[..], &[whole]] {
            let start = 10.0 * unit(&mut rng);
            for (z, dz) in [(-8.0 - start, 1.0), (8.0 + start, -1.0)] {
                let ray =
                    Ray { origin: DVec3::new(0.0, 0.0, z), direction: DVec3::new(0.0, -0.0, dz) };
                let found = walk(pieces, &ray);
                assert_eq!(found.len(), poles.len(), "{number}: {found:?} {poles:?} {pieces:?}");
                let mut heights: Vec<f64> = found.iter().map(|(t, _)| z + dz * t).collect();
                heights.sort_by(f64::total_cmp);
                for (height, pole) in heights.iter().zip(&poles) {
                    assert!((height - pole).abs() < 2e-14, "{number}: {height} {pole}");
                }
                met += found.len();
            }
        }
    }
    assert!(arcs > 2000 && met > 20_000, "{arcs} {met}");
}

/// A random outline that r never goes back on, down to a level floor: every upright line within it
/// is in it once.
fn hat(rng: &mut Pcg64) -> (Vec<Shape>, Vec<[f64; 2]>) {
    let mut points = vec![[0.0, 2.0 + unit(rng)]];
    for _ in 0..2 + (unit(rng) * 8.0) as u32 {
        let [r, z] = points[points.len() - 1];
        let slope = 10f64.powf(-4.0 * unit(rng));
        match (unit(rng) * 4.0) as u32 {
            0 => points.push([r + 0.3 * unit(rng), z]),
            1 if r > 0.0 => points.push([r, 1.0 + unit(rng)]),
            2 => points.push([r + 0.3 * unit(rng), 1.0 + unit(rng)]),
            _ => points.push([r + 0.3 * slope, 1.0 + unit(rng)]),
        }
    }
    let [r, _] = points[points.len() - 1];
    points.push([r, 0.5]);
    points.push([0.0, 0.5]);
    let corners = points.clone();
    let pieces: Vec<Shape> =
        points.windows(2).map(|pair| Shape::frustum(pair[0], pair[1]).unwrap()).collect();
    (pieces, corners)
}

#[test]
fn upright_rays_through_vertices_go_in_once_and_come_out_once() {
    let mut rng = stream(912, 0);
    let mut rays = 0;
    for number in 0..3000 {
        let (pieces, corners) = hat(&mut rng);
        let whole =
            [Shape::revolution(&Meridian::new(&[Element { points: corners.clone() }]).unwrap())];
        let rim = corners[corners.len() - 2][0];
        let mut radii: Vec<f64> = corners.iter().map(|p| p[0]).filter(|r| *r < rim).collect();
        // Near the axis too, where the two roots of a cone are one but for rounding.
        let near = (0..20).map(|k| 1e-3 * 10f64.powi(-k));
        radii.extend(near.filter(|r| *r < rim));
        for radius in radii {
            for (x, y) in [(radius, 0.0), (0.0, -radius), (0.6 * radius, 0.8 * radius)] {
                for (z, dz) in [(-1.0, 1.0), (5.0, -1.0)] {
                    let ray = Ray { origin: DVec3::new(x, y, z), direction: DVec3::Z * dz };
                    for pieces in [&pieces[..], &whole] {
                        let found = walk(pieces, &ray);
                        let sides: Vec<Side> = found.iter().map(|(_, side)| *side).collect();
                        assert_eq!(
                            sides,
                            [Side::Outer, Side::Inner],
                            "{number}, {radius}: {ray:?} {corners:?}"
                        );
                        rays += 1;
                    }
                }
            }
        }
    }
    assert!(rays > 500_000, "{rays}");
}

#[test]
fn rays_through_a_tip_from_within_leave() {
    let mut rng = stream(913, 0);
    for number in 0..20_000 {
        // A cone on a floor, tip up: all that is aimed at the tip from the floor goes through.
        let (height, radius) = (0.05 + 3.0 * unit(&mut rng), 0.5 + unit(&mut rng));
        let pieces = [
            Shape::frustum([0.0, height], [radius, 0.0]).unwrap(),
            Shape::frustum([radius, 0.0], [0.0, 0.0]).unwrap(),
        ];
        let (sin, cos) = (std::f64::consts::TAU * unit(&mut rng)).sin_cos();
        let r = 0.99 * radius * unit(&mut rng);
        let tip = DVec3::Z * height;
        let direction = (tip - DVec3::new(r * cos, r * sin, 0.0)).normalize();
        for direction in [direction, -direction] {
            let ray = Ray { origin: tip - direction * 5.0, direction };
            let sides: Vec<Side> = walk(&pieces, &ray).iter().map(|(_, side)| *side).collect();
            assert_eq!(sides, [Side::Outer, Side::Inner], "{number}: {ray:?}");
        }
        // The middle of the floor, from anywhere.
        let ray = Ray { origin: DVec3::ZERO - direction * 5.0, direction };
        assert!(!walk(&pieces, &ray).is_empty(), "{number}: {ray:?}");
    }
}

#[test]
fn rays_that_only_touch_meet_nothing() {
    let cylinder = Shape::cylinder(1.0, -1.0, 1.0).unwrap();
    let cone = Shape::frustum([0.0, 1.0], [1.0, 0.0]).unwrap();
    let ball = Shape::arc([0.0, 1.0], [0.0, -1.0], [0.0, 0.0], Bend::Clockwise).unwrap();
    let touching = [
        (&cylinder, DVec3::new(1.0, -5.0, 0.0), DVec3::Y),
        (&cylinder, DVec3::new(1.0, 0.0, -5.0), DVec3::Z),
        (&cone, DVec3::new(-5.0, 0.0, 1.0), DVec3::X),
        (&cone, DVec3::new(0.0, 3.0, 1.0), -DVec3::Y),
        (&ball, DVec3::new(-5.0, 0.0, 1.0), DVec3::X),
        (&ball, DVec3::new(1.0, 0.0, -5.0), DVec3::Z),
    ];
    for (shape, origin, direction) in touching {
        let ray = Ray { origin, direction };
        let sides: Vec<Side> =
            walk(std::slice::from_ref(shape), &ray).iter().map(|(_, side)| *side).collect();
        // Rounding may let it in for the width of an atom, but then out again.
        assert!(sides.len().is_multiple_of(2), "{ray:?} {sides:?}");
    }
}

/// Rays straight up and down, on the axis, on every vertex of `radii` and aimed at the middle of
/// the bottom, from a height above all furniture.
fn file(radii: &[f32], height: f32) -> RaySet {
    let mut records = Vec::new();
    let mut add = |position: [f32; 3], direction: [f32; 3]| {
        records.push(RayRecord { position, direction, flux: 1.0, wavelength: 550.0 });
    };
    for zero in [0.0, -0.0] {
        for dz in [1.0, -1.0] {
            add([zero, zero, height], [zero, zero, dz]);
            add([zero, zero, height], [zero, -zero, dz]);
            for &r in radii {
                add([r, 0.0, height], [zero, zero, dz]);
                add([0.0, -r, height], [zero, -zero, dz]);
            }
        }
    }
    RaySet::new(records).unwrap()
}

fn interior(rim: f64) -> Interior {
    Interior {
        rim,
        foot: 0.0,
        size: 2.0,
        silicone: Medium::clear("silicone", 1.41).absorbing(1e-3),
        side: SurfaceModel::Interface,
        bottom: SurfaceModel::Mirror { reflectance: 0.9 },
        led: LedBox {
            size: DVec3::new(0.8, 0.8, 0.3),
            side: SurfaceModel::Mirror { reflectance: 0.8 },
            top: SurfaceModel::Mirror { reflectance: 0.9 },
        },
    }
}

fn lit_by(mut prototype: Prototype, rays: RaySet) -> Prototype {
    prototype.sources = vec![Source::new(
        "file",
        DVec3::ZERO,
        BODY,
        Emitter::Point,
        Emission::Rays(Arc::new(rays)),
    )];
    prototype
}

#[test]
fn files_of_upright_rays_lose_none_in_any_dome() {
    // Those of the steps but for rounding, and some that have none.
    let radii: Vec<f32> = (1..=12).map(|k| 0.1 * k as f32).collect();
    let exact: Vec<f32> = (1..16).map(|k| k as f32 / 16.0).collect();
    let of_package = |dome: Dome| package(1.41, dome, 0.9, 0.9).prototype().unwrap();
    let arcs = |arcs: Vec<Shape>, rim: f64| {
        let mut body = interior(rim).prototype().unwrap();
        let dome =
            |arc| Surface::new("dome", arc, BODY, tracer::Region::World, &SurfaceModel::Interface);
        body.surfaces.extend(arcs.into_iter().map(dome));
        body
    };
    let foot = 1.6f64;
    let bodies = [
        ("smooth", of_package(Dome::smooth(&CAP))),
        ("17 steps", of_package(Dome::relief(staircase(17)))),
        ("teeth", of_package(Dome::relief(teeth(17, 50.0, 40.0)))),
        ("blunt teeth", of_package(Dome::relief(teeth(17, 1e-4, 40.0)))),
        ("overhanging", of_package(Dome::relief(teeth(60, 45.0, 10.0)))),
        (
            "ball",
            arcs(
                vec![Shape::arc([0.0, 1.6], [foot, 0.0], [0.0, 0.0], Bend::Clockwise).unwrap()],
                foot,
            ),
        ),
        (
            "spindle",
            arcs(
                vec![Shape::arc([0.0, 1.6], [1.6, 0.0], [-0.2, -0.2], Bend::Clockwise).unwrap()],
                foot,
            ),
        ),
        (
            "hollow and cone",
            arcs(
                vec![
                    Shape::arc([0.0, 0.7], [0.8, 1.1], [0.0, 1.7], Bend::Counterclockwise).unwrap(),
                    Shape::frustum([0.8, 1.1], [1.6, 0.0]).unwrap(),
                ],
                foot,
            ),
        ),
        (
            "cusp",
            arcs(
                vec![
                    Shape::arc([0.0, 1.6], [1.6, 0.0], [1.6, 1.6], Bend::Counterclockwise).unwrap(),
                ],
                foot,
            ),
        ),
    ];
    for (name, body) in bodies {
        for radii in [&radii, &exact] {
            let few: Vec<f32> = if name == "cusp" { vec![] } else { radii.clone() };
            let scene = single(lit_by(body.clone(), file(&few, 0.5)));
            let settings = Settings::new(100_000, 8);
            let together = run(&scene, &[], &settings).unwrap();
            let alone = run_rays(&scene, &settings, Control::default(), |_, _| Ok(())).unwrap();
            for (way, outcome) in [("together", &together), ("one by one", &alone)] {
                let ledger = &outcome.total.ledger;
                assert_none_lost(&format!("{name}, {way}"), outcome);
                // What goes down within the box meets it, whatever the sign of a direction that is
                // 0.
                let line = |wanted: &str| {
                    let mut lines = ledger.named_surfaces();
                    lines.find(|(n, _)| *n == wanted).unwrap().1.absorbed
                };
                assert!(line("box top") > 0.01, "{name}, {way}");
            }
            let lines = |o: &tracer::Outcome| -> Vec<f64> {
                let ledger = &o.total.ledger;
                ledger.named_surfaces().map(|(_, l)| l.absorbed).collect()
            };
            for (a, b) in lines(&together).into_iter().zip(lines(&alone)) {
                assert!((a - b).abs() < 0.02, "{name}: {a} {b}");
            }
        }
    }
}
