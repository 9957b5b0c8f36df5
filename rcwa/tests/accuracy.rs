// SPDX-License-Identifier: MIT OR Apache-2.0
//! Searches for a tolerance from periods far below the wavelength to fifty of them, of dielectrics
//! and metals: the stated error bounds the distance to solutions of many orders, or the search says
//! that it has not settled.

use crate::support::real;
use num_complex::Complex64;
use rcwa::accuracy::{
    Structure, Waves, converge_hemisphere, converge_waves, hemisphere_change, largest_change,
};
use rcwa::hemisphere::{Interface, Resolution};
use rcwa::lines::{
    Direction, LinesRequest, SolvedDirections, ToleranceRequest, converge_directions,
    error_of_directions, solve_directions,
};
use rcwa::relief::Layer;
use rcwa::relief::shapes::{self, Materials};
use rcwa::{Bloch, Error, Pol, Side, Stack, Truncation, no_progress};

/// Periods in wavelengths: either side of where half a zone sends no light, and far from it.
const PERIODS: [f64; 6] = [0.05, 0.3, 0.499, 0.501, 0.7, 2.0];

const ALUMINIUM: Complex64 = Complex64::new(0.96, 6.7);

/// Ridges at a wavelength of 1 between air and `below`.
fn lamella(period: f64, fill: f64, ridge: Complex64, below: Complex64) -> Interface {
    let relief = shapes::lamellar(period, 0.33, fill, Materials { ridge, groove: real(1.0) });
    Interface { relief: relief.unwrap(), wavelength: 1.0, n_top: real(1.0), n_bottom: below }
}

/// Reflectance from the top in s and p at some directions, in the plane of incidence and off it.
fn reflectances(stack: &Stack, highest: usize) -> Result<Vec<f64>, Error> {
    let mut all = Vec::new();
    for (kx, ky) in [(0.0, 0.0), (0.174, 0.0), (0.3, 0.5)] {
        let s = rcwa::solve(stack, Bloch::new(kx, ky), Truncation::new(highest)?)?;
        all.extend(Pol::BOTH.map(|pol| s.total((Side::Top, 0, pol), Side::Top)));
    }
    Ok(all)
}

/// Reflectances in the limit, by many orders and by a few less; the second is what they are off by.
fn limit(interface: &Interface) -> (Vec<f64>, f64) {
    let stack = interface.stack(&interface.relief.slice_plan(1)).unwrap();
    let many = 80 + interface.highest_order();
    let [all, less] = [many, 4 * many / 5].map(|m| reflectances(&stack, m).unwrap());
    let own = largest_change(&all, &less);
    (all, own)
}

/// Error of a hemisphere's resolution and the stated one; `None` if it has not settled.
fn searched(interface: &Interface, tolerance: f64) -> Option<(f64, f64, usize)> {
    let found = converge_hemisphere(interface, tolerance, &no_progress);
    let (resolution, estimate) = match found {
        Err(Error::NotConverged { .. }) => return None,
        other => other.unwrap(),
    };
    let stack = interface.stack(&resolution.plan).unwrap();
    let here = reflectances(&stack, resolution.truncation.highest()).unwrap();
    let (there, own) = limit(interface);
    let error = (hemisphere_change(&here, &there) - 5.0 * own).max(0.0);
    Some((error, estimate, resolution.truncation.highest()))
}

/// Checks silicone and silicon at these periods.
fn dielectrics_keep(periods: &[f64], tolerances: &[f64]) {
    for (index, fill) in [(1.41, 0.5), (3.48, 0.6)] {
        for &period in periods {
            let interface = lamella(period, fill, real(index), real(1.41));
            for &tolerance in tolerances {
                let (error, estimate, m) = searched(&interface, tolerance)
                    .unwrap_or_else(|| panic!("{index}, {period}: has not settled"));
                assert!(
                    error <= estimate && estimate <= tolerance,
                    "index {index}, period {period}: {error:.1e}, stated {estimate:.1e}, M = {m}"
                );
            }
        }
    }
}

#[test]
#[ignore = "nightly: 17 s"]
fn nightly_dielectrics_of_any_period_keep_their_tolerance() {
    dielectrics_keep(&PERIODS, &[1e-2, 1e-3]);
}

