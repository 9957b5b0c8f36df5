// SPDX-License-Identifier: MIT OR Apache-2.0
//! Orders of a finite grating by full wave against those of the endless one by RCWA: a film with
//! triangular teeth in air, lit by a plane wave.

use full_wave::{Body, Field, Outline, Polarisation, Resolution};
use rcwa::relief::Layer;
use rcwa::relief::shapes::{Materials, triangle};
use rcwa::{Bloch, Pol, Side, Stack, Truncation, solve};
use std::f64::consts::{PI, TAU};

const WAVELENGTH: f64 = 0.55;
const INDEX: f64 = 1.41;
const PERIOD: f64 = 2.0;
const HEIGHT: f64 = 0.6;
const FILM: f64 = 0.5;
/// Angle of incidence, radians.
const ANGLE: f64 = 0.35;

/// The film with `teeth` teeth, an even number.
fn finite(teeth: usize, polarisation: Polarisation) -> Field {
    let half = 0.5 * PERIOD * teeth as f64;
    let mut outline = Outline::closed([-half, 0.0]).line_to([half, 0.0]).line_to([half, FILM]);
    for tooth in 0..teeth {
        let right = half - PERIOD * tooth as f64;
        outline =
            outline.line_to([right - 0.5 * PERIOD, FILM + HEIGHT]).line_to([right - PERIOD, FILM]);
    }
    let outline = outline.line_to([-half, 0.0]);
    assert!(outline.is_symmetric());
    let resolution = Resolution { nodes_per_wavelength: 8.0, ..Resolution::default() };
    let body = Body::new(&outline, WAVELENGTH, [INDEX, 1.0], resolution).unwrap();
    // From above: it travels down.
    body.scatter(polarisation, &[PI - ANGLE]).expect("a solution")
}

/// Side, sine of the angle and efficiency of the orders of the endless grating.
fn endless(polarisation: Pol) -> Vec<(Side, f64, f64)> {
    let materials = Materials::lossless(INDEX, 1.0);
    let relief = triangle(PERIOD, [0.5 * PERIOD, HEIGHT], materials).unwrap();
    // Relief of a stack points down, so that the light comes from its bottom.
    let mut layers = vec![Layer::uniform(FILM, INDEX.into()).unwrap()];
    layers.extend(relief.slices(96));
    let stack = Stack::new(WAVELENGTH, PERIOD, 1.0.into(), 1.0.into(), layers).unwrap();
    let bloch = Bloch::from_angles(&stack, Side::Bottom, ANGLE, 0.0);
    let scattering = solve(&stack, bloch, Truncation::new(16).unwrap()).unwrap();
    let order = |side, order: i32| {
        let sine = ANGLE.sin() + f64::from(order) * WAVELENGTH / PERIOD;
        let efficiency = scattering.efficiency((Side::Bottom, 0, polarisation), (side, order));
        (side, sine, efficiency)
    };
    [Side::Top, Side::Bottom]
        .into_iter()
        .flat_map(|side| scattering.orders(side).map(move |m| (side, m)))
        .map(|(side, m)| order(side, m))
        .collect()
}

/// Largest difference of an efficiency.
///
/// A wave of amplitude A over a length L has F = -2ik cosθ L A in its direction. The amplitude of
/// the others is 0 there, as L is a whole number of periods.
fn largest_error(teeth: usize, field: Polarisation, pol: Pol) -> f64 {
    let orders = endless(pol);
    let angles: Vec<f64> = orders
        .iter()
        .map(|(side, sine, _)| if *side == Side::Bottom { sine.asin() } else { PI - sine.asin() })
        .collect();
    let size = 2.0 * TAU * PERIOD * teeth as f64 / WAVELENGTH;
    let mut largest = 0.0_f64;
    for ((side, sine, expected), row) in
        orders.into_iter().zip(finite(teeth, field).amplitudes(&angles))
    {
        let cosine = (1.0 - sine * sine).sqrt();
        let [re, im] = [-row[0].im, row[0].re].map(|f| f / (size * cosine));
        // What passes straight on interferes with the light beside the film.
        let straight = side == Side::Top && (sine - ANGLE.sin()).abs() < 1e-12;
        let amplitude = (re + f64::from(u8::from(straight))).hypot(im);
        let efficiency = amplitude * amplitude * cosine / ANGLE.cos();
        largest = largest.max((efficiency - expected).abs());
    }
    largest
}

fn check(teeth: [usize; 3], tolerances: [f64; 3]) {
    for (field, pol) in [(Polarisation::Te, Pol::S), (Polarisation::Tm, Pol::P)] {
        let errors = teeth.map(|teeth| largest_error(teeth, field, pol));
        assert!(errors.iter().zip(tolerances).all(|(error, most)| *error < most), "{errors:?}");
        // Edges count as one over the number of teeth.
        for (errors, teeth) in errors.windows(2).zip(teeth.windows(2)) {
            let share = teeth[0] as f64 / teeth[1] as f64;
            assert!(errors[1] < 1.5 * share * errors[0], "{errors:?}");
        }
    }
}

#[test]
#[ignore = "nightly: forty teeth by full wave (60 s)"]
fn nightly_teeth_approach_the_endless_grating() {
    check([4, 8, 40], [0.07, 0.04, 0.01]);
}
