// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays in the plane against closed forms, and the three models beside each other.

use full_wave::{Polarisation, Resolution};
use geometry::profile::{Elements, Rounding, Shape, SphericalDome};
use results::full_wave::Model;
use section::compare::{Request, SourceRequest, body, compare};
use section::dome::{Base, Section};
use section::tables::{TableRequest, Tables};
use section::trace::{Scene, Trial, trace};

const INDEX: [f64; 2] = [1.41, 1.0];

fn relief(shape: Shape, count: usize) -> Elements {
    Elements { width_mm: 0.1, shapes: vec![shape; count], rounding: Rounding::default() }
}

/// The dome of the paper with rings of one shape.
fn paper(shape: Shape, rings: usize, width_um: f64) -> Section {
    let dome = SphericalDome { sphere_radius_mm: 2.0, height_mm: 1.0, radius_mm: 1.7 };
    let relief = relief(shape, 17);
    Section::new(&Base::Sphere(dome), &relief, rings, width_um, 0.55, INDEX).unwrap()
}

fn edges(count: usize) -> Vec<f64> {
    (0..=count).map(|i| (-90.0 + 180.0 / count as f64 * i as f64).to_radians()).collect()
}

/// From the centre of half a cylinder every ray meets the surface upright: whatever is reflected
/// comes back through the centre, and all angles are alike.
#[test]
fn light_from_the_centre_of_half_a_cylinder_is_uniform() {
    let half = SphericalDome { sphere_radius_mm: 1.0, height_mm: 1.0, radius_mm: 1.0 };
    let smooth = relief(Shape::Smooth, 10);
    let section = Section::new(&Base::Sphere(half), &smooth, 5, 10.0, 0.55, INDEX).unwrap();
    let surfaces = section.bands();
    for polarisation in [Polarisation::Te, Polarisation::Tm] {
        let scene = Scene {
            surfaces: &surfaces,
            tables: None,
            index: INDEX,
            polarisation,
            trial: Trial::default(),
        };
        let traced = trace(scene, &[[0.0, 1e-9]], &edges(18), 200_000, 1);
        assert!(traced.lost < 1e-4, "lost {}", traced.lost);
        for (share, error) in traced.bins.iter().zip(&traced.errors) {
            assert!((share - 1.0 / 18.0).abs() < 5.0 * error, "{share} ± {error}");
        }
    }
}

/// A table whose orders are those of a smooth surface gives what Fresnel's formula gives: a step of
/// a thousandth of a wavelength.
#[test]
fn a_relief_far_below_the_wavelength_is_smooth() {
    let flat = Shape::Polyline(vec![[0.5, 1e-5]]);
    let section = paper(flat, 4, 4.0);
    let tables = Tables::solve(&section, TableRequest::default()).unwrap();
    let bands = section.bands();
    let places = SourceRequest { count: 8, ..SourceRequest::default() }.places(&section);
    let at = |tables| {
        let polarisation = Polarisation::Tm;
        let scene =
            Scene { surfaces: &bands, tables, index: INDEX, polarisation, trial: Trial::default() };
        trace(scene, &places, &edges(36), 400_000, 3)
    };
    let (smooth, table) = (at(None), at(Some(&tables)));
    for i in 0..36 {
        let error = smooth.errors[i].hypot(table.errors[i]);
        let difference = (smooth.bins[i] - table.bins[i]).abs();
        // Chords of tables are solved once a ring; the normal is that of the place.
        assert!(difference < 5.0 * error + 2e-4, "bin {i}: {difference:e} ± {error:e}");
    }
}

#[test]
fn power_is_accounted_for_and_models_are_compared() {
    let section = paper(Shape::Os1, 2, 3.0);
    let resolution = Resolution { nodes_per_wavelength: 8.0, ..Resolution::default() };
    assert_eq!(body(&section, resolution).unwrap().cost().matrices, 2);
    let request = Request {
        sources: SourceRequest { count: 12, ..SourceRequest::default() },
        resolution,
        paths: 40_000,
        ..Request::default()
    };
    let found = compare(&section, &request, |_| Ok(())).unwrap();
    assert!(found.balance < 1e-6, "{:e}", found.balance);
    for far in &found.far_fields {
        let total: f64 = far.bins.iter().sum::<f64>();
        let missing = if far.model == Model::FullWave { 0.0 } else { far.missing };
        assert!((total + missing - 1.0).abs() < 1e-2, "{:?}: {total} + {missing}", far.model);
    }
    // Few paths and sources: the noise is stated, and no model is far off.
    for d in &found.distances {
        assert!(d.noise > 0.0 && d.rms > 0.0 && d.rms < 0.5, "{d:?}");
        assert!(d.rms <= d.largest && d.largest < 2.0, "{d:?}");
    }
}