#[test]
#[ignore = "nightly: up to 231 orders (30 s)"]
fn nightly_dielectrics_of_long_periods_keep_their_tolerance() {
    dielectrics_keep(&[10.0], &[1e-2]);
}

#[test]
fn metals_of_any_period_keep_their_tolerance_or_do_not_settle() {
    let (tolerance, mut settled) = (5e-2, 0);
    for period in [0.05, 0.499, 0.501, 1.1] {
        let interface = lamella(period, 1.0 / 3.0, ALUMINIUM, real(1.5));
        let Some((error, estimate, m)) = searched(&interface, tolerance) else {
            continue;
        };
        settled += 1;
        assert!(
            error <= estimate && estimate <= tolerance,
            "period {period}: {error:.1e}, stated {estimate:.1e}, M = {m}"
        );
    }
    assert!(settled >= 3, "{settled}");
}

/// The silicon grating whose transmittance was off by a sixth at any tolerance.
#[test]
fn silicon_below_half_a_wavelength_is_right() {
    let relief = shapes::lamellar(0.6, 0.4, 0.6, Materials::lossless(3.48, 1.0)).unwrap();
    let grating = Interface { relief, wavelength: 1.2, n_top: real(1.0), n_bottom: real(1.0) };
    let (found, _) = converge_hemisphere(&grating, 1e-3, &no_progress).unwrap();
    let stack = grating.stack(&found.plan).unwrap();
    let bloch = Bloch::from_angles(&stack, Side::Top, 10f64.to_radians(), 0.0);
    let solved = rcwa::solve(&stack, bloch, found.truncation).unwrap();
    let transmitted = solved.total((Side::Top, 0, Pol::P), Side::Bottom);
    // Single directions may be off by three times the tolerance of a hemisphere.
    assert!((transmitted - 0.3274).abs() < 3e-3, "{transmitted} with {found:?}");

    let request = ToleranceRequest {
        interface: &grating,
        side: Side::Top,
        directions: &[Direction { kx: bloch.kx0, ky: 0.0, azimuth: 0.0 }],
        tolerance: 1e-3,
        first: None,
    };
    let found = converge_directions(&request, &no_progress).unwrap();
    let orders = &found.answer.orders[0].efficiencies;
    let below = orders.iter().filter(|order| order.0 == Side::Bottom);
    let transmitted: f64 = below.map(|order| order.2[1].iter().sum::<f64>()).sum();
    assert!((transmitted - 0.3274).abs() < 1e-3, "{transmitted} with {:?}", found.resolution);
}

/// Reflectance of one wave of layers by a search, with the stated error.
fn layers(stack: &Stack, pol: Pol, tolerance: f64) -> (f64, f64, usize) {
    let solve = |at: &Resolution| {
        let s = rcwa::solve(stack, Bloch::new(0.0, 0.0), at.truncation)?;
        Ok(s.total((Side::Top, 0, pol), Side::Top))
    };
    let distance = |a: &f64, b: &f64| (a - b).abs();
    let waves = Waves { solve: &solve, distance: &distance, highest_order: 0, first: None };
    let structure = Structure::Layers(stack);
    let found = converge_waves(structure, &waves, tolerance, &no_progress).unwrap();
    (found.answer, found.errors.sum(), found.resolution.truncation.highest())
}

/// Silver ridges under glass, in TM: efficiencies of every third order lie on curves of their own.
#[test]
fn silver_in_tm_states_an_error_that_bounds() {
    let silver = Complex64::new(0.132_151_433_575_751_74, 2.765_766_440_138_452);
    let glass = real(1.5);
    let third = 1.0 / 3.0;
    let ridge = crate::support::layer(80.0, &[(third, glass), (2.0 * third, silver), (1.0, glass)]);
    let film = Layer::uniform(20.0, glass).unwrap();
    let stack = Stack::new(500.0, 180.0, real(1.0), silver, vec![film, ridge]).unwrap();
    let (reflectance, stated, _) = layers(&stack, Pol::P, 3e-2);
    // The limit of many more orders in stretched coordinates.
    assert!((reflectance - 0.7857).abs() <= stated + 1e-3, "{reflectance}, {stated:.1e}");
}

