// SPDX-License-Identifier: MIT OR Apache-2.0
//! A circular cylinder with a line source inside, and half of it on a mirror, against the series.

use crate::radiated;
use crate::series::{series, worst};
use full_wave::{Body, Outline, Polarisation, Resolution};
use num_complex::Complex64;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn circle(radius: f64, arcs: usize, first: f64) -> Outline {
    let turn = TAU / arcs as f64;
    let at = |i: usize| {
        let angle = first + turn * i as f64;
        [radius * angle.cos(), radius * angle.sin()]
    };
    (1..=arcs).fold(Outline::closed(at(0)), |outline, i| outline.arc_to(at(i % arcs), turn))
}

/// Angles from z of the crate, and azimuths of the series from x.
fn directions() -> (Vec<f64>, Vec<f64>) {
    let angles: Vec<f64> = (0..360).map(|i| f64::from(i).to_radians()).collect();
    let azimuths = angles.iter().map(|angle| FRAC_PI_2 - angle).collect();
    (angles, azimuths)
}

fn check(radius: f64, arcs: usize, first: f64, resolution: f64, tolerance: f64) {
    let wavelength = 1.0;
    let index = [1.41, 1.0];
    let resolution = Resolution { nodes_per_wavelength: resolution, ..Resolution::default() };
    let outline = circle(radius, arcs, first);
    let body = Body::new(&outline, wavelength, index, resolution).unwrap();
    let places: [(f64, f64); 3] = [(0.02 * radius, 0.4), (0.3 * radius, 0.7), (0.6 * radius, 2.5)];
    let sources = places.map(|(rho, azimuth)| [rho * azimuth.cos(), rho * azimuth.sin()]);
    let (angles, azimuths) = directions();
    for polarisation in [Polarisation::Te, Polarisation::Tm] {
        let field = body.solve(polarisation, &sources).unwrap();
        let got = field.amplitudes(&angles);
        let (emitted, radiated) = (field.emitted(), radiated(&field, PI));
        for (i, (rho, azimuth)) in places.into_iter().enumerate() {
            let te = polarisation == Polarisation::Te;
            let expected = series(TAU * radius, index, te, (TAU * rho, azimuth), &azimuths);
            let error = worst(&got, i, &expected);
            let balance = (emitted[i] - radiated[i]).abs() / emitted[i];
            assert!(error < tolerance, "radius {radius}, {polarisation:?}, source {i}: {error:e}");
            assert!(
                balance < tolerance,
                "radius {radius}, {polarisation:?}, source {i}: {balance:e}"
            );
        }
    }
}

#[test]
fn a_cylinder_folded_by_its_symmetry() {
    check(5.0, 4, -FRAC_PI_2, 10.0, 1e-8);
}

#[test]
fn a_cylinder_without_symmetry() {
    check(5.0, 5, 0.3, 10.0, 1e-8);
}

#[test]
#[ignore = "nightly: half a minute"]
fn nightly_cylinders_of_20_and_50_wavelengths() {
    check(20.0, 4, -FRAC_PI_2, 10.0, 1e-8);
    check(50.0, 4, -FRAC_PI_2, 10.0, 1e-8);
}

#[test]
fn half_a_cylinder_on_a_mirror() {
    let (wavelength, index, radius) = (1.0, [1.41, 1.0], 5.0);
    let outline = Outline::on_mirror([radius, 0.0]).arc_to([-radius, 0.0], PI);
    let resolution = Resolution { nodes_per_wavelength: 10.0, ..Resolution::default() };
    let body = Body::new(&outline, wavelength, index, resolution).unwrap();
    let (rho, azimuth) = (2.0, 0.9_f64);
    let angles: Vec<f64> = (-89..90).map(|i| f64::from(i).to_radians()).collect();
    let azimuths: Vec<f64> = angles.iter().map(|angle| FRAC_PI_2 - angle).collect();
    for (polarisation, sign) in [(Polarisation::Te, -1.0), (Polarisation::Tm, 1.0)] {
        let source = [rho * azimuth.cos(), rho * azimuth.sin()];
        let field = body.solve(polarisation, &[source]).unwrap();
        let one = |azimuth| {
            series(
                TAU * radius,
                index,
                polarisation == Polarisation::Te,
                (TAU * rho, azimuth),
                &azimuths,
            )
        };
        let expected: Vec<Complex64> =
            one(azimuth).into_iter().zip(one(-azimuth)).map(|(a, b)| a + sign * b).collect();
        let error = worst(&field.amplitudes(&angles), 0, &expected);
        let balance = (field.emitted()[0] - radiated(&field, FRAC_PI_2)[0]).abs();
        assert!(error < 1e-8, "{polarisation:?}: {error:e}");
        assert!(balance < 1e-8, "{polarisation:?}: {balance:e}");
    }
}

/// A source as near to the outline as is allowed, with the nodes that a tolerance asks for.
#[test]
fn a_source_beside_the_outline() {
    let (index, radius) = ([1.41, 1.0], 5.0);
    let (angles, azimuths) = directions();
    for tolerance in [1e-3, 1e-5, 1e-7] {
        let outline = circle(radius, 4, -FRAC_PI_2);
        let body = Body::new(&outline, 1.0, index, Resolution::within(tolerance)).unwrap();
        let at = |clearances: f64| {
            let rho = radius - clearances * body.clearance();
            (rho, [rho * 0.4_f64.cos(), rho * 0.4_f64.sin()])
        };
        assert!(body.solve(Polarisation::Te, &[at(0.99).1]).is_err());
        let (rho, source) = at(1.01);
        for polarisation in [Polarisation::Te, Polarisation::Tm] {
            let field = body.solve(polarisation, &[source]).unwrap();
            let te = polarisation == Polarisation::Te;
            let expected = series(TAU * radius, index, te, (TAU * rho, 0.4), &azimuths);
            let error = worst(&field.amplitudes(&angles), 0, &expected);
            let balance = (field.emitted()[0] / radiated(&field, PI)[0] - 1.0).abs();
            assert!(error < tolerance, "{tolerance:e}, {polarisation:?}: {error:e}");
            assert!(balance < tolerance, "{tolerance:e}, {polarisation:?}: {balance:e}");
        }
    }
}
