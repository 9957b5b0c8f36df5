// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays in the plane against closed forms, and the three models beside each other.

use full_wave::{Polarisation, Resolution};
use geometry::profile::{Elements, Rounding, Shape, SphericalDome};
use results::full_wave::Model;
use section::compare::{Request, SourceRequest, body, compare};
use section::dome::{Base, Section};
use section::tables::{TableRequest, Tables, kx_per_zone};
use section::trace::{Scene, Traced, Trial, trace};

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

/// What meets the surface again is decided by its first meeting; where it goes then, by the second.
#[test]
fn a_smooth_surface_for_light_that_meets_it_again_changes_where_it_goes_alone() {
    let section = paper(Shape::Os1, 4, 3.0);
    let tables = Tables::solve(&section, TableRequest { tolerance: 1e-2, ..Default::default() });
    let tables = tables.unwrap();
    let (surfaces, tables) = (section.bands(), Some(&tables));
    let places = SourceRequest { count: 8, ..SourceRequest::default() }.places(&section);
    let at = |smooth_again, seed| {
        let trial = Trial { smooth_again, ..Trial::default() };
        let polarisation = Polarisation::Te;
        let scene = Scene { surfaces: &surfaces, tables, index: INDEX, polarisation, trial };
        trace(scene, &places, &edges(36), 400_000, seed)
    };
    let (plain, smooth) = (at(false, 1), at(true, 2));
    let share = plain.met_again;
    let error = (2.0 * share * (1.0 - share) / 400_000.0).sqrt();
    assert!(share > 0.05 && (share - smooth.met_again).abs() < 4.0 * error, "{share} ± {error}");
    for traced in [&plain, &smooth] {
        let total = traced.bins.iter().sum::<f64>() + traced.lost;
        assert!((total - 1.0).abs() < 1e-9, "{total}");
    }
    let chi_square = |a: &Traced, b: &Traced| {
        let bins = (0..36).map(|i| {
            let error = a.errors[i].hypot(b.errors[i]);
            ((a.bins[i] - b.bins[i]) / error.max(1e-9)).powi(2)
        });
        bins.sum::<f64>()
    };
    assert!(chi_square(&plain, &at(false, 3)) < 80.0);
    assert!(chi_square(&plain, &smooth) > 300.0, "{}", chi_square(&plain, &smooth));
}

/// A ring of 36 wavelengths has half of the nodes of a narrow one.
#[test]
#[ignore = "slow: two tables of a ring of 20 µm (20 s)"]
fn nodes_of_a_wide_ring_are_enough() {
    let section = paper(Shape::Os1, 1, 20.0);
    assert_eq!([10.0, 36.0, 90.0].map(kx_per_zone), [8, 4, 2]);
    let surfaces = section.bands();
    let places = SourceRequest { count: 8, ..SourceRequest::default() }.places(&section);
    let at = |kx_per_zone, seed| {
        let tables = Tables::solve(&section, TableRequest { kx_per_zone, tolerance: 1e-2 });
        let tables = tables.unwrap();
        let polarisation = Polarisation::Te;
        let (tables, trial) = (Some(&tables), Trial::default());
        let scene = Scene { surfaces: &surfaces, tables, index: INDEX, polarisation, trial };
        trace(scene, &places, &edges(36), 1_000_000, seed)
    };
    let (few, many) = (at(None, 1), at(Some(8), 2));
    let largest = many.bins.iter().copied().fold(0.0, f64::max);
    for i in 0..36 {
        let error = few.errors[i].hypot(many.errors[i]);
        let difference = (few.bins[i] - many.bins[i]).abs();
        assert!(difference < 4.0 * error + 2e-3 * largest, "bin {i}: {difference:e} ± {error:e}");
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
