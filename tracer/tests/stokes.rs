// SPDX-License-Identifier: MIT OR Apache-2.0
//! Receivers of Stokes parameters: reflection at Brewster's angle, Malus's law, a pile of plates,
//! Fresnel's rhomb; paths that divide.

use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::Arc;

use crate::common::*;
use bsdf::order_table::{JonesRow, OrderJones};
use bsdf::{Grid, OrderEfficiency, OrderTable, TableHeader};
use num_complex::Complex64;
use tracer::glam::DVec3;
use tracer::receiver::{Angles, DetectorRectangle, Facing, Layout, Sense};
use tracer::{
    Detector, Emission, Emitter, Filter, Measurement, Medium, Outcome, Polarisation, Prototype,
    Region, Scene, SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, run,
};

const GLASS: f64 = 1.5;

/// I, Q, U, V of a reading in W, each with its standard error.
type Stokes = [(f64, f64); 4];

fn detected(scene: &Scene, detectors: &[Detector], settings: &Settings) -> Outcome {
    run(scene, &receivers(detectors), settings).unwrap()
}

fn carried(paths: u64, seed: u64) -> Settings {
    Settings { polarisation: Polarisation::Carried, ..Settings::new(paths, seed) }
}

/// Sums over all bins of a detector.
fn sums(outcome: &Outcome, detector: usize) -> Stokes {
    std::array::from_fn(|parameter| {
        let of = outcome.jackknife(|totals| {
            let readings = &totals.readings[detector];
            let places = readings.len() / 4;
            readings[parameter * places..(parameter + 1) * places].iter().sum()
        });
        (of.value, of.standard_error)
    })
}

fn sphere() -> Detector {
    let angles = Angles::sphere(Layout::Between, 30.0, 30.0).unwrap();
    Detector::new("sky", Measurement::FarField(angles)).stokes()
}

fn up(high: f64, half: f64) -> DetectorRectangle {
    let centre = DVec3::new(0.0, 0.0, high);
    DetectorRectangle::new(Facing::Z(Sense::Plus), centre, [2.0 * half; 2], [2, 2]).unwrap()
}

