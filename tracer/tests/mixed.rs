// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reflectors that are partly mirrors and partly diffuse: what goes where, and what the pure kinds
//! have in common with them.

use crate::common::package::Dome;
use crate::common::*;
use tracer::glam::DVec3;
use tracer::{
    Emission, Emitter, Error, FarField, Medium, Mixed, Outcome, Polarisation, Region, Scene,
    SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel,
};

fn mixed(reflectance: f64, specular: f64) -> SurfaceModel {
    SurfaceModel::Mixed(Mixed { reflectance, specular })
}

/// A point over an endless floor.
fn over(floor: &SurfaceModel, emission: Emission) -> Result<Scene, Error> {
    let mut scene = SceneBuilder::new(Medium::air());
    let plane = Shape::horizontal(0.0)?;
    scene.surface(Surface::new("floor", plane, Region::Opaque, Region::World, floor));
    let at = DVec3::new(0.2, -0.1, 0.5);
    scene.source(Source::new("LED", at, Region::World, Emitter::Point, emission));
    scene.build()
}

/// Every path ends whole, so that readings times paths are counts.
fn whole(paths: u64, seed: u64) -> Settings {
    Settings { roulette_below: 1.0, ..Settings::new(paths, seed) }
}

/// Chi-square of counts of paths against probabilities, as a normal deviate [Wilson, Hilferty
/// 1931].
fn deviate(outcome: &Outcome, cells: &[(f64, f64)]) -> f64 {
    let paths = outcome.paths as f64;
    let chi2: f64 = cells.iter().map(|(share, p)| paths * (share - p).powi(2) / p).sum();
    let k = (cells.len() - 1) as f64;
    ((chi2 / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt()
}

#[test]
fn light_divides_as_stated_and_each_part_keeps_its_law() {
    let far = FarField::new(5.0, 30.0).unwrap();
    for (seed, (reflectance, specular)) in
        [(0.9, 0.7), (0.6, 0.25), (1.0, 0.5), (0.8, 0.999)].into_iter().enumerate()
    {
        let scene = over(&mixed(reflectance, specular), Emission::Isotropic).unwrap();
        let outcome = trace(&scene, &[&far], &whole(many() / 4, 41 + seed as u64));
        // With u = cos θ: a half of the light goes up at once, evenly over u, and so does what the
        // mirror turns; the cosine law is even over u².
        let zone = |theta: usize, power: i32| {
            let u = |k: usize| (k as f64 * 5.0).to_radians().cos().powi(power);
            (u(theta) - u(theta + 1)) / 12.0
        };
        let mut cells: Vec<(f64, f64)> = outcome.bins(0)[..18 * 12]
            .iter()
            .enumerate()
            .map(|(bin, estimate)| {
                let theta = bin / 12;
                let back = specular * zone(theta, 1) + (1.0 - specular) * zone(theta, 2);
                (estimate.value, 0.5 * (zone(theta, 1) + reflectance * back))
            })
            .collect();
        if reflectance < 1.0 {
            let absorbed = outcome.total.ledger.surface("floor").unwrap().absorbed;
            cells.push((absorbed, 0.5 * (1.0 - reflectance)));
        }
        let total: f64 = cells.iter().map(|cell| cell.1).sum();
        assert!((total - 1.0).abs() < 1e-12);
        // Four tests at 1 % with Šidák's correction.
        let z = deviate(&outcome, &cells);
        assert!((-4.0..2.81).contains(&z), "{reflectance} {specular}: {z}");
        // Another split would not have passed.
        let wrong: Vec<(f64, f64)> = cells
            .iter()
            .enumerate()
            .map(|(bin, &(share, p))| {
                let theta = (bin / 12).min(17);
                let moved = 0.5 * reflectance * 0.1 * (zone(theta, 1) - zone(theta, 2));
                (share, if bin < 18 * 12 { p + moved } else { p })
            })
            .collect();
        assert!(deviate(&outcome, &wrong) > 5.0);
    }
}

#[test]
fn parts_of_a_mixture_are_weighed_by_the_fraction() {
    // A beam of 8° about the axis from below against a ceiling: what comes back within 8° of the
    // nadir is the mirror's part and sin² 8° of the rest.
    let cone = Emission::Lambertian { half_angle_deg: 8.0 };
    let mut scene = SceneBuilder::new(Medium::air());
    let ceiling = Shape::annulus(1.0, 0.0, 1e4).unwrap();
    scene.surface(Surface::new(
        "ceiling",
        ceiling,
        Region::World,
        Region::Opaque,
        &mixed(0.85, 0.4),
    ));
    scene.source(Source::new("beam", DVec3::ZERO, Region::World, Emitter::Point, cone));
    let far = FarField::new(4.0, 90.0).unwrap();
    let outcome = trace(&scene.build().unwrap(), &[&far], &whole(many() / 10, 47));
    let bins = outcome.bins(0);
    let near: f64 = bins[bins.len() - 8..].iter().map(|bin| bin.value).sum();
    let expected = 0.85 * (0.4 + 0.6 * 8.0f64.to_radians().sin().powi(2));
    assert_share("within the beam", near, expected, outcome.paths, 1e-6);
    let absorbed = outcome.total.ledger.surface("ceiling").unwrap().absorbed;
    assert_share("absorbed", absorbed, 0.15, outcome.paths, 0.0);
}

#[test]
fn fractions_of_none_and_one_are_the_pure_kinds_to_the_last_bit() {
    let package = |optics: SurfaceModel| {
        let mut package = package(N, Dome::relief(staircase(17)), 1.0, 1.0);
        package.bottom = optics.clone();
        package.led.side = optics.clone();
        package.led.top = optics;
        single(package.prototype().unwrap())
    };
    let far = FarField::new(5.0, 30.0).unwrap();
    for polarisation in [Polarisation::Unpolarised, Polarisation::Carried] {
        let outcome = |optics: SurfaceModel| {
            let settings = Settings { polarisation, ..Settings::new(200_000, 5) };
            trace(&package(optics), &[&far], &settings)
        };
        for (fraction, pure) in [
            (1.0, SurfaceModel::Mirror { reflectance: 0.9 }),
            (0.0, SurfaceModel::Lambertian { reflectance: 0.9 }),
        ] {
            assert_eq!(
                outcome(mixed(0.9, fraction)).total,
                outcome(pure).total,
                "{fraction} {polarisation:?}"
            );
        }
    }
}

#[test]
fn mixtures_are_listed_as_scattering_and_pure_kinds_as_what_they_are() {
    for (fraction, listed) in [(0.5, true), (0.0, true), (1.0, false)] {
        let scene = over(&mixed(0.9, fraction), Emission::Isotropic).unwrap();
        let names = scene.scattering_surfaces();
        assert_eq!(names, vec!["floor".to_owned(); usize::from(listed)]);
    }
}

#[test]
fn shares_outside_of_none_to_one_are_refused() {
    for (reflectance, specular) in [(1.1, 0.5), (0.5, -0.1), (0.5, f64::NAN), (f64::NAN, 0.5)] {
        let error = over(&mixed(reflectance, specular), Emission::Isotropic)
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default();
        assert!(error.contains("'floor'"), "{error:?}");
    }
}
