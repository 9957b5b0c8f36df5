// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scenes whose answer is known in closed form, each within 5 standard errors.
//! Numbers: evaluation of the formulas in the comments; diffuse Fresnel reflectance after [Duntley
//! 1942].

use crate::common::package::Dome;
use crate::common::*;
use bsdf::Polarisation;
use std::sync::Arc;
use tracer::glam::DVec3;
use tracer::{
    Emission, Emitter, FarField, Medium, Prototype, Ray, Receiver, Region, SceneBuilder, Settings,
    Shape, Source, Surface, SurfaceModel,
};

/// Reflectance of a smooth interface for diffuse light from the outside, n > 1.
fn diffuse_external(n: f64) -> f64 {
    let (n2, n3, n4) = (n * n, n.powi(3), n.powi(4));
    0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
        + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * ((n - 1.0) / (n + 1.0)).ln()
        - 2.0 * n3 * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
        + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0).powi(2)) * n.ln()
}

/// ... and from the inside: etendue links the two.
fn diffuse_internal(n: f64) -> f64 {
    1.0 - (1.0 - diffuse_external(n)) / (n * n)
}

#[test]
fn diffuse_fresnel_formula_has_its_known_values() {
    for (n, external, internal) in [
        (1.33, 0.065_930_849_3, 0.471_949_148_8),
        (1.41, 0.078_335_481_6, 0.536_409_376_6),
        (1.5, 0.091_777_959_3, 0.596_345_759_7),
    ] {
        assert!((diffuse_external(n) - external).abs() < 1e-9);
        assert!((diffuse_internal(n) - internal).abs() < 1e-9);
    }
}

#[test]
fn index_matched_dome_changes_nothing() {
    let far = FarField::default();
    for dome in
        [Dome::smooth(&CAP), Dome::relief(staircase(17)), Dome::relief(teeth(17, 45.0, 10.0))]
    {
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(package(1.0, dome, 0.95, 0.86).prototype().unwrap());
        let scene = scene.place(id, DVec3::ZERO).build().unwrap();
        let outcome = trace(&scene, &[&far], &Settings::new(many() / 4, 41));
        assert!((outcome.total.ledger.extraction() - 1.0).abs() < 1e-12);
        assert!((outcome.total.ledger.escaped_up - 1.0).abs() < 1e-12);

        // Lambertian stays Lambertian: power in a ring is sin²(end) - sin²(start).
        for theta in 0..90 {
            let row = &outcome.total.readings[0][theta * far.phis()..(theta + 1) * far.phis()];
            let edge = |k: usize| (k as f64).to_radians().sin().powi(2);
            let expected = edge(theta + 1) - edge(theta);
            assert_share("power in a ring", row.iter().sum(), expected, outcome.paths, 0.0);
        }
    }
}

#[test]
#[ignore = "slow: many paths (4 s)"]
fn centred_point_source_leaves_a_sphere_undeviated() {
    let sphere = Shape::sphere(0.3, 2.0).unwrap();
    let sphere = Surface::new("sphere", sphere, BODY, Region::World, &SurfaceModel::Interface);
    let source = inside(DVec3::new(0.0, 0.0, 0.3), Emitter::Point, Emission::Isotropic);
    let scene = single(lamp(N, vec![sphere], source));

    // One flight is the first pass: T = 4n/(n + 1)².
    let first = trace(&scene, &[], &Settings { max_bounces: 1, ..Settings::new(many(), 42) });
    assert_share(
        "first pass",
        first.total.ledger.surfaces[0].outward,
        4.0 * N / (N + 1.0).powi(2),
        first.paths,
        0.0,
    );

    // With all reflections everything escapes, as isotropic as it began.
    let far = FarField::new(10.0, 30.0).unwrap();
    let all = trace(&scene, &[&far], &Settings::new(many() / 4, 43));
    assert!((all.total.ledger.escaped() - 1.0).abs() < 1e-12);
    for (bin, &power) in all.total.readings[0].iter().enumerate() {
        let expected = far.solid_angle(bin / far.phis()) / (4.0 * std::f64::consts::PI);
        assert_share("isotropic bin", power, expected, all.paths, 0.0);
    }
}