/// A beam along `direction` onto glass without end, black a little below its surface.
fn plate(direction: DVec3) -> Scene {
    let body = Prototype {
        media: vec![Medium::clear("glass", GLASS)],
        surfaces: vec![
            Surface::new(
                "face",
                Shape::horizontal(0.0).unwrap(),
                BODY,
                Region::World,
                &SurfaceModel::Interface,
            ),
            Surface::new(
                "black",
                Shape::horizontal(-1.0).unwrap(),
                Region::Opaque,
                BODY,
                &SurfaceModel::Absorber,
            ),
        ],
        sources: Vec::new(),
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(body);
    scene.place(id, DVec3::ZERO);
    scene.source(Source::new(
        "lamp",
        -direction,
        Region::World,
        Emitter::Point,
        Emission::Beam { direction },
    ));
    scene.build().unwrap()
}

fn close(what: &str, (got, error): (f64, f64), expected: f64) {
    assert!(
        (got - expected).abs() <= 4.5 * error + 1e-12,
        "{what}: {got} ± {error} instead of {expected}"
    );
}

/// Light that comes back at Brewster's angle is s alone; through a polariser along u it would have the
/// cos² of Malus, (I + Q)/2 of the rectangle, and through one at 45° (I ± U)/2.
#[test]
fn at_brewsters_angle_s_alone_comes_back_and_malus_holds() {
    let theta = GLASS.atan();
    let strong = ((GLASS * GLASS - 1.0) / (GLASS * GLASS + 1.0)).powi(2);
    for azimuth in [0.0f64, 25.0, 45.0, 90.0, 160.0] {
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let across = DVec3::new(cos, sin, 0.0) * theta.sin();
        let scene = plate(across - DVec3::Z * theta.cos());
        let plane = Detector::new("plane", Measurement::Plane(up(3.0, 20.0))).stokes();
        let glow = Angles::cone(90.0, 15.0, 30.0).unwrap();
        let glow = Detector::new("glow", Measurement::Luminance(up(2.0, 20.0), glow)).stokes();
        let power = Detector::new("power", Measurement::Plane(up(3.0, 20.0)));
        let detectors = [sphere(), plane, glow, power];
        let outcome = detected(&scene, &detectors, &carried(many() / 100, 1));
        let whole = sums(&outcome, 0);
        let i = whole[0].0;
        close("I", whole[0], 0.5 * strong);
        // Far field and radiance have s level, as the plate has.
        for detector in [0, 2] {
            let [_, q, u, v] = sums(&outcome, detector);
            assert!((q.0 / i - 1.0).abs() < 1e-12, "{q:?} of {i}");
            assert!(u.0.abs() < 1e-12 * i && v.0.abs() < 1e-12 * i, "{u:?} {v:?}");
        }
        // The rectangle has s = v × k with v = y. The field is along z × k.
        let k = across + DVec3::Z * theta.cos();
        let field = DVec3::Z.cross(k).normalize();
        let s = DVec3::Y.cross(k).normalize();
        let chi = [field.dot(s), field.dot(s.cross(k))];
        let [of_plane, q, u, v] = sums(&outcome, 1);
        assert!((of_plane.0 / i - 1.0).abs() < 1e-12);
        assert!((0.5 * (i + q.0) / i - chi[0] * chi[0]).abs() < 1e-12, "{azimuth}");
        assert!((0.5 * (i + u.0) / i - 0.5 * (chi[0] + chi[1]).powi(2)).abs() < 1e-12);
        assert!(v.0.abs() < 1e-12 * i);
        // Reading more changes no path.
        let bins = |detector: usize| &outcome.total.readings[detector];
        assert_eq!(bins(1)[..4], bins(3)[..]);
    }
}

/// Light that a pile of plates lets pass is p by the closed form (1 - R)/(1 + (2m - 1) R) of each
/// polarisation [Born, Wolf 1999, section 1.5].
#[test]
fn a_pile_of_plates_is_a_polariser() {
    let plates = 6_i32;
    let count = 2 * plates;
    let theta = 1.1f64;
    let region = |k: i32| {
        if k == 0 || k == count { Region::World } else { Region::Body(k as u8 - 1) }
    };
    let index = |k: i32| if k % 2 == 0 { GLASS } else { 1.0 };
    let pile = Prototype {
        media: (0..count - 1).map(|k| Medium::clear(format!("medium {k}"), index(k))).collect(),
        surfaces: (0..count)
            .map(|k| {
                let shape = Shape::horizontal(-f64::from(k)).unwrap();
                let (inner, outer) = (region(k + 1), region(k));
                Surface::new(&format!("plane {k}"), shape, inner, outer, &SurfaceModel::Interface)
            })
            .collect(),
        sources: Vec::new(),
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(pile);
    scene.place(id, DVec3::ZERO);
    let direction = DVec3::new(0.6 * theta.sin(), -0.8 * theta.sin(), -theta.cos());
    scene.source(Source::new(
        "lamp",
        DVec3::Z,
        Region::World,
        Emitter::Point,
        Emission::Beam { direction },
    ));
    let scene = scene.build().unwrap();
    let cos_t = (1.0 - (theta.sin() / GLASS).powi(2)).sqrt();
    let (a, b) = (theta.cos(), cos_t);
    let r = [(a - GLASS * b) / (a + GLASS * b), (GLASS * a - b) / (GLASS * a + b)];
    let passed = r.map(|r| (1.0 - r * r) / (1.0 + f64::from(2 * plates - 1) * r * r));
    let outcome = detected(&scene, &[sphere()], &carried(many() / 40, 2));
    // Downwards: the last three rows of six; upwards the first three.
    let part = |parameter: usize, below: bool| {
        let of = outcome.jackknife(|totals| {
            let rows = if below { 36..72 } else { 0..36 };
            totals.readings[0][72 * parameter..][rows].iter().sum()
        });
        (of.value, of.standard_error)
    };
    close("I", part(0, true), 0.5 * (passed[0] + passed[1]));
    close("Q", part(1, true), 0.5 * (passed[0] - passed[1]));
    close("Q back", part(1, false), 0.5 * (passed[1] - passed[0]));
    for parameter in [2, 3] {
        assert!(part(parameter, true).0.abs() < 1e-12, "U, V");
    }
    assert!(passed[0] < 0.5 * passed[1], "{passed:?}");
}

/// A surface in the air that lets E along s + p pass and turns s - p back.
fn polariser() -> SurfaceModel {
    let grid = Grid {
        period: 0.9,
        wavelength: 1.0,
        index_inner: 1.0,
        index_outer: 1.0,
        kx_per_zone: 2,
        ky: vec![0.0, 0.4, 0.8],
    };
    let half = Complex64::from(0.5);
    let half_to = |to| OrderEfficiency::new(to, 0, 0.5);
    let shares = grid.rows(|side, _, _, _| vec![half_to(side), half_to(side.opposite())]);
    let table = OrderTable::build(TableHeader::default(), grid.clone(), shares).unwrap();
    let rows = grid.nodes().map(|id| JonesRow {
        node: id,
        orders: vec![
            OrderJones { to: id.side, order: 0, jones: [[half, -half], [-half, half]] },
            OrderJones { to: id.side.opposite(), order: 0, jones: [[half, half], [half, half]] },
        ],
    });
    SurfaceModel::Scatter(Arc::new(table.with_jones(rows).unwrap()))
}

/// Fresnel's rhomb: light at 45° enters a block by its end, is totally reflected twice at 54.6° and
/// leaves by the other end, nearly circular.
#[test]
fn fresnels_rhomb_gives_v() {
    let n = 1.51f64;
    let theta = f64::to_radians(54.6);
    // Inside it goes along (sin θ, 0, cos θ), so that before it has n cos θ along z.
    let cos_z = n * theta.cos();
    let direction = DVec3::new((1.0 - cos_z * cos_z).sqrt(), 0.0, cos_z);
    // The lamp shines in an air of its own below the polariser.
    let below = Region::Body(1);
    let corner = DVec3::new(2.8, 1.0, 0.5);
    let bench = Prototype {
        media: vec![Medium::clear("glass", n), Medium::clear("air below", 1.0)],
        surfaces: vec![
            Surface::new(
                "block",
                Shape::cuboid(DVec3::new(0.0, -1.0, -0.5), corner).unwrap(),
                BODY,
                Region::World,
                &SurfaceModel::Interface,
            ),
            Surface::new(
                "polariser",
                Shape::horizontal(-1.0).unwrap(),
                below,
                Region::World,
                &polariser(),
            ),
        ],
        sources: vec![Source::new(
            "lamp",
            -1.5 * direction / direction.x,
            below,
            Emitter::Point,
            Emission::Beam { direction },
        )],
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(bench);
    scene.place(id, DVec3::ZERO);
    let scene = scene.build().unwrap();
    // Polariser, end, two total reflections, end.
    let through = Filter { bounces: [5, 5], ..Filter::default() };
    let outcome = detected(&scene, &[sphere().filtered(through)], &carried(many() / 100, 4));
    let [i, q, u, v] = sums(&outcome, 0);

    // Both ends: cosines to x outside and inside.
    let (c1, c2) = (direction.x, theta.sin());
    let end = |a: f64, b: f64, n1: f64, n2: f64| {
        let flux = (n2 * b / (n1 * a)).sqrt();
        [2.0 * n1 * a / (n1 * a + n2 * b), 2.0 * n1 * a / (n2 * a + n1 * b)].map(|t| t * flux)
    };
    let (enter, leave) = (end(c1, c2, 1.0, n), end(c2, c1, n, 1.0));
    // Total reflection, waves as exp(-iωt): beyond the surface kz = +i√(n² sin² θ - 1).
    let beyond = Complex64::new(0.0, ((n * theta.sin()).powi(2) - 1.0).sqrt());
    let (a, one) = (n * theta.cos(), Complex64::ONE);
    let r = [(a - beyond) / (a + beyond), (one * a - n * n * beyond) / (a + n * n * beyond)];
    let field = [0, 1].map(|pol| FRAC_1_SQRT_2 * enter[pol] * r[pol] * r[pol] * leave[pol]);
    let w = field[0] * field[1].conj();
    let (s, p) = (field[0].norm_sqr(), field[1].norm_sqr());
    // The polariser passes half of unpolarised light.
    let expected = [s + p, s - p, 2.0 * w.re, -2.0 * w.im].map(|x| 0.5 * x);
    close("I", i, expected[0]);
    for (what, got, expected) in
        [("Q", q, expected[1]), ("U", u, expected[2]), ("V", v, expected[3])]
    {
        let (got, expected) = (got.0 / i.0, expected / (s + p) * 2.0);
        assert!((got - expected).abs() < 1e-6, "{what}: {got} {expected}");
    }
    assert!(v.0.abs() / i.0 > 0.95, "{v:?} {i:?}");
}

#[test]
fn unpolarised_light_reads_nothing_but_power_and_fluxes_stay_as_they_are() {
    let scene = plate(DVec3::new(0.3, 0.4, -0.75f64.sqrt()));
    let flux = Detector::new("face", Measurement::Flux("face".to_owned()));
    assert_eq!(flux.clone().stokes(), flux);
    assert_eq!((sphere().bins(), sphere().places()), (4 * 72, 72));
    assert_eq!(sphere().measures().len(), 4 * 72);
    let settings = Settings::new(64_000, 5);
    let outcome = detected(&scene, &[sphere()], &settings);
    let [i, q, u, v] = sums(&outcome, 0);
    assert!(i.0 > 0.01 && q.0 == 0.0 && u.0 == 0.0 && v.0 == 0.0);
}