/// A silver sinusoid of 1200 grooves per mm and 100 nm at 633 nm, as 64 chords.
fn silver_sinusoid() -> Interface {
    let silver = Complex64::new(0.0562, 4.2776);
    // Ridges of the top half-space, seen from below, are ridges of a substrate.
    let materials = Materials { ridge: silver, groove: real(1.0) };
    let relief = shapes::sinusoid(1.0 / 1.2, 0.1, 64, materials).unwrap();
    Interface { relief, wavelength: 0.633, n_top: silver, n_bottom: real(1.0) }
}

/// Largest departure of the orders reflected in TM at 10 degrees from those by coordinate
/// transformation (the C method of Chandezon, converged to 1e-10).
fn off_in_tm(solved: &SolvedDirections) -> f64 {
    let known = [(-1, 0.278_582), (0, 0.440_264), (1, 0.268_048)];
    let reflected = solved.orders[0].efficiencies.iter().filter(|order| order.0 == Side::Bottom);
    let of = |(_, order, shares): &(Side, i32, [[f64; 2]; 2])| {
        let known = known.iter().find(|known| known.0 == *order).map_or(0.0, |known| known.1);
        (shares[1].iter().sum::<f64>() - known).abs()
    };
    reflected.map(of).fold(0.0, f64::max)
}

#[test]
#[ignore = "nightly: metal in TM by stairs (15 s)"]
fn nightly_a_metal_relief_in_tm_gives_what_is_reached_with_an_error_that_bounds() {
    let interface = silver_sinusoid();
    let direction = Direction { kx: 10f64.to_radians().sin(), ky: 0.0, azimuth: 0.0 };
    let (side, directions) = (Side::Bottom, [direction]);
    let request = ToleranceRequest {
        interface: &interface,
        side,
        directions: &directions,
        tolerance: 1e-2,
        first: None,
    };
    let found = converge_directions(&request, &no_progress).unwrap();
    let (off, stated) = (off_in_tm(&found.answer), found.errors.sum());
    assert!(off < stated && stated < 0.5, "off by {off:.1e}, stated {stated:.1e}");
    assert!(found.missed(1e-2, 1).is_some());

    for orders in [12, 20, 30] {
        let truncation = Truncation::new(orders).unwrap();
        let at = Resolution { truncation, plan: interface.relief.slice_plan(64) };
        let stacks = interface.stacks(&at).unwrap();
        let request = LinesRequest { stacks: &stacks, truncation, side, jones: false };
        let solved = solve_directions(request, &directions, &|_| (), &no_progress).unwrap();
        let incident = (side, directions.as_slice());
        let stated =
            error_of_directions(&interface, incident, &at, &solved, &|_| (), &no_progress).unwrap();
        let off = off_in_tm(&solved);
        assert!(off < stated && stated < 1.0, "{orders}: off by {off:.1e}, stated {stated:.1e}");
    }
}

/// Far below the wavelength lamellae are a film, and the orders' wavevectors leave few digits.
#[test]
fn periods_far_below_the_wavelength_are_right_or_refused() {
    let stack = |period: f64| {
        let ridge = crate::support::layer(0.3, &[(0.4, real(2.5)), (1.0, real(1.5))]);
        Stack::new(1.0, period, real(1.0), real(1.5), vec![ridge]).unwrap()
    };
    for period in [1e-3, 1e-4] {
        let (reflectance, stated, m) = layers(&stack(period), Pol::S, 1e-3);
        let off = (reflectance - 0.088_278).abs();
        assert!(off <= stated && stated <= 1e-3, "{period}: off by {off:.1e}, {stated:.1e}, M {m}");
    }
    let many = Truncation::new(80).unwrap();
    let error = rcwa::solve(&stack(1e-5), Bloch::new(0.0, 0.0), many).unwrap_err();
    assert!(matches!(error, Error::Rounding { .. }), "{error}");
    let (_, stated, _) = layers(&stack(1e-5), Pol::S, 1e-5);
    assert!(stated > 1e-5, "{stated:.1e}");
}