fn hemisphere(dome: &SurfaceModel, disc: f64) -> Prototype {
    let shape = Shape::sphere_zones(0.0, 1.0, &[1.0, 0.0]).unwrap();
    let base = Shape::annulus(0.0, 0.0, 1.001).unwrap();
    let surfaces = vec![
        Surface::new("dome", shape, BODY, Region::World, dome),
        Surface::new("base", base, Region::Opaque, BODY, &SurfaceModel::Absorber),
    ];
    lamp(N, surfaces, inside(DVec3::ZERO, Emitter::Disc { radius: disc }, Emission::LAMBERTIAN))
}

#[test]
fn lambertian_disc_under_a_hemisphere_passes_as_by_quadrature() {
    // First pass over the whole disc and hemisphere, by Sobol quadrature good to 2e-5.
    for (radius, expected) in [
        (0.1, 0.971_057),
        (0.3, 0.970_947),
        (0.5, 0.969_773),
        (1.0 / N, 0.952_109),
        (0.9, 0.741_591),
    ] {
        let scene = single(hemisphere(&SurfaceModel::Interface, radius));
        let outcome = trace(&scene, &[], &Settings { max_bounces: 1, ..Settings::new(many(), 44) });
        assert_share(
            "first pass",
            outcome.total.ledger.surface("dome").unwrap().outward,
            expected,
            outcome.paths,
            2e-5,
        );
    }
}

#[test]
fn total_reflection_under_a_hemisphere_starts_at_radius_over_n() {
    let critical = SurfaceModel::Scatter(Arc::new(NoFresnel { inner: N, outer: 1.0 }));
    let below =
        trace(&single(hemisphere(&critical, 1.0 / N - 1e-9)), &[], &Settings::new(many() / 4, 45));
    assert!((below.total.ledger.escaped() - 1.0).abs() < 1e-12);
    let beyond = trace(&single(hemisphere(&critical, 0.9)), &[], &Settings::new(many(), 46));
    assert_share("totally reflected", beyond.total.ledger.absorbed(), 0.206_71, beyond.paths, 2e-5);
}

/// Silicone between a back at z = -1 and a plane interface at z = 0.
fn half_space(n: f64, top: &SurfaceModel, back: &SurfaceModel, source: Source) -> Prototype {
    let surfaces = vec![
        Surface::new("top", Shape::horizontal(0.0).unwrap(), BODY, Region::World, top),
        Surface::new("back", Shape::horizontal(-1.0).unwrap(), Region::Opaque, BODY, back),
    ];
    lamp(n, surfaces, source)
}

#[test]
#[ignore = "slow: many paths (6 s)"]
fn plane_escape_has_its_closed_forms() {
    let point = || inside(DVec3::new(0.0, 0.0, -0.5), Emitter::Point, Emission::Isotropic);
    let paint = || inside(DVec3::new(0.0, 0.0, -1.0), Emitter::Point, Emission::LAMBERTIAN);
    for n in [1.33, N, 1.5] {
        let bare = SurfaceModel::Scatter(Arc::new(NoFresnel { inner: n, outer: 1.0 }));
        let mut cases = vec![
            ("isotropic", point(), bare.clone(), 0.5 * (1.0 - (1.0 - 1.0 / (n * n)).sqrt())),
            ("Lambertian", paint(), bare, 1.0 / (n * n)),
            (
                "Lambertian with Fresnel",
                paint(),
                SurfaceModel::Interface,
                1.0 - diffuse_internal(n),
            ),
        ];
        if n == N {
            cases.push(("isotropic with Fresnel", point(), SurfaceModel::Interface, 0.134_861_922));
        }
        for (what, source, top, expected) in cases {
            let scene = single(half_space(n, &top, &SurfaceModel::Absorber, source));
            let outcome = trace(&scene, &[], &Settings::new(many(), 47));
            assert_share(what, outcome.total.ledger.extraction(), expected, outcome.paths, 1e-9);
        }
    }
}

#[test]
fn diffuse_light_from_air_enters_as_its_closed_form() {
    let n = N;
    let surfaces = vec![
        Surface::new(
            "face",
            Shape::horizontal(0.0).unwrap(),
            Region::World,
            BODY,
            &SurfaceModel::Interface,
        ),
        Surface::new(
            "sink",
            Shape::horizontal(1.0).unwrap(),
            BODY,
            Region::Opaque,
            &SurfaceModel::Absorber,
        ),
    ];
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype {
        media: vec![Medium::clear("silicone", n)],
        surfaces,
        sources: vec![],
    });
    scene.place(id, DVec3::ZERO);
    let below = DVec3::new(0.0, 0.0, -1.0);
    scene.source(Source::new("sky", below, Region::World, Emitter::Point, Emission::LAMBERTIAN));
    let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many(), 48));
    assert_share(
        "reflected",
        outcome.total.ledger.escaped_down,
        diffuse_external(n),
        outcome.paths,
        0.0,
    );
}

