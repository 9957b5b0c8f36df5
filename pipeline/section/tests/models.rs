// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays in the plane against closed forms, and the three models beside each other.

use full_wave::{Polarisation, Resolution};
use geometry::profile::{Elements, Rounding, Shape, SphericalDome};
use results::full_wave::Model;
use section::compare::{Request, SourceRequest, body, compare};
use section::dome::{Base, Section, Surface};
use section::tables::{TableRequest, Tables, kx_per_zone};
use section::trace::{Scene, Traced, trace};
use std::f64::consts::{PI, TAU};

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

/// Largest difference of two far fields over its error, where it is more than `least`.
fn largest_deviation(a: &Traced, b: &Traced, least: f64) -> f64 {
    let apart = a.shares.combined(&b.shares, |a, b| a - b);
    let deviations = apart.mean().into_iter().zip(apart.errors());
    deviations.map(|(d, error)| (d.abs() - least) / error.max(1e-9)).fold(0.0, f64::max)
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
        let scene = Scene { surfaces: &surfaces, tables: None, index: INDEX, polarisation };
        let traced = trace(scene, &vec![vec![[0.0, 1e-9]]; 40], &edges(18), 200_000, 1);
        assert!(traced.lost < 1e-4, "lost {}", traced.lost);
        for (share, error) in traced.shares.mean().iter().zip(traced.shares.errors()) {
            assert!((share - 1.0 / 18.0).abs() < 5.0 * error, "{share} ± {error}");
        }
    }
}