#[test]
#[ignore = "slow: many paths (4 s)"]
fn diffuse_back_recycles() {
    let f = diffuse_internal(N);
    for (reflectance, seed) in [(0.0, 49), (0.5, 50), (0.9, 51), (1.0, 52)] {
        let source = inside(DVec3::new(0.0, 0.0, -1.0), Emitter::Point, Emission::LAMBERTIAN);
        let scene = single(half_space(
            N,
            &SurfaceModel::Interface,
            &SurfaceModel::Lambertian { reflectance },
            source,
        ));
        let outcome = trace(&scene, &[], &Settings::new(many(), seed));
        let expected = (1.0 - f) / (1.0 - reflectance * f);
        assert_share("escape", outcome.total.ledger.extraction(), expected, outcome.paths, 0.0);
    }
}

#[test]
#[ignore = "slow: many paths (4 s)"]
fn slab_emits_two_cones() {
    let surfaces = vec![
        Surface::new(
            "top",
            Shape::horizontal(0.5).unwrap(),
            BODY,
            Region::World,
            &SurfaceModel::Interface,
        ),
        Surface::new(
            "bottom",
            Shape::horizontal(-0.5).unwrap(),
            Region::World,
            BODY,
            &SurfaceModel::Interface,
        ),
    ];
    let scene = single(lamp(N, surfaces, inside(DVec3::ZERO, Emitter::Point, Emission::Isotropic)));
    let outcome = trace(&scene, &[], &Settings { max_bounces: 40, ..Settings::new(many(), 53) });
    let cones = 1.0 - (1.0 - 1.0 / (N * N)).sqrt();
    // Just inside of the critical angle more than 40 reflections are needed; that is 4e-5 of the
    // sphere.
    assert_share("two cones", outcome.total.ledger.escaped(), cones, outcome.paths, 4e-5);
    // The rest is trapped, and said to be.
    assert_share("trapped", outcome.total.ledger.lost[0], 1.0 - cones, outcome.paths, 4e-5);
}

#[test]
#[ignore = "slow: many paths (3 s)"]
fn cube_emits_the_union_of_six_cones() {
    let cube = Shape::cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)).unwrap();
    let cube = Surface::new("cube", cube, BODY, Region::World, &SurfaceModel::Interface);
    let scene =
        single(lamp(N, vec![cube], inside(DVec3::ZERO, Emitter::Point, Emission::Isotropic)));
    let outcome = trace(&scene, &[], &Settings { max_bounces: 150, ..Settings::new(many(), 54) });
    assert_share(
        "union of cones",
        outcome.total.ledger.escaped(),
        0.884_447_557,
        outcome.paths,
        4e-5,
    );
}

/// Bin 0: rays that leave at the angle of an aplanatic sphere, seemingly from its image point.
struct Aplanatic {
    sin_out: f64,
    image: DVec3,
}

impl Receiver for Aplanatic {
    fn bins(&self) -> usize {
        2
    }

    fn bin(&self, ray: &Ray, length: f64) -> Option<usize> {
        if length < f64::INFINITY {
            return None;
        }
        let to_image = self.image - ray.origin;
        let off = to_image - ray.direction * to_image.dot(ray.direction);
        let sin = ray.direction.x.hypot(ray.direction.y);
        let good =
            (sin - self.sin_out).abs() < 1e-10 && off.length() < 1e-10 && ray.direction.z > 0.0;
        Some(usize::from(!good))
    }
}

#[test]
fn weierstrass_sphere_is_aplanatic() {
    let radius = 1.7;
    for (angle, out) in [
        (10.0f64, 7.074_206_568f64),
        (30.0, 20.769_539_735),
        (60.0, 37.893_989_109),
        (85.0, 44.952_559_745),
    ] {
        let u = angle.to_radians();
        assert!(((u.sin() / N).asin().to_degrees() - out).abs() < 1e-8);
        let sphere = Shape::sphere(0.0, radius).unwrap();
        let sphere = Surface::new("sphere", sphere, BODY, Region::World, &SurfaceModel::Interface);
        let direction = DVec3::new(u.sin(), 0.0, u.cos());
        let source =
            inside(DVec3::new(0.0, 0.0, -radius / N), Emitter::Point, Emission::Beam { direction });
        let scene = single(lamp(N, vec![sphere], source));
        let receiver = Aplanatic { sin_out: u.sin() / N, image: DVec3::new(0.0, 0.0, -radius * N) };
        let settings = Settings { max_bounces: 2, ..Settings::new(many() / 10, 55) };
        let outcome = trace(&scene, &[&receiver], &settings);
        // Incidence has the sine of the exit angle, sin U/n, so there is no total reflection at any
        // U.
        let cos_i = (1.0 - (u.sin() / N).powi(2)).sqrt();
        let reflectance =
            bsdf::analytic::fresnel(N, 1.0, cos_i).for_polarisation(Polarisation::Unpolarised);
        let good = outcome.total.readings[0][0];
        assert_share("aplanatic", good, 1.0 - reflectance, outcome.paths, 0.0);
        assert!(outcome.total.readings[0][1] <= 0.0);
    }
}

#[test]
#[ignore = "slow: many paths (3 s)"]
fn incoherent_plate_reflects_and_absorbs() {
    // T = (1-R)² e^-a/(1 - R² e^-2a), R_total = R + R (1-R)² e^-2a/(1 - R² e^-2a).
    for (absorption, transmitted, reflected) in [
        (0.0, 0.943_743_515_9, 0.056_256_484_1),
        (0.1, 0.853_804_694_3, 0.051_301_871_6),
        (1.0, 0.346_932_345_5, 0.032_636_229_0),
    ] {
        let surfaces = vec![
            Surface::new(
                "top",
                Shape::horizontal(1.0).unwrap(),
                BODY,
                Region::World,
                &SurfaceModel::Interface,
            ),
            Surface::new(
                "bottom",
                Shape::horizontal(0.0).unwrap(),
                Region::World,
                BODY,
                &SurfaceModel::Interface,
            ),
        ];
        let glass = Medium::clear("glass", N).absorbing(absorption);
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(Prototype { media: vec![glass], surfaces, sources: vec![] });
        scene.place(id, DVec3::ZERO);
        let beam = Emission::Beam { direction: DVec3::Z };
        scene.source(Source::new(
            "beam",
            DVec3::new(0.0, 0.0, -1.0),
            Region::World,
            Emitter::Point,
            beam,
        ));
        let outcome = trace(&scene.build().unwrap(), &[], &Settings::new(many(), 56));
        let ledger = &outcome.total.ledger;
        assert_share("transmitted", ledger.escaped_up, transmitted, outcome.paths, 1e-10);
        assert_share("reflected", ledger.escaped_down, reflected, outcome.paths, 1e-10);
        let glass =
            ledger.media[ledger.lines.media.iter().position(|name| name == "glass").unwrap()];
        assert_share("absorbed", glass, 1.0 - transmitted - reflected, outcome.paths, 1e-9);
    }
}

/// A point in the middle of a half ball: nothing bends, so the far field of a Lambertian point
/// stays one, less the reflection at normal incidence, and what is reflected falls on the black
/// base.
#[test]
fn a_point_in_the_middle_of_a_half_ball_is_not_bent() {
    let dome = Shape::sphere_zones(0.0, 2.0, &[2.0, 0.0]).unwrap();
    let base = Shape::annulus(0.0, 0.0, 2.0 + 1e-9).unwrap();
    let surfaces = vec![
        Surface::new("dome", dome, BODY, Region::World, &SurfaceModel::Interface),
        Surface::new("base", base, Region::Opaque, BODY, &SurfaceModel::Absorber),
    ];
    let point = inside(DVec3::ZERO, Emitter::Point, Emission::LAMBERTIAN);
    let scene = single(lamp(N, surfaces, point));
    let far = FarField::new(10.0, 90.0).unwrap();
    let outcome = trace(&scene, &[&far], &Settings::new(1_000_000, 4));
    let through = 4.0 * N / ((N + 1.0) * (N + 1.0));
    for (row, bins) in outcome.total.readings[0].chunks(4).enumerate().take(9) {
        let sin2 = |k: usize| (10.0 * k as f64).to_radians().sin().powi(2);
        let expected = through * (sin2(row + 1) - sin2(row)) / 4.0;
        for bin in bins {
            assert_share("bin", *bin, expected, outcome.paths, 0.0);
        }
    }
}