/// Arcs of rounded tips and valleys, which bend from and to the centre, beside chains of 60 chords.
#[test]
#[ignore = "nightly: 11 s"]
fn nightly_rounded_corners_are_the_limit_of_many_chords() {
    let dome = SphericalDome { sphere_radius_mm: 2.0, height_mm: 1.5, radius_mm: 1.8 };
    let rounding = Rounding { tip_mm: 1e-5, valley_mm: 1.5e-5 };
    let relief = Elements { rounding, ..relief(Shape::Os1, 3) };
    let section = Section::new(&Base::Sphere(dome), &relief, 3, 1.2, 0.55, [1.3, 1.0]).unwrap();
    let chords = |surface: Surface| {
        let (centre, radius) = surface.arc.unwrap_or(([0.0; 2], 1.0));
        let count = if surface.arc.is_some() { 60 } else { 1 };
        let direction = |p: [f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
        let (first, last) = (direction(surface.start), direction(surface.end));
        let turn = (last - first + PI).rem_euclid(TAU) - PI;
        let point = move |i: usize| match i {
            0 => surface.start,
            i if i == count => surface.end,
            i => {
                let (sin, cos) = (first + turn * i as f64 / count as f64).sin_cos();
                [centre[0] + radius.abs() * cos, centre[1] + radius.abs() * sin]
            }
        };
        (0..count).map(move |i| Surface {
            start: point(i),
            end: point(i + 1),
            arc: None,
            ..surface
        })
    };
    let arcs = section.relief().unwrap();
    assert!(arcs.iter().any(|surface| surface.arc.is_some_and(|(_, radius)| radius < 0.0)));
    let lines: Vec<Surface> = arcs.iter().copied().flat_map(chords).collect();
    let places = SourceRequest { count: 240, ..SourceRequest::default() }.places(&section, 1);
    let at = |surfaces, seed| {
        let polarisation = Polarisation::Tm;
        let scene = Scene { surfaces, tables: None, index: [1.3, 1.0], polarisation };
        trace(scene, &places, &edges(36), 100_000, seed)
    };
    let (arcs, lines) = (at(&arcs, 1), at(&lines, 2));
    assert!(arcs.lost < 1e-3 && lines.lost < 1e-3, "lost {} and {}", arcs.lost, lines.lost);
    let deviation = largest_deviation(&arcs, &lines, 0.0);
    assert!(deviation < 5.0, "{deviation}");
}

/// A table whose orders are those of a smooth surface gives what Fresnel's formula gives: a step of
/// a thousandth of a wavelength.
#[test]
fn a_relief_far_below_the_wavelength_is_smooth() {
    let flat = Shape::Polyline(vec![[0.5, 1e-5]]);
    let section = paper(flat, 4, 4.0);
    let tables = Tables::solve(&section, TableRequest::default()).unwrap();
    let bands = section.bands();
    let places = SourceRequest { count: 24, ..SourceRequest::default() }.places(&section, 1);
    let at = |tables| {
        let polarisation = Polarisation::Tm;
        let scene = Scene { surfaces: &bands, tables, index: INDEX, polarisation };
        trace(scene, &places, &edges(36), 400_000, 3)
    };
    // Chords of tables are solved once a ring; the normal is that of the place.
    let deviation = largest_deviation(&at(None), &at(Some(&tables)), 2e-4);
    assert!(deviation < 5.0, "{deviation}");
}

/// A ring of 36 wavelengths has half of the nodes of a narrow one.
#[test]
#[ignore = "nightly: two tables of a ring of 20 µm (20 s)"]
fn nightly_nodes_of_a_wide_ring_are_enough() {
    let section = paper(Shape::Os1, 1, 20.0);
    assert_eq!([10.0, 36.0, 90.0].map(kx_per_zone), [8, 4, 2]);
    let surfaces = section.bands();
    let places = SourceRequest { count: 24, ..SourceRequest::default() }.places(&section, 1);
    let at = |kx_per_zone, seed| {
        let tables = Tables::solve(&section, TableRequest { kx_per_zone, tolerance: 1e-2 });
        let tables = tables.unwrap();
        let (tables, polarisation) = (Some(&tables), Polarisation::Te);
        let scene = Scene { surfaces: &surfaces, tables, index: INDEX, polarisation };
        trace(scene, &places, &edges(36), 1_000_000, seed)
    };
    let (few, many) = (at(None, 1), at(Some(8), 2));
    let largest = many.shares.mean().into_iter().fold(0.0, f64::max);
    let deviation = largest_deviation(&few, &many, 2e-3 * largest);
    assert!(deviation < 4.0, "{deviation}");
}

#[test]
#[ignore = "slow: 14 s"]
fn power_is_accounted_for_and_models_are_compared() {
    let section = paper(Shape::Os1, 2, 3.0);
    let resolution = Resolution { nodes_per_wavelength: 8.0, ..Resolution::default() };
    assert_eq!(body(&section, resolution).unwrap().cost().matrices, 2);
    let request = Request {
        sources: SourceRequest { count: 36, ..SourceRequest::default() },
        resolution,
        paths: 40_000,
        tables: TableRequest { tolerance: 1e-2, ..TableRequest::default() },
        ..Request::default()
    };
    let smooth = section.smooth();
    for (dome, models) in [
        (&section, &[Model::FullWave, Model::Hybrid, Model::Rays][..]),
        (&smooth, &[Model::FullWave, Model::Rays][..]),
    ] {
        let comparison = compare(dome, &request, None, |_| Ok(())).unwrap();
        assert!(comparison.balance < 1e-6, "{:e}", comparison.balance);
        assert!(comparison.far_fields.iter().map(|far| far.model).eq(models.iter().copied()));
        for far in &comparison.far_fields {
            let total: f64 = far.bins.iter().sum::<f64>();
            let missing = if far.model == Model::FullWave { 0.0 } else { far.missing };
            assert!((total + missing - 1.0).abs() < 1e-5, "{:?}: {total} + {missing}", far.model);
        }
        // Few paths and sources: the noise is stated, and no model is far off.
        assert_eq!(comparison.distances.len(), 3 * (models.len() - 1));
        for d in &comparison.distances {
            assert!(d.noise > 0.0 && d.rms > 0.0 && d.rms < 0.5, "{d:?}");
            assert!(d.rms <= d.largest && d.largest < 2.0, "{d:?}");
            assert!((d.rms.powi(2) - d.noise.powi(2) - d.square).abs() < 1e-9, "{d:?}");
        }
    }
}
